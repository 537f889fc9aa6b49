"""The Runge-Kutta pairs as data: two explicit ones, and an additive one, in which friction
is implicit and all else explicit. Sources stand beside the numbers. A new pair is a table
here and a line in :mod:`nsdrill.kernel.steppers`.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property

from nsdrill.records import dataclass

Matrix = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Pair:
    """The tableau of an embedded pair: ``nodes`` c, with the end of the step as the last,
    ``matrix`` a (the rows of stages 2 to the last, and the weights b, which are those of
    the last stage where that is the first of the next step), ``error`` b - b*.

    In an additive pair friction is implicit and all else explicit, the ``matrix``;
    ``implicit`` has the rows of stages 2 to the last, which end with the diagonal, and
    the weights of both parts are the same. The acceleration of a velocity is the sum of a
    part without friction and a *push*, the part of the friction at contacts. Only friction
    that is steep in the slip speed makes an explicit method slow. A stage of the implicit
    part is

        V = V* + h g push(X, V)

    with V* and the positions X known from the stages before (positions are explicit), so
    the right-hand side solves for the slip speeds alone, one or two of them
    (:class:`nsdrill.abi.Layout`, ``relax`` = h g). Three points make it work:

    - The loads that the right-hand side returns agree with the velocities to rounding, so
      steepness amplifies no error.
    - The end of the step is solved once more, y = y0 + h sum b_j f_j + h g (push(y) -
      push_last): the end of an additive pair does not satisfy the balance of friction, and
      the next step would begin with noise. The difference of the two pushes belongs to the
      error.
    - Positions take pushes through the implicit matrix: h^2 A_E A_I. With A_E A_E in its
      place the order is the same and the error in rolling a hundred times larger.

    Source of the method: Kennedy & Carpenter 2003, Additive Runge-Kutta schemes for
    convection-diffusion-reaction equations, Appl. Numer. Math. 44:139-181. A slope row has
    the whole slope and a push row its push, so that a sum over stages has the explicit
    weights of slopes and the difference of the two matrices as weights of pushes.
    """

    name: str
    order: int
    nodes: tuple[float, ...]
    matrix: Matrix
    error: tuple[float, ...]
    implicit: Matrix = ()

    @property
    def diagonal(self) -> float:
        """The implicit part's coefficient on the diagonal, 0 where there is none."""
        return self.implicit[0][-1] if self.implicit else 0.0

    @property
    def times(self) -> tuple[float, ...]:
        """The nodes of the stages after the first, the end of the step included."""
        return self.nodes[1:]

    @cached_property
    def pushes(self) -> Matrix:
        """The weights of the pushes in addition to ``matrix``, those of the whole slopes,
        in velocities at these times: the implicit matrix minus the explicit one, without
        the diagonal; at the end that of the last stage."""
        if not self.implicit:
            return ((),) * len(self.matrix)
        rows = (
            tuple(float(Fraction(a) - Fraction(b)) for a, b in zip(implicit[:-1], explicit, strict=True))
            for implicit, explicit in zip(self.implicit, self.matrix[:-1], strict=True)
        )
        return (*rows, (*(0.0,) * len(self.implicit), -self.diagonal))

    @cached_property
    def positions(self) -> Matrix:
        """The matrix for positions, which need no slopes of their own: the rate of a
        position at a stage is its rate at the start plus h ``matrix`` times the
        accelerations, so its stage value is x + c h x' + h^2 ``matrix``^2 times the
        accelerations. This is ``matrix``^2 without the last column, which is zero."""
        return tuple(self._through(row) for row in self.matrix)

    @cached_property
    def position_pushes(self) -> Matrix:
        """The weights of the pushes in positions, added to :attr:`positions`: the
        explicit weights times the difference of the implicit and the explicit matrix.
        With the diagonal, so one column more."""
        return tuple(self._pushes_through(row) for row in self.matrix)

    @cached_property
    def position_error(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The weights of the accelerations (all but the last) in the error of positions,
        which is h^2 times the weighted sum; and those of pushes in addition."""
        return self._through(self.error), self._pushes_through(self.error)

    def _through(self, weights: tuple[float, ...]) -> tuple[float, ...]:
        """``weights`` of the stages times ``matrix``: weights of the slopes as weights of
        the accelerations, without the last, which is zero."""
        return tuple(float(value) for value in _exact(weights, self.matrix))[:-1]

    def _pushes_through(self, weights: tuple[float, ...]) -> tuple[float, ...]:
        if not self.implicit:
            return ()
        both = zip(_exact(weights, self.implicit), _exact(weights, self.matrix), strict=True)
        return tuple(float(implicit - explicit) for implicit, explicit in both)


def _exact(weights: tuple[float, ...], matrix: Matrix) -> tuple[Fraction, ...]:
    """``weights`` of the stages times the rows of ``matrix``, of stages 2 to the last.

    Computed exactly, to be rounded once: these numbers are constants of the compiled code,
    and the rounding of the built-in ``sum`` of floats is not the same in every Python."""
    rows = ((), *matrix)
    return tuple(
        sum((Fraction(weights[m]) * Fraction(rows[m][j]) for m in range(len(weights)) if j < len(rows[m])), Fraction(0))
        for j in range(len(weights))
    )


# Tsitouras 2011, Runge-Kutta pairs of order 5(4) satisfying only the first column
# simplifying assumption, Comput. Math. Appl. 62:770-775. Fifth order with an embedded
# fourth, seven stages of which the last is the first of the next step. At the same
# tolerance it takes an eighth fewer steps than the pair of Dormand and Prince.
TSITOURAS = Pair(
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
DORMAND_PRINCE = Pair(
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


# ARK4(3)7L[2]SA of Kennedy & Carpenter 2019, Higher-order additive Runge-Kutta schemes for
# ordinary differential equations, Appl. Numer. Math. 136:183-205; the numbers as SUNDIALS 7
# tabulates them. Fourth order with an embedded third, seven stages; the implicit part is
# stiffly accurate and L-stable, and has the same coefficient on the diagonal at all
# stages but the first.
_KC_WEIGHTS = (0.0, 0.0, 0.5161107283174237, -0.1460635639385708, 0.23473048589019332, 0.27172234973095377, 0.1235)
_KC_EMBEDDED = (0.0, 0.0, 0.5175217461593482, -0.15173820706113939, 0.23672007870234135, 0.2754463821994498, 0.12205)
KENNEDY_CARPENTER = Pair(
    name="ARK4(3)7L[2]SA",
    order=4,
    nodes=(0.0, 0.247, 0.42165537495307726, 0.335, 0.075, 0.7, 1.0, 1.0),
    matrix=(
        (0.247,),
        (0.06175, 0.35990537495307723),
        (0.05301658458687121, 0.3594926452932843, -0.07750922988015546),
        (0.0584171594478, -0.16313824817772324, -0.1973209097979841, 0.3770419985279074),
        (0.538530322708108, -0.4549774689591667, 1.256290562342994, -0.47828452721130055, -0.16155888888063494),
        (
            0.23221715782277083,
            0.23221715782277083,
            -6.809994375038098,
            7.3618585524244216,
            -1.374879077940698,
            1.3585805849088326,
        ),
        _KC_WEIGHTS,
    ),
    error=tuple(float(Fraction(b) - Fraction(embedded)) for b, embedded in zip(_KC_WEIGHTS, _KC_EMBEDDED, strict=True)),
    implicit=(
        (0.1235, 0.1235),
        (0.14907768747653863, 0.14907768747653863, 0.1235),
        (0.12483442871739439, 0.12483442871739439, -0.03816885743478878, 0.1235),
        (-0.07303194030218091, -0.07303194030218091, -0.2434356871601467, 0.3409995677645085, 0.1235),
        (
            -0.15296500088128806,
            -0.15296500088128806,
            0.07220562047433587,
            0.40430630248551713,
            0.4059180788027232,
            0.1235,
        ),
        (0.0, 0.0, 0.5161107283174237, -0.1460635639385708, 0.23473048589019332, 0.27172234973095377, 0.1235),
    ),
)
