"""From made-up features to labels: each response, each kind, each bound. Bands: D, severity of stick-slip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsdrill.observe.classify import classify
from nsdrill.observe.thresholds import BitBounce, StickSlip, Thresholds, Whirl
from nsdrill.variables import (
    BACKWARD,
    BACKWARD_ROLLING,
    BIT_BOUNCE,
    DIVERGED,
    FEATURES,
    FORWARD,
    IRREGULAR,
    LABELS,
    NO_WHIRL,
    OK,
    STICK_SLIP,
    WHIRL,
)

CALM = dict.fromkeys(FEATURES, 0.0) | {"bit_speed_mean": 3.0, "whirl_ratio": 1.0}


def label(thresholds: Thresholds = Thresholds(), status: int = OK, **features: float) -> dict[str, int]:  # noqa: B008
    made = {name: np.array([value]) for name, value in (CALM | features).items()}
    return {name: int(v[0]) for name, v in classify(made, np.array([status]), thresholds).items()}


def test_calm_drilling_has_no_response() -> None:
    assert label() == {"response": 0, "whirl_kind": NO_WHIRL, "stick_slip_severity": 0, "settled": 1}


@pytest.mark.parametrize(
    ("features", "response"),
    [
        ({"lift_off_fraction": 0.02}, BIT_BOUNCE),
        ({"stick_slip_index": 90.0}, STICK_SLIP),
        ({"wall_contact_fraction": 0.02}, WHIRL),
        ({"lift_off_fraction": 0.5, "stick_slip_index": 120.0}, BIT_BOUNCE | STICK_SLIP),
        ({"lift_off_fraction": 0.5, "wall_contact_fraction": 1.0}, BIT_BOUNCE | WHIRL),
        ({"lift_off_fraction": 0.5, "stick_slip_index": 120.0, "wall_contact_fraction": 1.0}, 7),
    ])
def test_responses_add_up(features: dict[str, float], response: int) -> None:
    assert label(**features)["response"] == response


@pytest.mark.parametrize(("name", "bound"), [
    ("lift_off_fraction", 0.01), ("stick_slip_index", 80.0), ("wall_contact_fraction", 0.01)])
def test_a_response_begins_above_its_bound(name: str, bound: float) -> None:
    assert label(**{name: bound})["response"] == 0
    assert label(**{name: float(np.nextafter(bound, 1e9))})["response"] != 0


# D: 0-40 none, 40-60 torsional oscillation, 60-80 medium, 80-100 onset of full stall, above 100 severe
@pytest.mark.parametrize(("index", "band"), [
    (0, 0), (39.9, 0), (40, 0), (40.1, 1), (60, 1), (60.1, 2), (80, 2), (80.1, 3), (100, 3), (100.1, 4), (5000, 4)])
def test_severity_bands(index: float, band: int) -> None:
    assert label(stick_slip_index=index)["stick_slip_severity"] == band


@pytest.mark.parametrize("index", [np.inf, np.nan])
def test_a_bit_that_does_not_turn_sticks(index: float) -> None:
    """(max - min)/(2 mean) with mean zero: infinite, or undefined where nothing moves at all."""
    found = label(stick_slip_index=index, bit_speed_mean=0.0)
    assert found["response"] == STICK_SLIP
    assert found["stick_slip_severity"] == 4


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
    ])
def test_kinds_of_whirl(features: dict[str, float], kind: int) -> None:
    """On the wall all the time, but where said. Rolling: ratio within 0.1 of one, half of the time on the wall."""
    assert label(**{"wall_contact_fraction": 1.0, **features})["whirl_kind"] == kind


def test_settled_up_to_the_tolerance() -> None:
    assert label(half_difference=0.05)["settled"] == 1
    assert label(half_difference=0.0501)["settled"] == 0
    assert label(half_difference=float("nan"))["settled"] == 0


def test_failed_points_have_no_labels() -> None:
    found = label(status=DIVERGED, **dict.fromkeys(FEATURES, float("nan")))
    assert set(found.values()) == {0}


def test_thresholds_can_be_moved() -> None:
    strict = replace(
        Thresholds(), bit_bounce=BitBounce(0.0), stick_slip=StickSlip(stick_slip_index=20.0), whirl=Whirl(0.5))
    assert label(strict, lift_off_fraction=1e-9)["response"] == BIT_BOUNCE
    assert label(strict, stick_slip_index=21.0)["response"] == STICK_SLIP
    assert label(strict, wall_contact_fraction=0.4)["response"] == 0


anything = st.floats(allow_nan=True, allow_infinity=True)


@given(st.fixed_dictionaries(dict.fromkeys(FEATURES, anything)), st.integers(0, 4))
@settings(max_examples=200, deadline=None)
def test_any_features_give_labels_in_range(features: dict[str, float], status: int) -> None:
    found = label(status=status, **features)
    assert set(found) == set(LABELS)
    assert 0 <= found["response"] <= 7
    assert 0 <= found["whirl_kind"] <= 4
    assert 0 <= found["stick_slip_severity"] <= 4
    assert found["settled"] in (0, 1)
    assert (found["whirl_kind"] != NO_WHIRL) == bool(found["response"] & WHIRL)


def test_labels_keep_the_shape_of_the_grid() -> None:
    shape = (2, 3, 4, 5)
    made = {name: np.zeros(shape) for name in FEATURES}
    for name, values in classify(made, np.full(shape, OK), Thresholds()).items():
        assert values.shape == shape, name
        assert values.dtype == np.int8
