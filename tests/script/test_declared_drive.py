"""Drives of scripts: against those of nsdrill, against SciPy, in all answers, and what is
refused of them."""

import json
import re
import subprocess
import sys
from dataclasses import astuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.torsion_checks import stick_slip_lasts
from nsdrill.models.variant import variant_at
from nsdrill.operations.runs import load_study
from nsdrill.text.run_text import check_lines
from nsdrill.variables import OK

from .conftest import command

PI = """
@nsdrill.drive
def written_again(
    lag, drive_speed, twist, bit_speed, set_speed,
    *, k_i=number(900.0, "N m/rad"), k_p=number(1500.0, "N m s/rad"), g_t=number(0.0, "N m/rad"),
    g_w=number(0.0, "N m s/rad"),
):
    return -(k_i * lag + k_p * (drive_speed - set_speed) + g_t * (twist - lag) + g_w * (bit_speed - set_speed))
"""
UNWINDING = """
@nsdrill.drive
def unwinding(
    lag, drive_speed, set_speed, wound=0.0,
    *, gain=number(900.0, "N m/rad"), damper=number(1500.0, "N m s/rad"), slow=number(50.0, "s", low=0.1),
):
    \"\"\"The integral of the error is forgotten, and does not wind up\"\"\"
    return -gain * wound - damper * (drive_speed - set_speed), {"wound": drive_speed - set_speed - wound / slow}
"""
OWN = {
    "kind": "written_again",
    "k_i": "900 N*m/rad",
    "k_p": "1500 N*m*s/rad",
    "g_t": "50 N*m/rad",
    "g_w": "30 N*m*s/rad",
}
BUILT_IN = {
    "kind": "pi", "stiffness": "900 N*m/rad", "damping": "1500 N*m*s/rad", "twist_gain": "50 N*m/rad",
    "speed_gain": "30 N*m*s/rad",
}  # fmt: skip
SHORT = {"transient": "10 s", "observe": "10 s"}
MODELS = {
    "christoforou_yigit": {"modes": {"axial": "frozen", "lateral": "frozen"}},
    "segments": {"segments": {"pipe": 2, "collar": 2}},
    "regenerative": {},
}


def study(model, drive, **more):
    return {"model": model, **MODELS[model], "drive": drive, "simulation": SHORT, **more}


@pytest.mark.parametrize("model", MODELS)
def test_the_drive_of_nsdrill_written_again_has_its_bits_and_its_theory(script, model):
    script(PI, "again")
    sweep = {"rotary_speed": ["3 rad/s", "6 rad/s"]}
    limit = {"torque_limit": "3 kN*m"}
    for further in ({}, limit):
        one, other = (
            nsdrill.run(study(model, {**drive, **further}, sweep=sweep), progress=False) for drive in (OWN, BUILT_IN)
        )
        assert np.array_equal(one.final_state, other.final_state)
        assert np.array_equal(one.surface_torque_max, other.surface_torque_max)
    one, other = (nsdrill.check(study(model, drive)) for drive in (OWN, BUILT_IN))
    # the same numbers, but for last digits of sums in another order
    assert one.figures.keys() == other.figures.keys()
    for name, found in one.figures.items():
        wanted = other.figures[name].value
        assert found.value == (wanted if wanted is None else pytest.approx(wanted, rel=1e-9, abs=1e-12)), name


def on_surface(drive):
    bit = {"rock": {"law": "regenerative", "states": 6}}
    return study("segments", drive, bit=bit, simulation={"transient": "1 s", "observe": "2 s"})


def test_a_string_of_segments_on_the_surface_that_blades_leave_has_a_drive_of_a_script(script):
    """As that of nsdrill; with states, those of the drive come after those of the surface."""
    script(PI + UNWINDING, "again")
    one, other = (nsdrill.run(on_surface(drive), progress=False) for drive in (OWN, BUILT_IN))
    assert np.array_equal(one.final_state, other.final_state)
    data = nsdrill.run(on_surface({"kind": "unwinding"}), progress=False)
    assert data.status.item() == OK
    assert data.state.values[-3:].tolist() == ["surface_5", "drive_wound", "drive_angle"]
    assert np.isfinite(data.final_state.sel(state="drive_wound").item())


