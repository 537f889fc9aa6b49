"""One number for one attractor along the axes of a sweep: attractors of neighbouring
operating points are matched.

The place of an attractor has the medians over its members of two kinds of coordinates:
the scaled features by which starts are grouped (:mod:`nsdrill.analysis.attractors`),
and the scaled extremes of the states, as the model has them
(:meth:`nsdrill.models.base.Model.coordinates`). One final state lies anywhere along the
orbit; the extremes say where in state space the orbit lies.

The distance of two attractors is the greatest difference of any coordinate. It is
larger by ``OTHER`` of ``matching`` where both kinds of motion are known and differ, and
by as much where most starts of only one of the two are settled: a period that doubles
ends no branch, but of two candidates the one of the same kind is taken. Where neither
is settled it is larger by ``matching`` times the difference of their shares: of a
chaotic motion that fell into pieces the largest ones go together. Between neighbours on
the grid attractors are paired so that the sum of the squared distances is least, and
none over ``matching`` or more.

The pairs join attractors into branches, the nearest pair of the whole grid first. A
pair that would put two attractors of one operating point on one branch is left out. So
no direction along the grid is preferred. Then settled attractors at the ends of
branches are paired in the same way across one operating point where both branches are
missing, and across ``MISSED`` of them: few starts miss an attractor of small share at
times. A branch that is missing for longer comes back with a new number.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from nsdrill.data import Array

OTHER = 1 / 3
# an attractor of share 1/64 is missed by 64 starts at two operating points with a
# probability of 1/8
MISSED = 2
# attractors of an operating point that are matched, the largest; to pair n of them
# takes n^3
MOST = 1000


@dataclass(frozen=True)
class Places:
    """Attractors of a sweep, in the order of their operating points: the number of the
    operating ``point`` of each, the number of its ``members``, its ``place``
    [attractors, coordinates], its ``kind`` of motion, 0 where not known, and whether
    most of its members are ``settled``."""

    point: Array
    members: Array
    place: Array
    kind: Array
    settled: Array


def number(found: Places, shape: tuple[int, ...], matching: float) -> Array:
    """The number of the branch of each attractor, by falling sum of members over the
    sweep, from 1. Operating points are numbered over ``shape``, the last axis fastest.
    In which order the attractors of one operating point are given is of no account."""
    order = np.lexsort((*found.place.T[::-1], found.kind, -found.members, found.point))
    found = Places(*(getattr(found, item.name)[order] for item in fields(Places)))
    branches = _Branches(found.point)
    for steps in range(1, MISSED + 2):
        links = [
            link for row in _rows(shape, steps) for link in _paired(found, branches, row, matching)
        ]
        for _, a, b in sorted(links):
            branches.join(a, b)
    names, first, inverse = np.unique(branches.of, return_index=True, return_inverse=True)
    rank = np.empty(len(names), np.int64)
    rank[np.lexsort((first, -np.bincount(inverse, found.members)))] = np.arange(1, len(names) + 1)
    numbers = np.empty(len(order), np.int64)
    numbers[order] = rank[inverse]
    return numbers


class _Branches:
    """Attractors joined into branches, each with at most one attractor of an operating
    point."""

    def __init__(self, point: Array) -> None:
        self.of = np.arange(len(point))  # the name of the branch of each attractor
        self._members = [[i] for i in range(len(point))]
        self._points = [{i} for i in point.tolist()]

    def join(self, a: int, b: int) -> None:
        a, b = sorted(self.of[[a, b]].tolist(), key=lambda name: -len(self._members[name]))
        if self._points[a].isdisjoint(self._points[b]):
            self.of[self._members[b]] = a
            self._members[a] += self._members[b]
            self._points[a] |= self._points[b]

    def missing(self, attractor: int, points: Sequence[int]) -> bool:
        """Whether the branch of this attractor has none at these operating points."""
        return self._points[self.of[attractor]].isdisjoint(points)


def _rows(shape: tuple[int, ...], steps: int) -> Iterator[tuple[int, ...]]:
    """All operating points in a row along an axis of which the last is ``steps`` from
    the first."""
    points = np.arange(math.prod(shape)).reshape(shape)
    for axis, length in enumerate(shape):
        shifted = (
            np.take(points, range(i, length - steps + i), axis).ravel().tolist()
            for i in range(steps + 1)
        )
        yield from zip(*shifted, strict=True)


def _paired(
    found: Places, branches: _Branches, row: tuple[int, ...], matching: float
) -> Iterator[tuple[float, int, int]]:
    """Pairs of attractors of the first and the last operating point of ``row`` whose
    branches have no other on it: their distance, and which they are."""
    bounds = np.searchsorted(found.point, [(row[0], row[0] + 1), (row[-1], row[-1] + 1)]).tolist()
    a, b = (
        [
            i
            for i in range(first, min(last, first + MOST))
            if branches.missing(i, others) and (found.settled[i] or len(row) == 2)
        ]
        for (first, last), others in zip(bounds, (row[1:], row[:-1]), strict=True)
    )
    if not a or not b:
        return
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    distance = cdist(found.place[a], found.place[b], "chebyshev")
    kind, other_kind = found.kind[a, None], found.kind[None, b]
    distance += OTHER * matching * ((kind != other_kind) & (kind > 0) & (other_kind > 0))
    distance += OTHER * matching * (found.settled[a, None] != found.settled[None, b])
    share = (
        found.members[i] / found.members[slice(*ends)].sum()
        for i, ends in zip((a, b), bounds, strict=True)
    )
    apart = np.abs(np.subtract.outer(*share))
    distance += matching * apart * ~(found.settled[a, None] | found.settled[None, b])
    # Not to pair costs as much as the largest distance. Squares: many small steps
    # rather than one long one.
    for i, j in zip(*linear_sum_assignment(np.minimum(distance, matching) ** 2), strict=True):
        if distance[i, j] < matching:
            yield float(distance[i, j]), a[i], b[j]
