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

from dataclasses import dataclass, field
from typing import Literal

from nsdrill.models.operation import LARGEST_FORCE
from nsdrill.ranges import Checked, choice, defaults, given, parameter

WIDEST_BORE = 0.999  # of the outer diameter, so that the wall has some thickness


def check_bore(inner: float, outer: float) -> None:
    """ValueError for a bore [m] that leaves the tube no wall."""
    if inner > WIDEST_BORE * outer:
        raise ValueError(
            f"inner_diameter: found {inner:g} m, allowed: at most {WIDEST_BORE:g} times the outer diameter, {outer:g} m"
        )


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
    """The drill pipe; its length is the depth less the collar length."""


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


@dataclass(frozen=True)
class Steel(Checked):
    """A string: its collars, pipe and their steel."""

    collar: Collars = field(default_factory=Collars)
    pipe: Pipe = field(default_factory=Pipe)
    material: Material = field(default_factory=Material)


@dataclass(frozen=True)
class Fluid(Checked):
    """The drilling fluid."""

    density: float = parameter(
        1500.0, "kg/m^3", "J, L", "high", high=1e5, usual="air 1 kg/m^3, mud 1000 to 2400 kg/m^3"
    )


@dataclass(frozen=True)
class StillMud(Fluid):
    """Mud with the added-mass coefficient C_A and the drag coefficient C_D."""

    added_mass: float = parameter(1.7, "", "J, L", "high", high=1e3, usual="1 to 3, in a narrow annulus 10")
    drag: float = parameter(1.0, "", "J, L", "high", high=1e3, usual="0.5 to 2")


@dataclass(frozen=True)
class Friction(Checked):
    """The smoothed Stribeck law f(v) = (2/pi) atan(eps v) [(mu_s - mu_d) / (1 + tau
    |v|) + mu_d].

    ``smoothing`` is eps and ``decay`` is tau, per unit of the slip speed v: m/s at the
    wall, rad/s at the bit.
    """

    static: float = parameter(0.35, high=10.0, usual="0.1 to 1")
    dynamic: float = parameter(0.30, high=10.0, usual="0.1 to 0.8")
    smoothing: float = parameter(500.0, "s/m", "R", "low", low=1e-3, high=1e9, usual="5 to 100 000 s/m")
    decay: float = parameter(3.0, "s/m", "R (form: Leine 1998)", "low", high=1e6, usual="0 to 20 s/m")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.dynamic > self.static:
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
    surface_amplitude: float = parameter(1e-3, "m", "B", "high", high=1.0, usual="0.1 to 10 mm")
    rock_stiffness: float = parameter(
        25e6, "N/m", "CY as reported; B has 1.16e9", "low: sweep it", low=1.0, high=1e13, usual="1 MN/m to 10 GN/m"
    )
    cutting: Cutting = field(default_factory=Cutting)
