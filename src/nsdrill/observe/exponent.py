"""The largest Lyapunov exponent: the mean rate at which a small deviation grows during
the observation.

The deviation is integrated with the motion, by the tangent of the model. At intervals
it is renormalised to length one and the logarithm of its length is recorded (Benettin
et al. 1980, Meccanica 15:9-20). During the transient it aligns with the direction of
fastest growth. Lengths are measured in the natural scales of the states; the exponent
does not depend on that choice.

The mean over the observation is weighted: each increment of the logarithm has the
weight of half a period of a sine, which is zero at both ends. A length that oscillates
without growing, as on a cycle or a torus, then contributes little to the mean, whereas
the plain mean depends on the phases of the cycle at which the observation begins and
ends (Das et al. 2017, Nonlinearity 30:4111-4140). For chaos the weighted mean is as
accurate as a plain mean over an observation shorter by a fifth.

The same increments, weighted by 1 to WAVES whole periods of a sine, to which a steady
growth contributes nothing, give the spectrum of the growth rate at its lowest
frequencies, and from it the standard error (sine tapers: Riedel & Sidorenko 1995, IEEE
Trans. Signal Process. 43:188-195). The code does not depend on the model: it also
measures Lorenz' system.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, reduce

import numpy as np

from nsdrill.abi import CLOSES, MARKER, OBSERVER, OPENS, Layout
from nsdrill.compiler.functions import BUFFER, FLOAT, INTEGER, LaneFunction, compiled, inlined, lowest_bit, packed
from nsdrill.data import Array
from nsdrill.elementary import log, sincos

LEAST_RENORMALISATIONS = 20
# seconds between renormalisations: within this time a deviation that grows a
# hundredfold in 10 ms does not overflow
LONGEST_INTERVAL = 1.0
WAVES = 8
# The observer's rows: the time of the next renormalisation, the logarithm of the length
# so far, its value and the time at the last one, when the observation began, and sums
# over the renormalisations.
GROWTH = (
    "next_time",
    "log_length",
    "last_log_length",
    "last_time",
    "began",
    "weight",
    "growth",
    *(f"wave_{k + 1}" for k in range(WAVES)),
)
GROWTH_COLUMNS = GROWTH[5:]  # of the outcome
# In the store: seconds between renormalisations, observation time [s]. The store of the
# model's observer begins with GROWTH_HEADER entries of its own, before these.
INTERVAL, DURATION = range(2)
GROWTH_HEADER = 3


def growth_header(observe: float) -> Array:
    """The entries of the store, from ``place`` on, for ``observe`` seconds of
    observation."""
    return np.array([observe / max(LEAST_RENORMALISATIONS, math.ceil(observe / LONGEST_INTERVAL)), observe])


def seed_deviation(state_scales: Array) -> Array:
    """The deviation at the start of a run, shape of ``state_scales``: all states
    deviate, in no special direction."""
    weights = 0.5 + np.mod(np.arange(1, state_scales.shape[-1] + 1) * 0.6180339887498949, 1.0)
    return state_scales * weights


def exponent_of(outcome: Array, observe: float, bias: Array | float = 0.0) -> dict[str, Array]:
    """The exponent and its standard error [1/s] from the observer's outcome, shape
    (runs, len(GROWTH_COLUMNS)).

    ``bias`` [1/s] is the possible contribution of the steps' errors to the rate: it is
    part of the error.
    """
    weight, growth, *waves = np.asarray(outcome, dtype=float).T
    with np.errstate(divide="ignore", invalid="ignore"):
        # A rate of spectral density S at low frequencies gives each sum over whole
        # periods the variance S observe / 2, and the mean S pi^2 / (8 observe).
        # Added one after the other: numpy adds those of a single run in another order.
        squares = reduce(np.add, (wave * wave for wave in waves)) / len(waves)
        scatter = math.pi / (2.0 * observe) * np.sqrt(squares)
        return {"lyapunov_exponent": growth / weight, "lyapunov_error": np.hypot(scatter, bias)}


@lru_cache
def make_growth(lanes: int, rows: Layout, first: int, place: int) -> tuple[LaneFunction, LaneFunction]:
    """The compiled (observer, marker) that measure the growth of the tangent states,
    which are one deviation.

    ``first`` is the position of their rows among those of the observer, ``place`` that
    of their header in the store.
    """
    W, step_, moves_, time_ = lanes, lanes * rows.step, lanes * rows.moves, lanes * rows.time
    observing_, columns = lanes * rows.observing, len(GROWTH_COLUMNS)
    next_time_, log_, last_log_, last_time_, began_, weight_ = (W * (rows.observer + first + k) for k in range(6))
    squared_length, shorten = _of_deviation(lanes, rows)
    add = _addition(lanes, W * (rows.observer + first), place)

    @compiled(OBSERVER)
    def growth(b, store):
        due = 0
        for i in packed(W):
            h = b[step_ + i]
            # A step of length zero is the start of a run.
            is_due = b[time_ + i] + h >= b[next_time_ + i] or h == 0.0
            due |= (1 << i) if is_due and b[moves_ + i] != 0.0 else 0
        while due != 0:
            i = lowest_bit(due)
            due &= due - 1
            now = b[time_ + i] + b[step_ + i]
            if b[step_ + i] == 0.0:
                b[log_ + i] = 0.0
                b[next_time_ + i] = now + store[place + INTERVAL]
                continue
            b[next_time_ + i] = max(b[next_time_ + i] + store[place + INTERVAL], now)
            square = squared_length(b, i)
            if 0.0 < square < np.inf:
                b[log_ + i] += 0.5 * log(square)
                shorten(b, i, 1.0 / math.sqrt(square))
            else:
                b[log_ + i] = np.nan
            if b[observing_ + i] != 0.0:
                add(b, store, i, b[log_ + i], now)

    @compiled(MARKER)
    def growth_marker(b, store, i, mark, outcome, column):
        square = squared_length(b, i)
        length = b[log_ + i] + 0.5 * log(square) if 0.0 < square < np.inf else np.nan
        if mark == OPENS:
            b[next_time_ + i] = b[time_ + i] + store[place + INTERVAL]
            b[last_log_ + i] = length
            b[last_time_ + i] = b[time_ + i]
            b[began_ + i] = b[time_ + i]
            for j in range(columns):
                b[weight_ + j * W + i] = 0.0
        elif mark == CLOSES:
            add(b, store, i, length, b[time_ + i])  # since the last renormalisation, if any
            for j in range(columns):
                outcome[column + j] = b[weight_ + j * W + i]

    return growth, growth_marker


def _of_deviation(lanes: int, rows: Layout) -> tuple[Callable[..., float], Callable[..., None]]:
    """The functions ``squared_length(b, i)``, in natural scales, and ``shorten(b, i,
    scale)`` of the deviation of a lane, which are written out."""
    W, end = lanes, lanes * rows.tangent_states
    deviation_, scale_ = W * (rows.stage + rows.own), W * (rows.scale + rows.own)
    pushes = len(rows.pushed) // 2
    parts = (
        (deviation_, end),
        (W * (rows.acceleration + rows.own_slopes), W * rows.own_slopes),
        (W * (rows.push + pushes), W * pushes),
    )

    @inlined
    def squared_length(b, i):
        total = 0.0
        for j in range(0, end, W):
            component = b[deviation_ + j + i] / b[scale_ + j + i]
            total += component * component
        return total

    @inlined
    def shorten(b, i, scale):
        for part_, part_end in parts:
            for j in range(0, part_end, W):
                b[part_ + j + i] *= scale

    return squared_length, shorten


def _addition(lanes: int, first_: int, place: int) -> LaneFunction:
    """The compiled function that adds what the logarithm of the length has grown since
    the last renormalisation, at the middle of the interval; ``first_`` is the offset of
    the rows of GROWTH."""
    W = lanes
    last_log_, last_time_, began_, weight_, growth_, wave_ = (first_ + k * W for k in range(2, 8))

    @compiled(BUFFER, BUFFER, INTEGER, FLOAT, FLOAT)
    def add(b, store, i, log, now):
        rise, before = log - b[last_log_ + i], b[last_time_ + i]
        angle = 2.0 * math.pi * ((0.5 * (before + now) - b[began_ + i]) / store[place + DURATION])
        b[last_log_ + i] = log
        b[last_time_ + i] = now
        half, _ = sincos(0.5 * angle)
        b[weight_ + i] += half * (now - before)
        b[growth_ + i] += half * rise
        for k in range(WAVES):
            sine, _ = sincos((k + 1.0) * angle)
            b[wave_ + k * W + i] += sine * rise

    return add
