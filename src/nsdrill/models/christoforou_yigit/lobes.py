"""The lobed surface under the bit without further sines: sin(n phi) and cos(n phi) from
sin(phi) and cos(phi).

They follow from the recurrence of the Chebyshev polynomials, sin((k+1) phi) = 2
cos(phi) sin(k phi) - sin((k-1) phi), and the same for the cosine. The number of lobes
is a compile-time constant, so that the compiler unrolls the loop.
"""

from __future__ import annotations

from nsdrill.compiler.functions import inlined
from nsdrill.compiler.words import fma


@inlined
def multiple_sine(s: float, c: float, lobes: int) -> float:
    """sin(lobes phi) from s = sin(phi), c = cos(phi)."""
    previous, current = 0.0, s
    for _ in range(lobes - 1):
        previous, current = current, fma(2.0 * c, current, -previous)
    return current


@inlined
def multiple_cosine(c: float, lobes: int) -> float:
    """cos(lobes phi) from c = cos(phi)."""
    previous, current = 1.0, c
    for _ in range(lobes - 1):
        previous, current = current, fma(2.0 * c, current, -previous)
    return current
