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
from itertools import pairwise
from typing import Any, Protocol, TypeVar

import numpy as np

from nsdrill.orbit.flow import Ends, Legs
from nsdrill.orbit.linear import sign_of_determinant, solve
from nsdrill.orbit.lockstep import gather

Array = np.ndarray[Any, np.dtype[np.float64]]
T = TypeVar("T")
Task = Generator[Legs, Ends, T]
HasKink = Callable[[Any, Any], bool]

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
# of the search between two points for an interval of instability:
MAX_LOOKS = 6  # points that are computed
SAMPLES = 32  # of the interpolated monodromy
STENCIL = 4  # points that it is interpolated from
MIN_MARGIN = 1e-6  # of a multiplier that is not on the unit circle


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


def newton(problem: Problem, guess: Array, normal: Array) -> Task[tuple[Array, Evaluation, int, float] | None]:
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
    return Point(x, tangent, evaluation.solution(), iterations, residual, s, _orientation(evaluation.jacobian, tangent))


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


UNRESOLVED = "not located more closely"
ELSEWHERE = (0.4, 0.65)  # of a bracket, where Newton's method fails at the place that is due


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


@dataclass(frozen=True)
class Stability:
    """How the stability of solutions is computed: the ``monodromy`` [n, n] of a solution,
    and the ``margins`` [k, m] of monodromies [k, n, n], of which each is positive for an
    unstable direction, the largest first."""

    monodromy: Callable[[Any], Array]
    margins: Callable[[Array], Array]

    def of(self, points: list[Point]) -> Array:
        """The margins of points [points, m]."""
        return self.margins(np.stack([self.monodromy(point.found) for point in points]))


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
    stability: Stability | None = None,
) -> Task[HalfBranch]:
    """Follow the branch through ``start`` in one ``direction`` (1 or -1 along its
    tangent) until the parameter leaves ``bounds``, ``stop`` of two neighbouring points
    returns a reason, the branch closes, Newton's method fails, or ``max_points`` are
    reached.

    ``has_kink`` of the solutions of two points says whether a kink of the equations
    lies between them, at which the branch may have a corner. With ``stability``
    intervals of instability that are narrower than a step are searched for."""
    steps: list[tuple[Problem, Point]] = []
    arguments = (max_points, test_functions, stop, first_step, max_step, has_kink)
    half = yield from _follow_steps(problem, start, direction, bounds, *arguments, steps)
    if stability is None or not half.points:
        return half
    # After all steps, as those of other branches may depend on the points of this one.
    nodes = [LabelledPoint(steps[0][1]), *half.points]
    searches, step = [], 0
    for place in range(len(nodes) - 1):
        while step + 1 < len(steps) and steps[step + 1][1].s <= nodes[place].point.s:
            step += 1
        if nodes[place + 1].point.s - nodes[place].point.s > MIN_STEP:
            stencil = _stencil(nodes, place)
            searches.append(_instability_interval(*steps[step], *stencil, test_functions, stability))
    points = list(half.points)
    for found in (entry for interval in (yield from gather(searches)) for entry in interval):
        if not any(
            found.label == other.label and np.max(np.abs(found.point.x - other.point.x)) < DUPLICATE_DISTANCE
            for other in points
        ):
            points.append(found)
    return HalfBranch(sorted(points, key=lambda entry: entry.point.s), half.ended, len(points) - len(half.points))


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
    steps: list[tuple[Problem, Point]],
) -> Task[HalfBranch]:
    """The steps of :func:`follow`. Appends the problem and the point from which each
    sets out to ``steps``."""
    previous = replace(start, tangent=direction * start.tangent, s=0.0, orientation=direction * start.orientation)
    origin, points = previous, list[LabelledPoint]()
    steps.append((problem, previous))
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
                    points += [LabelledPoint(edge, test.code, test.words) for test in test_functions(previous, current)]
                    previous = edge
                    steps.append((problem, previous))
            if current is None:
                step /= 2.0
        outside = 0 if bounds[0] <= current.x[-1] <= bounds[1] else -1 if current.x[-1] < bounds[0] else 1
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
        if outside:
            return HalfBranch(points, "from" if outside < 0 else "to")
        distance = float(np.linalg.norm(current.x - origin.x))
        has_left = has_left or distance > 4.0 * MAX_STEP
        if has_left and distance < 1.5 * step and _passes_through(previous, current, origin):
            return HalfBranch(points, "closed")
        problem, previous = problem.updated(current.x), current
        steps.append((problem, previous))
        if current.iterations <= FEW_ITERATIONS:
            step = min(step * (GROWTH if step > first_step else RECOVERY_GROWTH), max_step)
    return HalfBranch(points, "points")


