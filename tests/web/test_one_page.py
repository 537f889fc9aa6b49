"""One printed sheet, of maps in which its words can be read off by eye."""

import html
import re
from dataclasses import replace

import numpy as np
import pytest
from analysis.grids import told
from figures.test_wording import FREE, ROLLS, SPEEDS, STICKS, WALL, WEIGHTS, made, with_samples

from nsdrill.analysis.confirmed import confirmed
from nsdrill.analysis.trials import HELD, SPEED_FIRST, WEIGHT_FIRST, Change, Outcome, Trial, Trials, Way
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.foreseen import deciding_in
from nsdrill.data import DAMPING, DAMPING_RATIOS, OVERRIDES, STICKS_TO, WALL_OFF_BOTTOM, WITHIN, Results, json_text
from nsdrill.models.responses import WHIRL
from nsdrill.study.load import parse_study
from nsdrill.units import to_si
from nsdrill.web.one_page import Sheet, _numbers, _without_trip, in_rig_words, one_page
from nsdrill.words.answer import warnings
from nsdrill.words.deciding_words import deciding_words
from nsdrill.words.trial_words import changed_part

pytestmark = pytest.mark.usefixtures("words_only")

NOTHING_BEGINS = {**WALL, "range": None, "min": None, "max": None, "off_bottom": None, "passing_rate": None}


def html_of(results: Results, study: str = "", along: str = "rotary_speed", severity: int | None = None) -> str:
    axis = "[70 rpm, 80 rpm]" if along == "rotary_speed" else "[10 klbf, 15 klbf]"
    resolved = parse_study(f"sweep: {{{along}: {axis}, procedure: all}}\n{study}").resolved
    nowhere = {"over": [], "unstable_to": [0.0], "lasts_to": [0.0], "from_rest": False}  # stick-slip, by the model
    attrs = {STICKS_TO: json_text(nowhere), **results.attrs, "study_resolved": json_text(resolved)}
    page = one_page([Sheet(replace(results, attrs=attrs), "field", "x.h5", severity)], "A4", {"Well": ""})
    return re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL)


def words(results: Results, study: str = "", along: str = "rotary_speed", severity: int | None = None) -> str:
    body = html_of(results, study, along, severity)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", body)).split())


def test_a_collar_that_never_reaches_the_wall_has_a_page():
    """Its motion may last, but no speed is known at which it begins."""
    said = words(made(NOTHING_BEGINS, up=FREE, down=ROLLS))
    assert "none off bottom the collar reaches the wall at no speed that is known" in said
    assert "Off bottom raise the speed to 100 rpm. Then set 15 klbf." in said


def test_box_order_and_prohibition_have_the_same_numbers():
    said = words(made(WALL, up=FREE, down=ROLLS))
    assert "60 to 68 rpm off bottom, pass at 1.8 rpm/s or faster" in said
    assert "through 60 to 68 rpm at 1.8 rpm/s or faster" in said
    assert "Do not stop between 54 rpm and 100 rpm off bottom: the collar goes to the wall at 60 to 68 rpm." in said
    assert "120 rpm never exceed: at 130 rpm it whirls" in said
    assert "Do not exceed 120 rpm: at 130 rpm it whirls." in said


def test_a_wide_range_of_the_wall_is_told_by_where_it_begins():
    """From 60 rpm on the collar goes to the wall at every speed: the other end is that of the map, and says nothing."""
    open_ = {**WALL, "off_bottom": {**WALL["off_bottom"], "to": None, "passing_rate": None, "sure_rate": None}}
    said = words(made(open_, up=FREE, down=ROLLS))
    assert "from 60 rpm up off bottom, do not raise the speed through: the collar reaches the wall" in said
    assert "60 to 68 rpm off bottom, pass at" in words(made(WALL, up=FREE, down=ROLLS))


def test_a_range_below_which_one_stays_is_not_to_be_crossed():
    high = {**WALL, "off_bottom": {key: 2.0 * value for key, value in WALL["off_bottom"].items()}}
    said = words(made(high, up=FREE, down=ROLLS))
    assert "off bottom, do not raise the speed through: the collar reaches the wall" in said
    assert "rpm/s" not in said


def test_a_range_above_the_map_is_a_number_of_the_page():
    high = {**WALL, "off_bottom": {key: 3.0 * value for key, value in WALL["off_bottom"].items()}}
    said = words(made(high, up=FREE, down=ROLLS))
    assert "181 to 203 rpm off bottom the collar reaches the wall: above the map, which ends at 130 rpm" in said


def test_each_weight_has_what_is_ordered():
    said = words(made(WALL, up=["ss..w.w", *FREE[1:]], down=ROLLS))
    assert "Stay within 80 to 120 rpm and 15 to 30 klbf." in said
    assert "ordered [rpm]" in said
    not_ordered = "not ordered; free in the map 90 to 100, 120"
    assert f"10 klbf 80 to 90 whirl 100 to 110, whirl 120 to 130 {not_ordered}" in said
    assert "15 klbf 70 to 80 whirl 120 to 130 80 to 120" in said


