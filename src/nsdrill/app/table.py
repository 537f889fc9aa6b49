"""The table of a sweep, or of a trace, as CSV, in SI or in field units."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator
from typing import Any

from nsdrill.data import Results, Trace
from nsdrill.files import replacing
from nsdrill.quantity import find
from nsdrill.store.export import csv_rows
from nsdrill.store.trace import trace_variables
from nsdrill.units import rounded_from_si

_HEADING = re.compile(r"(?P<name>\w+?)(?P<number>_\d+)?(?: \[(?P<units>.+)\])?")


def table(
    data: Results | Trace, units: str = "si", *, peaks: bool = False, section: bool = False, states: bool = False
) -> Iterator[list[Any]]:
    """The headings and the rows of results, as :func:`nsdrill.store.export.csv_rows`
    makes them, or of a trace, a row for each sample; in field units, which are in the
    headings, where ``units`` is "field"."""
    rows = _trace_rows(data) if isinstance(data, Trace) else csv_rows(data, peaks=peaks, section=section, states=states)
    return _in_field_units(rows) if units == "field" else rows


def _trace_rows(trace: Trace) -> Iterator[list[Any]]:
    """Numbers have enough digits to restore the same bits."""
    variables = trace_variables(trace)
    columns = [trace.time, *(trace.variables[variable.name] for variable in variables)]
    yield ["time [s]", *(f"{variable.name} [{variable.units}]" for variable in variables)]
    yield from map(list, zip(*(column.tolist() for column in columns), strict=True))


def write_rows(rows: Iterator[list[Any]], path: str | os.PathLike[str], overwrite: bool = True) -> None:
    """Write ``rows`` as CSV."""
    with replacing(path, overwrite=overwrite) as whole, whole.text() as file:
        csv.writer(file).writerows(rows)


def _in_field_units(rows: Iterator[list[Any]]) -> Iterator[list[Any]]:
    heads = next(rows)
    shown = [_field_unit(head) for head in heads]
    yield [f"{head.partition(' [')[0]} [{unit}]" if unit else head for head, unit in zip(heads, shown, strict=True)]
    for row in rows:
        yield [rounded_from_si(float(value), unit) if unit else value for value, unit in zip(row, shown, strict=True)]


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
