"""The summary of a operating window in words; see
:func:`nsdrill.analysis.window.find_window` for the data."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from nsdrill.analysis.maps import least_share
from nsdrill.analysis.window import unknown_words
from nsdrill.data import Answer, evenly_spaced
from nsdrill.errors import count
from nsdrill.plot import trials
from nsdrill.plot.answer import MOST_WARNINGS, is_hint, limit, warnings, why, words_of, would_help
from nsdrill.plot.values import ORDER, Formatter, drilling, in_order, percent
from nsdrill.text.words import label_of, overrides_text, samples_text

SIDES = {"less": "less", "more": "more"}
SIDES_OF_DEPTH = {"less": "shallower", "more": "deeper"}
MAX_ROWS = 24
WIDTH = 100  # characters of a line of prose
INDENT = 6 * " "
CLASS_LABELS = {"rim": "history-dependent"}  # of the keys that are not words of the text


def lines(summary: Answer, units: str, everything: bool = False) -> Iterator[str]:
    """The lines of the summary in the units ``si`` or ``field``: the answer, what lies
    beside it, and the first warnings; with ``everything`` all warnings and the
    numbers."""
    words, told = words_of(summary, units), list(warnings(summary, units))
    yield from textwrap.wrap(words.sentence(), WIDTH)
    for line in (*words.lines(), *would_help(summary, units, words.sentence())):
        yield from textwrap.wrap(line, WIDTH, initial_indent="  ", subsequent_indent="    ")
    if (found := summary["answer"].trials) is not None:
        yield ""
        yield from (f"  {line}" for line in trials.lines(found, words.along, words.fmt))
    shown = told if everything else told[:MOST_WARNINGS]
    if shown:
        yield ""
    for warning in shown:
        yield from textwrap.wrap(warning, WIDTH, initial_indent="  ", subsequent_indent="  ")
    if everything:
        yield ""
        yield from number_lines(summary, units)
    else:
        more = len(told) - len(shown)
        hidden = [count(more, "more warning")] * bool(more) + ["the numbers"]
        yield f"  ({' and '.join(hidden)} with --all)"


def number_lines(summary: Answer, units: str) -> Iterator[str]:
    """The lines below the answer and its warnings."""
    fmt = Formatter(units)
    yield from _basis_lines(summary)
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
        yield (f"Safe at every {label_of(third)} of the file: {plane['safe']} of {count(plane['points'], 'point')}.")
    if plane["safe"]:
        yield ""
        yield from _map_lines(summary, plane, fmt)
    yield from _confidence_cost(summary, fmt)


def _confidence_cost(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The cost of more confidence: safe points, and the rate of penetration."""
    if not summary["price"]:
        return
    yield ""
    yield "What the confidence costs:"
    for row in summary["price"]:
        text = f"  {100 * row['confidence']:4g} %  {row['safe']:5d} safe ({100 * row['share']:.1f} %)"
        if best := row["fastest"]:
            rate = fmt.value("rate_of_penetration", best["rate_of_penetration"])
            text += f"; fastest {_point(best, (*summary['axes'], summary['third']), fmt)}, {rate}"
        yield text


def _point(point: Answer, axes: Sequence[str], fmt: Formatter) -> str:
    """The values of the ``axes`` at a point."""
    return ", ".join(fmt.value(axis, point[axis]) for axis in in_order(axes))


