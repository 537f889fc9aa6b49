"""One panel of a picture alone, limits of its y axis; what is left out: frozen motions,
rounding that is no signal."""

import json
import re
from dataclasses import replace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from made_up import make_results, make_trace
from matplotlib.figure import Figure
from seen import artists, words_in

import nsdrill
from nsdrill import figures
from nsdrill.analysis.comparison import other_string
from nsdrill.data import Results, Trace
from nsdrill.errors import InputError
from nsdrill.figures.kinds.returns import section_of
from nsdrill.figures.look import look_of
from nsdrill.figures.page import freeze_layout, new_figure
from nsdrill.figures.picture_kinds import all_kinds
from nsdrill.figures.style import house_style
from nsdrill.figures.traces import planes_of
from nsdrill.models.registry import described, drawn_in
from nsdrill.store.dataset import to_dataset


def labels(figure: Figure) -> list[str]:
    return [axes.get_ylabel() for axes in figure.axes]


@pytest.mark.parametrize("kind", ["bifurcation", "summary"])
def test_a_panel_along_an_axis_is_the_same_alone(speeds, kind):
    whole = figures.draw(speeds, kind)
    for axes in whole.axes[1:]:
        name = str(axes.get_label())
        (alone,) = figures.draw(speeds, kind, panel=name).axes
        assert alone.get_ylabel().replace("\n", " ") == axes.get_ylabel().replace("\n", " ")
        assert alone.get_xlabel() == "Rotary speed [rad/s]"
        assert alone.get_xlim() == axes.get_xlim()
        assert alone.get_ylim() == pytest.approx(axes.get_ylim())
        assert [line.get_gid() for line in alone.lines] == [line.get_gid() for line in axes.lines]
        for one, other in zip(alone.lines, axes.lines, strict=True):
            assert np.array_equal(one.get_xydata(), other.get_xydata(), equal_nan=True)


def test_the_legend_of_a_panel_names_the_lines_that_it_has(speeds):
    for panel, has_speed in (("bit_speed_peaks", True), ("radius_peaks", False)):
        figure = figures.draw(speeds, panel=panel)
        (words,) = ([text.get_text() for text in legend.get_texts()] for legend in figure.legends)
        assert ("rotary speed" in words) == has_speed, panel
        assert ("wall of the hole" in words) == any(line.get_gid() == "wall" for line in figure.axes[0].lines)


def test_a_name_may_be_shortened_where_it_is_clear(speeds):
    assert labels(figures.draw(speeds, "bifurcation", panel="radius")) == ["Radial peaks $r$ [mm]"]
    with pytest.raises(nsdrill.InputError, match="found 'peaks'; allowed here: 'axial_peaks', 'bit_speed_peaks'"):
        figures.draw(speeds, panel="peaks")


def test_panels_of_maps_are_named_by_the_way_the_state_was_carried():
    data = make_results(wob=np.linspace(1e4, 6e4, 5), rotary_speed=np.linspace(1, 8, 9), procedures=("up", "down"))
    whole = figures.draw(data, "map")
    for number, name in enumerate(("up", "down", "compared")):
        (alone,) = figures.draw(data, "map", panel=name).axes
        assert alone.get_ylabel() == "Weight on bit [kN]"
        assert alone.get_title() == whole.axes[number].get_title()
        assert [one.get_gid() for one in alone.collections] == [one.get_gid() for one in whole.axes[number].collections]
    figure = figures.draw(data, "stick_slip_index", panel="down")
    assert [axes.get_label() for axes in figure.axes[1:]] == ["<colorbar>"]


