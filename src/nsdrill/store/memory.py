"""A run log in memory, for sweeps that run without a file, and for results in memory that
are written to one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Self

import numpy as np

from nsdrill.data import Array, Results
from nsdrill.errors import FileError
from nsdrill.models.kept import Kept
from nsdrill.models.registry import model_in
from nsdrill.store.read import kept_of
from nsdrill.store.records import check_write, pending_records, record_dtype, recorded
from nsdrill.store.sink import Header, Sink, check_header
from nsdrill.variables import PENDING

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class MemoryLog(Sink):
    """Points in one array [n_points]; pages that no point has written take no
    memory."""

    def __init__(self, header: Header, n_points: int, kept: Kept) -> None:
        check_header(header, n_points, kept)
        super().__init__(header, n_points, kept)
        self._records: Array = np.zeros(n_points, record_dtype(kept))

    @classmethod
    def of(cls, results: Results) -> Self:
        """All points of ``results``, for :func:`nsdrill.store.write_results`. FileError
        where variables are missing."""
        kept = kept_of(results.coords, results.more, results.variables, model_in(results.attrs).name, results.drawn)
        if odd := sorted({variable.name for variable in recorded(kept)} ^ set(results.variables)):
            raise FileError(
                f"these results are a part of a file only: {', '.join(odd)} missing, or without what goes "
                "with it. Give all that the run made."
            )
        coords = {name: results.coords[name] for name in results.grid}
        coords |= {unknown.name: values for unknown, values in results.drawn.items()}
        log = cls({"coords": coords, "attrs": dict(results.attrs)}, math.prod(results.shape), kept)
        for name, values in results.variables.items():
            log._records[name] = values.reshape(log.n_points, *values.shape[len(results.shape) :])
        log._status[:] = log._records["status"]
        return log

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""
        records = pending_records(stop - start, self.kept)
        good = self._status[start:stop] != PENDING
        records[good] = self._records[start:stop][good]
        return records

    def write(self, indices: ArrayLike, records: Array) -> None:
        """Store ``records`` [n] of the points ``indices`` [n]."""
        places = check_write(indices, records, self.n_points, self.kept)
        self._records[places] = records
        self._status[places] = records["status"]

    def clear(self, indices: ArrayLike) -> None:
        """Make the points ``indices`` [n] pending."""
        self._status[np.asarray(indices, np.int64)] = PENDING

    def discard(self) -> None:
        """Make every point pending."""
        self._status[:] = PENDING
