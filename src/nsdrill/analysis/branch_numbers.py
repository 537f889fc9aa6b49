"""Numbers of attractors along the axes of a sweep: attractors of neighbouring operating
points are matched and get the same number.

The place of an attractor is the median over its members of two kinds of coordinates:
the scaled features by which starts are grouped (:mod:`nsdrill.analysis.attractors`),
and the scaled extremes of the states, as the model defines them
(:meth:`nsdrill.models.base.Model.coordinates`). A final state lies anywhere along the
orbit; the extremes locate the orbit in state space.

The distance of two attractors is the greatest difference of any coordinate, plus:

- ``KIND_PENALTY`` of ``matching`` where both kinds of motion are known and differ, and
  as much again where most starts of only one of the two are settled. A period that
  doubles ends no branch, but of two candidates the one of the same kind is taken.
- ``matching`` times the difference of their shares where neither is settled: of a
  chaotic motion that is split into several groups the largest ones are matched.

Attractors of neighbours on the grid are paired so that the sum of the squared distances
is least; no pair has a distance of ``matching`` or more.

The pairs join attractors into branches, the nearest pair of the whole grid first, so
that no direction along the grid is preferred. A pair that would put two attractors of
one operating point on one branch is left out. Then settled attractors at the ends of
branches are paired in the same way across one operating point where both branches are
missing, up to ``MAX_MISSED`` of them: a small number of starts may miss an attractor of
small share. A branch that is missing for longer returns with a new number.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import fields

import numpy as np

from nsdrill.data import Array
from nsdrill.records import dataclass

KIND_PENALTY = 1 / 3
# 64 starts miss an attractor of share 1/64 at two operating points with a probability
# of 1/8.
MAX_MISSED = 2
# of the attractors of an operating point, the largest: pairing n of them takes n^3
MAX_MATCHED = 1000


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


def number(attractors: Places, shape: tuple[int, ...], matching: float) -> Array:
    """The number of the branch of each attractor, from 1, by falling sum of members
    over the sweep. Operating points are numbered over ``shape``, the last axis fastest.
    The order of the attractors of one operating point does not matter."""
    order = np.lexsort((*attractors.place.T[::-1], attractors.kind, -attractors.members, attractors.point))
    attractors = Places(*(getattr(attractors, field.name)[order] for field in fields(Places)))
    branches = _Branches(attractors.point)
    for steps in range(1, MAX_MISSED + 2):
        links = [
            link for stretch in _stretches(shape, steps) for link in _pairs(attractors, branches, stretch, matching)
        ]
        for _, a, b in sorted(links):
            branches.join(a, b)
    labels, firsts, inverse = np.unique(branches.of, return_index=True, return_inverse=True)
    rank = np.empty(len(labels), np.int64)
    rank[np.lexsort((firsts, -np.bincount(inverse, attractors.members)))] = np.arange(1, len(labels) + 1)
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
        """Whether the branch of this attractor has no attractor at these operating
        points."""
        return self._points[self.of[attractor]].isdisjoint(points)


def _stretches(shape: tuple[int, ...], steps: int) -> Iterator[tuple[int, ...]]:
    """All stretches of neighbouring operating points along an axis whose ends are
    ``steps`` apart."""
    points = np.arange(math.prod(shape)).reshape(shape)
    for axis, length in enumerate(shape):
        shifted = (np.take(points, range(i, length - steps + i), axis).ravel().tolist() for i in range(steps + 1))
        yield from zip(*shifted, strict=True)


def _pairs(
    attractors: Places, branches: _Branches, stretch: tuple[int, ...], matching: float
) -> Iterator[tuple[float, int, int]]:
    """Pairs of attractors of the first and the last operating point of ``stretch``
    whose branches have no other attractor on it: their distance and their numbers."""
    bounds = np.searchsorted(attractors.point, [(stretch[0], stretch[0] + 1), (stretch[-1], stretch[-1] + 1)]).tolist()
    a, b = (
        [
            i
            for i in range(first, min(last, first + MAX_MATCHED))
            if branches.missing(i, neighbours) and (attractors.settled[i] or len(stretch) == 2)
        ]
        for (first, last), neighbours in zip(bounds, (stretch[1:], stretch[:-1]), strict=True)
    )
    if not a or not b:
        return
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    distance = cdist(attractors.place[a], attractors.place[b], "chebyshev")
    kind, other_kind = attractors.kind[a, None], attractors.kind[None, b]
    distance += KIND_PENALTY * matching * ((kind != other_kind) & (kind > 0) & (other_kind > 0))
    distance += KIND_PENALTY * matching * (attractors.settled[a, None] != attractors.settled[None, b])
    shares = (
        attractors.members[i] / attractors.members[slice(*ends)].sum() for i, ends in zip((a, b), bounds, strict=True)
    )
    share_difference = np.abs(np.subtract.outer(*shares))
    distance += matching * share_difference * ~(attractors.settled[a, None] | attractors.settled[None, b])
    # An attractor that is not paired costs as much as the largest distance. Squares
    # prefer many small steps to a long one.
    for i, j in zip(*linear_sum_assignment(np.minimum(distance, matching) ** 2), strict=True):
        if distance[i, j] < matching:
            yield float(distance[i, j]), a[i], b[j]
