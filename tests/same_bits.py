"""Whether two results files hold the same."""

from pathlib import Path

from nsdrill.store import read_results


def different(one: Path, two: Path) -> list[str]:
    """Names of the variables and coordinates that differ in any bit."""
    a, b = read_results(one), read_results(two)
    assert list(a.variables) == list(b.variables)
    assert list(a.coords) == list(b.coords)
    return [name for name in (*a.variables, *a.coords) if a[name].tobytes() != b[name].tobytes()]
