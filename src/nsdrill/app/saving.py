"""Saving results and traces to files."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from nsdrill.app.datasets import variables_of, with_missing_features
from nsdrill.app.table import table, write_rows
from nsdrill.data import Results, Trace
from nsdrill.errors import InputError
from nsdrill.store import MemoryLog, claim_file, write_results, write_trace
from nsdrill.variables import COUNTED

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
        data = with_missing_features(data)
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
    for name in results.axes:
        if not np.all(np.diff(results.coords[name]) > 0):
            raise InputError(f"the Dataset: found values of {name} that do not ascend; allowed: sorted ones (sortby).")
    for name in COUNTED:
        values = results.coords.get(name, np.arange(0))
        if not np.array_equal(values, np.arange(len(values))):
            raise InputError(f"the Dataset: found a part of {name}; allowed: all of it, from 0 on.")
