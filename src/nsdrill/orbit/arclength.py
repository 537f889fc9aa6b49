"""Pseudo-arclength continuation (Keller 1977) of the zeros of any residual along which
one number varies.

A problem has m equations in m + 1 unknowns, all in natural scales, the last of them the
number that is continued. It is evaluated from pieces of motion: the functions here are
generators that yield the legs they need and are sent their ends, so that many branches
advance side by side and all that they need in one round is one batch
(:func:`nsdrill.orbit.rounds.advance`). Nothing here knows what the pieces of motion
are.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from nsdrill.orbit.flow import Ends, Legs
from nsdrill.orbit.linear import sign_of_determinant, solve
from nsdrill.orbit.rounds import together

Array = np.ndarray[Any, np.dtype[np.float64]]
T = TypeVar("T")
Steps = Generator[Legs, Ends, T]
Kinked = Callable[[Any, Any], bool]
Margins = Callable[[Any], Array]

FIRST, MOST, LEAST = 0.02, 0.3, 1e-6  # lengths of steps, in natural scales
GROW, FASTER = 1.3, 2.0  # of a step after few iterations, and of one that was very short
FEW_ITERATIONS, MOST_ITERATIONS = 4, 9
CLOSE, SMALL, FARTHEST = 1e-8, 1e-5, 3000.0  # of a step of Newton's method, in natural scales
LEAST_COSINE = 0.5  # between the tangents of neighbouring points
SAME = 1e-5  # in natural scales: two special points of one kind that are one
LOCATED = 1e-8  # of the arclength at which a special point is known
NOISE = 1e-7  # of a residual, in natural scales, that the steps of the integration may leave
CORNER = 1e-5  # of a step: shorter ones look for a corner
# lengths of the first step beyond a corner
BEYOND = (3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)
HALVINGS = 6  # in search of a window
# of a margin: how far from zero, over its change between points; that change
CLOSENESS, WIDEST = 4.0, 0.5
STRAIGHT = 0.95  # cosine between that step, or the next shorter one, and the tangent at its end


@dataclass(frozen=True)
class Reading:
    """What a problem has at ``x``: ``residual`` [m], ``jacobian`` [m, m + 1]; ``found``
    gives what the problem wants kept of the point."""

    residual: Array
    jacobian: Array
    found: Callable[[], Any]


class Problem(Protocol):
    """What is continued. ``slack`` is by what factor its noise exceeds that of the
    tolerance of the flow."""

    @property
    def slack(self) -> float: ...

    def read(self, x: Array) -> Steps[Reading | None]:
        """The reading at ``x`` [m + 1]; None where it cannot be evaluated."""
        ...

    def moved(self, x: Array) -> Problem:
        """The problem for the points after ``x``, whose phase condition may refer to
        it."""
        ...


@dataclass(frozen=True)
class Point:
    """A point of a branch: ``x`` [m + 1], the unit tangent ``tangent`` [m + 1], what
    was ``found``, Newton's ``iterations``, the ``residual`` left, its place ``s`` along
    the branch, and the sign ``turn`` of the determinant of the Jacobian above the
    tangent, which changes at branch points alone."""

    x: Array
    tangent: Array
    found: Any
    iterations: int
    residual: float
    s: float = 0.0
    turn: float = 0.0


def tangent_of(jacobian: Array, along: Array) -> Array | None:
    """The unit vector that ``jacobian`` [m, m + 1] maps to zero, on the side of
    ``along``; None where there are several."""
    m = len(jacobian)
    system = np.vstack([jacobian, along])
    try:
        found = solve(system, np.concatenate([np.zeros(m), [1.0]]))
    except np.linalg.LinAlgError:
        found = np.linalg.svd(jacobian)[2][-1]
    length = np.linalg.norm(found)
    return found / length if np.isfinite(length) and length > 0 else None


def correct(
    problem: Problem, guess: Array, normal: Array
) -> Steps[tuple[Array, Reading, int, float] | None]:
    """The zero of ``problem`` in the plane through ``guess`` with this ``normal``, by
    Newton's method: (x, reading, iterations, residual). None where it does not
    converge.

    It stops at a step of ``CLOSE``, or where one below ``SMALL`` no longer falls and
    the residual is below ``NOISE``: the steps of the integration make some, which large
    multipliers amplify.
    """
    x, before = guess, np.inf
    for iteration in range(1, MOST_ITERATIONS + 1):
        reading = yield from problem.read(x)
        if reading is None:
            return None
        residual = float(np.max(np.abs(reading.residual)))
        system = np.vstack([reading.jacobian, normal])
        try:
            step = solve(system, -np.concatenate([reading.residual, [normal @ (x - guess)]]))
        except np.linalg.LinAlgError:
            return None
        size = float(np.max(np.abs(step)))
        if not np.isfinite(size) or size > FARTHEST:
            return None
        noise = problem.slack
        if size < noise * CLOSE or (
            size < noise * SMALL and size >= 0.5 * before and residual < noise * NOISE
        ):
            return x, reading, iteration, residual
        if iteration > 3 and size > 2.0 * before:
            return None
        x, before = x + step, size
    return None


def corrected(
    problem: Problem, guess: Array, normal: Array, along: Array, origin: Point | None = None
) -> Steps[Point | None]:
    """The point of the branch in the plane through ``guess`` with this ``normal``, with
    the tangent on the side of ``along`` and the arclength counted from ``origin``. None
    where Newton's method does not converge, or where there are several tangents."""
    found = yield from correct(problem, guess, normal)
    if found is None:
        return None
    x, reading, iterations, residual = found
    tangent = tangent_of(reading.jacobian, along)
    if tangent is None:
        return None
    s = 0.0 if origin is None else origin.s + float(np.linalg.norm(x - origin.x))
    return Point(
        x, tangent, reading.found(), iterations, residual, s, _turn(reading.jacobian, tangent)
    )


