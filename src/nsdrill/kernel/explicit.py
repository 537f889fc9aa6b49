"""One step of an embedded explicit Runge-Kutta pair in every lane at once, each lane with its own time and step size.

States are positions and velocities in turn, so the stages of the positions follow from those of the velocities: only
slopes of velocities are computed and kept (see :class:`nsdrill.kernel.tableau.Tableau`). The result is the pair's own,
with half the memory traffic, which is what limits a packed step. States of first order take the pair as it is.

A step runs from (``time``, ``start``, ``start_acceleration``) to (``time`` + ``step``, ``stage``, ``acceleration``).
The controller judges it and the observer is shown it. The lanes whose step was accepted (``moves``) move on when the
next step begins, or earlier by the loop's hand.

The weights are compile-time constants and every sum is written out, as the compiler packs no loop over weights: the
text of the step is made from the tableau, in the functions below, which give its lines in order.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, replace
from functools import lru_cache
from typing import Any

from numba import types

from nsdrill.abi import BUFFER, CONTROL, MARK, OBSERVER, RIGHT_HAND_SIDE, Rows, compiled
from nsdrill.elementary import fma
from nsdrill.generate import constants, define
from nsdrill.kernel.controller import INTEGRAL, decide
from nsdrill.kernel.tableau import Tableau

# Pairs of states in one loop over the lanes. The compiler unrolls the loop over them, else it packs none; of more pairs
# it does so no longer, and each part of them has a loop over the lanes of its own.
TOGETHER, PART = 8, 4


@dataclass(frozen=True)
class ExplicitPair:
    """A stepper (:class:`nsdrill.kernel.steppers.Stepper`) from the numbers of a pair."""

    tableau: Tableau

    @property
    def name(self) -> str:
        return self.tableau.name

    @property
    def order(self) -> int:
        return self.tableau.order

    def rows(self, rows: Rows) -> Rows:
        """``rows`` with room for the slopes at the inner stages and, once, for how far the positions would go."""
        inner = len(self.tableau.nodes) - 2
        return replace(rows, private=(inner + 1) * rows.slopes)

    def make(self, lanes: int, rows: Rows) -> Any:
        """The compiled stepper for a number of lanes and a row layout with this pair's rows."""
        return _make(self.tableau, lanes, rows)


@lru_cache
def _make(pair: Tableau, lanes: int, rows: Rows) -> Any:
    step = define("step", _text(pair, lanes, rows), fma=fma, decide=decide)
    return compiled(types.int64(BUFFER, RIGHT_HAND_SIDE, OBSERVER, BUFFER), lanes, *astuple(rows))(step)


def _text(pair: Tableau, lanes: int, rows: Rows) -> str:
    """The text of ``step(b, right_hand_side, observer, store)``."""
    stages, W = len(pair.nodes), lanes
    places = {
        "W": W, "stage_": W * rows.stage, "slope_": W * rows.acceleration, "stage_time_": W * rows.stage_time,
        "start_": W * rows.start, "a1_": W * rows.start_acceleration, "drift_": W * rows.drift, "size_": W * rows.size,
        "time_": W * rows.time, "step_": W * rows.step, "moves_": W * rows.moves,
        **{f"a{k}_": W * (rows.stepper + (k - 2) * rows.slopes) for k in range(2, stages)},
        "lead_": W * (rows.stepper + (stages - 2) * rows.slopes),
        **{f"{name}_": W * (rows.control + i) for i, name in enumerate(CONTROL)},
        "MARK": MARK, "PROPORTIONAL": 1.0 / pair.order - 0.75 * INTEGRAL, "PER_ORDER": 1.0 / pair.order,
    }  # fmt: skip
    lines = [
        '"""One step in all lanes; made from the tableau of a Runge-Kutta pair."""',
        "",
        constants(**places),
        "def step(b, right_hand_side, observer, store):",
        *_indented(_first_stage(pair, rows)),
        *(line for k in range(3, stages + 1) for line in _indented(_stage(pair, rows, k))),
        *_indented(_judgement(pair, rows)),
        "    observer(b, store)",
        "    return wanted",
    ]
    return "\n".join(lines) + "\n"


