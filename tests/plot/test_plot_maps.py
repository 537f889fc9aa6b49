"""Maps: right cells, right colours, panels for procedures and for a third axis."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import covered, make_results, spoil
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from seen import artists, legend_words, maps

from nsdrill import plot
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.plot.style import KIND_COLOURS, MOTIONS, RESPONSES
from nsdrill.variables import DIVERGED, OK, PENDING, STEP_LIMIT


def cells(axes: Axes) -> QuadMesh:
    return artists(axes, "cells")[0]


def test_cells_have_the_colour_of_their_response(plane: Results) -> None:
    figure = plot.draw(plane)
    [axes] = maps(figure)
    mesh = cells(axes)
    np.testing.assert_array_equal(mesh.get_array(), plane["response"][0, :, 0, :])
    for code in np.unique(plane["response"]):
        assert to_hex(mesh.cmap(mesh.norm(code))) == RESPONSES[code].colour.lower()
    words = legend_words(figure)
    assert words == [RESPONSES[code].name for code in np.unique(plane["response"])]


def test_cells_reach_half_way_to_unequal_neighbours(plane: Results) -> None:
    """Depths of equal ratios are drawn on a logarithmic scale, and half way is meant on
    it; other depths to scale."""
    axes = maps(plot.draw(plane))[0]
    depth = plane.coords["depth"]
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    np.testing.assert_allclose(cells(axes).get_coordinates()[1:-1, 0, 1], np.sqrt(depth[1:] * depth[:-1]))

    depth[0] *= 0.9
    axes = maps(plot.draw(plane))[0]
    assert axes.get_yscale() == "linear"
    np.testing.assert_allclose(cells(axes).get_coordinates()[1:-1, 0, 1], 0.5 * (depth[1:] + depth[:-1]))


def test_depth_goes_down(plane: Results) -> None:
    bottom, top = maps(plot.draw(plane))[0].get_ylim()
    assert bottom > top


@pytest.mark.parametrize(
    ("kind", "variable", "scale", "label"),
    [
        ("lift_off", "lift_off_fraction", 100, "Time off the rock [%]"),
        ("radius", "radius_max", 1e3, "Greatest radius [mm]"),
        ("whirl_ratio", "whirl_ratio", 1, "Whirl ratio"),
        ("bit_torque_max", "bit_torque_max", 1e-3, "Greatest torque on the bit [kN m]"),
    ],
)
def test_value_maps(plane: Results, kind: str, variable: str, scale: float, label: str) -> None:
    figure = plot.draw(plane, kind)
    np.testing.assert_allclose(cells(maps(figure)[0]).get_array(), plane[variable][0, :, 0, :] * scale)
    assert label in [axes.get_ylabel() for axes in figure.axes]


def test_failed_cells_are_crossed_and_pending_cells_blank(plane: Results) -> None:
    figure = plot.draw(spoil(plane, diverged=3, step_limit=2, pending=4))
    [axes] = maps(figure)
    crossed = artists(axes, "failed")[0]
    failed = np.isin(plane["status"][0, :, 0], (DIVERGED, STEP_LIMIT))
    assert failed.sum() == 5
    np.testing.assert_array_equal(covered(crossed, plane["rotary_speed"], plane["depth"]), failed)
    assert cells(axes).get_array().mask.sum() == 9
    words = legend_words(figure)
    assert {"failed (5 of 135)", "not run yet (4 of 135)"} <= set(words)


def test_up_and_down_are_compared_in_a_third_panel() -> None:
    data = make_results(depth=np.linspace(1e3, 5e3, 5), rotary_speed=np.linspace(1, 8, 12), procedures=("up", "down"))
    data["status"][0, 0, 0, 0] = PENDING
    figure = plot.draw(data)
    assert [axes.get_title() for axes in figure.axes] == ["carried up", "carried down", "up and down compared"]
    hatched = artists(figure, "differs")[0]
    both = (data["status"] == OK).all(axis=0)
    differs = ((data["response"][0] != data["response"][1]) & both)[:, 0]
    assert differs.any()
    np.testing.assert_array_equal(covered(hatched, data["rotary_speed"], data["depth"]), differs)


def test_a_third_axis_gives_small_multiples() -> None:
    data = make_results(
        depth=np.linspace(1e3, 5e3, 6), wob=(1e4, 2e4, 3e4, 4e4, 5e4), rotary_speed=np.linspace(1, 8, 7)
    )
    figure = plot.draw(data)
    assert [axes.get_title() for axes in maps(figure)] == ["10 kN", "20 kN", "30 kN", "40 kN", "50 kN"]
    for number, axes in enumerate(maps(figure)):
        np.testing.assert_array_equal(cells(axes).get_array(), data["response"][0, :, number, :])


def test_too_many_panels_says_what_to_select() -> None:
    data = make_results(
        depth=np.linspace(1e3, 5e3, 14), wob=np.linspace(1e4, 5e4, 13), rotary_speed=np.linspace(1, 8, 15)
    )
    with pytest.raises(InputError, match=r"13 panels; allowed: 12\. Select one value of wob"):
        plot.draw(data)
    assert len(maps(plot.draw(data, at={"wob": 1e4}))) == 1


def test_severity_lines_only_where_the_data_cross_them(plane: Results) -> None:
    assert artists(plot.draw(plane, "stick_slip_index"), "severity")
    plane["stick_slip_index"][:] = 10.0
    assert not artists(plot.draw(plane, "stick_slip_index"), "severity")


def test_whirl_kinds_have_names(plane: Results) -> None:
    words = legend_words(plot.draw(plane, "whirl_kind"))
    assert words == ["no whirl", "backward rolling", "irregular"]


def test_values_of_up_and_down_are_subtracted() -> None:
    """The third panel of a map of values shows that value, not the response, and its
    sign by two colours."""
    data = make_results(depth=np.linspace(1e3, 5e3, 5), rotary_speed=np.linspace(1, 8, 12), procedures=("up", "down"))
    data["status"][0, 0, 0, 0] = PENDING
    figure = plot.draw(data, "lift_off")
    assert [axes.get_title() for axes in maps(figure)] == ["carried up", "carried down", "down less up"]
    shown = cells(maps(figure)[2])
    difference = 100 * (data["lift_off_fraction"][1] - data["lift_off_fraction"][0])[:, 0]
    known = ~np.ma.getmaskarray(shown.get_array())
    assert known.sum() == known.size - 1
    np.testing.assert_allclose(np.ma.getdata(shown.get_array())[known], difference[known], atol=1e-12)
    assert shown.norm.vmin == -shown.norm.vmax
    assert "down less up [%]" in [axes.get_ylabel() for axes in figure.axes]


def test_values_of_both_signs_are_white_at_zero(plane: Results) -> None:
    shown = cells(maps(plot.draw(plane, "whirl_ratio"))[0])
    assert plane["whirl_ratio"].min() < 0 < plane["whirl_ratio"].max()
    assert shown.norm.vmin == -shown.norm.vmax
    assert min(shown.to_rgba(0.0)[:3]) > 0.95
    assert cells(maps(plot.draw(plane, "lift_off"))[0]).norm.vmin == 0.0


def test_kinds_of_whirl_have_colours_of_their_own() -> None:
    others = {style.colour for style in (*RESPONSES, *MOTIONS)}
    assert not others & {*KIND_COLOURS}


def test_no_cell_reaches_below_zero_where_no_value_does() -> None:
    figure = plot.draw(make_results(rotary_speed=(1.0, 9.0)))
    assert figure.axes[1].get_xlim()[0] == 0.0
    figure = plot.draw(make_results(depth=(500.0, 9000.0), rotary_speed=np.linspace(1, 9, 5)), "map")
    assert min(figure.axes[0].get_ylim()) == 0.0
