"""From features to labels: which critical responses, of which kind, how severe. Plain numpy, rerunnable on a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.section import in_the_bit_frame
from nsdrill.observe.motion import classify_motion, period
from nsdrill.observe.thresholds import Thresholds
from nsdrill.variables import (
    BACKWARD,
    BACKWARD_ROLLING,
    BIT_BOUNCE,
    FORWARD,
    IRREGULAR,
    LOW_SIDE,
    NO_WHIRL,
    OK,
    PERIODIC,
    STICK_SLIP,
    WHIRL,
)

Array = np.ndarray[Any, np.dtype[Any]]


def responses(features: Mapping[str, Array], t: Thresholds) -> Array:
    """The critical responses as a sum of bits, from the three features that decide on them."""
    bounce = features["lift_off_fraction"] > t.bit_bounce.lift_off_fraction
    stick_slip = np.nan_to_num(features["stick_slip_index"], nan=np.inf) > t.stick_slip.stick_slip_index
    whirl = features["wall_contact_fraction"] > t.whirl.wall_contact_fraction
    return np.asarray(BIT_BOUNCE * bounce + STICK_SLIP * stick_slip + WHIRL * whirl)


def classify(
    features: Mapping[str, Array], status: Array, thresholds: Thresholds, sizes: Array | None = None
) -> dict[str, Array]:
    """The labels ``response``, ``whirl_kind``, the three severities and ``settled`` of runs with these features;
    and, where the features include returns to the Poincare section, ``motion`` and ``period``, for which the natural
    sizes of the states ``sizes`` (..., 8) are needed.

    All arrays have one shape; runs that did not end well (``status`` not ok) get zeros. A bit that does not turn at all
    (mean speed zero, an infinite or undefined index) sticks.
    """
    t = thresholds
    ok = status == OK
    index = np.nan_to_num(features["stick_slip_index"], nan=np.inf)
    response = responses(features, t)
    bounce, whirl = response & BIT_BOUNCE > 0, response & WHIRL > 0

    ratio = np.nan_to_num(features["whirl_ratio"])
    rolling = (np.abs(features["rolling_ratio"] - 1.0) <= t.whirl.rolling_tolerance) & (
        features["wall_contact_fraction"] >= t.whirl.rolling_contact
    )
    still_around = np.abs(ratio) < t.whirl.direction
    low_side = still_around & (features["wall_contact_fraction"] >= t.whirl.rolling_contact) & _low(features, whirl)
    kind = np.select(
        [~whirl, rolling, low_side, still_around, ratio > 0.0],
        [NO_WHIRL, BACKWARD_ROLLING, LOW_SIDE, IRREGULAR, FORWARD],
        default=BACKWARD,
    )
    bands = (
        t.stick_slip.oscillation_index,
        t.stick_slip.medium_index,
        t.stick_slip.stall_index,
        t.stick_slip.severe_index,
    )
    severity = np.digitize(index, bands, right=True)
    off = (
        t.bit_bounce.light_fraction,
        t.bit_bounce.moderate_fraction,
        t.bit_bounce.strong_fraction,
        t.bit_bounce.severe_fraction,
    )
    shaken = (
        t.whirl.light_acceleration,
        t.whirl.moderate_acceleration,
        t.whirl.strong_acceleration,
        t.whirl.severe_acceleration,
    )
    settled = features["half_difference"] <= t.settled.tolerance
    labels = {
        "response": response,
        "whirl_kind": kind,
        "stick_slip_severity": severity,
        "bounce_severity": _grade(features["lift_off_fraction"], off, bounce),
        "whirl_severity": _grade(features["lateral_acceleration_rms"], shaken, whirl),
        "settled": settled,
    }
    labels = {name: np.where(ok, value, 0).astype(np.int8) for name, value in labels.items()}
    if "section_radius" in features and sizes is not None:
        returns = in_the_bit_frame(features)
        flat = returns.reshape(-1, *returns.shape[-2:])
        found = np.where(ok, period(flat, sizes.reshape(-1, 8), t.motion).reshape(ok.shape), 0).astype(np.int16)
        count = np.count_nonzero(np.isfinite(features["section_radius"]), axis=-1)
        labels["motion"] = classify_motion(
            features, status, labels["settled"], found, count, still(features, sizes, t.motion.absolute), t.motion
        )
        labels["period"] = np.where(labels["motion"] == PERIODIC, found, 0).astype(np.int16)
    return labels


def _low(features: Mapping[str, Array], like: Array) -> Array:
    """Whether the collar is on average in the lower half of an inclined hole; nowhere in a vertical one."""
    with np.errstate(invalid="ignore"):
        return np.asarray(features["y_mean"] < 0.0) if "y_mean" in features else np.zeros(like.shape, bool)


def still(features: Mapping[str, Array], sizes: Array, absolute: float) -> Array:
    """Whether bit and collar do not move beyond ``absolute`` times the natural ``sizes`` (..., 8) of their states."""
    least = np.nan_to_num(features["section_radius"], nan=np.inf).min(axis=-1)
    return np.asarray(
        (features["axial_max"] - features["axial_min"] <= absolute * sizes[..., 4])
        & (features["bit_speed_max"] - features["bit_speed_min"] <= absolute * sizes[..., 7])
        & (features["radius_max"] - least <= absolute * sizes[..., 0])
    )


def _grade(values: Array, bounds: tuple[float, ...], present: Array) -> Array:
    """The band of each value, 0 to 4, a bound itself in the lower one; at least 1 where the response is present, so
    that no grade says "none" of a critical response, wherever the user has put its threshold."""
    return np.maximum(np.digitize(np.nan_to_num(values, nan=0.0), bounds, right=True), present)
