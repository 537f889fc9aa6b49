"""A batch: some lanes, the runs that wait for a lane, and the runs just finished.

A batch is plain data and can be sent to any thread or process; the compiled functions
are passed to :meth:`Batch.advance`. It is advanced for a bounded time, between which
runs can be added and results saved. The numbers do not depend on when that happens, on
the number of lanes, or on the runs in the other lanes.
"""

from __future__ import annotations

import os
import time
from contextlib import AbstractContextManager, nullcontext
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import llvmlite.binding
import numpy as np

from nsdrill import interrupt
from nsdrill.abi import CONTROL, MARKER, OBSERVER, Layout, aligned_zeros
from nsdrill.compiler.functions import LaneFunction, compiled, route
from nsdrill.data import Array
from nsdrill.errors import InputError
from nsdrill.kernel.loop import (
    COUNTERS,
    FINISHED,
    LANE_STEPS,
    PACKED_STEPS,
    QUEUE_END,
    QUEUE_NEXT,
    RUN_COLUMNS,
    SETTINGS,
    make_advance,
    places_of,
)
from nsdrill.kernel.own_pairs import pair_named
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import make_step, with_step
from nsdrill.records import dataclass

STEPS_PER_CALL = 20_000  # packed steps between two checks of the clock: some 20 ms
FEW = 24  # chains up to which one vector register per row is faster than two
DEFAULT_LANES, WIDE_LANES = 16, 32  # with two and with four vector registers per row
CACHE_FACTOR = 1.25  # largest size of the buffer with four of them, over that of the cache


def choose_lanes(chains: int) -> int:
    """The fastest number of lanes for this many chains, or ``$NSDRILL_LANES`` if set.
    The results do not depend on it.

    One chain needs one lane. With many chains, two vector registers per row hide the
    latencies of the instructions better than one; with four, the buffer no longer fits
    the first-level cache. With few, the longest chain takes as long as all others
    together, and a packed step of one register is shorter.
    """
    if configured := os.environ.get("NSDRILL_LANES"):
        if configured not in ("1", "2", "4", "8", "16", "32"):
            raise InputError(f"NSDRILL_LANES: found {configured}; allowed: 1, 2, 4, 8, 16 or 32.")
        return int(configured)
    if chains <= 1:
        return 1
    return 8 if chains <= FEW or not llvmlite.binding.get_host_cpu_features().get("avx512f") else DEFAULT_LANES


def widened(lanes: int, chains: int, rows: Layout) -> int:
    """``lanes``, or more of them where that makes so many chains with implicit friction
    faster. The results do not depend on it.

    Newton's iterations for the slips are one long chain of dependent instructions. Two
    vector registers per row hide half of its latency, four all of it: 1.1 to 1.3 times
    the speed, measured with a first-level cache of 48 KiB. Where the buffer is much
    larger than that cache, nothing is gained.
    """
    fits = rows.total * WIDE_LANES * 8 <= CACHE_FACTOR * first_level_cache()
    gains = rows.implicit != 0 and lanes == DEFAULT_LANES and chains >= 2 * FEW and fits
    return WIDE_LANES if gains and not os.environ.get("NSDRILL_LANES") else lanes


@lru_cache
def first_level_cache() -> int:
    """Bytes of the first-level data cache, 0 where it is unknown."""
    try:
        for index in Path("/sys/devices/system/cpu/cpu0/cache").glob("index*"):
            level, kind = ((index / name).read_text().strip() for name in ("level", "type"))
            if level == "1" and kind == "Data":
                return 1024 * int((index / "size").read_text().strip().removesuffix("K"))
    except (OSError, ValueError):
        pass
    return 0


@dataclass(frozen=True)
class Compiled:
    """The compiled functions for one number of lanes: the model's right-hand side, the
    observer, and the observer's marker, which is called at the marks of a run."""

    right_hand_side: LaneFunction
    observer: LaneFunction
    marker: LaneFunction


