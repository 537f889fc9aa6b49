"""Sessions of the small studies, opened once."""

from __future__ import annotations

from pathlib import Path

import pytest

from nsdrill.web.session import Session


@pytest.fixture(scope="session")
def session(shared: Path) -> Session:
    return Session(shared / "small.h5")


@pytest.fixture(scope="session")
def of_map(shared: Path) -> Session:
    return Session(shared / "map.h5")
