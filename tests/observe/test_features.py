"""What is measured during a run, against the same measured on a finely sampled SciPy
solution, and on known motions."""

from dataclasses import replace

import numpy as np
import pytest
from kernel.motions import BOUNCING, RUBBING, SMOOTH, start_of
from model_tables import FEATURES
from reference import Case
from sweep.runs import collect, finish, run_from, run_work, work_for

from nsdrill.kernel.settings import Simulation
from nsdrill.variables import OK, STEP_LIMIT
from observe.sampled import Sampled, sample

STUCK_BELOW = 0.5
STICKING = Case(wob=66.72e3, speed=2.0, bit_smoothing=100.0)
ROLLING = Case(speed=8.0)
HERTZ = RUBBING.but(wall_law="hertz", wall_stiffness=2e7, softening="static", eccentric_mass="steel", lobes=1)
# The string wound up so far that the bit is about to break loose.
WOUND_UP = start_of(STICKING) + np.array([0, 0, 0, 0, 0, 0, -15, 0, 0])
WINDOWS = {
    # name: case, start, transient, observe
    "smooth": (SMOOTH, start_of(SMOOTH), 1.0, 6.0),
    "bouncing": (BOUNCING, start_of(BOUNCING), 0.5, 3.0),
    "rubbing": (RUBBING, start_of(RUBBING), 0.0, 2.0),
    "sticking": (STICKING, WOUND_UP, 0.25, 5.0),
    "hertz": (HERTZ, start_of(RUBBING), 0.0, 2.0),
    "rolling": (ROLLING, np.array([0.0765, 0, 0, -1.0, -9e-4, 0, -1, 8, 0]), 0.1, 1.5),
}
# The least that each feature is measured against: the size of the motion that it
# belongs to.
NATURAL = {
    "bit_speed_min": "speed",
    "bit_speed_max": "speed",
    "bit_speed_mean": "speed",
    "whirl_speed_mean": "speed",
    "stick_slip_index": 100.0,
    "stuck_fraction": 1.0,
    "lift_off_fraction": 1.0,
    "wall_contact_fraction": 1.0,
    "axial_min": "amplitude",
    "axial_max": "amplitude",
}
# Coarser than the rest, by its making. The radius near the centre of the hole has a
# kink that its quadrature, by its values and slopes at the ends of a step, cannot see.
COARSE = {"radius_mean": 5e-6}


@pytest.fixture(scope="module", params=list(WINDOWS))
def window(request):
    case, start, transient, observe = WINDOWS[request.param]
    work = work_for(case, Simulation(transient, observe, rtol=1e-10), stuck_below=STUCK_BELOW)
    found = run_from(work, start[None])
    return request.param, sample(case, start, transient, observe, STUCK_BELOW, 5e-5), found


def test_features_equal_those_of_a_sampled_scipy_solution(window):
    """To 1e-6 of their size at rtol 1e-10: the sampling of the comparison leaves
    5e-7."""
    name, expected, found = window
    case = expected.case
    wrong = {}
    for feature, value in expected.features().items():
        natural = NATURAL.get(feature, 0.0)
        size = max(abs(value), getattr(case, natural) if isinstance(natural, str) else natural)
        if abs(found[feature][0] - value) > COARSE.get(feature, 1e-6) * size + 1e-9:
            wrong[feature] = (found[feature][0], value)
    assert not wrong, name
    assert set(expected.features()) == set(FEATURES) - {"half_difference"}


def test_half_difference_is_the_worst_disagreement_of_the_halves(window):
    """Extremes over their range (and a hundredth of the natural scale), fractions of
    time, mean speed."""
    _, expected, found = window
    case, n = expected.case, len(expected.t) // 2
    first, second = (
        Sampled(case, expected.t[part], expected.y[:, part], STUCK_BELOW).features()
        for part in (slice(None, n + 1), slice(n, None))
    )
    worst = [abs(first["bit_speed_mean"] - second["bit_speed_mean"]) / case.speed]
    for low, high, size in (("axial_min", "axial_max", case.amplitude), ("bit_speed_min", "bit_speed_max", case.speed)):
        span = max(first[high], second[high]) - min(first[low], second[low]) + 0.01 * size
        worst += [abs(first[name] - second[name]) / span for name in (low, high)]
    radii = first["radius_max"], second["radius_max"]
    worst.append(abs(radii[0] - radii[1]) / (max(radii) + 0.01 * case.gap))
    for name in ("lift_off_fraction", "stuck_fraction", "wall_contact_fraction"):
        worst.append(abs(first[name] - second[name]))
    assert found["half_difference"][0] == pytest.approx(max(worst), rel=1e-5, abs=1e-6)


