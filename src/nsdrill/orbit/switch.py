"""Branch switching: the first point of a branch that emanates from a period doubling, a
branch point or a Hopf bifurcation of another branch."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Point, Problem, Task, corrected
from nsdrill.orbit.cycle import SEGMENTS, Cycle
from nsdrill.orbit.labels import critical_vector
from nsdrill.orbit.periodic import Orbit, Periodic, segment_starts

Array = np.ndarray[Any, np.dtype[np.float64]]
STEP_LENGTHS = (0.05, 0.2, 0.01)  # from the bifurcation, in natural scales, in order of trial


def first_point_on(problem: Problem, base: Array, direction: Array) -> Task[Point | None]:
    """The first point of ``problem`` away from the unknowns ``base`` in a
    ``direction``; None where no step leads to one."""
    length = float(np.linalg.norm(direction))
    if not length > 0.0:
        return None
    normal = direction / length
    for step in STEP_LENGTHS:
        point = yield from corrected(problem, base + step * normal, normal, normal)
        if point is None:
            continue
        displacement = point.x - base
        if abs(normal @ displacement) > 0.5 * step and np.linalg.norm(displacement) < 10.0 * step:
            return point
    return None


def _critical_direction(problem: Periodic, orbit: Orbit, vector: Array) -> Task[tuple[Array, Array] | None]:
    """The unknowns of ``problem`` on the orbit, and their derivative by a displacement
    of its start along ``vector`` [free]; None where a run fails."""
    states = yield from segment_starts(problem, orbit.state, orbit.values)
    displaced = orbit.state.copy()
    step = 1e-4
    displaced[list(orbit.free)] += step * vector * problem.state_scales
    neighbours = yield from segment_starts(problem, displaced, orbit.values)
    if states is None or neighbours is None:
        return None
    base = problem.unknowns(states, orbit.values[-1])
    return base, (problem.unknowns(neighbours, orbit.values[-1]) - base) / step


def switched_at_doubling(problem: Periodic, orbit: Orbit) -> Task[Point | None]:
    """The first point of the branch of twice the period at a doubling ``orbit``;
    ``problem`` is that of the doubled period."""
    line = yield from _critical_direction(problem, orbit, critical_vector(orbit, -1.0))
    if line is None:
        return None
    return (yield from first_point_on(problem, *line))


def switched_at_branch_point(problem: Periodic, orbit: Orbit, sign: int) -> Task[Point | None]:
    """The first point of the other branch at a branch point, on the side ``sign`` (1 or
    -1)."""
    line = yield from _critical_direction(problem, orbit, sign * critical_vector(orbit, 1.0))
    if line is None:
        return None
    return (yield from first_point_on(problem, *line))


def cycle_doubling_problem(problem: Cycle, orbit: Orbit) -> tuple[Cycle, Array, Array]:
    """The problem of the cycles of twice the period that emanate at a doubling of
    cycles, its unknowns there, and their direction."""
    assert orbit.mesh_states is not None
    doubled = Cycle.at(problem.flow, 2.0 * orbit.period, orbit.values, orbit.state, 2 * problem.segments)
    vector = critical_vector(orbit, -1.0)
    base = doubled.unknowns(np.concatenate([orbit.mesh_states] * 2), 2.0 * orbit.period, orbit.values[-1])
    direction = np.zeros(len(base))
    n = len(vector)
    direction[:n] = vector
    direction[problem.segments * n : (problem.segments + 1) * n] = -vector
    return doubled, base, direction


def hopf_problem(flow: Any, orbit: Orbit) -> tuple[Cycle, Array, Array] | None:
    """The problem of the cycles that emanate from an equilibrium at a Hopf bifurcation,
    its unknowns there, and their direction; None where the equilibrium has no complex
    pair of multipliers."""
    assert orbit.monodromy is not None
    multipliers, vectors = np.linalg.eig(orbit.monodromy)
    pairs = np.flatnonzero(multipliers.imag > 1e-6)
    if not len(pairs):
        return None
    nearest = pairs[np.argmin(np.abs(np.abs(multipliers[pairs]) - 1.0))]
    frequency = float(np.angle(multipliers[nearest])) / orbit.period
    period = 2.0 * math.pi / frequency
    cycle = Cycle.at(flow, period, orbit.values, orbit.state, SEGMENTS)
    vector = vectors[:, nearest]
    states = np.real(vector[None, :] * np.exp(2j * math.pi * np.arange(SEGMENTS) / SEGMENTS)[:, None])
    base = cycle.unknowns(np.tile(orbit.state, (SEGMENTS, 1)), period, orbit.values[-1])
    direction = np.concatenate([states.ravel() / math.sqrt(SEGMENTS), [0.0, 0.0]])
    # The normal of the phase condition is the flow at the start, which vanishes at an
    # equilibrium: that of the emanating cycles is taken.
    free = list(orbit.free)
    normal = np.imag(vector)
    state_scales = cycle.state_scales
    problem = Cycle(
        flow,
        SEGMENTS,
        state_scales,
        period,
        cycle.values,
        cycle.fixed,
        orbit.state[free] / state_scales,
        normal / max(float(np.linalg.norm(normal)), 1e-300),
    )
    return problem, base, direction
