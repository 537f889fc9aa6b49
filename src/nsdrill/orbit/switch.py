"""The first point of a branch that springs from a special point of another: at a
doubling, a branch point, a Hopf."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Point, Problem, Steps, corrected
from nsdrill.orbit.cycle import SEGMENTS, Cycle
from nsdrill.orbit.labels import critical_vector
from nsdrill.orbit.periodic import ANGLES, Orbit, Periodic, between_segments

Array = np.ndarray[Any, np.dtype[np.float64]]
STEPS = (0.05, 0.2, 0.01)  # away from the bifurcation, in natural scales


def started(problem: Problem, base: Array, direction: Array) -> Steps[Point | None]:
    """The first point of ``problem`` off ``base`` in a ``direction`` of the
    unknowns."""
    length = float(np.linalg.norm(direction))
    if not length > 0.0:
        return None
    normal = direction / length
    for step in STEPS:
        point = yield from corrected(problem, base + step * normal, normal, normal)
        if point is None:
            continue
        away = point.x - base
        if abs(normal @ away) > 0.5 * step and np.linalg.norm(away) < 10.0 * step:
            return point
    return None


def _along(problem: Periodic, orbit: Orbit, vector: Array) -> Steps[tuple[Array, Array] | None]:
    """The unknowns of ``problem`` on the orbit, and how they change with its start
    along ``vector`` [free]."""
    states = yield from between_segments(problem, orbit.state, orbit.values)
    moved = orbit.state.copy()
    h = 1e-4
    moved[list(orbit.free)] += h * vector * problem.size
    beside = yield from between_segments(problem, moved, orbit.values)
    if states is None or beside is None:
        return None
    base = problem.unknowns(states, orbit.values[-1])
    return base, (problem.unknowns(beside, orbit.values[-1]) - base) / h


def doubled(problem: Periodic, orbit: Orbit) -> Steps[Point | None]:
    """The first point of the orbits of twice the period, of which ``problem`` is, at a
    doubling."""
    found = yield from _along(problem, orbit, critical_vector(orbit, -1.0))
    if found is None:
        return None
    return (yield from started(problem, *found))


def branched(problem: Periodic, orbit: Orbit, sense: int) -> Steps[Point | None]:
    """The first point of the other branch at a branch point, to either side."""
    found = yield from _along(problem, orbit, sense * critical_vector(orbit, 1.0))
    if found is None:
        return None
    return (yield from started(problem, *found))


def doubled_cycle(problem: Cycle, orbit: Orbit) -> tuple[Cycle, Array, Array]:
    """The problem of cycles of twice the period at a doubling of cycles, its unknowns
    there, and the direction."""
    assert orbit.pieces is not None
    made = Cycle.at(
        problem.flow, 2.0 * orbit.period, orbit.values, orbit.state, 2 * problem.segments
    )
    vector = critical_vector(orbit, -1.0)
    base = made.unknowns(np.concatenate([orbit.pieces] * 2), 2.0 * orbit.period, orbit.values[-1])
    direction = np.zeros(len(base))
    n = len(vector)
    direction[:n] = vector
    direction[problem.segments * n : (problem.segments + 1) * n] = -vector
    return made, base, direction


def at_hopf(flow: Any, orbit: Orbit) -> tuple[Cycle, Array, Array] | None:
    """The problem of the cycles that spring from an equilibrium at a Hopf bifurcation,
    its unknowns there, and the direction of the cycles; None where no pair of
    multipliers is near the unit circle."""
    assert orbit.monodromy is not None
    multipliers, vectors = np.linalg.eig(orbit.monodromy)
    pairs = np.flatnonzero(multipliers.imag > 1e-6)
    if not len(pairs):
        return None
    nearest = pairs[np.argmin(np.abs(np.abs(multipliers[pairs]) - 1.0))]
    frequency = float(np.angle(multipliers[nearest])) / orbit.period
    period = 2.0 * math.pi / frequency
    made = Cycle.at(flow, period, orbit.values, orbit.state, SEGMENTS)
    vector = vectors[:, nearest]
    waves = np.real(
        vector[None, :] * np.exp(2j * math.pi * np.arange(SEGMENTS) / SEGMENTS)[:, None]
    )
    base = made.unknowns(np.tile(orbit.state, (SEGMENTS, 1)), period, orbit.values[-1])
    direction = np.concatenate([waves.ravel() / math.sqrt(SEGMENTS), [0.0, 0.0]])
    # The phase condition lies across the motion at the start, which an equilibrium has
    # none of.
    free = list(orbit.free)
    across = np.imag(vector)
    size = made.size
    through = Cycle(
        flow,
        SEGMENTS,
        size,
        period,
        made.values,
        made.fixed,
        orbit.state[free] / size,
        across / max(float(np.linalg.norm(across)), 1e-300),
    )
    return through, base, direction


__all__ = ["ANGLES", "at_hopf", "branched", "doubled", "doubled_cycle", "started"]
