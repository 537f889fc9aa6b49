"""What ``check`` shows of a study of a string of segments, and the chart of its drives,
neither of which needs an integration: coefficients, quantities of the string and its
drive, linearised about steady drilling, and warnings.

The coordinates are the angle of the top, where something holds it, the twist of each
segment e_i = th_{i+1} - th_i, the angular speeds less the set speed, and, with an
electric motor, the current less that of steady drilling. Axial motion is decoupled from
these on a rock without lobes, where the force on the bit is the weight on it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models import drives
from nsdrill.models.drives import (
    LAWS,
    Circuit,
    Gains,
    growing,
    overloaded,
    quantities_of_drive,
    reflection,
    steepest_fall,
    swinging,
)
from nsdrill.models.leaves import Values, with_values
from nsdrill.models.numbers import DerivedQuantity, DriveCard, FormatValue, few_periods
from nsdrill.models.operation import Numeric, Operation
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.rock import bit_torque
from nsdrill.models.segments.string import String, first_frequency, gains_of, impedance, law_of, steady_of, string_of
from nsdrill.ranges import computed, meanings_of

SPEEDS = np.geomspace(0.05, 1000.0, 400)  # rad/s, searched for the onset
MODES = 3  # modes of string and drive among the derived quantities
WAVES = 4  # standing waves in the chart of the drives
STEP = 1e-5  # of the bit speed, in the slope of the torque


def torsional_matrix(parameters: Parameters, string: String) -> Array:
    """d(rates)/d(coordinates) without friction at the bit, whose speed is the last of
    the angular speeds."""
    drive, stiffnesses, n = (parameters.drive, string.torsional_stiffnesses, string.pipes + string.collars)
    motor = not drive.by_torque
    top = string.drive_inertia if motor else law_of(parameters, string).inertia + string.pipe.inertia / 2
    inertias, drags = (top, *string.inertias), string.drags
    matrix = np.zeros((2 * n + 2 + motor, 2 * n + 2 + motor))
    speeds = range(n + 1, 2 * n + 2)
    matrix[0, speeds[0]] = 1.0
    for i, stiffness in enumerate(stiffnesses):
        damping = stiffness * parameters.segments.material_damping.torsional
        matrix[1 + i, speeds[i + 1]], matrix[1 + i, speeds[i]] = 1.0, -1.0
        for node, sign in ((i, 1.0), (i + 1, -1.0)):
            row = speeds[node]
            matrix[row, 1 + i] += sign * stiffness / inertias[node]
            matrix[row, speeds[i + 1]] += sign * damping / inertias[node]
            matrix[row, speeds[i]] -= sign * damping / inertias[node]
    for node, row in enumerate(speeds):
        matrix[row, row] -= drags[node] / inertias[node]
    first, bit = speeds[0], speeds[-1]
    if motor:
        current, constant = 2 * n + 2, drive.gear * drive.torque_constant
        matrix[first, first] -= drive.table_damping / top
        matrix[first, current] = constant / top
        K_I, K_1, K_2, K_3, K_4 = gains_of(parameters, string)[0]
        rates = {current: drive.resistance + K_I, 0: K_1 + K_3, first: constant + K_2, bit: K_4}
        for column, value in (*rates.items(), *((1 + i, K_3) for i in range(n))):
            matrix[current, column] -= value / drive.inductance
    elif drive.kind == "ideal":
        matrix[first] = 0.0
    else:
        law = law_of(parameters, string)
        for column, value in (
            (0, law.stiffness),
            (first, law.damping),
            (bit, law.speed_gain),
            *((1 + i, law.twist_gain) for i in range(n)),
        ):
            matrix[first, column] -= value / top
    if drive.kind == "ideal":  # the top follows the set speed
        keep = [column for column in range(len(matrix)) if column not in (0, first)]
    else:  # the top's angle is left out where nothing depends on it
        keep = [column for column in range(len(matrix)) if column > 0 or np.any(matrix[:, 0])]
    return matrix[np.ix_(keep, keep)]


def torsional_frequencies(string: String, count: int) -> Array:
    """The first ``count`` torsional frequencies [rad/s] of the string below a held
    top."""
    stiffnesses, inertias = (
        np.asarray(string.torsional_stiffnesses, dtype=float),
        np.asarray(string.inertias, dtype=float),
    )
    matrix = (
        np.diag(stiffnesses + np.append(stiffnesses[1:], 0.0))
        - np.diag(stiffnesses[1:], 1)
        - np.diag(stiffnesses[1:], -1)
    )
    inverse_root = 1.0 / np.sqrt(inertias)
    return np.sqrt(np.linalg.eigvalsh(matrix * inverse_root[:, None] * inverse_root))[:count]


def axial_free(parameters: Parameters, string: String) -> float:
    """The first axial frequency [rad/s] of the string on its hoist, with the bit off
    the rock."""
    inner = [(string.pipe.mass, string.pipes - 1), (string.joint_mass, 1), (string.collar.mass, string.collars - 1)]
    masses = [string.top_mass, *(mass for mass, count in inner for _ in range(count)), string.bit_mass]
    return first_frequency((parameters.segments.top.stiffness, *string.axial_stiffnesses), masses)


def slope_held(parameters: Parameters, string: String) -> float:
    """The steepest fall of the bit's torque with its speed [N m s/rad] with which
    steady drilling is stable; negative where the drive itself makes the string
    oscillate."""
    matrix = torsional_matrix(parameters, string)
    bit = len(matrix) - 1 - int(not parameters.drive.by_torque)
    greatest, inertia = float(np.max(string.torsional_stiffnesses)), float(np.sum(string.inertias))
    bound = sum(string.drags) + 4.0 * math.sqrt(greatest * inertia)
    return float(steepest_fall(matrix, bit, string.inertias[-1], -bound, bound))


def fall_of_torque(parameters: Parameters, wob: Numeric, force: Numeric, speed: Numeric) -> Numeric:
    """How fast the torque on the bit falls with its speed [N m s/rad], in steady
    drilling at a ``speed`` [rad/s]."""
    ahead, behind = (bit_torque(parameters, wob, speed, force, speed * (1 + sign * STEP)) for sign in (1, -1))
    return (behind - ahead) / (2 * STEP * speed)


def onset(parameters: Parameters, operation: Operation, string: String, slope: float) -> float | None:
    """The set speed [rad/s] below which steady drilling is unstable to stick-slip,
    where ``slope`` is the :func:`slope_held`; None where it is stable at every speed,
    or at none."""
    from scipy.optimize import brentq

    force = steady_of(parameters, string, operation.wob, operation.rotary_speed).force

    def instability(speed: Numeric) -> Numeric:
        return fall_of_torque(parameters, operation.wob, force, speed) - slope

    unstable = np.flatnonzero(instability(SPEEDS) > 0.0)
    if not len(unstable) or unstable[-1] == len(SPEEDS) - 1:
        return None
    last = unstable[-1]
    return float(brentq(instability, SPEEDS[last], SPEEDS[last + 1], xtol=1e-10))


def drive_impedance(parameters: Parameters, string: String) -> tuple[Gains, Circuit | None]:
    """The law of the drive, and the circuit of an electric motor, that reflect a
    torsional wave from below (:func:`nsdrill.models.drives.reflection`)."""
    drive = parameters.drive
    if drive.by_torque:
        return law_of(parameters, string), None
    K_I, K_1, K_2, K_3, K_4 = gains_of(parameters, string)[0]
    constant, factor = drive.gear * drive.torque_constant, 1.0 + K_I / drive.resistance
    per_volt = constant / drive.resistance
    circuit = Circuit(
        float((constant * per_volt + per_volt * K_2) / factor),
        float(drive.inductance / drive.resistance / factor),
        float(per_volt * K_1 / factor),
        bool(K_3 or K_4),
    )
    inertia = string.drive_inertia - string.pipe.inertia / 2
    return Gains(float(inertia), 0.0, float(drive.table_damping)), circuit


@dataclass(frozen=True)
class Coefficients:
    """Coefficients of the string as a whole, with its lumped inertia."""

    k_a: float = computed("N/m", "axial stiffness of string and hoist")
    k_t: float = computed("N m/rad", "torsional stiffness of the string")
    J: float = computed("kg m^2", "inertia that has the first torsional frequency with it")
    c_mud: float = computed("N m s/rad", "drag of the mud on the turning string")


COEFFICIENTS = meanings_of(Coefficients)


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """The coefficients at an operating point."""
    string = string_of(parameters, operation.depth)
    first = float(torsional_frequencies(string, 1)[0])
    k_t = float(string.torsional)
    return Coefficients(float(string.axial), k_t, k_t / first**2, float(sum(string.drags)))


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point."""
    string, drive = string_of(parameters, operation.depth), parameters.drive
    steady = steady_of(parameters, string, operation.wob, operation.rotary_speed)
    torque, pipe = float(steady.table_torque), float(impedance(parameters))
    first, second = torsional_frequencies(string, 2)
    slope = slope_held(parameters, string)
    onset_speed = onset(parameters, operation, string, slope)
    law_at_top, circuit = drive_impedance(parameters, string)
    reflected = None if drive.kind == "ideal" else reflection(law_at_top, pipe, float(first), circuit)
    quantities = {
        "axial_free": DerivedQuantity(
            axial_free(parameters, string), "rad/s", "first axial frequency, bit off the rock", "axial"
        ),
        "torsional": DerivedQuantity(float(first), "rad/s", "first torsional frequency, top held"),
        "torsional_2": DerivedQuantity(float(second), "rad/s", "second torsional frequency, top held"),
        "mean_torque": DerivedQuantity(torque, "N m", "steady torque at the surface"),
        "static_twist": DerivedQuantity(float(steady.angles[-1]), "rad", "steady twist of the string"),
        "slope_held": DerivedQuantity(
            slope, "N m s/rad", "steepest fall of the bit's torque with speed that steady drilling withstands"
        ),
        "stick_slip_onset": DerivedQuantity(
            onset_speed, "rad/s", "speed below which steady drilling is unstable to stick-slip"
        ),
        "pipe_impedance": DerivedQuantity(pipe, "N m s/rad", "torsional impedance of the pipe"),
    }
    if drive.kind != "ideal":
        inertia, meaning = float(law_at_top.inertia), "inertia of drive and kelly, as it is felt"
        quantities["drive_inertia"] = DerivedQuantity(inertia, "kg m^2", meaning)
    law = law_of(parameters, string) if drive.kind in LAWS else None
    matrix = torsional_matrix(parameters, string)
    return quantities | quantities_of_drive(drive, matrix, torque, reflected, law, MODES)


