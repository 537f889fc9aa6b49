"""From made-up features to labels: each response, each kind, each bound. Bands: D,
severity of stick-slip."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from model_tables import FEATURES, LABELS
from strings import MAIN

from nsdrill.models.responses import (
    BIT_BOUNCE,
    STALLED,
    STICK_SLIP,
    WHIRL,
    BitBounce,
    StickSlip,
    Thresholds,
    Whirl,
    present,
)
from nsdrill.variables import BACKWARD, BACKWARD_ROLLING, DIVERGED, FORWARD, IRREGULAR, LOW_SIDE, NO_WHIRL, OK

ONES = np.ones(8)  # natural scales of the states
CALM = dict.fromkeys(FEATURES, 0.0) | {"bit_speed_mean": 3.0, "whirl_ratio": 1.0}


def label(thresholds: Thresholds = Thresholds(), status: int = OK, **features: float) -> dict[str, int]:
    made = {name: np.array([value]) for name, value in (CALM | features).items()}
    return {
        name: int(v[0]) for name, v in MAIN.classify(made, np.array([status]), thresholds, ONES, np.array([9])).items()
    }


def test_calm_drilling_has_no_response():
    assert label() == {
        "response": 0,
        "whirl_kind": NO_WHIRL,
        "stick_slip_severity": 0,
        "bounce_severity": 0,
        "whirl_severity": 0,
        "settled": 1,
    }


@pytest.mark.parametrize(
    ("features", "response"),
    [
        ({"lift_off_fraction": 0.02}, BIT_BOUNCE),
        ({"stick_slip_index": 90.0}, STICK_SLIP),
        ({"wall_contact_fraction": 0.02}, WHIRL),
        ({"lift_off_fraction": 0.5, "stick_slip_index": 120.0}, BIT_BOUNCE | STICK_SLIP),
        ({"lift_off_fraction": 0.5, "wall_contact_fraction": 1.0}, BIT_BOUNCE | WHIRL),
        ({"lift_off_fraction": 0.5, "stick_slip_index": 120.0, "wall_contact_fraction": 1.0}, 7),
    ],
)
def test_responses_add_up(features, response):
    assert label(**features)["response"] == response


@pytest.mark.parametrize(
    ("name", "bound"), [("lift_off_fraction", 0.01), ("stick_slip_index", 80.0), ("wall_contact_fraction", 0.01)]
)
def test_a_response_begins_above_its_bound(name, bound):
    assert label(**{name: bound})["response"] == 0
    assert label(**{name: float(np.nextafter(bound, 1e9))})["response"] != 0


# D: 0-40 none, 40-60 torsional oscillation, 60-80 medium, 80-100 onset of full stall,
# above 100 severe
@pytest.mark.parametrize(
    ("index", "band"),
    [(0, 0), (39.9, 0), (40, 0), (40.1, 1), (60, 1), (60.1, 2), (80, 2), (80.1, 3), (100, 3), (100.1, 4), (5000, 4)],
)
def test_severity_bands(index, band):
    assert label(stick_slip_index=index)["stick_slip_severity"] == band


@pytest.mark.parametrize(
    ("fraction", "band"),
    [(0, 0), (0.01, 0), (0.0101, 1), (0.1, 1), (0.101, 2), (0.3, 2), (0.301, 3), (0.6, 3), (0.601, 4), (1, 4)],
)
def test_bands_of_bit_bounce(fraction, band):
    """As in the table of thresholds; with the defaults there is a grade exactly where
    there is the response."""
    found = label(lift_off_fraction=fraction)
    assert found["bounce_severity"] == band
    assert (band > 0) == bool(found["response"] & BIT_BOUNCE)


@pytest.mark.parametrize(
    ("acceleration", "band"),
    [(0, 0), (2.5, 0), (2.51, 1), (5, 1), (5.01, 2), (7.5, 2), (7.51, 3), (10, 3), (10.1, 4), (np.inf, 4)],
)
def test_bands_of_whirl(acceleration, band):
    """On the wall or not: a tool feels the acceleration either way."""
    assert label(lateral_acceleration_rms=acceleration)["whirl_severity"] == band
    on_wall = label(lateral_acceleration_rms=acceleration, wall_contact_fraction=1.0)
    assert on_wall["whirl_severity"] == max(band, 1)


def test_no_critical_response_is_graded_none():
    """Also with a response threshold below the first bound of severity; a bound above
    it stays as it is."""
    low = replace(Thresholds(), bit_bounce=BitBounce(lift_off_fraction=0.001))
    assert label(low, lift_off_fraction=0.005) | {"response": BIT_BOUNCE, "bounce_severity": 1} == label(
        low, lift_off_fraction=0.005
    )
    high = replace(Thresholds(), bit_bounce=BitBounce(lift_off_fraction=0.5))
    found = label(high, lift_off_fraction=0.4)
    assert (found["response"], found["bounce_severity"]) == (0, 3)


def test_the_bounds_of_severity_can_be_moved():
    strict = replace(
        Thresholds(),
        bit_bounce=BitBounce(0.0, 0.2, 0.4, 0.6, 0.8),
        whirl=Whirl(0.01, 0.1, 0.5, 0.1, 1.0, 2.0, 3.0, 4.0),
    )
    assert label(strict, lift_off_fraction=0.5)["bounce_severity"] == 2
    assert label(strict, lateral_acceleration_rms=3.5)["whirl_severity"] == 3


@pytest.mark.parametrize(("index", "stuck"), [(np.inf, 0.6), (np.nan, 1.0)])
def test_a_bit_that_does_not_turn_is_stalled(index, stuck):
    """(max - min)/(2 mean) with mean zero: infinite where the bit rocks to and fro,
    undefined where nothing moves at all. A bit that does not turn has no stick-slip to
    grade."""
    found = label(stick_slip_index=index, bit_speed_mean=0.0, stuck_fraction=stuck)
    assert found["response"] == STALLED
    assert found["stick_slip_severity"] == 0


def test_a_stalled_bit_has_no_other_response():
    """Stalled above 0.99 of the time with the bit stuck, not at it."""
    others = {"lift_off_fraction": 0.5, "stick_slip_index": 120.0, "wall_contact_fraction": 1.0}
    assert label(stuck_fraction=0.99, **others)["response"] == BIT_BOUNCE | STICK_SLIP | WHIRL
    assert label(stuck_fraction=float(np.nextafter(0.99, 1)), **others)["response"] == STALLED


@pytest.mark.parametrize(
    ("features", "kind"),
    [
        ({"wall_contact_fraction": 0.0, "whirl_ratio": -2.0}, NO_WHIRL),
        ({"whirl_ratio": 1.0}, FORWARD),
        ({"whirl_ratio": 0.2}, FORWARD),
        ({"whirl_ratio": -0.5}, BACKWARD),
        ({"whirl_ratio": 0.05}, IRREGULAR),
        ({"whirl_ratio": -0.05}, IRREGULAR),
        ({"whirl_ratio": 0.1}, FORWARD),
        ({"whirl_ratio": -0.1}, BACKWARD),
        ({"whirl_ratio": -1.48, "rolling_ratio": 1.0}, BACKWARD_ROLLING),
        ({"whirl_ratio": -1.48, "rolling_ratio": 0.95}, BACKWARD_ROLLING),
        ({"whirl_ratio": -1.48, "rolling_ratio": 1.05}, BACKWARD_ROLLING),
        ({"whirl_ratio": -1.0, "rolling_ratio": 0.7}, BACKWARD),
        ({"whirl_ratio": -1.48, "rolling_ratio": 1.0, "wall_contact_fraction": 0.3}, BACKWARD),
        ({"whirl_ratio": float("nan")}, IRREGULAR),
    ],
)
def test_kinds_of_whirl(features, kind):
    """On the wall all the time, but where said. Rolling: ratio within 0.1 of one, half
    of the time on the wall."""
    assert label(**{"wall_contact_fraction": 1.0, **features})["whirl_kind"] == kind


@pytest.mark.parametrize(
    ("features", "kind"),
    [
        ({}, LOW_SIDE),
        ({"y_mean": 0.01}, IRREGULAR),  # not in the lower half
        ({"wall_contact_fraction": 0.4}, LOW_SIDE),  # it taps the low side, with less than what lies there may have
        ({"wall_contact_fraction": 0.4, "radius_mean": 0.07}, IRREGULAR),  # about the middle, most of the time off it
        ({"wall_contact_fraction": 0.4, "lateral_acceleration_rms": 2.51}, IRREGULAR),
        ({"lateral_acceleration_rms": 2.51}, IRREGULAR),  # it strikes the wall: above a quarter of g
        ({"rolling_ratio": 1.0, "whirl_ratio": -1.48}, BACKWARD_ROLLING),
        ({"whirl_ratio": -0.5}, BACKWARD),
    ],
)
def test_a_collar_that_lies_on_the_low_side_does_not_whirl(features, kind):
    """It is told of by its kind alone: neither a response nor a severity. What rolls, or
    strikes the wall, whirls."""
    resting = {"wall_contact_fraction": 1.0, "whirl_ratio": 0.0, "y_mean": -0.03, "radius_mean": 0.05}
    resting["lateral_acceleration_rms"] = 2.5
    found = label(**{**resting, **features})
    assert found["whirl_kind"] == kind
    assert bool(found["response"] & WHIRL) == (kind != LOW_SIDE)
    assert (found["whirl_severity"] > 0) == (kind != LOW_SIDE)


def test_settled_up_to_the_tolerance():
    assert label(half_difference=0.05)["settled"] == 1
    assert label(half_difference=0.0501)["settled"] == 0
    assert label(half_difference=float("nan"))["settled"] == 0


N = np.arange(24.0)
SWING = 1.0 + 0.001 * np.cos(N)  # peaks of a beat


@pytest.mark.parametrize(
    ("peaks", "is_settled"),
    [
        (np.exp(0.004 * N), False),  # 0.001/s at a period of 4 s
        (3.0 - 2.0 * np.exp(-0.01 * N), False),  # 1.4 of the limit is to come
        (3.0 - np.exp(-0.3 * N), True),  # it has come
        (np.exp(-0.004 * N), True),
        (SWING, True),
        (np.full(24, 1.0), True),
        (1.0 + 1e-5 * N, True),  # the error of the steps
    ],
)
@pytest.mark.parametrize("kept", [24, 32])
def test_peaks_that_keep_rising_have_not_settled(peaks, is_settled, kept):
    """Though the halves agree, as of a motion that grows slowly; of fewer than six it is not
    told, and a swing that was higher before comes back."""

    def settled(peaks: np.ndarray, highest: float, half_difference: float = 0.04) -> int:
        row = np.full((1, kept), np.nan)
        row[0, : len(peaks)] = peaks
        found = CALM | {"half_difference": half_difference, "bit_speed_max": highest, "bit_speed_min": -highest}
        made = {name: np.array([value]) for name, value in found.items()} | {"bit_speed_peaks": row}
        return int(MAIN.classify(made, np.array([OK]), Thresholds(), ONES, np.array([9]))["settled"][0])

    assert settled(peaks, peaks.max()) == is_settled
    assert settled(peaks[-5:], peaks.max()) == settled(peaks, peaks.max(), 1e-3) == 1
    assert settled(peaks, 2.0 * peaks.max()) == 1


def test_failed_points_have_no_labels():
    found = label(status=DIVERGED, **dict.fromkeys(FEATURES, float("nan")))
    assert set(found.values()) == {0}


def test_thresholds_can_be_moved():
    strict = replace(
        Thresholds(), bit_bounce=BitBounce(0.0), stick_slip=StickSlip(stick_slip_index=20.0), whirl=Whirl(0.5)
    )
    assert label(strict, lift_off_fraction=1e-9)["response"] == BIT_BOUNCE
    assert label(strict, stick_slip_index=21.0)["response"] == STICK_SLIP
    assert label(strict, wall_contact_fraction=0.4)["response"] == 0


anything = st.floats(allow_nan=True, allow_infinity=True)


@given(st.fixed_dictionaries(dict.fromkeys(FEATURES, anything)), st.integers(0, 4))
@settings(max_examples=200)
def test_any_features_give_labels_in_range(features, status):
    found = label(status=status, **features)
    assert set(found) == set(LABELS)
    assert 0 <= found["response"] <= STALLED
    assert 0 <= found["whirl_kind"] <= 4
    assert 0 <= found["stick_slip_severity"] <= 4
    for bit, name in ((BIT_BOUNCE, "bounce_severity"), (WHIRL, "whirl_severity")):
        assert 0 <= found[name] <= 4
        assert found[name] > 0 or not found["response"] & bit
    assert found["settled"] in (0, 1)
    assert (found["whirl_kind"] != NO_WHIRL) == bool(found["response"] & WHIRL)


def test_labels_keep_the_shape_of_the_grid():
    shape = (2, 3, 4, 5)
    made = {name: np.zeros(shape) for name in FEATURES}
    for name, values in MAIN.classify(made, np.full(shape, OK), Thresholds(), ONES, np.full(shape, 9)).items():
        assert values.shape == shape, name
        assert values.dtype == np.int8


def test_a_bit_that_creeps_stands_and_is_no_free_drilling():
    """Friction that is smoothed lets a bit under a great weight creep at 0.0005 rad/s, of 2."""
    speeds = np.array([5e-4, 0.4, 2.0])
    features = {"bit_speed_max": speeds, "bit_speed_mean": speeds, "stick_slip_index": np.zeros(3)}
    assert present(features, Thresholds()).tolist() == [STALLED, 0, 0]
