"""Curves of special points in two numbers against closed forms and against branches at
other values, and thresholds."""

import numpy as np
import pytest
from scipy.optimize import brentq

import nsdrill
from nsdrill.analysis.bifurcations import FOLD, HOPF
from nsdrill.models.torsion import torque

STUDY = {
    "model": "torsion",
    "operation": {"depth": "5000 m", "wob": "22 kN"},
    "simulation": {"transient": "5 s", "observe": "5 s"},
    "continue": {
        "along": "rotary_speed",
        "from": "1.8 rad/s",
        "to": "6 rad/s",
        "seeds": {"rotary_speed": ["5 rad/s"]},
        "points": 400,
    },
}
STICK_ONSET = 104


@pytest.fixture(scope="module")
def continued():
    """Steady drilling and the cycles that spring from it, with the curves of Hopf
    points and folds of cycles."""
    curves = {"over": "wob", "from": "21 kN", "to": "24 kN", "of": ["hopf", "fold"], "points": 40}
    study = nsdrill.load_study({**STUDY, "continue": {**STUDY["continue"], "curves": curves}})
    return study, nsdrill.continue_branches(study)


def curve(data, label):
    """Both numbers along the only curve of a label, the second increasing."""
    (number,) = np.flatnonzero(data["curve_label"].values == label)
    ends = np.cumsum(data["curve_row_size"].values)
    part = slice(ends[number] - data["curve_row_size"].values[number], ends[number])
    order = np.argsort(data["curve_wob"].values[part])
    return data["curve_rotary_speed"].values[part][order], data["curve_wob"].values[part][order]


def test_curve_of_hopf_points(continued):
    """Steady drilling is lost where the damping and the slope of the torque add up to
    nothing, at every weight."""
    study, data = continued
    speeds, weights = curve(data, HOPF)
    assert (weights[0], weights[-1]) == pytest.approx((21e3, 24e3))
    h, bit = 1e-5, study.parameters.bit

    def damping(speed, wob):
        slope = (torque(bit, wob, speed + h) - torque(bit, wob, speed - h)) / (2.0 * h)
        return study.parameters.drillstring.damping + slope

    exact = [brentq(damping, 1.0, 4.0, args=(wob,)) for wob in weights]
    assert speeds == pytest.approx(exact, abs=1e-6)


def test_curve_of_folds_of_cycles(continued):
    """The curve passes the fold of the branch at another weight on bit."""
    _, data = continued
    speeds, weights = curve(data, FOLD)
    assert weights[0] < 21.9e3
    assert weights[-1] > 22.1e3
    near = int(np.argmin(np.abs(weights - 22.4e3)))
    wob = float(weights[near])
    there = nsdrill.continue_branches({**STUDY, "operation": {"depth": "5000 m", "wob": f"{wob!r} N"}})
    (fold,) = there["rotary_speed"].values[there["label"].values == FOLD]
    assert speeds[near] == pytest.approx(fold, abs=1e-6)


def test_onset_of_sticking(continued):
    """Where the bit begins to stick, the least bit speed of the cycle is the threshold;
    stability does not change."""
    study, data = continued
    place = int(np.argmax(data["label"].values == STICK_ONSET))
    assert data["label"].values[place] == STICK_ONSET
    assert data["bit_speed_min"].values[place] == pytest.approx(study.thresholds.stuck_below, abs=1e-6)
    assert data["unstable"].values[place - 1] == data["unstable"].values[place + 1]
    sticks = data["touches"].sel(contact="bit").values
    slow = data["bit_speed_min"].values < study.thresholds.stuck_below
    cycles = (data["branch_of_point"].values == 1) & (np.arange(len(slow)) != place)
    assert np.array_equal(sticks[cycles] > 0, slow[cycles])


def test_bad_curves_are_refused():
    curves = {"over": "wob", "from": "30 kN", "to": "40 kN"}
    study = nsdrill.load_study({**STUDY, "continue": {**STUDY["continue"], "curves": curves}})
    with pytest.raises(nsdrill.InputError, match="set out"):
        nsdrill.continue_branches(study)
