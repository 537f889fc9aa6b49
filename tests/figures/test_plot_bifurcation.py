"""The bifurcation diagram holds every peak, in the colour of its response, and shades
where up and down differ."""

import json

import numpy as np
import pytest
from made_up import GAP, covered, make_results
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from seen import artists, legend_words

from nsdrill import figures
from nsdrill.data import Results
from nsdrill.errors import InputError
from nsdrill.figures.kinds.bifurcation import with_greatest
from nsdrill.figures.look import look_of
from nsdrill.figures.slices import edges, robust_limits
from nsdrill.figures.style import MANY_MARKERS, RESPONSES, contrast
from nsdrill.models.responses import BIT_BOUNCE, STICK_SLIP, WHIRL
from nsdrill.variables import DIVERGED, OK

PEAKS = ("axial_peaks", "bit_speed_peaks", "radius_peaks")


def panel(figure: Figure, label: str) -> Axes:
    return next(axes for axes in figure.axes if axes.get_ylabel() == label)


@pytest.mark.parametrize("name", PEAKS)
def test_every_finite_peak_of_a_good_point_is_drawn(speeds, name):
    figure = figures.draw(speeds)
    good = speeds["status"] == OK
    expected = np.sort(speeds[name][good][np.isfinite(speeds[name][good])])
    scale = 1.0 if name == "bit_speed_peaks" else 1e-3
    found = np.sort(np.concatenate([line.get_ydata() for line in artists(figure, f"{name}:")])) * scale
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("name", PEAKS)
def test_colour_shape_and_filling(speeds, name):
    for line in artists(figures.draw(speeds), f"{name}:"):
        _, procedure, code = line.get_gid().split(":")
        style = RESPONSES[int(code)]
        assert (to_hex(line.get_color()), line.get_marker()) == (style.colour.lower(), style.marker)
        assert (line.get_markerfacecolor() == "none") == (procedure == "down")
        # The points drawn are those of this response and direction.
        row = list(speeds.coords["procedure"]).index(procedure)
        mine = (speeds["response"][row, 0, 0] == int(code)) & (speeds["status"][row, 0, 0] == OK)
        assert set(line.get_xdata()) <= set(speeds.coords["rotary_speed"][mine])


@pytest.mark.parametrize("kind", ["bifurcation", "value"])
def test_what_had_not_settled_is_hatched_in_the_strip(speeds, kind):
    """Hatching is seen in print and without colours; what failed has a cross alone."""
    assert not any("unsettled" in words for words in legend_words(figures.draw(speeds, kind)))
    speeds.variables["settled"][:, 0, 0, ::3] = 0
    figure = figures.draw(speeds, kind)
    (hatched,) = artists(figure, "unsettled")
    assert hatched.get_hatch()
    x = speeds.coords["rotary_speed"]
    expected = (speeds["settled"][:, 0, 0] == 0) & (speeds["status"][:, 0, 0] == OK)
    assert np.array_equal(covered(hatched, x, [0.0, 1.0]), expected)
    number = np.count_nonzero(expected)
    assert f"not settled ({number} of {expected.size})" in legend_words(figure)


def test_shading_is_where_up_and_down_differ(speeds):
    figure = figures.draw(speeds)
    response, good = speeds["response"][:, 0, 0], (speeds["status"][:, 0, 0] == OK).all(axis=0)
    differ, borders = (response[0] != response[1]) & good, edges(speeds.coords["rotary_speed"])
    starts = [i for i in range(len(differ)) if differ[i] and (i == 0 or not differ[i - 1])]
    ends = [i for i in range(len(differ)) if differ[i] and (i == len(differ) - 1 or not differ[i + 1])]
    expected = [(borders[a], borders[b + 1]) for a, b in zip(starts, ends, strict=True)]
    assert len(expected) >= 3
    for axes in figure.axes[1:]:
        spans = [patch for patch in axes.patches if patch.get_gid() == "hysteresis"]
        found = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in spans)
        np.testing.assert_allclose(found, expected)
    assert "up and down differ in response" in legend_words(figure)


@pytest.mark.parametrize("width", ["3.3 in", "7 in"])
def test_letters_name_the_responses_of_the_strip(width):
    """Below 4 rad/s stick-slip, above bit-bounce with whirl, but for one narrow cell; in
    grey their colours are those of other responses."""

    def rule(way, depth, wob, speed):
        return STICK_SLIP if speed < 4.0 else 0 if speed > 7.9 else BIT_BOUNCE | WHIRL

    data = make_results(rotary_speed=np.linspace(1, 8, 141), procedures=("up", "down"), rule=rule)
    data["response"][1, 0, 0, 100] = BIT_BOUNCE
    figure = figures.draw(data, look=look_of(width=width))
    strip = figure.axes[0]
    assert [text.get_text() for text in strip.texts] == ["S", "BW", "S", "BW", "BW"]
    assert [text.get_position()[1] for text in strip.texts] == [0, 0, 1, 1, 1]
    first = strip.texts[0]
    assert first.get_position()[0] == pytest.approx((0.975 + 3.975) / 2), "the middle of the cells"
    for text in strip.texts:
        ground = RESPONSES[int(text.get_gid().removeprefix("area:"))].colour
        assert contrast(np.array(to_rgb(text.get_color())), np.array(to_rgb(ground))) > 4.5, "WCAG 2.1"
    assert {"S stick-slip", "BW bit-bounce + whirl", "no critical response"} <= set(legend_words(figure))


