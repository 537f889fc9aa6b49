"""A batch whose lanes are the threads of a device, such as a GPU: its runs, slots and
results are those of :class:`nsdrill.kernel.batch.Batch`, and so are the bits.

It is advanced by launches, each of a number of steps that takes a fraction of a second.
Between them an interrupt is noticed, results are saved and runs are added.
"""

from __future__ import annotations

import time
from types import TracebackType
from typing import Any, Self

import numpy as np

from nsdrill.abi import Layout
from nsdrill.data import Array
from nsdrill.errors import DeviceMemoryError, count
from nsdrill.kernel.batch import Batch, Compiled, FinishedRuns, Runs, unobserved
from nsdrill.kernel.launcher import Launcher, Memory
from nsdrill.kernel.loop import FINISHED, LANE_STEPS, PACKED_STEPS, QUEUE_END, QUEUE_NEXT, RUN_COLUMNS, SETTINGS
from nsdrill.kernel.own_pairs import pair_named
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import with_step
from nsdrill.kernel.thread import (
    LANE,
    OBSERVATION,
    OBSERVED,
    OWN,
    PARKED_END,
    PARKED_LIMIT,
    PARKED_NEXT,
    SHARED,
    TRANSIENT,
    USED_UP,
    WHOLE,
    make_thread,
    parked_rows,
)

LAUNCH_SECONDS = 0.25  # of one launch
FIRST_BUDGET = 200  # steps of each thread in the first launch of a batch
FEWEST_STEPS = 10.0  # of a launch
FASTER = 4.0  # times the budget of the launch before, at most
SLOTS_PER_THREAD = 4  # unless a number of slots is given
MEMORY_SHARE = 0.8  # of what is free that a batch takes at most
FEWEST_THREADS = 32  # that run together on any GPU
# The arguments of a thread in memory, in their order; the first and the third are of each
# phase.
GIVEN = (
    *("saved", "stores", "lanes", "successor", "queue", "finished", "counters"),
    *("table", "state", "outbox", "done", "parked", "waiting"),
)


