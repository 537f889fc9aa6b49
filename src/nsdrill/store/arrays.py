"""Results and traces from arrays by name, with dimensions, values and attributes: the
datasets of a file or the variables of a Dataset, which are read and checked alike."""

from __future__ import annotations

import math
import os
from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import h5py
import numpy as np
from numpy.typing import ArrayLike

from nsdrill.analysis.counts import AFTER_FAILURE
from nsdrill.data import Array, Attributes, Results, Trace, resolved_study
from nsdrill.errors import FileError, count, printable
from nsdrill.models.choices import words_along
from nsdrill.models.contents import Contents
from nsdrill.models.model_description import Description
from nsdrill.models.operation import Operation
from nsdrill.models.registry import model_in, own_features
from nsdrill.records import dataclass
from nsdrill.store.hdf5 import EDITED
from nsdrill.store.layout import LARGEST, check_measured, check_words, plain_attribute, to_memory
from nsdrill.store.points import contents_of
from nsdrill.units import plain_units
from nsdrill.variables import (
    AXES,
    COUNTED,
    POINT,
    PROCEDURES,
    Axis,
    Unknown,
    Variable,
    dimension_of,
    long_key,
    short_key,
)

PathLike = str | os.PathLike[str]


class StoredArray(Protocol):
    """What is asked of a dataset of a file and of a variable of a Dataset."""

    name: str | None
    attrs: Attributes
    dims: Sequence[Any]  # names, or the scales of a file
    dtype: np.dtype
    shape: tuple[int, ...] | None  # None of an empty dataset

    def __getitem__(self, key: object) -> ArrayLike: ...


Arrays = Mapping[str, StoredArray]
MANY = 10**6  # values of a coordinate that are read only where a variable has as many
SCALES = "DIMENSION_LIST"  # the attribute of a dataset that refers to its scales


def dims_of(array: StoredArray) -> tuple[str, ...]:
    """The dimensions of a dataset of a file, as its scales name them, or of a variable of
    a Dataset. ValueError where no scales are named in their place: HDF5 would follow
    whatever is there, and end the process."""
    if isinstance(array, h5py.Dataset) and SCALES in array.attrs:
        kind = h5py.check_vlen_dtype(array.attrs.get_id(SCALES).dtype)
        if kind is None or h5py.check_ref_dtype(kind) is None:
            raise ValueError(f"{array.name} names no dimensions")
    return tuple(
        # A scale whose link was removed has no name.
        dim if isinstance(dim, str) else ((dim[0] if len(dim) else array).name or "").removeprefix("/")
        for dim in array.dims
    )


def coordinate(where: PathLike, arrays: Arrays, name: str, remedy: str) -> Array:
    """The coordinate ``name``: array of float, int or str [n]; 0-D where it does not
    vary. The words of a choice become their places in the list of all its words."""
    array, choices = arrays.get(name), words_along(name)
    if array is None or array.shape is None or dims_of(array) not in ((), (name,)):
        raise FileError(f"{where}: the coordinate {name} is missing or no list of values. {remedy}")
    size = math.prod(array.shape)
    if size > MANY and not any(size in (one.shape or ()) for other, one in arrays.items() if other != name):
        raise FileError(f"{where}: the coordinate {name} has {count(size, 'value')}, and no variable as many. {remedy}")
    values = np.asarray(array[()])
    if name in ("procedure", "state") or choices:
        words = np.array([_text(value) for value in values.ravel()], dtype=str).reshape(values.shape)
        return _places_of_words(where, name, words) if choices else words
    whole = name in COUNTED
    if values.dtype.kind != ("i" if whole else "f") or not np.all(np.abs(values) <= LARGEST):
        raise FileError(
            f"{where}: the coordinate {name} should have {'whole' if whole else 'finite'} numbers. {remedy}"
        )
    return values


