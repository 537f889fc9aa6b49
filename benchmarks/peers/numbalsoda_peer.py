"""numbalsoda: LSODA and DOP853 in compiled code, right-hand side and loop over the
points in numba.

It takes one scalar tolerance, so the states are integrated in units of their scales:
|y|/size against 1 is then what the vector tolerance asks.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numba
import numpy as np

from benchmarks.peers import NO_OBSERVERS, SCALAR_TOLERANCE, MissingPeer, Result, Stopwatch
from benchmarks.peers.scalar import derivative
from benchmarks.workload import CONSTANTS, STATES, Problem

K = len(CONSTANTS)
SIZES, COUNT = K, K + STATES  # places in the data that the right-hand side is given


class NumbaLsoda:
    def __init__(self, method: str) -> None:
        # Fortran must print at once, while it is muted, and not at the end of the
        # process.
        os.environ.setdefault("GFORTRAN_UNBUFFERED_PRECONNECTED", "1")
        try:
            import numbalsoda
        except ImportError as error:
            raise MissingPeer("pip install numbalsoda (builds from source: a C++ and a Fortran compiler)") from error
        self.method = method
        self.name = f"numbalsoda {method}"
        norm = "its own norm" if method == "lsoda" else "RMS norm"
        self.lacks = f"{NO_OBSERVERS}; {SCALAR_TOLERANCE}; {norm}"
        self._batch = _compile(numbalsoda, method)

    def run(self, problem: Problem, rtol: float) -> Result:
        data = np.concatenate([problem.constants, problem.state_scales, np.zeros((len(problem), 1))], axis=1)
        scaled = problem.initial / problem.state_scales
        times = np.array([0.0, problem.duration])
        with _mute(), Stopwatch() as watch:
            end = self._batch(scaled, times, data, rtol)
        evaluations = int(data[:, COUNT].sum())
        steps = evaluations // 12 if self.method == "dop853" else None
        return Result(watch.wall, watch.cpu, evaluations, steps, end * problem.state_scales)


@contextmanager
def _mute() -> Iterator[None]:
    """Drops what DOP853 prints where it suspects stiffness."""
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


_COMPILED: dict[str, Any] = {}


def _compile(numbalsoda: Any, method: str) -> Any:
    if method in _COMPILED:
        return _COMPILED[method]

    @numba.cfunc(numbalsoda.lsoda_sig, fastmath=True, error_model="numpy")
    def right_hand_side(t, scaled, d, data):  # type: ignore[no-untyped-def]
        k = numba.carray(data, (K + STATES + 1,))
        y, slope = numba.carray(scaled, (STATES,)), numba.carray(d, (STATES,))
        k[COUNT] += 1.0
        slopes = derivative(
            t,
            y[0] * k[SIZES],
            y[1] * k[SIZES + 1],
            y[2] * k[SIZES + 2],
            y[3] * k[SIZES + 3],
            y[4] * k[SIZES + 4],
            y[5] * k[SIZES + 5],
            y[6] * k[SIZES + 6],
            y[7] * k[SIZES + 7],
            k,
        )
        for i in range(STATES):
            slope[i] = slopes[i] / k[SIZES + i]

    address = right_hand_side.address
    solver = getattr(numbalsoda, method)

    @numba.njit
    def batch(initial, times, data, rtol):  # type: ignore[no-untyped-def]
        end = np.empty_like(initial)
        for i in range(len(initial)):
            solution, ok = solver(address, initial[i], times, data[i], rtol, rtol, 100_000_000)
            end[i] = solution[-1] if ok else np.full(STATES, np.nan)
        return end

    _COMPILED[method] = batch
    ones = np.ones((1, K + STATES + 1))
    batch(np.zeros((1, STATES)), np.array([0.0, 1e-3]), ones, 1e-3)
    return batch
