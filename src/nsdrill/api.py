"""The functions of ``nsdrill`` for Python: studies, files and quantities in any form
in, xarray Datasets out.

Wherever a *study* is taken, it is a :class:`Study`, the name of a YAML file, YAML text,
or a mapping. Wherever *results* are taken, they are a Dataset or the name of a file.
Wherever a *quantity* is taken, it is a number in SI units or a text with its unit,
``"60 rpm"``. Errors are :class:`InputError` and the others of :mod:`nsdrill.errors`.
"""

from __future__ import annotations

import functools
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, ParamSpec, TypeAlias, TypeVar, cast

from nsdrill.app.arguments import (
    check_other_file,
    is_whole,
    name_in,
    number_in,
    seconds_in,
    study_in,
    texts_in,
    values_in,
)
from nsdrill.app.datasets import (
    branches_in,
    data_in,
    is_dataset,
    is_figure,
    missing_variable_errors,
    outline_in,
    results_in,
    units_for,
    validated,
    with_variables,
)
from nsdrill.app.wording import python_words
from nsdrill.errors import InputError, NsdrillError, RunWarning, StudyError
from nsdrill.progress import Progress, reporting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from xarray import Dataset

    from nsdrill.app.check import Report
    from nsdrill.app.fit import Fit
    from nsdrill.app.trajectory import Trajectory
    from nsdrill.data import Results
    from nsdrill.study.study import Study
    from nsdrill.web.notebook import View

    PathLike: TypeAlias = str | os.PathLike[str]
    StudyLike: TypeAlias = Study | PathLike | Mapping[str, Any]
    ResultsLike: TypeAlias = Any  # a Dataset, whose type mypy does not know, or a PathLike
    Quantity: TypeAlias = float | str
    Settings: TypeAlias = Mapping[str, Any] | Sequence[str] | None

_P = ParamSpec("_P")
_R = TypeVar("_R")