def _passes_through(previous: Point, current: Point, origin: Point) -> bool:
    """Whether the branch passes through ``origin`` between these points."""
    chord = current.x - previous.x
    fraction = float((origin.x - previous.x) @ chord / (chord @ chord))
    offset = np.linalg.norm(origin.x - previous.x - fraction * chord)
    return 0.0 <= fraction <= 1.0 and offset < 0.2 * np.linalg.norm(chord) and float(origin.tangent @ chord) > 0.0


def _stepped(problem: Problem, previous: Point, length: float, has_kink: HasKink) -> Task[tuple[Point | None, str]]:
    current = yield from corrected(
        problem, previous.x + length * previous.tangent, previous.tangent, previous.tangent, previous
    )
    if current is None:
        return None, "Newton's method"
    is_reversed = current.orientation != previous.orientation and has_kink(previous.found, current.found)
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
        if best is not None and (current is None or current.tangent @ best.tangent < STRAIGHT_COSINE):
            break
        best = current
    return None if best is None else (edge, best)


def _beyond_corner(problem: Problem, edge: Point, step: float, has_kink: HasKink) -> Task[Point | None]:
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
        point = yield from corrected(problem, edge.x + step * tangent_guess, tangent_guess, tangent_guess, edge)
        if point is not None:
            chord = point.x - edge.x
            length = float(np.linalg.norm(chord))
            is_straight = length < 3.0 * step and chord @ point.tangent > STRAIGHT_COSINE * length
            return (
                point
                if is_straight and point.orientation == edge.orientation and has_kink(edge.found, point.found)
                else None
            )
    return None


def _point_at_bound(problem: Problem, previous: Point, current: Point, bound: float) -> Task[Point | None]:
    fraction = (bound - previous.x[-1]) / (current.x[-1] - previous.x[-1])
    guess = previous.x + fraction * (current.x - previous.x)
    guess[-1] = bound
    point = yield from corrected(problem, guess, _parameter_normal(len(guess)), previous.tangent, previous)
    if point is None or np.linalg.norm(point.x - previous.x) > 3.0 * np.linalg.norm(current.x - previous.x):
        return None
    return point


def special_points(
    problem: Problem,
    previous: Point,
    current: Point,
    test_functions: TestFunctions,
    tolerance: float = LOCATION_TOLERANCE,
) -> Task[list[LabelledPoint]]:
    """The special points between two points, in order, to a ``tolerance`` of the
    arclength."""
    points = []
    for test in test_functions(previous, current):
        found = yield from _located_zero(problem, previous, current, test, tolerance)
        if found is not None:
            point, is_resolved = found
            words = test.words if is_resolved else UNRESOLVED
            points.append(LabelledPoint(point, test.code, words))
    return sorted(points, key=lambda entry: entry.point.s)


def corrected_between(problem: Problem, previous: Point, a: Point, b: Point, s: float) -> Task[Point | None]:
    """The point at the distance ``s`` along the tangent of ``previous``, between the
    points ``a`` and ``b``."""
    sa, sb = (float(previous.tangent @ (point.x - previous.x)) for point in (a, b))
    guess = a.x + (s - sa) / (sb - sa) * (b.x - a.x)
    return (yield from corrected(problem, guess, previous.tangent, previous.tangent, previous))


def _stencil(nodes: list[LabelledPoint], place: int) -> tuple[list[Point], int]:
    """The nodes from which a monodromy between the node ``place`` and the next is
    interpolated, and the number of the former among them. A special point may be a
    kink: none lies beyond one."""

    def gap(low: int) -> float:
        """The distance of the node ``low`` from the next."""
        gap = nodes[low + 1].point.s - nodes[low].point.s
        return gap if gap > MIN_STEP else np.inf

    low, high = place, place + 1
    while high - low < STENCIL - 1:
        left = np.inf if low == 0 or nodes[low].label else gap(low - 1)
        right = np.inf if high + 1 == len(nodes) or nodes[high].label else gap(high)
        if np.isinf(min(left, right)):
            break
        low, high = (low - 1, high) if left <= right else (low, high + 1)
    return [entry.point for entry in nodes[low : high + 1]], place - low


