"""Two files in words: their differences, and their windows against each other as an
engineer compares them."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence

from nsdrill.analysis.bifurcations import motion_text
from nsdrill.analysis.maps import least_share
from nsdrill.app.answers import contrast
from nsdrill.app.datasets import read_any, with_variables
from nsdrill.data import Answer
from nsdrill.errors import InputError, count
from nsdrill.models.responses import RESPONSES
from nsdrill.plot.answer import (
    WAYS,
    Formatter,
    answer,
    chosen_map,
    in_order,
    obstacle_words,
    of_both,
    percent,
    warnings,
)
from nsdrill.quantity import amount, find
from nsdrill.text.window import MAX_ROWS, WIDTH
from nsdrill.text.words import aligned, in_words, point_text, rest, value_text

MAX_CHANGES = 12
MAX_VALUES = 3  # of special points in one cell
ENDS = ("lower", "upper")
MAX_KEYS = 6  # in one line


def attribute_text(name: str, text: str | None, units: str) -> str | None:
    """An attribute of a trace, which is in SI, in the system ``units``."""
    if units == "si" or text is None or find(name) is None:
        return text
    return value_text(name, float(text.split()[0]), units)


def lines(d: Answer, units: str, bits: bool) -> Iterator[str]:
    yield f"a: {d['files'][0]}"
    yield f"b: {d['files'][1]}"
    rows = [
        ("Study", [(row["key"], row["a"], row["b"]) for row in d["study"]]),
        ("Run", [(row["name"], row["a"], row["b"]) for row in d["run"]]),
        ("Made by", [(row["name"], row["a"], row["b"]) for row in d["made"] if bits]),
    ]
    for heading, differing in rows:
        if differing:
            yield ""
            yield f"{heading}:"
            yield from aligned([("", "a", "b"), *((name, _cell(name, x), _cell(name, y)) for name, x, y in differing)])
    yield ""
    if d["kinds"][0] != d["kinds"][1]:
        words = {"results": "a sweep", "trace": "a trace", "branches": "branches"}
        one, other = (words[kind] for kind in d["kinds"])
        yield f"One is {one}, the other {other}: there are no numbers to compare."
    elif d["same_numbers"]:
        compared = count(d["points"], "sample" if d["kinds"][0] == "trace" else "point")
        subject = "numbers" if d["study"] or d["run"] or d["made"] else "files"
        yield f"The {subject} are the same to the bit: {compared}, {count(len(d['variables']), 'variable')}."
    else:
        if d["kinds"][0] == "results":
            yield from _window_lines(d, units)
        yield from _number_lines(d, units, bits)


def _window_lines(d: Answer, units: str) -> Iterator[str]:
    """What changed for the driller: the windows of two sweeps over the same axes."""
    try:
        a, b = (with_variables(read_any(file), "diff", ()) for file in d["files"])
        found = contrast(a, b)
    except InputError:  # other axes, or a single point: there are no two windows
        return
    yield from textwrap.wrap(sentence(found, units), WIDTH)
    borders = moved_rows(found, units)
    for head, rows in (
        (("moved borders", "a", "b", "lower end", "upper end"), borders),
        (("responses", "", "", "in a", "in b"), onset_rows(found, units)),
    ):
        if rows:
            yield from aligned([head, *rows[:MAX_CHANGES]])
            if len(rows) > MAX_CHANGES:
                yield f"  and {len(rows) - MAX_CHANGES} more: nsdrill window A.h5 B.h5"
    yield ""


def _cell(name: str, value: str | None) -> str:
    if value is None:
        return "not there"
    return f"{value[:12]}..." if name in ("study_sha256", "model_digest") else value


def _number_lines(d: Answer, units: str, bits: bool) -> Iterator[str]:
    """Axes, responses and variables of two files of one kind that differ; the variables
    one by one with ``bits``, which traces and branches, of numbers alone, always have."""
    trace, branches = (d["kinds"][0] == kind for kind in ("trace", "branches"))
    noun = "samples" if trace else "points"
    for axis in d["axes"]:
        if "values" in axis:
            value_a, value_b = (_place_text({axis["name"]: value}, [axis["name"]], units) for value in axis["values"])
            yield (f"{axis['name']}: {value_a} in a, {value_b} in b; their points are compared all the same.")
        elif axis["name"] == "sample" and not axis["same"] and axis["common"] < min(axis["a"], axis["b"]):
            yield (
                f"sample: {axis['a']} and {axis['b']} samples, {axis['common']} with the same values of the unknowns."
            )
        elif branches and not axis["same"]:
            yield f"{axis['name']}: {axis['a']} and {axis['b']}, numbered by each file and not paired."
        elif not axis["same"]:
            rounded = " (to rounding)" if axis["common"] == axis["a"] == axis["b"] else ""
            yield (f"{axis['name']}: {axis['a']} and {axis['b']} values, {axis['common']} in common{rounded}.")
    swept = [axis["name"] for axis in d["axes"] if max(axis["a"], axis["b"]) > 1]
    if probabilities := d.get("probabilities"):
        yield from _probability_lines(probabilities, swept, units)
    if branches:
        yield from _special_lines(d, units)
    if not d["points"]:
        if probabilities:
            yield "The samples differ, so their runs are not compared one by one."
        elif branches:
            yield "The branches have other points, so their numbers are not compared one by one."
        else:
            yield f"The files have no {noun} in common, so there are no numbers to compare."
        return
    whole = all(axis["same"] or "values" in axis for axis in d["axes"])
    yield f"Compared: {'all' if whole else 'the common'} {count(d['points'], noun[:-1])}."
    if responses := d["responses"]:
        yield from _response_lines(responses, d["points"], swept, units)
    for name in ("a", "b"):
        if names := d[f"only_{name}"]:
            yield f"Only in {name}: {', '.join(names)}."
    for row in d["variables"]:
        if sizes := row.get("not_compared"):
            yield (f"{row['name']}: {sizes['a']} and {sizes['b']} values of {sizes['of']}, not compared.")
    differing = [row for row in d["variables"] if row["points"]] if bits or trace or branches else []
    equal = sum(row["same"] for row in d["variables"])
    yield (
        f"Variables: {equal} of {len(d['variables'])} are equal to the "
        f"bit{'; the others:' if differing else '; --bits names the others.'}"
    )
    if differing:
        headings = ("", f"{noun} that differ", "largest difference", "relative", "from" if trace else "at")
        yield from aligned([headings, *(_row(row, swept, units) for row in differing)])


def _special_lines(d: Answer, units: str) -> Iterator[str]:
    """The seeds of two files of branches, and their special points, which need no
    numbers of branches."""
    if d["seeds"][0] != d["seeds"][1]:
        a, b = (f"{sum(seeds.values())} ({seeds.get('followed', 0)} followed)" for seeds in d["seeds"])
        yield f"Seeds: {a} in a, {b} in b; which branches are found depends on them."
    if not d["special"]:
        return

    def text(values: list[float]) -> str:
        more = f" and {len(values) - MAX_VALUES} more" if len(values) > MAX_VALUES else ""
        return ", ".join(value_text(d["along"], value, units) for value in values[:MAX_VALUES]) + more

    yield "Special points by their kind and motion, whatever their branch:"
    rows: list[tuple[str, ...]] = [("", "a", "b", "in both", "only in a", "only in b")]
    for row in d["special"]:
        name = f"{row['label'].replace('_', ' ')}, {motion_text(row['motion'], row['lobes'])}"
        common = row["a"] - len(row["only_a"])
        rows.append((name, *map(str, (row["a"], row["b"], common)), text(row["only_a"]), text(row["only_b"])))
    yield from aligned(rows)


def _probability_lines(probabilities: Answer, swept: list[str], units: str) -> Iterator[str]:
    yield (f"Probabilities at {count(probabilities['points'], 'operating point')}, means and largest change:")
    rows: list[tuple[str, ...]] = [("", "a", "b", "b less a", "at", "intervals apart")]
    for row in probabilities["outcomes"]:
        means = (f"{100 * row[side]:.1f} %" for side in ("a", "b"))
        where = _place_text(row["at"], [name for name in swept if name in row["at"]], units)
        apart = f"at {count(row['apart'], 'point')}"
        rows.append((in_words(row["name"]), *means, f"{100 * row['largest']:+.1f} %", where, apart))
    yield from aligned(rows)


def _response_lines(responses: Answer, points: int, swept: list[str], units: str) -> Iterator[str]:
    yield (f"Responses: {responses['changed']} of {points} changed{':' if responses['changed'] else '.'}")
    changes = responses["changes"]
    for change in changes[:MAX_CHANGES]:
        yield f"  {change['points']:6d}  {in_words(change['from'])} -> {in_words(change['to'])}"
    yield from rest(changes, MAX_CHANGES, "kinds of change (all with --json)")
    if responses["changed"]:
        points_at = responses["at"]
        yield ("  At:" if len(points_at) == responses["changed"] else f"  The first {len(points_at)} of them:")
        for point in points_at:
            yield (f"    {_place_text(point, swept, units)}: {in_words(point['from'])} -> {in_words(point['to'])}")


def _place_text(point: Answer, swept: list[str], units: str) -> str:
    for name in ("point", "branch"):  # of branches
        if name in point:
            return f"{name} {point[name]}"
    words = [point_text({name: point[name]}, units) for name in swept if name not in ("procedure", "start", "sample")]
    words += [f"{name} {point[name]}" for name in ("sample", "start") if name in swept]
    words += [point["procedure"]] if "procedure" in swept else []
    return ", ".join(words) or "the point"


def _row(row: Answer, swept: list[str], units: str) -> tuple[str, ...]:
    unit = "" if row["units"] == "1" else f" {row['units']}"
    if "first" in row:
        where = f"{row['first']:g} s"
    else:
        where = _place_text(row["at"], swept, units)
    largest, relative = row.get("largest"), row.get("relative")
    count = f"{row['points']}" + (f" ({row['undefined']} without a number)" if row.get("undefined") else "")
    difference = "" if largest is None else f"{largest:.3g}{unit}"
    if largest == 0.0:  # 0 and -0: different bits of the same number
        difference = "the sign of zero alone"
    elif largest is not None and units == "field" and (known := find(row["name"])) is not None and known.units:
        difference = amount(largest, known.unit(units), 3)
    return (row["name"], count, difference, "" if relative is None else f"{relative:.2g}", where)


def _with_share(limits: str, window: Answer) -> str:
    """The thresholds, and in how many of the samples of a ``window`` they are passed."""
    level = window["confidence"]
    return limits if level is None else f"{limits}; each in {100 * least_share(level):.1f} % of the samples or more"


def thresholds(found: Answer) -> str:
    """From where the responses of the two count, in words."""
    a, b = map(_with_share, found["thresholds"], found["windows"])
    return a if a == b else f"in a {a}; in b {b}"


def sentence(found: Answer, units: str) -> str:
    """What b wins and costs against a, in one sentence."""
    fmt = Formatter(units)
    a, b = found["names"]
    if not found["both"] + found["gained"] + found["lost"]:
        text = f"None of {found['points']} common points is safe, neither with {b} nor with {a}"
    else:
        text = (
            f"With {b} {found['both'] + found['gained']} of {found['points']} common points are safe, "
            f"with {a} {found['both'] + found['lost']}: {found['gained']} gained, {found['lost']} lost"
        )
    text += "; " + "; ".join(filter(None, (_moves(found, fmt), _occurrence(found), _cost(found, fmt))))
    return text.rstrip("; ") + "."


def _occurrence(found: Answer) -> str:
    """At how many points the responses occur with b and with a, where that differs."""
    parts = [
        f"{RESPONSES[name].words} at {count(pair['b'], 'point')} instead of {pair['a']}"
        for name, pair in found["responses"].items()
        if pair["a"] != pair["b"]
    ]
    return ", ".join(parts)


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
    """The keys in which the studies differ, in one line."""
    rows = found["study"]
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
    yield from of_both(*(warnings(window, units) for window in found["windows"]))


def side_by_side(found: Answer, units: str) -> list[tuple[str, ...]]:
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
    ends moved, with the responses beyond them; of an interval that only one has, those
    that occur there in the other."""
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
    in_a, in_b = (obstacle_words(end[f"why_{side}"], end[f"responses_{side}"]) for side in ("a", "b"))
    if end["moved"] is None:
        return f"lost ({in_b} in b)" if end["b"] is None else f"gained ({in_a} in a)"
    if end["moved"]:
        sign = "+" if end["moved"] > 0 else "-"
        text = f"{sign}{fmt.value(axis, abs(end['moved']))}"
    else:
        text = "same"
    return f"{text} ({in_a if in_a == in_b else f'{in_a}, now {in_b}'})"


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
    axis = Formatter(units).name(found["windows"][0]["axes"][0])
    for heading, head, body in (
        (
            f"Safe intervals along the {axis}, and how far their ends moved from a to b:",
            ("", "a", "b", "lower end", "upper end"),
            border_rows(found, units),
        ),
        (
            f"Where along the {axis} a response occurs, where that changed ({thresholds(found)}):",
            ("", "", "", "a", "b"),
            onset_rows(found, units),
        ),
    ):
        if body:
            yield ""
            yield from textwrap.wrap(heading, WIDTH)
            yield from aligned([head, *body[:MAX_ROWS]])
            if len(body) > MAX_ROWS:
                yield f"  and {len(body) - MAX_ROWS} more (all with --json)"
