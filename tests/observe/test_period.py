"""The period that a run counts as it goes, against samples of the same run in two
passes: the extremes of the window, then the rises between them."""

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.cycles import period_of

TRANSIENT, OBSERVE = 40.0, 100.0
STUDIES = {
    "torsion": "model: torsion\noperation: {depth: 3000 m, wob: 60 kN}\n",
    "explicit": "operation: {depth: 3000 m, wob: 66.72 kN}\nmodes: {lateral: frozen, axial: frozen}\n",
    "implicit": "operation: {depth: 3000 m, wob: 66.72 kN}\nbit: {friction: {smoothing: 1.0e+5 s/rad}}\n"
    "modes: {lateral: frozen, axial: frozen}\n",
    "segments": "model: segments\ninitial: {start: rest}\n",
}
SPEEDS = {"segments": "13 rad/s"}


def study_of(name, speed):
    window = f"simulation: {{transient: {TRANSIENT} s, observe: {OBSERVE} s}}\n"
    return f"{STUDIES[name]}sweep: {{rotary_speed: [{speed}]}}\n{window}"


@pytest.mark.parametrize("name", STUDIES)
def test_a_run_counts_the_period_that_its_samples_have(name):
    """Of motions that repeat, to 1e-4: the crossings between samples are those of straight
    lines, and the run leaves out the first cycle, from which it learns the range."""
    study = study_of(name, SPEEDS.get(name, "2.5 rad/s"))
    found = nsdrill.run(study)
    trace = nsdrill.simulate(
        study, rotary_speed=SPEEDS.get(name, "2.5 rad/s"), duration=f"{TRANSIENT + OBSERVE} s", sample="10 ms"
    )
    observed = trace.sel(time=slice(TRANSIENT, None))
    expected = period_of(observed.time.values, observed.bit_speed.values)
    assert float(found.stick_slip_period.squeeze()) == pytest.approx(expected, rel=3e-4)
    ratio = observed.bit_speed.max() / float(found.rotary_speed.squeeze())
    assert float(found.peak_ratio.squeeze()) == pytest.approx(float(ratio), rel=1e-3)


def test_the_surface_torque_of_a_motion_has_the_same_period():
    study = study_of("torsion", "2.5 rad/s")
    trace = nsdrill.simulate(study, rotary_speed="2.5 rad/s", duration=f"{TRANSIENT + OBSERVE} s", sample="0.1 s")
    observed = trace.sel(time=slice(TRANSIENT, None))
    of_torque, of_speed = (
        period_of(observed.time.values, observed[name].values) for name in ("surface_torque", "bit_speed")
    )
    assert of_torque == pytest.approx(of_speed, rel=0.01)


def test_no_period_without_three_cycles_or_without_a_swing():
    short = study_of("torsion", "2.5 rad/s").replace("observe: 100.0", "observe: 22")
    assert np.isnan(nsdrill.run(short).stick_slip_period).all()
    steady = study_of("torsion", "30 rad/s")
    assert np.isnan(nsdrill.run(steady).stick_slip_period).all()


def test_the_period_does_not_depend_on_the_lanes_beside_it():
    both = nsdrill.run(study_of("torsion", "2 rad/s, 2.5 rad/s, 3 rad/s, 4 rad/s"))
    alone = nsdrill.run(study_of("torsion", "2.5 rad/s"))
    assert float(both.stick_slip_period.squeeze()[1]) == float(alone.stick_slip_period.squeeze())
