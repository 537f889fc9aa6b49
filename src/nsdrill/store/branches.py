"""The file of branches: the points of all branches in one dimension, branch after
branch, as a contiguous ragged array of the CF conventions."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.errors import FileError
from nsdrill.files import MAKE_ROOM, reason
from nsdrill.store import hdf5
from nsdrill.store.attributes import plain_attributes
from nsdrill.store.layout import root_attributes

KIND = "branches"
_REQUIRED = (
    "motion",
    "lobes",
    "parent",
    "parent_point",
    "closed",
    "end_reason",
    "row_size",
    "branch_of_point",
    "state",
    "period",
    "multiplier_real",
    "multiplier_imag",
    "unstable",
    "label",
    "arclength",
)


def write_branches(
    path: str | os.PathLike[str], data: Any, remedy: Callable[[], str] = lambda: MAKE_ROOM, *, overwrite: bool = True
) -> None:
    """Write the Dataset ``data`` of branches to ``path``, in one step; NsdrillError, with
    ``remedy``, if the disk refuses."""
    with hdf5.writing(path, remedy, overwrite=overwrite) as file:
        hdf5.put_attributes(file, root_attributes(KIND, data.attrs))
        for name in data.dims:
            # without a coordinate xarray counts
            hdf5.add_array(file, str(name), (name,), data[name].values, data[name].attrs)
        for name in [*data.coords, *data.data_vars]:
            if name not in data.dims:
                fill = {"_FillValue": np.nan} if data[name].dtype.kind == "f" else {}
                hdf5.add_array(file, name, data[name].dims, data[name].values, {**data[name].attrs, **fill})


def open_branches(path: str | os.PathLike[str]) -> Any:
    """The Dataset of the branches in ``path``, in memory; FileError if it cannot be
    read as one."""
    import xarray

    with hdf5.opened(path, KIND) as file:
        attrs = plain_attributes(path, file.attrs)
    try:
        with xarray.open_dataset(path, engine="h5netcdf", decode_cf=False) as dataset:
            data = dataset.load()
    except Exception as error:  # of metadata that only xarray reads
        raise hdf5.damaged(path, reason(error)) from error
    if lacking := [name for name in _REQUIRED if name not in data]:
        raise FileError(f"{path}: the variable {lacking[0]} is missing. {hdf5.EDITED}")
    sizes = data["row_size"].values
    if data.sizes.get("point") != int(sizes.sum()) or np.any(sizes < 0):
        raise FileError(f"{path}: its branches do not have as many points as they say. {hdf5.EDITED}")
    for name in [*data.variables]:
        data[name].attrs.pop("_FillValue", None)
    return data.assign_attrs(attrs)
