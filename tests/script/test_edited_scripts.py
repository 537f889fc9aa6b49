"""A script that is edited between a run and what is asked of its results: nothing is said of old
runs with the words, the order or the theory of another model, law or drive."""

import pytest

import nsdrill

from .conftest import command

LAW = """import nsdrill
from nsdrill.equations.library import direction, expm1


@nsdrill.law(fall=lambda n: 0.858 * n.rise / n.width)
def bell(v, n, *, width=nsdrill.number(0.3, "m/s", "slip over which it falls", low=1e-3)):
    share = 1.0 + expm1(-((v / width) ** 2))
    return direction(n.smoothing * v) * (n.dynamic + n.rise * share)
"""
SAME_LAW = """# the law of a bell
import nsdrill
from nsdrill.equations.library import direction, expm1


@nsdrill.law(fall=lambda n: 0.858 * n.rise / n.width)
def bell(v, n, *, width=nsdrill.number(0.3, "m/s", "slip over which it falls", low=1e-3)):
    \"\"\"Falls as a bell does.\"\"\"
    bump = 1.0 + expm1(-((v / width) ** 2))  # from 1 to 0
    return direction(n.smoothing * v) * (n.dynamic + n.rise * bump)
"""
STUDY = """model: torsion
operation: {depth: 3000 m, wob: 60 kN}
bit: {friction: {law: bell, width: 2 rad/s}}
sweep: {rotary_speed: [7 rad/s, 9 rad/s, 11 rad/s], procedure: up-down}
simulation: {transient: 5 s, observe: 5 s}
"""
READING = (
    "show r.h5",
    "show r.h5 --json",
    "window r.h5 --json",
    "window r.h5 --trials",
    "window r.h5 r.h5",
    "report r.h5 -o r.html",
    "report r.h5 -o r.html --one-page",
    "plot r.h5 -o r.png",
    "diff r.h5 r.h5",
    "export r.h5 -o r.csv",
    "classify r.h5 -o c.h5",
    "spectrum r.h5 --at rotary_speed=9rad/s --procedure up",
    "sensitivity r.h5",
    "combine r.h5 r.h5 -o c.h5",
    "replay r.h5 --at rotary_speed=9rad/s --procedure up -o t.h5",
    "branches c.yaml --seeds r.h5 -o b.h5",
    "view r.h5 --no-browser",
)


@pytest.fixture
def of_law(tmp_path):
    (tmp_path / "bell.py").write_text(LAW, encoding="utf-8")
    (tmp_path / "s.yaml").write_text(STUDY, encoding="utf-8")
    along = "continue: {along: rotary_speed, from: 7 rad/s, to: 11 rad/s}\n"
    (tmp_path / "c.yaml").write_text(f"{STUDY}{along}", encoding="utf-8")
    command(tmp_path, "run", "s.yaml", "-o", "r.h5", "--with", "bell.py")
    return tmp_path


def test_results_of_an_edited_law_are_refused_by_all_that_reads_them(of_law):
    (of_law / "bell.py").write_text(LAW.replace("n.rise * share", "0.2 * n.rise * share"), encoding="utf-8")
    for words in READING:
        shown, said = command(of_law, *words.split(), "--with", "bell.py", code=2)
        assert shown == "", words
        assert "r.h5: CHANGED SINCE THE RUNS: made with the law bell of the script bell.py" in said, words
        assert "allowed: what they were made with, as it was, or the study run again" in said, words
    assert sorted(file.name for file in of_law.iterdir() if file.suffix != ".py") == ["c.yaml", "r.h5", "s.yaml"]


def test_another_text_of_the_same_law_changes_nothing(of_law):
    before = command(of_law, "window", "r.h5", "--with", "bell.py")
    (of_law / "bell.py").write_text(SAME_LAW, encoding="utf-8")
    assert command(of_law, "window", "r.h5", "--with", "bell.py") == before


