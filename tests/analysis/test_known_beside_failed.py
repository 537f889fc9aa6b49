"""A run that failed takes nothing away of what other runs, or the model, tell of its point and of
others: no point becomes free by it, and what is known to vibrate is not called unknown."""

import numpy as np
import pytest

from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade, Label, Ways
from nsdrill.analysis.window import find_window, unknown_words
from nsdrill.data import Results
from nsdrill.text.window_text import lines
from nsdrill.words.answer import answer, warnings

from .grids import grid, told

SPEEDS = np.arange(1.0, 8.0)
WEIGHTS = (10e3, 20e3, 30e3)


def said(results: Results) -> str:
    found = find_window(results)
    return " ".join(" ".join([answer(found, "si"), *lines(found, "si")]).split())


@pytest.mark.parametrize("failed", ["down", "same", "both"])
def test_stick_slip_that_lasts_by_the_model_is_told_where_other_runs_failed(failed):
    """It lasts to 4.2 rad/s. The way down and the starts decide neither that nor what is allowed."""
    ways = {way: [["......."] * 3] for way in ("up", "down", "same")}
    before = told(grid(ways, SPEEDS, WEIGHTS), [4.2] * 3)
    ways |= {way: [["x.x...."] * 3] for way in ("down", "same") if failed in (way, "both")}
    after = told(grid(ways, SPEEDS, WEIGHTS), [4.2] * 3)
    for one in (before, after):
        assert np.all(graded(one).grade[0, :, :4] == Grade.STICKS_ON)
        text = " ".join(warnings(find_window(one), "si"))
        assert "STICK-SLIP MAY LAST at 12 points" in text
        assert "at 4 rad/s (38.2 rpm) stick-slip, once started, may last to 4.2 rad/s" in said(one)


def test_a_bit_held_at_the_point_that_failed_leaves_open_what_the_model_tells():
    """Come free, it would count against the model: whether stick-slip lasts there is not known."""
    ways = {"up": ["......."], "down": ["......."], "same": ["...x..."]}
    one = told(grid(ways, SPEEDS), [4.2], from_rest=True)
    assert graded(one).grade[0, 0, 3] == Grade.UNKNOWN
    known = graded(told(grid({**ways, "same": ["......."]}, SPEEDS), [4.2], from_rest=True))
    assert known.grade[0, 0, 3] == Grade.ANY_HISTORY


def test_a_way_down_that_failed_does_not_free_where_steady_drilling_is_unstable():
    one = Ways(np.array([Label.CLEAR]), np.array([Label.UNKNOWN]), unstable=np.array([True]))
    assert one.grades().tolist() == [Grade.STICKS_ON]


def test_what_is_known_of_a_point_is_told_where_not_all_is():
    """Brought up it whirls, and the start there failed; started there it bounces, and the way up failed; nothing
    that is known vibrates, and some failed; all failed."""
    free = "......."
    for ways, words in (
        ({"up": [".....ww"], "down": [".....ww"], "same": [".....xw"]}, "it whirls, and a start there is not known"),
        ({"up": [".....xx"], "down": [free], "same": [".....b."]}, "started there it bounces, and the rest is not"),
        ({"up": [".....xx"], "down": [free], "same": [free]}, "it is not known to be free"),
        ({"up": [".....xx"]}, "nothing is known"),
    ):
        assert f"at 6 rad/s (57.3 rpm) {words}" in said(grid(ways, SPEEDS))


def test_points_that_a_failed_run_elsewhere_leaves_open_are_not_counted_as_failed():
    """The start at 7 rad/s failed: had it stuck, stick-slip might last at all below, where the way up whirls."""
    ways = {"up": ["...wwww"], "down": ["...wwww"], "same": ["......x"]}
    one = grid(ways, SPEEDS)
    found = find_window(one)
    assert (found["unknown"], found["unknown_failed"], found["unknown_elsewhere"]) == (4, 4, 3)
    assert unknown_words(found) == "1 failed, 3 left open by runs at other points"
    assert "at 4 rad/s (38.2 rpm) it whirls, and a start there is not known to be safe" in said(one)


def test_a_run_that_failed_is_not_critical_where_a_vibration_is_lowered():
    """What whirls at 7 rad/s has ended at 3 rad/s on the way down, and at 2 rad/s a run failed."""
    found = find_window(grid({"up": ["s.....w"], "down": ["xx...ww"]}, SPEEDS))
    bound = found["answer"].recover.bound
    assert (bound.value, bound.grade, bound.responses) == (2.0, Grade.UNKNOWN, ())
    text = " ".join(lines(found, "si"))
    assert "not to 2 rad/s (19.1 rpm), where it is not known to be free" in " ".join(text.split())
    assert "critical" not in text
