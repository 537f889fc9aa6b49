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
from nsdrill.compiler.functions import compiled
from nsdrill.observe.interpolant import extreme, quintic, value

TOUCHES = ("least", "greatest", "begins")  # the rows of each contact


def touch_rows(contacts: int) -> int:
    """The number of rows of the observer."""
    return len(TOUCHES) * contacts


@lru_cache
def make_touches(lanes: int, rows: Rows, first: int, functions: int, contacts: int) -> tuple[Any, Any]:
    """The compiled (observer, marker) for contact functions whose values and rates at
    the start of the step are in the rows from ``functions`` on among those of the
    observer, followed by those at its end; ``first`` is the position of the observer's
    own rows."""
    W = lanes
    functions_start, first_row = W * (rows.observer + functions), W * (rows.observer + first)
    functions_end = functions_start + W * RATES * contacts
    step_, moves_ = W * rows.step, W * rows.moves
    width = len(TOUCHES)

    @compiled(OBSERVER)
    def touches(b, store):  # type: ignore[no-untyped-def]
        for c in range(contacts):
            start_, end_ = functions_start + c * W * RATES, functions_end + c * W * RATES
            least_ = first_row + width * c * W
            greatest_, begun_ = least_ + W, least_ + 2 * W
            for i in range(W):
                if b[moves_ + i] == 0.0:
                    continue
                h, g1, d1 = b[step_ + i], b[end_ + i], b[end_ + W + i]
                if h == 0.0:  # the start of a run
                    b[least_ + i] = b[greatest_ + i] = g1
                    b[begun_ + i] = 0.0
                    continue
                g0, d0 = b[start_ + i], b[start_ + W + i]
                low, high, begun = min(b[least_ + i], g1), max(b[greatest_ + i], g1), 0.0
                if g0 <= 0.0 and g1 > 0.0:
                    begun = 1.0
                if (d0 > 0.0) != (d1 > 0.0):
                    p0, p1, p2, p3, p4, p5 = quintic(
                        g0, h * d0, h * h * b[start_ + 2 * W + i], g1, h * d1, h * h * b[end_ + 2 * W + i]
                    )
                    at_extremum = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * d1))
                    low, high = min(low, at_extremum), max(high, at_extremum)
                    if (g0 > 0.0) == (g1 > 0.0) and (at_extremum > 0.0) != (g0 > 0.0):
                        begun = 1.0
                b[least_ + i] = low
                b[greatest_ + i] = high
                b[begun_ + i] += begun

    @compiled(MARKER)
    def touches_marker(b, store, i, mark, outcome, column):  # type: ignore[no-untyped-def]
        if mark == CLOSES:
            for k in range(width * contacts):
                outcome[column + k] = b[first_row + k * W + i]

    return touches, touches_marker


@lru_cache
def make_levels(lanes: int, rows: Rows, first: int, levels: tuple[tuple[int, int], ...]) -> tuple[Any, Any]:
    """The compiled (observer, marker), like those of :func:`make_touches`, for a
    parameter minus a velocity. ``levels`` are pairs: the position of the velocity among
    the states, and that of the parameter among the parameters."""
    W, width, count = lanes, len(TOUCHES), len(levels)
    first_row = W * (rows.observer + first)
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

    @compiled(OBSERVER)
    def follow_levels(b, store):  # type: ignore[no-untyped-def]
        for c in range(count):
            place, least_ = velocity[c], first_row + width * c * W
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
                low, high, begun = min(b[least_ + i], g1), max(b[least_ + W + i], g1), 0.0
                if g0 <= 0.0 and g1 > 0.0:
                    begun = 1.0
                if (d0 > 0.0) != (d1 > 0.0):
                    scaled_rise = 6.0 * (g1 - g0)
                    p0, p1, p2, p3, p4, p5 = quintic(
                        g0,
                        h * d0,
                        scaled_rise - h * (4.0 * d0 + 2.0 * d1),
                        g1,
                        h * d1,
                        h * (2.0 * d0 + 4.0 * d1) - scaled_rise,
                    )
                    at_extremum = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * d1))
                    low, high = min(low, at_extremum), max(high, at_extremum)
                    if (g0 > 0.0) == (g1 > 0.0) and (at_extremum > 0.0) != (g0 > 0.0):
                        begun = 1.0
                b[least_ + i] = low
                b[least_ + W + i] = high
                b[least_ + 2 * W + i] += begun

    @compiled(MARKER)
    def levels_marker(b, store, i, mark, outcome, column):  # type: ignore[no-untyped-def]
        if mark == CLOSES:
            for k in range(width * count):
                outcome[column + k] = b[first_row + k * W + i]

    return follow_levels, levels_marker