def warnings(study: Any, corners: list[Values], format_value: FormatValue) -> list[str | None]:
    """Warnings of a study, whose ``corners`` are the values at the ends of all axes and
    ramps; None where there is nothing to warn of."""
    lowest = min(float(torsional_frequencies(_string(corner), 1)[0]) for corner in corners)
    return [
        overloaded(corners, _steady_torque, format_value),
        swinging(
            study, corners, lambda corner: growing(torsional_matrix(corner.parameters, _string(corner))), format_value
        ),
        few_periods(study, 2 * math.pi / lowest),
    ]


def _string(corner: Values) -> String:
    return string_of(corner.parameters, corner.operation[0])


def _steady_torque(corner: Values) -> float:
    _, wob, speed = corner.operation
    return float(steady_of(corner.parameters, _string(corner), wob, speed).table_torque)


def drive_card(parameters: Parameters, operation: Operation) -> DriveCard:
    """The chart ``drive-card``: every kind of drive with the numbers of the study."""
    study_kind, pipe = parameters.drive.kind, float(impedance(parameters))

    def slope_and_reflection(kind: str, frequency: np.ndarray) -> tuple[float, drives.Wave | None]:
        with_kind = with_values(parameters, {"drive.kind": kind})
        if kind == "dc_motor" != study_kind:
            with_kind = with_values(with_kind, {"drive.gains": None})
        string = string_of(with_kind, operation.depth)
        slope = slope_held(with_kind, string)
        if kind == "ideal":
            return slope, None
        law, circuit = drive_impedance(with_kind, string)
        return slope, reflection(law, pipe, frequency, circuit)

    waves = torsional_frequencies(string_of(parameters, operation.depth), WAVES)
    return drives.drive_card(("ideal", *LAWS, "dc_motor", "lqr"), study_kind, waves, slope_and_reflection)
