"""Operations that answer a question about a study or about results."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from nsdrill.errors import InputError, NsdrillError, Refusal, count, option
from nsdrill.late import deferred
from nsdrill.operations.argument import Argument, Choice, File, Flag, Texts, Whole
from nsdrill.operations.arguments import (
    DEVICES,
    FILE,
    AnyData,
    At,
    Confidence,
    Depth,
    Everything,
    One,
    Other,
    Overwrite,
    PathLike,
    ResultsLike,
    Settings,
    Severity,
    Speed,
    StudyLike,
    Tried,
    Two,
    Units,
    Weight,
    Within,
)
from nsdrill.records import dataclass

with deferred():
    from nsdrill import files, store
    from nsdrill import progress as reports
    from nsdrill.analysis import hysteresis as directions
    from nsdrill.analysis import probability as probabilities
    from nsdrill.analysis import window as windows_of
    from nsdrill.app import check as checking
    from nsdrill.app import conversion, datasets
    from nsdrill.app import experiment as experiments
    from nsdrill.app.answering import answers, attractor_summary, summary, window_trials
    from nsdrill.app.following import continuing
    from nsdrill.app.running import place as places
    from nsdrill.app.running import price as pricing
    from nsdrill.app.running import run as running
    from nsdrill.app.running import unfinished
    from nsdrill.text import branch_text, window_text
    from nsdrill.text import show as text
    from nsdrill.variables import short_key
    from nsdrill.web import one_page as one_sheet
    from nsdrill.web import report as pages
    from nsdrill.web import session as sessions

if TYPE_CHECKING:
    from xarray import Dataset

    from nsdrill.app.check import Report
    from nsdrill.app.running.stages import Watch
    from nsdrill.data import Answer
    from nsdrill.web.session import Session

ResultsFiles = Annotated[
    "PathLike | Sequence[PathLike]",
    Argument(
        "The name of a file of a sweep or of branches, or several of them.",
        "str, Path or sequence of them",
        "RESULTS",
        kind=File(several=True),
    ),
]
ReportPath = Annotated["PathLike", Argument("Page to write: .html.", FILE, "-o --output", "FILE", File(writes=True))]
Motions = Annotated[
    int,
    Argument(
        "Number of example motions to include, one of each kind of response.", "int", "--motions", "N", Whole(0, 8)
    ),
]


OnePage = Annotated[
    bool,
    Argument(
        "Write one sheet for the rig in place of the report: what to do and what not, three numbers, the map, and the "
        "limits by weight, of one file or of two.",
        "bool",
        "--one-page",
        kind=Flag(),
        help="One printed sheet for the rig in place of the report, of one file or of two.",
    ),
]
PAPERS = Choice(("A4", "letter"))
Paper = Annotated[
    str,
    Argument(
        "With ``one_page``: the paper.", '{"A4", "letter"}', "--paper", kind=PAPERS, help="With --one-page: the paper."
    ),
]
Label = Annotated[
    "str | Sequence[str] | None",
    Argument(
        "The name of each file on the page, in their order, in place of what differs or of the file's own.",
        "str or sequence of str",
        "--label",
        "NAME",
        Texts(),
        "Name of a file on the page; one for each file, in their order.",
    ),
]
Well = Annotated[
    "str | None", Argument("With ``one_page``: the well.", "str", "--well", "NAME", help="With --one-page: the well.")
]
Rig = Annotated[
    "str | None", Argument("With ``one_page``: the rig.", "str", "--rig", "NAME", help="With --one-page: the rig.")
]
Author = Annotated[
    "str | None",
    Argument(
        "With ``one_page``: who prepared it.", "str", "--author", "NAME", help="With --one-page: who prepared it."
    ),
]
Dated = Annotated[
    "str | None",
    Argument(
        "With ``one_page``: its date; by default that of the last run, which stands at its end too.",
        "str",
        "--date",
        "DATE",
        help="With --one-page: its date. Default: that of the last run.",
    ),
]
Priced = Annotated[
    bool, Argument("Time some points of the sweep, and tell how long all will take.", "bool", "--price", kind=Flag())
]
PricedDevice = Annotated[
    str,
    Argument(
        "With ``price``: where the sweep is to run. The time on a GPU is not known before it has run there.",
        '{"cpu", "gpu", "auto"}',
        "--device",
        kind=Choice(DEVICES),
        help="With --price: where the sweep is to run. The time on a GPU is not known before it has run there.",
    ),
]


def check(
    study: StudyLike, set: Settings = None, units: Units = None, price: Priced = False, device: PricedDevice = "cpu"
) -> Report:
    """Check a study without running it; with ``price`` some of its points are timed.

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
    loaded = conversion.study_in(study, set)
    report = checking.check(loaded, units or loaded.units)
    if not price:
        if device != "cpu":
            raise Refusal("device", f"{device} without price", f"{device} with {option('price')}, or none")
        return report
    running.check_sweep(loaded)
    workers = running.processors()
    place = places.place_of(device, experiments.prepare(loaded), workers)
    return replace(report, price=None if place.gpu else pricing.price_of(loaded, workers), device=place.told)


