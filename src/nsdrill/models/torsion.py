"""A string that only twists: one degree of freedom, friction at the bit that falls with speed. The smallest model.

J omega' = -k_t psi - c_t omega - T(omega), psi' = omega - Omega, with T = W (2/3) r g(omega) [(mu_s - mu_d) / (1 + tau
|omega|) + mu_d] and the smoothed direction g(v) = (2/pi) atan(eps v): Dawson, Lin & Spanos 1987, SPE 16660, with the
friction of Leine et al. 1998 and a rough disc of radius r as the bit. Inertia and stiffness are those of a pipe that
bears a third of its mass at its end, below a drive that turns with the set speed whatever the torque.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from nsdrill.models.christoforou_yigit.parameters import BitFriction, Collar, Material, Pipe
from nsdrill.models.description import Description, Drawn, Order, Panel
from nsdrill.models.leaves import Values
from nsdrill.models.scalar_model import ScalarModel
from nsdrill.models.starts import Starts, state
from nsdrill.observe.channels import Channel, Declaration, Derived, Extremes, Mean, Names, Section, TimeAbove
from nsdrill.observe.thresholds import Thresholds
from nsdrill.ranges import Checked, parameter
from nsdrill.variables import at_section, feature, flag, in_trace, last_peaks


@dataclass(frozen=True)
class Drillstring(Checked):
    """Pipe and collars."""

    collar: Collar = field(default_factory=Collar)
    pipe: Pipe = field(default_factory=Pipe)
    material: Material = field(default_factory=Material)
    torsional_damping: float = parameter(50.0, "N m s/rad", "CY, J as reported", "low", high=1e7, usual="10 to 500")


@dataclass(frozen=True)
class Bit(Checked):
    """A disc that rubs on the rock."""

    radius: float = parameter(0.1905, "m", "P (15 in)", "certain", low=1e-4, high=5.0, meaning="Radius of the bit")
    friction: BitFriction = field(default_factory=BitFriction)


@dataclass(frozen=True)
class Parameters:
    """All that does not change during a sweep."""

    drillstring: Drillstring = field(default_factory=Drillstring)
    bit: Bit = field(default_factory=Bit)


@dataclass(frozen=True)
class Initial(Starts):
    """The state at the start; ``bit_speed`` None is the set speed."""

    twist: float = state(0.0, "rad", 1e5, "-150 to 0 rad: some 20 turns")
    bit_speed: float | None = state(None, "rad/s", 1e4, "-10 to 60 rad/s")
    drive_angle: float = state(0.0, "rad", 1e9, "any")


def inertia_and_stiffness(string: Drillstring, depth: Any) -> tuple[Any, Any]:
    """J [kg m^2] and k_t [N m/rad] at a depth [m]."""
    collar, pipe, steel = string.collar, string.pipe, string.material
    polar = [math.pi / 32 * (ring.outer_diameter**4 - ring.inner_diameter**4) for ring in (collar, pipe)]
    length = depth - collar.length
    inertia = steel.density * (polar[0] * collar.length + polar[1] * length / 3)
    return inertia, steel.shear_modulus * polar[1] / length


NAMES = Names(
    states=("twist", "bit_speed"),
    slopes=("bit_acceleration",),
    parameters=("inertia", "stiffness", "damping", "drive_speed", "torque", "smoothing", "decay", "dynamic", "stuck"),
)
DECLARATION = Declaration(
    channels=(
        Channel("twist", "twist", "bit_speed", "bit_acceleration", frame="drive_speed"),
        Channel("bit speed", "bit_speed", "bit_acceleration", rate_of="twist", level="stuck"),
        Channel("bit angle", lambda twist, drive_speed, time, phase: twist + (phase + drive_speed * time),
                "bit_speed", "bit_acceleration"),
    ),
    features=(
        Extremes("bit speed", greatest="bit_speed_max", least="bit_speed_min", peaks="bit_speed_peaks"),
        Extremes("twist", greatest="twist_max", least="twist_min"),
        TimeAbove("bit speed", "slipping"),
        Mean("bit speed", "bit_speed_mean"),
        Derived("stick_slip_index", lambda bit_speed_max, bit_speed_min, bit_speed_mean: np.divide(
            50.0 * (bit_speed_max - bit_speed_min), bit_speed_mean,
            out=np.full(len(bit_speed_mean), np.inf), where=bit_speed_mean != 0.0)),
        Derived("stuck_fraction", lambda slipping: 1.0 - slipping),
        Derived("surface_torque_min", lambda stiffness, twist_max: -stiffness * twist_max),
        Derived("surface_torque_max", lambda stiffness, twist_min: -stiffness * twist_min),
    ),
    section=Section("bit angle", 2.0 * math.pi),
)  # fmt: skip


class Torsion(ScalarModel):
    """The model: one trajectory's slopes, and what stands in its lane parameters."""

    name = "torsion"
    frames: ClassVar = {"twist": "drive_speed"}
    compared: ClassVar = {"bit_speed_min": "drive_speed", "bit_speed_max": "drive_speed", "bit_speed_mean": "drive_speed",
                "stuck_fraction": None}  # fmt: skip

    def names(self, variant: Any) -> Names:
        return NAMES

    def declaration(self, variant: Any) -> Declaration:
        return DECLARATION

    def slopes(self, variant: Any) -> Any:
        from nsdrill.elementary import direction

        def torsion(t, y, p):  # type: ignore[no-untyped-def]
            twist, speed = y
            inertia, stiffness, damping, _, torque, smoothing, decay, dynamic, _ = p
            law = (1.0 - dynamic) / (1.0 + decay * abs(speed)) + dynamic
            friction = torque * direction(smoothing * speed) * law
            return ((-damping * speed - stiffness * twist - friction) / inertia,)

        return torsion

    def columns(self, points: Values, thresholds: Thresholds) -> Mapping[str, Any]:
        string, bit, (depth, wob, speed) = points.parameters.drillstring, points.parameters.bit, points.operation
        inertia, stiffness = inertia_and_stiffness(string, depth)
        law = bit.friction
        return dict(zip(NAMES.parameters, (
            inertia, stiffness, string.torsional_damping, speed, wob * 2 / 3 * bit.radius * law.static, law.smoothing,
            law.decay, law.dynamic / law.static, thresholds.stuck_below), strict=True))  # fmt: skip

    def natural(self, table: Mapping[str, Any]) -> Any:
        return 0.1, 0.1 * table["drive_speed"]

    def fastest(self, table: Mapping[str, Any]) -> Any:
        return np.maximum(np.sqrt(table["stiffness"] / table["inertia"]), table["drive_speed"])

    def steady(self, points: Values) -> Mapping[str, Any]:
        return {"bit_speed": points.operation[2]}

    def drawn(self, points: Values, shape: Any) -> Mapping[str, Any]:
        """Twists from none to one and a half times that of the torque at rest, bit speeds from 0 to twice that of the
        drive, closer to its speed with a smaller spread."""
        q, table = points.initial.spread, self.columns(points, Thresholds())
        wound = (table["torque"] + table["damping"] * table["drive_speed"]) / table["stiffness"]
        return {"twist": -1.5 * q * wound * shape[:, 0],
                "bit_speed": points.operation[2] * (1 + q * (2 * shape[:, 1] - 1)),
                "drive_angle": 2 * math.pi * shape[:, 2]}  # fmt: skip

    def outputs(self, parameters: Parameters, point: Any, state: Mapping[str, Any]) -> dict[str, Any]:
        law, speed = parameters.bit.friction, state["bit_speed"]
        falling = (law.static - law.dynamic) / (1 + law.decay * abs(speed)) + law.dynamic
        smooth = 2 / math.pi * np.arctan(law.smoothing * speed)
        stiffness = inertia_and_stiffness(parameters.drillstring, point.depth)[1]
        return {"bit_torque": point.wob * 2 / 3 * parameters.bit.radius * falling * smooth,
                "surface_torque": -stiffness * state["twist"]}  # fmt: skip


