"""The picture of the operating window, the trade-off of rate and safety, and measurements
on pictures."""

from dataclasses import replace

import numpy as np
import pytest
from made_up import covered, make_results, spoil
from matplotlib.colors import to_rgb
from seen import artists, legend_words, maps

from nsdrill import plot
from nsdrill.analysis.fitting import Measured
from nsdrill.analysis.window import find_window
from nsdrill.data import Results, json_text
from nsdrill.errors import InputError
from nsdrill.models.responses import STICK_SLIP, WHIRL
from nsdrill.plot.kinds.uncertain import pareto_front
from nsdrill.plot.kinds.window import CRITICAL_COLOURS, SAFE_CODE, UNKNOWN_CODE, draw_two
from nsdrill.plot.measured import overlay
from nsdrill.plot.style import GREY, RESPONSES, SAFE_COLOUR
from nsdrill.variables import SAMPLE


@pytest.fixture
def both():
    return make_results(wob=np.linspace(10e3, 50e3, 7), rotary_speed=np.linspace(1, 8, 15), procedures=("up", "down"))


def test_areas_are_those_of_the_note(both):
    figure = plot.draw(both, "window")
    [axes] = maps(figure)
    cells = artists(axes, "cells")[0].get_array()
    response = both["response"][:, 0].astype(int)
    good, bits = response == 0, response[0] | response[1]
    np.testing.assert_array_equal(cells, np.where(good.any(axis=0), SAFE_CODE, bits))
    note = find_window(both)
    by_history = good.any(axis=0) & ~good.all(axis=0)
    hatched = 0
    for code in np.unique(bits[by_history]):
        [area] = artists(axes, f"rim:{code}")
        shown = covered(area, both["rotary_speed"], both["wob"] / 1e3)
        np.testing.assert_array_equal(shown, by_history & (bits == code))
        hatched += shown.sum()
    assert hatched == note["rim"] > 0
    assert any(f"history-dependent ({100 * note['share']['rim']:.1f} %)" in word for word in legend_words(figure))


@pytest.mark.parametrize(("units", "speed", "weight"), [("si", 1.0, 1e3), ("field", np.pi / 30, 4448.2216152605)])
def test_the_recommended_point_and_its_bars(both, units, speed, weight):
    [axes] = maps(plot.draw(both, "window", units=units))
    best = find_window(both)["maps"][0]["recommended"]
    [point] = artists(axes, "recommended")
    np.testing.assert_allclose(point.get_xydata(), [[best["rotary_speed"] / speed, best["wob"] / weight]])
    bars = [path for box in axes.containers[-1].lines[2] for path in box.get_segments()]
    ends = {axis: [sides["less"]["safe_to"], sides["more"]["safe_to"]] for axis, sides in best["margins"].items()}
    np.testing.assert_allclose(bars[0][:, 0] * speed, ends["rotary_speed"])
    np.testing.assert_allclose(bars[1][:, 1] * weight, ends["wob"])


def test_a_panel_for_every_depth_up_to_a_dozen():
    def titles(depths):
        data = make_results(
            depth=np.linspace(1e3, 3e3, depths),
            wob=np.linspace(1e4, 5e4, 20),
            rotary_speed=np.linspace(1, 8, 21),
            procedures=("up",),
        )
        return [axes.get_title() for axes in maps(plot.draw(data, "window"))]

    assert titles(3) == ["1000 m", "2000 m", "3000 m"]
    many = titles(17)
    assert len(many) == 12
    assert (many[0], many[-1]) == ("1000 m", "3000 m")


def test_one_axis_is_a_strip():
    data = make_results(rotary_speed=np.linspace(1, 8, 15), procedures=("up", "down"))
    assert "window" in plot.kinds_for(data)
    [axes] = maps(plot.draw(data, "window"))
    assert len(axes.get_yticks()) == 0
    assert "window" not in plot.kinds_for(make_results())


