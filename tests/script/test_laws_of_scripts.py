"""Laws of friction of scripts, and those that a study chooses, at bit, wall and stabilisers."""

import re

import numpy as np
import pytest

import nsdrill
from nsdrill.study.study import as_kept
from nsdrill.testing import check_law

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


WIDE = """
from nsdrill.equations.library import direction, expm1


@nsdrill.law(fall=lambda n: n.rise / n.width)
def wide(v, n, *, width=number({}, "m/s", "slip over which it falls", low=1e-3)):
    return direction(n.smoothing * v) * (n.dynamic + n.rise * (1.0 + expm1(-abs(v) / width)))
"""


OWN = [
    ("torsion", "bit.friction.law"),
    ("beam", "well.friction.law"),
    ("christoforou_yigit", "stabilizer.friction.law"),
]


def test_a_law_has_numbers_of_its_own_at_every_contact(script):
    """The exponential law by its width, 1 / decay; the key is an axis."""
    script(WIDE.format(0.5), "wide")
    for model, key in OWN:
        more = CASES[model, key]
        given = {f"{key.removesuffix('.law')}.width": f"0.25 {'rad/s' if key.startswith('bit') else 'm/s'}"}
        if model == "torsion":
            axis = {"sweep": {"bit.friction.width": ["0.2 rad/s", "0.25 rad/s"]}}
            assert run(model, key, "wide", {**more, **axis}).bit_friction_width.values.tolist() == [0.2, 0.25]
        decay = {f"{key.removesuffix('.law')}.decay": f"4 {'s/rad' if key.startswith('bit') else 's/m'}"}
        own, known = run(model, key, "wide", more | given), run(model, key, "exponential", more | decay)
        assert np.max(np.abs(own.final_state - known.final_state)) < 1e-6, (model, key)
    assert nsdrill.load_study({"well.friction.law": "wide"}).parameters.well.friction.width == 0.5
    other = nsdrill.load_study({"well.friction.law": "exponential"})
    assert "width" not in as_kept(other.resolved, other.model)["well"]["friction"]
    assert not check_law("wide").failed
    assert nsdrill.friction("a", slip=1.0, normal=1.0, law="wide", static=1.0, smoothing=1e9, width=9.0) > 0.5


def test_two_laws_share_a_key_each_with_its_own_default(script):
    script(WIDE.format(0.5) + WIDE.format(0.7).replace("def wide", "def wider"), "both")
    widths = [nsdrill.load_study({"bit.friction.law": law}).parameters.bit.friction.width for law in ("wide", "wider")]
    assert widths == [0.5, 0.7]


COULOMB = "@nsdrill.law(fall=lambda n: 0.0)\ndef coulomb(v, n):\n    return n.dynamic * direction(n.smoothing * v)\n"
IDLE = {
    ("torsion", "bit.friction", "wide", "decay"): "2 s/rad",
    ("beam", "bit.friction", "wide", "decay"): "2 s/rad",
    ("beam", "well.friction", "wide", "decay"): "2 s/m",
    ("christoforou_yigit", "bit.friction", "wide", "decay"): "2 s/rad",
    ("christoforou_yigit", "well.friction", "wide", "decay"): "2 s/m",
    ("christoforou_yigit", "well.friction", "hyperbolic", "width"): "1 m/s",
    ("torsion", "bit.friction", "coulomb", "static"): 0.6,
}


@pytest.mark.parametrize("case", IDLE)
def test_a_key_that_a_law_does_not_read_is_refused(script, case):
    script(WIDE.format(0.5) + COULOMB, "wide")
    model, contact, law, key = case
    with pytest.raises(nsdrill.StudyError, match=f"{contact}.{key}: found .*, which the law {law} does not read"):
        nsdrill.load_study({"model": model, f"{contact}.law": law, f"{contact}.{key}": IDLE[case]})
    # above the default of the static one, which this law does not read
    assert nsdrill.load_study({"bit.friction.law": "coulomb", "bit.friction.dynamic": 0.6})


