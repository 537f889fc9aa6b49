"""Where a sweep ends decides on no point below its end: results that are cut along the axis
along which the state was carried, whose way down is another one, and a study that was
run to three last speeds."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nsdrill
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade, is_allowed
from nsdrill.app.answering.answers import results_for_window
from nsdrill.app.check import lasting_motions
from nsdrill.data import LASTING_UNTOLD, Results, json_text
from nsdrill.models.responses import RESPONSES
from nsdrill.study import parse_study
from nsdrill.variables import DIVERGED, OK, UNMEASURED

from .grids import grid, told
from .test_unknown import NOT_KNOWN, SEVERITIES_ALLOWED, forget, pairs, sweeps

WITHDRAWN = (Grade.BORDERLINE, Grade.STALLED, Grade.UNKNOWN, Grade.STICKS_ON)


def cut(results: Results, last: int, seed: int) -> Results:
    """The same sweep to a lower end, ``last`` speeds: the way up is the same, and the way down
    from there is any."""
    variables = {
        name: values[:, :, :, :last].copy() for name, values in results.variables.items()
    }  # [procedure, depth, wob, speed, ...]
    coords = {**results.coords, "rotary_speed": results.coords["rotary_speed"][:last]}
    shorter = replace(results, coords=coords, variables=variables)
    rng, down = np.random.default_rng(seed), results.procedures.index("down")
    for values in variables.values():
        values[down] = rng.permutation(values[down].ravel()).reshape(values[down].shape)
    bits = [0, 0, 0, *(one.bit for one in RESPONSES.values())]
    variables["response"][down] = rng.choice(bits, variables["response"][down].shape)
    variables["status"][down] = OK
    for place in np.argwhere(rng.random(variables["status"][down].shape) < 0.05):
        forget(shorter, (down, *place), DIVERGED)
    return shorter


@settings(max_examples=150)
@given(sweeps(members=(None, "sample"), ways=2), st.integers(0, 2**32 - 1), SEVERITIES_ALLOWED)
def test_the_end_of_a_sweep_changes_no_allowed_point_but_borderline_ones(results, seed, severity):
    rng = np.random.default_rng(seed)
    last = int(rng.integers(1, len(results.coords["rotary_speed"]) + 1))
    if last == 1:  # a single speed is no axis of a map
        return
    whole, shorter = (graded(one, severity) for one in (results, cut(results, last, seed)))
    place = (whole.third, whole.y, whole.x).index("rotary_speed")
    below: Any = tuple(slice(None, last) if axis == place else slice(None) for axis in range(3))
    one, other = whole.grades[below], shorter.grades
    changed = is_allowed(one) != is_allowed(other)
    assert np.isin(np.where(is_allowed(one), other, one)[changed], WITHDRAWN).all()


@settings(max_examples=300)
@given(pairs(members=(None, "sample")), SEVERITIES_ALLOWED)
def test_a_run_that_fails_makes_no_point_safer(pair, severity):
    """Any run, on any way, along either axis, with and without what the model says of
    stick-slip."""
    before, after = (graded(one, severity).grades for one in pair)
    assert not np.any(is_allowed(after) & (after > before))


def test_a_run_that_is_not_known_may_have_stuck():
    """Stick-slip lasts to 4.2 by the model. The first run ended well, but its answer is not
    known: it may have stuck, and a step may have ended it. So may a run on the way down,
    where each speed is a chain of its own."""
    one = told(grid({"up": ["s....."]}, np.arange(1.0, 7.0)), [4.2])
    forget(one, (0, 0, 0, 0), UNMEASURED)
    assert not is_allowed(graded(one).grade[0, 0, :4]).any()
    along = json_text({"sweep": {"along": "wob"}})
    for sign in "sx":
        heavy = grid({"up": [["sss", "..."]], "down": [["...", f"..{sign}"]]}, [1.0, 2.0, 3.0], (10e3, 20e3))
        swept = replace(heavy, attrs={**heavy.attrs, "study_resolved": along})
        assert not is_allowed(graded(swept).grade[0, 1]).any(), sign


def test_a_way_down_that_is_not_known_may_have_stalled():
    """The start at the point is free, but so it is where the bit stalls on the way down."""
    for sign in "tx":
        one = grid({"up": ["www"], "down": [f"..{sign}"], "same": ["..."]}, [1.0, 2.0, 3.0])
        assert not is_allowed(graded(one).grade[0, 0, 2]), sign


def test_today_and_tomorrow():
    """Coming down from 6 the collar rolls all the way; from 4 it never begins to. The points
    below are allowed either way, and only what is said of a disturbance differs."""
    speeds, up = np.arange(1.0, 7.0), "s...ww"
    longer = graded(grid({"up": [up], "down": ["swwwww"]}, speeds))
    shorter = graded(grid({"up": [up[:4]], "down": ["s..."]}, speeds[:4]))
    assert longer.allowed[..., :4].tolist() == shorter.allowed.tolist()
    assert longer.grade[0, 0, 1] == Grade.FROM_BELOW_ONLY
    assert shorter.grade[0, 0, 1] == Grade.FROM_BELOW, "where no vibration was met nothing is said of histories"


STUDY = """
title: To an end
drillstring:
  collar: {{outer_diameter: 8 in, inner_diameter: 2.8125 in, length: 600 ft, span: 60 ft}}
  pipe: {{outer_diameter: 5 in, inner_diameter: 4.276 in}}
  eccentricity: 2 mm