@pytest.mark.parametrize(
    ("kind", "panel", "way"),
    [
        # without a name the way that was run first
        ("map", None, "up"),
        (None, "whirl_kind", "up"),
        ("map", "whirl_kind", "up"),
        ("value", "radius_max", "up"),
        ("map", "radius_max", "up"),
        (None, "radius_max", "up"),
        # or both names
        (None, "radius_max down", "down"),
        ("value", "radius_max down", "down"),
        ("map", "radius_max compared", "compared"),
        ("radius_max", "radius_max down", "down"),
        ("radius_max", "down", "down"),
        ("map", "whirl_kind down", "down"),
    ],
)
def test_a_panel_of_a_map_of_two_ways_in_axes_of_a_user(kind, panel, way):
    data = make_results(wob=np.linspace(1e4, 6e4, 5), rotary_speed=np.linspace(1, 8, 9), procedures=("up", "down"))
    variable = (panel or "response").split()[0] if kind != "radius_max" else "radius_max"
    whole = figures.draw(data, "map" if variable == "response" else variable)
    axes = Figure().subplots()
    figures.draw(data, kind, panel=panel, ax=axes)
    (like,) = (one for one in whole.axes if one.get_label() == way)
    (cells,), (expected,) = (artists(one, "cells") or artists(one, "same") for one in (axes, like))
    assert np.ma.allequal(cells.get_array(), expected.get_array())
    (alone, *_) = figures.draw(data, kind, panel=f"{variable} {way}" if panel else way).axes
    assert alone.get_title() == like.get_title()


def test_of_a_map_for_each_value_of_a_third_axis_the_error_leads_to_one():
    data = make_results(wob=[1e4, 2e4], rotary_speed=[1.0, 2.0, 3.0], depth=[1e3, 2e3], procedures=("up", "down"))
    with pytest.raises(InputError, match=r"by panel: 'radius_max up', .*'radius_max up 2'") as error:
        figures.draw(data, panel="radius_max", ax=Figure().subplots())
    for name in re.findall("'([^']*)'", str(error.value)):
        figures.draw(data, panel=name, ax=Figure().subplots())
    with pytest.raises(InputError, match="panel: found 'radius_max sideways'; allowed here: 'radius_max up', "):
        figures.draw(data, panel="radius_max sideways")


@pytest.mark.parametrize(
    ("panel", "kind"), [("orbit", None), ("phase", "trace"), ("section", None), ("wall_force", "trace")]
)
def test_panels_of_a_trace(trace, panel, kind):
    """Those that were kinds of their own are drawn as they were."""
    figure = figures.draw(trace, kind, panel=panel)
    if panel in all_kinds():
        alone = figures.draw(trace, panel)
        assert labels(figure) == labels(alone)
        assert figure.get_size_inches() == pytest.approx(alone.get_size_inches())
    else:
        assert labels(figure) == ["Wall force [kN]"]


def test_every_panel_in_axes_of_a_user(speeds, trace):
    """Also where the user's panels share their axes."""
    figure = Figure()
    left, right = figure.subplots(1, 2, sharex=True)
    left.set_title("mine")
    data = to_dataset(speeds)
    assert nsdrill.plot(data, panel="bit_speed_peaks", ax=left) is figure
    assert nsdrill.plot(data, "stick_slip_index", ax=right) is figure
    assert left.get_title() == "mine"
    assert left.get_ylabel().startswith("Bit speed peaks")
    assert right.get_ylabel().startswith("Stick-slip index")
    assert left.get_xlim() == right.get_xlim() == figures.draw(speeds).axes[-1].get_xlim()
    assert len(figure.axes) == 2
    axes = Figure().subplots()
    nsdrill.plot(to_dataset(trace), panel="bit_force", ax=axes)
    assert axes.get_ylabel().startswith("Bit force")
    assert axes.get_xlabel() == "Time [s]"


def test_the_panel_of_the_default_picture_comes_before_a_value_of_its_name(speeds):
    """The greatest radius is a value with the short name ``radius``."""
    assert "radius" in all_kinds()
    assert labels(figures.draw(speeds, panel="radius")) == ["Radial peaks $r$ [mm]"]
    assert labels(figures.draw(speeds, "value", panel="radius"))[-1].startswith("Greatest radius")
    assert labels(figures.draw(speeds, panel="whirl_ratio"))[-1].startswith("Whirl ratio")


