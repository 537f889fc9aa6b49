"""The parameters of the string of segments, in SI units, with source and confidence of
each default.

Sources: **B** Sarker, Rideout & Butt, "Dynamic model of an oilwell drillstring with
stick-slip and bit-bounce interaction", ICBGM 2012, as far as its tables can be read;
**CY** Christoforou & Yigit 2003, J. Sound Vib. 267, as reported by others; **R**
reconstructed here.
"""

from __future__ import annotations

import math
from dataclasses import field, fields
from typing import Any, Literal

from nsdrill.models.blades import ROCK, Rock
from nsdrill.models.christoforou_yigit.parameters import Drive as MainDrive
from nsdrill.models.drive_laws import Kind, check_inertia, goes_by_torque, kinds
from nsdrill.models.operation import ModelParameters, Operation
from nsdrill.models.sections import (
    Collars,
    Cutting,
    Fluid,
    Hole,
    Lobes,
    Pipe,
    Section,
    Steel,
    TorqueFriction,
    Torques,
    Tubular,
    check_bore,
    sections_from_the_top,
)
from nsdrill.models.starts import Starts, state
from nsdrill.ranges import Checked, choice, defaults, given, like, option, parameter, records
from nsdrill.records import dataclass

MAX_SEGMENTS = 40
# The keys of the drive that each kind reads.
_MOTOR = ("inductance", "resistance", "torque_constant", "gear", "motor_inertia", "table_inertia", "table_damping")
_WEIGHTS = ("control_weight", "lag_weight", "drive_speed_weight", "current_weight", "twist_weight", "bit_speed_weight")
DRIVE = kinds(("inertia", "on_at"), dc_motor=(*_MOTOR, "gains", "on_at"), lqr=(*_MOTOR, *_WEIGHTS, "on_at"))


@dataclass(frozen=True)
@defaults(
    outer_diameter=given(0.171, "B", "high"),
    inner_diameter=given(0.0571, "B", "high"),
    length=given(200.0, "B", "high"),
)
class Collar(Collars):
    """The drill collars."""


@dataclass(frozen=True)
@defaults(outer_diameter=given(0.101, "B", "high"), inner_diameter=given(0.0848, "B", "high"))
class DrillPipe(Pipe):
    """The drill pipe."""


@dataclass(frozen=True)
class Drillstring(Steel):
    """The string: collars, pipe and their steel."""

    collar: Collar = field(default_factory=Collar)
    pipe: DrillPipe = field(default_factory=DrillPipe)
    sections: tuple[Section, ...] | None = sections_from_the_top()


