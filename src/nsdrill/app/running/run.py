"""Run a study into a results file, or into a log from which the run can be
resumed."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import field
from pathlib import Path

import numpy as np

from nsdrill import interrupt
from nsdrill.analysis.doubts import notes_of_run, used_by_notes
from nsdrill.app.check import check_large, check_memory, disk, inexact_exponent, memory
from nsdrill.app.conversion import is_whole
from nsdrill.app.experiment import Experiment, coarse_points, made_otherwise, prepare, provenance
from nsdrill.app.running.grouping import write_attractors
from nsdrill.app.running.place import PROCESSOR, Place, place_of
from nsdrill.app.running.price import price
from nsdrill.app.running.refinement import RefinedSweep
from nsdrill.app.running.stages import (
    RunStages,
    Watch,
    any_failed,
    compiling,
    forget_failed,
    sweep,
    verified,
    verify,
    work_of,
)
from nsdrill.data import INEXACT, Answer, Array, Resolved, Results, differences, resolved_study
from nsdrill.errors import DeviceError, FileError, InputError, NsdrillError, Refusal, again, option
from nsdrill.files import amount
from nsdrill.kernel.batch import choose_lanes
from nsdrill.models.friction import advice
from nsdrill.models.parts import values_in_parts
from nsdrill.records import dataclass
from nsdrill.script.elsewhere import knowing
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
from nsdrill.store.claims import Claim
from nsdrill.store.points import Header
from nsdrill.study.study import IN_WORDS_ONLY, Study, digest
from nsdrill.study.write import changes_text
from nsdrill.sweep.engine import Progress
from nsdrill.variables import PENDING, STEP_LIMIT, has_failed


@dataclass(frozen=True)
class RunResult:
    """The result of a run: the numbers of all ``points``, of ``failed`` ones and of
    those ``already`` run before, the wall time in ``seconds`` and the ``steps`` tried.
    ``refinement`` has the root attributes of a refined sweep, ``advice`` the remedy for
    points that reached their limit of steps, ``notes`` what makes numbers of these results
    wrong or not those of their setting (:func:`nsdrill.analysis.doubts.notes_of_run`)."""

    path: Path
    points: int
    failed: int
    seconds: float
    steps: int
    already: int
    refinement: Answer = field(default_factory=dict)
    advice: str = ""
    notes: tuple[str, ...] = ()


class Interrupted(KeyboardInterrupt):
    """An interrupted run. All finished points are kept in ``part``; the text says
    so."""

    def __init__(self, log: RunLog) -> None:
        super().__init__(f"Interrupted: {log.recovery_text()}")
        self.part, self.done, self.total = log.path, int(np.count_nonzero(log.done())), log.n_points


def run_in_memory(
    study: Study,
    *,
    workers: int | None = None,
    watch: Watch = lambda progress: None,
    executor: Executor | None = None,
    large: bool = False,
    priced: bool = False,
    device: str = "cpu",
) -> Results:
    """Run ``study`` and return the results in memory. ``workers`` defaults to the
    number of available processors; ``executor`` replaces the threads of this
    process; ``large`` says that many points are meant; a long run that is ``priced``
    tells its time first; ``device`` is cpu, gpu or auto."""
    check_sweep(study)
    executor = knowing(executor, study)
    workers = checked_workers(workers)
    experiment = prepare(study)
    experiment.check_exponent()
    _check_cost(experiment, workers, in_file=False, large=large)
    place = place_of(device, experiment, workers, remote=executor is not None)
    log = MemoryLog(header_of(experiment, place), experiment.plan.points, experiment.contents)
    _run_missing(experiment, log, workers, watch, executor, place, priced=priced)
    return collect(_results(experiment, log))


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
    large: bool = False,
    priced: bool = False,
    device: str = "cpu",
) -> RunResult:
    """Run ``study`` into the results file ``path``, as ``nsdrill run`` does.
    :class:`Interrupted` on an interrupt.

    ``retry_failed`` resumes like ``resume`` and runs failed points again;
    ``simulation.max_steps`` may then be larger than before. ``executor`` replaces the
    threads of this process; ``large`` says that very many points are meant. A long run
    that is ``priced`` tells its time first, through ``watch``. ``device`` is cpu, gpu or
    auto.
    """
    check_sweep(study)
    executor, path = knowing(executor, study), Path(path)
    workers = checked_workers(workers)
    experiment = prepare(study)
    experiment.check_exponent()
    going_on = (resume or retry_failed) and os.path.lexists(part_path(path))
    _check_cost(experiment, workers, in_file=True, large=large or going_on)
    place = place_of(device, experiment, workers, remote=executor is not None)
    state = claim(path, overwrite=overwrite, resume=resume or retry_failed)
    with _log_of(experiment, path, state, overwrite, retry_failed, place) as log:
        already = int(np.count_nonzero(log.done()))
        if state == "finished" and _complete(experiment, log):
            results, failed = _results(experiment, log), _count_failed(log)
            attrs, notes = getattr(results, "attrs", {}), _notes(results, log)
            log.discard()
            return RunResult(path, experiment.plan.points, failed, 0.0, 0, already, attrs, notes=notes)
        started_at = time.perf_counter()
        try:
            with interrupt.with_end_message(lambda: f"Interrupted: {log.recovery_text()}"):
                progress = _run_missing(experiment, log, workers, watch, executor, place, lanes, priced)
                seconds = time.perf_counter() - started_at
                results = _results(experiment, log)
                write_results(path, results)
        except KeyboardInterrupt:
            log.sync()
            raise Interrupted(log) from None
        except DeviceError as error:
            log.sync()
            raise NsdrillError(f"{error} Finished points are kept: give {again('resume')}.") from error
        failed, remedy, notes = _count_failed(log), _advice(experiment, log), _notes(results, log)
        log.discard()
    attrs = getattr(results, "attrs", {})
    return RunResult(path, experiment.plan.points, failed, seconds, progress.lane_steps, already, attrs, remedy, notes)


def _notes(results: Source, log: Sink) -> tuple[str, ...]:
    """What there is to know of the numbers of these results."""
    return tuple(notes_of_run(collect(results, used_by_notes(log.header["attrs"]))))


def _log_of(
    experiment: Experiment, path: Path, state: Claim, overwrite: bool, retry_failed: bool, place: Place
) -> RunLog:
    """The log of a run into ``path``: a new one, or that of the same study which is to be
    finished. FileError where it is of another study."""
    part = part_path(path)
    if state == "new":
        log = RunLog.create(part, header_of(experiment, place), experiment.plan.points, experiment.contents)
    else:
        log = RunLog.open(part) if state == "resume" else log_from_results(path, part)
    try:
        if state == "new":
            if not overwrite and os.path.lexists(path):  # of a run that ended since claim()
                raise FileError(
                    f"{path}: another process has just made this file. Choose another name, or replace it "
                    f"by {option('overwrite')}."
                )
            return log
        _check_same(experiment.study, log, part if state == "resume" else path, retry_failed)
        if retry_failed:
            log = _with_failed_pending(experiment, log)
        return log if _complete(experiment, log) else _with_device(log, place)
    except BaseException as error:
        if state != "resume" and isinstance(error, FileError):
            log.discard()
        log.close()
        raise


def _check_cost(experiment: Experiment, workers: int, *, in_file: bool, large: bool) -> None:
    """InputError where memory is too small for a run, or where it is very large and is
    not meant to be."""
    check_memory(experiment, in_file=in_file)
    study, plan = experiment.study, experiment.plan
    simulation, room = study.simulation, disk(experiment)
    where = "on the disk" if in_file else "of memory for the results"
    check_large(
        "a sweep",
        coarse_points(study, plan.points),
        (simulation.transient + simulation.observe) * (4 if simulation.verify else 1),
        f"up to {amount(room)} {where} and {amount(memory(experiment))} of memory",
        workers,
        large=large,
    )


def _advice(experiment: Experiment, log: Sink) -> str:
    """The remedy for points that reached their limit of steps; empty where there are
    none."""
    points = np.flatnonzero(log.status() == STEP_LIMIT)
    if not len(points):
        return ""
    study, values = experiment.study, experiment.plan.values(points)
    explicit, simulation_method = not experiment.chosen.points(points).all(), study.simulation.method
    at, _ = next(values_in_parts(study.model, study.parameters, study.initial, values))
    method = ("auto" if simulation_method == "auto" else "explicit") if explicit else "implicit"
    return advice(method, study.model, at)


def check_sweep(study: Study) -> None:
    """InputError unless the study is a sweep, in which every point has a constant
    operating point."""
    source = study.source or "the study"
    if study.ramped and not study.swept:
        raise InputError(
            f"{source}: found no sweep, only a ramp in {_listed(study.ramped)}; allowed: at least one axis to sweep. A "
            "ramp is one run: nsdrill simulate."
        )
    if study.ramped:
        raise InputError(
            f"{source}: found a ramp in {_listed(study.ramped)} beside a sweep of {', '.join(study.swept)}; allowed: a "
            "constant value, or an axis of the sweep, which takes the place of the ramp. The points of a sweep have "
            "constant operating points; to follow the ramp, use nsdrill simulate."
        )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(f"operation.{name}" for name in names)


def processors() -> int:
    """The number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def checked_workers(workers: int | None) -> int:
    """The number of workers, by default that of the processors; InputError below 1."""
    if workers is not None and (not is_whole(workers) or workers < 1):
        raise Refusal("workers", repr(workers), "a whole number, 1 or more")
    return workers or processors()


