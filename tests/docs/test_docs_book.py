"""The book as a whole: its places and its length; commands and tables are those of the code."""

import re
import shlex
import struct
import warnings
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from model_tables import FEATURES, TRACE_VARIABLES
from ruamel.yaml import YAML

from nsdrill.app.conversion import values_in
from nsdrill.app.experiment import prepare, provenance
from nsdrill.app.running.run import check_sweep, header_of
from nsdrill.cli.main import COMMANDS, group
from nsdrill.cli.overview import overview
from nsdrill.data import Results
from nsdrill.figures import needed
from nsdrill.models.registry import BY_NAME, NAMES, of_all
from nsdrill.store import MemoryLog, hdf5
from nsdrill.store.layout import root_attributes
from nsdrill.store.results import coordinates
from nsdrill.study import Study, change_thresholds, parse_study, short_text, template_text
from nsdrill.study.keys import keys_named, keys_of
from nsdrill.variables import AXES

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

# The words that people wrote on all pages for users, as ``wc`` counts them: a generated
# table grows with what the program can do, not with what a reader must read through.
LONGEST = 51_500
GENERATED = re.compile(
    r"<!-- (?:table|measured): .*?<!-- end of table -->|<!-- result: .*?<!-- end of result -->"
    r"|<!-- verify -->.*?<!-- end of verify -->",
    re.DOTALL,
)
# What stands in no page, and what stands there instead: one thing has one name.
OTHERWISE = {
    "top speed": "rotary speed",
    "safe window": "operating window",
    "window of safety": "operating window",
    "set point speed": "set speed",
    "history dependent": "history-dependent",
    "stabilizers": "stabilisers",
    "hangs on": "depends on",
    "throws back": "reflects",
    "not told": "not determined",
    "told apart": "distinguished",
    "thrown back": "reflected",
    "the same for programs": "print JSON",
    "may run whatever": "is safe whatever",
    "and not through its input": "for a reason other than its input",
    "of so many": "number of",
    "pass over": "ignore, leave out",
    "passed over": "ignored, left out",
    "the very same": "the same",
    "interplay": "together with the others",
}
# Words that stand in no page, help or description at all, whatever stands around them.
NEVER = re.compile(r"\b(told|hangs?)\b(?! vertical)", re.IGNORECASE)


def doors(root: Path) -> dict[str, list[str]]:
    """The pages of each door, as the site has them."""

    def pages(entry: Any) -> list[str]:
        if isinstance(entry, str):
            return [entry]
        parts = entry.values() if isinstance(entry, dict) else entry
        return [page for part in parts for page in pages(part)]

    text = (root / "mkdocs.yml").read_text(encoding="utf-8")
    nav = YAML(typ="safe").load(text)["nav"]
    return {name: pages(entry) for door in nav for name, entry in door.items()}


def for_users(docs: Path) -> list[Path]:
    return [page for page in sorted(docs.rglob("*.md")) if "dev" not in page.parts]


def spoken(text: str) -> str:
    """What a page says itself: without generated tables, blocks, code, links' addresses
    and titles of works."""
    text = GENERATED.sub("", text)
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`]*`|\]\([^)]*\)|\"[^\"]*\"", "", text)


def test_every_page_is_in_the_site_once(root, docs):
    named = [page for pages in doors(root).values() for page in pages]
    there = [str(page.relative_to(docs)) for page in docs.rglob("*") if page.suffix in (".md", ".ipynb")]
    assert sorted(named) == sorted([*there, "changes.md"])  # which make_site.py makes of CHANGELOG.md
    assert list(doors(root))[:6] == ["Start", "Learn", "Do", "Understand", "Look up", "Evidence"]


def test_the_readme_has_every_page_for_users(root, docs):
    text = (root / "README.md").read_text(encoding="utf-8")
    for page in for_users(docs):
        assert f"](docs/{page.name}" in text, page.name


def test_the_book_is_short_enough_to_be_finished(root, docs):
    """The words by door are printed with ``pytest -s``, and all of them with ``-rw``."""

    def words(page: Path) -> int:
        return len(GENERATED.sub("", page.read_text(encoding="utf-8")).split())

    counts = {
        door: sum(words(docs / page) for page in pages if page.endswith(".md"))
        for door, pages in doors(root).items()
        if door != "Develop"
    }
    counts["README"] = words(root / "README.md")
    total = sum(counts.values())
    print(f"\nwords for users: {total} of {LONGEST};", counts)
    assert total <= LONGEST
    if counts["README"] > 900:
        warnings.warn(f"README has {counts['README']} words", stacklevel=1)


