"""Branches as plain arrays and back, so that an unfinished continuation can be kept and
taken up again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Marked, Point
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.periodic import Orbit

Array = np.ndarray[Any, np.dtype[Any]]
Key = tuple[int, ...]
_PARTS = 10  # arrays of one point
_NUMBERS = 8  # scalars of one point


def to_arrays(branches: Mapping[Key, Branch]) -> tuple[dict[str, Array], list[dict[str, Any]]]:
    """Arrays by name, and plain data about each branch."""
    arrays: dict[str, Array] = {}
    told = []
    for number, (key, branch) in enumerate(branches.items()):
        parts = [part for one in branch.marked for part in _parts(one)]
        arrays[f"numbers_{number}"] = np.concatenate([part.ravel() for part in parts])
        arrays[f"shapes_{number}"] = np.array(
            [(*part.shape, *[-1] * (3 - part.ndim)) for part in parts], np.int64
        )
        told.append(
            {
                "key": list(key),
                "motion": branch.motion,
                "lobes": branch.lobes,
                "ended": list(branch.ended),
                "parent": branch.parent,
                "parent_point": branch.parent_point,
                "words": [one.words for one in branch.marked],
            }
        )
    return arrays, told


def _parts(one: Marked) -> list[Array]:
    point, orbit = one.point, one.point.found
    scalars = np.array(
        [
            point.s,
            point.iterations,
            point.residual,
            one.label,
            orbit.period,
            orbit.rotation,
            orbit.trivial,
            orbit.monodromy is not None,
        ]
    )
    own = np.zeros((0, 0)) if orbit.monodromy is None else orbit.monodromy
    return [
        scalars,
        point.x,
        point.tangent,
        orbit.state,
        orbit.values,
        np.stack([orbit.multipliers.real, orbit.multipliers.imag]),
        orbit.touches,
        own,
        orbit.pieces,
        np.array(orbit.free, dtype=float),
    ]


def from_arrays(arrays: Mapping[str, Array], told: list[dict[str, Any]]) -> dict[Key, Branch]:
    """The inverse of :func:`to_arrays`. KeyError, ValueError, TypeError or IndexError
    for what is no output of it."""
    found = {}
    for number, about in enumerate(told):
        numbers, shapes = arrays[f"numbers_{number}"], arrays[f"shapes_{number}"]
        parts, first = [], 0
        for row in shapes:
            shape = tuple(int(n) for n in row if n >= 0)
            size = math.prod(shape)
            parts.append(np.asarray(numbers[first : first + size], dtype=float).reshape(shape))
            first += size
        marked = [
            _marked(parts[k : k + _PARTS], words)
            for k, words in zip(range(0, len(parts), _PARTS), about["words"], strict=True)
        ]
        found[tuple(map(int, about["key"]))] = Branch(
            str(about["motion"]),
            int(about["lobes"]),
            marked,
            (str(about["ended"][0]), str(about["ended"][1])),
            int(about["parent"]),
            int(about["parent_point"]),
        )
    return found


def _marked(parts: list[Array], words: str) -> Marked:
    scalars, x, tangent, state, values, multipliers, touches, monodromy, pieces, free = parts
    if len(scalars) != _NUMBERS:
        raise ValueError(f"{len(scalars)} numbers of a point")
    s, iterations, residual, label, period, rotation, trivial, has = map(float, scalars)
    orbit = Orbit(
        state,
        values,
        period,
        multipliers[0] + 1j * multipliers[1],
        touches,
        int(trivial),
        monodromy if has else None,
        rotation,
        pieces,
        tuple(int(place) for place in free),
    )
    return Marked(Point(x, tangent, orbit, int(iterations), residual, s), int(label), words)
