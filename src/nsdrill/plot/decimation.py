"""Fewer samples for the same picture."""

from __future__ import annotations

import numpy as np

from nsdrill.data import Array

PARTS = 50  # of a history, each with a mean of its own, as its level may drift


def envelope(time: Array, values: Array, bins: int) -> tuple[Array, Array]:
    """The least and the greatest sample of each of ``bins`` bins, in their order: what
    a line shows at that width.

    Every kept point is a sample, and no extreme is lost. Data that are short already
    are returned unchanged.
    """
    if len(time) <= 2 * bins:
        return time, values
    starts = np.linspace(0, len(time), bins, endpoint=False).astype(int)
    ends = np.append(starts[1:], len(time))
    # argmin and argmax do not skip NaN. In a bin of NaN alone they give its first
    # sample, which stays NaN: the line has a gap.
    safe_low = np.where(np.isfinite(values), values, np.inf)
    safe_high = np.where(np.isfinite(values), values, -np.inf)
    kept = np.empty(2 * bins, dtype=int)
    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        low, high = (start + int(safe_low[start:end].argmin()), start + int(safe_high[start:end].argmax()))
        kept[2 * number], kept[2 * number + 1] = min(low, high), max(low, high)
    return time[kept], values[kept]


def binned_statistics(time: Array, values: Array, count: int) -> tuple[Array, Array, Array, Array]:
    """The middle time, the least and the greatest sample of each of ``count`` bins, and
    the running mean over three bins with the weights 1, 2, 1, as the mean of a single
    bin beats with the oscillation. NaN is left out; a bin of nothing else is NaN."""
    starts = np.linspace(0, len(time), min(count, len(time)), endpoint=False).astype(int)
    finite = np.isfinite(values)
    least = np.minimum.reduceat(np.where(finite, values, np.inf), starts)
    greatest = np.maximum.reduceat(np.where(finite, values, -np.inf), starts)
    counts = np.add.reduceat(finite.astype(float), starts)
    total = np.add.reduceat(np.where(finite, values, 0.0), starts)
    total, weights = (np.convolve(np.pad(sums, 1, mode="edge"), (1, 2, 1), "valid") for sums in (total, counts))
    with np.errstate(invalid="ignore"):
        mean = np.where(counts > 0, total / weights, np.nan)
    empty = counts == 0
    least[empty] = greatest[empty] = np.nan
    ends = np.append(starts[1:], len(time)) - 1
    return 0.5 * (time[starts] + time[ends]), least, greatest, mean


def count_upcrossings(values: Array) -> int:
    """How often a history crosses its local mean upwards, where it moves by more than
    2 % of its range. The local means are those of at most :data:`PARTS` parts."""
    finite = values[np.isfinite(values)]
    threshold = 0.02 * float(np.ptp(finite)) if finite.size else 0.0
    crossings = 0
    for part in np.array_split(finite, max(1, min(PARTS, finite.size // 100))):
        if part.size and np.ptp(part) > threshold:
            above = part > part.mean()
            crossings += int(np.count_nonzero(above[1:] & ~above[:-1]))
    return crossings


def one_per_pixel(x: Array, y: Array, shape: tuple[int, int]) -> Array:
    """The indices of the first point in each pixel of a picture of ``shape`` (across,
    down): the later ones lie under it. All indices where the points are few."""
    across, down = shape
    if len(x) <= across * down // 20:
        return np.arange(len(x))
    columns, rows = (
        np.minimum((values - values.min()) * (count / (np.ptp(values) or 1.0)), count - 1).astype(np.int64)
        for values, count in ((np.asarray(x, dtype=float), across), (np.asarray(y, dtype=float), down))
    )
    first_points = np.full(across * down, -1, dtype=np.int64)
    pixel = rows * across + columns
    first_points[pixel[::-1]] = np.arange(len(x))[::-1]  # the first point of each pixel
    return np.sort(first_points[first_points >= 0])


def last_part(time: Array, samples: int, duration: float | None = None) -> slice:
    """The end of a trace: at most ``samples`` samples, and at most ``duration`` [s]."""
    start = max(len(time) - samples, 0)
    if duration is not None and len(time):
        start = max(start, int(np.searchsorted(time, time[-1] - duration)))
    return slice(start, None)
