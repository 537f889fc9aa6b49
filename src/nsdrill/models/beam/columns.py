"""What the equations of the elastic collar read and give: the options that are compiled
in, the names of states, lane parameters and auxiliary outputs, the values of the lane
parameters, and the start that follows from them.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple, cast

import numpy as np

from nsdrill.models import friction, top
from nsdrill.models.beam.parameters import MAX_MODES, Beam, Initial, Parameters
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, bit_load, derive, one_by_one, power
from nsdrill.models.christoforou_yigit.columns import values_of_string
from nsdrill.models.christoforou_yigit.parameters import Parameters as LumpedParameters
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.registry import described, of_known_models
from nsdrill.models.responses import Thresholds
from nsdrill.models.tree import lane_values, lanes_of, leaves, with_values
from nsdrill.observe.channels import Names
from nsdrill.variables import MODEL

FIRST_MODE = ("x", "vx", "y", "vy")  # of the first mode, as named in the study's start
COMMON = ("z", "vz", "twist", "bit_speed")


class Options(NamedTuple):
    """Whole numbers, as they go into the names of compiled functions: the numbers of
    ``modes`` and ``stations``; whether the law of the wall is Hertz's; the ``lobes`` of
    the rock; the ``unbalanced`` modes as a sum of bits, 1 for the first, 2 for the
    second, 4 for the third; whether the ``torque`` softens the collar; whether friction
    is ``implicit``; whether the friction of the bit is given as ``torques``; the numbers of
    the laws of bit and wall; and those of the drive (:func:`nsdrill.models.top.options_of`)."""

    modes: int = 5
    stations: int = 5
    hertz: int = 0
    lobes: int = 3
    unbalanced: int = 1
    torque: int = 0
    implicit: int = 0
    torques: int = 0
    bit_law: int = 0
    wall_law: int = 0
    driven: int = 0
    drive: int = 0
    motor: int = 0
    regulated: int = 0

    @property
    def eccentric(self) -> tuple[int, ...]:
        """The numbers of the modes that are eccentric."""
        return tuple(n for n in range(1, self.modes + 1) if self.unbalanced >> (n - 1) & 1)


def options_of(parameters: Parameters) -> Options:
    """The options of a collar."""
    beam = parameters.beam
    return Options(
        modes=beam.modes,
        stations=len(beam.stations),
        hertz=int(parameters.well.law == "hertz"),
        lobes=parameters.bit.lobes,
        unbalanced=sum(1 << (n - 1) for n in unbalanced_modes(parameters)),
        torque=int(beam.torque == "cy"),
        torques=int(parameters.bit.friction.by_torque),
        bit_law=friction.law_number(parameters.bit.friction.law),
        wall_law=friction.law_number(parameters.well.friction.law),
        **top.options_of(parameters.drive),
    )


def unbalanced_modes(parameters: Parameters) -> list[int]:
    """The numbers of the modes whose mass centre is off the axis; with a swept
    eccentricity all modes that may be."""
    distances, modes = parameters.beam.eccentricity_modes, range(1, parameters.beam.modes + 1)
    if distances is not None:
        return [n for n, value in zip(modes, distances, strict=False) if value != 0.0]
    return [n for n in modes if n % 2] if parameters.drillstring.eccentricity_shape == "uniform" else [1]


def lateral(n: int) -> tuple[str, str, str, str]:
    """The names of the states of mode ``n``."""
    return f"x_{n}", f"vx_{n}", f"y_{n}", f"vy_{n}"


@lru_cache
def states_below(modes: int) -> tuple[str, ...]:
    """The names of the states of string and collar, without those of a drive; those that
    the lumped model also has come first, in its order."""
    return (*lateral(1), *COMMON, *(name for n in range(2, modes + 1) for name in lateral(n)))


@lru_cache
def states_of(options: Options) -> tuple[str, ...]:
    """The names of all states."""
    return (*states_below(options.modes), *top.pair_of(options), *top.others_of(options))


def slopes_of(options: Options) -> tuple[str, ...]:
    """The names of the accelerations and of the rates of the drive's own states, in the
    order of the states."""
    higher = (name for n in range(2, options.modes + 1) for name in (f"ax_{n}", f"ay_{n}"))
    drive = ("drive_acceleration",) if options.driven else ()
    rates = (f"{name}_rate" for name in top.others_of(options))
    return ("ax_1", "ay_1", "az", "bit_acceleration", *higher, *drive, *rates)


STATE_SETS = {n: (*states_below(n), "drive_angle") for n in range(1, MAX_MODES + 1)}


NO_WALL = 1e6  # m, the gap of a station without one

# Auxiliary outputs for the observer: cosine and sine of the bit angle and torque of the
# rock; the number of stations on the wall, and the sum of their slips; of each station,
# its radius, and that times the radial velocity.
AUX = ("cosine", "sine", "torque", "wall_contacts", "slip_sum")
LOCAL_AUX = ("radius", "outward")
PARAMETERS = (
    "set_speed",
    "wob",
    "per_lateral_mass",
    "per_inertia",
    "per_axial_mass",
    "bending",
    "softening_constant",
    "softening_force",
    "softening_torque",
    "structural",
    "axial_stiffness",
    "torsional_stiffness",
    "gap",
    "collar_radius",
    *friction.columns_of("wall"),
    *friction.columns_of("bit"),
    "stuck_below",
    "torque_scale",
    *lanes_of(Parameters),
)
# Lane parameters of each station: the gap, the stiffness of the wall, the drag, and the
# factor from a penetration of this wall to that of the well's wall under the same
# force, for comparing penetrations of different walls.
STATION = ("gap", "wall_stiffness", "drag", "penetration_factor")


def columns_of(options: Options) -> tuple[str, ...]:
    """The names of the lane parameters: those of every collar, the arms of unbalanced
    modes, the mode shapes at the watched place, the parameters of each station, the mode
    shapes there, and the parameters of the drive."""
    modes, stations = range(1, options.modes + 1), range(1, options.stations + 1)
    arms = (f"unbalance_arm_{n}" for n in options.eccentric)
    of_stations = (f"{name}_{j}" for j in stations for name in STATION)
    shapes = (f"phi_{j}_{n}" for j in stations for n in modes)
    load = ("bit_load",) if options.torques else ()
    laws = {"bit": options.bit_law, "wall": options.wall_law}
    own = (name for contact, law in laws.items() for name in friction.own_columns_of(contact, law))
    return (
        *PARAMETERS,
        *load,
        *arms,
        *(f"watched_{n}" for n in modes),
        *of_stations,
        *shapes,
        *own,
        *top.lanes_of(options),
    )


def aux_of(options: Options) -> tuple[str, ...]:
    """The names of the auxiliary outputs."""
    return (*AUX, *(f"{name}_{j}" for j in range(1, options.stations + 1) for name in LOCAL_AUX))


@lru_cache
def names_of(options: Options) -> Names:
    """The names of the rows."""
    return Names(states_of(options), slopes_of(options), columns_of(options), aux_of(options))


def coefficients(parameters: Parameters, depth: Numeric, wob: Numeric, rotary_speed: Numeric) -> Coefficients:
    """The lumped coefficients (:mod:`nsdrill.models.christoforou_yigit.coefficients`),
    those of the first mode among them, without the factor of the modal mass."""
    return derive(as_lumped(parameters), depth, wob, rotary_speed)


def as_lumped(parameters: Parameters) -> LumpedParameters:
    """The parameters of the lumped model with the same numbers, some of which may be
    arrays over points, and without its options."""
    lumped, keys = _lumped()
    numbers = {key: value for key, value, _ in leaves(parameters) if key in keys}
    beam = parameters.beam
    softening = "none"  # the lumped model has no load without the torque
    if isinstance(beam.axial_load, str):
        softening = "static" if beam.axial_load == "static" else "live" if beam.torque == "cy" else "none"
    return with_values(lumped, numbers | {"drillstring.lateral_softening": softening})


@of_known_models
def _lumped() -> tuple[LumpedParameters, frozenset[str]]:
    """The default parameters of the lumped model, with the numbers of scripts, and their keys."""
    found = cast(LumpedParameters, described(MODEL).parameters())
    return found, frozenset(key for key, _, _ in leaves(found))


def places(beam: Beam) -> list[float]:
    """Where the stations are, as fractions of the span."""
    return [station.at for station in beam.stations]


def watched(beam: Beam) -> Numeric:
    """Where radius and whirl are measured, as a fraction of the span."""
    if beam.watched is not None:
        return beam.watched
    return min(places(beam), key=lambda place: round(abs(place - 0.5), 9))


def walls(parameters: Parameters, gap: Numeric) -> list[tuple[Numeric, Numeric]]:
    """Gap [m] and stiffness of the wall at each station, by default those of the well;
    the stiffness is 0 where there is no wall. ``gap`` is that of the well."""
    return [
        (
            gap if station.gap is None else station.gap,
            parameters.well.stiffness if station.stiffness is None else station.stiffness,
        )
        for station in parameters.beam.stations
    ]


def drags(parameters: Parameters, lumped_drag: Numeric) -> list[Numeric]:
    """The drag at each station [N s^2/m^2], by default the one that, at all stations,
    gives the first mode the drag of the lumped model, ``lumped_drag``."""
    cubes = sum(power(np.abs(shape(place, 1)), 3) for place in places(parameters.beam))
    return [lumped_drag / cubes if station.drag is None else station.drag for station in parameters.beam.stations]


def eccentricities(parameters: Parameters) -> dict[int, Numeric]:
    """The distance of the mass centre from the axis [m] of each mode that has one."""
    distances, string = parameters.beam.eccentricity_modes, parameters.drillstring
    modes = unbalanced_modes(parameters)
    if distances is not None:
        return {n: distances[n - 1] for n in modes}
    first = string.eccentricity * (4 / math.pi if string.eccentricity_shape == "uniform" else 1.0)
    return {n: first if n == 1 else first * (1.0 / n) for n in modes}


def shape(place: Numeric, mode: int) -> Numeric:
    """sin(n pi xi) at a fraction of the span."""
    return one_by_one(math.sin, mode * math.pi * np.asarray(place, dtype=float))


def of_string(points: Values, thresholds: Thresholds) -> dict[str, Numeric]:
    """The lane parameters of string, collar and bit by name, numbers or arrays over the
    points."""
    parameters: Parameters = points.parameters
    string, beam = parameters.drillstring, parameters.beam
    options = options_of(parameters)
    depth, wob, speed = points.operation
    lumped = as_lumped(parameters)
    k = derive(lumped, depth, wob, speed)
    values: dict[str, Numeric] = values_of_string(lumped, k, wob, speed, thresholds.stuck_below)
    factor, span = beam.modal_mass_factor, string.collar.span
    mass, bending = factor * k.m_l, factor * k.k_bend
    eccentric = factor * k.m_e
    distances = eccentricities(parameters)
    arms = {n: eccentric * e / mass for n, e in distances.items()}
    unbalance: Numeric = sum(eccentric * e * (e - arms[n]) for n, e in distances.items())
    force = factor * math.pi**2 / (2 * span)
    axial_load = beam.axial_load
    steady: Numeric = {"live": 0.0, "static": wob}[axial_load] if isinstance(axial_load, str) else axial_load
    station_places = places(beam)
    friction_arm = values["bit_rise"] + values["bit_dynamic"]
    values |= lane_values(parameters) | {
        "per_lateral_mass": 1 / mass,
        "per_inertia": 1 / (k.J + unbalance),
        "bending": bending,
        "softening_constant": force * steady,
        "softening_force": force if isinstance(axial_load, str) and axial_load == "live" else 0.0,
        "softening_torque": factor * math.pi**3 / (2 * power(span, 2)) if options.torque else 0.0,
        "structural": 2 * beam.damping_ratio * np.sqrt(mass * bending),
        "torque_scale": bit_load(lumped, np.maximum(wob, 1.0)) * friction_arm,
        "bit_load": 1.0,
    }
    values |= {f"unbalance_arm_{n}": arm for n, arm in arms.items()}
    values |= {f"drag_{j}": drag for j, drag in enumerate(drags(parameters, k.c_h), start=1)}
    exponent = 2 / 3 if parameters.well.law == "hertz" else 1.0
    for j, (gap, stiffness) in enumerate(walls(parameters, values["gap"]), start=1):
        wall = np.asarray(stiffness) > 0.0
        relative = np.where(wall, np.asarray(stiffness) / parameters.well.stiffness, 1.0)
        values |= {f"gap_{j}": np.where(wall, gap, NO_WALL), f"wall_stiffness_{j}": stiffness}
        values[f"penetration_factor_{j}"] = _root(relative, exponent)
    for n in range(1, options.modes + 1):
        values[f"watched_{n}"] = shape(watched(beam), n)
        values |= {f"phi_{j}_{n}": shape(place, n) for j, place in enumerate(station_places, start=1)}
    return values


def stiffnesses(parameters: Parameters, depth: Numeric, wob: Numeric, rotary_speed: Numeric) -> list[Numeric]:
    """The stiffness of each mode [N/m] under the weight on bit, softened as in the
    study; negative if buckled."""
    k, axial_load = coefficients(parameters, depth, wob, rotary_speed), parameters.beam.axial_load
    load = np.asarray(wob if isinstance(axial_load, str) else axial_load, dtype=float)
    softening = math.pi**2 / (2 * parameters.drillstring.collar.span)
    factor = parameters.beam.modal_mass_factor
    return [factor * (n**4 * k.k_bend - n**2 * softening * load) for n in range(1, parameters.beam.modes + 1)]


def bent_against_wall(points: Values) -> dict[str, Numeric]:
    """The modes of a collar that a force at the watched place bends against the wall,
    until the wall's force is ``initial.wall_force``: x_n = (phi_n / k_n) X / sum_i
    (phi_i^2 / k_i), where X is the gap plus the penetration."""
    parameters: Parameters = points.parameters
    initial = cast("Initial", points.initial)
    assert initial.wall_force is not None
    well, place = parameters.well, watched(parameters.beam)
    exponent = 2 / 3 if well.law == "hertz" else 1.0
    well_gap = (well.diameter - parameters.drillstring.collar.outer_diameter) / 2
    station_walls = zip(places(parameters.beam), walls(parameters, well_gap), strict=True)
    gap, wall_stiffness = next(
        (wall for at, wall in station_walls if at == place and np.all(wall[1])), (well_gap, well.stiffness)
    )
    reach = gap + _root(np.asarray(initial.wall_force) / wall_stiffness, exponent)
    stiffness = stiffnesses(parameters, *points.operation)
    shapes = [shape(place, n) for n in range(1, parameters.beam.modes + 1)]
    compliance = sum(phi * phi / k for phi, k in zip(shapes, stiffness, strict=True))
    return {
        f"x_{n}": phi / k * reach / compliance
        for n, (phi, k) in enumerate(zip(shapes, stiffness, strict=True), start=1)
    }


# numpy's power differs in the last bit between processors.
_root = np.vectorize(math.pow, otypes=[float])
