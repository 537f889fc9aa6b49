"""A sweep refined where the responses differ: the engine is driven level by level, and
what was not run is inferred.

Everything known is in the log, where points that are not needed stay pending; after a
kill the levels are retraced from it. The inferred points come into being when the
results are written.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.app.stages import RunStages, remaining
from nsdrill.data import Array
from nsdrill.models.kept import Kept
from nsdrill.store import Sink, Source, columns, pending_records
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.refine import Refinement, refine
from nsdrill.sweep.work import Work
from nsdrill.variables import INFERRED, OK, PENDING

UNKNOWN = -1  # the outcome of a point that has not run


class RefinementGrid:
    """The units of a refined sweep: points, or whole chains where a state is
    carried."""

    def __init__(self, plan: Plan, refined: tuple[str, ...], depth: int) -> None:
        carried = plan.along if plan.chain_length > 1 else None
        lengths = [1 if name == carried else len(values) for name, values in plan.axes.items()]
        self.plan, self.depth = plan, depth
        several = [plan.samples] if plan.samples else []  # each refined by itself
        self.shape = (*lengths, *several)
        self.axes = (*(name in refined for name in plan.axes), *(False for _ in several))
        self.points = plan.points_of(np.arange(plan.chains)[:, None], np.arange(plan.chain_length))
        """Numbers of the points of each unit: [units, points of a unit]."""
        self.points = self.points.reshape(plan.chains, plan.chain_length)

    def trace(
        self, outcomes: Array, *, everything: bool = False
    ) -> tuple[Refinement, Array, Array]:
        """How far the refinement is with these outcomes (int [points]: the response,
        :data:`UNKNOWN`, or less where the run failed); which units are known; and, if
        it is complete, the outcome that each point is given [points]."""
        rows = outcomes[self.points]
        known = np.all(rows != UNKNOWN, axis=1)
        classes = np.zeros(len(rows), dtype=np.int64)
        distinct = rows[known] if self.plan.chain_length > 1 else rows[known, 0]
        _, members, inverse = np.unique(distinct, axis=0, return_index=True, return_inverse=True)
        members, classes[known] = np.flatnonzero(known)[members], inverse.ravel()
        # A failed run says nothing about its neighbours: it is like no other, not even
        # like another failed one.
        failed = known & np.any(rows < UNKNOWN, axis=1)
        classes[failed] = -1 - np.flatnonzero(failed)
        step = refine(
            classes.reshape(self.shape),
            known.reshape(self.shape),
            self.axes,
            self.depth,
            everything=everything,
        )
        given = outcomes.copy()
        if step.filled is not None:
            filled = step.filled.ravel()
            inferred = np.flatnonzero(~step.needed.ravel() & ~(known & everything))
            given[self.points[inferred]] = rows[members[filled[inferred]]]
        return step, known, given


class RefinedSweep:
    """The refinement of ``study`` over ``log``, as far as it is."""

    def __init__(self, study: Study, plan: Plan, log: Sink) -> None:
        self.grid, self.log, self.study = (
            RefinementGrid(plan, study.refined, study.refine),
            log,
            study,
        )
        self.outcomes = response_codes_in(log)
        self.retrace()

    def retrace(self) -> None:
        """Retrace the levels from what is known."""
        self.step, self.known, self.given = self.grid.trace(self.outcomes)

    @property
    def complete(self) -> bool:
        return self.step.filled is not None

    def run(self, stages: RunStages, work: Work) -> None:
        """Run what is needed, level by level."""
        plan, progress = work.plan, stages.progress

        def store(points: Array, found: dict[str, Array]) -> None:
            stages.store(points, found)
            self.outcomes[points] = response_codes(found["status"], found["response"])

        progress.before = int(np.count_nonzero(self.log.done()))
        while not self.complete:
            needed = self.step.needed.ravel()
            starts, pending = remaining(plan, self.log, np.flatnonzero(needed & ~self.known))
            progress.total, level = int(needed.sum()) * plan.chain_length, self.step.level
            stages.run(
                work,
                store,
                starts,
                pending,
                f"level {level} of {self.grid.depth}" if level else "coarse grid",
            )
            self.retrace()

    def results(self) -> InferredSource:
        """The log with all its points, once it is complete."""
        assert self.complete
        needed = np.zeros(self.grid.plan.points, dtype=bool)
        needed[self.grid.points[self.step.needed.ravel()]] = True
        return InferredSource(
            self.log, needed, self.given, summary(self.study, int(needed.sum()), len(needed))
        )


class InferredSource:
    """A log in which the points that were not needed have what their neighbours say: to
    be read, never written."""

    def __init__(self, log: Source, needed: Array, given: Array, attrs: Mapping[str, Any]) -> None:
        self._log, self._needed, self._given = log, needed, given
        self.attrs = dict(attrs)
        if (recovery_text := getattr(log, "recovery_text", None)) is not None:
            self.recovery_text = recovery_text

    @property
    def header(self) -> dict[str, Any]:
        header = self._log.header
        return {**header, "attrs": {**header["attrs"], **self.attrs}}

    @property
    def n_points(self) -> int:
        return self._log.n_points

    @property
    def kept(self) -> Kept:
        return self._log.kept

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]."""
        records = self._log.read(start, stop)
        inferred = np.flatnonzero(~self._needed[start:stop])
        blank = pending_records(len(inferred), self.kept)
        blank["status"] = INFERRED
        blank["response"] = self._given[start:stop][inferred]
        records[inferred] = blank
        return records


def reinfer(study: Study, plan: Plan, status: Array, response: Array) -> tuple[Array, int]:
    """New responses for the inferred points of a file after those of its runs have
    changed (both on the grid of the file): the responses of all, and how many more
    points would have to be run, because the corners of their cell no longer agree. If
    there are any, what was inferred stays open."""
    grid = RefinementGrid(plan, study.refined, study.refine)
    step, known, given = grid.trace(response_codes(status, response).ravel(), everything=True)
    missing = int(np.count_nonzero(step.needed.ravel() & ~known)) * plan.chain_length
    inferred = status == INFERRED
    return np.where(inferred, given.reshape(status.shape), response).astype(response.dtype), missing


def response_codes(status: Array, response: Array) -> Array:
    """Response of points, :data:`UNKNOWN` where they have not run, something less where
    they failed: int16."""
    status = np.asarray(status, dtype=np.int16)
    failed = np.where((status == PENDING) | (status == INFERRED), UNKNOWN, UNKNOWN - status)
    return np.where(status == OK, np.asarray(response, dtype=np.int16), failed).astype(np.int16)


def response_codes_in(log: Sink) -> Array:
    """The outcome of every point of a log."""
    if not log.done().any():
        return np.full(log.n_points, UNKNOWN, np.int16)
    return response_codes(**columns(log, ["status", "response"]))


def summary(study: Study, run: int, points: int) -> dict[str, Any]:
    """Root attributes: how much was run, and to what spacing [SI] the borders between
    responses are known: of an axis with equal ratios the widest."""
    spacing = {}
    for name in study.refined:
        steps = np.diff(study.axes[name])
        spacing[name] = float(steps[-1 if "spacing" in study.resolved["sweep"][name] else 0])
    return {
        "refine": study.refine,
        "points_run": run,
        "points_inferred": points - run,
        "border_spacing": spacing,
    }
