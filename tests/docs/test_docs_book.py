"""The book as a whole: every page has its place, it has the length that a reader
finishes, and one thing has one name."""

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
from ruamel.yaml import YAML

from nsdrill.cli.main import COMMANDS, group
from nsdrill.cli.overview import overview
from nsdrill.models.registry import of_all
from nsdrill.study.keys import keys_of

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

# The words of all pages for users, with the generated tables, as ``wc`` counts them.
LONGEST = 50_000
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
    "no room": "no margin",
    "most room": "largest margin",
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
    text = re.sub(r"<!-- table: .*?<!-- end of table -->", "", text, flags=re.DOTALL)
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
    counts = {
        door: sum(len((docs / page).read_text(encoding="utf-8").split()) for page in pages if page.endswith(".md"))
        for door, pages in doors(root).items()
        if door != "Develop"
    }
    counts["README"] = len((root / "README.md").read_text(encoding="utf-8").split())
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
            assert command is not None
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
