"""Responses, orders and unknown numbers of a script: they reach labels, thresholds,
severities and answers, also of a file that is read back."""

import json
import re

import numpy as np
import pytest

import nsdrill
from nsdrill.errors import InputError, StudyError
from nsdrill.models.registry import described, scripted
from script.conftest import HEAD, command

# A damped swing under a force with an offset: at the static deflection it leans, and at
# resonance, omega = 1, it is fast.
BODY = """def {name}(t, x=0.1, v=0.0, *, damping=0.2, force=0.1, omega=1.0, offset=0.0, low=0.1, high=0.3):
    return {{"x": v, "v": force * np.cos(omega * t) + offset + 0.0 * (low + high) - damping * v - x}}
"""
SWING = (
    '@nsdrill.model(responses={{"fast": ("v_max", 0.3), "leaning": ("x_mean", 0.2)}}, orders=("low <= high",))\n'
    + BODY
    + """
@{name}.feature("power", "W", mean=True)
def power(v, damping):
    return damping * v * v

{name}.response("hot", "power_mean", "20 mW", limits={{"mild": 0.02, "hard": "0.05 W"}}, words="hot bearing",
    letter="Q", colour="#AA3377", marker="X")
"""
)
QUICK = {"transient": 120.0, "observe": 40 * np.pi, "rtol": 1e-8}  # 20 revolutions


def made(script, name, text=SWING):
    return getattr(script(text.format(name=name), name), name)


def test_labels_severities_and_words_follow(script):
    """The steady swing of amplitude force/damping at omega = 1 (its speed has the same) takes
    damping v^2 / 2 on average: 0.5 m/s and 25 mW at the defaults of force and damping."""
    swing = made(script, "swinging")
    data = nsdrill.run(swing.study(force=[0.01, 0.1, 0.16], **QUICK), progress=False)
    assert data.power_mean.values.ravel() == pytest.approx([2.5e-4, 0.025, 0.064], rel=1e-3)
    assert data.response.attrs["flag_meanings"] == "fast leaning hot"
    assert data.response.values.ravel().tolist() == [0, 16 + 64, 16 + 64]
    assert data.hot_severity.values.ravel().tolist() == [0, 1, 2]
    critical = described("swinging").critical["hot"]
    assert (critical.words, critical.letter, critical.colour, critical.marker) == ("hot bearing", "Q", "#AA3377", "X")
    moved = nsdrill.run(swing.study(force=[0.1], power_mean=0.03, mild=0.02, **QUICK), progress=False)
    assert moved.response.values.ravel().tolist() == [16]


def test_orders_hold_in_studies_and_samples(script):
    swing = made(script, "ordered")
    with pytest.raises(
        StudyError, match=r"parameters\.high: .*0\.05; allowed: at least parameters\.low, which is 0\.1"
    ):
        swing.study(high=0.05)
    study = swing.study(uncertain={"low": (0.1, 0.5), "high": (0.2, 0.6), "damping": [0.1, 0.2], "samples": 16})
    assert any("against the order" in note for note in study.notes)
    assert study.resolved["uncertain"]["parameters.damping"] == {"values": [0.1, 0.2]}


def test_unknown_numbers_of_a_study(script):
    swing = made(script, "unknown")
    wanted = {
        "damping": {"normal": {"mean": 0.2, "deviation": 0.01}},
        "force": {"lognormal": {"median": 0.1, "factor": 1.5}},
        "offset": {"triangular": [0.0, 0.05, 0.1]},
        "correlations": [("damping", "force", 0.5)],
        "samples": 8,
    }
    data = nsdrill.run(swing.study(omega=[0.8, 1.0], uncertain=wanted, transient=5, observe=10), progress=False)
    assert data.sizes["sample"] == 8
    told = json.loads(json.dumps(swing.study(uncertain=wanted).resolved["uncertain"]))
    assert told["correlations"] == [["parameters.damping", "parameters.force", 0.5]]
    table = swing.study(uncertain={"table": {"damping": [0.1, 0.2, 0.3]}}).resolved["uncertain"]["table"]
    assert table == {"parameters.damping": [0.1, 0.2, 0.3]}
    with pytest.raises(InputError, match=r"uncertain: found damping=3; allowed: \(low, high\)"):
        swing.study(uncertain={"damping": 3})
    with pytest.raises(InputError, match=r"unknown\.study: found dampin, .*Did you mean damping"):
        swing.study(uncertain={"dampin": (0, 1)})