def test_failed_points_are_crossed_and_counted(speeds):
    figure = figures.draw(speeds)
    crosses = artists(figure, "failed")
    assert sum(len(line.get_xdata()) for line in crosses) == 3
    assert "failed (3 of 122)" in legend_words(figure)


def test_points_without_peaks_are_drawn_at_their_constant_value():
    data = make_results(rotary_speed=np.linspace(3, 5, 11))
    data["axial_peaks"][0, 0, 0, 4:7] = np.nan
    figure = figures.draw(data)
    [dashes] = artists(figure.axes[1], "no peaks:")
    np.testing.assert_allclose(dashes.get_xdata(), data.coords["rotary_speed"][4:7])
    np.testing.assert_allclose(dashes.get_ydata(), data["axial_max"][0, 0, 0, 4:7] * 1e3)
    words = "no peaks: greatest value"
    assert words in legend_words(figure)
    alone = {name: legend_words(figures.draw(data, panel=name)) for name in ("axial_peaks", "radius_peaks")}
    assert words in alone["axial_peaks"]
    assert words not in alone["radius_peaks"], "there every point has peaks"


def test_wall_where_it_is_in_sight():
    whirling = make_results(rotary_speed=np.linspace(5, 8, 5))
    [wall] = artists(figures.draw(whirling), "wall")
    np.testing.assert_allclose(wall.get_ydata(), GAP * 1e3)
    calm = make_results(rotary_speed=np.linspace(3, 4, 5), rule=lambda *_: 0)
    figure = figures.draw(calm)
    assert not artists(figure, "wall")
    [words] = artists(figure, "wall afar")
    assert words.get_text() == "\u2191 wall at 76.2 mm"
    assert not any("wall" in word for word in legend_words(figure)), "no wall is drawn"
    del calm.attrs["gap"]
    assert not artists(figures.draw(calm), "wall afar")


def test_a_state_carried_along_the_depth_goes_deeper():
    """Depth increases downwards: up along it would be read as coming out of the hole."""
    results = make_results(depth=np.linspace(500, 9000, 9), rotary_speed=(1.5,), procedures=("up", "down"))
    results.attrs["study_resolved"] = json.dumps({"sweep": {"along": "depth", "procedure": "up-down"}})
    figure = figures.draw(results)
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == ["deeper", "shallower"]
    assert {"deeper: filled", "shallower: open", "deeper and shallower differ in response"} <= set(legend_words(figure))


@pytest.mark.parametrize(
    ("units", "labels", "x", "title"),
    [
        (
            "si",
            ["Axial peaks $z$ [mm]", "Bit speed peaks [rad/s]", "Radial peaks $r$ [mm]"],
            "Rotary speed [rad/s]",
            "5000 m, 22.24 kN",
        ),
        (
            "field",
            ["Axial peaks $z$ [in]", "Bit speed peaks [rpm]", "Radial peaks $r$ [in]"],
            "Rotary speed [rpm]",
            "16404 ft, 5 klbf",
        ),
    ],
)
def test_labels_have_units(speeds, units, labels, x, title):
    figure = figures.draw(speeds, units=units)
    assert [axes.get_ylabel() for axes in figure.axes[1:]] == labels
    assert figure.axes[-1].get_xlabel() == x
    assert figure.get_suptitle().splitlines()[-1] == title


def test_field_units_are_exact(speeds):
    [drive] = artists(figures.draw(speeds, units="field"), "rotary speed")
    np.testing.assert_allclose(drive.get_xdata(), speeds.coords["rotary_speed"] * 30 / np.pi, rtol=1e-14)


def test_an_unordered_axis_is_put_in_order():
    data = make_results(rotary_speed=(5.0, 2.0, 8.0))
    ordered = make_results(rotary_speed=(2.0, 5.0, 8.0))
    strip = figures.draw(data).axes[0].collections[0].get_array()
    np.testing.assert_array_equal(strip, figures.draw(ordered).axes[0].collections[0].get_array())


def test_markers_of_a_large_sweep_are_rasterised_and_text_is_not():
    large = make_results(rotary_speed=np.linspace(1, 8, 231), procedures=("up", "down"))
    assert sum(np.isfinite(large[name]).sum() for name in PEAKS) > MANY_MARKERS
    figure = figures.draw(large)
    assert all(line.get_rasterized() for name in PEAKS for line in artists(figure, f"{name}:"))
    assert not any(text.get_rasterized() for text in figure.legends[0].get_texts())
    assert not any(line.get_rasterized() for line in artists(figures.draw(make_results()), "axial_peaks:"))


