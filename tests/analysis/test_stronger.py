"""No run that fails makes an answer stronger, on maps of any shape: neither its kind, nor its room,
its rectangle, what becomes of a vibration, nor what is warned of."""

from itertools import pairwise

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nsdrill.analysis.advice import RECOMMENDED, Advice, First, Kind, Recovery
from nsdrill.analysis.graded import Graded, graded
from nsdrill.analysis.planes import along_axis
from nsdrill.analysis.room import tolerance
from nsdrill.analysis.window import find_window
from nsdrill.data import Answer, Results
from nsdrill.models.registry import responses_in
from nsdrill.words.answer import warnings

from .grids import grid, told

RPM, KLBF = np.pi / 30, 4448.2216152605
WAYS = [("up",), ("up", "down"), ("up", "same"), ("up", "down", "same")]
FIRMNESS = [Recovery.LASTS, Recovery.NOT_MET, Recovery.ENDS]  # the least said for the string first


def results_of(ways: tuple[str, ...], drawn: np.ndarray, lasts_to: list[float] | None) -> Results:
    """Maps that are drawn [way, weight, speed]."""
    maps = {way: [["".join(row) for row in one]] for way, one in zip(ways, drawn, strict=True)}
    _, rows, columns = drawn.shape
    results = grid(maps, RPM * (40.0 + 10.0 * np.arange(columns)), KLBF * (10.0 + 5.0 * np.arange(rows)))
    return results if lasts_to is None else told(results, lasts_to)


def window(ways: tuple[str, ...], drawn: np.ndarray, lasts_to: list[float] | None) -> Answer:
    """The window of these."""
    return find_window(results_of(ways, drawn, lasts_to))


def graded_maps(ways: tuple[str, ...], drawn: np.ndarray, lasts_to: list[float] | None) -> Graded:
    """The grades of these."""
    return graded(results_of(ways, drawn, lasts_to))


def within(maps: Graded, found: Advice) -> np.ndarray:
    """The points [y, x] of what to stay within."""
    inside = np.ones(maps.allowed[0].shape, dtype=bool)
    for axis, one in found.stay_within.items():
        place = 0 if axis == maps.y else 1
        values, slack = maps.values(axis), 1e-9 * abs(one.high)
        inside &= along_axis((values >= one.low - slack) & (values <= one.high + slack), place, 2)
    return inside


def size(found: Advice) -> float:
    """That of what to stay within, by which a rectangle is chosen."""
    sides = [
        1.0 + (one.high - one.low) / float(tolerance(axis, np.array([found.point[axis]] * 2))[0])
        for axis, one in found.stay_within.items()
    ]
    return float(np.prod(sides))


def level(found: Answer) -> int:
    """The least severity that must be allowed for a setting; 9 where none is known."""
    if found["answer"].kind in RECOMMENDED:
        return 0
    milder = found["milder"]
    return int(milder["severity"]) if milder is not None and milder["answer"].kind in RECOMMENDED else 9


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_run_that_fails_makes_no_answer_stronger(seed):
    rng = np.random.default_rng(seed)
    ways = WAYS[rng.integers(len(WAYS))]
    shape = len(ways), int(rng.integers(1, 4)), int(rng.integers(4, 9))
    drawn = np.where(rng.random(shape) < rng.choice([0.05, 0.15, 0.3]), rng.choice(list("bswtB"), shape), ".")
    lasts_to = None if rng.random() < 0.6 else [float(one) for one in RPM * rng.choice([0, 45, 60], shape[1])]
    place = tuple(int(rng.integers(one)) for one in shape)
    less = drawn.copy()
    less[place] = "x"
    before, after = (window(ways, one, lasts_to) for one in (drawn, less))
    assert after["safe"] <= before["safe"]
    assert level(after) >= level(before), "no severity becomes milder"
    was, now = before["answer"], after["answer"]
    if now.kind in RECOMMENDED:
        assert was.kind in RECOMMENDED, "no hint becomes a setting"
        assert RECOMMENDED.index(now.kind) >= RECOMMENDED.index(was.kind)
    if drawn[place] == "." and was.kind != Kind.UNKNOWN:
        assert not {"THE BIT STALLS"} & (tags(before) - tags(after)) or after["after_failure"]
    if now.cell is None or was.cell != now.cell or was.kind != now.kind or was.room is None:
        return
    assert now.room <= was.room + 1e-9
    assert now.grade <= was.grade
    assert size(now) <= size(was) * (1.0 + 1e-9), "another rectangle may be the largest one, but none is larger"
    if was.recover is not None and now.recover is not None and now.recover.outcome != was.recover.outcome:
        # a vibration in the run that failed is not known any more
        assert FIRMNESS.index(now.recover.outcome) < FIRMNESS.index(was.recover.outcome) or drawn[place] != "."


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_run_that_fails_allows_no_setting_and_no_range(seed):
    """The answer may be another setting, or another rectangle: all of it was allowed before, in the same
    field, and so were all stretches that are told."""
    rng = np.random.default_rng(seed)
    ways = WAYS[rng.integers(len(WAYS))]
    shape = len(ways), int(rng.integers(1, 5)), int(rng.integers(4, 9))
    drawn = np.where(rng.random(shape) < rng.choice([0.02, 0.05, 0.15]), rng.choice(list("bswtB"), shape), ".")
    lasts_to = None if rng.random() < 0.6 else [float(one) for one in RPM * rng.choice([0, 45, 60], shape[1])]
    less = drawn.copy()
    less[tuple(int(rng.integers(one)) for one in shape)] = rng.choice(list("x?"))
    before, after = (graded_maps(ways, one, lasts_to) for one in (drawn, less))
    for was, now in zip((before.better, *before.fields), (after.better, *after.fields), strict=True):
        assert not np.any(now & ~was)
    told_before, told_after = (window(ways, one, lasts_to) for one in (drawn, less))
    found = told_after["answer"]
    if not found.stay_within:
        return
    inside = within(after, found)
    assert inside[found.cell[1:]]
    assert np.all(before.allowed[0][inside])
    assert any(
        np.all(now[0][inside]) and np.all(was[0][inside]) for was, now in zip(before.fields, after.fields, strict=True)
    )
    for was, now in zip(told_before["maps"][0]["rows"], told_after["maps"][0]["rows"], strict=True):
        assert all(any(low <= first and last <= high for low, high in was["safe"]) for first, last in now["safe"])


