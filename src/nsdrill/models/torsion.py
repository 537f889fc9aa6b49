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
from dataclasses import field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Node
from nsdrill.equations.library import friction
from nsdrill.equations.trace import Named
from nsdrill.models import top
from nsdrill.models.christoforou_yigit.parameters import Drive
from nsdrill.models.drive_laws import Seen, impedance_of
from nsdrill.models.drive_rules import DRIVE, DRIVE_RULES
from nsdrill.models.driven import Driven
from nsdrill.models.friction import (
    Numbers,
    columns_of,
    law_number,
    law_numbered,
    numbers_of,
    ordered_at,
    own_columns,
    own_columns_of,
    reads_at,
)
from nsdrill.models.model_description import STICK_ONSET, Description
from nsdrill.models.operation import ModelParameters, Numeric, Operation, Values
from nsdrill.models.registry import known, known_in_trace
from nsdrill.models.responses import Thresholds
from nsdrill.models.rules import Order
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
from nsdrill.models.starts import Starts, state
from nsdrill.models.steady import String
from nsdrill.models.turning import (
    ABOVE,
    CYCLES,
    DRAWN,
    SURFACE_TORQUES,
    SWING,
    TURN,
    TURNING,
    TurningStart,
    turning_channels,
    turning_features,
)
from nsdrill.models.whole_string import TORQUE_ORDER, WHOLE_STRING, without_length
from nsdrill.observe.channels import Declaration, Extremes, Names, moved
from nsdrill.ranges import Checked, like, parameter
from nsdrill.records import dataclass


@dataclass(frozen=True)
class Drillstring(Checked):
    """A steel pipe with an inertia at its end."""

    collar_inertia: float = parameter(
        415.7, "kg m^2", "9 in by 3 in, 200 m", low=1e-6, high=1e7, meaning="Rotary inertia of the collars"
    )
    collar_length: float = parameter(200.0, "m", "J, B", high=1e4, meaning="Length of the collars, which do not twist")
    outer_diameter: float = like(Tubular, "outer_diameter", meaning="Outer diameter of the pipe")
    inner_diameter: float = like(Tubular, "inner_diameter", meaning="Inner diameter of the pipe")
    torsional_damping: float = parameter(50.0, "N m s/rad", "CY, J as reported", high=1e7)
    sections: tuple[Part, ...] | None = sections_from_the_top()
    torsional_stiffness: float | None = known_as_a_whole(TWIST_STIFFNESS)
    rotary_inertia: float | None = known_as_a_whole(TWIST_INERTIA)


@dataclass(frozen=True)
class Bit(Checked):
    """A disc that rubs on the rock."""

    radius: float = parameter(0.1905, "m", "P (15 in)", "certain", low=1e-4, high=5.0, meaning="Radius of the bit")
    friction: TorqueFriction = field(default_factory=TorqueFriction)


@dataclass(frozen=True)
class Initial(Starts):
    """The state at the start; ``bit_speed`` and ``drive_speed`` None are the set speed."""

    twist: float = like(TurningStart, "twist")
    bit_speed: float | None = like(TurningStart, "bit_speed")
    lag: float | None = state(0.0, "rad", 1e5, "-20 to 20 rad; a drive that is not ideal has one")
    drive_speed: float | None = state(None, "rad/s", 1e4, "0 to 30 rad/s; as the lag")
    drive_angle: float = like(TurningStart, "drive_angle")


LAW = reads_at("bit.friction", torques=True)


@dataclass(frozen=True)
class Parameters(ModelParameters):
    """All that does not change during a sweep."""

    point, reads = Operation, (LAW, DRIVE)
    drillstring: Drillstring = field(default_factory=Drillstring)
    bit: Bit = field(default_factory=Bit)
    drive: Drive = field(default_factory=Drive)


STEEL = Material()


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


def impedance(string: Drillstring) -> Numeric:
    """The torsional impedance of the pipe, or of the first section [N m s/rad]."""
    if string.sections is not None:
        first = parts_of(string.sections[:1], STEEL, 1.0)[0]
        return impedance_of(first.polar, first.density, first.shear)
    polar = math.pi / 32 * (string.outer_diameter**4 - string.inner_diameter**4)
    return impedance_of(polar, STEEL.density, STEEL.shear_modulus)


class Options(NamedTuple):
    """Whether friction is implicit, the number of the law of the bit, and those of the drive
    (:func:`nsdrill.models.top.options_of`)."""

    implicit: int = 0
    law: int = 0
    driven: int = 0
    drive: int = 0
    motor: int = 0
    regulated: int = 0


def options_of(parameters: Parameters) -> Options:
    """The options of a string."""
    return Options(law=law_number(parameters.bit.friction.law), **top.options_of(parameters.drive))


def equations(t: Node, phase: Node, s: Named, p: Named, o: Options) -> dict[str, Any]:
    """The slopes of the speeds, and of what else the drive has."""
    law = law_numbered(o.law)
    bit_torque = friction("bit", slip=s.bit_speed, normal=p.torque, law=law, numbers=numbers_of(p, "bit", law))
    pipe_twist = s.twist - s.lag if o.driven else s.twist
    surface_torque = -p.torsional_stiffness * pipe_twist
    turned = -p.damping * s.bit_speed + surface_torque - bit_torque
    slopes: dict[str, Any] = {}
    if o.driven:
        slopes, shaft_torque, drive_torque = top.driven(s, p, o, pipe_twist, surface_torque)  # noqa: RUF059  check reads it
        turned = turned + shaft_torque
    return {**slopes, "bit_speed": turned / p.inertia}


