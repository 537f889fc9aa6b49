"""Pseudo-arclength continuation (Keller 1977) of the zeros of any residual along which one number varies.

A problem has m equations in m + 1 unknowns, all in natural sizes, the last of them the number that is continued. It is
evaluated from pieces of motion: the functions here are generators that yield the legs they need and are sent their
ends, so that many branches advance side by side and all that they need in one round is one batch
(:func:`nsdrill.orbit.rounds.advance`). Nothing here knows what the pieces of motion are.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from nsdrill.orbit.flow import Ends, Legs

Array = np.ndarray[Any, np.dtype[np.float64]]
T = TypeVar("T")
Steps = Generator[Legs, Ends, T]

FIRST, GROW, MOST, LEAST = 0.02, 1.3, 0.3, 1e-6  # lengths of steps, in natural sizes
FEW_ITERATIONS, MOST_ITERATIONS = 4, 9
CLOSE, SMALL, FARTHEST = 1e-8, 1e-5, 3000.0  # of a step of Newton's method, in natural sizes
LEAST_COSINE = 0.5  # between the tangents of neighbouring points
LOCATED = 1e-8  # of the arclength at which a special point is known


@dataclass(frozen=True)
class Reading:
    """What a problem has at ``x``: ``residual`` [m], ``jacobian`` [m, m + 1]; ``found`` is what the problem wants kept
    of the point."""

    residual: Array
    jacobian: Array
    found: Any


class Problem(Protocol):
    """What is continued."""

    def read(self, x: Array) -> Steps[Reading | None]:
        """The reading at ``x`` [m + 1]; None where it cannot be evaluated."""
        ...

    def moved(self, x: Array) -> Problem:
        """The problem for the points after ``x``, whose phase condition may refer to it."""
        ...


@dataclass(frozen=True)
class Point:
    """A point of a branch: ``x`` [m + 1], the unit tangent ``tangent`` [m + 1], what was ``found``, Newton's
    ``iterations``, the ``residual`` left, its place ``s`` along the branch."""

    x: Array
    tangent: Array
    found: Any
    iterations: int
    residual: float
    s: float = 0.0


def tangent_of(jacobian: Array, along: Array) -> Array | None:
    """The unit vector that ``jacobian`` [m, m + 1] maps to zero, on the side of ``along``; None where there are
    several."""
    m = len(jacobian)
    system = np.vstack([jacobian, along])
    try:
        found = np.linalg.solve(system, np.concatenate([np.zeros(m), [1.0]]))
    except np.linalg.LinAlgError:
        found = np.linalg.svd(jacobian)[2][-1]
    length = np.linalg.norm(found)
    return found / length if np.isfinite(length) and length > 0 else None


def correct(problem: Problem, guess: Array, normal: Array) -> Steps[tuple[Array, Reading, int, float] | None]:
    """The zero of ``problem`` in the plane through ``guess`` with this ``normal``, by Newton's method: (x, reading,
    iterations, residual). None where it does not converge.

    It stops at a step of ``CLOSE``, or where one below ``SMALL`` no longer falls: the steps of the integration make
    noise, which large multipliers amplify.
    """
    x, before = guess, np.inf
    for iteration in range(1, MOST_ITERATIONS + 1):
        reading = yield from problem.read(x)
        if reading is None:
            return None
        residual = float(np.max(np.abs(reading.residual)))
        system = np.vstack([reading.jacobian, normal])
        try:
            step = np.linalg.solve(system, -np.concatenate([reading.residual, [normal @ (x - guess)]]))
        except np.linalg.LinAlgError:
            return None
        size = float(np.max(np.abs(step)))
        if not np.isfinite(size) or size > FARTHEST:
            return None
        if size < CLOSE or (size < SMALL and size >= 0.5 * before):
            return x, reading, iteration, residual
        if iteration > 3 and size > 2.0 * before:
            return None
        x, before = x + step, size
    return None


def settled(problem: Problem, guess: Array) -> Steps[Point | None]:
    """The zero of ``problem`` near ``guess`` at its value of the number that is continued."""
    normal = np.zeros(len(guess))
    normal[-1] = 1.0
    found = yield from correct(problem, guess, normal)
    if found is None:
        return None
    x, reading, iterations, residual = found
    tangent = tangent_of(reading.jacobian, normal)
    if tangent is None:
        return None
    return Point(x, tangent, reading.found, iterations, residual)


@dataclass(frozen=True)
class Test:
    """A special point between two points of a branch: ``value`` of a point changes its sign there."""

    code: int
    value: Callable[[Point], float]
    words: str = ""


@dataclass(frozen=True)
class Marked:
    """A point of a branch with its label, 0 for none."""

    point: Point
    label: int = 0
    words: str = ""


Tests = Callable[[Point, Point], list[Test]]


@dataclass(frozen=True)
class Half:
    """One side of a branch from its seed on: the ``points`` after the seed, and why it ``ended``."""

    points: list[Marked]
    ended: str


def follow(
    problem: Problem,
    start: Point,
    sense: int,
    bounds: tuple[float, float],
    points: int,
    tests: Tests,
    stop: Callable[[Point, Point], str] = lambda here, there: "",
    *,
    most: float = MOST,
) -> Steps[Half]:
    """Follow the branch through ``start`` to the side ``sense`` (1 or -1 of its tangent) until the number continued
    leaves ``bounds``, ``stop`` of two neighbouring points has a word for the end, the branch closes, Newton's method
    fails, or there are so many ``points``."""
    here = replace(start, tangent=sense * start.tangent, s=0.0)
    origin, made = here, list[Marked]()
    length, away = FIRST, False
    failing = ""
    while len(made) < points:
        there = None
        while there is None:
            if length < LEAST:
                return Half(made, f"no convergence: {failing}")
            there, failing = yield from _stepped(problem, here, length)
            if there is None:
                length /= 2.0
        outside = 0 if bounds[0] <= there.x[-1] <= bounds[1] else -1 if there.x[-1] < bounds[0] else 1
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
        made += yield from special(problem, here, there, tests)
        made.append(Marked(there))
        if outside:
            return Half(made, "from" if outside < 0 else "to")
        distance = float(np.linalg.norm(there.x - origin.x))
        away = away or distance > 4.0 * MOST
        if away and distance < 1.5 * length and _passes(here, there, origin):
            return Half(made, "closed")
        problem, here = problem.moved(there.x), there
        if there.iterations <= FEW_ITERATIONS:
            length = min(length * GROW, most)
    return Half(made, "points")


def _passes(here: Point, there: Point, origin: Point) -> bool:
    """Whether the branch passes through ``origin`` between these points."""
    along = there.x - here.x
    share = float((origin.x - here.x) @ along / (along @ along))
    beside = np.linalg.norm(origin.x - here.x - share * along)
    return 0.0 <= share <= 1.0 and beside < 0.2 * np.linalg.norm(along) and float(origin.tangent @ along) > 0.0


def _stepped(problem: Problem, here: Point, length: float) -> Steps[tuple[Point | None, str]]:
    found = yield from correct(problem, here.x + length * here.tangent, here.tangent)
    if found is None:
        return None, "Newton's method"
    x, reading, iterations, residual = found
    tangent = tangent_of(reading.jacobian, here.tangent)
    if tangent is None or tangent @ here.tangent < LEAST_COSINE:
        return None, "the branch turns too sharply"
    if np.linalg.norm(x - here.x) > 3.0 * length:
        return None, "Newton's method leaps to another branch"
    return Point(x, tangent, reading.found, iterations, residual, here.s + float(np.linalg.norm(x - here.x))), ""


def _at_bound(problem: Problem, here: Point, there: Point, bound: float) -> Steps[Point | None]:
    share = (bound - here.x[-1]) / (there.x[-1] - here.x[-1])
    guess = here.x + share * (there.x - here.x)
    guess[-1] = bound
    normal = np.zeros(len(guess))
    normal[-1] = 1.0
    found = yield from correct(problem, guess, normal)
    if found is None:
        return None
    x, reading, iterations, residual = found
    if np.linalg.norm(x - here.x) > 3.0 * np.linalg.norm(there.x - here.x):
        return None
    tangent = tangent_of(reading.jacobian, here.tangent)
    if tangent is None:
        return None
    return Point(x, tangent, reading.found, iterations, residual, here.s + float(np.linalg.norm(x - here.x)))


def special(problem: Problem, here: Point, there: Point, tests: Tests) -> Steps[list[Marked]]:
    """The special points between two points, in order."""
    found = []
    for test in tests(here, there):
        point = yield from _located(problem, here, there, test)
        if point is not None:
            found.append(Marked(point, test.code, test.words))
    return sorted(found, key=lambda one: one.point.s)


def between(problem: Problem, here: Point, a: Point, b: Point, s: float) -> Steps[Point | None]:
    """The point at the distance ``s`` along the tangent of ``here``, between the points ``a`` and ``b``."""
    sa, sb = (float(here.tangent @ (one.x - here.x)) for one in (a, b))
    guess = a.x + (s - sa) / (sb - sa) * (b.x - a.x)
    found = yield from correct(problem, guess, here.tangent)
    if found is None:
        return None
    x, reading, iterations, residual = found
    tangent = tangent_of(reading.jacobian, here.tangent)
    if tangent is None:
        return None
    return Point(x, tangent, reading.found, iterations, residual, here.s + float(np.linalg.norm(x - here.x)))


def _located(problem: Problem, here: Point, there: Point, test: Test) -> Steps[Point | None]:
    """Where ``test`` vanishes, by the method of Chandrupatla 1997 (bisection and inverse quadratic interpolation)."""
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
        if width < LOCATED or fa == 0.0:
            return last
        xi, phi = (sa - sb) / (sc - sb), (fa - fb) / (fc - fb) if fc != fb else 2.0
        share = 0.5
        if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            share = fa / (fb - fa) * fc / (fb - fc) + (sc - sa) / (sb - sa) * fa / (fc - fa) * fb / (fc - fb)
        least = 0.5 * LOCATED / width
        share = min(max(share, least), 1.0 - least)
    return last
