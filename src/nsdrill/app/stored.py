"""The study that a results file was made from."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.app.overrides import overrides_of
from nsdrill.app.run import plan_of
from nsdrill.data import IN_MEMORY, Array
from nsdrill.errors import FileError
from nsdrill.study.resolved import study_from_resolved
from nsdrill.study.study import Study


def stored_study(path: str | os.PathLike[str], attrs: Mapping[str, Any], coords: Mapping[str, Array]) -> Study:
    """The study in the root attributes ``attrs`` of the results file ``path``, or :data:`IN_MEMORY`; FileError where
    there is none, or it is not that of the file's ``coords``."""
    if "study_resolved" not in attrs:
        raise FileError(f"{path}: found no study in the file; allowed: a results file of nsdrill run.")
    own = ("start", "peak", "crossing", "state")
    # A file may say that its study has any number of points.
    bound = (
        {} if path == IN_MEMORY else {"most": max(len(values) for name, values in coords.items() if name not in own)}
    )
    study = study_from_resolved(
        json.loads(attrs["study_resolved"]), attrs.get("study", ""), str(path), overrides_of(attrs), **bound
    )
    plan = plan_of(study)
    same = tuple(coords["procedure"]) == plan.procedures and plan.starts == len(coords.get("start", ()))
    if not same or not all(np.array_equal(values, coords.get(name, ())) for name, values in plan.dimensions.items()):
        raise FileError(
            f"{path}: the study in it is not that of its points; allowed: all points of the run, and the study that "
            "was run. Take the results whole, or make the file again."
        )
    return study
