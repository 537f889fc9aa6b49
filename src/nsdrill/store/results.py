"""The results file, written from a run log in one pass, in order, with bounded
memory."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models.kept import Kept
from nsdrill.store import hdf5
from nsdrill.store.layout import coordinate_attributes, coordinate_names, layout_of, root_attributes, stored_coordinate
from nsdrill.store.records import record_dtype, recorded
from nsdrill.store.sink import Source, grid_shape
from nsdrill.variables import POINT, Unknown

_BLOCK_BYTES = 4 << 20
_BLOCK_POINTS = 4096


def write_results(path: str | os.PathLike[str], log: Source, attrs: Mapping[str, Any] | None = None) -> None:
    """Write the results file ``path`` from ``log``; pending points keep status 0.

    ``attrs`` are added to the root attributes of the log's header. ``path`` is replaced
    in one step at the end; NsdrillError if that fails, with ``path`` and ``log``
    unchanged.
    """
    recovery_text = getattr(log, "recovery_text", lambda: "The points are still in memory.")
    kept, coords = log.kept, coordinates(log)
    lengths = {name: len(coords[name]) for name in kept.grid}
    root = root_attributes("results", {**log.header["attrs"], **(attrs or {})}, kept.axes, lengths, kept.unknowns)
    layout = layout_of(lengths, root)
    shape = grid_shape(log.header, kept)
    block = block_shape(shape, points_in_block(kept))
    variables, kind, axes = (recorded(kept), record_dtype(kept), {axis.name: axis for axis in kept.axes})
    scalars = [name for name in layout.grid if name not in layout.order]
    with hdf5.writing(path, recovery_text) as file:
        hdf5.put_attributes(file, root)
        for name in coordinate_names(layout, kept):
            values = stored_coordinate(name, coords[name])
            values = values[0] if name in scalars else values
            hdf5.add_coordinate(file, name, values, coordinate_attributes(name, axes.get(name)))
        for unknown, samples in unknown_samples(log).items():
            hdf5.add_samples(file, unknown.name, samples, coordinate_attributes(unknown.name, unknown))
        scalar_coordinates = [*scalars, *(unknown.name for unknown in kept.unknowns)]
        datasets = [
            hdf5.add_variable(file, v, layout.dims(v), layout.place(block) + kind[v.name].shape, scalar_coordinates)
            for v in variables
        ]
        for place, start, stop in blocks(shape, block):
            records = log.read(start, stop)
            for variable, dataset in zip(variables, datasets, strict=True):
                values = records[variable.name]
                values = values.reshape(*(s.stop - s.start for s in place), *values.shape[1:])
                dataset[layout.place(place)] = layout.to_file(values)


def coordinates(log: Source) -> dict[str, np.ndarray[Any, np.dtype[Any]]]:
    """The coordinates of the results in ``log``, in the order of the dimensions in
    memory."""
    coords = {name: np.asarray(log.header["coords"][name]) for name in (*POINT, *(a.name for a in log.kept.axes))}
    for name in ("sample", "start", "peak", "crossing"):
        if log.kept.length(name):
            coords[name] = np.arange(log.kept.length(name), dtype="<i4")
    return {**coords, "state": np.array(log.kept.states)}


def unknown_samples(log: Source) -> dict[Unknown, Array]:
    """The samples [samples] of each uncertain number of the results in ``log``."""
    return {unknown: np.asarray(log.header["coords"][unknown.name], dtype=float) for unknown in log.kept.unknowns}


def points_in_block(kept: Kept) -> int:
    """The number of points to hold in memory at once."""
    return max(1, min(_BLOCK_POINTS, _BLOCK_BYTES // record_dtype(kept).itemsize))


def columns(log: Source, names: Iterable[str], start: int = 0, stop: int | None = None) -> dict[str, Array]:
    """The variables ``names`` of the points from ``start`` to ``stop`` [points, ...].
    Only some records are in memory at a time, as one takes 640 kB where it has many
    returns to the Poincare section."""
    stop = log.n_points if stop is None else stop
    kind = record_dtype(log.kept)
    arrays = {name: np.empty((stop - start, *kind[name].shape), kind[name].base) for name in names}
    step = points_in_block(log.kept)
    for first in range(start, stop if arrays else start, step):
        records = log.read(first, min(first + step, stop))
        for name, values in arrays.items():
            values[first - start : first - start + step] = records[name]
    return arrays


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
