"""The drives of the main model: the law of the controller
(:mod:`nsdrill.models.drives`) for this string, the linear-quadratic regulator, and the
circuit of a DC motor.

The top has two states, lag = phi_d - Omega t and its speed omega_d. With the twist psi,
measured from the set point, and the torque of the pipe T_p:

    lag'       = omega_d - Omega
    J omega_d' = -K_i lag - K_p (omega_d - Omega)
                 - G_t (psi - lag) - G_w (omega - Omega) - T_p
    T_p        = k_t (lag - psi) + c_s (omega_d - omega)

An ideal drive has no states: lag is zero and omega_d is Omega.

A **DC motor** has the torque T_m = n K i, with the current i of its armature, the gear
ratio n and the constant K of the motor, at the constant voltage at which it idles with
the set speed, n K Omega:

    L i' + R i = n K (Omega - omega_d)
    J omega_d' = T_m - T_p

The first equation is (L/R) T_m' = (n K)^2/R (Omega - omega_d) - T_m in terms of the
torque.

With ``gains`` the voltage follows the motion, so that steady drilling is at the set
speed:

    V = n K Omega + R I* - [K_I (i - I*) + K_1 lag + K_2 (omega_d - Omega)
                            + K_3 (psi - psi*) + K_4 (omega - Omega)]

with the current I* and the twist psi* of steady drilling; in terms of the torque each
gain of the bracket is multiplied by n K/R (:func:`regulator`; Sarker, Rideout & Butt
2012).

So ``motor_damping``, (n K)^2/R, and ``circuit_time``, L/R, describe the circuit
completely (Sarker, Rideout & Butt 2012 have such a motor; its numbers are those of
Christoforou & Yigit as reported). Its states are motor_torque and, as states come in
pairs, motor_impulse, the integral of that torque (n K times the charge), on which
nothing depends.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import Coefficients, power
from nsdrill.models.christoforou_yigit.columns import DRIVE_PARAMETERS, Regulator, values_of_string
from nsdrill.models.christoforou_yigit.parameters import Drive, Parameters
from nsdrill.models.christoforou_yigit.turning import that_only_turns, turning_string
from nsdrill.models.drilling import Drilling
from nsdrill.models.drives import (
    LAWS,
    Circuit,
    Gains,
    Seen,
    about_steady,
    by_rows,
    impedance_of,
    linear_drive,
    regulated,
)
from nsdrill.models.leaves import lane_values, with_values
from nsdrill.models.operation import Numeric
from nsdrill.models.own_drives import Linear, own_drive
from nsdrill.models.sections import parts_of


def impedance(parameters: Parameters) -> Numeric:
    """The torsional impedance of the pipe, or of the first section, Ip sqrt(rho G) [N m
    s/rad]. A drive of this impedance reflects no wave from below."""
    pipe, steel = parameters.drillstring.pipe, parameters.drillstring.material
    if (sections := parameters.drillstring.sections) is not None:
        first = parts_of(sections[:1], steel, 1.0)[0]
        return impedance_of(first.polar, first.density, first.shear)
    polar = math.pi / 32 * (power(pipe.outer_diameter, 4) - power(pipe.inner_diameter, 4))
    return impedance_of(polar, steel.density, steel.shear_modulus)


def circuit(parameters: Parameters, k: Coefficients) -> Circuit | None:
    """The circuit of a DC motor, with its gains if it has any; None for other
    drives."""
    drive = parameters.drive
    if drive.kind != "dc_motor":
        return None
    law = regulator(parameters, k, 0.0, 0.0)  # without gains 0
    scale = 1.0 + law.torque
    damping, stiffness = (drive.motor_damping + law.drive_speed) / scale, law.lag / scale
    return Circuit(float(damping), float(drive.circuit_time / scale), float(stiffness), law.of_bit)


def linear_of(parameters: Parameters, k: Coefficients, drilling: Drilling) -> tuple[Gains, Circuit | Linear | None]:
    """The law of a drive that is not ideal about steady drilling, and what its circuit or
    its states add."""
    law = gains(parameters, k, drilling.set_speed)
    linear = linear_drive(parameters.drive, drilling.string.states(drilling.at), lane_values(parameters))
    return (law, circuit(parameters, k)) if linear is None else (about_steady(law, linear), linear)


def regulator(parameters: Parameters, k: Coefficients, wob: Numeric, rotary_speed: Numeric) -> Regulator:
    """The law of the voltage of a DC motor with gains, at a weight on bit [N] and a
    rotary speed [rad/s]."""
    drive = parameters.drive
    alone = with_values(that_only_turns(parameters), {"drive.kind": "ideal"})
    string = turning_string(
        alone, wob, lambda speed: values_of_string(alone, k, wob, speed, 0.0) | {"per_inertia": 1.0}
    )
    # With an inertia of 1 the slope of the speed is a torque.
    torque, stiffness = string.load(rotary_speed)
    per_volt = drive.gear * drive.torque_constant / drive.resistance
    current, *others = drive.gains or (0.0,) * 5
    return Regulator(torque, -torque / stiffness, current / drive.resistance, *(per_volt * gain for gain in others))


def gains(parameters: Parameters, k: Coefficients, rotary_speed: Numeric = 0.0) -> Gains:
    """The law of a drive that is not ideal, at operating points with the coefficients
    ``k``; that of an LQR is tuned to the string at this rotary speed [rad/s].
    InputError where an LQR has no gains."""
    drive = parameters.drive
    if drive.kind == "lqr":
        law = _lqr(drive, parameters, k, rotary_speed)
    elif drive.kind == "dc_motor":
        law = Gains(drive.top_inertia, 0.0, 0.0)  # no controller; the torque is a state
    elif own_drive(drive.kind) is not None:
        law = Gains(drive.inertia, 0.0, 0.0)  # its torque is not linear
    else:
        law = LAWS[drive.kind].gains(drive, Seen(drive.inertia, k.J, k.k_t, impedance(parameters)))
    return law._replace(shaft_damping=drive.shaft_damping)


def _lqr(drive: Drive, parameters: Parameters, k: Coefficients, rotary_speed: Numeric) -> Gains:
    """Gains that minimise the integral of state_weight (lag^2 + ...) + torque_weight
    T_m^2, by the Riccati equation of the linear string with states (lag, omega_d -
    Omega, psi - lag, omega - Omega), whose drive has no torque, and without friction at
    the bit."""
    free = with_values(that_only_turns(parameters), {"drive.kind": "pi"})
    without = dict.fromkeys(DRIVE_PARAMETERS, 0.0)
    without |= {"per_drive_inertia": 1.0 / drive.inertia, "shaft_damping": drive.shaft_damping}
    string = turning_string(free, 0.0, lambda speed: values_of_string(free, k, 0.0, speed, 0.0) | without)
    below, _ = string.linear(string.untwisted(rotary_speed))  # of psi - lag and the speeds
    order = np.array([1, 0, 2])  # drive speed, twist, bit speed
    entries = below[..., order, :][..., order].reshape(*below.shape[:-2], 9)
    weights = (drive.state_weight, drive.torque_weight)
    feedback = by_rows(_feedback, k.J, k.k_t, 1.0 / drive.inertia, *weights, *np.moveaxis(entries, -1, 0))
    return Gains(drive.inertia, *np.moveaxis(feedback, -1, 0))


@lru_cache(maxsize=64)  # a check asks for the same string again and again
def _feedback(row: tuple[float, ...]) -> tuple[float, ...]:
    J, k_t, per_inertia, state_weight, torque_weight, *entries = row
    system = np.zeros((4, 4))
    system[0, 1] = 1.0  # the lag
    system[1:, 1:] = np.reshape(entries, (3, 3))
    force = np.array([[0.0], [per_inertia], [0.0], [0.0]])
    about = f" for a string with J = {J:.3g} kg m^2 and k_t = {k_t:.3g} N m/rad"
    change = "drive.torque_weight or drive.state_weight"
    return tuple(regulated(system, force, [state_weight] * 4, torque_weight, about, change))