def test_failed_points_and_one_procedure_are_told(both):
    spoiled = spoil(both, diverged=3, step_limit=0)
    figure = plot.draw(spoiled, "window")
    assert "unknown (3 failed)" in legend_words(figure)
    note = find_window(spoiled)
    response = spoiled["response"][:, 0].astype(int)
    for code in np.unique(response[0] | response[1])[1:]:
        assert any(RESPONSES[code].name in word for word in legend_words(figure)), code
    assert note["unknown"] == 3
    [axes] = maps(figure)
    unknown = artists(axes, "unknown")[0]
    assert covered(unknown, both["rotary_speed"], both["wob"] / 1e3).sum() == 3
    alone = make_results(wob=(1e4, 2e4, 3e4, 4e4), rotary_speed=np.linspace(1, 8, 15))
    assert any("history not examined" in word for word in legend_words(plot.draw(alone, "window")))
    assert not any("history-dependent" in word for word in legend_words(plot.draw(alone, "window")))


def test_nothing_safe_is_still_a_picture(both):
    both["response"][:] = WHIRL
    [axes] = maps(plot.draw(both, "window"))
    assert not axes.get_lines()


def test_by_severity(both):
    both["whirl_severity"][:] = 2
    assert find_window(both, 1)["safe"] == 0
    [axes] = maps(plot.draw(both, "window", severity=2))
    cells = artists(axes, "cells")[0].get_array()
    assert (np.asarray(cells) == SAFE_CODE).all()


