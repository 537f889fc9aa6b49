"""Samples of the unknowns, against problems whose answer is known, and against what
coverage demands."""

from zlib import crc32

import numpy as np
import pytest
from scipy.stats import binom

from nsdrill.analysis.fitting import Measured, end_pressed, posterior
from nsdrill.figures.measured_overlay import bins_for

LINEAR = np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.3], [0.2, 0.0, 1.0], [1.0, 1.0, 1.0], [1.0, -1.0, 0.0]])


def test_a_linear_problem_has_the_posterior_of_the_textbook():
    """Prior N(0, 1) and Gaussian errors: the covariance is (1 + A^T A / s^2)^-1, the
    mean that times A^T y / s^2."""
    rng, error = np.random.default_rng(3), 0.4
    y = LINEAR @ rng.standard_normal(3) + error * rng.standard_normal(5)
    found = posterior(lambda z: z @ LINEAR.T, y, np.full(5, error), 3, batch=400, wanted=2000, rounds=12)
    covariance = np.linalg.inv(np.eye(3) + LINEAR.T @ LINEAR / error**2)
    mean = covariance @ LINEAR.T @ y / error**2
    np.testing.assert_allclose(found.mean, mean, atol=4 * np.sqrt(covariance.max() / found.size))
    np.testing.assert_allclose(found.covariance, covariance, atol=0.15 * covariance.max())
    assert found.beta == 1.0
    # runs that are all but equal give the same
    assert found.spread == pytest.approx(np.zeros(5), abs=5e-3)


def test_a_curved_problem_has_the_posterior_of_a_fine_grid():
    """Two unknowns, a jump and a fold, against sums over 641 x 641 values of prior
    times likelihood."""
    errors = np.array([0.15, 0.2, 0.2])

    def simulate(z):
        jump = 1 / (1 + np.exp(-8 * (z[:, 0] - 0.2)))
        return np.stack([jump * (1 + 0.4 * z[:, 1]), 0.3 * z[:, 1] ** 2 + z[:, 0], z[:, 0] * z[:, 1]], axis=1)

    line = np.linspace(-5.0, 5.0, 641)
    grid = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    for case in range(3):
        rng = np.random.default_rng(case)
        y = simulate(rng.standard_normal((1, 2)))[0] + errors * rng.standard_normal(3)
        logs = -0.5 * np.sum(grid**2, axis=1) - 0.5 * np.sum(((simulate(grid) - y) / errors) ** 2, axis=1)
        weights = np.exp(logs - logs.max())
        weights /= weights.sum()
        mean = weights @ grid
        deviation = np.sqrt(weights @ (grid - mean) ** 2)
        found = posterior(simulate, y, errors, 2, batch=300, rounds=10, wanted=600)
        assert found.size > 300
        assert np.abs(found.mean - mean).max() < 4 * (deviation / np.sqrt(found.size)).max()
        assert found.widths == pytest.approx(deviation, rel=0.12)


def threshold(z):
    """As stick-slip sets in: a jump in one unknown, a sign that is not told of another."""
    jump = 1 / (1 + np.exp(-20 * (z[:, 0] - 0.3)))
    return np.stack([jump * (1 + 0.3 * z[:, 1]), z[:, 1] + 0.2 * jump, np.abs(z[:, 2]), z[:, 2] ** 2 + z[:, 0]], 1)


def noisy(z):
    """As chaotic motion: no two runs are alike."""
    rng = np.random.default_rng(crc32(z.tobytes()))
    smooth = np.stack([z[:, 0] + 0.5 * z[:, 1] ** 2, np.exp(0.5 * z[:, 1]), z[:, 0] * z[:, 2], np.tanh(z[:, 2])], 1)
    return smooth + 0.3 * rng.standard_normal(smooth.shape)


@pytest.mark.parametrize("problem", [threshold, noisy])
def test_the_intervals_hold_the_truth_as_often_as_they_say(problem):
    """Truths from the prior: 90 % intervals hold them in 90 % of the cases (between the
    0.1 % limits of 120)."""
    inside = 0
    for case in range(40):
        rng = np.random.default_rng(case)
        truth = rng.standard_normal((1, 3))
        y = problem(truth)[0] + 0.1 * rng.standard_normal(4)
        found = posterior(problem, y, np.full(4, 0.1), 3, seed=case)
        below = [found.weights @ (found.z[:, i] < truth[0, i]) for i in range(3)]
        inside += sum(0.05 < one < 0.95 for one in below)
    assert binom.ppf(0.001, 120, 0.9) <= inside <= 120


def test_what_the_values_do_not_depend_on_keeps_its_prior():
    found = posterior(lambda z: z[:, :1] * 2.0, np.array([1.0]), np.array([0.1]), 2)
    assert found.widths[0] < 0.1
    assert found.widths[1] == pytest.approx(1.0, abs=0.25)
    assert abs(found.correlations[0, 1]) < 0.4


