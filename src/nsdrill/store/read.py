"""Results from a file, a Dataset or the run log of an unfinished run, all of them or one
point; and new labels in a file.

A file and a Dataset are read alike: both have arrays by name, with dimensions, values
and attributes.
"""

from __future__ import annotations

import os
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nsdrill.data import Array, Attributes, Results
from nsdrill.errors import FileError, printable
from nsdrill.models.description import Description
from nsdrill.models.kept import Kept
from nsdrill.models.leaves import words_along
from nsdrill.models.operation import Operation
from nsdrill.models.registry import BY_NAME, described, model_in
from nsdrill.store import hdf5
from nsdrill.store.layout import LARGEST, plain_attribute, plain_attributes, to_file, to_memory
from nsdrill.store.log import RunLog
from nsdrill.store.log_header import MAGIC
from nsdrill.store.records import pending_records, recorded
from nsdrill.store.results import block_shape, blocks, columns, coordinates, points_in_block, unknown_samples
from nsdrill.store.sink import Source, grid_shape
from nsdrill.units import plain_units
from nsdrill.variables import (
    AXES,
    COUNTED,
    FORMAT_VERSION,
    INFERRED,
    PENDING,
    POINT,
    PROCEDURES,
    Axis,
    Unknown,
    Variable,
)

if TYPE_CHECKING:
    from h5py import File


PathLike = str | os.PathLike[str]
Arrays = Mapping[str, Any]  # datasets of a file, or variables of a Dataset, by name


def read_results(path: PathLike, names: Iterable[str] | None = None) -> Results:
    """The results file ``path`` in memory, or only its variables ``names``. FileError
    if it cannot be read."""
    wanted = None if names is None else set(names)
    if unknown := sorted(name for name in wanted or () if name not in BY_NAME):
        raise FileError(f"{path}: no variable is called {', '.join(unknown)}.")
    with hdf5.opened(path, "results") as file:
        return _points(path, file).results(wanted)


def read_partial(path: PathLike, names: Iterable[str] | None = None) -> Results:
    """The points so far of the run log ``path``, or only their variables ``names``;
    also while the run is in progress. Pending points have status 0 and NaN."""
    with RunLog.open(path, writable=False) as log:
        results = collect(log, names)
    _check_axes(path, results.coords)
    return replace(results, attrs=plain_attributes(path, results.attrs))


def collect(log: Source, names: Iterable[str] | None = None) -> Results:
    """The results in a log, or only their variables ``names``, in memory, with the same
    arrays as in its results file."""
    shape = grid_shape(log.header, log.kept)
    wanted = None if names is None else set(names)
    flat = columns(log, [v.name for v in recorded(log.kept) if wanted is None or v.name in wanted])
    variables = {name: values.reshape(*shape, *values.shape[1:]) for name, values in flat.items()}
    attrs = {**log.header["attrs"], "format_version": FORMAT_VERSION}
    return Results(coordinates(log), variables, attrs, log.kept.axes, unknown_samples(log))


def variables_in(path: PathLike) -> tuple[Variable, ...]:
    """The variables of the results file or run log ``path``."""
    if kind_of(path) == "partial":
        with RunLog.open(path, writable=False) as log:
            return recorded(log.kept)
    with hdf5.opened(path, "results") as file:
        return _points(path, file).present


def read_attributes(path: PathLike) -> Attributes:
    """Root attributes of a results or trace file."""
    with hdf5.opened(path) as file:
        return plain_attributes(path, file.attrs)


def read_point(path: PathLike, *index: int) -> dict[str, Array]:
    """One point of a results file: its coordinates and every variable, as numpy scalars
    and 1-D arrays.

    The indices count procedures, depths, WOBs, rotary speeds, and starts where there
    are several, from 0; FileError if they lie outside.
    """
    with hdf5.opened(path, "results") as file:
        points = _points(path, file)
        shape, grid = points.shape, points.kept.grid
        if len(index) != len(shape) or not all(0 <= i < n for i, n in zip(index, shape, strict=True)):
            raise FileError(f"{path}: there is no point {index}; the sweep has {' x '.join(map(str, shape))} points.")
        point: dict[str, Array] = {name: points.coords[name][i] for name, i in zip(grid, index, strict=True)}
        here = tuple(slice(i, i + 1) for i in index)
        return point | {v.name: points.values(v, here)[(0,) * len(grid)] for v in points.present}


def log_from_results(path: PathLike, part: PathLike) -> RunLog:
    """Recreate the run log ``part`` from the finished file ``path``, to run its failed
    points again."""
    with hdf5.opened(path, "results") as file:
        points = _points(path, file)
        kept, shape = points.kept, points.shape
        coords = {name: points.coords[name] for name in kept.grid}
        coords |= {one.name: values for one, values in points.samples.items()}
        log = None
        try:
            log = RunLog.create(part, {"coords": coords, "attrs": points.attrs}, int(np.prod(shape)), kept)
            for place, start, stop in blocks(shape, block_shape(shape, points_in_block(kept))):
                # variables that the version of the file did not write stay NaN
                records = pending_records(stop - start, kept)
                for variable in points.present:
                    values = points.values(variable, place)
                    records[variable.name] = values.reshape(stop - start, *values.shape[len(shape) :])
                # A log holds runs only, so inferred points become pending.
                ran = np.flatnonzero((records["status"] != PENDING) & (records["status"] != INFERRED))
                log.write(start + ran, records[ran])
            log.sync()
            return log
        except BaseException:
            if log is not None:
                log.discard()
            raise


