"""The implicit friction of bit, stabilisers and wall, for lanes some of whose
stabilisers touch.

Stabilisers and wall brake the same mass, at slips v_s = omega R_s + theta' s0 and v_w =
omega R_c + theta' r that are nearly equal where the collar whirls. The three slips and
loads of a stage that moves velocities by c times the push satisfy

    v_i = v_i* - c (K_ib T(omega) + K_is N_s f(v_s) + K_iw N_w f(v_w)),   i = b, s, w,
    N_s = |k_0 - k_T T| max(r - s0, 0)

as :mod:`.implicit` has it for two. As the two contacts hardly differ, usually one sticks
while the other slips, and Newton's method needs a good initial guess: the slip of each
contact with the load that the other has while this one sticks. Each lane iterates until
it has converged; its result does not depend on the neighbouring lanes.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from nsdrill.abi import Rows
from nsdrill.compiler.functions import BUFFER, compiled, inlined
from nsdrill.compiler.words import fma, packed
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.unit_loads import (
    apply_push,
    bit_law_rates,
    first_bit_speed,
    unit_friction,
    wall_force,
)

# Auxiliary rows: slip at the stabilisers, an unknown of the solve, and without
# friction; the force there without bit torque and its decrease by a unit of torque; c K
# of slips and loads; accelerations by a unit of friction there.
STABILIZER_AUX = (
    "solved_stabilizer_slip",
    "free_stabilizer_slip",
    "stabilizer_force",
    "stabilizer_force_loss",
    "bs",
    "sb",
    "ss",
    "sw",
    "ws",
    "stabilizer_unit_x",
    "stabilizer_unit_y",
    "stabilizer_unit_angular",
)
MAX_ITERATIONS = 12  # iterations
LOAD_TOLERANCE = 1e-5  # relative, of the loads; one more iteration squares it


@lru_cache
def make_stabilizer_solve(
    lanes: int, options: Options, rows: Rows, columns: tuple[str, ...], aux: tuple[str, ...]
) -> Any:
    """The compiled ``solve_touching(buffer)`` for a number of lanes and these options,
    which follows the part of :func:`.implicit.make_solve` that concerns the bit alone.
    A lane without contact takes as many iterations as there, or its bits would depend
    on its neighbours."""
    W, law, hertz = lanes, options.friction, options.hertz
    x_, vx_, y_, vy_ = (W * (rows.stage + i) for i in range(4))
    speed_ = W * (rows.stage + 7)
    push_x_, push_y_, push_angular_ = (W * (rows.push + i) for i in range(3))
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
    ) = (
        A[name]
        for name in (
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
        )
    )
    v_s_, v_s_free_, force_s_, loss_, bs_, sb_, ss_, sw_, ws_, sx_, sy_, st_ = (
        A[name] for name in STABILIZER_AUX
    )
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns)}
    gap_, k_w_, clearance_, R_s_, arm_s_ = (
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
    push_rows = (push_x_, push_y_, push_angular_, vx_, vy_, speed_)

    @inlined
    def free_slip_beside(free, c_ii, c_io, free_other, c_oi, normal, eps, tau, rise, mu):  # type: ignore[no-untyped-def]
        # The slip of contact i without its own friction, while the other contact o,
        # with this normal force and law, slips as it does where contact i sticks; the
        # c_ij are c K.
        slip_other = free_other - c_oi * free / max(c_ii, 1e-300)
        f, _ = hyperbolic(slip_other, eps, tau, rise, mu)
        return free - c_io * (normal * f)

    @inlined
    def newton_step(b, i):  # type: ignore[no-untyped-def]
        omega, v_s, v_w = b[omega_ + i], b[v_s_ + i], b[v_w_ + i]
        c_bb, c_bs, c_bw = b[bb_ + i], b[bs_ + i], b[bw_ + i]
        c_sb, c_ss, c_sw = b[sb_ + i], b[ss_ + i], b[sw_ + i]
        c_wb, c_ws, c_ww = b[wb_ + i], b[ws_ + i], b[ww_ + i]
        F, N = b[force_ + i], b[normal_ + i]
        arm, slope, g, dg, decayed, ddecayed = bit_law_rates(
            law, omega, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
        )
        torque, dT = F * arm, F * slope
        f_s, df_s = hyperbolic(v_s, b[eps_s_ + i], b[tau_s_ + i], b[rise_s_ + i], b[mu_s_ + i])
        f_w, df_w = hyperbolic(v_w, b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i])
        force_s = fma(-b[loss_ + i], torque, b[force_s_ + i])
        # the change of its size with a unit of torque
        dforce_s = -b[loss_ + i] if force_s > 0.0 else b[loss_ + i]
        L_s, dL_s, L_sb, L_w, dL_w = (
            abs(force_s) * f_s,
            abs(force_s) * df_s,
            dforce_s * f_s * dT,
            N * f_w,
            N * df_w,
        )
        residual_b = b[speed_ + i] - omega - fma(c_bb, torque, fma(c_bs, L_s, c_bw * L_w))
        residual_s = b[v_s_free_ + i] - v_s - fma(c_sb, torque, fma(c_ss, L_s, c_sw * L_w))
        residual_w = b[v_w_free_ + i] - v_w - fma(c_wb, torque, fma(c_ws, L_s, c_ww * L_w))
        a_bb, a_sb, a_wb = (
            fma(c_bb, dT, fma(c_bs, L_sb, 1.0)),
            fma(c_sb, dT, c_ss * L_sb),
            fma(c_wb, dT, c_ws * L_sb),
        )
        a_bs, a_ss, a_ws = c_bs * dL_s, fma(c_ss, dL_s, 1.0), c_ws * dL_s
        a_bw, a_sw, a_ww = c_bw * dL_w, c_sw * dL_w, fma(c_ww, dL_w, 1.0)
        # Cramer's rule, with the cofactors of the first row.
        cofactor_b, cofactor_s, cofactor_w = (
            fma(a_ss, a_ww, -(a_sw * a_ws)),
            fma(a_sw, a_wb, -(a_sb * a_ww)),
            fma(a_sb, a_ws, -(a_ss * a_wb)),
        )
        per_det = 1.0 / fma(a_bb, cofactor_b, fma(a_bs, cofactor_s, a_bw * cofactor_w))
        det_w, det_s = (
            fma(residual_s, a_ww, -(a_sw * residual_w)),
            fma(residual_s, a_ws, -(a_ss * residual_w)),
        )
        det_b = fma(a_sb, residual_w, -(residual_s * a_wb))
        step = fma(residual_b, cofactor_b, fma(a_bw, det_s, -(a_bs * det_w))) * per_det
        step_s = fma(a_bb, det_w, fma(residual_b, cofactor_s, a_bw * det_b)) * per_det
        step_w = fma(residual_b, cofactor_w, -fma(a_bb, det_s, a_bs * det_b)) * per_det
        tolerance_b = LOAD_TOLERANCE * F * (b[rise_b_ + i] + b[mu_b_ + i])
        tolerance_s = LOAD_TOLERANCE * abs(force_s) * (b[rise_s_ + i] + b[mu_s_ + i])
        tolerance_w = LOAD_TOLERANCE * N * (b[rise_w_ + i] + b[mu_w_ + i])
        excess = max(
            abs(residual_b)
            - fma(
                c_bb,
                tolerance_b,
                fma(c_bs, tolerance_s, fma(c_bw, tolerance_w, 1e-14 * abs(b[speed_ + i]))),
            ),
            max(
                abs(residual_s)
                - fma(
                    abs(c_sb),
                    tolerance_b,
                    fma(c_ss, tolerance_s, fma(c_sw, tolerance_w, 1e-14 * abs(b[v_s_free_ + i]))),
                ),
                abs(residual_w)
                - fma(
                    abs(c_wb),
                    tolerance_b,
                    fma(c_ws, tolerance_s, fma(c_ww, tolerance_w, 1e-14 * abs(b[v_w_free_ + i]))),
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
            excess,
            fma(dT, step, torque),
            fma(dL_s, step_s, fma(L_sb, step, L_s)),
            fma(dL_w, step_w, L_w),
            slope,
            fma(dg, step, g),
            fma(ddecayed, step, decayed),
        )

    @compiled(BUFFER)
    def solve_touching(b):  # type: ignore[no-untyped-def]
        for i in packed(W):
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
            lever, bent = b[clearance_ + i] * per_r, max(r - b[clearance_ + i], 0.0)
            wx, wy, angular_w = unit_friction(x, y, per_r, c, s, q, R_c, per_mass, per_inertia)
            sx, sy, angular_s = unit_friction(x, y, per_r, c, s, q, R_s, per_mass, per_inertia)
            bx, by, angular = b[push_x_ + i], b[push_y_ + i], b[push_angular_ + i]
            # The decrease of each slip by each load, per unit: the parts of the
            # collar's centre around the hole, and of omega.
            around_w, around_s = fma(x, wy, -(y * wx)) * per_r, fma(x, sy, -(y * sx)) * per_r
            around_b = fma(x, by, -(y * bx)) * per_r
            c_bb, c_bs, c_bw = -relax * angular, -relax * angular_s, -relax * angular_w
            K_ss, K_ww = -fma(lever, around_s, R_s * angular_s), -fma(R_c, angular_w, around_w)
            c_ss, c_sw = relax * K_ss, -relax * fma(lever, around_w, R_s * angular_w)
            c_ws, c_ww = -relax * fma(R_c, angular_s, around_s), relax * K_ww
            b[bb_ + i] = c_bb
            b[bs_ + i] = c_bs
            b[bw_ + i] = c_bw
            b[sb_ + i] = -relax * fma(lever, around_b, R_s * angular)
            b[ss_ + i] = c_ss
            b[sw_ + i] = c_sw
            b[wb_ + i] = -relax * fma(R_c, angular, around_b)
            b[ws_ + i] = c_ws
            b[ww_ + i] = c_ww
            b[unit_x_ + i] = wx
            b[unit_y_ + i] = wy
            b[unit_angular_ + i] = angular_w
            b[sx_ + i] = sx
            b[sy_ + i] = sy
            b[st_ + i] = angular_s
            v_w_free = b[slip_ + i] * per_r
            v_s_free = fma(b[speed_ + i], fma(-R_c, lever, R_s), lever * v_w_free)
            b[v_w_free_ + i] = v_w_free
            b[v_s_free_ + i] = v_s_free
            b[normal_ + i] = normal
            force_s = fma(-b[soft_F_ + i], b[force_ + i], b[bend_ + i]) * bent
            b[force_s_ + i] = force_s
            b[loss_ + i] = b[soft_T_ + i] * bent
            falling_s = K_ss * abs(force_s) * (b[rise_s_ + i] * b[tau_s_ + i])
            b[falling_ + i] += fma(K_ww * normal, b[rise_w_ + i] * b[tau_w_ + i], falling_s)
        for i in packed(W):
            normal, normal_s = b[normal_ + i], abs(b[force_s_ + i])
            c_ss, c_sw, c_ws, c_ww = b[ss_ + i], b[sw_ + i], b[ws_ + i], b[ww_ + i]
            v_w_free, v_s_free = b[v_w_free_ + i], b[v_s_free_ + i]
            eps, tau, rise, mu = b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i]
            eps_s, tau_s, rise_s, mu_s = b[eps_s_ + i], b[tau_s_ + i], b[rise_s_ + i], b[mu_s_ + i]
            v_w_alone = free_slip_beside(
                v_w_free, c_ww, c_ws, v_s_free, c_sw, normal_s, eps_s, tau_s, rise_s, mu_s
            )
            v_s_alone = free_slip_beside(
                v_s_free, c_ss, c_sw, v_w_free, c_ws, normal, eps, tau, rise, mu
            )
            v_w = first_slip(v_w_alone, c_ww * normal, eps, tau, rise, mu)
            v_s = first_slip(v_s_alone, c_ss * normal_s, eps_s, tau_s, rise_s, mu_s)
            b[v_w_ + i] = v_w
            b[v_s_ + i] = v_s
            f, _ = hyperbolic(v_w, eps, tau, rise, mu)
            f_s, _ = hyperbolic(v_s, eps_s, tau_s, rise_s, mu_s)
            free_b = b[speed_ + i] - fma(b[bs_ + i], normal_s * f_s, b[bw_ + i] * normal * f)
            relaxed = b[bb_ + i] * b[force_ + i]
            b[omega_ + i] = first_bit_speed(
                law, free_b, relaxed, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
            )
        for iteration in range(MAX_ITERATIONS):
            any_unfinished, first = 0, 1.0 if iteration == 0 else 0.0
            for i in packed(W):
                omega, v_s, v_w, step, step_s, step_w, excess, _, _, _, _, _, _ = newton_step(b, i)
                # a product, as conditional stores would not be packed
                unfinished = 1.0 if excess > 0.0 else 0.0
                touches = b[radius_ + i] > b[clearance_ + i]
                iterates = unfinished if touches else first
                b[omega_ + i] = kept(omega, fma(iterates, step, omega))
                b[v_s_ + i] = kept(v_s, fma(iterates, step_s, v_s))
                b[v_w_ + i] = kept(v_w, fma(iterates, step_w, v_w))
                any_unfinished |= 1 if (excess > 0.0) & touches else 0
            if any_unfinished == 0:
                break
        for i in packed(W):
            _, _, _, _, _, _, _, torque, friction_s, friction, slope, g, decayed = newton_step(b, i)
            b[torque_ + i] = torque
            b[friction_ + i] = friction
            b[v_s_ + i] = friction_s
            b[slope_ + i] = slope
            b[direction_ + i] = g
            b[decay_ + i] = decayed
        for i in packed(W):
            relax, torque, friction, friction_s = (
                b[relax_ + i],
                b[torque_ + i],
                b[friction_ + i],
                b[v_s_ + i],
            )
            push_x = fma(
                b[sx_ + i], friction_s, fma(b[unit_x_ + i], friction, b[push_x_ + i] * torque)
            )
            push_y = fma(
                b[sy_ + i], friction_s, fma(b[unit_y_ + i], friction, b[push_y_ + i] * torque)
            )
            push_angular = fma(
                b[st_ + i],
                friction_s,
                fma(b[unit_angular_ + i], friction, b[push_angular_ + i] * torque),
            )
            per_r = 1.0 / b[radius_ + i]
            b[bb_ + i] *= b[force_ + i]  # as without stabilisers
            b[radial_ + i] = (b[normal_ + i] + fma(-b[loss_ + i], torque, b[force_s_ + i])) * per_r
            b[tangential_ + i] = (friction + friction_s) * per_r
            b[friction_ + i] = fma(b[arm_s_ + i], friction_s, friction)
            apply_push(b, i, push_rows, relax, push_x, push_y, push_angular)

    return solve_touching
