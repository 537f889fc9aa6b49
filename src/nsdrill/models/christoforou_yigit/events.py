"""Events inside a step: extrema of a quantity and crossings of a level.

In a packed step an event of one kind occurs in a few lanes only. The events are
therefore recorded in a list, lane after lane and step after step, and located side by
side when the list is full: the arithmetic is packed however few lanes have events. When
a list fills up depends on the neighbouring lanes; the outcome must not. The lists are
therefore flushed before anything is read, and sums are accumulated in the order of time
of each lane.

A list is a few columns of the observer's store. An event has value, slope and second
derivative of its quantity at both ends of the step, the length of the step, its lane
and its kind, a level, and, once located, the result:

==================  =================================================================
list                result
==================  =================================================================
extrema             the extreme value
crossings           the time above the level; at the wall also the distances that the
                    collar's centre and its surface cover in that time
torque maxima       the greatest bit torque. The torque is not a polynomial, as the
                    friction of a bit that breaks loose falls within a part of a step.
==================  =================================================================
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import Rows
from nsdrill.compiler.functions import BUFFER, INTEGER, compiled, inlined
from nsdrill.compiler.words import fma, lowest_bit, packed
from nsdrill.models.christoforou_yigit.friction import bit_law
from nsdrill.models.christoforou_yigit.layout import (
    CAPACITY,
    COLUMNS,
    CROSSINGS,
    EVENT_COUNT,
    EXTREMA,
    OBSERVED,
    PEAK_ROWS,
    PEAKS,
    RINGS,
    RINGS_OF_PEAKS,
    SPARE,
    TIME_PARTS,
    TORQUE_MAXIMA,
)
from nsdrill.models.christoforou_yigit.rhs import PARAMETERS
from nsdrill.observe.inside import next_peak, store_peak
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

OFFSETS = tuple(CAPACITY * i for i in range(COLUMNS))
G0, D0, C0, G1, D1, C1, LENGTH, LANE, KIND, LEVEL, RESULT = OFFSETS[:11]
# At the wall: whether the following columns are filled; the speed of the collar's
# centre along the wall and that of the bit, with their rates, at both ends; the
# distance that the centre covers along the wall and the angle that the string rotates.
HAS_WALL_SPEEDS = OFFSETS[11]
WALL_SPEEDS = OFFSETS[12:20]
TANGENTIAL0, DTANGENTIAL0, TANGENTIAL1, DTANGENTIAL1, SPEED0, DSPEED0, SPEED1, DSPEED1 = WALL_SPEEDS
ROLLED, ROTATED = OFFSETS[20:22]
CLEARANCE_SQUARED = OFFSETS[22]  # of the stabilisers; of an extremum of the squared radius
# A maximum of the bit torque has the interference first, then: the angle that the bit
# rotates, its speed with its rate and the torque with its rate at both ends, and the
# law of the bit times the rock's stiffness.
BIT_ROTATION, W0, DW0, W1, DW1, T0, DT0, T1, DT1, SMOOTHING, DECAY, RISE, DYNAMIC = OFFSETS[11:]
# Quantities with extrema. (Their level: the surface for interference and squared
# radius, the set speed for twist and bit speed.) SPEED_END is a bit speed at the end of
# a step that is above or below both of its neighbours.
Z, SPEED, TWIST, U, RHO, SPEED_END, DRIVE_SPEED = range(7)
# Levels that are crossed: the rock's surface, the speed below which the bit is stuck,
# the wall, the clearance of the stabilisers; and grazes of rock, wall and stabilisers.
# In the order of ``TIME_PARTS``: each kind has its own sum. A graze is detected only
# when the list of extrema is flushed, so its place among the crossings would depend on
# the neighbouring lanes.
ROCK, STUCK, WALL, STABILIZER, ROCK_GRAZE, WALL_GRAZE, STABILIZER_GRAZE = range(len(TIME_PARTS))


@inlined
def record_event(store, place, kind, i, h, g0, d0, c0, g1, d1, c1, level):  # type: ignore[no-untyped-def]
    """Append an event of lane i to the list at the offset ``place`` of the store: its
    ``kind``, the length h of the step, value g, slope d and second derivative c of the
    quantity at both ends, and a level. True if the list is now full."""
    count = int(store[place + EVENT_COUNT])
    k = place + count
    store[k + G0] = g0
    store[k + D0] = d0
    store[k + C0] = c0
    store[k + G1] = g1
    store[k + D1] = d1
    store[k + C1] = c1
    store[k + LENGTH] = h
    store[k + LANE] = float(i)
    store[k + KIND] = float(kind)
    store[k + LEVEL] = level
    store[place + EVENT_COUNT] = float(count + 1)
    return count + 1 == CAPACITY


@inlined
def record_row_event(b, store, place, kind, i, h, rows, minus, level):  # type: ignore[no-untyped-def]
    """As :func:`record_event`, of a quantity whose values, slopes and second
    derivatives at both ends are in these ``rows``; the slopes are reduced by
    ``minus``."""
    g0_, d0_, c0_, g1_, d1_, c1_ = rows
    return record_event(
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
def record_radius_event(b, store, place, kind, i, h, x_rows, y_rows, level):  # type: ignore[no-untyped-def]
    """As :func:`record_event`, of the squared radius, which is smooth also at the
    hole's centre; ``x_rows`` and ``y_rows`` are position, velocity and acceleration at
    both ends."""
    x0_, vx0_, ax0_, x1_, vx1_, ax1_ = x_rows
    y0_, vy0_, ay0_, y1_, vy1_, ay1_ = y_rows
    g0, d0, c0 = squared_radius(b, i, x0_, vx0_, ax0_, y0_, vy0_, ay0_)
    g1, d1, c1 = squared_radius(b, i, x1_, vx1_, ax1_, y1_, vy1_, ay1_)
    return record_event(store, place, kind, i, h, g0, d0, c0, g1, d1, c1, level)


@inlined
def squared_radius(b, i, x_, vx_, ax_, y_, vy_, ay_):  # type: ignore[no-untyped-def]
    """The squared radius of lane i at an end of the step, and its first and second
    derivatives."""
    x, vx, y, vy = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i]
    rate = fma(x, vx, y * vy)
    second = fma(vx, vx, fma(vy, vy, fma(x, b[ax_ + i], y * b[ay_ + i])))
    return fma(x, x, y * y), 2.0 * rate, 2.0 * second


@inlined
def lower_estimate(g0, g1, d0, d1, h):  # type: ignore[no-untyped-def]
    """A conservative estimate of the least value inside a step of length h of a
    quantity with one extremum there, from values g and slopes d at both ends. (A least
    value above the level has no effect and need not be located.)"""
    return min(g0, g1) - h * max(abs(d0), abs(d1))


@inlined
def tangential_speed(x, vx, ax, y, vy, ay, per_radius, dradius):  # type: ignore[no-untyped-def]
    """The tangential speed of the collar's centre around the hole [m/s] and its rate,
    from lateral state, accelerations, 1 / r and r'."""
    speed = fma(x, vy, -(y * vx)) * per_radius
    return speed, fma(-speed, dradius, fma(x, ay, -(y * ax))) * per_radius


