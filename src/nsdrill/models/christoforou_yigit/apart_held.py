"""Friction of bit, stabilisers and wall kept apart, in the lanes whose collar is as far
out as the stabilisers reach.

Stabilisers and wall brake the same mass, at slips v_s = omega R_s + theta' s0 and v_w =
omega R_c + theta' r that are nearly the same where the collar whirls. Three slips,
then, and three loads, of a stage that moves velocities by c times the push:

    v_i = v_i* - c (K_ib T(omega) + K_is N_s f(v_s) + K_iw N_w f(v_w)),   i = b, s, w,
    N_s = |k_0 - k_T T| max(r - s0, 0)

as :mod:`.apart` has it for two. As the two contacts hardly differ, one of them mostly
holds while the other slips, and Newton's method needs a good guess: the slip of each
with the load that the other has where this one holds. Iterations go on in the lanes
that are not done; what a lane gets does not depend on its neighbours.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from numba import types

from nsdrill.abi import BUFFER, Rows, compiled, inlined
from nsdrill.elementary import fma
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.unit_loads import (
    bit_rates,
    first_speed,
    push_on,
    unit_friction,
    wall_force,
)

# Auxiliary rows: slip at the stabilisers as it is found and without friction, the force
# there with no bit torque and what a unit of torque takes from it; what loads take from
# slips; accelerations of a unit of friction there.
HELD = (
    "found_held",
    "free_held",
    "held_force",
    "held_loss",
    "bs",
    "sb",
    "ss",
    "sw",
    "ws",
    "held_x",
    "held_y",
    "held_turn",
)
MOST = 12  # iterations
CLOSE = 1e-5  # of the loads, which one iteration more squares


@lru_cache
def make_held(
    lanes: int, options: Options, rows: Rows, columns: tuple[str, ...], aux: tuple[str, ...]
) -> Any:
    """The compiled ``rub(buffer)`` for a number of lanes and these options, after the
    part of :func:`.apart.make_solve` that concerns the bit alone."""
    W, law, hertz = lanes, options.friction, options.hertz
    x_, vx_, y_, vy_ = (W * (rows.stage + i) for i in range(4))
    speed_ = W * (rows.stage + 7)
    push_x_, push_y_, push_ = (W * (rows.push + i) for i in range(3))
    relax_, falling_ = W * rows.relax, W * rows.falling
    A = {name: W * (rows.aux_now + i) for i, name in enumerate(aux)}
    (
        cosine_,
        sine_,
        direction_,
        decay_,
        force_,
        torque_,
        radius_,
        slip_,
        radial_,
        tangential_,
        friction_,
    ) = (
        A[name]
        for name in (
            "cosine",
            "sine",
            "direction",
            "decay",
            "force",
            "torque",
            "radius",
            "slip",
            "radial",
            "tangential",
            "friction",
        )
    )
    omega_, rubbing_, free_, normal_, bb_, bw_, wb_, ww_, wx_, wy_, wt_, slope_ = (
        A[name]
        for name in (
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
        )
    )
    held_, free_s_, force_s_, loss_, bs_, sb_, ss_, sw_, ws_, sx_, sy_, st_ = (
        A[name] for name in HELD
    )
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns)}
    gap_, k_w_, room_, R_s_, arm_s_ = (
        P[name]
        for name in ("gap", "wall_stiffness", "clearance", "stabilizer_radius", "stabilizer_arm")
    )
    iml_, iJ_, q_, R_c_, bend_, soft_F_, soft_T_ = (
        P[name]
        for name in (
            "per_lateral_mass",
            "per_inertia",
            "unbalance_arm",
            "collar_radius",
            "bending",
            "softening_force",
            "softening_torque",
        )
    )
    eps_w_, tau_w_, rise_w_, mu_w_ = (
        P[f"wall_{name}"] for name in ("smoothing", "decay", "rise", "dynamic")
    )
    eps_s_, tau_s_, rise_s_, mu_s_ = (
        P[f"stabilizer_{name}"] for name in ("smoothing", "decay", "rise", "dynamic")
    )
    eps_b_, tau_b_, rise_b_, mu_b_ = (
        P[f"bit_{name}"] for name in ("smoothing", "decay", "rise", "dynamic")
    )
    places = (push_x_, push_y_, push_, vx_, vy_, speed_)

    @inlined
    def beside(free, own, across, free_other, back, normal, eps, tau, rise, mu):  # type: ignore[no-untyped-def]
        # The slip of one contact while the other one, of load ``normal``, slips as it
        # does where this one holds.
        there = free_other - back * free / max(own, 1e-300)
        f, _ = hyperbolic(there, eps, tau, rise, mu)
        return free - across * (normal * f)

    @inlined
    def corrected(b, i):  # type: ignore[no-untyped-def]
        omega, v_s, v_w = b[omega_ + i], b[held_ + i], b[rubbing_ + i]
        c_bb, c_bs, c_bw = b[bb_ + i], b[bs_ + i], b[bw_ + i]
        c_sb, c_ss, c_sw = b[sb_ + i], b[ss_ + i], b[sw_ + i]
        c_wb, c_ws, c_ww = b[wb_ + i], b[ws_ + i], b[ww_ + i]
        F, N = b[force_ + i], b[normal_ + i]
        arm, slope, g, dg, decayed, ddecayed = bit_rates(
            law, omega, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
        )
        torque, dT = F * arm, F * slope
        f_s, df_s = hyperbolic(v_s, b[eps_s_ + i], b[tau_s_ + i], b[rise_s_ + i], b[mu_s_ + i])
        f_w, df_w = hyperbolic(v_w, b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i])
        pressed = fma(-b[loss_ + i], torque, b[force_s_ + i])
        # what a unit of torque adds to the force
        lost = -b[loss_ + i] if pressed > 0.0 else b[loss_ + i]
        L_s, dL_s, L_sb, L_w, dL_w = (
            abs(pressed) * f_s,
            abs(pressed) * df_s,
            lost * f_s * dT,
            N * f_w,
            N * df_w,
        )
        rest_b = b[speed_ + i] - omega - fma(c_bb, torque, fma(c_bs, L_s, c_bw * L_w))
        rest_s = b[free_s_ + i] - v_s - fma(c_sb, torque, fma(c_ss, L_s, c_sw * L_w))
        rest_w = b[free_ + i] - v_w - fma(c_wb, torque, fma(c_ws, L_s, c_ww * L_w))
        a_bb, a_sb, a_wb = (
            fma(c_bb, dT, fma(c_bs, L_sb, 1.0)),
            fma(c_sb, dT, c_ss * L_sb),
            fma(c_wb, dT, c_ws * L_sb),
        )
        a_bs, a_ss, a_ws = c_bs * dL_s, fma(c_ss, dL_s, 1.0), c_ws * dL_s
        a_bw, a_sw, a_ww = c_bw * dL_w, c_sw * dL_w, fma(c_ww, dL_w, 1.0)
        # Cramer's rule, of cofactors of the first row.
        one, two, three = (
            fma(a_ss, a_ww, -(a_sw * a_ws)),
            fma(a_sw, a_wb, -(a_sb * a_ww)),
            fma(a_sb, a_ws, -(a_ss * a_wb)),
        )
        per = 1.0 / fma(a_bb, one, fma(a_bs, two, a_bw * three))
        mixed_w, mixed_s = fma(rest_s, a_ww, -(a_sw * rest_w)), fma(rest_s, a_ws, -(a_ss * rest_w))
        mixed = fma(a_sb, rest_w, -(rest_s * a_wb))
        step = fma(rest_b, one, fma(a_bw, mixed_s, -(a_bs * mixed_w))) * per
        step_s = fma(a_bb, mixed_w, fma(rest_b, two, a_bw * mixed)) * per
        step_w = fma(rest_b, three, -fma(a_bb, mixed_s, a_bs * mixed)) * per
        most_b = CLOSE * F * (b[rise_b_ + i] + b[mu_b_ + i])
        most_s = CLOSE * abs(pressed) * (b[rise_s_ + i] + b[mu_s_ + i])
        most_w = CLOSE * N * (b[rise_w_ + i] + b[mu_w_ + i])
        far = max(
            abs(rest_b)
            - fma(c_bb, most_b, fma(c_bs, most_s, fma(c_bw, most_w, 1e-14 * abs(b[speed_ + i])))),
            max(
                abs(rest_s)
                - fma(
                    abs(c_sb),
                    most_b,
                    fma(c_ss, most_s, fma(c_sw, most_w, 1e-14 * abs(b[free_s_ + i]))),
                ),
                abs(rest_w)
                - fma(
                    abs(c_wb),
                    most_b,
                    fma(c_ws, most_s, fma(c_ww, most_w, 1e-14 * abs(b[free_ + i]))),
                ),
            ),
        )
        return (
            omega,
            v_s,
            v_w,
            step,
            step_s,
            step_w,
            far,
            fma(dT, step, torque),
            fma(dL_s, step_s, fma(L_sb, step, L_s)),
            fma(dL_w, step_w, L_w),
            slope,
            fma(dg, step, g),
            fma(ddecayed, step, decayed),
        )

    @compiled(types.void(BUFFER), W, *options)
    def rub(b):  # type: ignore[no-untyped-def]
        for i in range(W):
            x, y, r, relax, q, c, s = (
                b[x_ + i],
                b[y_ + i],
                b[radius_ + i],
                b[relax_ + i],
                b[q_ + i],
                b[cosine_ + i],
                b[sine_ + i],
            )
            per_mass, per_inertia, R_c, R_s = b[iml_ + i], b[iJ_ + i], b[R_c_ + i], b[R_s_ + i]
            per_r = 1.0 / r
            normal = wall_force(r, b[gap_ + i], b[k_w_ + i], hertz)
            lever, length = b[room_ + i] * per_r, max(r - b[room_ + i], 0.0)
            wx, wy, turn_w = unit_friction(x, y, per_r, c, s, q, R_c, per_mass, per_inertia)
            ux, uy, turn_s = unit_friction(x, y, per_r, c, s, q, R_s, per_mass, per_inertia)
            bx, by, turn = b[push_x_ + i], b[push_y_ + i], b[push_ + i]
            # What each load takes from each slip, per unit: the slip of the collar's
            # centre around the hole, and omega.
            around_w, around_s = fma(x, wy, -(y * wx)) * per_r, fma(x, uy, -(y * ux)) * per_r
            around_b = fma(x, by, -(y * bx)) * per_r
            c_bb, c_bs, c_bw = -relax * turn, -relax * turn_s, -relax * turn_w
            K_ss, K_ww = -fma(lever, around_s, R_s * turn_s), -fma(R_c, turn_w, around_w)
            c_ss, c_sw = relax * K_ss, -relax * fma(lever, around_w, R_s * turn_w)
            c_ws, c_ww = -relax * fma(R_c, turn_s, around_s), relax * K_ww
            b[bb_ + i] = c_bb
            b[bs_ + i] = c_bs
            b[bw_ + i] = c_bw
            b[sb_ + i] = -relax * fma(lever, around_b, R_s * turn)
            b[ss_ + i] = c_ss
            b[sw_ + i] = c_sw
            b[wb_ + i] = -relax * fma(R_c, turn, around_b)
            b[ws_ + i] = c_ws
            b[ww_ + i] = c_ww
            b[wx_ + i] = wx
            b[wy_ + i] = wy
            b[wt_ + i] = turn_w
            b[sx_ + i] = ux
            b[sy_ + i] = uy
            b[st_ + i] = turn_s
            free = b[slip_ + i] * per_r
            free_s = fma(b[speed_ + i], fma(-R_c, lever, R_s), lever * free)
            b[free_ + i] = free
            b[free_s_ + i] = free_s
            b[normal_ + i] = normal
            held = fma(-b[soft_F_ + i], b[force_ + i], b[bend_ + i]) * length
            b[force_s_ + i] = held
            b[loss_ + i] = b[soft_T_ + i] * length
            falls_s = K_ss * abs(held) * (b[rise_s_ + i] * b[tau_s_ + i])
            b[falling_ + i] += fma(K_ww * normal, b[rise_w_ + i] * b[tau_w_ + i], falls_s)
        for i in range(W):
            normal, pressed = b[normal_ + i], abs(b[force_s_ + i])
            c_ss, c_sw, c_ws, c_ww = b[ss_ + i], b[sw_ + i], b[ws_ + i], b[ww_ + i]
            free, free_s = b[free_ + i], b[free_s_ + i]
            eps, tau, rise, mu = b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i]
            eps_s, tau_s, rise_s, mu_s = b[eps_s_ + i], b[tau_s_ + i], b[rise_s_ + i], b[mu_s_ + i]
            alone = beside(free, c_ww, c_ws, free_s, c_sw, pressed, eps_s, tau_s, rise_s, mu_s)
            alone_s = beside(free_s, c_ss, c_sw, free, c_ws, normal, eps, tau, rise, mu)
            slip = first_slip(alone, c_ww * normal, eps, tau, rise, mu)
            slip_s = first_slip(alone_s, c_ss * pressed, eps_s, tau_s, rise_s, mu_s)
            b[rubbing_ + i] = slip
            b[held_ + i] = slip_s
            f, _ = hyperbolic(slip, eps, tau, rise, mu)
            f_s, _ = hyperbolic(slip_s, eps_s, tau_s, rise_s, mu_s)
            free_b = b[speed_ + i] - fma(b[bs_ + i], pressed * f_s, b[bw_ + i] * normal * f)
            relaxed = b[bb_ + i] * b[force_ + i]
            b[omega_ + i] = first_speed(
                law, free_b, relaxed, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
            )
        for _ in range(MOST):
            some = 0
            for i in range(W):
                omega, v_s, v_w, step, step_s, step_w, far, _, _, _, _, _, _ = corrected(b, i)
                # a product, as a choice of stores would not be packed
                more = 1.0 if far > 0.0 else 0.0
                b[omega_ + i] = kept(omega, fma(more, step, omega))
                b[held_ + i] = kept(v_s, fma(more, step_s, v_s))
                b[rubbing_ + i] = kept(v_w, fma(more, step_w, v_w))
                some |= 1 if far > 0.0 else 0
            if some == 0:
                break
        for i in range(W):
            _, _, _, _, _, _, _, torque, friction_s, friction, slope, g, decayed = corrected(b, i)
            b[torque_ + i] = torque
            b[friction_ + i] = friction
            b[held_ + i] = friction_s
            b[slope_ + i] = slope
            b[direction_ + i] = g
            b[decay_ + i] = decayed
        for i in range(W):
            relax, torque, friction, friction_s = (
                b[relax_ + i],
                b[torque_ + i],
                b[friction_ + i],
                b[held_ + i],
            )
            push_x = fma(b[sx_ + i], friction_s, fma(b[wx_ + i], friction, b[push_x_ + i] * torque))
            push_y = fma(b[sy_ + i], friction_s, fma(b[wy_ + i], friction, b[push_y_ + i] * torque))
            push = fma(b[st_ + i], friction_s, fma(b[wt_ + i], friction, b[push_ + i] * torque))
            per_r = 1.0 / b[radius_ + i]
            b[bb_ + i] *= b[force_ + i]  # as without stabilisers
            b[radial_ + i] = (b[normal_ + i] + fma(-b[loss_ + i], torque, b[force_s_ + i])) * per_r
            b[tangential_ + i] = (friction + friction_s) * per_r
            b[friction_ + i] = fma(b[arm_s_ + i], friction_s, friction)
            push_on(b, i, places, relax, push_x, push_y, push)

    return rub
