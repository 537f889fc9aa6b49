"""The steppers by their names in a study, and the text of one step of a Runge-Kutta pair
in every lane at once, each lane with its own time and step size.

Positions and velocities alternate among the states, so the stages of the positions
follow from those of the velocities: only slopes of velocities are computed and stored
(see :attr:`nsdrill.kernel.pairs.Pair.positions`). The result is that of the pair, with half
the memory traffic, which limits the speed of a packed step. To states of first order
the pair is applied as it is.

A step runs from (``time``, ``start``, ``start_acceleration``) to (``time`` + ``step``,
``stage``, ``acceleration``). The controller accepts or rejects it, and then the
observer is called. An accepted step (``moves``) is committed at the beginning of the
next step, or before by the loop.

The weights are compile-time constants and every sum is written out, as the compiler
packs no loop over weights. In the text a1, a2, ... are the slopes at the stages and p1,
p2, ... their pushes, which only an additive pair has.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from types import FunctionType

from nsdrill.abi import CONTROL, LIMIT, MARK, NONFINITE, NOTHING, STEPPER, UNDERFLOW, Rows
from nsdrill.compiler.functions import LaneFunction, Source, constants, fma, generated, inlined
from nsdrill.elementary import exp2, log2
from nsdrill.kernel.pairs import DORMAND_PRINCE, KENNEDY_CARPENTER, TSITOURAS, Pair

# Proportional-integral step-size control (Gustafsson 1991; Hairer, Norsett & Wanner,
# Solving ODEs II, IV.2).
#
# The next step is h * 0.9 * err^-a * err_before^b, after a rejection h * 0.9 *
# err^-(1/order). All is done in binary logarithms of the squared error, where it
# vectorises. A step that gives NaN or infinity is rejected and shrunk like one of very
# large error; if that continues down to the least step, the run has diverged.

INTEGRAL = 0.04  # b above; a = 1/order - 3/4 b (Hairer's choice for pairs of order 5)
# log2 of 0.9, written out: math.log2 may give another last bit elsewhere
SAFETY = -0.15200309344504995
GROWTH = 3.0  # at most 2^3 times the step
SHRINK = -3.0  # at least 2^-3 times the step
SMALLEST, LARGEST = 1e-16, 1e16  # bounds of the squared error for the logarithm


@inlined
def decide(  # type: ignore[no-untyped-def]
    squared_error: float,
    step: float,
    last_level: float,
    growth: float,
    least_step: float,
    exhausted: bool,
    proportional: float,
    per_order: float,
):
    """The decision on a step of length ``step`` from its squared error (1 is the
    tolerance): (accepted, next step, level, growth, attention).

    ``last_level`` and ``level`` are log2 of the last accepted squared error; ``growth``
    is log2 of the largest factor by which the step may grow, 0 just after a rejection.
    A proposal below ``least_step`` after a rejection, and ``exhausted``, the last
    allowed try, ask for attention. ``proportional`` is a above, ``per_order`` one over
    the order of the method. All are floats, so that lanes stay packed.
    """
    accepted = squared_error <= 1.0  # False for NaN
    finite = squared_error < LARGEST
    bounded = max(squared_error if finite else LARGEST, SMALLEST)
    level = log2(bounded)
    if_accepted = fma(-0.5 * proportional, level, fma(0.5 * INTEGRAL, last_level, SAFETY))
    if_rejected = fma(-0.5 * per_order, level, SAFETY)
    log2_factor = max(if_accepted if accepted else if_rejected, SHRINK)
    log2_factor = min(log2_factor, growth if accepted else -0.1)
    proposed = step * exp2(log2_factor)
    too_small = (not accepted) and proposed < least_step
    attention = (UNDERFLOW if finite else NONFINITE) if too_small else (LIMIT if exhausted else NOTHING)
    return (accepted, proposed, level if accepted else last_level, GROWTH if accepted else 0.0, attention)


STEP_FRACTION = 0.5  # of the least step at which an implicit stage may have several solutions
TINY = 1e-300  # in place of a zero divisor


def private_rows(pair: Pair, rows: Rows) -> int:
    """How many rows of its own a step needs: slopes and pushes at the inner stages, and
    the positions' change over the step at constant velocity."""
    return (len(pair.times) - 1) * (rows.slopes + len(rows.pushed)) + rows.slopes


