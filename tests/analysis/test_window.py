"""The operating window against maps in which it can be read off by eye. Margins are worked
out by hand."""

import json
import re
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nsdrill
from nsdrill.analysis.advice import RECOMMENDED, Kind, Recovery
from nsdrill.analysis.contrast import contrast
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.maps import classes, regions
from nsdrill.analysis.window import find_window, obstacle
from nsdrill.data import Results, json_text
from nsdrill.errors import FileError, InputError
from nsdrill.text.window_text import lines
from nsdrill.variables import CHECKS, DIVERGED, OK, PENDING, POINT, Axis
from nsdrill.words.answer import answer, needed_for_words, warnings
from nsdrill.words.orders import Orders

from .grids import grid, told

# Five weights, the lowest first, by seven speeds. Going down there is less of it.
UP = ["sssssww", "s....ww", "s....ww", "s.....w", "bbbbbbb"]
DOWN = ["sssssww", "s....ww", "s...www", "s...www", "bbbbbbb"]
SPEEDS = np.arange(1.0, 8.0)
WEIGHTS = np.arange(10e3, 60e3, 10e3)
# A critical speed that a sweep does not pass over.
WALL = {
    "axis": "rotary_speed",
    "name": "wall_speed",
    "words": "it",
    "told": "IT MAY LAST",
    "safe_while": "it is fair",
    "min": 0.5,
    "max": 0.7,
    "lasts": [0.6, 0.8],
    "from": None,
    "everywhere": False,
    "each": False,
    "jumped": None,
    "range": None,
    "passing_rate": None,
}


@pytest.fixture
def both():
    return find_window(grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS))


def test_the_grades_are_counted(both):
    """Allowed is what is free coming up: 4 + 4 + 5. Coming down the fifth speed of the third
    weight, and the fifth and sixth of the fourth, whirl after the whirl above them."""
    assert (both["safe"], both["rim"], both["critical"], both["points"]) == (13, 0, 22, 35)
    assert both["share"] == {"safe": 13 / 35, "rim": 0.0, "critical": 22 / 35, "unknown": 0.0}
    assert both["grades"] == {"critical": 22, "safe from below only": 3, "safe after any history": 10}
    assert both["history_examined"]
    assert both["fixed"] == {"depth": 5000.0}
    assert both["axes"] == ["rotary_speed", "wob"]
    # By row: 5, 1, 1, 1; 7 of the last: bit-bounce. Whirl: 2 + 2 + 3 + 3, in either.
    assert both["obstacles"] == {"bit_bounce": 7, "stick_slip": 8, "whirl": 10, "stalled": 0}


def test_a_number_of_the_study_is_an_axis_like_others():
    """Beside the speed: each of its values counts by itself. Coming down from the whirl at
    the last speed the third one of the first value whirls, which lasts."""
    made = grid({"up": [["s..w", "ssww"]], "down": [["s.ww", ".sww"]]}, SPEEDS[:4], WEIGHTS[:2])
    coords = {**made.coords, "wob": WEIGHTS[:1], "bit_rock_stiffness": WEIGHTS[:2]}
    coords = {name: coords[name] for name in (*POINT, "bit_rock_stiffness")}
    variables = {name: np.swapaxes(values, 2, 3)[:, :, None] for name, values in made.variables.items()}
    axis = Axis("bit.rock_stiffness", "N/m", "rock stiffness")
    found = find_window(Results(coords, variables, made.attrs, (axis,)))
    assert (found["safe"], found["rim"], found["points"]) == (2, 1, 8)
    assert found["grades"]["safe from below only"] == found["grades"]["safe after any history"] == 1


def test_region_rows_and_recommended_point(both):
    [one] = both["maps"]
    assert one["regions"] == [{"points": 13, "share": 13 / 35, "rotary_speed": [2.0, 6.0], "wob": [20e3, 40e3]}]
    assert [row["safe"] for row in one["rows"]] == [[], [[2.0, 5.0]], [[2.0, 5.0]], [[2.0, 6.0]], []]
    assert [row["at"] for row in one["rows"]] == [{"wob": weight} for weight in WEIGHTS]
    best = one["recommended"]
    assert (best["rotary_speed"], best["wob"]) == (3.0, 30e3)
    assert not best["hint"]


def test_margins_go_to_the_last_safe_point_and_say_what_comes_next(both):
    margins = both["maps"][0]["recommended"]["margins"]

    def side(margin, safe_to, beyond, why, response):
        return {"margin": margin, "safe_to": safe_to, "first_not_safe": beyond, "why": why, "responses": [response]}

    assert margins["rotary_speed"] == {
        "less": side(1.0, 2.0, 1.0, "critical", "stick_slip"),
        "more": side(2.0, 5.0, 6.0, "critical", "whirl"),
    }
    assert margins["wob"] == {
        "less": side(10e3, 20e3, 10e3, "critical", "stick_slip"),
        "more": side(10e3, 40e3, 50e3, "critical", "bit_bounce"),
    }


def test_a_region_of_one_axis_says_what_bounds_it():
    [area] = find_window(grid({"same": [["s..w"]]}, SPEEDS[:4]))["maps"][0]["regions"]
    assert {name: side["responses"] for name, side in area["sides"].items()} == {
        "less": ["stick_slip"],
        "more": ["whirl"],
    }


