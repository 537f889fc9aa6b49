"""Friction whose numbers change in time, so that it may push along the slip."""

import json

import numpy as np
import pytest

import nsdrill
from nsdrill.compiler.language import LanguageError
from nsdrill.equations import plain
from nsdrill.equations.graph import Graph
from nsdrill.equations.library import direction, exp, expm1, sincos, tanh
from nsdrill.script.driving import bounds_of
from nsdrill.testing import check_model

from .conftest import command

# A wave y = y(0) cos(3 t) is in the numbers of a contact.
HEAD = """
@nsdrill.model
def rubbing(x=0.0, v=0.5, y=0.1, w=0.0, *, load={load}, k=4.0):
    rub = 0.0
    {rub}
    return v, -x - rub, w, -9.0 * y


rubbing.response("swing", "x_max", 1.0, limits={{"mild": 1.0, "hard": 3.0}})
"""
USUAL = {"normal": "1.0", "static": "0.3", "dynamic": "0.2", "smoothing": "100.0"}
OF_WAVE = {  # below 0 where 1 + 4 y is
    "normal load": {"normal": "load + k * y"},
    "static less dynamic": {"static": "0.2 + 0.1 * (load + k * y)"},
    "coefficient or static less dynamic": {"static": "2.0", "dynamic": "0.3 * (load + k * y)"},
}
TURNS = 10 * 2 * np.pi / 3  # s, ten waves


def model(script, name, given, load="1.0", form="{}"):
    numbers = ", ".join(f"{name}={value}" for name, value in (USUAL | given).items())
    rub = f"rub = nsdrill.friction('pad', slip=v - 0.3, {numbers}, decay=3.0)"
    return script(HEAD.format(rub=form.format(rub), load=load), name).rubbing


@pytest.mark.parametrize("below", OF_WAVE)
def test_the_time_in_which_friction_drives_is_measured_and_told(script, below):
    """1 + 4 y < 0 with y = 0.5 cos 3t: a third of the time; with y = 0.1 cos 3t never."""
    made = model(script, "driving", OF_WAVE[below])
    words = f"FRICTION DRIVES: in 1 of 2 runs {below} of pad is below 0 for up to 33 % of the observed time"
    with pytest.warns(nsdrill.RunWarning, match=words):
        data = nsdrill.run(made.study(y=[0.1, 0.5], transient=0, observe=TURNS), progress=False)
    assert data.pad_driving_fraction.values.ravel() == pytest.approx([0.0, 1 / 3], abs=1e-4)


@pytest.mark.parametrize(("given", "form", "is_watched"), [
    ({"normal": "load"}, "{}", False),  # a key of the study, which is refused below 0
    ({"normal": "np.maximum(load + k * y, 0.0)"}, "{}", False),
    ({"normal": "load * (1.0 + 0.3 * np.sin(y)) + nsdrill.touching('end', y)"}, "{}", False),
    ({"normal": "load * y * y", "static": "0.3 + abs(y)"}, "{}", False),
    ({"normal": "load * (1.0 + 1.3 * np.sin(y))"}, "{}", True),
    ({"normal": "load + k * y"}, "if load + k * y > 0.0:\n        {}", True),
])  # fmt: skip
def test_friction_that_brakes_is_not_told(script, given, form, is_watched):
    """Nothing is added to a run where it is sure to brake; under an `if` it is there only where that holds."""
    made = model(script, "braking", given, load="nsdrill.number(1.0, low=0.0)", form=form)
    data = nsdrill.run(made.study(y=0.5, transient=0, observe=TURNS), progress=False)
    assert ("pad_driving_fraction" in data) == is_watched
    assert not is_watched or data.pad_driving_fraction.item() == 0.0