def _turn(jacobian: Array, tangent: Array) -> float:
    return sign_of_determinant(np.vstack([jacobian, tangent]))


def _unit(length: int) -> Array:
    """The normal of the planes in which the number that is continued has one value."""
    return np.eye(length)[-1]


def settled(problem: Problem, guess: Array) -> Steps[Point | None]:
    """The zero of ``problem`` near ``guess`` at its value of the number that is
    continued."""
    normal = _unit(len(guess))
    return (yield from corrected(problem, guess, normal, normal))


@dataclass(frozen=True)
class Test:
    """A special point between two points of a branch: ``value`` of a point changes its
    sign there, and ``jumps`` where it is one that only has a sign."""

    code: int
    value: Callable[[Point], float]
    words: str = ""
    jumps: bool = False


@dataclass(frozen=True)
class Marked:
    """A point of a branch with its label, 0 for none."""

    point: Point
    label: int = 0
    words: str = ""


Tests = Callable[[Point, Point], list[Test]]


@dataclass(frozen=True)
class Half:
    """One side of a branch from its seed on: the ``points`` after the seed, why it
    ``ended``, and how many of the points are ``further`` ones, of windows narrower than
    a step."""

    points: list[Marked]
    ended: str
    further: int = 0


Suspect = tuple[tuple[Problem, Point], tuple[Problem, Point], Point]


