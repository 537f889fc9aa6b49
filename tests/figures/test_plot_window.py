"""The picture of the operating window, and measurements on pictures."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from analysis.grids import grid, told
from made_up import covered, make_results, spoil
from matplotlib.colors import to_rgb
from matplotlib.transforms import Bbox
from seen import artists, legend_words, maps

from nsdrill import figures
from nsdrill.analysis.advice import Unsettled
from nsdrill.analysis.confirmed import confirmed
from nsdrill.analysis.fitting import Measured
from nsdrill.analysis.maps import classes
from nsdrill.analysis.trials import SPEED_FIRST, TO_CORNER, WEIGHT_FIRST, Outcome, Trial, Trials, Way
from nsdrill.analysis.window import find_window, unknown_words
from nsdrill.data import Results, json_text
from nsdrill.errors import InputError
from nsdrill.figures.kinds.window_map import draw_two
from nsdrill.figures.map_panels import has_room_for_ticks
from nsdrill.figures.measured_overlay import overlay
from nsdrill.figures.style import ANY_HISTORY_COLOUR, GREY, RESPONSES, SAFE_COLOUR
from nsdrill.figures.zones import ALLOWED, ANY_HISTORY, BORDERLINE, UNKNOWN, zones
from nsdrill.models.choices import words_of as words_of_choice
from nsdrill.models.responses import STALLED, STICK_SLIP, WHIRL
from nsdrill.variables import SAMPLE
from nsdrill.words.answer import answer, headlines, words_of
from nsdrill.words.labels import operating_point


@pytest.fixture
def both():
    return make_results(wob=np.linspace(10e3, 50e3, 7), rotary_speed=np.linspace(1, 8, 15), procedures=("up", "down"))


def shown(axes):
    """The names of the classes of the cells of a map [y, x], by their codes."""
    return np.asarray(artists(axes, "cells")[0].get_array())


def test_colour_is_the_way_in(both):
    """A point that is clear coming up is allowed, and safe after any history where it is
    clear coming down too; one that is not has the colour of what it does coming up."""
    [axes] = maps(figures.draw(both, "window"))
    up, down = both["response"][:, 0].astype(int)
    expected = np.where(up > 0, up, np.where(down > 0, ALLOWED, ANY_HISTORY))
    np.testing.assert_array_equal(shown(axes), expected)
    assert {ALLOWED, ANY_HISTORY} < set(np.unique(expected))
    cells = artists(axes, "cells")[0]
    colours = cells.get_cmap().colors
    for code in np.unique(up[up > 0]):
        assert colours[code] == RESPONSES[code].colour, "that of the other pictures"
    assert (colours[ALLOWED], colours[ANY_HISTORY]) == (SAFE_COLOUR, ANY_HISTORY_COLOUR)


def test_corners_that_vibrated_in_trials_are_marked(both):
    """In the map of the answer, with their words in the legend, and none of their own in the way."""
    found = find_window(both)["answer"]
    weight, speed = (found.stay_within[axis].low for axis in ("wob", "rotary_speed"))
    corners = [
        Trial(TO_CORNER, Way.CORNER, outcome, speed=at, wob=weight)
        for outcome, at in ((Outcome.VIBRATES, speed), (Outcome.FREE, found.point["rotary_speed"]))
    ]
    [axes] = maps(figure := figures.draw(both, "window", tried=confirmed(found, Trials(tuple(corners)))))
    [mark] = artists(axes, "vibrated")
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == pytest.approx((speed, weight / 1e3))
    assert "vibrated in a trial: keep away" in legend_words(figure)
    [axes] = maps(figure := figures.draw(both, "window"))
    assert not artists(axes, "vibrated")
    assert "vibrated in a trial: keep away" not in legend_words(figure)


@pytest.mark.parametrize("is_withdrawn", [True, False])
def test_green_that_nobody_may_take_as_leave_is_pale_and_hatched(both, is_withdrawn):
    """Where trials withdraw the setting, or its runs had not settled, the page forbids every setting of the map; it was
    painted as one that is recommended."""
    found = find_window(both)["answer"]
    ways = tuple(Trial(name, Way.IN, Outcome.VIBRATES, ("whirl",), rate=1.0) for name in (WEIGHT_FIRST, SPEED_FIRST))
    unsettled = replace(found, unsettled=Unsettled(points=1, of=4, here=False, beside=0, short=False))
    tried = confirmed(found, Trials(ways)) if is_withdrawn else unsettled
    words = "withdrawn by trials: not to drill by" if is_withdrawn else "not settled: not to drill by"
    [axes] = maps(figure := figures.draw(both, "window", tried=tried))
    [area] = artists(axes, "revoked")
    allowed = classes(both).grades.allowed[0]
    np.testing.assert_array_equal(covered(area, both["rotary_speed"], both["wob"] / 1e3), allowed)
    assert len(artists(axes, "revoked:veil")) == 1
    assert words in legend_words(figure)
    assert not artists(axes, f"area:{ALLOWED}"), "no word calls it free"
    [axes] = maps(figure := figures.draw(both, "window", tried=replace(found, unsettled=None)))
    assert not artists(axes, "revoked")
    assert words not in legend_words(figure)


def test_a_cell_that_is_withdrawn_and_had_not_settled_has_one_hatch(both):
    """Red and black lines crossed over each other, a grey texture that read as neither."""
    found = find_window(both)["answer"]
    results = replace(both, variables={**both.variables, "settled": np.zeros_like(both["settled"])})
    unsettled = replace(found, unsettled=Unsettled(points=1, of=4, here=False, beside=0, short=False))
    [axes] = maps(figure := figures.draw(results, "window", tried=unsettled))
    allowed, at = classes(results).grades.allowed[0], (both["rotary_speed"], both["wob"] / 1e3)
    [area], [black] = artists(axes, "revoked:unsettled"), artists(axes, "unsettled")
    np.testing.assert_array_equal(covered(area, *at), allowed)
    np.testing.assert_array_equal(covered(black, *at), classes(results).unsettled[0] & ~allowed)
    assert not artists(axes, "revoked")
    assert "not settled: not to drill by, itself not settled" in legend_words(figure)


def test_white_hatching_is_free_only_when_lowered(both):
    [axes] = maps(figures.draw(both, "window"))
    up = both["response"][0, 0].astype(int)
    assert not artists(axes, "lowered"), "here the way down is no better"
    both["response"][1, 0, 2:5, 0:3] = 0
    [axes] = maps(figure := figures.draw(both, "window"))
    [area] = artists(axes, "lowered")
    only = (up > 0) & (both["response"][1, 0] == 0)
    np.testing.assert_array_equal(covered(area, both["rotary_speed"], both["wob"] / 1e3), only)
    assert only.any()
    assert area.get_edgecolor()[0].tolist() == [1.0, 1.0, 1.0, 1.0]
    assert any("free only when lowered from above" in word for word in legend_words(figure))
    np.testing.assert_array_equal(shown(axes)[only], up[only]), "below it the colour of the way in"


def test_what_had_not_settled_is_hatched_as_on_other_maps(both):
    assert not any("not settled" in words for words in legend_words(figures.draw(both, "window")))
    both.variables["settled"][0, 0, 2:5, 3:9] = 0  # on the way up, that in
    [axes] = maps(figure := figures.draw(both, "window"))
    [black], [red] = artists(axes, "unsettled"), artists(axes, "revoked:unsettled")  # of what is allowed, which is pale
    at = both["rotary_speed"], both["wob"] / 1e3
    unsettled, allowed = both["settled"][0, 0] == 0, classes(both).grades.allowed[0]
    np.testing.assert_array_equal(covered(black, *at), unsettled & ~allowed)
    np.testing.assert_array_equal(covered(red, *at), unsettled & allowed)
    assert "not settled (18 of 105)" in legend_words(figure)


def test_a_dark_line_surrounds_what_is_allowed(both):
    """It lies between an allowed cell and one that is not, and not along the edge of the
    map, beyond which nothing is known."""
    [axes] = maps(figures.draw(both, "window"))
    [line] = artists(axes, "field")
    allowed = both["response"][0, 0] == 0
    sides = np.count_nonzero(np.diff(allowed, axis=0)) + np.count_nonzero(np.diff(allowed, axis=1))
    assert len(line.get_segments()) == sides > 0
    x, y = (np.asarray(ends) for ends in (axes.get_xlim(), axes.get_ylim()))
    for (x0, y0), (x1, y1) in line.get_segments():
        assert not (x0 == x1 and x0 in x), "an edge of the map"
        assert not (y0 == y1 and y0 in y), "an edge of the map"
    assert luminance(line.get_colors()[0][:3]) < 0.1


@pytest.mark.parametrize(("units", "speed", "weight"), [("si", 1.0, 1e3), ("field", np.pi / 30, 4448.2216152605)])
def test_the_point_its_setting_and_the_bar(both, units, speed, weight):
    [axes] = maps(figures.draw(both, "window", units=units))
    advice = find_window(both)["answer"]
    [point] = artists(axes, "recommended")
    place = [advice.point["rotary_speed"] / speed, advice.point["wob"] / weight]
    np.testing.assert_allclose(point.get_xydata(), [place])
    [bar] = artists(axes, "recommended:within")
    within = advice.stay_within["rotary_speed"]
    np.testing.assert_allclose(bar.get_xdata() * speed, [within.low, within.high])
    np.testing.assert_allclose(bar.get_ydata(), 2 * [place[1]])
    [setting] = artists(axes, "setting")
    assert setting.get_fontweight() == "bold"
    words = words_of(find_window(both), units)  # the numbers of the sentence, which can be set
    assert setting.get_text() == operating_point({axis: words.set_value(axis) for axis in advice.point}, units)
    [frame] = artists(axes, "recommended:frame")
    across = advice.stay_within["wob"]
    assert set(np.round(frame.get_xdata() * speed, 9)) == set(np.round([within.low, within.high], 9))
    assert set(np.round(frame.get_ydata() * weight, 6)) == set(np.round([across.low, across.high], 6))


def test_a_panel_for_every_depth_up_to_a_dozen():
    def titles(depths):
        data = make_results(
            depth=np.linspace(1e3, 3e3, depths),
            wob=np.linspace(1e4, 5e4, 20),
            rotary_speed=np.linspace(1, 8, 21),
            procedures=("up",),
        )
        return [axes.get_title() for axes in maps(figures.draw(data, "window"))]

    assert titles(3) == ["1000 m", "2000 m", "3000 m"]
    many = titles(17)
    assert len(many) == 12
    assert (many[0], many[-1]) == ("1000 m", "3000 m")


def test_one_axis_is_a_strip():
    data = make_results(rotary_speed=np.linspace(1, 8, 15), procedures=("up", "down"))
    assert "window" in figures.kinds_for(data)
    [axes] = maps(figures.draw(data, "window"))
    assert len(axes.get_yticks()) == 0
    assert "window" not in figures.kinds_for(make_results())


def test_failed_points_and_one_procedure_are_told(both):
    """What lies behind a failed run in its chain is not known either."""
    spoiled = spoil(both, diverged=3, step_limit=0)
    figure = figures.draw(spoiled, "window")
    note = find_window(spoiled)
    assert note["unknown"] > 0
    assert f"unknown ({unknown_words(note)})" in legend_words(figure)
    [axes] = maps(figure)
    for code in np.unique(shown(axes)):
        if code < len(RESPONSES):
            assert RESPONSES[code].name in legend_words(figure)
    unknown = artists(axes, "unknown")[0]
    assert covered(unknown, both["rotary_speed"], both["wob"] / 1e3).sum() == note["unknown"]
    np.testing.assert_array_equal(covered(unknown, both["rotary_speed"], both["wob"] / 1e3), shown(axes) == UNKNOWN)
    alone = make_results(wob=(1e4, 2e4, 3e4, 4e4), rotary_speed=np.linspace(1, 8, 15))
    figure = figures.draw(alone, "window")
    assert "free, started there" in legend_words(figure)
    [told] = artists(figure, "warnings")
    assert "HISTORY WAS NOT EXAMINED" in told.get_text()


def test_nothing_safe_is_still_a_picture(both):
    both["response"][:] = WHIRL
    [axes] = maps(figures.draw(both, "window"))
    assert not axes.get_lines()
    assert not artists(axes, "setting")


def test_by_severity(both):
    both["whirl_severity"][:] = 2
    assert find_window(both, 1)["safe"] == 0
    known = told(both, [0.0] * len(both["wob"]))
    [axes] = maps(figure := figures.draw(known, "window", severity=2))
    assert (shown(axes) == ANY_HISTORY).all()
    assert "no severity above 2 after any history" in legend_words(figure)
    [axes] = maps(figures.draw(both, "window", severity=2))
    assert (shown(axes) == ALLOWED).all(), "no vibration was met, and the model does not tell how long one lasts"


def luminance(colour) -> float:
    """Relative luminance (Rec. 709, linear)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    return float(np.dot((0.2126, 0.7152, 0.0722), linear))


