"""Adaptive refinement of a grid: level by level, wherever neighbouring responses
differ; and reruns of points from given states.

Pure logic on arrays. A *unit* is what is run as a whole, a point or a carried chain;
its *class* is a number that two units share if their responses are the same. The
result depends on the classes only, not on the order in which units were run or on
interruptions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nsdrill.data import Array
from nsdrill.kernel.batch import FinishedRuns, Runs
from nsdrill.kernel.settings import Simulation
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.plan import Chosen
from nsdrill.sweep.work import Work

_NO_CLASS = np.iinfo(np.int64).max  # greater than any class


@dataclass(frozen=True)
class Refinement:
    """The state of a refinement: ``needed`` (bool, grid) are the units that must be run
    as far as is known, at ``level`` (0: the coarse grid). When all of them are known,
    ``filled`` (int, grid) has a class for every unit, run or not."""

    needed: Array
    level: int
    filled: Array | None = None


def refine(classes: Array, known: Array, axes: Sequence[bool], depth: int, *, everything: bool = False) -> Refinement:
    """Repeat the refinement of a grid from the units that are known.

    ``classes`` (int, fine grid) has the class of each unit for which ``known`` (bool,
    fine grid) is true. ``axes`` (bool) are the axes of the grid that are refined,
    ``depth`` times; along these n values of the coarse grid become
    (n - 1) 2^depth + 1. For each value of the other axes there is a separate grid.

    Every level halves the spacing. A cell is divided, and all units of the divided cell
    are needed, if two of the known units on its corners, edges and faces at the halved
    spacing have different classes. So a unit of another class on the edge of an
    adjacent cell divides that cell too, until nothing changes. A unit that is not
    needed has, when all needed ones are known, the class of those around it.

    Units count only when they are needed, so that superfluous ones change nothing. With
    ``everything`` all known units count at the end, at the finest spacing. Not before:
    a unit on the coarse grid that only a finer level needed must not divide a cell of
    the coarse grid.
    """
    needed = np.zeros(classes.shape, dtype=bool)
    corners = _every(axes, 2)
    at_spacing = _every(axes, 2**depth)
    needed[at_spacing] = True
    if (needed & ~known).any():
        return Refinement(needed, 0)
    filled = classes[at_spacing]
    for level in range(1, depth + 1):
        at_spacing = _every(axes, 2 ** (depth - level))
        divided: Array | None = None
        while True:
            counted = known[at_spacing] if everything and level == depth else needed[at_spacing] & known[at_spacing]
            low, high = (
                np.where(counted, classes[at_spacing], _NO_CLASS),
                np.where(counted, classes[at_spacing], -_NO_CLASS),
            )
            low[corners] = np.where(counted[corners], low[corners], filled)
            high[corners] = np.where(counted[corners], high[corners], filled)
            differs = _over_cells(low, axes, np.minimum) != _over_cells(high, axes, np.maximum)
            divided = differs if divided is None else divided | differs
            in_divided = _units_of(divided, axes)
            if not (in_divided & ~needed[at_spacing]).any():
                break
            needed[at_spacing] |= in_divided
            if (needed & ~known).any():
                return Refinement(needed, level)
        filled = np.where(counted, classes[at_spacing], _nearer_corner(filled, axes))
    return Refinement(needed, depth, filled)


def _every(axes: Sequence[bool], step: int) -> tuple[slice, ...]:
    """The index of every ``step``-th value of the refined axes, and of all values of
    the others."""
    return tuple(slice(None, None, step) if refined else slice(None) for refined in axes)


def _along(axis: int, *bounds: int | None) -> tuple[slice, ...]:
    return (*[slice(None)] * axis, slice(*bounds))


def _over_cells(values: Array, axes: Sequence[bool], join: np.ufunc) -> Array:
    """``join`` of all units of each cell: three along every refined axis, the outer of
    which are shared with the adjacent cells."""
    for axis, refined in enumerate(axes):
        if refined:
            parts = [values[_along(axis, *bounds)] for bounds in ((0, -1, 2), (1, None, 2), (2, None, 2))]
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
    """The class of a corner of its cell for every unit of the halved spacing. In a cell
    that is not divided all corners have the same class."""
    for axis, refined in enumerate(axes):
        if refined:
            filled = np.repeat(filled, 2, axis)[_along(axis, 0, -1)]
    return filled


# Points of a sweep that are run again, each separately, from given states.


@dataclass(frozen=True, kw_only=True)
class Rerun(Work):
    """The points ``point_numbers`` (ascending) of a sweep, from ``start_states``
    [points, states]. Carried states are given like all others, so there are no chains.
    Each point is integrated by the same method as in the sweep, ``sweep_choice``."""

    point_numbers: Array
    start_states: Array
    sweep_choice: Chosen

    @classmethod
    def of(cls, work: Work, simulation: Simulation, point_numbers: Array, states: Array) -> Rerun:
        """The same model with another ``simulation`` time or tolerance, recording
        features only."""
        return cls(
            replace(work.plan, along=None),
            work.parameters,
            work.initial,
            simulation,
            work.thresholds,
            Record(peaks=0),
            work.model,
            point_numbers=point_numbers,
            start_states=states,
            sweep_choice=work.chosen,
        )

    @property
    def chosen(self) -> Chosen:
        return self.sweep_choice

    def prepare(self, points: Array) -> Runs:
        """The runs of these points."""
        return replace(
            super().prepare(points),
            initial=self.to_own_states(self.start_states[np.searchsorted(self.point_numbers, points)]),
        )

    def columns(self, done: FinishedRuns) -> dict[str, Array]:
        """Status and features of finished runs, and the natural scales of the
        features."""
        return {"status": done.status, **self.measured(done), **self.kind.scales(done.parameters)}
