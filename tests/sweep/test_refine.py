"""Refinement on made-up responses: the border of the full map from a part of its runs."""

from collections.abc import Callable

import numpy as np
import pytest

from nsdrill.sweep.refine import Refinement, refine

COARSE, DEPTH = 9, 3
N = (COARSE - 1) * 2**DEPTH + 1
X, Y = np.meshgrid(np.linspace(0, 1, N), np.linspace(0, 1, N), indexing="ij")
CIRCLE = (np.hypot(X - 0.45, Y - 0.55) < 0.31).astype(int)
STRIPES = (5 * (X + 0.3 * Y)).astype(int) % 3
# its tip lies between coarse values
TONGUE = ((np.abs(Y - 0.26) < 0.03 * (0.95 - X)) & (X < 0.95)).astype(int)


def played(truth: np.ndarray, axes: tuple[bool, ...] = (True, True), depth: int = DEPTH) -> tuple[Refinement, int]:
    """Refine, running what is asked for; and in how many turns."""
    known, turns = np.zeros(truth.shape, dtype=bool), 0
    while True:
        step = refine(np.where(known, truth, 77), known, axes, depth)
        if step.filled is not None:
            return step, turns
        assert (step.needed & ~known).any()
        known |= step.needed
        turns += 1


@pytest.mark.parametrize(("truth", "most"), [(CIRCLE, 0.45), (STRIPES, 0.75), (TONGUE, 0.35)])
def test_the_full_map_comes_out_for_less(truth, most):
    step, turns = played(truth)
    assert step.filled is not None
    assert np.array_equal(step.filled, truth)
    assert step.needed.mean() < most
    assert DEPTH < turns < 30


def test_the_border_is_known_to_the_fine_step():
    """Two neighbours of the fine grid that differ have both been run."""
    for truth in (CIRCLE, STRIPES, TONGUE):
        step, _ = played(truth)
        for axis in (0, 1):
            differ = np.diff(truth, axis=axis) != 0
            first, second = (np.take(step.needed, range(k, N - 1 + k), axis) for k in (0, 1))
            assert differ.any()
            assert np.all(first[differ] & second[differ])


def test_a_uniform_map_takes_the_coarse_grid_only():
    step, turns = played(np.full((N, N), 5))
    assert step.needed.sum() == COARSE**2
    assert turns == 1
    assert np.all(step.filled == 5)


def test_an_island_between_the_coarse_points_is_not_seen():
    """What is smaller than a coarse cell can be missed: the honest limit of the method."""
    truth = np.zeros((N, N), dtype=int)
    truth[3:6, 3:6] = 1
    step, _ = played(truth)
    assert np.all(step.filled == 0)
    assert step.needed.sum() == COARSE**2


def test_a_border_is_followed_into_cells_whose_corners_agree():
    """A tongue that enters a cell through one edge: the midpoint of the edge gives it
    away."""
    truth = np.zeros((N, N), dtype=int)
    truth[:13, 3:6] = 1
    truth[0, 0] = 1  # divides the first cell, whose edges the tongue crosses
    step, _ = played(truth)
    assert np.array_equal(step.filled, truth)
    assert np.all(step.filled[4:13, 4] == 1)


def test_the_outcome_does_not_depend_on_what_else_is_known():
    step, _ = played(TONGUE)
    rng = np.random.default_rng(2)
    for _ in range(5):
        known = step.needed | (rng.random((N, N)) < 0.5)
        again = refine(np.where(known, TONGUE, 77), known, (True, True), DEPTH)
        assert np.array_equal(again.needed, step.needed)
        assert np.array_equal(again.filled, step.filled)


def test_interruptions_change_nothing():
    step, _ = played(CIRCLE)
    rng = np.random.default_rng(3)
    known = np.zeros((N, N), dtype=bool)
    while (now := refine(np.where(known, CIRCLE, 77), known, (True, True), DEPTH)).filled is None:
        missing = np.flatnonzero(now.needed & ~known)
        known.flat[rng.permutation(missing)[: max(1, len(missing) // 3)]] = True
    assert np.array_equal(known, step.needed)
    assert np.array_equal(now.filled, step.filled)


def test_superfluous_units_count_if_they_are_to():
    truth = np.zeros((N, N), dtype=int)
    truth[20, 20] = 1
    known, _ = played(np.zeros((N, N), dtype=int))
    seen = known.needed.copy()
    seen[20, 20] = True
    assert refine(truth, seen, (True, True), DEPTH).filled is not None
    assert refine(truth, seen, (True, True), DEPTH, everything=True).filled is None


@pytest.mark.parametrize("seed", range(6))
def test_looking_at_everything_that_was_run_asks_for_nothing_more(seed):
    """Else a file could not be given the labels again that it has."""
    truth = noisy(seed)()
    step, _ = played(truth)
    again = refine(np.where(step.needed, truth, 77), step.needed, (True, True), DEPTH, everything=True)
    assert np.array_equal(again.needed, step.needed)
    assert np.array_equal(again.filled, step.filled)


def test_every_value_of_an_axis_that_is_not_refined_is_a_grid_of_its_own():
    truth = np.stack([CIRCLE, np.zeros_like(CIRCLE), TONGUE], axis=1)
    step, _ = played(truth, (True, False, True))
    for i, alone in enumerate((CIRCLE, np.zeros_like(CIRCLE), TONGUE)):
        one, _ = played(alone)
        assert np.array_equal(step.needed[:, i], one.needed)
    assert np.array_equal(step.filled, truth)


@pytest.mark.parametrize("depth", [0, 1, 4])
def test_one_axis_is_a_bisection(depth):
    n = (6 - 1) * 2**depth + 1
    truth = (np.arange(n) > 0.37 * n).astype(int)
    step, _ = played(truth, (True,), depth)
    assert np.array_equal(step.filled, truth)
    assert step.needed.sum() <= 6 + 2 * depth


def test_three_axes():
    n = (4 - 1) * 2**2 + 1
    at = np.linspace(-1, 1, n)
    ball = (at[:, None, None] ** 2 + at[None, :, None] ** 2 + at[None, None, :] ** 2 < 0.6).astype(int)
    step, _ = played(ball, (True, True, True), 2)
    assert np.array_equal(step.filled, ball)
    assert step.needed.mean() < 0.9


def test_a_class_of_its_own_is_surrounded():
    """As failed runs have: each is unlike any other, so nothing is concluded from it."""
    truth = np.zeros((N, N), dtype=int)
    truth[8:17, 8:17] = -1 - np.arange(81).reshape(9, 9)
    step, _ = played(truth)
    assert np.all(step.needed[8:17, 8:17])
    assert not np.any(step.filled[~step.needed] < 0)


def noisy(seed: int) -> Callable[[], np.ndarray]:
    rng = np.random.default_rng(seed)
    return lambda: np.where(X > 0.6, rng.integers(0, 3, X.shape), CIRCLE)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_inferred_agrees_with_every_run_around_it(seed):
    """Also where responses are scattered: no unit is inferred beside a neighbour that
    was run and came out different in the smallest undivided cell that holds it."""
    truth = noisy(seed)()
    step, _ = played(truth)
    assert step.filled is not None
    assert np.array_equal(step.filled[step.needed], truth[step.needed])
    inferred = np.argwhere(~step.needed)
    for i, j in inferred[:: max(1, len(inferred) // 200)]:
        around = step.needed[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2]
        values = truth[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2][around]
        assert np.all(values == step.filled[i, j])
