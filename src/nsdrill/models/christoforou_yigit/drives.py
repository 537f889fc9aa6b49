"""The drives of the main model: the law of the controller
(:mod:`nsdrill.models.drive_laws`) for this string, the linear-quadratic regulator, and the
circuit of a DC motor.

The top has two states, lag = phi_d - Omega t and its speed omega_d. With the twist psi,
measured from the set point, and the torque of the pipe T_p:

    lag'       = omega_d - Omega
    J omega_d' = -K_i lag - K_p (omega_d - Omega)
                 - G_t (psi - lag) - G_w (omega - Omega) - T_p
    T_p        = k_t (lag - psi) + c_s (omega_d - omega)

An ideal drive has no states: lag is zero and omega_d is Omega.

A **DC motor** (:mod:`nsdrill.models.motor`) has the states motor_torque and, as states come
in pairs, motor_impulse, the integral of that torque (n K times the charge), on which
nothing depends.
"""

from __future__ import annotations

import math

from nsdrill.models import motor
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, power
from nsdrill.models.christoforou_yigit.columns import values_of_string
from nsdrill.models.christoforou_yigit.parameters import Drive, Parameters
from nsdrill.models.christoforou_yigit.twist import that_only_turns, turning_string
from nsdrill.models.drilling import Drilling
from nsdrill.models.drive_laws import LAW_LANES, LAWS, Circuit, Gains, Seen, about_steady, impedance_of, linear_drive
from nsdrill.models.motor import Regulator
from nsdrill.models.operation import Numeric
from nsdrill.models.own_drives import Linear, own_drive
from nsdrill.models.sections import parts_of
from nsdrill.models.tree import lane_values, with_values


def impedance(parameters: Parameters) -> Numeric:
    """The torsional impedance of the pipe, or of the first section, Ip sqrt(rho G) [N m
    s/rad]. A drive of this impedance reflects no wave from below."""
    pipe, steel = parameters.drillstring.pipe, parameters.drillstring.material
    if (sections := parameters.drillstring.sections) is not None:
        first = parts_of(sections[:1], steel, 1.0)[0]
        return impedance_of(first.polar, first.density, first.shear)
    polar = math.pi / 32 * (power(pipe.outer_diameter, 4) - power(pipe.inner_diameter, 4))
    return impedance_of(polar, steel.density, steel.shear_modulus)


def circuit_of(parameters: Parameters, k: Coefficients) -> Circuit | None:
    """The circuit of a DC motor, with its gains if it has any; None for other
    drives."""
    if not parameters.drive.electric:
        return None
    return motor.circuit(parameters.drive, regulator(parameters, k, 0.0, 1.0))  # at any speed


def linear_of(parameters: Parameters, k: Coefficients, drilling: Drilling) -> tuple[Gains, Circuit | Linear | None]:
    """The law of a drive that is not ideal about steady drilling, and what its circuit or
    its states add."""
    law = gains(parameters, k, drilling.set_speed)
    linear = linear_drive(parameters.drive, drilling.string.states(drilling.at), lane_values(parameters))
    return (law, circuit_of(parameters, k)) if linear is None else (about_steady(law, linear), linear)


def regulator(parameters: Parameters, k: Coefficients, wob: Numeric, rotary_speed: Numeric) -> Regulator:
    """The law of the voltage of a DC motor with gains, at a weight on bit [N] and a
    rotary speed [rad/s]."""
    alone = with_values(that_only_turns(parameters), {"drive.kind": "ideal"})
    string = turning_string(
        alone, wob, lambda speed: values_of_string(alone, k, wob, speed, 0.0) | {"per_inertia": 1.0}
    )
    return motor.regulator(parameters.drive, string, rotary_speed)


def gains(parameters: Parameters, k: Coefficients, rotary_speed: Numeric = 0.0) -> Gains:
    """The law of a drive that is not ideal, at operating points with the coefficients
    ``k``; that of an LQR is tuned to the string at this rotary speed [rad/s].
    InputError where an LQR has no gains."""
    drive = parameters.drive
    if drive.kind == "lqr":
        law = _lqr(drive, parameters, k, rotary_speed)
    elif drive.electric:
        law = Gains(drive.top_inertia, 0.0, 0.0)  # no controller; the torque is a state
    elif own_drive(drive.kind) is not None:
        law = Gains(drive.inertia, 0.0, 0.0)  # its torque is not linear
    else:
        law = LAWS[drive.kind].gains(drive, Seen(drive.inertia, k.J, k.k_t, impedance(parameters)))
    return law._replace(shaft_damping=drive.shaft_damping)


def _lqr(drive: Drive, parameters: Parameters, k: Coefficients, rotary_speed: Numeric) -> Gains:
    """The gains of the regulator: the drive of its string has no torque, and nothing rubs at
    the bit, which bears no weight."""
    free = with_values(that_only_turns(parameters), {"drive.kind": "pi"})
    without = dict.fromkeys(LAW_LANES, 0.0)
    without |= {"per_drive_inertia": 1.0 / drive.inertia, "shaft_damping": drive.shaft_damping}
    string = turning_string(free, 0.0, lambda speed: values_of_string(free, k, 0.0, speed, 0.0) | without)
    return motor.optimal(drive, k.J, k.k_t, string, rotary_speed)
