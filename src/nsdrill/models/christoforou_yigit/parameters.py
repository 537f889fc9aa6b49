"""The parameters of the drill string, in SI units, with the source of each default and
the confidence in it.

Sources as in :mod:`nsdrill.models.sections`. P prints five numbers and refers to CY for
the others, so its figures can be reproduced in kind, not to the digit.
"""

from __future__ import annotations

import math
from dataclasses import field, fields
from typing import Literal

from nsdrill.models.blades import ROCK, Rock
from nsdrill.models.christoforou_yigit.constraints import FROZEN, LAW, LOBED, OFF, SLIDING
from nsdrill.models.drive_laws import Kind, check_inertia
from nsdrill.models.drive_rules import DRIVE
from nsdrill.models.friction import LawOfBit
from nsdrill.models.operation import ModelParameters, Operation
from nsdrill.models.sections import (
    TWIST_INERTIA,
    TWIST_STIFFNESS,
    Collars,
    Lobes,
    Section,
    Steel,
    StillMud,
    TorqueFriction,
    Wall,
    WallFriction,
    known_as_a_whole,
    sections_from_the_top,
)
from nsdrill.models.starts import Starts, state
from nsdrill.ranges import Checked, choice, defaults, given, parameter
from nsdrill.records import dataclass


@dataclass(frozen=True)
class Collar(Collars):
    """The drill collars; ``span`` is the length between stabilisers that bends."""

    span: float = parameter(
        19.81,
        "m",
        "J, B (65 ft, rounded as printed)",
        "medium",
        low=1e-2,
        high=1e3,
        usual="3 to 40 m; laboratory rigs 0.1 m",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.span > self.length:
            raise ValueError(f"span: found {self.span:g} m, allowed: at most the collar length, {self.length:g} m")


@dataclass(frozen=True)
class Drillstring(Steel):
    """The string: geometry, steel, damping and modelling choices."""

    collar: Collar = field(default_factory=Collar)
    eccentricity: float = parameter(
        0.0127,
        "m",
        "CY as reported (1/2 in); P prints 0.7 m, wider than the hole",
        "medium",
        high=10.0,
        usual="1 to 15 mm: with 0 nothing drives the collar off its axis",
    )
    eccentric_mass: Literal["total", "steel"] = choice("total", "P; 'steel' leaves the fluid added mass out")
    lateral_softening: Literal["live", "static", "none"] = choice("live", "CY")
    axial_damping: float = parameter(
        4000.0,
        "N s/m",
        "CY, J as reported",
        "low",
        high=1e9,
        usual="1 to 100 kN s/m; critical 2 MN s/m on the rock",
        lane="axial_damping",
    )
    torsional_damping: float = parameter(
        50.0,
        "N m s/rad",
        "CY, J as reported",
        "low",
        high=1e7,
        usual="10 to 500 N m s/rad; critical 1000 N m s/rad",
        lane="torsional_damping",
    )
    eccentric_weight: bool = True
    torsional_stiffness: float | None = known_as_a_whole(TWIST_STIFFNESS)
    rotary_inertia: float | None = known_as_a_whole(TWIST_INERTIA)
    sections: tuple[Section, ...] | None = sections_from_the_top()

    @property
    def measured(self) -> bool:
        """Whether both numbers of its rotation are given, so that geometry has no say in
        it."""
        return self.torsional_stiffness is not None and self.rotary_inertia is not None


@dataclass(frozen=True)
class Mud(StillMud):
    """The drilling fluid, which may rotate with the fraction ``swirl`` of the rotary
    speed."""

    swirl: float = parameter(0.0, "", "J: 0.5", "medium", high=1.0, usual="0 to 0.5")


@dataclass(frozen=True)
@defaults(static=given(0.35, "R: as the wall", "low"), dynamic=given(0.30, "R: as the wall", "low"))
class StabilizerFriction(WallFriction):
    """Friction between stabilisers and wall, against slip speed in m/s."""


@dataclass(frozen=True)
class BitFriction(TorqueFriction):
    """Friction between bit and rock, against bit speed in rad/s, by one of the laws of
    :mod:`nsdrill.models.friction`, each of which reads its own keys."""

    law: LawOfBit = choice("hyperbolic", "R (form: Leine 1998)")  # type: ignore[assignment]
    dynamic_from: float = parameter(
        1.0,
        "rad/s",
        "R (form: Dawson, Lin & Spanos 1987)",
        "low",
        low=1e-4,
        high=1e3,
        usual="0.05 to 5 rad/s; laboratory rigs 20 rad/s",
    )
    b0: float = parameter(0.0239, "m", "L", "medium", high=10.0, usual="10 to 50 mm")
    b1: float = parameter(1.910, "s/rad", "L", "medium", low=1e-3, high=1e6, usual="1 to 10 s/rad")
    b2: float = parameter(8.5, "s/rad", "L", "medium", high=1e6, usual="5 to 10 s/rad")
    b3: float = parameter(5.47, "s^2/rad^2", "L", "medium", low=1e-6, high=1e6, usual="1 to 10 s^2/rad^2")


@dataclass(frozen=True)
class Well(Wall):
    """The hole, which may be inclined."""

    inclination: float = parameter(0.0, "rad", "P: a vertical hole", high=math.pi / 2, usual="0 to 90 deg")
    axial_friction: bool = False


@dataclass(frozen=True)
class Stabilizer(Checked):
    """The stabilisers at both ends of the span, rigid and in contact at the same time.
    ``clearance`` is radial, None for hinges without clearance and friction."""

    clearance: float | None = parameter(None, "m", "P: hinges", "modelling choice", high=10.0, usual="0 to 25 mm")
    friction: StabilizerFriction = field(default_factory=StabilizerFriction)


@dataclass(frozen=True)
class Bit(Lobes):
    """The bit on its lobed surface s = s0 sin(n_b phi), or on the surface that it cuts."""

    friction: BitFriction = field(default_factory=BitFriction)
    rock: Rock = field(default_factory=Rock)


@dataclass(frozen=True)
class Modes(Checked):
    """The modes of motion, free or frozen. Where a mode is frozen, the bit stays at its
    static position on a surface without lobes, the string rotates with the set speed,
    or the collar stays in the middle of the hole. ValueError where all are frozen."""

    axial: Literal["free", "frozen"] = choice("free", "P")
    torsional: Literal["free", "frozen"] = choice("free", "P")
    lateral: Literal["free", "frozen"] = choice("free", "P")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.axial == self.torsional == self.lateral == "frozen":
            raise ValueError("modes: found all of them frozen, allowed: at least one free")


@dataclass(frozen=True)
class TorqueDrive(Checked):
    """The drive at the top of the string whose controller sets its torque
    (:mod:`nsdrill.models.drive_laws`), as several models have it."""

    kind: Kind = choice("ideal", "P; the others as Simulator4nDOF has them")
    inertia: float = parameter(
        2900.0,
        "kg m^2",
        "Simulator4nDOF",
        "medium",
        low=1e-3,
        high=1e7,
        usual="500 to 5000 kg m^2 at the string; laboratory rigs 0.001 kg m^2",
    )
    stiffness: float = parameter(
        14500.0,
        "N m/rad",
        "stiff PI: 5 /s^2 of the inertia",
        "medium",
        high=1e9,
        usual="100 to 20 000 N m/rad; laboratory rigs 1 N m/rad",
    )
    damping: float = parameter(
        14853.0,
        "N m s/rad",
        "stiff PI: 50 pipe impedances",
        "medium",
        high=1e9,
        usual="300 to 20 000 N m s/rad; laboratory rigs 0.1 N m s/rad",
    )
    twist_gain: float = parameter(0.0, "N m/rad", low=-1e9, high=1e9, usual="-1000 to 1000 N m/rad")
    speed_gain: float = parameter(0.0, "N m s/rad", low=-1e9, high=1e9, usual="-1000 to 1000 N m s/rad")
    matching: float = parameter(
        4.0, "", "Simulator4nDOF", "medium", low=1e-3, high=1e3, usual="1 (the pipe's impedance) to 5"
    )
    frequency: float | None = parameter(
        None, "Hz", "the torsional frequency of the string", "medium", low=1e-4, high=100.0, usual="0.05 to 0.5 Hz"
    )
    compensated_inertia: float = parameter(0.0, "kg m^2", high=1e7, usual="0 to 0.9 times the inertia")
    a: float = parameter(0.25, "", "Simulator4nDOF", "medium", high=100.0, usual="0.1 to 1")
    high_pass: float = parameter(
        20.0 / (2.0 * math.pi), "s", "Simulator4nDOF", "medium", low=1e-3, high=1e6, usual="1 to 10 s"
    )
    torque_limit: float | None = parameter(
        None, "N m", "Simulator4nDOF has 60 kN m", "medium", high=1e9, usual="20 to 100 kN m at the string"
    )

    @property
    def ideal(self) -> bool:
        """Whether the top rotates with the set speed whatever the torque, so that the
        drive has no states."""
        return self.kind == "ideal"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_inertia(self)


@dataclass(frozen=True)
class Drive(TorqueDrive):
    """The drive at the top of the string and its controller
    (:mod:`nsdrill.models.christoforou_yigit.drives`).

    Each kind reads its own keys:

    ===============  ================================================================
    ``soft_torque``  ``matching``, ``frequency`` (None: that of the string),
                     ``compensated_inertia``
    ``z_torque``     ``a``, ``high_pass``
    ``lqr``          ``state_weight``, ``torque_weight``
    ``pi``           ``stiffness``, ``damping``, ``twist_gain``, ``speed_gain``
    ``dc_motor``     ``inductance`` to ``motor_inertia``, ``gains``
    ===============  ================================================================

    All but ``ideal`` read ``shaft_damping``; all but ``ideal`` and ``dc_motor`` read
    ``inertia``. A ``torque_limit`` (None: none) is for controllers that do not change
    the inertia of the machine: not for ``ideal``, ``z_torque`` and ``dc_motor``, and for
    ``soft_torque`` only without ``compensated_inertia``.
    """

    shaft_damping: float = parameter(0.0, "N m s/rad", "J as reported", "low", high=1e7, usual="0 to 500 N m s/rad")
    state_weight: float = parameter(1.0, "", high=1e12, low=1e-12, usual="1")
    inductance: float = parameter(0.005, "H", "CY as reported", "low", low=1e-6, high=100.0, usual="1 to 50 mH")
    resistance: float = parameter(0.01, "ohm", "CY as reported", "low", low=1e-9, high=1e3, usual="0.005 to 0.1 ohm")
    torque_constant: float = parameter(
        6.0, "V s/rad", "CY as reported", "low", low=1e-3, high=1e4, usual="1 to 20 V s/rad"
    )
    gear: float = parameter(7.2, "", "CY as reported", "low", low=1e-3, high=1e3, usual="1 to 12")
    table_inertia: float = parameter(
        930.0, "kg m^2", "CY as reported", "low", low=1e-3, high=1e7, usual="200 to 2000 kg m^2"
    )
    motor_inertia: float = parameter(23.0, "kg m^2", "CY as reported", "low", high=1e6, usual="5 to 50 kg m^2")
    gains: tuple[float, ...] | None = parameter(
        None,
        "",
        low=-1e9,
        high=1e9,
        most=5,
        meaning="K_I, K_1, K_2, K_3, K_4 of the motor's voltage, kind dc_motor; null: constant voltage",
    )
    torque_weight: float = parameter(1e-6, "", high=1e12, low=1e-15, usual="1e-8 to 1e-4")

    @property
    def limited(self) -> bool:
        """Whether the torque of the motor has a limit."""
        return self.torque_limit is not None and "torque_limit" in DRIVE.keys[self.kind]

    @property
    def electric(self) -> bool:
        """Whether it is a DC motor, whose torque is a state: that of its circuit."""
        return self.kind == "dc_motor"

    @property
    def regulated(self) -> bool:
        """Whether the voltage of a DC motor follows the motion."""
        return self.gains is not None and self.electric

    @property
    def motor_damping(self) -> float:
        """Of a DC motor: the rate at which its torque falls with its speed, (n K)^2/R,
        at the string [N m s/rad]."""
        return (self.gear * self.torque_constant) * (self.gear * self.torque_constant) / self.resistance

    @property
    def circuit_time(self) -> float:
        """Of a DC motor: the time constant of its armature [s], L/R."""
        return self.inductance / self.resistance

    @property
    def top_inertia(self) -> float:
        """The inertia at the top of the string [kg m^2]; of a DC motor that of the
        table plus n^2 times that of the motor."""
        return self.table_inertia + self.gear * self.gear * self.motor_inertia if self.electric else self.inertia


@dataclass(frozen=True)
class Parameters(ModelParameters):
    """The parameters of the model, to which the operating point does not belong."""

    point, reads = Operation, (DRIVE, LAW, ROCK, *SLIDING)
    drillstring: Drillstring = field(default_factory=Drillstring)
    mud: Mud = field(default_factory=Mud)
    well: Well = field(default_factory=Well)
    bit: Bit = field(default_factory=Bit)
    modes: Modes = field(default_factory=Modes)
    drive: Drive = field(default_factory=Drive)
    stabilizer: Stabilizer = field(default_factory=Stabilizer)

    @property
    def unread(self) -> frozenset[str]:
        """The keys of a study that a string with these parameters does not read."""
        keys = {*super().unread}
        if self.bit.rock.regenerative:
            keys |= set(LOBED)
        for mode, keys_of_mode in FROZEN.items():
            if getattr(self.modes, mode) == "frozen":
                keys |= {*keys_of_mode, *OFF[mode]}
        if self.stabilizer.clearance is None:
            keys |= {f"stabilizer.friction.{item.name}" for item in fields(self.stabilizer.friction)}
        return frozenset(keys)

    def __post_init__(self) -> None:
        collar = self.drillstring.collar.outer_diameter
        self.well.check(collar)
        gap, clearance = (self.well.diameter - collar) / 2, self.stabilizer.clearance
        if clearance is not None and clearance >= gap:
            raise ValueError(
                f"stabilizer.clearance: found {clearance:g} m, allowed: below the gap between collar and wall, {gap:g} "
                "m"
            )


@dataclass(frozen=True)
class Initial(Starts):
    """The initial state. ``None`` stands for the natural value: for ``z`` the static
    position under the weight on bit, for ``bit_speed`` and ``drive_speed`` the set
    speed of the top drive; a study takes null for the ``lag`` too, which is 0 then.

    An ensemble is drawn as described in :mod:`.collar`.
    """

    x: float = state(1e-3, "m", 10.0, "within the gap, 10 to 100 mm, and some mm of wall")
    y: float = state(0.0, "m", 10.0, "as x")
    vx: float = state(0.0, "m/s", 1e3, "up to 5 m/s")
    vy: float = state(0.0, "m/s", 1e3, "up to 5 m/s")
    z: float | None = state(None, "m", 1e3, "-50 to 50 mm")
    vz: float = state(0.0, "m/s", 1e3, "up to 1 m/s")
    twist: float = state(0.0, "rad", 1e5, "-150 to 0 rad: some 20 turns")
    bit_speed: float | None = state(None, "rad/s", 1e4, "-10 to 60 rad/s")
    lag: float | None = state(0.0, "rad", 1e5, "-20 to 20 rad; a drive that is not ideal has one")
    drive_speed: float | None = state(None, "rad/s", 1e4, "0 to 30 rad/s; as the lag")
    drive_angle: float = state(0.0, "rad", 1e9, "after a day at 120 rpm 1 million rad")