def _by_procedure(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The window of each procedure by itself, for comparison with the window of all."""
    for row in summary["alone"]:
        best = row.get("recommended")
        where = ""
        if best:
            where = f"; best at {_point(best, summary['axes'], fmt)}, safe with {percent(best)}"
        yield (f"By itself, {row['procedure']}: {row['safe']} safe ({100 * row['share']['safe']:.1f} %){where}.")


def _basis_lines(summary: Answer) -> Iterator[str]:
    """The meaning of the classes of points."""
    if summary["overrides"]:
        yield f"  overrides {overrides_text(summary['overrides'])}"
    condition = "without a critical response"
    if summary["severity"] is not None:
        condition = f"with no severity above {summary['severity']}, and not stalled"
    if summary["confidence"] is not None:
        by = f" in every procedure, {' and '.join(summary['procedures'])}," if summary["history_examined"] else ""
        samples = samples_text(summary["counted"], summary["effective"])
        yield (
            f"  safe      {100 * summary['confidence']:g} % or more of {samples} of the uncertain "
            f"numbers end well{by} {condition}"
        )
        yield "  not safe  fewer of them, so also points that are safe in most"
    elif summary["history_examined"]:
        by = " and ".join(summary["procedures"])
        if summary["histories"] > len(summary["procedures"]):
            by += f", {summary['histories']} histories in all"
        yield f"  safe      every run of the point ended well {condition}: {by}"
        yield f"  {CLASS_LABELS['rim']}"
        yield "            safe in some only: it depends on how one came there"
    else:
        yield f"  safe      the run of the point ended well {condition}"
    if summary["confidence"] is None:
        yield "  critical  no run of the point was safe"
    if summary["unknown"]:
        yield ("  unknown   a run failed or has no severity, and the others leave it open; no window goes there")


def _shares(summary: Answer) -> str:
    words = tuple(word for word in _columns({**summary, "unknown": 0}) if word != "rim" or summary["history_examined"])
    labels = CLASS_LABELS if summary["confidence"] is None else {"critical": "not safe"}
    parts = [f"{summary[word]} {labels.get(word, word)} ({100 * summary['share'][word]:.1f} %)" for word in words]
    if summary["unknown"]:
        parts.append(
            f"{summary['unknown']} unknown ({unknown_words(summary)}, {100 * summary['share']['unknown']:.1f} %)"
        )
    return f"of {count(summary['points'], 'point')} {', '.join(parts)}"


def _columns(summary: Answer) -> tuple[str, ...]:
    """The classes of points in the tables of this summary."""
    if summary["confidence"] is not None:
        return ("safe", "critical", "unknown") if summary["unknown"] else ("safe", "critical")
    return ("safe", "rim", "critical", "unknown") if summary["unknown"] else ("safe", "rim", "critical")


def _headings(summary: Answer) -> str:
    return "".join(f"{CLASS_LABELS.get(word, word):>{_width(word)}s}" for word in _columns(summary))


def _row(summary: Answer, counts: Answer) -> str:
    return "".join(f"{100 * counts['share'][word]:{_width(word) - 2}.1f} %" for word in _columns(summary))


def _width(word: str) -> int:
    """The width of the column of a class of points."""
    return max(10, 2 + len(CLASS_LABELS.get(word, word)))


def _no_window(summary: Answer, fmt: Formatter) -> Iterator[str]:
    obstacles = [f"{name.replace('_', '-')} at {count}" for name, count in summary["obstacles"].items() if count]
    noun = "point" if summary["points"] == 1 else "points"
    result, subject = "There is no safe point.", "Critical responses, in any history"
    if summary["confidence"] is not None:
        result = f"No point is safe with {100 * summary['confidence']:g} %."
        least = 100 * least_share(summary["confidence"])
        subject = f"Critical responses in {least:.2g} % of the samples or more, in any history"
    yield result + (f" {subject}: {', '.join(obstacles)} {noun}." if obstacles else "")
    if best := summary["most_probable"]:
        at = _point(best, (*summary["axes"], summary["third"]), fmt)
        ties = ""
        if best["ties"]:
            first = ", of which this drills fastest" if "rate_of_penetration" in best else ""
            ties = f" {count(best['ties'], 'other point')} as probable{first}."
        yield f"Most probably safe: {at}, with {percent(best)}.{_drilling_text(best, fmt)}{ties}"
    occurring = {name for name, number in summary["obstacles"].items() if number}
    if "stalled" in occurring:
        yield "Where the bit stalls, no severity makes a run safe."
    if summary["severity"] is None and occurring != {"stalled"}:
        yield (
            "How bad they are, the severities say: --severity 1 (or 2, 3) allows runs up to that; `nsdrill classify` "
            "moves the thresholds."
        )


def _map_table(summary: Answer, fmt: Formatter) -> Iterator[str]:
    third = summary["third"]
    maps = summary["maps"]
    width = max(12, *(len(fmt.value(third, plane["at"][third])) for plane in maps))
    yield f"{label_of(third):>{width}s}{_headings(summary)}   recommended, and how far from there"
    for plane in evenly_spaced(maps, MAX_ROWS):
        yield (
            f"{fmt.value(third, plane['at'][third]):>{width}s}{_row(summary, plane)}   "
            f"{_recommendation(summary, plane, fmt)}"
        )
    if len(maps) > MAX_ROWS:
        yield f"  ({MAX_ROWS} of {len(maps)}; all with --json)"


def _recommendation(summary: Answer, plane: Answer, fmt: Formatter) -> str:
    """``20 kN (-8 +10), 3 rad/s (-0.4 +0.6)``."""
    best = plane["recommended"]
    if best is None:
        return "none"
    parts = []
    for axis in in_order(summary["axes"]):
        down, up = (fmt.number(axis, best["margins"][axis][side]["margin"]) for side in SIDES)
        name = f"{label_of(axis)} " if axis not in ORDER else ""
        value = f"{name}{fmt.number(axis, best[axis])} {fmt.unit(axis)}".rstrip()
        parts.append(f"{value} (-{down} +{up})")
    return ", ".join(parts)


def _map_lines(summary: Answer, plane: Answer, fmt: Formatter) -> Iterator[str]:
    """The regions and the recommended point of one map."""
    axes = in_order(summary["axes"])
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
            f"Largest safe region: {count(area['points'], 'point')} ({100 * area['share']:.1f} % of the map) within "
            f"{spans}{others}."
        )
    best = plane["recommended"]
    yield (
        f"{'Best hint' if is_hint(summary, best) else 'Recommended'}: "
        f"{_point(best, axes, fmt)}.{_drilling_text(best, fmt)}"
    )
    if "probability" in best:
        yield (
            f"  safe with a probability of {percent(best)}; in brackets the 95 % interval from the number of samples"
        )
    for axis in axes:
        other = "" if len(axes) == 1 else f", the {label_of(next(a for a in axes if a != axis))} held"
        yield f"  {label_of(axis)}{other}:"
        for side, word in (SIDES_OF_DEPTH if axis == "depth" else SIDES).items():
            border = best["margins"][axis][side]
            yield f"    {word} {_limit_text(axis, border, fmt)}"
            if text := why(axis, border, best, fmt):
                yield from textwrap.wrap(text, WIDTH, initial_indent=INDENT, subsequent_indent=INDENT)
    fastest = plane["fastest"]
    if fastest is not None and any(fastest[axis] != best[axis] for axis in axes):
        text = _drilling_text(fastest, fmt)
        yield f"Fastest safe point, whatever its margins: {_point(fastest, axes, fmt)}.{text}"
    yield (
        "Limits lie between the last safe point and the next one; finer axes bring them closer together.\n"
        "What a window does not tell: Limits of validity, docs/limits.md."
    )


def _drilling_text(point: Answer, fmt: Formatter) -> str:
    """The rate of penetration and the specific energy at a point, as a sentence."""
    text = drilling(point, fmt)
    return f" {text[0].upper()}{text[1:]}." if text else ""


def _limit_text(axis: str, side: Answer, fmt: Formatter) -> str:
    room = f"by {fmt.value(axis, side['margin'])} to {fmt.value(axis, side['safe_to'])}"
    if side["margin"] == 0.0:
        room = "not at all"
    return f"{room}{': ' if side['why'] == 'edge' else '; '}{limit(axis, side, fmt)}"


def _over_depth(summary: Answer, fmt: Formatter, table: bool) -> Iterator[str]:
    """The depths at which the window is open, closes and opens again."""
    depth = summary["depth"]
    rows = depth["rows"]
    if table:
        yield ""
        yield f"{'depth':>12s}{_headings(summary)}"
        for row in evenly_spaced(rows, MAX_ROWS):
            yield f"{fmt.value('depth', row['depth']):>12s}{_row(summary, row)}"
        if len(rows) > MAX_ROWS:
            yield f"  ({MAX_ROWS} of {len(rows)}; all with --json)"
    yield ""
    if not depth["open"]:
        yield "Going down, the window is closed at every depth."
        return
    first = depth["open"][0][0]
    sentence = "Going down, the window "
    sentence += "is open from the first depth" if first == rows[0]["depth"] else f"opens at {fmt.value('depth', first)}"
    if depth["closes"] is None:
        yield f"{sentence} and stays open to the last, {fmt.value('depth', rows[-1]['depth'])}."
        return
    sentence += f" and closes at {fmt.value('depth', depth['closes'])}"
    if depth["reopens"] is None:
        yield f"{sentence} for good, as far as the file reaches."
        return
    spans = ", ".join(
        f"{fmt.number('depth', a)} to {fmt.number('depth', b)}" if a != b else fmt.number("depth", a)
        for a, b in depth["open"]
    )
    yield (f"{sentence}; it reopens at {fmt.value('depth', depth['reopens'])}. Open at {spans} {fmt.unit('depth')}.")
