"""One step of an additive Runge-Kutta pair in every lane at once: friction is
implicit, all else explicit.

The acceleration of a velocity is the sum of a part without friction and a *push*, the
part of the friction at contacts. Only friction that is steep in the slip speed makes an
explicit method slow. A stage of the implicit part is

    V = V* + h g push(X, V)

with V* and the positions X known from the stages before (positions are explicit), so
the right-hand side solves for the slip speeds alone, one or two of them
(:class:`nsdrill.abi.Rows`, ``relax`` = h g). Three points make it work:

- The loads that the right-hand side returns agree with the velocities to rounding, so
  steepness amplifies no error.
- The end of the step is solved once more, y = y0 + h sum b_j f_j + h g (push(y) -
  push_last): the end of an additive pair does not satisfy the balance of friction, and
  the next step would begin with noise. The difference of the two pushes belongs to the
  error.
- Positions take pushes through the implicit matrix: h^2 A_E A_I. With A_E A_E in its
  place the order is the same and the error in rolling a hundred times larger.

Source of the method: Kennedy & Carpenter 2003, Additive Runge-Kutta schemes for
convection-diffusion-reaction equations, Appl. Numer. Math. 44:139-181. A slope row has
the whole slope and a push row its push, so that a sum over stages has the explicit
weights of slopes and the difference of the two matrices as weights of pushes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import STEPPER, Rows
from nsdrill.compiler.functions import compiled
from nsdrill.compiler.words import fma
from nsdrill.generate import constants, define
from nsdrill.kernel.controller import decide
from nsdrill.kernel.kennedy_carpenter import Additive
from nsdrill.kernel.scheme import Scheme, TableauStepper, square
from nsdrill.kernel.text import (
    drifted_position,
    error_control,
    indented,
    loops_over,
    second_stage,
    slope_loads,
    stage_time,
    step_constants,
    weighted,
)

STEP_FRACTION = 0.5  # of the least step at which a stage may have several solutions
TINY = 1e-300  # in place of a zero divisor


@dataclass(frozen=True)
class AdditivePair(TableauStepper):
    """A stepper (:class:`nsdrill.kernel.steppers.Stepper`) from the numbers of an
    additive pair, for right-hand sides with implicit friction."""

    tableau: Additive

    def rows(self, rows: Rows) -> Rows:
        """``rows`` with the stepper's rows: slopes and pushes at all stages but the
        first, and the positions' change over the step at constant velocity."""
        inner = len(self.tableau.nodes) - 1
        return replace(rows, private=inner * (rows.slopes + len(rows.pushed)) + rows.slopes)

    def scheme(self, rows: Rows) -> Scheme:
        """The numbers of a step, in a buffer with these rows."""
        pair, stages, width = self.tableau, len(self.tableau.nodes), rows.slopes + len(rows.pushed)
        end = (*(0.0,) * (stages - 1), -pair.diagonal)
        slopes = (rows.start_acceleration, *(rows.stepper + n * width for n in range(stages - 1)))
        return Scheme(
            np.array([*pair.nodes[1:], 1.0]),
            square((*pair.explicit, pair.weights), stages),
            square(pair.positions, stages),
            square((*pair.pushes, end), stages),
            square(pair.position_pushes, stages),
            slopes,
            tuple(row + rows.slopes for row in slopes),
            pair.diagonal,
        )

    def make(self, lanes: int, rows: Rows) -> Any:
        """The compiled stepper for a number of lanes and a row layout with this pair's
        rows."""
        return _make(self.tableau, lanes, rows)


@lru_cache
def _make(pair: Additive, lanes: int, rows: Rows) -> Any:
    step = define("step", _text(pair, lanes, rows), fma=fma, decide=decide)
    return compiled(STEPPER)(step)


def _text(pair: Additive, lanes: int, rows: Rows) -> str:
    """The text of ``step(b, right_hand_side, observer, store)``."""
    stages, W, width = len(pair.nodes), lanes, rows.slopes + len(rows.pushed)
    values = {
        **step_constants(rows, lanes, pair.order),
        **{f"a{k}_": W * (rows.stepper + (k - 2) * width) for k in range(2, stages + 1)},
        **{f"p{k}_": W * (rows.stepper + (k - 2) * width + rows.slopes) for k in range(2, stages + 1)},
        "drift_": W * (rows.stepper + (stages - 1) * width),
        "p1_": W * rows.start_push,
        "push_": W * rows.push,
        "relax_": W * rows.relax,
        "falling_": W * rows.falling,
        "diagonal": pair.diagonal,
    }
    lines = [
        '"""One step in all lanes; made from the numbers of an additive Runge-Kutta pair."""',
        "",
        constants(**values),
        "def step(b, right_hand_side, observer, store):",
        *indented(_second_stage(pair, rows)),
        *(line for k in range(3, stages + 2) for line in indented(_stage(pair, rows, k))),
        *indented(_error_control(pair, rows)),
        "    call(observer, b, store)",
        "    return any_attention",
    ]
    return "\n".join(lines) + "\n"


