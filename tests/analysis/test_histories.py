"""The class of a point from its histories: the table, and what makes it an answer: neither
the end of a sweep nor a run that fails makes a point safer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from nsdrill.analysis.histories import Grade, Label, Ways, carried, excursion, is_allowed, of_starts

U, X, C, T, S = Label.UNKNOWN, Label.STALLED, Label.CRITICAL, Label.TOUCHING, Label.CLEAR


def grades(up=None, down=None, same=None, met=True):
    ways = [None if way is None else np.array(way) for way in (up, down, same)]
    return [Grade(int(grade)) for grade in Ways(*ways, met=met).grades()]


# Of three points the middle one is graded; the third says what was met above.
@pytest.mark.parametrize(
    ("up", "down", "above", "grade"),
    [
        (S, S, S, Grade.ANY_HISTORY),
        (S, S, C, Grade.ANY_HISTORY),
        (S, C, C, Grade.FROM_BELOW_ONLY),
        (S, C, X, Grade.FROM_BELOW_ONLY),
        (S, X, X, Grade.FROM_BELOW_ONLY),
        (S, C, S, Grade.BORDERLINE),
        (S, T, C, Grade.BORDERLINE),
        (S, X, S, Grade.STALLED),
        (S, U, S, Grade.UNKNOWN),
        (S, S, U, Grade.UNKNOWN),
        (T, S, S, Grade.BORDERLINE),
        (C, S, S, Grade.ONLY_FROM_ABOVE),
        (C, T, S, Grade.ONLY_FROM_ABOVE),
        (C, C, S, Grade.CRITICAL),
        (C, U, S, Grade.CRITICAL),
        (C, X, S, Grade.STALLED),
        (X, S, S, Grade.STALLED),
        (U, S, S, Grade.UNKNOWN),
    ],
)
def test_the_table(up, down, above, grade):
    assert grades([S, up, S], [S, down, above])[1] == grade


def test_a_motion_that_may_last_and_was_not_met_leaves_the_way_down_open():
    assert grades([S, S], [S, S], met=np.array([False, True])) == [Grade.FROM_BELOW, Grade.ANY_HISTORY]


def test_the_last_point_of_the_way_up_is_met_on_the_way_down():
    assert grades([S, S, C], [C, C, C]) == [Grade.FROM_BELOW_ONLY, Grade.FROM_BELOW_ONLY, Grade.CRITICAL]


def test_one_history():
    assert grades(up=[S, T, C, X, U, S]) == [
        Grade.FROM_BELOW,
        Grade.BORDERLINE,
        Grade.CRITICAL,
        Grade.STALLED,
        Grade.UNKNOWN,
        Grade.UNKNOWN,  # nothing is carried over a run that failed
    ]
    assert grades(down=[S, U, S]) == [Grade.UNKNOWN, Grade.UNKNOWN, Grade.ONLY_FROM_ABOVE]
    assert grades(same=[S, C, U, S]) == [Grade.FROM_START, Grade.CRITICAL, Grade.UNKNOWN, Grade.FROM_START]


def test_a_start_at_the_point_frees_what_the_slow_way_up_does_not():
    assert grades([S, C, C, S], [S, S, C, S], [S, S, S, C]) == [
        Grade.ANY_HISTORY,
        Grade.FROM_START,
        Grade.FROM_START,
        Grade.FROM_BELOW,  # not any history: the start at the point vibrates
    ]


def test_many_starts():
    starts = np.array([[S, S, T], [S, C, U], [C, C, U], [C, X, C], [C, C, C], [U, U, U], [S, S, U]])
    assert [Grade(int(g)) for g in of_starts(starts)] == [
        Grade.ANY_HISTORY,
        Grade.FROM_SOME,
        Grade.UNKNOWN,
        Grade.STALLED,
        Grade.CRITICAL,
        Grade.UNKNOWN,
        Grade.UNKNOWN,  # safe from all, or from some: the third start decides
    ]
    assert not is_allowed(np.array(Grade.FROM_SOME)), "a string need not be among those that are free"


def test_stick_slip_that_lasts_withdraws_what_all_starts_leave_free():
    """As of one start: few of those that are drawn begin in stick-slip, so that none need show it."""
    starts = np.array([[S, S], [S, S], [S, C]])
    assert [Grade(int(g)) for g in of_starts(starts, np.array([True, False, True]))] == [
        Grade.STICKS_ON,
        Grade.ANY_HISTORY,
        Grade.FROM_SOME,
    ]
    assert Grade(int(of_starts(starts[:1], between=True)[0])) == Grade.BORDERLINE


def test_one_start_that_is_clear_says_nothing_of_those_that_failed():
    starts = np.array([[S, U, U, U]])
    assert Grade(int(of_starts(starts)[0])) == Grade.UNKNOWN


def test_what_is_met_and_what_is_carried():
    assert excursion(np.array([S, S, C]), np.array([S, S, S])).tolist() == [True, True, True]
    assert excursion(np.array([S, S, S]), np.array([C, C, S])).tolist() == [True, False, False]
    assert carried(np.array([[S, U], [U, S], [S, S]])).tolist() == [[S, U], [U, U], [U, U]]


def ways(length, wide):
    return arrays(np.int64, (length, wide), elements=st.sampled_from([int(one) for one in Label]))


@st.composite
def runs(draw):
    """Labels of a map: always a way up, perhaps a way down and a start at the point."""
    length, wide = draw(st.integers(1, 8)), draw(st.integers(1, 3))
    given_ways = [draw(ways(length, wide))] + [draw(st.none() | ways(length, wide)) for _ in range(2)]
    return given_ways, draw(arrays(bool, (length, wide)))


@given(runs(), st.data())
def test_the_end_of_a_sweep_changes_no_allowed_point_but_borderline_ones(given_runs, data):
    """The way up to a lower end is the same; the way down from there is another one, which
    may find anything."""
    (up, down, same), met = given_runs
    last = data.draw(st.integers(1, len(up)))
    other = None if down is None else data.draw(ways(last, up.shape[1]))
    whole = Ways(up, down, same, met).grades()[:last]
    cut = Ways(up[:last], other, None if same is None else same[:last], met[:last]).grades()
    withdrawn = (Grade.BORDERLINE, Grade.STALLED, Grade.UNKNOWN)
    changed = is_allowed(whole) != is_allowed(cut)
    for grade in np.where(is_allowed(whole), cut, whole)[changed]:
        assert grade in withdrawn
    # with no run that fails, is open or stalls without having been met, only borderline ones differ
    if other is not None and not np.isin(np.concatenate([down, other]), (Label.OPEN, U, X)).any():
        assert np.isin(np.where(is_allowed(whole), cut, whole)[changed], Grade.BORDERLINE).all()


@given(runs(), st.data())
def test_a_run_that_fails_makes_no_point_safer(given_runs, data):
    (up, down, same), met = given_runs
    before = Ways(up, down, same, met).grades()
    way = data.draw(st.sampled_from([one for one in (up, down, same) if one is not None]))
    place = tuple(data.draw(st.integers(0, size - 1)) for size in way.shape)
    way[place] = U
    after = Ways(up, down, same, met).grades()
    assert not np.any(is_allowed(after) & ~is_allowed(before))
    assert np.all(np.where(is_allowed(after), after <= before, True))


@given(arrays(np.int64, (1, 6), elements=st.sampled_from([int(one) for one in Label])), st.integers(0, 5))
def test_a_start_that_fails_makes_no_point_safer(labels, place):
    before = of_starts(labels)
    labels[0, place] = U
    assert of_starts(labels) <= before or not is_allowed(of_starts(labels))


def test_stick_slip_that_was_met_below_and_lasts_withdraws_a_point():
    stuck, lasts = np.array([False, True, True, True]), np.array([True, True, True, False])
    up = Ways(np.array([C, S, S, S]), lasts=lasts, stuck=stuck)
    assert [Grade(int(one)) for one in up.grades()] == [
        Grade.CRITICAL,
        Grade.STICKS_ON,
        Grade.STICKS_ON,
        Grade.FROM_BELOW,
    ]
    # without having been met on the way in it leaves the point allowed, but not after any history
    both = Ways(np.array([S, S]), np.array([S, S]), lasts=np.array([True, False]))
    assert [Grade(int(one)) for one in both.grades()] == [Grade.FROM_BELOW, Grade.ANY_HISTORY]
    # what is started there has not come through it, but may meet it there
    started = Ways(np.array([C, C, C, C]), None, np.array([C, S, C, S]), lasts=lasts)
    assert [Grade(int(one)) for one in started.grades()] == [
        Grade.CRITICAL,
        Grade.STICKS_ON,
        Grade.CRITICAL,
        Grade.FROM_START,
    ]
    might = Ways(np.array([C]), None, np.array([S]), open=np.array([True]))
    assert might.grades().tolist() == [Grade.UNKNOWN]


def test_any_history_needs_one_that_could_hold_a_vibration():
    """Where the model does not say to which speed stick-slip lasts: a way down on which no
    vibration was met says nothing of a history; one from a vibration does, and so does a
    start from which the point was tried."""
    quiet = Ways(np.array([S, S]), np.array([S, S]), tried=np.array([False, True]))
    assert [Grade(int(one)) for one in quiet.grades()] == [Grade.FROM_BELOW, Grade.ANY_HISTORY]
    met = Ways(np.array([S, C]), np.array([S, C]), tried=False)
    assert Grade(int(met.grades()[0])) == Grade.ANY_HISTORY


def test_a_start_that_is_not_known_might_have_stuck():
    stuck, is_open = np.array([False, True]), np.array([True, True])
    assert Ways(np.array([C, S]), open=is_open, stuck=stuck).grades()[1] == Grade.UNKNOWN


def test_where_steady_drilling_is_unstable_nothing_is_allowed():
    unstable = np.array([True])
    for given_ways in ({"up": np.array([S])}, {"same": np.array([S])}, {"up": np.array([C]), "same": np.array([S])}):
        assert not is_allowed(Ways(**given_ways, unstable=unstable).grades()).any()
