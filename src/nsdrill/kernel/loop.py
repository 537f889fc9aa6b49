"""The loop over packed steps: fill the lanes, step, handle marks and ends, refill.

Runs are stored in *slots*, rows of a few arrays of
:class:`nsdrill.kernel.batch.Batch`. A lane takes a slot from the queue. When its run
ends, it continues with the slot's successor, from the state reached, or takes the next
slot from the queue at once, independently of the other lanes. Work for a single lane is
rare and scalar.
"""

from __future__ import annotations

import math
from collections import namedtuple
from functools import lru_cache

import numpy as np

from nsdrill.abi import CLOSES, CONTROL, LIMIT, MARK, NONFINITE, OPENS, Layout
from nsdrill.compiler.functions import BUFFER, FUNCTION, INTEGER, INTEGERS, LaneFunction, call, compiled, inlined
from nsdrill.elementary import fmod
from nsdrill.kernel.steppers import GROWTH
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT, STEP_UNDERFLOW

# Columns of the slot table after the model's parameters, the natural scales of the
# states and the positions' frame rates.
SETTINGS = ("phase_rate", "first_step", "least_step", "per_rtol", "limit", "opens", "halves", "closes")
# Columns of the outbox before the final state and the observer's.
RUN_COLUMNS = ("status", "accepted", "rejected")
# Entries of the counters.
QUEUE_NEXT, QUEUE_END, FINISHED, PACKED_STEPS, LANE_STEPS, COUNTERS = range(6)

TWO_PI = 2.0 * math.pi


_RATE, _FIRST, _LEAST, _PER_RTOL, _LIMIT, _OPENS = (
    SETTINGS.index(name) for name in ("phase_rate", "first_step", "least_step", "per_rtol", "limit", "opens")
)
_STATE = len(RUN_COLUMNS)  # the first column of the outbox with the final state

# Where a run is in the lane buffer and in the tables of the slots: counts, offsets of
# rows (names that end in ``_``), and columns. The loop is compiled once for all layouts,
# as its work for a lane is rare, unlike that of the stepper.
# ``slopes_and_pushes`` are adjacent; ``carried`` are the states that are carried along a
# chain; ``relax_`` is -1 without implicit friction; ``setting`` is the first of SETTINGS.
Places = namedtuple("Places", (
    "lanes", "states", "slopes", "slopes_and_pushes", "parameters", "carried",
    "stage_", "acceleration_", "stage_time_", "phase_", "parameter_", "start_", "start_acceleration_", "time_",
    "step_", "moves_", "observing_", "scale_", "frame_rate_", "relax_",
    "proposed_", "mark_time_", "last_error_", "growth_", "per_rtol_", "least_step_", "accepted_", "rejected_",
    "limit_", "running_", "attention_",
    "setting", "table_columns", "outbox_columns",
))  # fmt: skip
AT = Places(*range(len(Places._fields)))  # where each of them is in the loop's argument


@lru_cache
def places_of(lanes: int, rows: Layout, outbox_columns: int) -> np.ndarray:
    """The places for a number of lanes and a row layout, in an array."""
    setting = rows.parameters + rows.states + rows.slopes
    known = {
        "lanes": lanes,
        "states": rows.states,
        "slopes": rows.slopes,
        "slopes_and_pushes": rows.slopes + len(rows.pushed),
        "parameters": rows.parameters,
        "carried": rows.own,
        "relax_": lanes * rows.relax if rows.implicit else -1,
        "setting": setting,
        "table_columns": setting + len(SETTINGS),
        "outbox_columns": outbox_columns,
        **{f"{name}_": lanes * (rows.control + i) for i, name in enumerate(CONTROL)},
    }
    places = (known[name] if name in known else lanes * getattr(rows, name[:-1]) for name in Places._fields)
    return np.array([*places], dtype=np.int64)


