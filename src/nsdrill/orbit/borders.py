"""Curves through the special points of branches, in a second number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nsdrill.analysis.bifurcations import PERIODIC
from nsdrill.orbit.arclength import Half, Marked, Point, Steps, Test, follow, settled
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.curve import Condition, Curve
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.rounds import advance

SAME = 1e-4  # of the range: special points that are closer are one
WAVE = 8  # curves side by side
MOST = 1.5  # length of a step, in natural sizes


@dataclass(frozen=True)
class Border:
    """A curve: the ``label`` of its points, their period in ``lobes``, the ``points`` with values of both numbers, and
    why it ends, at its beginning and its end."""

    label: int
    lobes: int
    points: list[Point]
    ended: tuple[str, str]
    branch: int


def borders(
    flow: Flow,
    branches: list[Branch],
    conditions: dict[int, Condition],
    start: float,
    bounds: tuple[tuple[float, float], tuple[float, float]],
    points: int,
    look: Callable[[], None],
) -> list[Border]:
    """The curves through the special points with a label among ``conditions``, one for each that lies on none yet.

    ``flow`` has both numbers free, first that along which the branches were made; the second is ``start`` there.
    ``bounds`` are the ranges of both.
    """
    scales = flow.scales
    low, high = bounds[0][0] / scales[0], bounds[0][1] / scales[0]
    wanted = []
    for number, branch in enumerate(branches):
        if branch.motion != PERIODIC:
            continue
        for one in branch.marked:
            if one.label in conditions and not one.words:
                wanted.append((number, branch, one))
    made: list[Border] = []

    def there(label: int, lobes: int, value: float) -> bool:
        near = SAME * (bounds[0][1] - bounds[0][0])
        return any(
            border.label == label and border.lobes == lobes and _crosses(border, value, start, near) for border in made
        )

    while wanted:
        chosen: list[tuple[int, Branch, Marked]] = []
        later: list[tuple[int, Branch, Marked]] = []
        for number, branch, one in wanted:
            value = float(one.point.found.values[-1])
            if there(one.label, branch.lobes, value):
                continue
            if len(chosen) >= WAVE or any(
                other.label == one.label and held.lobes == branch.lobes for _, held, other in chosen
            ):
                later.append((number, branch, one))
            else:
                chosen.append((number, branch, one))
        wanted = later
        jobs = {}
        for number, branch, one in chosen:
            values = np.array([one.point.found.values[-1], start])
            problem = Curve.at(flow, branch.lobes, one.point.found, values, conditions[one.label])
            jobs[number, one.point.s] = _both_sides(problem, one, values, (low, high), bounds[1], points)
        results = advance(flow, jobs, look=look)
        for number, branch, one in chosen:
            found = results[number, one.point.s]
            if found is not None:
                back, seed, on = found
                line = [one_.point for one_ in back.points[::-1]] + [seed] + [one_.point for one_ in on.points]
                made.append(Border(one.label, branch.lobes, line, (back.ended, on.ended), number))
    return made


def _crosses(border: Border, value: float, start: float, near: float) -> bool:
    """Whether a curve passes ``value`` of the first number where the second is ``start``."""
    numbers = np.array([point.found.values for point in border.points])
    side = numbers[:, 1] - start
    at = np.flatnonzero(side[:-1] * side[1:] <= 0.0)
    for place in at:
        rise = side[place + 1] - side[place]
        share = 0.0 if rise == 0.0 else -side[place] / rise
        if abs(numbers[place, 0] + share * (numbers[place + 1, 0] - numbers[place, 0]) - value) < 10.0 * near:
            return True
    return False


def _both_sides(
    problem: Curve,
    one: Marked,
    values: np.ndarray,
    range_: tuple[float, float],
    bounds: tuple[float, float],
    points: int,
) -> Steps[tuple[Half, Point, Half] | None]:
    pieces = one.point.found.pieces
    assert pieces is not None
    seed = yield from settled(problem, problem.unknowns(pieces, values))
    if seed is None or np.linalg.norm(seed.x - problem.unknowns(pieces, values)) > 0.5:
        return None

    def stop(here: Point, there: Point) -> str:
        return "" if range_[0] <= there.x[-2] <= range_[1] else "range"

    def none(here: Point, there: Point) -> list[Test]:
        return []

    scale = problem.flow.scales[1]
    limits = (bounds[0] / scale, bounds[1] / scale)
    # There is nothing to detect on the way, so steps are longer than along a branch.
    on = yield from follow(problem, seed, 1, limits, points // 2, none, stop, most=MOST)
    back = yield from follow(problem, seed, -1, limits, points // 2, none, stop, most=MOST)
    return back, seed, on
