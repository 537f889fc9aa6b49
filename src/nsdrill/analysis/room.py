"""How much room an allowed setting has, and which setting to recommend.

A setting is held to within a tolerance, of the rotary speed and of the weight on bit. The
room of a point is its distance from the nearest point that is not allowed, or from the
edge of the map, in tolerances: the larger of the two along the axes (Chebyshev), as both
may be off at once.
"""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from nsdrill.analysis.planes import stretches
from nsdrill.data import Array

# of the axes that are settings: the least tolerance, in SI
LEAST = {"rotary_speed": 5 * np.pi / 30, "wob": 4448.2216152605}  # 5 rpm, 1 klbf
RELATIVE = 0.1
# not held by anyone: each value has a map, or a row, of its own
NO_SETTINGS = ("depth",)
_SLACK = 1e-9  # the last bits of a grid decide on nothing
ENOUGH, PLENTY = 1.0 - _SLACK, 2.0 - _SLACK  # tolerances
OF_COLUMN = 1e-4  # what a tolerance along the column counts, beside one along the row
USELESS = 0.5  # of the drilling that another setting with room has
_CHUNK = 4_000_000  # pairs of points that are compared at once


class Kind(StrEnum):
    """How much room the best point has."""

    RUN = "run"
    """A tolerance or more: a setting."""
    NARROW = "narrow"
    """Less: a hint."""
    POINT = "point"
    """None: a hint, of which the neighbours are not allowed."""
    NONE = "none"
    """There is no allowed point."""


def tolerance(axis: str | None, values: Array) -> Array:
    """To how much of each value an axis is held; infinite on an axis that no one sets, and
    on one that is not swept."""
    if axis is None or axis in NO_SETTINGS or len(values) < 2:
        return np.full(len(values), np.inf)
    least = LEAST.get(axis, 1e-9 * float(np.ptp(values)))
    return np.maximum(RELATIVE * np.abs(values), least)


