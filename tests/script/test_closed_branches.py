"""Branches that come back to where they set out, of an oscillator that meets a one-sided
elastic stop (Ing, Pavlovskaia, Wiercigroch, Banerjee 2008, Phil. Trans. R. Soc. A 366)."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.analysis.bifurcations import FOLD
from nsdrill.models import registry

ZETA, BETA, GAP, SHAKE = 0.01, 29.0, 1.26, 0.7


def stop(t, x=-0.525, v=2.18, *, zeta=ZETA, beta=BETA, gap=GAP, a=SHAKE, omega=1.0):
    pressed = nsdrill.touching("stop", x - gap)
    return {"x": v, "v": a * omega**2 * np.sin(omega * t) - 2.0 * zeta * v - x - beta * pressed}


@pytest.fixture(scope="module")
def model():
    yield nsdrill.model(stop)
    registry.withdraw("stop")


def branches_of(model, **continued):
    found = {"omega": (0.9, 1.1), "seeds": [1.0], "lobes": [3], **continued}
    return nsdrill.continue_branches(model.study(continued=found, transient=100), progress=False)


def over_three_periods(data):
    """The branch of motions that repeat after three periods."""
    (number,) = np.flatnonzero(data["lobes"].values == 3)
    return data.isel(branch=number, point=np.flatnonzero(data["branch_of_point"].values == number))


@pytest.fixture(scope="module")
def closed(model):
    return over_three_periods(branches_of(model))


def test_a_branch_whose_sides_pass_near_each_other_at_a_fold_goes_on_until_they_meet(closed):
    """Below 0.93 the stable and the unstable motion begin nearer each other than a step is
    long; they meet at the fold at 0.9243."""
    assert closed["closed"].values == 1
    folds = closed["parameters_omega"].values[closed["label"].values == FOLD]
    assert sorted(folds) == pytest.approx([0.9243, 0.9269, 0.9367, 1.0502], abs=1e-4)


def test_a_closed_branch_begins_and_ends_with_one_motion_and_has_all_between(closed):
    """Both sides are kept, as far as they meet: no part is missing, and none is there
    twice."""
    numbers, states = closed["parameters_omega"].values, closed["state"].values
    multipliers = np.sort(closed["multiplier_real"].values, axis=-1)
    assert numbers[-1] == pytest.approx(numbers[0], rel=1e-12)
    assert multipliers[-1] == pytest.approx(multipliers[0], rel=1e-4)
    assert np.max(np.linalg.norm(np.diff(states, axis=0), axis=1)) < 0.3
    assert np.all(np.diff(closed["arclength"].values) > 0.0)
    turns = np.count_nonzero(np.diff(np.sign(np.diff(numbers))))
    assert turns == 4 - (np.sign(numbers[1] - numbers[0]) != np.sign(numbers[-1] - numbers[-2]))


def test_the_motions_of_its_stable_part_are_those_of_scipy(closed):
    is_inside = (closed["unstable"].values == 0) & (np.abs(closed["parameters_omega"].values - 0.955) < 0.01)
    place = np.flatnonzero(is_inside)[0]
    omega, state = closed["parameters_omega"].values[place], closed["state"].values[place]

    def rates(t, s):
        return [s[1], SHAKE * omega**2 * np.sin(omega * t) - 2.0 * ZETA * s[1] - s[0] - BETA * max(s[0] - GAP, 0.0)]

    run = solve_ivp(rates, (0.0, 60.0 * np.pi / omega), state, rtol=1e-10, atol=1e-12, max_step=0.05)
    assert run.y[:, -1] == pytest.approx(state, abs=1e-4)


@pytest.fixture(scope="module")
def upward(model):
    return branches_of(model, direction="up")


def test_a_branch_that_is_followed_to_one_side_ends_at_its_seed(closed, upward):
    one_side = over_three_periods(upward)
    assert one_side["closed"].values == 1
    assert one_side["parameters_omega"].values[[0, -1]] == pytest.approx([1.0, 1.0], rel=1e-12)
    assert one_side["state"].values[-1] == pytest.approx(one_side["state"].values[0], abs=1e-6)
    lengths = [one["arclength"].values[-1] - one["arclength"].values[0] for one in (closed, one_side)]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-3)


def test_a_stable_part_goes_on_through_the_seed_of_a_closed_branch(upward):
    (stable,) = (line for line in str(nsdrill.show(upward)).splitlines() if "0.9367" in line and "stable  " in line)
    assert stable.split(maxsplit=1)[1] == "0.9269 to 1.05, 0.9243 to 0.9367"


def well(t, x=0.5, v=0.0, *, r=0.8, tilt=1e-9, omega=1.0):
    """A double well, all but symmetric"""
    return v, -0.7 * v + r * x - x**3 + tilt + 0.01 * np.cos(omega * t)


def test_a_branch_that_passes_near_another_one_is_no_part_of_it():
    """Where the wells part, a pitchfork all but closed: the motion of the right well comes nearer to those
    of the left one than a fifth of a step, and goes on as the single one below."""
    model = nsdrill.model(well)
    try:
        seeds = nsdrill.run(
            model.study(r=[0.8], transient=200, observe=60, poincare=16, **{"initial.x": [-0.9, 0.9]}), progress=False
        )
        continued = {"r": (-0.1, 0.9), "seeds": [0.8], "lobes": [1]}
        found = nsdrill.continue_branches(model.study(continued=continued), seeds=seeds, progress=False)
        assert found.end_reason.values.tolist() == ["the end of the range"] * 2
        assert float(found.parameters_r.min()) == pytest.approx(-0.1)
    finally:
        registry.withdraw("well")
