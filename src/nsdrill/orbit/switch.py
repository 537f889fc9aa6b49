"""Branch switching: the first point of a branch that emanates from a period doubling, a
branch point or a Hopf bifurcation of another branch."""

from __future__ import annotations

import math

import numpy as np

from nsdrill.analysis.bifurcations import BRANCH, CYCLE, DOUBLING, EQUILIBRIUM, HOPF, PERIODIC
from nsdrill.orbit.branch import Branch, Key
from nsdrill.orbit.flow import Flow, Task, gather
from nsdrill.orbit.labels import critical_vector
from nsdrill.orbit.newton import Point, Problem, corrected
from nsdrill.orbit.periodic import SEGMENTS, Cycle, Periodic, segment_starts
from nsdrill.orbit.seeds import Candidate, Orders, signatures
from nsdrill.orbit.shooting import Array, Orbit
from nsdrill.orbit.special import LabelledPoint

STEP_LENGTHS = (0.05, 0.2, 0.01)  # from the bifurcation, in natural scales, in order of trial
MAX_CYCLE_SEGMENTS = 4 * SEGMENTS  # of a cycle whose doubling is followed


def emanating(flow: Flow, orders: Orders, key: Key, branch: Branch, entry: LabelledPoint) -> Task[Candidate | None]:
    """The branch that emanates from a special point of a ``branch``; None where none is
    found or asked for. ``key`` ends with the numbers of the branch and of the point."""
    orbit, motion = entry.point.found, branch.motion
    problem: Periodic | Cycle
    if entry.label == HOPF and motion == EQUILIBRIUM and orders.cycles:
        hopf = _hopf(flow, orbit)
        if hopf is None:
            return None
        problem, tasks = hopf[0], [first_point_on(*hopf)]
    elif entry.label == DOUBLING and motion == CYCLE and len(orbit.mesh_states) <= MAX_CYCLE_SEGMENTS:
        doubled = _doubled_cycle(flow, orbit)
        problem, tasks = doubled[0], [first_point_on(*doubled)]
    elif entry.label == DOUBLING and motion == PERIODIC and 2 * branch.lobes <= max(orders.lobes):
        longer = problem = Periodic.at(flow, 2 * branch.lobes, orbit.values, orbit.state)
        tasks = [_switched(longer, orbit, critical_vector(orbit, -1.0))]
    elif entry.label == BRANCH and motion == PERIODIC:
        same = problem = Periodic.at(flow, branch.lobes, orbit.values, orbit.state, len(orbit.mesh_states))
        vector = critical_vector(orbit, 1.0)
        tasks = [_switched(same, orbit, vector), _switched(same, orbit, -vector)]
    else:
        return None
    sides = yield from gather(dict(enumerate(tasks)))
    found = [point for _, point in sorted(sides.items()) if point is not None]
    if not found:
        return None
    point, other = found[0], found[1] if len(found) > 1 else None
    kind = CYCLE if isinstance(problem, Cycle) else PERIODIC, problem.lobes
    own = signatures(flow, kind, point.found)
    return Candidate(key, kind, problem.updated(point.x), point, own, key[-2], key[-1], other is None, other)


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


def _switched(problem: Periodic, orbit: Orbit, vector: Array) -> Task[Point | None]:
    """The first point of ``problem`` away from the orbit, whose start is displaced along
    ``vector`` [free]."""
    states = yield from segment_starts(problem, orbit.state, orbit.values)
    displaced = orbit.state.copy()
    step = 1e-4
    displaced[list(orbit.free)] += step * vector * problem.state_scales
    neighbours = yield from segment_starts(problem, displaced, orbit.values)
    if states is None or neighbours is None:
        return None
    base = problem.unknowns(states, orbit.values[-1])
    direction = (problem.unknowns(neighbours, orbit.values[-1]) - base) / step
    return (yield from first_point_on(problem, base, direction))


def _doubled_cycle(flow: Flow, orbit: Orbit) -> tuple[Cycle, Array, Array]:
    """The problem of the cycles of twice the period that emanate at a doubling of
    cycles, its unknowns there, and their direction."""
    segments, period = len(orbit.mesh_states), 2.0 * orbit.period
    doubled = Cycle.at(flow, period, orbit.values, orbit.state, 2 * segments)
    vector = critical_vector(orbit, -1.0)
    base = doubled.unknowns(np.concatenate([orbit.mesh_states] * 2), period, orbit.values[-1])
    direction, n = np.zeros(len(base)), len(vector)
    direction[:n] = vector
    direction[segments * n : (segments + 1) * n] = -vector
    return doubled, base, direction


def _hopf(flow: Flow, orbit: Orbit) -> tuple[Cycle, Array, Array] | None:
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
    period, vector = 2.0 * math.pi / frequency, vectors[:, nearest]
    cycle = Cycle.at(flow, period, orbit.values, orbit.state)
    states = np.real(vector[None, :] * np.exp(2j * math.pi * np.arange(SEGMENTS) / SEGMENTS)[:, None])
    base = cycle.unknowns(np.tile(orbit.state, (SEGMENTS, 1)), period, orbit.values[-1])
    direction = np.concatenate([states.ravel() / math.sqrt(SEGMENTS), [0.0, 0.0]])
    # The normal of the phase condition is the flow at the start, which vanishes at an
    # equilibrium: that of the emanating cycles is taken.
    return cycle.with_normal(orbit.state, np.imag(vector)), base, direction
