"""Drives whose numbers follow from the string that they turn, for every model of one rotary
inertia: the linear-quadratic regulator, and the circuit of a DC motor.

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
Christoforou & Yigit as reported).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Number
from nsdrill.equations.trace import Named
from nsdrill.errors import InputError
from nsdrill.models.drive_laws import Circuit, Gains, by_rows, linear_drive, regulated
from nsdrill.models.operation import Numeric

if TYPE_CHECKING:
    from nsdrill.models.steady import String


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


# The lane parameters of the circuit, and of the law of a voltage that has gains.
MOTOR_LANES = ("motor_damping", "per_circuit_time")
REGULATOR_LANES = tuple(f"regulator_{name}" for name in Regulator._fields)


def motor_columns(drive: Any) -> dict[str, Numeric]:
    """The lane parameters of the circuit of a ``drive``."""
    return dict(zip(MOTOR_LANES, (drive.motor_damping, 1 / drive.circuit_time), strict=True))


def regulator_columns(law: Regulator) -> dict[str, Numeric]:
    """The lane parameters of the law of a voltage."""
    return dict(zip(REGULATOR_LANES, law, strict=True))


def regulator(drive: Any, below: String, rotary_speed: Numeric) -> Regulator:
    """The law of the voltage of a DC motor with gains at a rotary speed [rad/s]. ``below``
    is the string with an ideal drive and an inertia of 1, with which the slope of its
    speed is a torque."""
    torque, stiffness = below.load(rotary_speed)
    per_volt = drive.gear * drive.torque_constant / drive.resistance
    current, *others = drive.gains or (0.0,) * 5
    return Regulator(torque, -torque / stiffness, current / drive.resistance, *(per_volt * gain for gain in others))


def circuit(drive: Any, law: Regulator) -> Circuit:
    """The circuit of a DC motor with the ``law`` of its voltage, whose gains may be 0."""
    scale = 1.0 + law.torque
    damping, stiffness = (drive.motor_damping + law.drive_speed) / scale, law.lag / scale
    return Circuit(float(damping), float(drive.circuit_time / scale), float(stiffness), law.of_bit)


def fastest(table: Mapping[str, Array], is_regulated: int) -> list[Array]:
    """The squares of the rates [1/s^2] of a motor with these lane parameters."""
    per_time, per_inertia = table["per_circuit_time"], table["per_drive_inertia"]
    rates = [table["motor_damping"] * per_time * per_inertia, per_time**2]
    if is_regulated:
        lag, drive_speed = table["regulator_lag"], table["regulator_drive_speed"]
        rates += [((1 + table["regulator_torque"]) * per_time) ** 2]
        rates += [np.abs(table["motor_damping"] + drive_speed) * per_time * per_inertia]
        rates += [np.abs(lag * per_time * per_inertia) ** (2 / 3)]
    return rates


def torque_rate(s: Named, p: Named, is_regulated: int) -> Number:
    """The slope of the torque of the motor [N m/s]."""
    rate = p.motor_damping * (p.set_speed - s.drive_speed) - s.motor_torque
    if is_regulated:
        rate = (
            rate
            + p.regulator_steady_motor_torque
            - (
                p.regulator_torque * (s.motor_torque - p.regulator_steady_motor_torque)
                + p.regulator_lag * s.lag
                + p.regulator_twist * (s.twist - p.regulator_steady_twist)
                + p.regulator_drive_speed * (s.drive_speed - p.set_speed)
                + p.regulator_bit_speed * (s.bit_speed - p.set_speed)
            )
        )
    slope: Number = rate * p.per_circuit_time
    return slope


def check_holds(drive: Any, table: Mapping[str, Numeric]) -> None:
    """InputError where a ``drive`` with these lane parameters, in a continuation, holds no
    angle to that of the set speed, as an ideal one does."""
    if drive.ideal:
        return
    linear = linear_drive(drive, {"set_speed": table["set_speed"]}, table)
    gain = table["regulator_lag" if drive.regulated else "drive_stiffness"]
    if not (np.ravel(gain)[0] != 0.0 if linear is None else linear.holds):
        raise InputError(
            f"drive.kind: found {drive.kind}, a motor or a drive whose angle nothing holds to that "
            "of the set speed, so that no motion repeats in that frame; allowed in a continuation: ideal, a "
            "drive with an integral gain, or a dc_motor whose drive.gains hold the lag (K_1, the second one). "
            "A sweep up and down (sweep.procedure: up-down) takes any drive."
        )


def optimal(drive: Any, inertia: Numeric, stiffness: Numeric, free: String, rotary_speed: Numeric) -> Gains:
    """Gains that minimise the integral of state_weight (lag^2 + ...) + torque_weight
    T_m^2, by the Riccati equation of the linear string with states (lag, omega_d -
    Omega, psi - lag, omega - Omega). That string is ``free``: its drive has no torque, and
    nothing rubs at the bit. ``inertia`` [kg m^2] and ``stiffness`` [N m/rad] name it where
    there are no gains (InputError)."""
    below, _ = free.linear(free.untwisted(rotary_speed))  # of psi - lag and the speeds
    order = np.array([1, 0, 2])  # drive speed, twist, bit speed
    entries = below[..., order, :][..., order].reshape(*below.shape[:-2], 9)
    weights = (drive.state_weight, drive.torque_weight)
    feedback = by_rows(_feedback, inertia, stiffness, 1.0 / drive.inertia, *weights, *np.moveaxis(entries, -1, 0))
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
