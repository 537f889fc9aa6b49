"""Drive the engine from a test, in memory: points in, columns of the results file
out."""

from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
from main_model.cases import parameters_of
from reference import Case

from nsdrill.kernel.batch import FinishedRuns
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.parameters import Initial
from nsdrill.models.registry import described
from nsdrill.models.responses import Thresholds
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.engine import ChainStarts, Engine
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work, compiled_parts
from nsdrill.variables import MODEL

SHORT = Simulation(transient=5.0, observe=10.0, rtol=1e-6)


def work_for(
    case: Case,
    simulation: Simulation = SHORT,
    *,
    procedure: str = "same",
    along: str | None = None,
    initial: Initial = Initial(),  # noqa: B008  (frozen)
    peaks: int = 32,
    stuck_below: float | None = None,
    **axes: Any,
) -> Work:
    """A sweep of ``case``; axes that are not given have the case's single value."""
    values = {"depth": case.depth, "wob": case.wob, "rotary_speed": case.speed} | axes
    plan = Plan({name: np.atleast_1d(np.asarray(v, dtype=float)) for name, v in values.items()}, procedure, along)
    thresholds = Thresholds() if stuck_below is None else replace(Thresholds(), stuck_below=stuck_below)
    return Work(plan, parameters_of(case), initial, simulation, thresholds, Record(peaks=peaks), described(MODEL))


def run_work(
    work: Work,
    lanes: int = 8,
    workers: int = 1,
    quantum_seconds: float = 0.25,
    executor: Executor | None = None,
    starts: ChainStarts | None = None,
    pending: np.ndarray | None = None,
) -> dict[str, np.ndarray]:
    """All columns, one row a point; points that were not run have status 0 and NaN."""
    columns: dict[str, np.ndarray] = {}

    def deliver(points: np.ndarray, found: dict[str, np.ndarray]) -> None:
        for name, values in found.items():
            if name not in columns:
                empty = np.nan if values.dtype.kind == "f" else 0
                columns[name] = np.full((work.plan.points, *values.shape[1:]), empty, values.dtype)
            columns[name][points] = values

    with ThreadPoolExecutor(workers) as threads:
        Engine(work, executor or threads, workers, lanes, deliver, quantum_seconds=quantum_seconds).run(starts, pending)
    return columns


def run_from(work: Work, states: np.ndarray | None = None, lanes: int = 8) -> dict[str, np.ndarray]:
    """The points of ``work``, each from its own initial state, those of the study or
    ``states`` [points, 9]; one batch, no engine."""
    points = np.arange(work.plan.points)
    batch, runs = work.new_batch(lanes, len(points)), work.prepare(points)
    batch.add_many(points, runs if states is None else replace(runs, initial=states))
    return collect(work, finish(work, batch))


def finish(work: Work, batch: Any, seconds: float = 0.05) -> list[FinishedRuns]:
    """Advance a batch until it is idle."""
    parts = compiled_parts(batch.lanes, work.program)
    done = []
    while not batch.idle:
        done.append(batch.advance(parts, seconds, True))
    return done


def collect(work: Work, done: list[FinishedRuns]) -> dict[str, np.ndarray]:
    """Columns of finished runs, in the order of their job numbers."""
    job = np.concatenate([d.job for d in done])
    parts = [work.columns(d) for d in done if len(d.job)]
    return {name: np.concatenate([p[name] for p in parts])[np.argsort(job)] for name in parts[0]}


def same_bits(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> bool:
    """Whether all columns agree to the last bit, NaN for NaN."""
    return a.keys() == b.keys() and all(a[n].tobytes() == b[n].tobytes() for n in a)
