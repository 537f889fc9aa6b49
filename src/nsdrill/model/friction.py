"""The smoothed Stribeck law and the contact laws, as helpers that inline into the lane loops.

Two quotients of the same number make one division: the decay 1 / (1 + tau |v|) is the only one here besides that
inside the arctangent.
"""

from __future__ import annotations

import math

from nsdrill.abi import inlined
from nsdrill.elementary import arctan, fma

TWO_OVER_PI = 2.0 / math.pi


@inlined
def direction(speed: float, smoothing: float) -> float:
    """g(v) = (2/pi) atan(eps v): the sign of the slip speed, smoothed."""
    return TWO_OVER_PI * arctan(smoothing * speed)


@inlined
def stribeck(speed: float, decay: float, rise: float, dynamic: float) -> float:
    """The size of the friction coefficient, (mu_s - mu_d) / (1 + tau |v|) + mu_d, with ``rise`` = mu_s - mu_d."""
    return rise / fma(decay, abs(speed), 1.0) + dynamic
