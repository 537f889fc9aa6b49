"""What the text of a declared observer is written with (its rows of the lane buffer, the
expressions of the declaration, and the polynomials of the channels), and its marker,
which attends to the marks of a run: the observation begins, is half over, ends.

In the text ``b[row + i]`` is a row of lane i, and g0, d0, c0 and g1, d1, c1, followed by
``_`` and the number of a channel, are its value, slope and curvature at the start and at
the end of the step.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from nsdrill.abi import CLOSES, CONTROL, OPENS, Rows
from nsdrill.compiler.functions import LaneFunction, Source, constants, generated, inlined, lowest_bit
from nsdrill.elementary import angle_between, atan2
from nsdrill.observe import inside
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
from nsdrill.observe.findings import PARTS, PEAKS, RETURNS, RINGS
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
)

# The least prominence of a peak, in tolerances; smaller maxima may be ripples of the
# error.
PROMINENCE = 10.0
START, END, MARK = "start", "end", "mark"
PEAK_ROWS = LOW, HIGH, MARGIN, TOP  # of a channel with peaks
# of a channel whose cycles are counted
CYCLE_ROWS = CYCLE_LOW, CYCLE_HIGH, RISES, FALLS, ROSE, COUNTED_RANGE
CONSTANTS = {
    "PEAKS": PEAKS,
    "RETURNS": RETURNS,
    "PARTS": PARTS,
    "RINGS": RINGS,
    "OPENS": OPENS,
    "CLOSES": CLOSES,
    "PROMINENCE": PROMINENCE,
}
HELPERS = {word: found for word, found in vars(inside).items() if not word.startswith("_")}


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
    :class:`nsdrill.abi.Rows`."""
    return len(own_rows(declaration))