@inlined
def commit_step(places, b, i):
    """Commit the accepted step of lane i now: the stepper would do it at the beginning
    of the next step."""
    W = places[AT.lanes]
    if b[places[AT.moves_] + i] != 0.0:
        b[places[AT.moves_] + i] = 0.0
        b[places[AT.time_] + i] += b[places[AT.step_] + i]
        for j in range(places[AT.states]):
            b[places[AT.start_] + j * W + i] = b[places[AT.stage_] + j * W + i]
        for j in range(places[AT.slopes_and_pushes]):
            b[places[AT.start_acceleration_] + j * W + i] = b[places[AT.acceleration_] + j * W + i]


@inlined
def fill_lanes(places, lane, queue, counters):
    """Give the idle lanes slots of the queue. Returns how many stay idle, and whether
    some lane has a run that is to be loaded."""
    W, idle, any_new = places[AT.lanes], 0, False
    for i in range(W):
        if lane[i] < 0 and counters[QUEUE_NEXT] < counters[QUEUE_END]:
            lane[i] = queue[counters[QUEUE_NEXT] % len(queue)]
            counters[QUEUE_NEXT] += 1
            lane[2 * W + i] = 1
        if lane[i] < 0:
            idle += 1
        elif lane[2 * W + i] == 1:
            any_new = True
    return idle, any_new


@inlined
def load_run(places, lane, b, table, state, i):
    """Load the run in the slot of lane i into the lane."""
    W, N, P = places[AT.lanes], places[AT.states], places[AT.parameters]
    row, start = lane[i] * places[AT.table_columns], lane[i] * (N + 1)
    setting = row + places[AT.setting]
    for j in range(P):
        b[places[AT.parameter_] + j * W + i] = table[row + j]
    b[places[AT.phase_] + i] = fmod(state[start + N], TWO_PI)
    for j in range(N):
        b[places[AT.start_] + j * W + i] = state[start + j]
        b[places[AT.scale_] + j * W + i] = table[row + P + j]
    for j in range(places[AT.slopes]):
        b[places[AT.frame_rate_] + j * W + i] = table[row + P + N + j]
    for place in (AT.time_, AT.moves_, AT.observing_, AT.last_error_, AT.accepted_, AT.rejected_):
        b[places[place] + i] = 0.0
    # Without a first step of its own the run keeps the one proposed at the end of the
    # run before, an accepted step, after which the step may grow.
    first = table[setting + _FIRST]
    b[places[AT.proposed_] + i] = first if first > 0.0 else b[places[AT.proposed_] + i]
    b[places[AT.growth_] + i] = 0.0 if first > 0.0 else GROWTH
    b[places[AT.least_step_] + i] = table[setting + _LEAST]
    b[places[AT.per_rtol_] + i] = table[setting + _PER_RTOL]
    b[places[AT.limit_] + i] = table[setting + _LIMIT]
    b[places[AT.mark_time_] + i] = table[setting + _OPENS]
    b[places[AT.running_] + i] = 1.0
    lane[W + i] = OPENS


@inlined
def pass_mark(places, lane, b, store, table, outbox, marker, i):
    """Call the marker at the next mark of lane i. Returns which it was."""
    W, slot, mark = places[AT.lanes], lane[i], lane[places[AT.lanes] + i]
    columns = places[AT.outbox_columns]
    out = outbox[slot * columns : (slot + 1) * columns]
    call(marker, b, store, i, mark, out, _STATE + places[AT.states] + 1)
    if mark != CLOSES:
        b[places[AT.observing_] + i] = 1.0
        lane[W + i] = mark + 1
        setting = slot * places[AT.table_columns] + places[AT.setting]
        b[places[AT.mark_time_] + i] = table[setting + _OPENS + mark + 1]
    return mark