def test_the_row_of_the_setting_is_no_wider_than_the_order():
    """At 20 klbf it is free from 80 to 120 rpm, and from below only above 100 rpm: the row said 80 to 120."""
    page = made(WALL, up=FREE, down=["s...www"] * 5)
    said = words(page)
    assert "Stay within 80 to 100 rpm" in said
    assert said.count("whirl 120 to 130 80 to 100") == 5, "all weights are ordered"
    assert "80 to 120" not in said.partition("next limit")[2]


def test_what_is_free_from_a_quick_start_only_is_not_allowed_to_who_brings_up_and_bounds_what_is_brought_up():
    said = words(made(WALL, up=["ss..www", *FREE[1:]], down=ROLLS, same=["....w..", *FREE[1:]]))
    assert (
        "10 klbf 80 to 90 whirl 100 to 110; after a quick start, none from 120 up to 130 not ordered; free in" in said
    )
    assert "free in the map 90 to 100 " in said
    assert "quick start only" not in said
    assert "15 klbf 70 to 80 whirl 120 to 130 80 to 120" in said


def test_the_next_limit_lies_above_what_is_allowed():
    """It whirls from 70 to 80 rpm, from 90 it is free, and at 130 it whirls again."""
    said = words(made(WALL, up=["ww....w", *FREE[1:]], down=ROLLS))
    assert "10 klbf 70 to 80 whirl 120 to 130 90 to 120" in said  # on the way down it sticks at 70 rpm


@pytest.mark.parametrize("within", [{"rotary_speed": (85.0, 105.0)}, {"wob": (14.0, 26.0)}])
def test_a_limit_where_one_does_not_drill_is_one(within):
    """At 10 klbf it whirls at 110 rpm: the page said that there is none up to the end of the map."""
    scales = {"rotary_speed": to_si("1 rpm", "rad/s"), "wob": to_si("1 klbf", "N")}
    ranges = {axis: [scales[axis] * end for end in ends] for axis, ends in within.items()}
    made_up = made(WALL, up=["ss..www", *FREE[1:]], down=ROLLS)
    said = words(replace(made_up, attrs={**made_up.attrs, WITHIN: json_text(ranges)}))
    row = re.search(r"10 klbf 80 to 90 (.*?) 15 klbf|10 klbf 80 to 90 (.*)", said)
    assert row is not None
    assert "whirl 100 to 110" in row[0]
    assert "none up to" not in row[0]


def test_along_the_weight_stick_slip_begins():
    """It sticks at 25 klbf and more, with the weight raised at 70 rpm."""
    page = words(made(along="wob", up=[".", ".", ".", "s", "s"], speeds=SPEEDS[:1]), along="wob")
    assert "20 to 25 klbf stick-slip begins, with the weight raised" in page
    assert "stick-slip begins [klbf]" in page
    assert "70 rpm 20 to 25 stick-slip 20 to 25 10 to 20" in page


def test_limits_above_what_to_stay_within_say_why():
    """From 90 to 100 rpm it is free whatever came before, and to 120 rpm from below only."""
    said = words(made(WALL, up=FREE, down=["s...www"] * 5))
    assert "Stay within 80 to 100 rpm" in said
    assert (
        "Do not exceed 120 rpm: at 130 rpm it whirls; at 110 rpm it is free from below only: coming down it whirls."
        in said
    )


def test_what_would_help_stands_beside_a_hint():
    """No way in ended free in trials: nothing of the setting is ordered, but what was found."""
    ends = (SPEEDS[1], SPEEDS[4])
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", free=(ends,), room=2.8, widest=ends)
    bad = Trial(WEIGHT_FIRST, Way.IN, Outcome.VIBRATES, ("whirl",), rate=1.0)
    resolved = parse_study("sweep: {rotary_speed: [70 rpm, 80 rpm], procedure: all}").resolved
    results = made(WALL, up=FREE, down=ROLLS)
    one = Sheet(replace(results, attrs={**results.attrs, "study_resolved": json_text(resolved)}), "field", "x.h5")
    found = dict(one.window)
    as_it_is = Change("none", "", "", "as it is", room=0.0)
    found["answer"] = confirmed(found["answer"], Trials((bad,), (as_it_is, span), wob=WEIGHTS[1]))
    one.__dict__["window"] = found
    page = " ".join(html.unescape(re.sub(r"<[^>]+>", " ", one_page([one], "A4", {}))).split())
    assert (
        "Have the string changed and run again: stabilisers 30 ft apart, at the next trip, may free 80 to 110 rpm at "
        "15 klbf, untried elsewhere." in page
    )
    assert "Until then do not drill ahead: pick up, or circulate, as the office decides. No way in ended free" in page
    why = "at 15 klbf and 100 rpm, the best, none of 1 way in ended free in trials."
    assert f"Do not drill at any setting of this map: {why}" in page
    assert "none of this map is to drill by: at 15 klbf and 100 rpm none of 1 way in" in page
    assert "free, not ordered [rpm]" in page
    assert page.partition("DO NOT")[0].count("run again: stabilisers 30 ft apart") == 1
    assert "Drill at" not in page
    assert "Then set" not in page
    # what the map tells is of the string as it is, and stands beside a range of another one
    assert "DO NOT, string as it is" in page
    assert page.count("(string as it is)") == len(list(_numbers(one)))
    assert "string as it is, brought up at" in page
    assert not re.search(r"off bottom, (pass|do not raise)", page)
    assert one.orders.lines()[0].startswith("String as it is. Slower: ")
    drive, weight = (replace(span, name=name, key=name) for name in ("drive", "operation.wob"))
    whose = [
        changed_part(Trials((bad,), (as_it_is, change))) for change in (span, drive, replace(weight, name="weight"))
    ]
    assert whose == ["string", "drive", "weight"]
    assert changed_part(Trials((bad,), (as_it_is,))) == ""