def helps() -> Iterator[tuple[str, str]]:
    """The help of every command, and the meaning of every key of every model."""
    with click.Context(group, info_name="nsdrill") as parent:
        for name in COMMANDS:
            command = group.get_command(parent, name)
            with click.Context(command, info_name=name, parent=parent) as context:
                yield f"nsdrill {name}", command.get_help(context)
    yield "nsdrill", overview(100)
    for page in for_users(DOCS):
        for number, table in enumerate(
            re.findall(r"<!-- table: .*?<!-- end of table -->", page.read_text(), re.DOTALL)
        ):
            yield f"table {number} of {page.name}", re.sub(r"`[^`]*`", "", table)
    for _, keys in of_all(keys_of):
        yield from keys.meanings.items()


@pytest.fixture(scope="module")
def everything():
    """Pages, helps and descriptions in lower case, each on one line."""
    pages = {page.name: spoken(page.read_text(encoding="utf-8")) for page in [*for_users(DOCS), ROOT / "README.md"]}
    return {name: " ".join(text.lower().split()) for name, text in [*pages.items(), *helps()]}


@pytest.mark.parametrize("wrong", OTHERWISE)
def test_one_thing_has_one_name(wrong, everything):
    for name, text in everything.items():
        assert wrong not in text, f"{name}: {wrong}; write {OTHERWISE[wrong]}"


def test_no_word_has_a_sense_of_its_own(everything):
    for name, text in everything.items():
        if name != "segments.top":  # which a string does hang from
            assert not (found := NEVER.search(text)), f"{name}: {text[max(found.start() - 60, 0) : found.end() + 60]}"


def test_every_word_of_the_glossary_stands_once(docs):
    text = (docs / "glossary.md").read_text(encoding="utf-8").partition("## Symbols")[0]
    words = re.findall(r"^\| ([^|]+) \| ", text, re.MULTILINE)[2:]
    assert len(words) == len(set(words)) > 35
    assert words == sorted(words, key=str.lower)


def test_formulas_can_be_drawn(docs, make_site):
    """Those of all pages, without a network."""
    site = make_site
    for page in for_users(docs):
        for formula in site.BLOCK.findall(page.read_text(encoding="utf-8")):
            assert "<path" in site.drawn(formula), page.name


SHOWN = re.compile(r"^(?:.*&& )?(?:\.venv/bin/)?nsdrill (.+)$")


def command(name: str) -> click.Command:
    found = group.get_command(click.Context(group), name)
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
    plan, kept = experiment.plan, experiment.contents
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
        if "--with" in words:  # of a script of the reader
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


def test_tables_are_up_to_date(page, tables):
    """Else: python docs/make_tables.py."""
    text = page.read_text(encoding="utf-8")
    assert tables.filled(text) == text


def test_every_table_is_in_a_page(docs, tables):
    pages = [page.read_text(encoding="utf-8") for page in docs.rglob("*.md")]
    found = {name for text in pages for _, name, _ in tables.BLOCK.findall(text)}
    assert found == set(tables.TABLES)


def test_every_key_of_the_study_is_documented(docs):
    text = (docs / "study.md").read_text(encoding="utf-8")
    sweep = ("depth", "wob", "rotary_speed", "procedure", "along")
    every = {key for model in NAMES for key in keys_named(model).leaves}
    for key in (*every, *(f"sweep.{name}" for name in sweep)):
        assert f"`{key}`" in text, key


def test_every_feature_and_threshold_is_defined(docs):
    variables = (docs / "file_format.md").read_text(encoding="utf-8")
    for name in FEATURES:
        assert f"`{name}`" in variables, name
    keys = (docs / "study.md").read_text(encoding="utf-8")
    for leaf in keys_named().of("classify"):
        assert f"`{leaf.key}`" in keys, leaf.key
    text = (docs / "responses.md").read_text(encoding="utf-8")
    for name in ("response", "whirl_kind", "stick_slip_severity"):
        for word in (BY_NAME[name].flag_meanings or "").split():
            assert f"`{word}`" in text, word


def test_every_variable_and_attribute_of_the_files_is_documented(docs):
    text = (docs / "file_format.md").read_text(encoding="utf-8")
    for name in (*BY_NAME, *(v.name for v in TRACE_VARIABLES)):
        assert f"`{name}`" in text, name
    for name in root_attributes("results", provenance(parse_study("sweep: {depth: 2 km}"), "run")):
        assert f"`{name}`" in text, name


def test_every_status_is_explained(docs):
    text = (docs / "file_format.md").read_text(encoding="utf-8")
    for value, word in enumerate((BY_NAME["status"].flag_meanings or "").split()):
        assert f"| {value} | `{word}` |" in text


def test_the_seal_is_as_the_page_says(docs):
    text = " ".join((docs / "file_format.md").read_text(encoding="utf-8").split())
    assert f"a seal of {hdf5._SEAL.size} bytes: the magic `nsdrill\\x1a`" in text
    assert hdf5._SEAL_MAGIC == b"nsdrill\x1a"
    assert struct.calcsize("<8sQ32s") == hdf5._SEAL.size
