"""The smallest model: against an independent integration, linear theory and the main
model; and in every command."""

import json
import math
import re
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from cli.helpers import call_here
from reference import disc_torque
from scipy.integrate import solve_ivp

import nsdrill
from models.tops import DRIVES, MOVING
from nsdrill.equations import plain
from nsdrill.errors import StudyError
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.torsion import Parameters, rotating
from nsdrill.models.variant import variant_at

STUDY = """\
model: torsion
operation: {depth: 5000 m, wob: 66.72 kN}
sweep:
  rotary_speed: [2 rad/s, 6 rad/s, 12 rad/s]
  procedure: up-down
simulation: {transient: 60 s, observe: 40 s}
record: {poincare: 4, peaks: 8}
"""


P = Parameters()
INERTIA, STIFFNESS = rotating(P.drillstring, 5000.0)


def linear(speed: float) -> np.ndarray:
    """The matrix of small deviations (twist, bit speed) from steady drilling at 5000 m
    and 66.72 kN."""
    h = 1e-6
    slope = (disc_torque(P.bit, 66.72e3, speed + h) - disc_torque(P.bit, 66.72e3, speed - h)) / (2 * h)
    return np.array([[0.0, 1.0], [-STIFFNESS / INERTIA, -(P.drillstring.torsional_damping + slope) / INERTIA]])


def exact(times: np.ndarray, legs: list[float], speed: Callable[[float], float], wob: Callable[[float], float]):
    """DOP853 of the equations in plain numpy, from steady rotation, leg by leg."""

    def slopes(t, y):
        friction = P.drillstring.torsional_damping * y[1] + disc_torque(P.bit, wob(t), y[1])
        return [y[1] - speed(t), (-STIFFNESS * y[0] - friction) / INERTIA]

    state, found = np.array([0.0, 3.0]), []
    for begin, end in pairwise(legs):
        here = times[(times >= begin) & (times <= end)]
        part = solve_ivp(slopes, (begin, end), state, "DOP853", here, rtol=1e-11, atol=1e-11)
        state = part.y[:, -1]
        found.append(part.y[:, : -1 if end < legs[-1] else None])
    return np.concatenate(found, axis=1)


def test_a_trace_is_that_of_another_integrator():
    """Through sticking and slipping at 3 rad/s."""
    trace = nsdrill.simulate(STUDY, rotary_speed=3.0, duration=20.0, sample=0.1, set={"simulation.rtol": 1e-10})
    twist, speed = exact(trace.time.values, [0.0, 20.0], lambda t: 3.0, lambda t: 66.72e3)
    assert np.abs(trace.twist.values - twist).max() < 1e-6
    assert np.abs(trace.bit_speed.values - speed).max() < 1e-6


FROZEN = {"model": "christoforou_yigit", "modes.axial": "frozen", "modes.lateral": "frozen", "bit.cutting.zeta": 0}


def test_it_is_the_main_model_with_two_motions_frozen():
    """Without cutting torque; the inertia of the collars that the main model computes."""
    inertia = 7850 * math.pi / 32 * (0.2286**4 - 0.0762**4) * 200
    small = nsdrill.run(STUDY, set={"drillstring.collar_inertia": f"{inertia!r} kg*m^2", "simulation.rtol": 1e-9})
    large = nsdrill.run(STUDY, set={**FROZEN, "simulation.rtol": 1e-9})
    for name in ("bit_speed_min", "bit_speed_max", "bit_speed_mean", "stick_slip_index", "surface_torque_max"):
        np.testing.assert_allclose(small[name], large[name], rtol=1e-5, err_msg=name)
    assert np.array_equal(small.response, large.response)
    assert np.array_equal(small.stuck_fraction > 0, large.stuck_fraction > 0)