def sizes(axes: Any) -> list[float]:
    """Of the type of both labels, of a number at each axis, and of the legend."""
    texts = [one for axis in (axes.xaxis, axes.yaxis) for one in (axis.label, axis.get_ticklabels()[0])]
    return [text.get_fontsize() for text in (*texts, axes.get_legend().get_texts()[0])]


def test_the_size_of_type_of_axes_of_a_user(speeds):
    """It is the size that is given, else that which the axes have already; numbers and
    legend are 7/8 as high, as in a figure of nsdrill."""
    given = Figure().subplots()
    figures.draw(speeds, panel="bit_speed", ax=given, look=look_of(font_size=6))
    assert sizes(given) == [6.0, 5.25, 6.0, 5.25, 5.25]
    with mpl.rc_context({"font.size": 12.0}):
        own = Figure().subplots()
    figures.draw(speeds, panel="bit_speed", ax=own)
    assert sizes(own) == [12.0, 12.0, 12.0, 12.0, 10.5]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"style": "dark_background"}, r"^style: found with ax, .*; allowed: without ax\. .* with plt\.style\.context"),
        ({"width": "3 in"}, r"^width: found with ax, .* plt\.subplots\(figsize="),
        ({"height": 0.1}, r"^height: found with ax, "),
        ({"title": "A"}, r"^title: found with ax, .* ax\.set_title"),
    ],
)
def test_what_belongs_to_a_figure_is_refused_with_axes(speeds, given, words):
    axes = Figure().subplots()
    with pytest.raises(InputError, match=words):
        nsdrill.plot(to_dataset(speeds), panel="radius_peaks", ax=axes, **given)
    assert not axes.has_data()
    nsdrill.plot(to_dataset(speeds), panel="radius_peaks", ax=axes, title=False)


def test_two_pictures_in_the_same_axes(speeds, branches):
    """The limits reach as far as both, and the legend has what both of them show, once."""
    axes, first = Figure().subplots(), Figure().subplots()
    for one in (first, axes):
        figures.draw(speeds, panel="radius", ax=one)
    figures.draw(branches, panel="radius", ax=axes)
    assert axes.get_ylabel() == first.get_ylabel()
    assert axes.get_xlim() == pytest.approx((min(first.get_xlim()[0], 2.0), max(first.get_xlim()[1], 8.0)))
    words = words_in(axes.get_legend())
    assert words[: len(words_in(first.get_legend()))] == words_in(first.get_legend())
    assert {"stable", "unstable", "fold"} < set(words)
    assert len(set(words)) == len(words)
    figures.draw(branches, panel="radius", ax=axes, look=look_of(xlim=(4.0, 6.0)))
    assert axes.get_xlim() == (4.0, 6.0)


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize("columns", [1, 2])
def test_in_small_axes_of_a_user_the_panel_keeps_its_room(speeds, columns):
    """The entries of the legend stand in as many columns as the room of the axes has."""
    figure = Figure(figsize=(3.3 * columns, 2.5), layout="constrained")
    with mpl.rc_context({"legend.fontsize": 7.0}):
        for axes in np.ravel(figure.subplots(1, columns)):
            nsdrill.plot(to_dataset(speeds), panel="radius_peaks", ax=axes)
    figure.draw_without_rendering()
    page = figure.bbox
    for number, axes in enumerate(figure.axes):
        legend, panel = axes.get_legend(), axes.get_window_extent()
        assert len(legend.get_texts()) > 6
        assert sizes(axes) == [10.0, 10.0, 10.0, 10.0, 7.0]
        assert panel.height > 0.4 * page.height
        left, right = page.width / columns * number, page.width / columns * (number + 1)
        assert left <= legend.get_window_extent().x0 < legend.get_window_extent().x1 <= right
        label = axes.yaxis.label.get_window_extent()
        assert label.x0 > max((other.get_window_extent().x1 for other in figure.axes[:number]), default=0.0)
        for box in (legend.get_window_extent(), label):
            assert -1 <= box.y0 < box.y1 <= page.height + 1
        assert not legend.get_window_extent().overlaps(axes.xaxis.label.get_window_extent())


