"""The string of segments along a ramp: its own right-hand side, with lane parameters
that move in time.

As :mod:`nsdrill.models.scalar_ramp` has it, but for three things. All angles of the
string are counted from the set speed. The voltage and the regulator follow the true set
speed, not that of the middle of a segment of the ramp. And the mud's pulsation and the
time at which control begins go by the time of the whole run: of a segment the clock
begins at zero. So while the right-hand side is evaluated, set speed and time are the
true ones, and the phase is less by what both would add to the angle of the drive.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.models.base import Array, Ramps, Variant
from nsdrill.models.leaves import Values
from nsdrill.models.schedule import Schedule
from nsdrill.observe.thresholds import Thresholds

SPEED = "set_speed"
ADDED = ("phase_kept", "time_kept", "speed_kept", "begun", "ahead_square", "ahead_linear")


class SegmentsRamps(Ramps):
    """Of the ``model`` of segments."""

    def __init__(self, model: Any) -> None:
        self.model = model

    def _names(self, variant: Variant) -> tuple[str, ...]:
        found: tuple[str, ...] = self.model.names(variant).parameters
        return found

    def columns(self, variant: Variant) -> tuple[str, ...]:
        own = self._names(variant)
        moving = [name for name in own if name != SPEED]
        return (
            *own,
            *(f"{name}_start" for name in moving),
            *(f"{name}_slope" for name in moving),
            *ADDED,
        )

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        from numba import types

        from nsdrill.abi import BUFFER, compiled
        from nsdrill.elementary import fma

        columns, own = self.columns(variant), self._names(variant)
        count = len(own)
        rows, W = self.model.rows(variant, columns=len(columns)), lanes
        place = {name: W * (rows.parameter + number) for number, name in enumerate(columns)}
        now = np.array([place[name] for name in own if name != SPEED])
        start_, slope_ = W * (rows.parameter + count), W * (rows.parameter + count + len(now))
        nodes = sum(variant[:2]) + 1
        angle_ = W * (rows.stage + 2 * nodes)
        speed_, time_, phase_ = place[SPEED], W * rows.stage_time, W * rows.phase
        saved_, clock_, mean_, begun_ = (place[name] for name in ADDED[:4])
        on_at_, turn_, by_torque = place["on_at"], W * (rows.acceleration + nodes), variant[2]
        square_, linear_ = place["ahead_square"], place["ahead_linear"]
        motion = self.model.right_hand_side(lanes, variant)

        @compiled(types.void(BUFFER), W, *variant)
        def ramped_segments(b):  # type: ignore[no-untyped-def]
            for j in range(len(now)):
                for i in range(W):
                    b[now[j] + i] = fma(b[slope_ + j * W + i], b[time_ + i], b[start_ + j * W + i])
            for i in range(W):
                t, mean = b[time_ + i], b[speed_ + i]
                ahead = fma(b[square_ + i], t, b[linear_ + i]) * t
                speed, time = mean + fma(2.0 * b[square_ + i], t, b[linear_ + i]), t + b[begun_ + i]
                b[saved_ + i], b[clock_ + i], b[mean_ + i] = b[phase_ + i], t, mean
                b[phase_ + i] += fma(mean, t, ahead) - speed * time
                b[speed_ + i], b[time_ + i] = speed, time
                for k in range(nodes):
                    b[angle_ + 2 * k * W + i] -= ahead
            motion(b)
            for i in range(W):
                t = b[clock_ + i]
                ahead = fma(b[square_ + i], t, b[linear_ + i]) * t
                b[phase_ + i], b[time_ + i], b[speed_ + i] = b[saved_ + i], t, b[mean_ + i]
                for k in range(nodes):
                    b[angle_ + 2 * k * W + i] += ahead
                if by_torque and t + b[begun_ + i] < b[on_at_ + i]:  # the top follows the set point
                    b[turn_ + i] += 2.0 * b[square_ + i]

        return ramped_segments

    def pack(
        self, parameters: Any, schedule: Schedule, cuts: Array, thresholds: Thresholds
    ) -> Array:
        point, variant = schedule.at(cuts), self.model.variant(parameters)
        values = Values(
            parameters, self.model.initial(), (point.depth, point.wob, point.rotary_speed)
        )
        ends = self.model.pack(values, thresholds)
        own = self._names(variant)
        moving = [place for place, name in enumerate(own) if name != SPEED]
        length, count = np.diff(cuts)[:, np.newaxis], len(own)
        slope, speed = np.diff(ends, axis=0) / length, own.index(SPEED)
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
