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
from nsdrill.store.attributes import get_attributes
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
    import h5py

    with hdf5.writing(path, remedy, overwrite=overwrite) as file:
        hdf5.put_attributes(file, root_attributes(KIND, data.attrs))
        for name in data.dims:
            values = data.coords[name].values if name in data.coords else np.arange(data.sizes[name])
            attrs = data.coords[name].attrs if name in data.coords else {}
            hdf5.add_coordinate(file, str(name), values, attrs)
        for name in [*data.coords, *data.data_vars]:
            if name in data.dims:
                continue
            variable = data[name]
            values = variable.values
            if values.dtype.kind in "OU":
                values = values.astype(object)
                dataset = file.create_dataset(name, data=values, dtype=h5py.string_dtype())
            else:
                dataset = file.create_dataset(name, data=values, **hdf5.storage_of(values))
            for key, value in variable.attrs.items():
                dataset.attrs[key] = value
            if values.dtype.kind == "f":
                dataset.attrs["_FillValue"] = np.nan
            for axis, dim in enumerate(variable.dims):
                dataset.dims[axis].attach_scale(file[dim])


def open_branches(path: str | os.PathLike[str]) -> Any:
    """The Dataset of the branches in ``path``, in memory; FileError if it cannot be
    read as one."""
    import xarray

    with hdf5.opened(path) as file:
        kind = file.attrs["nsdrill_kind"]
        if kind != KIND:
            raise FileError(f"{path}: this is a {kind} file; a file of branches, of nsdrill continue, is needed.")
        attrs = get_attributes(path, file)
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