def luminance(colour: str) -> float:
    """Relative luminance (Rec. 709, linear)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    return float(np.dot((0.2126, 0.7152, 0.0722), linear))


def test_one_colour_for_safe_and_grey_for_what_is_not_known():
    """Safe is the lightest area, that of the map too; a critical one has the colour of
    its response; grey is neither."""
    assert RESPONSES[0].colour == SAFE_COLOUR
    assert CRITICAL_COLOURS[1:] == tuple(style.colour for style in RESPONSES[1:])
    assert max(map(luminance, CRITICAL_COLOURS)) < luminance(SAFE_COLOUR)
    assert GREY not in {SAFE_COLOUR, *CRITICAL_COLOURS}


def test_every_area_is_named(both):
    """By its response or by letters, with a question mark where the history decides, so
    that the picture is read without colour."""
    both["response"][:] = 0
    both["response"][:, 0, :, :5] = STICK_SLIP
    both["response"][0, 0, :, 10:] = WHIRL
    figure = plot.draw(both, "window")
    [axes] = maps(figure)
    named = {text.get_text() for text in axes.texts}
    assert named & {"stick-slip", "S"}
    assert named & {"whirl?", "W?"}
    assert any("S stick-slip" in word for word in legend_words(figure))
    assert any("W whirl" in word and "by the history" in word for word in legend_words(figure))


def test_the_answer_and_its_warnings_are_in_the_picture(both):
    """What the text of the window says in capitals stands in the picture that is
    sent."""
    alone = make_results(wob=(1e4, 2e4, 3e4, 4e4), rotary_speed=np.linspace(1, 8, 15))
    passed = {
        "axis": "rotary_speed",
        "name": "wall_speed",
        "words": "the speed at which the collar reaches the wall",
        "told": "A COLLAR ON THE WALL MAY STAY THERE",
        "lasts": [2.0, 3.0],
        "min": 0.5,
        "max": 0.7,
        "safe_while": "nothing brings the collar to the wall",
        "from": 1.0,
        "everywhere": True,
        "each": False,
        "jumped": None,
    }
    alone.attrs["lasting_motions"] = json_text([passed])
    figure = plot.draw(alone, "window")
    [text] = [figure.legends[0].get_title().get_text().replace("\n  ", "")]
    for wanted in ("THE SWEEP BEGINS at 1 rad/s", "HISTORY WAS NOT EXAMINED"):
        assert wanted in text
    assert plot.draw(alone, "window")._suptitle.get_text().count("No safe point") == (find_window(alone)["safe"] == 0)
    sent = plot.draw(both, "window")
    assert "No setting can be recommended; the best hint is " in sent._suptitle.get_text()
    both["settled"][:] = 1
    sent = plot.draw(both, "window")
    assert "Run at " in sent._suptitle.get_text()
    assert "HISTORY DECIDES at" in sent.legends[0].get_title().get_text()


def test_the_cells_of_failed_runs_are_grey(both):
    [axes] = maps(plot.draw(spoil(both, diverged=3, step_limit=0), "window"))
    cells = artists(axes, "cells")[0].get_array()
    assert (np.asarray(cells) == UNKNOWN_CODE).sum() == 3


def test_two_windows_say_once_what_holds_for_both_and_where_the_first_is_safe(both):
    """The second is critical everywhere."""
    other = replace(both, variables={**both.variables, "response": np.full_like(both["response"], WHIRL)})
    figure = draw_two(both, other, ["one.h5", "two.h5"])
    left, right = maps(figure)
    assert [axes.get_title(loc="left").splitlines()[0] for axes in (left, right)] == ["a: one.h5", "b: two.h5"]
    assert "safe in a" in legend_words(figure)
    assert "safe in a" not in legend_words(draw_two(other, both, ["two.h5", "one.h5"])), "nothing is"
    ((told,), (told_of_one,)) = (artists(one, "warnings") for one in (figure, draw_two(both, both, ["x.h5", "x.h5"])))
    assert "a: HISTORY DECIDES" in told.get_text()
    assert "b: THE MAP ENDS: only" in told.get_text()
    assert all(line.startswith(("a and b: ", " ")) for line in told_of_one.get_text().splitlines())


def test_a_point_without_room_is_a_hint(both):
    """One safe cell alone: its marker is open and the legend says why; with room it is
    filled, if its motion settled."""
    both["settled"][:] = 1
    firm = artists(plot.draw(both, "window"), "recommended")[0]
    assert firm.get_markerfacecolor() == "#000000"
    both["response"][:] = WHIRL
    both["response"][:, 0, 2, 7] = 0
    figure = plot.draw(both, "window")
    hint = artists(figure, "recommended")[0]
    assert hint.get_markerfacecolor() == "white"
    assert "a hint, not a setting, bars to the last safe point" in legend_words(figure)


MANY_SPEEDS, MANY_WEIGHTS = np.array([2.0, 4.0, 6.0]), np.array([10e3, 20e3])
SAFE = np.array([[4, 3, 1], [3, 2, 0]])  # of 4 samples, by weight and speed


@pytest.fixture
def results():
    made = make_results(wob=MANY_WEIGHTS, rotary_speed=MANY_SPEEDS)
    coords = {**made.coords, SAMPLE: np.arange(4)}
    shape = (1, 1, 2, 3, 4)
    response = np.where(np.arange(4) < SAFE[..., None], 0, 2).reshape(shape).astype(np.int8)
    rate = np.broadcast_to((np.outer(MANY_WEIGHTS / 1e4, MANY_SPEEDS) / 3600.0)[None, None, ..., None], shape)
    variables = {
        "status": np.ones(shape, np.int8),
        "response": response,
        "rate_of_penetration": rate.copy(),
        "mechanical_specific_energy": 1e8 / np.maximum(rate, 1e-9),
    }
    return Results(coords, variables, made.attrs)


def test_the_front_is_what_nothing_beats():
    rng = np.random.default_rng(2)
    rate, probability = rng.integers(0, 8, (2, 60)).astype(float)
    beaten = [
        any(
            (r >= rate[i]) & (p >= probability[i]) & ((r > rate[i]) | (p > probability[i]))
            for r, p in zip(rate, probability, strict=True)
        )
        for i in range(60)
    ]
    expected = {(rate[i], probability[i]) for i in range(60) if not beaten[i]}
    found = pareto_front(rate, probability)
    assert {(rate[i], probability[i]) for i in found} == expected
    assert np.all(np.diff(probability[found]) > 0)


def test_the_points_are_rate_and_probability(results):
    figure = plot.draw(results, "trade-off")
    axes = figure.axes[0]
    [points] = artists(axes, "points")
    expected = np.column_stack([(25.0 * SAFE).ravel(), np.outer(MANY_WEIGHTS / 1e4, MANY_SPEEDS).ravel()])
    np.testing.assert_allclose(points.get_offsets(), expected)
    # 12 m/h is never safe, 8 in half of the samples, 6 in one: beaten; 4 in three, 2 in
    # all.
    [line] = artists(axes, "front")
    np.testing.assert_allclose(np.column_stack(line.get_data()), [[0, 12], [50, 8], [75, 4], [100, 2]])
    texts = [text.get_text() for text in axes.texts]
    assert "20 kN, 6 rad/s" in texts
    assert axes.get_ylabel() == "Rate of penetration [m/h]"


def test_an_energy_without_end_is_no_colour(results):
    results.variables["mechanical_specific_energy"][:] = np.inf
    axes = plot.draw(results, "trade-off", units="field").axes[0]
    [points] = artists(axes, "points:no energy")
    assert len(points.get_offsets()) == 6


SPEEDS, WEIGHTS = np.linspace(1.0, 6.0, 11), np.linspace(10e3, 60e3, 9)


def measured(**more):
    values = {"stick_slip_index": np.array([50.0, 80.0, 20.0]), "surface_torque_max": np.array([1e3, np.nan, 3e3])}
    errors = {name: 0.1 * one for name, one in values.items()}
    at = {"rotary_speed": np.array([2.0, 4.0, 5.0]), "wob": np.array([22e3, 22.5e3, 40e3])}
    return Measured("field.csv", at | more, values, errors, ("line 2", "line 3", "line 4"))


def test_values_lie_along_the_axis():
    results = make_results(rotary_speed=SPEEDS)
    figure = plot.draw(results, "stick_slip_index", units="field")
    assert overlay(figure, results, measured(), "field") == 2  # the third is at another weight
    [marks] = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "D"]
    np.testing.assert_allclose(marks.get_xdata(), np.array([2.0, 4.0]) * 30 / np.pi)
    assert marks.get_ydata().tolist() == [50.0, 80.0]
    figure = plot.draw(results, "surface_torque_max")
    assert overlay(figure, results, measured(), "si") == 1
    [marks] = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "D"]
    assert marks.get_ydata().tolist() == [1.0]  # kN m


def test_settings_are_crosses_on_a_map():
    results = make_results(rotary_speed=SPEEDS, wob=WEIGHTS, procedures=("up", "down"))
    for kind, panels in (("map", 3), ("window", 1)):
        figure = plot.draw(results, kind)
        assert overlay(figure, results, measured(), "si") == 3
        marks = artists(figure, "measured")
        assert 1 <= len(marks) <= panels
        np.testing.assert_allclose(marks[0].get_data(), [[2.0, 4.0, 5.0], [22.0, 22.5, 40.0]])


def test_what_has_no_place_is_told():
    along, plane = make_results(rotary_speed=SPEEDS), make_results(rotary_speed=SPEEDS, wob=WEIGHTS)
    far = measured(depth=np.full(3, 100.0))
    for results, kind, one, said in (
        (along, "stick_slip_index", far, "no measurement that has a place"),
        (along, "radius_max", measured(), "no measurement that has a place"),
        (plane, "map", far, "no measurement that has a place"),
        (make_results(depth=[1e3, 2e3, 3e3]), "stick_slip_index", measured(), "found no depth, which the sweep varies"),
    ):
        with pytest.raises(InputError, match=said):
            overlay(plot.draw(results, kind), results, one, "si")
