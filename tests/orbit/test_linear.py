"""Linear systems of shooting: the same answers as NumPy's, whatever solves them."""

import numpy as np
import pytest

from nsdrill.orbit.newton import DENSE, sign_of_determinant, solve
from nsdrill.orbit.shooting import shooting_jacobian


def shooting(segments, seed):
    """The matrix of a motion of so many segments with eight states, bordered by a dense
    row and column."""
    rng = np.random.default_rng(seed)
    made = rng.normal(size=(8 * segments + 1, 8 * segments + 1))
    made[:-1, :-1] = shooting_jacobian(rng.normal(size=(segments, 8, 8)))
    return made


@pytest.mark.parametrize("segments", [1, 4, 12, 13, 32])
def test_solutions_and_signs(segments):
    signs = set()
    for seed in range(12):
        matrix = shooting(segments, seed)
        wanted = np.random.default_rng(100 + seed).normal(size=len(matrix))
        assert solve(matrix, matrix @ wanted) == pytest.approx(wanted, abs=1e-8 * np.linalg.cond(matrix))
        signs.add(sign_of_determinant(matrix))
        assert sign_of_determinant(matrix) == np.linalg.slogdet(matrix)[0]
    assert signs == {1.0, -1.0}


@pytest.mark.parametrize("size", [DENSE - 1, DENSE + 1])
def test_singular_matrices(size):
    matrix = np.eye(size)
    matrix[3] = 0.0
    assert sign_of_determinant(matrix) == 0.0
    with pytest.raises(np.linalg.LinAlgError):
        solve(matrix, np.ones(size))
