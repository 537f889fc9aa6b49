"""What one page says beside its numbers: why limits are limits, which manner whirls, what shocks mean, and what to do
where nothing is safe."""

from dataclasses import replace

import pytest
from figures.test_wording import FREE, ROLLS, WALL, made

from nsdrill.analysis.advice import Border, Recover, Recovery, Stretch, Surface, data_of
from nsdrill.analysis.trials import SPEED_FIRST, WEIGHT_FIRST, Outcome, Trial, Trials, Way
from nsdrill.analysis.window import find_window
from nsdrill.data import WITHIN, json_text
from nsdrill.units import to_si
from nsdrill.words.answer import needed_for_words, warnings
from nsdrill.words.orders import Orders
from web.test_one_page import NOTHING_BEGINS, of_two, page_of, words

pytestmark = pytest.mark.usefixtures("words_only")

UNTIL = "Until then do not drill ahead: pick up, or circulate, as the office decides."


def rpm(value: float) -> float:
    return to_si(f"{value} rpm", "rad/s")


def orders_of(**changed) -> Orders:
    """The orders of a map that is free from 80 to 120 rpm, with these parts of its answer changed."""
    window = find_window(made(WALL, up=FREE, down=ROLLS))
    return Orders(*needed_for_words({**window, "answer": replace(window["answer"], **changed)}, "field"))


def lowered(at: float, bound: float, low: float) -> Orders:
    found = Recover(Recovery.ENDS, rpm(at), ("whirl",), bound=Border(rpm(bound), None, ("stick_slip",)))
    ends = Stretch(rpm(low), rpm(120), Border(rpm(low - 5), None, ("stick_slip",)), Border(rpm(130), None, ("whirl",)))
    return orders_of(recover=found, stay_within={"rotary_speed": ends})


@pytest.mark.parametrize(
    ("at", "bound", "low", "told"), [(100, 70, 90, True), (100, 95, 80, False), (75, 70, 80, False)]
)
def test_a_lowering_is_bounded_by_what_is_met_first(at, bound, low, told):
    """Orders kept above 90 rpm while a cure led down to 70 rpm. Where the bound is met first, or the vibration ends
    below the limits, that of the lowering stands."""
    orders = lowered(at, bound, low)
    text = orders.not_below()
    assert (f"not below {low} rpm (at {low - 5} rpm it sticks)" in text) == told
    assert (f"not to {bound} rpm, where it sticks" in text) == (not told)
    found = data_of(orders.advice, "rotary_speed")["recover"]
    assert found["not_below"] == ({"rotary_speed": rpm(low)} if told else None), "the data say what the words say"
    assert found["bound"]["at"]["rotary_speed"] == pytest.approx(rpm(low - 5 if told else bound))


def test_trials_beside_held_speeds_say_why_they_differ():
    corner = Trial("corner", Way.CORNER, Outcome.VIBRATES, ("whirl",), speed=rpm(120), wob=to_si("30 klbf", "N"))
    ways = tuple(Trial(name, Way.IN, Outcome.FREE, rate=0.1) for name in (WEIGHT_FIRST, SPEED_FIRST))
    note = "Trials raise and lower the speed or the weight, and vibrate where the map is free, as at"
    said = page_of(made(NOTHING_BEGINS, up=FREE, down=FREE), Trials((*ways, corner)))
    assert note in said
    assert "as at 30 klbf and 120 rpm (\N{MULTIPLICATION SIGN} in the map); what is ordered leaves both out." in said
    assert ", but not at 30 klbf and 120 rpm" in said or "Stay within 80 to 120 rpm" not in said
    assert note not in page_of(made(NOTHING_BEGINS, up=FREE, down=FREE), Trials(ways))


def test_where_nothing_is_safe_the_page_says_what_to_do_until_then():
    said = words(made(WALL, up=["wwwwwww"] * 5, down=["wwwwwww"] * 5))
    assert UNTIL in said
    assert UNTIL not in words(made(WALL, up=FREE, down=ROLLS))


def test_runs_that_failed_are_counted_with_their_file_and_the_report_names_the_command():
    results = made(WALL, up=FREE, down=ROLLS)
    results.variables["status"] = results["status"] * 0 + 3
    said = words(results)
    assert "run again before drilling: of 70 in x.h5 70 failed." in said
    assert "--retry-failed" not in said.partition("DO NOT")[0], "no command for a rig"
    told = " ".join(warnings(find_window(results), "field"))
    assert "nsdrill run --retry-failed STUDY -o FILE runs them again." in told