STRING = ("inertia", "torsional_stiffness", "damping", "set_speed", "torque", *columns_of("bit"), "stuck")


@lru_cache
def names_of(o: Options) -> Names:
    """The names of the rows."""
    states = ("twist", "bit_speed", *top.pair_of(o), *top.others_of(o))
    slopes = tuple(f"{name}_rate" for name in moved(states, len(top.others_of(o))))
    return Names(states, slopes, (*STRING, *top.lanes_of(o), *own_columns_of("bit", o.law)))


@lru_cache
def declaration_of(driven: int) -> Declaration:
    """What is observed of a string with a drive that is not ideal or one that is."""
    channels = turning_channels("bit_speed_rate")
    features = (*turning_features(), Extremes("twist", "twist_max", "twist_min"), *SURFACE_TORQUES[:2])
    if driven:
        channels, features = top.observed(channels, features, "drive_speed_rate")
    return Declaration(channels, features, section=TURN)


def of_string(points: Values[Parameters], thresholds: Thresholds) -> dict[str, Numeric]:
    """The lane parameters of string and bit."""
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
        "set_speed": speed,
        "torque": lever * static,
        **Numbers(law.smoothing, law.decay, 1 - share, share).columns("bit"),
        **own_columns("bit", law),
        "stuck": thresholds.stuck_below,
    }


def turning_string(parameters: Parameters, wob: Numeric, table: top.Table) -> String:
    """String and drive in steady drilling, with the lane parameters that ``table`` gives at
    set speeds [rad/s]."""
    o = options_of(parameters)
    return top.steady_string(equations, o, names_of(o), table, {})


def below(parameters: Parameters, depth: Numeric) -> top.Below:
    """The string below the drive, to a depth [m]."""
    seen = Seen(parameters.drive.inertia, *rotating(parameters.drillstring, depth), impedance(parameters.drillstring))
    return top.Below(parameters, depth, seen, of_string, turning_string, {"inertia": 1.0})


class Torsion(Driven[Parameters]):
    """The model: its equations and lane parameters."""

    name, equations = "torsion", staticmethod(equations)
    options, options_of, names = Options, staticmethod(options_of), staticmethod(names_of)
    widest = Options(driven=1)

    def declaration(self, o: Options) -> Declaration:
        return declaration_of(o.driven)

    def columns(self, points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
        depth, wob, speed = points.operation
        return {**below(points.parameters, depth).columns(wob, speed), **of_string(points, thresholds)}

    def natural_scales(self, table: Mapping[str, Array], o: Options) -> Sequence[Numeric]:
        turning: list[Numeric] = [0.1, 0.1 * table["set_speed"]]
        return [*turning * (1 + o.driven), *top.scales(table, o)]

    def fastest(self, table: Mapping[str, Array], o: Options) -> Array:
        found = np.maximum(np.sqrt(table["torsional_stiffness"] / table["inertia"]), table["set_speed"])
        return np.asarray(np.max([found, *map(np.sqrt, top.fastest(table, o))], axis=0)) if o.driven else found

    def hanging(self, points: Values[Parameters]) -> float | None:
        """Without weight, unless friction is given as torques, which stay."""
        return None if points.parameters.bit.friction.static_torque is not None else 0.0

    def drawn(self, points: Values[Parameters], shape: Array) -> Mapping[str, Numeric]:
        """Twists up to one and a half times the one under the torque at rest, bit
        speeds up to twice that of the drive."""
        q, table = points.initial.spread, self.columns(points, Thresholds())
        twist = (table["torque"] + table["damping"] * table["set_speed"]) / table["torsional_stiffness"]
        return {
            "twist": -1.5 * q * twist * shape[:, 0],
            "drive_angle": 2 * math.pi * shape[:, 2],
            "bit_speed": points.operation[2] * (1 + q * (2 * shape[:, 1] - 1)),
        }


DESCRIPTION = Description(
    name="torsion",
    title="A string that only twists, with friction at the bit: stick-slip and nothing else",
    parameters=Parameters,
    initial=Initial,
    states=lambda parameters: (*names_of(options_of(parameters)).states, "drive_angle"),
    states_allowed=lambda found: top.have_states(found, lambda o: names_of(o).states, [Options()]),
    meanings={"drillstring": "The string: a pipe with an inertia at its end", "bit": "A disc that rubs on the rock"},
    responses=("stick_slip",),
    grazing=(STICK_ONSET,),
    features=known(*TURNING, *CYCLES, *(name for name in ABOVE if name != "surface_torque_mean")),
    peaks=known("bit_speed_peaks"),
    section=known("section_twist", "section_bit_speed"),
    own_trace=known_in_trace(
        *("twist", "bit_speed", "lag", "motor_torque", "drive_angle", "bit_torque", "surface_torque")
    ),
    shown=(*TURNING[3:], "stick_slip_period", "surface_torque_max"),
    compared=SWING,
    distinguishing=TURNING,
    orders=(
        Order("drillstring.inner_diameter", "drillstring.outer_diameter", blamed="lower"),
        Order("drillstring.collar_length", "operation.depth", words="the length of the collars", unless=without_length),
        ordered_at("bit.friction"),
        TORQUE_ORDER,
    ),
    rules=(*WHOLE_STRING, *DRIVE_RULES, LAW),
    example_axis=("bit.friction.static", "0.2", "0.8"),
    example_slice="{twist: {from: -20 rad, to: 0 rad, points: 60}, bit_speed: {from: 0 rad/s, to: 9 rad/s, points: 9}}",
    drawn=DRAWN,
    checks="nsdrill.models.torsion_checks",
)
