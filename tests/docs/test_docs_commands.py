"""Every command and option is in commands.md, and the pages show none that does not exist."""

from __future__ import annotations

import re
import shlex
from itertools import pairwise
from pathlib import Path

import click
import pytest

from nsdrill.cli.main import COMMANDS, group
from nsdrill.observe.thresholds import Thresholds
from nsdrill.study.keys import all_leaves, leaves

SHOWN = re.compile(r"^(?:.*&& )?(?:\.venv/bin/)?nsdrill (.+)$")


def command(name: str) -> click.Command:
    found = group.get_command(click.Context(group), name)
    assert found is not None
    return found


def options(name: str) -> set[str]:
    return {text for p in command(name).params if isinstance(p, click.Option) for text in p.opts} | {"-h", "--help"}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_documented(name: str, docs: Path) -> None:
    text = (docs / "commands.md").read_text(encoding="utf-8")
    _, found, rest = text.partition(f"\n### nsdrill {name}\n")
    assert found, f"commands.md has no section on {name}"
    section = rest.partition("\n### ")[0].partition("\n## ")[0]
    for option in options(name) - {"-h", "--help"}:
        assert re.search(rf"`{re.escape(option)}[ `]", section), f"{name} {option}"


def test_every_exit_code_is_documented(docs: Path) -> None:
    text = (docs / "commands.md").read_text(encoding="utf-8")
    for code in (0, 1, 2, 3, 130):
        assert re.search(rf"^\| {code} \|", text, re.MULTILINE)


def test_every_environment_variable_is_documented(root: Path, docs: Path) -> None:
    text = (docs / "commands.md").read_text(encoding="utf-8")
    for source in (root / "src").rglob("*.py"):
        for name in re.findall(r"\b(?:NSDRILL|NUMBA)_[A-Z_]+\b", source.read_text(encoding="utf-8")):
            assert f"`{name}`" in text or name == "NUMBA_DISABLE_JIT", f"{source.name}: {name}"


def shown(text: str) -> list[list[str]]:
    """The command lines of nsdrill in the fenced blocks of a page, as words."""
    found = []
    for language, block in re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        if language != "sh":
            continue
        for line in block.splitlines():
            for part in re.split(r" && | \| |; ", line.split(" #")[0]):
                if match := SHOWN.match(part.strip()):
                    found.append(shlex.split(match[1].split(" > ")[0]))
    return found


def test_examples_use_commands_and_options_that_exist(page: Path) -> None:
    for words in shown(page.read_text(encoding="utf-8")):
        if words[0] == "COMMAND":
            continue
        if words[0].startswith("--"):
            assert words == ["--version"]
            continue
        assert words[0] in COMMANDS, words
        given = {word.split("=")[0] for word in words[1:] if re.match(r"--?[a-z]", word)}
        assert given <= options(words[0]), words
        for before, word in pairwise(words):
            if before == "--set":
                key = word.split("=")[0]
                assert key in all_leaves() or key.startswith("sweep."), words
                if words[0] == "classify":
                    assert key in {leaf.key for leaf in leaves(Thresholds, "classify")}


def test_the_readme_shows_the_main_commands(root: Path) -> None:
    words = {words[0] for words in shown((root / "README.md").read_text(encoding="utf-8"))}
    assert {"new", "check", "run", "show", "plot", "simulate", "replay", "classify", "export"} <= words
