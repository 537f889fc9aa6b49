"""Up to which speed stick-slip lasts, and what that leaves of a sweep: made-up results, and
sweeps of the torsional model in coarse and fine steps."""

import json
from dataclasses import replace

import numpy as np
import pytest

import nsdrill
from analysis.grids import grid, told
from nsdrill.analysis.advice import Kind
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import results_for_window
from nsdrill.app.answering.summary import summarize
from nsdrill.data import STICKS_TO, Results
from nsdrill.figures import cut
from nsdrill.models.parts import values_at
from nsdrill.models.registry import checks_of
from nsdrill.models.responses import SEVERITIES
from nsdrill.store import read_results
from nsdrill.study.load import parse_study
from nsdrill.web.explorer_maps import area
from nsdrill.words.answer import MOST_WARNINGS, warnings, words_of

SPEEDS = np.arange(1.0, 7.0)


def grades_of(results: Results) -> list[list[Grade]]:
    return [[Grade(int(one)) for one in row] for row in graded(results).grade[0]]


def test_points_that_are_free_where_the_model_sticks_are_not_allowed():
    weights = (10e3, 20e3)
    one = told(grid({"up": [["s.....", "ss...."]], "down": [["s.....", "ss...."]]}, SPEEDS, weights), [1.5, 4.2])
    light, heavy = grades_of(one)
    assert light[1:] == 5 * [Grade.ANY_HISTORY]
    assert heavy[2:] == [Grade.STICKS_ON, Grade.STICKS_ON, Grade.ANY_HISTORY, Grade.ANY_HISTORY]
    summary = find_window(one)
    assert summary["stick_slip"]["points"] == 2
    (setting,) = summary["stick_slip"]["settings"]
    assert (setting["at"], setting["from"], setting["to"]) == ({"wob": 20e3}, 3.0, 4.0)
    assert setting["lasts_to"] == {"rotary_speed": 4.2, "everywhere": False}
    text = " ".join(warnings(summary, "si"))
    assert "STICK-SLIP MAY LAST at 2 points free in the sweep, as at 20 kN, 3 to 4 rad/s" in text


def test_no_point_is_allowed_below_the_speed_to_which_stick_slip_once_started_lasts():
    """Also where the sweep never met it, as it may begin below the sweep, or in a hard streak;
    brought up, or from a quick start."""
    one = told(grid({"up": ["......"], "down": ["......"]}, SPEEDS), [4.2])
    assert grades_of(one) == [[*4 * [Grade.STICKS_ON], *2 * [Grade.ANY_HISTORY]]]
    text = " ".join(warnings(find_window(one), "si"))
    assert (
        "STICK-SLIP MAY LAST at 4 points free in the sweep, as 1 to 4 rad/s (9.55 to 38.2 rpm): once started it lasts"
        in text
    )
    assert "a step of the sweep" not in text, "it was not met"
    started = told(grid({"up": ["BBBBBB"], "same": ["......"]}, SPEEDS), [4.2])
    assert grades_of(started) == [[*4 * [Grade.STICKS_ON], *2 * [Grade.FROM_START]]]
    found = find_window(started)
    assert found["answer"].stay_within["rotary_speed"].low > 4.2
    assert found["maps"][0]["rows"][0]["safe"] == [[5.0, 6.0]]
    alone = told(grid({"same": ["......"]}, SPEEDS), [4.2])
    assert grades_of(alone) == [[*4 * [Grade.STICKS_ON], *2 * [Grade.FROM_START]]]


