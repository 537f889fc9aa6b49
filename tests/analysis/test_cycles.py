"""The period of a torsional motion from samples of a signal."""

import math

import numpy as np
import pytest

from nsdrill.analysis.cycles import cycles_of, period_of


def stick_slip(t, period=4.0, slipping=0.6):
    """A bit that is stuck for a part of each cycle and slips in one arch."""
    phase = np.mod(t, period) / (slipping * period)
    return np.where(phase < 1.0, 10.0 * np.sin(math.pi * np.minimum(phase, 1.0)), 0.0)


def test_the_period_of_a_known_motion():
    t = np.arange(0.0, 60.0, 0.05)
    assert period_of(t, stick_slip(t)) == pytest.approx(4.0, rel=1e-3)
    assert period_of(t, -3e3 * np.sin(2 * math.pi * t / 2.7) + 8e3) == pytest.approx(2.7, rel=1e-3)


def test_ripples_within_a_cycle_are_not_counted():
    """Plain crossings of the mean count more."""
    t = np.arange(0.0, 60.0, 0.05)
    rippled = stick_slip(t) + 2.2 * np.sin(2 * math.pi * t / 0.5)
    plain = np.count_nonzero(np.diff(np.sign(rippled - rippled.mean())) > 0)
    assert plain >= 25  # of 15 cycles
    assert period_of(t, rippled) == pytest.approx(4.0, rel=0.02)


def test_noise_of_a_log_is_not_counted():
    t = np.arange(0.0, 120.0, 0.2)
    noisy = stick_slip(t) + np.random.default_rng(1).normal(0.0, 0.4, len(t))
    assert period_of(t, noisy) == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize(("duration", "step"), [(12.0, 0.05), (120.0, 0.8), (0.1, 0.05)])
def test_no_period_of_too_few_cycles_or_samples(duration, step):
    """Three rises bound two cycles; five samples a cycle may miss a swing."""
    t = np.arange(0.0, duration, step)
    assert math.isnan(period_of(t, stick_slip(t)))


def test_gaps_are_passed_over_and_a_constant_has_none():
    t = np.arange(0.0, 60.0, 0.05)
    signal = stick_slip(t)
    signal[100:104] = np.nan
    assert period_of(t, signal) == pytest.approx(4.0, rel=1e-3)
    assert math.isnan(period_of(t, np.full(len(t), 3.0)))


@pytest.mark.parametrize("step", [0.02, 0.6])
def test_cycles_of_different_depth_have_their_period(step):
    """A torque of a string with waves: now and then a dip is much deeper, and the others do
    not reach a quarter of the range."""
    t = np.arange(0.0, 120.0, step)
    signal = 20e3 + 4e3 * np.sin(2 * math.pi * t / 4.0)
    signal[(t > 42.0) & (t < 44.0)] -= 16e3
    assert math.isnan(period_of(t, signal))
    found = cycles_of(t, signal)
    assert found.period == pytest.approx(4.0, rel=5e-3)
    assert found.regular
    noise = np.random.default_rng(0).normal(20e3, 4e3, len(t))
    assert not cycles_of(t, noise).regular
