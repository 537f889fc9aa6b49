"""The summary of a safe window in words; see
:func:`nsdrill.analysis.window.find_window` for the data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from nsdrill.analysis.window import unknown_words
from nsdrill.cli.words import count, samples_text
from nsdrill.cli.words import label_of as name_of
from nsdrill.quantity import quantity, sign
from nsdrill.units import from_si
from nsdrill.variables import AXES

ORDER = ("depth", "wob", "rotary_speed")  # the order in which drillers name them
SIDES = {"less": "less", "more": "more"}
SIDES_OF_DEPTH = {"less": "shallower", "more": "deeper"}
MAX_ROWS = 24
CLASS_LABELS = {"rim": "history-dependent"}  # of the keys that are not words of the text


def _axis_order(axis: str) -> tuple[int, str]:
    """The sort key of an axis: :data:`ORDER`, then further axes by name."""
    return (ORDER.index(axis) if axis in ORDER else len(ORDER), axis)


class Formatter:
    """Values as text in one system of units; a speed in rad/s with the rpm in
    brackets."""

    def __init__(self, units: str) -> None:
        self.system = units

    def unit(self, axis: str) -> str:
        """The sign of the unit of an axis."""
        return sign(quantity(axis).unit(self.system))

    def number(self, axis: str, value: float) -> str:
        unit = quantity(axis).unit(self.system)
        shown = from_si(value, unit) if unit else value
        return f"{shown:.0f}" if abs(shown) >= 1e4 else f"{shown:.4g}"

    def value(self, axis: str, value: float | str) -> str:
        if isinstance(value, str):  # a word
            return value
        return f"{self.number(axis, value)} {self.unit(axis)}".rstrip() + self._rpm(axis, value)

    def span(self, axis: str, ends: list[float]) -> str:
        if ends[0] == ends[1]:
            return f"{name_of(axis)} {self.value(axis, ends[0])}"
        return (
            f"{name_of(axis)} {self.number(axis, ends[0])} to {self.number(axis, ends[1])} "
            f"{self.unit(axis)}" + (self._rpm(axis, *ends))
        )

    def _rpm(self, axis: str, *values: float) -> str:
        if self.system == "field" or axis != "rotary_speed":
            return ""
        speeds = " to ".join(f"{from_si(value, 'rpm'):.3g}" for value in values)
        return f" ({speeds} rpm)"


def lines(summary: dict[str, Any], units: str) -> Iterator[str]:
    """The lines of the summary in the units ``si`` or ``field``."""
    fmt = Formatter(units)
    yield from _basis_lines(summary, fmt)
    yield ""
    held = ", ".join(fmt.value(axis, value) for axis, value in summary["fixed"].items())
    yield f"{f'At {held}' if held else 'In all'}: {_shares(summary)}."
    if summary["confidence"] is not None:
        yield from _by_procedure(summary, fmt)
    elif summary["history_examined"] and len(summary["safe_in"]) > 1:
        by_procedure = ", ".join(f"{n} {procedure}" for procedure, n in summary["safe_in"].items())
        yield f"Each procedure by itself: safe at {by_procedure}."
    if summary["safe"] == 0:
        yield from _no_window(summary, fmt)
    several = len(summary["maps"]) > 1
    if several:
        yield ""
        yield from _map_table(summary, fmt)
    if summary["depth"]:
        yield from _over_depth(summary, fmt, table=not several and len(summary["axes"]) > 1)
    plane = summary["throughout"] if several else summary["maps"][0]
    if several:
        yield ""
        third = summary["third"]
        yield (
            f"Safe at every {name_of(third)} of the file: {plane['safe']} of "
            f"{count(plane['points'], 'point')}."
        )
    if plane["safe"]:
        yield ""
        yield from _map_lines(summary, plane, fmt)
    yield from _confidence_cost(summary, fmt)


def _confidence_cost(summary: dict[str, Any], fmt: Formatter) -> Iterator[str]:
    """The cost of more confidence: safe points, and the rate of penetration."""
    if not summary["price"]:
        return
    yield ""
    yield "What the confidence costs:"
    for row in summary["price"]:
        text = (
            f"  {100 * row['confidence']:4g} %  {row['safe']:5d} safe ({100 * row['share']:.1f} %)"
        )
        if best := row["fastest"]:
            axes = sorted(
                (axis for axis in (*summary["axes"], summary["third"]) if axis), key=_axis_order
            )
            where = ", ".join(fmt.value(axis, best[axis]) for axis in axes)
            text += f"; fastest {where}, {_rate(best, fmt)}"
        yield text


def _rate(best: dict[str, Any], fmt: Formatter) -> str:
    return fmt.value("rate_of_penetration", best["rate_of_penetration"])


def _by_procedure(summary: dict[str, Any], fmt: Formatter) -> Iterator[str]:
    """The window of each procedure by itself, for comparison with the window of all."""
    for row in summary["alone"]:
        best = row.get("recommended")
        where = ""
        if best:
            at = ", ".join(
                fmt.value(axis, best[axis]) for axis in sorted(summary["axes"], key=_axis_order)
            )
            where = f"; best at {at}, safe with {_percent(best)}"
        yield (
            f"By itself, {row['procedure']}: {row['safe']} safe ({100 * row['share']['safe']:.1f} "
            f"%){where}."
        )


def _percent(best: dict[str, Any]) -> str:
    """``97.3 % (94.4 to 98.7)``."""
    ends = " to ".join(f"{100 * best[f'probability_{end}']:.1f}" for end in ("low", "high"))
    return f"{100 * best['probability']:.1f} % ({ends})"


def _basis_lines(summary: dict[str, Any], fmt: Formatter) -> Iterator[str]:
    """The meaning of the classes of points, and what the results do not cover."""
    if summary["overrides"]:
        yield (
            f"  overrides "
            f"{'; '.join(f'{key} = {value}' for key, value in summary['overrides'].items())}"
        )
    condition = "without a critical response"
    if summary["severity"] is not None:
        condition = f"with no severity above {summary['severity']}"
    if summary["confidence"] is not None:
        by = (
            f" in every procedure, {' and '.join(summary['procedures'])},"
            if summary["history_examined"]
            else ""
        )
        samples = samples_text(summary["counted"], summary["effective"])
        yield (
            f"  safe      {100 * summary['confidence']:g} % or more of {samples} of the uncertain "
            f"numbers end well{by} {condition}"
        )
        if not summary["history_examined"]:
            yield (
                f"  HISTORY WAS NOT EXAMINED: the file holds one procedure only "
                f"({summary['procedures'][0]}). Run the "
                "study with procedure: up-down\n  to learn whether the window holds whatever came "
                "before."
            )
        yield "  critical  fewer of them"
    elif summary["history_examined"]:
        by = " and ".join(summary["procedures"])
        if summary["histories"] > len(summary["procedures"]):
            by += f", {summary['histories']} histories in all"
        yield f"  safe      every run of the point ended well {condition}: {by}"
        yield f"  {CLASS_LABELS['rim']}"
        yield "            safe in some only: it depends on how one came there"
    else:
        yield f"  safe      the run of the point ended well {condition}"
        yield (
            f"  HISTORY WAS NOT EXAMINED: the file holds one procedure only "
            f"({summary['procedures'][0]}). Run the "
            "study with procedure: up-down\n  to learn whether the window holds whatever came "
            "before."
        )
    if summary["confidence"] is None:
        yield "  critical  no run of the point was safe"
    for speed in summary.get("passed_over", ()):
        speeds = fmt.span(speed["axis"], [speed["min"], speed["max"]]).removeprefix(
            f"{name_of(speed['axis'])} "
        )
        where = "" if speed["everywhere"] else " (in a part of the study)"
        yield (
            f"  THE SWEEP BEGINS at {fmt.value(speed['axis'], speed['from'])}, above "
            f"{speed['words']}, "
            f"{speeds}{where}.\n  A "
            "string that is brought up to speed passes through that: a point that is safe here "
            "need not be safe then."
        )
    if summary["unknown"]:
        yield (
            "  unknown   a run failed or has no severity, and the others leave it open; no window "
            "goes there"
        )
    if summary["failed_runs"]:
        points = count(summary["failed_points"], "point")
        yield f"  {summary['failed_runs']} of {count(summary['runs'], 'run')} failed, at {points}."
    if summary["distrusted_points"]:
        is_single = summary["distrusted_points"] == 1
        predicate = (
            "is marked as not to be trusted and counts"
            if is_single
            else "are marked as not to be trusted and count"
        )
        yield f"  {count(summary['distrusted_points'], 'point')} {predicate} as not safe."


def _shares(summary: dict[str, Any]) -> str:
    words = tuple(
        word
        for word in _columns({**summary, "unknown": 0})
        if word != "rim" or summary["history_examined"]
    )
    parts = [
        f"{summary[word]} {CLASS_LABELS.get(word, word)} ({100 * summary['share'][word]:.1f} %)"
        for word in words
    ]
    if summary["unknown"]:
        parts.append(
            f"{summary['unknown']} unknown ({unknown_words(summary)}, "
            f"{100 * summary['share']['unknown']:.1f} %)"
        )
    return f"of {count(summary['points'], 'point')} {', '.join(parts)}"


def _columns(summary: dict[str, Any]) -> tuple[str, ...]:
    """The classes of points in the tables of this summary."""
    if summary["confidence"] is not None:
        return ("safe", "critical", "unknown") if summary["unknown"] else ("safe", "critical")
    return (
        ("safe", "rim", "critical", "unknown")
        if summary["unknown"]
        else ("safe", "rim", "critical")
    )


def _headings(summary: dict[str, Any]) -> str:
    return "".join(f"{CLASS_LABELS.get(word, word):>{_width(word)}s}" for word in _columns(summary))


def _row(summary: dict[str, Any], counts: dict[str, Any]) -> str:
    return "".join(
        f"{100 * counts['share'][word]:{_width(word) - 2}.1f} %" for word in _columns(summary)
    )


def _width(word: str) -> int:
    """The width of the column of a class of points."""
    return max(10, 2 + len(CLASS_LABELS.get(word, word)))


def _no_window(summary: dict[str, Any], fmt: Formatter) -> Iterator[str]:
    obstacles = [
        f"{_words(name)} at {count}" for name, count in summary["obstacles"].items() if count
    ]
    noun = "point" if summary["points"] == 1 else "points"
    result, subject = "There is no safe point.", "Critical responses, in any history"
    if summary["confidence"] is not None:
        result = f"No point is safe with {100 * summary['confidence']:g} %."
        percent = 100 * (1 - summary["confidence"]) / 3
        subject = f"Critical responses in {percent:.2g} % of the samples or more, in any history"
    yield result + (f" {subject}: {', '.join(obstacles)} {noun}." if obstacles else "")
    if best := summary["most_probable"]:
        axes = sorted(
            (axis for axis in (*summary["axes"], summary["third"]) if axis), key=_axis_order
        )
        at = ", ".join(fmt.value(axis, best[axis]) for axis in axes)
        ties = ""
        if best["ties"]:
            first = ", of which this drills fastest" if "rate_of_penetration" in best else ""
            ties = f" {count(best['ties'], 'other point')} as probable{first}."
        yield f"Most probably safe: {at}, with {_percent(best)}.{_drilling_text(best, fmt)}{ties}"
    if summary["severity"] is None:
        yield (
            "How bad they are, the severities say: --severity 1 (or 2, 3) allows runs up to that; "
            "`nsdrill "
            "classify` moves the thresholds."
        )


def _map_table(summary: dict[str, Any], fmt: Formatter) -> Iterator[str]:
    third = summary["third"]
    maps = summary["maps"]
    width = max(12, *(len(fmt.value(third, plane["at"][third])) for plane in maps))
    yield f"{name_of(third):>{width}s}{_headings(summary)}   recommended, and how far from there"
    for plane in _evenly_spaced(maps):
        yield (
            f"{fmt.value(third, plane['at'][third]):>{width}s}{_row(summary, plane)}   "
            f"{_recommendation(summary, plane, fmt)}"
        )
    if len(maps) > MAX_ROWS:
        yield f"  ({MAX_ROWS} of {len(maps)}; all with --json)"


def _evenly_spaced(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """At most :data:`MAX_ROWS` of the ``rows``, evenly spaced, with the first and the
    last."""
    if len(rows) <= MAX_ROWS:
        return rows
    return [rows[round(number * (len(rows) - 1) / (MAX_ROWS - 1))] for number in range(MAX_ROWS)]


def _recommendation(summary: dict[str, Any], plane: dict[str, Any], fmt: Formatter) -> str:
    """``20 kN (-8 +10), 3 rad/s (-0.4 +0.6)``."""
    best = plane["recommended"]
    if best is None:
        return "none"
    parts = []
    for axis in sorted(summary["axes"], key=_axis_order):
        down, up = (fmt.number(axis, best["margins"][axis][side]["margin"]) for side in SIDES)
        name = f"{name_of(axis)} " if axis not in AXES else ""
        value = f"{name}{fmt.number(axis, best[axis])} {fmt.unit(axis)}".rstrip()
        parts.append(f"{value} (-{down} +{up})")
    return ", ".join(parts)


def _map_lines(summary: dict[str, Any], plane: dict[str, Any], fmt: Formatter) -> Iterator[str]:
    """The regions and the recommended point of one map."""
    axes = sorted(summary["axes"], key=_axis_order)
    if len(axes) == 1:
        yield f"Safe {'interval' if len(plane['regions']) == 1 else 'intervals'}:"
        for area in sorted(plane["regions"][:MAX_ROWS], key=lambda area: float(area[axes[0]][0])):
            yield f"  {fmt.span(axes[0], area[axes[0]])}: {count(area['points'], 'point')}"
        if len(plane["regions"]) > MAX_ROWS:
            yield f"  and {len(plane['regions']) - MAX_ROWS} smaller ones (all with --json)"
    else:
        area = plane["regions"][0]
        spans = ", ".join(fmt.span(axis, area[axis]) for axis in axes)
        others = f"; {len(plane['regions'])} regions in all" if len(plane["regions"]) > 1 else ""
        yield (
            f"Largest safe region: {count(area['points'], 'point')} ({100 * area['share']:.1f} % "
            f"of the map) within "
            f"{spans}{others}."
        )
    best = plane["recommended"]
    yield (
        "Recommended: "
        f"{', '.join(fmt.value(axis, best[axis]) for axis in axes)}.{_drilling_text(best, fmt)}"
    )
    if "probability" in best:
        yield (
            f"  safe with a probability of {_percent(best)}; in brackets the 95 % interval from "
            f"the number of samples"
        )
    for axis in axes:
        other = (
            "" if len(axes) == 1 else f", the {name_of(next(a for a in axes if a != axis))} held"
        )
        yield f"  {name_of(axis)}{other}:"
        for side, word in (SIDES_OF_DEPTH if axis == "depth" else SIDES).items():
            yield f"    {word} {_limit_text(axis, best['margins'][axis][side], fmt)}"
    sides = [side for axis in axes for side in best["margins"][axis].values()]
    if any(side["margin"] == 0.0 for side in sides):
        yield (
            "It has no room to one side or more: a hint, not a setting. A finer map around it "
            "would tell."
        )
    fastest = plane["fastest"]
    if fastest is not None and any(fastest[axis] != best[axis] for axis in axes):
        where = ", ".join(fmt.value(axis, fastest[axis]) for axis in axes)
        yield f"Fastest safe point, whatever room it has: {where}.{_drilling_text(fastest, fmt)}"
    yield (
        "Limits lie between the last safe point and the next one; finer axes bring them closer "
        "together.\n"
        "What a window does not tell: Limits of validity, docs/limits.md."
    )


def _drilling_text(point: dict[str, Any], fmt: Formatter) -> str:
    """The rate of penetration and the specific energy at a point, as a sentence; ""
    where the file does not have them."""
    words = {
        "rate_of_penetration": "rate of penetration",
        "mechanical_specific_energy": "specific energy",
    }
    parts = [
        f"{word} {fmt.value(name, point[name])}" for name, word in words.items() if name in point
    ]
    return f" {parts[0][0].upper()}{', '.join(parts)[1:]}." if parts else ""


def _limit_text(axis: str, limit: dict[str, Any], fmt: Formatter) -> str:
    text = f"by {fmt.value(axis, limit['margin'])} to {fmt.value(axis, limit['safe_to'])}"
    if limit["margin"] == 0.0:
        text = "not at all"
    if limit["why"] == "edge":
        return f"{text}: the edge of the map, nothing is known beyond"
    reason = {
        "failed": "a run failed",
        "distrusted": "not to be trusted",
        "unknown": "no severity is known",
    }.get(limit["why"], "critical")
    if limit["responses"] and limit["why"] not in ("failed", "unknown"):
        reason = ", ".join(_words(name) for name in limit["responses"])
    if limit["why"] == "rim":
        reason += ", depending on the history"
    return f"{text}; at {fmt.value(axis, limit['first_not_safe'])} {reason}"


def _over_depth(summary: dict[str, Any], fmt: Formatter, table: bool) -> Iterator[str]:
    """The depths at which the window is open, closes and opens again."""
    depth = summary["depth"]
    rows = depth["rows"]
    if table:
        yield ""
        yield f"{'depth':>12s}{_headings(summary)}"
        for row in _evenly_spaced(rows):
            yield f"{fmt.value('depth', row['depth']):>12s}{_row(summary, row)}"
        if len(rows) > MAX_ROWS:
            yield f"  ({MAX_ROWS} of {len(rows)}; all with --json)"
    yield ""
    if not depth["open"]:
        yield "Going down, the window is closed at every depth."
        return
    first = depth["open"][0][0]
    sentence = "Going down, the window "
    sentence += (
        "is open from the first depth"
        if first == rows[0]["depth"]
        else f"opens at {fmt.value('depth', first)}"
    )
    if depth["closes"] is None:
        yield f"{sentence} and stays open to the last, {fmt.value('depth', rows[-1]['depth'])}."
        return
    sentence += f" and closes at {fmt.value('depth', depth['closes'])}"
    if depth["reopens"] is None:
        yield f"{sentence} for good, as far as the file reaches."
        return
    spans = ", ".join(
        f"{fmt.number('depth', a)} to {fmt.number('depth', b)}"
        if a != b
        else fmt.number("depth", a)
        for a, b in depth["open"]
    )
    yield (
        f"{sentence}; it reopens at {fmt.value('depth', depth['reopens'])}. Open at {spans} "
        f"{fmt.unit('depth')}."
    )


def _words(flag: str) -> str:
    return flag.replace("_", "-")
