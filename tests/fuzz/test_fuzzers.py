"""Both fuzzers for a few seconds; by hand they run for hours."""

from . import files, studies


def test_studies():
    found = studies.run(300, seed=1)
    assert set(found) == {"valid", "refused"}
    assert found["valid"] > 15  # not all are refused


def test_files():
    found = files.run(24, seed=1)
    assert set(found) == {"shown", "refused"}
