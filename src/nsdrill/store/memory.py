"""A run log in memory, for sweeps that run without a file. It has the protocol of the
log in a file."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from nsdrill.data import Array
from nsdrill.models.kept import Kept
from nsdrill.store.records import check_write, pending_records, record_dtype
from nsdrill.store.sink import check_header
from nsdrill.variables import PENDING


class MemoryLog:
    """Points in one array [n_points]; pages that no point has written take no
    memory."""

    def __init__(self, header: dict[str, Any], n_points: int, kept: Kept) -> None:
        check_header(header, n_points, kept)
        self.header = header
        self.n_points = n_points
        self.kept = kept
        self._records: Array = np.zeros(n_points, record_dtype(kept))
        self._status: Array = np.zeros(n_points, np.int8)

    def write(self, indices: Any, records: Array) -> None:
        """Store ``records`` [n] of the points ``indices`` [n]."""
        places = check_write(indices, records, self.n_points, self.kept)
        self._records[places] = records
        self._status[places] = records["status"]

    def clear(self, indices: Any) -> None:
        """Make the points ``indices`` [n] pending."""
        self._status[np.asarray(indices, np.int64)] = PENDING

    def sync(self) -> None:
        """Do nothing: memory does not outlive the process."""

    def status(self) -> Array:
        """Status of every point: int8 [n_points]."""
        return self._status.copy()

    def done(self) -> Array:
        """Which points have a result: bool [n_points]."""
        return np.asarray(self._status != PENDING)

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""
        records = pending_records(stop - start, self.kept)
        good = self._status[start:stop] != PENDING
        records[good] = self._records[start:stop][good]
        return records

    def close(self) -> None:
        """Do nothing; the records can still be read."""

    def discard(self) -> None:
        """Make every point pending."""
        self._status[:] = PENDING

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
