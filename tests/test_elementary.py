"""The elementary functions against mpmath: 1 ulp for those of scalars, 2 ulp for sine,
cosine and direction, 1e-9 for the logarithm of the controller."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machine_code import of_numbers

from nsdrill import elementary

mpmath.mp.prec = 160
QUICK = settings(max_examples=200)
finite = st.floats(-1e6, 1e6, allow_nan=False)


sincos = of_numbers(elementary.sincos, 2)
direction, between, log2, exp2, expm1, fma = map(
    of_numbers,
    (
        elementary.direction,
        elementary.angle_between,
        elementary.log2,
        elementary.exp2,
        elementary.expm1,
        elementary.fma,
    ),
)


fmod, atan2, log = map(of_numbers, (elementary.fmod, elementary.atan2, elementary.log))


def ulps(found: float, exact: mpmath.mpf, least: float = 1e-300) -> float:
    """The error in units of the last place of the exact value (of ``least`` at least)."""
    size = max(abs(float(exact)), least)
    return float(abs(mpmath.mpf(found) - exact)) / math.ulp(size)


def angles() -> np.ndarray:
    """Over the range of use, evenly and by magnitude, and at the doubles nearest to
    multiples of pi/4."""
    rng = np.random.default_rng(1)
    sizes = 10.0 ** rng.uniform(-12, 5, 500)
    near = np.concatenate([np.arange(-40, 41), rng.integers(-120_000, 120_000, 300)]) * (math.pi / 4)
    return np.concatenate([rng.uniform(-1e5, 1e5, 500), sizes, -sizes, near, np.nextafter(near, np.inf), [0.0]])


def test_sine_and_cosine_are_within_two_ulp():
    worst = max(
        max(ulps(found, exact, 1e-11) for found, exact in zip(sincos(a), (mpmath.sin(a), mpmath.cos(a)), strict=True))
        for a in angles().tolist()
    )
    # Nearer to a zero the two-part pi/2, of 106 bits, leaves an absolute error of
    # 1e-27; an angle of 1e5 is itself known to 1e-11 only.
    assert worst <= 2.0


def test_sine_keeps_its_absolute_accuracy_up_to_a_million_radians():
    rng = np.random.default_rng(2)
    for a in rng.uniform(-1e6, 1e6, 500).tolist():
        s, c = sincos(a)
        assert abs(s - mpmath.sin(a)) < 2.3e-16  # 1 ulp of 1
        assert abs(c - mpmath.cos(a)) < 2.3e-16


def test_direction_is_within_two_ulp():
    rng = np.random.default_rng(3)
    sizes = 10.0 ** rng.uniform(-300, 6, 600)
    edges = np.array([0.66, 2.41421356237309504880, 1.0])
    edges = np.concatenate([edges, np.nextafter(edges, 0), np.nextafter(edges, 9)])
    points = np.concatenate([rng.uniform(-1e6, 1e6, 300), rng.uniform(-4, 4, 1000), sizes, -sizes, edges, -edges])
    assert max(ulps(direction(x), 2 / mpmath.pi * mpmath.atan(x)) for x in points.tolist()) <= 2.0


def test_logarithm_and_power_of_two_are_good_to_1e_9():
    rng = np.random.default_rng(4)
    # the controller bounds the squared error to this range
    for x in (10.0 ** rng.uniform(-16, 16, 500)).tolist():
        assert abs(log2(x) - math.log2(x)) < 1e-9
    for x in rng.uniform(-1000, 1000, 500).tolist():
        assert abs(exp2(x) / 2.0**x - 1) < 1e-9


@pytest.mark.parametrize("power", [-50, -1, 0, 1, 2, 53])
def test_whole_powers_of_two_are_exact(power):
    assert exp2(float(power)) == 2.0**power
    assert log2(2.0**power) == power


def test_fused_multiply_add_rounds_once():
    # (1 + 2^-30)^2 - (1 + 2^-29) = 2^-60, lost when the product is rounded first
    a = 1 + 2.0**-30
    assert fma(a, a, -(1 + 2.0**-29)) == 2.0**-60


@given(finite)
@QUICK
def test_sine_is_odd_and_cosine_even(angle):
    s, c = sincos(angle)
    assert sincos(-angle) == (-s, c)


@given(finite)
@QUICK
def test_sine_and_cosine_lie_on_the_unit_circle(angle):
    s, c = sincos(angle)
    assert abs(s * s + c * c - 1) <= 4.5e-16  # two roundings of squares, each off by 1 ulp at most
    assert abs(s) <= 1
    assert abs(c) <= 1


@given(st.floats(-1e300, 1e300))
@QUICK
def test_direction_is_odd_and_bounded(x):
    assert direction(-x) == -direction(x)
    assert abs(direction(x)) <= 1.0


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
@QUICK
def test_direction_never_decreases_by_more_than_its_error(x, y):
    low, high = sorted((x, y))
    assert direction(low) <= direction(high) + 2 * math.ulp(abs(direction(high)))


@given(st.floats(-900, 900))
@QUICK
def test_logarithm_undoes_the_power(x):
    assert abs(log2(exp2(x)) - x) < 3e-9


def test_a_blown_up_angle_stays_visible():
    """NaN in, NaN out: the step is then rejected and the run marked as diverged."""
    assert all(map(math.isnan, sincos(math.nan)))
    assert math.isnan(direction(math.nan))


def test_the_exponential_less_one_is_within_two_ulp():
    rng = np.random.default_rng(4)
    edges = -(np.arange(1, 40) - 0.5) * math.log(2)  # where the whole number of halvings changes
    values = np.concatenate([-(10.0 ** rng.uniform(-300, 2.8, 800)), -rng.uniform(0, 2, 800), edges])
    values = np.concatenate([values, np.nextafter(edges, 0), np.nextafter(edges, -1e9), [0.0, -0.0, -700.0]])
    assert max(ulps(expm1(x), mpmath.expm1(x)) for x in values.tolist()) <= 2.0
    assert expm1(-1e9) == expm1(-700.0) == -1.0


def test_angle_between_two_vectors():
    """As the arctangent of cross and dot product has it; 0 where both lie on one line."""

    rng = np.random.default_rng(3)
    for x0, y0, x1, y1 in rng.normal(size=(400, 4)).tolist():
        exact = math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)
        assert between(x0, y0, x1, y1) == pytest.approx(exact, abs=1e-14)
    assert between(1.0, 0.0, -2.0, 0.0) == between(3.0, 0.0, 1.0, 0.0) == between(0.0, 0.0, 1.0, 0.0) == 0.0
    assert between(1.0, 0.0, 0.0, -1.0) == pytest.approx(-math.pi / 2, abs=1e-15)


# Zeros, infinities, NaN, and the ends of the ranges of normal and of all numbers.
SPECIAL = (0.0, math.inf, math.nan, 1.0, 5e-324, 2.2250738585072014e-308, 1e-310, 1.7976931348623157e308, 1e308, 0.1)
SIGNED = (*SPECIAL, *(-x for x in SPECIAL))


def bits_of(x: float) -> float | bytes:
    """The bits of a number; those of all NaN are the same."""
    return "NaN" if math.isnan(x) else np.float64(x).tobytes()


def magnitudes(rng: np.random.Generator, size: int, low: float = -320.0, high: float = 308.0) -> list[float]:
    return (rng.choice([-1.0, 1.0], size) * 10.0 ** rng.uniform(low, high, size)).tolist()


def test_the_remainder_is_exact():
    """As C has it, of all numbers, also of those below the normal ones; NaN of an infinite
    number and of a zero divisor, where Python's raises."""
    rng = np.random.default_rng(6)
    pairs = [*zip(magnitudes(rng, 3000), magnitudes(rng, 3000), strict=True)]
    pairs += zip(magnitudes(rng, 1000, -3, 9), [2.0 * math.pi] * 1000, strict=True)  # as of phases
    pairs += [(k * y, y) for k in (1.0, 2.0, 3.0, 1e15) for y in magnitudes(rng, 50, -300, 200)]
    for x, y in pairs:
        assert bits_of(fmod(x, y)) == bits_of(math.fmod(x, y)), (x, y)
    with np.errstate(invalid="ignore"):
        for x in SIGNED:
            for y in SIGNED:
                assert bits_of(fmod(x, y)) == bits_of(float(np.fmod(x, y))), (x, y)


