"""Operations that answer a question about a study or about results."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from nsdrill.late import deferred
from nsdrill.operations.arguments import (
    AnyData,
    At,
    Confidence,
    Depth,
    Everything,
    One,
    ResultsLike,
    Settings,
    Severity,
    Speed,
    StudyLike,
    Two,
    Units,
    Weight,
)

with deferred():
    from nsdrill import store
    from nsdrill.analysis import hysteresis as directions
    from nsdrill.app import answers, arguments, datasets, summary, unfinished
    from nsdrill.app import attractors as attractors_of
    from nsdrill.app import check as checking
    from nsdrill.text import branches as branches_text
    from nsdrill.text import show as text

if TYPE_CHECKING:
    from xarray import Dataset

    from nsdrill.app.check import Report
    from nsdrill.data import Answer


def check(study: StudyLike, set: Settings = None, units: Units = None) -> Report:
    """Check a study without running it.

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
    loaded = arguments.study_in(study, set)
    return checking.check(loaded, units or loaded.units)


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
    name = "Dataset" if datasets.is_dataset(data) else os.fspath(arguments.name_in(data))
    units = datasets.units_for(units, data)
    return Shown(name, _summary(data, name), units, everything)


def _summary(data: AnyData, name: str) -> Answer:
    if not datasets.is_dataset(data) and (found := unfinished.summary(name)) is not None:
        return found
    if (branches := datasets.branches_in(data)) is not None:
        return branches_text.summarize_branches(branches)
    is_sweep = not datasets.is_dataset(data) and os.path.lexists(name) and store.kind_of(name) == "results"
    with datasets.missing_variable_errors("show"):
        return summary.summarize(datasets.data_in(data, summary.needed(name if is_sweep else None)))


def window(results: ResultsLike, severity: Severity = None, confidence: Confidence = None) -> Answer:
    """Find the safe operating window: the points that are safe for every history.

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
    return answers.window(results, severity, confidence)


def probability(results: ResultsLike, severity: Severity = None) -> Dataset:
    """Estimate the probability of a safe run, and of each response, at every operating
    point of results with samples of uncertain numbers.

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
    chosen = arguments.values_in(at, None, depth=depth, wob=wob, rotary_speed=rotary_speed)
    return answers.sensitivity(results, severity, chosen)


def hysteresis(results: ResultsLike) -> list[Answer]:
    """Find where the two directions of an up-down sweep differ.

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
    return directions.hysteresis(datasets.sweep_in(results, "hysteresis", directions.NEEDED))


def attractors(results: ResultsLike) -> list[Answer]:
    """Describe the attractors of each operating point of results with several starts.

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
    return attractors_of.attractors(results)


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
