"""One run with its samples: at one operating point, or along a schedule."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from nsdrill.abi import Layout
from nsdrill.data import Array
from nsdrill.kernel.batch import Batch, Compiled, FinishedRuns, choose_lanes
from nsdrill.kernel.settings import Simulation
from nsdrill.models.operation import PIECES, History, OperatingPoint, Schedule, Values, in_trace_as, integral
from nsdrill.models.ramp import AHEAD, ramps_of
from nsdrill.models.registry import model_named
from nsdrill.models.variant import Variant, variant_at
from nsdrill.observe.sampled import BEGAN, NEXT, make_tracer, samples_of, trace_store
from nsdrill.records import dataclass
from nsdrill.study.study import Study
from nsdrill.variables import OK, STEP_LIMIT

CHAINED = 4096  # segments of a ramp that are run in one call


class Segments(NamedTuple):
    """Runs one after another: the times ``begin`` [n] [s] at which they begin, their lane
    parameters ``table`` [n, columns], and their marks ``transient`` and ``observe`` [n]
    [s]."""

    begin: Array
    table: Array
    transient: Array
    observe: Array


@dataclass(frozen=True)
class SimulatedMotion:
    """One run of a ``study`` along a ``schedule``: its ``states`` [samples, states] at
    ``time`` [s], ``initial`` and ``final`` state with the phase last, the ``status`` with
    its code in a results file, the numbers of ``accepted`` and ``rejected`` steps, and the
    simulated time ``seconds``. Where it was observed, ``found`` has features and labels;
    of the replay of a stored point ``same_bits`` says whether it ends in the stored
    state."""

    study: Study
    schedule: Schedule
    time: Array
    states: Array
    initial: Array
    final: Array
    status: int
    accepted: int
    rejected: int
    seconds: float
    found: Mapping[str, float] = field(default_factory=dict)
    same_bits: bool | None = None

    @property
    def steps(self) -> int:
        """The number of steps tried."""
        return self.accepted + self.rejected

    @cached_property
    def variables(self) -> dict[str, Array]:
        """The variables of a trace [samples] by name."""
        variant = variant_at(model_named(self.study.model.name), self.study.parameters)
        state = {name: self.states[:, i].copy() for i, name in enumerate(variant.states)}
        state["drive_angle"] = self.initial[-1] + drive_angle(self.study, self.schedule, self.time)
        history, ramped = self.schedule.at(self.time), bool(self.schedule.ramps)
        scheduled = {in_trace_as(name): values for name, values in vars(history).items()}
        point = history if ramped else self.schedule.start
        known = {variable.name for variable in self.study.model.trace}
        shown = {name: values for name, values in state.items() if name in known}
        more = {name: values for name, values in scheduled.items() if name not in state}
        return {**shown, **variant.outputs(points_of(self.study, point), state), **more}


def run_at(
    study: Study,
    operation: OperatingPoint,
    simulation: Simulation,
    initial: Array,
    samples: int,
    interval: float,
    begin: float = 0.0,
) -> SimulatedMotion:
    """A run at one operating point from ``initial`` (states and phase), with the marks and
    the method of ``simulation`` and ``samples`` at multiples of ``interval`` [s]. Samples
    begin at ``begin`` [s], which does not affect the run."""
    variant = _variant(study, simulation)
    # in the layout of sweeps, so that their compiled step is used
    rows, lanes = variant.rows(variant.observed), choose_lanes(1)
    parts = Compiled(variant.right_hand_side(lanes), *make_tracer(lanes, rows))
    table = variant.model.pack(points_of(study, operation), study.thresholds)
    marks = np.array([[-begin], [simulation.transient], [simulation.observe]])
    segments = Segments(marks[0], table, marks[1], marks[2])
    run = _run(variant, rows, parts, segments, simulation, initial, samples, interval)
    seconds = simulation.transient + simulation.observe
    return _motion(study, Schedule(operation, {}), initial, run, begin, interval, seconds)


def run_schedule(
    study: Study,
    schedule: Schedule,
    duration: float,
    initial: Array,
    samples: int,
    interval: float,
    pieces: int = PIECES,
) -> SimulatedMotion:
    """As :func:`run_at`, along ``schedule`` for ``duration`` [s]: segment after segment,
    each from the final state of the previous one."""
    variant = _variant(study, study.simulation)
    ramps = ramps_of(variant)
    cuts = schedule.cuts(duration, pieces)
    table = ramps.pack(study.parameters, study.initial, schedule, cuts, study.thresholds)
    columns, lanes = ramps.columns, choose_lanes(1)
    rows = variant.rows(columns=len(columns))
    tracer = make_tracer(lanes, rows, columns.index(AHEAD[0]))
    parts = Compiled(ramps.right_hand_side(lanes), *tracer)
    segments = Segments(cuts[:-1], table, np.zeros(len(table)), np.diff(cuts))
    following = ramps.following(study.parameters, schedule, cuts)
    run = _run(variant, rows, parts, segments, study.simulation, initial, samples, interval, following)
    taken = run.states.copy()
    ramps.correct(taken, table, cuts, np.arange(len(taken)) * interval)
    return _motion(study, schedule, initial, run._replace(states=taken), 0.0, interval, duration)


def _motion(
    study: Study, schedule: Schedule, initial: Array, run: _Run, begin: float, interval: float, seconds: float
) -> SimulatedMotion:
    """The motion of a run with samples from ``begin`` [s] on."""
    time = begin + np.arange(len(run.states)) * interval
    if run.status == OK and len(time) and np.isclose(time[-1], seconds, rtol=1e-12, atol=0.0):
        run.states[-1] = run.final[: run.states.shape[1]]  # where the interpolant ends, but for its rounding
    return SimulatedMotion(study, schedule, time, run.states, initial, run.final, *run[1:4], seconds)


class _Run(NamedTuple):
    states: Array
    status: int
    accepted: int
    rejected: int
    final: Array


def _variant(study: Study, simulation: Simulation) -> Variant:
    variant = variant_at(model_named(study.model.name), study.parameters)
    return variant.implicit if simulation.method == "implicit" else variant


def _run(
    variant: Variant,
    rows: Layout,
    parts: Compiled,
    segments: Segments,
    simulation: Simulation,
    initial: Array,
    samples: int,
    interval: float,
    following: Array | None = None,
) -> _Run:
    """The run over all ``segments``, until one does not end well or all steps of the
    ``simulation`` are used. Those of a ramp, with the rates at which held positions are
    ``following`` it [segments, slopes], are chained: the loop goes from one to the next,
    which has the same bits and does not cost the time of a call.

    The moving values are continuous, so each segment goes on with the step of the one
    before."""
    lanes = choose_lanes(1)
    store = trace_store(samples, interval, len(variant.states))
    state, status, accepted, rejected, step = initial, OK, 0, 0, 0.0

    def advance(first: int, end: int, steps_left: int) -> tuple[FinishedRuns, float]:
        batch = Batch(lanes, end - first, rows, store, 0, replace(simulation, max_steps=steps_left))
        begin, table, transient, observe = (array[first:end] for array in segments)
        added = variant.runs(table, np.tile(state, (end - first, 1)))
        if following is not None:
            added = replace(added, frame_rates=added.frame_rates + following[first:end], halves=transient)
        first_step = np.broadcast_to(added.first_step, end - first).copy()
        first_step[max(1 - first, 0) :] = 0.0
        batch.proposed, store[BEGAN] = step, begin[0]
        batch.add(np.arange(end - first), replace(added, first_step=first_step, transient=transient, observe=observe))
        return batch.run_chain(parts), batch.proposed

    at, together, count = 0, CHAINED if following is not None else 1, len(segments.begin)
    while at < count:
        steps_left = simulation.max_steps - accepted - rejected
        if status != OK or steps_left <= 0:
            status = STEP_LIMIT if status == OK else status
            break
        sampled, end = store[NEXT], min(at + together, count)
        done, proposed = advance(at, end, steps_left)
        if end > at + 1 and (np.any(done.status != OK) or int((done.accepted + done.rejected).sum()) >= steps_left):
            store[NEXT], together = sampled, 1  # one of them ends the run: again, one by one
            continue
        state, status, at, step = done.final[-1], int(done.status[-1]), end, proposed
        accepted, rejected = accepted + int(done.accepted.sum()), rejected + int(done.rejected.sum())
    return _Run(samples_of(store, len(variant.states)), status, accepted, rejected, state)


def schedule_of(study: Study, values: dict[str, float | None]) -> Schedule:
    """The schedule of a study, with ``values`` (SI, by name; None: not set) in place of
    those of its operation and ramps."""
    fixed = {name: value for name, value in values.items() if value is not None}
    ramps = {name: ramp for name, ramp in study.ramps.items() if name not in fixed}
    return Schedule(replace(study.operation, **fixed), ramps)


def points_of(study: Study, operation: OperatingPoint | History) -> Values:
    """The values of a run at an operating point, or at several [n] of a history."""
    values = tuple(getattr(operation, name) for name in study.parameters.point.names())
    return Values(study.parameters, study.initial, values)


def select_states(study: Study, names: Array, state: Array) -> Array:
    """The states that the string of ``study``, that of one point, has, from ``state``
    with the states ``names`` of a file."""
    needed = study.model.states(study.parameters)
    return np.asarray(state, dtype=float)[[names.tolist().index(name) for name in needed]]


def drive_angle(study: Study, schedule: Schedule, time: Array) -> Array:
    """The angle of the drive since time zero [rad]: the exact integral of its speed."""
    model = model_named(study.model.name)
    knots = schedule.knots(*({"rotary_speed"} & set(study.parameters.point.names())))
    table = model.pack(points_of(study, schedule.at(knots)), study.thresholds, len(knots))
    return integral(knots, variant_at(model, study.parameters).phase_rate(table), time)
