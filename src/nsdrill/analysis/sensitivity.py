"""Global sensitivity: Sobol indices of the answers of results with samples, which say
which uncertain number matters most.

The first-order index of an unknown is the part of the variance of an answer that would
vanish if the unknown were known; the total index is the part that would remain if all
others were known (Sobol 1993, Homma and Saltelli 1996). Over several operating points
variances are summed (Gamboa et al. 2014).

With the design saltelli both follow from the samples alone, by the estimators of
Saltelli et al. (2010) and of Jansen (1999). With other samples the first-order index is
the part of the variance that a regression on cosines of the rank of the unknown
explains (Plischke 2012), less what it would explain by chance. The total index then
lies between the first-order index and 1 less the other first-order indices, where the
unknowns are independent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from nsdrill.analysis import safety
from nsdrill.analysis.counts import KNOWN, UNDECIDED, Counts, knowledge
from nsdrill.analysis.doubts import known_before
from nsdrill.analysis.grades import unsettled_in
from nsdrill.analysis.planes import check_judged
from nsdrill.analysis.probability import NORMAL_QUANTILE, allowed_samples, check_samples, effective_number, independent
from nsdrill.analysis.safety import known_runs
from nsdrill.data import Answer, Array, Attributes, Results, overrides, resolved_study
from nsdrill.errors import InputError, count
from nsdrill.models.choices import word_or_number
from nsdrill.models.registry import model_in, named_in
from nsdrill.models.responses import RESPONSES, STALLED
from nsdrill.records import dataclass
from nsdrill.sampling import may_be_out_of_order
from nsdrill.variables import OK, SAMPLE, Unknown

SAFE = "safe"
HARMONICS = 6
MIN_SAMPLES = 16  # enough for one harmonic
BOOTSTRAP_SAMPLES = 60
PART = 0.2  # of the samples, the lowest and the highest values of an unknown


@dataclass(frozen=True)
class Indices:
    """First-order and total indices, arrays [unknowns]; ``first_error`` and
    ``total_error`` are standard errors from a bootstrap over the samples. ``total`` is
    None where the design does not determine it. ``variance`` is that of the answer, the
    mean over the points."""

    first: Array
    first_error: Array
    total: Array | None
    total_error: Array | None
    variance: float


def needed(attrs: Attributes, severity: int | None) -> tuple[str, ...]:
    """The variables that :func:`sensitivity` uses of results with these root attributes."""
    return (*safety.needed(severity, attrs), *model_in(attrs).check_features)


def saltelli(a: Array, b: Array, mixed: Array) -> tuple[Array, Array, Array]:
    """First-order and total parts of the variance of an answer, arrays
    [unknowns, points], and the variance [points]: ``a`` and ``b`` [n, points] are the
    answers for the two matrices, ``mixed`` [unknowns, n, points] those for a with one
    column of b."""
    both = np.concatenate([a, b])
    mean = both.mean(axis=0)
    first = np.mean((b - mean) * (mixed - a), axis=1)
    total = 0.5 * np.mean((a - mixed) ** 2, axis=1)
    return first, total, both.var(axis=0)


def regression_indices(values: Array, answers: Array, worth: float = 1.0) -> tuple[Array, Array]:
    """First-order parts of the variance [unknowns, points], and the variance [points],
    of ``answers`` [n, points] to samples ``values`` [n, unknowns], of which each is ``worth``
    so many independent ones."""
    n = worth * len(answers)
    spread = answers - answers.mean(axis=0)
    variance = worth * np.sum(spread**2, axis=0) / (n - 1)
    parts = [variance - _unexplained(column, spread, worth) for column in values.T]
    return np.array(parts).reshape(values.shape[1], -1), variance


def _unexplained(column: Array, spread: Array, worth: float = 1.0) -> Array:
    """The variance [points] that the regression on cosines of the rank of an unknown
    does not explain."""
    n = len(column)
    distinct, rank_index = np.unique(column, return_inverse=True)
    counts = np.bincount(rank_index.ravel())
    rank = (np.cumsum(counts) - counts / 2) / n
    harmonics = max(0, min(HARMONICS, int(worth * n) // 10, len(distinct) - 1))
    basis = np.cos(np.pi * np.outer(rank[rank_index.ravel()], np.arange(1, harmonics + 1)))
    basis -= basis.mean(axis=0)
    products = basis.T @ spread
    residual = np.sum(spread**2, axis=0) - np.sum(products * (np.linalg.pinv(basis.T @ basis) @ products), axis=0)
    return np.asarray(worth * residual / (worth * n - harmonics - 1))


def indices(values: Array, answers: Array, design: str, worth: float = 1.0) -> Indices | None:
    """The indices of ``answers`` [samples, points] with respect to ``values``
    [samples, unknowns] of a ``design``, over all points; None where the answers do not
    vary. NaN stands for a missing answer. Of samples that are the same each is ``worth``
    less than one."""
    count = values.shape[1]
    groups = list(_groups(answers, count if design == "saltelli" else 0, worth))
    if not groups:
        return None
    rng = np.random.default_rng(0)
    estimates = []
    for number in range(BOOTSTRAP_SAMPLES + 1):
        parts = []
        for rows, points in groups:
            chosen = rows if number == 0 else rng.choice(rows, round(worth * len(rows)))
            weight = worth if number == 0 else 1.0
            if design == "saltelli":
                matrices = answers[:, points].reshape(count + 2, -1, len(points))[:, chosen]
                estimate = saltelli(matrices[0], matrices[1], matrices[2:])
                parts.append(np.concatenate([part.reshape(-1, len(points)) for part in estimate]))
            else:
                first, variance = regression_indices(values[chosen], answers[np.ix_(chosen, points)], weight)
                parts.append(np.concatenate([first, variance[None]]))
        estimates.append(np.concatenate(parts, axis=1).sum(axis=1))
    estimated = np.array(estimates)
    if not estimated[0, -1] > 1e-12 * np.nanmax(np.abs(answers)) ** 2:
        return None
    shares = estimated[:, :-1] / np.where(estimated[:, -1:] > 0.0, estimated[:, -1:], np.nan)
    best, error = np.clip(shares[0], 0.0, 1.0), np.nanstd(shares[1:], axis=0)
    variance = estimated[0, -1] / sum(len(points) for _, points in groups)
    if design == "saltelli":
        return Indices(best[:count], error[:count], best[count:], error[count:], float(variance))
    return Indices(best, error, None, None, float(variance))


def _groups(answers: Array, unknowns: int, worth: float) -> Iterator[tuple[Array, Array]]:
    """Points that lack the same answers: the numbers of the samples that have one, and
    of the points. With ``unknowns``, for the design saltelli, a sample counts where all
    matrices have its answer."""
    present = np.isfinite(answers)
    if unknowns:
        present = np.asarray(present.reshape(unknowns + 2, -1, answers.shape[1]).all(axis=0))
    patterns, group = np.unique(present, axis=1, return_inverse=True)
    for number, pattern in enumerate(patterns.T):
        if worth * np.count_nonzero(pattern) >= MIN_SAMPLES:
            yield np.flatnonzero(pattern), np.flatnonzero(group.ravel() == number)


def answers_of(results: Results, severity: int | None = None) -> dict[str, Array]:
    """The answers of every sample [samples, points] by name: whether it is safe (1), is not
    (0), or that is not known (NaN); and the features that decide on the responses, each
    the greatest of all procedures."""
    safe, is_known = allowed_samples(results, severity)
    answers: dict[str, Array] = {SAFE: np.where(is_known, safe.astype(float), np.nan)}
    for name in model_in(results.attrs).check_features:
        if name in results.variables:
            is_known = known_runs(results) & (results["status"] == OK)
            if name == RESPONSES["stick_slip"].feature:  # that of the creep of a bit that is stalled is arbitrary
                is_known &= results["response"].astype(int) & STALLED == 0
            answers[name] = np.where(is_known, results[name], np.nan).max(axis=0)
    return {name: values.reshape(-1, values.shape[-1]).T for name, values in answers.items()}


def sensitivity(results: Results, severity: int | None = None) -> Answer:
    """Which unknown matters most, over all operating points of ``results``, as plain
    data in SI units.

    ``known``, ``failed``, ``pending``, ``of``: how many samples of all points are known to
    be safe or not, as plain data of :class:`nsdrill.analysis.counts.Counts`. ``answers``:
    of the safe run and of each feature the ``mean`` of those that are known, the standard
    ``deviation``, how many are ``missing``, and for each unknown ``first`` and ``total`` with their standard
    errors (``total`` None where the design does not determine it; it then lies between
    ``total_least`` and ``total_most``), and for the fifth of the samples in which the
    unknown is ``low``, and ``high``, the mean ``answer`` and the median ``value`` of
    the unknown. An unknown that is the same in all samples does not ``vary`` and has no
    index. ``alike``: whether all answers that are known are the same. With the design saltelli
    a mean is over the first two matrices, and ``pairs`` says from how many of their
    samples, ``known``, ``of`` how many, the indices are: all matrices have to have the
    answer. Of the safe run, every mean has the ends ``least`` and ``most`` beside it,
    and ``first`` the ends ``first_least`` and ``first_most`` (None where there is no
    such index): what it may be if all samples that are not known were unsafe, or all
    were safe. ``measure_first``: the key of the unknown whose measurement reduces the
    variance of a safe run most, the same in both cases; ``depends_on_unknown``: whether
    it is another, or none, in one of them."""
    check_samples(results, "sensitivity")
    check_judged(results, "sensitivity")
    uncertain = resolved_study(results.attrs).get("uncertain", {})
    design = str(uncertain.get("design", "sobol"))
    keys = [unknown.key for unknown in results.drawn]
    values = np.column_stack([*results.drawn.values()])
    if len(values) < MIN_SAMPLES:
        raise InputError(
            f"sensitivity: found {count(len(values), 'sample')}; allowed: at least {MIN_SAMPLES}. "
            "Run with more, uncertain.samples=64 say."
        )
    known = {name: numbers for name, numbers in uncertain.items() if name in {one.short for one in results.drawn}}
    pairs = model_in(results.attrs).pairs
    ordered = may_be_out_of_order(known, pairs)
    dependent = bool(uncertain.get("correlations") or len(uncertain.get("table") or ()) > 1 or ordered)
    if design == "saltelli":  # its columns stand in the order of the distributions
        order = [name for name in uncertain if name in {unknown.short for unknown in results.drawn}]
        columns = [order.index(unknown.short) for unknown in results.drawn]
    else:
        columns = list(range(len(keys)))
    samples, rows = independent(results), list[Answer]()
    effective, counted = effective_number(results, samples), len(values[samples])
    worth = effective / counted
    firsts = list[Answer | None]()
    for name, answers in answers_of(results, severity).items():
        found, drawn = (
            indices(values, answers, design, worth),
            list(zip(results.drawn, columns, values[samples].T, strict=True)),
        )
        row = _answer_row(name, answers, samples, found, results.attrs)
        if design == "saltelli":
            is_whole = np.isfinite(answers).reshape(len(keys) + 2, -1, answers.shape[1]).all(axis=0)
            row["pairs"] = {"known": int(np.count_nonzero(is_whole)), "of": is_whole.size}
        row["unknowns"] = [_unknown_row(*one, found, answers[samples], dependent) for one in drawn]
        if name == SAFE:
            firsts.append(_measure_first(row["unknowns"]))
            # whatever the samples are that are not known
            ends = [np.where(np.isfinite(answers), answers, filled) for filled in (0.0, 1.0)]
            if row["missing"]:
                cases = [indices(values, end, design, worth) for end in ends]
                firsts += [
                    _measure_first([_unknown_row(*one, case, end[samples], dependent) for one in drawn])
                    for case, end in zip(cases, ends, strict=True)
                ]
            else:
                cases = [found, found]
            _add_ends(row, [end[samples] for end in ends], drawn, (found, *cases))
        rows.append(row)
    same_first = len({one and one["key"] for one in firsts}) == 1
    is_known, status = allowed_samples(results, severity)[1], np.asarray(results["status"])
    runs = np.where(is_known, KNOWN, np.maximum(knowledge(status, known_runs(results)).max(axis=0), UNDECIDED))
    return {
        "kind": "sensitivity",
        "title": str(results.attrs.get("title") or ""),
        "overrides": overrides(results.attrs, thresholds=True),
        "severity": severity,
        "samples": len(results.coords[SAMPLE]),
        "counted": counted,
        "effective": effective,
        **known_before(results.attrs),
        "unsettled": unsettled_in(results),
        "design": design,
        "dependent": dependent,
        "ordered": ordered,
        "of_table": bool(uncertain.get("table")),
        "points": int(np.prod([len(results.coords[axis]) for axis in results.axes])),
        "at": {axis: word_or_number(axis, value) for axis, value in results.held.items()},
        "swept": list(results.swept),
        "histories": len(results.coords["procedure"]),
        "procedures": list(results.procedures),
        "answers": rows,
        **Counts.over(runs).at(),
        "measure_first": firsts[0] if same_first else None,
        "depends_on_unknown": not same_first,
    }


def _answer_row(name: str, answers: Array, samples: slice, found: Indices | None, attrs: Attributes) -> Answer:
    variable = named_in(attrs).get(name)
    return {
        "name": name,
        "meaning": variable.long_name if variable else "whether the class of the point allows it",
        "units": variable.units if variable else "1",
        "mean": _mean(answers[samples]),
        "deviation": None if found is None else float(np.sqrt(found.variance)),
        "alike": bool(np.isfinite(answers).any() and np.nanmin(answers) == np.nanmax(answers)),
        "missing": int(np.count_nonzero(~np.isfinite(answers))),
        "present": int(np.count_nonzero(np.isfinite(answers))),
    }


def _add_ends(
    row: Answer, answers: Sequence[Array], drawn: Sequence[tuple[Unknown, int, Array]], cases: Sequence[Indices | None]
) -> None:
    """Add to the ``row`` of the safe run what its numbers may be: ``answers`` are those
    with all samples that are not known unsafe, and all safe, ``cases`` the indices of
    the known samples and of these two."""
    row |= {"least": _mean(answers[0]), "most": _mean(answers[1])}
    for one, (_, column, values) in zip(row["unknowns"], drawn, strict=True):
        for end, is_chosen in _ends(values).items():
            one[end] |= {"least": _mean(answers[0][is_chosen]), "most": _mean(answers[1][is_chosen])}
        first = [float(case.first[column]) for case in cases if case is not None]
        is_whole = len(first) == len(cases) and one["varies"]
        one |= {"first_least": min(first) if is_whole else None, "first_most": max(first) if is_whole else None}


def _ends(drawn: Array) -> dict[str, Array]:
    """Which samples have the lowest and the highest values of an unknown: a fifth each, or
    those with the least and the greatest value where most have the same."""
    lowest, highest = np.quantile(drawn, [PART, 1.0 - PART])
    if lowest == highest:
        lowest, highest = drawn.min(), drawn.max()
    return {"low": drawn <= lowest, "high": drawn >= highest}


def _unknown_row(
    unknown: Unknown, column: int, drawn: Array, result: Indices | None, answers: Array, dependent: bool
) -> Answer:
    row: Answer = {
        "key": unknown.key,
        "varies": bool(drawn.min() < drawn.max()),
        **{
            end: {
                "answer": _mean(answers[is_chosen]),
                "value": float(np.median(drawn[is_chosen])),
                "units": unknown.units,
            }
            for end, is_chosen in _ends(drawn).items()
        },
        "first": None,
        "first_error": None,
        "total": None,
        "total_error": None,
        "total_least": None,
        "total_most": None,
    }
    if result is None or not row["varies"]:
        return row
    row |= {"first": float(result.first[column]), "first_error": float(result.first_error[column])}
    if result.total is not None and result.total_error is not None:
        row |= {"total": float(result.total[column]), "total_error": float(result.total_error[column])}
    elif not dependent:
        others = float(result.first.sum() - result.first[column])
        first_index = float(result.first[column])
        row |= {"total_least": first_index, "total_most": max(first_index, 1.0 - others)}
    return row


def _mean(values: Array) -> float | None:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else None


def _measure_first(rows: Sequence[Answer]) -> Answer | None:
    """The unknown to measure first, and the others whose indices do not differ from its
    index beyond their errors; None where no index differs from zero."""
    known = [row for row in rows if row["first"] is not None]
    if not known:
        return None
    best = max(known, key=lambda row: row["first"])
    if best["first"] <= NORMAL_QUANTILE * best["first_error"]:
        return None
    indistinguishable = [
        row["key"]
        for row in known
        if row is not best
        and best["first"] - row["first"] < NORMAL_QUANTILE * np.hypot(row["first_error"], best["first_error"])
    ]
    return {"key": best["key"], "first": best["first"], "alike": indistinguishable}
