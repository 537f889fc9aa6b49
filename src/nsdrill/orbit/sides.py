"""One side of a branch: followed on more segments where Newton's method fails, until the
motion merges with another or comes back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE, EQUILIBRIUM, PERIODIC
from nsdrill.orbit.arclength import NO_CONVERGENCE, HalfBranch, Rules, follow
from nsdrill.orbit.circle import Circle, circle_stop
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.known import Kind, Known
from nsdrill.orbit.labels import kink_predicate, stability_of, test_functions_of, with_located_touches
from nsdrill.orbit.lockstep import Task
from nsdrill.orbit.newton import Point, corrected_at_parameter
from nsdrill.orbit.periodic import Periodic, lobe_starts, segment_starts
from nsdrill.orbit.seeds import Candidate, Orders
from nsdrill.orbit.shooting import Array

MAX_MULTIPLIER = 1e3  # over one fold, of a motion that can still be followed
MAX_SEGMENTS_PER_LOBE = 8
MAX_RESTART_CHANGE = 1e-3  # of the state where a branch restarts, relative to its largest


@dataclass(frozen=True)
class Side:
    """The ``side`` (1 or -1) of the branch of a ``candidate``, which is followed from
    ``start`` in one ``direction`` (1 or -1 along its tangent)."""

    candidate: Candidate
    side: int
    start: Point
    direction: int


def followed_side(flow: Flow, orders: Orders, known: Known, one: Side) -> Task[HalfBranch]:
    """A side of a branch. Where Newton's method fails, it continues with twice the
    segments. Touches of circles are located on finer ones."""
    motion, lobes = one.candidate.kind
    scale = float(flow.scales[-1])
    # A branch of circles ends where it has a kink, and a circle has no monodromy.
    rules = Rules(
        (orders.bounds[0] / scale, orders.bounds[1] / scale),
        orders.points,
        test_functions_of(orders.grazes, motion),
        _stop(flow, orders, known, one),
        kink_predicate(0 if motion == CIRCLE else len(flow.equations.contacts)),
        None if motion == CIRCLE else stability_of(one.start.found.trivial),
    )
    problem, start = one.candidate.problem, one.start
    half = yield from follow(problem, start, one.direction, rules)
    while (
        isinstance(problem, Periodic)
        and half.ended.startswith(NO_CONVERGENCE)
        and problem.segments < MAX_SEGMENTS_PER_LOBE * lobes
        and (remaining := orders.points - len(half.points) + half.inserted) > 0
    ):
        last = half.points[-1].point if half.points else replace(start, tangent=one.direction * start.tangent)
        problem = replace(problem, segments=2 * problem.segments)
        states = yield from segment_starts(problem, last.found.state, last.found.values)
        if states is None:
            break
        again = yield from corrected_at_parameter(problem, problem.unknowns(states, last.found.values[-1]))
        if again is None or _is_elsewhere(again.found.state, last.found.state):
            continue
        direction = 1 if last.tangent[-1] > 0.0 else -1
        more = yield from follow(problem, again, direction, replace(rules, max_points=remaining))
        if more.points:
            points = half.points + more.shifted(last.s).points
            half = HalfBranch(points, more.ended, half.inserted + more.inserted)
    if isinstance(problem, Circle):
        half = replace(half, points=(yield from with_located_touches(problem, half.points, rules.test_functions)))
    return half


def _is_elsewhere(state: Array, former: Array) -> bool:
    """Whether a restarted motion is another one."""
    return bool(np.max(np.abs(state - former)) > MAX_RESTART_CHANGE * np.max(np.abs(former) + 1e-9))


def _stop(flow: Flow, orders: Orders, known: Known, one: Side) -> Callable[[Point, Point], str]:
    """The stop function of one side of a branch. It ends where it merges with another
    branch (:func:`_merged`), where the motion is too unstable, and where it meets a
    branch (:meth:`.Known.stop`)."""
    branch, kind = one.candidate.key, one.candidate.kind

    def stop(previous: Point, current: Point) -> str:
        if reason := _merged(flow, kind, previous, current):
            return reason
        if known.points_of(branch) > orders.points:
            return "points"
        if kind[0] == PERIODIC and np.max(np.abs(current.found.multipliers)) > MAX_MULTIPLIER ** kind[1]:
            return "wild"
        return known.stop(branch, one.side, current.found)

    return stop


def _merged(flow: Flow, kind: Kind, previous: Point, current: Point) -> str:
    """Why a branch of a ``kind`` ends between two points as it merges with another: a
    motion over an even number of lobes where its halves become equal, a cycle where it
    shrinks to a steady motion. A branch of circles also ends where it loses its
    smoothness."""
    motion, lobes = kind
    if motion == CIRCLE:
        return circle_stop(flow.symmetry, previous, current)
    if motion == EQUILIBRIUM or (motion == PERIODIC and lobes % 2):
        return ""
    before, after = (_difference_of_halves(flow, kind, point) for point in (previous, current))
    is_merged = before @ after < 0.0 and np.linalg.norm(after) < 2.0
    return ("still" if motion == CYCLE else "half") if is_merged else ""


def _difference_of_halves(flow: Flow, kind: Kind, point: Point) -> Array:
    """The state half a period after the start less that at the start, in natural
    scales [free]."""
    orbit, (motion, lobes) = point.found, kind
    free = list(orbit.free)
    starts = orbit.mesh_states[:, free] if motion == CYCLE else lobe_starts(orbit, flow, lobes)
    return np.asarray((starts[len(starts) // 2] - starts[0]) / flow.state_scales(orbit.values)[0][free])