def _of_grid(
    where: PathLike, arrays: Arrays, attrs: Attributes, name: str, unknowns: Container[str], remedy: str
) -> Array:
    """The values [n] of a coordinate in memory. An operating value of which every sample
    has its own, so that a file has none, is that of the study, or of the one sample that
    is selected."""
    uncertain = dimension_of(long_key(name))
    if uncertain != name and uncertain in unknowns and uncertain in arrays:
        if dims_of(arrays[uncertain]) == ():
            return np.array([arrays[uncertain][()]], dtype=float)
        given = resolved_study(attrs).get("operation", {}).get(name)
        return np.array([given if isinstance(given, float) else np.asarray(arrays[uncertain][()]).flat[0]])
    return np.atleast_1d(coordinate(where, arrays, name, remedy))


def real_values(where: PathLike, array: StoredArray, name: str, remedy: str) -> Array:
    """The values of a variable of a trace; FileError unless they are finite or NaN."""
    values = np.asarray(array[()])
    if values.dtype.kind != "f" or np.any(np.abs(values) > LARGEST):
        raise FileError(f"{where}: {name} has values that are no finite numbers. {remedy}")
    return values


def _text(value: object) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _places_of_words(where: PathLike, name: str, words: Array) -> Array:
    choices = words_along(name)
    if unknown := sorted(set(words.ravel().tolist()) - {*choices}):
        raise FileError(
            f"{where}: {name} is {printable(str(unknown[0]))[:40]!r}; it should be of {', '.join(choices)}."
        )
    return np.vectorize(choices.index, otypes=[float])(words)


