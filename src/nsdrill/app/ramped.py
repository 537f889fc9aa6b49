"""One run along a schedule: segment after segment, each from the final state of the
previous one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nsdrill.kernel.batch import Batch, Compiled, choose_lanes
from nsdrill.models.schedule import PIECES, Array, Schedule
from nsdrill.observe.trace import BEGAN, make_tracer, samples_of, trace_store
from nsdrill.study.study import Study
from nsdrill.variables import OK, STEP_LIMIT


def run_schedule(
    study: Study,
    schedule: Schedule,
    duration: float,
    initial: Array,
    samples: int,
    interval: float,
    pieces: int = PIECES,
) -> tuple[Array, int, int, int, Array]:
    """Integrate along ``schedule`` for ``duration`` [s] from ``initial`` (states and
    phase).

    ``samples`` are at multiples of ``interval`` [s]. Returns the samples taken
    [samples, states]; the status; the numbers of accepted and rejected steps; and the
    final state.
    """
    model = study.model.dynamics
    fixed = model.variant(study.parameters)
    if study.simulation.method == "implicit":
        fixed = model.implicit(fixed)
    cuts = schedule.cuts(duration, pieces)
    table = model.ramps.pack(study.parameters, schedule, cuts, study.thresholds)
    rows = model.rows(fixed, columns=len(model.ramps.columns(fixed)))
    states, lanes = len(model.states(fixed)), choose_lanes(1)
    parts = Compiled(model.ramps.right_hand_side(lanes, fixed), *make_tracer(lanes, rows))
    store = trace_store(samples, interval, states)
    state, status, accepted, rejected = initial, OK, 0, 0
    for i in range(len(table)):
        steps_left = study.simulation.max_steps - accepted - rejected
        if steps_left <= 0:
            status = STEP_LIMIT
            break
        store[BEGAN] = cuts[i]
        length = float(cuts[i + 1] - cuts[i])
        simulation = replace(study.simulation, transient=0.0, observe=length, max_steps=steps_left)
        batch = Batch(lanes, 1, rows, store, 0, simulation)
        batch.add(np.array([i]), model.runs(table[i : i + 1], fixed, state[np.newaxis]))
        done = batch.run_alone(parts)
        state, status = done.final[0], int(done.status[0])
        accepted, rejected = accepted + int(done.accepted[0]), rejected + int(done.rejected[0])
        if status != OK:
            break
    taken = samples_of(store, states).copy()
    model.ramps.mend(taken, table, cuts, np.arange(len(taken)) * interval, fixed)
    return taken, status, accepted, rejected, state


def schedule_of(study: Study, values: dict[str, float | None]) -> Schedule:
    """The schedule of a study, with ``values`` (SI, by name; None: not set) in place of
    those of its operation and ramps."""
    fixed = {name: value for name, value in values.items() if value is not None}
    ramps = {name: ramp for name, ramp in study.ramps.items() if name not in fixed}
    return Schedule(replace(study.operation, **fixed), ramps)
