"""The points of a run before they are a file: the record of each, and what holds them.

A *record* has every variable of one point, as one row of fixed size. Points are numbered
in C order over the procedures and the axes, and over the samples or starts where there
are several. A sink takes records in any order, a source gives them in theirs: a run log,
or an array in memory.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol, Self, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from nsdrill.analysis.counts import AFTER_FAILURE, after_failure
from nsdrill.data import Array, Attributes, Results
from nsdrill.errors import FileError
from nsdrill.models.contents import Contents
from nsdrill.models.model_description import Description
from nsdrill.models.registry import model_in, of_known_models
from nsdrill.variables import PENDING, POINT, Axis, Unknown

_BLOCK_BYTES = 4 << 20  # of the points in memory at once
_BLOCK_POINTS = 4096


def contents_of(
    coords: Mapping[str, Array],
    axes: tuple[Axis, ...],
    names: Container[str],
    model: Description,
    unknowns: Iterable[Unknown] = (),
) -> Contents:
    """What results keep of each point: those of the ``model``, with these
    ``coords``, further ``axes``, ``names`` of variables and ``unknowns``."""
    starts, peaks, returns = (len(coords.get(name, ())) for name in ("start", "peak", "crossing"))
    states = tuple(coords["state"].tolist())
    optional = (v for v in (*model.features, *model.derived) if v.only and v.only not in states)
    options = dict.fromkeys(v.only for v in optional if v.only and v.name in names)
    return Contents(
        peaks,
        returns,
        exponent="lyapunov_exponent" in names,
        starts=starts,
        verify="trusted" in names,
        axes=axes,
        states=states,
        model=model.name,
        options=tuple(options),
        samples=len(coords.get("sample", ())),
        unknowns=tuple(unknowns),
        method="method" in names,
    )


def contents_in(results: Results) -> Contents:
    """What ``results`` in memory keep of each point."""
    return contents_of(results.coords, results.more, results.variables, model_in(results.attrs), results.drawn)


@of_known_models
def record_dtype(contents: Contents) -> np.dtype:
    """Type of the record of one point, little-endian, with one field per variable.

    Fields with a further dimension have its length: peak fields (peaks,), state
    fields (states,) in the order of ``contents.states``. Units are those of the model's
    description.
    """
    if contents.peaks < 0 or contents.returns < 0:
        raise ValueError(
            f"the numbers of peaks and returns are {contents.peaks} and {contents.returns}; neither is negative"
        )
    fields = [
        (v.name, f"<{v.dtype}", tuple(contents.length(name) for name in v.dims[len(POINT) :]))
        for v in contents.variables
    ]
    return np.dtype(fields)


def pending_records(count: int, contents: Contents) -> Array:
    """``count`` records of points that have not run: status 0, labels and counts 0, all
    real numbers NaN."""
    records = np.zeros(count, record_dtype(contents))
    for variable in contents.variables:
        if variable.dtype.startswith("f"):
            records[variable.name] = np.nan
    return records


def check_write(indices: ArrayLike, records: Array, n_points: int, contents: Contents) -> Array:
    """``indices`` as an int64 array; ValueError unless they and ``records`` are valid
    for writing."""
    places = np.atleast_1d(np.asarray(indices))
    if places.ndim != 1 or (places.size and not np.issubdtype(places.dtype, np.integer)):
        raise ValueError("indices must be a 1-D array of integers")
    if records.dtype != record_dtype(contents) or records.shape != places.shape:
        raise ValueError(
            f"records must have shape {places.shape} and the type record_dtype({contents}); found shape {records.shape}"
        )
    if places.size and (places.min() < 0 or places.max() >= n_points):
        raise ValueError(f"indices must lie in 0 .. {n_points - 1}; found {places.min()} .. {places.max()}")
    if np.any(records["status"] == PENDING):
        raise ValueError("a record with status 0 (pending) is no result; clear() takes a result back")
    return places.astype(np.int64)


class Header(TypedDict):
    """The coordinates of the points [SI], and the root attributes of the results file."""

    coords: Mapping[str, Array | Sequence[float | str]]
    attrs: Attributes


class Source(Protocol):
    """A source of points, which are read in order.

    ``n_points`` counts all points, pending ones included; ``contents`` says what the record
    of each has."""

    header: Header
    n_points: int
    contents: Contents

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""


class Sink(ABC):
    """A store of points, which are written in any order. It is a :class:`Source`."""

    def __init__(self, header: Header, n_points: int, contents: Contents) -> None:
        self.header, self.n_points, self.contents = header, n_points, contents
        self._status: Array = np.zeros(n_points, np.int8)

    @abstractmethod
    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""

    @abstractmethod
    def write(self, indices: ArrayLike, records: Array) -> None:
        """Store ``records`` [n] of the points ``indices`` [n], in place of earlier
        ones."""

    @abstractmethod
    def clear(self, indices: ArrayLike) -> None:
        """Make the points ``indices`` [n] pending, so that they run again."""

    def sync(self) -> None:
        """Return when all written points would survive a crash, as far as they can."""
        return

    def status(self) -> Array:
        """Status of every point: int8 [n_points]."""
        return self._status.copy()

    def done(self) -> Array:
        """Which points have a result, successful or failed: bool [n_points]."""
        return np.asarray(self._status != PENDING)

    def close(self) -> None:
        """Close the store; synced points stay."""
        return

    @abstractmethod
    def discard(self) -> None:
        """Close the store and remove it with all of its points."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def grid_shape(header: Header, contents: Contents) -> tuple[int, ...]:
    """The lengths of the dimensions of a header: procedures, values of each axis, and
    samples or starts where there are several."""
    return tuple(len(header["coords"][name]) for name in contents.grid)


