"""Points of a sweep run once more, each on its own, from states that are given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.kernel.batch import Finished, Runs
from nsdrill.kernel.settings import Simulation
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.method import Chosen
from nsdrill.sweep.work import Work

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True, kw_only=True)
class Rerun(Work):
    """The points ``numbers`` (ascending) of a sweep, from the states ``begun``
    [points, states]. A state that was carried is given like any other, so there are no
    chains; each point is integrated by the method that ``first``, the choice of the
    sweep, has for it."""

    numbers: Array
    begun: Array
    first: Chosen

    @classmethod
    def of(cls, work: Work, simulation: Simulation, numbers: Array, states: Array) -> Rerun:
        """The same model over another time or to another tolerance, measuring features
        only."""
        return cls(
            replace(work.plan, along=None),
            work.parameters,
            work.initial,
            simulation,
            work.thresholds,
            Record(peaks=0),
            work.model,
            numbers=numbers,
            begun=states,
            first=work.chosen,
        )

    @property
    def chosen(self) -> Chosen:
        return self.first

    def prepare(self, points: Array) -> Runs:
        """The runs of these points."""
        return replace(
            super().prepare(points),
            initial=self.own(self.begun[np.searchsorted(self.numbers, points)]),
        )

    def columns(self, done: Finished) -> dict[str, Array]:
        """Status and features of finished runs, and the scales in which their
        differences are measured."""
        return {"status": done.status, **self.measured(done), **self.kind.scales(done.parameters)}