def _first_stage(pair: Tableau, rows: Rows) -> Iterable[str]:
    """The lanes whose last step was accepted move on; then the second stage. (Both values are loaded and one is
    selected: a masked store could not be forwarded to the loads that follow.)"""
    c, weight = pair.nodes[1], pair.matrix[0][0]
    yield "for i in range(W):"
    yield "    moves = b[moves_ + i] != 0.0"
    yield "    before, after = b[time_ + i], b[time_ + i] + b[step_ + i]"
    yield "    t = after if moves else before"
    yield "    h = min(b[proposed_ + i], b[mark_time_ + i] - t)"
    yield "    b[time_ + i] = t"
    yield "    b[step_ + i] = h"
    yield f"    b[stage_time_ + i] = fma({c!r}, h, t)"
    for loop, order, alone in _loops(rows.blocks):
        if alone:
            yield "for i in range(W):"
            yield "    moves, h = b[moves_ + i] != 0.0, b[step_ + i]"
        yield f"    {loop}"
        for state in "xv"[:order]:
            yield f"        {state}_before, {state}_after = b[start_ + {state}], b[stage_ + {state}]"
        yield "        a_before, a_after = b[a1_ + j], b[slope_ + j]"
        for state in "xv"[:order]:
            yield f"        {state}_now = {state}_after if moves else {state}_before"
        yield "        a1 = a_after if moves else a_before"
        if order == 2:
            yield "        lead = h * (v_now + b[drift_ + j])"
        for state in "xv"[:order]:
            yield f"        b[start_ + {state}] = {state}_now"
        yield "        b[a1_ + j] = a1"
        if order == 2:
            yield "        b[lead_ + j] = lead"
            yield f"        b[stage_ + x] = fma({c!r}, lead, x_now)"
        last = "xv"[order - 1]
        yield f"        b[stage_ + {last}] = fma(h, {weight!r} * a1, {last}_now)"
    yield "right_hand_side(b)"


def _stage(pair: Tableau, rows: Rows, stage: int) -> Iterable[str]:
    """Stage ``stage``, counted from 1, in one pass over the states: the slope just computed is kept, and the next
    values are formed. Where the last two stages stand at one time, it is set once."""
    c, weights, bends = pair.nodes[stage - 1], pair.matrix[stage - 2], pair.positions[stage - 2]
    newest = f"a{stage - 1}"
    head = ["for i in range(W):", "    h = b[step_ + i]", f"    hh, newest = h * h, h * {weights[-1]!r}"]
    yield from head
    if c != pair.nodes[stage - 2]:
        yield f"    b[stage_time_ + i] = {'b[time_ + i] + h' if c == 1.0 else f'fma({c!r}, h, b[time_ + i])'}"
    for loop, order, alone in _loops(rows.blocks):
        if alone:
            yield from head
        yield f"    {loop}"
        yield from (f"        {line}" for line in _slopes(stage - 1))
        yield f"        b[{newest}_ + j] = {newest}"
        if order == 2:
            ahead = "b[lead_ + j] + b[start_ + x]" if c == 1.0 else f"fma({c!r}, b[lead_ + j], b[start_ + x])"
            yield f"        b[stage_ + x] = fma(hh, {_sum(bends)}, {ahead})"
        last = "xv"[order - 1]
        rate = _sum(weights[:-1])
        yield f"        b[stage_ + {last}] = fma(newest, {newest}, fma(h, {rate}, b[start_ + {last}]))"
    yield "right_hand_side(b)"


