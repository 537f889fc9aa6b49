"""The drives of the main model: the law of the controller
(:mod:`nsdrill.models.drives`) for this string, the linear-quadratic regulator, and the
circuit of a DC motor; and how stable the string with its drive is.

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
from typing import NamedTuple

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import Coefficients, bit_arm, power
from nsdrill.models.christoforou_yigit.parameters import Drive, Parameters
from nsdrill.models.drives import LAWS, Circuit, Gains, Seen, by_rows, growing, impedance_of, regulated, steepest_fall
from nsdrill.models.operation import Numeric


def impedance(parameters: Parameters) -> Numeric:
    """The torsional impedance of the pipe, Ip sqrt(rho G) [N m s/rad]. A drive of this
    impedance reflects no wave from below."""
    pipe, steel = parameters.drillstring.pipe, parameters.drillstring.material
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


class Regulator(NamedTuple):
    """The law of the voltage of a motor in terms of torque at the string, numbers or
    arrays over operating points: the torque [N m] and the twist [rad] of steady
    drilling; then the gains on the deviations of torque [1], lag [N m/rad], drive speed
    [N m s/rad], twist [N m/rad] and bit speed [N m s/rad]."""

    steady_motor_torque: Numeric
    steady_twist: Numeric
    torque: Numeric
    lag: Numeric
    drive_speed: Numeric
    twist: Numeric
    bit_speed: Numeric

    @property
    def of_bit(self) -> bool:
        """Whether the voltage depends on the motion of the bit."""
        return bool(np.any(self.twist) or np.any(self.bit_speed))


def regulator(parameters: Parameters, k: Coefficients, wob: Numeric, rotary_speed: Numeric) -> Regulator:
    """The law of the voltage of a DC motor with gains, at a weight on bit [N] and a
    rotary speed [rad/s]."""
    drive = parameters.drive
    torque = wob * bit_arm(parameters, k, rotary_speed) + parameters.drillstring.torsional_damping * rotary_speed
    per_volt = drive.gear * drive.torque_constant / drive.resistance
    current, *others = drive.gains or (0.0,) * 5
    return Regulator(torque, -torque / k.k_t, current / drive.resistance, *(per_volt * gain for gain in others))


def gains(parameters: Parameters, k: Coefficients) -> Gains:
    """The law of a drive that is not ideal, at operating points with the coefficients
    ``k``. InputError where an LQR has no gains."""
    drive = parameters.drive
    if drive.kind == "lqr":
        law = _lqr(drive, parameters, k)
    elif drive.kind == "dc_motor":
        law = Gains(drive.top_inertia, 0.0, 0.0)  # no controller; the torque is a state
    else:
        law = LAWS[drive.kind].gains(drive, Seen(drive.inertia, k.J, k.k_t, impedance(parameters)))
    return law._replace(shaft_damping=drive.shaft_damping)


def _lqr(drive: Drive, parameters: Parameters, k: Coefficients) -> Gains:
    """Gains that minimise the integral of state_weight (lag^2 + ...) + torque_weight
    T_m^2, by the Riccati equation of the linear string with states (lag, omega_d -
    Omega, psi - lag, omega - Omega) and without friction at the bit."""
    damping, weights = parameters.drillstring.torsional_damping, (drive.state_weight, drive.torque_weight)
    feedback = by_rows(_feedback, k.J, k.k_t, damping, drive.inertia, drive.shaft_damping, *weights)
    return Gains(drive.inertia, *np.moveaxis(feedback, -1, 0))


def _feedback(row: list[float]) -> list[float]:
    J, k_t, c_t, inertia, c_s, state_weight, torque_weight = row
    system = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [0.0, -c_s / inertia, k_t / inertia, c_s / inertia],
            [0.0, -1.0, 0.0, 1.0],
            [0.0, c_s / J, -k_t / J, -(c_t + c_s) / J],
        ]
    )
    force = np.array([[0.0], [1.0 / inertia], [0.0], [0.0]])
    about = f" for a string with J = {J:.3g} kg m^2 and k_t = {k_t:.3g} N m/rad"
    change = "drive.torque_weight or drive.state_weight"
    return regulated(system, force, [state_weight] * 4, torque_weight, about, change)


def torsional_matrix(parameters: Parameters, k: Coefficients, law: Gains | None = None) -> np.ndarray:
    """The matrix of string and drive [4, 4] for deviations of (lag, drive speed, twist,
    bit speed) from the set point, without friction at the bit; [2, 2] for the last two
    with an ideal drive. ``law`` are the :func:`gains` of the drive if they have been
    computed; if they are arrays, the matrix has their dimensions first."""
    c_t = parameters.drillstring.torsional_damping
    J, k_t = float(k.J), float(k.k_t)
    if parameters.drive.ideal and law is None:
        return np.array([[0.0, 1.0], [-k_t / J, -c_t / J]])
    if parameters.drive.kind == "dc_motor":
        return _with_motor(parameters, k, c_t)
    law = law or gains(parameters, k)
    inertia, stiffness, damping, twist, speed, c_s = np.broadcast_arrays(*(np.asarray(value, float) for value in law))
    matrix = np.zeros((*inertia.shape, 4, 4))
    matrix[..., 0, 1] = matrix[..., 2, 3] = 1.0
    matrix[..., 1, 0] = (twist - stiffness - k_t) / inertia
    matrix[..., 1, 1] = -(damping + c_s) / inertia
    matrix[..., 1, 2] = (k_t - twist) / inertia
    matrix[..., 1, 3] = (c_s - speed) / inertia
    matrix[..., 3, 0], matrix[..., 3, 2] = k_t / J, -k_t / J
    matrix[..., 3, 1], matrix[..., 3, 3] = c_s / J, -(c_t + c_s) / J
    return matrix


def _with_motor(parameters: Parameters, k: Coefficients, c_t: float) -> np.ndarray:
    """The matrix of string and DC motor [4, 4]: (motor torque, drive speed, torque of
    the pipe's spring, bit speed). The angle of the top, which is free at constant
    voltage, is left out: its eigenvalue is 0. With gains that hold the angle [5, 5]:
    (motor torque, lag, drive speed, twist, bit speed)."""
    drive, J, k_t = parameters.drive, float(k.J), float(k.k_t)
    inertia, c_s, per_time = (float(drive.top_inertia), float(drive.shaft_damping), 1.0 / float(drive.circuit_time))
    law = regulator(parameters, k, 0.0, 0.0)  # without gains 0
    circuit, damping = -(1.0 + law.torque) * per_time, float(drive.motor_damping) + law.drive_speed
    if law.lag + law.twist != 0.0:
        return np.array(
            [
                [circuit, -law.lag * per_time, -damping * per_time, -law.twist * per_time, -law.bit_speed * per_time],
                [0.0, 0.0, 1.0, 0.0, 0.0],
                [1.0 / inertia, -k_t / inertia, -c_s / inertia, k_t / inertia, c_s / inertia],
                [0.0, 0.0, 0.0, 0.0, 1.0],
                [0.0, k_t / J, c_s / J, -k_t / J, -(c_t + c_s) / J],
            ]
        )
    return np.array(
        [
            [circuit, -damping * per_time, -law.lag / k_t * per_time, -law.bit_speed * per_time],
            [1.0 / inertia, -c_s / inertia, -1.0 / inertia, c_s / inertia],
            [0.0, k_t, 0.0, -k_t],
            [0.0, c_s / J, 1.0 / J, -(c_t + c_s) / J],
        ]
    )


def slope_held(parameters: Parameters, k: Coefficients) -> float:
    """The steepest fall of the friction torque with bit speed [N m s/rad] with which
    steady drilling is stable; negative where the drive itself is unstable."""
    return float(fall_withstood(torsional_matrix(parameters, k), k, parameters.drillstring.torsional_damping))


def fall_withstood(matrix: np.ndarray, k: Coefficients, c_t: float) -> np.ndarray:
    """As :func:`slope_held`, for strings and drives with these matrices of
    :func:`torsional_matrix` [..., n, n]: array [...]. ``c_t`` is the torsional damping
    [N m s/rad]."""
    # with an ideal drive oscillations grow where the fall exceeds the damping
    if matrix.shape[-1] == 2:
        return np.full(matrix.shape[:-2], float(c_t))
    critical = 2.0 * math.sqrt(float(k.J) * float(k.k_t))  # a critical damping
    return steepest_fall(matrix, -1, float(k.J), -critical, c_t + 4.0 * critical)


def growth_at_rest(parameters: Parameters, k: Coefficients) -> complex | None:
    """The eigenvalue [1/s] of the fastest growing deviation of string and drive,
    without friction at the bit; None where none grows."""
    return growing(torsional_matrix(parameters, k))
