"""The engine: keeps the batches of all workers filled, over any ``concurrent.futures``
executor.

Every worker has one batch. A task advances it for a *quantum*, a fraction of a second,
and returns the runs that ended; the engine delivers those, refills the batch and
submits it again. So results arrive continuously, a stop takes no longer than a quantum,
and only the runs in progress are lost. The results of a point do not depend on the
batch that runs it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import ExitStack
from dataclasses import dataclass, field

import numpy as np

from nsdrill import interrupt
from nsdrill.data import Array
from nsdrill.errors import NsdrillError, again
from nsdrill.kernel.batch import Batch, FinishedRuns, Slow
from nsdrill.kernel.device_batch import DeviceBatch
from nsdrill.sweep.gpu import Gpu
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work, advance
from nsdrill.variables import OK

SEGMENT = 64  # points of a chain added to a batch at once
QUANTUM = 0.25  # seconds for which a batch is advanced at once in a thread
REMOTE_QUANTUM = 1.0  # in another process: a batch is then a message of some megabytes
# Seconds between checks for an interrupt and for a lost cluster while no task ends.
POLL_SECONDS = 0.5
SHORT = 10.0  # simulated seconds up to which a run is short
MAX_LOSSES = 10  # times that the task of one batch may be lost with its worker


@dataclass
class Progress:
    """The progress of a sweep: numbers of points, ``done`` and ``failed`` in this
    session and done ``before`` it, of ``total``; steps tried so far; if the run has
    several stages, the present one in ``note``; whether the state is ``carried``, by
    chains that end one after the other, so that the rate falls; and the time [s] that
    was ``expected`` when some points had been timed, with that in words, ``price``; on
    which ``device`` it runs and why, in words, where that was asked; what its memory
    is short of, ``shortage``; and a run that will end at the limit of its steps, ``slow``."""

    total: int
    before: int = 0
    done: int = 0
    failed: int = 0
    lane_steps: int = 0
    lanes_in_use: float = 1.0
    note: str = ""
    carried: bool = False
    expected: float | None = None
    price: str = ""
    device: str = ""
    shortage: str = ""
    slow: Slow | None = None


@dataclass
class ChainStarts:
    """Where chains are to begin: their numbers [n], the places in them [n], and
    ``state(chain, place)``, the state [states + 1] that a chain has reached at a place
    after its first, or None if the point before failed."""

    chains: Array
    places: Array
    state: Callable[[int, int], Array | None] = lambda chain, place: None

    def __len__(self) -> int:
        return len(self.chains)

    def those(self, mask: Array) -> ChainStarts:
        """Those where ``mask`` [n] is true."""
        return ChainStarts(self.chains[mask], self.places[mask], self.state)

    def with_more(self, handed: list[tuple[int, int, Array | None]]) -> ChainStarts:
        """These and the chains ``handed`` over by another method: (chain, place, state
        at that place)."""
        states, before = {(chain, place): state for chain, place, state in handed}, self.state

        def state(chain: int, place: int) -> Array | None:
            return states[chain, place] if (chain, place) in states else before(chain, place)

        numbers = np.array([(chain, place) for chain, place, _ in handed], np.int64).reshape(-1, 2)
        return ChainStarts(
            np.concatenate([self.chains, numbers[:, 0]]), np.concatenate([self.places, numbers[:, 1]]), state
        )

    def next_points(self, plan: Plan) -> Array:
        """The points at which the chains begin."""
        return plan.points_of(self.chains, self.places)

    def runs(self, plan: Plan) -> int:
        """The number of points from these places to the ends of the chains."""
        return int(np.sum(plan.lengths(self.chains)) - np.sum(self.places))


@dataclass
class _Worker:
    """A worker's batch, the ends of the chain segments in it, the number of points that
    it gets at once, and how often its task was lost."""

    batch: Batch
    # Last point of every segment of a chain in the batch -> (chain, next place), or
    # None where the chain ends with it.
    ends: dict[int, tuple[int, int] | None] = field(default_factory=dict)
    batch_size: int = 64
    losses: int = 0


class Engine:
    """Runs a :class:`Work` on ``workers`` batches of ``lanes`` lanes, or with a ``gpu`` on
    its batches.

    ``deliver(points, columns)`` is called, in the calling thread, with the numbers of
    finished points and their results; ``watch(progress)`` after each task. With
    ``remote`` the executor's workers are other processes: quanta are longer, and the
    task of a worker that died is submitted again; a method ``check`` of the executor,
    if it has one, raises if no more results can arrive. A stop takes at most
    ``quantum_seconds``.

    ``reach(points)`` returns how many of the first of these points of a chain this work
    integrates, if another method integrates the others. A chain that has reached one of
    those is appended to ``handed``: (chain, place, state at that place).
    """

    def __init__(
        self,
        work: Work,
        executor: Executor,
        workers: int,
        lanes: int,
        deliver: Callable[[Array, dict[str, Array]], None],
        watch: Callable[[Progress], None] = lambda progress: None,
        quantum_seconds: float | None = None,
        remote: bool = False,
        reach: Callable[[Array], int] = len,
        gpu: Gpu | None = None,
    ) -> None:
        self.reach, self.gpu = reach, gpu
        self.handed: list[tuple[int, int, Array | None]] = []
        self.work, self.executor, self.workers, self.lanes = work, executor, workers, lanes
        self.deliver, self.watch, self.remote = deliver, watch, remote
        self.quantum_seconds = quantum_seconds or (REMOTE_QUANTUM if remote else QUANTUM)
        self.slots = max(4 * SEGMENT, SEGMENT * lanes * (1 if remote else 2))
        self.progress = Progress(total=work.plan.points)

    def run(self, starts: ChainStarts | None = None, pending: Array | None = None) -> Progress:
        """Run all points, or only some: the chains ``starts`` if the state is carried,
        else the points with the numbers ``pending``.

        An interrupt, as a signal or as an exception in the calling thread, ends the run
        after the tasks in progress; their results are delivered, and then a
        KeyboardInterrupt is raised to the caller.
        """
        plan = self.work.plan
        self._carried = plan.carried
        if self._carried:
            self._starts = (
                ChainStarts(np.arange(plan.chains), np.zeros(plan.chains, np.int64)) if starts is None else starts
            )
            self._pending = self._longest_chains_first()
            runs = self._starts.runs(plan)
        else:
            points = np.arange(plan.points) if pending is None else pending
            self._pending = points[self._longest_first(points)]
            runs = len(self._pending)
        self._next = 0  # of the pending points, or starts
        self.progress.before = plan.points - runs

        workers = self._new_workers()
        futures: dict[Future[tuple[Batch, FinishedRuns]], _Worker] = {}
        with interrupt.interruptible(), ExitStack() as opened:
            for worker in workers:
                if isinstance(worker.batch, DeviceBatch):
                    opened.enter_context(worker.batch)
            try:
                for worker in workers:
                    self._submit(worker, futures)
                while futures:
                    finished, _ = wait(futures, POLL_SECONDS, FIRST_COMPLETED)
                    interrupt.check()
                    if not finished and (check := getattr(self.executor, "check", None)):
                        check()
                    for future in finished:
                        worker = futures.pop(future)
                        if not self._is_lost(worker, future):
                            self._receive(worker, future)
                        self._submit(worker, futures)
                    self._count_lanes(workers)
                    self.watch(self.progress)
            except BaseException:
                # Wait for the tasks in progress and deliver their results.
                ended, _ = wait(futures, timeout=None if not self.remote else 2 * self.quantum_seconds)
                for future in ended:
                    if not future.cancelled() and future.exception() is None:
                        self._receive(futures[future], future)
                raise
        return self.progress

    def _new_workers(self) -> list[_Worker]:
        """The workers with their batches, and how much each of them gets."""
        pending = self._pending_count()
        if self.gpu is None:
            count = max(1, min(self.workers, pending))
            workers = [_Worker(self.work.new_batch(self.lanes, self.slots)) for _ in range(count)]
            self._abreast, segments = self.lanes, self.lanes * (1 if self.remote else 2)
        else:
            batches = self.gpu.batches(self.work, pending, SEGMENT if self._carried else 1)
            workers = [_Worker(batch, batch_size=batch.slots) for batch in batches]
            self.workers, self.slots = len(workers), batches[0].slots
            self.progress.shortage = batches[0].shortage
            self._abreast = segments = batches[0].lanes
        self._segment = max(1, min(SEGMENT, workers[0].batch.slots // segments))
        return workers

    def _longest_chains_first(self) -> Array:
        """The order of the starts: chains with the most points left, then points that are
        chains by themselves, which fill the lanes beside them."""
        plan, starts = self.work.plan, self._starts
        is_long = starts.chains < plan.carried_chains
        self._together = int(np.count_nonzero(is_long))
        long, alone = np.flatnonzero(is_long), np.flatnonzero(~is_long)
        long = long[np.argsort(starts.places[long], kind="stable")]
        return np.concatenate([long, alone[self._longest_first(starts.those(~is_long).next_points(plan))]])

    def _longest_first(self, points: Array) -> Array:
        """The order of the points by falling speed: at fast rotation the collar rolls along
        the wall, which takes the most steps. Also, adjacent lanes then have points of
        one speed and so mostly of one regime, in which all of them may be off the wall.
        Short runs keep the order of the file, in which they are stored fastest."""
        plan = self.work.plan
        is_short = self.work.simulation.transient + self.work.simulation.observe < SHORT
        if is_short or "rotary_speed" not in plan.axes:
            return np.arange(len(points))
        axis = 1 + list(plan.axes).index("rotary_speed")
        # the number of successive points with the same speed
        same_speed = math.prod(plan.grid[axis + 1 :])
        speed = (points // same_speed % plan.shape[axis]).astype(np.int32)  # its index on the axis
        return np.argsort(-speed, kind="stable")

    def _pending_count(self) -> int:
        return len(self._pending) - self._next

    def _submit(self, worker: _Worker, futures: dict[Future[tuple[Batch, FinishedRuns]], _Worker]) -> None:
        self._refill(worker)
        if worker.batch.idle:
            return
        drain = self._pending_count() == 0 and not any(worker.ends.values())
        future = self.executor.submit(advance, worker.batch, self.work.program, self.quantum_seconds, drain)
        futures[future] = worker

    def _is_lost(self, worker: _Worker, future: Future[tuple[Batch, FinishedRuns]]) -> bool:
        """Whether the task was lost with its worker. The batch in this process is still
        as it was sent, and is sent again."""
        if not self.remote or (not future.cancelled() and future.exception() is None):
            return False
        worker.losses += 1
        if worker.losses > MAX_LOSSES:
            cause = None if future.cancelled() else future.exception()
            raise NsdrillError(
                f"A part of the sweep was lost {worker.losses} times with its worker ({cause or 'cancelled'}). "
                f"Finished points are kept: look after the cluster, then run {again('resume')}."
            ) from cause
        return True

    def _count_lanes(self, workers: list[_Worker]) -> None:
        packed = sum(worker.batch.packed_steps * worker.batch.lanes for worker in workers)
        self.progress.lanes_in_use = sum(worker.batch.lane_steps for worker in workers) / packed if packed else 1.0

    def _refill(self, worker: _Worker) -> None:
        """Refill the batch of a worker: a single worker's with as many points as fit,
        those of several with at most an equal share of the rest, so that all end at
        about the same time."""
        quota = self._pending_count()
        if self._carried and self._next < self._together:
            quota = self._together - self._next  # all workers share the chains, and fill up with points
        if self.workers > 1:
            quota = min(worker.batch_size, max(self._abreast, -(-quota // (2 * self.workers)))) - worker.batch.waiting
        if not self._carried:
            count = min(quota, worker.batch.free, self._pending_count())
            if count > 0:
                points = self._pending[self._next : self._next + count]
                self._next += count
                worker.batch.add_many(points, self.work.prepare(points))
            return
        # The slots of finished points stay reserved for the next segments of the chain.
        while quota > 0 and self._pending_count() and (len(worker.ends) + 1) * self._segment <= worker.batch.slots:
            number = self._pending[self._next]
            chain, place = int(self._starts.chains[number]), int(self._starts.places[number])
            self._add_segment(worker, chain, place, self._starts.state(chain, place) if place else None)
            self._next += 1
            quota -= 1

    def _add_segment(self, worker: _Worker, chain: int, place: int, state: Array | None) -> None:
        plan = self.work.plan
        length = int(plan.lengths(chain))
        end = min(place + self._segment, length)
        points = plan.points_of(chain, np.arange(place, end))
        if (count := self.reach(points)) < len(points):
            end, points = place + count, points[:count]
        if not count:
            self.handed.append((chain, place, state))
            return
        runs = self.work.prepare(points)
        if (same_held := self.work.same_held(runs.initial)) < len(points):
            end, points = place + same_held, points[:same_held]
            runs = self.work.prepare(points)
        if state is not None:
            self.work.begin(runs.initial[0], state)
        worker.ends[int(points[-1])] = (chain, end) if end < length else None
        worker.batch.add(points, runs)

    def _receive(self, worker: _Worker, future: Future[tuple[Batch, FinishedRuns]]) -> None:
        batch, finished = future.result()
        worker.batch = batch
        if isinstance(batch, Batch) and (slow := batch.slowest()) is not None and slow.ends_at_limit:
            self.progress.slow = slow
        n = len(finished.job)
        if n == 0:
            return
        # A batch that finishes its points in much less than a quantum gets more.
        if not self._carried and n >= worker.batch_size // 2:
            worker.batch_size = min(2 * worker.batch_size, self.slots)
        for i, point in enumerate(finished.job.tolist()):
            if (following := worker.ends.pop(point, None)) is not None:
                state = self.work.own_state(finished.final[i]) if finished.status[i] == OK else None
                self._add_segment(worker, *following, state)
        self.progress.done += n
        self.progress.failed += int(np.count_nonzero(finished.status != OK))
        self.deliver(finished.job, self.work.columns(finished))
        self.progress.lane_steps += int(np.sum(finished.accepted + finished.rejected))
