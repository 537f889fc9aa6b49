"""Small deviations from steady drilling, from the equations: what grows, and up to which
set speed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Node
from nsdrill.equations.motion import Motion
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import traced
from nsdrill.models.operation import Numeric

ROUNDS = 40
TRIED = 61  # set speeds among which the greatest unstable one is looked for first
REACH = 40.0  # of the speed that is asked for, in both directions
GROWS = 1e-9  # of the greatest eigenvalue; what grows slower does not


@lru_cache
def _differentiated(motion: Motion) -> tuple[tuple[str, ...], Mapping[str, Node]]:
    """(the states that have slopes of their own, the changes of these slopes)."""
    graph, slopes, _ = traced(motion.equations, motion.states, motion.parameters, motion.options, with_slopes=True)
    seeds = {graph.input(f"s.{name}"): graph.input(f"d.{name}") for name in motion.states}
    moved = tuple(slopes)
    return moved, Tangents(graph, seeds).of({name: graph.node(slopes[name]) for name in moved})


def matrix_of(motion: Motion, state: Mapping[str, Numeric], table: Mapping[str, Numeric]) -> Array:
    """The matrix of small deviations from states, by name, with these lane parameters: of
    points [n] an array [n, k, k], in the order of the states of the motion."""
    moved, changes = _differentiated(motion)
    states, size = motion.states, len(motion.states)
    shape = np.broadcast_shapes(
        (1,), *map(np.shape, state.values()), *(np.shape(table[one]) for one in motion.parameters)
    )
    given: dict[str, Any] = {"time": 0.0, "phase": 0.0}
    given |= {f"s.{name}": np.asarray(state[name])[..., None] for name in states}
    given |= {f"p.{name}": np.asarray(table[name])[..., None] for name in motion.parameters}
    unit = np.eye(size)
    found = plain.values(changes, given | {f"d.{name}": unit[k] for k, name in enumerate(states)})
    matrix = np.zeros((*shape, size, size))
    for row, name in enumerate(states):
        if name in moved:
            matrix[..., row, :] = found[name]
        else:
            matrix[..., row, row + 1] = 1.0  # a position, before its velocity
    return matrix


def growth(matrix: Array) -> tuple[Array, Array]:
    """(rate [1/s], frequency [rad/s]) of the deviation that grows fastest, of matrices
    [n, k, k] arrays [n]; that of one that only moves along is 0 and does not count."""
    roots = np.linalg.eigvals(matrix)
    size = np.abs(roots).max(axis=-1, keepdims=True)
    real = np.where(np.abs(roots) > 1e-7 * size, roots.real, -np.inf)
    place = np.argmax(real, axis=-1)
    worst = np.take_along_axis(roots, place[..., None], axis=-1)[..., 0]
    return worst.real, np.abs(worst.imag)


def unstable_to(rates: Callable[[Array], tuple[Array, Array]], about: float) -> float:
    """The set speed [rad/s] below which a deviation grows, by ``rates``, which gives
    (:func:`growth`) at set speeds: the fastest one of those ``about`` a speed; 0 where none
    grows, infinite where one does at the fastest."""
    speeds = about * np.geomspace(1.0 / REACH, REACH, TRIED)
    grown = np.flatnonzero(rates(speeds)[0] > 0.0)
    if len(grown) == 0:
        return 0.0
    if grown[-1] == TRIED - 1:
        return float("inf")
    low, high = speeds[grown[-1]], speeds[grown[-1] + 1]
    for _ in range(ROUNDS):
        middle = 0.5 * (low + high)
        if rates(np.array([middle]))[0][0] > 0.0:
            low = middle
        else:
            high = middle
        if high - low < 1e-9 * high:
            break
    return float(0.5 * (low + high))
