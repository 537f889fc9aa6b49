"""Mud that turns, stabilisers, weight and friction along the axis: the equations, their
energy, and known answers."""

from dataclasses import replace

import numpy as np
import pytest
from energies import energy
from reference import Case
from scipy.integrate import solve_ivp
from strings import STATES, pack
from sweep.runs import run_work, work_for

import nsdrill
from main_model.buffers import slopes_with
from main_model.lateral import FORMS, KEYS, Lateral, cases, derivative, packed, parameters, solve
from nsdrill.models.christoforou_yigit.columns import Options, options_of
from nsdrill.models.tree import with_values
from nsdrill.study import parse_study


@pytest.mark.parametrize("law", ["linear", "hertz"])
@pytest.mark.parametrize("form", FORMS)
def test_derivatives_equal_the_reference(form, law):
    """To 4e-13 of the terms summed, at 100 random states of 100 random strings."""
    found = cases(form, 100, 3, law)
    options = options_of(parameters(*found[0][:2]))
    mine = slopes_with(
        options,
        np.concatenate([packed(c, o) for c, o, *_ in found]),
        np.array([t for *_, t, _ in found]),
        np.array([s for *_, s in found]),
    )
    for (c, o, t, s), row in zip(found, mine, strict=True):
        size = derivative(c, o, t, s, terms=True)
        assert np.all(np.abs(row - derivative(c, o, t, s)) <= 4e-13 * size), (c, o, t, s)


@pytest.mark.parametrize("key", ["mud.swirl", "well.inclination"])
def test_an_option_that_is_zero_somewhere_changes_no_bit_there(key):
    """A point of a sweep that begins at zero has the bits of a run without the
    option."""
    found = cases("swirl", 16, 9)
    plain = [(c, replace(o, swirl=0.0)) for c, o, *_ in found]
    times, states = np.array([t for *_, t, _ in found]), np.array([s for *_, s in found])
    without = np.concatenate([packed(c, o) for c, o in plain])
    zero = [with_values(parameters(c, o), {key: np.zeros(1)}) for c, o in plain]
    swept = np.concatenate([pack(p, c.depth, c.wob, c.speed) for p, (c, _) in zip(zero, plain, strict=True)])
    on = options_of(zero[0])
    assert on != Options()
    assert swept.shape[1] == without.shape[1] + 2
    assert slopes_with(on, swept, times, states).tobytes() == slopes_with(Options(), without, times, states).tobytes()


OF_KEYS = {
    "swirl": Lateral(swirl=0.5),
    "stabilizer": Lateral(clearance=0.0127),
    "weight": Lateral(inclination=np.radians(40)),
    "axial": Lateral(inclination=np.radians(40), axial_friction=True),
    "all": Lateral(swirl=0.5, clearance=0.005, inclination=np.radians(20), axial_friction=True),
}


@pytest.mark.parametrize("form", KEYS)
def test_traces_follow_dop853(form):
    """Half a second to a second of hits and slides, before chaos takes over."""
    text = (
        f"{KEYS[form]}\ninitial: {{x: 70 mm, vy: -0.6 m/s}}\noperation: {{rotary_speed: 5 rad/s}}\n"
        "simulation: {rtol: 1.0e-11}"
    )
    trace = nsdrill.simulate(parse_study(text), duration=0.8, sample=0.05)
    c = Case(speed=5.0)
    start = [trace[name].values[0] for name in STATES]
    exact = solve(c, OF_KEYS[form], np.array(start), trace.time.values)
    assert trace["radius"].values.max() > c.gap, "the collar is to touch the wall"
    size = np.array([0.05, 0.5, 0.05, 0.5, 1e-3, 0.01, 1.0, 1.0])
    for i, name in enumerate(STATES):
        assert np.max(np.abs(trace[name].values - exact[i])) < 2e-7 * size[i], name


