"""The table of a sweep, or of a trace, as CSV, in SI or in field units."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator
from itertools import chain
from typing import Any, TextIO

from nsdrill.data import Results, Trace
from nsdrill.files import replacing
from nsdrill.quantity import find
from nsdrill.store.export import csv_rows
from nsdrill.store.trace import trace_variables
from nsdrill.units import rounded_from_si

_HEADING = re.compile(r"(?P<name>\w+?)(?P<number>_\d+)?(?: \[(?P<units>.+)\])?")


def write_csv(
    results: Results,
    path: str | os.PathLike[str],
    *,
    peaks: bool = False,
    section: bool = False,
    states: bool = False,
    units: str = "si",
    overwrite: bool = True,
) -> None:
    """As :func:`nsdrill.store.to_csv`; with ``units`` "field" in field units, which are
    in the headings."""
    with replacing(path, overwrite=overwrite) as whole, whole.text() as file:
        print_csv(results, file, peaks=peaks, section=section, states=states, units=units)


def write_trace_csv(
    trace: Trace, path: str | os.PathLike[str], *, units: str = "si", overwrite: bool = True
) -> None:
    """The table of a trace, a row for each sample; in field units where ``units`` is
    "field"."""
    with replacing(path, overwrite=overwrite) as whole, whole.text() as file:
        print_trace_csv(trace, file, units=units)


def print_trace_csv(trace: Trace, file: TextIO, *, units: str = "si") -> None:
    """Write the table of :func:`write_trace_csv` to an open ``file``. Numbers have
    enough digits to restore the same bits."""
    variables = trace_variables(trace)
    columns = [trace.time, *(trace.variables[variable.name] for variable in variables)]
    rows = map(list, zip(*(column.tolist() for column in columns), strict=True))
    table = chain(
        [["time [s]", *(f"{variable.name} [{variable.units}]" for variable in variables)]], rows
    )
    csv.writer(file).writerows(_in_field_units(table) if units == "field" else table)


def print_csv(
    results: Results,
    file: TextIO,
    *,
    peaks: bool = False,
    section: bool = False,
    states: bool = False,
    units: str = "si",
) -> None:
    """Write the table of :func:`write_csv` to an open ``file``."""
    table = csv_rows(results, peaks=peaks, section=section, states=states)
    csv.writer(file).writerows(_in_field_units(table) if units == "field" else table)


def _in_field_units(rows: Iterator[list[Any]]) -> Iterator[list[Any]]:
    heads = next(rows)
    shown = [_field_unit(head) for head in heads]
    yield [
        f"{head.partition(' [')[0]} [{unit}]" if unit else head
        for head, unit in zip(heads, shown, strict=True)
    ]
    for row in rows:
        yield [
            rounded_from_si(float(value), unit) if unit else value
            for value, unit in zip(row, shown, strict=True)
        ]


def _field_unit(head: str) -> str | None:
    """The field unit of the column with this heading, such as ``axial_peaks_0 [m]``;
    None where the column is the same in field units, as all without a unit are."""
    match = _HEADING.fullmatch(head)
    if match is None or match["units"] is None:
        return None
    found = find(match["name"].removeprefix("initial_state_").removeprefix("final_state_"))
    if found is None or found.unit("field") == found.units:
        return None
    return found.unit("field")
