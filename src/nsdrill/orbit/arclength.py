"""Pseudo-arclength continuation (Keller 1977) of the zeros of a residual in one
parameter.

A problem has m equations in m + 1 unknowns, all in natural scales; the last unknown is
the continuation parameter. Evaluating it takes pieces of trajectories: the functions
here are generators that yield legs and are sent their ends, so that many branches
advance side by side and the legs of one round run in one batch
(:func:`nsdrill.orbit.lockstep.advance`). Nothing here depends on what the legs stand
for.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from nsdrill.orbit.flow import Ends, Legs
from nsdrill.orbit.linear import sign_of_determinant, solve
from nsdrill.orbit.lockstep import gather

Array = np.ndarray[Any, np.dtype[np.float64]]
T = TypeVar("T")
Task = Generator[Legs, Ends, T]
HasKink = Callable[[Any, Any], bool]
Margins = Callable[[Any], Array]

# lengths of continuation steps, in natural scales
FIRST_STEP, MAX_STEP, MIN_STEP = 0.02, 0.3, 1e-6
GROWTH = 1.3  # of a step after few iterations
RECOVERY_GROWTH = 2.0  # the same while the step is shorter than the first one
FEW_ITERATIONS, MAX_ITERATIONS = 4, 9
# lengths of steps of Newton's method, in natural scales
NEWTON_TOLERANCE, STALLED_TOLERANCE, MAX_NEWTON_STEP = 1e-8, 1e-5, 3000.0
MIN_COSINE = 0.5  # between the tangents of neighbouring points
DUPLICATE_DISTANCE = 1e-5  # between equal special points, in natural scales
LOCATION_TOLERANCE = 1e-8  # of the arclength of a special point
RESIDUAL_NOISE = 1e-7  # due to the steps of the integration, in natural scales
CORNER_STEP = 1e-5  # a shorter step starts the search for a corner
# lengths of the first step beyond a corner
STEPS_BEYOND_CORNER = (3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
# between the tangent at the end of that step and its chord, or the tangent after the
# next shorter step
STRAIGHT_COSINE = 0.95
MAX_HALVINGS = 6  # in the search for an interval of instability
MAX_MARGIN_RATIO = 4.0  # of a margin to its change between points
MAX_MARGIN_CHANGE = 0.5  # of a margin between points


@dataclass(frozen=True)
class Evaluation:
    """A problem at ``x``: ``residual`` [m], ``jacobian`` [m, m + 1]; ``solution()``
    returns what :attr:`Point.found` holds."""

    residual: Array
    jacobian: Array
    solution: Callable[[], Any]


class Problem(Protocol):
    """A residual with one free parameter. ``tolerance_factor`` is the factor by which
    its noise exceeds that of the tolerance of the flow."""

    @property
    def tolerance_factor(self) -> float: ...

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        """Residual and Jacobian at ``x`` [m + 1]; None where the legs fail."""
        ...

    def updated(self, x: Array) -> Problem:
        """The problem for the points after ``x``, whose phase condition may refer to
        it."""
        ...


@dataclass(frozen=True)
class Point:
    """A point of a branch: the unknowns ``x`` [m + 1]; the unit ``tangent`` [m + 1];
    the solution that was ``found``, such as the orbit; the ``iterations`` of Newton's
    method and the ``residual`` after them; the arclength ``s``; and ``orientation``,
    the sign of the determinant of the Jacobian bordered by the tangent, which changes
    only at branch points."""

    x: Array
    tangent: Array
    found: Any
    iterations: int
    residual: float
    s: float = 0.0
    orientation: float = 0.0


def tangent_of(jacobian: Array, reference: Array) -> Array | None:
    """The unit null vector of ``jacobian`` [m, m + 1] whose product with ``reference``
    is positive; None where the null space has more dimensions."""
    m = len(jacobian)
    system = np.vstack([jacobian, reference])
    try:
        vector = solve(system, np.concatenate([np.zeros(m), [1.0]]))
    except np.linalg.LinAlgError:
        vector = np.linalg.svd(jacobian)[2][-1]
    length = np.linalg.norm(vector)
    return vector / length if np.isfinite(length) and length > 0 else None


def newton(
    problem: Problem, guess: Array, normal: Array
) -> Task[tuple[Array, Evaluation, int, float] | None]:
    """The zero of ``problem`` in the plane through ``guess`` with this ``normal``, by
    Newton's method: (x, evaluation, iterations, residual). None where it does not
    converge.

    It stops at a step below ``NEWTON_TOLERANCE``, or where a step below
    ``STALLED_TOLERANCE`` no longer shrinks and the residual is below
    ``RESIDUAL_NOISE``: the steps of the integration leave noise, which large
    multipliers amplify.
    """
    x, previous_size = guess, np.inf
    for iteration in range(1, MAX_ITERATIONS + 1):
        evaluation = yield from problem.evaluate(x)
        if evaluation is None:
            return None
        residual = float(np.max(np.abs(evaluation.residual)))
        system = np.vstack([evaluation.jacobian, normal])
        try:
            step = solve(system, -np.concatenate([evaluation.residual, [normal @ (x - guess)]]))
        except np.linalg.LinAlgError:
            return None
        step_size = float(np.max(np.abs(step)))
        if not np.isfinite(step_size) or step_size > MAX_NEWTON_STEP:
            return None
        factor = problem.tolerance_factor
        if step_size < factor * NEWTON_TOLERANCE or (
            step_size < factor * STALLED_TOLERANCE
            and step_size >= 0.5 * previous_size
            and residual < factor * RESIDUAL_NOISE
        ):
            return x, evaluation, iteration, residual
        if iteration > 3 and step_size > 2.0 * previous_size:
            return None
        x, previous_size = x + step, step_size
    return None


def corrected(
    problem: Problem, guess: Array, normal: Array, reference: Array, origin: Point | None = None
) -> Task[Point | None]:
    """The point of the branch in the plane through ``guess`` with this ``normal``. Its
    tangent has a positive product with ``reference``; its arclength counts on from
    ``origin``. None where Newton's method does not converge, or where the tangent is
    not unique."""
    solution = yield from newton(problem, guess, normal)
    if solution is None:
        return None
    x, evaluation, iterations, residual = solution
    tangent = tangent_of(evaluation.jacobian, reference)
    if tangent is None:
        return None
    s = 0.0 if origin is None else origin.s + float(np.linalg.norm(x - origin.x))
    return Point(
        x,
        tangent,
        evaluation.solution(),
        iterations,
        residual,
        s,
        _orientation(evaluation.jacobian, tangent),
    )


def _orientation(jacobian: Array, tangent: Array) -> float:
    return sign_of_determinant(np.vstack([jacobian, tangent]))


def _parameter_normal(length: int) -> Array:
    """The normal of the planes of constant continuation parameter."""
    return np.eye(length)[-1]


def corrected_at_parameter(problem: Problem, guess: Array) -> Task[Point | None]:
    """The zero of ``problem`` near ``guess`` at the same value of the continuation
    parameter."""
    normal = _parameter_normal(len(guess))
    return (yield from corrected(problem, guess, normal, normal))


@dataclass(frozen=True)
class TestFunction:
    """A test function of the special point with the label ``code``: ``value`` of a
    point changes its sign there. It ``jumps`` where it has only a sign. ``words`` say
    what the label leaves open."""

    code: int
    value: Callable[[Point], float]
    words: str = ""
    jumps: bool = False


@dataclass(frozen=True)
class LabelledPoint:
    """A point of a branch with its label, 0 for none, and its note in ``words``."""

    point: Point
    label: int = 0
    words: str = ""


TestFunctions = Callable[[Point, Point], list[TestFunction]]


@dataclass(frozen=True)
class HalfBranch:
    """One side of a branch from its seed: the ``points`` after the seed, the reason
    why it ``ended``, and how many of the points were ``inserted`` for intervals of
    instability narrower than a step."""

    points: list[LabelledPoint]
    ended: str
    inserted: int = 0


IntervalCandidate = tuple[tuple[Problem, Point], tuple[Problem, Point], Point]


def follow(
    problem: Problem,
    start: Point,
    direction: int,
    bounds: tuple[float, float],
    max_points: int,
    test_functions: TestFunctions,
    stop: Callable[[Point, Point], str] = lambda previous, current: "",
    *,
    first_step: float = FIRST_STEP,
    max_step: float = MAX_STEP,
    has_kink: HasKink = lambda previous, current: False,
    margins: Margins | None = None,
) -> Task[HalfBranch]:
    """Follow the branch through ``start`` in one ``direction`` (1 or -1 along its
    tangent) until the parameter leaves ``bounds``, ``stop`` of two neighbouring points
    returns a reason, the branch closes, Newton's method fails, or ``max_points`` are
    reached.

    ``has_kink`` of the solutions of two points says whether a kink of the equations
    lies between them, at which the branch may have a corner. ``margins`` of a solution
    change their sign at special points: where one comes close to zero, an interval
    of instability narrower than a step is searched for."""
    candidates: list[IntervalCandidate] = []

    def may_cross(a: Point, b: Point, c: Point) -> bool:
        return (
            margins is not None
            and _closest_margin(*(margins(entry.found) for entry in (a, b, c))) is not None
        )

    arguments = (max_points, test_functions, stop, first_step, max_step, has_kink)
    half = yield from _follow_steps(
        problem, start, direction, bounds, *arguments, may_cross, candidates
    )
    if margins is None or not candidates:
        return half
    # After all steps, as those of other branches may depend on the points of this one.
    intervals = yield from gather(
        [_instability_interval(*entry, test_functions, margins) for entry in candidates]
    )
    points = list(half.points)
    for entry in (entry for interval in intervals for entry in interval):
        if not any(
            entry.label == other.label
            and np.max(np.abs(entry.point.x - other.point.x)) < DUPLICATE_DISTANCE
            for other in points
        ):
            points.append(entry)
    return HalfBranch(
        sorted(points, key=lambda entry: entry.point.s), half.ended, len(points) - len(half.points)
    )


def _follow_steps(
    problem: Problem,
    start: Point,
    direction: int,
    bounds: tuple[float, float],
    max_points: int,
    test_functions: TestFunctions,
    stop: Callable[[Point, Point], str],
    first_step: float,
    max_step: float,
    has_kink: HasKink,
    may_cross: Callable[[Point, Point, Point], bool],
    candidates: list[IntervalCandidate],
) -> Task[HalfBranch]:
    """The steps of :func:`follow`. Appends to ``candidates`` where an interval of
    instability may lie."""
    previous = replace(
        start, tangent=direction * start.tangent, s=0.0, orientation=direction * start.orientation
    )
    origin, points = previous, list[LabelledPoint]()
    last_two: tuple[tuple[Problem, Point], ...] = ((problem, previous),)  # no corner between
    step, has_left = first_step, False
    failure = ""
    while len(points) < max_points:
        current = None
        while current is None:
            if step < MIN_STEP:
                return HalfBranch(points, f"no convergence: {failure}")
            current, failure = yield from _stepped(problem, previous, step, has_kink)
            if step < CORNER_STEP and (current is None or has_kink(previous.found, current.found)):
                corner = yield from _around_corner(problem, previous, step, has_kink)
                if corner is not None:
                    edge, current = corner
                    points += [
                        LabelledPoint(edge, test.code, test.words)
                        for test in test_functions(previous, current)
                    ]
                    previous, last_two = edge, ()
            if current is None:
                step /= 2.0
        outside = (
            0 if bounds[0] <= current.x[-1] <= bounds[1] else -1 if current.x[-1] < bounds[0] else 1
        )
        if outside:
            bound = bounds[0] if outside < 0 else bounds[1]
            at_bound = yield from _point_at_bound(problem, previous, current, bound)
            if at_bound is None:
                step /= 2.0
                if step < MIN_STEP:
                    return HalfBranch(points, "no convergence: the end of the range is not reached")
                continue
            current = at_bound
        if reason := stop(previous, current):
            return HalfBranch(points, reason)
        # the special points at a corner are already in the list
        if not (points and points[-1].point is previous and points[-1].label):
            points += yield from special_points(problem, previous, current, test_functions)
        points.append(LabelledPoint(current))
        if len(last_two) == 2 and may_cross(last_two[0][1], last_two[1][1], current):
            candidates.append((*last_two, current))
        if outside:
            return HalfBranch(points, "from" if outside < 0 else "to")
        distance = float(np.linalg.norm(current.x - origin.x))
        has_left = has_left or distance > 4.0 * MAX_STEP
        if has_left and distance < 1.5 * step and _passes_through(previous, current, origin):
            return HalfBranch(points, "closed")
        problem, previous = problem.updated(current.x), current
        last_two = (*last_two[-1:], (problem, previous))
        if current.iterations <= FEW_ITERATIONS:
            step = min(step * (GROWTH if step > first_step else RECOVERY_GROWTH), max_step)
    return HalfBranch(points, "points")


def _passes_through(previous: Point, current: Point, origin: Point) -> bool:
    """Whether the branch passes through ``origin`` between these points."""
    chord = current.x - previous.x
    fraction = float((origin.x - previous.x) @ chord / (chord @ chord))
    offset = np.linalg.norm(origin.x - previous.x - fraction * chord)
    return (
        0.0 <= fraction <= 1.0
        and offset < 0.2 * np.linalg.norm(chord)
        and float(origin.tangent @ chord) > 0.0
    )


def _stepped(
    problem: Problem, previous: Point, length: float, has_kink: HasKink
) -> Task[tuple[Point | None, str]]:
    current = yield from corrected(
        problem,
        previous.x + length * previous.tangent,
        previous.tangent,
        previous.tangent,
        previous,
    )
    if current is None:
        return None, "Newton's method"
    is_reversed = current.orientation != previous.orientation and has_kink(
        previous.found, current.found
    )
    if is_reversed or current.tangent @ previous.tangent < MIN_COSINE:
        return None, "the branch turns too sharply"
    if np.linalg.norm(current.x - previous.x) > 3.0 * length:
        return None, "Newton's method leaps to another branch"
    return current, ""


def _around_corner(
    problem: Problem, previous: Point, length: float, has_kink: HasKink
) -> Task[tuple[Point, Point] | None]:
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
        point, _ = yield from _stepped(problem, previous, middle, has_kink)
        if point is None or has_kink(previous.found, point.found):
            far = middle
        else:
            edge, near = point, middle
    best: Point | None = None
    for step in STEPS_BEYOND_CORNER:
        current = yield from _beyond_corner(problem, edge, step, has_kink)
        if best is not None and (
            current is None or current.tangent @ best.tangent < STRAIGHT_COSINE
        ):
            break
        best = current
    return None if best is None else (edge, best)


def _beyond_corner(
    problem: Problem, edge: Point, step: float, has_kink: HasKink
) -> Task[Point | None]:
    """The point at the distance ``step`` from the last one before a corner, where the
    branch is straight again."""
    tangent_guess = edge.tangent
    for _ in range(4):  # the Jacobian depends on how far it is beyond the kink
        evaluation = yield from problem.evaluate(edge.x + step * tangent_guess)
        if evaluation is None or not has_kink(edge.found, evaluation.solution()):
            return None
        tangent = tangent_of(evaluation.jacobian, tangent_guess)
        if tangent is None:
            return None
        tangent_guess = tangent * edge.orientation * _orientation(evaluation.jacobian, tangent)
        point = yield from corrected(
            problem, edge.x + step * tangent_guess, tangent_guess, tangent_guess, edge
        )
        if point is not None:
            chord = point.x - edge.x
            length = float(np.linalg.norm(chord))
            is_straight = length < 3.0 * step and chord @ point.tangent > STRAIGHT_COSINE * length
            return (
                point
                if is_straight
                and point.orientation == edge.orientation
                and has_kink(edge.found, point.found)
                else None
            )
    return None


def _point_at_bound(
    problem: Problem, previous: Point, current: Point, bound: float
) -> Task[Point | None]:
    fraction = (bound - previous.x[-1]) / (current.x[-1] - previous.x[-1])
    guess = previous.x + fraction * (current.x - previous.x)
    guess[-1] = bound
    point = yield from corrected(
        problem, guess, _parameter_normal(len(guess)), previous.tangent, previous
    )
    if point is None or np.linalg.norm(point.x - previous.x) > 3.0 * np.linalg.norm(
        current.x - previous.x
    ):
        return None
    return point


def special_points(
    problem: Problem, previous: Point, current: Point, test_functions: TestFunctions
) -> Task[list[LabelledPoint]]:
    """The special points between two points, in order."""
    points = []
    for test in test_functions(previous, current):
        point = yield from _located_zero(problem, previous, current, test)
        if point is not None:
            points.append(LabelledPoint(point, test.code, test.words))
    return sorted(points, key=lambda entry: entry.point.s)


def corrected_between(
    problem: Problem, previous: Point, a: Point, b: Point, s: float
) -> Task[Point | None]:
    """The point at the distance ``s`` along the tangent of ``previous``, between the
    points ``a`` and ``b``."""
    sa, sb = (float(previous.tangent @ (point.x - previous.x)) for point in (a, b))
    guess = a.x + (s - sa) / (sb - sa) * (b.x - a.x)
    return (yield from corrected(problem, guess, previous.tangent, previous.tangent, previous))


def _instability_interval(
    first: tuple[Problem, Point],
    second: tuple[Problem, Point],
    last: Point,
    test_functions: TestFunctions,
    margins: Margins,
) -> Task[list[LabelledPoint]]:
    """An interval between three neighbouring points in which a margin has the opposite
    sign: a point inside and the special points on both sides; empty where no margin
    changes its sign. ``first`` and ``second`` come with the problems of the steps that
    lead on from them.

    The margin to search is closest to zero at the middle point, and its distance from
    zero is comparable to its change between points. Halving both sides about the
    closest point either finds the interval, or shows that the margin has an extremum
    before zero.
    """
    (first_problem, a), (second_problem, b), c = first, second, last
    sides: list[tuple[Problem, Point]] = [(first_problem, a), (second_problem, b)]
    bracket: list[Point] = [a, b, c]
    values = [margins(point.found) for point in bracket]
    index = _closest_margin(*values)
    if index is None:
        return []
    for _ in range(MAX_HALVINGS):
        middle: list[Point] = []
        for (problem, base), p, q in zip(sides, bracket[:2], bracket[1:], strict=True):
            distances = [float(base.tangent @ (end.x - base.x)) for end in (p, q)]
            point = yield from corrected_between(
                problem, base, p, q, 0.5 * (distances[0] + distances[1])
            )
            if point is None:
                return []
            middle.append(point)
            margin = margins(point.found)
            if margin[index] * values[1][index] < 0.0:
                points = yield from special_points(problem, p, point, test_functions)
                points.append(LabelledPoint(point))
                points += yield from special_points(problem, point, q, test_functions)
                return points
        bracket = [bracket[0], middle[0], bracket[1], middle[1], bracket[2]]
        values = [margins(point.found) for point in bracket]
        nearest = min(range(1, 4), key=lambda k: abs(values[k][index]))
        refined_sides = [sides[0], sides[0], sides[1], sides[1]]
        bracket, values = bracket[nearest - 1 : nearest + 2], values[nearest - 1 : nearest + 2]
        sides = refined_sides[nearest - 1 : nearest + 1]
        if _closest_margin(*(margin[[index]] for margin in values)) is None:
            return []
    return []


def _closest_margin(a: Array, b: Array, c: Array) -> int | None:
    """The number of the margin that may cross zero between three points, by how close
    it comes to zero at the middle one; None where none may."""
    same_sign = (a * b > 0.0) & (b * c > 0.0)
    is_closest = (np.abs(b) < np.abs(a)) & (np.abs(b) < np.abs(c))
    change = np.maximum(np.abs(b - a), np.abs(b - c))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.where(
            same_sign & is_closest & (change < MAX_MARGIN_CHANGE), np.abs(b) / change, np.inf
        )
    nearest = int(np.argmin(ratio)) if len(ratio) else 0
    return nearest if len(ratio) and ratio[nearest] < MAX_MARGIN_RATIO else None


def _located_zero(
    problem: Problem, previous: Point, current: Point, test: TestFunction
) -> Task[Point | None]:
    """The zero of ``test``, by the method of Chandrupatla (1997), bisection and
    inverse quadratic interpolation. None where both ends have the same sign, a value
    is not finite, or Newton's method fails at once."""
    a, b = current, previous
    sa, sb = float(previous.tangent @ (current.x - previous.x)), 0.0
    fa, fb = test.value(a), test.value(b)
    if not (np.isfinite(fa) and np.isfinite(fb)) or fa * fb > 0.0:
        return None
    fraction, best = 0.5, None
    for _ in range(60):
        s = sa + fraction * (sb - sa)
        low, high = (a, b) if sa < sb else (b, a)
        point = yield from corrected_between(problem, previous, low, high, s)
        if point is None:
            return best
        f = test.value(point)
        if not np.isfinite(f):
            return None
        if (f > 0.0) == (fa > 0.0):
            sc, fc = sa, fa
        else:
            sc, fc = sb, fb
            b, sb, fb = a, sa, fa
        a, sa, fa = point, s, f
        best = a if abs(fa) < abs(fb) else b
        width = abs(sb - sa)
        is_resolved = test.jumps and abs(a.x[-1] - b.x[-1]) < 10.0 * LOCATION_TOLERANCE
        if width < LOCATION_TOLERANCE or fa == 0.0 or is_resolved:
            return best
        xi, phi = (sa - sb) / (sc - sb), (fa - fb) / (fc - fb) if fc != fb else 2.0
        fraction = 0.5
        if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            fraction = fa / (fb - fa) * fc / (fb - fc) + (sc - sa) / (sb - sa) * fa / (
                fc - fa
            ) * fb / (fc - fb)
        least = 0.5 * LOCATION_TOLERANCE / width
        fraction = min(max(fraction, least), 1.0 - least)
    return best
