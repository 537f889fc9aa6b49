"""A map of safe and other points as a figure in the plane: its connected regions, and
the point deepest inside."""

from __future__ import annotations

import numpy as np

from nsdrill.data import Array

_EQUAL = 1e-9  # distances this near to each other, as parts of the range, are the same


def regions(safe: Array) -> list[tuple[int, tuple[int, int, int, int]]]:
    """The connected regions of ``safe`` [y, x], the largest first: how many points, and
    the first and last row and column. Points are neighbours along the axes, not across
    corners."""
    from scipy import ndimage

    labels, count = ndimage.label(safe)
    if not count:
        return []
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    boxes = ndimage.find_objects(labels)
    # stable: by place where the sizes are equal
    order = sorted(range(count), key=lambda number: -int(sizes[number]))
    return [
        (
            int(sizes[n]),
            (boxes[n][0].start, boxes[n][0].stop - 1, boxes[n][1].start, boxes[n][1].stop - 1),
        )
        for n in order
    ]


def largest_margin(safe: Array, y: Array, x: Array) -> tuple[int, int, float] | None:
    """Row and column of the safe point of ``safe`` [y, x] with the largest margin, and
    that; None where none is safe.

    The margin is the distance to the nearest point that is not safe or to the edge of
    the map, beyond which nothing is known, whichever is less: Euclidean, with each axis
    in parts of its range, so that it has no units. An axis of one value has no edge.
    Among equals the one farthest from what is not safe wins, then the one that has the
    most room along the axes, then the first.
    """
    rows, columns = np.nonzero(safe)
    if not rows.size:
        return None
    across, up = in_parts(x), in_parts(y)
    places = np.column_stack((up[rows], across[columns]))
    to_bad = _to_the_nearest(
        places,
        np.column_stack(
            [axis[at] for axis, at in zip((up, across), np.nonzero(~safe), strict=True)]
        ),
    )
    edges = [
        np.minimum(axis[at], 1.0 - axis[at])
        for axis, at in ((up, rows), (across, columns))
        if len(axis) > 1
    ]
    margin = np.min([to_bad, *edges], axis=0)
    best = np.flatnonzero(margin >= margin.max() - _EQUAL)
    best = best[to_bad[best] >= to_bad[best].max() - _EQUAL]
    room = np.array(
        [
            _room(safe[rows[i]], across, columns[i]) + _room(safe[:, columns[i]], up, rows[i])
            for i in best
        ]
    )
    chosen = best[int(np.flatnonzero(room >= room.max() - _EQUAL)[0])]
    return int(rows[chosen]), int(columns[chosen]), float(margin[chosen])


def in_parts(values: Array) -> Array:
    """An ascending axis in parts of its range: 0 to 1; 0 where it has one value."""
    return (values - values[0]) / ((values[-1] - values[0]) or 1.0)


def _to_the_nearest(places: Array, others: Array) -> Array:
    """The distance of each of ``places`` [n, 2] from the nearest of ``others`` [m, 2];
    infinite where there is none."""
    if not len(others):
        return np.full(len(places), np.inf)
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(others).query(places)[0])


def _room(safe: Array, axis: Array, here: int) -> float:
    """The smaller of the distances from point ``here`` of a line to what is not safe,
    or to the end, on either side."""
    bad = np.flatnonzero(~safe)
    low = bad[bad < here].max(initial=0)
    high = bad[bad > here].min(initial=len(axis) - 1)
    return float(min(axis[here] - axis[low], axis[high] - axis[here]))
