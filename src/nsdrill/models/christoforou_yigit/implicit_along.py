"""The implicit friction of bit and wall, where friction at the wall acts along the
hole too, for lanes some of which touch.

The slip has two components, v_t around the hole and v_z along it, and one load N f(|v|)
acts against it. The axial component acts on the axial mass and is not coupled to the
other velocities. A stage that moves velocities by c times the push has, with s = |v|
and D_k = s + c K_kk N f(s),

    v_t = (v_t* - c K_tb T) s / D_t,    v_z = v_z* s / D_z

so s gives both components. It is the root of

    sqrt((v_t* - c K_tb T)^2 + (v_z* D_t / D_z)^2) = D_t

which is s + c K N f(s) = |v*| where both masses are equal. Newton's method solves it
jointly with the equation of the bit (:mod:`.implicit`); each lane iterates until it has
converged.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import Rows
from nsdrill.compiler.functions import BUFFER, compiled, inlined
from nsdrill.compiler.words import fma, packed
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.unit_loads import (
    apply_push,
    bit_law_rates,
    first_bit_speed,
    slip_deceleration,
    unit_friction,
    wall_force,
)

# Auxiliary rows: slip along the hole without friction, and c K_zz N.
AXIAL_AUX = ("free_axial_slip", "zz")
MAX_ITERATIONS, LOAD_TOLERANCE = 12, 1e-5  # the latter relative, of the loads; one more squares it
LEAST_SLIP = 1e-12  # m/s, a floor, as the equations divide by the slip


@lru_cache
def make_axial_solve(
    lanes: int, options: Options, rows: Rows, columns: tuple[str, ...], aux: tuple[str, ...]
) -> Any:
    """The compiled ``solve_touching(buffer)`` for a number of lanes and these options,
    which follows the part of :func:`.implicit.make_solve` that concerns the bit alone.
    A lane without contact takes as many iterations as there, or its bits would depend
    on its neighbours."""
    W, law, hertz = lanes, options.friction, options.hertz
    x_, vx_, y_, vy_, _, vz_ = (W * (rows.stage + i) for i in range(6))
    speed_ = W * (rows.stage + 7)
    push_x_, push_y_, push_z_, push_angular_ = (W * (rows.push + i) for i in range(4))
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
        size_,
        v_t_free_,
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
    v_z_free_, zz_ = (A[name] for name in AXIAL_AUX)
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns)}
    gap_, k_w_, rop_, ima_ = (
        P[name] for name in ("gap", "wall_stiffness", "penetration_rate", "per_axial_mass")
    )
    iml_, iJ_, q_, R_c_ = (
        P[name] for name in ("per_lateral_mass", "per_inertia", "unbalance_arm", "collar_radius")
    )
    eps_w_, tau_w_, rise_w_, mu_w_ = (
        P[f"wall_{name}"] for name in ("smoothing", "decay", "rise", "dynamic")
    )
    eps_b_, tau_b_, rise_b_, mu_b_ = (
        P[f"bit_{name}"] for name in ("smoothing", "decay", "rise", "dynamic")
    )
    push_rows = (push_x_, push_y_, push_angular_, vx_, vy_, speed_)

    @inlined
    def newton_step(b, i):  # type: ignore[no-untyped-def]
        omega, size, v_z_free = b[omega_ + i], b[size_ + i], b[v_z_free_ + i]
        c_bb, c_bw, c_wb, c_ww, c_zz = b[bb_ + i], b[bw_ + i], b[wb_ + i], b[ww_ + i], b[zz_ + i]
        arm, slope, g, dg, decayed, ddecayed = bit_law_rates(
            law, omega, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
        )
        f, df = hyperbolic(size, b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i])
        D, D_z, dD = fma(c_ww, f, size), fma(c_zz, f, size), fma(c_ww, df, 1.0)
        per, per_z = 1.0 / D, 1.0 / D_z
        v_t_loaded, ratio = fma(-c_wb, arm, b[v_t_free_ + i]), D * per_z
        share_numerator = fma(df, size, -f)
        # The components of f around the hole and along it, and their derivatives by the
        # size of the slip.
        share_t, share_z = v_t_loaded * f * per, v_z_free * f * per_z
        dshare, dshare_z = (
            v_t_loaded * share_numerator * per * per,
            v_z_free * share_numerator * per_z * per_z,
        )
        norm = max(
            np.sqrt(fma(v_t_loaded, v_t_loaded, v_z_free * v_z_free * ratio * ratio)), 1e-300
        )
        residual = b[speed_ + i] - fma(c_bw, share_t, fma(c_bb, arm, omega))
        residual_s = norm - D
        stretch = (
            v_z_free * v_z_free * ratio * (c_ww - c_zz) * share_numerator * per_z * per_z / norm
        )
        a11, a12 = fma(fma(-c_bw * c_wb, f * per, c_bb), slope, 1.0), c_bw * dshare
        a21, a22 = v_t_loaded * c_wb * slope / norm, dD - stretch
        per_det = 1.0 / fma(a11, a22, -(a12 * a21))
        step = fma(a22, residual, -(a12 * residual_s)) * per_det
        step_s = fma(a11, residual_s, -(a21 * residual)) * per_det
        tolerance_b = LOAD_TOLERANCE * (b[rise_b_ + i] + b[mu_b_ + i])
        tolerance = LOAD_TOLERANCE * (b[rise_w_ + i] + b[mu_w_ + i])
        excess = max(
            abs(residual)
            - fma(c_bb, tolerance_b, fma(c_bw, tolerance, 1e-14 * abs(b[speed_ + i]))),
            abs(residual_s) - fma(abs(c_wb), tolerance_b, fma(c_ww, tolerance, 1e-14 * norm)),
        )
        new_share = fma(dshare, step_s, fma(-c_wb * slope * f * per, step, share_t))
        return (
            omega,
            size,
            step,
            step_s,
            excess,
            fma(slope, step, arm),
            new_share,
            fma(dshare_z, step_s, share_z),
            slope,
            fma(dg, step, g),
            fma(ddecayed, step, decayed),
        )

    @compiled(BUFFER)
    def solve_touching(b):  # type: ignore[no-untyped-def]
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
            ww = slip_deceleration(x, y, per_r, R_c, wx, wy, angular_w) * normal
            wb = slip_deceleration(x, y, per_r, R_c, bx, by, angular) * b[force_ + i]
            b[normal_ + i] = normal
            b[radial_ + i] = normal * per_r
            b[tangential_ + i] = per_r
            b[unit_x_ + i] = wx
            b[unit_y_ + i] = wy
            b[unit_angular_ + i] = angular_w
            b[bw_ + i] = relax * (-(angular_w * normal))
            b[wb_ + i] = relax * wb
            b[v_t_free_ + i] = b[slip_ + i] * per_r
            b[v_z_free_ + i] = b[vz_ + i] - b[rop_ + i]
            b[ww_ + i] = relax * ww
            b[zz_ + i] = relax * (normal * b[ima_ + i])
            b[falling_ + i] = fma(
                max(ww, normal * b[ima_ + i]), b[rise_w_ + i] * b[tau_w_ + i], b[falling_ + i]
            )
        for i in packed(W):
            v_t_free, v_z_free, c_ww, c_zz = (
                b[v_t_free_ + i],
                b[v_z_free_ + i],
                b[ww_ + i],
                b[zz_ + i],
            )
            eps, tau, rise, mu = b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i]
            stiffness = eps * (rise + mu)
            ratio = fma(c_ww, stiffness, 1.0) / fma(c_zz, stiffness, 1.0)  # of a collar that sticks
            size = first_slip(
                np.sqrt(fma(v_t_free, v_t_free, v_z_free * v_z_free * ratio * ratio)),
                c_ww,
                eps,
                tau,
                rise,
                mu,
            )
            f, _ = hyperbolic(size, eps, tau, rise, mu)
            ratio = fma(c_ww, f, size + LEAST_SLIP) / fma(
                c_zz, f, size + LEAST_SLIP
            )  # of one that slips
            size = first_slip(
                np.sqrt(fma(v_t_free, v_t_free, v_z_free * v_z_free * ratio * ratio)),
                c_ww,
                eps,
                tau,
                rise,
                mu,
            )
            f, _ = hyperbolic(size, eps, tau, rise, mu)
            b[size_ + i] = max(size, LEAST_SLIP)
            free_b = fma(
                -b[bw_ + i], v_t_free * f / (fma(c_ww, f, size) + LEAST_SLIP), b[speed_ + i]
            )
            b[omega_ + i] = first_bit_speed(
                law, free_b, b[bb_ + i], b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
            )
        for iteration in range(MAX_ITERATIONS):
            any_unfinished, first = 0, 1.0 if iteration == 0 else 0.0
            for i in packed(W):
                omega, size, step, step_s, excess, _, _, _, _, _, _ = newton_step(b, i)
                # a product, as conditional stores would not be packed
                unfinished = 1.0 if excess > 0.0 else 0.0
                touches = b[radius_ + i] > b[gap_ + i]
                iterates = unfinished if touches else first
                b[omega_ + i] = kept(omega, fma(iterates, step, omega))
                b[size_ + i] = max(fma(iterates, step_s, size), LEAST_SLIP)
                any_unfinished |= 1 if (excess > 0.0) & touches else 0
            if any_unfinished == 0:
                break
        for i in packed(W):
            _, _, _, _, _, arm, share_t, share_z, slope, g, decayed = newton_step(b, i)
            b[torque_ + i] = b[force_ + i] * arm
            b[friction_ + i] = b[normal_ + i] * share_t
            b[slip_ + i] = b[normal_ + i] * share_z
            b[direction_ + i] = g
            b[decay_ + i] = decayed
            b[slope_ + i] = slope
        for i in packed(W):
            relax, torque, friction = b[relax_ + i], b[torque_ + i], b[friction_ + i]
            push_x = fma(b[unit_x_ + i], friction, b[push_x_ + i] * torque)
            push_y = fma(b[unit_y_ + i], friction, b[push_y_ + i] * torque)
            push_angular = fma(b[unit_angular_ + i], friction, b[push_angular_ + i] * torque)
            push_z = -(b[slip_ + i] * b[ima_ + i])
            b[tangential_ + i] *= friction
            apply_push(b, i, push_rows, relax, push_x, push_y, push_angular)
            b[push_z_ + i] = push_z
            b[vz_ + i] = fma(relax, push_z, b[vz_ + i])

    return solve_touching
