"""Check a study without running it: its coefficients, the quantities derived from them,
warnings, and the disk space, memory and time of its sweep."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, fields, replace
from functools import partial
from itertools import product
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nsdrill.analysis.clocked import CLOCKED, clocked_words
from nsdrill.analysis.counts import ERRORS_ALONE, TOLERANCES, guessed_words
from nsdrill.app.experiment import Experiment, coarse_points, maker_of, prepare
from nsdrill.app.usual import far_from_usual
from nsdrill.data import Answer, Array, Results
from nsdrill.errors import InputError, count, option
from nsdrill.files import amount as bytes_text
from nsdrill.kernel.settings import Simulation
from nsdrill.late import deferred
from nsdrill.models import cutting, dry, friction
from nsdrill.models.choices import words_of
from nsdrill.models.damped import Damping, damped, dampings, unusual_damping
from nsdrill.models.model_description import Description
from nsdrill.models.numbers import (
    BENDS,
    LATE,
    LOOSE,
    NOT_EXACT,
    PULSE,
    TOO_SHORT,
    UNUSUAL,
    begins_late,
    few_peaks,
    few_periods,
)
from nsdrill.models.operation import Ramp, Values
from nsdrill.models.own_drives import own_drive
from nsdrill.models.parts import chosen_at, values_at
from nsdrill.models.registry import checks_of, import_modules, model_named, own_features, scripted, sources_of
from nsdrill.quantity import amount, unit_in
from nsdrill.ranges import bound_text
from nsdrill.records import dataclass
from nsdrill.store import record_dtype
from nsdrill.study.study import Study
from nsdrill.variables import dimension_of

with deferred():  # it imports the compiler
    from nsdrill.app.running import stages
    from nsdrill.models import variant
    from nsdrill.script import function_model

if TYPE_CHECKING:
    from nsdrill.app.running.price import Price


BASE = 3e8  # bytes that every run takes: the interpreter, the libraries, the batches
MANY = 10**6  # runs, above which they have to be asked for
PACE = 1e5  # s of motion of the main model in a second of one processor: docs/benchmarks.md
TRIALS = 8  # at most, with numbers of a study
PER_POINT = 40  # bytes for each point: axes, order and status; measured on sweeps of 10^8 points
SLOTS = 256  # points whose records a batch holds at least


def disk(experiment: Experiment) -> int:
    """The bytes of all points, at most; the results file takes up to as many again
    while it is written."""
    return experiment.plan.points * record_dtype(experiment.contents).itemsize


def memory(experiment: Experiment) -> float:
    """The approximate bytes of memory of a run into a file: of all points, and of the
    records of those that a batch holds."""
    plan = experiment.plan
    held = min(plan.points, SLOTS) * record_dtype(experiment.contents).itemsize
    return BASE + PER_POINT * plan.points + held


def check_memory(experiment: Experiment, *, in_file: bool) -> None:
    """InputError where this machine has too little memory free for the run."""
    if text := _over_memory(experiment, in_file):
        advice = "" if in_file else "Give the name of a results file, into which the points go, or sweep"
        raise InputError(f"{text} {advice or 'Sweep'} fewer points at once.")


def _over_memory(experiment: Experiment, in_file: bool) -> str:
    """The points, the memory they take and what is free, where that is too little; else
    empty."""
    need, free = memory(experiment) + (0 if in_file else disk(experiment)), memory_free()
    if need <= free or need <= 2 * BASE:  # a small sweep is worth a try anywhere
        return ""
    return (
        f"found a sweep of {bound_text(experiment.plan.points)} points, which takes {bytes_text(need)} of memory; "
        f"allowed: up to {bytes_text(free)}, which are free on this machine."
    )


def check_large(what: str, runs: int, seconds: float, size: str, workers: int, *, large: bool) -> None:
    """InputError, with what they cost, where so many ``runs`` of ``seconds`` of motion
    were not asked for by ``large``; ``what`` and ``size`` say in words what they are
    and how much room they take."""
    if runs <= MANY or large:
        return
    hours = runs * seconds / (PACE * workers * 3600)
    raise InputError(
        f"found {what}: {bound_text(runs)} runs of {seconds:g} s, which take roughly {hours:.2g} hours on "
        f"{count(workers, 'processor')}, {size}; allowed: up to {bound_text(MANY)} runs, or more "
        f"where they are meant: {option('large')}."
    )


def memory_free() -> float:
    """The bytes of memory that are available to a process; infinite where unknown."""
    free = math.inf
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                free = 1024.0 * int(line.split()[1])
        group = Path("/sys/fs/cgroup")  # of a container or a batch job
        limit = (group / "memory.max").read_text().strip()
        if limit != "max":
            free = min(free, int(limit) - int((group / "memory.current").read_text()))
    except (OSError, ValueError, IndexError):
        pass
    return free


LEAST_REVOLUTIONS = 20
SLACK = 1e-6  # of a revolution: 20 rpm for 60 s
LARGE = 2e9  # bytes of results, above which a warning says so


@dataclass(frozen=True)
class Report:
    """What :func:`check` finds of a study at its ``operation``.

    Attributes
    ----------
    coefficients
        In SI units, by name; None for a model without them.
    figures : dict
        Derived quantities by name, each with ``value``, ``units`` and ``meaning``.
    warnings : list of str
        In plain sentences.
    points, chains, coarse_points : int
        The size of the sweep. Where it is refined ``points`` counts the finest grid,
        ``coarse_points`` those that run in any case.
    disk, memory : int, float
        What a run takes [bytes]: at most, and about; 0 for a ramp without a sweep.
    method : tuple of str
        How friction is integrated: explicit, implicit, or both, each at some points.
    price : Price or None
        How long the sweep will take, where that was asked for: ``seconds``, most likely
        between ``low`` and ``high``. None on a GPU, where it is not known before.
    device : str
        On which device it would run and why, where that was asked for.
    scales : dict
        The natural scales of the states of a script's model, in SI units.
    measured : dict
        What scripts and packages measure of the model, and which of them.

    Examples
    --------
    >>> nsdrill.check("study.yaml").warnings[:0]
    []
    """

    operation: Any
    coefficients: Any
    figures: Answer
    warnings: list[str]
    points: int
    chains: int
    ramps: dict[str, Ramp]
    coarse_points: int
    disk: int
    memory: float
    method: tuple[str, ...] = ("explicit",)
    explained: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """The units and the meaning of each coefficient."""
    price: Price | None = None
    device: str = ""
    scales: Mapping[str, float] = field(default_factory=dict)
    """The natural scales of the states of the model of a script [SI]."""
    measured: Mapping[str, str] = field(default_factory=dict)
    """By which script or package a quantity is measured besides those of the model."""

    def as_json(self) -> Answer:
        """All of it as plain data, as ``nsdrill check --json`` prints it."""
        return {
            "operation": {
                item.name: {"value": getattr(self.operation, item.name), "units": item.metadata["units"]}
                for item in fields(self.operation)
            },
            "coefficients": {
                name: {"value": float(getattr(self.coefficients, name)), "units": units}
                for name, (units, _) in self.explained.items()
            },
            "figures": {
                name: {"value": figure.value, "units": figure.units, "meaning": figure.meaning}
                | ({"everywhere": True} if figure.everywhere else {})
                | ({} if figure.known else {"known": False})
                for name, figure in self.figures.items()
            },
            **(
                {
                    "ramps": {
                        name: {"time": list(ramp.times), "value": list(ramp.values)}
                        for name, ramp in self.ramps.items()
                    }
                }
                if self.ramps
                else {}
            ),
            **({"natural_scales": dict(self.scales)} if self.scales else {}),
            **({"measured": dict(self.measured)} if self.measured else {}),
            "points": self.points,
            "chains": self.chains,
            "coarse_points": self.coarse_points,
            "size": {"disk": {"value": self.disk, "units": "B"}, "memory": {"value": self.memory, "units": "B"}},
            "method": list(self.method),
            **({"device": self.device, "price": None} if self.device else {}),
            **({} if self.price is None else {"price": self.price.as_json()}),
            "warnings": self.warnings,
        }


def check(study: Study, units: str = "si") -> Report:
    """Coefficients and derived quantities at the operating point of ``study`` (of a
    ramp: at its start), and warnings over its whole sweep and its ramps, in the
    ``units`` "si" or "field". ``points`` and ``chains`` are 0 for a ramp without a
    sweep."""
    experiment = prepare(study)
    experiment.check_exponent()
    plan = experiment.plan
    operation = operation_of(study)
    parameters = study.parameters
    if any(map(words_of, study.swept)):  # keys that the chosen words do not read take defaults
        parameters, _, _ = chosen_at(parameters, study.initial, {})
    checks = checks_of(study.model)
    points, chains = (0, 0) if study.ramped and not study.swept else (plan.points, plan.carried_chains or plan.points)
    report = Report(
        operation,
        checks and checks.coefficients(parameters, operation),
        _figures(study, parameters, operation) if checks else {},
        warnings(study, units, experiment),
        points,
        chains,
        study.ramps,
        coarse_points(study, points),
        disk(experiment) if points else 0,
        memory(experiment) if points else 0.0,
        experiment.methods,
        checks.COEFFICIENTS if checks else {},
        scales=natural_scales(study.model),
        measured={one.name: maker_of(one.origin) for one in own_features(study.model.name)},
    )
    import_modules()  # what is wrong with packages is told, also of what this study does not use
    return report


def _figures(study: Study, parameters: Any, operation: Any) -> Answer:
    """The derived quantities at an operating point, with what smoothing of the friction does to them."""
    checks = checks_of(study.model)
    at = Values(parameters, study.initial, (operation.depth, operation.wob, operation.rotary_speed))
    found: Answer = dry.told(checks.every_derived_quantity(parameters, operation), checks, at)
    return found


def natural_scales(model: Description) -> Mapping[str, float]:
    """The natural scales of the states of the model of a script; none of another, where they
    follow from the operating point."""
    if scripted(model.name) is None:
        return {}
    scales: Mapping[str, float] = model_named(model.name).scale  # type: ignore[attr-defined]
    return scales


def operation_of(study: Study) -> Any:
    """The operating point of a study, at the least swept depth where its own depth does
    not exceed the length of the collars."""
    operation = study.operation
    if "depth" in study.swept:
        for one in study.model.orders:
            if one.upper == "operation.depth" and operation.depth <= attrgetter(one.lower)(study.parameters):
                operation = replace(operation, depth=float(study.axes["depth"][0]))
    return operation


def warnings(study: Study, units: str = "si", experiment: Experiment | None = None) -> list[str]:
    """The warnings over the whole sweep of a ``study`` and its ramps, in the ``units``
    "si" or "field"; ``experiment`` is that of the study, where it is there."""
    found: list[str | None] = [*study.notes, _far_from_usual(study)]
    if (checks := checks_of(study.model)) is not None:
        corners, text = _corners(study), partial(_amount_text, units)
        found += [damped(damping_of_torsion(study), text)]
        found += [*checks.warnings(study, corners, text), _begins_late(study, corners), _few_periods(study, corners)]
    found += [
        bent(study) or None,
        pulses(study) or None,
        _jumps(study),
        unread_numbers(study.model),
        _uncounted(study.model),
    ]
    found += [_clocked(study), *of_scales(study)]
    found += [inexact_exponent(study) or None]
    if study.swept or not study.ramped:  # else there is no observation
        experiment = experiment or prepare(study)
        found += [
            _short_observation(study, units),
            _loose(study),
            few_peaks(study.record.peaks),
            _verify_cost(study),
            _unread_pair(study, experiment),
            *_size_warnings(experiment),
        ]
    return [warning for warning in found if warning is not None]


def _far_from_usual(study: Study) -> str | None:
    """The warning of numbers that are far from usual."""
    found = far_from_usual(study)
    return f"{UNUSUAL} {found}" if found else None


def bent(study: Study) -> str:
    """The warning of a drive of a script that bends at steady drilling; empty where there is none."""
    drilling_at = getattr(checks_of(study.model), "drilling_at", None)
    drives = [at for at in _corners(study) if own_drive(getattr(getattr(at.parameters, "drive", None), "kind", ""))]
    if drilling_at is None:
        return ""
    for at in drives:
        frozen = getattr(getattr(at.parameters, "modes", None), "torsional", "free") == "frozen"
        if not frozen and drilling_at(at.parameters, at.point).bends:
            return (
                f"{BENDS} the equations of the drive {at.parameters.drive.kind} bend at steady drilling, so that no "
                "linear theory holds there. Whether steady drilling is stable, and below which speed it is not, is not "
                "known. Runs tell that begin beside it, as those of a sweep up and down (sweep.procedure: up-down)."
            )
    return ""


def pulses(study: Study) -> str:
    """The warning of pulses of a forcing that steps may jump over; empty where there are none."""
    duration = study.simulation.transient + study.simulation.observe
    model = model_named(study.model.name)
    found = [one for at in _corners(study) if (one := model.shortest_pulse(at, duration)) is not None]
    if not found:
        return _resting_pulses(study)
    width, every = min(found)
    return (
        f"{PULSE} what forces {study.model.name} changes for {width:.3g} s in each {every:.4g} s and rests between. "
        "Steps follow the motion, not the time, and may jump over it without a word. Compare with a longer pulse of "
        "the same area, or run each part between pulses by itself."
    )


def of_scales(study: Study, points: Sequence[Values] = ()) -> list[str]:
    """The warnings of natural scales of a script's model, with which errors of steps are
    measured: that they are guesses, and that the motion of a trial with the numbers of the
    study, at these ``points`` or the ends of what varies, is small beside them."""
    model = model_named(study.model.name)
    if not isinstance(model, function_model.FunctionModel):
        return []
    found = [f"Guess: {guessed_words(model.guessed)}."] if model.guessed else []
    rtol = study.simulation.rtol
    moved = [
        max(
            (2.0 * greatest / (rtol * (model.scale[name] + greatest)) for name, greatest in model.reach(at).items()),
            default=0.0,
        )
        for at in points or _corners(study)[:TRIALS]
    ]
    if small := [one for one in moved if 0.0 < one < TOLERANCES]:
        found.append(
            f"Small: with the numbers of the study no state of {study.model.name} moves by {TOLERANCES:g} tolerances "
            f"of a step in a trial, but by {min(small):.2g}. {ERRORS_ALONE}."
        )
    return found


def inexact_exponent(study: Study) -> str:
    """The warning of an exponent that the steps may make wrong: of what the checks of a model
    tell, and of a script's model with contacts and with friction so steep that implicit steps
    pass its slope, which all others resolve. Empty where there is none."""
    if not study.record.exponent:
        return ""
    model, checks = model_named(study.model.name), checks_of(study.model)
    if (of_model := getattr(checks, "inexact_exponents", None)) is not None:
        return str(of_model(study, _corners(study)) or "")
    if not isinstance(model, function_model.FunctionModel) or not model.contacts:
        return ""
    method = study.simulation.method
    implicit = [at for at in _corners(study) if friction.implicit(method, study.model, at).any()]
    steepest = [(steep, name) for at in implicit for name, steep in model.steepest(at).items()]
    steep, name = max(steepest, default=(0.0, ""))
    enough = friction.tolerance_of_exponent(study.simulation.rtol, steep)
    if enough is None:
        return ""
    return (
        f"{NOT_EXACT} friction of {name} is so steep that an implicit step passes its slope where the slip changes its "
        "sign. lyapunov_exponent may then be about that without friction, and lyapunov_error does not hold that. "
        f"Set simulation.method: explicit, which sees that slope, or simulation.rtol: {enough:.0e}."
    )


def _resting_pulses(study: Study) -> str:
    """The same of an angle that rests at the start."""
    model = model_named(study.model.name)
    found = [one for at in _corners(study) if (one := model.resting_pulse(at)) is not None]
    if not found:
        return ""
    width, angle = min(found)
    return (
        f"{PULSE} what forces {study.model.name} changes within {width:.3g} rad of each turn of {angle}, which rests "
        "at the start, so that how long that takes is not looked at. Where it turns, steps follow the motion, and may "
        f"jump over it without a word. Give {angle} its speed at the start, or compare with a wider pulse of the same "
        "area."
    )


def unread_numbers(model: Description) -> str | None:
    """The warning of parameters of a model of a script that nothing reads."""
    if not (idle := model_named(model.name).idle):
        return None
    return (
        f"Unread: nothing that {model.name} computes reads {', '.join(idle)}: no value and no spread of "
        f"{'it' if len(idle) == 1 else 'these'} changes a result."
    )


def _unread_pair(study: Study, experiment: Experiment) -> str | None:
    """The warning of a pair that no point is integrated with."""
    pair = study.simulation.pair
    if pair == Simulation().pair or experiment.methods != ("implicit",):
        return None
    return (
        f"Unread: simulation.pair {pair} is that of points that are integrated explicitly, and there is none; with "
        "simulation.method explicit there is."
    )


def _uncounted(model: Description) -> str | None:
    """The warning of states of a model of a script that nothing reads, and that are no angles."""
    if not (names := model_named(model.name).uncounted):
        return None
    return (
        f"Not judged: nothing that {model.name} computes reads {', '.join(names)}, and no response is about "
        f"{'it' if len(names) == 1 else 'them'}: a motion counts as settled although "
        f"{'it changes' if len(names) == 1 else 'they change'}. Give an angle the unit rad, or declare a response."
    )


def _clocked(study: Study) -> str | None:
    """The warning of a model that reads the time as a value."""
    if not study.model.clocked:
        return None
    seconds = study.simulation.transient + study.simulation.observe
    found = {"seconds": seconds, "carried": study.procedure != "same"}
    return f"{CLOCKED.capitalize()}: {clocked_words(found)}."


def _loose(study: Study) -> str | None:
    """The warning of a tolerance with which errors of the steps decide responses."""
    if study.simulation.rtol <= LOOSE:
        return None
    return (
        f"Loose: simulation.rtol is {study.simulation.rtol:g}, and above {LOOSE:g} errors of the steps decide "
        f"responses and amplitudes, also of runs that have settled. The default is {Simulation.rtol:g}."
    )


def _jumps(study: Study) -> str | None:
    """The warning of equations of another package that jump where the motion stays."""
    if not sources_of(study.model.name):
        return None
    corner = _corners(study)[0]
    jumping = variant.variant_at(model_named(study.model.name), corner.parameters).jumps(corner)
    if not jumping:
        return None
    return (
        f"Jump: the slope of {' and of '.join(jumping)} jumps where that passes zero, back towards it from either "
        "side, as with a hard sign. The motion stays there in ever shorter steps, and a run ends at "
        f"simulation.max_steps ({study.simulation.max_steps:,}). Smooth it: direction(k * velocity) of "
        "nsdrill.equations.library."
    )


def study_of_part(study: Study, results: Results, *, whole: str | None = None) -> Study:
    """The ``study`` with the values of its axes that these results hold, which may be a part
    of its sweep; all of them along the axis ``whole``."""
    axes = {
        key: np.asarray(results.coords[name], dtype=float)
        for key in study.axes
        if (name := dimension_of(key)) in results.certain_axes and name != whole
    }
    return replace(study, axes={**study.axes, **axes})


def lasting_motions(study: Study) -> list[Answer]:
    """The critical speeds above which a motion may last that begins there, as the checks
    of its model tell them, in SI units; empty for a model whose checks have none."""
    checks = checks_of(study.model)
    speeds: list[Answer] = getattr(checks, "lasting_motions", lambda study, corners: [])(study, _corners(study))
    return speeds


def tells_what_lasts(study: Study) -> bool:
    """Whether the model of a study tells which motions may last, all of them."""
    checks = checks_of(study.model)
    tells: bool = getattr(checks, "tells_what_lasts", lambda study: True)(study)
    return tells and hasattr(checks, "lasting_motions")


def damping_of_torsion(study: Study) -> Damping | None:
    """The damping of torsion of a ``study``, where it is unusual of a string."""
    checks = checks_of(study.model)
    return None if checks is None else unusual_damping(study, _corners(study), checks.coefficients)


def dampings_of_torsion(study: Study) -> list[Damping]:
    """The damping of torsion at each corner of a ``study``, usual or not; none of a string without such a number."""
    checks = checks_of(study.model)
    return [] if not hasattr(checks, "coefficients") else dampings(study, _corners(study), checks.coefficients)


def deciding_numbers(study: Study) -> dict[str, list[str]]:
    """The keys of the numbers that no sheet has and that act on each response of a ``study``; none of a model that
    does not tell them."""
    deciding: Any = getattr(checks_of(study.model), "deciding", None)
    return {} if deciding is None else deciding(study)


def string_by_depth(study: Study) -> list[dict[str, float]]:
    """What turns the string off bottom, by the equations of its model: the torque at the
    surface less that of the rock, per speed of the string (``drag`` [N m s/rad]); and the ``period`` of its
    first torsional mode below a held top [s]; at every ``depth`` [m]; empty where the model does not
    tell it."""
    drilling_at: Any = getattr(checks_of(study.model), "drilling_at", None)
    if drilling_at is None:
        return []
    found = {}
    depths = study.axes.get("depth")
    studies = [study]
    if depths is not None:  # between its ends the period does not grow evenly
        studies = [replace(study, axes={**study.axes, "depth": np.array([depth])}) for depth in depths]
    for one in (corner for at_depth in studies for corner in _corners(at_depth)):
        drilling = drilling_at(one.parameters, one.point)
        if one.point.depth not in found and drilling.turns and drilling.speed > 0.0:
            drag = (drilling.torque - drilling.rock_torque) / drilling.speed
            found[float(one.point.depth)] = float(drag), float(drilling.period)
    return [{"depth": depth, "drag": drag, "period": period} for depth, (drag, period) in sorted(found.items())]


def lumped_string(study: Study) -> dict[str, list[str]]:
    """The warning of :func:`warnings` of a lumped string that is far from its first standing wave of
    torsion, in each system of units."""
    told: Any = getattr(checks_of(study.model), "lumped_string", None)
    if told is None:
        return {}
    texts = {units: told(_corners(study), partial(_amount_text, units)) for units in ("si", "field")}
    return {units: [text] for units, text in texts.items() if text is not None}


def wall_off_bottom(study: Study) -> Answer | None:
    """Where the collar of a string that turns off bottom is at the wall, as
    :func:`nsdrill.analysis.off_bottom.wall_off_bottom` has it; None of a model that does not tell it."""
    told: Any = getattr(checks_of(study.model), "wall_off_bottom", None)
    found: Answer | None = None if told is None else told(_corners(study))
    return found


def left_out(study: Study) -> Answer:
    """From where on the string of a study does what its model leaves out, as the checks of the
    model tell it: see :func:`nsdrill.models.christoforou_yigit.checks.left_out`; and the least
    weight ``held_from`` [N] under which its drive lacks the torque to turn a bit that has stopped, with the
    torque ``needed`` and ``available`` [N m]; None where there is none."""
    checks = checks_of(study.model)
    told: Any = getattr(checks, "left_out", None)
    found: Answer = {} if told is None else told(_corners(study))
    return {**found, "held_from": _held_from(study, getattr(checks, "drilling_at", None))}


def _held_from(study: Study, drilling_at: Any) -> Answer | None:
    """The least weight of :func:`left_out` at which the drive cannot turn a bit that has stopped."""
    if drilling_at is None or not any(_stall(drilling_at, one) for one in _corners(study)):
        return None
    for wob in study.axes.get("wob", np.array([study.operation.wob])):
        at_weight = replace(study, axes={**study.axes, "wob": np.array([wob])})
        for stall in (_stall(drilling_at, one) for one in _corners(at_weight)):
            if stall is not None:
                return {"wob": float(wob), "needed": stall.needed, "available": stall.available}
    return None


def _stall(drilling_at: Any, corner: Values) -> Any:
    """What a limited drive lacks to break the bit away at a corner; None where it does not."""
    drilling = drilling_at(corner.parameters, corner.point)
    stall = drilling.stall if drilling.holds_or_turns and drilling.wob > 0.0 else None
    return stall if stall is not None and stall.set_speed is None else None


class ShortObservation(NamedTuple):
    """The warnings of :func:`warnings` that an observation is too short, ``told`` in each
    system of units, ``si`` and ``field``; and below which rotary speed ``to`` [rad/s] it is,
    infinite where it is at every speed, as of a slow string."""

    told: dict[str, list[str]]
    to: float


def short_observation(study: Study) -> ShortObservation:
    """What there is to say of the observation of a study, where it is too short."""
    corners = _corners(study)
    slow = [_begins_late(study, corners), _few_periods(study, corners)]
    told: dict[str, list[str]] = {}
    for units in ("si", "field"):
        found = [*slow, _short_observation(study, units) if study.swept or not study.ramped else None]
        told[units] = [text for text in found if text is not None]
    at_every_speed = any(text is not None for text in slow) or ("rotary_speed" not in study.axes and bool(told["si"]))
    return ShortObservation(told, math.inf if at_every_speed else _slowest_observed(study))


def _slowest_observed(study: Study) -> float:
    """The speed [rad/s] of which the observation holds as many revolutions as it must."""
    return 2 * math.pi * LEAST_REVOLUTIONS / study.simulation.observe


def nothing_cut(study: Study) -> dict[str, list[str]]:
    """The warning of :func:`warnings` that the wear flats of a drag bit bear the whole
    weight on bit, in each system of units, ``si`` and ``field``."""
    return _of_bits(study, cutting.dull)


def few_states(study: Study) -> dict[str, list[str]]:
    """The warning of :func:`warnings` of a surface with too few states for the delay, likewise."""
    return _of_bits(study, cutting.few_states)


def _of_bits(study: Study, warning: Callable[..., str | None]) -> dict[str, list[str]]:
    """A ``warning`` of the bits on the surface of their blades, in each system of units."""
    at = getattr(checks_of(study.model), "cutting_at", None)
    corners = [] if at is None else [one for one in _corners(study) if _cuts_surface(one)]
    if at is None or not corners:
        return {}
    bits = [at(one.parameters, one.point) for one in corners]
    told = {units: warning(bits, partial(_amount_text, units)) for units in ("si", "field")}
    return {units: [text] for units, text in told.items() if text is not None}


def _cuts_surface(corner: Values) -> bool:
    """Whether the bit of a model with one on the surface of its blades is on such a surface:
    where the model has no other rock it has no key of one."""
    rock = getattr(corner.parameters.bit, "rock", None)
    return rock is None or bool(rock.regenerative)


def _few_periods(study: Study, corners: list[Values]) -> str | None:
    """The warning of an observation that is short beside the torsional period."""
    periods = _torsional_periods(study, corners)
    return few_periods(study, max(periods)) if periods else None


def shortest_period(study: Study, settings: Mapping[str, Array]) -> float:
    """The shortest torsional period [s] of a ``study`` at ``settings``, arrays by axis: at their
    ends, with the extreme samples; 0 of a model that does not tell it."""
    if checks_of(study.model) is None:
        return 0.0
    ends = {key: np.array([values.min(), values.max()]) for key, values in settings.items() if key in study.axes}
    corners = _corners(replace(study, axes={**study.axes, **ends}))
    try:
        return min(_torsional_periods(study, corners), default=0.0)
    except ValueError:  # where the study does not hold, which is told with the line of the setting
        return 0.0


def shortest_period_of(study: Study, at: Values, *, sideways: bool) -> float:
    """The shortest period [s] that is known of the motion of a run ``at`` these numbers: of torsion,
    and of a revolution where the string moves ``sideways``; 0 where none is known."""
    try:
        found = _torsional_periods(study, [at]) if checks_of(study.model) is not None else []
    except ValueError:  # where nothing is known of steady drilling
        return 0.0
    speed = abs(float(getattr(at.point, "rotary_speed", 0.0)))
    if sideways and speed > 0.0:
        found = [*found, 2.0 * math.pi / speed]
    return min(found, default=0.0)


def _torsional_periods(study: Study, corners: list[Values]) -> list[float]:
    """The period [s] of the first torsional mode at each of these corners whose string may
    twist; none of a model whose checks know no steady drilling."""
    drilling_at: Any = getattr(checks_of(study.model), "drilling_at", None)
    if drilling_at is None:
        return []
    twisting = [one for one in corners if not _is_frozen(one.parameters)]
    return [float(drilling_at(one.parameters, one.point).period) for one in twisting]


def _is_frozen(parameters: Any) -> bool:
    """Whether torsion is a frozen mode, in a model that has such."""
    modes = getattr(parameters, "modes", None)
    return modes is not None and modes.torsional == "frozen"


def _begins_late(study: Study, corners: list[Values]) -> str | None:
    """The warning of a drive that is switched on too late, of a model whose checks know when."""
    begins = getattr(checks_of(study.model), "control_begins", None)
    return None if begins is None else begins_late(study, begins(corners))


def without_control(study: Study, seconds: float) -> str | None:
    """The warning of a single run of these ``seconds`` in which control of the drive never begins."""
    begins = getattr(checks_of(study.model), "control_begins", None)
    if begins is None or (at := begins([Values(study.parameters, study.initial, ())])) < seconds:
        return None
    return (
        f"{LATE} {at:g} s (drive.on_at), and the run ends at {seconds:g} s: it is that of a string without it. Set "
        "drive.on_at to 0 s, or make the run longer."
    )


def sticking_limits(model: Description) -> Callable[[Sequence[Values]], list[Any]] | None:
    """What tells of settings below which speed steady drilling is unstable and up to which stick-slip may last; None
    of a ``model`` whose checks do not tell it."""
    found: Callable[[Sequence[Values]], list[Any]] | None = getattr(checks_of(model), "stick_slip_lasts", None)
    return found


def _amount_text(units: str, value: float, si: str, shown: str) -> str:
    """The text of a value [``si``] in a warning: in the units ``shown``, or in field
    units: of what is shown in m, as a depth, in ft, and of other lengths in inches."""
    field = "ft" if units == "field" and shown == "m" else unit_in(si, units)
    return amount(value, field or shown, 4)


def _verify_cost(study: Study) -> str | None:
    if not study.simulation.verify:
        return None
    tight, _ = stages.checks(study.simulation)
    return (
        f"Verify: every point is run again with the tolerance {tight.simulation.rtol:g} and continued for another "
        f"{study.simulation.transient + study.simulation.observe:g} s. The study takes about 4 times as long."
    )


def _size_warnings(experiment: Experiment) -> Iterator[str]:
    """What a run would refuse, and large results."""
    runs = coarse_points(experiment.study, experiment.plan.points)
    if runs > MANY:
        yield (
            f"Large: {bound_text(runs)} points; nsdrill run takes up to {bound_text(MANY)}, or more with "
            f"{option('large')}. How long they take: nsdrill check --price."
        )
    if text := _over_memory(experiment, in_file=True):
        yield f"Too large for the memory: {text} nsdrill run refuses it here."
    size = disk(experiment)
    if size >= LARGE:
        most = ", all points run," if experiment.study.refined else ""
        yield (
            f"Large: the results take up to {size / 1e9:.3g} GB on the disk{most} and as much again while the file is "
            "written. record.poincare and record.peaks say how much is kept of each point."
        )


def ends_of(study: Study, axis: str) -> tuple[float, float]:
    """The least and the greatest value of an axis, or of the ramp in its place."""
    if axis in study.ramped:
        return min(study.ramps[axis].values), max(study.ramps[axis].values)
    return float(study.axes[axis][0]), float(study.axes[axis][-1])


def _corners(study: Study) -> list[Values]:
    """The values at all combinations of the ends of axes and ramps, with the sample in the
    middle and the extreme ones."""
    ends = [study.axes[axis].tolist() if words_of(axis) else sorted(set(ends_of(study, axis))) for axis in study.axes]
    corners = [dict(zip(study.axes, values, strict=True)) for values in product(*ends)]
    if not study.drawn:
        return [values_at(study.parameters, study.initial, corner) for corner in corners]
    corner_values = []
    # First the sample in the middle of all, then those in which one uncertain number is least or
    # greatest; the others have their values in that sample. No sample need have the values of their
    # own sections.
    extremes = {int(at) for values in study.drawn.values() for at in (np.argmin(values), np.argmax(values))}
    middle = _middle_sample(study)
    for number in (middle, *sorted(extremes - {middle})):
        here = {key: float(values[number]) for key, values in study.drawn.items()}
        corner_values += [values_at(study.parameters, study.initial, {**corner, **here}) for corner in corners]
    return corner_values


def _middle_sample(study: Study) -> int:
    """The sample whose uncertain numbers are all the least far from the middle of their samples."""
    ranks = np.array([np.argsort(np.argsort(values)) for values in study.drawn.values()])
    return int(np.argmin(np.abs(ranks - (ranks.shape[1] - 1) / 2).max(axis=0)))


def _few_rounds(study: Study) -> str | None:
    """As :func:`_short_observation` of a model whose motion is observed at every period of
    its forcing."""
    if not study.model.section:
        return None
    model = model_named(study.model.name)
    rates = [
        float(variant.variant_at(model, at.parameters).phase_rate(model.pack(at, study.thresholds)).min())
        for at in _corners(study)
    ]
    periods = min(rates) * study.simulation.observe / (2 * math.pi)
    if periods >= LEAST_REVOLUTIONS - SLACK:
        return None
    return (
        f"{TOO_SHORT} the observation of {study.simulation.observe:g} s holds only {periods:.3g} periods of the "
        "forcing. Extremes and fractions will be rough; lengthen simulation.observe."
    )


def _short_observation(study: Study, units: str) -> str | None:
    if "rotary_speed" not in study.axes:
        return _few_rounds(study)
    slowest = float(
        study.drawn["rotary_speed"].min() if "rotary_speed" in study.drawn else ends_of(study, "rotary_speed")[0]
    )
    revolutions = slowest * study.simulation.observe / (2 * math.pi)
    if revolutions >= LEAST_REVOLUTIONS - SLACK:
        return None
    turns = f"{revolutions:.3g}"
    return (
        f"{TOO_SHORT} at {_amount_text(units, slowest, 'rad/s', 'rad/s')} the observation of "
        f"{study.simulation.observe:g} s holds only {turns} {'revolution' if turns == '1' else 'revolutions'} of the "
        "drive. Extremes and fractions will be rough; lengthen simulation.observe."
    )
