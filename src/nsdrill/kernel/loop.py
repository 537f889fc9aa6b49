"""The loop over packed steps: fill the lanes, step, attend to marks and ends, refill.

Runs wait in *slots*, rows of a few arrays made by :class:`nsdrill.kernel.batch.Batch`.
A lane takes a slot from the queue; when its run ends it goes on with the slot's
successor, starting from the state it has reached, or takes the next one from the queue
at once, whatever its neighbours do. The work for one lane is rare and scalar.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

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
)
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT, STEP_UNDERFLOW

# Columns of the slot table after the model's parameters, the natural scales of the
# states and the positions' frame rates.
SETTINGS = (
    "phase_rate",
    "first_step",
    "least_step",
    "per_rtol",
    "limit",
    "opens",
    "halves",
    "closes",
)
# Columns of the outbox before the observer's.
REPORT = ("status", "accepted", "rejected")
# Entries of the counters.
QUEUE_NEXT, QUEUE_END, FINISHED, PACKED_STEPS, LANE_STEPS, COUNTERS = range(6)

TWO_PI = 2.0 * math.pi
_TABLE = types.float64[:, ::1]
_INDICES = types.int64[::1]


@inlined
def move_on(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_):  # type: ignore[no-untyped-def]
    """Let lane i take its accepted step now, which the stepper would do when the next
    step begins."""
    if b[moves_ + i] != 0.0:
        b[moves_ + i] = 0.0
        b[t_ + i] = b[t_ + i] + b[h_ + i]
        for j in range(N):
            b[y_ + j * W + i] = b[stage_ + j * W + i]
        for j in range(A):
            b[a1_ + j * W + i] = b[acceleration_ + j * W + i]


_RATE, _FIRST, _LEAST, _PER_RTOL, _LIMIT, _OPENS = (
    SETTINGS.index(name)
    for name in ("phase_rate", "first_step", "least_step", "per_rtol", "limit", "opens")
)


class Places(NamedTuple):
    """Where the loop finds a run in the lane buffer and in the slot table: counts,
    offsets of rows (names that end in ``_``) and columns of the table (in ``_c``). The
    loop is compiled once, for every layout: what it does for a lane is rare, unlike
    what the stepper does."""

    lanes: int
    states: int
    slopes: int
    kept: int  # slopes and pushes, which stand together
    parameters: int
    own: int  # states that a chain hands on
    stage_: int
    acceleration_: int
    t_stage_: int
    phase_: int
    parameter_: int
    y_: int
    a1_: int
    t_: int
    h_: int
    moves_: int
    window_: int
    scale_: int
    frame_rate_: int
    relax_: int  # -1 where no friction is kept apart
    proposed_: int
    mark_time_: int
    last_error_: int
    growth_: int
    per_rtol_: int
    least_step_: int
    accepted_: int
    rejected_: int
    limit_: int
    running_: int
    attention_: int
    setting_c: int  # the first of SETTINGS


@lru_cache
def places_of(lanes: int, rows: Rows) -> Places:
    """The places for a number of lanes and a row layout."""
    places = {
        name: lanes * row
        for name, row in {
            "stage_": rows.stage,
            "acceleration_": rows.acceleration,
            "t_stage_": rows.stage_time,
            "phase_": rows.phase,
            "parameter_": rows.parameter,
            "y_": rows.start,
            "a1_": rows.start_acceleration,
            "t_": rows.time,
            "h_": rows.step,
            "moves_": rows.moves,
            "window_": rows.window,
            "scale_": rows.scale,
            "frame_rate_": rows.frame_rate,
            **{
                f"{name}_": rows.control + i
                for i, name in enumerate(CONTROL)
                if f"{name}_" in Places._fields
            },
        }.items()
    }
    return Places(
        lanes=lanes,
        states=rows.states,
        slopes=rows.slopes,
        kept=rows.slopes + len(rows.pushed),
        parameters=rows.parameters,
        own=rows.own,
        relax_=lanes * rows.relax if rows.apart else -1,
        setting_c=rows.parameters + rows.states + rows.slopes,
        **places,
    )


@lru_cache
def make_advance() -> Any:
    """The compiled loop.

    ``advance(places, buffer, store, lane, table, state, successor, queue, outbox,
    finished, counters, drain, budget, right_hand_side, observer, marker,
    stepper)`` makes at most ``budget`` packed steps. It returns early when all lanes
    are idle, or, unless ``drain``, when one more than at first is. A run that fails
    does not end its chain: the next one then starts from the state laid down in its own
    slot.
    """
    report_state = len(REPORT)

    @compiled(
        types.void(
            types.NamedUniTuple(types.int64, len(Places._fields), Places),
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
        )
    )
    def advance(  # type: ignore[no-untyped-def]
        at,
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
        W, N, M, A, P, own = at.lanes, at.states, at.slopes, at.kept, at.parameters, at.own
        stage_, acceleration_, t_stage_, phase_, parameter_ = (
            at.stage_,
            at.acceleration_,
            at.t_stage_,
            at.phase_,
            at.parameter_,
        )
        y_, a1_, t_, h_, moves_, window_ = at.y_, at.a1_, at.t_, at.h_, at.moves_, at.window_
        first_setting, report_observed = at.setting_c, report_state + N + 1
        # lane[i] is the slot of lane i (-1: idle), lane[W + i] its next mark,
        # lane[2 W + i] whether it was just loaded.
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
                            b[at.scale_ + j * W + i] = table[slot, P + j]
                        for j in range(M):
                            b[at.frame_rate_ + j * W + i] = table[slot, P + N + j]
                        b[t_ + i] = 0.0
                        b[moves_ + i] = 0.0
                        b[window_ + i] = 0.0
                        b[at.proposed_ + i] = table[slot, first_setting + _FIRST]
                        b[at.least_step_ + i] = table[slot, first_setting + _LEAST]
                        b[at.per_rtol_ + i] = table[slot, first_setting + _PER_RTOL]
                        b[at.limit_ + i] = table[slot, first_setting + _LIMIT]
                        b[at.last_error_ + i] = 0.0
                        b[at.growth_ + i] = 0.0
                        b[at.accepted_ + i] = 0.0
                        b[at.rejected_ + i] = 0.0
                        b[at.running_ + i] = 1.0
                        lane[W + i] = OPENS
                        b[at.mark_time_ + i] = table[slot, first_setting + _OPENS]
                if fresh:
                    for i in range(W):
                        move_on(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_)
                    # Accelerations at the new states. All lanes are computed, the new
                    # ones keep the result.
                    for j in range(N * W):
                        b[stage_ + j] = b[y_ + j]
                    for i in range(W):
                        b[t_stage_ + i] = b[t_ + i]
                        if at.relax_ >= 0:
                            b[at.relax_ + i] = 0.0
                    right_hand_side(b)
                    for i in range(W):
                        b[moves_ + i] = float(lane[2 * W + i])
                        b[h_ + i] = 0.0
                    # shows the new lanes where they start; no window is open there
                    observer(b, store)
                    for i in range(W):
                        b[moves_ + i] = 0.0
                        if lane[2 * W + i] == 1:
                            lane[2 * W + i] = 0
                            for j in range(A):
                                b[a1_ + j * W + i] = b[acceleration_ + j * W + i]
                            # no transient: the window opens at once
                            if b[at.mark_time_ + i] <= 0.0:
                                marker(b, store, i, OPENS, outbox[lane[i]], report_observed)
                                b[window_ + i] = 1.0
                                lane[W + i] = OPENS + 1
                                b[at.mark_time_ + i] = table[lane[i], first_setting + _OPENS + 1]
                if idle_at_first < 0:
                    idle_at_first = idle
                if idle == W or (idle > idle_at_first and not drain):
                    break
            counters[PACKED_STEPS] += 1
            if stepper(b, right_hand_side, observer, store) == 0:
                continue
            refill = True
            for i in range(W):
                attention = b[at.attention_ + i]
                if attention == 0.0:
                    continue
                slot = lane[i]
                move_on(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_)
                if attention == MARK:
                    b[t_ + i] = b[at.mark_time_ + i]
                    mark = lane[W + i]
                    marker(b, store, i, mark, outbox[slot], report_observed)
                    if mark != CLOSES:
                        b[window_ + i] = 1.0
                        lane[W + i] = mark + 1
                        b[at.mark_time_ + i] = table[slot, first_setting + _OPENS + mark + 1]
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
                outbox[slot, 1] = b[at.accepted_ + i]
                outbox[slot, 2] = b[at.rejected_ + i]
                for j in range(N):
                    outbox[slot, report_state + j] = b[y_ + j * W + i]
                phase = state[slot, N] + table[slot, first_setting + _RATE] * b[t_ + i]
                outbox[slot, report_state + N] = phase
                finished[counters[FINISHED]] = slot
                counters[FINISHED] += 1
                counters[LANE_STEPS] += int(b[at.accepted_ + i] + b[at.rejected_ + i])
                b[window_ + i] = 0.0
                following = successor[slot]
                if following >= 0:
                    # else the next one starts from the state that waits in its slot
                    if status == OK:
                        for j in range(own):
                            state[following, j] = b[y_ + j * W + i]
                        state[following, N] = phase
                    lane[i] = following
                    lane[2 * W + i] = 1
                else:
                    lane[i] = -1
                    b[at.running_ + i] = 0.0
                    b[at.mark_time_ + i] = b[t_ + i]  # no time left: the idle lane steps by nothing

    return advance
