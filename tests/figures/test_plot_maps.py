"""Maps: right cells, right colours, panels for procedures and for a third axis; what lies on
the cells."""

from dataclasses import replace

import numpy as np
import pytest
from made_up import covered, make_results, spoil
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from model_tables import VARIABLES
from seen import artists, legend_words, maps
from xarray import Dataset

import nsdrill
from nsdrill import figures
from nsdrill.analysis.bifurcations import DOUBLING, FOLD
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.figures import draw, look_of
from nsdrill.figures.cells import RATE_OF_PENETRATION, draw_equal_rates, write_name
from nsdrill.figures.map_panels import colour_bar
from nsdrill.figures.style import KIND_COLOURS, MOTIONS, RESPONSES, lettered
from nsdrill.models.responses import STALLED
from nsdrill.store.dataset import to_dataset
from nsdrill.variables import DIVERGED, INFERRED, OK, PENDING, POINT, STEP_LIMIT


def cells(axes: Axes) -> QuadMesh:
    return artists(axes, "cells")[0]


@pytest.mark.parametrize(
    ("limits", "ends"), [((0.0, 5.0), "neither"), ((1.0, 5.0), "min"), ((0.0, 4.0), "max"), ((1.0, 4.0), "both")]
)
def test_a_colour_bar_is_pointed_where_values_lie_beyond_its_end(limits, ends):
    bar = colour_bar(np.ma.array([0.0, 2.0, 5.0]), "viridis", limits, "label", [])
    assert bar.style["extend"] == ends


def test_cells_have_the_colour_of_their_response(plane):
    figure = figures.draw(plane)
    [axes] = maps(figure)
    mesh = cells(axes)
    np.testing.assert_array_equal(mesh.get_array(), plane["response"][0, :, 0, :])
    for code in np.unique(plane["response"]):
        assert to_hex(mesh.cmap(mesh.norm(code))) == RESPONSES[code].colour.lower()
    words = legend_words(figure)
    assert words == [lettered(RESPONSES)[code].name for code in np.unique(plane["response"])]


def test_cells_reach_half_way_to_unequal_neighbours(plane):
    """Depths of equal ratios are drawn on a logarithmic scale, and half way is meant on
    it; other depths to scale."""
    axes = maps(figures.draw(plane))[0]
    depth = plane.coords["depth"]
    assert (axes.get_xscale(), axes.get_yscale()) == ("linear", "log")
    np.testing.assert_allclose(cells(axes).get_coordinates()[1:-1, 0, 1], np.sqrt(depth[1:] * depth[:-1]))

    depth[0] *= 0.9
    axes = maps(figures.draw(plane))[0]
    assert axes.get_yscale() == "linear"
    np.testing.assert_allclose(cells(axes).get_coordinates()[1:-1, 0, 1], 0.5 * (depth[1:] + depth[:-1]))


def test_depth_goes_down(plane):
    bottom, top = maps(figures.draw(plane))[0].get_ylim()
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
def test_value_maps(plane, kind, variable, scale, label):
    figure = figures.draw(plane, kind)
    np.testing.assert_allclose(cells(maps(figure)[0]).get_array(), plane[variable][0, :, 0, :] * scale)
    assert label in [axes.get_ylabel() for axes in figure.axes]


def test_failed_cells_are_crossed_and_pending_cells_blank(plane):
    figure = figures.draw(spoil(plane, diverged=3, step_limit=2, pending=4))
    [axes] = maps(figure)
    crossed = artists(axes, "failed")[0]
    failed = np.isin(plane["status"][0, :, 0], (DIVERGED, STEP_LIMIT))
    assert failed.sum() == 5
    np.testing.assert_array_equal(covered(crossed, plane["rotary_speed"], plane["depth"]), failed)
    assert cells(axes).get_array().mask.sum() == 9
    words = legend_words(figure)
    assert {"failed (5 of 135)", "not run yet (4 of 135)"} <= set(words)


