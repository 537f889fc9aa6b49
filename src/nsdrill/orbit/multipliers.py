"""Floquet multipliers of the points of finished branches, with a smaller tolerance than
that of the continuation.

The error of a deviation is that of the instant at which the motion reaches a contact:
with the tolerance that suffices for Newton's method, multipliers are wrong by 1e-8 to
1e-7. One monodromy of each point at a hundredth of the tolerance costs a fiftieth of
the continuation. Close to grazing, multipliers depend on the orbit so strongly that the
orbit itself would need the smaller tolerance: there they keep their values.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.cycle import Cycle
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.lockstep import Task, advance
from nsdrill.orbit.periodic import Periodic
from nsdrill.orbit.shooting import Orbit, monodromy_product

Array = np.ndarray[Any, np.dtype[Any]]
TOLERANCE_RATIO = 0.01  # to the tolerance of the flow
# relative, of finer multipliers: with a larger one they are those of another orbit
MAX_DIFFERENCE = 1e-6
BATCH_POINTS = 100  # whose segments make a batch


def problem_of(flow: Flow, branch: Branch, orbit: Orbit) -> Periodic | Cycle:
    """The problem that an orbit of a branch solves."""
    if branch.motion == CYCLE:
        return Cycle.at(flow, orbit.period, orbit.values, orbit.state, len(orbit.mesh_states))
    return Periodic.at(flow, branch.lobes, orbit.values, orbit.state, len(orbit.mesh_states))


def finer_multipliers(flow: Flow, branches: list[Branch], poll: Callable[[], None] = lambda: None) -> list[Array]:
    """The multipliers [free states] of all points of all branches, in order. Those of
    circles keep their values, as their interpolation error is larger. ``poll`` is
    called once a batch, and may raise to stop."""
    flow = Flow(flow.equations, rtol=TOLERANCE_RATIO * flow.rtol, workers=flow.workers)
    points = [(branch, entry.point.found) for branch in branches for entry in branch.marked]
    multipliers = [orbit.multipliers for _, orbit in points]
    fine = [index for index, (branch, _) in enumerate(points) if branch.motion != CIRCLE]
    for first in range(0, len(fine), BATCH_POINTS):
        tasks = {index: _finer(flow, *points[index]) for index in fine[first : first + BATCH_POINTS]}
        for index, found in advance(flow, tasks, poll).items():
            multipliers[index] = found
    return multipliers


def _finer(flow: Flow, branch: Branch, orbit: Orbit) -> Task[Array]:
    """The multipliers of an orbit with the tolerance of ``flow``, where they are those of
    the same orbit."""
    problem = problem_of(flow, branch, orbit)
    values, periods = orbit.values[None], np.array([orbit.period])
    ends = yield problem.legs(orbit.mesh_states[None], values, periods, (True,))
    _, monodromies = problem.shots(ends, values, periods)
    monodromy = monodromy_product(monodromies[0] * (problem.state_scales / problem.state_scales[:, None]))
    if not (ends.ok.all() and np.isfinite(monodromy).all()):
        return orbit.multipliers
    coarse, finer = orbit.multipliers, np.linalg.eigvals(monodromy)
    distances = np.abs(coarse[:, None] - finer[None, :]) / np.maximum(np.abs(coarse[:, None]), 1.0)
    return finer if np.max(distances.min(axis=1)) < MAX_DIFFERENCE else coarse
