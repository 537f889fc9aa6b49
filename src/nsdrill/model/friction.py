"""The smoothed Stribeck law, as a helper that inlines into the lane loops.

f(v) = g(v) [(mu_s - mu_d) / (1 + tau |v|) + mu_d] with the smoothed direction g(v) = (2/pi) atan(eps v).
"""

from __future__ import annotations

import math

from nsdrill.abi import inlined
from nsdrill.elementary import arctan_joined, arctan_reduced, fma

TWO_OVER_PI = 2.0 / math.pi


@inlined
def slip_factors(speed: float, smoothing: float, decay: float) -> tuple[float, float]:
    """(g(v), 1 / (1 + tau |v|)) at a slip speed v; one division, of the product, serves both."""
    scaled = smoothing * speed
    above, below, base, rest = arctan_reduced(scaled)
    decayed = fma(decay, abs(speed), 1.0)
    inverse = 1.0 / (below * decayed)
    angle = arctan_joined(scaled, above * decayed * inverse, base, rest)
    return TWO_OVER_PI * angle, below * inverse
