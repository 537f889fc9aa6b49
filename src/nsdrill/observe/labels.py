"""Labels of every model: the kind of motion, and the verdict of the checks of a point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from nsdrill.data import Array
from nsdrill.observe.motion import classify_motion, period
from nsdrill.observe.thresholds import Motion
from nsdrill.variables import CHECKS, OK, PENDING, PERIODIC


def motions(
    features: Mapping[str, Array],
    status: Array,
    settled: Array,
    returns: Array,
    state_scales: Array,
    still: Array,
    t: Motion,
) -> dict[str, Array]:
    """The labels ``motion`` and ``period`` of runs with these ``returns`` (...,
    returns, states) to the section, NaN where there are none; ``state_scales`` (...,
    states) are the natural scales, ``still`` is true for runs at rest."""
    count = np.count_nonzero(np.isfinite(returns[..., 0]), axis=-1)
    flat = returns.reshape(-1, *returns.shape[-2:])
    ok = status == OK
    periods = np.where(ok, period(flat, state_scales.reshape(len(flat), -1), t).reshape(ok.shape), 0).astype(np.int16)
    motion = classify_motion(features, status, settled, periods, count, still, t)
    return {"motion": motion, "period": np.where(motion == PERIODIC, periods, 0).astype(np.int16)}


# Whether the response of a point holds in more accurate runs: labels from the results
# of the point's checks.
# There are two checks: ``tight``, the same run with a smaller tolerance, and ``long``,
# the run continued for the same time again.


UNCHECKED, AGREES, FEATURES_DIFFER, RESPONSE_DIFFERS, CHECK_FAILED = range(5)  # verdicts


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
