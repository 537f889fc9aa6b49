"""Pieces of the text of a step, which the steppers share: loops over blocks of states,
weighted sums, the decision on the step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from nsdrill.abi import CONTROL, MARK, Rows
from nsdrill.kernel.controller import INTEGRAL


def step_constants(rows: Rows, lanes: int, order: int) -> dict[str, float]:
    """The constants in the text of every step, by name: offsets of rows in the buffer
    (names that end in ``_``), and the numbers of the controller for a method of this
    order."""
    return {
        "W": lanes,
        "stage_": lanes * rows.stage,
        "slope_": lanes * rows.acceleration,
        "stage_time_": lanes * rows.stage_time,
        "start_": lanes * rows.start,
        "a1_": lanes * rows.start_acceleration,
        "frame_rate_": lanes * rows.frame_rate,
        "scale_": lanes * rows.scale,
        "time_": lanes * rows.time,
        "step_": lanes * rows.step,
        "moves_": lanes * rows.moves,
        **{f"{name}_": lanes * (rows.control + i) for i, name in enumerate(CONTROL)},
        "MARK": MARK,
        "PROPORTIONAL": 1.0 / order - 0.75 * INTEGRAL,
        "PER_ORDER": 1.0 / order,
    }


def loops_over(rows: Rows, *, tangent_states: bool = True) -> list[tuple[str, int, bool]]:
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


def slope_loads(upto: int, pushed: bool = False, newest: bool = True) -> Iterable[str]:
    """Loads of the slopes of the stages up to ``upto`` and, if ``pushed``, of their
    pushes. With ``newest`` those of the last stage come from the rows that the
    right-hand side writes."""
    for k in range(1, upto + 1):
        last = newest and k == upto
        yield f"a{k} = b[{'slope_' if last else f'a{k}_'} + j]"
        if pushed:
            yield f"p{k} = b[{'push_' if last else f'p{k}_'} + q]"


def second_stage(
    rows: Rows,
    c: float,
    step: str,
    position: Callable[[bool], str],
    rate: Callable[[bool], str],
    more: Sequence[str] = (),
) -> Iterable[str]:
    """The lines that commit the last step in the lanes with ``moves`` and begin the
    next one: its second stage, at the fraction ``c`` of the step.

    ``step`` is the expression of the step size h, and ``more`` are the lines after it.
    ``position`` and ``rate`` give the expressions of a stage position and of the slope
    of the other states, for slopes with a push (True) or without. (Both values are
    loaded and one is selected: a masked store could not be forwarded to the loads that
    follow.)
    """
    yield "for i in packed(W):"
    yield "    moves = b[moves_ + i] != 0.0"
    yield "    before, after = b[time_ + i], b[time_ + i] + b[step_ + i]"
    yield "    t = after if moves else before"
    yield f"    h = {step}"
    yield "    b[time_ + i] = t"
    yield "    b[step_ + i] = h"
    yield from (f"    {line}" for line in more)
    yield f"    b[stage_time_ + i] = fma({c!r}, h, t)"
    for loop, order, pushed in loops_over(rows):
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
            yield "        b[drift_ + j] = drift"
            yield f"        b[stage_ + x] = {position(pushed)}"
        last = "xv"[order - 1]
        yield f"        b[stage_ + {last}] = fma(h, {rate(pushed)}, {last}_now)"
    yield "call(right_hand_side, b)"


def stage_time(c: float) -> str:
    """The line that sets the time of a stage at the fraction ``c`` of the step."""
    return f"b[stage_time_ + i] = {'b[time_ + i] + h' if c == 1.0 else f'fma({c!r}, h, b[time_ + i])'}"


def drifted_position(c: float) -> str:
    """A position at the fraction ``c`` of the step if its velocity were constant."""
    return "b[drift_ + j] + b[start_ + x]" if c == 1.0 else f"fma({c!r}, b[drift_ + j], b[start_ + x])"


def error_control(rows: Rows, errors: Callable[[int, bool], Iterable[str]]) -> Iterable[str]:
    """The sum of squares of the error of each state over its tolerance rtol (scale +
    |y|), and the controller's decision.

    ``errors(order, pushed)`` gives the lines that assign error_x and error_v of states
    of this order, with a push or without. The two quotients of a pair share one
    division. Tangent states count only if ``rows.judged``.
    """
    yield "any_attention = 0"
    yield "for i in packed(W):"
    yield "    h, proposal = b[step_ + i], b[proposed_ + i]"
    yield "    total = 0.0"
    for loop, order, pushed in loops_over(rows, tangent_states=rows.judged):
        yield f"    {loop}"
        yield from (f"        {line}" for line in errors(order, pushed))
        for state in "xv"[:order]:
            largest = f"max(abs(b[start_ + {state}]), abs(b[stage_ + {state}]))"
            yield f"        scale_{state} = b[scale_ + {state}] + {largest}"
        if order == 2:
            yield ("        cross_x, cross_v, both = error_x * scale_v, error_v * scale_x, scale_x * scale_v")
            yield "        total += fma(cross_x, cross_x, cross_v * cross_v) / (both * both)"
        else:
            yield "        quotient = error_x / scale_x"
            yield "        total = fma(quotient, quotient, total)"
    yield _step_decision(rows.states if rows.judged else rows.own)


def _step_decision(states: int) -> str:
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


def weighted(terms: Iterable[tuple[float, str]]) -> str:
    """The sum of weights times names as nested multiply-adds; weights of zero are left
    out."""
    nonzero = [(weight, name) for weight, name in terms if weight != 0.0]
    if not nonzero:
        return "0.0"
    (weight, name), rest = nonzero[-1], nonzero[:-1]
    text = f"{weight!r} * {name}"
    for weight, name in reversed(rest):
        text = f"fma({weight!r}, {name}, {text})"
    return text


def sum_of_slopes(weights: Sequence[float]) -> str:
    """The weighted sum of the slopes a1, a2, ..."""
    return weighted((weight, f"a{k}") for k, weight in enumerate(weights, start=1))


def indented(lines: Iterable[str]) -> list[str]:
    return [f"    {part}" for line in lines for part in line.split("\n")]
