"""Friction along the wall that acts along the hole, too."""

import math

import numpy as np
import pytest

import nsdrill
from nsdrill.errors import InputError
from nsdrill.kernel.settings import Simulation
from nsdrill.models.segments.parameters import Initial, SurveyStation, WallFriction
from segments.lanes import RINGING, Slopes, run, string
from segments.plain import Plain, plain_of
from segments.test_right_hand_side import SURVEY, along

STRING = """
model: segments
segments: {{pipe: 5, collar: 2, hydraulics: {{pulsation: {pulsation}}}}}
well: {{inclination: 40 deg, friction_along: {friction}, axial_friction: {axial}}}
bit: {{surface_amplitude: {height}}}
drive: {{kind: ideal}}
operation: {{depth: 2000 m, wob: {wob}, rotary_speed: 6 rad/s}}
initial: {{start: rest}}
record: {{exponent: {exponent}}}
simulation: {{transient: 40 s, observe: 60 s, method: {method}}}
"""
STICKY = "{static: 0.3, dynamic: 0.15, smoothing: 200 s/rad}"


def study_of(
    axial="true", friction=STICKY, height="1 mm", pulsation="0 m^3/s", wob="100 kN", method="auto", exponent="false"
):
    return STRING.format(
        axial=axial, friction=friction, height=height, pulsation=pulsation, wob=wob, method=method, exponent=exponent
    )


def found_of(**choices):
    return nsdrill.run(study_of(**choices), progress=False).squeeze()


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_a_run_on_bottom_ends_where_scipy_does(method):
    """One second on the lobes from a bit that turns too slowly: DOP853 on the plain equations,
    and without friction along the hole the string ends elsewhere."""
    survey = tuple(SurveyStation(*station) for station in SURVEY)
    keys = {"segments__pipe": 4, "segments__collar": 2, "well__survey": survey}
    keys["well__friction_along"] = WallFriction(0.5, 0.2, 0.9, 80.0)
    parameters = string(**keys, well__axial_friction=True)
    plain = Plain(pipes=4, collars=2, survey=SURVEY, wall=(0.5, 0.2, 0.9, 80.0), along=True)
    settings = {"rtol": 1e-9, "method": method}
    done = run(parameters, Simulation(0.0, 1.0, **settings), Initial(bit_speed=6.0))
    end, _ = along(plain, plain_of(done["initial_state"][0, :-1], plain.n), 1.0)
    slopes = Slopes(parameters)
    size = plain_of(slopes.variant.state_scales(slopes.table[None])[0], plain.n)
    difference = np.abs(plain_of(done["final_state"][0, :-1], plain.n) - end) / (size + np.abs(end))
    assert difference.max() < (1e-5 if method == "explicit" else 2e-3)
    free = run(string(**keys), Simulation(0.0, 1.0, **settings), Initial(bit_speed=6.0))
    apart = np.abs(plain_of(free["final_state"][0, :-1], plain.n) - end) / (size + np.abs(end))
    assert apart[: plain.n].max() > 0.05


def test_a_string_that_turns_is_damped_along_the_hole():
    """About a speed w of turning, friction mu N against the slip damps a small axial velocity
    with mu N / (R w): 40 deg everywhere, the load of a metre (rho - rho_f) g A sin a."""
    w, angle, mu, eps = 13.0, math.radians(40.0), 0.2, 1e4
    quiet = {**RINGING, "mud__density": 1198.0, "well__inclination": angle, "bit__cutting__c1": 0.0}
    quiet |= {"segments__hydraulics__annulus_factor": 0.0, "segments__hydraulics__bore_factor": 0.0}
    parameters = string(**quiet, well__friction_along=WallFriction(mu, mu, 0.9, eps), well__axial_friction=True)
    slopes, plain = Slopes(parameters), Plain()
    lifted = slopes.steady()
    lifted[2 * slopes.nodes - 2] = 1.0  # off the rock
    matrix = slopes.jacobian(lifted, 1e-5)
    velocities = np.arange(1, 2 * slopes.nodes, 2)
    damping = -plain.m @ matrix[velocities][:, velocities].sum(axis=1)
    expected = 0.0
    for (outer, inner), length in ((plain.pipe, 2000.0), (plain.collar, 200.0)):
        load = (7850 - 1198) * 9.80665 * math.pi / 4 * (outer**2 - inner**2) * length * math.sin(angle)
        expected += load * mu / (outer / 2 * w) * 2 / math.pi * math.atan(eps * w)
    # half a segment of pipe lies on a node of the collars and has its radius: 2 % of the damping
    assert damping == pytest.approx(expected, rel=0.02)


def test_on_bottom_the_wall_carries_what_the_lobes_shake():
    """The swing of the hook load on a string that sticks and slips over its lobes."""
    turning, both = found_of(axial="false"), found_of()
    swings = [float(one.hook_load_change_max - one.hook_load_change_min) for one in (turning, both)]
    assert swings[1] < 0.7 * swings[0]
    assert float(both.stick_slip_period) == pytest.approx(float(turning.stick_slip_period), rel=0.03)


def test_both_methods_give_the_same_motion():
    explicit, implicit = found_of(method="explicit"), found_of(method="implicit")
    for name in ("stick_slip_period", "bit_speed_max", "surface_torque_max", "axial_max", "hook_load_change_max"):
        assert float(implicit[name]) == pytest.approx(float(explicit[name]), rel=1e-3), name


def test_a_deviation_neither_grows_nor_decays_along_a_cycle():
    for method in ("explicit", "implicit"):
        found = found_of(method=method, exponent="true")
        assert abs(float(found.lyapunov_exponent)) < 2 * float(found.lyapunov_error) + 2e-3, method


def test_steady_drilling_stays():
    """The force of steady drilling is what others are counted from: nothing accelerates."""
    parameters = string(
        bit__surface_amplitude=0.0,
        segments__hydraulics__pulsation=0.0,
        well__inclination=0.7,
        well__friction_along=WallFriction(0.3, 0.2, 0.9, 50.0),
        well__axial_friction=True,
    )
    slopes = Slopes(parameters)
    assert np.abs(slopes(0.0, slopes.steady())).max() < 1e-9


def test_friction_along_the_hole_that_does_nothing_is_told():
    """Off bottom nothing moves the string along the hole, but for the pulsation of the pumps."""

    def told(**choices):
        return any("No motion along the hole" in warning for warning in nsdrill.check(study_of(**choices)).warnings)

    assert told(wob="0 kN")
    assert not told(wob="0 kN", pulsation="0.002 m^3/s")
    assert not told()
    assert not told(wob="0 kN", axial="false")
    for name in ("stick_slip_period", "surface_torque_max"):
        both, turning = (found_of(wob="0 kN", axial=axial) for axial in ("true", "false"))
        assert float(both[name]) == pytest.approx(float(turning[name]), rel=1e-5), name


def test_without_friction_along_the_wall_it_is_refused():
    with pytest.raises(InputError, match=r"well\.axial_friction"):
        nsdrill.load_study(study_of(friction="null"))