def test_up_and_down_are_compared_in_a_third_panel():
    data = make_results(depth=np.linspace(1e3, 5e3, 5), rotary_speed=np.linspace(1, 8, 12), procedures=("up", "down"))
    data["status"][0, 0, 0, 0] = PENDING
    figure = figures.draw(data)
    assert [axes.get_title() for axes in figure.axes] == ["carried up", "carried down", "up and down compared"]
    hatched = artists(figure, "differs")[0]
    both = (data["status"] == OK).all(axis=0)
    differs = ((data["response"][0] != data["response"][1]) & both)[:, 0]
    assert differs.any()
    np.testing.assert_array_equal(covered(hatched, data["rotary_speed"], data["depth"]), differs)


def test_a_third_axis_gives_small_multiples():
    data = make_results(
        depth=np.linspace(1e3, 5e3, 6), wob=(1e4, 2e4, 3e4, 4e4, 5e4), rotary_speed=np.linspace(1, 8, 7)
    )
    figure = figures.draw(data)
    assert [axes.get_title() for axes in maps(figure)] == ["10 kN", "20 kN", "30 kN", "40 kN", "50 kN"]
    for number, axes in enumerate(maps(figure)):
        np.testing.assert_array_equal(cells(axes).get_array(), data["response"][0, :, number, :])


def test_too_many_panels_says_what_to_select():
    data = make_results(
        depth=np.linspace(1e3, 5e3, 14), wob=np.linspace(1e4, 5e4, 13), rotary_speed=np.linspace(1, 8, 15)
    )
    with pytest.raises(InputError, match=r"13 panels; allowed: 12\. Select one value of wob"):
        figures.draw(data)
    assert len(maps(figures.draw(data, at={"wob": 1e4}))) == 1


def test_severity_lines_only_where_the_data_cross_them(plane):
    assert artists(figures.draw(plane, "stick_slip_index"), "severity")
    plane["stick_slip_index"][:] = 10.0
    assert not artists(figures.draw(plane, "stick_slip_index"), "severity")


def test_whirl_kinds_have_names(plane):
    words = legend_words(figures.draw(plane, "whirl_kind"))
    assert words == ["no whirl", "backward rolling", "irregular"]


def test_values_of_up_and_down_are_subtracted():
    """The third panel of a map of values shows that value, not the response, and its
    sign by two colours."""
    data = make_results(depth=np.linspace(1e3, 5e3, 5), rotary_speed=np.linspace(1, 8, 12), procedures=("up", "down"))
    data["status"][0, 0, 0, 0] = PENDING
    figure = figures.draw(data, "lift_off")
    assert [axes.get_title() for axes in maps(figure)] == ["carried up", "carried down", "down less up"]
    shown = cells(maps(figure)[2])
    difference = 100 * (data["lift_off_fraction"][1] - data["lift_off_fraction"][0])[:, 0]
    known = ~np.ma.getmaskarray(shown.get_array())
    assert known.sum() == known.size - 1
    np.testing.assert_allclose(np.ma.getdata(shown.get_array())[known], difference[known], atol=1e-12)
    assert shown.norm.vmin == -shown.norm.vmax
    assert "down less up [%]" in [axes.get_ylabel() for axes in figure.axes]


def test_values_of_both_signs_are_white_at_zero(plane):
    shown = cells(maps(figures.draw(plane, "whirl_ratio"))[0])
    assert plane["whirl_ratio"].min() < 0 < plane["whirl_ratio"].max()
    assert shown.norm.vmin == -shown.norm.vmax
    assert min(shown.to_rgba(0.0)[:3]) > 0.95
    assert cells(maps(figures.draw(plane, "lift_off"))[0]).norm.vmin == 0.0


def test_kinds_of_whirl_have_colours_of_their_own():
    others = {style.colour for style in (*RESPONSES, *MOTIONS)}
    assert not others & {*KIND_COLOURS}


def test_no_cell_reaches_below_zero_where_no_value_does():
    figure = figures.draw(make_results(rotary_speed=(1.0, 9.0)))
    assert figure.axes[1].get_xlim()[0] == 0.0
    figure = figures.draw(make_results(depth=(500.0, 9000.0), rotary_speed=np.linspace(1, 9, 5)), "map")
    assert min(figure.axes[0].get_ylim()) == 0.0


