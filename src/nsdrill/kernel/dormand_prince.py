"""The pair of Dormand & Prince 1980, A family of embedded Runge-Kutta formulae, J.
Comput. Appl. Math. 6:19-26: fifth order with an embedded fourth, seven stages of which
the last is the first of the next step. It is the RK45 of SciPy and the ode45 of
MATLAB."""

from nsdrill.kernel.tableau import Tableau

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
