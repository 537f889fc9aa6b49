"""Maps: right cells, right colours, panels for procedures and for a third axis."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import make_results, spoil
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from nsdrill import plot
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.plot.style import RESPONSES
from nsdrill.variables import OK, PENDING


def cells(axes: Axes) -> QuadMesh:
    return next(c for c in axes.collections if c.get_gid() == "cells")


def panels(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if any(c.get_gid() == "cells" for c in axes.collections)]


def test_cells_have_the_colour_of_their_response(plane: Results) -> None:
    figure = plot.draw(plane)
    [axes] = panels(figure)
    mesh = cells(axes)
    np.testing.assert_array_equal(mesh.get_array(), plane["response"][0, :, 0, :])
    for code in np.unique(plane["response"]):
        assert to_hex(mesh.cmap(mesh.norm(code))) == RESPONSES[code].colour.lower()
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == [RESPONSES[code].name for code in np.unique(plane["response"])]


def test_cells_reach_half_way_to_unequal_neighbours(plane: Results) -> None:
    """Depths of equal ratios are drawn on a logarithmic scale, and half way is meant on it; other depths to scale."""
    axes = panels(plot.draw(plane))[0]
    depth = plane.coords["depth"]
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    np.testing.assert_allclose(cells(axes).get_coordinates()[1:-1, 0, 1], np.sqrt(depth[1:] * depth[:-1]))

    depth[0] *= 0.9
    axes = panels(plot.draw(plane))[0]
    assert axes.get_yscale() == "linear"
    np.testing.assert_allclose(cells(axes).get_coordinates()[1:-1, 0, 1], 0.5 * (depth[1:] + depth[:-1]))


def test_depth_goes_down(plane: Results) -> None:
    bottom, top = panels(plot.draw(plane))[0].get_ylim()
    assert bottom > top


@pytest.mark.parametrize(("kind", "variable", "scale", "label"), [
    ("lift_off", "lift_off_fraction", 100, "Time off the rock [%]"),
    ("radius", "radius_max", 1e3, "Greatest radius [mm]"),
    ("whirl_ratio", "whirl_ratio", 1, "Whirl ratio"),
    ("bit_torque_max", "bit_torque_max", 1e-3, "Greatest torque on the bit [kN m]"),
])  # fmt: skip
def test_value_maps(plane: Results, kind: str, variable: str, scale: float, label: str) -> None:
    figure = plot.draw(plane, kind)
    np.testing.assert_allclose(cells(panels(figure)[0]).get_array(), plane[variable][0, :, 0, :] * scale)
    assert label in [axes.get_ylabel() for axes in figure.axes]


def test_failed_cells_are_crossed_and_pending_cells_blank(plane: Results) -> None:
    figure = plot.draw(spoil(plane, diverged=3, step_limit=2, pending=4))
    [axes] = panels(figure)
    crossed = next(c for c in axes.collections if c.get_gid() == "failed")
    assert len(crossed.get_paths()) == 5
    assert cells(axes).get_array().mask.sum() == 9
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"failed (5 of 135)", "not run yet (4 of 135)"} <= set(words)


def test_up_and_down_are_compared_in_a_third_panel() -> None:
    data = make_results(depth=np.linspace(1e3, 5e3, 5), rotary_speed=np.linspace(1, 8, 12), procedures=("up", "down"))
    data["status"][0, 0, 0, 0] = PENDING
    figure = plot.draw(data)
    assert [axes.get_title() for axes in figure.axes] == ["carried up", "carried down", "up and down compared"]
    hatched = next(c for c in figure.axes[2].collections if c.get_gid() == "differs")
    both = (data["status"] == OK).all(axis=0)
    assert len(hatched.get_paths()) == ((data["response"][0] != data["response"][1]) & both).sum()


def test_a_third_axis_gives_small_multiples() -> None:
    data = make_results(
        depth=np.linspace(1e3, 5e3, 6), wob=(1e4, 2e4, 3e4, 4e4, 5e4), rotary_speed=np.linspace(1, 8, 7)
    )
    figure = plot.draw(data)
    assert [axes.get_title() for axes in panels(figure)] == ["10 kN", "20 kN", "30 kN", "40 kN", "50 kN"]
    for number, axes in enumerate(panels(figure)):
        np.testing.assert_array_equal(cells(axes).get_array(), data["response"][0, :, number, :])


def test_too_many_panels_says_what_to_select() -> None:
    data = make_results(
        depth=np.linspace(1e3, 5e3, 14), wob=np.linspace(1e4, 5e4, 13), rotary_speed=np.linspace(1, 8, 15)
    )
    with pytest.raises(InputError, match=r"13 panels; allowed: 12\. Select one value of wob"):
        plot.draw(data)
    assert len(panels(plot.draw(data, at={"wob": 1e4}))) == 1


def test_severity_lines_only_where_the_data_cross_them(plane: Results) -> None:
    def lines(figure: Figure) -> list:
        return [c for axes in figure.axes for c in axes.collections if c.get_gid() == "severity"]

    assert lines(plot.draw(plane, "stick_slip_index"))
    plane["stick_slip_index"][:] = 10.0
    assert not lines(plot.draw(plane, "stick_slip_index"))


def test_whirl_kinds_have_names(plane: Results) -> None:
    words = [text.get_text() for text in plot.draw(plane, "whirl_kind").legends[0].get_texts()]
    assert words == ["no whirl", "backward rolling", "irregular"]
