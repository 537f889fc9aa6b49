"""The Runge-Kutta pair as data.

Dormand & Prince 1980, J. Comput. Appl. Math. 6:19-26; Hairer, Norsett & Wanner, Solving ODEs I, table II.5.2. Fifth
order with an embedded fourth, seven stages of which the last is the first of the next step.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tableau:
    """``nodes`` c, ``matrix`` a (rows of stages 2 to 7; the last is also the weights), ``error`` b - b*."""

    name: str
    order: int
    nodes: tuple[float, ...]
    matrix: tuple[tuple[float, ...], ...]
    error: tuple[float, ...]

    @property
    def positions(self) -> tuple[tuple[float, ...], ...]:
        """The matrix for positions, which need no slopes of their own: a position's rate at a stage is its rate at the
        start and h times what ``matrix`` makes of the accelerations, so that its stage value is x + c h x' + h^2 times
        this matrix, ``matrix`` squared, of the accelerations. Its rows lack the last column, which is zero."""
        rows = ((), *self.matrix)
        return tuple(
            tuple(sum(row[m] * rows[m][j] for m in range(j + 1, len(row))) for j in range(len(row) - 1))
            for row in self.matrix
        )

    @property
    def position_error(self) -> tuple[float, ...]:
        """The error of positions, h^2 times these weights of the accelerations (all but the last)."""
        rows = ((), *self.matrix)
        return tuple(
            sum(self.error[m] * rows[m][j] for m in range(j + 1, len(self.error))) for j in range(len(self.error) - 1)
        )


DORMAND_PRINCE = Tableau(
    name="Dormand-Prince 5(4)",
    order=5,
    nodes=(0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0),
    matrix=(
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
        (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    ),
    error=(71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40),
)
