"""The values of the lane parameters of the main model: those of the string and those of
its drive; and the string with its drive in steady drilling, from the equations."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache

from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.columns import options_of, values_of_string
from nsdrill.models.christoforou_yigit.drives import gains, regulator
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.twist import that_only_turns, turning_string
from nsdrill.models.drilling import Drilling
from nsdrill.models.drive_laws import LAW_LANES
from nsdrill.models.motor import motor_columns, regulator_columns
from nsdrill.models.operation import Numeric, Operation
from nsdrill.models.steady import String, Weighted
from nsdrill.models.tree import with_values


def values_of(
    parameters: Parameters, depth: Numeric, wob: Numeric, rotary_speed: Numeric, stuck_below: float
) -> dict[str, Numeric]:
    """The lane parameters at operating points, by name: numbers or arrays, from depth
    [m], wob [N] and rotary_speed [rad/s]."""
    k = derive(parameters, depth, wob, rotary_speed)
    values, drive, options = (
        values_of_string(parameters, k, wob, rotary_speed, stuck_below),
        parameters.drive,
        options_of(parameters),
    )
    if options.driven:
        inertia, *law = gains(parameters, k, rotary_speed)
        values |= dict(zip(LAW_LANES, (1 / inertia, *law), strict=True))
        values["torque_limit"] = math.inf if drive.torque_limit is None else drive.torque_limit
        values |= motor_columns(drive)
        if options.regulated:
            values |= regulator_columns(regulator(parameters, k, wob, rotary_speed))
    return values


def drilling_at(parameters: Parameters, operation: Operation) -> Drilling:
    """Steady drilling of a string that only turns, at an operating point."""
    return _drilling(
        that_only_turns(parameters), float(operation.depth), float(operation.wob), float(operation.rotary_speed)
    )


@lru_cache(maxsize=64)
def _drilling(alone: Parameters, depth: float, wob: float, rotary_speed: float) -> Drilling:
    k, drive = derive(alone, depth, wob, rotary_speed), alone.drive
    k_t = float(k.k_t)
    return Drilling(
        replace(string_of(alone, depth, wob), weighted=Weighted(_table_under(alone, depth), wob)),
        rotary_speed,
        wob,
        float(alone.well.diameter),
        math.sqrt(k_t / float(k.J)),
        k_t,
        float(drive.torque_limit) if drive.limited and drive.torque_limit is not None else None,
    )


@lru_cache(maxsize=64)
def _table_under(alone: Parameters, depth: float) -> Callable[[Numeric], Callable[[Numeric], Mapping[str, Numeric]]]:
    """The table of a string at a depth [m] under weights on bit [N]."""
    return lambda wob: string_of(alone, depth, wob).table


def moving_string(parameters: Parameters, operation: Operation) -> String:
    """String and drive in steady drilling at an operating point, of a string that turns and
    moves along the hole."""
    moving = {"modes.axial": "free", "modes.torsional": parameters.modes.torsional}
    alone = with_values(that_only_turns(parameters), moving)
    depth, wob = operation.depth, operation.wob
    return turning_string(alone, wob, lambda speed: values_of(alone, depth, wob, speed, 0.0))


def string_of(parameters: Parameters, depth: Numeric, wob: Numeric) -> String:
    """String and drive in steady drilling at a depth [m] under a weight on bit [N]."""
    alone = that_only_turns(parameters)
    return turning_string(alone, wob, lambda speed: values_of(alone, depth, wob, speed, 0.0))
