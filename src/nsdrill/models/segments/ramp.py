"""The string of segments along a ramp: its own right-hand side, with lane parameters
that move in time.

This differs from :mod:`nsdrill.models.scalar_ramp` in three things:

- All angles of the string are counted from the set speed.
- The voltage and the regulator follow the true set speed, not that of the middle of a
  segment of the ramp.
- The mud's pulsation and the time at which control begins refer to the time of the
  whole run, while the kernel's time begins at zero in each segment.

So while the right-hand side is evaluated, set speed and time are the true ones, and the
phase is less by what both would add to the angle of the drive.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.models.base import Array, Ramps, Variant
from nsdrill.models.leaves import Values
from nsdrill.models.schedule import Schedule
from nsdrill.observe.thresholds import Thresholds

SPEED = "set_speed"
ADDED = (
    "saved_phase",
    "saved_time",
    "saved_speed",
    "segment_start",
    "ahead_square",
    "ahead_linear",
)


class SegmentsRamps(Ramps):
    """The ``model`` of segments along ramps."""

    def __init__(self, model: Any) -> None:
        self.model = model

    def _names(self, variant: Variant) -> tuple[str, ...]:
        names: tuple[str, ...] = self.model.names(variant).parameters
        return names

    def columns(self, variant: Variant) -> tuple[str, ...]:
        names = self._names(variant)
        moving = [name for name in names if name != SPEED]
        return (
            *names,
            *(f"{name}_start" for name in moving),
            *(f"{name}_slope" for name in moving),
            *ADDED,
        )

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        from nsdrill.compiler.functions import BUFFER, compiled
        from nsdrill.compiler.words import fma, packed

        columns, names = self.columns(variant), self._names(variant)
        count = len(names)
        rows, W = self.model.rows(variant, columns=len(columns)), lanes
        offset = {name: W * (rows.parameter + number) for number, name in enumerate(columns)}
        moving_ = np.array([offset[name] for name in names if name != SPEED])
        start_, slope_ = W * (rows.parameter + count), W * (rows.parameter + count + len(moving_))
        nodes = sum(variant[:2]) + 1
        angle_ = W * (rows.stage + 2 * nodes)
        speed_, time_, phase_ = offset[SPEED], W * rows.stage_time, W * rows.phase
        saved_phase_, saved_time_, saved_speed_, segment_start_ = (
            offset[name] for name in ADDED[:4]
        )
        on_at_, drive_acceleration_, by_torque = (
            offset["on_at"],
            W * (rows.acceleration + nodes),
            variant[2],
        )
        square_, linear_ = offset["ahead_square"], offset["ahead_linear"]
        motion = self.model.right_hand_side(lanes, variant)

        @compiled(BUFFER)
        def ramped_segments(b):  # type: ignore[no-untyped-def]
            for j in range(len(moving_)):
                for i in packed(W):
                    b[moving_[j] + i] = fma(
                        b[slope_ + j * W + i], b[time_ + i], b[start_ + j * W + i]
                    )
            for i in packed(W):
                t, middle_speed = b[time_ + i], b[speed_ + i]
                ahead = fma(b[square_ + i], t, b[linear_ + i]) * t
                speed, time = (
                    middle_speed + fma(2.0 * b[square_ + i], t, b[linear_ + i]),
                    t + b[segment_start_ + i],
                )
                b[saved_phase_ + i], b[saved_time_ + i], b[saved_speed_ + i] = (
                    b[phase_ + i],
                    t,
                    middle_speed,
                )
                b[phase_ + i] += fma(middle_speed, t, ahead) - speed * time
                b[speed_ + i], b[time_ + i] = speed, time
                for k in range(nodes):
                    b[angle_ + 2 * k * W + i] -= ahead
            motion(b)
            for i in packed(W):
                t = b[saved_time_ + i]
                ahead = fma(b[square_ + i], t, b[linear_ + i]) * t
                b[phase_ + i], b[time_ + i], b[speed_ + i] = (
                    b[saved_phase_ + i],
                    t,
                    b[saved_speed_ + i],
                )
                for k in range(nodes):
                    b[angle_ + 2 * k * W + i] += ahead
                if by_torque:
                    now = b[drive_acceleration_ + i]
                    follows = t + b[segment_start_ + i] < b[on_at_ + i]  # the set point
                    b[drive_acceleration_ + i] = now + 2.0 * b[square_ + i] if follows else now

        return ramped_segments

    def pack(
        self, parameters: Any, schedule: Schedule, cuts: Array, thresholds: Thresholds
    ) -> Array:
        point, variant = schedule.at(cuts), self.model.variant(parameters)
        values = Values(
            parameters, self.model.initial(), (point.depth, point.wob, point.rotary_speed)
        )
        ends = self.model.pack(values, thresholds)
        names = self._names(variant)
        moving = [column for column, name in enumerate(names) if name != SPEED]
        length, count = np.diff(cuts)[:, np.newaxis], len(names)
        slope, speed = np.diff(ends, axis=0) / length, names.index(SPEED)
        table = np.zeros((len(cuts) - 1, len(self.columns(variant))))
        table[:, :count] = ends[:-1]
        table[:, speed] = 0.5 * (ends[:-1, speed] + ends[1:, speed])
        table[:, count : count + len(moving)] = ends[:-1, moving]
        table[:, count + len(moving) : count + 2 * len(moving)] = slope[:, moving]
        table[:, -3] = cuts[:-1]
        table[:, -2] = 0.5 * slope[:, speed]
        table[:, -1] = -0.5 * slope[:, speed] * length[:, 0]
        return table

    def mend(
        self, samples: Array, table: Array, cuts: Array, time: Array, variant: Variant
    ) -> None:
        segment = np.clip(np.searchsorted(cuts, time, side="right") - 1, 0, len(table) - 1)
        within = np.clip(time - cuts[segment], 0.0, None)
        ahead = (table[segment, -2] * within + table[segment, -1]) * within
        nodes = sum(variant[:2]) + 1
        samples[:, 2 * nodes : 4 * nodes : 2] -= ahead[:, np.newaxis]
