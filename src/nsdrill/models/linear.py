"""Small deviations from steady drilling, of all states together, from the equations: what
grows, and up to which set speed. (:mod:`nsdrill.models.steady` has those of what turns.)"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Node
from nsdrill.equations.motion import Motion
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import traced
from nsdrill.models.steady import String, refined

TRIED = 61  # set speeds among which the greatest unstable one is looked for first
REACH = 40.0  # of the speed that is asked for, in both directions


@lru_cache
def _differentiated(motion: Motion) -> tuple[tuple[str, ...], Mapping[str, Node]]:
    """(the states that have slopes of their own, the changes of these slopes)."""
    graph, slopes, _ = traced(motion.equations, motion.states, motion.parameters, motion.options, with_slopes=True)
    seeds = {graph.input(f"s.{name}"): graph.input(f"d.{name}") for name in motion.states}
    moved = tuple(slopes)
    return moved, Tangents(graph, seeds).of({name: graph.node(slopes[name]) for name in moved})


def matrix_of(string: String, speeds: Array) -> Array:
    """The matrix of small deviations of all states from steady drilling at set speeds
    [rad/s], an array [n, k, k], in the order of the states of the motion."""
    moved, changes = _differentiated(string.motion)
    states, size = string.motion.states, len(string.motion.states)
    given = {name: np.asarray(value)[..., None] for name, value in string.given(speeds, speeds).items()}
    unit = np.eye(size)

    def derivative(at: Mapping[str, Any]) -> Array:
        found = plain.values(changes, {**at, **{f"d.{name}": unit[k] for k, name in enumerate(states)}})
        matrix = np.zeros((len(speeds), size, size))
        for row, name in enumerate(states):
            if name in moved:
                matrix[..., row, :] = found[name]
            else:
                matrix[..., row, row + 1] = 1.0  # a position, before its velocity
        return matrix

    return string.of_sides(derivative, given)


def growth(matrix: Array) -> tuple[Array, Array]:
    """(rate [1/s], frequency [rad/s]) of the deviation that grows fastest, of matrices
    [n, k, k] arrays [n]; that of one that only moves along is 0 and does not count."""
    roots = np.linalg.eigvals(matrix)
    size = np.abs(roots).max(axis=-1, keepdims=True)
    real = np.where(np.abs(roots) > 1e-7 * size, roots.real, -np.inf)
    place = np.argmax(real, axis=-1)
    worst = np.take_along_axis(roots, place[..., None], axis=-1)[..., 0]
    return worst.real, np.abs(worst.imag)


def grows(string: String, speeds: Array) -> Array:
    """The rate [1/s] of the deviation that grows fastest, at set speeds [rad/s]."""
    return growth(matrix_of(string, speeds))[0]


def unstable_to(string: String, about: float) -> float:
    """The set speed [rad/s] below which a deviation grows: the fastest one of those
    ``about`` a speed; 0 where none grows, infinite where one does at the fastest."""
    speeds = about * np.geomspace(1.0 / REACH, REACH, TRIED)
    grown = np.flatnonzero(grows(string, speeds) > 0.0)
    if len(grown) == 0:
        return 0.0
    if grown[-1] == TRIED - 1:
        return float("inf")
    low, high = speeds[grown[-1] : grown[-1] + 2].tolist()
    low, high = refined(lambda trial: grows(string, trial) > 0.0, low, high, 9, 12)
    return 0.5 * (low + high)
