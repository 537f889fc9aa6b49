"""Above the speed at which the model leaves a bending mode out nothing is known, whatever the runs show:
a run of one mode cannot vibrate in a second one."""

import json
from dataclasses import replace

import numpy as np
import pytest

from nsdrill.analysis.advice import Kind, advise
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.limits import next_limits
from nsdrill.analysis.unmodelled import NEAR
from nsdrill.analysis.window import find_window, unknown_words
from nsdrill.data import LEFT_OUT, Results

from .grids import grid, told

SPEEDS = np.linspace(6.0, 19.0, 14)
WEIGHTS = (20e3, 30e3, 40e3, 50e3)


def left_out(results: Results, second: float | None) -> Results:
    return replace(results, attrs={**results.attrs, LEFT_OUT: json.dumps({"second_mode": second})})


def maps_of(up: list[str], down: list[str]) -> Results:
    return told(grid({"up": [up], "down": [down]}, SPEEDS, WEIGHTS), [5.0] * len(WEIGHTS))


FREE = maps_of(["sss..........."] * 4, ["sss..........."] * 4)


def test_nothing_is_allowed_near_the_mode_or_above_it():
    maps = graded(left_out(FREE, 15.0))
    above = SPEEDS > NEAR * 15.0
    assert (maps.grade[0][:, above] == Grade.UNKNOWN).all()
    assert not maps.allowed[0][:, above].any()
    np.testing.assert_array_equal(maps.grade[0][:, ~above], graded(FREE).grade[0][:, ~above])


def test_the_answer_ends_there_and_says_why():
    window = find_window(left_out(FREE, 15.0))
    answer = window["answer"]
    assert answer.kind in (Kind.ANY_HISTORY, Kind.FROM_BELOW)
    assert answer.stay_within["rotary_speed"].high <= NEAR * 15.0
    beyond = answer.most["rotary_speed"].beyond
    assert beyond.is_unmodelled
    assert beyond.value == SPEEDS[SPEEDS > NEAR * 15.0][0]
    assert window["unknown_unmodelled"] == len(WEIGHTS) * int(np.count_nonzero(SPEEDS > NEAR * 15.0))
    assert window["unknown_failed"] == 0
    assert "failed" not in unknown_words(window)
    assert next_limits(graded(left_out(FREE, 15.0)), 0, 0)[0].grade == Grade.UNKNOWN


def test_no_vibration_that_was_met_there_is_lost():
    results = left_out(maps_of(["sss.........w."] * 4, ["sss.........w."] * 4), 15.0)
    assert graded(results).grade[0, 0, 12] == Grade.CRITICAL


@pytest.mark.parametrize("second", [None, 40.0])
def test_a_mode_that_no_speed_reaches_changes_nothing(second):
    np.testing.assert_array_equal(graded(left_out(FREE, second)).grade, graded(FREE).grade)


@pytest.mark.parametrize("seed", range(40))
def test_a_mode_that_is_left_out_never_allows_more(seed):
    """Nor does a lower one; and below it the classes stay as they are."""
    random = np.random.default_rng(seed)
    lines = [["".join(random.choice(list("...swb?"), len(SPEEDS))) for _ in WEIGHTS] for _ in range(2)]
    results = maps_of(*lines)
    seconds = sorted(random.uniform(8.0, 22.0, 2))
    low, high = (graded(left_out(results, second)) for second in seconds)
    plain = graded(results)
    assert (low.allowed <= high.allowed).all()
    assert (high.allowed <= plain.allowed).all()
    below = NEAR * seconds[0] >= SPEEDS
    np.testing.assert_array_equal(low.grade[..., below], plain.grade[..., below])
    answer = advise(low)
    if stretch := answer.stay_within.get("rotary_speed"):
        assert stretch.high <= NEAR * seconds[0]
