"""What a page says that runs met is what runs met, and a limit carries the reason that it has."""

import random
import re
from dataclasses import replace

import numpy as np
import pytest
from analysis.grids import grid, told

from nsdrill.analysis.advice import UNSTABLE
from nsdrill.analysis.limits import end_in_runs
from nsdrill.analysis.window import find_window
from nsdrill.data import STICKS_TO, Results, json_text
from nsdrill.models.responses import STICK_SLIP, WHIRL
from nsdrill.web.one_page import Sheet, _limits, _sticking
from nsdrill.words.answer import warnings
from web.test_no_contradiction import KLBF, RPM, drawn, row

NOT_TOLD = {"over": [], "unstable_to": [None], "lasts_to": [None], "shown_to": [None], "from_rest": False}


def of_starts(draw: random.Random) -> Results:
    """A row of many starts, of which the model tells nothing."""
    speeds, number = [(30 + 5 * place) * RPM for place in range(draw.randint(6, 14))], draw.randint(2, 8)
    rows = [grid({"same": [row(draw, len(speeds), "up")]}, speeds) for _ in range(number)]
    variables = {name: np.stack([one[name] for one in rows], axis=-1) for name in rows[0].variables}
    coords = {**rows[0].coords, "start": np.arange(number)}
    return Results(coords, variables, rows[0].attrs)


def untold(results: Results) -> Results:
    return replace(results, attrs={**results.attrs, STICKS_TO: json_text(NOT_TOLD)})


def sticking(maps, number: int, place: int) -> list[float]:
    """The speeds at which a run sticks that is not on the wall, of all ways and starts; and those at which any does."""
    bits = np.moveaxis(maps.bits[:, number, place], 1, 0).reshape(len(maps.values(maps.x)), -1)
    alone = ((bits & STICK_SLIP > 0) & (bits & WHIRL == 0)).any(axis=1)
    return maps.values(maps.x)[alone].tolist(), maps.values(maps.x)[(bits & STICK_SLIP > 0).any(axis=1)].tolist()


@pytest.mark.parametrize("starts", [False, True])
@pytest.mark.parametrize("seed", range(60))
def test_where_a_page_says_that_stick_slip_was_met_a_run_met_it_and_none_beyond(seed, starts):
    draw = random.Random(seed)
    sheet = Sheet(untold(of_starts(draw) if starts else drawn(draw)), "field", "x.h5")
    maps = sheet.maps
    for place in range(maps.grade.shape[1]):
        alone, every = (np.round(np.array(one) / RPM, 6) for one in sticking(maps, sheet.plane, place))
        number, words = _sticking(sheet, place, "")
        ends, *_ = _limits(sheet, place)
        for text in (f"{number} {words}", ends):
            found = re.search(r"in the runs it ended at ([\d.]+)|met at ([\d.]+)|on the way \w+ ([\d.]+)", text)
            if found is not None:
                at = float(next(filter(None, found.groups())))
                assert np.isclose(every, at, rtol=5e-3).any(), text
                assert not (alone > at * 1.005).any(), text
        if "none was met" in words or "no stick-slip is known" in words:
            assert not alone.size, words
        step = end_in_runs(maps, sheet.plane, place)
        assert (step is None) <= (not alone.size)


def test_many_starts_stick_at_the_point_of_the_hint_and_above_it():
    speeds = [float(place) for place in range(2, 9)]
    rows = ["sssss..", "sss....", "ss.....", "ss...bb"]
    parts = [grid({"same": [line]}, speeds) for line in rows]
    variables = {name: np.stack([one[name] for one in parts], axis=-1) for name in parts[0].variables}
    results = Results({**parts[0].coords, "start": np.arange(4)}, variables, parts[0].attrs)
    sheet = Sheet(untold(results), "si", "x.h5")
    step = end_in_runs(sheet.maps, sheet.plane, 0)
    assert (step.last, step.next) == (6.0, 7.0)


def test_a_limit_of_unstable_drilling_says_so_and_not_that_stick_slip_lasts():
    """The runs stick to 60 rpm by themselves, and rest at 80 and 90 rpm, where steady drilling is unstable."""
    speeds = [(50 + 10 * place) * RPM for place in range(10)]
    results = told(grid({"same": ["ssb......."]}, speeds, [5 * KLBF]), [None], [95 * RPM])
    window = find_window(results)
    below = window["answer"].stay_within["rotary_speed"].below
    assert below.value == pytest.approx(90 * RPM)
    assert below.sticks_to is None
    assert window["grades"]["steady drilling unstable"] == 2
    sheet = Sheet(results, "field", "x.h5")
    assert _limits(sheet, 0)[0] == "not known, met at 60"
    number, words = _sticking(sheet, 0, "")
    assert number == "not known"
    assert "in the runs it ended at 60 to 70 rpm" in words
    (text,) = [text for text in warnings(window, "field") if text.startswith("STEADY DRILLING")]
    assert "more slowly than the runs are long" in text
    nothing = find_window(told(grid({"same": ["ssb......."]}, speeds, [5 * KLBF]), [None], [200 * RPM]))["answer"]
    assert [name for name, *_ in nothing.near] == [UNSTABLE]


def test_where_runs_show_what_grows_the_warning_does_not_call_them_short():
    speeds = [(50 + 10 * place) * RPM for place in range(6)]
    lines = {"up": ["ssssss"], "down": ["ssssss"]}
    one = grid(lines, speeds, [5 * KLBF])
    severe = np.where(one["response"] & STICK_SLIP > 0, 150.0, 0.0)
    one = replace(one, variables={**one.variables, "stick_slip_index": severe})
    window = find_window(told(one, [None], [200 * RPM]), severity=4)
    for text in warnings(window, "field"):
        assert "more slowly than the runs are long" not in text
