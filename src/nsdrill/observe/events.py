"""What happens inside a step: a quantity turns, or crosses a level.

In a packed step that is so in a few of the lanes only, for one quantity or another. So the events are noted in a list,
lane after lane and step after step, and when it is full they are located side by side: the arithmetic is packed however
few lanes there are. When that is depends on the neighbours; what comes out must not. So the lists are emptied before
anything is read, and whatever is added up is added in each lane's own order of time.

A list is a few columns of the observer's store. An event has value, slope and second derivative of its quantity at both
ends of the step, the length of the step, its lane and its kind, a level, and, once located, the result. There is one
list for turns, whose result is the extreme value, and one for crossings, whose result is the time above the level.
"""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, Rows, compiled, inlined
from nsdrill.elementary import fma, lowest_bit
from nsdrill.model.rhs import PARAMETERS
from nsdrill.observe.interpolant import bends_of_cubic, derivative, extreme, quintic, share_above, value
from nsdrill.observe.layout import (
    COLUMNS,
    COUNT,
    CROSSINGS,
    OBSERVED,
    PARTS,
    PEAKS,
    RINGS,
    RINGS_OF_PEAKS,
    SIDE_BY_SIDE,
    SPARE,
    TURNS,
)

G0, D0, C0, G1, D1, C1, LENGTH, LANE, KIND, LEVEL, RESULT = (SIDE_BY_SIDE * i for i in range(COLUMNS))
# What turns. (Its level: the surface, for interference and squared radius; for twist and bit speed the drive's speed.)
Z, SPEED, TWIST, U, TORQUE, RHO = range(6)
# What is crossed: the rock's surface, the speed below which the bit is stuck, the wall; and grazes of rock and wall. In
# the order of ``PARTS``, as each kind has a sum of its own: a graze comes to light only when the list of turns is full,
# and among the crossings it would stand now here, now there.
ROCK, STUCK, WALL, ROCK_GRAZE, WALL_GRAZE = range(len(PARTS))


@inlined
def note(store, place, kind, i, h, g0, d0, c0, g1, d1, c1, level):  # type: ignore[no-untyped-def]
    """Put an event of lane i into the list at ``place`` of the store; True where the list is now full."""
    count = int(store[place + COUNT])
    k = place + count
    store[k + G0] = g0
    store[k + D0] = d0
    store[k + C0] = c0
    store[k + G1] = g1
    store[k + D1] = d1
    store[k + C1] = c1
    store[k + LENGTH] = h
    store[k + LANE] = i
    store[k + KIND] = kind
    store[k + LEVEL] = level
    store[place + COUNT] = count + 1
    return count + 1 == SIDE_BY_SIDE


@inlined
def note_rows(b, store, place, kind, i, h, rows, minus, level):  # type: ignore[no-untyped-def]
    """Note an event of a quantity whose value, slope less ``minus`` and second derivative are in these rows."""
    g0_, d0_, c0_, g1_, d1_, c1_ = rows
    return note(
        store, place, kind, i, h,
        b[g0_ + i], b[d0_ + i] - minus, b[c0_ + i], b[g1_ + i], b[d1_ + i] - minus, b[c1_ + i], level)


@inlined
def note_radius(b, store, place, kind, i, h, x_rows, y_rows, level):  # type: ignore[no-untyped-def]
    """Note an event of the squared radius, which is smooth also at the hole's centre."""
    x0_, vx0_, ax0_, x1_, vx1_, ax1_ = x_rows
    y0_, vy0_, ay0_, y1_, vy1_, ay1_ = y_rows
    g0, d0, c0 = squared_radius(b, i, x0_, vx0_, ax0_, y0_, vy0_, ay0_)
    g1, d1, c1 = squared_radius(b, i, x1_, vx1_, ax1_, y1_, vy1_, ay1_)
    return note(store, place, kind, i, h, g0, d0, c0, g1, d1, c1, level)


@inlined
def squared_radius(b, i, x_, vx_, ax_, y_, vy_, ay_):  # type: ignore[no-untyped-def]
    """The squared radius of lane i at an end of the step and its two rates."""
    x, vx, y, vy = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i]
    rate = fma(x, vx, y * vy)
    second = fma(vx, vx, fma(vy, vy, fma(x, b[ax_ + i], y * b[ay_ + i])))
    return fma(x, x, y * y), 2.0 * rate, 2.0 * second


