"""From how many states an operating point is started: the part of a study's start that every model has."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nsdrill.ranges import Checked, parameter


def state(default: float | None, units: str, reach: float, usual: str, meaning: str = "") -> Any:
    """A state at the start, at most ``reach`` in size; None stands for a natural value."""
    return parameter(default, units, low=-reach, high=reach, usual=usual, meaning=meaning)


@dataclass(frozen=True)
class Starts(Checked):
    """With an ``ensemble`` of two or more every operating point is started from so many states, drawn as the model
    says; with a ``slice``, {state: {from, to, points}} of two states in SI, from all pairs of their values, the other
    states as given. A model adds its states."""

    ensemble: int = parameter(0, high=100_000, usual="16 to 1000")
    seed: int = parameter(0, high=10**15, usual="any")
    spread: float = parameter(1.0, low=1e-6, high=1.0, usual="0.1 to 1")
    slice: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def starts(self) -> int:
        """How many states each operating point is started from, where there are several; else 0."""
        if self.slice:
            return math.prod(int(axis["points"]) for axis in self.slice.values())
        return self.ensemble if self.ensemble > 1 else 0


def slice_values(initial: Starts, states: tuple[str, ...]) -> dict[str, Any]:
    """The two states of a slice and their values, arrays, in the order of ``states``; the second runs faster over the
    starts."""
    return {
        name: np.linspace(axis["from"], axis["to"], int(axis["points"]))
        for name in states
        if (axis := initial.slice.get(name))
    }