@pytest.mark.parametrize("name", DRIVES)
def test_a_drive_is_that_of_the_main_model(name, forgets):
    """With the same stiffness and inertia: the slopes of all states at a motion, what ``check`` says, and a run
    in which the bit sticks."""
    text = (
        f"drillstring: {{torsional_stiffness: 473 N*m/rad, rotary_inertia: 374 kg*m^2}}\ndrive: {{{DRIVES[name]}}}\n"
        "operation: {wob: 60 kN, rotary_speed: 6 rad/s}\ninitial: {twist: -10 rad, bit_speed: 1 rad/s}\n"
        "simulation: {transient: 0 s, observe: 8 s, rtol: 1.0e-10}\n"
    )
    studies = [nsdrill.load_study(f"model: torsion\n{text}"), nsdrill.load_study(text, set=FROZEN)]
    slopes, runs, checks = [], [], []
    for study in studies:
        model, parameters = model_named(study.model.name), study.parameters
        variant = variant_at(model, parameters)
        points = Values(parameters, study.initial, (5000.0, 60e3, 6.0))
        given = {"time": 0.0, "phase": 0.0}
        start = dict(zip(variant.states, model.starts(points, 0)[0], strict=False))  # where the bit rests on the rock
        given |= {f"s.{state}": MOVING.get(state, value) for state, value in start.items()}
        given |= {f"p.{lane}": value for lane, value in model.columns(points, Thresholds()).items()}
        rates = plain.values(model.consequences(model.options_of(parameters)).slopes, given)
        slopes.append({state: rates[state] for state in variant.states if state in rates and state in MOVING})
        runs.append(nsdrill.run(study, progress=False))
        checks.append(nsdrill.check(study).figures)
    assert slopes[0] == pytest.approx({state: slopes[1][state] for state in slopes[0]}, rel=1e-12)
    assert {"bit_speed", "drive_speed"} <= slopes[0].keys()
    for one in ("bit_speed_max", "bit_speed_mean", "surface_torque_max", "drive_speed_min", "drive_speed_max"):
        assert float(runs[0][one]) == pytest.approx(float(runs[1][one]), rel=1e-7), one
    for figure, found in checks[0].items():
        wanted = checks[1][figure].value
        assert found.value == (wanted if wanted is None else pytest.approx(wanted, rel=1e-8)), figure
    assert {"drive_reflection", "drive_mode_1"} <= checks[0].keys()


def test_drives_are_an_axis_and_a_branch_is_followed_below_one():
    kinds = {"sweep": {"drive.kind": ["ideal", "stiff", "dc_motor"]}, "initial.ensemble": 2}
    short = {"simulation": {"transient": "0 s", "observe": "1 s"}}
    data = nsdrill.run({"model": "torsion", **kinds, **short}, progress=False)
    assert data.state.values.tolist() == ["twist", "bit_speed", "lag", "drive_speed", "motor_torque", "drive_angle"]
    assert np.isnan(data.drive_speed_max).values.all(axis=1).tolist() == [True, False, False]
    along = {"along": "rotary_speed", "from": "8 rad/s", "to": "9 rad/s", "points": 4}
    study = {"model": "torsion", "continue": {**along, "seeds": {"rotary_speed": ["8.5 rad/s"]}}}
    with pytest.raises(nsdrill.NsdrillError, match="whose angle nothing holds"):
        nsdrill.continue_branches({**study, "drive.kind": "dc_motor"}, progress=False)
    assert nsdrill.continue_branches({**study, "drive.kind": "stiff"}, progress=False).sizes["point"] == 4


@pytest.mark.parametrize(("transient", "observe", "within"), [(0, 80, 0.1), (1000, 1500, 0.005)])
@pytest.mark.parametrize(("speed", "frozen"), [(6.0, False), (12.0, False), (6.0, True)])
def test_the_exponent_of_a_decaying_motion_is_that_of_linear_theory(speed, frozen, transient, observe, within):
    """By the tangent of this model and by that of the main model, whose frozen states
    do not deviate, while the twist swings into that of steady drilling and at rest,
    where steps grow to the edge of their stability."""
    p = Parameters()
    steady = (
        -(p.drillstring.torsional_damping * speed + disc_torque(p.bit, 66.72e3, speed))
        / rotating(p.drillstring, 5000.0)[1]
    )
    found = nsdrill.run(
        STUDY,
        set={
            **(FROZEN if frozen else {}),
            "record.exponent": True,
            "sweep.rotary_speed": f"{speed} rad/s",
            "sweep.procedure": "same",
            "initial.twist": f"{float(steady) + 1.0!r} rad",
            "simulation.transient": f"{transient} s",
            "simulation.observe": f"{observe} s",
        },
    )
    expected = np.linalg.eigvals(linear(speed)).real.max()
    assert expected < -0.02
    assert float(found.lyapunov_exponent) == pytest.approx(expected, rel=within)


