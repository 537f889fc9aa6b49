"""The summary of results and traces, and new labels for results.

Modules that need the compiler are imported late, as a summary does not need it.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime

import numpy as np

from nsdrill.analysis.chains import chain_of
from nsdrill.analysis.coarse import coarse_samples, interval_of, simulated
from nsdrill.analysis.counts import STARTS, after_failure, beyond, known, of_scripts, turned_back, unknown_exponents
from nsdrill.analysis.doubts import doubts_in
from nsdrill.analysis.grades import unsettled_in
from nsdrill.analysis.hysteresis import hysteresis, not_compared
from nsdrill.analysis.planes import judges
from nsdrill.analysis.probability import effective_number, independent, probabilities_of
from nsdrill.analysis.safety import counts_of, known_runs, measured_runs, measured_values
from nsdrill.analysis.sticking import ENDS
from nsdrill.analysis.unstable import unstable
from nsdrill.data import (
    BENT,
    ENDS_EARLY,
    FEW,
    IN_MEMORY,
    NOT_CARRIED_RUN,
    PULSES,
    SHORT,
    UNCUT,
    Answer,
    Attributes,
    Results,
    Trace,
    drive_kind,
    edited_together,
    frozen_modes,
    json_text,
    overrides,
    resolved_study,
)
from nsdrill.errors import InputError, NsdrillError, count, option
from nsdrill.late import deferred
from nsdrill.models.choices import in_words, word_or_number, words_along
from nsdrill.models.registry import BY_NAME, model_in, named_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.observe.motion_kinds import AGREES, CHECK_FAILED, FEATURES_DIFFER, RESPONSE_DIFFERS, verdict
from nsdrill.store import read_attributes, read_results, rewrite_labels, variables_in
from nsdrill.study.study import Study, study_from_resolved
from nsdrill.variables import AXES, CHECKS, INFERRED, OK, PENDING, POINT, SAMPLE, has_failed
from nsdrill.version import __version__

with deferred():  # they run the model, and the parser is slow to import
    from nsdrill.app import check as checking
    from nsdrill.app import experiment as experiments
    from nsdrill.app import labelling
    from nsdrill.app.answering import answers, attractor_summary, early_ends, stick_slip_end
    from nsdrill.app.answering.kept import kept
    from nsdrill.app.running import grouping
    from nsdrill.app.running import refinement as refining
    from nsdrill.study import load as loading

# the origins of the variables that decide labels
MEASURED = ("feature", "label", "section", "peaks", "trust")
NOT_CARRIED, OFF_SPEED, UNSTABLE = -1, -2, -3  # beside the statuses of runs: how one that ended well is not known
_NOT_KNOWN = {NOT_CARRIED: "not_carried", OFF_SPEED: "off_speed", UNSTABLE: "unstable_motion"}
EXPONENT = ("lyapunov_exponent", "lyapunov_error")  # where it is recorded


def needed(path: str | os.PathLike[str] | None = None) -> tuple[str, ...]:
    """The variables that :func:`summarize` uses, without peaks, returns and states: of
    the results file ``path``, if given, or of any model."""
    known = BY_NAME.values() if path is None else variables_in(path)
    more = (STARTS,) if path is None else of_scripts(read_attributes(path))
    return tuple(variable.name for variable in known if variable.dims == POINT or variable.name in more)


def summarize(data: Results | Trace) -> Answer:
    """The summary that ``show`` prints, as plain data: kind of file, axes, counts of
    responses, ranges, failed points. For a sweep it uses the variables
    :func:`needed`."""
    if isinstance(data, Trace):
        return dict(in_words(_summarize_trace(data)))
    summary = _summarize_results(data)
    has_words = any(words_along(axis.name) for axis in data.more)
    return dict(in_words(summary)) if has_words else summary


def _string(attrs: Attributes) -> Answer:
    """The drive and the frozen motions of a drill string; of another model nothing."""
    return {"drive": drive_kind(attrs), "frozen": list(frozen_modes(attrs))} if model_in(attrs).drills else {}


def _summarize_results(results: Results) -> Answer:
    status = results["status"]
    summary: Answer = {
        "kind": "results",
        **{name: str(results.attrs.get(name, "")) for name in ("title", "created", "nsdrill_version", "study_sha256")},
        **edited_together(results.attrs),
        "model": model_in(results.attrs).name,
        "overrides": overrides(results.attrs),
        **_string(results.attrs),
        "method": str(results.attrs.get("method", "explicit")),
        "device": str(results.attrs.get("device", "cpu")),
        # Only a run log has pending points.
        "finished": not bool(np.any(status == PENDING)),
        "thresholds": json.loads(results.attrs.get("classification", "[]")),
        "axes": {name: _axis(results, name) for name in results.certain_axes},
        "procedures": list(results.procedures),
        "points": int(status.size),
        "status": _counts("status", status, results),
        "runs": counts_of(results),
        "not_carried": int(np.count_nonzero(after_failure(results) & known(status))),
        "exponents": _exponents(results),
        SHORT: _told(results, lambda study: checking.short_observation(study).told),
        UNCUT: _told(results, checking.nothing_cut),
        FEW: _told(results, checking.few_states),
        BENT: "".join(_told(results, lambda study: {"": [checking.bent(study)]}).get("", ())),
        PULSES: "".join(_told(results, lambda study: {"": [checking.pulses(study)]}).get("", ())),
        "peaks_kept": results.peaks_kept,
        "beyond": beyond(results),
        "turned_back": turned_back(results),
        **doubts_in(results),
        "declares_responses": judges(results),
        **_labels(results),
        "measured": int(np.count_nonzero(measured_runs(results))),
        "ranges": _ranges(results),
        "without": _without(results),
        "infinite": _infinite(results),
        "settled": int(np.count_nonzero(results["settled"][status == OK])),
        "failed": [
            {**results.values_at(place.tolist()), "status": BY_NAME["status"].words(int(status[tuple(place)]))}
            for place in np.argwhere(has_failed(status))
        ],
    }
    if "trusted" in results.variables:
        summary["trust"] = trust_of(results)
    if SAMPLE in results.coords:
        summary |= _uncertain(results)
    elif "start" in results.coords:
        starts = {"starts": len(results.coords["start"]), "slice": results.slice}
        return summary | starts | {"operating_points": attractor_summary.attractors(results)}
    else:
        summary["hysteresis"] = directions(results)
        summary["compared"] = not_compared(results)
        if model_in(results.attrs).drills:
            summary[ENDS_EARLY] = early_ends.stick_slip_ends(results)
        if len(results.swept) == 1:
            summary["intervals"] = intervals(results)
    if "points_run" in results.attrs:
        summary["refinement"] = refinement_of(results)
    if (chain := chain_of(results)) is not None and chain.is_part:
        summary["chain"] = chain.as_data()
    return summary


def directions(results: Results, along: str | None = None) -> list[Answer]:
    """The intervals of :func:`nsdrill.analysis.hysteresis.hysteresis`; those along the speed in which
    stick-slip is met in one direction only have ``by_model``, where the model tells it: the set speeds
    below which steady drilling is unstable, up to which stick-slip may last, and up to which the friction of the
    runs can show it, null without an end."""
    rows = hysteresis(results, along)
    sticks = [row for row in rows if row["axis"] == "rotary_speed" and "stick_slip" in row["differs"]]
    lasts = None
    if sticks:
        with suppress(NsdrillError):
            lasts = kept("stick_slip", results, None, lambda: stick_slip_end.stick_slip_lasts(results))
    if lasts is None:
        return rows
    lengths = [len(results.coords[name]) for name in lasts["over"]]
    for row in sticks:
        place = [results.coords[name].tolist().index(row[name]) for name in lasts["over"]]
        number = int(np.ravel_multi_index(place, lengths)) if place else 0
        speeds = {name: lasts[name][number] for name in ENDS}
        if None not in speeds.values():
            row["by_model"] = {name: speed if isinstance(speed, float) else None for name, speed in speeds.items()}
    return rows


def _told(results: Results, warnings: Callable[[Study], dict[str, list[str]]]) -> dict[str, list[str]]:
    """These ``warnings`` of the study of the part that is held, by units; of a file without
    a study of this version none."""
    with suppress(NsdrillError):
        study = experiments.with_samples(study_from_resolved(resolved_study(results.attrs)), results)
        return warnings(checking.study_of_part(study, results))
    return {}


def _labels(results: Results) -> Answer:
    """The counts of the labels of each procedure."""
    status, names = results["status"], model_in(results.attrs).severities
    is_known, procedures = known_runs(results), results.procedures
    ok = is_known & (status == OK)

    def counts(name: str, where: np.ndarray) -> dict[str, dict[str, int]]:
        if name not in results.variables:
            return {}
        return {one: _counts(name, results[name][i][where[i]], results) for i, one in enumerate(procedures)}

    severities = {name: counts(name, ok) for name in names if name in results.variables}
    return {
        "responses": counts("response", is_known) if judges(results) else {},
        **{
            f"{name}s": counts(name, ok & (results[name] > 0)) if name in results.variables else {}
            for name in RESPONSE_KINDS
            if name in results.variables or model_in(results.attrs).drills
        },
        "severities": {one: {name: found[one] for name, found in severities.items()} for one in procedures},
        **({"motions": counts("motion", ok)} if "motion" in results.variables else {}),
    }


def _exponents(results: Results) -> Answer | None:
    """Of how many runs the Lyapunov exponent is ``unknown``, ``of`` how many; None where it is
    known of all, or was not measured."""
    unknown, of = unknown_exponents(results)
    return {"unknown": unknown, "of": of} if unknown else None


def _ranges(results: Results) -> dict[str, Answer]:
    """The least and the greatest value of each feature that is shown, over the runs that are
    known and have one: ``values`` are how many."""
    ranges, named = {}, named_in(results.attrs)
    for name in (*model_in(results.attrs).shown, *EXPONENT):
        values = measured_values(results, name)
        if values.size:
            about = {"units": named[name].units, "meaning": named[name].long_name, "values": values.size}
            ranges[name] = {"min": float(values.min()), "max": float(values.max()), **about}
    return ranges


def _without(results: Results) -> dict[str, str]:
    """The features that are shown of which no run has a value, with their meaning."""
    ended = measured_runs(results)
    return {
        name: named_in(results.attrs)[name].long_name
        for name in model_in(results.attrs).shown
        if name in results.variables and ended.any() and np.isnan(results[name][ended]).all()
    }


def _infinite(results: Results) -> Answer:
    """In how many (``runs``) of the runs that are known (``of``) a feature that is shown is infinite,
    which no range has, by its name and with its ``meaning``; only those of which there are any."""
    ended, found = measured_runs(results), {}
    for name in model_in(results.attrs).shown:
        if name in results.variables and (runs := int(np.count_nonzero(np.isinf(results[name][ended])))):
            meaning = named_in(results.attrs)[name].long_name
            found[name] = {"runs": runs, "of": int(ended.sum()), "meaning": meaning}
    return found


def _uncertain(results: Results) -> Answer:
    """The summary of samples: their number, the unknowns (each with the median
    ``value`` and the 5 % and 95 % quantiles ``from`` and ``to``), and the probability
    of each outcome."""
    unknowns: Answer = {}
    counted = len(results.coords[SAMPLE][independent(results)])
    for unknown, values in results.drawn.items():
        least, low, middle, high, most = np.quantile(values, [0.0, 0.05, 0.5, 0.95, 1.0])
        unknowns[unknown.key] = {
            "min": float(least),
            "from": float(low),
            "value": float(middle),
            "to": float(high),
            "max": float(most),
            "units": unknown.units,
        }
    return {
        "samples": len(results.coords[SAMPLE]),
        "counted": counted,
        "effective": effective_number(results, independent(results)),
        "unknowns": unknowns,
        "probabilities": _probabilities(results) if judges(results) else [],
        "unsettled": unsettled_in(results),
    }


def _probabilities(results: Results) -> list[Answer]:
    """One row for each operating point, and for each procedure and for all of them
    where there are several: the axes in SI, of how many samples (``of``) every run is
    ``known``, and one ``failed`` or is ``pending``, and of each outcome the
    ``probability`` among the samples of which it is ``known`` (None where it is of none),
    and the ends ``low`` and ``high`` of its 95 % interval, which covers the others."""
    estimates = probabilities_of(answers.with_samples_counted(results))
    share, (low, high) = estimates.share, estimates.interval
    table = []
    for number, history in enumerate(estimates.histories):
        for place in np.ndindex(*share.shape[2:]):
            values = {
                axis: word_or_number(axis, float(results.coords[axis][i]))
                for axis, i in zip(results.axes, place, strict=True)
                if axis in results.certain_axes
            }
            row: Answer = {**values, "history": history, **estimates.runs.at((number, *place))}
            for which, outcome in enumerate(estimates.outcomes):
                cell = (number, which, *place)
                row[outcome] = {
                    "probability": float(share[cell]) if estimates.known[cell] else None,
                    "low": float(low[cell]),
                    "high": float(high[cell]),
                    "known": int(estimates.known[cell]),
                }
            table.append(row)
    return table


def refinement_of(results: Results) -> Answer:
    """The root attributes of a refined sweep, and of a part of it how many of its points were
    ``run_here`` of the ``points_here``."""
    status = results["status"]
    refinement = {name: results.attrs[name] for name in ("refine", "points_run", "points_inferred", "border_spacing")}
    if isinstance(refinement["border_spacing"], str):  # as stored in a file
        refinement["border_spacing"] = json.loads(refinement["border_spacing"])
    if status.size != refinement["points_run"] + refinement["points_inferred"]:
        refinement |= {"run_here": int(np.count_nonzero(status != INFERRED)), "points_here": int(status.size)}
    return refinement


def trust_of(results: Results) -> Answer:
    """The results of the checks: points by verdict, failed checks, and the changes of
    the response."""
    codes = {
        "agree": AGREES,
        "features_differ": FEATURES_DIFFER,
        "response_differs": RESPONSE_DIFFERS,
        "check_failed": CHECK_FAILED,
    }
    verdicts = verdict(results)
    counts = {name: int(np.count_nonzero(verdicts == code)) for name, code in codes.items()}
    changed, failed, named = [], {}, named_in(results.attrs)["response"]
    for check in CHECKS:
        status, response = results[f"{check}_status"], results[f"{check}_response"]
        failed[check] = int(np.count_nonzero(has_failed(status)))
        differs = (status == OK) & (response != results["response"])
        pairs, points = np.unique(
            np.stack([results["response"][differs], response[differs]]), axis=1, return_counts=True
        )
        changed += [
            {"check": check, "from": named.words(int(a)), "to": named.words(int(b)), "points": int(n)}
            for (a, b), n in zip(pairs.T, points, strict=True)
        ]
    return {**counts, "failed_checks": failed, "changed": sorted(changed, key=lambda row: -row["points"])}


def _axis(results: Results, name: str) -> Answer:
    values = results.coords[name]
    if words_along(name):
        return {"values": values.tolist(), "points": len(values)}
    return {"from": float(values[0]), "to": float(values[-1]), "points": len(values)}


def _counts(name: str, values: np.ndarray, results: Results) -> dict[str, int]:
    named = named_in(results.attrs)[name]
    codes, counts = np.unique(values, return_counts=True)
    return {named.words(int(v)): int(c) for v, c in zip(codes, counts, strict=True)}


def intervals(results: Results) -> list[Answer]:
    """Runs of neighbouring points with one response along the swept axis of a one-axis
    sweep; ``not_carried`` where a run before them in the chain failed,
    ``off_speed`` where the drive is, ``unstable_motion`` where the motion is. Where the model
    declares no responses, only those that did not end well."""
    axis = results.swept[0]
    values, named = results.coords[axis], named_in(results.attrs)
    rows, not_carried = [], after_failure(results) & known(results["status"])
    is_off = known(results["status"]) & ~known_runs(results) & ~not_carried
    leaves = unstable(results)
    for i, procedure in enumerate(results.procedures):
        response = results["response"][i].ravel()
        status = results["status"][i].ravel()
        status = np.where(status == INFERRED, OK, status)
        status = np.where(not_carried[i].ravel(), NOT_CARRIED, status)
        status = np.where(is_off[i].ravel(), np.where(leaves[i].ravel(), UNSTABLE, OFF_SPEED), status)
        start = 0
        for end in range(1, len(values) + 1):
            if (
                end < len(values)
                and not words_along(axis)
                and (response[end] == response[start] or status[start] in _NOT_KNOWN)
                and status[end] == status[start]
            ):
                continue
            if status[start] == OK and not judges(results):
                start = end
                continue
            if status[start] in _NOT_KNOWN:
                word = _NOT_KNOWN[int(status[start])]
            else:
                state = "response" if status[start] == OK else "status"
                code = int((response if state == "response" else status)[start])
                word = named[state].words(code)
            rows.append(
                {
                    "procedure": str(procedure),
                    "axis": axis,
                    "from": float(values[start]),
                    "to": float(values[end - 1]),
                    "points": end - start,
                    "response": word,
                }
            )
            start = end
    return rows


def _summarize_trace(trace: Trace) -> Answer:
    of_run = ("procedure", "status", "steps", "rejected", "method", "held_from", "followed")
    wanted = ("title", "created", "nsdrill_version", *AXES, *of_run)
    plain = {name: trace.attrs[name] for name in wanted if name in trace.attrs}
    ramps = json.loads(trace.attrs.get("ramps", "{}"))
    own = {variable.name: variable for variable in model_in(trace.attrs).trace_and_states}
    return {
        "kind": "trace",
        "model": model_in(trace.attrs).name,
        **{name: value.item() if hasattr(value, "item") else value for name, value in plain.items()},
        **edited_together(trace.attrs),
        **({NOT_CARRIED_RUN: True} if trace.attrs.get(NOT_CARRIED_RUN) else {}),
        **({"at": json.loads(trace.attrs["at"])} if "at" in trace.attrs else {}),
        "overrides": overrides(trace.attrs),
        **_string(trace.attrs),
        **({"ramps": {n: {"time": times, "value": values} for n, (times, values) in ramps.items()}} if ramps else {}),
        "samples": len(trace.time),
        "duration": float(trace.time[-1]) if len(trace.time) else 0.0,
        "interval": interval_of(trace.time),
        "simulated": simulated(trace.attrs),
        "coarse": coarse_samples(trace.attrs, trace.time),
        "ranges": {
            name: {
                "min": float(np.nanmin(values)),
                "max": float(np.nanmax(values)),
                "units": own[name].units,
                "meaning": own[name].long_name,
            }
            for name, values in trace.variables.items()
            if len(values)
        },
    }


def reclassify(
    path: str | os.PathLike[str],
    overrides: list[str],
    output: str | os.PathLike[str] | None = None,
    *,
    overwrite: bool = True,
) -> dict[str, tuple[int, int]]:
    """Label the results file ``path`` again with changed thresholds
    (``classify.key=value``), without a run; with ``output`` as a new file.

    Returns, for each label, the number of changed points and of all points.
    """
    results = read_results(path, [*(v.name for v in variables_in(path) if v.origin in MEASURED), "status"])
    labels, line, attrs = new_labels(results, overrides, path)
    changed = {name: (int(np.count_nonzero(labels[name] != results[name])), int(labels[name].size)) for name in labels}
    rewrite_labels(path, labels, line, attrs, output, overwrite=overwrite)
    return changed


def relabelled(results: Results, overrides: list[str]) -> Results:
    """A copy of ``results`` with new labels, as :func:`reclassify` writes them to a
    file."""
    labels, line, attrs = new_labels(results, overrides, IN_MEMORY)
    history = str(results.attrs.get("history", ""))
    attrs = {**results.attrs, **attrs, "history": f"{history}\n{line}" if history else line}
    variables = {name: labels.get(name, values).astype(values.dtype) for name, values in results.variables.items()}
    return Results(results.coords, variables, attrs, results.more, results.drawn)


def new_labels(
    results: Results, overrides: list[str], path: str | os.PathLike[str]
) -> tuple[dict[str, np.ndarray], str, dict[str, str]]:
    """The labels of ``results``, read from ``path``, with changed thresholds; the line
    for their history, and the root attributes with the thresholds. InputError where a
    refined sweep would need further runs."""
    experiment = experiments.stored_experiment(path, results)
    study = experiment.study
    thresholds = loading.change_thresholds(study.thresholds, overrides, study.model.name)
    try:
        labels = labelling.labels_of(study, thresholds, results)
        if "start" in results.coords:
            labels["attractor"] = grouping.labels_of(experiment, {**results.variables, **labels}, thresholds.attractors)
    except KeyError as error:
        raise InputError(f"{path}: found results without {error.args[0]}; allowed: results that have it.") from error
    if study.refined:
        labels["response"], missing = refining.reinfer(experiment, results["status"], labels["response"])
        if missing:
            raise InputError(
                f"{path}: with these thresholds the responses differ between neighbours where the map was not refined; "
                f"at least {count(missing, 'more point')} would have to be run. Nothing was changed. Run the study "
                f"with these thresholds: nsdrill run with the same {option('set')}."
            )
    labels = {name: values for name, values in labels.items() if name in results.variables}
    timestamp = datetime.now(UTC).isoformat(timespec="seconds")
    line = f"{timestamp} nsdrill {__version__} classify {' '.join(overrides)}".rstrip()
    line += experiments.told_of_other_code(path, results.attrs, "the labels are those of the code here")
    return (
        labels,
        line,
        {"classification": json_text(overrides), "classification_resolved": json_text(asdict(thresholds))},
    )
