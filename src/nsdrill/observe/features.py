"""What is measured while a run is integrated, in constant memory and on the continuous solution.

Every packed step is examined in all lanes at once: sums, extremes at the step's ends, and flags for what happens inside
the step: a quantity turns (its slope changes sign) or crosses a level. Turns are then located in packed form, one
quantity at a time and only when some lane has one; crossings, which are rarer, lane by lane.

The observed window has two halves, measured separately, so that their agreement tells whether the run has settled.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, CLOSES, OPENS, Rows, compiled, inlined
from nsdrill.model.friction import TWO_OVER_PI
from nsdrill.model.rhs import AUX, LOBE_COSINE, LOBE_SINE, PARAMETERS, STATES
from nsdrill.observe.interpolant import cubic, derivative, extreme, quintic, share_above, value

# Quantities at an end of a step that are not states: interference u of bit and rock with its rates, bit torque and rate,
# squared radius with its rates, radius, whirl velocity (tangential).
ENDS = ("u", "du", "ddu", "torque", "dtorque", "rho", "drho", "ddrho", "radius", "whirl_velocity")
# Measured in each half. Extremes first, then sums over time, then anchors at the half's start.
EXTREMES = ("z_min", "z_max", "speed_min", "speed_max", "twist_min", "twist_max", "u_max", "torque_max", "rho_max")
SUMS = ("on_rock", "unstuck", "on_wall", "radius_sum", "twist_sum", "lateral_square", "axial_square", "half_turns",
        "rolled", "turned")  # fmt: skip
ANCHORS = ("twist_start", "angle_start")
HALF = EXTREMES + SUMS + ANCHORS
# Turns of each quantity: +1 a maximum, -1 a minimum inside the step, 0 none; and whether a level was crossed.
TURNS = ("turn_z", "turn_speed", "turn_twist", "turn_u", "turn_torque", "turn_rho")
CROSSINGS = ("cross_rock", "cross_stuck", "cross_wall")
PEAK_OF = ("turn_z", "turn_speed", "turn_rho")
OBSERVED = (
    tuple(f"{name}_before" for name in ENDS) + tuple(f"{name}_now" for name in ENDS) + HALF + TURNS + CROSSINGS
    + ("found",)
)  # fmt: skip
# What a half leaves in the outbox: the sums so far, its length and the state of the slow angles at its end.
HALF_REPORT = (*HALF, "twist_end", "angle_end")


def report_width(peaks: int) -> int:
    """Columns that the observer fills in the outbox: two halves, then count and ring of the peaks of z, speed, r."""
    return 2 * len(HALF_REPORT) + 3 * (peaks + 1)


def store_size(lanes: int, peaks: int) -> int:
    """Floats in the observer's store: peaks first, then a count and a ring for each lane and quantity."""
    return 1 + lanes * 3 * (peaks + 1)


@inlined
def half_plane_angle(x, y):  # type: ignore[no-untyped-def]
    """The whirl angle within its half plane, from 0 to pi; whole half turns are counted apart."""
    angle = math.atan2(y, x)
    return angle + math.pi if y < 0.0 else angle


@inlined
def turn(before, now, seen):  # type: ignore[no-untyped-def]
    """+1.0 where a slope passes from rising to falling, -1.0 from falling to rising, 0.0 elsewhere or unseen."""
    sign = 1.0 if (before > 0.0 and now <= 0.0) else (-1.0 if (before < 0.0 and now >= 0.0) else 0.0)
    return sign if seen else 0.0


@inlined
def keep_peaks(b, store, lanes, turn_, found_, which):  # type: ignore[no-untyped-def]
    """Put this step's maxima into the rings of the lanes that have one."""
    peaks = int(store[0])
    if peaks > 0:
        for i in range(lanes):
            if b[turn_ + i] > 0.0:
                ring = 1 + (3 * i + which) * (peaks + 1)
                count = int(store[ring])
                store[ring + 1 + count % peaks] = b[found_ + i]
                store[ring] = count + 1