@pytest.mark.parametrize(("of_drive", "share", "told"), [("free", 1.0, True), ("vibrates", 0.0, False)])
def test_what_takes_no_trip_is_told_where_its_trials_bear_it(of_drive, share, told):
    """A drive of lower rank than the stabilisers: named beside them unless none of its ways in is free."""
    ends = (SPEEDS[0], SPEEDS[-1])
    way = Trial(WEIGHT_FIRST, Way.IN, Outcome.FREE, rate=1.0)
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", free=(ends,), room=4.0, widest=ends, trials=(way,))
    drive = replace(
        span, name="drive", words="soft torque", room=1.5, trials=(replace(way, outcome=Outcome(of_drive)),)
    )
    tried = Trials(changes=(Change("none", "", "", "as it is", room=0.0), span, drive))
    assert tried.best == span
    assert drive.share == share
    found = _without_trip(tried)
    assert (found == drive) == told
    assert _without_trip(Trials(changes=(tried.changes[0], drive))) is None, "it is the best itself"


def test_where_nothing_is_allowed_nothing_is_to_be_passed():
    said = words(made(WALL, up=STICKS, down=ROLLS))
    assert "70 to 110 rpm stick-slip on the way up, at one weight or another" in said
    assert "pass" not in said
    assert "never exceed" not in said
    said = words(made(WALL, up=["sssssss"] * 5, down=ROLLS))
    assert "10 klbf above 130 not free up to 130, where the map ends none" in said, "it sticks to the end of the map"


def test_what_is_free_on_the_way_up_is_not_said_to_stick():
    """At one weight it sticks to 80 rpm, and from there stick-slip may last, once started."""
    results = told(made(WALL, up=["ss....."], down=["ss....."], weights=WEIGHTS[:1]), [SPEEDS[-1]])
    said = words(results)
    assert "stick-slip at 70 to 80 rpm, stick-slip may last at 90 to 130 rpm" in said
    assert "Do not run at 70 to 80 rpm: there it sticks." in said
    assert "Do not run at 90 to 130 rpm: stick-slip, once started, may last there." in said
    assert "90 to 130 rpm stick-slip, once started, may last" in said


@pytest.mark.parametrize(("mild", "order"), [(7, "Have the assembly"), (1, "Have the assembly")])
def test_a_hint_is_not_ordered_and_no_option_of_the_command_is_printed(mild, order):
    """Light whirl over the whole map, or at one speed, where it leaves no room: neither is free of it."""
    results = made(WALL, up=["wwwwwww"] * 5)
    for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
        results.variables[name] = np.zeros(results["response"].shape, np.int8)
    results.variables["whirl_severity"][:] = 4
    results.variables["whirl_severity"][..., :mild] = 1
    said = words(results)
    assert order in said
    assert "--severity" not in said
    assert "hint only" not in said


def test_what_is_not_known_is_no_none():
    """Runs that failed do not show that there is no stick-slip."""
    said = words(made(WALL, up=["xxxxxxx"] * 5))
    assert "No answer: of no point is enough known" in said
    assert "Have the runs that failed or are missing run again before drilling: of " in said
    assert "Do not drill by this page" in said
    assert "10 klbf not known not known from 70 not known" in said
    assert "none" not in said


def test_a_sheet_speaks_of_the_vibrations_of_its_model_alone():
    results = made(NOTHING_BEGINS, up=FREE, down=FREE)
    said = words(replace(results, attrs={**results.attrs, "model": "torsion"}), "model: torsion")
    assert "NOT IN THE MODEL: torsion has no bit-bounce and no whirl, so none was looked for." in said
    assert "These decide, as by default: torsional damping and bit friction." in said
    assert "the collar reaches the wall" not in said
    assert "NOT IN THE MODEL" not in words(results)


@pytest.mark.parametrize("kind", ["ideal", "soft_torque"])
def test_the_head_is_in_words_of_a_rig(kind):
    """Hole size, bit and inclination are there however long the rest is; an ideal drive is
    what a rig assumes."""
    study = f"""
operation: {{depth: 9500 ft}}
well: {{diameter: 12.25 in, inclination: 30 deg}}
bit: {{lobes: 3, surface_amplitude: 1 mm}}
drive: {{kind: {kind}}}
drillstring: {{eccentricity: 2 mm}}
"""
    said = words(made(WALL, up=FREE, down=ROLLS), study)
    for text in ("depth 9500 ft", "well diameter 12.25 in", "bit lobes 3", "well inclination 30 deg"):
        assert text in said
    assert "more in the report" not in said
    assert ("drive kind" in said) == (kind != "ideal")
    assert "--" not in said


