"""Groups of starts: known ones are found, labels part them, shares have their
intervals."""

import numpy as np
import pytest
from model_tables import VARIABLES
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist
from scipy.stats import binomtest

from nsdrill.analysis.attractors import UNSETTLED_SHARE, describe, label, linked, places, wilson
from nsdrill.analysis.branch_numbers import number
from nsdrill.models.christoforou_yigit.collar import WEIGHTS, extent, scaled_features
from nsdrill.models.christoforou_yigit.description import DISTINGUISHING
from nsdrill.models.responses import BIT_BOUNCE, STICK_SLIP, WHIRL
from nsdrill.variables import CHAOTIC, DIVERGED, OK, PENDING, PERIODIC, QUASI_PERIODIC, UNDETERMINED, UNSETTLED

GAP, SPEED, TOLERANCE = 0.0762, 3.0, 0.05


def starts(count: int, **features: object) -> dict[str, np.ndarray]:
    """``count`` starts of one operating point in smooth drilling, but for ``features``."""
    made = {
        "status": OK,
        "response": 0,
        "whirl_kind": 0,
        "settled": 1,
        "lift_off_fraction": 0.0,
        "wall_contact_fraction": 0.0,
        "stuck_fraction": 0.0,
        "stick_slip_index": 4.0,
        "radius_mean": 4e-3,
        "whirl_speed_mean": SPEED,
        "axial_acceleration_rms": 0.1,
        "half_difference": 0.01,
        "axial_min": -2e-3,
        "axial_max": 1e-3,
        "radius_max": 5e-3,
        "bit_speed_min": 2.9,
        "bit_speed_max": 3.1,
    } | features
    kinds = {v.name: v.dtype for v in VARIABLES}
    return {name: np.broadcast_to(np.asarray(value, kinds[name]), count).copy() for name, value in made.items()}


def coordinates(variables: dict, speed: np.ndarray, gap: np.ndarray, axial: np.ndarray) -> tuple:
    """As the main model has them."""
    apart = scaled_features(variables, speed[:, None], gap[:, None])
    return apart, np.concatenate(
        [apart * WEIGHTS, extent(variables, speed[:, None], gap[:, None], axial[:, None])], axis=-1
    )


def found(*groups: dict[str, np.ndarray], tolerance: float = TOLERANCE) -> list[int]:
    """The numbers of starts of one operating point."""
    one = {name: np.concatenate([group[name] for group in groups])[None] for name in groups[0]}
    speed, gap, axial = np.array([[SPEED], [GAP], [1e-3]])
    apart, along = coordinates(one, speed, gap, axial)
    group = label(one, apart, tolerance)
    numbers = number(places(one, group, along), (1,), 0.25)
    return np.concatenate([[0], numbers])[group[0]].tolist()


BOUNCE = {"response": BIT_BOUNCE, "lift_off_fraction": 0.7, "axial_acceleration_rms": 0.4}
WIDE = {"radius_mean": 0.9 * GAP}
ROW = np.linspace(0, 1, 30) * GAP
LOOSE, FIRM = {"half_difference": 0.4, "settled": 0}, {"half_difference": 0.01}
FAR = BOUNCE | {"lift_off_fraction": 0.7 + 0.4 * UNSETTLED_SHARE * 0.99}
STUCK = {"response": STICK_SLIP, "stick_slip_index": np.inf, "stuck_fraction": 1.0, "axial_acceleration_rms": 0.0}
BAD = starts(2, status=DIVERGED, radius_mean=np.nan)
SCATTER = 0.7 + 0.01 * np.random.default_rng(1).standard_normal(7)
BOUNCES = starts(7, **BOUNCE | {"lift_off_fraction": SCATTER})


