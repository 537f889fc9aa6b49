"""Friction of bit and wall kept apart, for a stepper that treats it implicitly (:mod:`nsdrill.kernel.additive`).

The torque of the bit is its force F times an arm a(omega), the friction of the wall its normal force N times a
coefficient f(v_s), v_s = omega R_c + (x vy - y vx)/r. Forces depend on positions alone, and all accelerations are
linear in both loads: per unit of torque, u_b = (u_x, u_y, u_alpha) with the moment of the softened span, per unit of
friction u_w. A stage that moves velocities by c times the push therefore has

    omega = omega* - c (K_bb F a(omega) + K_bw N f(v_s)),    v_s = v_s* - c (K_wb F a(omega) + K_ww N f(v_s))

with K = -w u and the directions w_b = (0, 0, 1), w_w = (-y/r, x/r, R_c) of the slips. Two equations, which Newton's
method solves jointly. The loads are those of its last tangent, so that they agree with the velocities to rounding.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from numba import types

from nsdrill.abi import BUFFER, Rows, compiled, inlined
from nsdrill.elementary import fma
from nsdrill.kernel.slip import ITERATIONS, LEAST, first_slip
from nsdrill.models.christoforou_yigit.friction import bit_factors, bit_law, coefficient, slip_factors
from nsdrill.models.christoforou_yigit.laws import RATIONAL
from nsdrill.models.christoforou_yigit.options import Options

ROOM = 0.5  # of the step from which on there may be several solutions


@inlined
def wall_law(slip: float, smoothing: float, decay: float, rise: float, dynamic: float) -> tuple[float, float]:
    """(f, f') of the wall at a slip speed."""
    steep = smoothing * slip
    flat = fma(steep, steep, 1.0)
    g, decayed, per_flat = slip_factors(slip * flat, flat, smoothing, decay)
    return coefficient(slip, g, decayed, per_flat, smoothing, decay, rise, dynamic)


@inlined
def unit_torque(x, y, c, s, q, soft, per_mass, per_inertia):  # type: ignore[no-untyped-def]
    """Accelerations (x, y, angular) of a unit of bit torque."""
    angular = -fma(q * soft, fma(y, c, -(x * s)), 1.0) * per_inertia
    return (
        fma(q * angular, s, soft * x * per_mass),
        fma(-q * angular, c, soft * y * per_mass),
        angular,
    )


@inlined
def unit_friction(x, y, per_r, c, s, q, radius, per_mass, per_inertia):  # type: ignore[no-untyped-def]
    """Accelerations (x, y, angular) of a unit of friction at the wall."""
    across, along = y * per_r, -x * per_r
    angular = -fma(q, fma(along, c, -(across * s)), radius) * per_inertia
    return fma(q * angular, s, across * per_mass), fma(-q * angular, c, along * per_mass), angular


@lru_cache
def make_solve(lanes: int, options: Options, rows: Rows, columns: tuple[str, ...], aux: tuple[str, ...]) -> Any:
    """The compiled ``solve(buffer, touching)`` for a number of lanes and these options.

    It reads what the right-hand side has left of the positions: cosine and sine of the bit angle, the bit's force and,
    if ``touching``, the wall's normal force (in ``friction``) and one over the radius times it (``radial``). It moves
    the velocities in ``stage``, and leaves the loads, the pushes, and the direction and decay factor of the bit's law.
    """
    W, law, tangent = lanes, options.friction, int(rows.companions > 0)
    x_, vx_, y_, vy_ = (W * (rows.stage + i) for i in range(4))
    speed_ = W * (rows.stage + 7)
    push_x_, push_y_, push_ = (W * (rows.push + i) for i in range(3))
    relax_, longest_ = W * rows.relax, W * rows.longest
    A = {name: W * (rows.aux_now + i) for i, name in enumerate(aux)}
    cosine_, sine_, direction_, decay_ = (A[name] for name in ("cosine", "sine", "direction", "decay"))
    force_, torque_, radius_, slip_ = (A[name] for name in ("force", "torque", "radius", "slip"))
    tangential_, friction_ = A["tangential"], A["friction"]
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns)}
    iml_, iJ_, q_, soft_, R_c_ = (
        P[name] for name in ("per_lateral_mass", "per_inertia", "unbalance_arm", "softening_torque", "collar_radius")
    )
    eps_w_, tau_w_, rise_w_, mu_w_ = (P[f"wall_{name}"] for name in ("smoothing", "decay", "rise", "dynamic"))
    eps_b_, tau_b_, rise_b_, mu_b_ = (P[f"bit_{name}"] for name in ("smoothing", "decay", "rise", "dynamic"))
    rational = law == RATIONAL

    @inlined
    def falling(decay, rise):  # type: ignore[no-untyped-def]
        # The steepest fall of a law: of the rational one b0 b2 / 8.
        return 0.125 * rise if rational else rise * decay

    @inlined
    def guessed(free, relaxed, smoothing, decay, rise, dynamic):  # type: ignore[no-untyped-def]
        if rational:
            return first_slip(free, relaxed, smoothing, 0.0, 0.0, dynamic)
        return first_slip(free, relaxed, smoothing, decay, rise, dynamic)

    @inlined
    def noted(b, i, omega, arm):  # type: ignore[no-untyped-def]
        # Direction and decay factor that give this arm.
        rise, dynamic = b[rise_b_ + i], b[mu_b_ + i]
        _, decayed = bit_factors(law, omega, b[eps_b_ + i], b[tau_b_ + i])
        if rational:
            g = fma(-rise * omega, decayed, arm) / max(dynamic, LEAST)
        else:
            g = arm / max(fma(rise, decayed, dynamic), LEAST)
        b[direction_ + i] = g
        b[decay_ + i] = decayed

    @compiled(types.void(BUFFER, types.int64), W, *options, tangent)
    def solve(b, touching):  # type: ignore[no-untyped-def]
        if touching == 0:
            for i in range(W):
                c, s, force, relax = b[cosine_ + i], b[sine_ + i], b[force_ + i], b[relax_ + i]
                bx, by, turn = unit_torque(
                    b[x_ + i], b[y_ + i], c, s, b[q_ + i], b[soft_ + i], b[iml_ + i], b[iJ_ + i]
                )
                eps, tau, rise, mu = b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
                free = b[speed_ + i]
                taken = -(turn * force)
                relaxed = relax * taken
                omega = guessed(free, relaxed, eps, tau, rise, mu)
                arm, slope, step = 0.0, 0.0, 0.0
                for k in range(ITERATIONS):
                    arm, slope = bit_law(law, omega, eps, tau, rise, mu)
                    rest = free - fma(relaxed, arm, omega)
                    step = rest * (1.0 / fma(relaxed, slope, 1.0))
                    if k < ITERATIONS - 1:
                        following = omega + step
                        omega = 0.0 if following * omega < 0.0 else following
                arm = fma(slope, step, arm)
                torque = force * arm
                b[torque_ + i] = torque
                b[push_x_ + i] = bx * torque
                b[push_y_ + i] = by * torque
                b[push_ + i] = turn * torque
                b[longest_ + i] = ROOM / max(taken * falling(tau, rise), LEAST)
                omega = fma(relax, turn * torque, free)
                b[vx_ + i] = fma(relax, bx * torque, b[vx_ + i])
                b[vy_ + i] = fma(relax, by * torque, b[vy_ + i])
                b[speed_ + i] = omega
                noted(b, i, omega, arm)
            return
        for i in range(W):
            x, y, r = b[x_ + i], b[y_ + i], b[radius_ + i]
            c, s, force, normal, relax = (
                b[cosine_ + i], b[sine_ + i], b[force_ + i], b[friction_ + i], b[relax_ + i]
            )
            per_r = 1.0 / r
            q, per_mass, per_inertia, R_c = b[q_ + i], b[iml_ + i], b[iJ_ + i], b[R_c_ + i]
            bx, by, turn = unit_torque(x, y, c, s, q, b[soft_ + i], per_mass, per_inertia)
            wx, wy, turn_w = unit_friction(x, y, per_r, c, s, q, R_c, per_mass, per_inertia)
            eps, tau, rise, mu = b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
            eps_w, tau_w, rise_w, mu_w = b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i]
            free, free_w = b[speed_ + i], b[slip_ + i] * per_r
            # What a unit of each load takes from each slip, times the force.
            bb, bw = -(turn * force), -(turn_w * normal)
            wb = -fma(fma(x, by, -(y * bx)), per_r, R_c * turn) * force
            ww = -fma(fma(x, wy, -(y * wx)), per_r, R_c * turn_w) * normal
            c_bb, c_bw, c_wb, c_ww = relax * bb, relax * bw, relax * wb, relax * ww
            omega = guessed(free, c_bb, eps, tau, rise, mu)
            slip = first_slip(free_w, c_ww, eps_w, tau_w, rise_w, mu_w)
            arm, slope, step, f, slope_w, step_w = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(ITERATIONS):
                arm, slope = bit_law(law, omega, eps, tau, rise, mu)
                f, slope_w = wall_law(slip, eps_w, tau_w, rise_w, mu_w)
                rest = free - fma(c_bw, f, fma(c_bb, arm, omega))
                rest_w = free_w - fma(c_wb, arm, fma(c_ww, f, slip))
                one, two = fma(c_bb, slope, 1.0), fma(c_ww, slope_w, 1.0)
                across, back = c_bw * slope_w, c_wb * slope
                per_both = 1.0 / fma(one, two, -(across * back))
                step = fma(two, rest, -(across * rest_w)) * per_both
                step_w = fma(one, rest_w, -(back * rest)) * per_both
                if k < ITERATIONS - 1:
                    following, following_w = omega + step, slip + step_w
                    omega = 0.0 if following * omega < 0.0 else following
                    slip = 0.0 if following_w * slip < 0.0 else following_w
            arm, f = fma(slope, step, arm), fma(slope_w, step_w, f)
            torque, friction = force * arm, normal * f
            push_x, push_y = fma(wx, friction, bx * torque), fma(wy, friction, by * torque)
            push = fma(turn_w, friction, turn * torque)
            b[torque_ + i] = torque
            b[friction_ + i] = friction
            b[tangential_ + i] = friction * per_r
            b[push_x_ + i] = push_x
            b[push_y_ + i] = push_y
            b[push_ + i] = push
            fall = fma(ww, rise_w * tau_w, bb * falling(tau, rise))
            b[longest_ + i] = ROOM / max(fall, LEAST)
            omega = fma(relax, push, free)
            b[vx_ + i] = fma(relax, push_x, b[vx_ + i])
            b[vy_ + i] = fma(relax, push_y, b[vy_ + i])
            b[speed_ + i] = omega
            if tangent:
                b[slip_ + i] = (slip + step_w) * r
            noted(b, i, omega, arm)

    return solve
