"""The groups of the help, the other names of commands and options, what ``new`` writes,
and what a shell completes."""

from __future__ import annotations

from pathlib import Path

import pytest

from nsdrill.cli.overview import COMMANDS, GROUPS
from nsdrill.models.registry import NAMES
from nsdrill.study.keys import keys_named
from nsdrill.study.load import parse_study
from nsdrill.study.read import parse
from nsdrill.study.write import short_text

from .helpers import Call

GROUPED = {
    "Run": ["new", "check", "run", "simulate", "replay", "branches"],
    "Look": ["show", "plot", "view", "report"],
    "Decide": ["window", "sensitivity", "fit"],
    "Files": ["diff", "combine", "export", "classify", "schema"],
}


def test_the_help_has_groups_and_says_what_q_is(call: Call) -> None:
    assert {title: list(commands) for title, commands in GROUPS.items()} == GROUPED
    out = call("--help").out
    places = [out.index(f"\n{title}:\n") for title in GROUPED]
    assert places == sorted(places)
    said = "Q in the help of a command is a number with its unit"
    assert said in out
    assert " continue " not in out
    for name in COMMANDS:
        text = call(name, "--help").out
        assert (said in text) == (" Q " in text.replace(said, "")), name
    assert call("replay", "--help").out.count(said) == 1  # also the second time


def test_the_former_name_of_branches_still_works(call: Call) -> None:
    now, former = call("branches", "--help"), call("continue", "--help")
    assert now.out.replace("nsdrill branches", "") == former.out.replace("nsdrill continue", "").replace(
        "nsdrill branches", ""
    )
    assert call("contine", code=2).err.startswith("Usage")


def test_short_options(shared: Path, call: Call) -> None:
    assert call("-V").out == call("--version").out
    answer = call("run", shared / "small.yaml", "-o", "out.h5", "-j", "1", "-q")
    assert answer.err == ""
    for name in ("branches", "fit"):
        text = call(name, "--help").out
        assert "-j, --workers N" in text
        assert "-q, --quiet" in text


@pytest.mark.parametrize("option", ["--picture", "-o", "--output"])
def test_the_picture_of_the_window_has_three_names(shared: Path, call: Call, option: str) -> None:
    call("window", shared / "small.h5", option, "window.svg")
    assert Path("window.svg").exists()


def test_the_short_study(call: Call) -> None:
    text = call("new").out
    lines = text.splitlines()
    assert 18 <= len(lines) <= 28
    assert lines[0].startswith("# yaml-language-server: $schema=study.schema.json")
    study = parse_study(text)
    assert study.swept == ("rotary_speed",)
    assert study.procedure == "up-down"
    call("new", "-o", "study.yaml")
    assert Path("study.yaml").read_text(encoding="utf-8") == text
    call("check", "study.yaml")


@pytest.mark.parametrize("model", NAMES)
@pytest.mark.parametrize("units", ["si", "field"])
def test_the_short_study_has_the_defaults_of_its_model(model: str, units: str) -> None:
    text = short_text(model, units)
    study = parse_study(text)
    assert (study.model.name, study.units) == (model, units)
    plain = parse_study(f"model: {model}\nsweep: {{rotary_speed: [3 rad/s]}}\n")
    keys = keys_named(model)
    for key in keys.leaves:
        section, _, name = key.partition(".")
        if section in ("simulation", "model"):
            continue
        here: object = study.resolved[section]
        default: object = plain.resolved[section]
        for part in name.split("."):
            here, default = here[part], default[part]  # type: ignore[index]
        assert here == (
            default if isinstance(default, str | None | tuple | list) else pytest.approx(default, rel=1e-3)
        ), key


def test_units_of_a_new_study(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    field = call("new", "--units", "field").out
    assert "depth: 16400 ft" in field
    assert "from: 20 rpm" in field
    monkeypatch.setenv("NSDRILL_UNITS", "field")
    assert call("new").out == field
    assert "\nunits: field " in call("new", "--all").out


def test_every_key_is_in_the_long_one(call: Call) -> None:
    text = call("new", "--all").out
    assert text.startswith("# yaml-language-server: ")
    data = parse(text, "all").data
    for key in keys_named().leaves:
        inside = data
        for part in key.split("."):
            inside = inside[part]


def test_the_list_of_examples(call: Call) -> None:
    out = call("new", "--list").out
    assert "  torsional_speed            Stick-slip of the torsional model\n" in out
    for line in out.splitlines():
        call("new", "--example", line.split()[0])
    assert "one of the two" in call("new", "--all", "--example", "torsional_speed", code=2).err


def test_labels_may_go_to_a_new_file(shared: Path, call: Call) -> None:
    before = (shared / "small.h5").read_bytes()
    words = ["--set", "classify.stick_slip.stick_slip_index=1"]
    assert "new.h5: written." in call("classify", shared / "small.h5", *words, "-o", "new.h5").err
    assert (shared / "small.h5").read_bytes() == before
    assert "stick_slip_index" in call("show", "new.h5").out
    assert "--overwrite" in call("classify", shared / "small.h5", *words, "-o", "new.h5", code=2).err
    call("classify", shared / "small.h5", *words, "-o", "new.h5", "--overwrite")
    call("classify", "new.h5", "-o", "new.h5", "--overwrite", code=2)
    call("diff", shared / "small.h5", "new.h5")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["b"], ["branches"]),
        (["new", "--example", "tors"], ["torsional_speed"]),
        (["schema", "--model", "seg"], ["segments"]),
        (["plot", "out.h5", "--kind", "bif"], ["bifurcation"]),
        (["run", "--set", "drive.kind=soft"], ["drive.kind=soft_torque"]),
        (["run", "--set", "well.friction.st"], ["well.friction.static="]),
        (["simulate", "--at", "wo"], ["wob="]),
        (["replay", "--at", "bit.rock"], ["bit.rock_stiffness="]),
    ],
)
def test_a_shell_completes_names_and_keys(
    call: Call, monkeypatch: pytest.MonkeyPatch, words: list[str], expected: list[str]
) -> None:
    for name, value in {"COMP_WORDS": " ".join(("nsdrill", *words)), "COMP_CWORD": len(words)}.items():
        monkeypatch.setenv(name, str(value))
    monkeypatch.setenv("_NSDRILL_COMPLETE", "bash_complete")
    assert [line.partition(",")[2] for line in call().out.splitlines()] == expected
