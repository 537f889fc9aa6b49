"""The results file, written from a run log in one pass, in order, with bounded
memory; and the file of branches."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import FileError
from nsdrill.files import MAKE_ROOM, reason
from nsdrill.models.kept import Kept
from nsdrill.store import hdf5
from nsdrill.store.layout import file_order, plain_attributes, root_attributes, stored_coordinates, to_file
from nsdrill.store.records import record_dtype, recorded
from nsdrill.store.sink import Source, grid_shape
from nsdrill.variables import POINT, Unknown

if TYPE_CHECKING:
    from xarray import Dataset


T = TypeVar("T")
_BLOCK_BYTES = 4 << 20
_BLOCK_POINTS = 4096


def write_results(path: str | os.PathLike[str], log: Source) -> None:
    """Write the results file ``path`` from ``log``; pending points keep status 0.

    ``path`` is replaced in one step at the end; NsdrillError if that fails, with
    ``path`` and ``log`` unchanged.
    """
    recovery_text = getattr(log, "recovery_text", lambda: "The points are still in memory.")
    kept, coords = log.kept, coordinates(log)
    lengths = {name: len(coords[name]) for name in kept.grid}
    root = root_attributes("results", log.header["attrs"], kept.axes, lengths, kept.unknowns)
    order, shape = file_order(lengths, root), grid_shape(log.header, kept)
    block, kind = block_shape(shape, points_in_block(kept)), record_dtype(kept)
    stored = stored_coordinates(coords, order, kept, unknown_samples(log))
    others = [*(name for name in kept.grid if name not in order), *(unknown.name for unknown in kept.unknowns)]
    with hdf5.writing(path, recovery_text) as file:
        hdf5.put_attributes(file, root)
        for name, (dims, values, attributes) in stored.items():
            hdf5.add_array(file, name, dims, values, attributes)
        datasets = {
            v.name: hdf5.add_variable(
                file, v, (*order, *v.dims[len(POINT) :]), _in_order(block, kept, order) + kind[v.name].shape, others
            )
            for v in recorded(kept)
        }
        for place, start, stop in blocks(shape, block):
            records, here = log.read(start, stop), tuple(s.stop - s.start for s in place)
            for name, dataset in datasets.items():
                values = records[name].reshape(*here, *kind[name].shape)
                dataset[_in_order(place, kept, order)] = to_file(values, kept.grid, order)


def _in_order(place: Sequence[T], kept: Kept, order: Sequence[str]) -> tuple[T, ...]:
    """What ``place`` has for each dimension of the grid, for those of a file."""
    return tuple(place[kept.grid.index(name)] for name in order)


def coordinates(log: Source) -> dict[str, Array]:
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
    import xarray

    with hdf5.opened(path, KIND) as file:
        attrs = plain_attributes(path, file.attrs)
    try:
        with xarray.open_dataset(path, engine="h5netcdf", decode_cf=False) as dataset:
            data = dataset.load()
    except Exception as error:  # of metadata that only xarray reads
        raise hdf5.damaged(path, reason(error)) from error
    if lacking := [name for name in _REQUIRED if name not in data]:
        raise FileError(f"{path}: the variable {lacking[0]} is missing. {hdf5.EDITED}")
    sizes = data["row_size"].values
    if data.sizes.get("point") != int(sizes.sum()) or np.any(sizes < 0):
        raise FileError(f"{path}: its branches do not have as many points as they say. {hdf5.EDITED}")
    for name in [*data.variables]:
        data[name].attrs.pop("_FillValue", None)
    return data.assign_attrs(attrs)
