"""What to stay within and never to exceed, in one meaning for all texts, as maps and trials have
it."""

import re
from dataclasses import replace

import pytest
from figures.test_wording import FREE, ROLLS, SPEEDS, WALL, WEIGHTS, made

from nsdrill.analysis.advice import Advice, Kind, _at_point, best_of, without
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.trials import HELD, HELD_IN_CORNER, OFF_ROCK, SPEED_FIRST, Outcome, Trial, Trials, Way
from nsdrill.analysis.window import find_window
from nsdrill.app.answering.answers import plain_window, with_lasting_motions
from nsdrill.data import STICKS_TO, json_text
from nsdrill.study import parse_study
from nsdrill.web.one_page import Sheet, _numbers
from nsdrill.words.answer import MOST_WARNINGS, needed_for_words, warnings, words_of
from nsdrill.words.orders import Orders

QUICK = ["s..wwww", "s..wwww", "s.....w", "s.....w", "s.....w"]
STARTS = ["......w"] * 5
BOUNCE = {**WALL, "name": "lobe_resonance", "told": "A BOUNCE MAY LAST", "off_bottom": None, "range": None}


def with_starts(from_rest: bool, **ways):
    results = made(WALL, **ways)
    results.attrs[STICKS_TO] = json_text(
        {"over": [], "unstable_to": [None], "lasts_to": [None], "from_rest": from_rest}
    )
    return results


@pytest.mark.parametrize("lightest", ["s.....w", "s...www", "s.....x"])
def test_never_exceed_is_one_number_with_one_reason(lightest):
    """15 klbf goes to 120 rpm, 10 klbf to 100 rpm only, or to where a run failed: sentence, lines, JSON,
    orders and page have the same end, which holds at every weight to stay within."""
    results = made(WALL, up=[lightest, *FREE[1:]], down=ROLLS)
    found = find_window(results)
    advice = found["answer"]
    low, high = advice.stay_within["wob"].low, advice.stay_within["wob"].high
    last, why = Orders(*needed_for_words(found, "field")).exceed("rotary_speed")
    maps = graded(results)
    inside = maps.allowed[0][(maps.values("wob") >= low) & (maps.values("wob") <= high)].all(axis=0)
    most = advice.never_exceed("rotary_speed")
    assert inside[SPEEDS.index(most)]
    assert not inside[SPEEDS.index(most) + 1]
    plain = plain_window(found, "field")["answer"]
    assert plain["never_exceed"] == {"rotary_speed": most}
    assert plain["never_exceed_words"]["rotary_speed"] == f"{last}: {why}"
    do_not = Orders(*needed_for_words(found, "field")).do_not()
    assert f"Do not exceed {last}: {why}." in do_not
    line = words_of(found, "field").lines()[0]
    assert f"Never exceed {last}" in line
    assert why in line
    assert (last, f"never exceed: {why}") in list(_numbers(Sheet(results, "field", "x.h5")))


def at_corner(speed: float, wob: float, *responses: str) -> Trial:
    return Trial(HELD_IN_CORNER, Way.CORNER, Outcome.VIBRATES, responses, speed=speed, wob=wob)


def test_what_to_stay_within_leaves_out_a_corner_that_vibrates_in_trials():
    """From rest it sticks at 30 klbf and 80 rpm: the stretch begins at 90 rpm, and a text says why; of
    the point nothing changes."""
    results = made(WALL, up=FREE, down=ROLLS)
    advice: Advice = find_window(results)["answer"]
    assert (advice.stay_within["rotary_speed"].low, advice.stay_within["wob"].high) == (SPEEDS[1], WEIGHTS[4])
    found = without(graded(results), advice, [at_corner(SPEEDS[1], WEIGHTS[4], "stick_slip")])
    assert (found.point, found.kind) == (advice.point, advice.kind)
    ends = found.stay_within
    assert not (ends["rotary_speed"].low <= SPEEDS[1] and ends["wob"].high >= WEIGHTS[4])
    assert ends["rotary_speed"].below.by_trial
    window = {**find_window(results), "answer": found}
    assert words_of(window, "field").sentence().startswith("Bring up to 15 klbf and 100 rpm from below; stay at 90 to")
    do_not = Orders(*needed_for_words(window, "field")).do_not()
    assert "Once there, do not go below 90 rpm: at 80 rpm and 30 klbf it sticks in a trial." in do_not


def test_a_setting_without_room_beside_what_trials_found_is_a_hint():
    results = made(WALL, up=FREE, down=ROLLS)
    advice: Advice = find_window(results)["answer"]
    place = advice.cell[2]
    bad = [at_corner(SPEEDS[place + step], advice.point["wob"], "stick_slip") for step in (-1, 1)]
    found = without(graded(results), advice, bad)
    assert (found.kind, found.narrow) == ("hint", True)
    assert found.room < 1.0