@pytest.mark.usefixtures("laid_out")
def test_a_high_legend_takes_no_room_from_the_panels(speeds):
    def height(width):
        figure = figures.draw(speeds, look=look_of(width=width))
        return [axes.get_window_extent().height / figure.dpi for axes in figure.axes[1:]]

    assert height("3.3 in") == pytest.approx(height("7 in"), rel=0.1)


def test_limits_of_the_y_axis_with_units(speeds):
    def shown(**look):
        return [axes.get_ylim() for axes in figures.draw(speeds, look=look_of(**look)).axes]

    usual, limited = shown(), shown(ylim=("0 rpm", "60 rpm"))
    assert limited[2] == pytest.approx((0.0, 60 * np.pi / 30))
    assert [limited[i] for i in (0, 1, 3)] == [usual[i] for i in (0, 1, 3)]
    figure = figures.draw(speeds, "lift_off", look=look_of(ylim=("10 %", "50 %")))
    assert figure.axes[1].get_ylim() == pytest.approx((10, 50))
    figure = figures.draw(speeds, panel="radius_peaks", look=look_of(ylim=(0.0, 0.04)))
    assert figure.axes[0].get_ylim() == pytest.approx((0, 40))
    figure = figures.draw(speeds, "stick_slip_index", look=look_of(ylim=(0, 50)))
    assert not [one for one in figure.axes[1].lines if "beyond" in str(one.get_gid())]


def test_limits_of_an_axis_of_the_sweep_along_y():
    data = make_results(wob=np.linspace(1e4, 6e4, 6), rotary_speed=np.linspace(1, 8, 9))
    for kind in ("map", "stick_slip_index", "window"):
        figure = figures.draw(data, kind, look=look_of(ylim=("20 kN", "40 kN")))
        assert figure.axes[0].get_ylim() == pytest.approx((20, 40)), kind


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        (("0 mm", "40 mm"), "found panels of axial_peaks, radius_peaks .* Choose it with panel"),
        (("0 kN", "40 kN"), "ylim: "),
        (("60 rpm", "0 rpm"), "ylim: found 6.28319 to 0 rad/s; allowed: the lower end first"),
    ],
)
def test_limits_that_do_not_fit(speeds, ends, words):
    with pytest.raises(nsdrill.InputError, match=words):
        figures.draw(speeds, look=look_of(ylim=ends))


def frozen(*modes: str) -> dict[str, Any]:
    return {"study_resolved": json.dumps({"modes": {mode: "frozen" for mode in modes}})}


def words_of(figure: Any) -> list[str]:
    return [axes.get_ylabel().partition(" [")[0] for axes in figure.axes if axes.get_ylabel()]


def returns(*modes: str) -> Results:
    """A sweep with the section of a trace at every point."""
    results = make_results(rotary_speed=(2.0, 3.0, 4.0))
    for name, values in section_of(make_trace()).items():
        results.variables[name] = values + 0.0 * results["bit_speed_max"][..., None]
    results.variables["motion"] = results["status"] * 0 + 2
    results.variables["period"] = results["status"] * 0 + 1
    results.attrs.update(frozen(*modes))
    return results


@pytest.fixture(scope="module")
def frozen_trace():
    return make_trace()


@pytest.mark.parametrize(
    ("mode", "kind", "shown"),
    [
        ("lateral", "histories", ["$z$", "Bit speed", "Bit force", "Bit torque"]),
        ("axial", "histories", ["Bit speed", "$r$", "Bit torque", "Wall force"]),
        ("torsional", "histories", ["$z$", "$r$", "Bit force", "Bit torque", "Wall force"]),
        ("lateral", "phase", ["$\\dot z$", "Bit speed"]),
        ("axial", "phase", ["Bit speed", "$\\dot r$"]),
        ("lateral", "section", ["$\\dot z$", "Bit speed"]),
        ("torsional", "section", ["across", "$\\dot z$", "$\\dot r$"]),
        ("lateral", "trace", ["$z$", "Bit speed", "Bit force", "Bit torque", "$\\dot z$", "Bit speed"]),
    ],
)
def test_of_a_trace(frozen_trace, mode, kind, shown):
    figure = figures.draw(Trace(frozen_trace.time, frozen_trace.variables, frozen_trace.attrs | frozen(mode)), kind)
    assert words_of(figure) == shown


