"""What a picture is drawn from is read, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from nsdrill.app.datasets import outline
from nsdrill.app.datasets import read_any as read
from nsdrill.data import Results
from nsdrill.plot import draw, kinds_for, needed
from nsdrill.store import read_results

WIDE = ("bifurcation", "summary", "map", "whirl_kind", "stick_slip_index", "lift_off", "radius_max")


@pytest.mark.parametrize("name", ["small", "map"])
def test_every_kind_can_be_drawn_from_the_variables_it_needs(shared: Path, name: str) -> None:
    path = str(shared / f"{name}.h5")
    whole, seen = read(path), outline(path)
    assert isinstance(seen, Results)
    assert kinds_for(seen) == kinds_for(whole)
    assert set(seen.variables) == set(read_results(path).variables)
    for kind in (kind for kind in kinds_for(seen) if kind in WIDE):
        names = needed(seen, kind)
        data = read(path, names)
        assert isinstance(data, Results)
        assert set(data.variables) == set(names)
        draw(data, kind)


def test_a_cut_decides_what_is_needed(shared: Path) -> None:
    seen = outline(str(shared / "map.h5"))
    assert isinstance(seen, Results)
    assert "axial_peaks" not in needed(seen)
    assert "axial_peaks" in needed(seen, at={"wob": 20e3})
