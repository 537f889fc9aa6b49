"""The bands of severity behind measured values; their bounds are the thresholds in
force in the file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from nsdrill.data import resolved_study
from nsdrill.observe.thresholds import Thresholds

# variable -> section of the thresholds, its four bounds in ascending order, and the
# words for the five bands
_BANDS: dict[str, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    "stick_slip_index": (
        "stick_slip",
        ("oscillation_index", "medium_index", "stall_index", "severe_index"),
        ("none", "oscillation", "medium", "onset of stall", "severe"),
    ),
    "lift_off_fraction": (
        "bit_bounce",
        ("light_fraction", "moderate_fraction", "strong_fraction", "severe_fraction"),
        ("none", "light", "moderate", "strong", "severe"),
    ),
    "lateral_acceleration_rms": (
        "whirl",
        (
            "light_acceleration",
            "moderate_acceleration",
            "strong_acceleration",
            "severe_acceleration",
        ),
        ("none", "light", "moderate", "strong", "severe"),
    ),
}


def bounds(attrs: Mapping[str, Any], name: str) -> tuple[float, ...]:
    """The four bounds of severity of variable ``name`` in its own units, none where it
    is not graded.

    ``attrs`` are the root attributes of a results file. A new classification has the
    last word, then the study, then the defaults.
    """
    if name not in _BANDS:
        return ()
    section, keys, _ = _BANDS[name]
    classify: dict[str, Any] = asdict(Thresholds())
    if "classification_resolved" in attrs:
        classify = json.loads(attrs["classification_resolved"])
    else:
        classify = resolved_study(attrs).get("classify", classify)
    found = {**asdict(Thresholds())[section], **classify.get(section, {})}
    return tuple(float(found[key]) for key in keys)


def words(name: str) -> tuple[str, ...]:
    """The words for the five bands of a graded variable, the mildest first."""
    return _BANDS[name][2]
