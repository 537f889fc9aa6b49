"""The results file: written from a run log in one pass, in order, with bounded memory;
read, all of it or one point, as is what an unfinished run has; and its labels replaced.
Beside it the file of a trace, one trajectory sampled in time."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np
from h5py import File

from nsdrill.analysis.counts import AFTER_FAILURE
from nsdrill.analysis.knowledge import KNOWLEDGE, knowledge_of, used_by_knowledge
from nsdrill.data import Array, Attributes, Results, Trace, edited_together
from nsdrill.errors import FileError, option
from nsdrill.files import reason
from nsdrill.models.registry import BY_NAME, model_in
from nsdrill.store import hdf5, in_use
from nsdrill.store.arrays import Arrays, PathLike, Points, check_coordinates, trace_in, trace_variables
from nsdrill.store.layout import (
    coordinate_attributes,
    file_order,
    plain_attribute,
    plain_attributes,
    root_attributes,
    stored_coordinates,
    tell_of_left_out,
    to_file,
    variable_attributes,
)
from nsdrill.store.log import RunLog
from nsdrill.store.log_format import MAGIC
from nsdrill.store.points import Source, columns, grid_shape, pending_records, points_in_block, record_dtype
from nsdrill.variables import FORMAT_VERSION, INFERRED, PENDING, POINT, Unknown, Variable

NamesIn: TypeAlias = Callable[[Attributes], Iterable[str]]
"""The names of variables that are wanted of a file with these root attributes."""

_CHUNK = 65536  # samples: 512 KiB of one variable


def write_results(path: str | os.PathLike[str], log: Source) -> None:
    """Write the results file ``path`` from ``log``; pending points keep status 0.

    ``path`` is replaced in one step at the end; NsdrillError if that fails, with
    ``path`` and ``log`` unchanged.
    """
    recovery_text = getattr(log, "recovery_text", lambda: "The points are still in memory.")
    contents, coords = log.contents, coordinates(log)
    lengths = {name: len(coords[name]) for name in contents.grid}
    root = root_attributes("results", log.header["attrs"], contents.axes, lengths, contents.unknowns)
    order, shape = file_order(lengths, root), grid_shape(log.header, contents)
    block, kind = block_shape(shape, points_in_block(contents)), record_dtype(contents)
    axes = [contents.grid.index(name) for name in order]
    chunk = tuple(block[axis] for axis in axes)
    stored = stored_coordinates(coords, order, contents, unknown_samples(log))
    others = [
        name for name, (dims, _, _) in stored.items() if not dims or name in {one.name for one in contents.unknowns}
    ]
    with hdf5.writing(path, recovery_text) as file:
        hdf5.put_attributes(file, root)
        for name, (dims, values, attributes) in stored.items():
            hdf5.add_array(file, name, dims, values, attributes)
        marks: Array | None = getattr(log, AFTER_FAILURE.name, None)
        if marks is not None:
            values = to_file(marks, contents.grid, order)
            hdf5.add_array(file, AFTER_FAILURE.name, order, values, variable_attributes(AFTER_FAILURE))
        datasets = {
            v.name: hdf5.add_variable(file, v, (*order, *v.dims[len(POINT) :]), chunk + kind[v.name].shape, others)
            for v in contents.variables
        }
        for place, start, stop in blocks(shape, block):
            records, here = log.read(start, stop), tuple(s.stop - s.start for s in place)
            for name, dataset in datasets.items():
                values = records[name].reshape(*here, *kind[name].shape)
                dataset[tuple(place[axis] for axis in axes)] = to_file(values, contents.grid, order)
        # a run is known by others of its chain, so that this is of all runs
        found = knowledge_of(collect(log, used_by_knowledge(root)), marks)
        hdf5.add_variable(file, KNOWLEDGE, order, chunk, others)[...] = to_file(found, contents.grid, order)


def coordinates(log: Source) -> dict[str, Array]:
    """The coordinates of the results in ``log``, in the order of the dimensions in
    memory."""
    coords = {
        name: np.asarray(log.header["coords"][name]) for name in log.contents.grid if name in log.header["coords"]
    }
    for name in ("sample", "start", "peak", "crossing"):
        if log.contents.length(name):
            coords[name] = np.arange(log.contents.length(name), dtype="<i4")
    return {**coords, "state": np.array(log.contents.states)}


def unknown_samples(log: Source) -> dict[Unknown, Array]:
    """The samples [samples] of each uncertain number of the results in ``log``."""
    return {unknown: np.asarray(log.header["coords"][unknown.name], dtype=float) for unknown in log.contents.unknowns}


def block_shape(shape: tuple[int, ...], points: int) -> tuple[int, ...]:
    """Shape of blocks of about ``points`` points that are contiguous in C order: ones,
    then a part of one axis, then whole axes.

    Such a block is a range of point numbers and, as the chunk shape, one chunk of the
    file, so each chunk is compressed once. The part divides its axis evenly, so little
    of the last chunk is padding.
    """
    block = [1] * len(shape)
    for axis in reversed(range(len(shape))):
        room = max(1, points // math.prod(block))
        pieces = math.ceil(shape[axis] / room)
        block[axis] = math.ceil(shape[axis] / pieces)
        if pieces > 1:
            break
    return tuple(block)


def blocks(shape: tuple[int, ...], block: tuple[int, ...]) -> Iterator[tuple[tuple[slice, ...], int, int]]:
    """All blocks in order: the slices of the grid, and the start and stop of the range
    of their point numbers."""
    counts = [math.ceil(n / b) for n, b in zip(shape, block, strict=True)]
    start = 0
    for number in np.ndindex(*counts):
        place = tuple(slice(i * b, min((i + 1) * b, n)) for i, b, n in zip(number, block, shape, strict=True))
        stop = start + math.prod(s.stop - s.start for s in place)
        yield place, start, stop
        start = stop


def read_results(path: PathLike, names: Iterable[str] | NamesIn | None = None) -> Results:
    """The results file ``path`` in memory, or only its variables ``names``, which may be
    a function of its root attributes. FileError if it cannot be read."""
    with hdf5.opened(path, "results") as file:
        points = _points(path, file)
        wanted = None if names is None else set(names(points.attrs) if callable(names) else names)
        if unknown := sorted(name for name in wanted or () if name not in BY_NAME):
            raise FileError(f"{path}: no variable is called {', '.join(unknown)}.")
        return points.results(wanted)


def read_partial(path: PathLike, names: Iterable[str] | None = None) -> Results:
    """The points so far of the run log ``path``, or only their variables ``names``;
    also while the run is in progress. Pending points have status 0 and NaN."""
    with RunLog.open(path, writable=False) as log:
        attrs = plain_attributes(path, {**log.header["attrs"], "format_version": FORMAT_VERSION})
        try:
            results = collect(log, names)
            check_coordinates(path, results.coords, model_in(attrs), hdf5.EDITED, whole=True)
        except (KeyError, TypeError, ValueError) as error:
            raise hdf5.damaged(path, reason(error)) from error
    return replace(results, attrs=attrs)


def collect(log: Source, names: Iterable[str] | None = None) -> Results:
    """The results in a log, or only their variables ``names``, in memory, with the same
    arrays as in its results file."""
    shape = grid_shape(log.header, log.contents)
    wanted = None if names is None else set(names)
    flat = columns(log, [v.name for v in log.contents.variables if wanted is None or v.name in wanted])
    variables = {name: values.reshape(*shape, *values.shape[1:]) for name, values in flat.items()}
    attrs = {**log.header["attrs"], "format_version": FORMAT_VERSION}
    return Results(coordinates(log), variables, attrs, log.contents.axes, unknown_samples(log))


def variables_in(path: PathLike) -> tuple[Variable, ...]:
    """The variables of the results file or run log ``path``."""
    if kind_of(path) == "partial":
        with RunLog.open(path, writable=False) as log:
            return log.contents.variables
    with hdf5.opened(path, "results") as file:
        return _points(path, file).present


def read_attributes(path: PathLike, *, changed: bool = False) -> Attributes:
    """Root attributes of a file of any kind, also of the run log of an unfinished run.
    FileError if it cannot be read, and where what its runs were made with is another one
    here, unless ``changed`` ones are taken, as for the study in it."""
    if kind_of(path) == "partial":
        with RunLog.open(path, writable=False) as log:
            attrs = {**log.header["attrs"], "format_version": FORMAT_VERSION}
            return plain_attributes(path, attrs, changed=changed)
    with hdf5.opened(path) as file:
        return hdf5.attributes_of(path, file, changed=changed)


def read_point(path: PathLike, *index: int) -> dict[str, Array]:
    """One point of a results file: its coordinates and every variable, as numpy scalars
    and 1-D arrays.

    The indices count procedures, depths, WOBs, rotary speeds, and starts where there
    are several, from 0; FileError if they lie outside.
    """
    with hdf5.opened(path, "results") as file:
        points = _points(path, file)
        shape, grid = points.shape, points.contents.grid
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
        contents, shape = points.contents, points.shape
        coords = {name: points.coords[name] for name in contents.grid}
        coords |= {one.name: values for one, values in points.samples.items()}
        log = None
        try:
            log = RunLog.create(part, {"coords": coords, "attrs": points.attrs}, int(np.prod(shape)), contents)
            for place, start, stop in blocks(shape, block_shape(shape, points_in_block(contents))):
                records = pending_records(stop - start, contents)
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
    kill damages nothing. ValueError for unknown labels or other shapes; FileError where
    another program has ``path`` open to write and would lose what it writes.
    """
    with hdf5.opened(path, "results") as file:
        points = _points(path, file)
        stored = {v.name: points.dims(v) for v in points.present if v.origin == "label"}
        before = points.results(used_by_knowledge(points.attrs))
    if output is None and in_use.is_flagged(path):
        raise FileError(
            f"{path}: {in_use.told(path)}, so it is not replaced. {in_use.remedy(path)} Or write a new file "
            f"with {option('path')}."
        )
    if output is None and not os.stat(path).st_mode & 0o222:
        raise FileError(f"{path}: is write-protected. Write a new file with {option('path')}, or allow it: chmod u+w.")
    if unknown := sorted(set(labels) - set(stored)):
        raise ValueError(f"not labels: {', '.join(unknown)}; labels are {', '.join(stored)}")
    for name, values in labels.items():
        if np.shape(values) != points.shape:
            raise ValueError(f"{name} has shape {np.shape(values)}, the grid {points.shape}")
    known_anew = knowledge_of(replace(before, variables={**before.variables, **labels}))
    old_history = str(points.attrs.get("history", ""))
    with hdf5.writing(output or path, overwrite=overwrite, copy_of=path) as file:
        for name, values in labels.items():
            file[name][...] = to_file(np.asarray(values, file[name].dtype), points.contents.grid, stored[name])
        if KNOWLEDGE.name in file:
            file[KNOWLEDGE.name][...] = to_file(known_anew, points.contents.grid, stored["response"])
        # HDF5 does not reuse the space of replaced text, so unchanged attributes
        # are not written.
        changed = {name: value for name, value in (attrs or {}).items() if points.attrs.get(name) != value}
        changed |= edited_together(points.attrs)
        hdf5.put_attributes(file, {**changed, "history": f"{old_history}\n{history}" if old_history else history})


