"""Friction laws of the bit: the compiled equations against numpy, closed forms of the torsional model, its bifurcations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from observe.sampled import peak_of
from reference import Case, contacts, derivative, solve
from scipy.integrate import solve_ivp
from sweep.runs import finish, run_work, work_for

import nsdrill
from model.buffers import slopes
from model.cases import operation_of, parameters_of, random_case, random_state
from nsdrill.app.check import check
from nsdrill.app.run import run_in_memory
from nsdrill.app.trajectory import simulate
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.figures import figures
from nsdrill.models.christoforou_yigit.forces import energy, powers
from nsdrill.models.christoforou_yigit.laws import LAWS, bit_arm, fall, onset, static_arm, steepest
from nsdrill.models.christoforou_yigit.layout import GROWTH_HEADER
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.christoforou_yigit.rhs import STATES, pack
from nsdrill.models.operation import Operation
from nsdrill.observe.thresholds import Record
from nsdrill.study import parse_study

OTHERS = LAWS[1:]


def lawful(rng: np.random.Generator, law: str) -> Case:
    u = rng.uniform
    return random_case(rng, bit_law=law, bit_from=10 ** u(-2, 1), b0=u(0.005, 0.05), b1=u(0.5, 10), b2=u(0, 20), b3=u(1, 20))


@pytest.mark.parametrize("law", OTHERS)
def test_derivatives_equal_the_reference(law: str) -> None:
    """At 200 random states of as many random strings, on one lane and on eight."""
    rng = np.random.default_rng(11)
    cases = [lawful(rng, law).but(wall_law="linear") for _ in range(200)]
    states = np.array([random_state(rng, c) for c in cases])
    times = rng.uniform(0, 5, len(cases))
    table = np.concatenate([pack(parameters_of(c), c.depth, c.wob, c.speed) for c in cases])
    lobes = np.array([c.lobes for c in cases])
    found = slopes(8, False, table, times, states, lobes, friction=LAWS.index(law))
    alone = slopes(1, False, table, times, states, lobes, friction=LAWS.index(law))
    assert found.tobytes() == alone.tobytes()
    for c, t, s, mine in zip(cases, times, states, found, strict=True):
        exact = derivative(c, t, s)
        size = np.abs(exact)
        # Of a sum the terms lose bits against their own size.
        f = contacts(c, t, s)
        size[7] += (f["bit_torque"] + c.k_t * abs(s[6]) + abs(f["wall_friction"])) / c.J
        lateral = c.wall_stiffness * np.hypot(s[0], s[2]) / c.m_l + s[7] ** 2
        assert np.all(np.abs(mine - exact) <= 1e-11 * (size + [0, lateral, 0, lateral, 0, 1e-3, 0, lateral]))


@pytest.mark.parametrize("law", LAWS)
def test_the_array_form_is_odd_and_falls_as_it_says(law: str) -> None:
    parameters = parameters_of(Case(bit_law=law, bit_smoothing=1e9))
    k = derive(parameters, 5000.0, 22.24e3, 3.0)
    speed = np.array([0.05, 0.3, 0.9, 1.4, 3.0, 20.0])
    arm = bit_arm(parameters, k, speed)
    assert np.array_equal(bit_arm(parameters, k, -speed), -arm)
    h = 1e-5
    slope = (bit_arm(parameters, k, speed + h) - bit_arm(parameters, k, speed - h)) / (2 * h)
    assert [-fall(parameters, k, v) for v in speed.tolist()] == pytest.approx(slope, rel=1e-4, abs=1e-7)
    assert np.all(arm < static_arm(parameters, k) * (1 + 1e-9))
    soft = parameters_of(Case(bit_law=law, bit_smoothing=5.0, zeta=0.0))
    near = derive(soft, 5000.0, 22.24e3, 3.0)
    assert bit_arm(soft, near, 1e-7) / 1e-7 == pytest.approx(steepest(soft, near), rel=1e-5)


@pytest.mark.parametrize("law", OTHERS)
def test_energy_changes_by_the_powers(law: str) -> None:
    rng = np.random.default_rng(5)
    case = Case(bit_law=law, wob=40e3)
    parameters, operation = parameters_of(case), operation_of(case)
    for _ in range(20):
        state = rng.normal(size=8) * [0.05, 0.2, 0.05, 0.2, 2e-3, 0.02, 20.0, 3.0]
        time = np.array([rng.uniform(0, 5)])
        rate = slopes(1, False, pack(parameters, *_point(case)), time, state[None], friction=LAWS.index(law))[0]

        def named(states: np.ndarray, times: np.ndarray) -> dict[str, np.ndarray]:
            return {**dict(zip(STATES, states.T, strict=True)), "drive_angle": case.speed * times}

        h = 1e-6
        ends = energy(parameters, operation, named(state + np.outer([-h, h], rate), time + np.array([-h, h])))
        fed = powers(parameters, operation, named(state[None], time))
        size = sum(abs(float(power[0])) for power in fed.values()) + abs(float(ends[0]))
        total = sum(float(power[0]) for power in fed.values())
        assert (ends[1] - ends[0]) / (2 * h) == pytest.approx(total, abs=1e-6 * size)


def _point(case: Case) -> tuple[float, float, float]:
    return case.depth, case.wob, case.speed


@pytest.mark.parametrize("law", OTHERS)
def test_a_trace_equals_scipy(law: str) -> None:
    """Every state and the bit torque for 3 s, against DOP853 with the equations in plain Python."""
    case = Case(depth=2000.0, wob=6e3, speed=3.0, bit_smoothing=20.0, bit_law=law)
    study = parse_study(
        "operation: {depth: 2000 m, wob: 6 kN, rotary_speed: 3 rad/s}\n"
        + ("bit: {friction: {law: rational}}" if law == "rational" else
           f"bit: {{friction: {{law: {law}, smoothing: 20 s/rad}}}}")
        + "\ninitial: {x: 30 mm, vy: 0.2 m/s, twist: -2 rad}\nsimulation: {rtol: 1e-11}"
    )  # fmt: skip
    trace = simulate(study, duration=3.0).trace
    start = [0.03, 0.0, 0.0, 0.2, -case.wob / (case.k_a + case.rock_stiffness), 0.0, -2.0, 3.0]
    exact = solve(case, start, 3.0, dense=True).sol(trace.time)
    assert exact[7].min() < 1.0  # below the speed at which the linear law has its kink
    for name, values in zip(STATES, exact, strict=True):
        assert trace[name] == pytest.approx(values, abs=1e-6 * np.max(np.abs(values))), name
    torque = contacts(case, trace.time, exact)["bit_torque"]
    assert trace["bit_torque"] == pytest.approx(torque, abs=1e-5 * np.max(np.abs(torque)))


@pytest.mark.parametrize("law", OTHERS)
def test_lanes_and_exponent_change_no_bit_and_torque_tops_are_those_of_the_trace(law: str) -> None:
    case = Case(wob=40e3, bit_law=law)
    work = work_for(case, Simulation(transient=5.0, observe=15.0, rtol=1e-8), rotary_speed=np.linspace(1.0, 8.0, 5))
    kept = run_work(work, lanes=8)
    for other in (run_work(work, lanes=1), run_work(replace(work, record=Record(exponent=True)), lanes=4)):
        assert all(kept[name].tobytes() == other[name].tobytes() for name in kept)
    study = parse_study(
        f"operation: {{wob: 40 kN, rotary_speed: 1 rad/s}}\nbit: {{friction: {{law: {law}}}}}\nsimulation: {{rtol: 1e-8}}"
    )
    trace = simulate(study, duration=20.0, sample=0.0005).trace
    late = trace.time >= 5.0
    assert kept["bit_torque_max"][0] == pytest.approx(trace["bit_torque"][late].max(), rel=2e-5)
    assert kept["bit_speed_max"][0] == pytest.approx(trace["bit_speed"][late].max(), rel=1e-6)


@pytest.mark.parametrize("law", OTHERS)
def test_the_deviation_is_the_derivative_of_the_motion(law: str) -> None:
    """Against two neighbouring runs, over some seconds in which the bit sticks and slips."""
    simulation = Simulation(transient=0.0, observe=6.0, rtol=1e-8)
    case = Case(wob=40e3, speed=1.0, bit_law=law, amplitude=0.0, bit_smoothing=20.0)
    work = replace(work_for(case, simulation), record=Record(exponent=True))

    def end(shift: float, rtol: float) -> np.ndarray:
        one = replace(work, simulation=replace(simulation, rtol=rtol))
        runs, gang = one.prepare(np.array([0])), one.new_gang(1, 1)
        runs.initial[0, :8] += shift * runs.initial[0, 8:16]
        gang._store[GROWTH_HEADER] = np.inf  # the deviation keeps its length
        gang.add(np.array([0]), runs)
        return finish(one, gang)[-1].final[0]

    size = work.prepare(np.array([0])).sizes[0, :8]
    quotient = (end(1e-5, 1e-12) - end(-1e-5, 1e-12))[:8] / 2e-5 / size
    followed = end(0.0, 1e-8)[8:16] / size
    assert np.linalg.norm(followed - quotient) < 1e-3 * np.linalg.norm(quotient)
