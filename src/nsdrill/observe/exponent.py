"""The largest Lyapunov exponent: the mean rate at which a small deviation grows in the
observed window.

The deviation is integrated along with the motion, by the tangent of the model. Every so
often it is scaled back to length one and the logarithm of its length is noted (Benettin
et al. 1980, Meccanica 15:9-20). It turns into the fastest growing direction during the
transient. Lengths are measured in the natural scales of the states, which does not
matter for the exponent.

The mean over the window is a weighted one: each rise of the logarithm counts by half a
wave of a sine, nothing at the window's ends. A length that goes up and down without
growing, as on a cycle or a torus, then hardly adds to the mean; the plain mean depends
on the place in the cycle at which the window begins and ends (Das et al. 2017,
Nonlinearity 30:4111-4140). For chaos it is as good as a plain mean over a window
shorter by a fifth.

The same rises, weighted by 1 to WAVES whole waves, of which a steady growth gives
nothing, tell how much comes of mere fluctuation: the spectrum of the rate at its lowest
frequencies, and with it the standard error (sine tapers: Riedel & Sidorenko 1995, IEEE
Trans. Signal Process. 43:188-195). Nothing here knows the model: the same code measures
Lorenz' system.
"""

from __future__ import annotations

import math
from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, CLOSES, OPENS, Rows, compiled
from nsdrill.elementary import lowest_bit, sincos

Array = np.ndarray[Any, np.dtype[np.float64]]
FEWEST_LOOKS = 20
# seconds between looks at the length: a deviation that grows a hundredfold in 10 ms
# still fits
LONGEST_CHECK = 1.0
WAVES = 8
# The observer's rows: when to look next, the logarithm of the length so far, its value
# and the time at the last look, when the window began, and sums over the looks.
GROWTH = (
    "check_time",
    "log_length",
    "log_before",
    "looked",
    "opened",
    "weight",
    "growth",
    *(f"wave_{k + 1}" for k in range(WAVES)),
)
REPORT = GROWTH[5:]
# In the store: seconds between looks, length of the window; after what the observers of
# a model have there first.
INTERVAL, LENGTH = range(2)
GROWTH_HEADER = 3


def growth_header(observe: float) -> Array:
    """What the store must hold at ``place`` for a window of ``observe`` seconds."""
    return np.array([observe / max(FEWEST_LOOKS, math.ceil(observe / LONGEST_CHECK)), observe])


def seed_deviation(state_scales: Array) -> Array:
    """The deviation at the start of a run, shape like ``state_scales``: a bit of every
    state, in no special direction."""
    weights = 0.5 + np.mod(np.arange(1, state_scales.shape[-1] + 1) * 0.6180339887498949, 1.0)
    return state_scales * weights


def exponent_of(report: Array, observe: float, bias: Array | float = 0.0) -> dict[str, Array]:
    """The exponent and its standard error [1/s] from the observer's columns, shape
    (runs, len(REPORT)).

    ``bias`` [1/s] is what the steps may add to the rate: it is part of the error.
    """
    weight, growth, *waves = np.asarray(report, dtype=float).T
    with np.errstate(divide="ignore", invalid="ignore"):
        # A rate of spectral density S at low frequencies gives each wave the variance S
        # observe / 2, and the mean over half a wave S pi^2 / (8 observe).
        scatter = math.pi / (2.0 * observe) * np.sqrt(np.mean(np.square(waves), axis=0))
        return {"lyapunov_exponent": growth / weight, "lyapunov_error": np.hypot(scatter, bias)}


@lru_cache
def make_growth(lanes: int, rows: Rows, first: int, place: int) -> tuple[Any, Any]:
    """The compiled (observer, marker) that measure the growth of the tangent states,
    which are one deviation.

    ``first`` is the place of their rows among those of the observer, ``place`` that of
    their header in the store.
    """
    rows = rows.of_observer
    W, own, tangent_states = lanes, rows.own, rows.tangent_states
    deviation_, scale_ = W * (rows.stage + own), W * (rows.scale + own)
    slope_, slopes = W * (rows.acceleration + rows.own_slopes), rows.own_slopes
    pushes = len(rows.pushed) // 2
    push_ = W * (rows.push + pushes)
    time_, step_, moves_, window_ = W * rows.time, W * rows.step, W * rows.moves, W * rows.window
    check_, log_, before_, looked_, opened_, weight_, growth_ = (
        W * (rows.observer + first + i) for i in range(7)
    )
    wave_ = growth_ + W

    @compiled(
        types.void(BUFFER, BUFFER, types.int64, types.float64, types.float64),
        W,
        *astuple(rows),
        first,
        place,
    )
    def add(b, store, i, log, now):  # type: ignore[no-untyped-def]
        # The rise since the last look, at the middle of the time between.
        rise, before = log - b[before_ + i], b[looked_ + i]
        turn = 2.0 * math.pi * ((0.5 * (before + now) - b[opened_ + i]) / store[place + LENGTH])
        b[before_ + i] = log
        b[looked_ + i] = now
        half, _ = sincos(0.5 * turn)
        b[weight_ + i] += half * (now - before)
        b[growth_ + i] += half * rise
        for k in range(WAVES):
            sine, _ = sincos((k + 1.0) * turn)
            b[wave_ + k * W + i] += sine * rise

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows), first, place)
    def growth(b, store):  # type: ignore[no-untyped-def]
        due = 0
        for i in range(W):
            h = b[step_ + i]
            # A step of no length shows the start of a run.
            wanted = b[time_ + i] + h >= b[check_ + i] or h == 0.0
            due |= (1 << i) if wanted and b[moves_ + i] != 0.0 else 0
        while due != 0:
            i = lowest_bit(due)
            due &= due - 1
            square = 0.0
            for j in range(0, tangent_states * W, W):
                part = b[deviation_ + j + i] / b[scale_ + j + i]
                square += part * part
            now = b[time_ + i] + b[step_ + i]
            if b[step_ + i] == 0.0:
                b[log_ + i] = 0.0
                b[check_ + i] = now + store[place + INTERVAL]
                continue
            b[check_ + i] = max(b[check_ + i] + store[place + INTERVAL], now)
            if 0.0 < square < np.inf:
                b[log_ + i] += 0.5 * math.log(square)
                scale = 1.0 / math.sqrt(square)
                for j in range(0, tangent_states * W, W):
                    b[deviation_ + j + i] *= scale
                for j in range(0, slopes * W, W):
                    b[slope_ + j + i] *= scale
                for j in range(0, pushes * W, W):
                    b[push_ + j + i] *= scale
            else:
                b[log_ + i] = np.nan
            if b[window_ + i] != 0.0:
                add(b, store, i, b[log_ + i], now)

    @compiled(
        types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64),
        W,
        *astuple(rows),
        first,
        place,
    )
    def growth_marker(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        square = 0.0
        for j in range(0, tangent_states * W, W):
            part = b[deviation_ + j + i] / b[scale_ + j + i]
            square += part * part
        log = b[log_ + i] + 0.5 * math.log(square) if 0.0 < square < np.inf else np.nan
        if mark == OPENS:
            b[check_ + i] = b[time_ + i] + store[place + INTERVAL]
            b[before_ + i] = log
            b[looked_ + i] = b[time_ + i]
            b[opened_ + i] = b[time_ + i]
            for j in range(len(REPORT)):
                b[weight_ + j * W + i] = 0.0
        elif mark == CLOSES:
            add(b, store, i, log, b[time_ + i])  # what has come since the last look, if anything
            for j in range(len(REPORT)):
                report[column + j] = b[weight_ + j * W + i]

    return growth, growth_marker
