"""The loop over packed steps: fill the lanes, step, attend to marks and ends, refill.

Runs wait in *slots*, rows of a few arrays made by :class:`nsdrill.kernel.gang.Gang`. A lane takes a slot from the
queue; when its run ends it goes on with the slot's successor, starting from the state it has reached, or takes the next
one from the queue at once, whatever its neighbours do. The work for one lane is rare and scalar.
"""

from __future__ import annotations

import math
from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import (
    BUFFER,
    CLOSES,
    CONTROL,
    LIMIT,
    MARK,
    MARKER,
    NONFINITE,
    OBSERVER,
    OPENS,
    RIGHT_HAND_SIDE,
    STEPPER,
    Rows,
    compiled,
    inlined,
)  # fmt: skip
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT, STEP_UNDERFLOW

# Columns of the slot table after the model's parameters, the states' sizes and the positions' drifts.
SETTINGS = ("phase_rate", "first_step", "least_step", "per_rtol", "limit", "opens", "halves", "closes")
# Columns of the outbox before the observer's.
REPORT = ("status", "accepted", "rejected")
# Entries of the counters.
QUEUE_NEXT, QUEUE_END, FINISHED, PACKED_STEPS, LANE_STEPS, COUNTERS = range(6)

TWO_PI = 2.0 * math.pi
_TABLE = types.float64[:, ::1]
_INDICES = types.int64[::1]


@inlined
def move_on(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_):  # type: ignore[no-untyped-def]
    """Let lane i take its accepted step now, which the stepper would do when the next step begins."""
    if b[moves_ + i] != 0.0:
        b[moves_ + i] = 0.0
        b[t_ + i] = b[t_ + i] + b[h_ + i]
        for j in range(N):
            b[y_ + j * W + i] = b[stage_ + j * W + i]
        for j in range(A):
            b[a1_ + j * W + i] = b[acceleration_ + j * W + i]