def test_peaks_are_counted_and_measured(window):
    """As many local maxima as the samples show, equal to 1e-7 of the motion's size."""
    _, expected, found = window
    state_scales = {
        "axial_peaks": expected.case.amplitude,
        "bit_speed_peaks": expected.case.speed,
        "radius_peaks": expected.case.gap,
    }
    for name, peaks in expected.peaks().items():
        mine = found[name][0]
        mine = mine[np.isfinite(mine)]
        assert len(mine) == min(len(peaks), 32), name
        assert mine == pytest.approx(peaks[-32:], abs=1e-6 * state_scales[name], rel=1e-6), name


def test_the_windows_show_all_responses():
    """So that the comparison above means something."""
    seen = {name: sample(c, s, t, o, STUCK_BELOW, 1e-3).features() for name, (c, s, t, o) in WINDOWS.items()}
    assert 0.1 < seen["bouncing"]["lift_off_fraction"] < 0.9
    assert 0.1 < seen["rubbing"]["wall_contact_fraction"] < 0.9
    assert 0.1 < seen["sticking"]["stuck_fraction"] < 0.95
    assert seen["smooth"]["lift_off_fraction"] == seen["smooth"]["wall_contact_fraction"] == 0
    assert seen["rolling"]["whirl_ratio"] < -1


def test_features_follow_the_tolerance():
    """At the default 1e-6 what is measured is good to a few parts in ten thousand, also
    in contact."""
    case, start, transient, observe = WINDOWS["rubbing"]
    fine, usual = (
        run_from(work_for(case, Simulation(transient, observe, rtol=rtol)), start[None]) for rtol in (1e-10, 1e-6)
    )
    for name in (
        "bit_force_max",
        "radius_max",
        "wall_force_max",
        "wall_contact_fraction",
        "bit_speed_max",
        "lateral_acceleration_rms",
        "surface_torque_mean",
    ):
        assert usual[name][0] == pytest.approx(fine[name][0], rel=1e-3), name


def test_bit_torque_is_found_where_the_bit_breaks_loose():
    """Steep friction: within one step the torque passes its top and falls. The error is
    that of the motion."""
    case = STICKING.but(bit_smoothing=500.0)
    out = run_from(work_for(case, Simulation(0.25, 1.5)), WOUND_UP[None])
    expected = sample(case, WOUND_UP, 0.25, 1.5, STUCK_BELOW, 2e-5).features()
    assert out["bit_torque_max"][0] == pytest.approx(expected["bit_torque_max"], rel=5e-6)


def test_ripples_of_the_error_are_no_peaks():
    """While the bit creeps, its speed has ripples of the size of the tolerance, which
    the true solution has not."""
    case = STICKING.but(bit_smoothing=500.0)
    out = run_from(work_for(case, Simulation(0.0, 6.0)), start_of(case)[None])
    expected = sample(case, start_of(case), 0.0, 6.0, STUCK_BELOW, 2e-5).peaks()["bit_speed_peaks"]
    found = out["bit_speed_peaks"][0]
    assert found[np.isfinite(found)] == pytest.approx(expected, rel=1e-4, abs=1e-6)


# A collar that swings freely: no mud, no eccentricity, no softening; an ellipse at the
# lateral frequency.
FREE = Case(
    eccentricity=0.0,
    torsional_damping=0.0,
    mud_drag=0.0,
    softening="none",
    amplitude=0.0,
    bit_static=0.0,
    bit_dynamic=0.0,
    zeta=0.0,
    wall_static=0.0,
    wall_dynamic=0.0,
)
RATE = float(np.sqrt(FREE.k_bend / FREE.m_l))


def ellipse(a: float, b: float, phase: float) -> np.ndarray:
    """The state on x = a cos(w t), y = b sin(w t) at w t = phase, b with the sign of
    the direction."""
    state = start_of(FREE)
    state[:4] = (a * np.cos(phase), -a * RATE * np.sin(phase), b * np.sin(phase), b * RATE * np.cos(phase))
    return state


