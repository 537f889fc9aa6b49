"""SciPy's solve_ivp, the loop in Python, the right-hand side compiled; also the
reference solutions (DOP853)."""

from __future__ import annotations

import numba
import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.peers import NO_OBSERVERS, Result, Stopwatch
from benchmarks.peers.scalar import derivative
from benchmarks.workload import CONSTANTS, STATES, Array, Problem

STAGES = {"RK45": 6, "DOP853": 12}  # evaluations of a tried step


@numba.njit("float64[::1](float64, float64[::1], float64[::1])", fastmath=True, error_model="numpy")
def right_hand_side(t, y, k):  # type: ignore[no-untyped-def]
    d = np.empty(8)
    d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7] = derivative(t, y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], k)
    return d


class Scipy:
    """``solve_ivp`` with the vector absolute tolerance and the RMS norm, which it
    has."""

    def __init__(self, method: str) -> None:
        self.method = method
        self.name = f"SciPy {method}, numba right-hand side"
        self.lacks = f"{NO_OBSERVERS}; run on a few points, scaled by their share of the steps"
        right_hand_side(0.0, np.ones(STATES), np.ones(len(CONSTANTS)))

    def run(self, problem: Problem, rtol: float) -> Result:
        end = np.empty((len(problem), STATES))
        evaluations = 0
        with Stopwatch() as watch:
            for i in range(len(problem)):
                solution = solve_ivp(
                    right_hand_side,
                    (0.0, problem.duration),
                    problem.initial[i],
                    self.method,
                    rtol=rtol,
                    atol=rtol * problem.state_scales[i],
                    first_step=min(problem.first_step[i], problem.duration),
                    args=(problem.constants[i],),
                    t_eval=(problem.duration,),
                )
                end[i] = solution.y[:, -1] if solution.success else np.nan
                evaluations += solution.nfev
        return Result(watch.wall, watch.cpu, evaluations, evaluations // STAGES[self.method], end)


def reference(problem: Problem, rtol: float = 1e-12) -> Array:
    """The states at the end by DOP853, of eighth order: nothing in common with the
    pairs that race."""
    return Scipy("DOP853").run(problem, rtol).end