def test_the_loop_between_onset_and_fold():
    """Linear theory's onset of stick-slip, where the real part of the eigenvalues
    passes zero, at 3.77 rad/s; the cycle lives on to 9.47 rad/s (both with the smoothed
    law at 5000 m and 66.72 kN)."""
    rates = [np.linalg.eigvals(linear(speed)).real.max() for speed in (3.72, 3.82)]
    assert rates[0] > 0 > rates[1]
    speeds = {"from": "3.2 rad/s", "to": "9.7 rad/s", "points": 14}
    found = nsdrill.run(STUDY, set={"sweep.rotary_speed": speeds, "simulation.transient": "300 s"})
    up, down = (found.rotary_speed.values[row > 0] for row in found.response.values)
    # a step of 0.5 rad/s leaves the narrowing basin of the cycle before its fold
    assert 8.0 < up.max() < 9.5
    assert 3.1 < down.max() < 3.8


def test_lanes_and_workers_leave_no_trace(tmp_path):
    study = {"sweep.rotary_speed": {"from": "1 rad/s", "to": "8 rad/s", "points": 9}, "sweep.procedure": "same"}
    one, two = (nsdrill.run(STUDY, set=study, workers=workers) for workers in (1, 2))
    alone = nsdrill.run(STUDY, set={"sweep.rotary_speed": "1.875 rad/s", "sweep.procedure": "same"})
    for name in one.data_vars:
        assert one[name].values.tobytes() == two[name].values.tobytes(), name
        np.testing.assert_array_equal(one[name].isel(rotary_speed=1), alone[name], err_msg=name)


def test_every_command_knows_it(tmp_path, monkeypatch, capfd):
    call = partial(call_here, capfd, monkeypatch)
    monkeypatch.chdir(tmp_path)
    Path("t.yaml").write_text(STUDY)
    call("new", "--model", "torsion", "-o", "new.yaml")
    assert nsdrill.load_study("new.yaml").model.name == "torsion"
    assert "twist" in call("schema", "--model", "torsion").out
    call("run", "t.yaml", "-o", "t.h5")
    shown = call("show", "t.h5").out
    assert "stick-slip" in shown
    assert "whirl" not in shown
    assert "bit for bit" in call("replay", "t.h5", "--rotary-speed", "2rad/s", "--procedure", "up", "-o", "r.h5").err
    call("simulate", "t.yaml", "-o", "s.h5")
    assert "same to the bit" in call("diff", "t.h5", "t.h5").out
    call("window", "t.h5")
    call("classify", "t.h5", "--set", "classify.stick_slip.stick_slip_index=300")
    call("export", "t.h5", "-o", "t.csv")
    assert "radius" not in Path("t.csv").read_text().splitlines()[0]
    assert "depth [m]" in Path("t.csv").read_text()
    for kind in ("bifurcation", "summary", "poincare", "motion", "window", "stick_slip_index"):
        call("plot", "t.h5", "--kind", kind, "-o", f"{kind}.png")
    for kind in ("trace", "histories", "phase", "section"):
        call("plot", "s.h5", "--kind", kind, "-o", f"{kind}.png")
    assert "orbit" in call("plot", "s.h5", "--kind", "orbit", "-o", "no.png", code=2).err


def test_starts_of_an_ensemble_are_grouped(tmp_path):
    """At 6 rad/s steady drilling and stick-slip coexist: linear theory is stable, and
    the cycle has not folded."""
    many = {
        "initial.ensemble": 24,
        "sweep.rotary_speed": "6 rad/s",
        "sweep.procedure": "same",
        "simulation.transient": "400 s",
        "simulation.observe": "100 s",
    }
    (point,) = nsdrill.attractors(nsdrill.run(STUDY, set=many))
    assert {one["response"] for one in point["attractors"]} == {"none", "stick_slip"}


