"""Periods, the 0-1 test and the kind of motion: on made-up returns and on published
cascades."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strings import MAIN

from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.observed import in_the_bit_frame
from nsdrill.observe import motion_kinds
from nsdrill.observe.motion_kinds import classify_motion, period, zero_one
from nsdrill.observe.thresholds import MotionThresholds
from nsdrill.variables import CHAOTIC, DIVERGED, EQUILIBRIUM, OK, PERIODIC, QUASI_PERIODIC, UNDETERMINED, UNSETTLED
from observe.flows import roessler_returns

T = MotionThresholds()
ONES = np.ones((1, 8))


def padded(values: np.ndarray) -> np.ndarray:
    """(returns, columns) as the returns of one point, the other states at rest."""
    out = np.zeros((1, len(values), 8))
    out[0, :, : values.shape[1]] = values
    return out


def logistic(r: float, count: int) -> np.ndarray:
    x, out = 0.4, []
    for n in range(count + 5000):
        x = r * x * (1 - x)
        if n >= 5000:
            out.append(x)
    return np.array(out)


@pytest.mark.parametrize(
    ("r", "expected"),
    [
        # May 1976, Nature 261:459: doublings at 3, 3.449, 3.544, 3.5644, the window of
        # period three from 3.8284.
        (2.8, 1),
        (3.3, 2),
        (3.5, 4),
        (3.55, 8),
        (3.566, 16),
        (3.83, 3),
        (3.9, 0),
        (4.0, 0),
    ],
)
def test_the_cascade_of_the_logistic_map(r, expected):
    fine = MotionThresholds(absolute=1e-6, relative=0.0)
    assert period(padded(logistic(r, 200)[:, None]), ONES, fine)[0] == expected


@pytest.mark.parametrize(
    ("c", "expected"),
    [
        # Peitgen, Jurgens & Saupe, Chaos and Fractals (1992), 12.3: Roessler with a = b
        # = 0.1.
        (4.0, 1),
        (6.0, 2),
        (8.5, 4),
        (8.7, 8),
        (12.0, 3),
        (9.0, 0),
        (18.0, 0),
    ],
)
def test_the_cascade_of_roessler(c, expected):
    returns = roessler_returns(0.1, 0.1, c, Simulation(transient=20000.0, observe=1000.0, rtol=1e-10))
    assert len(returns) > 100
    assert period(padded(returns), ONES, MotionThresholds(absolute=1e-3, relative=0.0))[0] == expected


@pytest.mark.parametrize(("noise", "expected"), [(0.02, 2), (0.04, 0)])
def test_two_returns_are_two_only_where_each_is_close_compared_with_both(noise, expected):
    """Both are within the absolute tolerance of 0.1 of each other, so that this alone
    would take a cloud for a motion of period two."""
    level = np.tile([-0.05, 0.05], 50)
    spread = np.repeat(np.random.default_rng(3).permutation(np.linspace(-0.5, 0.5, 50)), 2)
    returns = level + noise * spread
    assert period(padded(returns[:, None]), ONES, MotionThresholds(absolute=0.1, relative=0.0))[0] == expected


def test_period_needs_three_repeats_and_counts_what_is_there():
    cycle = np.tile([0.0, 5.0, -3.0, 1.0], 10)[:, None]
    assert period(padded(cycle), ONES, T)[0] == 4
    few = padded(cycle)
    few[0, 11:] = np.nan
    assert period(few, ONES, T)[0] == 0
    few[0, :12] = padded(cycle)[0, :12]
    assert period(few, ONES, T)[0] == 4


def test_tolerances_are_absolute_and_relative():
    rng = np.random.default_rng(2)
    noisy = np.tile([0.0, 10.0], 30)[:, None] + rng.uniform(-0.08, 0.08, (60, 1))
    assert period(padded(noisy), ONES, MotionThresholds(absolute=0.01, relative=0.0))[0] == 0
    assert period(padded(noisy), ONES, MotionThresholds(absolute=0.2, relative=0.0))[0] == 2
    assert period(padded(noisy), ONES, MotionThresholds(absolute=0.01, relative=0.02))[0] == 2
    assert period(padded(noisy), 20 * ONES, MotionThresholds(absolute=0.01, relative=0.0))[0] == 2, "in natural scales"


def test_a_slow_spiral_has_no_long_period():
    """It comes near each of its returns again after one turn of the spiral, here eight
    returns: within the tolerance, but not nearer than to others."""
    n = np.arange(120)
    spiral = np.exp(-n / 100)[:, None] * np.stack([np.cos(2 * np.pi * n / 8), np.sin(2 * np.pi * n / 8)], axis=1)
    assert period(padded(spiral), ONES, MotionThresholds(absolute=1.0))[0] == 0
    angle = 2 * np.pi * n / 11
    resonant = 3.0 * np.exp(-n / 400)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert period(padded(resonant), ONES, MotionThresholds(absolute=2.0))[0] == 0
    steady = padded(np.stack([np.cos(2 * np.pi * n / 8), np.sin(2 * np.pi * n / 8)], axis=1))
    assert period(steady, ONES, T)[0] == 8


@given(st.integers(1, 20), st.integers(0, 10**6))
@settings(max_examples=60)
def test_any_cycle_is_found_with_its_least_period(n, seed):
    rng = np.random.default_rng(seed)
    cycle = rng.permutation(n)[:, None] * 3.0
    returns = np.tile(cycle, (5, 1))[: 5 * n - rng.integers(0, n)]
    assert period(padded(returns), ONES, T)[0] == n


def test_plain_python_finds_the_same(monkeypatch):
    rng = np.random.default_rng(2)
    returns = np.tile(rng.normal(size=(6, 3, 4)), (1, 30, 1))
    returns[1] = rng.normal(size=(90, 4))
    returns[2] = 1.0
    returns[3, 5:], returns[4] = np.nan, np.nan
    monkeypatch.setattr(motion_kinds, "LEAST_RETURNS", 90)
    scales = np.ones((6, 4))
    periods, indices = period(returns, scales, T), zero_one(returns, scales)
    assert periods.tolist() == [3, 0, 1, 0, 0, 3]
    for name in ("_make_period", "_make_displacement"):
        plain = getattr(motion_kinds, name)().py_func
        monkeypatch.setattr(motion_kinds, name, lambda plain=plain: plain)
    assert period(returns, scales, T).tolist() == periods.tolist()
    assert zero_one(returns, scales).tobytes() == indices.tobytes()
    assert np.isfinite(indices).tolist() == [True, True, True, False, False, True]


def test_the_zero_one_test_tells_regular_from_chaotic():
    """Logistic map: K = 1 at r = 3.97, near 0 at r = 3.55 (Gottwald & Melbourne 2009,
    section 3); a circle map with the golden mean is quasi-periodic. Too few returns: no
    answer."""
    turn = 2 * np.pi * 0.6180339887498949 * np.arange(1000)
    returns = np.concatenate(
        [
            padded(logistic(3.97, 1000)[:, None]),
            padded(logistic(3.55, 1000)[:, None]),
            padded(np.stack([np.cos(turn), np.sin(turn)], axis=1)),
        ]
    )
    chaotic, cycle, torus = zero_one(returns, np.ones((3, 8)))
    assert chaotic > 0.95
    assert abs(cycle) < 0.1
    assert abs(torus) < 0.1
    assert np.isnan(zero_one(returns[:1, :999], ONES)).all()
    roessler = roessler_returns(0.2, 0.2, 5.7, Simulation(transient=500.0, observe=6500.0))
    assert zero_one(padded(roessler), ONES)[0] > 0.9


def test_the_bit_frame_turns_velocities_along():
    section = {
        f"section_{name}": np.array([value])
        for name, value in {
            "radius": 2.0,
            "whirl_angle": np.pi / 2,
            "radial_velocity": 3.0,
            "whirl_speed": 0.5,
            "axial": 4.0,
            "axial_velocity": 5.0,
            "twist": 6.0,
            "bit_speed": 7.0,
        }.items()
    }
    assert in_the_bit_frame(section)[0] == pytest.approx([0.0, -1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])


def kind(
    found: int = 0,
    settled: int = 1,
    status: int = OK,
    count: int = 1000,
    range_: float = 1.0,
    dimension: int = 9,
    grows: bool = False,
    **features: float,
) -> int:
    made = {
        "axial_min": 0.0,
        "axial_max": range_,
        "bit_speed_min": 3.0,
        "bit_speed_max": 3.0 + range_,
        "radius_max": 1.0 + range_,
    } | features
    arrays = {name: np.array([value]) for name, value in made.items()}
    arrays["section_radius"] = np.where(np.arange(1001) < count, 1.0, np.nan)[None]
    count = np.count_nonzero(np.isfinite(arrays["section_radius"]), axis=-1)
    rests = MAIN.still(arrays, ONES, T.absolute)
    labels = (np.array([value]) for value in (status, settled, grows, found))
    label = classify_motion(arrays, *labels, count, rests, np.array([dimension]), T)
    return int(label[0])


def test_the_kind_of_motion():
    assert kind(found=3, zero_one=0.9) == PERIODIC, "a period is a period, whatever the 0-1 test says"
    assert kind(found=1, zero_one=0.9) == PERIODIC
    assert kind(found=1, range_=0.01, zero_one=np.nan) == EQUILIBRIUM
    assert kind(zero_one=0.95, settled=0) == CHAOTIC
    assert kind(zero_one=0.95, settled=0, grows=True) == UNSETTLED, "what leaves an unstable motion grows"
    assert kind(zero_one=0.05) == QUASI_PERIODIC
    assert kind(zero_one=0.05, settled=0) == UNSETTLED
    assert kind(zero_one=0.5) == UNDETERMINED
    assert kind(zero_one=np.nan) == UNDETERMINED
    assert kind(found=3, count=2, zero_one=np.nan) == UNDETERMINED
    assert kind(found=3, status=DIVERGED, zero_one=np.nan) == UNDETERMINED
    # With the exponent: its sign, with two errors, decides; the 0-1 test is there to be
    # compared only.
    assert kind(zero_one=0.0, lyapunov_exponent=0.3, lyapunov_error=0.1) == CHAOTIC
    assert kind(zero_one=0.95, lyapunov_exponent=0.3, lyapunov_error=0.2) == UNDETERMINED
    assert kind(zero_one=0.95, lyapunov_exponent=0.001, lyapunov_error=0.001) == QUASI_PERIODIC
    assert kind(zero_one=0.95, lyapunov_exponent=-0.3, lyapunov_error=0.1) == UNSETTLED


def test_a_flow_of_less_than_three_dimensions_is_never_chaotic():
    for found in ({"zero_one": 0.95}, {"lyapunov_exponent": 0.3, "lyapunov_error": 0.1}):
        assert kind(**found, dimension=3) == CHAOTIC
        assert kind(**found, dimension=2) == UNDETERMINED
        assert kind(**found, dimension=2, settled=0) == UNSETTLED


def test_zero_is_said_of_an_exponent_only_where_it_is_known_to_be():
    """Between an exponent that is zero, to some accuracy, and one that is not known
    there is a difference."""
    assert kind(lyapunov_exponent=-0.0016, lyapunov_error=0.0001) == UNSETTLED, "a period-1 motion still on the way"
    assert kind(lyapunov_exponent=-0.0016, lyapunov_error=0.0009) == QUASI_PERIODIC
    assert kind(lyapunov_exponent=0.001, lyapunov_error=0.1) == UNDETERMINED
    assert kind(lyapunov_exponent=0.001, lyapunov_error=0.1, settled=0) == UNSETTLED
    assert kind(lyapunov_exponent=0.0015, lyapunov_error=0.0001) == UNDETERMINED, "above zero, but not by the threshold"
    assert kind(lyapunov_exponent=np.nan, lyapunov_error=np.nan) == UNDETERMINED
    assert kind(found=1, lyapunov_exponent=0.001, lyapunov_error=0.1) == PERIODIC
