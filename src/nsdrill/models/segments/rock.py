"""The rock under the bit of the string of segments: its force and its torque, once, for
compiled code and for arrays.

With phi = th_n + the drive's angle, omega = w_n, d = s0 sin(b phi) - u_n, chi = c_c / W,
and w_c the bit speed or the set speed (``bit.cutting.speed``)::

    F = k_c max(d, 0) max(1 + chi d', 0)
    T = F r_b [mu0 (tanh omega + alpha omega / (1 + beta omega^2) + nu omega)
               + on g zeta r],   r = sqrt(delta / r_b)
    ROP = max(c1 W sqrt|w_c| + c2, 0)
    delta = 2 pi ROP / sqrt(w_c^2 + w_s^2)
    g = (2/pi) atan(eps omega)
    on = (F - W_fs) / (0.1 W_fs), at least 0 and at most 1

Sources: the friction with its numbers is that of Sarker, Rideout & Butt 2012, with its
fifth number gamma = 1. The rock's force is Hunt and Crossley's (1975): it has the
printed damping c_c at the working load, does not jump when the bit touches, and never
pulls, unlike a spring and a damper in parallel.

**The cutters** as a law of friction: the law is the load on them times g(omega)
r(omega), over the rock's elastic force. r is the root of the depth of cut over the
bit's radius; two kinds of bits:

- Where the depth follows the bit speed and begins at a speed x_0 > 0 (ROP offset below
  zero), the bit *creeps*: r rises from zero there with an infinite slope, which holds
  it. All of r is in the law.
- Elsewhere the law has the r of the set speed, or of rest. The rest of r is zero at
  rest, so its product with g is not steep, and no part of the law.

An implicit stage solves for the bit speed. For a bit that creeps the unknown is tau,
with |omega| = (sqrt(x_0) + tau^2)^2: the advance is proportional to tau^2 and r to tau,
so Newton's method meets no square root.

Friction that is given as torques is in place of friction and cutters, whatever the
force: T = g(omega) [(T_s - T_d) / (1 + tau |omega|) + T_d], the hyperbolic law of
:mod:`nsdrill.models.friction`.
"""

from __future__ import annotations

import math

import numpy as np

from nsdrill.equations.graph import Node, Number
from nsdrill.equations.library import SteepLaw, bounded_root, direction, friction, sincos, sqrt, tanh, touching
from nsdrill.equations.plain import Rows, on_arrays
from nsdrill.equations.stage import first_slip
from nsdrill.equations.trace import Named, part
from nsdrill.models import surface
from nsdrill.models.friction import Numbers, columns_of, hyperbolic, numbers_of, values
from nsdrill.models.operation import Numeric
from nsdrill.models.segments.parameters import Parameters

# The derivative is that of an r of at least this times ``creep_root``: a bit that creeps
# is held by an infinite slope, which no explicit step can follow.
LEAST_ROOT = 0.1


@part
def rock_force(speed: Node, n: Named) -> tuple[Node, Node]:
    """(the rock's force, the load on the cutters) at a bit speed, over the elastic
    force; ``n`` are lane parameters, with ``elastic``, that force [N],
    ``surface_slope`` [m/rad] and ``axial_velocity`` [m/s]."""
    closing = n.surface_slope * speed - n.axial_velocity
    damped = max(n.closing_factor * closing + 1.0, 0.0)
    share = (n.elastic * damped - n.threshold) * n.per_threshold_width
    return damped, damped * min(max(share, 0.0), 1.0)


@part
def depth_root(speed: Node, n: Named) -> Node:
    """r at a bit speed."""
    speed = n.live * (speed - n.set_speed) + n.set_speed
    advance = max(n.advance * sqrt(abs(speed)) + n.advance_offset, 0.0)
    depth = n.cutting_factor * advance / sqrt(speed * speed + n.slow_square)
    return bounded_root(depth, LEAST_ROOT * n.creep_root)


@part
def _value(speed: Node, n: Named) -> Node:
    root = depth_root(speed, n) if n.creep_start > 0.0 else n.flat_root
    return rock_force(speed, n)[1] * direction(n.smoothing * speed) * root


@part
def rest_of_cutting(speed: Node, n: Named) -> Node:
    """What the law leaves out of the load times g r."""
    root = 0.0 if n.creep_start > 0.0 else n.live * (depth_root(speed, n) - n.flat_root)
    return rock_force(speed, n)[1] * direction(n.smoothing * speed) * root