@lru_cache
def unobserved() -> tuple[LaneFunction, LaneFunction]:
    """A compiled observer and a marker that do nothing, for runs of which only the
    final state is needed."""

    @compiled(OBSERVER)
    def observe_nothing(b, store):
        pass

    @compiled(MARKER)
    def mark_nothing(b, store, i, mark, outcome, column):
        pass

    return observe_nothing, mark_nothing


@dataclass(frozen=True)
class Runs:
    """Runs of one model; arrays over the n runs.

    - ``parameters`` [n, parameters];
    - ``state_scales`` [n, states]: the absolute tolerance of a state is the relative
      one times its scale;
    - ``frame_rates`` [n, slopes]: the rate of a position minus its velocity;
    - ``phase_rate`` [n] [rad/s];
    - ``first_step`` [n] [s]; 0 in a run of a chain that goes on with the step of the
      run before;
    - ``initial`` [n, states + 1], the phase last;
    - ``transient`` and ``observe`` [n] [s], if they differ from those of the batch;
    - ``halves`` [n] [s], the mark at half of the observation, at which a step ends, if it
      is not there: at ``transient`` for observers that do not compare the halves.
    """

    parameters: Array
    state_scales: Array
    frame_rates: Array
    phase_rate: Array
    first_step: Array
    initial: Array
    transient: Array | None = None
    observe: Array | None = None
    halves: Array | None = None

    def __len__(self) -> int:
        return len(self.parameters)

    def __getitem__(self, part: Any) -> Runs:
        """Some of the runs."""
        arrays = ((one.name, getattr(self, one.name)) for one in fields(self))
        return replace(self, **{name: array[part] for name, array in arrays if array is not None})


@dataclass
class FinishedRuns:
    """Runs that ended, in that order; arrays over these runs."""

    job: Array  #: the ids given to :meth:`Batch.add`, in a sweep the numbers of its points
    status: Array
    accepted: Array
    rejected: Array
    initial: Array  #: [runs, states + 1], the phase last
    final: Array
    outcome: Array  #: the observer's columns
    parameters: Array


MANY_STEPS = 10**6  # of a run, from which it is looked at whether it will end
EVER_SHORTER = 1e-6  # of its mean step: one that is shorter ends at the limit


@dataclass(frozen=True)
class Slow:
    """A run that is under way: of how many ``steps`` up to its ``limit``, its last ``step`` [s],
    and its ``time`` [s] of the time at which it ``closes``."""

    steps: float
    limit: float
    step: float
    time: float
    closes: float

    @property
    def ends_at_limit(self) -> bool:
        """Whether it will reach the limit of steps before its end, by its steps so far."""
        if self.steps < MANY_STEPS:
            return False
        mean = self.time / self.steps
        return (
            self.steps + (self.closes - self.time) / max(mean, 1e-300) > self.limit or self.step < EVER_SHORTER * mean
        )


Times = float | Array


def _times(transient: Times, observe: Times) -> dict[str, Times]:
    """The times of the marks of a run [s], and its least step, which still changes the
    time at the end of the run."""
    closes = transient + observe
    return {
        "least_step": 16 * np.finfo(float).eps * closes,
        "opens": transient,
        "halves": transient + 0.5 * observe,
        "closes": closes,
    }


def _as_quiet_as_machine_code() -> AbstractContextManager[None]:
    """The interpreter computes with numpy's numbers, which warn of a division by zero also
    in the side of a condition that is not chosen."""
    return np.errstate(all="ignore") if route() == "interpreter" else nullcontext()


