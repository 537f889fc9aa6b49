"""Intervals of hysteresis, against drawings in which they can be counted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.hysteresis import differences, disagreement, hysteresis, spans
from nsdrill.analysis.probability import known, outcome
from nsdrill.app.summary import summarize
from nsdrill.store import read_results

from .grids import grid

SPEEDS = np.arange(1.0, 9.0)


def test_one_interval_with_its_ends_step_and_responses() -> None:
    [row] = hysteresis(grid({"up": ["...bbwww"], "down": ["...BBwww"]}, SPEEDS))
    assert row == {
        "axis": "rotary_speed",
        "from": 4.0,
        "to": 5.0,
        "points": 2,
        "up": "bit_bounce",
        "down": "bit_bounce+whirl",
        "differs": ["whirl"],
        "depth": 5000.0,
        "wob": 20e3,
        "step": 1.0,
        "open": [],
        "up_whirl": [],
        "down_whirl": ["backward_rolling"],
    }


def test_another_pair_of_responses_is_another_interval() -> None:
    rows = hysteresis(grid({"up": ["ss...bb."], "down": ["s..bbbB."]}, SPEEDS))
    assert [(row["from"], row["to"], row["up"], row["down"], row["differs"]) for row in rows] == [
        (2.0, 2.0, "stick_slip", "none", ["stick_slip"]),
        (4.0, 5.0, "none", "bit_bounce", ["bit_bounce"]),
        (7.0, 7.0, "bit_bounce", "bit_bounce+whirl", ["whirl"]),
    ]


@pytest.mark.parametrize("sign", ["x", "?"])
@pytest.mark.parametrize("side", ["up", "down"])
def test_a_point_that_is_not_known_interrupts(sign: str, side: str) -> None:
    maps = {"up": ["........"], "down": ["..bbbb.."]}
    line = list(maps[side][0])
    line[3] = sign
    rows = hysteresis(grid({**maps, side: ["".join(line)]}, SPEEDS))
    assert [(row["from"], row["to"], row["open"]) for row in rows] == [(3.0, 3.0, ["to"]), (5.0, 6.0, ["from"])]


def test_an_inferred_point_does_not() -> None:
    [row] = hysteresis(grid({"up": ["...i...."], "down": ["..bbbb.."]}, SPEEDS))
    assert (row["from"], row["to"]) == (3.0, 6.0)


def test_the_end_of_the_sweep_leaves_an_interval_open() -> None:
    rows = hysteresis(grid({"up": ["bb....ww"], "down": ["........"]}, SPEEDS))
    assert [row["open"] for row in rows] == [["from"], ["to"]]
    [whole] = hysteresis(grid({"up": ["bbbbbbbb"], "down": ["........"]}, SPEEDS))
    assert (whole["open"], whole["step"]) == (["from", "to"], None)


def test_the_larger_of_two_unequal_steps_is_told() -> None:
    [row] = hysteresis(grid({"up": ["...."], "down": [".bb."]}, [1.0, 2.0, 2.5, 5.0]))
    assert row["step"] == 2.5


def test_both_responses_may_differ() -> None:
    [row] = hysteresis(grid({"up": ["B"], "down": ["."]}, [3.0], wob=[1e3]), "rotary_speed")
    assert row["differs"] == ["bit_bounce", "whirl"]


def test_every_combination_of_the_other_axes_has_its_own() -> None:
    data = grid(
        {"up": [["....", "...."], ["....", "...."]], "down": [["b...", "...."], ["..ww", ".b.."]]},
        [1, 2, 3, 4],
        wob=[10e3, 20e3],
        depth=[1000, 2000],
    )
    assert hysteresis(data) == [], "three axes, and the study does not say along which"
    data.attrs["study_resolved"] = json.dumps({"sweep": {"along": "rotary_speed"}})
    found = [(row["depth"], row["wob"], row["from"], row["to"]) for row in hysteresis(data)]
    assert found == [(1000, 10e3, 1, 1), (2000, 10e3, 3, 4), (2000, 20e3, 2, 2)]
    data.attrs["study_resolved"] = json.dumps({"sweep": {"along": "wob"}})
    found = [(row["depth"], row["rotary_speed"], row["from"], row["to"]) for row in hysteresis(data)]
    assert found == [(1000, 1, 10e3, 10e3), (2000, 2, 20e3, 20e3), (2000, 3, 10e3, 10e3), (2000, 4, 10e3, 10e3)]


@pytest.mark.parametrize("names", [("same",), ("up",), ("same", "up")])
def test_without_both_directions_there_is_nothing_to_compare(names: tuple[str, ...]) -> None:
    maps = {name: ["b.w."] for name in names}
    assert hysteresis(grid(maps, [1, 2, 3, 4])) == []
    assert disagreement(names, np.zeros((len(names), 4))) is None


def test_stretches_for_shading_join_what_touches() -> None:
    data = grid({"up": ["..bbx.b."], "down": [".bw..b.."]}, SPEEDS)
    outcomes = outcome(data["status"], data["response"])[:, 0, 0]
    found = differences(("up", "down"), outcomes)
    assert [(one.first, one.last) for one in found] == [(1, 1), (2, 2), (3, 3), (5, 5), (6, 6)]
    assert spans(found) == [(1, 3), (5, 6)]


def test_known_are_points_run_to_the_end_or_inferred() -> None:
    assert known(np.arange(7)).tolist() == [False, True, False, False, False, True, False]


def test_the_file_says_the_same(shared: Path) -> None:
    """From Python, and in the JSON of show; where the responses of the file differ, and
    nowhere else."""
    rows = nsdrill.hysteresis(shared / "small.h5")
    assert rows == summarize(read_results(shared / "small.h5"))["hysteresis"]
    data = read_results(shared / "small.h5")
    up, down = data["response"][:, 0, 0]
    assert sum(row["points"] for row in rows) == np.count_nonzero(up != down) > 0
    assert nsdrill.hysteresis(shared / "map.h5") == []