@part
def _at(x: Node, free: Node, n: Named) -> tuple[Node, Node]:
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
def _begin(free: Node, relaxed: Node, n: Named) -> Node:
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
def _steepest_fall(n: Named) -> Node:
    """At the bit speed of ``n``: where r falls, and where the load does."""
    damped, load = rock_force(n.speed, n)
    root = depth_root(n.speed, n) if n.creep_start > 0.0 else n.flat_root
    share = n.per_threshold_width * n.elastic * damped if load < damped else 0.0
    slope = abs(n.closing_factor * n.surface_slope) * (1.0 + share)
    return load * n.creep_fall + (slope * root if load > 0.0 else 0.0)


cutting = SteepLaw(_value, _at, _begin, _steepest_fall)


# The lane parameters of the rock and of the cutters.
ROCK = (
    "closing_factor", "threshold", "per_threshold_width", "smoothing", "live", "set_speed",
    "advance", "advance_offset", "cutting_factor", "slow_square", "creep_start", "creep_root",
    "creep_fall", "creep_speed", "flat_root",
)  # fmt: skip


def bit_on_rock(
    drive_angle: Number, s: Named, p: Named, torques: int = 0
) -> tuple[Number, Number, Number, Number, Number, Number]:
    """(sine and cosine of the lobes, interference of bit and rock [m], its rate, force
    and torque of the rock); ``torques`` as :class:`.columns.Options` has it."""
    sine, cosine = sincos(p.lobes * (s.twist + drive_angle))
    surface_slope = p.surface_amplitude * p.lobes * cosine
    interference = p.surface_amplitude * sine - s.z
    force, torque = loads(p.rock_stiffness * touching("rock", interference), surface_slope, s, p, torques)
    return sine, cosine, interference, surface_slope * s.bit_speed - s.vz, force, torque


def loads(elastic: Number, surface_slope: Number, s: Named, p: Named, torques: int = 0) -> tuple[Number, Number]:
    """(force, torque) of the rock, whose ``elastic`` force [N] is that of its
    penetration alone, on a bit on a lobe of this slope [m/rad]."""
    omega, numbers = s.bit_speed, {name: getattr(p, name) for name in ROCK}
    rock = Named(elastic=elastic, surface_slope=surface_slope, axial_velocity=s.vz, speed=omega, **numbers)
    damped, _ = rock_force(omega, rock)
    force = elastic * damped
    if torques:
        return force, friction("bit", slip=omega, normal=p.bit_load, law=hyperbolic, numbers=numbers_of(p, "bit"))
    rubbing = tanh(omega) + p.hump * omega / (p.narrowing * omega * omega + 1.0) + p.viscous * omega
    cut = friction("bit", slip=omega, normal=elastic, law=cutting, numbers=rock)
    cut = cut + elastic * rest_of_cutting(omega, rock)
    return force, p.friction_arm * force * rubbing + p.cutting_arm * cut


# The numbers of a study.

# The lane parameters of friction as torques.
OF_TORQUES = ("bit_load", *columns_of("bit"))
# Bit speeds [rad/s] at which the cutting torque is evaluated, up to 53.
SPEEDS = tuple(0.01 * 1.2**k for k in range(48))
LEAST_ADVANCE = 1e-12  # m/s at 1 rad/s; with less the bit never cuts


def columns(parameters: Parameters, wob: Numeric, set_speed: Numeric) -> dict[str, Numeric]:
    """The lane parameters of the rock, all but ``creep_fall``, which only an implicit
    stage reads. Of a bit that creeps: the root of the speed at which it begins to cut
    (0 for any other bit), r over that and over the root of its speed, and twice the
    slow speed; of others r at the set speed or at rest."""
    bit, friction, cutting = parameters.bit, parameters.bit.friction, parameters.bit.cutting
    threshold, live = parameters.segments.threshold_force, cutting.speed == "live"
    advance, offset = np.broadcast_arrays(np.asarray(cutting.c1 * wob, dtype=float), cutting.c2)
    creeps = (offset < 0.0) & live
    return {
        **({"bit_load": 1.0, **law_of_torques(parameters).columns("bit")} if friction.by_torque else {}),
        "set_speed": set_speed,
        "closing_factor": quotient(parameters.segments.rock_damping, wob),
        "lobes": float(bit.lobes),
        "friction_arm": bit.radius * friction.level,
        "hump": friction.hump,
        "narrowing": friction.narrowing,
        "viscous": friction.viscous,
        "cutting_arm": bit.radius * cutting.zeta,
        "smoothing": cutting.smoothing,
        "threshold": threshold,
        "per_threshold_width": 10 / threshold,
        **_depths(parameters, wob),
        "live": float(live),
        "creep_start": np.where(creeps, -offset / np.maximum(advance, LEAST_ADVANCE), 0.0),
        "creep_root": np.sqrt(
            np.maximum(2 * math.pi / bit.radius * cutting.c1 * wob, 2 * math.pi / bit.radius * LEAST_ADVANCE)
        ),
        "creep_speed": 2 * cutting.slow,
        "flat_root": np.where(creeps, 0.0, root_at(parameters, wob, 0.0 * set_speed if live else set_speed)),
    }


