"""One run with its trajectory: simulate an operating point, or replay a point of a
sweep."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from operator import attrgetter

import numpy as np

from nsdrill.analysis.coarse import coarse_samples
from nsdrill.analysis.counts import after_failure, driving_in_trace, driving_words
from nsdrill.app.check import of_scales, shortest_period_of, without_control
from nsdrill.app.conversion import refuse_lacking
from nsdrill.app.experiment import Experiment, has_other_code, prepare, provenance, stored_experiment, unlike
from nsdrill.app.simulating.integration import points_of, run_at, run_schedule, schedule_of, select_states
from nsdrill.data import (
    IN_MEMORY,
    NOT_CARRIED_RUN,
    SHORTEST_PERIOD,
    Array,
    Attributes,
    Results,
    Trace,
    edited_together,
    json_text,
)
from nsdrill.errors import InputError, Refusal, RunWarning, option, printable, warn
from nsdrill.kernel.settings import LONGEST, Simulation
from nsdrill.models.choices import word_in, word_or_number, words_of
from nsdrill.models.friction import METHODS, advice
from nsdrill.models.friction import implicit as implicit_points
from nsdrill.models.operation import Operation, Schedule, Values
from nsdrill.models.parts import chosen_at, values_at
from nsdrill.models.registry import BY_NAME, drawn_in, model_named
from nsdrill.models.variant import variant_at
from nsdrill.records import dataclass
from nsdrill.store import read_point, read_results
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.units import WithUnit, readable
from nsdrill.variables import AXES, INFERRED, OK, PENDING, SAMPLE, STEP_LIMIT, end_of_run

DEFAULT_SAMPLE = 0.01  # s: more than ten samples in the fastest motion, the collar on the wall
MAX_SAMPLES = 50_000_000
_STORED = ("status", "initial_state", "final_state")


@dataclass(frozen=True)
class Trajectory:
    """A trace and the status of its run, with the codes of a results file. ``advice``
    is the remedy where the run reached its limit of steps.

    Of a replay, ``same_bits`` says whether the final state has the stored bits,
    ``differing`` which versions differ from those that made the results, in words, and
    ``other_code`` whether the model's code does;
    ``apart`` says how far the final state is from the stored one, and ``after_failure``
    whether nothing was carried to the run, as one before it in its chain failed."""

    trace: Trace
    status: int
    same_bits: bool | None = None
    differing: tuple[str, ...] = ()
    other_code: bool = False
    advice: str = ""
    apart: str = ""
    after_failure: bool = False

    @property
    def warning(self) -> str:
        """What to say of a replay that has other bits."""
        cause = "; ".join(self.differing) or "nothing that the file records, so this is a fault: please report it"
        told = f"does not end in the stored final state{self.apart}. What differs: {cause}."
        if self.other_code:
            return f"{told} The equations may be others, and the trajectory that of another model."
        return f"{told} Where the motion is chaotic, the trajectory is then another one of the same kind."


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
    followed: str = "",
) -> Trajectory:
    """Simulate one operating point of a study, or its ramps.

    ``depth`` [m], ``wob`` [N] and ``rotary_speed`` [rad/s] are by default those of its
    ``operation``; an argument replaces a ramp of the study. ``start`` is the number of
    the start where the study has several; ``state`` [states + 1], the drive angle last,
    replaces the start. The run takes ``duration`` [s], by default the transient and the
    observation, or until the last knot of the ramps, and is sampled every ``sample``
    [s]; the attribute ``held_from`` of a longer one is the time from which the last
    values of the ramps are held. What was read of a log that the ramps follow is its
    attribute ``followed``. Uncertain numbers have the values in their own
    sections of the study, or with ``at_sample`` those of the sample with this number.
    InputError for values outside the model."""
    if at_sample is not None:
        at_sample = _sample("the study", at_sample, study.samples)
        study = _of_sample(study, at_sample)
    if any(map(words_of, study.swept)):  # keys that the chosen words do not read take defaults
        parameters, start_of_all, _ = chosen_at(study.parameters, study.initial, {})
        study = replace(study, parameters=parameters, initial=start_of_all)
    schedule = _schedule(study, {"depth": depth, "wob": wob, "rotary_speed": rotary_speed})
    operation = schedule.start
    simulation = study.simulation
    if duration is None and schedule.ramps:
        duration = schedule.end
    if duration is not None:
        if not 0 < duration <= LONGEST:
            allowed = f"more than 0 s and at most {LONGEST:g} s"
            raise Refusal("duration", seconds_text(duration), allowed)
        # Steps end at the marks of the run: without a transient there is one
        # observation.
        simulation = replace(simulation, transient=0.0, observe=float(duration))
    if told := without_control(study, simulation.transient + simulation.observe):
        warn(told, RunWarning)
    for told in of_scales(study, [points_of(study, operation)]):
        warn(told, RunWarning)
    number = _start("the study", start, study.initial.starts)
    initial = model_named(study.model.name).starts(points_of(study, operation), number)[0]
    if state is not None:
        initial = state
    extra: Attributes = {"start": number} if study.initial.starts else {}
    extra |= {} if at_sample is None else {SAMPLE: int(at_sample)}
    at: dict[str, object] = {key: value for key, value in vars(operation).items() if key not in AXES}
    at |= {key: word_in(study.parameters, study.initial, key) for key in study.swept if words_of(key)}
    if at:
        extra["at"] = json_text(at)
    if schedule.ramps and simulation.transient + simulation.observe > schedule.end * (1.0 + 1e-9):
        extra["held_from"] = schedule.end
    if followed:
        extra["followed"] = followed
    return _trace(study, schedule, simulation, initial, sample, "simulate", extra)


def check_operated(study: Study, values: Mapping[str, float | None]) -> None:
    """Refusal of values that the operating point of the study does not have."""
    for name in (name for name, value in values.items() if value is not None):
        if name not in study.operation.names():
            refuse_lacking(name, study.model)


def _schedule(study: Study, values: Mapping[str, float | None]) -> Schedule:
    """The schedule of a run at these ``values``; InputError where it begins outside the
    model."""
    check_operated(study, values)
    try:
        schedule = schedule_of(study, {name: None if value is None else float(value) for name, value in values.items()})
        orders = [one for one in study.model.orders if one.upper == "operation.depth"]
        for one in orders:
            found, depth = float(schedule.start.depth), values["depth"]
            if found <= (least := attrgetter(one.lower)(study.parameters)):
                texts = [f"{length:g} m" for length in (found, least)]
                if isinstance(depth, WithUnit):
                    texts = [readable(depth, "m"), readable(WithUnit(least, depth.unit), "m")]
                raise ValueError(f"depth: found {texts[0]}, allowed: more than {one.words}, {texts[1]}")
    except ValueError as error:
        raise InputError(f"The operating point is outside the model. {error}.") from error
    return schedule


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
    found = point_in(source, depth=depth, wob=wob, rotary_speed=rotary_speed, at=at, procedure=procedure, start=start)
    extra: Attributes = {"procedure": found.procedure, "replay_of": printable(str(found.path))}
    if further := {key: word_or_number(key, value) for key, value in found.values.items() if key not in AXES}:
        extra["at"] = json_text(further)
    if found.starts:
        extra["start"] = found.start
    if found.samples:
        extra[SAMPLE] = found.sample
    if found.after_failure:
        extra[NOT_CARRIED_RUN] = 1
    extra |= edited_together(found.attrs)
    initial = np.asarray(found.stored["initial_state"], dtype=float)
    schedule = Schedule(found.operation, {})
    result = _trace(found.study, schedule, found.study.simulation, initial, sample, "replay", extra, found.implicit)
    compared = _compared(result, found.study, found.stored, found.attrs)
    return replace(compared, after_failure=found.after_failure)


@dataclass(frozen=True)
class StoredPoint:
    """A point of results: its ``study``, with the ``operation`` and the ``values`` of the
    axes there by key, and the ``stored`` status and states. ``path`` names the results,
    which have these root ``attrs`` and so many ``starts`` and ``samples``, 0 for one;
    ``implicit`` says by which method the point was run, ``after_failure`` whether it came
    after a failed run in its chain."""

    path: str | os.PathLike[str]
    study: Study
    operation: Operation
    values: Mapping[str, float]
    procedure: str
    start: int
    sample: int
    starts: int
    samples: int
    stored: dict[str, Array]
    implicit: bool
    after_failure: bool
    attrs: Attributes


def point_in(
    source: Results | str | os.PathLike[str],
    *,
    depth: float | None = None,
    wob: float | None = None,
    rotary_speed: float | None = None,
    at: Mapping[str, float] | None = None,
    procedure: str | None = None,
    start: int | None = None,
) -> StoredPoint:
    """The point of ``source`` nearest to these values, chosen as by :func:`replay`;
    InputError for values beyond the sweep, and for a point that was not run."""
    outline = source if isinstance(source, Results) else read_results(source, ("status",))
    path = IN_MEMORY if isinstance(source, Results) else source
    experiment = stored_experiment(path, outline)
    study, plan = experiment.study, experiment.plan
    operation = {"depth": depth, "wob": wob, "rotary_speed": rotary_speed}
    check_operated(study, operation)
    requested = {**(at or {}), **{name: value for name, value in operation.items() if value is not None}}
    sample_number = _sample(path, requested.pop(SAMPLE, None), plan.samples)
    wanted = _on_axes(path, experiment, requested)
    if procedure is None and len(plan.procedures) > 1:
        raise InputError(
            f"{path}: the sweep went {' and '.join(plan.procedures)}. Say which one with {option('procedure')}."
        )
    procedure = procedure or plan.procedures[0]
    start_number = _start(path, start, plan.starts)
    try:
        number, values_there = plan.find(wanted, procedure, start_number, sample_number)
    except ValueError as error:
        raise InputError(f"{path}: {error}.") from error
    point = _stored_point(source, experiment, number)
    here = values_at(study.parameters, study.initial, values_there)
    axes = {key: np.array([value]) for key, value in values_there.items()}
    study = replace(study, parameters=here.parameters, initial=here.initial, axes=axes, drawn={})
    return StoredPoint(
        path,
        study,
        here.point,
        values_there,
        procedure,
        start_number,
        sample_number,
        plan.starts,
        plan.samples,
        point | {name: select_states(study, outline.coords["state"], point[name]) for name in _STORED[1:]},
        bool(experiment.chosen.points(np.array([number]))[0]),
        "status" in outline and bool(after_failure(outline)[np.unravel_index(number, plan.grid)]),
        outline.attrs,
    )


def _compared(result: Trajectory, study: Study, point: dict[str, Array], attrs: Attributes) -> Trajectory:
    """The replay ``result``, compared with the stored ``point`` of a file with the root
    attributes ``attrs``."""
    final = np.asarray(point["final_state"])
    same = result.status == end_of_run(int(point["status"])) and bool(
        np.array_equal(result.trace.attrs["final_state"], final, equal_nan=True)
    )
    states = variant_at(model_named(study.model.name), study.parameters).states
    return replace(
        result,
        same_bits=same,
        differing=tuple(unlike(attrs, "numpy_version", "processor")),
        other_code=has_other_code(attrs),
        apart="" if same else _apart(result.trace, states, final),
    )


def _stored_point(source: Results | str | os.PathLike[str], experiment: Experiment, number: int) -> dict[str, Array]:
    """The status and the states of a point of the sweep; InputError where it was not
    run."""
    plan = experiment.plan
    place = tuple(int(i) for i in np.unravel_index(number, plan.grid))
    if isinstance(source, Results):
        path, names = IN_MEMORY, (*_STORED, *({"settled"} & {*source.variables}))
        point = {name: source[name][place] for name in names}
    else:
        path, point = os.fspath(source), read_point(source, *place)
    if point["status"] == PENDING:
        raise InputError(f"{path}: that point has not been run. Finish the sweep with nsdrill run {option('resume')}.")
    if point["status"] == INFERRED:
        status = (source if isinstance(source, Results) else read_results(source, ["status"]))["status"]
        raise InputError(f"{path}: {_not_run(status, plan, number, units_of(experiment.study))}")
    return point


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
    """The number of the start, 0 where there is one start."""
    return _member(where, start, starts, "start", "starts", "every operating point has one start")


def _sample(where: str | os.PathLike[str], sample: float | None, samples: int) -> int:
    """The number of the sample, 0 where no number is uncertain."""
    return _member(where, sample, samples, SAMPLE, "samples of uncertain numbers", "no number is uncertain")


def _member(
    where: str | os.PathLike[str], number: float | None, count: int, name: str, several: str, single: str
) -> int:
    """``number``, 0 where there are not ``several``; InputError where it is not the number
    of one of ``count``."""
    if number is None and count:
        which = option("at", f"{SAMPLE}=...") if name == SAMPLE else option(name)
        raise InputError(
            f"{where}: every operating point has {count} {several}. Say which one with {which}, 0 to {count - 1}."
        )
    if number is None:
        return 0
    if number not in range(count):
        allowed = f"0 to {count - 1}" if count else f"nothing, as {single}"
        which = f"{option('at')} {SAMPLE}" if name == SAMPLE else option(name)
        raise InputError(f"{where}: {which}: found {number:g}; allowed: {allowed}.")
    return int(number)


def _of_sample(study: Study, number: int) -> Study:
    """The study with the values of one sample of its uncertain numbers."""
    sample = {key: float(values[number]) for key, values in study.drawn.items()}
    here = values_at(study.parameters, study.initial, {**vars(study.operation), **sample})
    operation = here.point
    return replace(study, parameters=here.parameters, initial=here.initial, operation=operation, drawn={}, unknowns=())


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
        "that point was not run: all points around it have one response, so the refinement passed it over. The nearest "
        f"point that was run: {where}. Or simulate this one: nsdrill simulate."
    )


def units_of(study: Study) -> dict[str, str]:
    """The SI units of each axis of a study, by its key."""
    return {name: study.keys.axes[name].units for name in study.model.axes} | {one.key: one.units for one in study.more}


def option_of(key: str, value: str = "") -> str:
    """The argument for a value of the axis ``key``."""
    return option(key, value or None) if key in AXES else option("at", f"{key}={value or '...'}")


def seconds_text(value: float) -> str:
    """A time in the unit of the request, else in seconds."""
    return readable(value, "s") if isinstance(value, WithUnit) else f"{value:g} s"


def _on_axes(path: str | os.PathLike[str], experiment: Experiment, requested: Mapping[str, float]) -> dict[str, float]:
    """The ``requested`` values of the axes by key, with those of axes that have a single
    value; InputError for others than the axes, or beyond their ends."""
    plan, units = experiment.plan, units_of(experiment.study)
    if unknown := [key for key in requested if key not in plan.axes or key in plan.drawn]:
        allowed = ", ".join(key for key in plan.axes if key not in plan.drawn)
        samples = f", and {SAMPLE}, as its uncertain numbers go together" if plan.samples else ""
        raise InputError(f"{path}: {option('at')}: found {', '.join(unknown)}; allowed: the axes {allowed}{samples}.")
    if missing := [name for name, values in plan.axes.items() if name not in requested and len(values) > 1]:
        name = missing[0]
        raise InputError(
            f"{path}: the sweep has {len(plan.axes[name])} values of {name}. Say which one with {option_of(name)}."
        )
    return {
        name: _on_axis(path, name, requested.get(name, float(values[0])), values, units[name])
        for name, values in plan.axes.items()
    }


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
    extra: Attributes,
    implicit: bool | None = None,
) -> Trajectory:
    """The run with its trace. ``implicit`` is the method; None: that of the study."""
    total = simulation.transient + simulation.observe
    samples, sample = _samples(total, sample), float(sample)
    if implicit is None:
        implicit = is_implicit(study, schedule)
    method = METHODS[1] if implicit else METHODS[0]
    simulation = replace(simulation, method=method)
    study = replace(study, simulation=replace(study.simulation, method=method))
    if schedule.ramps:
        run = run_schedule(study, schedule, total, initial, samples, sample)
    else:
        run = run_at(study, schedule.operation, simulation, initial, samples, sample)
    if schedule.ramps:
        knots = {name: ramp.knots for name, ramp in schedule.ramps.items()}
        extra = {**extra, "ramps": json_text(knots)}
    start = schedule.start
    attrs = {
        **provenance(study, command),
        **{name: getattr(start, name) for name in study.model.axes},
        "transient": simulation.transient,
        "observe": simulation.observe,
        "rtol": simulation.rtol,
        "method": method,
        "status": BY_NAME["status"].words(run.status),
        "steps": run.accepted,
        "rejected": run.rejected,
        "initial_state": initial,
        "final_state": run.final,
        **extra,
    }
    sideways = np.ptp(run.variables.get(drawn_in(attrs).radius, np.zeros(1))) > 0.0
    if period := shortest_period_of(study, points_of(study, start), sideways=bool(sideways)):
        attrs[SHORTEST_PERIOD] = period
    if told := coarse_samples(attrs, run.time):
        warn(f"{told}.", RunWarning)
    if driven := driving_in_trace(attrs, run.variables):
        warn(f"FRICTION DRIVES: {driving_words(driven)}.", RunWarning)
    remedy = advice(method, study.model, _knots(study, schedule)) if run.status == STEP_LIMIT else ""
    return Trajectory(Trace(run.time, run.variables, attrs), run.status, advice=remedy)


def _samples(total: float, sample: float) -> int:
    """The number of samples of a run of ``total`` [s]; a Refusal where there is none, or
    where there are too many."""
    if not 0 < sample <= total:
        allowed = f"at most the {total:g} s of the run" if sample > 0 else "more than 0 s"
        raise Refusal("sample", seconds_text(sample), allowed)
    samples = int(np.floor(total / float(sample) * (1 + 1e-12))) + 1
    if samples > MAX_SAMPLES:
        found, hint = f"{samples} samples of {total:g} s", "Sample more coarsely, or shorten the run."
        raise Refusal("sample", found, f"at most {MAX_SAMPLES} of them", hint)
    return samples


def is_implicit(study: Study, schedule: Schedule) -> bool:
    """Whether a run is integrated implicitly: by the method of the study, or with the
    method auto where friction is steep at a knot of its ramps."""
    prepare(study).check_method()
    return bool(implicit_points(study.simulation.method, study.model, _knots(study, schedule)).any())


def _knots(study: Study, schedule: Schedule) -> Values:
    """The values of a run at the knots of its ramps."""
    return points_of(study, schedule.at(schedule.knots()))


__all__ = ["DEFAULT_SAMPLE", "OK", "StoredPoint", "Trajectory", "point_in", "replay", "seconds_text", "simulate"]
