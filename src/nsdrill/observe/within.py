"""A quantity that may bend and jump within a step: it is evaluated on the continuous
solution at several places of each step, and at more where these do not give it.

All lanes together are evaluated at the ends and the middles of :data:`PANELS` equal
panels. Where in each the cubic through both ends meets the middle, and nothing that is
watched turns, the cubics of the half panels are the quantity. In a lane where that is not
so, panels are halved until it is, or are :data:`LEAST` of a step, or :data:`MOST` have been
tried: then only the values at their places count.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.compiler.functions import BUFFER, LaneFunction, compiled, fma, inlined, local, lowest_bit, masks, packed
from nsdrill.observe.channels import Channel, Outrun, arguments
from nsdrill.observe.inside import NONE, cubic, motion_of_pair, slope, top_of_cubic, value
from nsdrill.observe.placed import END, START, Placed, add_where

PANELS = 4
LEAST = 2.0**-12  # of a step: to that a jump is placed
MOST = 200  # panels that are tried in a step: a jump takes some 25
SLIGHT = 0.25  # changes of what a function is taken of: within it a function is smooth
CLOSE = 1e-3  # natural scales by which a cubic may miss the middle of a panel

# What is known of a step so far.
TOTAL, LOW, HIGH, BEYOND, TRAVEL, SUMS = range(6)


def make_follower(placed: Placed, channel: Channel) -> LaneFunction:
    """The compiled function ``follow(buffer)``, which adds a step of all lanes to what is
    measured of a channel ``within`` steps."""
    W, rows, name = placed.lanes, placed.rows, channel.name
    step_, moves_, observing_ = W * rows.step, W * rows.moves, W * rows.observing
    least_, greatest_, integral_ = (placed.offset(what, name) for what in ("least", "greatest", "integral"))
    outrun = [one for one in placed.declaration.of_kind(Outrun) if one.channel == name]
    outruns = tuple((placed.offset("outrun", one.name), BEYOND if one.beyond else TRAVEL) for one in outrun)
    at, scale = evaluated(placed, channel), placed.scale(channel)
    count, panel = _count(channel), _panel(channel)
    numbered, size = tuple(range(count)), W * (SUMS + count)
    walk = _walk(at, panel, count)

    @compiled(BUFFER)
    def follow(b):
        c = local(size)
        sets = masks(1)
        for i in packed(W):
            found = at(b, i, 0.0)
            for k in numbered:
                c[(SUMS + k) * W + i] = found[k]
            c[TOTAL * W + i] = 0.0
            c[LOW * W + i], c[HIGH * W + i] = np.inf, -np.inf
            c[BEYOND * W + i] = c[TRAVEL * W + i] = 0.0
        theta = 0.0
        while theta < 1.0:
            for i in packed(W):
                first = tuple(c[(SUMS + k) * W + i] for k in numbered)
                middle, last = at(b, i, theta + 0.5 / PANELS), at(b, i, theta + 1.0 / PANELS)
                total, low, high = c[TOTAL * W + i], c[LOW * W + i], c[HIGH * W + i]
                misses, turns, further, sums, _ = panel(
                    total, low, high, first, middle, last, b[step_ + i] * (1.0 / PANELS), CLOSE * scale(b, i)
                )
                c[TOTAL * W + i], c[LOW * W + i], c[HIGH * W + i] = sums
                c[TRAVEL * W + i] += further
                for k in numbered:
                    c[(SUMS + k) * W + i] = last[k]
                counts = (misses or turns) and b[moves_ + i] * b[observing_ + i] != 0.0 and b[step_ + i] > 0.0
                sets[0] |= (1 << i) if counts else 0
            theta += 1.0 / PANELS
        rough = sets[0]
        while rough != 0:
            i = lowest_bit(rough)
            rough &= rough - 1
            sums = walk(b, i, b[step_ + i], CLOSE * scale(b, i))
            for k in range(SUMS):
                c[k * W + i] = sums[k]
        for i in packed(W):
            counts = b[moves_ + i] * b[observing_ + i] != 0.0 and b[step_ + i] > 0.0
            if least_ != NONE:
                least = b[least_ + i]
                b[least_ + i] = min(least, c[LOW * W + i]) if counts else least
            if greatest_ != NONE:
                greatest = b[greatest_ + i]
                b[greatest_ + i] = max(greatest, c[HIGH * W + i]) if counts else greatest
            if integral_ != NONE:
                add_where(b, integral_ + i, counts, c[TOTAL * W + i])
            for outrun_, what in outruns:
                add_where(b, outrun_ + i, counts, c[what * W + i])

    return follow


def _count(channel: Channel) -> int:
    """How many numbers it has at a place: its value, its slope, and what is watched."""
    watched = vars(channel.within or channel.watched)
    return 2 + 2 * watched["compared"] + watched["bent"]


def evaluated(placed: Placed, channel: Channel) -> Callable[..., tuple[float, ...]]:
    """The function that gives the value, the slope and what is watched of a channel in lane
    i at theta inside the step."""
    of_channel = channel.within or channel.watched
    assert of_channel is not None
    W, rows, names = placed.lanes, placed.rows, placed.names
    function, given = placed.inlined(of_channel), arguments(of_channel)
    pairs = [(p, (*names.states[2 * p : 2 * p + 2], names.slopes[p])) for p in range(rows.pairs)]
    pairs = [(p, of) for p, of in pairs if not set(of).isdisjoint(given)]
    singles = [*zip(names.states[2 * rows.pairs :], names.slopes[rows.pairs :], strict=True)]
    singles = [of for of in singles if not set(of).isdisjoint(given)]
    order = [name for of in (*(of for _, of in pairs), *singles) for name in of]
    fixed = [name for name in given if name not in order and name != "time"]
    order = [*order, "time", *fixed]
    picks = tuple(order.index(name) for name in given)

    def places(of: tuple[str, ...]) -> tuple[int, ...]:
        return tuple(placed.place(name, when) for when in (START, END) for name in of)

    pair_places = tuple((W * (rows.frame_rate + p), places(of)) for p, of in pairs)
    single_places = tuple(places(of) for of in singles)
    fixed_places = tuple(placed.place(name) for name in fixed)
    step_, time_ = W * rows.step, W * rows.time
    watched = tuple(range(2, _count(channel)))

    @inlined
    def at(b, i, theta):
        h = b[step_ + i]
        found = ()
        for frame_, of_pair in pair_places:
            found += motion_of_pair(b, i, theta, h, b[frame_ + i], *of_pair)
        for x0_, d0_, x1_, d1_ in single_places:
            p = cubic(b[x0_ + i], h * b[d0_ + i], b[x1_ + i], h * b[d1_ + i])
            found += (value(p, theta), slope(p, theta) / h)
        found += (fma(theta, h, b[time_ + i]),)
        found += tuple(b[place + i] for place in fixed_places)
        now = function(*tuple(found[k] for k in picks))
        # where a part of it overflows, as of a wave far from its place, nothing changes
        return (now[0], now[1] if abs(now[1]) < np.inf else 0.0, *tuple(now[k] for k in watched))

    return at


@inlined
def _half(total, low, high, first, last, h):
    """A total, a least and a greatest value with those of the cubic through two places h
    apart."""
    g0, d0, g1, d1 = first[0], h * first[1], last[0], h * last[1]
    rises = d0 > 0.0
    has_top = rises != (d1 > 0.0)
    sign = 1.0 if rises else -1.0
    inside = value(cubic(g0, d0, g1, d1), top_of_cubic(sign * g0, sign * d0, sign * g1, sign * d1)) if has_top else g1
    total = fma(h, fma(1.0 / 12.0, d0 - d1, 0.5 * (g0 + g1)), total)
    return total, min(low, min(g0, min(g1, inside))), max(high, max(g0, max(g1, inside)))


def _panel(channel: Channel) -> Callable[..., tuple[bool, bool, float, tuple[float, ...], tuple[float, ...]]]:
    """The function that looks at a panel of length h: whether the cubic ``misses`` the
    middle, by its value or slope, whether what is watched ``turns``, how far the quantity
    goes, and the total, the least and the greatest value with those of the panel: by its
    cubics, and by its values alone."""
    first_bent = 2 + 2 * vars(channel.within)["compared"]
    compared, bent = tuple(range(2, first_bent, 2)), tuple(range(first_bent, _count(channel)))

    @inlined
    def panel(total, low, high, first, middle, last, h, close):
        g0, d0, g1, d1 = first[0], h * first[1], last[0], h * last[1]
        value_off = middle[0] - fma(0.125, d0 - d1, 0.5 * (g0 + g1))
        slope_off = 0.125 * (h * middle[1] - fma(1.5, g1 - g0, -0.25 * (d0 + d1)))
        misses = abs(value_off) > close or abs(slope_off) > close
        turns = False
        for k in compared:
            for one, other in ((first, middle), (middle, last)):
                reach = 0.5 * h * (abs(one[k + 1]) + abs(other[k + 1]))
                may_graze = (one[k + 1] > 0.0) != (other[k + 1] > 0.0) and min(abs(one[k]), abs(other[k])) < reach
                turns = turns or (one[k] > 0.0) != (other[k] > 0.0) or may_graze
        for k in bent:
            for one, other in ((first, middle), (middle, last)):
                bends = h * (abs(one[k]) + abs(other[k])) > SLIGHT
                turns = turns or (bends and (one[k] > 0.0) != (other[k] > 0.0))
        further = max(abs(g1 - g0), 0.5 * (abs(d0) + abs(d1)))
        half, low_half, high_half = _half(total, low, high, first, middle, 0.5 * h)
        followed = _half(half, low_half, high_half, middle, last, 0.5 * h)
        total = fma(h * (1.0 / 6.0), fma(4.0, middle[0], g0 + g1), total)
        sampled = total, min(low, min(g0, min(g1, middle[0]))), max(high, max(g0, max(g1, middle[0])))
        return misses, turns, further, followed, sampled

    return panel


def _walk(
    at: Callable[..., tuple[float, ...]], panel: Callable[..., tuple[Any, ...]], count: int
) -> Callable[..., tuple[float, ...]]:
    """The function that goes through the step of one lane in panels that fit the
    quantity."""
    numbered = tuple(range(count))

    @inlined
    def walk(b, i, h, close):
        total, low, high, beyond, travel = 0.0, np.inf, -np.inf, 0.0, 0.0
        theta, width, tried, kept, begin = 0.0, 1.0 / PANELS, 0, local(count), at(b, i, 0.0)
        for k in numbered:
            kept[k] = begin[k]
        while theta < 1.0:
            first = tuple(kept[k] for k in numbered)
            middle, last = at(b, i, theta + 0.5 * width), at(b, i, theta + width)
            # of what its scale is too small for, as of a wave that the trial run has not met
            range_ = CLOSE * (max(max(first[0], last[0]), high) - min(min(first[0], last[0]), low))
            misses, turns, further, followed, sampled = panel(
                total, low, high, first, middle, last, width * h, max(close, range_)
            )
            is_rough = misses or turns
            tried += 1
            if is_rough and width > LEAST and tried < MOST:
                width = 0.5 * width
            else:
                total = sampled[0] if is_rough else followed[0]
                low = sampled[1] if is_rough else followed[1]
                high = sampled[2] if is_rough else followed[2]
                travel += further
                # beside a jump slopes are of the quantity on either side; towards a pole they grow
                steep = 0.5 * width * h * (abs(first[1]) + abs(last[1])) > abs(last[0] - first[0])
                beyond += further if misses and (width > LEAST or steep) else 0.0
                theta += width
                for k in numbered:
                    kept[k] = last[k]
                twice = 2.0 * width
                if width < 1.0 / PANELS and np.floor(theta / twice) * twice == theta:
                    width = twice
        return total, low, high, beyond, travel

    return walk
