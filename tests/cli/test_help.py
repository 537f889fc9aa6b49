"""The help: complete, and quick because it imports nothing heavy; groups, other names of
commands and options, environment variables, JSON that every program reads."""

import ast
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

import nsdrill
from nsdrill.cli.main import group
from nsdrill.cli.overview import COMMANDS, GROUPS
from nsdrill.data import json_text
from nsdrill.models.registry import NAMES
from nsdrill.study.keys import keys_named
from nsdrill.study.load import parse_study
from nsdrill.study.read import parse
from nsdrill.study.write import examples, short_text

HEAVY = ("numba", "h5py", "matplotlib", "pydantic", "scipy", "xarray", "distributed", "ruamel.yaml", "numpy")


def in_a_process(arguments: list[list[str]], what: str, cwd: Path | None = None) -> tuple[str, str]:
    """What commands print that are given one after the other in a process of their own,
    each with the value of the expression ``what`` after it."""
    code = (
        "import sys\n"
        f"for words in {arguments!r}:\n"
        "    sys.argv = ['nsdrill', *words]\n"
        "    from nsdrill.__main__ import main\n"
        "    try: main()\n"
        f"    except SystemExit as end: print('found:', {what})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=cwd)
    return done.stdout, done.stderr


def test_help_imports_nothing_heavy():
    said, faults = in_a_process([[name, "--help"] for name in COMMANDS], f"[m for m in {HEAVY!r} if m in sys.modules]")
    assert said.count("found: []\n") == said.count("Usage: nsdrill ") == len(COMMANDS)
    assert faults == ""


def test_what_is_not_needed_is_not_imported(shared, tmp_path):
    """The first line that is not empty names the command."""
    commands = [
        ["check", "small.yaml"],
        ["show", "small.h5"],
        ["show", "failing.h5", "--json"],
        ["show", "uncertain.h5"],
        ["window", "uncertain.h5"],
        ["window", "map.h5", "--json"],
        ["run", "small.yaml", "--set", "record.poincare=2", "-o", str(tmp_path / "returns.h5")],
        ["run", "small.yaml", "--set", "record.exponent=true", "-o", str(tmp_path / "exponent.h5")],
        ["simulate", "small.yaml", "--set", "sweep.rotary_speed=3 rad/s", "-o", str(tmp_path / "trace.h5")],
    ]
    heavy = "end.code, [m for m in ('numba', 'scipy', 'matplotlib') if m in sys.modules]"
    said = in_a_process(commands, heavy, shared)[0].splitlines()
    assert [line for line in said if line.startswith("found: ")] == ["found: 0 []"] * len(commands)


def test_an_answer_imports_no_more_than_it_needs(shared):
    """The study of a file is read as it was resolved, and of a known model no packages are searched."""
    commands = [["show", "small.h5"], ["window", "uncertain.h5"], ["window", "map.h5", "--json"]]
    said, _ = in_a_process(
        commands, "[m for m in ('ruamel.yaml', 'numpy.ma', 'importlib.metadata') if m in sys.modules]", shared
    )
    assert said.count("found: []\n") == len(commands)


def test_an_answer_executes_nothing_that_runs_or_compares(shared):
    """A module that is imported late has another type until something of it is used."""
    late = ("models.variant", "models.own_features", "observe.declared", "analysis.comparison", "analysis.contrast")
    executed = f"[m for m in {late!r} if type(sys.modules.get(f'nsdrill.{{m}}')).__name__ == 'module']"
    commands = [["show", "small.h5"], ["window", "map.h5", "--json"]]
    assert in_a_process(commands, executed, shared)[0].count("found: []\n") == len(commands)


def test_a_second_window_executes_nothing_that_computes_of_a_study(shared, tmp_path, monkeypatch):
    """What the study of a file says of its runs is kept (:mod:`nsdrill.app.answering.kept`)."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    computing = (
        "app.check",
        "app.answering.foreseen",
        "app.answering.stick_slip_end",
        "app.answering.window_trials",
        "models.christoforou_yigit.checks",
        "models.christoforou_yigit.critical_speeds",
        "models.variant",
    )
    executed = f"[m for m in {computing!r} if type(sys.modules.get(f'nsdrill.{{m}}')).__name__ == 'module']"
    first, _ = in_a_process([["window", "map.h5"]], executed, shared)
    assert "'app.answering.foreseen'" in first
    assert in_a_process([["window", "map.h5"]], executed, shared)[0] == f"{first.partition('found:')[0]}found: []\n"


def test_the_end_of_a_command_looks_through_nothing():
    """The interpreter looks through all objects at its end but those that are frozen."""
    frozen = "end.code, __import__('gc').get_freeze_count() > 10_000"
    assert in_a_process([["--version"]], frozen)[0].endswith("found: 0 True\n")


def test_the_help_of_all_imports_no_click():
    said, _ = in_a_process([["--help"]], "end.code, 'click' in sys.modules")
    assert said.startswith("Usage: nsdrill")
    assert said.endswith("\nfound: 0 False\n")


def test_a_summary_imports_the_model_of_its_file_only(shared):
    others = [f"nsdrill.{name}" for name in ("models.beam", "models.segments", "models.torsion", "figures.kinds")]
    said, _ = in_a_process([["show", "small.h5"]], f"{{*{others!r}}} & {{*sys.modules}}", shared)
    assert said.endswith("found: set()\n")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_explained(name):
    command = group.get_command(click.Context(group), name)
    assert command.help
    assert f"nsdrill {name}" in command.epilog
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, parameter.name


def test_no_command_prints_the_help(call):
    assert "\nRun:\n" in call(code=2).err


def test_the_options_of_a_picture_stand_in_groups(call):
    """Every one once, under one heading."""
    text = call("plot", "--help").out
    headings = [line for line in text.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert headings[0] == "Options:"
    assert len(headings) > 4
    listed = re.findall(r"^  (?:-\w, )?(--[a-z-]+)", text, re.MULTILINE)
    assert len(listed) == len(set(listed))
    assert {"--kind", "--wob", "--over", "--animate", "--set", "--width"} <= set(listed)


GROUPED = {
    "Run": ["new", "check", "run", "simulate", "replay", "branches", "spectrum"],
    "Look": ["show", "plot", "view", "report"],
    "Decide": ["window", "sensitivity", "fit"],
    "Files": ["diff", "combine", "export", "classify", "cite", "schema"],
}


def test_the_help_has_groups_and_says_what_q_is(call):
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


def test_short_options(shared, call):
    assert call("-V").out == call("--version").out
    answer = call("run", shared / "small.yaml", "-o", "out.h5", "-j", "1", "-q")
    assert answer.err == call("check", shared / "small.yaml").err  # its warnings
    assert answer.err.startswith("Warning: ")
    for name in ("branches", "fit"):
        text = call(name, "--help").out
        assert "-j, --workers N" in text
        assert "-q, --quiet" in text


def test_the_short_study(call):
    text = call("new").out
    assert call("new", "-o", "-").out == text == short_text()
    assert not list(Path().iterdir())
    lines = text.splitlines()
    assert 18 <= len(lines) <= 28
    assert lines[0].startswith("# yaml-language-server: $schema=study.schema.json")
    study = parse_study(text)
    assert (study.swept, study.procedure) == (("rotary_speed",), "up-down")
    call("new", "-o", "study.yaml")
    assert "--overwrite" in call("new", "-o", "study.yaml", code=2).err
    call("new", "-o", "study.yaml", "--overwrite")
    assert Path("study.yaml").read_text(encoding="utf-8") == text
    call("check", "study.yaml")


@pytest.mark.parametrize("model", NAMES)
@pytest.mark.parametrize("units", ["si", "field"])
def test_the_short_study_has_the_defaults_of_its_model(model, units):
    text = short_text(model, units)
    study = parse_study(text)
    assert (study.model.name, study.units) == (model, units)
    plain = parse_study(f"model: {model}\nsweep: {{rotary_speed: [3 rad/s]}}\n")
    keys = keys_named(model)
    for key in keys.leaves:
        section, _, name = key.partition(".")
        if section in ("simulation", "model"):
            continue
        here = study.resolved[section]
        default = plain.resolved[section]
        for part in name.split("."):
            here, default = here[part], default[part]
        if key == "mud.added_mass":
            assert here == "clearance"  # the default is the number of the paper, whatever the hole
            continue
        assert here == (
            default if isinstance(default, str | None | tuple | list) else pytest.approx(default, rel=1e-3)
        ), key


def test_units_of_a_new_study(call, monkeypatch):
    field = call("new", "--units", "field").out
    assert "depth: 16400 ft" in field
    assert "from: 20 rpm" in field
    monkeypatch.setenv("NSDRILL_UNITS", "field")
    assert call("new").out == field
    assert "\nunits: field " in call("new", "--all").out


def test_every_key_is_in_the_long_one(call):
    text = call("new", "--all").out
    assert text.startswith("# yaml-language-server: ")
    data = parse(text, "all").data
    for key in keys_named().leaves:
        inside = data
        for part in key.split("."):
            inside = inside[part]


def test_the_list_of_examples(call):
    rows = dict(line.split(maxsplit=1) for line in call("new", "--list").out.splitlines())
    assert rows.keys() == {*examples()}
    assert rows["torsional_speed"] == "Stick-slip of the torsional model"


def test_labels_may_go_to_a_new_file(shared, call):
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
        (["show", "--un"], ["--units"]),
        (["show", "sm"], ["file,sm"]),  # which the shell completes from the folder
        (["plot", "-o", "pi"], ["file,pi"]),
        (["new", "--example", "tors"], ["torsional_speed"]),
        (["schema", "--model", "seg"], ["segments"]),
        (["plot", "out.h5", "--kind", "bif"], ["bifurcation"]),
        (["run", "--set", "drive.kind=soft"], ["drive.kind=soft_torque"]),
        (["run", "--set", "well.friction.st"], ["well.friction.static="]),
        (["simulate", "--at", "wo"], ["wob="]),
        (["replay", "--at", "bit.rock_"], ["bit.rock_stiffness="]),
        # of a file that is there: what it takes, and nothing else
        (["plot", "{shared}/map.h5", "--at", ""], ["wob=", "rotary_speed="]),
        (["replay", "{shared}/map.h5", "--at", "wob=3kN", "--at", "r"], ["rotary_speed="]),
        (["simulate", "{shared}/small.yaml", "--at", "drive.kind=s"], ["drive.kind=stiff", "drive.kind=soft_torque"]),
        (["simulate", "{shared}/small.yaml", "--at", "drive.i"], [""]),  # the ideal drive has no inertia
        (["plot", "no-such.h5", "--at", "rot"], ["rotary_speed="]),
    ],
)
def test_a_shell_completes_names_and_keys(call, monkeypatch, shared, words, expected):
    words = [word.format(shared=shared) for word in words]
    for name, value in {"COMP_WORDS": " ".join(("nsdrill", *words)), "COMP_CWORD": len(words)}.items():
        monkeypatch.setenv(name, str(value))
    monkeypatch.setenv("_NSDRILL_COMPLETE", "bash_complete")
    assert [line.removeprefix("plain,") for line in call().out.splitlines()] == expected


DOCS = Path(__file__).parents[2] / "docs"
READ = re.compile(r"(?:environ(?:\.\w+\()?\[?|getenv\(|envvar=|_VARIABLE = )\s*[\"'](\w+)[\"']")


def test_every_variable_that_is_read_is_documented():
    sources = [path.read_text(encoding="utf-8") for path in Path(nsdrill.__file__).parent.rglob("*.py")]
    found = {name for text in sources for name in READ.findall(text)}
    assert {"NSDRILL_UNITS", "NSDRILL_LANES", "NSDRILL_DEBUG", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME"} <= found
    page = (DOCS / "commands.md").read_text(encoding="utf-8")
    section = page.partition("\n## Environment\n")[2].partition("\n## ")[0]
    for name in sorted(found):
        assert f"`{name}`" in section, f"docs/commands.md, Environment: {name} is missing"


def test_no_variable_is_read_in_a_way_that_the_test_does_not_see():
    for path in Path(nsdrill.__file__).parent.rglob("*.py"):
        for line in path.read_text(encoding="utf-8").splitlines():
            if re.search(r"\benviron\b(?![,)])|\bgetenv\(", line):  # what is only named reads nothing
                assert READ.search(line), f"{path.name}: {line.strip()}"


def test_undefined_numbers_are_null():
    data = {"a": math.nan, "b": [math.inf, (-math.inf, np.float64("nan"))], "c": np.array([1.0, np.nan]), 3: np.int8(2)}
    assert json.loads(json_text(data)) == {"a": None, "b": [None, [None, None]], "c": [1.0, None], "3": 2}


def test_no_json_is_written_that_may_hold_nan():
    calls = [
        call
        for path in Path(nsdrill.__file__).parent.rglob("*.py")
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and ast.unparse(call.func) in ("json.dumps", "json.dump", "dumps", "dump")
    ]
    assert calls
    for call in calls:
        assert [ast.unparse(word.value) for word in call.keywords if word.arg == "allow_nan"] == ["False"]
