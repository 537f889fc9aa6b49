"""The operating window in words: the answer, what lies beside it, and the numbers behind it;
see :func:`nsdrill.analysis.window.find_window` for the data."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

from nsdrill.analysis.maps import least_share
from nsdrill.analysis.probability import samples_text
from nsdrill.analysis.window import unknown_words
from nsdrill.data import Answer, evenly_spaced
from nsdrill.errors import count, from_to
from nsdrill.models.registry import described
from nsdrill.text.words import label_of, overrides_text
from nsdrill.words import trial_words
from nsdrill.words.answer import shown_first, warnings, words_of, would_help
from nsdrill.words.values import ORDER, Formatter, drilling, in_order, percent, reached

SIDES = ("less", "more")
MAX_ROWS = 24
WIDTH = 100  # characters of a line of prose
LABELS = {"safe": "allowed", "rim": "near a limit"}  # of the classes of points, where a key is not the word


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
        yield from (f"  {line}" for line in trial_words.lines(found, words.along, words.fmt))
    shown = told if everything else told[: shown_first(told)]
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
    """The numbers behind the answer: how many points have each grade, where they are
    allowed, the fastest of them, what confidence costs, and how that changes with
    depth."""
    fmt = Formatter(units, summary["model"])
    yield from _basis_lines(summary)
    yield ""
    held = ", ".join(fmt.value(axis, value) for axis, value in summary["fixed"].items())
    yield from textwrap.wrap(f"{f'At {held}' if held else 'In all'}, {_counts(summary)}.", WIDTH)
    if not summary["safe"]:
        yield from _nothing_allowed(summary, fmt)
    if len(summary["maps"]) > 1:
        yield ""
        yield from _map_table(summary, fmt)
    if summary["depth"]:
        yield from _over_depth(summary, fmt, table=summary["third"] != "depth" and len(summary["axes"]) > 1)
    if summary["safe"]:
        yield ""
        yield from _stretches(summary, fmt)
        yield from _fastest(summary, fmt)
    yield from _confidence_cost(summary, fmt)
    yield "Limits lie between the last allowed point and the next one; finer axes bring them closer together."


def _basis_lines(summary: Answer) -> Iterator[str]:
    """What an allowed point is."""
    if summary["overrides"]:
        yield f"  overrides {overrides_text(summary['overrides'])}"
    free = "without a critical response"
    if summary["severity"] is not None:
        free = f"with no severity above {summary['severity']}, and not stalled"
    ways = summary["procedures"]
    chain = summary["chain"]
    how = reached(ways, summary["along"], moved=chain is None or chain["held"]["points"] > 1)
    if {"up", "same"} <= set(ways):
        how += f", or {reached(('same',), None, from_rest=summary['answer'].from_rest)}"
    share = ""
    if summary["confidence"] is not None:
        samples = samples_text(summary["counted"], summary["effective"])
        share = f" in {100 * summary['confidence']:g} % or more of {samples} of the uncertain numbers"
    if (starts := summary["starts"]) is not None:
        yield f"  allowed: the runs from all {starts} starts at the point end well {free}; no way to it was run"
    elif not {"up", "same"} & set(ways):
        yield f"  allowed: none, as nothing was brought up from below; the runs are {how}"
    else:
        yield f"  allowed: the run, {how}, ends well {free}{share}"
    if summary["unknown"]:
        yield "  unknown: a run is not known or has no severity, and the others leave it open; it is not allowed"


def _counts(summary: Answer) -> str:
    """How many points have each grade; of samples how many are allowed."""
    if summary["confidence"] is None:
        parts = [f"{number} {words}" for words, number in summary["grades"].items() if words != "unknown"]
    else:
        parts = [f"{summary['safe']} allowed", f"{summary['critical']} not"]
    if summary["unknown"]:
        parts.append(f"{summary['unknown']} unknown ({unknown_words(summary)})")
    inferred = summary["inferred_runs"]
    told = f"; {inferred} of {count(summary['runs'], 'run')} were not made but inferred from the points around"
    where = " where one drills" if summary["within"] is not None else ""
    return f"{count(summary['points'], 'point')}{where}: {', '.join(parts)}{told if inferred else ''}"


def _nothing_allowed(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The responses that are met, the most probable point, and what a severity allows."""
    met = [f"{name.replace('_', '-')} at {number}" for name, number in summary["obstacles"].items() if number]
    noun = "point" if summary["points"] == 1 else "points"
    where = "on any way"
    if summary["confidence"] is not None:
        least = least_share(summary["confidence"], len(described(summary["model"]).critical))
        where = f"in {100 * least:.2g} % of the samples or more"
    if met:
        yield f"Critical responses, {where}: {', '.join(met)} {noun}."
    if best := summary["most_probable"]:
        at = _point(best, (*summary["axes"], summary["third"]), fmt)
        ties = f" {count(best['ties'], 'other point')} as probable." if best["ties"] else ""
        yield f"Most probably allowed: {at}, with {percent(best)}.{_drilling_text(best, fmt)}{ties}"
    occurring = {name for name, number in summary["obstacles"].items() if number}
    if "stalled" in occurring:
        yield "Where the bit stalls, no severity allows a run."
    if summary["severity"] is None and occurring - {"stalled"}:
        levels, moves = summary["severities"], "`nsdrill classify` moves the thresholds."
        if levels:
            first, *others = map(str, levels)
            more = f" (or {', '.join(others)})" if others else ""
            yield f"The severities say how bad they are: --severity {first}{more} allows runs up to that; {moves}"
        elif levels is not None:
            yield f"No severity below the greatest allows more runs; {moves}"


def _point(point: Answer, axes: Sequence[str | None], fmt: Formatter) -> str:
    """The values of the ``axes`` at a point."""
    return ", ".join(fmt.value(axis, point[axis]) for axis in in_order(axes))


