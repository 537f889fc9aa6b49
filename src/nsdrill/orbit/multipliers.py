"""Floquet multipliers of the points of finished branches, with a smaller tolerance than
that of the continuation.

The error of a deviation is that of the instant at which the motion reaches a contact:
with the tolerance that suffices for Newton's method, multipliers are wrong by 1e-8 to
1e-7. One monodromy of each point at a hundredth of the tolerance costs a fiftieth of
the continuation. Close to grazing, multipliers depend on the orbit so strongly that the
orbit itself would need the smaller tolerance: there they keep their values.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.flow import Flow, Legs, joined
from nsdrill.orbit.frame import rotated
from nsdrill.orbit.periodic import EQUILIBRIUM_FOLDS, Orbit, monodromy_product

Array = np.ndarray[Any, np.dtype[Any]]
TOLERANCE_RATIO = 0.01  # to the tolerance of the flow
# relative, of finer multipliers: with a larger one they are those of another orbit
MAX_DIFFERENCE = 1e-6
BATCH_LEGS = 400  # that make a batch


def finer_multipliers(flow: Flow, branches: list[Branch], poll: Callable[[], None] = lambda: None) -> list[Array]:
    """The multipliers [free states] of all points of all branches, in order. Those of
    circles keep their values, as their interpolation error is larger. ``poll`` is
    called once a batch, and may raise to stop."""
    flow = Flow(flow.equations, rtol=TOLERANCE_RATIO * flow.rtol, workers=flow.workers)
    points = [(branch, entry.point.found) for branch in branches for entry in branch.marked]
    multipliers = [orbit.multipliers for _, orbit in points]
    batch: list[tuple[int, Legs, Array]] = []
    for index, (branch, orbit) in enumerate(points):
        if branch.motion != CIRCLE:
            legs, angles = _segment_legs(flow, branch, orbit)
            batch.append((index, legs, angles))
        if batch and (index == len(points) - 1 or sum(len(legs) for _, legs, _ in batch) >= BATCH_LEGS):
            poll()
            _refine(flow, batch, points, multipliers)
            batch = []
    return multipliers


def _segment_legs(flow: Flow, branch: Branch, orbit: Orbit) -> tuple[Legs, Array]:
    """The segments of a motion, and the angle [rad] by which the end of each is rotated
    back."""
    states = orbit.mesh_states
    assert states is not None
    J = len(states)
    all_values, tangent = np.tile(orbit.values, (J, 1)), np.ones(J, dtype=bool)
    if branch.motion == CYCLE:
        angles = flow.phase_rate(all_values) * orbit.period / J
        return Legs(states, np.zeros(J), np.full(J, orbit.period / J), all_values, tangent), angles
    angle = 2.0 * math.pi * branch.lobes / (flow.symmetry.folds or EQUILIBRIUM_FOLDS)
    angles = np.where(np.arange(J) == J - 1, angle, 0.0)
    return Legs(states, np.arange(J) * angle / J, np.full(J, angle / J), all_values, tangent, 1.0, True), angles


def _refine(
    flow: Flow, batch: list[tuple[int, Legs, Array]], points: list[tuple[Branch, Orbit]], multipliers: list[Array]
) -> None:
    """Put the finer multipliers of the points in ``batch`` into ``multipliers``."""
    ends = flow.run(joined([legs for _, legs, _ in batch]))
    first = 0
    for index, legs, angles in batch:
        rows = slice(first, first + len(legs))
        first = rows.stop
        orbit = points[index][1]
        free = list(orbit.free)
        state_scales = flow.state_scales(orbit.values)[0][free]
        monodromies = np.swapaxes(
            rotated(flow.symmetry, np.swapaxes(ends.monodromy[rows], 1, 2), -angles[:, None]), 1, 2
        )
        monodromy = monodromy_product(monodromies[:, free][:, :, free] * (state_scales / state_scales[:, None]))
        if ends.ok[rows].all() and np.isfinite(monodromy).all():
            finer = np.linalg.eigvals(monodromy)
            if _largest_difference(orbit.multipliers, finer) < MAX_DIFFERENCE:
                multipliers[index] = finer


def _largest_difference(coarse: Array, finer: Array) -> float:
    """The largest distance of the multipliers ``coarse`` from the nearest of ``finer``,
    relative to their modulus where it exceeds 1."""
    distances = np.abs(coarse[:, None] - finer[None, :]) / np.maximum(np.abs(coarse[:, None]), 1.0)
    return float(np.max(distances.min(axis=1)))
