"""The slip speed at a stage of an implicit step: the initial guess of Newton's method.

A stage gives the slip speed v* without friction, and friction subtracts c f(v) from it:
v + c f(v) = v*, where f rises steeply through zero like g(v) = (2/pi) atan(eps v) times
a level that falls with speed. With x / (0.8 + |x|) in place of (2/pi) atan x the
equation is quadratic. Its solution is so close that two Newton iterations leave an
error of some 1e-8 of the load, and of 1e-5 in the worst case. The number of iterations
is fixed, so that all lanes stay packed.
"""

from __future__ import annotations

import numpy as np

from nsdrill.compiler.functions import inlined
from nsdrill.compiler.words import fma
from nsdrill.elementary import TWO_OVER_PI, direction_joined, direction_reduced

SATURATION = 0.8  # from 0.64, right for large slips, to 1.57, right for small ones


@inlined
def first_slip(
    free: float, relaxed: float, smoothing: float, decay: float, rise: float, dynamic: float
) -> float:
    """A guess of the slip speed: ``free`` is v*, ``relaxed`` is c, at least 0; f is g
    (rise / (1 + decay |v|) + dynamic), and ``smoothing`` is eps."""
    speed = abs(free)
    sliding = max(fma(-relaxed, rise + dynamic, speed), 0.0)
    # All terms are multiplied by ``weakening``, which saves a division.
    weakening = fma(decay, sliding, 1.0)
    level = relaxed * fma(weakening, dynamic, rise)
    linear = fma(smoothing, fma(-weakening, speed, level), SATURATION * weakening)
    constant_term = (2.0 * SATURATION) * weakening * speed
    root = np.sqrt(fma(linear, linear, (2.0 * smoothing) * weakening * constant_term))
    numerator = constant_term if linear > 0.0 else root - linear
    denominator = linear + root if linear > 0.0 else (2.0 * smoothing) * weakening
    guess = numerator / denominator
    return -guess if free < 0.0 else guess


@inlined
def hyperbolic(
    slip: float, smoothing: float, decay: float, rise: float, dynamic: float
) -> tuple[float, float]:
    """(f, f') of the law g (rise / (1 + decay |v|) + dynamic) at a slip speed v. One
    division serves all quotients."""
    scaled = smoothing * slip
    one_plus_square = fma(scaled, scaled, 1.0)
    numerator, denominator, base = direction_reduced(scaled, 1.0)
    speed_weakening = fma(decay, abs(slip), 1.0)
    inverse_product = 1.0 / (denominator * speed_weakening * one_plus_square)
    decayed = denominator * one_plus_square * inverse_product
    g = direction_joined(
        scaled, numerator * speed_weakening * one_plus_square * inverse_product, base
    )
    level, fall = fma(rise, decayed, dynamic), rise * decay * decayed * decayed
    steepness = TWO_OVER_PI * smoothing * (denominator * speed_weakening * inverse_product)
    return g * level, fma(steepness, level, g * (fall if slip < 0.0 else -fall))


@inlined
def kept(slip: float, following: float) -> float:
    """The next iterate ``following`` of Newton's method after ``slip``, or zero if it
    has the other sign: from zero the iteration does not overshoot the solution."""
    return following * (0.0 if following * slip < 0.0 else 1.0)