@pytest.mark.parametrize("rock", ["lobed", "regenerative"])
def test_the_scales_of_the_returns_are_those_of_their_states(script, rock):
    """A drive with a state, a surface or none; also where a string lacks some of the states."""
    script(UNWINDING, "unwinding")
    text = on_surface({"kind": "unwinding"}) | ({} if rock == "regenerative" else {"bit": {}})
    loaded = nsdrill.load_study(text)
    model = model_named(loaded.model.name)
    variant = variant_at(model, loaded.parameters)
    table = np.arange(1.0, 1.0 + len(variant.names.parameters))[None]
    scales = variant.state_scales(table)
    wanted = scales[
        :, [variant.states.index(name) for name in ("z", "vz", "twist", "bit_speed", "drive_speed", "current")]
    ]
    assert np.array_equal(model.seen(scales), wanted)
    lacking = scales.copy()
    lacking[:, -1 - 6 * (rock == "regenerative") :] = np.nan
    assert np.array_equal(model.seen(np.concatenate([lacking, scales]))[:1], wanted)


def test_what_a_drive_reflects_is_that_of_the_one_of_nsdrill(script):
    """z / Z of an impedance, without gains on the motion of the bit."""
    script(PI, "again")
    drives = ({"kind": "written_again"}, {"kind": "pi", "stiffness": "900 N*m/rad", "damping": "1500 N*m*s/rad"})
    found = [nsdrill.check(study("christoforou_yigit", drive)).figures for drive in drives]
    assert found[0]["drive_reflection"].value == pytest.approx(found[1]["drive_reflection"].value, rel=1e-12)
    # an integral that is never forgotten is the lag: the same drive with a state of its own
    script(UNWINDING, "unwinding")
    slow = {"kind": "unwinding", "slow": "1e12 s"}
    with_state = nsdrill.check(study("christoforou_yigit", slow)).figures["drive_reflection"]
    assert with_state.value == pytest.approx(found[1]["drive_reflection"].value, rel=1e-9)


def test_a_drive_with_a_state_is_that_of_scipy(script):
    script(UNWINDING, "unwinding")
    given = study(
        "christoforou_yigit", {"kind": "unwinding"}, simulation={"transient": "0 s", "observe": "30 s", "rtol": 1e-9}
    )
    data = nsdrill.run(given, progress=False)
    assert data.state.values.tolist()[-2:] == ["drive_wound", "drive_angle"]
    k = vars(nsdrill.check(given).coefficients)
    # the string that only turns: theory page; its friction with the defaults of the page
    resolved = json.loads(data.attrs["study_resolved"])
    law, bit = resolved["bit"]["friction"], resolved["well"]["diameter"] / 2
    wob, speed, c_t = resolved["operation"]["wob"], 3.0, resolved["drillstring"]["torsional_damping"]
    arm, inertia = 2 / 3 * bit, resolved["drive"]["inertia"]

    def slopes(t, y):
        twist, w, lag, w_d, wound = y
        direction = 2 / np.pi * np.arctan(law["smoothing"] * w)
        fall = arm * ((law["static"] - law["dynamic"]) / (1 + law["decay"] * abs(w)) + law["dynamic"])
        torque = wob * direction * (fall + k["cutting_arm"])
        pipe = k["k_t"] * (lag - twist)
        motor = -900.0 * wound - 1500.0 * (w_d - speed)
        return [
            w - speed, (pipe - c_t * w - torque) / k["J"], w_d - speed, (motor - pipe) / inertia,
            w_d - speed - wound / 50.0,
        ]  # fmt: skip

    end = solve_ivp(slopes, (0.0, 30.0), [0.0, speed, 0.0, speed, 0.0], "LSODA", rtol=1e-10, atol=1e-10).y[:, -1]
    found = data.final_state.squeeze().sel(state=["twist", "bit_speed", "lag", "drive_speed", "drive_wound"]).values
    assert found == pytest.approx(end, rel=1e-5, abs=1e-5)


