"""What a sweep and a simulation give back, in memory: plain arrays with names, in SI
units.

The file rooms fill and read these, the plots draw them; neither knows the other.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nsdrill.errors import InputError
from nsdrill.variables import Axis, Unknown

Array = np.ndarray[Any, np.dtype[Any]]
IN_MEMORY = "the results"  # what messages call those that are in no file
# root attributes: the --set of run, and of classify
OVERRIDES, THRESHOLDS = "study_overrides", "classification"


def json_text(data: Any, indent: int | None = None) -> str:
    """JSON of plain data and numpy values; null where a number is not finite, for which
    JSON has no word."""
    return json.dumps(_plain(data), indent=indent, allow_nan=False)


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {str(name): _plain(value) for name, value in data.items()}
    if isinstance(data, np.ndarray | np.generic):
        return _plain(data.tolist())
    if isinstance(data, list | tuple):
        return [_plain(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


class LackingVariable(InputError, KeyError):
    """Results have no variable of this name: they are a part, or were made by a version
    that did not know it."""

    def __str__(self) -> str:
        return (
            f"found results without {self.args[0]}; allowed: results that have it. Those of an "
            f"earlier version do not "
            "have what this one measures besides: run the study again."
        )


@dataclass
class Results:
    """The results of a sweep.

    ``coords`` holds the 1-D coordinates in the order of the dimensions: ``procedure``,
    the axes ``depth`` [m], ``wob`` [N], ``rotary_speed`` [rad/s] and those of ``more``,
    ``start`` where every operating point is started from several states, ``sample`` in
    its place where numbers are uncertain, then ``peak``, ``crossing``, ``state``;
    ``variables`` one array per entry of :data:`nsdrill.variables.VARIABLES`, over
    procedure, axes and start and its own dimension; ``attrs`` the root attributes of
    the file.
    """

    coords: dict[str, Array]
    variables: dict[str, Array]
    attrs: dict[str, Any] = field(default_factory=dict)
    more: tuple[Axis, ...] = ()
    drawn: dict[Unknown, Array] = field(default_factory=dict)
    """The samples of the uncertain numbers, each [samples]."""

    def __getitem__(self, name: str) -> Array:
        if name in self.variables:
            return self.variables[name]
        if name in self.coords:
            return self.coords[name]
        raise LackingVariable(name)

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the axes: depth, wob, rotary_speed, and what else was swept."""
        return tuple(name for name in self.grid if name not in ("procedure", "sample", "start"))

    @property
    def grid(self) -> tuple[str, ...]:
        """The dimensions over which points are numbered, the last fastest."""
        return tuple(name for name in self.coords if name not in ("peak", "crossing", "state"))

    @property
    def shape(self) -> tuple[int, ...]:
        """(procedures, values of each axis), and the number of samples or starts where
        each operating point has several."""
        return tuple(len(self.coords[name]) for name in self.grid)

    @property
    def slice(self) -> dict[str, Any]:
        """Where the starts are a slice, its two states, {state: {from, to, points}} in
        SI; else empty."""
        return dict(resolved_study(self.attrs).get("initial", {}).get("slice", {}))

    @property
    def held(self) -> dict[str, float]:
        """The values of the axes that are the same in all runs."""
        uncertain = {unknown.short for unknown in self.drawn}
        still = [
            name for name in self.axes if len(self.coords[name]) == 1 and name not in uncertain
        ]
        return {name: float(self.coords[name][0]) for name in still}

    @property
    def swept(self) -> list[str]:
        """The axes with more than one value, in the order of the dimensions."""
        return [name for name in self.axes if len(self.coords[name]) > 1]


@dataclass
class Trace:
    """One trajectory sampled in time: ``time`` [s] and one array [samples] per entry of
    :data:`nsdrill.variables.TRACE_VARIABLES`; ``attrs`` holds the operating point and
    what is needed to draw the hole.
    """

    time: Array
    variables: dict[str, Array]
    attrs: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        return self.time if name == "time" else self.variables[name]


def frozen_modes(attrs: Mapping[str, Any]) -> tuple[str, ...]:
    """The motions that the string of a file with the root attributes ``attrs`` does
    without: of axial, torsional and lateral."""
    modes = resolved_study(attrs).get("modes")
    if not isinstance(modes, dict):
        return ()
    return tuple(
        name for name, word in modes.items() if _word(attrs, f"modes.{name}", word) == "frozen"
    )


def drive_kind(attrs: Mapping[str, Any]) -> str:
    """The kind of drive in a file with the root attributes ``attrs``, as a study names
    it; of a sweep over kinds that of most studies, of which nothing is said."""
    drive = resolved_study(attrs).get("drive")
    kind = _word(attrs, "drive.kind", drive.get("kind")) if isinstance(drive, dict) else None
    return kind if isinstance(kind, str) else "ideal"


def _word(attrs: Mapping[str, Any], key: str, own: Any) -> Any:
    """The word of a choice in a file, ``own`` in its study; None where the sweep has
    several. A trace says which."""
    sweep = resolved_study(attrs).get("sweep")
    if not isinstance(sweep, dict) or key not in sweep:
        return own
    try:
        return json.loads(attrs.get("at") or "{}").get(key)
    except (TypeError, ValueError, AttributeError):
        return None


def resolved_study(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """The resolved study in the root attributes ``attrs``; empty where there is none."""
    try:
        found = json.loads(attrs.get("study_resolved") or "{}")
    except (TypeError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def differences(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[tuple[str, Any, Any]]:
    """(dotted key, value in ``a``, value in ``b``) where two resolved studies differ;
    None where a key is missing."""
    left, right = dict(flat(a)), dict(flat(b))
    keys = [*left, *(key for key in right if key not in left)]
    return [(key, left.get(key), right.get(key)) for key in keys if left.get(key) != right.get(key)]


def flat(study: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted key, value) of all that stands in a resolved study."""
    for name, value in study.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def overrides(attrs: Mapping[str, Any], *, thresholds: bool = False) -> dict[str, str]:
    """The keys that ``--set`` changed in the study of a file with the root attributes
    ``attrs``, with their values as given; with ``thresholds`` also those that
    ``nsdrill classify`` changed. Of a key given twice the last value."""
    found: dict[str, str] = {}
    for name in (OVERRIDES, THRESHOLDS) if thresholds else (OVERRIDES,):
        try:
            texts = json.loads(attrs.get(name) or "[]")
        except (TypeError, ValueError):
            continue
        for text in texts if isinstance(texts, list) else ():
            key, _, value = str(text).partition("=")
            found[key.strip()] = " ".join(value.split())
    return found
