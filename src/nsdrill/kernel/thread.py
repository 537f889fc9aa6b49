"""The loop of one thread of a device, which has one lane: as
:mod:`nsdrill.kernel.loop`, but the next run comes from a queue that all threads share.

A thread works for a number of steps. What it has of its own, the lane buffer and its
store, is kept on the device between two such launches, so that no run depends on how
they are divided. Its arguments, besides those of that loop:

====================  ==========================================================
``saved``             [kept rows, threads]: of the lane buffers
``stores``            [threads, store]: the observer's stores
``lanes``             [threads, OWN]: ``lane`` and ``counters`` of each
``counters``          [SHARED]: of the queue, of the runs that ended, of those
                      that are parked; for all threads
``done``              [slots, columns]: the rows of the outbox of the runs that
                      ended, each with where it started, in the order of
                      ``finished``
``parked``            [slots, parked rows]: runs whose transient is over
``waiting``           [slots]: ring of their slots
====================  ==========================================================

In the phase TRANSIENT a thread parks its run where the observation begins, and takes the
next from the queue; in OBSERVATION it goes on with a parked one. Then the threads of a
launch do the same, and those of a transient need no observer, less code and fewer
registers. A run in the phases is no part of a chain.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from nsdrill.abi import CLOSES, MARK, OPENS, Layout
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
    failure,
    load_run,
    pass_mark,
    places_of,
)
from nsdrill.kernel.pairs import Pair
from nsdrill.kernel.steppers import make_turn
from nsdrill.variables import OK

# The integers of a thread: those of a lane, and counters of its own.
LANE = 3
OWN = LANE + COUNTERS
# Further counters that all threads share: of the parked runs, the next that is taken up,
# how many there are, how many there were when the launch began, and how many ended; and
# how many threads have used their steps up.
PARKED_NEXT, PARKED_END, PARKED_LIMIT, OBSERVED, USED_UP, SHARED = range(COUNTERS, COUNTERS + 6)
# What the threads of a launch do.
WHOLE, TRANSIENT, OBSERVATION = range(3)


def kept_rows(rows: Layout, phase: int = WHOLE) -> tuple[int, ...]:
    """The rows of the lane buffer that a step reads before it writes them."""
    observed = rows.stepper if phase != TRANSIENT else rows.observer
    return (*range(rows.aux_now), *range(rows.parameter, observed))


def parked_rows(rows: Layout) -> tuple[int, ...]:
    """The rows that an observation begins with. The right-hand side is evaluated again,
    except an implicit one, which moves the state."""
    return (*range(rows.parameter if rows.implicit else rows.aux_now), *range(rows.parameter, rows.observer))


@inlined
def show_start(places, b):
    """Let a step of length zero be the start of the run just loaded."""
    for j in range(places[AT.states]):
        b[places[AT.stage_] + j] = b[places[AT.start_] + j]
    b[places[AT.stage_time_]] = b[places[AT.time_]]
    if places[AT.relax_] >= 0:
        b[places[AT.relax_]] = 0.0


@inlined
def keep_start(places, b):
    """Keep the slopes at the start of the run for its first step."""
    b[places[AT.moves_]] = 0.0
    for j in range(places[AT.slopes_and_pushes]):
        b[places[AT.start_acceleration_] + j] = b[places[AT.acceleration_] + j]


@inlined
def next_of(ring, counters, at, end):
    """The next slot of a ring, or -1; ``at`` and ``end`` are the counters of the next
    and of the last."""
    slot = -1
    if counters[at] < counters[end]:
        place = claim(counters, at, 1)
        if place < counters[end]:
            slot = ring[place % len(ring)]
    return slot


@lru_cache
def make_thread(
    pair: Pair,
    rows: Layout,
    outbox_columns: int,
    store_size: int,
    right_hand_side: LaneFunction,
    observer: LaneFunction,
    marker: LaneFunction,
    phase: int = WHOLE,
) -> LaneFunction:
    """The function of one thread for functions made for one lane.

    ``thread(saved, stores, lanes, successor, queue, finished, counters, table, state,
    outbox, done, parked, waiting, budget, threads, number)`` tries at most ``budget``
    steps. It returns early where the queue is empty. Tables are flat, row after row;
    most are those of :func:`nsdrill.kernel.loop.make_advance`, for all threads together,
    others in :mod:`nsdrill.kernel.thread`.

    A run has the same bits in the phases if its observer needs no call before the last
    step of the transient, as those of a declaration (:mod:`nsdrill.observe.declared`).
    """
    places = tuple(int(place) for place in places_of(1, rows, outbox_columns))
    size, kept = rows.total, tuple(enumerate(kept_rows(rows, phase)))
    take_up = _resuming(rows, pair) if phase == OBSERVATION else _starting(places, pair)
    attempt = _attempting(places, make_turn(pair, rows), right_hand_side, observer, phase)
    park, deliver = _parking(rows), _delivering(rows, outbox_columns, phase)

    @compiled(*[BUFFER] * 2, *[INTEGERS] * 5, *[BUFFER] * 5, INTEGERS, *[INTEGER] * 3)
    def thread(
        saved, stores, lanes, successor, queue, finished, counters, table, state, outbox, done, parked, waiting,
        budget, threads, number,
    ):  # fmt: skip
        b = local(size)
        for k, j in kept:
            b[j] = saved[k * threads + number]
        store = stores[store_size * number : store_size * number + store_size]
        lane = lanes[OWN * number : OWN * number + LANE]
        own = lanes[OWN * number + LANE : OWN * number + OWN]
        refill, steps = True, 0
        for _ in range(budget):
            first, begins = 0, False
            if refill:
                refill = False
                first, begins = take_up(b, lane, queue, waiting, counters, table, state, parked)
                if lane[0] < 0:
                    break
            steps += 1
            has_event, attention = attempt(b, store, first, begins)
            if phase == TRANSIENT and has_event and attention == MARK:
                park(b, lane, parked, waiting, counters)
                refill = True
                continue
            if first != 0 and b[places[AT.step_]] == 0.0:
                keep_start(places, b)
            if not has_event:
                continue
            refill = True
            commit_step(places, b, 0)
            status = failure(attention)
            if attention == MARK:
                b[places[AT.time_]] = b[places[AT.mark_time_]]
                if pass_mark(places, lane, b, store, table, outbox, marker, 0) != CLOSES:
                    continue
                status = OK
            slot, place = lane[0], claim(counters, FINISHED, 1)
            own[FINISHED] = place
            end_run(places, lane, successor, finished, own, b, table, state, outbox, 0, status)
            deliver(slot, place, counters, outbox, state, done)
        if steps == budget:
            claim(counters, USED_UP, 1)
        own[PACKED_STEPS] += steps
        # The addresses are computed again: kept, they would take registers all along.
        again, same = anew(threads), anew(number)
        for k, j in kept:
            saved[k * again + same] = b[j]

    return thread


# The parts of that, which are written out.
def _starting(places: tuple[int, ...], pair: Pair) -> Callable[..., tuple[int, bool]]:
    """Takes up the next run of the queue, or of the chain: it begins with a step of
    length zero, of which only the slopes are computed."""
    slopes_only = len(pair.times) - 1

    @inlined
    def take_up(b, lane, queue, waiting, counters, table, state, parked):
        first, begins = 0, False
        if lane[0] < 0:
            lane[0] = next_of(queue, counters, QUEUE_NEXT, QUEUE_END)
            lane[2] = 1
        if lane[0] >= 0 and lane[2] == 1:
            lane[2] = 0
            load_run(places, lane, b, table, state, 0)
            show_start(places, b)
            first, begins = slopes_only, True
        return first, begins

    return take_up


def _resuming(rows: Layout, pair: Pair) -> Callable[..., tuple[int, bool]]:
    """Takes up the next of the parked runs, where its observation begins."""
    parked_places, slopes_only = tuple(enumerate(parked_rows(rows))), len(pair.times) - 1
    parked_size, resumed = len(parked_places), slopes_only + 1 if rows.implicit else slopes_only

    @inlined
    def take_up(b, lane, queue, waiting, counters, table, state, parked):
        first = 0
        if lane[0] < 0:
            slot = next_of(waiting, counters, PARKED_NEXT, PARKED_LIMIT)
            lane[0] = slot
            if slot >= 0:
                for k, j in parked_places:
                    b[j] = parked[slot * parked_size + k]
                lane[1] = OPENS
                first = resumed
        return first, False

    return take_up


def _attempting(
    places: tuple[int, ...], step: Callable[..., int], right_hand_side: LaneFunction, observer: LaneFunction, phase: int
) -> Callable[..., tuple[bool, float]]:
    """Tries a step; whether the run needs attention, and why."""

    @inlined
    def attempt(b, store, first, begins):
        has_event = step(b, right_hand_side, observer, store, first, begins) != 0
        attention = b[places[AT.attention_]]
        if first != 0:
            # without a transient the observation begins at once
            has_event = phase == OBSERVATION or b[places[AT.mark_time_]] <= 0.0
            attention = MARK
        return has_event, attention

    return attempt


def _parking(rows: Layout) -> Callable[..., None]:
    """Parks a run whose transient is over."""
    parked_places = tuple(enumerate(parked_rows(rows)))
    parked_size = len(parked_places)

    @inlined
    def park(b, lane, parked, waiting, counters):
        slot = lane[0]
        for k, j in parked_places:
            parked[slot * parked_size + k] = b[j]
        waiting[claim(counters, PARKED_END, 1) % len(waiting)] = slot
        lane[0] = -1

    return park


def _delivering(rows: Layout, outbox_columns: int, phase: int) -> Callable[..., None]:
    """Copies the row of the outbox of a run that ended, and its start, to their place."""
    starts, columns = rows.states + 1, outbox_columns + rows.states + 1

    @inlined
    def deliver(slot, place, counters, outbox, state, done):
        if phase == OBSERVATION:
            claim(counters, OBSERVED, 1)
        for k in range(slot * outbox_columns, slot * outbox_columns + outbox_columns):
            done[place * columns + k - slot * outbox_columns] = outbox[k]
        for k in range(slot * starts, slot * starts + starts):
            done[place * columns + outbox_columns + k - slot * starts] = state[k]

    return deliver
