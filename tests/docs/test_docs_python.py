"""The page for Python users: its examples run, and no public name is missing or
undocumented."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import nsdrill
from nsdrill import api

FUNCTIONS = [name for name in nsdrill.__all__ if name.islower()]
CLASSES = [name for name in nsdrill.__all__ if not name.islower()]


def test_the_examples_run_one_after_the_other(docs: Path, run_python: Any, tmp_path: Path) -> None:
    page = (docs / "from_python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)
    assert len(blocks) >= 8
    said = run_python("\n".join(blocks))
    assert "operation.wob: found the number 30 without a unit" in said
    assert "Dataset: results of a sweep" in said
    assert {path.name for path in tmp_path.iterdir()} == {"out.h5", "peaks.png", "page.png", "trace.h5", "table.csv"}


def test_every_public_name_is_on_the_page(docs: Path) -> None:
    page = (docs / "python.md").read_text(encoding="utf-8")
    for name in FUNCTIONS:
        assert f"\n### {name}\n" in page, name
    for name in CLASSES:
        assert f"| `nsdrill.{name}` | " in page, name


def test_every_argument_is_in_its_docstring() -> None:
    for name in FUNCTIONS:
        function = getattr(api, name)
        for argument in inspect.signature(function).parameters:
            if argument not in ("results", "data", "study"):
                words = rf"(?m)^ *(\w+, )*{argument}(, \w+)* : "
                assert re.search(words, function.__doc__), (name, argument)
    for name in CLASSES:
        assert getattr(nsdrill, name).__doc__, name


def test_the_names_of_arguments_are_explained(docs: Path) -> None:
    page = (docs / "python.md").read_text(encoding="utf-8").partition("<!-- table: python classes")[0]
    signatures = "".join(str(inspect.signature(getattr(api, name))) for name in FUNCTIONS)
    for alias in set(re.findall(r"\b(?:\w+Like|Quantity|Settings)\b", signatures)):
        assert f"`{alias}`" in page, alias


def test_annotations_say_what_the_checker_knows() -> None:
    """The names that the package gives are those that it is typed with."""
    text = Path(nsdrill.__file__).read_text(encoding="utf-8")
    typed = text.partition("if TYPE_CHECKING:")[2].partition("__version__")[0]
    assert set(re.findall(r"\w+", typed)) - {"from", "import", "nsdrill", "api", "errors"} == set(nsdrill.__all__)
