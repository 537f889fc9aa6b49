"""The right-hand side of the 4-DOF equations of motion, for all lanes at once.

Derived from the Lagrangian of the coupled system (theory page of the documentation), as
the printed equations of the paper have sign and index errors. States: x, vx, y, vy, z,
vz, twist, bit_speed, all SI.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import Rows
from nsdrill.equations.contacts import Law
from nsdrill.equations.derivative import Tangents
from nsdrill.equations.graph import Node
from nsdrill.equations.motion import Motion
from nsdrill.equations.stage import Stage
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive, power
from nsdrill.models.christoforou_yigit.drives import Regulator, gains, regulator
from nsdrill.models.christoforou_yigit.equations import motion
from nsdrill.models.christoforou_yigit.lateral import (
    AXIAL_PARAMETERS,
    STABILIZER_PARAMETERS,
    SWIRL_PARAMETERS,
    WEIGHT_PARAMETERS,
    lane_parameters,
)
from nsdrill.models.christoforou_yigit.laws import bit_numbers
from nsdrill.models.christoforou_yigit.options import Options, options_of
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters

STATES = ("x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed")
# Auxiliary outputs, which the observer reads: cosine and sine of the bit angle, the
# smoothed direction of the bit speed, the factor by which its friction falls, and the
# radius; with implicit friction the slope of the bit's law, and by how much a load
# relaxes its speed.
AUX = ("cosine", "sine", "direction", "decay", "radius")
SOLVE_AUX = ("slope", "bb")
PARAMETERS = (
    "drive_speed",
    "wob",
    "per_lateral_mass",
    "per_inertia",
    "per_axial_mass",
    "unbalance_arm",
    "bending",
    "softening_force",
    "softening_torque",
    "drag",
    "axial_damping",
    "axial_stiffness",
    "torsional_damping",
    "torsional_stiffness",
    "gap",
    "wall_stiffness",
    "collar_radius",
    "wall_smoothing",
    "wall_decay",
    "wall_rise",
    "wall_dynamic",
    "rock_stiffness",
    "surface_amplitude",
    "bit_smoothing",
    "bit_decay",
    "bit_rise",
    "bit_dynamic",
    "stuck_below",
)
INDEX = {name: i for i, name in enumerate(PARAMETERS)}
# Further states and parameters of a drive that is not ideal.
DRIVE_STATES = ("lag", "drive_speed")
DRIVE_PARAMETERS = (
    "per_drive_inertia",
    "drive_stiffness",
    "drive_damping",
    "twist_gain",
    "speed_gain",
    "shaft_damping",
)


# Further states and parameters of a DC motor.
MOTOR_STATES = ("motor_impulse", "motor_torque")
MOTOR_PARAMETERS = ("motor_damping", "per_circuit_time")
# The law of the motor's voltage, where it has gains.
REGULATOR_PARAMETERS = tuple(f"regulator_{name}" for name in Regulator._fields)
SIDES = ("rock", "wall")  # the contacts whose functions are followed
# Bit masks of the slopes in which friction acts: those of vx, vy and the bit speed;
# with friction along the axis that of vz as well.
PUSHED, PUSHED_ALONG = 0b1011, 0b1111
IGNORED_SCALE = 1e30  # the scale of a state that does not affect the step size


def states_of(options: Options) -> tuple[str, ...]:
    """The names of the states."""
    drive = (*DRIVE_STATES, *MOTOR_STATES) if options.motor else DRIVE_STATES
    return (*STATES, *drive) if options.driven else STATES


def columns_of(options: Options) -> tuple[str, ...]:
    """The names of the lane parameters."""
    drive = (*DRIVE_PARAMETERS, "torque_limit") if options.limited else DRIVE_PARAMETERS
    drive = (*drive, *MOTOR_PARAMETERS) if options.motor else drive
    drive = (*drive, *REGULATOR_PARAMETERS) if options.regulated else drive
    return (
        *PARAMETERS,
        *(drive if options.driven else ()),
        *(SWIRL_PARAMETERS if options.swirl else ()),
        *(STABILIZER_PARAMETERS if options.stabilizer else ()),
        *(WEIGHT_PARAMETERS if options.weight else ()),
        *(AXIAL_PARAMETERS if options.axial_friction else ()),
    )


def aux_of(options: Options) -> tuple[str, ...]:
    """The names of the auxiliary outputs."""
    return (*AUX, *SOLVE_AUX) if options.implicit else AUX


def pushed_of(options: Options) -> tuple[str, ...]:
    """The velocities in whose slopes friction acts."""
    return ("vx", "vy", "vz", "bit_speed") if options.axial_friction else ("vx", "vy", "bit_speed")


def rows_of(options: Options, observed: int = 0, *, tangent: bool = False, columns: int | None = None) -> Rows:
    """The lane buffer for an observer with so many ``observed`` rows, with a deviation
    beside the states if ``tangent``, and with so many ``columns`` of parameters where
    there are more than those of the model."""
    states = len(states_of(options))
    tangent_states = states if tangent else 0
    width = len(columns_of(options)) if columns is None else columns
    implicit = (PUSHED_ALONG if options.axial_friction else PUSHED) if options.implicit else 0
    aux = len(aux_of(options))
    return Rows(states + tangent_states, aux, width, observed, tangent_states, implicit=implicit)


MAIN = Options()


def _bit_aux(stage: Stage, slips: Mapping[int, Node], steps: Mapping[int, Node]) -> dict[str, Node]:
    """What the observer reads of the bit: the factors of its law on the last tangent of
    Newton's method, as the load is, the slope of the law, and by how much a load
    relaxes the bit speed."""
    contact, omega = stage.contacts[0], slips[0]
    assert isinstance(contact.law, Law)
    direction, decay = contact.law.factors(omega, contact.numbers)
    factors = {"direction": direction, "decay": decay}
    rates = Tangents(stage.graph, {omega: 1.0})
    changes = rates.of(factors | {"slope": contact.law(omega, contact.numbers)})
    return {
        **{name: node + changes[name] * steps[0] for name, node in factors.items()},
        "slope": changes["slope"],
        "bb": stage.relaxed[0, 0] * stage.normal[0],
    }


@lru_cache
def motion_of(options: Options) -> Motion:
    """The equations with these options."""
    states = states_of(options)
    return Motion(
        motion,
        options,
        states,
        columns_of(options),
        states[1::2],
        aux_of(options),
        pushed_of(options) if options.implicit else (),
        SIDES,
        _bit_aux if options.implicit else None,
    )


@lru_cache
def make_right_hand_side(lanes: int, options: Options = MAIN, *, tangent: bool = False) -> Any:
    """The compiled right-hand side for a number of lanes and these options; with
    ``tangent`` for a buffer with a deviation, which it does not change."""
    return motion_of(options).right_hand_side(lanes, rows_of(options, tangent=tangent))


@lru_cache
def make_tangent(lanes: int, options: Options, place: int) -> Any:
    """The compiled right-hand side of the motion and of one deviation from it
    (:meth:`nsdrill.equations.motion.Motion.tangent`)."""
    return motion_of(options).tangent(lanes, rows_of(options, tangent=True), place)


@lru_cache
def make_contacts(lanes: int, options: Options, place: int) -> Any:
    """The compiled functions of rock and wall
    (:meth:`nsdrill.equations.motion.Motion.contact_functions`)."""
    return motion_of(options).contact_functions(lanes, rows_of(options, tangent=True), place)


def pack(parameters: Parameters, depth: Any, wob: Any, rotary_speed: Any, stuck_below: float = 0.0) -> np.ndarray:
    """Lane parameters of operating points, shape (points, columns), from 1-D arrays
    depth [m], wob [N] and rotary_speed [rad/s] of one length."""
    depth, wob, rotary_speed = _broadcast(depth, wob, rotary_speed)
    k: Coefficients = derive(parameters, depth, wob, rotary_speed)
    string, well, bit = parameters.drillstring, parameters.well, parameters.bit
    span = string.collar.span
    q = k.m_e * string.eccentricity / k.m_l
    force_softening, torque_softening = math.pi**2 / (2 * span), math.pi**3 / (2 * power(span, 2))
    live = string.lateral_softening == "live"
    values: dict[str, Any] = {
        "drive_speed": rotary_speed,
        "wob": wob,
        "per_lateral_mass": 1 / k.m_l,
        "per_inertia": 1 / (k.J + k.m_e * string.eccentricity * (string.eccentricity - q)),
        "per_axial_mass": 1 / k.m_a,
        "unbalance_arm": q,
        "bending": k.k_bend - (force_softening * wob if string.lateral_softening == "static" else 0.0),
        "softening_force": force_softening if live else 0.0,
        "softening_torque": torque_softening if live else 0.0,
        "drag": k.c_h,
        "axial_damping": string.axial_damping,
        "axial_stiffness": k.k_a,
        "torsional_damping": string.torsional_damping,
        "torsional_stiffness": k.k_t,
        "gap": k.gap,
        "wall_stiffness": well.stiffness,
        "collar_radius": k.collar_radius,
        "wall_smoothing": well.friction.smoothing,
        "wall_decay": well.friction.decay,
        "wall_rise": well.friction.static - well.friction.dynamic,
        "wall_dynamic": well.friction.dynamic,
        "rock_stiffness": bit.rock_stiffness,
        "surface_amplitude": bit.surface_amplitude,
        **bit_numbers(parameters, k)._asdict(),
        "stuck_below": stuck_below,
    }
    modes = parameters.modes
    # Zero reciprocals of mass and inertia freeze a mode.
    if modes.axial == "frozen":
        values |= {"per_axial_mass": 0.0, "surface_amplitude": 0.0}
    if modes.lateral == "frozen":
        values |= {"per_lateral_mass": 0.0, "unbalance_arm": 0.0, "per_inertia": 1 / k.J}
    if modes.torsional == "frozen":
        values["per_inertia"] = 0.0
    options = options_of(parameters)
    if options.driven:
        inertia, *law = gains(parameters, k)
        values |= dict(zip(DRIVE_PARAMETERS, (1 / inertia, *law), strict=True))
        drive = parameters.drive
        values |= {
            "torque_limit": drive.torque_limit,
            "motor_damping": drive.motor_damping,
            "per_circuit_time": 1 / drive.circuit_time,
        }
        if options.regulated:
            law_of_voltage = regulator(parameters, k, wob, rotary_speed)
            values |= dict(zip(REGULATOR_PARAMETERS, law_of_voltage, strict=True))
    values |= lane_parameters(parameters, k, rotary_speed)
    names = columns_of(options)
    if missing := set(names) - set(values):
        raise TypeError(f"pack: found no value of the lane parameters {', '.join(sorted(missing))}")
    table = np.zeros((depth.size, len(names)))
    for i, name in enumerate(names):
        table[:, i] = values[name]
    return table


def _broadcast(*values: Any) -> list[np.ndarray]:
    return list(np.broadcast_arrays(*(np.atleast_1d(value).astype(float) for value in values)))


def state_scales(table: np.ndarray, options: Options = MAIN) -> np.ndarray:
    """Natural scales of each state at operating points, (points, states): the absolute
    tolerance is rtol times this.

    Lateral: a tenth of the gap; axial: the static penetration of the rock under the
    weight on bit, at least a tenth of the lobe amplitude; twist and bit speed: a tenth
    of a radian, a tenth of the drive speed. Velocities: the position's size times the
    frequency of the free mode, bending for the lateral one and in contact for the axial
    one. A drive's lag and speed have the scales of twist and bit speed, the torque of a
    motor that of a twist of that size.
    """
    p = {name: table[:, i] for name, i in INDEX.items()}
    lateral = 0.1 * p["gap"]
    contact = p["axial_stiffness"] + p["rock_stiffness"]
    axial = np.maximum(p["wob"] / contact, np.maximum(0.1 * p["surface_amplitude"], 1e-6))
    bending_rate, axial_rate = (
        np.sqrt(np.where(per_mass > 0.0, square, 1.0))  # any scale will do for a frozen mode
        for per_mass, square in (
            (p["per_lateral_mass"], np.abs(p["bending"]) * p["per_lateral_mass"]),
            (p["per_axial_mass"], contact * p["per_axial_mass"]),
        )
    )
    columns: tuple[np.ndarray, ...] = (
        lateral,
        lateral * bending_rate,
        lateral,
        lateral * bending_rate,
        axial,
        axial * axial_rate,
        np.full(len(table), 0.1),
        0.1 * p["drive_speed"],
    )
    if options.driven:
        columns = (*columns, *columns[-2:])
    if options.motor:
        columns = (*columns, np.full(len(table), IGNORED_SCALE), 0.1 * p["torsional_stiffness"])
    return np.stack(columns, axis=1)


def frame_rates(table: np.ndarray, options: Options = MAIN) -> np.ndarray:
    """The difference of each position's rate and its velocity, shape (points, slopes):
    twist and lag are measured from the set point, which rotates."""
    frame_rate = np.zeros((len(table), len(states_of(options)) // 2))
    frame_rate[:, 3:5] = -table[:, [INDEX["drive_speed"]]]
    return frame_rate


def phase_rate(table: np.ndarray) -> np.ndarray:
    """The rate of the phase, which is the drive's angle [rad/s], shape (points,)."""
    return table[:, INDEX["drive_speed"]]


