"""The parameters of the elastic collar, in SI units: those of the lumped model, and
what its modes and walls need.

Sources as in :mod:`nsdrill.models.sections`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from nsdrill.errors import Fault
from nsdrill.models.christoforou_yigit.constraints import ORDERS as LUMPED
from nsdrill.models.christoforou_yigit.parameters import Collar, Drive
from nsdrill.models.drive_rules import DRIVE, DRIVE_RULES
from nsdrill.models.friction import reads_at
from nsdrill.models.operation import LARGEST_FORCE, ModelParameters, Operation
from nsdrill.models.rules import Rule
from nsdrill.models.sections import (
    TWIST_INERTIA,
    TWIST_STIFFNESS,
    Lobes,
    Section,
    Steel,
    StillMud,
    TorqueFriction,
    Wall,
    known_as_a_whole,
    sections_from_the_top,
)
from nsdrill.models.starts import Starts, state
from nsdrill.models.whole_string import WHOLE_STRING
from nsdrill.ranges import Checked, choice, parameter, records
from nsdrill.records import dataclass
from nsdrill.units import format_quantity
from nsdrill.variables import short_key

MAX_MODES, MAX_STATIONS = 10, 21


@dataclass(frozen=True)
class Drillstring(Steel):
    """The string."""

    collar: Collar = field(default_factory=Collar)
    eccentricity: float = parameter(0.0127, "m", "CY as reported (1/2 in)", "medium", high=10.0, usual="1 to 15 mm")
    eccentricity_shape: Literal["first", "uniform"] = choice("first", "R: as the lumped model has it")
    eccentric_mass: Literal["total", "steel"] = choice("total", "P; 'steel' leaves the fluid added mass out")
    axial_damping: float = parameter(
        4000.0, "N s/m", "CY, J as reported", "low", high=1e9, usual="1 to 100 kN s/m", lane="axial_damping"
    )
    torsional_damping: float = parameter(
        50.0, "N m s/rad", "CY, J as reported", "low", high=1e7, usual="10 to 500 N m s/rad", lane="torsional_damping"
    )
    torsional_stiffness: float | None = known_as_a_whole(TWIST_STIFFNESS)
    rotary_inertia: float | None = known_as_a_whole(TWIST_INERTIA)
    sections: tuple[Section, ...] | None = sections_from_the_top()

    @property
    def measured(self) -> bool:
        """As of the lumped model."""
        return self.torsional_stiffness is not None and self.rotary_inertia is not None


@dataclass(frozen=True)
class Bit(Lobes):
    """The bit on its lobed surface s = s0 sin(n_b phi)."""

    friction: TorqueFriction = field(default_factory=TorqueFriction)


@dataclass(frozen=True)
class Station(Checked):
    """A place along the span where the collar may touch a wall. None stands for the gap
    and the stiffness of the well, and for the drag that gives the first mode the drag
    of the lumped model."""

    at: float = parameter(
        0.5,
        "",
        "R",
        "modelling choice",
        low=0.001,
        high=0.999,
        usual="0.05 to 0.95",
        meaning="Place as a fraction of the span",
    )
    gap: float | None = parameter(
        None,
        "m",
        "the well's",
        "",
        high=10.0,
        usual="5 to 100 mm",
        meaning="Gap between collar and wall; null: that of the well",
    )
    stiffness: float | None = parameter(
        None,
        "N/m or N/m^1.5",
        "the well's",
        "",
        high=1e13,
        usual="1 MN/m to 10 GN/m",
        meaning="Stiffness of the wall; null: that of the well, 0: there is none",
    )
    drag: float | None = parameter(
        None,
        "N s^2/m^2",
        "R",
        "",
        high=1e9,
        usual="100 to 10 000 N s^2/m^2",
        meaning="Drag of the mud; null: the share of mode 1",
    )


@dataclass(frozen=True)
class Beam(Checked):
    """The collar between the stabilisers, simply supported at both.

    ``axial_load`` softens it in bending: the force of the rock at every moment
    (``live``), the weight on bit (``static``) or a constant force. ``watched`` None is
    the station nearest to the middle. ``eccentricity_modes`` None stands for the
    eccentricity of ``drillstring``.
    """

    modes: int = parameter(
        5,
        "",
        "G",
        "high",
        low=1,
        high=MAX_MODES,
        usual="1 to 10",
        meaning="Number of bending modes in each plane, sin(n pi x / l)",
    )
    stations: tuple[Station, ...] = records(
        Station,
        tuple(Station(at) for at in (0.1, 0.3, 0.5, 0.7, 0.9)),
        "R",
        "modelling choice",
        most=MAX_STATIONS,
        meaning="Places along the span where the collar may touch a wall and the mud drags",
    )
    watched: float | None = parameter(
        None,
        "",
        "R: the station nearest to the middle of the span",
        "modelling choice",
        low=0.001,
        high=0.999,
        usual="0.5",
        meaning="Place at which radius and whirl are measured, as a fraction of the span",
    )
    eccentricity_modes: tuple[float, ...] | None = parameter(
        None,
        "m",
        "R: the lumped model's, of the first mode",
        "low",
        low=-10.0,
        high=10.0,
        usual="1 to 15 mm",
        meaning="Distances of the mass centre, of mode 1, 2, ...; null: drillstring.eccentricity",
        most=MAX_MODES,
    )
    axial_load: float | str = parameter(
        "live",
        "N",
        "CY; G has a constant force",
        "modelling choice",
        high=LARGEST_FORCE,
        usual="0 to 500 kN",
        words=("live", "static"),
        meaning="Load that softens the collar: of the rock, the weight on bit, or a force",
    )
    torque: Literal["none", "cy"] = choice("none", "CY have it in first order, a shaft feels it in second order only")
    damping_ratio: float = parameter(
        0.0, "", "R", "low", high=10.0, usual="0.005 to 0.01", meaning="Structural damping ratio of every mode"
    )
    modal_mass_factor: float = parameter(
        1.0,
        "",
        "R: 10 has the modal mass that G prints with the frequencies that follow from its buckling load",
        "modelling choice",
        low=1e-3,
        high=1e3,
        usual="1",
        meaning="Factor of the modal mass and of the bending stiffness, which leaves the frequencies as they are",
    )


LAWS = reads_at("bit.friction", torques=True), reads_at("well.friction")


@dataclass(frozen=True)
class Parameters(ModelParameters):
    """All that does not change during a sweep."""

    point, reads = Operation, (*LAWS, DRIVE)
    drillstring: Drillstring = field(default_factory=Drillstring)
    beam: Beam = field(default_factory=Beam)
    mud: StillMud = field(default_factory=StillMud)
    well: Wall = field(default_factory=Wall)
    bit: Bit = field(default_factory=Bit)
    drive: Drive = field(default_factory=Drive)

    def __post_init__(self) -> None:
        self.well.check(self.drillstring.collar.outer_diameter)
        places = [station.at for station in self.beam.stations]
        if not all(np.all(np.asarray(a) < np.asarray(b)) for a, b in pairwise(places)):
            raise ValueError(f"beam.stations: found the places {places}, allowed: each beyond the one before")


@dataclass(frozen=True)
class Initial(Starts):
    """The state at the start. ``x`` ... ``vy`` are of the first bending mode; the other
    modes begin at rest.

    With a ``wall_force`` the collar begins at rest, bent in the plane of x by a force
    at the watched place, so far that a wall there presses it with this force; with 0 it
    just reaches the wall.
    """

    x: float = state(1e-3, "m", 10.0, "within the gap, 10 to 100 mm", "First bending mode, in the plane of x")
    y: float = state(0.0, "m", 10.0, "as x", "First bending mode, in the plane of y")
    vx: float = state(0.0, "m/s", 1e3, "up to 5 m/s", "Its velocity in the plane of x")
    vy: float = state(0.0, "m/s", 1e3, "up to 5 m/s", "Its velocity in the plane of y")
    wall_force: float | None = parameter(
        None,
        "N",
        high=LARGEST_FORCE,
        usual="0 to 1 MN",
        meaning="Force with which the wall presses the collar at the start, bent at rest in the plane of x",
    )
    z: float | None = state(None, "m", 1e3, "-50 to 50 mm")
    vz: float = state(0.0, "m/s", 1e3, "up to 1 m/s")
    twist: float = state(0.0, "rad", 1e5, "-150 to 0 rad: some 20 turns")
    bit_speed: float | None = state(None, "rad/s", 1e4, "-10 to 60 rad/s")
    lag: float | None = state(0.0, "rad", 1e5, "-20 to 20 rad; a drive that is not ideal has one")
    drive_speed: float | None = state(None, "rad/s", 1e4, "0 to 30 rad/s; as the lag")
    drive_angle: float = state(0.0, "rad", 1e9, "after a day at 120 rpm 1 million rad")


# What several values of a study of an elastic collar must satisfy together.


ORDERS = tuple(order for order in LUMPED if not order.lower.startswith("stabilizer."))
_START = ("initial.x", "initial.y", "initial.vx", "initial.vy")


def _section(check: Any) -> Iterator[Fault]:
    if check.value("record.section") == "lobe":
        yield check.fault("record.section", "lobe", "revolution, with the model beam")


def _stations(check: Any) -> Iterator[Fault]:
    """Each station is beyond the one before."""
    key = "beam.stations"
    places = [station["at"] for station in check.value(key)]
    for number, (before, place) in enumerate(pairwise(places), start=1):
        if place <= before:
            allowed = f"above the place before it, {before:g}"
            yield check.fault(f"{key}[{number}].at", f"{place:g}", allowed, ("beam", "stations", number))


def _eccentricities(check: Any) -> Iterator[Fault]:
    """Eccentricities are those of existing modes, and are given in one place only."""
    key = "beam.eccentricity_modes"
    if check.value(key) is None:
        return
    if len(check.value(key)) > check.value("beam.modes"):
        found = f"{len(check.value(key))} values, with {check.value('beam.modes')} modes"
        yield check.fault(key, found, "one value for each of the first modes")
    for other in ("drillstring.eccentricity", "drillstring.eccentricity_shape"):
        if check.axis(other):
            yield check.fault(f"sweep.{other}", f"an axis over {other} beside {key}", "one of the two")
        elif check.given(other) and check.value(other) != check.leaves[other].default:
            yield check.fault(other, f"{check.text(other)}, beside {key}", "left out")


def _start(check: Any) -> Iterator[Fault]:
    """The start is bent against the wall, or has the first mode of the study."""
    key = "initial.wall_force"
    if check.value(key) is None and not check.axis(key):
        return
    for name in _START:
        if check.axis(name):
            yield check.fault(f"sweep.{name}", f"an axis over {name} beside {key}", "one of the two")
        elif check.given(name) and check.value(name) != check.leaves[name].default:
            yield check.fault(name, f"{check.text(name)}, beside {key}", "left out: the force bends all modes")
    if check.value("initial.slice") or check.value("initial.ensemble") > 1:
        yield check.fault(key, f"{check.text(key)}, beside several starts", "left out")


def _buckling(check: Any) -> Iterator[Fault]:
    """The walls hold every shape that the weight on bit buckles: the bending stiffness
    is positive for all shapes that are zero at the stations with a wall.

    This is checked for the greatest weight, and not where numbers of the string or
    places of stations are swept.
    """
    string, beam = (check.value(name) for name in ("drillstring", "beam"))
    moved = ("drillstring.collar.", "drillstring.material.")
    if any(axis.startswith(moved) for axis in check.resolved["sweep"] if isinstance(axis, str)):
        return
    collar = string["collar"]
    second = math.pi / 64 * (collar["outer_diameter"] ** 4 - collar["inner_diameter"] ** 4)
    euler = math.pi**2 * string["material"]["young_modulus"] * second / collar["span"] ** 2
    has_axial_load = not isinstance(beam["axial_load"], str) or check.axis("beam.axial_load")
    key = "beam.axial_load" if has_axial_load else "operation.wob"
    load = check.ends(key)[1] / euler
    modes = np.arange(1, beam["modes"] + 1)
    wall_places = [station["at"] for station in beam["stations"] if station["stiffness"] != 0.0]
    _, singular_values, shapes = np.linalg.svd(np.sin(np.pi * np.outer(wall_places, modes)).reshape(-1, len(modes)))
    rank = int(np.sum(singular_values > 1e-9))
    unheld = shapes[rank:]
    if len(unheld) == 0:
        return
    least = np.linalg.eigvalsh(unheld @ np.diag(modes**4 - load * modes**2.0) @ unheld.T).min()
    if least <= 0.0:
        allowed = (
            "a load that buckles no shape of the collar that clears all stations with a wall, more of them, or fewer "
            f"modes; the buckling load of the span is {format_quantity(euler, 'kN')}"
        )
        path = ("sweep", short_key(key)) if check.axis(key) else None
        yield check.fault(
            key, f"{check.text(key, 1)}, under which the collar bends between the stations without end", allowed, path
        )


RULES = (
    *WHOLE_STRING,
    Rule(_stations, ("beam.stations",)),
    Rule(_eccentricities, ("beam.eccentricity_modes", "beam.modes")),
    Rule(_start, ("initial", "sweep.initial.wall_force")),
    Rule(_buckling, ("drillstring.collar", "drillstring.material", "beam", "operation.wob", "sweep")),
    *DRIVE_RULES,
    *LAWS,
    Rule(_section, ("record",)),
)