def _instability_interval(
    problem: Problem, base: Point, nodes: list[Point], place: int, test_functions: TestFunctions, stability: Stability
) -> Task[list[LabelledPoint]]:
    """An interval between the node ``place`` and the next in which another number of
    directions is unstable: a point inside and the special points on both sides; empty
    where none is found. The step there sets out from ``base`` with ``problem``.

    Multipliers that meet leave the unit circle for as long as they keep together, and
    none of the points around need show it. The monodromy, though, is smooth: where one
    that is interpolated has another number of margins above zero, a point is computed,
    and serves to interpolate anew.
    """
    ends = nodes[place], nodes[place + 1]
    # a special point has a margin of about zero
    counts = {int(np.sum(margins > 0.0)) for margins in stability.of([*ends]) if np.min(np.abs(margins)) > MIN_MARGIN}
    if len(counts) != 1:
        return []
    count = counts.pop()
    for _ in range(MAX_LOOKS):
        inner = [node for node in nodes if ends[0].s <= node.s <= ends[1].s]
        found = [_greatest_excess(nodes, *pair, count, stability) for pair in pairwise(inner)]
        k = max(range(len(found)), key=lambda k: found[k][0])
        excess, s = found[k]
        if not excess > 0.0:
            break
        first, last = inner[k : k + 2]
        share = (s - first.s) / (last.s - first.s)
        chord = share * (base.tangent @ (last.x - base.x))
        chord += (1.0 - share) * (base.tangent @ (first.x - base.x))
        point = yield from corrected_between(problem, base, first, last, float(chord))
        if point is None or not first.s < point.s < last.s:
            break
        if np.sum(stability.of([point]) > 0.0) != count:
            points = yield from special_points(problem, first, point, test_functions)
            points.append(LabelledPoint(point))
            points += yield from special_points(problem, point, last, test_functions)
            return points
        nodes = sorted([*nodes, point], key=lambda node: node.s)
    return []


def _greatest_excess(
    nodes: list[Point], first: Point, last: Point, count: int, stability: Stability
) -> tuple[float, float]:
    """The greatest value, between two neighbouring nodes, of the margin that lies
    inside with ``count`` margins outside, or of the outer one's distance inside, and the
    arclength there, from monodromies interpolated between the nearest nodes."""
    near = sorted(nodes, key=lambda node: max(first.s - node.s, node.s - last.s))[:STENCIL]
    s = first.s + (last.s - first.s) * (np.arange(SAMPLES) + 0.5) / SAMPLES
    at = np.array([node.s for node in near])
    weights = np.ones((SAMPLES, len(near)))  # of Lagrange
    for k, other in np.ndindex(len(near), len(near)):
        if k != other:
            weights[:, k] *= (s - at[other]) / (at[k] - at[other])
    monodromies = np.stack([stability.monodromy(node.found) for node in near])
    margins = stability.margins(np.tensordot(weights, monodromies, 1))
    bounded = np.pad(margins, ((0, 0), (1, 1)), constant_values=((0, 0), (np.inf, -np.inf)))
    excess = np.maximum(bounded[:, count + 1], -bounded[:, count])
    return float(excess.max()), float(s[np.argmax(excess)])


def _located_zero(
    problem: Problem, previous: Point, current: Point, test: TestFunction, tolerance: float
) -> Task[tuple[Point, bool] | None]:
    """The zero of ``test``, by the method of Chandrupatla (1997), bisection and
    inverse quadratic interpolation, and whether it is resolved to the ``tolerance``.
    None where both ends have the same sign, a value is not finite, or Newton's method
    fails at once. Where it fails at one place only, as it may at a contact, the search
    goes on at another."""
    a, b = current, previous
    sa, sb = float(previous.tangent @ (current.x - previous.x)), 0.0
    fa, fb = test.value(a), test.value(b)
    if not (np.isfinite(fa) and np.isfinite(fb)) or fa * fb > 0.0:
        return None
    fraction, best = 0.5, None
    for _ in range(60):
        low, high = (a, b) if sa < sb else (b, a)
        for share in (fraction, *ELSEWHERE):
            s = sa + share * (sb - sa)
            point = yield from corrected_between(problem, previous, low, high, s)
            if point is not None:
                break
        if point is None:
            return None if best is None else (best, False)
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
        if width < tolerance or fa == 0.0 or is_resolved:
            return best, True
        xi, phi = (sa - sb) / (sc - sb), (fa - fb) / (fc - fb) if fc != fb else 2.0
        fraction = 0.5
        if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            fraction = fa / (fb - fa) * fc / (fb - fc) + (sc - sa) / (sb - sa) * fa / (fc - fa) * fb / (fc - fb)
        least = 0.5 * tolerance / width
        fraction = min(max(fraction, least), 1.0 - least)
    return None if best is None else (best, False)
