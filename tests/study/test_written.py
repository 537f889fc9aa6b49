"""A resolved study as text: read again it is the same study, whatever was in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from nsdrill.study import load_study, parse_study
from nsdrill.study.write import changes, study_text, value_text

CONFIGS = sorted((Path(__file__).parents[2] / "configs").glob("*.yaml"))
STUDIES = {
    "deep collars": "sweep: {depth: [7 km, 8000.1 m]}\ndrillstring: {collar: {length: 6 km}}",
    "ramp": "operation: {rotary_speed: {ramp: [[0 s, 3 rad/s], [10 s, 77 rpm]]}}",
    "ramp beside a sweep": "operation: {depth: {ramp: [[0 s, 3000 m], [10 s, 12000 ft]]}}\n"
    "sweep: {rotary_speed: {from: 60 rpm, to: 97 rpm, points: 7}, "
    "procedure: up-down}",
    "hertz": "well: {law: hertz, stiffness: 0.7 GN/m^1.5}\nsweep: {depth: 2 km, wob: 3.3 klbf}",
    "slice": "sweep: {depth: 2 km}\n"
    "initial: {slice: {x: {from: -1 in, to: 1 in, points: 3}, vx: {from: 0 ft/s, to: 7 "
    "m/s, points: 3}}}",
    "ensemble": "sweep: {depth: 2 km}\ninitial: {ensemble: 5, seed: 3, spread: 0.1}",
    "refined": "sweep: {depth: {from: 1 km, to: 2 km, points: 4}, wob: [10 klbf, 30 kN], refine: 2}",
    "digits": "sweep: {depth: 2 km}\nbit: {cutting: {c1: 3.3333333333333333e-8, c2: -1e-300}}\n"
    "mud: {density: 1234.5678901234567 kg/m^3}\nclassify: {whirl: {direction: "
    "0.3333333333333333}}",
}


@pytest.mark.parametrize(
    "text",
    [*STUDIES.values(), *(path.read_text() for path in CONFIGS)],
    ids=[*STUDIES, *(path.stem for path in CONFIGS)],
)
def test_it_reads_back_the_same(text: str) -> None:
    study = parse_study(text)
    again = parse_study(study_text(study.resolved))
    assert again.resolved == study.resolved
    assert again.sha256 == study.sha256


@pytest.mark.parametrize("title", ["", "a: b # c", "- a", "null", '"q" \\ \'', "x\ny\t\u2028", "é 漢 \U0001f600"])
def test_any_title(title: str) -> None:
    resolved = {**parse_study("sweep: {depth: 2 km}").resolved, "title": title}
    assert parse_study(study_text(resolved)).title == title


def test_the_head_is_comments() -> None:
    study = parse_study("sweep: {depth: 2 km}")
    text = study_text(study.resolved, ["one", "sweep: {wob: 1 kN}\n- two \x00 three"])
    assert text.startswith("# one\n# sweep: {wob: 1 kN} - two three\ntitle: ")
    assert parse_study(text).sha256 == study.sha256


def test_a_key_that_an_older_version_did_not_have_is_left_out() -> None:
    resolved = parse_study("sweep: {depth: 2 km}").resolved
    del resolved["simulation"]["verify"]
    assert "verify" not in study_text(resolved)


def test_changes_name_keys_and_units_as_a_study_has_them() -> None:
    a = load_study(CONFIGS[0]).resolved
    b = load_study(CONFIGS[0], ["operation.wob=5 klbf", "bit.lobes=1", "sweep.rotary_speed=[60 rpm, 6 rad/s]"]).resolved
    found = dict((key, new) for key, _, new in changes(a, b))
    assert found == {"bit.lobes": "1", "operation.wob": "5 klbf", "sweep.rotary_speed": "[6 rad/s, 60 rpm]"}
    assert value_text(a, "well.stiffness") == "25 MN/m"
    assert value_text(a, "sweep.wob") is None