@inlined
def begin_runs(places, lane, b, store, table, outbox, right_hand_side, observer, marker):
    """Compute the slopes at the start of the runs just loaded, and show it to the
    observer. They are computed for all lanes and stored for the loaded ones."""
    W, moves_ = places[AT.lanes], places[AT.moves_]
    for i in range(W):
        commit_step(places, b, i)
    for j in range(places[AT.states] * W):
        b[places[AT.stage_] + j] = b[places[AT.start_] + j]
    for i in range(W):
        b[places[AT.stage_time_] + i] = b[places[AT.time_] + i]
        if places[AT.relax_] >= 0:
            b[places[AT.relax_] + i] = 0.0
    call(right_hand_side, b)
    for i in range(W):
        b[moves_ + i] = float(lane[2 * W + i])
        b[places[AT.step_] + i] = 0.0
    # A step of length zero: the start of the loaded runs, before their observation.
    call(observer, b, store)
    for i in range(W):
        b[moves_ + i] = 0.0
        if lane[2 * W + i] == 1:
            lane[2 * W + i] = 0
            for j in range(places[AT.slopes_and_pushes]):
                b[places[AT.start_acceleration_] + j * W + i] = b[places[AT.acceleration_] + j * W + i]
            # without a transient the observation begins at once; a mark of its half may
            # be there, too
            for _ in range(CLOSES):
                if b[places[AT.mark_time_] + i] <= 0.0:
                    pass_mark(places, lane, b, store, table, outbox, marker, i)


@inlined
def end_run(places, lane, successor, finished, counters, b, table, state, outbox, i, status):
    """Fill the row of the outbox of the run in lane i, which is over, and continue its
    chain."""
    W, N, slot = places[AT.lanes], places[AT.states], lane[i]
    setting, out = slot * places[AT.table_columns] + places[AT.setting], slot * places[AT.outbox_columns]
    accepted, rejected = b[places[AT.accepted_] + i], b[places[AT.rejected_] + i]
    outbox[out], outbox[out + 1], outbox[out + 2] = float(status), accepted, rejected
    for j in range(N):
        outbox[out + _STATE + j] = b[places[AT.start_] + j * W + i]
    phase = state[slot * (N + 1) + N] + table[setting + _RATE] * b[places[AT.time_] + i]
    outbox[out + _STATE + N] = phase
    finished[counters[FINISHED]] = slot
    counters[FINISHED] += 1
    counters[LANE_STEPS] += int(accepted + rejected)
    b[places[AT.observing_] + i] = 0.0
    next_slot = successor[slot]
    lane[i] = next_slot
    if next_slot >= 0:
        lane[2 * W + i] = 1
        # after a failure the next run starts from the state in its own slot
        if status == OK:
            start = next_slot * (N + 1)
            for j in range(places[AT.carried]):
                state[start + j] = b[places[AT.start_] + j * W + i]
            state[start + N] = phase
    else:
        b[places[AT.running_] + i] = 0.0
        # an idle lane makes steps of length zero
        b[places[AT.mark_time_] + i] = b[places[AT.time_] + i]


@inlined
def failure(attention):
    """The status of a run that ends for this reason."""
    return STEP_LIMIT if attention == LIMIT else (DIVERGED if attention == NONFINITE else STEP_UNDERFLOW)


def _advance(
    places, lane, successor, queue, finished, counters, b, store, table, state, outbox, drain, budget,
    right_hand_side, observer, marker, stepper,
):  # fmt: skip
    W = places[AT.lanes]
    refill, idle_at_first = True, -1
    for _ in range(budget):
        if refill:
            refill = False
            idle, any_new = fill_lanes(places, lane, queue, counters)
            if any_new:
                for i in range(W):
                    if lane[i] >= 0 and lane[2 * W + i] == 1:
                        load_run(places, lane, b, table, state, i)
                begin_runs(places, lane, b, store, table, outbox, right_hand_side, observer, marker)
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
            commit_step(places, b, i)
            status = failure(attention)
            if attention == MARK:
                b[places[AT.time_] + i] = b[places[AT.mark_time_] + i]
                if pass_mark(places, lane, b, store, table, outbox, marker, i) != CLOSES:
                    continue
                status = OK
            end_run(places, lane, successor, finished, counters, b, table, state, outbox, i, status)


@lru_cache
def make_advance() -> LaneFunction:
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
    return compiled(*[INTEGERS] * 6, *[BUFFER] * 5, INTEGER, INTEGER, *[FUNCTION] * 4)(_advance)