def _drilling_text(point: Answer, fmt: Formatter) -> str:
    """The rate of penetration and the specific energy at a point, as a sentence."""
    text = drilling(point, fmt)
    return f" {text[0].upper()}{text[1:]}." if text else ""


def _columns(summary: Answer) -> tuple[str, ...]:
    """The classes of points in the tables of this summary."""
    words = ("safe", "critical") if summary["confidence"] is not None else ("safe", "rim", "critical")
    return (*words, "unknown") if summary["unknown"] else words


def _headings(summary: Answer) -> str:
    return "".join(f"{LABELS.get(word, word):>{_width(word)}s}" for word in _columns(summary))


def _row(summary: Answer, counts: Answer) -> str:
    return "".join(f"{100 * counts['share'][word]:{_width(word) - 2}.1f} %" for word in _columns(summary))


def _width(word: str) -> int:
    """The width of the column of a class of points."""
    return max(10, 2 + len(LABELS.get(word, word)))


def _map_table(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """A line for each value of the third axis."""
    third, maps = summary["third"], summary["maps"]
    width = max(12, *(len(fmt.value(third, plane["at"][third])) for plane in maps))
    yield f"{label_of(third):>{width}s}{_headings(summary)}   best point, and how far from there"
    for plane in evenly_spaced(maps, MAX_ROWS):
        at = fmt.value(third, plane["at"][third])
        yield f"{at:>{width}s}{_row(summary, plane)}   {_best_of(summary, plane, fmt)}"
    if len(maps) > MAX_ROWS:
        yield f"  ({MAX_ROWS} of {len(maps)}; all with --json)"


def _best_of(summary: Answer, plane: Answer, fmt: Formatter) -> str:
    """``20 kN (-8 +10), 3 rad/s (-0.4 +0.6)``, of a hint with that word."""
    best = plane["recommended"]
    if best is None:
        return "none"
    parts = []
    for axis in in_order(summary["axes"]):
        down, up = (fmt.number(axis, best["margins"][axis][side]["margin"]) for side in SIDES)
        name = f"{label_of(axis)} " if axis not in ORDER else ""
        value = f"{name}{fmt.number(axis, best[axis])} {fmt.unit(axis)}".rstrip()
        parts.append(f"{value} (-{down} +{up})")
    return ", ".join(parts) + (", a hint" if best["hint"] else "")


def _over_depth(summary: Answer, fmt: Formatter, table: bool) -> Iterator[str]:
    """The depths at which any setting is allowed."""
    rows, found = summary["depth"]["rows"], summary["depth"]
    if table:
        yield ""
        yield f"{'depth':>12s}{_headings(summary)}"
        for row in evenly_spaced(rows, MAX_ROWS):
            yield f"{fmt.value('depth', row['depth']):>12s}{_row(summary, row)}"
        if len(rows) > MAX_ROWS:
            yield f"  ({MAX_ROWS} of {len(rows)}; all with --json)"
    yield ""
    if not found["open"]:
        yield "Going down, the window is closed at every depth."
        return
    first = found["open"][0][0]
    sentence = "Going down, the window "
    sentence += "is open from the first depth" if first == rows[0]["depth"] else f"opens at {fmt.value('depth', first)}"
    if found["closes"] is None:
        yield f"{sentence} and stays open to the last, {fmt.value('depth', rows[-1]['depth'])}."
        return
    sentence += f" and closes at {fmt.value('depth', found['closes'])}"
    if found["reopens"] is None:
        yield f"{sentence} for good, as far as the file reaches."
        return
    spans = ", ".join(from_to(fmt.number("depth", end) for end in ends) for ends in found["open"])
    yield f"{sentence}; it reopens at {fmt.value('depth', found['reopens'])}. Open at {spans} {fmt.unit('depth')}."


def _stretches(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The stretches of allowed points, a line for each row of each map that has any."""
    axis, third = summary["axes"][0], summary["third"]
    told = []
    for plane in summary["maps"]:
        for row in plane["rows"]:
            at = {**plane["at"], **row["at"]}
            spans = ", ".join(fmt.range_inwards(axis, *ends) for ends in row["safe"])
            if spans:
                told.append(f"{fmt.setting(at, at)}: {spans}" if at else spans)
    yield f"Allowed along the {fmt.name(axis)}{f', by {label_of(third)}' if third else ''}:"
    for text in evenly_spaced(told, MAX_ROWS):
        yield from textwrap.wrap(text, WIDTH, initial_indent="  ", subsequent_indent="    ")
    if len(told) > MAX_ROWS:
        yield f"  ({MAX_ROWS} of {len(told)}; all with --json)"


def _fastest(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The allowed point that drills fastest, over all maps."""
    found = [{**plane["at"], **plane["fastest"]} for plane in summary["maps"] if plane["fastest"]]
    if found:
        best = max(found, key=lambda one: float(one["rate_of_penetration"]))
        at = _point(best, (*summary["axes"], summary["third"]), fmt)
        yield f"Fastest allowed point, whatever its room: {at}.{_drilling_text(best, fmt)}"


def _confidence_cost(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """The cost of more confidence: allowed points, and the rate of penetration."""
    if not summary["price"] or summary["unknown"] == summary["points"]:
        return
    yield ""
    yield "What the confidence costs:"
    for row in summary["price"]:
        text = f"  {100 * row['confidence']:4g} %  {row['safe']:5d} allowed ({100 * row['share']:.1f} %)"
        if best := row["fastest"]:
            rate = fmt.value("rate_of_penetration", best["rate_of_penetration"])
            text += f"; fastest {_point(best, (*summary['axes'], summary['third']), fmt)}, {rate}"
        yield text
