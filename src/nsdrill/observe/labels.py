"""Labels that every model has: critical responses and their severities, from the
features that it measures.

A response whose feature a model does not measure is one that it cannot show.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.observe.motion import classify_motion, period
from nsdrill.observe.thresholds import Thresholds
from nsdrill.variables import BIT_BOUNCE, OK, PERIODIC, STICK_SLIP, WHIRL

Array = np.ndarray[Any, np.dtype[Any]]


def responses(features: Mapping[str, Array], t: Thresholds) -> Array:
    """The critical responses as a sum of bits, from the features that decide on them:
    those of ``lift_off_fraction``, ``stick_slip_index`` and ``wall_contact_fraction``
    that are there."""
    found: Any = np.int64(0)
    if "lift_off_fraction" in features:
        found = found + BIT_BOUNCE * (
            features["lift_off_fraction"] > t.bit_bounce.lift_off_fraction
        )
    if "stick_slip_index" in features:
        found = found + STICK_SLIP * (index_of(features) > t.stick_slip.stick_slip_index)
    if "wall_contact_fraction" in features:
        found = found + WHIRL * (features["wall_contact_fraction"] > t.whirl.wall_contact_fraction)
    return np.asarray(found)


def index_of(features: Mapping[str, Array]) -> Array:
    """The stick-slip index, infinite where the bit does not turn at all (mean speed
    zero): it sticks."""
    return np.nan_to_num(features["stick_slip_index"], nan=np.inf)


def severities(features: Mapping[str, Array], response: Array, t: Thresholds) -> dict[str, Array]:
    """The severity bands of the responses whose features are there."""
    found = {}
    if "stick_slip_index" in features:
        s = t.stick_slip
        bands = (s.oscillation_index, s.medium_index, s.stall_index, s.severe_index)
        found["stick_slip_severity"] = np.digitize(index_of(features), bands, right=True)
    if "lift_off_fraction" in features:
        b = t.bit_bounce
        off = (b.light_fraction, b.moderate_fraction, b.strong_fraction, b.severe_fraction)
        found["bounce_severity"] = grade(
            features["lift_off_fraction"], off, response & BIT_BOUNCE > 0
        )
    if "lateral_acceleration_rms" in features:
        w = t.whirl
        shaken = (
            w.light_acceleration,
            w.moderate_acceleration,
            w.strong_acceleration,
            w.severe_acceleration,
        )
        found["whirl_severity"] = grade(
            features["lateral_acceleration_rms"], shaken, response & WHIRL > 0
        )
    return found


def grade(values: Array, bounds: tuple[float, ...], present: Array) -> Array:
    """The band of each value, 0 to 4, a bound itself in the lower one; at least 1 where
    the response is present, so that no grade says "none" of a critical response,
    wherever the user has put its threshold."""
    return np.asarray(
        np.maximum(np.digitize(np.nan_to_num(values, nan=0.0), bounds, right=True), present)
    )


def motions(
    features: Mapping[str, Array],
    status: Array,
    settled: Array,
    returns: Array,
    state_scales: Array,
    still: Array,
    t: Thresholds,
) -> dict[str, Array]:
    """The labels ``motion`` and ``period`` of runs with these ``returns`` (...,
    returns, states) to the section, NaN where there are none; ``state_scales`` (...,
    states) are the natural scales, ``still`` says which runs do not move."""
    count = np.count_nonzero(np.isfinite(returns[..., 0]), axis=-1)
    flat = returns.reshape(-1, *returns.shape[-2:])
    ok = status == OK
    found = np.where(
        ok, period(flat, state_scales.reshape(len(flat), -1), t.motion).reshape(ok.shape), 0
    ).astype(np.int16)
    motion = classify_motion(features, status, settled, found, count, still, t.motion)
    return {"motion": motion, "period": np.where(motion == PERIODIC, found, 0).astype(np.int16)}