@pytest.mark.parametrize(
    ("groups", "numbers"),
    [
        # Smooth drilling and bounce beside each other, as near 2000 m in the worked example.
        pytest.param([starts(5), BOUNCES, starts(4)], [1] * 5 + [2] * 7 + [1] * 4, id="bistable"),
        pytest.param([starts(3), BOUNCES], [2] * 3 + [1] * 7, id="the largest is the first"),
        pytest.param(
            [starts(4, **BOUNCE), starts(2, **BOUNCE | {"lift_off_fraction": 0.78})],
            [1] * 4 + [2] * 2,
            id="two bounces with the same labels",
        ),
        pytest.param(
            [starts(2), starts(1, axial_acceleration_rms=0.1 * np.exp(0.09))], [1, 1, 1], id="9 % of acceleration"
        ),
        pytest.param(
            [starts(2), starts(1, axial_acceleration_rms=0.1 * np.exp(0.11))], [1, 1, 2], id="11 % of acceleration"
        ),
        pytest.param([starts(2), starts(1, whirl_speed_mean=0.9 * SPEED)], [1, 1, 1], id="whirl on a small orbit"),
        pytest.param(
            [starts(2, **WIDE), starts(1, **WIDE, whirl_speed_mean=-1.48 * SPEED)],
            [1, 1, 2],
            id="whirl the other way on a large orbit",
        ),
        pytest.param([starts(2), starts(1, response=WHIRL)], [1, 1, 2], id="another response"),
        pytest.param([starts(2), starts(1, response=STICK_SLIP)], [1, 1, 2], id="stick-slip"),
        pytest.param([starts(2), starts(1, whirl_kind=2)], [1, 1, 2], id="another kind of whirl"),
        pytest.param([starts(30, radius_mean=ROW)], [1] * 30, id="a chain is one group"),
        pytest.param([starts(28, radius_mean=np.delete(ROW, [10, 11]))], [2] * 10 + [1] * 18, id="a chain with a gap"),
        pytest.param(
            [starts(2, **BOUNCE | LOOSE), starts(1, **FAR | LOOSE)], [1, 1, 1], id="unsettled motions scatter more"
        ),
        pytest.param([starts(2, **BOUNCE | LOOSE), starts(1, **FAR | FIRM)], [1, 1, 2], id="the steadier one decides"),
        pytest.param([BAD, starts(3), starts(1, status=PENDING)], [0, 0, 1, 1, 1, 0], id="failed starts are on none"),
        pytest.param([BAD], [0, 0], id="all failed"),
        pytest.param(
            [starts(2, **STUCK), starts(1, **STUCK | {"stick_slip_index": np.nan})], [1, 1, 1], id="a bit at rest"
        ),
    ],
)
def test_groups(groups, numbers):
    assert found(*groups) == numbers


@pytest.mark.parametrize(
    ("name", "step"),
    [
        ("lift_off_fraction", 1),
        ("wall_contact_fraction", 1),
        ("stuck_fraction", 1),
        ("stick_slip_index", 200),
        ("radius_mean", GAP),
    ],
)
def test_the_scales(name, step):
    base = float(starts(1)[name][0])
    assert found(starts(2), starts(1, **{name: base + 0.9 * TOLERANCE * step})) == [1, 1, 1]
    assert found(starts(2), starts(1, **{name: base + 1.1 * TOLERANCE * step})) == [1, 1, 2]


def test_a_start_on_its_way_bridges_nothing():
    """It changes from one motion to the other within the window, so that its means lie
    between theirs."""
    chain = 0.6 + 0.02 * np.arange(11)
    ends = (starts(3, **BOUNCE | {"lift_off_fraction": 0.6}), starts(2, **BOUNCE | {"lift_off_fraction": 0.8}))
    between = {"lift_off_fraction": chain[1:-1], "half_difference": 0.02, "settled": 0}
    # Those within the tolerance of an end go with it, the five others are for
    # themselves.
    assert found(*ends, starts(9, **BOUNCE | between)) == [1] * 3 + [3] * 2 + [1] * 2 + [2] * 5 + [3] * 2
    # Were they settled, they would be a chain.
    assert set(found(*ends, starts(9, **BOUNCE | between | {"settled": 1}))) == {1}


def test_kinds_of_motion_part_where_they_are_decided():
    def of(count, motion, period=0):
        return starts(count, **BOUNCE, motion=motion, period=period)

    assert found(of(3, PERIODIC, 1), of(2, PERIODIC, 3), of(1, CHAOTIC)) == [1] * 3 + [2] * 2 + [3]
    for told in (CHAOTIC, UNDETERMINED):
        assert found(of(3, QUASI_PERIODIC), of(2, told), of(1, PERIODIC, 2)) == [1] * 5 + [2], "no period, all the same"
    # One that is not decided goes with the nearest, and does not bridge the others.
    near = starts(1, **BOUNCE | {"lift_off_fraction": 0.72}, motion=UNSETTLED, period=0)
    three = starts(2, **BOUNCE | {"lift_off_fraction": 0.73}, motion=PERIODIC, period=3)
    assert found(of(3, PERIODIC, 1), three, near) == [1] * 3 + [2] * 2 + [2]
    assert found(of(2, UNDETERMINED), of(1, UNSETTLED)) == [1, 1, 1]


def test_the_order_of_the_starts_changes_no_group():
    rng = np.random.default_rng(7)
    features = {"lift_off_fraction": rng.uniform(0, 1, 60), "radius_mean": rng.uniform(0, GAP, 60)}
    straight = np.array(found(starts(60, **features)))
    turn = rng.permutation(60)
    turned = np.array(found(starts(60, **{name: values[turn] for name, values in features.items()})))
    same = straight[turn][:, None] == straight[turn][None]
    assert np.array_equal(same, turned[:, None] == turned[None])
    assert len(set(straight)) > 3


