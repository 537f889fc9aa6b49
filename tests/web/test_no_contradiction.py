"""What one page says of one subject does not contradict, over drawn maps and trials: no order leads
to what the same page forbids, no number stands on it that the data do not have, no hint is forbidden, and
the limits of a row are in order."""

import functools
import html
import json
import math
import random
import re
from dataclasses import replace

import numpy as np
import pytest
from analysis.grids import told
from figures.test_wording import WALL, made

from nsdrill.analysis.advice import Kind, without
from nsdrill.analysis.confirmed import confirmed
from nsdrill.analysis.graded import graded
from nsdrill.analysis.trials import (
    OFF_ROCK,
    ON_WALL,
    SLOWED,
    SPEED_FIRST,
    TAGGED,
    TO_CORNER,
    WEIGHT_FIRST,
    Outcome,
    Trial,
    Trials,
    Way,
)
from nsdrill.app.answering.answers import plain_window
from nsdrill.data import STICKS_TO, Results, json_text
from nsdrill.study.load import parse_study
from nsdrill.web.one_page import Sheet, one_page

pytestmark = pytest.mark.usefixtures("words_only")

RPM, KLBF = math.pi / 30, 4448.2216152605
STUDIES = 200
PROCEDURES = (("up", "down"), ("up", "down"), ("up", "down", "same"), ("up", "down", "same"), ("up",), ("same",))
RESOLVED = parse_study("sweep: {rotary_speed: [70 rpm, 80 rpm], procedure: all}").resolved