def test_points_that_did_not_settle_and_runs_that_are_missing_are_counted():
    data = grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS)
    data.variables["settled"] = np.ones(data["status"].shape, dtype=np.int8)
    data["settled"][1, 0, 2, 2] = 0  # the recommended point
    data["settled"][0, 0, 0, 0] = 0  # a critical one
    note = find_window(data)
    assert note["unsettled_points"] == 1
    assert not note["maps"][0]["recommended"]["settled"]
    data["status"][0, 0, 4, :3] = PENDING
    assert find_window(data)["pending_runs"] == 3


def test_one_procedure_leaves_history_open():
    note = find_window(grid({"up": [UP]}, SPEEDS, WEIGHTS))
    assert not note["history_examined"]
    assert (note["safe"], note["rim"]) == (13, 0)


@pytest.mark.parametrize("sign", ["x", "?"])
def test_failed_points_are_neither_allowed_nor_critical(sign):
    """Coming down at the third weight the third speed has failed, and what was carried from
    it is not known: of the four allowed points one is left."""
    hole = [*DOWN[:2], f"s.{sign}bwww", *DOWN[3:]]
    note = find_window(grid({"up": [UP], "down": [hole]}, SPEEDS, WEIGHTS))
    assert (note["failed"] + note["pending"], note["failed_points"], note["unknown_failed"]) == (1, 1, 2)
    assert (note["safe"], note["rim"], note["critical"], note["unknown"]) == (13 - 2, 0, 22, 2)


@pytest.mark.parametrize(
    ("up", "down", "word"),
    [("x", "x", "unknown"), ("x", ".", "unknown"), ("x", "w", "unknown"), (".", "w", "rim"), ("w", "s", "critical")],
)
def test_a_failed_run_leaves_a_point_unknown(up, down, word):
    """And what comes after it in its chain: nothing was carried there."""
    note = find_window(grid({"up": [f".{up}."], "down": [f".{down}."]}, [1, 2, 3]))
    counts = {"rim": 0, "critical": 0, "unknown": 0, word: 1}
    if word == "unknown":
        counts["unknown"] = 3 if down == "x" else 2
    assert {name: note[name] for name in counts} == counts


def test_a_map_that_failed_throughout_is_unknown():
    note = find_window(grid({"same": [["xx", "xx"]]}, [1, 2], [10e3, 20e3]))
    assert note["share"] == {"safe": 0.0, "rim": 0.0, "critical": 0.0, "unknown": 1.0}


def test_inferred_points_are_as_good_as_run_ones():
    inferred = [line.replace("..", ".i") for line in DOWN]
    assert find_window(grid({"up": [UP], "down": [inferred]}, SPEEDS, WEIGHTS))["safe"] == 13


def test_an_inferred_point_is_not_recommended():
    line = "s.......w"
    speeds = np.arange(1.0, 10.0)
    best = find_window(grid({"up": [line]}, speeds))["answer"].point["rotary_speed"]
    drawn = "".join("i" if speed == best else sign for speed, sign in zip(speeds, line, strict=True))
    found = find_window(grid({"up": [drawn]}, speeds))
    assert found["safe"] == 7
    assert found["answer"].point["rotary_speed"] == best - 1


def test_points_whose_checks_answer_otherwise_are_not_safe():
    """That only the numbers differ is no danger: chaotic motion is like that."""
    data = grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS)
    for check in CHECKS:
        data.variables[f"{check}_status"] = np.full(data["status"].shape, OK, dtype=np.int8)
        data.variables[f"{check}_response"] = data["response"].copy()
    data.variables["trusted"] = np.ones(data["status"].shape, dtype=np.int8)
    data["trusted"][1, 0, 1, 1] = 0
    note = find_window(data)
    assert (note["safe"], note["rim"], note["distrusted_points"]) == (13, 0, 0)
    data["long_response"][1, 0, 1, 1] = 1
    note = find_window(data)
    assert (note["safe"], note["rim"], note["distrusted_points"]) == (13, 0, 1)
    assert note["grades"]["safe from below only"] == 3 + 1, "coming down it is not to be trusted, after whirl"
    # A check that failed leaves a safe run unknown, and a critical one as it was.
    data["long_response"][1, 0, 1, 1] = 0
    data["trusted"][1, 0, :2, 1] = 0
    data["tight_status"][1, 0, :2, 1] = DIVERGED
    note = find_window(data)
    assert (note["safe"], note["rim"], note["critical"], note["unknown"]) == (12, 0, 22, 1)
    assert (note["of"] - note["known"], note["distrusted_points"]) == (1, 0)
    assert "failed_runs" not in note, "failed is the one name"


def test_by_severity():
    """Whatever the responses say: the worst of the three severities counts."""
    data = grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS)
    for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
        data.variables[name] = np.zeros(data["status"].shape, dtype=np.int8)
    data["whirl_severity"][:, 0, :, 5:] = 2
    data["bounce_severity"][1, 0, 4] = 1
    assert [find_window(data, severity)["safe"] for severity in (0, 1, 2)] == [25, 25, 35]
    assert find_window(data, 0)["grades"]["safe from below only"] == 5


