"""Results and traces as xarray Datasets, the same that xarray reads from their
files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import FileError
from nsdrill.files import reason
from nsdrill.models.description import Description
from nsdrill.models.kept import Kept
from nsdrill.models.leaves import words_along
from nsdrill.models.registry import model_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.store import hdf5
from nsdrill.store.attributes import LARGEST, check_attributes, plain_value
from nsdrill.store.layout import (
    Layout,
    coordinate_attributes,
    coordinate_names,
    layout_of,
    root_attributes,
    stored_attributes,
    stored_coordinate,
    variable_attributes,
)
from nsdrill.store.read import LATER_LABELS, check_coordinates, check_file, kept_of, read_results, validated
from nsdrill.store.records import recorded
from nsdrill.store.trace import trace_variables
from nsdrill.units import plain_units
from nsdrill.variables import COUNTED, FORMAT_VERSION, POINT, Axis, Unknown, Variable

_NAME = "the Dataset"
_GIVE = "Give one of nsdrill.run or nsdrill.open_results, or a part of it by isel or sel."


def to_dataset(data: Results | Trace) -> Any:
    """``data`` as the xarray Dataset that xarray reads from its file: the same
    dimensions, coordinates, attributes and types; flags are whole numbers."""
    return _results(data) if isinstance(data, Results) else _trace(data)


def from_dataset(data: Any, names: Iterable[str] | None = None) -> Results | Trace:
    """The inverse of :func:`to_dataset`. The dimensions may be in any order, and the
    Dataset may be a selection of axes, procedures, peaks and variables.

    With ``names`` only these variables of results are converted, and all of them are
    required. FileError where ``data`` is not a Dataset of nsdrill.
    """
    import xarray

    if not isinstance(data, xarray.Dataset):
        raise FileError(f"found an object of the type {type(data).__name__}; allowed: an xarray Dataset. {_GIVE}")
    attrs = {str(name): plain_value(value) for name, value in data.attrs.items()}
    # xarray arithmetic may drop the attributes
    inferred = "trace" if "time" in data.coords else "results" if "procedure" in data.coords else None
    kind, version = attrs.get("nsdrill_kind", inferred), attrs.get("format_version", FORMAT_VERSION)
    if kind not in ("results", "trace") or not isinstance(version, int):
        raise FileError(f"{_NAME}: found no attribute nsdrill_kind that says results or trace. {_GIVE}")
    if not 1 <= version <= FORMAT_VERSION:
        raise FileError(
            f"{_NAME}: file format {version}; this nsdrill knows formats 1 to {FORMAT_VERSION}. Use a newer nsdrill."
        )
    attrs = check_attributes(_NAME, attrs)
    try:
        return _from_trace(data, attrs) if kind == "trace" else _from_results(data, attrs, names)
    except (
        OSError,
        RuntimeError,
        KeyError,
        ValueError,
        TypeError,
        MemoryError,
    ) as error:  # of the file from which the Dataset is read lazily
        raise FileError(f"{_NAME}: cannot be read: {reason(error)}. {_GIVE}") from error


def open_results(path: str | os.PathLike[str]) -> Any:
    """The results file ``path`` as an xarray Dataset that reads its numbers lazily. A
    file of version 1 is read at once, with the dimensions of version 2. FileError if it
    cannot be read."""
    if check_file(path) == 1:
        return to_dataset(read_results(path))
    import xarray

    try:
        return xarray.open_dataset(path, engine="h5netcdf")
    except Exception as error:  # of metadata that only xarray reads
        raise hdf5.damaged(path, reason(error)) from error


def _results(results: Results) -> Any:
    import xarray

    model = model_in(results.attrs)
    kept = kept_of(results.coords, results.more, results.variables, model.name, results.drawn)
    known = {variable.name: variable for variable in model.variables}
    lengths = {name: len(results.coords[name]) for name in results.grid}
    attrs = _attributes(root_attributes("results", results.attrs, results.more, lengths, kept.unknowns))
    layout = layout_of(lengths, attrs)
    axes = {axis.name: axis for axis in results.more}
    coordinates: dict[str, Any] = {}
    for name in coordinate_names(layout, kept):
        values = stored_coordinate(name, results.coords[name])
        scalar = name in layout.grid and name not in layout.order
        coordinates[name] = ((), values[0]) if scalar else ((name,), values)
        coordinates[name] += (coordinate_attributes(name, axes.get(name)),)
    for unknown, samples in results.drawn.items():
        coordinates[unknown.name] = (("sample",), samples, coordinate_attributes(unknown.name, unknown))
    scalar_names = [
        *(name for name in layout.grid if name not in layout.order),
        *(unknown.name for unknown in results.drawn),
    ]
    scalars = " ".join(scalar_names)
    variables = {
        name: (layout.dims(known[name]), layout.to_file(values), variable_attributes(known[name], kept.states))
        for name, values in results.variables.items()
    }
    data = xarray.Dataset(variables, coordinates, attrs)
    for name in variables:
        _encode(data[name], scalars)
    return data


def _trace(trace: Trace) -> Any:
    import xarray

    variables = {v.name: (v.dims, trace.variables[v.name], variable_attributes(v)) for v in trace_variables(trace)}
    time = {"time": ("time", trace.time, coordinate_attributes("time"))}
    data = xarray.Dataset(variables, time, _attributes(root_attributes("trace", trace.attrs)))
    for name in variables:
        _encode(data[name])
    return data


def _encode(variable: Any, scalars: str = "") -> None:
    """Set the encoding of ``variable`` as in a file of nsdrill, for writing with
    xarray."""
    if variable.dtype.kind == "f":
        variable.encoding["_FillValue"] = np.nan
    if scalars:
        variable.encoding["coordinates"] = scalars


def _attributes(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Root attributes as xarray gives them: numbers are numpy scalars or arrays."""
    converted = {}
    for name, value in stored_attributes(attrs).items():
        array = np.asarray(value)
        converted[name] = value if isinstance(value, str) else array.ravel()[0] if array.size == 1 else array
    return converted


