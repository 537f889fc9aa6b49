from functools import partial

import pytest

from .helpers import call_here


@pytest.fixture
def call(capfd, monkeypatch, tmp_path):
    """Gives a command in an empty folder; it succeeds, unless ``code=`` says otherwise."""
    monkeypatch.chdir(tmp_path)
    return partial(call_here, capfd, monkeypatch)
