"""A motion is followed over its least period, and once."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nsdrill.analysis.bifurcations import CYCLE, EQUILIBRIUM, HOPF
from nsdrill.orbit.explore import Explorer
from nsdrill.orbit.flow import Legs, advance
from nsdrill.orbit.periodic import sampled_cycle
from nsdrill.orbit.seeds import Orders, Seed

from .flows import flow_of


def fast(t, phase, s, p, o):
    """A cycle springs from rest at a = 0 with 6 rad/s: more than half a turn in the time of
    the map of an equilibrium, an eighth of 2 pi s."""
    return {"v": (p.a - s.x * s.x) * s.v - 36.0 * s.x}


ORDERS = Orders((1,), (-0.3, 0.6))


def settled(a):
    """A state on the cycle and its period, by SciPy."""

    def slopes(t, y):
        return [y[1], (a - y[0] ** 2) * y[1] - 36.0 * y[0]]

    def returns(t, y):
        return y[0]

    returns.direction = 1.0
    path = solve_ivp(slopes, (0.0, 120.0), [0.5, 0.0], "DOP853", rtol=1e-11, atol=1e-12, events=returns)
    return path.y_events[0][-1], float(np.diff(path.t_events[0])[-1])


def test_the_period_of_a_cycle_that_springs_from_a_fast_hopf_point():
    rest = Seed(np.zeros(2), 0.0, np.array([-0.2]), steady=True)
    still, cycle = Explorer(flow_of(fast, 2), ORDERS).run([rest]).branches
    assert (still.motion, cycle.motion) == (EQUILIBRIUM, CYCLE)
    (hopf,) = [entry.point.found.values[0] for entry in still.marked if entry.label == HOPF]
    assert hopf == pytest.approx(0.0, abs=1e-7)
    for orbit in (cycle.marked[0].point.found, cycle.marked[-1].point.found):
        a = float(orbit.values[0])
        assert orbit.period == pytest.approx(settled(a)[1] if a > 0.1 else 2.0 * np.pi / 6.0, rel=1e-3)
    assert cycle.marked[-1].point.found.values[0] == pytest.approx(0.6)


@pytest.mark.parametrize("turns", [(1, 2, 3, 5), (6, 4, 11)])
def test_a_cycle_that_is_taken_several_times_is_one_cycle(turns):
    flow, (state, period) = flow_of(fast, 2, rtol=1e-11), settled(0.5)
    seeds = [Seed(state, 0.0, np.array([0.5]), kind=(CYCLE, 1), period=n * period) for n in turns]
    # and the same from other phases, without a period
    others = flow.run(Legs(np.tile(state, (4, 1)), 0.0, np.array([0.2, 0.45, 0.6, 0.81]), np.array([0.5]))).state
    seeds += [Seed(other, 0.0, np.array([0.5])) for other in others]
    found = Explorer(flow, Orders((1,), (0.4, 0.6))).run(seeds)
    assert found.seeds == ["followed"] * len(seeds)
    (cycle,) = found.branches
    assert min(abs(entry.point.found.period - period) for entry in cycle.marked) < 1e-6
    assert max(entry.point.found.period for entry in cycle.marked) < 1.1 * period


@pytest.mark.parametrize("samples", [9, 12, 17])
def test_a_fast_cycle_is_found_between_samples(samples):
    """Whatever its phase: samples far apart miss its start by a part of the path between them."""
    flow, (state, period), number = flow_of(fast, 2, rtol=1e-11), settled(0.5), np.array([0.5])
    for share in np.arange(1, 13) / 13.0:
        start = flow.run(Legs(state[None], 0.0, share * period, number)).state[0]
        tasks = {0: sampled_cycle(flow, start, number, period / (samples + 0.5), 60 * samples)}
        _, found = advance(flow, tasks)[0]
        assert found == pytest.approx(period, rel=0.1)


def wells(t, phase, s, p, o):
    """Two wells about x = 1 and x = -1, in each of which a cycle springs from rest at a = 1."""
    return {"v": (p.a - s.x * s.x) * s.v + s.x - s.x**3}


def test_two_cycles_of_the_same_period_are_two():
    flow = flow_of(wells, 2, rtol=1e-11)
    seeds = [Seed(np.array([x, 0.0]), 0.0, np.array([0.95]), steady=True) for x in (1.0, -1.0)]
    branches = Explorer(flow, Orders((1,), (0.88, 1.1))).run(seeds).branches
    cycles = [branch for branch in branches if branch.motion == CYCLE]
    assert sorted(round(float(branch.marked[0].point.found.state[0])) for branch in cycles) == [-1, 1]
    sides = [np.stack([entry.point.found.mesh_states[:, 0] for entry in branch.marked]) for branch in cycles]
    assert all((side > 0.0).all() or (side < 0.0).all() for side in sides)
    periods = [branch.marked[-1].point.found.period for branch in cycles]
    assert periods[0] == pytest.approx(periods[1], rel=1e-6)
