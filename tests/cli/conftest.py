from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from .helpers import Call, call_here


@pytest.fixture
def call(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Call:
    """Gives a command in an empty folder; it succeeds, unless ``code=`` says otherwise."""
    monkeypatch.chdir(tmp_path)
    return partial(call_here, capfd, monkeypatch)
