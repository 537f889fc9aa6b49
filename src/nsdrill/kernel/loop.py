"""The loop over packed steps: fill the lanes, step, handle marks and ends, refill.

Runs are stored in *slots*, rows of a few arrays of
:class:`nsdrill.kernel.batch.Batch`. A lane takes a slot from the queue. When its run
ends, it continues with the slot's successor, from the state reached, or takes the next
slot from the queue at once, independently of the other lanes. Work for a single lane is
rare and scalar.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from nsdrill.abi import CLOSES, CONTROL, LIMIT, MARK, NONFINITE, OPENS, Rows
from nsdrill.compiler.functions import BUFFER, FUNCTION, INTEGER, INTEGERS, compiled, inlined
from nsdrill.compiler.words import call
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT, STEP_UNDERFLOW

# Columns of the slot table after the model's parameters, the natural scales of the
# states and the positions' frame rates.
SETTINGS = ("phase_rate", "first_step", "least_step", "per_rtol", "limit", "opens", "halves", "closes")
# Columns of the outbox before the final state and the observer's.
RUN_COLUMNS = ("status", "accepted", "rejected")
# Entries of the counters.
QUEUE_NEXT, QUEUE_END, FINISHED, PACKED_STEPS, LANE_STEPS, COUNTERS = range(6)

TWO_PI = 2.0 * math.pi


@inlined
def commit_step(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_):  # type: ignore[no-untyped-def]
    """Commit the accepted step of lane i now: the stepper would do it at the beginning
    of the next step. ``W`` lanes, ``N`` states, ``A`` slopes and pushes; then the
    offsets of rows in the buffer."""
    if b[moves_ + i] != 0.0:
        b[moves_ + i] = 0.0
        b[t_ + i] = b[t_ + i] + b[h_ + i]
        for j in range(N):
            b[y_ + j * W + i] = b[stage_ + j * W + i]
        for j in range(A):
            b[a1_ + j * W + i] = b[acceleration_ + j * W + i]


_RATE, _FIRST, _LEAST, _PER_RTOL, _LIMIT, _OPENS = (
    SETTINGS.index(name) for name in ("phase_rate", "first_step", "least_step", "per_rtol", "limit", "opens")
)


class Places(NamedTuple):
    """Where a run is in the lane buffer and in the tables of the slots: counts, offsets
    of rows (names that end in ``_``), and columns.

    The loop is compiled once for all layouts, as its work for a lane is rare, unlike
    that of the stepper.
    """

    lanes: int
    states: int
    slopes: int
    slopes_and_pushes: int  # which are adjacent
    parameters: int
    carried: int  # states that are carried along a chain
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
    observing_: int
    scale_: int
    frame_rate_: int
    relax_: int  # -1 without implicit friction
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
    setting: int  # the column of the first of SETTINGS
    table_columns: int
    outbox_columns: int


AT = Places(*range(len(Places._fields)))  # where each of them is in the loop's argument


@lru_cache
def places_of(lanes: int, rows: Rows, outbox_columns: int) -> np.ndarray:
    """The places for a number of lanes and a row layout, in an array."""
    offsets = {
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
            "observing_": rows.observing,
            "scale_": rows.scale,
            "frame_rate_": rows.frame_rate,
            **{f"{name}_": rows.control + i for i, name in enumerate(CONTROL) if f"{name}_" in Places._fields},
        }.items()
    }
    setting = rows.parameters + rows.states + rows.slopes
    places = Places(
        lanes=lanes,
        states=rows.states,
        slopes=rows.slopes,
        slopes_and_pushes=rows.slopes + len(rows.pushed),
        parameters=rows.parameters,
        carried=rows.own,
        relax_=lanes * rows.relax if rows.implicit else -1,
        setting=setting,
        table_columns=setting + len(SETTINGS),
        outbox_columns=outbox_columns,
        **offsets,
    )
    return np.array(places, dtype=np.int64)


@lru_cache
def make_advance() -> Any:
    """The compiled loop.

    ``advance(places, lane, successor, queue, finished, counters, buffer, store, table,
    state, outbox, drain, budget, right_hand_side, observer, marker, stepper)`` makes at
    most ``budget`` packed steps. It returns early when all lanes are idle, or, unless
    ``drain`` is 1, when more lanes are idle than at first. A run that fails does not
    end its chain: the next one then starts from the state stored in its own slot.
    Tables are flat, row after row.

    ====================  ==========================================================
    ``lane``              [3 lanes]: slot (-1: idle), next mark, 1 if just loaded
    ``successor``         [slots]: the next slot of the chain, -1 at its end
    ``queue``             [slots]: ring of slots that begin a chain
    ``finished``          [slots]: the slots of runs that ended
    ``table``             [slots, columns]: parameters, scales, frame rates, SETTINGS
    ``state``             [slots, states + 1]: where each run starts, the phase last
    ``outbox``            [slots, columns]: RUN_COLUMNS, final state, phase, observer
    ====================  ==========================================================
    """
    state_column = len(RUN_COLUMNS)

    @compiled(*[INTEGERS] * 6, *[BUFFER] * 5, INTEGER, INTEGER, *[FUNCTION] * 4)
    def advance(  # type: ignore[no-untyped-def]
        places,
        lane,
        successor,
        queue,
        finished,
        counters,
        b,
        store,
        table,
        state,
        outbox,
        drain,
        budget,
        right_hand_side,
        observer,
        marker,
        stepper,
    ):
        W, N, M, A, P, carried = (
            places[AT.lanes],
            places[AT.states],
            places[AT.slopes],
            places[AT.slopes_and_pushes],
            places[AT.parameters],
            places[AT.carried],
        )
        stage_, acceleration_, t_stage_, phase_, parameter_ = (
            places[AT.stage_],
            places[AT.acceleration_],
            places[AT.t_stage_],
            places[AT.phase_],
            places[AT.parameter_],
        )
        y_, a1_, t_, h_, moves_, observing_ = (
            places[AT.y_],
            places[AT.a1_],
            places[AT.t_],
            places[AT.h_],
            places[AT.moves_],
            places[AT.observing_],
        )
        table_columns, outbox_columns = places[AT.table_columns], places[AT.outbox_columns]
        setting_column, observer_column = places[AT.setting], state_column + N + 1
        refill = True
        idle_at_first = -1
        for _ in range(budget):
            if refill:
                refill = False
                idle = 0
                any_loaded = False
                for i in range(W):
                    if lane[i] < 0 and counters[QUEUE_NEXT] < counters[QUEUE_END]:
                        lane[i] = queue[counters[QUEUE_NEXT] % len(queue)]
                        counters[QUEUE_NEXT] += 1
                        lane[2 * W + i] = 1
                    slot = lane[i]
                    if slot < 0:
                        idle += 1
                    elif lane[2 * W + i] == 1:
                        any_loaded = True
                        row, start = slot * table_columns, slot * (N + 1)
                        setting = row + setting_column
                        for j in range(P):
                            b[parameter_ + j * W + i] = table[row + j]
                        b[phase_ + i] = np.fmod(state[start + N], TWO_PI)
                        for j in range(N):
                            b[y_ + j * W + i] = state[start + j]
                            b[places[AT.scale_] + j * W + i] = table[row + P + j]
                        for j in range(M):
                            b[places[AT.frame_rate_] + j * W + i] = table[row + P + N + j]
                        b[t_ + i] = 0.0
                        b[moves_ + i] = 0.0
                        b[observing_ + i] = 0.0
                        b[places[AT.proposed_] + i] = table[setting + _FIRST]
                        b[places[AT.least_step_] + i] = table[setting + _LEAST]
                        b[places[AT.per_rtol_] + i] = table[setting + _PER_RTOL]
                        b[places[AT.limit_] + i] = table[setting + _LIMIT]
                        b[places[AT.last_error_] + i] = 0.0
                        b[places[AT.growth_] + i] = 0.0
                        b[places[AT.accepted_] + i] = 0.0
                        b[places[AT.rejected_] + i] = 0.0
                        b[places[AT.running_] + i] = 1.0
                        lane[W + i] = OPENS
                        b[places[AT.mark_time_] + i] = table[setting + _OPENS]
                if any_loaded:
                    for i in range(W):
                        commit_step(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_)
                    # Slopes at the start of the loaded runs. They are computed for all
                    # lanes and stored for the loaded ones.
                    for j in range(N * W):
                        b[stage_ + j] = b[y_ + j]
                    for i in range(W):
                        b[t_stage_ + i] = b[t_ + i]
                        if places[AT.relax_] >= 0:
                            b[places[AT.relax_] + i] = 0.0
                    call(right_hand_side, b)
                    for i in range(W):
                        b[moves_ + i] = float(lane[2 * W + i])
                        b[h_ + i] = 0.0
                    # A step of length zero: the start of the loaded runs, before their
                    # observation.
                    call(observer, b, store)
                    for i in range(W):
                        b[moves_ + i] = 0.0
                        if lane[2 * W + i] == 1:
                            lane[2 * W + i] = 0
                            slot = lane[i]
                            for j in range(A):
                                b[a1_ + j * W + i] = b[acceleration_ + j * W + i]
                            # without a transient the observation begins at once
                            if b[places[AT.mark_time_] + i] <= 0.0:
                                out = outbox[slot * outbox_columns : (slot + 1) * outbox_columns]
                                call(marker, b, store, i, OPENS, out, observer_column)
                                b[observing_ + i] = 1.0
                                lane[W + i] = OPENS + 1
                                setting = slot * table_columns + setting_column
                                b[places[AT.mark_time_] + i] = table[setting + _OPENS + 1]
                if idle_at_first < 0:
                    idle_at_first = idle
                if idle == W or (idle > idle_at_first and drain == 0):
                    break
            counters[PACKED_STEPS] += 1
            if call(stepper, b, right_hand_side, observer, store) == 0:
                continue
            refill = True
            for i in range(W):
                attention = b[places[AT.attention_] + i]
                if attention == 0.0:
                    continue
                slot = lane[i]
                setting = slot * table_columns + setting_column
                out = outbox[slot * outbox_columns : (slot + 1) * outbox_columns]
                commit_step(b, i, W, N, A, moves_, y_, stage_, a1_, acceleration_, t_, h_)
                if attention == MARK:
                    b[t_ + i] = b[places[AT.mark_time_] + i]
                    mark = lane[W + i]
                    call(marker, b, store, i, mark, out, observer_column)
                    if mark != CLOSES:
                        b[observing_ + i] = 1.0
                        lane[W + i] = mark + 1
                        b[places[AT.mark_time_] + i] = table[setting + _OPENS + mark + 1]
                        continue
                    status = OK
                elif attention == LIMIT:
                    status = STEP_LIMIT
                elif attention == NONFINITE:
                    status = DIVERGED
                else:
                    status = STEP_UNDERFLOW
                # The run is over: fill its row of the outbox, then continue the chain.
                accepted, rejected = b[places[AT.accepted_] + i], b[places[AT.rejected_] + i]
                out[0], out[1], out[2] = float(status), accepted, rejected
                for j in range(N):
                    out[state_column + j] = b[y_ + j * W + i]
                phase = state[slot * (N + 1) + N] + table[setting + _RATE] * b[t_ + i]
                out[state_column + N] = phase
                finished[counters[FINISHED]] = slot
                counters[FINISHED] += 1
                counters[LANE_STEPS] += int(accepted + rejected)
                b[observing_ + i] = 0.0
                next_slot = successor[slot]
                if next_slot >= 0:
                    # after a failure the next run starts from the state in its own slot
                    if status == OK:
                        start = next_slot * (N + 1)
                        for j in range(carried):
                            state[start + j] = b[y_ + j * W + i]
                        state[start + N] = phase
                    lane[i] = next_slot
                    lane[2 * W + i] = 1
                else:
                    lane[i] = -1
                    b[places[AT.running_] + i] = 0.0
                    # an idle lane makes steps of length zero
                    b[places[AT.mark_time_] + i] = b[t_ + i]

    return advance
