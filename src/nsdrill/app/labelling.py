"""The labels that follow from the features of results, and whether those of results in memory
do."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np

from nsdrill.data import THRESHOLDS, Results, Trace, edited_together, resolved_study
from nsdrill.errors import NsdrillError
from nsdrill.late import deferred
from nsdrill.models.parts import values_in_parts
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds, trust_labels
from nsdrill.models.variant import variant_at
from nsdrill.study.study import Study, study_from_resolved
from nsdrill.variables import INFERRED

with deferred():  # the parser is slow to import
    from nsdrill.app import experiment as experiments
    from nsdrill.study import load as loading


def marked(data: Results | Trace) -> Results | Trace:
    """``data``; results whose labels are not those of their features, with the thresholds of
    the file, are marked as changed by hand, or labelled by other code; and so are those of
    other code whose labels cannot be made again. Of a part without the features, and of a
    trace it cannot be told."""
    if isinstance(data, Trace):
        return data
    other = experiments.of_other_code(data.attrs)
    try:
        study = study_from_resolved(resolved_study(data.attrs))
        changed = json.loads(data.attrs.get(THRESHOLDS, "[]"))
        labels = labels_of(study, loading.change_thresholds(study.thresholds, changed, study.model.name), data)
    except (NsdrillError, KeyError, TypeError, ValueError):
        return _with_change(data, f"perhaps labels of results in memory, which cannot be checked: {other}", bool(other))
    is_run = data["status"] != INFERRED
    differ = [
        name
        for name, values in labels.items()
        if name in data.variables and not np.array_equal(values[is_run], data[name][is_run])
    ]
    by = f"by hand, or labelled otherwise by other code: {other}" if other else "by hand"
    return _with_change(data, f"{', '.join(differ)} of results in memory, {by}", bool(differ))


def _with_change(data: Results, further: str, is_changed: bool) -> Results:
    """``data``, marked with the ``further`` words where it ``is_changed``."""
    if not is_changed:
        return data
    return replace(data, attrs={**data.attrs, **edited_together(data.attrs, further=further)})


def labels_of(study: Study, thresholds: Thresholds, results: Results) -> dict[str, np.ndarray]:
    """The labels that follow from the features of each run alone, of results or of a part of
    them. KeyError where it lacks a feature, or peaks that the study keeps."""
    for one in study.model.peaks if study.record.peaks else ():
        results[one.name]
    scales, dimension = _scales_and_dimension(study, results)
    model = model_named(study.model.name)
    labels = model.classify(results.variables, results["status"], thresholds, scales, dimension)
    if "trusted" in results.variables:
        labels |= trust_labels(results.variables, labels["response"], thresholds, model.responses)
    return labels


def _scales_and_dimension(study: Study, results: Results) -> tuple[np.ndarray, np.ndarray]:
    """The natural scales of the states at every point, shape (*grid, states), and the
    dimension of the flow there, shape (*grid)."""

    several = [np.arange(study.samples)] if study.samples else []
    axes = np.meshgrid(*(results.coords[name] for name in results.axes), *several, indexing="ij")
    shape = axes[0].shape if axes else ()  # of one point there are none
    values = dict(zip(study.axes, (axis.ravel() for axis in axes), strict=False))
    values |= {key: samples[axes[-1].ravel()] for key, samples in study.drawn.items()}
    model, names = model_named(study.model.name), results.coords["state"].tolist()[:-1]
    # NaN for states that the string of a point lacks; the dimension follows them
    by_point = np.full((math.prod(shape), len(names) + 1), np.nan)
    for at, selected in values_in_parts(study.model, study.parameters, study.initial, values):
        variant, table = variant_at(model, at.parameters), model.pack(at, study.thresholds)
        points = np.arange(len(by_point))[selected]
        places = [names.index(name) for name in variant.states]
        by_point[np.ix_(points, places)] = variant.state_scales(table)
        by_point[points, -1] = variant.dimension(table, frozenset(model.undeviated(at.parameters)))
    by_point = by_point.reshape(1, *shape, -1)
    if "start" in results.coords:
        by_point = by_point[..., np.newaxis, :]
    by_point = np.broadcast_to(by_point, (*results.shape, by_point.shape[-1]))
    return by_point[..., :-1], by_point[..., -1]