def rewrite_labels(
    path: PathLike,
    labels: Mapping[str, Array],
    history: str,
    attrs: Attributes | None = None,
    output: PathLike | None = None,
    *,
    overwrite: bool = True,
) -> None:
    """Replace the ``labels``, arrays on the grid, of the results file ``path``, and add
    the line ``history`` to its history; with ``output`` in a copy of that name.

    ``attrs`` replaces root attributes. A copy is edited and renamed at the end, so a
    kill damages nothing. ValueError for unknown labels or other shapes.
    """
    with hdf5.opened(path, "results") as file:
        points = _points(path, file)
        stored = {v.name: points.dims(v) for v in points.present if v.room == "label"}
    if unknown := sorted(set(labels) - set(stored)):
        raise ValueError(f"not labels: {', '.join(unknown)}; labels are {', '.join(stored)}")
    for name, values in labels.items():
        if np.shape(values) != points.shape:
            raise ValueError(f"{name} has shape {np.shape(values)}, the grid {points.shape}")
    old_history = str(points.attrs.get("history", ""))
    with hdf5.writing(output or path, overwrite=overwrite, copy_of=path) as file:
        for name, values in labels.items():
            file[name][...] = to_file(np.asarray(values, file[name].dtype), points.kept.grid, stored[name])
        # HDF5 does not reuse the space of replaced text, so unchanged attributes
        # are not written.
        changed = {name: value for name, value in (attrs or {}).items() if points.attrs.get(name) != value}
        hdf5.put_attributes(file, {**changed, "history": f"{old_history}\n{history}" if old_history else history})


def kind_of(path: PathLike) -> Literal["results", "trace", "partial", "branches"]:
    """The kind of the file ``path``; ``partial`` is the run log of an unfinished run.
    FileError if it is not a file of nsdrill."""
    try:
        if os.path.isfile(path):  # opening a pipe would block
            with open(path, "rb") as file:
                if file.read(len(MAGIC)) == MAGIC:
                    return "partial"
    except (OSError, ValueError):
        pass  # reported by hdf5.opened below
    with hdf5.opened(path) as file:
        kind = plain_attribute(file.attrs, "nsdrill_kind")
    for known in ("results", "trace", "branches"):
        if kind == known:
            return known
    raise hdf5.damaged(path, f"its kind is {kind!r}")


def dims_of(array: Any) -> tuple[str, ...]:
    """The dimensions of a dataset of a file, as its scales name them, or of a variable of
    a Dataset."""
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


