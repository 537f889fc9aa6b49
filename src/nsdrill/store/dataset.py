"""Results and traces as xarray Datasets, the same that xarray reads from their
files. xarray is imported here alone, as it takes longer than all that ``show`` and
``check`` do."""

from __future__ import annotations

import os
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.counts import AFTER_FAILURE, with_failures
from nsdrill.analysis.knowledge import KNOWLEDGE, knowledge_of
from nsdrill.data import Attributes, Results, Trace, edited_together
from nsdrill.errors import FileError
from nsdrill.files import reason
from nsdrill.models.registry import model_in
from nsdrill.store import hdf5, in_use
from nsdrill.store.arrays import Points, dims_of, trace_in, trace_variables
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
    model = model_in(data.attrs)
    known = {variable.name: variable for variable in model.variables}
    lengths = {name: len(data.coords[name]) for name in data.grid}
    attrs = root_attributes("results", data.attrs, data.more, lengths, contents.unknowns)
    order = file_order(lengths, attrs)
    variables = {
        name: (
            (*order, *known[name].dims[len(POINT) :]),
            to_file(values, contents.grid, order),
            variable_attributes(known[name], contents.states, contents.model),
        )
        for name, values in data.variables.items()
        if name != AFTER_FAILURE.name
    }
    if "status" in data.variables and "response" in data.variables:
        found = to_file(knowledge_of(data, model=model), contents.grid, order)
        variables[KNOWLEDGE.name] = (order, found, variable_attributes(KNOWLEDGE))
    coordinates = stored_coordinates(data.coords, order, contents, data.drawn)
    return _dataset(variables, coordinates | _not_carried(data, order), attrs)


def _not_carried(data: Results, order: Sequence[str]) -> dict[str, Stored]:
    """The coordinate that says which runs came after a failed one in their chain, so that
    every part of the Dataset says so too; none where there are no such runs."""
    marks = with_failures(data).get(AFTER_FAILURE.name)
    if marks is None:
        return {}
    values = to_file(marks, data.grid, order)
    return {AFTER_FAILURE.name: (tuple(order), values, variable_attributes(AFTER_FAILURE))}


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


def _check_scales(path: str | os.PathLike[str]) -> None:
    """FileError where a dataset of the file ``path`` names no dimensions where it should:
    HDF5, of which xarray asks them, would follow whatever is there, and end the process."""
    with hdf5.opened(path) as file:
        for array in hdf5.arrays_in(file).values():
            dims_of(array)


@contextmanager
def opened_by_xarray(path: str | os.PathLike[str], **options: object) -> Iterator[Dataset]:
    """The file ``path`` as xarray opens it, with its ``options``, or in memory where
    another program may write it; whatever fails is the FileError of a damaged file."""
    import xarray

    _check_scales(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of attributes that other programs wrote: nsdrill checks its own
            if in_use.is_flagged(path):
                with xarray.open_dataset(in_use.Reader(path), engine="h5netcdf", **options) as data:
                    yield data.load()
                return
            try:
                data = xarray.open_dataset(path, engine="h5netcdf", **options)
            except OSError as error:
                if not in_use.refuses_lock(error):
                    raise
                data = xarray.open_dataset(in_use.Reader(path), engine="h5netcdf", **options)
        yield data
    except Exception as error:  # of metadata that only xarray reads
        raise hdf5.damaged(path, reason(error)) from error


def open_results(path: str | os.PathLike[str]) -> Dataset:
    """The results file ``path`` as an xarray Dataset that reads its numbers lazily.
    FileError if it cannot be read."""
    results = read_results(path, ())
    is_carried = not {"up", "down"}.isdisjoint(results.procedures)
    with opened_by_xarray(path) as data:
        data.attrs |= edited_together(results.attrs)
        if AFTER_FAILURE.name in data.variables:
            made = data.set_coords([AFTER_FAILURE.name])
        elif is_carried:
            order = file_order({name: len(results.coords[name]) for name in results.grid}, results.attrs)
            made = data.assign_coords(_not_carried(read_results(path, ("status",)), order))
        else:
            return data
        made.set_close(data.close)  # a Dataset that is made from another closes no file
        return made