@inlined
def record_wall_speeds(b, store, k, i, x_rows, y_rows, bit_rows):  # type: ignore[no-untyped-def]
    """Add to event k, one of the radius, the tangential speed of the collar and the bit
    speed, with their rates, at both ends of the step; ``bit_rows`` are the rows of bit
    speed, its rate, 1 / r and r' at the start and at the end."""
    x0_, vx0_, ax0_, x1_, vx1_, ax1_ = x_rows
    y0_, vy0_, ay0_, y1_, vy1_, ay1_ = y_rows
    speed0_, alpha0_, per_r0_, dr0_, speed1_, alpha1_, per_r1_, dr1_ = bit_rows
    tangential0, dtangential0 = tangential_speed(
        b[x0_ + i],
        b[vx0_ + i],
        b[ax0_ + i],
        b[y0_ + i],
        b[vy0_ + i],
        b[ay0_ + i],
        b[per_r0_ + i],
        b[dr0_ + i],
    )
    tangential1, dtangential1 = tangential_speed(
        b[x1_ + i],
        b[vx1_ + i],
        b[ax1_ + i],
        b[y1_ + i],
        b[vy1_ + i],
        b[ay1_ + i],
        b[per_r1_ + i],
        b[dr1_ + i],
    )
    store[k + TANGENTIAL0] = tangential0
    store[k + DTANGENTIAL0] = dtangential0
    store[k + TANGENTIAL1] = tangential1
    store[k + DTANGENTIAL1] = dtangential1
    store[k + SPEED0] = b[speed0_ + i]
    store[k + DSPEED0] = b[alpha0_ + i]
    store[k + SPEED1] = b[speed1_ + i]
    store[k + DSPEED1] = b[alpha1_ + i]


