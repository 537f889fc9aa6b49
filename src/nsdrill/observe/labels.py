"""Labels of every model: critical responses and their severities, from its features.

A model has no response whose feature it does not measure.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from nsdrill.data import Array
from nsdrill.observe.motion import classify_motion, period
from nsdrill.observe.thresholds import Thresholds
from nsdrill.variables import BIT_BOUNCE, CHECKS, OK, PENDING, PERIODIC, STICK_SLIP, WHIRL


def responses(features: Mapping[str, Array], t: Thresholds) -> Array:
    """The critical responses as a sum of bits, from those of the features
    ``lift_off_fraction``, ``stick_slip_index`` and ``wall_contact_fraction`` that
    ``features`` has."""
    bits: Any = np.int64(0)
    if "lift_off_fraction" in features:
        bits = bits + BIT_BOUNCE * (features["lift_off_fraction"] > t.bit_bounce.lift_off_fraction)
    if "stick_slip_index" in features:
        bits = bits + STICK_SLIP * (index_of(features) > t.stick_slip.stick_slip_index)
    if "wall_contact_fraction" in features:
        bits = bits + WHIRL * (features["wall_contact_fraction"] > t.whirl.wall_contact_fraction)
    return np.asarray(bits)


def index_of(features: Mapping[str, Array]) -> Array:
    """The stick-slip index, infinite where the bit does not rotate at all (mean speed
    zero): it is stuck."""
    return np.nan_to_num(features["stick_slip_index"], nan=np.inf)


def severities(features: Mapping[str, Array], response: Array, t: Thresholds) -> dict[str, Array]:
    """The severity bands of the responses whose features the model measures."""
    labels = {}
    if "stick_slip_index" in features:
        s = t.stick_slip
        bands = (s.oscillation_index, s.medium_index, s.stall_index, s.severe_index)
        labels["stick_slip_severity"] = np.digitize(index_of(features), bands, right=True)
    if "lift_off_fraction" in features:
        b = t.bit_bounce
        fractions = (b.light_fraction, b.moderate_fraction, b.strong_fraction, b.severe_fraction)
        labels["bounce_severity"] = grade(features["lift_off_fraction"], fractions, response & BIT_BOUNCE > 0)
    if "lateral_acceleration_rms" in features:
        w = t.whirl
        accelerations = (w.light_acceleration, w.moderate_acceleration, w.strong_acceleration, w.severe_acceleration)
        labels["whirl_severity"] = grade(features["lateral_acceleration_rms"], accelerations, response & WHIRL > 0)
    return labels


def grade(values: Array, bounds: tuple[float, ...], present: Array) -> Array:
    """The band of each value, 0 to 4, where a bound belongs to the band below it. It is
    at least 1 where the response is ``present``, so that no critical response has the
    severity "none", whatever its threshold."""
    return np.asarray(np.maximum(np.digitize(np.nan_to_num(values, nan=0.0), bounds, right=True), present))


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
    states) are the natural scales, ``still`` is true for runs at rest."""
    count = np.count_nonzero(np.isfinite(returns[..., 0]), axis=-1)
    flat = returns.reshape(-1, *returns.shape[-2:])
    ok = status == OK
    periods = np.where(ok, period(flat, state_scales.reshape(len(flat), -1), t.motion).reshape(ok.shape), 0).astype(
        np.int16
    )
    motion = classify_motion(features, status, settled, periods, count, still, t.motion)
    return {"motion": motion, "period": np.where(motion == PERIODIC, periods, 0).astype(np.int16)}


# Whether the response of a point holds in more accurate runs: labels from the results
# of the point's checks.
# There are two checks: ``tight``, the same run with a smaller tolerance, and ``long``,
# the run continued for the same time again.


UNCHECKED, AGREES, FEATURES_DIFFER, RESPONSE_DIFFERS, CHECK_FAILED = range(5)  # verdicts


def trust_labels(
    checks: Mapping[str, Array],
    response: Array,
    thresholds: Thresholds,
    responses: Callable[[Mapping[str, Array], Thresholds], Array],
) -> dict[str, Array]:
    """The labels ``tight_response``, ``long_response`` and ``trusted`` of points with
    this ``response``; ``checks`` has the status of their checks, the features from
    which ``responses`` are determined, and the differences."""
    labels = {}
    trusted = np.ones(np.shape(response), dtype=bool)
    for check in CHECKS:
        succeeded = checks[f"{check}_status"] == OK
        prefix, other = f"{check}_", (f"{check}_status", f"{check}_difference", f"{check}_response")
        measured = {
            name.removeprefix(prefix): checks[name] for name in checks if name.startswith(prefix) and name not in other
        }
        labels[f"{check}_response"] = np.where(succeeded, responses(measured, thresholds), 0).astype(np.int8)
        with np.errstate(invalid="ignore"):
            near = checks[f"{check}_difference"] <= thresholds.trust.tolerance
        trusted &= succeeded & near & (labels[f"{check}_response"] == response)
    return {**labels, "trusted": trusted.astype(np.int8)}


class ArraysByName(Protocol):
    """Arrays by name."""

    def __getitem__(self, name: str, /) -> Array: ...


def verdict(values: ArraysByName) -> Array:
    """The result of the checks of each point, from ``response``, the labels of
    :func:`trust_labels` and the status of the checks:

    - :data:`UNCHECKED`;
    - :data:`AGREES`;
    - :data:`FEATURES_DIFFER`: the response is the same and the features are not
      (chaotic motion, or one that has not settled);
    - :data:`RESPONSE_DIFFERS`;
    - :data:`CHECK_FAILED`: a check failed, and no other gave another response.
    """
    shape = np.shape(values["trusted"])
    checked, succeeded, differs = (np.ones(shape, dtype=bool), np.ones(shape, dtype=bool), np.zeros(shape, dtype=bool))
    for check in CHECKS:
        ok = values[f"{check}_status"] == OK
        checked &= values[f"{check}_status"] != PENDING
        succeeded &= ok
        differs |= ok & (values[f"{check}_response"] != values["response"])
    return np.select(
        [~checked, values["trusted"] == 1, differs, succeeded],
        [UNCHECKED, AGREES, RESPONSE_DIFFERS, FEATURES_DIFFER],
        CHECK_FAILED,
    )