def test_no_point_is_allowed_below_the_end_by_dry_friction():
    """Runs with smoothed friction stick to 2.2 rad/s, dry friction to 4.2: what is ordered, what bounds it, and the
    warning say so alike, and a start with the bit at rest that came free shows it of smoothed friction only."""
    ways = {"up": ["ss...."], "down": ["ss...."]}
    one = told(grid(ways, SPEEDS), [4.2], shown_to=[2.2])
    assert grades_of(one)[0][2:] == [*2 * [Grade.STICKS_ON], *2 * [Grade.ANY_HISTORY]]
    found = find_window(one)
    within = found["answer"].stay_within["rotary_speed"]
    assert (within.low, within.below.value, within.below.is_dry) == (5.0, 4.0, True)
    assert found["answer"].point["rotary_speed"] >= 5.0
    (setting,) = found["stick_slip"]["settings"]
    assert (setting["from"], setting["to"], setting["is_dry"]) == (3.0, 4.0, True)
    text = " ".join(warnings(found, "si"))
    assert "lasts to 4.2 rad/s" in text
    assert "by dry friction, and the smoothed friction of the runs shows it to 2.2 rad/s" in text
    assert "a step of the sweep" not in text, "it ended where the friction of the runs ends it"
    lines = " ".join(words_of(found, "si").lines())
    assert "at 4 rad/s (38.2 rpm) stick-slip of dry friction, once started, may last to 4.2 rad/s" in lines
    smoothed = find_window(told(grid(ways, SPEEDS), [4.2]))
    assert "dry" not in " ".join([*warnings(smoothed, "si"), *words_of(smoothed, "si").lines()])
    soon = {"up": ["ss...."], "down": ["s....."], "same": ["s....."]}
    started = told(grid(soon, SPEEDS), [4.2], from_rest=True, shown_to=[2.2])
    # free at 2 rad/s, by smoothed friction: by dry friction at 3.8 rad/s
    assert grades_of(started)[0][2:4] == [Grade.STICKS_ON, Grade.ANY_HISTORY]
    later = told(grid({**ways, "same": ["ss...."]}, SPEEDS), [4.2], from_rest=True, shown_to=[2.2])
    assert grades_of(later)[0][2:5] == [Grade.STICKS_ON, Grade.STICKS_ON, Grade.ANY_HISTORY]


@pytest.mark.parametrize("from_rest", [False, True])
def test_an_end_that_is_known_of_smoothed_friction_alone_is_told(from_rest):
    """Up to it no point is allowed, and above it is not known whether stick-slip lasts, as dry friction may stick on;
    a start with the bit at rest that came free shows it of smoothed friction only."""
    ways = {"up": ["s....."], "down": ["s....."], "same": ["s....."]}
    one = told(grid(ways, SPEEDS), [None], from_rest=from_rest, shown_to=[2.2])
    assert grades_of(one)[0][1] == Grade.STICKS_ON
    found = find_window(one)
    assert (found["stick_slip"]["by_smoothed"], found["stick_slip"]["untried"]) == (True, True)
    assert "TO WHICH SPEED STICK-SLIP LASTS is not known by dry friction" in " ".join(warnings(found, "si"))


def test_of_samples_no_point_is_free_when_started_there_only_where_nothing_was_started():
    """Of two of three samples steady drilling is free where stick-slip may last, and one bounces: no run was
    started at a point, so that nothing is free from such a start."""
    drawings = [grid({"up": [line], "down": [line]}, SPEEDS) for line in ("......", "......", "BBBBBB")]
    variables = {name: np.stack([one[name] for one in drawings], axis=-1) for name in drawings[0].variables}
    coords = {**drawings[0].coords, "sample": np.arange(3, dtype=np.int32)}
    found = find_window(told(Results(coords, variables, {}), [4.2]))
    assert (found["stick_slip"]["points"], found["stick_slip"]["started"]) == (4, 0)
    text = " ".join(warnings(found, "si"))
    assert "STICK-SLIP MAY LAST at 4 points free in the sweep in some of the samples, as 1 to 4 rad/s" in text
    assert "started there only" not in text
    started = told(grid({"up": ["BBB..."], "same": ["......"], "down": ["......"]}, SPEEDS), [4.2])
    assert find_window(started)["stick_slip"]["started"] == 3


