"""Natural scales of models whose motion at the defaults grows without bound: motions at other
numbers, where they are stable, are right, and what is a guess or too small says so."""

import json
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.models.registry import model_named
from nsdrill.testing import check_model

from .conftest import command

GROW = """
@nsdrill.model
def galloping(y=0.1, v=0.0, *, wind=2.0, crit=1.0, damp=0.3):
    return v, -y - damp * (1 - wind / crit) * v


@nsdrill.model
def mathieu(t, x=0.1, v=0.0, *, eps=1.0, damp=0.05, omega=2.0):
    return v, -damp * v - (1 + eps * np.cos(omega * t)) * x


@nsdrill.model
def helm(t, x=0.1, v=0.0, *, force=0.2, damp=0.1, omega=0.85):
    return v, -damp * v - x + x * x + force * np.cos(omega * t)


@nsdrill.model
def saddle(x=1.0, v=0.0, *, k=4.0):
    return v, -k * abs(x)
"""
STABLE = [
    ("galloping", {"wind": 0.5}, 50.0),
    ("mathieu", {"eps": 0.0}, 100.0),
    ("helm", {"force": 0.02}, 100.0),
    ("saddle", {}, 2.5),
]


def quiet(call, *args, **named):
    """What a call gives, and what it warns of."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = call(*args, **named)
    return found, [str(one.message) for one in told if issubclass(one.category, nsdrill.RunWarning)]


@pytest.mark.parametrize(("name", "numbers", "seconds"), STABLE)
def test_a_motion_that_grows_at_the_defaults_is_right_at_other_numbers(script, name, numbers, seconds):
    """Against SciPy, to 1e-3 of the start; and the guess is told by check, a run, a trace and the bench."""
    model = getattr(script(GROW, "grow"), name)
    study = model.study(**numbers, transient=0, observe=seconds)
    data, told = quiet(nsdrill.run, study, progress=False, workers=1)
    start, given = [float(one) for one in model.reading.signature.start.values()], {**DEFAULTS[name], **numbers}
    timed = name in ("mathieu", "helm")
    right = solve_ivp(
        lambda t, y: model(*((t,) if timed else ()), *y, **given), (0, seconds), start, "DOP853", rtol=1e-11, atol=1e-13
    )
    found, wanted = data.final_state.values.ravel()[:2], right.y[:, -1]
    assert found == pytest.approx(wanted, abs=1e-3 * max(abs(start[0]), float(np.abs(wanted).max())))
    first = next(iter(model.reading.signature.start))
    assert data[f"{first}_max"].item() == pytest.approx(right.y[0].max(), rel=1e-3)
    assert any(f"A guess: the natural scale of {first}, v is that of the start" in one for one in told)
    assert any(one.startswith(f"Guess: the natural scale of {first}, v") for one in nsdrill.check(study).warnings)
    assert any("Guess" in one for one in quiet(nsdrill.simulate, study)[1])
    with pytest.raises(AssertionError, match=r"FAIL  natural scales that are guesses +2\.0e\+00"):
        check_model(model)


DEFAULTS = {
    "galloping": {"wind": 2.0, "crit": 1.0, "damp": 0.3},
    "mathieu": {"eps": 1.0, "damp": 0.05, "omega": 2.0},
    "helm": {"force": 0.2, "damp": 0.1, "omega": 0.85},
    "saddle": {"k": 4.0},
}
BOUNDED = """
@nsdrill.model
def slow(x=1e-3, v=0.0, *, mu=0.05):
    return v, mu * (1 - x * x) * v - x


@nsdrill.model
def thrown(x=0.0, v=1.0, *, pull=1.0):
    return v, pull


@nsdrill.model
def turning(angle=0.0, rate=1.0, *, torque=0.01):
    return rate, torque - 0.001 * rate + 0.0 * np.sin(angle)


@nsdrill.model
def measured(y=nsdrill.number(0.1, scale=0.01), v=nsdrill.number(0.0, scale=0.01), *, wind=2.0):
    return v, -y - 0.3 * (1 - wind) * v