def test_what_a_severity_allows_is_told_and_has_not_ended():
    """Brought up it is free, and back down it whirls to the end of the map, moderately below 6 rad/s: with that
    allowed the whirl was said to end there."""
    data = grid({"up": [[".....ww"]], "down": [["wwwwwww"]]}, SPEEDS[:7], WEIGHTS[:1])
    for name in ("bounce_severity", "stick_slip_severity"):
        data.variables[name] = np.zeros(data.shape, dtype=np.int8)
    data.variables["whirl_severity"] = np.where(np.asarray(data["response"]) > 0, 2, 0).astype(np.int8)
    data.variables["whirl_severity"][..., 5:] = 4
    strict, lax = find_window(data), find_window(data, severity=2)
    assert strict["answer"].recover.outcome == Recovery.LASTS
    assert lax["answer"].recover.outcome == Recovery.LASTS
    assert "does not stop" in answer(lax, "si")
    data["response"][:] = 4
    data.variables["whirl_severity"][:] = 4
    allowed = find_window(data, severity=4)
    told = "THE SETTING VIBRATES: it whirls in every run, severe at most."
    assert any(one.startswith(told) for one in warnings(allowed, "si"))
    assert allowed["answer"].kind == Kind.HINT
    assert not any("MAY VIBRATE" in one for one in warnings(strict, "si"))


def test_by_severity_an_inferred_point_is_unknown():
    data = grid({"up": [".i.."], "down": [".i.w"]}, [1, 2, 3, 4])
    for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
        data.variables[name] = np.zeros(data["status"].shape, dtype=np.int8)
    note = find_window(data, 0)
    assert (note["safe"], note["critical"], note["unknown"], note["failed"]) == (3, 0, 1, 0)
    assert (note["unknown_failed"], obstacle(classes(data, 0), (0, 0, 1))["why"]) == (0, "unknown")
    assert find_window(data)["safe"] == 3


def spoken(note) -> str:
    """All words of an answer: the sentence, the lines and the orders."""
    orders = Orders(*needed_for_words(note, "si"))
    return " ".join(" ".join([answer(note, "si"), *lines(note, "si"), *orders.do(), *orders.do_not()]).split())


def of_three_starts() -> Results:
    data = grid({"same": ["...."]}, [1, 2, 3, 4])
    data.coords["start"] = np.arange(3)
    data.variables = {name: np.repeat(values[..., None], 3, axis=-1) for name, values in data.variables.items()}
    return data


def test_what_many_starts_show():
    """Safe from all starts: after any history. From some: it is not allowed, but a hint, with its
    share; nothing was brought up or down."""
    data = of_three_starts()
    data["response"][0, 0, 0, 1, 2] = 1
    data["response"][0, 0, 0, 3] = 1
    note = find_window(data)
    assert note["grades"] == {"critical": 1, "free from some starts only": 1, "safe after any history": 2}
    assert (note["histories"], note["starts"], note["safe"]) == (3, 3, 2)
    beyond = note["answer"].stay_within["rotary_speed"]
    assert [one.free_from for one in (beyond.below, beyond.above)].count((2, 3)) == 1
    assert "at 2 rad/s (19.1 rpm) it is free from 2 of 3 starts only: from others it bounces" in spoken(note)
    data["response"][0, 0, 0, :, 0] = 1
    data["response"][0, 0, 0, 2, 2] = 1
    found = find_window(data)
    assert found["answer"].kind == "hint"
    assert found["answer"].point == {"rotary_speed": 1.0}, "two of three, and the others fewer"
    assert answer(found, "si").startswith("Hint only: 1 rad/s (9.55 rpm) is free of vibration from 2 of 3 starts (")
    assert (found["safe"], found["maps"][0]["recommended"]) == (0, None)
    for word in ("from below", "coming down", "Never exceed", "Bring up", "bring up"):
        assert word not in spoken(found)


def test_a_failed_start_leaves_open_whether_all_are_safe():
    data = of_three_starts()
    data["response"][0, 0, 0, 1, 1] = 1
    data["status"][0, 0, 0, 1, 2] = DIVERGED
    note = find_window(data)
    assert (note["grades"]["free from some starts only"], note["unknown"], note["failed_points"]) == (1, 0, 1)


def test_failed_starts_do_not_turn_the_hint_to_a_point_that_vibrates_from_more():
    """At 1 rad/s one known start of two is free, at 2 rad/s both."""
    data = of_three_starts()
    data["response"][0, 0, 0, :, 2] = 1
    data["response"][0, 0, 0, 0, 1] = data["response"][0, 0, 0, 2:, 1] = 1
    assert find_window(data)["answer"].point == {"rotary_speed": 2.0}
    data["status"][0, 0, 0, :2, 2] = DIVERGED  # at 2 rad/s no start is known to vibrate any more
    note = find_window(data)
    assert note["answer"].point == {"rotary_speed": 2.0}
    assert "from 2 of 3 starts (" in answer(note, "si")
    assert (note["safe"], note["answer"].kind) == (0, "hint")


def test_one_axis_has_intervals():
    note = find_window(grid({"up": ["s..w...b"], "down": ["s..w...b"]}, [1, 2, 3, 4, 5, 7, 8, 10]))
    [one] = note["maps"]
    assert note["axes"] == ["rotary_speed"]
    assert [(area["points"], area["rotary_speed"]) for area in one["regions"]] == [(3, [5, 8]), (2, [2, 3])]
    best = one["recommended"]
    assert best["rotary_speed"] == 7.0  # 1 to the last allowed point, at 5 and 8 none
    assert [best["margins"]["rotary_speed"][side]["margin"] for side in ("less", "more")] == [2.0, 1.0]


