"""The attractors of each operating point as a table, for nsdrill show."""

from __future__ import annotations

from collections.abc import Iterator

from nsdrill.data import Answer
from nsdrill.models.responses import RESPONSE_KINDS, RESPONSES
from nsdrill.quantity import amount
from nsdrill.text.words import count, in_words, rest, value_text

MAX_ROWS = 48
MAX_ATTRACTORS = 5  # of one point; one line sums up the others


def attractor_lines(summary: Answer, units: str) -> Iterator[str]:
    """A line for each attractor: its share of the starts, with a confidence interval
    where they are drawn at random, and its motion."""
    points, axes = summary["operating_points"], summary["axes"]
    swept = [name for name, axis in axes.items() if axis["points"] > 1]
    rows: list[str] = []
    for point in points:
        where = ", ".join(value_text(name, point[name], units) for name in swept) or "all starts"
        rows += [f"  {where if not number else '':22s} {text}" for number, text in enumerate(_lines(point, units))]
    yield (f"\nAttractors, by their share of the {'slice' if summary['slice'] else 'starts (95 % interval)'}:")
    for row in rows[:MAX_ROWS]:
        yield row.rstrip()
    yield from rest(rows, MAX_ROWS, "lines (all with --json)")
    yield from _warning_lines(points)


def _lines(point: Answer, units: str) -> list[str]:
    attractors = point["attractors"]
    count_shown = len(attractors) if len(attractors) <= MAX_ATTRACTORS + 1 else MAX_ATTRACTORS
    lines = [_line(attractor, units) for attractor in attractors[:count_shown]]
    if others := attractors[count_shown:]:
        members, share, unsettled = (
            sum(attractor[name] for attractor in others) for name in ("members", "share", "unsettled")
        )
        lines.append(
            f"   {100 * share:5.1f} %  in {len(others)} smaller groups, {count(members, 'start')}, "
            f"{unsettled} unsettled"
        )
    for name in ("failed", "pending", "ungrouped"):
        if point[name]:
            lines.append(f"   {point[name]} {'of the starts not yet grouped' if name == 'ungrouped' else name}")
    return lines


def _line(attractor: Answer, units: str) -> str:
    interval = "" if attractor["low"] is None else f" ({100 * attractor['low']:4.1f} to {100 * attractor['high']:5.1f})"
    response = attractor["response"]
    words = [in_words(response) if response != "none" else "no critical response"]
    words += [in_words(attractor[name]) for name in RESPONSE_KINDS if attractor[name] != "none"]
    if attractor.get("motion"):
        words.append(in_words(attractor["motion"]) + (f" {attractor['period']}" if attractor["period"] else ""))
    features = attractor["features"]
    for one in RESPONSES.values():
        value = features.get(one.feature)
        if one.measured and value is not None and one.name in response:
            words.append(one.measured.format(one.percent(value)))
    if (radius := features.get("radius_max")) is not None:
        words.append(f"radius {1e3 * radius:.2f} mm" if units == "si" else f"radius {amount(radius, 'in', 3)}")
    if attractor["unsettled"]:
        words.append(f"{attractor['unsettled']} of {attractor['members']} unsettled")
    return f"{attractor['number']:2d} {100 * attractor['share']:5.1f} %{interval}  {', '.join(words)}"


def _warning_lines(points: list[Answer]) -> Iterator[str]:
    unsettled = sum(point["unsettled"] for point in points)
    total = sum(point["starts"] - point["failed"] - point["pending"] for point in points)
    if total and unsettled > 0.05 * total:
        yield (
            f"  {unsettled} of {total} starts are unsettled: chaotic, or still on their way. A "
            "motion that loses its share as simulation.transient grows is no attractor."
        )
