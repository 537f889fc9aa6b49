"""The drive at the top of a string of one rotary inertia, for every such model: what it adds
to the equations, their options, states and lane parameters, and what is observed of it.

With lag = phi_d - Omega t, the speed w_d of the drive, its torque T_m
(:mod:`nsdrill.models.drive_laws`), that of the string T_p and the damping c_s of the shaft::

    lag'   = w_d - Omega
    J w_d' = T_m - T_p - c_s (w_d - w)

An ideal drive has no states: lag is zero and w_d is Omega. The torque is that of a
controller, of a script (:mod:`nsdrill.models.own_drives`), or of a DC motor, a state
(:mod:`nsdrill.models.motor`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Number
from nsdrill.equations.motion import Motion
from nsdrill.equations.plain import followed
from nsdrill.equations.trace import Named, part
from nsdrill.models import motor
from nsdrill.models.drilling import Drilling
from nsdrill.models.drive_laws import (
    LAW_LANES,
    LAWS,
    UNLIMITED,
    Circuit,
    Gains,
    Seen,
    about_steady,
    columns_of_law,
    linear_drive,
    quantities_of_drive,
    reflection,
)
from nsdrill.models.motor import MOTOR_LANES, REGULATOR_LANES
from nsdrill.models.numbers import DerivedQuantity
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.own_drives import number_of, numbered, own_drive, rows_of
from nsdrill.models.responses import Thresholds
from nsdrill.models.starts import Starts
from nsdrill.models.steady import String, Turning
from nsdrill.models.tree import lane_values, with_values
from nsdrill.observe.channels import Channel, Extremes, Feature, Mean, Names
from nsdrill.records import dataclass

LANES = (*LAW_LANES, "torque_least", "torque_most")
MODES = 2  # of string and drive among the derived quantities

Table: TypeAlias = Callable[[Numeric], Mapping[str, Numeric]]  # lane parameters at set speeds [rad/s]


# What is compiled in: ``o`` is a NamedTuple with ``driven``, ``drive``, ``motor`` and
# ``regulated`` among its names.


def options_of(drive: Any) -> dict[str, int]:
    """Whether a ``drive`` is not ideal, the number of one of a script, whether it is a DC
    motor, whose torque is a state, and whether its voltage has gains on the motion."""
    return {
        "driven": int(not drive.ideal),
        "drive": number_of(drive.kind),
        "motor": int(drive.electric),
        "regulated": int(drive.regulated),
    }


def pair_of(o: Any) -> tuple[str, ...]:
    """The names of its angle and speed; none of an ideal drive."""
    return ("lag", "drive_speed") if o.driven else ()


def others_of(o: Any) -> tuple[str, ...]:
    """The names of its states of first order."""
    return ("motor_torque",) if o.motor else rows_of(o.drive)


def lanes_of(o: Any) -> tuple[str, ...]:
    """The names of its lane parameters."""
    lanes = (*(LANES if o.driven else ()), *(MOTOR_LANES if o.motor else ()))
    lanes += REGULATOR_LANES if o.regulated else ()
    return (*lanes, *(numbered(o.drive).lanes if o.drive else ()))


def have_states(found: tuple[str, ...], states_of: Callable[[Any], tuple[str, ...]], options: Iterable[Any]) -> bool:
    """Whether these are the states of a string with some of these ``options`` and a drive of
    nsdrill, the angle of the drive last."""
    drives: tuple[dict[str, int], ...] = {}, {"driven": 1}, {"driven": 1, "motor": 1}
    return any(found == (*states_of(one._replace(**drive)), "drive_angle") for one in options for drive in drives)


def turning(o: Any) -> Turning:
    """The states that turn, of drive and bit."""
    if not o.driven:
        return Turning(("twist",), ("bit_speed",))
    return Turning(("lag", "twist"), ("drive_speed", "bit_speed"), others_of(o))


def steady_string(
    equations: Callable[..., Any], o: Any, names: Names, table: Table, rest: Mapping[str, Numeric]
) -> String:
    """String and drive in steady drilling, with the lane parameters that ``table`` gives at set
    speeds [rad/s], and with the states that do not turn at ``rest``."""
    motion = Motion(equations, o, names.states, names.parameters, names.moved)
    return String(motion, turning(o), "set_speed", table, rest)


@part
def driven(
    s: Named, p: Named, o: Any, pipe_twist: Number, surface_torque: Number
) -> tuple[dict[str, Number], Number, Number]:
    """(the slopes of the states of a drive that is not ideal, the torque of the shaft on the
    bit, and that of the motor [N m])."""
    slopes: dict[str, Number] = {}
    shaft_torque = p.shaft_damping * (s.drive_speed - s.bit_speed)
    if o.motor:
        torque = s.motor_torque
        slopes["motor_torque"] = motor.torque_rate(s, p, o.regulated)
    elif o.drive:
        torque, of_drive = numbered(o.drive).law(s, p)
        slopes |= of_drive
    else:
        law = p.drive_stiffness * s.lag + p.drive_damping * (s.drive_speed - p.set_speed)
        law = law + p.twist_gain * pipe_twist + p.speed_gain * (s.bit_speed - p.set_speed)
        torque = -law
    drive_torque = min(max(torque, p.torque_least), p.torque_most)
    slopes["drive_speed"] = (drive_torque - surface_torque - shaft_torque) * p.per_drive_inertia
    return slopes, shaft_torque, drive_torque


# Natural scales and rates


def scales(table: Mapping[str, Array], o: Any) -> list[Numeric]:
    """The natural scales of its states of first order, those of a tenth of a radian of
    twist."""
    torque = 0.1 * table["torsional_stiffness"]
    return numbered(o.drive).scales(table, torque) if o.drive else [torque] if o.motor else []


def fastest(table: Mapping[str, Array], o: Any) -> list[Array]:
    """The squares of its rates [1/s^2]."""
    rates: list[Array] = []
    if o.driven:
        rates += [table["drive_stiffness"] * table["per_drive_inertia"]]
        rates += [(table["drive_damping"] * table["per_drive_inertia"]) ** 2]
    if o.drive:
        rates += [np.square(numbered(o.drive).fastest(table))]
    if o.motor:
        rates += motor.fastest(table, o.regulated)
    return rates


def start_of(drive: Any) -> dict[str, Numeric]:
    """The states of first order at the start, and those that the string may lack."""
    own = own_drive(drive.kind)
    return {"motor_torque": 0.0, **(own.start if own is not None else {})}


# The law of the drive


@dataclass(frozen=True)
class Below:
    """The string below the drive of ``parameters``, to a ``depth`` [m]: what a controller is
    tuned to, ``of_string``, its lane parameters without those of the drive, and
    ``turning_string``, which gives it and its drive in steady drilling from parameters, the
    weight on bit [N] and a table. ``unit`` are lane parameters with which its inertia is 1."""

    parameters: Any
    depth: Numeric
    seen: Seen
    of_string: Callable[[Values, Thresholds], Mapping[str, Numeric]]
    turning_string: Callable[[Any, Numeric, Table], String]
    unit: Mapping[str, Numeric]

    @property
    def drive(self) -> Any:
        return self.parameters.drive

    def _string(self, kind: str, wob: Numeric, given: Mapping[str, Numeric]) -> String:
        """The string with a drive of another kind under a weight on bit [N], with the ``given``
        lane parameters in place of its own."""
        one = with_values(self.parameters, {"drive.kind": kind})

        def table(speed: Numeric) -> Mapping[str, Numeric]:
            return {**self.of_string(Values(one, Starts(), (self.depth, wob, speed)), Thresholds()), **given}

        return self.turning_string(one, wob, table)

    def law(self, speed: Numeric = 0.0) -> Gains:
        """The law of a drive that is not ideal; that of an LQR is tuned to the string at this
        rotary speed [rad/s]. InputError where an LQR has no gains."""
        drive = self.drive
        if drive.kind == "lqr":
            law = self._regulated(speed)
        elif drive.kind in LAWS:
            law = LAWS[drive.kind].gains(drive, self.seen)
        else:
            law = Gains(drive.top_inertia, 0.0, 0.0)  # the torque is a state, or that of a script
        return law._replace(shaft_damping=drive.shaft_damping)

    def _regulated(self, speed: Numeric) -> Gains:
        """The gains of the regulator: the drive of its string has no torque, and nothing rubs
        at the bit, which bears no weight."""
        without = Gains(self.drive.inertia, 0.0, 0.0, shaft_damping=self.drive.shaft_damping)
        free = self._string("pi", 0.0, _columns_of(without, None))
        return motor.optimal(self.drive, self.seen.inertia, self.seen.stiffness, free, speed)

    def regulator(self, wob: Numeric, speed: Numeric) -> motor.Regulator:
        """The law of the voltage of a DC motor with gains, at a weight on bit [N] and a
        rotary speed [rad/s]."""
        return motor.regulator(self.drive, self._string("ideal", wob, self.unit), speed)

    def circuit(self) -> Circuit | None:
        """The circuit of a DC motor, with its gains if it has any; None for other drives."""
        if not self.drive.electric:
            return None
        return motor.circuit(self.drive, self.regulator(0.0, 1.0))  # at any speed

    def columns(self, wob: Numeric, speed: Numeric) -> dict[str, Numeric]:
        """The lane parameters of the drive, by name, those that the parameters give as they
        are first; none of an ideal one."""
        drive = self.drive
        if drive.ideal:
            return {}
        values = _columns_of(self.law(speed), drive.torque_limit if drive.limited else None)
        if drive.electric:
            values |= motor.motor_columns(drive)
        if drive.regulated:
            values |= motor.regulator_columns(self.regulator(wob, speed))
        return {**lane_values(self.parameters), **values}

    def quantities(self, drilling: Drilling, speed: float) -> dict[str, DerivedQuantity]:
        """What ``check`` says of a drive, in steady ``drilling``; nothing of an ideal one."""
        if self.drive.ideal:
            return {}
        drive, law = self.drive, self.law(speed)
        linear = linear_drive(drive, drilling.string.states(drilling.at), lane_values(self.parameters))
        law = law if linear is None else about_steady(law, linear)
        reflected = reflection(
            law, float(self.seen.impedance), drilling.frequency, self.circuit() if linear is None else linear
        )
        by_torque = None if drive.electric else law
        return quantities_of_drive(
            drive, drilling.matrix, drilling.torque, reflected, by_torque, MODES, bends=drilling.bends
        )


def _columns_of(law: Gains, limit: Numeric | None) -> dict[str, Numeric]:
    """The lane parameters of a drive with this law and limit [N m]."""
    inertia = {"per_drive_inertia": 1.0 / law.inertia, "shaft_damping": law.shaft_damping}
    return {**inertia, **columns_of_law(law, limit)}


def unlimited(table: Mapping[str, Numeric]) -> Mapping[str, Numeric]:
    """The lane parameters with a motor without limits, as that of steady drilling is: about
    no twist, where equations are differentiated, one with a limit gives no torque."""
    limits = {"torque_least": -UNLIMITED, "torque_most": UNLIMITED}
    return {name: limits.get(name, value) for name, value in table.items()}


def limit_of(drive: Any) -> float | None:
    """The limit of its torque [N m], None without one."""
    return float(drive.torque_limit) if drive.limited and drive.torque_limit is not None else None


# What is observed


def observed(
    channels: tuple[Channel, ...], features: tuple[Feature, ...], slope: str
) -> tuple[tuple[Channel, ...], tuple[Feature, ...]]:
    """Channels and features of a string with those of a drive that is not ideal, whose speed
    has this ``slope``: the twist is that of the pipe."""
    pipe = Channel(
        "pipe twist",
        *followed(lambda n: n.twist - n.lag, lambda n: {"twist": n.bit_speed, "lag": n.drive_speed}),
        scale=0.1,
    )
    below = tuple(
        replace(one, channel="pipe twist") if isinstance(one, Extremes | Mean) and one.channel == "twist" else one
        for one in features
    )
    return (
        (*channels, pipe, Channel("drive speed", "drive_speed", slope)),
        (
            *below,
            Extremes("drive speed", "drive_speed_max", "drive_speed_min", compared=None),
            Mean("drive speed", "drive_speed_mean"),
        ),
    )