def test_what_is_allowed_is_lighter_than_what_is_critical(both):
    """In grey print too; what is not known is neither."""
    assert RESPONSES[0].colour == SAFE_COLOUR
    found = zones(classes(both).grades)
    critical = {zone.colour for zone in found[: len(RESPONSES)]}
    assert max(map(luminance, critical)) < luminance(SAFE_COLOUR)
    assert GREY not in {SAFE_COLOUR, ANY_HISTORY_COLOUR, *critical}
    assert found[UNKNOWN].colour == GREY


def test_regions_have_words_in_capitals_where_there_is_room(both):
    untouched(both)
    both["response"][:, 0, :, :5] = STICK_SLIP
    both["response"][1, 0, :, 5:] = WHIRL
    both["response"][:, 0, :, 12:] = STALLED
    both["response"][:, 0, 3, 14] = STICK_SLIP | WHIRL  # one cell alone, too small for its words
    figure = figures.draw(both, "window")
    [axes] = maps(figure)
    named = {text.get_text().replace("\n", " ") for text in artists(axes, "area:")}
    assert named == {"STICK-SLIP", "BRING UP FROM BELOW", "BIT STALLS"}
    assert not {"S", "W", "S?", "W?"} & named, "no letters"
    assert {"stick-slip", "stick-slip + whirl", "stalled", "free, brought up from below"} <= set(legend_words(figure))
    cells = artists(axes, "cells")[0]
    for text in artists(axes, "area:"):  # wholly within its region
        box = text.get_window_extent().transformed(axes.transData.inverted())
        code = int(str(text.get_gid()).partition(":")[2])
        x, y = np.asarray(both["rotary_speed"]), both["wob"] / 1e3
        inside = np.ix_((y > box.y0) & (y < box.y1), (x > box.x0) & (x < box.x1))
        assert (np.asarray(cells.get_array())[inside] == code).all(), text
    untouched(both)
    [axes] = maps(figures.draw(told(both, [0.0] * len(both["wob"])), "window"))
    assert [text.get_text() for text in artists(axes, "area:")] == ["SAFE"]


