"""Small deviations along a run, in the steps of the motion and across contacts, and how
often each contact begins.

A model defines its contacts by functions of state and time that are positive where the
contact is closed (:class:`nsdrill.models.base.Model`). Inside a step such a function is
the quintic through its values and rates.

Where a contact begins or ends the Jacobian is discontinuous, and a Runge-Kutta step
over the discontinuity integrates a deviation to first order in the step only. The run
itself keeps its accuracy, as its vector field is continuous. So its steps stay as they
are, and after each of them only the deviation is corrected. Within a step the tangent
dynamics keeps every contact as it was at the start of the step. If one changes inside,
at a zero of its function on the continuous solution, the step is repeated for that
lane in parts between these zeros, and the deviation at the end replaces that of the
step.

Steps are as long as the motion allows. Where it hardly changes (a bit that sticks, a
string at rest) an explicit step is at its limit of stability, and a deviation that the
equations damp may grow from step to step. So a step with a deviation whose embedded
error, relative to its length, is above DEVIATION_ERROR tolerances is repeated, too, in
parts that are short enough.

A slope that is steep within a layer thinner than a step, as the direction of a slip
with a great smoothing where the slip changes its sign, may lie between the stages: no
stage sees it, so the deviation is smooth and its error small, although it is to be
multiplied by what the equations on both sides say. The motion tells of it: its slopes
jump, so that their embedded error is no small part of their change. Such a step is
repeated as well, in parts that become short enough to resolve the layer: one of an
explicit method, of a model without contacts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from itertools import accumulate

import numpy as np

from nsdrill.abi import CLOSES, CONTROL, MARKER, OBSERVER, RATES, Layout
from nsdrill.compiler.functions import BUFFER, INTEGER, LaneFunction, compiled, inlined, lowest_bit, packed
from nsdrill.kernel.batch import unobserved
from nsdrill.kernel.pairs import Matrix
from nsdrill.kernel.steppers import Pair, slope_rows
from nsdrill.observe.inside import crossing, extreme, quintic, value

MAX_ZEROS = 2  # zeros of a contact function in a step, at most
NO_ZERO = 2.0  # a theta outside the step
DEVIATION_ERROR = 30.0
LITTLE = 2.0**-10  # squared, of parts that may be twice as long in a pair of order 5
SHORTEST = 2.0**-26  # part of a step; if that is too long, the deviation is unknown
# A slope jumps where its difference over a step is above this share of its variation, and of
# itself, and not all too small a part of the tolerance, as what rounding leaves of a rest.
OF_CHANGE = 0.01
OF_SLOPE = 1e-5
OF_TOLERANCE = DEVIATION_ERROR
# Over half a step the difference of what does not jump falls to an eighth, over a quarter to
# 1/64; that of a jump keeps more than these, until the parts resolve it.
OF_WHOLE, OF_PART = 0.15, 0.0225


def landing_rows(contacts: int) -> int:
    """The number of rows of the observer: each contact function and its rates at the
    start of the step, then at its end."""
    return 2 * RATES * contacts


def scratch_size(rows: Layout, contacts: int) -> int:
    """The number of entries at the end of the store: the buffer of one lane, the zeros of
    the contact functions, and what is kept of jumps of slopes."""
    return rows.total + MAX_ZEROS * contacts + rows.own_slopes


def _square(weights: Matrix) -> np.ndarray:
    """Rows of weights of unequal length as a table, filled up with zeros."""
    table = np.zeros((len(weights), len(weights)))
    for n, row in enumerate(weights):
        table[n, : len(row)] = row
    return table


def _part_of_step(rows: Layout, pair: Pair, tangent: LaneFunction) -> LaneFunction:
    """The compiled function that makes one step of the run's stepper in the buffer of
    one lane, from (time, start) to (time + step, stage), by loops over the weights:
    such steps are rare."""
    M, pushed, implicit = rows.slopes, rows.pushed, rows.implicit != 0
    stage, start, slope, frame_rate = rows.stage, rows.start, rows.acceleration, rows.frame_rate
    time, step, stage_time, relax = rows.time, rows.step, rows.stage_time, rows.relax
    nodes, rates, positions = np.array(pair.times), _square(pair.matrix), _square(pair.positions)
    push_rates, push_positions = _square(pair.pushes), _square(pair.position_pushes)
    slopes, stages, diagonal = np.array(slope_rows(pair, rows)), len(pair.times), pair.diagonal
    # The push of each slope, -1 where it has none; the first state of each slope, and
    # whether that is a position, which its velocity follows.
    push_of = np.array([pushed.index(p) if p in pushed else -1 for p in range(M)])
    state_of = np.array([f + o * k for o, count, f, _ in rows.blocks for k in range(count)], np.int64)
    has_velocity = np.array([o == 2 for o, count, _, _ in rows.blocks for _ in range(count)])
    pushes = len(pushed)

    @compiled(BUFFER)
    def part_of_step(s):
        h = s[step]
        for n in range(stages):
            s[stage_time] = s[time] + nodes[n] * h
            for p in range(M):
                x, v, target_ = start + state_of[p], start + state_of[p] + 1, stage + state_of[p]
                rate = position_change = 0.0
                for m in range(n + 1):
                    rate += rates[n, m] * s[slopes[m] + p]
                    position_change += positions[n, m] * s[slopes[m] + p]
                if implicit and push_of[p] >= 0:
                    for m in range(n + 1):
                        rate += push_rates[n, m] * s[slopes[m] + M + push_of[p]]
                        position_change += push_positions[n, m] * s[slopes[m] + M + push_of[p]]
                if has_velocity[p]:
                    s[target_] = s[x] + h * (nodes[n] * (s[v] + s[frame_rate + p]) + h * position_change)
                    s[target_ + 1] = s[v] + h * rate
                else:
                    s[target_] = s[x] + h * rate
            if implicit:
                s[relax] = diagonal * h
            if implicit or n < stages - 1:
                tangent(s)
            if n < stages - 1:
                for p in range(M + pushes):
                    s[slopes[n + 1] + p] = s[slope + p]
        if implicit:
            s[relax] = 0.0  # further evaluations are at the given velocities

    return part_of_step


def _error_of(lanes: int, rows: Layout, pair: Pair) -> Callable[..., float]:
    """The function ``squared_error(b, i)`` of a step of lane i: the square of the error
    of its deviation, over the length of that at the start and DEVIATION_ERROR
    tolerances; it is written out. The error is that of the slopes: in natural scales
    that of a position is no greater where the motion is faster than natural."""
    W, own, pushed, diagonal = lanes, rows.own, rows.pushed, pair.diagonal
    slopes_ = tuple(W * row for row in (*slope_rows(pair, rows), rows.acceleration))
    push_, last_push_ = W * rows.push, slopes_[-2] + W * rows.slopes
    start_, scale_ = W * (rows.start + own), W * (rows.scale + own)
    step_, per_rtol_, weights = W * rows.step, W * (rows.control + CONTROL.index("per_rtol")), pair.error
    # (order, its first state, its slope, its push or -1) of each
    parts = tuple(
        (
            order,
            W * (state - own + order * k),
            W * (slope + k),
            W * pushed.index(slope + k) if slope + k in pushed else -1,
        )
        for order, count, state, slope in rows.blocks
        for k in range(count if state >= own else 0)
    )

    @inlined
    def squared_error(b, i):
        errors = length = 0.0
        for order, x, j, q in parts:
            error, last = 0.0, x + (order - 1) * W
            for n in range(len(weights)):
                error += weights[n] * b[slopes_[n] + j + i]
            if q >= 0:
                error += diagonal * (b[push_ + q + i] - b[last_push_ + q + i])
            scale = b[scale_ + last + i]
            if order == 2:  # the quotients of a pair share a division
                position_scale = b[scale_ + x + i]
                both = 1.0 / (scale * position_scale)
                per = position_scale * both
                position = b[start_ + x + i] * (scale * both)
                length += position * position
            else:
                per = 1.0 / scale
            last_state, error = b[start_ + last + i] * per, error * per
            length += last_state * last_state
            errors += error * error
        relative = b[step_ + i] * b[per_rtol_ + i] * (1.0 / DEVIATION_ERROR)
        return errors / length * (relative * relative)

    return squared_error


def _difference(pair: Pair) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """The stages, the first 0, and the weights of their slopes in a divided difference over the
    step, of third order if the pair has two nodes inside. It sees a jump wherever in the step
    that lies, by at least the jump itself: the embedded error may have no weight there."""
    times = (0.0, *pair.times)
    inside = {time: n for n, time in enumerate(times) if 0.0 < time < 1.0}
    nearest = {min((abs(time - third / 3), time) for time in inside)[1] for third in (1, 2)} if inside else set()
    nodes = [0.0, *sorted(nearest), 1.0]
    weights = [1.0 / math.prod(one - other for other in nodes if other != one) for one in nodes]
    least = min(abs(total) for total in accumulate(weights[:-1]))
    return (0, *(inside[node] for node in nodes[1:-1]), len(times) - 1), tuple(one / least for one in weights)


def _jumps_in(lanes: int, rows: Layout, pair: Pair, sizes: int) -> tuple[Callable[..., bool], ...]:
    """Functions that are written out: ``jumps(b, i)``, whether a slope of the motion may jump in
    the step of lane i; ``keep(b, i, s)``, which writes from ``s[sizes]`` on how much of its
    difference each slope that may jump has to keep in a part; and ``lasts(s, part)``, whether
    one does in this part of a step in the buffer ``s`` of one lane."""
    step_, scale_, per_rtol_ = rows.step, rows.scale, rows.control + CONTROL.index("per_rtol")
    stages, weights = _difference(pair)
    every = (*slope_rows(pair, rows), rows.acceleration)
    slopes_ = tuple(every[n] for n in stages)
    parts = tuple(
        enumerate(
            (state + order * k + order - 1, slope + k)
            for order, count, state, slope in rows.blocks
            for k in range(count if state < rows.own else 0)
        )
    )

    @inlined
    def difference(b, i, W, j):
        total = 0.0
        for n in range(len(weights)):
            total += weights[n] * b[(slopes_[n] + j) * W + i]
        return abs(total)

    @inlined
    def may_jump(b, i, W, state, j, size):
        low = high = b[(slopes_[0] + j) * W + i]
        for n in range(1, len(weights)):
            slope = b[(slopes_[n] + j) * W + i]
            low, high = min(low, slope), max(high, slope)
        tolerances = size * b[step_ * W + i] * b[per_rtol_ * W + i]
        return (
            (size > OF_CHANGE * (high - low))
            & (size > OF_SLOPE * max(abs(low), abs(high)))
            & (tolerances > OF_TOLERANCE * b[(scale_ + state) * W + i])
        )

    @inlined
    def jumps(b, i):
        found = False
        for _, (state, j) in parts:
            found |= may_jump(b, i, lanes, state, j, difference(b, i, lanes, j))
        return found

    @inlined
    def keep(b, i, s):
        for k, (state, j) in parts:
            size = difference(b, i, lanes, j)
            s[sizes + k] = size if may_jump(b, i, lanes, state, j, size) else np.inf

    @inlined
    def lasts(s, part):
        found, share = False, OF_WHOLE if part > 0.3 else OF_PART
        for k, (_, j) in parts:
            found |= difference(s, 0, 1, j) > share * s[sizes + k]
        return found

    return jumps, keep, lasts


def _find_zeros(lanes: int, rows: Layout, first: int, contacts: int) -> Callable[..., int]:
    """The function that writes the zeros of the contact functions in the step of lane
    i, by theta, and returns how many there are; it is written out."""
    W, step_ = lanes, lanes * rows.step
    at_start, zeros = rows.observer + first, rows.total
    at_end = at_start + RATES * contacts

    @inlined
    def find_zeros(b, s, i):
        h, count = b[step_ + i], 0
        # read there, so that places in the lane buffer are known
        for k in range(2 * RATES * contacts):
            s[at_start + k] = b[(at_start + k) * W + i]
        for c in range(contacts if h > 0.0 else 0):
            k0, k1 = at_start + RATES * c, at_end + RATES * c
            g0, d0, c0 = s[k0], s[k0 + 1], s[k0 + 2]
            g1, d1, c1 = s[k1], s[k1 + 1], s[k1 + 2]
            p = quintic(g0, h * d0, h * h * c0, g1, h * d1, h * h * c1)
            s[zeros + MAX_ZEROS * c] = NO_ZERO
            s[zeros + MAX_ZEROS * c + 1] = NO_ZERO
            if (g0 > 0.0) != (g1 > 0.0):
                s[zeros + MAX_ZEROS * c] = crossing(p, 0.0, 1.0)
                count += 1
            elif (d0 > 0.0) != (d1 > 0.0) and (d0 > 0.0) != (g0 > 0.0):
                extremum = extreme(p, h * d1)
                if (value(p, extremum) > 0.0) != (g0 > 0.0):
                    s[zeros + MAX_ZEROS * c] = crossing(p, 0.0, extremum)
                    s[zeros + MAX_ZEROS * c + 1] = crossing(p, extremum, 1.0)
                    count += 2
        return count

    return find_zeros


def _repeat_step(
    lanes: int, rows: Layout, pair: Pair, first: int, tangent: LaneFunction, contacts: int
) -> Callable[..., None]:
    """The function that repeats the step of lane i in parts between the ``crossings``
    zeros of the contact functions, in the buffer of one lane; it is written out. Where
    the error of the deviation does not count in the step, the parts are so short that
    it is small."""
    W, N, own, M, A = lanes, rows.states, rows.own, rows.slopes, rows.slopes + len(rows.pushed)
    own_slopes, own_pushes, implicit = rows.own_slopes, len(rows.pushed) // 2, rows.implicit != 0
    at_start, zeros, watched = rows.observer + first, rows.total, not rows.judged
    at_end = at_start + RATES * contacts
    stage, start, slope, slope_start = rows.stage, rows.start, rows.acceleration, rows.start_acceleration
    time, step, stage_time, relax = rows.time, rows.step, rows.stage_time, rows.relax
    copied = (
        (rows.phase, 1),
        (rows.parameter, rows.parameters),
        (start, N),
        (rows.frame_rate, M),
        (slope_start, A),
        (rows.scale, N),
        (rows.control, len(CONTROL)),
    )
    part_of_step, squared_error = _part_of_step(rows, pair, tangent), _error_of(1, rows, pair)
    _, _, lasts = _jumps_in(1, rows, pair, zeros + MAX_ZEROS * contacts)

    @inlined
    def repeat_step(b, s, i, crossings, has_jump):
        for row, count in copied:
            for j in range(count):
                s[row + j] = b[(row + j) * W + i]
        if implicit:
            s[relax] = 0.0
        h, theta, start_time, is_known = b[step * W + i], 0.0, b[time * W + i], True
        s[time] = start_time
        for change in range(crossings + 1 if h > 0.0 else 0):
            end, contact_zero = 1.0, 0
            if change < crossings:
                for k in range(MAX_ZEROS * contacts):
                    if s[zeros + k] < s[zeros + contact_zero]:
                        contact_zero = k
                end = s[zeros + contact_zero]
                s[zeros + contact_zero] = NO_ZERO
            part, is_inside = (0.5 if has_jump else 1.0) * (end - theta), True
            while is_inside:
                s[step] = h * part
                part_of_step(s)
                error = 0.0
                if watched:
                    if not implicit:
                        tangent(s)
                    error = squared_error(s, 0)
                    if has_jump and lasts(s, part):
                        error = np.inf
                if is_known and not error <= 1.0 and part > SHORTEST:
                    part *= 0.5
                else:
                    is_known = is_known and error <= 1.0
                    is_inside = part < end - theta
                    theta = theta + part if is_inside else end
                    s[time] = start_time + h * theta
                    if is_inside or change < crossings:
                        s[stage_time] = s[time]
                        if not is_inside:
                            # The contact changes.
                            s[at_start + RATES * (contact_zero // MAX_ZEROS)] *= -1.0
                            tangent(s)
                        for j in range(N):
                            s[start + j] = s[stage + j]
                        for p in range(A):
                            s[slope_start + p] = s[slope + p]
                    part = min(2.0 * part if error < LITTLE or not is_known else part, end - theta)
        if h > 0.0:
            for j in range(own, N):
                b[(stage + j) * W + i] = s[stage + j] if is_known else np.nan
        # The next step begins with the accelerations and the contacts at the end of the
        # run's step.
        for j in range(N):
            s[stage + j] = b[(stage + j) * W + i]
        s[stage_time] = start_time + h
        for c in range(contacts):
            s[at_start + RATES * c] = b[(at_end + RATES * c) * W + i]
        tangent(s)
        for p in range(own_slopes, M):
            b[(slope + p) * W + i] = s[slope + p]
        for p in range(M + own_pushes, A):
            b[(slope + p) * W + i] = s[slope + p]

    return repeat_step


def make_landing(
    lanes: int,
    rows: Layout,
    pair: Pair,
    first: int,
    measure: LaneFunction,
    tangent: LaneFunction,
    contacts: int,
    seeks_jumps: bool,
) -> LaneFunction:
    """The compiled observer that corrects the deviations, which are the tangent states.

    ``first`` is the position of its rows among those of the observer. ``measure(b)``
    writes the contact functions and their rates at the end of the step to the second
    half of them. The right-hand side ``tangent(b)``, of one lane, takes a contact as
    closed if the value in the first half is positive. ``pair`` has the numbers of the
    run's stepper. Jumps of slopes are looked for where it ``seeks_jumps``.
    """
    if not contacts and rows.judged:
        return unobserved()[0]
    W, step_, moves_, watched = lanes, lanes * rows.step, lanes * rows.moves, not rows.judged
    # In implicit parts next to a contact the slope at the start may differ from the rest for good.
    seeks = seeks_jumps and not (rows.implicit and contacts)
    start_ = W * (rows.observer + first)
    width = W * RATES * contacts
    end_, scratch = start_ + width, scratch_size(rows, contacts)
    find_zeros = _find_zeros(lanes, rows, first, contacts)
    repeat_step = _repeat_step(lanes, rows, pair, first, tangent, contacts)
    squared_error = _error_of(lanes, rows, pair)
    jumps, keep, _ = _jumps_in(lanes, rows, pair, rows.total + MAX_ZEROS * contacts)

    @compiled(BUFFER, BUFFER, INTEGER)
    def correct(b, s, i):
        crossings, is_inexact, has_jump = find_zeros(b, s, i), False, False
        if watched:
            error = squared_error(b, i)
            is_inexact = error > 1.0
            # A deviation that is lost stays lost, in whatever parts.
            if seeks:
                has_jump = error == error and jumps(b, i)
                keep(b, i, s)
        if crossings > 0 or is_inexact or has_jump or not b[step_ + i] > 0.0:
            repeat_step(b, s, i, crossings, has_jump)

    @compiled(OBSERVER)
    def landing(b, store):
        measure(b)
        due = 0
        for i in packed(W):
            # A contact function changes its sign, or has an extremum towards zero. A
            # step of length zero is the start of a run, whose accelerations were
            # computed with the contacts of the run before.
            needs_correction = b[step_ + i] == 0.0
            for k in range(0, width, RATES * W):
                g0, d0 = b[start_ + k + i], b[start_ + W + k + i]
                g1, d1 = b[end_ + k + i], b[end_ + W + k + i]
                needs_correction |= (g0 > 0.0) != (g1 > 0.0) or ((d0 > 0.0) != (d1 > 0.0) and (d0 > 0.0) != (g0 > 0.0))
            if watched:
                error = squared_error(b, i)
                needs_correction |= error > 1.0
                if seeks:
                    needs_correction |= error == error and jumps(b, i)
            due |= (1 << i) if needs_correction and b[moves_ + i] != 0.0 else 0
        while due != 0:
            i = lowest_bit(due)
            due &= due - 1
            correct(b, store[len(store) - scratch :], i)
        for i in packed(W):
            accepted = b[moves_ + i] != 0.0
            for k in range(0, width, W):
                old, new = b[start_ + k + i], b[end_ + k + i]
                b[start_ + k + i] = new if accepted else old

    return landing


# For each contact the least and the greatest value of its function, and how often it
# begins. One that begins or is interrupted within one step is counted too. The same is
# measured of levels below which a state falls, with the cubic through its values and
# slopes.

TOUCHES = ("least", "greatest", "begins")  # the rows of each contact


def touch_rows(contacts: int) -> int:
    """The number of rows of the observer."""
    return len(TOUCHES) * contacts


@inlined
def follow(b, i, W, least_, h, g0, d0, c0, g1, d1, c1):
    """Update the rows of lane i, the first of which is at ``least_``, by a step of
    length ``h`` with these values, slopes and second derivatives by theta at its
    ends. A step of length zero is the start of a run."""
    greatest_, begun_ = least_ + W, least_ + 2 * W
    if h == 0.0:
        b[least_ + i] = b[greatest_ + i] = g1
        b[begun_ + i] = 0.0
    else:
        low, high = min(b[least_ + i], g1), max(b[greatest_ + i], g1)
        begins = g0 <= 0.0 and g1 > 0.0
        if (d0 > 0.0) != (d1 > 0.0):
            p = quintic(g0, d0, c0, g1, d1, c1)
            at_extremum = value(p, extreme(p, d1))
            low, high = min(low, at_extremum), max(high, at_extremum)
            begins = begins or ((g0 > 0.0) == (g1 > 0.0) and (at_extremum > 0.0) != (g0 > 0.0))
        b[least_ + i] = low
        b[greatest_ + i] = high
        b[begun_ + i] += 1.0 if begins else 0.0


def _marker(first_: int, lanes: int, count: int) -> LaneFunction:
    """The marker that reports ``count`` rows from the offset ``first_`` on."""

    @compiled(MARKER)
    def touches_marker(b, store, i, mark, outcome, column):
        if mark == CLOSES:
            for k in range(count):
                outcome[column + k] = b[first_ + k * lanes + i]

    return touches_marker


@lru_cache
def make_touches(
    lanes: int, rows: Layout, first: int, functions: int, contacts: int
) -> tuple[LaneFunction, LaneFunction]:
    """The compiled (observer, marker) for contact functions whose values and rates at
    the start of the step are in the rows from ``functions`` on among those of the
    observer, followed by those at its end; ``first`` is the position of the observer's
    own rows."""
    W = lanes
    functions_start, first_ = W * (rows.observer + functions), W * (rows.observer + first)
    functions_end = functions_start + W * RATES * contacts
    step_, moves_ = W * rows.step, W * rows.moves

    @compiled(OBSERVER)
    def touches(b, store):
        for c in range(contacts):
            start_, end_ = functions_start + c * W * RATES, functions_end + c * W * RATES
            for i in range(W):
                if b[moves_ + i] != 0.0:
                    h = b[step_ + i]
                    g0, d0, c0 = b[start_ + i], h * b[start_ + W + i], h * h * b[start_ + 2 * W + i]
                    g1, d1, c1 = b[end_ + i], h * b[end_ + W + i], h * h * b[end_ + 2 * W + i]
                    follow(b, i, W, first_ + touch_rows(c) * W, h, g0, d0, c0, g1, d1, c1)

    return touches, _marker(first_, W, touch_rows(contacts))


@lru_cache
def make_levels(
    lanes: int, rows: Layout, first: int, levels: tuple[tuple[int, int], ...]
) -> tuple[LaneFunction, LaneFunction]:
    """The compiled (observer, marker), like those of :func:`make_touches`, for a
    parameter minus a velocity. ``levels`` are pairs: the position of the velocity among
    the states, and that of the parameter among the parameters."""
    W, count = lanes, len(levels)
    first_ = W * (rows.observer + first)
    step_, moves_ = W * rows.step, W * rows.moves
    places = np.array(levels, np.int64).reshape(-1, 2)
    velocity, parameter = places[:, 0], places[:, 1]
    stage, start, slope, slope_start = rows.stage, rows.start, rows.acceleration, rows.start_acceleration
    parameters = rows.parameter

    @compiled(OBSERVER)
    def follow_levels(b, store):
        for c in range(count):
            place = velocity[c]
            for i in range(W):
                if b[moves_ + i] != 0.0:
                    h, level = b[step_ + i], b[(parameters + parameter[c]) * W + i]
                    g0, d0 = level - b[(start + place) * W + i], -b[(slope_start + place // 2) * W + i]
                    g1, d1 = level - b[(stage + place) * W + i], -b[(slope + place // 2) * W + i]
                    rise = 6.0 * (g1 - g0)  # the quintic is then the cubic
                    c0, c1 = rise - h * (4.0 * d0 + 2.0 * d1), h * (2.0 * d0 + 4.0 * d1) - rise
                    follow(b, i, W, first_ + touch_rows(c) * W, h, g0, h * d0, c0, g1, h * d1, c1)

    return follow_levels, _marker(first_, W, touch_rows(count))