SATURATED = """
@nsdrill.drive
def saturated(
    lag, drive_speed, set_speed, charge=number(0.0, scale=0.3),
    *, kp=1500.0, ki=900.0, least=0.0, most=5000.0, back=2.0,
):
    error = set_speed - drive_speed
    asked = kp * error + ki * charge
    given = min(max(asked, least), most)
    return given, error + (given - asked) / (ki * back)


@nsdrill.drive
def unlimited(lag, drive_speed, set_speed, charge=0.0, *, kp=1500.0, ki=900.0):
    error = set_speed - drive_speed
    return kp * error + ki * charge, error
"""


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_steady_drilling_of_a_drive_with_a_limit_is_found_or_told_to_be_unknown(script):
    """Within its limit it drills as without one, and as the run; beyond it nothing is said of it."""
    script(SATURATED, "limited")
    study = {"model": "torsion", "operation": {"wob": "40 kN", "rotary_speed": "5 rad/s"}}

    def checked(drive):
        found = nsdrill.check({**study, "drive": drive})
        return {name: one.value for name, one in found.figures.items()}, " ".join(found.warnings)

    names = ("balance_speed", "mean_torque", "static_twist", "stick_slip_onset")
    wanted, warned = checked({"kind": "unlimited"})
    run = {**study, "drive": {"kind": "saturated"}, "simulation": {"transient": "300 s", "observe": "50 s"}}
    data = nsdrill.run(run, progress=False)
    assert data.surface_torque_max.item() == pytest.approx(wanted["mean_torque"], rel=1e-3)
    for least in (0.0, -1.0):
        found, told = checked({"kind": "saturated", "least": least})
        assert [found[name] for name in names] == pytest.approx([wanted[name] for name in names], rel=1e-9)
        assert told == warned
    found, told = checked({"kind": "saturated", "most": 2000.0})
    assert found["mean_torque"] == pytest.approx(wanted["mean_torque"], rel=1e-9)
    assert "Not known: whether the drive breaks the bit away under 40 kN" in told
    found, told = checked({"kind": "saturated", "most": 1000.0})
    assert (found["balance_speed"], found["mean_torque"], found["droop"]) == (None, None, None)
    assert "no balance of motor and bit is found with the drive saturated" in told
    assert "At rest" not in told
    assert "Stalls" not in told
    report = nsdrill.check({**study, "drive": {"kind": "saturated", "most": 1000.0}})
    unknown = ("balance_speed", "mean_torque", "static_twist", "stick_slip_onset", "stick_slip_fold")
    assert {name for name, one in report.figures.items() if not one.known} >= {*unknown}
    assert report.as_json()["figures"]["stick_slip_onset"]["known"] is False
    loaded = load_study({**study, "drive": {"kind": "saturated", "most": 1000.0}})
    shown = "\n".join(check_lines(loaded, report, "study.yaml", "si", False))
    assert re.search(r"stick_slip_onset +not known", shown)
    assert all(one.known for one in nsdrill.check({**study, "drive": {"kind": "unlimited"}}).figures.values())
    # and the window of such a study does not take it for a speed at which nothing lasts
    assert stick_slip_lasts([Values(loaded.parameters, loaded.initial, astuple(loaded.operation))]) == [None]


