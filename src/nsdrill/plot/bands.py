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
# names of the five bands
_GRADED: dict[str, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
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


def severity_bounds(attrs: Mapping[str, Any], name: str) -> tuple[float, ...]:
    """The four bounds of severity of variable ``name`` in its own units, none where it
    is not graded.

    ``attrs`` are the root attributes of a results file. The thresholds of a new
    classification come before those of the study, and these before the defaults.
    """
    if name not in _GRADED:
        return ()
    section, keys, _ = _GRADED[name]
    classify: dict[str, Any] = asdict(Thresholds())
    if "classification_resolved" in attrs:
        classify = json.loads(attrs["classification_resolved"])
    else:
        classify = resolved_study(attrs).get("classify", classify)
    thresholds = {**asdict(Thresholds())[section], **classify.get(section, {})}
    return tuple(float(thresholds[key]) for key in keys)


def band_names(name: str) -> tuple[str, ...]:
    """The names of the five bands of a graded variable, the mildest first."""
    return _GRADED[name][2]
