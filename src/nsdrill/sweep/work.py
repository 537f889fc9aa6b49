"""What a sweep computes: the plan, the model and how it is watched; and one slice of that work on one gang."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import Rows
from nsdrill.kernel.gang import Compiled, Finished, Gang
from nsdrill.kernel.loop import make_advance
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.stepper import make_stepper
from nsdrill.model.parameters import Initial, Parameters
from nsdrill.model.rhs import (
    AUX,
    PARAMETERS,
    STATES,
    drifts,
    first_step,
    initial_states,
    make_right_hand_side,
    model_for,
    pack,
    sizes,
)
from nsdrill.observe.classify import classify
from nsdrill.observe.features import OBSERVED, make_observer, report_width, store_size
from nsdrill.observe.reduce import features, peaks
from nsdrill.observe.thresholds import Record, Thresholds
from nsdrill.sweep.plan import Plan
from nsdrill.variables import OK, PEAKS

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class Work:
    """All that decides the numbers of a sweep."""

    plan: Plan
    parameters: Parameters
    initial: Initial
    simulation: Simulation
    thresholds: Thresholds
    record: Record

    @property
    def variant(self) -> tuple[bool, int]:
        """What of the model is fixed when it is compiled: Hertz wall or not, number of lobes."""
        return self.parameters.well.law == "hertz", self.parameters.bit.lobes

    def new_gang(self, lanes: int, slots: int) -> Gang:
        store = np.zeros(store_size(lanes, self.record.peaks))
        store[0] = self.record.peaks
        rows = model_for(self.parameters).rows(len(OBSERVED))
        return Gang(lanes, slots, rows, store, report_width(self.record.peaks), self.simulation)

    def prepare(self, points: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Lane parameters, state sizes, drifts, first steps and initial states of these points."""
        depth, wob, speed = self.plan.values(points)
        table = pack(self.parameters, depth, wob, speed, self.thresholds.stuck_below)
        initial = initial_states(self.parameters, self.initial, depth, wob, speed)
        return table, sizes(table), drifts(table), first_step(table), initial

    def columns(self, done: Finished) -> dict[str, Array]:
        """The results of finished runs, one array per variable of the results file."""
        n = len(done.job)
        measured = features(done.report, done.parameters, self.simulation.observe, self.variant[0])
        ok = done.status == OK
        measured = {name: np.where(ok, value, np.nan) for name, value in measured.items()}
        heights = peaks(done.report, self.record.peaks)
        heights[~ok] = np.nan
        return {
            "status": done.status,
            "steps": done.accepted,
            "rejected": done.rejected,
            **measured,
            **classify(measured, done.status, self.thresholds),
            **{name: heights[:, i] for i, name in enumerate(PEAKS)},
            "initial_state": done.initial.reshape(n, len(STATES) + 1),
            "final_state": done.final.reshape(n, len(STATES) + 1),
        }


@lru_cache
def compiled_parts(lanes: int, hertz: bool, lobes: int = 3) -> Compiled:
    """The model and the observer, compiled for a number of lanes; from the disk cache where it has them. The kernel is
    compiled along, before several threads ask for it at once."""
    rows = Rows(len(STATES), len(AUX), len(PARAMETERS), len(OBSERVED))
    make_stepper(lanes, rows)
    make_advance(lanes, rows)
    observer, marker = make_observer(lanes, lobes)
    return Compiled(make_right_hand_side(lanes, hertz, lobes), observer, marker)


def advance(gang: Gang, variant: tuple[bool, int], seconds: float, drain: bool) -> tuple[Gang, Finished]:
    """One slice of work: a task for any executor, in this process or in another."""
    done = gang.advance(compiled_parts(gang.lanes, *variant), seconds, drain)
    return gang, done
