"""Checks of a sweep: every point that ended well is run again with a smaller tolerance,
and continued for longer.

Their results are written to the record of the point when they end, so a resumed run
makes only the missing checks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nsdrill.app.stages import RunStages
from nsdrill.data import Array
from nsdrill.kernel.batch import choose_lanes
from nsdrill.kernel.settings import Simulation
from nsdrill.models.responses import trust_labels
from nsdrill.store import Source, columns
from nsdrill.sweep.refine import Rerun
from nsdrill.sweep.work import Work
from nsdrill.variables import CHECKS, OK, PENDING, has_failed

TIGHTER = 100.0
LEAST_RTOL = 1e-13
# limit of steps of a check over that of the run; a smaller tolerance takes 2.5 times as
# many steps
MORE_STEPS = 10
_BATCH = 1 << 17  # points whose states are in memory at a time


@dataclass(frozen=True)
class Check:
    """One check: its name, its integration, and the state of the record from which it
    starts."""

    name: str
    simulation: Simulation
    start: str


def checks(simulation: Simulation) -> tuple[Check, Check]:
    """The two checks. ``tight`` repeats the run with a hundredth of its tolerance.
    ``long`` continues the run from its final state for another transient and
    observation, so that it is observed after more than twice the transient."""
    steps = MORE_STEPS * simulation.max_steps
    tight = replace(simulation, rtol=max(simulation.rtol / TIGHTER, LEAST_RTOL), max_steps=steps)
    return (
        Check(CHECKS[0], tight, "initial_state"),
        Check(CHECKS[1], replace(simulation, max_steps=steps), "final_state"),
    )


def verify(stages: RunStages, work: Work) -> None:
    """Run the missing checks of the log."""
    log, progress = stages.log, stages.progress
    todo = {check: missing(log, check.name) for check in checks(work.simulation)}
    progress.total += sum(map(len, todo.values()))
    for check, points in todo.items():
        for start in range(0, len(points), _BATCH):
            _run(stages, work, check, points[start : start + _BATCH])


def _run(stages: RunStages, work: Work, check: Check, points: Array) -> None:
    log = stages.log
    first, last = int(points[0]), int(points[-1])
    states = columns(log, [check.start], first, last + 1)[check.start][points - first]
    rerun = Rerun.of(work, check.simulation, points, states)

    def store(done: Array, found: dict[str, Array]) -> None:
        records = np.concatenate([log.read(point, point + 1) for point in done.tolist()])
        records[f"{check.name}_status"] = found["status"]
        records[f"{check.name}_difference"] = work.kind.difference(_fields(records), found, found)
        for name in work.model.check_features:
            records[f"{check.name}_{name}"] = found[name]
        for name, values in trust_labels(
            _fields(records), records["response"], work.thresholds, work.kind.responses
        ).items():
            records[name] = values
        stages.write(done, records)

    lanes = max(stages.lanes, choose_lanes(-(-len(points) // stages.workers)))
    replace(stages, lanes=lanes).run(rerun, store, None, points, f"check: {check.name}")


def missing(log: Source, check: str) -> Array:
    """The points that ended well and lack this check."""
    status, checked = columns(log, ["status", f"{check}_status"]).values()
    return np.flatnonzero((status == OK) & (checked == PENDING))


def verified(log: Source) -> bool:
    """Whether all checks have run."""
    return not any(len(missing(log, check)) for check in CHECKS)


def any_failed(log: Source) -> bool:
    """Whether a check failed."""
    found = columns(log, [f"{check}_status" for check in CHECKS])
    return any(bool(np.any(_failed(found, check))) for check in CHECKS)


def forget_failed(records: Array) -> None:
    """Make failed checks pending in these records, in place, so that they run again."""
    for check in CHECKS:
        failed = _failed(records, check)
        for name in records.dtype.names or ():
            if name.startswith(f"{check}_"):
                records[name][failed] = np.nan if records[name].dtype.kind == "f" else 0
        records["trusted"][failed] = 0


def _failed(records: Array | dict[str, Array], check: str) -> Array:
    status = records[f"{check}_status"]
    return np.asarray(has_failed(status))


def _fields(records: Array) -> dict[str, Array]:
    return {name: records[name] for name in records.dtype.names or ()}
