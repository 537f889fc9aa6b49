"""Which points of a sweep are integrated implicitly. Imports nothing that compiles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.models.leaves import in_parts, values_at
from nsdrill.models.starts import Starts
from nsdrill.models.steepness import implicit
from nsdrill.sweep.plan import Plan

Array = np.ndarray[Any, np.dtype[Any]]
_BLOCK = 1 << 16  # points looked at at once


@dataclass(frozen=True)
class Chosen:
    """The choice for the points of a plan, by the ``method`` of a study of this model."""

    plan: Plan
    parameters: Any
    initial: Starts
    model: str
    method: str

    def points(self, points: Array) -> Array:
        """Whether each of these points is integrated implicitly, shape (n,): as the study asks, or as friction is steep
        there. A chain that carries its state is as a whole where one of its points is."""
        points = np.asarray(points)
        length = self.plan.chain_length
        if length == 1 or self.method != "auto":
            return self._alone(points)
        # Every value of the axis along which the state is carried, at the other values of a point.
        chain_of = np.empty(self.plan.points, np.int64)
        for first in range(0, self.plan.chains, per := max(1, _BLOCK // length)):
            there = np.arange(first, min(first + per, self.plan.chains))
            chain_of[self.plan.points_of(there[:, None], np.arange(length))] = there[:, None]
        chains, which = np.unique(chain_of[points], return_inverse=True)
        return np.asarray(self.chains(chains)[which])

    def chains(self, chains: Array) -> Array:
        """Whether each of these chains is integrated implicitly, shape (n,)."""
        length = self.plan.chain_length
        found: list[Array] = [np.empty(0, dtype=bool)]
        for first in range(0, len(chains), per := max(1, _BLOCK // length)):
            some = np.asarray(chains)[first : first + per]
            points = self.plan.points_of(some[:, None], np.arange(length))
            found.append(np.asarray(self._alone(points.ravel()).reshape(points.shape).any(axis=1)))
        return np.concatenate(found)

    def words(self) -> tuple[str, ...]:
        """The methods that the whole plan uses: explicit, implicit, or both."""
        if self.method == "explicit":
            return ("explicit",)
        found: set[bool] = set()
        if self.plan.chain_length > 1:
            found |= set(self.chains(np.arange(self.plan.chains)).tolist())
        else:
            for first in range(0, self.plan.points, _BLOCK):
                block = np.arange(first, min(first + _BLOCK, self.plan.points))
                found |= set(self._alone(block).tolist())
        return tuple(word for word, value in (("explicit", False), ("implicit", True)) if value in found)

    def _alone(self, points: Array) -> Array:
        values, found = self.plan.values(points), np.zeros(np.shape(points), dtype=bool)
        for apart, there in in_parts(self.model, values):
            here = {key: value[there] for key, value in values.items()} | apart
            found[there] = implicit(self.method, self.model, values_at(self.parameters, self.initial, here))
        return found
