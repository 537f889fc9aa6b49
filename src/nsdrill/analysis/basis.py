"""What a range to stay within rests on: at how many settings in it there are runs, how wide the
steps between these are, and how many of them were inferred from their neighbours and not run.
What lies between two settings no run shows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nsdrill.analysis.graded import Graded
from nsdrill.analysis.planes import Cell, along_axis
from nsdrill.data import Answer, Array
from nsdrill.models.choices import words_along
from nsdrill.records import dataclass


@dataclass(frozen=True)
class Basis:
    """The number of ``settings`` within a range, of those ``inferred``, and the least and the
    greatest of the ``steps`` within it along each axis that has any."""

    settings: int
    inferred: int
    steps: dict[str, tuple[float, float]]


def points_within(maps: Graded, cell: Cell, ends: Mapping[str, tuple[float, float]]) -> Array:
    """The points, bool [third, y, x], between the ``ends`` of each axis, both included; along
    an axis without ends those at the ``cell``."""
    found = np.ones(maps.grade.shape, dtype=bool)
    for place, axis in enumerate((maps.third, maps.y, maps.x)):
        chosen = _chosen(maps, axis, ends)
        if chosen is None:
            chosen = np.arange(maps.grade.shape[place]) == cell[place]
        found &= along_axis(chosen, place)
    return found


def basis_of(maps: Graded, cell: Cell, ends: Mapping[str, tuple[float, float]]) -> Basis:
    """What a range between these ``ends`` rests on."""
    inside, steps = points_within(maps, cell, ends), {}
    for axis in (maps.x, maps.y, maps.third):
        if axis is None or words_along(axis) or (chosen := _chosen(maps, axis, ends)) is None:
            continue
        if len(between := np.diff(maps.values(axis)[chosen])):
            steps[axis] = float(between.min()), float(between.max())
    return Basis(int(np.count_nonzero(inside)), int(np.count_nonzero(inside & ~maps.was_run)), steps)


def data_of_basis(basis: Basis) -> Answer:
    """It as plain data, with values under the name of their quantity."""
    steps = {axis: {"axis": axis, "from": least, "to": most} for axis, (least, most) in basis.steps.items()}
    return {"settings": basis.settings, "inferred": basis.inferred, "steps": steps}


def _chosen(maps: Graded, axis: str | None, ends: Mapping[str, tuple[float, float]]) -> Array | None:
    """Which values of an axis lie between its ends; None where it has none."""
    if axis is None or axis not in ends:
        return None
    values, (low, high) = maps.values(axis), ends[axis]
    return np.asarray((low <= values) & (values <= high))
