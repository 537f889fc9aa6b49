"""Motions whose answer is known in closed form: stick-slip, lift-off, whirl (theory
page, cases 2 to 4)."""

import math
from functools import lru_cache

import numpy as np
import pytest
from reference import Case
from scipy.optimize import brentq
from sweep.runs import run_from, run_work, work_for

from main_model.cases import operation_of, parameters_of
from nsdrill.app.simulating.trajectory import simulate
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.derived_quantities import lift_off_wob, wall_speed
from nsdrill.models.christoforou_yigit.parameters import Initial
from nsdrill.study import parse_study

# Case 2: no eccentricity, flat rock, no torsional damping, no cutting torque; only the
# torsional motion is left.
STICKING = Case(
    depth=2000.0, wob=60e3, speed=2.0, eccentricity=0.0, amplitude=0.0, torsional_damping=0.0, c1=0.0, c2=0.0
)


def coulomb_limit(c: Case, static: float, dynamic: float) -> dict[str, float]:
    """Peak speed, slip and stick time of the ideal stick-slip cycle with torques static
    and dynamic [N m]."""
    w = math.sqrt(c.k_t / c.J)
    a = (static - dynamic) / (c.J * w)
    return {
        "peak": c.speed + math.hypot(c.speed, a),
        "slip": 2 / w * (math.pi - math.atan(a / c.speed)),
        "stick": 2 * (static - dynamic) / (c.k_t * c.speed),
    }


@lru_cache
def stick_slip(smoothing: float) -> dict[str, float]:
    """Relative errors of the smoothed law's cycle against the Coulomb limit, with decay
    = smoothing^(1/3).

    The greatest friction is short of the static one by a part sqrt(decay / smoothing),
    that during slip exceeds the dynamic one by a part 1 / (decay x speed): with this
    decay both fall as smoothing^(-1/3).
    """
    c = STICKING.but(bit_smoothing=smoothing, bit_decay=smoothing ** (1 / 3))
    # at rest on the rock
    arm = 2 / 3 * c.bit_radius * c.wob * c.rock_stiffness / (c.k_a + c.rock_stiffness)
    ideal = coulomb_limit(c, arm * c.bit_static, arm * c.bit_dynamic)
    twist = -arm * 0.5 / c.k_t
    work = work_for(
        c, Simulation(transient=20.0, observe=12.0, rtol=1e-8), initial=Initial(x=0.0, twist=twist, bit_speed=4.0)
    )
    out = run_work(work)
    peaks = out["bit_speed_peaks"][0]
    peaks = peaks[np.isfinite(peaks)]
    assert np.ptp(peaks) < 1e-6 * c.speed, "the cycle is to be periodic"
    study = parse_study(f"""
operation: {{depth: 2000 m, wob: 60 kN, rotary_speed: 2 rad/s}}
drillstring: {{eccentricity: 0 mm, torsional_damping: 0 N*m*s/rad}}
bit:
  surface_amplitude: 0 mm
  cutting: {{c1: 0, c2: 0}}
  friction: {{smoothing: {c.bit_smoothing} s/rad, decay: {c.bit_decay} s/rad}}
initial: {{x: 0 mm, twist: {twist} rad, bit_speed: 4 rad/s}}
sweep: {{depth: [2000 m]}}
simulation: {{rtol: 1e-8}}
""")
    trace = simulate(study, duration=32.0, sample=1e-3).trace
    speed, t, level = trace["bit_speed"], trace.time, 0.01 * c.speed
    rises = t[np.flatnonzero((speed[:-1] <= level) & (speed[1:] > level))]
    falls = t[np.flatnonzero((speed[:-1] > level) & (speed[1:] <= level))]
    start, end = rises[-2], rises[-1]
    slip = falls[(falls > start) & (falls < end)][0] - start
    return {
        "peak": out["bit_speed_max"][0] / ideal["peak"] - 1,
        "slip": slip / ideal["slip"] - 1,
        "stick": (end - start - slip) / ideal["stick"] - 1,
        "twice": out["bit_speed_max"][0] / (2 * c.speed),
    }