@pytest.mark.parametrize(
    ("modes", "kind", "shown"),
    [
        (("lateral",), "bifurcation", ["Axial peaks $z$", "Bit speed peaks"]),
        (("axial", "lateral"), "bifurcation", ["Bit speed peaks"]),
        (("torsional",), "summary", ["Time off the rock", "Time on the wall", "Whirl ratio"]),
        (("lateral",), "poincare", ["$z$", "Bit speed"]),
        (("axial",), "poincare", ["$r$", "Whirl angle from bit", "Bit speed"]),
    ],
)
def test_of_a_sweep(modes, kind, shown):
    assert words_of(figures.draw(returns(*modes), kind)) == shown


def test_of_a_ramp():
    frozen_trace = make_trace()
    frozen_trace.variables["drive_speed"] = frozen_trace.time / 20.0
    frozen_trace.attrs |= frozen("torsional")
    assert words_of(figures.draw(frozen_trace, "ramp")) == ["Axial peaks $z$", "Radial peaks $r$"]


def test_the_orbit_of_a_string_without_lateral_motion_is_refused(frozen_trace):
    alone = Trace(frozen_trace.time, frozen_trace.variables, frozen_trace.attrs | frozen("lateral"))
    assert "orbit" not in figures.kinds_for(alone)
    with pytest.raises(InputError, match=r"'orbit', which does not fit a trace \(the lateral motion is frozen"):
        figures.draw(alone, "orbit")


def test_every_variable_that_is_drawn_has_a_mode_or_moves_with_several():
    drawn = described("christoforou_yigit").drawn
    names = {*drawn.histories, *sum(drawn.planes, ()), *drawn.section, *sum(drawn.section_planes, ()), *drawn.summary}
    names |= {one[1] for one in drawn.attractors}
    assert names - set(drawn.modes) == {"bit_torque"}
    assert drawn_in(frozen("axial", "lateral")).attractors == ((None, "stick_slip_index", "Stick-slip index"),)
    assert drawn_in({}) is drawn


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize(("middle", "swing", "opened"), [(-0.884, 1e-8, True), (0.0, 1e-15, True), (3.0, 1e-3, False)])
def test_the_last_digits_of_a_value_do_not_fill_a_panel(middle, swing, opened):
    with house_style():
        figure = new_figure(3.0, 3.0)
        axes = figure.add_subplot()
        values = middle + swing * np.sin(np.arange(50.0))
        axes.plot(np.arange(50.0), values)
        freeze_layout(figure)
    low, high = axes.get_ylim()
    assert low < values.min() < values.max() < high
    assert (np.ptp(values) < 1e-3 * (high - low)) == opened
    assert max(len(label.get_text()) for label in axes.get_yticklabels()) <= 7


def test_a_plane_of_rounding_is_left_out():
    trace = make_trace()
    noise = 1e-15 * np.sin(np.arange(len(trace.time)))
    still = replace(trace, variables={**trace.variables, "z": -8.8e-4 + noise * 1e-3, "vz": noise})
    assert {"z", "vz"} & {name for pair in planes_of(trace) for name in pair}
    assert not {"z", "vz"} & {name for pair in planes_of(still) for name in pair}


