"""Points of a sweep that are run again, each separately, from given states."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.kernel.batch import FinishedRuns, Runs
from nsdrill.kernel.settings import Simulation
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.method import Chosen
from nsdrill.sweep.work import Work

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True, kw_only=True)
class Rerun(Work):
    """The points ``point_numbers`` (ascending) of a sweep, from ``start_states``
    [points, states]. Carried states are given like all others, so there are no chains.
    Each point is integrated by the same method as in the sweep, ``sweep_choice``."""

    point_numbers: Array
    start_states: Array
    sweep_choice: Chosen

    @classmethod
    def of(cls, work: Work, simulation: Simulation, point_numbers: Array, states: Array) -> Rerun:
        """The same model with another ``simulation`` time or tolerance, recording
        features only."""
        return cls(
            replace(work.plan, along=None),
            work.parameters,
            work.initial,
            simulation,
            work.thresholds,
            Record(peaks=0),
            work.model,
            point_numbers=point_numbers,
            start_states=states,
            sweep_choice=work.chosen,
        )

    @property
    def chosen(self) -> Chosen:
        return self.sweep_choice

    def prepare(self, points: Array) -> Runs:
        """The runs of these points."""
        return replace(
            super().prepare(points),
            initial=self.to_own_states(self.start_states[np.searchsorted(self.point_numbers, points)]),
        )

    def columns(self, done: FinishedRuns) -> dict[str, Array]:
        """Status and features of finished runs, and the natural scales of the
        features."""
        return {"status": done.status, **self.measured(done), **self.kind.scales(done.parameters)}