@inlined
def polynomial(store, k, of_rate):  # type: ignore[no-untyped-def]
    """Coefficients by theta of the quantity of event k, or with ``of_rate`` of its rate
    times the length of the step, and the slope at the end of the step."""
    h = store[k + LENGTH]
    g0, d0, c0 = store[k + G0], h * store[k + D0], h * h * store[k + C0]
    g1, d1, c1 = store[k + G1], h * store[k + D1], h * h * store[k + C1]
    p0, p1, p2, p3, p4, p5 = quintic(g0, d0, c0, g1, d1, c1)
    q0, q1, q2, q3, q4, q5 = derivative(p1, p2, p3, p4, p5)
    p0, p1, p2 = q0 if of_rate else p0, q1 if of_rate else p1, q2 if of_rate else p2
    p3, p4, p5 = q3 if of_rate else p3, q4 if of_rate else p4, q5 if of_rate else p5
    return p0, p1, p2, p3, p4, p5, c1 if of_rate else d1


@inlined
def locate_extrema(store):  # type: ignore[no-untyped-def]
    """The extreme value of each event of the list. (Rows after the last event are
    computed without use.)"""
    for k in packed(EXTREMA, EXTREMA + CAPACITY):
        of_rate = store[k + KIND] == SPEED or store[k + KIND] == DRIVE_SPEED
        p0, p1, p2, p3, p4, p5, end_slope = polynomial(store, k, of_rate)
        extremum = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, end_slope))
        store[k + RESULT] = extremum / store[k + LENGTH] + store[k + LEVEL] if of_rate else extremum


@inlined
def locate_crossings(store):  # type: ignore[no-untyped-def]
    """The time in each step of the list during which the quantity, or its rate, is
    above the level, and the integrals over that time of the speeds at the wall."""
    for k in packed(CROSSINGS, CROSSINGS + CAPACITY):
        of_rate = store[k + KIND] == STUCK
        p0, p1, p2, p3, p4, p5, end_slope = polynomial(store, k, of_rate)
        h = store[k + LENGTH]
        level = store[k + LEVEL] * (h if of_rate else 1.0)
        first, second, start, above_top, end = divide(p0, p1, p2, p3, p4, p5, end_slope, level)
        # For a graze (the last kinds) from above the whole step has been counted.
        whole = store[k + KIND] >= ROCK_GRAZE and store[k + G0] > store[k + LEVEL]
        store[k + RESULT] = h * above(first, second, 1.0, start, above_top, end) - (
            h if whole else 0.0
        )
        store[k + ROLLED] = h * integral_above(
            store[k + TANGENTIAL0],
            h * store[k + DTANGENTIAL0],
            store[k + TANGENTIAL1],
            h * store[k + DTANGENTIAL1],
            first,
            second,
            start,
            above_top,
            end,
            whole,
        )
        store[k + ROTATED] = h * integral_above(
            store[k + SPEED0],
            h * store[k + DSPEED0],
            store[k + SPEED1],
            h * store[k + DSPEED1],
            first,
            second,
            start,
            above_top,
            end,
            whole,
        )