@dataclass(frozen=True)
class Shown:
    """A summary as plain data in SI, and what it is shown in: of the file or data
    ``name``, in ``units``, with ``everything``."""

    name: str
    summary: Answer
    units: str
    everything: bool

    def lines(self) -> Iterator[str]:
        """The summary in words."""
        return text.lines(self.name, self.summary, self.units, self.everything)


def show(data: AnyData, *, units: Units = None, everything: Everything = False) -> Shown:
    """Summarise results, an unfinished run, branches or a trace, as ``nsdrill show`` does.

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
    name = "Dataset" if datasets.is_dataset(data) else os.fspath(conversion.name_in(data))
    units = datasets.units_for(units, data)
    return Shown(name, _summary(data, name), units, everything)


def _summary(data: AnyData, name: str) -> Answer:
    part = None if datasets.is_dataset(data) else unfinished.summary(name)
    if part is not None and (part["what"] != continuing.WHAT or not part["kept"]):
        return part
    if (branches := datasets.branches_in(data)) is not None:
        return branch_text.summarize_branches(branches)
    is_sweep = not datasets.is_dataset(data) and os.path.lexists(name) and store.kind_of(name) == "results"
    with datasets.missing_variable_errors("show"):
        return summary.summarize(datasets.data_in(data, summary.needed(name if is_sweep else None)))


def window(
    results: ResultsLike,
    other: Other = None,
    severity: Severity = None,
    confidence: Confidence = None,
    trials: Tried = False,
    within: Within = None,
) -> Answer:
    """Find where to run, how to get there, and what never to exceed: the ``answer`` of
    results, and the numbers behind it. With ``other`` results over the same axes,
    compare the two windows. With ``trials``, which are of one file, an interrupt ends the
    trials, and the answer has those that ended.

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
    >>> found = nsdrill.window("out.h5", nsdrill.open_results("out.h5"))
    >>> found["gained"], found["lost"]
    (0, 0)
    """
    if other is None and trials:
        return window_trials.window(results, severity, confidence, within)
    if other is None:
        return answers.window(results, severity, confidence, within)
    if trials:
        raise Refusal("trials", "two files", "one, as trials are of one answer")
    both = (results, other)
    data = [answers.results_for_window(one, severity, within) for one in both]
    names = [
        letter if datasets.is_dataset(one) else os.path.basename(conversion.name_in(one))
        for letter, one in zip("ab", both, strict=True)
    ]
    found = answers.contrast(data[0], data[1], severity, confidence, names)
    return answers.plain_contrast(found, answers.units_of(data[0].attrs))


def probability(results: ResultsLike, severity: Severity = None) -> Dataset:
    """Estimate the probability of a safe run, and of each response, at every operating
    point of results with samples of uncertain numbers.

    Returns
    -------
    Dataset
        ``probability`` among the samples that are ``known``, NaN where none is, and the ends
        ``low`` and ``high`` of its 95 % interval, which covers whatever the others show,
        over ``outcome`` (``safe`` and the responses), the swept axes, and ``history`` where
        there are several procedures: each of them, and ``every``, for which a point is safe
        in all of them, or has a response in any. Without ``outcome``: in how many samples a
        run ``failed`` or is ``pending``, and the part of them, ``unknown``, of which it is
        open whether they are safe. The attribute ``of`` is the number of samples.

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
    return answers.probability(results, severity)


