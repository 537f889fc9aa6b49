"""Sobol indices against functions whose indices are known, through the code that
studies use."""

import math

import numpy as np
import pytest
from scipy import stats

from nsdrill.analysis.sensitivity import indices
from nsdrill.data import Array
from nsdrill.sampling import Uncertain, draw

# Ishigami and Homma (1990), a = 7, b = 0.1; exact indices from the variances of its
# parts.
A, B = 7.0, 0.1
PARTS = {"1": 0.5 * (1 + B * math.pi**4 / 5) ** 2, "2": A**2 / 8, "13": 8 * B**2 * math.pi**8 / 225}
VARIANCE = sum(PARTS.values())
FIRST = np.array([PARTS["1"], PARTS["2"], 0.0]) / VARIANCE
TOTAL = np.array([PARTS["1"] + PARTS["13"], PARTS["2"], PARTS["13"]]) / VARIANCE


def ishigami(x: Array) -> Array:
    return np.asarray(np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0]))[:, None]


def samples(count: int, design: str, seed: int = 1) -> Array:
    shapes = {name: {"uniform": [-math.pi, math.pi]} for name in "abc"}
    return np.column_stack([*draw(Uncertain(shapes, samples=count, seed=seed, design=design)).values()])


def test_saltelli_gives_the_indices_of_ishigami():
    x = samples(1 << 14, "saltelli")
    found = indices(x, ishigami(x), "saltelli")
    assert found is not None
    assert found.total is not None
    assert found.variance == pytest.approx(VARIANCE, rel=0.01)
    assert found.first == pytest.approx(FIRST, abs=0.01)
    assert found.total == pytest.approx(TOTAL, abs=0.01)


def test_saltelli_is_that_of_scipy():
    x = samples(256, "saltelli")
    y = ishigami(x)[:, 0]
    mine = indices(x, y[:, None], "saltelli")
    theirs = stats.sobol_indices(
        func={"f_A": y[:256][None], "f_B": y[256:512][None], "f_AB": y[512:].reshape(3, 1, 256)}, n=256
    )
    assert mine is not None
    assert mine.total is not None
    assert mine.first == pytest.approx(np.clip(theirs.first_order.ravel(), 0, 1), abs=1e-12)
    assert mine.total == pytest.approx(theirs.total_order.ravel(), abs=1e-12)


@pytest.mark.parametrize(("count", "within"), [(256, 0.05), (2048, 0.015)])
def test_samples_at_hand_give_the_first_order_indices(count, within):
    for seed in range(3):
        x = samples(count, "sobol", seed)
        found = indices(x, ishigami(x), "sobol")
        assert found is not None
        assert found.total is None
        assert found.first == pytest.approx(FIRST, abs=within)


def test_what_does_not_depend_on_an_unknown_has_no_index():
    rng = np.random.default_rng(3)
    x = samples(512, "sobol")
    found = indices(x, rng.normal(size=(512, 1)), "sobol")  # as of chaotic motion
    assert found is not None
    assert np.all(found.first < 0.04)


def test_yes_and_no_are_answers_too():
    # P(x0 < 0.3 and x1 < 0.5): the parts of the variance of the product of two
    # indicators are known.
    shapes = {name: {"uniform": [0.0, 1.0]} for name in "abc"}
    x = np.column_stack([*draw(Uncertain(shapes, samples=2048, design="saltelli")).values()])
    p, q = 0.3, 0.5
    variance = p * q - (p * q) ** 2
    first = np.array([q**2 * p * (1 - p), p**2 * q * (1 - q), 0.0]) / variance
    both = p * (1 - p) * q * (1 - q) / variance
    found = indices(x, ((x[:, 0] < p) & (x[:, 1] < q)).astype(float)[:, None], "saltelli")
    assert found is not None
    assert found.total is not None
    assert found.first == pytest.approx(first, abs=0.03)
    assert found.total == pytest.approx(first + np.array([both, both, 0.0]), abs=0.03)


def test_missing_answers_are_left_out_where_they_are_missing():
    rng = np.random.default_rng(5)
    for design, count in (("sobol", 1024), ("saltelli", 512)):
        x = samples(count, design)
        y = np.column_stack([ishigami(x), ishigami(x)])
        y[rng.choice(len(y), 40), 1] = np.nan
        found = indices(x, y, design)
        assert found is not None
        assert found.first == pytest.approx(FIRST, abs=0.06)


def test_standard_errors_tell_the_scatter():
    # Independent draws: the scatter over repetitions is what the bootstrap of one of
    # them says.
    rng = np.random.default_rng(11)
    tables = [rng.uniform(-math.pi, math.pi, (200, 3)) for _ in range(40)]
    found = [indices(x, ishigami(x), "sobol") for x in tables]
    firsts = np.array([one.first for one in found if one is not None])
    said = np.mean([one.first_error for one in found if one is not None], axis=0)
    assert said[:2] == pytest.approx(firsts.std(axis=0)[:2], rel=0.35)


def test_what_does_not_vary_has_no_indices():
    x = samples(64, "sobol")
    assert indices(x, np.ones((64, 1)), "sobol") is None
    assert indices(x, np.full((64, 1), np.nan), "sobol") is None