def test_a_page_of_two_drives_without_trials_says_so():
    assert of_two("stiff", "soft_torque").count("NO TRIALS: ways in and disturbances were not tried.") == 1
    ways = tuple(Trial(name, Way.IN, Outcome.FREE, rate=0.1) for name in (WEIGHT_FIRST, SPEED_FIRST))
    assert "NO TRIALS" not in page_of(made(NOTHING_BEGINS, up=FREE, down=FREE), Trials(ways))


def test_the_frame_says_which_manner_whirls_where_all_as_ordered_are_free():
    """In 5 of 59 ways in it whirls, said a page on which 53 of 53 as ordered were free."""
    rates = [number * to_si("1 rpm/s", "rad/s^2") for number in (2.0, 3.0, 4.0)]
    fast = [Trial(SPEED_FIRST, Way.IN, Outcome.FREE, rate=rate) for rate in rates]
    slow = [Trial(WEIGHT_FIRST, Way.IN, Outcome.VIBRATES, ("whirl",), rate=rate) for rate in rates]
    said = page_of(made(WALL, up=["swwwwww"] * 5, same=["s.....w"] * 5, down=ROLLS), Trials((*fast, *slow)))
    assert "ways in it whirls" not in said
    assert "free; weight first it whirls" in said


def test_shocks_have_what_is_free_what_to_pick_up_at_and_what_whirl_gives():
    """The least of whirl, 4.9 g, stood alone as the alarm, where 0.06 g is free."""
    seen = Surface(3e3, whirling=3e3, acceleration=50.0, least_acceleration=48.0)
    [bare] = [text for text in orders_of(surface=seen).do() if "shocks" in text]
    assert "4.9 g r.m.s. or more is whirl." in bare, "of what the file does not know nothing is said"
    known = replace(seen, free_acceleration=0.6, alarm_acceleration=10.0)
    [text] = [text for text in orders_of(surface=known).do() if "shocks" in text]
    assert "free of vibration 0.061 g r.m.s., in whirl 4.9 g or more; above 1.0 g pick up." in text
    late = replace(known, alarm_acceleration=60.0)
    assert "pick up." not in next(text for text in orders_of(surface=late).do() if "shocks" in text)


def test_the_data_have_the_shocks_too():
    seen = Surface(3e3, free_acceleration=0.6, alarm_acceleration=10.0)
    window = find_window(made(WALL, up=FREE, down=ROLLS))
    found = data_of(replace(window["answer"], surface=seen), "rotary_speed")["surface"]
    assert found["free_acceleration"] == {"lateral_acceleration_rms": 0.6}
    assert found["alarm_acceleration"] == {"lateral_acceleration_rms": 10.0}


def test_each_limit_has_its_reason():
    """The lower limit of what to stay within had none where five other orders come before it."""
    said = words(made(WALL, up=FREE, down=ROLLS))
    assert "Once there, do not go below 80 rpm: at 70 rpm it sticks." in said
    assert "Limits: below 10 klbf, nothing was run." in said, "what an order tells is not told again"


def test_a_range_that_was_given_is_a_reason_a_driller_understands():
    results = made(WALL, up=FREE, down=ROLLS)
    results.attrs[WITHIN] = json_text({"rotary_speed": [rpm(65), rpm(105)]})
    said = words(results)
    assert "the range given to drill in is 65 to 105 rpm" in said
    assert "not drilled, as asked" not in said


def test_where_no_way_in_is_free_nothing_calls_the_best_point_safe_and_the_page_says_in_what_they_ended():
    bad = tuple(
        Trial(name, Way.IN, Outcome.VIBRATES, met, rate=0.1)
        for name, met in (
            (WEIGHT_FIRST, ("whirl",)),
            (SPEED_FIRST, ("bit_bounce", "whirl")),
            (WEIGHT_FIRST, ("whirl",)),
        )
    )
    said = page_of(made(WALL, up=FREE, down=ROLLS), Trials(bad))
    assert "the best point is safe only while" not in said
    assert "what runs show there holds only while nothing brings it to the wall" in said
    assert "No way in ended free in trials: they ended in whirl (2), bit-bounce + whirl (1)." in said
    assert "not free: whirl (2), bit-bounce + whirl (1)." in said
