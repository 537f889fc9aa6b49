"""Run a study: from points to a results file that holds them all, or to a log that can
be taken up again."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill import interrupt
from nsdrill.app.attractors import write_attractors
from nsdrill.app.planned import chosen_of, kept_of, plan_of
from nsdrill.app.provenance import provenance, unlike
from nsdrill.app.refinement import RefinedSweep
from nsdrill.app.size import check_memory
from nsdrill.app.stages import RunStages, Watch, sweep
from nsdrill.app.trust import any_failed, forget_failed, verified, verify
from nsdrill.data import Results, differences, resolved_study
from nsdrill.errors import FileError, InputError
from nsdrill.kernel.batch import choose_lanes
from nsdrill.models.leaves import in_parts, values_at
from nsdrill.models.registry import model_named
from nsdrill.models.steepness import advice
from nsdrill.store import (
    MemoryLog,
    RunLog,
    Sink,
    Source,
    claim,
    collect,
    log_from_results,
    part_path,
    rewrite_log,
    write_results,
)
from nsdrill.study.resolved import digest
from nsdrill.study.study import Study
from nsdrill.study.written import told_changes
from nsdrill.sweep.engine import Progress
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work
from nsdrill.variables import PENDING, STEP_LIMIT, has_failed


@dataclass(frozen=True)
class RunResult:
    """What became of a run: points in all and failed, seconds of computing, steps
    tried, points that were there before; ``refinement`` has the root attributes that
    say how much was run of a refined sweep, ``advice`` what to do about points that
    reached the limit of their steps."""

    path: Path | None
    points: int
    failed: int
    seconds: float
    steps: int
    already: int
    refinement: Mapping[str, Any] = field(default_factory=dict)
    advice: str = ""


class Interrupted(KeyboardInterrupt):
    """The run was interrupted; all finished points are safe in ``part``, as the text
    says."""

    def __init__(self, log: RunLog) -> None:
        super().__init__(f"Interrupted: {log.recovery_text()}")
        self.part, self.done, self.total = log.path, int(np.count_nonzero(log.done())), log.n_points


def run_in_memory(
    study: Study,
    *,
    workers: int | None = None,
    watch: Watch = lambda progress: None,
    executor: Executor | None = None,
) -> Results:
    """Run ``study`` and keep the results in memory. ``workers`` defaults to the
    processors at hand; ``executor`` replaces the threads of this machine."""
    check_sweep(study)
    workers = checked_workers(workers)
    check_memory(plan_of(study), kept_of(study), in_file=False)
    log = MemoryLog(_header(study), plan_of(study).points, kept_of(study))
    _run_missing(study, log, workers, watch, executor)
    return collect(_results(study, plan_of(study), log))


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
) -> RunResult:
    """Run ``study`` into the results file ``path``, as the command does; raises
    :class:`Interrupted` on an interrupt.

    ``retry_failed`` goes on like ``resume``, but runs failed points once more;
    ``simulation.max_steps`` may then be larger than before. ``executor`` replaces the
    threads of this machine.
    """
    check_sweep(study)
    path = Path(path)
    workers = checked_workers(workers)
    plan = plan_of(study)
    check_memory(plan, kept_of(study), in_file=True)
    state = claim(path, overwrite=overwrite, resume=resume or retry_failed)
    part = part_path(path)
    log: RunLog | None = None
    try:
        if state == "new":
            log = RunLog.create(part, _header(study), plan.points, kept_of(study))
            if not overwrite and os.path.lexists(path):  # of a run that ended since we looked
                log.discard()
                raise FileError(
                    f"{path}: another process has just made this file. Choose another name, or "
                    f"replace it "
                    "by --overwrite."
                )
        elif state == "resume":
            log = RunLog.open(part)
        else:
            log = log_from_results(path, part)
        if state != "new":
            try:
                _check_same(study, log, part if state == "resume" else path, retry_failed)
            except FileError:
                if state == "finished":
                    log.discard()
                raise
            if retry_failed:
                log = _with_failed_pending(study, plan, log)
        already = int(np.count_nonzero(log.done()))
        if state == "finished" and _complete(study, plan, log):
            attrs = getattr(_results(study, plan, log), "attrs", {})
            log.discard()
            return RunResult(path, plan.points, _failed(log), 0.0, 0, already, attrs)
        begun = time.perf_counter()
        try:
            recovery_text = log.recovery_text
            with interrupt.telling(lambda: f"Interrupted: {recovery_text()}"):
                progress = _run_missing(study, log, workers, watch, executor, lanes)
                seconds = time.perf_counter() - begun
                results = _results(study, plan, log)
                write_results(path, results)
        except KeyboardInterrupt:
            log.sync()
            raise Interrupted(log) from None
        failed, what = _failed(log), _advice(study, plan, log)
        log.discard()
    finally:
        if log is not None:
            log.close()
    attrs = getattr(results, "attrs", {})
    return RunResult(path, plan.points, failed, seconds, progress.lane_steps, already, attrs, what)


def _advice(study: Study, plan: Plan, log: Sink) -> str:
    """What to do about points that reached the limit of their steps, where there are
    any."""
    points = np.flatnonzero(log.status() == STEP_LIMIT)
    if not len(points):
        return ""
    explicit = not chosen_of(study).points(points).all()
    values = plan.values(points)
    apart, there = next(in_parts(study.model, values))
    here = {key: value[there] for key, value in values.items()} | apart
    at = values_at(study.parameters, study.initial, here)
    return advice("explicit" if explicit else "implicit", study.model, at)


def work_of(study: Study) -> Work:
    """All that decides the numbers of a study."""
    return Work(
        plan_of(study),
        study.parameters,
        study.initial,
        study.simulation,
        study.thresholds,
        study.record,
        study.model,
    )


def check_sweep(study: Study) -> None:
    """InputError where the study is not one of a sweep, whose points each have one
    constant operating point."""
    source = study.source or "the study"
    if model_named(study.model).switches(study.parameters) is not None:
        raise InputError(
            f"{source}: found something that is switched on within the run (drive.on_at); "
            f"allowed: nothing, as the "
            "points of a sweep are observed in one lasting motion. Use nsdrill simulate."
        )
    if study.ramped and not study.swept:
        raise InputError(
            f"{source}: found no sweep, only a ramp in {_listed(study.ramped)}; allowed: at least "
            f"one axis to sweep. A "
            "ramp is one run: nsdrill simulate."
        )
    if study.ramped:
        raise InputError(
            f"{source}: found a ramp in {_listed(study.ramped)} beside a sweep of "
            f"{', '.join(study.swept)}; allowed: a "
            "constant value, or an axis of the sweep, which takes the place of the ramp. The "
            "points of a sweep have "
            "constant operating points; to follow the ramp, use nsdrill simulate."
        )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(f"operation.{name}" for name in names)


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def checked_workers(workers: int | None) -> int:
    """How many to run side by side, all processors by default; InputError for none."""
    if workers is not None and workers < 1:
        raise InputError(f"--workers: found {workers}; allowed: 1 or more.")
    return workers or processors()


def _header(study: Study) -> dict[str, Any]:
    plan = plan_of(study)
    coords: dict[str, Any] = {"procedure": list(plan.procedures), **plan.dimensions}
    if study.samples:
        coords["sample"] = list(range(study.samples))
        coords |= {one.name: study.drawn[one.short] for one in study.unknowns}
    if study.initial.starts:
        coords["start"] = list(range(study.initial.starts))
    attrs = {**provenance(study, "run"), "method": " and ".join(chosen_of(study).words())}
    return {"coords": coords, "attrs": attrs}


def _failed(log: Sink) -> int:
    status = log.status()
    return int(np.count_nonzero(has_failed(status)))


def _run_missing(
    study: Study,
    log: Sink,
    workers: int,
    watch: Watch,
    executor: Executor | None,
    lanes: int | None = None,
) -> Progress:
    """Run all that is missing: the points, those of the refinement, the checks."""
    work = work_of(study)
    chains = -(-work.plan.chains // workers) if lanes is None else 0
    lanes = lanes or choose_lanes(chains)
    own: AbstractContextManager[Executor] = ThreadPoolExecutor(workers)
    with own as threads:
        stages = RunStages(
            log, executor or threads, workers, lanes, watch, executor is not None, chains
        )
        if study.refined:
            RefinedSweep(study, work.plan, log).run(stages, work)
        else:
            sweep(stages, work)
        if study.simulation.verify:
            verify(stages, work)
    log.sync()
    if work.plan.starts:
        write_attractors(study, work.plan, log)
    return stages.progress


def _complete(study: Study, plan: Plan, log: Sink) -> bool:
    """Whether nothing is left to run."""
    there = RefinedSweep(study, plan, log).complete if study.refined else bool(log.done().all())
    return there and (not study.simulation.verify or verified(log))


def _results(study: Study, plan: Plan, log: Sink) -> Source:
    """What goes into the file, from a complete log."""
    return RefinedSweep(study, plan, log).results() if study.refined else log


def _with_failed_pending(study: Study, plan: Plan, log: RunLog) -> RunLog:
    """The log with its failed points pending, and with those that follow them in a
    chain, which may become others. All in one step, as no chain may be left with a
    beginning and an end that do not belong together."""
    status = log.status()
    again = has_failed(status)
    if plan.chain_length > 1:
        for chain in range(plan.chains):
            points = plan.points_of(chain, np.arange(plan.chain_length))
            again[points] = np.logical_or.accumulate(again[points])
    checked = study.simulation.verify and any_failed(log)
    if not again.any() and not checked and not np.any(status == PENDING):
        return log
    old, new = log.header["attrs"], provenance(study, "run --retry-failed")
    before = resolved_study(old)["simulation"]["max_steps"]
    change = (
        ""
        if before == study.simulation.max_steps
        else (f" simulation.max_steps={study.simulation.max_steps} (was {before})")
    )
    told = {name: new[name] for name in new if name.startswith("study")}
    return rewrite_log(
        log,
        {**old, **told, "history": f"{old['history']}\n{new['history']}{change}"},
        again,
        *([forget_failed] if checked else []),
    )


def _check_same(study: Study, log: RunLog, where: Path, retry_failed: bool) -> None:
    """FileError where the log was made from another study or by another version of the
    model."""
    attrs = log.header["attrs"]
    there = resolved_study(attrs)
    if attrs.get("study_sha256") != study.sha256 and not (
        retry_failed and _is_looser(study, there)
    ):
        listed = told_changes(there, study.resolved)
        may = ""
        if retry_failed:
            may = "With --retry-failed only simulation.max_steps may differ, and only be larger. "
        elif [key for key, _, _ in differences(there, study.resolved) if key != "title"] == [
            "simulation.max_steps"
        ]:
            may = "A larger limit can be given to the points that failed: --retry-failed. "
        raise FileError(
            f"{where}: made from another study ({listed or 'the digests differ'}). {may}Resume it "
            f"with the study it "
            "was made from, or start anew by --overwrite."
        )
    if differing := unlike(attrs):
        raise FileError(
            f"{where}: made with other versions, whose numbers may differ "
            f"({'; '.join(differing)}). Finish it with "
            "those, or start anew by --overwrite."
        )
    for one in study.unknowns:
        if not np.array_equal(log.header["coords"].get(one.name), study.drawn[one.short]):
            raise FileError(
                f"{where}: its samples of {one.key} are not those that this version of SciPy "
                f"draws. Finish it with the "
                "versions that it was made with, or start anew by --overwrite."
            )
    if retry_failed and json.loads(attrs.get("classification", "[]")):
        raise FileError(
            f"{where}: its labels were made by nsdrill classify, with thresholds that new points "
            f"would not have. "
            "Restore those of the study first: nsdrill classify without --set."
        )


def _is_looser(study: Study, there: dict[str, Any]) -> bool:
    """Whether ``study`` is the study that is ``there`` but for a larger limit of steps.
    A run that ended well under the one ends with the same bits under the other."""
    before = there.get("simulation", {}).get("max_steps")
    if before is None or study.simulation.max_steps < before:
        return False
    changed = {
        **there,
        "simulation": {**there["simulation"], "max_steps": study.simulation.max_steps},
    }
    return digest(changed) == study.sha256
