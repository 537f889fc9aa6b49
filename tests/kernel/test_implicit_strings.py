"""Implicit friction of stabilisers, along the hole, of an elastic collar and of cutting
at a live depth: end states against another integrator, and bits over lanes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kernel.test_additive import run
from nsdrill.app.experiment import prepare
from nsdrill.app.run import work_of
from nsdrill.observe.thresholds import Record
from nsdrill.study import parse_study
from nsdrill.sweep.work import Work

ROLLING = "operation: {depth: 2000 m, wob: 22.24 kN, rotary_speed: 8 rad/s}\ninitial: {x: 90 mm, vy: -3 m/s}\n"
STEEP = "bit: {friction: {smoothing: 1000 s/rad}}\n"
CASES = {
    "stabilisers": f"{ROLLING}{STEEP}well: {{friction: {{smoothing: 1000 s/m}}}}\n"
    "stabilizer: {clearance: 30 mm, friction: {smoothing: 1000 s/m}}\n",
    "along the hole": f"{ROLLING}{STEEP}well: {{friction: {{smoothing: 1000 s/m}}, axial_friction: true}}\n",
    "elastic collar": f"model: beam\n{ROLLING}{STEEP}well: {{friction: {{smoothing: 1000 s/m}}}}\n"
    "beam: {modes: 2, stations: [{at: 0.3}, {at: 0.5}, {at: 0.7}]}\n",
    "live cutting": "model: segments\nbit: {cutting: {smoothing: 1000 s/rad, c2: 0.001}}\n"
    "segments: {pipe: 2, collar: 2}\n",
}
ONE_LANE = ("along the hole", "elastic collar")  # run in one lane, too
SECONDS = {"live cutting": 1.0}
# Impacts on the lobes scatter the errors of segments by a factor of five, with an
# explicit method as well.
FINE = {"live cutting": 1e-9}


def work_for(text: str, method: str, rtol: float, seconds: float) -> Work:
    study = parse_study(text)
    simulation = replace(study.simulation, transient=0.0, observe=seconds, rtol=rtol, method=method)
    return replace(work_of(prepare(study)), simulation=simulation, record=Record(peaks=0))


def exact(work: Work) -> np.ndarray:
    """The final state by SciPy's DOP853 at 1e-10, of the ordinary slopes."""
    model, runs = work.kind, work.prepare(np.arange(1))
    variant = model.variant(work.parameters)
    rows, function = model.rows(variant), model.right_hand_side(8, variant)
    lanes = np.zeros((rows.total, 8))
    b, own, pairs = lanes[:, 0], rows.own, rows.pairs
    lanes[rows.parameter : rows.parameter + rows.parameters] = runs.parameters[0][:, None]
    b[rows.phase], frame_rates = runs.initial[0, -1], runs.frame_rates[0, :pairs]

    def slopes(t: float, y: np.ndarray) -> np.ndarray:
        b[:own], b[rows.stage_time] = y, t
        function(lanes.reshape(-1))
        found, out = b[rows.acceleration : rows.acceleration + rows.own_slopes], np.empty(own)
        out[: 2 * pairs : 2], out[1 : 2 * pairs : 2] = (y[1 : 2 * pairs : 2] + frame_rates, found[:pairs])
        out[2 * pairs :] = found[pairs:]
        return out

    span, start = (0.0, work.simulation.observe), runs.initial[0, :own]
    done = solve_ivp(slopes, span, start, "DOP853", rtol=1e-10, atol=1e-12 * runs.state_scales[0])
    return np.asarray(done.y[:, -1])


@pytest.mark.parametrize("case", CASES)
def test_end_states_equal_those_of_another_integrator(case):
    """Within some thousand tolerances, as impacts magnify what steps leave; and a
    hundredth of the tolerance, of segments a thousandth, takes most of the error
    away."""
    errors, seconds = [], SECONDS.get(case, 0.25)
    for rtol in (1e-6, FINE.get(case, 1e-8)):
        work = work_for(CASES[case], "implicit", rtol, seconds)
        if not errors:
            end, size = (exact(replace(work, simulation=replace(work.simulation, method="explicit"))), None)
            size = work.prepare(np.arange(1)).state_scales[0] + np.abs(end)
        errors.append(np.max(np.abs(run(work)["final_state"][0, : len(end)] - end) / size))
    assert errors[0] < 5e-3
    assert errors[1] < 2e-4
    assert errors[1] < 0.2 * errors[0]


@pytest.mark.parametrize("case", CASES)
def test_bits_do_not_depend_on_lanes_or_neighbours(case):
    """Each lane iterates until it is done, whatever the others do."""
    work = work_for(CASES[case], "implicit", 1e-6, 0.1)
    axes = {**work.plan.axes, "rotary_speed": work.plan.axes["rotary_speed"] * np.array([0.2, 0.7, 1.0])}
    work = replace(work, plan=replace(work.plan, axes=axes))
    together = run(work)
    for place, speed in enumerate(axes["rotary_speed"]):
        alone = replace(work, plan=replace(work.plan, axes={**axes, "rotary_speed": speed[None]}))
        for name, values in run(alone, 1 if case in ONE_LANE else 8).items():
            assert values[0].tobytes() == together[name][place].tobytes(), name
