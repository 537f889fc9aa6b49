"""Friction of bit and wall kept apart, for a stepper that treats it implicitly
(:mod:`nsdrill.kernel.additive`).

The torque of the bit is its force F times an arm a(omega), the friction of the wall its
normal force N times a coefficient f(v_s), v_s = omega R_c + (x vy - y vx)/r. Forces
depend on positions alone, and all accelerations are linear in both loads: per unit of
torque, u_b = (u_x, u_y, u_alpha) with the moment of the softened span, per unit of
friction u_w. A stage that moves velocities by c times the push therefore has::

    omega = omega* - c (K_bb F a(omega) + K_bw N f(v_s))
    v_s = v_s* - c (K_wb F a(omega) + K_ww N f(v_s))

with K = -w u and the directions w_b = (0, 0, 1), w_w = (-y/r, x/r, R_c) of the slips.
Two equations, which Newton's method solves jointly. The loads are those of its last
tangent, so that they agree with the velocities to rounding.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, RATES, Rows, compiled, inlined
from nsdrill.elementary import fma
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.models.christoforou_yigit.apart_along import make_along
from nsdrill.models.christoforou_yigit.apart_held import make_held
from nsdrill.models.christoforou_yigit.laws import RATIONAL
from nsdrill.models.christoforou_yigit.lobes import multiple_cosine
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.unit_loads import (
    FEW,
    bit_rates,
    first_speed,
    push_on,
    taken_around,
    unit_friction,
    unit_torque,
    wall_force,
)
from nsdrill.scalar import STEP

# Auxiliary rows: bit speed and slip at the wall as they are found, the slip without
# friction and the normal force; what each load takes from each slip; accelerations of a
# unit of friction; slopes of both laws and coefficient at the wall.
OWN = (
    "found_speed",
    "found_slip",
    "free_slip",
    "normal",
    "bb",
    "bw",
    "wb",
    "ww",
    "unit_x",
    "unit_y",
    "unit_turn",
    "slope",
    "slope_w",
    "coefficient",
)


@lru_cache
def make_solve(
    lanes: int, options: Options, rows: Rows, columns: tuple[str, ...], aux: tuple[str, ...]
) -> Any:
    """The compiled ``solve(buffer, touching)`` for a number of lanes and these options.

    It reads what the right-hand side has left of the positions: cosine and sine of the
    bit angle, the bit's force, the collar's radius and its slip times that. It moves
    the velocities in ``stage``, and leaves the loads, the pushes, and direction and
    decay factor of the bit's law; those of the wall only if some lane is ``touching``.
    """
    W, law, tangent = lanes, options.friction, int(rows.tangent_states > 0)
    x_, vx_, y_, vy_ = (W * (rows.stage + i) for i in range(4))
    speed_ = W * (rows.stage + 7)
    push_x_, push_y_ = (W * (rows.push + i) for i in range(2))
    push_ = W * (rows.push + len(rows.pushed[: len(rows.pushed) // (1 + tangent)]) - 1)
    relax_, falling_ = W * rows.relax, W * rows.falling
    A = {name: W * (rows.aux_now + i) for i, name in enumerate(aux)}
    cosine_, sine_, direction_, decay_ = (
        A[name] for name in ("cosine", "sine", "direction", "decay")
    )
    force_, torque_, radius_, slip_ = (A[name] for name in ("force", "torque", "radius", "slip"))
    radial_, tangential_, friction_ = A["radial"], A["tangential"], A["friction"]
    (
        omega_,
        rubbing_,
        free_,
        normal_,
        bb_,
        bw_,
        wb_,
        ww_,
        push_wx_,
        push_wy_,
        push_w_,
        slope_,
        slope_w_,
        coefficient_,
    ) = (A[name] for name in OWN)
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns)}
    gap_, k_w_, hertz = P["gap"], P["wall_stiffness"], options.hertz
    iml_, iJ_, q_, soft_, R_c_ = (
        P[name]
        for name in (
            "per_lateral_mass",
            "per_inertia",
            "unbalance_arm",
            "softening_torque",
            "collar_radius",
        )
    )
    eps_w_, tau_w_, rise_w_, mu_w_ = (
        P[f"wall_{name}"] for name in ("smoothing", "decay", "rise", "dynamic")
    )
    eps_b_, tau_b_, rise_b_, mu_b_ = (
        P[f"bit_{name}"] for name in ("smoothing", "decay", "rise", "dynamic")
    )
    rational = law == RATIONAL
    held, along = options.stabilizer, options.axial_friction
    room_ = P["clearance"] if held else 0
    push_z_, axial_ = (push_ - W, slip_) if along else (0, 0)
    places = (push_x_, push_y_, push_, vx_, vy_, speed_)
    rub = None
    if held or along:
        rub = (make_held if held else make_along)(lanes, options, rows, columns, aux)

    @inlined
    def falling(decay, rise):  # type: ignore[no-untyped-def]
        # The steepest fall of a law: of the rational one b0 b2 / 8.
        return 0.125 * rise if rational else rise * decay

    @inlined
    def corrected(b, i):  # type: ignore[no-untyped-def]
        # One iteration for the bit alone: its arm, direction and decay factor with
        # their slopes, and the step.
        omega, relaxed = b[omega_ + i], b[bb_ + i]
        arm, slope, g, dg, decayed, ddecayed = bit_rates(
            law, omega, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
        )
        rest = b[speed_ + i] - fma(relaxed, arm, omega)
        step = rest * (1.0 / fma(relaxed, slope, 1.0))
        return omega, step, arm, slope, g, dg, decayed, ddecayed

    @inlined
    def corrected_both(b, i):  # type: ignore[no-untyped-def]
        omega, slip = b[omega_ + i], b[rubbing_ + i]
        c_bb, c_bw, c_wb, c_ww = b[bb_ + i], b[bw_ + i], b[wb_ + i], b[ww_ + i]
        arm, slope, g, dg, decayed, ddecayed = bit_rates(
            law, omega, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
        )
        f, slope_w = hyperbolic(slip, b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i])
        rest = b[speed_ + i] - fma(c_bw, f, fma(c_bb, arm, omega))
        rest_w = b[free_ + i] - fma(c_wb, arm, fma(c_ww, f, slip))
        one, two = fma(c_bb, slope, 1.0), fma(c_ww, slope_w, 1.0)
        across, back = c_bw * slope_w, c_wb * slope
        per_both = 1.0 / fma(one, two, -(across * back))
        step = fma(two, rest, -(across * rest_w)) * per_both
        step_w = fma(one, rest_w, -(back * rest)) * per_both
        return omega, step, arm, slope, g, dg, decayed, ddecayed, slip, step_w, f, slope_w

    @compiled(types.void(BUFFER, types.int64), W, *options, tangent)
    def solve(b, touching):  # type: ignore[no-untyped-def]
        # Many short loops: of a long one the processor holds too little to work on two
        # registers of lanes at once.
        for i in range(W):
            relax, force = b[relax_ + i], b[force_ + i]
            eps, tau, rise, mu = b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
            x, y = b[x_ + i], b[y_ + i]
            if held:  # the span is bent beyond the room at the stabilisers
                share = max(b[radius_ + i] - b[room_ + i], 0.0) / b[radius_ + i]
                x, y = x * share, y * share
            bx, by, turn = unit_torque(
                x, y, b[cosine_ + i], b[sine_ + i], b[q_ + i], b[soft_ + i], b[iml_ + i], b[iJ_ + i]
            )
            taken = -(turn * force)
            b[push_x_ + i] = bx
            b[push_y_ + i] = by
            b[push_ + i] = turn
            b[falling_ + i] = taken * falling(tau, rise)
            b[bb_ + i] = relax * taken
            b[omega_ + i] = first_speed(law, b[speed_ + i], relax * taken, eps, tau, rise, mu)
        if touching == 0:
            for i in range(W if W > FEW else min(W, len(b))):
                omega, step, _, _, _, _, _, _ = corrected(b, i)
                b[omega_ + i] = kept(omega, omega + step)
            for i in range(W):
                _, step, arm, slope, g, dg, decayed, ddecayed = corrected(b, i)
                relax, torque = b[relax_ + i], b[force_ + i] * fma(slope, step, arm)
                push_x, push_y, push = (
                    b[push_x_ + i] * torque,
                    b[push_y_ + i] * torque,
                    b[push_ + i] * torque,
                )
                b[torque_ + i] = torque
                push_on(b, i, places, relax, push_x, push_y, push)
                b[direction_ + i] = fma(dg, step, g)
                b[decay_ + i] = fma(ddecayed, step, decayed)
                b[slope_ + i] = slope
                b[radial_ + i] = 0.0
                b[tangential_ + i] = 0.0
                b[friction_ + i] = 0.0
                if along:
                    b[push_z_ + i] = 0.0
                    b[axial_ + i] = 0.0
            return
        if held or along:
            rub(b)
            return
        for i in range(W):
            x, y, r, relax, q, R_c = (
                b[x_ + i],
                b[y_ + i],
                b[radius_ + i],
                b[relax_ + i],
                b[q_ + i],
                b[R_c_ + i],
            )
            per_r = 1.0 / r
            normal = wall_force(r, b[gap_ + i], b[k_w_ + i], hertz)
            wx, wy, turn_w = unit_friction(
                x, y, per_r, b[cosine_ + i], b[sine_ + i], q, R_c, b[iml_ + i], b[iJ_ + i]
            )
            bx, by, turn = b[push_x_ + i], b[push_y_ + i], b[push_ + i]
            # What each load takes from each slip, per unit of its law.
            ww = taken_around(x, y, per_r, R_c, wx, wy, turn_w) * normal
            wb = taken_around(x, y, per_r, R_c, bx, by, turn) * b[force_ + i]
            free, c_ww = b[slip_ + i] * per_r, relax * ww
            b[free_ + i] = free
            b[normal_ + i] = normal
            b[radial_ + i] = normal * per_r
            b[tangential_ + i] = per_r
            b[push_wx_ + i] = wx
            b[push_wy_ + i] = wy
            b[push_w_ + i] = turn_w
            b[bw_ + i] = relax * (-(turn_w * normal))
            b[wb_ + i] = relax * wb
            b[ww_ + i] = c_ww
            b[falling_ + i] = fma(ww, b[rise_w_ + i] * b[tau_w_ + i], b[falling_ + i])
            b[rubbing_ + i] = first_slip(
                free, c_ww, b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i]
            )
        for i in range(W):
            omega, step, _, _, _, _, _, _, slip, step_w, _, _ = corrected_both(b, i)
            following, following_w = omega + step, slip + step_w
            b[omega_ + i] = kept(omega, following)
            b[rubbing_ + i] = kept(slip, following_w)
        for i in range(W):
            _, step, arm, slope, g, dg, decayed, ddecayed, slip, step_w, f, slope_w = (
                corrected_both(b, i)
            )
            torque = b[force_ + i] * fma(slope, step, arm)
            friction = b[normal_ + i] * fma(slope_w, step_w, f)
            b[torque_ + i] = torque
            b[friction_ + i] = friction
            b[direction_ + i] = fma(dg, step, g)
            b[decay_ + i] = fma(ddecayed, step, decayed)
            b[slope_ + i] = slope
            if tangent:
                b[slope_w_ + i] = slope_w
                b[coefficient_ + i] = fma(slope_w, step_w, f)
                b[slip_ + i] = (slip + step_w) * b[radius_ + i]
        for i in range(W):
            relax, torque, friction = b[relax_ + i], b[torque_ + i], b[friction_ + i]
            push_x = fma(b[push_wx_ + i], friction, b[push_x_ + i] * torque)
            push_y = fma(b[push_wy_ + i], friction, b[push_y_ + i] * torque)
            push = fma(b[push_w_ + i], friction, b[push_ + i] * torque)
            b[tangential_ + i] *= friction
            push_on(b, i, places, relax, push_x, push_y, push)

    return solve


@lru_cache
def make_deviation(
    lanes: int,
    options: Options,
    rows: Rows,
    columns: tuple[str, ...],
    aux: tuple[str, ...],
    place: int,
) -> Any:
    """The compiled ``deviate(buffer)``, after :func:`make_solve` beside a deviation:
    moves the velocities of the deviation as the solve has moved those of the motion,
    and leaves its pushes.

    How unit loads, slip and normal force change with positions is the difference at two
    places, ``STEP`` times the deviation to either side; how the loads change with the
    slips is exact. Contacts count as at the start of the step: their functions stand
    among the observer's rows, at ``place``.
    """
    W, hertz, lobes, own = lanes, options.hertz, options.lobes, rows.own
    x_, vx_, y_, vy_ = (W * (rows.stage + i) for i in range(4))
    dx_, dvx_, dy_, dvy_, dz_, _, dphi_, domega_ = (W * (rows.stage + own + i) for i in range(8))
    pushes = len(rows.pushed) // 2
    dpush_x_, dpush_y_, dpush_ = (W * (rows.push + pushes + i) for i in range(3))
    relax_ = W * rows.relax
    A = {name: W * (rows.aux_now + i) for i, name in enumerate(aux)}
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns)}
    cosine_, sine_, force_, torque_, friction_ = (
        A[n] for n in ("cosine", "sine", "force", "torque", "friction")
    )
    radius_ = A["radius"]
    bb_, bw_, wb_, ww_, wx_, wy_, turn_w_ = (
        A[n] for n in ("bb", "bw", "wb", "ww", "unit_x", "unit_y", "unit_turn")
    )
    slope_, slope_w_, coefficient_, normal_ = (
        A[n] for n in ("slope", "slope_w", "coefficient", "normal")
    )
    iml_, iJ_, q_, soft_, R_c_, gap_, k_w_, k_c_, s0_ = (
        P[name]
        for name in (
            "per_lateral_mass",
            "per_inertia",
            "unbalance_arm",
            "softening_torque",
            "collar_radius",
            "gap",
            "wall_stiffness",
            "rock_stiffness",
            "surface_amplitude",
        )
    )
    rock_, wall_ = (W * (rows.observer + place + RATES * c) for c in range(2))

    @inlined
    def units(x, y, c, s, q, soft, radius, per_mass, per_inertia, vx, vy, gap, k_w):  # type: ignore[no-untyped-def]
        # All that depends on positions: unit loads, the part of the slip that the
        # collar's motion makes, normal force.
        r = np.sqrt(max(fma(x, x, y * y), 1e-60))
        per_r = 1.0 / r
        bx, by, turn = unit_torque(x, y, c, s, q, soft, per_mass, per_inertia)
        wx, wy, turn_w = unit_friction(x, y, per_r, c, s, q, radius, per_mass, per_inertia)
        deep = max(r - gap, 0.0)
        normal = k_w * deep * (np.sqrt(deep) if hertz else 1.0)
        return bx, by, turn, wx, wy, turn_w, fma(x, vy, -(y * vx)) * per_r, normal

    @compiled(types.void(BUFFER), W, *options, place)
    def deviate(b):  # type: ignore[no-untyped-def]
        for i in range(W):
            x, vx, y, vy, relax = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i], b[relax_ + i]
            dx, dy, dvx, dvy, dphi = b[dx_ + i], b[dy_ + i], b[dvx_ + i], b[dvy_ + i], b[dphi_ + i]
            c, s, q, soft, R_c = b[cosine_ + i], b[sine_ + i], b[q_ + i], b[soft_ + i], b[R_c_ + i]
            per_mass, per_inertia, gap, k_w = b[iml_ + i], b[iJ_ + i], b[gap_ + i], b[k_w_ + i]
            e = STEP
            one = units(
                fma(e, dx, x),
                fma(e, dy, y),
                fma(-e * dphi, s, c),
                fma(e * dphi, c, s),
                q,
                soft,
                R_c,
                per_mass,
                per_inertia,
                vx,
                vy,
                gap,
                k_w,
            )
            two = units(
                fma(-e, dx, x),
                fma(-e, dy, y),
                fma(e * dphi, s, c),
                fma(-e * dphi, c, s),
                q,
                soft,
                R_c,
                per_mass,
                per_inertia,
                vx,
                vy,
                gap,
                k_w,
            )
            half = 0.5 / e
            bx, by, turn = unit_torque(x, y, c, s, q, soft, per_mass, per_inertia)
            on = 1.0 if (b[wall_ + i] > 0.0) and (b[radius_ + i] > gap) else 0.0
            torque, friction, force = b[torque_ + i], on * b[friction_ + i], b[force_ + i]
            # An arm of a bit off the rock does not matter: torque over force is taken
            # where there is some.
            surface = b[s0_ + i] * lobes * multiple_cosine(c, lobes)
            dforce = b[k_c_ + i] * fma(surface, dphi, -b[dz_ + i]) if b[rock_ + i] > 0.0 else 0.0
            dtorque = dforce * torque / max(force, 1e-300)
            wx, wy, turn_w = on * b[wx_ + i], on * b[wy_ + i], on * b[turn_w_ + i]
            steep, steep_w = b[slope_ + i], on * b[slope_w_ + i]
            dslip = (one[6] - two[6]) * half
            dfriction = (
                fma(b[coefficient_ + i], (one[7] - two[7]) * half, b[normal_ + i] * steep_w * dslip)
                * on
            )
            push_x = half * fma(one[0] - two[0], torque, (one[3] - two[3]) * friction)
            push_y = half * fma(one[1] - two[1], torque, (one[4] - two[4]) * friction)
            push = half * fma(one[2] - two[2], torque, (one[5] - two[5]) * friction)
            push_x = fma(bx, dtorque, fma(wx, dfriction, push_x))
            push_y = fma(by, dtorque, fma(wy, dfriction, push_y))
            push = fma(turn, dtorque, fma(turn_w, dfriction, push))
            # The slips as they change with all velocities.
            per_r = 1.0 / np.sqrt(max(fma(x, x, y * y), 1e-60))
            free = fma(relax, push, b[domega_ + i])
            free_x, free_y = fma(relax, push_x, dvx), fma(relax, push_y, dvy)
            free_w = fma(R_c, free, fma(x, free_y, -(y * free_x)) * per_r)
            a11, a12 = fma(b[bb_ + i], steep, 1.0), on * b[bw_ + i] * steep_w
            a21, a22 = on * b[wb_ + i] * steep, fma(on * b[ww_ + i], steep_w, 1.0)
            per_both = 1.0 / fma(a11, a22, -(a12 * a21))
            domega = fma(a22, free, -(a12 * free_w)) * per_both
            dslip = fma(a11, free_w, -(a21 * free)) * per_both
            dtorque, dfriction = force * steep * domega, b[normal_ + i] * steep_w * dslip * on
            push_x = fma(bx, dtorque, fma(wx, dfriction, push_x))
            push_y = fma(by, dtorque, fma(wy, dfriction, push_y))
            b[dpush_x_ + i] = push_x
            b[dpush_y_ + i] = push_y
            b[dpush_ + i] = fma(turn, dtorque, fma(turn_w, dfriction, push))
            b[dvx_ + i] = fma(relax, push_x, dvx)
            b[dvy_ + i] = fma(relax, push_y, dvy)
            b[domega_ + i] = domega

    return deviate