def slope_rows(pair: Pair, rows: Rows) -> tuple[int, ...]:
    """The first of the rows with the slopes at each stage, the start included; those of
    the pushes follow each."""
    width = rows.slopes + len(rows.pushed)
    return (rows.start_acceleration, *(rows.stepper + n * width for n in range(len(pair.times) - 1)))


def step_text(pair: Pair, lanes: int, rows: Rows) -> str:
    """The text of ``step(b, right_hand_side, observer, store)``."""
    lines = [line for stage in _stages(pair, rows) for line in (*stage, EVALUATION)]
    lines += [*_error_control(pair, rows), "call(observer, b, store)", "return any_attention"]
    return _function("b, right_hand_side, observer, store", pair, lanes, rows, lines)


def turn_text(pair: Pair, rows: Rows) -> str:
    """The text of ``step(b, right_hand_side, observer, store, first, begins)`` for one
    lane: a step whose stages are turns of a loop, so that the right-hand side is there
    once. It makes the stages after the ``first``, which is 0; with one less than there
    are stages, only the slopes are computed, and where a run ``begins`` the step is one
    of length zero; with all of them, only the observer is called."""
    stages = _stages(pair, rows)
    lines = ["stage = first", f"while stage < {len(stages)}:"]
    for number, stage in enumerate(stages):
        lines += [f"    if stage == {number} and first == 0:", *indented(stage, 2)]
    lines += [f"    {EVALUATION}", "    stage += 1", "any_attention = 0", "if begins:"]
    lines += ["    b[step_], b[moves_] = 0.0, 1.0", "if first == 0:", *indented(_error_control(pair, rows))]
    lines += ["call(observer, b, store)", "return any_attention"]
    return _function("b, right_hand_side, observer, store, first, begins", pair, 1, rows, lines)


EVALUATION = "call(right_hand_side, b)"


def indented(lines: Iterable[str], by: int = 1) -> Iterable[str]:
    return (f"{by * 4 * ' '}{part}" for line in lines for part in line.split("\n"))


def _function(given: str, pair: Pair, lanes: int, rows: Rows, lines: Iterable[str]) -> str:
    return "\n".join(
        [
            '"""One step in all lanes; made from the numbers of a Runge-Kutta pair."""',
            "",
            constants(**_constants(pair, lanes, rows)),
            f"def step({given}):",
            *indented(lines),
            "",
        ]
    )


def _stages(pair: Pair, rows: Rows) -> list[Iterable[str]]:
    """The lines before each evaluation of the right-hand side."""
    return [_second_stage(pair, rows), *(_stage(pair, rows, row) for row in range(1, len(pair.times)))]


def _constants(pair: Pair, lanes: int, rows: Rows) -> dict[str, float]:
    """The constants in the text by name: offsets of rows in the buffer (names that end
    in ``_``), and the numbers of the controller."""
    slopes = slope_rows(pair, rows)
    places = {
        "stage": rows.stage,
        "slope": rows.acceleration,
        "push": rows.push,
        "stage_time": rows.stage_time,
        "relax": rows.relax,
        "falling": rows.falling,
        "start": rows.start,
        "frame_rate": rows.frame_rate,
        "scale": rows.scale,
        "time": rows.time,
        "step": rows.step,
        "moves": rows.moves,
        "drift": rows.stepper + private_rows(pair, rows) - rows.slopes,
        **{name: rows.control + i for i, name in enumerate(CONTROL)},
        **{f"a{k}": row for k, row in enumerate(slopes, start=1)},
        **{f"p{k}": row + rows.slopes for k, row in enumerate(slopes, start=1)},
    }
    return {
        "W": lanes,
        **{f"{name}_": lanes * row for name, row in places.items()},
        "MARK": MARK,
        "PROPORTIONAL": 1.0 / pair.order - 0.75 * INTEGRAL,
        "PER_ORDER": 1.0 / pair.order,
        "diagonal": pair.diagonal,
    }


