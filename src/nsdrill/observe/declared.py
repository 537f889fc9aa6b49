"""The observer of a declaration (:mod:`nsdrill.observe.channels`), for any model and
any number of lanes.

It is generated as text. Every packed step is examined in all lanes at once: the
extremes so far are updated by the values at the ends of the step, integrals over time
are accumulated, and a bit field per lane records the channels with an event inside the
step: an extremum (the slope changes its sign) or a level crossing. Events occur in few
lanes only, which are then handled one by one (:mod:`nsdrill.observe.inside`). The
results of a lane do not depend on the other lanes.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import CLOSES, CONTROL, MARKER, OBSERVER, OPENS, Rows
from nsdrill.compiler.functions import BUFFER, INTEGER, compiled, inlined
from nsdrill.compiler.words import bits_float, float_bits, fma, lowest_bit
from nsdrill.elementary import angle_between
from nsdrill.generate import constants, define
from nsdrill.observe import interpolant
from nsdrill.observe.channels import (
    MAX_CHANNELS,
    Channel,
    Declaration,
    Expression,
    Extremes,
    Names,
    Winding,
    arguments,
    check,
    scale_of,
)
from nsdrill.observe.findings import PEAKS, RETURNS, RINGS
from nsdrill.observe.inside import (
    HIGH,
    LOW,
    MARGIN,
    NONE,
    TOP,
    has_extremum,
    measure_events,
    record_returns,
    store_peak,
)

# The least prominence of a peak, in tolerances; smaller maxima may be ripples of the
# error.
PROMINENCE = 10.0
START, END, MARK = "start", "end", "mark"
PARTS = LOW, HIGH, MARGIN, TOP  # the rows of a channel with peaks
CONSTANTS = {
    "PEAKS": PEAKS,
    "RETURNS": RETURNS,
    "RINGS": RINGS,
    "OPENS": OPENS,
    "CLOSES": CLOSES,
    "PROMINENCE": PROMINENCE,
}
HELPERS = (
    "quintic",
    "cubic",
    "derivative",
    "middle_of_quintic",
    "middle_of_cubic",
    "middle_of_rate",
    "mean_square",
)


def own_rows(declaration: Declaration) -> dict[tuple[Any, ...], int]:
    """The position of each row of the observer among those of all observers, by (what,
    name) or (what,)."""
    outputs = declaration.outputs.names if declaration.outputs else ()
    keys: list[tuple[Any, ...]] = [
        *(("before", name) for name in outputs),
        *(("now", name) for name in outputs),
        *declaration.measured_per_half,
        *((part, name) for name in declaration.channels_with_peaks for part in PARTS),
        ("growth",),
        ("event_bits",),
        ("level",),
    ]
    return {key: number for number, key in enumerate(keys)}


def observed_rows(declaration: Declaration) -> int:
    """How many rows of the lane buffer the observer has: ``observed`` of
    :class:`nsdrill.abi.Rows`."""
    return len(own_rows(declaration))


@lru_cache
def make_observer(
    lanes: int, rows: Rows, names: Names, declaration: Declaration
) -> tuple[Any, Any]:
    """The compiled (observer, marker) of a declaration for a number of lanes and a row
    layout, whose rows have these ``names``. The observer's own rows are the first of
    ``rows.observed``; the layout may be without the rows of the stepper.

    ValueError if declaration, names and layout do not fit together, or a function of
    the declaration cannot be compiled.
    """
    check(names, declaration)
    for what, found, wanted in (
        ("states", len(names.states), rows.own),
        ("slopes", len(names.slopes), rows.own_slopes),
        # further auxiliary outputs may follow those that are named
        ("aux", len(names.aux), min(len(names.aux), rows.aux)),
        ("parameters", len(names.parameters), rows.parameters),
    ):
        if found != wanted:
            raise ValueError(f"names.{what}: found {found} names for {wanted} rows")
    if rows.observed < (least := observed_rows(declaration)):
        raise ValueError(
            f"rows.observed: found {rows.observed}; allowed: at least {least}, see observed_rows"
        )
    return _ObserverBuilder(lanes, rows, names, declaration).make()


class _ObserverBuilder:
    """Generates the texts of the functions and compiles them. In the texts ``b[row +
    i]`` is a row of lane i, and g0, d0, c0 and g1, d1, c1, followed by ``_`` and the
    number of a channel, are its value, slope and curvature at the start and at the end
    of the step."""

    def __init__(self, lanes: int, rows: Rows, names: Names, declaration: Declaration) -> None:
        self.lanes, self.rows, self.names, self.declaration = lanes, rows, names, declaration
        self.number_of = {channel.name: k for k, channel in enumerate(declaration.channels)}
        self.row_of = own_rows(declaration)
        self.helpers: dict[Any, tuple[str, Any]] = {}
        self.row_texts = {when: self._row_texts(when) for when in (START, END, MARK)}

    def make(self) -> tuple[Any, Any]:
        handle_events = self._compile(
            "handle_events", (BUFFER, BUFFER, INTEGER), self._event_lines()
        )
        observer = self._compile(
            "observer", (OBSERVER,), self._observer_lines(), handle_events=handle_events
        )
        marker = self._compile("marker", (MARKER,), self._marker_lines())
        return observer, marker

    def _compile(
        self, name: str, kinds: tuple[str, ...], lines: list[str], **namespace: Any
    ) -> Any:
        """The compiled function ``name`` with these lines as its body."""
        arguments_of = {
            "handle_events": "b, store, event_lanes",
            "observer": "b, store",
            "marker": "b, store, i, mark, outcome, column",
        }
        tables = self._tables() if name == "handle_events" else []
        head = [constants(W=self.lanes), *tables, f"def {name}({arguments_of[name]}):"]
        text = "\n".join([*head, *_indented(lines), ""])
        namespace |= dict(self.helpers.values())
        namespace |= {word: getattr(interpolant, word) for word in HELPERS}
        function = define(
            name,
            text,
            np=np,
            fma=fma,
            angle_between=angle_between,
            lowest_bit=lowest_bit,
            float_bits=float_bits,
            bits_float=bits_float,
            has_extremum=has_extremum,
            measure_events=measure_events,
            record_returns=record_returns,
            store_peak=store_peak,
            **CONSTANTS,
            **namespace,
        )
        return compiled(*kinds)(function)

    # Rows and expressions in the text.
    def _row(self, row: int) -> str:
        return f"b[{self.lanes * row} + i]"

    def _own_row(self, *key: Any) -> str:
        return self._row(self._row_number(*key))

    def _row_number(self, *key: Any) -> int:
        return self.rows.observer + self.row_of[key]

    def _offset(self, *key: Any) -> int:
        """The offset of a row of the observer in the buffer, or NONE."""
        return self.lanes * self._row_number(*key) if key in self.row_of else NONE

    def _row_texts(self, when: str) -> dict[str, str]:
        rows, names, outputs = self.rows, self.names, self.declaration.outputs
        first_state, first_slope, stored = (
            (rows.start, rows.start_acceleration, "before")
            if when == START
            else (rows.stage, rows.acceleration, "now")
        )
        time, length = self._row(rows.time), self._row(rows.step)
        return {
            **{name: self._row(first_state + k) for k, name in enumerate(names.states)},
            **{name: self._row(first_slope + k) for k, name in enumerate(names.slopes)},
            **{name: self._row(rows.parameter + k) for k, name in enumerate(names.parameters)},
            **{name: self._own_row(stored, name) for name in (outputs.names if outputs else ())},
            "time": f"({time} + {length})" if when == END else time,
            "phase": self._row(rows.phase),
        }

    def _code(self, expression: Expression, texts: dict[str, str]) -> str:
        if isinstance(expression, str):
            return texts[expression]
        if not callable(expression):
            return repr(float(expression))
        if expression not in self.helpers:
            self.helpers[expression] = (f"function_{len(self.helpers)}", inlined(expression))
        return f"{self.helpers[expression][0]}({', '.join(texts[name] for name in arguments(expression))})"

    def _level(self, channel: Channel) -> str:
        return "np.inf" if channel.level is None else self._code(channel.level, self.row_texts[END])

    def _slip(self, channel: Channel) -> tuple[str, str]:
        """The value at which a bit sticks, and the one above which it slips."""
        for feature in self.declaration.of_kind(Extremes):
            if feature.channel == channel.name and feature.slip is not None:
                return self._level(channel), self._code(feature.slip, self.row_texts[END])
        return "-np.inf", "np.inf"

    def _ends(self, channel: Channel) -> list[str]:
        """The lines that assign the channel's values, slopes and curvatures at the ends
        of the step."""
        k, lines = self.number_of[channel.name], []
        for end, when in enumerate((START, END)):
            texts = self.row_texts[when]
            slope = self._code(channel.slope, texts)
            lines += [
                f"g{end}_{k} = {self._code(channel.value, texts)}",
                f"d{end}_{k} = {slope}" + (f" - {texts[channel.frame]}" if channel.frame else ""),
            ]
            if channel.curvature is not None:
                lines.append(f"c{end}_{k} = {self._code(channel.curvature, texts)}")
        return lines

    def _base(self, channel: Channel) -> Channel | None:
        return (
            self.declaration.channels[self.number_of[channel.rate_of]]
            if channel.rate_of is not None
            else None
        )

    def _frame(self, channel: Channel) -> str:
        return self.row_texts[END][channel.frame] if channel.frame else "0.0"

    def _observer_lines(self) -> list[str]:
        """The body of the observer, which is called every step: all lanes at once."""
        rows, outputs = self.rows, self.declaration.outputs
        is_observed = f"{self._row(rows.moves)} * {self._row(rows.observing)} != 0.0"
        lines = ["observed_lanes = event_lanes = 0", "for i in packed(W):"]
        if outputs:
            reads = {
                **self.row_texts[END],
                **{name: self._row(rows.aux_now + k) for k, name in enumerate(self.names.aux)},
            }
            results = "".join(f"{self._own_row('now', name)}, " for name in outputs.names)
            lines.append(f"    ({results}) = {self._code(outputs.function, reads)}")
        lines += [f"    observed_lanes |= (1 << i) if {is_observed} else 0"]
        channels = self.declaration.channels
        lines += [
            "if observed_lanes != 0:",
            "    for i in packed(W):",
            f"        is_observed, h, event_bits = {is_observed}, {self._row(rows.step)}, 0",
            "        observed_h = h if is_observed else 0.0",
            "        per_h = 1.0 / h if h > 0.0 else 0.0",
        ]
        for channel in channels:
            lines += _indented(self._ends(channel), 2)
        for channel in channels:
            lines += _indented(self._channel_lines(channel), 2)
        for winding in self.declaration.of_kind(Winding):
            lines += _indented(self._winding_lines(winding), 2)
        lines += [
            "        event_bits = event_bits if is_observed else 0",
            f"        {self._own_row('event_bits')} = bits_float(event_bits)",
            "        event_lanes |= (1 << i) if event_bits != 0 else 0",
        ]
        lines += ["if event_lanes != 0:", "    handle_events(b, store, event_lanes)"]
        if outputs:
            lines += ["for i in packed(W):", f"    moves = {self._row(rows.moves)} != 0.0"]
            for name in outputs.names:
                lines += [
                    f"    before, now = {self._own_row('before', name)}, {self._own_row('now', name)}",
                    f"    {self._own_row('before', name)} = now if moves else before",
                ]
        return lines

    def _channel_lines(self, channel: Channel) -> list[str]:
        """The lines that update the measurements of one channel in all lanes. (Both
        values are loaded and one is selected, as those of a lane that is not observed
        may be NaN.)"""
        k, name, lines = self.number_of[channel.name], channel.name, []
        bit, section = 1 << k, self.declaration.section
        if section and section.channel == name:
            lines.append(
                f"event_bits |= {1 << MAX_CHANNELS} if g1_{k} >= {self._own_row('level')} else 0"
            )
        if ("least", name) in self.row_of or ("above", name) in self.row_of:
            lines.append(f"extremum_inside = has_extremum(d0_{k}, d1_{k})")
        if ("least", name) in self.row_of:
            least, greatest = self._own_row("least", name), self._own_row("greatest", name)
            lines += [
                f"event_bits |= {bit} if extremum_inside else 0",
                f"low, high = {least}, {greatest}",
                f"{least} = min(low, g1_{k}) if is_observed else low",
                f"{greatest} = max(high, g1_{k}) if is_observed else high",
            ]
        if (LOW, name) in self.row_of:
            low, high = self._own_row(LOW, name), self._own_row(HIGH, name)
            lines += [
                f"low, high = {low}, {high}",
                f"margin = fma({self._own_row('growth')}, abs(g1_{k}), {self._own_row(MARGIN, name)})",
                f"fallen = high - g1_{k} > margin",
                f"event_bits |= {bit} if fallen else 0",
                "plain = is_observed and not extremum_inside and not fallen",
                f"rises = plain and g1_{k} - low > margin",
                f"{high} = max(high, g1_{k}) if rises else high",
                f"{low} = min(low, g1_{k}) if plain else low",
            ]
        if ("above", name) in self.row_of:
            lines += [
                f"level = {self._level(channel)}",
                f"above0, above1 = g0_{k} > level, g1_{k} > level",
                f"event_bits |= {bit} if above0 != above1 else 0",
                f"event_bits |= {bit} if extremum_inside and (d0_{k} > 0.0) != above0 else 0",
                f"{self._own_row('above', name)} += observed_h if above0 and above1 else 0.0",
            ]
        if ("passages", name) in self.row_of:
            rises = f"g0_{k} <= {self._level(channel)} and g1_{k} > {self._level(channel)}"
            lines += self._accumulation("passages", name, f"1.0 if {rises} else 0.0")
        base = self._base(channel)
        if ("integral", name) in self.row_of:
            if base:
                j = self.number_of[base.name]
                increment = f"fma({self._frame(base)}, h, g1_{j} - g0_{j})"
            elif channel.curvature is None:
                increment = f"h * fma(h * (1.0 / 12.0), d0_{k} - d1_{k}, 0.5 * (g0_{k} + g1_{k}))"
            else:
                increment = (
                    f"h * fma(h, fma(h * (1.0 / 120.0), c0_{k} + c1_{k}, 0.1 * (d0_{k} - d1_{k})), "
                    f"0.5 * (g0_{k} + g1_{k}))"
                )
            lines += self._accumulation("integral", name, increment)
        if ("square", name) in self.row_of:
            if base:
                lines.append(f"_, e2, e4, o1, o3, o5 = {_centred(base, self.number_of[base.name])}")
                middle = f"middle_of_rate(e2, e4, o1, o3, o5, per_h, {self._frame(base)})"
            else:
                middle = _centred(channel, k)
            lines += [
                f"e0, e2, e4, o1, o3, o5 = {middle}",
                *self._accumulation("square", name, "h * mean_square(e0, e2, e4, o1, o3, o5)"),
            ]
        return lines

    def _winding_lines(self, winding: Winding) -> list[str]:
        """The lines that add the angle by which a vector rotates in the step."""
        x, y = (self.number_of[name] for name in (winding.x, winding.y))
        ends = [
            f"g{end}_{k} = {self._code(self.declaration.channels[k].value, self.row_texts[when])}"
            for k in (x, y)
            for end, when in enumerate((START, END))
        ]
        angle = f"angle_between(g0_{x}, g0_{y}, g1_{x}, g1_{y})"
        return [*ends, *self._accumulation("angle", winding.name, angle)]

    def _accumulation(self, what: str, name: str, increment: str) -> list[str]:
        total = self._own_row(what, name)
        return [
            f"total, more = {total}, {increment}",
            f"{total} = total + more if is_observed else total",
        ]

    def _tables(self) -> list[str]:
        """Lines that define the offsets of a channel's rows, by its number (see
        :func:`nsdrill.observe.inside.measure_events`)."""
        names, channels_with_peaks = (
            [channel.name for channel in self.declaration.channels],
            self.declaration.channels_with_peaks,
        )
        return [
            f"least_ = np.array({[self._offset('least', name) for name in names]})",
            f"above_ = np.array({[self._offset('above', name) for name in names]})",
            f"passages_ = np.array({[self._offset('passages', name) for name in names]})",
            f"low_ = np.array({[self._offset(LOW, name) for name in names]})",
            f"ring_ = "
            f"np.array({[channels_with_peaks.index(name) if name in channels_with_peaks else 0 for name in names]})",
        ]

    def _event_lines(self) -> list[str]:
        """The body of ``handle_events``: the channels with an event, one lane and one
        channel after the other."""
        W, rows, channels_with_peaks, section = (
            self.lanes,
            self.rows,
            self.declaration.channels_with_peaks,
            self.declaration.section,
        )
        event_channels = [
            channel
            for channel in self.declaration.channels
            if ("least", channel.name) in self.row_of or ("above", channel.name) in self.row_of
        ]
        lines = [
            "peaks, returns = int(store[PEAKS]), int(store[RETURNS])",
            "while event_lanes != 0:",
            "    i = lowest_bit(event_lanes)",
            "    event_lanes &= event_lanes - 1",
            f"    h, event_bits = {self._row(rows.step)}, float_bits({self._own_row('event_bits')})",
            "    while event_bits != 0:",
            "        k = lowest_bit(event_bits)",
            "        event_bits &= event_bits - 1",
        ]
        if section:
            angle = self.declaration.channels[self.number_of[section.channel]]
            entry = len(self.names.states) + 1
            lines += [
                f"        if k == {MAX_CHANNELS}:",
                *_indented(self._polynomial(angle), 3),
                "            record_returns(",
                "                b, store, i, W, h, p0, p1, p2, p3, p4, p5, end,",
                f"                {self._spacing()}, {self._offset('level')},",
                f"                RINGS + {len(channels_with_peaks) * W} * (peaks + 1) + i * (1 + {entry} * "
                f"returns), returns,",
                f"                {rows.pairs}, {rows.singles}, {W * rows.start}, "
                f"{W * rows.stage}, "
                f"{W * rows.start_acceleration}, {W * rows.acceleration}, {W * rows.frame_rate})",
                "            continue",
            ]
        for index, channel in enumerate(event_channels):
            head = f"{'elif' if index else 'if'} k == {self.number_of[channel.name]}:"
            # an else branch, as the compiler requires that each name always has a value
            if index == len(event_channels) - 1:
                head = "else:" if index else "if True:"
            lines += [
                f"        {head}",
                *_indented(self._polynomial(channel), 3),
                f"            level = {self._level(channel)}",
                f"            stuck, slip = {', '.join(self._slip(channel))}",
            ]
        if event_channels:
            lines += [
                "        measure_events(",
                "            b, store, i, W, h, begin, p0, p1, p2, p3, p4, p5, end, end_slope, "
                "level, stuck, slip,",
                f"            least_[k], above_[k], passages_[k], low_[k], "
                f"{self._offset('growth')},",
                f"            RINGS + ({len(channels_with_peaks)} * i + ring_[k]) * (peaks + 1), peaks)",
            ]
        return lines

    def _polynomial(self, channel: Channel) -> list[str]:
        """The lines that assign a channel's coefficients p0 to p5 over the step, its
        values at both ends and its slope at the end."""
        base, k = self._base(channel), self.number_of[channel.name]
        lines = [*self._ends(channel), f"begin, end, end_slope = g0_{k}, g1_{k}, h * d1_{k}"]
        if base is None:
            return [*lines, f"p0, p1, p2, p3, p4, p5 = {_coefficients(channel, k)}"]
        j = self.number_of[base.name]
        return [
            *lines,
            *self._ends(base),
            f"_, p1, p2, p3, p4, p5 = {_coefficients(base, j)}",
            "p0, p1, p2, p3, p4, p5 = derivative(p1, p2, p3, p4, p5)",
            "p0, p1, p2, p3, p4 = begin, p1 / h, p2 / h, p3 / h, p4 / h",
        ]

    def _marker_lines(self) -> list[str]:
        """The body of the marker: one lane at a mark, whose state and outputs are in
        the rows of the step's end."""
        channels_with_peaks, width, states = (
            self.declaration.channels_with_peaks,
            len(self.declaration.measured_per_half),
            len(self.names.states),
        )
        first_half = self.lanes * (
            self.rows.observer
            + min((self.row_of[key] for key in self.declaration.measured_per_half), default=0)
        )
        texts, channels = self.row_texts[MARK], self.declaration.channels
        lines = [
            "peaks, returns = int(store[PEAKS]), int(store[RETURNS])",
            f"ring_size = {len(channels_with_peaks)} * (peaks + 1)",
            f"section_size = 1 + {states + 1} * returns if {int(bool(self.declaration.section))} "
            f"and returns > 0 else 0",
            "rings, section = RINGS + i * ring_size, RINGS + W * ring_size + i * section_size",
            "if mark == OPENS:",
            "    for k in range(ring_size):",
            "        store[rings + k] = 0.0",
            "    for k in range(section_size):",
            "        store[section + k] = 0.0",
            f"    tolerances = PROMINENCE / "
            f"{self._row(self.rows.control + CONTROL.index('per_rtol'))}",
            f"    {self._own_row('growth')} = tolerances",
        ]
        for name in channels_with_peaks:
            channel = channels[self.number_of[name]]
            lines += [
                f"    {self._own_row(LOW, name)} = {self._code(channel.value, texts)}",
                f"    {self._own_row(HIGH, name)} = -np.inf",
                f"    {self._own_row(TOP, name)} = np.inf",
                f"    {self._own_row(MARGIN, name)} = tolerances * {self._scale_text(channel)}",
            ]
        if self.declaration.section:
            angle = channels[self.number_of[self.declaration.section.channel]]
            lines += [
                f"    spacing, angle = {self._spacing()}, {self._code(angle.value, texts)}",
                f"    {self._own_row('level')} = np.inf",
                "    if returns > 0 and spacing > 0.0:",
                f"        {self._own_row('level')} = (np.floor(angle / spacing) + 1.0) * spacing",
            ]
        lines += [
            "else:",
            f"    first = column if mark != CLOSES else column + {width}",
            f"    for k in range({width}):",
            f"        outcome[first + k] = b[{first_half} + k * W + i]",
            "    if mark == CLOSES:",
            *_indented(self._closing_lines(), 2),
            "        for k in range(ring_size):",
            f"            outcome[column + {2 * width} + k] = store[rings + k]",
            "        for k in range(section_size):",
            f"            outcome[column + {2 * width} + ring_size + k] = store[section + k]",
            f"for k in range({width}):",
            f"    b[{first_half} + k * W + i] = 0.0",
        ]
        for name in self.declaration.channels_of(Extremes):
            lines += [
                f"now = {self._code(channels[self.number_of[name]].value, texts)}",
                f"{self._own_row('least', name)} = now",
                f"{self._own_row('greatest', name)} = now",
            ]
        return lines

    def _closing_lines(self) -> list[str]:
        """The lines that complete the last cycle of a bit that is stuck at the end."""
        lines = []
        for number, name in enumerate(self.declaration.channels_with_peaks):
            stuck, slip = self._slip(self.declaration.channels[self.number_of[name]])
            top = self._own_row(TOP, name)
            if slip != "np.inf":
                lines += [
                    f"if peaks > 0 and {self._own_row(LOW, name)} <= {stuck} and {slip} < {top} < np.inf:",
                    f"    store_peak(store, rings + {number} * (peaks + 1), peaks, {top})",
                ]
        return lines

    def _scale_text(self, channel: Channel) -> str:
        scale = scale_of(channel, self.names)
        if scale in self.names.states:
            return self._row(self.rows.scale + self.names.states.index(str(scale)))
        return f"abs({self._code(scale, self.row_texts[MARK])})"

    def _spacing(self) -> str:
        section = self.declaration.section
        return self._code(section.spacing, self.row_texts[MARK]) if section else "0.0"


def _coefficients(channel: Channel, k: int) -> str:
    if channel.curvature is None:
        return f"cubic(g0_{k}, h * d0_{k}, g1_{k}, h * d1_{k})"
    return f"quintic(g0_{k}, h * d0_{k}, h * h * c0_{k}, g1_{k}, h * d1_{k}, h * h * c1_{k})"


def _centred(channel: Channel, k: int) -> str:
    return f"middle_of_{_coefficients(channel, k)}"


def _indented(lines: list[str], by: int = 1) -> list[str]:
    return [f"{by * 4 * ' '}{line}" for line in lines]