def tags(found: Answer) -> set[str]:
    return {text.partition(" at ")[0] for text in warnings(found, "si")}


def test_what_vibrated_on_the_way_down_within_the_limits_was_met():
    """Free on the way up to 90 rpm; coming down it stalls at 90 and 80 rpm: the vibration was met above the
    setting, whether or not the stretch that is free from below ends below these speeds."""
    for last in (".", "x"):
        rows = np.array([[list("......tb")], [list("....tt..")]])
        rows[0, 0, 7] = "b" if last == "." else "x"
        found = window(("up", "down"), rows, [45 * RPM])["answer"]
        assert found.recover.outcome == Recovery.ENDS
        assert found.recover.at == found.point["rotary_speed"]


def test_after_a_start_that_failed_the_speed_is_not_raised_first():
    """A start at the setting stalls: the weight is set first, as the map was run. It is so, too, where that
    start failed, of which nothing is known."""
    for start in "tx":
        rows = np.array([[list("...b..."), list("b...t.."), list(".......")]] * 2)
        rows[1] = [list("....b.w"), list(f"..{start}.s.."), list("t......")]
        found = window(("up", "same"), rows, None)["answer"]
        assert found.way_in.first == First.WEIGHT


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
@example(268435457)  # a way down that stalls below a mild whirl, at a point where a start failed
def test_to_allow_more_never_allows_less(seed):
    """Neither a point nor an answer: a run down that was severe came from a vibration above that is mild, and
    one that comes free of a start does so beside a mild vibration, too."""
    rng = np.random.default_rng(seed)
    ways = WAYS[rng.integers(len(WAYS))]
    shape = len(ways), int(rng.integers(1, 4)), int(rng.integers(4, 9))
    drawn = np.where(rng.random(shape) < rng.choice([0.05, 0.3, 0.5]), rng.choice(list("bswtBx"), shape), ".")
    lasts_to = None if rng.random() < 0.6 else [float(one) for one in RPM * rng.choice([0, 45, 60], shape[1])]
    results = results_of(ways, drawn, lasts_to)
    response = np.asarray(results["response"])
    for one in responses_in(results.attrs).values():
        if one.severity is not None:
            bands = np.where(response & one.bit, rng.integers(1, 5, response.shape), 0)
            results.variables[one.severity.name] = bands.astype(np.int8)
    levels = [None, 0, 1, 2, 3, 4]
    maps, found = [graded(results, one) for one in levels], [find_window(results, one) for one in levels]
    for strict, lax in pairwise(maps):
        assert not np.any(strict.allowed & ~lax.allowed)
    for before, after in pairwise(found):
        was, now = before["answer"], after["answer"]
        assert after["safe"] >= before["safe"]
        if was.kind in RECOMMENDED:
            assert (now.kind, now.cell) == (was.kind, was.cell)
        elif was.kind == Kind.HINT:
            assert now.kind in (*RECOMMENDED, Kind.HINT)
