"""What the equations of the main model read and give: the names of states, lane
parameters and auxiliary outputs, the values of the lane parameters, and the natural
scales that follow from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models import friction
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive, power
from nsdrill.models.christoforou_yigit.drives import Regulator, gains, regulator
from nsdrill.models.christoforou_yigit.lateral import (
    AXIAL_PARAMETERS,
    STABILIZER_PARAMETERS,
    SWIRL_PARAMETERS,
    WEIGHT_PARAMETERS,
    lane_parameters,
)
from nsdrill.models.christoforou_yigit.laws import bit_numbers
from nsdrill.models.christoforou_yigit.options import Options, options_of
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.variables import STATE_NAMES
from nsdrill.models.leaves import lane_values, lanes_of

STATES = STATE_NAMES[:-1]  # of string and bit
# Auxiliary outputs, which the observer reads: cosine and sine of the bit angle, the
# smoothed direction of the bit speed, the factor by which its friction falls, and the
# radius; with implicit friction the slope of the bit's law, and by how much a load
# relaxes its speed.
AUX = ("cosine_now", "sine_now", "direction_now", "decay_now", "radius_now")
SOLVE_AUX = ("slope_now", "bb_now")
PARAMETERS = (
    "set_speed",
    "wob",
    "per_lateral_mass",
    "per_inertia",
    "per_axial_mass",
    "unbalance_arm",
    "bending",
    "softening_force",
    "softening_torque",
    "drag",
    "axial_stiffness",
    "torsional_stiffness",
    "gap",
    "collar_radius",
    *friction.columns_of("wall"),
    *friction.columns_of("bit"),
    "stuck_below",
    *lanes_of(Parameters),
)
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


def values_of(parameters: Parameters, depth: Any, wob: Any, rotary_speed: Any, stuck_below: float) -> dict[str, Any]:
    """The lane parameters at operating points, by name: numbers or arrays, from depth
    [m], wob [N] and rotary_speed [rad/s]."""
    k: Coefficients = derive(parameters, depth, wob, rotary_speed)
    string, well = parameters.drillstring, parameters.well
    span = string.collar.span
    q = k.m_e * string.eccentricity / k.m_l
    force_softening, torque_softening = math.pi**2 / (2 * span), math.pi**3 / (2 * power(span, 2))
    live = string.lateral_softening == "live"
    values: dict[str, Any] = lane_values(parameters) | {
        "set_speed": rotary_speed,
        "wob": wob,
        "per_lateral_mass": 1 / k.m_l,
        "per_inertia": 1 / (k.J + k.m_e * string.eccentricity * (string.eccentricity - q)),
        "per_axial_mass": 1 / k.m_a,
        "unbalance_arm": q,
        "bending": k.k_bend - (force_softening * wob if string.lateral_softening == "static" else 0.0),
        "softening_force": force_softening if live else 0.0,
        "softening_torque": torque_softening if live else 0.0,
        "drag": k.c_h,
        "axial_stiffness": k.k_a,
        "torsional_stiffness": k.k_t,
        "gap": k.gap,
        "collar_radius": k.collar_radius,
        **friction.stribeck(well.friction).columns("wall"),
        **bit_numbers(parameters, k).columns("bit"),
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
    return values | lane_parameters(parameters, k, rotary_speed)


def axial_scale(p: Mapping[str, Array]) -> Array:
    """The natural scale of the bit position [m]: the static penetration of the rock
    under the weight on bit, at least a tenth of the lobe amplitude."""
    contact = p["axial_stiffness"] + p["rock_stiffness"]
    return np.asarray(np.maximum(p["wob"] / contact, np.maximum(0.1 * p["surface_amplitude"], 1e-6)))


def natural_scales(p: Mapping[str, Array], o: Options) -> list[Any]:
    """The natural scale of each state.

    Lateral: a tenth of the gap; axial: :func:`axial_scale`; twist and bit speed: a
    tenth of a radian, a tenth of the drive speed. Velocities: the position's size times the
    frequency of the free mode, bending for the lateral one and in contact for the axial
    one. A drive's lag and speed have the scales of twist and bit speed, the torque of a
    motor that of a twist of that size.
    """
    lateral = 0.1 * p["gap"]
    contact = p["axial_stiffness"] + p["rock_stiffness"]
    axial = axial_scale(p)
    bending_rate, axial_rate = (
        np.sqrt(np.where(per_mass > 0.0, square, 1.0))  # any scale will do for a frozen mode
        for per_mass, square in (
            (p["per_lateral_mass"], np.abs(p["bending"]) * p["per_lateral_mass"]),
            (p["per_axial_mass"], contact * p["per_axial_mass"]),
        )
    )
    across, along = [lateral, lateral * bending_rate], [axial, axial * axial_rate]
    rotating = [0.1, 0.1 * p["set_speed"]]
    scales = [*across, *across, *along, *rotating]
    if o.driven:
        scales += rotating
    if o.motor:
        scales += [IGNORED_SCALE, 0.1 * p["torsional_stiffness"]]
    return scales


def fastest(p: Mapping[str, Array], o: Options) -> Array:
    """The inverse of the shortest natural time [rad/s]."""
    rates = [p["wall_stiffness"] * p["per_lateral_mass"]]
    rates += [(p["axial_stiffness"] + p["rock_stiffness"]) * p["per_axial_mass"], p["set_speed"] ** 2]
    if o.driven:
        per_inertia = p["per_drive_inertia"]
        rates += [p["drive_stiffness"] * per_inertia, (p["drive_damping"] * per_inertia) ** 2]
    if o.motor:
        per_time = p["per_circuit_time"]
        rates += [p["motor_damping"] * per_time * per_inertia, per_time**2]
    if o.regulated:
        lag, drive_speed = p["regulator_lag"], p["regulator_drive_speed"]
        rates += [((1 + p["regulator_torque"]) * per_time) ** 2]
        rates += [np.abs(p["motor_damping"] + drive_speed) * per_time * per_inertia]
        rates += [np.abs(lag * per_time * per_inertia) ** (2 / 3)]
    return np.asarray(np.sqrt(np.max(np.broadcast_arrays(*rates), axis=0)))


# The states of each mode.
_STATES_OF_MODE = {"lateral": STATES[:4], "axial": STATES[4:6], "torsional": STATES[6:8]}


def frozen_states(parameters: Parameters) -> tuple[str, ...]:
    """The names of the states of frozen modes."""
    return tuple(
        name for mode, names in _STATES_OF_MODE.items() if getattr(parameters.modes, mode) == "frozen" for name in names
    )
