"""What is known of every run, as one flag variable: for readers of a file to whom a response
of 0 and a status of ``ok`` would say that a run is free, where that is not known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nsdrill.analysis.counts import AFTER_FAILURE, after_failure, knowledge, off_speed
from nsdrill.analysis.counts import FAILED as HAS_FAILED
from nsdrill.analysis.counts import NOT_RUN as WAS_NOT_RUN
from nsdrill.analysis.grades import unsettled_runs
from nsdrill.analysis.safety import DECIDING, known_runs, run_safety
from nsdrill.analysis.unstable import resting
from nsdrill.data import Array, Attributes, Results
from nsdrill.models.model_description import Description
from nsdrill.models.registry import model_in
from nsdrill.variables import TRUST, flag

KNOWLEDGE = flag(
    "knowledge",
    "whether the response of the run is known, also of one that had not settled, or why it is not known",
    "known unsettled failed not_run not_carried off_speed unstable_motion check_failed not_judged",
)
(KNOWN, UNSETTLED, FAILED, NOT_RUN, NOT_CARRIED, OFF_SPEED, UNSTABLE, CHECK_FAILED, NOT_JUDGED) = (
    KNOWLEDGE.flag_values or ()
)


def used_by_knowledge(attrs: Attributes) -> tuple[str, ...]:
    """The variables that :func:`knowledge_of` uses of results with these root attributes."""
    return ("status", "response", *DECIDING, *resting(model_in(attrs)), *TRUST)


def knowledge_of(results: Results, not_carried: Array | None = None, model: Description | None = None) -> Array:
    """The :data:`KNOWLEDGE` of every run, on the grid. ``not_carried`` tells which runs came
    after a failed one, of a part of what was run; ``model`` is that of the results, where it is at hand."""
    if not_carried is not None:
        results = replace(results, variables={**results.variables, AFTER_FAILURE.name: not_carried})
    is_known, ended = known_runs(results), knowledge(np.asarray(results["status"]), np.asarray(False))
    is_off = off_speed(results)
    found = np.select(
        [
            ended == HAS_FAILED,
            ended == WAS_NOT_RUN,
            after_failure(results),
            np.full(results.shape, not (model or model_in(results.attrs)).critical),
            ~is_known & is_off,
            ~is_known,
            run_safety(results).failed,
            unsettled_runs(results),
        ],
        [FAILED, NOT_RUN, NOT_CARRIED, NOT_JUDGED, OFF_SPEED, UNSTABLE, CHECK_FAILED, UNSETTLED],
        KNOWN,
    )
    return np.asarray(found, KNOWLEDGE.dtype)
