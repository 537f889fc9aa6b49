"""The smoothed Stribeck law, as a helper that inlines into the lane loops.

f(v) = g(v) [(mu_s - mu_d) / (1 + tau |v|) + mu_d] with the smoothed direction g(v) = (2/pi) atan(eps v).
"""

from __future__ import annotations

import numpy as np

from nsdrill.abi import inlined
from nsdrill.elementary import TWO_OVER_PI, direction_joined, direction_reduced, fma


@inlined
def slip_factors(speed: float, unit: float, smoothing: float, decay: float) -> tuple[float, float, float]:
    """(g(v), 1 / (1 + tau |v|), 1 / unit) at a slip speed v = speed / unit, unit positive. One division, of the product
    of all that is divided by, serves every quotient."""
    scaled = smoothing * speed
    above, below, base = direction_reduced(scaled, unit)
    decayed = fma(decay, abs(speed), unit)
    both = below * decayed
    inverse = 1.0 / (both * unit)
    per_both = unit * inverse
    g = direction_joined(scaled, above * decayed * per_both, base)
    return g, below * unit * per_both, both * inverse


@inlined
def coefficient(
    speed: float, g: float, decayed: float, per_flat: float, smoothing: float, decay: float, rise: float, dynamic: float
) -> tuple[float, float]:
    """(f(v), f'(v)) from what :func:`slip_factors` gives and 1 / (1 + (eps v)^2); ``rise`` is mu_s - mu_d."""
    m = fma(rise, decayed, dynamic)
    fall = rise * decay * decayed * decayed
    return g * m, fma(TWO_OVER_PI * smoothing * per_flat, m, g * (fall if speed < 0.0 else -fall))


@inlined
def shared(
    slip: float, along: float, unit: float, smoothing: float, decay: float, rise: float, dynamic: float
) -> tuple[float, float]:
    """(f(|v|) / (|v| unit), 1 / unit) at a slip v = (slip, along) / unit in two directions, unit positive: times a
    component of v unit it is the share of the coefficient that acts against that."""
    # The floor matters at rest only, where the quotient has a limit.
    size = np.sqrt(fma(slip, slip, fma(along, along, 1e-60)))
    g, decayed, per_unit = slip_factors(size, unit, smoothing, decay)
    return g * fma(rise, decayed, dynamic) / size, per_unit