def untouched(results):
    """Make every run clear."""
    for name in ("response", "wall_contact_fraction", "lift_off_fraction", "stick_slip_severity"):
        results[name][:] = 0


@pytest.mark.usefixtures("laid_out")
def test_words_lie_inside_their_panels_and_not_over_the_setting():
    data = make_results(
        depth=np.linspace(1e3, 6e3, 3),
        wob=np.linspace(10e3, 50e3, 7),
        rotary_speed=np.linspace(1, 8, 15),
        procedures=("up", "down"),
    )
    panels = maps(figures.draw(data, "window"))
    assert len(panels) == 3
    for axes in panels:
        panel = axes.get_window_extent()
        [setting] = artists(axes, "setting")
        words = artists(axes, "area:")
        assert words
        for text in (setting, *words):
            box = text.get_window_extent()
            assert panel.x0 - 1 <= box.x0 < box.x1 <= panel.x1 + 1, text
            assert panel.y0 - 1 <= box.y0 < box.y1 <= panel.y1 + 1, text
        for text in words:
            assert not text.get_window_extent().overlaps(setting.get_window_extent()), text


# numbers of speeds that stick at each weight, at which words stood across the frame
@pytest.mark.parametrize("ends", [(3, 19, 20, 20, 21, 21, 22), (4, 11, 13, 13, 14, 18, 20)])
def test_words_of_regions_do_not_cross_the_frame(ends):
    data = make_results(wob=np.linspace(10e3, 50e3, 7), rotary_speed=np.linspace(1, 8, 29), procedures=("up", "down"))
    untouched(data)
    for row, end in enumerate(ends):
        data["response"][:, 0, row, :end] = STICK_SLIP
    [axes] = maps(figures.draw(data, "window"))
    [frame] = artists(axes, "recommended:frame")
    corners = axes.transData.transform(frame.get_xydata())
    words = artists(axes, "area:")
    assert len(words) == 2
    for start, end in pairwise(corners):
        side = Bbox([np.minimum(start, end), np.maximum(start, end)])
        assert not any(text.get_window_extent().overlaps(side) for text in words)


