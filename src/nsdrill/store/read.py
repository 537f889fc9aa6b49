"""Reading results: all of them, one point, or the points so far of an unfinished run;
and replacing their labels."""

from __future__ import annotations

import os
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from nsdrill.data import Array, Results
from nsdrill.errors import FileError
from nsdrill.models.description import Description
from nsdrill.models.kept import Kept
from nsdrill.models.operation import Operation
from nsdrill.models.registry import described, model_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.store import hdf5
from nsdrill.store.attributes import check_attributes, get_attributes, plain_attribute, text_attribute
from nsdrill.store.layout import Layout
from nsdrill.store.log import RunLog
from nsdrill.store.log_header import MAGIC
from nsdrill.store.records import pending_records, recorded
from nsdrill.store.results import block_shape, blocks, columns, coordinates, points_in_block, unknown_samples
from nsdrill.store.sink import Source, grid_shape
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

PathLike = str | os.PathLike[str]
LATER_LABELS = ("bounce_severity", "whirl_severity")  # labels that the first files lack


def read_results(path: PathLike, names: Iterable[str] | None = None) -> Results:
    """The results file ``path`` in memory, or only its variables ``names``. FileError
    if it cannot be read."""
    wanted = None if names is None else set(names)
    if unknown := sorted(name for name in wanted or () if name not in BY_NAME):
        raise FileError(f"{path}: no variable is called {', '.join(unknown)}.")
    with hdf5.opened(path) as file:
        points = _Points.of(path, file)
        variables = {
            variable.name: validated(path, variable, points.layout.to_memory(points.dataset(variable)[()]))
            for variable in points.present
            if wanted is None or variable.name in wanted
        }
        return Results(points.coords, variables, get_attributes(path, file), points.kept.axes, points.samples)


def read_partial(path: PathLike, names: Iterable[str] | None = None) -> Results:
    """The points so far in the run log ``path``, or only their variables ``names``;
    also while the run is in progress. Pending points have status 0 and NaN."""
    with RunLog.open(path, writable=False) as log:
        results = collect(log, names)
    _check_axes(path, results.coords)
    return replace(results, attrs=check_attributes(path, results.attrs))


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
    with hdf5.opened(path) as file:
        return _Points.of(path, file).present


def read_attributes(path: PathLike) -> dict[str, Any]:
    """Root attributes of a results or trace file."""
    with hdf5.opened(path) as file:
        return get_attributes(path, file)


def read_point(path: PathLike, *index: int) -> dict[str, Any]:
    """One point of a results file: its coordinates and every variable, as numpy scalars
    and 1-D arrays.

    The indices count procedures, depths, WOBs, rotary speeds, and starts where there
    are several, from 0; FileError if they lie outside.
    """
    with hdf5.opened(path) as file:
        points = _Points.of(path, file)
        shape, grid = points.shape, points.kept.grid
        if len(index) != len(shape) or not all(0 <= i < n for i, n in zip(index, shape, strict=True)):
            raise FileError(f"{path}: there is no point {index}; the sweep has {' x '.join(map(str, shape))} points.")
        point: dict[str, Any] = {name: points.coords[name][i] for name, i in zip(grid, index, strict=True)}
        for variable in points.present:
            values = points.dataset(variable)[points.layout.place(index)]
            point[variable.name] = validated(path, variable, np.asarray(values))[()]
        return point


