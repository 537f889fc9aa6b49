"""One step of an additive Runge-Kutta pair in every lane at once: friction implicit,
all else explicit.

The acceleration of a velocity is a part without friction and a *push*, what the
friction of contacts adds; friction that is steep in the slip speed makes an explicit
method slow, and only it. A stage of the implicit part is

    V = V* + h g push(X, V)

with V* and the positions X known from the stages before (positions are explicit), so
the right-hand side solves for the slip speeds alone, one or two of them
(:class:`nsdrill.abi.Rows`, ``relax`` = h g). Three points make it work:

- The loads that come back agree with the velocities to rounding, so steepness amplifies
  nothing.
- The end of the step is solved once more, y = y0 + h sum b_j f_j + h g (push(y) -
  push_last): the end of an additive pair does not lie where friction balances, and the
  next step would begin with noise. The difference of the two pushes belongs to the
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
from dataclasses import astuple, dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, OBSERVER, RIGHT_HAND_SIDE, Rows, compiled
from nsdrill.elementary import fma
from nsdrill.generate import constants, define
from nsdrill.kernel.controller import decide
from nsdrill.kernel.kennedy_carpenter import Additive
from nsdrill.kernel.scheme import OfTableau, Scheme, square
from nsdrill.kernel.text import (
    first_stages,
    indented,
    judgement,
    led,
    loads,
    loops_over,
    places_of,
    stage_time,
    weighted,
)

ROOM = 0.5  # of the step from which on a stage may have several solutions
LEAST = 1e-300  # in place of a zero that is divided by


@dataclass(frozen=True)
class AdditivePair(OfTableau):
    """A stepper (:class:`nsdrill.kernel.steppers.Stepper`) from the numbers of an
    additive pair, for right-hand sides with friction apart."""

    tableau: Additive

    def rows(self, rows: Rows) -> Rows:
        """``rows`` with room for slopes and pushes at the stages but the first, and for
        how far positions would go."""
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
        return _make(self.tableau, lanes, rows.of_stepper)


@lru_cache
def _make(pair: Additive, lanes: int, rows: Rows) -> Any:
    step = define("step", _text(pair, lanes, rows), fma=fma, decide=decide)
    return compiled(types.int64(BUFFER, RIGHT_HAND_SIDE, OBSERVER, BUFFER), lanes, *astuple(rows))(
        step
    )


def _text(pair: Additive, lanes: int, rows: Rows) -> str:
    """The text of ``step(b, right_hand_side, observer, store)``."""
    stages, W, width = len(pair.nodes), lanes, rows.slopes + len(rows.pushed)
    places = {
        **places_of(rows, lanes, pair.order),
        **{f"a{k}_": W * (rows.stepper + (k - 2) * width) for k in range(2, stages + 1)},
        **{
            f"p{k}_": W * (rows.stepper + (k - 2) * width + rows.slopes)
            for k in range(2, stages + 1)
        },
        "lead_": W * (rows.stepper + (stages - 1) * width),
        "p1_": W * rows.start_push,
        "push_": W * rows.push,
        "relax_": W * rows.relax,
        "falling_": W * rows.falling,
        "diagonal": pair.diagonal,
    }
    lines = [
        '"""One step in all lanes; made from the numbers of an additive Runge-Kutta pair."""',
        "",
        constants(**places),
        "def step(b, right_hand_side, observer, store):",
        *indented(_first_stage(pair, rows)),
        *(line for k in range(3, stages + 2) for line in indented(_stage(pair, rows, k))),
        *indented(_judgement(pair, rows)),
        "    observer(b, store)",
        "    return wanted",
    ]
    return "\n".join(lines) + "\n"


def _first_stage(pair: Additive, rows: Rows) -> Iterable[str]:
    """The second stage, of a step within which every stage has one solution."""
    c, weight, push = pair.nodes[1], pair.explicit[0][0], pair.pushes[0][0]
    bend, bend_push = _padded(pair.positions[0], 1)[0], pair.position_pushes[0][0]
    longest = f"{ROOM / pair.diagonal!r} / max(b[falling_ + i], {LEAST!r})"

    def ahead(pushed: bool) -> str:
        return _ahead(c, weighted([(bend, "a1"), *([(bend_push, "p1")] if pushed else [])]))

    def rate(pushed: bool) -> str:
        return weighted([(weight, "a1"), *([(push, "p1")] if pushed else [])])

    step = f"min(min(b[proposed_ + i], {longest}), b[mark_time_ + i] - t)"
    return first_stages(rows, c, step, ahead, rate, ["b[relax_ + i] = diagonal * h"])


def _ahead(c: float, bends: str) -> str:
    """The position of the second stage."""
    ahead = f"fma({c!r}, lead, x_now)"
    return ahead if bends == "0.0" else f"fma(h * h, {bends}, {ahead})"


def _stage(pair: Additive, rows: Rows, stage: int) -> Iterable[str]:
    """Stage ``stage``, counted from 1, in one pass over the states; the one after the
    last is the end of the step."""
    stages = len(pair.nodes)
    end = stage > stages
    c = 1.0 if end else pair.nodes[stage - 1]
    bends, bend_pushes = pair.positions[stage - 2], pair.position_pushes[stage - 2]
    if end:
        weights: Sequence[float] = pair.weights
        pushes: Sequence[float] = (*(0.0,) * (stages - 1), -pair.diagonal)
    else:
        weights, pushes = pair.explicit[stage - 2], pair.pushes[stage - 2]
    newest = stage - 1
    head = ["for i in range(W):", "    h = b[step_ + i]", "    hh = h * h"]
    yield from head
    if c != (pair.nodes[newest - 1]):
        yield f"    {stage_time(c)}"
    for loop, order, alone, pushed in loops_over(rows):
        if alone:
            yield from head
        yield f"    {loop}"
        yield from (f"        {line}" for line in loads(newest, pushed))
        yield f"        b[a{newest}_ + j] = a{newest}"
        if pushed:
            yield f"        b[p{newest}_ + q] = p{newest}"
        if order == 2:
            bent = weighted(_terms(bends, bend_pushes if pushed else ()))
            yield f"        b[stage_ + x] = fma(hh, {bent}, {led(c)})"
        last = "xv"[order - 1]
        rate = weighted(_terms(weights, pushes if pushed else ()))
        yield f"        b[stage_ + {last}] = fma(h, {rate}, b[start_ + {last}])"
    yield "right_hand_side(b)"


def _judgement(pair: Additive, rows: Rows) -> Iterable[str]:
    """The error of each state, and what follows from it."""
    stages = len(pair.nodes)
    bends, bend_pushes = pair.position_error

    def errors(order: int, pushed: bool) -> Iterable[str]:
        yield from loads(stages, pushed, newest=False)
        error = weighted(_terms(pair.error, ()))
        if pushed:
            error = f"fma(diagonal, b[push_ + q] - p{stages}, {error})"
        if order == 2:
            yield f"error_x = h * {weighted(_terms(bends, bend_pushes if pushed else ()))}"
        yield f"error_{'xv'[order - 1]} = {error}"

    return judgement(rows, errors)


def _terms(slopes: Sequence[float], pushes: Sequence[float]) -> list[tuple[float, str]]:
    return [
        *((weight, f"a{k}") for k, weight in enumerate(slopes, start=1)),
        *((weight, f"p{k}") for k, weight in enumerate(pushes, start=1)),
    ]


def _padded(weights: Sequence[float], length: int) -> tuple[float, ...]:
    return (*weights, *(0.0,) * (length - len(weights)))
