"""Pseudo-arclength continuation (Keller 1977) of the zeros of a residual in one
parameter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nsdrill.data import Array
from nsdrill.orbit.flow import Task, gather
from nsdrill.orbit.newton import (
    Point,
    Problem,
    corrected,
    corrected_between,
    orientation_of,
    parameter_normal,
    tangent_of,
)
from nsdrill.orbit.shooting import Orbit
from nsdrill.orbit.special import (
    ELSEWHERE,
    LOCATION_TOLERANCE,
    LabelledPoint,
    Stability,
    TestFunctions,
    instability_interval,
    special_points,
    stencil_around,
)
from nsdrill.records import dataclass

# lengths of continuation steps, in natural scales
FIRST_STEP, MAX_STEP, MIN_STEP = 0.02, 0.3, 1e-6
GROWTH = 1.3  # of a step after few iterations
RECOVERY_GROWTH = 2.0  # the same while the step is shorter than the first one
FEW_ITERATIONS = 4
MIN_COSINE = 0.5  # between the tangents of neighbouring points
DUPLICATE_DISTANCE = 1e-5  # between equal special points, in natural scales
CORNER_STEP = 1e-5  # a shorter step starts the search for a corner
# lengths of the first step beyond a corner
STEPS_BEYOND_CORNER = (3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
# between the tangent at the end of that step and its chord, or the tangent after the
# next shorter step
STRAIGHT_COSINE = 0.95
NEAR_BRANCH_POINT = 0.01  # of a step: so near to a branch point Newton's method may fail
NO_CONVERGENCE = "no convergence"  # how the reason begins where a branch is lost
HALF = "half"  # the reason where a branch joins the motion of half its period
LEAP = "Newton's method leaps to another branch"
SHORTER = "Newton's method leaps to a motion of a shorter period"
MET = "met"  # the reason where a branch meets its own other side
KNOWN = "known"  # and where it meets another one
# Of a problem and the last point of a branch: the point that it reaches next, if that is
# also one of its other side, or its beginning, which is the third argument; else None.
Meeting = Callable[[Problem, Point], Task[Point | None]]
Return = Callable[[Problem, Point, Point], Task[Point | None]]
Confirmation = Callable[[Problem, Point], Task[bool]]
# Of a problem and two points between which a step leads: what it does beside going on.
Crossing = Callable[[Problem, Point, Point], Task[str]]


@dataclass(frozen=True)
class HalfBranch:
    """One side of a branch from its seed: the ``points`` after the seed, the reason
    why it ``ended``, and how many of the points were ``inserted`` for intervals of
    instability narrower than a step."""

    points: list[LabelledPoint]
    ended: str
    inserted: int = 0

    def shifted(self, distance: float) -> HalfBranch:
        """The same with arclengths that are greater by a ``distance``."""
        points = [replace(entry, point=replace(entry.point, s=distance + entry.point.s)) for entry in self.points]
        return replace(self, points=points)


@dataclass(frozen=True)
class Rules:
    """How a branch is followed: within ``bounds`` of the parameter, by at most
    ``max_points``, looking for zeros of ``test_functions``, until ``stop`` of two
    neighbouring points returns a reason.

    Where that reason is ``MET`` and there is a ``meeting``, the branch ends only where
    that finds the common point; where it is ``KNOWN``, only if ``is_known`` confirms it.
    With ``returns``, a branch that passes near its beginning ends only where that finds
    it there again. ``crossing`` of a step says ``HALF`` where the branch joins the motion of
    half its period between its points, and ends, ``LEAP`` or ``SHORTER`` where the second is on
    another branch, and the step is refused, and "" where it goes on.

    ``has_kink`` of the solutions of two points says whether a kink of the equations
    lies between them, at which the branch may have a corner. Without ``corners``, as on
    circles, which end at kinks, neither these nor arms side by side are looked for. With
    ``stability`` intervals of instability that are narrower than a step are searched
    for."""

    bounds: tuple[float, float]
    max_points: int
    test_functions: TestFunctions = lambda previous, current: []
    stop: Callable[[Point, Point], str] = lambda previous, current: ""
    meeting: Meeting | None = None
    is_known: Confirmation | None = None
    crossing: Crossing | None = None
    returns: Return | None = None
    has_kink: Callable[[Orbit, Orbit], bool] = lambda previous, current: False
    stability: Stability | None = None
    first_step: float = FIRST_STEP
    max_step: float = MAX_STEP
    corners: bool = True


def follow(problem: Problem, start: Point, direction: int, rules: Rules) -> Task[HalfBranch]:
    """Follow the branch through ``start`` in one ``direction`` (1 or -1 along its
    tangent) until the parameter leaves its bounds, the rules stop it, the branch closes,
    Newton's method fails, or as many points are reached as the rules allow."""
    steps: list[tuple[Problem, Point]] = []
    half = yield from _followed(problem, start, direction, rules, steps)
    if rules.stability is None or not half.points:
        return half
    # After all steps, as those of other branches may depend on the points of this one.
    nodes = [LabelledPoint(steps[0][1]), *half.points]
    searches, step = {}, 0
    for place in range(len(nodes) - 1):
        while step + 1 < len(steps) and steps[step + 1][1].s <= nodes[place].point.s:
            step += 1
        point, following = nodes[place].point, nodes[place + 1].point
        # Beyond a corner the monodromy is not that before, continued.
        if following.s - point.s > MIN_STEP and point.tangent @ following.tangent > MIN_COSINE:
            stencil = stencil_around(nodes, place)
            searches[place] = instability_interval(*steps[step], *stencil, rules.test_functions, rules.stability)
    intervals = yield from gather(searches)
    points = list(half.points)
    for place in searches:
        points += [entry for entry in intervals[place] if not _is_among(entry, points)]
    return HalfBranch(sorted(points, key=lambda entry: entry.point.s), half.ended, len(points) - len(half.points))


