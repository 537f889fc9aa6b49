"""Small deviations across contacts: steps in which a contact begins or ends are made
anew, in parts that land on it.

At a contact the Jacobian jumps, and a Runge-Kutta step over the jump follows a
deviation no better than to the first power of the step. The run itself does not mind:
its vector field has a kink only. So its steps stay as they are, and after each of them
the deviation alone is mended. Within a step the tangent dynamics takes every contact as
it was at the step's start; where one changes inside, at a zero of its function on the
continuous solution, the step is made again for that lane, from zero to zero, and the
deviation at its end replaces the one that came out.

The model says what its contacts are, as functions of state and time that are positive
where it touches.
"""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, RATES, Rows, compiled
from nsdrill.elementary import lowest_bit
from nsdrill.kernel.scheme import Scheme
from nsdrill.observe.interpolant import crossing, extreme, quintic, value

ROOTS = 2  # zeros of a contact function in a step, at most
OVER = 2.0  # no place in a step


def landing_rows(contacts: int) -> int:
    """Rows of the observer: each contact function and its rates at the start of the
    step, then at its end."""
    return 2 * RATES * contacts


def scratch_size(rows: Rows, contacts: int) -> int:
    """Numbers at the end of the store: the buffer of one lane, and the zeros found."""
    return rows.total + ROOTS * contacts


def _nothing(lanes: int, rows: Rows, first: int, *variant: int) -> Any:
    """The observer of a model without contacts."""

    @compiled(types.void(BUFFER, BUFFER), lanes, *astuple(rows), first, *variant)
    def no_landing(b, store):  # type: ignore[no-untyped-def]
        pass

    return no_landing


