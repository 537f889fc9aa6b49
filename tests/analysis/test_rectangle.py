"""What to stay within: a rectangle of allowed points, on maps of any shape."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from nsdrill.analysis.advice import data_of
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.room import choose, rectangle
from nsdrill.analysis.window import find_window
from nsdrill.units import to_si
from nsdrill.words.answer import words_of
from nsdrill.words.values import TORQUE, Formatter

from .grids import grid

SPEEDS = np.array([to_si(f"{rpm} rpm", "rad/s") for rpm in range(60, 141, 10)])
WEIGHTS = np.array([to_si(f"{weight} klbf", "N") for weight in (5, 10, 15, 20, 25, 30)])
MAPS = arrays(bool, (len(WEIGHTS), len(SPEEDS)), elements=st.integers(0, 4).map(bool))


@given(MAPS)
@settings(max_examples=200)
def test_every_point_in_what_is_printed_is_allowed(allowed):
    """In the answer, in its words and in the JSON alike, whatever the map."""
    lines = ["".join("." if one else "s" for one in row) for row in allowed]
    found = find_window(grid({"up": [lines]}, SPEEDS, WEIGHTS))
    within = found["answer"].stay_within
    if not allowed.any():
        assert not within
        return
    told = data_of(found["answer"], "rotary_speed")["stay_within"]
    words = words_of(found, "field")
    ends = {}
    for axis, one in within.items():
        assert (told[axis]["from"], told[axis]["to"]) == (one.low, one.high)
        ends[axis] = Formatter("field").inwards(axis, one.low, one.high)
        assert Formatter("field").range(axis, list(ends[axis])) == words.ends(axis)
    (left, right), (low, high) = ends["rotary_speed"], ends["wob"]
    columns = (left - 1e-6 <= SPEEDS) & (right + 1e-6 >= SPEEDS)
    rows = (low - 1e-3 <= WEIGHTS) & (high + 1e-3 >= WEIGHTS)
    assert allowed[np.ix_(rows, columns)].all()
    point = found["answer"].point
    assert left - 1e-6 <= point["rotary_speed"] <= right + 1e-6
    assert low - 1e-3 <= point["wob"] <= high + 1e-3


@given(MAPS, st.data())
@settings(max_examples=100)
def test_no_larger_rectangle_is_chosen_around_the_point(allowed, data):
    places = np.argwhere(allowed)
    if not len(places):
        return
    row, column = places[data.draw(st.integers(0, len(places) - 1))]
    (first, last), (left, right) = rectangle(allowed, ("wob", WEIGHTS), ("rotary_speed", SPEEDS), (row, column))
    assert first <= row <= last
    assert left <= column <= right
    assert allowed[first : last + 1, left : right + 1].all()
    for larger in ((first - 1, last, left, right), (first, last + 1, left, right), (first, last, left - 1, right)):
        a, b, c, d = larger
        inside = a >= 0 and b < len(WEIGHTS) and c >= 0
        assert not inside or not allowed[a : b + 1, c : d + 1].all()


def test_a_smaller_rectangle_that_leaves_the_point_a_tolerance_comes_before_a_larger_one_on_whose_side_it_lies():
    allowed = np.ones((len(WEIGHTS), len(SPEEDS)), dtype=bool)
    allowed[3:, 2:] = False  # over 15 klbf up to 70 rpm only
    y, x = ("wob", WEIGHTS), ("rotary_speed", SPEEDS[:4])
    # tolerances of 1 klbf and 7 rpm: (1 + 10/1)(1 + 30/7) = 58 against (1 + 25/1)(1 + 10/7) = 63 of the tall one
    assert rectangle(allowed[:, :4], y, x, (1, 1)) == ((0, 2), (0, 3))
    # where none leaves it room, the largest
    assert rectangle(allowed[:, :2], y, ("rotary_speed", SPEEDS[:2]), (1, 1)) == ((0, 5), (0, 1))


def test_a_corner_that_sticks_is_not_within():
    """At 30 klbf it sticks to 110 rpm: the cross through the point would hold that corner."""
    lines = ["s........", "s........", "ss.......", "sss......", "ssss.....", "ssssss..."]
    found = find_window(grid({"up": [lines]}, SPEEDS, WEIGHTS))
    within, through = found["answer"].stay_within, found["answer"].lines
    assert within["rotary_speed"].low > through["rotary_speed"].low
    words = words_of(found, "field")
    assert words.is_cut
    assert words.ends("rotary_speed") in words.sentence()
    assert words.ends("wob") in words.sentence()
    below = within["rotary_speed"].below
    assert below.responses == ("stick_slip",)
    assert below.beside is not None
    assert words.lines()[0].startswith(f"Slower, at {words.fmt.value('wob', words.set_value('wob'))}: at ")


def test_numbers_are_those_a_driller_sets():
    fmt, rpm, klbf = Formatter("field"), np.pi / 30, 4448.2216152605
    assert fmt.range("rotary_speed", list(fmt.inwards("rotary_speed", 72.6 * rpm, 140.25 * rpm))) == "73 to 140 rpm"
    assert fmt.range("rotary_speed", list(fmt.outwards("rotary_speed", 54.19 * rpm, 67.95 * rpm))) == "54 to 68 rpm"
    assert fmt.value("wob", fmt.settable("wob", 48.57 * klbf, 10 * klbf, 55 * klbf)) == "48.5 klbf"
    assert fmt.value("wob", fmt.settable("wob", 48.57 * klbf, 10 * klbf, 48.4 * klbf)) == "48 klbf"
    assert fmt.inwards("rotary_speed", 72.2 * rpm, 72.8 * rpm) == (72.2 * rpm, 72.8 * rpm)  # nothing to set within
    assert fmt.value("rotary_speed", 64.81 * rpm) == "64.8 rpm"  # of a grid
    assert fmt.value("rotary_speed", fmt.settable("rotary_speed", 64.81 * rpm, 60 * rpm, 70 * rpm)) == "65 rpm"
    assert fmt.value("wob", 22.4809 * klbf) == "22.5 klbf"
    assert fmt.value(TORQUE, 12345.0) == "9.11 kft-lbf"
    assert fmt.value(TORQUE, 123450.0) == "91.1 kft-lbf"
    assert fmt.value(TORQUE, 0.0) == "0 kft-lbf"
    assert fmt.value("rate_of_penetration", 15.654 * 0.3048 / 3600) == "15.7 ft/h"
    assert fmt.range_inwards("rotary_speed", 60.04 * rpm, 99.96 * rpm) == "61 to 99 rpm"  # not a twentieth wider
    assert fmt.rate(1.951 * rpm) == "2 rpm/s"  # "or faster": rounded up
    assert fmt.rate(1.81 * rpm) == "1.9 rpm/s"
    assert Formatter("si").inwards("rotary_speed", 1.234, 5.678) == pytest.approx((1.3, 5.6))  # of 0.1 rad/s


def test_a_corner_that_drills_little_does_not_win():
    """Safe after any history at light weight: taken where it drills half as fast as the best
    that is allowed, not where it drills a fifth."""
    allowed, better = np.ones((6, 9), bool), np.zeros((6, 9), bool)
    better[:5, :5] = True
    rate = np.full((6, 9), 10.0)
    rate[:5, :5] = 6.0
    y, x = ("wob", np.linspace(10e3, 110e3, 6)), ("rotary_speed", np.linspace(5.0, 15.0, 9))
    assert choose(allowed, better, y, x, rate)[2]
    rate[:5, :5] = 2.0
    assert not choose(allowed, better, y, x, rate)[2]
    assert choose(allowed, better, y, x, np.full((6, 9), np.nan))[2]  # of an unknown rate nothing is made


def test_what_leaves_no_room_is_named():
    lines = ["...", ".w.", "..."]
    found = find_window(grid({"up": [lines]}, SPEEDS[2:5], WEIGHTS[:3]))["answer"]
    assert found.narrow
    assert found.beside is not None
    assert found.beside.responses == ("whirl",)
    assert found.beside.grade == Grade.CRITICAL
    words = words_of(find_window(grid({"up": [lines]}, SPEEDS[2:5], WEIGHTS[:3])), "field")
    assert words.sentence().endswith("at 90 rpm and 10 klbf it whirls.")


@pytest.mark.parametrize("way", ["up", "same"])
def test_what_did_not_settle_counts_where_an_answer_rests_on_it(way):
    """A start that did not settle says nothing of a point that was brought up."""
    results = grid({"up": [["........."] * 6], "same": [["........."] * 6]}, SPEEDS, WEIGHTS)
    settled = np.ones(results["status"].shape, np.int8)
    settled[results.procedures.index(way)] = 0
    results.variables["settled"] = settled
    assert find_window(results)["unsettled_points"] == (54 if way == "up" else 0)
