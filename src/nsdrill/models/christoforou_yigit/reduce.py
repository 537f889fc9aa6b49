"""The features of the results file from the outcome of the observer. Plain numpy,
vectorised over runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.layout import (
    ANCHORS,
    EXTREMES,
    HALF_OUTCOME,
    RINGS_OF_PEAKS,
    SUMS,
    outcome_width,
)
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.rhs import INDEX, columns_of
from nsdrill.models.christoforou_yigit.section import returns_of

Array = np.ndarray[Any, np.dtype[np.float64]]


def features(outcome: Array, table: Array, observe: float, options: Options) -> dict[str, Array]:
    """The features of finished runs, each an array [runs].

    ``outcome`` holds the observer's columns of the outbox [runs, outcome_width],
    ``table`` the lane parameters [runs, parameters], ``observe`` is the observation
    time [s].
    """
    width = len(HALF_OUTCOME)
    half_time = 0.5 * observe
    first = dict(zip(HALF_OUTCOME, outcome[:, :width].T, strict=True))
    second = dict(zip(HALF_OUTCOME, outcome[:, width : 2 * width].T, strict=True))
    total = _joined(first, second)
    p = {name: table[:, i] for name, i in INDEX.items()}

    def rates(half: dict[str, Array]) -> tuple[Array, Array]:
        """Mean bit speed and mean whirl speed of a half [rad/s]."""
        bit = p["drive_speed"] + (half["twist_end"] - half["twist_start"]) / half_time
        whirl = (
            math.pi * half["half_revolutions"] + half["angle_end"] - half["angle_start"]
        ) / half_time
        return bit, whirl

    (bit_1, whirl_1), (bit_2, whirl_2) = rates(first), rates(second)
    bit_speed, whirl_speed = 0.5 * (bit_1 + bit_2), 0.5 * (whirl_1 + whirl_2)
    radius_max = np.sqrt(total["rho_max"])
    penetration = np.maximum(radius_max - p["gap"], 0.0)
    wall_force = p["wall_stiffness"] * penetration
    if (
        options.hertz
    ):  # as in the right-hand side; the bits of numpy's power depend on the processor
        wall_force = wall_force * np.sqrt(penetration)
    with np.errstate(divide="ignore", invalid="ignore"):
        index = 50.0 * (total["speed_max"] - total["speed_min"]) / np.abs(bit_speed)
        ratio = whirl_speed / bit_speed
        rolling = np.where(
            total["rotated"] != 0.0, -total["rolled"] / (total["rotated"] * p["collar_radius"]), 0.0
        )
    return {
        "bit_speed_min": total["speed_min"],
        "bit_speed_max": total["speed_max"],
        "bit_speed_mean": bit_speed,
        "stick_slip_index": index,
        "stuck_fraction": _fraction(1.0 - total["unstuck"] / observe),
        "axial_min": total["z_min"],
        "axial_max": total["z_max"],
        "lift_off_fraction": _fraction(1.0 - total["on_rock"] / observe),
        "bit_force_max": p["rock_stiffness"] * np.maximum(total["u_max"], 0.0),
        "bit_torque_max": total["torque_max"],
        "radius_max": radius_max,
        "radius_mean": total["radius_sum"] / observe,
        "wall_contact_fraction": _fraction(total["on_wall"] / observe),
        "wall_force_max": wall_force,
        "whirl_speed_mean": whirl_speed,
        "whirl_ratio": ratio,
        "rolling_ratio": rolling,
        "surface_torque_min": -p["torsional_stiffness"] * total["twist_max"],
        "surface_torque_max": -p["torsional_stiffness"] * total["twist_min"],
        "surface_torque_mean": -p["torsional_stiffness"] * total["twist_sum"] / observe,
        "lateral_acceleration_rms": np.sqrt(total["lateral_square"] / observe),
        "axial_acceleration_rms": np.sqrt(total["axial_square"] / observe),
        "half_difference": _half_difference(first, second, bit_1, bit_2, p, half_time),
        **(
            _drive_features(first, second, total, p["drive_speed"], observe)
            if options.driven
            else {}
        ),
        **(
            {"stabilizer_contact_fraction": _fraction(total["on_stabilizer"] / observe)}
            if options.stabilizer
            else {}
        ),
        **(
            _mean_position(total, table[:, columns_of(options).index("weight")], observe)
            if options.weight
            else {}
        ),
    }


def _mean_position(total: dict[str, Array], weight: Array, observe: float) -> dict[str, Array]:
    """The mean position of the collar [m]; NaN in a vertical hole, which has no low
    side."""
    return {
        f"{name}_mean": np.where(weight > 0.0, total[f"{name}_sum"] / observe, np.nan)
        for name in ("x", "y")
    }


def _drive_features(
    first: dict[str, Array],
    second: dict[str, Array],
    total: dict[str, Array],
    speed: Array,
    observe: float,
) -> dict[str, Array]:
    """Least, greatest and mean speed [rad/s] of a drive that is not ideal; ``speed`` is
    the set speed."""
    return {
        "drive_speed_min": total["drive_min"],
        "drive_speed_max": total["drive_max"],
        "drive_speed_mean": speed + (second["lag_end"] - first["lag_start"]) / observe,
    }


def peaks(outcome: Array, count: int) -> Array:
    """The last ``count`` local maxima of bit position, bit speed and radius, oldest
    first, NaN where fewer.

    Shape (runs, 3, count).
    """
    if count == 0:
        return np.empty((len(outcome), RINGS_OF_PEAKS, 0))
    rings = outcome[:, 2 * len(HALF_OUTCOME) : outcome_width(count)].reshape(
        len(outcome), RINGS_OF_PEAKS, count + 1
    )
    counts = rings[:, :, :1].astype(np.int64)
    index = np.arange(count)
    oldest = np.where(counts > count, counts % count, 0)
    ordered = np.take_along_axis(rings[:, :, 1:], (oldest + index) % count, axis=2)
    return np.where(index < counts, ordered, np.nan)


def section(outcome: Array, peaks: int, returns: int) -> Array:
    """The last ``returns`` crossings of the Poincare section, oldest first: shape
    (runs, returns, ENTRY)."""
    return returns_of(outcome[:, outcome_width(peaks) : outcome_width(peaks, returns)], returns)


def _joined(first: dict[str, Array], second: dict[str, Array]) -> dict[str, Array]:
    total = {}
    for name in EXTREMES:
        total[name] = (np.minimum if name.endswith("_min") else np.maximum)(
            first[name], second[name]
        )
    for name in SUMS:
        total[name] = first[name] + second[name]
    return total


def _fraction(value: Array) -> Array:
    # The sum of many step lengths differs from the observation time by rounding: a run
    # that is never off the rock has 0, not 1e-16.
    return np.where(value < 1e-12, 0.0, np.where(value > 1.0 - 1e-12, 1.0, value))


def _half_difference(
    first: dict[str, Array],
    second: dict[str, Array],
    bit_1: Array,
    bit_2: Array,
    p: dict[str, Array],
    half_time: float,
) -> Array:
    """The largest difference between the halves: of the mean bit speed relative to the
    set speed, of the extremes of bit position, bit speed and radius relative to their
    range (plus a hundredth of the natural scale: lobe amplitude, set speed, gap), and
    of the fractions of time. ``half_time`` [s] is the length of a half."""
    natural_scales = {"z": np.maximum(p["surface_amplitude"], 1e-6), "speed": p["drive_speed"]}
    worst = np.abs(bit_1 - bit_2) / p["drive_speed"]
    for name, scale in natural_scales.items():
        low_1, high_1, low_2, high_2 = (
            half[f"{name}_{end}"] for half in (first, second) for end in ("min", "max")
        )
        range_ = np.maximum(high_1, high_2) - np.minimum(low_1, low_2) + 0.01 * scale
        worst = np.maximum(
            worst, np.maximum(np.abs(low_1 - low_2), np.abs(high_1 - high_2)) / range_
        )
    r_1, r_2 = np.sqrt(first["rho_max"]), np.sqrt(second["rho_max"])
    worst = np.maximum(worst, np.abs(r_1 - r_2) / (np.maximum(r_1, r_2) + 0.01 * p["gap"]))
    for name in ("on_rock", "unstuck", "on_wall", "on_stabilizer"):
        worst = np.maximum(worst, np.abs(first[name] - second[name]) / half_time)
    return worst


assert set(HALF_OUTCOME) == {*EXTREMES, *SUMS, *ANCHORS, "twist_end", "angle_end", "lag_end"}
