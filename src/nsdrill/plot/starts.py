"""What the pictures of several starts have in common: the attractors of operating
points along an axis, and their words."""

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

USED = ("attractor", "whirl_kind", "settled")  # variables that say what an attractor is


def has_starts(data: Any) -> bool:
    """Whether these are results with several starts of every operating point."""
    return isinstance(data, Results) and "start" in data.coords


def along(results: Results) -> tuple[str, list[tuple[list[Attractor], dict[str, int]]]]:
    """The swept axis, and the attractors and counts of every operating point along it."""
    found = list(describe(flat(results), model_in(results.attrs).told))
    if not any(attractors for attractors, _ in found):
        raise InputError(
            "The starts are not grouped into attractors yet: this is done when all points are "
            "there. Finish the run."
        )
    return results.swept[0], found


def matched(results: Results) -> bool:
    """Whether one number is one attractor along the axes; in files of older versions it
    is so at each operating point only, until they are classified again."""
    study = resolved_study(results.attrs)
    thresholds = json.loads(results.attrs.get("classification_resolved") or "null") or study.get(
        "classify", {}
    )
    return "matching" in thresholds.get("attractors", {})


def flat(results: Results) -> dict[str, Array]:
    """The variables on the grid as (operating points, starts)."""
    dims = 1 + len(results.shape[1:])
    starts = len(results.coords["start"])
    return {
        name: np.asarray(v).reshape(-1, starts)
        for name, v in results.variables.items()
        if v.ndim == dims
    }


def words(one: Attractor) -> str:
    """What an attractor is, in a legend."""
    kinds = (BY_NAME["whirl_kind"].flag_meanings or "").split()
    text = RESPONSES[one.response].name
    if one.whirl_kind:
        text += f" ({kinds[one.whirl_kind].replace('_', ' ')})"
    return text