def test_what_was_changed_for_the_runs_is_in_the_head():
    """Two pages of one well looked alike: the damping by which they differed was among what was left out."""
    results = made(WALL, up=FREE, down=ROLLS)
    study = "drillstring: {axial_damping: 9467 lbf*s/ft}"
    assert "(changed for this run)" not in words(results, study)
    given = json_text(["drillstring.axial_damping=9467 lbf*s/ft", "simulation.transient=120 s"])
    said = words(replace(results, attrs={**results.attrs, OVERRIDES: given}), study)
    assert "axial damping 9467 lbf*s/ft (changed for this run)" in said
    assert said.count("(changed for this run)") == 1


@pytest.mark.parametrize(
    ("up", "lasts", "number", "row"),
    [
        ("ss.....", None, "80 to 90 rpm stick-slip ends, on the way up at 15 klbf", "15 klbf 80 to 90 none up to 130"),
        # at 90 rpm, free on the way up, it may last once it has started
        (
            "ss.....",
            "95 rpm",
            "90 to 100 rpm stick-slip, once started, lasts to here at 15 klbf",
            "15 klbf 90 to 100 none up to 130",
        ),
        (".......", None, "none no stick-slip is known at 15 klbf, from 70 rpm up", "15 klbf none none up to 130"),
    ],
)
def test_where_stick_slip_ends_stands_in_the_numbers_and_by_weight(up, lasts, number, row):
    results = made(WALL, up=[up] * 5, down=["......."] * 5)
    if lasts is not None:
        found = {"over": [], "unstable_to": [0.0], "lasts_to": [to_si(lasts, "rad/s")], "from_rest": False}
        results.attrs[STICKS_TO] = json_text(found)
    said = words(results)
    assert number in said
    assert row in said


def test_the_order_and_the_box_of_samples_have_one_limit():
    """It is free in all samples to 100, in nine tenths to 110 rpm, where a step to 110 rpm may jump; the samples
    scatter beside that limit, not in its place."""
    one = with_samples([[1, 1, 1, 1, 0.95, 0.8, 0]] * 5)
    for lasting in ([], [{**WALL, "jumped": {"from": SPEEDS[3], "to": SPEEDS[4], "step": 1.0, "enough": 0.1}}]):
        said = words(replace(one, attrs={**one.attrs, "lasting_motions": json_text(lasting)}))
        last = "100" if lasting else "110"
        assert f"Do not exceed {last} rpm:" in said
        assert f"{last} rpm never exceed: at " in said
        assert "the last that is allowed at 15 klbf in 5 to 95 % of 20 samples: 100 to 120 rpm" in said
        assert said.count("never exceed") == 1


def test_where_stick_slip_ends_in_samples_and_where_every_weight_sticks():
    assert "none stick-slip at 15 klbf: none in 95 % of 20 samples" in words(with_samples([[0, 0, 1, 1, 1, 1, 0]] * 5))
    said = words(made(WALL, up=["sssssss"] * 5))
    assert "Nothing is safe: stick-slip at 70 to 130 rpm" in said
    assert "15 klbf above 130" in said


def test_a_drive_that_is_slower_than_the_way_in_asks_has_an_order():
    said = words(made(WALL, up=FREE, down=ROLLS))
    assert "If the drive is slower: do not use this setting." in said


def test_a_hint_tells_the_rig_of_no_runs():
    said = words(made(up=["sss.www"] * 5))
    hint = said.index(
        "as a hint only: a small change of weight or speed may make it vibrate. TO CONFIRM, not to drill by"
    )
    assert hint < said.index("Off bottom raise the speed to 100 rpm.")
    assert said.count("TO CONFIRM, not to drill by") == 2, "above the headline, and above the way in"
    assert "to confirm [rpm]" in said
    assert "have a finer map" not in said


def page_of(results: Results, found: Trials) -> str:
    """The words of the page of a map after these trials."""
    resolved = parse_study("sweep: {rotary_speed: [70 rpm, 80 rpm], procedure: all}").resolved
    one = Sheet(replace(results, attrs={**results.attrs, "study_resolved": json_text(resolved)}), "field", "x.h5")
    window = one.window
    one.__dict__["window"] = {**window, "answer": confirmed(window["answer"], found)}
    body = re.sub(r"<style>.*?</style>", "", one_page([one], "A4", {}), flags=re.DOTALL)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", body)).split())


def tried_ways(bad_of_weight: int = 0) -> tuple[Trial, ...]:
    """Three ways in with the weight first, of which so many whirl, and three free ones with the speed first."""
    rates = [number * to_si("1 rpm/s", "rad/s^2") for number in (0.2, 1.0, 3.0)]
    free = [Trial(name, Way.IN, Outcome.FREE, rate=rate) for name in (WEIGHT_FIRST, SPEED_FIRST) for rate in rates]
    bad = [replace(one, outcome=Outcome.VIBRATES, responses=("whirl",)) for one in free[:bad_of_weight]]
    return (*bad, *free[bad_of_weight:])