def test_the_angle_of_a_vector_is_within_one_ulp():
    rng = np.random.default_rng(7)
    vectors = rng.normal(size=(3000, 2)).tolist()
    vectors += zip(magnitudes(rng, 2000), magnitudes(rng, 2000), strict=True)
    # at the ends of the intervals, and near the axes and the diagonals
    for slope in (0.41421356237309504880, 2.41421356237309504880, 1.0, 1e-9, 1e9):
        for x in (1.0, -1.0, 0.3, -7.7e-200, 3e250):
            vectors += [(near * x, x) for near in (slope, -slope, np.nextafter(slope, 0.0), np.nextafter(slope, 1e99))]
    for y, x in vectors:
        # of numbers below the normal ones the last place is as large as theirs
        assert ulps(atan2(y, x), mpmath.atan2(y, x), 2.3e-308) <= 1.0, (y, x)


def test_angles_of_zeros_and_infinities_are_those_of_c():
    """In all quadrants, on all axes, and at the ends of all ranges."""
    for y in SIGNED:
        for x in SIGNED:
            wanted, found = math.atan2(y, x), atan2(y, x)
            if {abs(y), abs(x)} <= {0.0, 1.0, math.inf} or math.isnan(wanted):
                assert bits_of(found) == bits_of(wanted), (y, x)
            else:
                assert ulps(abs(found), mpmath.atan2(abs(y), x), 2.3e-308) <= 1.0, (y, x)
                assert math.copysign(1.0, found) == math.copysign(1.0, y)


def test_the_logarithm_is_within_one_ulp():
    rng = np.random.default_rng(8)
    values = np.concatenate(
        [
            10.0 ** rng.uniform(-323, 308, 2000),
            rng.uniform(0.3, 3.0, 3000),
            1.0 + rng.normal(size=2000) * 10.0 ** rng.uniform(-15, -1, 2000),
            [5e-324, 2.2250738585072014e-308, 1.7976931348623157e308, np.sqrt(0.5), np.sqrt(2.0), math.e],
            2.0 ** np.arange(-1074.0, 1024.0, 13.0),
        ]
    )
    assert max(ulps(log(x), mpmath.log(x)) for x in values.tolist() if x != 1.0) <= 1.0
    assert bits_of(log(1.0)) == bits_of(0.0)
    assert log(0.0) == log(-0.0) == -math.inf
    assert log(math.inf) == math.inf
    assert all(math.isnan(log(x)) for x in (-5e-324, -1.0, -math.inf, math.nan))


@given(st.floats(allow_nan=False), st.floats(allow_nan=False))
@QUICK
def test_the_angle_is_odd_in_y_and_of_the_quadrant(y, x):
    assert bits_of(atan2(-y, x)) == bits_of(-atan2(y, x))
    found = atan2(y, x)
    assert -math.pi <= found <= math.pi
    assert (abs(found) <= math.pi / 2) or math.copysign(1.0, x) < 0