@lru_cache
def make_advance(lanes: int, rows: Rows) -> Any:
    """The compiled loop for a number of lanes and a row layout.

    ``advance(buffer, store, lane, table, state, successor, queue, outbox, finished, counters, drain, budget,
    right_hand_side, observer, marker, stepper)`` makes at most ``budget`` packed steps. It returns early when all lanes
    are idle, or, unless ``drain``, when one more than at first is. A run that fails does not end its chain: the next
    one then starts from the state laid down in its own slot.
    """
    W, N, M, P, own = lanes, rows.states, rows.slopes, rows.parameters, rows.own
    A = M + len(rows.pushed)  # slopes and pushes stand together
    apart, relax_ = rows.apart != 0, W * rows.relax
    stage_, acceleration_, t_stage_, phase_ = (
        W * r for r in (rows.stage, rows.acceleration, rows.stage_time, rows.phase)
    )
    parameter_, y_, a1_, t_, h_, moves_, window_ = (
        W * r
        for r in (rows.parameter, rows.start, rows.start_acceleration, rows.time, rows.step, rows.moves, rows.window)
    )
    size_, drift_ = W * rows.size, W * rows.drift
    row = {name: W * (rows.control + i) for i, name in enumerate(CONTROL)}
    proposed_, mark_, last_, growth_, per_rtol_, least_ = (
        row[n] for n in ("proposed", "mark_time", "last_error", "growth", "per_rtol", "least_step")
    )
    accepted_, rejected_, limit_, running_, attention_ = (
        row[n] for n in ("accepted", "rejected", "limit", "running", "attention")
    )
    setting = {name: P + N + M + i for i, name in enumerate(SETTINGS)}
    rate_c, first_c, least_c, per_rtol_c, limit_c, opens_c = (
        setting[n] for n in ("phase_rate", "first_step", "least_step", "per_rtol", "limit", "opens")
    )
    report_state = len(REPORT)
    report_observed = report_state + N + 1

    @compiled(
        types.void(
            BUFFER,
            BUFFER,
            _INDICES,
            _TABLE,
            _TABLE,
            _INDICES,
            _INDICES,
            _TABLE,
            _INDICES,
            _INDICES,
            types.boolean,
            types.int64,
            RIGHT_HAND_SIDE,
            OBSERVER,
            MARKER,
            STEPPER,
        ),
        W,
        *astuple(rows),
    )
    def advance(  # type: ignore[no-untyped-def]
        b,
        store,
        lane,
        table,
        state,
        successor,
        queue,
        outbox,
        finished,
        counters,
        drain,
        budget,
        right_hand_side,
        observer,
        marker,
        stepper,
    ):
        # lane[i] is the slot of lane i (-1: idle), lane[W + i] its next mark, lane[2 W + i] whether it was just loaded.
        refill = True
        idle_at_first = -1
        for _ in range(budget):
            if refill:
                refill = False
                idle = 0
                fresh = False
                for i in range(W):
                    if lane[i] < 0 and counters[QUEUE_NEXT] < counters[QUEUE_END]:
                        lane[i] = queue[counters[QUEUE_NEXT] % len(queue)]
                        counters[QUEUE_NEXT] += 1
                        lane[2 * W + i] = 1
                    slot = lane[i]
                    if slot < 0:
                        idle += 1
                    elif lane[2 * W + i] == 1:
                        fresh = True
                        for j in range(P):
                            b[parameter_ + j * W + i] = table[slot, j]
                        b[phase_ + i] = np.fmod(state[slot, N], TWO_PI)
                        for j in range(N):
                            b[y_ + j * W + i] = state[slot, j]
                            b[size_ + j * W + i] = table[slot, P + j]
                        for j in range(M):
                            b[drift_ + j * W + i] = table[slot, P + N + j]
                        b[t_ + i] = 0.0
                        b[moves_ + i] = 0.0
                        b[window_ + i] = 0.0
                        b[proposed_ + i] = table[slot, first_c]
                        b[least_ + i] = table[slot, least_c]
                        b[per_rtol_ + i] = table[slot, per_rtol_c]
                        b[limit_ + i] = table[slot, limit_c]
                        b[last_ + i] = 0.0
                        b[growth_ + i] = 0.0
                        b[accepted_ + i] = 0.0
                        b[rejected_ + i] = 0.0
                        b[running_ + i] = 1.0
                        lane[W + i] = OPENS
                        b[mark_ + i] = table[slot, opens_c]
                if fresh:
                    for i in range(W):
                        move_on(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_)
                    # Accelerations at the new states. All lanes are computed, the new ones keep the result.
                    for j in range(N * W):
                        b[stage_ + j] = b[y_ + j]
                    for i in range(W):
                        b[t_stage_ + i] = b[t_ + i]
                        if apart:
                            b[relax_ + i] = 0.0
                    right_hand_side(b)
                    for i in range(W):
                        b[moves_ + i] = float(lane[2 * W + i])
                        b[h_ + i] = 0.0
                    observer(b, store)  # shows the new lanes where they start; no window is open there
                    for i in range(W):
                        b[moves_ + i] = 0.0
                        if lane[2 * W + i] == 1:
                            lane[2 * W + i] = 0
                            for j in range(A):
                                b[a1_ + j * W + i] = b[acceleration_ + j * W + i]
                            if b[mark_ + i] <= 0.0:  # no transient: the window opens at once
                                marker(b, store, i, OPENS, outbox[lane[i]], report_observed)
                                b[window_ + i] = 1.0
                                lane[W + i] = OPENS + 1
                                b[mark_ + i] = table[lane[i], opens_c + 1]
                if idle_at_first < 0:
                    idle_at_first = idle
                if idle == W or (idle > idle_at_first and not drain):
                    break
            counters[PACKED_STEPS] += 1
            if stepper(b, right_hand_side, observer, store) == 0:
                continue
            refill = True
            for i in range(W):
                attention = b[attention_ + i]
                if attention == 0.0:
                    continue
                slot = lane[i]
                move_on(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_)
                if attention == MARK:
                    b[t_ + i] = b[mark_ + i]
                    mark = lane[W + i]
                    marker(b, store, i, mark, outbox[slot], report_observed)
                    if mark != CLOSES:
                        b[window_ + i] = 1.0
                        lane[W + i] = mark + 1
                        b[mark_ + i] = table[slot, opens_c + mark + 1]
                        continue
                    status = OK
                elif attention == LIMIT:
                    status = STEP_LIMIT
                elif attention == NONFINITE:
                    status = DIVERGED
                else:
                    status = STEP_UNDERFLOW
                # The run is over: report, then go on along the chain.
                outbox[slot, 0] = status
                outbox[slot, 1] = b[accepted_ + i]
                outbox[slot, 2] = b[rejected_ + i]
                for j in range(N):
                    outbox[slot, report_state + j] = b[y_ + j * W + i]
                phase = state[slot, N] + table[slot, rate_c] * b[t_ + i]
                outbox[slot, report_state + N] = phase
                finished[counters[FINISHED]] = slot
                counters[FINISHED] += 1
                counters[LANE_STEPS] += int(b[accepted_ + i] + b[rejected_ + i])
                b[window_ + i] = 0.0
                following = successor[slot]
                if following >= 0:
                    if status == OK:  # else the next one starts from the state that waits in its slot
                        for j in range(own):
                            state[following, j] = b[y_ + j * W + i]
                        state[following, N] = phase
                    lane[i] = following
                    lane[2 * W + i] = 1
                else:
                    lane[i] = -1
                    b[running_ + i] = 0.0
                    b[mark_ + i] = b[t_ + i]  # no time left: the idle lane steps by nothing

    return advance
