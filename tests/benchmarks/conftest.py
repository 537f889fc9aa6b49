"""The benchmarks are a package beside the tests, whose folder has the same name."""

import sys
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def benchmarks_are_found(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    for name in [name for name in sys.modules if name.partition(".")[0] == "benchmarks"]:
        monkeypatch.delitem(sys.modules, name)
