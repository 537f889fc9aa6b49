"""Every command and option is in commands.md, and the pages show none that does not
exist."""

import re
import shlex
from itertools import pairwise

import click
import numpy as np
import pytest

from nsdrill.app.arguments import values_in
from nsdrill.app.experiment import prepare
from nsdrill.app.run import check_sweep, header_of
from nsdrill.cli.main import COMMANDS, group
from nsdrill.data import Results
from nsdrill.plot import needed
from nsdrill.store import MemoryLog
from nsdrill.store.results import coordinates
from nsdrill.study import Study, change_thresholds, parse_study, short_text, template_text
from nsdrill.study.keys import keys_named
from nsdrill.variables import AXES

SHOWN = re.compile(r"^(?:.*&& )?(?:\.venv/bin/)?nsdrill (.+)$")


def command(name: str) -> click.Command:
    found = group.get_command(click.Context(group), name)
    assert found is not None
    return found


def options(name: str) -> set[str]:
    return {text for p in command(name).params if isinstance(p, click.Option) for text in p.opts} | {"-h", "--help"}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_documented(name, docs):
    text = (docs / "commands.md").read_text(encoding="utf-8")
    _, found, rest = text.partition(f"\n### nsdrill {name}\n")
    assert found, f"commands.md has no section on {name}"
    section = rest.partition("\n### ")[0].partition("\n## ")[0]
    for option in options(name) - {"-h", "--help"}:
        assert re.search(rf"`{re.escape(option)}[ `]", section), f"{name} {option}"


def test_every_exit_code_is_documented(docs):
    text = (docs / "commands.md").read_text(encoding="utf-8")
    for code in (0, 1, 2, 3, 130):
        assert re.search(rf"^\| {code} \|", text, re.MULTILINE)


def test_every_environment_variable_is_documented(root, docs):
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


def test_examples_use_commands_and_options_that_exist(page):
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
                assert key in keys_named().leaves or key.startswith(("sweep.", "continue.", "uncertain.")), words
                if words[0] == "classify":
                    assert key in {leaf.key for leaf in keys_named().of("classify")}


def outline(study: Study) -> Results:
    """What the results of ``study`` would hold, without numbers."""
    experiment = prepare(study)
    plan, kept = experiment.plan, experiment.kept
    log = MemoryLog(header_of(experiment), plan.points, kept)
    zeros = np.broadcast_to(np.int8(0), plan.grid)
    return Results(coordinates(log), {v.name: zeros for v in kept.variables}, log.header["attrs"])


def test_examples_fit_their_studies(page, root, monkeypatch):
    """Every command on a shipped study, on that of ``nsdrill new``, or on results that
    the page makes of one. Nothing is run: a picture fits its file or not by what the
    study records."""
    monkeypatch.chdir(root)
    studies, sweeps = ({str(path.relative_to(root)): path.read_text() for path in root.glob("configs/*.yaml")}, {})
    for words in shown(page.read_text(encoding="utf-8")):
        if words[0] not in COMMANDS:
            continue
        given = command(words[0]).make_context(words[0], [word for word in words[1:] if word != "&"]).params
        if words[0] == "new" and given["output"]:
            example = (given["example"] or "").replace("-", "_")
            studies[given["output"]] = (
                studies[f"configs/{example}.yaml"] if example else (template_text if given["all"] else short_text)()
            )
        if given.get("study") in studies:
            study = parse_study(studies[given["study"]], given["study"], given["set"])
            if words[0] == "run":
                check_sweep(study)
                sweeps[given["path"]] = study
        study = sweeps.get(given.get("file") or given.get("data") or given.get("results"))
        at = values_in(
            [text.split("=") for text in given.get("at") or ()], None, **{name: given.get(name) for name in AXES}
        )
        if study is None:
            continue
        if words[0] == "plot" and given["kind"] != "list":
            needed(outline(study), given["kind"], at, given["start"])
        elif words[0] == "replay":
            wanted = {name: at.get(name, float(study.axes[name][0])) for name in AXES}
            assert all(name in at or len(study.axes[name]) == 1 for name in AXES), words
            plan = prepare(study).plan
            procedure = given["procedure"] or plan.procedures[0]
            plan.find(wanted, procedure, given["start"] or 0, int(at.get("sample", 0)))
        elif words[0] == "classify":
            change_thresholds(study.thresholds, (given.get("set") or given.get("changes") or ()))


def test_the_readme_shows_the_main_commands(root):
    words = {words[0] for words in shown((root / "README.md").read_text(encoding="utf-8"))}
    assert {"new", "check", "run", "show", "plot", "simulate", "replay", "classify", "export"} <= words
