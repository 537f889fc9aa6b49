"""Results, traces and branches as files: HDF5, netCDF, and tables in CSV, in SI or in field
units."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.bifurcations import meanings_of
from nsdrill.analysis.counts import AFTER_FAILURE, with_failures
from nsdrill.analysis.safety import known_runs
from nsdrill.app.datasets import variables_of
from nsdrill.data import Results, Trace
from nsdrill.errors import InputError
from nsdrill.files import replacing
from nsdrill.models.choices import words_along
from nsdrill.models.registry import IN_TRACE, model_in, named_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.quantity import find, sign, unit_in
from nsdrill.store import MemoryLog, claim_file, write_results, write_trace
from nsdrill.store.arrays import trace_variables
from nsdrill.store.layout import in_words
from nsdrill.units import cf_units, plain_units, rounded_from_si
from nsdrill.variables import CHECKS, COORDINATES, COUNTED, INFERRED, OK, POINT, Variable

if TYPE_CHECKING:
    from xarray import Dataset

Cell = str | float | bool  # of a row
_DEFAULT_ORIGINS = ("run", "label", "feature", "trust")
_HEADING = re.compile(r"(?P<name>\w+?)(?P<number>_\d+)?(?: \[(?P<units>.+)\])?")


def table(
    data: Results | Trace, units: str = "si", *, peaks: bool = False, section: bool = False, states: bool = False
) -> Iterator[list[Cell]]:
    """The headings and the rows of results, one per point: its coordinates, every
    variable, and the flags also in words. The word is ``unknown`` for a label that a
    point lacks because its run failed or has not been made, and for a response that is
    not known of a run that ended well. Of a trace there is a row for each sample.

    ``peaks``, ``section`` and ``states`` add a column per peak, return to the section
    and state: ``final_state_lag [rad]``. Numbers are in SI, with enough digits to restore
    the same bits, or, where ``units`` is "field", in the field units of the headings, with
    15 digits. A missing one is ``nan``. Rows are made one at a time, so memory does not
    grow with the table.
    """
    if isinstance(data, Trace):
        rows = _trace_rows(data)
    else:
        optional = {"peaks": peaks, "section": section, "states": states}
        rows = _rows(data, (*_DEFAULT_ORIGINS, *(origin for origin, wanted in optional.items() if wanted)))
    return _in_field_units(rows) if units == "field" else rows


def write_rows(rows: Iterator[list[Cell]], path: str | os.PathLike[str], overwrite: bool = True) -> None:
    """Write ``rows`` as CSV."""
    with replacing(path, overwrite=overwrite) as whole, whole.text() as file:
        csv.writer(file).writerows(rows)


def _rows(results: Results, origins: tuple[str, ...]) -> Iterator[list[Cell]]:
    named = named_in(results.attrs)
    chosen = [named[name] for name in results.variables if name in named and named[name].origin in origins]
    judged = {"response", *RESPONSE_KINDS, *model_in(results.attrs).severities}
    is_known = known_runs(results) if "status" in results else np.ones(results.shape, dtype=bool)
    results = replace(results, variables=with_failures(results))
    chosen += [AFTER_FAILURE] if AFTER_FAILURE.name in results else []
    units = {name: cf for name, (cf, _) in COORDINATES.items()} | {"sample": "", "start": "", "procedure": ""}
    units |= {axis.name: "" if words_along(axis.name) else cf_units(axis.units) for axis in results.more}
    unknowns = [unknown for unknown in results.drawn if "sample" in results.grid]
    grid = [(axis, name) for axis, name in enumerate(results.grid) if name not in results.uncertain]
    heads = [_heading(name, units[name]) for _, name in grid]
    heads += [_heading(unknown.name, cf_units(unknown.units)) for unknown in unknowns]
    yield [*heads, *_headings(results, chosen)]
    coordinates = {name: in_words(name, results.coords[name]) for _, name in grid}
    for place in np.ndindex(*results.shape):
        row: list[Cell] = [coordinates[name][place[axis]].item() for axis, name in grid]
        row += [results.drawn[unknown][place[results.grid.index("sample")]].item() for unknown in unknowns]
        for variable in chosen:
            value = results.variables[variable.name][place]
            row.extend(np.atleast_1d(value).tolist())
            if variable.flag_meanings is not None:
                has_value = _has_value(results, variable, place) and (is_known[place] or variable.name not in judged)
                row.append(variable.words(int(value)) if has_value else "unknown")
        yield row


def _has_value(results: Results, variable: Variable, place: tuple[int, ...]) -> bool:
    """Whether the point has a value of this variable: only a run that ended well has
    labels, but an inferred point has a response."""
    if variable.origin != "label":
        return True
    check = variable.name.removesuffix("_response")
    status = int(results[f"{check}_status" if check in CHECKS else "status"][place])
    return status == OK or (status == INFERRED and variable.name == "response")


def _headings(results: Results, chosen: list[Variable]) -> Iterator[str]:
    states = IN_TRACE.beside(model_in(results.attrs))
    for variable in chosen:
        if extra := variable.dims[len(POINT) :]:
            for item in results.coords[extra[0]].tolist():
                units = states[item].units if variable.origin == "states" else variable.units
                yield _heading(f"{variable.name}_{item}", units)
        elif variable.flag_meanings is not None:
            yield from (variable.name, f"{variable.name}_words")
        else:
            yield _heading(variable.name, "" if variable.dtype.startswith("i") else variable.units)


def _heading(name: str, units: str) -> str:
    return f"{name} [{units}]" if units else name


def _trace_rows(trace: Trace) -> Iterator[list[Cell]]:
    variables = trace_variables(trace)
    columns = [trace.time, *(trace.variables[variable.name] for variable in variables)]
    yield ["time [s]", *(f"{variable.name} [{variable.units}]" for variable in variables)]
    yield from map(list, zip(*(column.tolist() for column in columns), strict=True))


def _in_field_units(rows: Iterator[list[Cell]]) -> Iterator[list[Cell]]:
    heads = [str(head) for head in next(rows)]
    shown = [_field_unit(head) for head in heads]
    yield [f"{head.partition(' [')[0]} [{unit}]" if unit else head for head, unit in zip(heads, shown, strict=True)]
    for row in rows:
        yield [rounded_from_si(float(value), unit) if unit else value for value, unit in zip(row, shown, strict=True)]


def _field_unit(head: str) -> str | None:
    """The field unit of the column with this heading, such as ``depth [m]``;
    None where the column is the same in field units, as all without a unit are."""
    match = _HEADING.fullmatch(head)
    if match is None or match["units"] is None:
        return None
    found = find(match["name"].removeprefix("initial_state_").removeprefix("final_state_"))
    if found is None or found.unit("field") == found.units:
        return None
    return found.unit("field")


def branches_table(data: Dataset, units: str) -> str:
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
                columns.append(
                    [repr(rounded_from_si(float(v), unit) if unit != si else float(v)) for v in values[:, column]]
                )
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


ENDINGS = (".h5", ".hdf5", ".nc", ".csv")


def save(data: Results | Trace, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write ``data`` to ``path``, in one step: HDF5 (``.h5``, ``.hdf5``), which is
    netCDF-4 (``.nc``) as well, or a table (``.csv``). FileError where the file exists,
    unless ``overwrite``; InputError where ``data`` is incomplete."""
    suffix = Path(path).suffix.lower()
    if suffix not in ENDINGS:
        raise InputError(f"{os.fspath(path)}: found the ending {suffix or '(none)'}; allowed: {', '.join(ENDINGS)}.")
    claim_file(path, overwrite)
    if isinstance(data, Results):
        _check_whole(data)
    if suffix == ".csv":
        write_rows(table(data), path, overwrite)
    elif isinstance(data, Trace):
        write_trace(path, data, overwrite=overwrite)
    else:
        write_results(path, MemoryLog.of(data))


def _check_whole(results: Results) -> None:
    """InputError where a results file with these results would not be valid."""
    if lacking := [v.name for v in variables_of(results) if v.name not in results.variables]:
        few = f"{', '.join(lacking[:4])}{f' and {len(lacking) - 4} more' if len(lacking) > 4 else ''}"
        raise InputError(f"the Dataset: found results without {few}; allowed: results with all of their variables.")
    for name in COUNTED:
        values = results.coords.get(name, np.arange(0))
        if not np.array_equal(values, np.arange(len(values))):
            raise InputError(f"the Dataset: found a part of {name}; allowed: all of it, from 0 on.")
