"""Branches to plain arrays and back, so that an unfinished continuation can be stored
and resumed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.orbit.branch import Branch
from nsdrill.orbit.known import Key
from nsdrill.orbit.newton import Point
from nsdrill.orbit.shooting import Orbit
from nsdrill.orbit.special import LabelledPoint

Array = np.ndarray[Any, np.dtype[Any]]
_PARTS = 10  # arrays of one point
_NUMBERS = 8  # scalars of one point


def to_arrays(branches: Mapping[Key, Branch]) -> tuple[dict[str, Array], list[dict[str, Any]]]:
    """The branches as arrays by name, and plain data about each of them."""
    arrays: dict[str, Array] = {}
    descriptions = []
    for number, (key, branch) in enumerate(branches.items()):
        parts = [part for entry in branch.marked for part in _parts(entry)]
        arrays[f"numbers_{number}"] = np.concatenate([part.ravel() for part in parts])
        arrays[f"shapes_{number}"] = np.array([(*part.shape, *[-1] * (3 - part.ndim)) for part in parts], np.int64)
        descriptions.append(
            {
                "key": list(key),
                "motion": branch.motion,
                "lobes": branch.lobes,
                "ended": list(branch.ended),
                "parent": branch.parent,
                "parent_point": branch.parent_point,
                "words": [entry.words for entry in branch.marked],
            }
        )
    return arrays, descriptions


def _parts(entry: LabelledPoint) -> list[Array]:
    point, orbit = entry.point, entry.point.found
    scalars = np.array(
        [
            point.s,
            point.iterations,
            point.residual,
            entry.label,
            orbit.period,
            orbit.rotation,
            orbit.trivial,
            orbit.monodromy is not None,
        ]
    )
    monodromy = np.zeros((0, 0)) if orbit.monodromy is None else orbit.monodromy
    return [
        scalars,
        point.x,
        point.tangent,
        orbit.state,
        orbit.values,
        np.stack([orbit.multipliers.real, orbit.multipliers.imag]),
        orbit.touches,
        monodromy,
        orbit.mesh_states,
        np.array(orbit.free, dtype=float),
    ]


def from_arrays(arrays: Mapping[str, Array], descriptions: list[dict[str, Any]]) -> dict[Key, Branch]:
    """The inverse of :func:`to_arrays`. KeyError, ValueError, TypeError or IndexError
    where the arguments are no output of it."""
    branches = {}
    for number, description in enumerate(descriptions):
        numbers, shapes = arrays[f"numbers_{number}"], arrays[f"shapes_{number}"]
        parts, first = [], 0
        for row in shapes:
            shape = tuple(int(n) for n in row if n >= 0)
            size = math.prod(shape)
            parts.append(np.asarray(numbers[first : first + size], dtype=float).reshape(shape))
            first += size
        marked = [
            _labelled_point(parts[k : k + _PARTS], words)
            for k, words in zip(range(0, len(parts), _PARTS), description["words"], strict=True)
        ]
        branches[tuple(map(int, description["key"]))] = Branch(
            str(description["motion"]),
            int(description["lobes"]),
            marked,
            (str(description["ended"][0]), str(description["ended"][1])),
            int(description["parent"]),
            int(description["parent_point"]),
        )
    return branches


def _labelled_point(parts: list[Array], words: str) -> LabelledPoint:
    scalars, x, tangent, state, values, multipliers, touches, monodromy, mesh_states, free = parts
    if len(scalars) != _NUMBERS:
        raise ValueError(f"{len(scalars)} numbers of a point")
    s, iterations, residual, label, period, rotation, trivial, has_monodromy = map(float, scalars)
    orbit = Orbit(
        state,
        values,
        period,
        multipliers[0] + 1j * multipliers[1],
        touches,
        int(trivial),
        monodromy if has_monodromy else None,
        rotation,
        mesh_states,
        tuple(int(index) for index in free),
    )
    return LabelledPoint(Point(x, tangent, orbit, int(iterations), residual, s), int(label), words)
