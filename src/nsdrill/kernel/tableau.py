"""The tableau of an embedded explicit Runge-Kutta pair, and the pair of Tsitouras as
data.

Tsitouras 2011, Runge-Kutta pairs of order 5(4) satisfying only the first column
simplifying assumption, Comput. Math. Appl. 62:770-775. Fifth order with an embedded
fourth, seven stages of which the last is the first of the next step. At the same
tolerance it takes an eighth fewer steps than the pair of Dormand and Prince.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Tableau:
    """``nodes`` c, ``matrix`` a (rows of stages 2 to 7; the last is also the weights),
    ``error`` b - b*."""

    name: str
    order: int
    nodes: tuple[float, ...]
    matrix: Matrix
    error: tuple[float, ...]

    diagonal: ClassVar = 0.0  # of an implicit part, which it does not have

    @property
    def times(self) -> tuple[float, ...]:
        """The nodes of the stages after the first, the end of the step included."""
        return self.nodes[1:]

    @property
    def rates(self) -> Matrix:
        """The weights of the slopes in velocities at these times."""
        return self.matrix

    @property
    def pushes(self) -> Matrix:
        """The weights of the pushes in addition: there are none."""
        return ((),) * len(self.matrix)

    position_pushes = pushes

    @property
    def positions(self) -> Matrix:
        """The matrix for positions, which need no slopes of their own: the rate of a
        position at a stage is its rate at the start plus h ``matrix`` times the
        accelerations, so its stage value is x + c h x' + h^2 ``matrix``^2 times the
        accelerations. This is ``matrix``^2 without the last column, which is zero."""
        return tuple(self._through_stages(row) for row in self.matrix)

    @property
    def position_error(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The weights of the accelerations (all but the last) in the error of
        positions, which is h^2 times the weighted sum; and those of pushes."""
        return self._through_stages(self.error), ()

    def _through_stages(self, weights: tuple[float, ...]) -> tuple[float, ...]:
        """``weights`` times ``matrix``: weights of the slopes as weights of the
        accelerations.

        Computed exactly and rounded once: these numbers are constants of the compiled
        code, and the rounding of the built-in ``sum`` of floats is not the same in
        every Python."""
        rows = ((), *self.matrix)
        return tuple(
            float(sum(Fraction(weights[m]) * Fraction(rows[m][j]) for m in range(j + 1, len(weights))))
            for j in range(len(weights) - 1)
        )


TSITOURAS = Tableau(
    name="Tsitouras 5(4)",
    order=5,
    nodes=(0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0),
    matrix=(
        (0.161,),
        (-0.008480655492356989, 0.335480655492357),
        (2.8971530571054935, -6.359448489975075, 4.3622954328695815),
        (5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525),
        (5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401, -0.028269050394068383),
        (0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081, 2.324710524099774),
    ),
    error=(
        -0.00178001105222577714,
        -0.0008164344596567469,
        0.007880878010261995,
        -0.1447110071732629,
        0.5823571654525552,
        -0.45808210592918697,
        1 / 66,
    ),
)


# The pair of Dormand & Prince 1980, A family of embedded Runge-Kutta formulae, J.
# Comput. Appl. Math. 6:19-26: fifth order with an embedded fourth, seven stages of which
# the last is the first of the next step. It is the RK45 of SciPy and the ode45 of
# MATLAB.


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