@inlined
def integral_above(g0, d0, g1, d1, first, second, above_start, above_top, above_end, whole):  # type: ignore[no-untyped-def]
    """The integral by theta, over the part of the step above the level, of a speed with
    values g and slopes d at both ends; less that over the ``whole`` step if that is
    set. The part is given as by :func:`.interpolant.divide`."""
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
def locate_torque_maxima(store, number):  # type: ignore[no-untyped-def]
    """The greatest bit torque of each step of the list: force times arm, which both
    follow from the continuous solution. ``number`` is that of the friction law of the
    bit.

    Two iterations narrow a bracket to the maximum of the cubic through the values and
    slopes at its ends. The result is never above the greatest torque, and below it by
    less than the tolerance of the integration.
    """
    for k in packed(TORQUE_MAXIMA, TORQUE_MAXIMA + CAPACITY):
        h = store[k + LENGTH]
        interference = quintic(
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
            store[k + BIT_ROTATION],
            h * store[k + W1],
            h * h * store[k + DW1],
        )
        rotation, per_h = derivative(q1, q2, q3, q4, q5), 1.0 / h
        law = store[k + SMOOTHING], store[k + DECAY], store[k + RISE], store[k + DYNAMIC]
        low = 0.0, store[k + T0], h * store[k + DT0]
        high = 1.0, store[k + T1], h * store[k + DT1]
        # A loop would not be unrolled, and the loop around it then not vectorised.
        low, high = narrowed_bracket(low, high, interference, rotation, per_h, number, law)
        low, high = narrowed_bracket(low, high, interference, rotation, per_h, number, law)
        store[k + RESULT] = max(low[1], high[1])


@inlined
def narrowed_bracket(low, high, interference, rotation, per_h, number, law):  # type: ignore[no-untyped-def]
    """A narrower bracket (low, high) around the maximum of the bit torque, each end
    (theta, torque, slope), with the friction law of this ``number`` and its ``law`` of
    four numbers. ``interference`` and ``rotation`` are the coefficients by theta of the
    interference and of the bit speed times the step, ``per_h`` is 1 / h."""
    low_theta, low_torque, low_rate = low
    high_theta, high_torque, high_rate = high
    p0, p1, p2, p3, p4, p5 = interference
    w1, w2, w3, w4, w5, _ = rotation
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


