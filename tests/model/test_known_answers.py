"""Motions whose answer is known in closed form: stick-slip, lift-off, whirl (theory page, cases 2 to 4)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from model.cases import parameters_of
from reference import Case
from scipy.optimize import brentq
from sweep.runs import run_from, run_work, work_for

from nsdrill.kernel.settings import Simulation
from nsdrill.model.figures import lift_off_wob, wall_speed
from nsdrill.model.coefficients import derive
from nsdrill.model.parameters import Initial, Operation

# Case 2: no eccentricity, flat rock, no torsional damping, no cutting torque; only the torsional motion is left.
STICKING = Case(
    depth=2000.0, wob=60e3, speed=2.0, eccentricity=0.0, amplitude=0.0, torsional_damping=0.0, c1=0.0, c2=0.0)


def coulomb_limit(c: Case, static: float, dynamic: float) -> dict[str, float]:
    """Peak speed, slip and stick time of the ideal stick-slip cycle with torques static and dynamic [N m]."""
    w = math.sqrt(c.k_t / c.J)
    a = (static - dynamic) / (c.J * w)
    return {
        "peak": c.speed + math.hypot(c.speed, a),
        "slip": 2 / w * (math.pi - math.atan(a / c.speed)),
        "stick": 2 * (static - dynamic) / (c.k_t * c.speed),
    }


def stick_slip(smoothing: float) -> dict[str, float]:
    """Relative errors of the smoothed law's cycle against the Coulomb limit, with decay = smoothing^(1/3).

    Below smoothing x speed of order one nothing sticks, above decay x speed of order one friction is dynamic: the static
    peak is short by a part sqrt(decay / smoothing), dynamic friction too large by a part 1 / decay. So both go as
    smoothing^(-1/3).
    """
    c = STICKING.but(bit_smoothing=smoothing, bit_decay=smoothing ** (1 / 3))
    force = c.wob * c.rock_stiffness / (c.k_a + c.rock_stiffness)  # at rest on the rock
    arm = 2 / 3 * c.bit_radius * force
    # The static position but for the twist: wound up as in the middle of a slip.
    start = Initial(x=0.0, twist=-arm * 0.5 / c.k_t, bit_speed=4.0)
    threshold = 0.01 * c.speed
    window = 60.0
    out = run_work(work_for(
        c, Simulation(transient=60.0, observe=window, rtol=1e-8), initial=start, stuck_below=threshold), lanes=1)
    peaks = out["bit_speed_peaks"][0]
    assert np.ptp(peaks[np.isfinite(peaks)]) < 1e-5 * c.speed, "the cycle is to be periodic"
    ideal = coulomb_limit(c, arm * c.bit_static, arm * c.bit_dynamic)
    assert out["bit_speed_max"][0] >= 2 * c.speed
    # The window holds no whole number of cycles: the period comes from the number of cycles in a long window.
    return {"peak": out["bit_speed_max"][0] / ideal["peak"] - 1, "ideal": ideal, "out": out, "case": c}


def times(smoothing: float) -> tuple[float, float, dict[str, float]]:
    """Slip and stick time of one cycle, from a trace of the settled motion; and the ideal ones."""
    import nsdrill
    from nsdrill.study import parse_study

    c = STICKING.but(bit_smoothing=smoothing, bit_decay=smoothing ** (1 / 3))
    arm = 2 / 3 * c.bit_radius * c.wob * c.rock_stiffness / (c.k_a + c.rock_stiffness)
    study = parse_study(f"""
operation: {{depth: 2000 m, wob: 60 kN, rotary_speed: 2 rad/s}}
drillstring: {{eccentricity: 0 mm, torsional_damping: 0 N*m*s/rad}}
bit:
  surface_amplitude: 0 mm
  cutting: {{c1: 0, c2: 0}}
  friction: {{smoothing: {c.bit_smoothing} s/rad, decay: {c.bit_decay} s/rad}}
initial: {{x: 0 mm, twist: {-arm * 0.5 / c.k_t} rad, bit_speed: 4 rad/s}}
sweep: {{depth: [2000 m]}}
simulation: {{rtol: 1e-8}}
""")
    trace = nsdrill.simulate(study, duration=60.0, sample=1e-3).trace
    speed, t = trace["bit_speed"], trace.time
    level = 0.01 * c.speed
    rises = t[np.flatnonzero((speed[:-1] <= level) & (speed[1:] > level))]
    falls = t[np.flatnonzero((speed[:-1] > level) & (speed[1:] <= level))]
    start, end = rises[-2], rises[-1]
    slip = falls[(falls > start) & (falls < end)][0] - start
    return slip, end - start - slip, coulomb_limit(c, arm * c.bit_static, arm * c.bit_dynamic)


def test_stick_slip_tends_to_the_coulomb_cycle() -> None:
    """Peak speed Omega + sqrt(Omega^2 + A^2), slip and stick times: errors fall as smoothing^(-1/3)."""
    errors = {}
    for smoothing in (1e3, 1e4, 1e5):
        peak = stick_slip(smoothing)["peak"]
        slip, stick, ideal = times(smoothing)
        errors[smoothing] = np.abs([peak, slip / ideal["slip"] - 1, stick / ideal["stick"] - 1])
        print(smoothing, errors[smoothing], ideal)
    assert np.all(errors[1e4] < 0.65 * errors[1e3])
    assert np.all(errors[1e5] < 0.65 * errors[1e4])
