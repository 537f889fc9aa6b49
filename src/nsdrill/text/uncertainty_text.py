"""What is not certain, in words: the sensitivity to uncertain numbers, and the result of a fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from nsdrill.analysis.counts import open_words
from nsdrill.analysis.doubts import BEFORE
from nsdrill.analysis.grades import unsettled_words
from nsdrill.analysis.probability import safe_in_words, samples_text
from nsdrill.data import Answer
from nsdrill.errors import WITHOUT, count
from nsdrill.quantity import find, quantity, shown_scale, sign
from nsdrill.text.words import in_words, label_of, overrides_text, point_text
from nsdrill.words.variance import NOT_VARIED, without_indices

MIN_INDEX = 0.05  # first-order index: an unknown below it has no effect of its own


def sensitivity_lines(summary: Answer, units: str) -> Iterator[str]:
    """The summary in words."""
    where = point_text(summary["at"], units)
    points = f"{count(summary['points'], 'operating point')} over {' and '.join(map(label_of, summary['swept']))}"
    samples = f"{summary['samples']} samples"
    if summary["effective"] < summary["counted"] - 0.5:
        samples = samples_text(summary["counted"], summary["effective"])
    yield f"  {samples}, at {', '.join(filter(None, (where, points if summary['swept'] else '')))}"
    if summary["overrides"]:
        yield f"  overrides {overrides_text(summary['overrides'])}"
    for key, name, _, words_of in BEFORE:
        if doubt := summary[key]:
            yield f"  {name}: {words_of(doubt)}."
    if found := summary["unsettled"]:
        yield f"  NOT SETTLED: {unsettled_words(found)}."
    if words := open_words(summary, "samples"):
        yield f"  {words}: means and indices are of the others, in brackets what they may be with these"
    if summary["histories"] > 1:
        yield f"  {safe_in_words(summary['procedures'])}; of the other answers the greatest of the procedures"
    exact = summary["design"] == "saltelli"
    for answer in summary["answers"]:
        yield ""
        yield from _answer_lines(answer, units)
    yield ""
    yield conclusion(summary)
    if not exact:
        if not summary["dependent"]:
            yield "Total: between these bounds; with uncertain.design: saltelli it is estimated."
        elif summary["ordered"]:
            yield (
                "Total: not known, as draws against an order are left out, so that the unknowns depend on each "
                "other; with ranges that do not overlap, uncertain.design: saltelli estimates it."
            )
        else:
            yield "Total: not known, as the unknowns depend on each other; of independent ones saltelli estimates it."


def conclusion(summary: Answer) -> str:
    """Which unknown to measure first and why, or why that is not known."""
    first, safe = summary["measure_first"], summary["answers"][0]
    words = open_words(summary, "samples")
    if summary["known"] == 0:
        return f"Which unknown to measure first is not known: {words}."
    if summary["depends_on_unknown"] or (words and safe["deviation"] is None):
        return f"Which unknown to measure first is not known: {words}, and it depends on what they would show."
    if first is None:
        return _undecided(summary) + _not_varied(safe["unknowns"])
    alike = ", ".join(label_of(key) for key in first["alike"])
    also = f" (so few samples cannot distinguish it from {alike})" if alike else ""
    row = next(row for row in safe["unknowns"] if row["key"] == first["key"])
    low, high = (_amount_within(row[end], "1", words) for end in ("low", "high"))
    share = f"{100 * first['first']:.0f} %"
    if words and row["first_least"] is not None:
        share += f" ({100 * row['first_least']:.0f} to {100 * row['first_most']:.0f})"
    among = f" {words}; in brackets what it may be with these." if words else ""
    return (
        f"Measure first: {label_of(first['key'])} ({first['key']}). It alone causes {share} of "
        f"the variance of a safe run{also}: {low} are safe where it is low, {high} where it is high.{among}"
        f"{_not_varied(safe['unknowns'])}"
    )


def _not_varied(unknowns: Sequence[Answer]) -> str:
    """Of which unknowns the samples say nothing."""
    names = [label_of(row["key"]) for row in unknowns if not row["varies"]]
    if not names:
        return ""
    are, its = ("are", "their effects are") if len(names) > 1 else ("is", "its effect is")
    return f" {' and '.join(names)} {are} {NOT_VARIED}: {its} not known."


def _amount_within(end: Answer, units: str, is_open: object) -> str:
    """A mean of an answer, and where not all samples are known what it may be."""
    text = _amount(end["answer"], units)
    if not is_open or end.get("least") is None or end["least"] == end["most"]:
        return text
    return f"{text} ({100 * end['least']:.0f} to {100 * end['most']:.0f})"


def _answer_lines(answer: Answer, units: str) -> Iterator[str]:
    """The mean of an answer, and the share of each unknown in its variance."""
    mean, name, of = answer["mean"], in_words(answer["name"]), answer["units"]
    missing = answer["missing"]
    lacking = f"; {missing} of {missing + answer['present']} not known" if missing else ""
    if mean is None:
        yield f"{name}: not known{lacking}."
        return
    within = _amount_within({"answer": mean, **answer}, of, missing)
    if answer["deviation"] is None:
        yield f"{name}: {within} {without_indices(answer)}{lacking}."
        return
    pairs = answer.get("pairs")
    if pairs and pairs["known"] < pairs["of"]:
        lacking += f"; indices from the {pairs['known']} of {pairs['of']} pairs of samples of which all runs are known"
    yield f"{name}: {within} on average{lacking}"
    yield f"  {'unknown':26s}{'first':>16s}{'total':>16s}   where it is low, and high"
    for row in sorted(answer["unknowns"], key=lambda row: -(row["first"] or 0.0)):
        if not row["varies"]:
            value = quantity(row["key"]).text(row["low"]["value"], units, 3)
            yield f"  {label_of(row['key']):26s}{'not known':>16s}{'not known':>16s}   {value}, {NOT_VARIED}"
            continue
        low, high = (quantity(row["key"]).text(row[end]["value"], units, 3) for end in ("low", "high"))
        index = _index(row["first"], row["first_error"])
        amounts = [_amount_within(row[end], of, missing) for end in ("low", "high")]
        yield (
            f"  {label_of(row['key']):26s}{index:>16s}{_total(row):>16s}   "
            f"{amounts[0]} at {low}, {amounts[1]} at {high}"
        )


def _amount(value: float | None, units: str) -> str:
    """A share, whose ``units`` are "1", or a percentage."""
    return "none" if value is None else f"{100 * value:.1f} %" if units == "1" else f"{value:.4g} %"


def _undecided(summary: Answer) -> str:
    """Why no unknown is to be measured first: all samples agree, they are too few for
    indices, the indices are within the error of so few samples, or no unknown has an effect
    of its own."""
    safe = summary["answers"][0]
    if safe["deviation"] is None and safe["alike"]:
        is_varied = all(row["varies"] for row in safe["unknowns"])
        return f"All samples agree on whether they are safe{': no measurement would change that' * is_varied}."
    if safe["deviation"] is None:
        return (
            f"{samples_text(summary['counted'], summary['effective'])} are too few to say which unknown to measure "
            f"first. Run with four times as many{_four_times(summary)}."
        )
    rows = [row for row in safe["unknowns"] if row["first"] is not None]
    best = max(rows, key=lambda row: float(row["first"]), default=None)
    if best is None or best["first"] < MIN_INDEX:
        return "No unknown alone decides whether a run is safe: their combinations do."
    index = _index(best["first"], best["first_error"])
    return (
        f"{summary['samples']} samples are too few to say which unknown to measure first: the largest "
        f"index of the safe run, that of {label_of(best['key'])}, is {index}, which may be "
        f"chance. Run with four times as many{_four_times(summary)}."
    )


def _four_times(summary: Answer) -> str:
    """The option that asks for four times the samples; none where they are those of a table."""
    if summary["of_table"]:
        return ""
    pairs = summary["answers"][0].get("pairs")
    samples = pairs["of"] // summary["points"] if pairs else summary["samples"]
    return f" (--set uncertain.samples={4 * samples})"


def _index(value: float, error: float) -> str:
    return f"{value:.2f} +- {error:.2f}"


def _total(row: Answer) -> str:
    if row["total"] is not None:
        return _index(row["total"], row["total_error"])
    if row["total_least"] is None:
        return "not known"
    return f"{row['total_least']:.2f} to {row['total_most']:.2f}"


def fit_lines(summary: Answer, units: str) -> Iterator[str]:
    """The summary of a fit, in words."""
    yield (
        f"{summary['data']}: {count(summary['points'], 'operating point')}, "
        f"{count(summary['values'], 'measured value')}."
    )
    for note in summary["notes"]:
        yield f"  {note}"
    failed = f", {summary['failed']} of them failed" if summary["failed"] else ""
    for name, number in summary["undefined"].items():
        failed += f", {number} without {name}"
    if summary["left_out"]:
        failed += f", {summary['left_out']} left out as they are against the order of two unknowns"
    yield (
        f"{summary['samples']} samples in {count(summary['rounds'], 'round')}{failed}; effective "
        f"number of samples {summary['effective']:.0f}."
    )
    yield ""
    yield from _unknown_lines(summary, units)
    if scaled := summary["scale_not_seen"]:
        others = f"; of what is measured only {', '.join(scaled['others'])} may" if scaled["others"] else ""
        yield (
            f"  A torque or a weight whose scale is off at all points alike makes {' and '.join(scaled['unknowns'])} "
            f"off by that share or more, and the deviations of the torque do not show it{others}: check the scales."
        )
    yield ""
    yield from _feature_lines(summary, units)
    for verdict in verdicts(summary):
        yield ""
        yield verdict


def _unknown_lines(summary: Answer, units: str) -> Iterator[str]:
    width = max(len(row["key"]) for row in summary["unknowns"])
    yield (f"{'':{width + 2}s} {'before, 5 to 95 %':>24s}   {'after, 5 to 95 %':>24s} {'median':>10s}")
    for row in summary["unknowns"]:
        numbers, unit = _in_shown_unit(row["key"], row["prior"] + row["posterior"], row["units"], units)
        before, after = (f"{a:.4g} to {b:.4g}" for a, b in ((numbers[0], numbers[2]), (numbers[3], numbers[5])))
        information = f"{100 * row['width']:.0f} % of the width before: {_information(row, summary['doubts'])}"
        yield (f"  {row['key']:{width}s} {before:>24s}   {after:>24s} {numbers[4]:10.4g} {unit:10s} {information}")


INFORMATION_WORDS = {
    "well": "determined",
    "partly": "partly determined",
    "not": "NOT DETERMINED by these data",
    "on_this_branch": "DETERMINED ONLY IF the well was in the motion of the runs",
}
WHY_UNKNOWN = {  # by the doubt of the fit
    "failed": "as samples failed",
    "unmatched": "as no run gives the data",
    "unsettled": "as motions had not settled",
    "unfinished": "as too few samples count",
}


def _information(row: Answer, doubts: Sequence[str]) -> str:
    """What the data tell of an unknown, in words."""
    return f"NOT KNOWN, {WHY_UNKNOWN[doubts[0]]}" if row["told"] == "unknown" else INFORMATION_WORDS[row["told"]]


def _feature_lines(summary: Answer, units: str) -> Iterator[str]:
    width = max(len(row["name"]) for row in summary["features"])
    yield f"{'':{width + 2}s} {'values':>6s} {'error':>10s} {'spread':>10s}"
    for row in summary["features"]:
        numbers, unit = _in_shown_unit(row["name"], [row["error"], row["spread"]], "", units)
        yield (
            f"  {row['name']:{width}s} {row['points']:6d} {numbers[0]:10.4g} {numbers[1]:10.4g} {unit:10s} off by "
            f"{row['deviation']:.2g} deviations"
        )


def _in_shown_unit(name: str, values: list[float], si: str, units: str) -> tuple[list[float], str]:
    """Values in the unit in which the quantity ``name`` is shown, and the sign of that
    unit."""
    known = find(name)
    unit, base = (known.unit(units), known.units) if known is not None else (si, si)
    scale = shown_scale(unit, base) if unit not in ("", "percent") else 1.0
    return [value / scale for value in values], sign(unit)


def verdicts(summary: Answer) -> Iterator[str]:
    """The conclusions from a fit, in sentences."""
    undetermined = [row["key"] for row in summary["unknowns"] if row["told"] == "not"]
    is_finished, is_settled = (name not in summary["doubts"] for name in ("unfinished", "unsettled"))
    if not is_finished:
        yield (
            f"NOT FINISHED: only {summary['effective']:.0f} samples count; the intervals are rough"
            f"{' and too wide' if summary['beta'] < 1 and not summary['failed'] else ''}. Give more with --rounds or "
            "--batch."
        )
    if not is_settled:
        best = "" if summary["best_settled"] else " the best one among them,"
        yield (
            f"NOT SETTLED: in {100 * summary['unsettled']:.0f} % of the samples, by weight,{best} a motion at some "
            "point was still changing when it was observed, or was observed over too few periods to tell: the "
            "intervals may be those of a passing motion. Run for longer (simulation.transient, simulation.observe)."
        )
    if failed := summary["failed"]:
        yield (
            f"FAILED: {failed} of {summary['samples']} samples, and what they would give is not known: values of the "
            "unknowns that make runs fail are left out. The intervals are not known: they may be too narrow, and the "
            "truth may lie outside. Run with a larger simulation.max_steps."
        )
    for name, number in summary["undefined"].items():
        yield (
            f"WITHOUT {name}: {number} of {summary['samples']} samples. A run with these values of the unknowns does "
            f"not have it, {WITHOUT.get(name, 'as its motion is of another kind')}; they are left out, as they do not "
            "give these data."
        )
    if both := summary["history"]:
        yield (
            f"HISTORY DECIDES at {both['points']} of {count(both['of'], 'setting')}: steady drilling and stick-slip "
            f"are both possible there, with up to {100 * both['share']:.0f} % of the values of the unknowns. Each run "
            "began as the study does; a well that came there another way may have been in the other motion, and right "
            "values may have been left out. Use settings at which one motion alone is possible, or give the runs the "
            "start of the well (initial)."
        )
    if len(undetermined) == len(summary["unknowns"]):
        yield (
            "THE DATA DETERMINE NONE of the unknowns: they are as uncertain as before. Measure at other "
            "settings, or another quantity that the unknowns change."
        )
    elif undetermined:
        yield (f"THE DATA DO NOT DETERMINE {', '.join(undetermined)}, which is as uncertain as before.")
    for pair in summary["together"]:
        direction = "together" if pair["correlation"] > 0 else "against each other"
        on_branch = "if the well was in the motion of the runs, " if summary["history"] else ""
        yield (
            f"{' and '.join(pair['keys'])} go {direction} (correlation {pair['correlation']:.2f}): {on_branch}the data "
            "determine a combination of the two better than either. Use the joint samples of the written study."
        )
    for row in summary["unknowns"]:
        if row["at_the_end"]:
            yield (
                f"{row['key']} is at the {row['at_the_end']} end of its distribution: the data agree best with "
                "values beyond it. Widen the distribution, or doubt the data or the model."
            )
    if not summary["explained"]:
        worst = max(summary["features"], key=lambda row: float(row["deviation"]))["name"]
        off = (
            f"{summary['misfit'] ** 0.5:.2g} times the errors (probability {summary['chance']:.1g}), most in {worst}. "
            "The intervals above then mean little."
        )
        if is_finished and is_settled and not failed:
            yield (
                f"THE MODEL DOES NOT GIVE THESE DATA with any values of the unknowns: its best run is off by {off} "
                "Doubt the errors, the other numbers of the study, or the model."
            )
        else:
            first = " and ".join(
                ["finish the search"] * (not is_finished)
                + ["let the motions settle"] * (not is_settled)
                + ["let no sample fail"] * bool(failed)
            )
            yield f"NO RUN SO FAR GIVES THESE DATA: the best is off by {off} First {first}."
