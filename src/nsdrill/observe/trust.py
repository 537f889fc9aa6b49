"""Whether the response of a point holds in more accurate runs: labels from the results
of the point's checks.

There are two checks: ``tight``, the same run with a smaller tolerance, and ``long``,
the run continued for the same time again.
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
