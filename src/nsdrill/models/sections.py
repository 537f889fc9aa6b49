"""The sections of a study that several models have, each once. A model that has a
section with other numbers names these (:func:`nsdrill.ranges.defaults`).

Sources: **P** the nonsmooth-system paper whose figures are reproduced; **CY**
Christoforou & Yigit 2003, J. Sound Vib. 267:1029-1045, and the authors' related papers
as reported by others; **B** Sarker, Rideout & Butt, ICBGM 2012; **J** Jansen 1991 and
Jansen & van den Steen 1995; **L** a public lateral-torsional code of COPPE/UFRJ; **G**
Ghasemloonia, Rideout & Butt, vibration of a drill collar section under weight on bit
with contact; **R** reconstructed here.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import field, fields
from typing import Any, Literal, NamedTuple

import numpy as np

from nsdrill.models.friction import reads_static
from nsdrill.models.operation import LARGEST_FORCE, LARGEST_LENGTH, Numeric
from nsdrill.ranges import Checked, Follows, choice, defaults, given, like, parameter, records
from nsdrill.records import dataclass

WIDEST_BORE = 0.999  # of the outer diameter, so that the wall has some thickness


def check_bore(inner: float, outer: float) -> None:
    """ValueError for a bore [m] that leaves the tube no wall."""
    if inner > WIDEST_BORE * outer:
        raise ValueError(
            f"inner_diameter: found {inner:g} m, allowed: at most {WIDEST_BORE:g} times the outer diameter, {outer:g} m"
        )


def bore_of(outer: float, weight: float, density: float) -> float:
    """The inner diameter [m] of an even tube with this ``outer`` diameter [m], ``weight``
    per length [kg/m] and ``density`` [kg/m^3]; ValueError where a rod is lighter."""
    squared = outer**2 - 4.0 * weight / (math.pi * density)
    if squared < 0.0:
        raise ValueError(f"weight: found {weight:g} kg/m, allowed: at most that of a rod of {outer:g} m")
    return math.sqrt(squared)


@dataclass(frozen=True)
class Tubular(Checked):
    """A tube of the string: pipe, collars, kelly."""

    outer_diameter: float = parameter(
        0.127, "m", "J by arithmetic", "medium", low=1e-4, high=10.0, usual="2 3/8 to 6 5/8 in; laboratory rods 3 mm"
    )
    inner_diameter: float = parameter(0.1086, "m", "J by arithmetic", "medium", high=10.0, usual="1.8 to 6 in; a rod 0")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_bore(self.inner_diameter, self.outer_diameter)


@dataclass(frozen=True)
class Pipe(Tubular):
    """The drill pipe; its length is the depth less the collar length. A study with a
    ``weight`` has the inner diameter of the even pipe of that weight (:func:`bore_of`)."""

    weight: float | None = parameter(
        None,
        "kg/m",
        "API RP 7G: 17.93 lb/ft are 5 by 4.276 in",
        "high",
        low=1e-6,
        high=1e6,
        usual="plain end 4.5 to 40 lb/ft",
        meaning="Weight per length of its steel in air, in place of the inner diameter; null: that",
    )


@dataclass(frozen=True)
@defaults(
    outer_diameter=given(0.2286, "J, B", "medium", usual="3 1/8 to 11 1/4 in; laboratory rods 3 mm"),
    inner_diameter=given(0.0762, "J, B", "medium", usual="1 1/4 to 4 in; a rod 0"),
)
class Collars(Tubular):
    """The drill collars."""

    length: float = parameter(
        200.0, "m", "J, B", "medium", low=1e-2, high=1e4, usual="20 to 400 m; laboratory rigs 0.1 m"
    )


@dataclass(frozen=True)
class Material(Checked):
    """The steel of the string."""

    density: float = parameter(
        7850.0, "kg/m^3", "standard", "high", low=10.0, high=1e6, usual="composite 1600 to tungsten 19 300 kg/m^3"
    )
    young_modulus: float = parameter(
        210e9, "Pa", "standard", "high", low=1e6, high=1e13, usual="plastics 2 GPa, aluminium 70 GPa, steel 210 GPa"
    )
    shear_modulus: float = parameter(
        79.6e9, "Pa", "standard", "high", low=1e6, high=1e13, usual="plastics 1 GPa, aluminium 26 GPa, steel 80 GPa"
    )


MOST_SECTIONS = 40


@dataclass(frozen=True)
class Section(Checked):
    """A section of the string, an even tube. The inner diameter may be given by weight
    (:func:`bore_of`); None stands for the numbers of the string's ``material`` and, of the
    first section, for the length that reaches to the surface."""

    length: float | None = parameter(
        None,
        "m",
        "the sheet of the assembly",
        "high",
        low=1e-3,
        high=LARGEST_LENGTH,
        usual="1 to 5000 m",
        meaning="Length; of the first section null: to the surface",
    )
    outer_diameter: float | None = parameter(
        None, "m", "the sheet", "high", low=1e-4, high=10.0, usual="2 3/8 to 11 1/4 in", meaning="Outer diameter"
    )
    inner_diameter: float | None = parameter(
        None, "m", "the sheet", "high", high=10.0, usual="1.8 to 6 in; a rod 0", meaning="Inner diameter"
    )
    weight: float | None = like(
        Pipe, "weight", meaning="Weight per length of its steel in air, in place of the inner diameter"
    )
    shear_modulus: float | None = like(
        Material, "shear_modulus", default=None, source="", confidence="", meaning="Shear modulus; null: the material's"
    )
    young_modulus: float | None = like(
        Material,
        "young_modulus",
        default=None,
        source="",
        confidence="",
        meaning="Young's modulus; null: the material's",
    )
    density: float | None = like(
        Material, "density", default=None, source="", confidence="", meaning="Density; null: the material's"
    )


@dataclass(frozen=True)
class Steel(Checked):
    """A string: its collars, pipe and their steel."""

    collar: Collars = field(default_factory=Collars)
    pipe: Pipe = field(default_factory=Pipe)
    material: Material = field(default_factory=Material)


def sections_from_the_top() -> Any:
    """The field of the sections of a string, which replace the pipe and the length of the
    collars."""
    return records(
        Section,
        None,
        "the sheet of the assembly",
        "high",
        most=MOST_SECTIONS,
        meaning="Sections from the top, in place of pipe and collar lengths; null: pipe and collars",
        required=("outer_diameter",),
    )


class Part(NamedTuple):
    """A section as it is in a string: its length [m], cross-section [m^2], polar moment
    [m^4], density [kg/m^3], Young's and shear modulus [Pa], and outer and inner diameter
    [m]; numbers, or arrays over operating points."""

    length: Numeric
    area: Numeric
    polar: Numeric
    density: Numeric
    young: Numeric
    shear: Numeric
    outer: Numeric
    inner: Numeric


def lateral_in(lengths: Sequence[float | None], span: float) -> int:
    """The place of the section that bends, the lateral collar: the lowest one that is at
    least as long as the ``span`` [m], else the longest. The first may have no length of
    its own."""
    known = [math.inf if length is None else length for length in lengths]
    long_enough = [place for place, length in enumerate(known) if length >= span]
    return long_enough[-1] if long_enough else known.index(max(known))


def collar_material(string: Any) -> Material:
    """The steel of the collar that bends: the string's, with the numbers of its own that
    the section has."""
    steel: Material = string.material
    if string.sections is None:
        return steel
    section = string.sections[lateral_in([one.length for one in string.sections], float(np.max(string.collar.span)))]
    found = copy.copy(steel)  # its numbers may be arrays along an axis
    for item in fields(Material):
        if (own := getattr(section, item.name)) is not None:
            object.__setattr__(found, item.name, own)
    return found


def parts_of(sections: tuple[Section, ...], steel: Material, depth: Numeric) -> list[Part]:
    """The sections of a string from the top to the bit at a ``depth`` [m]. The first one
    reaches to the surface; ValueError where there is no room for it."""
    below = sum(section.length or 0.0 for section in sections[1:])
    if np.any(depth - below <= 0.0):
        raise ValueError(
            f"depth: found {np.min(depth):g} m, allowed: more than the sections below the first, {below:g} m"
        )
    parts = []
    for number, section in enumerate(sections):
        density = steel.density if section.density is None else section.density
        outer, inner = float(section.outer_diameter or 0.0), inner_of(section, density)
        squares = outer * outer, inner * inner
        parts.append(
            Part(
                depth - below if number == 0 else float(section.length or 0.0),
                math.pi / 4 * (squares[0] - squares[1]),
                math.pi / 32 * (squares[0] * squares[0] - squares[1] * squares[1]),
                density,
                steel.young_modulus if section.young_modulus is None else section.young_modulus,
                steel.shear_modulus if section.shear_modulus is None else section.shear_modulus,
                outer,
                inner,
            )
        )
    return parts


def inner_of(section: Section, density: Numeric) -> float:
    """The inner diameter [m] of a section of this ``density`` [kg/m^3]; of one without
    inner diameter and weight 0."""
    if section.weight is not None:
        return bore_of(float(section.outer_diameter or 0.0), section.weight, float(density))
    return section.inner_diameter or 0.0


def lumped(stiffnesses: list[Numeric], inertias: list[Numeric]) -> tuple[Numeric, Numeric]:
    """The stiffness of springs in series, from a held top, and the inertia of one mass at
    their end that has the kinetic energy of their own ``inertias``, spread evenly, in the
    shape in which a load at the end deflects them (Rayleigh). Of pipe and stiff collars
    the inertia is that of the collars and a third of that of the pipe."""
    compliances = [1.0 / stiffness for stiffness in stiffnesses]
    whole = sum(compliances[1:], compliances[0])
    above: Numeric = 0.0
    inertia: Numeric = 0.0
    for compliance, own in zip(compliances, inertias, strict=True):
        below = above + compliance / whole
        inertia = inertia + own * (above * above + above * below + below * below) / 3.0
        above = below
    return 1.0 / whole, inertia


def torsion_of(parts: list[Part]) -> tuple[Numeric, Numeric]:
    """Torsional stiffness [N m/rad] and rotary inertia [kg m^2] of a string of these
    parts, by :func:`lumped`."""
    return lumped(
        [part.shear * part.polar / part.length for part in parts],
        [part.density * part.polar * part.length for part in parts],
    )


def stretch_of(parts: list[Part]) -> tuple[Numeric, Numeric]:
    """Axial stiffness [N/m] and axial mass [kg] of a string of these parts, by
    :func:`lumped`."""
    return lumped(
        [part.young * part.area / part.length for part in parts],
        [part.density * part.area * part.length for part in parts],
    )


TWIST_STIFFNESS = {
    "units": "N m/rad",
    "low": 1e-9,
    "high": 1e12,
    "usual": "100 to 5000 N m/rad; laboratory rigs 0.5 N m/rad",
    "meaning": "Torsional stiffness of the string as measured; null: of its geometry",
}
TWIST_INERTIA = {
    "units": "kg m^2",
    "low": 1e-9,
    "high": 1e9,
    "usual": "100 to 1000 kg m^2; laboratory rigs 0.01 kg m^2",
    "meaning": "Rotary inertia of the string as measured; null: of its geometry",
}


def known_as_a_whole(about: dict[str, Any]) -> Any:
    """A field with a number of the whole string that may be known without geometry."""
    return parameter(None, source="measured", confidence="modelling choice", **about)


@dataclass(frozen=True)
class Fluid(Checked):
    """The drilling fluid."""

    density: float = parameter(
        1500.0, "kg/m^3", "J, L", "high", high=1e5, usual="air 1 kg/m^3, mud 1000 to 2400 kg/m^3"
    )


@dataclass(frozen=True)
class StillMud(Fluid):
    """Mud with the added-mass coefficient C_A, or that of its clearance, and the drag
    coefficient C_D."""

    added_mass: float | str = parameter(
        1.7, "", "J, L", "high", high=1e3, usual="1 to 3, in a narrow annulus 10", words=("clearance",)
    )
    drag: float = parameter(1.0, "", "J, L", "high", high=1e3, usual="0.5 to 2")


@dataclass(frozen=True)
class Friction(Checked):
    """The smoothed Stribeck law f(v) = (2/pi) atan(eps v) [(mu_s - mu_d) / (1 + tau
    |v|) + mu_d], or another ``law`` of the same numbers (:mod:`nsdrill.models.friction`).

    ``smoothing`` is eps and ``decay`` is tau, per unit of the slip speed v: m/s at the
    wall, rad/s at the bit.
    """

    static: float = parameter(0.35, high=10.0, usual="0.1 to 1")
    dynamic: float = parameter(0.30, high=10.0, usual="0.1 to 0.8")
    smoothing: float = parameter(500.0, "s/m", "R", "low", low=1e-3, high=1e9, usual="5 to 100 000 s/m")
    decay: float = parameter(3.0, "s/m", "R (form: Leine 1998)", "low", high=1e6, usual="0 to 20 s/m")
    law: Literal["hyperbolic", "exponential"] = choice("hyperbolic", "R (form: Leine 1998)")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.dynamic > self.static and reads_static(self.law):
            raise ValueError(
                f"dynamic: found {self.dynamic:g}, allowed: at most the static coefficient, {self.static:g}"
            )


@dataclass(frozen=True)
@defaults(
    static=given(0.35, "L", "medium", usual="mud 0.1 to 0.4, dry rock 0.8"),
    dynamic=given(0.30, "R", "low", usual="0.1 to 0.4"),
)
class WallFriction(Friction):
    """Friction between collar and wall, against slip speed in m/s."""


@dataclass(frozen=True)
@defaults(
    static=given(0.5, "R", "low", usual="0.2 to 1"),
    dynamic=given(0.2, "R", "low", usual="0.05 to 0.8"),
    smoothing=given(500.0, "R", "low", units="s/rad", usual="5 to 100 000 s/rad"),
    decay=given(3.0, "R (form: Leine 1998)", "low", units="s/rad", usual="0 to 20 s/rad"),
)
class HyperbolicFriction(Friction):
    """Friction between bit and rock, against bit speed in rad/s."""


TORQUE: dict[str, Any] = {"low": 0.0, "high": 1e9, "usual": "1 to 40 kN m; laboratory rigs 1 N m"}


@dataclass(frozen=True)
class Torques(Checked):
    """Two torques of the whole bit, whatever the force on it: a study gives them as
    ``static`` and ``dynamic`` with a unit of torque."""

    static_torque: float | None = parameter(
        None,
        "N m",
        "measured",
        "modelling choice",
        meaning="Torque at rest, in place of the coefficient; null: that",
        **TORQUE,
    )
    dynamic_torque: float | None = parameter(
        None,
        "N m",
        "measured",
        "modelling choice",
        meaning="Torque at high speed, in place of the coefficient; null: that",
        **TORQUE,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        static, dynamic = self.static_torque, self.dynamic_torque
        if (static is None) != (dynamic is None):
            missing = "static" if static is None else "dynamic"
            raise ValueError(f"{missing}_torque: found none, allowed: both torques, or none")
        if static is not None and dynamic is not None and dynamic > static:
            raise ValueError(
                f"dynamic_torque: found {dynamic:g} N m, allowed: at most the static torque, {static:g} N m"
            )

    @property
    def by_torque(self) -> bool:
        """Whether the friction is given as torques."""
        return self.static_torque is not None


@dataclass(frozen=True)
class TorqueFriction(Torques, HyperbolicFriction):
    """Friction between bit and rock, or between string and hole at the bit, as coefficients
    or as torques."""

    static: float = like(HyperbolicFriction, "static", with_unit="static_torque")
    dynamic: float = like(HyperbolicFriction, "dynamic", with_unit="dynamic_torque")


@dataclass(frozen=True)
class Hole(Checked):
    """The hole."""

    diameter: float = parameter(0.381, "m", "P (15 in)", "certain", low=1e-4, high=10.0, usual="3 3/4 to 36 in")

    def check(self, collar: float) -> None:
        """ValueError where the hole is no wider than the ``collar`` [m]."""
        if collar >= self.diameter:
            raise ValueError(
                f"well.diameter: found {self.diameter:g} m, allowed: above the outer diameter of the collar, "
                f"{collar:g} m"
            )


@dataclass(frozen=True)
class Wall(Hole):
    """The hole and its wall; ``stiffness`` is in N/m for the linear law, in N/m^1.5 for
    the Hertz law."""

    stiffness: float = parameter(
        25e6,
        "N/m or N/m^1.5",
        "CY as reported; L has 1e9, G 6.78e11 N/m^1.5",
        "low: sweep it",
        low=1.0,
        high=1e13,
        usual="1 MN/m to 10 GN/m; Hertz 1 to 1000 GN/m^1.5",
        lane="wall_stiffness",
    )
    law: Literal["linear", "hertz"] = choice("linear", "P; G has Hertz's")
    friction: WallFriction = field(default_factory=WallFriction)


def deepest(stiffness: float, law: str) -> float:
    """The penetration [m] of the collar under the largest force into a wall of this
    stiffness and contact law."""
    return (LARGEST_FORCE / stiffness) ** (2 / 3 if law == "hertz" else 1.0)


@dataclass(frozen=True)
class Cutting(Checked):
    """The cutting torque and the rate of penetration: ROP [m/s] = c1 W[N]
    sqrt(Omega[rad/s]) + c2, 0 if negative."""

    zeta: float = parameter(1.0, "", "B", "high", high=1e3, usual="0 to 2")
    c1: float = parameter(1.35e-8, "", "B", "high", high=1e-3, usual="1e-9 to 1e-7: 1 to 100 m/h")
    c2: float = parameter(-1.9e-4, "", "B", "high", low=-1.0, high=1.0, usual="-1e-3 to 0")


@dataclass(frozen=True)
class Lobes(Checked):
    """The bit on its lobed surface s = s0 sin(n_b phi)."""

    lobes: int = parameter(
        3, "", "B (3 roller cone, 1 PDC); P does not say which", "high", low=1, high=8, usual="1, 3; 5 or 6 blades"
    )
    surface_amplitude: float = parameter(
        1e-3,
        "m",
        "B; with one lobe a judgement",
        "high; with one lobe low",
        high=1.0,
        usual="roller cone 0.3 to 3 mm, PDC 0 to 0.1 mm",
        lane="surface_amplitude",
        follows=Follows("lobes", ((1, 0.0),), 1e-3),
    )
    rock_stiffness: float = parameter(
        25e6,
        "N/m",
        "CY as reported; B has 1.16e9",
        "low: sweep it",
        low=1.0,
        high=1e13,
        usual="1 MN/m to 10 GN/m",
        lane="rock_stiffness",
    )
    cutting: Cutting = field(default_factory=Cutting)


# The meaning, in one line, of each study key that several models have. A model's own
# ``meanings``, or those beside its numbers, take precedence.


MEANINGS: dict[str, str] = {
    "drillstring": "The string",
    "drillstring.collar": "The drill collars",
    "drillstring.collar.outer_diameter": "Outer diameter",
    "drillstring.collar.inner_diameter": "Inner diameter",
    "drillstring.collar.length": "Length of all collars together",
    "drillstring.collar.span": "Free length between stabilisers, which bends",
    "drillstring.pipe": "The drill pipe; its length is the depth less the collars",
    "drillstring.pipe.outer_diameter": "Outer diameter",
    "drillstring.pipe.inner_diameter": "Inner diameter",
    "drillstring.material": "The steel",
    "drillstring.material.density": "Density",
    "drillstring.material.young_modulus": "Young's modulus",
    "drillstring.material.shear_modulus": "Shear modulus",
    "drillstring.eccentricity": "Distance of the collar's mass centre from its axis",
    "drillstring.eccentric_mass": "Eccentric mass: total, with the added mass of the mud, or steel alone",
    "drillstring.lateral_softening": "Load that softens the collar: of each moment, weight on bit, none",
    "drillstring.axial_damping": "Axial damping",
    "drillstring.torsional_damping": "Torsional damping",
    "drillstring.eccentric_weight": "In an inclined hole the weight of the eccentric steel turns the string",
    "mud": "The drilling fluid",
    "mud.density": "Density",
    "mud.added_mass": "Added-mass coefficient, which lowers the lateral frequency; clearance: that of the hole",
    "mud.drag": "Drag coefficient; a larger one damps whirl more",
    "mud.swirl": "Rotation of the mud as a fraction of the rotary speed",
    "well": "The hole and its wall",
    "well.diameter": "Diameter of the hole",
    "well.stiffness": "Contact stiffness of the wall; in N/m^1.5 with the Hertz law",
    "well.law": "Contact law of the wall",
    "well.friction": "Friction between collar and wall over slip speed",
    "well.friction.static": "Coefficient at rest",
    "well.friction.dynamic": "Coefficient at high speed",
    "well.friction.smoothing": "Steepness of the sign change at zero speed; larger is steeper",
    "well.friction.law": "Law of friction at the wall",
    "well.friction.decay": "Rate of the fall from static to dynamic; larger falls sooner",
    "well.inclination": "Angle of the hole from the vertical; the low side is at -y",
    "well.axial_friction": "Friction at wall and stabilisers acts along the hole, too",
    "stabilizer": "The stabilisers at the ends of the span",
    "stabilizer.clearance": "Radial clearance; null: hinges without clearance or friction",
    "stabilizer.friction": "Friction between stabilisers and wall over slip speed, with a clearance",
    "stabilizer.friction.static": "Coefficient at rest",
    "stabilizer.friction.dynamic": "Coefficient at high speed",
    "stabilizer.friction.smoothing": "Steepness of the sign change at zero speed; larger is steeper",
    "stabilizer.friction.law": "Law of friction at the stabilisers",
    "stabilizer.friction.decay": "Rate of the fall from static to dynamic; larger falls sooner",
    "bit": "The bit on its lobed surface",
    "bit.lobes": "Lobes per revolution: 3 for a roller cone, 1 for a PDC bit",
    "bit.surface_amplitude": "Amplitude of the lobed surface",
    "bit.rock_stiffness": "Contact stiffness of the rock",
    "bit.rock": "The rock: lobes on an elastic ground, or the surface that the blades of a drag bit leave",
    "bit.rock.law": "Lobed, or regenerative: each blade cuts what the one before it left",
    "bit.cutting": "Cutting torque and rate of penetration, ROP [m/s] = c1 W[N] sqrt(Omega[rad/s]) + c2",
    "bit.cutting.zeta": "Factor of the cutting torque",
    "bit.cutting.c1": "Slope of the rate of penetration, in SI units",
    "bit.cutting.c2": "Offset of the rate of penetration, in m/s",
    "bit.friction": "Friction between bit and rock over bit speed",
    "bit.friction.static": "Coefficient at rest",
    "bit.friction.dynamic": "Coefficient at high speed",
    "bit.friction.smoothing": "Steepness of the sign change at zero speed; larger is steeper",
    "bit.friction.decay": "Rate of the fall from static to dynamic; larger falls sooner",
    "bit.friction.law": "Law of friction at the bit",
    "bit.friction.dynamic_from": "Bit speed above which friction is dynamic (V0)",
    "bit.friction.b0": "Lever arm of the whole torque, cutting included",
    "bit.friction.b1": "Steepness of the sign change",
    "bit.friction.b2": "Height of the hump",
    "bit.friction.b3": "Place of the hump, v = 1/sqrt(b3)",
    "modes": "Free and frozen motions; a frozen one is constant",
    "modes.axial": "Bit along the hole; frozen: on a surface without lobes, under constant load",
    "modes.torsional": "Twist; frozen: the string rotates with the set speed",
    "modes.lateral": "Collar in the hole; frozen: in the middle",
    "drive": "The drive at the top; each kind reads its own keys",
    "drive.kind": "Kind of drive",
    "drive.inertia": "Inertia of the drive at the string; all kinds but ideal",
    "drive.stiffness": "Integral gain of the speed control (K_i); kind pi",
    "drive.damping": "Proportional gain of the speed control (K_p); kind pi",
    "drive.twist_gain": "Gain on the twist of the string (G_t); kind pi",
    "drive.speed_gain": "Gain on the bit speed (G_w); kind pi",
    "drive.shaft_damping": "Damping along the string between drive and bit; all kinds but ideal",
    "drive.matching": "Proportional gain in impedances of the pipe; kind soft_torque",
    "drive.frequency": "Frequency to which the controller is tuned; null: that of the string; kind soft_torque",
    "drive.compensated_inertia": "Inertia that the controller compensates; kind soft_torque",
    "drive.a": "Softness; larger is softer than a stiff drive; kind z_torque",
    "drive.high_pass": "Time constant of the filter on the torque; kind z_torque",
    "drive.inductance": "Inductance of the armature (L); kind dc_motor",
    "drive.resistance": "Resistance of the armature (R); kind dc_motor",
    "drive.torque_constant": "Torque over current, voltage over speed at the motor (K_m); kind dc_motor",
    "drive.gear": "Gear ratio: revolutions of the motor for one of the table (n); kind dc_motor",
    "drive.table_inertia": "Inertia of the rotary table; kind dc_motor",
    "drive.motor_inertia": "Inertia at the motor's shaft; kind dc_motor",
    "drive.torque_limit": "Torque limit: the motor's torque stays between 0 and this; null: no limits",
    "drive.state_weight": "Weight of the squared states; kind lqr",
    "drive.torque_weight": "Weight of the squared torque; kind lqr",
    "operation": "The operating point; a value may be a ramp, {ramp: [[0 s, VALUE], [60 s, VALUE]]}",
    "operation.depth": "Measured depth",
    "operation.wob": "Weight on bit",
    "operation.rotary_speed": "Rotary speed of the top drive",
    "initial": "The state at the start",
    "initial.x": "Position of the collar's centre in the hole, x",
    "initial.y": "Position of the collar's centre in the hole, y",
    "initial.vx": "Velocity of the collar's centre, x",
    "initial.vy": "Velocity of the collar's centre, y",
    "initial.z": "Bit above its mean cutting surface; null: at rest under the weight on bit",
    "initial.vz": "Axial velocity of the bit",
    "initial.twist": "Twist of the string: angle of the bit less that of the drive",
    "initial.bit_speed": "Bit speed; null: the rotary speed",
    "initial.lag": "Angle of the drive ahead of the set point; null: 0; not of an ideal drive",
    "initial.drive_speed": "Speed of the drive; null: the set speed; not of an ideal drive",
    "initial.drive_angle": "Angle of the top drive",
    "initial.ensemble": "Number of drawn starts of every operating point; 0 or 1: the state given here",
    "initial.seed": "Random seed of the starts",
    "initial.spread": "Scatter of the drawn starts; 1: all that may happen, near 0: about steady drilling",
    "initial.slice": "Grid of starts over two states, each {from, to, points}",
}


# What differs from well to well, in the order of a short study.
SHORT_KEYS = (
    "drillstring.collar.outer_diameter",
    "drillstring.collar.inner_diameter",
    "drillstring.collar.length",
    "drillstring.collar.span",
    "drillstring.collar_length",
    "drillstring.pipe.outer_diameter",
    "drillstring.pipe.inner_diameter",
    "drillstring.outer_diameter",
    "drillstring.inner_diameter",
    "drillstring.torsional_damping",
    "mud.density",
    "mud.added_mass",
    "well.diameter",
    "bit.lobes",
    "bit.rock_stiffness",
    "bit.friction.static",
    "bit.friction.dynamic",
    "operation.depth",
    "operation.wob",
)
# What a short study says in place of the default, which is the paper's for its own hole.
SHORT_VALUES = {"mud.added_mass": "clearance"}
