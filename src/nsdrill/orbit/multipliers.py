"""Floquet multipliers of points that are known, finer than those that led there.

A deviation is as good as the instant at which the motion reaches a contact: the
tolerance that serves Newton's method leaves multipliers wrong by 1e-8 to 1e-7. One
monodromy of each point at a hundredth of it costs a fiftieth of the way there. Close to
grazing, multipliers depend on the orbit so much that the orbit would have to be found
anew: they stay.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.flow import Flow, Legs, joined
from nsdrill.orbit.frame import turned
from nsdrill.orbit.periodic import ANGLES, Orbit, product

Array = np.ndarray[Any, np.dtype[Any]]
FINER = 0.01  # of the tolerance of the flow
# finer multipliers that differ by more, relative to their size, are of an orbit beside
ALIKE = 1e-6
TOGETHER = 400  # legs in one batch


def finer_multipliers(
    flow: Flow, branches: list[Branch], look: Callable[[], None] = lambda: None
) -> list[Array]:
    """The multipliers [free states] of all points of all branches, one after the other.
    Those of circles stay: the interpolation along them errs by more. ``look`` is called
    once a batch, and may raise to stop."""
    flow = Flow(flow.equations, rtol=FINER * flow.rtol, workers=flow.workers)
    points = [(branch, one.point.found) for branch in branches for one in branch.marked]
    made = [orbit.multipliers for _, orbit in points]
    batch: list[tuple[int, Legs, Array]] = []
    for place, (branch, orbit) in enumerate(points):
        if branch.motion != CIRCLE:
            legs, angles = _segments(flow, branch, orbit)
            batch.append((place, legs, angles))
        if batch and (
            place == len(points) - 1 or sum(len(legs) for _, legs, _ in batch) >= TOGETHER
        ):
            look()
            _measure(flow, batch, points, made)
            batch = []
    return made


def _segments(flow: Flow, branch: Branch, orbit: Orbit) -> tuple[Legs, Array]:
    """The segments of a motion, and by which angle [rad] the end of each is turned
    back."""
    pieces = orbit.pieces
    assert pieces is not None
    J = len(pieces)
    every, tangent = np.tile(orbit.values, (J, 1)), np.ones(J, dtype=bool)
    if branch.motion == CYCLE:
        angles = flow.phase_rate(every) * orbit.period / J
        return Legs(pieces, np.zeros(J), np.full(J, orbit.period / J), every, tangent), angles
    angle = 2.0 * math.pi * branch.lobes / (flow.symmetry.folds or ANGLES)
    angles = np.where(np.arange(J) == J - 1, angle, 0.0)
    return Legs(
        pieces, np.arange(J) * angle / J, np.full(J, angle / J), every, tangent, 1.0, True
    ), angles


def _measure(
    flow: Flow,
    batch: list[tuple[int, Legs, Array]],
    points: list[tuple[Branch, Orbit]],
    made: list[Array],
) -> None:
    ends = flow.run(joined([legs for _, legs, _ in batch]))
    first = 0
    for place, legs, angles in batch:
        part = slice(first, first + len(legs))
        first = part.stop
        orbit = points[place][1]
        free = list(orbit.free)
        size = flow.state_scales(orbit.values)[0][free]
        back = np.swapaxes(
            turned(flow.symmetry, np.swapaxes(ends.monodromy[part], 1, 2), -angles[:, None]), 1, 2
        )
        whole = product(back[:, free][:, :, free] * (size / size[:, None]))
        if ends.ok[part].all() and np.isfinite(whole).all():
            finer = np.linalg.eigvals(whole)
            if _apart(orbit.multipliers, finer) < ALIKE:
                made[place] = finer


def _apart(one: Array, two: Array) -> float:
    """By how much the multipliers ``one`` differ from the nearest of ``two``, relative
    to their size where above 1."""
    distances = np.abs(one[:, None] - two[None, :]) / np.maximum(np.abs(one[:, None]), 1.0)
    return float(np.max(distances.min(axis=1)))
