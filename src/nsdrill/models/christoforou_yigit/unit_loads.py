"""The accelerations that unit loads of bit and wall cause, and the bit's law with all
its slopes: shared by the friction solves of :mod:`.implicit`, :mod:`.implicit_along` and
:mod:`.implicit_held`."""

from __future__ import annotations

import numpy as np

from nsdrill.compiler.functions import inlined
from nsdrill.compiler.words import fma
from nsdrill.elementary import TWO_OVER_PI
from nsdrill.kernel.slip import first_slip
from nsdrill.models.christoforou_yigit.friction import bit_parts, bit_slope
from nsdrill.models.christoforou_yigit.laws import HYPERBOLIC, LINEAR, RATIONAL


@inlined
def unit_torque(x, y, c, s, q, soft, per_mass, per_inertia):  # type: ignore[no-untyped-def]
    """Accelerations (x, y, angular) by a unit of bit torque, of a collar at (x, y) with
    the bit at an angle of cosine c and sine s; ``q`` is the unbalance arm, ``soft`` the
    softening by torque."""
    angular = -fma(q * soft, fma(y, c, -(x * s)), 1.0) * per_inertia
    return (
        fma(q * angular, s, soft * x * per_mass),
        fma(-q * angular, c, soft * y * per_mass),
        angular,
    )


@inlined
def unit_friction(x, y, per_r, c, s, q, radius, per_mass, per_inertia):  # type: ignore[no-untyped-def]
    """Accelerations (x, y, angular) by a unit of friction that acts around the hole at
    this ``radius`` from the axis of the collar, whose centre is at (x, y), 1 /
    ``per_r`` from the axis of the hole."""
    tangent_x, tangent_y = y * per_r, -x * per_r
    angular = -fma(q, fma(tangent_y, c, -(tangent_x * s)), radius) * per_inertia
    return (
        fma(q * angular, s, tangent_x * per_mass),
        fma(-q * angular, c, tangent_y * per_mass),
        angular,
    )


@inlined
def wall_force(radius, gap, stiffness, hertz):  # type: ignore[no-untyped-def]
    """The normal force at the wall [N] of a collar at this ``radius`` [m]."""
    penetration = max(radius - gap, 0.0)
    force = stiffness * penetration
    return force * np.sqrt(penetration) if hertz else force


@inlined
def slip_deceleration(x, y, per_r, lever, ux, uy, angular):  # type: ignore[no-untyped-def]
    """The decrease of the slip around the hole, at a ``lever`` from the axis of the
    collar, by a unit load with the accelerations (ux, uy, ``angular``)."""
    return -fma(fma(x, uy, -(y * ux)), per_r, lever * angular)


@inlined
def first_bit_speed(law, free, relaxed, smoothing, decay, rise, dynamic):  # type: ignore[no-untyped-def]
    """The initial guess of the bit speed. For the rational law the guess leaves the
    fall of friction with speed out."""
    if law == RATIONAL:
        return first_slip(free, relaxed, smoothing, 0.0, 0.0, dynamic)
    return first_slip(free, relaxed, smoothing, decay, rise, dynamic)


@inlined
def apply_push(b, i, rows, relax, push_x, push_y, push):  # type: ignore[no-untyped-def]
    """Store the pushes of lane i, and add ``relax`` times the pushes to its velocities.
    ``rows`` are those of the pushes, then of the velocities."""
    push_x_, push_y_, push_, vx_, vy_, speed_ = rows
    b[push_x_ + i] = push_x
    b[push_y_ + i] = push_y
    b[push_ + i] = push
    b[vx_ + i] = fma(relax, push_x, b[vx_ + i])
    b[vy_ + i] = fma(relax, push_y, b[vy_ + i])
    b[speed_ + i] = fma(relax, push, b[speed_ + i])


@inlined
def bit_law_rates(law, speed, smoothing, decay, rise, dynamic):  # type: ignore[no-untyped-def]
    """(arm, arm', direction, direction', decay factor, decay factor') of the bit at a
    ``speed``, derivatives by speed."""
    g, decayed, per_flat = bit_parts(law, speed, smoothing, decay)
    arm, slope = bit_slope(law, speed, g, decayed, per_flat, smoothing, decay, rise, dynamic)
    if law == RATIONAL:
        return (
            arm,
            slope,
            g,
            smoothing * fma(-g, g, 1.0),
            decayed,
            -2.0 * decay * speed * decayed * decayed,
        )
    if law == HYPERBOLIC:
        fall = decay * decayed * decayed
    elif law == LINEAR:
        fall = decay if decayed > 0.0 else 0.0
    else:
        fall = decay * decayed
    return (
        arm,
        slope,
        g,
        TWO_OVER_PI * smoothing * per_flat,
        decayed,
        fall if speed < 0.0 else -fall,
    )
