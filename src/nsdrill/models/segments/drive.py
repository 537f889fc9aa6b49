"""The control of the drive: the gains of its linear-quadratic regulator, or the law of
its torque.

    V = V_0 - [K_I (I - I*) + K_1 lag + K_2 (omega_d - Omega) + K_3 (twist - twist*)
               + K_4 (omega - Omega)]

The gains minimise the integral of the weighted squares of the five deviations and of
the voltage, by the algebraic Riccati equation of a string of two inertias: the drive's,
and J_b = k_t / w_1^2 at the bit, where w_1 is the first torsional frequency of the
segments below a held table. All drag to the wall acts at the bit; friction at the bit
and the material's damping are left out. Source: Sarker, Rideout & Butt 2012 name the
method and its weights.

The law of a drive by torque is that of :mod:`nsdrill.models.drives`, where the angle of
the bit is its twist. It is tuned to the inertia at the top, of the drive and the kelly,
to the impedance of the pipe, and to the first torsional mode below a held top: the
stiffness k_t of the whole string and the inertia J_b. J_0 w_0' is T_m less the torque
of the string, with J_0 the inertia of the law and half a segment. Until ``on_at``, and
always with an ideal drive, the top keeps the set speed, and the torque is the one that
this takes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models.drives import DIGITS, LAWS, Gains, Seen, by_rows, impedance_of, regulated
from nsdrill.models.operation import Numeric
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.string import Steady, String

NEVER = 1e30  # s: when an ideal drive is switched on
UNLIMITED = 1e30  # N m


def gains_of(parameters: Parameters, string: String) -> np.ndarray:
    """The gains of the voltage, an array (points, 5) or (1, 5): those of the regulator,
    those of the study, or 0."""
    drive = parameters.drive
    if drive.kind == "lqr":
        return regulator(parameters, string)
    gains = drive.gains if drive.kind == "dc_motor" and drive.gains is not None else (0.0,) * 5
    return np.array([gains])


def law_of(parameters: Parameters, string: String) -> Gains:
    """The law of a drive by torque, at the depths of the ``string``; that of an ideal
    drive has no gains."""
    drive = parameters.drive
    top = drive.inertia + string.kelly_inertia
    if drive.kind == "ideal":
        return Gains(top, 0.0, 0.0)
    return LAWS[drive.kind].gains(drive, Seen(top, _modal_inertia(string), string.torsional, impedance(parameters)))


def impedance(parameters: Parameters) -> Numeric:
    """The torsional impedance of the pipe [N m s/rad]."""
    pipe, steel = parameters.drillstring.pipe, parameters.drillstring.material
    outer, inner = (pipe.outer_diameter * pipe.outer_diameter, pipe.inner_diameter * pipe.inner_diameter)
    return impedance_of(math.pi / 32 * (outer * outer - inner * inner), steel.density, steel.shear_modulus)


def lag_of(parameters: Parameters, string: String, steady: Steady) -> Numeric:
    """The lag [rad] at which the law gives the torque of steady drilling; 0 for a drive
    that is switched on later, or that has no integral gain and deviates in speed rather
    than in angle."""
    drive = parameters.drive
    if drive.kind not in LAWS:
        return 0.0
    law = law_of(parameters, string)
    torque = steady.table_torque + law.twist_gain * steady.angles[-1]
    torque, stiffness, on_at = np.broadcast_arrays(torque, law.stiffness, drive.on_at)
    return -np.divide(torque, stiffness, out=np.zeros(torque.shape), where=(stiffness != 0.0) & (on_at == 0.0))


def _modal_inertia(string: String) -> Numeric:
    """The inertia J_b [kg m^2] that has, with the stiffness of the string, the first
    torsional frequency below a held top."""
    count = len(string.torsional_stiffnesses)

    def inertia(row: list[float]) -> float:
        w = first_frequency(row[1 : 1 + count], row[1 + count :])
        return float(f"{row[0] / (w * w):.{DIGITS}g}")

    at_points = by_rows(inertia, string.torsional, *string.torsional_stiffnesses, *string.inertias)
    return at_points if at_points.ndim else float(at_points)


def regulator(parameters: Parameters, string: String) -> np.ndarray:
    """The gains (K_I, K_1, K_2, K_3, K_4), an array (points, 5). InputError where the
    Riccati equation has no solution."""
    drive = parameters.drive
    count = len(string.torsional_stiffnesses)
    rows = by_rows(
        lambda row: _gains(row, count),
        string.torsional,
        string.drive_inertia,
        drive.table_damping,
        sum(string.drags),
        drive.gear * drive.torque_constant,
        drive.inductance,
        drive.resistance,
        drive.control_weight,
        drive.lag_weight,
        drive.drive_speed_weight,
        drive.current_weight,
        drive.twist_weight,
        drive.bit_speed_weight,
        *string.torsional_stiffnesses,
        *string.inertias,
    )
    return np.atleast_2d(rows)


def first_frequency(stiffnesses: Any, inertias: Any) -> float:
    """The lowest frequency [rad/s] of a chain of springs with these ``stiffnesses``
    [N m/rad] below a held end, and ``inertias`` [kg m^2] below each; of axial motion,
    [N/m] and [kg]."""
    from scipy.linalg import eigh_tridiagonal

    stiffnesses, inertias = np.asarray(stiffnesses, dtype=float), np.asarray(inertias, dtype=float)
    diagonal = (stiffnesses + np.append(stiffnesses[1:], 0.0)) / inertias
    off_diagonal = -stiffnesses[1:] / np.sqrt(inertias[:-1] * inertias[1:])
    return float(
        np.sqrt(eigh_tridiagonal(diagonal, off_diagonal, eigvals_only=True, select="i", select_range=(0, 0))[0])
    )


def matrices(row: Sequence[float], springs: int) -> tuple[Array, Array]:
    """The matrix of the linear drive and string, with the states (lag, omega_d, I,
    twist, omega), and the column of V, from a ``row`` of :func:`regulator`'s numbers for
    a string of so many ``springs``."""
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


def _gains(row: list[float], springs: int) -> list[float]:
    system, voltage = matrices(row, springs)
    effort, lag, drive_speed, current, twist, bit_speed = row[7:13]
    weights = lag, drive_speed, current, twist, bit_speed
    gains = regulated(system, voltage, weights, effort, "", "the weights of the drive")
    return [gains[2], *gains[:2], *gains[3:]]
