"""One way in, in all texts: the speed first, off bottom, unless the numbers or trials say
otherwise."""

import json
from dataclasses import replace

import numpy as np
import pytest
from figures.test_wording import FREE, ROLLS, SPEEDS, WALL, WEIGHTS, made

from analysis.grids import told
from nsdrill.analysis.advice import First, Kind, Surface, WayIn, data_of
from nsdrill.analysis.confirmed import came_in, confirmed
from nsdrill.analysis.trials import SPEED_FIRST, WEIGHT_FIRST, Outcome, Trial, Trials, Way
from nsdrill.analysis.window import find_window
from nsdrill.data import STRING_BY_DEPTH
from nsdrill.text.window_text import lines
from nsdrill.units import to_si
from nsdrill.words.answer import needed_for_words, warnings, words_of
from nsdrill.words.orders import Orders
from nsdrill.words.wording import is_short, period_words

RPM = to_si("1 rpm", "rad/s")


def texts(results) -> tuple[str, str, str]:
    """The line of the window, and what to do and not to do."""
    found = find_window(results)
    orders = Orders(*needed_for_words(found, "field"))
    line = next((one for one in words_of(found, "field").lines() if one.startswith("Way in")), "")
    return line, " ".join((*orders.do(), *orders.to_confirm())), " ".join(orders.do_not())


def off_bottom(low: float, high: float, rate: float | None) -> dict:
    """The wall range of a collar off bottom, in rpm and rpm/s."""
    rates = dict.fromkeys(("passing_rate", "sure_rate")) if rate is None else at_rates(rate)
    return {**WALL, "off_bottom": {"from": low * RPM, "to": high * RPM, **rates, "swing": 0.3}}


def at_rates(rate: float) -> dict:
    """The estimate in rpm/s, and the rate that is sure to pass where the bit does not lag."""
    return {"passing_rate": rate * RPM, "sure_rate": 2 * rate * RPM}


def test_the_speed_is_first_and_nothing_forbids_it():
    """The whirl of the lightest weight on the slow way up does not turn the orders round."""
    line, do, do_not = texts(made(WALL, up=["ssw....", *FREE[1:]], down=ROLLS))
    said = "off bottom raise the speed to 100 rpm, through 60 to 68 rpm at 1.8 rpm/s or faster"
    assert said in line
    assert said.capitalize() in do
    assert "before the weight" not in do_not
    # a tenth below 60.4 rpm
    assert "Do not stop between 54 rpm and 100 rpm off bottom: the collar goes to the wall at 60 to 68 rpm." in do_not


def test_one_does_not_stay_where_off_bottom_the_collar_reaches_the_wall():
    """With the weight on the map is free at 70 and 80 rpm; picked up there, at 66 to 82 rpm, it goes to the wall."""
    free = ["......w"] * 5
    found = find_window(made(off_bottom(66, 82, 1.5), up=free, down=ROLLS))["answer"]
    assert found.point["rotary_speed"] > 82 * RPM
    assert found.way_in.crosses
    one = found.stay_within["rotary_speed"]
    assert one.low == pytest.approx(90 * RPM)
    assert (one.below.value, one.below.is_on_wall) == (pytest.approx(80 * RPM), True)
    assert data_of(found, "rotary_speed")["stay_within"]["rotary_speed"]["below"]["is_on_wall"] is True
    do_not = texts(made(off_bottom(66, 82, 1.5), up=free, down=ROLLS))[2]
    assert "Once there, do not go below 90 rpm: at 66 to 82 rpm off bottom the collar reaches the wall." in do_not
    low = find_window(made(off_bottom(150, 160, 1.5), up=free, down=ROLLS))["answer"]
    assert low.stay_within["rotary_speed"].low < 75 * RPM, "where the wall is not on the way nothing is cut"