def test_keys_of_another_model_are_refused():
    with pytest.raises(StudyError) as error:
        nsdrill.load_study("model: torsion\nwell: {diameter: 1 m}\nsweep: {bit.lobes: [1, 2]}\ninitial: {x: 1 mm}")
    text = str(error.value)
    for part in (
        "well: found a key of the models christoforou_yigit, segments and beam, which the model torsion does not have; "
        "allowed: title, units, model, drillstring, bit",
        "sweep.bit.lobes",
        "as bit.friction.static",
        "initial.x: found a key of the models christoforou_yigit and beam, which the model torsion does not have; ",
        "twist, bit_speed, lag, drive_speed, drive_angle",
    ):
        assert part in text


def test_a_ramp_is_that_of_another_integrator():
    """With speed and weight on bit that move, through stick-slip."""
    ramps = {
        "operation.rotary_speed": {"ramp": [["0 s", "3 rad/s"], ["10 s", "7 rad/s"], ["20 s", "7 rad/s"]]},
        "operation.wob": {"ramp": [["0 s", "40 kN"], ["20 s", "70 kN"]]},
        "simulation.rtol": 1e-9,
    }
    text = "model: torsion\noperation: {depth: 5000 m}"
    trace = nsdrill.simulate(text, duration=20.0, sample=0.1, set=ramps)
    twist, speed = exact(
        trace.time.values, [0.0, 10.0, 20.0], lambda t: 3.0 + 0.4 * min(t, 10.0), lambda t: 40e3 + 1.5e3 * t
    )
    assert np.abs(trace.twist.values - twist).max() < 1e-6
    assert np.abs(trace.bit_speed.values - speed).max() < 1e-5
    assert float(trace.drive_angle[-1]) == pytest.approx(50.0 + 70.0)


def test_the_damping_of_torsion_has_one_name_in_every_model(capfd, monkeypatch, tmp_path):
    """The key, and the ratio that ``check`` shows of it, c/(2 sqrt(k J)); the word alone leads to the key."""
    call = partial(call_here, capfd, monkeypatch)
    for model in ("christoforou_yigit", "beam", "torsion"):
        study = tmp_path / f"{model}.yaml"
        study.write_text(f"model: {model}\ndrillstring: {{torsional_damping: 20 N*m*s/rad}}\n")
        shown = json.loads(call("check", str(study), "--json").out)
        k = {name: one["value"] for name, one in shown["coefficients"].items()}
        ratio = 20.0 / (2.0 * math.sqrt(k["k_t"] * k["J"]))
        assert shown["figures"]["torsional_damping"]["value"] == pytest.approx(ratio, rel=1e-12)
        study.write_text(f"model: {model}\ndrillstring: {{damping: 20 N*m*s/rad}}\n")
        assert "Did you mean drillstring.torsional_damping?" in call("check", str(study), code=2).err


def test_numbers_that_decide_where_stick_slip_begins_are_told(tmp_path, capfd, monkeypatch):
    """The onset of the study with another value, as its own check has it; not where the sweep lies far above all."""

    file = tmp_path / "study.yaml"
    file.write_text(STUDY, encoding="utf-8")

    def checked(*changes: str) -> str:
        sets = [word for change in changes for word in ("--set", change)]
        found = call_here(capfd, monkeypatch, "check", file, *sets)
        return " ".join((found.out + found.err).split())

    def onset(said: str) -> float:
        return float(re.search(r"stick_slip_onset ([\d.]+) rad/s", said)[1])

    said = checked()
    told = re.search(r"([\d.]+) rad/s with twice drillstring.torsional_damping", said)
    assert f"the speed below which the bit sticks and slips is {onset(said):.4g} rad/s, and" in said
    assert float(told[1]) == pytest.approx(onset(checked("drillstring.torsional_damping=100 N*m*s/rad")), rel=1e-3)
    assert "Sensitive" not in checked("sweep.rotary_speed=[40 rad/s, 50 rad/s]")
