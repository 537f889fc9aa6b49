"""The trade-off of rate and safety: the points, and which of them no other one
beats."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import make_results
from seen import artists

from nsdrill import plot
from nsdrill.data import Results
from nsdrill.plot.kinds.uncertain import pareto_front
from nsdrill.variables import SAMPLE

SPEEDS, WEIGHTS = np.array([2.0, 4.0, 6.0]), np.array([10e3, 20e3])
SAFE = np.array([[4, 3, 1], [3, 2, 0]])  # of 4 samples, by weight and speed


@pytest.fixture
def results() -> Results:
    made = make_results(wob=WEIGHTS, rotary_speed=SPEEDS)
    coords = {**made.coords, SAMPLE: np.arange(4)}
    shape = (1, 1, 2, 3, 4)
    response = np.where(np.arange(4) < SAFE[..., None], 0, 2).reshape(shape).astype(np.int8)
    rate = np.broadcast_to((np.outer(WEIGHTS / 1e4, SPEEDS) / 3600.0)[None, None, ..., None], shape)
    variables = {
        "status": np.ones(shape, np.int8),
        "response": response,
        "rate_of_penetration": rate.copy(),
        "mechanical_specific_energy": 1e8 / np.maximum(rate, 1e-9),
    }
    return Results(coords, variables, made.attrs)


def test_the_front_is_what_nothing_beats():
    rng = np.random.default_rng(2)
    rate, probability = rng.integers(0, 8, (2, 60)).astype(float)
    beaten = [
        any(
            (r >= rate[i]) & (p >= probability[i]) & ((r > rate[i]) | (p > probability[i]))
            for r, p in zip(rate, probability, strict=True)
        )
        for i in range(60)
    ]
    expected = {(rate[i], probability[i]) for i in range(60) if not beaten[i]}
    found = pareto_front(rate, probability)
    assert {(rate[i], probability[i]) for i in found} == expected
    assert np.all(np.diff(probability[found]) > 0)


def test_the_points_are_rate_and_probability(results):
    figure = plot.draw(results, "trade-off")
    axes = figure.axes[0]
    [points] = artists(axes, "points")
    expected = np.column_stack([(25.0 * SAFE).ravel(), np.outer(WEIGHTS / 1e4, SPEEDS).ravel()])
    np.testing.assert_allclose(points.get_offsets(), expected)
    # 12 m/h is never safe, 8 in half of the samples, 6 in one: beaten; 4 in three, 2 in
    # all.
    [line] = artists(axes, "front")
    np.testing.assert_allclose(np.column_stack(line.get_data()), [[0, 12], [50, 8], [75, 4], [100, 2]])
    texts = [text.get_text() for text in axes.texts]
    assert "20 kN, 6 rad/s" in texts
    assert axes.get_ylabel() == "Rate of penetration [m/h]"


def test_an_energy_without_end_is_no_colour(results):
    results.variables["mechanical_specific_energy"][:] = np.inf
    axes = plot.draw(results, "trade-off", units="field").axes[0]
    [points] = artists(axes, "points:no energy")
    assert len(points.get_offsets()) == 6