def _is_among(entry: LabelledPoint, points: list[LabelledPoint]) -> bool:
    return any(
        entry.label == other.label and np.max(np.abs(entry.point.x - other.point.x)) < DUPLICATE_DISTANCE
        for other in points
    )


def _followed(
    problem: Problem, start: Point, direction: int, rules: Rules, steps: list[tuple[Problem, Point]]
) -> Task[HalfBranch]:
    """The steps of :func:`follow`. Appends the problem and the point from which each
    sets out to ``steps``."""
    previous = replace(start, tangent=direction * start.tangent, s=0.0, orientation=direction * start.orientation)
    origin, points = previous, list[LabelledPoint]()
    length, has_left = rules.first_step, False
    steps.append((problem, previous))
    while len(points) < rules.max_points:
        step = yield from _step(problem, previous, length, rules)
        if isinstance(step, str):
            return HalfBranch(points, f"{NO_CONVERGENCE}: {step}")
        current, length = step.end, step.length
        if step.edge is not None:
            points += [
                LabelledPoint(step.edge, test.code, test.words) for test in rules.test_functions(previous, current)
            ]
            previous = step.edge
            steps.append((problem, previous))
        if step.joins:
            return HalfBranch(points, step.joins)
        reason, common = rules.stop(previous, current), None
        if reason == KNOWN and rules.is_known is not None and not (yield from rules.is_known(problem, current)):
            reason = ""  # it only passes near another one
        if reason == MET and rules.meeting is not None:
            # What only passes near the other side goes on.
            reason, common = "", (yield from rules.meeting(problem, current))
        if reason:
            return HalfBranch(points, reason)
        distance = float(np.linalg.norm(current.x - origin.x))
        has_left = has_left or distance > 4.0 * MAX_STEP
        is_back = has_left and distance < 1.5 * length and _passes_through(previous, current, origin)
        if is_back and rules.returns is not None and not step.bound:
            back = yield from rules.returns(problem, previous, origin)
            is_back, current = back is not None, back or current
        # the special points at a corner are already in the list
        if not (points and points[-1].point is previous and points[-1].label):
            points += yield from special_points(problem, previous, current, rules.test_functions)
        points.append(LabelledPoint(current))
        if common is not None:
            steps.append((problem, current))
            points += yield from special_points(problem, current, common, rules.test_functions)
            return HalfBranch([*points, LabelledPoint(common)], MET)
        if step.bound:
            return HalfBranch(points, step.bound)
        if is_back:
            return HalfBranch(points, "closed")
        if (turn := _turn([point for _, point in steps], current)) is not None:
            return HalfBranch([entry for entry in points if entry.point.s < turn], "turned")
        problem, previous = problem.updated(current.x), current
        steps.append((problem, previous))
        if current.iterations <= FEW_ITERATIONS:
            length = min(length * (GROWTH if length > rules.first_step else RECOVERY_GROWTH), rules.max_step)
    return HalfBranch(points, "points")