def test_a_setting_that_whirls_after_a_disturbance_says_so_among_the_orders():
    """It stood below in small print only, beside ways in that were all free."""
    held = Trial(HELD, Way.KNOCK, Outcome.VIBRATES, ("whirl",))
    said = page_of(made(NOTHING_BEGINS, up=FREE, down=FREE), Trials((*tried_ways(), held)))
    order = "Expect it after a disturbance, as in trials: the bit held and let go, it whirls."
    assert said.index("If it whirls") < said.index(order) < said.index("DO NOT")
    assert "DISTURBED IN TRIALS" not in said, "it is said once"


@pytest.mark.parametrize(("bad", "told"), [(0, False), (1, True), (2, True)])
def test_an_order_of_ways_in_that_failed_is_not_to_be_taken(bad, told):
    """One of three was said in small print only; the other order ended free at every rate."""
    said = page_of(made(NOTHING_BEGINS, up=FREE, down=FREE), Trials(tried_ways(bad)))
    order = f"Do not set the weight before the speed: in trials {bad} of 3 such ways in ended in vibration."
    assert (order in said) == told


def test_a_page_of_two_files_has_the_answer_of_both():
    resolved = parse_study("sweep: {rotary_speed: [70 rpm, 80 rpm], procedure: all}").resolved
    both = [made(WALL, up=FREE, down=down) for down in (ROLLS, FREE)]
    both = [replace(one, attrs={**one.attrs, "study_resolved": json_text(resolved)}) for one in both]
    sheets = [Sheet(one, "field", "x.h5") for one in both]
    page = " ".join(html.unescape(re.sub(r"<[^>]+>", " ", one_page(sheets, "A4", {}, ["old", "new"]))).split())
    assert f"new: {sheets[1].orders.sentence()}" in page


def of_two(study: str, other: str, down: tuple[list[str], list[str]] = (ROLLS, FREE), up: list[str] = FREE) -> str:
    """The words of the page of two files with these drives, the second brought ``up`` so."""
    sheets = []
    for drive, one in ((study, made(WALL, up=FREE, down=down[0])), (other, made(WALL, up=up, down=down[1]))):
        text = f"sweep: {{rotary_speed: [70 rpm, 80 rpm], procedure: all}}\ndrive: {{kind: {drive}}}"
        resolved = json_text(parse_study(text).resolved)
        sheets.append(Sheet(replace(one, attrs={**one.attrs, "study_resolved": resolved}), "field", "x.h5"))
    body = re.sub(r"<style>.*?</style>", "", one_page(sheets, "A4", {}), flags=re.DOTALL)
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", body)).split())


def test_each_of_two_drives_has_its_orders_and_a_sentence_on_switching():
    """The orders were those of the stiff drive, without a word for which drive they hold."""
    said = of_two("stiff", "soft_torque")
    first, second = said.index("DO \N{EN DASH} stiff drive only"), said.index("DO \N{EN DASH} soft torque drive only")
    assert first < said.index("DO NOT \N{EN DASH} stiff drive only") < second
    assert second < said.index("DO NOT \N{EN DASH} soft torque drive only")
    assert second < said.index("Soft torque on. "), "only where it is on"
    assert "When the soft torque is switched off or on, or fails: from then on the other orders hold." in said
    assert "10 to 30 klbf and 80 to 120 rpm is ordered with both" in said


def test_a_drive_for_which_nothing_is_ordered_says_what_to_do_when_it_is_switched():
    said = of_two("soft_torque", "stiff", up=["wwwwwww"] * 5)
    assert "nothing is ordered to drill by with the stiff drive. Pick up and stop the rotation." in said
    assert "switched" not in of_two("stiff", "stiff"), "no drive is switched"


def of_wall(low_side: str | None = None, ends: tuple[float, float | None] | None = None) -> dict:
    found = None if ends is None else {"axis": "rotary_speed", "from": ends[0], "to": ends[1]}
    return {WALL_OFF_BOTTOM: json_text({"low_side": low_side, "range": found})}


@pytest.mark.parametrize(
    ("attrs", "said"),
    [
        ({}, "not known at which speeds off bottom the collar reaches the wall"),
        (of_wall(), "none off bottom the collar reaches the wall at no speed that is known"),
        (of_wall(ends=(7.0, 7.3)), "66 to 70 rpm off bottom the collar reaches the wall"),
        (of_wall(ends=(7.0, None)), "above 66 rpm off bottom the collar reaches the wall"),
        (of_wall("everywhere"), "at every speed the collar lies on the low side of the hole"),
    ],
)
def test_where_the_collar_is_at_the_wall_is_known_of_starts_too(attrs, said):
    """Nothing was brought up, so that there is no way in, but the study tells where the wall is."""
    results = made(same=FREE)
    page = words(replace(results, attrs={**results.attrs, **attrs}))
    assert said in page
    assert ("THE COLLAR LIES ON THE LOW SIDE of the hole at every speed" in page) == ("low side" in said)