def test_a_combination_is_told_and_its_parts_are_not():
    found = posterior(lambda z: z.sum(axis=1, keepdims=True), np.array([0.0]), np.array([0.05]), 2)
    assert found.widths == pytest.approx(np.sqrt([0.5, 0.5]), abs=0.15)
    assert found.correlations[0, 1] < -0.95


def test_failed_runs_have_no_weight():
    def simulate(z):
        return np.where(z[:, :1] > 0.0, np.nan, z[:, :1])

    found = posterior(simulate, np.array([0.1]), np.array([0.3]), 1)
    assert found.failed > 0
    assert found.weights[found.z[:, 0] > 0.0].max() == 0.0
    with pytest.raises(ValueError, match="every run"):
        posterior(lambda z: np.full((len(z), 1), np.nan), np.array([0.1]), np.array([0.3]), 1)


def test_data_that_no_run_gives_have_a_large_misfit():
    found = posterior(lambda z: np.repeat(z[:, :1], 2, axis=1), np.array([1.0, -1.0]), np.array([0.05, 0.05]), 1)
    assert found.misfit > 100


@pytest.mark.parametrize(
    ("draw", "width", "expected"),
    [
        # half a normal distribution in front of the end, a tenth of the prior wide
        (lambda z: 1.0 - 0.1 * np.abs(z), 0.3, "high"),
        (lambda z: 0.1 * np.abs(z), 0.3, "low"),
        # a whole one, three of its deviations from the end
        (lambda z: np.clip(0.85 - 0.05 * z, 0.0, 1.0), 0.2, None),
        # as wide as the prior: the data say nothing of it
        (lambda z: 0.5 + 0.5 * np.clip(z / 3, -1, 1), 0.95, None),
        # all at the end
        (lambda z: 1.0 - 0.001 * np.abs(z), 0.1, "high"),
    ],
)
@pytest.mark.parametrize("count", [60, 1000])
def test_an_unknown_that_presses_against_an_end_is_told(draw, width, expected, count):
    """Of sixty samples as of a thousand: the mass lies at the end although little of it
    is in the outermost hundredths."""
    z = np.random.default_rng(3).standard_normal(count)
    assert end_pressed(draw(z), np.full(count, 1 / count), width) == expected


def test_few_samples_are_drawn_in_few_bins():
    """Sixty in eight (2 * 60^(1/3) = 7.8); a million in thirty at most."""
    assert (bins_for(60), bins_for(1000), bins_for(1e6)) == (8, 20, 30)


def points(speeds, values, error, assumed):
    values, at = np.array(values), {"rotary_speed": np.array(speeds)}
    where = tuple(f"line {k}" for k in range(len(values)))
    kept = frozenset({"torque"} if assumed else ())
    return Measured("f.csv", at, {"torque": values}, {"torque": np.full(len(values), error)}, where, (), kept)


def mean_and_width(measured):
    """Of one unknown that is the value itself at all settings."""
    values, errors, _ = measured.flat
    found = posterior(lambda z: np.repeat(z, len(values), axis=1), values, errors, 1, batch=400, wanted=2000, rounds=12)
    return found.mean[0], found.widths[0]


def of_textbook(mean, error):
    """Prior N(0, 1), one value with this error."""
    return mean / (1 + error**2), error / np.sqrt(1 + error**2)


@pytest.mark.parametrize("scatter", [0.0, 0.3])
def test_an_assumed_error_does_not_average_out_over_points_at_one_setting(scatter):
    """Forty rows at one setting know their mean no better than one row with that error does, and as
    they scatter; settings within 5 % are one, as those of stretches of a log."""
    signs = np.tile([1.0, -1.0], 20)
    measured = points(10.0 + 0.2 * signs, 0.8 + scatter * signs, 0.2, True)
    assert measured.settings.tolist() == [0] * 40
    error = np.hypot(0.2, scatter * np.sqrt(40 / 39) / np.sqrt(40))
    assert mean_and_width(measured) == pytest.approx(of_textbook(0.8, error), rel=0.05)
    assert 1.0 <= measured.independent <= 40.0
    assert (measured.independent == pytest.approx(1.0)) == (scatter == 0.0)


def test_a_given_error_averages_out():
    measured = points([10.0] * 40, [0.8] * 40, 0.2, False)
    assert mean_and_width(measured) == pytest.approx(of_textbook(0.8, 0.2 / np.sqrt(40)), rel=0.05)
    assert measured.independent == 40


def test_values_at_settings_of_their_own_keep_their_errors():
    measured = points([8.0, 10.0, 12.0], [0.5, np.nan, 0.7], 0.2, True)
    assert measured.settings.tolist() == [0, 1, 2]
    assert measured.flat[1].tolist() == [0.2, 0.2]
    assert measured.independent == 2
