from __future__ import annotations

from pathlib import Path

import pytest

from .helpers import Answer, Call, call_here


@pytest.fixture
def call(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Call:
    """Gives a command in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def give(*words: object) -> Answer:
        return call_here(capfd, monkeypatch, *words)

    return give
