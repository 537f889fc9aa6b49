"""Two-point Hermite polynomials: against numpy's roots, on steps of smooth motions."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from machine_code import of_numbers

from nsdrill.observe.inside import above, crossings, extreme, has_extremum, lowered, quintic, value


def time_above(g0: float, d0: float, c0: float, g1: float, d1: float, c1: float, level: float) -> float:
    p = quintic(g0, d0, c0, g1, d1, c1)
    theta = extreme(p, d1) if has_extremum(d0, d1) else 1.0
    start, end = g0 > level, g1 > level
    top = value(p, theta) > level
    first, second = crossings(lowered(p, level), theta, start, top, end)
    return above(first, second, 1.0, start, top, end)


share = of_numbers(time_above)


def exact_share(ends: tuple[float, ...], level: float) -> float:
    """The same from all roots of the polynomial."""
    g0, d0, c0, g1, d1, c1 = ends
    rise = g1 - g0
    polynomial = np.polynomial.Polynomial(
        [
            g0 - level,
            d0,
            0.5 * c0,
            10 * rise - 6 * d0 - 4 * d1 - 1.5 * c0 + 0.5 * c1,
            -15 * rise + 8 * d0 + 7 * d1 + 1.5 * c0 - c1,
            6 * rise - 3 * (d0 + d1) - 0.5 * c0 + 0.5 * c1,
        ]
    )
    roots = polynomial.roots()
    real = roots[(abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)].real
    cuts = np.concatenate([[0.0], np.sort(real), [1.0]])
    middles = 0.5 * (cuts[:-1] + cuts[1:])
    return float(np.sum(np.diff(cuts)[polynomial(middles) > 0]))


@settings(max_examples=400, deadline=None)
@given(
    step=st.floats(0.01, 2.0),
    phase=st.floats(0.0, 2 * math.pi),
    overtone=st.floats(-0.05, 0.05),
    height=st.floats(-0.3, 1.3),
)
# a graze: both ends below, the top above
@example(step=1.0, phase=math.pi / 2 - 0.5, overtone=0.0, height=1.1)
@example(step=1.0, phase=0.3, overtone=0.0, height=0.5)  # no turn
@example(step=2.0, phase=1.5707, overtone=0.0, height=0.3)  # the turn is next to the beginning
# the turn is just before the step
@example(step=1.0, phase=math.pi / 2 + 1e-6, overtone=0.0, height=0.9999)
@example(step=1.0, phase=math.pi / 2 - 1 - 1e-6, overtone=0.0, height=0.9999)  # just after
def test_time_above_a_level_is_that_of_the_polynomials_roots(step, phase, overtone, height):
    angles = np.array([phase, phase + step])
    g = np.sin(angles) + overtone * np.sin(2 * angles)
    d = step * (np.cos(angles) + 2 * overtone * np.cos(2 * angles))
    c = -(step**2) * (np.sin(angles) + 4 * overtone * np.sin(2 * angles))
    ends = (g[0], d[0], c[0], g[1], d[1], c[1])
    inside = np.sin(np.linspace(angles[0], angles[1], 1001)) + overtone * np.sin(
        2 * np.linspace(angles[0], angles[1], 1001)
    )
    low, high = inside.min(), inside.max()
    level = low + height * (high - low)
    # Within a millionth of the top it is the top itself, found to 1e-4 of the step,
    # that decides.
    if min(abs(level - low), abs(level - high)) < 1e-6 * (high - low):
        return
    assert share(*ends, level) == pytest.approx(exact_share(ends, level), abs=1e-8)
