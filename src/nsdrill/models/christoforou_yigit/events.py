"""What happens inside a step: a quantity turns, or crosses a level.

In a packed step that is so in a few of the lanes only, for one quantity or another. So
the events are noted in a list, lane after lane and step after step, and when it is full
they are located side by side: the arithmetic is packed however few lanes there are.
When that is depends on the neighbours; what comes out must not. So the lists are
emptied before anything is read, and whatever is added up is added in each lane's own
order of time.

A list is a few columns of the observer's store. An event has value, slope and second
derivative of its quantity at both ends of the step, the length of the step, its lane
and its kind, a level, and, once located, the result. There is one list for turns, whose
result is the extreme value, and one for crossings, whose result is the time above the
level; at the wall also how far the collar and its surface move meanwhile. The tops of
the bit torque have a list of their own: the torque is no polynomial, as the friction of
a bit that breaks loose falls within a part of a step.
"""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, Rows, compiled, inlined
from nsdrill.elementary import fma, lowest_bit
from nsdrill.models.christoforou_yigit.friction import bit_law
from nsdrill.models.christoforou_yigit.layout import (
    COLUMNS,
    COUNT,
    CROSSINGS,
    OBSERVED,
    PARTS,
    PEAK,
    PEAKS,
    RINGS,
    RINGS_OF_PEAKS,
    SIDE_BY_SIDE,
    SPARE,
    TOPS,
    TURNS,
)
from nsdrill.models.christoforou_yigit.rhs import PARAMETERS
from nsdrill.observe.interpolant import (
    above,
    derivative,
    divide,
    extreme,
    integral_of_cubic,
    quintic,
    slope,
    top_of_cubic,
    value,
)

PLACES = tuple(SIDE_BY_SIDE * i for i in range(COLUMNS))
G0, D0, C0, G1, D1, C1, LENGTH, LANE, KIND, LEVEL, RESULT = PLACES[:11]
# At the wall: whether the rest is there; the speed of the collar's centre along the
# wall and that of the bit, with their rates, at both ends; how far the centre goes
# along the wall and by how much the string turns.
SLIDES_KNOWN = PLACES[11]
SLIDE = PLACES[12:20]
WHIRL0, DWHIRL0, WHIRL1, DWHIRL1, SPEED0, DSPEED0, SPEED1, DSPEED1 = SLIDE
ROLLED, TURNED = PLACES[20:22]
ROOM = PLACES[22]  # of a turn of the squared radius the square of the stabilisers' clearance
# A top of the bit torque has the interference first, then: by how much the bit turns,
# its speed with its rate and the torque with its rate at both ends, and the law of the
# bit with the rock's stiffness.
TURN, W0, DW0, W1, DW1, T0, DT0, T1, DT1, SMOOTHING, DECAY, RISE, DYNAMIC = PLACES[11:]
# What turns. (Its level: the surface, for interference and squared radius; for twist
# and bit speed the drive's speed.) And a bit speed at the end of a step that is above
# or below both of its neighbours; and the speed of the drive.
Z, SPEED, TWIST, U, RHO, SPEED_END, TOP = range(7)
# What is crossed: the rock's surface, the speed below which the bit is stuck, the wall,
# which the collar touches and, before it, the stabilisers; and grazes of rock, wall and
# stabilisers. In the order of ``PARTS``: each kind has a sum of its own: a graze comes
# to light only when the list of turns is full, and among the crossings it would stand
# now here, now there.
ROCK, STUCK, WALL, STABILIZER, ROCK_GRAZE, WALL_GRAZE, STABILIZER_GRAZE = range(len(PARTS))


