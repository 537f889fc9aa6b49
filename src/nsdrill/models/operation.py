"""The operating point, which every model of a drill string has; schedules, along which it
varies in time, piecewise linear between knots and constant after the last one; and the
base of a model's parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from nsdrill.data import Array
from nsdrill.ranges import Checked, parameter

LARGEST_FORCE = 1e7  # N
LARGEST_LENGTH = 1e5  # m
Numeric = float | Array  # a number, or an array over operating points
# The names of the operating values in a trace.
SCHEDULED = {"depth": "depth", "wob": "wob", "rotary_speed": "drive_speed"}


@dataclass(frozen=True)
class ModelParameters:
    """The numbers of a model beside the operating point and the start, a field for each
    section of a study. Every model has a subclass."""

    @property
    def unread(self) -> frozenset[str]:
        """The keys of a study that a string with these choices does not read."""
        return frozenset()


@dataclass(frozen=True)
class Operation(Checked):
    """The operating point."""

    depth: float = parameter(
        5000.0, "m", "P", "certain", low=1e-2, high=LARGEST_LENGTH, usual="100 to 12 300 m; laboratory rigs 1 m"
    )
    wob: float = parameter(22.24e3, "N", "P (5 klbf)", "certain", high=LARGEST_FORCE, usual="0 to 500 kN")
    rotary_speed: float = parameter(
        3.0, "rad/s", "P", "certain", low=1e-9, high=1e3, usual="20 to 300 rpm, with a motor 1000 rpm"
    )


PIECES = 256  # segments of a leg along which a value doubles, and the most of any leg
SHORT_LEG = 0.05  # s


@dataclass(frozen=True)
class Ramp:
    """Values [SI] at ascending ``times`` [s], of which the first is zero."""

    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.times) != len(self.values) or len(self.times) < 2:
            raise ValueError("ramp: found fewer than two knots, allowed: two or more")
        if self.times[0] != 0.0 or not np.all(np.diff(self.times) > 0.0) or not np.all(np.isfinite(self.times)):
            raise ValueError("ramp: found times that do not ascend from 0 s")

    def at(self, time: Array) -> Array:
        return np.interp(time, self.times, self.values)


@dataclass(frozen=True)
class History:
    """The operating point at each of many times: arrays of one shape, with the names of
    :class:`Operation`."""

    depth: Array
    wob: Array
    rotary_speed: Array


@dataclass(frozen=True)
class Schedule:
    """``operation``, whose values follow those of the ``ramps`` that have their
    name."""

    operation: Operation
    ramps: Mapping[str, Ramp]

    def __post_init__(self) -> None:
        for name, ramp in self.ramps.items():
            for value in (float(np.min(ramp.values)), float(np.max(ramp.values))):
                replace(self.operation, **{name: value})  # ValueError where it is out of range

    @property
    def start(self) -> Operation:
        """The operating point at time zero."""
        return replace(self.operation, **{name: ramp.values[0] for name, ramp in self.ramps.items()})

    @property
    def end(self) -> float:
        """The time of the last knot [s]; 0 without a ramp."""
        return max((ramp.times[-1] for ramp in self.ramps.values()), default=0.0)

    def at(self, time: Array) -> History:
        """The operating point at ``time`` [s]."""
        time = np.asarray(time, dtype=float)
        values = {
            item.name: self.ramps[item.name].at(time)
            if item.name in self.ramps
            else np.full(time.shape, getattr(self.operation, item.name))
            for item in fields(Operation)
        }
        return History(**values)

    def drive_angle(self, time: Array) -> Array:
        """The angle of the drive since time zero [rad]: the exact integral of its
        speed."""
        time = np.asarray(time, dtype=float)
        ramp = self.ramps.get("rotary_speed")
        if ramp is None:
            return self.operation.rotary_speed * time
        times, values = np.array(ramp.times), np.array(ramp.values)
        angle = np.concatenate([[0.0], np.cumsum(np.diff(times) * 0.5 * (values[1:] + values[:-1]))])
        leg = np.searchsorted(times, time, side="right") - 1
        within = time - times[leg]
        return angle[leg] + 0.5 * (values[leg] + ramp.at(time)) * within

    def cuts(self, duration: float, pieces: int = PIECES) -> Array:
        """The ends of the segments from 0 to ``duration`` [s], every knot among them.

        A leg between two knots is cut so finely that no value changes by more than
        1/``pieces`` of itself in one segment, but into at most ``pieces`` segments. A
        leg on which no value changes is one segment, and so is one shorter than
        :data:`SHORT_LEG`, as between the samples of a log: it is over before the string
        has moved.
        """
        knots = {time for ramp in self.ramps.values() for time in ramp.times if time < duration}
        times = np.array(sorted({0.0, duration, *knots}))
        ends = self.at(times)
        change = np.zeros(len(times) - 1)
        for name in self.ramps:
            values = getattr(ends, name)
            lesser = np.maximum(np.minimum(values[1:], values[:-1]), 1e-300)
            with np.errstate(over="ignore"):
                change = np.maximum(change, np.abs(np.diff(values)) / lesser)
        change[np.diff(times) < SHORT_LEG] = 0.0
        counts = np.clip(np.ceil(np.minimum(change, 1.0) * pieces), 1, pieces).astype(int)
        cut = np.flatnonzero(counts > 1)
        parts = [np.linspace(times[i], times[i + 1], counts[i], endpoint=False) for i in cut]
        return np.unique(np.concatenate([times, *parts]))
