"""The states from which an operating point is started: the part of a study's start that
every model has."""

from __future__ import annotations

import math
from dataclasses import field, fields
from typing import Any

import numpy as np

from nsdrill.ranges import Checked, parameter
from nsdrill.records import dataclass


def state(default: float | None, units: str, reach: float, usual: str, meaning: str = "") -> Any:
    """A state at the start, at most ``reach`` in magnitude; None stands for a natural
    value."""
    return parameter(default, units, low=-reach, high=reach, usual=usual, meaning=meaning)


@dataclass(frozen=True)
class Starts(Checked):
    """With an ``ensemble`` of two or more, every operating point is started from so
    many states, drawn as the model defines; with a ``slice``, {state: {from, to,
    points}} of two states in SI, from all pairs of their values, with the other states
    of the study. A model adds its states."""

    ensemble: int = parameter(0, high=100_000, usual="16 to 1000")
    seed: int = parameter(0, high=10**15, usual="any")
    spread: float = parameter(1.0, low=1e-6, high=1.0, usual="0.1 to 1")
    slice: dict[str, dict[str, Any]] = field(default_factory=dict)

    @classmethod
    def states(cls) -> tuple[str, ...]:
        """The names of the states that a start of the model gives, in order."""
        shared = {item.name for item in fields(Starts)}
        return tuple(item.name for item in fields(cls) if item.name not in shared)

    @property
    def starts(self) -> int:
        """The number of states from which each operating point is started, 0 for a
        single one."""
        if self.slice:
            return math.prod(int(axis["points"]) for axis in self.slice.values())
        return self.ensemble if self.ensemble > 1 else 0


def hypercube(seed: int, count: int, draws: int) -> np.ndarray:
    """Random numbers of ``count`` starts, uniform in [0, 1), shape (count, draws).
    Start k has the words from k ``draws`` on of the Philox 4x64 generator (Salmon et
    al. 2011) whose key is the seed, of each the upper 53 bits."""
    words = np.random.Philox(key=seed).random_raw(count * draws)
    return np.asarray((words >> np.uint64(11)) * 2.0**-53).reshape(count, draws)


def in_the_disc(pairs: np.ndarray) -> np.ndarray:
    """Points of the unit disc [n, 2] from pairs of numbers in [0, 1), computed one by
    one with scalar functions, whose bits do not depend on the length of an array."""
    points = [
        (math.sqrt(a) * math.cos(2 * math.pi * b), math.sqrt(a) * math.sin(2 * math.pi * b)) for a, b in pairs.tolist()
    ]
    return np.array(points).reshape(-1, 2)


def slice_points(initial: Starts, states: tuple[str, ...], number: np.ndarray) -> dict[str, np.ndarray]:
    """The two states of a slice, in the order of ``states``, and their values at the
    starts with these numbers."""
    axes = slice_values(initial, states)
    indices = np.unravel_index(number, [len(values) for values in axes.values()])
    return {name: values[index] for (name, values), index in zip(axes.items(), indices, strict=True)}


def slice_values(initial: Starts, states: tuple[str, ...]) -> dict[str, Any]:
    """The two states of a slice and their values, arrays, in the order of ``states``;
    the second varies fastest over the starts."""
    return {
        name: np.linspace(axis["from"], axis["to"], int(axis["points"]))
        for name in states
        if (axis := initial.slice.get(name))
    }
