"""Stick-slip with a drive that is limited, or not linear: from a wound string it lasts to higher
speeds than by its cycle, so that check and window do not say to which."""

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import results_for_window
from nsdrill.app.answering.stick_slip_end import damping_of_torsion
from nsdrill.models.own_drives import own_drive
from nsdrill.models.torsion_checks import drilling_at
from nsdrill.operations.runs import load_study
from nsdrill.text.run_text import check_lines
from nsdrill.words.answer import warnings

STUDY = {
    "model": "torsion",
    "operation": {"depth": "3000 m", "wob": "60 kN", "rotary_speed": "6 rad/s"},
    "drillstring": {"torsional_damping": "25 N*m*s/rad"},
}
PI = {"kind": "pi", "inertia": "2900 kg*m^2", "stiffness": "800 N*m/rad", "damping": "1500 N*m*s/rad"}
FOLD = 5.604  # rad/s, without a limit: runs up in steps of 0.2 % stick to there
DRIVES = """
@nsdrill.drive
def straight(lag, drive_speed, set_speed, wound=0.0, *, gain=900.0, brake=1500.0, slow=50.0, mode=1.0):
    error = drive_speed - set_speed
    torque = -gain * wound - brake * error
    if mode > 0.0:
        torque = -gain * wound - 2.0 * brake * error / (1.0 + mode)
    return torque, error - wound / slow


@nsdrill.drive
def clip(lag, drive_speed, set_speed, *, stiff=800.0, brake=1500.0, top=4000.0):
    return max(0.0, min(top, 3000.0 - stiff * lag - brake * (drive_speed - set_speed)))


@nsdrill.drive
def relay(lag, drive_speed, set_speed, *, brake=3000.0, stiff=800.0, narrow=1000.0):
    return -stiff * lag - brake * np.tanh(narrow * (drive_speed - set_speed)) / narrow


@nsdrill.drive
def switch(lag, drive_speed, set_speed, *, stiff=800.0, brake=500.0):
    return -stiff * lag + (brake if drive_speed < set_speed else -brake)


@nsdrill.drive
def stiffening(lag, drive_speed, set_speed, *, stiff=800.0, brake=1500.0):
    return -stiff * lag * (1.0 + lag * lag) - brake * (drive_speed - set_speed)


@nsdrill.drive
def clipped_state(lag, drive_speed, set_speed, wound=0.0, *, gain=900.0, brake=1500.0):
    error = drive_speed - set_speed
    return -gain * wound - brake * error, min(error, 1.0)
"""


def limited(limit):
    return {**STUDY, "drive": {**PI, "torque_limit": limit}}


def swing(limit, speed, start):
    """The least and the greatest bit speed [rad/s] at last, by SciPy, with the coefficients of the study."""
    inertia, stiffness, damping = 502.768, 337.839, 25.0

    def slopes(t, y):
        lag, drive, twist, bit = y
        string = stiffness * (lag - twist)
        motor = min(max(-800.0 * lag - 1500.0 * (drive - speed), 0.0), limit)
        rock = np.tanh(500.0 * bit) * (2238.304 / (1.0 + 3.0 * abs(bit)) + 1527.296)
        turned = (string - rock - damping * (bit - speed)) / inertia
        return [drive - speed, (motor - string) / 2900.0, bit - speed, turned]

    found = solve_ivp(slopes, (0.0, 500.0), start, method="LSODA", rtol=1e-6, t_eval=np.linspace(440.0, 500.0, 3000))
    return found.y[3].min(), found.y[3].max()


def test_from_a_wound_string_a_limited_drive_sticks_above_the_fold_of_one_without():
    wound, held = [-2.25, 6.0, -14.25, 0.0], [0.0, 6.0, 0.0, 0.0]
    low, high = swing(3600.0, 6.0, wound)
    assert low < 0.1
    assert high > 2.0 * FOLD
    assert swing(3600.0, 6.0, held) == pytest.approx((6.0, 6.0), abs=0.05)  # a bit at rest does not tell it
    assert swing(1e9, 6.0, wound) == pytest.approx((6.0, 6.0), abs=0.05)