def _from_results(data: Any, attrs: Mapping[str, Any], names: Iterable[str] | None) -> Results:
    model = model_in(attrs)
    keys = {name: coordinate.attrs.get("key") for name, coordinate in data.coords.items() if name not in POINT}
    # An unknown is a coordinate along the samples, or a scalar where one sample is
    # selected.
    unknowns = attrs["unknowns"].split() if "unknowns" in attrs else []
    unknowns = unknowns or [str(name) for name, key in keys.items() if key and data.coords[name].dims == ("sample",)]
    axis_names = attrs["axes"].split() if "axes" in attrs else [str(name) for name, key in keys.items() if key]
    axes = tuple(_axis(data, name) for name in axis_names if name not in unknowns)
    grid = (
        *POINT,
        *(axis.name for axis in axes),
        *(name for name in ("sample", "start") if name in (data.coords if name == "start" else data.dims)),
    )
    samples = {
        Unknown(**vars(_axis(data, name))): np.atleast_1d(np.asarray(data.coords[name].values, dtype=float))
        for name in unknowns
        if "sample" in data.dims
    }
    extra = [name for name in ("peak", "crossing", "state") if name in data.dims or name in data.coords]
    coords = {name: _coordinate(data, name) for name in (*grid, *extra)}
    if "state" not in data.dims:  # no variable with states was selected
        coords["state"] = np.array(_states(model, data))
    check_coordinates(_NAME, coords, model, whole=False)
    kept = kept_of(coords, axes, data.variables, model.name, samples)
    known = {variable.name: variable for variable in recorded(kept)}
    wanted = set(known) if names is None else set(names)
    if unknown := sorted(wanted - set(BY_NAME)):
        raise FileError(f"{_NAME}: no variable is called {', '.join(unknown)}.")
    variables = {
        name: _variable(data, known[name], kept, coords)
        for name in known
        if name in wanted and (name in data.data_vars or not (names is None or name in LATER_LABELS))
    }
    return Results(coords, variables, dict(attrs), axes, samples)