def test_nothing_safe_gives_no_recommendation():
    note = find_window(grid({"up": ["sssw"], "down": ["sss."]}, [1, 2, 3, 4]))
    assert (note["safe"], note["rim"]) == (0, 1)
    assert note["answer"].kind == "nothing"
    assert note["answer"].grade == Grade.ONLY_FROM_ABOVE
    assert note["maps"][0]["recommended"] is None
    assert note["maps"][0]["regions"] == []


DEPTHS = (1000.0, 2000.0, 3000.0, 4000.0, 5000.0)


def stack(*maps: list[str]) -> dict:
    return find_window(grid({"up": list(maps), "down": list(maps)}, [1, 2, 3], [10e3, 20e3], DEPTHS[: len(maps)]))


def test_the_depth_at_which_it_closes_and_reopens():
    full, some, none = ["...", "..."], ["w.w", "www"], ["www", "www"]
    note = stack(full, some, none, some, none)
    assert note["depth"]["open"] == [[1000, 2000], [4000, 4000]]
    assert (note["depth"]["closes"], note["depth"]["reopens"]) == (3000, 4000)
    assert [row["safe"] for row in note["depth"]["rows"]] == [6, 1, 0, 1, 0]
    assert [one["at"] for one in note["maps"]] == [{"depth": depth} for depth in DEPTHS]
    assert note["third"] == "depth"
    assert stack(full, some)["depth"]["closes"] is None
    late = stack(none, some, none)["depth"]
    assert (late["open"], late["closes"], late["reopens"]) == ([[2000, 2000]], 3000, None)
    assert stack(none, none)["depth"] == {**stack(none, none)["depth"], "open": [], "closes": None, "reopens": None}


def test_one_setting_holds_over_depths():
    """At 20 kN and the third speed from the first depth to the second; the other points of
    the second depth stick."""
    note = stack(["...", "..."], ["sss", "ss."], ["www", "www"])
    found = note["answer"]
    assert (found.point, found.at) == ({"wob": 20e3, "rotary_speed": 3.0}, {})
    assert (found.depths.first, found.depths.last, found.depths.beyond) == (1000, 2000, 3000)
    assert answer(note, "si").startswith(
        "Hint only: from 1000 to 2000 m 20 kN and 3 rad/s (28.6 rpm) is free of vibration, brought up from below; at "
        "3000 m no longer"
    )
    late = stack(["www", "www"], ["www", "..."])
    assert (late["answer"].depths.first, late["answer"].depths.above) == (2000, 1000)
    assert "; nothing is at 1000 m" in answer(late, "si")


def test_depth_across_weight_and_depth_across_speed():
    data = grid({"up": [["..w"], ["..."], ["sss"]], "down": [["..w"], ["..w"], ["sss"]]}, [1, 2, 3], [20e3], DEPTHS[:3])
    note = find_window(data)
    assert note["axes"] == ["rotary_speed", "depth"]
    # coming down at the second depth the third speed whirls without an excursion
    assert (note["safe"], note["rim"]) == (4, 1)
    assert note["maps"][0]["regions"][0] == {"points": 4, "share": 4 / 9, "rotary_speed": [1, 2], "depth": [1000, 2000]}
    assert note["depth"]["closes"] == 3000
    weights = grid({"same": [[".", "w"], ["w", "w"]]}, [3.0], [10e3, 20e3], DEPTHS[:2])
    note = find_window(weights)
    assert note["axes"] == ["wob", "depth"]
    assert note["maps"][0]["recommended"]["depth"] == 1000
    alone = find_window(grid({"up": [["."], ["."], ["w"]]}, [3.0], [10e3], DEPTHS[:3]))
    assert answer(alone, "si") == (
        "Hint only: from 1000 to 2000 m 10 kN and 3 rad/s (28.6 rpm) is free of vibration, coming from shallower "
        "depths; at 3000 m no longer."
    )
    assert alone["answer"].stay_within == {}


def test_a_single_point_has_no_window():
    with pytest.raises(InputError, match="at least one axis"):
        find_window(grid({"same": ["."]}, [3.0]))


# -- the plane


def test_regions_touch_along_the_axes_only():
    safe = np.array([[1, 1, 0, 0], [1, 0, 1, 0], [0, 0, 1, 1]], dtype=bool)
    assert regions(safe) == [(3, (0, 1, 0, 1)), (3, (1, 2, 2, 3))]
    assert regions(np.zeros((2, 2), dtype=bool)) == []


# -- files


def test_from_a_file(shared):
    note = nsdrill.window(shared / "small.h5")
    assert note["procedures"] == ["up", "down"]
    assert note["safe"] + note["rim"] + note["critical"] == note["points"] == 8
    assert json.loads(json.dumps(note, allow_nan=False)) == note
    assert nsdrill.window(shared / "small.h5", severity=4)["safe"] == 8
    assert nsdrill.window(shared / "failing.h5")["failed"] > 0
    with pytest.raises(InputError, match="0 to 4"):
        nsdrill.window(shared / "small.h5", severity=5)
    with pytest.raises(FileError, match="no such file"):
        nsdrill.window(shared / "nowhere.h5")


