"""The operating window against maps in which it can be read off by eye. Margins and
distances are worked out by hand."""

import json

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.maps import largest_margin, normalised, regions
from nsdrill.analysis.window import find_window
from nsdrill.data import Results, json_text
from nsdrill.errors import FileError, InputError
from nsdrill.plot.answer import answer, warnings
from nsdrill.text.window import lines
from nsdrill.variables import CHECKS, DIVERGED, OK, PENDING, POINT, Axis

from .grids import grid

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
}


@pytest.fixture
def both():
    return find_window(grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS))


def test_safe_history_dependent_and_critical_are_counted(both):
    """Safe: 4 + 3 + 3. History-dependent: the fifth speed of the third weight, the fifth
    and sixth of the fourth."""
    assert (both["safe"], both["rim"], both["critical"], both["points"]) == (10, 3, 22, 35)
    assert both["share"] == {"safe": 10 / 35, "rim": 3 / 35, "critical": 22 / 35, "unknown": 0.0}
    assert both["safe_in"] == {"up": 13, "down": 10}
    assert both["history_examined"]
    assert both["fixed"] == {"depth": 5000.0}
    assert both["axes"] == ["rotary_speed", "wob"]
    # By row: 5, 1, 1, 1; 7 of the last: bit-bounce. Whirl: 2 + 2 + 3 + 3, in either.
    assert both["obstacles"] == {"bit_bounce": 7, "stick_slip": 8, "whirl": 10, "stalled": 0}


def test_each_procedure_is_counted_over_all_axes():
    """A number of the study as an axis beside the speed: each of its values counts by
    itself."""
    made = grid({"up": [["s..w", "ssww"]], "down": [["s.ww", ".sww"]]}, SPEEDS[:4], WEIGHTS[:2])
    coords = {**made.coords, "wob": WEIGHTS[:1], "bit_rock_stiffness": WEIGHTS[:2]}
    coords = {name: coords[name] for name in (*POINT, "bit_rock_stiffness")}
    variables = {name: np.swapaxes(values, 2, 3)[:, :, None] for name, values in made.variables.items()}
    axis = Axis("bit.rock_stiffness", "N/m", "rock stiffness")
    found = find_window(Results(coords, variables, made.attrs, (axis,)))
    assert found["safe_in"] == {"up": 2, "down": 2}
    assert (found["safe"], found["rim"], found["points"]) == (1, 2, 8)


def test_region_and_recommended_point(both):
    """The third speed of the third weight: two steps of six from what is not safe, on
    either side."""
    [one] = both["maps"]
    assert one["regions"] == [{"points": 10, "share": 10 / 35, "rotary_speed": [2.0, 5.0], "wob": [20e3, 40e3]}]
    best = one["recommended"]
    assert (best["rotary_speed"], best["wob"]) == (3.0, 30e3)
    assert best["margin"] == pytest.approx(2 / 6)  # a step of the speed is 1/6, of the weight 1/4


def test_margins_go_to_the_last_safe_point_and_say_what_comes_next(both):
    margins = both["maps"][0]["recommended"]["margins"]

    def side(margin, safe_to, beyond, why, response):
        return {
            "margin": margin,
            "safe_to": safe_to,
            "first_not_safe": beyond,
            "why": why,
            "responses": [response],
            "safe_in": ["up"] if why == "rim" else [],
        }

    told = {
        axis: {name: {k: v for k, v in one.items() if k != "reason"} for name, one in sides.items()}
        for axis, sides in margins.items()
    }
    assert told["rotary_speed"] == {
        "less": side(1.0, 2.0, 1.0, "critical", "stick_slip"),
        "more": side(1.0, 4.0, 5.0, "rim", "whirl"),
    }
    assert told["wob"] == {
        "less": side(10e3, 20e3, 10e3, "critical", "stick_slip"),
        "more": side(10e3, 40e3, 50e3, "critical", "bit_bounce"),
    }


def carried(up: list[str], down: list[str]) -> dict:
    """The window of an up-down sweep along the speed: four speeds, weights from the
    lowest one."""
    weights = 10e3 * np.arange(1.0, 1 + len(up))
    made = grid({"up": [up], "down": [down]}, SPEEDS[: len(up[0])], weights)
    made.attrs["study_resolved"] = json.dumps({"sweep": {"along": "rotary_speed"}})
    return find_window(made)["maps"][0]["recommended"]["margins"]


