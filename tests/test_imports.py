"""Modules import in one direction, and each has a name of its own."""

import ast
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

import nsdrill

ROOT = Path(nsdrill.__file__).parent
# The parts that several models have, each under one name.
PARTS = {"checks", "columns", "description", "drives", "equations", "model", "observed", "parameters"}


def name_of(file: Path) -> str:
    parts = file.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {name_of(file): file for file in sorted(ROOT.rglob("*.py"))}


def imported(name: str) -> set[str]:
    """The modules that a module imports: at its head, in functions, for annotations."""
    found = set()
    for node in ast.walk(ast.parse(FILES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}, line {node.lineno}: imports are absolute"
            whole = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {one if one in FILES else str(node.module) for one in whole}
    return (found & FILES.keys()) - {name}


def circles(imports: dict[str, set[str]]) -> Iterator[set[str]]:
    """The largest sets of modules of which each imports every other, by way of others."""
    reached = {name: _all_from(name, imports) for name in imports}
    rest = set(imports)
    while rest:
        name = min(rest)
        circle = {other for other in reached[name] if name in reached[other]} | {name}
        rest -= circle
        if len(circle) > 1:
            yield circle


def _all_from(name: str, imports: dict[str, set[str]]) -> set[str]:
    found: set[str] = set()
    waiting = [name]
    while waiting:
        for other in imports[waiting.pop()] - found:
            found.add(other)
            waiting.append(other)
    return found


def test_circles_are_found():
    imports = {"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": set(), "e": {"f"}, "f": {"e", "a"}}
    assert list(circles(imports)) == [{"b", "c"}, {"e", "f"}]


def test_no_modules_import_each_other():
    assert [sorted(circle) for circle in circles({name: imported(name) for name in FILES})] == []


def test_only_the_parts_of_models_share_a_name():
    files: dict[str, list[str]] = {}
    for file in FILES.values():
        if not file.stem.startswith("__"):
            files.setdefault(file.stem, []).append(file.relative_to(ROOT).as_posix())
    shared = {name: places for name, places in files.items() if len(places) > 1}
    assert shared.keys() == PARTS
    elsewhere = [place for places in shared.values() for place in places if not fnmatch(place, "models/*/*.py")]
    assert not elsewhere, f"the name of a part of a model belongs to the packages of models: {elsewhere}"
