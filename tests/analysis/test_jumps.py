"""A way up whose steps may jump across speeds at which the string whirls was not tried there:
what lies above is a hint until a trial comes through."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from nsdrill.analysis.advice import Kind
from nsdrill.analysis.confirmed import confirmed
from nsdrill.analysis.trials import SPEED_FIRST, WEIGHT_FIRST, Outcome, Trial, Trials, Way
from nsdrill.analysis.untried import gaps_of
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import plain_window
from nsdrill.app.check import lasting_motions
from nsdrill.data import json_text
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.derived_quantities import lift_off_wob
from nsdrill.study.load import parse_study
from nsdrill.units import to_si
from nsdrill.web.one_page import Sheet, one_page
from nsdrill.words.answer import headlines, needed_for_words, warnings, words_of
from nsdrill.words.orders import Orders

from .grids import grid

RPM = to_si("1 rpm", "rad/s")
WEIGHTS = np.arange(5, 30, 5) * to_si("1 klbf", "N")
COARSE = (40, 50, 60, 70, 80, 90, 100, 110, 120)
FINE = (40, 57, 58, 59, 60, 61, 62, 63, 64, 65, 66, 67, 68, 69, 90, 100, 110, 120, 130)
ROOMY = "." * len(COARSE)
SENTENCE = (
    "Hint only: 10 klbf and 80 rpm, 70 to 120 rpm, 5 to 25 klbf. Steps of 10 rpm may jump across whirl at 59 to 68 "
    "rpm; trials tell."
)


def results(rpm=COARSE, rows=ROOMY, jumped=True, way="up", start=None):
    speeds = np.array(rpm) * RPM
    sweep = "{rotary_speed: [" + ", ".join(f"{one} rpm" for one in rpm) + "], procedure: up, along: rotary_speed}"
    ways = {way: [[rows] * len(WEIGHTS)]}
    found = grid(ways if start is None else {**ways, "same": [[start] * len(WEIGHTS)]}, speeds, WEIGHTS)
    wall = {
        "axis": "rotary_speed",
        "name": "wall_speed",
        "words": "the speed at which the collar reaches the wall",
        "told": "A COLLAR ON THE WALL MAY STAY THERE",
        "safe_while": "nothing brings it to the wall",
        "min": 59 * RPM,
        "max": 60 * RPM,
        "lasts": [33 * RPM, 36 * RPM],
        "from": None,
        "everywhere": False,
        "each": False,
        "range": {"from": 59.1 * RPM, "to": 67.5 * RPM, "enough": 1.9 * RPM},
        "jumped": None,
        "passing_rate": None,
    }
    if jumped:
        wall["jumped"] = {**wall["range"], "step": 10 * RPM}
    resolved = parse_study(f"sweep: {sweep}").resolved
    return replace(
        found,
        attrs={
            **found.attrs,
            "units": "field",
            "lasting_motions": json_text([wall]),
            "study_resolved": json_text(resolved),
        },
    )


def trials(weight, speed):
    outcomes = {".": Outcome.FREE, "w": Outcome.VIBRATES, "x": Outcome.UNKNOWN}
    return Trials(
        tuple(
            Trial(name, Way.IN, outcomes[sign], ("whirl",) if sign == "w" else (), rate=rate * RPM)
            for name, signs in ((WEIGHT_FIRST, weight), (SPEED_FIRST, speed))
            for rate, sign in zip((0.2, 1.0, 10.0, 20.0), signs, strict=False)
        )
    )


def test_above_a_step_that_may_jump_there_is_a_hint_everywhere():
    """In the sentence, the orders, the page, plain data and the headlines; what to stay within
    does not cross the step."""
    window = find_window(results())
    advice, words = window["answer"], words_of(window, "field")
    assert (advice.kind, advice.tried_kind) == (Kind.HINT, Kind.FROM_BELOW)
    assert words.sentence() == SENTENCE
    assert "no setting can be recommended" in words.order()
    orders = Orders(*needed_for_words(window, "field"))
    assert "steps of 10 rpm may jump across whirl at 59 to 68 rpm" in orders.do()[0]
    assert headlines(window, "field")[0] == "STEPS OF 10 rpm MAY JUMP"
    assert any("Trials go through all of these speeds (--trials)." in one for one in warnings(window, "field"))
    found = plain_window(window, "field")
    assert found["answer"]["kind"] == "hint"
    assert found["answer"]["tried_kind"] == "from_below"
    assert found["answer"]["jump"]["step"] == {"rotary_speed": pytest.approx(10 * RPM)}
    assert found["answer"]["sentence"] == SENTENCE
    assert found["maps"][0]["recommended"]["hint"]
    rows = np.array(found["maps"][0]["rows"][0]["safe"]) / RPM
    assert np.allclose(rows, [[40, 50], [60, 60], [70, 120]]), "no stretch crosses such a step"
    below = found["answer"]["stay_within"]["rotary_speed"]["below"]
    assert below["is_jumped"]
    assert "Slower, at" not in words.lines()[0]
    assert "Slower: at 60 rpm it is not known: a step to there may jump across a vibration." in words.lines()[0]
    page = one_page([Sheet(results(), "field", "map.h5")], "A4", {})
    assert "class='answer no'" in page
    assert "class='answer yes'" not in page
    assert SENTENCE in page
    assert "<td>70 to 120</td>" in page


def test_fine_steps_are_a_setting():
    sheet = Sheet(results(FINE, "." * len(FINE), jumped=False), "field", "map.h5")
    assert sheet.advice.kind == Kind.FROM_BELOW
    assert sheet.advice.jump is sheet.advice.tried_kind is None
    assert "class='answer yes'" in one_page([sheet], "A4", {})


def test_below_the_step_there_is_a_setting_that_ends_at_it():
    """What is free above has not to be exceeded into: the step is a border."""
    rpm = (30, 35, 40, 45, 50, 60, 70, 80)
    window = find_window(results(rpm, ".....www"))
    assert window["answer"].kind == Kind.FROM_BELOW
    assert window["answer"].jump is None
    open_above = find_window(results(rpm, ".....w.w"))["answer"]
    assert open_above.never_exceed("rotary_speed") == pytest.approx(50 * RPM)


def test_a_start_at_the_point_needs_no_way_through():
    window = find_window(results(rows="wwwwwwwww", start=ROOMY))
    assert window["answer"].tried_kind is None
    assert window["answer"].jump is None


@pytest.mark.parametrize(
    ("weight", "speed", "begins"),
    [
        ("...", "...", "Bring up to 10 klbf and 80 rpm from below"),
        ("www", "w...", "Go to 10 klbf and 80 rpm speed first, 10 to 20 rpm/s"),
        (
            "www",
            "w..",
            "No setting is recommended: at 10 klbf and 80 rpm, the best of the map, 2 of 6 ways in ended free",
        ),
        (
            "www",
            "www",
            "No setting is recommended: at 10 klbf and 80 rpm, the best of the map, none of 6 ways in ended free",
        ),
        (
            "xxx",
            "xxx",
            "No setting is recommended: at 10 klbf and 80 rpm, the best of the map, none of 6 ways in ended free",
        ),
    ],
)
def test_trials_confirm_or_withdraw(weight, speed, begins):
    window = find_window(results())
    tried = {**window, "answer": confirmed(window["answer"], trials(weight, speed))}
    assert words_of(tried, "field").sentence().startswith(begins)
    came = "Trials went through them at the weight of the setting only."
    assert any(came in one for one in warnings(tried, "field")) == (not begins.startswith("No setting"))


def test_interrupted_trials_without_an_end_leave_the_hint():
    window = find_window(results())
    tried = {
        **window,
        "answer": confirmed(window["answer"], replace(trials("xxx", "xxx"), interrupted=True, is_cut_short=True)),
    }
    assert words_of(tried, "field").sentence() == SENTENCE


GAPS = {
    "a gap": ((0.2, 0.3, 0.4, 1.8, 2.0, 2.5, 3.0), [(0.4, 1.8)]),
    "across the lobes": ((1.2, 2, 3, 4, 4.5, 7.5, 8, 9, 10), [(4.5, 7.5)]),
    "at the end": ((40, 50, 60, 150), [(60, 150)]),
    "at the beginning": ((10, 50, 51, 52, 53), [(10, 50)]),
    "fine where it matters": (FINE, []),
    "even": (tuple(range(10, 100, 10)), []),
    "two values": ((10, 100), []),
    "of preferred numbers": ((1, 2, 5, 10, 20, 50, 100), []),
}


@pytest.mark.parametrize(("rpm", "gaps"), GAPS.values(), ids=GAPS)
def test_gaps_of_a_list_are_found(rpm, gaps):
    found = gaps_of(results(rpm, "." * len(rpm), jumped=False))
    assert [(one.low / RPM, one.high / RPM) for one in found] == [pytest.approx(gap) for gap in gaps]


@pytest.mark.parametrize("way", ["up", "same"])
def test_nothing_is_said_of_a_gap_of_the_sweep(way):
    """What is free on both sides of it need not be between: limits end there, brought up or
    started at the points."""
    rpm = (40, 45, 50, 55, 60, 110, 115, 120, 125)
    window = find_window(results(rpm, "." * len(rpm), jumped=False, way=way))
    advice, words = window["answer"], words_of(window, "field")
    within = advice.stay_within["rotary_speed"]
    assert not (within.low < 60.5 * RPM and within.high > 109.5 * RPM)
    assert within.below.is_gap or within.above.is_gap
    assert "nothing was run between" in " ".join(words.lines())
    assert any(text.startswith("A GAP OF THE SWEEP at 60 to 110 rpm") for text in warnings(window, "field"))
    assert plain_window(window, "field")["gaps"][0]["motion"] is None
    ends = np.array(window["maps"][0]["rows"][0]["safe"]) / RPM
    assert np.allclose(ends, [[40, 60], [110, 125]])


def test_above_a_gap_nothing_was_brought_up_through_it():
    """Where there is no room below, what lies above is a hint, until a trial comes through."""
    rpm = (40, 43, 46, 110, 115, 120, 125, 130, 135, 140, 145, 150)
    window = find_window(results(rpm, "." * len(rpm), jumped=False))
    assert window["answer"].kind == Kind.HINT
    assert window["answer"].tried_kind == Kind.FROM_BELOW
    assert "Nothing was run between 46 and 110 rpm; trials tell." in words_of(window, "field").sentence()


def test_a_setting_with_room_below_a_gap_comes_first():
    rpm = (40, 50, 60, 70, 80, 90, 150, 160, 170, 180)
    advice = find_window(results(rpm, "." * len(rpm), jumped=False))["answer"]
    assert advice.kind == Kind.FROM_BELOW
    assert advice.never_exceed("rotary_speed") == pytest.approx(90 * RPM)


LOBED = """
operation: {depth: 2000 m, wob: 40 kN}
modes: {lateral: frozen}
bit: {lobes: 3, surface_amplitude: 0.3 mm, friction: {static: 0.3, dynamic: 0.2}}
sweep: {rotary_speed: {from: 2 rad/s, to: 20 rad/s, points: %d}, procedure: up}
"""


def test_steps_may_jump_across_the_speeds_at_which_lobes_lift_the_bit():
    """The range is that of the linear bit: where steady contact takes more than the weight."""
    study = parse_study(LOBED % 4)
    bounce = next(one for one in lasting_motions(study) if one["name"] == "lobe_resonance")
    low, high = (bounce["jumped"][end] for end in ("from", "to"))
    assert 2.0 < low < bounce["min"] < high < 20.0
    for speed, lifts in ((low - 0.01, False), (low + 0.01, True), (high - 0.01, True), (high + 0.01, False)):
        at = replace(study.operation, rotary_speed=speed)
        k = derive(study.parameters, *astuple(at))
        assert (lift_off_wob(study.parameters, at, k) > at.wob) == lifts
    fine = parse_study(LOBED % 37)
    found = [one for one in lasting_motions(fine) if one["name"] == "lobe_resonance"]
    assert [one["jumped"] for one in found] == [None]


def test_a_narrow_hint_above_such_a_step_says_so_in_its_sentence():
    """Free at 70 rpm alone, above steps of 10 rpm over the speeds of the wall."""
    window = find_window(results(rows="wwwwww.ww"))
    assert window["answer"].narrow
    assert "steps of 10 rpm may jump across whirl at 59 to 68 rpm" in words_of(window, "field").sentence()
    assert window["jumped_points"] > 0


@pytest.mark.parametrize(("untold", "told"), [(0, False), (1, True)])
def test_steps_are_told_of_where_the_model_does_not_tell_at_which_speeds_its_bit_bounces(untold, told):
    found = results(FINE, "." * len(FINE), jumped=False)
    window = find_window(replace(found, attrs={**found.attrs, "model": "segments", "lasting_untold": untold}))
    assert window["bounce_untold"] == (pytest.approx(21 * RPM) if told else None)
    words = "AT WHICH SPEEDS THE BIT BOUNCES is not known of segments: steps of up to 21 rpm may jump across some."
    assert any(one.startswith(words) for one in warnings(window, "field")) == told
