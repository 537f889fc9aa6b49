"""The steppers by their names in a study, and one step of a Runge-Kutta pair in every
lane at once, each lane with its own time and step size.

Positions and velocities alternate among the states, so the stages of the positions
follow from those of the velocities: only slopes of velocities are computed and stored
(see :attr:`nsdrill.kernel.pairs.Pair.positions`). The result is that of the pair, with half
the memory traffic, which limits the speed of a packed step. To states of first order
the pair is applied as it is.

A step runs from (``time``, ``start``, ``start_acceleration``) to (``time`` + ``step``,
``stage``, ``acceleration``). The controller accepts or rejects it, and then the
observer is called. An accepted step (``moves``) is committed at the beginning of the
next step, or before by the loop.

The functions here are made for the numbers of a pair and for a layout of rows: weights
and places in the buffer are constants, and every sum over stages is written out. Names
that end in ``_`` are offsets of rows in the buffer. Only an additive pair has pushes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

from nsdrill.abi import CONTROL, LIMIT, MARK, NONFINITE, NOTHING, STEPPER, UNDERFLOW, Layout
from nsdrill.compiler.functions import LaneFunction, call, compiled, fma, inlined, packed
from nsdrill.elementary import exp2, log2
from nsdrill.kernel.pairs import DORMAND_PRINCE, KENNEDY_CARPENTER, TSITOURAS, Pair
from nsdrill.records import dataclass

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
def decide(squared_error, step, last_level, growth, least_step, exhausted, proportional, per_order):
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


def private_rows(pair: Pair, rows: Layout) -> int:
    """How many rows of its own a step needs: slopes and pushes at the inner stages, and
    the positions' change over the step at constant velocity."""
    return (len(pair.times) - 1) * (rows.slopes + len(rows.pushed)) + rows.slopes


def drift_row(pair: Pair, rows: Layout) -> int:
    """The first of the rows with the positions' change over the step at constant
    velocity."""
    return rows.stepper + private_rows(pair, rows) - rows.slopes


def slope_rows(pair: Pair, rows: Layout) -> tuple[int, ...]:
    """The first of the rows with the slopes at each stage, the start included; those of
    the pushes follow each."""
    width = rows.slopes + len(rows.pushed)
    return (rows.start_acceleration, *(rows.stepper + n * width for n in range(len(pair.times) - 1)))


@dataclass(frozen=True)
class Block:
    """States side by side that are treated alike: the ``order`` of their equations, how
    many of them or of their pairs there are, and the first of their states, of their
    slopes and of the pushes of these, -1 where they have none."""

    order: int
    count: int
    state: int
    slope: int
    push: int

    def is_continued_by(self, single: Block) -> bool:
        """Whether the block ``single`` of one state is adjacent to the end of this one,
        and has a push if and only if this one has."""
        same_push = single.push == self.push + self.count if self.push >= 0 else single.push < 0
        next_state, next_slope = self.state + self.order * self.count, self.slope + self.count
        return same_push and (single.order, single.state, single.slope) == (self.order, next_state, next_slope)


def _blocks(rows: Layout, *, tangent_states: bool = True) -> list[Block]:
    """The states in blocks, of which adjacent ones are joined."""
    joined: list[Block] = []
    pushed = rows.pushed
    for order, count, state, slope in rows.blocks:
        for k in range(count if tangent_states or state < rows.own else 0):
            push = pushed.index(slope + k) if slope + k in pushed else -1
            single = Block(order, 1, state + order * k, slope + k, push)
            if joined and joined[-1].is_continued_by(single):
                joined[-1] = replace(joined[-1], count=joined[-1].count + 1)
            else:
                joined.append(single)
    return joined


def _weighted(weights: Sequence[float], pushes: Sequence[float] = (), stages: int = 0) -> Callable[..., float]:
    """The function that gives the weighted sum of a tuple of slopes, of so many
    ``stages``, and of the pushes that follow them, as nested multiply-adds; weights of
    zero are left out."""
    terms = [(weight, k) for k, weight in enumerate(weights) if weight]
    terms += [(weight, stages + k) for k, weight in enumerate(pushes) if weight]
    if not terms:

        @inlined
        def nothing(values):
            return 0.0

        return nothing
    innermost, last = terms.pop()
    around = tuple(reversed(terms))

    @inlined
    def total(values):
        result = innermost * values[last]
        for weight, k in around:
            result = fma(weight, values[k], result)
        return result

    return total