def test_trace_exponent_and_words_along_an_axis(script):
    script(UNWINDING, "unwinding")
    trace = nsdrill.simulate(study("christoforou_yigit", {"kind": "unwinding"}))
    assert np.ptp(trace.drive_wound.values) > 0.0
    assert trace.drive_wound.attrs["units"] == "1"
    kinds = {"drive.kind": ["stiff", "unwinding"], "procedure": "same"}
    data = nsdrill.run(
        study("christoforou_yigit", {"kind": "stiff"}, sweep=kinds, record={"exponent": True}), progress=False
    )
    assert data.drive_kind.values.tolist() == ["stiff", "unwinding"]
    assert np.all(np.isfinite(data.lyapunov_exponent))
    assert np.isnan(data.final_state.sel(drive_kind="stiff", state="drive_wound")).all()


def test_branches_follow_a_drive_that_holds_its_angle_and_refuse_another(script):
    script(PI + UNWINDING, "both")
    along = {"along": "rotary_speed", "from": "6 rad/s", "to": "9 rad/s", "seeds": {"rotary_speed": ["8 rad/s"]}}
    settled = {"transient": "200 s", "observe": "20 s"}
    followed = {"continue": {**along, "points": 4}, "simulation": settled}
    one, other = (
        nsdrill.continue_branches(study("christoforou_yigit", drive, **followed), progress=False)
        for drive in (
            {"kind": "written_again"},
            {"kind": "pi", "stiffness": "900 N*m/rad", "damping": "1500 N*m*s/rad"},
        )
    )
    assert one.sizes["point"] == other.sizes["point"] > 1
    assert np.allclose(one.state.sel(state_name="bit_speed"), other.state.sel(state_name="bit_speed"), rtol=1e-9)
    with pytest.raises(nsdrill.NsdrillError, match="whose angle nothing holds"):
        nsdrill.continue_branches(study("christoforou_yigit", {"kind": "unwinding"}, **followed), progress=False)


FAULTY = {
    "def f(x=0.0):\n    return x, -x": "found nothing of the motion",
    "def f(lag=1.0):\n    return lag": "found lag with a default, which is given",
    "def f(lag, wound):\n    return lag, -wound": "found wound without a default",
    "def f(lag, a=0.0, b=0.0, c=0.0, d=0.0):\n    return lag, (a, b, c, d)": "found 4 states; allowed: at most 3",
    "def f(lag, *, damping=1.0):\n    return -damping * lag": "found the name damping, and there is drive.damping",
    "def stiff(lag):\n    return -lag": "found the name stiff, a drive of nsdrill",
    "def f(lag):\n    return lag, 1.0": "found (1.0, 1.0) as what it returns; allowed: the torque alone",
    "def f(lag, x=0.0):\n    return -x": "allowed: a pair of the torque and the slopes of its states, x",
    "def f(lag, x=0.0):\n    return -x, {'y': 1.0}": "allowed: a pair of the torque and the slopes of its states, x",
    "def f(lag, x=0.0):\n    return -lag, lag - x": "found the state x, with which the torque does not change",
    "def f(lag):\n    print(lag)\n    return -lag": "faulty.py, line 10: f: print(lag): found a value where",
    "def f(lag, *, stiff=2.0, nix=3.0):\n    return -stiff * lag": "found the number nix, which nothing reads; allowed",
    "def f(lag, drive_speed, *, k=number(9.0, 'N m s/rad'), p=1.0):\n    return -k * lag - p * drive_speed": "in N m s",
}  # fmt: skip


@pytest.mark.parametrize("text", FAULTY)
def test_what_cannot_be_a_drive_is_refused_with_its_line(script, text):
    with pytest.raises(nsdrill.NsdrillError) as raised:
        script(f"\n\n@nsdrill.drive\n{text}\n", "faulty")
    assert FAULTY[text] in str(raised.value)
    assert "faulty.py, line" in str(raised.value)