@pytest.mark.parametrize(
    ("up", "down", "axis", "side", "expected"),
    [
        # At the lower weight the collar reaches the wall at the second speed; at the
        # upper one the string sticks there, and the collar is free above.
        (
            ["swwww", "ss..."],
            ["swwww", "ss..."],
            "wob",
            "less",
            {"code": "passes_in_stick_slip", "procedure": "up", "value": 2.0},
        ),
        # Coming down the collar is on the wall from the greatest speed on.
        (
            [".....", "....."],
            ["...ww", "wwwww"],
            "wob",
            "more",
            {"code": "starts_on_wall", "procedure": "down", "value": 5.0},
        ),
        # Coming up it reaches the wall at the fourth speed, coming down it stays there.
        (["....ww"], ["..www."], "rotary_speed", "more", {"code": "stays_on_wall", "procedure": "down", "value": 5.0}),
        # The bounce lasts on the way down.
        (["...bb"], [".bbbb"], "rotary_speed", "more", {"code": "bounce_lasts", "procedure": "down", "value": None}),
        (["ss...."], ["s....."], "rotary_speed", "less", {"code": "sticking_lasts", "procedure": "up", "value": None}),
    ],
)
def test_a_border_that_surprises_has_its_reason(up, down, axis, side, expected):
    assert carried(up, down)[axis][side]["reason"] == {"axis": "rotary_speed", **expected}


def test_a_border_that_is_what_it_seems_needs_no_reason():
    """Whirl that begins there on either way."""
    assert carried(["...ww"], ["...ww"])["rotary_speed"]["more"]["reason"] is None


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
def test_failed_points_are_neither_safe_nor_critical(sign):
    """Of the two points of the third weight that are taken from the window one has
    failed, the other bounces going down; both are safe going up."""
    hole = [*DOWN[:2], f"s.{sign}bwww", *DOWN[3:]]
    note = find_window(grid({"up": [UP], "down": [hole]}, SPEEDS, WEIGHTS))
    assert (note["failed_runs"], note["failed_points"], note["unknown_failed"]) == (1, 1, 1)
    assert (note["safe"], note["rim"], note["critical"], note["unknown"]) == (10 - 2, 3 + 1, 22, 1)
    margins = note["maps"][0]["recommended"]["margins"]
    assert "failed" in {side["why"] for axis in margins.values() for side in axis.values()}


@pytest.mark.parametrize(
    ("up", "down", "word"),
    [("x", "x", "unknown"), ("x", ".", "unknown"), ("x", "w", "unknown"), (".", "w", "rim"), ("w", "s", "critical")],
)
def test_a_failed_run_leaves_a_point_unknown(up, down, word):
    note = find_window(grid({"up": [f".{up}."], "down": [f".{down}."]}, [1, 2, 3]))
    assert {name: note[name] for name in ("rim", "critical", "unknown")} == {
        "rim": 0,
        "critical": 0,
        "unknown": 0,
        word: 1,
    }
    limits = note["maps"][0]["recommended"]["margins"]["rotary_speed"].values()
    assert {"failed" if word == "unknown" else word, "edge"} == {side["why"] for side in limits}


def test_a_map_that_failed_throughout_is_unknown():
    note = find_window(grid({"same": [["xx", "xx"]]}, [1, 2], [10e3, 20e3]))
    assert note["share"] == {"safe": 0.0, "rim": 0.0, "critical": 0.0, "unknown": 1.0}


def test_inferred_points_are_as_good_as_run_ones():
    inferred = [line.replace("..", ".i") for line in DOWN]
    assert find_window(grid({"up": [UP], "down": [inferred]}, SPEEDS, WEIGHTS))["safe"] == 10