def _indices(block: Block, lanes: int) -> Callable[..., tuple[int, int, int, int]]:
    """The function that gives, for the p-th of a block in lane i, where each is in its
    rows: a position or a state of first order; the velocity of the position, or that
    state again; the slope; its push."""
    W, order, state, slope, push = lanes, block.order, block.state, block.slope, block.push

    @inlined
    def indices(p, i):
        x = (order * p + state) * W + i
        return x, x + (order - 1) * W, (p + slope) * W + i, (p + push) * W + i

    return indices


def _second_stage(pair: Pair, lanes: int, rows: Layout) -> Callable[..., None]:
    """The function that commits the last step in the lanes with ``moves`` and begins the
    next one: its second stage. A step with implicit stages is short enough for each of
    them to have one solution."""
    W, c, diagonal = lanes, pair.times[0], pair.diagonal
    longest = STEP_FRACTION / diagonal if diagonal else 0.0
    moves_, time_, step_, stage_time_ = W * rows.moves, W * rows.time, W * rows.step, W * rows.stage_time
    relax_, falling_ = W * rows.relax, W * rows.falling
    proposed_, mark_time_ = (W * (rows.control + CONTROL.index(name)) for name in ("proposed", "mark_time"))
    blocks = tuple(_second_stage_of(block, pair, lanes, rows) for block in _blocks(rows))

    @inlined
    def second_stage(b):
        for i in packed(W):
            moves = b[moves_ + i] != 0.0
            before, after = b[time_ + i], b[time_ + i] + b[step_ + i]
            t = after if moves else before
            proposed = b[proposed_ + i]
            if diagonal:
                proposed = min(proposed, longest / max(b[falling_ + i], TINY))
            h = min(proposed, b[mark_time_ + i] - t)
            b[time_ + i] = t
            b[step_ + i] = h
            if diagonal:
                b[relax_ + i] = diagonal * h
            b[stage_time_ + i] = fma(c, h, t)
            for block in blocks:
                block(b, i, h, moves)

    return second_stage


def _second_stage_of(block: Block, pair: Pair, lanes: int, rows: Layout) -> Callable[..., None]:
    """The part of that for one block. (Both values are loaded and one is selected: a
    masked store could not be forwarded to the loads that follow.)"""
    W, c, order, count, pushed = lanes, pair.times[0], block.order, block.count, block.push >= 0
    start_, stage_, frame_rate_ = W * rows.start, W * rows.stage, W * rows.frame_rate
    slope_, push_, drift_ = W * rows.acceleration, W * rows.push, W * drift_row(pair, rows)
    first_ = W * rows.start_acceleration
    first_push_ = first_ + W * rows.slopes
    change_weights, push_weights = pair.positions[0], pair.position_pushes[0] if pushed else ()
    is_changed = any((*change_weights, *push_weights))
    change = _weighted(change_weights, push_weights, 1)
    rate = _weighted(pair.matrix[0], pair.pushes[0] if pushed else (), 1)
    indices = _indices(block, lanes)

    @inlined
    def second_stage(b, i, h, moves):
        for p in range(count):
            x, last, j, q = indices(p, i)
            now = b[stage_ + x] if moves else b[start_ + x]
            last_now = now if order == 1 else (b[stage_ + last] if moves else b[start_ + last])
            values = (b[slope_ + j] if moves else b[first_ + j],)
            if pushed:
                values += (b[push_ + q] if moves else b[first_push_ + q],)
                b[first_push_ + q] = values[1]
            b[start_ + x] = now
            b[first_ + j] = values[0]
            if order == 2:
                b[start_ + last] = last_now
                drift = h * (last_now + b[frame_rate_ + j])
                b[drift_ + j] = drift
                drifted = fma(c, drift, now)
                b[stage_ + x] = fma(h * h, change(values), drifted) if is_changed else drifted
            b[stage_ + last] = fma(h, rate(values), last_now)

    return second_stage