@pytest.mark.parametrize(("part", "wall"), [(0.05, False), (0.9, True)])
def test_an_orbit_fills_its_panel_and_the_wall_is_there_where_it_is_near(part, wall):
    trace = make_trace()
    gap, angle = float(trace.attrs["gap"]), 3.0 * trace.time
    x, y = part * gap * np.cos(angle), part * gap * np.sin(angle)
    trace = replace(trace, variables={**trace.variables, "x": x, "y": y, "wall_force": np.zeros(len(x))})
    (axes,) = figures.draw(trace, "orbit").axes
    half = axes.get_xlim()[1]
    assert 1e3 * part * gap < half < 1.5e3 * part * gap
    assert (half > 1e3 * gap) == wall
    assert ("wall at" in axes.get_title()) != wall


def test_a_turn_along_the_wall_is_no_polygon():
    trace = make_trace()
    gap, time = float(trace.attrs["gap"]), np.arange(0.0, 2.0, 0.02)
    angle = -30.0 * time
    made = {
        "x": gap * np.cos(angle),
        "y": gap * np.sin(angle),
        "vx": 30.0 * gap * np.sin(angle),
        "vy": -30.0 * gap * np.cos(angle),
        "wall_force": np.ones(len(time)),
    }
    variables = {name: values[: len(time)] for name, values in trace.variables.items()} | made
    (axes,) = figures.draw(replace(trace, time=time, variables=variables), "orbit").axes
    (line,) = [line for line in axes.lines if line.get_gid() == "orbit:wall"]
    chords = np.column_stack(
        [0.5 * (line.get_xdata()[1:] + line.get_xdata()[:-1]), 0.5 * (line.get_ydata()[1:] + line.get_ydata()[:-1])]
    )
    # between samples alone it would be cos(0.3) of it
    assert np.hypot(*chords.T).min() > 0.998e3 * gap


def test_without_a_title_there_is_no_strip_for_it():
    trace = make_trace()
    plain, bare = (figures.draw(trace, "orbit", look=look_of(title=title)) for title in (None, False))
    assert bare.get_figheight() < plain.get_figheight() - 0.25
    assert bare.axes[0].get_title() == ""
    assert figures.draw(trace, "orbit", look=look_of(title=False, height="5in")).get_figheight() == pytest.approx(5.0)


def test_strings_that_differ_are_told_by_their_keys():
    def study(axial="free", **bit):
        sections = {"bit": {"lobes": 3, **bit}, "modes": {"axial": axial}}
        return json.dumps({"title": "any", **sections, "simulation": {"rtol": bit.get("rock_stiffness", 1)}})

    def sweep(text):
        results = make_results(rotary_speed=np.linspace(1, 8, 5))
        return replace(results, attrs={**results.attrs, "study_resolved": text})

    one = {"study_resolved": study(rock_stiffness=0.3)}
    wob = float(sweep("{}").coords["wob"][0])
    assert other_string(one, sweep(study(rock_stiffness=0.3)), {"wob": wob}) == []
    assert other_string(one, sweep(study(rock_stiffness=0.4)), {"wob": wob}) == [("bit.rock_stiffness", 0.3, 0.4)]
    assert other_string(one, sweep(study(rock_stiffness=0.4)), {"wob": wob}, {"bit.rock_stiffness"}) == []
    assert [key for key, *_ in other_string(one, sweep(study(rock_stiffness=0.3)), {"wob": 2 * wob})] == [
        "operation.wob"
    ]
    # what neither string reads does not tell them apart
    smooth = {"study_resolved": study("frozen", surface_amplitude=0.0)}
    assert other_string(smooth, sweep(study("frozen", surface_amplitude=1e-3)), {}) == []
    other = study("frozen", surface_amplitude=1e-3, cutting={"zeta": 0.9})
    smooth_zeta = {"study_resolved": study("frozen", surface_amplitude=0.0, cutting={"zeta": 1.0})}
    assert other_string(smooth_zeta, sweep(other), {}) == [("bit.cutting.zeta", 1.0, 0.9)]
    free = other_string(smooth, sweep(study(surface_amplitude=1e-3)), {})
    assert [key for key, *_ in free] == ["bit.surface_amplitude", "modes.axial"]
