"""Linear systems of shooting, solved with the same bits whatever the processors.

OpenBLAS shares a dense factorisation of some hundred unknowns among threads, which
gives other last bits on other machines and, beside the threads of the flow, takes a
hundred times as long. Of several segments most of the matrix is zero, so SuperLU, which
has no threads, is as fast.
"""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
DENSE = 100  # unknowns up to which OpenBLAS uses one thread


def solve(matrix: Array, right: Array) -> Array:
    """The solution of ``matrix`` [n, n] times x = ``right`` [n]. LinAlgError where the
    matrix is singular."""
    if len(matrix) < DENSE:
        return np.asarray(np.linalg.solve(matrix, right))
    return np.asarray(_factors(matrix).solve(right))


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


def _factors(matrix: Array) -> Any:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    if not np.isfinite(matrix).all():
        raise np.linalg.LinAlgError("Not finite")
    try:
        return splu(csc_matrix(matrix))
    except RuntimeError as error:  # exactly singular
        raise np.linalg.LinAlgError(str(error)) from None


def _parity(permutation: np.ndarray[Any, np.dtype[Any]]) -> float:
    """1 for an even permutation, -1 for an odd one."""
    left, cycles = [True] * len(permutation), 0
    for start in range(len(permutation)):
        if left[start]:
            cycles += 1
            at = start
            while left[at]:
                left[at] = False
                at = int(permutation[at])
    return -1.0 if (len(permutation) - cycles) % 2 else 1.0
