"""Files and functions that pages and docstrings name are there."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import nsdrill

ROOT = Path(nsdrill.__file__).parent
TREE = Path(__file__).parents[2]
PAGES = [TREE / "CONTRIBUTING.md", *sorted((TREE / "docs").rglob("*.md"))]
FILES = [
    file.relative_to(TREE).as_posix()
    for top in ("src", "tests", "docs", "benchmarks", "configs")
    for file in (TREE / top).rglob("*")
    if "__pycache__" not in file.parts
] + ["configs"]
NAMED = re.compile(r"`((?:[\w.<>*-]+/)*[\w.<>*-]+(?:\.py|\.js|/))`")
ROLE = re.compile(r":(?:class|func|meth|attr|data|mod):`[~.]?([\w.]+)`")


def missing_files(text: str, files: list[str]) -> Iterator[str]:
    """The files and folders that a text names, and that are in no folder: the end of a path
    is enough, and ``*`` and ``<model>`` stand for one name."""
    for name in NAMED.findall(text):
        pattern = "".join("[^/]+" if part.startswith(("*", "<")) else re.escape(part) for part in _parts(name))
        if not any(re.search(f"(^|/){pattern}$", file) for file in files):
            yield name


def _parts(name: str) -> list[str]:
    return re.split(r"(<\w+>|\*)", name.rstrip("/"))


@cache
def defined(file: Path) -> frozenset[str]:
    """All names that a file defines, anywhere, or imports."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            found.add(node.id if isinstance(node, ast.Name) else node.attr)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {alias.asname or alias.name for alias in node.names}
    return frozenset(found)


def module_of(target: str) -> tuple[Path | None, list[str]]:
    """The file of the module that a name with dots begins with, and what follows it."""
    parts = target.split(".")
    for n in range(len(parts), 0, -1):
        place = ROOT.parent.joinpath(*parts[:n])
        for file in (place.with_suffix(".py"), place / "__init__.py"):
            if file.exists():
                return file, parts[n:]
    return None, parts


def unknown_roles(file: Path, text: str) -> Iterator[str]:
    """The targets of roles such as ``:func:`` in a file that are nowhere: without the name
    of a module they are in the file, public, or a module beside it."""
    for target in ROLE.findall(text):
        if target.startswith("nsdrill."):
            module, rest = module_of(target)
            if module is None or (rest and not set(rest) <= defined(module)):
                yield target
        elif (first := target.split(".")[0]) not in defined(file) | {"scipy", "matplotlib", "dataclasses"}:
            beside = any((file.parent / name).exists() for name in (first, f"{first}.py"))
            if not beside and first not in nsdrill.__all__:
                yield target


@pytest.mark.parametrize("named_in", PAGES, ids=lambda file: file.name)
def test_files_that_a_page_names_are_there(named_in):
    found = set(missing_files(named_in.read_text(encoding="utf-8"), FILES))
    assert not found, f"{named_in.name} names files that are not there"


def test_functions_that_docstrings_name_are_there():
    texts = {file: file.read_text(encoding="utf-8") for file in sorted(ROOT.rglob("*.py"))}
    found = [f"{file.relative_to(ROOT)}: {one}" for file, text in texts.items() for one in unknown_roles(file, text)]
    assert not found, "docstrings name what is not there"


def test_what_is_missing_is_found():
    files = ["src/nsdrill/kernel/loop.py", "src/nsdrill/models/beam/equations.py", "src/nsdrill/kernel"]
    text = "`loop.py` `kernel/loop.py` `models/<model>/equations.py` `models/*/equations.py` `kernel/` `sweep/loop.py`"
    assert list(missing_files(text, files)) == ["sweep/loop.py"]
    here = ROOT / "abi.py"
    text = ":class:`Layout` :func:`nsdrill.abi.aligned_zeros` :func:`nsdrill.abi.nothing_here` :meth:`dimension`"
    assert list(unknown_roles(here, text)) == ["nsdrill.abi.nothing_here", "dimension"]
