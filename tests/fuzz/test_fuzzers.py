"""The fuzzer for a few seconds; by hand it runs for hours."""

from __future__ import annotations

from . import studies


def test_studies() -> None:
    found = studies.run(250, seed=1)
    assert set(found) == {"valid", "refused"}
    assert found["valid"] > 20
