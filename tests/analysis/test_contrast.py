"""Two windows against each other, in maps in which gains, losses and moves can be counted
by eye."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from figures.test_wording import made

from nsdrill.analysis.contrast import contrast
from nsdrill.app.answering.answers import contrast as app_contrast
from nsdrill.app.answering.answers import plain_contrast
from nsdrill.errors import InputError
from nsdrill.figures.panels import severity_bounds
from nsdrill.models.responses import StickSlip, Thresholds
from nsdrill.text.contrast_text import border_rows, notes, onset_rows, sentence, side_by_side, thresholds
from nsdrill.words.answer import headlines, warnings

from .grids import grid

SPEEDS, WEIGHTS = np.arange(1.0, 7.0), np.array([10e3, 20e3])
# Two weights, the lowest first: with b the bit sticks less, and whirls earlier at the upper.
A = ["ss..ww", "sss..w"]
B = ["s...ww", "s..www"]


@pytest.fixture
def found():
    return contrast(grid({"up": [A]}, SPEEDS, WEIGHTS), grid({"up": [B]}, SPEEDS, WEIGHTS))


def test_points_are_gained_and_lost(found):
    """Gained: the second speed of the lower weight, the second and third of the upper;
    lost: the fourth and fifth of the upper one."""
    assert (found["points"], found["both"]) == (12, 2)
    assert (found["gained"], found["lost"]) == (1 + 2, 2)


def test_responses_are_counted_in_both(found):
    """At 5 points a sticks and b at 2; a whirls at 3 and b at 5."""
    assert {name: (pair["a"], pair["b"]) for name, pair in found["responses"].items()} == {
        "bit_bounce": (0, 0),
        "stick_slip": (5, 2),
        "whirl": (3, 5),
        "stalled": (0, 0),
    }


def test_what_the_second_changes_is_said_where_no_point_is_safe():
    found = app_contrast(*(grid({"up": [line]}, SPEEDS) for line in ("ssswww", "sswwww")), names=["a.h5", "b.h5"])
    assert sentence(found, "si") == (
        "Neither b.h5 (b) nor a.h5 (a) makes any of 6 common points safe; "
        "whirl at 4 points instead of 3, stick-slip at 2 points instead of 3."
    )


def test_a_response_that_does_not_change_is_named_as_the_reason():
    """Whirl at every point of both is why none is safe."""
    found = app_contrast(*(grid({"up": [line]}, SPEEDS) for line in ("wwwwww", "wwwwbb")), names=["a.h5", "b.h5"])
    found["responses"]["whirl"] = {"a": 6, "b": 6}
    assert "; whirl at all 6 points with both, bit-bounce at 2 points instead of 0." in sentence(found, "si")


def test_a_table_has_no_row_that_neither_has():
    found = app_contrast(*(grid({"up": [line]}, SPEEDS) for line in ("ssswww", "sswwww")))
    assert side_by_side(found, "si")[1:] == [
        ("safe points", "0 of 6 (0.0 %)", "0 of 6 (0.0 %)"),
        ("stick-slip", "3 of 6 (50.0 %)", "2 of 6 (33.3 %)"),
        ("whirl", "3 of 6 (50.0 %)", "4 of 6 (66.7 %)"),
    ]


def test_what_a_severity_allows_is_said_in_the_sentence():
    data = [grid({"up": [line]}, SPEEDS) for line in (".....s", "....ss")]
    for one in data:
        for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
            one.variables[name] = np.where(one["response"] > 0, 4, 3).astype(np.int8)
    found = app_contrast(*data, severity=3)
    assert "Of 6 common points 4 are safe (vibration up to strong allowed) with b, " in sentence(found, "si")
    none = sentence(app_contrast(*data, severity=2), "si")
    assert " makes any of 6 common points safe (vibration up to moderate allowed); " in none
    assert "common points safe (no vibration allowed)" in sentence(app_contrast(*data, severity=0), "si")


def test_two_that_differ_in_their_sweep_alone_are_said_to_be_the_same_string():
    finer = ["".join(2 * sign for sign in line)[:11] for line in B]
    a, b = grid({"up": [A]}, SPEEDS, WEIGHTS), grid({"up": [finer]}, np.linspace(1.0, 6.0, 11), WEIGHTS)
    for one, points in ((a, 6), (b, 11)):
        axis = {"rotary_speed": {"from": 1.0, "to": 6.0, "points": points}}
        one.attrs["study_resolved"] = json.dumps({"sweep": axis, "title": f"{points}"})
    assert next(notes(app_contrast(a, b), "si")).startswith("ONLY THE SWEEP DIFFERS: a and b are the same string.")
    b.attrs["study_resolved"] = json.dumps({"sweep": axis, "drive": {"kind": "ideal"}})
    assert not any("ONLY THE SWEEP" in note for note in notes(app_contrast(a, b), "si"))


def test_every_border_says_how_far_it_moved_and_what_lies_beyond(found):
    low, *upper = found["borders"]
    assert low["at"] == {"wob": 10e3}
    assert low["lower"] == {
        "a": 3.0,
        "b": 2.0,
        "moved": -1.0,
        "at_least": False,
        "responses_a": ["stick_slip"],
        "responses_b": ["stick_slip"],
        "why_a": "critical",
        "why_b": "critical",
    }
    assert (low["upper"]["moved"], low["upper"]["responses_b"]) == (0.0, ["whirl"])
    # at the upper weight the intervals 4 to 5 and 2 to 3 do not meet: one lost, one gained
    assert [(row["lower"]["a"], row["lower"]["b"]) for row in upper] == [(4.0, None), (None, 2.0)]
    assert all(row["upper"]["moved"] is None for row in upper)


@pytest.mark.parametrize(
    ("a", "b", "moves"),
    [
        # what makes the other unsafe there, not what lies beyond: whirl, where a ends in stick-slip
        ("ss..bb", "wwwwww", [("lost (whirl in b)",) * 2]),
        ("wwwwBb", "s...ss", [("gained (whirl in a)",) * 2]),
        ("......", "xxwwss", [("not known (a run failed in b)",) * 2]),  # nothing was carried on
        # one interval that becomes two, and two that become one
        (
            "......",
            "..ww..",
            [
                ("no border (edge of the map)", "-4 rad/s (38.2 rpm) or more (edge of the map, now whirl)"),
                ("+4 rad/s (38.2 rpm) or more (edge of the map, now whirl)", "no border (edge of the map)"),
            ],
        ),
        (
            "..ww..",
            "......",
            [
                ("no border (edge of the map)", "+4 rad/s (38.2 rpm) or more (whirl, now edge of the map)"),
                ("-4 rad/s (38.2 rpm) or more (whirl, now edge of the map)", "no border (edge of the map)"),
            ],
        ),
        # what lies beyond runs that failed is not known: no border is known to have moved
        ("s...xx", "s..xxx", [("same (stick-slip)", "not known (a run failed)")]),
    ],
)
def test_the_end_of_a_safe_interval_names_its_cause(a, b, moves):
    found = contrast(grid({"up": [a]}, SPEEDS), grid({"up": [b]}, SPEEDS))
    assert [row[3:] for row in border_rows(found, "si")] == moves


def test_beyond_the_map_of_the_other_nothing_is_known_of_an_interval():
    a, b = grid({"up": ["...www"]}, SPEEDS), grid({"up": ["......"]}, SPEEDS + 10.0)
    (lost, gained) = border_rows(contrast(a, b), "si")
    assert lost[3:] == ("lost (edge of the map in b)",) * 2
    assert gained[3:] == ("gained (edge of the map in a)",) * 2


@pytest.mark.parametrize(
    ("beyond", "moves"),
    [
        # the sweep of b ends where a is still free, and begins where a sticks
        (("s....", "....", 0, 1), ("not known (stick-slip, now edge of the map)", "no border (edge of the map)")),
        (("s....", "...", 0, 2), ("not known (stick-slip, now edge of the map)", "no border (edge of the map)")),
        # its border lies beyond the sweep of a, or within it
        (("s....", "s.....w", 0, 0), ("same (stick-slip)", "not known (edge of the map, now whirl)")),
        (("s....", "s..ww", 0, 0), ("same (stick-slip)", "-2 rad/s (19.1 rpm) or more (edge of the map, now whirl)")),
    ],
)
def test_the_end_of_a_sweep_is_no_border(beyond, moves):
    (a, b, start_a, start_b), row = beyond, np.arange(1.0, 12.0)
    data = [grid({"up": [line]}, row[start:][: len(line)]) for line, start in ((a, start_a), (b, start_b))]
    found = contrast(*data)
    assert border_rows(found, "si")[0][3:] == moves
    assert "upper borders" not in sentence(app_contrast(*data), "si")
    assert "lower borders" not in sentence(app_contrast(*data), "si")


def test_ranges_that_differ_are_no_steps_that_differ():
    """The same string over the same speeds, of which b has fewer: nothing is lost by the size of steps."""
    data = [grid({"up": [line]}, SPEEDS[: len(line)]) for line in ("s.....", "s...")]
    for one in data:
        axis = {"rotary_speed": {"from": 1.0, "to": one.coords["rotary_speed"][-1], "points": 6}}
        one.attrs["study_resolved"] = json.dumps({"sweep": axis})
    found = app_contrast(*data)
    assert found["same_steps"]
    told = next(note for note in notes(found, "si") if note.startswith("ONLY THE SWEEP DIFFERS"))
    assert "steps" not in told
    assert "agree where both were run. The end of a sweep is no border." in told
    data[1]["response"][..., 1] = data[0]["response"][..., 0]
    told = next(note for note in notes(app_contrast(*data), "si") if note.startswith("ONLY THE SWEEP DIFFERS"))
    assert "comes from where a sweep begins" in told


def test_onsets_are_where_a_response_occurs(found):
    spans = {(row["at"]["wob"], row["response"]): (row["a"], row["b"]) for row in found["onsets"]}
    assert spans == {
        (10e3, "stick_slip"): ([[1.0, 2.0]], [[1.0, 1.0]]),
        (10e3, "whirl"): ([[5.0, 6.0]], [[5.0, 6.0]]),
        (20e3, "stick_slip"): ([[1.0, 3.0]], [[1.0, 1.0]]),
        (20e3, "whirl"): ([[6.0, 6.0]], [[4.0, 6.0]]),
    }


def test_gaps_between_onsets_are_told():
    """Where a response does not occur between its first and its last value."""
    speeds = np.arange(1.0, 10.0)
    lines = ("b.w..bb..", "b.b.b.b.b")
    found = contrast(*(grid({"up": [line]}, speeds) for line in lines))
    assert onset_rows(found, "field") == [
        ("", "coming up", "bit-bounce", "9.5, 57.3 to 66.8 rpm", "5 intervals from 9.5 to 85.9 rpm"),
        ("", "coming up", "whirl", "28.6 rpm", "none"),
    ]


def test_the_rate_is_compared_at_the_best_point_and_where_both_are_safe():
    a, b = (grid({"up": [lines]}, SPEEDS, WEIGHTS) for lines in (A, B))
    for data, factor in ((a, 1.0), (b, 2.0)):
        rate = np.broadcast_to(factor * SPEEDS, data["status"].shape).copy()
        data.variables["rate_of_penetration"] = rate
    found = contrast(a, b)["rate"]
    best = [contrast(a, b)["windows"][side]["maps"][0]["recommended"] for side in (0, 1)]
    assert found["recommended"] == {"a": best[0]["rotary_speed"], "b": 2 * best[1]["rotary_speed"]}
    assert found["fastest"] == {"a": 5.0, "b": 2 * 4.0}
    assert found["both_safe"] == {"a": 3.5, "b": 7.0}  # the third and fourth of the lower weight


def test_axes_that_differ_in_their_values_meet_where_they_can():
    coarse = grid({"up": [[line[::2] for line in B]]}, SPEEDS[::2], WEIGHTS)
    found = contrast(grid({"up": [A]}, SPEEDS, WEIGHTS), coarse)
    assert found["points"] == 6
    none = contrast(grid({"up": [A]}, SPEEDS, WEIGHTS), grid({"up": [B]}, SPEEDS + 0.5, WEIGHTS))
    assert (none["points"], none["gained"], none["lost"]) == (0, 0, 0)


def test_other_axes_are_refused():
    with pytest.raises(InputError, match="the same axes"):
        contrast(grid({"up": [A]}, SPEEDS, WEIGHTS), grid({"up": [A[0]]}, SPEEDS))


def test_maps_with_other_ends_say_so_beside_their_rates():
    """The fastest point of the shorter sweep is its end."""
    maps = [grid({"up": [lines]}, SPEEDS[:size], WEIGHTS) for lines, size in ((A, 6), ([line[:4] for line in A], 4))]
    for data in maps:
        data.variables["rate_of_penetration"] = np.ones(data["status"].shape)
    ends = "1 to 6 rad/s (9.55 to 57.3 rpm) in a and 1 to 4 rad/s (9.55 to 38.2 rpm) in b"
    assert f"the maps have other ends ({ends})" in sentence(app_contrast(*maps), "si")
    assert "other ends" not in sentence(app_contrast(maps[0], maps[0]), "si")


def test_it_is_plain_data(found):
    json.dumps(plain_contrast(found, "si"), allow_nan=False)


def test_a_comparison_says_what_is_lost_and_names_the_two():
    """With b the lower weight is gained and the fastest point, of the upper one, is lost."""
    data = []
    for kind, drawing in (("ideal", ["sssww", "s...w"]), ("soft_torque", ["s...w", "sssww"])):
        one = grid({"up": [drawing], "down": [drawing]}, SPEEDS[:5], WEIGHTS)
        rate = np.broadcast_to(WEIGHTS[:, None] * 1e-7, one["status"].shape[2:])
        one.variables["rate_of_penetration"] = np.broadcast_to(rate, one["status"].shape).copy()
        one.attrs["study_resolved"] = json.dumps({"drive": {"kind": kind}, "title": kind})
        data.append(one)
    text = sentence(app_contrast(*data), "si")
    assert text.startswith(
        "With the soft torque drive (b) no setting can be recommended (best hint 10 kN and 3 rad/s (28.6 rpm)); with "
        "the ideal drive (a) no setting can be recommended (best hint 20 kN and 3 rad/s (28.6 rpm)). Of 10 common "
        "points 3 are safe with b, 3 with a: 3 gained, 3 lost; "
    )
    assert "at the best point 3.6 m/h instead of 7.2 m/h (-50.0 %), at the fastest safe point 3.6" in text
    data[1].attrs["study_resolved"] = json.dumps({"drive": {"kind": "ideal"}, "mud": {"swirl": 1}})
    assert "at the best point 3.6 m/h in both" in sentence(app_contrast(data[1], data[1]), "si")
    found = app_contrast(*data, names=["one.h5", "two.h5"])
    assert sentence(found, "si").startswith("With two.h5 (b) no setting")
    assert "; with one.h5 (a) no setting" in sentence(found, "si")
    roomy = [grid({"up": [line], "down": [line]}, SPEEDS, [1e4, 2e4, 3e4]) for line in (["s...ww"] * 3, ["ssssww"] * 3)]
    text = sentence(app_contrast(*roomy), "si")
    assert " borders " not in text  # there is none in both
    moved = [grid({"up": [[line, "......"]]}, SPEEDS, [1e4, 2e4]) for line in ("s....w", "ss...w")]
    text_of_moved = sentence(app_contrast(*moved), "si")
    assert "; lower borders in both lie 1 rad/s (9.55 rpm) higher; " in text_of_moved  # the other line has none
    one = [grid({"up": [line]}, SPEEDS) for line in ("s....w", "ss...w")]
    assert "; lower borders in both lie 1 rad/s (9.55 rpm) higher; " in sentence(app_contrast(*one), "si")
    assert text.startswith(
        "With b no point is safe; with a run at 20 kN and 3 rad/s (28.6 rpm). Of 18 common points 0 "
    )
    assert ("best point", "20 kN, 3 rad/s (28.6 rpm)", "10 kN, 3 rad/s (28.6 rpm)") in side_by_side(found, "si")
    assert thresholds(found).startswith("bit-bounce: off the rock for more than 1 % of the time")


def relabelled(index: float, **more: float):
    """A made-up sweep whose labels count stick-slip from another ``index`` [percent]."""
    data = grid({"up": [A]}, SPEEDS, WEIGHTS)
    moved = replace(Thresholds(), stick_slip=StickSlip(stick_slip_index=index, **more))
    data.attrs["classification_resolved"] = json.dumps(asdict(moved))
    data.attrs["study_resolved"] = json.dumps({"classify": asdict(Thresholds())})
    return data


def test_thresholds_of_a_relabelled_file_are_those_in_force():
    """Labels made again count by the new threshold, whatever the study of the file says."""
    found = app_contrast(relabelled(80.0), relabelled(1000.0), names=["a.h5", "b.h5"])
    told = thresholds(found)
    assert "in a " in told
    assert "stick-slip: index above 1000 %" in told.partition("in b ")[2]
    row = {"key": "classify.stick_slip.stick_slip_index", "a": "80", "b": "1000"}
    assert [{name: str(one[name]) for name in one} for one in found["study"]] == [row]
    assert any(note.startswith("OTHER THRESHOLDS") for note in notes(found, "si"))


@pytest.mark.parametrize(
    "other",
    [
        {"whirl": {"direction": 0.2}},
        {"whirl": 0.5},
        {"whirl": {"direction": {"of": 0.2}}},
        {"stick_slip": {"stick_slip_index": 80.0, "of_another_version": 1.0}},
        {"stick_slip": {"severe_index": -1.0}},
    ],
)
def test_thresholds_of_another_version_are_compared_by_those_that_are_known(other):
    data = relabelled(80.0)
    data.attrs["classification_resolved"] = json.dumps(other)
    assert "stick-slip: index above 80 %" in app_contrast(data, relabelled(80.0))["thresholds"][0]
    assert severity_bounds(data.attrs, "lateral_acceleration_rms") == severity_bounds({}, "lateral_acceleration_rms")


def test_a_threshold_that_is_not_the_default_is_said_first():
    """An answer counts by it: the text, the picture and the page have it from the warnings."""
    found = app_contrast(relabelled(80.0), relabelled(1000.0, severe_index=900.0), names=["a.h5", "b.h5"])
    usual, moved = found["windows"]
    assert not usual["moved_thresholds"]
    first = next(warnings(moved, "si"))
    assert first.startswith("STICK-SLIP COUNTS ABOVE 1000 % ONLY: by default stick-slip index above 80 %.")
    assert "classify.stick_slip.severe_index = 900 (by default 100)" in first
    assert headlines(moved, "si")[0] == "STICK-SLIP COUNTS ABOVE 1000 % ONLY"
    lower = app_contrast(relabelled(8.0), relabelled(80.0), names=["a", "b"])["windows"][0]
    assert headlines(lower, "si")[0] == "STICK-SLIP COUNTS ABOVE 8 % ALREADY"


def test_a_comparison_says_that_no_way_in_was_tried():
    """The setting of a is free from below, and its start there whirls."""
    free, whirls = ["s......"] * 5, ["swwwwww"] * 5
    a, b = made(up=free, down=free, same=whirls), made(up=free, down=free, same=free)
    told = next(text for text in notes(app_contrast(a, b), "si") if "NO WAY IN WAS TRIED" in text)
    assert "Started at its setting, a vibrates." in told
    assert "--trials" in told