@pytest.mark.usefixtures("laid_out")
def test_words_stay_on_the_paper(speeds):
    """No label is clipped: all words of the figure lie within it."""
    for figure in (figures.draw(speeds), figures.draw(speeds, "summary", units="field")):
        box, page = figure.get_tightbbox(), figure.bbox_inches
        assert box.x0 >= -0.01
        assert box.y0 >= -0.01
        assert box.x1 <= page.x1 + 0.01
        assert box.y1 <= page.y1 + 0.01


def test_a_sweep_without_peaks_has_no_bifurcation_diagram(speeds):
    bare = Results(speeds.coords, {k: v for k, v in speeds.variables.items() if k not in PEAKS}, speeds.attrs)
    assert figures.kinds_for(bare)[0] == "value"
    with pytest.raises(InputError, match=r"record\.peaks"):
        figures.draw(bare, "bifurcation")
    assert figures.draw(bare).axes


def test_summary_draws_values_of_good_points_and_marks_those_beyond(speeds):
    speeds["status"][0, 0, 0, 3] = OK
    speeds["whirl_ratio"][0, 0, 0, 3] = 1e6
    speeds["status"][0, 0, 0, 9] = DIVERGED
    figure = figures.draw(speeds, "summary")
    [line] = [line for line in artists(figure, "lift_off_fraction:up")]
    good = speeds["status"][0, 0, 0] == OK
    np.testing.assert_allclose(line.get_ydata()[good], speeds["lift_off_fraction"][0, 0, 0][good] * 100)
    assert np.isnan(line.get_ydata()[~good]).all()
    [beyond] = artists(figure, "whirl_ratio:up:beyond")
    assert list(beyond.get_xdata()) == [speeds.coords["rotary_speed"][3]]
    assert panel(figure, "Whirl ratio").get_ylim()[1] < 2


def test_severity_bands(speeds):
    axes = panel(figures.draw(speeds, "summary"), "Stick-slip index [%]")
    starts = [patch.get_y() for patch in axes.patches if str(patch.get_gid()).startswith("severity")]
    assert starts == [0, 40, 60, 80, 100]  # the severity table of the directional-drilling paper


def test_severity_bands_are_those_in_force_in_the_file(speeds):
    """The study's; after a new classification, that one's. A fraction is drawn in
    percent."""

    def starts(label):
        axes = panel(figures.draw(speeds, "summary"), label)
        return [patch.get_y() for patch in axes.patches if str(patch.get_gid()).startswith("severity")]

    thresholds = {"stick_slip": {"oscillation_index": 30.0, "severe_index": 120.0}}
    speeds.attrs["study_resolved"] = json.dumps({"classify": thresholds})
    assert starts("Stick-slip index [%]") == [0, 30, 60, 80, 120]
    assert starts("Time off the rock [%]") == [0, 1, 10, 30, 60]
    speeds.attrs["classification_resolved"] = json.dumps({"stick_slip": {"medium_index": 55.0}})
    assert starts("Stick-slip index [%]") == [0, 40, 55, 80, 100]


def test_edges():
    np.testing.assert_allclose(
        edges(np.array([1.0, 2.0, 4.0])), [0.5, 1.5, 3.0, 4.5]
    )  # the last step is twice the least
    np.testing.assert_allclose(edges(np.array([3.0])), [2.85, 3.15])
    np.testing.assert_allclose(edges(np.array([1.0, 4.0, 16.0, 64.0])), [0.5, 2.0, 8.0, 32.0, 128.0])


def test_robust_limits_keep_all_but_the_wild():
    assert robust_limits(np.linspace(0, 1, 101)) == (0.0, 1.0)
    assert robust_limits(np.append(np.linspace(0, 1, 101), 1e6))[1] < 1.01
    assert robust_limits(np.array([np.nan])) == (0.0, 1.0)
    assert robust_limits(np.array([2.0, 2.0])) == (1.0, 3.0)


def test_the_slip_is_drawn_where_the_last_peaks_are_ripples(speeds):
    """Peaks below half of the greatest value leave it out: it is drawn as well."""
    speeds.variables["bit_speed_peaks"][0, 0, 0, 7] = 1e-3
    speeds.variables["bit_speed_max"][0, 0, 0, 7] = 6.5
    at = speeds["rotary_speed"][7]
    figure = figures.draw(speeds, panel="bit_speed_peaks")
    drawn_there = [
        y
        for one in figure.axes[0].lines
        if str(one.get_gid()).startswith("bit_speed_peaks:up")
        for x, y in np.asarray(one.get_xydata())
        if x == at
    ]
    assert set(drawn_there) == {1e-3, 6.5}
    peaks, greatest = np.array([[1.0, 2.0], [np.nan, np.nan], [-3.0, -2.0]]), np.full(3, 3.9)
    assert np.isnan(with_greatest(peaks, greatest)[:2, -1]).all(), "nearly there; no peaks at all"
    assert with_greatest(peaks, greatest)[2, -1] == 3.9