@pytest.mark.parametrize("limit", ["2.2 kN*m", "2.6 kN*m", "3.2 kN*m", "3.6 kN*m", None])
def test_check_does_not_know_the_fold_of_a_limited_drive(limit):
    study = limited(limit)
    report = nsdrill.check(study)
    fold, onset = report.figures["stick_slip_fold"], report.figures["stick_slip_onset"]
    assert onset.value == pytest.approx(2.64267, rel=1e-5)
    if limit is None:
        assert fold.known
        assert fold.value == pytest.approx(FOLD, rel=2e-3)
        return
    assert (fold.value, fold.known, fold.everywhere) == (None, False, False)
    assert report.as_json()["figures"]["stick_slip_fold"]["known"] is False
    shown = "\n".join(check_lines(load_study(study), report, "study.yaml", "si", False))
    assert re.search(
        r"stick_slip_fold +not known .*with a torque limit that its cycle reaches it depends on the start", shown
    )


SOFT = {"kind": "pi", "inertia": "2900 kg*m^2", "stiffness": "100 N*m/rad", "damping": "500 N*m*s/rad"}


def test_a_limit_that_the_cycle_does_not_reach_leaves_the_fold_known():
    """The motor has 1.10 to 3.05 kN m in its cycle at the fold, by SciPy at 10.2 rad/s; with 3.2 kN m strings that are
    wound by 15 to 30 rad came to steady drilling at 10.6 rad/s as without a limit."""
    known = {}
    for limit in (None, "3.3 kN*m", "3.0 kN*m"):
        study = load_study({**STUDY, "drive": {**SOFT, "torque_limit": limit}})
        one = drilling_at(study.parameters, study.operation)
        known[limit] = one.fold_known, one.lasts_below
        low, high = one.string.motor_torques(one.cycle, one.period, one.stiffness)
        assert (low, high) == pytest.approx((1100.0, 3050.0), abs=25.0)
    assert known["3.3 kN*m"] == known[None] == (True, pytest.approx(10.30, rel=5e-3))
    assert not known["3.0 kN*m"][0]
    assert np.isnan(known["3.0 kN*m"][1])
    fold = nsdrill.check({**STUDY, "drive": {**SOFT, "torque_limit": "3.3 kN*m"}}).figures["stick_slip_fold"]
    assert fold.known
    assert fold.value == pytest.approx(10.30, rel=5e-3)


@pytest.mark.parametrize(("limit", "said"), [
    (None, None),  # 6 rad/s is above the fold, 5.57
    ("2.6 kN*m", "and may go on with it (stick_slip_fold is not known) at 6 rad/s"),
])  # fmt: skip
def test_a_sweep_that_begins_above_the_onset_of_a_limited_drive_is_told(limit, said):
    study = {**limited(limit), "sweep": {"rotary_speed": ["6 rad/s", "7 rad/s"], "procedure": "up"}}
    study["initial"] = {"bit_speed": "6 rad/s", "twist": "-5.3 rad"}
    told = [one for one in nsdrill.check(study).warnings if one.startswith("Start: the sweep begins")]
    assert (said is None) == (not told)
    assert all(said in one for one in told)


SATURATING = """
@nsdrill.drive
def cut_off(lag, drive_speed, set_speed, *, stiff=800.0, brake=1500.0, top=3000.0):
    return max(0.0, min(top, -stiff * lag - brake * (drive_speed - set_speed)))


@nsdrill.drive
def smooth(lag, drive_speed, set_speed, *, stiff=800.0, brake=1500.0, top=3000.0):
    return top * np.tanh((-stiff * lag - brake * (drive_speed - set_speed)) / top)


@nsdrill.drive
def wound_too(lag, drive_speed, set_speed, wound=0.0, *, stiff=800.0, brake=1500.0, top=3000.0):
    asked = -stiff * (lag + 0.01 * wound) - brake * (drive_speed - set_speed)
    return max(0.0, min(top, asked)), lag - wound
"""


