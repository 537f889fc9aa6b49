"""Reading results back: all of them, one point, or what an unfinished run has so far; and giving them new labels."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import replace
from importlib.util import find_spec
from typing import Any, Literal

import numpy as np

from nsdrill.data import Array, Results
from nsdrill.errors import FileError
from nsdrill.files import reason, replacing
from nsdrill.model.parameters import Operation
from nsdrill.store import hdf5
from nsdrill.store.attributes import check_attributes, get_attributes
from nsdrill.store.log import RunLog
from nsdrill.store.log_header import MAGIC
from nsdrill.store.records import pending_records, recorded
from nsdrill.store.results import block_shape, blocks, columns, coordinates, points_in_block
from nsdrill.store.sink import Source, grid_shape
from nsdrill.variables import (
    AXES,
    BY_NAME,
    FORMAT_VERSION,
    INFERRED,
    PENDING,
    POINT,
    PROCEDURES,
    STATE_NAMES,
    VARIABLES,
    Kept,
    Variable,
)  # fmt: skip

PathLike = str | os.PathLike[str]
LATER = ("bounce_severity", "whirl_severity")  # labels that the first files did not have yet


def read_results(path: PathLike, names: Iterable[str] | None = None) -> Results:
    """The results file ``path`` in memory, or only its variables ``names``. FileError if it cannot be read."""
    wanted = None if names is None else set(names)
    if wanted is not None and not wanted <= set(BY_NAME):
        raise FileError(f"{path}: no variable is called {', '.join(sorted(wanted - set(BY_NAME)))}.")
    with hdf5.opened(path) as file:
        coords, kept = _coordinates(path, file)
        variables = {
            variable.name: _checked(path, variable, _dataset(path, file, variable, kept)[()])
            for variable in _present(file, kept)
            if wanted is None or variable.name in wanted
        }
        return Results(coords, variables, get_attributes(path, file), kept.axes)


def read_partial(path: PathLike, names: Iterable[str] | None = None) -> Results:
    """What the run log ``path`` holds so far, or only its variables ``names``; also while the run goes on. Pending
    points have status 0 and NaN."""
    with RunLog.open(path, writable=False) as log:
        found = collect(log, names)
    _check_axes(path, found.coords)
    return replace(found, attrs=check_attributes(path, found.attrs))


def collect(log: Source, names: Iterable[str] | None = None) -> Results:
    """Everything in a log, or only the variables ``names``, in memory; the same arrays as in its results file."""
    shape = grid_shape(log.header, log.kept)
    wanted = set(BY_NAME) if names is None else set(names)
    flat = columns(log, [v.name for v in recorded(log.kept) if v.name in wanted])
    variables = {name: values.reshape(*shape, *values.shape[1:]) for name, values in flat.items()}
    attrs = {**log.header["attrs"], "format_version": FORMAT_VERSION}
    return Results(coordinates(log), variables, attrs, log.kept.axes)


def variables_in(path: PathLike) -> tuple[Variable, ...]:
    """The variables of the results file or run log ``path``."""
    if kind_of(path) == "partial":
        with RunLog.open(path, writable=False) as log:
            return recorded(log.kept)
    with hdf5.opened(path) as file:
        return _present(file, _coordinates(path, file)[1])


def read_attributes(path: PathLike) -> dict[str, Any]:
    """Root attributes of a results or trace file."""
    with hdf5.opened(path) as file:
        return get_attributes(path, file)


def read_point(path: PathLike, *index: int) -> dict[str, Any]:
    """One point of a results file: its coordinates and every variable, as numpy scalars and 1-D arrays.

    The indices count procedures, depths, WOBs, rotary speeds, and starts where there are several, from 0; FileError if
    they lie outside.
    """
    with hdf5.opened(path) as file:
        coords, kept = _coordinates(path, file)
        shape = tuple(len(coords[name]) for name in kept.grid)
        if len(index) != len(shape) or not all(0 <= i < n for i, n in zip(index, shape, strict=True)):
            raise FileError(f"{path}: there is no point {index}; the sweep has {' x '.join(map(str, shape))} points.")
        point: dict[str, Any] = {name: coords[name][i] for name, i in zip(kept.grid, index, strict=True)}
        for variable in _present(file, kept):
            point[variable.name] = _checked(path, variable, _dataset(path, file, variable, kept)[index])[()]
        return point


def log_from_results(path: PathLike, part: PathLike) -> RunLog:
    """Make the run log ``part`` again from the finished file ``path``, to run its failed points once more."""
    with hdf5.opened(path) as file:
        coords, kept = _coordinates(path, file)
        shape = tuple(len(coords[name]) for name in kept.grid)
        datasets = {v.name: _dataset(path, file, v, kept) for v in recorded(kept)}
        header = {"coords": {name: coords[name] for name in kept.grid}, "attrs": get_attributes(path, file)}
        log = None
        try:
            log = RunLog.create(part, header, int(np.prod(shape)), kept)
            for place, start, stop in blocks(shape, block_shape(shape, points_in_block(kept))):
                records = pending_records(stop - start, kept)
                for name, dataset in datasets.items():
                    values = dataset[place]
                    records[name] = values.reshape(stop - start, *values.shape[len(shape):])
                # What was inferred did not run, and a log holds runs only.
                ran = np.flatnonzero((records["status"] != PENDING) & (records["status"] != INFERRED))
                log.write(start + ran, records[ran])
            log.sync()
            return log
        except BaseException:
            if log is not None:
                log.discard()
            raise


def rewrite_labels(
    path: PathLike, labels: Mapping[str, Array], history: str, attrs: Mapping[str, Any] | None = None
) -> None:
    """Give the results file ``path`` new ``labels``, arrays on the grid, and add the line ``history`` to its history.

    ``attrs`` replaces root attributes. A copy is edited and takes the name at the end, so a kill damages nothing.
    """
    known_labels = [variable.name for variable in VARIABLES if variable.room == "label"]
    unknown = set(labels) - set(known_labels)
    if unknown:
        raise ValueError(f"not labels: {', '.join(sorted(unknown))}; labels are {', '.join(known_labels)}")
    with hdf5.opened(path) as file:
        _, kept = _coordinates(path, file)
        shapes = {name: _dataset(path, file, BY_NAME[name], kept).shape for name in labels}
        known = get_attributes(path, file)
        old = str(known.get("history", ""))
    for name, values in labels.items():
        if np.shape(values) != shapes[name]:
            raise ValueError(f"{name} has shape {np.shape(values)}, the grid {shapes[name]}")
    with replacing(path) as temporary:
        shutil.copyfile(path, temporary)
        shutil.copymode(path, temporary)
        hdf5.unseal(temporary)
        with hdf5.writing(temporary, edit=True) as file:
            for name, values in labels.items():
                file[name][...] = np.asarray(values, file[name].dtype)
            # HDF5 does not use the place of replaced text again, so what stays the same is left alone.
            changed = {name: value for name, value in (attrs or {}).items() if not _same(known.get(name), value)}
            hdf5.put_attributes(file, {**changed, "history": f"{old}\n{history}" if old else history})
        hdf5.seal(temporary)


def open_results(path: PathLike) -> Any:
    """The results file ``path`` as an xarray Dataset, lazy, where xarray and h5netcdf are installed; else Results."""
    if find_spec("xarray") is None or find_spec("h5netcdf") is None:
        return read_results(path)
    import xarray

    with hdf5.opened(path) as file:
        _coordinates(path, file)
    try:
        return xarray.open_dataset(path, engine="h5netcdf")
    except Exception as error:  # of a file that is ours but for what xarray alone reads of it
        raise hdf5.damaged(path, reason(error)) from error


def kind_of(path: PathLike) -> Literal["results", "trace", "partial"]:
    """What the file ``path`` is; ``partial`` is the run log of an unfinished run. FileError if it is none of ours."""
    try:
        if os.path.isfile(path):  # a pipe would be waited for
            with open(path, "rb") as file:
                if file.read(len(MAGIC)) == MAGIC:
                    return "partial"
    except (OSError, ValueError):
        pass  # said better below
    with hdf5.opened(path) as file:
        kind = file.attrs["nsdrill_kind"]
    if kind not in ("results", "trace"):
        raise hdf5.damaged(path, f"it says that it is {kind!r}")
    return "results" if kind == "results" else "trace"


def _same(old: Any, new: Any) -> bool:
    return isinstance(new, str | int | float) and type(old) is type(new) and bool(old == new)


def _coordinates(path: PathLike, file: Any) -> tuple[dict[str, Array], Kept]:
    """Coordinates of an open results file, and what it keeps of each point."""
    if file.attrs["nsdrill_kind"] != "results":
        raise FileError(f"{path}: this is a {file.attrs['nsdrill_kind']} file; a results file is needed here.")
    coords = {name: hdf5.read_coordinate(path, file, name) for name in (*POINT, "state")}
    procedures = coords["procedure"].tolist()
    if not procedures or len(set(procedures)) < len(procedures) or not set(procedures) <= set(PROCEDURES):
        found = ", ".join(map(str, coords["procedure"]))
        raise FileError(f"{path}: the procedures are {found}; they should be of {', '.join(PROCEDURES)}.")
    if tuple(coords["state"]) != STATE_NAMES:
        found = ", ".join(map(str, coords["state"]))
        raise FileError(f"{path}: the states are {found}; they should be {', '.join(STATE_NAMES)}.")
    _check_axes(path, coords)
    axes = hdf5.read_axes(path, file)
    for name in ("start", "peak", "crossing"):
        if name in file:
            coords[name] = hdf5.read_coordinate(path, file, name)
            if not len(coords[name]) or not np.array_equal(coords[name], np.arange(len(coords[name]))):
                raise FileError(f"{path}: the coordinate {name} does not count from 0. {hdf5.EDITED}")
    coords |= {axis.name: hdf5.read_coordinate(path, file, axis.name) for axis in axes}
    order = (*POINT, *(axis.name for axis in axes), "start", "peak", "crossing", "state")
    ordered = {name: coords[name] for name in order if name in coords}
    starts, peaks, returns = (len(coords.get(name, ())) for name in ("start", "peak", "crossing"))
    return ordered, Kept(peaks, returns, exponent="lyapunov_exponent" in file, starts=starts, verify="trusted" in file,
                         axes=axes)


def _check_axes(path: PathLike, coords: Mapping[str, Array]) -> None:
    """FileError unless every axis ascends within the range of its quantity."""
    for name in AXES:
        values = coords[name]
        try:
            if not len(values) or not np.all(np.diff(values) > 0.0):
                raise ValueError(f"{name}: found values that do not ascend")
            for end in (values[0], values[-1]):
                Operation(**{name: float(end)})
        except ValueError as error:
            raise FileError(f"{path}: the coordinate {error}. {hdf5.EDITED}") from error


def _checked(path: PathLike, variable: Variable, values: Array) -> Array:
    """``values`` in the type of ``variable``; FileError where a flag has no meaning."""
    known = range(sum(variable.flag_masks) + 1) if variable.flag_masks else variable.flag_values
    if known and values.size and not (values.min() >= known[0] and values.max() <= known[-1]):
        raise FileError(f"{path}: {variable.name} has values that mean nothing. {hdf5.EDITED}")
    return np.asarray(values, variable.dtype)


def _present(file: Any, kept: Kept) -> tuple[Variable, ...]:
    """The variables that an open results file should have, whatever its age."""
    return tuple(variable for variable in recorded(kept) if variable.name in file or variable.name not in LATER)


def _dataset(path: PathLike, file: Any, variable: Variable, kept: Kept) -> Any:
    """The dataset of ``variable`` if its shape and type are right."""
    shape = tuple(len(file[name]) for name in kept.dims(variable))
    return hdf5.check_shape(path, file, variable.name, shape, "f" if variable.dtype.startswith("f") else "iu")
