"""The known answers of the verification page, measured anew."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType


def test_known_answers(case: str, verify: ModuleType) -> None:
    rows = list(verify.CASES[case]())
    assert rows
    for row in rows:
        assert row.good, f"{row.quantity}: expected {row.expected}, measured {row.measured}, allowed {row.allowed}"


def test_the_page_has_every_row(verify: ModuleType, docs: Path) -> None:
    """Else: python docs/verify.py --markdown, into the page."""
    text = (docs / "verification.md").read_text(encoding="utf-8")
    for row in verify.CASES["string"]():
        assert f"| {row.quantity} | {row.expected:.10g} | {row.measured:.10g} |" in text
