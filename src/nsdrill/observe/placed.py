"""What a declaration observes, in the lane buffer: where the observer's own rows are, and
the functions by which lane code reads the rows and expressions of the declaration and
follows its channels over a step. They are made for a number of lanes and a row layout;
places in the buffer are constants of them.

The *ends* of a channel are (value, slope, curvature) at the start of a step and then at
its end; a curvature that the channel has not is 0.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from nsdrill.abi import Layout
from nsdrill.compiler.functions import fma, inlined
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Expression,
    Extremes,
    Names,
    TimeAbove,
    Winding,
    arguments,
    scale_of,
)
from nsdrill.observe.findings import PARTS
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
    cubic,
    quintic,
    rate_of,
)

START, END, MARK = "start", "end", "mark"
PEAK_ROWS = LOW, HIGH, MARGIN, TOP  # of a channel with peaks
# of a channel whose cycles are counted
CYCLE_ROWS = CYCLE_LOW, CYCLE_HIGH, RISES, FALLS, ROSE, COUNTED_RANGE

Read = Callable[..., float]  # of the buffer and a lane


def own_rows(declaration: Declaration) -> dict[tuple[str | int, ...], int]:
    """The position of each row of the observer among those of all observers, by (what,
    name) or (what,)."""
    outputs = declaration.outputs.names if declaration.outputs else ()
    keys: list[tuple[str | int, ...]] = [
        *(("before", name) for name in outputs),
        *(("now", name) for name in outputs),
        *declaration.measured_per_half,
        *(
            (part, name)
            for name in declaration.channels_with_peaks
            if not declaration.extremes[name].maxima
            for part in PEAK_ROWS
        ),
        *(("cycle", part, name) for name in declaration.counted for part in CYCLE_ROWS),
        *(("angle_before", w.name) for w in declaration.of_kind(Winding) if w.counted),
        ("growth",),
        ("level",),
    ]
    return {key: number for number, key in enumerate(keys)}


def observed_rows(declaration: Declaration) -> int:
    """How many rows of the lane buffer the observer has: ``observed`` of
    :class:`nsdrill.abi.Layout`."""
    return len(own_rows(declaration))


@inlined
def unbounded(b, i):
    return np.inf


@inlined
def below_all(b, i):
    return -np.inf


@inlined
def always(b, i):
    return True


@inlined
def add_where(b, place, is_counted, more):
    """Add ``more`` to a place in the buffer where it counts. (Both values are loaded and
    one is selected, as those of a lane that is not observed may be NaN.)"""
    total = b[place]
    b[place] = total + more if is_counted else total


def constant(number: float) -> Read:
    @inlined
    def read(b, i):
        return number

    return read


zero = constant(0.0)


@cache
def of_row(place: int) -> Read:
    """The element of a row, whose offset in the buffer is ``place``."""

    @inlined
    def read(b, i):
        return b[place + i]

    return read


def difference(first: Read, second: Read) -> Read:
    @inlined
    def read(b, i):
        return first(b, i) - second(b, i)

    return read


class Placed:
    """A declaration in the lane buffer."""

    def __init__(self, lanes: int, rows: Layout, names: Names, declaration: Declaration) -> None:
        self.lanes, self.rows, self.names, self.declaration = lanes, rows, names, declaration
        self.number_of = {channel.name: k for k, channel in enumerate(declaration.channels)}
        self._row_of = own_rows(declaration)
        self._row_places = {when: self._places(when) for when in (START, END, MARK)}
        self._inlined: dict[Callable[..., object], Callable[..., object]] = {}
        self._ends: dict[str, Callable[..., tuple[float, ...]]] = {}

    def offset(self, *key: str | int) -> int:
        """The offset of a row of the observer in the buffer, or NONE."""
        return self.lanes * (self.rows.observer + self._row_of[key]) if key in self._row_of else NONE

    def _places(self, when: str) -> dict[str, int]:
        """The offsets of the rows that an expression can read. What is auxiliary is known
        at the end of a step only."""
        rows, names, outputs = self.rows, self.names, self.declaration.outputs
        first_state, first_slope, stored = (
            (rows.start, rows.start_acceleration, "before") if when == START else (rows.stage, rows.acceleration, "now")
        )
        numbers = {
            **{name: first_state + k for k, name in enumerate(names.states)},
            **{name: first_slope + k for k, name in enumerate(names.slopes)},
            **{name: rows.parameter + k for k, name in enumerate(names.parameters)},
            **{name: rows.aux_now + k for k, name in enumerate(names.aux) if when == END},
            "time": rows.time,
            "phase": rows.phase,
        }
        places = {name: self.lanes * row for name, row in numbers.items()}
        return places | {name: self.offset(stored, name) for name in (outputs.names if outputs else ())}

    def channel(self, name: str) -> Channel:
        return self.declaration.channels[self.number_of[name]]

    def inlined(self, function: Callable[..., object]) -> Callable[..., object]:
        """A function of the declaration, which is written out where it is called."""
        return self._inlined.setdefault(function, inlined(function))

    def place(self, name: str, when: str = END) -> int:
        """The offset of a row at the end, or at another place, of the step."""
        return self._row_places[when][name]

    # Functions that read.
    def read(self, expression: Expression, when: str = END) -> Read:
        """The value of an expression at the start or the end of the step, or at a
        mark."""
        if isinstance(expression, str):
            if expression == "time" and when == END:
                return self._end_time()
            return of_row(self._row_places[when][expression])
        if not callable(expression):
            return constant(float(expression))
        function, given = self.inlined(expression), arguments(expression)
        if "time" in given and when == END:
            readers = tuple(self.read(name, when) for name in given)

            @inlined
            def read_all(b, i):
                return function(*tuple(read(b, i) for read in readers))

            return read_all
        places = tuple(self._row_places[when][name] for name in given)

        @inlined
        def read_rows(b, i):
            return function(*tuple(b[place + i] for place in places))

        return read_rows

    def _end_time(self) -> Read:
        time_, step_ = self.lanes * self.rows.time, self.lanes * self.rows.step

        @inlined
        def end_time(b, i):
            return b[time_ + i] + b[step_ + i]

        return end_time

    def level(self, channel: Channel, above: TimeAbove | None = None) -> Read:
        """The level of the channel, or that of ``above`` if it has one; squared where the
        channel is a square."""
        level = channel.level if above is None or above.level is None else above.level
        if level is None:
            return unbounded
        read = self.read(level)
        if not channel.squared:
            return read

        @inlined
        def squared(b, i):
            level = read(b, i)
            return level * level

        return squared

    def is_followed(self, name: str) -> Callable[..., bool]:
        """Whether the polynomial follows the channel ``name`` in a step; the function
        :func:`always` where it always does."""
        found = self.declaration.extremes.get(name)
        if found is None or found.unless is None:
            return always
        before, at_end = found.unless[0], self.read(found.unless[1])
        at_start = always if before is None else self.read(before, START)
        has_both = before is not None

        @inlined
        def is_followed(b, i):
            return not (at_end(b, i) > 0.0 and (not has_both or at_start(b, i) > 0.0))

        return is_followed

    def slip(self, channel: Channel) -> tuple[Read, Read]:
        """The value at which a bit sticks, and the one above which it slips."""
        for feature in self.declaration.of_kind(Extremes):
            if feature.channel == channel.name and feature.slip is not None:
                return self.level(channel), self.read(feature.slip)
        return below_all, unbounded

    def scale(self, channel: Channel) -> Read:
        scale = scale_of(channel, self.names)
        if scale in self.names.states:
            return of_row(self.lanes * (self.rows.scale + self.names.states.index(str(scale))))
        read = self.read(scale, MARK)

        @inlined
        def magnitude(b, i):
            return abs(read(b, i))

        return magnitude

    def spacing(self) -> Callable[..., float]:
        """Of the section, from the buffer, the lane and the store."""
        section = self.declaration.section
        read = self.read(section.spacing, MARK) if section else zero

        @inlined
        def spacing(b, i, store):
            return read(b, i) / store[PARTS]

        return spacing

    # Channels.
    def base(self, channel: Channel) -> Channel | None:
        """The channel whose rate this one is."""
        return self.channel(channel.rate_of) if channel.rate_of is not None else None

    def frame(self, channel: Channel) -> Read:
        return self.read(channel.frame) if channel.frame else zero

    def ends(self, channel: Channel) -> Callable[..., tuple[float, ...]]:
        """The function that gives the ends of a channel."""
        if channel.name in self._ends:
            return self._ends[channel.name]
        (value0, slope0, bend0), (value1, slope1, bend1) = (self._end(channel, when) for when in (START, END))

        @inlined
        def ends(b, i):
            return value0(b, i), slope0(b, i), bend0(b, i), value1(b, i), slope1(b, i), bend1(b, i)

        self._ends[channel.name] = ends
        return ends

    def _end(self, channel: Channel, when: str) -> tuple[Read, Read, Read]:
        slope = self.read(channel.slope, when)
        if channel.frame:
            slope = difference(slope, self.read(channel.frame, when))
        bend = zero if channel.curvature is None else self.read(channel.curvature, when)
        return self.read(channel.value, when), slope, bend

    def polynomial(self, channel: Channel) -> Callable[..., tuple[tuple[float, ...], tuple[float, ...]]]:
        """The function that gives a channel's ends and its polynomial over the step of
        length ``h``."""
        base = self.base(channel)
        ends, base_ends = self.ends(channel), self.ends(base or channel)
        coefficients = through(base or channel, cubic, quintic)
        is_rate = base is not None

        @inlined
        def polynomial(b, i, h):
            found = ends(b, i)
            if is_rate:
                p = rate_of(coefficients(base_ends(b, i), h), found[0], h)
            else:
                p = coefficients(found, h)
            return found, p

        return polynomial

    def integral(self, channel: Channel) -> Callable[..., float]:
        """The function that gives the integral of a channel over the step, from its ends
        and those of the channel whose rate it is."""
        base = self.base(channel)
        if base:
            frame = self.frame(base)

            @inlined
            def of_rate(b, i, h, ends, base_ends):
                return fma(frame(b, i), h, base_ends[3] - base_ends[0])

            return of_rate
        if channel.curvature is None:

            @inlined
            def of_cubic(b, i, h, ends, base_ends):
                g0, d0, _, g1, d1, _ = ends
                return h * fma(h * (1.0 / 12.0), d0 - d1, 0.5 * (g0 + g1))

            return of_cubic

        @inlined
        def of_quintic(b, i, h, ends, base_ends):
            g0, d0, c0, g1, d1, c1 = ends
            return h * fma(h, fma(h * (1.0 / 120.0), c0 + c1, 0.1 * (d0 - d1)), 0.5 * (g0 + g1))

        return of_quintic


def through(
    channel: Channel, of_third: Callable[..., tuple[float, ...]], of_fifth: Callable[..., tuple[float, ...]]
) -> Callable[..., tuple[float, ...]]:
    """The function that gives, from the ends of a channel and the length of the step, a
    polynomial through them: that of third or of fifth degree."""
    if channel.curvature is None:

        @inlined
        def through_slopes(ends, h):
            g0, d0, _, g1, d1, _ = ends
            return of_third(g0, h * d0, g1, h * d1)

        return through_slopes

    @inlined
    def through_curvatures(ends, h):
        g0, d0, c0, g1, d1, c1 = ends
        return of_fifth(g0, h * d0, h * h * c0, g1, h * d1, h * h * c1)

    return through_curvatures