@lru_cache
def make_events(
    lanes: int,
    rows: Rows,
    driven: int = 0,
    friction: int = 0,
    stabilizer: int = 0,
    clearance: int = 0,
) -> tuple[Any, Any]:
    """The compiled (record_events, flush_events) for a number of lanes, a row layout
    and the options that affect events, as in :class:`.options.ObserverOptions`.

    ``record_events(b, store, z, speed, highs, lows, twist, u, torque, rho, rock, stuck,
    wall, drive_speed, at_stabilizer)`` records the events of the step just accepted.
    Each argument after the store is a set of lanes, an integer with a bit for every
    lane:

    =====================  ============================================================
    z, speed, twist, u,    extremum of bit position, bit speed, twist, interference,
    rho, drive_speed       squared radius, speed of the drive
    highs, lows            bit speed at the start of the step above or below its
                           neighbours
    torque                 maximum of the bit torque
    rock, stuck, wall,     crossing of the rock's surface, of the speed below which the
    at_stabilizer          bit is stuck, of the wall, of the stabilisers' clearance
    =====================  ============================================================

    ``flush_events(b, store)`` empties the lists; it must be called before the
    measurements are read.
    """
    W = lanes
    h_, clearance_ = W * rows.step, W * (rows.parameter + clearance)
    set_speed_, gap_, stuck_, k_c_, eps_, tau_, rise_, mu_ = (
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
    offset = {name: W * (rows.observer + i) for i, name in enumerate(OBSERVED)}
    # Rows of value, slope and second derivative at both ends of the step.
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
    drive_rows = tuple(
        W * row
        for row in (  # no rows of an ideal drive
            rows.start + 8,
            rows.start + 9,
            rows.start_acceleration + 4,
            rows.stage + 8,
            rows.stage + 9,
            rows.acceleration + 4,
        )
    )
    lag0_, omega_d0_, alpha_d0_, lag1_, omega_d1_, alpha_d1_ = drive_rows
    u_rows = tuple(
        offset[f"{name}_{when}"] for when in ("before", "now") for name in ("u", "du", "ddu")
    )
    torque0_, dtorque0_, torque1_, dtorque1_ = (
        offset[f"{name}_{when}"] for when in ("before", "now") for name in ("torque", "dtorque")
    )
    twist0_, speed0_, alpha0_, twist1_, speed1_, alpha1_ = twist_rows
    wall_speed_rows = (
        speed0_,
        alpha0_,
        offset["per_radius_before"],
        offset["dradius_before"],
        speed1_,
        alpha1_,
        offset["per_radius_now"],
        offset["dradius_now"],
    )
    time_parts_, rolled_, rolled_grazes_ = (
        offset[TIME_PARTS[0]],
        offset["rolled_crossings"],
        offset["rolled_grazes"],
    )
    u0_, du0_, _, u1_, du1_, _ = u_rows
    torque_max_, floor_, growth_ = (
        offset["torque_max"],
        offset["torque_floor"],
        offset["margin_growth"],
    )
    # For each quantity with extrema: the rows of its greatest and least value, the ring
    # of its peaks, and the rows that decide on peaks.
    greatest_ = np.array(
        [
            offset[name]
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
            offset[name]
            for name in ("z_min", "speed_min", "twist_min", "spare", "spare", "spare", "drive_min")
        ]
    )
    ring_of = np.array([0, 1, -1, -1, 2, 1, -1])
    low_ = np.array(
        [offset[f"low_{ring}"] for ring in ("z", "speed", "else", "else", "else", "speed", "else")]
    )
    to_high, to_margin, to_top = (W * PEAK_ROWS.index(name) for name in ("high", "margin", "top"))

    @compiled(BUFFER, BUFFER)
    def flush_crossings(b, store):  # type: ignore[no-untyped-def]
        locate_crossings(store)
        for k in range(CROSSINGS, CROSSINGS + int(store[CROSSINGS + EVENT_COUNT])):
            i, kind = int(store[k + LANE]), int(store[k + KIND])
            b[time_parts_ + W * kind + i] += store[k + RESULT]
            if kind in (WALL, WALL_GRAZE):
                row = i + (rolled_ if kind == WALL else rolled_grazes_)
                b[row] += store[k + ROLLED]
                b[row + W] += store[k + ROTATED]
        store[CROSSINGS + EVENT_COUNT] = 0.0

    @compiled(BUFFER, BUFFER)
    def flush_extrema(b, store):  # type: ignore[no-untyped-def]
        peaks = int(store[PEAKS])
        locate_extrema(store)
        for k in range(EXTREMA, EXTREMA + int(store[EXTREMA + EVENT_COUNT])):
            i, kind, extremum = int(store[k + LANE]), int(store[k + KIND]), store[k + RESULT]
            # Branches would be unpredictable, so values without a row go to the spare
            # one.
            rising = store[k + (C0 if kind in (SPEED, DRIVE_SPEED) else D0)] > 0.0
            row = (greatest_[kind] if rising else least_[kind]) + i
            b[row] = max(b[row], extremum) if rising else min(b[row], extremum)
            # A greatest value becomes a maximum as soon as the quantity has fallen by
            # the prominence below it; every maximum of the radius is a peak, as its
            # least values are not located.
            row = low_[kind] + i
            low, high = b[row], b[row + to_high]
            margin = fma(b[growth_ + i], abs(extremum), b[row + to_margin])
            high = max(high, extremum) if rising and extremum - low > margin else high
            fallen = not rising and high - extremum > margin
            may_stick = kind in (SPEED, SPEED_END)
            is_peak, height, dropped, top = next_peak(
                low,
                high,
                b[row + to_top],
                b[stuck_ + i] if may_stick else -np.inf,
                b[set_speed_ + i] if may_stick else np.inf,
            )
            b[row] = low if rising else (extremum if fallen else min(low, extremum))
            b[row + to_high] = -np.inf if fallen else high
            b[row + to_top] = top if fallen else b[row + to_top]
            ring = RINGS + (RINGS_OF_PEAKS * i + ring_of[kind]) * (peaks + 1)
            store[ring if fallen and dropped and peaks > 0 else SPARE] = 0.0
            peak = rising if kind == RHO else fallen and is_peak
            store_peak(
                store,
                ring if peak and peaks > 0 else SPARE,
                peaks,
                extremum if kind == RHO else height,
            )
            # A graze, with both ends on one side of the surface and the extremum on the
            # other, is two crossings. It is rare.
            level = store[k + LEVEL]
            above0, above1, above = store[k + G0] > level, store[k + G1] > level, extremum > level
            if kind in (U, RHO) and above0 == above1 and above0 != above:
                crossing = CROSSINGS + int(store[CROSSINGS + EVENT_COUNT])
                known = kind == RHO and store[k + HAS_WALL_SPEEDS] != 0.0
                for column in WALL_SPEEDS:
                    store[crossing + column] = store[k + column] if known else 0.0
                if record_event(
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
                    flush_crossings(b, store)
                if stabilizer and kind == RHO:
                    level = store[k + CLEARANCE_SQUARED]
                    above0, above1, above = (
                        store[k + G0] > level,
                        store[k + G1] > level,
                        extremum > level,
                    )
                    grazes = above0 == above1 and above0 != above
                    if grazes and record_event(
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
                        flush_crossings(b, store)
        store[SPARE] = 0.0
        store[EXTREMA + EVENT_COUNT] = 0.0

    @compiled(BUFFER, BUFFER)
    def flush_torque_maxima(b, store):  # type: ignore[no-untyped-def]
        locate_torque_maxima(store, friction)
        for k in range(TORQUE_MAXIMA, TORQUE_MAXIMA + int(store[TORQUE_MAXIMA + EVENT_COUNT])):
            row = torque_max_ + int(store[k + LANE])
            b[row] = max(b[row], store[k + RESULT])
        store[TORQUE_MAXIMA + EVENT_COUNT] = 0.0

    @compiled(BUFFER, BUFFER)
    def flush_events(b, store):  # type: ignore[no-untyped-def]
        flush_extrema(b, store)
        flush_crossings(b, store)
        flush_torque_maxima(b, store)

    @compiled(BUFFER, BUFFER, *[INTEGER] * 13)
    def record_events(  # type: ignore[no-untyped-def]
        b,
        store,
        z,
        speed,
        highs,
        lows,
        twist,
        u,
        torque,
        rho,
        rock,
        stuck,
        wall,
        drive_speed,
        at_stabilizer,
    ):
        while z != 0:
            i = lowest_bit(z)
            z &= z - 1
            if record_row_event(b, store, EXTREMA, Z, i, b[h_ + i], z_rows, 0.0, 0.0):
                flush_extrema(b, store)
        # Extrema at the ends of steps, without length and slopes: their value is the
        # bit speed itself.
        ends = highs | lows
        while ends != 0:
            i = lowest_bit(ends)
            ends &= ends - 1
            omega = b[speed0_ + i]
            if record_event(
                store,
                EXTREMA,
                SPEED_END,
                i,
                0.0,
                omega,
                1.0 if (highs >> i) & 1 != 0 else -1.0,
                0.0,
                omega,
                0.0,
                0.0,
                0.0,
            ):
                flush_extrema(b, store)
        # The twist, and its rate: the bit speed less that of the drive.
        for kind in (SPEED, TWIST):
            remaining = speed if kind == SPEED else twist
            while remaining != 0:
                i = lowest_bit(remaining)
                remaining &= remaining - 1
                set_speed = b[set_speed_ + i]
                if driven and kind == TWIST:
                    g0, g1 = b[twist0_ + i] - b[lag0_ + i], b[twist1_ + i] - b[lag1_ + i]
                    d0, d1 = b[speed0_ + i] - b[omega_d0_ + i], b[speed1_ + i] - b[omega_d1_ + i]
                    c0, c1 = b[alpha0_ + i] - b[alpha_d0_ + i], b[alpha1_ + i] - b[alpha_d1_ + i]
                    if record_event(
                        store, EXTREMA, TWIST, i, b[h_ + i], g0, d0, c0, g1, d1, c1, 0.0
                    ):
                        flush_extrema(b, store)
                elif record_row_event(
                    b, store, EXTREMA, kind, i, b[h_ + i], twist_rows, set_speed, set_speed
                ):
                    flush_extrema(b, store)
        while drive_speed != 0:
            i = lowest_bit(drive_speed)
            drive_speed &= drive_speed - 1
            if record_row_event(
                b,
                store,
                EXTREMA,
                DRIVE_SPEED,
                i,
                b[h_ + i],
                drive_rows,
                b[set_speed_ + i],
                b[set_speed_ + i],
            ):
                flush_extrema(b, store)
        while u != 0:
            i = lowest_bit(u)
            u &= u - 1
            u0, u1, du0, du1 = b[u0_ + i], b[u1_ + i], b[du0_ + i], b[du1_ + i]
            if du0 <= 0.0 and (u0 <= 0.0 or lower_estimate(u0, u1, du0, du1, b[h_ + i]) >= 0.0):
                continue
            if record_row_event(b, store, EXTREMA, U, i, b[h_ + i], u_rows, 0.0, 0.0):
                flush_extrema(b, store)
        while rho != 0:
            i = lowest_bit(rho)
            rho &= rho - 1
            k, level = EXTREMA + int(store[EXTREMA + EVENT_COUNT]), b[gap_ + i] * b[gap_ + i]
            full = record_radius_event(b, store, EXTREMA, RHO, i, b[h_ + i], x_rows, y_rows, level)
            # It may be a graze if the extremum lies towards the wall and the squared
            # radius could reach the wall at its slopes.
            outside = store[k + G0] > level
            grazes = outside == (store[k + G1] > level) and outside != (store[k + D0] > 0.0)
            if grazes:
                steepest = b[h_ + i] * max(abs(store[k + D0]), abs(store[k + D1]))
                grazes = (
                    min(abs(store[k + G0] - level), abs(store[k + G1] - level)) < 2.0 * steepest
                )
            store[k + HAS_WALL_SPEEDS] = 1.0 if grazes else 0.0
            if stabilizer:
                store[k + CLEARANCE_SQUARED] = b[clearance_ + i] * b[clearance_ + i]
            if grazes:
                record_wall_speeds(b, store, k, i, x_rows, y_rows, wall_speed_rows)
            if full:
                flush_extrema(b, store)
        while rock != 0:
            i = lowest_bit(rock)
            rock &= rock - 1
            # Where the contact begins, the torque may have its maximum as well.
            torque |= (1 << i) if b[u1_ + i] > 0.0 and b[dtorque1_ + i] <= 0.0 else 0
            if record_row_event(b, store, CROSSINGS, ROCK, i, b[h_ + i], u_rows, 0.0, 0.0):
                flush_crossings(b, store)
        while torque != 0:
            i = lowest_bit(torque)
            torque &= torque - 1
            k, h, k_c = (
                TORQUE_MAXIMA + int(store[TORQUE_MAXIMA + EVENT_COUNT]),
                b[h_ + i],
                b[k_c_ + i],
            )
            # Most maxima are far below the greatest torque. (They are not compared with
            # the greatest so far, which depends on the neighbouring lanes.)
            highest = max(b[torque0_ + i], b[torque1_ + i])
            if highest + 0.5 * h * max(b[dtorque0_ + i], -b[dtorque1_ + i]) < b[floor_ + i]:
                continue
            b[floor_ + i] = max(b[floor_ + i], highest)
            store[k + BIT_ROTATION] = fma(b[set_speed_ + i], h, b[twist1_ + i] - b[twist0_ + i])
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
            if record_row_event(b, store, TORQUE_MAXIMA, U, i, h, u_rows, 0.0, 0.0):
                flush_torque_maxima(b, store)
        while stuck != 0:
            i = lowest_bit(stuck)
            stuck &= stuck - 1
            set_speed = b[set_speed_ + i]
            if record_row_event(
                b,
                store,
                CROSSINGS,
                STUCK,
                i,
                b[h_ + i],
                twist_rows,
                set_speed,
                b[stuck_ + i] - set_speed,
            ):
                flush_crossings(b, store)
        while wall != 0:
            i = lowest_bit(wall)
            wall &= wall - 1
            k = CROSSINGS + int(store[CROSSINGS + EVENT_COUNT])
            record_wall_speeds(b, store, k, i, x_rows, y_rows, wall_speed_rows)
            if record_radius_event(
                b, store, CROSSINGS, WALL, i, b[h_ + i], x_rows, y_rows, b[gap_ + i] * b[gap_ + i]
            ):
                flush_crossings(b, store)
        if stabilizer:
            while at_stabilizer != 0:
                i = lowest_bit(at_stabilizer)
                at_stabilizer &= at_stabilizer - 1
                level = b[clearance_ + i] * b[clearance_ + i]
                if record_radius_event(
                    b, store, CROSSINGS, STABILIZER, i, b[h_ + i], x_rows, y_rows, level
                ):
                    flush_crossings(b, store)

    return record_events, flush_events