@dataclass(frozen=True)
class Points:
    """The points of the results in ``arrays``, which ``where`` names in messages, and
    what is kept of each. ``coords`` are as in memory, ``samples`` [samples] those of each
    unknown; ``attrs`` are plain. ``remedy`` ends messages."""

    where: PathLike
    arrays: Arrays
    attrs: Attributes
    coords: dict[str, Array]
    contents: Contents
    samples: dict[Unknown, Array]
    remedy: str

    @classmethod
    def of(cls, where: PathLike, arrays: Arrays, attrs: Attributes, remedy: str, *, whole: bool) -> Points:
        """The points in ``arrays``; FileError where their coordinates are invalid. Not
        ``whole`` are those of a selection."""
        model = model_in(attrs)
        check_words(where, arrays, measured_variables(model))
        check_measured(where, model.name, attrs)
        keys = {name: plain_attribute(array.attrs, "key") for name, array in arrays.items() if name not in POINT}
        # An unknown is a coordinate along the samples, or a scalar where one sample is
        # selected. Arithmetic with xarray drops the attributes that name axes and unknowns.
        unknowns = attrs["unknowns"].split() if "unknowns" in attrs else []
        unknowns = unknowns or [name for name, key in keys.items() if key and dims_of(arrays[name]) == ("sample",)]
        axis_names = attrs["axes"].split() if "axes" in attrs else [name for name, key in keys.items() if key]
        found = (_axis(where, arrays, name, remedy) for name in axis_names if name not in unknowns)
        axes = tuple(replace(axis, key=short_key(axis.key)) for axis in found)
        has_samples = "sample" in arrays and dims_of(arrays["sample"]) == ("sample",)
        several = ("sample",) * has_samples + ("start",) * ("start" in arrays)
        own = [name for name in ("peak", "crossing", "state") if name in arrays]
        names = ("procedure", *model.axes, *(axis.name for axis in axes), *several, *own)
        coords = {name: _of_grid(where, arrays, attrs, name, unknowns, remedy) for name in names}
        if "state" not in coords:  # no variable with states was selected
            coords["state"] = np.array(_states(model, arrays))
        check_coordinates(where, coords, model, remedy, whole=whole)
        samples = {}
        for name in unknowns if has_samples else ():
            shape = arrays[name].shape or ()
            if shape != coords["sample"].shape:
                raise FileError(
                    f"{where}: {name} has {count(math.prod(shape), 'value')}, and not one of each sample. {remedy}"
                )
            values = np.asarray(arrays[name][()], dtype=float)
            samples[Unknown(**vars(_axis(where, arrays, name, remedy)))] = values
        contents = contents_of(coords, axes, arrays, model, samples)
        return cls(where, arrays, attrs, coords, contents, samples, remedy)

    @property
    def shape(self) -> tuple[int, ...]:
        """The lengths of the dimensions of the grid in memory."""
        return tuple(len(self.coords[name]) for name in self.contents.grid)

    @property
    def present(self) -> tuple[Variable, ...]:
        """The variables that are there; others were not selected."""
        return tuple(variable for variable in self.contents.variables if variable.name in self.arrays)

    def results(self, names: Container[str] | None = None) -> Results:
        """The results in memory, or only their variables ``names``."""
        variables = {v.name: self.values(v) for v in self.present if names is None or v.name in names}
        if "status" in variables and AFTER_FAILURE.name in self.arrays:
            variables[AFTER_FAILURE.name] = self.values(AFTER_FAILURE)
        return Results(self.coords, variables, self.attrs, self.contents.axes, self.samples)

    def dims(self, variable: Variable) -> tuple[str, ...]:
        """The dimensions of ``variable``, in their order there; FileError where they, its
        shape or its type are wrong."""
        array = self.arrays[variable.name]
        dims, own = dims_of(array), variable.dims[len(POINT) :]
        varying = [name for name in self.contents.grid if len(self.coords[name]) > 1]
        allowed = {*self.contents.grid, *own}
        lengths = tuple(len(self.coords.get(name, ())) if name in self.arrays else 0 for name in dims)
        if not {*varying, *own} <= set(dims) <= allowed or array.shape != lengths:
            found = (
                ", ".join(f"{name} ({length})" for name, length in zip(dims, array.shape or (), strict=True)) or "none"
            )
            wanted = ", ".join(f"{name} ({len(self.coords.get(name, ()))})" for name in (*varying, *own)) or "none"
            raise FileError(
                f"{self.where}: {variable.name} has the dimensions {found}; it should have {wanted}. {self.remedy}"
            )
        kinds, kind = ("f", "real") if variable.dtype.startswith("f") else ("iu", "whole")
        if array.dtype.kind not in kinds:
            raise FileError(
                f"{self.where}: {variable.name} has the type {array.dtype}; it should have {kind} numbers. "
                f"{self.remedy}"
            )
        return dims

    def values(self, variable: Variable, place: tuple[slice, ...] | None = None) -> Array:
        """The values of ``variable`` as in memory, or only those at this ``place`` of the
        grid; FileError where a flag has an undefined value."""
        dims = self.dims(variable)
        at = dict(zip(self.contents.grid, place or (), strict=False))
        index = tuple(at.get(name, slice(None)) for name in dims)
        values = to_memory(np.asarray(self.arrays[variable.name][index]), dims, self.contents.grid)
        known = range(sum(variable.flag_masks) + 1) if variable.flag_masks else variable.flag_values
        if known and values.size and not (values.min() >= known[0] and values.max() <= known[-1]):
            raise FileError(f"{self.where}: {variable.name} has values that mean nothing. {self.remedy}")
        values = np.asarray(values, variable.dtype)
        return self._status(variable.name, values, place) if variable.name.endswith("status") else values

    def _status(self, name: str, status: Array, place: tuple[slice, ...] | None) -> Array:
        """The ``status`` of runs, or of one of their checks, by the features that are
        there: what has no number is not known, also in a file that was edited."""
        model, prefix = model_in(self.attrs), name.removesuffix("status")
        names = {prefix + feature for feature in model.status_features}
        features = {v.name: self.values(v, place) for v in self.present if v.name in names}
        return model.status_of(status, features, prefix)


def _states(model: Description, arrays: Arrays) -> tuple[str, ...]:
    """The states of a string that has the variables of ``arrays``."""
    needed = {v.only for v in model.variables if v.name in arrays} & {*model.all_states}
    return next(states for states in model.state_sets if needed <= {*states})