def law_of_torques(parameters: Parameters) -> Numbers:
    """The numbers of the law of friction as torques [N m]."""
    friction = parameters.bit.friction
    static, dynamic = friction.static_torque, friction.dynamic_torque
    assert static is not None
    assert dynamic is not None
    return Numbers(friction.smoothing, friction.decay, static - dynamic, dynamic)


def cut_of(parameters: Parameters, wob: Numeric, speed: Numeric) -> surface.Cut:
    """Steady cutting of a bit on the surface that it leaves."""
    return surface.cut_of(parameters.bit.rock, parameters.bit.radius, wob, speed)


def penetration_rate(parameters: Parameters, wob: Numeric, set_speed: Numeric) -> Numeric:
    """The rate [m/s] at which the bit advances in steady drilling."""
    if parameters.bit.rock.regenerative:
        return cut_of(parameters, wob, set_speed).rate
    cutting = parameters.bit.cutting
    return np.maximum(cutting.c1 * wob * np.sqrt(set_speed) + cutting.c2, 0.0)


def fall_of_root(parameters: Parameters, wob: Numeric) -> Numeric:
    """The steepest fall of r with the speed of a bit that creeps; 0 of others."""
    cutting = parameters.bit.cutting
    roots = [root_at(parameters, wob, speed) for speed in SPEEDS]
    falls = [
        (before - after) / (b - a) for before, after, a, b in zip(roots, roots[1:], SPEEDS, SPEEDS[1:], strict=False)
    ]
    steepest = np.max(np.array(falls), axis=0, initial=0.0)
    return np.where(np.less(cutting.c2, 0.0) & (cutting.speed == "live"), steepest, 0.0)


def _depths(parameters: Parameters, wob: Numeric) -> dict[str, Numeric]:
    """The lane parameters of the depth of cut."""
    bit, cutting = parameters.bit, parameters.bit.cutting
    return {
        "cutting_factor": 2 * math.pi / bit.radius,
        "advance": cutting.c1 * wob,
        "advance_offset": cutting.c2,
        "slow_square": cutting.slow * cutting.slow,
    }


def root_at(parameters: Parameters, wob: Numeric, speed: Numeric) -> Numeric:
    """sqrt(depth of cut / radius) at a ``speed`` [rad/s] that the depth follows, under
    a weight on bit [N]."""
    given = {"speed": speed, "live": 1.0, "set_speed": 0.0, "creep_root": 0.0, **_depths(parameters, wob)}
    return on_arrays(_root, given)["root"]


def _root(n: Rows) -> dict[str, Node]:
    return {"root": depth_root(n.speed, n)}


def bit_torque(parameters: Parameters, wob: Numeric, set_speed: Numeric, force: Numeric, speed: Numeric) -> Numeric:
    """The torque of the rock on the bit [N m] under a steady ``force`` [N] at a bit
    ``speed`` [rad/s]."""
    if parameters.bit.friction.by_torque:
        return values(hyperbolic, "coefficient", speed, law_of_torques(parameters))
    given = {"elastic": force, "surface_slope": 0.0, "vz": 0.0, "bit_speed": speed, "creep_fall": 0.0}
    given |= columns(parameters, wob, set_speed)
    return on_arrays(_torque, given)["torque"]


def _torque(n: Rows) -> dict[str, Number]:
    return {"torque": loads(n.elastic, n.surface_slope, n, n)[1]}


def quotient(numerator: Numeric, denominator: Numeric) -> Numeric:
    """The quotient, and 0 where the denominator is 0: a string without bore, a bit
    without load."""
    numerator, denominator = np.broadcast_arrays(
        np.asarray(numerator, dtype=float), np.asarray(denominator, dtype=float)
    )
    return np.divide(numerator, denominator, out=np.zeros(denominator.shape), where=denominator != 0.0)
