"""How probable each answer is, of results with samples of uncertain numbers.

An operating point is *safe* in a sample where every procedure ended well without a
critical response. Runs that failed count as not safe.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.analysis.outcome import known, text
from nsdrill.data import Array, Results, resolved_study
from nsdrill.errors import InputError
from nsdrill.observe.trust import CHECK_FAILED, RESPONSE_DIFFERS, UNCHECKED, verdict
from nsdrill.variables import INFERRED, OK, RESPONSES, SAMPLE

NORMAL = 1.959963984540054  # of 95 %
SEVERITIES = ("stick_slip_severity", "bounce_severity", "whirl_severity")
EVERY = "every"  # the history of which nothing is known: safe in every procedure, a response in any
SAFE = "safe"


@dataclass(frozen=True)
class Judged:
    """What became of every run, arrays of bool on the grid: ``safe``; ``bad``, known
    not to be safe; ``failed``, not known; ``distrusted``, of those that are bad, by
    their checks only."""

    safe: Array
    bad: Array
    failed: Array
    distrusted: Array


def needed(severity: int | None) -> tuple[str, ...]:
    """The variables that :func:`judged` uses."""
    return ("status", "response", *(SEVERITIES if severity is not None else ()))


def judged(results: Results, severity: int | None = None) -> Judged:
    """Which runs are safe: with ``severity`` those where none of the three severities
    exceeds it, whatever the response bits say. An inferred point has a response, but no
    severity: by severity it is not known."""
    # Not trusted: a point whose checks gave another response. (That its numbers differ
    # is the rule where the motion is chaotic.) An inferred point was not run, so it was
    # not checked either; the runs around it were.
    verdicts = (
        verdict(results) if "trusted" in results.variables else np.full(results.shape, UNCHECKED)
    )
    verdicts = np.where(results["status"] == INFERRED, UNCHECKED, verdicts)
    trusted = verdicts != RESPONSE_DIFFERS
    if severity is None:
        good, calm = known(results["status"]), results["response"] == 0
    else:
        good, calm = (
            results["status"] == OK,
            np.all(
                [results[name] <= severity for name in SEVERITIES if name in results.variables],
                axis=0,
            ),
        )
    unchecked = good & calm & (verdicts == CHECK_FAILED)
    return Judged(
        good & calm & trusted & ~unchecked,
        good & ~(calm & trusted),
        ~known(results["status"]) | unchecked,
        np.asarray(good & ~trusted),
    )


def interval(count: Array, total: Array | float) -> tuple[Array, Array]:
    """The 95 % intervals of shares of which ``count`` in ``total`` independent draws
    were seen (Wilson 1927). Samples of a Sobol sequence spread more evenly than
    independent ones: of them the intervals hold more often. Written out: scipy's
    ``binomtest`` takes one share at a time, and a thousand times as long."""
    count, total = np.broadcast_arrays(np.asarray(count, float), np.asarray(total, float))
    n, z2 = np.maximum(total, 1.0), NORMAL**2
    share = count / n
    middle = (share + z2 / (2 * n)) / (1 + z2 / n)
    half = NORMAL / (1 + z2 / n) * np.sqrt(share * (1 - share) / n + z2 / (4 * n**2))
    low, high = (
        np.where(count == 0, 0.0, middle - half),
        np.where(count == total, 1.0, middle + half),
    )
    return np.where(total == 0, 0.0, low), np.where(total == 0, 1.0, high)


def independent(results: Results) -> slice:
    """The samples that are drawn independently of each other: of the design saltelli
    the first two matrices, as the others are made of their columns."""
    uncertain = resolved_study(results.attrs).get("uncertain", {})
    if uncertain.get("design") == "saltelli":
        count, there = int(uncertain["samples"]), len(results.coords[SAMPLE])
        if results.drawn and there != count * (len(results.drawn) + 2):
            raise InputError(
                f"found {there} samples of the design saltelli; allowed: all "
                f"{count * (len(results.drawn) + 2)} of the "
                "study, of which only some are independent."
            )
        return slice(0, 2 * count)
    return slice(None)


def effective_number(results: Results, some: slice = slice(None)) -> float:
    """How many independent samples tell as much as those of ``results``: fewer where
    rows of a table are the same, as those that a fit has drawn again by weight: (sum
    n)^2 / sum n^2 of the times n that each is there (Kish 1965)."""
    total = len(results.coords[SAMPLE][some])
    if not resolved_study(results.attrs).get("uncertain", {}).get("table") or not results.drawn:
        return float(total)
    rows = np.column_stack([values[some] for values in results.drawn.values()])
    times = np.unique(rows, axis=0, return_counts=True)[1].astype(float)
    return float(total**2 / np.sum(times**2))


def check_samples(results: Results, what: str) -> None:
    """InputError where the results have no samples."""
    if SAMPLE not in results.coords:
        raise InputError(
            f"{what}: found results without samples; allowed: results of a study with the section "
            f"uncertain, in which "
            "every operating point is run with many samples of what is not known."
        )


@dataclass(frozen=True)
class Chances:
    """Counts of samples, of ``total`` of them: ``count`` [history, outcome, axes],
    ``open`` [history, axes] those of which a failed run leaves open whether they are
    safe. ``histories`` are the procedures, and :data:`EVERY` after them where there are
    several; ``outcomes`` are safe, then the responses."""

    histories: tuple[str, ...]
    outcomes: tuple[str, ...]
    count: Array
    open: Array
    total: int
    effective: float
    """How many independent samples tell as much: fewer than ``total`` where samples of
    a table are the same."""

    @property
    def share(self) -> Array:
        return np.asarray(self.count / self.total)

    @property
    def interval(self) -> tuple[Array, Array]:
        return interval(self.count * (self.effective / self.total), self.effective)

    def of(self, outcome: str, history: str | None = None) -> tuple[Array, Array, Array]:
        """The probability of an outcome at every operating point, and the ends of its
        interval; of the last history where none is named."""
        place = (self.histories.index(history) if history else -1, self.outcomes.index(outcome))
        return self.share[place], *(end[place] for end in self.interval)


def chances(
    results: Results, severity: int | None = None, responses: Iterable[str] = RESPONSES
) -> Chances:
    """How many samples are safe, and have each of the ``responses``, at every operating
    point."""
    check_samples(results, "probability")
    some, names = independent(results), tuple(responses)
    runs = judged(results, severity)
    safe, bad = runs.safe[..., some], runs.bad[..., some]
    bits = np.where(known(results["status"]), results["response"], 0)[..., some].astype(int)
    # procedure, response, axes, sample
    seen = np.stack([bits >> RESPONSES.index(name) & 1 for name in names], axis=1)

    def counted(good: Array, not_good: Array, present: Array) -> tuple[Array, Array]:
        count = np.concatenate([good.sum(axis=-1)[None], present.sum(axis=-1)])
        return count, (~good & ~not_good).sum(axis=-1)

    made = [counted(*(np.asarray(part[i]) for part in (safe, bad, seen))) for i in range(len(safe))]
    if len(safe) > 1:
        made.append(
            counted(*map(np.asarray, (safe.all(axis=0), bad.any(axis=0), seen.any(axis=0))))
        )
    histories = tuple(text(name) for name in results.coords["procedure"]) + (
        (EVERY,) if len(safe) > 1 else ()
    )
    count, unsure = (np.array(part) for part in zip(*made, strict=True))
    return Chances(
        histories, (SAFE, *names), count, unsure, safe.shape[-1], effective_number(results, some)
    )


def window_state(
    chance: Chances, confidence: float, history: str | None = None
) -> tuple[Array, Array]:
    """Where the probability of a safe run reaches ``confidence``, and where it might,
    if the failed runs were safe: arrays of bool over the axes."""
    place = chance.histories.index(history) if history else -1
    least = np.ceil(confidence * chance.total - 1e-9)
    count = chance.count[place, 0]
    return np.asarray(count >= least), np.asarray(
        (count < least) & (count + chance.open[place] >= least)
    )


def one_procedure(results: Results, number: int) -> Results:
    """The results of one procedure."""
    coords = {**results.coords, "procedure": results.coords["procedure"][number : number + 1]}
    variables: dict[str, Any] = {
        name: values[number : number + 1] for name, values in results.variables.items()
    }
    return Results(coords, variables, results.attrs, results.more, results.drawn)
