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
        """Whether each of these points is integrated implicitly, shape (n,): as the
        study asks, or as friction is steep there."""
        points = np.asarray(points)
        values, found = self.plan.values(points), np.zeros(np.shape(points), dtype=bool)
        for apart, there in in_parts(self.model, values):
            here = {key: value[there] for key, value in values.items()} | apart
            found[there] = implicit(
                self.method, self.model, values_at(self.parameters, self.initial, here)
            )
        return found

    def words(self) -> tuple[str, ...]:
        """The methods that the whole plan uses: explicit, implicit, or both."""
        if self.method == "explicit":
            return ("explicit",)
        found: set[bool] = set()
        for first in range(0, self.plan.points, _BLOCK):
            block = np.arange(first, min(first + _BLOCK, self.plan.points))
            found |= set(self.points(block).tolist())
        return tuple(
            word for word, value in (("explicit", False), ("implicit", True)) if value in found
        )
