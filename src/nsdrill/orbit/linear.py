"""Linear systems of multiple shooting, solved to the same bits on all processors.

OpenBLAS divides a dense factorisation of a hundred unknowns or more among threads. The
last bits of the result then depend on the machine, and beside the threads of the flow
it takes a hundred times as long. With several segments most of the matrix is zero, and
SuperLU, which has no threads, is as fast as OpenBLAS alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

from nsdrill.data import Array
from nsdrill.models.base import Symmetry

DENSE = 100  # unknowns up to which OpenBLAS uses one thread


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
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    if not np.isfinite(matrix).all():
        raise np.linalg.LinAlgError("Not finite")
    try:
        return splu(csc_matrix(matrix))
    except RuntimeError as error:  # exactly singular
        raise np.linalg.LinAlgError(str(error)) from None


def _parity(permutation: Array) -> float:
    """1 for an even permutation, -1 for an odd one: by its pairs in falling order."""
    return -1.0 if np.triu(np.greater.outer(permutation, permutation)).sum() % 2 else 1.0


# The rotating frame of the drive, in which motions repeat.


def rotated(symmetry: Symmetry, state: Array, angle: float | Array) -> Array:
    """States (..., states) rotated by ``angle`` [rad], a number or an array over all
    but the last dimension."""
    rotated_state = np.array(state, dtype=float)
    cosine, sine = np.cos(angle), np.sin(angle)
    for x, y in symmetry.turned:
        rotated_state[..., x] = cosine * state[..., x] - sine * state[..., y]
        rotated_state[..., y] = sine * state[..., x] + cosine * state[..., y]
    return rotated_state


def rotation_matrices(symmetry: Symmetry, states: int, angles: Array) -> Array:
    """The matrices [n, states, states] of :func:`rotated` for ``angles`` [n]."""
    return np.swapaxes(rotated(symmetry, np.tile(np.eye(states), (len(angles), 1, 1)), angles[:, None]), 1, 2)


def rotation_derivative(symmetry: Symmetry, state: Array) -> Array:
    """The derivative of :func:`rotated` by the angle, at the angle 0."""
    derivative = np.zeros_like(state)
    for x, y in symmetry.turned:
        derivative[..., x], derivative[..., y] = -state[..., y], state[..., x]
    return derivative
