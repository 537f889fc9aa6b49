"""Two studies compared as an engineer compares them: their windows, what bounds these,
where the responses begin, and the rate of penetration."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from nsdrill.analysis import contrast as analysis
from nsdrill.analysis.window import least_share
from nsdrill.app.window import read_for_window, with_passed_over
from nsdrill.data import Answer, Resolved, Results, resolved_study
from nsdrill.models.responses import RESPONSES, Thresholds
from nsdrill.plot.answer import WAYS, Formatter, answer, chosen_map, in_order, percent, response_words, warnings
from nsdrill.study.study import build
from nsdrill.study.write import changes
from nsdrill.variables import MODEL

ENDS = ("lower", "upper")
MAX_CHANGES = 6
Source = Results | str | os.PathLike[str]


def contrast(
    a: Source,
    b: Source,
    severity: int | None = None,
    confidence: float | None = None,
    names: Sequence[str] | None = None,
) -> Answer:
    """The windows of two results, or results files, against each other as plain data in
    SI units: that of :func:`nsdrill.analysis.contrast.contrast`, the ``study`` keys in
    which they differ, the ``models`` of the two, their ``thresholds``, and their
    ``names`` in a sentence (by default those of the files). InputError where the axes of
    the sweeps differ."""
    data = [with_passed_over(one) if isinstance(one, Results) else read_for_window(one, severity) for one in (a, b)]
    found = analysis.contrast(data[0], data[1], severity, confidence)
    studies = [resolved_study(one.attrs) for one in data]
    found["study"] = [{"key": key, "a": old, "b": new} for key, old, new in changes(*studies) if key != "title"]
    files = names or [
        Path(one).name if not isinstance(one, Results) else letter for one, letter in zip((a, b), "ab", strict=True)
    ]
    found["names"] = _names(found["study"], files)
    found["thresholds"] = [_thresholds(study) for study in studies]
    found["models"] = [str(one.attrs.get("model") or MODEL) for one in data]
    return found


def _names(study: Sequence[Resolved], files: Sequence[str]) -> list[str]:
    """What the two are called: their drives where the studies differ in the kind of
    drive, a word where they differ in that alone, else the files, each with its letter."""
    words = [row for row in study if str(row["a"]).isidentifier() and str(row["b"]).isidentifier()]
    told = list(files)
    if len(words) == 1 and all(row["key"].startswith("drive.") for row in study):
        told = [f"the {str(words[0][side]).replace('_', ' ')} drive" for side in ("a", "b")]
    elif len(words) == len(study) == 1:
        told = [f"{words[0]['key']} {words[0][side]}" for side in ("a", "b")]
    return [letter if name == letter else f"{name} ({letter})" for name, letter in zip(told, "ab", strict=True)]


def _thresholds(study: Resolved) -> str:
    """From where the responses count, in words."""
    limits = build(Thresholds, study.get("classify", {}), lenient=True)
    return "; ".join(
        f"{one.words}: {one.limit.format(one.percent(getattr(getattr(limits, one.name), one.feature)))}"
        for one in RESPONSES.values()
    )


def _with_share(limits: str, window: Answer) -> str:
    """The thresholds, and in how many of the samples of a ``window`` they are passed."""
    level = window["confidence"]
    return limits if level is None else f"{limits}; in {100 * least_share(level):.1f} % of the samples"


def thresholds(found: Answer) -> str:
    """From where the responses of the two count, in words."""
    a, b = map(_with_share, found["thresholds"], found["windows"])
    return a if a == b else f"in a {a}; in b {b}"


def sentence(found: Answer, units: str) -> str:
    """What b wins and costs against a, in one sentence."""
    fmt = Formatter(units)
    a, b = found["names"]
    text = (
        f"With {b} {found['both'] + found['gained']} of {found['points']} common points are safe, "
        f"with {a} {found['both'] + found['lost']}: {found['gained']} gained, {found['lost']} lost"
    )
    text += "; " + "; ".join(filter(None, (_moves(found, fmt), _cost(found, fmt))))
    return text.rstrip("; ") + "."


def _moves(found: Answer, fmt: Formatter) -> str:
    """How far the borders of the window moved on average along the first axis."""
    axis, parts = found["windows"][0]["axes"][0], []
    for end in ENDS:
        moved = [row[end]["moved"] for row in found["borders"] if row[end]["moved"] is not None]
        if not moved or not any(moved):
            continue
        mean = sum(moved) / len(moved)
        way = "up" if mean > 0 else "down"
        parts.append(f"its {end} border lies {fmt.value(axis, abs(mean))} further {way}")
    return f"on average {' and '.join(parts)}" if parts else ""


def _cost(found: Answer, fmt: Formatter) -> str:
    """The rates of penetration at the best and at the fastest safe point."""
    words = {"recommended": "at the best point", "fastest": "at the fastest safe point"}
    parts = [
        f"{where} {_change('rate_of_penetration', found['rate'][key], fmt)}"
        for key, where in words.items()
        if found["rate"] and None not in found["rate"][key].values()
    ]
    return f"rate of penetration {', '.join(parts)}" if parts else ""


def _change(name: str, pair: Mapping[str, float | None], fmt: Formatter) -> str:
    """``30.4 ft/h for 32.2 ft/h (-5.5 %)``: b for a."""
    a, b = pair["a"], pair["b"]
    if a is None or b is None:
        texts = ["none" if value is None else fmt.value(name, value) for value in (b, a)]
        return f"{texts[0]} for {texts[1]}"
    if fmt.value(name, a) == fmt.value(name, b):
        return f"{fmt.value(name, b)} in both"
    relative = f" ({100 * (b - a) / a:+.1f} %)" if a > 0.0 else ""
    return f"{fmt.value(name, b)} for {fmt.value(name, a)}{relative}"


def difference(found: Answer) -> str:
    """The keys in which the studies differ, in one line."""
    rows = found["study"]
    if not rows:
        return "The studies are the same."
    told = [f"{row['key']}: {row['a'] or 'nothing'} in a, {row['b'] or 'nothing'} in b" for row in rows]
    more = f"; and {len(told) - MAX_CHANGES} more" if len(told) > MAX_CHANGES else ""
    return f"What differs: {'; '.join(told[:MAX_CHANGES])}{more}."


def notes(found: Answer, units: str) -> Iterator[str]:
    """What one must know before relying on the comparison: of both windows, and of two
    that are not alike."""
    if found["models"][0] != found["models"][1]:
        yield (
            f"TWO MODELS: a is of {found['models'][0]}, b of {found['models'][1]}. A border may "
            "move because the equations differ."
        )
    histories = [window["procedures"] for window in found["windows"]]
    if histories[0] != histories[1]:
        yield (
            f"OTHER HISTORIES: a was run {' and '.join(histories[0])}, b "
            f"{' and '.join(histories[1])}. A point may be gained or lost by that alone."
        )
    if found["unknown"]:
        yield f"NOT KNOWN in one of them: {found['unknown']} of {found['points']} common points."
    if not found["points"]:
        yield "NO COMMON POINT: the axes of the two have no value in common."
    for name, window in zip(("a", "b"), found["windows"], strict=True):
        yield from (f"{name}: {text}" for text in warnings(window, units))


def rows(found: Answer, units: str) -> list[tuple[str, ...]]:
    """The two windows side by side: what, in a, in b."""
    fmt = Formatter(units)
    windows = found["windows"]
    table: list[tuple[str, ...]] = [("answer", *(answer(window, units) for window in windows))]
    table.append(
        ("safe points", *(f"{w['safe']} of {w['points']} ({100 * w['share']['safe']:.1f} %)" for w in windows))
    )
    planes = [chosen_map(window) for window in windows]
    bests = [plane["recommended"] if plane else None for plane in planes]
    axes = in_order(windows[0]["axes"])
    settings = [
        f"{letter}: {fmt.setting(best, axes) if best else 'none'}" for letter, best in zip("ab", bests, strict=True)
    ]
    table.append(("best point", *settings))
    for axis in axes:
        ends = [
            fmt.range(axis, [best["margins"][axis][side]["safe_to"] for side in ("less", "more")]) if best else "none"
            for best in bests
        ]
        table.append((f"safe there, {fmt.name(axis)}", ends[0], ends[1]))
    if any(best and "probability" in best for best in bests):
        table.append(("probability", *(_probability(best) for best in bests)))
    rate = found["rate"] or {}
    words = {
        "recommended": "rate of penetration there",
        "fastest": "fastest safe point",
        "both_safe": "where both are safe, mean",
    }
    for key, label in words.items():
        if key in rate and any(value is not None for value in rate[key].values()):
            shown = [
                "none" if value is None else fmt.value("rate_of_penetration", value) for value in rate[key].values()
            ]
            table.append((label, shown[0], shown[1]))
    return table


def _probability(best: Answer | None) -> str:
    """That of the best point of a window, with its interval."""
    if best is None:
        return "none"
    return percent(best) if "probability" in best else "not known, as the numbers are single estimates"


def border_rows(found: Answer, units: str) -> list[tuple[str, ...]]:
    """The safe intervals of every line of the map: where, in a, in b, and how far the
    ends moved, with the responses beyond them."""
    fmt, table = Formatter(units), []
    for row in found["borders"]:
        axis = row["axis"]
        where = fmt.setting(row["at"], row["at"]) or "in all"
        spans = []
        for side in ("a", "b"):
            ends = [row["lower"][side], row["upper"][side]]
            spans.append("not safe" if ends[0] is None else fmt.range(axis, ends))
        moves = [_moved(axis, row[end], fmt) for end in ENDS]
        table.append((where, *spans, *moves))
    return table


def moved_rows(found: Answer, units: str) -> list[tuple[str, ...]]:
    """As :func:`border_rows`, where a border moved, or an interval is only in one."""
    table = zip(found["borders"], border_rows(found, units), strict=True)
    return [text for row, text in table if any(row[end]["moved"] != 0.0 for end in ENDS)]


def _moved(axis: str, end: Answer, fmt: Formatter) -> str:
    if end["moved"] is None:
        side = "a" if end["a"] is not None else "b"
        beyond = response_words(end[f"responses_{side}"]) or "edge of the map"
        return f"{'lost' if side == 'a' else 'gained'} (beyond: {beyond})"
    if end["moved"]:
        sign = "+" if end["moved"] > 0 else "-"
        text = f"{sign}{fmt.value(axis, abs(end['moved']))}"
    else:
        text = "same"
    beyond_a, beyond_b = (response_words(end[f"responses_{side}"]) or "edge of the map" for side in ("a", "b"))
    return f"{text} ({beyond_a if beyond_a == beyond_b else f'{beyond_a}, now {beyond_b}'})"


def onset_rows(found: Answer, units: str) -> list[tuple[str, ...]]:
    """Where each response occurs in a and in b, on every line where that differs: the
    place, the way, the response, in a, in b."""
    fmt, table = Formatter(units), []
    for row in found["onsets"]:
        if row["a"] == row["b"]:
            continue
        spans = ["none" if row[s] is None else fmt.range(row["axis"], row[s]) for s in ("a", "b")]
        where = fmt.setting(row["at"], row["at"]) or "in all"
        way = WAYS.get(row["procedure"], row["procedure"])
        table.append((where, way, row["response"].replace("_", "-"), *spans))
    return table
