"""What is known of every run: whether it is safe, and its outcome.

Runs that are not known are counted as :mod:`nsdrill.analysis.counts` says.
"""

from __future__ import annotations

import numpy as np

from nsdrill.analysis.counts import TURNED, Counts, after_failure, knowledge, known, off_speed
from nsdrill.analysis.unstable import FOLLOWED, unstable
from nsdrill.data import Answer, Array, Attributes, Results, frozen_modes
from nsdrill.models.registry import model_in, responses_in
from nsdrill.models.responses import OF_MOTION, RESPONSES, SEVERITIES, Response, severity_labels, ungraded
from nsdrill.observe.motion_kinds import CHECK_FAILED, RESPONSE_DIFFERS, UNCHECKED, verdict
from nsdrill.records import dataclass
from nsdrill.variables import INFERRED, OK, PENDING


@dataclass(frozen=True)
class RunSafety:
    """The safety of every run, arrays of bool on the grid: ``safe``; ``unsafe``, known
    not to be safe; ``failed``, not known; ``distrusted``, among the unsafe ones, those
    whose checks gave another response. Of a run that is off its speed, or on an unstable motion, that
    it shows nothing says nothing of its setting."""

    safe: Array
    unsafe: Array
    failed: Array
    distrusted: Array


def needed(severity: int | None, attrs: Attributes | None = None) -> tuple[str, ...]:
    """The variables that :func:`run_safety` uses, of a file with the root attributes
    ``attrs`` or of a drill string."""
    labels = SEVERITIES if attrs is None else severity_labels(responses_in(attrs).values())
    return ("status", "response", *(labels if severity is not None else ()))


def run_safety(results: Results, severity: int | None = None) -> RunSafety:
    """Which runs are safe: with ``severity`` those where none of the severities exceeds it
    and there is no response without one, as that of a stalled bit. An inferred point has a
    response but no severity: by severity its safety is not known."""
    # A point is not trusted where its checks gave another response. (Other numbers are
    # normal where the motion is chaotic.) An inferred point was not run and so not
    # checked; the runs around it were.
    verdicts = verdict(results) if "trusted" in results.variables else np.full(results.shape, UNCHECKED)
    verdicts = np.where(results["status"] == INFERRED, UNCHECKED, verdicts)
    is_trusted = verdicts != RESPONSE_DIFFERS
    is_known = known_runs(results)
    if severity is None:
        has_no_response = results["response"] == 0
    else:
        critical = responses_in(results.attrs).values()
        labels = severity_labels(critical)
        is_known, has_no_response = (
            is_known & (results["status"] == OK),
            np.all([results[name] <= severity for name in labels if name in results.variables], axis=0)
            & (results["response"] & ungraded(critical) == 0),
        )
    is_open = is_known & has_no_response & is_trusted & (verdicts == CHECK_FAILED)
    return RunSafety(
        is_known & has_no_response & is_trusted & ~is_open,
        is_known & ~(has_no_response & is_trusted),
        ~known_runs(results) | is_open,
        np.asarray(is_known & ~is_trusted),
    )


def barring(results: Results, severity: int | None = None) -> Array:
    """The response bits of every run that prevent that it is safe: with a ``severity`` none of a
    response that it allows there."""
    bits = np.where(known_runs(results), results["response"], 0).astype(int)
    for one in responses_in(results.attrs).values() if severity is not None else ():
        if one.severity is not None and one.severity.name in results.variables:
            allowed = (results["status"] == OK) & (results[one.severity.name] <= severity)
            bits = np.where(allowed, bits & ~one.bit, bits)
    return bits


def counts_of(results: Results, severity: int | None = None) -> Answer:
    """Of all runs of ``results`` how many are known, failed and pending, as plain data of
    :class:`nsdrill.analysis.counts.Counts`."""
    runs = run_safety(results, severity)
    return Counts.over(knowledge(np.asarray(results["status"]), runs.safe | runs.unsafe)).at()


def told_responses(attrs: Attributes) -> dict[str, Response]:
    """The responses that answers count, by name: all four of a string that drills, also
    those that its model cannot show, and its own."""
    model = model_in(attrs)
    return {**(RESPONSES if model.drills else {}), **model.critical}


def unseen_responses(attrs: Attributes) -> dict[str, str]:
    """Which of these the results cannot show, so that nothing is known of them, with why:
    their model has none, or the motion of it is frozen."""
    model, frozen = model_in(attrs), frozen_modes(attrs)
    unseen = {name: f"the model {model.name} has none" for name in told_responses(attrs) if name not in model.critical}
    for motion in frozen:
        unseen |= {
            name: f"the {motion} motion is frozen" for name in OF_MOTION.get(motion, ()) if name in model.critical
        }
    return unseen


# The outcome of each point: its critical responses where they are known.


# outcomes beside the response bits, which are never negative; the last: it ended well, but came
# after a failed run in its chain, and has not the history that its procedure says
PENDING_POINT, FAILED_POINT, NOT_CARRIED_POINT = -1, -2, -3


# the variables beside status and response that known_runs uses
DECIDING = (*TURNED, *FOLLOWED)


def known_runs(results: Results) -> Array:
    """Of which runs the response is known, with the history and at the speed that the study
    says, on a motion that a disturbance does not leave: bool on the grid."""
    shows_nothing = results["response"] == 0 if "response" in results.variables else True
    is_doubtful = off_speed(results) | unstable(results)
    return np.asarray(known(results["status"]) & ~after_failure(results) & ~(is_doubtful & shows_nothing))


def measured_runs(results: Results) -> Array:
    """Which runs were made and are known, and so have values: bool on the grid."""
    return np.asarray((results["status"] == OK) & known_runs(results))


def measured_values(results: Results, name: str) -> Array:
    """The finite values of a variable over :func:`measured_runs`; none where it is not
    there."""
    if name not in results.variables:
        return np.empty(0)
    values = np.asarray(results[name])[measured_runs(results)]
    return values[np.isfinite(values)]


def known_outcome(results: Results) -> Array:
    """As :func:`outcome`, with :data:`NOT_CARRIED_POINT` for runs that ended well and are not
    known (:func:`known_runs`)."""
    codes = outcome(results["status"], results["response"])
    return np.where((codes >= 0) & ~known_runs(results), NOT_CARRIED_POINT, codes)


def outcome(status: Array, response: Array) -> Array:
    """The response bits where they are known, else :data:`PENDING_POINT` or
    :data:`FAILED_POINT`."""
    failed = np.where(status == PENDING, PENDING_POINT, FAILED_POINT)
    return np.where(known(status), response.astype(int), failed)