def test_one_page_of_many_starts_brings_nothing_up():
    one = made(same=[*FREE[:4], "......w"])
    coords = {**one.coords, "start": np.arange(4)}
    variables = {name: np.repeat(values[..., None], 4, axis=-1) for name, values in one.variables.items()}
    variables["response"][0, 0, :4, 1:, 3] = WHIRL
    page = words(Results(coords, variables, one.attrs))
    assert "only some starts free, " in page
    for never in ("Bring up", "bring up", "coming down", "from below"):
        assert never not in page


_STEP = to_si("10 rpm", "rad/s")
JUMPED = {"from": 7.5 * _STEP, "to": 8.5 * _STEP, "enough": 0.1, "step": _STEP}


def test_steps_that_may_jump_are_in_the_table_the_map_and_the_warnings():
    """Above steps of 10 rpm over speeds at which the collar reaches the wall nothing is known of a string that is
    brought up."""
    said = words(made({**WALL, "jumped": JUMPED}, up=["......."] * 5, down=ROLLS))
    assert "15 klbf 70 to 80 (?) not known above 70 90 to 120" in said
    assert "to confirm [rpm]" in said
    assert "(?) not known to be free when brought up: steps of 10 rpm may jump across whirl at 75 to 85 rpm." in said
    assert "STEPS OF 10 rpm MAY JUMP" in said
    assert "(?)" not in words(made(WALL, up=["......."] * 5, down=ROLLS))


def test_a_quick_start_that_the_map_outlines_is_in_the_table_of_a_hint_too():
    said = words(made(WALL, up=["s.wwwww", *["sswwwww"] * 4], same=["s.w....", *["sss...."] * 4]))
    assert (
        "15 klbf 90 to 100 whirl from 90; after a quick start, none from 100 up to 130 100 to 130 (quick start only)"
        in said
    )


def test_each_limit_of_quick_starts_is_told_though_the_last_of_them_is_free():
    """Two of four quick starts above 100 rpm whirl, as two of all above 90 rpm do beside a speed that is free."""
    said = words(made(WALL, up=["s.wwwww"] * 5, same=["s.w.w.w", "s.w.w..", *["s.w...."] * 3]))
    assert "10 klbf 70 to 80 whirl 80 to 90; after a quick start, whirl 100 to 110, 120 to 130" in said
    assert "15 klbf 70 to 80 whirl 80 to 90; after a quick start, whirl 100 to 110 not ordered; free in" in said
    assert "after a quick start, none from 100 up to 130" in said


@pytest.mark.parametrize("by_model", [True, False])
def test_the_end_of_stick_slip_does_not_depend_on_how_far_whirl_was_swept(by_model):
    """The friction of a collar that whirls makes the bit stick and slip from 120 rpm on, far above the end of
    stick-slip; where whirl joins stick-slip, that goes on."""
    for line in ("ss..www", "ss..wSS"):
        results = made(WALL, up=["sssSSSS", *[line] * 4], down=["sssSSSS", *["swwwwSS"] * 4])
        said = words(told(results, [to_si("78 rpm", "rad/s")] * 5) if by_model else results)
        assert "15 klbf 80 to 90 whirl 100 to 110 90 to 100" in said
        assert "10 klbf above 130 not free up to 130, where the map ends none" in said
        assert "80 to 90 rpm stick-slip ends, on the way up at" in said


def test_stick_slip_that_gives_way_to_whirl_has_not_ended():
    """The model says that it lasts to 115 rpm, where the way up whirls from 90 rpm on; without the model its end is
    not known, as the warning says; it was met to 110 rpm, where starts at the points stick."""
    results = made(WALL, up=["sswwwww"] * 5, same=["sssss.."] * 5)
    said = words(told(results, [to_si("115 rpm", "rad/s")] * 5))
    assert "15 klbf 110 to 120 whirl from 90" in said
    assert "80 to 90" not in said
    unknown = words(told(results, [None] * 5))
    assert "15 klbf not known, met at 110 when started there whirl from 90" in unknown
    assert "not known to which speed stick-slip, once started, lasts at" in unknown
    assert "TO WHICH SPEED STICK-SLIP LASTS is not known" in unknown


def test_a_row_in_which_no_run_sticks_is_one_without_stick_slip_only_where_the_model_says_so():
    """It whirls at all speeds, so that nothing is allowed; stick-slip may last all the same."""
    whirls = made(WALL, up=["wwwwwww"] * 5)
    assert "15 klbf none met whirl" in words(told(whirls, [None] * 5))
    assert "15 klbf none whirl" in words(told(whirls, [0.0] * 5))


def test_the_next_limit_names_what_the_map_paints_there():
    """At 90 rpm the way up whirls, and a start there sticks."""
    said = words(told(made(WALL, up=["s.w...."] * 5, same=["s.s...."] * 5), [to_si("95 rpm", "rad/s")] * 5))
    assert "stick-slip may last from" not in said
    assert "15 klbf 90 to 100 " in said


