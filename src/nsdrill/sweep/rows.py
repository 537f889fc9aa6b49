"""Points that do not form a grid, such as measurements: each has its own values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from nsdrill.sweep.plan import Plan

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class Rows(Plan):
    """One point for each row of a table: ``axes`` has the values of each key, including
    those of the operation, arrays [rows]. The rows are in order of ascending speed: the
    engine begins with the last ones, and fast rotation takes the most steps."""

    @classmethod
    def of(cls, table: dict[str, Array]) -> tuple[Self, Array]:
        """The rows of ``table``, and the index of each in it: [rows]."""
        order = np.argsort(table["rotary_speed"], kind="stable")
        others = {key: table[key][order] for key in table if key != "rotary_speed"}
        return cls({**others, "rotary_speed": table["rotary_speed"][order]}, "same", None), order

    @property
    def shape(self) -> tuple[int, ...]:
        return (*[1] * len(self.axes), len(self.axes["rotary_speed"]))

    def values(self, points: Array) -> dict[str, Array]:
        return {key: values[points] for key, values in self.axes.items()}