@dataclass(frozen=True)
class _Step:
    """A step to the point ``end``: its ``length``; the last point before a corner that
    it goes around, ``edge``; the ``bound`` of the parameter that it ends at, "from"
    or "to"; and ``HALF`` where the branch ``joins`` the motion of half its period before."""

    end: Point
    length: float
    edge: Point | None = None
    bound: str = ""
    joins: str = ""


def _step(problem: Problem, previous: Point, length: float, rules: Rules) -> Task[_Step | str]:
    """The step from ``previous`` of the greatest length, up to ``length``, that leads to
    a point; the reason where none does."""
    (low, high), edge, failure = rules.bounds, None, ""
    while length >= MIN_STEP:
        current, failure = yield from _stepped(problem, previous, length, rules)
        is_short = rules.corners and length < CORNER_STEP
        if is_short and (current is None or rules.has_kink(previous.found, current.found)):
            corner = yield from _around_corner(problem, previous, length, rules)
            if corner is not None:
                edge, current = corner
                previous = edge
        if current is not None and rules.crossing is not None:
            crossing = yield from rules.crossing(problem, previous, current)
            if crossing == HALF:
                return _Step(current, length, edge, joins=HALF)
            if crossing:
                current, failure = None, crossing
        if current is not None and low <= current.x[-1] <= high:
            return _Step(current, length, edge)
        if current is not None:
            failure = "the end of the range is not reached"
            bound, name = (low, "from") if current.x[-1] < low else (high, "to")
            current = yield from _point_at_bound(problem, previous, current, bound)
            if current is not None:
                return _Step(current, length, edge, name)
        length /= 2.0
    return failure


def _passes_through(previous: Point, current: Point, origin: Point) -> bool:
    """Whether the branch passes through ``origin`` between these points."""
    chord = current.x - previous.x
    fraction = float((origin.x - previous.x) @ chord / (chord @ chord))
    offset = np.linalg.norm(origin.x - previous.x - fraction * chord)
    return 0.0 <= fraction <= 1.0 and offset < 0.2 * np.linalg.norm(chord) and float(origin.tangent @ chord) > 0.0


def _turn(points: list[Point], current: Point) -> float | None:
    """The arclength at which the branch through ``points`` has turned, where ``current``
    lies on an earlier part of it, followed the other way; None where it does not. Cubics
    through neighbouring points with their tangents tell."""
    earlier = [point for point in points if current.s - point.s > 2.0 * MAX_STEP]
    if len(earlier) < 2:
        return None
    x, tangents = np.stack([point.x for point in earlier]), np.stack([point.tangent for point in earlier])
    chords = np.diff(x, axis=0)
    lengths = np.maximum(np.linalg.norm(chords, axis=1, keepdims=True), 1e-150)
    u = np.sum((current.x - x[:-1]) * chords, axis=1, keepdims=True) / lengths**2
    bends = (1.0 - u) * (lengths * tangents[:-1] - chords) - u * (lengths * tangents[1:] - chords)
    offsets = np.linalg.norm(x[:-1] + u * chords + u * (1.0 - u) * bends - current.x, axis=1)
    is_met = (np.abs(u[:, 0] - 0.5) <= 0.5) & (offsets < DUPLICATE_DISTANCE) & (chords @ current.tangent < 0.0)
    return 0.5 * (current.s + earlier[int(np.argmax(is_met))].s) if is_met.any() else None


def _stepped(problem: Problem, previous: Point, length: float, rules: Rules) -> Task[tuple[Point | None, str]]:
    """The point after a step of this ``length``, or why there is none."""
    tangent = previous.tangent
    current = yield from corrected(problem, previous.x + length * tangent, tangent, tangent, previous)
    if current is None:
        return None, "Newton's method"
    # Steps are that short only beside a kink.
    is_corner = length < CORNER_STEP or rules.has_kink(previous.found, current.found)
    is_reversed = rules.corners and current.orientation != previous.orientation
    if (is_corner and is_reversed) or current.tangent @ previous.tangent < MIN_COSINE:
        return None, "the branch turns too sharply"
    leaps = np.linalg.norm(current.x - previous.x) > 3.0 * length
    if leaps or (is_reversed and not (yield from _crosses_branch_point(problem, previous, current))):
        return None, LEAP
    return current, ""


