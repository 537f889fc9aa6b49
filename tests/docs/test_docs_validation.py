"""The page "Validation": a part of its comparisons again, and how its studies were set. All
of it is ``python docs/validate.py``."""

import math
import shutil
import subprocess
import sys

import pytest

import nsdrill
from nsdrill.analysis.cycles import cycles_of, period_of

# single settings of every kind of case, and the ends of what two depths have
AGAIN = {
    "laboratory_rig": (),
    "well_b_1733": (57.2, 84.3),
    "well_b_2235": (),
    "well_c_2953": (120.0,),
    "well_b_2235_wall": (),
}


@pytest.mark.parametrize("study", AGAIN)
def test_the_page_has_what_comes(study, validate, docs):
    """Else: python docs/validate.py --write, and read the page again."""
    text = (docs / "validation.md").read_text(encoding="utf-8")
    found = [*validate.settings(validate.CASES[study], AGAIN[study])]
    tables = [validate.every(found)] + ([] if AGAIN[study] else [validate.summary(found)])
    for table in tables:
        for row in table.splitlines()[2:]:
            assert row in text


def test_the_page_has_what_is_tried_on_a_setting_that_fails(validate, docs):
    text = (docs / "validation.md").read_text(encoding="utf-8")
    for table in (validate.causes(), validate.summary([*validate.settings(validate.FITTED_AGAIN)])):
        for row in table.splitlines()[2:]:
            assert row in text


@pytest.mark.parametrize(("rpm", "repeats"), [(120.0, True), (76.4, False)])
def test_the_torque_of_a_string_that_rubs_has_the_period_of_its_bit(rpm, repeats, validate):
    """As a log of two samples a second; at 76.4 rpm the cycles do not repeat."""
    trace = nsdrill.simulate(
        validate.CASES["well_c_2953_wall"].path, rotary_speed=f"{rpm} rpm", duration="200 s", sample="20 ms"
    ).sel(time=slice(60.0, None))
    found = cycles_of(trace.time.values[::25], trace.surface_torque.values[::25])
    assert (found.sampled and found.regular and found.large) == repeats
    if repeats:
        assert found.period == pytest.approx(period_of(trace.time.values, trace.bit_speed.values), rel=0.03)
    else:
        assert found.period == pytest.approx(7.7, abs=0.1)  # of the page


def test_the_causes_of_the_least_torque_are_as_told(validate):
    """Damping and the single inertia raise it, and not the place of the friction: with the
    same torques at the collars of a string with waves it is below the measured one."""
    least = "least torque"
    found = {}
    for words, case in validate.CAUSES[:4]:
        (one,) = validate.settings(case, (validate.CAUSES_AT,))
        found[words], measured = one.computed[least], one.measured[least]
    lumped, undamped, ideal, waves = found.values()
    assert lumped - measured > 3e3
    assert lumped - undamped > 1.7e3
    assert abs(lumped - ideal) < 0.5e3
    assert waves < measured


@pytest.mark.parametrize("study", ["well_b_1733", "well_b_2235", "well_c_2506", "well_c_2953"])
def test_the_torques_of_a_blind_study_are_those_of_the_rule(study, validate):
    """Nothing but the recorded torques, the speed and the string is in them."""
    case = validate.CASES[study]
    friction = nsdrill.load_study(case.path).resolved["bit"]["friction"]
    for name, value in zip(("static_torque", "dynamic_torque"), validate.torques(case), strict=True):
        assert friction[name] == pytest.approx(value, abs=51)  # rounded to 0.1 kN m


def test_every_case_has_a_study_with_all_recorded_speeds(validate):
    for case in validate.CASES.values():
        speeds = sorted(rpm for name, rpm in validate.recorded() if name == case.study.removesuffix("_wall"))
        own = nsdrill.load_study(case.path).axes["rotary_speed"]
        assert [*own] == pytest.approx([rpm * math.pi / 30 for rpm in speeds], rel=1e-3)  # that of the rig in rad/s


@pytest.mark.parametrize(
    ("script", "beside"),
    [("validate.py", "validation.md"), ("verify.py", "verification.md"), ("make_pictures.py", "fit.md")],
)
def test_outside_a_checkout_the_script_says_what_it_needs(tmp_path, docs, script, beside):
    """Beside its page too, where the records are not."""
    for name in (script, beside):
        shutil.copy(docs / name, tmp_path)
        found = subprocess.run([sys.executable, tmp_path / script], capture_output=True, text=True, check=False)
        assert found.returncode == 2
        assert "there is no such file; this script needs a checkout of nsdrill" in found.stderr
        assert "Traceback" not in found.stderr


def test_the_verdict_is_that_of_the_errors(validate):
    """The rule that the page gives."""
    verdicts = {(0.05, -0.1, 0.19): "agrees", (0.05, 0.06, 0.21): "in part", (-0.19,): "in part", (0.21,): "**no**"}
    assert {errors: validate.verdict([*errors]) for errors in verdicts} == verdicts
    assert validate.verdict([math.nan]) == "**no**"
