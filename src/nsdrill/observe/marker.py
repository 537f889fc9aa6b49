"""The marker of a declared observer, which attends to the marks of a run: the observation
begins, is half over, ends. It is called for one lane, whose state and outputs are in the
rows of the step's end."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nsdrill.abi import CLOSES, CONTROL, MARKER, OPENS
from nsdrill.compiler.functions import LaneFunction, compiled, fma, inlined
from nsdrill.elementary import atan2
from nsdrill.observe.channels import Winding
from nsdrill.observe.findings import PEAKS, RETURNS, RINGS
from nsdrill.observe.inside import (
    COUNTED_RANGE,
    CYCLE_HIGH,
    CYCLE_LOW,
    FALLS,
    HIGH,
    LOW,
    MARGIN,
    NONE,
    RISES,
    ROSE,
    TOP,
    fall_of_cycle,
    record_maximum,
    store_peak,
)
from nsdrill.observe.placed import MARK, Placed, unbounded

# The least prominence of a peak, in tolerances; smaller maxima may be ripples of the
# error.
PROMINENCE = 10.0

Attend = Callable[..., None]  # to one lane of the buffer


def make_marker(placed: Placed) -> LaneFunction:
    """The compiled marker."""
    declaration, W = placed.declaration, placed.lanes
    rings, width = len(declaration.channels_with_peaks), len(declaration.measured_per_half)
    half_ = min((placed.offset(*key) for key in declaration.measured_per_half), default=0)
    has_section, entry = declaration.section is not None, len(placed.names.states) + 1
    open_, complete, close, begin_half = _opening(placed), _completing(placed), _closing(placed), _beginning(placed)

    @compiled(MARKER)
    def marker(b, store, i, mark, outcome, column):
        peaks, returns = int(store[PEAKS]), int(store[RETURNS])
        ring_size = rings * (peaks + 1)
        section_size = 1 + entry * returns if has_section and returns > 0 else 0
        first_ring, section = RINGS + i * ring_size, RINGS + W * ring_size + i * section_size
        if mark == OPENS:
            for k in range(ring_size):
                store[first_ring + k] = 0.0
            for k in range(section_size):
                store[section + k] = 0.0
            open_(b, store, i, returns)
        else:
            for finish in complete:
                finish(b, i)
            first = column if mark != CLOSES else column + width
            for k in range(width):
                outcome[first + k] = b[half_ + k * W + i]
            if mark == CLOSES:
                for finish in close:
                    finish(b, store, i, first_ring, peaks)
                for k in range(ring_size):
                    outcome[column + 2 * width + k] = store[first_ring + k]
                for k in range(section_size):
                    outcome[column + 2 * width + ring_size + k] = store[section + k]
        for k in range(width):
            b[half_ + k * W + i] = 0.0
        for begin in begin_half:
            begin(b, i)

    return marker


def _with_rows(placed: Placed) -> list[tuple[int, str]]:
    """The channels with peaks that have rows for them, and the numbers of their rings."""
    names = placed.declaration.channels_with_peaks
    return [(ring, name) for ring, name in enumerate(names) if placed.offset(LOW, name) != NONE]


# The observation begins.
def _opening(placed: Placed) -> Attend:
    """Begins the peaks, the cycles and the section."""
    growth_, per_rtol_ = placed.offset("growth"), placed.lanes * (placed.rows.control + CONTROL.index("per_rtol"))
    peaks = tuple(_peaks_begin(placed, name) for _, name in _with_rows(placed))
    cycles = tuple(_cycles_begin(placed, name) for name in placed.declaration.counted)
    begin_section = _section_begins(placed)

    @inlined
    def open_(b, store, i, returns):
        tolerances = PROMINENCE / b[per_rtol_ + i]
        b[growth_ + i] = tolerances
        for begin in peaks:
            begin(b, i, tolerances)
        for begin in cycles:
            begin(b, i)
        begin_section(b, store, i, returns)

    return open_


def _peaks_begin(placed: Placed, name: str) -> Attend:
    W, low_, channel = placed.lanes, placed.offset(LOW, name), placed.channel(name)
    read, scale = placed.read(channel.value, MARK), placed.scale(channel)

    @inlined
    def begin(b, i, tolerances):
        b[low_ + i] = read(b, i)
        b[low_ + HIGH * W + i] = -np.inf
        b[low_ + TOP * W + i] = np.inf
        b[low_ + MARGIN * W + i] = tolerances * scale(b, i)

    return begin


def _cycles_begin(placed: Placed, name: str) -> Attend:
    W, low_, channel = placed.lanes, placed.offset("cycle", CYCLE_LOW, name), placed.channel(name)
    read, scale = placed.read(channel.value, MARK), placed.scale(channel)

    @inlined
    def begin(b, i):
        now = read(b, i)
        b[low_ + i] = b[low_ + CYCLE_HIGH * W + i] = now
        b[low_ + RISES * W + i] = np.inf
        b[low_ + ROSE * W + i] = 0.0
        b[low_ + COUNTED_RANGE * W + i] = 0.0
        b[low_ + FALLS * W + i] = fall_of_cycle(now, now, scale(b, i))

    return begin


def _section_begins(placed: Placed) -> Attend:
    section = placed.declaration.section
    has_section, level_, spacing_of = section is not None, placed.offset("level"), placed.spacing()
    read = placed.read(placed.channel(section.channel).value, MARK) if section else unbounded

    @inlined
    def begin(b, store, i, returns):
        if has_section:
            spacing, angle = spacing_of(b, i, store), read(b, i)
            b[level_ + i] = np.inf
            if returns > 0 and spacing > 0.0:
                b[level_ + i] = (np.floor(angle / spacing) + 1.0) * spacing

    return begin


# A half of the observation ends: what is not compared at each step is completed.
def _completing(placed: Placed) -> tuple[Attend, ...]:
    declaration = placed.declaration
    return (
        *(_ends_complete(placed, name) for name, extremes in declaration.extremes.items() if extremes.smooth),
        *(_cycles_complete(placed, name) for name in declaration.counted),
        *(_angle_completes(placed, winding) for winding in declaration.of_kind(Winding) if winding.counted),
    )


def _ends_complete(placed: Placed, name: str) -> Attend:
    """The extremes of a smooth channel."""
    read = placed.read(placed.channel(name).value, MARK)
    least_, greatest_ = placed.offset("least", name), placed.offset("greatest", name)

    @inlined
    def complete(b, i):
        now = read(b, i)
        if least_ != NONE:
            b[least_ + i] = min(b[least_ + i], now)
        if greatest_ != NONE:
            b[greatest_ + i] = max(b[greatest_ + i], now)

    return complete


def _cycles_complete(placed: Placed, name: str) -> Attend:
    """The range of cycles."""
    least_, greatest_ = placed.offset("least", name), placed.offset("greatest", name)
    low_, high_ = (placed.offset("cycle", part, name) for part in (CYCLE_LOW, CYCLE_HIGH))

    @inlined
    def complete(b, i):
        b[low_ + i] = min(b[low_ + i], b[least_ + i])
        b[high_ + i] = max(b[high_ + i], b[greatest_ + i])

    return complete


def _angle(placed: Placed, winding: Winding) -> Callable[..., float]:
    """The function that gives the angle of the vector at a mark within its half plane,
    from 0 to pi."""
    read_x, read_y = (placed.read(placed.channel(name).value, MARK) for name in (winding.x, winding.y))

    @inlined
    def angle(b, i):
        y = read_y(b, i)
        return atan2(y, read_x(b, i)) + (math.pi if y < 0.0 else 0.0)

    return angle


def _angle_completes(placed: Placed, winding: Winding) -> Attend:
    """An angle of which only half revolutions are counted."""
    angle, angle_ = _angle(placed, winding), placed.offset("angle", winding.name)
    before_ = placed.offset("angle_before", winding.name)

    @inlined
    def complete(b, i):
        b[angle_ + i] = fma(math.pi, b[angle_ + i], angle(b, i) - b[before_ + i])

    return complete


# The observation ends.
def _closing(placed: Placed) -> tuple[Attend, ...]:
    return tuple(_peaks_close(placed, name, ring) for ring, name in _with_rows(placed))


def _peaks_close(placed: Placed, name: str, ring: int) -> Attend:
    """Completes the last maximum of a smooth quantity that has by now fallen by the
    prominence below it, and the last cycle of a bit that is stuck at the end."""
    W, low_, growth_, channel = placed.lanes, placed.offset(LOW, name), placed.offset("growth"), placed.channel(name)
    high_, margin_, top_ = (low_ + part * W for part in (HIGH, MARGIN, TOP))
    read, is_smooth = placed.read(channel.value, MARK), placed.declaration.extremes[name].smooth
    stuck, slip = placed.slip(channel)
    may_stick = slip is not unbounded

    @inlined
    def close(b, store, i, first_ring, peaks):
        place = first_ring + ring * (peaks + 1)
        if is_smooth:
            now = read(b, i)
            if b[high_ + i] - now > fma(b[growth_ + i], abs(now), b[margin_ + i]):
                low, high, top = b[low_ + i], b[high_ + i], b[top_ + i]
                b[top_ + i] = record_maximum(store, place, peaks, low, high, top, stuck(b, i), slip(b, i))
                b[low_ + i] = now
            b[low_ + i] = min(b[low_ + i], now)
        if may_stick and peaks > 0 and b[low_ + i] <= stuck(b, i) and slip(b, i) < b[top_ + i] < np.inf:
            store_peak(store, place, peaks, b[top_ + i])

    return close


# The next half begins.
def _beginning(placed: Placed) -> tuple[Attend, ...]:
    declaration = placed.declaration
    return (
        *(_ends_begin(placed, name) for name in declaration.extremes),
        *(_angle_begins(placed, winding) for winding in declaration.of_kind(Winding) if winding.counted),
    )


def _ends_begin(placed: Placed, name: str) -> Attend:
    read = placed.read(placed.channel(name).value, MARK)
    least_, greatest_ = placed.offset("least", name), placed.offset("greatest", name)

    @inlined
    def begin(b, i):
        now = read(b, i)
        if least_ != NONE:
            b[least_ + i] = now
        if greatest_ != NONE:
            b[greatest_ + i] = now

    return begin


def _angle_begins(placed: Placed, winding: Winding) -> Attend:
    angle, before_ = _angle(placed, winding), placed.offset("angle_before", winding.name)

    @inlined
    def begin(b, i):
        b[before_ + i] = angle(b, i)

    return begin