def clumps(count: int, apart: float) -> np.ndarray:
    """Dense clumps in a row, each of many more vectors than have their nearest looked
    up, and equal ones."""
    rng = np.random.default_rng(3)
    vectors = rng.uniform(-0.01, 0.01, (40 * count, 3)) + np.repeat(np.arange(count), 40)[:, None] * [apart, 0, 0]
    return np.concatenate([vectors, np.repeat(vectors[:1], 40, axis=0)])


@pytest.mark.parametrize(
    ("vectors", "groups"),
    [
        (np.random.default_rng(2).uniform(0, 1, (300, 3)), range(10, 290)),
        (clumps(5, 0.105), [1]),
        (clumps(5, 0.115), [5]),
        (clumps(1, 0.0), [1]),
    ],
)
def test_linkage_is_that_of_scipy(vectors, groups):
    mine = linked(vectors, np.zeros(len(vectors)), 0.09)
    theirs = fcluster(linkage(vectors, "single", metric="chebyshev"), 0.09, "distance")
    assert len(set(theirs)) in groups
    assert np.array_equal(mine[:, None] == mine[None], theirs[:, None] == theirs[None])


def test_two_are_linked_where_each_is_in_reach_of_the_other():
    rng = np.random.default_rng(5)
    vectors, scatter = rng.normal(0, 0.2, (400, 2)), rng.uniform(0, 0.4, 400)
    reach = np.maximum(0.01, UNSETTLED_SHARE * scatter)
    near = cdist(vectors, vectors, "chebyshev") <= np.minimum(reach[:, None], reach)
    count, expected = connected_components(near)
    found = linked(vectors, scatter, 0.01)
    assert 10 < count < 300
    assert np.array_equal(found[:, None] == found[None], expected[:, None] == expected[None])


def test_points_are_grouped_each_for_itself():
    one = {
        name: np.stack([a, b])
        for (name, a), b in zip(starts(3).items(), starts(3, lift_off_fraction=[0, 0.5, 0.5]).values(), strict=True)
    }
    first, second = label(one, scaled_features(one, np.full((2, 1), SPEED), np.full((2, 1), GAP)), TOLERANCE).tolist()
    assert first == [1, 1, 1]
    assert second[0] != second[1] == second[2]
    assert scaled_features(one, np.full((2, 1), SPEED), np.full((2, 1), GAP)).shape == (2, 3, 7)


# Known intervals: Wilson 1927 as tabulated by Newcombe 1998, Statist. Med. 17:857-872,
# table I, method 3.
@pytest.mark.parametrize(
    ("count", "total", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_known_intervals(count, total, low, high):
    assert wilson(count, total) == pytest.approx((low, high), abs=5e-5)


@pytest.mark.parametrize(("count", "total"), [(0, 5), (5, 5), (1, 64), (31, 64), (4000, 4900)])
def test_intervals_are_those_of_scipy(count, total):
    assert wilson(count, total) == pytest.approx(tuple(binomtest(count, total).proportion_ci(method="wilson")))


def test_intervals_at_the_ends():
    assert wilson(0, 10)[0] == 0.0
    assert wilson(10, 10)[1] == 1.0
    assert wilson(0, 0) == (0.0, 1.0)


def test_what_is_told_of_attractors():
    parts = [
        starts(6, **BOUNCE, radius_max=[1, 2, 3, 4, 5, 60.0]),
        starts(2, radius_max=0.5, settled=0),
        starts(1, status=DIVERGED, radius_max=np.nan),
        starts(1, status=PENDING, radius_max=np.nan),
    ]
    one = {name: np.concatenate([part[name] for part in parts])[None] for name in parts[0]}
    one["attractor"] = np.array([[7] * 6 + [3] * 2 + [0] * 2])
    (((first, second), counts),) = describe(one, one["status"] == OK, DISTINGUISHING)
    assert (first.number, second.number) == (7, 3), "by falling share"
    unknown = {"failed": 1, "pending": 1, "unsettled": 2, "doubtful": 0, "ungrouped": 0}
    assert counts == {"starts": 10, "known": 8, **unknown}
    assert (first.response, first.members, first.unsettled, first.share) == (BIT_BOUNCE, 6, 0, 0.75)
    assert (second.response, second.members, second.unsettled, second.share) == (0, 2, 2, 0.25)
    assert (first.low, first.high) == (wilson(6, 10)[0], wilson(8, 10)[1]), "whatever the other two are on"
    assert first.features["radius_max"] == 3.5, "the median"
    assert first.motion is None
