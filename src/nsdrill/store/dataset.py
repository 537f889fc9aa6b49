"""Results and traces as xarray Datasets, and back: what Python users hold in their hands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.data import Array, Results, Trace, json_text
from nsdrill.errors import InputError
from nsdrill.store.results import root_attributes
from nsdrill.units import CF, plain_units
from nsdrill.variables import AXES, BY_NAME, COORDINATES, POINT, STATE_UNITS, TRACE_VARIABLES, Axis, Variable

if TYPE_CHECKING:
    from xarray import Dataset

OWN = ("peak", "crossing", "state")  # dimensions of single variables


def to_dataset(data: Results | Trace) -> Dataset:
    """``data`` as a Dataset with the variables, coordinates and attributes of its file."""
    from xarray import Dataset

    if isinstance(data, Trace):
        found = {v.name: ("time", data[v.name], _described(v)) for v in TRACE_VARIABLES if v.name in data.variables}
        return Dataset(found, {"time": ("time", data.time, _units("time"))}, _plain("trace", data.attrs))
    axes = {axis.name: axis for axis in data.more}
    coords = {name: (name, values, _units(name, axes.get(name))) for name, values in data.coords.items()}
    variables = {
        name: ((*data.grid, *BY_NAME[name].dims[len(POINT):]), values, _described(BY_NAME[name]))
        for name, values in data.variables.items()
    }
    attrs = {**data.attrs, "axes": " ".join(axes) or None}
    return Dataset(variables, coords, _plain("results", attrs))


def from_dataset(data: Dataset) -> Results | Trace:
    """What :func:`to_dataset` was given; also of a part of it, whose values of one axis or variables were selected.

    InputError where the Dataset is not one of nsdrill's, or lacks a coordinate.
    """
    attrs = {name: value.item() if isinstance(value, np.generic) else value for name, value in data.attrs.items()}
    if "time" in data.dims:
        if lacking := [v.name for v in TRACE_VARIABLES if v.name not in data]:
            raise InputError(f"the Dataset: found a trace without {', '.join(lacking)}; allowed: all of its variables.")
        names = [v.name for v in TRACE_VARIABLES]
        return Trace(np.asarray(data["time"].values, float), {n: _values(data, n, ("time",)) for n in names}, attrs)
    further = str(attrs.get("axes") or "").split()
    if lacking := [name for name in (*POINT, *further) if name not in data.coords]:
        raise InputError(
            f"the Dataset: found no coordinate {', '.join(lacking)}; allowed: a Dataset as nsdrill.run, simulate, "
            "replay or open_results give it. Select without drop=True.")
    grid = (*POINT, *further, *(("start",) if "start" in data.dims else ()))
    coords = {name: np.atleast_1d(data.coords[name].values) for name in grid}
    coords |= {name: data.coords[name].values for name in OWN if name in data.dims and name in data.coords}
    for name in ("procedure", "state"):
        if name in coords:
            coords[name] = coords[name].astype(str)
    variables = {
        str(name): _values(data, str(name), (*grid, *BY_NAME[str(name)].dims[len(POINT):]), BY_NAME[str(name)].dtype)
        for name in data.data_vars if name in BY_NAME and all(d in coords for d in BY_NAME[str(name)].dims)
    }
    return Results(coords, variables, attrs, tuple(_axis(data, name) for name in further))


def _values(data: Dataset, name: str, dims: tuple[str, ...], dtype: str = "f8") -> Array:
    array = data[name]
    for dim in dims:
        if dim not in array.dims:
            array = array.expand_dims(dim)
    if extra := [str(dim) for dim in array.dims if dim not in dims]:
        raise InputError(f"the Dataset: found {name} over {', '.join(extra)}; allowed: over {', '.join(dims)}.")
    return np.ascontiguousarray(array.transpose(*dims).values, dtype)


def _axis(data: Dataset, name: str) -> Axis:
    told = data.coords[name].attrs
    return Axis(str(told.get("key")), plain_units(str(told.get("units"))), str(told.get("long_name", "")))


def _units(name: str, axis: Axis | None = None) -> dict[str, Any]:
    units, long_name = (CF[axis.units], axis.long_name) if axis else COORDINATES[name]
    told = {"long_name": long_name, **({"key": axis.key} if axis else {"key": name} if name in AXES else {})}
    return told if name in ("procedure", "state") else {**told, "units": units}


def _described(variable: Variable) -> dict[str, Any]:
    kind = np.dtype(variable.dtype)
    told: dict[str, Any] = {"long_name": variable.long_name}
    told |= {"units": variable.units} if variable.units else {"state_units": ", ".join(STATE_UNITS)}
    for name in ("flag_values", "flag_masks"):
        if (flags := getattr(variable, name)) is not None:
            told[name] = np.array(flags, kind)
    return told | ({"flag_meanings": variable.flag_meanings} if variable.flag_meanings else {})


def _plain(kind: str, attrs: dict[str, Any]) -> dict[str, Any]:
    """Root attributes as a file has them."""
    found = {}
    for name, value in root_attributes(kind, attrs).items():
        if value is None:
            continue
        plain = isinstance(value, str | int | float | np.number | np.ndarray)
        found[name] = np.int8(value) if isinstance(value, bool | np.bool_) else value if plain else json_text(value)
    return found
