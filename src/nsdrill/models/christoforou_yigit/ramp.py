"""The right-hand side along a ramp: the ordinary one, with lane parameters that change
in time.

A ramp is a chain of short segments. Within a segment every lane parameter changes
linearly: this is exact for speed and weight on bit, and has an error of second order
for parameters that depend on them. Before each evaluation the current values are
written where the ordinary right-hand side reads them.

The drive needs a correction besides. The kernel measures the twist from a drive of
constant speed, that of the middle of the segment. The true drive, with the speed
Omega(t), is ahead of it by

    ahead(t) = integral of (Omega - Omega_middle) dt = slope t (t - length) / 2 ,

which is zero at both ends of the segment: there the twist is the true one, and is
carried to the next segment unchanged. In between the true twist is less by ahead(t), so
the spring's moment is corrected. The bit angle is the same for both. Of a drive that is
not ideal the true lag is less by the same angle, so the spring needs no correction, but
the controller has to follow the true set point.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.compiler.words import fma, packed
from nsdrill.models.christoforou_yigit.options import Options
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.rhs import (
    DRIVE_PARAMETERS,
    INDEX,
    MAIN,
    PARAMETERS,
    REGULATOR_PARAMETERS,
    columns_of,
    make_right_hand_side,
    pack,
    rows_of,
)
from nsdrill.models.schedule import Array, Schedule

FIRST_MOVING = 1  # index; parameter 0, the set speed, stays that of the middle of the segment


def ramped_columns(options: Options = MAIN) -> tuple[str, ...]:
    """The names of the lane parameters along a ramp."""
    names = columns_of(options)
    moving = names[FIRST_MOVING:]
    return (
        *names,
        *(f"{name}_start" for name in moving),
        *(f"{name}_slope" for name in moving),
        "ahead_square",
        "ahead_linear",  # ahead = (ahead_square t + ahead_linear) t
    )


@lru_cache
def make_ramped(lanes: int, options: Options = MAIN) -> Any:
    """The compiled right-hand side along a ramp for a number of lanes and these
    options.

    Everything that the ordinary one reads and writes precedes the added parameters, so
    both use the same buffer.
    """
    columns = len(columns_of(options))
    width, moving = len(ramped_columns(options)), columns - FIRST_MOVING
    rows = rows_of(options, columns=width)
    W, driven = lanes, options.driven
    time_ = W * rows.stage_time
    ax_, ay_, alpha_, alpha_d_ = (W * (rows.acceleration + i) for i in (0, 1, 3, 4))
    cosine_, sine_ = W * rows.aux_now, W * (rows.aux_now + 1)
    moving_, start_, slope_ = (
        W * (rows.parameter + i) for i in (FIRST_MOVING, columns, columns + moving)
    )
    square_, linear_ = (W * (rows.parameter + i) for i in (width - 2, width - 1))
    k_t_, iJ_, q_ = (
        W * (rows.parameter + INDEX[name])
        for name in ("torsional_stiffness", "per_inertia", "unbalance_arm")
    )
    iJ_d_, K_i_, K_p_, G_t_, G_w_, _, torque_limit_ = (
        W * (rows.parameter + len(PARAMETERS) + i) for i in range(7)
    )
    twist_, speed_, lag_, omega_d_ = (W * (rows.stage + i) for i in (6, 7, 8, 9))
    T_m_rate_, motor = W * (rows.acceleration + 5), options.motor
    motor_damping_, per_time_ = (
        W * (rows.parameter + len(PARAMETERS) + len(DRIVE_PARAMETERS) + i) for i in range(2)
    )
    regulated, P = (
        options.regulated,
        {name: W * (rows.parameter + i) for i, name in enumerate(columns_of(options))},
    )
    _, _, _, g_lag_, g_drive_, g_twist_, g_speed_ = (
        P.get(name, 0) for name in REGULATOR_PARAMETERS
    )
    limited, set_speed_ = options.limited, W * rows.parameter
    motion = make_right_hand_side(lanes, options)

    @compiled(BUFFER)
    def ramped(b):  # type: ignore[no-untyped-def]
        for j in range(moving):
            for i in packed(W):
                b[moving_ + j * W + i] = fma(
                    b[slope_ + j * W + i], b[time_ + i], b[start_ + j * W + i]
                )
        motion(b)
        for i in packed(W):
            ahead = fma(b[square_ + i], b[time_ + i], b[linear_ + i]) * b[time_ + i]
            if driven:  # lag and twist are shifted alike, the set point is not
                ahead_rate = fma(2.0 * b[square_ + i], b[time_ + i], b[linear_ + i])
                correction = fma(b[K_i_ + i], ahead, (b[K_p_ + i] + b[G_w_ + i]) * ahead_rate)
                if limited:  # the part of it within the limits
                    lag, set_speed = b[lag_ + i], b[set_speed_ + i]
                    twist_part = fma(
                        b[G_t_ + i], b[twist_ + i] - lag, b[G_w_ + i] * (b[speed_ + i] - set_speed)
                    )
                    minus_T_m = fma(
                        b[K_i_ + i], lag, fma(b[K_p_ + i], b[omega_d_ + i] - set_speed, twist_part)
                    )
                    torque_limit = b[torque_limit_ + i]
                    correction = min(max(minus_T_m, -torque_limit), 0.0) - min(
                        max(minus_T_m - correction, -torque_limit), 0.0
                    )
                b[alpha_d_ + i] += correction * b[iJ_d_ + i]
                if motor:  # the voltage follows the set point
                    voltage_change = b[motor_damping_ + i] * ahead_rate
                    if regulated:
                        voltage_change += fma(
                            b[g_lag_ + i] + b[g_twist_ + i],
                            ahead,
                            (b[g_drive_ + i] + b[g_speed_ + i]) * ahead_rate,
                        )
                    b[T_m_rate_ + i] += voltage_change * b[per_time_ + i]
            else:
                correction = b[k_t_ + i] * ahead * b[iJ_ + i]
                b[alpha_ + i] += correction
                b[ax_ + i] = fma(b[q_ + i] * correction, b[sine_ + i], b[ax_ + i])
                b[ay_ + i] = fma(-b[q_ + i] * correction, b[cosine_ + i], b[ay_ + i])

    return ramped


def pack_ramp(
    parameters: Parameters, schedule: Schedule, cuts: Array, stuck_below: float = 0.0
) -> Array:
    """Lane parameters of the segments between ``cuts`` [s], shape (segments,
    columns)."""
    point = schedule.at(cuts)
    ends = pack(parameters, point.depth, point.wob, point.rotary_speed, stuck_below)
    length = np.diff(cuts)[:, np.newaxis]
    slope = np.diff(ends, axis=0) / length
    speed = INDEX["drive_speed"]
    acceleration = slope[:, speed]
    columns = ends.shape[1]
    moving = columns - FIRST_MOVING
    table = np.empty((len(cuts) - 1, columns + 2 * moving + 2))
    table[:, :columns] = ends[:-1]
    table[:, speed] = 0.5 * (ends[:-1, speed] + ends[1:, speed])
    table[:, columns : columns + moving] = ends[:-1, FIRST_MOVING:]
    table[:, columns + moving : columns + 2 * moving] = slope[:, FIRST_MOVING:]
    table[:, -2] = 0.5 * acceleration
    table[:, -1] = -0.5 * acceleration * length[:, 0]
    return table


def ahead(table: Array, cuts: Array, time: Array) -> Array:
    """The angle [rad] by which the true drive is ahead of the constant one of its
    segment at ``time`` [s], with the ``table`` of :func:`pack_ramp`: to be subtracted
    from the kernel's twist and lag."""
    segment = np.clip(np.searchsorted(cuts, time, side="right") - 1, 0, len(table) - 1)
    time_in_segment = np.clip(time - cuts[segment], 0.0, None)
    return (table[segment, -2] * time_in_segment + table[segment, -1]) * time_in_segment