def log_from_results(path: PathLike, part: PathLike) -> RunLog:
    """Recreate the run log ``part`` from the finished file ``path``, to run its failed
    points again."""
    with hdf5.opened(path) as file:
        points = _Points.of(path, file)
        kept, layout, shape = points.kept, points.layout, points.shape
        # variables that the version of the file did not write stay NaN
        datasets = {v.name: points.dataset(v) for v in points.present}
        coords = {name: points.coords[name] for name in kept.grid}
        coords |= {one.name: values for one, values in points.samples.items()}
        header = {"coords": coords, "attrs": get_attributes(path, file)}
        log = None
        try:
            log = RunLog.create(part, header, int(np.prod(shape)), kept)
            for place, start, stop in blocks(shape, block_shape(shape, points_in_block(kept))):
                records = pending_records(stop - start, kept)
                for name, dataset in datasets.items():
                    values = layout.to_memory(dataset[layout.place(place)])
                    records[name] = values.reshape(stop - start, *values.shape[len(shape) :])
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
    attrs: Mapping[str, Any] | None = None,
    output: PathLike | None = None,
    *,
    overwrite: bool = True,
) -> None:
    """Replace the ``labels``, arrays on the grid, of the results file ``path``, and add
    the line ``history`` to its history; with ``output`` in a copy of that name.

    ``attrs`` replaces root attributes. A copy is edited and renamed at the end, so a
    kill damages nothing. ValueError for unknown labels or other shapes.
    """
    with hdf5.opened(path) as file:
        points = _Points.of(path, file)
        stored = {variable.name: variable for variable in points.present if variable.room == "label"}
        unknown = sorted(set(labels) - set(stored))
        for variable in stored.values():
            points.dataset(variable)
        old_attrs = get_attributes(path, file)
        old_history = str(old_attrs.get("history", ""))
    if unknown:
        raise ValueError(f"not labels: {', '.join(unknown)}; labels are {', '.join(stored)}")
    for name, values in labels.items():
        if np.shape(values) != points.shape:
            raise ValueError(f"{name} has shape {np.shape(values)}, the grid {points.shape}")
    with hdf5.writing(output or path, overwrite=overwrite, copy_of=path) as file:
        for name, values in labels.items():
            file[name][...] = points.layout.to_file(np.asarray(values, file[name].dtype))
        # HDF5 does not reuse the space of replaced text, so unchanged attributes
        # are not written.
        changed = {name: value for name, value in (attrs or {}).items() if not _same(old_attrs.get(name), value)}
        hdf5.put_attributes(file, {**changed, "history": f"{old_history}\n{history}" if old_history else history})


def check_file(path: PathLike) -> int:
    """The format version of the results file ``path``; FileError unless its coordinates
    are valid."""
    with hdf5.opened(path) as file:
        _Points.of(path, file)
        return int(plain_attribute(file.attrs, "format_version"))


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
        kind = file.attrs["nsdrill_kind"]
    for known in ("results", "trace", "branches"):
        if kind == known:
            return known
    raise hdf5.damaged(path, f"its kind is {kind!r}")


def _same(old: Any, new: Any) -> bool:
    return isinstance(new, str | int | float) and type(old) is type(new) and bool(old == new)


