"""Parts of chains along which a state was carried: what is not in a part is not known, and an
axis with one value was not moved."""

import json

import numpy as np
import pytest

from nsdrill.analysis.chains import chain_of
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.window import find_window
from nsdrill.figures.slices import taken
from nsdrill.words.answer import answer, warnings, words_of

from .grids import grid

SPEEDS = np.arange(1.0, 11.0)
SWEEP = {"wob": [20e3, 30e3], "rotary_speed": {"from": 1.0, "to": 10.0, "points": 10}, "procedure": "up-down"}
STUDY = {"study_resolved": json.dumps({"sweep": {**SWEEP, "along": "rotary_speed"}})}
MAP = {"up": [["sss.....ww", "sss.....ww"]], "down": [["sss....www", "sss....www"]]}


def whole():
    results = grid(MAP, SPEEDS, (20e3, 30e3))
    results.attrs |= STUDY
    return results


def part(first, last):
    return taken(whole(), "rotary_speed", np.arange(first, last))


def texts(results):
    summary = find_window(results)
    words = words_of(summary, "si")
    return summary, " ".join((answer(summary, "si"), *words.lines(), *warnings(summary, "si")))


def test_a_whole_chain_is_no_part():
    assert not chain_of(whole()).is_part
    assert "A PART OF A SWEEP" not in texts(whole())[1]
    assert chain_of(grid(MAP, SPEEDS, (20e3, 30e3))) is None, "no study tells of one"


def test_a_part_says_so_and_what_was_met_above_is_not_called_not_met():
    summary, text = texts(part(0, 7))
    assert summary["chain"]["part"]
    assert summary["chain"]["whole"] == {"axis": "rotary_speed", "from": 1.0, "to": 10.0, "points": 10}
    assert "A PART OF A SWEEP: 7 of the 10 values of the speed" in text
    assert "this sweep did not meet that" not in text
    assert "what the sweep met above is not in this part of it" in text
    assert "the sweep ends, extend" not in text.replace("this part of the sweep ends, extend", "")


def test_the_way_in_begins_where_the_chain_does():
    at = find_window(part(2, 10))["answer"].way_in
    assert at is None or at.begins == 1.0


@pytest.mark.parametrize(("first", "last"), [(2, 10), (4, 8), (0, 7), (3, 9)])
def test_a_part_allows_no_more_than_the_whole(first, last):
    allowed = graded(whole()).grades[..., first:last, :] >= Grade.FROM_START
    assert not np.any((graded(part(first, last)).grades >= Grade.FROM_START) & ~allowed)


def test_a_step_of_a_thinned_chain_is_that_of_the_sweep():
    thinned = taken(whole(), "rotary_speed", np.arange(0, 10, 3))
    assert chain_of(thinned).step(4.0, 7.0) == 1.0


def test_an_axis_with_one_value_was_not_moved_nor_was_the_other():
    summary, text = texts(part(5, 6))
    assert summary["axes"] == ["wob"]
    assert "Bring up to" not in text
    assert "with the speed brought up from below" in text
    assert "1 of the 10 values of the speed" in text