def _crosses_branch_point(problem: Problem, previous: Point, current: Point) -> Task[bool]:
    """Whether the branch goes on from ``previous`` to ``current``, between which the
    orientation changes: at a branch point the points on both sides of the change come
    near each other. Those on two arms of a branch that lie side by side do not: from
    there the branch would be followed back."""
    a, b, low, high = previous, current, 0.0, float(previous.tangent @ (current.x - previous.x))
    near = NEAR_BRANCH_POINT * high
    while high - low > CORNER_STEP:
        if np.linalg.norm(b.x - a.x) > 3.0 * (high - low):
            return False
        distances = tuple(low + share * (high - low) for share in (0.5, *ELSEWHERE))
        found = yield from corrected_between(problem, previous, a, b, distances)
        if found is None:
            return high - low < near
        if found[1].orientation == previous.orientation:
            low, a = found
        else:
            high, b = found
    return True


def _around_corner(problem: Problem, previous: Point, length: float, rules: Rules) -> Task[tuple[Point, Point] | None]:
    """The last point before a corner within the distance ``length``, and a first one
    beyond it; None where no corner is found.

    At a kink of the equations the tangent changes by any angle within a distance that
    no step resolves: a contact changes the derivatives by the square root of its
    depth. The Jacobian beyond gives the new tangent up to its sign; the sign follows
    from the determinant, which changes only at branch points. Of the steps that end
    where the branch is straight again, the shortest is taken.
    """
    edge, near, far = previous, 0.0, length
    while far - near > LOCATION_TOLERANCE:
        middle = 0.5 * (near + far)
        point, _ = yield from _stepped(problem, previous, middle, rules)
        if point is None or rules.has_kink(previous.found, point.found):
            far = middle
        else:
            edge, near = point, middle
    best: Point | None = None
    for step in STEPS_BEYOND_CORNER:
        current = yield from _beyond_corner(problem, edge, step, rules)
        if best is not None and (current is None or current.tangent @ best.tangent < STRAIGHT_COSINE):
            break
        best = current
    return None if best is None else (edge, best)


def _beyond_corner(problem: Problem, edge: Point, step: float, rules: Rules) -> Task[Point | None]:
    """The point at the distance ``step`` from the last one before a corner, where the
    branch is straight again."""
    tangent_guess = edge.tangent
    for _ in range(4):  # the Jacobian depends on how far it is beyond the kink
        evaluation = yield from problem.evaluate(edge.x + step * tangent_guess)
        tangent = None if evaluation is None else tangent_of(evaluation.jacobian, tangent_guess)
        if evaluation is None or tangent is None:
            return None
        tangent_guess = tangent * edge.orientation * orientation_of(evaluation.jacobian, tangent)
        if not _is_beyond(edge, tangent_guess, evaluation.solution(), rules):
            return None
        point = yield from corrected(problem, edge.x + step * tangent_guess, tangent_guess, tangent_guess, edge)
        if point is not None:
            chord = point.x - edge.x
            length = float(np.linalg.norm(chord))
            is_straight = length < 3.0 * step and chord @ point.tangent > STRAIGHT_COSINE * length
            is_on = is_straight and point.orientation == edge.orientation
            return point if is_on and _is_beyond(edge, point.tangent, point.found, rules) else None
    return None


def _is_beyond(edge: Point, tangent: Array, found: Orbit, rules: Rules) -> bool:
    """Whether a solution with this ``tangent`` lies beyond the corner after ``edge``:
    beyond a kink or, where that was passed before, where the branch is turning."""
    return rules.has_kink(edge.found, found) or bool(tangent @ edge.tangent < STRAIGHT_COSINE)


def _point_at_bound(problem: Problem, previous: Point, current: Point, bound: float) -> Task[Point | None]:
    fraction = (bound - previous.x[-1]) / (current.x[-1] - previous.x[-1])
    guess = previous.x + fraction * (current.x - previous.x)
    guess[-1] = bound
    point = yield from corrected(problem, guess, parameter_normal(len(guess)), previous.tangent, previous)
    if point is None or np.linalg.norm(point.x - previous.x) > 3.0 * np.linalg.norm(current.x - previous.x):
        return None
    return point
