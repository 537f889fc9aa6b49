"""The implicit friction of bit and wall, as its stepper needs it
(:mod:`nsdrill.kernel.additive`).

The torque of the bit is its force F times an arm a(omega), the friction of the wall its
normal force N times a coefficient f(v_w), v_w = omega R_c + (x vy - y vx)/r. Forces
depend on positions alone, and all accelerations are linear in both loads: per unit of
torque they are u_b = (u_x, u_y, u_alpha), with the moment of the softened span, per
unit of friction u_w. A stage that moves velocities by c times the push therefore has::

    omega = omega* - c (K_bb F a(omega) + K_bw N f(v_w))
    v_w   = v_w*   - c (K_wb F a(omega) + K_ww N f(v_w))

with K = -w u and the directions w_b = (0, 0, 1), w_w = (-y/r, x/r, R_c) of the slips.
Newton's method solves these two equations jointly. The loads are those of its last
linearisation, so that they agree with the velocities to rounding.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import RATES, Rows
from nsdrill.compiler.functions import BUFFER, INTEGER, compiled, inlined
from nsdrill.compiler.words import fma, packed
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.models.christoforou_yigit.implicit_along import make_axial_solve
from nsdrill.models.christoforou_yigit.implicit_held import make_stabilizer_solve
from nsdrill.models.christoforou_yigit.laws import RATIONAL
from nsdrill.models.christoforou_yigit.lobes import multiple_cosine
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.unit_loads import (
    apply_push,
    bit_law_rates,
    first_bit_speed,
    slip_deceleration,
    unit_friction,
    unit_torque,
    wall_force,
)
from nsdrill.scalar import STEP

# Auxiliary rows: bit speed and slip at the wall, the unknowns of the solve; the slip
# without friction and the normal force; c K of each slip and load; accelerations by a
# unit of friction; slopes of both laws and coefficient at the wall.
SOLVE_AUX = (
    "solved_speed",
    "solved_slip",
    "free_slip",
    "normal",
    "bb",
    "bw",
    "wb",
    "ww",
    "unit_x",
    "unit_y",
    "unit_angular",
    "slope",
    "slope_w",
    "coefficient",
)


@lru_cache
def make_solve(
    lanes: int, options: Options, rows: Rows, columns: tuple[str, ...], aux: tuple[str, ...]
) -> Any:
    """The compiled ``solve(buffer, touching)`` for a number of lanes and these options.

    It reads what the right-hand side has computed from the positions: cosine and sine
    of the bit angle, the bit's force, the collar's radius and its slip times that
    radius. It moves the velocities in ``stage`` and writes the loads, the pushes, and
    direction and decay factor of the bit's law; loads at the wall are zero unless some
    lane is ``touching``.
    """
    W, law, tangent = lanes, options.friction, int(rows.tangent_states > 0)
    x_, vx_, y_, vy_ = (W * (rows.stage + i) for i in range(4))
    speed_ = W * (rows.stage + 7)
    push_x_, push_y_ = (W * (rows.push + i) for i in range(2))
    push_angular_ = W * (rows.push + len(rows.pushed[: len(rows.pushed) // (1 + tangent)]) - 1)
    relax_, falling_ = W * rows.relax, W * rows.falling
    A = {name: W * (rows.aux_now + i) for i, name in enumerate(aux)}
    cosine_, sine_, direction_, decay_ = (
        A[name] for name in ("cosine", "sine", "direction", "decay")
    )
    force_, torque_, radius_, slip_ = (A[name] for name in ("force", "torque", "radius", "slip"))
    radial_, tangential_, friction_ = A["radial"], A["tangential"], A["friction"]
    (
        omega_,
        v_w_,
        v_w_free_,
        normal_,
        bb_,
        bw_,
        wb_,
        ww_,
        unit_x_,
        unit_y_,
        unit_angular_,
        slope_,
        slope_w_,
        coefficient_,
    ) = (A[name] for name in SOLVE_AUX)
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
    stabilizer, axial = options.stabilizer, options.axial_friction
    clearance_ = P["clearance"] if stabilizer else 0
    push_z_, axial_ = (push_angular_ - W, slip_) if axial else (0, 0)
    push_rows = (push_x_, push_y_, push_angular_, vx_, vy_, speed_)
    solve_touching = None
    if stabilizer or axial:
        solve_touching = (make_stabilizer_solve if stabilizer else make_axial_solve)(
            lanes, options, rows, columns, aux
        )

    @inlined
    def steepest_fall(decay, rise):  # type: ignore[no-untyped-def]
        # The steepest fall of a law with speed; of the rational one b0 b2 / 8.
        return 0.125 * rise if rational else rise * decay

    @inlined
    def newton_step(b, i):  # type: ignore[no-untyped-def]
        # One iteration for the bit alone: bit speed and step; arm (with stabilisers the
        # torque), direction and decay factor with their slopes.
        omega, relaxed = b[omega_ + i], b[bb_ + i]
        arm, slope, g, dg, decayed, ddecayed = bit_law_rates(
            law, omega, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
        )
        if stabilizer:  # in the operations of the solve with contact, to the bit
            relaxed = -b[relax_ + i] * b[push_angular_ + i]
            arm, slope = b[force_ + i] * arm, b[force_ + i] * slope
            residual = b[speed_ + i] - omega - relaxed * arm
        else:
            residual = b[speed_ + i] - fma(relaxed, arm, omega)
        step = residual * (1.0 / fma(relaxed, slope, 1.0))
        return omega, step, arm, slope, g, dg, decayed, ddecayed

    @inlined
    def newton_step_both(b, i):  # type: ignore[no-untyped-def]
        omega, slip = b[omega_ + i], b[v_w_ + i]
        c_bb, c_bw, c_wb, c_ww = b[bb_ + i], b[bw_ + i], b[wb_ + i], b[ww_ + i]
        arm, slope, g, dg, decayed, ddecayed = bit_law_rates(
            law, omega, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
        )
        f, slope_w = hyperbolic(slip, b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i])
        residual = b[speed_ + i] - fma(c_bw, f, fma(c_bb, arm, omega))
        residual_w = b[v_w_free_ + i] - fma(c_wb, arm, fma(c_ww, f, slip))
        a_bb, a_ww = fma(c_bb, slope, 1.0), fma(c_ww, slope_w, 1.0)
        a_bw, a_wb = c_bw * slope_w, c_wb * slope
        per_det = 1.0 / fma(a_bb, a_ww, -(a_bw * a_wb))
        step = fma(a_ww, residual, -(a_bw * residual_w)) * per_det
        step_w = fma(a_bb, residual_w, -(a_wb * residual)) * per_det
        return omega, step, arm, slope, g, dg, decayed, ddecayed, slip, step_w, f, slope_w

    @compiled(BUFFER, INTEGER)
    def solve(b, touching):  # type: ignore[no-untyped-def]
        # Several short loops: of a long one the processor could not hold enough to
        # process two registers of lanes at once.
        for i in packed(W):
            relax, force = b[relax_ + i], b[force_ + i]
            eps, tau, rise, mu = b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
            x, y = b[x_ + i], b[y_ + i]
            if stabilizer:  # the span is bent by the radius beyond the clearance
                bent_share = max(b[radius_ + i] - b[clearance_ + i], 0.0) / b[radius_ + i]
                x, y = x * bent_share, y * bent_share
            bx, by, angular = unit_torque(
                x, y, b[cosine_ + i], b[sine_ + i], b[q_ + i], b[soft_ + i], b[iml_ + i], b[iJ_ + i]
            )
            deceleration = -(angular * force)
            b[push_x_ + i] = bx
            b[push_y_ + i] = by
            b[push_angular_ + i] = angular
            b[falling_ + i] = deceleration * steepest_fall(tau, rise)
            relaxed = -relax * angular * force if stabilizer else relax * deceleration
            b[bb_ + i] = relaxed
            b[omega_ + i] = first_bit_speed(law, b[speed_ + i], relaxed, eps, tau, rise, mu)
        if touching == 0:
            for i in packed(W):
                omega, step, _, _, _, _, _, _ = newton_step(b, i)
                b[omega_ + i] = kept(omega, omega + step)
            for i in packed(W):
                _, step, arm, slope, g, dg, decayed, ddecayed = newton_step(b, i)
                relax, torque = b[relax_ + i], fma(slope, step, arm)
                if not stabilizer:
                    torque = b[force_ + i] * torque
                push_x, push_y, push_angular = (
                    b[push_x_ + i] * torque,
                    b[push_y_ + i] * torque,
                    b[push_angular_ + i] * torque,
                )
                b[torque_ + i] = torque
                apply_push(b, i, push_rows, relax, push_x, push_y, push_angular)
                b[direction_ + i] = fma(dg, step, g)
                b[decay_ + i] = fma(ddecayed, step, decayed)
                b[slope_ + i] = slope
                b[radial_ + i] = 0.0
                b[tangential_ + i] = 0.0
                b[friction_ + i] = 0.0
                if axial:
                    b[push_z_ + i] = 0.0
                    b[axial_ + i] = 0.0
            return
        if stabilizer or axial:
            solve_touching(b)
            return
        for i in packed(W):
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
            wx, wy, angular_w = unit_friction(
                x, y, per_r, b[cosine_ + i], b[sine_ + i], q, R_c, b[iml_ + i], b[iJ_ + i]
            )
            bx, by, angular = b[push_x_ + i], b[push_y_ + i], b[push_angular_ + i]
            # The decrease of each slip by each load, per unit of its law.
            ww = slip_deceleration(x, y, per_r, R_c, wx, wy, angular_w) * normal
            wb = slip_deceleration(x, y, per_r, R_c, bx, by, angular) * b[force_ + i]
            v_w_free, c_ww = b[slip_ + i] * per_r, relax * ww
            b[v_w_free_ + i] = v_w_free
            b[normal_ + i] = normal
            b[radial_ + i] = normal * per_r
            b[tangential_ + i] = per_r
            b[unit_x_ + i] = wx
            b[unit_y_ + i] = wy
            b[unit_angular_ + i] = angular_w
            b[bw_ + i] = relax * (-(angular_w * normal))
            b[wb_ + i] = relax * wb
            b[ww_ + i] = c_ww
            b[falling_ + i] = fma(ww, b[rise_w_ + i] * b[tau_w_ + i], b[falling_ + i])
            b[v_w_ + i] = first_slip(
                v_w_free, c_ww, b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i]
            )
        for i in packed(W):
            omega, step, _, _, _, _, _, _, slip, step_w, _, _ = newton_step_both(b, i)
            next_omega, next_slip = omega + step, slip + step_w
            b[omega_ + i] = kept(omega, next_omega)
            b[v_w_ + i] = kept(slip, next_slip)
        for i in packed(W):
            _, step, arm, slope, g, dg, decayed, ddecayed, slip, step_w, f, slope_w = (
                newton_step_both(b, i)
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
        for i in packed(W):
            relax, torque, friction = b[relax_ + i], b[torque_ + i], b[friction_ + i]
            push_x = fma(b[unit_x_ + i], friction, b[push_x_ + i] * torque)
            push_y = fma(b[unit_y_ + i], friction, b[push_y_ + i] * torque)
            push_angular = fma(b[unit_angular_ + i], friction, b[push_angular_ + i] * torque)
            b[tangential_ + i] *= friction
            apply_push(b, i, push_rows, relax, push_x, push_y, push_angular)

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
    """The compiled ``deviate(buffer)``, which follows the function of
    :func:`make_solve` where the buffer has a deviation: it moves the velocities of the
    deviation as the solve has moved those of the motion, and writes its pushes.

    The derivatives of unit loads, slip and normal force with respect to the positions
    are central differences, with ``STEP`` times the deviation to either side; those of
    the loads with respect to the slips are exact. Contacts are as at the start of the
    step: their functions are among the observer's rows, from ``place`` on.
    """
    W, hertz, lobes, state_count = lanes, options.hertz, options.lobes, rows.own
    x_, vx_, y_, vy_ = (W * (rows.stage + i) for i in range(4))
    dx_, dvx_, dy_, dvy_, dz_, _, dphi_, domega_ = (
        W * (rows.stage + state_count + i) for i in range(8)
    )
    push_count = len(rows.pushed) // 2
    dpush_x_, dpush_y_, dpush_angular_ = (W * (rows.push + push_count + i) for i in range(3))
    relax_ = W * rows.relax
    A = {name: W * (rows.aux_now + i) for i, name in enumerate(aux)}
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns)}
    cosine_, sine_, force_, torque_, friction_ = (
        A[n] for n in ("cosine", "sine", "force", "torque", "friction")
    )
    radius_ = A["radius"]
    bb_, bw_, wb_, ww_, unit_x_, unit_y_, unit_angular_ = (
        A[n] for n in ("bb", "bw", "wb", "ww", "unit_x", "unit_y", "unit_angular")
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
    def unit_loads(x, y, c, s, q, soft, radius, per_mass, per_inertia, vx, vy, gap, k_w):  # type: ignore[no-untyped-def]
        # What depends on positions: unit loads, the part of the slip due to the lateral
        # motion, normal force.
        r = np.sqrt(max(fma(x, x, y * y), 1e-60))
        per_r = 1.0 / r
        bx, by, angular = unit_torque(x, y, c, s, q, soft, per_mass, per_inertia)
        wx, wy, angular_w = unit_friction(x, y, per_r, c, s, q, radius, per_mass, per_inertia)
        penetration = max(r - gap, 0.0)
        normal = k_w * penetration * (np.sqrt(penetration) if hertz else 1.0)
        return bx, by, angular, wx, wy, angular_w, fma(x, vy, -(y * vx)) * per_r, normal

    @compiled(BUFFER)
    def deviate(b):  # type: ignore[no-untyped-def]
        for i in packed(W):
            x, vx, y, vy, relax = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i], b[relax_ + i]
            dx, dy, dvx, dvy, dphi = b[dx_ + i], b[dy_ + i], b[dvx_ + i], b[dvy_ + i], b[dphi_ + i]
            c, s, q, soft, R_c = b[cosine_ + i], b[sine_ + i], b[q_ + i], b[soft_ + i], b[R_c_ + i]
            per_mass, per_inertia, gap, k_w = b[iml_ + i], b[iJ_ + i], b[gap_ + i], b[k_w_ + i]
            e = STEP
            plus = unit_loads(
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
            minus = unit_loads(
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
            per_two_e = 0.5 / e
            bx, by, angular = unit_torque(x, y, c, s, q, soft, per_mass, per_inertia)
            contact = 1.0 if (b[wall_ + i] > 0.0) and (b[radius_ + i] > gap) else 0.0
            torque, friction, force = b[torque_ + i], contact * b[friction_ + i], b[force_ + i]
            # The arm of a bit off the rock has no effect, so torque over force serves.
            surface = b[s0_ + i] * lobes * multiple_cosine(c, lobes)
            dforce = b[k_c_ + i] * fma(surface, dphi, -b[dz_ + i]) if b[rock_ + i] > 0.0 else 0.0
            dtorque = dforce * torque / max(force, 1e-300)
            wx, wy, angular_w = (
                contact * b[unit_x_ + i],
                contact * b[unit_y_ + i],
                contact * b[unit_angular_ + i],
            )
            slope, slope_w = b[slope_ + i], contact * b[slope_w_ + i]
            dslip = (plus[6] - minus[6]) * per_two_e
            dfriction = (
                fma(
                    b[coefficient_ + i],
                    (plus[7] - minus[7]) * per_two_e,
                    b[normal_ + i] * slope_w * dslip,
                )
                * contact
            )
            push_x = per_two_e * fma(plus[0] - minus[0], torque, (plus[3] - minus[3]) * friction)
            push_y = per_two_e * fma(plus[1] - minus[1], torque, (plus[4] - minus[4]) * friction)
            push_angular = per_two_e * fma(
                plus[2] - minus[2], torque, (plus[5] - minus[5]) * friction
            )
            push_x = fma(bx, dtorque, fma(wx, dfriction, push_x))
            push_y = fma(by, dtorque, fma(wy, dfriction, push_y))
            push_angular = fma(angular, dtorque, fma(angular_w, dfriction, push_angular))
            # The deviations of both slips with all velocities.
            per_r = 1.0 / np.sqrt(max(fma(x, x, y * y), 1e-60))
            free_omega = fma(relax, push_angular, b[domega_ + i])
            free_x, free_y = fma(relax, push_x, dvx), fma(relax, push_y, dvy)
            free_slip = fma(R_c, free_omega, fma(x, free_y, -(y * free_x)) * per_r)
            a11, a12 = fma(b[bb_ + i], slope, 1.0), contact * b[bw_ + i] * slope_w
            a21, a22 = contact * b[wb_ + i] * slope, fma(contact * b[ww_ + i], slope_w, 1.0)
            per_det = 1.0 / fma(a11, a22, -(a12 * a21))
            domega = fma(a22, free_omega, -(a12 * free_slip)) * per_det
            dslip = fma(a11, free_slip, -(a21 * free_omega)) * per_det
            dtorque, dfriction = force * slope * domega, b[normal_ + i] * slope_w * dslip * contact
            push_x = fma(bx, dtorque, fma(wx, dfriction, push_x))
            push_y = fma(by, dtorque, fma(wy, dfriction, push_y))
            b[dpush_x_ + i] = push_x
            b[dpush_y_ + i] = push_y
            b[dpush_angular_ + i] = fma(angular, dtorque, fma(angular_w, dfriction, push_angular))
            b[dvx_ + i] = fma(relax, push_x, dvx)
            b[dvy_ + i] = fma(relax, push_y, dvy)
            b[domega_ + i] = domega

    return deviate
