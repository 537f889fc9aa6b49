"""The probability of each outcome, from results with samples of uncertain numbers.

An operating point is *safe* in a sample where its class allows it
(:mod:`nsdrill.analysis.histories`): what was brought up from below decides, and the way
down can withdraw it. So every window, probability and index counts the same. Runs that
are not known are counted as :mod:`nsdrill.analysis.counts` says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nsdrill.analysis.counts import KNOWN, UNDECIDED, Counts, knowledge, with_failures
from nsdrill.analysis.grades import grades_of, labels_of
from nsdrill.analysis.histories import Grade, Label, is_allowed
from nsdrill.analysis.planes import check_judged
from nsdrill.analysis.safety import known_runs
from nsdrill.data import Answer, Array, Results, resolved_study
from nsdrill.errors import InputError, count
from nsdrill.models.registry import responses_in
from nsdrill.records import dataclass
from nsdrill.variables import SAMPLE

NORMAL_QUANTILE = 1.959963984540054  # of the two-sided 95 % interval
# of all procedures together: safe where the class allows it, with the responses of any of them
EVERY = "every"
SAFE = "safe"


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
    rows of a table are equal, as after the resampling of a fit, or where a sample was
    selected several times. It is (sum n)^2 / sum n^2, with n the number of times that a row
    occurs (Kish 1965)."""
    total = len(results.coords[SAMPLE][samples])
    section = resolved_study(results.attrs).get("uncertain", {})
    # two draws of listed values may be equal, those of a distribution are not
    never_equal = any("values" not in section.get(unknown.short, ("values",)) for unknown in results.drawn)
    if not results.drawn or not (section.get("table") or never_equal):
        return float(total)
    rows = np.column_stack([values[samples] for values in results.drawn.values()])
    repeats = np.unique(rows, axis=0, return_counts=True)[1].astype(float)
    return float(total**2 / np.sum(repeats**2))


def samples_text(number: int, effective: float) -> str:
    """``32 samples``, and the number of independent ones that they are worth where some
    are the same."""
    worth = f" (some the same, worth {effective:.0f} independent ones)" if effective < number - 0.5 else ""
    return f"{count(number, 'sample')}{worth}"


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


def probabilities_of(results: Results, severity: int | None = None) -> Probabilities:
    """The numbers of samples that are safe, and that have each response of the model, at
    every operating point. In all histories together a sample is safe that is allowed by its
    class, and a file of a single procedure has no other history; by one procedure of
    several a run is safe that is clear."""
    check_samples(results, "probability")
    check_judged(results, "probability")
    samples, critical = independent(results), responses_in(results.attrs)
    labels, is_known = labels_of(results, severity), known_runs(results)
    bits = np.where(is_known, results["response"], 0).astype(int)
    # of each outcome the runs that have it, and that do not
    has = [labels == Label.CLEAR, *(bits & one.bit > 0 for one in critical.values())]
    has_not = [(labels > Label.UNKNOWN) & ~has[0], *(is_known & ~part for part in has[1:])]
    found = knowledge(np.asarray(results["status"]), labels > Label.UNKNOWN)[..., samples]
    has, has_not = ([np.asarray(part[..., samples]) for part in parts] for parts in (has, has_not))
    histories = [([part[i] for part in has], [part[i] for part in has_not], found[i]) for i in range(len(found))]
    # all together: allowed by its class, a response in any
    safe, is_decided = (part[..., samples] for part in allowed_samples(results, severity))
    runs = np.where(is_decided, KNOWN, np.maximum(found.max(axis=0), UNDECIDED))
    any_has, never = [part.any(axis=0) for part in has[1:]], [part.all(axis=0) for part in has_not[1:]]
    together = [safe, *any_has], [is_decided & ~safe, *never], runs
    histories = [*histories, together] if len(found) > 1 else [together]
    count, known_not = (
        np.array([[part.sum(axis=-1) for part in parts] for parts in side])
        for side in zip(*(one[:2] for one in histories), strict=True)
    )
    total = found.shape[-1]
    return Probabilities(
        results.procedures + ((EVERY,) if len(found) > 1 else ()),
        (SAFE, *critical),
        count,
        np.asarray(total - count - known_not),
        Counts.over(np.array([one[2] for one in histories]), -1),
        total,
        effective_number(results, samples),
    )


def allowed_samples(results: Results, severity: int | None = None) -> tuple[Array, Array]:
    """Where each sample is safe at each operating point, and where it is known whether it
    is: arrays of bool [axes, sample]. Of what was only lowered from above, what is clear
    there."""
    if results.procedures == ("down",):
        labels = labels_of(results, severity)[0]
        return labels == Label.CLEAR, labels > Label.UNKNOWN
    grades = grades_of(results, severity)
    return is_allowed(grades), grades != Grade.UNKNOWN


def safe_in_words(procedures: Sequence[str]) -> str:
    """What a safe sample is."""
    if "up" in procedures:
        return "safe brought up from below"
    return "safe lowered from above" if tuple(procedures) == ("down",) else "safe"


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