def test_a_range_that_no_drive_passes_is_not_crossed():
    """98 rpm/s: below the range the speed is first; above it the weight, as it was run."""
    below = texts(made(off_bottom(150, 160, 49), up=FREE, down=ROLLS))
    assert "rpm/s" not in " ".join(below)
    assert "Off bottom raise the speed to 100 rpm. Then set 15 klbf." in below[1]
    assert "Do not raise the speed through 150 to 160 rpm off bottom" in below[2]
    line, do, do_not = texts(made(off_bottom(60, 90, 49), up=FREE, down=ROLLS))
    assert "set 15 klbf at 70 rpm" in line
    assert "off bottom no drive passes 60 to 90 rpm" in do
    assert "Do not raise the speed before the weight" in do_not
    started = texts(made(off_bottom(60, 80, 49), up=["wwwwwww"] * 5, down=ROLLS, same=["......w"] * 5))
    assert "Way in: none is known" in started[0]
    assert "Find a way in first. None is known: with " in started[1]
    assert "If the drive is slower" not in started[1]
    narrow = made(off_bottom(60, 80, 49), up=["wwwwwww"], down=["wwwwwww"], same=["ww.wwww"], weights=WEIGHTS[:1])
    assert words_of(find_window(narrow), "field").sentence().endswith("no way in is known.")


def test_a_setting_to_which_no_way_in_is_known_is_a_hint_until_trials_reach_it():
    """It is free from a start at the point only, and no drive passes 60 to 80 rpm on the way."""
    ways = {"up": ["wwwwwww"] * 5, "down": ROLLS, "same": ["......w"] * 5}
    found = find_window(made(off_bottom(60, 80, 49), **ways))
    assert (found["answer"].kind, found["answer"].narrow) == (Kind.HINT, False)
    words = words_of(found, "field").sentence()
    assert words.startswith("Hint only: ")
    assert "No way in is known: slowly it whirls, and no drive passes 60 to 80 rpm." in words
    assert is_short(words)
    assert next(iter(warnings(found, "field"))).startswith("NO WAY IN IS KNOWN")
    assert find_window(made(off_bottom(60, 80, 2), **ways))["answer"].kind == Kind.QUICK_START
    trials = [Trial(SPEED_FIRST, Way.IN, one, rate=10 * RPM) for one in (Outcome.FREE, Outcome.VIBRATES)]
    reached, lost = (confirmed(found["answer"], Trials((one,))) for one in trials)
    assert (reached.kind, reached.way_in.first, reached.is_unreached) == (Kind.QUICK_START, First.SPEED, False)
    assert (lost.kind, lost.is_unreached) == (Kind.HINT, True)


def test_a_setting_below_a_range_without_an_end_comes_before_one_in_it():
    """No rate passes a range that goes on; 90 rpm lies below it, and 100 rpm, which has more
    room around it, in it."""
    endless = off_bottom(91, 91, None)
    endless["off_bottom"]["to"] = None
    ways = {"up": ["wwwwwww"] * 5, "down": ROLLS, "same": ["......w"] * 5}
    answers = [find_window(made(wall, **ways))["answer"] for wall in (endless, off_bottom(91, 200, 49))]
    for one in answers:
        assert (one.kind, one.way_in.first) == (Kind.QUICK_START, First.SPEED)
        assert one.point["rotary_speed"] == pytest.approx(90 * RPM)


def test_a_rise_stops_where_the_bit_does_not_swing_back_to_the_wall():
    """100 rpm, 68 rpm and two tolerances of 6.8 rpm: after a stop the bit swings by 4 s of the rate below 100 rpm."""
    wall = {**WALL, "off_bottom": {**WALL["off_bottom"], "swing": 4.0}}
    line, do, _ = texts(made(wall, up=FREE, down=ROLLS))
    assert "through 60 to 68 rpm at 1.8 to 4.7 rpm/s without a stop" in line
    assert "at 1.8 to 4.7 rpm/s" in do
    near = {**WALL, "off_bottom": {**WALL["off_bottom"], "swing": 30.0}}
    line, do, do_not = texts(made(near, up=FREE, down=ROLLS))
    assert "set 15 klbf at 70 rpm" in line
    assert "off bottom the bit would swing back to 60 to 68 rpm, where the collar reaches the wall" in do
    assert "Do not raise the speed before the weight" in do_not
    started = {"up": ["wwwwwww"] * 5, "down": ROLLS, "same": ["......w"] * 5}
    clear, hint = (find_window(made(one, **started))["answer"] for one in (wall, near))
    assert (clear.kind, hint.kind) == (Kind.QUICK_START, Kind.HINT)
    assert data_of(clear, "rotary_speed")["way_in"]["swing_rate"]["value"] / RPM == pytest.approx(4.72, abs=0.01)
    assert words_of(find_window(made(near, **started)), "field").sentence().startswith("Hint only: ")


