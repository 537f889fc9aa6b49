"""The largest Lyapunov exponent, on systems whose exponent is published and on the model itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kernel.motions import BOUNCING, RUBBING, start_of
from model.cases import table_of
from reference import Case
from sweep.runs import finish, run_work, same_bits, work_for

from nsdrill.kernel.settings import Simulation
from nsdrill.model.rhs import sizes
from nsdrill.observe.exponent import BATCHES, exponent_of, growth_header, seed_deviation
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.work import Work
from observe.flows import exponents

WITH = Record(peaks=4, poincare=12, exponent=True)


@pytest.mark.parametrize(("roessler", "parameters", "start", "observe", "published", "within"), [
    # Sprott, Chaos and Time-Series Analysis (2003), table A: 0.9056 and 0.0714.
    (False, (10.0, 28.0, 8 / 3), (1.0, 2.0, 20.0), 4000.0, 0.9056, 0.01),
    (True, (0.2, 0.2, 5.7), (1.0, 1.0, 0.0), 200000.0, 0.0714, 0.001),
])  # fmt: skip
def test_published_exponents(
    roessler: bool, parameters: tuple, start: tuple, observe: float, published: float, within: float
) -> None:
    simulation = Simulation(transient=100.0, observe=observe, rtol=1e-8)
    found = exponent_of(exponents(roessler, [parameters], start, simulation), observe)
    exponent, error = found["lyapunov_exponent"][0], found["lyapunov_error"][0]
    assert exponent == pytest.approx(published, abs=within)
    assert 0 < error < within, "the scatter of the batches is of the size of the true error"
    assert abs(exponent - published) < 4 * error


def test_a_limit_cycle_has_exponent_zero_and_a_fixed_point_its_eigenvalue() -> None:
    """Roessler at c = 2.5 has a cycle (the exponent along the flow is zero); Lorenz at rho = 0.5 rests at the
    origin, whose slowest eigenvalue is ((-(s + 1) + sqrt((s - 1)^2 + 4 s rho)) / 2)."""
    simulation = Simulation(transient=500.0, observe=2000.0, rtol=1e-8)
    cycle = exponent_of(exponents(True, [(0.2, 0.2, 2.5)], (1.0, 1.0, 0.0), simulation), 2000.0)
    assert abs(cycle["lyapunov_exponent"][0]) < 1e-3
    # Not for ever: once it rests within the tolerance, steps are as long as stability allows, and the deviation, which
    # has no say in them, decays more slowly than it should.
    short = Simulation(transient=5.0, observe=10.0, rtol=1e-10)
    rest = exponent_of(exponents(False, [(10.0, 0.5, 8 / 3)], (0.1, 0.1, 0.1), short), 10.0)
    slowest = (-11.0 + np.sqrt(81.0 + 20.0)) / 2
    assert rest["lyapunov_exponent"][0] == pytest.approx(slowest, rel=1e-3)


def test_exponents_have_the_same_bits_in_every_lane() -> None:
    parameters = [(10.0, rho, 8 / 3) for rho in (28.0, 100.0, 14.0, 24.5, 40.0, 60.0, 20.0, 0.5, 30.0)]
    simulation = Simulation(transient=5.0, observe=20.0)
    alone, packed = (exponents(False, parameters, (1.0, 2.0, 20.0), simulation, lanes) for lanes in (1, 8))
    assert alone.tobytes() == packed.tobytes()


@pytest.mark.parametrize("case", [BOUNCING, RUBBING], ids=["bouncing", "rubbing"])
def test_the_deviation_is_the_derivative_of_the_motion_through_contacts(case: Case) -> None:
    """Against two neighbouring runs, 4e-6 natural sizes apart, over lift-offs or impacts on the wall. At contacts
    these miss by some 1e-10, which is 1e-4 of their distance; a wrong term of the Jacobian shows in the first digit."""
    time, distance = 3.0, 2e-6
    simulation = Simulation(transient=0.0, observe=time, rtol=1e-12, max_steps=10**7)
    size = sizes(table_of(case))[0]
    deviation = seed_deviation(size)
    with_deviation = replace(work_for(case, simulation), record=WITH)
    start = start_of(case)
    table, double, drift, first, initial = with_deviation.prepare(np.array([0]))
    with_deviation.begin(initial[0], start)
    gang = with_deviation.new_gang(1, 1)
    gang.add(np.array([0]), table, double, drift, first, initial)
    done = finish(with_deviation, gang)[-1]
    ends = []
    for sign in (1.0, -1.0):
        plain = work_for(case, simulation)
        table, plain_size, drift, first, initial = plain.prepare(np.array([0]))
        plain.begin(initial[0], start + sign * distance * np.append(deviation, 0.0))
        gang = plain.new_gang(1, 1)
        gang.add(np.array([0]), table, plain_size, drift, first, initial)
        ends.append(finish(plain, gang)[-1].final[0, :8])
    quotient = (ends[0] - ends[1]) / (2 * distance) / size
    followed = done.final[0, 8:16] / size
    assert followed / np.linalg.norm(followed) == pytest.approx(quotient / np.linalg.norm(quotient), abs=1e-3)
    growth = exponent_of(done.report[:, -3:], time)["lyapunov_exponent"][0] * time
    assert growth == pytest.approx(np.log(np.linalg.norm(quotient) / np.linalg.norm(deviation / size)), abs=1e-3)


SPEEDS = np.linspace(2.0, 7.0, 9)


@pytest.fixture(scope="module")
def sweep() -> Work:
    return replace(work_for(Case(), Simulation(20.0, 20.0), rotary_speed=SPEEDS, procedure="up-down",
                            along="rotary_speed"), record=WITH)


def test_the_motion_has_the_same_bits_with_its_exponent_measured_or_not(sweep: Work) -> None:
    plain = run_work(replace(sweep, record=replace(WITH, exponent=False)))
    watched = run_work(sweep)
    assert same_bits({n: v for n, v in watched.items() if not n.startswith("lyapunov") and n != "motion"},
                     {n: v for n, v in plain.items() if n != "motion"})
    assert np.isfinite(watched["lyapunov_exponent"]).all()
    assert (watched["lyapunov_error"] > 0).all()


def test_neither_lanes_nor_a_resumed_chain_change_the_exponent(sweep: Work) -> None:
    """A chain goes on from a stored state, which holds no deviation: each run begins with its own."""
    from nsdrill.sweep.engine import Starts

    whole = run_work(sweep, lanes=1)
    assert same_bits(whole, run_work(sweep, lanes=8))
    points = sweep.plan.points_of(0, np.arange(sweep.plan.chain_length))
    place = 7
    rest = run_work(sweep, starts=Starts(
        np.array([0]), np.array([place]), lambda chain, place: whole["final_state"][points[place - 1]]))
    later = points[place:]
    assert all(rest[n][later].tobytes() == whole[n][later].tobytes() for n in whole)


def test_a_run_that_fails_has_no_exponent() -> None:
    work = replace(work_for(Case(), Simulation(20.0, 20.0, max_steps=1000)), record=WITH)
    out = run_work(work)
    assert np.isnan(out["lyapunov_exponent"]).all()
    assert (out["motion"] == 0).all()


def test_batches_make_up_the_window() -> None:
    for observe in (0.5, 20.0, 21.0, 333.0):
        interval, looks = growth_header(observe)
        assert interval * looks * BATCHES == pytest.approx(observe)
        assert interval <= 1.0


def test_the_scatter_of_batches_is_their_standard_error() -> None:
    rises = np.random.default_rng(1).normal(2.0, 0.3, BATCHES)
    found = exponent_of(np.array([[BATCHES, rises.sum(), (rises**2).sum()]]), 40.0)
    assert found["lyapunov_exponent"][0] == pytest.approx(rises.sum() / 40.0)
    assert found["lyapunov_error"][0] == pytest.approx(rises.std(ddof=1) / np.sqrt(BATCHES) / 2.0)
