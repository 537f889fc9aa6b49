"""What trials confirm and withdraw: the verdicts of trials that are made up."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from nsdrill.analysis.advice import (
    Advice,
    First,
    Kind,
    Recover,
    Recovery,
    Share,
    Stretch,
    WayIn,
    advise,
    data_of,
    without,
)
from nsdrill.analysis.advice import Border as Beyond
from nsdrill.analysis.confirmed import confirmed
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.trials import (
    HELD,
    HELD_IN_CORNER,
    OFF_ROCK,
    ON_WALL,
    SLOWED,
    SPEED_FIRST,
    TAGGED,
    TO_CORNER,
    WEIGHT_FIRST,
    Change,
    Outcome,
    Robust,
    Trial,
    Trials,
    Way,
    free_from,
)
from nsdrill.words import trial_words
from nsdrill.words.orders import Orders
from nsdrill.words.values import Formatter
from nsdrill.words.wording import MOST_WORDS, Words, is_short

from .grids import grid

RPM, KLBF = math.pi / 30, 4448.2216152605
FIELD = Formatter("field")
OF_SPEED = "rotary_speed", FIELD
FREE, VIBRATES, STALLED, UNKNOWN = Outcome
POINT = Advice(
    Kind.FROM_BELOW,
    Grade.FROM_BELOW,
    point={"wob": 100e3, "rotary_speed": 100 * RPM},
    stay_within={"rotary_speed": Stretch(85 * RPM, 115 * RPM, Beyond(80 * RPM), Beyond(120 * RPM))},
    recover=Recover(Recovery.NOT_MET),
)


RATES = {4: (0.2, 1.0, 3.0, 10.0), 5: (0.2, 1.0, 3.0, 5.0, 10.0), 6: (0.2, 0.5, 1.0, 3.0, 5.0, 10.0)}  # rpm/s


def ways(weight: str, speed: str) -> tuple[Trial, ...]:
    """Ways in, the slower first: ``.`` free, ``w`` whirl, ``x`` failed."""
    outcomes = {".": (FREE, ()), "w": (VIBRATES, ("whirl",)), "x": (UNKNOWN, ())}
    return tuple(
        Trial(name, Way.IN, *outcomes[sign], rate=rate * RPM)
        for name, signs in ((WEIGHT_FIRST, weight), (SPEED_FIRST, speed))
        for rate, sign in zip(RATES.get(len(signs), RATES[4]), signs, strict=False)
    )


def knock(outcome: Outcome, responses: tuple[str, ...] = ("whirl",), name: str = ON_WALL, speed: float = 100) -> Trial:
    after = ON_WALL if name == SLOWED else ""
    return Trial(name, Way.KNOCK, outcome, () if outcome == FREE else responses, speed=speed * RPM, after=after)


def sentence(advice: Advice) -> str:
    return Words(advice, ("rotary_speed", "wob"), "field", ("up", "down")).sentence()


def test_no_way_in_free_withdraws():
    for weight, speed in (("www", "wwww"), ("xxx", "wwww"), ("xxx", "xxxx")):
        found = confirmed(POINT, Trials(ways(weight, speed)))
        assert found.kind == Kind.HINT
        assert "none of 7 ways in ended free" in sentence(found)
        assert "Bring up" not in sentence(found)


@pytest.mark.parametrize("outcome", [VIBRATES, STALLED])
def test_a_setting_where_a_trial_vibrates_or_stalls_is_not_safe_after_any_history(outcome):
    safest = replace(POINT, kind=Kind.ANY_HISTORY, grade=Grade.ANY_HISTORY)
    found = confirmed(safest, Trials((*ways("...", "...."), knock(outcome))))
    assert (found.kind, found.grade) == (Kind.FROM_BELOW, Grade.FROM_BELOW_ONLY)
    free = confirmed(safest, Trials((*ways("...", "...."), knock(FREE))))
    assert (free.kind, free.grade) == (Kind.ANY_HISTORY, Grade.ANY_HISTORY)


@pytest.mark.parametrize("withdrawn", [True, False])
def test_what_trials_found_better_than_a_hint_is_in_the_first_sentence(withdrawn):
    ends = (90 * RPM, 160 * RPM)
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", (ends,), room=2.8, widest=ends)
    tried = replace(span, trials=ways("...", "...."), speed=120 * RPM)
    narrow = replace(POINT, kind=Kind.HINT, narrow=True)
    found = confirmed(
        POINT if withdrawn else narrow, Trials(ways("www" if withdrawn else "...", "www"), (tried,), wob=100e3)
    )
    said = sentence(found)
    assert (
        "Stabilisers 30 ft apart, at the next trip, would free 90 to 160 rpm at 22.5 klbf, untried elsewhere." in said
    )
    assert ("no way in is free." in said) == withdrawn
    assert is_short(said)


def test_what_is_free_at_one_rate_alone_is_so_by_chance():
    """Between ten rates that vibrate one is free; a rate beside it must be so too, of the same order."""
    for tried in (("www", "www."), (".ww", "wwww"), ("w.w", "w.w."), ("www", "x.xx"), ("www", "ww.."), ("..w", "wwww")):
        found = confirmed(POINT, Trials(ways(*tried)))
        assert found.kind == Kind.HINT
        free = sum(one.count(".") for one in tried)
        assert f"{free} of 7 ways in ended free in trials" in sentence(found)
        orders = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down"))
        [now] = orders.do()
        assert now.startswith(
            "Until then do not drill ahead: pick up, or circulate, as the office decides. In trials: "
        )
        assert trial_words.ways_words(found.trials) in now
        why = f"at 22.5 klbf and 100 rpm, the best, {free} of 7 ways in ended free in trials."
        assert orders.do_not() == [f"Do not drill at any setting of this map: {why}"]
        assert orders.to_confirm() == []
    found = confirmed(POINT, Trials(ways("www", "ww...")))
    assert found.kind == Kind.FROM_BELOW
    # 22.5 klbf: 100 kN / 4.448 kN
    assert sentence(found).startswith("Go to 22.5 klbf and 100 rpm speed first, 5 to 10 rpm/s, and stay at ")


def test_where_the_weight_first_is_free_at_some_rates_only_the_sentence_names_the_rates():
    """Brought up slowly from below it whirls: the sentence may not order just that."""
    for tried, says in (
        (("ww.w", "ww..."), "speed first, 5 to 10 rpm/s"),
        (("w...", "www."), "weight first, 3 to 10 rpm/s"),
    ):
        found = confirmed(POINT, Trials(ways(*tried)))
        assert sentence(found).startswith(f"Go to 22.5 klbf and 100 rpm {says}, and stay at ")
    assert sentence(confirmed(POINT, Trials(ways("...", "www.")))).startswith("Bring up to")


def test_no_order_names_a_rate_beyond_those_that_were_tried():
    found = confirmed(replace(POINT, way_in=WayIn()), Trials(ways("...", "....")))
    orders = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down"))
    assert orders.do()[0] == "Off bottom raise the speed to 100 rpm at 0.2 to 10 rpm/s. Then set 22.5 klbf."
    timed = confirmed(replace(POINT, way_in=WayIn()), replace(Trials(ways("...", "....")), set_down=(5.0, 20.0)))
    orders = Orders(timed, ("rotary_speed", "wob"), "field", ("up", "down"))
    assert orders.do()[0].endswith("Then set 22.5 klbf in 5 to 20 s.")
    assert data_of(timed, "rotary_speed")["weight_set_in"] == {"from": 5.0, "to": 20.0}


def test_the_rate_of_a_way_in_is_one_that_was_tried_or_that_passes_the_wall():
    """That of a wall which is not crossed is none, and slow ones are no limit."""
    wall = WayIn(wall=(120 * RPM, 130 * RPM), rate=42 * RPM)

    def way_of(*tried):
        advice = replace(POINT, way_in=wall)
        found = confirmed(advice, Trials(ways(*tried))) if tried else advice
        return Words(found, ("rotary_speed", "wob"), "field", ("up", "down")).lines()[1]

    assert way_of() == "Way in: off bottom raise the speed to 100 rpm, then set 22.5 klbf."
    assert "to 100 rpm at 0.2 to 10 rpm/s, then set 22.5 klbf" in way_of("...", "....")
    assert "to 100 rpm at 3 to 10 rpm/s, then set 22.5 klbf" in way_of("...", "w....")
    assert "Way in: set 22.5 klbf, then raise the speed to 100 rpm at 3 to 10 rpm/s. Trials" in way_of("w...", "wwww")
    assert way_of("www", "wwww").startswith("Way in: none is known. Trials: ")


def test_what_was_withdrawn_is_not_ordered():
    found = confirmed(replace(POINT, way_in=WayIn(rate=1.0)), Trials(ways("www", "wwww")))
    assert data_of(found, "rotary_speed")["way_in"]["first"] == "none"
    found = confirmed(POINT, Trials(ways("www", "wwww")))
    orders = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down"))
    [now] = orders.do()
    assert now.endswith(
        "pick up, or circulate, as the office decides. No way in ended free in trials: they ended in whirl (7)."
    )
    why = "at 22.5 klbf and 100 rpm, the best, none of 7 ways in ended free in trials."
    assert orders.do_not() == [f"Do not drill at any setting of this map: {why}"]


def test_a_failed_trial_is_not_free():
    slow_fails = Trials(ways("...", "x..."))
    assert trial_words.ways_words(slow_fails) == (
        "weight first: 3 of 3 free; speed first: 3 of 3 free at 1 rpm/s or faster, 0 of 1 slower, 1 not known"
    )
    fast_fails = Trials(ways("...", "...x"))
    assert free_from(fast_fails.ways_in(SPEED_FIRST)) == 4
    assert "speed first: 3 of 4 free, 1 not known" in trial_words.ways_words(fast_fails)
    assert "TRIALS FAILED: 1 of 7" in " ".join(trial_words.warnings(fast_fails))


@pytest.mark.parametrize(
    "tried", [("", ""), ("xxx", "xxxx"), ("wxx", "xxxx"), ("...", "...."), ("...", "xxxx"), ("www", "wwww")]
)
@pytest.mark.parametrize("before", [POINT, replace(POINT, kind=Kind.HINT, tried_kind=Kind.FROM_BELOW)])
def test_interrupted_trials_of_a_setting_make_it_a_hint(before, tried):
    """Those that are missing may withdraw it: what ended is never stronger than all."""
    found = confirmed(before, Trials(ways(*tried), interrupted=True, is_cut_short=True))
    assert found.kind == Kind.HINT
    assert found.tried_kind == before.tried_kind
    if before is POINT and tried != ("www", "wwww"):
        assert sentence(found).startswith("Hint only: 22.5 klbf and 100 rpm")
        assert "rials were interrupted, and those that are missing may withdraw it." in sentence(found)
        orders = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down"))
        assert orders.do()[0].startswith("Take 22.5 klbf and 100 rpm as a hint only: trials were interrupted")
        assert is_short(sentence(found))


def test_what_only_changes_of_the_string_lack_changes_no_answer():
    """All trials of the setting ended; the ways in count as they do when nothing is interrupted."""
    for tried in (("www", "w..w.."), ("...", "...."), ("www", "wwww"), ("www", "ww...")):
        whole = confirmed(POINT, Trials(ways(*tried)))
        part = confirmed(POINT, Trials(ways(*tried), interrupted=True))
        assert (part.kind, part.way_in, part.recover) == (whole.kind, whole.way_in, whole.recover)
        assert sentence(part) == sentence(whole)


@pytest.mark.parametrize(
    ("before", "trials", "after"),
    [
        (Recovery.NOT_MET, [knock(VIBRATES), knock(VIBRATES, name=SLOWED, speed=40)], Recovery.LASTS),
        (Recovery.NOT_MET, [knock(VIBRATES), knock(STALLED, (), SLOWED, 40)], Recovery.LASTS),
        (Recovery.NOT_MET, [knock(VIBRATES), knock(FREE, name=SLOWED, speed=60)], Recovery.ENDS),
        (Recovery.NOT_MET, [knock(VIBRATES), knock(VIBRATES, ("stick_slip",), SLOWED, 60)], Recovery.ENDS),
        (Recovery.NOT_MET, [knock(VIBRATES), knock(UNKNOWN, (), SLOWED)], Recovery.NOT_MET),
        (Recovery.NOT_MET, [knock(FREE)], Recovery.STOPS),
        (Recovery.NOT_MET, [knock(UNKNOWN)], Recovery.NOT_MET),
        (Recovery.ENDS, [knock(VIBRATES), knock(VIBRATES, name=SLOWED, speed=40)], Recovery.LASTS),
        (Recovery.ENDS, [knock(FREE)], Recovery.ENDS),
        (Recovery.LASTS, [knock(VIBRATES), knock(FREE, name=SLOWED, speed=60)], Recovery.LASTS),
    ],
)
def test_the_worse_of_map_and_trials_holds(before, trials, after):
    advice = replace(POINT, recover=Recover(before, 70 * RPM if before == Recovery.ENDS else None, ("whirl",)))
    found = confirmed(advice, Trials((*ways("...", "...."), *trials))).recover
    assert found is not None
    assert found.outcome == after
    if after == Recovery.ENDS:
        assert found.at == pytest.approx((60 if before == Recovery.NOT_MET else 70) * RPM)


def test_may_not_becomes_does_not():
    assert sentence(POINT).endswith("vibration, once started, may not stop.")
    lasts = confirmed(POINT, Trials((*ways("...", "...."), knock(VIBRATES), knock(VIBRATES, name=SLOWED, speed=40))))
    assert sentence(lasts).endswith(": whirl, once started, does not stop.")
    ends = confirmed(POINT, Trials((*ways("...", "...."), knock(VIBRATES), knock(FREE, name=SLOWED, speed=60))))
    assert sentence(ends).endswith(": whirl, once started, ends when lowered to 60 rpm.")


def test_a_disturbance_takes_any_history_away():
    advice = replace(POINT, kind=Kind.ANY_HISTORY, grade=Grade.ANY_HISTORY)
    bad = Trial("10 % faster and back", Way.EXCURSION, VIBRATES, ("whirl",))
    found = confirmed(advice, Trials((*ways("...", "...."), bad)))
    assert (found.kind, found.grade) == (Kind.FROM_BELOW, Grade.FROM_BELOW_ONLY)
    assert "10 % faster and back: whirl" in " ".join(trial_words.of_setting(found.trials, FIELD))
    assert confirmed(advice, Trials(ways("...", "...."))).kind == Kind.ANY_HISTORY
    assert confirmed(advice, Trials(ways("...", "w..."))).kind == Kind.FROM_BELOW


@pytest.mark.parametrize("kind", [Kind.ANY_HISTORY, Kind.FROM_BELOW, Kind.QUICK_START])
@pytest.mark.parametrize("outcome", [VIBRATES, STALLED])
def test_a_setting_that_vibrates_when_tagged_with_the_rotation_on_is_not_ordered(kind, outcome):
    tagged = Trial(TAGGED, Way.EXCURSION, outcome, ("whirl",))
    found = confirmed(replace(POINT, kind=kind), Trials((*ways("...", "...."), tagged)))
    assert found.kind == Kind.HINT
    tells = "picked up and tagged again with the rotation on, it whirls in a trial."
    assert tells in sentence(found).lower()
    orders = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down"))
    assert not any("Drill at" in order for order in orders.do())
    assert orders.do()[0].endswith(f"{tells} At a connection stop the rotation and come in anew.")
    assert orders.do_not()[0] == "Do not tag with the rotation on: in a trial it then whirls."
    assert next(iter(trial_words.after_connection(found.trials))).startswith(
        "TAGGED WITH THE ROTATION ON IT VIBRATES: "
    )
    assert not list(trial_words.of_setting(found.trials, FIELD)), "it is told once"
    for harmless in (FREE, UNKNOWN):
        trials = Trials((*ways("...", "...."), replace(tagged, outcome=harmless, responses=())))
        assert confirmed(replace(POINT, kind=kind), trials).kind == kind
        assert not list(trial_words.after_connection(trials))


@pytest.mark.parametrize("is_first", [True, False])
def test_what_ends_in_another_vibration_is_worse_than_what_ends_free_lower_down(is_first):
    """Off the rock its bounce ends free at 15 rpm; the whirl of the wall ends at 60 rpm, and then it bounces."""
    lifted = Trial(OFF_ROCK, Way.KNOCK, VIBRATES, ("bit_bounce",))
    free = (lifted, Trial(SLOWED, Way.KNOCK, FREE, speed=15 * RPM, after=OFF_ROCK))
    bounces = (knock(VIBRATES), knock(VIBRATES, ("bit_bounce",), SLOWED, 60))
    knocks = (*bounces, *free) if is_first else (*free, *bounces)
    found = confirmed(POINT, Trials((*ways("...", "...."), *knocks)))
    assert found.recover is not None
    assert (found.recover.at, found.recover.then) == (60 * RPM, ("bit_bounce",))
    orders = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down")).do()
    assert "Do not lower it: at 60 rpm the whirl ends, but then it bounces." in orders[-1]
    assert "Expect it after a disturbance, as in trials: knocked off the rock, it bounces." in orders[-1]
    assert "runs lowered to " not in " ".join(orders)


@pytest.mark.parametrize(
    ("trials", "told"),
    [
        (
            (*ways("...", "...."), knock(VIBRATES, ("bit_bounce",), OFF_ROCK)),
            "knocked off the rock in a trial it bounces",
        ),
        (ways("...", "w..."), "as ordered it is free; slower it whirls"),
    ],
)
def test_a_share_of_starts_follows_what_trials_showed(trials, told):
    """Free from all 8 starts; where a trial vibrates the sentence says so, and no start is told to be safe after any
    history."""
    starts = Share(1.0, 0.63, 1.0, 1.0, 8, 0)
    advice = replace(POINT, kind=Kind.ANY_HISTORY, grade=Grade.ANY_HISTORY, share=starts)
    found = confirmed(advice, Trials(trials))
    assert found.kind == Kind.FROM_BELOW
    said = Words(found, ("rotary_speed",), "field", ("same",)).sentence()
    assert said.endswith(f"at 85 to 115 rpm; {told}.")
    assert data_of(found, "rotary_speed")["share"]["any_history"] == 0.0
    free = confirmed(advice, Trials(ways("...", "....")))
    assert data_of(free, "rotary_speed")["share"]["any_history"] == 1.0
    assert Words(free, ("rotary_speed",), "field", ("same",)).sentence().endswith("at 85 to 115 rpm.")


def test_few_ways_in_are_a_warning():
    assert "FEW WAYS IN ARE FREE: 1 of 7" in " ".join(trial_words.warnings(Trials(ways(".ww", "wwww"))))
    assert not list(trial_words.warnings(Trials(ways("...", "w..."))))


def test_a_change_helps_only_beyond_the_string_as_it_is():
    span = Change("span", "drillstring.collar.span", "30 ft", "stabilisers 30 ft apart", room=2.0)
    as_it_is = Change("none", "", "", "as it is", room=0.0)
    assert Trials(changes=(as_it_is, span)).best == span
    free = replace(as_it_is, room=1.5)
    assert Trials(changes=(free, span)).best == free, "it needs no change"
    assert Trials(changes=(free, span), samples=True).best is None, "only some samples need one"
    assert Trials(changes=(as_it_is, replace(span, room=0.5))).best is None
    assert Trials(changes=(as_it_is, replace(span, room=None, why="25 of 25 runs failed"))).best is None


def test_the_sentence_names_what_helps():
    ends = (90 * RPM, 160 * RPM)
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", free=(ends,), room=2.8, widest=ends)
    nothing = Advice(Kind.NOTHING, stops=(("whirl", 45 * RPM, 180 * RPM),))
    found = confirmed(nothing, Trials(changes=(Change("none", "", "", "as it is", room=0.0), span), wob=20 * KLBF))
    told = "Stabilisers 30 ft apart, at the next trip, may free 90 to 160 rpm at 20 klbf, untried elsewhere."
    assert sentence(found) == f"Nothing is safe: whirl at 45 to 180 rpm. {told}"
    stops = (("stick_slip", 45 * RPM, 80 * RPM), ("bit_bounce", 60 * RPM, 90 * RPM), *nothing.stops)
    more = sentence(replace(found, stops=stops))
    assert more.endswith(told), "at which weight alone it was tried stays where words are few"
    assert len(more.split()) <= MOST_WORDS


def test_nothing_is_safe_only_within_what_was_asked():
    """Beside a map that is free elsewhere: where one drills, and of a setting that trials withdraw, there."""
    nothing, of_map = (
        Advice(Kind.NOTHING, stops=(("whirl", 45 * RPM, 180 * RPM),)),
        (("rotary_speed",), "field", ("up",)),
    )
    drilled = {"ranges": {"wob": {"from": 20 * KLBF, "to": 35 * KLBF}}, "run_up": 4}
    assert (
        Words(nothing, *of_map, drilled=drilled).sentence()
        == "Nothing is safe at 20 to 35 klbf: whirl at 45 to 180 rpm."
    )
    alone = Words(nothing, *of_map, drilled={**drilled, "run_up": 0}).sentence()
    assert alone == "Nothing is safe: whirl at 45 to 180 rpm."
    withdrawn = sentence(confirmed(POINT, Trials(ways("www", "wwww"))))
    assert withdrawn.startswith("No setting is recommended: at ")
    assert "safe" not in withdrawn


def test_what_helps_stands_beside_a_hint_from_above():
    ends = (90 * RPM, 160 * RPM)
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", free=(ends,), room=2.8, widest=ends)
    above = replace(POINT, kind=Kind.NOTHING, grade=Grade.ONLY_FROM_ABOVE, stops=(("whirl", 45 * RPM, 180 * RPM),))
    found = confirmed(above, Trials(changes=(Change("none", "", "", "as it is", room=0.0), span), wob=20 * KLBF))
    assert "Stabilisers 30 ft apart, at the next trip, may free 90 to 160 rpm" in sentence(found)


def test_changes_are_ranked_by_robustness_then_by_effort():
    """Soft torque that allows 32 to 49 rpm is poor, though it is switched on at once; stabilisers come before
    collars that are ordered, and these before a bit that no rig can make, though it has the most room."""

    def change(name: str, low: float, high: float, room: float) -> Change:
        ends, speed = (low * RPM, high * RPM), (low + high) / 2 * RPM
        weights = (18 * KLBF, 22 * KLBF)
        trials = ways("...", "....")
        return Change(
            name, "k", "v", name, (ends,), room=room, widest=ends, speed=speed, trials=trials, weights=weights
        )

    as_it_is = Change("none", "", "", "as it is", room=0.0)
    soft, span, straight, bit = (
        change("drive", 32, 49, 1.7),
        change("span", 90, 150, 2.6),
        change("eccentricity", 80, 160, 3.3),
        change("lobes", 60, 180, 5.0),
    )
    assert [one.robust for one in (soft, span, straight)] == [Robust.POOR, Robust.GOOD, Robust.GOOD]
    found = Trials(changes=(as_it_is, soft, straight, bit, span))
    assert sorted(found.helping, key=lambda one: one.rank, reverse=True) == [span, straight, bit, soft]
    assert found.best == span
    told = trial_words.best_words(found, "rotary_speed", FIELD)
    assert told == "span, at the next trip, would free 90 to 150 rpm at 18 to 22 klbf"
    narrow = replace(span, weights=(20 * KLBF, 20 * KLBF))
    assert narrow.robust == Robust.POOR, "no one holds the weight"
    doubtful = replace(span, trials=ways("...", "..w."))
    assert doubtful.robust == Robust.FAIR
    assumed = replace(span, holds_usual=False)
    assert assumed.robust == Robust.POOR
    told = trial_words.change_words(assumed, found, "rotary_speed", FIELD)
    assert (
        told == "span, at the next trip, may free 90 to 150 rpm at 18 to 22 klbf (poor: with the assumed damping only)"
    )
    data = data_of(confirmed(POINT, found), "rotary_speed")["changes"][4]
    assert (data["effort"], data["robust"], data["share_free"]) == ("at the next trip", "good", 1.0)
    assert data["stay_within"]["wob"] == {"from": 18 * KLBF, "to": 22 * KLBF}


def test_of_all_weights_the_most_robust_change_is_named():
    """Of a map that allows no setting the string as it is is free on one way up at 10 kN, of which no trial was run;
    stabilisers that trials grade good there come before soft torque that they grade poor at 30 kN."""
    none = Change("none", "", "", "as it is", room=0.4, wob=30e3)
    as_it_is = replace(none, others=(replace(none, room=3.4, wob=10e3, free=((2.2, 6.0),), widest=(2.2, 6.0)),))
    soft = Change("drive", "drive.kind", "soft_torque", "soft torque", ((2.5, 6.0),), 1.8, (3.0, 4.9), wob=30e3)
    soft = replace(soft, speed=4.0, trials=ways("...", "...."), weights=(21e3, 39e3))
    span = Change("span", "k", "15 m", "stabilisers 15 m apart", ((5.4, 8.0),), 1.8, (5.4, 8.0), wob=30e3, speed=6.5)
    at_10 = replace(span, room=2.5, widest=(4.8, 8.0), speed=6.4, trials=soft.trials, weights=(1e3, 19e3), wob=10e3)
    found = Trials(changes=(as_it_is, soft, replace(span, others=(at_10,))), wob=30e3, mapped=True)
    assert (soft.robust, at_10.robust) == (Robust.POOR, Robust.GOOD)
    assert found.best == at_10
    alone = replace(found, changes=(as_it_is, soft))
    told = "soft torque, at the surface, would free 29 to 46 rpm at 5 to 8.5 klbf (poor: narrow in speed)"
    assert trial_words.best_words(alone, "rotary_speed", FIELD) == told
    row = next(line for line in trial_words.lines(alone, *OF_SPEED) if "soft torque  " in line)
    trials_left = "by trials 29 to 46 rpm, 5 to 8.5 klbf, along the speed room for 1.8 tolerances"
    assert row.endswith(f"free at 24 to 57 rpm; {trials_left}: poor (narrow in speed), at the surface")
    at_20 = replace(at_10, wob=20e3, holds_usual=False)
    told = trial_words.elsewhere(soft, replace(found, changes=(as_it_is, replace(soft, others=(at_20,)))), *OF_SPEED)
    assert told.endswith("at 4.5 klbf (poor: with the assumed damping only).")
    few = replace(soft, widest=(3.0, 8.0), room=0.5, trials=ways("...", "wwww"), weights=(20e3, 21e3))
    assert few.why_poor == ("narrow in weight", "little room", "few trials free")


def test_what_was_tried_and_is_good_comes_before_what_no_trial_was_run_of():
    """A narrow hint at 25 klbf, whose row of the map has 2.7 tolerances along the speed. Trials leave soft torque 3.2
    there, 2 klbf either way; at 15 klbf, where one way up shows 3.1 of it, none was run."""
    none = Change("none", "", "", "as it is", room=2.7, wob=25 * KLBF)
    none = replace(none, others=(replace(none, room=2.0, wob=15 * KLBF),))
    soft = Change("drive", "drive.kind", "soft_torque", "soft torque", wob=25 * KLBF, speed=46 * RPM)
    light = ((25 * RPM, 61 * RPM),)
    at_15 = replace(soft, free=light, widest=light[0], room=3.1, speed=43 * RPM, wob=15 * KLBF)
    left, weights = (30 * RPM, 66 * RPM), (23 * KLBF, 27 * KLBF)
    good = replace(soft, free=(left,), widest=left, room=3.2, trials=ways("...", "...."), weights=weights)
    found = Trials(ways("...", "...."), (none, replace(good, others=(at_15,))), wob=25 * KLBF, mapped=True)
    assert good.robust == Robust.GOOD
    assert found.best.wob == good.wob
    told = trial_words.best_words(found, "rotary_speed", FIELD)
    assert told == "soft torque, at the surface, would free 30 to 66 rpm at 23 to 27 klbf"
    poor = replace(good, weights=(25 * KLBF, 25 * KLBF))
    less = replace(found, changes=(none, replace(poor, others=(at_15,))))
    assert less.best.wob == at_15.wob
    told = trial_words.best_words(less, "rotary_speed", FIELD)
    assert told == "soft torque, at the surface, may free 25 to 61 rpm at 15 klbf, untried"


def test_a_change_without_trials_is_not_graded():
    """It may promise to be good; only trials grade it. JSON has null, and its row says that it is untried."""
    ends = (90 * RPM, 160 * RPM)
    none = Change("none", "", "", "as it is", room=0.0)
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", (ends,), 2.8, ends, speed=120 * RPM)
    assert span.promised == Robust.GOOD
    assert span.robust is None
    found = Trials(changes=(none, span), wob=20 * KLBF)
    plain = data_of(confirmed(POINT, found), "rotary_speed")["changes"]
    assert [(one["robust"], one["share_free"]) for one in plain] == [(None, None)] * 2
    rows = list(trial_words.lines(found, "rotary_speed", FIELD))
    assert [row.endswith("; untried") for row in rows] == [False, False, True]


def test_a_way_up_gives_way_to_trials_near_its_weight():
    """At 20 kN soft torque is free up to 5.96 rad/s on one way up; of its trials those in corners 1.1 kN from that
    whirl at 5.96 rad/s, and at 5.43 rad/s when disturbed, and others at the wall, or far away, say nothing of it."""

    def corner(speed: float, wob: float, name: str = TO_CORNER) -> Trial:
        return Trial(name, Way.CORNER, VIBRATES, ("whirl",), speed=speed, wob=wob)

    none = Change("none", "", "", "as it is", room=0.0, wob=30e3)
    soft = Change("drive", "drive.kind", "soft_torque", "soft torque", ((2.46, 5.96),), 1.8, (3.0, 4.9), wob=30e3)
    bad = (corner(5.96, 21.1e3), corner(5.43, 21.1e3, HELD_IN_CORNER), corner(3.0, 38.9e3), knock(VIBRATES))
    here = replace(soft, speed=3.98, trials=(*ways("...", "...."), *bad), weights=(21.1e3, 38.9e3))
    at_20 = replace(soft, free=((1.0, 1.4), (1.88, 5.96)), room=3.9, widest=(1.88, 5.96), speed=3.9, wob=20e3)
    at_10 = replace(at_20, wob=10e3)
    whole = replace(here, others=(at_10, at_20))
    assert whole.left_beside(at_20) == ((1.0, 1.4), (1.88, pytest.approx(5.43 - 5 * RPM)))
    assert whole.left_beside(at_10) == at_10.free, "more than a driller's 2 klbf away"
    found = Trials(changes=(none, whole), wob=30e3)
    si = Formatter("si")
    told = trial_words.best_trials(found, "rotary_speed", si)
    assert "one way up 1 to 1.4 rad/s" in told
    assert re.search(
        r"one way up, less what vibrates in trials near this weight, 1 to .* 1.9 to 4.9 rad/s .*20 kN", told
    )
    row = next(line for line in trial_words.lines(found, "rotary_speed", si) if " at 20 kN " in line)
    assert "untried, and of that trials near this weight leave" in row
    plain = data_of(confirmed(POINT, found), "rotary_speed")["changes"][1]
    assert plain["free_beside_trials"] is None
    by_wob = {one["wob"]["wob"]: one["free_beside_trials"] for one in plain["at_other_weights"]}
    assert by_wob[20e3][1]["to"] == pytest.approx(5.43 - 5 * RPM)
    assert by_wob[10e3][1]["to"] == 5.96


def test_what_is_passed_on_the_way_to_what_a_change_frees_is_told():
    """Soft torque is free at 40 to 77 rpm, and from 85 rpm on: trials are of the latter, to which the string is
    brought up past the rest, and its own map, with a way down, may recommend the former."""
    free, ends = ((40 * RPM, 77 * RPM), (85 * RPM, 160 * RPM)), (90 * RPM, 160 * RPM)
    none = Change("none", "", "", "as it is", room=0.0)
    soft = Change("drive", "drive.kind", "soft_torque", "soft torque", free, 3.0, ends, speed=120 * RPM, wob=18 * KLBF)
    soft = replace(soft, trials=ways("...", "...."), weights=(16 * KLBF, 20 * KLBF))
    found = Trials(changes=(none, soft), wob=18 * KLBF)
    assert trial_words.best_words(found, "rotary_speed", FIELD) == (
        "soft torque, at the surface, would free 90 to 160 rpm at 16 to 20 klbf, not 77 to 85 rpm"
    )
    assert (
        "At 40 to 77 rpm it is free as well when brought up, untried in trials: have a map of it run before using that."
        in trial_words.best_trials(found, "rotary_speed", FIELD)
    )
    alone = replace(soft, free=free[1:])
    assert alone.passed is None
    assert "past" not in trial_words.change_words(alone, found, "rotary_speed", FIELD)


def test_every_view_of_a_change_names_the_weight_at_which_it_was_tried():
    """A change is tried at one weight: its sentence says so, and that of its trials, but for the change of the
    weight itself, which names its own."""
    ends = (90 * RPM, 160 * RPM)
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", (ends,), 2.8, ends, speed=120 * RPM)
    span = replace(span, trials=ways("...", "...."))
    found = Trials(changes=(Change("none", "", "", "as it is", room=0.0), span), wob=20 * KLBF)
    assert trial_words.best_words(found, "rotary_speed", FIELD).endswith("at 20 klbf, untried elsewhere")
    of_trials = trial_words.best_trials(found, "rotary_speed", FIELD)
    assert "with stabilisers 30 ft apart at 20 klbf and 120 rpm" in of_trials
    told = list(trial_words.lines(found, "rotary_speed", FIELD))
    assert any("30 ft apart, at 20 klbf and 120 rpm:" in line for line in told)
    weight = replace(span, name="weight", words="13 klbf on the bit")
    assert "20 klbf" not in trial_words.change_words(weight, found, "rotary_speed", FIELD)


def test_a_change_tells_what_it_frees_at_each_weight_at_which_it_was_run():
    """At 20 klbf, at which the map is drilled, 30 ft stabilisers free nothing, and at 10 and 5 klbf they do: they help
    there, and no words say that they free nothing, but at 20 klbf."""
    ends, light = (90 * RPM, 160 * RPM), (60 * RPM, 100 * RPM)
    none = Change("none", "", "", "as it is", room=0.0)
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", room=0.0)
    at_10 = replace(span, free=(ends,), room=2.8, widest=ends, speed=120 * RPM, wob=10 * KLBF)
    at_5 = replace(at_10, free=(light,), room=2.5, widest=light, speed=80 * RPM, wob=5 * KLBF)
    here = replace(span, wob=20 * KLBF, others=(at_5, at_10))
    as_it_is = replace(none, wob=20 * KLBF, others=tuple(replace(none, wob=one * KLBF) for one in (5, 10)))
    found = Trials(changes=(as_it_is, here), wob=20 * KLBF, mapped=True, nothing=True)
    assert found.nearest_first(found.helping) == [at_10, at_5], "the nearer to what is drilled with first"
    assert found.best == at_10
    told = trial_words.best_words(found, "rotary_speed", FIELD)
    assert told == "stabilisers 30 ft apart, at the next trip, may free 90 to 160 rpm at 10 klbf"
    assert trial_words.best_trials(found, "rotary_speed", FIELD).endswith(
        "At other weights: one way up 60 to 100 rpm at 5 klbf, nothing at 20 klbf."
    )
    told_all = list(trial_words.lines(found, "rotary_speed", FIELD))
    assert told_all[0].startswith("One change at a time, each run one way up at 5 klbf, 10 klbf, 20 klbf")
    assert "nowhere" not in " ".join(told_all)
    assert " ".join(told_all[-1].split()) == "at 20 klbf free at no speed that was run"
    data = data_of(confirmed(POINT, found), "rotary_speed")["changes"][1]
    assert (data["wob"], data["room"]) == ({"wob": 20 * KLBF}, 0.0)
    assert [(one["wob"]["wob"], one["room"]) for one in data["at_other_weights"]] == [(5 * KLBF, 2.5), (10 * KLBF, 2.8)]
    whirls = replace(at_10, trials=ways("www", "wwww"))
    tried = replace(found, changes=(as_it_is, here.with_one(whirls)))
    assert tried.best is None, "of the other weight no more is known than of the one that failed"
    row = next(line for line in trial_words.lines(tried, "rotary_speed", FIELD) if "160 rpm" in line)
    assert "by trials not known" not in row
    free_here = replace(as_it_is, others=(replace(at_10, name="none", key="", room=2.9), replace(none, wob=5 * KLBF)))
    less = replace(found, changes=(free_here, here), nothing=False)
    assert less.best == at_5, "at 10 klbf the string is free as it is"


def test_a_change_at_one_weight_says_at_which_it_frees_nothing():
    none = Change("none", "", "", "as it is", room=0.0, wob=20 * KLBF)
    soft = Change("drive", "drive.kind", "soft_torque", "soft torque", room=0.0, wob=20 * KLBF)
    told = list(trial_words.lines(Trials(changes=(none, soft), wob=20 * KLBF), "rotary_speed", FIELD))
    assert told[2].split("  ")[-1].strip() == "free at no speed that was run at 20 klbf"


def test_what_comes_where_a_vibration_ends_is_told():
    """The whirl of a knock ends at 20 rpm, but there the bit sticks: no way out is free."""
    slowed = knock(VIBRATES, ("stick_slip",), SLOWED, 20)
    found = confirmed(POINT, Trials((*ways("...", "...."), knock(VIBRATES), slowed)))
    assert found.recover is not None
    assert (found.recover.outcome, found.recover.then) == (Recovery.ENDS, ("stick_slip",))
    said = Words(found, ("rotary_speed",), "field", ("up", "down"))
    assert said.sentence().endswith(": if it whirls, pick up, stop the rotation, start again."), "as it is ordered"
    assert "runs lowered to " not in " ".join(said.lines())
    assert "lowered to 20 rpm the whirl ends, but then it sticks" in " ".join(said.lines())
    do = " ".join(Orders(found, ("rotary_speed",), "field", ("up", "down")).do())
    assert "pick up, stop the rotation, start again. Do not lower it: at 20 rpm the whirl ends" in do


def test_a_corner_of_the_limits_that_vibrates_is_told():
    """It says nothing of the point, and it is not to be run."""
    corner = Trial(TO_CORNER, Way.CORNER, VIBRATES, ("stick_slip",), speed=85 * RPM, wob=177.93e3)
    found = confirmed(replace(POINT, grade=Grade.ANY_HISTORY), Trials((*ways("...", "...."), corner)))
    assert found.grade == Grade.ANY_HISTORY
    told = next(trial_words.of_setting(found.trials, FIELD))
    assert told.startswith("IN A CORNER")
    assert "40 klbf and 85 rpm: stick-slip" in told
    orders = Orders(found, ("rotary_speed",), "field", ("up", "down"))
    assert "Do not run at 40 klbf and 85 rpm: in trials it sticks there." in orders.do_not()


def test_as_data():
    found = data_of(confirmed(POINT, Trials(ways("...", "w..."))), "rotary_speed")
    slow = found["trials"][3]
    assert slow == {
        "name": "speed first",
        "way": "in",
        "outcome": "vibrates",
        "responses": ["whirl"],
        "rate": {"value": pytest.approx(0.2 * RPM), "units": "rad/s^2"},
        "speed": None,
        "wob": None,
        "after": "",
        "there": None,
        "why": "",
        "set_in": None,
        "held": None,
        "begun": None,
    }
    assert found["trials_counted"] == [
        {"name": WEIGHT_FIRST, "way": "in", "of": 3, "free": 3, "vibrates": 0, "stalled": 0, "unknown": 0},
        {"name": SPEED_FIRST, "way": "in", "of": 4, "free": 3, "vibrates": 1, "stalled": 0, "unknown": 0},
    ]
    assert data_of(POINT, "rotary_speed")["trials"] == []


def test_each_knock_counts_and_the_worst_holds():
    """Let go from rest it comes free, off the rock it bounces on, and on the wall it whirls down to
    60 rpm: what lasts is told with its response."""
    held = Trial(HELD, Way.KNOCK, FREE)
    lifted = Trial(OFF_ROCK, Way.KNOCK, VIBRATES, ("bit_bounce",))
    down = Trial(SLOWED, Way.KNOCK, VIBRATES, ("bit_bounce",), speed=40 * RPM, after=OFF_ROCK)
    wall = (knock(VIBRATES), knock(FREE, name=SLOWED, speed=60))
    found = confirmed(POINT, Trials((*ways("...", "...."), held, lifted, *wall, down)))
    assert found.recover is not None
    assert (found.recover.outcome, found.recover.responses) == (Recovery.LASTS, ("bit_bounce",))
    assert sentence(found).endswith(": bit-bounce, once started, does not stop.")
    told = " ".join(trial_words.of_setting(found.trials, FIELD))
    assert (
        told == "DISTURBED IN TRIALS it vibrates afterwards. From the free setting, knocked off the rock: bit-bounce."
    )
    assert "when lowered to 40 rpm" in trial_words.slowed_to(found.trials, FIELD)
    both = replace(down, name=SLOWED, after=ON_WALL, responses=("whirl",))
    rolls = confirmed(POINT, Trials((*ways("...", "...."), held, lifted, knock(VIBRATES), down, both)))
    assert rolls.recover is not None
    assert rolls.recover.responses == ("bit_bounce", "whirl")
    assert "If it bounces or whirls: it does not stop" in " ".join(
        Words(rolls, ("rotary_speed",), "field", ("up", "down")).lines()
    )
    unknown = confirmed(POINT, Trials((*ways("...", "...."), held, knock(UNKNOWN, ()))))
    assert unknown.recover == POINT.recover, "a knock of which nothing is known did not come free"


def test_what_helps_is_judged_by_trials_of_it():
    """Free on the way up over most speeds, stabilisers whose trials are free come before others, and
    what no way in reaches is none."""
    ends = (90 * RPM, 160 * RPM)
    as_it_is = Change("none", "", "", "as it is", room=0.0)
    some = {"free": (ends,), "widest": ends, "speed": 120 * RPM}
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", room=2.8, **some)
    straight = Change("eccentricity", "e", "2 mm", "collars straight to 2 mm", room=2.0, **some)
    bounces = Trial(HELD, Way.KNOCK, VIBRATES, ("bit_bounce",))
    bad = replace(span, trials=(*ways("...", "...."), bounces))
    good = replace(straight, trials=(*ways("...", "w..."), Trial(HELD, Way.KNOCK, FREE), knock(VIBRATES)))
    alone, both = Trials(changes=(as_it_is, bad)), Trials(changes=(as_it_is, bad, good))
    assert (
        trial_words.best_words(alone, "rotary_speed", FIELD)
        == "stabilisers 30 ft apart, at the next trip, may free 90 to 160 rpm"
    )
    assert trial_words.best_trials(alone, "rotary_speed", FIELD) == (
        "In trials with stabilisers 30 ft apart at 120 rpm 7 of 7 ways in were free; the bit held and let go: "
        "bit-bounce."
    )
    both_words = trial_words.best_words(both, "rotary_speed", FIELD)
    assert both_words == "stabilisers 30 ft apart, at the next trip, may free 90 to 160 rpm", "as robust, and nearer"
    sure = replace(straight, trials=(*ways("...", "...."), Trial(HELD, Way.KNOCK, FREE), knock(FREE)))
    free = Trials(changes=(as_it_is, bad, sure))
    assert (
        trial_words.best_words(free, "rotary_speed", FIELD)
        == "collars straight to 2 mm, to be ordered, would free 90 to 160 rpm"
    )
    other = Change("lobes", "b", "0 m", "a bit without lobes", room=4.6, trials=sure.trials, **some)
    assert Trials(changes=(as_it_is, other, sure)).best == sure, "a rig cannot make that of its bit"
    of_bit = Trials(changes=(as_it_is, other, bad))
    assert of_bit.best == other
    told = trial_words.best_words(of_bit, "rotary_speed", FIELD)
    assert told == "a bit without lobes would free 90 to 160 rpm", "its words have the friction with which it was run"
    more = trial_words.best_trials(of_bit, "rotary_speed", FIELD)
    assert more.endswith("were free. Another bit may have another friction: run the study with that.")
    assert Trials(changes=(as_it_is, replace(span, trials=ways("www", "wwww")))).best is None
    assert (
        trial_words.best_trials(Trials(changes=(as_it_is, span)), "rotary_speed", FIELD)
        == "What stabilisers 30 ft apart would free is of one way up; no trial of that was run."
    )
    found = data_of(confirmed(POINT, alone), "rotary_speed")["changes"][1]
    assert found["trials_at"] == {"rotary_speed": 120 * RPM}
    assert found["trials"][-1]["responses"] == ["bit_bounce"]


def test_the_way_in_is_one_that_ended_free_and_no_order_forbids_it():
    """Below the wall range the map sets the weight first; in trials no such way is free, and of the
    others those at the four slowest rates are."""
    wall = WayIn(First.WEIGHT, begins=24 * RPM, wall=(120 * RPM, 130 * RPM))
    advice = replace(POINT, way_in=wall)
    before = Orders(advice, ("rotary_speed", "wob"), "field", ("up", "down"))
    assert "before the weight" not in " ".join(before.do_not()), "the wall is not on the way"
    found = confirmed(advice, Trials(ways("www", "....w")))
    assert found.way_in is not None
    assert (found.way_in.first, found.way_in.most) == ("speed", pytest.approx(3.0 * RPM))
    said = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down"))
    assert "Way in: off bottom raise the speed to 100 rpm at 0.2 to 3 rpm/s, then set 22.5 klbf." in " ".join(
        said.lines()
    )
    assert said.sentence().startswith("Go to 22.5 klbf and 100 rpm speed first, 0.2 to 3 rpm/s, and stay at ")
    orders = " ".join(said.do_not())
    assert "before the weight" not in orders
    assert "Do not set the weight before the speed: in trials none of 3 such ways in ended free." in orders
    data = data_of(found, "rotary_speed")["way_in"]
    assert data["most_rate"] == {"value": pytest.approx(3.0 * RPM), "units": "rad/s^2"}
    middle = confirmed(advice, Trials(ways("www", "w....w")))
    assert "speed first, 1 to 3 rpm/s, and stay" in sentence(middle)
    weight = Orders(confirmed(advice, Trials(ways("...w", "wwww"))), ("rotary_speed", "wob"), "field", ("up", "down"))
    assert "weight first, 0.2 to 1 rpm/s, and stay" in weight.sentence()
    assert "Do not raise the speed before the weight: in trials none of 4 " in " ".join(weight.do_not())


@pytest.mark.parametrize(
    ("weight", "says"),
    [
        ("....ww", "weight first, then the speed at 0.2 to 1 rpm/s."),
        (".w.w", "do not use this setting."),
        ("..w", "do not use this setting."),
        ("ww...", "do not use this setting."),
    ],
)
def test_a_slower_drive_is_told_only_what_it_can_do(weight, says):
    """The speed first from 3 rpm/s on; the weight first at the rate that the drive lacks helps no one."""
    past = WayIn(First.SPEED, rate=8 * RPM, wall=(60 * RPM, 68 * RPM), crosses=True)
    found = confirmed(replace(POINT, way_in=past), Trials(ways(weight, "ww...")))
    order = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down")).do()[0]
    assert "at 8 to 10 rpm/s without a stop" in order
    assert order.endswith(f" If the drive is slower: {says}")


def test_a_quick_start_says_how_the_slow_ways_ended():
    """The map whirls on its slow way up; two slow trials are free, and the sentence does not deny it."""
    quick = replace(POINT, kind=Kind.QUICK_START, grade=Grade.FROM_START, slowly=("whirl",))
    assert "it whirls;" in sentence(quick)
    assert "As ordered it is free; speed first it whirls." in sentence(confirmed(quick, Trials(ways("...", "www."))))


def test_a_sentence_without_words_for_where_it_whirls_slowly_says_that_it_does():
    """Within the limits 12 klbf and 150 rpm are free from a quick start only; the way in says where."""
    ends = {"rotary_speed": Stretch(85 * RPM, 200 * RPM, Beyond(75 * RPM), Beyond(None))}
    ends["wob"] = Stretch(4 * KLBF, 20 * KLBF, Beyond(None), Beyond(None))
    quick = replace(
        POINT,
        kind=Kind.QUICK_START,
        point={"wob": 16 * KLBF, "rotary_speed": 160 * RPM},
        stay_within=ends,
        lines={"rotary_speed": replace(ends["rotary_speed"], low=75 * RPM), "wob": ends["wob"]},
        slowly=("whirl",),
        slowly_at={"wob": 12 * KLBF, "rotary_speed": 150 * RPM},
        way_in=WayIn(),
    )
    found = confirmed(quick, Trials(ways("www", "ww...")))
    words, orders = (one(found, ("rotary_speed", "wob"), "field", ("up", "same")) for one in (Words, Orders))
    assert words.sentence().endswith("4 to 20 klbf. Raised slowly within that it whirls.")
    assert is_short(words.sentence())
    assert "Brought up slowly it whirls at 12 klbf and 150 rpm." in " ".join(words.lines())
    assert "Do not raise the speed slowly: it whirls at 12 klbf and 150 rpm." in orders.do_not()


def test_the_order_that_asks_less_of_the_drive_is_taken():
    """The weight first is free at every rate, the speed first from 5 rpm/s on; the map, which stops at
    every speed, whirls."""
    quick = replace(POINT, kind=Kind.QUICK_START, grade=Grade.FROM_START, slowly=("whirl",), way_in=WayIn())
    found = confirmed(quick, Trials(ways("....", "www.")))
    order = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down"))
    assert order.do()[0] == "Set 22.5 klbf. Then raise the speed to 100 rpm at 0.2 to 10 rpm/s without a stop."
    assert "Go to 22.5 klbf and 100 rpm weight first, 0.2 to 10 rpm/s; stay at " in sentence(found)
    forbidden = "Do not raise the speed before the weight: in trials 3 of 4 such ways in ended in vibration."
    assert forbidden in order.do_not()
    half = Orders(confirmed(quick, Trials(ways("....", "w...."))), ("rotary_speed", "wob"), "field", ("up", "down"))
    assert half.do()[0].startswith("Off bottom raise the speed to 100 rpm at 3 to 10 rpm/s. Then set 22.5 klbf.")


def test_no_speed_is_ordered_at_which_something_else_vibrates():
    """Slowed in a trial the whirl ends at 60 rpm, where the way up sticks, or where a corner bounces."""
    knocked = (knock(VIBRATES), knock(FREE, name=SLOWED, speed=60))
    bounces = Trial(TO_CORNER, Way.CORNER, VIBRATES, ("bit_bounce",), speed=60 * RPM, wob=120e3)
    for through, corner, then in ((70, (), "stick-slip may begin"), (50, (), ""), (50, (bounces,), "it bounces")):
        way = WayIn(through=through * RPM, begins=30 * RPM)
        found = confirmed(replace(POINT, way_in=way), Trials((*ways("....", "...."), *knocked, *corner)))
        order = " ".join(Orders(found, ("rotary_speed", "wob"), "field", ("up", "down")).do())
        said = (
            f"Do not lower it: at 60 rpm the whirl ends, but then {then}." if then else "If it whirls: lower to 60 rpm"
        )
        assert said in order
    on_map = replace(POINT, way_in=WayIn(through=70 * RPM), recover=Recover(Recovery.ENDS, 60 * RPM, ("whirl",)))
    free = confirmed(on_map, Trials((*ways("....", "...."), *knocked))).recover
    assert not free.then, "the way down of the map was free there"


def test_trials_lower_the_speed_of_a_map_that_was_carried_along_the_weight():
    """What they say of the speed is no weight."""
    tried = Trials((*ways("....", "...."), knock(VIBRATES), knock(FREE, name=SLOWED, speed=60)))
    found = confirmed(replace(POINT, recover=Recover(Recovery.ENDS, 40e3, ("whirl",), axis="wob")), tried)
    assert found.recover is not None
    assert (found.recover.axis, found.recover.at) == ("rotary_speed", pytest.approx(60 * RPM))
    bound = Beyond(30e3, Grade.CRITICAL, ("whirl",))
    of_weight = Recover(Recovery.ENDS, 40e3, ("whirl",), axis="wob", bound=bound, only_at=("rotary_speed", 9.0))
    told = confirmed(replace(POINT, recover=of_weight), tried).recover
    assert told is not None
    assert (told.bound, told.only_at) == (None, None), "of the weight"
    still = confirmed(replace(POINT, recover=Recover(Recovery.LASTS, None, ("whirl",), axis="wob")), tried).recover
    assert still is not None
    assert still.outcome == Recovery.LASTS


@pytest.mark.parametrize(
    ("found", "by_trial"),
    [
        (None, True),
        (Recover(Recovery.NOT_MET), True),
        (Recover(Recovery.ENDS, 40e3, ("whirl",), axis="wob"), True),
        (Recover(Recovery.ENDS, 90 * RPM, ("whirl",)), True),
        (Recover(Recovery.ENDS, 50 * RPM, ("whirl",)), False),
    ],
)
def test_no_way_down_is_told_where_a_trial_alone_shows_the_end(found, by_trial):
    """A knock is lowered to 60 rpm: a map brought up only, one along the weight, or one whose way down is free
    above that, has no way down that shows it."""
    tried = Trials((*ways("....", "...."), knock(VIBRATES), knock(FREE, name=SLOWED, speed=60)))
    one = confirmed(replace(POINT, recover=found), tried)
    assert one.recover is not None
    assert (one.recover.outcome, one.recover.by_trial) == (Recovery.ENDS, by_trial)
    said = " ".join(Words(one, ("rotary_speed", "wob"), "field", ("up",)).lines())
    said += " ".join(Orders(one, ("rotary_speed", "wob"), "field", ("up",)).do())
    assert ("runs lowered to " in said) == (not by_trial)
    assert ("lowered to it a knocked string came free in a trial" in said) == by_trial
    assert data_of(one, "rotary_speed")["recover"]["by_trial"] is by_trial


def test_a_few_free_ways_among_many_are_no_way_in():
    """Of three rates that were free further ones between them are tried: half of all must be free side by side."""
    rates = np.geomspace(3.0, 10.0, 10)[1:-1]
    more = [
        Trial(SPEED_FIRST, Way.IN, FREE if number % 2 else VIBRATES, rate=rate * RPM)
        for number, rate in enumerate(rates)
    ]
    found = confirmed(POINT, Trials((*ways("www", "ww.."), *more)))
    assert found.kind == Kind.HINT
    assert "6 of 15 ways in ended free in trials" in sentence(found)
    all_free = [replace(one, outcome=FREE) for one in more]
    assert confirmed(POINT, Trials((*ways("www", "ww.."), *all_free))).kind == Kind.FROM_BELOW


def test_where_runs_bounced_no_way_in_is_promised_without_trials():
    """The map bounced elsewhere, and set the weight at its first speed: at lower ones nothing was run."""
    for first, text in ((First.WEIGHT, "Way in: set 22.5 klbf at 40 rpm, then"), (First.SPEED, "Way in: off bottom ")):
        shaken = replace(POINT, way_in=WayIn(first, begins=40 * RPM, is_shaken=True))
        doubt = "not promised without trials, as bit-bounce, which runs met, may begin when the weight is set"
        words, order = (kind(shaken, ("rotary_speed", "wob"), "field", ("up", "down")) for kind in (Words, Orders))
        line = next(one for one in words.lines() if one.startswith("Way in"))
        assert line.startswith(text)
        assert "or less" not in line
        assert doubt in line
        assert doubt in order.do()[0]
        assert data_of(shaken, "rotary_speed")["way_in"]["is_shaken"] is True
        tried = confirmed(shaken, Trials(ways("...", "....")))
        assert doubt not in " ".join(Words(tried, ("rotary_speed", "wob"), "field", ("up", "down")).lines())
    bounces = advise(graded(grid({"up": [["b.....b"] * 5]}, np.arange(1.0, 8.0), np.arange(10e3, 60e3, 10e3))))
    assert bounces.way_in is None or bounces.way_in.is_shaken


def test_a_slower_drive_is_not_forbidden_what_it_is_told_to_do():
    past = WayIn(First.SPEED, rate=8 * RPM, wall=(60 * RPM, 68 * RPM), crosses=True)
    found = confirmed(replace(POINT, way_in=past), Trials(ways("....ww", "ww...")))
    orders = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down"))
    assert "weight first, then the speed at 0.2 to 1 rpm/s" in orders.do()[0]
    assert "before the speed" not in " ".join(orders.do_not())


def test_the_string_as_it_is_shows_no_more_than_a_finer_map():
    ends = (90 * RPM, 160 * RPM)
    as_it_is = Change("none", "", "", "as it is", room=1.5, free=(ends,), widest=ends)
    other = Change("span", "k", "30 ft", "stabilisers 30 ft apart", room=1.2, free=(ends,), widest=ends)
    assert Trials(changes=(as_it_is, other)).best == as_it_is
    assert Trials(changes=(as_it_is, other), mapped=True).best is None, "with less room it helps nothing"
    assert Trials(changes=(as_it_is, replace(other, room=1.6)), mapped=True).best is None, "a hair more"
    more = replace(other, room=2.5)
    assert Trials(changes=(as_it_is, more), mapped=True).best == more
    tried = replace(more, trials=ways("...", ".w.w"))
    now = Trials(ways("...", ".w.."), changes=(as_it_is, tried), mapped=True)
    assert now.best is None, "fewer ways in reach it"
    fully = replace(more, room=2.6, key="e", trials=ways("...", "...."))
    more_room = replace(tried, room=3.5)
    assert Trials(changes=(as_it_is, more_room, fully), mapped=True).best == fully


def test_a_change_is_compared_with_the_string_as_it_is_run_in_the_same_steps():
    """The map, in steps of 2 rpm, is free at 28 to 56 rpm; in those of the changes the string as it is is free at no
    speed and soft torque at 20 to 45 rpm: better, though less so than beside the map."""
    ends = (20 * RPM, 45 * RPM)
    free = ((28 * RPM, 56 * RPM),)
    none = Change("none", "", "", "as it is", room=0.0, wob=20 * KLBF)
    soft = Change("drive", "drive.kind", "soft_torque", "soft torque", (ends,), 1.2, ends, wob=20 * KLBF)
    by_map = replace(none, free=free, widest=free[0], room=1.4)
    found = Trials(
        changes=(none, soft), wob=20 * KLBF, mapped=True, by_map=by_map, begins=20 * RPM, steps=(5 * RPM, 2 * RPM)
    )
    assert found.as_it_is == none
    assert found.best == soft
    told = list(trial_words.lines(found, "rotary_speed", FIELD))
    assert "one way up from 20 rpm in steps of at most 5 rpm at 20 klbf" in told[0]
    assert told[1].startswith("  The map has steps of 2 rpm: compare the changes with the string as it is, run in")
    assert told[3].startswith("  as it is, by the map   ")
    assert "free at 28 to 56 rpm; along the speed room for 1.4 tolerances" in told[3]
    assert told[4].startswith("  as it is   ")
    assert "free at no speed that was run" in told[4]
    pony = replace(soft, words="stabilisers 45 ft apart with pony collars")
    of_pony = list(trial_words.lines(replace(found, changes=(none, pony)), "rotary_speed", FIELD))
    assert "pony collars free at 20 to 45 rpm" in of_pony[5]
    alike = list(trial_words.lines(replace(found, steps=(5 * RPM, 5 * RPM)), "rotary_speed", FIELD))
    assert alike[1:] == told[3:], "in equal steps there is nothing to say"
    data = data_of(confirmed(POINT, found), "rotary_speed")
    assert (data["as_it_is_by_map"]["room"], data["as_it_is_by_map"]["at_other_weights"]) == (1.4, [])
    assert [one["room"] for one in data["changes"]] == [0.0, 1.2]
    assert data["changes_step"] == {"rotary_speed": 5 * RPM}
    assert data_of(confirmed(POINT, replace(found, by_map=None)), "rotary_speed")["as_it_is_by_map"] is None
    failed = replace(none, room=None, why="25 of 25 runs failed")
    assert replace(found, changes=(failed, soft)).best is None, "then the map is what is known"


def test_room_that_is_of_the_steps_alone_is_no_gain():
    """The map has no room, and allows nothing. In the coarser steps of the changes the string as it is has 1.5
    tolerances, as a change has there too: that is of the steps."""
    ends = (90 * RPM, 160 * RPM)
    by_map = Change("none", "", "", "as it is", room=0.4, wob=20 * KLBF)
    now = replace(by_map, room=1.5, free=(ends,), widest=ends)
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", (ends,), 1.6, ends, wob=20 * KLBF)
    found = Trials(changes=(now, span), wob=20 * KLBF, mapped=True, nothing=True, by_map=by_map)
    assert found.helping == []
    assert found.best is None, "nor is that of the string as it is a setting, which its map has not"
    more = replace(span, room=2.6)
    assert replace(found, changes=(now, more)).best == more
    assert replace(found, by_map=replace(by_map, room=1.5)).helping == [span], "what the map has, it takes away itself"


def test_a_hint_says_how_slow_and_how_a_vibration_ends():
    """Of five orders at most, with what would help and what is watched."""
    hint = replace(POINT, kind=Kind.HINT, recover=Recover(Recovery.ENDS, 70 * RPM, ("whirl",), free_to=50 * RPM))
    of_map = (("rotary_speed", "wob"), "field", ("up", "down"))
    orders, goes_on = Orders(hint, *of_map), "If any vibration goes on: pick up, stop the rotation, start again."
    lower = "If it whirls: lower to 70 rpm, though that is below the limits; "
    again = "Then pick up and come in again as above. "
    assert orders.to_confirm()[1] == f"{lower}runs lowered to 50 to 70 rpm were free. {again}{goes_on}"
    assert orders.to_confirm(room=1) == ["Bring up to 22.5 klbf and 100 rpm from below."]
    assert [one[:5] for one in orders.do()] == ["Take "]
    for above, may_stay in ((80, False), (60, True)):  # where another run need not end there
        wall = replace(hint, kind=Kind.FROM_BELOW, recover=replace(hint.recover, lasts_above=above * RPM))
        told = Orders(wall, *of_map)
        may = f"only at 70 rpm, below the limits; a collar on the wall may stay there above {above} rpm."
        assert ("If it vibrates: pick up, stop the rotation, start again." in told.do()) == may_stay
        assert (f"Do not slow down to cure whirl: in the map it ended {may}" in told.do_not()) == may_stay
        once = f"If it whirls: pick up, stop the rotation, start again; in the map it ended {may}"
        assert (once in told.lines()) == may_stay
        assert ("lower to 70 rpm" not in " ".join([*told.lines(), *told.do()])) == may_stay
        assert ("were free" not in " ".join(told.lines())) == may_stay
        assert told.sentence().endswith("whirl, once started, may not stop.") == may_stay
    assert orders.do_not()[0].startswith(
        "Once there, do not go below 85 rpm but to end a vibration as ordered: at 80 rpm it"
    )


@pytest.mark.parametrize(
    ("there", "outcome", "ends"),
    [
        (4.4, VIBRATES, (2.0, 4.0)),  # 5 rad/s is reached over 4.4
        (5.0, STALLED, (2.0, 4.0)),
        (5.2, VIBRATES, (2.0, 5.0)),
        (3.6, VIBRATES, (4.0, 6.0)),
        (6.5, VIBRATES, (2.0, 6.0)),  # one does not go there
        (4.4, FREE, (2.0, 6.0)),
        (4.4, UNKNOWN, (2.0, 6.0)),
    ],
)
def test_an_excursion_after_which_it_vibrates_cuts_what_to_stay_within(there, outcome, ends):
    """The map allows 2 to 6 rad/s at each weight, and the setting is 4 rad/s at 30 kN."""
    results = grid({"up": [["s.....w"] * 5]}, np.arange(1.0, 8.0), np.arange(10e3, 60e3, 10e3))
    maps = graded(results)
    advice = advise(maps)
    assert advice.point == {"rotary_speed": 4.0, "wob": 30e3}
    trial = Trial("10 % faster and back", Way.EXCURSION, outcome, ("whirl",), speed=4.0, there=there)
    cut = without(maps, advice, Trials((trial,)).bad_excursions)
    one = cut.stay_within["rotary_speed"]
    assert (one.low, one.high) == ends
    if ends[1] < there < 6.0:
        assert one.above.by_trial
        assert one.above.responses == ("whirl",)
        assert cut.never_exceed("rotary_speed") == ends[1]


def test_the_weight_first_is_ordered_as_it_was_tried():
    """In what time the weight was set, and how long one waited before the speed was raised."""
    tried = replace(Trials(ways("....", "wwww")), set_down=(5.0, 20.0), held=(0.0, 120.0))
    found = confirmed(replace(POINT, way_in=WayIn(First.WEIGHT, begins=40 * RPM)), tried)
    order = Orders(found, ("rotary_speed", "wob"), "field", ("up", "down")).do()[0]
    held = "in 5 to 20 s, hold 0 to 120 s"
    assert order == f"Set 22.5 klbf at 40 rpm {held}. Then raise the speed to 100 rpm at 0.2 to 10 rpm/s."
    assert data_of(found, "rotary_speed")["held_for"] == {"from": 0.0, "to": 120.0}
    off_bottom = confirmed(POINT, replace(tried, trials=ways("www", "....")))
    order = Orders(off_bottom, ("rotary_speed", "wob"), "field", ("up", "down")).do()[0]
    assert order.endswith(" at 0.2 to 10 rpm/s. Then within 120 s set 22.5 klbf in 5 to 20 s.")


def test_a_rate_is_free_where_all_that_were_run_at_it_are():
    """Weight first whirls at 1 rpm/s in one of seven, by how long one waits and how the weight is set."""
    again = [Trial(WEIGHT_FIRST, Way.IN, FREE, rate=RPM, held=held) for held in (0.0, 41.7, 61.1, 93.3, 120.0)]
    whirls = Trial(WEIGHT_FIRST, Way.IN, VIBRATES, ("whirl",), rate=RPM, held=20.0)
    tried = Trials((*ways(".....", "wwww"), *again, whirls))
    found = confirmed(replace(POINT, way_in=WayIn(First.WEIGHT)), tried)
    assert (found.way_in.rate, found.way_in.most) == (pytest.approx(5 * RPM), pytest.approx(10 * RPM))
    assert "weight first, 5 to 10 rpm/s, and stay" in sentence(found)
    assert trial_words.ways_words(tried).startswith("weight first: 3 of 3 free at 3 rpm/s or faster, 7 of 8 slower; ")
    rows = list(trial_words.lines(tried, "rotary_speed", FIELD))
    assert sum("weight first, 1 rpm/s" in row for row in rows) == 1
    assert next(row for row in rows if "weight first, 1 rpm/s" in row).endswith("6 of 7 free, else whirl")
    past = WayIn(First.SPEED, rate=8 * RPM, wall=(60 * RPM, 68 * RPM), crosses=True)
    slow = replace(tried, trials=(*ways("....ww", "ww..."), replace(whirls, rate=0.2 * RPM)))
    order = Orders(confirmed(replace(POINT, way_in=past), slow), ("rotary_speed", "wob"), "field", ("up", "down"))
    assert order.do()[0].endswith("If the drive is slower: do not use this setting.")


def test_the_fastest_rate_is_no_faster_than_the_fastest_trial():
    assert FIELD.rates(1.23 * RPM, 4.57 * RPM) == "1.3 to 4.5 rpm/s"
    assert FIELD.rates(0.2 * RPM, 10.0 * RPM) == "0.2 to 10 rpm/s"
    assert Formatter("si").rates(1.23 * RPM, 4.57 * RPM) == "0.14 to 0.47 rad/s² (1.3 to 4.5 rpm/s)"


def test_a_trial_that_passes_the_wall_slowly_does_not_take_the_margin_of_the_rate():
    """Free at all rates, the slowest by a hair: what passes is the estimate with its margin, and faster; where the
    fastest trial is slower than that, trials alone tell."""
    way = WayIn(wall=(60 * RPM, 68 * RPM), passing_rate=1.0 * RPM, rate=2.0 * RPM, crosses=True)
    found = confirmed(replace(POINT, way_in=way), Trials(ways("www", "....")))
    assert found.way_in.first == First.SPEED
    assert found.way_in.rate == pytest.approx(2.0 * RPM)
    below = confirmed(replace(POINT, way_in=replace(way, crosses=False)), Trials(ways("www", "....")))
    assert below.way_in.rate < 1.0 * RPM
    slow = confirmed(replace(POINT, way_in=replace(way, rate=99 * RPM)), Trials(ways("www", "....")))
    assert slow.way_in.rate < 1.0 * RPM


def test_a_change_says_on_which_damping_it_rests_and_what_the_least_that_is_usual_leaves():
    """12 1/4 in, 30 degrees: 97 to 190 rpm with a ratio of 0.039, and 154 to 190 rpm with 0.02, as strings have."""
    ends, weights = (97 * RPM, 190 * RPM), (13 * KLBF, 17 * KLBF)
    how = {"weights": weights, "speed": 170 * RPM, "trials": ways("...", "...."), "ratio": 0.039, "wob": 15 * KLBF}
    span = Change("span", "k", "30 ft", "stabilisers 30 ft apart", (ends,), room=5.0, widest=ends, **how)
    less = replace(span, widest=(154 * RPM, 190 * RPM), room=1.5)
    as_it_is = Change("none", "", "", "as it is", room=0.0)

    def told(low: Change | None, brief: bool = False) -> str:
        found = Trials(changes=(as_it_is, replace(span, low=low)), wob=15 * KLBF)
        return trial_words.best_words(found, "rotary_speed", FIELD, brief=brief)

    assert told(less).endswith("13 to 17 klbf (damping ratio 0.039; with 0.02 only 154 to 190 rpm)")
    assert told(replace(less, weights=(15 * KLBF, 17 * KLBF))).endswith(
        "with 0.02 only 154 to 190 rpm at 15 to 17 klbf)"
    )
    assert told(less, brief=True) == "stabilisers 30 ft apart would free 154 to 190 rpm at 13 to 17 klbf"
    assert told(span).endswith("(damping ratio 0.039, the same with 0.02)")
    nothing = replace(less, room=0.0)
    assert "may free 97 to 190 rpm at 13 to 17 klbf (damping ratio 0.039; nothing with 0.02)" in told(nothing)
    assert told(nothing, brief=True).endswith(" (nothing with damping 0.02)")
    assert told(None).endswith("(damping ratio 0.039)")
    data = data_of(confirmed(POINT, Trials(changes=(replace(span, low=less),))), "rotary_speed")["changes"][0]
    assert data["damping_ratio"] == 0.039
    assert data["with_low_damping"]["rotary_speed"]["from"] == pytest.approx(154 * RPM)


@pytest.mark.parametrize("below", [(), ((50 * RPM, 60 * RPM),)])
@pytest.mark.parametrize("holds_usual", [None, False])
@pytest.mark.parametrize("words", ["stabilisers 30 ft apart", "a bit of which friction falls less with the speed"])
def test_a_sentence_with_what_helps_has_no_more_words_than_one_may_have(words, holds_usual, below):
    """However long what helps is; what the sentence leaves out stands on a line of its own."""
    ends, speed = (90 * RPM, 160 * RPM), 120 * RPM
    as_it_is = Change("none", "", "", "as it is", room=0.0)
    free, how = (*below, ends), {"room": 2.8, "widest": ends, "speed": speed}
    best = Change("span", "k", "30 ft", words, free, holds_usual=holds_usual, **how)
    own = Change("none", "", "", "as it is", (ends,), room=2.8, widest=ends)
    stops = (("stick_slip", 45 * RPM, 80 * RPM), ("bit_bounce", 60 * RPM, 90 * RPM), ("whirl", 45 * RPM, 180 * RPM))
    nothing = Advice(Kind.NOTHING, stops=stops)
    above = replace(POINT, kind=Kind.NOTHING, grade=Grade.ONLY_FROM_ABOVE, stops=stops)
    hint = replace(POINT, kind=Kind.HINT, narrow=True)
    for changes in ((as_it_is, best), (own,)):
        for advice in (nothing, above, hint, POINT):
            trials = Trials(ways("www", "wwww") if advice is POINT else (), changes=changes, wob=20 * KLBF)
            for units in ("field", "si"):
                text = Words(confirmed(advice, trials), ("rotary_speed", "wob"), units, ("up", "down")).sentence()
                assert is_short(text), text