def _loops(rows: Rows, *, tangent_states: bool = True) -> list[tuple[str, int, bool]]:
    """The loops over blocks of states: (head of the loop, order of the states, whether
    its slopes have a push).

    A head assigns x, the index of a position or of a state of first order, v that of
    its velocity, j that of its slope and q that of its push. Adjacent blocks of pairs
    are joined.
    """
    joined: list[list[int]] = []
    pushed = rows.pushed
    for order, count, state, slope in rows.blocks:
        for k in range(count if tangent_states or state < rows.own else 0):
            push = pushed.index(slope + k) if slope + k in pushed else -1
            single = [order, 1, state + order * k, slope + k, push]
            if joined and order == joined[-1][0] and _continues(joined[-1], single):
                joined[-1][1] += 1
            else:
                joined.append(single)
    heads = []
    for order, count, state, slope, push in joined:
        indices = [f"({order} * p + {state + k}) * W + i" for k in range(order)] + [f"(p + {slope}) * W + i"]
        names = "x, v, j" if order == 2 else "x, j"
        if push >= 0:
            names, indices = f"{names}, q", [*indices, f"(p + {push}) * W + i"]
        head = f"for p in range({count}):\n        {names} = {', '.join(indices)}"
        heads.append((head, order, push >= 0))
    return heads


def _continues(block: list[int], single: list[int]) -> bool:
    """Whether the block ``single`` of one state is adjacent to the end of ``block``,
    and has a push if and only if the block has."""
    order, count, state, slope, push = block
    _, _, next_state, next_slope, next_push = single
    same_push = next_push == push + count if push >= 0 else next_push < 0
    return next_state == state + order * count and next_slope == slope + count and same_push


def _loads(upto: int, pushed: bool, *, newest: bool) -> Iterable[str]:
    """Loads of the slopes of the stages up to ``upto`` and, if ``pushed``, of their
    pushes. With ``newest`` those of the last stage come from the rows that the
    right-hand side writes."""
    for k in range(1, upto + 1):
        last = newest and k == upto
        yield f"a{k} = b[{'slope_' if last else f'a{k}_'} + j]"
        if pushed:
            yield f"p{k} = b[{'push_' if last else f'p{k}_'} + q]"