def _axis(where: PathLike, arrays: Arrays, name: str, remedy: str) -> Axis:
    if name not in arrays and (uncertain := dimension_of(long_key(name))) in arrays:
        return replace(_axis(where, arrays, uncertain, remedy), key=name)  # each sample has its own value
    attrs = arrays[name].attrs if name in arrays else {}
    key, units, long_name = (plain_attribute(attrs, item) for item in ("key", "units", "long_name"))
    match key, units or ("1" if words_along(name) else None), long_name:
        case str(of), str(unit), str(words) if of and unit and words:
            return Axis(of, plain_units(unit), words)
    raise FileError(f"{where}: the axis {name} is missing or does not say what it is. {remedy}")


def check_coordinates(
    where: PathLike, coords: Mapping[str, Array], model: Description, remedy: str, *, whole: bool
) -> None:
    """FileError unless the coordinates, as in memory, are those that nsdrill writes for
    this model, or, if not ``whole``, a part of them."""
    procedures, states = coords["procedure"].tolist(), coords["state"].tolist()
    if not procedures or len(set(procedures)) < len(procedures) or not set(procedures) <= set(PROCEDURES):
        found = ", ".join(map(str, procedures))
        raise FileError(f"{where}: the procedures are {found}; they should be of {', '.join(PROCEDURES)}.")
    if not model.may_have(tuple(states)):
        found = ", ".join(map(str, states))
        raise FileError(f"{where}: the states are {found}; they should be {', '.join(model.state_sets[0])}.")
    if not whole:
        return
    check_axes(where, coords)
    for name in COUNTED:
        values = coords.get(name)
        if values is not None and (not len(values) or not np.array_equal(values, np.arange(len(values)))):
            raise FileError(f"{where}: the coordinate {name} does not count from 0. {remedy}")


def check_axes(where: PathLike, coords: Mapping[str, Array]) -> None:
    """FileError unless the values of every axis ascend within the range of its
    quantity."""
    for name in (name for name in AXES if name in coords):
        values = coords[name]
        try:
            if not len(values) or not np.all(np.diff(values) > 0.0):
                raise ValueError(f"{name}: found values that do not ascend")
            for end in (values[0], values[-1]):
                Operation(**{name: float(end)})
        except ValueError as error:
            raise FileError(f"{where}: the coordinate {error}. {EDITED}") from error


def measured_variables(model: Description) -> list[Variable]:
    """What scripts measure of a model, in results and in traces."""
    names = {name for one in own_features(model.name) for name in (one.name, *one.features)}
    return [variable for variable in (*model.variables, *model.own_trace) if variable.name in names]


def trace_variables(trace: Trace) -> tuple[Variable, ...]:
    """The variables of a trace, in the order of files: all of its model, without the
    optional ones that ``trace`` lacks."""
    return tuple(v for v in model_in(trace.attrs).trace if v.only is None or v.name in trace.variables)


def trace_in(where: PathLike, arrays: Arrays, attrs: Attributes, remedy: str) -> Trace:
    """The trace in the ``arrays`` of a file or a Dataset, which ``where`` names in
    messages; ``remedy`` ends them."""
    time = coordinate(where, arrays, "time", remedy)
    if time.ndim != 1 or not len(time) or not np.all(np.diff(time) > 0.0):
        raise FileError(f"{where}: the coordinate time does not ascend. {remedy}")
    check_words(where, arrays, measured_variables(model_in(attrs)))
    check_measured(where, model_in(attrs).name, attrs)
    variables = {}
    for variable in model_in(attrs).trace:
        name = variable.name
        if name not in arrays and variable.only is not None:
            continue
        if name not in arrays or arrays[name].shape != time.shape:
            raise FileError(
                f"{where}: the variable {name} is missing or has no {len(time)} real numbers over time. {remedy}"
            )
        variables[name] = real_values(where, arrays[name], name, remedy)
    return Trace(time, variables, attrs)
