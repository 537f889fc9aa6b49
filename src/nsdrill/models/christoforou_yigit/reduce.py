"""From the raw sums of the observer to the features of the results file. Plain numpy,
vectorised over runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.layout import (
    ANCHORS,
    EXTREMES,
    HALF_REPORT,
    RINGS_OF_PEAKS,
    SUMS,
    report_width,
)
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.rhs import INDEX, columns_of
from nsdrill.models.christoforou_yigit.section import returns_of

Array = np.ndarray[Any, np.dtype[np.float64]]


def features(report: Array, table: Array, observe: float, options: Options) -> dict[str, Array]:
    """The features of finished runs, each an array [runs].

    ``report`` holds the observer's outbox columns [runs, report_width], ``table`` the
    lane parameters [runs, parameters], ``observe`` the length of the window [s].
    """
    width = len(HALF_REPORT)
    half_time = 0.5 * observe
    first = dict(zip(HALF_REPORT, report[:, :width].T, strict=True))
    second = dict(zip(HALF_REPORT, report[:, width : 2 * width].T, strict=True))
    whole = _join(first, second)
    p = {name: table[:, i] for name, i in INDEX.items()}

    def rates(half: dict[str, Array]) -> tuple[Array, Array]:
        """Mean bit speed and mean whirl speed of a half."""
        bit = p["drive_speed"] + (half["twist_end"] - half["twist_start"]) / half_time
        whirl = (math.pi * half["half_turns"] + half["angle_end"] - half["angle_start"]) / half_time
        return bit, whirl

    (bit_1, whirl_1), (bit_2, whirl_2) = rates(first), rates(second)
    bit_speed, whirl_speed = 0.5 * (bit_1 + bit_2), 0.5 * (whirl_1 + whirl_2)
    radius_max = np.sqrt(whole["rho_max"])
    penetration = np.maximum(radius_max - p["gap"], 0.0)
    wall_force = p["wall_stiffness"] * penetration
    if options.hertz:  # as the right-hand side has it; numpy's power depends on the processor
        wall_force = wall_force * np.sqrt(penetration)
    with np.errstate(divide="ignore", invalid="ignore"):
        index = 50.0 * (whole["speed_max"] - whole["speed_min"]) / np.abs(bit_speed)
        ratio = whirl_speed / bit_speed
        rolling = np.where(
            whole["turned"] != 0.0, -whole["rolled"] / (whole["turned"] * p["collar_radius"]), 0.0
        )
    return {
        "bit_speed_min": whole["speed_min"],
        "bit_speed_max": whole["speed_max"],
        "bit_speed_mean": bit_speed,
        "stick_slip_index": index,
        "stuck_fraction": _fraction(1.0 - whole["unstuck"] / observe),
        "axial_min": whole["z_min"],
        "axial_max": whole["z_max"],
        "lift_off_fraction": _fraction(1.0 - whole["on_rock"] / observe),
        "bit_force_max": p["rock_stiffness"] * np.maximum(whole["u_max"], 0.0),
        "bit_torque_max": whole["torque_max"],
        "radius_max": radius_max,
        "radius_mean": whole["radius_sum"] / observe,
        "wall_contact_fraction": _fraction(whole["on_wall"] / observe),
        "wall_force_max": wall_force,
        "whirl_speed_mean": whirl_speed,
        "whirl_ratio": ratio,
        "rolling_ratio": rolling,
        "surface_torque_min": -p["torsional_stiffness"] * whole["twist_max"],
        "surface_torque_max": -p["torsional_stiffness"] * whole["twist_min"],
        "surface_torque_mean": -p["torsional_stiffness"] * whole["twist_sum"] / observe,
        "lateral_acceleration_rms": np.sqrt(whole["lateral_square"] / observe),
        "axial_acceleration_rms": np.sqrt(whole["axial_square"] / observe),
        "half_difference": _half_difference(first, second, bit_1, bit_2, p, half_time),
        **(
            _of_the_drive(first, second, whole, p["drive_speed"], observe) if options.driven else {}
        ),
        **(
            {"stabilizer_contact_fraction": _fraction(whole["on_stabilizer"] / observe)}
            if options.stabilizer
            else {}
        ),
        **(
            _mean_position(whole, table[:, columns_of(options).index("weight")], observe)
            if options.weight
            else {}
        ),
    }


def _mean_position(whole: dict[str, Array], weight: Array, observe: float) -> dict[str, Array]:
    """Where the collar is on average; NaN in a vertical hole, of which no side is the
    low one."""
    return {
        f"{name}_mean": np.where(weight > 0.0, whole[f"{name}_sum"] / observe, np.nan)
        for name in ("x", "y")
    }


def _of_the_drive(
    first: dict[str, Array],
    second: dict[str, Array],
    whole: dict[str, Array],
    speed: Array,
    observe: float,
) -> dict[str, Array]:
    """The speed of a drive that is not ideal; ``speed`` is the one it is set to."""
    return {
        "drive_speed_min": whole["drive_min"],
        "drive_speed_max": whole["drive_max"],
        "drive_speed_mean": speed + (second["lag_end"] - first["lag_start"]) / observe,
    }


def peaks(report: Array, count: int) -> Array:
    """The last ``count`` local maxima of bit position, bit speed and radius, oldest
    first, NaN where fewer.

    Shape (runs, 3, count).
    """
    if count == 0:
        return np.empty((len(report), RINGS_OF_PEAKS, 0))
    rings = report[:, 2 * len(HALF_REPORT) : report_width(count)].reshape(
        len(report), RINGS_OF_PEAKS, count + 1
    )
    found = rings[:, :, :1].astype(np.int64)
    place = np.arange(count)
    oldest = np.where(found > count, found % count, 0)
    ordered = np.take_along_axis(rings[:, :, 1:], (oldest + place) % count, axis=2)
    return np.where(place < found, ordered, np.nan)


def section(report: Array, peaks: int, returns: int) -> Array:
    """The last ``returns`` crossings of the Poincare section, oldest first: shape
    (runs, returns, ENTRY)."""
    return returns_of(report[:, report_width(peaks) : report_width(peaks, returns)], returns)


def _join(first: dict[str, Array], second: dict[str, Array]) -> dict[str, Array]:
    joined = {}
    for name in EXTREMES:
        joined[name] = (np.minimum if name.endswith("_min") else np.maximum)(
            first[name], second[name]
        )
    for name in SUMS:
        joined[name] = first[name] + second[name]
    return joined


def _fraction(value: Array) -> Array:
    # The sums of many step lengths miss the window's length by rounding: a run never
    # off the rock is 0, not 1e-16.
    return np.where(value < 1e-12, 0.0, np.where(value > 1.0 - 1e-12, 1.0, value))


def _half_difference(
    first: dict[str, Array],
    second: dict[str, Array],
    bit_1: Array,
    bit_2: Array,
    p: dict[str, Array],
    time: float,
) -> Array:
    """Largest disagreement between the halves: of the extremes of bit position, bit
    speed and radius relative to their range (at least a hundredth of the natural scale:
    gap, lobe amplitude, drive speed), and of the fractions of time."""
    natural = {"z": np.maximum(p["surface_amplitude"], 1e-6), "speed": p["drive_speed"]}
    worst = np.abs(bit_1 - bit_2) / p["drive_speed"]
    for name, size in natural.items():
        low_1, high_1, low_2, high_2 = (
            half[f"{name}_{end}"] for half in (first, second) for end in ("min", "max")
        )
        span = np.maximum(high_1, high_2) - np.minimum(low_1, low_2) + 0.01 * size
        worst = np.maximum(worst, np.maximum(np.abs(low_1 - low_2), np.abs(high_1 - high_2)) / span)
    r_1, r_2 = np.sqrt(first["rho_max"]), np.sqrt(second["rho_max"])
    worst = np.maximum(worst, np.abs(r_1 - r_2) / (np.maximum(r_1, r_2) + 0.01 * p["gap"]))
    for name in ("on_rock", "unstuck", "on_wall", "on_stabilizer"):
        worst = np.maximum(worst, np.abs(first[name] - second[name]) / time)
    return worst


assert set(HALF_REPORT) == {*EXTREMES, *SUMS, *ANCHORS, "twist_end", "angle_end", "lag_end"}