@pytest.mark.parametrize("inclination", ["0 deg", "30 deg"])
def test_an_inclined_hole_without_drag_says_that_the_torque_is_more(inclination):
    said = words(made(WALL, up=FREE, down=ROLLS), f"well: {{inclination: {inclination}}}")
    assert ("NO DRAG ALONG THE HOLE is in the model" in said) == (inclination == "30 deg")


@pytest.mark.parametrize("begins_above", [False, True])
def test_a_damping_that_decides_is_printed_of_a_hint_too(begins_above):
    """With a usual one stick-slip lasts to 95 rpm, within what to stay within, whatever makes it a hint."""
    passed = {**NOTHING_BEGINS, "min": 1.0, "max": 1.0, "from": SPEEDS[0], "everywhere": True}
    ends = [{"wob": wob, "at": {}, "now": 6.0, "usual": to_si("95 rpm", "rad/s")} for wob in WEIGHTS]
    damping = {"key": "drillstring.torsional_damping", "value": 50.0, "usual": 20.0, "ratio": 0.08}
    one = made(passed if begins_above else WALL, up=["......w"] * 5, down=FREE)
    damped = {DAMPING: json_text({**damping, "is_default": False, "lasts": ends})}
    said = words(replace(one, attrs={**one.attrs, **damped}))
    assert ("nothing was brought up through" in said) == begins_above
    assert "THE DAMPING OF TORSION IS UNUSUAL" in said


def test_a_rig_page_names_quantities_in_words():
    said = in_rig_words(
        "A: drillstring.torsional_damping is one number. Model digest: model digest 0123ab there, 45cd here."
    )
    assert said == "A: torsional damping is one number. Model digest: the equations of the model have changed."


def test_a_vibration_is_not_lowered_to_where_it_vibrates_again():
    """On the way down the whirl of 110 rpm has ended at 100 rpm, and at 90 rpm it sticks."""
    said = words(made(up=["ss.....", *["......."] * 2], down=["sss.www"] * 3, weights=WEIGHTS[:3]))
    assert "lower to 100 rpm" in said
    assert "not to 90 rpm, where it sticks" in said
    assert "runs lowered to 100 rpm were free" in said


def test_si_is_rounded_to_what_can_be_held():
    one = Sheet(made(up=FREE, down=FREE), "si", "x.h5")
    assert one.orders.setting() == "67 kN and 10.5 rad/s (100 rpm)"
    assert one.orders.ends("rotary_speed") == "8.4 to 12.5 rad/s (80.2 to 119 rpm)"


def test_a_quick_start_says_from_where_not_to_raise_slowly():
    """It whirls from 90 rpm on, where it is brought up; started above that it is free."""
    said = words(made(WALL, up=["ss..www"] * 5, down=ROLLS, same=["ssss..."] * 5))
    one = Sheet(made(WALL, up=["..wwwww"] * 5, down=ROLLS, same=["......w"] * 5), "field", "x.h5")
    assert "from below 90 rpm" in " ".join(one.orders.do_not()), (one.orders.sentence(), one.orders.do_not())
    assert said


@pytest.mark.parametrize(("severity", "up"), [(3, ["sbbbbbb"] * 5), (4, ["sbbbbbb"] * 5), (3, ["s..b..b"] * 5)])
def test_the_page_of_a_severity_is_not_green_and_says_that_vibration_is_allowed(severity, up):
    """Strong bit-bounce in every run, or beside the setting. Asked for more, the table allows no more than the
    answer: above 56 rpm, never to be exceeded, it had "none up to 140"."""
    results = made(WALL, up=up, down=up)
    for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
        results.variables[name] = np.where(np.asarray(results["response"]) > 0, 3, 0).astype(np.int8)
    results.variables["stick_slip_severity"][..., 0] = 4
    page, said = html_of(results, severity=severity), words(results, severity=severity)
    assert "class='answer no'" in page
    assert "operating limits for vibration: strong vibration allowed" in said
    assert "STRONG VIBRATION ALLOWED" in said
    if "." not in up[0]:
        assert "allowed, not ordered [rpm]" in said
        assert "it bounces in every run, strong at most" in said
        assert not re.search(r"\bfree\b|\bsteady\b|never exceed|come in again|Drill at ", said)


SECTIONS = """
drillstring:
  sections:
    - {outer_diameter: 5.5 in, inner_diameter: 4.778 in}
    - {length: 840 ft, outer_diameter: 5.5 in, inner_diameter: 3.25 in}
    - {length: 360 ft, outer_diameter: 8 in, inner_diameter: 2.8125 in}
  collar: {span: 60 ft}
  torsional_damping: 30 N*m*s/rad
mud: {density: 10.4 ppg}
well: {diameter: 12.25 in, inclination: 30 deg, axial_friction: true}
operation: {depth: 9200 ft}
"""


