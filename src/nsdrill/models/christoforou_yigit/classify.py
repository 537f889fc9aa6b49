"""From features to labels: critical responses, their kinds and severities. Plain numpy,
which can be repeated on the features of a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.observed import in_the_bit_frame
from nsdrill.observe.labels import motions, responses, severities
from nsdrill.observe.thresholds import Thresholds
from nsdrill.variables import BACKWARD, BACKWARD_ROLLING, FORWARD, IRREGULAR, LOW_SIDE, NO_WHIRL, OK, WHIRL

Array = np.ndarray[Any, np.dtype[Any]]


def classify(
    features: Mapping[str, Array], status: Array, thresholds: Thresholds, state_scales: Array | None = None
) -> dict[str, Array]:
    """The labels ``response``, ``whirl_kind``, the three severities and ``settled`` of
    runs with these features; and, where the features include returns to the Poincare
    section, ``motion`` and ``period``, for which the natural scales of the states
    ``state_scales`` (..., 8) are needed.

    All arrays have one shape; runs that did not end well (``status`` not ok) get zeros.
    A bit that does not rotate (mean speed zero, an infinite or undefined index) sticks.
    """
    t = thresholds
    ok = status == OK
    response = responses(features, t)
    whirl = response & WHIRL > 0
    ratio = np.nan_to_num(features["whirl_ratio"])
    rolling = (np.abs(features["rolling_ratio"] - 1.0) <= t.whirl.rolling_tolerance) & (
        features["wall_contact_fraction"] >= t.whirl.rolling_contact
    )
    no_precession = np.abs(ratio) < t.whirl.direction
    low_side = (
        no_precession & (features["wall_contact_fraction"] >= t.whirl.rolling_contact) & _on_low_side(features, whirl)
    )
    kind = np.select(
        [~whirl, rolling, low_side, no_precession, ratio > 0.0],
        [NO_WHIRL, BACKWARD_ROLLING, LOW_SIDE, IRREGULAR, FORWARD],
        default=BACKWARD,
    )
    settled = features["half_difference"] <= t.settled.tolerance
    labels = {"response": response, "whirl_kind": kind, **severities(features, response, t), "settled": settled}
    labels = {name: np.where(ok, value, 0).astype(np.int8) for name, value in labels.items()}
    if "section_radius" in features and state_scales is not None:
        at_rest = still(features, state_scales, t.motion.absolute)
        labels |= motions(features, status, labels["settled"], in_the_bit_frame(features), state_scales, at_rest, t)
    return labels


def _on_low_side(features: Mapping[str, Array], whirl: Array) -> Array:
    """Whether the mean position of the collar is in the lower half of an inclined hole;
    false for a vertical one."""
    with np.errstate(invalid="ignore"):
        return np.asarray(features["y_mean"] < 0.0) if "y_mean" in features else np.zeros(whirl.shape, bool)


def still(features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
    """Whether bit and collar move by no more than ``absolute`` times the natural
    ``state_scales`` (..., 8) of their states."""
    least = np.nan_to_num(features["section_radius"], nan=np.inf).min(axis=-1)
    return np.asarray(
        (features["axial_max"] - features["axial_min"] <= absolute * state_scales[..., 4])
        & (features["bit_speed_max"] - features["bit_speed_min"] <= absolute * state_scales[..., 7])
        & (features["radius_max"] - least <= absolute * state_scales[..., 0])
    )