@inlined
def polynomial(store, k, of_rate, of_cubic):  # type: ignore[no-untyped-def]
    """Coefficients of event k's quantity, or of its rate times the step, and the slope at the step's end. Where the
    second derivatives are not known (``of_cubic``) they are those of the cubic through the rest."""
    h = store[k + LENGTH]
    g0, d0, c0 = store[k + G0], h * store[k + D0], h * h * store[k + C0]
    g1, d1, c1 = store[k + G1], h * store[k + D1], h * h * store[k + C1]
    bend0, bend1 = bends_of_cubic(g0, d0, g1, d1)
    c0, c1 = bend0 if of_cubic else c0, bend1 if of_cubic else c1
    p0, p1, p2, p3, p4, p5 = quintic(g0, d0, c0, g1, d1, c1)
    q0, q1, q2, q3, q4, q5 = derivative(p1, p2, p3, p4, p5)
    p0, p1, p2 = q0 if of_rate else p0, q1 if of_rate else p1, q2 if of_rate else p2
    p3, p4, p5 = q3 if of_rate else p3, q4 if of_rate else p4, q5 if of_rate else p5
    return p0, p1, p2, p3, p4, p5, c1 if of_rate else d1


@inlined
def locate_turns(store):  # type: ignore[no-untyped-def]
    """The extreme value of each quantity of the list. (Rows after the last event are computed for nothing.)"""
    for k in range(TURNS, TURNS + SIDE_BY_SIDE):
        of_rate = store[k + KIND] == SPEED
        p0, p1, p2, p3, p4, p5, end_slope = polynomial(store, k, of_rate, store[k + KIND] == TORQUE)
        found = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, end_slope))
        store[k + RESULT] = found / store[k + LENGTH] + store[k + LEVEL] if of_rate else found


@inlined
def locate_crossings(store):  # type: ignore[no-untyped-def]
    """The time in each step of the list for which the quantity, or its rate, is above the level."""
    for k in range(CROSSINGS, CROSSINGS + SIDE_BY_SIDE):
        of_rate = store[k + KIND] == STUCK
        p0, p1, p2, p3, p4, p5, end_slope = polynomial(store, k, of_rate, False)
        h = store[k + LENGTH]
        level = store[k + LEVEL] * (h if of_rate else 1.0)
        store[k + RESULT] = h * share_above(p0, p1, p2, p3, p4, p5, end_slope, level)