mud: {{density: 10.5 ppg}}
well: {{diameter: 12.25 in}}
bit: {{lobes: 1}}
operation: {{depth: 9500 ft}}
sweep: {{wob: [15 klbf, 20 klbf], rotary_speed: [{speeds}], procedure: all, along: rotary_speed}}
simulation: {{transient: 15 s, observe: 10 s}}
"""
TORSION = """
model: torsion
operation: {{depth: 9500 ft}}
sweep: {{wob: [10 klbf, 15 klbf], rotary_speed: [{speeds}], procedure: all, along: rotary_speed}}
simulation: {{transient: 60 s, observe: 20 s}}
"""
SPEEDS = (40, 52, 60, 66, 72, 80, 90, 100, 110, 120, 130)


@pytest.fixture(scope="module", params=[STUDY, TORSION], ids=["collar", "torsion"])
def to_three_ends(request: pytest.FixtureRequest) -> list[Any]:
    return [
        nsdrill.run(request.param.format(speeds=", ".join(f"{speed} rpm" for speed in SPEEDS if speed <= end)))
        for end in (90, 110, 130)
    ]


def test_a_study_that_is_run_to_three_ends(to_three_ends):
    """The ways up are the same to the bit; what is allowed below an end is the same but for
    borderline points, and what a shorter sweep recommends is allowed in a longer one."""
    found = [graded(results_for_window(data)) for data in to_three_ends]
    for shorter, longer, short in zip(found, found[1:], to_three_ends, strict=False):
        count = shorter.grade.shape[-1]
        for way in ("up", "same"):
            runs = [one.labels[one.ways.index(way)][..., :count, :] for one in (shorter, longer)]
            assert np.array_equal(*runs)
        changed = shorter.allowed != longer.allowed[..., :count]
        both = np.where(shorter.allowed, longer.grade[..., :count], shorter.grade)
        assert np.isin(both[changed], WITHDRAWN).all()
        point = nsdrill.window(short)["answer"]["point"]
        if point:
            row = int(np.argmin(np.abs(longer.values("wob") - point["wob"])))
            column = int(np.argmin(np.abs(longer.values("rotary_speed") - point["rotary_speed"])))
            assert longer.allowed[0, row, column] or longer.grade[0, row, column] in WITHDRAWN
    assert any(one.allowed.any() for one in found), "of a study in which nothing is allowed this says nothing"


def test_no_failed_run_of_a_study_makes_a_point_safer(to_three_ends):
    """Each run in turn, as one that failed and as one of which nothing is known."""
    results = results_for_window(to_three_ends[1])
    before = graded(results).grade
    for status in NOT_KNOWN:
        for place in np.argwhere(results["status"] == OK):
            copies = {name: np.array(values) for name, values in results.variables.items()}
            one = replace(results, variables=copies)
            forget(one, tuple(place), status)
            after = graded(one).grade
            assert not np.any(is_allowed(after) & (after > before)), (status, place)


def test_of_a_model_that_does_not_tell_what_lasts_a_vibration_must_have_been_met():
    """Nothing vibrates on either way: that says nothing of a history. Where the way down comes
    out of a vibration, it does; where the bit may bounce, out of a bounce."""
    attrs = {LASTING_UNTOLD: 1}
    for up, down, grade in (
        ("......", "......", Grade.FROM_BELOW),
        ("....ww", "....ww", Grade.FROM_BELOW),
        ("....bb", "....bb", Grade.ANY_HISTORY),
    ):
        found = told(grid({"up": [up], "down": [down]}, np.arange(1.0, 7.0)), [0.5])
        one = replace(found, attrs={**found.attrs, **attrs})
        assert graded(one).grade[0, 0, 1] == grade


def test_a_bounce_that_may_last_and_was_not_met_is_no_any_history():
    """From 3.5 rad/s on it may last, far below the speed at which it begins, which lies above the sweep. Where
    the way down came out of it, it ended."""
    bounce = {"name": "lobe_resonance", "min": 20.0, "max": 20.0, "lasts": [3.5, 4.0]}
    for line, grade in (("......", Grade.FROM_BELOW), (".....b", Grade.ANY_HISTORY)):
        found = told(grid({"up": [line], "down": [line]}, np.arange(1.0, 7.0)), [0.5])
        one = replace(found, attrs={**found.attrs, "lasting_motions": json_text([bounce])})
        assert list(graded(one).grade[0, 0, :5]) == [Grade.ANY_HISTORY] * 3 + [grade] * 2


def test_a_bounce_that_lasts_at_light_weights_alone_is_asked_of_these_alone():
    """At 10 kN it may last at any speed, at 20 kN from 4.5 rad/s on, at 30 kN at none: the last two were
    judged by the first."""
    rows = [{"wob": wob, "rotary_speed": speed} for wob, speed in ((10e3, 0.0), (20e3, 4.5), (30e3, None))]
    bounce = {"name": "lobe_resonance", "min": 20.0, "max": 20.0, "lasts": [0.0, 4.5], "by_weight": rows}
    lines = ["......"] * 3
    found = told(grid({"up": [lines], "down": [lines]}, np.arange(1.0, 7.0), (10e3, 20e3, 30e3)), [0.5] * 3)
    grade = graded(replace(found, attrs={**found.attrs, "lasting_motions": json_text([bounce])})).grade[0]
    assert [list(row[:5]) for row in grade] == [
        [Grade.FROM_BELOW] * 5,
        [Grade.ANY_HISTORY] * 4 + [Grade.FROM_BELOW],
        [Grade.ANY_HISTORY] * 5,
    ]


def test_a_model_tells_by_weight_where_a_bounce_may_last():
    """As the bounce of each weight by itself, in light weights at any speed."""
    head = "bit: {surface_amplitude: 2 mm}\nsweep: {wob: %s, rotary_speed: [3 rad/s, 9 rad/s]}\n"
    one = next(
        one for one in lasting_motions(parse_study(head % "[1 N, 20 kN, 40 kN]")) if one["name"] == "lobe_resonance"
    )
    alone = []
    for row in one["by_weight"]:
        study = parse_study(head % f"[{row['wob']} N]")
        found = next(one for one in lasting_motions(study) if one["name"] == "lobe_resonance")
        alone.append(found["lasts"] and found["lasts"][0])
        assert found["by_weight"] == []
    assert [row["rotary_speed"] for row in one["by_weight"]] == alone
    assert len(set(alone)) > 1


def test_of_very_many_weights_some_are_told():
    """A study of ten thousand weights is checked as fast as one of a few hundred; at the weights between, the
    least speed of all counts."""
    text = "bit: {surface_amplitude: 2 mm}\nsweep: {wob: {from: 1 kN, to: 40 kN, points: %d}}\n"
    found = [
        next(one for one in lasting_motions(parse_study(text % points)) if one["name"] == "lobe_resonance")
        for points in (200, 10_000)
    ]
    assert [len(one["by_weight"]) for one in found] == [200, 256]
    ends = [[one["by_weight"][place] for place in (0, -1)] for one in found]
    assert ends[0] == ends[1]
    assert found[1]["lasts"] == pytest.approx(found[0]["lasts"], rel=0.02)
