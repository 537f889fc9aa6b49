"""The record of one point: the numbers of its run, as one row of fixed size.

A *record* holds every variable of one point. A *slot* is a record as stored in the run
log, preceded by its index and a checksum, so that an incomplete or misplaced record is
detected.
"""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.data import Array
from nsdrill.models.kept import Kept
from nsdrill.variables import PENDING, POINT, Variable

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def recorded(kept: Kept) -> tuple[Variable, ...]:
    """The variables that a record holds."""
    return kept.variables


def record_dtype(kept: Kept) -> np.dtype:
    """Type of the record of one point, little-endian, with one field per variable.

    Fields with a further dimension have its length: peak fields (peaks,), state
    fields (states,) in the order of ``kept.states``. Units are those of the model's
    description.
    """
    if kept.peaks < 0 or kept.returns < 0:
        raise ValueError(f"the numbers of peaks and returns are {kept.peaks} and {kept.returns}; neither is negative")
    fields = [
        (v.name, f"<{v.dtype}", tuple(kept.length(name) for name in v.dims[len(POINT) :])) for v in recorded(kept)
    ]
    return np.dtype(fields)


def pending_records(count: int, kept: Kept) -> Array:
    """``count`` records of points that have not run: status 0, labels and counts 0, all
    real numbers NaN."""
    records = np.zeros(count, record_dtype(kept))
    for variable in recorded(kept):
        if variable.dtype.startswith("f"):
            records[variable.name] = np.nan
    return records


def slot_dtype(kept: Kept) -> np.dtype:
    """Type of a slot of the run log: checksum, index of the point, record."""
    return np.dtype([("crc", "<u4"), ("index", "<u8"), ("record", record_dtype(kept))])


def pack_slots(indices: Array, records: Array, salt: int) -> Array:
    """Slots [n] for ``records`` [n] of the points ``indices`` [n]. ``salt`` ties them
    to one log."""
    slots = np.zeros(len(records), np.dtype([("crc", "<u4"), ("index", "<u8"), ("record", records.dtype)]))
    slots["index"] = indices
    slots["record"] = records
    slots["crc"] = _checksums(slots, salt)
    return slots


def intact(slots: Array, start: int, salt: int) -> Array:
    """Which of ``slots`` [n] hold a complete record of the points ``start``,
    ``start + 1``, ... : bool [n].

    Slots that were never written are all zero, hence pending; checksums are computed
    for the other slots only.
    """
    good = slots["record"]["status"] != PENDING
    good &= slots["index"] == np.arange(start, start + len(slots), dtype=np.uint64)
    candidates = np.flatnonzero(good)
    good[candidates] = slots["crc"][candidates] == _checksums(slots[candidates], salt)
    return np.asarray(good)


def check_write(indices: ArrayLike, records: Array, n_points: int, kept: Kept) -> Array:
    """``indices`` as an int64 array; ValueError unless they and ``records`` are valid
    for writing."""
    places = np.atleast_1d(np.asarray(indices))
    if places.ndim != 1 or (places.size and not np.issubdtype(places.dtype, np.integer)):
        raise ValueError("indices must be a 1-D array of integers")
    if records.dtype != record_dtype(kept) or records.shape != places.shape:
        raise ValueError(
            f"records must have shape {places.shape} and the type record_dtype({kept}); found shape {records.shape}"
        )
    if places.size and (places.min() < 0 or places.max() >= n_points):
        raise ValueError(f"indices must lie in 0 .. {n_points - 1}; found {places.min()} .. {places.max()}")
    if np.any(records["status"] == PENDING):
        raise ValueError("a record with status 0 (pending) is no result; clear() takes a result back")
    return places.astype(np.int64)


def raw_bytes(array: Array) -> memoryview:
    """The bytes of a contiguous ``array``, not copied."""
    return memoryview(array.view(np.uint8).reshape(-1)) if array.size else memoryview(b"")  # type: ignore[arg-type]


def _checksums(slots: Array, salt: int) -> Array:
    """CRC-32 of every slot without its checksum field: uint32 [n], by one call of zlib
    per slot (1 us)."""
    data = raw_bytes(np.ascontiguousarray(slots))
    size = slots.dtype.itemsize
    ends = range(size, len(slots) * size + 1, size)
    return np.fromiter((zlib.crc32(data[end - size + 4 : end], salt) for end in ends), np.uint32, len(slots))
