"""The sensitivity to uncertain numbers, in words."""

from __future__ import annotations

from collections.abc import Iterator

from nsdrill.data import Answer
from nsdrill.quantity import quantity
from nsdrill.text.words import count, in_words, label_of, overrides_text, point_text

MIN_INDEX = 0.05  # first-order index: an unknown below it has no effect of its own


def lines(summary: Answer, units: str) -> Iterator[str]:
    """The summary in words."""
    where = point_text(summary["at"], units)
    points = f"{count(summary['points'], 'operating point')} over {' and '.join(map(label_of, summary['swept']))}"
    yield (f"  {summary['samples']} samples, at {', '.join(filter(None, (where, points if summary['swept'] else '')))}")
    if summary["overrides"]:
        yield f"  overrides {overrides_text(summary['overrides'])}"
    if summary["histories"] > 1:
        yield "  safe in every procedure; of the other answers the greatest of the procedures"
    exact = summary["design"] == "saltelli"
    for answer in summary["answers"]:
        yield ""
        yield from _answer_lines(answer, units)
    yield ""
    first = summary["measure_first"]
    if first is None:
        constant = summary["answers"][0]["deviation"] is None
        yield (
            "All samples agree on whether they are safe: no measurement would change that."
            if constant
            else _undecided(summary)
        )
    else:
        alike = ", ".join(label_of(key) for key in first["alike"])
        also = f" (so few samples cannot distinguish it from {alike})" if alike else ""
        yield (
            f"Measure first: {label_of(first['key'])} ({first['key']}). It alone causes "
            f"{100 * first['first']:.0f} % of the variance of a safe run{also}."
        )
    if not exact:
        reason = "the unknowns depend on each other" if summary["dependent"] else "between these bounds"
        yield f"Total: {reason}; with uncertain.design: saltelli it is estimated."


def _answer_lines(answer: Answer, units: str) -> Iterator[str]:
    """The mean of an answer, and the share of each unknown in its variance."""

    def text(value: float | None) -> str:
        return "none" if value is None else f"{100 * value:.1f} %" if answer["units"] == "1" else f"{value:.4g} %"

    mean, name = answer["mean"], in_words(answer["name"])
    if mean is None:
        yield f"{name}: not known, as too many runs failed."
        return
    if answer["deviation"] is None:
        yield f"{name}: {text(mean)} in every sample, whatever the unknowns are."
        return
    yield f"{name}: {text(mean)} on average"
    yield f"  {'unknown':26s}{'first':>16s}{'total':>16s}   where it is low, and high"
    for row in sorted(answer["unknowns"], key=lambda row: -row["first"]):
        low, high = (quantity(row["key"]).text(row[end]["value"], units, 3) for end in ("low", "high"))
        index = _index(row["first"], row["first_error"])
        yield (
            f"  {label_of(row['key']):26s}{index:>16s}{_total(row):>16s}   "
            f"{text(row['low']['answer'])} at {low}, {text(row['high']['answer'])} at {high}"
        )


def _undecided(summary: Answer) -> str:
    """Why no unknown is to be measured first: the indices are within the error of so
    few samples, or no unknown has an effect of its own."""
    rows = [row for row in summary["answers"][0]["unknowns"] if row["first"] is not None]
    best = max(rows, key=lambda row: float(row["first"]), default=None)
    if best is None or best["first"] < MIN_INDEX:
        return "No unknown alone decides whether a run is safe: their combinations do."
    index = _index(best["first"], best["first_error"])
    return (
        f"{summary['samples']} samples are too few to say which unknown to measure first: the largest "
        f"index of the safe run, that of {label_of(best['key'])}, is {index}, which may be "
        f"chance. Run with four times as many: --set uncertain.samples={4 * summary['samples']}."
    )


def _index(value: float, error: float) -> str:
    return f"{value:.2f} +- {error:.2f}"


def _total(row: Answer) -> str:
    if row["total"] is not None:
        return _index(row["total"], row["total_error"])
    if row["total_least"] is None:
        return "not known"
    return f"{row['total_least']:.2f} to {row['total_most']:.2f}"