@inlined
def note(store, place, kind, i, h, g0, d0, c0, g1, d1, c1, level):  # type: ignore[no-untyped-def]
    """Put an event of lane i into the list at ``place`` of the store; True where the
    list is now full."""
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
    """Note an event of a quantity whose value, slope less ``minus`` and second
    derivative are in these rows."""
    g0_, d0_, c0_, g1_, d1_, c1_ = rows
    return note(
        store,
        place,
        kind,
        i,
        h,
        b[g0_ + i],
        b[d0_ + i] - minus,
        b[c0_ + i],
        b[g1_ + i],
        b[d1_ + i] - minus,
        b[c1_ + i],
        level,
    )


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
def least_of(g0, g1, d0, d1, h):  # type: ignore[no-untyped-def]
    """An estimate, on the safe side, of the least value inside a step of a quantity
    with one turn there. (A least value that is above the level matters to nobody and
    need not be located.)"""
    return min(g0, g1) - h * max(abs(d0), abs(d1))


@inlined
def slide(x, vx, ax, y, vy, ay, per_radius, dradius):  # type: ignore[no-untyped-def]
    """The speed of the collar's centre around the hole [m/s] and its rate."""
    speed = fma(x, vy, -(y * vx)) * per_radius
    return speed, fma(-speed, dradius, fma(x, ay, -(y * ax))) * per_radius


@inlined
def note_slide(b, store, k, i, x_rows, y_rows, bit_rows):  # type: ignore[no-untyped-def]
    """Add to event k, one of the radius, how the collar slides at the ends of the step."""
    x0_, vx0_, ax0_, x1_, vx1_, ax1_ = x_rows
    y0_, vy0_, ay0_, y1_, vy1_, ay1_ = y_rows
    speed0_, alpha0_, per_r0_, dr0_, speed1_, alpha1_, per_r1_, dr1_ = bit_rows
    whirl0, dwhirl0 = slide(
        b[x0_ + i],
        b[vx0_ + i],
        b[ax0_ + i],
        b[y0_ + i],
        b[vy0_ + i],
        b[ay0_ + i],
        b[per_r0_ + i],
        b[dr0_ + i],
    )
    whirl1, dwhirl1 = slide(
        b[x1_ + i],
        b[vx1_ + i],
        b[ax1_ + i],
        b[y1_ + i],
        b[vy1_ + i],
        b[ay1_ + i],
        b[per_r1_ + i],
        b[dr1_ + i],
    )
    store[k + WHIRL0] = whirl0
    store[k + DWHIRL0] = dwhirl0
    store[k + WHIRL1] = whirl1
    store[k + DWHIRL1] = dwhirl1
    store[k + SPEED0] = b[speed0_ + i]
    store[k + DSPEED0] = b[alpha0_ + i]
    store[k + SPEED1] = b[speed1_ + i]
    store[k + DSPEED1] = b[alpha1_ + i]


@inlined
def polynomial(store, k, of_rate):  # type: ignore[no-untyped-def]
    """Coefficients of event k's quantity, or of its rate times the step, and the slope
    at the step's end."""
    h = store[k + LENGTH]
    g0, d0, c0 = store[k + G0], h * store[k + D0], h * h * store[k + C0]
    g1, d1, c1 = store[k + G1], h * store[k + D1], h * h * store[k + C1]
    p0, p1, p2, p3, p4, p5 = quintic(g0, d0, c0, g1, d1, c1)
    q0, q1, q2, q3, q4, q5 = derivative(p1, p2, p3, p4, p5)
    p0, p1, p2 = q0 if of_rate else p0, q1 if of_rate else p1, q2 if of_rate else p2
    p3, p4, p5 = q3 if of_rate else p3, q4 if of_rate else p4, q5 if of_rate else p5
    return p0, p1, p2, p3, p4, p5, c1 if of_rate else d1


@inlined
def locate_turns(store):  # type: ignore[no-untyped-def]
    """The extreme value of each quantity of the list. (Rows after the last event are
    computed for nothing.)"""
    for k in range(TURNS, TURNS + SIDE_BY_SIDE):
        of_rate = store[k + KIND] == SPEED or store[k + KIND] == TOP
        p0, p1, p2, p3, p4, p5, end_slope = polynomial(store, k, of_rate)
        found = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, end_slope))
        store[k + RESULT] = found / store[k + LENGTH] + store[k + LEVEL] if of_rate else found


