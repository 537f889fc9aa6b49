"""Intervals of instability that are narrower than a step of a branch."""

from dataclasses import dataclass

import numpy as np
import pytest

from nsdrill.orbit import arclength
from nsdrill.orbit.arclength import Evaluation, Point, follow
from nsdrill.orbit.lockstep import advance

WIDE, DEEP = 0.02, 0.002


@dataclass(frozen=True)
class Tongue:
    """The straight branch u = number with a margin that is lowest far from ``at`` and
    rises to ``top`` there, as that of a resonance does."""

    at: float
    top: float
    tolerance_factor = 1.0

    def margin(self, number):
        return (self.top + DEEP) / (1.0 + ((number - self.at) / WIDE) ** 2) - DEEP

    @property
    def borders(self):
        """Where the margin vanishes."""
        half = WIDE * (self.top / DEEP) ** 0.5
        return self.at - half, self.at + half

    def evaluate(self, x):
        u, number = x
        return Evaluation(np.array([number - u]), np.array([[-1.0, 1.0]]), lambda: float(number))
        yield

    def updated(self, x):
        return self


def followed(problem, *, search):
    def test_functions(previous, current):
        def value(point):
            return problem.margin(point.found)

        return [arclength.TestFunction(8, value)] if value(previous) * value(current) < 0.0 else []

    start = Point(np.array([0.0, 0.0]), np.array([1.0, 1.0]) / 2**0.5, 0.0, 1, 0.0)
    margins = (lambda found: np.array([-1.0, problem.margin(found)])) if search else None
    return advance(
        None, {0: follow(problem, start, 1, (-1.0, 3.0), 400, test_functions, margins=margins)}
    )[0]


@pytest.mark.parametrize("at", [1.4, 1.45, 1.5, 1.55, 1.6])
def test_an_interval_between_points_is_found(at):
    problem = Tongue(at, 0.1 * DEEP)  # 0.013 wide, where steps advance the number by 0.2
    plain, half = followed(problem, search=False), followed(problem, search=True)
    found = [one.point.x[1] for one in half.points if one.label]
    own = [one.point for one in plain.points if not one.label]
    near = min(abs(point.x[1] - at) for point in own)
    if near < 1.9 * WIDE:  # a point on the flank tells of it
        assert found == pytest.approx(problem.borders, abs=1e-7)
    # The steps are those without the search, in the same order.
    numbers = [one.point.x[1] for one in half.points]
    assert numbers == sorted(numbers)
    assert {tuple(point.x) for point in own} <= {tuple(one.point.x) for one in half.points}
    assert half.inserted == len(half.points) - len(plain.points)
    assert half.ended == plain.ended == "to"


def test_some_intervals_are_missed_without_the_search():
    """What the test above holds would be nothing where steps find every interval."""
    without, looked = 0, 0
    for at in np.linspace(1.4, 1.6, 9):
        problem = Tongue(float(at), 0.1 * DEEP)
        without += any(one.label for one in followed(problem, search=False).points)
        looked += any(one.label for one in followed(problem, search=True).points)
    assert looked > without


@pytest.mark.parametrize("top", [-0.001 * DEEP, -0.1 * DEEP, -0.5 * DEEP])
def test_a_margin_with_an_extremum_before_zero_is_no_interval(top):
    half = followed(Tongue(1.5, top), search=True)
    assert not any(one.label for one in half.points)
    assert half.inserted == 0