def test_the_head_names_the_string_and_the_mud():
    """A sheet that is signed left them out as other numbers. The weights are those of API RP 7G, plain end."""
    said = words(made(WALL, up=FREE, down=ROLLS), SECTIONS)
    pipe, heavy = "pipe 5.5 by 4.778 in (19.8 lb/ft)", "840 ft of 5.5 by 3.25 in (52.6 lb/ft)"
    assert f"string: {pipe}, {heavy}, 360 ft of 8 by 2.812 in (150 lb/ft)" in said
    assert "mud density 10.4 ppg" in said
    lumped = words(made(WALL, up=FREE, down=ROLLS), "drillstring: {collar: {length: 600 ft}, pipe: {weight: 18 lb/ft}}")
    assert "(18 lb/ft), 600 ft of collars " in lumped


def test_an_option_that_was_changed_is_named_in_the_head_and_what_it_leaves_out_below():
    """The friction along the hole that the collar has stood beside NO DRAG ALONG THE HOLE, and not in the head."""
    results = made(WALL, up=FREE, down=ROLLS)
    given = json_text(["well.axial_friction=true", "drillstring.sections=[]", "drillstring.nowhere=3"])
    said = words(replace(results, attrs={**results.attrs, OVERRIDES: given}), SECTIONS)
    assert "well axial friction on (changed for this run)" in said
    assert "(150 lb/ft) (changed for this run)" in said
    assert "drillstring nowhere 3 (changed for this run)" in said
    assert "NO DRAG ALONG THE HOLE" not in said
    assert "NO DRAG OF THE STRING ABOVE THE COLLAR is in the model" in said
    assert "where less comes than is slacked off" in said


def test_the_damping_of_torsion_has_its_ratio_beside_it():
    one = made(WALL, up=FREE, down=ROLLS)
    said = words(replace(one, attrs={**one.attrs, DAMPING_RATIOS: json_text([0.031, 0.039])}), SECTIONS)
    assert "torsional damping 22.13 ft-lbf s/rad (ratio 0.031 to 0.039);" in said


def test_the_numbers_that_decide_are_those_that_act_on_the_vibrations_of_the_bit():
    """Over lobes their height and the axial damping decided, by default of no well, and were not named; without lobes
    nothing of that does."""
    cone = "bit: {lobes: 3, friction: {static: 0.2, dynamic: 0.1}}\ndrillstring: {eccentricity: 2 mm}"
    said = words(made(WALL, up=FREE, down=ROLLS), cone)
    assert "Estimates of eccentricity and bit friction decide. So do these, as by default: added mass of" in said
    assert "torsional damping, lobe height, axial damping and rock stiffness." in said
    given = words(made(WALL, up=FREE, down=ROLLS), f"{cone[:-1]}, axial_damping: 138 kN*s/m}}")
    assert "bit friction, axial damping" not in given
    assert re.search(r"Estimates of [^.]*axial damping[^.]* decide", given)
    pdc = words(made(WALL, up=FREE, down=ROLLS), "bit: {lobes: 1, surface_amplitude: 0 mm}")
    assert "These decide, as by default: eccentricity, " in pdc
    assert "lobe height" not in pdc
    assert "rock stiffness and" not in pdc
    stabilised = words(made(WALL, up=FREE, down=ROLLS), "stabilizer: {clearance: 3 mm}")
    assert "Estimates of stabiliser clearance decide." in stabilised


@pytest.mark.parametrize(
    ("study", "decide"),
    [
        ("model: segments\nbit: {surface_amplitude: 0 mm}", "bit friction, damping of the steel and mud viscosity."),
        ("model: segments\nbit: {friction: {level: 0.3}}", "Estimates of bit friction decide."),
        ("model: regenerative\nbit: {wear_length: 1 mm}", "Estimates of wear decide. So do these, as by default: "),
        ("well: {axial_friction: true}\nbit: {lobes: 1, surface_amplitude: 0 mm}", "rock stiffness and axial damping."),
        ("bit: {rock: {law: regenerative}}", "strength of the rock, direction of the cutting force, wear"),
        ("modes: {lateral: frozen}\nbit: {lobes: 1, surface_amplitude: 0 mm}", "torsional damping and bit friction."),
    ],
)
def test_each_model_has_its_own_numbers_that_decide(study, decide):
    attrs = {"study_resolved": json_text(parse_study(study).resolved)}
    said = deciding_words(deciding_in(attrs), ("whirl", "stick_slip", "bit_bounce"))
    assert decide in said, said


@pytest.mark.parametrize(("study", "is_told"), [("", False), ("stabilizer: {clearance: 3 mm}", True)])
def test_stabilisers_with_sag_say_that_the_speeds_of_the_wall_are_an_estimate(study, is_told):
    results = made(WALL, up=FREE, down=ROLLS)
    wall = json_text({"low_side": None, "range": {"from": 6.0, "to": 7.0}})
    attrs = {
        WALL_OFF_BOTTOM: wall,
        "study_resolved": json_text(parse_study(f"well: {{inclination: 5 deg}}\n{study}").resolved),
    }
    said = " ".join(warnings(find_window(replace(results, attrs={**results.attrs, **attrs})), "field"))
    assert ("THE SPEEDS OF THE WALL ARE AN ESTIMATE" in said) == is_told