def test_what_the_points_yield_is_told():
    """The fastest allowed point is the one that is free coming up with the greatest rate."""
    results = grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS)
    rate = np.broadcast_to(WEIGHTS[:, None] * SPEEDS, results.shape)
    rate = rate * np.array([1.0, 7.0])[:, None, None, None]  # that of the way in is told
    results.variables["rate_of_penetration"] = rate
    [one] = find_window(results)["maps"]
    assert one["recommended"]["rate_of_penetration"] == 3.0 * 30e3
    safe = {(w, s) for i, w in enumerate(WEIGHTS) for j, s in enumerate(SPEEDS) if UP[i][j] == "."}
    assert find_window(results)["answer"].yields["rate_of_penetration"] == 3.0 * 30e3
    weight, speed = max(safe, key=lambda at: at[0] * at[1])
    assert one["fastest"] == {"rotary_speed": speed, "wob": weight, "rate_of_penetration": weight * speed}
    assert find_window(grid({"up": [UP]}, SPEEDS, WEIGHTS))["maps"][0]["fastest"] is None


def said(results: Results, confidence: float | None = None) -> tuple[str, str]:
    """The answer and the warnings of a window."""
    note = {**find_window(results, confidence=confidence)}
    return answer(note, "si"), "\n".join(warnings(note, "si"))


ROOMY = ["s.....w"] * 5


def test_only_a_point_with_room_that_was_brought_up_from_below_is_an_order():
    """No room, or a sweep that begins above a critical speed: each makes it a hint. A motion
    that was still changing is told."""
    firm = grid({"up": [ROOMY], "down": [ROOMY]}, SPEEDS, WEIGHTS)
    assert said(firm)[0].startswith("Run at 30 kN and 4 rad/s")
    tight = grid({"up": [["ssss.ww"] * 5], "down": [["ssss.ww"] * 5]}, SPEEDS, WEIGHTS)
    assert said(tight)[0].startswith("No setting has room. Narrow hint: ")
    unsettled = grid({"up": [ROOMY], "down": [ROOMY]}, SPEEDS, WEIGHTS)
    unsettled.variables["settled"] = np.ones(unsettled["status"].shape, dtype=np.int8)
    unsettled["settled"][0, 0, 2, 3] = 0
    text, warned = said(unsettled)
    assert text.startswith("Not settled, not to drill by. To confirm: run at 30 kN and 4 rad/s")
    assert warned.startswith("NOT SETTLED: at 1 of 25 allowed points, the best one among them,")
    above = grid({"up": [ROOMY], "down": [ROOMY]}, SPEEDS, WEIGHTS)
    above.attrs["lasting_motions"] = json_text([{**WALL, "from": 1.0, "everywhere": True}])
    each = grid({"up": [ROOMY], "down": [ROOMY]}, SPEEDS, WEIGHTS)
    each.attrs["lasting_motions"] = json_text([{**WALL, "from": 7.0, "everywhere": True, "each": True}])
    for results, word in (
        (above, "THE SWEEP BEGINS at 1 rad/s (9.55 rpm), above it, 0.5 to 0.7 rad/s (4.77 to 6.68 rpm). A string"),
        (each, "EACH SPEED IS SWEPT BY ITSELF, up to 7 rad/s (66.8 rpm), above it, 0.5 to 0.7 rad/s"),
    ):
        text, warned = said(results)
        assert text.startswith(
            "Hint only: 30 kN and 4 rad/s (38.2 rpm). The sweep begins above it; nothing was brought"
        )
        assert word in warned
    assert "Begin the sweep below 0.5 rad/s (4.77 rpm)." in said(above)[1]


def test_a_sweep_that_begins_above_the_onset_of_stick_slip_is_a_hint_where_nothing_stuck():
    """Only at the weights at which stick-slip would last, and where the bit did not stick
    on the way up to the point."""
    onset = {**WALL, "name": "stick_slip_onset", "lasts": None, "from": 1.0, "everywhere": True}
    free = ["......w"] * 5
    for line, weights, is_hint in ((free, [10e3, 50e3], True), (free, [40e3, 50e3], False), (ROOMY, [0, 1e5], False)):
        results = grid({"up": [line], "down": [line]}, SPEEDS, WEIGHTS)
        results.attrs["lasting_motions"] = json_text([{**onset, "weights": weights}])
        text, warned = said(results)
        assert text.startswith("Hint only: 30 kN") == is_hint
        assert ("THE SWEEP BEGINS at 1 rad/s" in warned) == is_hint
        assert bool(find_window(results)["passed_over"]) == is_hint


@pytest.mark.parametrize("weights", [[20e3], [10e3, 20e3, 30e3]])
def test_where_it_is_known_to_which_speed_stick_slip_lasts_the_first_speed_changes_no_order(weights):
    """Of one string whose stick-slip begins at 1.9 and lasts to 4.2 rad/s: swept from below its onset, from
    between, and from above where it lasts, it is brought up to the same speeds. Where the model does not tell
    to which speed it lasts, what begins above the onset is a hint."""
    speeds = np.arange(1.0, 12.0)
    onset = {**WALL, "name": "stick_slip_onset", "lasts": None, "min": 1.9, "max": 1.9, "weights": [20e3, 30e3]}

    def answer_from(first, *lasts_to):
        line = ("s.........w")[int(first) - 1 :]
        one = grid({way: [[line] * len(weights)] for way in ("up", "down")}, speeds[speeds >= first], weights)
        if first > 1.9:
            one.attrs["lasting_motions"] = json_text([{**onset, "from": first, "everywhere": True}])
        return find_window(told(one, list(lasts_to)) if lasts_to else one)

    lasts_to = [4.2] if len(weights) == 1 else [1.5, 4.2, 4.3]
    swept = [answer_from(first, *lasts_to) for first in (1.0, 2.0, 3.0, 5.0)]
    assert [one["passed_over"] for one in swept] == 4 * [[]]
    assert {one["answer"].kind for one in swept} <= set(RECOMMENDED)
    assert not any("THE SWEEP BEGINS" in text for one in swept for text in warnings(one, "si"))
    safe = {tuple(one["maps"][0]["rows"][weights.index(20e3)]["safe"][0]) for one in swept}
    assert safe == {(5.0, 10.0)}
    assert answer_from(2.0)["answer"].kind == Kind.HINT