def sensitivity(
    results: ResultsLike,
    severity: Severity = None,
    *,
    depth: Annotated[Depth, "Of a sweep, the points at this depth only."] = None,
    wob: Annotated[Weight, "The points at this weight on bit."] = None,
    rotary_speed: Annotated[Speed, "The points at this rotary speed."] = None,
    at: At = None,
) -> Answer:
    """Find which uncertain number matters: Sobol indices of results with samples.

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
    chosen = conversion.values_in(at, None, depth=depth, wob=wob, rotary_speed=rotary_speed)
    return answers.sensitivity(results, severity, chosen)


def hysteresis(results: ResultsLike) -> list[Answer]:
    """Find where the two directions of an up-down sweep differ.

    Returns
    -------
    list of dict
        One for each interval, in SI units, as in ``nsdrill show --json``; empty for a sweep that is
        not up-down. A true end may lie some steps of the axis away on either side. Of a model
        without responses, ``differs`` has the features by which the two motions differ: by half a
        natural scale, or by 5 % of the time.

    Raises
    ------
    InputError
        Where the results lack what is needed: responses, or natural scales.

    Examples
    --------
    >>> [sorted(one) for one in nsdrill.hysteresis("out.h5")][:0]
    []
    """
    found = datasets.sweep_in(results, "hysteresis", directions.NEEDED, None)
    if not directions.comparable(found):
        raise InputError(
            f"hysteresis: found results of the model {found.attrs.get('model')}, which has no responses, without the "
            "natural scales in which motions are compared; allowed: those of a model with responses, or of the model "
            "of a script, run with this version."
        )
    return summary.directions(found)


def attractors(results: ResultsLike) -> list[Answer]:
    """Describe the attractors of each operating point of results with several starts.

    Returns
    -------
    list of dict
        One for each operating point in the order of the results: the values of the axes in SI
        units, the numbers of ``starts``, ``known``, ``failed``, ``pending``, ``unsettled``,
        ``doubtful`` (off speed, or on an unstable motion) and ``ungrouped`` ones, and
        ``attractors``, by decreasing share: ``number``, the same for one attractor in all
        entries, ``response``, ``whirl_kind``, ``motion`` and ``period``
        where recorded, ``members``, ``unsettled`` members, ``share`` of the known
        starts and its 95 % interval ``low`` to ``high`` (None in a slice, whose starts are not
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
    return attractor_summary.attractors(results)


def diff(a: One, b: Two) -> Answer:
    """Compare two results, traces or files of branches.

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
    return answers.diff(a, b)


def report(
    results: ResultsFiles,
    path: ReportPath,
    *,
    motions: Motions = 0,
    units: Units = None,
    severity: Severity = None,
    confidence: Confidence = None,
    one_page: OnePage = False,
    paper: Paper = "A4",
    label: Label = None,
    well: Well = None,
    rig: Rig = None,
    author: Author = None,
    date: Dated = None,
    trials: Tried = False,
    within: Within = None,
    overwrite: Overwrite = False,
) -> str:
    """Write files of sweeps or branches as one file of HTML, as ``nsdrill report`` does; with
    ``one_page`` one printed sheet for the rig.

    Returns
    -------
    str
        The name of the page.

    Raises
    ------
    FileError
        Where the page exists, unless ``overwrite``.
    InputError
        Where a file is a study or a trace, or an argument is invalid.

    Examples
    --------
    >>> nsdrill.report("out.h5", "report.html")
    'report.html'
    >>> nsdrill.report("out.h5", "sheet.html", one_page=True, paper="letter", well="A-7")
    'sheet.html'
    """
    path = conversion.name_in(path, "path")
    if not path.lower().endswith((".html", ".htm")):
        raise InputError(f"{path}: found another ending; allowed: .html.")
    store.claim_file(path, overwrite)
    given = [results] if isinstance(results, str | os.PathLike) or datasets.is_dataset(results) else list(results)
    if not given:
        raise Refusal("results", "no file", "one or more")
    if any(map(datasets.is_dataset, given)):
        allowed = "names of files, as the page says how they were made"
        raise Refusal("results", "results in memory", allowed, 'Save them first: nsdrill.save(results, "out.h5").')
    names = [conversion.name_in(one) for one in given]
    for name in names:
        if not datasets.is_study(name) and os.path.lexists(name) and store.kind_of(name) == "trace":
            raise InputError(f"{name}: found a trace; allowed: results or branches. Draw it with nsdrill plot.")
    labels = _labels(label, names)
    fields = {"Well": well, "Rig": rig, "Prepared by": author, "Date": date}
    _refuse_beside(one_page, motions, paper, fields)
    from nsdrill.figures.picture_kinds import load_matplotlib

    load_matplotlib()
    units = datasets.units_for(units, names[0])
    if one_page:
        with reports.reporting(True) if trials else nullcontext() as watch:
            sheets = [_sheet(file, units, severity, confidence, watch, within) for file in names]
            for one in sheets:
                _ = one.window
        runs = max(str(one.results.attrs.get("created", ""))[:10] for one in sheets)
        shown = {name: fields[name] or "" for name in ("Well", "Rig", "Date", "Prepared by")}
        shown["Date"] = shown["Date"] or runs
        files.write_text(path, one_sheet.one_page(sheets, paper, shown, labels), overwrite=overwrite)
        return path
    branches = [file for file in names if datasets.is_branches(file)]
    # drawn over the sweeps along the same number
    over = branches[0] if len(branches) == 1 else None
    opened = [_session(file, units, None if file in branches else over) for file in names]
    if within:
        for session in opened:
            _drill_within(session, within)
    windows = [_tried(one, severity, confidence) if trials else None for one in opened]
    parts = [
        pages.Part(one, _summaries(one, units, severity, confidence), window)
        for one, window in zip(opened, windows, strict=True)
    ]
    words = ["nsdrill", "report", *names, "-o", path]
    words += ["--motions", str(motions)] if motions else []
    words += ["--units", units] if units != "si" else []
    words += ["--severity", str(severity)] if severity is not None else []
    words += ["--confidence", f"{100 * confidence:g}"] if confidence is not None else []
    words += [word for one in labels or () for word in ("--label", one)]
    words += ["--trials"] if trials else []
    words += [word for text in _range_texts(within) for word in ("--within", text)]
    page = pages.report(parts, shlex.join(words), motions, severity, confidence, labels)
    files.write_text(path, page, overwrite=overwrite)
    return path


def _labels(label: str | Sequence[str] | None, names: Sequence[str]) -> list[str] | None:
    """The names of the files on the page; None where none are given."""
    labels = [label] if isinstance(label, str) else list(label or ())
    if labels and len(labels) != len(names):
        raise Refusal("label", count(len(labels), "name"), f"{len(names)}, one for each file")
    return labels or None


def _refuse_beside(one_page: bool, motions: int, paper: str, fields: Mapping[str, str | None]) -> None:
    """A Refusal of what a report has no place for, or one page has none."""
    PAPERS.read("paper", paper)
    if one_page and motions:
        raise Refusal("motions", f"with {option('one_page')}", "without it")
    given = {"well": fields["Well"], "rig": fields["Rig"], "author": fields["Prepared by"], "date": fields["Date"]}
    given["paper"] = paper if paper != "A4" else None
    for name, value in given.items():
        if value is not None and not one_page:
            raise Refusal(name, "with a report of several pages", f"with {option('one_page')}")


def _sheet(
    file: str, units: str, severity: int | None, confidence: float | None, watch: Watch | None, within: object
) -> one_sheet.Sheet:
    """The sheet of one file, ``within`` where one drills, with trials where something is to ``watch`` them."""
    if datasets.is_study(file):
        raise InputError(f"{file}: found a study; allowed: results. Run it first: nsdrill run.")
    outline = None if datasets.is_branches(file) else datasets.outline(file)
    return one_sheet.sheet_of(file, outline, units, severity, confidence, watch, within)


def _session(file: str, units: str, over: str | None) -> Session:
    """A session of ``file``, with the branches ``over`` if they are of the same
    model."""
    if over is not None:
        with suppress(InputError):
            return sessions.Session(file, units, over=over)
    return sessions.Session(file, units)


def _drill_within(session: Session, within: object) -> None:
    """Has all answers from the results of a session be those ``within`` where one drills. A
    Refusal where it has none, or they were not swept."""
    if session.results is None:
        raise Refusal("within", f"with {session.path}", "with results of a sweep")
    session.results = answers.drilled_within(session.results, within)


def _range_texts(within: Mapping[str, Any] | Sequence[Any] | None) -> list[str]:
    """What to write after ``--within`` for the same ranges; numbers are in SI."""
    found = []
    for key, value in within.items() if isinstance(within, Mapping) else within or ():
        unit = "N" if short_key(key) == "wob" else "rad/s"
        ends = value.split("..") if isinstance(value, str) else value
        low, high = (end.strip() if isinstance(end, str) else f"{end!r} {unit}" for end in ends)
        found.append(f"{key}={low}..{high}")
    return found


def _tried(session: Session, severity: int | None, confidence: float | None) -> Answer | None:
    """The window of the file with trials; None where it has none."""
    if session.results is None or not session.results.swept:
        return None
    try:
        results = answers.results_for_window(session.results, severity)
        found = windows_of.find_window(results, severity, confidence)
    except NsdrillError:  # four axes, a part of a design
        return None
    with reports.reporting(True) as watch:
        return window_trials.tried(found, results, session.path, watch=watch)


def _summaries(
    session: Session, units: str, severity: int | None, confidence: float | None
) -> list[tuple[str, list[str]]]:
    """The summaries that ``nsdrill show`` and ``nsdrill window`` print of the file; not
    the answer of the window and its warnings, with which the page begins."""
    if session.branches is not None and session.results is None:
        return []
    if session.results is None:
        raise InputError(f"{session.path}: found a study; allowed: results. Run it first: nsdrill run.")
    if confidence is not None:
        probabilities.check_samples(session.results, f"{session.path}: {option('confidence')}")
    answers.check_severity(session.results, severity, session.path)
    summaries = [("Numbers", list(text.lines(session.path, summary.summarize(session.results), units)))]
    with suppress(NsdrillError):  # of a single point, or of four axes, there is no window
        results = answers.results_for_window(session.results, severity)
        found = windows_of.find_window(results, severity, confidence)
        summaries.append(("Operating window", list(window_text.number_lines(found, units))))
    return summaries