class DeviceBatch(Batch):
    """``lanes`` threads of a device with room for ``slots`` runs, used as a
    :class:`nsdrill.kernel.batch.Batch`.

    ``launcher`` is the device. ``parts`` are the functions of the model and of its
    observer made for one lane (``make_...(1)``); their addresses are not needed.
    ``rows``, ``outcome_width`` and ``simulation`` are those of a Batch, ``store`` is that
    of a Batch of one lane, of which every thread gets a copy. ``threads`` are those that
    run at the same time on the device, unless a number is given. ``slots`` are some
    times as many, unless a number is given: a thread whose run ends takes the next from
    the queue, which is on the device; runs that are not yet added have to wait until
    :meth:`advance` returns.

    Where the memory of the device is too small there are fewer threads and slots than
    that, and ``shortage`` says so; it is empty otherwise. ``resident`` is how many
    threads of this kind run at the same time on the device.

    Runs that are ``independent``, no chains, may be added to a batch that is made for
    them: their transients and their observations are then launches of their own, which
    is faster, if the observer allows it. It does unless there are tangent states.

    The kernel is compiled when the batch is made, which takes some seconds where it is
    not known. A batch stays in its process; any thread of that may use it, one at a
    time. :meth:`close`, or the end of a ``with`` block, gives the memory of the device
    back.
    """

    def __init__(
        self,
        launcher: Launcher,
        parts: Compiled,
        rows: Layout,
        store: Array,
        outcome_width: int,
        simulation: Simulation,
        slots: int | None = None,
        threads: int | None = None,
        independent: bool = False,
    ) -> None:
        pair = pair_named(simulation.stepper)
        layout = with_step(pair, rows)
        columns = len(RUN_COLUMNS) + layout.states + 1 + outcome_width
        self.device = launcher
        self._memory: dict[str, Memory] = {}
        self._kernels = [
            launcher.load(make_thread(pair, layout, columns, store.size, parts.right_hand_side, *functions, phase))
            for phase, functions in (
                ((TRANSIENT, unobserved()), (OBSERVATION, (parts.observer, parts.marker)))
                if independent and not layout.tangent_states
                else ((WHOLE, (parts.observer, parts.marker)),)
            )
        ]
        self._phases = len(self._kernels)
        self.resident = resident = max(kernel.resident for kernel in self._kernels)
        wanted_slots = slots or SLOTS_PER_THREAD * (threads or resident)
        wanted = min(threads or resident, wanted_slots)
        threads, slots = self._allocate(wanted, wanted_slots, layout, columns, store.size)
        super().__init__(1, slots, rows, store, outcome_width, simulation)
        self.lanes = threads
        self._outbox = self._outbox[:0]  # it is on the device
        self.shortage = ""
        if (threads, slots) != (wanted, wanted_slots):
            self.shortage = (
                f"{launcher.name} has memory for {threads} of {count(wanted, 'thread')} and for {slots} of "
                f"{count(wanted_slots, 'run')} at a time, and may be slower for it"
            )
        self._columns, self._done_columns = columns, columns + layout.states + 1
        self._memory["stores"].write(np.tile(store, threads))
        lanes = np.zeros((threads, OWN), np.int64)
        lanes[:, :LANE] = -1
        for phase in range(self._phases):
            self._memory[f"lanes {phase}"].write(lanes)
        self._counters = np.zeros(SHARED, np.int64)
        self._budget = float(FIRST_BUDGET)
        self._packed_steps = 0
        self._new: list[Array] = []  # slots whose runs are not yet on the device
        self._has_chains = False

    def _allocate(self, threads: int, slots: int, rows: Layout, columns: int, store_size: int) -> tuple[int, int]:
        """Take the memory for so many threads and slots, or for fewer; for how many."""
        while True:
            phases = range(self._phases)
            floats = {
                **{f"saved {phase}": rows.stepper * threads for phase in phases},
                "stores": store_size * threads,
                "table": (rows.parameters + rows.states + rows.slopes + len(SETTINGS)) * slots,
                "state": (rows.states + 1) * slots,
                "outbox": columns * slots,
                "done": (columns + rows.states + 1) * slots,
                "parked": len(parked_rows(rows)) * slots if self._phases > 1 else 0,
            }
            integers = {
                **{f"lanes {phase}": OWN * threads for phase in phases},
                "counters": SHARED,
                **dict.fromkeys(("successor", "queue", "finished", "waiting"), slots),
            }
            needed = 8 * (sum(floats.values()) + sum(integers.values()))
            try:
                if needed > MEMORY_SHARE * self.device.free_memory() and threads > FEWEST_THREADS:
                    raise DeviceMemoryError
                for sizes, kind in ((floats, np.float64), (integers, np.int64)):
                    for name, size in sizes.items():
                        self._memory[name] = self.device.zeros(size, kind)
                return threads, slots
            except DeviceMemoryError:
                self.close()
                if slots > threads:
                    slots = max(threads, slots // 2)
                elif threads > FEWEST_THREADS:
                    threads = slots = max(FEWEST_THREADS, threads // 2)
                else:
                    raise

    def close(self) -> None:
        """Give the memory of the device back. The batch cannot be used any more."""
        while self._memory:
            self._memory.popitem()[1].free()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def __getstate__(self) -> dict[str, Any]:
        raise TypeError(
            "a batch of a device cannot be sent to another process: its runs are in the memory of the device"
        )

    @property
    def idle(self) -> bool:
        """Whether no run is in a thread or in the queue."""
        return self.free == self.slots

    @property
    def packed_steps(self) -> int:
        """Steps of the thread that has made most."""
        return self._packed_steps

    def _fill_slots(self, job: Array, runs: Runs) -> Array:
        slots = super()._fill_slots(job, runs)
        self._new.append(slots)
        return slots

    def add(self, job: Array, runs: Runs) -> None:
        """Append one chain, as :meth:`Batch.add`. ValueError for a batch of runs that are
        independent."""
        if len(job) > 1 and self._phases > 1:
            raise ValueError("a chain is added to a batch that was made for independent runs")
        super().add(job, runs)
        self._has_chains |= len(job) > 1

    def advance(self, parts: Compiled, seconds: float, drain: bool) -> FinishedRuns:
        """Advance for about ``seconds`` of wall time, or until all runs have ended or,
        unless ``drain``, the queue is empty. Returns the runs that ended, whose slots
        become free. ``parts`` are those that the batch was made for."""
        deadline = time.perf_counter() + seconds
        self._hand_over()
        runs = self.slots - self.free
        while runs > 0:
            began = time.perf_counter()
            self._launch()
            now = time.perf_counter()
            if self._counters[FINISHED] == runs:
                break
            if self._counters[USED_UP]:  # the launch took as long as its steps do
                most = min(LAUNCH_SECONDS, max(seconds, 0.0))
                self._budget = max(self._budget * min(FASTER, most / (now - began)), FEWEST_STEPS)
            if now >= deadline or (self.waiting == 0 and not drain):
                break
        return self._collect()

    def _hand_over(self) -> None:
        """Copy the runs that were added to the device."""
        memory, rows = self._memory, self.rows
        if self._new:
            new = np.concatenate(self._new)
            self._new.clear()
            first, end = int(new.min()), int(new.max()) + 1
            starts = rows.states + 1
            if self._has_chains and len(new) < end - first:
                # Other runs between them may start where the run before them ended.
                state = memory["state"].read((end - first) * starts, first * starts).reshape(-1, starts)
                state[new - first] = self._state[new]
                self._state[first:end] = state
            for name, array in (("table", self._table), ("state", self._state), ("successor", self._successor)):
                part = array[first:end]
                memory[name].write(part, first * (part.size // len(part)))
            memory["queue"].write(self._queue)

    def _launch(self) -> None:
        """Let all threads work for a number of steps."""
        memory, counters = self._memory, self._counters
        counters[USED_UP] = 0
        memory["counters"].write(counters)
        observing = counters[PARKED_END] - counters[OBSERVED]
        for phase, kernel in enumerate(self._kernels):
            # Observations wait until there are some for threads whose run ends, too, or no
            # further runs.
            if phase == 0 or observing >= 2 * self.lanes or (self.waiting == 0 and observing > 0):
                given = [memory[f"{name} {phase}" if name in ("saved", "lanes") else name] for name in GIVEN]
                kernel.launch(self.lanes, [*given, int(self._budget), self.lanes])
        self.device.wait()
        counters[:] = memory["counters"].read(SHARED)
        # Threads that found a queue empty have counted on.
        counters[QUEUE_NEXT] = min(counters[QUEUE_NEXT], counters[QUEUE_END])
        counters[PARKED_NEXT] = min(counters[PARKED_NEXT], counters[PARKED_LIMIT])
        counters[PARKED_LIMIT] = counters[PARKED_END]

    def _collect(self) -> FinishedRuns:
        number, rows = int(self._counters[FINISHED]), self.rows
        self._counters[FINISHED] = 0
        slots = self._memory["finished"].read(number)
        out = self._memory["done"].read(number * self._done_columns).reshape(number, self._done_columns)
        if number:
            self._packed_steps = sum(
                int(self._memory[f"lanes {phase}"].read(OWN * self.lanes)[LANE + PACKED_STEPS :: OWN].max())
                for phase in range(self._phases)
            )
            self._counters[LANE_STEPS] += int(out[:, 1:3].sum())
        # Threads end in any order; that of the slots depends on the runs alone.
        order = np.argsort(slots)
        slots, out = slots[order], out[order]
        self._free.extend(slots[::-1].tolist())
        state, outcome = len(RUN_COLUMNS), len(RUN_COLUMNS) + rows.states + 1
        return FinishedRuns(
            job=self._job[slots],
            status=out[:, 0].astype(np.int8),
            accepted=out[:, 1].astype(np.int64),
            rejected=out[:, 2].astype(np.int64),
            initial=out[:, self._columns :],
            final=out[:, state:outcome],
            outcome=out[:, outcome : self._columns],
            parameters=self._table[slots, : rows.parameters],
        )
