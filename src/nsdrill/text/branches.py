"""A file of branches in words, and as a table."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.bifurcations import meanings_of
from nsdrill.data import Answer
from nsdrill.errors import printable
from nsdrill.models.registry import model_in
from nsdrill.quantity import find, sign, unit_in
from nsdrill.text.words import label_of, point_text, rest, value_text
from nsdrill.units import from_si, plain_units

if TYPE_CHECKING:
    from xarray import Dataset


MAX_SPECIAL = 40
MAX_LINES = 36  # of paragraphs; longer ones become a line for each branch
MAX_ROWS, MAX_PARTS = 20, 4  # lines, and stable parts named in each
# after the end of a stable part, by what it is
END_WORDS = {"bifurcation": "", "branch": " (end of the branch)", "point": " (its last point)"}


def lines(file: str, s: Answer, units: str, everything: bool = False) -> Iterator[str]:
    """The summary of a file of branches, in words: a paragraph for each, with a sentence
    on every special point, where that is short or ``everything`` is wanted; else a line
    for each."""
    branches = list(_paragraphs(s, units))
    if not everything and len(branches) > MAX_LINES:
        branches = list(_rows(s, units))
    yield from _head(file, s, units)
    yield from branches
    yield from _curve_lines(s, units)


def _head(file: str, s: Answer, units: str) -> Iterator[str]:
    along = s["along"]

    def text(value: float) -> str:
        return value_text(along, value, units)

    yield printable(f"{file}: branches of motions. {s['title']}".rstrip())
    yield f"  made           {s['created']} by nsdrill {s['nsdrill_version']}"
    for key, value in s["overrides"].items():
        yield printable(f"  with           {key} = {value}")
    yield f"  {label_of(along):14s} {text(s['from'])} to {text(s['to'])}"
    if s["operation"]:
        yield f"  at             {point_text(s['operation'], units)}"
    noun = "branch" if len(s["branches"]) == 1 else "branches"
    yield f"  points         {s['points']} on {len(s['branches'])} {noun}"
    for word, number in s["seeds"].items():
        yield f"  seeds          {number}: {word}"


def _rows(s: Answer, units: str) -> Iterator[str]:
    """A line for each branch: its motion, where it is stable, its special points; and
    what these mean."""

    def interval(low: float, high: float) -> str:
        first, last = (value_text(s["along"], end, units).split(" ") for end in (low, high))
        return f"{float(first[0]):.4g} to {float(last[0]):.4g} {' '.join(last[1:])}"

    meanings: dict[str, str] = {}
    yield ""
    for branch in s["branches"][:MAX_ROWS]:
        counts: dict[str, int] = {}
        for special in branch["special"]:
            name = special["label"].replace("_", " ")
            counts[name] = counts.get(name, 0) + 1
            meanings[name] = special["meaning"]
        stable = ", ".join(interval(min(part), max(part)) for part in branch["stable"][:MAX_PARTS])
        if (more := len(branch["stable"]) - MAX_PARTS) > 0:
            stable += f" and {more} more"
        looked = "" if branch["looked_between"] or not stable else " (at its points)"
        special_text = ", ".join(f"{number} {name}" for name, number in counts.items())
        yield (
            f"  {branch['branch']:3d}  {branch['words']}, {interval(branch['min'], branch['max'])}: "
            + "; ".join(filter(None, (f"stable {stable}{looked}" if stable else "unstable", special_text)))
        )
    yield from rest(s["branches"], MAX_ROWS, "branches")
    yield ""
    for name, meaning in meanings.items():
        yield f"  {name}: {meaning}"
    yield "  Every special point, and why each branch ends: --all, or --json."


def _paragraphs(s: Answer, units: str) -> Iterator[str]:
    def text(value: float) -> str:
        return value_text(s["along"], value, units)

    for branch in s["branches"]:
        origin = f", springs from branch {branch['parent']}" if branch["parent"] >= 0 else ""
        yield (
            f"\nBranch {branch['branch']}: {branch['words']}, {text(branch['min'])} to {text(branch['max'])}{origin}"
        )
        stable = ", ".join(
            " to ".join(text(end) + END_WORDS[what] for end, what in sorted(zip(*part, strict=True)))
            for part in zip(branch["stable"], branch["stable_ends"], strict=True)
        )
        yield f"  stable         {stable or 'nowhere'}"
        if stable and not branch["looked_between"]:
            yield "                 at its points; bifurcations between them are not looked for"
        yield f"  ends           {branch['end_reason']}"
        for special in branch["special"][:MAX_SPECIAL]:
            note = f" ({special['note']})" if special["note"] else ""
            name = special["label"].replace("_", " ")
            meaning = special["meaning"] + _change(special["unstable_before"], special["unstable_after"])
            yield (f"  {text(special['value']):14s} {name}{note}: {meaning} [point {special['point']}]")
        if (more := len(branch["special"]) - MAX_SPECIAL) > 0:
            yield f"  ... {more} more; --json has all"


def _curve_lines(s: Answer, units: str) -> Iterator[str]:
    along = s["along"]
    for curve in s["curves"]:
        over = next(
            name for name in curve if name not in (along, "curve", "label", "points", "lobes", "words", "end_reason")
        )
        low, high = (value_text(over, value, units) for value in curve[over])
        first, last = (value_text(along, value, units) for value in curve[along])
        name = curve["label"].replace("_", " ")
        yield (
            f"\nCurve {curve['curve']}: {name} of {curve['words']}, {low} to {high}, at {first} "
            f"to {last}; "
            f"ends: {curve['end_reason']}"
        )


def _change(before: int | None, after: int | None) -> str:
    """The change of stability at a special point, in words."""
    if before is None or after is None or before == after:
        return ""
    if before == 0 or after == 0:
        return "; stable to one side" if before * after == 0 else ""
    return f"; {before} and {after} unstable directions to its sides"


def table(data: Dataset, units: str) -> str:
    """One row per point as CSV: its branch, motion, coordinates, label in words,
    multipliers, features, states."""
    words = {code: label.name for code, label in meanings_of(model_in(data.attrs)).items()}
    branch_of_point = np.asarray(data["branch_of_point"].values)
    headings: list[str] = ["point", "branch", "motion", "lobes", "label_words"]
    columns: list[Sequence[object]] = [
        list(range(len(branch_of_point))),
        branch_of_point.tolist(),
        [str(data["motion"].values[k]) for k in branch_of_point],
        [int(data["lobes"].values[k]) for k in branch_of_point],
        [words.get(int(code), str(code)) for code in data["label"].values],
    ]
    for name in data.variables:
        variable = data[name]
        if "point" not in variable.dims or name in ("point", "branch_of_point"):
            continue
        values = variable.values.reshape(len(branch_of_point), -1)
        last = variable.dims[-1]
        entries = [""] if variable.ndim == 1 else [f"_{entry}" for entry in data[last].values.tolist()]
        si = str(variable.attrs.get("units", ""))
        for column, entry in enumerate(entries):
            if values.dtype.kind == "f" and si not in ("", "1"):
                unit = field_unit(name, plain_units(si)) if units == "field" else si
                headings.append(f"{name}{entry} [{sign(unit)}]")
                columns.append([repr(from_si(float(v), unit) if unit != si else float(v)) for v in values[:, column]])
            else:
                headings.append(f"{name}{entry}")
                columns.append(values[:, column].tolist())
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(headings)
    writer.writerows(zip(*columns, strict=True))
    return out.getvalue()


def field_unit(name: str, units: str) -> str:
    """The field unit of the variable ``name`` with the SI unit ``units``: ft for a
    depth, in for another length."""
    if units in ("percent", "1"):
        return units
    known = find(name)
    return known.unit("field") if known and known.units == units else unit_in(units, "field") or units