def _second_stage(pair: Additive, rows: Rows) -> Iterable[str]:
    """The lines of the second stage. The step is short enough for every stage to have
    one solution."""
    c, weight, push_weight = pair.nodes[1], pair.explicit[0][0], pair.pushes[0][0]
    position_weight = _padded(pair.positions[0], 1)[0]
    position_push_weight = pair.position_pushes[0][0]
    longest = f"{STEP_FRACTION / pair.diagonal!r} / max(b[falling_ + i], {TINY!r})"

    def position(pushed: bool) -> str:
        push = [(position_push_weight, "p1")] if pushed else []
        return _second_position(c, weighted([(position_weight, "a1"), *push]))

    def rate(pushed: bool) -> str:
        return weighted([(weight, "a1"), *([(push_weight, "p1")] if pushed else [])])

    step = f"min(min(b[proposed_ + i], {longest}), b[mark_time_ + i] - t)"
    return second_stage(rows, c, step, position, rate, ["b[relax_ + i] = diagonal * h"])


def _second_position(c: float, change: str) -> str:
    """A position at the second stage; ``change`` times the step squared is what the
    slopes contribute."""
    drifted = f"fma({c!r}, drift, x_now)"
    return drifted if change == "0.0" else f"fma(h * h, {change}, {drifted})"


def _stage(pair: Additive, rows: Rows, stage: int) -> Iterable[str]:
    """The lines of stage ``stage``, counted from 1, in one pass over the states. The
    one after the last is the end of the step."""
    stages = len(pair.nodes)
    end = stage > stages
    c = 1.0 if end else pair.nodes[stage - 1]
    position_weights, position_push_weights = (pair.positions[stage - 2], pair.position_pushes[stage - 2])
    if end:
        weights: Sequence[float] = pair.weights
        push_weights: Sequence[float] = (*(0.0,) * (stages - 1), -pair.diagonal)
    else:
        weights, push_weights = pair.explicit[stage - 2], pair.pushes[stage - 2]
    newest = stage - 1
    head = ["for i in packed(W):", "    h = b[step_ + i]", "    hh = h * h"]
    yield from head
    if c != (pair.nodes[newest - 1]):
        yield f"    {stage_time(c)}"
    for loop, order, pushed in loops_over(rows):
        yield f"    {loop}"
        yield from (f"        {line}" for line in slope_loads(newest, pushed))
        yield f"        b[a{newest}_ + j] = a{newest}"
        if pushed:
            yield f"        b[p{newest}_ + q] = p{newest}"
        if order == 2:
            change = weighted(_terms(position_weights, position_push_weights if pushed else ()))
            yield f"        b[stage_ + x] = fma(hh, {change}, {drifted_position(c)})"
        last = "xv"[order - 1]
        rate = weighted(_terms(weights, push_weights if pushed else ()))
        yield f"        b[stage_ + {last}] = fma(h, {rate}, b[start_ + {last}])"
    yield "call(right_hand_side, b)"


def _error_control(pair: Additive, rows: Rows) -> Iterable[str]:
    """The lines that estimate the error of each state and decide on the step."""
    stages = len(pair.nodes)
    position_weights, position_push_weights = pair.position_error

    def errors(order: int, pushed: bool) -> Iterable[str]:
        yield from slope_loads(stages, pushed, newest=False)
        error = weighted(_terms(pair.error, ()))
        if pushed:
            error = f"fma(diagonal, b[push_ + q] - p{stages}, {error})"
        if order == 2:
            yield f"error_x = h * {weighted(_terms(position_weights, position_push_weights if pushed else ()))}"
        yield f"error_{'xv'[order - 1]} = {error}"

    return error_control(rows, errors)


def _terms(slopes: Sequence[float], pushes: Sequence[float]) -> list[tuple[float, str]]:
    """(weight, name) of the slopes a1, a2, ... and of the pushes p1, p2, ..."""
    return [
        *((weight, f"a{k}") for k, weight in enumerate(slopes, start=1)),
        *((weight, f"p{k}") for k, weight in enumerate(pushes, start=1)),
    ]


def _padded(weights: Sequence[float], length: int) -> tuple[float, ...]:
    return (*weights, *(0.0,) * (length - len(weights)))