def test_a_ramp_follows_dop853():
    """The set speed, with which the mud turns, goes from 3 to 9 rad/s within a
    second."""
    text = (
        f"{KEYS['all']}\ninitial: {{x: 70 mm, vy: -0.6 m/s}}\nsimulation: {{rtol: 1.0e-11}}\n"
        "operation: {rotary_speed: {ramp: [[0 s, 3 rad/s], [1 s, 9 rad/s]]}}"
    )
    trace = nsdrill.simulate(parse_study(text), sample=0.05)

    def rate(t, state):
        return derivative(Case(speed=3.0 + 6.0 * t), OF_KEYS["all"], 0.0, state, phase=3.0 * t + 3.0 * t * t)

    start = [trace[name].values[0] for name in STATES]
    found = solve_ivp(rate, (0.0, 1.0), start, "DOP853", t_eval=trace.time.values, rtol=1e-10, atol=1e-12)
    size = np.array([0.05, 0.5, 0.05, 0.5, 1e-3, 0.01, 1.0, 1.0])
    for i, name in enumerate(STATES):
        assert np.max(np.abs(trace[name].values - found.y[i])) < 2e-5 * size[i], name


def state_of(trace: object) -> dict[str, np.ndarray]:
    return {name: values.values for name, values in trace.data_vars.items()}


def test_energy_is_kept_with_gravity_and_wall_impacts():
    """All losses and drives off, 80 hits in 20 s: to 3e-5 J, of which each hit has its
    random part."""
    text = """
mud: {drag: 0}
well: {inclination: 60 deg, friction: {static: 0, dynamic: 0}}
drillstring: {lateral_softening: none, axial_damping: 0 N*s/m, torsional_damping: 0 N*m*s/rad}
bit: {surface_amplitude: 0 mm, rock_stiffness: 1 N/m, friction: {static: 0, dynamic: 0}, cutting: {zeta: 0}}
modes: {axial: frozen}
operation: {wob: 0 N, rotary_speed: 1.0e-9 rad/s}
initial: {x: 30 mm, y: 20 mm, vx: 0.3 m/s, bit_speed: 1 rad/s}
simulation: {rtol: 1.0e-13}
"""
    study = parse_study(text)
    trace = nsdrill.simulate(study, duration=20.0, sample=0.01)
    held = energy(study.parameters, study.operation, state_of(trace))
    assert np.any(trace["wall_force"].values > 0.0)
    assert np.ptp(trace["bit_speed"].values) > 0.1  # the eccentric weight swings the string
    assert np.max(np.abs(held - held[0])) < 3e-5


WIDE = "stabilizer: {clearance: 25.4 mm}"


@pytest.mark.parametrize("keys", [WIDE, KEYS["weight"], f"{WIDE}\nwell: {{inclination: 10 deg}}"])
def test_features_are_those_of_the_trace(keys):
    """Contact with the stabilisers, grazes included, and the mean position, from a
    dense trace of the same run."""
    text = f"{keys}\nsimulation: {{transient: 5 s, observe: 20 s, rtol: 1.0e-8}}\noperation: {{rotary_speed: 2 rad/s}}"
    study = parse_study(text)
    work = replace(work_for(Case(speed=2.0), study.simulation), parameters=study.parameters)
    found = run_work(work)
    trace = nsdrill.simulate(study, sample=0.0005)
    late = trace.time.values >= 5.0
    radius = trace["radius"].values[late]
    if study.parameters.stabilizer.clearance is not None:
        share = np.mean(radius > study.parameters.stabilizer.clearance)
        assert found["stabilizer_contact_fraction"][0] == pytest.approx(share, abs=2e-3)
        assert 0.05 < share < 1.0
    if study.parameters.well.inclination:
        for name in ("x", "y"):
            mean = np.trapezoid(trace[name].values[late], dx=0.0005) / 20.0
            assert found[f"{name}_mean"][0] == pytest.approx(mean, abs=1e-6)
        assert found["y_mean"][0] < 0.0
    assert found["wall_contact_fraction"][0] == pytest.approx(np.mean(radius > 0.0762), abs=2e-3)