def test_coefficients_are_in_order_with_each_word_of_a_sweep(script):
    script(WIDE.format(0.5) + COULOMB, "coulomb")
    swept = {"bit.friction.law": "coulomb", "bit.friction.static": 0.2, "bit.friction.dynamic": 0.5}
    told = "bit.friction.dynamic: found .*at most bit.friction.static.*, with bit.friction.law hyperbolic"
    for words in (["coulomb", "hyperbolic"], ["hyperbolic"]):
        with pytest.raises(nsdrill.StudyError, match=told) as raised:
            nsdrill.load_study(swept | {"sweep": {"bit.friction.law": words}})
        assert len(raised.value.faults) == 1


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"law": "wide", "decay": 2.0}, "found decay, which the law wide does not read; allowed: .*width"),
        ({"law": "hyperbolic", "width": 2.0}, "found width, which the law hyperbolic does not read"),
        ({"law": "coulomb", "dynamic": 0.3}, "the law coulomb has one coefficient at all slips"),
    ],
)
def test_a_contact_of_a_script_is_given_what_its_law_reads(script, given, said):
    script(WIDE.format(0.5) + COULOMB, "wide")
    with pytest.raises(nsdrill.InputError, match=said):
        nsdrill.friction("belt", slip=1.0, normal=1.0, static=0.5, smoothing=1e3, **given)


FAULTY = {
    "(v, n, *, decay=1.0):\n    return n.dynamic * direction(n.smoothing * v)": "found the name decay",
    "(v, n, *, idle=1.0):\n    return n.dynamic * direction(n.smoothing * v)": "found the number idle, which the coeff",
    "(v, n, *, c=number(1.0, 'kg')):\n    return n.dynamic * direction(c * n.smoothing * v)": "found c in kg",
    "(v, n, *, drag=1.0):\n    return n.dynamic * direction(n.smoothing * v) + drag * v": "is not twice as large",
    "(v, n, *, drag=0.0):\n    return n.dynamic * direction(n.smoothing * v) + drag * v": "where drag is 0.1",
    "(v, n, *, w=0.0):\n    return n.dynamic * direction(n.smoothing * v) / (1.0 + abs(v) / w)": "no number at the",
}  # fmt: skip


@pytest.mark.parametrize("text", FAULTY)
def test_numbers_that_a_law_cannot_have_are_refused_with_its_line(script, text):
    head = "from nsdrill.equations.library import direction\n\n\n@nsdrill.law(fall=lambda n: 0.0)\ndef faulty"
    with pytest.raises(nsdrill.InputError, match=FAULTY[text]) as raised:
        script(head + text, "faulty")
    assert "faulty.py, line" in str(raised.value)


def test_a_law_whose_fall_leaves_out_a_jump_is_refused(script):
    text = STEP.replace("350.0 * n.rise", "0.1 * n.rise", 1)
    with pytest.raises(nsdrill.InputError, match=r"found a fall of .*A law that jumps bends instead, .*np.tanh"):
        script(text, "too_little")
    with pytest.raises(nsdrill.InputError, match=r"step: found no fall; allowed: @nsdrill.law\(fall="):
        script(text.replace("(fall=lambda n: 0.1 * n.rise)", "", 1), "no_fall")


def test_other_words_are_refused_with_those_that_there_are(script):
    with pytest.raises(nsdrill.StudyError, match="allowed: hyperbolic or exponential, or the law of an installed"):
        nsdrill.load_study({"well.friction.law": "again"})
    script(AGAIN, "again")
    assert nsdrill.load_study({"well.friction.law": "again"}).parameters.well.friction.law == "again"


TWICE = """
import numpy as np
import nsdrill
from nsdrill.equations.library import direction


@nsdrill.law(fall=lambda n: n.rise * (n.decay + 1.0))
def twice(v, n):
    falls = 1.0 / (1.0 + n.decay * abs(v)) + 1.0 - np.tanh(abs(v) - 10.0)
    return direction(n.smoothing * v) * (n.dynamic + n.rise * falls)
"""


