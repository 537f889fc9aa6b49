"""The room around a setting, and the setting that is recommended."""

import numpy as np
import pytest

from nsdrill.analysis.room import LEAST, Kind, choose, room, tolerance

RPM, KLBF = np.pi / 30, LEAST["wob"]
SPEEDS = np.arange(50, 151, 5) * RPM
WEIGHTS = np.array([10, 15, 20, 25, 30]) * KLBF
X, Y = ("rotary_speed", SPEEDS), ("wob", WEIGHTS)


def brute(allowed, y, x):
    """The definition, one pair of points after the other."""
    found = np.full(allowed.shape, -1.0)
    axes = [(y[1], tolerance(*y)), (x[1], tolerance(*x))]
    for here in np.argwhere(allowed):
        best = np.inf
        for (values, scale), i in zip(axes, here, strict=True):
            best = min(best, (values[i] - values[0]) / scale[i], (values[-1] - values[i]) / scale[i])
        for there in np.argwhere(~allowed):
            away = 0.0
            for (values, scale), i, k in zip(axes, here, there, strict=True):
                low, high = values[max(k - 1, 0)], values[min(k + 1, len(values) - 1)]
                away = max(away, (low - values[i]) / scale[i], (values[i] - high) / scale[i])
            best = min(best, away)
        found[tuple(here)] = best
    return found


def test_a_tolerance_is_a_tenth_and_at_least_five_rpm_or_a_thousand_pounds():
    assert tolerance(*X)[0] == pytest.approx(5 * RPM)
    assert tolerance(*X)[-1] == pytest.approx(15 * RPM)
    assert tolerance(*Y)[[0, -1]] == pytest.approx([KLBF, 3 * KLBF])
    assert np.isinf(tolerance("depth", np.array([1.0, 2.0]))).all()


def test_the_room_is_what_its_definition_says():
    draw = np.random.default_rng(3)
    for share in (0.5, 0.9, 0.99):
        allowed = draw.random((len(WEIGHTS), len(SPEEDS))) < share
        assert room(allowed, Y, X) == pytest.approx(brute(allowed, Y, X))


def test_every_depth_is_judged_by_itself():
    allowed = np.array([[True] * len(SPEEDS), [False] * len(SPEEDS)])
    found = room(allowed, ("depth", np.array([1000.0, 2000.0])), X)
    assert found[0, 10] == pytest.approx(room(allowed[:1], (None, np.zeros(1)), X)[0, 10])
    assert (found[1] == -1).all()


def test_with_plenty_of_room_the_fastest_drilling_is_taken():
    allowed = np.ones((1, len(SPEEDS)), dtype=bool)
    rate = SPEEDS[None] * 1.0
    place, kind, better = choose(allowed, np.zeros_like(allowed), (None, np.zeros(1)), X, rate)
    assert kind == Kind.RUN
    assert not better
    speed = SPEEDS[place[1]]
    assert (
        (SPEEDS[-1] - speed) / (0.1 * speed) >= 2.0 > (SPEEDS[-1] - SPEEDS[place[1] + 1]) / (0.1 * SPEEDS[place[1] + 1])
    )


def test_a_point_safe_after_any_history_comes_first_if_it_has_room():
    allowed = np.ones((1, len(SPEEDS)), dtype=bool)
    better = np.zeros_like(allowed)
    better[0, 3:8] = True
    place, kind, is_better = choose(allowed, better, (None, np.zeros(1)), X, np.full(allowed.shape, np.nan))
    assert (kind, is_better, place) == (Kind.RUN, True, (0, 5))
    better[0, 3:8] = False
    better[0, 4] = True  # no room of its own
    assert choose(allowed, better, (None, np.zeros(1)), X, SPEEDS[None])[2] is False


@pytest.mark.parametrize(
    ("cells", "kind", "place"), [([8, 9, 10], Kind.NARROW, 9), ([8, 9], Kind.POINT, 8), ([], Kind.NONE, None)]
)
def test_without_room_there_is_a_hint_and_without_an_allowed_point_none(cells, kind, place):
    allowed = np.zeros((1, len(SPEEDS)), dtype=bool)
    allowed[0, cells] = True
    found, how, _ = choose(allowed, np.zeros_like(allowed), (None, np.zeros(1)), X, np.full(allowed.shape, np.nan))
    assert how == kind
    assert (found and found[1]) == place


def test_a_hint_without_room_lies_off_the_ends_of_its_column_where_it_can():
    """One speed is free at all weights: of these points a weight in the middle has both neighbours."""
    allowed = np.zeros((len(WEIGHTS), len(SPEEDS)), dtype=bool)
    allowed[:, 10] = True
    place, kind, _ = choose(allowed, np.zeros_like(allowed), Y, X, np.full(allowed.shape, np.nan))
    assert (place, kind) == ((2, 10), Kind.POINT)
    allowed[0, 9:12] = True  # room along the row comes first
    assert choose(allowed, np.zeros_like(allowed), Y, X, np.full(allowed.shape, np.nan))[0] == (0, 10)
