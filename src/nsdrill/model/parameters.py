"""The parameters of the drill string, in SI units, with a source and an honest word on the confidence of each default.

Sources: **P** the nonsmooth-system paper whose figures are reproduced; **CY** Christoforou & Yigit 2003, J. Sound Vib.
267:1029-1045, and the authors' related papers as reported by others; **B** Sarker, Rideout & Butt, ICBGM 2012; **J**
Jansen 1991 and Jansen & van den Steen 1995; **L** a public lateral-torsional code of COPPE/UFRJ; **R** reconstructed
here. P prints five numbers and refers to CY for the others, so its figures can be reproduced in kind, not to the digit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Literal


def parameter(
    default: Any,
    units: str,
    source: str,
    confidence: str,
    low: float = 0.0,
    strict: bool = True,
    high: float = math.inf,
) -> Any:
    """A field with its units, source and confidence, and the range in which the model has a meaning.

    ``strict`` excludes ``low`` itself.
    """
    return field(
        default=default,
        metadata={
            "units": units, "source": source, "confidence": confidence, "low": low, "strict": strict, "high": high,
        },
    )


def _choice(default: str, source: str) -> Any:
    return field(default=default, metadata={"units": "", "source": source, "confidence": "modelling choice"})


class _Checked:
    """Refuses values outside the range in which the model has a meaning (``ValueError``)."""

    def __post_init__(self) -> None:
        for item in fields(self):  # type: ignore[arg-type]
            meta = item.metadata
            value = getattr(self, item.name)
            if "low" not in meta:
                continue
            if not math.isfinite(value):
                raise ValueError(f"{item.name}: found {value}, allowed: a finite number")
            if value < meta["low"] or (meta["strict"] and value == meta["low"]) or value > meta["high"]:
                bound = ("above " if meta["strict"] else "at least ") + f"{meta['low']:g}"
                if meta["high"] < math.inf:
                    bound += f" and at most {meta['high']:g}"
                raise ValueError(f"{item.name}: found {value:g}, allowed: {bound} {meta['units']}".rstrip())


@dataclass(frozen=True)
class Collar(_Checked):
    """The drill collars; ``span`` is the length between stabilisers that bends."""

    outer_diameter: float = parameter(0.2286, "m", "J, B", "medium")
    inner_diameter: float = parameter(0.0762, "m", "J, B", "medium", strict=False)
    length: float = parameter(200.0, "m", "J, B", "medium")
    span: float = parameter(19.81, "m", "J, B (65 ft, rounded as printed)", "medium")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.inner_diameter >= self.outer_diameter:
            raise ValueError(
                f"inner_diameter: found {self.inner_diameter:g} m, allowed: below the outer diameter, "
                f"{self.outer_diameter:g} m"
            )
        if self.span > self.length:
            raise ValueError(f"span: found {self.span:g} m, allowed: at most the collar length, {self.length:g} m")


@dataclass(frozen=True)
class Pipe(_Checked):
    """The drill pipe; its length is the depth less the collar length."""

    outer_diameter: float = parameter(0.127, "m", "J by arithmetic", "medium")
    inner_diameter: float = parameter(0.1086, "m", "J by arithmetic", "medium", strict=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.inner_diameter >= self.outer_diameter:
            raise ValueError(
                f"inner_diameter: found {self.inner_diameter:g} m, allowed: below the outer diameter, "
                f"{self.outer_diameter:g} m"
            )


@dataclass(frozen=True)
class Material(_Checked):
    """The steel of the string."""

    density: float = parameter(7850.0, "kg/m^3", "standard", "high")
    young_modulus: float = parameter(210e9, "Pa", "standard", "high")
    shear_modulus: float = parameter(79.6e9, "Pa", "standard", "high")


@dataclass(frozen=True)
class Drillstring(_Checked):
    """The string: geometry, steel, damping and the modelling choices that concern it."""

    collar: Collar = field(default_factory=Collar)
    pipe: Pipe = field(default_factory=Pipe)
    material: Material = field(default_factory=Material)
    eccentricity: float = parameter(
        0.0127, "m", "CY as reported (1/2 in); P prints 0.7 m, wider than the hole", "medium", strict=False
    )
    eccentric_mass: Literal["total", "steel"] = _choice("total", "P; 'steel' leaves the fluid added mass out")
    lateral_softening: Literal["live", "static", "none"] = _choice("live", "CY")
    axial_damping: float = parameter(4000.0, "N s/m", "CY, J as reported", "low", strict=False)
    torsional_damping: float = parameter(50.0, "N m s/rad", "CY, J as reported", "low", strict=False)


@dataclass(frozen=True)
class Mud(_Checked):
    """The drilling fluid: density, added-mass coefficient C_A and drag coefficient C_D."""

    density: float = parameter(1500.0, "kg/m^3", "J, L", "high", strict=False)
    added_mass: float = parameter(1.7, "", "J, L", "high", strict=False)
    drag: float = parameter(1.0, "", "J, L", "high", strict=False)


@dataclass(frozen=True)
class Friction(_Checked):
    """The smoothed Stribeck law f(v) = (2/pi) atan(eps v) [(mu_s - mu_d) / (1 + tau |v|) + mu_d].

    ``smoothing`` is eps and ``decay`` is tau, per unit of the slip speed v: m/s at the wall, rad/s at the bit.
    """

    static: float = parameter(0.35, "", "", "", strict=False)
    dynamic: float = parameter(0.30, "", "", "", strict=False)
    smoothing: float = parameter(500.0, "s/m", "R", "low")
    decay: float = parameter(3.0, "s/m", "R (form: Leine 1998)", "low", strict=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.dynamic > self.static:
            raise ValueError(
                f"dynamic: found {self.dynamic:g}, allowed: at most the static coefficient, {self.static:g}"
            )


@dataclass(frozen=True)
class WallFriction(Friction):
    """Friction between collar and wall, against slip speed in m/s."""

    static: float = parameter(0.35, "", "L", "medium", strict=False)
    dynamic: float = parameter(0.30, "", "R", "low", strict=False)


@dataclass(frozen=True)
class BitFriction(Friction):
    """Friction between bit and rock, against bit speed in rad/s."""

    static: float = parameter(0.5, "", "R", "low", strict=False)
    dynamic: float = parameter(0.2, "", "R", "low", strict=False)
    smoothing: float = parameter(500.0, "s/rad", "R", "low")
    decay: float = parameter(3.0, "s/rad", "R (form: Leine 1998)", "low", strict=False)


@dataclass(frozen=True)
class Well(_Checked):
    """The hole and its wall; ``stiffness`` is in N/m for the linear law, in N/m^1.5 for the Hertz law."""

    diameter: float = parameter(0.381, "m", "P (15 in)", "certain")
    stiffness: float = parameter(25e6, "N/m or N/m^1.5", "CY as reported; L has 1e9", "low: sweep it")
    law: Literal["linear", "hertz"] = _choice("linear", "P")
    friction: WallFriction = field(default_factory=WallFriction)


@dataclass(frozen=True)
class Cutting(_Checked):
    """The cutting torque and the rate of penetration: ROP [m/s] = c1 W[N] sqrt(Omega[rad/s]) + c2, 0 if negative."""

    zeta: float = parameter(1.0, "", "B", "high", strict=False)
    c1: float = parameter(1.35e-8, "", "B", "high", strict=False)
    c2: float = parameter(-1.9e-4, "", "B", "high", low=-math.inf, strict=False)


@dataclass(frozen=True)
class Bit(_Checked):
    """The bit on its lobed surface s = s0 sin(n_b phi)."""

    lobes: int = parameter(3, "", "B (3 roller cone, 1 PDC); P does not say which", "high", low=1, strict=False, high=8)
    surface_amplitude: float = parameter(1e-3, "m", "B", "high", strict=False)
    rock_stiffness: float = parameter(25e6, "N/m", "CY as reported; B has 1.16e9", "low: sweep it")
    cutting: Cutting = field(default_factory=Cutting)
    friction: BitFriction = field(default_factory=BitFriction)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lobes != int(self.lobes):
            raise ValueError(f"lobes: found {self.lobes}, allowed: a whole number from 1 to 8")


@dataclass(frozen=True)
class Parameters:
    """All that does not change during a sweep."""

    drillstring: Drillstring = field(default_factory=Drillstring)
    mud: Mud = field(default_factory=Mud)
    well: Well = field(default_factory=Well)
    bit: Bit = field(default_factory=Bit)

    def __post_init__(self) -> None:
        collar = self.drillstring.collar.outer_diameter
        if collar >= self.well.diameter:
            raise ValueError(
                f"well.diameter: found {self.well.diameter:g} m, allowed: above the outer diameter of the collar, "
                f"{collar:g} m"
            )


@dataclass(frozen=True)
class Operation(_Checked):
    """The operating point."""

    depth: float = parameter(5000.0, "m", "P", "certain")
    wob: float = parameter(22.24e3, "N", "P (5 klbf)", "certain", strict=False)
    rotary_speed: float = parameter(3.0, "rad/s", "P", "certain")


@dataclass(frozen=True)
class Initial:
    """The state at the start. ``None`` stands for the natural value: ``z`` for the static position under the weight on
    bit, ``bit_speed`` for the top-drive speed.

    With an ``ensemble`` of two or more every operating point is started from so many states, drawn as
    :mod:`nsdrill.model.ensemble` says; with a ``slice``, {state: {from, to, points}} of two states in SI, from all
    pairs of their values, the other states as given.
    """

    x: float = 1e-3
    y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    z: float | None = None
    vz: float = 0.0
    twist: float = 0.0
    bit_speed: float | None = None
    drive_angle: float = 0.0
    ensemble: int = 0
    seed: int = 0
    spread: float = 1.0
    slice: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def starts(self) -> int:
        """How many states each operating point is started from, where there are several; else 0."""
        if self.slice:
            return math.prod(int(axis["points"]) for axis in self.slice.values())
        return self.ensemble if self.ensemble > 1 else 0


def describe(record: Any, visit: Callable[[str, Any, Any], None], prefix: str = "") -> None:
    """Calls ``visit(dotted_name, value, metadata)`` for each leaf of a tree of parameter dataclasses."""
    for item in fields(record):
        value = getattr(record, item.name)
        name = f"{prefix}{item.name}"
        if is_dataclass(value):
            describe(value, visit, f"{name}.")
        else:
            visit(name, value, item.metadata)