@pytest.mark.parametrize("quantity", ["peak", "slip", "stick"])
def test_stick_slip_tends_to_the_coulomb_cycle(quantity):
    """Peak Omega + sqrt(Omega^2 + A^2), slip (2/w)(pi - atan(A/Omega)), stick 2 (T_s -
    T_d)/(k_t Omega).

    The error falls as smoothing^(-1/3): by 2.15 for each factor of ten (at least 1.8
    here: higher orders are left).
    """
    errors = [abs(stick_slip(smoothing)[quantity]) for smoothing in (1e3, 1e4, 1e5)]
    assert errors[0] > 1.8 * errors[1] > 1.8**2 * errors[2]
    # The limit, by extrapolation of the two finest: at smoothing^(-1/3) = 0 nothing is
    # left but the next order.
    signed = [stick_slip(smoothing)[quantity] for smoothing in (1e4, 1e5)]
    ratio = 10 ** (1 / 3)
    assert abs((ratio * signed[1] - signed[0]) / (ratio - 1)) < 0.01


def test_a_sticking_bit_speeds_up_to_more_than_twice_the_drive_speed():
    """The peak is at least 2 Omega whatever the friction: A >= 0 in the formula."""
    for smoothing in (1e3, 1e4, 1e5):
        assert stick_slip(smoothing)["twice"] >= 1


# Case 3: no friction at the bit, so it turns evenly over the lobes; no eccentricity.
EVEN = Case(eccentricity=0.0, bit_static=0.0, bit_dynamic=0.0, zeta=0.0, torsional_damping=0.0)


def lift_off_limit(c: Case) -> float:
    """W below which linear steady contact is lost: the mean penetration W/K is less
    than the swing |s0 - Z|."""
    w = c.lobes * c.speed
    both = c.k_a + c.rock_stiffness
    swing = c.rock_stiffness * c.amplitude / complex(both - c.m_a * w * w, c.axial_damping * w)
    return both * abs(c.amplitude - swing)


def on_linear_solution(c: Case) -> np.ndarray:
    """The state of the steady linear motion over the lobes at drive angle zero."""
    w = c.lobes * c.speed
    both = c.k_a + c.rock_stiffness
    swing = c.rock_stiffness * c.amplitude / complex(both - c.m_a * w * w, c.axial_damping * w)
    return np.array([0, 0, 0, 0, -c.wob / both + swing.imag, w * swing.real, 0, c.speed, 0])


@pytest.mark.parametrize(
    ("depth", "speed", "lobes"), [(2000, 3, 3), (5000, 3, 3), (5000, 5, 1), (8000, 2.6, 3), (900, 6, 3)]
)
def test_bit_leaves_the_rock_below_the_linear_limit_and_not_above(depth, speed, lobes):
    """To one part in a million of the weight: what the bit does in a single step
    suffices to see it leave."""
    c = EVEN.but(depth=float(depth), speed=float(speed), lobes=lobes)
    limit = lift_off_limit(c)
    around = limit * (1 + np.array([-1e-2, -1e-4, -1e-6, 1e-6, 1e-4, 1e-2]))
    starts = np.array([on_linear_solution(c.but(wob=w)) for w in around])
    work = work_for(c, Simulation(transient=1.0, observe=30.0, rtol=1e-10), wob=around)
    out = run_from(work, starts)["lift_off_fraction"]
    assert np.all(out[:3] > 0)
    assert np.array_equal(out[3:], np.zeros(3))


def test_time_off_the_rock_just_below_the_limit():
    """A fraction acos(W/W_limit)/pi of the first turns, before the missing force is
    felt, order (1 - W/W_l)^1.5.

    Weak damping: several turns of lobe passage at 1e-6 below the limit, each off for
    some milliseconds.
    """
    c = EVEN.but(depth=5000.0)
    limit = lift_off_limit(c)
    weights = limit * (1 - np.array([1e-5, 1e-6, 1e-7]))
    starts = np.array([on_linear_solution(c.but(wob=w)) for w in weights])
    window = 4 * 2 * np.pi / (c.lobes * c.speed)  # four lobes
    out = run_from(work_for(c, Simulation(transient=0.0, observe=window, rtol=1e-10), wob=weights), starts)
    expected = np.arccos(weights / limit) / np.pi
    assert out["lift_off_fraction"] == pytest.approx(expected, rel=0.02)


def test_the_figure_of_the_check_is_this_limit():
    for depth, speed in ((2000.0, 3.0), (5000.0, 7.0)):
        c = Case(depth=depth, speed=speed)
        k = derive(parameters_of(c), depth, c.wob, speed)
        assert lift_off_wob(parameters_of(c), operation_of(c), k) == pytest.approx(lift_off_limit(c), rel=1e-12)


