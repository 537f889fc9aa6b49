"""A string that only twists: one degree of freedom, friction at the bit that falls with
speed. The smallest model::

    J omega' = -k_t psi - c_t omega - T(omega),   psi' = omega - Omega
    T = W (2/3) r g(omega) [(mu_s - mu_d) / (1 + tau |omega|) + mu_d]

with the smoothed direction g(v) = (2/pi) atan(eps v): Dawson, Lin & Spanos 1987, SPE
16660, with the friction of Leine et al. 1998 under a disc of radius r. J is the inertia
of the collars and a third of that of the pipe, or that of all sections by the same rule
(:func:`nsdrill.models.sections.lumped`). Static and dynamic friction may be torques, whatever
the weight W.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Node
from nsdrill.equations.library import friction
from nsdrill.equations.trace import Named
from nsdrill.models import waves
from nsdrill.models.aggressive import OF_ANY_KIND, aggressive, found_at, operated
from nsdrill.models.base import Model
from nsdrill.models.description import STICK_ONSET, Description, Order
from nsdrill.models.drilling import Drilling, Limits, begins_above_onset, folds, limits
from nsdrill.models.friction import Numbers, law_number, law_numbered, numbers_of
from nsdrill.models.numbers import DerivedQuantity, FormatValue
from nsdrill.models.operation import ModelParameters, Numeric, Operation, Values
from nsdrill.models.registry import known, known_in_trace, model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.sections import (
    TWIST_INERTIA,
    TWIST_STIFFNESS,
    Material,
    TorqueFriction,
    Tubular,
    known_as_a_whole,
    parts_of,
    sections_from_the_top,
    torsion_of,
)
from nsdrill.models.sections import Section as Part
from nsdrill.models.steady import String, Turning
from nsdrill.models.turning import (
    CYCLES,
    DRAWN,
    SURFACE_TORQUES,
    TURNING,
    TurningStart,
    turning_channels,
    turning_features,
)
from nsdrill.models.variant import variant_at
from nsdrill.models.whole_string import TORQUE_ORDER, whole_string, without_length
from nsdrill.observe.channels import Declaration, Extremes, Section
from nsdrill.ranges import Checked, computed, like, meanings_of, parameter


@dataclass(frozen=True)
class Drillstring(Checked):
    """A steel pipe with an inertia at its end."""

    collar_inertia: float = parameter(
        415.7, "kg m^2", "9 in by 3 in, 200 m", low=1e-6, high=1e7, meaning="Rotary inertia of the collars"
    )
    collar_length: float = parameter(200.0, "m", "J, B", high=1e4, meaning="Length of the collars, which do not twist")
    outer_diameter: float = like(Tubular, "outer_diameter", meaning="Outer diameter of the pipe")
    inner_diameter: float = like(Tubular, "inner_diameter", meaning="Inner diameter of the pipe")
    torsional_damping: float = parameter(50.0, "N m s/rad", "CY, J as reported", high=1e7, meaning="Torsional damping")
    sections: tuple[Part, ...] | None = sections_from_the_top()
    torsional_stiffness: float | None = known_as_a_whole(TWIST_STIFFNESS)
    rotary_inertia: float | None = known_as_a_whole(TWIST_INERTIA)


@dataclass(frozen=True)
class Bit(Checked):
    """A disc that rubs on the rock."""

    radius: float = parameter(0.1905, "m", "P (15 in)", "certain", low=1e-4, high=5.0, meaning="Radius of the bit")
    friction: TorqueFriction = field(default_factory=TorqueFriction)


@dataclass(frozen=True)
class Parameters(ModelParameters):
    """All that does not change during a sweep."""

    point = Operation
    drillstring: Drillstring = field(default_factory=Drillstring)
    bit: Bit = field(default_factory=Bit)


STEEL = Material()
WAVES = 4  # standing waves that are listed


def rotating(string: Drillstring, depth: Numeric) -> tuple[Numeric, Numeric]:
    """Rotary inertia [kg m^2] and torsional stiffness [N m/rad] of a string to a depth [m]:
    as they are given, else of its sections, else of pipe and collars."""
    inertia, stiffness = string.rotary_inertia, string.torsional_stiffness
    if inertia is not None and stiffness is not None:
        return inertia, stiffness
    if string.sections is not None:
        whole, lumped = torsion_of(parts_of(string.sections, STEEL, depth))
    else:
        length = depth - string.collar_length
        polar = math.pi / 32 * (string.outer_diameter**4 - string.inner_diameter**4)
        lumped = string.collar_inertia + STEEL.density * polar * length / 3
        whole = STEEL.shear_modulus * polar / length
    return lumped if inertia is None else inertia, whole if stiffness is None else stiffness


class Options(NamedTuple):
    """Whether friction is implicit, and the number of the law of the bit."""

    implicit: int = 0
    law: int = 0


def equations(t: Node, phase: Node, s: Named, p: Named, o: Options) -> dict[str, Node]:
    """The slope of the bit speed."""
    law = law_numbered(o.law)
    bit_torque = friction("bit", slip=s.bit_speed, normal=p.torque, law=law, numbers=numbers_of(p, "bit"))
    surface_torque = -p.torsional_stiffness * s.twist
    return {"bit_speed": (-p.damping * s.bit_speed + surface_torque - bit_torque) / p.inertia}


class Torsion(Model[Parameters]):
    """The model: its equations and lane parameters."""

    name, equations = "torsion", staticmethod(equations)
    declared = Declaration(
        turning_channels(
            "drive_speed",
            "stuck",
            lambda twist, drive_speed, time, phase: twist + (phase + drive_speed * time),
            "bit_speed_rate",
        ),
        (*turning_features("drive_speed"), Extremes("twist", "twist_max", "twist_min"), *SURFACE_TORQUES[:2]),
        section=Section("bit angle", 2.0 * math.pi),
    )
    relative = ("twist",)
    options = Options

    def options_of(self, parameters: Parameters) -> Options:
        return Options(law=law_number(parameters.bit.friction.law))

    def columns(self, points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
        string, bit, (depth, wob, speed) = points.parameters.drillstring, points.parameters.bit, points.operation
        law, (inertia, stiffness) = bit.friction, rotating(string, depth)
        static, dynamic, lever = law.static, law.dynamic, wob * 2 / 3 * bit.radius
        if law.static_torque is not None and law.dynamic_torque is not None:
            static, dynamic, lever = law.static_torque, law.dynamic_torque, 1.0
        share = dynamic / static
        return {
            "inertia": inertia,
            "torsional_stiffness": stiffness,
            "damping": string.torsional_damping,
            "drive_speed": speed,
            "torque": lever * static,
            **Numbers(law.smoothing, law.decay, 1 - share, share).columns("bit"),
            "stuck": thresholds.stuck_below,
        }

    def fastest(self, table: Mapping[str, Array], o: Options) -> Array:
        return np.maximum(np.sqrt(table["torsional_stiffness"] / table["inertia"]), table["drive_speed"])

    def drawn(self, points: Values[Parameters], shape: Array) -> Mapping[str, Numeric]:
        """Twists up to one and a half times the one under the torque at rest, bit
        speeds up to twice that of the drive."""
        q, table = points.initial.spread, self.columns(points, Thresholds())
        twist = (table["torque"] + table["damping"] * table["drive_speed"]) / table["torsional_stiffness"]
        return {
            "twist": -1.5 * q * twist * shape[:, 0],
            "drive_angle": 2 * math.pi * shape[:, 2],
            "bit_speed": points.operation[2] * (1 + q * (2 * shape[:, 1] - 1)),
        }


# What `check` shows of it.


@dataclass(frozen=True)
class Coefficients:
    """The lumped string."""

    J: float = computed("kg m^2", "rotary inertia")
    k_t: float = computed("N m/rad", "torsional stiffness of the string")


COEFFICIENTS = meanings_of(Coefficients)


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """The coefficients at an operating point."""
    return Coefficients(*map(float, rotating(parameters.drillstring, operation.depth)))


def drilling_at(parameters: Parameters, operation: Operation) -> Drilling:
    """Steady drilling at an operating point."""
    model, depth, wob, speed = model_named("torsion"), operation.depth, operation.wob, operation.rotary_speed

    def table(set_speed: Numeric) -> Mapping[str, Numeric]:
        return model.columns(Values(parameters, TurningStart(), (depth, wob, set_speed)), Thresholds())

    motion, turning = variant_at(model, parameters).motion, Turning(("twist",), ("bit_speed",))
    string = String(motion, turning, model.set_speed, table, {})
    inertia, stiffness = (float(table(speed)[name]) for name in ("inertia", "torsional_stiffness"))
    return Drilling(string, speed, wob, 2 * float(parameters.bit.radius), math.sqrt(stiffness / inertia), stiffness)


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point."""
    drilling, string = drilling_at(parameters, operation), parameters.drillstring
    ratio = 0.5 * string.torsional_damping * drilling.frequency / drilling.stiffness
    return {
        "torsional": DerivedQuantity(drilling.frequency, "rad/s", "torsional frequency"),
        "torsional_damping": DerivedQuantity(ratio, "1", "damping ratio of the torsional mode below a held top"),
        **drilling.quantities(),
        **_waves(string, operation.depth),
    }


