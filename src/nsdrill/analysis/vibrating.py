"""The vibration of a setting that only a severity allows: which one, how strong and in which of its runs."""

from __future__ import annotations

import numpy as np

from nsdrill.analysis.graded import Graded
from nsdrill.analysis.planes import Cell, planes_of
from nsdrill.models.registry import responses_in
from nsdrill.records import dataclass


@dataclass(frozen=True)
class OnWay:
    """What the runs of one ``way`` do at a setting: the ``responses`` of any of them, the greatest known ``severity``
    of these, and that so many ``runs`` ``of`` all have some."""

    way: str
    responses: tuple[str, ...]
    severity: int
    runs: int
    of: int


@dataclass(frozen=True)
class Vibration:
    """What the runs at a setting do, by the way on which they came there: the one on the way in first."""

    ways: tuple[OnWay, ...]

    @property
    def responses(self) -> tuple[str, ...]:
        """Those of all runs."""
        return tuple(dict.fromkeys(name for one in self.ways for name in one.responses))

    @property
    def severity(self) -> int:
        """The greatest one."""
        return max(one.severity for one in self.ways)

    @property
    def is_in_every_run(self) -> bool:
        """Whether no run is free of vibration."""
        return all(one.runs == one.of for one in self.ways)


def vibration_at(maps: Graded, cell: Cell) -> Vibration | None:
    """That of the runs at a cell of ``maps`` by response, where these do not allow it; None where no run vibrates."""
    bits = maps.bits[(slice(None), *cell)]
    if maps.allowed[cell] or not bits.any():
        return None
    results, planes = maps.results, planes_of(maps.results, maps.x, maps.y, maps.third)
    responses = responses_in(results.attrs)
    levels = {
        name: np.array([planes(part[None])[cell] for part in np.asarray(results[one.severity.name]).astype(int)])
        for name, one in responses.items()
        if one.severity is not None and one.severity.name in results.variables
    }
    found = []
    for at in sorted(range(len(bits)), key=lambda one: results.procedures[one] != maps.way_in):
        names = tuple(name for name, one in responses.items() if (bits[at] & one.bit).any())
        worst = max((int(levels[name][at].max()) for name in names if name in levels), default=0)
        found.append(OnWay(results.procedures[at], names, worst, int(np.count_nonzero(bits[at])), bits[at].size))
    return Vibration(tuple(found))