@pytest.mark.parametrize(("line", "points", "sticking"), [("ss....", 4, 2), ("......", 4, 0), ("ssss..", 4, 4)])
def test_with_a_severity_what_sticks_is_not_called_free(line, points, sticking):
    """Stick-slip lasts to 4.2 rad/s; it is moderate where the bit sticks, and the severity allows that."""
    one = told(grid({"up": [line], "down": [line], "same": ["......"]}, SPEEDS), [4.2])
    for name in SEVERITIES:
        one.variables[name] = np.where((one["response"] > 0) & (name == "stick_slip_severity"), 2, 0).astype(np.int8)
    found = find_window(one, severity=2)
    stick_slip = found["stick_slip"]
    assert (stick_slip["points"], stick_slip["sticking"], stick_slip["started"]) == (points, sticking, 0)
    text = next(one for one in warnings(found, "si") if one.startswith("STICK-SLIP MAY LAST"))
    assert ("free in the sweep" in text) == (sticking == 0)
    assert ("which stick there, at a severity of 2 at most" in text) == (sticking > 0)
    assert (f"{sticking} of which" in text) == (0 < sticking < points)


def test_a_start_at_the_point_shows_that_it_lasts_below_too():
    """Without a model: what was started at 4 rad/s sticks, so points up to there may."""
    one = grid({"up": ["s....."], "same": ["...s.."]}, SPEEDS)
    found = grades_of(one)[0]
    assert found[1:] == [*3 * [Grade.STICKS_ON], *2 * [Grade.FROM_BELOW]]
    failed = grid({"up": ["s....."], "same": ["...x.."]}, SPEEDS)
    assert grades_of(failed)[0][3] == Grade.UNKNOWN


def test_what_is_lowered_from_above_is_no_hint_where_stick_slip_may_last():
    one = told(grid({"down": ["ss...."]}, SPEEDS), [4.2])
    assert grades_of(one) == [2 * [Grade.CRITICAL] + 2 * [Grade.STICKS_ON] + 2 * [Grade.ONLY_FROM_ABOVE]]
    summary = find_window(one)
    assert summary["answer"].point["rotary_speed"] >= 5.0
    assert "STICK-SLIP MAY LAST at 2 points" in " ".join(warnings(summary, "si"))


def test_no_point_is_free_when_lowered_to_where_steady_drilling_is_unstable():
    """Stick-slip begins below 3.5 rad/s by itself, and lasts to 5.1; a way down that is free below that had not left
    steady drilling yet."""
    one = told(grid({"up": ["sssss."], "down": ["s....."]}, SPEEDS), [5.1], [3.5])
    assert grades_of(one) == [[*3 * [Grade.CRITICAL], *2 * [Grade.ONLY_FROM_ABOVE], Grade.ANY_HISTORY]]
    unknown = told(grid({"up": ["sssss."], "down": ["s....."]}, SPEEDS), [None], [None])
    assert grades_of(unknown)[0][1:5] == 4 * [Grade.ONLY_FROM_ABOVE]


def test_a_start_that_comes_free_between_two_that_stick_is_near_a_limit():
    found = grades_of(grid({"up": ["sssss."], "same": ["ss.s.."]}, SPEEDS))[0]
    assert found[2:5] == [Grade.BORDERLINE, Grade.CRITICAL, Grade.FROM_START]
    alone = grades_of(grid({"same": ["s.s..."]}, SPEEDS))[0]
    assert alone == [Grade.CRITICAL, Grade.BORDERLINE, Grade.CRITICAL, *3 * [Grade.FROM_START]]


def test_stick_slip_of_a_collar_on_the_wall_says_nothing_of_that_of_torsion():
    one = told(grid({"up": ["s....."], "down": ["s...BB"]}, SPEEDS), [1.5])
    one.variables["response"][one.procedures.index("down"), ..., 4:] = 6  # stick-slip and whirl
    assert grades_of(one)[0][1:4] == 3 * [Grade.ANY_HISTORY]


def test_a_bit_that_is_let_go_at_the_point_and_comes_free_is_evidence_against_the_model():
    one = grid({"up": ["s....."], "same": ["ss...."], "down": ["s....."]}, SPEEDS)
    assert grades_of(told(one, [4.2]))[0][2:4] == 2 * [Grade.STICKS_ON]
    assert grades_of(told(one, [4.2], from_rest=True))[0][2:4] == 2 * [Grade.ANY_HISTORY]


