"""From axes to points to chains: the operating points of a sweep, the order in which the
state is carried, which points are integrated implicitly, and which of a refined grid are
run.

Points are numbered over (procedure, axes), the last axis fastest. Where every operating
point is run with several samples of uncertain numbers, or from several starts, each of
these is a point, and their index varies fastest. A chain is a sequence of points along
which the state is carried; every other point is a chain by itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Any, Self

import numpy as np

from nsdrill.data import Array
from nsdrill.models.friction import implicit
from nsdrill.models.model_description import Description
from nsdrill.models.parts import values_in_parts
from nsdrill.models.starts import Starts
from nsdrill.records import dataclass
from nsdrill.variables import dimension_of, ways_of


@dataclass(frozen=True)
class Plan:
    """The points of a sweep.

    - ``axes``: the ascending values in SI of each axis by its key, in order;
    - ``procedure``: same, up, down, up-down or all;
    - ``along``: the key of the axis along which the state is carried;
    - ``starts``: the number of states from which each operating point is started, 0
      where it is one; several with procedure same only;
    - ``drawn``: the samples of the uncertain numbers by key, arrays of the same length.
      A state is carried along an axis in each sample separately.

    Up-down is one chain: up to the end and back down from there, so that the end point
    is run twice. All is that chain, and every point of it from the same state as well.
    Chains along which a state is carried come first and have one length.
    """

    axes: dict[str, Array]
    procedure: str
    along: str | None
    starts: int = 0
    drawn: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.starts and self.drawn:
            raise ValueError(f"starts: found {self.starts} with samples of uncertain numbers, allowed: one of the two")
        if self.starts and self.procedure != "same":
            raise ValueError(f"starts: found {self.starts} with procedure {self.procedure}, allowed: with same")

    @cached_property
    def procedures(self) -> tuple[str, ...]:
        """How every operating point is reached, in the order of the points."""
        return ways_of(self.procedure)

    @cached_property
    def samples(self) -> int:
        """The number of samples of the uncertain numbers with which every operating
        point is run; 0 where none is uncertain."""
        return len(next(iter(self.drawn.values()))) if self.drawn else 0

    @property
    def varied(self) -> dict[str, Array]:
        """The values of every number that varies between points, by key."""
        return {**self.axes, **self.drawn}

    @property
    def dimensions(self) -> dict[str, Array]:
        """The values of each axis by the name of its dimension."""
        return {dimension_of(key): values for key, values in self.axes.items()}

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """(procedures, values of each axis), and the number of samples where numbers
        are uncertain."""
        axes = (len(values) for values in self.axes.values())
        return len(self.procedures), *axes, *([self.samples] if self.samples else [])

    @cached_property
    def grid(self) -> tuple[int, ...]:
        """The shape over which points are numbered."""
        return (*self.shape, self.starts) if self.starts else self.shape

    @property
    def points(self) -> int:
        return int(np.prod(self.grid))

    @cached_property
    def chain_length(self) -> int:
        """The number of points in a chain along which a state is carried; 1 where none is."""
        if self.along is None:
            return 1
        return max(1, len(self.axes[self.along]) * sum(way != "same" for way in self.procedures))

    @property
    def carried(self) -> bool:
        """Whether a state is carried from point to point."""
        return self.chain_length > 1

    @cached_property
    def carried_points(self) -> int:
        """The number of points in chains along which a state is carried. They have the
        first numbers."""
        if not self.carried:
            return 0
        return self.points // len(self.procedures) * sum(way != "same" for way in self.procedures)

    @cached_property
    def carried_chains(self) -> int:
        """The number of chains along which a state is carried. They have the first
        numbers."""
        return self.carried_points // self.chain_length

    @property
    def chains(self) -> int:
        return self.carried_chains + self.points - self.carried_points

    @property
    def abreast(self) -> int:
        """The number of points that are run side by side from the beginning to the end of
        the longest chain."""
        return -(-self.points // self.chain_length)

    def lengths(self, chains: Array | int) -> Array:
        """The number of points in each of these chains."""
        return np.where(np.asarray(chains) < self.carried_chains, self.chain_length, 1)

    def points_of(self, chain: Array | int, place: Array | int) -> Array:
        """Numbers of the points at these places of these chains (arrays that broadcast
        together), which have them."""
        chain, place = np.broadcast_arrays(np.asarray(chain), np.asarray(place))
        if not self.carried:
            return np.asarray(chain)
        alone = chain - self.carried_chains
        return np.where(
            alone >= 0, self.carried_points + alone, self._carried_points_of(np.where(alone < 0, chain, 0), place)
        )

    def _carried_points_of(self, chain: Array, place: Array) -> Array:
        assert self.along is not None
        _, *lengths = self.shape
        axis = list(self.axes).index(self.along)
        n = lengths[axis]
        others = [length if i != axis else 1 for i, length in enumerate(lengths)]
        position = list(np.unravel_index(chain, others))
        # On the way back, and in a down-sweep, the axis runs from its end.
        second = place >= n
        backward = second | (self.procedure == "down")
        step = np.where(second, place - n, place)
        position[axis] = np.where(backward, n - 1 - step, step)
        return np.asarray(np.ravel_multi_index((second.astype(np.int64), *position), self.shape))

    def units(self) -> Array:
        """The numbers of the points that a refinement runs as a whole: each by itself, or
        where a state is carried a chain and, after it, the points of the same values that
        are no part of it [units, points of each]."""
        if not self.carried:
            return np.arange(self.points)[:, None]
        chains = np.arange(self.carried_chains)
        points = self.points_of(chains[:, None], np.arange(self.chain_length))
        if self.carried_points == self.points:
            return points
        n = len(self.axes[str(self.along)])
        return np.concatenate([points, points[:, :n] + self.carried_points], axis=1)

    def chains_of(self, units: Array) -> Array:
        """The chains of the points of these :meth:`units`, numbers of them."""
        if not self.carried or self.carried_points == self.points:
            return units
        alone = self.units()[units][:, self.chain_length :].ravel()
        return np.concatenate([units, alone - self.carried_points + self.carried_chains])

    def values(self, points: Array) -> dict[str, Array]:
        """The values of every axis, and of the uncertain numbers, at these points."""
        _, *indices = np.unravel_index(points, self.grid)
        on_axes = {name: values[index] for (name, values), index in zip(self.axes.items(), indices, strict=False)}
        return on_axes | {name: values[indices[len(self.axes)]] for name, values in self.drawn.items()}

    def starts_of(self, points: Array) -> Array:
        """The numbers of the starts of these points."""
        return np.asarray(points) % max(self.starts, 1)

    def find(
        self, wanted: Mapping[str, float], procedure: str, start: int = 0, sample: int = 0
    ) -> tuple[int, dict[str, float]]:
        """The number of the point nearest to the values ``wanted`` of all axes in a
        procedure, and its values, with those of the uncertain numbers. ValueError for a
        procedure, a start or a sample that does not exist."""
        if not 0 <= sample < max(self.samples, 1):
            raise ValueError(f"sample: found {sample}; allowed: 0 to {max(self.samples, 1) - 1}")
        if not 0 <= start < max(self.starts, 1):
            raise ValueError(f"start: found {start}; allowed: 0 to {max(self.starts, 1) - 1}")
        if procedure not in self.procedures:
            raise ValueError(f"procedure: found {procedure}; allowed: {', '.join(self.procedures)}")
        nearest = [int(np.argmin(np.abs(values - wanted[name]))) for name, values in self.axes.items()]
        point_values = {name: float(values[i]) for (name, values), i in zip(self.axes.items(), nearest, strict=True)}
        point_values |= {name: float(values[sample]) for name, values in self.drawn.items()}
        index = (self.procedures.index(procedure), *nearest, *([sample] if self.samples else []))
        number = int(np.ravel_multi_index(index, self.shape)) * max(self.starts, 1) + start
        return number, point_values


# Points that do not form a grid, such as measurements: each has its own values.


@dataclass(frozen=True)
class Rows(Plan):
    """One point for each row of a table: ``axes`` has the values of each key, including
    those of the operation, arrays [rows]. The rows are in order of ascending speed: the
    engine begins with the last ones, and fast rotation takes the most steps."""

    @classmethod
    def of(cls, table: dict[str, Array]) -> tuple[Self, Array]:
        """The rows of ``table``, and the index of each in it: [rows]."""
        last = "rotary_speed" if "rotary_speed" in table else next(reversed(table))
        order = np.argsort(table[last], kind="stable")
        others = {key: table[key][order] for key in table if key != last}
        return cls({**others, last: table[last][order]}, "same", None), order

    @cached_property
    def shape(self) -> tuple[int, ...]:
        return (*[1] * len(self.axes), len(next(iter(self.axes.values()))))

    def values(self, points: Array) -> dict[str, Array]:
        return {key: values[points] for key, values in self.axes.items()}


# Which points of a sweep are integrated implicitly. Imports no compiler.


_BLOCK = 1 << 16  # points decided at once


@dataclass(frozen=True)
class Chosen:
    """The choice of the method for the points of a plan, by the key
    ``simulation.method`` of a study of this model."""

    plan: Plan
    parameters: Any
    initial: Starts
    model: Description
    method: str

    def points(self, points: Array) -> Array:
        """Whether each of these points is integrated implicitly, shape (n,): by the
        study's method or, with ``auto``, where friction is steep."""
        points = np.asarray(points)
        values, is_implicit = self.plan.values(points), np.zeros(np.shape(points), dtype=bool)
        for at, part in values_in_parts(self.model, self.parameters, self.initial, values):
            is_implicit[part] = implicit(self.method, self.model, at)
        return is_implicit

    def words(self) -> tuple[str, ...]:
        """The methods that the whole plan uses: explicit, implicit, or both."""
        if self.method == "explicit":
            return ("explicit",)
        choices: set[bool] = set()
        for first in range(0, self.plan.points, _BLOCK):
            block = np.arange(first, min(first + _BLOCK, self.plan.points))
            choices |= set(self.points(block).tolist())
        return tuple(word for word, value in (("explicit", False), ("implicit", True)) if value in choices)


# Adaptive refinement of a grid: level by level, wherever neighbouring responses differ.
# Pure logic on arrays. A *unit* is what is run as a whole, a point or a carried chain; its
# *class* is a number that two units share if their responses are the same. The result
# depends on the classes only, not on the order in which units were run or on interruptions.


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
