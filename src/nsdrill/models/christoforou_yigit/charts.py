"""The numbers of the charts that need no integration: critical speeds, the reflection of
torsional waves by drives, and the tuning of a soft-torque drive.

The critical speeds are along the values of one axis; the caller gives parameters and
operation of each value.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nsdrill.models import drive_laws
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.derived_quantities import cutting_at
from nsdrill.models.christoforou_yigit.drives import impedance, linear_of
from nsdrill.models.christoforou_yigit.further_quantities import (
    WAVES,
    axial_waves,
    lateral_frequencies,
    torsional_waves,
)
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.table import drilling_at, string_of
from nsdrill.models.drive_laws import reflection
from nsdrill.models.numbers import CriticalSpeeds, DriveCard, DriveTuning
from nsdrill.models.operation import Operation
from nsdrill.models.tree import with_values

Point = tuple[Parameters, Operation]
MATCHING = (0.5, 8.0)  # range of the tuning map, in impedances of the pipe
TUNED = (0.5, 2.0)  # range of its frequencies, over that of the string
CELLS = 49


def critical_speeds(axis: str, x: np.ndarray, points: Sequence[Point]) -> CriticalSpeeds:
    """The chart ``critical-speeds`` of these points."""
    lateral, torsional, axial, on_rock, cutting = [], [], [], [], []
    for parameters, operation in points:
        k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
        lateral.append(lateral_frequencies(parameters, operation, k, float(k.m_l)))
        torsional.append(torsional_waves(parameters, operation.depth, WAVES))
        axial.append(axial_waves(parameters, operation.depth, WAVES))
        on_rock.append(axial_waves(parameters, operation.depth, WAVES, on_rock=True))
        if parameters.bit.rock.regenerative:
            cutting.append(cutting_at(parameters, operation).threshold.speed or math.nan)
    bit, modes = points[0][0].bit, points[0][0].modes
    lobes = bit.lobes
    shaken = "frozen" if bit.rock.regenerative else modes.axial  # nothing excites these without lobes

    def of_motion(speeds: list[np.ndarray], mode: str) -> np.ndarray:
        """The speeds [modes, values], none of a frozen motion."""
        return np.transpose(speeds)[: 0 if mode == "frozen" else None]

    return CriticalSpeeds(
        axis,
        x,
        lobes,
        of_motion(lateral, modes.lateral),
        of_motion(torsional, modes.torsional),
        of_motion(axial, shaken) / lobes,
        of_motion(on_rock, shaken) / lobes,
        np.reshape(cutting, (-1, len(points))),
    )


def drive_card(parameters: Parameters, operation: Operation) -> DriveCard:
    """The chart ``drive-card``: every kind of drive with the parameters of the
    study."""
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)

    def slope_and_reflection(kind: str, frequency: np.ndarray) -> tuple[float, drive_laws.Wave | None]:
        with_drive = with_values(parameters, {"drive.kind": kind})
        drilling = drilling_at(with_drive, operation)
        slope = drilling.slope_held
        if kind in ("ideal", "lqr") or drilling.bends:
            return slope, None
        law, motor = linear_of(with_drive, k, drilling)
        return slope, reflection(law, float(impedance(with_drive)), frequency, motor)

    waves = torsional_waves(parameters, operation.depth, WAVES)
    return drive_laws.drive_card(("ideal", *drive_laws.LAWS, "lqr"), parameters.drive.kind, waves, slope_and_reflection)


def drive_tuning(parameters: Parameters, operation: Operation) -> DriveTuning:
    """The chart ``drive-tuning``, for the inertia of the study's drive, less what its
    controller compensates."""
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    lumped = math.sqrt(float(k.k_t) / float(k.J))
    matching, frequency = np.geomspace(*MATCHING, CELLS), lumped * np.geomspace(*TUNED, CELLS)
    slopes = slopes_held_by_soft_torque(parameters, operation, matching, frequency)
    drive = parameters.drive
    tuned = lumped if drive.frequency is None else 2 * math.pi * drive.frequency
    of_study = (drive.matching, tuned) if drive.kind == "soft_torque" else None
    best = _best(parameters, operation, matching, frequency, slopes)
    return DriveTuning(matching, frequency, slopes, best, lumped, of_study)


def _best(
    parameters: Parameters, operation: Operation, matching: np.ndarray, frequency: np.ndarray, slopes: np.ndarray
) -> tuple[float, float, float]:
    """Matching, frequency and slope of the best point within the map. The search begins
    at the best cell: where two pairs of eigenvalues meet there is a sharp ridge, whose
    summit lies between the cells."""
    from scipy.optimize import minimize

    row, column = np.unravel_index(np.argmax(slopes), slopes.shape)
    low, high = np.log([matching[0], frequency[0]]), np.log([matching[-1], frequency[-1]])

    def negative_slope(logarithms: np.ndarray) -> float:
        b, f = np.exp(np.clip(logarithms, low, high))
        return -float(slopes_held_by_soft_torque(parameters, operation, np.array([b]), np.array([f]))[0, 0])

    start = np.log([matching[column], frequency[row]])
    optimum = minimize(
        negative_slope, start, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-6, "maxiter": 800}
    )
    b, f = np.exp(np.clip(optimum.x, low, high))
    return float(b), float(f), -float(optimum.fun)


def slopes_held_by_soft_torque(
    parameters: Parameters, operation: Operation, matching: np.ndarray, frequency: np.ndarray
) -> np.ndarray:
    """The slope [N m s/rad] that a soft-torque drive holds for each of these matchings
    and frequencies [rad/s]: array [frequencies, matchings]."""
    with_drive = with_values(
        parameters,
        {
            "drive.kind": "soft_torque",
            "drive.matching": np.asarray(matching, float)[None, :],
            "drive.frequency": np.asarray(frequency, float)[:, None] / (2 * math.pi),
        },
    )
    string = string_of(with_drive, operation.depth, operation.wob)
    return string.withstood(string.untwisted(operation.rotary_speed))
