"""Where stick-slip ends, on the way up in speed, well below the speed up to which torsion
alone would keep it: something else in the model takes it away."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from nsdrill.analysis.counts import carried_axis
from nsdrill.analysis.safety import DECIDING, known_outcome
from nsdrill.analysis.sticking import joined
from nsdrill.data import Answer, Array, Results
from nsdrill.models.numbers import FOLD_ERROR
from nsdrill.models.responses import RESPONSES, STICK_SLIP, StickSlip

SPEED = "rotary_speed"
EARLY = 0.9  # of the speed below which stick-slip lasts
INDEX = RESPONSES["stick_slip"].feature
USES = ("status", "response", "wall_contact_fraction", INDEX, *DECIDING)

# [rad/s] at many values of the axes but the speed; None where stick-slip lasts at no speed, NaN where not known
Folds = Callable[[Sequence[Mapping[str, float]]], list[float | None]]


def ends_early(results: Results, folds: Folds) -> list[Answer]:
    """The settings at which stick-slip ends at less than :data:`EARLY` of its fold, one of ``folds``, the
    speed below which it lasts, as plain data in SI units; those that are followed by a free
    point first, and of them the most conspicuous. Empty for results with samples
    or starts, and without a way up in speed.

    Each has the values of ``all`` other axes; and speeds with their units: the ``last``
    one with stick-slip, the next one, ``by`` which it has ended, the ``fold``, and the
    two between which it ends by torsion ``alone``; and whether that next one is ``free``, or
    has another response. ``contact`` is whether the collar touched the wall in the last run
    with stick-slip, or in one with another response after it.
    """
    if "up" not in results.procedures or SPEED not in results.swept or len(results.grid) != 1 + len(results.axes):
        return []
    if carried_axis(results) not in (SPEED, None):  # no stick-slip is carried up in speed
        return []
    codes = known_outcome(results)[results.procedures.index("up")]
    speeds, place = results.coords[SPEED], results.axes.index(SPEED)
    lines, sticks = (np.moveaxis(each, place, -1) for each in (codes, _sticks(results, codes)))
    ends: list[tuple[Answer, dict[str, float]]] = []
    others = [name for name in results.axes if name != SPEED]
    for index in np.ndindex(lines.shape[:-1]):
        line, unknown = lines[index], lines[index] < 0
        sticking = np.flatnonzero(joined(~unknown & sticks[index], line, unknown))
        if len(sticking) == 0 or sticking[-1] + 1 == len(speeds) or lines[index][sticking[-1] + 1] < 0:
            continue
        is_free = bool(lines[index][sticking[-1] + 1] == 0)
        at = {name: float(results.coords[name][k]) for name, k in zip(others, index, strict=True)}
        last, by = (float(speeds[sticking[-1] + k]) for k in (0, 1))
        on_wall = _on_wall(results, place, index, sticking[-1] + (not is_free))
        ends.append(({"all": at, "free": is_free, "contact": on_wall}, {"last": last, "by": by}))
    found = []
    for (one, speeds_of), limit in zip(ends, folds([one["all"] for one, _ in ends]), strict=True):
        if limit is not None and speeds_of["by"] < EARLY * limit:
            told = {**speeds_of, "fold": limit, "alone": [limit, FOLD_ERROR * limit]}
            found.append({**one, **{name: {"value": value, "units": "rad/s"} for name, value in told.items()}})
    return sorted(found, key=lambda one: (not one["free"], one["by"]["value"] / one["fold"]["value"]))


def _sticks(results: Results, codes: Array) -> Array:
    """Where the way up sticks, of these outcomes: a threshold above the default takes the label away, and ends
    nothing."""
    found = codes & STICK_SLIP > 0
    if INDEX in results.variables:
        found |= results[INDEX][results.procedures.index("up")] > StickSlip().stick_slip_index
    return np.asarray((codes >= 0) & found)


def _on_wall(results: Results, place: int, index: tuple[int, ...], speed: int) -> bool:
    """Whether the collar touches the wall on the way up, at the speed of this number, which is
    the axis at this ``place``, at these numbers of the others."""
    if "wall_contact_fraction" not in results.variables:
        return False
    on_way_up = results["wall_contact_fraction"][results.procedures.index("up")]
    return bool(np.moveaxis(on_way_up, place, -1)[index][speed] > 0.0)
