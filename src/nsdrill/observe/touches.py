"""The contacts of a run: for each contact the least and the greatest value of its
function, and how often it begins.

A contact function is positive where the contact is closed
(:class:`nsdrill.models.base.Model`). Inside a step it is the quintic through its values
and rates, so a contact that begins or is interrupted within one step is counted too.
The same is measured of levels below which a state falls, with the cubic through its
values and slopes.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import CLOSES, MARKER, OBSERVER, RATES, Rows
from nsdrill.compiler.functions import compiled, inlined
from nsdrill.observe.interpolant import extreme, quintic, value

TOUCHES = ("least", "greatest", "begins")  # the rows of each contact


def touch_rows(contacts: int) -> int:
    """The number of rows of the observer."""
    return len(TOUCHES) * contacts


@inlined
def follow(b, i, W, least_, h, g0, d0, c0, g1, d1, c1):  # type: ignore[no-untyped-def]
    """Update the rows of lane i, the first of which is at ``least_``, by a step of
    length ``h`` with these values, slopes and second derivatives by theta at its
    ends. A step of length zero is the start of a run."""
    greatest_, begun_ = least_ + W, least_ + 2 * W
    if h == 0.0:
        b[least_ + i] = b[greatest_ + i] = g1
        b[begun_ + i] = 0.0
    else:
        low, high = min(b[least_ + i], g1), max(b[greatest_ + i], g1)
        begins = g0 <= 0.0 and g1 > 0.0
        if (d0 > 0.0) != (d1 > 0.0):
            p = quintic(g0, d0, c0, g1, d1, c1)
            at_extremum = value(p, extreme(p, d1))
            low, high = min(low, at_extremum), max(high, at_extremum)
            begins = begins or ((g0 > 0.0) == (g1 > 0.0) and (at_extremum > 0.0) != (g0 > 0.0))
        b[least_ + i] = low
        b[greatest_ + i] = high
        b[begun_ + i] += 1.0 if begins else 0.0


def _marker(first_: int, lanes: int, count: int) -> Any:
    """The marker that reports ``count`` rows from the offset ``first_`` on."""

    @compiled(MARKER)
    def touches_marker(b, store, i, mark, outcome, column):  # type: ignore[no-untyped-def]
        if mark == CLOSES:
            for k in range(count):
                outcome[column + k] = b[first_ + k * lanes + i]

    return touches_marker


@lru_cache
def make_touches(lanes: int, rows: Rows, first: int, functions: int, contacts: int) -> tuple[Any, Any]:
    """The compiled (observer, marker) for contact functions whose values and rates at
    the start of the step are in the rows from ``functions`` on among those of the
    observer, followed by those at its end; ``first`` is the position of the observer's
    own rows."""
    W = lanes
    functions_start, first_ = W * (rows.observer + functions), W * (rows.observer + first)
    functions_end = functions_start + W * RATES * contacts
    step_, moves_ = W * rows.step, W * rows.moves

    @compiled(OBSERVER)
    def touches(b, store):  # type: ignore[no-untyped-def]
        for c in range(contacts):
            start_, end_ = functions_start + c * W * RATES, functions_end + c * W * RATES
            for i in range(W):
                if b[moves_ + i] != 0.0:
                    h = b[step_ + i]
                    g0, d0, c0 = b[start_ + i], h * b[start_ + W + i], h * h * b[start_ + 2 * W + i]
                    g1, d1, c1 = b[end_ + i], h * b[end_ + W + i], h * h * b[end_ + 2 * W + i]
                    follow(b, i, W, first_ + touch_rows(c) * W, h, g0, d0, c0, g1, d1, c1)

    return touches, _marker(first_, W, touch_rows(contacts))


@lru_cache
def make_levels(lanes: int, rows: Rows, first: int, levels: tuple[tuple[int, int], ...]) -> tuple[Any, Any]:
    """The compiled (observer, marker), like those of :func:`make_touches`, for a
    parameter minus a velocity. ``levels`` are pairs: the position of the velocity among
    the states, and that of the parameter among the parameters."""
    W, count = lanes, len(levels)
    first_ = W * (rows.observer + first)
    step_, moves_ = W * rows.step, W * rows.moves
    places = np.array(levels, np.int64).reshape(-1, 2)
    velocity, parameter = places[:, 0], places[:, 1]
    stage, start, slope, slope_start = rows.stage, rows.start, rows.acceleration, rows.start_acceleration
    parameters = rows.parameter

    @compiled(OBSERVER)
    def follow_levels(b, store):  # type: ignore[no-untyped-def]
        for c in range(count):
            place = velocity[c]
            for i in range(W):
                if b[moves_ + i] != 0.0:
                    h, level = b[step_ + i], b[(parameters + parameter[c]) * W + i]
                    g0, d0 = level - b[(start + place) * W + i], -b[(slope_start + place // 2) * W + i]
                    g1, d1 = level - b[(stage + place) * W + i], -b[(slope + place // 2) * W + i]
                    rise = 6.0 * (g1 - g0)  # the quintic is then the cubic
                    c0, c1 = rise - h * (4.0 * d0 + 2.0 * d1), h * (2.0 * d0 + 4.0 * d1) - rise
                    follow(b, i, W, first_ + touch_rows(c) * W, h, g0, h * d0, c0, g1, h * d1, c1)

    return follow_levels, _marker(first_, W, touch_rows(count))
