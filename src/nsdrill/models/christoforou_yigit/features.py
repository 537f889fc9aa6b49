"""What is measured while a run is integrated, in constant memory and on the continuous
solution.

Every packed step is examined in all lanes at once: sums over time, and a bit for every
lane in which something happens inside the step: a quantity turns (its slope changes
sign) or crosses a level (see :mod:`.events`). The extremes of a quantity lie at its
turns or at the ends of the window, so nothing else is compared.

The observed window has two halves, measured separately, so that their agreement tells
whether the run has settled.
"""

from __future__ import annotations

import math
from dataclasses import astuple
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, CLOSES, CONTROL, OPENS, Rows, compiled, inlined
from nsdrill.elementary import fma, lowest_bit
from nsdrill.models.christoforou_yigit.events import keep, least_of, make_events, slide
from nsdrill.models.christoforou_yigit.friction import bit_slope
from nsdrill.models.christoforou_yigit.layout import (
    ANCHORS,
    CLIMBED,
    ENDS,
    EXTREMES,
    HALF,
    HALF_REPORT,
    OBSERVED,
    PARTS,
    PEAK,
    PEAKING,
    PEAKS,
    PROMINENCE,
    RETURNS,
    RINGS,
    RINGS_OF_PEAKS,
    SLIDES,
    SPACING,
    SPEED_TURNED,
    SUMS,
)
from nsdrill.models.christoforou_yigit.lobes import multiple_cosine, multiple_sine
from nsdrill.models.christoforou_yigit.options import Options, Seen
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
from nsdrill.observe.interpolant import position_and_velocity

HOLDS = 1.0  # c f', which tells how much longer a stage is than friction has an own time
CREEPS = 20.0  # up to this speed, in units of the smoothing, friction is not all of its size
SECOND = 32  # the bit of lane 0 in the second set of a number: there are no more lanes than that


@inlined
def half_plane_angle(x, y):  # type: ignore[no-untyped-def]
    """The whirl angle within its half plane, from 0 to pi; whole half turns are counted
    apart."""
    angle = math.atan2(y, x)
    return angle + math.pi if y < 0.0 else angle


@inlined
def turns(before, now):  # type: ignore[no-untyped-def]
    """Whether a slope changes its sign; the turn is a maximum where it was positive
    before."""
    return (before > 0.0) != (now > 0.0)


@inlined
def both_sets(bits):  # type: ignore[no-untyped-def]
    """The two sets of lanes that share a number."""
    lanes = (1 << SECOND) - 1
    return bits & lanes, (bits >> SECOND) & lanes


def make_observer(
    lanes: int, options: Options = MAIN, tangent: bool = False, others: int = 0
) -> tuple[Any, Any]:
    """The compiled (observer, marker) for a number of lanes and these options, with a
    deviation beside the states or without, and beside so many rows of ``others``."""
    rows = rows_of(options, len(OBSERVED) + others, tangent=tangent)
    return _make(lanes, rows.of_observer, seen_of(options))


def seen_of(options: Options) -> Seen:
    """What the observer sees of these options."""
    aux, columns = aux_of(options), columns_of(options)
    return Seen(
        options.lobes,
        options.driven,
        options.friction,
        options.stabilizer,
        options.weight,
        options.apart,
        columns.index("clearance") if options.stabilizer else 0,
        aux.index("bb") if options.apart else 0,
        aux.index("slope") if options.apart else 0,
    )


