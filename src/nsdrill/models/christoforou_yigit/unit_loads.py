"""What unit loads of bit and wall do to the accelerations, and the bit's law with all
its slopes: what the solves of :mod:`.apart` and its neighbours share."""

from __future__ import annotations

import numpy as np

from nsdrill.abi import inlined
from nsdrill.elementary import TWO_OVER_PI, fma
from nsdrill.kernel.slip import first_slip
from nsdrill.models.christoforou_yigit.friction import bit_parts, bit_slope
from nsdrill.models.christoforou_yigit.laws import HYPERBOLIC, LINEAR, RATIONAL

FEW = 8  # lanes of which the compiler would unroll a small loop in place of packing it


@inlined
def unit_torque(x, y, c, s, q, soft, per_mass, per_inertia):  # type: ignore[no-untyped-def]
    """Accelerations (x, y, angular) of a unit of bit torque."""
    angular = -fma(q * soft, fma(y, c, -(x * s)), 1.0) * per_inertia
    return (
        fma(q * angular, s, soft * x * per_mass),
        fma(-q * angular, c, soft * y * per_mass),
        angular,
    )


@inlined
def unit_friction(x, y, per_r, c, s, q, radius, per_mass, per_inertia):  # type: ignore[no-untyped-def]
    """Accelerations (x, y, angular) of a unit of friction at the wall."""
    across, along = y * per_r, -x * per_r
    angular = -fma(q, fma(along, c, -(across * s)), radius) * per_inertia
    return fma(q * angular, s, across * per_mass), fma(-q * angular, c, along * per_mass), angular


@inlined
def wall_force(radius, gap, stiffness, hertz):  # type: ignore[no-untyped-def]
    """The normal force at the wall [N]."""
    penetration = max(radius - gap, 0.0)
    force = stiffness * penetration
    return force * np.sqrt(penetration) if hertz else force


@inlined
def taken_around(x, y, per_r, lever, ux, uy, turn):  # type: ignore[no-untyped-def]
    """What a unit load with these accelerations takes from the slip at a ``lever`` from
    the axis of the collar."""
    return -fma(fma(x, uy, -(y * ux)), per_r, lever * turn)


@inlined
def first_speed(law, free, relaxed, smoothing, decay, rise, dynamic):  # type: ignore[no-untyped-def]
    """The first guess of the bit speed; the rational law has no fall that the guess
    knows."""
    if law == RATIONAL:
        return first_slip(free, relaxed, smoothing, 0.0, 0.0, dynamic)
    return first_slip(free, relaxed, smoothing, decay, rise, dynamic)


@inlined
def push_on(b, i, places, relax, push_x, push_y, push):  # type: ignore[no-untyped-def]
    """Leave the pushes of lane i, and move its velocities on by them."""
    push_x_, push_y_, push_, vx_, vy_, speed_ = places
    b[push_x_ + i] = push_x
    b[push_y_ + i] = push_y
    b[push_ + i] = push
    b[vx_ + i] = fma(relax, push_x, b[vx_ + i])
    b[vy_ + i] = fma(relax, push_y, b[vy_ + i])
    b[speed_ + i] = fma(relax, push, b[speed_ + i])


@inlined
def bit_rates(law, speed, smoothing, decay, rise, dynamic):  # type: ignore[no-untyped-def]
    """(arm, arm', direction, direction', decay factor, decay factor') of the bit at a
    speed."""
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
