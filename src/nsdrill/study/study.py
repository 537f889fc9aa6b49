"""A validated study: plain frozen data in SI units. How it is read from YAML is in the
neighbouring files."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from nsdrill.kernel.settings import Simulation
from nsdrill.models.operation import Operation
from nsdrill.models.schedule import Ramp
from nsdrill.models.starts import Starts
from nsdrill.observe.thresholds import Record, Thresholds
from nsdrill.study.continuation import Continuation
from nsdrill.variables import Axis, Unknown

Procedure = Literal["same", "up", "down", "up-down"]


@dataclass(frozen=True)
class Study:
    """One study.

    ``axes`` holds depth [m], wob [N] and rotary_speed [rad/s], each a 1-D ascending
    float array, of length one (from ``operation``) where it is not swept, and the other
    numbers that are swept by their dotted keys, which ``more`` describes; ``ramps``
    those of the three that follow time in a single run, whose values at time zero are
    in ``operation``; ``swept`` the names that the file sweeps; ``along`` the axis along
    which the state is carried, None for procedure ``same``. ``text`` is the YAML as
    read, ``overrides`` the ``--set`` texts, ``resolved`` the complete study, defaults
    filled in and in SI, as plain data, ``sha256`` the digest of that. ``refined`` names
    the axes whose values are those of a grid refined ``refine`` times, of which every
    ``2**refine``-th is run first. ``drawn`` holds the samples of the uncertain numbers
    by key, each [samples], and ``unknowns`` describes them; a single simulation takes
    the values of their own sections. ``continuation`` is the section ``continue``, None
    where there is none.
    """

    title: str
    model: str
    parameters: Any
    operation: Operation
    initial: Starts
    axes: dict[str, np.ndarray]
    swept: tuple[str, ...]
    procedure: Procedure
    along: str | None
    simulation: Simulation
    thresholds: Thresholds
    record: Record
    text: str
    source: str
    overrides: tuple[str, ...] = ()
    resolved: dict[str, Any] = field(default_factory=dict)
    sha256: str = ""
    refine: int = 0
    refined: tuple[str, ...] = ()
    more: tuple[Axis, ...] = ()
    ramps: dict[str, Ramp] = field(default_factory=dict)
    continuation: Continuation | None = None
    drawn: dict[str, np.ndarray] = field(default_factory=dict)
    unknowns: tuple[Unknown, ...] = ()

    @property
    def samples(self) -> int:
        """With how many samples of the uncertain numbers each point is run; 0 where no
        number is uncertain."""
        return len(next(iter(self.drawn.values()))) if self.drawn else 0

    @property
    def varied(self) -> dict[str, np.ndarray]:
        """The values of all numbers that differ from run to run, by key: of the axes
        and of the unknowns."""
        return {**self.axes, **self.drawn}

    @property
    def ramped(self) -> tuple[str, ...]:
        """The names of ``ramps`` that no sweep replaces."""
        return tuple(name for name in self.ramps if name not in self.swept)
