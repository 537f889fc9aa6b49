"""CVODE of SUNDIALS through scikit-sundae: BDF with Newton's method. Its right-hand side, compiled in numba, is called
from Python, so a count of evaluations says more of it than its time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.peers import NO_OBSERVERS, MissingPeer, Result, Stopwatch
from benchmarks.peers.scalar import derivative
from benchmarks.workload import STATES, Array, Problem


class Cvode:
    def __init__(self) -> None:
        try:
            from sksundae.cvode import CVODE
        except ImportError as error:
            raise MissingPeer("pip install scikit-sundae") from error
        self.solver = CVODE
        self.name = "CVODE (scikit-sundae)"
        self.lacks = f"{NO_OBSERVERS}; RMS norm; the right-hand side is called through Python"

    def run(self, problem: Problem, rtol: float) -> Result:
        end, evaluations = np.empty((len(problem), STATES)), 0
        derivative(0.0, *problem.initial[0], problem.constants[0])  # compiled before it is timed
        with Stopwatch() as watch:
            for i in range(len(problem)):
                solver = self.solver(
                    _slopes(problem.constants[i]), rtol=rtol, atol=rtol * problem.sizes[i], max_num_steps=100_000_000
                )
                found = solver.solve(np.array([0.0, problem.duration]), problem.initial[i])
                end[i] = found.y[-1] if found.success else np.nan
                evaluations += int(found.nfev)
        return Result(watch.wall, watch.cpu, evaluations, None, end)


def _slopes(constants: Array) -> Callable[[float, Array, Array], None]:
    def slopes(t: float, y: Array, out: Array) -> None:
        out[:] = derivative(t, y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], constants)

    return slopes