def test_trials_order_no_rate_at_which_the_bit_would_swing_back_to_the_wall():
    """All rates are free in trials; the estimates leave 2 to 5 rpm/s of them."""
    way = WayIn(wall=(60 * RPM, 68 * RPM), crosses=True, rate=2 * RPM, swing_rate=5 * RPM)
    tried = tuple(Trial(SPEED_FIRST, Way.IN, Outcome.FREE, rate=one * RPM) for one in (0.2, 1, 2, 3, 5, 10))
    found = came_in(way, Trials(tried))
    assert (found.rate / RPM, found.most / RPM) == pytest.approx((2.0, 5.0))


def test_quickly_always_has_its_number():
    ways = {"up": ["wwwwwww"] * 5, "down": ["wwwwwww"] * 5, "same": ["......w"] * 5}
    known, unknown = (words_of(find_window(made(one, **ways)), "field").sentence() for one in (WALL, None))
    assert "quickly, 1.8 rpm/s or faster" in known
    assert "quickly" not in unknown
    assert "speed first, off bottom" in unknown


def test_where_a_start_at_the_point_vibrates_the_way_in_is_the_one_that_was_run():
    """Off bottom nothing is known, as of a collar on the low side: only the slow way up with the
    weight on was free, and the window says so first."""
    low_side = {**WALL, "off_bottom": None}
    results = made(low_side, up=FREE, down=ROLLS, same=["wwwwwww"] * 5)
    line, do, _ = texts(results)
    assert "Way in: set 15 klbf at 70 rpm, then raise the speed to 100 rpm" in line
    assert do.startswith("Set 15 klbf at 70 rpm. Then raise the speed to 100 rpm")
    told = list(warnings(find_window(results), "field"))
    assert told[0].startswith("STARTED AT THE POINT IT WHIRLS: there it is free only on the slow way from below.")
    free = made(low_side, up=FREE, down=ROLLS, same=["......."] * 5)
    assert "Way in: off bottom raise the speed to 100 rpm, then set 15 klbf." in texts(free)[0]


def test_along_the_weight_there_is_a_way_in_too():
    line, do, _ = texts(made(WALL, along="wob", up=FREE, down=FREE))
    said = "through 60 to 68 rpm at 1.8 rpm/s or faster without a stop, then raise the weight from 10 klbf to 15 klbf"
    assert said in line
    assert "Then raise the weight from 10 klbf to 15 klbf" in do


def test_what_whirls_with_the_weight_raised_is_not_reached_so():
    """It is free from a start at the point alone: the weight is set at once."""
    results = made(WALL, along="wob", up=["wwwwwww"] * 5, down=["wwwwwww"] * 5, same=["......w"] * 5)
    line, do, _ = texts(results)
    found = find_window(results)
    assert "raise the weight" not in line + do
    assert "then set 15 klbf at once." in line
    assert "With the weight raised it whirls; whirl does not stop." in words_of(found, "field").sentence()
    assert "allowed: the run, with the weight raised, or started there, ends well" in "\n".join(
        lines(found, "field", True)
    )
    assert find_window(made(along="wob", down=FREE))["answer"].kind == Kind.NOTHING
    lowered = words_of(find_window(made(along="wob", down=FREE)), "field").sentence()
    assert "Nothing was run with the weight raised." in lowered