def check_header(header: Header, n_points: int, contents: Contents) -> None:
    """ValueError unless ``header`` describes ``n_points`` points."""
    missing = [name for name in contents.grid if name not in header.get("coords", {})]
    if missing or "attrs" not in header:
        wanted = ", ".join(contents.grid)
        raise ValueError(f"a header needs 'attrs' and 'coords' with {wanted}; missing: {missing or 'attrs'}")
    if n_points < 1 or math.prod(grid_shape(header, contents)) != n_points:
        raise ValueError(f"the axes span {math.prod(grid_shape(header, contents))} points, not {n_points}")


def points_in_block(contents: Contents) -> int:
    """The number of points to hold in memory at once."""
    return max(1, min(_BLOCK_POINTS, _BLOCK_BYTES // record_dtype(contents).itemsize))


def columns(log: Source, names: Iterable[str], start: int = 0, stop: int | None = None) -> dict[str, Array]:
    """The variables ``names`` of the points from ``start`` to ``stop`` [points, ...].
    Only some records are in memory at a time, as one takes 640 kB where it has many
    returns to the Poincare section."""
    stop = log.n_points if stop is None else stop
    kind = record_dtype(log.contents)
    arrays = {name: np.empty((stop - start, *kind[name].shape), kind[name].base) for name in names}
    step = points_in_block(log.contents)
    for first in range(start, stop if arrays else start, step):
        records = log.read(first, min(first + step, stop))
        for name, values in arrays.items():
            values[first - start : first - start + step] = records[name]
    return arrays


class MemoryLog(Sink):
    """Points in one array [n_points]; pages that no point has written take no
    memory."""

    not_carried: Array | None = None
    """Which runs came after a failed one in their chain, where the points do not tell, as
    they are a part of what was run [grid]."""

    def __init__(self, header: Header, n_points: int, contents: Contents) -> None:
        check_header(header, n_points, contents)
        super().__init__(header, n_points, contents)
        self._records: Array = np.zeros(n_points, record_dtype(contents))

    @classmethod
    def of(cls, results: Results) -> Self:
        """All points of ``results``, for :func:`nsdrill.store.write_results`. FileError
        where variables are missing."""
        contents = contents_in(results)
        variables = {name: values for name, values in results.variables.items() if name != AFTER_FAILURE.name}
        if odd := sorted({variable.name for variable in contents.variables} ^ set(variables)):
            raise FileError(
                f"these results are a part of a file only: {', '.join(odd)} missing, or without what goes "
                "with it. Give all that the run made."
            )
        coords = {name: results.coords[name] for name in results.grid}
        coords |= {unknown.name: values for unknown, values in results.drawn.items()}
        log = cls({"coords": coords, "attrs": dict(results.attrs)}, math.prod(results.shape), contents)
        if not np.array_equal(after_failure(results), after_failure(replace(results, variables=variables))):
            log.not_carried = results[AFTER_FAILURE.name]
        for name, values in variables.items():
            log._records[name] = values.reshape(log.n_points, *values.shape[len(results.shape) :])
        log._status[:] = log._records["status"]
        return log

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""
        records = pending_records(stop - start, self.contents)
        good = self._status[start:stop] != PENDING
        records[good] = self._records[start:stop][good]
        return records

    def write(self, indices: ArrayLike, records: Array) -> None:
        """Store ``records`` [n] of the points ``indices`` [n]."""
        places = check_write(indices, records, self.n_points, self.contents)
        self._records[places] = records
        self._status[places] = records["status"]

    def clear(self, indices: ArrayLike) -> None:
        """Make the points ``indices`` [n] pending."""
        self._status[np.asarray(indices, np.int64)] = PENDING

    def discard(self) -> None:
        """Make every point pending."""
        self._status[:] = PENDING
