"""Results and traces as xarray Datasets, the same that xarray reads from their
files. xarray is imported here alone, as it takes longer than all that ``show`` and
``check`` do."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.data import Attributes, Results, Trace
from nsdrill.errors import FileError
from nsdrill.files import MAKE_ROOM, reason
from nsdrill.models.registry import model_in
from nsdrill.store import hdf5
from nsdrill.store.arrays import Points, trace_in, trace_variables
from nsdrill.store.layout import (
    Stored,
    coordinate_attributes,
    file_order,
    plain_attribute,
    plain_attributes,
    root_attributes,
    stored_attributes,
    stored_coordinates,
    to_file,
    variable_attributes,
)
from nsdrill.store.points import contents_in
from nsdrill.store.results import read_results
from nsdrill.variables import FORMAT_VERSION, POINT

if TYPE_CHECKING:
    from xarray import Dataset

_NAME = "the Dataset"
_GIVE = "Give one of nsdrill.run or nsdrill.open_results, or a part of it by isel or sel."


def to_dataset(data: Results | Trace) -> Dataset:
    """``data`` as the xarray Dataset that xarray reads from its file: the same
    dimensions, coordinates, attributes and types; flags are whole numbers."""
    if isinstance(data, Trace):
        variables = {v.name: (v.dims, data.variables[v.name], variable_attributes(v)) for v in trace_variables(data)}
        coordinates: dict[str, Stored] = {"time": (("time",), data.time, coordinate_attributes("time"))}
        return _dataset(variables, coordinates, root_attributes("trace", data.attrs))
    contents = contents_in(data)
    known = {variable.name: variable for variable in model_in(data.attrs).variables}
    lengths = {name: len(data.coords[name]) for name in data.grid}
    attrs = root_attributes("results", data.attrs, data.more, lengths, contents.unknowns)
    order = file_order(lengths, attrs)
    variables = {
        name: (
            (*order, *known[name].dims[len(POINT) :]),
            to_file(values, contents.grid, order),
            variable_attributes(known[name], contents.states),
        )
        for name, values in data.variables.items()
    }
    return _dataset(variables, stored_coordinates(data.coords, order, contents, data.drawn), attrs)


def _dataset(variables: Mapping[str, Stored], coordinates: Mapping[str, Stored], attrs: Attributes) -> Dataset:
    """A Dataset with root attributes as xarray reads them, where numbers are numpy scalars
    or arrays, and encoded as a file of nsdrill is."""
    import xarray

    root = {}
    for name, value in stored_attributes(attrs).items():
        array = np.asarray(value)
        root[name] = value if isinstance(value, str) else array.ravel()[0] if array.size == 1 else array
    data = xarray.Dataset(dict(variables), dict(coordinates), root)
    scalars = " ".join(
        name for name, (dims, _, _) in coordinates.items() if dims in ((), ("sample",)) and dims != (name,)
    )
    for name in variables:
        if data[name].dtype.kind == "f":
            data[name].encoding["_FillValue"] = np.nan
        if scalars:
            data[name].encoding["coordinates"] = scalars
    return data


def from_dataset(data: Dataset, names: Collection[str] | None = None) -> Results | Trace:
    """The inverse of :func:`to_dataset`; of results only the variables ``names``, if
    given. The dimensions may be in any order, and the Dataset may be a selection of
    axes, procedures, peaks and variables. FileError where ``data`` is not a Dataset of
    nsdrill."""
    import xarray

    if not isinstance(data, xarray.Dataset):
        raise FileError(f"found an object of the type {type(data).__name__}; allowed: an xarray Dataset. {_GIVE}")
    # xarray arithmetic may drop the attributes
    inferred = "trace" if "time" in data.coords else "results" if "procedure" in data.coords else None
    marks = {"nsdrill_kind": inferred, "format_version": FORMAT_VERSION, **data.attrs}
    kind, version = (plain_attribute(marks, name) for name in ("nsdrill_kind", "format_version"))
    if kind not in ("results", "trace") or not isinstance(version, int):
        raise FileError(f"{_NAME}: found no attribute nsdrill_kind that says results or trace. {_GIVE}")
    hdf5.check_version(_NAME, marks)
    attrs = plain_attributes(_NAME, data.attrs)
    try:
        if kind == "trace":
            return trace_in(_NAME, data.variables, attrs, _GIVE)
        return Points.of(_NAME, data.variables, attrs, _GIVE, whole=False).results(names)
    except hdf5.UNREADABLE as error:  # of the file from which the Dataset is read lazily
        raise FileError(f"{_NAME}: cannot be read: {reason(error)}. {_GIVE}") from error


@contextmanager
def _opened(path: str | os.PathLike[str], **options: object) -> Iterator[Dataset]:
    """The file ``path`` as xarray opens it, with its ``options``; whatever fails is the
    FileError of a damaged file."""
    import xarray

    try:
        yield xarray.open_dataset(path, engine="h5netcdf", **options)
    except Exception as error:  # of metadata that only xarray reads
        raise hdf5.damaged(path, reason(error)) from error


def open_results(path: str | os.PathLike[str]) -> Dataset:
    """The results file ``path`` as an xarray Dataset that reads its numbers lazily. A
    file of version 1 is read at once, with the dimensions of version 2. FileError if it
    cannot be read."""
    if not read_results(path, ()).attrs["format_version"] > 1:
        return to_dataset(read_results(path))
    with _opened(path) as data:
        return data


# The file of branches: the points of all branches in one dimension, branch after
# branch, as a contiguous ragged array of the CF conventions.


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
    path: str | os.PathLike[str],
    data: Dataset,
    remedy: Callable[[], str] = lambda: MAKE_ROOM,
    *,
    overwrite: bool = True,
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


def open_branches(path: str | os.PathLike[str]) -> Dataset:
    """The Dataset of the branches in ``path``, in memory; FileError if it cannot be
    read as one."""
    with hdf5.opened(path, KIND) as file:
        attrs = plain_attributes(path, file.attrs)
    with _opened(path, decode_cf=False) as dataset, dataset:
        data = dataset.load()
    if lacking := [name for name in _REQUIRED if name not in data]:
        raise FileError(f"{path}: the variable {lacking[0]} is missing. {hdf5.EDITED}")
    sizes = data["row_size"].values
    if data.sizes.get("point") != int(sizes.sum()) or np.any(sizes < 0):
        raise FileError(f"{path}: its branches do not have as many points as they say. {hdf5.EDITED}")
    for name in [*data.variables]:
        data[name].attrs.pop("_FillValue", None)
    return data.assign_attrs(attrs)
