"""Pulses of a forcing that lie within a step, and motions near its tolerance."""

import json
import re

import pytest
from matplotlib.text import Text

import nsdrill
from nsdrill.models.registry import model_named

from .conftest import command

PULSES = """
@nsdrill.model
def pulsed(t, x=0.0, *, width=0.01, height=100.0):
    return {"x": -0.05 * x + (height if np.sin(2 * np.pi * t / 100) > 1 - width * 1e-3 else 0.0)}


@nsdrill.model
def knocked(t, x=0.0, *, at=300.0, half=0.1):
    return {"x": -0.05 * x + (1.0 if abs(t - at) < half else 0.0)}


@nsdrill.model
def driven(t, x=0.0, v=0.0, *, f=1.0):
    return {"x": v, "v": -x - 0.1 * v + f * np.cos(t) + (1.0 if np.sin(t) > 0.9 else 0.0)}


@nsdrill.model
def waved(t, x=0.0, v=0.0, *, f=0.3):
    return {"x": v, "v": -x - 0.2 * v + f * np.cos(1.2 * t) + f * np.cos(np.sqrt(3) * t)}


@nsdrill.model
def swept(t, x=0.0, v=0.0, *, f=0.3):
    return {"x": v, "v": -x - 0.2 * v + f * np.cos(1.2 * t + 1e-3 * t**2)}
"""


@pytest.mark.parametrize(
    ("model", "said"),
    [
        ("pulsed", "for 0.142 s in each 100 s"),
        ("knocked", "for 0.2 s in each 600 s"),
        ("driven", None),
        ("waved", None),
        ("swept", None),
    ],
)
def test_pulses_that_steps_may_jump_over_are_told(script, model, said):
    """Of sin > 1 - 1e-5, arccos(1 - 1e-5) / pi = 0.001424 of 100 s; of a single knock its 0.2 s in 600 s, which
    makes the motion no periodic one; a tenth of a period is noticed by steps. Waves that do
    not repeat do not rest between."""
    script(PULSES, "pulses")
    study = {"model": model, "simulation": {"transient": "300 s", "observe": "300 s"}}
    told = [one for one in nsdrill.check(study).warnings if one.startswith("Pulse:")]
    found = [re.search(r"changes for ([\d.]+) s in each (\d+) s", one).groups() for one in told]
    wanted = re.findall(r"for ([\d.]+) s in each (\d+) s", said or "")
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        assert float(one[0]) == pytest.approx(float(other[0]), rel=0.06)  # of 21 samples
        assert one[1] == other[1]
    assert (model_named(model).reading.rate is None) == (model in ("knocked", "waved", "swept"))


BUMPS = """
@nsdrill.model
def of_time(t, x=0.0, v=0.0, *, narrow=2e4):
    return {"x": v, "v": -x - 0.1 * v + 5.0 * np.exp(-narrow * (1 - np.cos(0.1 * t)))}


@nsdrill.model
def of_two_rates(t, x=0.0, v=0.0, *, narrow=2e4):
    wave = 0.1 * np.sin(np.sqrt(2) * 0.1 * t)
    return {"x": v, "v": -x - 0.1 * v + wave + 5.0 * np.exp(-narrow * (1 - np.cos(0.1 * t)))}


@nsdrill.model
def of_an_angle(angle=0.0, x=0.0, v=0.0, *, narrow=2e4, rate=0.1):
    return {"angle": rate, "x": v, "v": -x - 0.1 * v + 5.0 * np.exp(-narrow * (1 - np.cos(angle)))}


@nsdrill.model
def of_a_flywheel(angle=0.0, w=0.1, x=0.0, v=0.0, *, narrow=2e4):
    force = 5.0 * np.exp(-narrow * (1 - np.cos(angle)))
    return {"angle": w, "w": 0.01 * (0.1 - w) - 1e-3 * force, "x": v, "v": -x - 0.1 * v + force}
"""


@pytest.mark.parametrize("model", ["of_time", "of_two_rates", "of_an_angle", "of_a_flywheel"])
@pytest.mark.parametrize(("narrow", "is_told"), [(2e4, True), (5.0, False)])
def test_pulses_are_told_of_whatever_turns(script, model, narrow, is_told):
    """exp(-k (1 - cos a)) is exp(-k a^2 / 2) where it is no 0: its area squared over that of its square is sqrt(4 pi
    / k) = 0.02507 rad, 0.2507 s at 0.1 rad/s, with k = 2e4."""
    script(BUMPS, "bumps")
    study = {"model": model, "parameters": {"narrow": narrow}, "simulation": {"transient": "300 s", "observe": "300 s"}}
    told = [one for one in nsdrill.check(study).warnings if one.startswith("Pulse:")]
    assert bool(told) == is_told
    for one in told:
        width, every = re.search(r"changes for ([\d.]+) s in each ([\d.]+) s", one).groups()
        assert float(width) == pytest.approx(0.2507, rel=0.03)
        assert float(every) == pytest.approx(20 * 3.14159265, rel=0.07)  # of 600 s one of nine, of two rates


