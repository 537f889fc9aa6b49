"""The differences between two files, in words."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from nsdrill.analysis.counts import open_words
from nsdrill.analysis.planes import UNJUDGED
from nsdrill.app.answering.answers import contrast
from nsdrill.app.datasets import read_any, with_variables
from nsdrill.data import EDITED_SOURCE, Answer, edited_words
from nsdrill.errors import InputError, count, printable
from nsdrill.quantity import amount, find
from nsdrill.text.contrast_text import moved_rows, onset_rows, sentence
from nsdrill.text.window_text import WIDTH
from nsdrill.text.words import aligned, in_words, point_text, rest, value_text

MAX_CHANGES = 12
DIGEST = "model_digest"  # of all that may change the bits
MAX_VALUES = 3  # of special points in one cell


def attribute_text(name: str, text: str | None, units: str) -> str | None:
    """An attribute of a trace, which is in SI, in the system ``units``."""
    if units == "si" or text is None or find(name) is None:
        return text
    return value_text(name, float(text.split()[0]), units)


def lines(d: Answer, units: str, bits: bool) -> Iterator[str]:
    yield f"a: {d['files'][0]}"
    yield f"b: {d['files'][1]}"
    for side, source in d[EDITED_SOURCE].items():
        if told := edited_words({EDITED_SOURCE: source}):
            yield printable(f"{side} is {told}")
    rows = [
        ("Study", [(row["key"], row["a"], row["b"]) for row in d["study"]]),
        ("Run", [(row["name"], row["a"], row["b"]) for row in d["run"]]),
        ("Made by", [(row["name"], row["a"], row["b"]) for row in d["made"] if bits or row["name"] == DIGEST]),
    ]
    for heading, differing in rows:
        if differing:
            yield ""
            yield f"{heading}:"
            yield from aligned([("", "a", "b"), *((name, _cell(name, x), _cell(name, y)) for name, x, y in differing)])
    if any(row["name"] == DIGEST for row in d["made"]):
        yield "Other versions, or a model whose files changed: numbers may differ by that alone."
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
    elif not d.get("declares_responses", True):
        yield f"Responses: not known, as {UNJUDGED}."
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
        name = f"{row['label'].replace('_', ' ')}, {row['words']}"
        common = row["a"] - len(row["only_a"])
        rows.append((name, *map(str, (row["a"], row["b"], common)), text(row["only_a"]), text(row["only_b"])))
    yield from aligned(rows)


def _probability_lines(probabilities: Answer, swept: list[str], units: str) -> Iterator[str]:
    yield (f"Probabilities at {count(probabilities['points'], 'operating point')}, means and largest change:")
    for side in ("a", "b"):
        if words := open_words(probabilities[side], "samples"):
            yield f"  in {side} {words}: means are of the points known in both, intervals cover what is not known"
    rows: list[tuple[str, ...]] = [("", "a", "b", "b less a", "at", "intervals apart")]
    for row in probabilities["outcomes"]:
        apart, name = f"at {count(row['apart'], 'point')}", in_words(row["name"])
        if row["at"] is None:
            rows.append((name, "unknown", "unknown", "unknown", "", apart))
            continue
        means = (f"{100 * row[side]:.1f} %" for side in ("a", "b"))
        where = _place_text(row["at"], [name for name in swept if name in row["at"]], units)
        known = "" if row["known"] == probabilities["points"] else f", known at {row['known']}"
        rows.append((name, *means, f"{100 * row['largest']:+.1f} %", where, f"{apart}{known}"))
    yield from aligned(rows)


def _response_lines(responses: Answer, points: int, swept: list[str], units: str) -> Iterator[str]:
    unknown = f"; {responses['unknown']} are not known in one of the files or both" if responses["unknown"] else ""
    yield (f"Responses: {responses['changed']} of {points} changed{unknown}{':' if responses['changed'] else '.'}")
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
    for name in ("point", "branch", "curve_point", "curve"):  # of branches
        if name in point:
            return f"{name.replace('_', ' ')} {point[name]}"
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