@lru_cache
def make_events(lanes: int, rows: Rows) -> tuple[Any, Any]:
    """The compiled (attend, settle) for a number of lanes and a row layout.

    ``attend(b, store, z, speed, twist, u, torque, rho, rock, stuck, wall)`` takes the events of the step just made: for
    what turns and for what is crossed an integer with a bit for every lane in which it does. ``settle(b, store)``
    empties both lists: whoever wants to read the measurements calls it first.
    """
    W = lanes
    h_ = W * rows.step
    drive_, gap_, stuck_ = (
        W * (rows.parameter + PARAMETERS.index(name)) for name in ("drive_speed", "gap", "stuck_below"))
    own = {name: W * (rows.observer + i) for i, name in enumerate(OBSERVED)}
    # Rows of value, slope and second derivative at both ends. That of the bit torque is not known.
    x_rows, y_rows, z_rows, twist_rows = (
        tuple(W * row for row in (
            rows.start + 2 * i, rows.start + 2 * i + 1, rows.start_acceleration + i,
            rows.stage + 2 * i, rows.stage + 2 * i + 1, rows.acceleration + i))
        for i in range(4))
    u_rows = tuple(own[f"{name}_{when}"] for when in ("before", "now") for name in ("u", "du", "ddu"))
    torque_rows = tuple(
        own[f"{name}_{when}"] for when in ("before", "now") for name in ("torque", "dtorque", "dtorque"))
    parts_ = own[PARTS[0]]
    # By what turns: where its greatest and its least value stand, and in which ring its peaks.
    greatest_ = np.array([own[name] for name in ("z_max", "speed_max", "twist_max", "u_max", "torque_max", "rho_max")])
    least_ = np.array([own[name] for name in ("z_min", "speed_min", "twist_min", "spare", "spare", "spare")])
    ring_of = np.array([0, 1, -1, -1, -1, 2])

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows))
    def settle_crossings(b, store):  # type: ignore[no-untyped-def]
        locate_crossings(store)
        for k in range(CROSSINGS, CROSSINGS + int(store[CROSSINGS + COUNT])):
            kind, level = int(store[k + KIND]), store[k + LEVEL]
            # A graze from above was counted as a whole step.
            whole = kind in (ROCK_GRAZE, WALL_GRAZE) and store[k + G0] > level
            b[parts_ + W * kind + int(store[k + LANE])] += store[k + RESULT] - (store[k + LENGTH] if whole else 0.0)
        store[CROSSINGS + COUNT] = 0.0

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows))
    def settle_turns(b, store):  # type: ignore[no-untyped-def]
        peaks = int(store[PEAKS])
        locate_turns(store)
        for k in range(TURNS, TURNS + int(store[TURNS + COUNT])):
            i, kind, found = int(store[k + LANE]), int(store[k + KIND]), store[k + RESULT]
            # Without branches that no processor could guess: what has no place is put into the spare one.
            rising = store[k + (C0 if kind == SPEED else D0)] > 0.0
            row = (greatest_[kind] if rising else least_[kind]) + i
            b[row] = max(b[row], found) if rising else min(b[row], found)
            which = ring_of[kind]
            kept = rising and which >= 0 and peaks > 0
            ring = RINGS + (RINGS_OF_PEAKS * i + which) * (peaks + 1) if kept else SPARE
            count = int(store[ring])
            store[ring + 1 + count % max(peaks, 1)] = found
            store[ring] = count + 1
            # A graze, both ends on one side of the surface and the turn on the other, is two crossings. It is rare.
            level = store[k + LEVEL]
            above0, above1, above = store[k + G0] > level, store[k + G1] > level, found > level
            if kind in (U, RHO) and above0 == above1 and above0 != above and note(
                    store, CROSSINGS, ROCK_GRAZE if kind == U else WALL_GRAZE, i, store[k + LENGTH],
                    store[k + G0], store[k + D0], store[k + C0],
                    store[k + G1], store[k + D1], store[k + C1], level):
                settle_crossings(b, store)
        store[SPARE] = 0.0
        store[TURNS + COUNT] = 0.0

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows))
    def settle(b, store):  # type: ignore[no-untyped-def]
        settle_turns(b, store)
        settle_crossings(b, store)

    @compiled(types.void(BUFFER, BUFFER, *[types.int64] * 9), W, *astuple(rows))
    def attend(b, store, z, speed, twist, u, torque, rho, rock, stuck, wall):  # type: ignore[no-untyped-def]
        while z != 0:
            i = lowest_bit(z)
            z &= z - 1
            if note_rows(b, store, TURNS, Z, i, b[h_ + i], z_rows, 0.0, 0.0):
                settle_turns(b, store)
        # The twist, and its rate: the bit speed less the drive's.
        for kind in (SPEED, TWIST):
            turning = speed if kind == SPEED else twist
            while turning != 0:
                i = lowest_bit(turning)
                turning &= turning - 1
                drive = b[drive_ + i]
                if note_rows(b, store, TURNS, kind, i, b[h_ + i], twist_rows, drive, drive):
                    settle_turns(b, store)
        while u != 0:
            i = lowest_bit(u)
            u &= u - 1
            if note_rows(b, store, TURNS, U, i, b[h_ + i], u_rows, 0.0, 0.0):
                settle_turns(b, store)
        while torque != 0:
            i = lowest_bit(torque)
            torque &= torque - 1
            if note_rows(b, store, TURNS, TORQUE, i, b[h_ + i], torque_rows, 0.0, 0.0):
                settle_turns(b, store)
        while rho != 0:
            i = lowest_bit(rho)
            rho &= rho - 1
            if note_radius(b, store, TURNS, RHO, i, b[h_ + i], x_rows, y_rows, b[gap_ + i] * b[gap_ + i]):
                settle_turns(b, store)
        while rock != 0:
            i = lowest_bit(rock)
            rock &= rock - 1
            if note_rows(b, store, CROSSINGS, ROCK, i, b[h_ + i], u_rows, 0.0, 0.0):
                settle_crossings(b, store)
        while stuck != 0:
            i = lowest_bit(stuck)
            stuck &= stuck - 1
            drive = b[drive_ + i]
            if note_rows(b, store, CROSSINGS, STUCK, i, b[h_ + i], twist_rows, drive, b[stuck_ + i] - drive):
                settle_crossings(b, store)
        while wall != 0:
            i = lowest_bit(wall)
            wall &= wall - 1
            if note_radius(b, store, CROSSINGS, WALL, i, b[h_ + i], x_rows, y_rows, b[gap_ + i] * b[gap_ + i]):
                settle_crossings(b, store)

    return attend, settle
