"""The studies on the page of ramps are valid and are ramps."""

from __future__ import annotations

import re
from pathlib import Path

from nsdrill.study import parse_study


def test_studies_of_the_page_are_ramps(docs: Path) -> None:
    text = (docs / "ramps.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 3
    for text in blocks:
        assert parse_study(text).ramped
