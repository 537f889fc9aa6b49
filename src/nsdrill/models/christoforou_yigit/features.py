"""The observer: measurements during the integration, in constant memory and on the
continuous solution.

Every packed step is examined in all lanes at once: sums over time, and a bit for every
lane in which an event occurs inside the step, an extremum of a quantity (its slope
changes sign) or the crossing of a level (see :mod:`.events`). The extremes of a
quantity lie at its extrema inside steps or at the ends of the observation, so nothing
else is compared.

The two halves of the observation are measured separately, so that their agreement shows
whether the run has settled.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import CLOSES, CONTROL, MARKER, OPENS, Rows
from nsdrill.compiler.functions import BUFFER, compiled, inlined
from nsdrill.compiler.words import fma, lowest_bit, packed
from nsdrill.models.christoforou_yigit.events import lower_estimate, make_events, tangential_speed
from nsdrill.models.christoforou_yigit.friction import bit_slope
from nsdrill.models.christoforou_yigit.layout import (
    ANCHORS,
    ENDS,
    EXTREMES,
    HAD_SPEED_EXTREMUM,
    HALF,
    HALF_OUTCOME,
    OBSERVED,
    PEAK_QUANTITIES,
    PEAK_ROWS,
    PEAKS,
    PROMINENCE,
    RETURNS,
    RINGS,
    RINGS_OF_PEAKS,
    SPACING,
    SUMS,
    TIME_PARTS,
    WALL_PATHS,
    WAS_RISING,
)
from nsdrill.models.christoforou_yigit.lobes import multiple_cosine, multiple_sine
from nsdrill.models.christoforou_yigit.options import ObserverOptions, Options
from nsdrill.models.christoforou_yigit.rhs import (
    AUX,
    MAIN,
    PARAMETERS,
    STATES,
    aux_of,
    columns_of,
    rows_of,
)
from nsdrill.models.christoforou_yigit.section import ENTRY, bit_angle_crossing
from nsdrill.observe.inside import record_maximum, store_peak
from nsdrill.observe.interpolant import position_and_velocity

LEAST_HOLD = 1.0  # least c f', stage length over the time constant of friction, of a held bit
CREEP_RANGE = 20.0  # of eps |v|; at lower speeds friction has not reached its full size


@inlined
def half_plane_angle(x, y):  # type: ignore[no-untyped-def]
    """The whirl angle within its half plane, from 0 to pi; half revolutions are counted
    separately."""
    angle = math.atan2(y, x)
    return angle + math.pi if y < 0.0 else angle


@inlined
def has_extremum(before, now):  # type: ignore[no-untyped-def]
    """Whether a slope changes its sign between its values ``before`` and ``now``; the
    extremum is a maximum where ``before`` is positive."""
    return (before > 0.0) != (now > 0.0)


def make_observer(
    lanes: int, options: Options = MAIN, tangent: bool = False, others: int = 0
) -> tuple[Any, Any]:
    """The compiled (observer, marker) for a number of lanes and these options.

    ``tangent`` is for a buffer with a deviation beside the states, ``others`` the
    number of rows of other observers. ``observer(b, store)`` measures a step;
    ``marker(b, store, i, mark, outcome, column)`` is called for a lane i at the marks
    of the observation, its beginning, its middle and its end, and writes the
    measurements of each half to ``outcome`` from ``column`` on.
    """
    rows = rows_of(options, len(OBSERVED) + others, tangent=tangent)
    return _make(lanes, rows, observer_options(options))


def observer_options(options: Options) -> ObserverOptions:
    """The options that affect the observer."""
    aux, columns = aux_of(options), columns_of(options)
    return ObserverOptions(
        options.lobes,
        options.driven,
        options.friction,
        options.stabilizer,
        options.weight,
        options.implicit,
        columns.index("clearance") if options.stabilizer else 0,
        aux.index("bb") if options.implicit else 0,
        aux.index("slope") if options.implicit else 0,
    )


@lru_cache
def _make(lanes: int, rows: Rows, options: ObserverOptions) -> tuple[Any, Any]:
    W, lobes, driven, friction = lanes, options.lobes, options.driven, options.friction
    stabilizer, weight, implicit = options.stabilizer, options.weight, options.implicit
    clearance_ = W * (rows.parameter + options.clearance)
    # The rows of the drive's states; an ideal drive has none.
    lag0_, omega_d0_, alpha_d0_ = (
        W * (rows.start + 8),
        W * (rows.start + 9),
        W * (rows.start_acceleration + 4),
    )
    lag1_, omega_d1_, alpha_d1_ = (
        W * (rows.stage + 8),
        W * (rows.stage + 9),
        W * (rows.acceleration + 4),
    )
    x0_, vx0_, y0_, vy0_, z0_, vz0_, twist0_, speed0_ = (W * (rows.start + i) for i in range(8))
    ax0_, ay0_, az0_, alpha0_ = (W * (rows.start_acceleration + i) for i in range(4))
    x1_, vx1_, y1_, vy1_, z1_, vz1_, twist1_, speed1_ = (W * (rows.stage + i) for i in range(8))
    ax1_, ay1_, az1_, alpha1_ = (W * (rows.acceleration + i) for i in range(4))
    cosine_, sine_, direction_, decay_, radius_now_ = (
        W * (rows.aux_now + AUX.index(name))
        for name in ("cosine", "sine", "direction", "decay", "radius")
    )
    h_, moves_, observing_ = W * rows.step, W * rows.moves, W * rows.observing
    parameter = {name: W * (rows.parameter + i) for i, name in enumerate(PARAMETERS)}
    offset = {name: W * (rows.observer + i) for i, name in enumerate(OBSERVED)}
    gap_, k_c_, s0_, stuck_, set_speed_ = (
        parameter[n]
        for n in ("gap", "rock_stiffness", "surface_amplitude", "stuck_below", "drive_speed")
    )
    eps_, tau_, rise_, mu_ = (
        parameter[n] for n in ("bit_smoothing", "bit_decay", "bit_rise", "bit_dynamic")
    )
    bb_, slope_ = W * (rows.aux_now + options.bb), W * (rows.aux_now + options.slope)
    before_, now_, level_ = offset["u_before"], offset["u_now"], offset["level"]
    (
        rock_crossings_,
        stuck_crossings_,
        wall_crossings_,
        stabilizer_crossings_,
        rock_grazes_,
        wall_grazes_,
        stabilizer_grazes_,
    ) = (offset[name] for name in TIME_PARTS)
    rolled_crossings_, rotated_crossings_, rolled_grazes_, rotated_grazes_ = (
        offset[name] for name in WALL_PATHS
    )
    parts_, parts_count = offset[TIME_PARTS[0]], len(TIME_PARTS) + len(WALL_PATHS)
    low_, growth_, floor_ = offset["low_z"], offset["margin_growth"], offset["torque_floor"]
    per_rtol_ = W * (rows.control + CONTROL.index("per_rtol"))
    peak_width, to_high, to_margin, to_top = (
        W * len(PEAK_ROWS),
        W * PEAK_ROWS.index("high"),
        W * PEAK_ROWS.index("margin"),
        W * PEAK_ROWS.index("top"),
    )
    z_scale_, speed_scale_ = (W * (rows.scale + STATES.index(name)) for name in ("z", "bit_speed"))
    time_, phase_ = W * rows.time, W * rows.phase
    u0_, du0_, _, _, dT0_, r0_, dr0_, per_r0_ = (before_ + W * i for i in range(len(ENDS)))
    u1_, du1_, ddu1_, T1_, dT1_, r1_, dr1_, per_r1_ = (now_ + W * i for i in range(len(ENDS)))
    (
        z_min_,
        z_max_,
        speed_min_,
        speed_max_,
        twist_min_,
        twist_max_,
        u_max_,
        torque_max_,
        rho_max_,
        drive_min_,
        drive_max_,
    ) = (offset[name] for name in EXTREMES)
    (
        on_rock_,
        unstuck_,
        on_wall_,
        radius_,
        twist_sum_,
        lateral_,
        axial_,
        half_revolutions_,
        rolled_,
        rotated_,
        on_stabilizer_,
        x_sum_,
        y_sum_,
    ) = (offset[name] for name in SUMS)
    twist_start_, angle_start_, lag_start_ = (offset[name] for name in ANCHORS)
    record_events, flush_events = make_events(
        W, rows, driven, friction, stabilizer, options.clearance
    )
    half_, half_count, ends_count = offset[HALF[0]], len(HALF), len(ENDS)
    half_outcome = len(HALF_OUTCOME)

    @compiled(BUFFER, BUFFER)
    def observer(b, store):  # type: ignore[no-untyped-def]
        # Sets of lanes, one bit each: extrema inside the step, crossings of levels, a
        # collar that stays on the wall or passes from one half plane to the other.
        z_extrema = speed_extrema = twist_extrema = u_extrema = torque_maxima = rho_extrema = 0
        rock = stuck = wall = on_wall = half_plane_crossed = returning = 0
        drive_extrema = stabilizer_crossed = 0

        # The quantities at the end of the step, the lanes that are observed, and those
        # whose bit speed rises. One division serves two quotients, torsional and
        # lateral.
        observed = rising = 0
        for i in packed(W):
            omega, alpha = b[speed1_ + i], b[alpha1_ + i]
            c, s = b[cosine_ + i], b[sine_ + i]
            sine, cosine = multiple_sine(s, c, lobes), multiple_cosine(c, lobes)
            amplitude = b[s0_ + i]
            speed = amplitude * lobes * omega
            u = fma(amplitude, sine, -b[z1_ + i])
            du = fma(speed, cosine, -b[vz1_ + i])
            ddu = fma(
                amplitude * lobes, alpha * cosine, fma(-speed * lobes, omega * sine, -b[az1_ + i])
            )
            # The bit torque is force times arm; the arm changes with the bit speed.
            g, decayed = b[direction_ + i], b[decay_ + i]
            k_c = b[k_c_ + i]
            force = k_c * max(u, 0.0)
            dforce = k_c * du if u > 0.0 else 0.0
            scaled = b[eps_ + i] * omega
            flat = fma(scaled, scaled, 1.0)
            r = b[radius_now_ + i]
            inverse = 1.0 / (flat * r)
            arm, darm = bit_slope(
                friction,
                omega,
                g,
                decayed,
                r * inverse,
                b[eps_ + i],
                b[tau_ + i],
                b[rise_ + i],
                b[mu_ + i],
            )
            b[u1_ + i] = u
            b[du1_ + i] = du
            b[ddu1_ + i] = ddu
            b[T1_ + i] = force * arm
            b[dT1_ + i] = fma(dforce, arm, force * darm * alpha)
            per_r = flat * inverse
            b[r1_ + i] = r
            b[dr1_ + i] = fma(b[x1_ + i], b[vx1_ + i], b[y1_ + i] * b[vy1_ + i]) * per_r
            b[per_r1_ + i] = per_r
            observed |= (1 << i) if b[moves_ + i] * b[observing_ + i] != 0.0 else 0
            rising |= (1 << i) if omega > b[speed0_ + i] else 0

        if observed != 0:
            for i in packed(W):
                h = b[h_ + i]
                omega, alpha, set_speed = b[speed1_ + i], b[alpha1_ + i], b[set_speed_ + i]
                x0, y0, x1, y1 = b[x0_ + i], b[y0_ + i], b[x1_ + i], b[y1_ + i]
                vx0, vy0, vx1, vy1 = b[vx0_ + i], b[vy0_ + i], b[vx1_ + i], b[vy1_ + i]
                rho0, rho1 = fma(x0, x0, y0 * y0), fma(x1, x1, y1 * y1)
                outward0, outward1 = fma(x0, vx0, y0 * vy0), fma(x1, vx1, y1 * vy1)
                r0, r1, dr0, dr1 = b[r0_ + i], b[r1_ + i], b[dr0_ + i], b[dr1_ + i]
                u0, u, du0, du = b[u0_ + i], b[u1_ + i], b[du0_ + i], b[du1_ + i]

                # The events inside the step. ``bit`` is 0 for a lane that is not observed.
                bit = (1 << i) if b[moves_ + i] * b[observing_ + i] != 0.0 else 0
                z_extrema |= bit if has_extremum(b[vz0_ + i], b[vz1_ + i]) else 0
                speed_extremum, torque_maximum = (
                    has_extremum(b[alpha0_ + i], alpha),
                    b[dT0_ + i] > 0.0 and b[dT1_ + i] <= 0.0,
                )
                if implicit:
                    # Friction holds the bit at the end of a step that is much longer than
                    # the time constant of friction. The acceleration jumps inside such a
                    # step, so its polynomial undershoots; and the bit creeps, so the sign
                    # of the acceleration is that of rounding. The speed at the end is used
                    # instead. The torque of a bit that is held during the whole step
                    # balances that of the string and has no maximum inside.
                    is_held = b[bb_ + i] * b[slope_ + i] > LEAST_HOLD
                    is_end_extreme = is_held and bit != 0
                    b[speed_min_ + i] = min(
                        b[speed_min_ + i], omega if is_end_extreme else b[speed_min_ + i]
                    )
                    b[speed_max_ + i] = max(
                        b[speed_max_ + i], omega if is_end_extreme else b[speed_max_ + i]
                    )
                    speed_extremum = speed_extremum and not is_held
                    torque_maximum = torque_maximum and not (
                        is_held and abs(b[eps_ + i] * b[speed0_ + i]) < CREEP_RANGE
                    )
                speed_extrema |= bit if speed_extremum else 0
                if driven:  # the twist of the pipe, which gives the torque at the surface
                    twist_extrema |= (
                        bit
                        if has_extremum(b[speed0_ + i] - b[omega_d0_ + i], omega - b[omega_d1_ + i])
                        else 0
                    )
                    drive_extrema |= bit if has_extremum(b[alpha_d0_ + i], b[alpha_d1_ + i]) else 0
                else:
                    twist_extrema |= (
                        bit if has_extremum(b[speed0_ + i] - set_speed, omega - set_speed) else 0
                    )
                u_extrema |= bit if has_extremum(du0, du) else 0
                torque_maxima |= bit if torque_maximum else 0
                half_plane_crossed |= bit if (y0 < 0.0) != (y1 < 0.0) else 0
                level = b[gap_ + i] * b[gap_ + i]
                low = (
                    rho0 > level
                    and lower_estimate(rho0, rho1, 2.0 * outward0, 2.0 * outward1, h) < level
                )
                rho_extrema |= (
                    bit if has_extremum(outward0, outward1) and (outward0 > 0.0 or low) else 0
                )
                if stabilizer:
                    near = b[clearance_ + i] * b[clearance_ + i]
                    low = (
                        rho0 > near
                        and lower_estimate(rho0, rho1, 2.0 * outward0, 2.0 * outward1, h) < near
                    )
                    rho_extrema |= bit if has_extremum(outward0, outward1) and low else 0
                    stabilizer_crossed |= bit if (rho0 > near) != (rho1 > near) else 0
                    b[on_stabilizer_ + i] += h if bit != 0 and rho0 > near and rho1 > near else 0.0
                rock0, rock1 = u0 > 0.0, u > 0.0
                free0, free1 = b[speed0_ + i] > b[stuck_ + i], omega > b[stuck_ + i]
                rock |= bit if rock0 != rock1 else 0
                stuck |= bit if free0 != free1 else 0
                wall |= bit if (rho0 > level) != (rho1 > level) else 0
                on_wall |= bit if (rho0 > level) and (rho1 > level) else 0

                # Time on each side of a level: whole steps; steps with a crossing are added
                # by the events.
                shown = h if bit != 0 else 0.0
                b[on_rock_ + i] += shown if (rock0 and rock1) else 0.0
                b[unstuck_ + i] += shown if (free0 and free1) else 0.0

                # Integrals over the step: trapezoids corrected by the slopes; exact for the
                # interpolant of the twist. The squared accelerations by Simpson's rule,
                # with the middle from the interpolant.
                sixth = shown * (1.0 / 6.0)
                b[radius_ + i] += shown * fma(h * (1.0 / 12.0), dr0 - dr1, 0.5 * (r0 + r1))
                b[twist_sum_ + i] += shown * fma(
                    h,
                    fma(h * (1.0 / 120.0), b[alpha0_ + i] + alpha, 0.1 * (b[speed0_ + i] - omega)),
                    0.5 * (b[twist0_ + i] + b[twist1_ + i]),
                )
                if driven:
                    b[twist_sum_ + i] -= shown * fma(
                        h,
                        fma(
                            h * (1.0 / 120.0),
                            b[alpha_d0_ + i] + b[alpha_d1_ + i],
                            0.1 * (b[omega_d0_ + i] - b[omega_d1_ + i]),
                        ),
                        0.5 * (b[lag0_ + i] + b[lag1_ + i]),
                    )
                if weight:
                    b[x_sum_ + i] += shown * fma(h * (1.0 / 12.0), vx0 - vx1, 0.5 * (x0 + x1))
                    b[y_sum_ + i] += shown * fma(h * (1.0 / 12.0), vy0 - vy1, 0.5 * (y0 + y1))
                steep = 1.5 / h if h > 0.0 else 0.0
                ax0, ay0, az0, ax1, ay1, az1 = (
                    b[ax0_ + i],
                    b[ay0_ + i],
                    b[az0_ + i],
                    b[ax1_ + i],
                    b[ay1_ + i],
                    b[az1_ + i],
                )
                axm = fma(steep, vx1 - vx0, -0.25 * (ax0 + ax1))
                aym = fma(steep, vy1 - vy0, -0.25 * (ay0 + ay1))
                azm = fma(steep, b[vz1_ + i] - b[vz0_ + i], -0.25 * (az0 + az1))
                b[lateral_ + i] += sixth * fma(
                    4.0,
                    fma(axm, axm, aym * aym),
                    fma(ax0, ax0, fma(ay0, ay0, fma(ax1, ax1, ay1 * ay1))),
                )
                b[axial_ + i] += sixth * fma(4.0 * azm, azm, fma(az0, az0, az1 * az1))

        if observed != 0 and store[RETURNS] > 0.0:
            for i in packed(W):
                angle = b[twist1_ + i] + fma(
                    b[set_speed_ + i], b[time_ + i] + b[h_ + i], b[phase_ + i]
                )
                due = angle >= b[level_ + i] and b[moves_ + i] * b[observing_ + i] != 0.0
                returning |= (1 << i) if due else 0

        # Whirl: half revolutions are counted where the orbit passes from one half plane
        # to the other.
        while half_plane_crossed != 0:
            i = lowest_bit(half_plane_crossed)
            half_plane_crossed &= half_plane_crossed - 1
            cross = fma(b[x0_ + i], b[y1_ + i], -(b[y0_ + i] * b[x1_ + i]))
            b[half_revolutions_ + i] += 1.0 if cross > 0.0 else -1.0

        if on_wall != 0:
            for i in packed(W):
                is_on_wall = (on_wall >> i) & 1 != 0
                h = b[h_ + i]
                shown = h if is_on_wall else 0.0
                tangential0, dtangential0 = tangential_speed(
                    b[x0_ + i],
                    b[vx0_ + i],
                    b[ax0_ + i],
                    b[y0_ + i],
                    b[vy0_ + i],
                    b[ay0_ + i],
                    b[per_r0_ + i],
                    b[dr0_ + i],
                )
                tangential1, dtangential1 = tangential_speed(
                    b[x1_ + i],
                    b[vx1_ + i],
                    b[ax1_ + i],
                    b[y1_ + i],
                    b[vy1_ + i],
                    b[ay1_ + i],
                    b[per_r1_ + i],
                    b[dr1_ + i],
                )
                rotated = fma(b[set_speed_ + i], h, b[twist1_ + i] - b[twist0_ + i])
                b[on_wall_ + i] += shown
                b[rolled_ + i] += shown * fma(
                    h * (1.0 / 12.0), dtangential0 - dtangential1, 0.5 * (tangential0 + tangential1)
                )
                b[rotated_ + i] += rotated if is_on_wall else 0.0

        # While the bit creeps, the steps are so long for its steep friction that the
        # acceleration at their ends is mostly error. Extrema of the bit speed are
        # therefore also detected from the speeds at the ends of steps.
        was_rising, had_extremum = int(store[WAS_RISING]), int(store[HAD_SPEED_EXTREMUM])
        changed = (rising ^ was_rising) & observed
        store[WAS_RISING], store[HAD_SPEED_EXTREMUM] = (
            float(was_rising ^ changed),
            float((had_extremum & ~observed) | speed_extrema),
        )
        changed &= ~(had_extremum | speed_extrema)
        highs, lows = changed & was_rising, changed & ~was_rising

        extrema = (
            z_extrema
            | speed_extrema
            | changed
            | twist_extrema
            | u_extrema
            | torque_maxima
            | rho_extrema
            | drive_extrema
        )
        if (extrema | rock | stuck | wall | stabilizer_crossed) != 0:
            record_events(
                b,
                store,
                z_extrema,
                speed_extrema,
                highs,
                lows,
                twist_extrema,
                u_extrema,
                torque_maxima,
                rho_extrema,
                rock,
                stuck,
                wall,
                drive_extrema,
                stabilizer_crossed,
            )

        # Returns to the section, once a lobe or a revolution, hence once in many steps.
        while returning != 0:
            i = lowest_bit(returning)
            returning &= returning - 1
            h, set_speed = b[h_ + i], b[set_speed_ + i]
            drive_angle = fma(set_speed, b[time_ + i], b[phase_ + i])
            end = b[twist1_ + i] + fma(set_speed, b[time_ + i] + h, b[phase_ + i])
            peaks, returns = int(store[PEAKS]), int(store[RETURNS])
            ring = RINGS + W * RINGS_OF_PEAKS * (peaks + 1) + i * (1 + ENTRY * returns)
            while end >= b[level_ + i]:
                level = b[level_ + i]
                theta = bit_angle_crossing(
                    b[twist0_ + i],
                    b[speed0_ + i],
                    b[alpha0_ + i],
                    b[twist1_ + i],
                    b[speed1_ + i],
                    b[alpha1_ + i],
                    h,
                    set_speed,
                    drive_angle,
                    level,
                )
                x, vx = position_and_velocity(b, i, theta, h, 0.0, x0_, vx0_, ax0_, x1_, vx1_, ax1_)
                y, vy = position_and_velocity(b, i, theta, h, 0.0, y0_, vy0_, ay0_, y1_, vy1_, ay1_)
                z, vz = position_and_velocity(b, i, theta, h, 0.0, z0_, vz0_, az0_, z1_, vz1_, az1_)
                twist, omega = position_and_velocity(
                    b, i, theta, h, -set_speed, twist0_, speed0_, alpha0_, twist1_, speed1_, alpha1_
                )
                count = int(store[ring])
                entry = ring + 1 + ENTRY * (count % returns)
                store[entry] = x
                store[entry + 1] = vx
                store[entry + 2] = y
                store[entry + 3] = vy
                store[entry + 4] = z
                store[entry + 5] = vz
                store[entry + 6] = twist
                store[entry + 7] = omega
                store[entry + 8] = level
                store[ring] = float(count + 1)
                # Computed from the number of the multiple: in a long run repeated
                # addition would accumulate rounding errors.
                b[level_ + i] = (np.rint(level / store[SPACING]) + 1.0) * store[SPACING]

        for i in packed(W):
            moves = b[moves_ + i] != 0.0
            for k in range(0, ends_count * W, W):
                before, now = b[before_ + k + i], b[now_ + k + i]
                b[before_ + k + i] = now if moves else before

    @compiled(MARKER)
    def marker(b, store, i, mark, outcome, column):  # type: ignore[no-untyped-def]
        flush_events(b, store)
        # At the mark the state of the lane is in the stage rows, and the quantities at
        # the end of the step belong to that state.
        angle = half_plane_angle(b[x1_ + i], b[y1_ + i])
        rho = fma(b[x1_ + i], b[x1_ + i], b[y1_ + i] * b[y1_ + i])
        lag, omega_d = b[lag1_ + i] if driven else 0.0, b[omega_d1_ + i] if driven else 0.0
        pipe_twist = b[twist1_ + i] - lag if driven else b[twist1_ + i]
        heights, scales = (
            (b[z1_ + i], b[speed1_ + i], 0.0),
            (b[z_scale_ + i], b[speed_scale_ + i], np.inf),
        )
        peaks, returns = int(store[PEAKS]), int(store[RETURNS])
        width, width_of_section = (
            RINGS_OF_PEAKS * (peaks + 1),
            1 + ENTRY * returns if returns > 0 else 0,
        )
        rings = RINGS + i * width
        section = RINGS + W * width + i * width_of_section
        if mark == OPENS:
            for k in range(width):
                store[rings + k] = 0.0
            for k in range(width_of_section):
                store[section + k] = 0.0
            bit_angle = b[twist1_ + i] + fma(b[set_speed_ + i], b[time_ + i], b[phase_ + i])
            b[level_ + i] = (np.floor(bit_angle / store[SPACING]) + 1.0) * store[SPACING]
            # there is no step before the first
            store[HAD_SPEED_EXTREMUM] = float(int(store[HAD_SPEED_EXTREMUM]) | (1 << i))
            tolerances = PROMINENCE / b[per_rtol_ + i]
            b[growth_ + i] = tolerances
            for k in range(len(PEAK_QUANTITIES)):
                b[low_ + k * peak_width + i] = heights[k]
                b[low_ + k * peak_width + to_high + i] = -np.inf
                b[low_ + k * peak_width + to_top + i] = np.inf
                b[low_ + k * peak_width + to_margin + i] = tolerances * scales[k]
        else:
            b[z_min_ + i] = min(b[z_min_ + i], b[z1_ + i])
            b[z_max_ + i] = max(b[z_max_ + i], b[z1_ + i])
            b[speed_min_ + i] = min(b[speed_min_ + i], b[speed1_ + i])
            b[speed_max_ + i] = max(b[speed_max_ + i], b[speed1_ + i])
            b[twist_min_ + i] = min(b[twist_min_ + i], pipe_twist)
            b[twist_max_ + i] = max(b[twist_max_ + i], pipe_twist)
            b[drive_min_ + i] = min(b[drive_min_ + i], omega_d)
            b[drive_max_ + i] = max(b[drive_max_ + i], omega_d)
            b[u_max_ + i] = max(b[u_max_ + i], b[u1_ + i])
            b[torque_max_ + i] = max(b[torque_max_ + i], b[T1_ + i])
            b[rho_max_ + i] = max(b[rho_max_ + i], rho)
            b[on_rock_ + i] += b[rock_crossings_ + i] + b[rock_grazes_ + i]
            b[unstuck_ + i] += b[stuck_crossings_ + i]
            b[on_wall_ + i] += b[wall_crossings_ + i] + b[wall_grazes_ + i]
            b[on_stabilizer_ + i] += b[stabilizer_crossings_ + i] + b[stabilizer_grazes_ + i]
            b[rolled_ + i] += b[rolled_crossings_ + i] + b[rolled_grazes_ + i]
            b[rotated_ + i] += b[rotated_crossings_ + i] + b[rotated_grazes_ + i]
            first = column if mark != CLOSES else column + half_outcome
            for k in range(half_count):
                outcome[first + k] = b[half_ + k * W + i]
            outcome[first + half_count] = b[twist1_ + i]
            outcome[first + half_count + 1] = angle
            outcome[first + half_count + 2] = lag
            if mark == CLOSES:
                # A candidate is a maximum if the quantity has by now fallen by the
                # prominence below it. The last cycle of a bit that is stuck is
                # complete.
                stuck_at, slip_above = (-np.inf, b[stuck_ + i]), (np.inf, b[set_speed_ + i])
                for k in range(len(PEAK_QUANTITIES) - 1):
                    row, ring = low_ + k * peak_width + i, rings + k * (peaks + 1)
                    low, high, top = b[row], b[row + to_high], b[row + to_top]
                    stuck, slip = stuck_at[k], slip_above[k]
                    if high - heights[k] > fma(b[growth_ + i], abs(heights[k]), b[row + to_margin]):
                        top = record_maximum(store, ring, peaks, low, high, top, stuck, slip)
                        low = heights[k]
                    if min(low, heights[k]) <= stuck and slip < top < np.inf:
                        store_peak(store, ring, peaks, top)
                for k in range(width):
                    outcome[column + 2 * half_outcome + k] = store[rings + k]
                for k in range(width - peaks, width):  # of the radius the ring has squares
                    outcome[column + 2 * half_outcome + k] = np.sqrt(max(store[rings + k], 0.0))
                for k in range(width_of_section):
                    outcome[column + 2 * half_outcome + width + k] = store[section + k]
        for k in range(half_count):
            b[half_ + k * W + i] = 0.0
        for k in range(parts_count):
            b[parts_ + k * W + i] = 0.0
        b[z_min_ + i] = b[z1_ + i]
        b[z_max_ + i] = b[z1_ + i]
        b[speed_min_ + i] = b[speed1_ + i]
        b[speed_max_ + i] = b[speed1_ + i]
        b[twist_min_ + i] = pipe_twist
        b[twist_max_ + i] = pipe_twist
        b[drive_min_ + i] = omega_d
        b[drive_max_ + i] = omega_d
        b[u_max_ + i] = b[u1_ + i]
        b[torque_max_ + i] = b[T1_ + i]
        b[floor_ + i] = b[T1_ + i]
        b[rho_max_ + i] = rho
        b[twist_start_ + i] = b[twist1_ + i]
        b[angle_start_ + i] = angle
        b[lag_start_ + i] = lag

    return observer, marker
