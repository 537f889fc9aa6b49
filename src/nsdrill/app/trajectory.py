"""One run with its trajectory: simulate an operating point, or replay a point of a
sweep."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np

from nsdrill.app.experiment import prepare
from nsdrill.app.provenance import provenance, unlike
from nsdrill.app.ramped import run_schedule, schedule_of
from nsdrill.app.stored import stored_experiment
from nsdrill.data import IN_MEMORY, Array, Results, Trace, json_text
from nsdrill.errors import InputError, Refusal, printable
from nsdrill.kernel.batch import Batch, Compiled, choose_lanes
from nsdrill.kernel.settings import LONGEST, Simulation
from nsdrill.models.leaves import OPERATION, Values, chosen_at, values_at, word_in, word_or_number, words_of
from nsdrill.models.operation import Operation
from nsdrill.models.schedule import Schedule
from nsdrill.models.steepness import METHODS, advice
from nsdrill.models.steepness import implicit as implicit_points
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.observe.trace import BEGAN, make_tracer, samples_of, trace_store
from nsdrill.store import read_point, read_results
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.units import WithUnit, readable
from nsdrill.variables import INFERRED, OK, PENDING, SAMPLE, SCHEDULED, STEP_LIMIT

DEFAULT_SAMPLE = 0.01  # s: more than ten samples in the fastest motion, the collar on the wall
MAX_SAMPLES = 50_000_000


@dataclass(frozen=True)
class Trajectory:
    """A trace and the status of its run, with the codes of a results file. ``advice``
    is the remedy where the run reached its limit of steps.

    Of a replay, ``same_bits`` says whether the final state has the stored bits, and
    ``differing`` which versions differ from those that made the results, in words;
    ``apart`` says how far the final state is from the stored one."""

    trace: Trace
    status: int
    same_bits: bool | None = None
    differing: tuple[str, ...] = ()
    advice: str = ""
    apart: str = ""

    @property
    def warning(self) -> str:
        """What to say of a replay that has other bits."""
        cause = "; ".join(self.differing) or "nothing that the file records, so this is a fault: please report it"
        return (
            f"does not end in the stored final state{self.apart}. What differs: {cause}. Where the "
            f"motion is chaotic, the trajectory is then another one of the same kind."
        )


def simulate(
    study: Study,
    *,
    at_sample: float | None = None,
    depth: float | None = None,
    wob: float | None = None,
    rotary_speed: float | None = None,
    start: int | None = None,
    duration: float | None = None,
    sample: float = DEFAULT_SAMPLE,
    state: np.ndarray | None = None,
) -> Trajectory:
    """Simulate one operating point of a study, or its ramps.

    ``depth`` [m], ``wob`` [N] and ``rotary_speed`` [rad/s] are by default those of its
    ``operation``; an argument replaces a ramp of the study. ``start`` is the number of
    the start where the study has several; ``state`` [states + 1], the drive angle last,
    replaces the start. The run takes ``duration`` [s], by default the transient and the
    observation, or until the last knot of the ramps, and is sampled every ``sample``
    [s]. Uncertain numbers have the values in their own sections of the study, or with
    ``at_sample`` those of the sample with this number. InputError for values outside
    the model."""
    if at_sample is not None:
        at_sample = _sample("the study", at_sample, study.samples)
        study = _of_sample(study, at_sample)
    if any(map(words_of, study.swept)):  # keys that the chosen words do not read take defaults
        parameters, start_of_all, _ = chosen_at(study.parameters, study.initial, {})
        study = replace(study, parameters=parameters, initial=start_of_all)
    overrides = {"depth": depth, "wob": wob, "rotary_speed": rotary_speed}
    try:
        schedule = schedule_of(
            study, {name: None if value is None else float(value) for name, value in overrides.items()}
        )
        operation = schedule.start
        for one in study.model.orders:
            if one.upper != "operation.depth" or operation.depth > (length := attrgetter(one.lower)(study.parameters)):
                continue
            found, least = f"{operation.depth:g} m", f"{length:g} m"
            if isinstance(depth, WithUnit):
                found, least = readable(depth, "m"), readable(WithUnit(length, depth.unit), "m")
            raise ValueError(f"depth: found {found}, allowed: more than {one.words}, {least}")
    except ValueError as error:
        raise InputError(f"The operating point is outside the model. {error}.") from error
    simulation = study.simulation
    if duration is None and schedule.ramps:
        duration = schedule.end
    if duration is not None:
        if not 0 < duration <= LONGEST:
            allowed = f"more than 0 s and at most {LONGEST:g} s"
            raise Refusal("duration", _seconds(duration), allowed)
        # Steps end at the marks of the run: without a transient there is one
        # observation.
        simulation = replace(simulation, transient=0.0, observe=float(duration))
    number = _start("the study", start, study.initial.starts)
    initial = study.model.dynamics.starts(_points(study, operation), number)[0]
    if state is not None:
        initial = state
    extra: dict[str, Any] = {"start": number} if study.initial.starts else {}
    extra |= {} if at_sample is None else {SAMPLE: int(at_sample)}
    if words := [key for key in study.swept if words_of(key)]:
        extra["at"] = json_text({key: word_in(study.parameters, study.initial, key) for key in words})
    return _trace(study, schedule, simulation, initial, sample, "simulate", extra)


def replay(
    source: Results | str | os.PathLike[str],
    *,
    depth: float | None = None,
    wob: float | None = None,
    rotary_speed: float | None = None,
    at: Mapping[str, float] | None = None,
    procedure: str | None = None,
    start: int | None = None,
    sample: float = DEFAULT_SAMPLE,
) -> Trajectory:
    """Run the point nearest to these values again, from its stored initial state.
    ``source`` is a results file or complete results.

    ``at`` maps keys of axes to values in SI; those of the operation may be in ``at`` or
    in their own arguments. An axis with a single value may be left out, and so may the
    procedure of a sweep with one procedure. The number of the ``start`` is required
    where every operating point has several starts, and only there. The trace is sampled
    every ``sample`` [s]. InputError for values beyond the sweep.
    """
    outline = source if isinstance(source, Results) else read_results(source, ())
    path = IN_MEMORY if isinstance(source, Results) else source
    experiment = stored_experiment(path, outline.attrs, outline.coords, outline.drawn)
    study, plan = experiment.study, experiment.plan
    units = units_of(study)
    wanted: dict[str, float] = {}
    operation = {"depth": depth, "wob": wob, "rotary_speed": rotary_speed}
    requested = {**(at or {}), **{name: value for name, value in operation.items() if value is not None}}
    sample_number = _sample(path, requested.pop(SAMPLE, None), plan.samples)
    if unknown := [key for key in requested if key not in plan.axes or key in plan.drawn]:
        allowed = ", ".join(key for key in plan.axes if key not in plan.drawn)
        samples = f", and {SAMPLE}, as its uncertain numbers go together" if plan.samples else ""
        raise InputError(f"{path}: --at: found {', '.join(unknown)}; allowed: the axes {allowed}{samples}.")
    for name, values in plan.axes.items():
        if name not in requested and len(values) > 1:
            raise InputError(
                f"{path}: the sweep has {len(values)} values of {name}. Say which one with {option_of(name)}."
            )
        wanted[name] = _on_axis(path, name, requested.get(name, float(values[0])), values, units[name])
    if procedure is None:
        if len(plan.procedures) > 1:
            raise InputError(f"{path}: the sweep went {' and '.join(plan.procedures)}. Say which one with --procedure.")
        procedure = plan.procedures[0]
    start_number = _start(path, start, plan.starts)
    try:
        number, values_there = plan.find(wanted, procedure, start_number, sample_number)
    except ValueError as error:
        raise InputError(f"{path}: {error}.") from error
    place = tuple(int(i) for i in np.unravel_index(number, plan.grid))
    names = ("status", "initial_state", "final_state")
    point = {name: source[name][place] for name in names} if isinstance(source, Results) else read_point(path, *place)
    if point["status"] == PENDING:
        raise InputError(f"{path}: that point has not been run. Finish the sweep with nsdrill run --resume.")
    if point["status"] == INFERRED:
        status = (outline if isinstance(source, Results) else read_results(source, ["status"]))["status"]
        raise InputError(f"{path}: {_not_run(status, plan, number, units)}")
    implicit = bool(experiment.chosen.points(np.array([number]))[0])
    here = values_at(study.parameters, study.initial, values_there)
    axes = {key: np.array([value]) for key, value in values_there.items()}
    study = replace(study, parameters=here.parameters, initial=here.initial, axes=axes, drawn={})
    point = point | {name: select_states(study, outline.coords["state"], point[name]) for name in names[1:]}
    schedule = Schedule(Operation(*here.operation), {})
    extra: dict[str, Any] = {"procedure": procedure, "replay_of": printable(str(path))}
    if further := {key: word_or_number(key, value) for key, value in values_there.items() if key not in OPERATION}:
        extra["at"] = json_text(further)
    if plan.starts:
        extra["start"] = start_number
    if plan.samples:
        extra[SAMPLE] = sample_number
    initial = np.asarray(point["initial_state"], dtype=float)
    result = _trace(study, schedule, study.simulation, initial, sample, "replay", extra, implicit)
    same = result.status == int(point["status"]) and bool(
        np.array_equal(result.trace.attrs["final_state"], point["final_state"], equal_nan=True)
    )
    states = study.model.dynamics.states(study.model.dynamics.variant(study.parameters))
    return replace(
        result,
        same_bits=same,
        differing=tuple(unlike(outline.attrs, "numpy_version", "processor")),
        apart="" if same else _apart(result.trace, states, np.asarray(point["final_state"])),
    )


def _apart(trace: Trace, names: tuple[str, ...], stored: Array) -> str:
    """How far the final state of a trace is from the ``stored`` one."""
    final = np.asarray(trace.attrs["final_state"])
    ranges = [float(np.ptp(trace.variables[name])) or 1.0 for name in names]
    shares = np.abs(final - stored)[: len(names)] / ranges
    if not np.isfinite(shares).all():
        return ""
    worst = int(np.argmax(shares))
    return f", but in {names[worst]} {shares[worst]:.2g} of its range away, in the others less"


def _start(where: str | os.PathLike[str], start: int | None, starts: int) -> int:
    """The number of the start, 0 where there is one start; InputError where ``start``
    is not a number of one of the ``starts``."""
    if start is None:
        if starts:
            raise InputError(
                f"{where}: every operating point has {starts} starts. Say which one with --start, 0 to {starts - 1}."
            )
        return 0
    if not starts:
        raise InputError(f"{where}: --start: found {start}; allowed: nothing, as every operating point has one start.")
    if not 0 <= start < starts:
        raise InputError(f"{where}: --start: found {start}; allowed: 0 to {starts - 1}.")
    return start


def _of_sample(study: Study, number: int) -> Study:
    """The study with the values of one sample of its uncertain numbers."""
    sample = {key: float(values[number]) for key, values in study.drawn.items()}
    here = values_at(study.parameters, study.initial, {**vars(study.operation), **sample})
    operation = Operation(*here.operation)
    return replace(study, parameters=here.parameters, initial=here.initial, operation=operation, drawn={}, unknowns=())


def _sample(where: str | os.PathLike[str], sample: float | None, samples: int) -> int:
    """The number of the sample, 0 where no number is uncertain; InputError where
    ``sample`` is not a number of one of the ``samples``."""
    if sample is None:
        if samples:
            raise InputError(
                f"{where}: every operating point has {samples} samples of uncertain numbers. Say "
                f"which one with --at "
                f"{SAMPLE}=..., 0 to {samples - 1}."
            )
        return 0
    if not samples:
        raise InputError(f"{where}: --at {SAMPLE}: found {sample:g}; allowed: nothing, as no number is uncertain.")
    if sample != int(sample) or not 0 <= sample < samples:
        raise InputError(f"{where}: --at {SAMPLE}: found {sample:g}; allowed: 0 to {samples - 1}.")
    return int(sample)


def _not_run(status: Array, plan: Plan, number: int, units: Mapping[str, str]) -> str:
    """The message for an inferred point, with the nearest point of the same procedure
    that was run; distances are in steps of the axes."""
    here = np.array(np.unravel_index(number, plan.shape))
    if plan.samples:
        status, here = status[..., here[-1]], here[:-1]
    ran = np.argwhere(status[here[0]] != INFERRED)
    nearest = ran[np.argmin(np.sum((ran - here[1:]) ** 2, axis=1))]
    where = " ".join(
        option_of(
            name,
            str(word_or_number(name, values[i]))
            if words_of(name)
            else readable(values[i], units[name]).replace(" ", ""),
        )
        for (name, values), i in zip(plan.axes.items(), nearest, strict=True)
        if len(values) > 1
    )
    return (
        "that point was not run: all points around it have one response, so the refinement passed "
        "it over. The nearest "
        f"point that was run: {where}. Or simulate this one: nsdrill simulate."
    )


def units_of(study: Study) -> dict[str, str]:
    """The SI units of each axis of a study, by its key."""
    return {"depth": "m", "wob": "N", "rotary_speed": "rad/s", **{axis.key: axis.units for axis in study.more}}


def select_states(study: Study, names: Array, state: Array) -> Array:
    """The states that the string of ``study``, that of one point, has, from ``state``
    with the states ``names`` of a file."""
    needed = study.model.states(study.parameters)
    return np.asarray(state, dtype=float)[[names.tolist().index(name) for name in needed]]


def option_of(key: str, value: str = "") -> str:
    """The command-line option for a value of the axis ``key``."""
    return f"--{key.replace('_', '-')} {value}".rstrip() if key in OPERATION else f"--at {key}={value or '...'}"


def _seconds(value: float) -> str:
    """A time in the unit of the request, else in seconds."""
    return readable(value, "s") if isinstance(value, WithUnit) else f"{value:g} s"


def _on_axis(path: str | os.PathLike[str], name: str, value: float, values: np.ndarray, units: str) -> float:
    """``value``; InputError where it is farther beyond the ends of ``values`` than half
    a step, or than one percent of a single value, or where it is a word that they
    lack."""
    if words_of(name):
        if value not in values:
            listed = ", ".join(str(word_or_number(name, one)) for one in values)
            raise InputError(
                f"{path}: {option_of(name)}: found {word_or_number(name, value)}; allowed: {listed}, as the sweep."
            )
        return float(value)
    steps = np.diff(values)
    below, above = (steps[0] / 2, steps[-1] / 2) if len(steps) else 2 * (0.01 * abs(values[0]),)
    if values[0] - below <= value <= values[-1] + above:
        return float(value)
    ends = [WithUnit(end, value.unit) if isinstance(value, WithUnit) else end for end in (values[0], values[-1])]
    first, last = (readable(end, units) for end in ends)
    allowed = f"from {first} to {last}, as the sweep" if len(steps) else f"{first}, the only value"
    raise InputError(f"{path}: {option_of(name)}: found {readable(value, units)}; allowed: {allowed}.")


def _trace(
    study: Study,
    schedule: Schedule,
    simulation: Simulation,
    initial: np.ndarray,
    sample: float,
    command: str,
    extra: dict[str, Any],
    implicit: bool | None = None,
) -> Trajectory:
    """The run with its trace. ``implicit`` is the method; None: that of the study."""
    total = simulation.transient + simulation.observe
    if not 0 < sample <= total:
        allowed = f"at most the {total:g} s of the run" if sample > 0 else "more than 0 s"
        raise Refusal("sample", _seconds(sample), allowed)
    sample = float(sample)
    samples = int(np.floor(total / sample * (1 + 1e-12))) + 1
    if samples > MAX_SAMPLES:
        raise Refusal(
            "sample",
            f"{samples} samples of {total:g} s",
            f"at most {MAX_SAMPLES} of them",
            "Sample more coarsely, or shorten the run.",
        )
    if implicit is None:
        implicit = _implicit(study, schedule)
    method = METHODS[1] if implicit else METHODS[0]
    simulation = replace(simulation, method=method)
    study = replace(study, simulation=replace(study.simulation, method=method))
    run = (
        run_schedule(study, schedule, total, initial, samples, sample)
        if schedule.ramps
        else run_at(study, schedule.operation, simulation, initial, samples, sample)
    )
    states, status, accepted, rejected, final = run
    time = np.arange(len(states)) * sample
    if schedule.ramps:
        knots = {name: [ramp.times, ramp.values] for name, ramp in schedule.ramps.items()}
        extra = {**extra, "ramps": json_text(knots)}
    start = schedule.start
    attrs = {
        **provenance(study, command),
        "depth": start.depth,
        "wob": start.wob,
        "rotary_speed": start.rotary_speed,
        "transient": simulation.transient,
        "observe": simulation.observe,
        "rtol": simulation.rtol,
        "method": method,
        "status": (BY_NAME["status"].flag_meanings or "").split()[status],
        "steps": accepted,
        "rejected": rejected,
        "initial_state": initial,
        "final_state": final,
        **extra,
    }
    remedy = advice(method, study.model, _points_of(study, schedule)) if status == STEP_LIMIT else ""
    return Trajectory(
        Trace(time, sampled_variables(study, schedule, initial, time, states), attrs), status, advice=remedy
    )


def sampled_variables(study: Study, schedule: Schedule, initial: Array, time: Array, states: Array) -> dict[str, Array]:
    """The variables of a trace from the ``states`` [samples, states] at ``time``
    [s] of a run from ``initial``."""
    model = study.model.dynamics
    names = model.states(model.variant(study.parameters))
    state = {name: states[:, i].copy() for i, name in enumerate(names)}
    state["drive_angle"] = initial[-1] + schedule.drive_angle(time)
    history = schedule.at(time)
    scheduled = {SCHEDULED[name]: values for name, values in vars(history).items() if SCHEDULED[name] not in state}
    point = history if schedule.ramps else schedule.start
    known = {variable.name for variable in study.model.trace}
    shown = {name: values for name, values in state.items() if name in known}
    return {**shown, **model.outputs(study.parameters, point, state), **scheduled}


def _implicit(study: Study, schedule: Schedule) -> bool:
    """Whether a run is integrated implicitly: by the method of the study, or with the
    method auto where friction is steep at a knot of its ramps."""
    prepare(study).check_method()
    return bool(implicit_points(study.simulation.method, study.model, _points_of(study, schedule)).any())


def _points_of(study: Study, schedule: Schedule) -> Values:
    """The values of a run at the knots of its ramps."""
    times = np.unique([0.0, *(time for ramp in schedule.ramps.values() for time in ramp.times)])
    point = schedule.at(times)
    return Values(study.parameters, study.initial, (point.depth, point.wob, point.rotary_speed))


def _points(study: Study, operation: Operation) -> Values:
    return Values(study.parameters, study.initial, (operation.depth, operation.wob, operation.rotary_speed))


def run_at(
    study: Study,
    operation: Operation,
    simulation: Simulation,
    initial: np.ndarray,
    samples: int,
    interval: float,
    begin: float = 0.0,
) -> tuple[np.ndarray, int, int, int, np.ndarray]:
    """As :func:`nsdrill.app.ramped.run_schedule`, at one operating point and with the
    marks of ``simulation``. Samples begin at ``begin`` [s], which does not affect the
    run."""
    model = study.model.dynamics
    fixed = model.variant(study.parameters)
    if simulation.method == "implicit":
        fixed = model.implicit(fixed)
    # in the layout of sweeps, so that their compiled step is used
    points, rows, lanes = (_points(study, operation), model.rows(fixed, model.observed), choose_lanes(1))
    store = trace_store(samples, interval, len(model.states(fixed)))
    parts = Compiled(model.right_hand_side(lanes, fixed), *make_tracer(lanes, rows))
    stages = [(model.pack(points, study.thresholds), simulation)]
    total, switch = simulation.transient + simulation.observe, model.switches(study.parameters)
    if switch is not None and switch > 0.0:
        stages.insert(0, (model.pack_before(points, study.thresholds), _lasting(simulation, min(switch, total))))
        stages[1:] = [(stages[1][0], _lasting(simulation, total - switch))] if switch < total else []
    state, accepted, rejected = initial, 0, 0
    for number, (table, stage) in enumerate(stages):
        store[BEGAN] = (0.0 if number == 0 or switch is None else switch) - begin
        batch = Batch(lanes, 1, rows, store, 0, replace(stage, max_steps=max(1, stage.max_steps - accepted - rejected)))
        batch.add(np.array([0]), model.runs(table, fixed, state[np.newaxis]))
        done = batch.run_alone(parts)
        state, status = done.final[0], int(done.status[0])
        accepted, rejected = accepted + int(done.accepted[0]), rejected + int(done.rejected[0])
        if status != OK:
            break
    return samples_of(store, len(model.states(fixed))), status, accepted, rejected, state


def _lasting(simulation: Simulation, duration: float) -> Simulation:
    """One observation of this ``duration`` [s], without a transient."""
    return replace(simulation, transient=0.0, observe=duration)


__all__ = ["DEFAULT_SAMPLE", "OK", "Trajectory", "replay", "simulate"]
