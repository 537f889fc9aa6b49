"""The safe window as a note that an engineer can read; see
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

ORDER = ("depth", "wob", "rotary_speed")  # as a driller says an operating point
SIDES = {"less": "less", "more": "more"}
SIDES_OF_DEPTH = {"less": "shallower", "more": "deeper"}
MOST_ROWS = 24
CLASS_LABELS = {"rim": "history-dependent"}  # of the keys that are not words of the text


def _order(axis: str) -> tuple[int, str]:
    """As a driller says an operating point; further axes after it."""
    return (ORDER.index(axis) if axis in ORDER else len(ORDER), axis)


class Writer:
    """Values in one system of units; a speed in rad/s has the rpm beside it."""

    def __init__(self, units: str) -> None:
        self.system = units

    def unit(self, axis: str) -> str:
        """The unit in which an axis is told."""
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
        turns = " to ".join(f"{from_si(value, 'rpm'):.3g}" for value in values)
        return f" ({turns} rpm)"


def lines(note: dict[str, Any], units: str) -> Iterator[str]:
    """The lines of the note in the units ``si`` or ``field``."""
    w = Writer(units)
    yield from _basis(note, w)
    yield ""
    held = ", ".join(w.value(axis, value) for axis, value in note["fixed"].items())
    yield f"{f'At {held}' if held else 'In all'}: {_shares(note)}."
    if note["confidence"] is not None:
        yield from _alone(note, w)
    elif note["history_examined"] and len(note["safe_in"]) > 1:
        alone = ", ".join(f"{n} {procedure}" for procedure, n in note["safe_in"].items())
        yield f"Each procedure by itself: safe at {alone}."
    if note["safe"] == 0:
        yield from _no_window(note, w)
    several = len(note["maps"]) > 1
    if several:
        yield ""
        yield from _table(note, w)
    if note["depth"]:
        yield from _over_depth(note, w, table=not several and len(note["axes"]) > 1)
    one = note["throughout"] if several else note["maps"][0]
    if several:
        yield ""
        third = note["third"]
        yield (
            f"Safe at every {name_of(third)} of the file: {one['safe']} of "
            f"{count(one['points'], 'point')}."
        )
    if one["safe"]:
        yield ""
        yield from _map(note, one, w)
    yield from _price(note, w)


def _price(note: dict[str, Any], w: Writer) -> Iterator[str]:
    """What more confidence costs: points, and speed of drilling."""
    if not note["price"]:
        return
    yield ""
    yield "What the confidence costs:"
    for row in note["price"]:
        text = (
            f"  {100 * row['confidence']:4g} %  {row['safe']:5d} safe ({100 * row['share']:.1f} %)"
        )
        if best := row["fastest"]:
            axes = sorted((axis for axis in (*note["axes"], note["third"]) if axis), key=_order)
            where = ", ".join(w.value(axis, best[axis]) for axis in axes)
            text += f"; fastest {where}, {_rate(best, w)}"
        yield text


def _rate(best: dict[str, Any], w: Writer) -> str:
    return w.value("rate_of_penetration", best["rate_of_penetration"])


def _alone(note: dict[str, Any], w: Writer) -> Iterator[str]:
    """The window without history against the one with it: of each procedure by itself,
    and of all of them."""
    for one in note["alone"]:
        best = one.get("recommended")
        where = ""
        if best:
            at = ", ".join(w.value(axis, best[axis]) for axis in sorted(note["axes"], key=_order))
            where = f"; best at {at}, safe with {_percent(best)}"
        yield (
            f"By itself, {one['procedure']}: {one['safe']} safe ({100 * one['share']['safe']:.1f} "
            f"%){where}."
        )


def _percent(best: dict[str, Any]) -> str:
    """``97.3 % (94.4 to 98.7)``."""
    ends = " to ".join(f"{100 * best[f'probability_{end}']:.1f}" for end in ("low", "high"))
    return f"{100 * best['probability']:.1f} % ({ends})"


def _basis(note: dict[str, Any], w: Writer) -> Iterator[str]:
    """What was looked at, and what not."""
    if note["overrides"]:
        yield (
            f"  overrides "
            f"{'; '.join(f'{key} = {value}' for key, value in note['overrides'].items())}"
        )
    what = "without a critical response"
    if note["severity"] is not None:
        what = f"with no severity above {note['severity']}"
    if note["confidence"] is not None:
        by = (
            f" in every procedure, {' and '.join(note['procedures'])},"
            if note["history_examined"]
            else ""
        )
        of = samples_text(note["counted"], note["effective"])
        yield (
            f"  safe      {100 * note['confidence']:g} % or more of {of} of the uncertain numbers "
            f"end well{by} {what}"
        )
        if not note["history_examined"]:
            yield (
                f"  HISTORY WAS NOT EXAMINED: the file holds one procedure only "
                f"({note['procedures'][0]}). Run the "
                "study with procedure: up-down\n  to learn whether the window holds whatever came "
                "before."
            )
        yield "  critical  fewer of them"
    elif note["history_examined"]:
        by = " and ".join(note["procedures"])
        if note["histories"] > len(note["procedures"]):
            by += f", {note['histories']} histories in all"
        yield f"  safe      every run of the point ended well {what}: {by}"
        yield f"  {CLASS_LABELS['rim']}"
        yield "            safe in some only: it depends on how one came there"
    else:
        yield f"  safe      the run of the point ended well {what}"
        yield (
            f"  HISTORY WAS NOT EXAMINED: the file holds one procedure only "
            f"({note['procedures'][0]}). Run the "
            "study with procedure: up-down\n  to learn whether the window holds whatever came "
            "before."
        )
    if note["confidence"] is None:
        yield "  critical  no run of the point was safe"
    for one in note.get("passed_over", ()):
        speeds = w.span(one["axis"], [one["min"], one["max"]]).removeprefix(
            f"{name_of(one['axis'])} "
        )
        some = "" if one["everywhere"] else " (in a part of the study)"
        yield (
            f"  THE SWEEP BEGINS at {w.value(one['axis'], one['from'])}, above {one['words']}, "
            f"{speeds}{some}.\n  A "
            "string that is brought up to speed passes through that: a point that is safe here "
            "need not be safe then."
        )
    if note["unknown"]:
        yield (
            "  unknown   a run failed or has no severity, and the others leave it open; no window "
            "goes there"
        )
    if note["failed_runs"]:
        points = count(note["failed_points"], "point")
        yield f"  {note['failed_runs']} of {count(note['runs'], 'run')} failed, at {points}."
    if note["distrusted_points"]:
        one = note["distrusted_points"] == 1
        said = (
            "is marked as not to be trusted and counts"
            if one
            else "are marked as not to be trusted and count"
        )
        yield f"  {count(note['distrusted_points'], 'point')} {said} as not safe."


def _shares(note: dict[str, Any]) -> str:
    words = tuple(
        word
        for word in _columns({**note, "unknown": 0})
        if word != "rim" or note["history_examined"]
    )
    parts = [
        f"{note[word]} {CLASS_LABELS.get(word, word)} ({100 * note['share'][word]:.1f} %)"
        for word in words
    ]
    if note["unknown"]:
        parts.append(
            f"{note['unknown']} unknown ({unknown_words(note)}, "
            f"{100 * note['share']['unknown']:.1f} %)"
        )
    return f"of {count(note['points'], 'point')} {', '.join(parts)}"


def _columns(note: dict[str, Any]) -> tuple[str, ...]:
    """The classes of points in the tables of this note."""
    if note["confidence"] is not None:
        return ("safe", "critical", "unknown") if note["unknown"] else ("safe", "critical")
    return (
        ("safe", "rim", "critical", "unknown") if note["unknown"] else ("safe", "rim", "critical")
    )


def _heads(note: dict[str, Any]) -> str:
    return "".join(f"{CLASS_LABELS.get(word, word):>{_width(word)}s}" for word in _columns(note))


def _row(note: dict[str, Any], counts: dict[str, Any]) -> str:
    return "".join(
        f"{100 * counts['share'][word]:{_width(word) - 2}.1f} %" for word in _columns(note)
    )


def _width(word: str) -> int:
    """The width of the column of a class of points."""
    return max(10, 2 + len(CLASS_LABELS.get(word, word)))


def _no_window(note: dict[str, Any], w: Writer) -> Iterator[str]:
    met = [f"{_words(name)} at {count}" for name, count in note["obstacles"].items() if count]
    noun = "point" if note["points"] == 1 else "points"
    none, what = "There is no safe point.", "Critical responses, in any history"
    if note["confidence"] is not None:
        none = f"No point is safe with {100 * note['confidence']:g} %."
        often = 100 * (1 - note["confidence"]) / 3
        what = f"Critical responses in {often:.2g} % of the samples or more, in any history"
    yield none + (f" {what}: {', '.join(met)} {noun}." if met else "")
    if best := note["most_probable"]:
        axes = sorted((axis for axis in (*note["axes"], note["third"]) if axis), key=_order)
        at = ", ".join(w.value(axis, best[axis]) for axis in axes)
        ties = ""
        if best["ties"]:
            first = ", of which this drills fastest" if "rate_of_penetration" in best else ""
            ties = f" {count(best['ties'], 'other point')} as probable{first}."
        yield f"Most probably safe: {at}, with {_percent(best)}.{_yields(best, w)}{ties}"
    if note["severity"] is None:
        yield (
            "How bad they are, the severities say: --severity 1 (or 2, 3) allows runs up to that; "
            "`nsdrill "
            "classify` moves the thresholds."
        )


def _table(note: dict[str, Any], w: Writer) -> Iterator[str]:
    third = note["third"]
    maps = note["maps"]
    wide = max(12, *(len(w.value(third, one["at"][third])) for one in maps))
    yield f"{name_of(third):>{wide}s}{_heads(note)}   recommended, and how far from there"
    for one in _some(maps):
        yield (
            f"{w.value(third, one['at'][third]):>{wide}s}{_row(note, one)}   {_brief(note, one, w)}"
        )
    if len(maps) > MOST_ROWS:
        yield f"  ({MOST_ROWS} of {len(maps)}; all with --json)"


def _some(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """At most :data:`MOST_ROWS` of them, evenly, the ends among them."""
    if len(rows) <= MOST_ROWS:
        return rows
    return [rows[round(number * (len(rows) - 1) / (MOST_ROWS - 1))] for number in range(MOST_ROWS)]


def _brief(note: dict[str, Any], one: dict[str, Any], w: Writer) -> str:
    """``20 kN (-8 +10), 3 rad/s (-0.4 +0.6)``."""
    best = one["recommended"]
    if best is None:
        return "none"
    parts = []
    for axis in sorted(note["axes"], key=_order):
        down, up = (w.number(axis, best["margins"][axis][side]["margin"]) for side in SIDES)
        name = f"{name_of(axis)} " if axis not in AXES else ""
        value = f"{name}{w.number(axis, best[axis])} {w.unit(axis)}".rstrip()
        parts.append(f"{value} (-{down} +{up})")
    return ", ".join(parts)


def _map(note: dict[str, Any], one: dict[str, Any], w: Writer) -> Iterator[str]:
    """The regions and the recommended point of one map."""
    axes = sorted(note["axes"], key=_order)
    if len(axes) == 1:
        yield f"Safe {'interval' if len(one['regions']) == 1 else 'intervals'}:"
        for area in sorted(one["regions"][:MOST_ROWS], key=lambda area: float(area[axes[0]][0])):
            yield f"  {w.span(axes[0], area[axes[0]])}: {count(area['points'], 'point')}"
        if len(one["regions"]) > MOST_ROWS:
            yield f"  and {len(one['regions']) - MOST_ROWS} smaller ones (all with --json)"
    else:
        area = one["regions"][0]
        spans = ", ".join(w.span(axis, area[axis]) for axis in axes)
        others = f"; {len(one['regions'])} regions in all" if len(one["regions"]) > 1 else ""
        yield (
            f"Largest safe region: {count(area['points'], 'point')} ({100 * area['share']:.1f} % "
            f"of the map) within "
            f"{spans}{others}."
        )
    best = one["recommended"]
    yield f"Recommended: {', '.join(w.value(axis, best[axis]) for axis in axes)}.{_yields(best, w)}"
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
            yield f"    {word} {_limit(axis, best['margins'][axis][side], w)}"
    sides = [side for axis in axes for side in best["margins"][axis].values()]
    if any(side["margin"] == 0.0 for side in sides):
        yield (
            "It has no room to one side or more: a hint, not a setting. A finer map around it "
            "would tell."
        )
    fastest = one["fastest"]
    if fastest is not None and any(fastest[axis] != best[axis] for axis in axes):
        where = ", ".join(w.value(axis, fastest[axis]) for axis in axes)
        yield f"Fastest safe point, whatever room it has: {where}.{_yields(fastest, w)}"
    yield (
        "Limits lie between the last safe point and the next one; finer axes bring them closer "
        "together."
    )


def _yields(point: dict[str, Any], w: Writer) -> str:
    """What drilling there yields, in a sentence of its own; "" where the file does not
    say."""
    words = {
        "rate_of_penetration": "rate of penetration",
        "mechanical_specific_energy": "specific energy",
    }
    told = [f"{word} {w.value(name, point[name])}" for name, word in words.items() if name in point]
    return f" {told[0][0].upper()}{', '.join(told)[1:]}." if told else ""


def _limit(axis: str, limit: dict[str, Any], w: Writer) -> str:
    text = f"by {w.value(axis, limit['margin'])} to {w.value(axis, limit['safe_to'])}"
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
    return f"{text}; at {w.value(axis, limit['first_not_safe'])} {reason}"


def _over_depth(note: dict[str, Any], w: Writer, table: bool) -> Iterator[str]:
    """Where the window is open, closes and opens again, going down."""
    depth = note["depth"]
    rows = depth["rows"]
    if table:
        yield ""
        yield f"{'depth':>12s}{_heads(note)}"
        for row in _some(rows):
            yield f"{w.value('depth', row['depth']):>12s}{_row(note, row)}"
        if len(rows) > MOST_ROWS:
            yield f"  ({MOST_ROWS} of {len(rows)}; all with --json)"
    yield ""
    if not depth["open"]:
        yield "Going down, the window is closed at every depth."
        return
    first = depth["open"][0][0]
    said = "Going down, the window "
    said += (
        "is open from the first depth"
        if first == rows[0]["depth"]
        else f"opens at {w.value('depth', first)}"
    )
    if depth["closes"] is None:
        yield f"{said} and stays open to the last, {w.value('depth', rows[-1]['depth'])}."
        return
    said += f" and closes at {w.value('depth', depth['closes'])}"
    if depth["reopens"] is None:
        yield f"{said} for good, as far as the file reaches."
        return
    spans = ", ".join(
        f"{w.number('depth', a)} to {w.number('depth', b)}" if a != b else w.number("depth", a)
        for a, b in depth["open"]
    )
    yield (
        f"{said}; it reopens at {w.value('depth', depth['reopens'])}. Open at {spans} "
        f"{w.unit('depth')}."
    )


def _words(flag: str) -> str:
    return flag.replace("_", "-")