def test_points_whose_checks_answer_otherwise_are_not_safe():
    """That only the numbers differ is no danger: chaotic motion is like that."""
    data = grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS)
    for check in CHECKS:
        data.variables[f"{check}_status"] = np.full(data["status"].shape, OK, dtype=np.int8)
        data.variables[f"{check}_response"] = data["response"].copy()
    data.variables["trusted"] = np.ones(data["status"].shape, dtype=np.int8)
    data["trusted"][1, 0, 1, 1] = 0
    note = find_window(data)
    assert (note["safe"], note["rim"], note["distrusted_points"]) == (10, 3, 0)
    data["long_response"][1, 0, 1, 1] = 1
    note = find_window(data)
    assert (note["safe"], note["rim"], note["distrusted_points"]) == (9, 4, 1)
    # A check that failed leaves a safe run unknown, and a critical one as it was.
    data["long_response"][1, 0, 1, 1] = 0
    data["trusted"][1, 0, :2, 1] = 0
    data["tight_status"][1, 0, :2, 1] = DIVERGED
    note = find_window(data)
    assert (note["safe"], note["rim"], note["critical"], note["unknown"]) == (9, 3, 22, 1)
    assert (note["failed_runs"], note["distrusted_points"]) == (1, 0)


def test_by_severity():
    """Whatever the responses say: the worst of the three severities counts."""
    data = grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS)
    for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
        data.variables[name] = np.zeros(data["status"].shape, dtype=np.int8)
    data["whirl_severity"][:, 0, :, 5:] = 2
    data["bounce_severity"][1, 0, 4] = 1
    assert [find_window(data, severity)["safe"] for severity in (0, 1, 2)] == [20, 25, 35]
    assert find_window(data, 0)["rim"] == 5


def test_by_severity_an_inferred_point_is_unknown():
    data = grid({"up": [".i.."], "down": [".i.w"]}, [1, 2, 3, 4])
    for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
        data.variables[name] = np.zeros(data["status"].shape, dtype=np.int8)
    note = find_window(data, 0)
    assert (note["safe"], note["critical"], note["unknown"], note["failed_runs"]) == (3, 0, 1, 0)
    limits = note["maps"][0]["recommended"]["margins"]["rotary_speed"]
    assert limits["less"]["why"] == "unknown"
    assert find_window(data)["safe"] == 3


def of_three_starts() -> Results:
    data = grid({"same": ["...."]}, [1, 2, 3, 4])
    data.coords["start"] = np.arange(3)
    data.variables = {name: np.repeat(values[..., None], 3, axis=-1) for name, values in data.variables.items()}
    return data


def test_all_starts_of_an_ensemble_must_be_safe():
    data = of_three_starts()
    data["response"][0, 0, 0, 1, 2] = 1
    data["response"][0, 0, 0, 3] = 1
    note = find_window(data)
    assert (note["safe"], note["rim"], note["critical"], note["histories"]) == (2, 1, 1, 3)
    assert note["history_examined"]


def test_a_failed_start_beside_a_safe_and_a_critical_one_is_on_the_rim():
    """Whatever the third would have done: the point depends on the history."""
    data = of_three_starts()
    data["response"][0, 0, 0, 1, 1] = 1
    data["status"][0, 0, 0, 1, 2] = DIVERGED
    note = find_window(data)
    assert (note["safe"], note["rim"], note["unknown"], note["failed_points"]) == (3, 1, 0, 1)


def test_one_axis_has_intervals():
    note = find_window(grid({"up": ["s..w...b"], "down": ["s..w...b"]}, [1, 2, 3, 4, 5, 7, 8, 10]))
    [one] = note["maps"]
    assert note["axes"] == ["rotary_speed"]
    assert [(area["points"], area["rotary_speed"]) for area in one["regions"]] == [(3, [5, 8]), (2, [2, 3])]
    best = one["recommended"]
    assert best["rotary_speed"] == 7.0  # 3 to either side; at 5 it is 1, at 8 it is 2
    assert best["margin"] == pytest.approx(3 / 9)
    assert [best["margins"]["rotary_speed"][side]["margin"] for side in ("less", "more")] == [2.0, 1.0]


def test_nothing_safe_gives_no_recommendation():
    note = find_window(grid({"up": ["sssw"], "down": ["sss."]}, [1, 2, 3, 4]))
    assert (note["safe"], note["rim"]) == (0, 1)
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


