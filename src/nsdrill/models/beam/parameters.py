"""The parameters of the elastic collar, in SI units: those of the lumped model, and what its modes and walls need.

Sources: **G** Ghasemloonia, Rideout & Butt, vibration of a drill collar section under weight on bit with contact; the
others as in :mod:`nsdrill.models.christoforou_yigit.parameters`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from nsdrill.models.christoforou_yigit.parameters import Bit, Drive, Modes, Mud, Well
from nsdrill.models.christoforou_yigit.parameters import Drillstring as LumpedString
from nsdrill.models.operation import LARGEST_FORCE
from nsdrill.models.starts import Starts, state
from nsdrill.ranges import Checked, choice, parameter

MOST_MODES, MOST_STATIONS = 10, 21


@dataclass(frozen=True)
class Drillstring(LumpedString):
    """The string. ``lateral_softening`` is by the force of the rock at every moment (``force``), by its torque as well
    (``live``), by the weight on bit (``static``), or none."""

    eccentricity_shape: Literal["first", "uniform"] = choice("first", "R: as the lumped model has it")
    lateral_softening: Literal["force", "live", "static", "none"] = choice(  # type: ignore[assignment]
        "force", "G has a constant force; CY the torque, which a shaft feels in second order only"
    )


@dataclass(frozen=True)
class Beam(Checked):
    """The collar between the stabilisers, simply supported at both."""

    modes: int = parameter(5, "", "G", "high", low=1, high=MOST_MODES, usual="1 to 10",
                           meaning="Number of bending modes in each plane, sin(n pi x / l)")  # fmt: skip
    damping_ratio: float = parameter(0.0, "", "R", "low", high=10.0, usual="0.005 to 0.01",
                                     meaning="Structural damping ratio of every mode")  # fmt: skip
    modal_mass_factor: float = parameter(
        1.0, "", "R: 10 has the modal mass that G prints with the frequencies that follow from its buckling load",
        "modelling choice", low=1e-3, high=1e3, usual="1",
        meaning="Factor of the modal mass and of the bending stiffness, which leaves the frequencies as they are",
    )  # fmt: skip


@dataclass(frozen=True)
class Stations(Checked):
    """Where along the span the collar may touch the wall: ``number`` places, equally spaced from ``first`` to ``last``.
    ``watched`` None is the station nearest to the middle."""

    number: int = parameter(5, "", "R", "modelling choice", low=1, high=MOST_STATIONS, usual="1 to 10",
                            meaning="Number of places along the span where the collar may touch the wall")  # fmt: skip
    first: float = parameter(0.1, "", "G", "high", low=0.001, high=0.999, usual="0.05 to 0.5",
                             meaning="Place of the first one as a fraction of the span")  # fmt: skip
    last: float = parameter(0.9, "", "R: mirrors the first", "modelling choice", low=0.001, high=0.999,
                            usual="0.5 to 0.95", meaning="Place of the last one as a fraction of the span")  # fmt: skip
    watched: float | None = parameter(
        None, "", "R: the station nearest to the middle of the span", "modelling choice", low=0.001, high=0.999,
        usual="0.5", meaning="Place at which radius and whirl are measured, as a fraction of the span",
    )  # fmt: skip


@dataclass(frozen=True)
class Parameters:
    """All that does not change during a sweep."""

    drillstring: Drillstring = field(default_factory=Drillstring)
    beam: Beam = field(default_factory=Beam)
    stations: Stations = field(default_factory=Stations)
    mud: Mud = field(default_factory=Mud)
    well: Well = field(default_factory=Well)
    bit: Bit = field(default_factory=Bit)

    # What the lumped model has besides: all its motions are free, the drive turns with the set speed.
    modes: ClassVar[Modes] = Modes()
    drive: ClassVar[Drive] = Drive()

    def __post_init__(self) -> None:
        collar = self.drillstring.collar.outer_diameter
        if collar >= self.well.diameter:
            raise ValueError(
                f"well.diameter: found {self.well.diameter:g} m, allowed: above the outer diameter of the collar, "
                f"{collar:g} m"
            )
        if self.stations.number > 1 and self.stations.first >= self.stations.last:
            raise ValueError(
                f"stations.first: found {self.stations.first:g}, allowed: below stations.last, {self.stations.last:g}"
            )


@dataclass(frozen=True)
class Initial(Starts):
    """The state at the start. ``x_1`` ... ``vy_1`` are of the first bending mode, the others begin at rest.

    With a ``wall_force`` the collar begins at rest as a force at the watched place bends it in the plane of x, so far
    that a wall there presses it with this force; 0 is as far as the wall.
    """

    x_1: float = state(1e-3, "m", 10.0, "within the gap, 10 to 100 mm", "First bending mode, in the plane of x")
    y_1: float = state(0.0, "m", 10.0, "as x_1", "First bending mode, in the plane of y")
    vx_1: float = state(0.0, "m/s", 1e3, "up to 5 m/s", "Its velocity in the plane of x")
    vy_1: float = state(0.0, "m/s", 1e3, "up to 5 m/s", "Its velocity in the plane of y")
    wall_force: float | None = parameter(
        None, "N", high=LARGEST_FORCE, usual="0 to 1 MN",
        meaning="Force with which the wall presses the collar at the start, bent at rest in the plane of x",
    )  # fmt: skip
    z: float | None = state(None, "m", 1e3, "-50 to 50 mm")
    vz: float = state(0.0, "m/s", 1e3, "up to 1 m/s")
    twist: float = state(0.0, "rad", 1e5, "-150 to 0 rad: some 20 turns")
    bit_speed: float | None = state(None, "rad/s", 1e4, "-10 to 60 rad/s")
    drive_angle: float = state(0.0, "rad", 1e9, "after a day at 120 rpm 1 million rad")