def said_of_breaking_away(study, drive):
    told = nsdrill.check({**study, "drive": drive}).warnings
    return [one for one in told if one.startswith(("Stalls", "Not known", "At rest"))]


@pytest.mark.parametrize("model", ["torsion", "beam", "christoforou_yigit"])
@pytest.mark.parametrize("kind", ["cut_off", "smooth"])
def test_a_drive_that_saturates_is_told_to_stall_as_one_with_a_limit(script, model, kind):
    """It holds its angle, so that nothing but its torque is in the way."""
    script(SATURATING, "saturating")
    study = {**STUDY, "model": model}
    (limited,) = said_of_breaking_away(study, {**PI, "torque_limit": "2.2 kN*m"})
    (told,) = said_of_breaking_away(study, {"kind": kind, "top": 2200.0})
    takes = r"Stalls: to break the bit away takes ([\d.]+) kN m under 60 kN, and the drive has 2.2 kN m at most "
    assert re.search(takes, told)[1] == re.search(takes, limited)[1]
    assert "(at any angle behind the set point)" in told
    assert not said_of_breaking_away(study, {"kind": kind, "top": 9000.0})


def test_a_bit_at_rest_stays_there_where_a_saturating_drive_is_told_to_stall(script):
    script(SATURATING, "saturating")
    study = {**STUDY, "simulation": {"transient": "200 s", "observe": "50 s"}}
    study["initial"] = {"bit_speed": "0 rad/s", "drive_speed": "0 rad/s"}
    study["operation"] = STUDY["operation"] | {"rotary_speed": "0.5 rad/s"}  # slowly, so that the top does not swing
    for top, stuck in ((2500.0, True), (9000.0, False)):
        drive = {"kind": "cut_off", "top": top}
        data = nsdrill.run({**study, "drive": drive}, progress=False)
        assert (data.stuck_fraction.item() == 1.0) == stuck
        assert any(one.startswith("Stalls") for one in said_of_breaking_away(study, drive)) == stuck


def test_without_a_balance_nothing_of_it_is_told(script):
    """1.5 kN m are less than steady drilling takes: it had a mean torque of 0."""
    script(SATURATING, "saturating")
    found = nsdrill.check({**STUDY, "drive": {"kind": "smooth", "top": 1500.0}}).figures
    assert all(not found[name].known for name in ("balance_speed", "mean_torque", "stick_slip_onset"))
    (told,) = said_of_breaking_away(STUDY, {"kind": "wound_too"})
    assert told.startswith("Not known: whether the drive breaks the bit away under 60 kN")


INTEGRATING = """
@nsdrill.drive
def wound_clip(lag, drive_speed, set_speed, wound=0.0, *, gain=900.0, brake=1500.0, top=1500.0):
    error = drive_speed - set_speed
    return max(0.0, min(top, -gain * wound - brake * error)), error
"""


def test_a_drive_with_an_integrator_that_its_clip_holds_back_has_no_balance(script):
    """1.5 kN m are less than steady drilling takes, and the integrator winds up without end: it was told to rest
    with 0 kN m, which the drive does not have there."""
    script(INTEGRATING, "integrating")
    study = {**STUDY, "drive": {"kind": "wound_clip"}}
    (told,) = said_of_breaking_away(study, {"kind": "wound_clip"})
    assert told.startswith("Not known: at a set speed of 6 rad/s under 60 kN no balance of motor and bit is found")
    found = nsdrill.check(study).figures
    assert all(
        not found[name].known for name in ("balance_speed", "mean_torque", "stick_slip_onset", "stick_slip_fold")
    )
    found = nsdrill.check({**STUDY, "drive": {"kind": "wound_clip", "top": 9000.0}}).figures
    assert found["balance_speed"].value == pytest.approx(6.0)
    assert found["mean_torque"].value == pytest.approx(1793.97, rel=1e-4)