@pytest.mark.parametrize(
    ("results", "begins", "line"),
    [
        (
            made({**WALL, "off_bottom": None}, up=["bB....w"] * 5, down=ROLLS, same=["wwwwwww"] * 5),
            "Bring up to 15 klbf and 100 rpm from below, through bit-bounce and whirl; stay at 90 to 120 rpm",
            "to 100 rpm, through bit-bounce at 70 to 80 rpm and whirl at 80 rpm; the map crossed them "
            "slowly; how it ends when crossed faster was not tried (--trials tries it).",
        ),
        (
            made(WALL, up=["sb....w"] * 5, down=ROLLS),
            "Bring up to 100 rpm off bottom, set 15 klbf; stay at 90 to 120 rpm",
            "then set 15 klbf; with the weight on it comes up through bit-bounce at 80 rpm; with the speed first it "
            "was not run (--trials tries it).",
        ),
        (
            made(WALL, along="wob", up=["b", "s", ".", ".", "."], speeds=SPEEDS[3:4]),
            "Raise the weight to 25 klbf, through bit-bounce at 10 klbf and stick-slip at 15 klbf, and",
            "then raise the weight from 10 klbf to 25 klbf, through bit-bounce at 10 klbf and stick-slip at 15 klbf; "
            "the map crossed them slowly; how it ends when crossed faster was not tried (--trials tries it).",
        ),
    ],
)
def test_a_vibration_that_the_way_in_crosses_is_named(results, begins, line):
    found = find_window(results)
    assert words_of(found, "field").sentence().startswith(begins)
    assert texts(results)[0].endswith(line)
    assert ("it was not run" in texts(results)[1]) == ("it was not run" in line), "what is ordered says so, too"
    assert "--trials" not in texts(results)[1]


@pytest.mark.parametrize(
    ("weight", "speed", "first", "rate", "most"),
    [
        ("fff", "vfff", First.SPEED, 3.0, 10.0),  # both ended free: speed first, but not beside what vibrates
        ("vv", "fff", First.SPEED, 0.2, 3.0),
        ("fff", "vvvf", First.WEIGHT, 0.2, 3.0),  # what is free at one rate alone counts for nothing
        ("vv", "vvff", First.SPEED, 3.0, None),  # nor at two, between which nothing was tried
        ("vv", "vvvf", First.SPEED, 3.0, None),  # as it was: the setting is withdrawn
        ("fffv", "vvv", First.WEIGHT, 0.2, 1.0),  # not faster
        ("vv", "fffv", First.SPEED, 0.2, 1.0),  # although no faster one was free
        ("vv", "vffffv", First.SPEED, 3.0, 5.0),
        ("vv", "vfffvv", First.SPEED, 3.0, None),  # of which one rate alone is left
        ("vv", "vvv", First.SPEED, 3.0, None),
    ],
)
def test_trials_decide_on_the_way_in(weight, speed, first, rate, most):
    ends = {"f": Outcome.FREE, "v": Outcome.VIBRATES}
    rates = {6: (0.2, 1.0, 3.0, 5.0, 7.0, 10.0)}
    tried = [
        Trial(name, Way.IN, ends[one], rate=slow * RPM)
        for name, signs in ((WEIGHT_FIRST, weight), (SPEED_FIRST, speed))
        for one, slow in zip(signs, rates.get(len(signs), (0.2, 1.0, 3.0, 10.0)), strict=False)
    ]
    is_other = most is not None and first == First.SPEED
    before = WayIn(First.WEIGHT if is_other else First.SPEED, rate=3.0 * RPM)
    found = came_in(before, Trials(tuple(tried)))
    assert found is not None
    assert (found.first, found.rate) == (first, rate * RPM)
    assert found.most == (None if most is None else most * RPM)


def test_depth_and_one_axis_name_the_weight_that_is_held():
    """Of a sweep of the speed alone the weight is that of the study, and it is named."""
    _, do, _ = texts(made(WALL, up=FREE[:1], down=FREE[:1], weights=[to_si("20 klbf", "N")], speeds=SPEEDS))
    assert "Then set 20 klbf." in do