@settings(max_examples=60)
@given(st.text("...sbw", min_size=10, max_size=10), st.text("...sbw", min_size=10, max_size=10), st.integers(1, 6))
def test_to_begin_a_sweep_higher_makes_no_answer_firmer(up, down, left_out):
    """Stick-slip begins below 1.9 rad/s, and to which speed it lasts is not known: of a sweep that begins above
    that nothing was brought up through it, whatever its runs show."""
    speeds = np.arange(1.0, 12.0)
    onset = {**WALL, "name": "stick_slip_onset", "lasts": None, "min": 1.9, "max": 1.9, "weights": [20e3, 20e3]}

    def answer_from(first):
        one = grid({"up": [f"s{up}"[first:]], "down": [f"s{down}"[first:]]}, speeds[first:])
        if first:
            one.attrs["lasting_motions"] = json_text([{**onset, "from": speeds[first], "everywhere": True}])
        return find_window(one)

    whole, cut = answer_from(0), answer_from(left_out)
    assert cut["answer"].kind not in RECOMMENDED or whole["answer"].kind in RECOMMENDED
    if "s" not in up:
        assert cut["answer"].kind not in RECOMMENDED


def test_points_that_are_free_from_a_start_only_do_not_widen_what_is_free_from_below():
    """Beyond 4 rad/s the way up whirls, whatever a start at the point does: no point may be
    held to beyond it, and the room ends there."""
    up, start = ["s...www"] * 5, ["......."] * 5
    with_start = find_window(grid({"up": [up], "down": [up], "same": [start]}, SPEEDS, WEIGHTS))["answer"]
    without = find_window(grid({"up": [up], "down": [up]}, SPEEDS, WEIGHTS))["answer"]
    assert with_start.kind == without.kind
    assert with_start.point == without.point
    assert with_start.point["rotary_speed"] == 3.0
    assert with_start.room == without.room
    assert with_start.stay_within["rotary_speed"].high == without.stay_within["rotary_speed"].high == 4.0
    assert with_start.never_exceed("rotary_speed") == without.never_exceed("rotary_speed") == 4.0


def test_steps_that_may_jump_across_a_critical_speed_are_told():
    """Nothing is said of it where no point is allowed."""
    jumped = {"from": 0.5, "to": 0.9, "step": 1.6, "enough": 0.2}
    told = (
        "STEPS OF 1.6 rad/s (15.3 rpm) MAY JUMP across it, anywhere from 0.5 to 0.9 rad/s (4.77 to 8.59 rpm): a point "
        "that is safe here need not be safe with finer steps. There steps of 0.2 rad/s (1.91 rpm) are fine enough."
    )
    for line, is_told in (("s.....w", True), ("sssssww", False)):
        results = grid({"up": [[line] * 5], "down": [[line] * 5]}, SPEEDS, WEIGHTS)
        results.attrs["lasting_motions"] = json_text([{**WALL, "jumped": jumped}])
        text, warned = said(results)
        assert (told in warned) == is_told
        assert text.startswith("Run at 30 kN" if is_told else "Nothing is safe")


def test_a_point_at_which_another_motion_may_last_is_safe_on_a_condition():
    """From 0.6 to 0.8 rad/s on, at any higher speed, whatever sets it going: the way down,
    which did not roll, does not show that it ends. A sweep that ends below has no such
    warning, nor one that begins above."""
    condition = (
        "IT MAY LAST above 0.6 to 0.8 rad/s (5.73 to 7.64 rpm): the best point is safe only while it is fair. Many"
    )
    results = grid({"up": [ROOMY], "down": [ROOMY]}, SPEEDS, WEIGHTS)
    assert "MAY LAST" not in said(results)[1]
    results.variables["whirl_kind"][:] = 1  # whirl, but no rolling
    results.attrs["lasting_motions"] = json_text([WALL])
    text, warned = said(results)
    assert text.startswith("Bring up to 30 kN and 4 rad/s (38.2 rpm) from below")
    assert condition in warned
    for other in ({"lasts": [7.5, 8.0]}, {"lasts": None}, {"from": 0.4, "everywhere": True}):
        results.attrs["lasting_motions"] = json_text([{**WALL, **other}])
        assert "MAY LAST" not in said(results)[1]
    results.attrs["lasting_motions"] = json_text([{**WALL, "lasts": None}])
    assert find_window(results)["passed_over"] == []


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ("rotary_speed: [9 rad/s, 12 rad/s]", "ONE AXIS ONLY: the speed was swept, at 3000 m, 20 kN."),
        ("rotary_speed: [9 rad/s, 12 rad/s], drive.kind: [ideal, soft_torque]", "ONE AXIS ONLY: the speed was swept"),
        (
            "along: rotary_speed, rotary_speed: [9 rad/s, 12 rad/s], depth: [2000 m, 3000 m]",
            "ONE WEIGHT ONLY: all runs are at 20 kN. Of",
        ),
        (
            "along: wob, wob: [20 kN, 40 kN], depth: [2000 m, 3000 m]",
            "ONE SPEED ONLY: all runs are at 10 rad/s (95.5 rpm). Of",
        ),
        ("along: wob, rotary_speed: [9 rad/s, 12 rad/s], wob: [20 kN, 40 kN], drive.kind: [ideal, soft_torque]", ""),
    ],
)
def test_a_setting_that_has_one_value_is_told_whatever_else_is_swept(tmp_path, axes, words):
    """The kind of a drive, or the depth, is no setting beside which another weight was tried."""
    study = f"""
modes: {{axial: frozen, lateral: frozen}}
operation: {{depth: 3000 m, wob: 20 kN, rotary_speed: 10 rad/s}}
sweep: {{{axes}, procedure: up}}
simulation: {{transient: 1 s, observe: 2 s}}
"""
    (tmp_path / "one.yaml").write_text(study, encoding="utf-8")
    nsdrill.run(nsdrill.load_study(tmp_path / "one.yaml"), tmp_path / "one.h5")
    warned = " ".join(nsdrill.window(tmp_path / "one.h5")["answer"]["warnings"])
    assert words in warned
    assert bool(words) == bool(re.search("ONE (AXIS|WEIGHT|SPEED) ONLY", warned))