class Batch:
    """``lanes`` lanes with room for ``slots`` runs.

    ``store`` is the observer's store and ``outcome_width`` the number of columns of its
    outcome.
    """

    def __init__(
        self, lanes: int, slots: int, rows: Layout, store: Array, outcome_width: int, simulation: Simulation
    ) -> None:
        self.lanes, self.stepper = lanes, simulation.stepper
        self.rows = rows = with_step(pair_named(self.stepper), rows)
        self._buffer = aligned_zeros(rows.total * lanes)
        self._store = store
        self._lane = np.full(3 * lanes, -1, dtype=np.int64)
        self._table = np.zeros((slots, rows.parameters + rows.states + rows.slopes + len(SETTINGS)))
        self._state = np.zeros((slots, rows.states + 1))
        self._successor = np.full(slots, -1, dtype=np.int64)
        self._job = np.full(slots, -1, dtype=np.int64)
        self._queue = np.zeros(slots, dtype=np.int64)
        self._outbox = np.zeros((slots, len(RUN_COLUMNS) + rows.states + 1 + outcome_width))
        self._finished = np.zeros(slots, dtype=np.int64)
        self._counters = np.zeros(COUNTERS, dtype=np.int64)
        self._free = list(range(slots))[::-1]
        self.settings = self._settings(simulation)

    @staticmethod
    def _settings(simulation: Simulation) -> dict[str, Times]:
        return {
            **_times(simulation.transient, simulation.observe),
            "per_rtol": 1.0 / simulation.rtol,
            "limit": float(simulation.max_steps),
        }

    @property
    def slots(self) -> int:
        """How many runs there is room for."""
        return len(self._job)

    @property
    def free(self) -> int:
        """How many more runs there is room for."""
        return len(self._free)

    @property
    def waiting(self) -> int:
        """Runs in the queue, not yet in a lane."""
        return int(self._counters[QUEUE_END] - self._counters[QUEUE_NEXT])

    @property
    def idle(self) -> bool:
        """Whether no run is in a lane or in the queue."""
        return self.waiting == 0 and bool(np.all(self._lane[: self.lanes] < 0))

    @property
    def proposed(self) -> float:
        """The step proposed in the first lane [s], for a run without a first step."""
        return float(self._buffer[self._proposed])

    @proposed.setter
    def proposed(self, step: float) -> None:
        self._buffer[self._proposed] = step

    @property
    def _proposed(self) -> int:
        return (self.rows.control + CONTROL.index("proposed")) * self.lanes

    @property
    def lane_steps(self) -> int:
        """Steps tried by the runs that ended, over all lanes."""
        return int(self._counters[LANE_STEPS])

    @property
    def packed_steps(self) -> int:
        return int(self._counters[PACKED_STEPS])

    def slowest(self) -> Slow | None:
        """The run in a lane that has made the most steps; None where all are idle."""
        running = np.flatnonzero(self._lane[: self.lanes] >= 0)
        if not running.size:
            return None

        def control(name: str) -> Array:
            row = self.rows.control + CONTROL.index(name) if name in CONTROL else getattr(self.rows, name)
            return self._buffer[row * self.lanes : (row + 1) * self.lanes][running]

        steps = control("accepted") + control("rejected")
        at = int(np.argmax(steps))
        setting = len(self._table[0]) - len(SETTINGS)
        closes = self._table[self._lane[running[at]], setting + SETTINGS.index("closes")]
        values = (steps[at], control("limit")[at], control("step")[at], control("time")[at], closes)
        return Slow(*map(float, values))

    def add(self, job: Array, runs: Runs) -> None:
        """Append one chain: runs each of which starts from the state reached by the one
        before.

        ``job`` [n] ids. The first row of ``runs.initial`` is the state of the first
        run; the others are used where the run before failed. ValueError if there is no
        room for all runs.
        """
        slots = self._fill_slots(job, runs)
        self._successor[slots[:-1]] = slots[1:]
        self._enqueue(slots[:1])

    def add_many(self, job: Array, runs: Runs) -> None:
        """Append independent runs; arguments as for :meth:`add`."""
        self._enqueue(self._fill_slots(job, runs))

    def _fill_slots(self, job: Array, runs: Runs) -> Array:
        if len(job) > self.free:
            raise ValueError(f"{len(job)} runs for {self.free} free slots")
        slots = np.array([self._free.pop() for _ in range(len(job))], dtype=np.int64)
        settings: dict[str, Times] = {**self.settings, "phase_rate": runs.phase_rate, "first_step": runs.first_step}
        if runs.transient is not None and runs.observe is not None:
            settings |= _times(runs.transient, runs.observe)
        if runs.halves is not None:
            settings["halves"] = runs.halves
        columns = np.concatenate([runs.parameters, runs.state_scales, runs.frame_rates], axis=1)
        self._table[slots, : columns.shape[1]] = columns
        for column, name in enumerate(SETTINGS, start=columns.shape[1]):
            self._table[slots, column] = settings[name]
        self._state[slots] = runs.initial
        self._job[slots] = job
        self._successor[slots] = -1
        return slots

    def _enqueue(self, slots: Array) -> None:
        end = int(self._counters[QUEUE_END])
        self._queue[(end + np.arange(len(slots))) % len(self._queue)] = slots
        self._counters[QUEUE_END] = end + len(slots)

    def run_alone(self, parts: Compiled) -> FinishedRuns:
        """Advance until the only run of the batch has ended, or nobody waits for it."""
        while True:
            interrupt.check_wanted()
            done = self.advance(parts, 0.2, True)
            if len(done.job):
                return done

    def run_chain(self, parts: Compiled) -> FinishedRuns:
        """Advance until the only chain of the batch has ended; its runs in order."""
        done: list[FinishedRuns] = []
        while not self.idle:
            interrupt.check_wanted()
            done.append(self.advance(parts, 0.2, True))
        if len(done) == 1:
            return done[0]
        names = [item.name for item in fields(FinishedRuns)]
        return FinishedRuns(*(np.concatenate([getattr(one, name) for one in done]) for name in names))

    def advance(self, parts: Compiled, seconds: float, drain: bool) -> FinishedRuns:
        """Advance for about ``seconds`` of wall time, or until all runs have ended or,
        unless ``drain``, one more lane is idle. Returns the runs that ended, whose
        slots become free."""
        deadline = time.perf_counter() + seconds
        advance, stepper = make_advance(), make_step(pair_named(self.stepper), self.lanes, self.rows)
        places = places_of(self.lanes, self.rows, self._outbox.shape[1])
        while True:
            before = self.packed_steps
            with _as_quiet_as_machine_code():
                advance(
                    places,
                    self._lane,
                    self._successor,
                    self._queue,
                    self._finished,
                    self._counters,
                    self._buffer,
                    self._store,
                    self._table.ravel(),
                    self._state.ravel(),
                    self._outbox.ravel(),
                    drain,
                    STEPS_PER_CALL,
                    parts.right_hand_side,
                    parts.observer,
                    parts.marker,
                    stepper,
                )
            if self.packed_steps - before < STEPS_PER_CALL or time.perf_counter() >= deadline:
                return self._collect()

    def __getstate__(self) -> dict[str, Any]:
        """Of the outbox, which is most of the bytes, only the rows of the runs in the
        lanes: between two calls of :meth:`advance` all others are collected or have not
        begun."""
        running = self._lane[: self.lanes]
        running = running[running >= 0]
        return {**self.__dict__, "_outbox": (self._outbox.shape, running, self._outbox[running])}

    def __setstate__(self, data: dict[str, Any]) -> None:
        self.__dict__.update(data)
        shape, running, rows = data["_outbox"]
        self._outbox = np.zeros(shape)
        self._outbox[running] = rows
        for name in ("_buffer", "_store"):
            array = aligned_zeros(data[name].size)
            array[:] = data[name]
            setattr(self, name, array)

    def _collect(self) -> FinishedRuns:
        count = int(self._counters[FINISHED])
        self._counters[FINISHED] = 0
        slots = self._finished[:count]
        states = self.rows.states
        out = self._outbox[slots]
        self._free.extend(slots[::-1].tolist())
        return FinishedRuns(
            job=self._job[slots],
            status=out[:, 0].astype(np.int8),
            accepted=out[:, 1].astype(np.int64),
            rejected=out[:, 2].astype(np.int64),
            initial=self._state[slots],
            final=out[:, len(RUN_COLUMNS) : len(RUN_COLUMNS) + states + 1],
            outcome=out[:, len(RUN_COLUMNS) + states + 1 :],
            parameters=self._table[slots, : self.rows.parameters],
        )
