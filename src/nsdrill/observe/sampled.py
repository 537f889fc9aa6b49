"""The trajectory, sampled at regular intervals from the continuous solution: the
observer of ``simulate``."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from nsdrill.abi import MARKER, OBSERVER, Layout
from nsdrill.compiler.functions import LaneFunction, compiled, fma
from nsdrill.kernel.batch import unobserved
from nsdrill.observe.inside import position_and_velocity

# The store: number of the next sample, interval [s], capacity, time at which the run
# began [s], then the samples, each with all states.
NEXT, INTERVAL, CAPACITY, BEGAN, HEADER = range(5)


def trace_store(samples: int, interval: float, states: int) -> np.ndarray:
    """A store for ``samples`` samples of ``states`` states, ``interval`` seconds apart,
    the first at time zero."""
    store = np.zeros(HEADER + samples * states)
    store[INTERVAL], store[CAPACITY] = interval, samples
    return store


def samples_of(store: np.ndarray, states: int) -> np.ndarray:
    """The samples recorded so far, shape (samples, states)."""
    count = int(store[NEXT])
    return store[HEADER : HEADER + count * states].reshape(count, states)


@lru_cache
def make_tracer(lanes: int, rows: Layout, began: int | None = None) -> tuple[LaneFunction, LaneFunction]:
    """The compiled (observer, marker) that sample lane 0. ``began`` is the number of the
    lane parameter with the time at which a run began, where the runs of a chain are
    sampled; without one it is in the store."""
    W, N, pairs = lanes, rows.own, rows.pairs
    start_, start_rate_, end_, end_rate_, frame_rate_ = (
        W * r for r in (rows.start, rows.start_acceleration, rows.stage, rows.acceleration, rows.frame_rate)
    )
    time_, step_, moves_ = W * rows.time, W * rows.step, W * rows.moves

    @compiled(OBSERVER)
    def tracer(b, store):
        h = b[step_]
        if b[moves_] == 0.0 or h == 0.0:
            return
        interval, time = store[INTERVAL], store[BEGAN] + b[time_]
        while store[NEXT] < store[CAPACITY]:
            theta = (store[NEXT] * interval - time) / h
            if theta > 1.0 + 1e-9 * interval / h:
                return
            theta = max(min(theta, 1.0), 0.0)
            sample = HEADER + N * int(store[NEXT])
            for p in range(pairs):  # positions and velocities alternate
                x, v, a = 2 * p * W, (2 * p + 1) * W, p * W
                position, velocity = position_and_velocity(
                    b, 0, theta, h, b[frame_rate_ + a],
                    start_ + x, start_ + v, start_rate_ + a, end_ + x, end_ + v, end_rate_ + a,
                )  # fmt: skip
                store[sample + 2 * p] = position
                store[sample + 2 * p + 1] = velocity
            for k in range(2 * pairs, N):  # states of first order: the cubic through both ends
                j, a = k * W, (k - pairs) * W
                rise, d0, d1 = (b[end_ + j] - b[start_ + j], h * b[start_rate_ + a], h * b[end_rate_ + a])
                square = fma(-2.0, d0, fma(3.0, rise, -d1))
                cube = fma(-2.0, rise, d0 + d1)
                store[sample + k] = fma(theta, fma(theta, fma(theta, cube, square), d0), b[start_ + j])
            store[NEXT] += 1.0

    if began is None:
        return tracer, unobserved()[1]
    began_ = W * (rows.parameter + began)

    @compiled(MARKER)
    def mark_began(b, store, i, mark, outcome, column):
        store[BEGAN] = b[began_ + i]

    return tracer, mark_began