def test_a_file_is_answered_from_with_its_script(tmp_path):
    """As a command reads it: the window by severity, JSON, and thresholds moved afterwards."""
    (tmp_path / "kept.py").write_text(HEAD + SWING.format(name="kept"))
    (tmp_path / "study.yaml").write_text(
        "model: kept\nsweep: {parameters.force: [0.01, 0.1, 0.16]}\nsimulation: {transient: 60 s, observe: 40 s}\n"
        "classify: {fast: {v_max: 2}}\n"
    )
    command(tmp_path, "run", "study.yaml", "-o", "out.h5", "--with", "kept.py")
    _, refused = command(tmp_path, "window", "out.h5", code=2)
    assert "made with the model kept of the script kept.py" in refused
    for most, safe in ((0, 1), (1, 2), (2, 3)):
        found, _ = command(tmp_path, "window", "out.h5", "--severity", most, "--json", "--with", "kept.py")
        assert json.loads(found)["safe"] == safe
    shown, _ = command(tmp_path, "show", "out.h5", "--json", "--with", "kept.py")
    assert json.loads(shown)["responses"]["same"] == {"none": 1, "hot": 2}
    moved = ("--set", "classify.hot.power_mean=60 mW", "--with", "kept.py")
    assert "response: 1 of 3 points changed" in "".join(command(tmp_path, "classify", "out.h5", "-o", "o.h5", *moved))
    text = command(tmp_path, "window", "o.h5", "--with", "kept.py")[0].replace("\n", " ")
    assert "HOT BEARING COUNTS ABOVE 0.06 W ONLY" in text
    told, _ = command(tmp_path, "window", "o.h5", "--json", "--with", "kept.py")
    assert json.loads(told)["obstacles"]["hot"] == 1


@pytest.mark.parametrize("how", [{"procedure": "same"}, {"procedure": "up-down"}])
def test_its_sheet_speaks_of_no_string_and_nothing_is_brought_up(script, tmp_path, how):
    swing = made(script, f"sheet_{how['procedure'][:2]}")
    data = nsdrill.run(swing.study(force=[0.01, 0.02, 0.03, 0.16], **how, **QUICK), progress=False)
    nsdrill.save(data, tmp_path / "out.h5")
    nsdrill.report(tmp_path / "out.h5", tmp_path / "page.html", one_page=True)
    written = (tmp_path / "page.html").read_text().replace("nsdrill", "")
    page = re.sub(r"<style>.*?</style>|<svg.*?</svg>|src=.[^>]*", "", written, flags=re.DOTALL)
    of_a_rig = r"stick-slip|[Dd]rill|\bbit\b|collar|wall|eccentric|off bottom|pick up|[Bb](rought|ring) up|weight"
    assert re.findall(of_a_rig, page) == []
    assert "Do not exceed force 0.03: at 0.16 it shows" in page
    assert "ordered, force" in page
    assert not {"<b>Well</b>", "<b>Rig</b>"} & set(re.findall("<b>[A-Z][a-z ]+</b>", page))


def test_another_threshold_or_other_words_are_another_model(script):
    """Labels have bits in the order of the responses, which their digest has, and say what
    their words say."""
    first = made(script, "first_order")
    before = scripted("first_order").digest
    first.response("hot", "power_mean", 0.02, words="warm", limits={"mild": 0.02, "hard": 0.05})
    digest = scripted("first_order").digest
    assert digest != before, "a file made with other words is of other code"
    with pytest.raises(InputError, match="a second response fast"):
        first.response("fast", "v_max", 0.4)
    assert scripted("first_order").digest == digest, "what is refused leaves the model as it is"
    first = made(script, "first_order", SWING.replace('("v_max", 0.3)', '("v_max", 0.4)'))
    assert scripted("first_order").digest != digest
    assert [one.bit for one in described("first_order").critical.values()] == [16, 32, 64], "each in its place"
    assert described("first_order").thresholds().fast.v_max == 0.4


