"""A model along a ramp: its own equations, with lane parameters that move in time.

A ramp is a chain of short segments. Within a segment every lane parameter changes
linearly: this is exact for speed and weight on bit, and has an error of second order
for parameters that depend on them.

In the kernel, angles are relative to a drive of constant speed, that of the middle of a
segment. The true drive, with the speed Omega(t), is ahead of it by

    ahead(t) = integral of (Omega - Omega_middle) dt = slope t (t - length) / 2 ,

which is zero at both ends: there the angles are the true ones, and are carried to the
next segment unchanged. The equations read the true set speed, the time of the whole
run, and angles that are less by ahead(t).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Node
from nsdrill.equations.trace import Named
from nsdrill.models.operation import ModelParameters, Schedule, Values
from nsdrill.models.responses import Thresholds
from nsdrill.models.starts import Starts
from nsdrill.models.variant import Variant
from nsdrill.records import dataclass

AHEAD = "segment_start", "ahead_square", "ahead_linear"
# The rate of the set speed [rad/s^2], for a drive that follows it; a lane parameter that
# is 0 where the set speed is constant.
SET_RATE = "set_acceleration"


@dataclass(frozen=True)
class Course:
    """What equations read along a ramp. ``names`` are the lane parameters that move,
    ``speed`` is the set speed, ``turning`` the angles relative to the drive."""

    names: tuple[str, ...]
    speed: str
    turning: tuple[str, ...]

    def moved(self, t: Node, phase: Node, s: Named, p: Named) -> tuple[Node, Node, Named, Named]:
        """Time, phase, states and parameters in place of those of the kernel."""
        states = vars(s) | {}
        ahead = (p.ahead_square * t + p.ahead_linear) * t
        rate = 2.0 * p.ahead_square * t + p.ahead_linear
        middle = getattr(p, self.speed)
        time, speed = t + p.segment_start, middle + rate
        states |= {name: states[name] - ahead for name in self.turning}
        parameters = {name: getattr(p, f"{name}_slope") * t + getattr(p, f"{name}_start") for name in self.names}
        parameters |= {self.speed: speed, SET_RATE: 2.0 * p.ahead_square}
        phase = phase + ((middle * t + ahead) - speed * time)
        return time, phase, Named(**states), Named(**parameters)


def ahead_of(table: Array, cuts: Array, time: Array) -> Array:
    """The angle [rad] by which the true drive is ahead of the constant one of its
    segment at ``time`` [s], with the ``table`` of :meth:`Ramps.pack`."""
    segment = np.clip(np.searchsorted(cuts, time, side="right") - 1, 0, len(table) - 1)
    within = np.clip(time - cuts[segment], 0.0, None)
    return np.asarray((table[segment, -2] * within + table[segment, -1]) * within)


@lru_cache(maxsize=512)
def ramps_of(variant: Variant) -> Ramps:
    """A variant along ramps, of which there is one, with what is compiled of it."""
    return Ramps(variant)


class Ramps:
    """A ``variant`` of a model along ramps (:func:`ramps_of`)."""

    def __init__(self, variant: Variant) -> None:
        self.variant = variant

    @cached_property
    def course(self) -> Course:
        names, speed = self.variant.names.parameters, self.variant.model.set_speed
        return Course(tuple(name for name in names if name != speed), speed, self.variant.turning)

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the lane parameters: those of the model, then those of their course
        in time."""
        ends = (f"{name}_{word}" for word in ("start", "slope") for name in self.course.names)
        return (*self.variant.names.parameters, *ends, *AHEAD)

    @lru_cache  # noqa: B019  # variants live as long as the process
    def right_hand_side(self, lanes: int) -> Any:
        """The compiled right-hand side."""
        motion = replace(self.variant.motion, parameters=self.columns, course=self.course)
        return motion.right_hand_side(lanes, self.variant.rows(columns=len(self.columns)))

    def pack(
        self, parameters: ModelParameters, initial: Starts, schedule: Schedule, cuts: Array, thresholds: Thresholds
    ) -> Array:
        """Lane parameters of the segments between ``cuts`` [s], shape (segments,
        columns)."""
        points = Values(parameters, initial, tuple(vars(schedule.at(cuts)).values()))
        ends = self.variant.model.pack(points, thresholds, len(cuts))
        names, course = self.variant.names.parameters, self.course
        moving, speed = [names.index(name) for name in course.names], names.index(course.speed)
        length = np.diff(cuts)
        slope = np.diff(ends, axis=0) / length[:, np.newaxis]
        first = ends[:-1].copy()
        first[:, speed] = 0.5 * (ends[:-1, speed] + ends[1:, speed])
        ahead = cuts[:-1], 0.5 * slope[:, speed], -0.5 * slope[:, speed] * length
        return np.column_stack([first, ends[:-1, moving], slope[:, moving], *ahead])

    def following(self, parameters: ModelParameters, schedule: Schedule, cuts: Array) -> Array:
        """The rates at which held positions follow the operating point between ``cuts``
        [s], beside the rates of their frames, shape (segments, slopes)."""
        variant = self.variant
        rates = np.zeros((len(cuts) - 1, variant.rows().own_slopes))
        for position, heights in variant.model.resting(parameters, schedule.at(cuts)).items():
            rates[:, variant.states.index(position) // 2] = np.diff(heights) / np.diff(cuts)
        return rates

    def correct(self, samples: Array, table: Array, cuts: Array, time: Array) -> None:
        """Convert, in place, the states that the kernel has sampled at ``time`` [s],
        shape (samples, states), to the true ones."""
        for name in self.variant.turning:
            samples[:, self.variant.states.index(name)] -= ahead_of(table, cuts, time)