def _states(model: Description, data: Any) -> tuple[str, ...]:
    """The states of a string that has the variables of ``data``."""
    needed = {v.only for v in model.variables if v.name in data} & {*model.all_states}
    return next(states for states in model.state_sets if needed <= {*states})


def _axis(data: Any, name: str) -> Axis:
    attributes = dict(data.coords[name].attrs) if name in data.coords else {}
    words = [
        attributes.get(item) or ("1" if item == "units" and words_along(name) else None)
        for item in ("key", "units", "long_name")
    ]
    if not all(isinstance(word, str) and word for word in words):
        raise FileError(f"{_NAME}: the axis {name} is missing or does not say what it is. {_GIVE}")
    key, units, long_name = map(str, words)
    return Axis(key, plain_units(units), long_name)


def _coordinate(data: Any, name: str) -> Array:
    """The coordinate ``name`` as in memory [n]; one value where the dataset has a
    scalar."""
    # data.coords.get would create a counting coordinate where there is none
    if name not in data.coords or data.coords[name].dims not in ((), (name,)):
        raise FileError(f"{_NAME}: the coordinate {name} is missing or no list of values. {_GIVE}")
    values = np.atleast_1d(data.coords[name].values)
    if name in ("procedure", "state"):
        return np.array(values, dtype=str)
    if words_along(name):
        return hdf5.places_of_words(_NAME, name, np.array(values, dtype=str))
    whole = name in COUNTED
    if values.dtype.kind != ("i" if whole else "f") or not np.all(np.abs(values) <= LARGEST):
        raise FileError(f"{_NAME}: the coordinate {name} should have {'whole' if whole else 'finite'} numbers. {_GIVE}")
    return values


def _variable(data: Any, variable: Variable, kept: Kept, coords: Mapping[str, Array]) -> Array:
    """The values of ``variable`` as in memory."""
    array = data.data_vars.get(variable.name)
    if array is None:
        raise FileError(f"{_NAME}: the variable {variable.name} is missing. {_GIVE}")
    order = tuple(name for name in array.dims if name in kept.grid)
    layout = Layout(kept.grid, order)
    lacking = [name for name in kept.grid if name not in order and len(coords[name]) > 1]
    if lacking or set(array.dims) != set(layout.dims(variable)):
        wanted = (*(name for name in kept.grid if name in data.dims), *variable.dims[len(POINT) :])
        raise FileError(
            f"{_NAME}: {variable.name} has the dimensions "
            f"{', '.join(map(str, array.dims)) or 'none'}; it "
            f"should have {', '.join(wanted) or 'none'}. {_GIVE}"
        )
    kinds, kind = ("f", "real") if variable.dtype.startswith("f") else ("iu", "whole")
    if array.dtype.kind not in kinds:
        raise FileError(f"{_NAME}: {variable.name} has the type {array.dtype}; it should have {kind} numbers. {_GIVE}")
    return validated(_NAME, variable, layout.to_memory(array.transpose(*layout.dims(variable)).values))


def _from_trace(data: Any, attrs: Mapping[str, Any]) -> Trace:
    time = _coordinate(data, "time")
    if not len(time) or not np.all(np.diff(time) > 0.0):
        raise FileError(f"{_NAME}: the coordinate time does not ascend. {_GIVE}")
    variables = {}
    for variable in model_in(attrs).trace:
        array = data.data_vars.get(variable.name)
        if array is None and variable.only is not None:
            continue
        if array is None or array.shape != time.shape or array.dtype.kind != "f":
            raise FileError(
                f"{_NAME}: the variable {variable.name} is missing or has no {len(time)} real "
                f"numbers over "
                f"time. {_GIVE}"
            )
        variables[variable.name] = np.asarray(array.values)
        if np.any(np.abs(variables[variable.name]) > LARGEST):
            raise FileError(f"{_NAME}: {variable.name} has values that are no finite numbers. {_GIVE}")
    return Trace(time, variables, dict(attrs))
