"""The summary of a file of branches, as plain data: the branches, their stable parts,
and their special points in words."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.bifurcations import BIFURCATIONS, CIRCLE, END, Meaning, meanings_of, motion_text
from nsdrill.data import Answer, Array, Attributes, overrides
from nsdrill.models.registry import model_in

if TYPE_CHECKING:
    from xarray import Dataset


def summarize_branches(data: Dataset) -> Answer:
    """The summary that ``show`` prints of a Dataset of branches, as plain data."""
    attrs = data.attrs
    along = str(attrs.get("along", "rotary_speed"))
    numbers = data[along].values
    meanings = meanings_of(model_in(attrs))
    first = 0
    branches = []
    for number, size in enumerate(data["row_size"].values.tolist()):
        part = slice(first, first + size)
        first += size
        branches.append(_branch(data, number, part, numbers, meanings))
    fixed = {
        name: float(data[name].values[0])
        for name in ("depth", "wob", "rotary_speed")
        if name in data and name != along and data.sizes["point"]
    }
    return {
        "kind": "branches",
        **{name: str(attrs.get(name, "")) for name in ("title", "created", "nsdrill_version", "study_sha256")},
        "overrides": overrides(attrs),
        "along": along,
        "from": float(attrs.get("continue_from", numbers.min())),
        "to": float(attrs.get("continue_to", numbers.max())),
        "operation": fixed,
        "points": int(data.sizes["point"]),
        "seeds": _seeds(attrs),
        "branches": branches,
        "curves": _curves(data, meanings),
    }


def _seeds(attrs: Attributes) -> dict[str, int]:
    try:
        found = json.loads(attrs.get("seeds", "{}"))
    except ValueError:
        return {}
    return {str(word): int(count) for word, count in found.items()} if isinstance(found, dict) else {}


def _branch(data: Dataset, number: int, part: slice, numbers: Array, meanings: Mapping[int, Meaning]) -> Answer:
    values, unstable = numbers[part], data["unstable"].values[part]
    labels, notes = data["label"].values[part], data["label_note"].values[part]
    motion, lobes = str(data["motion"].values[number]), int(data["lobes"].values[number])
    parts = stable_parts(unstable, labels)
    special = []
    for place in np.flatnonzero((labels != 0) & (labels != END)).tolist():
        meaning = meanings.get(int(labels[place]))
        before, after = _beside(unstable, labels, place, -1), _beside(unstable, labels, place, 1)
        special.append(
            {
                "point": int(part.start + place),
                "label": meaning.name if meaning else str(int(labels[place])),
                "letters": meaning.letters if meaning else "",
                "value": float(values[place]),
                "meaning": meaning.words if meaning else "",
                "note": str(notes[place]),
                "unstable_before": before,
                "unstable_after": after,
            }
        )
    return {
        "branch": number,
        "motion": motion,
        "words": motion_text(motion, lobes),
        "lobes": lobes,
        "points": len(values),
        "min": float(values.min()),
        "max": float(values.max()),
        "parent": int(data["parent"].values[number]),
        "parent_point": int(data["parent_point"].values[number]),
        "closed": bool(data["closed"].values[number]),
        "end_reason": str(data["end_reason"].values[number]),
        "stable": [[float(values[a]), float(values[b])] for a, b in parts],
        "stable_ends": [[_end(labels, end) for end in ends] for ends in parts],
        "looked_between": motion != CIRCLE,
        "special": special,
    }


def _beside(unstable: Array, labels: Array, place: int, step: int) -> int | None:
    """The number of unstable multipliers at the nearest regular point in the direction
    ``step`` (1 or -1); None where there is none."""
    at = place + step
    while 0 <= at < len(labels):
        if labels[at] in (0, END):
            return int(unstable[at])
        at += step
    return None


def _end(labels: Array, place: int) -> str:
    """What the end of a stable part is: a located ``bifurcation``, the end of the
    ``branch``, or only the last ``point`` that is stable."""
    if labels[place] in BIFURCATIONS:
        return "bifurcation"
    return "branch" if place in (0, len(labels) - 1) else "point"


def stable_parts(unstable: Array, labels: Array) -> list[tuple[int, int]]:
    """The first and last points of the stable parts of a branch, which end at located
    bifurcations where such points are next to them."""
    stable = np.concatenate([[False], unstable == 0, [False]]).astype(int)
    begins, ends = np.flatnonzero(np.diff(stable) == 1), np.flatnonzero(np.diff(stable) == -1) - 1
    # touches of the wall may move several multipliers at once
    is_located = np.isin(np.pad(labels, 1), BIFURCATIONS)
    begins = begins - (~is_located[begins + 1] & is_located[begins])
    ends = ends + (~is_located[ends + 1] & is_located[ends + 2])
    return [(int(a), int(b)) for a, b in zip(begins, ends, strict=True) if b > a]


def _curves(data: Dataset, meanings: Mapping[int, Meaning]) -> list[Answer]:
    if "curve_row_size" not in data:
        return []
    curves, first = [], 0
    along, over = str(data.attrs["along"]), str(data.attrs["over"])
    for number, size in enumerate(data["curve_row_size"].values.tolist()):
        part = slice(first, first + size)
        first += size
        meaning = meanings[int(data["curve_label"].values[number])]
        ends = {name: data[f"curve_{name}"].values[part] for name in (along, over)}
        curves.append(
            {
                "curve": number,
                "label": meaning.name,
                "points": int(size),
                "lobes": int(data["curve_lobes"].values[number]),
                "words": motion_text(str(data["curve_motion"].values[number]), int(data["curve_lobes"].values[number])),
                "end_reason": str(data["curve_end_reason"].values[number]),
                **{name: [float(values.min()), float(values.max())] for name, values in ends.items()},
            }
        )
    return curves