# Case 4: flat rock without friction; the mass offset drives a circular orbit that drag
# limits.
ORBIT = EVEN.but(amplitude=0.0, eccentricity=0.0127, torsional_damping=50.0)


def orbit(c: Case) -> tuple[float, np.ndarray]:
    """Radius of synchronous whirl and a state on it: (k - m W^2 + i c_h W^2 r) R = m_e
    e0 W^2, |R| = r."""
    force = c.wob * c.rock_stiffness / (c.k_a + c.rock_stiffness)
    axial = {"live": force, "static": c.wob, "none": 0.0}[c.softening]
    k = c.k_bend - axial * math.pi**2 / (2 * c.span)
    unbalance = c.m_e * c.eccentricity * c.speed**2

    def excess(r: float) -> float:
        return math.hypot((k - c.m_l * c.speed**2) * r, c.c_h * c.speed**2 * r**2) - unbalance

    r = brentq(excess, 0.0, 1.0, xtol=1e-15, rtol=1e-14)
    # The drag's work is the top drive's: k_t psi = -c_h (W r)^3 / W - c_t W.
    twist = -(c.c_h * (c.speed * r) ** 3 / c.speed + c.torsional_damping * c.speed) / c.k_t
    lag = unbalance / complex(k - c.m_l * c.speed**2, c.c_h * c.speed**2 * r)
    place = lag * complex(math.cos(twist), math.sin(twist))
    state = [
        place.real,
        -c.speed * place.imag,
        place.imag,
        c.speed * place.real,
        -force / c.rock_stiffness,
        0,
        twist,
        c.speed,
        0,
    ]
    return r, np.array(state)


@pytest.mark.parametrize("softening", ["live", "static", "none"])
@pytest.mark.parametrize("eccentric_mass", ["total", "steel"])
def test_forward_synchronous_whirl_has_the_drag_limited_radius(softening, eccentric_mass):
    """Started on the orbit, the collar stays there: radius to 1e-8, whirl at the speed
    of rotation, no wall."""
    speeds = np.array([0.5, 1, 2, 3, 4, 4.5, 5, 9])
    c = ORBIT.but(softening=softening, eccentric_mass=eccentric_mass)
    known = [orbit(c.but(speed=float(s))) for s in speeds]
    radii = np.array([r for r, _ in known])
    inside = radii < c.gap
    assert np.count_nonzero(inside) >= 5
    work = work_for(c, Simulation(transient=10.0, observe=200.0, rtol=1e-11), rotary_speed=speeds[inside])
    out = run_from(work, np.array([s for _, s in known])[inside])
    assert out["radius_mean"] == pytest.approx(radii[inside], rel=1e-8)
    assert out["radius_max"] == pytest.approx(radii[inside], rel=1e-7)
    assert out["whirl_ratio"] == pytest.approx(np.ones(np.count_nonzero(inside)), rel=1e-8)
    assert not out["wall_contact_fraction"].any()
    assert out["bit_speed_mean"] == pytest.approx(speeds[inside], rel=1e-9)
    # The lateral acceleration of a circular orbit is W^2 r.
    assert out["lateral_acceleration_rms"] == pytest.approx(speeds[inside] ** 2 * radii[inside], rel=1e-7)


def test_any_start_ends_on_the_orbit():
    """The orbit attracts: from rest near the centre, the drag brings the collar to
    it."""
    c = ORBIT.but(speed=3.5, softening="none")
    out = run_work(work_for(c, Simulation(transient=4000.0, observe=100.0, rtol=1e-9)))
    r, _ = orbit(c)
    # Drag damps like 1/t without end: a perturbation obeys its linearisation at rate
    # c_h W r / m_l
    left = math.exp(-c.c_h * c.speed * r / (2 * c.m_l) * 4000.0)
    assert out["radius_mean"][0] == pytest.approx(r, rel=1e-6 + left)
    assert out["whirl_ratio"][0] == pytest.approx(1, abs=1e-6 + left)


def test_wall_speed_is_where_the_orbit_fills_the_gap():
    c = ORBIT.but(softening="none")
    k = derive(parameters_of(c), c.depth, c.wob, c.speed)
    limit = wall_speed(parameters_of(c), operation_of(c), k)
    assert orbit(c.but(speed=limit))[0] == pytest.approx(c.gap, rel=1e-9)
    assert orbit(c.but(speed=limit * 0.99))[0] < c.gap < orbit(c.but(speed=limit * 1.01))[0]
