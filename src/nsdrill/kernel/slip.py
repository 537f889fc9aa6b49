"""The slip speed that a stage of an implicit step asks for: how Newton's method begins.

A stage gives the slip speed v* without friction, and friction takes c f(v) from it: v +
c f(v) = v*, where f rises steeply through zero like g(v) = (2/pi) atan(eps v) times a
level that falls with speed. With x / (0.8 + |x|) in place of (2/pi) atan x that is a
quadratic, whose solution is so close that two of Newton's iterations leave some 1e-8 of
the load, and 1e-5 in the worst case. Without a loop that ends when it is done, all
lanes stay packed.
"""

from __future__ import annotations

import numpy as np

from nsdrill.abi import inlined
from nsdrill.elementary import TWO_OVER_PI, direction_joined, direction_reduced, fma

ROUND = 0.8  # from 0.64, right for large slips, to 1.57, right for small ones


@inlined
def first_slip(
    free: float, relaxed: float, smoothing: float, decay: float, rise: float, dynamic: float
) -> float:
    """A guess of the slip speed: ``free`` is v*, ``relaxed`` is c, at least 0; f is g
    (rise / (1 + decay |v|) + dynamic)."""
    size = abs(free)
    slides = max(fma(-relaxed, rise + dynamic, size), 0.0)
    # All terms times ``fast``, for one division less.
    fast = fma(decay, slides, 1.0)
    level = relaxed * fma(fast, dynamic, rise)
    linear = fma(smoothing, fma(-fast, size, level), ROUND * fast)
    twice = (2.0 * ROUND) * fast * size
    root = np.sqrt(fma(linear, linear, (2.0 * smoothing) * fast * twice))
    above = twice if linear > 0.0 else root - linear
    below = linear + root if linear > 0.0 else (2.0 * smoothing) * fast
    guess = above / below
    return -guess if free < 0.0 else guess


@inlined
def hyperbolic(
    slip: float, smoothing: float, decay: float, rise: float, dynamic: float
) -> tuple[float, float]:
    """(f, f') of the law g (rise / (1 + decay |v|) + dynamic) at a slip speed v. One
    division serves all quotients."""
    scaled = smoothing * slip
    flat = fma(scaled, scaled, 1.0)
    above, below, base = direction_reduced(scaled, 1.0)
    slower = fma(decay, abs(slip), 1.0)
    inverse = 1.0 / (below * slower * flat)
    decayed = below * flat * inverse
    g = direction_joined(scaled, above * slower * flat * inverse, base)
    level, fall = fma(rise, decayed, dynamic), rise * decay * decayed * decayed
    steep = TWO_OVER_PI * smoothing * (below * slower * inverse)
    return g * level, fma(steep, level, g * (fall if slip < 0.0 else -fall))


@inlined
def kept(slip: float, following: float) -> float:
    """The next iterate, zero where ``following`` passes zero: from there the iteration
    does not pass the solution."""
    return following * (0.0 if following * slip < 0.0 else 1.0)
