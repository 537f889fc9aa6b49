"""Whether an answer rests on runs that were short, or in which a motion was still changing:
what grows slowly is not seen in them, so that a free point of them may vibrate."""

from __future__ import annotations

import json

import numpy as np

from nsdrill.analysis.advice import Advice, Kind, Unsettled
from nsdrill.analysis.basis import points_within
from nsdrill.analysis.maps import Classes
from nsdrill.data import SHORT, SHORT_TO, Array


def unsettled_of(maps: Classes, advice: Advice) -> Unsettled | None:
    """On which such runs the ``advice`` rests; None where it names no allowed point, and
    where it rests on none."""
    if advice.cell is None or advice.kind in (Kind.NOTHING, Kind.UNKNOWN):
        return None
    inside = points_within(maps.grades, advice.cell, advice.ends)
    beside = _beside(inside)
    if maps.grades.outside is not None:  # where one does not drill bounds nothing
        beside &= ~maps.grades.outside
    points, bounds = (int(np.count_nonzero(maps.unsettled & chosen)) for chosen in (inside, beside))
    short = _is_short(maps, inside | beside)
    found = Unsettled(points, int(np.count_nonzero(inside)), bool(maps.unsettled[advice.cell]), bounds, short)
    return found if found.points or found.short else None


def _is_short(maps: Classes, chosen: Array) -> bool:
    """Whether the runs of the ``chosen`` points are short beside the slowest motion of their
    model, or hold few revolutions of the drive: slower ones, as of a run-up, do not count."""
    attrs = maps.results.attrs
    if not any(json.loads(attrs.get(SHORT, "{}")).values()):
        return False
    limit = float(attrs.get(SHORT_TO, np.inf))
    for place, axis in enumerate((maps.third, maps.y, maps.x)):
        if axis == "rotary_speed":
            others = tuple(one for one in range(3) if one != place)
            return bool(np.any(maps.values(axis)[chosen.any(axis=others)] < limit))
    return True


def _beside(inside: Array) -> Array:
    """The points next to those ``inside`` along a row or a column of a map."""
    found = np.zeros_like(inside)
    for axis in (1, 2):
        ahead, behind = np.zeros_like(inside), np.zeros_like(inside)
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        ahead[tuple(high)], behind[tuple(low)] = inside[tuple(low)], inside[tuple(high)]
        found |= ahead | behind
    return found & ~inside
