"""What turns the top of the string: the law of the drive's controller as five numbers, whatever its kind.

With lag = phi_d - Omega t, the angle by which the top is ahead of the set point (negative: behind), omega_d its speed,
psi the twist counted from the set point, and T_p the torque of the pipe:

    lag'       = omega_d - Omega
    J omega_d' = -K_i lag - K_p (omega_d - Omega) - G_t (psi - lag) - G_w (omega - Omega) - T_p
    T_p        = k_t (lag - psi) + c_s (omega_d - omega)

With a ``torque_limit`` the torque of the motor, all of the second line but -T_p, stays between 0 and that limit: the
motor does not brake. (The controller of **O** has 60 kN m.) That is the torque of the machine only where J is the
machine's own inertia. The integral winds up meanwhile, as in **O**: it is the angle that the top lags behind.

A **DC motor** has a torque of its own, T_m = n K i, with the current i of its armature, the gear ratio n and the
constant K of the motor, at the constant voltage at which it idles with the set speed, n K Omega:

    L i' + R i = n K (Omega - omega_d)       that is       (L/R) T_m' = (n K)^2/R (Omega - omega_d) - T_m
    J omega_d' = T_m - T_p

With ``gains`` the voltage follows the motion, so that steady drilling is at the set speed:

    V = n K Omega + R I* - [K_I (i - I*) + K_1 lag + K_2 (omega_d - Omega) + K_3 (psi - psi*) + K_4 (omega - Omega)]

with the current I* and the twist psi* of steady drilling; in terms of the torque each gain of the bracket is times
n K/R (:func:`regulator`; Sarker, Rideout & Butt 2012).

So ``motor_damping``, (n K)^2/R, and ``circuit_time``, L/R, say all that the circuit does (Sarker, Rideout & Butt 2012
have such a motor; its numbers are those of Christoforou & Yigit as reported). Its states are motor_torque and, as
states come in pairs, motor_impulse, the integral of that torque (n K times the charge), on which nothing depends.

The integral of a PI controller's speed error is -lag, so K_i is its integral gain. An ideal drive has no states: lag is
zero and omega_d is Omega.

Sources: **O** Simulator4nDOF of the Open Source Drilling Community (top-drive controller and its configuration);
**K** Kyllingstad & Nessjoen 2009, SPE/IADC 119660, as cited there. Equal damping places both modes of drive and string
at one frequency with one damping: J_d J s^4 + ... = J J_d (s^2 + 2 z w s + w^2)^2 without bit damping.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, power
from nsdrill.models.christoforou_yigit.laws import bit_arm
from nsdrill.models.christoforou_yigit.parameters import Drive, Parameters

STIFF = 50.0  # speed gain of a stiff controller, in pipe impedances (O)
DIGITS = 9  # of gains that come from LAPACK, whose last digits depend on the processor


class Gains(NamedTuple):
    """Numbers, or arrays over operating points: the drive's inertia [kg m^2] as its controller makes it felt, then K_i
    [N m/rad], K_p [N m s/rad], G_t [N m/rad], G_w [N m s/rad], c_s [N m s/rad]."""

    inertia: Any
    stiffness: Any
    damping: Any
    twist_gain: Any = 0.0
    speed_gain: Any = 0.0
    shaft_damping: Any = 0.0


def motor_torque(
    law: Gains, limit: Any, lag: Any, drive_speed: Any, twist: Any, bit_speed: Any, rotary_speed: Any
) -> Any:
    """The torque of the motor [N m] as the controller asks for it, within 0 and ``limit`` [N m] where that is given."""
    asked = -(
        law.stiffness * lag
        + law.damping * (drive_speed - rotary_speed)
        + law.twist_gain * (twist - lag)
        + law.speed_gain * (bit_speed - rotary_speed)
    )
    return asked if limit is None else np.clip(asked, 0.0, limit)


def impedance(parameters: Parameters) -> Any:
    """The torsional impedance of the pipe, Ip sqrt(rho G) [N m s/rad]: what a wave from below meets nothing in."""
    pipe, steel = parameters.drillstring.pipe, parameters.drillstring.material
    polar = math.pi / 32 * (power(pipe.outer_diameter, 4) - power(pipe.inner_diameter, 4))
    return polar * np.sqrt(steel.density * steel.shear_modulus)


def reflection(law: Gains, pipe: float, frequency: Any, motor: Circuit | None = None) -> Any:
    """What share of the velocity of a torsional wave from below comes back from the drive, complex, at a ``frequency``
    w [rad/s], a number or an array: (z - Z) / (z + Z) with the impedance z of the ``pipe`` [N m s/rad] and
    Z = K_p + i (w J - K_i / w) of the drive; of a DC ``motor`` with this :func:`circuit` it is
    i w J + (K + S / (i w)) / (1 + i w T). None where the law has gains on the motion of the bit: the drive is no
    impedance then. Source: continuity of speed and torque of the wave at the top, where the drive's torque is Z times
    its speed."""
    if law.twist_gain or law.speed_gain or (motor is not None and motor.of_bit):
        return None
    drive = law.damping + 1j * (frequency * law.inertia - law.stiffness / frequency)
    if motor is not None:
        stiffness = motor.stiffness / (1j * frequency) if motor.stiffness else 0.0
        drive = drive + (motor.damping + stiffness) / (1.0 + 1j * frequency * motor.time)
    return (pipe - drive) / (pipe + drive)


class Circuit(NamedTuple):
    """A DC motor seen from the string: its damping K [N m s/rad], the time constant T of the circuit [s], the stiffness
    S with which it holds its angle [N m/rad], and whether it acts on the motion of the bit."""

    damping: float
    time: float
    stiffness: float = 0.0
    of_bit: bool = False


def circuit(parameters: Parameters, k: Coefficients) -> Circuit | None:
    """That of a DC motor, with its gains where it has such; None of other drives."""
    drive = parameters.drive
    if drive.kind != "dc_motor":
        return None
    if not drive.regulated:
        return Circuit(float(drive.motor_damping), float(drive.circuit_time))
    law = regulator(parameters, k, 0.0, 0.0)
    own = 1.0 + law.torque
    damping, stiffness = (drive.motor_damping + law.drive_speed) / own, law.lag / own
    return Circuit(float(damping), float(drive.circuit_time / own), float(stiffness), law.of_bit)


class Regulator(NamedTuple):
    """What the voltage of a motor makes of the motion, as torque at the string: numbers, or arrays over operating
    points. The torque of steady drilling [N m] and its twist [rad]; then of the deviation of torque [1], lag [N m/rad],
    drive speed [N m s/rad], twist [N m/rad] and bit speed [N m s/rad]."""

    steady_motor_torque: Any
    steady_twist: Any
    torque: Any
    lag: Any
    drive_speed: Any
    twist: Any
    bit_speed: Any

    @property
    def of_bit(self) -> bool:
        """Whether the bit is measured."""
        return bool(np.any(self.twist) or np.any(self.bit_speed))


def regulator(parameters: Parameters, k: Coefficients, wob: Any, rotary_speed: Any) -> Regulator:
    """The law of the voltage of a DC motor with gains, at a weight on bit [N] and a rotary speed [rad/s]."""
    drive = parameters.drive
    torque = wob * bit_arm(parameters, k, rotary_speed) + parameters.drillstring.torsional_damping * rotary_speed
    per_volt = drive.gear * drive.torque_constant / drive.resistance
    current, *others = drive.gains or (0.0,) * 5
    return Regulator(torque, -torque / k.k_t, current / drive.resistance, *(per_volt * gain for gain in others))


def gains(parameters: Parameters, k: Coefficients) -> Gains:
    """The law of the drive at operating points with the coefficients ``k``; not of an ideal one. InputError where an
    LQR has no gains."""
    drive = parameters.drive
    made: Gains = _LAWS[drive.kind](drive, parameters, k)
    return made._replace(shaft_damping=drive.shaft_damping)


def _stiff(drive: Drive, parameters: Parameters, k: Coefficients) -> Gains:
    return Gains(drive.inertia, 5.0 * drive.inertia, STIFF * impedance(parameters))


def _soft_torque(drive: Drive, parameters: Parameters, k: Coefficients) -> Gains:
    inertia = drive.inertia - drive.compensated_inertia
    rate = np.sqrt(k.k_t / k.J) if drive.frequency is None else 2 * math.pi * drive.frequency
    return Gains(inertia, rate * rate * inertia, drive.matching * impedance(parameters))


def _equal_damping(drive: Drive, parameters: Parameters, k: Coefficients) -> Gains:
    return Gains(drive.inertia, k.k_t * drive.inertia / k.J, 2.0 * np.sqrt(k.k_t * drive.inertia))


def _z_torque(drive: Drive, parameters: Parameters, k: Coefficients) -> Gains:
    softer = 1.0 + STIFF * drive.a
    damping = STIFF * impedance(parameters) / softer
    return Gains(drive.inertia / softer, damping / drive.high_pass, damping)


def _pi(drive: Drive, parameters: Parameters, k: Coefficients) -> Gains:
    return Gains(drive.inertia, drive.stiffness, drive.damping, drive.twist_gain, drive.speed_gain)


def _lqr(drive: Drive, parameters: Parameters, k: Coefficients) -> Gains:
    """Gains that minimise the integral of state_weight (lag^2 + ...) + torque_weight T_m^2, by the Riccati equation of
    the linear string with states (lag, omega_d - Omega, psi - lag, omega - Omega) and without friction at the bit."""
    numbers = np.broadcast_arrays(
        k.J,
        k.k_t,
        parameters.drillstring.torsional_damping,
        drive.inertia,
        drive.shaft_damping,
        drive.state_weight,
        drive.torque_weight,
    )
    distinct, places = np.unique(np.stack([value.ravel() for value in numbers], axis=1), axis=0, return_inverse=True)
    found = np.array([_regulator(*row) for row in distinct.tolist()])[places.ravel()]
    return Gains(drive.inertia, *(column.reshape(numbers[0].shape) for column in found.T))


def _regulator(
    J: float, k_t: float, c_t: float, inertia: float, c_s: float, state_weight: float, torque_weight: float
) -> list[float]:
    from scipy.linalg import solve_continuous_are

    system = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [0.0, -c_s / inertia, k_t / inertia, c_s / inertia],
            [0.0, -1.0, 0.0, 1.0],
            [0.0, c_s / J, -k_t / J, -(c_t + c_s) / J],
        ]
    )
    force = np.array([[0.0], [1.0 / inertia], [0.0], [0.0]])
    try:
        cost = solve_continuous_are(system, force, state_weight * np.eye(4), np.array([[torque_weight]]))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InputError(
            f"drive.kind: lqr finds no gains for a string with J = {J:.3g} kg m^2 and k_t = {k_t:.3g} N m/rad: the "
            "Riccati equation cannot be solved to any use. Change drive.torque_weight or drive.state_weight, or take "
            "another kind."
        ) from error
    return [float(f"{value:.{DIGITS}g}") for value in (force.T @ cost / torque_weight)[0]]


def _dc_motor(drive: Drive, parameters: Parameters, k: Coefficients) -> Gains:
    return Gains(drive.top_inertia, 0.0, 0.0)  # no controller; the torque is a state


_LAWS: dict[str, Any] = {
    "stiff": _stiff,
    "soft_torque": _soft_torque,
    "equal_damping": _equal_damping,
    "z_torque": _z_torque,
    "lqr": _lqr,
    "pi": _pi,
    "dc_motor": _dc_motor,
}