def row(draw: random.Random, length: int, way: str) -> str:
    """The labels of a row: stretches of one kind each, on the way up most often of stick-slip and then free."""
    text = "s" * draw.randint(0, length // 3) if way != "same" else ""
    while len(text) < length:
        text += draw.choices(".wbsxt", (20, 4, 1, 1, 1, 1))[0] * draw.randint(2, 8)
    return text[:length]


def drawn(draw: random.Random) -> Results:
    """A map of one to five weights, over speeds that are coarse or fine."""
    begin, step = draw.choice((30, 40, 57.5, 70)), draw.choice((0.75, 2.5, 5, 10))
    speeds = [(begin + step * place) * RPM for place in range(draw.randint(8, 20))]
    weights = [(5 + 5 * place) * KLBF for place in range(draw.choice((1, 3, 4, 5)))]
    ways = {}
    for way in draw.choice(PROCEDURES):
        lines = [row(draw, len(speeds), way)]
        while len(lines) < len(weights):  # as the row below it, most often
            lines.append(lines[-1] if draw.random() < 0.7 else row(draw, len(speeds), way))
        ways[way] = lines
    if draw.random() < 0.4 and "down" in ways:
        ways["down"] = ways["up"]
    results = made(draw.choice((None, WALL)), speeds, weights, **ways)
    if draw.random() < 0.5:
        return told(results, [draw.choice((0.0, speeds[len(speeds) // 3])) for _ in weights])
    nowhere = {"over": [], "unstable_to": [0.0], "lasts_to": [0.0], "from_rest": False}
    return replace(results, attrs={**results.attrs, STICKS_TO: json_text(nowhere)})


def trials(draw: random.Random, advice) -> Trials:
    """Ways in, a tag, knocks that are slowed, and corners, of which most end free."""

    def ended(name, way, bad=0.25, **values):
        outcome = Outcome.VIBRATES if draw.random() < bad else Outcome.FREE
        return Trial(name, way, outcome, ("whirl",) if outcome.is_bad else (), **values)

    rates = (0.2 * RPM, 1 * RPM, 3 * RPM, 10 * RPM)
    bad, speed = draw.choice((0.0, 0.0, 0.3, 1.0)), advice.point["rotary_speed"]
    found = [ended(name, Way.IN, bad, rate=rate) for name in (WEIGHT_FIRST, SPEED_FIRST) for rate in rates]
    found += [ended(TAGGED, Way.EXCURSION, 0.1, speed=speed), ended(OFF_ROCK, Way.KNOCK)]
    found.append(ended(ON_WALL, Way.KNOCK, 0.5, speed=speed))
    if found[-1].outcome.is_bad:
        found.append(Trial(SLOWED, Way.KNOCK, Outcome.FREE, speed=draw.choice((0.5, 0.8)) * speed, after=ON_WALL))
    for side in ("low", "high"):
        values = {axis: getattr(one, side) for axis, one in advice.stay_within.items()}
        if {"rotary_speed", "wob"} <= values.keys() and values != {axis: advice.point[axis] for axis in values}:
            found.append(ended(TO_CORNER, Way.CORNER, 0.2, speed=values["rotary_speed"], wob=values["wob"]))
    return Trials(tuple(found), set_down=(5.0, 20.0), held=(0.0, 120.0))


@functools.cache
def sheet(seed: int, units: str) -> Sheet:
    """A drawn study; every other one with trials, after which the limits are cut as they are after real ones."""
    draw = random.Random(seed)
    results = drawn(draw)
    resolved = json.loads(json_text({**RESOLVED, "sweep": {**RESOLVED["sweep"], "along": "rotary_speed"}}))
    one = Sheet(replace(results, attrs={**results.attrs, "study_resolved": json_text(resolved)}), units, "x.h5")
    advice = one.window["answer"]
    if seed % 2 and advice.cell is not None and advice.kind not in (Kind.NOTHING, Kind.UNKNOWN):
        tried = trials(draw, advice)
        if tried.bad_corners and not tried.withdraws:
            advice = without(graded(results), advice, tried.bad_corners)
        one.__dict__["window"] = {**one.window, "answer": confirmed(advice, tried)}
    return one


def numbers(data, axis: str = "") -> set[tuple[str, float]]:
    """Each number of plain data with the axis that it is of: it stands under its name, or beside it."""
    found: set[tuple[str, float]] = set()
    if isinstance(data, dict):
        axis = data.get("axis") or axis
        for key, value in data.items():
            found |= numbers(value, key if key in ("rotary_speed", "wob") else axis)
        if data.get("units") == "rad/s^2":
            found.add(("rate", data["value"]))
    elif isinstance(data, list | tuple):
        for value in data:
            found |= numbers(value, axis)
    elif isinstance(data, int | float) and not isinstance(data, bool) and axis:
        found.add((axis, float(data)))
    return found


SIZES = {"rpm": RPM, "klbf": KLBF, "rad/s": 1.0, "kN": 1e3, "rpm/s": RPM}
STEPS = {"rpm": 1.0, "klbf": 0.5, "rad/s": 0.1, "kN": 1.0}
AXES = {"rpm": "rotary_speed", "rad/s": "rotary_speed", "klbf": "wob", "kN": "wob", "rpm/s": "rate"}
SHOWN = re.compile(r"(\d+(?:\.\d+)?)(?:(?: to | and )(\d+(?:\.\d+)?))? (rpm/s|rpm|klbf|rad/s²|rad/s|kN)(?! m\b)")


def is_told(text: str, unit: str, known: set[tuple[str, float]]) -> bool:
    """Whether a number of the text is one of the data, rounded to what a driller can set."""
    value = float(text)
    for axis, exact in known:
        if axis == AXES[unit]:
            number = exact / SIZES[unit]
            step = STEPS.get(unit, 0.0)
            near = {round(number, 2), round(number, 1), float(f"{number:.3g}")}
            if step:
                near |= {math.floor(number / step + 1e-6) * step, math.ceil(number / step - 1e-6) * step}
                near |= {round(number / step) * step}
            elif number > 0.0:  # a rate, to two digits: a least one is rounded up, a greatest one down
                step = 10.0 ** (math.floor(math.log10(number)) - 1)
                near |= {float(f"{number * 1.05:.2g}"), float(f"{number:.2g}"), math.floor(number / step) * step}
            if any(math.isclose(value, one, abs_tol=1e-6) for one in near):
                return True
    return False


def spoken(one: Sheet) -> list[str]:
    """The sentence, the lines, the orders: what says what to do."""
    words = one.orders
    return [words.sentence(), *words.lines(), *words.do(), *words.to_confirm(), *words.do_not()]


def page_of(one: Sheet) -> str:
    return re.sub(r"<style>.*?</style>", "", one_page([one], "A4", {"Well": ""}), flags=re.DOTALL)


@pytest.mark.parametrize("units", ["field", "si"])
def test_each_number_of_the_text_is_one_of_the_data(units):
    for seed in range(STUDIES):
        one = sheet(seed, units)
        known = numbers(plain_window(one.window, units)["answer"])
        known |= {("rotary_speed", one.window["ranges"]["rotary_speed"][0])}
        for text in spoken(one):
            for low, high, unit in SHOWN.findall(re.sub(r" \([^)]*\)", "", text)):
                if unit != "rad/s²":
                    for number in filter(None, (low, high)):
                        assert is_told(number, unit, known), (seed, number, unit, text)


def _value(text: str) -> dict[str, float]:
    return {AXES[unit]: float(number) for number, _, unit in SHOWN.findall(text) if unit in ("rpm", "klbf")}


def _ranges(text: str) -> dict[str, tuple[float, float]]:
    return {AXES[unit]: (float(low), float(high or low)) for low, high, unit in SHOWN.findall(text)}


def targets(one: Sheet) -> list[tuple[str, dict[str, float]]]:
    """The settings to which the orders lead, but for a vibration, which has to end: each with its text."""
    found = []
    for text in (*one.orders.do(), *one.orders.to_confirm()):
        if match := re.match(r"(?:Drill at|Try) ((?:[^.]|\.\d)+)\. Stay within ((?:[^.]|\.\d)+)\.", text):
            found.append((text, _value(match[1])))
            within = match[2].partition(", but not at ")[0]
            ends = _ranges(within)
            found += [(text, {axis: value}) for axis, pair in ends.items() for value in pair]
        elif match := re.search(r"hint only|^Find a way", text):
            continue
        for pattern in (r"not below ([\d.]+ klbf)", r"not above ([\d.]+ rpm)"):
            found += [(text, _value(value)) for value in re.findall(pattern, text)]
    return found


def forbids(text: str, at: dict[str, float]) -> bool:
    """Whether a prohibition is of a setting."""
    if match := re.match(r"Do not exceed ([\d.]+ \w+):", text):
        return any(at.get(axis, 0.0) > value for axis, value in _value(match[1]).items())
    if match := re.match(r"Once there, do not go below ([\d.]+ \w+):", text):
        return any(at.get(axis, math.inf) < value for axis, value in _value(match[1]).items())
    if match := re.match(r"Do not go above ([\d.]+ \w+):", text):
        return any(at.get(axis, 0.0) > value for axis, value in _value(match[1]).items())
    if match := re.match(r"Do not run at ([^:]+):", text):
        return all(axis in at and low <= at[axis] <= high for axis, (low, high) in _ranges(match[1]).items())
    return False


def test_no_order_leads_to_what_is_forbidden():
    told_of = 0
    for seed in range(STUDIES):
        one = sheet(seed, "field")
        orders = one.orders
        for text, at in targets(one):
            told_of += 1
            for no in orders.do_not():
                assert not forbids(no, at), (seed, text, no)
        within = orders.advice.stay_within
        if len(within) == 2:  # a corner that a trial forbids is left out of what to stay within
            for no in orders.do_not():
                if (match := re.match(r"Do not run at ([^:]+): in trials", no)) and "Drill at" in " ".join(orders.do()):
                    assert any(f"but not at {match[1]}" in text or f"or {match[1]}" in text for text in orders.do())
    assert told_of > 100


def test_every_setting_within_the_limits_is_allowed_by_the_map():
    for seed in range(STUDIES):
        one = sheet(seed, "field")
        advice, maps = one.advice, one.maps
        if advice.cell is None or not advice.stay_within:
            continue
        inside = {axis: (end.low, end.high) for axis, end in advice.stay_within.items()}
        for place, speed in enumerate(maps.values("rotary_speed")):
            for at, weight in enumerate(maps.values("wob") if maps.y else [advice.held["wob"]]):
                here = {"rotary_speed": speed, "wob": weight}
                if all(low <= here[axis] <= high for axis, (low, high) in inside.items()):
                    assert maps.allowed[advice.cell[0], at, place], (seed, here)
                    number = one.window["answer"].never_exceed("rotary_speed")
                    assert number is None or speed <= number


def test_a_vibration_is_lowered_to_what_is_free_and_not_to_what_lies_below():
    met = 0
    for seed in range(STUDIES):
        one = sheet(seed, "field")
        found = one.advice.recover
        for text in (*one.orders.lines(), *one.orders.do(), *one.orders.to_confirm(), one.orders.sentence()):
            match = re.search(r"[Ll]ower(?:ed)? to ([\d.]+) rpm", text)
            if not match:
                continue
            met += 1
            assert float(match[1]) * RPM <= found.at * (1 + 1e-9) + 0.05 * RPM, (seed, text)
            if found.bound is not None:
                assert float(match[1]) * RPM > found.bound.value * (1 + 1e-9), (seed, text)
            elif one.advice.trials is None and "down" in one.maps.ways:
                line = one.maps.labels[one.maps.ways.index("down")][one.advice.cell[:2]][:, 0]
                below = one.maps.values("rotary_speed") < found.at
                assert (line[below] == 4).all(), (seed, text)
    assert met > 10


def test_what_is_named_as_a_hint_is_not_forbidden():
    for seed in range(STUDIES):
        one = sheet(seed, "field")
        said, at = one.orders.sentence(), _value(one.orders.setting())
        is_named = one.advice.kind in (Kind.NOTHING, Kind.HINT) and "int" in said.partition(":")[0].lower()
        is_named |= "hint" in one.orders.order() or one.advice.kind == Kind.NOTHING
        if at and is_named:
            orders = one.orders.do_not()
            excepted = re.findall(r"The one exception, as a hint, is (.+?)\.(?: |$)", " ".join(orders))
            assert len(excepted) <= 1, "it is said once"
            for no in orders:
                assert not forbids(no, at) or [_value(text) for text in excepted] == [at], (seed, said, no)


def test_the_limits_of_a_row_are_in_order_and_above_what_is_allowed():
    more = 0
    for seed in range(STUDIES):
        one = sheet(seed, "field")
        for cells in re.findall(r"<tr[^>]*>(.*?)</tr>", page_of(one))[1:]:
            texts = [html.unescape(cell) for cell in re.findall(r"<td>(.*?)</td>", cells)]
            limits = texts[2].partition("; after a quick start")[0]
            begins = [float(number) for number in re.findall(r"([\d.]+) to [\d.]+", limits)]
            more += len(begins) > 1
            assert begins == sorted(set(begins)), (seed, texts)
            ordered = re.fullmatch(r"([\d.]+)(?: to ([\d.]+))?", texts[3])  # by no quick start, within the map
            if ordered and begins and "not known" not in texts[2]:
                last, top = float(ordered[2] or ordered[1]), float(one.maps.values("rotary_speed")[-1]) / RPM
                free = first_limit_above(one, texts[0], last)
                assert begins[-1] >= last - 1 or free is None or last >= top - 1, (seed, texts)
    assert more > 5


def first_limit_above(one: Sheet, name: str, last: float) -> float | None:
    """The first speed [rpm] above the ``last`` one of a row that the map does not allow; None where it allows all."""
    maps = one.maps
    at = 0 if maps.y is None else int(np.argmin(np.abs(maps.values("wob") - float(name.split()[0]) * KLBF)))
    speeds, allowed = maps.values("rotary_speed") / RPM, maps.allowed[one.plane, at]
    above = speeds[(speeds > last + 1e-6) & ~allowed]
    return float(above[0]) if above.size else None


def test_the_table_says_of_no_row_more_than_the_orders():
    """What is neither named as not ordered nor of a page without orders is what to stay within."""
    rows = 0
    for seed in range(STUDIES):
        one = sheet(seed, "field")
        page = page_of(one)
        table = page.partition("<table>")[2]
        is_ordered = "ordered [rpm]" in table.replace("not ordered [rpm]", "") or "to confirm [rpm]" in table
        assert is_ordered == (not one.orders.is_withdrawn and one.advice.kind not in (Kind.NOTHING, Kind.UNKNOWN))
        for line in re.findall(r"<tr[^>]*>(.*?)</tr>", table)[1:]:
            cells = [html.unescape(cell) for cell in re.findall(r"<td>(.*?)</td>", line)]
            if not is_ordered or cells[3].startswith("not ordered") or cells[3] == "none":
                continue
            rows += 1
            ends = one.orders.ends("rotary_speed").removesuffix(" rpm")
            assert cells[3].partition(" (")[0] == ends, (seed, cells)
            weight = float(cells[0].split()[0])
            if "wob" in one.advice.stay_within:
                within = one.advice.stay_within["wob"]
                assert within.low / KLBF - 1e-6 <= weight <= within.high / KLBF + 1e-6, (seed, cells)
    assert rows > 100
