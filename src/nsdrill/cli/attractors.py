"""The attractors of each operating point as a table, for nsdrill show."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from nsdrill.cli.show import in_words
from nsdrill.cli.words import count, value_text
from nsdrill.quantity import amount

MOST_ROWS = 48
MOST_OF_A_POINT = 5  # the smaller ones are told together


def show_attractors(summary: dict[str, Any], units: str) -> Iterator[str]:
    """A line for each attractor: its share, with its interval where the starts are a
    sample, and what it is."""
    points, axes = summary["operating_points"], summary["axes"]
    swept = [name for name, axis in axes.items() if axis["points"] > 1]
    rows: list[str] = []
    for point in points:
        where = ", ".join(value_text(name, point[name], units) for name in swept) or "all starts"
        rows += [
            f"  {where if not number else '':22s} {text}"
            for number, text in enumerate(_lines(point, units))
        ]
    yield (
        f"\nAttractors, by their share of the "
        f"{'slice' if summary['slice'] else 'starts (95 % interval)'}:"
    )
    for row in rows[:MOST_ROWS]:
        yield row.rstrip()
    if len(rows) > MOST_ROWS:
        yield f"  and {len(rows) - MOST_ROWS} more lines (all with --json)"
    yield from _warn(points)


def _lines(point: dict[str, Any], units: str) -> list[str]:
    found = point["attractors"]
    few = found if len(found) <= MOST_OF_A_POINT + 1 else found[:MOST_OF_A_POINT]
    lines = [_line(one, units) for one in few]
    if rest := found[len(few) :]:
        members, share = sum(one["members"] for one in rest), sum(one["share"] for one in rest)
        loose = sum(one["unsettled"] for one in rest)
        lines.append(
            f"   {100 * share:5.1f} %  in {len(rest)} smaller groups, {count(members, 'start')}, "
            f"{loose} unsettled"
        )
    for name in ("failed", "pending", "ungrouped"):
        if point[name]:
            lines.append(
                f"   {point[name]} "
                f"{'of the starts not yet grouped' if name == 'ungrouped' else name}"
            )
    return lines


def _line(one: dict[str, Any], units: str) -> str:
    interval = (
        "" if one["low"] is None else f" ({100 * one['low']:4.1f} to {100 * one['high']:5.1f})"
    )
    words = [in_words(one["response"]) if one["response"] != "none" else "no critical response"]
    if one["whirl_kind"] != "none":
        words.append(in_words(one["whirl_kind"]))
    if one.get("motion"):
        words.append(in_words(one["motion"]) + (f" {one['period']}" if one["period"] else ""))
    features = one["features"]
    if (lift := features.get("lift_off_fraction")) is not None and "bit_bounce" in one["response"]:
        words.append(f"off the rock {100 * lift:.1f} %")
    if (index := features.get("stick_slip_index")) is not None and "stick_slip" in one["response"]:
        words.append(f"index {index:.0f} %")
    if (radius := features.get("radius_max")) is not None:
        words.append(
            f"radius {1e3 * radius:.2f} mm"
            if units == "si"
            else f"radius {amount(radius, 'in', 3)}"
        )
    if one["unsettled"]:
        words.append(f"{one['unsettled']} of {one['members']} unsettled")
    return f"{one['number']:2d} {100 * one['share']:5.1f} %{interval}  {', '.join(words)}"


def _warn(points: list[dict[str, Any]]) -> Iterator[str]:
    loose = sum(point["unsettled"] for point in points)
    total = sum(point["starts"] - point["failed"] - point["pending"] for point in points)
    if total and loose > 0.05 * total:
        yield (
            f"  {loose} of {total} starts are unsettled: chaotic, or still on their way. A motion "
            f"that loses its share "
            "as simulation.transient grows is no attractor."
        )
