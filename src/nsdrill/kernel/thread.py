"""The loop of one thread of a device, which has one lane: as
:mod:`nsdrill.kernel.loop`, but the next run comes from a queue that all threads share.

A thread works for a number of steps. What it has of its own, the lane buffer and its
store, is kept on the device between two such launches, so that no run depends on how
they are divided.
"""

from __future__ import annotations

from functools import lru_cache

from nsdrill.abi import CLOSES, LIMIT, MARK, NONFINITE, Rows
from nsdrill.compiler.functions import BUFFER, INTEGER, INTEGERS, LaneFunction, anew, claim, compiled, inlined, local
from nsdrill.kernel.loop import (
    AT,
    COUNTERS,
    FINISHED,
    PACKED_STEPS,
    QUEUE_END,
    QUEUE_NEXT,
    commit_step,
    end_run,
    load_run,
    pass_mark,
    places_of,
)
from nsdrill.kernel.pairs import Pair
from nsdrill.kernel.steppers import make_turn
from nsdrill.variables import DIVERGED, OK, STEP_LIMIT, STEP_UNDERFLOW

# The integers of a thread: those of a lane, and counters of its own.
LANE = 3
OWN = LANE + COUNTERS


@inlined
def show_start(places, b):  # type: ignore[no-untyped-def]
    """Let a step of length zero be the start of the run just loaded."""
    for j in range(places[AT.states]):
        b[places[AT.stage_] + j] = b[places[AT.start_] + j]
    b[places[AT.stage_time_]] = b[places[AT.time_]]
    if places[AT.relax_] >= 0:
        b[places[AT.relax_]] = 0.0


@inlined
def keep_start(places, b):  # type: ignore[no-untyped-def]
    """Keep the slopes at the start of the run for its first step."""
    b[places[AT.moves_]] = 0.0
    for j in range(places[AT.slopes_and_pushes]):
        b[places[AT.start_acceleration_] + j] = b[places[AT.acceleration_] + j]


def kept_rows(rows: Rows) -> list[int]:
    """The rows of the lane buffer that a step reads before it writes them."""
    return [*range(rows.aux_now), *range(rows.parameter, rows.stepper)]


@lru_cache
def make_thread(
    pair: Pair,
    rows: Rows,
    outbox_columns: int,
    store_size: int,
    right_hand_side: LaneFunction,
    observer: LaneFunction,
    marker: LaneFunction,
) -> LaneFunction:
    """The function of one thread for functions made for one lane.

    ``thread(saved, stores, lanes, successor, queue, finished, counters, table, state,
    outbox, done, budget, threads, number)`` tries at most ``budget`` steps. It returns
    early where the queue is empty. Tables are flat, row after row; most are those of
    :func:`nsdrill.kernel.loop.make_advance`, for all threads together.

    ====================  ==========================================================
    ``saved``             [rows, threads]: the lane buffers
    ``stores``            [threads, store]: the observer's stores
    ``lanes``             [threads, OWN]: ``lane`` and ``counters`` of each
    ``counters``          of the queue and of the runs that ended, for all threads
    ``done``              [slots, columns]: the rows of the outbox of the runs that
                          ended, each with where it started, in the order of
                          ``finished``
    ====================  ==========================================================
    """
    places = tuple(int(place) for place in places_of(1, rows, outbox_columns))
    total, starts, done_columns = rows.total, rows.states + 1, outbox_columns + rows.states + 1
    kept = tuple(enumerate(kept_rows(rows)))
    step = make_turn(pair, rows)

    @compiled(*[BUFFER] * 2, *[INTEGERS] * 5, *[BUFFER] * 4, *[INTEGER] * 3)
    def thread(  # type: ignore[no-untyped-def]
        saved, stores, lanes, successor, queue, finished, counters, table, state, outbox, done, budget, threads, number
    ):
        b = local(total)
        for k, j in kept:
            b[j] = saved[k * threads + number]
        store = stores[store_size * number : store_size * number + store_size]
        lane = lanes[OWN * number : OWN * number + LANE]
        own = lanes[OWN * number + LANE : OWN * number + OWN]
        refill, steps = True, 0
        for _ in range(budget):
            begins = False
            if refill:
                refill = False
                if lane[0] < 0 and counters[QUEUE_NEXT] < counters[QUEUE_END]:
                    place = claim(counters, QUEUE_NEXT, 1)
                    if place < counters[QUEUE_END]:
                        lane[0] = queue[place % len(queue)]
                        lane[2] = 1
                if lane[0] < 0:
                    break
                if lane[2] == 1:
                    lane[2] = 0
                    begins = True
                    load_run(places, lane, b, table, state, 0)
                    show_start(places, b)
            steps += 1
            has_event = step(b, right_hand_side, observer, store, begins) != 0
            attention = b[places[AT.attention_]]
            if begins:
                keep_start(places, b)
                # without a transient the observation begins at once
                has_event = b[places[AT.mark_time_]] <= 0.0
                attention = MARK
            if not has_event:
                continue
            refill = True
            commit_step(places, b, 0)
            status = DIVERGED if attention == NONFINITE else STEP_UNDERFLOW
            if attention == LIMIT:
                status = STEP_LIMIT
            if attention == MARK:
                b[places[AT.time_]] = b[places[AT.mark_time_]]
                if pass_mark(places, lane, b, store, table, outbox, marker, 0) != CLOSES:
                    continue
                status = OK
            slot = lane[0]
            place = claim(counters, FINISHED, 1)
            own[FINISHED] = place
            end_run(places, lane, successor, finished, own, b, table, state, outbox, 0, status)
            for k in range(slot * outbox_columns, slot * outbox_columns + outbox_columns):
                done[place * done_columns + k - slot * outbox_columns] = outbox[k]
            for k in range(slot * starts, slot * starts + starts):
                done[place * done_columns + outbox_columns + k - slot * starts] = state[k]
        own[PACKED_STEPS] += steps
        # The addresses are computed again: kept, they would take registers all along.
        again, same = anew(threads), anew(number)
        for k, j in kept:
            saved[k * again + same] = b[j]

    return thread