class ChannelText:
    """Lines of a function of the observer of a declaration, for a number of lanes and a
    row layout."""

    def __init__(self, lanes: int, rows: Rows, names: Names, declaration: Declaration) -> None:
        self.lanes, self.rows, self.names, self.declaration = lanes, rows, names, declaration
        self.number_of = {channel.name: k for k, channel in enumerate(declaration.channels)}
        self.row_of = own_rows(declaration)
        self.helpers: dict[Callable[..., object], tuple[str, Callable[..., object]]] = {}
        self.row_texts = {when: self._row_texts(when) for when in (START, END, MARK)}
        # what is known at the end of a step only
        aux = {name: self._row(rows.aux_now + k) for k, name in enumerate(names.aux)}
        self.known = {**self.row_texts[END], **aux}

    def compile(
        self, name: str, kinds: tuple[str, ...], given: str, lines: list[str], **namespace: object
    ) -> LaneFunction:
        """The compiled function ``name`` of the arguments ``given`` with these lines as
        its body."""
        head = [constants(W=self.lanes), f"def {name}({given}):"]
        text = "\n".join([*head, *indented(lines), ""])
        namespace |= HELPERS | CONSTANTS | dict(self.helpers.values())
        namespace |= {"math": math, "angle_between": angle_between, "atan2": atan2, "lowest_bit": lowest_bit}
        return generated(name, "".join(kinds), lambda: Source(name, text, namespace))

    # Rows and expressions in the text.
    def _row(self, row: int) -> str:
        return f"b[{self.lanes * row} + i]"

    def _own_row(self, *key: str | int) -> str:
        return self._row(self._row_number(*key))

    def _row_number(self, *key: str | int) -> int:
        return self.rows.observer + self.row_of[key]

    def _offset(self, *key: str | int) -> int:
        """The offset of a row of the observer in the buffer, or NONE."""
        return self.lanes * self._row_number(*key) if key in self.row_of else NONE

    def _row_texts(self, when: str) -> dict[str, str]:
        rows, names, outputs = self.rows, self.names, self.declaration.outputs
        first_state, first_slope, stored = (
            (rows.start, rows.start_acceleration, "before") if when == START else (rows.stage, rows.acceleration, "now")
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

    def _channel(self, name: str) -> Channel:
        return self.declaration.channels[self.number_of[name]]

    def _code(self, expression: Expression, texts: dict[str, str]) -> str:
        if isinstance(expression, str):
            return texts[expression]
        if not callable(expression):
            return repr(float(expression))
        given = ", ".join(texts[name] for name in arguments(expression))
        return f"{self._function(expression)}({given})"

    def _function(self, function: Callable[..., object]) -> str:
        """The name of a function of the declaration in the text."""
        if function not in self.helpers:
            self.helpers[function] = (f"function_{len(self.helpers)}", inlined(function))
        return self.helpers[function][0]

    def _level(self, channel: Channel, above: TimeAbove | None = None) -> str:
        """The level in the text, that of ``above`` if it has one; squared where the
        channel is a square."""
        level = channel.level if above is None or above.level is None else above.level
        if level is None:
            return "np.inf"
        text = self._code(level, self.row_texts[END])
        return f"{text} * {text}" if channel.squared else text

    def _is_followed(self, name: str) -> str:
        """Whether the polynomial follows the channel ``name`` in a step; empty where it
        always does."""
        found = self.declaration.extremes.get(name)
        if found is None or found.unless is None:
            return ""
        at_start, at_end = found.unless
        text = f"{self._code(at_end, self.known)} > 0.0"
        if at_start is not None:
            text += f" and {self._code(at_start, self.row_texts[START])} > 0.0"
        return f"not ({text})"

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
        return self._channel(channel.rate_of) if channel.rate_of is not None else None

    def _frame(self, channel: Channel) -> str:
        return self.row_texts[END][channel.frame] if channel.frame else "0.0"

    def _polynomial(self, channel: Channel, p: str = "p") -> list[str]:
        """The lines that assign a channel's polynomial ``p`` over the step, its values
        at both ends and its slope at the end."""
        base, k = self._base(channel), self.number_of[channel.name]
        lines = [*self._ends(channel), f"begin, end, end_slope = g0_{k}, g1_{k}, h * d1_{k}"]
        if base is None:
            return [*lines, f"{p} = {coefficients(channel, k)}"]
        polynomial = coefficients(base, self.number_of[base.name])
        return [*lines, *self._ends(base), f"{p} = rate_of({polynomial}, begin, h)"]

    def _integral(self, channel: Channel) -> str:
        """The integral of a channel over the step."""
        k, base = self.number_of[channel.name], self._base(channel)
        if base:
            j = self.number_of[base.name]
            return f"fma({self._frame(base)}, h, g1_{j} - g0_{j})"
        if channel.curvature is None:
            return f"h * fma(h * (1.0 / 12.0), d0_{k} - d1_{k}, 0.5 * (g0_{k} + g1_{k}))"
        return f"h * fma(h, fma(h * (1.0 / 120.0), c0_{k} + c1_{k}, 0.1 * (d0_{k} - d1_{k})), 0.5 * (g0_{k} + g1_{k}))"

    def _scale_text(self, channel: Channel) -> str:
        scale = scale_of(channel, self.names)
        if scale in self.names.states:
            return self._row(self.rows.scale + self.names.states.index(str(scale)))
        return f"abs({self._code(scale, self.row_texts[MARK])})"

    def _spacing(self) -> str:
        section = self.declaration.section
        return f"{self._code(section.spacing, self.row_texts[MARK])} / store[PARTS]" if section else "0.0"


def coefficients(channel: Channel, k: int) -> str:
    if channel.curvature is None:
        return f"cubic(g0_{k}, h * d0_{k}, g1_{k}, h * d1_{k})"
    return f"quintic(g0_{k}, h * d0_{k}, h * h * c0_{k}, g1_{k}, h * d1_{k}, h * h * c1_{k})"


def noted(lanes: str, condition: str) -> str:
    """The line that adds the lanes in which the condition holds to a set."""
    return f"{lanes} |= (1 << i) if {condition} else 0"


def with_definitions(lines: list[str], definitions: list[str]) -> list[str]:
    """The ``lines`` with these ``definitions``, ``name = value``, each before the line
    that first needs it: the earlier, the more values would wait in registers."""
    waiting = {line.split(" = ")[0]: line for line in definitions}
    found = []
    for line in lines:
        found += [waiting.pop(word) for word in re.findall(r"\w+", line) if word in waiting]
        found.append(line)
    return found


def indented(lines: list[str], by: int = 1) -> list[str]:
    return [f"{by * 4 * ' '}{line}" for line in lines]


class MarkerText(ChannelText):
    """Lines of the marker, for one lane, whose state and outputs are in the rows of the
    step's end."""

    def lines(self) -> list[str]:
        """The body of the marker."""
        channels_with_peaks, width, states = (
            self.declaration.channels_with_peaks,
            len(self.declaration.measured_per_half),
            len(self.names.states),
        )
        first_half = self.lanes * (
            self.rows.observer + min((self.row_of[key] for key in self.declaration.measured_per_half), default=0)
        )
        texts = self.row_texts[MARK]
        lines = [
            "peaks, returns = int(store[PEAKS]), int(store[RETURNS])",
            f"ring_size = {len(channels_with_peaks)} * (peaks + 1)",
            f"section_size = 1 + {states + 1} * returns if {int(bool(self.declaration.section))} "
            f"and returns > 0 else 0",
            "rings, section = RINGS + i * ring_size, RINGS + W * ring_size + i * section_size",
            "if mark == OPENS:",
            *indented(self._opening_lines()),
            "else:",
            *indented(self._completing_lines()),
            f"    first = column if mark != CLOSES else column + {width}",
            f"    for k in range({width}):",
            f"        outcome[first + k] = b[{first_half} + k * W + i]",
            "    if mark == CLOSES:",
            *indented(self._closing_lines(), 2),
            "        for k in range(ring_size):",
            f"            outcome[column + {2 * width} + k] = store[rings + k]",
            "        for k in range(section_size):",
            f"            outcome[column + {2 * width} + ring_size + k] = store[section + k]",
            f"for k in range({width}):",
            f"    b[{first_half} + k * W + i] = 0.0",
        ]
        for name, extremes in self.declaration.extremes.items():
            lines.append(f"now = {self._code(self._channel(name).value, texts)}")
            lines += [f"{self._own_row(end, name)} = now" for end in extremes.ends]
        for winding in self.declaration.of_kind(Winding):
            if winding.counted:
                lines.append(f"{self._own_row('angle_before', winding.name)} = {self._angle(winding)}")
        return lines

    def _opening_lines(self) -> list[str]:
        """The lines that empty the rings, and begin the peaks and the section."""
        texts = self.row_texts[MARK]
        lines = [
            "for k in range(ring_size):",
            "    store[rings + k] = 0.0",
            "for k in range(section_size):",
            "    store[section + k] = 0.0",
            f"tolerances = PROMINENCE / {self._row(self.rows.control + CONTROL.index('per_rtol'))}",
            f"{self._own_row('growth')} = tolerances",
        ]
        for name in self.declaration.channels_with_peaks:
            if (LOW, name) in self.row_of:
                channel = self._channel(name)
                lines += [
                    f"{self._own_row(LOW, name)} = {self._code(channel.value, texts)}",
                    f"{self._own_row(HIGH, name)} = -np.inf",
                    f"{self._own_row(TOP, name)} = np.inf",
                    f"{self._own_row(MARGIN, name)} = tolerances * {self._scale_text(channel)}",
                ]
        for name in self.declaration.counted:
            channel = self._channel(name)
            low, high, rises, falls, rose, counted = (self._own_row("cycle", part, name) for part in CYCLE_ROWS)
            lines += [
                f"now = {self._code(channel.value, texts)}",
                f"{low}, {high}, {rises}, {rose}, {counted} = now, now, np.inf, 0.0, 0.0",
                f"{falls} = fall_of_cycle(now, now, {self._scale_text(channel)})",
            ]
        if self.declaration.section:
            angle = self._channel(self.declaration.section.channel)
            lines += [
                f"spacing, angle = {self._spacing()}, {self._code(angle.value, texts)}",
                f"{self._own_row('level')} = np.inf",
                "if returns > 0 and spacing > 0.0:",
                f"    {self._own_row('level')} = (np.floor(angle / spacing) + 1.0) * spacing",
            ]
        return lines

    def _angle(self, winding: Winding) -> str:
        """The angle of the vector at a mark within its half plane, from 0 to pi."""
        x, y = (self._code(self._channel(name).value, self.row_texts[MARK]) for name in (winding.x, winding.y))
        return f"atan2({y}, {x}) + (math.pi if {y} < 0.0 else 0.0)"

    def _completing_lines(self) -> list[str]:
        """The lines that complete at a mark what is not compared at each step: extremes
        of smooth channels, the range of cycles, and angles of which only half revolutions
        are counted."""
        lines = []
        for name, extremes in self.declaration.extremes.items():
            if not extremes.smooth:
                continue
            value = self._channel(name).value
            lines.append(f"now = {self._code(value, self.row_texts[MARK])}")
            for end in extremes.ends:
                row = self._own_row(end, name)
                lines.append(f"{row} = {'min' if end == 'least' else 'max'}({row}, now)")
        for name in self.declaration.counted:
            for part, end, which in ((CYCLE_LOW, "least", "min"), (CYCLE_HIGH, "greatest", "max")):
                row = self._own_row("cycle", part, name)
                lines.append(f"{row} = {which}({row}, {self._own_row(end, name)})")
        for winding in self.declaration.of_kind(Winding):
            if winding.counted:
                row, before = (self._own_row(w, winding.name) for w in ("angle", "angle_before"))
                lines.append(f"{row} = fma(math.pi, {row}, {self._angle(winding)} - {before})")
        return lines

    def _closing_lines(self) -> list[str]:
        """The lines that complete the last maximum of a smooth quantity that has by now
        fallen by the prominence below it, and the last cycle of a bit that is stuck at
        the end."""
        lines = []
        for number, name in enumerate(self.declaration.channels_with_peaks):
            if (LOW, name) not in self.row_of:
                continue
            channel = self._channel(name)
            stuck, slip = self._slip(channel)
            low, high, margin, top = (self._own_row(part, name) for part in PEAK_ROWS)
            ring = f"rings + {number} * (peaks + 1)"
            if self.declaration.extremes[name].smooth:
                lines += [
                    f"now = {self._code(channel.value, self.row_texts[MARK])}",
                    f"if {high} - now > fma({self._own_row('growth')}, abs(now), {margin}):",
                    f"    {top} = record_maximum(store, {ring}, peaks, {low}, {high}, {top}, {stuck}, {slip})",
                    f"    {low} = now",
                    f"{low} = min({low}, now)",
                ]
            if slip != "np.inf":
                lines += [
                    f"if peaks > 0 and {low} <= {stuck} and {slip} < {top} < np.inf:",
                    f"    store_peak(store, {ring}, peaks, {top})",
                ]
        return lines
