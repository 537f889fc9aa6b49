"""The study that a results file was made from."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from nsdrill.app.overrides import overrides_of
from nsdrill.app.planned import plan_of
from nsdrill.data import IN_MEMORY, Array
from nsdrill.errors import FileError
from nsdrill.study.resolved import study_from_resolved
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.variables import COUNTED, Unknown


def stored_study(
    path: str | os.PathLike[str],
    attrs: Mapping[str, Any],
    coords: Mapping[str, Array],
    drawn: Mapping[Unknown, Array] | None = None,
) -> Study:
    """The study in the root attributes ``attrs`` of the results file ``path``, or
    :data:`IN_MEMORY`, with the samples that the file has ``drawn``; FileError where
    there is none, or it is not that of the file's ``coords``."""
    if "study_resolved" not in attrs:
        raise FileError(
            f"{path}: found no study in the file; allowed: a results file of nsdrill run."
        )
    own = (*COUNTED[1:], "state")
    # A file may say that its study has any number of points.
    bound = (
        {}
        if path == IN_MEMORY
        else {"most": max(len(values) for name, values in coords.items() if name not in own)}
    )
    study = study_from_resolved(
        json.loads(attrs["study_resolved"]),
        attrs.get("study", ""),
        str(path),
        overrides_of(attrs),
        **bound,
    )
    samples = {unknown.short: values for unknown, values in (drawn or {}).items()}
    if set(samples) == set(study.drawn):  # another version of SciPy may draw others
        study = replace(study, drawn={key: samples[key] for key in study.drawn})
    plan = plan_of(study)
    if other := _coordinate_differences(plan, coords):
        raise FileError(
            f"{path}: found {'; '.join(other)}; allowed: all points of the run, as its study "
            f"numbers "
            "these, and labels and replays are made from the study. Take the whole results and "
            "select afterwards; of a "
            "file that was edited, make it again."
        )
    return study


def _coordinate_differences(plan: Plan, coords: Mapping[str, Array]) -> list[str]:
    """Where the ``coords`` are not those of the ``plan`` of their study."""
    told = []
    if tuple(coords["procedure"]) != plan.procedures:
        told.append(
            f"procedure {' and '.join(coords['procedure'])}, of "
            f"{' and '.join(plan.procedures)} in its study"
        )
    if (starts := len(coords.get("start", ()))) != plan.starts:
        told.append(f"{starts or 'no'} starts, of {plan.starts or 'none'} in its study")
    if (samples := len(coords.get("sample", ()))) != plan.samples:
        told.append(f"{samples or 'no'} samples, of {plan.samples or 'none'} in its study")
    for name, values in plan.dimensions.items():
        there = coords.get(name, np.empty(0))
        if len(there) != len(values):
            told.append(f"{len(there)} values of {name}, of {len(values)} in its study")
        elif not np.array_equal(values, there):
            told.append(f"other values of {name} than in its study")
    return told
