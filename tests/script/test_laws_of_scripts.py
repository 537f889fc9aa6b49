"""Laws of friction of scripts, and those that a study chooses, at bit, wall and stabilisers."""

import numpy as np
import pytest

import nsdrill

AGAIN = """
from nsdrill.equations.library import direction


@nsdrill.law(fall=lambda n: n.rise * n.decay)
def again(v, n):
    return direction(n.smoothing * v) * (n.rise / (1.0 + n.decay * abs(v)) + n.dynamic)
"""
SHORT = {"transient": "0 s", "observe": "1 s", "rtol": 1e-9}  # impacts amplify what is in last digits
STRING = {"well": {"inclination": "20 deg"}, "stabilizer": {"clearance": "20 mm"}, "initial": {"x": "60 mm"}}
CASES = {
    ("torsion", "bit.friction.law"): {},
    ("christoforou_yigit", "bit.friction.law"): {},
    ("christoforou_yigit", "well.friction.law"): {"initial": {"x": "70 mm"}, "operation": {"rotary_speed": "12 rad/s"}},
    ("christoforou_yigit", "stabilizer.friction.law"): STRING,
    ("beam", "bit.friction.law"): {"beam": {"modes": 2}},
    ("beam", "well.friction.law"): {"beam": {"modes": 2}, "initial": {"wall_force": "2 kN"}},
}


def run(model, key, law, more, method="explicit"):
    study = {"model": model, **more, key: law, "simulation": {**SHORT, "method": method}}
    return nsdrill.run(study, progress=False)


@pytest.mark.parametrize("method", ["explicit", "implicit"])
@pytest.mark.parametrize("case", CASES)
def test_the_law_of_nsdrill_written_again_does_the_same_at_every_contact(script, case, method):
    script(AGAIN, "again")
    own, known, other = (run(*case, law, CASES[case], method) for law in ("again", "hyperbolic", "exponential"))
    same, different = (np.abs(one.final_state - known.final_state).values for one in (own, other))
    assert np.max(different) > 1e-9  # the contact rubs: another law changes the motion
    assert np.max(same) < 1e-3 * np.max(different)


@pytest.mark.parametrize("model", ["torsion", "christoforou_yigit", "beam"])
def test_the_theory_of_the_same_law_is_the_same(script, model):
    script(AGAIN, "again")
    one, other = (nsdrill.check({"model": model, "bit.friction.law": law}).figures for law in ("again", "hyperbolic"))
    for name, found in one.items():
        wanted = other[name].value
        assert found.value == (wanted if wanted is None else pytest.approx(wanted, rel=1e-6, abs=1e-9)), name


def test_other_words_are_refused_with_those_that_there_are(script):
    with pytest.raises(nsdrill.StudyError, match="allowed: hyperbolic or exponential, or the law of a script"):
        nsdrill.load_study({"well.friction.law": "again"})
    script(AGAIN, "again")
    assert nsdrill.load_study({"well.friction.law": "again"}).parameters.well.friction.law == "again"
