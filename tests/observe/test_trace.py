"""The trajectory of one run: simulate and replay."""

from dataclasses import replace

import numpy as np
import pytest
from main_model import STATES
from model_tables import TRACE_VARIABLES
from reference import Case, contacts, solve

import nsdrill
from nsdrill.app.run import run_in_memory
from nsdrill.app.trajectory import replay, simulate
from nsdrill.study import parse_study
from nsdrill.variables import OK, STEP_LIMIT

TEXT = """
operation: {depth: 2000 m, wob: 6 kN, rotary_speed: 3 rad/s}
bit: {friction: {smoothing: 20 s/rad}}
initial: {x: 30 mm, vy: 0.2 m/s, twist: -2 rad, drive_angle: 0.7 rad}
sweep: {rotary_speed: [2 rad/s, 3 rad/s, 8 rad/s], procedure: PROCEDURE, along: rotary_speed}
simulation: {transient: 2 s, observe: 3 s, rtol: 1e-10}
"""
CASE = Case(depth=2000.0, wob=6e3, speed=3.0, bit_smoothing=20.0)
STUDY = parse_study(TEXT.replace("PROCEDURE", "up"))


def test_samples_equal_scipy():
    """Every state and force, in and out of contact, every 10 ms for 3 s. The error
    depends on where steps meet the kinks of contact: from 5e-8 to 1e-6 of the scale at
    rtol 1e-10, below 1e-7 at 1e-11."""
    fine = replace(STUDY, simulation=replace(STUDY.simulation, rtol=1e-11))
    trace = simulate(fine, duration=3.0).trace
    z = -CASE.wob / (CASE.k_a + CASE.rock_stiffness)
    start = np.array([0.03, 0.0, 0.0, 0.2, z, 0.0, -2.0, 3.0])
    exact = solve(CASE, start, 3.0, phase=0.7, dense=True).sol(trace.time)
    scale = np.max(np.abs(exact), axis=1)
    for name, values, size in zip(STATES, exact, scale, strict=True):
        assert trace[name] == pytest.approx(values, abs=1e-6 * size), name
    force = contacts(CASE, trace.time, exact, phase=0.7)
    for name in ("bit_force", "bit_torque", "wall_force", "wall_friction", "radius"):
        assert trace[name] == pytest.approx(force[name], abs=1e-5 * max(np.max(np.abs(force[name])), 1.0)), name
    assert np.any(force["bit_force"] == 0)


def test_a_trace_has_all_its_variables_at_even_times():
    trajectory = simulate(STUDY, duration=1.0, sample=0.01)
    trace = trajectory.trace
    assert trajectory.status == OK
    assert set(trace.variables) == {v.name for v in TRACE_VARIABLES}
    assert trace.time == pytest.approx(np.arange(101) * 0.01, abs=1e-12)
    assert all(len(values) == 101 and np.all(np.isfinite(values)) for values in trace.variables.values())


def test_the_first_sample_is_the_initial_state():
    trace = simulate(STUDY, duration=1.0).trace
    initial = trace.attrs["initial_state"]
    assert [trace[name][0] for name in STATES] == pytest.approx(initial[:8], rel=1e-15)
    assert trace["drive_angle"][0] == initial[8] == 0.7


def test_the_last_sample_is_the_final_state():
    trace = simulate(STUDY, duration=1.0, sample=0.25).trace
    final = trace.attrs["final_state"]
    assert [trace[name][-1] for name in STATES] == pytest.approx(final[:8], rel=1e-12)
    assert trace["drive_angle"][-1] == pytest.approx(final[8], rel=1e-15)


def test_sampling_does_not_change_the_run():
    ends = [simulate(STUDY, duration=2.0, sample=sample).trace.attrs for sample in (1e-4, 0.01, 0.3, 2.0)]
    for attrs in ends[1:]:
        assert attrs["final_state"].tobytes() == ends[0]["final_state"].tobytes()
        assert attrs["steps"] == ends[0]["steps"]


def test_coarse_samples_are_among_the_fine_ones():
    fine = simulate(STUDY, duration=2.0, sample=1 / 256).trace
    coarse = simulate(STUDY, duration=2.0, sample=1 / 16).trace
    for name in STATES:
        assert np.array_equal(fine[name][::16], coarse[name]), name


@pytest.mark.parametrize("procedure", ["same", "up-down"])
def test_replay_has_the_stored_bits(procedure, tmp_path):
    """Of each point of a sweep, carried or not, from the file."""
    text = TEXT.replace("PROCEDURE", procedure)
    study = parse_study(text if procedure != "same" else text.replace(", along: rotary_speed", ""))
    path = tmp_path / "out.h5"
    nsdrill.run(study, path, workers=2).close()
    for way in ("up", "down") if procedure == "up-down" else ("same",):
        for speed in (2.0, 3.0, 8.0):
            again = replay(path, rotary_speed=speed, procedure=way, sample=0.05)
            assert again.same_bits, (way, speed)


def test_simulate_is_the_run_of_that_point():
    """With its transient and window the marks fall alike, and so do the bits."""
    study = parse_study(TEXT.replace("PROCEDURE", "same").replace(", along: rotary_speed", ""))
    results = run_in_memory(study)
    for i, speed in enumerate((2.0, 3.0, 8.0)):
        end = simulate(study, rotary_speed=speed).trace.attrs["final_state"]
        assert end.tobytes() == results["final_state"][0, 0, 0, i].tobytes()


def test_a_run_that_stops_early_gives_the_samples_it_reached():
    study = parse_study(TEXT.replace("PROCEDURE", "up").replace("rtol: 1e-10", "rtol: 1e-12, max_steps: 1000"))
    trajectory = simulate(study, rotary_speed=8.0)
    assert trajectory.status == STEP_LIMIT
    assert 0 < len(trajectory.trace.time) < 501
    assert all(len(values) == len(trajectory.trace.time) for values in trajectory.trace.variables.values())
