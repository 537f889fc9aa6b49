"""Models that read the time as a value: what their runs tell of is told with every answer."""

import json

import numpy as np
import pytest

import nsdrill
from nsdrill.models.registry import model_named

from .conftest import command
from .test_natural_scales import quiet

MODELS = """
@nsdrill.model(responses={"hot": ("x_max", 0.5)})
def heat(t, x=0.0, v=0.0, *, f=0.3, rate=1e-3):
    return v, f * np.cos(1.3 * t) - (0.3 - rate * t) * v - 5.0 * x


@nsdrill.model
def follows(t, z=0.0, x=0.1, v=0.0, *, f=1.0):
    return 1000.0 * (t - z), v, -f * x


@nsdrill.model
def worn(x=0.1, v=0.0, *, damping=0.1):
    return v, -damping * v - x


@nsdrill.model
def forced(t, x=0.1, v=0.0, *, f=0.3, omega=1.3):
    late, turned, wave = 1e-3 * t, omega * t, np.sin(omega * t)
    return v, f * np.cos(omega * t) - 0.1 * v - x

"""
STUDY = """
model: heat
sweep: {parameters.f: [0.1, 0.2], procedure: up-down}
simulation: {transient: 100 s, observe: 50 s}
"""
TOLD = "runs tell of 0 to 150 s alone, and each point begins at 0 s again, with the state of the one before"


def test_each_point_of_a_chain_begins_at_zero_again(script):
    """What follows the time by a thousandth of a second is there at the end of the observation, at each point."""
    study = script(MODELS, "timed").follows.study(f=(0.5, 1.0, 3), procedure="up-down", transient=10, observe=5)
    data, told = quiet(nsdrill.run, study, progress=False, workers=1)
    assert np.allclose(data.z_max, 15.0 - 1e-3, atol=1e-4)
    assert any("runs tell of 0 to 15 s alone, and each point begins at 0 s again" in one for one in told)


def test_what_no_run_tells_is_told_by_every_answer(script, tmp_path, monkeypatch):
    """The damping of the model is negative from 300 s on."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(STUDY)
    script(MODELS, "timed")
    for line in (
        ("check", "study.yaml"),
        ("run", "study.yaml", "-o", "r.h5", "-q"),
        ("show", "r.h5"),
        ("window", "r.h5"),
    ):
        told = " ".join("".join(command(tmp_path, *line, "--with", "timed.py")).split())
        assert TOLD in told, line
    for line in (("show", "r.h5", "--json"), ("window", "r.h5", "--json")):
        found = json.loads(command(tmp_path, *line, "--with", "timed.py")[0])
        assert found["clocked"] == {"seconds": 150.0, "carried": True}
    command(tmp_path, "report", "r.h5", "-o", "r.html", "--with", "timed.py")
    assert TOLD in (tmp_path / "r.html").read_text(encoding="utf-8")
    script(MODELS, "timed")
    drawn = nsdrill.plot("r.h5").legends[0].get_texts()
    assert any("TIME IS A VALUE: runs tell of 0 to 150 s alone" in one.get_text() for one in drawn)


def test_samples_tell_it_too(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.yaml").write_text(
        STUDY.replace(", procedure: up-down", "")
        + "uncertain: {parameters.rate: {uniform: [0.0, 1e-3]}, samples: 16}\n"
    )
    script(MODELS, "timed")
    command(tmp_path, "run", "study.yaml", "-o", "r.h5", "-q", "--with", "timed.py")
    told = " ".join("".join(command(tmp_path, "sensitivity", "r.h5", "--with", "timed.py")).split())
    assert "TIME IS A VALUE" in told
    assert "runs tell of 0 to 150 s alone. What" in told  # each from the start of the study


@pytest.mark.parametrize(
    ("feature", "is_told"), [("wave", False), ("late", True), ("turned", True)], ids=["repeats", "time", "angle"]
)
def test_a_forcing_that_repeats_is_no_value_unless_what_is_measured_does_not(script, feature, is_told):
    own = f"\n\n@forced.feature('own', '1', mean=True)\ndef own(x, {feature}):\n    return x * {feature}\n"
    made = script(MODELS + own, "timed")
    assert model_named("forced").reading.forcing is not None
    study = made.forced.study(transient=5, observe=5)
    _, told = quiet(nsdrill.run, study, progress=False, workers=1)
    assert any("Time is a value" in one for one in told) == is_told
    assert any("Time is a value" in one for one in nsdrill.check(study).warnings) == is_told


def test_a_model_without_the_time_is_silent(script):
    study = script(MODELS, "timed").worn.study(transient=5, observe=5)
    _, told = quiet(nsdrill.run, study, progress=False, workers=1)
    assert not [one for one in (*told, *nsdrill.check(study).warnings) if "Time is a value" in one]
