"""Run a study: from points to a results file that holds them all, or to a log that can be taken up again."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill.app.provenance import provenance
from nsdrill.errors import FileError, InputError
from nsdrill.kernel.gang import choose_lanes
from nsdrill.store import (
    MemoryLog,
    RunLog,
    Sink,
    claim,
    collect,
    log_from_results,
    open_results,
    part_path,
    record_dtype,
    write_results,
)  # fmt: skip
from nsdrill.study.resolved import differences
from nsdrill.study.study import Study
from nsdrill.sweep.engine import Engine, Progress, Start
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work, compiled_parts
from nsdrill.variables import OK, PENDING

Watch = Callable[[Progress], None]
SYNC_SECONDS = 1.0


@dataclass(frozen=True)
class Outcome:
    """What became of a run: points in all and failed, seconds of computing, steps tried, share of lanes in use."""

    path: Path | None
    points: int
    failed: int
    seconds: float
    steps: int
    already: int


class Interrupted(KeyboardInterrupt):
    """The run was interrupted; all finished points are safe in ``part``."""

    def __init__(self, part: Path | None, done: int, total: int) -> None:
        super().__init__()
        self.part, self.done, self.total = part, done, total


def run(
    study: Study,
    path: str | os.PathLike[str] | None = None,
    *,
    workers: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
) -> Any:
    """Run ``study`` and write the results file ``path``; without a path, keep the results in memory.

    Gives the results as :func:`nsdrill.open_results` does (an xarray Dataset where xarray is installed), or as
    :class:`nsdrill.data.Results` without a path. ``workers`` defaults to the processors at hand. InputError and
    FileError as the command ``nsdrill run`` reports them.
    """
    if path is None:
        log = MemoryLog(_header(study), plan_of(study).points, study.record.peaks)
        _compute(study, log, workers or processors(), lambda progress: None, None)
        return collect(log)
    run_study(study, path, workers=workers, overwrite=overwrite, resume=resume)
    return open_results(path)


def run_study(
    study: Study,
    path: str | os.PathLike[str],
    *,
    workers: int | None = None,
    overwrite: bool = False,
    resume: bool = False,
    retry_failed: bool = False,
    watch: Watch = lambda progress: None,
    executor: Executor | None = None,
    lanes: int | None = None,
) -> Outcome:
    """Run ``study`` into the results file ``path``, as the command does; raises :class:`Interrupted` on an interrupt.

    ``executor`` replaces the threads of this machine.
    """
    path = Path(path)
    workers = workers or processors()
    if workers < 1:
        raise InputError(f"--workers: found {workers}; allowed: 1 or more.")
    plan = plan_of(study)
    state = claim(path, overwrite=overwrite, resume=resume)
    part = part_path(path)
    log: RunLog
    if state == "new":
        log = RunLog.create(part, _header(study), plan.points, study.record.peaks)
    elif state == "resume":
        log = RunLog.open(part)
    else:
        log = log_from_results(path, part)
    with log:
        if state != "new":
            try:
                _check_same(study, log, part if state == "resume" else path)
            except FileError:
                if state == "finished":
                    log.discard()
                raise
        if retry_failed:
            status = log.status()
            log.clear(np.flatnonzero((status != PENDING) & (status != OK)))
        already = int(np.count_nonzero(log.done()))
        if state == "finished" and already == plan.points:
            log.discard()
            return Outcome(path, plan.points, _failed(log), 0.0, 0, already)
        begun = time.perf_counter()
        try:
            progress = _compute(study, log, workers, watch, executor, lanes)
            seconds = time.perf_counter() - begun
            write_results(path, log)
        except KeyboardInterrupt:
            log.sync()
            raise Interrupted(part, int(np.count_nonzero(log.done())), plan.points) from None
        failed = _failed(log)
        log.discard()
    return Outcome(path, plan.points, failed, seconds, progress.lane_steps, already)


def plan_of(study: Study) -> Plan:
    """The points and chains of a study."""
    return Plan(study.axes, study.procedure, study.along)


def work_of(study: Study) -> Work:
    """All that decides the numbers of a study."""
    return Work(
        plan_of(study), study.parameters, study.initial, study.simulation, study.thresholds, study.record)


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _header(study: Study) -> dict[str, Any]:
    coords = {"procedure": list(plan_of(study).procedures), **study.axes}
    return {"coords": coords, "attrs": provenance(study, "run")}


def _failed(log: Sink) -> int:
    status = log.status()
    return int(np.count_nonzero((status != OK) & (status != PENDING)))


def _compute(
    study: Study, log: Sink, workers: int, watch: Watch, executor: Executor | None, lanes: int | None = None
) -> Progress:
    work = work_of(study)
    plan = work.plan
    if lanes is None:
        lanes = choose_lanes(-(-plan.chains // workers))
    compiled_parts(lanes, *work.variant)
    kind = record_dtype(study.record.peaks)
    synced = time.monotonic()

    def deliver(points: np.ndarray, columns: dict[str, np.ndarray]) -> None:
        nonlocal synced
        records = np.zeros(len(points), kind)
        for name in kind.names or ():
            records[name] = columns[name]
        log.write(points, records)
        if time.monotonic() - synced > SYNC_SECONDS:
            log.sync()
            synced = time.monotonic()

    own: AbstractContextManager[Executor] = ThreadPoolExecutor(workers)
    starts, pending = _left(plan, log)
    with own as threads:
        engine = Engine(work, executor or threads, workers, lanes, deliver, watch, remote=executor is not None)
        progress = engine.run(starts, pending)
    log.sync()
    return progress


def _left(plan: Plan, log: Sink) -> tuple[list[Start], np.ndarray]:
    """What is still to run: where each chain goes on, and which points are pending."""
    done = log.done()
    pending = np.flatnonzero(~done)
    if plan.chain_length == 1:
        return [], pending
    starts = []
    for chain in range(plan.chains):
        points = plan.points_of(chain, np.arange(plan.chain_length))
        place = int(np.argmin(done[points])) if not done[points].all() else plan.chain_length
        if place == plan.chain_length:
            continue
        state = None
        if place > 0:
            before = log.read(int(points[place - 1]), int(points[place - 1]) + 1)[0]
            state = np.array(before["final_state"]) if before["status"] == OK else None
        starts.append(Start(chain, place, state))
    return starts, pending


def _check_same(study: Study, log: RunLog, where: Path) -> None:
    """FileError where the log was made from another study or by another version of the model."""
    import json

    attrs = log.header["attrs"]
    if attrs.get("study_sha256") != study.sha256:
        changes = differences(json.loads(attrs.get("study_resolved", "{}")), study.resolved)
        listed = "; ".join(f"{key}: {old} there, {new} here" for key, old, new in changes[:8] if key != "title")
        raise FileError(
            f"{where}: made from another study ({listed or 'the digests differ'}). Resume it with the study it was "
            "made from, or start anew by --overwrite."
        )
    mine = provenance(study, "run")
    for key, what in (("nsdrill_version", "nsdrill"), ("model_digest", "the compiled model")):
        if attrs.get(key) != mine[key]:
            raise FileError(
                f"{where}: made by another version of {what} ({attrs.get(key)} there, {mine[key]} here), whose numbers "
                "may differ. Finish it with that version, or start anew by --overwrite."
            )
