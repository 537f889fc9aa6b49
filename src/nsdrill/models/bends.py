"""Where equations bend: at a point where a condition, a ``max``, or an ``abs`` is at its switch, the
derivative of a graph is that of one side. It is the linear theory there only if it is that of
all sides."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Node
from nsdrill.equations.motion import Motion
from nsdrill.equations.passes import Tangents
from nsdrill.equations.trace import traced

SWITCHES = frozenset({"abs", "max", "min", "select", "join", "either"})  # operations of a graph that may bend
STEPS = (1e-6, 1e-7)  # from the point to a side, in natural scales
STAYS = 0.5  # of a difference between sides that stays on the nearer ones: of a curve a tenth does
LEAST = 1e-6  # of the greatest derivative of a row: less is no bend


class Sides(NamedTuple):
    """A derivative at points [..., rows, columns], and whether it is another one on another
    side of a point [...]. Where all sides have the same, it is that, and the point's own may be
    ``alone`` with another one [...]."""

    derivative: Array
    bends: Array
    alone: Array


def directions(number: int) -> Array:
    """Directions to the sides of a point in so many inputs [sides, inputs]. None is along an
    axis, in which a condition on another input would stay at its switch; of any two inputs
    all pairs of signs come."""
    rows, columns = np.arange(1 << number.bit_length())[:, None], np.arange(1, number + 1)
    odd = np.zeros((len(rows), number), dtype=int)
    for bit in range(number.bit_length()):
        odd ^= (rows & columns) >> bit & 1
    half = (1 - 2 * odd) * (1.0 + 0.618 * columns % 1.0)
    return np.concatenate([half, -half])


def judged(at: Array, beside: Sequence[Array]) -> Sides:
    """What the derivatives ``at`` points [..., rows, columns] are worth, by those ``beside`` them
    at each of the :data:`STEPS` [sides, ..., rows, columns]."""
    size = np.abs(np.concatenate([at[None], *beside])).max(axis=(0, -1))[..., None]

    def stay(far: Array, near: Array) -> Array:
        return np.any((near > STAYS * far) & (near > LEAST * size), axis=(-2, -1))

    bends = stay(*(np.ptp(sides, axis=0) for sides in beside))
    is_alone = stay(*(np.abs(sides - at).max(axis=0) for sides in beside)) & ~bends
    return Sides(np.where(is_alone[..., None, None], beside[-1][0], at), bends, is_alone)


def on_all_sides(
    derivative: Callable[[Mapping[str, Any]], Array], given: Mapping[str, Any], names: Sequence[str]
) -> Sides:
    """The ``derivative`` at inputs ``given`` of a graph, beside what it is on their sides in the
    inputs with these ``names``, whose scale is their size, or 1."""

    def beside(shares: Array, step: float) -> Array:
        moved = {
            name: given[name] + share * step * (1.0 + np.abs(given[name]))
            for name, share in zip(names, shares.tolist(), strict=True)
        }
        return derivative({**given, **moved})

    sides = directions(len(names))
    return judged(derivative(given), [np.stack([beside(one, step) for one in sides]) for step in STEPS])


def bends(motion: Motion, columns: Mapping[str, Any], state: Array, scales: Array) -> bool:
    """Whether the equations of a ``motion`` bend at a ``state`` [states], or have another derivative
    there than on all sides, with lane parameters ``columns`` and the natural ``scales`` of the
    states: a compiled deviation then grows as on one side, or as at the point."""
    changes = _changes(motion)
    if not changes:
        return False
    sides, number = directions(len(motion.states)), len(motion.states)
    points = np.concatenate([state[None], *(state + step * sides * scales for step in STEPS)])
    given = {"time": 0.0, "phase": 0.0} | {f"p.{name}": columns[name] for name in motion.parameters}
    given |= {f"s.{name}": points[:, k] for k, name in enumerate(motion.states)}
    given |= {f"d.{name}": (np.arange(number) == k)[:, None] * scales[k] for k, name in enumerate(motion.states)}
    values = plain.values(changes, given)
    rows = np.stack([np.broadcast_to(values[name], (number, len(points))) for name in changes])
    at, *beside = np.split(np.moveaxis(rows, -1, 0), [1, 1 + len(sides)])
    found = judged(at[0], beside)
    return bool(found.bends | found.alone)


@lru_cache(maxsize=64)
def _changes(motion: Motion) -> Mapping[str, Node]:
    """The changes of the slopes; none where nothing in these has a switch."""
    graph, slopes, _ = traced(motion.equations, motion.states, motion.parameters, motion.options, with_slopes=True)
    if not any(node.op in SWITCHES for node in graph.live(slopes.values())):
        return {}
    seeds = {graph.input(f"s.{name}"): graph.input(f"d.{name}") for name in motion.states}
    return Tangents(graph, seeds).of(slopes)