def test_where_steady_drilling_is_unstable_no_point_is_allowed():
    one = told(grid({"same": ["......"]}, SPEEDS), ["every"], ["every"])
    assert not graded(one).allowed.any()
    assert "STEADY DRILLING IS UNSTABLE" in " ".join(warnings(find_window(one), "si"))


def test_without_a_model_a_bit_let_go_at_the_point_tells_of_its_history():
    """Nothing vibrates on any run. Starts with the bit at rest show that a history does not
    matter; others, or none, show nothing of it, and the window says so."""
    quiet = grid({"up": ["......"], "down": ["......"], "same": ["......"]}, SPEEDS)
    for from_rest, grade in ((True, Grade.ANY_HISTORY), (False, Grade.FROM_BELOW)):
        one = told(quiet, [None], [None], from_rest=from_rest)
        assert grades_of(one) == [6 * [grade]]
        summary = find_window(one)
        words = " ".join(warnings(summary, "si"))
        assert ("TO WHICH SPEED STICK-SLIP LASTS is not known" in words) is not from_rest
        assert summary["stick_slip"]["untried"] is not from_rest


@pytest.mark.parametrize("start", ["steady", "rest"])
def test_the_model_of_segments_tells_the_onset_alone_but_its_starts_may_hold_the_bit(start):
    study = f"""
model: segments
operation: {{depth: 300 m, wob: 50 kN}}
sweep: {{rotary_speed: [12 rad/s, 14 rad/s], procedure: all}}
initial: {{start: {start}}}
simulation: {{transient: 5 s, observe: 5 s}}
"""
    found = json.loads(results_for_window(nsdrill.run(study)).attrs[STICKS_TO])
    (onset,) = found.pop("unstable_to")
    assert onset == pytest.approx(nsdrill.check(study).figures["stick_slip_onset"].value)
    assert found == {"over": [], "lasts_to": [None], "shown_to": [None], "from_rest": start == "rest"}


@pytest.mark.parametrize(("model", "lobes"), [("christoforou_yigit", 1), ("christoforou_yigit", 3), ("beam", 1)])
@pytest.mark.parametrize(("height", "rock", "is_told"), [(1e-6, 25e6, True), (1e-6, 1160e6, True), (1e-3, 25e6, False)])
def test_lobes_of_a_micron_leave_stick_slip_as_it_is(model, lobes, height, rock, is_told):
    """No window opens by them: their force is little beside the weight. Higher ones may shake the bit
    loose, and then nothing is told."""
    ends = []
    for amplitude in (0.0, height):
        study = parse_study(
            f"model: {model}\nbit: {{lobes: {lobes}, surface_amplitude: {amplitude} m, rock_stiffness: {rock} N/m}}\n"
            "operation: {depth: 2000 m, wob: 40 kN, rotary_speed: 6 rad/s}"
        )
        point = values_at(study.parameters, study.initial, {"depth": 2000.0, "wob": 40e3, "rotary_speed": 6.0})
        ends += checks_of(study.model).stick_slip_lasts([point])
    assert ends[0] is not None
    assert ends[0][1] > 0.0
    assert ends[1] == (ends[0] if is_told else None)


def test_without_a_model_only_what_was_run_is_claimed():
    one = grid({"up": ["s....."], "down": ["s....."]}, SPEEDS)
    assert "TO WHICH SPEED STICK-SLIP LASTS is not known" in " ".join(warnings(find_window(one), "si"))
    assert find_window(one)["answer"].modelled is False


STUDY = """
model: torsion
operation: {{depth: 5000 m, wob: 66.72 kN}}
sweep: {{rotary_speed: {{from: 5 rad/s, to: 12 rad/s, points: {points}}}, procedure: {procedure}}}
simulation: {{transient: 120 s, observe: 40 s}}
"""


def run(points: int, procedure: str = "up") -> Results:
    return results_for_window(nsdrill.run(STUDY.format(points=points, procedure=procedure)))


