"""The tangent dynamics: the growth of a small deviation from a trajectory, for Lyapunov
exponents.

The deviation has a component for each state and follows the linearised equations of
motion along the trajectory. It is integrated with the trajectory as tangent states
(:class:`nsdrill.abi.Rows`), in the same steps and stages. Where the bit or the collar
touches, the Jacobian jumps but not the vector field; a deviation therefore passes
through a contact without a jump (the saltation matrix is the identity: di Bernardo et
al., Piecewise-smooth Dynamical Systems, 2008, chapter 2). Within a step each contact
is as at the step's start; a step in which a contact changes is repeated for the
deviation (:mod:`nsdrill.observe.landing`).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import RATES
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.compiler.words import fma, packed
from nsdrill.models.christoforou_yigit.friction import bit_slope, coefficient, slip_factors
from nsdrill.models.christoforou_yigit.implicit import make_deviation
from nsdrill.models.christoforou_yigit.lateral import SWIRL_PARAMETERS, WEIGHT_PARAMETERS
from nsdrill.models.christoforou_yigit.lobes import multiple_cosine, multiple_sine
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.rhs import (
    AUX,
    DRIVE_PARAMETERS,
    PARAMETERS,
    REGULATOR_PARAMETERS,
    STATES,
    aux_of,
    columns_of,
    make_right_hand_side,
    rows_of,
    states_of,
)
from nsdrill.models.differences import make_differences

CONTACTS = ("rock", "wall")  # each has a function that is positive where it touches


@lru_cache
def make_tangent(lanes: int, options: Options, place: int) -> Any:
    """The compiled right-hand side of the motion and of one deviation from it.

    The deviation follows the states, in their order, and its accelerations follow those
    of the states. The functions of the contacts at the start of the step are among the
    observer's rows, from ``place`` on. With stabilisers, or with friction along the
    axis, the slopes of the deviation are a difference of two right-hand sides
    (:mod:`nsdrill.models.differences`).
    """
    rows = rows_of(options, tangent=True)
    if options.differenced:
        motion = make_right_hand_side(lanes, options, tangent=True)
        force, radius = (rows.aux_now + AUX.index(name) for name in ("force", "radius"))
        gap = rows.parameter + columns_of(options).index("gap")
        return make_differences(
            motion,
            lanes,
            rows,
            rows.aux_now + len(aux_of(options)),
            *options,
            place,
            touches=((force, -1), (radius, gap)),
            place=place,
        )
    W, state_count, hertz, lobes, driven = (
        lanes,
        len(states_of(options)),
        options.hertz,
        options.lobes,
        options.driven,
    )
    law_of_bit = options.friction
    x_, vx_, y_, vy_, _, _, _, speed_ = (W * (rows.stage + i) for i in range(8))
    dx_, dvx_, dy_, dvy_, dz_, dvz_, dtwist_, dspeed_ = (
        W * (rows.stage + state_count + i) for i in range(8)
    )
    alpha_ = W * (rows.acceleration + 3)
    dax_, day_, daz_, dalpha_ = (W * (rows.acceleration + state_count // 2 + i) for i in range(4))
    # The rows of the drive; an ideal one has none.
    dlag_, domega_d_ = (W * (rows.stage + state_count + i) for i in (8, 9))
    dalpha_d_ = W * (rows.acceleration + state_count // 2 + 4)
    iJ_d_, K_i_, K_p_, G_t_, G_w_, c_s_, torque_limit_ = (
        W * (rows.parameter + len(PARAMETERS) + i) for i in range(7)
    )
    twist_, lag_, omega_d_ = (W * (rows.stage + i) for i in (6, 8, 9))
    dT_m_, dT_m_rate_ = (
        W * (rows.stage + state_count + 11),
        W * (rows.acceleration + state_count // 2 + 5),
    )
    motor_damping_, per_time_ = (
        W * (rows.parameter + len(PARAMETERS) + len(DRIVE_PARAMETERS) + i) for i in range(2)
    )
    motor, regulated = options.motor, options.regulated
    limited, set_speed_ = options.limited, W * (rows.parameter + PARAMETERS.index("drive_speed"))
    # The auxiliary outputs of the right-hand side that no observer reads are
    # overwritten by their deviations.
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
    ) = (W * (rows.aux_now + i) for i in range(len(AUX)))
    P = {name: W * (rows.parameter + i) for i, name in enumerate(columns_of(options))}
    _, _, g_T_, g_lag_, g_drive_, g_twist_, g_speed_ = (
        P.get(name, 0) for name in REGULATOR_PARAMETERS
    )
    swirl, weight = options.swirl, options.weight
    sigma_, momentum_ = (P.get(name, 0) for name in SWIRL_PARAMETERS)
    weight_, eccentric_ = (P.get(name, 0) for name in WEIGHT_PARAMETERS)
    iml_, iJ_, ima_, q_ = (
        P["per_lateral_mass"],
        P["per_inertia"],
        P["per_axial_mass"],
        P["unbalance_arm"],
    )
    bend_, soft_F_, soft_T_, drag_ = (
        P["bending"],
        P["softening_force"],
        P["softening_torque"],
        P["drag"],
    )
    c_a_, k_a_, c_t_, k_t_ = (
        P["axial_damping"],
        P["axial_stiffness"],
        P["torsional_damping"],
        P["torsional_stiffness"],
    )
    gap_, k_w_, R_c_ = P["gap"], P["wall_stiffness"], P["collar_radius"]
    eps_w_, tau_w_, rise_w_, mu_w_ = (
        P["wall_smoothing"],
        P["wall_decay"],
        P["wall_rise"],
        P["wall_dynamic"],
    )
    k_c_, s0_ = P["rock_stiffness"], P["surface_amplitude"]
    eps_b_, tau_b_, rise_b_, mu_b_ = (
        P["bit_smoothing"],
        P["bit_decay"],
        P["bit_rise"],
        P["bit_dynamic"],
    )
    rock_, wall_ = (W * (rows.observer + place + RATES * c) for c in range(len(CONTACTS)))
    motion = make_right_hand_side(lanes, options, tangent=True)
    implicit, aux = options.implicit, aux_of(options)
    deviate = (
        make_deviation(lanes, options, rows, columns_of(options), aux, place) if implicit else None
    )
    slope_b_, slope_w_, coefficient_ = (
        W * (rows.aux_now + aux.index(name)) if implicit else 0
        for name in ("slope", "slope_w", "coefficient")
    )

    @compiled(BUFFER)
    def tangent(b):  # type: ignore[no-untyped-def]
        motion(b)
        if implicit:
            deviate(b)

        # Deviations of the loads of the bit, and of the lateral forces without the
        # changes at the wall. They are stored in the rows of the accelerations that
        # they enter. The row of the bit force takes the lateral force along the
        # eccentricity, whose moment changes as the bit rotates.
        touching = 0
        for i in packed(W):
            x, vx, y, vy, omega = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i], b[speed_ + i]
            dx, dvx, dy, dvy, domega = (
                b[dx_ + i],
                b[dvx_ + i],
                b[dy_ + i],
                b[dvy_ + i],
                b[dspeed_ + i],
            )
            force, torque = b[force_ + i], b[torque_ + i]
            surface = b[s0_ + i] * lobes * multiple_cosine(b[cosine_ + i], lobes)
            dforce = (
                b[k_c_ + i] * fma(surface, b[dtwist_ + i], -b[dz_ + i])
                if b[rock_ + i] > 0.0
                else 0.0
            )
            g, decayed = b[direction_ + i], b[decay_ + i]
            scaled = b[eps_b_ + i] * omega
            arm, darm = bit_slope(
                law_of_bit,
                omega,
                g,
                decayed,
                1.0 / fma(scaled, scaled, 1.0),
                b[eps_b_ + i],
                b[tau_b_ + i],
                b[rise_b_ + i],
                b[mu_b_ + i],
            )
            if implicit:  # the slope with which the loads were solved for
                darm = b[slope_b_ + i]
            dtorque = fma(dforce, arm, force * darm * domega)

            ux, uy, dux, duy = vx, vy, dvx, dvy
            if swirl:  # relative to the mud
                sigma = b[sigma_ + i]
                ux, uy, dux, duy = (
                    fma(sigma, y, vx),
                    fma(-sigma, x, vy),
                    fma(sigma, dy, dvx),
                    fma(-sigma, dx, dvy),
                )
            speed = np.sqrt(fma(ux, ux, uy * uy))
            along = fma(ux, dux, uy * duy) / max(speed, 1e-30)
            drag = b[drag_ + i]
            stiffness = (
                fma(-b[soft_F_ + i], force, fma(-b[soft_T_ + i], torque, b[bend_ + i]))
                + b[radial_ + i]
            )
            dstiffness = -fma(b[soft_F_ + i], dforce, b[soft_T_ + i] * dtorque)
            tangential = b[tangential_ + i]
            b[dax_ + i] = fma(
                tangential,
                dy,
                -fma(stiffness, dx, fma(dstiffness, x, drag * fma(speed, dux, along * ux))),
            )
            b[day_ + i] = -fma(
                tangential,
                dx,
                fma(stiffness, dy, fma(dstiffness, y, drag * fma(speed, duy, along * uy))),
            )
            b[daz_ + i] = dforce
            b[dalpha_ + i] = dtorque
            F_x = fma(tangential, y, -fma(stiffness, x, drag * speed * ux))
            F_y = -fma(tangential, x, fma(stiffness, y, drag * speed * uy))
            if swirl:
                momentum, sigma = b[momentum_ + i], b[sigma_ + i]
                b[dax_ + i] = fma(momentum, fma(sigma, dx, -2.0 * dvy), b[dax_ + i])
                b[day_ + i] = fma(momentum, fma(sigma, dy, 2.0 * dvx), b[day_ + i])
                F_x = fma(momentum, fma(sigma, x, -2.0 * vy), F_x)
                F_y = fma(momentum, fma(sigma, y, 2.0 * vx), F_y)
            if weight:
                F_y = F_y - b[weight_ + i]
            b[force_ + i] = fma(F_x, b[cosine_ + i], F_y * b[sine_ + i])
            touching |= 1 if b[wall_ + i] > 0.0 else 0

        # The wall: deviations of normal force over radius, of friction over radius, and
        # of friction itself.
        if touching != 0:
            for i in packed(W):
                x, vx, y, vy = b[x_ + i], b[vx_ + i], b[y_ + i], b[vy_ + i]
                dx, dvx, dy, dvy, domega = (
                    b[dx_ + i],
                    b[dvx_ + i],
                    b[dy_ + i],
                    b[dvy_ + i],
                    b[dspeed_ + i],
                )
                r = b[radius_ + i]
                penetration = max(r - b[gap_ + i], 0.0)
                root = np.sqrt(penetration) if hertz else 1.0
                normal = b[k_w_ + i] * penetration * root
                g, decayed, per_r = slip_factors(b[slip_ + i], r, b[eps_w_ + i], b[tau_w_ + i])
                dr = fma(x, dx, y * dy) * per_r
                dnormal = (1.5 if hertz else 1.0) * b[k_w_ + i] * root * dr
                around = fma(x, vy, -(y * vx)) * per_r
                daround = (fma(dx, vy, x * dvy) - fma(dy, vx, y * dvx) - around * dr) * per_r
                slip = b[slip_ + i] * per_r
                dslip = fma(domega, b[R_c_ + i], daround)
                scaled = b[eps_w_ + i] * slip
                mu, dmu = coefficient(
                    slip,
                    g,
                    decayed,
                    1.0 / fma(scaled, scaled, 1.0),
                    b[eps_w_ + i],
                    b[tau_w_ + i],
                    b[rise_w_ + i],
                    b[mu_w_ + i],
                )
                if implicit:
                    mu = b[coefficient_ + i] if penetration > 0.0 else mu
                    dmu = b[slope_w_ + i] if penetration > 0.0 else dmu
                dfriction = fma(dnormal, mu, normal * dmu * dslip)
                is_touching = b[wall_ + i] > 0.0
                b[radial_ + i] = (dnormal - normal * per_r * dr) * per_r if is_touching else 0.0
                b[tangential_ + i] = (
                    (dfriction - b[friction_ + i] * per_r * dr) * per_r if is_touching else 0.0
                )
                b[friction_ + i] = dfriction if is_touching else 0.0
        else:
            for i in packed(W):
                b[radial_ + i] = 0.0
                b[tangential_ + i] = 0.0
                b[friction_ + i] = 0.0

        # The accelerations, as in the last loop of the right-hand side.
        for i in packed(W):
            x, y, omega, alpha = b[x_ + i], b[y_ + i], b[speed_ + i], b[alpha_ + i]
            c, s, q, domega, dphi = (
                b[cosine_ + i],
                b[sine_ + i],
                b[q_ + i],
                b[dspeed_ + i],
                b[dtwist_ + i],
            )
            dradial, dtangential = b[radial_ + i], b[tangential_ + i]
            dF_x = fma(dtangential, y, fma(-dradial, x, b[dax_ + i]))
            dF_y = fma(-dtangential, x, fma(-dradial, y, b[day_ + i]))
            dtorque, dpipe = b[dalpha_ + i], dphi
            if driven:
                dlag, domega_d = b[dlag_ + i], b[domega_d_ + i]
                dpipe = dphi - dlag
                dshaft_torque = b[c_s_ + i] * (domega_d - domega)
                minus_dT_m = fma(
                    b[K_i_ + i],
                    dlag,
                    fma(b[K_p_ + i], domega_d, fma(b[G_t_ + i], dpipe, b[G_w_ + i] * domega)),
                )
                if motor:
                    minus_dT_m = -b[dT_m_ + i]
                    b[dT_m_rate_ + i] = (
                        fma(b[motor_damping_ + i], -domega_d, minus_dT_m) * b[per_time_ + i]
                    )
                    if regulated:
                        dfeedback = fma(
                            b[g_lag_ + i],
                            dlag,
                            fma(b[g_drive_ + i], domega_d, b[g_speed_ + i] * domega),
                        )
                        dfeedback = fma(
                            b[g_T_ + i], b[dT_m_ + i], fma(b[g_twist_ + i], dphi, dfeedback)
                        )
                        b[dT_m_rate_ + i] -= dfeedback * b[per_time_ + i]
                if limited:  # at its limits the torque of the motor does not change
                    lag, set_speed = b[lag_ + i], b[set_speed_ + i]
                    twist_part = fma(
                        b[G_t_ + i], b[twist_ + i] - lag, b[G_w_ + i] * (omega - set_speed)
                    )
                    minus_T_m = fma(
                        b[K_i_ + i], lag, fma(b[K_p_ + i], b[omega_d_ + i] - set_speed, twist_part)
                    )
                    minus_dT_m = (
                        minus_dT_m
                        if (minus_T_m < 0.0) and (minus_T_m > -b[torque_limit_ + i])
                        else 0.0
                    )
                b[dalpha_d_ + i] = (fma(b[k_t_ + i], dpipe, -dshaft_torque) - minus_dT_m) * b[
                    iJ_d_ + i
                ]
                dtorque = dtorque - dshaft_torque
            dmoment = fma(
                b[c_t_ + i],
                domega,
                fma(b[k_t_ + i], dpipe, fma(b[friction_ + i], b[R_c_ + i], dtorque)),
            )
            if weight:
                dmoment = fma(-b[eccentric_ + i] * s, dphi, dmoment)
            dangular = (
                -fma(q, fma(dF_y, c, -fma(dF_x, s, b[force_ + i] * dphi)), dmoment) * b[iJ_ + i]
            )
            domega_squared, omega_squared = 2.0 * omega * domega, omega * omega
            b[dax_ + i] = fma(
                q,
                fma(
                    domega_squared, c, fma(dangular, s, dphi * fma(alpha, c, -(omega_squared * s)))
                ),
                dF_x * b[iml_ + i],
            )
            b[day_ + i] = fma(
                q,
                fma(domega_squared, s, fma(-dangular, c, dphi * fma(alpha, s, omega_squared * c))),
                dF_y * b[iml_ + i],
            )
            b[daz_ + i] = (
                b[daz_ + i] - fma(b[c_a_ + i], b[dvz_ + i], b[k_a_ + i] * b[dz_ + i])
            ) * b[ima_ + i]
            b[dalpha_ + i] = dangular

    return tangent


@lru_cache
def make_contacts(lanes: int, options: Options, place: int) -> Any:
    """The compiled ``contacts(buffer)``, which writes value, slope and second
    derivative of each contact's function at the end of the step to the observer's rows
    from ``place`` on: the interference with the rock, and the squared radius of the
    collar's centre less the squared gap, which is smooth at the hole's centre too."""
    rows = rows_of(options, tangent=True)
    W, lobes = lanes, options.lobes
    x_, vx_, y_, vy_, z_, vz_, _, speed_ = (W * (rows.stage + i) for i in range(len(STATES)))
    ax_, ay_, az_, alpha_ = (W * (rows.acceleration + i) for i in range(4))
    cosine_, sine_ = (W * (rows.aux_now + AUX.index(name)) for name in ("cosine", "sine"))
    s0_, gap_ = (
        W * (rows.parameter + PARAMETERS.index(name)) for name in ("surface_amplitude", "gap")
    )
    u_, du_, ddu_, rho_, drho_, ddrho_ = (
        W * (rows.observer + place + k) for k in range(RATES * len(CONTACTS))
    )

    @compiled(BUFFER)
    def contacts(b):  # type: ignore[no-untyped-def]
        for i in packed(W):
            x, vx, y, vy, omega, c = (
                b[x_ + i],
                b[vx_ + i],
                b[y_ + i],
                b[vy_ + i],
                b[speed_ + i],
                b[cosine_ + i],
            )
            sine, cosine = multiple_sine(b[sine_ + i], c, lobes), multiple_cosine(c, lobes)
            steepness = b[s0_ + i] * lobes
            b[u_ + i] = fma(b[s0_ + i], sine, -b[z_ + i])
            b[du_ + i] = fma(steepness * omega, cosine, -b[vz_ + i])
            b[ddu_ + i] = fma(
                steepness, fma(b[alpha_ + i], cosine, -(lobes * omega * omega * sine)), -b[az_ + i]
            )
            b[rho_ + i] = fma(x, x, fma(y, y, -(b[gap_ + i] * b[gap_ + i])))
            b[drho_ + i] = 2.0 * fma(x, vx, y * vy)
            b[ddrho_ + i] = 2.0 * fma(vx, vx, fma(vy, vy, fma(x, b[ax_ + i], y * b[ay_ + i])))

    return contacts
