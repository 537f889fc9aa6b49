"""The parameters of a string on a drag bit, in SI units, with the source of each default and
the confidence in it.

Sources as in :mod:`nsdrill.models.sections`.
"""

from __future__ import annotations

from dataclasses import field

from nsdrill.models.blades import Blades
from nsdrill.models.christoforou_yigit.parameters import Drillstring as MainString
from nsdrill.models.christoforou_yigit.parameters import Drive
from nsdrill.models.drive_rules import DRIVE
from nsdrill.models.operation import ModelParameters, Operation
from nsdrill.models.sections import (
    TWIST_INERTIA,
    TWIST_STIFFNESS,
    Section,
    Steel,
    known_as_a_whole,
    sections_from_the_top,
)
from nsdrill.models.starts import Starts, state
from nsdrill.ranges import like, parameter
from nsdrill.records import dataclass

AXIAL_MASS = {
    "units": "kg",
    "low": 1e-3,
    "high": 1e8,
    "usual": "20 to 200 t",
    "meaning": "Mass of the string that moves with the bit; null: of its geometry",
}
AXIAL_STIFFNESS = {
    "units": "N/m",
    "low": 0.0,
    "high": 1e12,
    "usual": "0 (constant hook load) to 1 MN/m",
    "meaning": "Axial stiffness of the string; null: of its geometry",
}


@dataclass(frozen=True)
class Drillstring(Steel):
    """The string: geometry, steel, damping, or its numbers as a whole."""

    axial_damping: float | None = parameter(
        None,
        "N s/m",
        "R: the wave that radiates into the pipe, A sqrt(E rho)",
        "medium",
        high=1e9,
        usual="0 to 500 kN s/m",
        meaning="Axial damping; null: the impedance of the pipe, A sqrt(E rho)",
    )
    torsional_damping: float = like(MainString, "torsional_damping")
    torsional_stiffness: float | None = known_as_a_whole(TWIST_STIFFNESS)
    rotary_inertia: float | None = known_as_a_whole(TWIST_INERTIA)
    axial_stiffness: float | None = known_as_a_whole(AXIAL_STIFFNESS)
    axial_mass: float | None = known_as_a_whole(AXIAL_MASS)
    sections: tuple[Section, ...] | None = sections_from_the_top()

    @property
    def measured(self) -> bool:
        """Whether all numbers of the whole string are given, so that its geometry has no
        say."""
        whole = self.torsional_stiffness, self.rotary_inertia, self.axial_stiffness, self.axial_mass
        return all(one is not None for one in whole)


@dataclass(frozen=True)
class Bit(Blades):
    """The bit."""

    radius: float = parameter(
        0.1905, "m", "P (15 in)", "certain", low=1e-4, high=5.0, usual="50 to 350 mm", meaning="Radius of the bit"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        most = 3.0 * self.radius
        if self.wear_length > most:
            raise ValueError(
                f"wear_length: found {self.wear_length:g} m, allowed: at most three radii of the bit, {most:g} m, with "
                "which its whole face is worn flat"
            )


@dataclass(frozen=True)
class Parameters(ModelParameters):
    """All that does not change during a sweep."""

    point, reads = Operation, (DRIVE,)
    drillstring: Drillstring = field(default_factory=Drillstring)
    bit: Bit = field(default_factory=Bit)
    drive: Drive = field(default_factory=Drive)


@dataclass(frozen=True)
class Initial(Starts):
    """The state at the start, with the surface of steady drilling. ``twist`` None is that
    of steady drilling, ``bit_speed`` and ``drive_speed`` None the set speed. A small axial
    velocity disturbs steady drilling, which otherwise lasts even where it is unstable."""

    z: float = state(0.0, "m", 10.0, "-1 to 1 mm", "Bit above where it is in steady drilling, which advances")
    vz: float = state(1e-4, "m/s", 100.0, "0.1 mm/s", "Velocity of the bit, up, less that of steady drilling")
    twist: float | None = state(None, "rad", 1e5, "-150 to 0 rad", "Twist of the string; null: that of steady drilling")
    bit_speed: float | None = state(None, "rad/s", 1e4, "-10 to 60 rad/s")
    lag: float | None = state(0.0, "rad", 1e5, "-20 to 20 rad; a drive that is not ideal has one")
    drive_speed: float | None = state(None, "rad/s", 1e4, "0 to 30 rad/s; as the lag")
    drive_angle: float = state(0.0, "rad", 1e9, "any")
