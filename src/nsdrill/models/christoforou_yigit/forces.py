"""The forces of the equations at given states, on arrays: for traces and figures."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Node
from nsdrill.equations.plain import values
from nsdrill.equations.trace import traced
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.columns import columns_of, states_of, values_of
from nsdrill.models.christoforou_yigit.equations import equations
from nsdrill.models.christoforou_yigit.options import Options, options_of
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.operation import Operation
from nsdrill.models.schedule import History

LOADS = ("bit_force", "bit_torque", "wall_force", "wall_friction")


@lru_cache
def _named(options: Options) -> dict[str, Node]:
    """What the equations call by a name."""
    graph, _, _ = traced(equations, states_of(options), columns_of(options), options)
    return graph.names


def loads(
    parameters: Parameters, operation: Operation | History, state: Mapping[str, Array], *names: str
) -> dict[str, Any]:
    """The quantities that the equations call by these ``names``, at a state; 0 those
    that equations without an option do not have."""
    options = options_of(parameters)
    named = _named(options)
    lanes = values_of(parameters, operation.depth, operation.wob, operation.rotary_speed, 0.0)
    given = {"time": 0.0, "phase": state["drive_angle"]}
    given |= {f"s.{name}": state[name] for name in states_of(options) if name in state}
    given |= {f"p.{name}": lanes[name] for name in columns_of(options)}
    zero = np.zeros_like(state["x"])
    found = values({name: named[name] for name in names if name in named}, given)
    return {name: found.get(name, 0.0) + zero for name in names}


def forces(parameters: Parameters, operation: Operation | History, state: Mapping[str, Array]) -> dict[str, Array]:
    """Contact forces and derived variables of a state.

    ``state`` holds x, vx, y, vy [m, m/s], z, vz, twist [rad], bit_speed [rad/s] and
    drive_angle [rad], arrays of one shape; and, of a drive that is not ideal, lag [rad]
    and drive_speed [rad/s]. Gives radius, radial_velocity, whirl_angle (unwrapped along
    the array), whirl_speed, bit_force, bit_torque, wall_force, wall_friction,
    surface_torque, all SI. ``operation`` may change along the array.
    """
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    x, vx, y, vy = (state[name] for name in ("x", "vx", "y", "vy"))
    radius = np.hypot(x, y)
    divisor = np.where(radius > 0, radius, 1.0)
    return {
        "radius": radius,
        "radial_velocity": (x * vx + y * vy) / divisor,
        "whirl_angle": np.unwrap(np.arctan2(y, x)),
        "whirl_speed": (x * vy - y * vx) / divisor / divisor,
        **loads(parameters, operation, state, *LOADS),
        "surface_torque": -k.k_t * (state["twist"] - state.get("lag", 0.0)),
    }