def header_of(experiment: Experiment, place: Place = PROCESSOR) -> Header:
    """The coordinates and root attributes of the results of an experiment that is computed
    in this ``place``."""
    study, plan = experiment.study, experiment.plan
    coords: dict[str, Array | Sequence[float | str]] = {"procedure": list(plan.procedures), **plan.dimensions}
    if study.samples:
        coords["sample"] = list(range(study.samples))
        coords |= {unknown.name: study.drawn[unknown.short] for unknown in study.unknowns}
    if study.initial.starts:
        coords["start"] = list(range(study.initial.starts))
    attrs = {**provenance(study, "run"), "method": " and ".join(experiment.methods), "device": place.name}
    if told := inexact_exponent(study):
        attrs[INEXACT] = told
    return {"coords": coords, "attrs": attrs}


def _count_failed(log: Sink) -> int:
    status = log.status()
    return int(np.count_nonzero(has_failed(status)))


def _run_missing(
    experiment: Experiment,
    log: Sink,
    workers: int,
    watch: Watch,
    executor: Executor | None,
    place: Place,
    lanes: int | None = None,
    priced: bool = False,
) -> Progress:
    """Run what is missing in ``log``: points, those of the refinement, and checks. A long
    run that is ``priced`` tells its time first; on a cluster and on a GPU it is not
    known."""
    study, work = experiment.study, work_of(experiment)
    chains = -(-work.plan.abreast // workers) if lanes is None else 0
    lanes = lanes or choose_lanes(chains)
    pool: AbstractContextManager[Executor] = ThreadPoolExecutor(workers)
    with pool as threads:
        stages = RunStages(log, executor or threads, workers, lanes, watch, executor is not None, chains, place.gpu)
        stages.progress.device = place.told
        if priced and place.gpu is None and executor is None and (missing := int(np.count_nonzero(~log.done()))):
            with compiling(stages.progress, watch):
                told = price(experiment, work, workers, missing, asked=False)
            if told is not None:
                stages.progress.expected, stages.progress.price = told.seconds, told.text
        if study.refined:
            RefinedSweep(experiment, log).run(stages, work)
        else:
            sweep(stages, work)
        if study.simulation.verify:
            verify(stages, work)
    log.sync()
    if work.plan.starts:
        write_attractors(experiment, log)
    return stages.progress


def _complete(experiment: Experiment, log: Sink) -> bool:
    """Whether nothing is left to run."""
    study = experiment.study
    is_run = RefinedSweep(experiment, log).complete if study.refined else bool(log.done().all())
    return is_run and (not study.simulation.verify or verified(log))


def _results(experiment: Experiment, log: Sink) -> Source:
    """The points of the results file, from a complete log."""
    return RefinedSweep(experiment, log).results() if experiment.study.refined else log


def _with_failed_pending(experiment: Experiment, log: RunLog) -> RunLog:
    """The log with its failed points pending, and with them the later points of their
    chains, whose starts may change. The log is replaced in one step, so that the parts
    of a chain always belong together."""
    study, plan, status = experiment.study, experiment.plan, log.status()
    rerun = has_failed(status)
    for chain in range(plan.carried_chains):
        points = plan.points_of(chain, np.arange(plan.chain_length))
        rerun[points] = np.logical_or.accumulate(rerun[points])
    has_failed_checks = study.simulation.verify and any_failed(log)
    if not rerun.any() and not has_failed_checks and not np.any(status == PENDING):
        return log
    old_attrs, new_attrs = log.header["attrs"], provenance(study, "run --retry-failed")
    old_limit = resolved_study(old_attrs)["simulation"]["max_steps"]
    change = (
        ""
        if old_limit == study.simulation.max_steps
        else (f" simulation.max_steps={study.simulation.max_steps} (was {old_limit})")
    )
    study_attrs = {name: new_attrs[name] for name in new_attrs if name.startswith("study")}
    return rewrite_log(
        log,
        {**old_attrs, **study_attrs, "history": f"{old_attrs['history']}\n{new_attrs['history']}{change}"},
        rerun,
        *([forget_failed] if has_failed_checks else []),
    )


def _with_device(log: RunLog, place: Place) -> RunLog:
    """The log with the ``place`` among those that its root attributes name."""
    attrs = log.header["attrs"]
    named = str(attrs.get("device", PROCESSOR.name)).split(" and ")
    if place.name in named:
        return log
    return rewrite_log(log, {**attrs, "device": " and ".join((*named, place.name))}, np.zeros(log.n_points, bool))


def _check_same(study: Study, log: RunLog, where: Path, retry_failed: bool) -> None:
    """FileError where the log was made from another study, or by other versions that
    may change its numbers."""
    attrs = log.header["attrs"]
    resolved = resolved_study(attrs)
    if attrs.get("study_sha256") != study.sha256 and not (retry_failed and _is_looser(study, resolved)):
        listed = changes_text(resolved, study.resolved)
        hint = ""
        if retry_failed:
            hint = f"With {option('retry_failed')} only simulation.max_steps may differ, and only be larger. "
        elif [key for key, _, _ in differences(resolved, study.resolved) if key not in IN_WORDS_ONLY] == [
            "simulation.max_steps"
        ]:
            hint = f"A larger limit can be given to the points that failed: {option('retry_failed')}. "
        raise FileError(
            f"{where}: made from another study ({listed or 'the digests differ'}). {hint}Resume it with the study it "
            f"was made from, or start anew by {option('overwrite')}."
        )
    if otherwise := made_otherwise(attrs):
        raise FileError(f"{where}: {otherwise}, or start anew by {option('overwrite')}.")
    for unknown in study.unknowns:
        if not np.array_equal(log.header["coords"].get(unknown.name, ()), study.drawn[unknown.short]):
            raise FileError(
                f"{where}: its samples of {unknown.key} are not those that this version of SciPy draws. Finish it with "
                f"the versions that it was made with, or start anew by {option('overwrite')}."
            )
    if retry_failed and json.loads(attrs.get("classification", "[]")):
        raise FileError(
            f"{where}: its labels were made by nsdrill classify, with thresholds that new points would not have. "
            f"Restore those of the study first: nsdrill classify without {option('set')}."
        )


def _is_looser(study: Study, resolved: Resolved) -> bool:
    """Whether ``study`` differs from the ``resolved`` study of a log only by a larger
    limit of steps. A run that ended well with the smaller limit has the same bits with
    the larger one."""
    old_limit = resolved.get("simulation", {}).get("max_steps")
    if old_limit is None or study.simulation.max_steps < old_limit:
        return False
    changed = {**resolved, "simulation": {**resolved["simulation"], "max_steps": study.simulation.max_steps}}
    return digest(changed) == study.sha256
