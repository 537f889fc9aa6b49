"""Where each speed is swept by itself, as the weight is raised, nothing is brought up through the speed at which the
collar reaches the wall: that is a reason against what lies above it, and none against what lies below."""

import random
import re

import pytest
from figures.test_wording import RPM, SPEEDS, WALL, WEIGHTS, made

from nsdrill.analysis.advice import Kind
from nsdrill.analysis.window import find_window
from nsdrill.words.answer import needed_for_words, warnings
from nsdrill.words.orders import Orders

EACH = {**WALL, "each": True, "from": SPEEDS[-1], "off_bottom": None, "everywhere": True}


def at_wall(rpm: float) -> dict:
    return {**EACH, "min": rpm * RPM, "max": (rpm + 2) * RPM}


def test_a_setting_below_the_wall_is_no_hint_for_it_and_its_range_ends_there():
    window = find_window(made(at_wall(115), along="wob", up=["......."] * 4 + ["wwwwwww"]))
    found = window["answer"]
    assert found.kind == Kind.FROM_BELOW
    assert found.point["rotary_speed"] < 115 * RPM
    assert found.stay_within["rotary_speed"].high < 115 * RPM
    words = Orders(*needed_for_words(window, "field"))
    beside = next(text for text in words.lines() if text.startswith("Slower"))
    assert "Faster: at 120 rpm it is not known: nothing was brought up through the speed" in beside
    # of the points above it is said all the same
    (said,) = [text for text in warnings(window, "field") if text.startswith("EACH SPEED")]
    assert "a point above it that is safe here need not be safe then" in said


def test_all_above_the_wall_are_hints():
    found = find_window(made(at_wall(60), along="wob", up=["......."] * 5))
    assert found["answer"].kind == Kind.HINT
    assert found["passed_over"]


def test_a_weight_at_which_one_begins_is_set_and_not_raised():
    window = find_window(made(at_wall(300), along="wob", up=["......."] * 1 + ["sssssss"] * 4))
    words = Orders(*needed_for_words(window, "field"))
    assert window["answer"].point["wob"] == WEIGHTS[0]
    texts = " ".join([words.sentence(), *words.lines(), *words.do(""), *words.to_confirm("", 9)])
    assert re.search(r"then set 10 klbf", texts)
    assert "raise the weight" not in texts


@pytest.mark.parametrize("seed", range(80))
def test_no_reason_is_given_that_the_point_and_its_range_do_not_have(seed):
    draw = random.Random(seed)
    wall = draw.choice((60, 85, 105, 125, 300))
    lines = ["".join(draw.choices(".sw", (8, 1, 1), k=len(SPEEDS))) for _ in WEIGHTS]
    window = find_window(made(at_wall(wall), along="wob", up=lines))
    found = window["answer"]
    if found.cell is None:
        return
    is_above = found.point["rotary_speed"] >= wall * RPM
    assert bool(window["passed_over"]) == is_above
    within = found.stay_within["rotary_speed"]
    assert is_above or within.high < wall * RPM
    words = Orders(*needed_for_words(window, "field"))
    for text in (words.sentence(), *words.lines(), *words.do(""), *words.to_confirm("", 9)):
        for low, high in re.findall(r"from ([\d.]+ \w+) to ([\d.]+ \w+)", text):
            assert low != high, text
    # a setting with room lies on no limit but an end of what was run
    if found.kind != Kind.HINT:
        for axis, one in found.stay_within.items():
            if one.low < one.high and one.below.value is not None:
                assert one.low < found.point[axis], (axis, lines)
            if one.low < one.high and one.above.value is not None:
                assert found.point[axis] < one.high, (axis, lines)
