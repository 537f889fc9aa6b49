"""Intervals of instability that are narrower than a step of a branch."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import expm

import nsdrill
from nsdrill.analysis.bifurcations import PERIODIC
from nsdrill.app.following.seeding import continuation_setup
from nsdrill.orbit import special
from nsdrill.orbit.arclength import Rules, follow
from nsdrill.orbit.flow import advance
from nsdrill.orbit.newton import Evaluation, Point, corrected_at_parameter
from nsdrill.orbit.periodic import Periodic
from nsdrill.orbit.special import UNRESOLVED, Stability, stability_of
from nsdrill.orbit.special import test_functions_of as functions_of

DAMPING, COUPLING, RATE = 0.0024, 0.0047, 0.5
STABILITY = stability_of(0)
# of the bounce at 5000 m, 22.24 kN and 3.01025 rad/s, in SI
BOUNCE = (
    *(0.0034724199, -0.0030646578, 0.0037838035, 0.0062373366),
    *(0.0011217699, 0.052827834, -5.427871, 2.6335734),
)


@dataclass(frozen=True)
class Meeting:
    """The straight branch u = number, on which two pairs of multipliers meet at ``at``
    and keep together, one within and one outside their circle, as far as their
    ``coupling`` reaches."""

    at: float
    coupling: float = COUPLING
    tolerance_factor = 1.0

    def monodromy(self, number):
        detuning = RATE * (number - self.at)
        matrix = 1j * np.array([[1.0 + detuning, self.coupling], [-self.coupling, 1.0 - detuning]])
        real, imag = matrix.real - DAMPING * np.eye(2), matrix.imag
        return expm(np.block([[real, -imag], [imag, real]]))

    @property
    def borders(self):
        """Where the larger pair crosses the unit circle."""
        half = (self.coupling**2 - DAMPING**2) ** 0.5 / RATE
        return self.at - half, self.at + half

    def evaluate(self, x):
        u, number = x
        return Evaluation(np.array([number - u]), np.array([[-1.0, 1.0]]), lambda: float(number))
        yield

    def updated(self, x):
        return self


def followed(problem, *, search):
    stability = Stability(problem.monodromy, STABILITY.margins)

    def test_functions(previous, current):
        def value(point):
            return float(stability.of([point])[0, 0])

        return [special.TestFunction(8, value)] if value(previous) * value(current) < 0.0 else []

    start = Point(np.array([0.0, 0.0]), np.array([1.0, 1.0]) / 2**0.5, 0.0, 1, 0.0)
    rules = Rules((-1.0, 3.0), 400, test_functions, stability=stability if search else None)
    return advance(None, {0: follow(problem, start, 1, rules)})[0]


@pytest.mark.parametrize("at", [1.4, 1.45, 1.5, 1.55, 1.6])
def test_an_interval_between_points_is_found(at):
    problem = Meeting(at)  # 0.016 wide, where steps advance the number by 0.2
    plain, half = followed(problem, search=False), followed(problem, search=True)
    assert not any(one.label for one in plain.points)
    found = [one.point.x[1] for one in half.points if one.label]
    assert found == pytest.approx(problem.borders, abs=1e-7)
    # The steps are those without the search, in the same order.
    numbers = [one.point.x[1] for one in half.points]
    assert numbers == sorted(numbers)
    own = {tuple(one.point.x) for one in plain.points}
    assert own <= {tuple(one.point.x) for one in half.points}
    assert half.inserted == len(half.points) - len(plain.points) == 3
    assert half.ended == plain.ended == "to"


@pytest.mark.parametrize("share", [0.5, 0.9, 0.999])
def test_multipliers_that_meet_inside_the_circle_make_no_interval(share):
    half = followed(Meeting(1.5, share * DAMPING), search=True)
    assert not any(one.label for one in half.points)
    assert half.inserted == 0


@dataclass(frozen=True)
class Failing(Meeting):
    """Newton's method fails within ``reach`` of each of these numbers."""

    numbers: tuple[float, ...] = ()
    reach: float = 0.0

    def evaluate(self, x):
        if any(abs(x[1] - number) < self.reach for number in self.numbers):
            return None
        return (yield from super().evaluate(x))


