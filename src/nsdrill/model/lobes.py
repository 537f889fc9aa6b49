"""The lobed surface under the bit without a second sine: sin(n phi) and cos(n phi) from sin(phi) and cos(phi).

sin(n phi) = sin(phi) U_{n-1}(cos phi) and cos(n phi) = T_n(cos phi), with the Chebyshev polynomials of both kinds, for n
from 1 to 8. Their coefficients are parameters of the lane, so that all lobe numbers share one code.
"""

from __future__ import annotations

import numpy as np

MAX_LOBES = 8


def sine_polynomial(lobes: int) -> np.ndarray:
    """Coefficients of U_{n-1} in rising powers, shape (8,)."""
    return _chebyshev(lobes - 1, second_kind=True)


def cosine_polynomial(lobes: int) -> np.ndarray:
    """Coefficients of T_n in rising powers, shape (9,)."""
    return np.append(_chebyshev(lobes, second_kind=False)[:8], 128.0 if lobes == MAX_LOBES else 0.0)


def _chebyshev(degree: int, second_kind: bool) -> np.ndarray:
    before = np.zeros(MAX_LOBES + 1)
    now = np.zeros(MAX_LOBES + 1)
    before[0] = 1.0
    now[1] = 2.0 if second_kind else 1.0
    if degree == 0:
        now = before
    for _ in range(degree - 1):
        before, now = now, 2.0 * np.append(0.0, now[:-1]) - before
    return now[:MAX_LOBES]
