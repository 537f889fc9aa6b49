"""The largest Lyapunov exponent: the mean rate at which a small deviation grows in the observed window.

The deviation is integrated along with the motion (:mod:`nsdrill.model.tangent`). Every so often it is scaled back to
length one and the logarithm of its length is added up (Benettin et al. 1980, Meccanica 15:9-20). It turns into the
fastest growing direction during the transient. Lengths are measured in the natural sizes of the states, which does not
matter for the exponent.

The window is cut in BATCHES parts of equal length; the scatter of their mean rates tells how well the exponent is known
(the standard error of the mean of batches). Nothing here knows the model: the same code measures Lorenz' system.
"""

from __future__ import annotations

import math
from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, CLOSES, OPENS, Rows, compiled
from nsdrill.elementary import lowest_bit

Array = np.ndarray[Any, np.dtype[np.float64]]
BATCHES = 20
LONGEST_CHECK = 1.0  # seconds between looks at the length: a deviation that grows a hundredfold in 10 ms still fits
# The observer's rows: when to look next, the logarithm of the length so far, its value when the batch began, looks in
# this batch, and sums over the batches.
GROWTH = ("check_time", "log_length", "log_before", "looks", "batches", "growth", "growth_square")
REPORT = ("batches", "growth", "growth_square")
# In the store: seconds between looks, looks in a batch.
INTERVAL, LOOKS = range(2)


def growth_header(observe: float) -> Array:
    """What the store must hold at ``place`` for a window of ``observe`` seconds."""
    looks = math.ceil(observe / BATCHES / LONGEST_CHECK)
    return np.array([observe / (BATCHES * looks), looks])


def seed_deviation(sizes: Array) -> Array:
    """The deviation at the start of a run, shape like ``sizes``: a bit of every state, in no special direction."""
    weights = 0.5 + np.mod(np.arange(1, sizes.shape[-1] + 1) * 0.6180339887498949, 1.0)
    return sizes * weights


def exponent_of(report: Array, observe: float) -> dict[str, Array]:
    """The exponent and its standard error [1/s] from the observer's columns, shape (runs, len(REPORT))."""
    batches, growth, square = np.asarray(report, dtype=float).T
    length = observe / BATCHES
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = growth / batches
        variance = np.maximum(square / batches - mean * mean, 0.0) * batches / (batches - 1.0)
        return {"lyapunov_exponent": growth / observe, "lyapunov_error": np.sqrt(variance / batches) / length}


@lru_cache
def make_growth(lanes: int, rows: Rows, first: int, place: int) -> tuple[Any, Any]:
    """The compiled (observer, marker) that measure the growth of the companions, which are one deviation.

    ``first`` is the place of their rows among those of the observer, ``place`` that of their header in the store.
    """
    W, own, companions = lanes, rows.own, rows.companions
    deviation_, size_ = W * (rows.stage + own), W * (rows.size + own)
    slope_, slopes = W * (rows.acceleration + rows.own_slopes), rows.own_slopes
    time_, step_, moves_, window_ = W * rows.time, W * rows.step, W * rows.moves, W * rows.window
    check_, log_, before_, looks_, batches_, growth_, square_ = (
        W * (rows.observer + first + i) for i in range(len(GROWTH)))

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
            for j in range(0, companions * W, W):
                part = b[deviation_ + j + i] / b[size_ + j + i]
                square += part * part
            now = b[time_ + i] + b[step_ + i]
            if b[step_ + i] == 0.0:
                b[log_ + i] = 0.0
                b[check_ + i] = now + store[place + INTERVAL]
                continue
            b[check_ + i] = max(b[check_ + i] + store[place + INTERVAL], now)
            if not (0.0 < square < np.inf):
                b[log_ + i] = np.nan
                continue
            b[log_ + i] += 0.5 * math.log(square)
            scale = 1.0 / math.sqrt(square)
            for j in range(0, companions * W, W):
                b[deviation_ + j + i] *= scale
            for j in range(0, slopes * W, W):
                b[slope_ + j + i] *= scale
            if b[window_ + i] != 0.0:
                b[looks_ + i] += 1.0
                if b[looks_ + i] == store[place + LOOKS]:
                    rise = b[log_ + i] - b[before_ + i]
                    b[before_ + i] = b[log_ + i]
                    b[looks_ + i] = 0.0
                    b[batches_ + i] += 1.0
                    b[growth_ + i] += rise
                    b[square_ + i] += rise * rise

    @compiled(types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64),
              W, *astuple(rows), first, place)
    def growth_marker(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        square = 0.0
        for j in range(0, companions * W, W):
            part = b[deviation_ + j + i] / b[size_ + j + i]
            square += part * part
        log = b[log_ + i] + 0.5 * math.log(square) if 0.0 < square < np.inf else np.nan
        if mark == OPENS:
            b[check_ + i] = b[time_ + i] + store[place + INTERVAL]
            b[before_ + i] = log
            for j in range(0, 4 * W, W):
                b[looks_ + j + i] = 0.0
        elif mark == CLOSES:
            # The last look falls on the end of the window, up to rounding: where it is still to come, it is taken here.
            if b[batches_ + i] < BATCHES:
                rise = log - b[before_ + i]
                b[batches_ + i] += 1.0
                b[growth_ + i] += rise
                b[square_ + i] += rise * rise
            report[column] = b[batches_ + i]
            report[column + 1] = b[growth_ + i]
            report[column + 2] = b[square_ + i]

    return growth, growth_marker
