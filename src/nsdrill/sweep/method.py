"""Which points of a sweep are integrated implicitly. Imports no compiler."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.models.description import Description
from nsdrill.models.leaves import values_in_parts
from nsdrill.models.starts import Starts
from nsdrill.models.steepness import implicit
from nsdrill.sweep.plan import Plan

Array = np.ndarray[Any, np.dtype[Any]]
_BLOCK = 1 << 16  # points decided at once


@dataclass(frozen=True)
class Chosen:
    """The choice of the method for the points of a plan, by the key
    ``simulation.method`` of a study of this model."""

    plan: Plan
    parameters: Any
    initial: Starts
    model: Description
    method: str

    def points(self, points: Array) -> Array:
        """Whether each of these points is integrated implicitly, shape (n,): by the
        study's method or, with ``auto``, where friction is steep."""
        points = np.asarray(points)
        values, is_implicit = self.plan.values(points), np.zeros(np.shape(points), dtype=bool)
        for at, part in values_in_parts(self.model, self.parameters, self.initial, values):
            is_implicit[part] = implicit(self.method, self.model, at)
        return is_implicit

    def words(self) -> tuple[str, ...]:
        """The methods that the whole plan uses: explicit, implicit, or both."""
        if self.method == "explicit":
            return ("explicit",)
        choices: set[bool] = set()
        for first in range(0, self.plan.points, _BLOCK):
            block = np.arange(first, min(first + _BLOCK, self.plan.points))
            choices |= set(self.points(block).tolist())
        return tuple(word for word, value in (("explicit", False), ("implicit", True)) if value in choices)
