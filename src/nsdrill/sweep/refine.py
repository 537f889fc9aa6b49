"""Where a coarse grid needs finer spacing: level by level, wherever neighbouring
responses differ.

Pure logic on arrays. A *unit* is what is run as a whole, a point or a carried chain;
its *class* is a number that two units share if their responses are the same. The
outcome follows from the classes alone: not from the order in which units were run, and
not from how often the work was interrupted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]
_NONE = np.iinfo(np.int64).max  # greater than any class


@dataclass(frozen=True)
class Refinement:
    """How far it is: ``needed`` (bool, grid) says which units must be run as far as is
    known, at ``level`` (0: the coarse grid). When all of them are known ``filled``
    (int, grid) holds a class for every unit, run or not."""

    needed: Array
    level: int
    filled: Array | None = None


def fine_length(points: int, depth: int) -> int:
    """How many values an axis of ``points`` coarse values has when its spacing can be
    halved ``depth`` times."""
    return (points - 1) * 2**depth + 1


def refine(
    classes: Array, known: Array, axes: Sequence[bool], depth: int, *, everything: bool = False
) -> Refinement:
    """Retrace the refinement of a grid from what is known of it.

    ``classes`` (int, fine grid) holds the class of each unit for which ``known`` (bool,
    fine grid) is true. ``axes`` says which axes of the grid are refined, ``depth``
    times; along these the length is that of :func:`fine_length`. The values of the
    other axes are grids of their own.

    Every level halves the spacing. A cell is divided, and all units of the divided cell
    are needed, if two of the known units on its corners, edges and faces at the halved
    spacing have different classes; so a unit that came out different on the edge of a
    neighbour divides that neighbour too, until nothing changes. A unit that is not
    needed has, when all is known, the class of all needed ones around it.

    Units are looked at only when they are needed, so that superfluous ones change
    nothing; with ``everything`` all that are known are looked at in the end, at the
    finest spacing. Not before: a unit of a coarse spacing that a finer one needed says
    no more about its coarse neighbours than it did then.
    """
    needed = np.zeros(classes.shape, dtype=bool)
    corners = _every(axes, 2)
    place = _every(axes, 2**depth)
    needed[place] = True
    if (needed & ~known).any():
        return Refinement(needed, 0)
    filled = classes[place]
    for level in range(1, depth + 1):
        place = _every(axes, 2 ** (depth - level))
        divided: Array | None = None
        while True:
            seen = known[place] if everything and level == depth else needed[place] & known[place]
            low, high = (
                np.where(seen, classes[place], _NONE),
                np.where(seen, classes[place], -_NONE),
            )
            low[corners] = np.where(seen[corners], low[corners], filled)
            high[corners] = np.where(seen[corners], high[corners], filled)
            differs = _over_cells(low, axes, np.minimum) != _over_cells(high, axes, np.maximum)
            divided = differs if divided is None else divided | differs
            wanted = _units_of(divided, axes)
            if not (wanted & ~needed[place]).any():
                break
            needed[place] |= wanted
            if (needed & ~known).any():
                return Refinement(needed, level)
        filled = np.where(seen, classes[place], _nearer_corner(filled, axes))
    return Refinement(needed, depth, filled)


def _every(axes: Sequence[bool], step: int) -> tuple[slice, ...]:
    """The place of every so many values of the refined axes, and all of the others."""
    return tuple(slice(None, None, step) if refined else slice(None) for refined in axes)


def _along(axis: int, *bounds: int | None) -> tuple[slice, ...]:
    return (*[slice(None)] * axis, slice(*bounds))


def _over_cells(values: Array, axes: Sequence[bool], join: Any) -> Array:
    """``join`` of all units of each cell: three along every refined axis, of which
    neighbours share the outer ones."""
    for axis, refined in enumerate(axes):
        if refined:
            parts = [
                values[_along(axis, *bounds)] for bounds in ((0, -1, 2), (1, None, 2), (2, None, 2))
            ]
            values = join(join(parts[0], parts[1]), parts[2])
    return values


def _units_of(cells: Array, axes: Sequence[bool]) -> Array:
    """Which units belong to one of these cells."""
    for axis, refined in enumerate(axes):
        if refined:
            shape = list(cells.shape)
            shape[axis] = 2 * shape[axis] + 1
            units = np.zeros(shape, dtype=bool)
            for bounds in ((0, -1, 2), (1, None, 2), (2, None, 2)):
                units[_along(axis, *bounds)] |= cells
            cells = units
    return cells


def _nearer_corner(filled: Array, axes: Sequence[bool]) -> Array:
    """The class of a corner for every unit of the halved spacing. In a cell that is not
    divided all corners agree."""
    for axis, refined in enumerate(axes):
        if refined:
            filled = np.repeat(filled, 2, axis)[_along(axis, 0, -1)]
    return filled
