"""The help: complete, and quick because it imports nothing heavy."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

from nsdrill.cli.main import group
from nsdrill.cli.overview import COMMANDS

from .helpers import Call

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


def test_help_imports_nothing_heavy() -> None:
    said, faults = in_a_process([[name, "--help"] for name in COMMANDS], f"[m for m in {HEAVY!r} if m in sys.modules]")
    assert said.count("found: []\n") == said.count("Usage: nsdrill ") == len(COMMANDS)
    assert faults == ""


@pytest.mark.parametrize(
    "words",
    [
        ["check", "small.yaml"],
        ["show", "small.h5"],
        ["show", "failing.h5", "--json"],
        ["run", "small.yaml", "--set", "record.poincare=2", "-o"],
        ["run", "small.yaml", "--set", "record.exponent=true", "-o"],
        ["simulate", "small.yaml", "--set", "sweep.rotary_speed=3 rad/s", "-o"],
    ],
)
def test_what_is_not_needed_is_not_imported(shared: Path, tmp_path: Path, words: list[str]) -> None:
    if words[-1] == "-o":
        words = [*words, str(tmp_path / "out.h5")]
    heavy = "[m for m in ('numba', 'scipy', 'matplotlib') if m in sys.modules]"
    assert in_a_process([words], heavy, shared)[0].endswith("found: []\n")


def test_the_help_of_all_imports_no_click() -> None:
    said, _ = in_a_process([["--help"]], "end.code, 'click' in sys.modules")
    assert said.startswith("Usage: nsdrill")
    assert said.endswith("\nfound: 0 False\n")


def test_a_summary_imports_the_model_of_its_file_only(shared: Path) -> None:
    others = [f"nsdrill.{name}" for name in ("models.beam", "models.segments", "models.torsion", "plot")]
    said, _ = in_a_process([["show", "small.h5"]], f"{{*{others!r}}} & {{*sys.modules}}", shared)
    assert said.endswith("found: set()\n")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_explained(name: str) -> None:
    command = group.get_command(click.Context(group), name)
    assert command is not None
    assert command.help
    assert command.epilog is not None
    assert f"nsdrill {name}" in command.epilog
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, parameter.name


def test_group_help_names_commands_and_exit_codes(call: Call) -> None:
    answer = call("--help")
    for name, line in COMMANDS.items():
        assert name in answer.out
        assert line.split()[0] in answer.out
    for code in ("0 ", "1 ", "2 ", "3 ", "130 "):
        assert f"\n    {code}" in answer.out


def test_version(call: Call) -> None:
    import nsdrill

    assert call("--version").out == f"nsdrill {nsdrill.__version__}\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["rnu"], "Did you mean run?"),
        (["xyz"], "There is no command 'xyz'. Commands: new, check"),
        (["run"], "Missing argument 'STUDY'"),
        (["run", "a.yaml"], "Missing option '-o'"),
        (["run", "a.yaml", "-o", "b.h5", "--resumee"], "Did you mean '--resume'"),
        (["run", "a.yaml", "-o", "b.h5", "--workers", "0"], "x>=1"),
        (["run", "a.yaml", "-o", "b.h5", "--engine", "mpi"], "'threads', 'dask'"),
        (["run", "a.yaml", "b.h5", "-o", "c.h5"], "unexpected extra argument"),
        (["plot", "a.h5"], "Missing option '-o'"),
        (["replay", "a.h5", "-o", "b.h5", "--procedure", "sideways"], "'same', 'up', 'down'"),
        (["show", ""], "found ''; allowed: the name of a file"),
        (["show", "--output"], "No such option"),
    ],
)
def test_wrong_command_lines(call: Call, words: list[str], said: str) -> None:
    answer = call(*words, code=2)
    assert answer.out == ""
    assert said in answer.err
    assert "--help' for help" in answer.err


def test_no_command_prints_the_help(call: Call) -> None:
    assert "\nRun:\n" in call(code=2).err


def test_the_options_of_a_picture_stand_in_groups(call: Call) -> None:
    """Every one once, under one heading."""
    text = call("plot", "--help").out
    headings = [line for line in text.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert headings[0] == "Options:"
    assert len(headings) > 4
    listed = re.findall(r"^  (?:-\w, )?(--[a-z-]+)", text, re.MULTILINE)
    assert len(listed) == len(set(listed))
    assert {"--kind", "--wob", "--over", "--animate", "--set", "--width"} <= set(listed)