@pytest.mark.parametrize(("narrow", "is_told"), [(2e4, True), (5.0, False)])
def test_pulses_of_an_angle_at_rest_are_told_by_the_angle(script, narrow, is_told):
    """The same 0.02507 rad: how long they take is not known before the flywheel turns."""
    script(BUMPS, "bumps_at_rest")
    study = {"model": "of_a_flywheel", "parameters": {"narrow": narrow}, "initial": {"w": 0.0, "angle": 3.0}}
    told = [one for one in nsdrill.check(study).warnings if one.startswith("Pulse:")]
    assert bool(told) == is_told
    for one in told:
        assert float(re.search(r"within ([\d.]+) rad of each turn of angle, which rests", one)[1]) == pytest.approx(
            0.02507, rel=0.03
        )
        assert "how long that takes is not looked at" in one


@pytest.mark.parametrize(
    ("force", "rtol", "is_told"), [(1e-6, 1e-6, True), (1e-6, 1e-10, False), (1e-2, 1e-6, False), (0.0, 1e-6, False)]
)
def test_a_motion_near_the_tolerance_is_told(script, tmp_path, monkeypatch, force, rtol, is_told):
    """An oscillator in a well, forced by so little that steps do not see it: its swing is that of the linear one,
    2 force / |2 - w^2 + i c w|, where nothing is told."""
    monkeypatch.chdir(tmp_path)
    text = """
@nsdrill.model
def welled(t, x=1.0, v=0.0, *, force=0.3):
    return {"x": v, "v": force * np.cos(1.2 * t) - 0.15 * v + x - x**3}
"""
    (tmp_path / "welled.py").write_text("import numpy as np\nimport nsdrill\n" + text, encoding="utf-8")
    script(text, "welled")
    study = (
        f"model: welled\nparameters: {{force: {force}}}\nsimulation: {{transient: 300 s, observe: 100 s, rtol: {rtol}}}"
    )
    (tmp_path / "study.yaml").write_text(study, encoding="utf-8")
    for line in (("run", "study.yaml", "-o", "r.h5"), ("show", "r.h5")):
        told = " ".join("".join(command(tmp_path, *line, "--with", "welled.py")).split())
        assert ("in 1 of 1 run no state moves by 2000 tolerances" in told) == is_told
    if not is_told:
        data = nsdrill.open_results("r.h5")
        swing = 2 * force / abs(2 - 1.2**2 + 0.15j * 1.2)
        assert (data.x_max - data.x_min).item() == pytest.approx(swing, rel=2e-2, abs=1e-12)


BESIDE = """
@nsdrill.model
def kicked(t, x=0.1, v=0.0, *, damping=0.2, force=600.0, sharp=1e6):
    return {"x": v, "v": force * np.exp(-sharp * (1 - np.cos(t))) - damping * v - x}


@kicked.feature("bump", "", "a narrow one", greatest=True)
def bump(x):
    return np.sin(1e9 * x) ** 2


kicked.response("swing", "x_max", 1.0, limits={"mild": 1.0, "hard": 3.0}, words="swing", colour="#AA3377")
"""


def test_what_makes_numbers_of_a_script_wrong_comes_first_beside_the_window(script, tmp_path, monkeypatch):
    """In the text, its JSON and the picture, as in ``show``."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kicked.py").write_text("import numpy as np\nimport nsdrill\n" + BESIDE, encoding="utf-8")
    (tmp_path / "study.yaml").write_text(
        "model: kicked\nsweep: {parameters.damping: [0.5, 1]}\nsimulation: {transient: 50 s, observe: 100 s}\n"
    )
    script(BESIDE, "kicked")
    heads = "PULSE", "TOO FAST", "TOO SMALL"
    command(tmp_path, "run", "study.yaml", "-o", "r.h5", "--with", "kicked.py")
    for line in (("show", "r.h5"), ("window", "r.h5")):
        told = command(tmp_path, *line, "--with", "kicked.py")[0]
        assert [head for head in heads if f"  {head} " in told or f"  {head}:" in told] == list(heads), line
    found = json.loads(command(tmp_path, "window", "r.h5", "--json", "--with", "kicked.py")[0])
    assert found["pulses"].startswith("Pulse: what forces kicked changes for 0.00")
    assert found["outrun"]["bump"]["runs"] == found["too_small"]["runs"] == 2
    drawn = nsdrill.plot("r.h5", kind="window", text=True)
    texts = " ".join(" ".join(text.get_text() for text in drawn.findobj(Text)).split())
    assert all(head in texts for head in heads)
