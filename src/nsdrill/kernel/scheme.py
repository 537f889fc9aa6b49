"""The numbers of a step as arrays, for steps that a loop over weights makes: those of
one lane, which are rare."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True, eq=False)
class Scheme:
    """The weights of a step, and where its slopes are.

    A step evaluates the slopes at its stages, the first of which is its start. Row n of
    the arrays gives stage n + 2 or, the last row, the end of the step.

    - ``nodes`` [stages];
    - ``rates`` and ``positions`` [stages, stages]: weights of the slopes, for
      velocities and, times the step, for positions;
    - ``push_rates`` and ``push_positions`` [stages, stages]: weights of the pushes in
      addition;
    - ``slopes`` and ``pushes``: the rows of the buffer that hold those of each stage;
    - ``diagonal``: times the step, the ``relax`` of an implicit stage; 0 for an
      explicit method.
    """

    nodes: Array
    rates: Array
    positions: Array
    push_rates: Array
    push_positions: Array
    slopes: tuple[int, ...]
    pushes: tuple[int, ...]
    diagonal: float = 0.0


@dataclass(frozen=True)
class TableauStepper:
    """A stepper made from a ``tableau``, which holds its name, order and numbers."""

    tableau: Any

    @property
    def name(self) -> str:
        return str(self.tableau.name)

    @property
    def order(self) -> int:
        return int(self.tableau.order)


def square(rows: Any, stages: int) -> Array:
    """Rows of weights of unequal length as a square array, filled up with zeros."""
    matrix = np.zeros((stages, stages))
    for n, row in enumerate(rows):
        matrix[n, : len(row)] = row
    return matrix
