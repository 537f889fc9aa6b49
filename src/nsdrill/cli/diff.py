"""nsdrill diff."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from nsdrill.cli import options
from nsdrill.cli.show import in_words

MOST_CHANGES = 12


@click.command(
    "diff",
    epilog=options.examples(
        "diff a.h5 b.h5",
        "diff a.h5 b.h5 --json | jq .study",
        "diff --exit-code before.h5 after.h5 && echo reproduced",
    ),
)
@options.file_argument("a")
@options.file_argument("b")
@click.option("--json", "as_json", is_flag=True, help="The same for programs.")
@options.units
@click.option(
    "--exit-code", is_flag=True, help="Exit with 1 where the studies or any numbers differ."
)
def command(a: str, b: str, as_json: bool, units: str, exit_code: bool) -> int:
    """Say what differs between the files A and B: results, .part files of runs that go
    on, or traces.

    The keys of the studies, versions and machines; the axes; and on the points that
    both have every variable, to the bit. The exit code is 0 whatever was found, unless
    --exit-code is given. Titles, times, versions and machines do not count for it.
    """
    from nsdrill.app.diff import diff
    from nsdrill.cli.words import in_units

    found = diff(a, b)
    found["run"] = [
        {**row, "a": _told(row["name"], row["a"], units), "b": _told(row["name"], row["b"], units)}
        for row in found["run"]
    ]
    if as_json:
        from nsdrill.data import json_text

        click.echo(json_text(in_units(found, units), indent=2))
    else:
        for line in _lines(found, units):
            click.echo(line)
    return int(exit_code and not (found["same_study"] and found["same_numbers"]))


def _told(name: str, text: str | None, units: str) -> str | None:
    """An attribute of a trace, which stands in SI, in the system ``units``."""
    from nsdrill.cli.words import value_text
    from nsdrill.quantity import find

    if units == "si" or text is None or find(name) is None:
        return text
    return value_text(name, float(text.split()[0]), units)


def _lines(d: dict[str, Any], units: str) -> Iterator[str]:
    from nsdrill.cli.words import count as counted

    yield f"a: {d['files'][0]}"
    yield f"b: {d['files'][1]}"
    rows = [
        ("Study", [(row["key"], row["a"], row["b"]) for row in d["study"]]),
        ("Run", [(row["name"], row["a"], row["b"]) for row in d["run"]]),
        ("Made by", [(row["name"], row["a"], row["b"]) for row in d["made"]]),
    ]
    for head, differing in rows:
        if differing:
            yield ""
            yield f"{head}:"
            yield from _table(
                [
                    ("", "a", "b"),
                    *((name, _there(name, x), _there(name, y)) for name, x, y in differing),
                ]
            )
    yield ""
    if d["kinds"][0] != d["kinds"][1]:
        yield "One is a sweep, the other a trace: there are no numbers to compare."
    elif d["same_numbers"]:
        what = counted(d["points"], "sample" if d["kinds"][0] == "trace" else "point")
        which = "numbers" if d["study"] or d["run"] or d["made"] else "files"
        yield f"The {which} are the same to the bit: {what}, {len(d['variables'])} variables."
    else:
        yield from _numbers(d, units)


def _there(name: str, value: str | None) -> str:
    if value is None:
        return "not there"
    return f"{value[:12]}..." if name in ("study_sha256", "model_digest") else value


def _numbers(d: dict[str, Any], units: str) -> Iterator[str]:
    """Axes, responses and variables of two files of one kind that differ."""
    from nsdrill.cli.words import count as counted

    trace = d["kinds"][0] == "trace"
    what = "samples" if trace else "points"
    for axis in d["axes"]:
        if "values" in axis:
            one, two = (
                _where({axis["name"]: value}, [axis["name"]], units) for value in axis["values"]
            )
            yield f"{axis['name']}: {one} in a, {two} in b; their points are compared all the same."
        elif (
            axis["name"] == "sample"
            and not axis["same"]
            and axis["common"] < min(axis["a"], axis["b"])
        ):
            yield (
                f"sample: {axis['a']} and {axis['b']} samples, {axis['common']} with the same "
                f"values of the unknowns."
            )
        elif not axis["same"]:
            rounded = " (to rounding)" if axis["common"] == axis["a"] == axis["b"] else ""
            yield (
                f"{axis['name']}: {axis['a']} and {axis['b']} values, {axis['common']} in "
                f"common{rounded}."
            )
    swept = [axis["name"] for axis in d["axes"] if max(axis["a"], axis["b"]) > 1]
    if chance := d.get("probabilities"):
        yield from _probabilities(chance, swept, units)
    if not d["points"]:
        if chance:
            yield "The samples are others, so their runs are not compared one by one."
        else:
            yield f"The files have no {what} in common, so there are no numbers to compare."
        return
    whole = all(axis["same"] or "values" in axis for axis in d["axes"])
    yield f"Compared: {'all' if whole else 'the common'} {counted(d['points'], what[:-1])}."
    if responses := d["responses"]:
        yield from _responses(responses, d["points"], swept, units)
    for name in ("a", "b"):
        if alone := d[f"only_{name}"]:
            yield f"Only in {name}: {', '.join(alone)}."
    for row in d["variables"]:
        if sizes := row.get("not_compared"):
            yield (
                f"{row['name']}: {sizes['a']} and {sizes['b']} values of {sizes['of']}, not "
                f"compared."
            )
    differing = [row for row in d["variables"] if row["points"]]
    equal = sum(row["same"] for row in d["variables"])
    yield (
        f"Variables: {equal} of {len(d['variables'])} are equal to the "
        f"bit{'.' if not differing else '; the others:'}"
    )
    if differing:
        heads = (
            "",
            f"{what} that differ",
            "largest difference",
            "relative",
            "from" if trace else "there",
        )
        yield from _table([heads, *(_row(row, swept, units) for row in differing)])


def _probabilities(chance: dict[str, Any], swept: list[str], units: str) -> Iterator[str]:
    from nsdrill.cli.words import count as counted

    yield (
        f"Probabilities at {counted(chance['points'], 'operating point')}, means and largest "
        f"change:"
    )
    rows: list[tuple[str, ...]] = [("", "a", "b", "b less a", "there", "intervals apart")]
    for one in chance["outcomes"]:
        means = (f"{100 * one[side]:.1f} %" for side in ("a", "b"))
        where = _where(one["at"], [name for name in swept if name in one["at"]], units)
        apart = f"at {counted(one['apart'], 'point')}"
        rows.append((in_words(one["name"]), *means, f"{100 * one['largest']:+.1f} %", where, apart))
    yield from _table(rows)


def _responses(
    responses: dict[str, Any], points: int, swept: list[str], units: str
) -> Iterator[str]:
    yield (
        f"Responses: {responses['changed']} of {points} "
        f"changed{':' if responses['changed'] else '.'}"
    )
    changes = responses["changes"]
    for one in changes[:MOST_CHANGES]:
        yield f"  {one['points']:6d}  {in_words(one['from'])} -> {in_words(one['to'])}"
    if len(changes) > MOST_CHANGES:
        yield f"  and {len(changes) - MOST_CHANGES} more kinds of change (all with --json)"
    if responses["changed"]:
        named = responses["at"]
        yield (
            "  At:" if len(named) == responses["changed"] else f"  The first {len(named)} of them:"
        )
        for point in named:
            yield (
                f"    {_where(point, swept, units)}: {in_words(point['from'])} -> "
                f"{in_words(point['to'])}"
            )


def _where(point: dict[str, Any], swept: list[str], units: str) -> str:
    from nsdrill.cli.words import point_text

    words = [
        point_text({name: point[name]}, units)
        for name in swept
        if name not in ("procedure", "start", "sample")
    ]
    words += [f"{name} {point[name]}" for name in ("sample", "start") if name in swept]
    words += [point["procedure"]] if "procedure" in swept else []
    return ", ".join(words) or "the point"


def _row(row: dict[str, Any], swept: list[str], units: str) -> tuple[str, ...]:
    from nsdrill.quantity import amount, find

    unit = "" if row["units"] == "1" else f" {row['units']}"
    if "first" in row:
        where = f"{row['first']:g} s"
    else:
        where = _where(row["at"], swept, units)
    largest, relative = row.get("largest"), row.get("relative")
    count = f"{row['points']}" + (
        f" ({row['undefined']} without a number)" if row.get("undefined") else ""
    )
    told = "" if largest is None else f"{largest:.3g}{unit}"
    if largest == 0.0:  # 0 and -0: other bits of the same number
        told = "the sign of zero alone"
    elif (
        largest is not None
        and units == "field"
        and (one := find(row["name"])) is not None
        and one.units
    ):
        told = amount(largest, one.unit(units), 3)
    return (row["name"], count, told, "" if relative is None else f"{relative:.2g}", where)


def _table(rows: list[tuple[str, ...]]) -> Iterator[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield (
            "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        ).rstrip()
