"""Motions at interactive speed: the replay of a stored point; the run from any state
with any numbers of the study changed; and the runs of many neighbouring points from one
state.

A file is read once, so that one motion costs little more than its integration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from nsdrill.app.experiment import Experiment
from nsdrill.app.simulating.integration import SimulatedMotion, points_of, run_at, select_states
from nsdrill.data import Array, Resolved, Results
from nsdrill.errors import InputError, StudyError, option
from nsdrill.kernel.batch import Runs, choose_lanes
from nsdrill.kernel.settings import Simulation
from nsdrill.models.choices import word_at, words_of
from nsdrill.models.friction import METHODS
from nsdrill.models.parts import values_at
from nsdrill.models.registry import model_named
from nsdrill.models.variant import variant_at
from nsdrill.observe.thresholds import Record
from nsdrill.records import dataclass
from nsdrill.study import parse_study
from nsdrill.study.study import Study
from nsdrill.study.write import study_text
from nsdrill.sweep.plan import Chosen, Plan
from nsdrill.sweep.work import Work, compiled_parts
from nsdrill.variables import INFERRED, PENDING, end_of_run, long_key

MAX_STEPS = 4_000_000  # of one motion, which take some seconds
MAX_SAMPLES = 200_000
LARGEST_STATE = 1e12  # SI, of a state from which a motion starts


class Motions:
    """The motions of an experiment and, with ``results``, of their points."""

    def __init__(self, experiment: Experiment, results: Results | None = None) -> None:
        self.experiment, self.results = experiment, results
        self.study = experiment.study
        self.plan = experiment.plan
        self._texts = lru_cache(64)(self._text)

    # Which point

    def values(self, place: Sequence[int]) -> dict[str, float]:
        """The values of the axes and unknowns at a place of the grid of the results, by
        key."""
        number = np.array([np.ravel_multi_index(tuple(place), self.plan.grid)])
        return {key: float(values[0]) for key, values in self.plan.values(number).items()}

    @cached_property
    def own(self) -> dict[str, float]:
        """The values of the axes at the operating point of the study, or in the middle
        of a swept axis."""
        operation = {name: float(value) for name, value in vars(self.study.operation).items()}
        swept = {key: float(values[len(values) // 2]) for key, values in self.plan.axes.items() if len(values) > 1}
        return {key: float(values[0]) for key, values in self.plan.axes.items()} | operation | swept

    def at(self, values: Mapping[str, float], changes: Mapping[str, str] | None = None) -> Study:
        """The study of one point at these ``values`` of the axes, with ``changes`` of
        further keys (texts as in a study). InputError where it is not valid."""
        texts = [f"{long_key(key)}={text}" for key, text in (changes or {}).items()]
        try:
            return parse_study(self._texts(tuple(values.items())), "the point", texts)
        except StudyError as error:
            changed = f" ({option('set')}"
            faults = "; ".join(
                f"{fault.key.removeprefix('operation.')}: found {fault.found.partition(changed)[0]}; allowed: "
                f"{fault.allowed}"
                for fault in error.faults[:3]
            )
            raise InputError(f"{faults}.") from None

    def _text(self, values: tuple[tuple[str, float], ...]) -> str:
        return study_text(self.resolved(dict(values)))

    def resolved(self, values: Mapping[str, float]) -> Resolved:
        """The resolved study of one point at these ``values`` of the axes, with one
        start."""
        resolved = deepcopy(self.study.resolved)
        resolved["sweep"] = {"procedure": "same", "along": None, "refine": 0}
        for section in ("ramps", "uncertain", "continue"):  # not of one constant point
            resolved.pop(section, None)
        resolved["initial"] |= {name: value for name, value in _ONE_START.items() if name in resolved["initial"]}
        leaves = self.study.keys.axes
        for key, value in values.items():
            *sections, name = long_key(key).split(".")
            target = resolved
            for section in sections:
                target = target[section]
            target[name] = (
                word_at(key, value) if words_of(key) else int(value) if leaves[key].kind == "whole" else value
            )
        return resolved

    def stored(self, place: Sequence[int]) -> Study:
        """The study with the parameters, the start and the operation of one point of
        the results: those of :meth:`at`, but nothing has to be read and checked."""
        values = self.values(place)
        here = values_at(self.study.parameters, self.study.initial, values)
        return replace(
            self.study,
            parameters=here.parameters,
            initial=here.initial,
            operation=here.point,
            resolved=self.resolved(values),
        )

    def start(self, study: Study) -> Array:
        """The state in which the study of one point begins."""
        model = model_named(study.model.name)
        return np.asarray(model.starts(points_of(study, study.operation), 0)[0], dtype=float)

    def states(self, study: Study) -> list[str]:
        """The names of the states of the string of ``study``, the phase last."""
        return [*variant_at(model_named(study.model.name), study.parameters).states, "drive_angle"]

    def fitted(self, study: Study, state: Mapping[str, float]) -> Array:
        """``state`` by name as an array of the states of the string of ``study``.
        States that ``state`` lacks, such as the speed of a drive that was ideal before,
        start as in the study."""
        names, start = self.states(study), self.start(study)
        if not state.keys() & set(names):
            raise InputError(f"states: found none of {', '.join(names)}; allowed: these. Choose a point again.")
        return np.array([state.get(name, float(value)) for name, value in zip(names, start, strict=True)])

    def with_start(self, study: Study, state: Array) -> Resolved | None:
        """The resolved study of one point with ``state`` as its start; None where its
        states are not keys of a study."""
        names = self.states(study)
        initial, held = study.resolved["initial"], model_named(study.model.name).held(study.parameters)
        if not all(name in initial for name in names):
            return None
        state = self.validated_state(study, state)
        start = {name: float(value) for name, value in zip(names, state, strict=True) if name not in held}
        return {**study.resolved, "initial": {**initial, **start}}

    # Its motion

    def replay(self, place: Sequence[int], seconds: float, sample: float) -> SimulatedMotion:
        """The replay of a stored point from its stored initial state, sampled every
        ``sample`` [s] in its last ``seconds``. InputError for a point that has not been
        run, or that takes too many steps."""
        assert self.results is not None
        place = tuple(place)
        point = {name: self.results[name][place] for name in _STORED}
        if point["status"] in (PENDING, INFERRED):
            raise InputError(
                "This point has not been run: "
                + (
                    "the sweep is not finished."
                    if point["status"] == PENDING
                    else "all points around it have one response, so the refinement passed it "
                    "over. Move a slider, "
                    "and it is run."
                )
            )
        if (steps := int(point["steps"]) + int(point["rejected"])) > MAX_STEPS:
            raise InputError(
                f"This point took {steps} steps, which is too long to wait for here. Use the command line below."
            )
        study = self.stored(place)
        names = self.results.coords["state"]
        initial, final = (select_states(study, names, point[name]) for name in ("initial_state", "final_state"))
        number = np.array([np.ravel_multi_index(place, self.plan.grid)])
        simulation = _with_method(study.simulation, bool(self.experiment.chosen.points(number)[0]))
        motion = _motion(study, simulation, initial, seconds, sample)
        same = motion.status == end_of_run(int(point["status"])) and np.array_equal(motion.final, final, equal_nan=True)
        return replace(motion, same_bits=bool(same))

    def run_from(
        self, study: Study, state: Array, seconds: float, sample: float, *, settle: float = 0.0, observe: float = 0.0
    ) -> SimulatedMotion:
        """The motion of the ``study`` of one point from ``state``: a transient of
        ``settle`` [s], then an observation of ``observe`` [s] (default: ``seconds``)
        with its features and labels, sampled every ``sample`` [s] in the last
        ``seconds``."""
        work = self._work(study, state, settle, observe or seconds)
        motion = _motion(study, work.simulation, work.prepare(np.array([0])).initial[0], seconds, sample)
        return replace(motion, found={name: v.item() for name, v in _run_alone(work).items() if np.ndim(v) == 0})

    def observed(self, study: Study, state: Array, *, settle: float, observe: float) -> dict[str, Array]:
        """The run of the ``study`` of one point from ``state``, as :meth:`run_from`, of
        which only the status, features, labels and states of a results file are kept,
        each without the dimension of the points."""
        return _run_alone(self._work(study, state, settle, observe))

    def _work(self, study: Study, state: Array, settle: float, observe: float) -> _FromState:
        """The point of the ``study`` from ``state``; of the method auto, implicit where
        friction is steep there."""
        simulation = replace(
            study.simulation, transient=settle, observe=observe, max_steps=min(study.simulation.max_steps, MAX_STEPS)
        )
        operation = {name: np.array([float(value)]) for name, value in vars(study.operation).items()}
        plan = Plan(operation, "same", None)
        chosen = Chosen(plan, study.parameters, study.initial, study.model, simulation.method)
        simulation = _with_method(simulation, bool(chosen.points(np.arange(plan.points)).any()))
        state = self.validated_state(study, state)
        return _FromState(
            plan,
            study.parameters,
            study.initial,
            simulation,
            study.thresholds,
            Record(peaks=0),
            study.model,
            state=state,
        )

    def validated_state(self, study: Study, state: Array) -> Array:
        """``state`` as an array, with the phase last; InputError where it is not a
        finite state of this string."""
        state = np.asarray(state, dtype=float)
        names = self.states(study)
        # the comparison is false for NaN
        if state.shape != (len(names),) or not np.all(np.abs(state) < LARGEST_STATE):
            largest = np.max(np.abs(state), initial=0.0)
            raise InputError(
                f"state: found {state.size} numbers up to {largest:.3g}; allowed: {len(names)} numbers "
                f"between {-LARGEST_STATE:.0e} and {LARGEST_STATE:.0e} in SI units. Choose a point again."
            )
        return state


_STORED = ("status", "initial_state", "final_state", "steps", "rejected")
_ONE_START: Resolved = {"ensemble": 0, "slice": {}}


@dataclass(frozen=True, kw_only=True)
class _FromState(Work):
    """A point that starts from a ``state``, with the phase last, except for states
    that are held constant."""

    state: Array

    def prepare(self, points: Array) -> Runs:
        runs = super().prepare(points)
        initial = runs.initial.copy()
        for row in initial:
            self.begin(row, self.state)
        return replace(runs, initial=initial)


def _run_alone(work: _FromState) -> dict[str, Array]:
    """The results of the only point of ``work``."""
    lanes = choose_lanes(1)
    batch = work.new_batch(lanes, 1)
    batch.add(np.array([0]), work.prepare(np.array([0])))
    columns = work.columns(batch.run_alone(compiled_parts(lanes, work.program)))
    return {name: values[0] for name, values in columns.items()}


def _with_method(simulation: Simulation, implicit: bool) -> Simulation:
    return replace(simulation, method=METHODS[1] if implicit else METHODS[0])


def _motion(study: Study, simulation: Simulation, initial: Array, seconds: float, sample: float) -> SimulatedMotion:
    """A run, sampled in its last ``seconds``. A run that ends before these is sampled
    from its start, more coarsely."""
    total, operation = simulation.transient + simulation.observe, study.operation
    begin, sample = max(0.0, total - seconds), float(sample)
    sample = max(sample, (total - begin) / MAX_SAMPLES)
    for _ in range(2):
        samples = math.floor((total - begin) / sample * (1 + 1e-12)) + 1
        motion = run_at(study, operation, simulation, initial, samples, sample, begin)
        if len(motion.states) > 1 or begin == 0.0:
            break
        begin, sample = 0.0, max(sample, total / MAX_SAMPLES)
    return motion
