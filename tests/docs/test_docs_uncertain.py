"""The page of uncertain numbers: its studies are valid, its Python runs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from nsdrill.study import parse_study


def test_studies_of_the_page_are_valid(docs: Path) -> None:
    text = (docs / "uncertain.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert [parse_study(block).samples for block in blocks] == [256, 3]


def test_python_of_the_page_runs(docs: Path, run_python: Any) -> None:
    text = (docs / "uncertain.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    run_python(block)