def _stage(pair: Pair, lanes: int, rows: Layout, row: int) -> Callable[..., None]:
    """The function of the stage with this row of weights, or of the end of the step, in
    one pass over the states: the slope just computed is stored, and the stage values are
    formed. Where two successive stages have the same node, the time is set once."""
    W, c, is_later = lanes, pair.times[row], pair.times[row] != pair.times[row - 1]
    time_, step_, stage_time_ = W * rows.time, W * rows.step, W * rows.stage_time
    blocks = tuple(_stage_of(block, pair, lanes, rows, row) for block in _blocks(rows))

    @inlined
    def stage(b):
        for i in packed(W):
            h = b[step_ + i]
            if is_later:
                b[stage_time_ + i] = b[time_ + i] + h if c == 1.0 else fma(c, h, b[time_ + i])
            for block in blocks:
                block(b, i, h)

    return stage


def _stage_of(block: Block, pair: Pair, lanes: int, rows: Layout, row: int) -> Callable[..., None]:
    """The part of that for one block. An explicit stage adds the newest slope last: the
    others are known before it is."""
    W, c, order, count, pushed = lanes, pair.times[row], block.order, block.count, block.push >= 0
    stages, is_explicit, newest_weight = row + 1, not pair.diagonal, pair.matrix[row][-1]
    start_, stage_, drift_ = W * rows.start, W * rows.stage, W * drift_row(pair, rows)
    slope_, push_ = W * rows.acceleration, W * rows.push
    *slopes_, own_ = (W * first for first in slope_rows(pair, rows)[:stages])
    pushes_, own_push_ = tuple(first + W * rows.slopes for first in slopes_), own_ + W * rows.slopes
    earlier = tuple(slopes_)
    change = _weighted(pair.positions[row], pair.position_pushes[row] if pushed else (), stages)
    rate = _weighted(
        pair.matrix[row][:-1] if is_explicit else pair.matrix[row], pair.pushes[row] if pushed else (), stages
    )
    indices = _indices(block, lanes)

    @inlined
    def stage(b, i, h):
        for p in range(count):
            x, last, j, q = indices(p, i)
            newest = b[slope_ + j]
            values = (*tuple(b[place + j] for place in earlier), newest)
            if pushed:
                values += (*tuple(b[place + q] for place in pushes_), b[push_ + q])
                b[own_push_ + q] = values[-1]
            b[own_ + j] = newest
            if order == 2:
                drift = b[drift_ + j]
                drifted = drift + b[start_ + x] if c == 1.0 else fma(c, drift, b[start_ + x])
                b[stage_ + x] = fma(h * h, change(values), drifted)
            end = fma(h, rate(values), b[start_ + last])
            b[stage_ + last] = fma(h * newest_weight, newest, end) if is_explicit else end

    return stage


def _error_control(pair: Pair, lanes: int, rows: Layout) -> Callable[..., int]:
    """The function that makes the controller's decision from the error of a step, and
    returns whether some lane needs attention. Tangent states count only if
    ``rows.judged``."""
    W, per_state = lanes, 1.0 / (rows.states if rows.judged else rows.own)
    proportional, per_order = 1.0 / pair.order - 0.75 * INTEGRAL, 1.0 / pair.order
    step_, time_, moves_ = W * rows.step, W * rows.time, W * rows.moves
    (
        proposed_, mark_time_, last_error_, growth_, per_rtol_, least_step_, accepted_, rejected_, limit_, running_,
        attention_,
    ) = (W * (rows.control + k) for k in range(len(CONTROL)))  # fmt: skip
    blocks = tuple(_error_of(block, pair, lanes, rows) for block in _blocks(rows, tangent_states=rows.judged))

    @inlined
    def error_control(b):
        any_attention = 0
        for i in packed(W):
            h, proposal = b[step_ + i], b[proposed_ + i]
            total = 0.0
            for block in blocks:
                total = block(b, i, h, total)
            ratio = h * b[per_rtol_ + i]
            tries = b[accepted_ + i] + b[rejected_ + i] + 1.0
            accepted, proposed, last, growth, attention = decide(
                total * per_state * (ratio * ratio), h, b[last_error_ + i], b[growth_ + i], b[least_step_ + i],
                tries >= b[limit_ + i], proportional, per_order,
            )  # fmt: skip
            # A step cut short by a mark gives little information on the next one: the
            # earlier proposal is kept.
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
            any_attention |= 0 if attention * running == 0.0 else 1
        return any_attention

    return error_control


