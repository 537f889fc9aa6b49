"""How far two runs of a point differ, and what follows for the trust in it."""

from dataclasses import replace

import numpy as np
import pytest
from model_tables import FEATURES
from strings import MAIN, pack

from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.christoforou_yigit.description import COMPARED
from nsdrill.models.christoforou_yigit.parameters import Bit, Drillstring, Mud, Parameters, Well
from nsdrill.models.registry import model_named
from nsdrill.models.responses import BIT_BOUNCE, STALLED, STICK_SLIP, WHIRL, Thresholds, trust_labels
from nsdrill.models.variant import variant_of
from nsdrill.observe.motion_kinds import AGREES, CHECK_FAILED, FEATURES_DIFFER, RESPONSE_DIFFERS, UNCHECKED, verdict
from nsdrill.observe.thresholds import Trust
from nsdrill.variables import MODEL, OK, PENDING, STEP_LIMIT


def test_differences_are_measured_in_natural_sizes():
    """The default gap is (15 in - 9 in) / 2, the lobe amplitude 1 mm, the drive speed
    as given."""
    units = MAIN.scales(pack(Parameters(), [2000.0] * 4, [2e4] * 4, [3.0] * 4))
    assert units["gap"] == pytest.approx([3 * 0.0254] * 4)
    one = {name: np.zeros(4) for name in COMPARED}
    two = {name: np.zeros(4) for name in COMPARED}
    two["radius_max"] = np.array([0.0254 * 0.3, 0, 0, 0])
    two["axial_min"] = np.array([0, -2e-4, 0, 0])
    two["bit_speed_max"] = np.array([0, 0, 0.9, 0])
    two["stuck_fraction"] = np.array([0, 1e-3, 0.1, 0.4])
    assert model_named(MODEL).difference(one, two, units) == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert model_named(MODEL).difference(two, one, units) == pytest.approx([0.1, 0.2, 0.3, 0.4])
    two["radius_mean"][3] = np.nan
    assert np.isnan(model_named(MODEL).difference(one, two, units)).tolist() == [False, False, False, True]


def test_everything_compared_is_a_feature():
    assert set(COMPARED) <= set(FEATURES)


def test_a_surface_without_lobes_has_a_size_too():
    parameters = Parameters(Drillstring(), Mud(), Well(), replace(Bit(), surface_amplitude=0.0))
    table = pack(parameters, [2000.0], [2e4], [3.0])
    assert MAIN.scales(table)["lobe"] == variant_of(MAIN, Options()).state_scales(table)[:, 4]
    # W / k_c, the pipe being much softer
    assert MAIN.scales(table)["lobe"][0] == pytest.approx(2e4 / 25e6, rel=0.2)


def found(**changes: list[float]) -> dict[str, np.ndarray]:
    """Two points whose checks agree with a run without a response, but for the
    changes."""
    values = {}
    for check in ("tight", "long"):
        values |= {
            f"{check}_status": np.array([OK, OK]),
            f"{check}_difference": np.array([0.01, 0.01]),
            f"{check}_lift_off_fraction": np.zeros(2),
            f"{check}_stick_slip_index": np.array([20.0, 20.0]),
            f"{check}_wall_contact_fraction": np.zeros(2),
            f"{check}_stuck_fraction": np.zeros(2),
        }
    return values | {name: np.array(value) for name, value in changes.items()}


def judged(response: list[int], thresholds: Thresholds = Thresholds(), **changes: list[float]) -> dict[str, np.ndarray]:
    values = found(**changes)
    return {
        **values,
        "response": np.array(response),
        **trust_labels(values, np.array(response), thresholds, MAIN.responses),
    }


def test_a_point_is_trusted_where_both_checks_agree():
    values = judged([0, BIT_BOUNCE])
    assert values["trusted"].tolist() == [1, 0]
    assert verdict(values).tolist() == [AGREES, RESPONSE_DIFFERS]


@pytest.mark.parametrize("check", ["tight", "long"])
def test_one_check_is_enough_to_doubt(check):
    values = judged([0, 0], **{f"{check}_difference": [0.049, 0.051]})
    assert values["trusted"].tolist() == [1, 0]
    assert verdict(values).tolist() == [AGREES, FEATURES_DIFFER]
    values = judged(
        [0, 0],
        **{
            f"{check}_lift_off_fraction": [0.0, 0.02],
            f"{check}_stick_slip_index": [20, 90],
            f"{check}_wall_contact_fraction": [0.0, 0.5],
        },
    )
    assert values[f"{check}_response"].tolist() == [0, BIT_BOUNCE | STICK_SLIP | WHIRL]
    assert values["trusted"].tolist() == [1, 0]


@pytest.mark.parametrize("check", ["tight", "long"])
def test_a_check_in_which_the_bit_stays_stuck_is_stalled(check):
    """The index is undefined where nothing moves at all."""
    values = judged(
        [STALLED, STICK_SLIP],
        tight_stick_slip_index=[np.nan, 90.0],
        long_stick_slip_index=[np.nan, 90.0],
        tight_stuck_fraction=[1.0, 0.5],
        long_stuck_fraction=[1.0, 0.5],
        **{f"{check}_lift_off_fraction": [0.5, 0.0]},
    )
    assert values[f"{check}_response"].tolist() == [STALLED, STICK_SLIP]
    assert values["trusted"].tolist() == [1, 1]


def test_a_check_that_failed_or_is_missing_is_no_agreement():
    nan = {f"tight_{name}": [np.nan, np.nan] for name in ("difference", "lift_off_fraction", "wall_contact_fraction")}
    values = judged([0, 0], tight_status=[STEP_LIMIT, PENDING], **nan)
    assert values["tight_response"].tolist() == [0, 0]
    assert values["trusted"].tolist() == [0, 0]
    assert verdict(values).tolist() == [CHECK_FAILED, UNCHECKED]


def test_the_labels_follow_the_thresholds():
    strict, loose = (replace(Thresholds(), trust=Trust(0.005)), replace(Thresholds(), trust=Trust(0.02)))
    assert judged([0, 0], strict)["trusted"].tolist() == [0, 0]
    assert judged([0, 0], loose)["trusted"].tolist() == [1, 1]
    lower = replace(Thresholds(), stick_slip=replace(Thresholds().stick_slip, stick_slip_index=10.0))
    assert judged([0, STICK_SLIP], lower)["trusted"].tolist() == [0, 1]