def room(allowed: Array, y: tuple[str | None, Array], x: tuple[str, Array]) -> Array:
    """The room [y, x] of each point of ``allowed`` [y, x] in tolerances; -1 where a point
    is not allowed. The axes are their names and ascending values. A point that is not
    allowed reaches to its neighbours, as a limit lies anywhere between the two. Rows of
    an axis that no one sets are judged each by itself.
    """
    found = np.full(allowed.shape, -1.0)
    if y[0] in NO_SETTINGS:
        for row, one in enumerate(allowed):
            found[row] = room(one[None], (None, np.zeros(1)), x)[0]
        return found
    rows, columns = np.nonzero(allowed)
    if not rows.size:
        return found
    nearest = np.full(len(rows), np.inf)
    of_axes = []
    for (axis, values), places in ((y, rows), (x, columns)):
        scale = tolerance(axis, values)[places]
        at = values[places]
        if np.isfinite(scale[0]):  # else the axis has no edge
            nearest = np.minimum(nearest, np.minimum(at - values[0], values[-1] - at) / scale)
        reach = np.clip(np.arange(len(values)) + np.array([[-1], [1]]), 0, len(values) - 1)
        of_axes.append((at, scale, *values[reach]))
    bad_rows, bad_columns = np.nonzero(~allowed)
    step = max(1, _CHUNK // max(1, len(bad_rows)))
    for begin in range(0, len(rows) if bad_rows.size else 0, step):
        part = slice(begin, begin + step)
        away = np.zeros((len(rows[part]), len(bad_rows)))
        for (at, scale, low, high), bad in zip(of_axes, (bad_rows, bad_columns), strict=True):
            gap = np.maximum(low[bad] - at[part, None], at[part, None] - high[bad])
            away = np.maximum(away, np.maximum(gap, 0.0) / scale[part, None])
        nearest[part] = np.minimum(nearest[part], away.min(axis=1))
    found[rows, columns] = nearest
    return found


def choose(
    allowed: Array,
    better: Array,
    y: tuple[str | None, Array],
    x: tuple[str, Array],
    rate: Array,
    was_run: Array | bool = True,
) -> tuple[tuple[int, int] | None, Kind, bool]:
    """The point to recommend, [y, x]; how much room it has; and whether it lies in its own
    field of ``better`` points, those safe after any history, which are ``allowed`` too.

    Points that are safe after any history come first, if they have a tolerance of room and
    lie inside their own field, and drill at least half as fast as the point that would be
    taken without them; that one may be one of them. Of those with plenty of room the one that drills fastest is taken,
    else the deepest inside. ``rate`` is the rate of penetration, NaN where it is not
    known. Only points that were run are taken, not inferred ones.
    """
    of_allowed, of_better = room(allowed, y, x), room(better, y, x)
    fast = np.nan_to_num(rate, nan=0.0)
    tie = 1e-6 * fast / (np.max(fast, initial=0.0) or 1.0)

    def best(field: Array, inside: Array) -> tuple[int, int] | None:
        if not field.any():
            return None
        wide = field & (inside >= PLENTY)
        finite = np.minimum(inside, 1e6)
        value = np.where(wide, fast + 1e-9 * finite, -np.inf) if wide.any() else np.where(field, finite + tie, -np.inf)
        return _place(value)

    safe = best(better & (of_allowed >= ENOUGH) & (of_better > _SLACK) & was_run, of_better)
    widest = best(allowed & (of_allowed >= ENOUGH) & was_run, of_allowed)
    if safe is not None and (widest is None or fast[safe] >= USELESS * fast[widest]):
        return safe, Kind.RUN, True
    if widest is not None:
        return widest, Kind.RUN, bool(better[widest] and of_better[widest] > _SLACK)
    for field, kind in ((allowed & (of_allowed > _SLACK) & was_run, Kind.NARROW), (allowed & was_run, Kind.POINT)):
        if field.any():
            inside = of_allowed
            if kind == Kind.POINT:  # off the ends of its column as well, where its row leaves a choice
                inside = _along_row(allowed, x) + OF_COLUMN * np.minimum(_along_row(allowed.T, y).T, 1e3)
            return _place(np.where(field, inside + tie, -np.inf)), kind, False
    return None, Kind.NONE, False


def _place(values: Array) -> tuple[int, int]:
    """The first place of the greatest of ``values`` [y, x]."""
    row, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return int(row), int(column)


def _along_row(allowed: Array, x: tuple[str | None, Array]) -> Array:
    """How far each allowed point is from the ends of its stretch of its row, in
    tolerances."""
    axis, values = x
    scale = tolerance(axis, values)
    found = np.full(allowed.shape, -1.0)
    for row, one in enumerate(allowed):
        for first, last in stretches(one):
            here = slice(first, last + 1)
            ends = np.minimum(values[here] - values[first], values[last] - values[here])
            found[row, here] = ends / scale[here]
    return found


def nearest_outside(
    allowed: Array, y: tuple[str | None, Array], x: tuple[str, Array], place: tuple[int, int]
) -> tuple[int, int] | None:
    """The point [y, x] that is not ``allowed`` and leaves a ``place`` no more than its room; of
    several the nearest. None where an edge of the map does, or all are allowed."""
    rows, columns = np.nonzero(~allowed)
    if not rows.size:
        return None
    gap, away, edge = np.zeros(len(rows)), np.zeros(len(rows)), np.inf
    for (axis, values), places, at in ((y, rows, place[0]), (x, columns, place[1])):
        scale = float(tolerance(axis, values)[at])
        if np.isfinite(scale):
            edge = min(edge, float(min(values[at] - values[0], values[-1] - values[at])) / scale)
        reach = np.sign(at - places)  # to the neighbour on the side of the place
        gap = np.maximum(gap, np.abs(values[places + reach] - values[at]) / scale)
        away = np.maximum(away, np.abs(values[places] - values[at]) / scale)
    nearest = int(np.lexsort((away, gap.round(9)))[0])
    return None if edge < gap[nearest] - _SLACK else (int(rows[nearest]), int(columns[nearest]))


def rectangle(
    chosen: Array, y: tuple[str | None, Array], x: tuple[str, Array], place: tuple[int, int]
) -> tuple[tuple[int, int], tuple[int, int]]:
    """The largest rectangle of ``chosen`` points [y, x] around a chosen ``place``: its first
    and last row, and its first and last column. Every point in it is chosen. Its size is
    the product of its sides in tolerances, each of a tolerance more than it has, so that a
    line has a size as well. One that leaves the place a tolerance on each side comes before a
    larger one that does not, and one that leaves it less before one on whose side it lies: what
    is held at the place would leave that."""
    row, column = place
    (_, rows), (_, columns) = y, x
    of_row, of_column = (float(tolerance(*axis)[at]) for axis, at in ((y, row), (x, column)))
    first, last = stretch(chosen[:, column], row)
    best, found = (-1, -1.0), ((row, row), (column, column))
    ends = [stretch(chosen[one], column) for one in range(first, last + 1)]
    for low in range(first, row + 1):
        for high in range(row, last + 1):
            inside = ends[low - first : high - first + 1]
            left, right = max(one for one, _ in inside), min(one for _, one in inside)
            size = (1.0 + (rows[high] - rows[low]) / of_row) * (1.0 + (columns[right] - columns[left]) / of_column)
            beside = min(
                min(rows[row] - rows[low], rows[high] - rows[row]) / of_row,
                min(columns[column] - columns[left], columns[right] - columns[column]) / of_column,
            )
            rank = int(beside > _SLACK) + int(beside >= ENOUGH)
            if rank > best[0] or (rank == best[0] and size > best[1] * (1.0 + _SLACK)):
                best, found = (rank, float(size)), ((low, high), (left, right))
    return found


def stretch(chosen: Array, place: int) -> tuple[int, int]:
    """The stretch of ``chosen`` [n] around a place that is chosen."""
    return next((first, last) for first, last in stretches(chosen) if first <= place <= last)
