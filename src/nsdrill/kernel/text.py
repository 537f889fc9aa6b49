"""Pieces of the text of a step, which the steppers share: loops over blocks of states, weighted sums, the verdict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from nsdrill.abi import CONTROL, MARK, Rows
from nsdrill.kernel.controller import INTEGRAL

# Pairs of states in one loop over the lanes. The compiler unrolls the loop over them, else it packs none; of more pairs
# it does so no longer, and each part of them has a loop over the lanes of its own.
TOGETHER, PART = 8, 4


def places_of(rows: Rows, lanes: int, order: int) -> dict[str, float]:
    """The places in the buffer that every step names, and the numbers of the controller for a method of this order."""
    return {
        "W": lanes, "stage_": lanes * rows.stage, "slope_": lanes * rows.acceleration,
        "stage_time_": lanes * rows.stage_time, "start_": lanes * rows.start, "a1_": lanes * rows.start_acceleration,
        "drift_": lanes * rows.drift, "size_": lanes * rows.size, "time_": lanes * rows.time,
        "step_": lanes * rows.step, "moves_": lanes * rows.moves,
        **{f"{name}_": lanes * (rows.control + i) for i, name in enumerate(CONTROL)},
        "MARK": MARK, "PROPORTIONAL": 1.0 / order - 0.75 * INTEGRAL, "PER_ORDER": 1.0 / order,
    }  # fmt: skip


def loops_over(rows: Rows, *, companions: bool = True) -> list[tuple[str, int, bool, bool]]:
    """The heads of the loops over blocks of states, with the order of their states, whether a loop over the lanes
    begins anew before it, and whether its slopes have a push: x is the place of a position, or of a state of first
    order, v that of its velocity, j that of its slope, q that of its push. Blocks of pairs that follow one another are
    one."""
    joined: list[list[int]] = []
    pushed = rows.pushed
    for order, count, state, slope in rows.blocks:
        for k in range(count if companions or state < rows.own else 0):
            push = pushed.index(slope + k) if slope + k in pushed else -1
            where = [order, 1, state + order * k, slope + k, push]
            if joined and order == joined[-1][0] and _follows(joined[-1], where):
                joined[-1][1] += 1
            else:
                joined.append(where)
    apart = sum(count for _, count, _, _, _ in joined) > TOGETHER
    heads: list[tuple[str, int, bool, bool]] = []
    for order, count, state, slope, push in joined:
        places = [f"({order} * p + {state + k}) * W + i" for k in range(order)] + [f"(p + {slope}) * W + i"]
        names = "x, v, j" if order == 2 else "x, j"
        if push >= 0:
            names, places = f"{names}, q", [*places, f"(p + {push}) * W + i"]
        for first in range(0, count, PART if apart else count):
            span = f"{first}, {min(first + PART, count)}" if apart else f"{count}"
            head = f"for p in range({span}):\n        {names} = {', '.join(places)}"
            heads.append((head, order, apart and bool(heads), push >= 0))
    return heads


def _follows(block: list[int], one: list[int]) -> bool:
    """Whether the state ``one`` is the next of a ``block``, with or without pushes as the block."""
    order, count, state, slope, push = block
    pushes_on = push + count == one[4] if push >= 0 else one[4] < 0
    return one[2] == state + order * count and one[3] == slope + count and pushes_on


def verdict(states: int) -> str:
    """What follows from ``total``, the sum of squared errors of so many states over their tolerances and the step: the
    controller judges it, and the lane may want attention."""
    return f"""\
    ratio = h * b[per_rtol_ + i]
    tries = b[accepted_ + i] + b[rejected_ + i] + 1.0
    accepted, proposed, last, growth, attention = decide(
        total * (1.0 / {states}) * (ratio * ratio), h, b[last_error_ + i], b[growth_ + i], b[least_step_ + i],
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


def weighted(terms: Iterable[tuple[float, str]]) -> str:
    """The sum of weights times names as nested multiply-adds; weights of zero are left out."""
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