def test_what_is_safe_at_every_depth():
    note = stack([".w.", "..."], ["...", "w.."], ["..b", "..."])
    every = note["throughout"]
    assert (every["safe"], every["points"]) == (3, 6)
    # One of the three points failed at a depth where the others are safe, one where
    # another depth is critical.
    failed = stack([".w.", "..."], ["...", "w.x"], [".xb", "..."])["throughout"]
    assert (failed["safe"], failed["critical"], failed["unknown"]) == (2, 3, 1)
    assert every["recommended"]["rotary_speed"] in (1.0, 2.0, 3.0)
    limits = [side for axis in every["recommended"]["margins"].values() for side in axis.values()]
    assert {word for side in limits for word in side["responses"]} <= {"whirl", "bit_bounce"}


def test_depth_across_weight_and_depth_across_speed():
    data = grid({"up": [["..w"], ["..."], ["sss"]], "down": [["..w"], ["..w"], ["sss"]]}, [1, 2, 3], [20e3], DEPTHS[:3])
    note = find_window(data)
    assert note["axes"] == ["rotary_speed", "depth"]
    assert (note["safe"], note["rim"]) == (4, 1)
    assert note["maps"][0]["regions"][0] == {"points": 4, "share": 4 / 9, "rotary_speed": [1, 2], "depth": [1000, 2000]}
    assert note["depth"]["closes"] == 3000
    weights = grid({"same": [[".", "w"], ["w", "w"]]}, [3.0], [10e3, 20e3], DEPTHS[:2])
    note = find_window(weights)
    assert note["axes"] == ["wob", "depth"]
    assert note["maps"][0]["recommended"]["depth"] == 1000


def test_a_single_point_has_no_window():
    with pytest.raises(InputError, match="at least one axis"):
        find_window(grid({"same": ["."]}, [3.0]))


# -- the plane


def test_regions_touch_along_the_axes_only():
    safe = np.array([[1, 1, 0, 0], [1, 0, 1, 0], [0, 0, 1, 1]], dtype=bool)
    assert regions(safe) == [(3, (0, 1, 0, 1)), (3, (1, 2, 2, 3))]
    assert regions(np.zeros((2, 2), dtype=bool)) == []


def test_the_middle_of_a_map_that_is_safe_all_over():
    assert largest_margin(np.ones((5, 9), dtype=bool), np.arange(5.0), np.arange(9.0)) == (2, 4, 0.5)


def test_the_largest_disc_on_unequal_steps():
    """The only bad point is at the left end of a line 0, 1, 2, 4, 10: halfway to the
    right end is 5, nearest 4."""
    safe = np.array([[False, True, True, True, True]])
    assert largest_margin(safe, np.zeros(1), np.array([0.0, 1.0, 2.0, 4.0, 10.0])) == (0, 3, pytest.approx(0.4))


def test_a_point_with_safe_neighbours_comes_first():
    """The steps of the weight are coarse: from the third row the unsafe one above is a
    third of the range away, though it is the next."""
    safe = np.array([[True] * 9, [False] * 3 + [True] * 3 + [False] * 3, [True] * 9, [False] * 9])
    assert largest_margin(safe, np.arange(4.0), np.arange(9.0)) == (1, 4, 0.25)
    alone = np.array([[False, True, False]])
    assert largest_margin(alone, np.zeros(1), np.arange(3.0))[:2] == (0, 1)


def test_by_brute_force():
    rng = np.random.default_rng(5)
    for _ in range(20):
        y, x = np.cumsum(rng.uniform(0.1, 1.0, 7)), np.cumsum(rng.uniform(0.1, 1.0, 9))
        safe = rng.random((7, 9)) < 0.8
        up, across = normalised(y), normalised(x)
        best, is_best_with_room = 0.0, False
        for row, column in np.argwhere(safe):
            cross = safe[max(row - 1, 0) : row + 2, column], safe[row, max(column - 1, 0) : column + 2]
            with_room = all(part.size == 3 and part.all() for part in cross)
            if is_best_with_room and not with_room:
                continue
            if with_room and not is_best_with_room:
                best, is_best_with_room = 0.0, True
            edge = min(up[row], 1 - up[row], across[column], 1 - across[column])
            bad = [np.hypot(up[r] - up[row], across[c] - across[column]) for r, c in np.argwhere(~safe)]
            best = max(best, min([edge, *bad]))
        found = largest_margin(safe, y, x)
        assert safe[found[0], found[1]]
        assert found[2] == pytest.approx(best, rel=1e-12)


# -- files


