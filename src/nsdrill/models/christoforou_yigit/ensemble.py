"""The initial states of an operating point: a single one, an ensemble drawn at random,
or a grid over two states.

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
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.laws import running_arm, static_arm
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.christoforou_yigit.rhs import initial_states, with_frozen_modes
from nsdrill.models.christoforou_yigit.variables import STATE_NAMES
from nsdrill.models.starts import checked_starts, hypercube, in_the_disc, slice_points

Array = np.ndarray[Any, np.dtype[Any]]
DRAWS = 9
WIND_UP = 1.5  # times the wind-up under the torque at rest
AXIAL_REACH = 2.0  # times static penetration and lobe amplitude together
LOBE_SPEEDS = 2.0  # times the greatest speed of the rock under the bit


def starting_states(
    parameters: Parameters, initial: Initial, depth: Any, wob: Any, rotary_speed: Any, start: Any = 0
) -> Array:
    """Initial states with the drive angle last, shape (points, states + 1), of the
    starts numbered ``start`` (from 0; ignored where ``initial`` is a single state) at
    the operating points depth [m], wob [N], rotary_speed [rad/s]: 1-D arrays of one
    length, or scalars."""
    if not initial.starts:
        return initial_states(parameters, initial, depth, wob, rotary_speed)
    depth, wob, rotary_speed, start = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(value, float)) for value in (depth, wob, rotary_speed)), np.atleast_1d(start)
    )
    checked_starts(initial, start)
    if initial.slice:
        return _slice_states(parameters, initial, depth, wob, rotary_speed, start)
    return _ensemble_states(parameters, initial, depth, wob, rotary_speed, start)


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
    """The axial and torsional states of an ensemble, from random numbers ``z``, ``vz``
    and ``bit_speed`` in (-1, 1) and ``twist`` in (0, 1)."""
    bit, q = parameters.bit, spread
    rest = wob / (k.k_a + bit.rock_stiffness)
    lobes = bit.lobes * speed * bit.surface_amplitude
    damping = parameters.drillstring.torsional_damping * speed
    static = (wob * static_arm(parameters, k) + damping) / k.k_t
    steady = (wob * running_arm(parameters, k, speed) + damping) / k.k_t
    return {
        "z": q * AXIAL_REACH * (rest + bit.surface_amplitude) * z - rest,
        "vz": q * LOBE_SPEEDS * lobes * vz,
        "twist": -((1 - q) * steady + q * WIND_UP * static * twist),
        "bit_speed": speed * (1 + q * bit_speed),
    }


def _slice_states(
    parameters: Parameters, initial: Initial, depth: Array, wob: Array, speed: Array, start: Array
) -> Array:
    states = initial_states(parameters, initial, depth, wob, speed)
    for name, values in slice_points(initial, STATE_NAMES, start).items():
        states[:, -1 if name == STATE_NAMES[-1] else STATE_NAMES.index(name)] = values
    return with_frozen_modes(parameters, states, wob, speed)


def _ensemble_states(
    parameters: Parameters, initial: Initial, depth: Array, wob: Array, speed: Array, start: Array
) -> Array:
    k, q = derive(parameters, depth, wob, speed), initial.spread
    u = _random_numbers(initial.seed, initial.ensemble)[start]
    reach, fastest = reach_of_collar(k, speed, q)
    by_name = {
        "x": reach * u[:, 0],
        "y": reach * u[:, 1],
        "vx": fastest * u[:, 2],
        "vy": fastest * u[:, 3],
        **string_and_bit(parameters, k, wob, speed, q, *u[:, 4:8].T),
        "drive_angle": u[:, 8],
    }
    states = np.stack([by_name[name] for name in STATE_NAMES], axis=1)
    if not parameters.drive.ideal:  # lag 0, set speed
        states = np.concatenate([states[:, :-1], np.zeros((len(states), 1)), speed[:, None], states[:, -1:]], axis=1)
    if parameters.drive.kind == "dc_motor":
        states = np.concatenate([states[:, :-1], np.zeros((len(states), 2)), states[:, -1:]], axis=1)
    return with_frozen_modes(parameters, states, wob, speed)


@lru_cache(maxsize=4)
def _random_numbers(seed: int, count: int) -> Array:
    """The random numbers of every start, shape (starts, DRAWS): x, y and vx, vy in the
    unit disc; z and vz in (-1, 1); twist in (0, 1); bit speed in (-1, 1); the drive
    angle in (0, 2 pi)."""
    numbers = hypercube(seed, count, DRAWS)
    for first in (0, 2):
        numbers[:, first : first + 2] = in_the_disc(numbers[:, first : first + 2])
    for column in (4, 5, 7):
        numbers[:, column] = 2 * numbers[:, column] - 1
    numbers[:, 8] *= 2 * math.pi
    numbers.setflags(write=False)
    return numbers
