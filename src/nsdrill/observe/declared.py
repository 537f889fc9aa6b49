"""The observer of a declaration (:mod:`nsdrill.observe.channels`), for any model and
any number of lanes.

It is made as text. Every packed step is examined in all lanes at once: the ends of the
step are compared with what was found so far, sums over time are added up, and a number
a lane notes the channels in which something happens inside the step: a quantity turns
(its slope changes sign) or crosses its level. That is so in a few lanes only; they are
then attended to one after another (:mod:`nsdrill.observe.inside`). Nothing depends on
the neighbours.
"""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types
from numba.core.errors import NumbaError

from nsdrill.abi import BUFFER, CLOSES, CONTROL, OPENS, Rows, compiled
from nsdrill.elementary import angle_between, bits_float, float_bits, fma, lowest_bit
from nsdrill.generate import constants, define
from nsdrill.observe import interpolant
from nsdrill.observe.channels import (
    MOST,
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
from nsdrill.observe.inside import HIGH, LOW, MARGIN, NONE, locate, note_returns, turns
from nsdrill.scalar import embedded

# Tolerances by which a maximum stands out from what is before and after it, to be a
# peak and no ripple of the error.
PROMINENCE = 10.0
# Channels in one loop over the lanes: a loop with too many places in the buffer (six
# channels with all their features, measured) the compiler does not pack.
TOGETHER = 2
START, END, MARK = "start", "end", "mark"
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
    """Where the observer keeps what: the places of its rows among those of the
    observers."""
    outputs = declaration.outputs.names if declaration.outputs else ()
    keys: list[tuple[Any, ...]] = [
        *(("before", name) for name in outputs),
        *(("now", name) for name in outputs),
        *declaration.half,
        *((part, name) for name in declaration.peaking for part in (LOW, HIGH, MARGIN)),
        ("growth",),
        ("word",),
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
    layout, of which ``names`` are the rows. The observer's own rows are the first of
    ``rows.observed``; the layout need not know the stepper's.

    ValueError where declaration, names and layout do not fit together.
    """
    check(names, declaration)
    for what, found, wanted in (
        ("states", len(names.states), rows.own),
        ("slopes", len(names.slopes), rows.own_slopes),
        # others may keep numbers after them
        ("aux", len(names.aux), min(len(names.aux), rows.aux)),
        ("parameters", len(names.parameters), rows.parameters),
    ):
        if found != wanted:
            raise ValueError(f"names.{what}: found {found} names for {wanted} rows")
    if rows.observed < (least := observed_rows(declaration)):
        raise ValueError(
            f"rows.observed: found {rows.observed}; allowed: at least {least}, see observed_rows"
        )
    return _Maker(lanes, rows, names, declaration).make()


class _Maker:
    """Writes the texts. In them b[row + i] is a row of lane i, and g0, d0, c0 and g1,
    d1, c1 followed by the number of a channel are its value, slope and curvature at the
    start and at the end of the step."""

    def __init__(self, lanes: int, rows: Rows, names: Names, declaration: Declaration) -> None:
        self.lanes, self.rows, self.names, self.declaration = lanes, rows, names, declaration
        self.number = {channel.name: k for k, channel in enumerate(declaration.channels)}
        self.own = own_rows(declaration)
        self.helpers: dict[Any, tuple[str, Any, str]] = {}
        self.places = {when: self._places(when) for when in (START, END, MARK)}

    def make(self) -> tuple[Any, Any]:
        attend = self._compile("attend", types.void(BUFFER, BUFFER, types.int64), self._attend())
        observer = self._compile(
            "observer", types.void(BUFFER, BUFFER), self._observer(), attend=attend
        )
        marker = self._compile(
            "marker",
            types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64),
            self._marker(),
        )
        return observer, marker

    def _compile(self, name: str, signature: Any, lines: list[str], **known: Any) -> Any:
        """From the lines of its body, the function ``name``. The code of all that it
        calls is told by its text, under which the machine code is kept."""
        called = [f"# {word}: {line}" for word, _, line in self.helpers.values()]
        called += [f"# {word}: {function.__name__}" for word, function in known.items()]
        takes = {
            "attend": "b, store, happens",
            "observer": "b, store",
            "marker": "b, store, i, mark, report, column",
        }
        tables = self._tables() if name == "attend" else []
        head = [*called, constants(W=self.lanes), *tables, f"def {name}({takes[name]}):"]
        text = "\n".join([*head, *_indented(lines), ""])
        known |= {word: helper for word, helper, _ in self.helpers.values()}
        known |= {word: getattr(interpolant, word) for word in HELPERS}
        function = define(
            name,
            text,
            np=np,
            fma=fma,
            angle_between=angle_between,
            lowest_bit=lowest_bit,
            float_bits=float_bits,
            bits_float=bits_float,
            turns=turns,
            locate=locate,
            note_returns=note_returns,
            **CONSTANTS,
            **known,
        )
        try:
            return compiled(signature, self.lanes, *astuple(self.rows.of_observer))(function)
        except NumbaError as error:
            functions = (
                ", ".join(getattr(f, "__qualname__", repr(f)) for f in self.helpers) or "none"
            )
            raise ValueError(
                f"the {name} cannot be compiled with the functions of the declaration "
                f"({functions}): each must take "
                "and return numbers and call only what the right-hand side may, and the one of "
                "Outputs must return a "
                "tuple of as many as there are names"
            ) from error

    # What rows and expressions are called in the text.
    def _b(self, row: int) -> str:
        return f"b[{self.lanes * row} + i]"

    def _own(self, *key: Any) -> str:
        return self._b(self._own_row(*key))

    def _own_row(self, *key: Any) -> int:
        return self.rows.observer + self.own[key]

    def _place(self, *key: Any) -> int:
        """Where an own row begins in the buffer, or NONE."""
        return self.lanes * self._own_row(*key) if key in self.own else NONE

    def _places(self, when: str) -> dict[str, str]:
        rows, names, outputs = self.rows, self.names, self.declaration.outputs
        first_state, first_slope, kept = (
            (rows.start, rows.start_acceleration, "before")
            if when == START
            else (rows.stage, rows.acceleration, "now")
        )
        begun, length = self._b(rows.time), self._b(rows.step)
        return {
            **{name: self._b(first_state + k) for k, name in enumerate(names.states)},
            **{name: self._b(first_slope + k) for k, name in enumerate(names.slopes)},
            **{name: self._b(rows.parameter + k) for k, name in enumerate(names.parameters)},
            **{name: self._own(kept, name) for name in (outputs.names if outputs else ())},
            "time": f"({begun} + {length})" if when == END else begun,
            "phase": self._b(rows.phase),
        }

    def _code(self, expression: Expression, place: dict[str, str]) -> str:
        if isinstance(expression, str):
            return place[expression]
        if not callable(expression):
            return repr(float(expression))
        if expression not in self.helpers:
            self.helpers[expression] = (f"function_{len(self.helpers)}", *embedded(expression))
        return f"{self.helpers[expression][0]}({', '.join(place[name] for name in arguments(expression))})"

    def _level(self, channel: Channel) -> str:
        return "np.inf" if channel.level is None else self._code(channel.level, self.places[END])

    def _ends(self, channel: Channel) -> list[str]:
        """Lines that give the channel's values, slopes and curvatures their names."""
        k, lines = self.number[channel.name], []
        for end, when in enumerate((START, END)):
            place = self.places[when]
            slope = self._code(channel.slope, place)
            lines += [
                f"g{end}_{k} = {self._code(channel.value, place)}",
                f"d{end}_{k} = {slope}" + (f" - {place[channel.frame]}" if channel.frame else ""),
            ]
            if channel.curvature is not None:
                lines.append(f"c{end}_{k} = {self._code(channel.curvature, place)}")
        return lines

    def _base(self, channel: Channel) -> Channel | None:
        return (
            self.declaration.channels[self.number[channel.rate_of]]
            if channel.rate_of is not None
            else None
        )

    def _frame(self, channel: Channel) -> str:
        return self.places[END][channel.frame] if channel.frame else "0.0"

    def _observer(self) -> list[str]:
        """All lanes, every step."""
        rows, outputs = self.rows, self.declaration.outputs
        shows = f"{self._b(rows.moves)} * {self._b(rows.window)} != 0.0"
        # The length is nothing that the compiler knows, or it would unroll the loop of
        # a small model before packing it.
        lanes = "for i in range(min(W, len(b)){}):"
        lines = ["seen = happens = 0", lanes.format("")]
        if outputs:
            reads = {
                **self.places[END],
                **{name: self._b(rows.aux_now + k) for k, name in enumerate(self.names.aux)},
            }
            results = "".join(f"{self._own('now', name)}, " for name in outputs.names)
            lines.append(f"    ({results}) = {self._code(outputs.function, reads)}")
        lines += [f"    seen |= (1 << i) if {shows} else 0", f"    {self._own('word')} = 0.0"]
        channels = self.declaration.channels
        for first in range(0, len(channels), TOGETHER):
            together = channels[first : first + TOGETHER]
            lines += [
                lanes.format(" if seen != 0 else 0"),
                f"    shows, h, word = {shows}, {self._b(rows.step)}, "
                f"float_bits({self._own('word')})",
                "    shown = h if shows else 0.0",
                "    per_h = 1.0 / h if h > 0.0 else 0.0",
            ]
            bases = [base for channel in together if (base := self._base(channel))]
            for channel in dict.fromkeys((*together, *bases)):
                lines += _indented(self._ends(channel))
            for channel in together:
                lines += _indented(self._seen(channel))
            lines += [
                "    word = word if shows else 0",
                f"    {self._own('word')} = bits_float(word)",
                "    happens |= (1 << i) if word != 0 else 0",
            ]
        for winding in self.declaration.those(Winding):
            lines += [
                lanes.format(" if seen != 0 else 0"),
                f"    shows = {shows}",
                *_indented(self._wound(winding)),
            ]
        lines += ["if happens != 0:", "    attend(b, store, happens)"]
        if outputs:
            lines += [lanes.format(""), f"    moves = {self._b(rows.moves)} != 0.0"]
            for name in outputs.names:
                lines += [
                    f"    before, now = {self._own('before', name)}, {self._own('now', name)}",
                    f"    {self._own('before', name)} = now if moves else before",
                ]
        return lines

    def _seen(self, channel: Channel) -> list[str]:
        """What is done with one channel in all lanes. (Both values are loaded and one
        is selected, where a lane is not observed: what it shows may be NaN.)"""
        k, name, lines = self.number[channel.name], channel.name, []
        bit, section = 1 << k, self.declaration.section
        if section and section.channel == name:
            lines.append(f"word |= {1 << MOST} if g1_{k} >= {self._own('level')} else 0")
        if ("least", name) in self.own or ("above", name) in self.own:
            lines.append(f"turning = turns(d0_{k}, d1_{k})")
        if ("least", name) in self.own:
            least, greatest = self._own("least", name), self._own("greatest", name)
            lines += [
                f"word |= {bit} if turning else 0",
                f"low, high = {least}, {greatest}",
                f"{least} = min(low, g1_{k}) if shows else low",
                f"{greatest} = max(high, g1_{k}) if shows else high",
            ]
        if (LOW, name) in self.own:
            low, high = self._own(LOW, name), self._own(HIGH, name)
            lines += [
                f"low, high = {low}, {high}",
                f"margin = fma({self._own('growth')}, abs(g1_{k}), {self._own(MARGIN, name)})",
                f"fallen = high - g1_{k} > margin",
                f"word |= {bit} if fallen else 0",
                "plain = shows and not turning and not fallen",
                f"rises = plain and g1_{k} - low > margin",
                f"{high} = max(high, g1_{k}) if rises else high",
                f"{low} = min(low, g1_{k}) if plain else low",
            ]
        if ("above", name) in self.own:
            lines += [
                f"level = {self._level(channel)}",
                f"above0, above1 = g0_{k} > level, g1_{k} > level",
                f"word |= {bit} if above0 != above1 else 0",
                f"word |= {bit} if turning and (d0_{k} > 0.0) != above0 else 0",
                f"{self._own('above', name)} += shown if above0 and above1 else 0.0",
            ]
        if ("passages", name) in self.own:
            rises = f"g0_{k} <= {self._level(channel)} and g1_{k} > {self._level(channel)}"
            lines += self._summed("passages", name, f"1.0 if {rises} else 0.0")
        base = self._base(channel)
        if ("integral", name) in self.own:
            if base:
                j = self.number[base.name]
                gathered = f"fma({self._frame(base)}, h, g1_{j} - g0_{j})"
            elif channel.curvature is None:
                gathered = f"h * fma(h * (1.0 / 12.0), d0_{k} - d1_{k}, 0.5 * (g0_{k} + g1_{k}))"
            else:
                gathered = (
                    f"h * fma(h, fma(h * (1.0 / 120.0), c0_{k} + c1_{k}, 0.1 * (d0_{k} - d1_{k})), "
                    f"0.5 * (g0_{k} + g1_{k}))"
                )
            lines += self._summed("integral", name, gathered)
        if ("square", name) in self.own:
            if base:
                lines.append(
                    f"_, e2, e4, o1, o3, o5 = {_about_the_middle(base, self.number[base.name])}"
                )
                middle = f"middle_of_rate(e2, e4, o1, o3, o5, per_h, {self._frame(base)})"
            else:
                middle = _about_the_middle(channel, k)
            lines += [
                f"e0, e2, e4, o1, o3, o5 = {middle}",
                *self._summed("square", name, "h * mean_square(e0, e2, e4, o1, o3, o5)"),
            ]
        return lines

    def _wound(self, winding: Winding) -> list[str]:
        """The angle by which a vector turns in the step."""
        x, y = (self.number[name] for name in (winding.x, winding.y))
        ends = [
            f"g{end}_{k} = {self._code(self.declaration.channels[k].value, self.places[when])}"
            for k in (x, y)
            for end, when in enumerate((START, END))
        ]
        turned = f"angle_between(g0_{x}, g0_{y}, g1_{x}, g1_{y})"
        return [*ends, *self._summed("angle", winding.name, turned)]

    def _summed(self, what: str, name: str, gathered: str) -> list[str]:
        total = self._own(what, name)
        return [f"total, more = {total}, {gathered}", f"{total} = total + more if shows else total"]

    def _tables(self) -> list[str]:
        """Lines that say by the number of a channel where its findings stand (see
        :func:`locate`)."""
        names, peaking = (
            [channel.name for channel in self.declaration.channels],
            self.declaration.peaking,
        )
        return [
            f"least_ = np.array({[self._place('least', name) for name in names]})",
            f"above_ = np.array({[self._place('above', name) for name in names]})",
            f"passages_ = np.array({[self._place('passages', name) for name in names]})",
            f"low_ = np.array({[self._place(LOW, name) for name in names]})",
            f"ring_ = "
            f"np.array({[peaking.index(name) if name in peaking else 0 for name in names]})",
        ]

    def _attend(self) -> list[str]:
        """One lane and one channel after the other, where something happens."""
        W, rows, peaking, section = (
            self.lanes,
            self.rows,
            self.declaration.peaking,
            self.declaration.section,
        )
        followed = [
            channel
            for channel in self.declaration.channels
            if ("least", channel.name) in self.own or ("above", channel.name) in self.own
        ]
        lines = [
            "peaks, returns = int(store[PEAKS]), int(store[RETURNS])",
            "while happens != 0:",
            "    i = lowest_bit(happens)",
            "    happens &= happens - 1",
            f"    h, word = {self._b(rows.step)}, float_bits({self._own('word')})",
            "    while word != 0:",
            "        k = lowest_bit(word)",
            "        word &= word - 1",
        ]
        if section:
            angle = self.declaration.channels[self.number[section.channel]]
            entry = len(self.names.states) + 1
            lines += [
                f"        if k == {MOST}:",
                *_indented(self._polynomial(angle), 3),
                "            note_returns(",
                "                b, store, i, W, h, p0, p1, p2, p3, p4, p5, end,",
                f"                {self._spacing()}, {self._place('level')},",
                f"                RINGS + {len(peaking) * W} * (peaks + 1) + i * (1 + {entry} * "
                f"returns), returns,",
                f"                {rows.pairs}, {rows.singles}, {W * rows.start}, "
                f"{W * rows.stage}, "
                f"{W * rows.start_acceleration}, {W * rows.acceleration}, {W * rows.frame_rate})",
                "            continue",
            ]
        for place, channel in enumerate(followed):
            head = f"{'elif' if place else 'if'} k == {self.number[channel.name]}:"
            # as the compiler wants each name to have a value in any case
            if place == len(followed) - 1:
                head = "else:" if place else "if True:"
            lines += [
                f"        {head}",
                *_indented(self._polynomial(channel), 3),
                f"            level = {self._level(channel)}",
            ]
        if followed:
            lines += [
                "        locate(",
                "            b, store, i, W, h, begin, p0, p1, p2, p3, p4, p5, end, end_slope, "
                "level,",
                f"            least_[k], above_[k], passages_[k], low_[k], "
                f"{self._place('growth')},",
                f"            RINGS + ({len(peaking)} * i + ring_[k]) * (peaks + 1), peaks)",
            ]
        return lines

    def _polynomial(self, channel: Channel) -> list[str]:
        """Lines that give a channel's coefficients p0 to p5 over the step, and what it
        has at the ends."""
        base, k = self._base(channel), self.number[channel.name]
        lines = [*self._ends(channel), f"begin, end, end_slope = g0_{k}, g1_{k}, h * d1_{k}"]
        if base is None:
            return [*lines, f"p0, p1, p2, p3, p4, p5 = {_coefficients(channel, k)}"]
        j = self.number[base.name]
        return [
            *lines,
            *self._ends(base),
            f"_, p1, p2, p3, p4, p5 = {_coefficients(base, j)}",
            "p0, p1, p2, p3, p4, p5 = derivative(p1, p2, p3, p4, p5)",
            "p0, p1, p2, p3, p4 = begin, p1 / h, p2 / h, p3 / h, p4 / h",
        ]

    def _marker(self) -> list[str]:
        """One lane at a mark: its state is in the rows of the step's end, and so are
        the outputs."""
        peaking, half, states = (
            self.declaration.peaking,
            len(self.declaration.half),
            len(self.names.states),
        )
        first_half = self.lanes * (
            self.rows.observer + min((self.own[key] for key in self.declaration.half), default=0)
        )
        place, channels = self.places[MARK], self.declaration.channels
        lines = [
            "peaks, returns = int(store[PEAKS]), int(store[RETURNS])",
            f"width = {len(peaking)} * (peaks + 1)",
            f"of_section = 1 + {states + 1} * returns if {int(bool(self.declaration.section))} "
            f"and returns > 0 else 0",
            "rings, section = RINGS + i * width, RINGS + W * width + i * of_section",
            "if mark == OPENS:",
            "    for k in range(width):",
            "        store[rings + k] = 0.0",
            "    for k in range(of_section):",
            "        store[section + k] = 0.0",
            f"    tolerances = PROMINENCE / "
            f"{self._b(self.rows.control + CONTROL.index('per_rtol'))}",
            f"    {self._own('growth')} = tolerances",
        ]
        for name in peaking:
            channel = channels[self.number[name]]
            lines += [
                f"    {self._own(LOW, name)} = {self._code(channel.value, place)}",
                f"    {self._own(HIGH, name)} = -np.inf",
                f"    {self._own(MARGIN, name)} = tolerances * {self._size(channel)}",
            ]
        if self.declaration.section:
            angle = channels[self.number[self.declaration.section.channel]]
            lines += [
                f"    spacing, angle = {self._spacing()}, {self._code(angle.value, place)}",
                f"    {self._own('level')} = np.inf",
                "    if returns > 0 and spacing > 0.0:",
                f"        {self._own('level')} = (np.floor(angle / spacing) + 1.0) * spacing",
            ]
        lines += [
            "else:",
            f"    first = column if mark != CLOSES else column + {half}",
            f"    for k in range({half}):",
            f"        report[first + k] = b[{first_half} + k * W + i]",
            "    if mark == CLOSES:",
            "        for k in range(width):",
            f"            report[column + {2 * half} + k] = store[rings + k]",
            "        for k in range(of_section):",
            f"            report[column + {2 * half} + width + k] = store[section + k]",
            f"for k in range({half}):",
            f"    b[{first_half} + k * W + i] = 0.0",
        ]
        for name in self.declaration.channels_of(Extremes):
            lines += [
                f"now = {self._code(channels[self.number[name]].value, place)}",
                f"{self._own('least', name)} = now",
                f"{self._own('greatest', name)} = now",
            ]
        return lines

    def _size(self, channel: Channel) -> str:
        scale = scale_of(channel, self.names)
        if scale in self.names.states:
            return self._b(self.rows.scale + self.names.states.index(str(scale)))
        return f"abs({self._code(scale, self.places[MARK])})"

    def _spacing(self) -> str:
        section = self.declaration.section
        return self._code(section.spacing, self.places[MARK]) if section else "0.0"


def _coefficients(channel: Channel, k: int) -> str:
    if channel.curvature is None:
        return f"cubic(g0_{k}, h * d0_{k}, g1_{k}, h * d1_{k})"
    return f"quintic(g0_{k}, h * d0_{k}, h * h * c0_{k}, g1_{k}, h * d1_{k}, h * h * c1_{k})"


def _about_the_middle(channel: Channel, k: int) -> str:
    return f"middle_of_{_coefficients(channel, k)}"


def _indented(lines: list[str], by: int = 1) -> list[str]:
    return [f"{by * 4 * ' '}{line}" for line in lines]