def test_without_a_safe_point_the_warnings_are_of_all_points():
    """Three points of six are not settled, two are safe one way."""
    results = grid({"up": [["ss.", "sss"]], "down": [["sss", ".ss"]]}, [1.0, 2.0, 3.0], [1e3, 2e3])
    results.variables["settled"] = np.ones(results["status"].shape, dtype=np.int8)
    results["settled"][0, 0, 0, :] = 0
    text, warned = said(results)
    # 3 rad/s at 1 kN is free coming up and sticks coming down, without an excursion: near a limit
    assert text.startswith("Nothing is safe brought up from below. 2 kN and 1 rad/s (9.55 rpm) is free only when")
    assert "NOT SETTLED: at 3 of 6 points a motion" in warned
    assert "THE MAP ENDS: only 1 to 2 kN and 1 to 3 rad/s (9.55 to 28.6 rpm) was examined" in warned


def test_where_the_bit_stalls_is_said():
    """Above the third weight at every speed, and below the second speed."""
    up = ["t....", "t....", "t....", "ttttt"]
    data = grid({"up": [up], "down": [up]}, SPEEDS[:5], WEIGHTS[:4])
    text, warned = said(data)
    assert text.startswith("Bring up to 3 rad/s (28.6 rpm) off bottom, set 20 kN; stay at 2 to 5 rad/s ")
    assert "THE BIT STALLS at 8 points" in warned
    assert "Slower: at 1 rad/s (9.55 rpm) the bit stalls." in "\n".join(lines(find_window(data), "si"))
    narrow = grid({"up": [["..", "..", "tt"]]}, SPEEDS[:2], WEIGHTS[:3])
    assert "; from 30 kN the bit stalls." in said(narrow)[0]
    assert "from 6.7 klbf the bit stalls." in answer(find_window(narrow), "field")


def test_where_everything_stalls_no_severity_is_advised():
    data = grid({"same": ["tttt"]}, SPEEDS[:4])
    text = "\n".join(lines(find_window(data), "si", everything=True))
    assert "stalled at 4" in text
    assert "no severity allows a run" in text
    assert "--severity" not in text


def test_one_damping_at_every_depth_is_said():
    """Of a map over depth, with an ideal drive: the onset of stick-slip does not depend on it."""
    maps = [["s....."], ["s....."]]
    data = grid({"up": maps}, np.arange(1.0, 7.0), depth=(2000.0, 5000.0))
    string = {"drillstring": {"torsional_damping": 50.0}, "drive": {"kind": "ideal"}}
    text = "DEPTH DOES NOT CHANGE THE ONSET of stick-slip here"
    for study, depths, is_said in (
        (string, 2, True),
        ({**string, "drive": {"kind": "pi"}}, 2, False),
        (string, 1, False),
    ):
        part = data if depths == 2 else grid({"up": maps[:1]}, np.arange(1.0, 7.0))
        part.attrs["study_resolved"] = json.dumps(study)
        found = find_window(part)
        assert found["one_damping"] == is_said
        assert any(told.startswith(text) for told in warnings(found, "si")) == is_said


def test_a_failed_run_makes_no_setting_of_a_hint():
    """The sweep begins above the onset of the lightest weights, where the deepest point is; that at
    another weight is a setting with and without them."""
    onset = {**WALL, "name": "stick_slip_onset", "from": 1.0, "weights": [0.0, 65e3], "lasts": None}
    ways = [7 * "."] * 6 + [7 * "s"] + [7 * "."] * 3

    def kind_of(*failed):
        found = grid({"up": [ways], "down": [ways]}, SPEEDS, np.arange(10e3, 110e3, 10e3))
        found.attrs["lasting_motions"] = json_text([onset])
        for weight, speed in failed:
            found["status"][:, 0, weight, speed] = DIVERGED
        return find_window(found)["answer"].kind

    before = kind_of()
    assert before in RECOMMENDED
    for failed in ([(2, 3)], [(8, 3)], list(np.ndindex(6, 7)), list(np.ndindex(10, 7))):
        after = kind_of(*failed)
        assert after not in RECOMMENDED or RECOMMENDED.index(after) >= RECOMMENDED.index(before)