def test_two_drives_share_a_key_each_with_its_own_default(script):
    text = "@nsdrill.drive\ndef {}(lag, *, soft={}):\n    return -soft * lag\n\n\n"
    script(text.format("one", 2.0) + text.format("two", 3.0), "alike")
    for study, wanted in (
        ({"drive.kind": "one"}, 2.0),
        ({"drive.kind": "two"}, 3.0),
        ({"sweep": {"drive.kind": ["stiff", "two"]}}, 3.0),
    ):
        assert nsdrill.load_study(study).parameters.drive.soft == wanted
    with pytest.raises(nsdrill.StudyError, match=r"default of drive.soft depends \(2 with one, 3 with two\)"):
        nsdrill.load_study({"sweep": {"drive.kind": ["one", "two"]}})
    with pytest.raises(nsdrill.InputError, match=r"three: found soft with another unit or .*: one\)"):
        script(text.format("three", 'number(3.0, "N*m/rad")'), "other")


def test_a_drive_that_divides_by_zero_is_refused_at_its_key(script):
    """As a study gives it, by default, or at an end of an axis; in check and in a run."""
    script(UNWINDING.replace('50.0, "s", low=0.1', '0.0, "s"'), "zero")
    said = r"drive.slow: found 0.*, with which the slope of wound, or how it changes, is no number at the set point"
    for call in (nsdrill.check, nsdrill.run):
        with pytest.raises(nsdrill.StudyError, match=said):
            call({"model": "torsion", "drive": {"kind": "unwinding"}})
    with pytest.raises(nsdrill.StudyError, match=said):
        nsdrill.load_study(
            {"model": "torsion", "drive": {"kind": "unwinding"}, "sweep": {"drive.slow": ["0 s", "50 s"]}}
        )
    assert nsdrill.check({"model": "torsion", "drive": {"kind": "unwinding", "slow": "50 s"}}).points == 1


def test_a_drive_with_a_filter_has_no_gain_at_all_frequencies(script):
    filtered = (
        "(drive_speed, slow=0.0, *, brake=1500.0, tau=0.5):\n    return -brake * slow, (drive_speed - slow) / tau"
    )
    script(f"@nsdrill.drive\ndef filtered{filtered}\n", "filtered")
    figures = nsdrill.check(study("christoforou_yigit", {"kind": "filtered"})).figures
    assert figures["drive_damping"].value is None
    assert "depend on the frequency" in figures["drive_damping"].meaning


def test_commands_take_the_drive_where_its_script_is_given(tmp_path):
    (tmp_path / "d.py").write_text(f"import nsdrill\nfrom nsdrill import number\n\n{UNWINDING}", encoding="utf-8")
    (tmp_path / "s.yaml").write_text(
        "modes: {axial: frozen, lateral: frozen}\ndrive: {kind: unwinding, gain: 800 N*m/rad}\n"
        "sweep:\n  drive.damper: [1000 N*m*s/rad, 2000 N*m*s/rad]\nsimulation: {transient: 5 s, observe: 5 s}\n",
        encoding="utf-8",
    )
    _, said = command(tmp_path, "run", "s.yaml", "-o", "o.h5", code=2)
    assert "or the drive of an installed package or of a script that is given (--with its file" in said
    command(tmp_path, "run", "s.yaml", "-o", "o.h5", "--with", "d.py")
    _, said = command(tmp_path, "show", "o.h5", code=2)
    assert "made with the drive unwinding of the script d.py, which is executed only where it is given" in said
    shown, _ = command(tmp_path, "show", "o.h5", "--with", "d.py")
    assert "unwinding" in shown
    _, said = command(tmp_path, "replay", "o.h5", "--at", "drive.damper=2000N*m*s/rad", "-o", "r.h5", "--with", "d.py")
    assert "bit for bit" in said
    text = (tmp_path / "d.py").read_text(encoding="utf-8")
    (tmp_path / "d.py").write_text(text.replace("-gain * wound", "-1.01 * gain * wound"), encoding="utf-8")
    _, said = command(tmp_path, "show", "o.h5", "--with", "d.py", code=2)
    assert "CHANGED SINCE THE RUNS: made with the drive unwinding of the script d.py, which computes" in said
    at = ["--at", "drive.damper=2000N*m*s/rad", "-o", "r2.h5"]
    _, said = command(tmp_path, "replay", "o.h5", *at, "--with", "d.py", code=2)
    assert "CHANGED SINCE THE RUNS" in said


