"""What the pictures of several starts have in common: the attractors of operating
points along an axis, and their labels."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from nsdrill.analysis.attractors import Attractor, describe
from nsdrill.data import Array, Results, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.registry import model_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.style import RESPONSES

ATTRACTOR_VARIABLES = ("attractor", "whirl_kind", "settled")  # variables that describe an attractor


def has_starts(data: Any) -> bool:
    """Whether these are results with several starts of every operating point."""
    return isinstance(data, Results) and "start" in data.coords


def attractors_along(results: Results) -> tuple[str, list[tuple[list[Attractor], dict[str, int]]]]:
    """The swept axis, and the attractors and counts of every operating point along it."""
    attractors_and_counts = list(
        describe(by_operating_point(results), model_in(results.attrs).distinguishing)
    )
    if not any(attractors for attractors, _ in attractors_and_counts):
        raise InputError(
            "The starts are not grouped into attractors yet: this is done when all points are "
            "there. Finish the run."
        )
    return results.swept[0], attractors_and_counts


def is_matched(results: Results) -> bool:
    """Whether a number denotes the same attractor at all operating points. In files of
    older versions it does so at each operating point only, until they are classified
    again."""
    study = resolved_study(results.attrs)
    thresholds = json.loads(results.attrs.get("classification_resolved") or "null") or study.get(
        "classify", {}
    )
    return "matching" in thresholds.get("attractors", {})


def by_operating_point(results: Results) -> dict[str, Array]:
    """The variables on the grid, as arrays [operating point, start]."""
    dimensions = 1 + len(results.shape[1:])
    starts = len(results.coords["start"])
    return {
        name: np.asarray(array).reshape(-1, starts)
        for name, array in results.variables.items()
        if array.ndim == dimensions
    }


def attractor_label(attractor: Attractor) -> str:
    """The description of an attractor in a legend."""
    kinds = (BY_NAME["whirl_kind"].flag_meanings or "").split()
    text = RESPONSES[attractor.response].name
    if attractor.whirl_kind:
        text += f" ({kinds[attractor.whirl_kind].replace('_', ' ')})"
    return text