@dataclass(frozen=True)
class _Points:
    """The points of an open results file: the record of each (``kept``) and the layout
    of the file. ``coords`` are as in memory; ``samples`` [samples] are those of each
    unknown."""

    path: PathLike
    file: Any
    coords: dict[str, Array]
    kept: Kept
    layout: Layout
    samples: dict[Unknown, Array]

    @classmethod
    def of(cls, path: PathLike, file: Any) -> _Points:
        """The points of ``file``; FileError where its coordinates are invalid."""
        if file.attrs["nsdrill_kind"] != "results":
            raise FileError(
                f"{path}: this is a {file.attrs['nsdrill_kind']} file; a results file is needed "
                f"here, which nsdrill "
                "run makes."
            )
        is_version_1 = plain_attribute(file.attrs, "format_version") == 1
        # in version 1 every coordinate is a dimension, and no attribute names them
        looks_like_1 = "dimensions" not in file.attrs and all(getattr(file.get(name), "ndim", 0) for name in POINT)
        if is_version_1 != looks_like_1:
            raise FileError(
                f"{path}: the attribute format_version is {1 if is_version_1 else 2}, and the file "
                f"is laid out as one of format {2 if is_version_1 else 1}. {hdf5.EDITED}"
            )
        axes = hdf5.read_axes(path, file)
        unknowns = tuple(Unknown(**vars(axis)) for axis in hdf5.read_axes(path, file, "unknowns"))
        grid = (*POINT, *(axis.name for axis in axes), *(name for name in ("sample", "start") if name in file))
        own = (*(name for name in ("peak", "crossing") if name in file), "state")
        arrays = {name: hdf5.read_coordinate(path, file, name) for name in (*grid, *own)}
        lists = (*grid, *own) if is_version_1 else own
        for name in lists:
            if not arrays[name].ndim:
                raise FileError(f"{path}: the coordinate {name} is no list of values. {hdf5.EDITED}")
        coords = {name: np.atleast_1d(values) for name, values in arrays.items()}
        model = model_in(get_attributes(path, file))
        check_coordinates(path, coords, model)
        samples = {unknown: hdf5.read_coordinate(path, file, unknown.name) for unknown in unknowns}
        for unknown, values in samples.items():
            if values.shape != coords.get("sample", np.empty(())).shape:
                raise FileError(
                    f"{path}: {unknown.name} has {values.size} values, and not one of each sample. {hdf5.EDITED}"
                )
        kept = kept_of(coords, axes, file, model.name, unknowns)
        order = kept.grid
        if not is_version_1:
            # The scales of a dataset have their order, too, but the library can crash
            # on those of an invalid file.
            named = text_attribute(path, file, "dimensions").split()
            order = tuple(name for name in named if name in arrays and arrays[name].ndim)
            varying = [name for name in kept.grid if arrays[name].ndim]
            if sorted(order) != sorted(varying):
                raise FileError(
                    f"{path}: the attribute dimensions is {' '.join(named) or 'empty'}; it should "
                    f"name "
                    f"{', '.join(varying) or 'nothing'}, in the order of the variables. "
                    f"{hdf5.EDITED}"
                )
        return cls(path, file, coords, kept, Layout(kept.grid, order), samples)

    @property
    def shape(self) -> tuple[int, ...]:
        """The lengths of the dimensions of the grid in memory."""
        return tuple(len(self.coords[name]) for name in self.kept.grid)

    @property
    def present(self) -> tuple[Variable, ...]:
        """The variables that the file should have. Variables that a sealed file lacks
        are unknown to the version that wrote it, and are left out."""
        every = recorded(self.kept)
        lacking = {v.name for v in every if v.name not in self.file and v.name not in LATER_LABELS}
        required = not lacking or not hdf5.is_sealed(self.path)
        return tuple(v for v in every if v.name in self.file or (required and v.name in lacking))

    def dataset(self, variable: Variable) -> Any:
        """The dataset of ``variable``; FileError where its shape or its type is
        wrong."""
        dims = self.layout.dims(variable)
        shape = tuple(len(self.coords[name]) for name in dims)
        kinds = "f" if variable.dtype.startswith("f") else "iu"
        return hdf5.check_shape(self.path, self.file, variable.name, shape, kinds)


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


def check_coordinates(where: PathLike, coords: Mapping[str, Array], model: Description, *, whole: bool = True) -> None:
    """FileError unless the coordinates, as in memory, are those that nsdrill writes for
    this model, or, if not ``whole``, a part of them. ``where`` is the name of the file
    for the message."""
    procedures = coords["procedure"].tolist()
    if not procedures or len(set(procedures)) < len(procedures) or not set(procedures) <= set(PROCEDURES):
        found = ", ".join(map(str, coords["procedure"]))
        raise FileError(f"{where}: the procedures are {found}; they should be of {', '.join(PROCEDURES)}.")
    if not model.may_have(tuple(coords["state"].tolist())):
        found = ", ".join(map(str, coords["state"]))
        raise FileError(f"{where}: the states are {found}; they should be {', '.join(model.state_sets[0])}.")
    if not whole:
        return
    _check_axes(where, coords)
    for name in COUNTED:
        values = coords.get(name)
        if values is not None and (not len(values) or not np.array_equal(values, np.arange(len(values)))):
            raise FileError(f"{where}: the coordinate {name} does not count from 0. {hdf5.EDITED}")


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


def validated(where: PathLike, variable: Variable, values: Array) -> Array:
    """``values`` in the type of ``variable``; FileError where a flag has an undefined
    value."""
    known = range(sum(variable.flag_masks) + 1) if variable.flag_masks else variable.flag_values
    if known and values.size and not (values.min() >= known[0] and values.max() <= known[-1]):
        raise FileError(f"{where}: {variable.name} has values that mean nothing. {hdf5.EDITED}")
    return np.asarray(values, variable.dtype)
