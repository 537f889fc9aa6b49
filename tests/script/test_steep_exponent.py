"""The exponent of an oscillator with friction steeper than its steps see."""

import numpy as np
import pytest

import nsdrill
from nsdrill.web.session import Session

# A mass on a spring under a force, which dry friction brakes and never holds: the slip
# changes its sign at once, where a deviation of the speed is multiplied by the quotient of
# the accelerations after and before.
CROSSING = """@nsdrill.model
def steep(t, x=0.1, v=0.0, *, smoothing=1e5):
    rub = nsdrill.friction("floor", slip=v, normal=0.1, static=1.0, smoothing=smoothing)
    return v, np.cos(1.3 * t) - x - 0.02 * v - rub


@nsdrill.model
def by_hand(t, x=0.1, v=0.0, *, smoothing=1e5):
    return v, np.cos(1.3 * t) - x - 0.02 * v - 0.1 * np.tanh(smoothing * v)
"""
# Of the two multiplied quantities, with LSODA between the zeros of v (rtol 1e-11), over the
# same time and by the same weights; without the quotients it is -0.02 / 2.
TRUE = -0.02717


def run(model, **given):
    return nsdrill.run(model.study(transient=200, observe=400, exponent=True, **given), progress=False)


@pytest.mark.parametrize(("name", "smoothing"), [("steep", 1e5), ("steep", 1e7), ("by_hand", 1e7)])
def test_an_explicit_step_resolves_a_slope_between_its_stages(script, name, smoothing):
    module = script(CROSSING, f"{name}_{smoothing:.0f}")
    found = run(getattr(module, name), smoothing=smoothing, method="explicit")
    assert found.lyapunov_exponent.item() == pytest.approx(TRUE, abs=3e-4)


@pytest.mark.parametrize(("smoothing", "off"), [(1e3, 1e-4), (1e5, 3e-4), (1e6, 6e-4), (1e7, 6e-4)])
def test_so_do_the_stages_of_an_implicit_step(script, smoothing, off):
    module = script(CROSSING, f"implicit_{smoothing:.0f}")
    found = run(module.steep, smoothing=smoothing, method="implicit")
    assert found.lyapunov_exponent.item() == pytest.approx(TRUE, abs=off)


# Friction of 0.05 is some 2 % of the force where the slip changes its sign. The same references,
# and that of an oscillator with a spring beyond 0.8 that integrates both equations.
SMALL = """@nsdrill.model
def small(t, x=0.1, v=0.0, *, mu=0.05, stiff=0.0):
    closed = nsdrill.touching("wall", x - 0.8)
    return v, np.cos(1.3 * t) - x - 0.02 * v - mu * np.tanh(1e5 * v) - stiff * closed


@nsdrill.model
def free(t, x=0.1, v=0.0, *, mu=0.05):
    return v, np.cos(1.3 * t) - x - 0.02 * v - mu * np.tanh(1e5 * v)
"""


@pytest.mark.parametrize(("mu", "true"), [(0.001, -0.010169), (0.01, -0.011692), (0.05, -0.018497)])
def test_friction_that_is_small_beside_the_force_is_seen(script, mu, true):
    found = run(script(SMALL, f"small_{1000 * mu:.0f}").free, mu=mu)
    assert found.lyapunov_exponent.item() == pytest.approx(true, rel=0.005)


@pytest.mark.parametrize(("mu", "true"), [(0.02, -0.012348), (0.1, -0.021957)])
def test_a_slope_beside_a_contact_is_seen(script, mu, true):
    found = run(script(SMALL, f"beside_{1000 * mu:.0f}").small, mu=mu, stiff=1.0)
    assert found.lyapunov_exponent.item() == pytest.approx(true, rel=0.005)


def test_the_motion_is_that_without_the_exponent(script):
    model, given = script(CROSSING, "same_motion").by_hand, {"smoothing": 1e7, "transient": 20, "observe": 40}
    with_one, without = (
        nsdrill.run(model.study(exponent=one, **given), progress=False).final_state for one in (True, False)
    )
    assert np.array_equal(with_one, without)


BESIDE = """@nsdrill.model
def rubbed(t, x=0.1, v=0.0, *, smoothing=1e6):
    rub = nsdrill.friction("floor", slip=v, normal=0.1, static=1.0, smoothing=smoothing)
    return v, np.cos(1.3 * t) - x - 0.02 * v - rub - nsdrill.touching("wall", x - 0.8)
"""
SHORT = {"transient": 5, "observe": 10, "exponent": True}


def told(study):
    return [one for one in nsdrill.check(study).warnings if one.startswith("Exponent:")]


def test_implicit_steps_that_pass_the_slope_beside_a_contact_are_told_of(script):
    model = script(BESIDE, "told_of").rubbed
    (warning,) = told(model.study(exponent=True))
    assert "friction of floor" in warning
    assert "simulation.method: explicit" in warning
    assert not told(model.study())
    assert not told(model.study(exponent=True, method="explicit"))
    assert not told(model.study(exponent=True, rtol=1e-11))


def test_what_is_run_and_shown_of_such_runs_says_so(script):
    model = script(BESIDE, "shown_of").rubbed
    with pytest.warns(nsdrill.RunWarning, match="may be wrong: friction of floor"):
        found = nsdrill.run(model.study(**SHORT), progress=False)
    assert "EXPONENTS MAY BE WRONG" in nsdrill.show(found)
    assert "EXPONENTS" not in nsdrill.show(nsdrill.run(model.study(smoothing=10.0, **SHORT), progress=False))


def test_so_does_everything_of_a_string_of_segments_with_steep_torques(tmp_path):
    study = {
        "model": "segments",
        "bit": {"friction": {"static_torque": "6 kN m", "dynamic_torque": "4 kN m", "smoothing": "2000 s/rad"}},
        "simulation": {"transient": "2 s", "observe": "2 s", "method": "implicit"},
        "record": {"exponent": True},
        "sweep": {"rotary_speed": ["8 rad/s", "9 rad/s"], "procedure": "same"},
    }
    assert len(told(nsdrill.load_study(study))) == 1
    with pytest.warns(nsdrill.RunWarning, match="breaks loose"):
        found = nsdrill.run(study, tmp_path / "out.h5", progress=False)
    assert "EXPONENTS MAY BE WRONG" in nsdrill.show(found)
    window = nsdrill.window(tmp_path / "out.h5")
    assert "breaks loose" in window["inexact_exponents"]
    assert any(one.startswith("EXPONENTS MAY BE WRONG: where the bit breaks") for one in window["answer"]["warnings"])
    nsdrill.report(tmp_path / "out.h5", path=tmp_path / "out.html")
    assert "EXPONENTS MAY BE WRONG" in (tmp_path / "out.html").read_text(encoding="utf-8")
    drawn = nsdrill.plot(tmp_path / "out.h5", "value").legends[0].get_texts()
    assert any("EXPONENTS MAY BE WRONG" in one.get_text() for one in drawn)
    assert "breaks loose" in Session(tmp_path / "out.h5").meta()["edited"]
