"""The right-hand side along a ramp: the ordinary one, with lane parameters that move in
time.

A ramp is a chain of short segments. Within one, every lane parameter moves linearly:
exact for speed and weight on bit, of second order small for what depends on them
otherwise. Before each evaluation the moving values are put where the ordinary
right-hand side reads them.

The drive needs more than that. The kernel counts the twist from a drive of constant
speed, that of the middle of the segment. The true drive, with the speed Omega(t), is
ahead of it by

    ahead(t) = integral of (Omega - Omega_middle) dt = slope t (t - length) / 2 ,

which is zero at both ends of the segment: there the twist is the true one, and is
carried on as it is. In between the true twist is less by that, so the spring's moment
is corrected. The bit angle is the same for both. The lag of a drive that is not ideal
is less by the same, so the spring needs nothing, but the controller has the set point
that moves.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, compiled
from nsdrill.elementary import fma
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

DRIVE = 1  # the drive's speed, the first parameter, stays that of the constant drive


def ramped_columns(options: Options = MAIN) -> tuple[str, ...]:
    """The names of the lane parameters along a ramp."""
    names = columns_of(options)
    moving = names[DRIVE:]
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

    All that the ordinary one reads and writes stands before the added parameters, so it
    runs in the same buffer.
    """
    columns = len(columns_of(options))
    width, moving = len(ramped_columns(options)), columns - DRIVE
    rows = rows_of(options, columns=width)
    W, driven = lanes, options.driven
    time_ = W * rows.stage_time
    ax_, ay_, alpha_, pull_ = (W * (rows.acceleration + i) for i in (0, 1, 3, 4))
    cosine_, sine_ = W * rows.aux_now, W * (rows.aux_now + 1)
    now_, start_, slope_ = (W * (rows.parameter + i) for i in (DRIVE, columns, columns + moving))
    square_, linear_ = (W * (rows.parameter + i) for i in (width - 2, width - 1))
    k_t_, iJ_, q_ = (
        W * (rows.parameter + INDEX[name])
        for name in ("torsional_stiffness", "per_inertia", "unbalance_arm")
    )
    iJ_d_, K_i_, K_p_, G_t_, G_w_, _, most_ = (
        W * (rows.parameter + len(PARAMETERS) + i) for i in range(7)
    )
    twist_, speed_, lag_, top_ = (W * (rows.stage + i) for i in (6, 7, 8, 9))
    surge_, motor = W * (rows.acceleration + 5), options.motor
    steep_, per_time_ = (
        W * (rows.parameter + len(PARAMETERS) + len(DRIVE_PARAMETERS) + i) for i in range(2)
    )
    regulated, P = (
        options.regulated,
        {name: W * (rows.parameter + i) for i, name in enumerate(columns_of(options))},
    )
    _, _, _, g_lag_, g_top_, g_twist_, g_speed_ = (P.get(name, 0) for name in REGULATOR_PARAMETERS)
    limited, set_ = options.limited, W * rows.parameter
    motion = make_right_hand_side(lanes, options)

    @compiled(types.void(BUFFER), W, *options)
    def ramped(b):  # type: ignore[no-untyped-def]
        for j in range(moving):
            for i in range(W):
                b[now_ + j * W + i] = fma(
                    b[slope_ + j * W + i], b[time_ + i], b[start_ + j * W + i]
                )
        motion(b)
        for i in range(W):
            ahead = fma(b[square_ + i], b[time_ + i], b[linear_ + i]) * b[time_ + i]
            if driven:  # lag and twist are ahead alike, but not the set point
                faster = fma(2.0 * b[square_ + i], b[time_ + i], b[linear_ + i])
                more = fma(b[K_i_ + i], ahead, (b[K_p_ + i] + b[G_w_ + i]) * faster)
                if limited:  # what the limits leave of it
                    lag, speed = b[lag_ + i], b[set_ + i]
                    pipe = fma(
                        b[G_t_ + i], b[twist_ + i] - lag, b[G_w_ + i] * (b[speed_ + i] - speed)
                    )
                    law = fma(b[K_i_ + i], lag, fma(b[K_p_ + i], b[top_ + i] - speed, pipe))
                    most = b[most_ + i]
                    more = min(max(law, -most), 0.0) - min(max(law - more, -most), 0.0)
                b[pull_ + i] += more * b[iJ_d_ + i]
                if motor:  # the voltage follows the set point
                    follows = b[steep_ + i] * faster
                    if regulated:
                        follows += fma(
                            b[g_lag_ + i] + b[g_twist_ + i],
                            ahead,
                            (b[g_top_ + i] + b[g_speed_ + i]) * faster,
                        )
                    b[surge_ + i] += follows * b[per_time_ + i]
            else:
                more = b[k_t_ + i] * ahead * b[iJ_ + i]
                b[alpha_ + i] += more
                b[ax_ + i] = fma(b[q_ + i] * more, b[sine_ + i], b[ax_ + i])
                b[ay_ + i] = fma(-b[q_ + i] * more, b[cosine_ + i], b[ay_ + i])

    return ramped


def pack_ramp(
    parameters: Parameters, schedule: Schedule, cuts: Array, stuck_below: float = 0.0
) -> Array:
    """Lane parameters of the segments between ``cuts`` [s], shape (segments, columns)."""
    point = schedule.at(cuts)
    ends = pack(parameters, point.depth, point.wob, point.rotary_speed, stuck_below)
    length = np.diff(cuts)[:, np.newaxis]
    slope = np.diff(ends, axis=0) / length
    speed = INDEX["drive_speed"]
    acceleration = slope[:, speed]
    n = ends.shape[1]
    moving = n - DRIVE
    table = np.empty((len(cuts) - 1, n + 2 * moving + 2))
    table[:, :n] = ends[:-1]
    table[:, speed] = 0.5 * (ends[:-1, speed] + ends[1:, speed])
    table[:, n : n + moving] = ends[:-1, DRIVE:]
    table[:, n + moving : n + 2 * moving] = slope[:, DRIVE:]
    table[:, -2] = 0.5 * acceleration
    table[:, -1] = -0.5 * acceleration * length[:, 0]
    return table


def ahead(table: Array, cuts: Array, time: Array) -> Array:
    """How far the true drive is ahead of the constant one of its segment [rad] at
    ``time`` [s], with the ``table`` of :func:`pack_ramp`: what is to be taken off the
    kernel's twist, and off its lag."""
    segment = np.clip(np.searchsorted(cuts, time, side="right") - 1, 0, len(table) - 1)
    within = np.clip(time - cuts[segment], 0.0, None)
    return (table[segment, -2] * within + table[segment, -1]) * within
