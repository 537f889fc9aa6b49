"""What a severity allows is no order where the setting vibrates by itself: it is a hint that says which vibration, how
strong and in which runs, and nothing calls it free or steady."""

import re

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from nsdrill.analysis.advice import RECOMMENDED, Kind, data_of
from nsdrill.analysis.graded import graded
from nsdrill.analysis.window import NO_POINT, find_window
from nsdrill.data import Results
from nsdrill.models.registry import responses_in
from nsdrill.words.answer import answer, needed_for_words, warnings, words_of
from nsdrill.words.orders import Orders

from .grids import grid

RPM, KLBF = np.pi / 30, 4448.2216152605
WAYS = [("up",), ("up", "down"), ("up", "same"), ("up", "down", "same"), ("same",)]


def with_severities(results: Results, level: object) -> Results:
    """The results with this ``level`` of severity of each response where it is met."""
    for one in responses_in(results.attrs).values():
        if one.severity is not None:
            met = np.asarray(results["response"]) & one.bit
            results.variables[one.severity.name] = np.where(met, level, 0).astype(np.int8)
    return results


def bouncing(up: str = "bbbbbbbb", down: str = "bbbbbbbb") -> Results:
    """From 40 rpm on every 5 rpm it bounces strongly, and at the end severely."""
    results = grid({"up": [[up]], "down": [[down]]}, RPM * (40.0 + 5.0 * np.arange(len(up))), [5 * KLBF])
    return with_severities(results, np.where(np.arange(len(up)) < len(up) - 2, 3, 4))


def test_a_setting_that_bounces_in_every_run_is_a_hint_that_says_so():
    found = find_window(bouncing(), severity=3)
    said = answer(found, "field")
    assert said.startswith("Hint only: at ")
    assert "rpm it bounces in every run, strong at most. So much is allowed at 40 to 65 rpm at 5 klbf." in said
    lines = words_of(found, "field").lines()
    assert "If it bounces: pick up and stop the rotation; it does so in every run, and would again." in lines
    assert not [one for one in lines if "come in again" in one or "Never exceed" in one or "Way in" in one]
    assert any(one.startswith("THE SETTING VIBRATES: it bounces in every run, strong") for one in warnings(found, "si"))
    data = data_of(found["answer"], "rotary_speed")
    assert (data["kind"], data["never_exceed"], data["recover"]) == ("hint", None, None)
    assert data["vibrates"][0] == {"way": "up", "responses": ["bit_bounce"], "severity": 3, "runs": 1, "of": 1}


def test_what_it_does_otherwise_when_lowered_is_told_by_the_way():
    found = find_window(bouncing(down="BBBBBBBB"), severity=3)
    assert "brought up, it bounces" not in answer(found, "field")
    assert "rpm, brought up it bounces, strong at most; coming down it bounces and whirls, strong at most." in answer(
        found, "field"
    )


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_nothing_calls_free_or_steady_what_vibrates(seed):
    rng = np.random.default_rng(seed)
    ways = WAYS[rng.integers(len(WAYS))]
    rows, columns = int(rng.integers(1, 4)), int(rng.integers(4, 9))
    drawn = {
        way: [
            [
                "".join(rng.choice(list("..bswBx"), columns, p=[0.1, 0.1, 0.25, 0.2, 0.2, 0.1, 0.05]))
                for _ in range(rows)
            ]
        ]
        for way in ways
    }
    results = grid(drawn, RPM * (40.0 + 10.0 * np.arange(columns)), KLBF * (10.0 + 5.0 * np.arange(rows)))
    with_severities(results, rng.integers(1, 5, np.asarray(results["response"]).shape))
    plain = graded(results)
    for level in (1, 2, 3, 4):
        summary = find_window(results, severity=level)
        advice = summary["answer"]
        if advice.cell is None or advice.kind in NO_POINT:
            continue
        met = plain.bits[(slice(None), *advice.cell)].any()
        is_free = bool(plain.allowed[advice.cell])
        if advice.kind in RECOMMENDED:
            assert is_free or not met, "no order leads into a vibration"
        assert (advice.vibrates is not None) == bool(advice.severity and met and not is_free)
        if advice.vibrates is None:
            continue
        assert advice.kind == Kind.HINT
        orders = Orders(*needed_for_words(summary, "field"))
        said = [orders.sentence(), *orders.lines(), *orders.do(), *orders.to_confirm(), *orders.do_not()]
        text = " ".join(said).replace("steady drilling is unstable", "")
        assert not re.search(r"\b(free|steady)\b", text), text
        for order in ("come in again", "Never exceed", "Do not exceed", "ower to ", "start again"):
            assert order not in text
        assert "at most" in orders.sentence()
        assert orders.exceed("rotary_speed") is None
