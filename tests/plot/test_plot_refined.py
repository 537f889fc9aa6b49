"""Pictures of refined sweeps: an inferred point has a response, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import covered
from model_tables import VARIABLES

from nsdrill.data import Results
from nsdrill.plot import draw
from nsdrill.variables import INFERRED, OK, POINT

SPEEDS, WEIGHTS = np.linspace(1.0, 8.0, 9), np.linspace(1e4, 1e5, 5)


@pytest.fixture
def refined() -> Results:
    """Five weights by nine speeds, of which every other was run; all points bounce and
    whirl forward."""
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
    inferred = refined["status"][0, 0] == INFERRED
    assert inferred.sum() == 30
    np.testing.assert_array_equal(covered(dots[0], refined["rotary_speed"], refined["wob"] / 1e3), inferred)
    assert "paler: inferred (30 of 45)" in words(figure)


@pytest.mark.parametrize(
    ("kind", "said"), [("whirl_kind", "paler: inferred"), ("stick_slip_index", "interpolated between runs")]
)
def test_other_maps_fill_them_from_the_points_around_and_say_so(refined: Results, kind: str, said: str) -> None:
    figure = draw(refined, kind)
    cells = next(c for c in figure.axes[0].collections if c.get_gid() == "cells")
    assert np.all(np.asarray(cells.get_array()) == (1 if kind == "whirl_kind" else 30.0))
    veiled = [c for c in figure.axes[0].collections if c.get_gid() == "inferred"]
    assert bool(veiled) == (kind == "whirl_kind"), "a veil would change the colours of a scale"
    assert f"{said} (30 of 45)" in words(figure)
    assert not any(c.get_hatch() for c in figure.axes[0].collections)


def test_between_points_values_are_linear(refined: Results) -> None:
    """A plane through the points that were run is met at all others, wherever they lie
    between."""
    x, y = np.meshgrid(refined["rotary_speed"], refined["wob"])
    plane = 2.0 * x + 3e-3 * y
    ran = refined["status"][0, 0] == OK
    refined.variables["stick_slip_index"][0, 0] = np.where(ran, plane, np.nan)
    cells = next(c for c in draw(refined, "stick_slip_index").axes[0].collections if c.get_gid() == "cells")
    assert np.asarray(cells.get_array()) == pytest.approx(plane)


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