def real_values(where: PathLike, array: Any, name: str, remedy: str) -> Array:
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
    kept: Kept
    samples: dict[Unknown, Array]
    remedy: str

    @classmethod
    def of(cls, where: PathLike, arrays: Arrays, attrs: Attributes, remedy: str, *, whole: bool) -> Points:
        """The points in ``arrays``; FileError where their coordinates are invalid. Not
        ``whole`` are those of a selection."""
        model = model_in(attrs)
        keys = {name: plain_attribute(array.attrs, "key") for name, array in arrays.items() if name not in POINT}
        # An unknown is a coordinate along the samples, or a scalar where one sample is
        # selected. Arithmetic with xarray drops the attributes that name axes and unknowns.
        unknowns = attrs["unknowns"].split() if "unknowns" in attrs else []
        unknowns = unknowns or [name for name, key in keys.items() if key and dims_of(arrays[name]) == ("sample",)]
        axis_names = attrs["axes"].split() if "axes" in attrs else [name for name, key in keys.items() if key]
        axes = tuple(_axis(where, arrays, name, remedy) for name in axis_names if name not in unknowns)
        has_samples = "sample" in arrays and dims_of(arrays["sample"]) == ("sample",)
        several = ("sample",) * has_samples + ("start",) * ("start" in arrays)
        own = [name for name in ("peak", "crossing", "state") if name in arrays]
        coords = {
            name: np.atleast_1d(coordinate(where, arrays, name, remedy))
            for name in (*POINT, *(axis.name for axis in axes), *several, *own)
        }
        if "state" not in coords:  # no variable with states was selected
            coords["state"] = np.array(_states(model, arrays))
        check_coordinates(where, coords, model, remedy, whole=whole)
        samples = {}
        for name in unknowns if has_samples else ():
            values = np.asarray(arrays[name][()], dtype=float)
            if values.shape != coords["sample"].shape:
                raise FileError(f"{where}: {name} has {values.size} values, and not one of each sample. {remedy}")
            samples[Unknown(**vars(_axis(where, arrays, name, remedy)))] = values
        kept = kept_of(coords, axes, arrays, model.name, samples)
        return cls(where, arrays, attrs, coords, kept, samples, remedy)

    @property
    def shape(self) -> tuple[int, ...]:
        """The lengths of the dimensions of the grid in memory."""
        return tuple(len(self.coords[name]) for name in self.kept.grid)

    @property
    def present(self) -> tuple[Variable, ...]:
        """The variables that are there. Others are unknown to the version that wrote
        them, or were not selected."""
        return tuple(variable for variable in recorded(self.kept) if variable.name in self.arrays)

    def results(self, names: Container[str] | None = None) -> Results:
        """The results in memory, or only their variables ``names``."""
        variables = {v.name: self.values(v) for v in self.present if names is None or v.name in names}
        return Results(self.coords, variables, self.attrs, self.kept.axes, self.samples)

    def dims(self, variable: Variable) -> tuple[str, ...]:
        """The dimensions of ``variable``, in their order there; FileError where they, its
        shape or its type are wrong."""
        array = self.arrays[variable.name]
        dims, own = dims_of(array), variable.dims[len(POINT) :]
        varying = [name for name in self.kept.grid if len(self.coords[name]) > 1]
        allowed = {*self.kept.grid, *own}
        lengths = tuple(len(self.coords.get(name, ())) if name in self.arrays else 0 for name in dims)
        if not {*varying, *own} <= set(dims) <= allowed or array.shape != lengths:
            found = ", ".join(f"{name} ({length})" for name, length in zip(dims, array.shape, strict=True)) or "none"
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
        at = dict(zip(self.kept.grid, place or (), strict=False))
        index = tuple(at.get(name, slice(None)) for name in dims)
        values = to_memory(np.asarray(self.arrays[variable.name][index]), dims, self.kept.grid)
        known = range(sum(variable.flag_masks) + 1) if variable.flag_masks else variable.flag_values
        if known and values.size and not (values.min() >= known[0] and values.max() <= known[-1]):
            raise FileError(f"{self.where}: {variable.name} has values that mean nothing. {self.remedy}")
        return np.asarray(values, variable.dtype)


def _points(path: PathLike, file: File) -> Points:
    return Points.of(path, hdf5.arrays_in(file), plain_attributes(path, file.attrs), hdf5.EDITED, whole=True)


def _states(model: Description, arrays: Arrays) -> tuple[str, ...]:
    """The states of a string that has the variables of ``arrays``."""
    needed = {v.only for v in model.variables if v.name in arrays} & {*model.all_states}
    return next(states for states in model.state_sets if needed <= {*states})


def _axis(where: PathLike, arrays: Arrays, name: str, remedy: str) -> Axis:
    attrs = arrays[name].attrs if name in arrays else {}
    words = [plain_attribute(attrs, item) for item in ("key", "units", "long_name")]
    words[1] = words[1] or ("1" if words_along(name) else None)
    if not all(isinstance(word, str) and word for word in words):
        raise FileError(f"{where}: the axis {name} is missing or does not say what it is. {remedy}")
    key, units, long_name = words
    return Axis(key, plain_units(units), long_name)


def kept_of(
    coords: Mapping[str, Array],
    axes: tuple[Axis, ...],
    names: Container[str],
    model: str,
    unknowns: Iterable[Unknown] = (),
) -> Kept:
    """What results keep of each point: those of the ``model`` of this name, with these
    ``coords``, further ``axes``, ``names`` of variables and ``unknowns``."""
    starts, peaks, returns = (len(coords.get(name, ())) for name in ("start", "peak", "crossing"))
    states = tuple(coords["state"].tolist())
    description = described(model)
    optional = (v for v in (*description.features, *description.derived) if v.only and v.only not in states)
    options = dict.fromkeys(v.only for v in optional if v.only and v.name in names)
    return Kept(
        peaks,
        returns,
        exponent="lyapunov_exponent" in names,
        starts=starts,
        verify="trusted" in names,
        axes=axes,
        states=states,
        model=model,
        options=tuple(options),
        samples=len(coords.get("sample", ())),
        unknowns=tuple(unknowns),
        method="method" in names,
    )


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
    _check_axes(where, coords)
    for name in COUNTED:
        values = coords.get(name)
        if values is not None and (not len(values) or not np.array_equal(values, np.arange(len(values)))):
            raise FileError(f"{where}: the coordinate {name} does not count from 0. {remedy}")


def _check_axes(where: PathLike, coords: Mapping[str, Array]) -> None:
    """FileError unless the values of every axis ascend within the range of its
    quantity."""
    for name in AXES:
        values = coords[name]
        try:
            if not len(values) or not np.all(np.diff(values) > 0.0):
                raise ValueError(f"{name}: found values that do not ascend")
            for end in (values[0], values[-1]):
                Operation(**{name: float(end)})
        except ValueError as error:
            raise FileError(f"{where}: the coordinate {error}. {hdf5.EDITED}") from error
