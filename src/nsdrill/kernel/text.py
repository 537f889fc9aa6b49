"""Pieces of the text of a step, which the steppers share: loops over blocks of states,
weighted sums, the verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from nsdrill.abi import CONTROL, MARK, Rows
from nsdrill.kernel.controller import INTEGRAL

# Pairs of states in one loop over the lanes. The compiler unrolls the loop over them,
# else it packs none; of more pairs it does so no longer, and each part of them has a
# loop over the lanes of its own.
TOGETHER, PART = 8, 4


def places_of(rows: Rows, lanes: int, order: int) -> dict[str, float]:
    """The places in the buffer that every step names, and the numbers of the controller
    for a method of this order."""
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


def loops_over(rows: Rows, *, tangent_states: bool = True) -> list[tuple[str, int, bool, bool]]:
    """The heads of the loops over blocks of states, with the order of their states,
    whether a loop over the lanes begins anew before it, and whether its slopes have a
    push: x is the place of a position, or of a state of first order, v that of its
    velocity, j that of its slope, q that of its push. Blocks of pairs that follow one
    another are one."""
    joined: list[list[int]] = []
    pushed = rows.pushed
    for order, count, state, slope in rows.blocks:
        for k in range(count if tangent_states or state < rows.own else 0):
            push = pushed.index(slope + k) if slope + k in pushed else -1
            where = [order, 1, state + order * k, slope + k, push]
            if joined and order == joined[-1][0] and _follows(joined[-1], where):
                joined[-1][1] += 1
            else:
                joined.append(where)
    apart = sum(count for _, count, _, _, _ in joined) > TOGETHER
    heads: list[tuple[str, int, bool, bool]] = []
    for order, count, state, slope, push in joined:
        places = [f"({order} * p + {state + k}) * W + i" for k in range(order)] + [
            f"(p + {slope}) * W + i"
        ]
        names = "x, v, j" if order == 2 else "x, j"
        if push >= 0:
            names, places = f"{names}, q", [*places, f"(p + {push}) * W + i"]
        for first in range(0, count, PART if apart else count):
            span = f"{first}, {min(first + PART, count)}" if apart else f"{count}"
            head = f"for p in range({span}):\n        {names} = {', '.join(places)}"
            heads.append((head, order, apart and bool(heads), push >= 0))
    return heads


def _follows(block: list[int], one: list[int]) -> bool:
    """Whether the state ``one`` is the next of a ``block``, with or without pushes as
    the block."""
    order, count, state, slope, push = block
    pushes_on = push + count == one[4] if push >= 0 else one[4] < 0
    return one[2] == state + order * count and one[3] == slope + count and pushes_on


def loads(upto: int, pushed: bool = False, newest: bool = True) -> Iterable[str]:
    """Loads of the slopes of the stages up to this one, and of their pushes if there
    are any, the newest of them from where the right-hand side has left it."""
    for k in range(1, upto + 1):
        last = newest and k == upto
        yield f"a{k} = b[{'slope_' if last else f'a{k}_'} + j]"
        if pushed:
            yield f"p{k} = b[{'push_' if last else f'p{k}_'} + q]"


def first_stages(
    rows: Rows,
    c: float,
    step: str,
    ahead: Callable[[bool], str],
    rate: Callable[[bool], str],
    more: Sequence[str] = (),
) -> Iterable[str]:
    """The lanes whose last step was accepted move on; then the second stage, at the
    share ``c`` of the ``step``: of slopes with a push or without, how far the positions
    are ``ahead`` and the ``rate`` of what else there is. ``more`` follows once the step
    h is known. (Both values are loaded and one is selected: a masked store could not be
    forwarded to the loads that follow.)"""
    yield "for i in range(W):"
    yield "    moves = b[moves_ + i] != 0.0"
    yield "    before, after = b[time_ + i], b[time_ + i] + b[step_ + i]"
    yield "    t = after if moves else before"
    yield f"    h = {step}"
    yield "    b[time_ + i] = t"
    yield "    b[step_ + i] = h"
    yield from (f"    {line}" for line in more)
    yield f"    b[stage_time_ + i] = fma({c!r}, h, t)"
    for loop, order, alone, pushed in loops_over(rows):
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
        if pushed:
            yield "        p_before, p_after = b[p1_ + q], b[push_ + q]"
            yield "        p1 = p_after if moves else p_before"
            yield "        b[p1_ + q] = p1"
        if order == 2:
            yield "        lead = h * (v_now + b[frame_rate_ + j])"
        for state in "xv"[:order]:
            yield f"        b[start_ + {state}] = {state}_now"
        yield "        b[a1_ + j] = a1"
        if order == 2:
            yield "        b[lead_ + j] = lead"
            yield f"        b[stage_ + x] = {ahead(pushed)}"
        last = "xv"[order - 1]
        yield f"        b[stage_ + {last}] = fma(h, {rate(pushed)}, {last}_now)"
    yield "right_hand_side(b)"


def stage_time(c: float) -> str:
    """The time of a stage at the share ``c`` of the step."""
    return (
        f"b[stage_time_ + i] = {'b[time_ + i] + h' if c == 1.0 else f'fma({c!r}, h, b[time_ + i])'}"
    )


def led(c: float) -> str:
    """Where a position would be at the share ``c`` of the step without slopes."""
    return (
        "b[lead_ + j] + b[start_ + x]" if c == 1.0 else f"fma({c!r}, b[lead_ + j], b[start_ + x])"
    )


def judgement(rows: Rows, errors: Callable[[int, bool], Iterable[str]]) -> Iterable[str]:
    """The error of each state against its own tolerance rtol (scale + |y|), squared and
    summed; what follows from it. ``errors`` gives the lines that make error_x and
    error_v, of states of an order with a push or without; the quotients of a pair share
    one division. Companions count only where ``rows`` say so."""
    yield "wanted = 0"
    yield "for i in range(W):"
    yield "    h, proposal = b[step_ + i], b[proposed_ + i]"
    yield "    total = 0.0"
    for loop, order, alone, pushed in loops_over(rows, tangent_states=rows.judged):
        if alone:  # what has its place later, when the step is judged, has the sum until then
            yield "    b[attention_ + i] = total"
            yield "for i in range(W):"
            yield "    h, proposal, total = b[step_ + i], b[proposed_ + i], b[attention_ + i]"
        yield f"    {loop}"
        yield from (f"        {line}" for line in errors(order, pushed))
        for state in "xv"[:order]:
            largest = f"max(abs(b[start_ + {state}]), abs(b[stage_ + {state}]))"
            yield f"        scale_{state} = b[scale_ + {state}] + {largest}"
        if order == 2:
            yield (
                "        cross_x, cross_v, both = error_x * scale_v, error_v * scale_x, scale_x * "
                "scale_v"
            )
            yield "        total += fma(cross_x, cross_x, cross_v * cross_v) / (both * both)"
        else:
            yield "        quotient = error_x / scale_x"
            yield "        total = fma(quotient, quotient, total)"
    yield _verdict(rows.states if rows.judged else rows.own)


def _verdict(states: int) -> str:
    """What follows from ``total``, the sum of squared errors of so many states over
    their tolerances and the step: the controller judges it, and the lane may want
    attention."""
    return f"""\
    ratio = h * b[per_rtol_ + i]
    tries = b[accepted_ + i] + b[rejected_ + i] + 1.0
    accepted, proposed, last, growth, attention = decide(
        total * (1.0 / {states}) * (ratio * ratio), h, b[last_error_ + i], b[growth_ + i], b[least_step_ + i],
        tries >= b[limit_ + i], PROPORTIONAL, PER_ORDER)
    # A step cut short by a mark says little about the next one: the earlier proposal
    # stands.
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


def weighted(terms: Iterable[tuple[float, str]]) -> str:
    """The sum of weights times names as nested multiply-adds; weights of zero are left
    out."""
    kept = [(weight, name) for weight, name in terms if weight != 0.0]
    if not kept:
        return "0.0"
    (weight, name), rest = kept[-1], kept[:-1]
    text = f"{weight!r} * {name}"
    for weight, name in reversed(rest):
        text = f"fma({weight!r}, {name}, {text})"
    return text


def sum_of_slopes(weights: Sequence[float]) -> str:
    """The weighted sum of the slopes a1, a2, ..."""
    return weighted((weight, f"a{k}") for k, weight in enumerate(weights, start=1))


def indented(lines: Iterable[str]) -> list[str]:
    return [f"    {part}" for line in lines for part in line.split("\n")]