def test_borderline_points_are_sand_and_not_allowed(both):
    """One that touches the wall coming up without a response."""
    untouched(both)
    both["wall_contact_fraction"][:, 0, 3, 7] = 0.004
    [axes] = maps(figure := figures.draw(both, "window"))
    np.testing.assert_array_equal(np.argwhere(shown(axes) == BORDERLINE), [[3, 7]])
    assert "borderline: touches, or near a limit" in legend_words(figure)
    assert len(artists(axes, "field")[0].get_segments()) == 4


def test_there_is_no_sentence_and_no_rate_unless_asked_for(both):
    """The warnings are there by their words in capitals."""
    both["settled"][:] = 1
    figure = figures.draw(both, "window")
    assert figure.get_suptitle() == "Speed sweep, state carried, 5000 m", "in one line"
    [told] = artists(figure, "warnings")
    assert told.get_text() == "; ".join(["BEFORE TRIALS", *headlines(find_window(both), "si")])
    assert told.get_text().isupper()
    assert not artists(figure, "equal")
    sent = figures.draw(both, "window", text=True, rates=True)
    assert answer(find_window(both), "si").split()[0] in sent.get_suptitle()
    assert len(artists(sent, "warnings")[0].get_text()) > len(told.get_text())
    rates = figures.draw(with_rates(both), "window", rates=True)
    assert artists(rates, "equal")
    assert not artists(figures.draw(with_rates(both), "window"), "equal")
    with pytest.raises(InputError, match=r"text.*found with .*map.*; allowed: with .*window"):
        figures.draw(both, "map", text=True)