@pytest.mark.parametrize("b", [0.03, 0.01, 1e-4, 1e-7, -0.02, -1e-4, -1e-7])
@pytest.mark.parametrize("phase", [0.3, 2.0, -2.5])
def test_whirl_is_the_unwrapped_angle_of_the_orbit(b, phase):
    """Also of a needle-thin ellipse, whose angle turns by half a turn within one
    step."""
    duration = 7.3
    out = run_from(work_for(FREE, Simulation(0.0, duration, rtol=1e-11)), ellipse(0.05, b, phase)[None])
    t = np.linspace(0, duration, 2_000_001)
    angle = np.unwrap(np.arctan2(b * np.sin(RATE * t + phase), 0.05 * np.cos(RATE * t + phase)))
    assert out["whirl_speed_mean"][0] == pytest.approx((angle[-1] - angle[0]) / duration, rel=1e-6)
    assert out["whirl_ratio"][0] == pytest.approx(out["whirl_speed_mean"][0] / FREE.speed, rel=1e-9)


@pytest.mark.parametrize("excess", [1e-4, 1e-6, 1e-8])
def test_a_wall_contact_shorter_than_a_step_is_seen(excess):
    """The collar swings ``excess`` of the gap into the wall: on it for a part 2
    acos(gap/A)/pi of the time.

    At 1e-8 that is 40 microseconds in steps of milliseconds. The wall's push over so
    short a time changes nothing yet.
    """
    a = FREE.gap * (1 + excess)
    # One swing to one side, not centred, as the mark in mid-window would cut a step at
    # the apex; a soft wall.
    case = FREE.but(wall_stiffness=1e3)
    duration = np.pi / RATE
    out = run_from(work_for(case, Simulation(0.0, duration, rtol=1e-12)), ellipse(a, 1e-3, -np.pi / 2 - 0.4)[None])
    expected = 2 * np.arccos(FREE.gap / a) / np.pi
    assert duration / out["steps"][0] > 3 * expected * duration or excess > 1e-5, "else the contact is no graze"
    assert out["wall_contact_fraction"][0] == pytest.approx(expected, rel=0.01)
    assert out["radius_max"][0] == pytest.approx(a, rel=excess * 0.02)
    # Past the wall the collar goes at the speed of the ellipse at the end of its long
    # axis.
    assert out["rolling_ratio"][0] == pytest.approx(-1e-3 * RATE / (case.speed * case.collar_radius), rel=1e-3)


def test_a_swing_that_misses_the_wall_by_a_hair_is_no_contact():
    out = run_from(work_for(FREE, Simulation(0.0, 20.0, rtol=1e-12)), ellipse(FREE.gap * (1 - 1e-8), 1e-3, 0.4)[None])
    assert out["wall_contact_fraction"][0] == 0
    assert out["radius_max"][0] == pytest.approx(FREE.gap * (1 - 1e-8), rel=1e-10)


