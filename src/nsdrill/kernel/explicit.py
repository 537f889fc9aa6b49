"""One step of an embedded explicit Runge-Kutta pair in every lane at once, each lane
with its own time and step size.

States are positions and velocities in turn, so the stages of the positions follow from
those of the velocities: only slopes of velocities are computed and kept (see
:class:`nsdrill.kernel.tableau.Tableau`). The result is the pair's own, with half the
memory traffic, which is what limits a packed step. States of first order take the pair
as it is.

A step runs from (``time``, ``start``, ``start_acceleration``) to (``time`` + ``step``,
``stage``, ``acceleration``). The controller judges it and the observer is shown it. The
lanes whose step was accepted (``moves``) move on when the next step begins, or earlier
by the loop's hand.

The weights are compile-time constants and every sum is written out, as the compiler
packs no loop over weights: the text of the step is made from the tableau, in the
functions below, which give its lines in order.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, OBSERVER, RIGHT_HAND_SIDE, Rows, compiled
from nsdrill.elementary import fma
from nsdrill.generate import constants, define
from nsdrill.kernel.controller import decide
from nsdrill.kernel.scheme import OfTableau, Scheme, square
from nsdrill.kernel.tableau import Tableau
from nsdrill.kernel.text import (
    first_stages,
    indented,
    judgement,
    led,
    loads,
    loops_over,
    places_of,
    stage_time,
    sum_of_slopes,
)


@dataclass(frozen=True)
class ExplicitPair(OfTableau):
    """A stepper (:class:`nsdrill.kernel.steppers.Stepper`) from the numbers of a pair."""

    tableau: Tableau

    def rows(self, rows: Rows) -> Rows:
        """``rows`` with room for the slopes at the inner stages and, once, for how far
        the positions would go."""
        inner = len(self.tableau.nodes) - 2
        return replace(rows, private=(inner + 1) * rows.slopes)

    def scheme(self, rows: Rows) -> Scheme:
        """The numbers of a step, in a buffer with these rows."""
        pair, stages = self.tableau, len(self.tableau.matrix)
        none = np.zeros((stages, stages))
        slopes = (
            rows.start_acceleration,
            *(rows.stepper + n * rows.slopes for n in range(stages - 1)),
        )
        return Scheme(
            np.array(pair.nodes[1:]),
            square(pair.matrix, stages),
            square(pair.positions, stages),
            none,
            none,
            slopes,
            (),
        )

    def make(self, lanes: int, rows: Rows) -> Any:
        """The compiled stepper for a number of lanes and a row layout with this pair's
        rows."""
        return _make(self.tableau, lanes, rows.of_stepper)


@lru_cache
def _make(pair: Tableau, lanes: int, rows: Rows) -> Any:
    step = define("step", _text(pair, lanes, rows), fma=fma, decide=decide)
    return compiled(types.int64(BUFFER, RIGHT_HAND_SIDE, OBSERVER, BUFFER), lanes, *astuple(rows))(
        step
    )


def _text(pair: Tableau, lanes: int, rows: Rows) -> str:
    """The text of ``step(b, right_hand_side, observer, store)``."""
    stages, W = len(pair.nodes), lanes
    places = {
        **places_of(rows, lanes, pair.order),
        **{f"a{k}_": W * (rows.stepper + (k - 2) * rows.slopes) for k in range(2, stages)},
        "lead_": W * (rows.stepper + (stages - 2) * rows.slopes),
    }
    lines = [
        '"""One step in all lanes; made from the tableau of a Runge-Kutta pair."""',
        "",
        constants(**places),
        "def step(b, right_hand_side, observer, store):",
        *indented(_first_stage(pair, rows)),
        *(line for k in range(3, stages + 1) for line in indented(_stage(pair, rows, k))),
        *indented(_judgement(pair, rows)),
        "    observer(b, store)",
        "    return wanted",
    ]
    return "\n".join(lines) + "\n"


def _first_stage(pair: Tableau, rows: Rows) -> Iterable[str]:
    """The second stage."""
    c, weight = pair.nodes[1], pair.matrix[0][0]
    return first_stages(
        rows,
        c,
        "min(b[proposed_ + i], b[mark_time_ + i] - t)",
        lambda pushed: f"fma({c!r}, lead, x_now)",
        lambda pushed: f"{weight!r} * a1",
    )


def _stage(pair: Tableau, rows: Rows, stage: int) -> Iterable[str]:
    """Stage ``stage``, counted from 1, in one pass over the states: the slope just
    computed is kept, and the next values are formed. Where the last two stages stand at
    one time, it is set once."""
    c, weights, bends = pair.nodes[stage - 1], pair.matrix[stage - 2], pair.positions[stage - 2]
    newest = f"a{stage - 1}"
    head = [
        "for i in range(W):",
        "    h = b[step_ + i]",
        f"    hh, newest = h * h, h * {weights[-1]!r}",
    ]
    yield from head
    if c != pair.nodes[stage - 2]:
        yield f"    {stage_time(c)}"
    for loop, order, alone, _ in loops_over(rows):
        if alone:
            yield from head
        yield f"    {loop}"
        yield from (f"        {line}" for line in loads(stage - 1))
        yield f"        b[{newest}_ + j] = {newest}"
        if order == 2:
            yield f"        b[stage_ + x] = fma(hh, {sum_of_slopes(bends)}, {led(c)})"
        last = "xv"[order - 1]
        rate = sum_of_slopes(weights[:-1])
        yield (
            f"        b[stage_ + {last}] = fma(newest, {newest}, fma(h, {rate}, b[start_ + "
            f"{last}]))"
        )
    yield "right_hand_side(b)"


def _judgement(pair: Tableau, rows: Rows) -> Iterable[str]:
    """The error of each state, and what follows from it."""
    stages = len(pair.nodes)

    def errors(order: int, pushed: bool) -> Iterable[str]:
        yield from loads(stages - 1, newest=False)
        yield f"a{stages} = b[slope_ + j]"
        if order == 2:
            yield f"error_x = h * {sum_of_slopes(pair.position_error)}"
        yield f"error_{'xv'[order - 1]} = {sum_of_slopes(pair.error)}"

    return judgement(rows, errors)
