"""One step of an embedded explicit Runge-Kutta pair in every lane at once, each lane
with its own time and step size.

Positions and velocities alternate among the states, so the stages of the positions
follow from those of the velocities: only slopes of velocities are computed and stored
(see :class:`nsdrill.kernel.tableau.Tableau`). The result is that of the pair, with half
the memory traffic, which limits the speed of a packed step. To states of first order
the pair is applied as it is.

A step runs from (``time``, ``start``, ``start_acceleration``) to (``time`` + ``step``,
``stage``, ``acceleration``). The controller accepts or rejects it, and then the
observer is called. An accepted step (``moves``) is committed at the beginning of the
next step, or before by the loop.

The weights are compile-time constants and every sum is written out, as the compiler
packs no loop over weights: the text of the step is made from the tableau, in the
functions below, which give its lines in order.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import STEPPER, Rows
from nsdrill.compiler.functions import compiled
from nsdrill.compiler.words import fma
from nsdrill.generate import constants, define
from nsdrill.kernel.controller import decide
from nsdrill.kernel.scheme import Scheme, TableauStepper, square
from nsdrill.kernel.tableau import Tableau
from nsdrill.kernel.text import (
    drifted_position,
    error_control,
    indented,
    loops_over,
    second_stage,
    slope_loads,
    stage_time,
    step_constants,
    sum_of_slopes,
)


@dataclass(frozen=True)
class ExplicitPair(TableauStepper):
    """A stepper (:class:`nsdrill.kernel.steppers.Stepper`) from the numbers of a
    pair."""

    tableau: Tableau

    def rows(self, rows: Rows) -> Rows:
        """``rows`` with the stepper's rows: the slopes at the inner stages, and the
        positions' change over the step at constant velocity."""
        inner = len(self.tableau.nodes) - 2
        return replace(rows, private=(inner + 1) * rows.slopes)

    def scheme(self, rows: Rows) -> Scheme:
        """The numbers of a step, in a buffer with these rows."""
        pair, stages = self.tableau, len(self.tableau.matrix)
        zeros = np.zeros((stages, stages))
        slopes = (rows.start_acceleration, *(rows.stepper + n * rows.slopes for n in range(stages - 1)))
        return Scheme(
            np.array(pair.nodes[1:]),
            square(pair.matrix, stages),
            square(pair.positions, stages),
            zeros,
            zeros,
            slopes,
            (),
        )

    def make(self, lanes: int, rows: Rows) -> Any:
        """The compiled stepper for a number of lanes and a row layout with this pair's
        rows."""
        return _make(self.tableau, lanes, rows)


@lru_cache
def _make(pair: Tableau, lanes: int, rows: Rows) -> Any:
    step = define("step", _text(pair, lanes, rows), fma=fma, decide=decide)
    return compiled(STEPPER)(step)


def _text(pair: Tableau, lanes: int, rows: Rows) -> str:
    """The text of ``step(b, right_hand_side, observer, store)``."""
    stages, W = len(pair.nodes), lanes
    values = {
        **step_constants(rows, lanes, pair.order),
        **{f"a{k}_": W * (rows.stepper + (k - 2) * rows.slopes) for k in range(2, stages)},
        "drift_": W * (rows.stepper + (stages - 2) * rows.slopes),
    }
    lines = [
        '"""One step in all lanes; made from the tableau of a Runge-Kutta pair."""',
        "",
        constants(**values),
        "def step(b, right_hand_side, observer, store):",
        *indented(_second_stage(pair, rows)),
        *(line for k in range(3, stages + 1) for line in indented(_stage(pair, rows, k))),
        *indented(_error_control(pair, rows)),
        "    call(observer, b, store)",
        "    return any_attention",
    ]
    return "\n".join(lines) + "\n"


def _second_stage(pair: Tableau, rows: Rows) -> Iterable[str]:
    """The lines of the second stage."""
    c, weight = pair.nodes[1], pair.matrix[0][0]
    return second_stage(
        rows,
        c,
        "min(b[proposed_ + i], b[mark_time_ + i] - t)",
        lambda pushed: f"fma({c!r}, drift, x_now)",
        lambda pushed: f"{weight!r} * a1",
    )


def _stage(pair: Tableau, rows: Rows, stage: int) -> Iterable[str]:
    """The lines of stage ``stage``, counted from 1, in one pass over the states: the
    slope just computed is stored, and the stage values are formed. Where two successive
    stages have the same node, the time is set once."""
    c, weights, position_weights = (pair.nodes[stage - 1], pair.matrix[stage - 2], pair.positions[stage - 2])
    newest = f"a{stage - 1}"
    head = ["for i in packed(W):", "    h = b[step_ + i]", f"    hh, newest = h * h, h * {weights[-1]!r}"]
    yield from head
    if c != pair.nodes[stage - 2]:
        yield f"    {stage_time(c)}"
    for loop, order, _ in loops_over(rows):
        yield f"    {loop}"
        yield from (f"        {line}" for line in slope_loads(stage - 1))
        yield f"        b[{newest}_ + j] = {newest}"
        if order == 2:
            yield f"        b[stage_ + x] = fma(hh, {sum_of_slopes(position_weights)}, {drifted_position(c)})"
        last = "xv"[order - 1]
        rate = sum_of_slopes(weights[:-1])
        yield (f"        b[stage_ + {last}] = fma(newest, {newest}, fma(h, {rate}, b[start_ + {last}]))")
    yield "call(right_hand_side, b)"


def _error_control(pair: Tableau, rows: Rows) -> Iterable[str]:
    """The lines that estimate the error of each state and decide on the step."""
    stages = len(pair.nodes)

    def errors(order: int, pushed: bool) -> Iterable[str]:
        yield from slope_loads(stages - 1, newest=False)
        yield f"a{stages} = b[slope_ + j]"
        if order == 2:
            yield f"error_x = h * {sum_of_slopes(pair.position_error)}"
        yield f"error_{'xv'[order - 1]} = {sum_of_slopes(pair.error)}"

    return error_control(rows, errors)
