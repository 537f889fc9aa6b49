"""The friction laws as helpers that inline into the lane loops.

f(v) = g(v) [(mu_s - mu_d) / (1 + tau |v|) + mu_d] with the smoothed direction g(v) =
(2/pi) atan(eps v) at the wall; at the bit also the other laws of :mod:`.laws`, each
given by four numbers. Which law it is, is a compile-time constant.
"""

from __future__ import annotations

import numpy as np

from nsdrill.abi import inlined
from nsdrill.elementary import (
    TWO_OVER_PI,
    bits_float,
    direction,
    direction_joined,
    direction_reduced,
    expm1,
    float_bits,
    fma,
)
from nsdrill.models.christoforou_yigit.laws import HYPERBOLIC, LINEAR, RATIONAL


@inlined
def slip_factors(
    speed: float, unit: float, smoothing: float, decay: float
) -> tuple[float, float, float]:
    """(g(v), 1 / (1 + tau |v|), 1 / unit) at a slip speed v = speed / unit, unit
    positive. One division, of the product of all that is divided by, serves every
    quotient."""
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
    speed: float,
    g: float,
    decayed: float,
    per_flat: float,
    smoothing: float,
    decay: float,
    rise: float,
    dynamic: float,
) -> tuple[float, float]:
    """(f(v), f'(v)) from what :func:`slip_factors` gives and 1 / (1 + (eps v)^2);
    ``rise`` is mu_s - mu_d."""
    m = fma(rise, decayed, dynamic)
    fall = rise * decay * decayed * decayed
    return g * m, fma(TWO_OVER_PI * smoothing * per_flat, m, g * (fall if speed < 0.0 else -fall))


@inlined
def shared(
    slip: float,
    along: float,
    unit: float,
    smoothing: float,
    decay: float,
    rise: float,
    dynamic: float,
) -> tuple[float, float]:
    """(f(|v|) / (|v| unit), 1 / unit) at a slip v = (slip, along) / unit in two
    directions, unit positive: times a component of v unit it is the share of the
    coefficient that acts against that."""
    # The floor matters at rest only, where the quotient has a limit.
    size = np.sqrt(fma(slip, slip, fma(along, along, 1e-60)))
    g, decayed, per_unit = slip_factors(size, unit, smoothing, decay)
    return g * fma(rise, decayed, dynamic) / size, per_unit


@inlined
def bit_factors(law: int, speed: float, smoothing: float, decay: float) -> tuple[float, float]:
    """What the ``law`` of the bit takes the longest to compute, and the observer needs
    once more: the direction and the factor of the falling part; of the rational law
    tanh(b1 v) and 1 / (1 + b3 v^2)."""
    if law == HYPERBOLIC:
        g, decayed, _ = slip_factors(speed, 1.0, smoothing, decay)
    elif law == RATIONAL:  # one division for both quotients
        less = expm1(-2.0 * abs(smoothing * speed))
        below = fma(decay * speed, speed, 1.0)
        inverse = 1.0 / ((2.0 + less) * below)
        g = bits_float(
            float_bits(-less * below * inverse) ^ (float_bits(speed) & -9223372036854775808)
        )
        decayed = (2.0 + less) * inverse
    else:
        g = direction(smoothing * speed)
        along = decay * abs(speed)
        decayed = max(1.0 - along, 0.0) if law == LINEAR else 1.0 + expm1(-along)
    return g, decayed


@inlined
def bit_arm(law: int, speed: float, g: float, decayed: float, rise: float, dynamic: float) -> float:
    """The torque of the bit over its force [m], from what :func:`bit_factors` gives."""
    if law == RATIONAL:
        return fma(rise * speed, decayed, dynamic * g)
    return g * fma(rise, decayed, dynamic)


@inlined
def bit_slope(
    law: int,
    speed: float,
    g: float,
    decayed: float,
    per_flat: float,
    smoothing: float,
    decay: float,
    rise: float,
    dynamic: float,
) -> tuple[float, float]:
    """(arm, d arm / d speed) from what :func:`bit_factors` gives and 1 / (1 + (eps
    v)^2)."""
    if law == HYPERBOLIC:
        return coefficient(speed, g, decayed, per_flat, smoothing, decay, rise, dynamic)
    arm = bit_arm(law, speed, g, decayed, rise, dynamic)
    if law == RATIONAL:
        hump = rise * decayed * fma(-2.0 * decay * speed * speed, decayed, 1.0)
        return arm, fma(dynamic * smoothing, fma(-g, g, 1.0), hump)
    fall = rise * decay * ((1.0 if decayed > 0.0 else 0.0) if law == LINEAR else decayed)
    steep = TWO_OVER_PI * smoothing * per_flat
    return arm, fma(steep, fma(rise, decayed, dynamic), g * (fall if speed < 0.0 else -fall))


@inlined
def bit_parts(law: int, speed: float, smoothing: float, decay: float) -> tuple[float, float, float]:
    """What :func:`bit_factors` gives at a bit speed, and 1 / (1 + (eps v)^2)."""
    scaled = smoothing * speed
    flat = fma(scaled, scaled, 1.0)
    if law == HYPERBOLIC:
        return slip_factors(speed * flat, flat, smoothing, decay)
    g, decayed = bit_factors(law, speed, smoothing, decay)
    return g, decayed, 1.0 / flat


@inlined
def bit_law(
    law: int, speed: float, smoothing: float, decay: float, rise: float, dynamic: float
) -> tuple[float, float]:
    """(arm, d arm / d speed) at a bit speed."""
    g, decayed, per_flat = bit_parts(law, speed, smoothing, decay)
    return bit_slope(law, speed, g, decayed, per_flat, smoothing, decay, rise, dynamic)