def _judgement(pair: Tableau, rows: Rows) -> Iterable[str]:
    """The error of each state against its own tolerance rtol (size + |y|), squared and summed; what follows from it.
    The quotients of a pair share one division."""
    stages = len(pair.nodes)
    yield "wanted = 0"
    yield "for i in range(W):"
    yield "    h, proposal = b[step_ + i], b[proposed_ + i]"
    yield "    total = 0.0"
    judged = rows.states if rows.judged else rows.own
    own = [block for block in rows.blocks if block[2] < judged]
    for loop, order, alone in _loops(own):
        if alone:  # what has its place later, when the step is judged, has the sum until then
            yield "    b[attention_ + i] = total"
            yield "for i in range(W):"
            yield "    h, proposal, total = b[step_ + i], b[proposed_ + i], b[attention_ + i]"
        yield f"    {loop}"
        yield from (f"        {line}" for line in _slopes(stages - 1, newest=False))
        yield f"        a{stages} = b[slope_ + j]"
        if order == 2:
            yield f"        error_x = h * {_sum(pair.position_error)}"
        yield f"        error_{'xv'[order - 1]} = {_sum(pair.error)}"
        for state in "xv"[:order]:
            largest = f"max(abs(b[start_ + {state}]), abs(b[stage_ + {state}]))"
            yield f"        scale_{state} = b[size_ + {state}] + {largest}"
        if order == 2:
            yield "        cross_x, cross_v, both = error_x * scale_v, error_v * scale_x, scale_x * scale_v"
            yield "        total += fma(cross_x, cross_x, cross_v * cross_v) / (both * both)"
        else:
            yield "        quotient = error_x / scale_x"
            yield "        total = fma(quotient, quotient, total)"
    yield f"""\
    ratio = h * b[per_rtol_ + i]
    tries = b[accepted_ + i] + b[rejected_ + i] + 1.0
    accepted, proposed, last, growth, attention = decide(
        total * (1.0 / {judged}) * (ratio * ratio), h, b[last_error_ + i], b[growth_ + i], b[least_step_ + i],
        tries >= b[limit_ + i], PROPORTIONAL, PER_ORDER)
    # A step cut short by a mark says little about the next one: the earlier proposal stands.
    cut = h < proposal
    at_mark = accepted and h >= b[mark_time_ + i] - b[time_ + i]
    proposed = max(proposed, proposal) if (accepted and cut) else proposed
    attention = MARK if at_mark else attention
    running = b[running_ + i]
    b[proposed_ + i] = proposed
    b[last_error_ + i] = last
    b[growth_ + i] = growth
    b[accepted_ + i] += running if accepted else 0.0
    b[rejected_ + i] += 0.0 if accepted else running
    b[moves_ + i] = 1.0 if accepted else 0.0
    b[attention_ + i] = attention * running
    wanted |= 0 if attention * running == 0.0 else 1"""


def _loops(blocks: Iterable[tuple[int, int, int, int]]) -> list[tuple[str, int, bool]]:
    """The heads of the loops over blocks of states, with the order of their states, and whether a loop over the lanes
    begins anew before it: x is the place of a position, or of a state of first order, v that of its velocity, j that of
    its slope. Blocks of pairs that follow one another are one."""
    joined: list[list[int]] = []
    for order, count, state, slope in blocks:
        if joined and joined[-1][0] == order == 2 and joined[-1][2] + 2 * joined[-1][1] == state:
            joined[-1][1] += count
        else:
            joined.append([order, count, state, slope])
    apart = sum(count for _, count, _, _ in joined) > TOGETHER
    heads: list[tuple[str, int, bool]] = []
    for order, count, state, slope in joined:
        places = [f"({order} * p + {state + k}) * W + i" for k in range(order)] + [f"(p + {slope}) * W + i"]
        names = "x, v, j" if order == 2 else "x, j"
        for first in range(0, count, PART if apart else count):
            span = f"{first}, {min(first + PART, count)}" if apart else f"{count}"
            head = f"for p in range({span}):\n        {names} = {', '.join(places)}"
            heads.append((head, order, apart and bool(heads)))
    return heads


def _slopes(upto: int, newest: bool = True) -> Iterable[str]:
    """Loads of the slopes a1, ..., the newest of them from where the right-hand side has left it."""
    for k in range(1, upto + 1):
        yield f"a{k} = b[{'slope_' if newest and k == upto else f'a{k}_'} + j]"


def _sum(weights: Sequence[float]) -> str:
    """The weighted sum of the slopes a1, a2, ... as nested multiply-adds; weights of zero are left out."""
    terms = [(weight, k) for k, weight in enumerate(weights, start=1) if weight != 0.0]
    if not terms:
        return "0.0"
    (weight, k), rest = terms[-1], terms[:-1]
    text = f"{weight!r} * a{k}"
    for weight, k in reversed(rest):
        text = f"fma({weight!r}, a{k}, {text})"
    return text


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"    {part}" for line in lines for part in line.split("\n")]