"""


@pytest.mark.parametrize("name", ["slow", "thrown", "turning", "measured"])
def test_what_reaches_its_size_drifts_turns_or_is_given_is_no_guess(script, name):
    """A limit cycle that is reached late has its size, 2, over ten."""
    model = getattr(script(BOUNDED, "bounded"), name)
    study = model.study(transient=0, observe=10)
    data, told = quiet(nsdrill.run, study, progress=False, workers=1)
    assert not [one for one in (*told, *nsdrill.check(study).warnings) if "guess" in one.lower()]
    assert "guessed_scales" not in data.attrs
    if name == "slow":
        assert model_named(name).scale == {"x": 0.25, "v": 0.25}


SMALL = """
@nsdrill.model
def bent(y=0.1, v=0.0, *, wind=0.5):
    return v, -y - 0.3 * (1 - wind) * v


@nsdrill.model
def huge(y=nsdrill.number(0.1, scale=1e6), v=nsdrill.number(0.0, scale=1e6), *, wind=0.5):
    return v, -y - 0.3 * (1 - wind) * v
"""


def test_a_motion_that_is_small_beside_its_scale_is_told_also_where_nothing_forces_it(script, tmp_path, monkeypatch):
    """The error of a step is up to 1, of a motion from 0.1; what comes to rest from its own size is not told."""
    monkeypatch.chdir(tmp_path)
    made = script(SMALL, "small")
    for model, is_told in ((made.huge, True), (made.bent, False)):
        study = model.study(transient=0, observe=200)
        data, told = quiet(nsdrill.run, study, progress=False, workers=1)
        assert any(one.startswith("TOO SMALL for the tolerance: in 1 of 1 run") for one in told) == is_told
        assert (
            any(one.startswith("Small: with the numbers of the study") for one in nsdrill.check(study).warnings)
            == is_told
        )
        if is_told:
            assert data.y_max.item() > 0.2  # of 0.1: errors alone
            assert "any factor" in told[0]
    (tmp_path / "study.yaml").write_text("model: huge\nsimulation: {transient: 0 s, observe: 200 s}\n")
    (tmp_path / "small.py").write_text("import numpy as np\nimport nsdrill\n" + SMALL, encoding="utf-8")
    for line in (("run", "study.yaml", "-o", "r.h5"), ("show", "r.h5")):
        assert "TOO SMALL" in "".join(command(tmp_path, *line, "--with", "small.py")), line


def test_a_guess_is_told_by_commands_and_kept(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grow.py").write_text("import numpy as np\nimport nsdrill\n" + GROW, encoding="utf-8")
    (tmp_path / "study.yaml").write_text(
        "model: galloping\nparameters: {wind: 0.5}\nsimulation: {transient: 0 s, observe: 50 s}\n"
    )
    for line in (("check", "study.yaml"), ("run", "study.yaml", "-o", "r.h5"), ("show", "r.h5")):
        told = " ".join("".join(command(tmp_path, *line, "--with", "grow.py")).split())
        assert "natural scale of y, v is that of the start" in told, line
    script(GROW, "grow")
    assert json.loads(nsdrill.open_results("r.h5").guessed_scales) == ["y", "v"]


PARTS = """
@nsdrill.model
def beside(
    t, x=0.1, v=0.0, y=nsdrill.number(0.0, scale=10.0), w=nsdrill.number(0.0, scale=10.0), *, push=1e-5, held=0.0
):
    return v, np.cos(t) - x - 0.1 * v, w, push * np.cos(2.9 * t) - 9 * (y - held) - 0.1 * w


@nsdrill.model
def growing(x=1.0, v=0.0, y=nsdrill.number(1e-8, scale=0.1), *, grow=0.2):
    return v, -x - 0.01 * v, grow * y - y**3
"""


@pytest.mark.parametrize(
    ("name", "given", "parts"),
    [
        ("beside", {}, {"y, w": 1}),
        ("beside", {"push": 0.0}, {}),  # exactly at rest
        ("beside", {"push": 0.0, "y": 1.0}, {}),  # comes to rest from its size
        ("beside", {"push": 1.0}, {}),
        ("growing", {"observe": 60}, {"y": 1}),
        ("growing", {"observe": 60, "y": 1e-3}, {}),
        ("growing", {"observe": 60, "y": 0.0}, {}),
    ],
)
def test_a_part_that_is_small_beside_others_is_told_by_name(script, name, given, parts):
    model = getattr(script(PARTS, "parts"), name)
    study = model.study(**{"transient": 0, "observe": 100, **given})
    _, told = quiet(nsdrill.run, study, progress=False, workers=1)
    small = [one for one in told if one.startswith("TOO SMALL")]
    assert bool(small) == bool(parts)
    for part in parts:
        assert f"beside what moves, {part} in 1 of 1 run moves by less than 100 tolerances" in small[0]
        assert "no state moves" not in small[0]
