"""Friction of bit and wall kept apart where the wall's acts along the hole too, in
lanes some of which touch.

The slip has two components, v_t around the hole and v_z along it, and one load N f(|v|)
that acts against it. Along the hole it meets another mass, and nothing couples there.
Of a stage that moves velocities by c times the push, with s = |v| and D_k = s + c K_kk
N f(s),

    v_t = (v_t* - c K_tb T) s / D_t,    v_z = v_z* s / D_z

so the slip is known with s, which is the root of sqrt((v_t* - c K_tb T)^2 + (v_z* D_t /
D_z)^2) = D_t; with one mass in place of two that is s + c K N f(s) = |v*|. Newton's
method solves it jointly with the equation of the bit (as :mod:`.apart` has it), in each
lane until that is done.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, Rows, compiled, inlined
from nsdrill.elementary import fma
from nsdrill.kernel.slip import first_slip, hyperbolic, kept
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.unit_loads import (
    FEW,
    bit_rates,
    first_speed,
    push_on,
    taken_around,
    unit_friction,
    wall_force,
)

# Auxiliary rows: slip along the hole without friction, and what friction takes from it.
ALONG = ("free_along", "zz")
MOST, CLOSE = 12, 1e-5  # iterations; of the loads, which one iteration more squares
LEAST = 1e-12  # m/s, of a slip that is divided by


@lru_cache
def make_along(
    lanes: int, options: Options, rows: Rows, columns: tuple[str, ...], aux: tuple[str, ...]
) -> Any:
    """The compiled ``rub(buffer)`` for a number of lanes and these options, after the
    part of :func:`.apart.make_solve` that concerns the bit alone."""
    W, law, hertz = lanes, options.friction, options.hertz
    x_, vx_, y_, vy_, _, vz_ = (W * (rows.stage + i) for i in range(6))
    speed_ = W * (rows.stage + 7)
    push_x_, push_y_, push_z_, push_ = (W * (rows.push + i) for i in range(4))
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
    omega_, size_, free_, normal_, bb_, bw_, wb_, ww_, wx_, wy_, wt_, slope_ = (
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
    free_z_, zz_ = (A[name] for name in ALONG)
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns)}
    gap_, k_w_, rate_, ima_ = (
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
    places = (push_x_, push_y_, push_, vx_, vy_, speed_)

    @inlined
    def corrected(b, i):  # type: ignore[no-untyped-def]
        omega, size, along = b[omega_ + i], b[size_ + i], b[free_z_ + i]
        c_bb, c_bw, c_wb, c_ww, c_zz = b[bb_ + i], b[bw_ + i], b[wb_ + i], b[ww_ + i], b[zz_ + i]
        arm, slope, g, dg, decayed, ddecayed = bit_rates(
            law, omega, b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
        )
        f, df = hyperbolic(size, b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i])
        D, D_z, dD = fma(c_ww, f, size), fma(c_zz, f, size), fma(c_ww, df, 1.0)
        per, per_z = 1.0 / D, 1.0 / D_z
        around, ratio = fma(-c_wb, arm, b[free_ + i]), D * per_z
        bent = fma(df, size, -f)
        # Shares of the load around the hole and along it, as they change with the size
        # of the slip.
        share, share_z = around * f * per, along * f * per_z
        dshare, dshare_z = around * bent * per * per, along * bent * per_z * per_z
        whole = max(np.sqrt(fma(around, around, along * along * ratio * ratio)), 1e-300)
        rest = b[speed_ + i] - fma(c_bw, share, fma(c_bb, arm, omega))
        rest_s = whole - D
        stretch = along * along * ratio * (c_ww - c_zz) * bent * per_z * per_z / whole
        a11, a12 = fma(fma(-c_bw * c_wb, f * per, c_bb), slope, 1.0), c_bw * dshare
        a21, a22 = around * c_wb * slope / whole, dD - stretch
        per_both = 1.0 / fma(a11, a22, -(a12 * a21))
        step = fma(a22, rest, -(a12 * rest_s)) * per_both
        step_s = fma(a11, rest_s, -(a21 * rest)) * per_both
        most_b = CLOSE * (b[rise_b_ + i] + b[mu_b_ + i])
        most = CLOSE * (b[rise_w_ + i] + b[mu_w_ + i])
        far = max(
            abs(rest) - fma(c_bb, most_b, fma(c_bw, most, 1e-14 * abs(b[speed_ + i]))),
            abs(rest_s) - fma(abs(c_wb), most_b, fma(c_ww, most, 1e-14 * whole)),
        )
        found = fma(dshare, step_s, fma(-c_wb * slope * f * per, step, share))
        return (
            omega,
            size,
            step,
            step_s,
            far,
            fma(slope, step, arm),
            found,
            fma(dshare_z, step_s, share_z),
            slope,
            fma(dg, step, g),
            fma(ddecayed, step, decayed),
        )

    @compiled(types.void(BUFFER), W, *options)
    def rub(b):  # type: ignore[no-untyped-def]
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
            ww = taken_around(x, y, per_r, R_c, wx, wy, turn_w) * normal
            wb = taken_around(x, y, per_r, R_c, bx, by, turn) * b[force_ + i]
            b[normal_ + i] = normal
            b[radial_ + i] = normal * per_r
            b[tangential_ + i] = per_r
            b[wx_ + i] = wx
            b[wy_ + i] = wy
            b[wt_ + i] = turn_w
            b[bw_ + i] = relax * (-(turn_w * normal))
            b[wb_ + i] = relax * wb
            b[free_ + i] = b[slip_ + i] * per_r
            b[free_z_ + i] = b[vz_ + i] - b[rate_ + i]
            b[ww_ + i] = relax * ww
            b[zz_ + i] = relax * (normal * b[ima_ + i])
            b[falling_ + i] = fma(
                max(ww, normal * b[ima_ + i]), b[rise_w_ + i] * b[tau_w_ + i], b[falling_ + i]
            )
        for i in range(W):
            free, along, c_ww, c_zz = b[free_ + i], b[free_z_ + i], b[ww_ + i], b[zz_ + i]
            eps, tau, rise, mu = b[eps_w_ + i], b[tau_w_ + i], b[rise_w_ + i], b[mu_w_ + i]
            steep = eps * (rise + mu)
            ratio = fma(c_ww, steep, 1.0) / fma(c_zz, steep, 1.0)  # as the collar holds
            size = first_slip(
                np.sqrt(fma(free, free, along * along * ratio * ratio)), c_ww, eps, tau, rise, mu
            )
            f, _ = hyperbolic(size, eps, tau, rise, mu)
            ratio = fma(c_ww, f, size + LEAST) / fma(c_zz, f, size + LEAST)  # as it slips
            size = first_slip(
                np.sqrt(fma(free, free, along * along * ratio * ratio)), c_ww, eps, tau, rise, mu
            )
            f, _ = hyperbolic(size, eps, tau, rise, mu)
            b[size_ + i] = max(size, LEAST)
            free_b = fma(-b[bw_ + i], free * f / (fma(c_ww, f, size) + LEAST), b[speed_ + i])
            b[omega_ + i] = first_speed(
                law, free_b, b[bb_ + i], b[eps_b_ + i], b[tau_b_ + i], b[rise_b_ + i], b[mu_b_ + i]
            )
        for _ in range(MOST):
            some = 0
            for i in range(W):
                omega, size, step, step_s, far, _, _, _, _, _, _ = corrected(b, i)
                # a product, as a choice of stores would not be packed
                more = 1.0 if far > 0.0 else 0.0
                b[omega_ + i] = kept(omega, fma(more, step, omega))
                b[size_ + i] = max(fma(more, step_s, size), LEAST)
                some |= 1 if far > 0.0 else 0
            if some == 0:
                break
        for i in range(W):
            _, _, _, _, _, arm, share, share_z, slope, g, decayed = corrected(b, i)
            b[torque_ + i] = b[force_ + i] * arm
            b[friction_ + i] = b[normal_ + i] * share
            b[slip_ + i] = b[normal_ + i] * share_z
            b[direction_ + i] = g
            b[decay_ + i] = decayed
            b[slope_ + i] = slope
        for i in range(W if W > FEW else min(W, len(b))):
            relax, torque, friction = b[relax_ + i], b[torque_ + i], b[friction_ + i]
            push_x = fma(b[wx_ + i], friction, b[push_x_ + i] * torque)
            push_y = fma(b[wy_ + i], friction, b[push_y_ + i] * torque)
            push = fma(b[wt_ + i], friction, b[push_ + i] * torque)
            push_z = -(b[slip_ + i] * b[ima_ + i])
            b[tangential_ + i] *= friction
            push_on(b, i, places, relax, push_x, push_y, push)
            b[push_z_ + i] = push_z
            b[vz_ + i] = fma(relax, push_z, b[vz_ + i])

    return rub
