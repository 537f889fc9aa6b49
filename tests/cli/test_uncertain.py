"""Uncertain numbers from the command line, as a user works with them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .helpers import Call

STUDY = """
title: Not known
operation: {depth: 2000 m}
sweep: {rotary_speed: {from: 4 rad/s, to: 12 rad/s, points: 3}}
uncertain:
  bit.rock_stiffness: {lognormal: {median: 25 MN/m, factor: 2}}
  wob: {uniform: [20 kN, 40 kN]}
  samples: 16
simulation: {transient: 5 s, observe: 5 s}
record: {peaks: 0}
"""


@pytest.fixture
def results(call: Call, tmp_path: Path) -> Path:
    (tmp_path / "study.yaml").write_text(STUDY)
    call("run", str(tmp_path / "study.yaml"), "-o", str(tmp_path / "out.h5"), "--quiet")
    return tmp_path / "out.h5"


def test_from_the_study_to_the_answers(call: Call, results: Path, tmp_path: Path) -> None:
    study = str(tmp_path / "study.yaml")
    assert "16 samples of weight on bit, bit rock stiffness" in call("check", study).out
    shown = call("show", str(results)).out
    assert "weight on bit" in shown
    assert "nine in ten lie in" in shown
    assert "Probability, in brackets its 95 % interval from 16 samples:" in shown
    plain = json.loads(call("show", str(results), "--json").out)
    assert plain["samples"] == 16
    assert len(plain["probabilities"]) == 3
    assert 20e3 < plain["unknowns"]["operation.wob"]["value"] < 40e3
    field = json.loads(call("show", str(results), "--json", "--units", "field").out)
    assert field["unknowns"]["operation.wob"]["units"] == "klbf"
    assert field["unknowns"]["operation.wob"]["value"] == pytest.approx(
        plain["unknowns"]["operation.wob"]["value"] / 4448.2216152605
    )
    window = call("window", str(results), "--confidence", "75").out
    assert call("window", str(results), "--confidence", "75 %").out == window
    assert "75 % or more of 16 samples" in window
    assert "What the confidence costs:" in window
    assert json.loads(call("window", str(results), "--json").out)["confidence"] == 0.9
    assert "first" in call("sensitivity", str(results), "-o", str(tmp_path / "t.png")).out
    assert (tmp_path / "t.png").stat().st_size > 1000
    call("plot", str(results), "-o", str(tmp_path / "p.png"), "--confidence", "80")
    call("plot", str(results), "--at", "sample=3", "--kind", "summary", "-o", str(tmp_path / "s.png"))


def test_one_sample_is_replayed(call: Call, results: Path, tmp_path: Path) -> None:
    done = call("replay", str(results), "--rotary-speed", "8rad/s", "--at", "sample=5", "-o", str(tmp_path / "t.h5"))
    assert "sample 5" in done.err
    assert "bit for bit" in done.err
    study, trace = str(tmp_path / "study.yaml"), str(tmp_path / "u.h5")
    said = call("simulate", study, "--at", "sample=5", "-o", trace).err
    assert "Point: 2000 m" in said
    assert "bit rock stiffness" in said
    assert "sample 5" in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("replay", "OUT", "--rotary-speed", "8rad/s", "-o", "NEW"), "Say which one with --at sample=..., 0 to 15"),
        (("replay", "OUT", "--rotary-speed", "8rad/s", "--at", "sample=16", "-o", "NEW"), "found 16; allowed: 0 to 15"),
        (("replay", "OUT", "--rotary-speed", "8rad/s", "--at", "sample=1.5", "-o", "NEW"), "a whole number"),
        (("plot", "OUT", "--kind", "summary", "-o", "NEW"), "which draws one sample"),
        (("plot", "OUT", "--kind", "tornado", "--confidence", "90", "-o", "NEW"), "--confidence: found with --kind"),
        (("window", "OUT", "--confidence", "0"), "--confidence: found 0; allowed: a percentage from 1 to 99.99."),
        (("window", "OUT", "--confidence", "0.9"), "A part of one is meant in percent: 90."),
        (("window", "OUT", "--confidence", "much"), "--confidence: found much; allowed: a percentage"),
        (("sensitivity", "OUT", "--at", "sample=1"), "allowed: axes of the sweep"),
        (("combine", "OUT", "-o", "NEW"), "found 1 file; allowed: two or more"),
        (("combine", "OUT", "OUT", "-o", "NEW"), "found the same study"),
    ],
)
def test_what_is_wrong_is_said_and_writes_nothing(
    call: Call, results: Path, tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    names = {"OUT": str(results), "NEW": str(tmp_path / "new.png" if words[0] == "plot" else tmp_path / "new.h5")}
    before = sorted(path.name for path in tmp_path.iterdir())
    assert message in call(*(names.get(word, word) for word in words), code=2).err
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_files_become_one(call: Call, tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text(STUDY)
    for wob in ("10 MN/m", "20 MN/m"):
        name = str(tmp_path / f"{wob[:2]}.h5")
        call("run", str(tmp_path / "study.yaml"), "-o", name, "--quiet", "--set", f"well.stiffness={wob}")
    made = call("combine", str(tmp_path / "10.h5"), str(tmp_path / "20.h5"), "-o", str(tmp_path / "both.h5"))
    assert "2 files along the well stiffness (well.stiffness), 2 values; 96 points." in made.err
    assert "Probability" in call("show", str(tmp_path / "both.h5")).out