def is_log(path: PathLike) -> bool:
    """Whether ``path`` is the run log of an unfinished run; a file that cannot be read is none."""
    try:
        if os.path.isfile(path):  # opening a pipe would block
            with open(path, "rb") as file:
                return file.read(len(MAGIC)) == MAGIC
    except (OSError, ValueError):
        pass
    return False


def kind_of(path: PathLike) -> Literal["results", "trace", "partial", "branches"]:
    """The kind of the file ``path``; ``partial`` is the run log of an unfinished run.
    FileError if it is not a file of nsdrill."""
    if is_log(path):
        return "partial"
    with hdf5.opened(path) as file:
        kind = plain_attribute(file.attrs, "nsdrill_kind")
    for known in ("results", "trace", "branches"):
        if kind == known:
            return known
    raise hdf5.damaged(path, f"its kind is {kind!r}")


def _points(path: PathLike, file: File) -> Points:
    points = Points.of(path, hdf5.arrays_in(file), hdf5.attributes_of(path, file), hdf5.EDITED, whole=True)
    _tell_of_left_out(path, points.arrays, points.attrs, {*points.coords, *(one.name for one in points.samples)})
    return points


def _tell_of_left_out(path: PathLike, arrays: Arrays, attrs: Attributes, others: Container[str] = ()) -> None:
    """Warn of what the model of a file does not have here: with a unit and a meaning, as files of
    nsdrill have them, and not among the ``others``, which are coordinates."""
    model = model_in(attrs)
    known = {variable.name for variable in (*model.variables, *model.trace_and_states)}
    left_out = [
        name
        for name, array in arrays.items()
        if name not in known
        and name not in others
        and name not in (AFTER_FAILURE.name, KNOWLEDGE.name)
        and name not in BY_NAME  # the models are loaded one by one until it is found
        and {"units", "long_name"} <= {*array.attrs}
    ]
    tell_of_left_out(path, model, left_out)


