"""How a run touches: of each contact the least and the greatest value of its function,
and how often it begins.

A contact function is positive where the contact touches
(:class:`nsdrill.models.base.Model`). Between steps it is followed by the quintic
through its values and rates, so a visit or a loss inside one step is counted too. The
same is told of levels, below which a state falls, by the cubic through its values and
slopes.
"""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, CLOSES, RATES, Rows, compiled
from nsdrill.observe.interpolant import extreme, quintic, value

TOUCHES = ("least", "greatest", "begins")  # of each contact


def touch_rows(contacts: int) -> int:
    """Rows of the observer."""
    return len(TOUCHES) * contacts


@lru_cache
def make_touches(
    lanes: int, rows: Rows, first: int, functions: int, contacts: int
) -> tuple[Any, Any]:
    """The compiled (observer, marker) for contact functions whose values and rates at
    the start of the step stand among the observer's rows at ``functions``, those at its
    end after them; ``first`` is the place of its own rows."""
    W, rows = lanes, rows.of_observer
    before, found = W * (rows.observer + functions), W * (rows.observer + first)
    now = before + W * RATES * contacts
    step_, moves_ = W * rows.step, W * rows.moves
    width = len(TOUCHES)

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows), first, functions)
    def touches(b, store):  # type: ignore[no-untyped-def]
        for c in range(contacts):
            g_, n_ = before + c * W * RATES, now + c * W * RATES
            least_ = found + width * c * W
            greatest_, begins_ = least_ + W, least_ + 2 * W
            for i in range(W):
                if b[moves_ + i] == 0.0:
                    continue
                h, g1, d1 = b[step_ + i], b[n_ + i], b[n_ + W + i]
                if h == 0.0:  # the start of a run
                    b[least_ + i] = b[greatest_ + i] = g1
                    b[begins_ + i] = 0.0
                    continue
                g0, d0 = b[g_ + i], b[g_ + W + i]
                low, high, begins = min(b[least_ + i], g1), max(b[greatest_ + i], g1), 0.0
                if g0 <= 0.0 and g1 > 0.0:
                    begins = 1.0
                if (d0 > 0.0) != (d1 > 0.0):
                    p0, p1, p2, p3, p4, p5 = quintic(
                        g0, h * d0, h * h * b[g_ + 2 * W + i], g1, h * d1, h * h * b[n_ + 2 * W + i]
                    )
                    inside = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * d1))
                    low, high = min(low, inside), max(high, inside)
                    if (g0 > 0.0) == (g1 > 0.0) and (inside > 0.0) != (g0 > 0.0):
                        begins = 1.0
                b[least_ + i] = low
                b[greatest_ + i] = high
                b[begins_ + i] += begins

    @compiled(
        types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64),
        W,
        *astuple(rows),
        first,
        functions,
    )
    def touches_marker(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        if mark == CLOSES:
            for k in range(width * contacts):
                report[column + k] = b[found + k * W + i]

    return touches, touches_marker


@lru_cache
def make_levels(
    lanes: int, rows: Rows, first: int, levels: tuple[tuple[int, int], ...]
) -> tuple[Any, Any]:
    """The compiled observer and marker, as those of :func:`make_touches`, for a
    parameter less a velocity: ``levels`` are the places of the velocity among the
    states and of the parameter among those of a lane."""
    W, width, count, rows = lanes, len(TOUCHES), len(levels), rows.of_observer
    found = W * (rows.observer + first)
    step_, moves_ = W * rows.step, W * rows.moves
    places = np.array(levels, np.int64).reshape(-1, 2)
    velocity, parameter = places[:, 0], places[:, 1]
    stage, start, slope, slope_start, parameters = (
        rows.stage,
        rows.start,
        rows.acceleration,
        rows.start_acceleration,
        rows.parameter,
    )

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows), first, *sum(levels, ()))
    def follow_levels(b, store):  # type: ignore[no-untyped-def]
        for c in range(count):
            place, least_ = velocity[c], found + width * c * W
            for i in range(W):
                if b[moves_ + i] == 0.0:
                    continue
                h, level = b[step_ + i], b[(parameters + parameter[c]) * W + i]
                g1, d1 = level - b[(stage + place) * W + i], -b[(slope + place // 2) * W + i]
                if h == 0.0:  # the start of a run
                    b[least_ + i] = b[least_ + W + i] = g1
                    b[least_ + 2 * W + i] = 0.0
                    continue
                g0, d0 = level - b[(start + place) * W + i], -b[(slope_start + place // 2) * W + i]
                low, high, begins = min(b[least_ + i], g1), max(b[least_ + W + i], g1), 0.0
                if g0 <= 0.0 and g1 > 0.0:
                    begins = 1.0
                if (d0 > 0.0) != (d1 > 0.0):
                    bend = 6.0 * (g1 - g0)
                    p0, p1, p2, p3, p4, p5 = quintic(
                        g0,
                        h * d0,
                        bend - h * (4.0 * d0 + 2.0 * d1),
                        g1,
                        h * d1,
                        h * (2.0 * d0 + 4.0 * d1) - bend,
                    )
                    inside = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * d1))
                    low, high = min(low, inside), max(high, inside)
                    if (g0 > 0.0) == (g1 > 0.0) and (inside > 0.0) != (g0 > 0.0):
                        begins = 1.0
                b[least_ + i] = low
                b[least_ + W + i] = high
                b[least_ + 2 * W + i] += begins

    @compiled(
        types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64),
        W,
        *astuple(rows),
        first,
        *sum(levels, ()),
    )
    def levels_marker(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        if mark == CLOSES:
            for k in range(width * count):
                report[column + k] = b[found + k * W + i]

    return follow_levels, levels_marker
