"""A drive of a script, known while a test runs."""

import importlib
import sys

import pytest

from models.tops import SCRIPT
from nsdrill.models.own_drives import withdraw_drives


@pytest.fixture
def forgets(tmp_path, monkeypatch):
    (tmp_path / "forgets.py").write_text(SCRIPT)
    monkeypatch.syspath_prepend(tmp_path)
    sys.modules.pop("forgets", None)
    importlib.import_module("forgets")
    yield
    withdraw_drives("forgets")
