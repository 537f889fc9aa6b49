"""A sweep that is refined where the responses differ, level by level; the responses of
points that are not run are inferred.

The log holds all runs; points that are not needed stay pending in it. After a kill the
levels are retraced from the log. Inferred points are made when the results are written.
"""

from __future__ import annotations

import numpy as np

from nsdrill.app.experiment import Experiment
from nsdrill.app.running.stages import RunStages, remaining
from nsdrill.data import Array, Attributes
from nsdrill.store import Sink, Source, columns, pending_records
from nsdrill.store.points import Header
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Refinement, refine
from nsdrill.sweep.work import Work
from nsdrill.variables import INFERRED, OK, PENDING

UNKNOWN = -1  # the outcome of a point that has not run


class RefinementGrid:
    """The grid of the units of a refined sweep (:meth:`nsdrill.sweep.plan.Plan.units`):
    points, or whole chains where a state is carried. ``points`` are the numbers of the
    points of each unit [units, points of a unit]."""

    def __init__(self, experiment: Experiment) -> None:
        plan, refined = experiment.plan, experiment.study.refined
        carried = plan.along if plan.carried else None
        lengths = [1 if name == carried else len(values) for name, values in plan.axes.items()]
        self.plan, self.depth = plan, experiment.study.refine
        several = [plan.samples] if plan.samples else []  # each is refined on its own
        self.shape = (*lengths, *several)
        self.axes = (*(name in refined for name in plan.axes), *(False for _ in several))
        self.points = plan.units()

    def trace(self, outcomes: Array, *, everything: bool = False) -> tuple[Refinement, Array, Array]:
        """The state of the refinement with these ``outcomes`` (int [points]: the
        response, :data:`UNKNOWN`, or less where the run failed): the refinement, which
        units are known (bool [units]), and the outcome of each point [points], with
        inferred ones if the refinement is complete. ``everything`` keeps all known
        outcomes, also where they are not needed."""
        rows = outcomes[self.points]
        known = np.all(rows != UNKNOWN, axis=1)
        classes = np.zeros(len(rows), dtype=np.int64)
        distinct = rows[known] if self.plan.carried else rows[known, 0]
        _, members, inverse = np.unique(distinct, axis=0, return_index=True, return_inverse=True)
        members, classes[known] = np.flatnonzero(known)[members], inverse.ravel()
        # The response near a failed run is unknown: each failed run is its own class.
        failed = known & np.any(rows < UNKNOWN, axis=1)
        classes[failed] = -1 - np.flatnonzero(failed)
        step = refine(
            classes.reshape(self.shape), known.reshape(self.shape), self.axes, self.depth, everything=everything
        )
        inferred_outcomes = outcomes.copy()
        if step.filled is not None:
            filled = step.filled.ravel()
            inferred = np.flatnonzero(~step.needed.ravel() & ~(known & everything))
            inferred_outcomes[self.points[inferred]] = rows[members[filled[inferred]]]
        return step, known, inferred_outcomes


class RefinedSweep:
    """The refinement of an experiment with the runs in ``log``. ``inferred`` are the
    outcomes of all points [points], with inferred ones once it is complete."""

    def __init__(self, experiment: Experiment, log: Sink) -> None:
        self.grid, self.log, self.study = RefinementGrid(experiment), log, experiment.study
        self.outcomes = response_codes_in(log)
        self.retrace()

    def retrace(self) -> None:
        """Retrace the levels from the known outcomes."""
        self.step, self.known, self.inferred = self.grid.trace(self.outcomes)

    @property
    def complete(self) -> bool:
        return self.step.filled is not None

    def run(self, stages: RunStages, work: Work) -> None:
        """Run the needed points, level by level."""
        plan, progress = work.plan, stages.progress

        def store(points: Array, values: dict[str, Array]) -> None:
            stages.store(points, values)
            self.outcomes[points] = response_codes(values["status"], values["response"])

        progress.before = int(np.count_nonzero(self.log.done()))
        while not self.complete:
            needed = self.step.needed.ravel()
            starts, pending = remaining(plan, self.log, plan.chains_of(np.flatnonzero(needed & ~self.known)))
            progress.total, level = int(needed.sum()) * self.grid.points.shape[1], self.step.level
            stages.run(work, store, starts, pending, f"level {level} of {self.grid.depth}" if level else "coarse grid")
            self.retrace()

    def results(self) -> InferredSource:
        """All points, inferred ones included; the refinement must be complete."""
        assert self.complete
        needed = np.zeros(self.grid.plan.points, dtype=bool)
        needed[self.grid.points[self.step.needed.ravel()]] = True
        return InferredSource(self.log, needed, self.inferred, summary(self.study, int(needed.sum()), len(needed)))


class InferredSource:
    """A source of points with those of ``log`` where ``needed`` (bool [points]), and
    with the responses ``inferred`` [points] elsewhere; ``attrs`` are added to the root
    attributes."""

    def __init__(self, log: Source, needed: Array, inferred: Array, attrs: Attributes) -> None:
        self._log, self._needed, self._inferred = log, needed, inferred
        self.attrs = dict(attrs)
        self.header: Header = {**log.header, "attrs": {**log.header["attrs"], **attrs}}
        self.n_points, self.contents = log.n_points, log.contents
        if (recovery_text := getattr(log, "recovery_text", None)) is not None:
            self.recovery_text = recovery_text

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]."""
        records = self._log.read(start, stop)
        inferred = np.flatnonzero(~self._needed[start:stop])
        blank = pending_records(len(inferred), self.contents)
        blank["status"] = INFERRED
        blank["response"] = self._inferred[start:stop][inferred]
        records[inferred] = blank
        return records


def reinfer(experiment: Experiment, status: Array, response: Array) -> tuple[Array, int]:
    """Infer again after the labels of the runs of a file have changed; ``status`` and
    ``response`` are on the grid of the file. Gives the responses of all points, and how
    many more points would have to be run because the corners of their cell no longer
    agree; if there are any, the inferred responses are not valid."""
    grid = RefinementGrid(experiment)
    step, known, inferred_outcomes = grid.trace(response_codes(status, response).ravel(), everything=True)
    missing = int(np.count_nonzero(step.needed.ravel() & ~known)) * grid.points.shape[1]
    inferred = status == INFERRED
    return np.where(inferred, inferred_outcomes.reshape(status.shape), response).astype(response.dtype), missing


def response_codes(status: Array, response: Array) -> Array:
    """The outcome of points: the response, :data:`UNKNOWN` where they have not run,
    less where they failed: int16."""
    status = np.asarray(status, dtype=np.int16)
    failed = np.where((status == PENDING) | (status == INFERRED), UNKNOWN, UNKNOWN - status)
    return np.where(status == OK, np.asarray(response, dtype=np.int16), failed).astype(np.int16)


def response_codes_in(log: Sink) -> Array:
    """The outcome of every point of a log."""
    if not log.done().any():
        return np.full(log.n_points, UNKNOWN, np.int16)
    return response_codes(**columns(log, ["status", "response"]))


def summary(study: Study, run: int, points: int) -> Attributes:
    """The root attributes of a refined sweep: the numbers of ``run`` and of inferred
    points, and the spacing [SI] to which the borders between responses are known (the
    widest, of an axis with equal ratios)."""
    spacing = {}
    for name in study.refined:
        steps = np.diff(study.axes[name])
        spacing[name] = float(steps[-1 if "spacing" in study.resolved["sweep"][name] else 0])
    return {"refine": study.refine, "points_run": run, "points_inferred": points - run, "border_spacing": spacing}
