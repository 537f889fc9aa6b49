"""Which uncertain number matters most: Sobol indices of the answers of results with
samples.

The first-order index of an unknown is the part of the variance of an answer that would
be gone if the unknown were known; the total index the part that would be left if all
others were (Sobol 1993, Homma and Saltelli 1996). Over several operating points
variances are summed (Gamboa et al. 2014).

Of the design saltelli both follow from the samples alone: the estimators of Saltelli et
al. (2010) and of Jansen (1999). Of other samples the first-order index is the part of
the variance that a regression on cosines of the rank of the unknown explains (Plischke
2012), less what it would explain by chance; the total index lies between it and what
the other first-order ones leave, where the unknowns are independent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.analysis.probability import NORMAL, check_samples, independent, judged
from nsdrill.data import Array, Results, overrides, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.leaves import as_told
from nsdrill.models.registry import model_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.variables import OK, SAMPLE, Unknown

SAFE = "safe"
HARMONICS = 6
FEWEST = 16  # samples, with which one harmonic can be told
RESAMPLED = 60  # bootstrap
PART = 0.2  # of the samples, the lowest and the highest values of an unknown


@dataclass(frozen=True)
class Indices:
    """Arrays [unknowns]; ``first_error`` and ``total_error`` are standard errors from a
    bootstrap over the samples. ``total`` is None where the samples do not tell it.
    ``variance`` is that of the answer, the mean over the points."""

    first: Array
    first_error: Array
    total: Array | None
    total_error: Array | None
    variance: float


def needed(results: Results, severity: int | None) -> tuple[str, ...]:
    """The variables that :func:`sensitivity` uses of results with these attributes."""
    from nsdrill.analysis.probability import needed as of_probability

    return (*of_probability(severity), *model_in(results.attrs).check_features)


def saltelli(a: Array, b: Array, mixed: Array) -> tuple[Array, Array, Array]:
    """First-order and total parts of the variance of an answer, arrays
    [unknowns, points], and the variance [points]: ``a`` and ``b`` [n, points] are the
    answers for the two matrices, ``mixed`` [unknowns, n, points] those for a with one
    column of b."""
    both = np.concatenate([a, b])
    middle = both.mean(axis=0)
    first = np.mean((b - middle) * (mixed - a), axis=1)
    total = 0.5 * np.mean((a - mixed) ** 2, axis=1)
    return first, total, both.var(axis=0)


def by_regression(values: Array, answers: Array) -> tuple[Array, Array]:
    """First-order parts of the variance [unknowns, points], and the variance [points],
    of ``answers`` [n, points] to independent samples ``values`` [n, unknowns]."""
    n = len(answers)
    spread = answers - answers.mean(axis=0)
    variance = np.sum(spread**2, axis=0) / (n - 1)
    parts = [variance - _unexplained(column, spread) for column in values.T]
    return np.array(parts).reshape(values.shape[1], -1), variance


def _unexplained(column: Array, spread: Array) -> Array:
    """The variance [points] that the regression on cosines of the rank of an unknown
    leaves."""
    n = len(column)
    distinct, place = np.unique(column, return_inverse=True)
    counts = np.bincount(place.ravel())
    rank = (np.cumsum(counts) - counts / 2) / n
    harmonics = max(0, min(HARMONICS, n // 10, len(distinct) - 1))
    basis = np.cos(np.pi * np.outer(rank[place.ravel()], np.arange(1, harmonics + 1)))
    basis -= basis.mean(axis=0)
    products = basis.T @ spread
    left = np.sum(spread**2, axis=0) - np.sum(
        products * (np.linalg.pinv(basis.T @ basis) @ products), axis=0
    )
    return np.asarray(left / (n - harmonics - 1))


def indices(values: Array, answers: Array, design: str) -> Indices | None:
    """The indices of ``answers`` [samples, points] to samples ``values``
    [samples, unknowns] of a ``design``, summed over the points; None where the answers
    do not vary. NaN stands for a missing answer."""
    count = values.shape[1]
    groups = list(_groups(answers, count if design == "saltelli" else 0))
    if not groups:
        return None
    rng = np.random.default_rng(0)
    estimates = []
    for number in range(RESAMPLED + 1):
        parts = []
        for rows, points in groups:
            chosen = rows if number == 0 else rng.choice(rows, len(rows))
            if design == "saltelli":
                every = answers[:, points].reshape(count + 2, -1, len(points))[:, chosen]
                made = saltelli(every[0], every[1], every[2:])
                parts.append(np.concatenate([part.reshape(-1, len(points)) for part in made]))
            else:
                first, variance = by_regression(values[chosen], answers[np.ix_(chosen, points)])
                parts.append(np.concatenate([first, variance[None]]))
        estimates.append(np.concatenate(parts, axis=1).sum(axis=1))
    found = np.array(estimates)
    if not found[0, -1] > 1e-12 * np.nanmax(np.abs(answers)) ** 2:
        return None
    shares = found[:, :-1] / np.where(found[:, -1:] > 0.0, found[:, -1:], np.nan)
    best, error = np.clip(shares[0], 0.0, 1.0), np.nanstd(shares[1:], axis=0)
    variance = found[0, -1] / sum(len(points) for _, points in groups)
    if design == "saltelli":
        return Indices(best[:count], error[:count], best[count:], error[count:], float(variance))
    return Indices(best, error, None, None, float(variance))


def _groups(answers: Array, unknowns: int) -> Iterator[tuple[Array, Array]]:
    """Points that lack the same answers: the numbers of the samples that are there, and
    of the points. Of the design saltelli with so many ``unknowns`` samples count that
    are there in all matrices."""
    there = np.isfinite(answers)
    if unknowns:
        there = np.asarray(there.reshape(unknowns + 2, -1, answers.shape[1]).all(axis=0))
    patterns, which = np.unique(there, axis=1, return_inverse=True)
    for number, pattern in enumerate(patterns.T):
        if np.count_nonzero(pattern) >= FEWEST:
            yield np.flatnonzero(pattern), np.flatnonzero(which.ravel() == number)


def answers_of(results: Results, severity: int | None = None) -> dict[str, Array]:
    """The answers of every sample [samples, points] by name: 1 where it is safe in
    every procedure, 0 where not, NaN where that is not known; and the features that
    decide on the responses, of the procedures the greatest."""
    runs = judged(results, severity)
    unsafe = np.where(runs.bad.any(axis=0), 0.0, np.nan)
    found: dict[str, Array] = {SAFE: np.where(runs.safe.all(axis=0), 1.0, unsafe)}
    for name in model_in(results.attrs).check_features:
        if name in results.variables:
            found[name] = np.where(results["status"] == OK, results[name], np.nan).max(axis=0)
    return {name: values.reshape(-1, values.shape[-1]).T for name, values in found.items()}


def sensitivity(results: Results, severity: int | None = None) -> dict[str, Any]:
    """Which unknown matters most, over all operating points of ``results``, as plain
    data in SI units.

    ``answers``: of the safe run and of each feature the ``mean``, the standard
    ``deviation``, and for each unknown ``first`` and ``total`` with their standard
    errors (``total`` None where the samples do not tell it; it then lies between
    ``total_least`` and ``total_most``), and for the fifth of the samples in which the
    unknown is ``low``, and ``high``, the mean ``answer`` and the median ``value`` of
    the unknown. ``measure_first``: the key of the unknown whose measurement leaves
    least doubt about a safe run."""
    check_samples(results, "sensitivity")
    uncertain = resolved_study(results.attrs).get("uncertain", {})
    design = str(uncertain.get("design", "sobol"))
    keys = [unknown.key for unknown in results.drawn]
    values = np.column_stack([*results.drawn.values()])
    if len(values) < FEWEST:
        raise InputError(
            f"sensitivity: found {len(values)} samples; allowed: at least {FEWEST}. Run with more, "
            "uncertain.samples=64 say."
        )
    dependent = bool(uncertain.get("correlations") or len(uncertain.get("table") or ()) > 1)
    if design == "saltelli":  # its columns stand in the order of the distributions
        order = [name for name in uncertain if name in {unknown.short for unknown in results.drawn}]
        placed = [order.index(unknown.short) for unknown in results.drawn]
    else:
        placed = list(range(len(keys)))
    rows: list[dict[str, Any]] = []
    for name, answers in answers_of(results, severity).items():
        inside = independent(results)
        drawn, seen = values[inside], answers[inside]
        found = indices(values, answers, design)
        told = [
            _told(unknown, placed[number], found, drawn[:, number], seen, dependent)
            for number, unknown in enumerate(results.drawn)
        ]
        variable = BY_NAME.get(name)
        rows.append(
            {
                "name": name,
                "meaning": variable.long_name
                if variable
                else "a run that ends well without a critical response",
                "units": variable.units if variable else "1",
                "mean": _mean(seen),
                "deviation": None if found is None else float(np.sqrt(found.variance)),
                "missing": int(np.count_nonzero(~np.isfinite(seen))),
                "unknowns": told,
            }
        )
    return {
        "kind": "sensitivity",
        "title": str(results.attrs.get("title") or ""),
        "overrides": overrides(results.attrs, thresholds=True),
        "severity": severity,
        "samples": len(results.coords[SAMPLE]),
        "design": design,
        "dependent": dependent,
        "points": int(np.prod([len(results.coords[axis]) for axis in results.axes])),
        "at": {axis: as_told(axis, value) for axis, value in results.held.items()},
        "swept": list(results.swept),
        "histories": len(results.coords["procedure"]),
        "answers": rows,
        "measure_first": _first(rows[0]["unknowns"]),
    }


def _told(
    unknown: Unknown, place: int, found: Indices | None, drawn: Array, seen: Array, dependent: bool
) -> dict[str, Any]:
    lowest, highest = np.quantile(drawn, [PART, 1.0 - PART])
    ends = {"low": drawn <= lowest, "high": drawn >= highest}
    row: dict[str, Any] = {
        "key": unknown.key,
        **{
            end: {
                "answer": _mean(seen[some]),
                "value": float(np.median(drawn[some])),
                "units": unknown.units,
            }
            for end, some in ends.items()
        },
        "first": None,
        "first_error": None,
        "total": None,
        "total_error": None,
        "total_least": None,
        "total_most": None,
    }
    if found is None:
        return row
    row |= {"first": float(found.first[place]), "first_error": float(found.first_error[place])}
    if found.total is not None and found.total_error is not None:
        row |= {"total": float(found.total[place]), "total_error": float(found.total_error[place])}
    elif not dependent:
        others = float(found.first.sum() - found.first[place])
        least = float(found.first[place])
        row |= {"total_least": least, "total_most": max(least, 1.0 - others)}
    return row


def _mean(values: Array) -> float | None:
    there = values[np.isfinite(values)]
    return float(there.mean()) if there.size else None


def _first(rows: Sequence[dict[str, Any]]) -> dict[str, Any] | None:
    """The unknown to measure first, and the others that it cannot be told apart from;
    None where none matters."""
    known = [row for row in rows if row["first"] is not None]
    if not known:
        return None
    best = max(known, key=lambda row: row["first"])
    if best["first"] <= NORMAL * best["first_error"]:
        return None
    alike = [
        row["key"]
        for row in known
        if row is not best
        and best["first"] - row["first"]
        < NORMAL * np.hypot(row["first_error"], best["first_error"])
    ]
    return {"key": best["key"], "first": best["first"], "alike": alike}
