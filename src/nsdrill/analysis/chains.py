"""The chain of runs that a file holds: all of it, or the part that a selection left.

The state is carried along one axis. Of a part nothing tells what was met at the values
that are not in it; and where it has one value of that axis, the other axes were not
moved: each of their values is a chain of its own.
"""

from __future__ import annotations

import numpy as np

from nsdrill.analysis.counts import carried_axis
from nsdrill.data import Answer, Array, Results, resolved_study
from nsdrill.records import dataclass
from nsdrill.variables import dimension_of

SLACK = 1e-9  # relative: the same value, from another way to compute it


@dataclass(frozen=True)
class Chain:
    """The values ``along`` the axis along which the state was carried [SI]: those that are
    ``held``, of the ``whole`` chain."""

    along: str
    held: Array
    whole: Array

    @property
    def is_part(self) -> bool:
        """Whether values of the chain are left out."""
        return len(self.held) < len(self.whole)

    @property
    def begins_before(self) -> bool:
        """Whether the chain begins below the values that are held."""
        return bool(self.held[0] > self.whole[0] + SLACK * abs(self.whole[0]))

    @property
    def goes_on(self) -> bool:
        """Whether the chain goes beyond the values that are held."""
        return bool(self.held[-1] < self.whole[-1] - SLACK * abs(self.whole[-1]))

    def step(self, first: float, last: float) -> float:
        """The greatest step of the whole chain that ends between these values."""
        ends = self.whole[1:]
        inside = (ends >= first - SLACK * abs(first)) & (ends <= last + SLACK * abs(last))
        return float(np.max(np.diff(self.whole)[inside], initial=0.0))

    def as_data(self) -> Answer:
        """Plain data in SI: the ends of what is held and of the whole, and their numbers."""

        def ends(values: Array) -> Answer:
            return {"axis": self.along, "from": float(values[0]), "to": float(values[-1]), "points": len(values)}

        return {"part": self.is_part, "held": ends(self.held), "whole": ends(self.whole)}


def chain_of(results: Results) -> Chain | None:
    """The chain of these results; None where no state was carried."""
    along = carried_axis(results)
    sweep = resolved_study(results.attrs).get("sweep")
    if along is None or {"up", "down"}.isdisjoint(results.procedures) or not isinstance(sweep, dict):
        return None
    held = np.asarray(results.coords[along], dtype=float)
    given = next((values for key, values in sweep.items() if dimension_of(key) == along), None)
    whole = _values(given)
    return Chain(along, held, held if whole is None or len(whole) < len(held) else whole)


def _values(axis: object) -> Array | None:
    """The values of an axis of a resolved study, a list or {from, to, points}; None of what
    is no such."""
    try:
        if isinstance(axis, dict):
            spaced = np.geomspace if axis.get("spacing") == "log" else np.linspace
            return np.asarray(spaced(axis["from"], axis["to"], axis["points"]), dtype=float)
        return np.asarray(axis, dtype=float) if isinstance(axis, list) and axis else None
    except (KeyError, TypeError, ValueError):
        return None