def _in_words_of_python(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """``function`` with errors that name its arguments in place of command-line
    options."""

    @functools.wraps(function)
    def call(*args: _P.args, **more: _P.kwargs) -> _R:
        try:
            result = function(*args, **more)
            if "xarray" in sys.modules:  # the result may be a Dataset
                import_module("nsdrill.accessor")
            return result
        except (NsdrillError, KeyboardInterrupt) as error:
            error.args = tuple(python_words(text) if isinstance(text, str) else text for text in error.args)
            if isinstance(error, StudyError):
                error.faults = [
                    replace(
                        fault,
                        found=python_words(fault.found),
                        allowed=python_words(fault.allowed),
                        suggestion=fault.suggestion and python_words(fault.suggestion),
                    )
                    for fault in error.faults
                ]
            raise

    return call


@_in_words_of_python
def load_study(study: StudyLike, set: Settings = None) -> Study:
    """Read and check a study, and fill in its defaults.

    Parameters
    ----------
    study : str, Path, mapping or Study
        The name of a YAML file; YAML text, a string with a line break or with a colon and a
        blank; or a mapping with the keys of a study file, nested
        (``{"operation": {"wob": "30 kN"}}``) or dotted (``{"operation.wob": "30 kN"}``).
        Values in a mapping are as in a file: a quantity is a text with its unit, and a bare
        number for one is an error, as its unit is ambiguous.
    set : mapping or sequence of str, optional
        Keys to change: a mapping by dotted keys with values of the same kind, or texts
        ``"key=value"`` as the command line takes them.

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
    return study_in(study, set)


@_in_words_of_python
def run(
    study: StudyLike,
    path: PathLike | None = None,
    *,
    set: Settings = None,
    workers: int | None = None,
    engine: str = "threads",
    scheduler: str | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    overwrite: bool = False,
    large: bool = False,
    progress: bool | Callable[[Progress], object] = True,
) -> Dataset:
    """Run a study and return its results; with ``path`` they are written there.

    With a path, finished points are safe in ``path.part`` at all times: after a
    KeyboardInterrupt the same call with ``resume=True`` runs what is missing. The numbers do
    not depend on the workers, the engine, or an interruption.

    Parameters
    ----------
    study : str, Path, mapping or Study
        Anything that :func:`load_study` takes.
    path : str or Path, optional
        The results file to write.
    set : mapping or sequence of str, optional
        Keys of the study to change, as in :func:`load_study`.
    workers : int, optional
        The number of parallel runs; by default that of the processors.
    engine : {"threads", "dask"}
        Where the points are run.
    scheduler : str, optional
        With Dask, the address of a running scheduler.
    resume : bool
        Go on with an interrupted run of the same study.
    retry_failed : bool
        Run failed points again, too.
    overwrite : bool
        An existing file may be replaced.
    large : bool
        More than a million runs are meant.
    progress : bool or callable
        True for a bar on stderr in terminals and notebooks, or a line every 10 s elsewhere;
        False for none; or a function that is called with a :class:`Progress` a few times a
        second. An exception from it ends the run, which can be resumed.

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
    from nsdrill.app.cluster import executor_of
    from nsdrill.app.run import check_sweep, checked_workers, run_in_memory, run_study
    from nsdrill.store import check_target, open_results
    from nsdrill.store.dataset import to_dataset

    loaded = study_in(study, set)
    checked_workers(workers)
    executing = executor_of(engine, scheduler, workers)
    if path is None:
        for name, on in (("resume", resume), ("retry_failed", retry_failed), ("overwrite", overwrite)):
            if on:
                raise InputError(f"{name}: found without a path; allowed: with the path of a results file.")
    check_sweep(loaded)
    if path is not None:
        path = name_in(path, "path")
        check_other_file(study, path)
        check_target(path)  # before a cluster is started
    with executing as (executor, count), reporting(progress) as watch:
        if path is None:
            results = run_in_memory(loaded, workers=count, watch=watch, executor=executor, large=large)
        else:
            result = run_study(
                loaded,
                path,
                workers=count,
                resume=resume,
                retry_failed=retry_failed,
                overwrite=overwrite,
                watch=watch,
                executor=executor,
                large=large,
            )
    if path is not None:
        _warn_failed(result.failed, result.points)
        return open_results(path)
    from nsdrill.variables import has_failed

    _warn_failed(int(has_failed(results["status"]).sum()), results["status"].size)
    return to_dataset(results)


@_in_words_of_python
def continue_branches(
    study: StudyLike,
    path: PathLike | None = None,
    *,
    seeds: PathLike | None = None,
    set: Settings = None,
    workers: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool | Callable[[str], object] = False,
) -> Dataset:
    """Follow the motions of a study, stable and unstable, along the number that its
    section ``continue`` names.

    Parameters
    ----------
    study : str, Path, mapping or Study
        Anything that :func:`load_study` takes.
    path : str or Path, optional
        The file of branches to write.
    seeds : str or Path, optional
        A results file whose settled points are followed, in place of the seeds of the study.
    set : mapping or sequence of str, optional
        Keys of the study to change, as in :func:`load_study`.
    workers : int, optional
        The number of parallel runs; by default that of the processors.
    resume, overwrite : bool
        As in :func:`run`.
    progress : bool or callable
        True for lines on stderr, or a function that is called with each of them.

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
    from nsdrill.app.continuing import continue_study

    loaded = study_in(study, set)
    if path is None and (resume or overwrite):
        raise InputError(
            f"{'resume' if resume else 'overwrite'}: found without a path; allowed: with the path of a file."
        )
    if path is not None:
        path = name_in(path, "path")
        check_other_file(study, path)
    say: Callable[[str], object] = lambda text: None  # noqa: E731
    if callable(progress):
        say = progress
    elif progress:

        def say(text: str) -> None:
            print(text, file=sys.stderr)

    return continue_study(
        loaded,
        path,
        seeds=None if seeds is None else name_in(seeds, "seeds"),
        workers=workers,
        overwrite=overwrite,
        resume=resume,
        say=say,
    ).data


@_in_words_of_python
def simulate(
    study: StudyLike,
    *,
    at: Mapping[str, Quantity] | None = None,
    depth: Quantity | None = None,
    wob: Quantity | None = None,
    rotary_speed: Quantity | None = None,
    start: int | None = None,
    duration: Quantity | None = None,
    sample: Quantity | None = None,
    set: Settings = None,
    orbit: str | os.PathLike[str] | None = None,
    point: int | None = None,
) -> Dataset:
    """Simulate one operating point of a study, or its ramps.

    Parameters
    ----------
    study : str, Path, mapping or Study
        Anything that :func:`load_study` takes.
    at : mapping, optional
        Depth, weight, speed or any other number of the study, by key:
        ``{"bit.rock_stiffness": "25 MN/m"}``; ``{"sample": 17}`` takes the uncertain numbers
        from a sample.
    depth, wob, rotary_speed : float or str, optional
        [m], [N] and [rad/s]; by default those of ``operation``. A value replaces a
        ramp.
    start : int, optional
        The number of the start, where the study has several.
    duration : float or str, optional
        [s]; by default the study's transient and observation, or until the last knot of a
        ramp.
    sample : float or str, optional
        The time between samples [s]; by default 10 ms.
    set : mapping or sequence of str, optional
        Keys of the study to change, as in :func:`load_study`.
    orbit : str or Path, optional
        A file of branches: the trace is the motion at its ``point`` over one period, stable
        or not; the study is that of the branches.
    point : int, optional
        The number of a point of ``orbit``, from 0.

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
    from nsdrill.app import trajectory

    loaded = study_in(study, set)
    values = values_in(at, loaded, depth=depth, wob=wob, rotary_speed=rotary_speed)
    if orbit is not None or point is not None:
        if values or start is not None or orbit is None or point is None:
            raise InputError("simulate: found a choice of the point, or one of orbit and point; allowed: both alone.")
        from nsdrill.app.orbit import trace_of

        number, ends = number_in("point", point), {"duration": duration, "sample": sample}
        spans = {name: None if value is None else seconds_in(name, value) for name, value in ends.items()}
        return _trace(trace_of(loaded, lambda texts: study_in(loaded, texts), orbit, int(number or 0), **spans)[0])
    changes = []
    for key, value in values.items():
        # another number of the study, checked as a key of the study
        if key not in (*_OPERATION, "sample"):
            changes.append(f"{key}={loaded.keys.leaf(key, loaded.resolved).text(value)}")
    result = trajectory.simulate(
        study_in(loaded, changes),
        at_sample=values.get("sample"),
        depth=values.get("depth"),
        wob=values.get("wob"),
        rotary_speed=values.get("rotary_speed"),
        start=number_in("start", start),
        duration=None if duration is None else seconds_in("duration", duration),
        sample=seconds_in("sample", "10 ms" if sample is None else sample),
    )
    return _trace(result)


@_in_words_of_python
def replay(
    results: ResultsLike,
    *,
    at: Mapping[str, Quantity] | None = None,
    depth: Quantity | None = None,
    wob: Quantity | None = None,
    rotary_speed: Quantity | None = None,
    procedure: str | None = None,
    start: int | None = None,
    sample: Quantity = "10 ms",
) -> Dataset:
    """Run one point of results again, from its stored initial state.

    Parameters
    ----------
    results : Dataset, str or Path
        Results; a Dataset must be complete, as :func:`run` and :func:`open_results` give it.
    at : mapping, optional
        Values of any axes by key, and the ``sample`` where numbers are uncertain.
    depth, wob, rotary_speed : float or str, optional
        [m], [N] and [rad/s]. The nearest point of the sweep is run; an axis with a
        single value may be left out.
    procedure : {"same", "up", "down"}, optional
        Needed where the results have several.
    start : int, optional
        The number of the start, where every operating point has several.
    sample : float or str
        The time between samples [s].

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
    from nsdrill.app import trajectory

    source: Any = results
    if is_dataset(results):
        names = ("status", "initial_state", "final_state")
        source = with_variables(data_in(results, names), "replay", names)
    values = values_in(at, None, depth=depth, wob=wob, rotary_speed=rotary_speed)
    if procedure is not None and procedure not in _PROCEDURES:
        raise InputError(f"procedure: found {procedure!r}; allowed: {', '.join(_PROCEDURES)}.")
    result = trajectory.replay(
        source if source is not results else name_in(results),
        at=values,
        procedure=procedure,
        start=number_in("start", start),
        sample=seconds_in("sample", sample),
    )
    if not result.same_bits:
        warnings.warn(f"The run {result.warning}", RunWarning, stacklevel=3)
    return _trace(result).assign_attrs(same_bits=int(bool(result.same_bits)))


@_in_words_of_python
def classify(results: ResultsLike, changes: Settings = None) -> Dataset:
    """Label results again with other thresholds; nothing is run again.

    Parameters
    ----------
    results : Dataset, str or Path
        Of a file the labels are replaced, in one step; of a Dataset, which must be complete,
        a copy is labelled.
    changes : mapping or sequence of str, optional
        Keys of ``classify`` with their new values,
        ``{"classify.stick_slip.stick_slip_index": 60}``, or texts ``"key=value"``; without
        any, the thresholds of the study are restored.

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
    from nsdrill.app.summary import MEASURED, reclassify, relabelled
    from nsdrill.models.registry import model_in
    from nsdrill.store import open_results
    from nsdrill.store.dataset import to_dataset

    texts = texts_in(changes, "changes")
    try:
        if is_dataset(results):
            variables = model_in(results.attrs).variables
            measured = [v.name for v in variables if v.room in MEASURED and v.only is None and v.room != "label"]
            data = results_in(results, "classify", ("status", "response", *measured))
            return to_dataset(relabelled(data, texts))
        reclassify(name_in(results), texts)
    except StudyError as error:
        raise StudyError("changes", error.faults) from None
    return open_results(name_in(results))


@_in_words_of_python
def show(data: ResultsLike, *, units: str | None = None, everything: bool = False) -> str:
    """Summarise results, an unfinished run, branches or a trace, as ``nsdrill show`` does.

    Parameters
    ----------
    data : Dataset, str or Path
        What is summarised.
    units : {"si", "field"}, optional
        m, kN and rad/s, or ft, klbf and rpm; by default those of the study.
    everything : bool
        Of branches every special point, also where the list is long.

    Returns
    -------
    str

    Raises
    ------
    FileError
        Where the file cannot be read.

    Examples
    --------
    >>> print(nsdrill.show("out.h5").splitlines()[0])
    out.h5: results of a sweep. Five speeds
    """
    from nsdrill.app import unfinished
    from nsdrill.app.summary import needed, summarize
    from nsdrill.cli.show import lines

    name = "Dataset" if is_dataset(data) else os.fspath(name_in(data))
    units = units_for(units, data)
    if (branches := branches_in(data)) is not None:
        from nsdrill.app.branch_summary import summarize_branches

        return "\n".join(lines(name, summarize_branches(branches), units, everything))
    if not is_dataset(data) and (found := unfinished.summary(name)) is not None:
        return "\n".join(lines(name, found, units))
    with missing_variable_errors("show"):
        return "\n".join(lines(name, summarize(data_in(data, needed())), units))


@_in_words_of_python
def plot(
    data: ResultsLike,
    kind: str | None = None,
    *,
    ax: Axes | None = None,
    units: str | None = None,
    at: Mapping[str, Quantity] | None = None,
    depth: Quantity | None = None,
    wob: Quantity | None = None,
    rotary_speed: Quantity | None = None,
    start: int | None = None,
    states: Sequence[str] | None = None,
    over: ResultsLike | None = None,
    severity: int | None = None,
    confidence: float | None = None,
    panel: str | None = None,
    xlim: tuple[Quantity, Quantity] | None = None,
    ylim: tuple[Quantity, Quantity] | None = None,
    time: tuple[Quantity | None, Quantity | None] | None = None,
    width: Quantity | None = None,
    height: Quantity | None = None,
    font_size: float | None = None,
    title: str | bool | None = None,
    style: PathLike | Mapping[str, Any] | None = None,
) -> Figure:
    """Draw results, an unfinished run, a trace or branches, or a :func:`chart` of a study.

    A notebook shows the figure where it is the value of a cell; :func:`save` writes it to a
    file. It is not registered with pyplot.

    Parameters
    ----------
    data : Dataset, str, Path or Study
        What is drawn.
    kind : str, optional
        The kind of picture, by default one that fits the data; the error for another one
        lists all that fit.
    panel : str, optional
        One panel of the picture alone, by its name or a clear part of it; the error for
        another one lists them.
    ax : matplotlib.axes.Axes, optional
        Axes into which one panel is drawn; their title is unchanged.
    units : {"si", "field"}, optional
        m, kN and rad/s, or ft, klbf and rpm; by default those of the study.
    at : mapping, optional
        Values of axes by key: a sweep is cut at the nearest ones.
    depth, wob, rotary_speed : float or str, optional
        [m], [N] and [rad/s], as ``at``.
    start : int, optional
        One start of several.
    states : sequence of str, optional
        The two states of a basin drawn from an ensemble.
    over : Dataset, str or Path, optional
        A sweep below the ``ramp`` of a trace or below branches, or branches over a map.
    severity : int, optional
        0 to 4, of a ``window``: the greatest one that is safe.
    confidence : float, optional
        0 to 1, of a ``window`` and of ``probability`` where numbers are uncertain.
    xlim, ylim : pair of float or str, optional
        The ends of the horizontal and of the vertical axis, in SI or with units.
    time : pair of float, str or None, optional
        The part of a trace that is drawn [s].
    width, height : float or str, optional
        Lengths of the figure [m], such as ``"3.3 in"``.
    font_size : float, optional
        In points.
    title : str or bool, optional
        A text in place of the usual title, or False for none.
    style : str, Path or mapping, optional
        A style file of matplotlib, one of its styles, or a mapping of its settings. Changes
        of matplotlib's ``rcParams`` apply as well.

    Returns
    -------
    matplotlib.figure.Figure
        With ``ax``, the figure of these axes.

    Raises
    ------
    InputError
        Where the kind, or an argument, does not fit the data.

    Examples
    --------
    >>> figure = nsdrill.plot("out.h5", panel="bit_speed", ylim=("0 rpm", "90 rpm"))
    >>> figure.axes[0].get_ylabel()
    'Bit speed peaks [rad/s]'
    """
    from nsdrill.data import Trace
    from nsdrill.models.registry import drawn_in
    from nsdrill.plot import draw, look_of
    from nsdrill.plot.registry import is_study
    from nsdrill.study.study import Study

    if is_study(data) or isinstance(data, Study):
        given = {
            "at": at,
            "depth": depth,
            "wob": wob,
            "rotary_speed": rotary_speed,
            "start": start,
            "states": states,
            "over": over,
            "severity": severity,
            "confidence": confidence,
            "panel": panel,
            "xlim": xlim,
            "ylim": ylim,
            "time": time,
        }
        for name, value in given.items():
            if value is not None:
                raise InputError(
                    f"{name}: found with a study; allowed: with results. nsdrill.chart takes set and along."
                )
        return chart(
            data, kind, ax=ax, units=units, width=width, height=height, font_size=font_size, title=title, style=style
        )
    _check_confidence(confidence)
    units = units_for(units, data)
    wanted = look_of(width, height, font_size, title, style, xlim, time, ylim)
    chosen = values_in(at, None, depth=depth, wob=wob, rotary_speed=rotary_speed)
    start = number_in("start", start)
    behind: Any = None
    drawn = branches_in(data)
    if drawn is not None:
        if over is not None:
            behind = with_variables(data_in(over, None), "over", ("status",))
    else:
        outline = outline_in(data)
        drawn = outline
        if not isinstance(outline, Trace):
            drawn = _sweep_to_draw(data, outline, kind, chosen, start, panel, severity)
        if over is not None and (behind := branches_in(over)) is None:
            behind = results_in(over, "over", ("status", *drawn_in(outline.attrs).peaks))
    with missing_variable_errors("plot"):
        figure = draw(
            drawn,
            kind,
            units=units,
            at=chosen or None,
            start=start,
            look=wanted,
            panel=panel,
            ax=ax,
            over=behind,
            states=states,
            severity=severity,
            confidence=confidence,
        )
    if missing := getattr(figure, "missing", ""):
        text = f"The title has characters that no font here has: {missing[:20]}. title gives another one."
        warnings.warn(text, RunWarning, stacklevel=3)
    return figure


def _sweep_to_draw(
    data: ResultsLike,
    outline: Results,
    kind: str | None,
    chosen: dict[str, float],
    start: int | None,
    panel: str | None,
    severity: int | None,
) -> Results:
    """The results with what a picture is drawn of."""
    from nsdrill.plot import needed

    if severity is None:
        found: Any = data_in(data, needed(outline, kind, chosen, start, panel))
        if kind == "window":
            from nsdrill.app.window import with_passed_over

            found = with_passed_over(found)
        return cast("Results", found)
    if kind != "window":
        raise InputError(f"severity: found with kind={kind!r}; allowed: with kind='window'.")
    from nsdrill.app.window import read_for_window

    source = data_in(data, None) if is_dataset(data) else name_in(data)
    return read_for_window(source, severity)  # type: ignore[arg-type]


@_in_words_of_python
def animate(
    trace: ResultsLike,
    path: PathLike,
    *,
    time: tuple[Quantity | None, Quantity | None] | None = None,
    speed: float = 1.0,
    units: str | None = None,
    width: Quantity | None = None,
    title: str | bool | None = None,
    overwrite: bool = False,
) -> str:
    """Write a film of the collar in the hole, to scale, with bit and collar rotating.

    Parameters
    ----------
    trace : Dataset, str or Path
        Of :func:`simulate` or :func:`replay`.
    path : str or Path
        Ends in ``.gif`` or ``.mp4``; without ffmpeg, which MP4 requires, a GIF is written
        instead.
    time : pair of float, str or None, optional
        The part of the trace that is shown [s]; by default the last five revolutions.
    speed : float
        2 is twice real time.
    units : {"si", "field"}
        m, kN and rad/s, or ft, klbf and rpm.
    width : float or str, optional
        Of the pictures [m].
    title : str or bool, optional
        As in :func:`plot`.
    overwrite : bool
        An existing file may be replaced.

    Returns
    -------
    str
        The name of the written file.

    Raises
    ------
    FileError
        Where the file exists, unless ``overwrite``.
    InputError
        Where the trace has no collar that moves in a hole, or the film would be too long.

    Examples
    --------
    >>> trace = nsdrill.simulate("study.yaml", duration="1 s")
    >>> nsdrill.animate(trace, "film.gif", time=("0.8 s", None), width="1.5 in")
    'film.gif'
    """
    from nsdrill.data import Trace
    from nsdrill.plot import look_of
    from nsdrill.plot.animation import animate, film_name
    from nsdrill.store import claim_file

    data, units = outline_in(trace), units_for(units, trace)
    if not isinstance(data, Trace):
        raise InputError("trace: found results; allowed: a trace, of simulate or replay.")
    if isinstance(speed, bool) or not isinstance(speed, int | float):
        raise InputError(f"speed: found {speed!r}; allowed: a number.")
    written = film_name(name_in(path, "path"))
    claim_file(written, overwrite)
    look = look_of(width=width, title=title, time=time)
    with missing_variable_errors("animate"):
        animate(data, written, units=units, look=look, speed=speed, overwrite=overwrite)
    return written


@_in_words_of_python
def chart(
    study: StudyLike,
    kind: str | None = None,
    *,
    along: str | None = None,
    set: Settings = None,
    ax: Axes | None = None,
    units: str | None = None,
    width: Quantity | None = None,
    height: Quantity | None = None,
    font_size: float | None = None,
    title: str | bool | None = None,
    style: PathLike | Mapping[str, Any] | None = None,
) -> Figure:
    """Draw a chart of a study, without a run.

    Parameters
    ----------
    study : str, Path, mapping or Study
        Anything that :func:`load_study` takes.
    kind : str
        ``"critical-speeds"`` against depth, or ``along`` another axis; ``"buckling"`` loads
        against the inclination of the hole, or ``along`` an axis; ``"drive-card"``, the share
        of a torsional wave that each drive reflects; ``"drive-tuning"``, the decrease of
        friction with speed that a soft-torque drive stabilises, over its gain and frequency.
    along : str, optional
        The key of an axis that the study sweeps.
    set : mapping or sequence of str, optional
        Keys of the study to change, as in :func:`load_study`.
    ax : matplotlib.axes.Axes, optional
        Axes into which the chart is drawn.
    units : {"si", "field"}
        m, kN and rad/s, or ft, klbf and rpm.
    width, height : float or str, optional
        Lengths of the figure [m], such as ``"3.3 in"``.
    font_size : float, optional
        In points.
    title : str or bool, optional
        A text in place of the usual title, or False for none.
    style : str, Path or mapping, optional
        A style file of matplotlib, one of its styles, or a mapping of its settings. Changes
        of matplotlib's ``rcParams`` apply as well.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        Where the kind is not known, or the study does not have what it shows.

    Examples
    --------
    >>> figure = nsdrill.chart("study.yaml", "critical-speeds", units="field")
    >>> figure.axes[0].get_ylabel()
    'Rotary speed [rpm]'
    """
    from nsdrill.app.charts import draw_chart
    from nsdrill.plot import look_of

    loaded, wanted = study_in(study, set), look_of(width, height, font_size, title, style)

    return draw_chart(loaded, kind, along, units=units or loaded.units, look=wanted, ax=ax)


@_in_words_of_python
def view(
    path: PathLike, *, over: PathLike | None = None, set: Settings = None, units: str | None = None, height: int = 900
) -> View:
    """Explore a file in the browser, as ``nsdrill view`` does.

    Parameters
    ----------
    path : str or Path
        Results, an unfinished run, branches or a study.
    over : str or Path, optional
        Of results, branches that are drawn above them.
    set : mapping or sequence of str, optional
        Keys of the study to change, as in :func:`load_study`.
    units : {"si", "field"}
        m, kN and rad/s, or ft, klbf and rpm.
    height : int
        Pixels of the frame in a notebook.

    Returns
    -------
    View
        It runs until its ``close()`` or the end of this process.

    Raises
    ------
    FileError
        Where the file is none of these.

    Examples
    --------
    >>> with nsdrill.view("out.h5") as explorer:
    ...     print(explorer.url.startswith("http://127.0.0.1:"))
    True
    """
    from nsdrill.plot.labels import check_units
    from nsdrill.web.notebook import View
    from nsdrill.web.server import Explorer
    from nsdrill.web.session import Session

    if units is not None:
        check_units(units)
    if is_dataset(path):
        raise InputError(
            "path: found results in memory; allowed: the name of a file, as the explorer reads "
            "one. Save them first: "
            'nsdrill.save(results, "out.h5").'
        )
    if not is_whole(height) or not 100 <= height <= 10_000:
        raise InputError(f"height: found {height!r}; allowed: 100 to 10000 pixels.")
    above = None if over is None else name_in(over, "over")
    return View(Explorer(Session(name_in(path, "path"), units, texts_in(set, "set"), above)), height)


@_in_words_of_python
def window(results: ResultsLike, severity: int | None = None, confidence: float | None = None) -> dict[str, Any]:
    """Find the safe operating window: the points that are safe for every history.

    Parameters
    ----------
    results : Dataset, str or Path
        Results of a sweep: a Dataset, or the name of a file.
    severity : int, optional
        0 to 4: safe is a run none of whose severities exceeds this one; by default, one
        without a critical response.
    confidence : float, optional
        0 to 1: with samples of uncertain numbers a point is safe if a run is safe with at
        least this probability (0.9).

    Returns
    -------
    dict
        Plain data in SI units with the keys of ``nsdrill window --json``; with samples, the
        recommended point has its ``probability`` with a 95 % interval.

    Raises
    ------
    InputError
        Where the results lack what is needed, or an argument is invalid.

    Examples
    --------
    >>> found = nsdrill.window("out.h5")
    >>> 0 <= found["safe"] <= found["points"]
    True
    """
    from nsdrill.analysis.probability import needed
    from nsdrill.analysis.window import USES
    from nsdrill.app import window as app

    _check_severity(severity)
    _check_confidence(confidence)
    if not is_dataset(results):
        return app.window(name_in(results), severity, confidence)
    return app.window(results_in(results, "window", ["status", *needed(severity), *USES]), severity, confidence)


@_in_words_of_python
def probability(results: ResultsLike, severity: int | None = None) -> Dataset:
    """Estimate the probability of a safe run, and of each response, at every operating
    point of results with samples of uncertain numbers.

    Parameters
    ----------
    results : Dataset, str or Path
        Results of a sweep: a Dataset, or the name of a file.
    severity : int, optional
        0 to 4: safe is a run none of whose severities exceeds this one; by default, one
        without a critical response.

    Returns
    -------
    Dataset
        ``probability``, the ends ``low`` and ``high`` of its 95 % interval, and ``unknown``,
        over ``outcome`` (``safe`` and the responses), the swept axes, and ``history`` where
        there are several procedures: each of them, and ``every``, for which a point is safe
        in all of them, or has a response in any.

    Raises
    ------
    InputError
        For results without samples.

    Examples
    --------
    >>> found = nsdrill.probability("uncertain.h5")
    >>> found.probability.dims
    ('outcome', 'rotary_speed')
    """
    from nsdrill.app.probability import dataset
    from nsdrill.app.window import read_for_window

    _check_severity(severity)
    if not is_dataset(results):
        return dataset(read_for_window(name_in(results), severity), severity)
    from nsdrill.analysis.probability import needed

    return dataset(results_in(results, "probability", ["status", *needed(severity)]), severity)


@_in_words_of_python
def sensitivity(results: ResultsLike, severity: int | None = None) -> dict[str, Any]:
    """Find which uncertain number matters: Sobol indices of results with samples.

    Parameters
    ----------
    results : Dataset, str or Path
        Results with samples. A Dataset may be a part of them, such as
        ``data.sel(wob=40e3)``; the indices sum over its operating points.
    severity : int, optional
        0 to 4: safe is a run none of whose severities exceeds this one; by default, one
        without a critical response.

    Returns
    -------
    dict
        Plain data in SI units with the keys of ``nsdrill sensitivity --json``: the indices of
        every unknown for the safe run and for each feature that decides on a response, and
        which unknown to ``measure_first``.

    Raises
    ------
    InputError
        For results without samples.

    Examples
    --------
    >>> found = nsdrill.sensitivity("uncertain.h5")
    >>> found["samples"], found["points"]
    (16, 2)
    """
    from nsdrill.analysis.sensitivity import needed
    from nsdrill.app import sensitivity as app

    _check_severity(severity)
    if not is_dataset(results):
        return app.sensitivity(name_in(results), severity)
    outline = cast("Results", outline_in(results))
    return app.sensitivity(results_in(results, "sensitivity", ["status", *needed(outline, severity)]), severity)


@_in_words_of_python
def fit(
    study: StudyLike,
    data: PathLike,
    path: PathLike | None = None,
    *,
    set: Settings = None,
    rename: Mapping[str, str] | None = None,
    ignore: Sequence[str] = (),
    errors: Mapping[str, str | float] | None = None,
    skip_gaps: bool = False,
    shortest: Quantity = "120 s",
    settle: Quantity = "60 s",
    batch: int = 128,
    rounds: int = 8,
    samples: int = 128,
    workers: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    large: bool = False,
    progress: bool | Callable[[Progress], object] = True,
) -> Fit:
    """Adjust the unknowns of a study, the numbers of its section ``uncertain``, to
    measurements.

    With ``path`` every round is saved next to it: after a KeyboardInterrupt, or a power cut,
    the same call with ``resume=True`` makes the missing runs, with the same bits as an
    uninterrupted fit.

    Parameters
    ----------
    study : str, Path, mapping or Study
        Anything that :func:`load_study` takes.
    data : str or Path
        A CSV file with a name and a unit over every column, over operating points or over
        time.
    path : str or Path, optional
        The adjusted study to write.
    set : mapping or sequence of str, optional
        Keys of the study to change, as in :func:`load_study`.
    rename : mapping, optional
        The names of nsdrill by heads of the file.
    ignore : sequence of str
        Heads to ignore; ``"*"`` ignores all unknown ones.
    errors : mapping, optional
        Standard deviations by name: ``{"surface_torque_max": "0.2 kft*lbf"}``, in percent, or
        in SI as numbers.
    skip_gaps : bool
        Pass over rows with gaps.
    shortest, settle : float or str
        Of a table over time: the least duration of a stretch of constant settings [s], and
        its first part that is not used [s].
    batch, rounds, samples : int
        At most so many rounds of ``batch`` samples are run; the adjusted study has
        ``samples`` samples.
    workers : int, optional
        The number of parallel runs; by default that of the processors.
    resume, overwrite : bool
        As in :func:`run`.
    large : bool
        More than a million runs are meant.
    progress : bool or callable
        True for a bar on stderr in terminals and notebooks, or a line every 10 s elsewhere;
        False for none; or a function that is called with a :class:`Progress` a few times a
        second. An exception from it ends the run, which can be resumed.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        Where the study has no unknown, or something in the file cannot be used.

    Examples
    --------
    >>> found = nsdrill.fit("uncertain.yaml", "field.csv", batch=16, progress=False)
    >>> list(found.samples)
    ['bit.friction.static']
    """
    from nsdrill.app import fit as app
    from nsdrill.app.measured import Reading, read_measured
    from nsdrill.app.rounds import Rounds
    from nsdrill.store import write_text

    for name, number, least in (("batch", batch, 16), ("rounds", rounds, 2), ("samples", samples, 2)):
        if not is_whole(number) or number < least:
            raise InputError(f"{name}: found {number!r}; allowed: a whole number, {least} or more.")
    if path is None:
        for name, on in (("resume", resume), ("overwrite", overwrite)):
            if on:
                raise InputError(f"{name}: found without a path; allowed: with the path of a file.")
    loaded = study_in(study, set)
    times = seconds_in("shortest", shortest), seconds_in("settle", settle)
    measured = read_measured(
        name_in(data, "data"), loaded, Reading(rename or {}, tuple(ignore), errors or {}, skip_gaps, *times)
    )
    for text in app.far_from_the_sweep(loaded, measured):
        warnings.warn(text, RunWarning, stacklevel=3)
    calls = Rounds()
    if path is not None:
        path = name_in(path, "path")
        check_other_file(study, path)
        check_other_file(data, path)
        calls = Rounds.beside(path, loaded, measured, batch, overwrite=overwrite, resume=resume)
    with calls.guarding(), reporting(progress) as watch:
        found = app.fit(
            loaded,
            measured,
            batch=batch,
            rounds=rounds,
            samples=samples,
            workers=workers,
            watch=watch,
            kept=calls,
            large=large,
        )
        if path is not None:
            write_text(path, found.study, calls.recovery_text, overwrite=overwrite or resume)
            calls.discard()
    return found


@_in_words_of_python
def hysteresis(results: ResultsLike) -> list[dict[str, Any]]:
    """Find where the two directions of an up-down sweep differ.

    Parameters
    ----------
    results : Dataset, str or Path
        Results of a sweep: a Dataset, or the name of a file.

    Returns
    -------
    list of dict
        One for each interval, in SI units, as in ``nsdrill show --json``; empty for a sweep
        that is not up-down.

    Raises
    ------
    InputError
        Where the results lack what is needed.

    Examples
    --------
    >>> [sorted(one) for one in nsdrill.hysteresis("out.h5")][:0]
    []
    """
    from nsdrill.app import hysteresis as app

    return app.hysteresis(results_in(results, "hysteresis", app.NEEDED) if is_dataset(results) else name_in(results))


@_in_words_of_python
def attractors(results: ResultsLike) -> list[dict[str, Any]]:
    """Describe the attractors of each operating point of results with several starts.

    Parameters
    ----------
    results : Dataset, str or Path
        Results of a sweep: a Dataset, or the name of a file.

    Returns
    -------
    list of dict
        One for each operating point in the order of the results: the values of the axes in SI
        units, the numbers of ``starts``, ``failed``, ``pending``, ``unsettled`` and
        ``ungrouped`` ones, and ``attractors``, by decreasing share: ``number``, the same for
        one attractor in all entries, ``response``, ``whirl_kind``, ``motion`` and ``period``
        where recorded, ``members``, ``unsettled`` members, ``share`` of the starts that ended
        well and its 95 % interval ``low`` to ``high`` (None in a slice, whose starts are not
        a sample), and the median ``features`` in SI (None where not finite).

    Raises
    ------
    FileError
        Where every operating point has one start.

    Examples
    --------
    >>> points = nsdrill.attractors("ensemble.h5")
    >>> points[0]["starts"], sum(one["share"] for one in points[0]["attractors"])
    (4, 1.0)
    """
    from nsdrill.analysis.attractors import NEEDED
    from nsdrill.app import attractors as app

    return app.attractors(results_in(results, "attractors", NEEDED) if is_dataset(results) else name_in(results))


@_in_words_of_python
def check(study: StudyLike, set: Settings = None) -> Report:
    """Check a study without running it.

    Parameters
    ----------
    study : str, Path, mapping or Study
        Anything that :func:`load_study` takes.
    set : mapping or sequence of str, optional
        Keys of the study to change, as in :func:`load_study`.

    Returns
    -------
    Report

    Raises
    ------
    StudyError
        Where the study is not valid.

    Examples
    --------
    >>> report = nsdrill.check("study.yaml")
    >>> report.points, report.coefficients.k_t > 0.0
    (10, True)
    """
    from nsdrill.app import check as app

    return app.check(study_in(study, set))


@_in_words_of_python
def diff(a: ResultsLike, b: ResultsLike) -> dict[str, Any]:
    """Compare two results or traces.

    Parameters
    ----------
    a, b : Dataset, str or Path
        What is compared.

    Returns
    -------
    dict
        Plain data in SI units: ``same_study`` (apart from the title) and ``same_numbers`` (to
        the bit); and details in ``study``, ``made``, ``axes``, ``points``, ``responses`` and
        ``variables``, as in ``nsdrill diff --json``.

    Raises
    ------
    InputError
        Where the two are of different kinds.

    Examples
    --------
    >>> nsdrill.diff("out.h5", "out.h5")["same_numbers"]
    True
    """
    from nsdrill.app import diff as app

    one, two = (data_in(data, None) if is_dataset(data) else name_in(data) for data in (a, b))
    return app.diff(one, two)


@_in_words_of_python
def combine(results: Sequence[ResultsLike], path: PathLike | None = None, overwrite: bool = False) -> Dataset:
    """Combine results whose studies differ in one number, which becomes an axis.

    The result equals that of a sweep of that axis, to the bit.

    Parameters
    ----------
    results : sequence of Dataset, str or Path
        Two or more.
    path : str or Path, optional
        The results file to write.
    overwrite : bool
        An existing file may be replaced.

    Returns
    -------
    Dataset

    Raises
    ------
    InputError
        Where they differ in anything else.

    Examples
    --------
    >>> parts = [
    ...     nsdrill.run("study.yaml", set={"operation.wob": wob}, progress=False)
    ...     for wob in ("20 kN", "30 kN")
    ... ]
    >>> nsdrill.combine(parts).wob.values.tolist()
    [20000.0, 30000.0]
    """
    from nsdrill.app import combine as app
    from nsdrill.app import saving
    from nsdrill.store.dataset import to_dataset

    if isinstance(results, str | os.PathLike) or is_dataset(results):
        raise InputError("results: found one of them; allowed: a list of two or more.")
    parts = [results_in(one, "combine", ("status", "response")) if is_dataset(one) else name_in(one) for one in results]
    whole, _ = app.combine(parts)
    if path is not None:
        saving.save(whole, name_in(path, "path"), overwrite=overwrite)
    return to_dataset(whole)


@_in_words_of_python
def open_results(path: PathLike) -> Dataset:
    """Open a file as a Dataset: results, a trace, branches, or the points so far of an
    unfinished run (``path.part``).

    Results are read lazily: close the Dataset after use, or use ``with``.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Dataset
        With units and names on every variable, in SI.

    Raises
    ------
    FileError
        Where the file cannot be read.

    Examples
    --------
    >>> with nsdrill.open_results("out.h5") as results:
    ...     print(results.rotary_speed.attrs["units"], results.rotary_speed.values[0])
    rad s-1 2.0
    """
    from nsdrill.app.reading import read_any
    from nsdrill.store import kind_of, open_branches, open_results
    from nsdrill.store.dataset import to_dataset

    path = name_in(path, "path")
    kind = kind_of(path) if os.path.lexists(path) else None
    if kind == "results":
        return open_results(path)
    if kind == "branches":
        return open_branches(path)
    return to_dataset(read_any(path))


@_in_words_of_python
def save(data: Dataset | Figure, path: PathLike, overwrite: bool = False) -> None:
    """Write results, a trace, branches or a figure to a file, in one step.

    Parameters
    ----------
    data : Dataset or matplotlib.figure.Figure
        What is written.
    path : str or Path
        HDF5 (``.h5``), netCDF (``.nc``) or a table (``.csv``, one row for each point or
        sample, with units in the headings); of a figure ``.png``, ``.pdf`` or ``.svg``.
    overwrite : bool
        An existing file may be replaced.

    Returns
    -------
    None

    Raises
    ------
    FileError
        Where the file exists, unless ``overwrite``.
    InputError
        For other endings, or for a Dataset that lacks variables of its kind of file or has
        further ones.

    Examples
    --------
    >>> nsdrill.save(nsdrill.open_results("out.h5"), "table.csv")
    >>> nsdrill.save(nsdrill.plot("out.h5"), "picture.pdf")
    """
    from nsdrill.app import saving
    from nsdrill.models.vocabulary import BY_NAME, IN_TRACE
    from nsdrill.plot import check_suffix
    from nsdrill.plot import save as save_figure
    from nsdrill.store import claim_file
    from nsdrill.store.dataset import from_dataset

    path = name_in(path, "path")
    if is_figure(data):
        check_suffix(path)
        claim_file(path, overwrite)
        save_figure(cast("Figure", data), path, overwrite=overwrite)
        return
    if not is_dataset(data):
        raise InputError(f"save: found a value of the type {type(data).__name__}; allowed: a Dataset, or a figure.")
    known = {*BY_NAME, *IN_TRACE}
    dataset: Any = data
    if dataset.attrs.get("nsdrill_kind") == "branches" or "branch" in dataset.dims:
        from nsdrill.store import write_branches

        claim_file(path, overwrite)
        write_branches(path, dataset, overwrite=overwrite)
        return
    if extra := [str(name) for name in dataset.data_vars if name not in known]:
        raise InputError(
            f"the Dataset: found {', '.join(extra)}, which nsdrill does not know; allowed: its "
            f"own variables. Leave "
            "the others out with drop_vars, or write all with to_netcdf."
        )
    saving.save(validated(from_dataset(dataset)), path, overwrite=overwrite)


def _check_severity(severity: Any) -> None:
    if severity is not None and (not is_whole(severity) or severity not in range(5)):
        raise InputError(f"severity: found {severity!r}; allowed: 0 to 4, or None.")


def _check_confidence(confidence: Any) -> None:
    if confidence is not None and not (isinstance(confidence, float) and 0.0 < confidence < 1.0):
        raise InputError(f"confidence: found {confidence!r}; allowed: a number between 0 and 1, as 0.9, or None.")


_OPERATION = ("depth", "wob", "rotary_speed")
_PROCEDURES = ("same", "up", "down")


def _warn_failed(failed: int, points: int) -> None:
    if failed:
        text = f"{failed} of {points} points failed; status says which and how, and nsdrill.show lists them."
        warnings.warn(text, RunWarning, stacklevel=4)


def _trace(result: Trajectory) -> Dataset:
    """The trace of a run as a Dataset; RunWarning where it ended early."""
    from nsdrill.app.wording import ENDINGS
    from nsdrill.store.dataset import to_dataset
    from nsdrill.variables import OK

    if result.status != OK:
        status = str(result.trace.attrs["status"])
        words = f"The run ended early ({status}): {ENDINGS.get(status, status)}" + (
            f"; {result.advice}." if result.advice else "."
        )
        warnings.warn(f"{words} The trace holds what was computed before.", RunWarning, stacklevel=4)
    return to_dataset(result.trace)