def first_step(table: np.ndarray, options: Options = MAIN) -> np.ndarray:
    """A first step size [s] for each operating point: a hundredth of the shortest
    natural time, shape (points,)."""
    p = {name: table[:, i] for name, i in INDEX.items()}
    squared_rate = np.maximum(
        p["wall_stiffness"] * p["per_lateral_mass"], (p["axial_stiffness"] + p["rock_stiffness"]) * p["per_axial_mass"]
    )
    if options.driven:
        per_inertia, stiffness, damping = table[:, len(PARAMETERS) : len(PARAMETERS) + 3].T
        squared_rate = np.maximum(squared_rate, np.maximum(stiffness * per_inertia, (damping * per_inertia) ** 2))
    if options.motor:
        motor_damping, per_time = table[:, len(PARAMETERS) + len(DRIVE_PARAMETERS) :][:, :2].T
        squared_rate = np.maximum(squared_rate, np.maximum(motor_damping * per_time * per_inertia, per_time**2))
    if options.regulated:
        names = columns_of(options)
        torque, lag, drive_speed = (
            table[:, names.index(f"regulator_{name}")] for name in ("torque", "lag", "drive_speed")
        )
        squared_motor_rate = np.maximum(
            ((1 + torque) * per_time) ** 2, np.abs(motor_damping + drive_speed) * per_time * per_inertia
        )
        squared_rate = np.maximum(
            squared_rate, np.maximum(squared_motor_rate, np.abs(lag * per_time * per_inertia) ** (2 / 3))
        )
    return 0.01 / np.sqrt(np.maximum(squared_rate, p["drive_speed"] ** 2))