def test_other_processes_execute_the_script_of_a_drive(tmp_path):
    (tmp_path / "d.py").write_text(f"import nsdrill\nfrom nsdrill import number\n\n{UNWINDING}", encoding="utf-8")
    (tmp_path / "elsewhere.py").write_text(
        "from concurrent.futures import ProcessPoolExecutor\nfrom multiprocessing import get_context\n\n"
        "import d\nimport nsdrill\nimport numpy as np\nfrom nsdrill.app.running.run import run_in_memory\n"
        "from nsdrill.study.load import parse_study\n\n"
        "if __name__ == '__main__':\n"
        "    study = parse_study('modes: {axial: frozen, lateral: frozen}\\ndrive: {kind: unwinding}\\n'\n"
        "        'sweep: {rotary_speed: [3 rad/s, 4 rad/s]}\\nsimulation: {transient: 5 s, observe: 5 s}')\n"
        "    with ProcessPoolExecutor(1, mp_context=get_context('spawn')) as pool:\n"
        "        there = run_in_memory(study, executor=pool, workers=1)\n"
        "    here = run_in_memory(study, workers=1)\n"
        "    print(np.array_equal(there.variables['final_state'], here.variables['final_state']))\n",
        encoding="utf-8",
    )
    done = subprocess.run([sys.executable, "elsewhere.py"], capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert done.stdout.splitlines()[-1:] == ["True"], done.stderr


def test_a_drive_that_a_study_does_not_name_changes_nothing_of_it(script, tmp_path):
    before = nsdrill.run(
        {"sweep": {"rotary_speed": ["3 rad/s"]}, "simulation": SHORT}, tmp_path / "o.h5", progress=False
    )
    study = nsdrill.load_study({"sweep": {"rotary_speed": ["3 rad/s"]}, "simulation": SHORT})
    script(UNWINDING, "unwinding")
    assert nsdrill.load_study({"sweep": {"rotary_speed": ["3 rad/s"]}, "simulation": SHORT}) == study
    trace = nsdrill.replay(tmp_path / "o.h5", rotary_speed="3 rad/s")
    assert trace.attrs["same_bits"]
    assert "used_scripts" not in before.attrs


@pytest.mark.parametrize("model", ["christoforou_yigit", "segments"])
def test_the_chart_of_drives_has_that_of_a_script(script, model, tmp_path):
    script(UNWINDING, "unwinding")
    figure = nsdrill.chart(study(model, {"kind": "unwinding"}), "drive-card")
    (line,) = [one for one in figure.axes[0].lines if one.get_gid() == "unwinding"]
    assert "this study" in line.get_label()
    assert 0.0 < np.max(line.get_ydata()) <= 1.05


def test_a_drive_that_settles_at_half_its_speed_is_told_of_after_the_run_and_in_what_is_shown(script):
    """By its own law, which no warning of a check need precede in Python."""
    script(
        """
@nsdrill.drive
def half(drive_speed, set_speed, held=0.0, *, kp=1000.0, ki=500.0):
    off = drive_speed - 0.5 * set_speed
    return -kp * off - ki * held, off
""",
        "half_speed",
    )
    study = {
        "model": "torsion",
        "operation": {"depth": "2000 m", "wob": "10 kN", "rotary_speed": "10 rad/s"},
        "simulation": {"transient": "600 s", "observe": "60 s"},
        "drive": {"kind": "half"},
    }
    with pytest.warns(nsdrill.RunWarning, match="DRIVE SLOWER than it is set: in 1 of 1 run"):
        data = nsdrill.run(study, progress=False)
    assert data.drive_speed_mean.item() == pytest.approx(5.0, rel=1e-2)
    assert "50% of it at least" in nsdrill.show(data)
