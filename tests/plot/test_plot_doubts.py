"""Checked sweeps: what does not hold is marked where it is, and counted in the legend."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes
from model_tables import VARIABLES

from nsdrill.data import Results
from nsdrill.plot import draw
from nsdrill.variables import INFERRED, OK, POINT

SPEEDS, WEIGHTS = np.linspace(1.0, 8.0, 8), np.linspace(1e4, 1e5, 5)


@pytest.fixture
def checked() -> Results:
    """Of forty points two change response in one of the checks, three change their
    features only, the others agree."""
    coords = {"procedure": np.array(["same"]), "depth": np.array([5000.0]), "wob": WEIGHTS, "rotary_speed": SPEEDS}
    shape = (1, 1, 5, 8)
    variables = {v.name: np.full(shape, 0.5 if v.dtype == "f8" else OK) for v in VARIABLES if v.dims == POINT}
    variables["trusted"][0, 0, 0, :2] = 0
    variables["tight_response"][0, 0, 0, 0] = 3
    variables["long_response"][0, 0, 0, 1] = 0
    variables["trusted"][0, 0, 2, 3:6] = 0
    return Results(coords, variables, {"title": ""})


def marks(axes: Axes, gid: str) -> list[object]:
    return [artist for artist in (*axes.collections, *axes.get_lines()) if artist.get_gid() == gid]


@pytest.mark.parametrize("kind", ["map", "stick_slip_index"])
def test_a_map_marks_them(checked: Results, kind: str) -> None:
    figure = draw(checked, kind)
    axes = figure.axes[0]
    [dots] = marks(axes, "response_differs")
    assert np.asarray(dots.get_xdata()).tolist() == [1.0, 2.0]  # type: ignore[attr-defined]
    assert np.asarray(dots.get_ydata()).tolist() == pytest.approx([10.0, 10.0], abs=1.0)  # type: ignore[attr-defined]
    [hatched] = marks(axes, "features_differ")
    corners = np.concatenate([path.vertices for path in hatched.get_paths()])  # type: ignore[attr-defined]
    assert (corners[:, 0].min(), corners[:, 0].max()) == (3.5, 6.5)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "checked: response differs (2 of 40)" in words
    assert "checked: numbers differ (3 of 40)" in words


def test_a_long_legend_stays_on_the_paper(checked: Results) -> None:
    """Long entries stand below each other rather than beyond the edge."""
    checked.variables["status"][0, 0, 1, :4] = INFERRED
    checked.variables["motion"][:] = np.arange(8) % 2
    for kind in ("motion", "window", "map"):
        figure = draw(checked, kind)
        box = figure.legends[0].get_window_extent()
        assert box.x0 >= 0, kind
        assert box.x1 <= figure.bbox.width, kind


def test_a_strip_marks_them(checked: Results) -> None:
    figure = draw(checked, "summary", at={"wob": WEIGHTS[0]})
    [dots] = marks(figure.axes[0], "response_differs")
    assert np.asarray(dots.get_xdata()).tolist() == [1.0, 2.0]  # type: ignore[attr-defined]
    assert not marks(figure.axes[0], "features_differ")


def test_what_was_not_checked_is_not_marked(checked: Results) -> None:
    for name in ("tight_status", "long_status"):
        checked.variables[name][:] = 0
    figure = draw(checked, "map")
    assert not marks(figure.axes[0], "response_differs")
    assert not any("checked" in text.get_text() for text in figure.legends[0].get_texts())
