"""Results for other programs: a table in CSV, or a netCDF-4 file."""

from __future__ import annotations

import csv
import os
import shutil
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from nsdrill.data import Array, Results
from nsdrill.files import replacing
from nsdrill.models.leaves import words_along
from nsdrill.models.vocabulary import BY_NAME, IN_TRACE
from nsdrill.store import hdf5
from nsdrill.store.layout import in_words
from nsdrill.units import CF
from nsdrill.variables import CHECKS, COORDINATES, INFERRED, OK, POINT, Variable

_DEFAULT_ROOMS = ("run", "label", "feature", "trust")


def to_csv(
    results: Results,
    path: str | os.PathLike[str],
    *,
    peaks: bool = False,
    section: bool = False,
    states: bool = False,
    overwrite: bool = True,
) -> None:
    """Write the table of :func:`csv_rows` to ``path``."""
    rows = csv_rows(results, peaks=peaks, section=section, states=states)
    with replacing(path, overwrite=overwrite) as whole, whole.text() as file:
        csv.writer(file).writerows(rows)


def csv_rows(
    results: Results, *, peaks: bool = False, section: bool = False, states: bool = False
) -> Iterator[list[Any]]:
    """The headings of ``results`` as a table, then one row per point: its coordinates,
    every variable, and the flags also in words. The word is ``unknown`` for a label
    that a point lacks because its run failed or has not been made.

    ``peaks``, ``section`` and ``states`` add a column per peak, return to the section
    and state: ``axial_peaks_0 [m]``, ``final_state_lag [rad]``. Numbers are written with
    enough digits to restore the same bits; a missing one is ``nan``. Rows are made one
    at a time, so memory does not grow with the table.
    """
    optional = {"peaks": peaks, "section": section, "states": states}
    rooms = (*_DEFAULT_ROOMS, *(room for room, wanted in optional.items() if wanted))
    chosen = [BY_NAME[name] for name in results.variables if name in BY_NAME and BY_NAME[name].room in rooms]
    units = {name: cf for name, (cf, _) in COORDINATES.items()} | {"sample": "", "start": ""}
    units |= {axis.name: "" if words_along(axis.name) else CF[axis.units] for axis in results.more}
    unknowns = [unknown for unknown in results.drawn if "sample" in results.grid]
    heads = [_heading(name, units[name]) for name in results.grid]
    heads += [_heading(unknown.name, CF[unknown.units]) for unknown in unknowns]
    yield [*heads, *_headings(results, chosen)]
    coordinates = {name: in_words(name, results.coords[name]) for name in results.grid}
    words = {v.name: _words(v) for v in chosen if v.flag_meanings is not None}
    for place in np.ndindex(*results.shape):
        row: list[Any] = [coordinates[name][i].item() for name, i in zip(results.grid, place, strict=True)]
        row += [results.drawn[unknown][place[results.grid.index("sample")]].item() for unknown in unknowns]
        for variable in chosen:
            value: Array = results.variables[variable.name][place]
            row.extend(np.atleast_1d(value).tolist())
            if variable.name in words:
                row.append(words[variable.name](int(value)) if _has_value(results, variable, place) else "unknown")
        yield row


def _has_value(results: Results, variable: Variable, place: tuple[int, ...]) -> bool:
    """Whether the point has a value of this variable: only a run that ended well has
    labels, but an inferred point has a response."""
    if variable.room != "label":
        return True
    check = variable.name.removesuffix("_response")
    status = int(results[f"{check}_status" if check in CHECKS else "status"][place])
    return status == OK or (status == INFERRED and variable.name == "response")


def to_netcdf(path: str | os.PathLike[str], path_nc: str | os.PathLike[str], *, overwrite: bool = True) -> None:
    """Copy the results file ``path`` to ``path_nc``. A results file is already a
    netCDF-4 file, HDF5 with dimension scales and no type that netCDF lacks, so its
    bytes are checked and copied."""
    with hdf5.opened(path):
        pass
    with replacing(path_nc, overwrite=overwrite) as copy, open(path, "rb") as file:
        shutil.copyfileobj(file, copy)


def flag_words(variable: Variable, value: int) -> str:
    """A flag value in words: ``ok``, ``bit_bounce+whirl``; ``none`` for an empty
    mask."""
    return _words(variable)(value)


def _words(variable: Variable) -> Callable[[int], str]:
    names = (variable.flag_meanings or "").split()
    if variable.flag_masks is not None:
        masks = list(zip(variable.flag_masks, names, strict=True))
        return lambda value: "+".join(name for mask, name in masks if value & mask) or "none"
    words = dict(zip(variable.flag_values or (), names, strict=True))
    return lambda value: words.get(value, str(value))


def _headings(results: Results, chosen: Iterable[Variable]) -> list[str]:
    names: list[str] = []
    for variable in chosen:
        extra = variable.dims[len(POINT) :]
        if extra:
            for item in results.coords[extra[0]].tolist():
                units = IN_TRACE[item].units if variable.room == "states" else variable.units
                names.append(_heading(f"{variable.name}_{item}", units))
        elif variable.flag_meanings is not None:
            names.extend((variable.name, f"{variable.name}_words"))
        else:
            names.append(_heading(variable.name, "" if variable.dtype.startswith("i") else variable.units))
    return names


def _heading(name: str, units: str) -> str:
    return f"{name} [{units}]" if units and name != "procedure" else name
