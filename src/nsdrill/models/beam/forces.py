"""Forces, energy and powers of the elastic collar at given states, in plain numpy: for
traces and the energy balance.

The laws are those of the compiled right-hand side; tests compare the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models.beam.columns import as_lumped, shape, watched
from nsdrill.models.beam.parameters import Parameters
from nsdrill.models.christoforou_yigit import forces as lumped

State = Mapping[str, Array]


def at_place(parameters: Parameters, state: State, place: Any) -> dict[str, Array]:
    """x, vx, y, vy [m, m/s] of the collar at a fraction of its span."""
    modes = range(1, parameters.beam.modes + 1)
    return {
        name: np.asarray(sum(shape(place, n) * state[f"{name}_{n}"] for n in modes)) for name in ("x", "vx", "y", "vy")
    }


def _walls(parameters: Parameters, point: Any, state: State) -> list[dict[str, Array]]:
    """The forces of the lumped model at each station, with position and velocity."""
    rest = {name: state[name] for name in ("z", "vz", "twist", "bit_speed", "drive_angle")}
    stations = []
    for station in parameters.beam.stations:
        lumped_parameters, motion = as_lumped(parameters), at_place(parameters, state, station.at)
        if station.gap is not None:
            object.__setattr__(
                lumped_parameters.well,
                "diameter",
                lumped_parameters.drillstring.collar.outer_diameter + 2 * station.gap,
            )
        if station.stiffness is not None:
            object.__setattr__(lumped_parameters.well, "stiffness", station.stiffness)
        stations.append({**motion, **lumped.forces(lumped_parameters, point, {**rest, **motion})})
    return stations


def forces(parameters: Parameters, point: Any, state: State) -> dict[str, Array]:
    """The variables of a trace besides the states: x, vx, y, vy [m, m/s] and the polar
    coordinates of the watched place; the forces and torques of the rock; the sums of
    ``wall_force`` and ``wall_friction`` over all stations [N]."""
    stations = _walls(parameters, point, state)
    motion = at_place(parameters, state, watched(parameters.beam))
    result = lumped.forces(as_lumped(parameters), point, {**state, **motion})
    for name in ("wall_force", "wall_friction"):
        result[name] = np.asarray(sum(station[name] for station in stations))
    return {**motion, **result}