def write_trace(path: PathLike, trace: Trace, *, overwrite: bool = True) -> None:
    """Write ``trace`` to ``path``, in one step; NsdrillError if the disk refuses."""
    samples = len(trace.time)
    chunk = (min(_CHUNK, samples),)
    stored = trace_variables(trace)
    for variable in stored:
        if np.shape(trace.variables.get(variable.name, 0.0)) != (samples,):
            raise ValueError(f"the trace needs {variable.name}, an array of {samples} samples")
    with hdf5.writing(path, overwrite=overwrite) as file:
        hdf5.put_attributes(file, root_attributes("trace", trace.attrs))
        hdf5.add_array(file, "time", ("time",), np.asarray(trace.time, "<f8"), coordinate_attributes("time"))
        for variable in stored:
            hdf5.add_variable(file, variable, variable.dims, chunk)[...] = trace.variables[variable.name]


def read_trace(path: str | os.PathLike[str]) -> Trace:
    """The trace file ``path`` in memory; FileError if it cannot be read."""
    with hdf5.opened(path, "trace") as file:
        arrays, attrs = hdf5.arrays_in(file), hdf5.attributes_of(path, file)
        trace = trace_in(path, arrays, attrs, hdf5.EDITED)
        _tell_of_left_out(path, arrays, attrs, ("time",))
        return trace
