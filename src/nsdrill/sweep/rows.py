"""Points that lie on no grid: each with values of its own, as measurements have them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from nsdrill.sweep.plan import Plan

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class Rows(Plan):
    """One point for each row of a table: ``axes`` has the values of each key, arrays
    [rows], those of the operation among them. The rows go by ascending speed, as the
    engine takes the last ones first, and fast rotation takes the most steps."""

    @classmethod
    def of(cls, table: dict[str, Array]) -> tuple[Self, Array]:
        """The rows of ``table``, and the place of each in it: [rows]."""
        order = np.argsort(table["rotary_speed"], kind="stable")
        last = {key: table[key][order] for key in table if key != "rotary_speed"}
        return cls({**last, "rotary_speed": table["rotary_speed"][order]}, "same", None), order

    @property
    def shape(self) -> tuple[int, ...]:
        return (*[1] * len(self.axes), len(self.axes["rotary_speed"]))

    def values(self, points: Array) -> dict[str, Array]:
        return {key: values[points] for key, values in self.axes.items()}