def follow(
    problem: Problem,
    start: Point,
    sense: int,
    bounds: tuple[float, float],
    points: int,
    tests: Tests,
    stop: Callable[[Point, Point], str] = lambda here, there: "",
    *,
    first: float = FIRST,
    most: float = MOST,
    kinked: Kinked = lambda here, there: False,
    margins: Margins | None = None,
) -> Steps[Half]:
    """Follow the branch through ``start`` to the side ``sense`` (1 or -1 of its
    tangent) until the number continued leaves ``bounds``, ``stop`` of two neighbouring
    points has a word for the end, the branch closes, Newton's method fails, or there
    are so many ``points``. ``kinked`` says of what was found at two points whether a
    kink of the equations lies between them, at which the branch may have a corner.
    ``margins`` of a point change their sign at special points: where one comes close to
    that, a window narrower than a step is looked for."""
    suspects: list[Suspect] = []

    def suspected(a: Point, b: Point, c: Point) -> bool:
        return (
            margins is not None and _close(*(margins(one.found) for one in (a, b, c))) is not None
        )

    sides = (points, tests, stop, first, most, kinked)
    half = yield from _line(problem, start, sense, bounds, *sides, suspected, suspects)
    if margins is None or not suspects:
        return half
    # Last of all, as the steps of other branches may wait for those of this one.
    windows = yield from together([_window(*one, tests, margins) for one in suspects])
    made = list(half.points)
    for one in (one for window in windows for one in window):
        if not any(
            one.label == other.label and np.max(np.abs(one.point.x - other.point.x)) < SAME
            for other in made
        ):
            made.append(one)
    return Half(sorted(made, key=lambda one: one.point.s), half.ended, len(made) - len(half.points))


def _line(
    problem: Problem,
    start: Point,
    sense: int,
    bounds: tuple[float, float],
    points: int,
    tests: Tests,
    stop: Callable[[Point, Point], str],
    first: float,
    most: float,
    kinked: Kinked,
    suspected: Callable[[Point, Point, Point], bool],
    suspects: list[Suspect],
) -> Steps[Half]:
    """The steps of :func:`follow`, which puts into ``suspects`` where a window is to be
    looked for."""
    here = replace(start, tangent=sense * start.tangent, s=0.0, turn=sense * start.turn)
    origin, made = here, list[Marked]()
    last_two: tuple[tuple[Problem, Point], ...] = ((problem, here),)  # no corner between
    length, away = first, False
    failing = ""
    while len(made) < points:
        there = None
        while there is None:
            if length < LEAST:
                return Half(made, f"no convergence: {failing}")
            there, failing = yield from _stepped(problem, here, length, kinked)
            if length < CORNER and (there is None or kinked(here.found, there.found)):
                corner = yield from _corner(problem, here, length, kinked)
                if corner is not None:
                    edge, there = corner
                    made += [Marked(edge, test.code, test.words) for test in tests(here, there)]
                    here, last_two = edge, ()
            if there is None:
                length /= 2.0
        outside = (
            0 if bounds[0] <= there.x[-1] <= bounds[1] else -1 if there.x[-1] < bounds[0] else 1
        )
        if outside:
            bound = bounds[0] if outside < 0 else bounds[1]
            last = yield from _at_bound(problem, here, there, bound)
            if last is None:
                length /= 2.0
                if length < LEAST:
                    return Half(made, "no convergence: the end of the range is not reached")
                continue
            there = last
        if word := stop(here, there):
            return Half(made, word)
        # else those of a corner, which are there
        if not (made and made[-1].point is here and made[-1].label):
            made += yield from special(problem, here, there, tests)
        made.append(Marked(there))
        if len(last_two) == 2 and suspected(last_two[0][1], last_two[1][1], there):
            suspects.append((*last_two, there))
        if outside:
            return Half(made, "from" if outside < 0 else "to")
        distance = float(np.linalg.norm(there.x - origin.x))
        away = away or distance > 4.0 * MOST
        if away and distance < 1.5 * length and _passes(here, there, origin):
            return Half(made, "closed")
        problem, here = problem.moved(there.x), there
        last_two = (*last_two[-1:], (problem, here))
        if there.iterations <= FEW_ITERATIONS:
            length = min(length * (GROW if length > first else FASTER), most)
    return Half(made, "points")


def _passes(here: Point, there: Point, origin: Point) -> bool:
    """Whether the branch passes through ``origin`` between these points."""
    along = there.x - here.x
    share = float((origin.x - here.x) @ along / (along @ along))
    beside = np.linalg.norm(origin.x - here.x - share * along)
    return (
        0.0 <= share <= 1.0
        and beside < 0.2 * np.linalg.norm(along)
        and float(origin.tangent @ along) > 0.0
    )


