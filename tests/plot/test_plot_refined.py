"""Pictures of refined sweeps: an inferred point has a response, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from model_tables import VARIABLES

from nsdrill.data import Results
from nsdrill.plot import draw
from nsdrill.variables import INFERRED, OK, POINT

SPEEDS, WEIGHTS = np.linspace(1.0, 8.0, 9), np.linspace(1e4, 1e5, 5)


@pytest.fixture
def refined() -> Results:
    """Five weights by nine speeds, of which every other was run; all points bounce and whirl forward."""
    coords = {
        "procedure": np.array(["same"]),
        "depth": np.array([5000.0]),
        "wob": WEIGHTS,
        "rotary_speed": SPEEDS,
        "peak": np.arange(2),
    }
    shape = (1, 1, 5, 9)
    ran = np.zeros(shape, dtype=bool)
    ran[..., ::2, ::2] = True
    variables = {
        v.name: np.where(ran, 30.0, np.nan) if v.dtype == "f8" else np.where(ran, 1, 0)
        for v in VARIABLES
        if v.dims == POINT and v.only is None
    }
    variables["status"] = np.where(ran, OK, INFERRED)
    variables["response"] = np.full(shape, 5)
    for name in ("axial_peaks", "bit_speed_peaks", "radius_peaks"):
        variables[name] = np.where(ran[..., None], np.ones(2), np.nan)
    return Results(coords, variables, {"title": ""})


def words(figure: object) -> str:
    return " | ".join(text.get_text() for text in figure.legends[0].get_texts())  # type: ignore[attr-defined]


def test_a_map_shows_inferred_responses_and_says_so(refined: Results) -> None:
    figure = draw(refined, "map")
    cells = next(c for c in figure.axes[0].collections if c.get_gid() == "cells")
    assert np.all(np.asarray(cells.get_array()) == 5)
    dots = [c for c in figure.axes[0].collections if c.get_gid() == "inferred"]
    assert isinstance(dots[0], PolyCollection)
    assert len(dots[0].get_paths()) == 30
    assert "dotted: inferred (30 of 45)" in words(figure)


@pytest.mark.parametrize("kind", ["whirl_kind", "stick_slip_index"])
def test_other_maps_leave_them_empty_and_say_so(refined: Results, kind: str) -> None:
    figure = draw(refined, kind)
    cells = next(c for c in figure.axes[0].collections if c.get_gid() == "cells")
    assert np.ma.count(np.ma.asarray(cells.get_array())) == 15
    assert "not run, inferred responses (30 of 45)" in words(figure)


@pytest.mark.parametrize("kind", ["summary", "bifurcation"])
def test_along_one_axis_the_strip_is_whole_and_curves_pass_over_them(refined: Results, kind: str) -> None:
    figure = draw(refined, kind, at={"wob": WEIGHTS[0]})
    strip = next(c for c in figure.axes[0].collections if c.get_gid() == "strip")
    assert np.ma.count(np.ma.asarray(strip.get_array())) == 9
    for axes in figure.axes[1:]:
        for line in axes.get_lines():
            if str(line.get_gid()).split(":")[0] in refined.variables:
                assert len(set(np.asarray(line.get_xdata()))) == 5
                assert np.all(np.isfinite(line.get_ydata()))