def _waves(string: Drillstring, depth: float) -> dict[str, DerivedQuantity]:
    """The standing waves of a string of sections."""
    if string.sections is None or string.torsional_stiffness is not None or string.rotary_inertia is not None:
        return {}
    found = waves.standing(waves.torsional(parts_of(string.sections, STEEL, depth)), 0.0, WAVES)
    return {
        f"torsional_wave_{number}": DerivedQuantity(float(value), "rad/s", f"standing torsional wave, mode {number}")
        for number, value in enumerate(found, start=1)
    }


def warnings(study: Any, corners: list[Values], format_value: FormatValue) -> list[str | None]:
    """The warning of a bit whose torque is unusual; None where it is not."""
    found = [found_at(OF_ANY_KIND, corner.parameters, corner.point, drilling_at) for corner in corners]
    here = found_at(OF_ANY_KIND, *operated(study, corners), drilling_at)
    return [aggressive(here, found, format_value)]


def longest_period(corners: list[Values]) -> float:
    """The longest torsional period [s] of these corners, the values at the ends of all
    axes and ramps of a study."""
    return max(drilling_at(corner.parameters, corner.point).period for corner in corners)


def lasting_motions(study: Any, corners: list[Values]) -> list[dict[str, Any]]:
    """The onset of stick-slip where a sweep begins above it."""
    return begins_above_onset(study, drilling_at)