@lru_cache
def make_landing(
    lanes: int,
    rows: Rows,
    scheme: Scheme,
    first: int,
    measure: Any,
    tangent: Any,
    contacts: int,
    variant: tuple[int, ...] = (),
) -> Any:
    """The compiled observer that mends the deviations, which are the tangent states of
    the states.

    ``first`` is the place of its rows among those of the observer; ``measure(b)`` puts
    the contact functions and their rates at the end of the step into the second half of
    them, and the right-hand side ``tangent(b)``, of one lane, takes a contact as closed
    where the value in the first half is positive. ``scheme`` is that of the run's
    stepper. ``variant`` tells models and steppers apart.
    """
    if not contacts:
        return _nothing(lanes, rows, first, *variant)
    W, N, M, own, P = lanes, rows.states, rows.slopes, rows.own, rows.parameters
    of_contacts = RATES * contacts
    before, zeros = rows.observer + first, rows.total
    now = before + of_contacts
    stage, start, slope, slope_start, frame_rate = (
        rows.stage,
        rows.start,
        rows.acceleration,
        rows.start_acceleration,
        rows.frame_rate,
    )
    parameter, phase, stage_time = rows.parameter, rows.phase, rows.stage_time
    time, step, moves = rows.time, rows.step, rows.moves
    size = scratch_size(rows, contacts)
    nodes, rates, positions = scheme.nodes, scheme.rates, scheme.positions
    slopes, pushes = np.array(scheme.slopes), np.array(scheme.pushes, np.int64)
    more_rates, more_positions = scheme.more_rates, scheme.more_positions
    stages, diagonal = len(rates), scheme.diagonal
    # The push of each slope, -1 where it has none.
    push_of = np.array([rows.pushed.index(p) if p in rows.pushed else -1 for p in range(M)])
    own_slopes = rows.own_slopes
    relax, apart, A = rows.relax, rows.apart != 0, M + len(rows.pushed)
    own_pushes = len(rows.pushed) // 2
    # The first state of each slope, and whether it is a position, whose velocity
    # follows.
    state_of = np.array(
        [f + o * k for o, count, f, _ in rows.blocks for k in range(count)], np.int64
    )
    second = np.array([o == 2 for o, count, _, _ in rows.blocks for _ in range(count)])

    @compiled(types.void(BUFFER), *astuple(rows), first, *variant)
    def part(s):  # type: ignore[no-untyped-def]
        # One step of the run's own pair in the buffer of one lane, from (time, start)
        # to (time + step, stage).
        h = s[step]
        for n in range(stages):
            s[stage_time] = s[time] + nodes[n] * h
            for p in range(M):
                x, v, own_ = start + state_of[p], start + state_of[p] + 1, stage + state_of[p]
                rate = bend = 0.0
                for m in range(n + 1):
                    rate += rates[n, m] * s[slopes[m] + p]
                    bend += positions[n, m] * s[slopes[m] + p]
                if apart and push_of[p] >= 0:
                    for m in range(n + 1):
                        rate += more_rates[n, m] * s[pushes[m] + push_of[p]]
                        bend += more_positions[n, m] * s[pushes[m] + push_of[p]]
                if second[p]:
                    s[own_] = s[x] + h * (nodes[n] * (s[v] + s[frame_rate + p]) + h * bend)
                    s[own_ + 1] = s[v] + h * rate
                else:
                    s[own_] = s[x] + h * rate
            if apart:
                s[relax] = diagonal * h
            if apart or n < stages - 1:
                tangent(s)
            if n < stages - 1:
                for p in range(M):
                    s[slopes[n + 1] + p] = s[slope + p]
                for p in range(A - M):
                    s[pushes[n + 1] + p] = s[slope + M + p]
        if apart:
            s[relax] = 0.0  # what follows is asked at the velocities as they are

    @compiled(types.void(BUFFER, BUFFER, types.int64), W, *astuple(rows), first, *variant)
    def mend(b, s, i):  # type: ignore[no-untyped-def]
        # Lane i alone: its step in parts between the zeros of the contact functions.
        h = b[step * W + i]
        found = 0
        for c in range(contacts if h > 0.0 else 0):
            k0, k1 = (before + RATES * c) * W + i, (now + RATES * c) * W + i
            g0, d0, c0 = b[k0], b[k0 + W], b[k0 + 2 * W]
            g1, d1, c1 = b[k1], b[k1 + W], b[k1 + 2 * W]
            p0, p1, p2, p3, p4, p5 = quintic(g0, h * d0, h * h * c0, g1, h * d1, h * h * c1)
            s[before + RATES * c] = g0
            s[zeros + ROOTS * c] = OVER
            s[zeros + ROOTS * c + 1] = OVER
            if (g0 > 0.0) != (g1 > 0.0):
                s[zeros + ROOTS * c] = crossing(p0, p1, p2, p3, p4, p5, 0.0, 1.0)
                found += 1
            elif (d0 > 0.0) != (d1 > 0.0) and (d0 > 0.0) != (g0 > 0.0):
                turn = extreme(p1, p2, p3, p4, p5, h * d1)
                if (value(p0, p1, p2, p3, p4, p5, turn) > 0.0) != (g0 > 0.0):
                    s[zeros + ROOTS * c] = crossing(p0, p1, p2, p3, p4, p5, 0.0, turn)
                    s[zeros + ROOTS * c + 1] = crossing(p0, p1, p2, p3, p4, p5, turn, 1.0)
                    found += 2
        if found == 0 and h > 0.0:
            return
        s[phase] = b[phase * W + i]
        for j in range(P):
            s[parameter + j] = b[(parameter + j) * W + i]
        for j in range(N):
            s[start + j] = b[(start + j) * W + i]
        for p in range(M):
            s[frame_rate + p] = b[(frame_rate + p) * W + i]
        for p in range(A):
            s[slope_start + p] = b[(slope_start + p) * W + i]
        if apart:
            s[relax] = 0.0
        at, begun = 0.0, b[time * W + i]
        s[time] = begun
        for _ in range(found):
            which = 0
            for k in range(ROOTS * contacts):
                if s[zeros + k] < s[zeros + which]:
                    which = k
            s[step] = h * (s[zeros + which] - at)
            part(s)
            at = s[zeros + which]
            s[zeros + which] = OVER
            s[time] = begun + h * at
            s[stage_time] = s[time]
            s[before + RATES * (which // ROOTS)] *= -1.0  # the contact changes
            tangent(s)
            for j in range(N):
                s[start + j] = s[stage + j]
            for p in range(A):
                s[slope_start + p] = s[slope + p]
        if h > 0.0:
            s[step] = h * (1.0 - at)
            part(s)
            for j in range(own, N):
                b[(stage + j) * W + i] = s[stage + j]
        # The next step begins with the accelerations at the run's own end, and with the
        # contacts there.
        for j in range(N):
            s[stage + j] = b[(stage + j) * W + i]
        s[stage_time] = begun + h
        for c in range(contacts):
            s[before + RATES * c] = b[(now + RATES * c) * W + i]
        tangent(s)
        for p in range(own_slopes, M):
            b[(slope + p) * W + i] = s[slope + p]
        for p in range(M + own_pushes, A):
            b[(slope + p) * W + i] = s[slope + p]

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows), first, *variant)
    def landing(b, store):  # type: ignore[no-untyped-def]
        measure(b)
        due = 0
        for i in range(W):
            # A contact function changes its sign, or turns on its way to zero. A step
            # of no length shows the start of a run, whose accelerations were made with
            # the contacts of the run before.
            wanted = b[step * W + i] == 0.0
            for k in range(0, of_contacts * W, RATES * W):
                g0, d0 = b[before * W + k + i], b[(before + 1) * W + k + i]
                g1, d1 = b[now * W + k + i], b[(now + 1) * W + k + i]
                wanted |= (g0 > 0.0) != (g1 > 0.0) or (
                    (d0 > 0.0) != (d1 > 0.0) and (d0 > 0.0) != (g0 > 0.0)
                )
            due |= (1 << i) if wanted and b[moves * W + i] != 0.0 else 0
        while due != 0:
            i = lowest_bit(due)
            due &= due - 1
            mend(b, store[len(store) - size :], i)
        for i in range(W):
            moved = b[moves * W + i] != 0.0
            for k in range(0, of_contacts * W, W):
                old, new = b[before * W + k + i], b[now * W + k + i]
                b[before * W + k + i] = new if moved else old

    return landing