MODEL = """
@nsdrill.model
def duf(t, x=0.1, v=0.0, *, force=0.3, omega=1.2, damping=0.15):
    return v, force * np.cos(omega * t) - damping * v + x - x**3


@duf.feature("power", "W", "power of damping", mean=True)
def power(v, damping):
    return damping * v * v


"""
RESPONSES = (
    'duf.response("wide", "x_max", 1.5, words="wide swing")\n',
    'duf.response("costly", "power_mean", 0.04, words="costly motion")\n',
)


def test_the_order_of_responses_decides_on_no_words_of_old_results(tmp_path):
    """With the two in the other order the bit of one would be told by the name of the other."""
    head = f"import numpy as np\nimport nsdrill\n{MODEL}"
    (tmp_path / "duf.py").write_text(head + "".join(RESPONSES), encoding="utf-8")
    (tmp_path / "s.yaml").write_text(
        "model: duf\nsweep: {parameters.force: [0.2, 0.3]}\nsimulation: {transient: 20 s, observe: 20 s}\n"
    )
    command(tmp_path, "run", "s.yaml", "-o", "r.h5", "--with", "duf.py")
    (tmp_path / "duf.py").write_text(head + "".join(reversed(RESPONSES)), encoding="utf-8")
    for words in ("show r.h5", "window r.h5", "export r.h5 -o r.csv", "diff r.h5 r.h5"):
        shown, said = command(tmp_path, *words.split(), "--with", "duf.py", code=2)
        assert shown == ""
        assert "CHANGED SINCE THE RUNS: made with the model duf of the script duf.py" in said


ASKED = {
    "show": nsdrill.show,
    "window": nsdrill.window,
    "lyapunov_spectrum": lambda data: nsdrill.lyapunov_spectrum(data, procedure="up", at={"parameters.force": 0.3}),
    "replay": lambda data: nsdrill.replay(data, procedure="up", at={"parameters.force": 0.3}),
    "hysteresis": nsdrill.hysteresis,
    "classify": nsdrill.classify,
    "plot": nsdrill.plot,
}


def test_results_in_memory_are_refused_after_each_edit(script):
    """Exponents were those of the new equations, and the second edit in a session was told by
    nobody."""
    script_of = script("K = {'c': 1.0}\n" + MODEL.replace("- damping * v +", "- K['c'] * damping * v +"), "edits")
    study = {"model": "duf", "sweep": {"parameters.force": [0.2, 0.3], "procedure": "up-down"}}
    data = nsdrill.run({**study, "simulation": {"transient": "20 s", "observe": "20 s"}}, progress=False)
    as_run = ASKED["lyapunov_spectrum"](data)
    for other in (3.0, 5.0):
        script_of.K["c"] = other
        for ask in ASKED.values():
            with pytest.raises(
                nsdrill.NsdrillError, match="the Dataset: CHANGED SINCE THE RUNS: made with the model duf"
            ):
                ask(data)
    script_of.K["c"] = 1.0
    assert str(ASKED["lyapunov_spectrum"](data)) == str(as_run)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("force=0.3", "force=0.4", "the number force"),
        ("- x**3", "- 2*x**3", "the equations"),
        (RESPONSES[0], RESPONSES[0].replace("1.5", "1.6"), "the response wide"),
        (RESPONSES[0], "", "the response wide (not here)"),
    ],
)
def test_what_differs_in_a_changed_model_is_named(tmp_path, old, new, told):
    text = f"import numpy as np\nimport nsdrill\n{MODEL}{RESPONSES[1]}{RESPONSES[0]}"
    assert old in text
    (tmp_path / "duf.py").write_text(text, encoding="utf-8")
    (tmp_path / "s.yaml").write_text(
        "model: duf\nsweep: {parameters.force: [0.2, 0.3]}\nsimulation: {transient: 2 s, observe: 2 s}\n"
    )
    command(tmp_path, "run", "s.yaml", "-o", "r.h5", "--with", "duf.py")
    (tmp_path / "duf.py").write_text(text.replace(old, new), encoding="utf-8")
    _, said = command(tmp_path, "show", "r.h5", "--with", "duf.py", code=2)
    assert f"the script duf.py, which differs here: {told}." in said
    assert "To compare both versions, give one a name of its own and run it" in said
