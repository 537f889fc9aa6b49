"""What a log over time says beside means and extremes."""

import numpy as np
import pytest

import nsdrill
from nsdrill.app.fitting.logged import of_stretches
from nsdrill.app.fitting.measured import Reading, read_measured

STUDY = """
model: segments
drive: {kind: pi, inertia: 2900 kg*m^2, damping: 4000 N*m*s/rad, stiffness: 6000 N*m/rad}
operation: {depth: 2200 m, wob: 100 kN, rotary_speed: 10 rad/s}
initial: {start: rest}
simulation: {transient: 40 s, observe: 100 s}
"""


@pytest.fixture(scope="module")
def trace():
    return nsdrill.simulate(STUDY, duration="240 s", sample="0.2 s").sel(time=slice(40, None))


def log_of(trace, tmp_path, every=1):
    names = ("time", "surface_torque", "drive_speed")
    rows = zip(*(trace[name].values[::every] for name in names), strict=True)
    lines = ["time [s], surface_torque [N*m], drive_speed [rad/s], rotary_speed [rad/s], wob [kN]"]
    lines += [", ".join(f"{value:.6f}" for value in row) + ", 10, 100" for row in rows]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_log_of_torque_has_the_period_of_the_run(trace, tmp_path):
    study = nsdrill.load_study(STUDY)
    found = read_measured(log_of(trace, tmp_path), study, Reading(shortest=100.0, settle=20.0))
    run = float(nsdrill.run(STUDY).stick_slip_period.squeeze())
    assert found.values["stick_slip_period"][0] == pytest.approx(run, rel=0.01)
    assert np.isfinite(found.errors["stick_slip_period"]).all()


def test_the_log_tells_the_gains_of_the_drive(trace, tmp_path):
    found = read_measured(log_of(trace, tmp_path), nsdrill.load_study(STUDY), Reading(shortest=100.0, settle=20.0))
    told = " ".join(found.notes)
    assert "Gains of the drive" in told
    kept = [(0, trace.time.size)]
    signals = {name: trace[name].values for name in ("surface_torque", "drive_speed")}
    _, notes = of_stretches(trace.time.values, signals, {}, kept)
    assert "drive: {kind: pi" in notes[-1]


def test_a_coarse_log_has_neither(trace, tmp_path):
    """Two samples a cycle."""
    study = nsdrill.load_study(STUDY)
    found = read_measured(log_of(trace, tmp_path, every=15), study, Reading(shortest=100.0, settle=20.0))
    assert "stick_slip_period" not in found.values
    assert "Gains" not in " ".join(found.notes)


def test_the_period_is_fitted(tmp_path):
    """The stiffness of the pipe, unknown, from a period that another run had."""
    study = """
model: torsion
operation: {depth: 3000 m, wob: 60 kN, rotary_speed: 2.5 rad/s}
simulation: {transient: 30 s, observe: 60 s}
uncertain: {drillstring.outer_diameter: {uniform: [120 mm, 140 mm]}}
"""
    truth = nsdrill.run(study, set={"uncertain": None, "drillstring.outer_diameter": "131 mm"})
    period = float(truth.stick_slip_period.squeeze())
    path = tmp_path / "field.csv"
    path.write_text(f"rotary_speed [rad/s], stick_slip_period [s], stick_slip_period_error [s]\n2.5, {period}, 0.05\n")
    found = nsdrill.fit(study, path, batch=16, rounds=3, progress=False)
    assert np.mean(found.samples["drillstring.outer_diameter"]) == pytest.approx(0.131, abs=0.002)


STEADY = nsdrill.load_study("model: torsion\noperation: {depth: 2500 m, wob: 60 kN, rotary_speed: 70 rpm}\n")
T = np.arange(600.0)


def noise(rows):
    """Filtered over nine samples, as a sensor with a low pass has it."""
    white = np.random.default_rng(7).standard_normal(rows + 9)
    return 3.0 * np.convolve(white, np.ones(9) / 9.0, "same")[:rows]


def torque_log(tmp_path, torque):
    rows = [f"{t:g},60,70,{value:.4f}" for t, value in zip(T, torque, strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time [s],wob [kN],rotary_speed [rpm],surface_torque [kN*m]", *rows]) + "\n")
    return path


@pytest.mark.parametrize(
    ("torque", "said"),
    [
        (12.0 + 0.48 * np.random.default_rng(3).standard_normal(len(T)), "does not repeat, as noise does not"),
        (12.0 + 0.48 * noise(len(T)), "does not repeat, as noise does not"),
        (12.0 + 0.3 * np.sin(2 * np.pi * T / 75.0), "swings by at most 2.5 % about its mean"),
    ],
)
def test_noise_and_drift_are_no_stick_slip(tmp_path, torque, said):
    found = read_measured(torque_log(tmp_path, torque), STEADY)
    assert "stick_slip_period" not in found.values
    assert any(said in note for note in found.notes), found.notes


def test_a_period_is_told_with_its_scatter_and_can_be_left_out(tmp_path):
    swings = 12.0 + 3.0 * np.sin(2 * np.pi * T / 8.3) + 0.2 * np.random.default_rng(3).standard_normal(len(T))
    path = torque_log(tmp_path, swings)
    found = read_measured(path, STEADY)
    assert found.values["stick_slip_period"][0] == pytest.approx(8.3, rel=0.01)
    (told,) = [note for note in found.notes if note.startswith("stick_slip_period of 1 stretch of 1")]
    assert "from surface_torque: 8.301 s (cycles scatter by 1.2 %)" in told
    assert "ignore=['stick_slip_period'] leaves it out" in told
    without = read_measured(path, STEADY, Reading(ignore=["stick_slip_period"]))
    assert "stick_slip_period" not in without.values
    assert not any("stick_slip_period" in note for note in without.notes)
