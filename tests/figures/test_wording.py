"""The sentence of every kind of answer, of at most thirty words, and at most five lines beside
it, of maps in which they can be read off by eye."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from analysis.grids import grid

from nsdrill.analysis.advice import Advice, Border, Kind, Recover, Recovery, Stretch, Surface
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.window import find_window
from nsdrill.data import Results, json_text
from nsdrill.models.responses import WHIRL
from nsdrill.units import from_si, to_si
from nsdrill.variables import Unknown
from nsdrill.words.answer import answer, warnings, words_of
from nsdrill.words.orders import Orders
from nsdrill.words.values import Formatter
from nsdrill.words.wording import MOST_LINES, MOST_WORDS, Words

RPM, KLBF = to_si("1 rpm", "rad/s"), to_si("1 klbf", "N")

SPEEDS = [to_si(f"{rpm} rpm", "rad/s") for rpm in range(70, 131, 10)]
WEIGHTS = [to_si(f"{weight} klbf", "N") for weight in (10, 15, 20, 25, 30)]
WALL = {
    "axis": "rotary_speed",
    "name": "wall_speed",
    "words": "the speed at which the collar reaches the wall",
    "told": "A COLLAR ON THE WALL MAY STAY THERE",
    "safe_while": "nothing brings it to the wall",
    "min": to_si("59 rpm", "rad/s"),
    "max": to_si("60 rpm", "rad/s"),
    "lasts": [to_si("33 rpm", "rad/s"), to_si("36 rpm", "rad/s")],
    "from": None,
    "everywhere": False,
    "each": False,
    "jumped": None,
    "range": {"from": to_si("59 rpm", "rad/s"), "to": to_si("68 rpm", "rad/s"), "enough": 0.1},
    "passing_rate": to_si("0.8 rpm/s", "rad/s^2"),
    "off_bottom": {
        "from": to_si("60.4 rpm", "rad/s"),
        "to": to_si("67.6 rpm", "rad/s"),
        "passing_rate": to_si("0.9 rpm/s", "rad/s^2"),
        "sure_rate": to_si("1.8 rpm/s", "rad/s^2"),
        "swing": 0.3,
    },
}
FREE, ROLLS, STICKS = ["s.....w"] * 5, ["swwwwww"] * 5, ["sssssww"] * 5


def made(
    lasting: Any = None, speeds: Any = SPEEDS, weights: Any = WEIGHTS, along: str = "rotary_speed", **ways: Any
) -> Results:
    results = grid({way: [lines] for way, lines in ways.items()}, speeds, weights)
    results.attrs["lasting_motions"] = json_text([lasting] if lasting else [])
    results.attrs["study_resolved"] = json_text({"sweep": {"along": along}})
    return results


def with_samples(free: list[list[float]], count: int = 20) -> Results:
    """A way up in which these shares of the samples are free, and the others whirl."""
    one = made(up=["." * len(free[0])] * len(free), speeds=SPEEDS[: len(free[0])], weights=WEIGHTS[: len(free)])
    response = np.where(np.arange(count) < np.round(np.array(free) * count)[..., None], 0, WHIRL)[None, None]
    variables = {name: np.repeat(values[..., None], count, axis=-1) for name, values in one.variables.items()}
    rock = Unknown("bit.rock_stiffness", "N/m", "rock")
    return Results(
        {**one.coords, "sample": np.arange(count)},
        {**variables, "response": response.astype(np.int8)},
        one.attrs,
        (),
        {rock: np.linspace(1e7, 2e7, count)},
    )


def over_depths() -> Results:
    maps = [["s.....w"], ["s....ww"], ["sssssww"]]
    return grid({"up": maps, "down": maps}, SPEEDS, WEIGHTS[:1], [500.0, 3688.0, 4750.0])


def of_starts() -> Results:
    one = made(same=["......w"] * 5)
    variables = {name: np.repeat(values[..., None], 4, axis=-1) for name, values in one.variables.items()}
    variables["response"][..., :3] = WHIRL
    return Results({**one.coords, "start": np.arange(4)}, variables, one.attrs)


CASES = {
    "it lasts": (
        made(WALL, up=FREE, down=ROLLS),
        "Bring up to 15 klbf and 100 rpm from below; stay at 80 to 120 rpm, 10 to 30 klbf: whirl, once started, does "
        "not stop.",
    ),
    "it was not met": (
        made(WALL, up=[line[:6] for line in FREE], down=[line[:6] for line in FREE], speeds=SPEEDS[:6]),
        "Bring up to 15 klbf and 100 rpm from below; stay at 80 to 120 rpm, 10 to 30 klbf: whirl, once started, may "
        "not stop.",
    ),
    "it ends lower": (
        made(up=["......w"] * 5, down=["..wwwww"] * 5),
        "Bring up to 15 klbf and 90 rpm from below; stay at 70 to 120 rpm, 10 to 30 klbf: whirl, once started, ends "
        "when lowered to 80 rpm.",
    ),
    "after any history": (
        made(up=FREE, down=FREE),
        "Run at 15 klbf and 100 rpm: free of vibration at 80 to 120 rpm, 10 to 30 klbf, brought up from below or back "
        "down after vibration.",
    ),
    "up alone": (
        made(up=FREE),
        "Bring up to 15 klbf and 100 rpm from below; stay at 80 to 120 rpm, 10 to 30 klbf. No run tells what a "
        "disturbance does.",
    ),
    "a quick start": (
        made(WALL, up=["wwwwwww"] * 5, down=["wwwwwww"] * 5, same=["......w"] * 5),
        "Go to 15 klbf and 90 rpm quickly, 1.8 rpm/s or faster; stay at 70 to 120 rpm, 10 to 30 klbf. Brought up "
        "slowly from 70 rpm it whirls.",
    ),
    "started there": (
        made(same=["......w"] * 5),
        "Run at 15 klbf and 90 rpm, started there: free of vibration at 70 to 120 rpm, 10 to 30 klbf. How it is "
        "reached was not run.",
    ),
    "no room": (
        made(up=["sss.www"] * 5),
        "No setting has room. Narrow hint: 20 klbf and 100 rpm, free when brought up from below, 10 to 30 klbf; at 110 "
        "rpm and 20 klbf it whirls.",
    ),
    "no room, stalls beside it": (
        made(up=["......", "......", "tttttt"], speeds=SPEEDS[:6], weights=WEIGHTS[:3]),
        "Narrow hint: 10 klbf and 90 rpm, free when brought up from below, 70 to 120 rpm, 10 to 15 klbf (on the "
        "limit); from 20 klbf the bit stalls.",
    ),
    "no room, failed beside it": (
        made(up=["xxxxxx", "......", "......"], speeds=SPEEDS[:6], weights=WEIGHTS[:3]),
        "Narrow hint: 15 klbf and 90 rpm, free when brought up from below, 70 to 120 rpm, 15 to 20 klbf (on the "
        "limit); at 10 klbf nothing is known.",
    ),
    "over depths": (
        over_depths(),
        "From 1640 to 12100 ft 90 rpm is free of vibration, brought up from below; at 15584 ft no longer.",
    ),
    "samples": (
        with_samples([[0.1, 0.95, 0.95, 0.95, 0.95, 0.95, 0.1]] * 5),
        "Bring up to 15 klbf and 100 rpm from below; free of vibration with 95 % (76 to 99). Stay within 80 to 120 "
        "rpm, 10 to 30 klbf.",
    ),
    "samples, none": (
        with_samples([[0.1, 0.55, 0.2]] * 3),
        "Nothing is 90 % safe. Best: 10 klbf and 80 rpm, brought up from below, 55 % (34 to 74).",
    ),
    "samples, narrow": (
        with_samples([[0.1, 1.0, 0.2]] * 3),
        "Narrow hint: 15 klbf and 80 rpm, brought up from below, 100 % (84 to 100), 10 to 20 "
        "klbf; at 70 rpm and 15 klbf it whirls.",
    ),
    "nothing": (made(up=STICKS, down=ROLLS), "Nothing is safe: stick-slip at 70 to 110 rpm, whirl at 120 to 130 rpm."),
    "only from above": (
        made(up=STICKS, down=["....sww"] * 5),
        "Nothing is safe brought up from below. 15 klbf and 80 rpm is free only when lowered from above; stick-slip "
        "at 70 to 110 rpm, whirl.",
    ),
    "what covers most stops first": (
        made(up=["Bwwwwww"] * 5),
        "Nothing is safe: whirl at 70 to 130 rpm, bit-bounce at 70 rpm.",
    ),
    "lowered only": (
        made(down=FREE),
        "Hint only: 15 klbf and 100 rpm is free when lowered from above. Nothing was brought up from below.",
    ),
    "the sweep begins above": (
        made({**WALL, "from": SPEEDS[0], "everywhere": True}, up=FREE, down=FREE),
        "Hint only: 15 klbf and 100 rpm. The sweep begins above the speed at which the collar reaches the wall; "
        "nothing was brought up through it.",
    ),
    "many starts": (
        of_starts(),
        "Hint only: 15 klbf and 90 rpm is free of vibration from 1 of 4 starts (5 to 70 %). How it is brought up "
        "there was not run.",
    ),
    "no answer": (
        made(up=["xxxxxxx"] * 5),
        "No answer: of no point is enough known, as its runs failed, are missing or tell nothing.",
    ),
    "all stalled": (made(up=["ttttttt"] * 5), "Nothing is safe: stalled at 70 to 130 rpm."),
}


@pytest.mark.parametrize("lightest", [".wwwwww", "wwwwwww"])
def test_to_where_a_vibration_is_lowered_names_the_weight_where_it_lasts_at_another(lightest):
    """Whirl ends at 70 rpm; within the limits it lasts there at the least weight, or nowhere."""
    found = find_window(made(up=FREE, down=[lightest, *[".wwwwww"] * 4]))
    advice, words, is_all = found["answer"], words_of(found, "field"), lightest == ".wwwwww"
    assert advice.stay_within["wob"].low == WEIGHTS[0] < advice.point["wob"]
    assert advice.recover.at == SPEEDS[0]
    at = words.setting_of("wob")
    text = " ".join([words.sentence(), *words.lines()])
    assert ("lowered to 70 rpm" in text, f"lowered to 70 rpm at {at}" in text) == (True, not is_all), text
    assert f"lower to 70 rpm{'' if is_all else f' at {at}'}, though" in text, text
    assert advice.recover.only_at == (None if is_all else ("wob", advice.point["wob"]))


@pytest.mark.parametrize("case", CASES)
def test_the_sentence(case):
    results, said = CASES[case]
    found = find_window(results)
    told = answer(found, "field")
    assert told == said
    for units in ("si", "field"):
        # a speed in rad/s has the rpm in brackets
        assert len(re.sub(r" \([^)]* rpm\)", "", answer(found, units)).split()) <= MOST_WORDS
        assert len(words_of(found, units).lines()) <= MOST_LINES


@pytest.mark.parametrize(
    ("axes", "held", "says"),
    [
        (("rotary_speed",), {"wob": 20 * KLBF}, "stay at 80 to 120 rpm at 20 klbf:"),
        (("rotary_speed", "wob"), {}, "stay at 80 to 120 rpm, 10 to 30 klbf:"),
        (("rotary_speed", "wob"), {"single": 20 * KLBF}, "stay at 80 to 120 rpm at 20 klbf:"),
    ],
)
def test_a_stretch_of_speeds_says_for_which_weights_it_holds(axes, held, says):
    """Of a file with one weight that is its own."""
    ends = {"rotary_speed": Stretch(80 * RPM, 120 * RPM, Border(None), Border(None))}
    point = {"rotary_speed": 100 * RPM}
    if "wob" in axes:
        weights = (held["single"],) * 2 if held else (10 * KLBF, 30 * KLBF)
        ends["wob"], point["wob"] = Stretch(*weights, Border(None), Border(None)), 20 * KLBF
    found = Advice(
        Kind.FROM_BELOW,
        Grade.FROM_BELOW,
        point=point,
        stay_within=ends,
        held={key: value for key, value in held.items() if key == "wob"},
        recover=Recover(Recovery.NOT_MET),
    )
    assert says in Words(found, axes, "field", ("up", "down")).sentence()


@pytest.mark.parametrize(("rpm", "on_limit"), [(130, True), (134, False), (138, True)])
def test_a_hint_that_lies_on_a_limit_says_so(rpm, on_limit):
    ends = {"rotary_speed": Stretch(130 * RPM, 138 * RPM, Border(120 * RPM), Border(140 * RPM))}
    hint = Advice(
        Kind.HINT, Grade.FROM_BELOW, narrow=True, point={"rotary_speed": rpm * RPM}, stay_within=ends, room=0.0
    )
    said = Words(hint, ("rotary_speed",), "field", ("up", "down")).sentence()
    assert ("130 to 138 rpm (on the limit)" in said) == on_limit
    settings = replace(hint, kind=Kind.FROM_BELOW, narrow=False, recover=Recover(Recovery.NOT_MET))
    assert "on the limit" not in Words(settings, ("rotary_speed",), "field", ("up", "down")).sentence()


def lines_of(results: Results) -> list[str]:
    return words_of(find_window(results), "field").lines()


def test_the_lines():
    whirl_below = ["ssw....", *FREE[1:]]
    told = lines_of(made(WALL, up=whirl_below, down=ROLLS))
    assert told == [
        "Slower, at 20 klbf: at 70 rpm it sticks. Faster: at 130 rpm it whirls. Never exceed 120 rpm. "
        "Rests on 20 settings every 5 klbf and 10 rpm, none between.",
        "Lighter, at 100 rpm: the map begins at 10 klbf. Heavier: the map ends at 30 klbf, extend it to learn more.",
        "Way in: off bottom raise the speed to 100 rpm, through 60 to 68 rpm at 1.8 rpm/s or faster without a stop, "
        "then set 20 klbf.",
        "If it whirls: it does not stop in the map; pick up, stop the rotation, start again; a collar on the wall "
        "may stay there above 33 rpm.",
    ]


def test_where_the_wall_holds_a_collar_is_one_speed_in_orders_and_warnings():
    """That at the weight of the setting, rounded down, where at others it is another one."""
    speeds = [to_si(f"{rpm} rpm", "rad/s") for rpm in (32.1, 33.2, 34.9, 36.1, 38.0)]
    by_weight = [{"wob": wob, "rotary_speed": speed} for wob, speed in zip(WEIGHTS, speeds, strict=True)]
    wall = {**WALL, "by_weight": by_weight, "lasts": [speeds[0], speeds[-1]]}
    found = find_window(made(wall, up=FREE, down=ROLLS))
    place = WEIGHTS.index(found["answer"].point["wob"])
    assert found["answer"].recover.lasts_above == speeds[place]
    said = f"may stay there above {int(to_rpm(speeds[place]))} rpm"
    assert any(said in line for line in words_of(found, "field").lines())
    assert any(said.upper().removesuffix("RPM") in text.upper() for text in warnings(found, "field"))
    nowhere = {**wall, "by_weight": [{**one, "rotary_speed": None} for one in by_weight]}
    assert find_window(made(nowhere, up=FREE, down=ROLLS))["answer"].recover.lasts_above is None


def to_rpm(speed: float) -> float:
    return from_si(speed, "rpm")


AGAIN = "if it goes on, pick up, stop the rotation, start again."


@pytest.mark.parametrize(
    ("weights", "speeds", "cure"),
    [
        (
            (10, 20),
            (85, 115),
            f"first take weight off, not below 10 klbf, or raise the speed, not above 115 rpm; {AGAIN}",
        ),
        ((15, 20), (85, 115), f"first raise the speed, not above 115 rpm; {AGAIN}"),
        ((15, 20), (85, 100), "pick up, stop the rotation, start again."),
        (None, (85, 100), f"first take weight off; {AGAIN}"),
    ],
)
def test_the_cure_of_stick_slip_stays_within_the_limits(weights, speeds, cure):
    """And no order lowers the speed for it, also where the way down of the map ended it."""
    ends = {"rotary_speed": [to_si(f"{end} rpm", "rad/s") for end in speeds]}
    if weights:
        ends["wob"] = [to_si(f"{end} klbf", "N") for end in weights]
    within = {axis: Stretch(*found, Border(None), Border(None)) for axis, found in ends.items()}
    point = {"wob": WEIGHTS[1], "rotary_speed": SPEEDS[3]}
    seen, down = Surface(3e3, sticking=(1e3, 5e3)), Recover(Recovery.ENDS, SPEEDS[1], ("stick_slip",))
    advice = Advice(Kind.FROM_BELOW, point=point, stay_within=within, surface=seen, recover=down)
    of_map = (("rotary_speed", "wob"), "field", ("up", "down"))
    orders = Orders(advice, *of_map)
    told = " ".join(orders.do())
    assert re.search(r"it is stick-slip: (.*?\.)(?: |$)", told)[1] == cure
    assert "If it vibrates otherwise: pick up, stop the rotation, start again." in told
    assert "lower to" not in told + " ".join(orders.lines())
    hint = Orders(replace(advice, kind=Kind.HINT), *of_map).to_confirm()
    assert "If it vibrates: pick up, stop the rotation, start again." in hint, "before what is watched"
    whirls = Orders(replace(advice, recover=replace(down, responses=("stick_slip", "whirl"))), *of_map)
    assert "If it whirls: lower to 80 rpm" in " ".join(whirls.do())
    assert "If it whirls: lower to 80 rpm" in " ".join(whirls.lines())


def test_what_is_free_from_a_quick_start_bounds_what_is_free_from_below():
    """From 100 rpm on the slow way up whirls: a string that was brought up to 80 rpm and is
    then raised slowly meets that."""
    found = find_window(made(WALL, up=["....www"] * 5, down=["wwwwwww"] * 5, same=["......w"] * 5))["answer"]
    assert found.kind == "from_below"
    assert found.stay_within["rotary_speed"].high == SPEEDS[3]
    assert found.never_exceed("rotary_speed") == SPEEDS[3]


@pytest.mark.parametrize("severity", [1, 2, 3])
def test_the_answer_is_that_of_the_strictest_level_that_has_one(severity):
    """What is free of vibration is not given up where a severity is allowed."""
    results = made(up=FREE, down=FREE)
    for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
        results.variables[name] = np.where(results["response"] > 0, 1, 0).astype(np.int8)
    found = find_window(results, severity)
    assert found["safe"] == 35
    assert found["answer"] == find_window(results)["answer"]
    assert answer(found, "field").startswith("Run at 15 klbf and 100 rpm: free of vibration at 80 to 120 rpm")
    results = made(up=["sssssss"] * 5)
    for name in ("bounce_severity", "stick_slip_severity", "whirl_severity"):
        results.variables[name] = np.full(results["response"].shape, 1, dtype=np.int8)
    assert find_window(results, severity)["answer"].severity == 1


def words_along_weight(**ways: Any) -> Any:
    """The words of maps whose weight was raised, and lowered, at each speed."""
    return words_of(find_window(made(along="wob", **ways)), "field")


def test_along_weight_the_weight_is_raised():
    """Each speed is swept by itself: nothing is brought up, lowered or slowed in speed."""
    free = ["s.....w"] * 4 + ["wwwwwww"]
    words = words_along_weight(up=free, down=free)
    assert words.sentence() == (
        "Run at 15 klbf and 100 rpm: free of vibration at 80 to 120 rpm, 10 to 25 klbf, with the weight raised "
        "or lowered after vibration."
    )
    assert "Heavier: at 30 klbf it whirls. Never exceed 25 klbf." in " ".join(words.lines())
    assert (
        "Way in: off bottom raise the speed to 100 rpm, then raise the weight from 10 klbf to 15 klbf." in words.lines()
    )
    lasts = words_along_weight(up=free, down=["wwwwwww"] * 5)
    assert lasts.sentence().startswith("Raise the weight to ")
    assert "klbf at 100 rpm; stay at 80 to 120 rpm, 10 to 25 klbf: whirl, once" in lasts.sentence()
    ends = words_along_weight(up=free, down=["s.....w"] * 2 + ["wwwwwww"] * 3)
    assert ends.sentence().endswith("once started, ends when lowered to 15 klbf.")
    above = words_along_weight(up=["wwwwwww"] * 5, down=["......."] * 5)
    assert above.sentence().startswith("Nothing is safe with the weight raised.")
    assert "is free only with the weight lowered;" in above.sentence()
    for one in (words, lasts, ends, above):
        said = " ".join([one.sentence(), *one.lines()])
        assert "brought up" not in said
        assert "coming down" not in said
        assert len(one.sentence().split()) <= MOST_WORDS


def test_a_speed_that_stands_is_no_sweep_that_begins():
    """Of a speed that was not raised nothing begins above a critical speed."""
    passed = {**WALL, "from": to_si("70 rpm", "rad/s"), "each": True}
    words = words_of(find_window(made(passed, along="wob", up=FREE, down=FREE)), "field")
    assert words.sentence().startswith("Hint only: ")
    assert "Each speed is swept by itself, above the speed at which the collar reaches the wall" in words.sentence()


def test_where_nothing_is_safe_points_near_a_limit_are_named():
    """A point that is touching the wall on the way up is neither free nor whirling."""
    results = made(up=["sss..ww"] * 5, down=["sss..ww"] * 5)
    results.variables["wall_contact_fraction"] = np.full(results["status"].shape, 0.005)
    assert answer(find_window(results), "field") == (
        "Nothing is safe: stick-slip at 70 to 90 rpm, whirl at 120 to 130 rpm, near a limit at 100 to 110 rpm."
    )
    assert find_window(results)["answer"].near == (("borderline", SPEEDS[3], SPEEDS[4]),)


def test_nothing_safe_is_said_of_what_is_known_only():
    results = made(up=["sssssss"] * 4 + ["xxxxxxx"], down=["sssssss"] * 4 + ["xxxxxxx"])
    words = words_of(find_window(results), "field")
    assert words.sentence().startswith("Nothing is known to be safe:")
    assert words.order() == "no point is known to be safe"


def test_equal_ends_are_one_value():
    """In the digits that are printed."""
    assert Formatter("field").range("rotary_speed", [3.01905, 3.019052]) == "28.8 rpm"


@pytest.mark.parametrize(
    ("rpm", "up", "tail"),
    [
        ((50, 60, 70, 76, 90), "ss.ss", "a finer map around it would show more"),  # 60 to 76 rpm: 8 rpm to either side
        ((50, 64, 70, 76, 90), "ss.ss", "no finer map shows room between 64 rpm and 76 rpm"),  # 6 rpm of 7
        ((50, 60, 70, 76), "sss.", "the sweep ends beside it, extend it to learn more"),
    ],
)
def test_a_finer_map_is_advised_only_where_it_could_show_room(rpm, up, tail):
    """A setting needs a tenth of its speed to either side."""
    speeds = [to_si(f"{one} rpm", "rad/s") for one in rpm]
    text = answer(find_window(made(speeds=speeds, weights=WEIGHTS[:1], up=[up])), "field")
    assert text.startswith("No setting has room.")
    assert text.endswith(f"; {tail}.")
