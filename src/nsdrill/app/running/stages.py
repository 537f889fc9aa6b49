"""Several runs of the engine over one log, with a common count of progress: the sweep, and
the checks of its points."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import field, replace
from itertools import cycle
from typing import Any, Literal

import numpy as np

from nsdrill.app.experiment import Experiment
from nsdrill.data import Array
from nsdrill.kernel.batch import choose_lanes, widened
from nsdrill.kernel.settings import Simulation
from nsdrill.models.friction import METHODS
from nsdrill.models.responses import trust_labels
from nsdrill.records import dataclass
from nsdrill.store import Sink, Source, columns, pending_records
from nsdrill.sweep.engine import ChainStarts, Engine, Progress
from nsdrill.sweep.gpu import Gpu
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Rerun, Work, compiled_parts
from nsdrill.variables import CHECKS, OK, PENDING, end_of_run, has_failed

Watch = Callable[[Progress], None]
Deliver = Callable[[Array, dict[str, Array]], None]
StateAt = Callable[[int, int], Array | None]
SYNC_SECONDS = 1.0
_BLOCK = 1 << 18  # points examined at a time


def work_of(experiment: Experiment) -> Work:
    """All inputs of the numbers of an experiment."""
    study, plan = experiment.study, experiment.plan
    return Work(plan, study.parameters, study.initial, study.simulation, study.thresholds, study.record, study.model)


@dataclass
class RunStages:
    """The log, the executor and the progress that several runs of the engine share. The
    caller of a stage sets ``progress.total`` and, where points were run before,
    ``progress.before``. ``chains`` is the number of chains of the study per worker,
    from which work with small rows takes more lanes; with a ``gpu`` that is the worker."""

    log: Sink
    executor: Executor
    workers: int
    lanes: int
    watch: Watch = lambda progress: None
    remote: bool = False
    chains: int = 0
    gpu: Gpu | None = None
    progress: Progress = field(default_factory=lambda: Progress(total=0))
    synced: float = field(default_factory=time.monotonic)

    def run(self, work: Work, deliver: Deliver, starts: ChainStarts | None, pending: Array, note: str = "") -> None:
        """Run the points ``pending`` of ``work``, or the chains from ``starts``, with
        the engine. ``deliver`` takes the columns of finished points; ``note`` names the
        stage in the progress."""
        base, progress = replace(self.progress), self.progress
        progress.note, progress.carried = note, work.plan.carried

        def add(now: Progress) -> None:
            progress.done, progress.failed = base.done + now.done, base.failed + now.failed
            progress.lane_steps = base.lane_steps + now.lane_steps
            progress.lanes_in_use, progress.shortage = now.lanes_in_use, now.shortage
            progress.slow = now.slow

        def watch(now: Progress) -> None:
            add(now)
            self.watch(progress)

        def engine(one: Work, **more: Any) -> Engine:
            nonlocal base
            base = replace(progress)
            lanes = widened(self.lanes, self.chains, one.program.rows)
            if not one.compiled_axes:  # else the worker that begins with a part compiles it
                with compiling(progress, self.watch):
                    if self.gpu is None:
                        compiled_parts(lanes, one.program)
                    else:
                        self.gpu.check(one)
            more |= {"remote": self.remote, "gpu": self.gpu}
            return Engine(one, self.executor, self.workers, lanes, deliver, watch, **more)

        if progress.carried:
            assert starts is not None
            for part, own in _parts_of(work, starts):
                for one, chain_starts, reach, handed in _in_turns(part, own):
                    chains = engine(one, reach=reach)
                    add(chains.run(chain_starts))
                    handed += chains.handed
            return
        for part, points in work.parts(pending):
            for one, subset in part.by_method(points):
                add(engine(one).run(None, subset))

    def write(self, points: Array, records: Array) -> None:
        """Write records to the log, and sync it every :data:`SYNC_SECONDS`."""
        self.log.write(points, records)
        if time.monotonic() - self.synced > SYNC_SECONDS:
            self.log.sync()
            self.synced = time.monotonic()

    def store(self, points: Array, columns: dict[str, Array]) -> None:
        """Write the columns of finished points to the log; fields that they lack stay
        as in a pending record."""
        records = pending_records(len(points), self.log.contents)
        for name in records.dtype.names or ():
            if name in columns:
                records[name] = columns[name]
        self.write(points, records)


@contextmanager
def compiling(progress: Progress, watch: Watch) -> Iterator[None]:
    """Tell the watcher that code is compiled, or loaded, meanwhile."""
    note, progress.note = progress.note, "compiling"
    watch(progress)
    yield
    progress.note = note


def _parts_of(work: Work, starts: ChainStarts) -> Iterator[tuple[Work, ChainStarts]]:
    """Chained ``work`` divided by what is compiled in, which no chain changes: the work
    of each part and its chains, whose states are those of the part."""
    first = starts.next_points(work.plan)
    for part, points in work.parts(first):
        own = starts.those(np.isin(first, points))
        yield part, replace(own, state=_own_states(part, starts.state))


def _own_states(work: Work, state: StateAt) -> StateAt:
    """``state`` of a chain with the states of all points as that of the points of
    ``work``."""

    def own(chain: int, place: int) -> Array | None:
        found = state(chain, place)
        return None if found is None else work.to_own_states(found[None])[0]

    return own


def _in_turns(
    work: Work, starts: ChainStarts
) -> Iterator[tuple[Work, ChainStarts, Callable[[Array], int], list[tuple[int, int, Array | None]]]]:
    """The parts of chained ``work`` by method, alternately explicit and implicit, until
    no chain is left. Each part has the work with its method, the chains to continue, a
    function that gives how many of the next points of a chain have this method, and a
    list that takes the chains that continue with the other method."""
    if work.simulation.method == "explicit":
        yield work, starts, len, []
        return
    chosen, plan = work.chosen, work.plan
    methods: Iterator[Literal["explicit", "implicit"]] = cycle(METHODS)
    for method in methods:
        if not len(starts):
            return
        selected = chosen.points(starts.next_points(plan)) == (method == METHODS[1])
        if not selected.any():
            continue

        def reach(points: Array, implicit: bool = method == METHODS[1]) -> int:
            other = chosen.points(points) != implicit
            return int(np.argmax(other)) if other.any() else len(points)

        handed: list[tuple[int, int, Array | None]] = []
        yield work.by(method), starts.those(selected), reach, handed
        starts = starts.those(~selected).with_more([one for one in handed if one[1] < plan.lengths(one[0])])


def sweep(stages: RunStages, work: Work) -> None:
    """Run all pending points."""
    starts, pending = remaining(work.plan, stages.log)
    runs = len(pending) + starts.runs(work.plan)
    stages.progress.total, stages.progress.before = work.plan.points, work.plan.points - runs
    stages.run(work, stages.store, starts, pending)


def remaining(plan: Plan, log: Sink, chains: Array | None = None) -> tuple[ChainStarts, Array]:
    """What is still to run, of ``chains`` if given: where each chain continues, and
    which points without a chain are pending."""
    pending = ~log.done()
    if not plan.carried:
        points = np.flatnonzero(pending) if chains is None else chains[pending[chains]]
        return ChainStarts(np.empty(0, np.int64), np.empty(0, np.int64)), points

    def state(chain: int, place: int) -> Array | None:
        point = int(plan.points_of(chain, place - 1))
        before = log.read(point, point + 1)[0]
        return np.array(before["final_state"]) if end_of_run(before["status"]) == OK else None

    chains = np.arange(plan.chains) if chains is None else chains
    places = _first_pending(plan, pending, chains)
    unfinished = places < plan.lengths(chains)
    return ChainStarts(chains[unfinished], places[unfinished], state), np.empty(0, dtype=np.int64)


def _first_pending(plan: Plan, pending: Array, chains: Array) -> Array:
    """The first place of each of the ``chains`` whose point is ``pending``, or the
    length of the chain: int [chains]."""
    if pending.all():
        return np.zeros(len(chains), np.int64)
    places = plan.lengths(chains).astype(np.int64)
    for length in np.unique(places).tolist():
        alike = np.flatnonzero(places == length)
        block = min(length, _BLOCK)
        rows = max(1, _BLOCK // block)
        for first in range(0, len(alike), rows):
            searched = alike[first : first + rows]
            for begin in range(0, length, block):
                span = np.arange(begin, min(begin + block, length))
                is_pending = pending[plan.points_of(chains[searched][:, None], span)]
                has_pending = is_pending.any(axis=1)
                places[searched[has_pending]] = begin + np.argmax(is_pending[has_pending], axis=1)
                searched = searched[~has_pending]
                if not len(searched):
                    break
    return places


TIGHTER = 100.0
LEAST_RTOL = 1e-13
# limit of steps of a check over that of the run; a smaller tolerance takes 2.5 times as
# many steps
MORE_STEPS = 10
_BATCH = 1 << 17  # points whose states are in memory at a time


@dataclass(frozen=True)
class Check:
    """One check: its name, its integration, and the state of the record from which it
    starts."""

    name: str
    simulation: Simulation
    start: str


def checks(simulation: Simulation) -> tuple[Check, Check]:
    """The two checks. ``tight`` repeats the run with a hundredth of its tolerance.
    ``long`` continues the run from its final state for another transient and
    observation, so that it is observed after more than twice the transient."""
    steps = MORE_STEPS * simulation.max_steps
    tight = replace(simulation, rtol=max(simulation.rtol / TIGHTER, LEAST_RTOL), max_steps=steps)
    return (
        Check(CHECKS[0], tight, "initial_state"),
        Check(CHECKS[1], replace(simulation, max_steps=steps), "final_state"),
    )


def verify(stages: RunStages, work: Work) -> None:
    """Run the missing checks of the log."""
    log, progress = stages.log, stages.progress
    todo = {check: missing(log, check.name) for check in checks(work.simulation)}
    progress.total += sum(map(len, todo.values()))
    for check, points in todo.items():
        for start in range(0, len(points), _BATCH):
            _run(stages, work, check, points[start : start + _BATCH])


def _run(stages: RunStages, work: Work, check: Check, points: Array) -> None:
    log = stages.log
    first, last = int(points[0]), int(points[-1])
    states = columns(log, [check.start], first, last + 1)[check.start][points - first]
    rerun = Rerun.of(work, check.simulation, points, states)

    def store(done: Array, found: dict[str, Array]) -> None:
        records = np.concatenate([log.read(point, point + 1) for point in done.tolist()])
        records[f"{check.name}_status"] = found["status"]
        records[f"{check.name}_difference"] = work.computed.difference(_fields(records), found, found)
        for name in work.model.check_features:
            records[f"{check.name}_{name}"] = found[name]
        for name, values in trust_labels(
            _fields(records), records["response"], work.thresholds, work.computed.responses
        ).items():
            records[name] = values
        stages.write(done, records)

    lanes = max(stages.lanes, choose_lanes(-(-len(points) // stages.workers)))
    replace(stages, lanes=lanes).run(rerun, store, None, points, f"check: {check.name}")


def missing(log: Source, check: str) -> Array:
    """The points that ended well and lack this check."""
    status, checked = columns(log, ["status", f"{check}_status"]).values()
    return np.flatnonzero((status == OK) & (checked == PENDING))


def verified(log: Source) -> bool:
    """Whether all checks have run."""
    return not any(len(missing(log, check)) for check in CHECKS)


def any_failed(log: Source) -> bool:
    """Whether a check failed."""
    found = columns(log, [f"{check}_status" for check in CHECKS])
    return any(bool(np.any(_failed(found, check))) for check in CHECKS)


def forget_failed(records: Array) -> None:
    """Make failed checks pending in these records, in place, so that they run again."""
    for check in CHECKS:
        failed = _failed(records, check)
        for name in records.dtype.names or ():
            if name.startswith(f"{check}_"):
                records[name][failed] = np.nan if records[name].dtype.kind == "f" else 0
        records["trusted"][failed] = 0


def _failed(records: Array | dict[str, Array], check: str) -> Array:
    status = records[f"{check}_status"]
    return np.asarray(has_failed(status))


def _fields(records: Array) -> dict[str, Array]:
    return {name: records[name] for name in records.dtype.names or ()}
