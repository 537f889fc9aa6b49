"""The numbers of a step as arrays, for whoever makes one in a loop: one lane, now and
then."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True, eq=False)
class Scheme:
    """A step evaluates the slopes at its stages, the first of which is its start; row n
    of the arrays makes stage n + 2 or, the last, the end. ``nodes`` [stages]; ``rates``
    and ``positions`` [stages, stages] are weights of the slopes, for velocities and,
    times the step, for positions; ``more_rates`` and ``more_positions`` those of pushes
    beyond. ``slopes`` and ``pushes`` say in which rows of the buffer those of each
    stage stand, and ``diagonal`` times the step is what an implicit stage relaxes by, 0
    of an explicit one."""

    nodes: Array
    rates: Array
    positions: Array
    more_rates: Array
    more_positions: Array
    slopes: tuple[int, ...]
    pushes: tuple[int, ...]
    diagonal: float = 0.0


@dataclass(frozen=True)
class OfTableau:
    """What steppers that are made from a tableau have alike: ``tableau`` holds name,
    order and numbers."""

    tableau: Any

    @property
    def name(self) -> str:
        return str(self.tableau.name)

    @property
    def order(self) -> int:
        return int(self.tableau.order)


def square(rows: Any, stages: int) -> Array:
    """Weights of unequal numbers as the rows of a square array, zeros after them."""
    found = np.zeros((stages, stages))
    for n, row in enumerate(rows):
        found[n, : len(row)] = row
    return found