def test_from_a_file(shared):
    note = nsdrill.window(shared / "small.h5")
    assert note["procedures"] == ["up", "down"]
    assert note["safe"] + note["rim"] + note["critical"] == note["points"] == 8
    assert json.loads(json.dumps(note, allow_nan=False)) == note
    assert nsdrill.window(shared / "small.h5", severity=4)["safe"] == 8
    assert nsdrill.window(shared / "failing.h5")["failed_runs"] > 0
    with pytest.raises(InputError, match="0 to 4"):
        nsdrill.window(shared / "small.h5", severity=5)
    with pytest.raises(FileError, match="no such file"):
        nsdrill.window(shared / "nowhere.h5")


def test_what_the_points_yield_is_told():
    """The fastest safe point is the third speed of the third weight among those that
    are safe in both."""
    results = grid({"up": [UP], "down": [DOWN]}, SPEEDS, WEIGHTS)
    rate = np.broadcast_to(WEIGHTS[:, None] * SPEEDS, results.shape)
    rate = rate * np.array([0.5, 1.5])[:, None, None, None]  # the mean of both histories is told
    results.variables["rate_of_penetration"] = rate
    [one] = find_window(results)["maps"]
    assert one["recommended"]["rate_of_penetration"] == 3.0 * 30e3
    safe = {(w, s) for i, w in enumerate(WEIGHTS) for j, s in enumerate(SPEEDS) if UP[i][j] == DOWN[i][j] == "."}
    weight, speed = max(safe, key=lambda at: at[0] * at[1])
    assert one["fastest"] == {"rotary_speed": speed, "wob": weight, "rate_of_penetration": weight * speed}
    assert find_window(grid({"up": [UP]}, SPEEDS, WEIGHTS))["maps"][0]["fastest"] is None


def said(results: Results, confidence: float | None = None) -> tuple[str, str]:
    """The answer and the warnings of a window."""
    note = {**find_window(results, confidence=confidence)}
    return answer(note, "si"), "\n".join(warnings(note, "si"))


def test_only_a_point_with_room_that_settled_is_an_order():
    """No room, a motion that was changing, a sweep that begins above a critical speed:
    each makes the best point a hint."""
    speeds, weights = [1.0, 2.0, 3.0, 4.0, 5.0], [1e3, 2e3, 3e3]
    roomy = ["s...w", "s...w", "s...w"]
    firm = grid({"up": [roomy], "down": [roomy]}, speeds, weights)
    assert said(firm)[0].startswith("Run at 2 kN and 3 rad/s")
    tight = grid({"up": [["sss.w"] * 3], "down": [["sss.w"] * 3]}, speeds, weights)
    unsettled = grid({"up": [roomy], "down": [roomy]}, speeds, weights)
    unsettled.variables["settled"] = np.ones(unsettled["status"].shape, dtype=np.int8)
    unsettled["settled"][0, 0, 1, 2] = 0
    above = grid({"up": [roomy], "down": [roomy]}, speeds, weights)
    above.attrs["lasting_motions"] = json_text([{**WALL, "from": 1.0, "everywhere": True}])
    each = grid({"up": [roomy], "down": [roomy]}, speeds, weights)
    each.attrs["lasting_motions"] = json_text([{**WALL, "from": 5.0, "everywhere": True, "each": True}])
    for results, word in (
        (tight, "NO MARGIN"),
        (unsettled, "NOT SETTLED"),
        (above, "THE SWEEP BEGINS at 1 rad/s (9.55 rpm), above it, 0.5 to 0.7 rad/s (4.77 to 6.68 rpm). A string"),
        (each, "EACH SPEED IS SWEPT BY ITSELF, up to 5 rad/s (47.7 rpm), above it, 0.5 to 0.7 rad/s"),
    ):
        text, warned = said(results)
        assert text.startswith("No setting can be recommended; the best hint is 2 kN and ")
        assert word in warned


