"""The gains of the drive's linear-quadratic regulator.

    V = V_0 - [K_I (I - I*) + K_1 lag + K_2 (omega_d - Omega) + K_3 (twist - twist*) + K_4 (omega - Omega)]

The gains minimise the integral of the weighted squares of the five deviations and of the voltage, by the algebraic
Riccati equation of a string of two inertias: the drive's, and J_b = k_t / w_1^2 at the bit, where w_1 is the first
torsional frequency of the segments below a held table. All drag to the wall acts at the bit; friction at the bit and
the material's damping are left out. Source: Sarker, Rideout & Butt 2012 name the method and its weights.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.string import String

DIGITS = 9  # of the gains: LAPACK's last ones depend on the processor


def gains_of(parameters: Parameters, string: String) -> np.ndarray:
    """The gains of the voltage, an array (points, 5) or (1, 5): those of the regulator, those that are given, or 0."""
    drive = parameters.drive
    if drive.kind == "lqr":
        return regulator(parameters, string)
    given = drive.gains if drive.kind == "dc_motor" and drive.gains is not None else (0.0,) * 5
    return np.array([given])


def regulator(parameters: Parameters, string: String) -> np.ndarray:
    """The gains (K_I, K_1, K_2, K_3, K_4), an array (points, 5). InputError where the Riccati equation has no
    solution."""
    drive = parameters.drive
    drags = string.drags
    numbers = np.broadcast_arrays(
        *np.atleast_1d(
            string.torsional, string.drive_inertia, drive.table_damping, sum(drags),
            drive.gear * drive.torque_constant, drive.inductance, drive.resistance, drive.control_weight,
            drive.lag_weight, drive.drive_speed_weight, drive.current_weight, drive.twist_weight,
            drive.bit_speed_weight,
        ),
        *(np.atleast_1d(value) for value in string.springs + string.inertias),
    )  # fmt: skip
    table = np.stack(numbers, axis=1).astype(float)
    distinct, places = np.unique(table, axis=0, return_inverse=True)
    return np.array([_gains(row, len(string.springs)) for row in distinct])[places.ravel()]


def first_frequency(springs: Any, inertias: Any) -> float:
    """The lowest torsional frequency [rad/s] of ``springs`` [N m/rad] below a held end, with ``inertias`` [kg m^2]."""
    from scipy.linalg import eigh_tridiagonal

    springs, inertias = np.asarray(springs, dtype=float), np.asarray(inertias, dtype=float)
    diagonal = (springs + np.append(springs[1:], 0.0)) / inertias
    beside = -springs[1:] / np.sqrt(inertias[:-1] * inertias[1:])
    return float(np.sqrt(eigh_tridiagonal(diagonal, beside, eigvals_only=True, select="i", select_range=(0, 0))[0]))


def matrices(row: Any, springs: int) -> tuple[Any, Any]:
    """The matrix of the linear drive and string, states (lag, omega_d, I, twist, omega), and the column of V."""
    k_t, J_d, c_d, c_b, motor, inductance, resistance = row[:7]
    w = first_frequency(row[13 : 13 + springs], row[13 + springs :])
    J_b = k_t / (w * w)
    system = np.array(
        [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [-k_t / J_d, -c_d / J_d, motor / J_d, k_t / J_d, 0.0],
            [0.0, -motor / inductance, -resistance / inductance, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0],
            [k_t / J_b, 0.0, 0.0, -k_t / J_b, -c_b / J_b],
        ]
    )
    return system, np.array([[0.0], [0.0], [1.0 / inductance], [0.0], [0.0]])


def _gains(row: Any, springs: int) -> list[float]:
    from scipy.linalg import solve_continuous_are

    system, voltage = matrices(row, springs)
    weight, lag, drive_speed, current, twist, bit_speed = row[7:13]
    try:
        cost = solve_continuous_are(system, voltage, np.diag([lag, drive_speed, current, twist, bit_speed]), [[weight]])
    except (np.linalg.LinAlgError, ValueError) as error:
        raise InputError(
            "drive.kind: lqr finds no gains: the Riccati equation cannot be solved to any use. Change the weights of "
            "the drive, or take another kind."
        ) from error
    lag, drive_speed, current, twist, bit_speed = (voltage.T @ cost / weight)[0]
    return [float(f"{gain:.{DIGITS}g}") for gain in (current, lag, drive_speed, twist, bit_speed)]
