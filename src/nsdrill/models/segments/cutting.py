"""The rock's force on the bit, and the torque of its cutters as a law of friction.

The law is the load on the cutters times g(omega) r(omega), over the rock's elastic
force. r is the root of the depth of cut over the bit's radius; two kinds of bits:

- Where the depth follows the bit speed and begins at a speed x_0 > 0 (ROP offset below
  zero), the bit *creeps*: r rises from zero there with an infinite slope, which holds
  it. All of r is in the law.
- Elsewhere the law has the r of the set speed, or of rest. The rest of r is zero at
  rest, so its product with g is not steep, and no part of the law.

An implicit stage solves for the bit speed. For a bit that creeps the unknown is tau,
with |omega| = (sqrt(x_0) + tau^2)^2: the advance is proportional to tau^2 and r to tau,
so Newton's method meets no square root.
"""

from __future__ import annotations

from typing import Any

from nsdrill.equations.library import SteepLaw, bounded_root, direction, sqrt
from nsdrill.equations.stage import first_slip
from nsdrill.equations.trace import Named, part

# The derivative is that of an r of at least this times ``creep_root``: a bit that creeps
# is held by an infinite slope, which no explicit step can follow.
LEAST_ROOT = 0.1


@part
def rock_force(speed: Any, n: Any) -> tuple[Any, Any]:
    """(the rock's force, the load on the cutters) at a bit speed, over the elastic
    force; ``n`` are lane parameters, with ``elastic``, that force [N],
    ``surface_slope`` [m/rad] and ``axial_velocity`` [m/s]."""
    closing = n.surface_slope * speed - n.axial_velocity
    damped = max(n.closing_factor * closing + 1.0, 0.0)
    share = (n.elastic * damped - n.threshold) * n.per_threshold_width
    return damped, damped * min(max(share, 0.0), 1.0)


@part
def depth_root(speed: Any, n: Any) -> Any:
    """r at a bit speed."""
    speed = n.live * (speed - n.set_speed) + n.set_speed
    advance = max(n.advance * sqrt(abs(speed)) + n.advance_offset, 0.0)
    depth = n.cutting_factor * advance / sqrt(speed * speed + n.slow_square)
    return bounded_root(depth, LEAST_ROOT * n.creep_root)


@part
def _value(speed: Any, n: Any) -> Any:
    root = depth_root(speed, n) if n.creep_start > 0.0 else n.flat_root
    return rock_force(speed, n)[1] * direction(n.smoothing * speed) * root


@part
def rest_of_cutting(speed: Any, n: Any) -> Any:
    """What the law leaves out of the load times g r."""
    root = 0.0 if n.creep_start > 0.0 else n.live * (depth_root(speed, n) - n.flat_root)
    return rock_force(speed, n)[1] * direction(n.smoothing * speed) * root


@part
def _at(x: Any, free: Any, n: Any) -> tuple[Any, Any]:
    """(bit speed, law) where the unknown of Newton's method is ``x``: tau where the bit
    creeps, else |omega|. The bit turns as it does without this torque, at the speed
    ``free``, which is its speed where that is too low to cut."""
    creeps, size = n.creep_start > 0.0, abs(free)
    held = creeps and size <= n.creep_start * n.creep_start
    root = n.creep_start + x * x
    speed = size + x if held else (root * root if creeps else x)
    r = n.creep_root * x / sqrt(sqrt(speed * speed + n.slow_square)) if creeps else n.flat_root
    value = 0.0 if held else direction(n.smoothing * speed) * r
    backward = free < 0.0
    omega = -speed if backward else speed
    value = rock_force(omega, n)[1] * value
    return omega, (-value if backward else value)


@part
def _begin(free: Any, relaxed: Any, n: Any) -> Any:
    """The unknown from which Newton's method begins, with ``relaxed`` [rad/s] in place
    of the elastic force: with the load at the speed ``free``, and x / (0.8 + x) in
    place of (2/pi) atan x."""
    size = abs(free)
    relaxed = relaxed * rock_force(free, n)[1]
    flat = Named(smoothing=n.smoothing, decay=0.0, rise=0.0, dynamic=n.flat_root)
    # Of a bit that creeps: r / tau at the free speed, or at twice the slow speed where
    # that is less.
    low = min(size, n.creep_speed)
    scaled = n.smoothing * low
    slope = relaxed * n.creep_root * scaled / (0.8 + scaled)
    slope = slope / sqrt(sqrt(low * low + n.slow_square))
    excess = max(size - n.creep_start * n.creep_start, 0.0)
    tau = slope + sqrt(slope * slope + 8.0 * n.creep_start * excess) + 1e-300
    tau = min(2.0 * excess / tau, sqrt(max(sqrt(size) - n.creep_start, 0.0)))
    return tau if n.creep_start > 0.0 else first_slip(size, relaxed, flat)


@part
def _steepest_fall(n: Any) -> Any:
    """At the bit speed of ``n``: where r falls, and where the load does."""
    damped, load = rock_force(n.speed, n)
    root = depth_root(n.speed, n) if n.creep_start > 0.0 else n.flat_root
    share = n.per_threshold_width * n.elastic * damped if load < damped else 0.0
    slope = abs(n.closing_factor * n.surface_slope) * (1.0 + share)
    return load * n.creep_fall + (slope * root if load > 0.0 else 0.0)


cutting = SteepLaw(_value, _at, _begin, _steepest_fall)