@pytest.mark.parametrize(
    ("down", "lasts_to", "says"),
    [
        # and not to the 120 rpm above it
        (
            "s.....w",
            None,
            " above the setting: lower to 100 rpm, but not below 90 rpm (at 80 rpm it sticks); "
            "runs lowered to 80 to 100 rpm were free, those brought up there met stick-slip. If any",
        ),
        (
            "s.wwwww",
            None,
            ": lower to 80 rpm, though that is below the limits, but not to 70 rpm, where it sticks "
            "(no room for the 8 rpm to which it is held); runs lowered to 80 rpm were free, those brought up there met "
            "stick-slip. Then pick up and come in again as above. If any",
        ),
        (
            "s.wwwww",
            82,
            ": lower to 80 rpm, though that is below the limits, but not to 70 rpm, where it sticks "
            "(no room for the 8 rpm to which it is held); runs lowered to 80 rpm were free, those brought up there met "
            "stick-slip. Then pick up and come in again as above: stick-slip, once started, "
            "may last to 82 rpm. If any",
        ),
    ],
)
def test_a_vibration_is_lowered_to_the_setting_or_below(down, lasts_to, says):
    results = made(up=["ss....w"] * 5, down=[down] * 5)
    if lasts_to is not None:
        results = told(results, [lasts_to * RPM] * 5)
    orders = Orders(*needed_for_words(find_window(results), "field"))
    assert f"If it whirls{says}" in " ".join(orders.do())


def test_a_period_that_was_not_measured_has_a_least_one():
    """Stick-slip has the period of the torsional mode, or a longer one: a gauge shows it at the surface."""
    seen = Surface(5e3, sticking=(1e3, 9e3), sticking_at=8.0)
    assert period_words(replace(seen, period=4.24)) == " every 4.2 s"
    assert period_words(replace(seen, least_period=3.996)) == " every 3.9 s or more", "never rounded up"
    assert period_words(replace(seen, least_period=12.6)) == " every 12 s or more"
    assert period_words(seen) == ""
    results = made(WALL, up=["ss....."] * 5, down=FREE)
    torque = np.full(results.shape, 5e3)
    torques = {f"surface_torque_{end}": torque for end in ("mean", "min", "max")}
    torques |= {"stick_slip_period": np.full(results.shape, np.nan)}
    by_depth = json.dumps([{"depth": 1e3, "drag": 100.0, "period": 2.0}, {"depth": 9e3, "drag": 100.0, "period": 6.0}])
    for known, words in ((by_depth, " every 4 s or more"), ("[]", "; how often was not measured")):
        found = replace(
            results, variables={**results.variables, **torques}, attrs={**results.attrs, STRING_BY_DEPTH: known}
        )
        line = words_of(find_window(found), "field").lines()[-1]
        assert line.startswith("Surface")
        assert f"kft-lbf{words}" in line


def test_what_repeats_faster_than_torsion_swings_is_no_period_of_stick_slip():
    """Of a bit that bounces as well, the cycles that were counted are those of the bounce."""
    results = made(WALL, up=["ss....."] * 5, down=FREE)
    ends = {"mean": 5e3, "min": 2e3, "max": 8e3}
    torques = {f"surface_torque_{end}": np.full(results.shape, one) for end, one in ends.items()}
    by_depth = json.dumps([{"depth": 5e3, "drag": 100.0, "period": 4.0}])
    attrs = {**results.attrs, STRING_BY_DEPTH: by_depth}
    for measured, words in ((1.9, " every 4 s or more"), (4.26, " every 4.3 s"), (13.0, " every 13 s")):
        seen = {**torques, "stick_slip_period": np.full(results.shape, measured)}
        summary = find_window(replace(results, variables={**results.variables, **seen}, attrs=attrs))
        assert f"kft-lbf{words}." in words_of(summary, "field").lines()[-1]
        surface = data_of(summary["answer"], "rotary_speed")["surface"]
        assert (surface["period"] is None) == (measured < 4.0) == (surface["least_period"] is not None)


def test_a_bit_that_stops_as_it_bounces_tells_nothing_of_stick_slip_at_the_surface():
    """It stops twice a second while the torque at the surface stays within 5 %: torsion does not swing."""
    results = made(WALL, up=["ss....."] * 5, down=FREE)
    ends = {"mean": 5e3, "min": 4.9e3, "max": 5.1e3}
    torques = {f"surface_torque_{end}": np.full(results.shape, one) for end, one in ends.items()}
    by_depth = json.dumps([{"depth": 5e3, "drag": 100.0, "period": 4.0}])
    seen = {**results.variables, **torques, "stick_slip_period": np.full(results.shape, 0.5)}
    summary = find_window(replace(results, variables=seen, attrs={**results.attrs, STRING_BY_DEPTH: by_depth}))
    assert summary["answer"].surface.sticking is None
    assert "stick-slip at" not in words_of(summary, "field").lines()[-1]
