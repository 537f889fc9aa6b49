"""The integrator's accuracy: its order where the motion is smooth, its tolerance where
it is not, and against SciPy."""

import numpy as np
import pytest
from main_model.cases import random_case
from reference import Case, solve
from sweep.runs import run_from, work_for

from kernel.motions import BOUNCING, RUBBING, SMOOTH, scaled_error, start_of
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS

TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)


def errors(case: Case, start: np.ndarray, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Error at the end against DOP853 at rtol 1e-13, in units of the states' natural
    state_scales; and accepted steps."""
    exact = solve(case, start[:8], duration, rtol=1e-13, phase=start[8]).y[:, -1]
    found, steps = [], []
    for rtol in TOLERANCES:
        simulation = Simulation(transient=0.0, observe=duration, rtol=rtol)
        # The middle of the window cuts a step, as every mark does.
        out = run_from(work_for(case, simulation), start[None])
        found.append(scaled_error(case, out["final_state"][0, :8], exact))
        steps.append(out["steps"][0])
    return np.array(found), np.array(steps)


# What the weights must make of vectors of a and c, by order (Hairer, Norsett & Wanner
# I, II.2).
def conditions(a: np.ndarray, c: np.ndarray) -> dict[int, list[tuple[np.ndarray, float]]]:
    ac, ac2, ac3 = a @ c, a @ c**2, a @ c**3
    return {
        1: [(np.ones(len(c)), 1)],
        2: [(c, 1 / 2)],
        3: [(c**2, 1 / 3), (ac, 1 / 6)],
        4: [(c**3, 1 / 4), (c * ac, 1 / 8), (ac2, 1 / 12), (a @ ac, 1 / 24)],
        5: [
            (c**4, 1 / 5),
            (c**2 * ac, 1 / 10),
            (ac * ac, 1 / 20),
            (c * ac2, 1 / 15),
            (ac3, 1 / 20),
            (c * (a @ ac), 1 / 30),
            (a @ (c * ac), 1 / 40),
            (a @ ac2, 1 / 60),
            (a @ a @ ac, 1 / 120),
        ],
    }


PAIRS = {name: pair for name, pair in STEPPERS.items() if not pair.implicit}


@pytest.mark.parametrize("name", PAIRS)
def test_a_pair_has_its_order_and_embeds_one_less(name):
    pair = PAIRS[name]
    n = len(pair.nodes)
    c = np.array(pair.nodes)
    a = np.zeros((n, n))
    for i, row in enumerate(pair.matrix, start=1):
        a[i, : len(row)] = row
    b = a[-1]
    embedded = b - np.array(pair.error)
    assert a.sum(axis=1) == pytest.approx(c, abs=1e-15)
    known = conditions(a, c)
    assert pair.order in known, "conditions of a higher order are to be added"
    for order in range(1, pair.order + 1):
        for vector, value in known[order]:
            assert b @ vector == pytest.approx(value, abs=1e-15)
            if order < pair.order:  # the weights have seventeen digits, not all exact
                assert embedded @ vector == pytest.approx(value, abs=3e-15)
    assert any(abs(embedded @ vector - value) > 1e-4 for vector, value in known[pair.order]), "no error estimate"


@pytest.mark.parametrize("name", PAIRS)
def test_the_error_of_a_pair_falls_with_its_order(name):
    """In packed steps: a smooth motion against SciPy, over two decades of the
    tolerance."""
    start = start_of(SMOOTH)
    exact = solve(SMOOTH, start[:8], 10.0, rtol=1e-13, phase=start[8]).y[:, -1]
    found, steps = [], []
    for rtol in (1e-6, 1e-7, 1e-8):
        simulation = Simulation(transient=0.0, observe=10.0, rtol=rtol, pair=name)
        out = run_from(work_for(SMOOTH, simulation), start[None])
        found.append(scaled_error(SMOOTH, out["final_state"][0, :8], exact))
        steps.append(out["steps"][0])
    order = np.polyfit(np.log(steps), np.log(found), 1)[0]
    assert -1.15 * PAIRS[name].order < order < -0.9 * PAIRS[name].order


def test_error_falls_as_the_fifth_power_of_the_step_where_the_motion_is_smooth():
    """Order five (local extrapolation): error ~ steps^-5, and ~ rtol^1 for a local
    error kept below rtol. The pair's error of fifth order is so small that the sixth
    shows at loose tolerances."""
    error, steps = errors(SMOOTH, start_of(SMOOTH), 10.0)
    order = np.polyfit(np.log(steps), np.log(error), 1)[0]
    slope = np.polyfit(np.log(TOLERANCES), np.log(error), 1)[0]
    assert -5.75 < order < -4.75
    assert 0.9 < slope < 1.1
    # steps ~ rtol^(-1/5): 10^(1/5) = 1.585 a decade. A worse count means that steps are
    # thrown away.
    assert np.all(steps[1:] / steps[:-1] < 1.75)


@pytest.mark.parametrize("case", [BOUNCING, RUBBING], ids=["rock", "wall"])
def test_error_follows_the_tolerance_through_contacts(case):
    """The field has kinks at the contacts, where a fixed step would drop to order two:
    the step adapts instead."""
    error, _ = errors(case, start_of(case), 1.0)
    slope = np.polyfit(np.log(TOLERANCES), np.log(error), 1)[0]
    assert 0.75 < slope < 1.25
    # Each contact stretches a deviation: a factor of a thousand in the three or four
    # contacts of this second.
    assert np.all(error < 3e3 * np.array(TOLERANCES))


@pytest.mark.parametrize("seed", range(12))
def test_short_runs_equal_scipy(seed):
    """Random strings from random states for one second at rtol 1e-11, against DOP853 at
    1e-13.

    Each step may err by rtol in the mean over the states, by sqrt(8) rtol in one of
    them; so the sum over the steps, and a factor of three for what the motion makes of
    a deviation in a second.
    """
    rng = np.random.default_rng(100 + seed)
    case = random_case(
        rng,
        lobes=3,  # each number is compiled separately
        wall_stiffness=10 ** rng.uniform(6, 8),
        rock_stiffness=10 ** rng.uniform(6.5, 8),
        bit_smoothing=10 ** rng.uniform(1, 2),
        wall_smoothing=10 ** rng.uniform(1, 2),
    )
    start = start_of(case)
    start[:8] += rng.normal(0, 1, 8) * [0.03, 0.2, 0.03, 0.2, 1e-3, 0.02, 1.0, 0.3 * case.speed]
    exact = solve(case, start[:8], 1.0, rtol=1e-13, phase=start[8]).y[:, -1]
    out = run_from(work_for(case, Simulation(transient=0.0, observe=1.0, rtol=1e-11)), start[None])
    assert scaled_error(case, out["final_state"][0, :8], exact) < 10 * 1e-11 * out["steps"][0]


def test_few_steps_are_rejected_where_the_motion_is_smooth():
    work = work_for(SMOOTH, Simulation(transient=0.0, observe=50.0, rtol=1e-7))
    out = run_from(work, start_of(SMOOTH)[None])
    assert out["rejected"][0] < 0.02 * out["steps"][0]


def test_the_drive_angle_advances_exactly():
    """The angle at the end is initial + speed x time, whatever the steps."""
    simulation = Simulation(transient=3.0, observe=7.0)
    start = start_of(SMOOTH)
    start[8] = 2.5
    out = run_from(work_for(SMOOTH, simulation), start[None])
    assert out["final_state"][0, 8] == 2.5 + SMOOTH.speed * 10.0
    assert out["initial_state"][0].tobytes() == start.tobytes()


def test_whole_turns_of_the_drive_change_nothing_but_the_angle():
    """The angle enters through its sine only: ten turns more give the same motion to
    rounding."""
    start = start_of(BOUNCING)
    later = start.copy()
    later[8] += 20 * np.pi
    work = work_for(BOUNCING, Simulation(transient=0.5, observe=0.5, rtol=1e-10), wob=[20e3, 22.24e3])
    out = run_from(work, np.array([start, start]))["final_state"]
    moved = run_from(work, np.array([later, later]))["final_state"]
    assert moved[:, :8] == pytest.approx(out[:, :8], rel=1e-7, abs=1e-10)
    assert moved[:, 8] == pytest.approx(out[:, 8] + 20 * np.pi, rel=1e-15)