def test_friction_that_drives_is_told_wherever_results_are(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    head = "import numpy as np\nimport nsdrill\n"
    rub = "rub = nsdrill.friction('pad', slip=v - 0.3, normal=load + k * y, static=0.3, smoothing=100.0)"
    (tmp_path / "told.py").write_text(head + HEAD.format(rub=rub, load="1.0"), encoding="utf-8")
    (tmp_path / "study.yaml").write_text(
        "model: rubbing\nsweep: {initial.y: [0.1, 0.5]}\nsimulation: {transient: 0 s, observe: 20 s}\n"
    )
    told = ["".join(command(tmp_path, *line, "--with", "told.py")) for line in (
        ("run", "study.yaml", "-o", "r.h5", "--workers", "1"), ("show", "r.h5"), ("window", "r.h5"),
        ("report", "r.h5", "-o", "r.html"),
    )]  # fmt: skip
    told[-1] = (tmp_path / "r.html").read_text()
    for one in told:
        assert "FRICTION DRIVES" in one
        assert "normal load of pad is below 0 for up to 3" in " ".join(one.split())
    for name in ("show", "window"):
        found = json.loads(command(tmp_path, name, "r.h5", "--json", "--with", "told.py")[0])
        assert found["driving"]["pad"]["runs"] == 1
        assert found["driving"]["pad"]["longest"] == pytest.approx(1 / 3, abs=0.02)


def test_a_trace_and_branches_tell_of_friction_that_drives(script, tmp_path):
    """As a sweep does: one run of the wave of 0.5 drives a third of the time; a forced one of 2 too."""
    made = model(script, "traced", OF_WAVE["normal load"])
    study = made.study(y=0.5, transient=0, observe=TURNS)
    told = r"FRICTION DRIVES: in 1 of 1 run normal load of pad is below 0 for up to 33 % of the observed time"
    with pytest.warns(nsdrill.RunWarning, match=told):
        trace = nsdrill.simulate(study)
    load = 1.0 + 4.0 * trace["y"].values
    assert np.array_equal(trace["pad_drives"].values, load < 0.0)
    with pytest.warns(nsdrill.RunWarning, match="FRICTION DRIVES"):
        results = nsdrill.run(made.study(y=[0.1, 0.5], transient=0, observe=TURNS), progress=False)
    with pytest.warns(nsdrill.RunWarning, match=told):
        nsdrill.replay(results, at={"initial.y": 0.5})
    forced = script(FORCED, "forced").pressed
    study = forced.study(continued={"force": (0.5, 0.6), "seeds": [0.5], "lobes": [1]}, transient=50, observe=50)
    with pytest.warns(
        nsdrill.RunWarning, match=r"FRICTION DRIVES: in (\d+) of \1 points normal load of pad is below 0"
    ):
        nsdrill.continue_branches(study, progress=False)
    with pytest.warns(nsdrill.RunWarning, match="FRICTION DRIVES"):
        trace = nsdrill.simulate(forced.study(force=0.5, transient=0, observe=30))
    assert np.array_equal(trace["pad_drives"].values, 1.0 + 4.0 * trace["x"].values < 0.0)


FORCED = """
@nsdrill.model
def pressed(t, x=0.0, v=0.0, *, force=0.05):
    load = 1.0 + 4.0 * x
    rub = nsdrill.friction("pad", slip=v, normal=load, static=0.1, smoothing=20.0)
    return v, -x - 0.4 * v - rub + force * np.cos(1.3 * t)


pressed.response("swing", "x_max", 10.0)
"""


def test_a_smoothing_that_changes_is_refused(script):
    with pytest.raises(LanguageError, match=r"line 10: .*found a smoothing of the friction 'pad' that changes in time"):
        model(script, "smoothed", {"smoothing": "100.0 + x"})


def test_a_check_of_a_model_fails_where_its_friction_drives(script):
    made = model(script, "checked", OF_WAVE["normal load"])
    assert "ok    friction of pad brakes" in str(check_model(made, "simulation: {transient: 0 s, observe: 5 s}"))
    with pytest.raises(AssertionError, match=r"1 failed[\s\S]*FAIL  friction of pad brakes"):
        check_model(made, "initial: {y: 0.5}\nsimulation: {transient: 0 s, observe: 5 s}")


def test_bounds_are_those_of_intervals():
    """Against values at random arguments of the same expression."""
    graph, rng = Graph(), np.random.default_rng(3)
    x, p = graph.input("s.x"), graph.input("p.p")
    made = (
        x * x, p * tanh(x), 3.0 - sincos(x)[1], abs(x) - p, exp(p * sincos(x)[0]), direction(x) / (1.0 + p),
        graph.make("min", x, p), graph.make("max", -x, p), expm1(-p), graph.select(x < 1.0, p, 2.0 * p) - 1.0,
        (x * x).graph.make("sqrt", x * x), graph.make("fma", x, x, p), 1.0 / (p * x),
    )  # fmt: skip
    given = {"s.x": rng.normal(0.0, 3.0, 1000), "p.p": rng.uniform(0.5, 2.0, 1000)}
    for node in made:
        low, high = bounds_of(node, {"p.p": (0.5, 2.0)})
        found = plain.values({"": node}, given)[""]
        assert low <= np.min(found) + 1e-12
        assert np.max(found) <= high + 1e-12
    assert [bounds_of(node, {"p.p": (0.5, 2.0)}) for node in made[:3]] == [(0.0, np.inf), (-2.0, 2.0), (2.0, 4.0)]
