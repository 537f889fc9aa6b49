"""A scalar model along a ramp: its own right-hand side, with lane parameters that move
in time.

Before each evaluation the moving values are written where the right-hand side reads
them. In the kernel, angles are relative to a drive of constant speed, that of the
middle of a segment; the true drive is ahead of it by ahead(t) = slope t (t - length) /
2, which is zero at both ends. So while the right-hand side is evaluated, positions
relative to the drive are less by ahead(t), and the phase is greater by it. The set
speed that a controller reads is that of the middle of the segment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.models.base import Array, Ramps, Variant
from nsdrill.models.leaves import Values
from nsdrill.models.schedule import Schedule
from nsdrill.observe.thresholds import Thresholds

if TYPE_CHECKING:
    from nsdrill.models.scalar_model import ScalarModel


class ScalarRamps(Ramps):
    """A ``model`` with the lane parameter ``drive_speed`` and with ``frames``, along
    ramps."""

    def __init__(self, model: ScalarModel) -> None:
        self.model = model

    def _moving(self, variant: Variant) -> list[int]:
        """The indices of the lane parameters that move: all but the drive speed."""
        names = self.model.names(variant).parameters
        return [place for place, name in enumerate(names) if name != "drive_speed"]

    def columns(self, variant: Variant) -> tuple[str, ...]:
        names = self.model.names(variant).parameters
        moving = [names[place] for place in self._moving(variant)]
        saved = (*(f"saved_{name}" for name in self.model.frames), "saved_phase")
        return (
            *names,
            *(f"{name}_start" for name in moving),
            *(f"{name}_slope" for name in moving),
            *saved,
            "ahead_square",
            "ahead_linear",
        )

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        from nsdrill.compiler.functions import BUFFER, compiled
        from nsdrill.compiler.words import fma, packed

        names, columns = self.model.names(variant), self.columns(variant)
        rows, W = self.model.rows(variant, columns=len(columns)), lanes
        offset = {name: W * (rows.parameter + number) for number, name in enumerate(columns)}
        count = len(names.parameters)
        moving_ = np.array([W * (rows.parameter + number) for number in self._moving(variant)])
        start_, slope_ = W * (rows.parameter + count), W * (rows.parameter + count + len(moving_))
        frames = np.array(
            [W * (rows.stage + names.states.index(name)) for name in self.model.frames], np.int64
        )
        saved_ = slope_ + W * len(moving_)
        time_, phase_, saved_phase_ = W * rows.stage_time, W * rows.phase, offset["saved_phase"]
        square_, linear_ = offset["ahead_square"], offset["ahead_linear"]
        motion = self.model.right_hand_side(lanes, variant)

        @compiled(BUFFER)
        def ramped(b):  # type: ignore[no-untyped-def]
            for j in range(len(moving_)):
                for i in packed(W):
                    b[moving_[j] + i] = fma(
                        b[slope_ + j * W + i], b[time_ + i], b[start_ + j * W + i]
                    )
            for i in packed(W):
                ahead = fma(b[square_ + i], b[time_ + i], b[linear_ + i]) * b[time_ + i]
                b[saved_phase_ + i] = b[phase_ + i]
                b[phase_ + i] += ahead
                for k in range(len(frames)):
                    b[saved_ + k * W + i] = b[frames[k] + i]
                    b[frames[k] + i] -= ahead
            motion(b)
            for i in packed(W):
                b[phase_ + i] = b[saved_phase_ + i]
                for k in range(len(frames)):
                    b[frames[k] + i] = b[saved_ + k * W + i]

        return ramped

    def pack(
        self, parameters: Any, schedule: Schedule, cuts: Array, thresholds: Thresholds
    ) -> Array:
        point, variant = schedule.at(cuts), self.model.variant(parameters)
        initial = self.model.initial()
        ends = self.model.pack(
            Values(parameters, initial, (point.depth, point.wob, point.rotary_speed)), thresholds
        )
        names, columns, moving = (
            self.model.names(variant).parameters,
            self.columns(variant),
            self._moving(variant),
        )
        length = np.diff(cuts)[:, np.newaxis]
        slope = np.diff(ends, axis=0) / length
        speed = names.index("drive_speed")
        table = np.zeros((len(cuts) - 1, len(columns)))
        table[:, : len(names)] = ends[:-1]
        table[:, speed] = 0.5 * (ends[:-1, speed] + ends[1:, speed])
        table[:, len(names) : len(names) + len(moving)] = ends[:-1, moving]
        table[:, len(names) + len(moving) : len(names) + 2 * len(moving)] = slope[:, moving]
        table[:, -2] = 0.5 * slope[:, speed]
        table[:, -1] = -0.5 * slope[:, speed] * length[:, 0]
        return table

    def mend(
        self, samples: Array, table: Array, cuts: Array, time: Array, variant: Variant
    ) -> None:
        segment = np.clip(np.searchsorted(cuts, time, side="right") - 1, 0, len(table) - 1)
        within = np.clip(time - cuts[segment], 0.0, None)
        ahead = (table[segment, -2] * within + table[segment, -1]) * within
        for name in self.model.frames:
            samples[:, self.model.names(variant).states.index(name)] -= ahead