def with_rates(results):
    """With a rate of penetration that grows with speed and weight."""
    rate = np.outer(results["wob"], results["rotary_speed"]) * 1e-9
    full = np.broadcast_to(rate, results["response"].shape).copy()
    return replace(results, variables={**results.variables, "rate_of_penetration": full})


def test_the_answer_and_its_warnings_are_in_the_picture_with_text(both):
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
    alone["settled"][:] = 1
    [brief] = artists(figures.draw(alone, "window"), "warnings")
    assert {"THE SWEEP BEGINS", "HISTORY WAS NOT EXAMINED"} <= set(brief.get_text().split("; "))
    sent = figures.draw(alone, "window", text=True)
    assert artists(sent, "warnings")[0].get_text().split("\n")[1].startswith("THE SWEEP BEGINS at 1 rad/s")
    assert answer(find_window(alone), "si").replace(" ", "") in sent.get_suptitle().replace("\n", "").replace(" ", "")
    [axes] = maps(sent)
    assert artists(axes, "recommended")[0].get_markerfacecolor() == "white", "a hint"


def test_two_windows_say_once_what_holds_for_both_and_what_the_first_allows(both):
    """The second is critical everywhere."""
    other = replace(both, variables={**both.variables, "response": np.full_like(both["response"], WHIRL)})
    figure = draw_two(both, other, ["one.h5", "two.h5"])
    left, right = maps(figure)
    assert [axes.get_title(loc="left") for axes in (left, right)] == ["a: one.h5", "b: two.h5"]
    assert "allowed in a" in legend_words(figure)
    assert "allowed in a" not in legend_words(draw_two(other, both, ["two.h5", "one.h5"])), "nothing is"
    ((told,), (told_of_one,)) = (artists(one, "warnings") for one in (figure, draw_two(both, both, ["x.h5", "x.h5"])))
    assert told.get_text() == "a and b: THE MAP ENDS\na: TO WHICH SPEED STICK-SLIP LASTS"
    assert all(line.startswith(("a and b: ", " ")) for line in told_of_one.get_text().splitlines())
    sent = draw_two(both, other, ["one.h5", "two.h5"], text=True)
    assert "b: two.h5\nNothing is safe" in maps(sent)[1].get_title(loc="left")


