"""What ends a vibration: what was lowered and what was brought up are two things, nothing is said of speeds at which
nothing was run, and an order has room for what a driller holds or says that it has none."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsdrill.analysis.advice import Kind, Recovery, data_of
from nsdrill.analysis.confirmed import confirmed
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Label
from nsdrill.analysis.room import tolerance
from nsdrill.analysis.trials import SPEED_FIRST, TAGGED, WEIGHT_FIRST, Outcome, Trial, Trials, Way
from nsdrill.analysis.window import find_window
from nsdrill.data import STICKS_TO, Results, json_text
from nsdrill.words.answer import needed_for_words, words_of
from nsdrill.words.orders import Orders

from .grids import grid

RPM, KLBF = np.pi / 30, 4448.2216152605
NOWHERE = {"over": [], "unstable_to": [0.0], "lasts_to": [0.0], "from_rest": False}


def row(step: float, first: float = 20.0, **ways: str | list[str]) -> Results:
    """Maps from ``first`` [rpm] on every ``step`` [rpm], of a weight each line, in which stick-slip does not last."""
    drawn = {way: [[lines] if isinstance(lines, str) else lines] for way, lines in ways.items()}
    rows, columns = (len(next(iter(drawn.values()))[0]), len(next(iter(drawn.values()))[0][0]))
    results = grid(drawn, RPM * (first + step * np.arange(columns)), KLBF * (5.0 + 5.0 * np.arange(rows)))
    return replace(results, attrs={**results.attrs, STICKS_TO: json_text(NOWHERE)})


def way_out(results: Results) -> str:
    """The line that says what ends a vibration."""
    lines = words_of(find_window(results), "field").lines()
    return next((line for line in lines if line.startswith("If it")), "")


@pytest.mark.parametrize("up", ["ss.......b", "bsb......b", "bbb......b"])
def test_what_vibrates_only_when_brought_up_bounds_no_lowering(up):
    """At 20 to 30 rpm what is brought up vibrates and what was lowered is free: the order to lower to 30 rpm was
    "but not to 25 rpm, where it bounces"."""
    results = row(5.0, up=up, down="...bbbbbbb")
    found = find_window(results)["answer"].recover
    assert (found.bound, found.free_to, found.held_to) == (None, 20 * RPM, None)
    assert found.at == 30 * RPM
    line = way_out(results)
    assert "; runs lowered to 20 to 30 rpm were free, those brought up there met " in line
    assert "lower to 30 rpm" in line
    assert "but not" not in line
    data = data_of(find_window(results)["answer"], "rotary_speed")["recover"]
    assert (data["free_to"], data["bound"]) == ({"rotary_speed": 20 * RPM}, None)
    assert set(data["raised"]) == set(found.raised) > set()


@pytest.mark.parametrize(
    ("down", "step", "says"),
    [
        ("..bbbbbbbb", 2.0, "lower to 22 rpm, though that is below the limits, but not below 20 rpm, as no run here"),
        (".bbbbbbbbb", 2.0, "lower to 20 rpm, though that is below the limits, but not below it, as no run here was"),
        ("bs..bbbbbb", 2.0, "lower to 26 rpm, though that is below the limits, but not to 22 rpm, where it sticks (no"),
        ("bs..bbbbbb", 5.0, "lower to 35 rpm, but not to 25 rpm, where it sticks; runs lowered to 30 to 35 rpm were"),
    ],
)
def test_an_order_to_lower_has_room_or_says_that_it_has_none(down, step, says):
    """Runs 2 rpm apart leave less than the 5 rpm to which a driller holds a speed; and nothing is said of speeds
    below the end of the map."""
    up = "ssssb....b" if step == 2.0 else "sbb......b"
    line = way_out(row(step, up=up, down=down))
    assert says in line
    assert ("(no room for the 5 rpm to which it is held)" in line) == (step == 2.0)
    assert "and below" not in line


def test_lowered_at_all_weights_within_the_limits_it_is_bound_by_the_first_that_vibrates():
    """At 10 klbf what was lowered sticks from 30 rpm on, at 5 klbf from 20 rpm on."""
    results = row(5.0, up=["ss.......b", "ss.......b", "ss.......b"], down=["s......bbb", "bbs....bbb", "s......bbb"])
    found = find_window(results)["answer"].recover
    assert found.only_at is None
    assert found.free_to == 35 * RPM
    assert found.bound.value == 30 * RPM
    assert "not to 30 rpm" in way_out(results)


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_remedy_is_bound_by_what_is_free_in_all_runs_that_were_lowered(seed):
    """Nor is one said to be free where no run was lowered, or where one that was is not free."""
    rng = np.random.default_rng(seed)
    count, step = int(rng.integers(6, 16)), float(rng.choice([0.5, 2.0, 5.0, 10.0]))
    rows = int(rng.choice([1, 1, 3]))

    def drawn() -> list[str]:
        found = []
        for _ in range(rows):
            text = ""
            while len(text) < count:
                text += str(rng.choice(list("..bswtBx"))) * int(rng.integers(1, 6))
            found.append(text[:count])
        return found

    results = row(
        step, up=[f"{'s' * 2}{'.' * (count - 3)}b" if rng.random() < 0.5 else one for one in drawn()], down=drawn()
    )
    advice, maps = find_window(results)["answer"], graded(results)
    found = advice.recover
    if found is None or found.outcome != Recovery.ENDS:
        return
    down = maps.ways.index("down")
    speeds, line = maps.values("rotary_speed"), maps.labels[down][advice.cell[:2]][:, 0]
    lowered = (speeds >= found.free_to) & (speeds <= found.at)
    assert lowered.any()
    assert (line[lowered] == Label.CLEAR).all()
    held = float(tolerance("rotary_speed", np.array([0.0, found.at]))[1])
    assert (found.held_to is None) == (found.at - found.free_to >= held * (1 - 1e-9))
    if found.bound is None:
        assert found.free_to == speeds[0], "nothing was run below"
    else:
        at = int(np.flatnonzero(speeds == found.bound.value)[0])
        of_bound = advice.cell[1]
        if found.bound.beside is not None:
            of_bound = int(np.flatnonzero(maps.values("wob") == found.bound.beside[1])[0])
        assert maps.labels[down][advice.cell[0], of_bound, at, 0] != Label.CLEAR
    for text in words_of(find_window(results), "field").lines():
        assert " and below" not in text
        for low, high in re.findall(r"lowered to ([\d.]+) to ([\d.]+) rpm", text):
            assert speeds[0] / RPM - 1e-6 <= float(low) < float(high) <= found.at / RPM + 1e-6


ORDERED = (
    "Never exceed",
    "Do not exceed",
    "come in again",
    "as above",
    "ower to ",
    "Known to",
    "start again",
    "stay at",
)


def withdrawing(rng: np.random.Generator, is_tagged: bool) -> Trials:
    """Trials of which no way in, or of a setting without room no tag, ends free."""
    way_out = Outcome.FREE if is_tagged else Outcome.VIBRATES
    met = () if is_tagged else ("whirl",)
    found = [
        Trial(name, Way.IN, way_out, met, rate=rate) for name in (WEIGHT_FIRST, SPEED_FIRST) for rate in (0.1, 1.0)
    ]
    if is_tagged:
        found.append(Trial(TAGGED, Way.EXCURSION, Outcome.VIBRATES, ("bit_bounce",), speed=1.0))
    return Trials(tuple(found), set_down=(5.0, 20.0), held=(0.0, 120.0))


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_nothing_is_ordered_beside_a_withdrawal(seed):
    """Nor of a setting to which no way in is known: neither in the text, nor in the orders, nor in the data."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(6, 14))
    lines = {way: "".join(rng.choice(list("....bswB"), count)) for way in ("up", "down", "same")}
    results = row(float(rng.choice([2.0, 5.0, 10.0])), first=40.0, **lines)
    summary = find_window(results)
    advice = summary["answer"]
    if advice.cell is None or advice.kind in (Kind.NOTHING, Kind.UNKNOWN):
        return
    found = confirmed(advice, withdrawing(rng, bool(advice.narrow and rng.random() < 0.5)))
    assert found.is_withdrawn
    for one in (found, advice):
        if not one.is_without_way_in:
            continue
        words = Orders(*needed_for_words({**summary, "answer": one}, "field"))
        said = [*words.lines(), *words.do(), *words.to_confirm(), *words.do_not()]
        assert not [text for text in said for order in ORDERED if order in text]
        assert words.exceed("rotary_speed") is None
        data = data_of(one, "rotary_speed")
        assert (data["never_exceed"], data["known_to"], data["recover"]) == (None, None, None)
        assert (data["limits"], data["most"]) == ({}, {})
        assert not (one.is_withdrawn and (data["stay_within"] or data["basis"]))


def test_a_remedy_of_a_setting_to_which_no_way_in_is_known_comes_in_nowhere():
    results = row(5.0, first=40.0, up="ss.....b", down="...bbbbb")
    summary = find_window(results)
    assert "come in again as above" in " ".join(words_of(summary, "field").lines())
    found = confirmed(summary["answer"], withdrawing(np.random.default_rng(0), is_tagged=False))
    lines = words_of({**summary, "answer": found}, "field").lines()
    assert "If it bounces: pick up and stop the rotation." in lines
    assert not [line for line in lines if "Never exceed" in line or "Rests on" in line]
