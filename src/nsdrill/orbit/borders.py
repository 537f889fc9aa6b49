"""Curves through the special points of branches, in a second number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE, OWN
from nsdrill.orbit.arclength import Half, Marked, Point, Steps, Test, follow, settled
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.curve import Condition, Curve, CycleFolds
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.rounds import advance

SAME = 1e-4  # of the range: special points that are closer are one
WAVE = 8  # curves side by side
FIRST, MOST = 0.1, 6.0  # lengths of steps, in natural scales: nothing is to be detected on the way
ASTRAY = 0.5  # in natural scales: how far a curve may begin from its special point


@dataclass(frozen=True)
class Border:
    """A curve: the ``label`` of its points, their ``motion`` and period in ``lobes``,
    the ``points`` with values of both numbers, why it ends, at its beginning and its
    end, and a ``branch`` that it passes."""

    label: int
    motion: str
    lobes: int
    points: list[Point]
    ended: tuple[str, str]
    branch: int


@dataclass(frozen=True)
class _Wanted:
    number: int
    branch: Branch
    point: Marked

    @property
    def kind(self) -> tuple[int, str, int]:
        return self.point.label, self.branch.motion, self.branch.lobes

    @property
    def value(self) -> float:
        return float(self.point.point.found.values[-1])


def borders(
    flows: Callable[[Condition], Flow],
    branches: list[Branch],
    conditions: dict[int, Condition],
    start: float,
    bounds: tuple[tuple[float, float], tuple[float, float]],
    points: int,
    look: Callable[[], None],
) -> list[Border]:
    """The curves through the special points with a label among ``conditions``, one for
    each that lies on none yet.

    ``flows`` gives for a condition the flow that it is followed by. It has both numbers
    free, first that along which the branches were made; the second is ``start`` there.
    ``bounds`` are the ranges of both. Folds and doublings next to a grazing point are
    left out: they go with its curve.
    """
    near = SAME * (bounds[0][1] - bounds[0][0])
    made: list[Border] = []

    def there(one: _Wanted) -> bool:
        return any(
            (border.label, border.motion, border.lobes) == one.kind
            and _crosses(border, one.value, start, near)
            for border in made
        )

    wanted = [
        one
        for number, branch in enumerate(branches)
        for one in _of(number, branch, conditions, near)
    ]
    while wanted:
        chosen: list[_Wanted] = []
        later: list[_Wanted] = []
        for one in wanted:
            if there(one):
                continue
            (
                later
                if len(chosen) >= WAVE or any(other.kind == one.kind for other in chosen)
                else chosen
            ).append(one)
        wanted = later
        groups: dict[Flow, dict[int, Steps[tuple[Half, Point, Half] | None]]] = {}
        for place, one in enumerate(chosen):
            condition = conditions[one.point.label]
            flow = flows(condition)
            groups.setdefault(flow, {})[place] = _both_sides(
                flow, one, condition, start, bounds, points
            )
        results = {
            place: found
            for flow, jobs in groups.items()
            for place, found in advance(flow, jobs, look=look).items()
        }
        for place, one in enumerate(chosen):
            if results[place] is not None:
                back, seed, on = results[place]
                line = (
                    [marked.point for marked in back.points[::-1]]
                    + [seed]
                    + [marked.point for marked in on.points]
                )
                made.append(Border(*one.kind, line, (back.ended, on.ended), one.number))
    return made


def _of(
    number: int, branch: Branch, conditions: dict[int, Condition], near: float
) -> list[_Wanted]:
    """The special points of a branch through which a curve is asked for and can go."""
    every = [_Wanted(number, branch, one) for one in branch.marked if one.label]
    grazing = [one.value for one in every if one.point.label > OWN]
    found = []
    for one in every:
        condition = conditions.get(one.point.label)
        # Of motions that touch more often a contact's function has no extreme value
        # that vanishes.
        if condition is None or one.point.words or branch.motion == CIRCLE:
            continue
        if branch.motion == CYCLE and condition.multiplier != 1.0:
            continue
        if condition.of_monodromy and any(abs(one.value - other) < near for other in grazing):
            continue
        found.append(one)
    return found


def _crosses(border: Border, value: float, start: float, near: float) -> bool:
    """Whether a curve passes ``value`` of the first number where the second is
    ``start``."""
    numbers = np.array([point.found.values for point in border.points])
    side = numbers[:, 1] - start
    at = np.flatnonzero(side[:-1] * side[1:] <= 0.0)
    for place in at:
        rise = side[place + 1] - side[place]
        share = 0.0 if rise == 0.0 else -side[place] / rise
        if (
            abs(numbers[place, 0] + share * (numbers[place + 1, 0] - numbers[place, 0]) - value)
            < 10.0 * near
        ):
            return True
    return False


def _both_sides(
    flow: Flow,
    one: _Wanted,
    condition: Condition,
    start: float,
    bounds: tuple[tuple[float, float], tuple[float, float]],
    points: int,
) -> Steps[tuple[Half, Point, Half] | None]:
    orbit = one.point.point.found
    values = np.array([one.value, start])
    problem: Curve | CycleFolds
    if one.branch.motion == CYCLE:
        problem = CycleFolds.at(flow, orbit, values)
        guess = problem.unknowns(orbit.pieces, orbit.period, values)
    else:
        problem = Curve.at(flow, one.branch.lobes, orbit, values, condition)
        guess = problem.unknowns(orbit.pieces, values)
    seed = yield from settled(problem, guess)
    if seed is None or np.linalg.norm(seed.x - guess) > ASTRAY:
        return None
    (low, high), other = (
        tuple(np.array(bound) / scale) for bound, scale in zip(bounds, flow.scales, strict=True)
    )

    def stop(here: Point, there: Point) -> str:
        return "" if low <= there.x[-2] <= high else "range"

    def none(here: Point, there: Point) -> list[Test]:
        return []

    on = yield from follow(problem, seed, 1, other, points // 2, none, stop, first=FIRST, most=MOST)
    left = points - len(on.points)
    back = yield from follow(problem, seed, -1, other, left, none, stop, first=FIRST, most=MOST)
    return back, seed, on
