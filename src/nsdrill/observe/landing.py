"""Small deviations across contacts: steps in which a contact begins or ends are
repeated in parts that end at the contact's changes.

Where a contact begins or ends the Jacobian is discontinuous, and a Runge-Kutta step
over the discontinuity integrates a deviation to first order in the step only. The run
itself keeps its accuracy, as its vector field is continuous. So its steps stay as they
are, and after each of them only the deviation is corrected. Within a step the tangent
dynamics keeps every contact as it was at the start of the step. If one changes inside,
at a zero of its function on the continuous solution, the step is repeated for that
lane in parts between these zeros, and the deviation at the end replaces that of the
step.

A model defines its contacts by functions of state and time that are positive where the
contact is closed.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import OBSERVER, RATES, Rows
from nsdrill.compiler.functions import BUFFER, INTEGER, compiled
from nsdrill.compiler.words import lowest_bit, packed
from nsdrill.kernel.scheme import Scheme
from nsdrill.observe.interpolant import crossing, extreme, quintic, value

MAX_ZEROS = 2  # zeros of a contact function in a step, at most
NO_ZERO = 2.0  # a theta outside the step


def landing_rows(contacts: int) -> int:
    """The number of rows of the observer: each contact function and its rates at the
    start of the step, then at its end."""
    return 2 * RATES * contacts


def scratch_size(rows: Rows, contacts: int) -> int:
    """The number of entries at the end of the store: the buffer of one lane, and the
    zeros of the contact functions."""
    return rows.total + MAX_ZEROS * contacts


def _no_landing(lanes: int, rows: Rows, first: int, *variant: int) -> Any:
    """The observer of a model without contacts."""

    @compiled(OBSERVER)
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
    """The compiled observer that corrects the deviations, which are the tangent states.

    ``first`` is the position of its rows among those of the observer. ``measure(b)``
    writes the contact functions and their rates at the end of the step to the second
    half of them. The right-hand side ``tangent(b)``, of one lane, takes a contact as
    closed if the value in the first half is positive. ``scheme`` is that of the run's
    stepper. ``variant`` distinguishes models and steppers.
    """
    if not contacts:
        return _no_landing(lanes, rows, first, *variant)
    W, N, M, own, P = lanes, rows.states, rows.slopes, rows.own, rows.parameters
    contact_rows = RATES * contacts
    at_start, zeros = rows.observer + first, rows.total
    at_end = at_start + contact_rows
    stage, start, slope, slope_start, frame_rate = (
        rows.stage,
        rows.start,
        rows.acceleration,
        rows.start_acceleration,
        rows.frame_rate,
    )
    parameter, phase, stage_time = rows.parameter, rows.phase, rows.stage_time
    time, step, moves = rows.time, rows.step, rows.moves
    scratch = scratch_size(rows, contacts)
    nodes, rates, positions = scheme.nodes, scheme.rates, scheme.positions
    slopes, pushes = np.array(scheme.slopes), np.array(scheme.pushes, np.int64)
    push_rates, push_positions = scheme.push_rates, scheme.push_positions
    stages, diagonal = len(rates), scheme.diagonal
    # The push of each slope, -1 where it has none.
    push_of = np.array([rows.pushed.index(p) if p in rows.pushed else -1 for p in range(M)])
    own_slopes = rows.own_slopes
    relax, implicit, A = rows.relax, rows.implicit != 0, M + len(rows.pushed)
    own_pushes = len(rows.pushed) // 2
    # The first state of each slope, and whether it is a position, which its velocity
    # follows.
    state_of = np.array([f + o * k for o, count, f, _ in rows.blocks for k in range(count)], np.int64)
    has_velocity = np.array([o == 2 for o, count, _, _ in rows.blocks for _ in range(count)])

    @compiled(BUFFER)
    def integrate_part(s):  # type: ignore[no-untyped-def]
        # One step of the run's stepper in the buffer of one lane, from (time, start) to
        # (time + step, stage).
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
                        rate += push_rates[n, m] * s[pushes[m] + push_of[p]]
                        position_change += push_positions[n, m] * s[pushes[m] + push_of[p]]
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
                for p in range(M):
                    s[slopes[n + 1] + p] = s[slope + p]
                for p in range(A - M):
                    s[pushes[n + 1] + p] = s[slope + M + p]
        if implicit:
            s[relax] = 0.0  # further evaluations are at the given velocities

    @compiled(BUFFER, BUFFER, INTEGER)
    def correct(b, s, i):  # type: ignore[no-untyped-def]
        # Repeat the step of lane i in parts between the zeros of the contact functions.
        h = b[step * W + i]
        crossings = 0
        for c in range(contacts if h > 0.0 else 0):
            k0, k1 = (at_start + RATES * c) * W + i, (at_end + RATES * c) * W + i
            g0, d0, c0 = b[k0], b[k0 + W], b[k0 + 2 * W]
            g1, d1, c1 = b[k1], b[k1 + W], b[k1 + 2 * W]
            p0, p1, p2, p3, p4, p5 = quintic(g0, h * d0, h * h * c0, g1, h * d1, h * h * c1)
            s[at_start + RATES * c] = g0
            s[zeros + MAX_ZEROS * c] = NO_ZERO
            s[zeros + MAX_ZEROS * c + 1] = NO_ZERO
            if (g0 > 0.0) != (g1 > 0.0):
                s[zeros + MAX_ZEROS * c] = crossing(p0, p1, p2, p3, p4, p5, 0.0, 1.0)
                crossings += 1
            elif (d0 > 0.0) != (d1 > 0.0) and (d0 > 0.0) != (g0 > 0.0):
                extremum = extreme(p1, p2, p3, p4, p5, h * d1)
                if (value(p0, p1, p2, p3, p4, p5, extremum) > 0.0) != (g0 > 0.0):
                    s[zeros + MAX_ZEROS * c] = crossing(p0, p1, p2, p3, p4, p5, 0.0, extremum)
                    s[zeros + MAX_ZEROS * c + 1] = crossing(p0, p1, p2, p3, p4, p5, extremum, 1.0)
                    crossings += 2
        if crossings == 0 and h > 0.0:
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
        if implicit:
            s[relax] = 0.0
        theta, start_time = 0.0, b[time * W + i]
        s[time] = start_time
        for _ in range(crossings):
            contact_zero = 0
            for k in range(MAX_ZEROS * contacts):
                if s[zeros + k] < s[zeros + contact_zero]:
                    contact_zero = k
            s[step] = h * (s[zeros + contact_zero] - theta)
            integrate_part(s)
            theta = s[zeros + contact_zero]
            s[zeros + contact_zero] = NO_ZERO
            s[time] = start_time + h * theta
            s[stage_time] = s[time]
            s[at_start + RATES * (contact_zero // MAX_ZEROS)] *= -1.0  # the contact changes
            tangent(s)
            for j in range(N):
                s[start + j] = s[stage + j]
            for p in range(A):
                s[slope_start + p] = s[slope + p]
        if h > 0.0:
            s[step] = h * (1.0 - theta)
            integrate_part(s)
            for j in range(own, N):
                b[(stage + j) * W + i] = s[stage + j]
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

    @compiled(OBSERVER)
    def landing(b, store):  # type: ignore[no-untyped-def]
        measure(b)
        due = 0
        for i in packed(W):
            # A contact function changes its sign, or has an extremum towards zero. A
            # step of length zero is the start of a run, whose accelerations were
            # computed with the contacts of the run before.
            needs_correction = b[step * W + i] == 0.0
            for k in range(0, contact_rows * W, RATES * W):
                g0, d0 = b[at_start * W + k + i], b[(at_start + 1) * W + k + i]
                g1, d1 = b[at_end * W + k + i], b[(at_end + 1) * W + k + i]
                needs_correction |= (g0 > 0.0) != (g1 > 0.0) or ((d0 > 0.0) != (d1 > 0.0) and (d0 > 0.0) != (g0 > 0.0))
            due |= (1 << i) if needs_correction and b[moves * W + i] != 0.0 else 0
        while due != 0:
            i = lowest_bit(due)
            due &= due - 1
            correct(b, store[len(store) - scratch :], i)
        for i in packed(W):
            accepted = b[moves * W + i] != 0.0
            for k in range(0, contact_rows * W, W):
                old, new = b[at_start * W + k + i], b[at_end * W + k + i]
                b[at_start * W + k + i] = new if accepted else old

    return landing
