"""Newton's method for the zeros of a residual in one parameter.

A problem has m equations in m + 1 unknowns, all in natural scales; the last unknown is
the continuation parameter. Evaluating it takes pieces of trajectories: the functions
here are generators that yield legs and are sent their ends, so that many branches
advance side by side and the legs of one round run in one batch
(:func:`nsdrill.orbit.flow.advance`). Nothing here depends on what the legs stand
for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

import numpy as np

from nsdrill.data import Array
from nsdrill.orbit.flow import Task
from nsdrill.orbit.shooting import Orbit
from nsdrill.records import dataclass

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

MAX_ITERATIONS = 9
# lengths of steps of Newton's method, in natural scales
NEWTON_TOLERANCE, STALLED_TOLERANCE, MAX_NEWTON_STEP = 1e-8, 1e-5, 3000.0
RESIDUAL_NOISE = 1e-7  # due to the steps of the integration, in natural scales
DENSE = 100  # unknowns up to which OpenBLAS uses one thread


@dataclass(frozen=True)
class Evaluation:
    """A problem at ``x``: ``residual`` [m], ``jacobian`` [m, m + 1]; ``solution()``
    returns what :attr:`Point.found` holds."""

    residual: Array
    jacobian: Array
    solution: Callable[[], Orbit]


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
    found: Orbit
    iterations: int
    residual: float
    s: float = 0.0
    orientation: float = 0.0


def tangent_of(jacobian: Array, reference: Array) -> Array | None:
    """The unit null vector of ``jacobian`` [m, m + 1] whose product with ``reference``
    is positive; None where the null space has more dimensions."""
    try:
        vector = solve(np.vstack([jacobian, reference]), np.append(np.zeros(len(jacobian)), 1.0))
    except np.linalg.LinAlgError:
        vector = np.linalg.svd(jacobian)[2][-1]
    length = np.linalg.norm(vector)
    return vector / length if np.isfinite(length) and length > 0 else None


def orientation_of(jacobian: Array, tangent: Array) -> float:
    """The sign of the determinant of ``jacobian`` [m, m + 1] bordered by ``tangent``."""
    return sign_of_determinant(np.vstack([jacobian, tangent]))


def newton(problem: Problem, guess: Array, normal: Array) -> Task[tuple[Array, Evaluation, int, float] | None]:
    """The zero of ``problem`` in the plane through ``guess`` with this ``normal``, by
    Newton's method: (x, evaluation, iterations, residual). None where it does not
    converge.

    It stops at a step below ``NEWTON_TOLERANCE``, or where a step below
    ``STALLED_TOLERANCE`` no longer shrinks and the residual is below
    ``RESIDUAL_NOISE``: the steps of the integration leave noise, which large
    multipliers amplify. Where the noise makes the next step longer, the last such
    point is the zero.
    """
    x, previous_size, factor = guess, np.inf, problem.tolerance_factor
    last = None  # the last point whose step and residual are noise
    for iteration in range(1, MAX_ITERATIONS + 1):
        evaluation = yield from problem.evaluate(x)
        if evaluation is None:
            return None
        residual = float(np.max(np.abs(evaluation.residual)))
        system = np.vstack([evaluation.jacobian, normal])
        try:
            step = solve(system, -np.append(evaluation.residual, normal @ (x - guess)))
        except np.linalg.LinAlgError:
            return None
        size = float(np.max(np.abs(step)))
        if not size <= MAX_NEWTON_STEP:
            return None
        found = x, evaluation, iteration, residual
        is_noise = size < factor * STALLED_TOLERANCE and residual < factor * RESIDUAL_NOISE
        if size < factor * NEWTON_TOLERANCE or (is_noise and size >= 0.5 * previous_size):
            return found
        if iteration > 3 and size > 2.0 * previous_size:
            break
        last = found if is_noise else last
        x, previous_size = x + step, size
    return last


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
    orientation = orientation_of(evaluation.jacobian, tangent)
    return Point(x, tangent, evaluation.solution(), iterations, residual, s, orientation)


def parameter_normal(length: int) -> Array:
    """The normal of the planes of constant continuation parameter."""
    return np.eye(length)[-1]


def corrected_at_parameter(problem: Problem, guess: Array) -> Task[Point | None]:
    """The zero of ``problem`` near ``guess`` at the same value of the continuation
    parameter."""
    normal = parameter_normal(len(guess))
    return (yield from corrected(problem, guess, normal, normal))


def corrected_between(
    problem: Problem, base: Point, a: Point, b: Point, distances: tuple[float, ...]
) -> Task[tuple[float, Point] | None]:
    """The point between ``a`` and ``b`` at the first of some ``distances`` along the
    tangent of ``base`` where Newton's method converges, with that distance; it may fail
    at one place only, as at a contact. None where it fails at all of them."""
    sa, sb = (float(base.tangent @ (point.x - base.x)) for point in (a, b))
    for s in distances:
        guess = a.x + (s - sa) / (sb - sa) * (b.x - a.x)
        point = yield from corrected(problem, guess, base.tangent, base.tangent, base)
        if point is not None:
            return s, point
    return None


# Linear systems of multiple shooting, solved to the same bits on all processors: OpenBLAS
# divides a dense factorisation of a hundred unknowns or more among threads. The last bits of
# the result then depend on the machine, and beside the threads of the flow it takes a hundred
# times as long. With several segments most of the matrix is zero, and SuperLU, which has no
# threads, is as fast as OpenBLAS alone.


def solve(matrix: Array, rhs: Array) -> Array:
    """The solution of ``matrix`` [n, n] times x = ``rhs`` [n]. LinAlgError where the
    matrix is singular."""
    if len(matrix) < DENSE:
        return np.asarray(np.linalg.solve(matrix, rhs))
    return np.asarray(_factors(matrix).solve(rhs))


def sign_of_determinant(matrix: Array) -> float:
    """The sign of the determinant of ``matrix`` [n, n]: 1, -1, or 0 where it is
    singular."""
    if len(matrix) < DENSE:
        return float(np.linalg.slogdet(matrix)[0])
    try:
        factors = _factors(matrix)
    except np.linalg.LinAlgError:
        return 0.0
    diagonal = float(np.prod(np.sign(factors.U.diagonal())))
    return diagonal * _parity(factors.perm_r) * _parity(factors.perm_c)


def _factors(matrix: Array) -> SuperLU:
    from scipy.sparse import csc_matrix, linalg

    if not np.isfinite(matrix).all():
        raise np.linalg.LinAlgError("Not finite")
    try:
        return linalg.splu(csc_matrix(matrix))
    except RuntimeError as error:  # exactly singular
        raise np.linalg.LinAlgError(str(error)) from None


def _parity(permutation: Array) -> float:
    """1 for an even permutation, -1 for an odd one: by its pairs in falling order."""
    return -1.0 if np.triu(np.greater.outer(permutation, permutation)).sum() % 2 else 1.0
