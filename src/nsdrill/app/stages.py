"""Several runs of the engine over one log, counted as one: the sweep, its refinement,
the checks of its points."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from itertools import cycle
from typing import Any, Literal

import numpy as np

from nsdrill.data import Array
from nsdrill.kernel.batch import widened
from nsdrill.models.steepness import METHODS
from nsdrill.store import Sink, pending_records
from nsdrill.sweep.engine import Engine, Progress, Starts
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work, compiled_parts
from nsdrill.variables import OK

Watch = Callable[[Progress], None]
Deliver = Callable[[Array, dict[str, Array]], None]
SYNC_SECONDS = 1.0
_BLOCK = 1 << 18  # points looked at at once


@dataclass
class RunStages:
    """What the engine runs on, and how far all of it is. Whoever makes a pass sets
    ``progress.total`` and, where points were there before, ``progress.before``."""

    log: Sink
    executor: Executor
    workers: int
    lanes: int
    watch: Watch = lambda progress: None
    remote: bool = False
    # of the study, a worker: whether work that gains from more lanes than these has
    # them
    chains: int = 0
    progress: Progress = field(default_factory=lambda: Progress(total=0))
    synced: float = field(default_factory=time.monotonic)

    def run(
        self, work: Work, deliver: Deliver, starts: Starts | None, pending: Array, note: str = ""
    ) -> None:
        """Run these points of ``work`` with the engine; ``note`` says to the watcher
        what they are for."""
        base, own = replace(self.progress), self.progress
        own.note = note

        def add(now: Progress) -> None:
            own.done, own.failed = base.done + now.done, base.failed + now.failed
            own.lane_steps, own.lanes_in_use = base.lane_steps + now.lane_steps, now.lanes_in_use

        def watch(now: Progress) -> None:
            add(now)
            self.watch(own)

        def engine(one: Work, **more: Any) -> Engine:
            nonlocal base
            base = replace(own)
            lanes = widened(self.lanes, self.chains, one.variant.rows)
            if not one.compiled:
                compiled_parts(lanes, one.variant)
            return Engine(
                one, self.executor, self.workers, lanes, deliver, watch, remote=self.remote, **more
            )

        for part, points in work.parts(pending):
            if part.plan.chain_length > 1:
                if starts is None:
                    starts = Starts(
                        np.arange(part.plan.chains), np.zeros(part.plan.chains, np.int64)
                    )
                for one, begun, reach, handed in _carried(part, starts):
                    chains = engine(one, reach=reach)
                    add(chains.run(begun, points))
                    handed += chains.handed
            else:
                for one, some in part.by_method(points):
                    add(engine(one).run(starts, some))

    def write(self, points: Array, records: Array) -> None:
        """Put records into the log, and make them safe now and then."""
        self.log.write(points, records)
        if time.monotonic() - self.synced > SYNC_SECONDS:
            self.log.sync()
            self.synced = time.monotonic()

    def store(self, points: Array, columns: dict[str, Array]) -> None:
        """Put the results of finished points into the log; what they do not have stays
        as in a pending one."""
        records = pending_records(len(points), self.log.kept)
        for name in records.dtype.names or ():
            if name in columns:
                records[name] = columns[name]
        self.write(points, records)


def _carried(
    work: Work, starts: Starts
) -> Iterator[tuple[Work, Starts, Callable[[Array], int], list[tuple[int, int, Array | None]]]]:
    """The work of one method after the other, the chains that it goes on with, how far,
    and a list for those which it hands to the other method; until no chain is left."""
    if work.simulation.method == "explicit":
        yield work, starts, len, []
        return
    chosen, length = work.chosen, work.plan.chain_length
    methods: Iterator[Literal["explicit", "implicit"]] = cycle(METHODS)
    for method in methods:
        if not len(starts):
            return
        mine = chosen.points(starts.next_points(work.plan)) == (method == METHODS[1])
        if not mine.any():
            continue

        def reach(points: Array, implicit: bool = method == METHODS[1]) -> int:
            other = chosen.points(points) != implicit
            return int(np.argmax(other)) if other.any() else len(points)

        handed: list[tuple[int, int, Array | None]] = []
        yield work.by(method), starts.those(mine), reach, handed
        starts = starts.those(~mine).with_more([one for one in handed if one[1] < length])


def sweep(stages: RunStages, work: Work) -> None:
    """Run all that is pending."""
    starts, pending = remaining(work.plan, stages.log)
    runs = len(pending) + starts.runs(work.plan)
    stages.progress.total, stages.progress.before = work.plan.points, work.plan.points - runs
    stages.run(work, stages.store, starts, pending)


def remaining(plan: Plan, log: Sink, chains: Array | None = None) -> tuple[Starts, Array]:
    """What is still to run (of these chains): where each chain goes on, and which
    points are pending."""
    pending = ~log.done()
    if plan.chain_length == 1:
        points = np.flatnonzero(pending) if chains is None else chains[pending[chains]]
        return Starts(np.empty(0, np.int64), np.empty(0, np.int64)), points

    def state(chain: int, place: int) -> Array | None:
        point = int(plan.points_of(chain, place - 1))
        before = log.read(point, point + 1)[0]
        return np.array(before["final_state"]) if before["status"] == OK else None

    chains = np.arange(plan.chains) if chains is None else chains
    places = _first_pending(plan, pending, chains)
    unfinished = places < plan.chain_length
    return Starts(chains[unfinished], places[unfinished], state), np.empty(0, dtype=np.int64)


def _first_pending(plan: Plan, pending: Array, chains: Array) -> Array:
    """The first place of each of these chains whose point is ``pending``, or the length
    of a chain: [chains]."""
    if pending.all():
        return np.zeros(len(chains), np.int64)
    places = np.full(len(chains), plan.chain_length)
    length = min(plan.chain_length, _BLOCK)
    rows = max(1, _BLOCK // length)
    for first in range(0, len(chains), rows):
        open_ = np.arange(first, min(first + rows, len(chains)))
        for begin in range(0, plan.chain_length, length):
            span = np.arange(begin, min(begin + length, plan.chain_length))
            there = pending[plan.points_of(chains[open_][:, None], span)]
            found = there.any(axis=1)
            places[open_[found]] = begin + np.argmax(there[found], axis=1)
            open_ = open_[~found]
            if not len(open_):
                break
    return places