def _second_stage(pair: Pair, rows: Rows) -> Iterable[str]:
    """The lines that commit the last step in the lanes with ``moves`` and begin the
    next one: its second stage. A step with implicit stages is short enough for each of
    them to have one solution. (Both values are loaded and one is selected: a masked
    store could not be forwarded to the loads that follow.)"""
    c, proposed = pair.times[0], "b[proposed_ + i]"
    if pair.diagonal:
        proposed = f"min({proposed}, {STEP_FRACTION / pair.diagonal!r} / max(b[falling_ + i], {TINY!r}))"
    yield "for i in packed(W):"
    yield "    moves = b[moves_ + i] != 0.0"
    yield "    before, after = b[time_ + i], b[time_ + i] + b[step_ + i]"
    yield "    t = after if moves else before"
    yield f"    h = min({proposed}, b[mark_time_ + i] - t)"
    yield "    b[time_ + i] = t"
    yield "    b[step_ + i] = h"
    if pair.diagonal:
        yield "    b[relax_ + i] = diagonal * h"
    yield f"    b[stage_time_ + i] = fma({c!r}, h, t)"
    for loop, order, pushed in _loops(rows):
        yield f"    {loop}"
        for state in "xv"[:order]:
            yield f"        {state}_before, {state}_after = b[start_ + {state}], b[stage_ + {state}]"
        yield "        a_before, a_after = b[a1_ + j], b[slope_ + j]"
        for state in "xv"[:order]:
            yield f"        {state}_now = {state}_after if moves else {state}_before"
        yield "        a1 = a_after if moves else a_before"
        if pushed:
            yield "        p_before, p_after = b[p1_ + q], b[push_ + q]"
            yield "        p1 = p_after if moves else p_before"
            yield "        b[p1_ + q] = p1"
        if order == 2:
            yield "        drift = h * (v_now + b[frame_rate_ + j])"
        for state in "xv"[:order]:
            yield f"        b[start_ + {state}] = {state}_now"
        yield "        b[a1_ + j] = a1"
        if order == 2:
            drifted = f"fma({c!r}, drift, x_now)"
            change = _sum(pair.positions[0], pair.position_pushes[0], pushed)
            yield "        b[drift_ + j] = drift"
            yield f"        b[stage_ + x] = {drifted if change == '0.0' else f'fma(h * h, {change}, {drifted})'}"
        last, rate = "xv"[order - 1], _sum(pair.matrix[0], pair.pushes[0], pushed)
        yield f"        b[stage_ + {last}] = fma(h, {rate}, {last}_now)"


def _stage(pair: Pair, rows: Rows, row: int) -> Iterable[str]:
    """The lines of the stage with this row of weights, or of the end of the step, in
    one pass over the states: the slope just computed is stored, and the stage values
    are formed. Where two successive stages have the same node, the time is set once. An
    explicit stage adds the newest slope last: the others are known before it is."""
    c, rates, newest = pair.times[row], pair.matrix[row], row + 1
    yield "for i in packed(W):"
    yield "    h = b[step_ + i]"
    yield "    hh = h * h"
    if not pair.diagonal:
        yield f"    newest = h * {rates[-1]!r}"
    if c != pair.times[row - 1]:
        yield f"    b[stage_time_ + i] = {'b[time_ + i] + h' if c == 1.0 else f'fma({c!r}, h, b[time_ + i])'}"
    drifted = "b[drift_ + j] + b[start_ + x]" if c == 1.0 else f"fma({c!r}, b[drift_ + j], b[start_ + x])"
    for loop, order, pushed in _loops(rows):
        yield f"    {loop}"
        yield from (f"        {line}" for line in _loads(newest, pushed, newest=True))
        yield f"        b[a{newest}_ + j] = a{newest}"
        if pushed:
            yield f"        b[p{newest}_ + q] = p{newest}"
        if order == 2:
            change = _sum(pair.positions[row], pair.position_pushes[row], pushed)
            yield f"        b[stage_ + x] = fma(hh, {change}, {drifted})"
        last = "xv"[order - 1]
        if pair.diagonal:
            end = f"fma(h, {_sum(rates, pair.pushes[row], pushed)}, b[start_ + {last}])"
        else:
            end = f"fma(newest, a{newest}, fma(h, {_sum(rates[:-1])}, b[start_ + {last}]))"
        yield f"        b[stage_ + {last}] = {end}"


