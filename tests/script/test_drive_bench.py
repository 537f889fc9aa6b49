"""What the check of a drive compares: the drives of nsdrill pass it in every model, and wrong
ones, of scripts or planted, do not."""

import pytest

from nsdrill.errors import InputError
from nsdrill.models import top
from nsdrill.models.drive_laws import LAWS
from nsdrill.models.steady import String
from nsdrill.testing import Report, check_drive
from nsdrill.testing.bench import Bench, bench_of

KINDS = {
    **dict.fromkeys((*LAWS, "lqr", "dc_motor"), ""),
    "pi": "drive: {twist_gain: 50 N*m/rad, speed_gain: 30 N*m*s/rad}",
}
MODELS = {
    "torsion": "",
    "christoforou_yigit": "modes: {axial: frozen, lateral: frozen}",
    "beam": "beam: {modes: 2, stations: [{at: 0.3}]}",
    "segments": "segments: {pipe: 2, collar: 2}",
    "regenerative": "",
}


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("kind", KINDS)
def test_each_derivation_of_a_drive_is_checked_against_another(model, kind):
    check_drive(kind, f"{MODELS[model]}\n{KINDS[kind]}", model=model)


OTHERS = {
    "pi": "drive: {twist_gain: 50 N*m/rad, shaft_damping: 20 N*m*s/rad}",
    "dc_motor": "drive: {gains: [0.0272, 22.2, 1.138, -13.03, 15.6]}",  # of the page on drives
}


@pytest.mark.parametrize("model", ["torsion", "regenerative"])
@pytest.mark.parametrize("kind", ["pi", "dc_motor"])
def test_with_damping_of_the_shaft_and_a_voltage_that_follows_the_motion(model, kind):
    check_drive(kind, OTHERS[kind], model=model)


@pytest.mark.filterwarnings("error::nsdrill.RunWarning")
@pytest.mark.parametrize(("kind", "model"), [("z_torque", "regenerative"), ("lqr", "segments")])
def test_a_check_warns_of_nothing_that_it_provokes(kind, model):
    """Its runs are too short for a drive that starts far from its speed."""
    check_drive(kind, MODELS[model], model=model)


def test_a_run_of_a_check_that_fails_is_in_the_report():
    """Comparisons with what is no number hold nothing."""
    report = Report("a run")
    bench_of(Bench, "torsion", "simulation: {max_steps: 1000}", 1, 8).run(100.0, report, rtol=1e-12)
    assert report.failed == ["a run of 100 s to its end"]
    assert "step_limit" in str(report)


UNWINDING = "{arguments}:\n    return -gain * wound - brake * (drive_speed - set_speed), {rate}\n"
STATE = "(drive_speed, set_speed, wound=0.0, *, gain=900.0, brake=1500.0, slow=50.0)"
SCALED = "(drive_speed, set_speed, wound=number(0.0, scale=1e5), *, gain=900.0, brake=1500.0, slow=50.0)"
NOTHING_STEADY = "slopes in steady drilling"
GROWTH = {"growth where the bit turns [1/s]", "growth where the bit is held [1/s]"}
WRONG = {  # what follows the name of the function, and what fails
    "brake that drives": (
        "(lag, drive_speed, set_speed, *, k=900.0, brake=1500.0):\n"
        "    return -k * lag + brake * (drive_speed - set_speed)\n",
        {"backwards at rest", *GROWTH},
    ),
    "lag that slows": (
        "(lag, drive_speed, set_speed, *, k=900.0, brake=1500.0):\n"
        "    return k * lag - brake * (drive_speed - set_speed)\n",
        {"backwards at rest", *GROWTH},
    ),
    "bit that drives": (
        "(lag, drive_speed, bit_speed, set_speed, *, k=900.0, brake=1500.0, more=2500.0):\n"
        "    return -k * lag - brake * (drive_speed - set_speed) + more * (bit_speed - set_speed)\n",
        {"backwards at rest", "growth where the bit turns [1/s]"},
    ),
    "integral of no error": (
        "(drive_speed, set_speed, wound=0.0, *, gain=900.0, brake=1500.0):\n"
        "    return -gain * wound - brake * (drive_speed - set_speed), drive_speed\n",
        {NOTHING_STEADY},
    ),
    "weak": (
        "(lag, drive_speed, set_speed, *, most=300.0):\n"
        "    return -most * np.tanh(10.0 * (drive_speed - set_speed) + lag)\n",
        {NOTHING_STEADY},
    ),
    "relay": (
        "(drive_speed, set_speed, *, most=6000.0):\n    return most if drive_speed < set_speed else 0.0\n",
        {NOTHING_STEADY},
    ),
    "kink in the torque": (
        "(lag, drive_speed, set_speed, *, k=900.0, brake=1500.0):\n"
        "    off = drive_speed - set_speed\n    return -k * lag - (brake if off > 0.0 else 0.5 * brake) * off\n",
        {"gains against differences", "small deviations against differences"},
    ),
    "kink in a rate": (
        UNWINDING.format(
            arguments=STATE, rate="(drive_speed - set_speed) * (slow if drive_speed > set_speed else 1.0)"
        ),
        {"rate of drive_wound against differences", "small deviations against differences"},
    ),
    "coarse": (
        UNWINDING.format(arguments=SCALED, rate="drive_speed - set_speed - wound / slow"),
        {"scale of drive_wound over its swing"},
    ),
}