def test_what_a_start_met_is_not_told_of_the_way_down():
    """At 12 rad/s the way up and the way down are free, and the start at the point whirls."""
    carried, started = ["s" + 12 * "." + "w"], ["s" + 10 * "." + "w.w"]
    found = find_window(grid({"up": carried, "down": carried, "same": started}, np.arange(1.0, 15.0)))
    beyond = found["answer"].lines["rotary_speed"].above
    assert (beyond.value, beyond.grade, beyond.is_started) == (12.0, Grade.FROM_BELOW, True)
    assert "free from below only: started there it whirls" in " ".join(" ".join(lines(found, "si")).split())


def test_a_milder_standard_keeps_no_point_that_it_does_not_allow():
    """A mild bounce above 7 rad/s shows, on the way down, that it ends; where it is allowed nothing shows it."""
    up, down = ["s........", "s......b.", "s......b."], ["s........", "s....b.b.", "s....b.b."]
    found = grid({"up": [up], "down": [down]}, np.arange(1.0, 10.0), np.arange(10e3, 40e3, 10e3))
    bounce = found["response"] & 1
    for name in ("bit_bounce", "stick_slip", "whirl"):
        found.variables[f"{name}_severity"] = np.where(found["response"] > 0, 4, 0).astype(np.int8)
    found.variables["bit_bounce_severity"] = bounce.astype(np.int8)
    for level in (None, 1, 2, 3):
        one = find_window(found, severity=level)
        within, allowed = one["answer"].stay_within, classes(found, level).grades.allowed[0]
        rows = (WEIGHTS[:3] >= within["wob"].low) & (WEIGHTS[:3] <= within["wob"].high)
        speeds = np.arange(1.0, 10.0)
        columns = (speeds >= within["rotary_speed"].low) & (speeds <= within["rotary_speed"].high)
        assert allowed[np.ix_(rows, columns)].all()


def test_a_hint_to_which_a_way_in_is_known_comes_first_whatever_the_end_of_the_sweep():
    """A wide field above 9 rad/s is free from a start only, and no drive passes the wall below it."""
    wall = {
        **WALL,
        "name": "wall_speed",
        "off_bottom": {"from": 7.5, "to": 8.5, "passing_rate": 2.0, "sure_rate": 4.0, "swing": 0.1},
    }
    up, same = ["s....wwwwwwwwww", *["s" * 15] * 4], ["." * 15] + ["sssssssss......"] * 4
    kinds = []
    for last in (7, 12, 15):
        part = [[line[:last] for line in lines] for lines in (up, same)]
        found = grid({"up": [part[0]], "same": [part[1]]}, np.arange(1.0, last + 1.0), WEIGHTS)
        found.attrs["lasting_motions"] = json_text([wall])
        kinds.append((find_window(found)["answer"].kind, *find_window(found)["answer"].point.values()))
    assert len({one[1:] for one in kinds}) == 1
    assert kinds[0][1:] == (3.0, 10e3)


def test_a_window_is_that_of_the_file_in_any_order_of_dimensions():
    """Of each setting the model says to which speed stick-slip lasts, by its place: an order of the dimensions
    changes nothing, and values that do not ascend are refused."""
    study = {
        "model": "torsion",
        "operation": {"depth": "3000 m"},
        "sweep": {
            "rotary_speed": {"from": "4 rad/s", "to": "12 rad/s", "points": 5},
            "wob": ["30 kN", "60 kN", "90 kN"],
            "procedure": "up-down",
            "along": "rotary_speed",
        },
        "simulation": {"transient": "60 s", "observe": "40 s"},
    }
    data = nsdrill.run(study, progress=False)
    wanted = json.dumps(nsdrill.window(data), default=str, sort_keys=True)
    assert '"modelled": true' in wanted
    for order in permutations(("procedure", "rotary_speed", "wob")):
        found = nsdrill.window(data.transpose(*order, ...))
        assert json.dumps(found, default=str, sort_keys=True) == wanted
    for axis in ("rotary_speed", "wob"):
        with pytest.raises(InputError, match=f"found values of {axis} that do not ascend"):
            nsdrill.window(data.isel({axis: slice(None, None, -1)}))


def test_a_response_that_cannot_be_seen_has_no_number():
    """The lateral motion is frozen: at how many points it whirls is not known, and not zero."""
    data = grid({"up": ["s.bb"]}, np.arange(1.0, 5.0))
    data.attrs["study_resolved"] = json.dumps({"modes": {"lateral": "frozen", "axial": "free"}})
    assert find_window(data)["obstacles"] == {"bit_bounce": 2, "stick_slip": 1, "whirl": None, "stalled": 0}
    other = grid({"up": ["s.bw"]}, np.arange(1.0, 5.0))
    assert contrast(data, other)["responses"]["whirl"] == {"a": None, "b": 1}


def test_the_hint_among_what_is_forbidden_is_excepted_once():
    """Free only when lowered, at 7 rad/s, where at the other weight it bounces."""
    ways = {"up": [["sssbbww", "ssbbbww"]], "down": [["sbbb.ww", "ssbbbww"]]}
    data = grid(ways, [4, 5, 6, 7, 8, 9, 10], [10e3, 20e3])
    data["response"][:, 0, 1] |= np.where(data["response"][:, 0, 1] == 2, 0, 2).astype(np.int8)  # and sticks throughout
    orders = Orders(*needed_for_words(find_window(data), "si")).do_not()
    assert len(orders) == 3
    assert [("exception, as a hint, is 10 kN and 8 rad/s" in one) for one in orders] == [False, False, True]
    assert "hint" not in " ".join(orders[:2])