@pytest.mark.parametrize("model", ["torsion", "christoforou_yigit", "beam"])
def test_steady_drilling_that_is_unstable_in_two_ranges_is_told(script, model):
    """The torque of the bit, 2/3 r W f, falls more steeply than torsion withstands (`slope_held`, of
    one mode its damping) up to a speed, and again about 10 rad/s."""
    script(TWICE, "twice")
    study = {"model": model, "bit.friction": {"law": "twice", "static": 0.3, "dynamic": 0.25}, "operation.wob": "60 kN"}
    study |= {} if model == "torsion" else {"bit.cutting.zeta": 0}  # whose torque has no part in the fall
    report = nsdrill.check(study)
    (told,) = [text for text in report.warnings if text.startswith("Unstable in several ranges: at 60 kN")]
    first, low, high = (float(one) for one in re.findall(r"(?:up to|and|to) ([\d.]+) rad/s", told))
    v = np.linspace(0.01, 20.0, 200_001)
    law = nsdrill.load_study(study).parameters.bit.friction
    falls = 1.0 / (1.0 + law.decay * v) + 1.0 - np.tanh(v - 10.0)
    fall = -np.gradient(2 / np.pi * np.arctan(law.smoothing * v) * (0.25 + 0.05 * falls), v)
    assert first < low < 10.0 < high
    # at each end the fall is that which is withstood
    falls = np.interp([first, low, high], v, fall)
    np.testing.assert_allclose(falls, falls.mean(), rtol=5e-3)
    assert report.figures["stick_slip_onset"].value == pytest.approx(high, rel=1e-3)
    assert "below which" not in report.figures["stick_slip_onset"].meaning


@pytest.mark.parametrize("model", ["torsion", "christoforou_yigit", "beam"])
def test_a_fall_between_the_speeds_that_are_tried_is_told(script, model):
    """One of 5 % within 0.01 rad/s, of which the slopes at the speeds that are tried show nothing; within 0.5 rad/s
    it is found."""
    study = {"model": model, "bit.friction": {"law": "twice", "static": 0.3, "dynamic": 0.25}, "operation.wob": "60 kN"}
    for width, is_told in ((0.01, True), (0.5, False)):
        text = TWICE.replace("n.decay + 1.0", f"n.decay + {1.0 / width}")
        script(text.replace("abs(v) - 10.0)", f"(abs(v) - 17.3) / {width})"), "twice")
        told = [text for text in nsdrill.check(study).warnings if text.startswith("Narrow:")]
        assert ["stick_slip_onset may be wrong" in text for text in told] == [True] * is_told
        if is_told:
            low, high = map(float, re.search(r"between ([\d.]+) rad/s and ([\d.]+) rad/s", told[0]).groups())
            assert low < 17.3 < high
    assert not any(text.startswith("Unstable in") for text in nsdrill.check({"model": model}).warnings)


STEP = """
from nsdrill.equations.library import direction


@nsdrill.law(fall=lambda n: 350.0 * n.rise)
def step(v, n, *, vs=nsdrill.number(0.4, "m/s", low=1e-3)):
    return direction(n.smoothing * v) * (n.dynamic + (n.rise if abs(v) < vs else 0.0))


@nsdrill.law(fall=lambda n: 350.0 * n.rise)
def ramp(v, n, *, vs=nsdrill.number(0.4, "m/s", low=1e-3)):
    return direction(n.smoothing * v) * (n.dynamic + n.rise * max(0.0, 1.0 - abs(v) / vs))
"""


@pytest.mark.parametrize("model", ["torsion", "christoforou_yigit"])
def test_the_exponent_of_a_law_that_jumps_is_refused_with_its_line(script, model):
    script(STEP, "steps")
    short = {"transient": "5 s", "observe": "10 s"}
    study = {"model": model, "record": {"exponent": True}, "simulation": short}
    for ask in (nsdrill.check, lambda study: nsdrill.run(study, progress=False)):
        with pytest.raises(nsdrill.InputError, match=r"record.exponent: found true with .*steps.py, line \d+\)"):
            ask({**study, "bit": {"friction": {"law": "step"}}})
    data = nsdrill.run({**study, "bit": {"friction": {"law": "ramp"}}}, progress=False)
    assert np.isfinite(data.lyapunov_exponent.item())


def test_a_bound_that_forgets_a_number_of_the_law_is_found(script):
    """At its default it holds; at a tenth of it the law falls ten times as steeply."""
    script(WIDE.format(0.5).replace("n.rise / n.width", "n.rise / 0.3").replace("wide", "forgetful"), "forgetful")
    with pytest.raises(AssertionError, match="FAIL  fall above its bound"):
        check_law("forgetful")
