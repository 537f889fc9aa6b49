"""The experiment of which a results file holds the points."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from nsdrill.app.experiment import Experiment, prepare
from nsdrill.app.overrides import overrides_of
from nsdrill.data import IN_MEMORY, Array
from nsdrill.errors import FileError
from nsdrill.study.study import study_from_resolved
from nsdrill.sweep.plan import Plan
from nsdrill.variables import COUNTED, Unknown


def stored_experiment(
    path: str | os.PathLike[str],
    attrs: Mapping[str, Any],
    coords: Mapping[str, Array],
    drawn: Mapping[Unknown, Array] | None = None,
) -> Experiment:
    """The experiment of the study in the root attributes ``attrs`` of the results file ``path``, or
    :data:`IN_MEMORY`, with the samples ``drawn`` of the file. FileError where there is
    no study, or where its points are not those of ``coords``."""
    if "study_resolved" not in attrs:
        raise FileError(f"{path}: found no study in the file; allowed: a results file of nsdrill run.")
    not_axes = (*COUNTED[1:], "state")
    # The study in a file may claim any number of points.
    bound = (
        {}
        if path == IN_MEMORY
        else {"most": max(len(values) for name, values in coords.items() if name not in not_axes)}
    )
    study = study_from_resolved(
        json.loads(attrs["study_resolved"]), attrs.get("study", ""), str(path), overrides_of(attrs), **bound
    )
    samples = {unknown.short: values for unknown, values in (drawn or {}).items()}
    if set(samples) == set(study.drawn):  # another version of SciPy may draw other samples
        study = replace(study, drawn={key: samples[key] for key in study.drawn})
    experiment = prepare(study)
    if other := _coordinate_differences(experiment.plan, coords):
        raise FileError(
            f"{path}: found {'; '.join(other)}; allowed: all points of the run, as its study "
            f"numbers "
            "these, and labels and replays are made from the study. Take the whole results and "
            "select afterwards; of a "
            "file that was edited, make it again."
        )
    return experiment


def _coordinate_differences(plan: Plan, coords: Mapping[str, Array]) -> list[str]:
    """The differences, in words, between ``coords`` and the ``plan`` of their study."""
    differences = []
    if tuple(coords["procedure"]) != plan.procedures:
        differences.append(
            f"procedure {' and '.join(coords['procedure'])}, of {' and '.join(plan.procedures)} in its study"
        )
    if (starts := len(coords.get("start", ()))) != plan.starts:
        differences.append(f"{starts or 'no'} starts, of {plan.starts or 'none'} in its study")
    if (samples := len(coords.get("sample", ()))) != plan.samples:
        differences.append(f"{samples or 'no'} samples, of {plan.samples or 'none'} in its study")
    for name, values in plan.dimensions.items():
        in_file = coords.get(name, np.empty(0))
        if len(in_file) != len(values):
            differences.append(f"{len(in_file)} values of {name}, of {len(values)} in its study")
        elif not np.array_equal(values, in_file):
            differences.append(f"other values of {name} than in its study")
    return differences