def test_with_samples_colour_is_the_probability_of_being_allowed(results):
    """A line surrounds what reaches the confidence."""
    found = find_window(results, None, 0.7)
    [axes] = maps(figure := figures.draw(results, "window", confidence=0.7))
    np.testing.assert_allclose(shown(axes), 25.0 * SAFE)
    assert axes.collections[0].get_cmap().name == "goodness"
    allowed = SAFE >= 3
    sides = np.count_nonzero(np.diff(allowed, axis=0)) + np.count_nonzero(np.diff(allowed, axis=1))
    assert len(artists(axes, "field")[0].get_segments()) == sides
    assert found["safe"] == allowed.sum()
    assert "allowed with 70 % or more" in legend_words(figure)
    assert any(one.get_label() == "<colorbar>" for one in figure.axes)
    [none] = maps(figures.draw(results, "window", confidence=0.999))
    assert artists(none, "field"), "at one point all samples are allowed"
    results["response"][0, 0, 0, 0, 0] = 2
    [none] = maps(figures.draw(results, "window", confidence=0.999))
    [diamond] = artists(none, "most_probable")
    assert diamond.get_marker() == "D"
    assert artists(none, "setting")[0].get_text().endswith(": 75 %")


def test_a_point_without_room_is_a_hint(both):
    """One safe cell alone: its marker is open and the legend says why; with room it is
    filled, if its motion settled."""
    both["settled"][:] = 1
    firm = artists(figures.draw(both, "window"), "recommended")[0]
    assert firm.get_markerfacecolor() == "#000000"
    both["response"][:] = WHIRL
    both["response"][:, 0, 2, 7] = 0
    figure = figures.draw(both, "window")
    hint = artists(figure, "recommended")[0]
    assert hint.get_markerfacecolor() == "white"
    assert "a hint, not a setting; the bar: stay within" in legend_words(figure)


MANY_SPEEDS, MANY_WEIGHTS = np.array([2.0, 4.0, 6.0]), np.array([10e3, 20e3])
SAFE = np.array([[4, 3, 1], [3, 2, 0]])  # of 4 samples, by weight and speed


@pytest.fixture
def results():
    made = make_results(wob=MANY_WEIGHTS, rotary_speed=MANY_SPEEDS)
    coords = {**made.coords, SAMPLE: np.arange(4)}
    shape = (1, 1, 2, 3, 4)
    response = np.where(np.arange(4) < SAFE[..., None], 0, 2).reshape(shape).astype(np.int8)
    return Results(coords, {"status": np.ones(shape, np.int8), "response": response}, made.attrs)


SPEEDS, WEIGHTS = np.linspace(1.0, 6.0, 11), np.linspace(10e3, 60e3, 9)


def measured(**more):
    values = {"stick_slip_index": np.array([50.0, 80.0, 20.0]), "surface_torque_max": np.array([1e3, np.nan, 3e3])}
    errors = {name: 0.1 * one for name, one in values.items()}
    at = {"rotary_speed": np.array([2.0, 4.0, 5.0]), "wob": np.array([22e3, 22.5e3, 40e3])}
    return Measured("field.csv", at | more, values, errors, ("line 2", "line 3", "line 4"))


