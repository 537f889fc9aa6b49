"""One number for one attractor along the axes, and intervals of hysteresis, against
drawings in which they can be counted."""

import json

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.attractors import label, places
from nsdrill.analysis.branch_numbers import KIND_PENALTY, MAX_MISSED, Places, number
from nsdrill.analysis.counts import known
from nsdrill.analysis.hysteresis import differences, disagreement, hysteresis, spans
from nsdrill.analysis.safety import outcome
from nsdrill.app.answering.summary import summarize
from nsdrill.observe.thresholds import Attractors
from nsdrill.store import read_results
from nsdrill.variables import CHAOTIC, PERIODIC

from .grids import grid
from .test_attractors import GAP, SPEED, TOLERANCE, coordinates, starts

MATCHING = Attractors().matching
Table = dict[str, np.ndarray]


def stacked(*points: Table) -> Table:
    """The starts of several operating points, as many at each."""
    return {name: np.stack([point[name] for point in points]) for name in points[0]}


def joined(*groups: Table) -> Table:
    return {name: np.concatenate([group[name] for group in groups]) for name in groups[0]}


def numbered(variables: Table, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """The number of every start, from the groups at each operating point to the
    branches."""
    n = len(variables["status"])
    speed, gap, axial = np.full(n, SPEED), np.full(n, GAP), np.full(n, 1e-3)
    apart, along = coordinates(variables, speed, gap, axial)
    group = label(variables, apart, TOLERANCE)
    found = places(variables, group, along)
    numbers = number(found, shape or (n,), MATCHING)
    return numbers[np.searchsorted(found.point, np.arange(n))[:, None] + group - 1]


def made_up(*attractors: tuple[int, float], members: int = 8, settled: bool = True, kinds: int = 0) -> Places:
    """Attractors at (operating point, place) with one coordinate."""
    point, place = np.array(attractors).T
    n = len(point)
    return Places(point.astype(int), np.full(n, members), place[:, None], np.full(n, kinds), np.full(n, settled))


NUMBERED = {
    "within the threshold": (made_up((0, 0.0), (1, 0.99 * MATCHING)), (2,), [1, 1]),
    "beyond the threshold": (made_up((0, 0.0), (1, 1.01 * MATCHING)), (2,), [1, 2]),
    # All move by 0.1: the second is then where the third was, but each goes on.
    "nearest in sum": (made_up((0, 0.0), (0, 0.1), (0, 0.2), (1, 0.1), (1, 0.2), (1, 0.3)), (2,), [1, 2, 3, 1, 2, 3]),
    "unsettled, does not come back": (made_up((0, 0.0), (2, 0.0), settled=False), (3,), [1, 2]),
    "unsettled, at the next point": (made_up((0, 0.0), (1, 0.0), settled=False), (2,), [1, 1]),
    # Around the four operating points each is near the next, from 0 to 0.47 at the first
    # one. The widest step parts them.
    "a way around": (made_up((0, 0.0), (0, 0.47), (1, 0.11), (2, 0.36), (3, 0.24)), (2, 2), [2, 1, 2, 1, 1]),
}


@pytest.mark.parametrize(("places", "shape", "expected"), NUMBERED.values(), ids=NUMBERED)
def test_numbers_of_branches(places, shape, expected):
    assert number(places, shape, MATCHING).tolist() == expected


def test_branches_whose_features_cross_are_told_apart_by_their_states():
    """The time off the rock of the one rises as that of the other falls. From 0.34 at
    one point the nearest at the next is 0.34 of the other; the greatest radius says
    which is which."""
    rising = [0.20, 0.26, 0.34, 0.40]
    points = [
        joined(
            starts(3, lift_off_fraction=a, radius_max=0.2 * GAP), starts(2, lift_off_fraction=b, radius_max=0.4 * GAP)
        )
        for a, b in zip(rising, rising[::-1], strict=True)
    ]
    assert numbered(stacked(*points)).tolist() == [[1, 1, 1, 2, 2]] * 4
    blind = [point | {"radius_max": np.full(5, 0.2 * GAP)} for point in points]
    assert numbered(stacked(*blind)).tolist() != [[1, 1, 1, 2, 2]] * 4, "else this test could not fail"


@pytest.mark.parametrize("state", ["radius_max", "axial_max", "bit_speed_min", "bit_speed_max"])
def test_each_state_tells_apart(state):
    far = {"radius_max": 0.5 * GAP, "axial_max": 10e-3, "bit_speed_min": -0.5 * SPEED, "bit_speed_max": 2.5 * SPEED}
    points = stacked(starts(2), starts(2, **{state: far[state]}))
    assert numbered(points).tolist() == [[1, 1], [2, 2]]


def test_one_vanishes_and_another_is_born():
    """At the third operating point the first has no starts any more; the second is
    there from the second one on."""
    low, high = starts(4, lift_off_fraction=0.1), starts(4, lift_off_fraction=0.7)
    mixed = joined(starts(3, lift_off_fraction=0.12), starts(1, lift_off_fraction=0.69))
    assert numbered(stacked(low, mixed, high, high)).tolist() == [[2] * 4, [2, 2, 2, 1], [1] * 4, [1] * 4]


def test_the_largest_in_the_whole_sweep_is_the_first():
    a, b = starts(3, lift_off_fraction=0.1), starts(1, lift_off_fraction=0.7)
    points = [joined(a, b), joined(b, a), joined(b, b, b, b), joined(b, b, b, b)]
    assert numbered(stacked(*points)).tolist() == [[2, 2, 2, 1], [1, 2, 2, 2], [1] * 4, [1] * 4]


def test_labels_and_contact_with_the_wall_change_along_a_branch():
    """As between 5.2 and 5.4 rad/s in the worked example: from rattling along the wall
    to rolling."""
    wide = {"radius_mean": 0.99 * GAP, "radius_max": 1.02 * GAP, "whirl_speed_mean": -1.4 * SPEED, "response": 5}
    rattling = starts(3, **wide, wall_contact_fraction=0.42, whirl_kind=2)
    rolling = starts(3, **wide, wall_contact_fraction=0.98, whirl_kind=3)
    assert numbered(stacked(rattling, rolling)).tolist() == [[1] * 3] * 2


@pytest.mark.parametrize("missed", range(1, MAX_MISSED + 2))
def test_what_comes_back(missed):
    """A branch that a few operating points miss keeps its number; over more of them it
    gets a new one."""
    ever = [(point, 5.0) for point in range(2 + missed)]
    found = made_up(*sorted([(0, 0.0), (missed + 1, 0.1), *ever]))
    first, *_, last, _ = number(found, (2 + missed,), MATCHING)
    assert (first == last) == (missed <= MAX_MISSED)


def test_the_same_kind_of_motion_is_preferred_and_no_other_excluded():
    once, twice, never = 10_000 * PERIODIC + 1, 10_000 * PERIODIC + 2, 10_000 * CHAOTIC
    found = made_up((0, 0.0), (1, 0.05), (1, -0.04))
    for kinds, expected in [
        ((once, once, never), [1, 1, 2]),
        ((once, never, once), [1, 2, 1]),
        ((0, never, once), [1, 2, 1]),
    ]:
        assert (
            number(
                Places(found.point, found.members, found.place, np.array(kinds), found.settled), (2,), MATCHING
            ).tolist()
            == expected
        )
    doubled = made_up((0, 0.0), (1, 0.05))
    doubled = Places(doubled.point, doubled.members, doubled.place, np.array([once, twice]), doubled.settled)
    assert number(doubled, (2,), MATCHING).tolist() == [1, 1], "a period that doubles ends no branch"


def test_a_start_on_its_way_takes_no_number_from_a_settled_one():
    """As at 2.2 rad/s: a single start, almost at rest, lies nearer to the attractor of
    the next speed."""
    found = made_up((0, 0.0), (0, 0.06), (1, 0.07))
    found.settled[1] = False
    assert KIND_PENALTY * MATCHING > 0.06
    assert number(found, (2,), MATCHING).tolist() == [1, 2, 1]


def test_pieces_of_a_chaotic_motion_are_paired_by_size():
    found = made_up((0, 0.0), (0, 0.1), (1, 0.08), (1, 0.0), settled=False)
    found.members[:] = [30, 2, 30, 2]
    assert number(found, (2,), MATCHING).tolist() == [1, 2, 1, 2]


def cusp(a: np.ndarray, b: np.ndarray, count: int) -> tuple[Table, np.ndarray]:
    """Starts of x' = b + a x - x^3 from -2 to 2, at their ends, and which of them lie
    above the unstable state."""
    x = np.linspace(-2, 2, count)
    ends, above = np.empty((len(a), count)), np.empty((len(a), count), bool)
    for i, (slope, push) in enumerate(zip(a, b, strict=True)):
        roots = np.roots([-1, 0, slope, push])
        states = np.sort(roots[np.abs(roots.imag) < 1e-9].real)
        above[i] = x > states[len(states) // 2]
        ends[i] = np.where(above[i], states[-1], states[0])
    radius = GAP * (ends + 2) / 4
    one = starts(count)
    return {name: np.broadcast_to(values, ends.shape) for name, values in one.items()} | {
        "radius_mean": radius,
        "radius_max": radius,
    }, above


def test_the_basins_of_a_cubic():
    """Upper and lower state of x' = b + 1.5 x - x^3 coexist for 27 b^2 < 4 * 1.5^3; the
    unstable state between divides their basins. Each has its number, until it ends in a
    fold."""
    b = np.linspace(-1.2, 1.2, 25)
    variables, above = cusp(np.full(25, 1.5), b, 41)
    numbers = numbered(variables)
    two = 27 * b**2 < 4 * 1.5**3
    assert 0 < two.sum() < 25
    assert set(numbers.ravel()) == {1, 2}
    upper = numbers[12, -1]
    assert np.all(numbers[two] == np.where(above[two], upper, 3 - upper))
    assert np.all(numbers[~two & (b > 0)] == upper)
    assert np.all(numbers[~two & (b < 0)] == 3 - upper)


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether both tell the same apart, by whatever numbers."""
    return len(set(zip(a.ravel(), b.ravel(), strict=True))) == len(set(a.ravel())) == len(set(b.ravel()))


def test_two_axes_around_a_cusp_in_any_order():
    """On the far side of the cusp both states are one. No operating point has a number
    twice, and nothing depends on the order of the axes, their direction, or the order
    of the starts."""
    shape = (9, 13)
    a, b = np.meshgrid(np.linspace(-1, 2, 9), np.linspace(-1.21, 1.2, 13), indexing="ij")
    variables, above = cusp(a.ravel(), b.ravel(), 21)
    numbers = numbered(variables, shape)
    grid = numbers.reshape(*shape, 21)
    for row, sides in zip(numbers, above, strict=True):
        if 0 < sides.sum() < 21:
            assert same(row, sides) or len(set(row)) == 1  # one group, at the cusp itself
    assert set(numbers.ravel()) == {1, 2}
    order = np.arange(9 * 13).reshape(shape)
    for turned in (order[::-1], order[:, ::-1], order.T, order.T[::-1, ::-1]):
        other = numbered({name: values[turned.ravel()] for name, values in variables.items()}, turned.shape)
        assert same(other, grid.reshape(-1, 21)[turned.ravel()])
    shuffled = np.random.default_rng(1).permutation(21)
    other = numbered({name: values[:, shuffled] for name, values in variables.items()}, shape)
    assert np.array_equal(other, numbers[:, shuffled])


def test_scattered_motions_are_numbered_whatever_the_order_of_the_starts():
    rng = np.random.default_rng(8)
    variables = stacked(
        *(starts(30, lift_off_fraction=rng.uniform(0, 1, 30), radius_mean=rng.uniform(0, GAP, 30)) for _ in range(6))
    )
    numbers = numbered(variables)
    shuffled = rng.permutation(30)
    assert np.array_equal(numbered({name: v[:, shuffled] for name, v in variables.items()}), numbers[:, shuffled])
    assert same(numbered({name: v[::-1] for name, v in variables.items()}), numbers[::-1])


SPEEDS = np.arange(1.0, 9.0)


def test_one_interval_with_its_ends_step_and_responses():
    [row] = hysteresis(grid({"up": ["...bbwww"], "down": ["...BBwww"]}, SPEEDS))
    assert row == {
        "axis": "rotary_speed",
        "from": 4.0,
        "to": 5.0,
        "points": 2,
        "up": "bit_bounce",
        "down": "bit_bounce+whirl",
        "differs": ["whirl"],
        "depth": 5000.0,
        "wob": 20e3,
        "step": 1.0,
        "open": [],
        "up_whirl": [],
        "down_whirl": ["backward_rolling"],
    }


INTERVALS = {
    "another pair of responses is another interval": (
        "ss...bb.",
        "s..bbbB.",
        [
            {"from": 2.0, "to": 2.0, "up": "stick_slip", "down": "none", "differs": ["stick_slip"]},
            {"from": 4.0, "to": 5.0, "up": "none", "down": "bit_bounce", "differs": ["bit_bounce"]},
            {"from": 7.0, "to": 7.0, "up": "bit_bounce", "down": "bit_bounce+whirl", "differs": ["whirl"]},
        ],
    ),
    "an inferred point interrupts nothing": ("...i....", "..bbbb..", [{"from": 3.0, "to": 6.0}]),
    "the ends of the sweep": ("bb....ww", "........", [{"open": ["from"]}, {"open": ["to"]}]),
    "all of the sweep": ("bbbbbbbb", "........", [{"open": ["from", "to"], "step": None}]),
    "the larger of two unequal steps": ("....", ".bb.", [{"step": 2.5}]),
}


@pytest.mark.parametrize(("up", "down", "told"), INTERVALS.values(), ids=INTERVALS)
def test_intervals(up, down, told):
    rows = hysteresis(grid({"up": [up], "down": [down]}, SPEEDS if len(up) == 8 else [1.0, 2.0, 2.5, 5.0]))
    assert [{name: row[name] for name in one} for row, one in zip(rows, told, strict=True)] == told


def test_of_one_value_of_an_axis_that_is_named_both_responses_may_differ():
    [row] = hysteresis(grid({"up": ["B"], "down": ["."]}, [3.0], wob=[1e3]), "rotary_speed")
    assert row["differs"] == ["bit_bounce", "whirl"]


@pytest.mark.parametrize("sign", ["x", "?"])
@pytest.mark.parametrize("side", ["up", "down"])
def test_a_point_that_is_not_known_interrupts(sign, side):
    maps = {"up": ["........"], "down": ["..bbbb.."]}
    line = list(maps[side][0])
    line[3] = sign
    rows = hysteresis(grid({**maps, side: ["".join(line)]}, SPEEDS))
    assert [(row["from"], row["to"], row["open"]) for row in rows] == [(3.0, 3.0, ["to"]), (5.0, 6.0, ["from"])]


def test_every_combination_of_the_other_axes_has_its_own():
    data = grid(
        {"up": [["....", "...."], ["....", "...."]], "down": [["b...", "...."], ["..ww", ".b.."]]},
        [1, 2, 3, 4],
        wob=[10e3, 20e3],
        depth=[1000, 2000],
    )
    assert hysteresis(data) == [], "three axes, and the study does not say along which"
    data.attrs["study_resolved"] = json.dumps({"sweep": {"along": "rotary_speed"}})
    found = [(row["depth"], row["wob"], row["from"], row["to"]) for row in hysteresis(data)]
    assert found == [(1000, 10e3, 1, 1), (2000, 10e3, 3, 4), (2000, 20e3, 2, 2)]
    data.attrs["study_resolved"] = json.dumps({"sweep": {"along": "wob"}})
    found = [(row["depth"], row["rotary_speed"], row["from"], row["to"]) for row in hysteresis(data)]
    assert found == [(1000, 1, 10e3, 10e3), (2000, 2, 20e3, 20e3), (2000, 3, 10e3, 10e3), (2000, 4, 10e3, 10e3)]


@pytest.mark.parametrize("names", [("same",), ("up",), ("same", "up")])
def test_without_both_directions_there_is_nothing_to_compare(names):
    maps = {name: ["b.w."] for name in names}
    assert hysteresis(grid(maps, [1, 2, 3, 4])) == []
    assert disagreement(names, np.zeros((len(names), 4))) is None


def test_stretches_for_shading_join_what_touches():
    data = grid({"up": ["..bbx.b."], "down": [".bw..b.."]}, SPEEDS)
    outcomes = outcome(data["status"], data["response"])[:, 0, 0]
    found = differences(("up", "down"), outcomes)
    assert [(one.first, one.last) for one in found] == [(1, 1), (2, 2), (3, 3), (5, 5), (6, 6)]
    assert spans(found) == [(1, 3), (5, 6)]


def test_known_are_points_run_to_the_end_or_inferred():
    assert known(np.arange(7)).tolist() == [False, True, False, False, False, True, False]


def test_the_file_says_the_same(shared):
    """From Python, and in the JSON of show; where the responses of the file differ, and
    nowhere else."""
    rows = nsdrill.hysteresis(shared / "small.h5")
    assert rows == summarize(read_results(shared / "small.h5"))["hysteresis"]
    data = read_results(shared / "small.h5")
    up, down = data["response"][:, 0, 0]
    assert sum(row["points"] for row in rows) == np.count_nonzero(up != down) > 0
    assert nsdrill.hysteresis(shared / "map.h5") == []


def test_beside_an_interval_of_stick_slip_stands_what_the_model_tells():
    """Runs change between two steps, and not where the motion does: a string lowered along unstable steady
    drilling leaves it late, so that an end may lie inside of the interval of coexistence as well."""
    study = {
        "operation": {"depth": "3000 m", "wob": "60 kN"},
        "modes": {"lateral": "frozen", "axial": "frozen"},
        "initial": {"bit_speed": "0 rad/s"},
        "simulation": {"transient": "60 s", "observe": "40 s"},
        "sweep": {"rotary_speed": ["6 rad/s", "11 rad/s"], "procedure": "up-down"},
    }
    data = nsdrill.run(study, progress=False)
    [row] = nsdrill.hysteresis(data)
    assert (row["from"], row["to"], row["up"], row["down"]) == (6.0, 6.0, "stick_slip", "none")
    assert 0.0 < row["by_model"]["unstable_to"] < 6.0 < row["by_model"]["lasts_to"] < 11.0
    text = nsdrill.show(data)
    assert "true ends lie outside" not in text
    assert "runs change between such an end and the next point, up to 5 rad/s away" in text
    assert "may lie some\n  steps away on either side" in text
    unstable, lasts = (f"{row['by_model'][name]:.4g}" for name in ("unstable_to", "lasts_to"))
    assert f"unstable below {unstable} rad/s, and stick-slip may last up to {lasts} rad/s" in text