@pytest.mark.parametrize("fault", WRONG)
def test_a_wrong_drive_of_a_script_is_found(script, fault):
    text, wanted = WRONG[fault]
    script(f"@nsdrill.drive\ndef wrong{text}", "wrong_drive")
    assert failed("wrong") == wanted


def failed(kind: str, study: str = "") -> set[str]:
    """The names of the checks that fail."""
    with pytest.raises(AssertionError) as raised:
        check_drive(kind, study)
    return {line[8:48].strip() for line in str(raised.value).splitlines() if line.startswith("  FAIL")}


def test_a_wrong_drive_of_nsdrill_is_found(monkeypatch):
    """One fault at a time in what is derived of it."""
    with monkeypatch.context() as patch:
        told = top.quantities_of_drive
        patch.setattr(
            top,
            "quantities_of_drive",
            lambda drive, m, t, r, law, most, **more: told(drive, m, t, r, half(law), most, **more),
        )
        assert failed("stiff") == {"drive_damping of check"}
    with monkeypatch.context() as patch:
        columns = top.columns_of_law
        patch.setattr(top, "columns_of_law", lambda law, limit: columns(law, limit) | {"torque_least": -1e30})
        assert failed("stiff") == {"torque with a limit"}
    with monkeypatch.context() as patch:
        patch.setitem(LAWS, "soft_torque", LAWS["soft_torque"]._replace(gains=lambda drive, seen: untuned(drive, seen)))
        assert failed("soft_torque") == {"numbers that nothing reads"}
    with monkeypatch.context() as patch:
        patch.setattr(String, "fall", lambda self, speed, set_speed=None: -String._of_bit(self, "torque", speed, speed))
        assert failed("pi") == {"small deviations against differences"}
    with monkeypatch.context() as patch:
        patch.setattr(String, "holds", False)  # the lag is then left out
        assert "whether it holds its angle" in failed("stiff")


def half(law):
    return law._replace(damping=0.5 * law.damping)


def untuned(drive, seen):
    return LAWS["stiff"].gains(drive, seen)


def test_a_number_that_is_changed_after_the_drive_was_compiled_is_the_one_that_is_checked(script):
    text = "(lag, drive_speed, set_speed, *, k=900.0):\n    return -k * lag - BRAKE * (drive_speed - set_speed)\n"
    made = script(f"BRAKE = 1500.0\n\n\n@nsdrill.drive\ndef changed{text}", "changed_drive")
    check_drive("changed")
    made.BRAKE = 1600.0
    check_drive("changed")  # machine code and graph have one value


def test_what_cannot_be_checked_is_refused():
    with pytest.raises(InputError, match="found ideal, which turns at the set speed; allowed: any other kind"):
        check_drive("ideal")
    with pytest.raises(InputError, match="found the model duffing; allowed: christoforou_yigit, beam, segments"):
        check_drive("stiff", model="duffing")
    with pytest.raises(InputError, match=r"drive.kind: found 'nothing' .*; allowed: ideal, stiff"):
        check_drive("nothing")
