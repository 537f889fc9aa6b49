"""The operating point of a model, which for a drill string is depth, weight on bit and
rotary speed; schedules, along which it varies in time, piecewise linear between knots and
constant after the last one; the base of a model's parameters; and the values of points.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from nsdrill.data import Array, read_only
from nsdrill.models.starts import Starts
from nsdrill.ranges import Checked, parameter
from nsdrill.records import dataclass

LARGEST_FORCE = 1e7  # N
LARGEST_LENGTH = 1e5  # m
Numeric = float | Array  # a number, or an array over operating points


def in_trace_as(name: str) -> str:
    """The name of an operating value in a trace."""
    return "drive_speed" if name == "rotary_speed" else name


@dataclass(frozen=True)
class OperatingPoint(Checked):
    """What is varied from point to point, and may vary in time; here nothing. A model that
    has an operating point declares it in a subclass, a field for each value: these are axes
    with their own names. A name means the same in every model: ``depth`` [m], ``wob`` [N]
    and ``rotary_speed`` [rad/s] are those of :class:`Operation`."""

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """The names of its values, in order."""
        return tuple([item.name for item in fields(cls)])


@dataclass(frozen=True)
class ModelParameters:
    """The numbers of a model beside the operating point and the start, a field for each
    section of a study. Every model has a subclass, which says what its ``point``, the
    operating point, is made of."""

    point: ClassVar[type[OperatingPoint]] = OperatingPoint
    reads: ClassVar[tuple[Any, ...]] = ()
    """What each word of its choices reads (:class:`nsdrill.models.rules.Reads`)."""

    @property
    def unread(self) -> frozenset[str]:
        """The keys of a study that a string with these choices does not read."""
        return frozenset().union(*[reads.unread(self) for reads in self.reads])


P = TypeVar("P", bound=ModelParameters)


@dataclass(frozen=True)
class Values(Generic[P]):
    """The values of points: the parameters and the start, with arrays [points] where an
    axis varies a number, and the operation, in the order of the model: of a drill
    string depth [m], weight on bit [N] and rotary speed [rad/s]. The arrays cannot be
    written to, as they may be those of the axes."""

    parameters: P
    initial: Starts
    operation: tuple[Any, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "operation", tuple(map(read_only, self.operation)))

    @property
    def point(self) -> Any:
        """The operating point of a single point, as its model declares it."""
        return self.parameters.point(*map(float, self.operation))


@dataclass(frozen=True)
class Operation(OperatingPoint):
    """The operating point of a drill string."""

    depth: float = parameter(
        5000.0, "m", "P", "certain", low=1e-2, high=LARGEST_LENGTH, usual="100 to 12 300 m; laboratory rigs 1 m"
    )
    wob: float = parameter(22.24e3, "N", "P (5 klbf)", "certain", high=LARGEST_FORCE, usual="0 to 500 kN")
    rotary_speed: float = parameter(
        3.0, "rad/s", "P", "certain", low=1e-9, high=1e3, usual="20 to 300 rpm, with a motor 1000 rpm"
    )


@dataclass(frozen=True)
class Hoisted(Operation):
    """The operating point of a drill string whose bit may hang clear of the rock: a weight
    below zero is the pull at the hook beyond that at which the bit carries nothing [N]."""

    wob: float = parameter(0.0, "N", low=-LARGEST_FORCE, high=LARGEST_FORCE)


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

    @cached_property
    def knots(self) -> tuple[Array, Array]:
        """The times and the values as arrays."""
        return np.array(self.times), np.array(self.values)

    def at(self, time: Array) -> Array:
        return np.interp(time, *self.knots)


def integral(times: Array, values: Array, time: Array) -> Array:
    """The exact integral from zero to ``time`` [s] of what is ``values`` at the ascending
    ``times``, linear between them and constant after the last."""
    time = np.asarray(time, dtype=float)
    if len(times) == 1:
        return np.asarray(values[0] * time)
    total = np.concatenate([[0.0], np.cumsum(np.diff(times) * 0.5 * (values[1:] + values[:-1]))])
    leg = np.searchsorted(times, time, side="right") - 1
    within = time - times[leg]
    return np.asarray(total[leg] + 0.5 * (values[leg] + np.interp(time, times, values)) * within)


class History(SimpleNamespace):
    """The operating point at each of many times: arrays of one shape by the names of its
    values."""


@dataclass(frozen=True)
class Schedule:
    """``operation``, whose values follow those of the ``ramps`` that have their
    name."""

    operation: OperatingPoint
    ramps: Mapping[str, Ramp]

    def __post_init__(self) -> None:
        for name, ramp in self.ramps.items():
            for value in (float(np.min(ramp.knots[1])), float(np.max(ramp.knots[1]))):
                replace(self.operation, **{name: value})  # ValueError where it is out of range

    @property
    def start(self) -> Any:
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
            for item in fields(self.operation)
        }
        return History(**values)

    def knots(self, *names: str) -> Array:
        """The times of the knots of these ramps, or of all, from zero on [s]."""
        ramps = (ramp for name, ramp in self.ramps.items() if not names or name in names)
        return np.unique(np.concatenate([[0.0], *(ramp.knots[0] for ramp in ramps)]))

    def cuts(self, duration: float, pieces: int = PIECES) -> Array:
        """The ends of the segments from 0 to ``duration`` [s], every knot among them.

        A leg between two knots is cut so finely that no value changes by more than
        1/``pieces`` of itself in one segment, but into at most ``pieces`` segments. A
        leg on which no value changes is one segment, and so is one shorter than
        :data:`SHORT_LEG`, as between the samples of a log: it is over before the string
        has moved.
        """
        knots = self.knots()
        times = np.append(knots[knots < duration], duration)
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
        if not len(cut):
            return times
        parts = [np.linspace(times[i], times[i + 1], counts[i], endpoint=False) for i in cut]
        return np.unique(np.concatenate([times, *parts]))
