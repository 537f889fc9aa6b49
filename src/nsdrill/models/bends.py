"""Where equations bend: at a point where a condition, a ``max``, or an ``abs`` is at its switch, the
derivative of a graph is that of one side. It is the linear theory there only if it is that of
all sides."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from nsdrill.data import Array

SWITCHES = frozenset({"abs", "max", "min", "select", "join", "either"})  # operations of a graph that may bend
STEP = 1e-7  # from the point to a side, of the size of a value, or of 1
NEARER = 0.01  # times the step: a bend is as large there, a curve is not
LEAST = 1e-6  # of the greatest derivative of a row: less is no bend


class Sides(NamedTuple):
    """A derivative at points [..., rows, columns], and whether it is another one on another
    side of a point [...]. Where all sides have the same, it is that, whatever the point has."""

    derivative: Array
    bends: Array


def on_all_sides(
    derivative: Callable[[Mapping[str, Any]], Array], given: Mapping[str, Any], names: Sequence[str]
) -> Sides:
    """The ``derivative`` at inputs ``given`` of a graph, and beside them, on both sides of
    them in the inputs with these ``names``."""
    at = derivative(given)
    found = [np.stack([derivative(beside) for beside in _beside(given, names, STEP * part)]) for part in (1.0, NEARER)]
    least = LEAST * np.abs(np.stack([at, *found[0]])).max(axis=(0, -1))[..., None]
    apart = np.minimum(*(np.ptp(sides, axis=0) for sides in found))  # a curve is less apart on nearer sides
    jumps = np.minimum(*(np.abs(sides - at).max(axis=0) for sides in found))
    bends = np.any(apart > least, axis=(-2, -1))
    is_alone = np.any(jumps > least, axis=(-2, -1)) & ~bends
    return Sides(np.where(is_alone[..., None, None], found[1][0], at), bends)


def _beside(given: Mapping[str, Any], names: Sequence[str], step: float) -> Iterator[dict[str, Any]]:
    """The inputs beside these. No direction is along an axis, in which a condition on another
    input would stay at its switch; of any two inputs all pairs of signs come."""
    rows = 1 << len(names).bit_length()
    for row in range(rows):
        for sign in (1.0, -1.0):
            shares = [
                sign * (-1.0) ** (row & (k + 1)).bit_count() * (1.0 + 0.618 * (k + 1) % 1.0) for k in range(len(names))
            ]
            moved = {
                name: given[name] + share * step * (1.0 + np.abs(given[name]))
                for name, share in zip(names, shares, strict=True)
            }
            yield {**given, **moved}