def test_radius_peaks_of_an_ellipse_are_its_long_axis():
    """Two a turn, all equal."""
    out = run_from(work_for(FREE, Simulation(0.0, 10.0, rtol=1e-12)), ellipse(0.05, 0.02, 0.4)[None])
    peaks = out["radius_peaks"][0]
    peaks = peaks[np.isfinite(peaks)]
    assert len(peaks) == int((0.4 + RATE * 10.0) // np.pi)
    assert peaks == pytest.approx(np.full(len(peaks), 0.05), rel=1e-9)


def test_a_motion_that_repeats_itself_is_settled():
    """Circular forward whirl with the bit rising and falling three times a turn."""
    period = 2 * np.pi / SMOOTH.speed
    out = run_work(work_for(SMOOTH, Simulation(transient=1500.0, observe=20 * period, rtol=1e-8)))
    # The lateral swing of the start dies out as 1/t in mud: a thousandth is left.
    assert out["half_difference"][0] < 0.01
    assert out["settled"][0] == 1


def test_the_window_has_no_memory_of_the_transient():
    """Opening the window at the state that a first run has reached gives the same
    measures.

    Equal to the tolerance, not in bits: the second run chooses its first steps anew.
    """
    start = start_of(SMOOTH)
    whole = run_from(work_for(SMOOTH, Simulation(5.0, 4.0, rtol=1e-10)), start[None])
    before = run_from(work_for(SMOOTH, Simulation(2.0, 3.0, rtol=1e-10)), start[None])["final_state"]
    after = run_from(work_for(SMOOTH, Simulation(0.0, 4.0, rtol=1e-10)), before)
    for name in FEATURES:
        assert after[name][0] == pytest.approx(whole[name][0], rel=1e-6, abs=1e-8, nan_ok=True), name


def test_a_resting_string_measures_as_at_rest():
    """Flat rock without friction, no eccentricity, dead centre: nothing moves but the
    rotation."""
    start = start_of(FREE)
    start[0] = 0.0
    out = run_from(work_for(FREE, Simulation(1.0, 10.0, rtol=1e-11)), start[None])
    assert out["bit_speed_min"][0] == out["bit_speed_max"][0] == FREE.speed
    assert out["stick_slip_index"][0] == 0
    assert out["lift_off_fraction"][0] == out["wall_contact_fraction"][0] == out["stuck_fraction"][0] == 0
    assert out["radius_max"][0] == out["whirl_ratio"][0] == 0
    # Each step may err by rtol, and the axial motion forgets only in minutes.
    force = FREE.wob * FREE.rock_stiffness / (FREE.k_a + FREE.rock_stiffness)
    assert out["bit_force_max"][0] == pytest.approx(force, rel=1e-8)
    assert out["response"][0] == 0
    assert out["settled"][0] == 1


def test_bit_that_stands_on_the_threshold_counts_as_stuck():
    """Stuck is at or below the threshold: field practice counts the time below 5
    rpm."""
    start = start_of(FREE)
    case = FREE
    simulation = Simulation(0.0, 5.0)
    above = run_from(work_for(case, simulation, stuck_below=case.speed * (1 - 1e-9)), start[None])
    below = run_from(work_for(case, simulation, stuck_below=case.speed * (1 + 1e-9)), start[None])
    assert above["stuck_fraction"][0] == 0
    assert below["stuck_fraction"][0] == 1


def test_lanes_that_all_turn_in_the_same_step_measure_as_one_alone():
    """Twins: in each of their steps all or none have an event, so that the list of
    events fills within a step, of one quantity, and again within the same step."""
    window = Simulation(0.5, 3.0)
    alone = run_from(work_for(BOUNCING, window), start_of(BOUNCING)[None], lanes=1)
    twins = run_from(
        work_for(BOUNCING, window, depth=np.full(40, BOUNCING.depth)), np.tile(start_of(BOUNCING), (40, 1)), lanes=16
    )
    for name, values in twins.items():
        assert np.array_equal(values, np.repeat(alone[name], 40, axis=0), equal_nan=True), name


def test_grazes_are_added_up_in_each_lanes_own_order():
    """Coarse steps, so that many of them hold a whole contact: when such a graze comes
    to light depends on what happens in the other lanes, and its time must not be added
    now before, now after that of the next crossing."""
    work = work_for(
        RUBBING,
        Simulation(2.0, 10.0, rtol=1e-3),
        rotary_speed=np.linspace(2, 10, 60),
        depth=np.linspace(1000, 6000, 20),
    )
    one, many = run_work(work, lanes=1), run_work(work, lanes=16)
    for name, values in many.items():
        assert np.array_equal(values, one[name], equal_nan=True), name


def test_a_run_that_fails_leaves_no_events_to_the_next_one_in_its_lane():
    """One lane: what happened in the last steps of a run that ran out of steps is still
    in the lists when the next run's window opens, and must not be counted in it."""
    states = np.tile(start_of(BOUNCING), (2, 1))
    work = work_for(BOUNCING, Simulation(0.0, 3.0), depth=[1500.0, BOUNCING.depth])
    batch = work.new_batch(1, 2)
    for point, limit in ((1, 60), (0, 1e9)):
        batch.settings["limit"] = limit
        one = np.array([point])
        batch.add_many(one, replace(work.prepare(one), initial=states[one]))
    after = collect(work, finish(work, batch))
    alone = run_from(work_for(BOUNCING, Simulation(0.0, 3.0), depth=[1500.0]), states[:1], lanes=1)
    assert after["status"].tolist() == [OK, STEP_LIMIT]
    for name in FEATURES:
        np.testing.assert_array_equal(after[name][0], alone[name][0], err_msg=name)
