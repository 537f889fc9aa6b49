"""Branches of motions from a file of ``nsdrill branches``, as curves for a page."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence

import numpy as np

from nsdrill.analysis.bifurcations import (
    CRITICALITY,
    CRITICALITY_NAMES,
    END,
    PERIODIC,
    REGULAR,
    meanings_of,
    motion_text,
    stability_text,
)
from nsdrill.analysis.comparison import other_string
from nsdrill.data import Answer, Array, Attributes, Results
from nsdrill.errors import FileError, InputError
from nsdrill.figures.kinds.branch_diagram import COLOURS, GRAZING_MARKERS, MARKERS
from nsdrill.models.model_description import Description
from nsdrill.models.registry import drawn_in, model_in, named_in
from nsdrill.records import dataclass
from nsdrill.store import hdf5, open_branches
from nsdrill.study.study import Study, study_from_resolved
from nsdrill.web.diagrams import Reply
from nsdrill.web.shown import plain, quantity_data
from nsdrill.words.labels import quantity, setting


@dataclass(frozen=True)
class Branches:
    """All branches of a file, their points one after the other.

    * ``along``, ``key``: name and study key of the parameter that is continued;
    * ``sizes``, ``motions``, ``names``, ``ends`` [branch]: the number of points, the
      kind of motion, that in words, and why the branch ends;
    * ``features`` [point], ``period`` [point] in s, ``unstable`` [point]: the number of
      unstable directions, -1 where that is not decided;
    * ``state`` [point, states]: the state at the drive angle 0;
    * ``label`` [point], with its words in ``meanings``, and ``criticality`` [point].
    """

    path: str
    attrs: Attributes
    along: str
    key: str
    sizes: Array
    motions: tuple[str, ...]
    names: tuple[str, ...]
    ends: tuple[str, ...]
    features: dict[str, Array]
    state: Array
    period: Array
    unstable: Array
    label: Array
    criticality: Array
    meanings: dict[int, str]
    operated: tuple[str, ...]

    @property
    def numbers(self) -> Array:
        """The values of the parameter that is continued [point]."""
        return self.features[self.along]

    @property
    def study(self) -> Study:
        """The study that the branches were continued from."""
        if "study_resolved" not in self.attrs:
            raise FileError(f"{self.path}: found no study in the file; allowed: a file of nsdrill branches.")
        return study_from_resolved(
            json.loads(self.attrs["study_resolved"]), str(self.attrs.get("study", "")), self.path
        )

    def branch_of(self, point: int) -> int:
        """The number of the branch of a point."""
        return int(np.searchsorted(np.cumsum(self.sizes), point, side="right"))

    def name_of(self, point: int) -> str:
        """The branch of a point, its stability, and its label where the point is
        special."""
        branch = self.branch_of(point)
        parts = [f"branch {branch}", self.names[branch], stability_text(int(self.unstable[point]))]
        if (label := int(self.label[point])) not in (REGULAR, END):
            parts.append(self.meanings.get(label, str(label)))
            parts += filter(None, [CRITICALITY[CRITICALITY_NAMES.get(int(self.criticality[point]), "not_known")]])
        return ", ".join(parts)


def read_branches(path: str | os.PathLike[str]) -> Branches:
    """The branches in the file ``path``; FileError where it is another kind of file, or
    damaged."""
    data = open_branches(path)
    attrs, point = data.attrs, ("point",)
    along = str(attrs["along"])
    kept = (along, *model_in(attrs).operation.names())
    features = {
        str(name): array.values.astype(float)
        for name, array in data.variables.items()
        if array.dims == point and array.dtype.kind == "f" and (name in named_in(attrs) or name in kept)
    }
    if along not in features:
        raise FileError(f"{path}: the variable {along} is missing. {hdf5.EDITED}")
    return Branches(
        str(path),
        attrs,
        along,
        str(attrs.get("along_key", along)),
        data["row_size"].values,
        tuple(map(str, data["motion"].values)),
        tuple(_name(*one, model_in(attrs)) for one in zip(data["motion"].values, data["lobes"].values, strict=True)),
        tuple(map(str, data["end_reason"].values)),
        features,
        data["state"].values,
        data["period"].values,
        data["unstable"].values,
        data["label"].values,
        data["criticality"].values,
        {code: one.name.replace("_", " ") for code, one in meanings_of(model_in(attrs)).items()},
        model_in(attrs).operation.names(),
    )


def _name(motion: str, lobes: int, model: Description) -> str:
    return motion_text(str(motion), int(lobes), model).removeprefix("a ").removeprefix("an ")


def curves(branches: Branches, name: str, units: str) -> tuple[Answer, dict[str, Array]]:
    """The branches in a diagram of the feature ``name``: columns ``curve x``, ``curve
    y`` and ``curve unstable`` [point]. ``curves`` in the head has the sizes; the
    ``kinds`` of motions with their colours, and the ``kind`` of each branch; and the
    ``special`` points, each with the number of its label among ``marks``."""
    x, y = quantity(branches.along, units), quantity(name, units)
    points = np.flatnonzero(~np.isin(branches.label, (REGULAR, END)))
    codes = list(dict.fromkeys(branches.label[points].tolist()))
    kinds = dict(zip(branches.names, branches.motions, strict=True))
    head = {
        "sizes": branches.sizes,
        "kinds": [{"name": kind, "colour": _colour(kind, kinds)} for kind in kinds],
        "kind": [list(kinds).index(kind) for kind in branches.names],
        "special": [[int(i), codes.index(int(branches.label[i]))] for i in points],
        "marks": [{"name": branches.meanings.get(code, str(code)), **_mark(code, codes)} for code in codes],
    }
    columns = {
        "curve x": branches.numbers / x.scale,
        "curve y": branches.features[name] / y.scale,
        "curve unstable": branches.unstable,
    }
    return {"curves": head}, columns


# Of motions over more lobes than the first kind of a file, which has the colour of the
# pictures.
FURTHER_COLOURS = ("#332288", "#AA4499", "#882255", "#117733")


def _colour(kind: str, kinds: Mapping[str, str]) -> str:
    """The colour of a kind of motion, of all ``kinds`` with their motions: that of the
    pictures; of several periodic kinds one each."""
    periodic = [one for one, motion in kinds.items() if motion == PERIODIC]
    if kind in periodic[1:]:
        return FURTHER_COLOURS[(periodic.index(kind) - 1) % len(FURTHER_COLOURS)]
    return COLOURS.get(kinds[kind], "#000000")


def _mark(code: int, codes: list[int]) -> dict[str, str]:
    """The marker and the colour of a label, as in the pictures."""
    grazing = sorted(set(codes) - MARKERS.keys())
    if code in MARKERS:
        marker, colour = MARKERS[code]
    else:
        marker, colour = GRAZING_MARKERS[grazing.index(code) % len(GRAZING_MARKERS)]
    return {"marker": marker, "colour": colour}


def branch_choices(branches: Branches, units: str) -> Answer:
    """What can be drawn of branches without a sweep."""
    features = branches.features
    panels = [panel for panel in drawn_in(branches.attrs).panels if panel.greatest in features]
    axis = quantity_data(branches.along, units)
    return {
        "axes": [{**axis, "key": branches.key, "dimension": 0, "values": [], "log": False}],
        "procedures": [""],
        "members": None,
        "labels": [],
        "areas": [],
        "dimensions": 0,
        "panels": [{**quantity_data(panel.peaks, units), "mode": panel.mode, "trace": panel.trace} for panel in panels],
        "features": [quantity_data(name, units) for name in features if name in named_in(branches.attrs)],
    }


def branch_diagram(branches: Branches, y: str, units: str) -> Reply:
    """The curves of the peaks or the feature ``y`` of branches without a sweep."""
    name = greatest(branches.attrs, y)
    if name not in branches.features or name not in named_in(branches.attrs):
        peaks = [panel.peaks for panel in drawn_in(branches.attrs).panels]
        names = ", ".join(dict.fromkeys((*peaks, *branches.features)))
        raise InputError(f"y: found {y}; allowed: what a panel or a feature of these branches is called, {names}.")
    more, lines = curves(branches, name, units)
    x = lines["curve x"]
    head = {
        "x": branch_choices(branches, units)["axes"][0],
        "y": quantity_data(y, units),
        "procedures": [""],
        "hover_quantities": [],
        "place": None,
        "hysteresis": [],
        "lines": [],
        "edges": [x.min(), x.max()],
    }
    no_points: dict[str, Array] = {
        "values": np.empty((1, 0, 1)),
        "outcome": np.empty((1, 0)),
        "constant": np.empty((1, 0)),
    }
    return head | more, no_points | lines


def with_branches(reply: Reply, branches: Branches, results: Results, y: str, units: str) -> Reply:
    """The diagram of ``y`` of ``results`` with the branches over it, or with a note why
    they do not belong there."""
    head, columns = reply
    name = greatest(branches.attrs, y)
    reason = mismatch(branches, results, head["x"]["name"], head["place"], units)
    if reason or name not in branches.features:
        return head | {"note": reason or "The branches have no such feature."}, columns
    more, lines = curves(branches, name, units)
    return head | more, columns | lines


def greatest(attrs: Attributes, y: str) -> str:
    """The feature that stands for the peaks ``y``; of a feature itself."""
    panel = next((panel for panel in drawn_in(attrs).panels if panel.peaks == y), None)
    return panel.greatest if panel else y


def mismatch(branches: Branches, results: Results, axis: str, place: Sequence[int], units: str) -> str:
    """Why the branches do not belong in a diagram along ``axis`` through ``place``; ""
    where they do."""
    if other := other_string(branches.attrs, results, {}, (branches.key,)):
        key, of_branches, of_sweep = other[0]
        there, here = (setting(key, value, units) for value in (of_branches, of_sweep))
        return f"The branches are of another string: {key} is {there} there, {here} here."
    if axis != branches.along:
        return f"The branches run along {plain(quantity(branches.along).words)}."
    for name, i in zip(results.grid, place, strict=True):
        if name in branches.features and name != axis and name in results.axes:
            sweep_number = float(results.coords[name][i])
            branch_number = float(branches.features[name][0])
            difference = abs(sweep_number - branch_number)
            if difference > 1e-9 * max(abs(sweep_number), abs(branch_number)):
                shown = quantity(name, units)
                return f"The branches are at {plain(shown.words)} {shown.value(branch_number)}."
    return ""