def test_steps_that_may_jump_across_a_critical_speed_are_told():
    """The best point is then a hint; nothing is said of it where no point is safe."""
    speeds, weights = [0.4, 2.0, 3.0, 4.0, 5.0], [1e3, 2e3, 3e3]
    jumped = {"from": 0.5, "to": 0.9, "step": 1.6, "enough": 0.2}
    told = (
        "STEPS OF 1.6 rad/s (15.3 rpm) MAY JUMP across it, anywhere from 0.5 to 0.9 rad/s (4.77 to 8.59 rpm): a point "
        "that is safe here need not be safe with finer steps. There steps of 0.2 rad/s (1.91 rpm) are fine enough."
    )
    for line, is_told in (("s...w", True), ("sssww", False)):
        results = grid({"up": [[line] * 3], "down": [[line] * 3]}, speeds, weights)
        results.attrs["lasting_motions"] = json_text([{**WALL, "jumped": jumped}])
        text, warned = said(results)
        assert (told in warned) == is_told
        assert text.startswith("No setting can be recommended; the best hint" if is_told else "No safe point")


def test_a_point_at_which_another_motion_may_last_is_safe_on_a_condition():
    """From 0.6 to 0.8 rad/s on, at any higher speed, whatever sets it going. The neighbours of
    one sweep may come to it, so its best point is a hint; a point below has no such
    warning, nor has one of a sweep that passes over the speed at which it begins."""
    speeds, weights, line = [0.4, 2.0, 3.0, 4.0, 5.0], [1e3, 2e3, 3e3], "s...w"
    condition = (
        "IT MAY LAST above 0.6 to 0.8 rad/s (5.73 to 7.64 rpm): the best point is safe only while it is fair. Many"
    )
    for maps, first in (
        (([line] * 3), "Run at 2 kN"),
        ([line], "No setting can be recommended; the best hint is 3 rad/s"),
    ):
        results = grid({"up": [maps], "down": [maps]}, speeds, weights[: len(maps)])
        assert "MAY LAST" not in said(results)[1]
        results.attrs["lasting_motions"] = json_text([WALL])
        text, warned = said(results)
        assert text.startswith(first)
        assert condition in warned
        for other in ({"lasts": [3.0, 3.5]}, {"lasts": None}, {"from": 0.4, "everywhere": True}):
            results.attrs["lasting_motions"] = json_text([{**WALL, **other}])
            assert "MAY LAST" not in said(results)[1]
        results.attrs["lasting_motions"] = json_text([{**WALL, "lasts": None}])
        assert find_window(results)["passed_over"] == []


def test_without_a_safe_point_the_warnings_are_of_all_points():
    """Three points of six are not settled, two are safe one way."""
    results = grid({"up": [["ss.", "sss"]], "down": [["sss", ".ss"]]}, [1.0, 2.0, 3.0], [1e3, 2e3])
    results.variables["settled"] = np.ones(results["status"].shape, dtype=np.int8)
    results["settled"][0, 0, 0, :] = 0
    text, warned = said(results)
    assert text.startswith("No safe point")
    assert "NOT SETTLED: at 3 of 6 points a motion" in warned
    assert "HISTORY DECIDES at 2 points (33.3 %)" in warned
    assert "THE MAP ENDS: only 1 to 2 kN and 1 to 3 rad/s (9.55 to 28.6 rpm) was examined" in warned


def test_where_the_bit_stalls_is_said():
    """Above the third weight at every speed, and below the second speed; coming down the
    bit stays stalled a step longer."""
    up, down = ["t....", "t....", "t....", "ttttt"], ["t....", "t....", "ttttt", "ttttt"]
    data = grid({"up": [up], "down": [up]}, SPEEDS[:5], WEIGHTS[:4])
    said = answer(find_window(data), "si")
    assert "below the bit stalls" in said
    assert said.endswith("; from 40 kN the bit stalls.")
    assert "from 8.992 klbf the bit stalls." in answer(find_window(data), "field")
    data = grid({"up": [up], "down": [down]}, SPEEDS[:5], WEIGHTS[:4])
    data.attrs["study_resolved"] = json.dumps({"sweep": {"along": "wob"}})
    found = find_window(data)
    assert answer(found, "si").endswith("; from 30 kN the bit may stall.")
    text = "\n".join(lines(found, "si"))
    assert "Coming down the bit is stalled already and stays so" in text
    assert "no severity makes" not in text, "some points are safe"


def test_where_everything_stalls_no_severity_is_advised():
    data = grid({"same": ["tttt"]}, SPEEDS[:4])
    text = "\n".join(lines(find_window(data), "si"))
    assert "stalled at 4" in text
    assert "no severity makes a run safe" in text
    assert "--severity" not in text
