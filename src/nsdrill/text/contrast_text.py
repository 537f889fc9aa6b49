"""Two windows against each other in words, as an engineer compares them: what the second wins
and costs, and what one must know before relying on that."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence

from nsdrill.analysis.advice import RECOMMENDED
from nsdrill.analysis.contrast import NO_BORDER
from nsdrill.analysis.maps import least_share
from nsdrill.data import Answer
from nsdrill.errors import from_to
from nsdrill.models.registry import described
from nsdrill.models.responses import RESPONSES, Response
from nsdrill.study.uncertain import HOW
from nsdrill.text.window_text import MAX_ROWS, WIDTH
from nsdrill.text.words import aligned
from nsdrill.words.answer import answer, chosen_map, obstacle_words, of_both, warnings, words_of
from nsdrill.words.values import WAYS, Formatter, in_order, percent, safe_words

ENDS = ("lower", "upper")
MAX_INTERVALS = 3  # in a cell of a table
MAX_KEYS = 6  # in one line
ENDED = ("edge", "outside")  # beyond which nothing was asked
UNSEEN = tuple(why for why in NO_BORDER if why not in ENDED)  # why a point is not safe: it is not known whether it is
SINGLE = "not known, as the numbers are single estimates"


def _share(window: Answer) -> str:
    """In how many of the samples of a ``window`` a response occurs that is counted; ""
    without samples."""
    level = window["confidence"]
    if level is None:
        return ""
    least = least_share(level, len(described(window["model"]).critical))
    return f"each in {100 * least:.1f} % of the samples or more"


def thresholds(found: Answer) -> str:
    """From where the responses of the two count, in words."""
    told = []
    for limits, window in zip(found["thresholds"], found["windows"], strict=True):
        level, share = window["confidence"], _share(window)
        why = f"; {share}, a quarter of the {100 - 100 * level:.3g} % that need not be safe" if share else ""
        told.append(f"{limits}{why}")
    a, b = told
    return a if a == b else f"in a {a}; in b {b}"


def sentence(found: Answer, units: str) -> str:
    """Where to run with b and with a, and what b wins and costs against a."""
    fmt, points = Formatter(units, found["windows"][0]["model"]), found["points"]
    a, b = found["names"]
    safe = safe_words(found["windows"][0]["severity"], found["windows"][0]["model"])
    level, other = (window["confidence"] for window in found["windows"])
    if level is not None and level == other:
        safe += f" with a probability of {100 * level:g} %"
    if any(found["safe"].values()):
        of_a, of_b = (words_of(window, units).order() for window in found["windows"])
        number = {side: "an unknown number" if some is None else some for side, some in found["safe"].items()}
        text = (
            f"With {b} {of_b}; with {a} {of_a}. Of {points} common points {number['b']} are {safe} "
            f"with b, {number['a']} with a: {found['gained']} gained, {found['lost']} lost"
            f"{_unknown(found)}"
        )
        parts = [_moves(found, fmt), _occurrence(found), _cost(found, fmt), _ends(found, fmt)]
    else:
        makes = "is known to make" if found["unknown"] else "makes"
        text = f"Neither {b} nor {a} {makes} any of {points} common points {safe}{_unknown(found)}"
        parts = [_most_probable(found), _occurrence(found)]
    return "; ".join([text, *filter(None, parts)]) + "."


def _unknown(found: Answer) -> str:
    """At how many points one of the two is not known."""
    return f", {found['unknown']} not known in one of them" if found["unknown"] else ""


def _most_probable(found: Answer) -> str:
    """The greatest probability of a safe run with b and with a; "" where one has none."""
    best = found["most_probable"]
    if best is None:
        return ""
    chance = "" if best["apart"] else ", which may be chance"
    return f"the most probable point {percent(best['b'])} instead of {percent(best['a'])}{chance}"


def _responses(found: Answer) -> dict[str, Response]:
    """The responses of the models of the two, and of a drill string."""
    models = [described(window["model"]) for window in found["windows"]]
    return RESPONSES | {name: one for model in models for name, one in model.critical.items()}


def _occurrence(found: Answer) -> str:
    """At how many points the responses occur with b and with a, the most frequent
    first."""
    parts = []
    for name, pair in sorted(
        found["responses"].items(), key=lambda one: -max(number or 0 for number in one[1].values())
    ):
        if not any(pair.values()):
            continue
        number = f"all {pair['b']}" if pair["b"] == found["points"] > 1 else f"{pair['b']}"
        if open_side := next((side for side in "ab" if pair[side] is None), ""):
            shown, letter = (number, "b") if open_side == "a" else (f"{pair['a']}", "a")
            parts.append(
                f"{_responses(found)[name].words} at {shown} point{'' if shown == '1' else 's'} of {letter}, "
                f"not known of {open_side}"
            )
            continue
        other = "with both" if pair["a"] == pair["b"] else f"instead of {pair['a']}"
        parts.append(f"{_responses(found)[name].words} at {number} point{'' if number == '1' else 's'} {other}")
    shares = {_share(window) for window in found["windows"]}
    share = shares.pop() if len(shares) == 1 and parts else ""
    open_at = [f"at {number} points of {side}" for side, number in found["not_known"].items() if number]
    notes = [share, f"not all is known {' and '.join(open_at)}" if open_at else ""]
    words = "; ".join(filter(None, notes))
    return ", ".join(parts or ["no response is known"] * bool(open_at)) + (f" ({words})" if words else "")


def _moves(found: Answer, fmt: Formatter) -> str:
    """How far the borders of the window moved on average along the first axis."""
    axis, parts = found["windows"][0]["axes"][0], []
    for end in ENDS:
        both = [row[end] for row in found["borders"] if not row[end]["at_least"]]
        moved = [one["moved"] for one in both if one["moved"] is not None]
        if not moved or not any(moved):
            continue
        mean = sum(moved) / len(moved)
        way, average = "higher" if mean > 0 else "lower", " on average" if len(moved) > 1 else ""
        by = fmt.value(axis, float(f"{abs(mean):.3g}"))
        parts.append(f"{end} borders in both lie {by} {way}{average}")
    return " and ".join(parts)


def _cost(found: Answer, fmt: Formatter) -> str:
    """The rates of penetration at the best and at the fastest safe point."""
    words = {"recommended": "at the best point", "fastest": "at the fastest safe point"}
    parts = [
        f"{where} {_change('rate_of_penetration', found['rate'][key], fmt)}"
        for key, where in words.items()
        if found["rate"] and None not in found["rate"][key].values()
    ]
    return f"rate of penetration {', '.join(parts)}" if parts else ""


def _ends(found: Answer, fmt: Formatter) -> str:
    """That the two maps have other ends, where that may be all that differs between them."""
    of_a, of_b = (window["ranges"] for window in found["windows"])
    differing = [axis for axis in of_a if axis in of_b and of_a[axis] != of_b[axis]]
    if not differing or not found["rate"]:
        return ""
    told = ", ".join(f"{fmt.range(axis, of_a[axis])} in a and {fmt.range(axis, of_b[axis])} in b" for axis in differing)
    return f"the maps have other ends ({told}), which alone may move the best and the fastest point"


def _change(name: str, pair: Mapping[str, float | None], fmt: Formatter) -> str:
    """``30.4 ft/h instead of 32.2 ft/h (-5.5 %)``: b instead of a."""
    a, b = pair["a"], pair["b"]
    if a is None or b is None:
        texts = ["none" if value is None else fmt.value(name, value) for value in (b, a)]
        return f"{texts[0]} instead of {texts[1]}"
    if fmt.value(name, a) == fmt.value(name, b):
        return f"{fmt.value(name, b)} in both"
    relative = f" ({100 * (b - a) / a:+.1f} %)" if a > 0.0 else ""
    return f"{fmt.value(name, b)} instead of {fmt.value(name, a)}{relative}"


def difference(found: Answer) -> str:
    """The keys in which the studies differ, in one line; not how the samples are drawn
    that only one has."""
    how = {f"uncertain.{name}" for name in HOW}
    rows = [row for row in found["study"] if row["key"] not in how or None not in (row["a"], row["b"])]
    if not rows:
        return "The studies are the same."
    told = [f"{row['key']}: {row['a'] or 'nothing'} in a, {row['b'] or 'nothing'} in b" for row in rows]
    more = f"; and {len(told) - MAX_KEYS} more" if len(told) > MAX_KEYS else ""
    return f"What differs: {'; '.join(told[:MAX_KEYS])}{more}."


def notes(found: Answer, units: str) -> Iterator[str]:
    """What one must know before relying on the comparison: of both windows, and of two
    that are not alike."""
    if found["models"][0] != found["models"][1]:
        yield (
            f"TWO MODELS: a is of {found['models'][0]}, b of {found['models'][1]}. A border may "
            "move because the equations differ."
        )
    elif len(digests := dict.fromkeys(found["model_digests"])) > 1:
        yield (
            f"OTHER CODE: a and b were computed by other code ({' and '.join(digests)}, the model digests): other "
            "versions, or a model whose files changed. A border may move by that alone."
        )
    if found["thresholds"][0] != found["thresholds"][1]:
        yield (
            "OTHER THRESHOLDS: in a and b a response does not count from the same values. A point may be gained or "
            "lost by that alone."
        )
    settings = [window["answer"] for window in found["windows"]]
    if any(one.way_in is not None and one.kind in RECOMMENDED for one in settings):
        letters = [letter for letter, one in zip("ab", settings, strict=True) if one.started]
        vibrates = f"started at its setting, {' and '.join(letters)} vibrates. " if letters else ""
        told = (
            f"{vibrates[:1].upper()}{vibrates[1:]}The window of each file with --trials shows which ways in are free."
        )
        yield f"NO WAY IN WAS TRIED here. {told}"
    histories = [window["procedures"] for window in found["windows"]]
    if histories[0] != histories[1]:
        yield (
            f"OTHER HISTORIES: a was run {' and '.join(histories[0])}, b "
            f"{' and '.join(histories[1])}. A point may be gained or lost by that alone."
        )
    elif found["study"] and all(row["key"].startswith("sweep.") for row in found["study"]):
        yield _only_the_sweep(found)
    sampled = [window["confidence"] is not None for window in found["windows"]]
    if sampled[0] != sampled[1]:
        letter, window = next(pair for pair in zip("ab", found["windows"], strict=True) if pair[1]["samples"])
        yield (
            f"ONE HAS SAMPLES, {letter}: there a point is safe where {100 * window['confidence']:g} % of "
            f"{window['counted']} samples are, in the other where one run of the estimates is. A point may be gained "
            "or lost by that alone."
        )
    if found["unknown"]:
        yield (
            f"NOT KNOWN in one of them: {found['unknown']} of {found['points']} common points. There a point may be "
            "gained or lost by that alone."
        )
    if not found["points"]:
        yield "NO COMMON POINT: the axes of the two have no value in common."
    yield from of_both(*(warnings(window, units) for window in found["windows"]))


def _only_the_sweep(found: Answer) -> str:
    """What the sweep alone may change between two of one string: by its steps, or, where they are
    the same, by where it begins."""
    subject = "string" if described(found["windows"][0]["model"]).drills else "model"
    told = f"ONLY THE SWEEP DIFFERS: a and b are the same {subject}"
    if not found["same_steps"]:
        return (
            f"{told}. What is gained or lost comes from the steps between the points, from which a motion is carried "
            f"to the next, not from the {subject}."
        )
    if found["gained"] or found["lost"]:
        return (
            f"{told}, with the same points where both were run. What is gained or lost comes from where a sweep "
            f"begins, from which a motion is carried on, not from the {subject}. The end of a sweep is no border."
        )
    return f"{told}, and agree where both were run. The end of a sweep is no border."


def side_by_side(found: Answer, units: str) -> list[tuple[str, ...]]:
    """The two windows side by side: what, in a, in b. A row that neither has is left
    out."""
    fmt, windows = Formatter(units, found["windows"][0]["model"]), found["windows"]
    planes = [chosen_map(window) for window in windows]
    bests = [plane["recommended"] if plane else None for plane in planes]
    axes = in_order(windows[0]["axes"])
    rows: list[tuple[str, Sequence[str | None]]] = [
        ("answer", [answer(window, units) for window in windows]),
        ("safe points", [_of_points(window, window["safe"], window["unknown"]) for window in windows]),
    ]
    for name, response in _responses(found).items():
        if any(window["obstacles"].get(name) for window in windows):
            numbers = [window["obstacles"].get(name) for window in windows]
            rows.append((response.words, list(map(_of_points, windows, numbers, found["open_points"].values()))))
    rows.append(("best point", [best and fmt.setting(best, axes) for best in bests]))
    for axis in axes:
        sides = [best and best["margins"][axis].values() for best in bests]
        spans = [both and fmt.range_inwards(axis, *(side["safe_to"] for side in both)) for both in sides]
        rows.append((f"safe there, {fmt.name(axis)}", spans))
    if any(best and "probability" in best for best in bests):
        rows.append(("probability", list(map(_probability, bests))))
    if None in bests and any(window["most_probable"] for window in windows):
        rows.append(("most probably safe", [_most_probably_safe(window, fmt) for window in windows]))
    rate = found["rate"] or {}
    words = {
        "recommended": "rate of penetration there",
        "fastest": "fastest safe point",
        "both_safe": "where both are safe, mean",
    }
    for key, label in words.items():
        rates = [value and fmt.value("rate_of_penetration", value) for value in rate.get(key, {}).values()]
        rows.append((label, rates))
    nothing = ["not known" if window["unknown"] == window["points"] else "none" for window in windows]
    return [
        (label, *(cell or other for cell, other in zip(cells, nothing, strict=True)))
        for label, cells in rows
        if any(cells)
    ]


def _of_points(window: Answer, number: int | None, unknown: int) -> str:
    """``11 of 19 (57.9 %)``, with the points of which it is ``unknown``."""
    points = window["points"]
    if number is None or (not number and unknown == points):
        return "not known"
    text = f"{number} of {points} ({100 * number / points:.1f} %)"
    return f"{text}, not known at {unknown}" if unknown else text


def _probability(best: Answer | None) -> str | None:
    """That of the best point of a window, with its interval."""
    if best is None:
        return None
    return percent(best) if "probability" in best else SINGLE


def _most_probably_safe(window: Answer, fmt: Formatter) -> str | None:
    point = window["most_probable"]
    if not point:
        return SINGLE if window["confidence"] is None else None
    return f"{fmt.setting(point, (*window['axes'], window['third']))}: {percent(point)}"


def border_rows(found: Answer, units: str) -> list[tuple[str, ...]]:
    """The safe intervals of every line of the map: where, in a, in b, and how far the
    ends moved, with the responses beyond them; of an interval that only one has, those
    that occur there in the other."""
    fmt, table = Formatter(units, found["windows"][0]["model"]), []
    for row in found["borders"]:
        axis = row["axis"]
        where = fmt.setting(row["at"], row["at"])
        spans = []
        for side in ("a", "b"):
            ends = [row["lower"][side], row["upper"][side]]
            nothing = "not known there" if row["lower"][f"why_{side}"] in UNSEEN else "not safe there"
            spans.append(nothing if ends[0] is None else fmt.range_inwards(axis, *ends))
        moves = [_moved(axis, row[end], fmt) for end in ENDS]
        table.append((where, *spans, *moves))
    return table


def moved_rows(found: Answer, units: str) -> list[tuple[str, ...]]:
    """As :func:`border_rows`, where a border moved, or an interval is only in one."""
    table = zip(found["borders"], border_rows(found, units), strict=True)
    return [text for row, text in table if any(_has_changed(row[end]) for end in ENDS)]


def _has_changed(end: Answer) -> bool:
    return end["a"] is None or end["b"] is None or bool(end["moved"])


def _moved(axis: str, end: Answer, fmt: Formatter) -> str:
    in_a, in_b = (obstacle_words(end[f"why_{side}"], end[f"responses_{side}"], fmt.model) for side in ("a", "b"))
    if end["a"] is None or end["b"] is None:
        side, word, other = ("b", "lost", in_b) if end["b"] is None else ("a", "gained", in_a)
        return f"{'not known' if end[f'why_{side}'] in UNSEEN else word} ({other} in {side})"
    if end["moved"]:
        sign = "+" if end["moved"] > 0 else "-"
        text = f"{sign}{fmt.value(axis, abs(end['moved']))}{' or more' if end['at_least'] else ''}"
    elif end["moved"] is None:
        text = "not known" if in_a != in_b or end["why_a"] in UNSEEN else "no border"
    else:
        text = "same"
    return f"{text} ({in_a if in_a == in_b else f'{in_a}, now {in_b}'})"


def onset_rows(found: Answer, units: str) -> list[tuple[str, ...]]:
    """Where each response occurs in a and in b, on every line where that differs: the
    place, the way, the response, in a, in b."""
    fmt, table = Formatter(units, found["windows"][0]["model"]), []
    for row in found["onsets"]:
        if row["a"] == row["b"]:
            continue
        spans = [_occurs(row, side, fmt) for side in ("a", "b")]
        where = fmt.setting(row["at"], row["at"])
        way = WAYS.get(row["procedure"], row["procedure"])
        table.append((where, way, row["response"].replace("_", "-"), *spans))
    return table


def _occurs(row: Answer, side: str, fmt: Formatter) -> str:
    """Where a response occurs in a or b, and where that is not known."""
    text = _intervals(row["axis"], row[side], fmt)
    if unknown := row[f"{side}_unknown"]:
        where = _intervals(row["axis"], unknown, fmt)
        text = f"not known at {where}" if not row[side] else f"{text}; not all known at {where}"
    return text


def _intervals(axis: str, intervals: list[list[float]], fmt: Formatter) -> str:
    """``40, 60 to 75 rpm``; of many intervals how many there are, and where."""
    if not intervals:
        return "none"
    if len(intervals) > MAX_INTERVALS:
        return f"{len(intervals)} intervals from {fmt.range(axis, [intervals[0][0], intervals[-1][-1]])}"
    *others, last = intervals
    before = [from_to(fmt.number(axis, end) for end in ends) for ends in others]
    return ", ".join([*before, fmt.range(axis, last)])


def contrast_lines(found: Answer, units: str, names: Sequence[str] = ()) -> Iterator[str]:
    """The comparison as lines of text, at most :data:`MAX_ROWS` of each table."""
    for letter, name in zip(("a", "b"), names, strict=False):
        yield f"{letter}: {name}"
    yield from textwrap.wrap(difference(found), WIDTH)
    yield ""
    yield from textwrap.wrap(sentence(found, units), WIDTH)
    for note in notes(found, units):
        yield from textwrap.wrap(note, WIDTH, initial_indent="  ", subsequent_indent="  ")
    (_, answer_a, answer_b), *table = side_by_side(found, units)
    yield ""
    yield from textwrap.wrap(f"a: {answer_a}", WIDTH, subsequent_indent="   ")
    yield from textwrap.wrap(f"b: {answer_b}", WIDTH, subsequent_indent="   ")
    yield ""
    yield from aligned([("", "a", "b"), *table])
    for heading, head, body in tables(found, units):
        yield ""
        yield from textwrap.wrap(f"{heading}:", WIDTH)
        yield from aligned([head, *body[:MAX_ROWS]])
        if len(body) > MAX_ROWS:
            yield f"  and {len(body) - MAX_ROWS} more (all with --json)"
    yield ""
    yield from textwrap.wrap(f"A response counts from here: {thresholds(found)}.", WIDTH)


def tables(found: Answer, units: str) -> Iterator[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """The tables of every line of the map: heading, columns and rows, of those that have
    rows."""
    axis = Formatter(units, found["windows"][0]["model"]).name(found["windows"][0]["axes"][0])
    if rows := border_rows(found, units):
        heading = f"Safe intervals along the {axis}, and how far their ends moved from a to b"
        yield heading, ("", "a", "b", "lower end", "upper end"), rows
    if rows := onset_rows(found, units):
        heading = f"Where along the {axis} a response occurs, where that changed"
        yield heading, ("", "way", "response", "a", "b"), rows