@inlined
def locate_crossings(store):  # type: ignore[no-untyped-def]
    """The time in each step of the list for which the quantity, or its rate, is above
    the level, and what happens at the wall meanwhile."""
    for k in range(CROSSINGS, CROSSINGS + SIDE_BY_SIDE):
        of_rate = store[k + KIND] == STUCK
        p0, p1, p2, p3, p4, p5, end_slope = polynomial(store, k, of_rate)
        h = store[k + LENGTH]
        level = store[k + LEVEL] * (h if of_rate else 1.0)
        first, second, start, top, end = divide(p0, p1, p2, p3, p4, p5, end_slope, level)
        # A graze (the last kinds are) from above was counted as a whole step.
        whole = store[k + KIND] >= ROCK_GRAZE and store[k + G0] > store[k + LEVEL]
        store[k + RESULT] = h * above(first, second, 1.0, start, top, end) - (h if whole else 0.0)
        store[k + ROLLED] = h * slid(
            store[k + WHIRL0],
            h * store[k + DWHIRL0],
            store[k + WHIRL1],
            h * store[k + DWHIRL1],
            first,
            second,
            start,
            top,
            end,
            whole,
        )
        store[k + TURNED] = h * slid(
            store[k + SPEED0],
            h * store[k + DSPEED0],
            store[k + SPEED1],
            h * store[k + DSPEED1],
            first,
            second,
            start,
            top,
            end,
            whole,
        )


@inlined
def slid(g0, d0, g1, d1, first, second, above_start, above_top, above_end, whole):  # type: ignore[no-untyped-def]
    """The integral over theta, on the wall, of a speed with these values and slopes at
    the ends of the step; less that over the ``whole`` step."""
    at_end = integral_of_cubic(g0, d0, g1, d1, 1.0)
    return above(
        integral_of_cubic(g0, d0, g1, d1, first),
        integral_of_cubic(g0, d0, g1, d1, second),
        at_end,
        above_start,
        above_top,
        above_end,
    ) - (at_end if whole else 0.0)


@inlined
def locate_tops(store, number):  # type: ignore[no-untyped-def]
    """The greatest bit torque of each step of the list: force times arm, of which both
    follow from the continuous solution. Twice the torque is computed where the cubic
    through values and slopes at the ends of a bracket has its top, and the bracket
    shrinks to that point. What is found is never above the greatest torque, and below
    it by less than the tolerance of the integration."""
    for k in range(TOPS, TOPS + SIDE_BY_SIDE):
        h = store[k + LENGTH]
        pressing = quintic(
            store[k + G0],
            h * store[k + D0],
            h * h * store[k + C0],
            store[k + G1],
            h * store[k + D1],
            h * h * store[k + C1],
        )
        _, q1, q2, q3, q4, q5 = quintic(
            0.0,
            h * store[k + W0],
            h * h * store[k + DW0],
            store[k + TURN],
            h * store[k + W1],
            h * h * store[k + DW1],
        )
        turning, per_h = derivative(q1, q2, q3, q4, q5), 1.0 / h
        law = store[k + SMOOTHING], store[k + DECAY], store[k + RISE], store[k + DYNAMIC]
        low = 0.0, store[k + T0], h * store[k + DT0]
        high = 1.0, store[k + T1], h * store[k + DT1]
        # Not as a loop, which the compiler would not unroll, and so not vectorise what
        # is around it.
        low, high = closer(low, high, pressing, turning, per_h, number, law)
        low, high = closer(low, high, pressing, turning, per_h, number, law)
        store[k + RESULT] = max(low[1], high[1])