@lru_cache
def make_observer(lanes: int) -> tuple[Any, Any]:
    """The compiled (observer, marker) for a number of lanes."""
    rows = Rows(len(STATES), len(AUX), len(PARAMETERS), len(OBSERVED))
    W = lanes
    x0_, vx0_, y0_, vy0_, z0_, vz0_, twist0_, speed0_ = (W * (rows.start + i) for i in range(8))
    _, ax0_, _, ay0_, _, az0_, dtwist0_, alpha0_ = (W * (rows.start_slope + i) for i in range(8))
    x1_, vx1_, y1_, vy1_, z1_, vz1_, twist1_, speed1_ = (W * (rows.stage + i) for i in range(8))
    _, ax1_, _, ay1_, _, az1_, dtwist1_, alpha1_ = (W * (rows.slope + i) for i in range(8))
    cosine_, sine_, arm_ = (W * (rows.aux_now + i) for i in range(3))
    h_, moves_, window_ = W * rows.step, W * rows.moves, W * rows.window
    P = {name: W * (rows.parameter + i) for i, name in enumerate(PARAMETERS)}
    O = {name: W * (rows.observer + i) for i, name in enumerate(OBSERVED)}
    gap_, k_c_, s0_, lobes_ = P["gap"], P["rock_stiffness"], P["surface_amplitude"], P["lobes"]
    eps_, tau_, rise_, mu_ = P["bit_smoothing"], P["bit_decay"], P["bit_rise"], P["bit_dynamic"]
    stuck_, drive_ = P["stuck_below"], P["drive_speed"]
    lobe_sine_, lobe_cosine_ = P[LOBE_SINE[0]], P[LOBE_COSINE[0]]
    before_, now_ = O["u_before"], O["u_now"]
    u0_, du0_, ddu0_, T0_, dT0_, rho0_, drho0_, ddrho0_, r0_, vt0_ = (before_ + W * i for i in range(len(ENDS)))
    u1_, du1_, ddu1_, T1_, dT1_, rho1_, drho1_, ddrho1_, r1_, vt1_ = (now_ + W * i for i in range(len(ENDS)))
    z_min_, z_max_, speed_min_, speed_max_, twist_min_, twist_max_, u_max_, torque_max_, rho_max_ = (
        O[name] for name in EXTREMES)
    on_rock_, unstuck_, on_wall_, radius_, twist_sum_, lateral_, axial_, turns_, rolled_, turned_ = (
        O[name] for name in SUMS)
    twist_start_, angle_start_ = (O[name] for name in ANCHORS)
    turn_z_, turn_speed_, turn_twist_, turn_u_, turn_torque_, turn_rho_ = (O[name] for name in TURNS)
    cross_rock_, cross_stuck_, cross_wall_ = (O[name] for name in CROSSINGS)
    found_ = O["found"]
    half_, half_count, ends_count = O[HALF[0]], len(HALF), len(ENDS)
    half_report = len(HALF_REPORT)

    @compiled(types.void(BUFFER, BUFFER), W)
    def observer(b, store):  # type: ignore[no-untyped-def]
        any_z = any_speed = any_twist = any_u = any_torque = any_rho = any_crossing = 0
        for i in range(W):
            # The quantities at the end of the step, from the stage, slope and aux rows.
            x, vx, ax = b[x1_ + i], b[vx1_ + i], b[ax1_ + i]
            y, vy, ay = b[y1_ + i], b[vy1_ + i], b[ay1_ + i]
            omega, alpha = b[speed1_ + i], b[alpha1_ + i]
            c, s = b[cosine_ + i], b[sine_ + i]
            sine = b[lobe_sine_ + 7 * W + i]
            cosine = b[lobe_cosine_ + 8 * W + i] * c + b[lobe_cosine_ + 7 * W + i]
            for k in range(6, -1, -1):
                sine = b[lobe_sine_ + k * W + i] + c * sine
                cosine = b[lobe_cosine_ + k * W + i] + c * cosine
            sine = s * sine
            amplitude, lobes = b[s0_ + i], b[lobes_ + i]
            u = amplitude * sine - b[z1_ + i]
            du = amplitude * lobes * omega * cosine - b[vz1_ + i]
            b[u1_ + i] = u
            b[du1_ + i] = du
            b[ddu1_ + i] = amplitude * lobes * (alpha * cosine - lobes * omega * omega * sine) - b[az1_ + i]
            # The bit torque is force times arm; the arm g(omega) m(omega) changes with the bit speed.
            force = b[k_c_ + i] * max(u, 0.0)
            dforce = b[k_c_ + i] * du if u > 0.0 else 0.0
            below = 1.0 / (1.0 + b[tau_ + i] * abs(omega))
            m = b[rise_ + i] * below + b[mu_ + i]
            dm = b[rise_ + i] * b[tau_ + i] * below * below
            dm = dm if omega < 0.0 else -dm
            scaled = b[eps_ + i] * omega
            dg = TWO_OVER_PI * b[eps_ + i] / (1.0 + scaled * scaled)
            arm = b[arm_ + i]
            darm = (dg * m + (arm / m if m > 0.0 else 0.0) * dm) * alpha
            b[T1_ + i] = force * arm
            b[dT1_ + i] = dforce * arm + force * darm
            rho = x * x + y * y
            r = np.sqrt(rho)
            b[rho1_ + i] = rho
            b[drho1_ + i] = 2.0 * (x * vx + y * vy)
            b[ddrho1_ + i] = 2.0 * (vx * vx + vy * vy + x * ax + y * ay)
            b[r1_ + i] = r
            b[vt1_ + i] = (x * vy - y * vx) / max(r, 1e-30)
        for i in range(W):
            seen = b[moves_ + i] * b[window_ + i] != 0.0
            h = b[h_ + i]
            x0, y0, x1, y1 = b[x0_ + i], b[y0_ + i], b[x1_ + i], b[y1_ + i]
            vx0, vy0, vx1, vy1 = b[vx0_ + i], b[vy0_ + i], b[vx1_ + i], b[vy1_ + i]
            ax0, ay0, ax1, ay1 = b[ax0_ + i], b[ay0_ + i], b[ax1_ + i], b[ay1_ + i]
            z1, az0, az1 = b[z1_ + i], b[az0_ + i], b[az1_ + i]
            twist0, twist1, omega0, omega1 = b[twist0_ + i], b[twist1_ + i], b[speed0_ + i], b[speed1_ + i]
            u0, u1, rho0, rho1, r0, r1 = b[u0_ + i], b[u1_ + i], b[rho0_ + i], b[rho1_ + i], b[r0_ + i], b[r1_ + i]

            b[z_min_ + i] = min(b[z_min_ + i], z1) if seen else b[z_min_ + i]
            b[z_max_ + i] = max(b[z_max_ + i], z1) if seen else b[z_max_ + i]
            b[speed_min_ + i] = min(b[speed_min_ + i], omega1) if seen else b[speed_min_ + i]
            b[speed_max_ + i] = max(b[speed_max_ + i], omega1) if seen else b[speed_max_ + i]
            b[twist_min_ + i] = min(b[twist_min_ + i], twist1) if seen else b[twist_min_ + i]
            b[twist_max_ + i] = max(b[twist_max_ + i], twist1) if seen else b[twist_max_ + i]
            b[u_max_ + i] = max(b[u_max_ + i], u1) if seen else b[u_max_ + i]
            b[torque_max_ + i] = max(b[torque_max_ + i], b[T1_ + i]) if seen else b[torque_max_ + i]
            b[rho_max_ + i] = max(b[rho_max_ + i], rho1) if seen else b[rho_max_ + i]

            t = turn(b[vz0_ + i], b[vz1_ + i], seen)
            b[turn_z_ + i] = t
            any_z |= 0 if t == 0.0 else 1
            t = turn(b[alpha0_ + i], b[alpha1_ + i], seen)
            b[turn_speed_ + i] = t
            any_speed |= 0 if t == 0.0 else 1
            t = turn(b[dtwist0_ + i], b[dtwist1_ + i], seen)
            b[turn_twist_ + i] = t
            any_twist |= 0 if t == 0.0 else 1
            t = turn(b[du0_ + i], b[du1_ + i], seen)
            b[turn_u_ + i] = t
            any_u |= 0 if t == 0.0 else 1
            t = turn(b[dT0_ + i], b[dT1_ + i], seen)
            b[turn_torque_ + i] = t
            any_torque |= 0 if t == 0.0 else 1
            t = turn(b[drho0_ + i], b[drho1_ + i], seen)
            b[turn_rho_ + i] = t
            any_rho |= 0 if t == 0.0 else 1

            # Time on each side of a level: whole steps here, steps with a crossing lane by lane below.
            shown = h if seen else 0.0
            level = b[gap_ + i] * b[gap_ + i]
            rock0, rock1 = u0 > 0.0, u1 > 0.0
            free0, free1 = omega0 > b[stuck_ + i], omega1 > b[stuck_ + i]
            wall0, wall1 = rho0 > level, rho1 > level
            b[on_rock_ + i] += shown if (rock0 and rock1) else 0.0
            b[unstuck_ + i] += shown if (free0 and free1) else 0.0
            b[on_wall_ + i] += shown if (wall0 and wall1) else 0.0
            crosses = (1.0 if rock0 != rock1 else 0.0) if seen else 0.0
            b[cross_rock_ + i] = crosses
            any_crossing |= 0 if crosses == 0.0 else 1
            crosses = (1.0 if free0 != free1 else 0.0) if seen else 0.0
            b[cross_stuck_ + i] = crosses
            any_crossing |= 0 if crosses == 0.0 else 1
            crosses = (1.0 if wall0 != wall1 else 0.0) if seen else 0.0
            b[cross_wall_ + i] = crosses
            any_crossing |= 0 if crosses == 0.0 else 1

            # Integrals over the step: Simpson's rule with the middle from the interpolant; exact for the twist's.
            xm = 0.5 * (x0 + x1) + h * (0.15625 * (vx0 - vx1) + h * 0.015625 * (ax0 + ax1))
            ym = 0.5 * (y0 + y1) + h * (0.15625 * (vy0 - vy1) + h * 0.015625 * (ay0 + ay1))
            b[radius_ + i] += shown * (r0 + 4.0 * np.sqrt(xm * xm + ym * ym) + r1) * (1.0 / 6.0)
            b[twist_sum_ + i] += shown * (
                0.5 * (twist0 + twist1)
                + h * (0.1 * (omega0 - omega1) + h * (1.0 / 120.0) * (b[alpha0_ + i] + b[alpha1_ + i])))
            per_h = 1.0 / h if h > 0.0 else 0.0
            axm = 1.5 * (vx1 - vx0) * per_h - 0.25 * (ax0 + ax1)
            aym = 1.5 * (vy1 - vy0) * per_h - 0.25 * (ay0 + ay1)
            azm = 1.5 * (b[vz1_ + i] - b[vz0_ + i]) * per_h - 0.25 * (az0 + az1)
            b[lateral_ + i] += shown * (1.0 / 6.0) * (
                ax0 * ax0 + ay0 * ay0 + 4.0 * (axm * axm + aym * aym) + ax1 * ax1 + ay1 * ay1)
            b[axial_ + i] += shown * (1.0 / 6.0) * (az0 * az0 + 4.0 * azm * azm + az1 * az1)

            # Whirl: half turns counted as the orbit passes from one half plane to the other.
            passes = (1.0 if x0 * y1 - y0 * x1 > 0.0 else -1.0) if (y0 < 0.0) != (y1 < 0.0) else 0.0
            b[turns_ + i] += passes if seen else 0.0
            weight0 = 0.5 * shown if wall0 else 0.0
            weight1 = 0.5 * shown if wall1 else 0.0
            b[rolled_ + i] += weight0 * b[vt0_ + i] + weight1 * b[vt1_ + i]
            b[turned_ + i] += weight0 * omega0 + weight1 * omega1

        if any_z:
            for i in range(W):
                h = b[h_ + i]
                p0, p1, p2, p3, p4, p5 = quintic(
                    b[z0_ + i], h * b[vz0_ + i], h * h * b[az0_ + i], b[z1_ + i], h * b[vz1_ + i], h * h * b[az1_ + i])
                found = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * b[vz1_ + i]))
                t = b[turn_z_ + i]
                b[z_max_ + i] = max(b[z_max_ + i], found) if t > 0.0 else b[z_max_ + i]
                b[z_min_ + i] = min(b[z_min_ + i], found) if t < 0.0 else b[z_min_ + i]
                b[found_ + i] = found
            keep_peaks(b, store, W, turn_z_, found_, 0)
        if any_speed:
            for i in range(W):
                h = b[h_ + i]
                _, p1, p2, p3, p4, p5 = quintic(
                    b[twist0_ + i], h * b[dtwist0_ + i], h * h * b[alpha0_ + i],
                    b[twist1_ + i], h * b[dtwist1_ + i], h * h * b[alpha1_ + i])
                q0, q1, q2, q3, q4, q5 = derivative(p1, p2, p3, p4, p5)
                top = value(q0, q1, q2, q3, q4, q5, extreme(q1, q2, q3, q4, q5, h * h * b[alpha1_ + i]))
                found = top / h + b[drive_ + i]
                t = b[turn_speed_ + i]
                b[speed_max_ + i] = max(b[speed_max_ + i], found) if t > 0.0 else b[speed_max_ + i]
                b[speed_min_ + i] = min(b[speed_min_ + i], found) if t < 0.0 else b[speed_min_ + i]
                b[found_ + i] = found
            keep_peaks(b, store, W, turn_speed_, found_, 1)
        if any_twist:
            for i in range(W):
                h = b[h_ + i]
                p0, p1, p2, p3, p4, p5 = quintic(
                    b[twist0_ + i], h * b[dtwist0_ + i], h * h * b[alpha0_ + i],
                    b[twist1_ + i], h * b[dtwist1_ + i], h * h * b[alpha1_ + i])
                found = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * b[dtwist1_ + i]))
                t = b[turn_twist_ + i]
                b[twist_max_ + i] = max(b[twist_max_ + i], found) if t > 0.0 else b[twist_max_ + i]
                b[twist_min_ + i] = min(b[twist_min_ + i], found) if t < 0.0 else b[twist_min_ + i]
        if any_u:
            grazes = 0
            for i in range(W):
                h = b[h_ + i]
                p0, p1, p2, p3, p4, p5 = quintic(
                    b[u0_ + i], h * b[du0_ + i], h * h * b[ddu0_ + i],
                    b[u1_ + i], h * b[du1_ + i], h * h * b[ddu1_ + i])
                found = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * b[du1_ + i]))
                t = b[turn_u_ + i]
                b[u_max_ + i] = max(b[u_max_ + i], found) if t > 0.0 else b[u_max_ + i]
                # A graze: both ends on one side of the surface, the turn on the other.
                grazing = t != 0.0 and (p0 > 0.0) == (b[u1_ + i] > 0.0) and (p0 > 0.0) != (found > 0.0)
                b[cross_rock_ + i] = 2.0 if grazing else b[cross_rock_ + i]
                grazes |= 1 if grazing else 0
            any_crossing |= grazes
        if any_torque:
            for i in range(W):
                h = b[h_ + i]
                p0, p1, p2, p3, p4, p5 = cubic(b[T0_ + i], h * b[dT0_ + i], b[T1_ + i], h * b[dT1_ + i])
                found = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * b[dT1_ + i]))
                t = b[turn_torque_ + i]
                b[torque_max_ + i] = max(b[torque_max_ + i], found) if t > 0.0 else b[torque_max_ + i]
        if any_rho:
            grazes = 0
            for i in range(W):
                h = b[h_ + i]
                p0, p1, p2, p3, p4, p5 = quintic(
                    b[rho0_ + i], h * b[drho0_ + i], h * h * b[ddrho0_ + i],
                    b[rho1_ + i], h * b[drho1_ + i], h * h * b[ddrho1_ + i])
                found = value(p0, p1, p2, p3, p4, p5, extreme(p1, p2, p3, p4, p5, h * b[drho1_ + i]))
                t = b[turn_rho_ + i]
                b[rho_max_ + i] = max(b[rho_max_ + i], found) if t > 0.0 else b[rho_max_ + i]
                level = b[gap_ + i] * b[gap_ + i]
                grazing = t != 0.0 and (p0 > level) == (b[rho1_ + i] > level) and (p0 > level) != (found > level)
                b[cross_wall_ + i] = 2.0 if grazing else b[cross_wall_ + i]
                grazes |= 1 if grazing else 0
                b[found_ + i] = np.sqrt(max(found, 0.0))
            keep_peaks(b, store, W, turn_rho_, found_, 2)
            any_crossing |= grazes

        if any_crossing:
            for i in range(W):
                h = b[h_ + i]
                if b[cross_rock_ + i] != 0.0:
                    p0, p1, p2, p3, p4, p5 = quintic(
                        b[u0_ + i], h * b[du0_ + i], h * h * b[ddu0_ + i],
                        b[u1_ + i], h * b[du1_ + i], h * h * b[ddu1_ + i])
                    part = share_above(p0, p1, p2, p3, p4, p5, h * b[du1_ + i], 0.0)
                    # A graze from above was counted as a whole step.
                    whole = 1.0 if (p0 > 0.0 and b[u1_ + i] > 0.0) else 0.0
                    b[on_rock_ + i] += h * (part - whole)
                if b[cross_stuck_ + i] != 0.0:
                    _, p1, p2, p3, p4, p5 = quintic(
                        b[twist0_ + i], h * b[dtwist0_ + i], h * h * b[alpha0_ + i],
                        b[twist1_ + i], h * b[dtwist1_ + i], h * h * b[alpha1_ + i])
                    q0, q1, q2, q3, q4, q5 = derivative(p1, p2, p3, p4, p5)
                    level = (b[stuck_ + i] - b[drive_ + i]) * h
                    b[unstuck_ + i] += h * share_above(q0, q1, q2, q3, q4, q5, h * h * b[alpha1_ + i], level)
                if b[cross_wall_ + i] != 0.0:
                    p0, p1, p2, p3, p4, p5 = quintic(
                        b[rho0_ + i], h * b[drho0_ + i], h * h * b[ddrho0_ + i],
                        b[rho1_ + i], h * b[drho1_ + i], h * h * b[ddrho1_ + i])
                    level = b[gap_ + i] * b[gap_ + i]
                    part = share_above(p0, p1, p2, p3, p4, p5, h * b[drho1_ + i], level)
                    whole = 1.0 if (p0 > level and b[rho1_ + i] > level) else 0.0
                    b[on_wall_ + i] += h * (part - whole)

        for i in range(W):
            moved = b[moves_ + i] != 0.0
            for k in range(0, ends_count * W, W):
                b[before_ + k + i] = b[now_ + k + i] if moved else b[before_ + k + i]

    @compiled(types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64), W)
    def marker(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        # The lane stands at the mark: its state is in the stage rows, and the auxiliary outputs belong to it.
        angle = half_plane_angle(b[x1_ + i], b[y1_ + i])
        width = 3 * (int(store[0]) + 1)
        if mark == OPENS:
            for k in range(width):
                store[1 + i * width + k] = 0.0
        else:
            first = column if mark != CLOSES else column + half_report
            for k in range(half_count):
                report[first + k] = b[half_ + k * W + i]
            report[first + half_count] = b[twist1_ + i]
            report[first + half_count + 1] = angle
            if mark == CLOSES:
                for k in range(width):
                    report[column + 2 * half_report + k] = store[1 + i * width + k]
        for k in range(half_count):
            b[half_ + k * W + i] = 0.0
        b[z_min_ + i] = b[z1_ + i]
        b[z_max_ + i] = b[z1_ + i]
        b[speed_min_ + i] = b[speed1_ + i]
        b[speed_max_ + i] = b[speed1_ + i]
        b[twist_min_ + i] = b[twist1_ + i]
        b[twist_max_ + i] = b[twist1_ + i]
        b[u_max_ + i] = b[u1_ + i]
        b[torque_max_ + i] = b[T1_ + i]
        b[rho_max_ + i] = b[rho1_ + i]
        b[twist_start_ + i] = b[twist1_ + i]
        b[angle_start_ + i] = angle

    return observer, marker
