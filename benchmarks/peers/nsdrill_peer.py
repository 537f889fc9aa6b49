"""nsdrill itself: through the engine as a sweep runs, or the bare batch with an
observer that observes nothing."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.peers import NO_OBSERVERS, MissingPeer, Result, Stopwatch
from benchmarks.workload import STATES, Array, Started, sweep, with_rtol


@dataclass
class Nsdrill:
    """``lanes`` lanes; ``observed`` false replaces the observer, for comparison only:
    nsdrill has no such mode."""

    lanes: int
    observed: bool = True
    lacks: str = "nothing: observers, peaks, classification, vector tolerance, RMS norm"
    columns: dict[str, Array] = field(default_factory=dict)
    lane_use: float = 0.0

    def __post_init__(self) -> None:
        self.name = f"nsdrill, {self.lanes} lane{'s' if self.lanes > 1 else ''}"
        if not self.observed:
            self.name += ", null observer"
            self.lacks = NO_OBSERVERS + "; not a mode of nsdrill"

    def run(self, work: Started, rtol: float | None = None) -> Result:
        work = work if rtol is None else with_rtol(work, rtol)
        if not self.observed:
            return self._run_blind(work)
        with Stopwatch() as watch:
            self.columns, progress = sweep(work, self.lanes)
        self.lane_use = progress.lanes_in_use
        steps = int(progress.lane_steps)
        return Result(watch.wall, watch.cpu, 6 * steps, steps, self.columns["final_state"][:, :STATES])

    def _run_blind(self, work: Started) -> Result:
        try:
            from nsdrill.kernel.batch import unobserved
            from nsdrill.sweep.work import compiled_parts

            observer, marker = unobserved()
            parts = replace(compiled_parts(self.lanes, work.program), observer=observer, marker=marker)
            points = np.arange(work.plan.points)
            batch = work.new_batch(self.lanes, len(points))
            end = np.empty((len(points), STATES))
            tries = 0
            with Stopwatch() as watch:
                batch.add_many(points, work.prepare(points))
                while not batch.idle:
                    done = batch.advance(parts, 1.0, True)
                    end[done.job] = done.final[:, :STATES]
                    tries += int(np.sum(done.accepted + done.rejected))
        except (ImportError, AttributeError, TypeError) as error:
            raise MissingPeer(f"a kernel that takes any observer: {error}") from error
        return Result(watch.wall, watch.cpu, 6 * tries, tries, end)