@pytest.fixture(scope="module")
def sweeps() -> list[Results]:
    return [run(points) for points in (29, 15, 8, 5)]


def test_no_step_of_the_speed_adds_an_allowed_point_where_stick_slip_lasts(sweeps):
    """Steps of 0.25 to 1.75 rad/s end stick-slip at different speeds, all below 9.69 rad/s, to
    which runs from rest stick for ever, and by dry friction it lasts to 7 % more: below that none is allowed."""
    ends = []
    for one in sweeps:
        maps, found = graded(one), json.loads(one.attrs[STICKS_TO])
        (dry,), (shown,) = found["lasts_to"], found["shown_to"]
        assert shown == pytest.approx(1.02 * 9.69, rel=5e-3)
        assert 1.05 * shown < dry < 1.12 * shown
        assert not maps.allowed[0, 0, one["rotary_speed"] < dry].any()
        assert maps.allowed[0, 0, one["rotary_speed"] > dry].all()
        ends.append(float(one["rotary_speed"][np.flatnonzero(one["response"][0, 0, 0])[-1]]))
    assert len(set(ends)) > 1, "else this shows nothing"
    assert any(np.any(graded(one).grade == Grade.STICKS_ON) for one in sweeps)


SAMPLED = """
model: torsion
uncertain: {{bit.friction.static: {{uniform: [0.35, 0.6]}}, samples: 16}}
operation: {{depth: 5000 m}}
sweep: {{rotary_speed: {{from: 5 rad/s, to: 12 rad/s, points: 5}}, wob: [50 kN, 66.72 kN], procedure: {procedure},
  along: rotary_speed}}
simulation: {{transient: 120 s, observe: 40 s}}
"""


@pytest.mark.parametrize("procedure", ["up", "up-down"])
def test_samples_are_counted_by_the_same_classes_everywhere(procedure, tmp_path):
    """In coarse steps stick-slip ends early in some samples: the probabilities, the sensitivity,
    the table of show, the explorer and the picture know it as the window does."""
    path = str(tmp_path / "u.h5")
    nsdrill.run(SAMPLED.format(procedure=procedure), path, progress=False)
    maps = graded(results_for_window(path), confidence=0.9)
    share = maps.probability()[0][0]
    assert np.any(maps.grades == Grade.STICKS_ON), "else this shows nothing"
    found = nsdrill.probability(path).probability.sel(outcome="safe")
    together = found if procedure == "up" else found.sel(history="every")
    assert together.transpose("wob", "rotary_speed").values == pytest.approx(share)
    for row, column in np.ndindex(share.shape):
        at = {"wob": float(maps.values("wob")[row]), "rotary_speed": float(maps.values("rotary_speed")[column])}
        assert nsdrill.sensitivity(path, at=at)["answers"][0]["mean"] == pytest.approx(share[row, column]), at
    rows = [one for one in summarize(read_results(path))["probabilities"] if one["history"] in ("every", procedure)]
    told = {(one["wob"], one["rotary_speed"]): one["safe"]["probability"] for one in rows}
    assert [told[wob, speed] for wob in maps.values("wob") for speed in maps.values("rotary_speed")] == pytest.approx(
        share.ravel().tolist()
    )
    _, columns = area(read_results(path), "si", "probability", {})
    assert columns["values"][0] == pytest.approx(100.0 * share)
    figure = nsdrill.plot(path, "probability")
    mesh = next(one for axes in figure.axes for one in axes.collections if one.get_gid() == "probability:safe")
    assert np.asarray(mesh.get_array()).ravel() == pytest.approx(100.0 * share.ravel())


def test_the_map_of_the_explorer_is_that_of_the_window(tmp_path):
    path = str(tmp_path / "w.h5")
    nsdrill.run(
        STUDY.format(points=5, procedure="up, along: rotary_speed, wob: [50 kN, 66.72 kN]"), path, progress=False
    )
    maps = graded(results_for_window(path))
    assert np.any(maps.grade == Grade.STICKS_ON), "else this shows nothing"
    _, columns = area(read_results(path), "si", "window", {})
    assert np.array_equal(columns["safe"] > 0, maps.allowed[0])


