"""The page of commands names every environment variable that the code reads."""

from __future__ import annotations

import re
from pathlib import Path

import nsdrill

DOCS = Path(__file__).parents[2] / "docs"
READ = re.compile(r"(?:environ(?:\.\w+\()?\[?|getenv\(|envvar=|_VARIABLE = )\s*[\"'](\w+)[\"']")


def test_every_variable_that_is_read_is_documented() -> None:
    sources = [path.read_text(encoding="utf-8") for path in Path(nsdrill.__file__).parent.rglob("*.py")]
    found = {name for text in sources for name in READ.findall(text)}
    assert {"NSDRILL_UNITS", "NSDRILL_LANES", "NSDRILL_DEBUG", "NUMBA_CACHE_DIR", "XDG_CACHE_HOME"} <= found
    page = (DOCS / "commands.md").read_text(encoding="utf-8")
    section = page.partition("\n## Environment\n")[2].partition("\n## ")[0]
    for name in sorted(found):
        assert f"`{name}`" in section, f"docs/commands.md, Environment: {name} is missing"


def test_no_variable_is_read_in_a_way_that_the_test_does_not_see() -> None:
    for path in Path(nsdrill.__file__).parent.rglob("*.py"):
        for line in path.read_text(encoding="utf-8").splitlines():
            if re.search(r"\b(environ|getenv)\b", line):
                assert READ.search(line), f"{path.name}: {line.strip()}"
