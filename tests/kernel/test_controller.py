"""The control of the step, against the formula of Gustafsson 1991."""

import math

import pytest
from machine_code import of_numbers

from nsdrill.abi import LIMIT, NONFINITE, NOTHING, UNDERFLOW
from nsdrill.compiler.functions import inlined
from nsdrill.kernel.steppers import decide

PROPORTIONAL, PER_ORDER = 0.17, 0.2


@inlined
def of_one_pair(squared_error, step, last_level, growth, least_step, exhausted):
    """With the numbers of a pair of order 5."""
    accepted, proposed, level, next_growth, attention = decide(
        squared_error, step, last_level, growth, least_step, exhausted > 0.0, 0.17, 0.2
    )
    return 1.0 if accepted else 0.0, proposed, level, next_growth, float(attention)


@pytest.fixture(scope="module")
def decided():
    return of_numbers(of_one_pair, 5)


@pytest.mark.parametrize(("error", "before"), [(0.9, 0.9), (0.5, 0.01), (0.2, 0.8), (0.02, 0.3)])
def test_the_next_step_is_that_of_the_two_last_errors(decided, error, before):
    accepted, step, level, growth, attention = decided(error**2, 0.01, 2 * math.log2(before), 3.0, 1e-9, 0.0)
    assert accepted
    assert attention == NOTHING
    assert step == pytest.approx(0.01 * 0.9 * error**-PROPORTIONAL * before**0.04, rel=1e-12)
    assert level == pytest.approx(2 * math.log2(error), rel=1e-12)
    assert growth == 3.0


def test_a_rejected_step_is_shrunk_by_its_own_error(decided):
    accepted, step, level, growth, attention = decided(4.0**2, 0.01, -1.0, 3.0, 1e-9, 0.0)
    assert not accepted
    assert step == pytest.approx(0.01 * 0.9 * 4.0**-PER_ORDER, rel=1e-12)
    assert (level, growth, attention) == (-1.0, 0.0, NOTHING)  # of the last accepted one; no growth after it


def test_the_step_changes_within_bounds(decided):
    """To an eighth and to eight times, and not above itself after a rejection."""
    assert decided(0.0, 0.01, -10.0, 3.0, 1e-9, 0.0)[1] == pytest.approx(0.08, rel=1e-12)
    assert decided(0.0, 0.01, -10.0, 0.0, 1e-9, 0.0)[1] == pytest.approx(0.01, rel=1e-12)
    for error in (1e15, math.inf, math.nan):
        assert decided(error, 0.01, -10.0, 3.0, 1e-9, 0.0)[1] == pytest.approx(0.01 / 8, rel=1e-12)


def test_what_asks_for_attention(decided):
    for error, least, exhausted, found in (
        (1e6, 0.01, 0.0, UNDERFLOW),
        (math.nan, 0.01, 0.0, NONFINITE),
        (0.5, 1e-9, 1.0, LIMIT),
        (0.5, 1.0, 0.0, NOTHING),
    ):
        assert decided(error, 0.01, -1.0, 3.0, least, exhausted)[4] == found
