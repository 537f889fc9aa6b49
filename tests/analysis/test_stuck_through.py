"""A way up that passes the speeds at which the collar reaches the wall in stick-slip: there
nothing shows what a string does that does not stick, as one with more damping."""

from dataclasses import replace

import pytest
from figures.test_wording import WALL, made

from nsdrill.analysis import advice
from nsdrill.analysis.advice import RECOMMENDED, First, Kind
from nsdrill.analysis.window import find_window
from nsdrill.units import to_si
from nsdrill.words.answer import MOST_WARNINGS, warnings, words_of

RPM = to_si("1 rpm", "rad/s")
SPEEDS = [one * RPM for one in (50, 60, 64, 67, 90, 110, 130)]
WEIGHTS = [one * to_si("1 klbf", "N") for one in (5, 10, 15)]
PAST = "STICK-SLIP TAKES THE STRING PAST WHIRL"


def window(*lines, **ways):
    """The window of three weights, which the collar reaches the wall of at 59 to 68 rpm."""
    wall = {**WALL, "jumped": None, "from": None}
    return find_window(made(wall, SPEEDS, WEIGHTS, up=list(lines), **ways))


def told(found):
    return [text for text in warnings(found, "field") if text.startswith(PAST)]


def test_points_reached_in_stick_slip_are_told():
    found = window("sss....", "ssss...", "ssss...")
    assert found["stuck_through"]["points"] == 6  # three speeds above, at the two weights that stick throughout
    assert found["stuck_through"]["wob"] == [WEIGHTS[1], WEIGHTS[2]]
    (text,) = told(found)
    assert "at 10 to 15 klbf, to 6 allowed points" in text
    assert "at 59 to 68 rpm the bit sticks" in text
    assert "--trials" in text


def test_of_the_setting_it_comes_among_the_first():
    found = window("ssss...", "ssss...", "ssss...")
    assert found["stuck_through"]["at_point"]
    assert any(text.startswith(PAST) for text in list(warnings(found, "field"))[:MOST_WARNINGS])
    assert "the best one among them" in told(found)[0]


def test_a_string_that_passes_without_sticking_is_not_told_of():
    assert window("s......", "s......", "s......")["stuck_through"] is None
    assert window("s.s....", "ss.....", "sss....")["stuck_through"] is None  # a run inside is free


def test_where_whirl_was_met_above_and_ended_nothing_is_told():
    """Safe after any history: whirl was there, and did not last."""
    up, down = ["ssss..w"] * 3, ["......w"] * 3
    found = window(*up, down=down)
    assert found["grades"]["safe after any history"] > 0
    assert found["stuck_through"] is None


def test_nothing_is_told_along_weight():
    wall = {**WALL, "jumped": None, "from": None}
    data = made(wall, SPEEDS, WEIGHTS, along="wob", up=["ssss..."] * 3)
    assert find_window(data)["stuck_through"] is None


@pytest.mark.parametrize("first", [First.WEIGHT, First.SPEED])
def test_a_setting_that_stick_slip_took_past_whirl_is_a_hint_until_trials_tell(monkeypatch, first):
    """Begun at another speed the same string whirls from there on: it was an order, which its own trials withdrew.
    Where the speed is set first, off bottom, that way does not go through stick-slip."""
    way_in = advice._way_in
    monkeypatch.setattr(advice, "_way_in", lambda *given: replace(way_in(*given), first=first))
    window_ = window("ssss...", "ssss...", "ssss...")
    found, past = window_["answer"], window_["stuck_through"]
    if first == First.SPEED:
        assert (found.kind in RECOMMENDED, found.stuck_past) == (True, None)
        return
    assert found.kind == Kind.HINT
    assert found.tried_kind in RECOMMENDED
    assert advice.data_of(found, "rotary_speed")["stuck_past"]["from"] == past["from"]
    sentence = words_of(window_, "field").sentence()
    assert "On the way up stick-slip took the string past whirl at 59 to 68 rpm" in sentence
    assert len(sentence.split()) <= 30