def test_a_search_goes_on_where_newtons_method_fails_at_one_place():
    """An interval that is wider than a step, whose borders the steps straddle."""
    whole = followed(Meeting(1.5, 0.3), search=False)
    places = [k for k, one in enumerate(whole.points) if one.label]
    around = [(whole.points[k - 1].point.x[1], whole.points[k + 1].point.x[1]) for k in places]
    middles = tuple(0.5 * (a + b) for a, b in around)
    there = followed(Failing(1.5, 0.3, middles, 1e-4), search=False)
    borders = pytest.approx(Meeting(1.5, 0.3).borders, abs=1e-6)
    for half in (whole, there):
        assert [one.point.x[1] for one in half.points if one.label] == borders
        assert {one.words for one in half.points if one.label} == {""}
    blocked = followed(Failing(1.5, 0.3, Meeting(1.5, 0.3).borders, 1e-3), search=False)
    found = [one for one in blocked.points if one.label]
    assert [one.words for one in found] == [UNRESOLVED] * 2
    assert [one.point.x[1] for one in found] == pytest.approx(Meeting(1.5, 0.3).borders, abs=0.1)


@pytest.mark.parametrize("at", [1.4, 1.5, 1.6])
@pytest.mark.parametrize("reach", [1e-3, 4e-3])
def test_an_interval_is_found_where_newtons_method_fails_in_its_middle(at, reach):
    """Where the search looks first, in the middle, there is no motion to be found."""
    problem = Failing(at, numbers=(at,), reach=reach)
    half = followed(problem, search=True)
    found = [one.point.x[1] for one in half.points if one.label]
    assert found == pytest.approx(problem.borders, abs=1e-7)
    assert all(one.words == "" for one in half.points)


def test_the_bounce_is_unstable_near_2_97():
    """The bounce over one lobe at 5000 m and 22.24 kN, followed as in the study of
    branches, against motions computed at equal distances. Its multipliers at the points
    around do not come nearer to the unit circle than 5e-4."""
    study = {
        "operation": {"depth": "5000 m", "wob": "22.24 kN"},
        "continue": {"along": "rotary_speed", "from": "2.5 rad/s", "to": "8 rad/s"},
    }
    setup = continuation_setup(nsdrill.load_study(study))
    flow = setup.flow(("rotary_speed",), (0.55,), 1)
    state = np.array(BOUNCE)
    problem = Periodic.at(flow, 1, np.array([3.01]), state)

    first = advance(flow, {0: corrected_at_parameter(problem, problem.unknowns(state[None], 3.01))})[0]

    def motion(number):
        guess = problem.unknowns(state[None], number)
        along = (guess[-1] - first.x[-1]) / first.tangent[-1]
        return (yield from corrected_at_parameter(problem, first.x + along * first.tangent))

    numbers = np.concatenate([middle + 1e-4 * np.arange(-3, 4) for middle in (2.9687, 2.98)])
    scan = advance(flow, {number: motion(number) for number in numbers})
    rules = Rules((2.945 / 0.55, 4.0 / 0.55), 9, functions_of({}, PERIODIC), stability=stability_of(0), first_step=0.3)
    half = advance(flow, {0: follow(problem, first, -1, rules)})[0]
    assert len(half.points) - half.inserted == 2
    ends = [first, half.points[-1].point]
    assert all(np.abs(one.found.multipliers).max() < 0.9995 for one in ends)
    found = [one.point.found.values[-1] for one in half.points if one.label == 8]
    is_unstable = np.array([np.abs(scan[number].found.multipliers).max() > 1 for number in numbers])
    edges = np.flatnonzero(np.diff(is_unstable.astype(int)))
    assert sorted(found) == pytest.approx(0.5 * (numbers[edges] + numbers[edges + 1]), abs=6e-5)
    assert len(found) == 2
