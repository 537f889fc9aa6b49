"""Programs drawn at random do in machine code what they do in the interpreter, to the
bit."""

from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nsdrill.compiler.functions import define, lowest_bit

from .running import WIDTHS, floats, same, whole

ROWS = 6  # of the buffer: three of any numbers, one of whole ones, two that are written
FLOATS = ("s0", "s1", "s2")
INTEGERS = ("n0", "n1", "n2")


class Writer:
    """Draws a program. Integers stay below 128, so that the 64 bits of the machine hold
    what Python's hold."""

    def __init__(self, draw: Any, lanes: int) -> None:
        self.draw, self.lanes = draw, lanes
        self.lines: list[str] = []
        self.count = 0

    def pick(self, *choices: Any) -> Any:
        return self.draw(st.sampled_from(choices))

    def line(self, depth: int, text: str) -> None:
        self.lines.append("    " * depth + text)

    def new(self, letter: str) -> str:
        self.count += 1
        return f"{letter}{self.count}"

    # Expressions; ``names`` are the names of floats and of integers that have a value,
    # ``lane`` is the index of the lane in a loop over lanes.
    def real(self, names: tuple[list[str], list[str]], lane: str, deep: int = 3) -> str:
        kind = self.draw(st.integers(0, 11)) if deep else self.draw(st.integers(0, 3))
        more = deep - 1
        if kind == 0:
            return self.pick(*names[0])
        if kind == 1:
            return repr(self.pick(0.5, -2.0, 3.0, 0.1, 1e3))
        if kind == 2 or kind == 3:
            row = self.draw(st.integers(0, ROWS - 1))
            return f"b[{row} * W + {lane or self.draw(st.integers(0, self.lanes - 1))}]"
        if kind == 4:
            return f"float({self.whole(names, lane, more)})"
        if kind == 5:
            return f"{self.pick('abs', 'np.floor', 'np.sqrt', 'np.rint', '-')}({self.real(names, lane, more)})"
        if kind == 6:
            given = ", ".join(self.real(names, lane, more) for _ in range(self.pick(2, 3)))
            return f"{self.pick('min', 'max')}({given})"
        if kind <= 8:
            one, two = self.real(names, lane, more), self.real(names, lane, more)
            return f"({one} if {self.truth(names, lane, more)} else {two})"
        one, two = self.real(names, lane, more), self.real(names, lane, more)
        # what is divided by is a number of the buffer, so the interpreter does not refuse
        operation = self.pick("+", "-", "*")
        return f"({one} {operation} {two})" if kind < 11 else f"({one} / b[{lane or 0}])"

    def whole(self, names: tuple[list[str], list[str]], lane: str, deep: int = 3) -> str:
        kind = self.draw(st.integers(0, 9)) if deep else self.draw(st.integers(0, 2))
        more = deep - 1
        if kind == 0:
            return self.pick(*names[1])
        if kind == 1:
            return str(self.pick(0, 1, 3, -5, 64))
        if kind == 2:
            return lane or self.pick(*names[1])
        if kind == 3:
            return f"int(min(9.0, max(-9.0, {self.real(names, lane, more)})))"
        if kind == 4:
            return f"-({self.whole(names, lane, more)})"
        if kind == 5:
            operation, by = self.pick(("//", 3), ("//", -4), ("%", 7), ("%", -2), (">>", 2), ("<<", 1))
            return f"({self.whole(names, lane, more)} {operation} {by})"
        if kind == 6:
            divisor = self.whole(names, lane, more)
            return f"({self.whole(names, lane, more)} {self.pick('//', '%')} ({divisor} | 1))"
        one, two = self.whole(names, lane, more), self.whole(names, lane, more)
        if kind == 7:
            return f"({one} if {self.truth(names, lane, more)} else {two})"
        return f"({one} {self.pick('+', '-', '*', '&', '|', '^')} {two})"

    def truth(self, names: tuple[list[str], list[str]], lane: str, deep: int = 2) -> str:
        kind = self.draw(st.integers(0, 5)) if deep > 0 else 0
        more = deep - 1
        if kind <= 2:
            made = self.real if self.pick(True, False) else self.whole
            first, second = made(names, lane, max(more, 0)), made(names, lane, max(more, 0))
            compared = f"{first} {self.pick('<', '<=', '>', '>=', '==', '!=')} {second}"
            return f"({compared} < {made(names, lane, 0)})" if kind == 2 else f"({compared})"
        if kind == 3:
            return f"(not {self.truth(names, lane, more)})"
        joined = self.pick("and", "or", "==", "!=", "&", "|", "^")
        return f"({self.truth(names, lane, more)} {joined} {self.truth(names, lane, more)})"

    # Statements.
    def block(self, depth: int, indices: list[str], in_loop: bool, size: int = 3) -> None:
        names = list(FLOATS), [*INTEGERS, *indices]
        for _ in range(self.draw(st.integers(1, size))):
            kind = self.draw(st.integers(0, 9 if depth < 4 else 3))
            if kind <= 1:
                self.line(depth, f"{self.pick(*FLOATS)} = {self.real(names, '')}")
            elif kind == 2:
                self.line(depth, f"{self.pick(*INTEGERS)} = (({self.whole(names, '')}) & 255) - 128")
            elif kind == 3:
                self.line(depth, self.pick("s0, s1 = s1, s0 + 1.0", "s2 -= s0 * 0.5", "s1 = s2 = s0", "n0 ^= 5"))
            elif kind <= 5:
                self.line(depth, f"if {self.truth(names, '')}:")
                self.block(depth + 1, indices, in_loop)
                if in_loop and self.draw(st.integers(0, 3)) == 0:
                    self.line(depth + 1, self.pick("break", "continue"))
                elif self.pick(True, False):
                    self.line(depth, "else:")
                    self.block(depth + 1, indices, in_loop)
            elif kind == 6:
                self.for_range(depth, indices)
            elif kind == 7:
                turns = self.new("w")
                self.line(depth, f"{turns} = 0")
                more = f" and {self.truth(names, '')}" if self.pick(True, False) else ""
                self.line(depth, f"while {turns} < {self.pick(1, 3, 9)}{more}:")
                self.line(depth + 1, f"{turns} += 1")
                self.block(depth + 1, [*indices, turns], True)
            else:
                self.over_lanes(depth, names)

    def for_range(self, depth: int, indices: list[str]) -> None:
        index = self.new("j")
        turns = self.pick("2", "4", "9", "1, 14, 4", "12, 0, -5", "n0 & 7", "n1, n1 + 3", "n2 & 3, -2, -1")
        self.line(depth, f"for {index} in range({turns}):")
        self.block(depth + 1, [*indices, index], True)

    def over_lanes(self, depth: int, names: tuple[list[str], list[str]]) -> None:
        """A loop over lanes; sets of lanes, and what is done in those lanes."""
        lane, chosen = self.new("i"), self.new("m")
        self.line(depth, f"{chosen} = 0")
        self.line(depth, f"for {lane} in packed(W):")
        mine = list(names[0]), list(names[1])
        for _ in range(self.draw(st.integers(1, 4))):
            kind = self.draw(st.integers(0, 4))
            if kind == 0:
                self.line(
                    depth + 1, f"b[{self.pick(4, 5)} * W + {lane}] {self.pick('=', '+=', '*=')} {self.real(mine, lane)}"
                )
            elif kind <= 2:
                local = self.new("x")
                self.line(depth + 1, f"{local} = {self.real(mine, lane)}")
                mine[0].append(local)
                if kind == 2:
                    index = self.new("q")
                    self.line(depth + 1, f"for {index} in range({self.pick('3', '10', '1, 20, 6')}):")
                    inner = mine[0], [*mine[1], index]
                    self.line(depth + 2, f"{local} = {self.real(inner, lane, 2)}")
            elif kind == 3:
                local = self.new("k")
                self.line(depth + 1, f"{local} = ({self.whole(mine, lane)}) & 63")
                mine[1].append(local)
            else:
                self.line(depth + 1, f"{chosen} |= (1 << {lane}) if {self.truth(mine, lane)} else 0")
        if self.pick(True, False):
            one = self.new("o")
            self.line(depth, f"while {chosen} != 0:")
            self.line(depth + 1, f"{one} = lowest_bit({chosen})")
            self.line(depth + 1, f"{chosen} &= {chosen} - 1")
            place = f"b[{self.pick(4, 5)} * W + {one}]"
            self.line(depth + 1, f"{place} = {self.real((names[0], [*names[1], one]), one)}")
        else:
            self.line(depth, f"n1 = {chosen} & 127")


@st.composite
def programs(draw: Any) -> tuple[int, str]:
    lanes = draw(st.sampled_from([1, 3, 8, 12]))
    writer = Writer(draw, lanes)
    writer.line(1, "s0, s1, s2 = b[0], b[W], b[2 * W]")
    writer.line(1, "n0, n1, n2 = int(b[3 * W]), 5, -3")
    writer.block(1, [], False, 5)
    writer.line(1, "b[4 * W] = s0 + s1 * s2")
    writer.line(1, "b[5 * W] = float(n0 + 256 * n1) + float(n2)")
    return lanes, "\n".join(["def program(b):", *writer.lines, ""])


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(programs(), st.sampled_from(WIDTHS), st.integers(0, 2**32 - 1))
def test_any_program(drawn, width, seed):
    lanes, text = drawn
    function = define("program", text, W=lanes, np=np, lowest_bit=lowest_bit)
    rng = np.random.default_rng(seed)
    buffers = (np.concatenate([floats(rng, 3 * lanes), whole(rng, lanes), floats(rng, 2 * lanes)]) for _ in range(4))
    same(function, buffers, (width,))
