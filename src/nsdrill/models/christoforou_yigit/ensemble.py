"""The states of an ensemble of starts.

**Draws.** Start ``k`` has nine numbers, uniform in [0, 1): the upper 53 bits of the
words 9 k ... 9 k + 8 of the Philox 4x64 counter-based generator (Salmon et al. 2011)
whose key is the seed. So start ``k`` does not depend on the number of starts, and is
the same at every operating point: differences between operating points are not noise of
the draw.

**Scales.** The numbers are multiplied by natural scales of the operating point, so that
the ensemble covers the states that a string can have without breaking: with ``spread``
Q = 1, and for smaller Q nearer to steady drilling,

================  ==================================================================
lateral position  uniform over the disc of radius Q c0 about the hole axis, c0 the
                  gap: never beyond the wall
lateral velocity  uniform over the disc of radius Q max(c0 w_b, R_c Omega): the gap
                  times the bending frequency, or the speed of rolling along the
                  wall, whichever is faster
axial position    uniform within Q 2 (d + s0) of the static position -d, d = W/(k_a
                  + k_c): from off the rock to some three times the static
                  penetration
axial velocity    uniform within Q 2 s0 n_b Omega of zero
twist             uniform from (1 - Q) psi_0 to (1 - Q) psi_0 - Q 1.5 T_s/k_t, psi_0
                  = -T_0/k_t the twist of steady drilling: from an unwound string to
                  half as much again as the torque at rest T_s winds it up
bit speed         uniform within Q Omega of Omega: from stuck to twice the drive
                  speed
drive angle       uniform over a revolution
================  ==================================================================

T_s and T_0 are the torques of rock and torsional damping at mean bit force W, with the
static friction coefficient and with that of the drive speed. Only sums, products and
square roots in correctly rounded arithmetic depend on the operating point, so the
states have the same bits on every machine.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.laws import running_arm, static_arm
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.leaves import Values
from nsdrill.models.starts import in_the_disc

WIND_UP = 1.5  # times the wind-up under the torque at rest
AXIAL_REACH = 2.0  # times static penetration and lobe amplitude together
LOBE_SPEEDS = 2.0  # times the greatest speed of the rock under the bit


def drawn(points: Values, u: Array) -> dict[str, Any]:
    """The states by name, from numbers ``u`` [starts, 9] that are uniform in [0, 1):
    of x, y, vx, vy, z, vz, twist, bit speed and the angle of the drive. A drive that is
    not ideal begins with the set speed."""
    parameters, (depth, wob, speed), q = points.parameters, points.operation, points.initial.spread
    k = derive(parameters, depth, wob, speed)
    reach, fastest = reach_of_collar(k, speed, q)
    place, velocity = in_the_disc(u[:, 0:2]), in_the_disc(u[:, 2:4])
    return {
        "x": reach * place[:, 0],
        "y": reach * place[:, 1],
        "vx": fastest * velocity[:, 0],
        "vy": fastest * velocity[:, 1],
        **string_and_bit(parameters, k, wob, speed, q, *u[:, 4:8].T),
        "drive_angle": 2 * math.pi * u[:, 8],
        "lag": 0.0,
        "drive_speed": speed,
    }


def reach_of_collar(k: Coefficients, speed: Any, spread: float) -> tuple[Any, Any]:
    """The greatest distance from the axis of the hole [m] and the greatest speed [m/s]
    of the collar in an ensemble."""
    fastest = spread * np.maximum(k.gap * np.sqrt(k.k_bend / k.m_l), k.collar_radius * speed)
    return spread * k.gap, fastest


def string_and_bit(
    parameters: Parameters,
    k: Coefficients,
    wob: Any,
    speed: Any,
    spread: float,
    z: Array,
    vz: Array,
    twist: Array,
    bit_speed: Array,
) -> dict[str, Array]:
    """The axial and torsional states of an ensemble, from numbers that are uniform in
    [0, 1)."""
    bit, q = parameters.bit, spread
    rest = wob / (k.k_a + bit.rock_stiffness)
    lobes = bit.lobes * speed * bit.surface_amplitude
    damping = parameters.drillstring.torsional_damping * speed
    static = (wob * static_arm(parameters, k) + damping) / k.k_t
    steady = (wob * running_arm(parameters, k, speed) + damping) / k.k_t
    return {
        "z": q * AXIAL_REACH * (rest + bit.surface_amplitude) * (2 * z - 1) - rest,
        "vz": q * LOBE_SPEEDS * lobes * (2 * vz - 1),
        "twist": -((1 - q) * steady + q * WIND_UP * static * twist),
        "bit_speed": speed * (1 + q * (2 * bit_speed - 1)),
    }