STATES = ("twist", "bit_speed", "drive_angle")
DESCRIPTION = Description(
    name="torsion",
    title="A string that only twists, with friction at the bit: stick-slip and nothing else",
    parameters=Parameters,
    initial=Initial,
    meanings={"drillstring": "The string", "bit": "The bit, a disc that rubs on the rock"},
    states=lambda parameters: STATES,
    state_sets=(STATES,),
    responses=("stick_slip",),
    check_features=("stick_slip_index",),
    labels=(flag("stick_slip_severity", "severity band of the stick-slip index",
                 "none torsional_oscillation medium onset_of_full_stall severe"),),
    features=(
        feature("bit_speed_min", "rad s-1", "least bit speed"),
        feature("bit_speed_max", "rad s-1", "greatest bit speed"),
        feature("bit_speed_mean", "rad s-1", "mean bit speed"),
        feature("stick_slip_index", "percent", "stick-slip index (max - min) / (2 mean) of bit speed"),
        feature("stuck_fraction", "1", "fraction of time with the bit stuck"),
        feature("surface_torque_min", "N m", "least torque at the surface"),
        feature("surface_torque_max", "N m", "greatest torque at the surface"),
    ),
    peaks=(last_peaks("bit_speed_peaks", "rad s-1", "last local maxima of the bit speed"),),
    section=(at_section("twist", "rad", "twist of the string"), at_section("bit_speed", "rad s-1", "bit speed")),
    own_trace=(
        in_trace("twist", "rad", "twist of the string: bit angle less drive angle"),
        in_trace("bit_speed", "rad s-1", "bit speed"),
        in_trace("drive_angle", "rad", "drive angle at the top"),
        in_trace("bit_torque", "N m", "torque of the rock on the bit"),
        in_trace("surface_torque", "N m", "torque at the surface"),
    ),
    shown=("stick_slip_index", "stuck_fraction", "surface_torque_max"),
    orders=(Order("drillstring.collar.length", "operation.depth", words="the length of the collars"),
            Order("bit.friction.dynamic", "bit.friction.static", True, "lower")),
    example_axis=("bit.friction.static", "0.2", "0.8"),
    example_slice="{twist: {from: -20 rad, to: 0 rad, points: 60}, bit_speed: {from: 0 rad/s, to: 9 rad/s, points: 9}}",
    drawn=Drawn(
        panels=(Panel("torsional", "bit_speed", "bit_speed_peaks", "bit_speed_max"),),
        histories=("twist", "bit_speed", "bit_torque"),
        planes=(("twist", "bit_speed"),),
        section=("section_twist", "section_bit_speed"),
        section_planes=(("section_twist", "section_bit_speed"),),
        summary=("stick_slip_index", "stuck_fraction"),
        attractors=(("bit_speed_min", "bit_speed_max", "Swing of the bit"), (None, "stick_slip_index", "Index")),
    ),
)  # fmt: skip