@inlined
def closer(low, high, pressing, turning, per_h, number, law):  # type: ignore[no-untyped-def]
    """A smaller bracket around the top of the bit torque, of the friction law of this
    number. Each of its ends has theta, torque and slope."""
    low_theta, low_torque, low_rate = low
    high_theta, high_torque, high_rate = high
    p0, p1, p2, p3, p4, p5 = pressing
    w1, w2, w3, w4, w5, _ = turning
    smoothing, decay, rise, dynamic = law
    width = high_theta - low_theta
    theta = fma(
        width, top_of_cubic(low_torque, width * low_rate, high_torque, width * high_rate), low_theta
    )
    u, du = value(p0, p1, p2, p3, p4, p5, theta), slope(p1, p2, p3, p4, p5, theta)
    omega = per_h * value(w1, w2, w3, w4, w5, 0.0, theta)
    alpha = per_h * slope(w2, w3, w4, w5, 0.0, theta)
    arm, darm = bit_law(number, omega, smoothing, decay, rise, dynamic)
    torque = max(u, 0.0) * arm
    rate = fma(du if u > 0.0 else 0.0, arm, max(u, 0.0) * darm * alpha)
    rising = rate > 0.0 or (u <= 0.0 and du > 0.0)
    low = (
        theta if rising else low_theta,
        torque if rising else low_torque,
        rate if rising else low_rate,
    )
    high = (
        high_theta if rising else theta,
        high_torque if rising else torque,
        high_rate if rising else rate,
    )
    return low, high


@inlined
def keep(store, ring, peaks, height):  # type: ignore[no-untyped-def]
    """Put a peak into a ring of the store that begins with the number of those that
    came before."""
    count = int(store[ring])
    store[ring + 1 + count % max(peaks, 1)] = height
    store[ring] = count + 1


