"""Operations that run a study, or points of results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

from nsdrill.errors import Refusal, RunWarning, StudyError, option, warn
from nsdrill.late import deferred
from nsdrill.operations.arguments import (
    At,
    BranchesPath,
    ColumnsOf,
    Depth,
    Device,
    Duration,
    Engine,
    HDF5Path,
    Large,
    Lines,
    LogToFollow,
    Only,
    Orbit,
    Overwrite,
    PathLike,
    PointOfOrbit,
    Procedure,
    Rename,
    Reported,
    ResultsLike,
    ResultsPath,
    Resume,
    RetryFailed,
    Sample,
    Scheduler,
    Seeds,
    Settings,
    SkipGaps,
    Speed,
    Start,
    StudyLike,
    Thresholds,
    TimesOf,
    UnitOf,
    Weight,
    Workers,
    refuse_without,
    texts_of,
)
from nsdrill.records import dataclass
from nsdrill.variables import long_key

with deferred():
    from nsdrill import progress as reports
    from nsdrill import store
    from nsdrill.app import conversion, datasets
    from nsdrill.app.answering import summary
    from nsdrill.app.fitting import measured
    from nsdrill.app.following import continuing, seeding
    from nsdrill.app.running import cluster
    from nsdrill.app.running import place as places
    from nsdrill.app.running import run as running
    from nsdrill.app.simulating import exponents as spectra
    from nsdrill.app.simulating import trajectory
    from nsdrill.models import choices, registry

if TYPE_CHECKING:
    from nsdrill.app.fitting.measured import Reading
    from nsdrill.app.following.continuing import ContinuationResult
    from nsdrill.app.running.run import RunResult
    from nsdrill.app.simulating.trajectory import Trajectory
    from nsdrill.data import Answer, Results
    from nsdrill.study.study import Study


def load_study(study: StudyLike, set: Settings = None) -> Study:
    """Read and check a study, and fill in its defaults.

    Returns
    -------
    Study

    Raises
    ------
    FileError
        Where a file cannot be read.
    StudyError
        With all its faults, where the study is not valid.

    Examples
    --------
    >>> study = nsdrill.load_study("study.yaml", {"operation.wob": "30 kN"})
    >>> study.operation.wob
    30000.0
    """
    return conversion.study_in(study, set)


def run(
    study: StudyLike,
    path: ResultsPath = None,
    *,
    set: Settings = None,
    workers: Workers = None,
    engine: Engine = "threads",
    scheduler: Scheduler = None,
    device: Device = "cpu",
    resume: Resume = False,
    retry_failed: RetryFailed = False,
    overwrite: Overwrite = False,
    large: Large = False,
    progress: Reported = True,
) -> RunResult | Results:
    """Run a study and return its results; with ``path`` they are written there.

    With a path, finished points are kept in ``path.part`` at all times: after a
    KeyboardInterrupt the same call with ``resume=True`` runs what is missing. The numbers do
    not depend on the workers, the engine, the device, or an interruption.

    Returns
    -------
    Dataset
        Of one variable for each entry of a results file, in SI units, over procedure and
        axes. With a path it is read lazily.

    Raises
    ------
    InputError
        Before anything runs: the study is not a sweep, an argument is invalid, or memory or
        disk are too small. A RunWarning says how many points failed.

    Examples
    --------
    >>> results = nsdrill.run("study.yaml", progress=False)
    >>> results.stick_slip_index.attrs["units"], results.sizes["rotary_speed"]
    ('percent', 5)
    """
    loaded = conversion.study_in(study, set)
    running.checked_workers(workers)
    places.check_device(device, engine)
    executing = cluster.executor_of(engine, scheduler, workers)
    output = conversion.output_in(path, study, resume=resume, retry_failed=retry_failed, overwrite=overwrite)
    running.check_sweep(loaded)
    if output is not None:
        store.check_target(output)  # before a cluster is started
    with executing as (executor, count), reports.reporting(progress) as watch:
        if output is None:
            return running.run_in_memory(
                loaded,
                workers=count,
                watch=watch,
                executor=executor,
                large=large,
                priced=progress is True,
                device=device,
            )
        return running.run_study(
            loaded,
            output,
            workers=count,
            resume=resume,
            retry_failed=retry_failed,
            overwrite=overwrite,
            watch=watch,
            executor=executor,
            large=large,
            priced=progress is True,
            device=device,
        )


def continue_branches(
    study: StudyLike,
    path: BranchesPath = None,
    *,
    seeds: Seeds = None,
    at: Annotated[At, "With seeds of a sweep: only from this value of the number that is followed."] = None,
    procedure: Annotated[Procedure, "With seeds of a sweep: only from its points of this procedure."] = None,
    start: Annotated[Start, "With seeds of a sweep: only from the start with this number."] = None,
    point: Annotated[
        PointOfOrbit, "With seeds that are branches: the number of the one of their points to set out from."
    ] = None,
    set: Settings = None,
    workers: Workers = None,
    resume: Annotated[Resume, "Continue an interrupted run."] = False,
    overwrite: Overwrite = False,
    progress: Lines = True,
) -> ContinuationResult:
    """Follow the motions of a study, stable and unstable, along the number that its
    section ``continue`` names.

    With ``seeds`` from one motion of them: a point of a sweep, or any motion on branches, stable
    or not, which may be followed in another number. ``continue.direction`` of the study says to
    which side.

    Returns
    -------
    Dataset
        With the dimension ``branch`` (``motion``, ``lobes``, ``parent``, ``end_reason``,
        ``row_size``) and the dimension ``point``, branch after branch: the number continued,
        ``state`` at the drive angle 0 in SI, ``period`` [s], ``multiplier_real`` and
        ``multiplier_imag``, how many of them are ``unstable``, the ``label`` of special
        points, and the features of results over one period.

    Raises
    ------
    InputError
        Where the study has no section ``continue``, or no motion to follow is found.

    Examples
    --------
    >>> branches = nsdrill.continue_branches("branches.yaml")
    >>> branches.motion.values.tolist()
    ['equilibrium', 'limit_cycle']
    """
    loaded = conversion.study_in(study, set)
    output = conversion.output_in(path, study, resume=resume, overwrite=overwrite)
    with reports.telling(progress) as told:
        return continuing.continue_study(
            loaded,
            output,
            seeds=_seeds_in(seeds),
            chosen=_chosen(loaded, at, procedure, start, point),
            workers=workers,
            overwrite=overwrite,
            resume=resume,
            told=told,
        )


def _seeds_in(seeds: object) -> seeding.Source | None:
    """The seeds of a continuation: the name of a file, or the results or branches in a
    Dataset."""
    if seeds is None:
        return None
    if not datasets.is_dataset(seeds):
        return conversion.name_in(seeds, "seeds")
    return seeds if "branch" in seeds.dims else datasets.results_in(seeds, "seeds", seeding.SEEDED)


def _chosen(study: Study, at: object, procedure: str | None, start: int | None, point: int | None) -> seeding.Chosen:
    """The one motion of the seeds that is chosen; a Refusal of another number than the one
    that is followed."""
    values = conversion.values_in(at, study)
    along = study.continuation.along if study.continuation is not None else ""
    if along and (others := [key for key in values if key != along]):
        raise Refusal("at", others[0], f"{along}, which is followed; the study has the other numbers")
    return seeding.Chosen(values.get(along), procedure, start, point)


def simulate(
    study: StudyLike,
    *,
    depth: Annotated[Depth, "Depth. Default: operation.depth of the study, value or ramp."] = None,
    wob: Annotated[Weight, "Weight on bit. Default: operation.wob."] = None,
    rotary_speed: Annotated[Speed, "Rotary speed. Default: operation.rotary_speed."] = None,
    at: At = None,
    start: Start = None,
    duration: Duration = None,
    sample: Sample = None,
    set: Settings = None,
    data: LogToFollow = None,
    rename: Rename = None,
    unit: UnitOf = None,
    times: TimesOf = (),
    columns: ColumnsOf = (),
    only: Only = None,
    skip_gaps: SkipGaps = False,
    orbit: Orbit = None,
    point: PointOfOrbit = None,
) -> Trajectory:
    """Simulate one operating point of a study, or its ramps.

    Returns
    -------
    Dataset
        The trace: variables over ``time`` [s]. A RunWarning says that the run ended early;
        the trace then ends there, and its attribute ``status`` says why.

    Raises
    ------
    InputError
        For values outside the model.

    Examples
    --------
    >>> trace = nsdrill.simulate("study.yaml", rotary_speed="40 rpm", duration="2 s")
    >>> trace.bit_speed.dims, trace.sizes["time"]
    (('time',), 201)
    """
    loaded, followed = conversion.study_in(study, set), ""
    lasting = {"duration": duration, "sample": sample}
    spans = {name: None if value is None else conversion.seconds_in(name, value) for name, value in lasting.items()}
    heads = {"rename": rename, "unit": unit, "times": times, "columns": columns, "only": only}
    refuse_without("data", data, heads | {"skip_gaps": skip_gaps})
    if data is not None:
        if orbit is not None:
            raise Refusal("data", "with an orbit, whose point has its own settings", "without an orbit")
        reading = measured.Reading(
            dict(rename or {}),
            ("*",),
            gaps=skip_gaps,
            unit=dict(unit or {}),
            times=texts_of(times),
            columns=columns,
            only=dict(only or {}),
        )
        loaded, length, followed = _along_log(loaded, data, reading)
        if (duration := spans["duration"] or 0.0) > length:
            warn(
                f"{conversion.name_in(data, 'data')}: it lasts {length:g} s; from there to {duration:g} s its last "
                "values are held.",
                RunWarning,
            )
    if orbit is not None or point is not None:
        chosen = {"depth": depth, "wob": wob, "rotary_speed": rotary_speed, "at": at, "start": start}
        return _orbit(loaded, orbit, point, chosen, spans)
    values = conversion.values_in(at, loaded, depth=depth, wob=wob, rotary_speed=rotary_speed)
    changes = []  # other numbers of the study, checked as its keys, with what they must satisfy together
    for key, value in values.items():
        if key in ("depth", "wob", "rotary_speed", "sample"):
            continue
        text = loaded.keys.leaf(long_key(key), loaded.resolved).text(choices.word_or_number(key, value))
        changes.append(f"{key}={text}")
        if key in loaded.resolved["sweep"]:  # else the values along the axis are judged in place of this one
            changes += [f"sweep.{key}=[{text}]", "sweep.procedure=same", "sweep.along=null", "sweep.refine=0"]
    return trajectory.simulate(
        conversion.study_in(loaded, changes),
        at_sample=values.get("sample"),
        depth=values.get("depth"),
        wob=values.get("wob"),
        rotary_speed=values.get("rotary_speed"),
        start=start,
        duration=spans["duration"],
        sample=trajectory.DEFAULT_SAMPLE if spans["sample"] is None else spans["sample"],
        followed=followed,
    )


def _along_log(study: Study, data: PathLike, reading: Reading) -> tuple[Study, float, str]:
    """The study with ramps that follow the settings of a log, how long that is [s], and what
    was read, which is a RunWarning too."""
    name = conversion.name_in(data, "data")
    ramps, notes, length = measured.ramps_in(name, study, reading)
    told = f"{name}: {'; '.join(notes)}."
    warn(told, RunWarning)
    return conversion.study_in(study, [f"{key}={text}" for key, text in ramps.items()]), length, told


def _orbit(
    study: Study,
    orbit: PathLike | None,
    point: int | None,
    chosen: Mapping[str, object],
    spans: Mapping[str, float | None],
) -> Trajectory:
    """The motion at a point of a file of branches."""
    if orbit is None or point is None:
        given, missing = ("point", "orbit") if orbit is None else ("orbit", "point")
        raise Refusal(given, f"without {option(missing)}", "with it")
    for name, value in chosen.items():
        if value is not None:
            raise Refusal(name, "with an orbit, whose point has its own", "without an orbit")
    return continuing.trace_of(study, lambda texts: conversion.study_in(study, texts), orbit, point, **spans)[0]


def replay(
    results: ResultsLike,
    *,
    depth: Annotated[Depth, "Depth of the point; the nearest one of the sweep is taken."] = None,
    wob: Annotated[Weight, "Weight on bit of the point."] = None,
    rotary_speed: Annotated[Speed, "Rotary speed of the point."] = None,
    at: At = None,
    procedure: Procedure = None,
    start: Start = None,
    sample: Sample = None,
) -> Trajectory:
    """Run one point of results again, from its stored initial state.

    Returns
    -------
    Dataset
        The trace over ``time`` [s]. Its attribute ``same_bits`` is 1 where the run ends in
        the stored final state, bit for bit; else a RunWarning says what differs.

    Raises
    ------
    InputError
        For a point beyond the sweep, or one that has not been run.

    Examples
    --------
    >>> trace = nsdrill.replay("out.h5", rotary_speed="3 rad/s", procedure="up")
    >>> trace.attrs["same_bits"]
    1
    """
    return trajectory.replay(
        _with_states(results, "replay"),
        at=conversion.values_in(at, None, depth=depth, wob=wob, rotary_speed=rotary_speed),
        procedure=procedure,
        start=start,
        sample=trajectory.DEFAULT_SAMPLE if sample is None else conversion.seconds_in("sample", sample),
    )


def _with_states(results: ResultsLike, command: str, *more: str) -> Results | str:
    """Results with the status and the states of each point, and with ``more`` variables, for
    a ``command``; the name of a file, of which single points are read, as it is."""
    if not datasets.is_dataset(results):
        return conversion.name_in(results)
    names = ("status", "initial_state", "final_state", *more)
    return datasets.with_variables(datasets.data_in(results, names), command, names)


def lyapunov_spectrum(
    results: ResultsLike,
    *,
    depth: Annotated[Depth, "Depth of the point; the nearest one of the sweep is taken."] = None,
    wob: Annotated[Weight, "Weight on bit of the point."] = None,
    rotary_speed: Annotated[Speed, "Rotary speed of the point."] = None,
    at: At = None,
    procedure: Procedure = None,
    start: Start = None,
    duration: Annotated[Duration, "Time of the motion to measure. Default: the observed time of the study."] = None,
    workers: Workers = None,
    progress: Lines = True,
) -> Answer:
    """Measure all Lyapunov exponents of one point of results, of the motion that goes on
    from the end of its run, and its dimension.

    Returns
    -------
    dict
        Plain data: ``exponents`` [1/s], falling, with their standard ``errors``; their
        ``signs``, positive, zero within two errors, negative, or undetermined where these are
        above 0.02 1/s; their ``sum`` [1/s], at which volumes of states grow; the two ends of
        the Kaplan-Yorke ``dimension`` of the attractor; ``seconds`` of the motion in
        ``intervals``; whether the run had ``settled``; and the point.

    Raises
    ------
    InputError
        For a point that failed, and for a motion that cannot be integrated explicitly to the
        accuracy that exponents need.

    Examples
    --------
    >>> found = nsdrill.lyapunov_spectrum("out.h5", rotary_speed="3 rad/s", procedure="up")
    >>> len(found["exponents"]) == len(found["errors"]), found["sum"] < 0.0
    (True, True)
    """
    source = _with_states(results, "lyapunov_spectrum", "settled")
    running.checked_workers(workers)
    with reports.telling(progress) as told:
        return spectra.lyapunov_spectrum(
            source,
            at=conversion.values_in(at, None, depth=depth, wob=wob, rotary_speed=rotary_speed),
            procedure=procedure,
            start=start,
            duration=None if duration is None else conversion.seconds_in("duration", duration),
            workers=workers or running.processors(),
            told=told,
        )


@dataclass(frozen=True)
class Labelled:
    """New labels: the results in memory, or the name of the file, and of a file how many
    points changed, and of how many, by the name of the label."""

    results: Results | str
    changes: Mapping[str, tuple[int, int]]


def classify(
    results: ResultsLike, changes: Thresholds = None, path: HDF5Path = None, overwrite: Overwrite = False
) -> Labelled:
    """Label results again with other thresholds; nothing is run again.

    Returns
    -------
    Dataset
        The results with the new labels; the attribute ``history`` records the change.

    Raises
    ------
    StudyError
        Where a key or a value is not one of thresholds.

    Examples
    --------
    >>> results = nsdrill.open_results("out.h5")
    >>> strict = nsdrill.classify(results, {"classify.stick_slip.stick_slip_index": 1})
    >>> bool(strict.nsdrill.sticking.sum() >= results.nsdrill.sticking.sum())
    True
    """
    texts = conversion.texts_in(changes, "changes")
    output = conversion.output_in(path, overwrite=overwrite)
    try:
        if datasets.is_dataset(results):
            if output is not None:
                raise Refusal("path", "with a Dataset", "with the name of a file; nsdrill.save writes a Dataset")
            variables = registry.model_in(results.attrs).variables
            measured = [
                v.name for v in variables if v.origin in summary.MEASURED and v.only is None and v.origin != "label"
            ]
            data = datasets.results_in(results, "classify", ("status", "response", *measured))
            return Labelled(summary.relabelled(data, texts), {})
        name = conversion.name_in(results)
        if output is not None:
            store.claim_file(output, overwrite)
        return Labelled(output or name, summary.reclassify(name, texts, output, overwrite=overwrite or output is None))
    except StudyError as error:
        raise StudyError(option("changes"), error.faults) from None
