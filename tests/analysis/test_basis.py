"""What a range to stay within rests on stands beside it: a narrow tongue of vibration between two
even steps no run shows, nor a point that was inferred from its neighbours."""

import html
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from nsdrill.analysis.trials import Trials
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import plain_window
from nsdrill.data import json_text
from nsdrill.figures import draw
from nsdrill.study.load import parse_study
from nsdrill.text.window_text import lines
from nsdrill.web.explorer_maps import _told
from nsdrill.web.one_page import Sheet, one_page
from nsdrill.words.answer import before_trials, words_of

from .grids import grid

RPM, KN = np.pi / 30, 1e3
SPEEDS = np.arange(60.0, 130.0, 10.0) * RPM
UNEVEN = np.array([60.0, 70.0, 80.0, 82.5, 85.0, 100.0, 120.0]) * RPM
WEIGHTS = np.arange(10.0, 60.0, 10.0) * KN
ROOMY, REFINED, NARROW = ["s.....w"] * 5, ["s.i.i.w"] * 5, ["sssss.w"]


def swept(rows, speeds=SPEEDS):
    return grid({"up": [rows]}, speeds, WEIGHTS[: len(rows)])


@pytest.mark.parametrize(
    ("rows", "speeds", "units", "told"),
    [
        (ROOMY, SPEEDS, "field", "Rests on 25 settings every 2.25 klbf and 10 rpm, none between."),
        (ROOMY, SPEEDS, "si", "Rests on 25 settings every 10 kN and 1.05 rad/s (10 rpm), none between."),
        (ROOMY, UNEVEN, "field", "Rests on 25 settings every 2.25 klbf and 2.5 to 15 rpm, none between."),
        (REFINED, SPEEDS, "field", "every 2.25 klbf and 10 rpm, none between; 10 inferred, not run."),
        (NARROW, SPEEDS, "field", "Rests on 1 setting."),
    ],
)
def test_it_stands_beside_the_limits(rows, speeds, units, told):
    window = find_window(swept(rows, speeds))
    first = words_of(window, units).lines()[0]
    assert first.startswith("Slower: ")
    assert first.endswith(told)
    said = list(lines(window, units))
    assert told in " ".join(line.strip() for line in said[: said.index("")])
    assert plain_window(window, units)["answer"]["lines"][0] == first


def test_its_data_name_the_steps_and_the_settings_that_were_not_run():
    found = plain_window(find_window(swept(REFINED, UNEVEN)), "si")["answer"]["basis"]
    assert (found["settings"], found["inferred"]) == (25, 10)
    steps = {axis: (one["axis"], one["from"], one["to"]) for axis, one in found["steps"].items()}
    assert steps["rotary_speed"] == ("rotary_speed", pytest.approx(2.5 * RPM), pytest.approx(15 * RPM))
    assert steps["wob"] == ("wob", pytest.approx(10 * KN), pytest.approx(10 * KN))


def test_what_vibrates_everywhere_rests_on_nothing():
    window = find_window(swept(["sssswww"] * 5))
    assert plain_window(window, "si")["answer"]["basis"] is None
    assert "Rests on" not in " ".join(lines(window, "si"))


def test_of_several_depths_all_count():
    found = grid({"up": [ROOMY, ROOMY, ["s....ww"] * 5]}, SPEEDS, WEIGHTS, (1000.0, 2000.0, 2500.0))
    basis = find_window(found)["answer"].basis
    assert basis.settings == 4 * 5 * 3
    assert basis.steps["depth"] == (500.0, 1000.0)


def test_the_page_tells_it_and_counts_no_inferred_point_as_a_run():
    results = swept(REFINED)
    resolved = parse_study("sweep: {rotary_speed: [60 rpm, 120 rpm]}").resolved
    results = replace(results, attrs={**results.attrs, "study_resolved": json_text(resolved)})
    page = one_page([Sheet(results, "field", "map.h5")], "A4", {})
    text = " ".join(html.unescape(re.sub(r"<[^>]*>", " ", page)).split())
    assert "What to stay within rests on 25 settings every 2.25 klbf and 10 rpm, none between; 10 inferred" in text
    assert "25 runs, and 10 inferred." in text


def test_what_runs_no_trials_says_so():
    """A picture and the explorer, which leave out what the text says of --trials."""
    window, told = (
        find_window(swept(ROOMY)),
        "BEFORE TRIALS: no way in, connection or disturbance of the setting was run.",
    )
    assert before_trials(window) == [told]
    assert _told(window, "si")["warnings"][0] == told
    for text in (True, False):
        figure = draw(swept(ROOMY), "window", text=text)
        words = [one.get_text() for one in figure.findobj(Text)]
        assert "BEFORE TRIALS" in " ".join(words), text
    nothing = find_window(swept(["sssswww"] * 5))
    assert before_trials(nothing) == []
    tried = {**window, "answer": replace(window["answer"], trials=Trials())}
    assert before_trials(tried) == []
