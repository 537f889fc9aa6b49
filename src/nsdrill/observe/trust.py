"""Whether a point holds when it is run more carefully: labels made from what the checks
of the point measured.

Two checks: ``tight``, the same run with a smaller tolerance, and ``long``, the run
continued for as long again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from nsdrill.observe.thresholds import Thresholds
from nsdrill.variables import CHECKS, OK, PENDING

Array = np.ndarray[Any, np.dtype[Any]]
UNCHECKED, AGREES, FEATURES_DIFFER, RESPONSE_DIFFERS, CHECK_FAILED = range(5)  # verdicts


def trust_labels(
    found: Mapping[str, Array],
    response: Array,
    thresholds: Thresholds,
    responses: Callable[[Mapping[str, Array], Thresholds], Array],
) -> dict[str, Array]:
    """The labels ``tight_response``, ``long_response`` and ``trusted`` of points with
    this ``response``; ``found`` holds how their checks ended, the features that the
    ``responses`` are made from, and the differences."""
    labels = {}
    trusted = np.ones(np.shape(response), dtype=bool)
    for check in CHECKS:
        ended = found[f"{check}_status"] == OK
        start, other = f"{check}_", (f"{check}_status", f"{check}_difference", f"{check}_response")
        measured = {
            name.removeprefix(start): found[name]
            for name in found
            if name.startswith(start) and name not in other
        }
        labels[f"{check}_response"] = np.where(ended, responses(measured, thresholds), 0).astype(
            np.int8
        )
        with np.errstate(invalid="ignore"):
            near = found[f"{check}_difference"] <= thresholds.trust.tolerance
        trusted &= ended & near & (labels[f"{check}_response"] == response)
    return {**labels, "trusted": trusted.astype(np.int8)}


class Named(Protocol):
    """Arrays by name."""

    def __getitem__(self, name: str, /) -> Array: ...


def verdict(values: Named) -> Array:
    """What the checks say of each point: :data:`UNCHECKED`; :data:`AGREES`;
    :data:`FEATURES_DIFFER`, the response holds and its numbers do not (chaotic motion,
    or one that has not settled); :data:`RESPONSE_DIFFERS`; and :data:`CHECK_FAILED`,
    where a check did not end well and none that did found another response. From
    ``response``, the labels of :func:`trust_labels` and the status of the checks."""
    shape = np.shape(values["trusted"])
    checked, ended, differs = (
        np.ones(shape, dtype=bool),
        np.ones(shape, dtype=bool),
        np.zeros(shape, dtype=bool),
    )
    for check in CHECKS:
        ok = values[f"{check}_status"] == OK
        checked &= values[f"{check}_status"] != PENDING
        ended &= ok
        differs |= ok & (values[f"{check}_response"] != values["response"])
    return np.select(
        [~checked, values["trusted"] == 1, differs, ended],
        [UNCHECKED, AGREES, RESPONSE_DIFFERS, FEATURES_DIFFER],
        CHECK_FAILED,
    )