WEIGHTS = np.linspace(1e4, 1e5, 5)


@pytest.fixture
def checked():
    """Of forty points two change response in one of the checks, three change their
    features only, the others agree."""
    coords = {
        "procedure": np.array(["same"]),
        "depth": np.array([5000.0]),
        "wob": WEIGHTS,
        "rotary_speed": np.linspace(1.0, 8.0, 8),
    }
    shape = (1, 1, 5, 8)
    variables = {v.name: np.full(shape, 0.5 if v.dtype == "f8" else OK) for v in VARIABLES if v.dims == POINT}
    variables["trusted"][0, 0, 0, :2] = 0
    variables["tight_response"][0, 0, 0, 0] = 3
    variables["long_response"][0, 0, 0, 1] = 0
    variables["trusted"][0, 0, 2, 3:6] = 0
    return Results(coords, variables, {"title": ""})


@pytest.mark.parametrize("kind", ["map", "stick_slip_index"])
def test_a_map_marks_them(checked, kind):
    figure = draw(checked, kind)
    axes = figure.axes[0]
    [dots] = artists(axes, "response_differs")
    assert np.asarray(dots.get_xdata()).tolist() == [1.0, 2.0]
    assert np.asarray(dots.get_ydata()).tolist() == pytest.approx([10.0, 10.0], abs=1.0)
    [hatched] = artists(axes, "features_differ")
    corners = np.concatenate([path.vertices for path in hatched.get_paths()])
    assert (corners[:, 0].min(), corners[:, 0].max()) == (3.5, 6.5)
    words = legend_words(figure)
    assert "checked: response differs (2 of 40)" in words
    assert "checked: numbers differ (3 of 40)" in words


@pytest.mark.usefixtures("laid_out")
def test_a_long_legend_stays_on_the_paper(checked):
    """Long entries stand below each other rather than beyond the edge."""
    checked.variables["status"][0, 0, 1, :4] = INFERRED
    checked.variables["motion"][:] = np.arange(8) % 2
    for kind in ("motion", "window", "map"):
        figure = draw(checked, kind)
        box = figure.legends[0].get_window_extent()
        assert box.x0 >= 0, kind
        assert box.x1 <= figure.bbox.width, kind


def test_a_strip_marks_them(checked):
    figure = draw(checked, "summary", at={"wob": WEIGHTS[0]})
    [dots] = artists(figure.axes[0], "response_differs")
    assert np.asarray(dots.get_xdata()).tolist() == [1.0, 2.0]
    assert not artists(figure.axes[0], "features_differ")


def test_what_was_not_checked_is_not_marked(checked):
    for name in ("tight_status", "long_status"):
        checked.variables[name][:] = 0
    figure = draw(checked, "map")
    assert not artists(figure.axes[0], "response_differs")
    assert not any("checked" in word for word in legend_words(figure))