def _error_control(pair: Pair, rows: Rows) -> Iterable[str]:
    """The sum of squares of the error of each state over its tolerance rtol (scale +
    |y|), and the controller's decision. The two quotients of a pair share one division.
    Tangent states count only if ``rows.judged``."""
    stages = len(pair.times)
    position_weights, position_push_weights = pair.position_error
    yield "any_attention = 0"
    yield "for i in packed(W):"
    yield "    h, proposal = b[step_ + i], b[proposed_ + i]"
    yield "    total = 0.0"
    for loop, order, pushed in _loops(rows, tangent_states=rows.judged):
        yield f"    {loop}"
        yield from (f"        {line}" for line in _loads(stages, pushed, newest=False))
        yield f"        a{stages + 1} = b[slope_ + j]"
        if order == 2:
            yield f"        error_x = h * {_sum(position_weights, position_push_weights, pushed)}"
        error = _sum(pair.error)
        if pushed:
            error = f"fma(diagonal, b[push_ + q] - p{stages}, {error})"
        yield f"        error_{'xv'[order - 1]} = {error}"
        for state in "xv"[:order]:
            largest = f"max(abs(b[start_ + {state}]), abs(b[stage_ + {state}]))"
            yield f"        scale_{state} = b[scale_ + {state}] + {largest}"
        if order == 2:
            yield "        cross_x, cross_v, both = error_x * scale_v, error_v * scale_x, scale_x * scale_v"
            yield "        total += fma(cross_x, cross_x, cross_v * cross_v) / (both * both)"
        else:
            yield "        quotient = error_x / scale_x"
            yield "        total = fma(quotient, quotient, total)"
    yield _decision(rows.states if rows.judged else rows.own)


def _decision(states: int) -> str:
    """The controller's decision from ``total``, the sum of squared errors of so many
    states over their tolerances and the step, and whether the lane needs attention."""
    return f"""\
    ratio = h * b[per_rtol_ + i]
    tries = b[accepted_ + i] + b[rejected_ + i] + 1.0
    accepted, proposed, last, growth, attention = decide(
        total * (1.0 / {states}) * (ratio * ratio), h, b[last_error_ + i], b[growth_ + i], b[least_step_ + i],
        tries >= b[limit_ + i], PROPORTIONAL, PER_ORDER)
    # A step cut short by a mark gives little information on the next one: the earlier
    # proposal is kept.
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
    any_attention |= 0 if attention * running == 0.0 else 1"""


def _sum(slopes: Sequence[float], pushes: Sequence[float] = (), pushed: bool = False) -> str:
    """The weighted sum of the slopes and, if ``pushed``, of the pushes, as nested
    multiply-adds; weights of zero are left out."""
    terms = [(weight, f"a{k}") for k, weight in enumerate(slopes, start=1) if weight]
    if pushed:
        terms += [(weight, f"p{k}") for k, weight in enumerate(pushes, start=1) if weight]
    if not terms:
        return "0.0"
    weight, name = terms.pop()
    text = f"{weight!r} * {name}"
    for weight, name in reversed(terms):
        text = f"fma({weight!r}, {name}, {text})"
    return text


@lru_cache
def with_step(pair: Pair, rows: Rows) -> Rows:
    """The row layout with the rows of a step added."""
    return replace(rows, private=private_rows(pair, rows))


@lru_cache
def make_step(pair: Pair, lanes: int, rows: Rows) -> LaneFunction:
    """The compiled function ``step(buffer, right_hand_side, observer, store)`` for a
    number of lanes and a row layout returned by :func:`with_step`. It

    1. commits the accepted step in the lanes with ``moves`` set;
    2. tries one step in every lane from (``time``, ``start``, ``start_acceleration``);
    3. writes the end of the step to ``stage`` and ``acceleration``, and the
       controller's decision to the rows of ``CONTROL``;
    4. calls the observer;
    5. returns whether some lane needs attention.
    """
    return generated("step", STEPPER, lambda: Source("step", step_text(pair, lanes, rows), NAMES))


@lru_cache
def make_turn(pair: Pair, rows: Rows) -> FunctionType:
    """The same for one lane, as a helper that is written out (:func:`turn_text`)."""
    return Source("step", turn_text(pair, rows), NAMES).function()


NAMES = {"fma": fma, "decide": decide}  # of the text
STEPPERS = {"tsitouras": TSITOURAS, "dormand_prince": DORMAND_PRINCE, "kennedy_carpenter": KENNEDY_CARPENTER}
"""The pairs by their names; the last is for right-hand sides with implicit friction."""
