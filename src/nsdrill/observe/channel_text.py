"""What the text of a declared observer is written with: its rows of the lane buffer,
the expressions of the declaration, and the polynomials of the channels.

In the text ``b[row + i]`` is a row of lane i, and g0, d0, c0 and g1, d1, c1, followed by
``_`` and the number of a channel, are its value, slope and curvature at the start and at
the end of the step.
"""

from __future__ import annotations

import math
import re
from typing import Any

from nsdrill.abi import CLOSES, OPENS, Rows
from nsdrill.compiler.functions import compiled, constants, define, inlined, lowest_bit
from nsdrill.elementary import angle_between
from nsdrill.observe import inside, interpolant
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
from nsdrill.observe.inside import HIGH, LOW, MARGIN, NONE, TOP

# The least prominence of a peak, in tolerances; smaller maxima may be ripples of the
# error.
PROMINENCE = 10.0
START, END, MARK = "start", "end", "mark"
PEAK_ROWS = LOW, HIGH, MARGIN, TOP  # of a channel with peaks
CONSTANTS = {
    "PEAKS": PEAKS,
    "RETURNS": RETURNS,
    "PARTS": PARTS,
    "RINGS": RINGS,
    "OPENS": OPENS,
    "CLOSES": CLOSES,
    "PROMINENCE": PROMINENCE,
}
HELPERS = {
    word: found for module in (interpolant, inside) for word, found in vars(module).items() if not word.startswith("_")
}


def own_rows(declaration: Declaration) -> dict[tuple[Any, ...], int]:
    """The position of each row of the observer among those of all observers, by (what,
    name) or (what,)."""
    outputs = declaration.outputs.names if declaration.outputs else ()
    keys: list[tuple[Any, ...]] = [
        *(("before", name) for name in outputs),
        *(("now", name) for name in outputs),
        *declaration.measured_per_half,
        *(
            (part, name)
            for name in declaration.channels_with_peaks
            if "least" in declaration.ends_of(name)
            for part in PEAK_ROWS
        ),
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
        self.helpers: dict[Any, tuple[str, Any]] = {}
        self.row_texts = {when: self._row_texts(when) for when in (START, END, MARK)}
        # what is known at the end of a step only
        aux = {name: self._row(rows.aux_now + k) for k, name in enumerate(names.aux)}
        self.known = {**self.row_texts[END], **aux}

    def compile(self, name: str, kinds: tuple[str, ...], given: str, lines: list[str], **namespace: Any) -> Any:
        """The compiled function ``name`` of the arguments ``given`` with these lines as
        its body."""
        head = [constants(W=self.lanes), f"def {name}({given}):"]
        text = "\n".join([*head, *indented(lines), ""])
        namespace |= HELPERS | CONSTANTS | dict(self.helpers.values())
        namespace |= {"math": math, "angle_between": angle_between, "lowest_bit": lowest_bit}
        function = define(name, text, **namespace)
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

    def _function(self, function: Any) -> str:
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
        found = self.declaration.extremes_of(name)
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


def centred(channel: Channel, k: int) -> str:
    return f"middle_of_{coefficients(channel, k)}"


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