DECLARED = (
    "@nsdrill.model({})\ndef m(x=0.1, v=0.0, *, k=1.0, c=nsdrill.number(0.1, 'kg')):\n    return v, -k * x - c * v\n"
)
REFUSED = {
    "feature": ("responses={'high': ('x_maxx', 1)}", "high of x_maxx, which is no feature of it; .*Did you mean x_max"),
    "pair": ("responses={'high': 1}", r"the response 'high': 1; allowed: responses=\{'sticking'"),
    "mapping": ("responses=['high']", "responses=.'high'.; allowed: responses="),
    "name": ("responses={'too high': ('x_max', 1)}", "the response 'too high'"),
    "taken": ("responses={'safe': ('x_max', 1)}", "the name 'safe'; allowed: another word than none, .*stick_slip"),
    "code": ("responses={'not_judged': ('x_max', 1)}", "the name 'not_judged'; allowed: another word than"),
    "state": ("responses={'x': ('x_max', 1)}", "the name x of a response, which a state"),
    "parameter": ("responses={'k': ('x_max', 1)}", "the name k of a response, which a state, a parameter"),
    "nan": ("responses={'high': ('x_max', float('nan'))}", "x_max above nan; allowed: a number from"),
    "unit": ("responses={'high': ('x_max', '3 m')}", "x_max above '3 m'; allowed: a number from"),
    "many": ("responses={'r%d' % i: ('x_max', i) for i in range(7)}", "at most 6"),
    "order": ("orders=('k > 1',)", "the order 'k > 1'; allowed: two parameters"),
    "text": ("orders='k < c'", "orders='k < c'; allowed: a tuple of texts"),
    "unknown": ("orders=('k < q',)", "the order 'k < q' of q, which is no parameter; allowed: k, c"),
    "units": ("orders=('c < k',)", "the order 'c < k' of kg and no unit; allowed: two parameters with the same unit"),
    "self": ("orders=('k <= k',)", "of k with itself"),
    "limits": ("", "the limits .* of high; allowed: up to four words, none of them none, with bounds that ascend"),
    "band": ("", "the limits .*'none'.* of high; allowed: up to four words, none of them none"),
    "colour": ("", "colour='red'; allowed: six hexadecimal digits"),
    "marker": ("", "marker='o'; allowed: one of"),
    "severity": ("", "high above 1, whose mildest limit is 2, so that what is between them has no severity"),
    "always": ("", "high with v_max above -0.1, as every motion has; allowed: a threshold of 0 or more"),
    "again": ("", "a second response high, of v_max above 1, beside that of x_max above 1; allowed: another name"),
    "letter": ("", "two responses with the letter H; allowed: each once"),
}  # fmt: skip
BELOW = {
    "limits": "m.response('high', 'x_max', 1, limits={'mild': 2, 'hard': 1})\n",
    "band": "m.response('high', 'x_max', 1, limits={'none': 1})\n",
    "severity": "m.response('high', 'x_max', 1, limits={'mild': 2, 'hard': 3})\n",
    "always": "m.response('high', 'v_max', -0.1)\n",
    "again": "m.response('high', 'x_max', 1)\nm.response('high', 'v_max', 1)\n",
    "colour": "m.response('high', 'x_max', 1, colour='red')\n",
    "marker": "m.response('high', 'x_max', 1, marker='o')\n",
    "letter": "m.response('high', 'x_max', 1, letter='H')\nm.response('low', 'x_min', 1, letter='H')\n",
}


@pytest.mark.parametrize("state", ["spin", "x"])
def test_a_negative_threshold_may_be_right(script, state):
    """Of what turns, and of a position."""
    made = script(
        "@nsdrill.model\ndef turns(x=0.1, v=0.0, angle=0.0, spin=-2.0, *, k=1.0):\n"
        "    return v, -k * x, spin, -0.1 * spin - np.sin(angle)\n",
        "turns",
    ).turns
    made.response("high", f"{state}_max", -0.1)
    assert getattr(described("turns").thresholds().high, f"{state}_max") == -0.1


@pytest.mark.parametrize("fault", REFUSED)
def test_what_is_no_response_or_order_is_refused_in_words(script, fault):
    given, words = REFUSED[fault]
    with pytest.raises(InputError, match=words) as error:
        script(DECLARED.format(given) + BELOW.get(fault, ""), f"critical_{fault}")
    assert f"critical_{fault}.py, line " in str(error.value).partition(": ")[0]


def test_a_short_name_of_several_keys_is_refused(duffing):
    with pytest.raises(InputError, match=r"found tolerance, which several keys have; allowed: .*settled\.tolerance"):
        duffing.study(tolerance=0.1)
    study = duffing.study(**{"classify.settled.tolerance": 0.1})
    assert study.resolved["classify"]["settled"]["tolerance"] == 0.1
    assert np.isclose(study.resolved["classify"]["trust"]["tolerance"], 0.05)
