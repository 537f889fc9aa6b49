"""Fewer samples for the same picture."""

from __future__ import annotations

import numpy as np

from nsdrill.data import Array

STRETCHES = 50  # of a history whose level moves slowly


def envelope(time: Array, values: Array, bins: int) -> tuple[Array, Array]:
    """The least and the greatest sample of each of ``bins`` stretches, in their order:
    what a line shows at that width.

    Every kept point is a sample, and no extreme is lost. Data that are short already
    come back as they are.
    """
    if len(time) <= 2 * bins:
        return time, values
    starts = np.linspace(0, len(time), bins, endpoint=False).astype(int)
    ends = np.append(starts[1:], len(time))
    # Where a whole stretch is NaN the arg functions would refuse; a sample of NaN must
    # stay NaN: the line has a gap.
    safe_low = np.where(np.isfinite(values), values, np.inf)
    safe_high = np.where(np.isfinite(values), values, -np.inf)
    kept = np.empty(2 * bins, dtype=int)
    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        low, high = (
            start + int(safe_low[start:end].argmin()),
            start + int(safe_high[start:end].argmax()),
        )
        kept[2 * number], kept[2 * number + 1] = min(low, high), max(low, high)
    return time[kept], values[kept]


def bands(time: Array, values: Array, count: int) -> tuple[Array, Array, Array, Array]:
    """The middle time, the least and the greatest sample of each of ``count``
    stretches, and the running mean there, of three stretches with the weights 1, 2, 1:
    a mean of one alone beats with its swings. NaN is left out; a stretch of nothing
    else is NaN."""
    starts = np.linspace(0, len(time), min(count, len(time)), endpoint=False).astype(int)
    finite = np.isfinite(values)
    least = np.minimum.reduceat(np.where(finite, values, np.inf), starts)
    greatest = np.maximum.reduceat(np.where(finite, values, -np.inf), starts)
    there = np.add.reduceat(finite.astype(float), starts)
    total = np.add.reduceat(np.where(finite, values, 0.0), starts)
    total, among = (
        np.convolve(np.pad(one, 1, mode="edge"), (1, 2, 1), "valid") for one in (total, there)
    )
    with np.errstate(invalid="ignore"):
        mean = np.where(there > 0, total / among, np.nan)
    empty = there == 0
    least[empty] = greatest[empty] = np.nan
    ends = np.append(starts[1:], len(time)) - 1
    return 0.5 * (time[starts] + time[ends]), least, greatest, mean


def swings(values: Array) -> int:
    """How often a history swings up: through the mean of its surroundings, where it
    moves by more than 2 % of its range."""
    finite = values[np.isfinite(values)]
    reach = 0.02 * float(np.ptp(finite)) if finite.size else 0.0
    found = 0
    for part in np.array_split(finite, max(1, min(STRETCHES, finite.size // 100))):
        if part.size and np.ptp(part) > reach:
            above = part > part.mean()
            found += int(np.count_nonzero(above[1:] & ~above[:-1]))
    return found


def apart(x: Array, y: Array, shape: tuple[int, int]) -> Array:
    """The indices of points that stand apart on a picture of so many pixels across and
    down: one in each pixel, as what lies under it is not seen. All of them where they
    are few."""
    across, down = shape
    if len(x) <= across * down // 20:
        return np.arange(len(x))
    columns, rows = (
        np.minimum((values - values.min()) * (count / (np.ptp(values) or 1.0)), count - 1).astype(
            np.int64
        )
        for values, count in (
            (np.asarray(x, dtype=float), across),
            (np.asarray(y, dtype=float), down),
        )
    )
    seen = np.full(across * down, -1, dtype=np.int64)
    pixel = rows * across + columns
    seen[pixel[::-1]] = np.arange(len(x))[::-1]  # the first of each
    return np.sort(seen[seen >= 0])


def last_part(time: Array, samples: int, duration: float | None = None) -> slice:
    """The end of a trace: at most so many samples, and so many seconds if given."""
    start = max(len(time) - samples, 0)
    if duration is not None and len(time):
        start = max(start, int(np.searchsorted(time, time[-1] - duration)))
    return slice(start, None)