def initial_states(parameters: Parameters, initial: Initial, depth: Any, wob: Any, rotary_speed: Any) -> np.ndarray:
    """Initial states with the drive angle last, shape (points, states + 1)."""
    depth, wob, rotary_speed = _broadcast(depth, wob, rotary_speed)
    k = derive(parameters, depth, wob, rotary_speed)
    options = options_of(parameters)
    states = np.zeros((depth.size, len(states_of(options)) + 1))
    z = -wob / (k.k_a + parameters.bit.rock_stiffness) if initial.z is None else initial.z
    bit_speed = rotary_speed if initial.bit_speed is None else initial.bit_speed
    values = [initial.x, initial.vx, initial.y, initial.vy, z, initial.vz, initial.twist, bit_speed]
    if options.driven:
        values += [initial.lag, rotary_speed if initial.drive_speed is None else initial.drive_speed]
    values += [0.0] * (2 * options.motor)
    for i, value in enumerate((*values, initial.drive_angle)):
        states[:, i] = value
    return with_frozen_modes(parameters, states, wob, rotary_speed)


# The states of each mode.
_STATES_OF_MODE = {"lateral": STATES[:4], "axial": STATES[4:6], "torsional": STATES[6:8]}


def frozen_states(parameters: Parameters) -> tuple[str, ...]:
    """The names of the states of frozen modes."""
    return tuple(
        name for mode, names in _STATES_OF_MODE.items() if getattr(parameters.modes, mode) == "frozen" for name in names
    )


def with_frozen_modes(
    parameters: Parameters, states: np.ndarray, wob: np.ndarray, rotary_speed: np.ndarray
) -> np.ndarray:
    """``states`` (points, states + 1), in which the values of frozen modes replace the
    initial ones, in place."""
    modes = parameters.modes
    if modes.lateral == "frozen":
        states[:, :4] = 0.0
    # the bit carries the whole weight; the pipe's spring carries none
    if modes.axial == "frozen":
        states[:, 4], states[:, 5] = -wob / parameters.bit.rock_stiffness, 0.0
    if modes.torsional == "frozen":
        states[:, 6], states[:, 7] = 0.0, rotary_speed
    return states