@pytest.fixture
def refined():
    """Five weights by nine speeds, of which every other was run; all points bounce and
    whirl forward."""
    coords = {
        "procedure": np.array(["same"]),
        "depth": np.array([5000.0]),
        "wob": WEIGHTS,
        "rotary_speed": np.linspace(1.0, 8.0, 9),
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


def test_a_map_shows_inferred_responses_and_says_so(refined):
    figure = draw(refined, "map")
    cells = artists(figure, "cells")[0]
    assert np.all(np.asarray(cells.get_array()) == 5)
    dots = artists(figure, "inferred")
    inferred = refined["status"][0, 0] == INFERRED
    assert inferred.sum() == 30
    np.testing.assert_array_equal(covered(dots[0], refined["rotary_speed"], refined["wob"] / 1e3), inferred)
    assert "paler: inferred (30 of 45)" in legend_words(figure)


@pytest.mark.parametrize(
    ("kind", "said"), [("whirl_kind", "paler: inferred"), ("stick_slip_index", "interpolated between runs")]
)
def test_other_maps_fill_them_from_the_points_around_and_say_so(refined, kind, said):
    figure = draw(refined, kind)
    cells = artists(figure, "cells")[0]
    assert np.all(np.asarray(cells.get_array()) == (1 if kind == "whirl_kind" else 30.0))
    veiled = artists(figure, "inferred")
    assert bool(veiled) == (kind == "whirl_kind"), "a veil would change the colours of a scale"
    assert f"{said} (30 of 45)" in legend_words(figure)
    assert not any(c.get_hatch() for c in figure.axes[0].collections)


def test_between_points_values_are_linear(refined):
    """A plane through the points that were run is met at all others, wherever they lie
    between."""
    x, y = np.meshgrid(refined["rotary_speed"], refined["wob"])
    plane = 2.0 * x + 3e-3 * y
    ran = refined["status"][0, 0] == OK
    refined.variables["stick_slip_index"][0, 0] = np.where(ran, plane, np.nan)
    cells = artists(draw(refined, "stick_slip_index"), "cells")[0]
    assert np.asarray(cells.get_array()) == pytest.approx(plane)


@pytest.mark.parametrize("kind", ["summary", "bifurcation"])
def test_along_one_axis_the_strip_is_whole_and_curves_pass_over_them(refined, kind):
    figure = draw(refined, kind, at={"wob": WEIGHTS[0]})
    strip = artists(figure, "strip")[0]
    assert np.ma.count(np.ma.asarray(strip.get_array())) == 9
    for axes in figure.axes[1:]:
        for line in axes.get_lines():
            if str(line.get_gid()).split(":")[0] in refined.variables:
                assert len(set(np.asarray(line.get_xdata()))) == 5
                assert np.all(np.isfinite(line.get_ydata()))


RATED_SPEEDS, RATED_WEIGHTS = np.linspace(1.0, 6.0, 11), np.linspace(10e3, 60e3, 9)


@pytest.fixture
def rated():
    """The rate [m/h] is the speed times the weight in 10 kN."""
    made = make_results(wob=RATED_WEIGHTS, rotary_speed=RATED_SPEEDS, procedures=("up", "down"))
    made.variables["rate_of_penetration"] = np.broadcast_to(
        np.outer(RATED_WEIGHTS / 1e4, RATED_SPEEDS) / 3600.0, made.shape
    ).copy()
    return made


@pytest.mark.parametrize(("kind", "panels", "given"), [("map", 2, {}), ("window", 1, {"rates": True})])
def test_the_rate_is_equal_along_a_line(rated, kind, panels, given):
    figure = draw(rated, kind, **given)
    found = artists(figure, "equal")
    assert len(found) == panels
    for line in found:
        for level, path in zip(line.levels, line.get_paths(), strict=True):
            x, y = path.vertices.T  # rad/s, kN
            # straight between points of the map
            np.testing.assert_allclose(x * y / 10, level, rtol=0.02)
    legend = legend_words(figure)
    assert "Rate of penetration [m/h]" in legend


def curves_of(results, labels):
    """A file of branches with a curve of each of these kinds, straight through the
    map."""
    ends = [RATED_SPEEDS[[0, -1]], RATED_WEIGHTS[[0, -1]]]
    curves = {
        "curve_label": ("curve", np.array(labels)),
        "curve_row_size": ("curve", np.full(len(labels), 2)),
        "curve_rotary_speed": ("curve_point", np.tile(ends[0], len(labels))),
        "curve_wob": ("curve_point", np.tile(ends[1], len(labels))),
        "row_size": ("branch", np.array([1])),
        "depth": ("point", results.coords["depth"]),
    }
    return Dataset(curves, attrs={**results.attrs, "along": "rotary_speed", "over": "wob"})


def test_every_area_is_named_as_in_the_window(plane):
    """By its response or by letters, which the legend has; no critical response has no
    name."""
    figure = draw(plane, "map")
    codes = {text.get_gid(): text.get_text() for text in maps(figure)[0].texts}
    assert codes
    for gid, text in codes.items():
        style = RESPONSES[int(gid.removeprefix("area:"))]
        assert text in {style.name, style.letters}
        assert f"{style.letters} {style.name}" in legend_words(figure)
    assert "area:0" not in codes
    assert not maps(draw(plane, "whirl_kind"))[0].texts, "these have no letters"


@pytest.mark.parametrize("panel", [None, "up"])
def test_curves_over_a_map_differ_from_lines_of_equal_rate(rated, panel):
    curves = curves_of(rated, (FOLD, DOUBLING, 101, 102))
    figure = nsdrill.plot(to_dataset(rated), over=curves, panel=panel)
    (legend,) = figure.legends
    entries = {text.get_text(): line for text, line in zip(legend.get_texts(), legend.legend_handles, strict=True)}
    names = ("Rate of penetration [m/h]", "fold", "doubling", "lift off", "wall reached")
    dashes = [str(entries[name]._unscaled_dash_pattern) for name in names]
    assert len(set(dashes)) == 5
    drawn = artists(figure, "curve 1:")
    assert len(drawn) == (1 if panel else 3), "up, down, and where these differ"
    assert str(drawn[0]._unscaled_dash_pattern) == dashes[2]
    assert len({entries[name].get_marker() for name in names}) == 5, "to be told apart in grey"
    assert drawn[0].get_marker() == entries["doubling"].get_marker()
    words = [text for axes in figure.axes for text in axes.texts]
    assert {text.get_gid() for text in words} >= {"equal:label"}
    assert min(text.get_zorder() for text in words) > max(curve.get_zorder() for curve in artists(figure, "curve 1:"))
    assert all(axes.get_legend() is None for axes in figure.axes), "no legend over the map"


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize("kind", ["map", "window"])
@pytest.mark.parametrize("given", [{}, {"width": "3.3 in"}, {"width": "2.5 in"}, {"xlim": (2.0, 3.0)}])
def test_the_frame_cuts_no_label_of_a_line(rated, kind, given):
    """A line begins at a border of the map, and matplotlib puts labels there."""
    for scale in (0.3, 0.5, 1.0, 2.0):
        data = replace(rated, variables=rated.variables | {RATE_OF_PENETRATION: scale * rated[RATE_OF_PENETRATION]})
        figure = draw(data, kind, look=look_of(**given), **({"rates": True} if kind == "window" else {}))
        labels = [(axes, text) for axes in figure.axes for text in axes.texts if text.get_gid() == "equal:label"]
        assert labels or "xlim" in given
        for axes, text in labels:
            frame, (x0, y0, x1, y1) = axes.get_window_extent(), text.get_window_extent().extents
            assert frame.x0 <= x0 < x1 <= frame.x1, text
            assert frame.y0 <= y0 < y1 <= frame.y1, text


def test_in_field_units_it_is_in_feet(rated):
    figure = draw(rated, "window", units="field", rates=True)
    [line] = artists(figure, "equal")
    x, y = line.get_paths()[0].vertices.T
    metres = (x * 2 * np.pi / 60) * (y * 4448.2216152605 / 1e4)
    np.testing.assert_allclose(metres / 0.3048, line.levels[0], rtol=0.02)


def test_points_that_were_not_run_are_passed_over(rated):
    rated.variables["rate_of_penetration"][:, :, 1::2, 1::2] = np.nan
    figure = draw(rated, "map")
    for line in artists(figure, "equal"):
        for level, path in zip(line.levels, line.get_paths(), strict=True):
            x, y = path.vertices.T
            np.testing.assert_allclose(x * y / 10, level, rtol=0.05)


def test_no_lines_where_nothing_varies_or_none_is_known(rated):
    for values in (np.full(rated.shape, 1e-3), np.full(rated.shape, np.nan), np.zeros(rated.shape)):
        rated.variables["rate_of_penetration"] = values
        assert not artists(draw(rated, "map"), "equal")


@pytest.mark.usefixtures("laid_out")
def test_no_label_covers_a_point_that_is_to_be_clear():
    x, y = RATED_SPEEDS, RATED_WEIGHTS / 1e3
    values = np.outer(RATED_WEIGHTS / 1e4, RATED_SPEEDS) / 3600.0

    def labels(clear):
        axes = Figure().add_subplot()
        axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        draw_equal_rates(axes, (x, y), values, "si", clear)
        assert artists(axes, "equal")
        return {text.get_text(): np.array(text.get_position()) for text in axes.texts}

    usual = labels(())
    extent = [np.ptp(x), np.ptp(y)]
    for text, place in usual.items():
        moved = labels([tuple(place)])
        assert moved.keys() - {text} == usual.keys() - {text}
        for other, where in moved.items():
            assert np.hypot(*((where - place) / extent)) > 0.1
            assert other == text or np.allclose(where, usual[other], atol=0.02 * np.array(extent))


@pytest.mark.usefixtures("laid_out")
def test_no_label_covers_the_name_of_an_area_where_there_is_another_place():
    x, y = RATED_SPEEDS, RATED_WEIGHTS / 1e3
    values = np.outer(RATED_WEIGHTS / 1e4, RATED_SPEEDS) / 3600.0

    def labels(names):
        axes = Figure().add_subplot()
        axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        for place in names:
            write_name(axes, place, "bit-bounce", "#FFFFFF", "area:1")
        draw_equal_rates(axes, (x, y), values, "si")
        assert artists(axes, "equal")
        return {text.get_text(): np.array(text.get_position()) for text in artists(axes, "equal:label")}

    usual = labels(())
    for text, place in usual.items():
        moved = labels([tuple(place)])
        assert moved.keys() == usual.keys()
        along, above = np.abs((moved[text] - place) / [np.ptp(x), np.ptp(y)])
        # the name is about 0.11 of the panel long (10 letters of 7 points), half of it at either side
        assert np.hypot(max(along - 0.05, 0.0), above) > 0.05 or text == max(usual, key=float)


@pytest.mark.usefixtures("laid_out")
def test_the_index_of_a_stalled_bit_is_left_out():
    """It is that of a creep. The cells are in the colour of stalled, the curve ends."""
    data = make_results(wob=(1e4, 2e4, 3e4), rotary_speed=(2.0, 3.0, 4.0), rule=lambda *at: STALLED * (at[2] > 2.5e4))
    figure = figures.draw(data, "stick_slip_index")
    [axes] = maps(figure)
    [cover] = artists(axes, "stalled")
    assert to_hex(cover.get_facecolor()[0]).upper() == RESPONSES[STALLED].colour
    assert np.ma.getmaskarray(cells(axes).get_array()).reshape(3, 3).sum(axis=1).tolist() == [0, 0, 3]
    assert "stalled" in legend_words(figure)
    [of_lift_off] = maps(figures.draw(data, "lift_off_fraction"))
    assert not artists(of_lift_off, "stalled"), "what else happens is shown"
    line = make_results(rotary_speed=(2.0, 3.0, 4.0), rule=lambda *at: STALLED * (at[3] > 3.5))
    [curve] = artists(figures.draw(line, panel="stick_slip_index").axes[-1], "stick_slip_index:same")
    assert np.isfinite(curve.get_ydata()).tolist() == [True, True, False]


def test_what_had_not_settled_is_hatched_on_a_map(plane):
    assert not any("unsettled" in words for words in legend_words(figures.draw(plane, "map")))
    plane.variables["settled"][0, 2:5, 0, 3:9] = 0
    figure = figures.draw(plane, "map")
    (hatched,) = artists(figure, "unsettled")
    area = covered(hatched, plane.coords["rotary_speed"], plane.coords["depth"])
    if area.sum() != 18:  # the other axis lies along x
        area = covered(hatched, plane.coords["depth"], plane.coords["rotary_speed"]).T
    assert np.array_equal(area, plane["settled"][0, :, 0] == 0)
    assert "not settled (18 of 135)" in legend_words(figure)