@dataclass(frozen=True)
class Kelly(Checked):
    """The kelly, a rigid body here: its spring would be a hundred times stiffer than
    the pipe."""

    length: float = parameter(15.0, "m", "B", "high", high=100.0, usual="12 to 17 m", meaning="Length")
    outer_diameter: float = like(
        Tubular,
        "outer_diameter",
        **given(0.379, "B as printed: 12.65 t; a kelly is about 0.13 m", "low", usual="0.08 to 0.15 m"),
        meaning="Outer diameter",
    )
    inner_diameter: float = like(
        Tubular, "inner_diameter", **given(0.0825, "B", "medium", usual="0.05 to 0.1 m"), meaning="Inner diameter"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_bore(self.inner_diameter, self.outer_diameter)


@dataclass(frozen=True)
class Top(Checked):
    """What the string hangs from."""

    stiffness: float = parameter(
        9.3e6, "N/m", "B", "high", low=1.0, high=1e13, usual="5 to 20 MN/m", meaning="Stiffness of cable and derrick"
    )
    damping: float = parameter(
        0.0,
        "N s/m",
        "R: B's number is lost",
        "low",
        high=1e9,
        usual="0 to 100 kN s/m",
        meaning="Damping of cable and derrick",
    )
    mass: float = parameter(
        7031.0, "kg", "B", "high", high=1e6, usual="5 to 40 t", meaning="Mass of swivel and travelling block"
    )


@dataclass(frozen=True)
class MaterialDamping(Checked):
    """The damping of a segment over its stiffness, a time."""

    axial: float = parameter(
        0.2e-3,
        "s",
        "R: B's number is lost",
        "low: sweep it",
        high=1.0,
        usual="0 to 5 ms",
        meaning="Axial damping of a segment over its stiffness",
    )
    torsional: float = parameter(
        10e-3,
        "s",
        "R: B's number is lost",
        "low: sweep it",
        high=1.0,
        usual="0 to 20 ms",
        meaning="Torsional damping of a segment over its stiffness",
    )


@dataclass(frozen=True)
class Hydraulics(Checked):
    """The flow of the mud, down the bore and up the annulus, and its drag on the moving
    string."""

    flow: float = parameter(0.022, "m^3/s", "B", "high", high=10.0, usual="0.01 to 0.08 m^3/s", meaning="Mean flow")
    pulsation: float = parameter(
        0.002, "m^3/s", "B", "high", high=10.0, usual="0 to 0.01 m^3/s", meaning="Amplitude of the pumps' pulsation"
    )
    pulsation_rate: float = parameter(
        25.13, "rad/s", "B", "high", high=1e4, usual="10 to 60 rad/s", meaning="Angular frequency of the pulsation"
    )
    annulus_factor: float = parameter(
        0.045,
        "",
        "B",
        "high",
        high=10.0,
        usual="0.02 to 0.1",
        meaning="Weisbach's friction factor outside of the string",
    )
    bore_factor: float = parameter(
        0.035, "", "B", "high", high=10.0, usual="0.01 to 0.1", meaning="Weisbach's friction factor in the bore"
    )


NO_HYDRAULICS = {"annulus_factor": 0.0, "bore_factor": 0.0}


@dataclass(frozen=True)
class Segments(Checked):
    """The division of the string into segments, and what is at its ends."""

    pipe: int = parameter(
        10, "", "B", "high", low=1, high=MAX_SEGMENTS, usual="5 to 20", meaning="Number of segments of the pipe"
    )
    collar: int = parameter(
        10, "", "B", "high", low=1, high=MAX_SEGMENTS, usual="5 to 20", meaning="Number of segments of the collars"
    )
    top: Top = field(default_factory=Top)
    kelly: Kelly = field(default_factory=Kelly)
    material_damping: MaterialDamping = field(default_factory=MaterialDamping)
    hydraulics: Hydraulics = field(default_factory=Hydraulics, metadata={"off": NO_HYDRAULICS})
    rock_damping: float = parameter(
        1.5e5,
        "N s/m",
        "B",
        "high",
        high=1e9,
        usual="0 to 1 MN s/m",
        meaning="Damping of the rock under the weight on bit",
    )
    threshold_force: float = parameter(
        10e3, "N", "B", "high", low=1.0, high=1e7, usual="1 to 50 kN", meaning="Force on the bit above which it cuts"
    )


@dataclass(frozen=True)
@defaults(density=given(1198.0, "B", "high"))
class Mud(Fluid):
    """The drilling fluid."""

    viscosity: float = parameter(
        0.03,
        "Pa s",
        "B",
        "high",
        high=1e3,
        usual="0.001 to 0.1 Pa s",
        meaning="Viscosity between the rotating string and the wall",
    )


MAX_STATIONS = 100


@dataclass(frozen=True)
class SurveyStation(Checked):
    """The inclination of the hole at a depth; None stands for that of the well."""

    depth: float = parameter(0.0, "m", "R", "", high=2e4, usual="0 to 10 000 m", meaning="Depth of the station")
    inclination: float | None = parameter(
        None,
        "rad",
        "the well's",
        "",
        high=math.pi,
        usual="0 to 90 deg",
        meaning="Inclination of the hole there; null: that of the well",
    )


@dataclass(frozen=True)
class WallFriction(Checked):
    """Coulomb friction of the string along the wall, static up to a threshold of the
    turning speed and dynamic beyond it. A string on which neither acts is compiled
    without it."""

    static: float = parameter(
        0.0,
        "",
        "R: none",
        "",
        high=10.0,
        usual="0.1 to 0.8",
        meaning="Coefficient of friction along the wall up to the threshold",
    )
    dynamic: float = parameter(
        0.0,
        "",
        "R: none",
        "",
        high=10.0,
        usual="0.1 to 0.4",
        meaning="Coefficient of friction along the wall beyond the threshold",
    )
    threshold: float = parameter(
        0.9,
        "rad/s",
        "Aarsnes & Shor 2018",
        "low",
        low=1e-3,
        high=1e3,
        usual="0.3 to 2 rad/s",
        meaning="Turning speed at which friction falls from static to dynamic",
    )
    smoothing: float = parameter(
        50.0,
        "s/rad",
        "R: as of the cutters",
        "low",
        low=1e-3,
        high=1e9,
        usual="10 to 1000 s/rad",
        meaning="Steepness of friction along the wall at zero speed",
    )


NO_WALL_FRICTION = {"static": 0.0, "dynamic": 0.0}


@dataclass(frozen=True)
@defaults(diameter=given(0.2, "B", "high"))
class Well(Hole):
    """The hole, and how the string rubs on its wall."""

    inclination: float = parameter(
        0.0,
        "rad",
        "B: a vertical hole",
        high=math.pi,
        usual="0 to 90 deg",
        meaning="Inclination of the hole from the vertical, where no station of the survey says another",
    )
    survey: tuple[SurveyStation, ...] = records(
        SurveyStation,
        (SurveyStation(),),
        "R: one inclination everywhere",
        "",
        most=MAX_STATIONS,
        meaning="Stations from the top, between which the inclination is linear",
    )
    friction_along: WallFriction = field(default_factory=WallFriction, metadata={"off": NO_WALL_FRICTION})
    axial_friction: bool = option(False, "Friction along the wall acts along the hole, too")


@dataclass(frozen=True)
class HumpedFriction(Checked):
    """Friction of the bit, mu0 (tanh w + alpha w / (1 + beta w^2) + nu w) with the bit
    speed w in rad/s."""

    level: float = parameter(
        0.06,
        "",
        "B",
        "medium: the labels are one short",
        high=10.0,
        usual="0.02 to 0.5",
        meaning="Factor of the whole law (mu0)",
    )
    hump: float = parameter(
        2.0,
        "s/rad",
        "B",
        "medium: as the level",
        high=1e3,
        usual="0 to 5 s/rad",
        meaning="Height of the hump at low speed (alpha)",
    )
    narrowing: float = parameter(
        1.0,
        "s^2/rad^2",
        "B",
        "medium: as the level",
        high=1e6,
        usual="0.1 to 10 s^2/rad^2",
        meaning="How soon the hump falls with speed (beta)",
    )
    viscous: float = parameter(
        0.01, "s/rad", "B", "medium: as the level", high=1e3, usual="0 to 0.1 s/rad", meaning="Rise with speed (nu)"
    )


@dataclass(frozen=True)
class BitFriction(Torques, HumpedFriction):
    """Friction of the bit: that law, or two torques of the whole bit, between which it
    falls with the bit speed as in the main model. ``smoothing`` and ``decay`` are of the
    torques."""

    smoothing: float = like(TorqueFriction, "smoothing", meaning="Steepness at zero speed, of friction as torques")
    decay: float = like(TorqueFriction, "decay", meaning="Decay with bit speed, of friction as torques")

    @property
    def unread(self) -> tuple[str, ...]:
        """The fields that a bit with this friction does not read."""
        coefficients = tuple(item.name for item in fields(HumpedFriction))
        return coefficients if self.by_torque else ("smoothing", "decay")


@dataclass(frozen=True)
class SegmentCutting(Cutting):
    """The cutting torque. ROP [m/s] = c1 W[N] sqrt(w[rad/s]) + c2, 0 if negative; the
    depth of cut is 2 pi ROP / w."""

    speed: Literal["live", "mean"] = choice("live", "R: with 'mean' (the set speed) the paper's peaks do not come out")
    slow: float = parameter(
        0.05,
        "rad/s",
        "R",
        "low",
        low=1e-6,
        high=10.0,
        usual="0.01 to 0.5 rad/s",
        meaning="Bit speed below which the depth of cut grows no further",
    )
    smoothing: float = parameter(
        50.0,
        "s/rad",
        "R",
        "low",
        low=1e-3,
        high=1e9,
        usual="10 to 1000 s/rad",
        meaning="Steepness of the cutting torque at zero speed",
    )


# In place of these a bit that cuts its own surface has the keys of the rock.
LOBED = (
    *("bit.lobes", "bit.surface_amplitude", "bit.rock_stiffness", "segments.rock_damping", "segments.threshold_force"),
    *(f"bit.cutting.{item.name}" for item in fields(SegmentCutting)),
    *(f"bit.friction.{item.name}" for item in fields(BitFriction)),
)


@dataclass(frozen=True)
class Bit(Checked):
    """The bit on its lobed surface s = s0 sin(b phi), or on the surface that it cuts."""

    radius: float = parameter(
        0.1, "m", "B", "high", low=1e-4, high=5.0, usual="0.05 to 0.4 m", meaning="Radius of the bit"
    )
    mass: float = parameter(65.0, "kg", "B", "high", high=1e5, usual="20 to 500 kg", meaning="Mass of the bit")
    lobes: int = like(Lobes, "lobes", **given(1, "B", "medium: the labels are one short"))
    # the published string has its height with one lobe
    surface_amplitude: float = like(Lobes, "surface_amplitude", **given(1e-3, "B", "medium: as lobes"), follows=None)
    rock_stiffness: float = like(Lobes, "rock_stiffness", **given(1.16e9, "B", "high"))
    cutting: SegmentCutting = field(default_factory=SegmentCutting)
    friction: BitFriction = field(default_factory=BitFriction)
    rock: Rock = field(default_factory=Rock)


def _weight(default: float, of: str, usual: str = "0 to 1e6") -> Any:
    """The field of a weight of the regulator."""
    meaning = f"Weight of the {of}; kind lqr"
    return parameter(default, "", "B; the order is lost", "medium", high=1e15, usual=usual, meaning=meaning)


QUOTED = {"source": "CY as quoted; B's is lost", "confidence": "low"}


@dataclass(frozen=True)
class Drive(Checked):
    """The drive: a shaft that keeps its speed (``ideal``), a motor at constant voltage
    (``dc_motor``), the motor with its voltage controlled by a linear-quadratic
    regulator (``lqr``), or a drive whose torque follows the law of a controller
    (:mod:`nsdrill.models.drive_laws`). The weights of the regulator are those of squared
    deviations from steady drilling, and of the squared voltage."""

    kind: Kind = choice("dc_motor", "B; those by torque as in the main model")
    inductance: float = like(MainDrive, "inductance", meaning="Inductance of the motor", **QUOTED)
    resistance: float = like(MainDrive, "resistance", meaning="Resistance of the motor", **QUOTED)
    torque_constant: float = like(MainDrive, "torque_constant", meaning="Voltage over motor speed", **QUOTED)
    gear: float = like(MainDrive, "gear", meaning="Revolutions of the motor for one of the table", **QUOTED)
    motor_inertia: float = like(MainDrive, "motor_inertia", meaning="Inertia at the motor's shaft", **QUOTED)
    table_inertia: float = like(MainDrive, "table_inertia", meaning="Inertia of the table", **QUOTED)
    table_damping: float = parameter(
        0.0,
        "N m s/rad",
        "R: B's number is lost",
        "low",
        high=1e7,
        usual="0 to 500 N m s/rad",
        meaning="Damping of the table",
    )
    gains: tuple[float, ...] | None = like(
        MainDrive, "gains", meaning="K_I, K_1, K_2, K_3, K_4 of the voltage, kind dc_motor; null: constant voltage"
    )
    control_weight: float = parameter(
        950.0,
        "",
        "B: a loose number",
        "medium",
        low=1e-9,
        high=1e15,
        usual="1 to 1e5",
        meaning="Weight of the squared control voltage; kind lqr",
    )
    lag_weight: float = _weight(1.0, "table's squared angle")
    drive_speed_weight: float = _weight(20000.0, "table's squared speed")
    current_weight: float = _weight(1.0, "squared current")
    twist_weight: float = _weight(80000.0, "bit's squared angle")
    bit_speed_weight: float = _weight(950000.0, "bit's squared speed", usual="0 to 1e7")
    on_at: float = parameter(
        0.0,
        "s",
        "",
        "",
        high=1e7,
        usual="0 or 40 s",
        meaning="Time of a run at which control begins; before it, "
        "with lqr and gains the "
        "voltage is constant, else the top turns with the set speed",
    )
    inertia: float = like(MainDrive, "inertia", meaning="Inertia of a drive by torque, without the kelly's")
    torque_limit: float | None = like(
        MainDrive, "torque_limit", meaning="Torque limit: the motor's torque stays between 0 and this; null: none"
    )
    matching: float = like(MainDrive, "matching")
    frequency: float | None = like(
        MainDrive,
        "frequency",
        meaning="Frequency that the controller is tuned to, null: the string's first; kind soft_torque",
    )
    compensated_inertia: float = like(
        MainDrive, "compensated_inertia", meaning="Inertia that is compensated; kind soft_torque"
    )
    a: float = like(MainDrive, "a")
    high_pass: float = like(MainDrive, "high_pass")
    stiffness: float = like(MainDrive, "stiffness")
    damping: float = like(MainDrive, "damping")
    twist_gain: float = like(MainDrive, "twist_gain")
    speed_gain: float = like(MainDrive, "speed_gain")

    @property
    def by_torque(self) -> bool:
        """Whether the drive has no circuit: its torque follows the law of a controller,
        or is the one that keeps the set speed."""
        return self.kind == "ideal" or goes_by_torque(self.kind)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_inertia(self)


@dataclass(frozen=True)
class Parameters(ModelParameters):
    """All that does not change during a sweep."""

    point, reads = Operation, (DRIVE, ROCK)
    drillstring: Drillstring = field(default_factory=Drillstring)
    segments: Segments = field(default_factory=Segments)
    mud: Mud = field(default_factory=Mud)
    well: Well = field(default_factory=Well)
    bit: Bit = field(default_factory=Bit)
    drive: Drive = field(default_factory=Drive)

    @property
    def unread(self) -> frozenset[str]:
        """The keys of a study that a string with these choices does not read."""
        keys = super().unread | {f"bit.friction.{name}" for name in self.bit.friction.unread}
        return keys | set(LOBED) if self.bit.rock.regenerative else keys

    def __post_init__(self) -> None:
        sections = [section.outer_diameter or 0.0 for section in self.drillstring.sections or ()]
        widest = max(sections or [self.drillstring.collar.outer_diameter, self.drillstring.pipe.outer_diameter])
        if widest >= self.well.diameter:
            raise ValueError(
                f"well.diameter: found {self.well.diameter:g} m, allowed: above the outer diameters of pipe and "
                f"collars, {widest:g} m"
            )


@dataclass(frozen=True)
@defaults(
    depth=given(2200.0, "B", "high", usual="500 to 10 000 m"),
    wob=given(100e3, "B", "high", usual="20 to 300 kN"),
    rotary_speed=given(13.0, "B", "high", usual="5 to 60 rad/s"),
)
class SegmentsOperation(Operation):
    """The operating point: 2000 m of pipe above the collars."""


@dataclass(frozen=True)
class Initial(Starts):
    """The state at the start. None stands for the value in steady drilling; with
    ``start: rest``, twist and bit speed are 0 instead: a string at rest below a
    rotating table.

    The states between surface and bit follow from these: positions and angles are those
    of a string that is stretched or twisted by a force or a torque at its ends, and the
    speeds vary from that of the table to that of the bit as such angles do."""

    start: Literal["steady", "rest"] = choice("steady", "")
    z: float | None = state(None, "m", 1e3, "-50 to 50 mm")
    twist: float | None = state(
        None,
        "rad",
        1e5,
        "-150 to 0 rad; a string at rest 0",
        "Angle of the bit less that of the drive; null: as start says",
    )
    bit_speed: float | None = state(None, "rad/s", 1e4, "-10 to 60 rad/s; a string at rest 0")
    drive_angle: float = state(0.0, "rad", 1e9, "any")