def _stepped(
    problem: Problem, here: Point, length: float, kinked: Kinked
) -> Steps[tuple[Point | None, str]]:
    there = yield from corrected(
        problem, here.x + length * here.tangent, here.tangent, here.tangent, here
    )
    if there is None:
        return None, "Newton's method"
    turned_back = there.turn != here.turn and kinked(here.found, there.found)
    if turned_back or there.tangent @ here.tangent < LEAST_COSINE:
        return None, "the branch turns too sharply"
    if np.linalg.norm(there.x - here.x) > 3.0 * length:
        return None, "Newton's method leaps to another branch"
    return there, ""


def _corner(
    problem: Problem, here: Point, length: float, kinked: Kinked
) -> Steps[tuple[Point, Point] | None]:
    """The last point before a corner that is closer than ``length``, and a first one
    beyond it.

    Where the equations have a kink, the tangent turns by any angle within a distance
    that no step resolves: of the compliance of a contact the square root of its depth.
    The Jacobian beyond tells the new tangent up to its sign; the sign follows from the
    determinant, which changes at branch points alone. The shortest of the steps that
    lead to where the branch is straight again is taken.
    """
    edge, near, far = here, 0.0, length
    while far - near > LOCATED:
        middle = 0.5 * (near + far)
        found, _ = yield from _stepped(problem, here, middle, kinked)
        if found is None or kinked(here.found, found.found):
            far = middle
        else:
            edge, near = found, middle
    best: Point | None = None
    for step in BEYOND:
        there = yield from _beyond(problem, edge, step, kinked)
        if best is not None and (there is None or there.tangent @ best.tangent < STRAIGHT):
            break
        best = there
    return None if best is None else (edge, best)


def _beyond(problem: Problem, edge: Point, step: float, kinked: Kinked) -> Steps[Point | None]:
    """The point at the distance ``step`` from the last one before a corner, where the
    branch is straight again."""
    along = edge.tangent
    for _ in range(4):  # the Jacobian depends on how far it is beyond the kink
        reading = yield from problem.read(edge.x + step * along)
        if reading is None or not kinked(edge.found, reading.found()):
            return None
        tangent = tangent_of(reading.jacobian, along)
        if tangent is None:
            return None
        along = tangent * edge.turn * _turn(reading.jacobian, tangent)
        there = yield from corrected(problem, edge.x + step * along, along, along, edge)
        if there is not None:
            chord = there.x - edge.x
            length = float(np.linalg.norm(chord))
            straight = length < 3.0 * step and chord @ there.tangent > STRAIGHT * length
            return (
                there
                if straight and there.turn == edge.turn and kinked(edge.found, there.found)
                else None
            )
    return None


def _at_bound(problem: Problem, here: Point, there: Point, bound: float) -> Steps[Point | None]:
    share = (bound - here.x[-1]) / (there.x[-1] - here.x[-1])
    guess = here.x + share * (there.x - here.x)
    guess[-1] = bound
    found = yield from corrected(problem, guess, _unit(len(guess)), here.tangent, here)
    if found is None or np.linalg.norm(found.x - here.x) > 3.0 * np.linalg.norm(there.x - here.x):
        return None
    return found


def special(problem: Problem, here: Point, there: Point, tests: Tests) -> Steps[list[Marked]]:
    """The special points between two points, in order."""
    found = []
    for test in tests(here, there):
        point = yield from _located(problem, here, there, test)
        if point is not None:
            found.append(Marked(point, test.code, test.words))
    return sorted(found, key=lambda one: one.point.s)


def between(problem: Problem, here: Point, a: Point, b: Point, s: float) -> Steps[Point | None]:
    """The point at the distance ``s`` along the tangent of ``here``, between the points
    ``a`` and ``b``."""
    sa, sb = (float(here.tangent @ (one.x - here.x)) for one in (a, b))
    guess = a.x + (s - sa) / (sb - sa) * (b.x - a.x)
    return (yield from corrected(problem, guess, here.tangent, here.tangent, here))


