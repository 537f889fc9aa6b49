"""The events of a step: extrema, crossings of levels and returns to the section, one and
one lane after the other, as they are rare."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from nsdrill.compiler.functions import BUFFER, INTEGER, LaneFunction, compiled, fma, inlined, lowest_bit
from nsdrill.observe.channels import Channel, MeanAbove, Section, TimeAbove, arguments
from nsdrill.observe.findings import PEAKS, RETURNS, RINGS
from nsdrill.observe.inside import (
    CYCLE_LOW,
    LOW,
    NONE,
    count_cycles,
    integral_above,
    measure_events,
    record_returns,
    slope,
    top_of_cubic,
    value,
)
from nsdrill.observe.placed import Placed
from nsdrill.observe.within import evaluated

# What attends to an event of lane i: of the buffer, the store, i, the length of the step,
# the numbers of peaks and of returns that are kept.
Attend = Callable[..., None]


class Event(NamedTuple):
    """What may happen inside a step, each with its set of lanes: extrema of a channel
    and crossings of a level (``above``), or the maximum of a channel that no polynomial
    follows."""

    channel: Channel
    above: TimeAbove | None = None
    has_extremes: bool = False


def events_of(placed: Placed) -> list[Event]:
    """The events of the channels, in order; the first of a channel has its extremes and
    its first level, others have further levels."""
    events, declaration = [], placed.declaration
    for channel in declaration.channels:
        if channel.within:
            continue
        levels: list[TimeAbove | None] = [
            above for above in declaration.of_kind(TimeAbove) if above.channel == channel.name
        ]
        has_extremes = channel.name in declaration.extremes
        if has_extremes and not levels:
            levels = [None]
        events += [Event(channel, above, has_extremes and number == 0) for number, above in enumerate(levels)]
    return events


def make_handler(placed: Placed, events: list[Event]) -> LaneFunction:
    """The compiled function ``handle_events(buffer, store, *due)``: a set of lanes for each
    event, and for the returns to the section if there is one."""
    attending = [_maximum(placed, event.channel) if event.channel.inside else _event(placed, event) for event in events]
    if placed.declaration.section:
        attending.append(_returns(placed, placed.declaration.section))
    numbered, step_ = tuple(enumerate(attending)), placed.lanes * placed.rows.step

    @compiled(BUFFER, BUFFER, *[INTEGER for _ in numbered])
    def handle_events(b, store, *due):
        peaks, returns = int(store[PEAKS]), int(store[RETURNS])
        for number, attend in numbered:
            lanes = due[number]
            while lanes != 0:
                i = lowest_bit(lanes)
                lanes &= lanes - 1
                attend(b, store, i, b[step_ + i], peaks, returns)

    return handle_events


def _returns(placed: Placed, section: Section) -> Attend:
    """Records returns to the section."""
    W, rows, entry = placed.lanes, placed.rows, len(placed.names.states) + 1
    rings, level_ = len(placed.declaration.channels_with_peaks), placed.offset("level")
    polynomial, spacing = placed.polynomial(placed.channel(section.channel)), placed.spacing()
    places = (
        rows.pairs, rows.singles, W * rows.start, W * rows.stage, W * rows.start_acceleration, W * rows.acceleration,
        W * rows.frame_rate,
    )  # fmt: skip

    @inlined
    def attend(b, store, i, h, peaks, returns):
        ends, p = polynomial(b, i, h)
        ring = RINGS + rings * W * (peaks + 1) + i * (1 + entry * returns)
        record_returns(b, store, i, W, h, p, ends[3], spacing(b, i, store), level_, ring, returns, *places)

    return attend


def _event(placed: Placed, event: Event) -> Attend:
    """Measures extrema and crossings of a channel."""
    (channel, above, has_extremes), W, declaration = event, placed.lanes, placed.declaration
    name, found, with_peaks = channel.name, declaration.extremes.get(channel.name), declaration.channels_with_peaks
    least_, greatest_, low_ = (
        placed.offset(what, name) if has_extremes else NONE for what in ("least", "greatest", LOW)
    )
    above_ = placed.offset("above", above.name) if above else NONE
    passages_ = placed.offset("passages", name) if above and above.level is None else NONE
    has_peaks, growth_ = has_extremes and name in with_peaks, placed.offset("growth")
    rings, ring = len(with_peaks), with_peaks.index(name) if has_peaks else 0
    every, at_ends = has_peaks and found is not None and found.maxima, found is None or not found.smooth
    is_counted = has_extremes and name in declaration.counted
    level, (stuck, slip), is_followed = placed.level(channel, above), placed.slip(channel), placed.is_followed(name)
    polynomial, add_above = placed.polynomial(channel), _parts_above(placed, event)
    count = _cycles(placed, channel) if is_counted else None
    is_watched, add_stepped = channel.watched is not None, _stepped(placed, event)

    @inlined
    def attend(b, store, i, h, peaks, returns):
        ends, p = polynomial(b, i, h)
        begin, end = ends[0], ends[3]
        division = measure_events(
            b, store, i, W, h, begin, p, end, h * ends[4], level(b, i), stuck(b, i), slip(b, i), is_followed(b, i),
            least_, greatest_, above_, passages_, low_, growth_, RINGS + (rings * i + ring) * (peaks + 1), peaks,
            every, at_ends,
        )  # fmt: skip
        add_above(b, i, h, division)
        if is_watched:
            add_stepped(b, i, h, p, ends, level(b, i), division)
        if is_counted:
            count(b, i, h, p, begin, end)

    return attend


def _cycles(placed: Placed, channel: Channel) -> Callable[..., None]:
    """Counts the cycles of a channel."""
    name, W, time_, scale = channel.name, placed.lanes, placed.lanes * placed.rows.time, placed.scale(channel)
    keys = ("least", name), ("greatest", name), ("cycle", CYCLE_LOW, name), ("cycles", name), ("cycle_time", name)
    places = tuple(placed.offset(*key) for key in keys)

    @inlined
    def count(b, i, h, p, begin, end):
        count_cycles(b, i, W, h, b[time_ + i], p, begin, end, scale(b, i), *places)

    return count


PLACES = 24  # that are tried: where tangents meet, and halfway, in turn
SWAY = 0.2  # of the way at its greatest rate, by which a channel may be above its tangents


def _stepped(placed: Placed, event: Event) -> Callable[..., None] | None:
    """Adds the time for which a channel is above its level between the ends of a step at which
    it is below: about the top of its polynomial, or where the tangents on both sides of a top
    that is a bend meet, as the continuous solution has it there."""
    channel = event.channel
    if channel.watched is None or event.above is None:
        return None
    at, stepped_ = evaluated(placed, channel), placed.offset("stepped", channel.name)

    @inlined
    def add_stepped(b, i, h, p, ends, level, division):
        first, second, above0, above_inside, above1 = division
        low, g0, d0 = 0.0, ends[0] - level, h * ends[1]
        high, g1, d1 = 1.0, ends[3] - level, h * ends[4]
        if not above0 and not above1 and d0 > 0.0 and d1 < 0.0:
            part = second - first if above_inside else 0.0
            for place in range(PLACES):
                width = high - low
                meet = (g1 - g0 + d0 * low - d1 * high) / (d0 - d1)
                top, sway = fma(d0, meet - low, g0), SWAY * width * max(d0, -d1)
                if part > 0.0 or not (low < meet < high) or top <= -sway:
                    break
                theta = low + 0.5 * width if place % 2 == 1 else meet
                found = at(b, i, theta)
                now, rate = found[0] - level, h * found[1]
                if now > 0.0:
                    part = min(1.0, now / d0 - now / d1)
                elif rate > 0.0:
                    low, g0, d0 = theta, now, rate
                elif rate < 0.0:
                    high, g1, d1 = theta, now, rate
                else:
                    break
            b[stepped_ + i] += h * part

    return add_stepped


def _parts_above(placed: Placed, event: Event) -> Callable[..., None]:
    """Adds the integrals over the part of a step above the level."""
    found = [part for part in placed.declaration.of_kind(MeanAbove) if event.above and part.above == event.above.name]
    parts = tuple((placed.offset("part", part.name), placed.ends(placed.channel(part.channel))) for part in found)

    @inlined
    def add_above(b, i, h, division):
        first, second, above0, above_inside, above1 = division
        if parts and (above0 != above_inside or above1 != above_inside):
            for part_, ends in parts:
                g0, d0, _, g1, d1, _ = ends(b, i)
                b[part_ + i] += h * integral_above(g0, h * d0, g1, h * d1, first, second, above0, above_inside, above1)

    return add_above


@inlined
def _value_at(p, theta, h):
    return value(p, theta)


@inlined
def _rate_at(p, theta, h):
    return slope(p, theta) / h


def _maximum(placed: Placed, channel: Channel) -> Attend:
    """Finds the greatest value of a channel that no polynomial follows: a bracket is
    narrowed twice to the maximum of the cubic through the values and slopes at its ends.
    The result is never above the greatest value, and below it by less than the tolerance
    of the integration."""
    assert channel.inside is not None
    function, ends, greatest_ = (
        placed.inlined(channel.inside),
        placed.ends(channel),
        placed.offset("greatest", channel.name),
    )
    polynomials = tuple(placed.polynomial(placed.channel(name)) for name in channel.of)
    # what the function takes: the value and the rate of each polynomial, then parameters
    asked = tuple((k, what) for k in range(len(polynomials)) for what in (_value_at, _rate_at))
    readers = tuple(placed.read(name) for name in arguments(channel.inside)[len(asked) :])

    @inlined
    def attend(b, store, i, h, peaks, returns):
        followed = tuple(polynomial(b, i, h)[1] for polynomial in polynomials)
        g0, d0, _, g1, d1, _ = ends(b, i)
        low, low_value, low_slope = 0.0, g0, h * d0
        high, high_value, high_slope = 1.0, g1, h * d1
        for _ in range(2):
            width = high - low
            top = top_of_cubic(low_value, width * low_slope, high_value, width * high_slope)
            theta = fma(width, top, low)
            moving = tuple(what(followed[k], theta, h) for k, what in asked)
            fixed = tuple(read(b, i) for read in readers)
            now, rate = function(*moving, *fixed)
            rising = rate > 0.0
            low, high = theta if rising else low, high if rising else theta
            low_value, high_value = now if rising else low_value, high_value if rising else now
            low_slope, high_slope = h * rate if rising else low_slope, high_slope if rising else h * rate
        b[greatest_ + i] = max(b[greatest_ + i], max(low_value, high_value))

    return attend
