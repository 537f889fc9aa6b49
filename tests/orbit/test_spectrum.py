"""All Lyapunov exponents of systems of which they are known."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nsdrill.orbit.flow import advance
from nsdrill.orbit.spectrum import Lost, Spectrum, spectrum
from orbit.flows import duffing, flow_of, lorenz, roessler, van_der_pol


def measured(flow, state, value: float, seconds: float) -> Spectrum:
    values = np.array([value])
    task = spectrum(
        np.array(state, float), 0.0, values, seconds, np.ones(len(state)), float(flow.phase_rate(values)[0])
    )
    return advance(flow, {0: task})[0]


def test_lorenz_has_the_published_spectrum():
    # Sprott, Chaos and Time-Series Analysis (2003), table of common chaotic systems
    found = measured(flow_of(lorenz, 3, singles=3), (1.0, 1.0, 20.0), 28.0, 1000.0)
    assert np.abs(found.exponents - [0.9056, 0.0, -14.5723]).max() < 0.02
    assert (np.abs(found.exponents - [0.9056, 0.0, -14.5723]) < 4.0 * found.errors).all()
    assert found.sum == pytest.approx(-10.0 - 1.0 - 8.0 / 3.0, rel=1e-6)  # the divergence, everywhere the same
    assert found.signs == ["positive", "zero", "negative"]
    assert found.dimension[0] < 2.062 < found.dimension[1]
    assert found.dimension[1] - found.dimension[0] < 0.01


def test_roessler_has_the_published_spectrum():
    # Sprott's numbers are of a = b = 0.2, c = 5.7
    found = measured(flow_of(roessler, 3, singles=3), (1.0, 1.0, 0.0), 5.7, 2000.0)
    assert np.abs(found.exponents - [0.0714, 0.0, -5.3943]).max() < 0.01
    assert found.dimension[0] < 2.0132 < found.dimension[1]
    assert found.dimension[1] - found.dimension[0] < 0.01


def test_volumes_shrink_by_the_damping_of_a_forced_oscillator():
    found = measured(flow_of(duffing, 2, forced=True), (0.1, 0.0), 1.2, 300.0)
    assert found.sum == pytest.approx(-0.1, rel=1e-9)
    assert (found.signs, found.dimension) == (["negative", "negative"], (0.0, 0.0))


def test_a_cycle_has_one_exponent_of_zero_and_the_other_of_its_multiplier():
    flow = flow_of(van_der_pol, 2)
    found = measured(flow, (2.0, 0.0), 1.0, 300.0)

    # of the divergence, 1 - x^2, along the cycle, by an integration of its own
    def rates(t, y):
        return [y[1], (1.0 - y[0] ** 2) * y[1] - y[0], 1.0 - y[0] ** 2]

    settled = solve_ivp(rates, (0.0, 100.0), [2.0, 0.0, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]
    crossing = lambda t, y: y[1]  # noqa: E731
    crossing.direction = -1.0
    run = solve_ivp(rates, (0.0, 50.0), [*settled[:2], 0.0], events=crossing, rtol=1e-11, atol=1e-13)
    times, states = run.t_events[0], run.y_events[0]
    rate = (states[-1, 2] - states[0, 2]) / (times[-1] - times[0])
    assert found.exponents[1] == pytest.approx(rate, abs=4.0 * found.errors[1])
    assert found.exponents[1] == pytest.approx(rate, rel=1e-3)
    assert (found.signs, found.dimension) == (["zero", "negative"], (1.0, 1.0))


def test_the_error_holds_that_the_directions_have_not_turned_into_place():
    """A weakly damped cycle, of which the second exponent is near the first."""
    for seconds in (20.0, 40.0, 80.0):
        found = measured(flow_of(van_der_pol, 2), (2.0, 0.0), 0.05, seconds)
        assert abs(found.exponents[0]) < 3.0 * found.errors[0], seconds


def test_intervals_become_shorter_where_directions_grow_apart():
    long, short = (measured(flow_of(lorenz, 3, singles=3), (1.0, 1.0, 20.0), 28.0, seconds) for seconds in (200, 10))
    assert long.intervals == 200
    assert short.intervals == 100
    stiff = measured(flow_of(van_der_pol, 2), (2.0, 0.0), 20.0, 100.0)
    assert stiff.intervals > 100  # with intervals of a second the second direction is lost in rounding
    assert stiff.exponents[1] < -20.0


def test_a_motion_that_leaves_is_not_measured():
    def away(t, phase, s, p, o):
        return {"v": p.a * s.x * s.x * s.x}

    with pytest.raises(Lost):
        measured(flow_of(away, 2), (1.0, 1.0), 1.0, 100.0)


@pytest.mark.parametrize(
    ("exponents", "error", "signs", "dimension"),
    [
        ((0.5, 0.0, -2.0), 1e-6, ["positive", "zero", "negative"], (2.25, 2.25)),
        ((-1.0, -2.0), 1e-3, ["negative", "negative"], (0.0, 0.0)),
        ((1e-4, -1.0, -2.0), 1e-3, ["zero", "negative", "negative"], (1.0, 1.0)),  # a cycle
        ((-1e-4, -1.0, -2.0), 1e-3, ["zero", "negative", "negative"], (1.0, 1.0)),
        ((0.2, 0.1, -0.1), 1e-6, ["positive", "positive", "negative"], (3.0, 3.0)),
        ((-1e-4, -0.03, -2.0), 0.04, ["undetermined", "undetermined", "negative"], (0.0, 2.06)),
    ],
)
def test_the_dimension_of_an_attractor(exponents, error, signs, dimension):
    found = Spectrum(np.array(exponents), np.full(len(exponents), error), 1.0, 1)
    assert found.signs == signs
    assert found.dimension == pytest.approx(dimension, abs=0.01)


def test_the_error_of_a_motion_of_few_cycles_covers_what_the_weights_do():
    """Van der Pol's fast direction over some 6 cycles, each of which stretches unevenly."""
    flow = flow_of(van_der_pol, 2)
    exact = measured(flow, (2.0, 0.0), 3.0, 600.0).exponents[1]
    for seconds in (50.0, 53.0, 56.0):
        short = measured(flow, (2.0, 0.0), 3.0, seconds)
        assert abs(short.exponents[1] - exact) < 4.0 * short.errors[1]
