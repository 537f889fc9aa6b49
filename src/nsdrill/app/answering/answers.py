"""What results answer: the operating window, that against another one, the probability of each
outcome, which uncertain number matters most, and the differences between two files, in
their studies, their origins and their numbers."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from nsdrill.analysis import sensitivity as indices
from nsdrill.analysis.advice import data_of
from nsdrill.analysis.counts import of_scripts
from nsdrill.analysis.grades import unsettled_in, used_by_labels
from nsdrill.analysis.maps import USES
from nsdrill.analysis.probability import check_samples, probabilities_of
from nsdrill.analysis.safety import needed, told_responses
from nsdrill.analysis.unstable import resting
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.early_ends import stick_slip_ends
from nsdrill.app.answering.kept import kept
from nsdrill.app.conversion import name_in, ranges_in
from nsdrill.app.datasets import branches_in, data_in, is_dataset, sweep_in
from nsdrill.app.experiment import with_overrides
from nsdrill.data import (
    EDITED_SOURCE,
    ENDS_EARLY,
    IN_MEMORY,
    WITHIN,
    Answer,
    Attributes,
    Resolved,
    Results,
    Trace,
    json_text,
    resolved_study,
    units_of,
)
from nsdrill.errors import FileError, Refusal
from nsdrill.late import deferred
from nsdrill.models.in_force import in_force, thresholds_in
from nsdrill.models.registry import model_in
from nsdrill.store import read_results
from nsdrill.store.hdf5 import EDITED
from nsdrill.store.layout import coordinate_attributes, in_words
from nsdrill.study.study import IN_WORDS_ONLY
from nsdrill.study.write import changes
from nsdrill.variables import MODEL, SAMPLE
from nsdrill.words.answer import warnings, words_of, would_help

with deferred():  # what compares two files, and what is kept of an answer before
    from nsdrill.analysis import comparison
    from nsdrill.analysis import contrast as analysis
    from nsdrill.app.answering import foreseen

if TYPE_CHECKING:
    from xarray import Dataset

    from nsdrill.app.datasets import Source


def window(
    source: Source, severity: int | None = None, confidence: float | None = None, within: object = None
) -> Answer:
    """The safe operating window of results, with the critical speeds of motions that
    may last, as :func:`nsdrill.analysis.window.find_window`. ``severity`` is the greatest one
    allowed (0 to 4; None: by response), ``confidence`` (0 to 1) that of results with
    samples, ``within`` where one drills."""
    results = results_for_window(source, severity, within)
    return plain_window(find_window(results, severity, confidence), units_of(results.attrs))


def plain_window(summary: Answer, units: str) -> Answer:
    """The ``summary`` of a window as plain data, with the sentences of the answer in
    ``units``."""
    words = words_of(summary, units)
    told = {
        "never_exceed_words": {
            axis: f"{most[0]}: {most[1]}" for axis in summary["axes"] if (most := words.exceed(axis)) is not None
        },
        "sentence": words.sentence(),
        "lines": words.lines(),
        "warnings": list(warnings(summary, units)),
        "would_help": would_help(summary, units),
    }
    milder = summary["milder"]
    return {
        **summary,
        **{key: [_with_rates(one) for one in summary[key]] for key in ("lasting_motions", "passed_over")},
        "answer": {**data_of(summary["answer"], summary["axes"][0]), **told},
        "milder": milder and {**milder, "answer": data_of(milder["answer"], summary["axes"][0])},
    }


def _with_rates(speed: Answer) -> Answer:
    """A critical speed with the units of its rates."""

    def told(value: float | None) -> Answer | None:
        return None if value is None else {"value": value, "units": "rad/s^2"}

    found = {**speed, "passing_rate": told(speed["passing_rate"])} if "passing_rate" in speed else dict(speed)
    if off := found.get("off_bottom"):
        found["off_bottom"] = {
            **off,
            **{name: told(off[name]) for name in ("passing_rate", "sure_rate")},
            "swing": {"value": off["swing"], "units": "s"},
        }
    return found


def plain_contrast(found: Answer, units: str) -> Answer:
    """A comparison of two windows as plain data, with the sentences of both in ``units``."""
    return {**found, "windows": [plain_window(window, units) for window in found["windows"]]}


def of_labels(attrs: Attributes) -> tuple[str, ...]:
    """What the labels of runs are found of, in a file with these root attributes, where it is there."""
    model = model_in(attrs)
    return (*used_by_labels(model.critical.values()), *resting(model))


def results_for_window(source: Source, severity: int | None = None, within: object = None) -> Results:
    """The results with what a window is found of, where one drills only ``within`` some
    values; of a file only that is read."""

    def names(attrs: Attributes) -> tuple[str, ...]:
        return (*needed(0, attrs), *USES, *of_labels(attrs), *of_scripts(attrs))

    results = sweep_in(source, "window", ("status", "response"), names)
    check_severity(results, severity, path_of(source))
    return with_lasting_motions(with_overrides(drilled_within(results, within)))


def drilled_within(results: Results, within: object) -> Results:
    """The ``results`` of which points outside of where one drills are run-up only."""
    ranges = ranges_in(within, results.swept)
    return replace(results, attrs={**results.attrs, WITHIN: json_text(ranges)}) if ranges else results


def check_severity(results: Results, severity: int | None, path: str) -> None:
    """FileError where the results lack what a window by ``severity`` needs."""
    model = {variable.name for variable in model_in(results.attrs).variables}
    if lacking := [name for name in needed(severity, results.attrs) if name in model and name not in results.variables]:
        raise FileError(
            f"{path}: found no {' and no '.join(lacking)}, by which a severity is judged; allowed: a file with all "
            "severities of its model, or the window without a severity. Run the study again, or leave out the severity."
        )


def attrs_of(source: Source) -> Attributes:
    """The root attributes of results, of which no numbers are read."""
    return (source if isinstance(source, Results) or is_dataset(source) else read_results(name_in(source), ())).attrs


def path_of(source: Source) -> str:
    """The name of the file of results, or that of results in memory."""
    return os.fspath(source) if isinstance(source, str | os.PathLike) else IN_MEMORY


def with_lasting_motions(results: Results) -> Results:
    """The ``results`` with the critical speeds above which a motion may last, with what is
    said of a short observation, up to which speeds stick-slip may last, and with the settings
    at which it ends early, among the root attributes, and with the speeds above which rotating
    mud drives whirl, for the window in words and as a picture; without any where there are none,
    or where the file has no study of this version, with why that is so."""
    if results.part_of is not None:  # the class of a point follows from all runs of its chain
        whole, axis, chosen = results.part_of
        results = replace(results, part_of=(with_lasting_motions(whole), axis, chosen))
    found, is_driven = kept("foreseen", results, None, lambda: foreseen.of_study(results))
    driven = foreseen.mud_drives_whirl(results) if is_driven else {}
    attrs = {**results.attrs, **found, ENDS_EARLY: json_text(stick_slip_ends(results))}
    return replace(results, attrs=attrs, variables={**results.variables, **driven})


def with_samples_counted(results: Results) -> Results:
    """The ``results``; those with samples with what a window knows, so that whatever counts
    samples counts them by the same classes."""
    return with_lasting_motions(results) if SAMPLE in results.coords else results


def contrast(
    a: Results,
    b: Results,
    severity: int | None = None,
    confidence: float | None = None,
    names: Sequence[str] = ("a", "b"),
) -> Answer:
    """The windows of two results against each other as plain data in SI units: that of
    :func:`nsdrill.analysis.contrast.contrast`, the ``study`` keys in which they differ, the
    ``models`` of the two with their ``model_digests``, their ``thresholds``, and what they are called in a sentence,
    from their ``names``. InputError where the axes of the sweeps differ."""
    data = [with_lasting_motions(one) for one in (a, b)]
    found = analysis.contrast(data[0], data[1], severity, confidence)
    studies = [_study(one.attrs) for one in data]
    found["study"] = [{"key": key, "a": old, "b": new} for key, old, new in changes(*studies) if key != "title"]
    found["names"] = _names(found["study"], names)
    found["thresholds"] = [_thresholds(one.attrs) for one in data]
    found["model_digests"] = [str(one.attrs.get("model_digest") or "unknown") for one in data]
    found["models"] = [str(one.attrs.get("model") or MODEL) for one in data]
    return found


def _names(study: Sequence[Resolved], files: Sequence[str]) -> list[str]:
    """What the two are called: their drives where the studies differ in the kind of
    drive, a word where they differ in that alone, else the files, each with its letter."""
    words = [row for row in study if str(row["a"]).isidentifier() and str(row["b"]).isidentifier()]
    told = list(files)
    if len(words) == 1 and all(row["key"].startswith("drive.") for row in study):
        told = [f"the {str(words[0][side]).replace('_', ' ')} drive" for side in ("a", "b")]
    elif len(words) == len(study) == 1:
        told = [f"{words[0]['key']} {words[0][side]}" for side in ("a", "b")]
    return [letter if name == letter else f"{name} ({letter})" for name, letter in zip(told, "ab", strict=True)]


def _thresholds(attrs: Attributes) -> str:
    """From where the responses of a file with these root attributes count, in words."""
    limits = in_force(attrs)
    return "; ".join(
        f"{one.words}: {one.limit.format(one.percent(limits[one.name][one.feature]))}"
        for one in told_responses(attrs).values()
    )


def probability(source: Source, severity: int | None = None) -> Dataset:
    """The Dataset of :func:`nsdrill.api.probability`."""
    import xarray

    results = with_samples_counted(sweep_in(source, "probability", needed(severity, attrs_of(source)), of_labels))
    check_severity(results, severity, path_of(source))
    estimates = probabilities_of(results, severity)
    low, high = estimates.interval
    dims = ("history", "outcome", *results.axes)
    variables = {
        "probability": (estimates.share, "part of the samples of which the outcome is known"),
        "known": (estimates.known, "number of the samples of which the outcome is known"),
        "low": (low, "lower end of the 95 % interval of the probability"),
        "high": (high, "upper end of the 95 % interval of the probability"),
    }
    data = {name: (dims, values, {"long_name": words, "units": "1"}) for name, (values, words) in variables.items()}
    each_point, runs = ("history", *results.axes), estimates.runs
    unknown = estimates.open[:, 0] / estimates.total
    counts = {
        "failed": (runs.failed, "number of samples in which a run failed"),
        "pending": (runs.pending, "number of the other samples in which a run has not been made"),
        "unknown": (unknown, "part of the samples of which it is open whether they are safe"),
    }
    data |= {name: (each_point, values, {"long_name": words, "units": "1"}) for name, (values, words) in counts.items()}
    further = {axis.name: axis for axis in results.more}
    axes = {
        name: ((name,), in_words(name, results.coords[name]), coordinate_attributes(name, further.get(name)))
        for name in results.axes
    }
    words = {
        "history": "procedure; every: safe by the class of the point, a response in any procedure",
        "outcome": "safe: the class of the point allows it; by one procedure of several, its run is clear; or the "
        "response",
    }
    coords = {
        "history": ("history", list(estimates.histories), {"long_name": words["history"]}),
        "outcome": ("outcome", list(estimates.outcomes), {"long_name": words["outcome"]}),
        **axes,
    }
    attrs = {"title": str(results.attrs.get("title") or ""), "samples": estimates.total, "of": estimates.total}
    attrs |= {"unsettled_runs": unsettled_in(results).get("runs", 0)}
    result = xarray.Dataset(data, coords, attrs)
    fixed = [name for name in ("history", *results.axes) if result.sizes[name] == 1]
    return result.squeeze(fixed).drop_vars(results.uncertain)


def sensitivity(source: Source, severity: int | None = None, chosen: dict[str, float] | None = None) -> Answer:
    """The result of :func:`nsdrill.analysis.sensitivity.sensitivity`, at the ``chosen``
    values (SI) of some axes."""
    return indices.sensitivity(results_for_sensitivity(source, severity, chosen), severity)


def results_for_sensitivity(
    source: Source, severity: int | None = None, chosen: dict[str, float] | None = None
) -> Results:
    """The results with what a sensitivity is found of, at the ``chosen`` values; of a file
    only that is read."""
    if SAMPLE in (chosen or ()):
        raise Refusal("at", "one sample", "axes of the sweep, as all samples are compared", key=SAMPLE)
    results = sweep_in(source, "sensitivity", indices.needed(attrs_of(source), severity), of_labels)
    check_samples(results, os.fspath(source) if isinstance(source, str | os.PathLike) else "sensitivity")
    found = with_samples_counted(with_overrides(results))
    if not chosen:
        return found
    from nsdrill.figures import cut

    return cut(found, chosen)


MAKER_ATTRIBUTES = (
    "study_sha256",
    "created",
    "nsdrill_version",
    "model_digest",
    "python",
    "python_version",
    "llvmlite",
    "numpy_version",
    "h5py_version",
    "numba_version",
    "compiler",
    "processor",
    "device",
)
RUN_ATTRIBUTE_UNITS = {
    "depth": "m",
    "wob": "N",
    "rotary_speed": "rad/s",
    "procedure": "",
    "sample": "",
    "start": "",
    "transient": "s",
    "observe": "s",
    "status": "",
    "steps": "",
    "rejected": "",
}  # attributes of a trace


def diff(a: object, b: object) -> Answer:
    """The differences between ``a`` and ``b``, Datasets or files of results, unfinished
    runs, traces or branches, as plain data in SI units.

    ============ =======================================================================
    same_study   Whether the studies are equal, apart from the title and the units.
    same_numbers Whether all numbers are equal, to the bit.
    study        The keys that differ, with both values as in a study file (None:
                 missing); thresholds are those in force.
    run          Of traces, the attributes of the run that differ.
    made         The attributes of the origin that differ: date, versions, machine.
    kinds        The kinds of the two, ``results``, ``trace`` or ``branches``.
    ============ =======================================================================

    For two of one kind there are also the ``axes``, ``points``, ``responses``,
    ``variables``, ``only_a`` and ``only_b`` of
    :func:`nsdrill.analysis.comparison.compare_results`, ``compare_traces`` or
    ``compare_branches``.
    FileError for a file that cannot be read.
    """
    branches = [branches_in(data) for data in (a, b)]
    data_a, data_b = (
        data_in(data, None) if found is None else found for data, found in zip((a, b), branches, strict=True)
    )
    names = [f"Dataset {label}" if is_dataset(data) else name_in(data) for label, data in (("a", a), ("b", b))]
    study = _study_changes(data_a, data_b, names)
    differences: Answer = {
        "kind": "diff",
        "files": names,
        "kinds": [_kind(data_a), _kind(data_b)],
        "same_study": all(row["key"] in IN_WORDS_ONLY for row in study),
        "same_numbers": False,
        "study": study,
        "run": [],
        EDITED_SOURCE: {side: str(data.attrs.get(EDITED_SOURCE, "")) for side, data in (("a", data_a), ("b", data_b))},
        "made": _attributes(data_a.attrs, data_b.attrs, dict.fromkeys(MAKER_ATTRIBUTES, "")),
    }
    if isinstance(data_a, Results) and isinstance(data_b, Results):
        differences |= comparison.compare_results(with_samples_counted(data_a), with_samples_counted(data_b))
    elif isinstance(data_a, Trace) and isinstance(data_b, Trace):
        differences |= {
            "run": _attributes(data_a.attrs, data_b.attrs, RUN_ATTRIBUTE_UNITS),
            **comparison.compare_traces(data_a, data_b),
        }
    elif branches[0] is not None and branches[1] is not None:
        differences |= comparison.compare_branches(branches[0], branches[1])
    else:
        return differences
    differences["same_numbers"] = (
        not differences["only_a"]
        and not differences["only_b"]
        and all(row["same"] for row in (*differences["axes"], *differences["variables"]))
    )
    return differences


def _study_changes(a: Results | Trace | Dataset, b: Results | Trace | Dataset, names: list[str]) -> list[Answer]:
    """The keys of the studies that differ, with both values; FileError, about these
    ``names``, where one holds no study."""
    try:
        return [{"key": key, "a": old, "b": new} for key, old, new in changes(_study(a.attrs), _study(b.attrs))]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        where = " or ".join(names)
        raise FileError(f"{where}: study_resolved in the file does not hold a study ({error}). {EDITED}") from error


def _kind(data: Results | Trace | Dataset) -> str:
    return "trace" if isinstance(data, Trace) else "results" if isinstance(data, Results) else "branches"


def _study(attrs: Attributes) -> Resolved:
    """The study of a file, with the thresholds in force; empty where the file has no
    study."""
    study = resolved_study(attrs)
    return {**study, "classify": thresholds_in(attrs)} if study else study


def _attributes(a: Attributes, b: Attributes, units: Mapping[str, str]) -> list[Answer]:
    """The attributes that differ, as text with their units; None where one is
    missing."""

    def text(attrs: Attributes, name: str) -> str | None:
        return f"{attrs[name]} {units[name]}".strip() if name in attrs else None

    return [{"name": name, "a": text(a, name), "b": text(b, name)} for name in units if text(a, name) != text(b, name)]
