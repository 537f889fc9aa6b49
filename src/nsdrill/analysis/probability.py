"""The probability of each outcome, from results with samples of uncertain numbers.

An operating point is *safe* in a sample where every procedure ended well without a
critical response. Runs that are not known are counted as :mod:`nsdrill.analysis.counts`
says.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from nsdrill.analysis.counts import Counts, after_failure, knowledge, known, with_failures
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
    is_known = known_runs(results)
    if severity is None:
        has_no_response = results["response"] == 0
    else:
        is_known, has_no_response = (
            is_known & (results["status"] == OK),
            np.all([results[name] <= severity for name in SEVERITIES if name in results.variables], axis=0)
            & (results["response"] & STALLED == 0),
        )
    check_failed = is_known & has_no_response & (verdicts == CHECK_FAILED)
    return RunSafety(
        is_known & has_no_response & is_trusted & ~check_failed,
        is_known & ~(has_no_response & is_trusted),
        ~known_runs(results) | check_failed,
        np.asarray(is_known & ~is_trusted),
    )


def counts_of(results: Results, severity: int | None = None) -> Answer:
    """Of all runs of ``results`` how many are known, failed and pending, as plain data of
    :class:`nsdrill.analysis.counts.Counts`."""
    runs = run_safety(results, severity)
    return Counts.over(knowledge(np.asarray(results["status"]), runs.safe | runs.unsafe)).at()


def interval(count: Array, total: Array | float, unknown: Array | float = 0.0) -> tuple[Array, Array]:
    """The 95 % intervals of shares, of which ``count`` occurred in ``total``
    independent draws (Wilson 1927). Of ``unknown`` further ones among the total it is not
    known: the lower end is as if none of them occurred, the upper end as if all did.

    For samples of a Sobol sequence, which are spread more evenly, the coverage is larger.
    Written out, as ``binomtest`` of SciPy takes one share at a time, and a thousand times
    as long."""
    count, total, unknown = np.broadcast_arrays(*(np.asarray(part, float) for part in (count, total, unknown)))
    n, z2 = np.maximum(total, 1.0), NORMAL_QUANTILE**2

    def end(occurred: Array, side: int) -> Array:
        share = occurred / n
        half_width = (
            NORMAL_QUANTILE / (1 + z2 / n) * np.sqrt(np.maximum(share * (1 - share), 0.0) / n + z2 / (4 * n**2))
        )
        return np.asarray((share + z2 / (2 * n)) / (1 + z2 / n) + side * half_width)

    most = count + unknown
    low, high = np.where(count == 0, 0.0, end(count, -1)), np.where(most >= total, 1.0, end(most, 1))
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
    """Counts of ``total`` samples, arrays [history, outcome, axes]: ``count``, those in
    which the outcome occurs, and ``open``, those of which that is not known. ``runs`` are
    the :class:`Counts` of samples [history, axes], known where every run is.
    ``histories`` are the procedures, and :data:`EVERY` after them where there are
    several; ``outcomes`` are safe, then the responses."""

    histories: tuple[str, ...]
    outcomes: tuple[str, ...]
    count: Array
    open: Array
    runs: Counts
    total: int
    effective: float
    """The effective number of independent samples, see :func:`effective_number`."""

    @property
    def known(self) -> Array:
        """The number of samples of which the outcome is known."""
        return np.asarray(self.total - self.open)

    @property
    def share(self) -> Array:
        """The share of the outcome among the samples of which it is known; NaN where it
        is known of none."""
        return np.divide(self.count, self.known, out=np.full(self.count.shape, np.nan), where=self.known > 0)

    @property
    def least(self) -> Array:
        """The share of the outcome where none of the open samples has it."""
        return np.asarray(self.count / self.total)

    @property
    def interval(self) -> tuple[Array, Array]:
        """The ends of the intervals, which cover whatever the open samples may show."""
        worth = self.effective / self.total
        return interval(self.count * worth, self.effective, self.open * worth)

    @property
    def in_all(self) -> Answer:
        """The counts of samples at all operating points together, as plain data; of the
        last history."""
        return self.runs.each(lambda part: np.asarray(part[-1].sum())).at()

    def place(self, outcome: str, history: str | None = None) -> tuple[int, int]:
        """The place of an outcome in the arrays; of the last history where none is
        named."""
        return (self.histories.index(history) if history else -1, self.outcomes.index(outcome))

    def of(self, outcome: str, history: str | None = None) -> tuple[Array, Array, Array]:
        """The probability of an outcome at every operating point, NaN where it is known of
        no sample, and the ends of its interval; for the last history where none is
        named."""
        place = self.place(outcome, history)
        return self.share[place], *(end[place] for end in self.interval)


def probabilities_of(
    results: Results, severity: int | None = None, responses: Iterable[str] = RESPONSES
) -> Probabilities:
    """The numbers of samples that are safe, and that have each of the ``responses``, at
    every operating point."""
    check_samples(results, "probability")
    samples, names = independent(results), tuple(responses)
    safety, is_known = run_safety(results, severity), known_runs(results)
    bits = np.where(is_known, results["response"], 0).astype(int)
    # of each outcome the runs that have it, and that do not
    has = [safety.safe, *(bits & RESPONSES[name].bit > 0 for name in names)]
    has_not = [safety.unsafe, *(is_known & ~part for part in has[1:])]
    found = knowledge(np.asarray(results["status"]), safety.safe | safety.unsafe)[..., samples]
    has, has_not = ([np.asarray(part[..., samples]) for part in parts] for parts in (has, has_not))
    histories = [([part[i] for part in has], [part[i] for part in has_not], found[i]) for i in range(len(found))]
    if len(found) > 1:  # safe in every procedure, a response in any
        every, never = ([part.all(axis=0) for part in parts] for parts in (has, has_not))
        any_has, any_not = ([part.any(axis=0) for part in parts] for parts in (has, has_not))
        histories.append(([every[0], *any_has[1:]], [any_not[0], *never[1:]], found.max(axis=0)))
    count, known_not = (
        np.array([[part.sum(axis=-1) for part in parts] for parts in side])
        for side in zip(*(one[:2] for one in histories), strict=True)
    )
    total = found.shape[-1]
    return Probabilities(
        results.procedures + ((EVERY,) if len(found) > 1 else ()),
        (SAFE, *names),
        count,
        np.asarray(total - count - known_not),
        Counts.over(np.array([one[2] for one in histories]), -1),
        total,
        effective_number(results, samples),
    )


def window_state(probabilities: Probabilities, confidence: float, history: str | None = None) -> tuple[Array, Array]:
    """Where the probability of a safe run reaches ``confidence`` whatever the samples show
    that are not known, and where it would only if these were safe: arrays of bool over
    the axes."""
    place = probabilities.place(SAFE, history)
    least = np.ceil(confidence * probabilities.total - 1e-9)
    count = probabilities.count[place]
    return np.asarray(count >= least), np.asarray((count < least) & (count + probabilities.open[place] >= least))


def one_procedure(results: Results, number: int) -> Results:
    """The results of one procedure."""
    coords = {**results.coords, "procedure": results.coords["procedure"][number : number + 1]}
    variables: Answer = {name: values[number : number + 1] for name, values in with_failures(results).items()}
    return Results(coords, variables, results.attrs, results.more, results.drawn)


# The outcome of each point: its critical responses where they are known.


# outcomes beside the response bits, which are never negative; the last: it ended well, but came
# after a failed run in its chain, and has not the history that its procedure says
PENDING_POINT, FAILED_POINT, NOT_CARRIED_POINT = -1, -2, -3


def known_runs(results: Results) -> Array:
    """Of which runs the response is known, with the history that the procedure says: bool
    on the grid."""
    return np.asarray(known(results["status"]) & ~after_failure(results))


def known_outcome(results: Results) -> Array:
    """As :func:`outcome`, with :data:`NOT_CARRIED_POINT` for runs that ended well and came
    after a failed one in their chain."""
    codes = outcome(results["status"], results["response"])
    return np.where((codes >= 0) & ~known_runs(results), NOT_CARRIED_POINT, codes)


def outcome(status: Array, response: Array) -> Array:
    """The response bits where they are known, else :data:`PENDING_POINT` or
    :data:`FAILED_POINT`."""
    failed = np.where(status == PENDING, PENDING_POINT, FAILED_POINT)
    return np.where(known(status), response.astype(int), failed)
