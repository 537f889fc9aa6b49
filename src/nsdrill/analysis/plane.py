"""A map of safe and other points as a figure in the plane: its connected regions, and
the point deepest inside."""

from __future__ import annotations

import numpy as np

from nsdrill.data import Array

_TOLERANCE = 1e-9  # between equal distances, which are fractions of the range


def regions(safe: Array) -> list[tuple[int, tuple[int, int, int, int]]]:
    """The connected regions of ``safe`` [y, x], the largest first: the number of
    points, and the first and last row and column. Points are neighbours along the axes,
    not across corners."""
    from scipy import ndimage

    labels, count = ndimage.label(safe)
    if not count:
        return []
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    boxes = ndimage.find_objects(labels)
    # stable: by place where the sizes are equal
    order = sorted(range(count), key=lambda number: -int(sizes[number]))
    return [
        (int(sizes[n]), (boxes[n][0].start, boxes[n][0].stop - 1, boxes[n][1].start, boxes[n][1].stop - 1))
        for n in order
    ]


def stretches(chosen: Array) -> list[tuple[int, int]]:
    """The first and last place of each stretch of neighbours of ``chosen`` [n] that are
    true."""
    steps = np.flatnonzero(np.diff(np.pad(chosen.astype(int), 1))).tolist()
    return [(begin, end - 1) for begin, end in zip(steps[::2], steps[1::2], strict=True)]


def largest_margin(safe: Array, y: Array, x: Array) -> tuple[int, int, float] | None:
    """The row and column of the safe point of ``safe`` [y, x] with the largest margin,
    and the margin; None where no point is safe.

    The margin is the Euclidean distance to the nearest point that is not safe, or to
    the edge of the map, whichever is less; each axis is in fractions of its range, so
    that the margin has no unit. An axis of one value has no edge. Of equal margins the
    point farthest from points that are not safe is taken, then that with the largest
    clearance along the axes, then the first.
    """
    rows, columns = np.nonzero(safe)
    if not rows.size:
        return None
    across, up = normalised(x), normalised(y)
    points = np.column_stack((up[rows], across[columns]))
    to_unsafe = _nearest_distances(
        points, np.column_stack([axis[indices] for axis, indices in zip((up, across), np.nonzero(~safe), strict=True)])
    )
    edges = [
        np.minimum(axis[indices], 1.0 - axis[indices])
        for axis, indices in ((up, rows), (across, columns))
        if len(axis) > 1
    ]
    margin = np.min([to_unsafe, *edges], axis=0)
    candidates = np.flatnonzero(margin >= margin.max() - _TOLERANCE)
    candidates = candidates[to_unsafe[candidates] >= to_unsafe[candidates].max() - _TOLERANCE]
    clearance = np.array(
        [
            _clearance(safe[rows[i]], across, columns[i]) + _clearance(safe[:, columns[i]], up, rows[i])
            for i in candidates
        ]
    )
    chosen = candidates[int(np.flatnonzero(clearance >= clearance.max() - _TOLERANCE)[0])]
    return int(rows[chosen]), int(columns[chosen]), float(margin[chosen])


def normalised(values: Array) -> Array:
    """An ascending axis in fractions of its range: 0 to 1; 0 where it has one value."""
    return (values - values[0]) / ((values[-1] - values[0]) or 1.0)


def _nearest_distances(points: Array, others: Array) -> Array:
    """The distance of each of ``points`` [n, 2] from the nearest of ``others`` [m, 2];
    infinite where there is none."""
    if not len(others):
        return np.full(len(points), np.inf)
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(others).query(points)[0])


def _clearance(safe: Array, axis: Array, index: int) -> float:
    """The smaller of the distances from point ``index`` of a line to the nearest point
    that is not safe, or to the end, on the two sides."""
    unsafe = np.flatnonzero(~safe)
    low = unsafe[unsafe < index].max(initial=0)
    high = unsafe[unsafe > index].min(initial=len(axis) - 1)
    return float(min(axis[index] - axis[low], axis[high] - axis[index]))