@lru_cache
def _make(lanes: int, rows: Rows, seen: Seen) -> tuple[Any, Any]:
    W, lobes, driven, friction = lanes, seen.lobes, seen.driven, seen.friction
    stabilizer, weight, apart = seen.stabilizer, seen.weight, seen.apart
    room_ = W * (rows.parameter + seen.clearance)
    # The drive's states, which an ideal one has not.
    lag0_, top0_, pull0_ = (
        W * (rows.start + 8),
        W * (rows.start + 9),
        W * (rows.start_acceleration + 4),
    )
    lag1_, top1_, pull1_ = W * (rows.stage + 8), W * (rows.stage + 9), W * (rows.acceleration + 4)
    x0_, vx0_, y0_, vy0_, z0_, vz0_, twist0_, speed0_ = (W * (rows.start + i) for i in range(8))
    ax0_, ay0_, az0_, alpha0_ = (W * (rows.start_acceleration + i) for i in range(4))
    x1_, vx1_, y1_, vy1_, z1_, vz1_, twist1_, speed1_ = (W * (rows.stage + i) for i in range(8))
    ax1_, ay1_, az1_, alpha1_ = (W * (rows.acceleration + i) for i in range(4))
    cosine_, sine_, direction_, decay_, radius_now_ = (
        W * (rows.aux_now + AUX.index(name))
        for name in ("cosine", "sine", "direction", "decay", "radius")
    )
    h_, moves_, window_ = W * rows.step, W * rows.moves, W * rows.window
    parameter = {name: W * (rows.parameter + i) for i, name in enumerate(PARAMETERS)}
    own = {name: W * (rows.observer + i) for i, name in enumerate(OBSERVED)}
    gap_, k_c_, s0_, stuck_, drive_ = (
        parameter[n]
        for n in ("gap", "rock_stiffness", "surface_amplitude", "stuck_below", "drive_speed")
    )
    eps_, tau_, rise_, mu_ = (
        parameter[n] for n in ("bit_smoothing", "bit_decay", "bit_rise", "bit_dynamic")
    )
    bb_, slope_ = W * (rows.aux_now + seen.bb), W * (rows.aux_now + seen.slope)
    before_, now_, level_ = own["u_before"], own["u_now"], own["level"]
    (
        rock_crossings_,
        stuck_crossings_,
        wall_crossings_,
        held_crossings_,
        rock_grazes_,
        wall_grazes_,
        held_grazes_,
    ) = (own[name] for name in PARTS)
    rolled_crossings_, turned_crossings_, rolled_grazes_, turned_grazes_ = (
        own[name] for name in SLIDES
    )
    parts_, parts_count = own[PARTS[0]], len(PARTS) + len(SLIDES)
    low_, growth_, floor_ = own["low_z"], own["margin_growth"], own["torque_floor"]
    per_rtol_ = W * (rows.control + CONTROL.index("per_rtol"))
    peak_width, to_high, to_margin = W * len(PEAK), W * PEAK.index("high"), W * PEAK.index("margin")
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
        top_min_,
        top_max_,
    ) = (own[name] for name in EXTREMES)
    (
        on_rock_,
        unstuck_,
        on_wall_,
        radius_,
        twist_sum_,
        lateral_,
        axial_,
        turns_,
        rolled_,
        turned_,
        held_,
        x_sum_,
        y_sum_,
    ) = (own[name] for name in SUMS)
    twist_start_, angle_start_, lag_start_ = (own[name] for name in ANCHORS)
    attend, settle = make_events(W, rows, driven, friction, stabilizer, seen.clearance)
    half_, half_count, ends_count = own[HALF[0]], len(HALF), len(ENDS)
    half_report = len(HALF_REPORT)

    @compiled(types.void(BUFFER, BUFFER), W, *astuple(rows), *seen)
    def observer(b, store):  # type: ignore[no-untyped-def]
        # One bit a lane: which quantities turn inside the step, which levels are
        # crossed, whether the collar stays on the wall or passes from one half plane to
        # the other. Two such sets share a number, as each is one more sum that the
        # registers must hold: the second has its bits above those of all lanes.
        z_speed = twist_u = torque_rho = rock_stuck = wall_along = passing = returning = (
            top_turns
        ) = held = 0

        # The quantities at the end of the step, the lanes that are observed, and those
        # where the bit gets faster. With one division for two quotients, torsional and
        # lateral.
        seen_climbs = 0
        for i in range(W):
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
            seen_climbs |= (1 << i) if b[moves_ + i] * b[window_ + i] != 0.0 else 0
            seen_climbs |= (1 << i + SECOND) if omega > b[speed0_ + i] else 0
        seen, climbs = both_sets(seen_climbs)

        for i in range(W if seen != 0 else 0):
            h = b[h_ + i]
            omega, alpha, drive = b[speed1_ + i], b[alpha1_ + i], b[drive_ + i]
            x0, y0, x1, y1 = b[x0_ + i], b[y0_ + i], b[x1_ + i], b[y1_ + i]
            vx0, vy0, vx1, vy1 = b[vx0_ + i], b[vy0_ + i], b[vx1_ + i], b[vy1_ + i]
            rho0, rho1 = fma(x0, x0, y0 * y0), fma(x1, x1, y1 * y1)
            outward0, outward1 = fma(x0, vx0, y0 * vy0), fma(x1, vx1, y1 * vy1)
            r0, r1, dr0, dr1 = b[r0_ + i], b[r1_ + i], b[dr0_ + i], b[dr1_ + i]
            u0, u, du0, du = b[u0_ + i], b[u1_ + i], b[du0_ + i], b[du1_ + i]

            # What happens inside the step. The bit is no bit where the lane is not
            # observed.
            bit = (1 << i) if b[moves_ + i] * b[window_ + i] != 0.0 else 0
            far = bit << SECOND
            z_speed |= bit if turns(b[vz0_ + i], b[vz1_ + i]) else 0
            speed_turn, torque_top = (
                turns(b[alpha0_ + i], alpha),
                b[dT0_ + i] > 0.0 and b[dT1_ + i] <= 0.0,
            )
            if apart:
                # Where friction holds the bit at the end of a step much longer than it
                # has an own time, the polynomial of the step undershoots, as its
                # acceleration jumps inside, and the bit creeps, so that the sign of the
                # acceleration is that of rounding: the speed at the end counts. A bit
                # that is held all the while has the torque that balances the string's,
                # which has no top inside.
                holds = b[bb_ + i] * b[slope_ + i] > HOLDS
                counts = holds and bit != 0
                b[speed_min_ + i] = min(b[speed_min_ + i], omega if counts else b[speed_min_ + i])
                b[speed_max_ + i] = max(b[speed_max_ + i], omega if counts else b[speed_max_ + i])
                speed_turn = speed_turn and not holds
                torque_top = torque_top and not (
                    holds and abs(b[eps_ + i] * b[speed0_ + i]) < CREEPS
                )
            z_speed |= far if speed_turn else 0
            if driven:  # the twist of the pipe, from which the torque at the surface follows
                twist_u |= bit if turns(b[speed0_ + i] - b[top0_ + i], omega - b[top1_ + i]) else 0
                top_turns |= bit if turns(b[pull0_ + i], b[pull1_ + i]) else 0
            else:
                twist_u |= bit if turns(b[speed0_ + i] - drive, omega - drive) else 0
            twist_u |= far if turns(du0, du) else 0
            torque_rho |= bit if torque_top else 0
            passing |= bit if (y0 < 0.0) != (y1 < 0.0) else 0
            level = b[gap_ + i] * b[gap_ + i]
            low = rho0 > level and least_of(rho0, rho1, 2.0 * outward0, 2.0 * outward1, h) < level
            torque_rho |= far if turns(outward0, outward1) and (outward0 > 0.0 or low) else 0
            if stabilizer:
                near = b[room_ + i] * b[room_ + i]
                low = rho0 > near and least_of(rho0, rho1, 2.0 * outward0, 2.0 * outward1, h) < near
                torque_rho |= far if turns(outward0, outward1) and low else 0
                held |= bit if (rho0 > near) != (rho1 > near) else 0
                b[held_ + i] += h if bit != 0 and rho0 > near and rho1 > near else 0.0
            rock0, rock1 = u0 > 0.0, u > 0.0
            free0, free1 = b[speed0_ + i] > b[stuck_ + i], omega > b[stuck_ + i]
            rock_stuck |= bit if rock0 != rock1 else 0
            rock_stuck |= far if free0 != free1 else 0
            wall_along |= bit if (rho0 > level) != (rho1 > level) else 0
            wall_along |= far if (rho0 > level) and (rho1 > level) else 0

            # Time on each side of a level: whole steps here, steps with a crossing
            # below.
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
                        b[pull0_ + i] + b[pull1_ + i],
                        0.1 * (b[top0_ + i] - b[top1_ + i]),
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

        z_turns, speed_turns = both_sets(z_speed)
        twist_turns, u_turns = both_sets(twist_u)
        torque_tops, rho_turns = both_sets(torque_rho)
        rock, stuck = both_sets(rock_stuck)
        wall, along = both_sets(wall_along)

        if seen != 0 and store[RETURNS] > 0.0:
            for i in range(W):
                angle = b[twist1_ + i] + fma(b[drive_ + i], b[time_ + i] + b[h_ + i], b[phase_ + i])
                due = angle >= b[level_ + i] and b[moves_ + i] * b[window_ + i] != 0.0
                returning |= (1 << i) if due else 0

        # Whirl: half turns counted as the orbit passes from one half plane to the
        # other.
        while passing != 0:
            i = lowest_bit(passing)
            passing &= passing - 1
            cross = fma(b[x0_ + i], b[y1_ + i], -(b[y0_ + i] * b[x1_ + i]))
            b[turns_ + i] += 1.0 if cross > 0.0 else -1.0

        if along != 0:
            for i in range(W):
                counts = (along >> i) & 1 != 0
                h = b[h_ + i]
                shown = h if counts else 0.0
                whirl0, dwhirl0 = slide(
                    b[x0_ + i],
                    b[vx0_ + i],
                    b[ax0_ + i],
                    b[y0_ + i],
                    b[vy0_ + i],
                    b[ay0_ + i],
                    b[per_r0_ + i],
                    b[dr0_ + i],
                )
                whirl1, dwhirl1 = slide(
                    b[x1_ + i],
                    b[vx1_ + i],
                    b[ax1_ + i],
                    b[y1_ + i],
                    b[vy1_ + i],
                    b[ay1_ + i],
                    b[per_r1_ + i],
                    b[dr1_ + i],
                )
                turned = fma(b[drive_ + i], h, b[twist1_ + i] - b[twist0_ + i])
                b[on_wall_ + i] += shown
                b[rolled_ + i] += shown * fma(
                    h * (1.0 / 12.0), dwhirl0 - dwhirl1, 0.5 * (whirl0 + whirl1)
                )
                b[turned_ + i] += turned if counts else 0.0

        # While the bit creeps, the steps are so long for its steep friction that the
        # acceleration at their ends is more error than motion. So a peak of the bit
        # speed may also show in the speeds at the ends alone.
        climbed, turned = int(store[CLIMBED]), int(store[SPEED_TURNED])
        changed = (climbs ^ climbed) & seen
        store[CLIMBED], store[SPEED_TURNED] = climbed ^ changed, (turned & ~seen) | speed_turns
        changed &= ~(turned | speed_turns)
        highs, lows = changed & climbed, changed & ~climbed

        happens = (
            z_turns
            | speed_turns
            | changed
            | twist_turns
            | u_turns
            | torque_tops
            | rho_turns
            | top_turns
        )
        if (happens | rock | stuck | wall | held) != 0:
            attend(
                b,
                store,
                z_turns,
                speed_turns,
                highs,
                lows,
                twist_turns,
                u_turns,
                torque_tops,
                rho_turns,
                rock,
                stuck,
                wall,
                top_turns,
                held,
            )

        # Returns to the section: a lobe or a revolution, hence once in many steps.
        while returning != 0:
            i = lowest_bit(returning)
            returning &= returning - 1
            h, drive = b[h_ + i], b[drive_ + i]
            turned = fma(drive, b[time_ + i], b[phase_ + i])
            end = b[twist1_ + i] + fma(drive, b[time_ + i] + h, b[phase_ + i])
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
                    drive,
                    turned,
                    level,
                )
                x, vx = position_and_velocity(b, i, theta, h, 0.0, x0_, vx0_, ax0_, x1_, vx1_, ax1_)
                y, vy = position_and_velocity(b, i, theta, h, 0.0, y0_, vy0_, ay0_, y1_, vy1_, ay1_)
                z, vz = position_and_velocity(b, i, theta, h, 0.0, z0_, vz0_, az0_, z1_, vz1_, az1_)
                twist, omega = position_and_velocity(
                    b, i, theta, h, -drive, twist0_, speed0_, alpha0_, twist1_, speed1_, alpha1_
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
                store[ring] = count + 1
                # By number, not by adding up: the levels of a long run are multiples of
                # the spacing.
                b[level_ + i] = (np.rint(level / store[SPACING]) + 1.0) * store[SPACING]

        for i in range(W):
            moves = b[moves_ + i] != 0.0
            for k in range(0, ends_count * W, W):
                before, now = b[before_ + k + i], b[now_ + k + i]
                b[before_ + k + i] = now if moves else before

    @compiled(
        types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64),
        W,
        *astuple(rows),
        driven,
        friction,
        stabilizer,
    )
    def marker(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        settle(b, store)
        # The lane stands at the mark: its state is in the stage rows, and the
        # quantities at the end of the step are its.
        angle = half_plane_angle(b[x1_ + i], b[y1_ + i])
        rho = fma(b[x1_ + i], b[x1_ + i], b[y1_ + i] * b[y1_ + i])
        lag, top = b[lag1_ + i] if driven else 0.0, b[top1_ + i] if driven else 0.0
        pipe = b[twist1_ + i] - lag if driven else b[twist1_ + i]
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
            turned = b[twist1_ + i] + fma(b[drive_ + i], b[time_ + i], b[phase_ + i])
            b[level_ + i] = (np.floor(turned / store[SPACING]) + 1.0) * store[SPACING]
            # there is no step before the first
            store[SPEED_TURNED] = int(store[SPEED_TURNED]) | (1 << i)
            tolerances = PROMINENCE / b[per_rtol_ + i]
            b[growth_ + i] = tolerances
            for k in range(len(PEAKING)):
                b[low_ + k * peak_width + i] = heights[k]
                b[low_ + k * peak_width + to_high + i] = -np.inf
                b[low_ + k * peak_width + to_margin + i] = tolerances * scales[k]
        else:
            b[z_min_ + i] = min(b[z_min_ + i], b[z1_ + i])
            b[z_max_ + i] = max(b[z_max_ + i], b[z1_ + i])
            b[speed_min_ + i] = min(b[speed_min_ + i], b[speed1_ + i])
            b[speed_max_ + i] = max(b[speed_max_ + i], b[speed1_ + i])
            b[twist_min_ + i] = min(b[twist_min_ + i], pipe)
            b[twist_max_ + i] = max(b[twist_max_ + i], pipe)
            b[top_min_ + i] = min(b[top_min_ + i], top)
            b[top_max_ + i] = max(b[top_max_ + i], top)
            b[u_max_ + i] = max(b[u_max_ + i], b[u1_ + i])
            b[torque_max_ + i] = max(b[torque_max_ + i], b[T1_ + i])
            b[rho_max_ + i] = max(b[rho_max_ + i], rho)
            b[on_rock_ + i] += b[rock_crossings_ + i] + b[rock_grazes_ + i]
            b[unstuck_ + i] += b[stuck_crossings_ + i]
            b[on_wall_ + i] += b[wall_crossings_ + i] + b[wall_grazes_ + i]
            b[held_ + i] += b[held_crossings_ + i] + b[held_grazes_ + i]
            b[rolled_ + i] += b[rolled_crossings_ + i] + b[rolled_grazes_ + i]
            b[turned_ + i] += b[turned_crossings_ + i] + b[turned_grazes_ + i]
            first = column if mark != CLOSES else column + half_report
            for k in range(half_count):
                report[first + k] = b[half_ + k * W + i]
            report[first + half_count] = b[twist1_ + i]
            report[first + half_count + 1] = angle
            report[first + half_count + 2] = lag
            if mark == CLOSES:
                # What may become a peak is one if the quantity has fallen from it far
                # enough by now.
                for k in range(len(PEAKING) - 1 if peaks > 0 else 0):
                    row = low_ + k * peak_width + i
                    if b[row + to_high] - heights[k] > fma(
                        b[growth_ + i], abs(heights[k]), b[row + to_margin]
                    ):
                        keep(store, rings + k * (peaks + 1), peaks, b[row + to_high])
                for k in range(width):
                    report[column + 2 * half_report + k] = store[rings + k]
                for k in range(width - peaks, width):  # of the radius the ring has squares
                    report[column + 2 * half_report + k] = np.sqrt(max(store[rings + k], 0.0))
                for k in range(width_of_section):
                    report[column + 2 * half_report + width + k] = store[section + k]
        for k in range(half_count):
            b[half_ + k * W + i] = 0.0
        for k in range(parts_count):
            b[parts_ + k * W + i] = 0.0
        b[z_min_ + i] = b[z1_ + i]
        b[z_max_ + i] = b[z1_ + i]
        b[speed_min_ + i] = b[speed1_ + i]
        b[speed_max_ + i] = b[speed1_ + i]
        b[twist_min_ + i] = pipe
        b[twist_max_ + i] = pipe
        b[top_min_ + i] = top
        b[top_max_ + i] = top
        b[u_max_ + i] = b[u1_ + i]
        b[torque_max_ + i] = b[T1_ + i]
        b[floor_ + i] = b[T1_ + i]
        b[rho_max_ + i] = rho
        b[twist_start_ + i] = b[twist1_ + i]
        b[angle_start_ + i] = angle
        b[lag_start_ + i] = lag

    return observer, marker
