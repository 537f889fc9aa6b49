"""One run along a schedule: segment after segment, each from where the one before has ended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nsdrill.kernel.gang import Compiled, Gang, Runs
from nsdrill.model.ramp import RAMPED, ahead, pack_ramp, ramped_model_for
from nsdrill.model.rhs import STATES, drifts, first_step, phase_rate, sizes
from nsdrill.model.schedule import PIECES, Array, Schedule
from nsdrill.observe.layout import OBSERVED
from nsdrill.observe.trace import BEGAN, make_tracer, samples_of, trace_store
from nsdrill.study.study import Study
from nsdrill.variables import OK, STEP_LIMIT

TWIST = STATES.index("twist")


def follow(
    study: Study, schedule: Schedule, duration: float, initial: Array, samples: int, interval: float,
    pieces: int = PIECES,
) -> tuple[Array, int, int, int, Array]:  # fmt: skip
    """Integrate along ``schedule`` for ``duration`` [s] from ``initial`` (states and drive angle, shape (9,)).

    Gives the samples taken, shape (samples, states), with the true twist; the status; accepted and rejected steps; and
    the final state, shape (9,).
    """
    parameters = study.parameters
    cuts = schedule.cuts(duration, pieces)
    table = pack_ramp(parameters, schedule, cuts, study.thresholds.stuck_below)
    size, drift, rate, step = sizes(table), drifts(table), phase_rate(table), first_step(table)
    model = ramped_model_for(parameters)
    parts = Compiled(model.right_hand_side(1), *make_tracer(1, len(RAMPED)))
    store = trace_store(samples, interval)
    state, status, accepted, rejected = initial, OK, 0, 0
    for i in range(len(table)):
        left = study.simulation.max_steps - accepted - rejected
        if left <= 0:
            status = STEP_LIMIT
            break
        store[BEGAN] = cuts[i]
        length = float(cuts[i + 1] - cuts[i])
        one = replace(study.simulation, transient=0.0, observe=length, max_steps=left)
        gang = Gang(1, 1, model.rows(len(OBSERVED)), store, 0, one)
        row = slice(i, i + 1)
        gang.add(np.array([i]), Runs(table[row], size[row], drift[row], rate[row], step[row], state[np.newaxis]))
        done = gang.advance(parts, 0.2, True)
        while len(done.job) == 0:
            done = gang.advance(parts, 0.2, True)
        state, status = done.final[0], int(done.status[0])
        accepted, rejected = accepted + int(done.accepted[0]), rejected + int(done.rejected[0])
        if status != OK:
            break
    taken = samples_of(store).copy()
    taken[:, TWIST] -= ahead(table, cuts, np.arange(len(taken)) * interval)
    return taken, status, accepted, rejected, state


def scheduled(study: Study, given: dict[str, float | None]) -> Schedule:
    """The schedule of a study, with the values ``given`` in place of its own."""
    fixed = {name: value for name, value in given.items() if value is not None}
    ramps = {name: ramp for name, ramp in study.ramps.items() if name not in fixed}
    return Schedule(replace(study.operation, **fixed), ramps)