def _error_of(block: Block, pair: Pair, lanes: int, rows: Layout) -> Callable[..., float]:
    """The function that adds to a total the squares of the errors of the states of one
    block over their tolerances and the step, rtol (scale + |y|). The two quotients of a
    pair share one division."""
    W, order, count, pushed, diagonal = lanes, block.order, block.count, block.push >= 0, pair.diagonal
    stages = len(pair.times)
    slopes_ = tuple(W * first for first in (*slope_rows(pair, rows), rows.acceleration))
    pushes_, push_ = tuple(first + W * rows.slopes for first in slopes_[:-1]), W * rows.push
    start_, stage_, scale_ = W * rows.start, W * rows.stage, W * rows.scale
    position_weights, push_weights = pair.position_error
    position_error = _weighted(position_weights, push_weights if pushed else (), stages + 1)
    error = _weighted(pair.error)
    indices = _indices(block, lanes)

    @inlined
    def error_of(b, i, h, total):
        for p in range(count):
            x, last, j, q = indices(p, i)
            values = tuple(b[place + j] for place in slopes_)
            if pushed:
                values += tuple(b[place + q] for place in pushes_)
            error_x = h * position_error(values) if order == 2 else 0.0
            last_error = error(values)
            if pushed:
                last_error = fma(diagonal, b[push_ + q] - values[-1], last_error)
            scale_x = b[scale_ + x] + max(abs(b[start_ + x]), abs(b[stage_ + x]))
            if order == 2:
                scale = b[scale_ + last] + max(abs(b[start_ + last]), abs(b[stage_ + last]))
                cross_x, cross_v, both = error_x * scale, last_error * scale_x, scale_x * scale
                total += fma(cross_x, cross_x, cross_v * cross_v) / (both * both)
            else:
                quotient = last_error / scale_x
                total = fma(quotient, quotient, total)
        return total

    return error_of


@lru_cache
def with_step(pair: Pair, rows: Layout) -> Layout:
    """The row layout with the rows of a step added."""
    return replace(rows, private=private_rows(pair, rows))


def _stages(pair: Pair, lanes: int, rows: Layout) -> tuple[Callable[..., None], ...]:
    """The functions that come before each evaluation of the right-hand side."""
    return (_second_stage(pair, lanes, rows), *(_stage(pair, lanes, rows, row) for row in range(1, len(pair.times))))


@lru_cache
def make_step(pair: Pair, lanes: int, rows: Layout) -> LaneFunction:
    """The compiled function ``step(buffer, right_hand_side, observer, store)`` for a
    number of lanes and a row layout returned by :func:`with_step`. It

    1. commits the accepted step in the lanes with ``moves`` set;
    2. tries one step in every lane from (``time``, ``start``, ``start_acceleration``);
    3. writes the end of the step to ``stage`` and ``acceleration``, and the
       controller's decision to the rows of ``CONTROL``;
    4. calls the observer;
    5. returns whether some lane needs attention.
    """
    stages, error_control = _stages(pair, lanes, rows), _error_control(pair, lanes, rows)

    @compiled(STEPPER)
    def step(b, right_hand_side, observer, store):
        for stage in stages:
            stage(b)
            call(right_hand_side, b)
        any_attention = error_control(b)
        call(observer, b, store)
        return any_attention

    return step


@lru_cache
def make_turn(pair: Pair, rows: Layout) -> Callable[..., int]:
    """The helper ``step(buffer, right_hand_side, observer, store, first, begins)`` for
    one lane, which is written out: a step whose stages are turns of a loop, so that the
    right-hand side is there once. It makes the stages after the ``first``, which is 0;
    with one less than there are stages, only the slopes are computed, and where a run
    ``begins`` the step is one of length zero; with all of them, only the observer is
    called."""
    stages, error_control = _stages(pair, 1, rows), _error_control(pair, 1, rows)
    numbered, count, step_, moves_ = tuple(enumerate(stages)), len(stages), rows.step, rows.moves

    @inlined
    def step(b, right_hand_side, observer, store, first, begins):
        number = first
        while number < count:
            for k, stage in numbered:
                if number == k and first == 0:
                    stage(b)
            call(right_hand_side, b)
            number += 1
        any_attention = 0
        if begins:
            b[step_], b[moves_] = 0.0, 1.0
        if first == 0:
            any_attention = error_control(b)
        call(observer, b, store)
        return any_attention

    return step


STEPPERS = {"tsitouras": TSITOURAS, "dormand_prince": DORMAND_PRINCE, "kennedy_carpenter": KENNEDY_CARPENTER}
"""The pairs by their names; the last is for right-hand sides with implicit friction."""