def stick_slip_folds(settings: Sequence[Values]) -> list[float | None]:
    """The set speeds [rad/s] below which stick-slip, once begun, lasts, of many settings
    together; None where it does not, infinite where it lasts at every speed."""
    return folds([drilling_at(values.parameters, values.point) for values in settings])


def stick_slip_lasts(settings: Sequence[Values]) -> list[Limits]:
    """The set speeds [rad/s] below which steady drilling is unstable to stick-slip, and up
    to which stick-slip, once begun, may last, of many settings together; 0 where it is not
    and does not."""
    return limits([drilling_at(values.parameters, values.point) for values in settings])


DESCRIPTION = Description(
    name="torsion",
    title="A string that only twists, with friction at the bit: stick-slip and nothing else",
    parameters=Parameters,
    initial=TurningStart,
    meanings={"drillstring": "The string: a pipe with an inertia at its end", "bit": "A disc that rubs on the rock"},
    responses=("stick_slip",),
    grazing=(STICK_ONSET,),
    features=known(*TURNING, *CYCLES, "surface_torque_min", "surface_torque_max"),
    peaks=known("bit_speed_peaks"),
    section=known("section_twist", "section_bit_speed"),
    own_trace=known_in_trace(*TurningStart.states(), "bit_torque", "surface_torque"),
    shown=(*TURNING[3:], "stick_slip_period", "surface_torque_max"),
    compared={**dict.fromkeys(TURNING[:3], "drive_speed"), "stuck_fraction": None},
    distinguishing=TURNING,
    orders=(
        Order("drillstring.inner_diameter", "drillstring.outer_diameter", blamed="lower"),
        Order("drillstring.collar_length", "operation.depth", words="the length of the collars", unless=without_length),
        Order("bit.friction.dynamic", "bit.friction.static", True, "lower"),
        TORQUE_ORDER,
    ),
    constraints=whole_string,
    example_axis=("bit.friction.static", "0.2", "0.8"),
    example_slice="{twist: {from: -20 rad, to: 0 rad, points: 60}, bit_speed: {from: 0 rad/s, to: 9 rad/s, points: 9}}",
    drawn=DRAWN,
    checks="nsdrill.models.torsion",
)
