"""From the parameters of a study to the lane parameters, the natural sizes and the start of a collar."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, cast

import numpy as np

from nsdrill.models.beam.options import Options, options_of
from nsdrill.models.beam.parameters import Initial, Parameters, Stations
from nsdrill.models.beam.rhs import columns_of
from nsdrill.models.christoforou_yigit import rhs as lumped
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive, one_by_one, power
from nsdrill.models.christoforou_yigit.parameters import Parameters as LumpedParameters
from nsdrill.models.leaves import Values

Array = np.ndarray[Any, np.dtype[Any]]


def coefficients(parameters: Parameters, depth: Any, wob: Any, rotary_speed: Any) -> Coefficients:
    """The lumped coefficients (:mod:`nsdrill.models.christoforou_yigit.coefficients`), those of the first mode among
    them, without the factor of the modal mass."""
    return derive(as_lumped(parameters), depth, wob, rotary_speed)


def as_lumped(parameters: Parameters) -> LumpedParameters:
    """The lumped model with the same numbers, some of which may be arrays over points, and none of its options."""
    made: LumpedParameters = _poured(LumpedParameters(), parameters)
    if parameters.drillstring.lateral_softening == "force":  # the lumped model knows it with the torque only
        object.__setattr__(made.drillstring, "lateral_softening", "none")
    return made


def _poured(into: Any, source: Any) -> Any:
    made = copy.copy(into)
    for item in fields(source):
        if hasattr(into, item.name):
            value = getattr(source, item.name)
            value = _poured(getattr(into, item.name), value) if is_dataclass(value) else value
            object.__setattr__(made, item.name, value)
    return made


def places(stations: Stations) -> list[Any]:
    """Where the stations are, as fractions of the span: numbers, or arrays over points."""
    number, first, last = stations.number, stations.first, stations.last
    return [first + (last - first) * (j / (number - 1)) if j else first for j in range(number)]


def watched(stations: Stations) -> Any:
    """Where radius and whirl are measured, as a fraction of the span."""
    if stations.watched is not None:
        return stations.watched
    found = places(stations)
    nearest, *others = found
    for place in others:
        nearer = np.abs(np.asarray(place) - 0.5) < np.abs(np.asarray(nearest) - 0.5) - 1e-9
        nearest = np.where(nearer, place, nearest)
    return nearest if np.ndim(nearest) else float(nearest)


def shape(place: Any, mode: int) -> Any:
    """sin(n pi xi) at a fraction of the span."""
    return one_by_one(math.sin, mode * math.pi * np.asarray(place, dtype=float))


def values_of(points: Values, stuck_below: float) -> Mapping[str, Any]:
    """The lane parameters by name, numbers or arrays over the points."""
    parameters: Parameters = points.parameters
    string, beam, stations = parameters.drillstring, parameters.beam, parameters.stations
    options = options_of(parameters)
    depth, wob, speed = points.operation
    k = coefficients(parameters, depth, wob, speed)
    table = lumped.pack(as_lumped(parameters), depth, wob, speed, stuck_below)
    found: dict[str, Any] = dict(zip(lumped.PARAMETERS, table.T, strict=True))
    factor, span = beam.modal_mass_factor, string.collar.span
    mass, bending = factor * k.m_l, factor * k.k_bend
    eccentric = factor * k.m_e
    first = string.eccentricity * (4 / math.pi if options.uniform else 1.0)
    arm = eccentric * first / mass
    # of mode n both the eccentricity and its arm are 1/n of the first
    squares = sum(1.0 / n**2 for n in options.eccentric)
    force = factor * math.pi**2 / (2 * span)
    live = string.lateral_softening in ("force", "live")
    along = places(stations)
    cubes = sum(power(np.abs(shape(place, 1)), 3) for place in along)
    friction_arm = found["bit_rise"] + found["bit_dynamic"]
    found |= {
        "per_lateral_mass": 1 / mass,
        "per_inertia": 1 / (k.J + eccentric * first * (first - arm) * squares),
        "unbalance_arm": arm,
        "bending": bending,
        "softening_constant": force * wob if string.lateral_softening == "static" else 0.0,
        "softening_force": force if live else 0.0,
        "softening_torque": factor * math.pi**3 / (2 * power(span, 2)) if options.torque else 0.0,
        "structural": 2 * beam.damping_ratio * np.sqrt(mass * bending),
        "drag": k.c_h / cubes,
        "torque_size": np.maximum(wob, 1.0) * friction_arm,
    }
    for n in range(1, options.modes + 1):
        found[f"watched_{n}"] = shape(watched(stations), n)
        found |= {f"phi_{j}_{n}": shape(place, n) for j, place in enumerate(along, start=1)}
    return {name: found[name] for name in columns_of(options)}


def stiffnesses(parameters: Parameters, depth: Any, wob: Any, rotary_speed: Any) -> list[Any]:
    """The stiffness of each mode [N/m] under the weight on bit, as the study softens it; negative if buckled."""
    string = parameters.drillstring
    k = coefficients(parameters, depth, wob, rotary_speed)
    load = 0.0 if string.lateral_softening == "none" else np.asarray(wob, dtype=float)
    ease = math.pi**2 / (2 * string.collar.span)
    factor = parameters.beam.modal_mass_factor
    return [factor * (n**4 * k.k_bend - n**2 * ease * load) for n in range(1, parameters.beam.modes + 1)]


def bent(points: Values) -> dict[str, Any]:
    """The modes of a collar that a force at the watched place bends against the wall, until that presses it with
    ``initial.wall_force``: x_n = (phi_n / k_n) X / sum_i (phi_i^2 / k_i), X beyond the gap by the penetration."""
    parameters: Parameters = points.parameters
    initial = cast("Initial", points.initial)
    assert initial.wall_force is not None
    well, place = parameters.well, watched(parameters.stations)
    exponent = 2 / 3 if well.law == "hertz" else 1.0
    gap = (well.diameter - parameters.drillstring.collar.outer_diameter) / 2
    reach = gap + _root(np.asarray(initial.wall_force) / well.stiffness, exponent)
    stiffness = stiffnesses(parameters, *points.operation)
    shapes = [shape(place, n) for n in range(1, parameters.beam.modes + 1)]
    give = sum(phi * phi / k for phi, k in zip(shapes, stiffness, strict=True))
    return {f"x_{n}": phi / k * reach / give for n, (phi, k) in enumerate(zip(shapes, stiffness, strict=True), start=1)}


# numpy's own power differs in the last bit between processors.
_root = np.vectorize(math.pow, otypes=[float])


def sizes(table: Mapping[str, Array], options: Options) -> list[Any]:
    """The natural size of each state: of a mode a tenth of the gap, and that times its frequency without load; the
    others as in the lumped model."""
    lateral = 0.1 * table["gap"]
    frequency = np.sqrt(table["bending"] * table["per_lateral_mass"])
    contact = table["axial_stiffness"] + table["rock_stiffness"]
    axial = np.maximum(table["wob"] / contact, np.maximum(0.1 * table["surface_amplitude"], 1e-6))
    common = [axial, axial * np.sqrt(contact * table["per_axial_mass"]), 0.1, 0.1 * table["drive_speed"]]
    modes = [[lateral, lateral * n**2 * frequency] * 2 for n in range(1, options.modes + 1)]
    return [*modes[0], *common, *(size for mode in modes[1:] for size in mode)]


def fastest(table: Mapping[str, Array], options: Options) -> Array:
    """The greatest natural frequency [rad/s]: of a mode, of the first one on the wall, of the bit on the rock."""
    per_mass = table["per_lateral_mass"]
    square = np.maximum(options.modes**4 * table["bending"] * per_mass, table["wall_stiffness"] * per_mass)
    contact = (table["axial_stiffness"] + table["rock_stiffness"]) * table["per_axial_mass"]
    return np.asarray(np.sqrt(np.maximum(np.maximum(square, contact), table["drive_speed"] ** 2)))