def test_along_the_weight_the_same_holds():
    """At 6 rad/s stick-slip coexists with drilling from 37 kN on, whether the sweep along the
    weight meets it or not."""
    study = """
model: torsion
operation: {depth: 5000 m, rotary_speed: 6 rad/s}
sweep: {wob: {from: 10 kN, to: 86 kN, points: 5}, procedure: up-down}
simulation: {transient: 120 s, observe: 40 s}
"""
    one = results_for_window(nsdrill.run(study))
    maps = graded(one)
    assert (maps.grade[0, 0] == Grade.ANY_HISTORY).tolist() == [True, True, False, False, False]
    assert (maps.grade[0, 0, 2:] == Grade.STICKS_ON).all()
    assert "after vibration" not in words_of(find_window(one), "si").sentence()


def test_what_runs_alone_show_of_stick_slip_is_no_end_of_it():
    """Without a model the greatest speed at which it lasted in the runs is where the sweep
    looked, and the doubt stands among the first warnings."""
    one = grid({"up": ["s....."], "same": ["ssss.."]}, SPEEDS)
    one.variables["response"][0, ..., 1:4] = 0
    one = replace(one, attrs={**one.attrs, "model": "christoforou_yigit"})
    summary = find_window(one)
    words = words_of(summary, "si")
    border = words.advice.lines["rotary_speed"].below
    assert border.grade == Grade.STICKS_ON
    assert words.beyond("rotary_speed", border).endswith(
        "stick-slip, once started, lasts at least to 4 rad/s (38.2 rpm) in this sweep"
    )
    first = list(warnings(summary, "si"))[:MOST_WARNINGS]
    assert any("TO WHICH SPEED STICK-SLIP LASTS" in text for text in first)


def test_whirl_that_the_sweep_met_below_is_not_called_unmet():
    one = grid({"up": ["ww...."], "down": ["ww...."]}, SPEEDS)
    words = words_of(find_window(one), "si")
    assert words.advice.recover.elsewhere == ("whirl",)
    words.advice = replace(words.advice, recover=replace(words.advice.recover, lasts_above=1.0))
    assert words._way_out().startswith(
        "If it whirls: this sweep met that elsewhere, but no run shows what ends it; pick up"
    )


def test_a_quick_start_that_is_free_from_below_is_not_said_to_vibrate():
    words = words_of(find_window(grid({"up": ["s....."], "same": ["......"]}, SPEEDS)), "si")
    words.advice = replace(words.advice, kind=Kind.QUICK_START, grade=Grade.FROM_BELOW, slowly=())
    assert "vibrates" not in words.sentence()
    assert words.sentence().endswith("; stay at 2 to 6 rad/s (19.1 to 57.3 rpm) at 20 kN.")


@pytest.mark.parametrize("weights", [["20 kN", "60 kN"], ["20 kN"]])
def test_one_sample_keeps_what_the_model_tells_of_it(weights):
    """A picture of it alone is drawn of its own limits; it ended with an error of numpy."""
    text = (
        "model: torsion\nsimulation: {transient: 9 s, observe: 9 s}\n"
        f"sweep: {{rotary_speed: [2 rad/s, 5 rad/s], wob: [{', '.join(weights)}], procedure: up-down, "
        "along: rotary_speed}\n"
        "uncertain: {bit.friction.static: {uniform: [0.3, 0.8]}, samples: 3}\n"
    )
    whole = results_for_window(nsdrill.run(text, progress=False))
    told = json.loads(whole.attrs[STICKS_TO])
    over = ["wob"] if len(weights) > 1 else []
    assert told["over"] == [*over, "sample"]
    part = cut(whole, {"sample": 1})
    there = json.loads(part.attrs[STICKS_TO])
    assert there["over"] == over
    for name in ("unstable_to", "lasts_to"):
        assert there[name] == told[name][1::3] != told[name][::3]
    assert find_window(part)["runs"] == 4 * len(weights)