def test_where_slowly_it_vibrates_within_the_limits_is_named():
    """From a quick start all weights are free up to 120 rpm; slowly the lighter two whirl from 100
    rpm on, and 20 klbf does not."""
    results = with_starts(False, up=QUICK, down=ROLLS, same=STARTS)
    found, maps = find_window(results), graded(results)
    choice = replace(best_of(maps, 0), cell=(0, 2, 3), field=1, is_better=False)
    quick = _at_point(maps, choice)
    assert quick.kind == "quick_start"
    assert quick.slowly == ("whirl",)
    assert quick.slowly_at == {"rotary_speed": SPEEDS[3], "wob": WEIGHTS[1]}
    words = words_of({**found, "answer": quick}, "field")
    assert words.sentence().endswith("10 to 30 klbf. Raised slowly from below 100 rpm it whirls.")
    assert "it whirls at 15 klbf and 100 rpm." in " ".join(words.lines())
    assert len(words.sentence().split()) <= 30


@pytest.mark.parametrize(("from_rest", "said"), [(True, "with the bit at rest"), (False, "quick start")])
def test_a_start_is_named_as_what_was_run(from_rest, said):
    """``initial.bit_speed`` of zero starts the bit at rest: that is no quick start."""
    found = find_window(with_starts(from_rest, up=["wwwwwww"] * 5, down=["wwwwwww"] * 5, same=STARTS))
    (words,) = (words for words in found["grades"] if words.startswith("safe"))
    assert said in words
    assert Grade.FROM_START.words(from_rest) == words
    # what was started at rest shows no quick way in
    assert (found["answer"].kind == Kind.HINT) is from_rest
    sentence = words_of(found, "field").sentence()
    assert ("started with the bit at rest it is free, but no quick way in was run" in sentence) is from_rest
    assert ("quickly" in sentence) is not from_rest
    alone = find_window(with_starts(from_rest, same=STARTS))
    assert ("tarted there with the bit at rest" in words_of(alone, "field").sentence()) is from_rest
    # nor does a file of such starts alone; of a string that turned it is an order, which says what was not run
    assert (alone["answer"].kind == Kind.HINT) is from_rest
    assert "ow it is reached was not run" in words_of(alone, "field").sentence()
    orders = Orders(*needed_for_words(alone, "field"))
    do = " ".join([*orders.do(), *orders.to_confirm()])
    assert ("Find a way in first: to 15 klbf and 90 rpm none was run." in do) is from_rest


def test_what_no_trial_showed_of_the_setting_is_among_the_first_warnings():
    """That nothing tells to which speed stick-slip lasts, and that a bounce may last, come before what
    is said of other points; with trials of both they stand behind."""
    results = made(BOUNCE, up=[*FREE[:4], "s....xx"], down=FREE)
    found = find_window(results)
    first = " ".join(list(warnings(found, "field"))[:MOST_WARNINGS])
    assert "TO WHICH SPEED STICK-SLIP LASTS" in first
    assert "A BOUNCE MAY LAST" in first
    free = [Trial(SPEED_FIRST, Way.IN, Outcome.FREE, rate=1.0)]
    free += [Trial(name, Way.KNOCK, Outcome.FREE) for name in (HELD, OFF_ROCK)]
    tried = {**found, "answer": replace(found["answer"], trials=Trials(tuple(free)))}
    told = list(warnings(tried, "field"))
    assert [text for text in told if text.startswith("TO WHICH SPEED") and "Trials started the setting" in text]
    assert told[0].startswith("FAILED: ")
    failed = [*free[:-1], Trial(OFF_ROCK, Way.KNOCK, Outcome.UNKNOWN)]
    unknown = {**found, "answer": replace(found["answer"], trials=Trials(tuple(failed)))}
    assert next(warnings(unknown, "field")).startswith("A BOUNCE MAY LAST")


@pytest.mark.parametrize("way", ["up", "same"])
def test_whirl_that_was_met_on_any_way_is_not_called_unmet(way):
    """On the way up, or at a start, and not on the way down."""
    ways = {"up": ["ww....."] * 5, "down": ["......."] * 5, "same": ["......."] * 5}
    if way == "same":
        ways = {"up": ["......."] * 5, "down": ["......."] * 5, "same": ["ww....."] * 5}
    words = words_of(find_window(made(WALL, **ways)), "field")
    line = next(one for one in words.lines() if one.startswith("If it"))
    assert re.match("If it whirls: this sweep met that elsewhere, but no run shows what ends it;", line)


def test_a_file_whose_study_is_not_of_this_version_says_what_is_left_out():
    """Critical speeds follow from the study: where it cannot be read, nothing of them is known."""
    results = made(up=FREE, down=FREE)
    attrs = {key: value for key, value in results.attrs.items() if key != "lasting_motions"}
    old = {**attrs, "study_resolved": json_text({"sweep": {"along": "rotary_speed"}, "bit": {"teeth": 3}})}
    told = list(warnings(find_window(with_lasting_motions(replace(results, attrs=old))), "field"))
    assert told[0].startswith("THE STUDY IN THE FILE IS NOT ONE OF THIS VERSION: critical speeds")
    resolved = parse_study("sweep: {rotary_speed: [70 rpm, 80 rpm], procedure: all}").resolved
    whole = with_lasting_motions(replace(results, attrs={**attrs, "study_resolved": json_text(resolved)}))
    assert "NOT ONE OF THIS VERSION" not in " ".join(warnings(find_window(whole), "field"))