@lru_cache
def make_events(
    lanes: int,
    rows: Rows,
    driven: int = 0,
    friction: int = 0,
    stabilizer: int = 0,
    clearance: int = 0,
) -> tuple[Any, Any]:
    """The compiled (attend, settle) for a number of lanes, a row layout and what events
    see of the options, as in :class:`.options.Seen`.

    ``attend(b, store, z, speed, highs, lows, twist, u, torque, rho, rock, stuck, wall,
    top, held)`` takes the events of the step just made: for what turns and for what is
    crossed an integer with a bit for every lane in which it does; ``held`` are the
    lanes that come to the stabilisers or leave them, ``highs`` and ``lows`` those where
    the bit speed at the step's start is above or below its neighbours.
    ``settle(b, store)`` empties the lists: whoever wants to read the measurements calls
    it first.
    """
    W, rows = lanes, rows.of_observer
    h_, room_ = W * rows.step, W * (rows.parameter + clearance)
    drive_, gap_, stuck_, k_c_, eps_, tau_, rise_, mu_ = (
        W * (rows.parameter + PARAMETERS.index(name))
        for name in (
            "drive_speed",
            "gap",
            "stuck_below",
            "rock_stiffness",
            "bit_smoothing",
            "bit_decay",
            "bit_rise",
            "bit_dynamic",
        )
    )
    own = {name: W * (rows.observer + i) for i, name in enumerate(OBSERVED)}
    # Rows of value, slope and second derivative at both ends.
    x_rows, y_rows, z_rows, twist_rows = (
        tuple(
            W * row
            for row in (
                rows.start + 2 * i,
                rows.start + 2 * i + 1,
                rows.start_acceleration + i,
                rows.stage + 2 * i,
                rows.stage + 2 * i + 1,
                rows.acceleration + i,
            )
        )
        for i in range(4)
    )
    top_rows = tuple(
        W * row
        for row in (  # of the drive, which an ideal one has not
            rows.start + 8,
            rows.start + 9,
            rows.start_acceleration + 4,
            rows.stage + 8,
            rows.stage + 9,
            rows.acceleration + 4,
        )
    )
    lag0_, top0_, pull0_, lag1_, top1_, pull1_ = top_rows
    u_rows = tuple(
        own[f"{name}_{when}"] for when in ("before", "now") for name in ("u", "du", "ddu")
    )
    torque0_, dtorque0_, torque1_, dtorque1_ = (
        own[f"{name}_{when}"] for when in ("before", "now") for name in ("torque", "dtorque")
    )
    twist0_, speed0_, alpha0_, twist1_, speed1_, alpha1_ = twist_rows
    slide_rows = (
        speed0_,
        alpha0_,
        own["per_radius_before"],
        own["dradius_before"],
        speed1_,
        alpha1_,
        own["per_radius_now"],
        own["dradius_now"],
    )
    parts_, rolled_, rolled_grazes_ = own[PARTS[0]], own["rolled_crossings"], own["rolled_grazes"]
    u0_, du0_, _, u1_, du1_, _ = u_rows
    torque_max_, floor_, growth_ = own["torque_max"], own["torque_floor"], own["margin_growth"]
    # By what turns: where its greatest and its least value stand, in which ring its
    # peaks, and what decides on them.
    greatest_ = np.array(
        [
            own[name]
            for name in (
                "z_max",
                "speed_max",
                "twist_max",
                "u_max",
                "rho_max",
                "spare",
                "drive_max",
            )
        ]
    )
    least_ = np.array(
        [
            own[name]
            for name in ("z_min", "speed_min", "twist_min", "spare", "spare", "spare", "drive_min")
        ]
    )
    ring_of = np.array([0, 1, -1, -1, 2, 1, -1])
    low_ = np.array(
        [own[f"low_{ring}"] for ring in ("z", "speed", "else", "else", "else", "speed", "else")]
    )
    to_high, to_margin = (W * PEAK.index(name) for name in ("high", "margin"))

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows))
    def settle_crossings(b, store):  # type: ignore[no-untyped-def]
        locate_crossings(store)
        for k in range(CROSSINGS, CROSSINGS + int(store[CROSSINGS + COUNT])):
            i, kind = int(store[k + LANE]), int(store[k + KIND])
            b[parts_ + W * kind + i] += store[k + RESULT]
            if kind in (WALL, WALL_GRAZE):
                row = i + (rolled_ if kind == WALL else rolled_grazes_)
                b[row] += store[k + ROLLED]
                b[row + W] += store[k + TURNED]
        store[CROSSINGS + COUNT] = 0.0

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows), stabilizer)
    def settle_turns(b, store):  # type: ignore[no-untyped-def]
        peaks = int(store[PEAKS])
        locate_turns(store)
        for k in range(TURNS, TURNS + int(store[TURNS + COUNT])):
            i, kind, found = int(store[k + LANE]), int(store[k + KIND]), store[k + RESULT]
            # Without branches that no processor could guess: what has no place is put
            # into the spare one.
            rising = store[k + (C0 if kind in (SPEED, TOP) else D0)] > 0.0
            row = (greatest_[kind] if rising else least_[kind]) + i
            b[row] = max(b[row], found) if rising else min(b[row], found)
            # A greatest value becomes a peak as soon as the quantity has fallen far
            # enough below it; of the radius every one is a peak, as its least values
            # are not located.
            row = low_[kind] + i
            low, high = b[row], b[row + to_high]
            margin = fma(b[growth_ + i], abs(found), b[row + to_margin])
            high = max(high, found) if rising and found - low > margin else high
            fallen = not rising and high - found > margin
            b[row] = low if rising else (found if fallen else min(low, found))
            b[row + to_high] = -np.inf if fallen else high
            peak = rising if kind == RHO else fallen
            keep(
                store,
                RINGS + (RINGS_OF_PEAKS * i + ring_of[kind]) * (peaks + 1)
                if peak and peaks > 0
                else SPARE,
                peaks,
                found if kind == RHO else high,
            )
            # A graze, both ends on one side of the surface and the turn on the other,
            # is two crossings. It is rare.
            level = store[k + LEVEL]
            above0, above1, above = store[k + G0] > level, store[k + G1] > level, found > level
            if kind in (U, RHO) and above0 == above1 and above0 != above:
                crossing = CROSSINGS + int(store[CROSSINGS + COUNT])
                known = kind == RHO and store[k + SLIDES_KNOWN] != 0.0
                for column in SLIDE:
                    store[crossing + column] = store[k + column] if known else 0.0
                if note(
                    store,
                    CROSSINGS,
                    ROCK_GRAZE if kind == U else WALL_GRAZE,
                    i,
                    store[k + LENGTH],
                    store[k + G0],
                    store[k + D0],
                    store[k + C0],
                    store[k + G1],
                    store[k + D1],
                    store[k + C1],
                    level,
                ):
                    settle_crossings(b, store)
                if stabilizer and kind == RHO:
                    level = store[k + ROOM]
                    above0, above1, above = (
                        store[k + G0] > level,
                        store[k + G1] > level,
                        found > level,
                    )
                    grazes = above0 == above1 and above0 != above
                    if grazes and note(
                        store,
                        CROSSINGS,
                        STABILIZER_GRAZE,
                        i,
                        store[k + LENGTH],
                        store[k + G0],
                        store[k + D0],
                        store[k + C0],
                        store[k + G1],
                        store[k + D1],
                        store[k + C1],
                        level,
                    ):
                        settle_crossings(b, store)
        store[SPARE] = 0.0
        store[TURNS + COUNT] = 0.0

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows), friction)
    def settle_tops(b, store):  # type: ignore[no-untyped-def]
        locate_tops(store, friction)
        for k in range(TOPS, TOPS + int(store[TOPS + COUNT])):
            row = torque_max_ + int(store[k + LANE])
            b[row] = max(b[row], store[k + RESULT])
        store[TOPS + COUNT] = 0.0

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows), friction, stabilizer)
    def settle(b, store):  # type: ignore[no-untyped-def]
        settle_turns(b, store)
        settle_crossings(b, store)
        settle_tops(b, store)

    @compiled(
        types.void(BUFFER, BUFFER, *[types.int64] * 13),
        W,
        *astuple(rows),
        driven,
        friction,
        stabilizer,
        clearance,
    )
    def attend(  # type: ignore[no-untyped-def]
        b, store, z, speed, highs, lows, twist, u, torque, rho, rock, stuck, wall, top, held
    ):
        while z != 0:
            i = lowest_bit(z)
            z &= z - 1
            if note_rows(b, store, TURNS, Z, i, b[h_ + i], z_rows, 0.0, 0.0):
                settle_turns(b, store)
        # Turns without length and slopes, at which the bit speed is what it is.
        ends = highs | lows
        while ends != 0:
            i = lowest_bit(ends)
            ends &= ends - 1
            omega = b[speed0_ + i]
            if note(
                store,
                TURNS,
                SPEED_END,
                i,
                0.0,
                omega,
                1.0 if (highs >> i) & 1 else -1.0,
                0.0,
                omega,
                0.0,
                0.0,
                0.0,
            ):
                settle_turns(b, store)
        # The twist, and its rate: the bit speed less the drive's.
        for kind in (SPEED, TWIST):
            turning = speed if kind == SPEED else twist
            while turning != 0:
                i = lowest_bit(turning)
                turning &= turning - 1
                drive = b[drive_ + i]
                if driven and kind == TWIST:
                    g0, g1 = b[twist0_ + i] - b[lag0_ + i], b[twist1_ + i] - b[lag1_ + i]
                    d0, d1 = b[speed0_ + i] - b[top0_ + i], b[speed1_ + i] - b[top1_ + i]
                    c0, c1 = b[alpha0_ + i] - b[pull0_ + i], b[alpha1_ + i] - b[pull1_ + i]
                    if note(store, TURNS, TWIST, i, b[h_ + i], g0, d0, c0, g1, d1, c1, 0.0):
                        settle_turns(b, store)
                elif note_rows(b, store, TURNS, kind, i, b[h_ + i], twist_rows, drive, drive):
                    settle_turns(b, store)
        while top != 0:
            i = lowest_bit(top)
            top &= top - 1
            if note_rows(
                b, store, TURNS, TOP, i, b[h_ + i], top_rows, b[drive_ + i], b[drive_ + i]
            ):
                settle_turns(b, store)
        while u != 0:
            i = lowest_bit(u)
            u &= u - 1
            u0, u1, du0, du1 = b[u0_ + i], b[u1_ + i], b[du0_ + i], b[du1_ + i]
            if du0 <= 0.0 and (u0 <= 0.0 or least_of(u0, u1, du0, du1, b[h_ + i]) >= 0.0):
                continue
            if note_rows(b, store, TURNS, U, i, b[h_ + i], u_rows, 0.0, 0.0):
                settle_turns(b, store)
        while rho != 0:
            i = lowest_bit(rho)
            rho &= rho - 1
            k, level = TURNS + int(store[TURNS + COUNT]), b[gap_ + i] * b[gap_ + i]
            full = note_radius(b, store, TURNS, RHO, i, b[h_ + i], x_rows, y_rows, level)
            # It may be a graze if the turn lies towards the wall and the squared radius
            # could get there at its slopes.
            outside = store[k + G0] > level
            grazes = outside == (store[k + G1] > level) and outside != (store[k + D0] > 0.0)
            if grazes:
                steepest = b[h_ + i] * max(abs(store[k + D0]), abs(store[k + D1]))
                grazes = (
                    min(abs(store[k + G0] - level), abs(store[k + G1] - level)) < 2.0 * steepest
                )
            store[k + SLIDES_KNOWN] = 1.0 if grazes else 0.0
            if stabilizer:
                store[k + ROOM] = b[room_ + i] * b[room_ + i]
            if grazes:
                note_slide(b, store, k, i, x_rows, y_rows, slide_rows)
            if full:
                settle_turns(b, store)
        while rock != 0:
            i = lowest_bit(rock)
            rock &= rock - 1
            # Where the contact begins, the torque may have its top as well.
            torque |= (1 << i) if b[u1_ + i] > 0.0 and b[dtorque1_ + i] <= 0.0 else 0
            if note_rows(b, store, CROSSINGS, ROCK, i, b[h_ + i], u_rows, 0.0, 0.0):
                settle_crossings(b, store)
        while torque != 0:
            i = lowest_bit(torque)
            torque &= torque - 1
            k, h, k_c = TOPS + int(store[TOPS + COUNT]), b[h_ + i], b[k_c_ + i]
            # Most tops are far below the greatest. (Not that found so far: what it is
            # depends on the neighbours.)
            highest = max(b[torque0_ + i], b[torque1_ + i])
            if highest + 0.5 * h * max(b[dtorque0_ + i], -b[dtorque1_ + i]) < b[floor_ + i]:
                continue
            b[floor_ + i] = max(b[floor_ + i], highest)
            store[k + TURN] = fma(b[drive_ + i], h, b[twist1_ + i] - b[twist0_ + i])
            store[k + W0] = b[speed0_ + i]
            store[k + DW0] = b[alpha0_ + i]
            store[k + W1] = b[speed1_ + i]
            store[k + DW1] = b[alpha1_ + i]
            store[k + T0] = b[torque0_ + i]
            store[k + DT0] = b[dtorque0_ + i]
            store[k + T1] = b[torque1_ + i]
            store[k + DT1] = b[dtorque1_ + i]
            store[k + SMOOTHING] = b[eps_ + i]
            store[k + DECAY] = b[tau_ + i]
            store[k + RISE] = k_c * b[rise_ + i]
            store[k + DYNAMIC] = k_c * b[mu_ + i]
            if note_rows(b, store, TOPS, U, i, h, u_rows, 0.0, 0.0):
                settle_tops(b, store)
        while stuck != 0:
            i = lowest_bit(stuck)
            stuck &= stuck - 1
            drive = b[drive_ + i]
            if note_rows(
                b, store, CROSSINGS, STUCK, i, b[h_ + i], twist_rows, drive, b[stuck_ + i] - drive
            ):
                settle_crossings(b, store)
        while wall != 0:
            i = lowest_bit(wall)
            wall &= wall - 1
            k = CROSSINGS + int(store[CROSSINGS + COUNT])
            note_slide(b, store, k, i, x_rows, y_rows, slide_rows)
            if note_radius(
                b, store, CROSSINGS, WALL, i, b[h_ + i], x_rows, y_rows, b[gap_ + i] * b[gap_ + i]
            ):
                settle_crossings(b, store)
        if stabilizer:
            while held != 0:
                i = lowest_bit(held)
                held &= held - 1
                level = b[room_ + i] * b[room_ + i]
                if note_radius(
                    b, store, CROSSINGS, STABILIZER, i, b[h_ + i], x_rows, y_rows, level
                ):
                    settle_crossings(b, store)

    return attend, settle
