"""What a declared channel does inside a step: it turns, or passes its level. For one
lane at a time, as this is rare; the polynomials are those of
:mod:`nsdrill.observe.interpolant`.
"""

from __future__ import annotations

import numpy as np

from nsdrill.abi import inlined
from nsdrill.elementary import fma
from nsdrill.observe.interpolant import (
    above,
    crossing,
    cubic,
    extreme,
    position_and_velocity,
    slope,
    value,
)

# Of what has peaks, as many rows: the least value since the last one, the greatest
# since then, if it may become one, and how far a peak stands out at a value of zero.
LOW, HIGH, MARGIN = range(3)
NONE = -1  # no row


@inlined
def turns(before, now):  # type: ignore[no-untyped-def]
    """Whether a slope changes its sign; the turn is a maximum where it was positive
    before."""
    return (before > 0.0) != (now > 0.0)


@inlined
def look(b, store, i, W, found, low_, growth_, ring, peaks):  # type: ignore[no-untyped-def]
    """The next value of something with peaks. A greatest value becomes a peak as soon
    as the quantity has fallen far enough below it. (The packed loop does the same where
    no peak comes of it.)"""
    low, high = b[low_ + i], b[low_ + HIGH * W + i]
    margin = fma(b[growth_ + i], abs(found), b[low_ + MARGIN * W + i])
    if high - found > margin:
        if peaks > 0:
            count = int(store[ring])
            store[ring + 1 + count % peaks] = high
            store[ring] = count + 1
        b[low_ + i] = found
        b[low_ + HIGH * W + i] = -np.inf
    else:
        b[low_ + i] = min(low, found)
        b[low_ + HIGH * W + i] = max(high, found) if found - low > margin else high


@inlined
def passage(p0, p1, p2, p3, p4, p5, low, high, above_at_low):  # type: ignore[no-untyped-def]
    """Where the polynomial passes zero between ``low``, from which it comes from above
    or from below, and ``high``: to 1e-13. Newton, kept inside a shrinking bracket by
    bisection. (On which side it comes is told, as a run may start on zero itself.)"""
    theta = 0.5 * (low + high)
    for _ in range(60):
        rest, bend = value(p0, p1, p2, p3, p4, p5, theta), slope(p1, p2, p3, p4, p5, theta)
        before = (rest > 0.0) == above_at_low
        low, high = theta if before else low, high if before else theta
        following = theta - rest / bend
        if not (low <= following <= high):
            following = 0.5 * (low + high)
        if abs(following - theta) < 1e-13:
            break
        theta = following
    return theta


@inlined
def locate(  # type: ignore[no-untyped-def]
    b,
    store,
    i,
    W,
    h,
    begin,
    p0,
    p1,
    p2,
    p3,
    p4,
    p5,
    end,
    end_slope,
    level,
    least_,
    above_,
    passages_,
    low_,
    growth_,
    ring,
    peaks,
):
    """What a channel of lane i does inside a step of length ``h``, from its polynomial,
    the values ``begin`` and ``end`` and the slope at the end. Then come the rows where
    its findings stand, or NONE: the least value, before the greatest; the time above;
    the passages; the least value since the last peak."""
    turning = turns(p1, end_slope)
    turn, found = 1.0, end
    if turning:
        turn = extreme(p1, p2, p3, p4, p5, end_slope)
        found = value(p0, p1, p2, p3, p4, p5, turn)
    if least_ != NONE:
        b[least_ + i] = min(b[least_ + i], found)
        b[least_ + W + i] = max(b[least_ + W + i], found)
    if low_ != NONE:
        if turning:
            look(b, store, i, W, found, low_, growth_, ring, peaks)
        look(b, store, i, W, end, low_, growth_, ring, peaks)
    if above_ != NONE:
        # The turn, or else the end, divides the step into two parts with at most one
        # crossing each.
        above0, top, above1 = begin > level, found > level, end > level
        if above0 != top or above1 != top:
            first, second = turn, 1.0
            if above0 != top:
                first = passage(p0 - level, p1, p2, p3, p4, p5, 0.0, turn, above0)
            if above1 != top:
                second = passage(p0 - level, p1, p2, p3, p4, p5, turn, 1.0, top)
            # a visit to one side, which the ends do not show
            if passages_ != NONE and above0 == above1:
                b[passages_ + i] += 1.0
            # A step with both ends above was counted as a whole.
            b[above_ + i] += h * above(first, second, 1.0, above0, top, above1) - (
                h if above0 and above1 else 0.0
            )


@inlined
def note_returns(  # type: ignore[no-untyped-def]
    b,
    store,
    i,
    W,
    h,
    p0,
    p1,
    p2,
    p3,
    p4,
    p5,
    end,
    spacing,
    level_,
    ring,
    returns,
    pairs,
    singles,
    start_,
    stage_,
    slope0_,
    slope1_,
    frame_rate_,
):
    """Note all states where the polynomial reaches the next multiples of
    ``spacing``."""
    entry = 2 * pairs + singles + 1
    level = b[level_ + i]
    while end >= level:
        theta = crossing(p0 - level, p1, p2, p3, p4, p5, 0.0, 1.0)
        count = int(store[ring])
        place = ring + 1 + entry * (count % returns)
        for k in range(pairs):
            x, a = 2 * k * W, k * W
            position, velocity = position_and_velocity(
                b,
                i,
                theta,
                h,
                b[frame_rate_ + a + i],
                start_ + x,
                start_ + x + W,
                slope0_ + a,
                stage_ + x,
                stage_ + x + W,
                slope1_ + a,
            )
            store[place + 2 * k] = position
            store[place + 2 * k + 1] = velocity
        for k in range(singles):
            x, a = (2 * pairs + k) * W + i, (pairs + k) * W + i
            q0, q1, q2, q3, q4, q5 = cubic(
                b[start_ + x], h * b[slope0_ + a], b[stage_ + x], h * b[slope1_ + a]
            )
            store[place + 2 * pairs + k] = value(q0, q1, q2, q3, q4, q5, theta)
        store[place + entry - 1] = level
        store[ring] = count + 1
        # By number, not by adding up: the levels of a long run are multiples of the
        # spacing.
        following = (np.rint(level / spacing) + 1.0) * spacing
        level = following if following > level else np.inf
    b[level_ + i] = level