@pytest.mark.parametrize(("damping", "known"), [("1e-6 N*m*s/rad", False), ("100 N*m*s/rad", True)])
def test_the_fold_is_not_none_where_the_onset_has_a_number(damping, known):
    """The bit rests at this set speed, with a torque that rounds to 0, as if the rock took none."""
    drive = {"kind": "pi", "inertia": "2900 kg*m^2", "stiffness": "0 N*m/rad", "damping": damping}
    report = nsdrill.check({**STUDY, "drive": drive})
    onset, fold = (report.figures[name] for name in ("stick_slip_onset", "stick_slip_fold"))
    assert onset.value > 20.0
    assert (fold.known, fold.value is not None) == (known, known)
    free = nsdrill.check({**STUDY, "operation": {**STUDY["operation"], "wob": "0 N"}, "drive": drive})
    assert (free.figures["stick_slip_fold"].value, free.figures["stick_slip_fold"].known) == (None, True)


@pytest.mark.parametrize("damping", ["0 N*m*s/rad", "500 N*m*s/rad"])
def test_a_speed_of_the_bit_is_known_where_the_set_speed_is(damping):
    """A drive without any torque has no balance; the onset at the bit was the set speed."""
    report = nsdrill.check({**STUDY, "drive": {"kind": "pi", "stiffness": "0 N*m/rad", "damping": damping}})
    for name in ("stick_slip_onset", "stick_slip_fold"):
        one, at_bit = report.figures[name], report.figures[f"{name}_at_bit"]
        assert one.known == at_bit.known == (one.value is not None) == (at_bit.value is not None) == (damping[0] != "0")


def test_drives_of_scripts_are_linear_or_not(script):
    script(DRIVES, "drives_linear_or_not")
    kinds = ("straight", "clip", "relay", "switch", "stiffening", "clipped_state")
    assert [kind for kind in kinds if own_drive(kind).is_linear] == ["straight"]
    for kind in ("clip", "relay"):
        fold = nsdrill.check({**STUDY, "drive": {"kind": kind}}).figures["stick_slip_fold"]
        assert (fold.value, fold.known, fold.everywhere) == (None, False, False)
        assert "with a drive that is not linear it depends on the start" in fold.meaning
    fold = nsdrill.check({**STUDY, "drive": {"kind": "straight"}}).figures["stick_slip_fold"]
    assert fold.known
    assert fold.value > 2.0
    told = nsdrill.check({**STUDY, "drive": {"kind": "straight", "torque_limit": "9 kN*m"}}).figures["stick_slip_fold"]
    assert not told.known


@pytest.mark.parametrize("drive", ["2.6 kN*m", "3.6 kN*m", "relay", None])
@pytest.mark.parametrize("procedure", ["up-down", "all"])
def test_the_window_does_not_take_it_from_the_model(script, drive, procedure):
    """Nothing vibrates on the way up and down, and with a limit of 3.6 kN m from a bit at rest;
    a wound string would."""
    script(DRIVES, "drives_of_a_window")
    study = {**STUDY, "drive": {"kind": "relay"}} if drive == "relay" else limited(drive)
    speeds = ["9 rad/s", "9.2 rad/s"] if drive == "relay" else ["6 rad/s", "6.2 rad/s"]
    study["sweep"] = {"rotary_speed": speeds, "procedure": procedure}
    study["simulation"] = {"transient": "200 s", "observe": "60 s"}
    if procedure == "all":
        study["initial"] = {"bit_speed": "0 rad/s"}
    results = results_for_window(nsdrill.run(study, progress=False))
    grades, words = graded(results).grade, " ".join(warnings(find_window(results), "si"))
    assert np.any(grades == Grade.ANY_HISTORY) == (drive is None)
    sticks = procedure == "all" and drive in ("2.6 kN*m", "relay")  # from rest, which tells it
    assert ("TO WHICH SPEED STICK-SLIP LASTS is not known" in words) == (drive is not None and not sticks)
    if drive is not None:
        found = damping_of_torsion(results)
        assert found is None or found["lasts"] == []
