"""The thresholds by which the answers of a file count, and those of them that are not the
defaults."""

from __future__ import annotations

import json
from dataclasses import asdict

from nsdrill.data import Answer, Attributes, Resolved, flat, resolved_study
from nsdrill.models.registry import model_in

OF_MOTION = ("motion", "attractors")  # sections that decide on no point of a window


def thresholds_in(attrs: Attributes) -> Resolved:
    """The thresholds of a file with the root attributes ``attrs``, in SI: those of its last
    classification, else those of its study; empty where it has none."""
    try:
        found = json.loads(attrs["classification_resolved"])
    except (KeyError, TypeError, ValueError):
        found = resolved_study(attrs).get("classify", {})
    return found if isinstance(found, dict) else {}


def in_force(attrs: Attributes) -> Resolved:
    """All thresholds of the model of a file with the root attributes ``attrs``, by section and
    key, in SI: those that the file has, which may be of another version, else the defaults."""
    told = dict(flat(thresholds_in(attrs)))
    return {
        name: {key: told.get(f"{name}.{key}", default) for key, default in section.items()}
        if isinstance(section, dict)
        else told.get(name, section)
        for name, section in asdict(model_in(attrs).thresholds()).items()
    }


def moved_thresholds(attrs: Attributes) -> list[Answer]:
    """The thresholds of a file with the root attributes ``attrs`` that decide on points of a
    window and are not the defaults: ``key``, ``value`` and ``default`` in SI, and the
    ``response`` that counts from there; None for those that grade it, and for others."""
    model, found = model_in(attrs), []
    defaults = dict(flat(asdict(model.thresholds())))
    counting = {f"{one.name}.{one.feature}": one.name for one in model.critical.values()}
    for key, value in flat(thresholds_in(attrs)):
        default = defaults.get(key)
        if default is None or value == default or key.partition(".")[0] in OF_MOTION:
            continue
        found.append({"key": f"classify.{key}", "value": value, "default": default, "response": counting.get(key)})
    return found
