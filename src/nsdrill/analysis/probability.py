"""The probability of each outcome, from results with samples of uncertain numbers.

An operating point is *safe* in a sample where every procedure ended well without a
critical response. Runs that failed count as not safe.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from nsdrill.data import Answer, Array, Results, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.responses import RESPONSES, SEVERITIES, STALLED
from nsdrill.observe.motion import CHECK_FAILED, RESPONSE_DIFFERS, UNCHECKED, verdict
from nsdrill.variables import INFERRED, OK, PENDING, SAMPLE

NORMAL_QUANTILE = 1.959963984540054  # of the two-sided 95 % interval
# an unknown history: safe where every procedure is, with the responses of any of them
EVERY = "every"
SAFE = "safe"


@dataclass(frozen=True)
class RunSafety:
    """The safety of every run, arrays of bool on the grid: ``safe``; ``unsafe``, known
    not to be safe; ``failed``, not known; ``distrusted``, among the unsafe ones, those
    whose checks gave another response."""

    safe: Array
    unsafe: Array
    failed: Array
    distrusted: Array


def needed(severity: int | None) -> tuple[str, ...]:
    """The variables that :func:`run_safety` uses."""
    return ("status", "response", *(SEVERITIES if severity is not None else ()))


def run_safety(results: Results, severity: int | None = None) -> RunSafety:
    """Which runs are safe: with ``severity`` those where none of the three severities
    exceeds it and the bit is not stalled, whatever the other response bits are. An
    inferred point has a response but no severity: by severity its safety is not
    known."""
    # A point is not trusted where its checks gave another response. (Other numbers are
    # normal where the motion is chaotic.) An inferred point was not run and so not
    # checked; the runs around it were.
    verdicts = verdict(results) if "trusted" in results.variables else np.full(results.shape, UNCHECKED)
    verdicts = np.where(results["status"] == INFERRED, UNCHECKED, verdicts)
    is_trusted = verdicts != RESPONSE_DIFFERS
    if severity is None:
        is_known, has_no_response = known(results["status"]), results["response"] == 0
    else:
        is_known, has_no_response = (
            results["status"] == OK,
            np.all([results[name] <= severity for name in SEVERITIES if name in results.variables], axis=0)
            & (results["response"] & STALLED == 0),
        )
    check_failed = is_known & has_no_response & (verdicts == CHECK_FAILED)
    return RunSafety(
        is_known & has_no_response & is_trusted & ~check_failed,
        is_known & ~(has_no_response & is_trusted),
        ~known(results["status"]) | check_failed,
        np.asarray(is_known & ~is_trusted),
    )


def interval(count: Array, total: Array | float) -> tuple[Array, Array]:
    """The 95 % intervals of shares, of which ``count`` occurred in ``total``
    independent draws (Wilson 1927). For samples of a Sobol sequence, which are spread
    more evenly, their coverage is larger. Written out, as ``binomtest`` of SciPy takes
    one share at a time, and a thousand times as long."""
    count, total = np.broadcast_arrays(np.asarray(count, float), np.asarray(total, float))
    n, z2 = np.maximum(total, 1.0), NORMAL_QUANTILE**2
    share = count / n
    centre = (share + z2 / (2 * n)) / (1 + z2 / n)
    half_width = NORMAL_QUANTILE / (1 + z2 / n) * np.sqrt(share * (1 - share) / n + z2 / (4 * n**2))
    low, high = (np.where(count == 0, 0.0, centre - half_width), np.where(count == total, 1.0, centre + half_width))
    return np.where(total == 0, 0.0, low), np.where(total == 0, 1.0, high)


def samples_for(confidence: float) -> int:
    """The number of independent samples from which the interval of a share lies above
    ``confidence`` where all of them are safe: 35 for 0.9."""
    return math.ceil(confidence / (1.0 - confidence) * NORMAL_QUANTILE**2 - 1e-9)


def independent(results: Results) -> slice:
    """The samples that were drawn independently of each other. Of the design saltelli
    these are the first two matrices: the others consist of their columns."""
    uncertain = resolved_study(results.attrs).get("uncertain", {})
    if uncertain.get("design") == "saltelli":
        count, present = int(uncertain["samples"]), len(results.coords[SAMPLE])
        if results.drawn and present != count * (len(results.drawn) + 2):
            raise InputError(
                f"found {present} samples of the design saltelli; allowed: all {count * (len(results.drawn) + 2)} of "
                "the study, of which only some are independent."
            )
        return slice(0, 2 * count)
    return slice(None)


def effective_number(results: Results, samples: slice = slice(None)) -> float:
    """The effective number of independent ``samples``: smaller than their number where
    rows of a table are equal, as after the resampling of a fit. It is
    (sum n)^2 / sum n^2, with n the number of times that a row occurs (Kish 1965)."""
    total = len(results.coords[SAMPLE][samples])
    if not resolved_study(results.attrs).get("uncertain", {}).get("table") or not results.drawn:
        return float(total)
    rows = np.column_stack([values[samples] for values in results.drawn.values()])
    repeats = np.unique(rows, axis=0, return_counts=True)[1].astype(float)
    return float(total**2 / np.sum(repeats**2))


def check_samples(results: Results, what: str) -> None:
    """InputError where the results have no samples."""
    if SAMPLE not in results.coords:
        raise InputError(
            f"{what}: found results without samples; allowed: results of a study with the section uncertain, in which "
            "every operating point is run with many samples of what is not known."
        )


@dataclass(frozen=True)
class Probabilities:
    """Counts of ``total`` samples: ``count`` [history, outcome, axes]; ``open``
    [history, axes], the samples in which a failed run leaves open whether they are
    safe. ``histories`` are the procedures, and :data:`EVERY` after them where there are
    several; ``outcomes`` are safe, then the responses."""

    histories: tuple[str, ...]
    outcomes: tuple[str, ...]
    count: Array
    open: Array
    total: int
    effective: float
    """The effective number of independent samples, see :func:`effective_number`."""

    @property
    def share(self) -> Array:
        return np.asarray(self.count / self.total)

    @property
    def interval(self) -> tuple[Array, Array]:
        return interval(self.count * (self.effective / self.total), self.effective)

    def of(self, outcome: str, history: str | None = None) -> tuple[Array, Array, Array]:
        """The probability of an outcome at every operating point, and the ends of its
        interval; for the last history where none is named."""
        place = (self.histories.index(history) if history else -1, self.outcomes.index(outcome))
        return self.share[place], *(end[place] for end in self.interval)


def probabilities_of(
    results: Results, severity: int | None = None, responses: Iterable[str] = RESPONSES
) -> Probabilities:
    """The numbers of samples that are safe, and that have each of the ``responses``, at
    every operating point."""
    check_samples(results, "probability")
    samples, names = independent(results), tuple(responses)
    runs = run_safety(results, severity)
    safe, unsafe = runs.safe[..., samples], runs.unsafe[..., samples]
    bits = np.where(known(results["status"]), results["response"], 0)[..., samples].astype(int)
    # procedure, response, axes, sample
    has_response = np.stack([bits & RESPONSES[name].bit > 0 for name in names], axis=1)

    def count_samples(is_safe: Array, is_unsafe: Array, has_response: Array) -> tuple[Array, Array]:
        count = np.concatenate([is_safe.sum(axis=-1)[None], has_response.sum(axis=-1)])
        return count, (~is_safe & ~is_unsafe).sum(axis=-1)

    counts = [count_samples(*(np.asarray(part[i]) for part in (safe, unsafe, has_response))) for i in range(len(safe))]
    if len(safe) > 1:
        counts.append(count_samples(*map(np.asarray, (safe.all(axis=0), unsafe.any(axis=0), has_response.any(axis=0)))))
    histories = results.procedures + ((EVERY,) if len(safe) > 1 else ())
    count, undecided = (np.array(part) for part in zip(*counts, strict=True))
    return Probabilities(
        histories, (SAFE, *names), count, undecided, safe.shape[-1], effective_number(results, samples)
    )


def window_state(probabilities: Probabilities, confidence: float, history: str | None = None) -> tuple[Array, Array]:
    """Where the probability of a safe run reaches ``confidence``, and where it would
    only if the failed runs were safe: arrays of bool over the axes."""
    place = probabilities.histories.index(history) if history else -1
    least = np.ceil(confidence * probabilities.total - 1e-9)
    count = probabilities.count[place, 0]
    return np.asarray(count >= least), np.asarray((count < least) & (count + probabilities.open[place] >= least))


def one_procedure(results: Results, number: int) -> Results:
    """The results of one procedure."""
    coords = {**results.coords, "procedure": results.coords["procedure"][number : number + 1]}
    variables: Answer = {name: values[number : number + 1] for name, values in results.variables.items()}
    return Results(coords, variables, results.attrs, results.more, results.drawn)


# The outcome of each point: its critical responses where they are known.


PENDING_POINT, FAILED_POINT = -1, -2  # outcomes beside the response bits, which are never negative
_KNOWN = (OK, INFERRED)


def known(status: Array) -> Array:
    """Whether the response of a point is known: it was run to its end, or inferred from
    its neighbours."""
    return np.isin(status, _KNOWN)


def outcome(status: Array, response: Array) -> Array:
    """The response bits where they are known, else :data:`PENDING_POINT` or
    :data:`FAILED_POINT`."""
    failed = np.where(status == PENDING, PENDING_POINT, FAILED_POINT)
    return np.where(known(status), response.astype(int), failed)