def _window(
    first: tuple[Problem, Point],
    second: tuple[Problem, Point],
    last: Point,
    tests: Tests,
    margins: Margins,
) -> Steps[list[Marked]]:
    """What lies between three neighbouring points where a margin, which keeps its sign
    at them, changes it and changes it back: a point there, and the special points to
    both sides; none where no margin does. ``first`` and ``second`` have the problems of
    the steps that lead on from them.

    A margin is suspected that is closest to zero at the point in the middle, and not
    much farther from it than it changes to one of the sides. Halving both sides about
    the closest point either finds the window, or shows that the margin turns before.
    """
    (early, a), (late, b), c = first, second, last
    sides: list[tuple[Problem, Point]] = [(early, a), (late, b)]
    line: list[Point] = [a, b, c]
    values = [margins(point.found) for point in line]
    suspected = _close(*values)
    if suspected is None:
        return []
    for _ in range(HALVINGS):
        middle: list[Point] = []
        for (problem, base), p, q in zip(sides, line[:2], line[1:], strict=True):
            reach = [float(base.tangent @ (one.x - base.x)) for one in (p, q)]
            point = yield from between(problem, base, p, q, 0.5 * (reach[0] + reach[1]))
            if point is None:
                return []
            middle.append(point)
            value = margins(point.found)
            if value[suspected] * values[1][suspected] < 0.0:
                made = yield from special(problem, p, point, tests)
                made.append(Marked(point))
                made += yield from special(problem, point, q, tests)
                return made
        line = [line[0], middle[0], line[1], middle[1], line[2]]
        values = [margins(point.found) for point in line]
        nearest = min(range(1, 4), key=lambda k: abs(values[k][suspected]))
        every = [sides[0], sides[0], sides[1], sides[1]]
        line, values = line[nearest - 1 : nearest + 2], values[nearest - 1 : nearest + 2]
        sides = every[nearest - 1 : nearest + 1]
        if _close(*(value[[suspected]] for value in values)) is None:
            return []
    return []


def _close(a: Array, b: Array, c: Array) -> int | None:
    """Which of the margins at three points comes so close to zero that it may cross it
    between; None where none does."""
    same = (a * b > 0.0) & (b * c > 0.0)
    peak = (np.abs(b) < np.abs(a)) & (np.abs(b) < np.abs(c))
    change = np.maximum(np.abs(b - a), np.abs(b - c))
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(same & peak & (change < WIDEST), np.abs(b) / change, np.inf)
    best = int(np.argmin(share)) if len(share) else 0
    return best if len(share) and share[best] < CLOSENESS else None


def _located(problem: Problem, here: Point, there: Point, test: Test) -> Steps[Point | None]:
    """Where ``test`` vanishes, by the method of Chandrupatla 1997 (bisection and
    inverse quadratic interpolation)."""
    a, b = there, here
    sa, sb = float(here.tangent @ (there.x - here.x)), 0.0
    fa, fb = test.value(a), test.value(b)
    if not (np.isfinite(fa) and np.isfinite(fb)) or fa * fb > 0.0:
        return None
    share, last = 0.5, None
    for _ in range(60):
        s = sa + share * (sb - sa)
        low, high = (a, b) if sa < sb else (b, a)
        point = yield from between(problem, here, low, high, s)
        if point is None:
            return None if last is None else last
        f = test.value(point)
        if not np.isfinite(f):
            return None
        if (f > 0.0) == (fa > 0.0):
            sc, fc = sa, fa
        else:
            sc, fc = sb, fb
            b, sb, fb = a, sa, fa
        a, sa, fa = point, s, f
        last = a if abs(fa) < abs(fb) else b
        width = abs(sb - sa)
        near = test.jumps and abs(a.x[-1] - b.x[-1]) < 10.0 * LOCATED
        if width < LOCATED or fa == 0.0 or near:
            return last
        xi, phi = (sa - sb) / (sc - sb), (fa - fb) / (fc - fb) if fc != fb else 2.0
        share = 0.5
        if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            share = fa / (fb - fa) * fc / (fb - fc) + (sc - sa) / (sb - sa) * fa / (
                fc - fa
            ) * fb / (fc - fb)
        least = 0.5 * LOCATED / width
        share = min(max(share, least), 1.0 - least)
    return last
