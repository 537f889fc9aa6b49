"""Borders: curves through the special points of branches in two parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE, OWN
from nsdrill.orbit.arclength import Rules, follow
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.curve import Condition, Curve
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.lockstep import Task, advance
from nsdrill.orbit.multipliers import problem_of
from nsdrill.orbit.newton import Point, corrected_at_parameter
from nsdrill.orbit.special import LabelledPoint

DUPLICATE_DISTANCE = 1e-4  # between equal special points, over the range
MAX_SIDE_BY_SIDE = 8  # curves that advance at the same time
# lengths of steps, in natural scales; long ones, as nothing is detected along a curve
FIRST_STEP, MAX_STEP = 0.1, 6.0
MAX_CORRECTION = 0.5  # from a special point to the first point of its curve, in natural scales


@dataclass(frozen=True)
class Border:
    """A curve: the ``label`` of its points, their ``motion`` and period in ``lobes``,
    the ``points`` with values of both parameters, the reasons why it ``ended``, at its
    beginning and at its end, and the number of a ``branch`` that it crosses."""

    label: int
    motion: str
    lobes: int
    points: list[Point]
    ended: tuple[str, str]
    branch: int


@dataclass(frozen=True, eq=False)
class _SpecialPoint:
    """A special point of the ``branch`` of this ``number``."""

    number: int
    branch: Branch
    labelled: LabelledPoint

    @property
    def kind(self) -> tuple[int, str, int]:
        return self.labelled.label, self.branch.motion, self.branch.lobes

    @property
    def value(self) -> float:
        return float(self.labelled.point.found.values[-1])


def borders(
    flows: Callable[[Condition], Flow],
    branches: list[Branch],
    conditions: dict[int, Condition],
    start: float,
    bounds: tuple[tuple[float, float], tuple[float, float]],
    max_points: int,
    poll: Callable[[], None],
) -> list[Border]:
    """The curves through the special points with a label among ``conditions``, one for
    each point that lies on no other curve.

    ``flows(condition)`` is the flow for a condition. Both parameters are free in it,
    first that of the branches; the second has the value ``start`` on the branches.
    ``bounds`` are the ranges of both. ``max_points`` limits each curve. ``poll`` is
    called often, and may raise to stop. Folds and doublings next to a grazing point
    are left out: they belong to the curve of that point.
    """
    tolerance = DUPLICATE_DISTANCE * (bounds[0][1] - bounds[0][0])
    remaining = [
        special
        for number, branch in enumerate(branches)
        for special in _followable(number, branch, conditions, tolerance)
    ]
    found: list[Border] = []
    while remaining:
        remaining = [one for one in remaining if not any(_crosses(line, one, start, tolerance) for line in found)]
        first_of_kind: dict[tuple[int, str, int], _SpecialPoint] = {}
        for special in remaining:
            first_of_kind.setdefault(special.kind, special)
        chosen = [*first_of_kind.values()][:MAX_SIDE_BY_SIDE]
        remaining = [special for special in remaining if special not in chosen]
        tasks: dict[Flow, dict[_SpecialPoint, Task[Border | None]]] = {}
        for special in chosen:
            condition = conditions[special.labelled.label]
            flow = flows(condition)
            tasks.setdefault(flow, {})[special] = _border(flow, special, condition, start, bounds, max_points)
        results: dict[_SpecialPoint, Border | None] = {}
        for flow, of_flow in tasks.items():
            results |= advance(flow, of_flow, poll)
        found += [line for special in chosen if (line := results[special]) is not None]
    return found


def _followable(number: int, branch: Branch, conditions: dict[int, Condition], tolerance: float) -> list[_SpecialPoint]:
    """The special points of a branch that a curve of ``conditions`` can start from."""
    specials = [_SpecialPoint(number, branch, entry) for entry in branch.marked if entry.label]
    grazing = [special.value for special in specials if special.labelled.label > OWN]
    followable = []
    for special in specials:
        condition = conditions.get(special.labelled.label)
        # A point with a note has another number of touches in a period: no extreme
        # value of the contact's function vanishes there.
        if condition is None or special.labelled.words or branch.motion == CIRCLE:
            continue
        if branch.motion == CYCLE and condition.multiplier != 1.0:
            continue
        if condition.of_monodromy and any(abs(special.value - value) < tolerance for value in grazing):
            continue
        followable.append(special)
    return followable


def _crosses(border: Border, special: _SpecialPoint, start: float, tolerance: float) -> bool:
    """Whether a curve passes through a special point, where the second parameter is
    ``start``."""
    if (border.label, border.motion, border.lobes) != special.kind:
        return False
    values = np.array([point.found.values for point in border.points])
    offsets = values[:, 1] - start
    crossings = np.flatnonzero(offsets[:-1] * offsets[1:] <= 0.0)
    for index in crossings:
        rise = offsets[index + 1] - offsets[index]
        fraction = 0.0 if rise == 0.0 else -offsets[index] / rise
        if (
            abs(values[index, 0] + fraction * (values[index + 1, 0] - values[index, 0]) - special.value)
            < 10.0 * tolerance
        ):
            return True
    return False


def _border(
    flow: Flow,
    special: _SpecialPoint,
    condition: Condition,
    start: float,
    bounds: tuple[tuple[float, float], tuple[float, float]],
    max_points: int,
) -> Task[Border | None]:
    """The curve through a special point; None where Newton's method does not lead onto
    it."""
    orbit = special.labelled.point.found
    values = np.array([special.value, start])
    motion = problem_of(flow, special.branch, replace(orbit, values=values))
    problem = Curve.at(motion, orbit, values, condition)
    guess = problem.unknowns(orbit, values)
    seed = yield from corrected_at_parameter(problem, guess)
    if seed is None or np.linalg.norm(seed.x - guess) > MAX_CORRECTION:
        return None
    low, high = np.array(bounds[0]) / flow.scales[0]
    second_low, second_high = np.array(bounds[1]) / flow.scales[1]

    def stop(previous: Point, current: Point) -> str:
        return "" if low <= current.x[-2] <= high else "range"

    rules = Rules((second_low, second_high), max_points // 2, stop=stop, first_step=FIRST_STEP, max_step=MAX_STEP)
    forward = yield from follow(problem, seed, 1, rules)
    remaining = max_points - len(forward.points)
    backward = yield from follow(problem, seed, -1, replace(rules, max_points=remaining))
    before, after = ([entry.point for entry in half.points] for half in (backward, forward))
    line = [*before[::-1], seed, *after]
    return Border(*special.kind, line, (backward.ended, forward.ended), special.number)