def test_values_lie_along_the_axis():
    results = make_results(rotary_speed=SPEEDS)
    figure = figures.draw(results, "stick_slip_index", units="field")
    assert overlay(figure, results, measured(), "field") == 2  # the third is at another weight
    [marks] = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "D"]
    np.testing.assert_allclose(marks.get_xdata(), np.array([2.0, 4.0]) * 30 / np.pi)
    assert marks.get_ydata().tolist() == [50.0, 80.0]
    figure = figures.draw(results, "surface_torque_max")
    assert overlay(figure, results, measured(), "si") == 1
    [marks] = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "D"]
    assert marks.get_ydata().tolist() == [1.0]  # kN m


def test_the_panel_shows_the_curve_and_all_measured_values():
    results = make_results(rotary_speed=SPEEDS)
    results.variables["surface_torque_max"][:] = np.linspace(16.9e3, 17.0e3, len(SPEEDS))
    figure = figures.draw(results, "surface_torque_max")
    overlay(figure, results, measured(), "si")
    [axes] = [axes for axes in figure.axes if any(line.get_marker() == "D" for line in axes.lines)]
    bottom, top = axes.get_ylim()
    for value in (0.9, 17.0):  # kN m, the lower end of the least error, and the curve
        assert 0.02 < (value - bottom) / (top - bottom) < 0.98


@pytest.mark.parametrize(
    ("key", "values", "drawn"),
    [
        ("bit.friction.static", [0.51, 0.9, 0.5], 1),
        ("well.inclination", [0.0, 0.1, 0.0], 1),
        ("well.diameter", [0.381, 0.375, 0.381], 2),
        ("well.diameter", [0.25, 0.25, 0.381], 0),
        ("drive.kind", [0.0, 1.0, 0.0], 1),
        ("drillstring.torsional_stiffness", [400.0, 400.0, 400.0], 0),  # of which the study has no number
    ],
)
def test_what_was_measured_at_another_setting_of_the_study_is_left_out(key, values, drawn):
    results = make_results(rotary_speed=SPEEDS)
    study = {"bit": {"friction": {"static": 0.5}}, "well": {"inclination": 0.0, "diameter": 0.381}}
    study |= {"drive": {"kind": words_of_choice("drive.kind")[0]}, "drillstring": {"torsional_stiffness": None}}
    results.attrs["study_resolved"] = json_text(study)
    figure, there = figures.draw(results, "stick_slip_index"), measured(**{key: np.array(values)})
    if drawn:
        assert overlay(figure, results, there, "si") == drawn
        return
    with pytest.raises(InputError, match="at the other settings"):
        overlay(figure, results, there, "si")


def test_a_panel_of_values_that_no_run_has_says_so():
    results = make_results(rotary_speed=SPEEDS)
    assert not [
        text
        for axes in figures.draw(results, "stick_slip_index").axes
        for text in axes.texts
        if "no run" in text.get_text()
    ]
    results.variables["stick_slip_index"][:] = np.nan
    texts = [text.get_text() for axes in figures.draw(results, "stick_slip_index").axes for text in axes.texts]
    assert "no run has a value" in texts


def test_settings_are_crosses_on_a_map():
    results = make_results(rotary_speed=SPEEDS, wob=WEIGHTS, procedures=("up", "down"))
    for kind, panels in (("map", 3), ("window", 1)):
        figure = figures.draw(results, kind)
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
            overlay(figures.draw(results, kind), results, one, "si")


def test_each_weight_that_was_run_has_a_tick():
    """Not round numbers between them, which nothing ran."""
    assert has_room_for_ticks(np.array([5.0, 10.0, 20.0]))
    assert not has_room_for_ticks(np.linspace(1.0, 30.0, 30))
    assert not has_room_for_ticks(np.array([1.0, 1.1, 40.0]))
    results = grid({"up": [["s..w"] * 3]}, [4.0, 5.0, 6.0, 7.0], [20e3, 30e3, 50e3])
    axes = figures.draw(results, "window", units="si").axes[0]
    assert axes.get_yticks().tolist() == [20.0, 30.0, 50.0]
