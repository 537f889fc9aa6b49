"""What is not known makes no answer safer and none narrower: results in which a run failed,
or was not made, against the same results in which it was known."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsdrill.analysis.attractors import describe
from nsdrill.analysis.comparison import compare_results
from nsdrill.analysis.contrast import contrast
from nsdrill.analysis.counts import KNOWN, Counts, after_failure, knowledge, open_words
from nsdrill.analysis.hysteresis import disagreement, hysteresis, not_compared
from nsdrill.analysis.maps import SAFE, UNKNOWN, classes
from nsdrill.analysis.probability import interval, probabilities_of
from nsdrill.analysis.safety import known_outcome, known_runs, run_safety
from nsdrill.analysis.sensitivity import MIN_SAMPLES, sensitivity
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import contrast as contrast_of
from nsdrill.data import STICKS_TO, Results
from nsdrill.models.registry import model_in
from nsdrill.models.responses import RESPONSES
from nsdrill.text.contrast_text import sentence, side_by_side
from nsdrill.text.uncertainty_text import conclusion, sensitivity_lines
from nsdrill.variables import DIVERGED, INFERRED, OK, PENDING, STEP_LIMIT, UNMEASURED, Axis, Unknown
from nsdrill.words.answer import is_hint, warnings

ROCK = Unknown("bit.rock_stiffness", "N/m", "Contact stiffness of the rock")
SPAN = Axis("drillstring.collar.span", "m", "Free length of the collar")
NOT_KNOWN = (DIVERGED, STEP_LIMIT, PENDING, UNMEASURED)
MODELS = ("christoforou_yigit", "torsion", "beam", "segments")
ROUNDING = 1e-12


@st.composite
def sweeps(draw: st.DrawFn, members: tuple[str | None, ...] = (None, "start", "sample"), ways: int = 1) -> Results:
    """Results with any responses, severities and features of runs that are known, that
    failed or that were not made, in any order, whatever made them."""
    several = [("up", "down"), ("up", "down", "same")]
    procedures = draw(st.sampled_from(several if ways > 1 else [("same",), ("up",), ("down",), *several]))
    model, member = draw(st.sampled_from(MODELS)), draw(st.sampled_from(members))
    coords: dict[str, Any] = {
        "procedure": np.array(procedures),
        "depth": np.array([1500.0]),
        "wob": 10e3 * np.arange(1.0, 1 + draw(st.integers(1, 2))),
        "rotary_speed": np.arange(1.0, 1 + draw(st.integers(2, 4))),
    }
    more = ()
    if draw(st.booleans()):
        coords[SPAN.name], more = np.arange(10.0, 10.0 + draw(st.integers(1, 2))), (SPAN,)
    if member:
        coords[member] = np.arange(draw(st.integers(16, 20) if member == "sample" else st.integers(2, 4)))
    shape = tuple(map(len, coords.values()))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    bits = [0, *(one.bit for one in RESPONSES.values() if one.name in model_in({"model": model}).responses), 3]
    likely = draw(st.sampled_from([0.5, 0.9, 1.0]))
    response = np.where(rng.random(shape) < likely, 0, rng.choice(bits, shape)).astype(np.int8)
    status = np.where(rng.random(shape) < draw(st.sampled_from([0.6, 0.95, 1.0])), OK, rng.choice(NOT_KNOWN, shape))
    if draw(st.booleans()) and member is None:
        status = np.where((status == OK) & (rng.random(shape) < 0.2), INFERRED, status)
    variables = {"status": status.astype(np.int8), "response": response}
    for one in RESPONSES.values():
        if one.severity is not None:
            variables[one.severity.name] = np.where(response & one.bit, rng.integers(1, 5, shape), 0).astype(np.int8)
    variables["settled"] = (rng.random(shape) < 0.9).astype(np.int8)
    touches = draw(st.sampled_from([0.0, 0.1, 1.0]))
    for name in (*model_in({"model": model}).check_features, "rate_of_penetration"):
        is_felt = (response > 0) | (rng.random(shape) < touches) | (name == "rate_of_penetration")
        variables[name] = np.where(is_felt, rng.random(shape), 0.0)
    if draw(st.booleans()):
        for check in ("tight", "long"):
            variables[f"{check}_status"] = rng.choice([OK, OK, OK, STEP_LIMIT], shape).astype(np.int8)
            variables[f"{check}_response"] = np.where(rng.random(shape) < 0.9, response, 1).astype(np.int8)
            variables[f"{check}_difference"] = np.zeros(shape)
        variables["trusted"] = np.ones(shape, np.int8)
    along = "rotary_speed" if ways > 1 else draw(st.sampled_from(["rotary_speed", "wob"]))
    sweep = {"along": along, "procedure": "-".join(procedures)}
    study = {"sweep": sweep, "uncertain": {"samples": 16}} if member == "sample" else {"sweep": sweep}
    drawn = {ROCK: np.linspace(1e7, 2e7, shape[-1])} if member == "sample" else {}
    attrs = {"model": model, "study_resolved": json.dumps(study)} if draw(st.booleans()) else {"model": model}
    results = told(draw, Results(coords, variables, attrs, more, drawn))
    for place in np.argwhere(~np.isin(status, (OK, INFERRED))):
        forget(results, tuple(place), int(status[tuple(place)]))
    return results


def told(draw: st.DrawFn, results: Results) -> Results:
    """With what a model may say of stick-slip at each weight: nothing, or up to which speed it
    lasts and below which steady drilling is unstable; the starts perhaps those of a bit
    that is held."""
    if "start" in results.coords or draw(st.booleans()):
        return results
    speeds = st.sampled_from([(None, None), (0.0, 0.0), (0.0, 1.5), (0.0, 2.5), (1.5, 2.5), (1.5, "every")])
    weights = len(results.coords["wob"])
    unstable_to, lasts_to = zip(*(draw(speeds) for _ in range(weights)), strict=True)
    found = {
        "over": ["wob"] if weights > 1 else [],
        "lasts_to": lasts_to,
        "unstable_to": unstable_to,
        "from_rest": draw(st.booleans()),
    }
    return replace(results, attrs={**results.attrs, STICKS_TO: json.dumps(found)})


def forget(results: Results, place: tuple[int, ...], status: int) -> None:
    """Make a run one that failed, or that was not made, as a file has it."""
    for _name, values in results.variables.items():
        values[place] = np.nan if values.dtype.kind == "f" else 0
    results["status"][place] = status


@st.composite
def pairs(draw: st.DrawFn, **options: Any) -> tuple[Results, Results]:
    """Results, and the same results but for a known run that failed or was not made."""
    before = draw(sweeps(**options))
    after = replace(before, variables={name: values.copy() for name, values in before.variables.items()})
    places = np.argwhere(np.isin(before["status"], (OK, INFERRED)))
    if len(places):
        place = tuple(places[draw(st.integers(0, len(places) - 1))])
        forget(after, place, draw(st.sampled_from(NOT_KNOWN)))
    return before, after


SEVERITIES_ALLOWED = st.sampled_from([None, 0, 1, 3])
CONFIDENCES = st.sampled_from([0.3, 0.8, 0.9, 0.95])
thorough = settings(max_examples=120)


def confidence_of(results: Results, confidence: float) -> float | None:
    return confidence if "sample" in results.coords else None


@thorough
@given(pairs(), SEVERITIES_ALLOWED)
def test_no_run_becomes_safe_and_the_counts_say_what_is_not_known(pair, severity):
    before, after = (run_safety(one, severity) for one in pair)
    assert not np.any(after.safe & ~before.safe)
    assert not np.any(after.unsafe & ~before.unsafe)
    assert not np.any(after.safe & after.unsafe)
    runs = Counts.over(knowledge(pair[1]["status"], after.safe | after.unsafe)).at()
    assert runs["of"] == pair[1]["status"].size
    assert runs["known"] + runs["failed"] + runs["pending"] <= runs["of"]
    assert runs["known"] == np.count_nonzero(after.safe | after.unsafe)
    assert bool(open_words(runs)) == (runs["known"] < runs["of"])
    assert not np.any(known_runs(pair[1]) & ~known_runs(pair[0]))


@thorough
@given(pairs(members=("sample",)), SEVERITIES_ALLOWED)
def test_no_interval_of_a_probability_becomes_narrower(pair, severity):
    before, after = (probabilities_of(one, severity) for one in pair)
    (low, high), (low_after, high_after) = before.interval, after.interval
    assert np.all(low_after <= low + ROUNDING), "the least probability of a safe run never rises"
    assert np.all(high_after >= high - ROUNDING), "the greatest of a response never falls"
    for one in (before, after):
        known = one.known > 0
        assert np.array_equal(known, np.isfinite(one.share))
        assert np.all(one.interval[0][known] <= one.share[known] + ROUNDING)
        assert np.all(one.share[known] <= one.interval[1][known] + ROUNDING)
        # whatever the samples are that are not known
        for count in (one.count, one.count + one.open):
            ends = interval(count * (one.effective / one.total), one.effective)
            assert np.all(one.interval[0] <= ends[0] + ROUNDING)
            assert np.all(one.interval[1] >= ends[1] - ROUNDING)


@thorough
@given(pairs(), SEVERITIES_ALLOWED, CONFIDENCES)
def test_no_point_of_a_map_becomes_safe(pair, severity, confidence):
    before, after = (classes(one, severity, confidence_of(one, confidence)) for one in pair)
    safe, safe_after = before.state == SAFE, after.state == SAFE
    assert not np.any(safe_after & ~safe)
    # a lesser grade, as none that holds after any history, may rest on fewer runs
    is_as_good = after.grades.grade >= before.grades.grade
    assert not np.any(safe_after & before.unsettled & ~after.unsettled & ~after.failed & is_as_good), (
        "it settles, or a run is not known"
    )
    # a point that can no longer be called critical is not known
    assert np.all(after.state[(before.state != UNKNOWN) & (after.state != before.state) & ~safe_after] <= 1)
    if after.safety:
        assert np.all(after.safety[1] <= before.safety[1] + ROUNDING)
        assert np.all(after.safety[2] >= before.safety[2] - ROUNDING)


@thorough
@given(pairs(), SEVERITIES_ALLOWED, CONFIDENCES)
def test_no_window_becomes_larger_and_no_point_is_newly_recommended(pair, severity, confidence):
    level = confidence_of(pair[0], confidence)
    before, after = (find_window(one, severity, level) for one in pair)
    maps = classes(pair[0], severity, level)
    safe = maps.state == SAFE
    assert after["safe"] <= before["safe"]
    for number, (one, other) in enumerate(zip(before["maps"], after["maps"], strict=True)):
        point = other["recommended"]
        if point is None:
            continue
        row, column = (int(np.searchsorted(maps.values(axis), point[axis])) if axis else 0 for axis in (maps.y, maps.x))
        assert safe[number, row, column], "it was allowed before"
        same = one["recommended"] and all(one["recommended"][axis] == point[axis] for axis in before["axes"])
        if same and is_hint(before, one["recommended"]):
            assert is_hint(after, point), "a hint does not become a setting"
    assert np.count_nonzero(safe) == before["safe"]
    for row, row_after in zip(before["price"], after["price"], strict=True):
        assert row_after["safe"] <= row["safe"]
    if after["most_probable"]:
        assert after["most_probable"]["probability_low"] <= before["most_probable"]["probability_low"] + ROUNDING
    # and it says so
    assert after["known"] <= before["known"]
    told = " ".join(warnings(after, "si"))
    assert ("FAILED:" in told) == (after["failed"] > 0)
    assert ("NOT ALL HAS RUN" in told) == (after["pending"] > 0)
    assert ("NOT CARRIED" in told) == (after["after_failure"] > 0)


@thorough
@given(pairs(members=(None, "start"), ways=2))
def test_no_claim_about_up_and_down_becomes_firmer(pair):
    outcomes = [known_outcome(one) for one in pair]
    before, after = (disagreement(("up", "down"), one) for one in outcomes)
    assert not np.any((after == 0) & (before != 0)), "no more points at which up and down agree"
    assert not np.any((after == 1) & (before != 1)), "and none at which they newly differ"
    counts = not_compared(pair[1])
    assert counts["of"] - counts["known"] == np.count_nonzero(after < 0)
    values = pair[1].coords["rotary_speed"]
    for row in hysteresis(pair[1], "rotary_speed"):
        line = [row.get(axis) for axis in ("wob", SPAN.name, "start") if axis in pair[1].grid]
        assert None not in line
        place = tuple(
            slice(None) if axis == "rotary_speed" else int(np.searchsorted(pair[1].coords[axis], row[axis]))
            for axis in pair[1].grid[1:]
        )
        for end, value, step in (("from", row["from"], -1), ("to", row["to"], 1)):
            beyond = int(np.searchsorted(values, value)) + step
            is_unknown = not 0 <= beyond < len(values) or after[place][beyond] < 0
            assert (end in row["open"]) == is_unknown


@settings(max_examples=40)
@given(pairs(members=("sample",)), SEVERITIES_ALLOWED)
def test_a_sensitivity_says_what_it_does_not_know(pair, severity):
    before, after = (sensitivity(one, severity) for one in pair)
    assert after["samples"] >= MIN_SAMPLES
    words = open_words(after, "samples")
    for one, other in zip(before["answers"][0]["unknowns"], after["answers"][0]["unknowns"], strict=True):
        for end in ("low", "high"):
            assert other[end]["least"] <= one[end]["least"] + ROUNDING
            assert other[end]["most"] >= one[end]["most"] - ROUNDING
            if other[end]["answer"] is not None:
                assert other[end]["least"] - ROUNDING <= other[end]["answer"] <= other[end]["most"] + ROUNDING
    if words:
        assert words in conclusion(after) or not after["measure_first"]
        assert "agree" not in conclusion(after)
        assert words in "\n".join(sensitivity_lines(after, "si"))


@thorough
@given(pairs(members=("start",)), st.integers(0, 2**32 - 1))
def test_no_share_of_an_attractor_becomes_narrower(pair, seed):
    number = np.random.default_rng(seed).integers(1, 3, pair[0]["status"].shape)
    described = []
    for one in pair:
        starts = len(one.coords["start"])
        variables = {name: values.reshape(-1, starts) for name, values in one.variables.items()}
        is_ok = variables["status"] == OK
        variables["attractor"] = np.where(is_ok, number.reshape(-1, starts), 0)
        described.append(list(describe(variables, is_ok, ())))
    for (attractors, counts), (attractors_after, counts_after) in zip(*described, strict=True):
        assert counts_after["known"] <= counts["known"]
        before = {one.number: one for one in attractors}
        for one in attractors_after:
            assert one.low <= before[one.number].low + ROUNDING
            assert one.high >= before[one.number].high - ROUNDING
            assert one.low - ROUNDING <= one.share <= one.high + ROUNDING


@settings(max_examples=60)
@given(pairs(), st.booleans(), SEVERITIES_ALLOWED, CONFIDENCES)
def test_no_difference_becomes_clearer(pair, is_first, severity, confidence):
    """Against the results themselves, of which all runs ended well."""
    other = replace(pair[0], variables={name: values.copy() for name, values in pair[0].variables.items()})
    other["status"][:] = OK
    other["response"][..., 0] = 0

    def ordered(one: Results) -> tuple[Results, Results]:
        return (one, other) if is_first else (other, one)

    before, after = (compare_results(*ordered(one)) for one in pair)
    assert after["responses"]["unchanged"] <= before["responses"]["unchanged"]
    assert after["responses"]["unknown"] >= before["responses"]["unknown"]
    if before["probabilities"]:
        for row, row_after in zip(*(found["probabilities"]["outcomes"] for found in (before, after)), strict=True):
            assert row_after["apart"] <= row["apart"]
            assert row_after["known"] <= row["known"]
    level = confidence_of(pair[0], confidence)
    before, after = (contrast(*ordered(one), severity, level) for one in pair)
    for name in ("both", "gained", "lost"):
        assert after[name] <= before[name]
    assert after["unknown"] >= before["unknown"]
    if level is None:
        found = contrast_of(*ordered(pair[1]), severity, level)
        assert ("not known in one of them" in sentence(found, "si")) == (found["unknown"] > 0)


# What these say of single cases.


def carried(status: list[list[int]], procedures: tuple[str, ...] = ("up", "down")) -> Results:
    shape = (len(procedures), 1, 1, len(status[0]))
    coords = {
        "procedure": np.array(procedures),
        "depth": np.array([1e3]),
        "wob": np.array([1e4]),
        "rotary_speed": np.arange(1.0, 1 + len(status[0])),
    }
    attrs = {"study_resolved": json.dumps({"sweep": {"along": "rotary_speed", "procedure": "up-down"}})}
    variables = {"status": np.array(status, np.int8).reshape(shape), "response": np.zeros(shape, np.int8)}
    return Results(coords, variables, attrs)


def test_after_a_failed_run_nothing_of_its_chain_is_known():
    """Nothing was carried from it: the next run began at the start of the study, and the
    way down went on from there."""
    results = carried([[OK, OK, DIVERGED, OK], [OK, OK, OK, OK]])
    assert after_failure(results)[:, 0, 0].tolist() == [[False, False, False, True], [True] * 4]
    note = find_window(results)
    assert (note["safe"], note["unknown"], note["failed"], note["after_failure"]) == (0, 4, 1, 5)
    results = carried([[OK] * 4, [OK, OK, STEP_LIMIT, OK]])
    assert after_failure(results)[:, 0, 0].tolist() == [[False] * 4, [True, True, False, False]]
    assert find_window(results)["safe"] == 1
    results = carried([[OK, DIVERGED, OK, OK]], ("same",))
    assert not after_failure(results).any(), "each begins by itself"


def test_two_windows_count_nothing_where_nothing_is_known():
    """No run of the second is known: it has no number of points that are free of stick-slip, or safe."""
    known, unknown = (carried([[status] * 4], ("up",)) for status in (OK, STEP_LIMIT))
    known["response"][..., :2] = RESPONSES["stick_slip"].bit
    found = contrast_of(known, unknown)
    assert found["safe"] == {"a": 2, "b": None}
    assert found["responses"]["stick_slip"] == {"a": 2, "b": None}
    assert found["open_points"] == {"a": 0, "b": 4}
    told = {row[0]: row[1:] for row in side_by_side(found, "si")}
    assert told["safe points"] == ("2 of 4 (50.0 %)", "not known")
    assert told["stick-slip"] == ("2 of 4 (50.0 %)", "not known")
    assert told["best point"][1] == "not known"
    assert "4 common points an unknown number are safe with b" in sentence(found, "si")
    unknown["status"][..., 0] = OK
    found = contrast_of(known, unknown)
    told = {row[0]: row[1:] for row in side_by_side(found, "si")}
    assert told["stick-slip"] == ("2 of 4 (50.0 %)", "0 of 4 (0.0 %), not known at 3")


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ((8, 0, 0, 8), ""),
        ((0, 8, 0, 8), "8 of 8 failed"),
        ((5, 2, 1, 8), "2 failed and 1 pending of 8"),
        ((5, 2, 0, 8), "2 failed and 1 not known of 8"),
        ((7, 0, 1, 8), "1 of 8 pending"),
    ],
)
def test_what_is_not_known_in_words(counts, words):
    assert open_words(dict(zip(("known", "failed", "pending", "of"), counts, strict=True))) == words


def test_an_interval_covers_whatever_is_not_known():
    """Of 8 samples 3 occurred, of 2 it is not known: from that of 3 to that of 5."""
    low, high = interval(np.array(3), 8, 2)
    assert (low, high) == (interval(np.array(3), 8)[0], interval(np.array(5), 8)[1])
    assert [float(end) for end in interval(np.array(0), 8, 8)] == [0.0, 1.0]
    assert KNOWN == 0
