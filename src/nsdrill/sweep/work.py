"""What a sweep computes: the plan, the model and what is observed; the same of points that
are run again from given states; and one quantum of that work on one batch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any, Literal, Self

import numpy as np

from nsdrill.abi import MARKER, OBSERVER, RATES, Layout
from nsdrill.compiler.functions import LaneFunction, address, compiled
from nsdrill.data import Array
from nsdrill.kernel.batch import Batch, Compiled, FinishedRuns, Runs
from nsdrill.kernel.device_batch import DeviceBatch
from nsdrill.kernel.launcher import Launcher
from nsdrill.kernel.loop import make_advance
from nsdrill.kernel.own_pairs import pair_named
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import make_step, with_step
from nsdrill.models.base import Model
from nsdrill.models.choices import is_compiled_in, words_of
from nsdrill.models.friction import METHODS
from nsdrill.models.model_description import Description
from nsdrill.models.operation import Values
from nsdrill.models.parts import in_parts, part_at, parts_of, states_of_all, values_at
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.starts import Starts
from nsdrill.models.variant import Variant, variant_at, variant_of
from nsdrill.observe.contacts import landing_rows, make_landing, scratch_size
from nsdrill.observe.exponent import (
    GROWTH,
    GROWTH_COLUMNS,
    GROWTH_HEADER,
    exponent_of,
    growth_header,
    make_growth,
    seed_deviation,
)
from nsdrill.observe.motion_kinds import period, zero_one
from nsdrill.observe.thresholds import Record
from nsdrill.records import dataclass
from nsdrill.sweep.plan import Chosen, Plan
from nsdrill.variables import OK

OUTBOX_FLOATS = 1 << 23  # 64 MB: with many returns to the section a batch has fewer slots
FEWEST_SLOTS = 256


@dataclass(frozen=True)
class Program:
    """What is fixed when a sweep is compiled: the variant of the model, whether the
    Lyapunov exponent is measured, and the name of the stepper."""

    variant: Variant
    exponent: bool = False
    stepper: str = "tsitouras"

    def __reduce__(self) -> tuple[Any, ...]:
        # another process has the same models by their names
        return _program, (self.variant.model.name, tuple(self.variant.options), self.exponent, self.stepper)

    @cached_property
    def rows(self) -> Layout:
        """The layout of the lane buffer, with tangent states and the rows for the
        Lyapunov exponent if that is measured."""
        more = _deviation_rows(self.variant) if self.exponent else 0
        rows = self.variant.rows(self.variant.observed + more, tangent=self.exponent)
        return with_step(pair_named(self.stepper), rows)


def _program(model: str, options: tuple[int, ...], exponent: bool, stepper: str) -> Program:
    return Program(variant_of(model_named(model), options), exponent, stepper)


def _deviation_rows(variant: Variant) -> int:
    """The number of rows of the observers of the deviation."""
    return len(GROWTH) + landing_rows(len(variant.model.contacts))


@dataclass(frozen=True)
class Work:
    """All that determines the results of a sweep."""

    plan: Plan
    parameters: Any
    initial: Starts
    simulation: Simulation
    thresholds: Thresholds
    record: Record
    model: Description
    of_all: tuple[str, ...] = ()
    """The :attr:`states` of the whole work, of a part of it."""

    @property
    def computed(self) -> Model:
        """The model as it is computed."""
        return model_named(self.model.name)

    @cached_property
    def program(self) -> Program:
        """What is fixed when it is compiled."""
        return Program(self.variant, self.record.exponent, self.simulation.stepper)

    @cached_property
    def variant(self) -> Variant:
        """The variant of the model. An option is compiled in if some value of an axis needs
        it."""
        fixed = variant_at(self.computed, self.at(self.plan.varied).parameters)
        return fixed.implicit if self.simulation.method == "implicit" else fixed

    def at(self, values: Mapping[str, float | Array]) -> Values:
        """Parameters, operation and start of the points at these values of the axes,
        scalars or arrays [points]. What is compiled in is that of the work's own
        parameters (:meth:`parts`)."""
        unused = getattr(self.parameters, "unread", ()) if any(map(words_of, self.compiled_axes)) else ()
        free = {key: value for key, value in values.items() if key not in self.compiled_axes and key not in unused}
        return values_at(self.parameters, self.initial, free)

    @cached_property
    def compiled_axes(self) -> tuple[str, ...]:
        """The axes of numbers that are fixed when the model is compiled."""
        return tuple(key for key in self.plan.axes if is_compiled_in(self.model, key))

    def parts(self, points: Array) -> Iterator[tuple[Self, Array]]:
        """These points divided by what is compiled in: the work of each part, with its
        own parameters, and its points."""
        if not self.compiled_axes:
            yield self, points
            return
        for compiled_values, in_part in in_parts(self.model, self.plan.values(points)):
            parameters, initial = part_at(self.parameters, self.initial, compiled_values)
            yield replace(self, parameters=parameters, initial=initial, of_all=self.states), points[in_part]

    @cached_property
    def chosen(self) -> Chosen:
        """Which points are integrated implicitly."""
        return Chosen(self.plan, self.parameters, self.initial, self.model, self.simulation.method)

    def by(self, method: Literal["explicit", "implicit"]) -> Self:
        """The same work with this ``method``."""
        return replace(self, simulation=replace(self.simulation, method=method))

    def by_method(self, points: Array) -> Iterator[tuple[Self, Array]]:
        """These points divided by the method that integrates them: the work of each
        part, whose method is explicit or implicit, and its points."""
        if self.simulation.method == "explicit":
            yield self, points
            return
        chosen = self.chosen.points(points)
        for method in METHODS:
            if (selected := points[chosen == (method == METHODS[1])]).size:
                yield self.by(method), selected

    def new_batch(self, lanes: int, slots: int) -> Batch:
        """An empty batch for these runs, with at most ``slots`` slots."""
        store, width = self.observed(lanes)
        slots = min(slots, max(FEWEST_SLOTS, OUTBOX_FLOATS // width))
        return Batch(lanes, slots, self.program.rows, store, width, self.simulation)

    def device_batch(self, launcher: Launcher, threads: int, slots: int) -> DeviceBatch:
        """An empty batch for these runs on a device, with at most so many threads and
        slots."""
        store, width = self.observed(1)
        parts, rows, independent = lane_parts(1, self.program), self.program.rows, not self.plan.carried
        return DeviceBatch(launcher, parts, rows, store, width, self.simulation, slots, threads, independent)

    def observed(self, lanes: int) -> tuple[Array, int]:
        """The store of the observer for a number of lanes, and the number of columns of its
        outcome."""
        model, record, rows = self.computed, self.record, self.program.rows
        more = scratch_size(rows, len(model.contacts)) if record.exponent else 0
        store = self.variant.store(lanes, record, more, model.section_parts(self.parameters, record))
        width = self.variant.outcome_width(record)
        if record.exponent:
            store[GROWTH_HEADER : GROWTH_HEADER + 2] = growth_header(self.simulation.observe)
            width += len(GROWTH_COLUMNS)
        return store, width

    def prepare(self, points: Array) -> Runs:
        """The runs of these points."""
        model, variant, at = self.computed, self.variant, self.at(self.plan.values(points))
        table = model.pack(at, self.thresholds, len(points))
        runs = variant.runs(table, model.starts(at, self.plan.starts_of(points)))
        # The deviation comes between the states and the phase, and its frame does not
        # rotate.
        if self.record.exponent:
            seeds = seed_deviation(runs.state_scales)
            names = variant.states
            seeds[:, [names.index(name) for name in model.undeviated(self.parameters)]] = 0.0
            initial = np.concatenate([runs.initial[:, :-1], seeds, runs.initial[:, -1:]], axis=1)
            still = np.zeros_like(runs.frame_rates)
            runs = replace(
                runs,
                initial=initial,
                state_scales=np.tile(runs.state_scales, 2),
                frame_rates=np.concatenate([runs.frame_rates, still], axis=1),
            )
        return runs

    @cached_property
    def states(self) -> tuple[str, ...]:
        """The states of all points, the angle of the drive last. A point may have only
        some of them."""
        if self.of_all:
            return self.of_all
        variants = parts_of(self.model, self.parameters, self.initial, self.plan.axes)
        return states_of_all([self.model.states(parameters) for parameters, _ in variants])

    def to_all_states(self, state: Array) -> Array:
        """States with the phase last [points, own states + 1] as values of the states
        of all points (:attr:`states`), NaN for those that these points do not have."""
        names, own = self.states, self.model.states(self.parameters)
        if names == own:
            return state
        values = np.full((len(state), len(names)), np.nan)
        values[:, [names.index(name) for name in own]] = state
        return values

    def to_own_states(self, state: Array) -> Array:
        """The inverse of :meth:`to_all_states`."""
        names, own = self.states, self.model.states(self.parameters)
        return state if names == own else state[:, [names.index(name) for name in own]]

    @cached_property
    def state_count(self) -> int:
        """The number of states of the model."""
        return len(self.variant.states)

    def own_state(self, state: Array) -> Array:
        """States with the phase last, shape (..., states + 1), without the deviation
        that may precede it."""
        return np.concatenate([state[..., : self.state_count], state[..., -1:]], axis=-1)

    def begin(self, initial: Array, state: Array) -> None:
        """Set the start of the run of row ``initial`` to ``state`` (states + 1), except
        the held states and the deviation."""
        moving = [i for i in range(self.state_count) if i not in self._held]
        initial[moving], initial[-1] = state[moving], state[-1]

    def same_held(self, initial: Array) -> int:
        """The number of rows at the beginning of ``initial`` with the same held states:
        so many runs may form a chain without :meth:`begin`."""
        differs = np.any(initial[:, self._held] != initial[:1, self._held], axis=1)
        return int(np.argmax(differs)) if differs.any() else len(initial)

    @cached_property
    def _held(self) -> list[int]:
        """The positions of the held states, which do not move."""
        names = self.variant.states
        return [names.index(name) for name in self.computed.held(self.parameters)]

    def measured(self, done: FinishedRuns) -> dict[str, Array]:
        """The features of finished runs; NaN where a run failed."""
        features = self.variant.features(done.outcome, done.parameters, self.simulation.observe)
        return _or_nan(done.status == OK, features)

    def columns(self, done: FinishedRuns) -> dict[str, Array]:
        """The results of finished runs, one array per variable of the results file."""
        model, record, ok = self.computed, self.record, done.status == OK
        measured = self.measured(done)
        if record.exponent:
            # In a step the relative error of the deviation is about that of the motion.
            duration = self.simulation.transient + self.simulation.observe
            bias = self.simulation.rtol * done.accepted / duration
            growth = done.outcome[:, -len(GROWTH_COLUMNS) :]
            measured |= _or_nan(ok, exponent_of(growth, self.simulation.observe, bias))
        measured |= _or_nan(ok, model.derived(measured, self.at(self.plan.values(done.job))))
        state_scales = self.variant.state_scales(done.parameters)
        if record.poincare:
            measured |= _or_nan(ok, self.variant.section(done.outcome, record, done.parameters))
            measured["zero_one"] = self._zero_one(model.returns(measured), state_scales)
        status = self.model.status_of(done.status, measured)
        # Only the kind of motion reads it.
        held = frozenset(model.undeviated(self.parameters))
        dimension = self.variant.dimension(done.parameters, held) if record.poincare else np.zeros(len(ok))
        peaks = _or_nan(ok, self.variant.peaks(done.outcome, record))
        labels = model.classify({**measured, **peaks}, status, self.thresholds, state_scales, dimension)
        return {
            "status": status,
            "steps": done.accepted,
            "rejected": done.rejected,
            **measured,
            **labels,
            "method": np.full(len(state_scales), self.simulation.method == "implicit", np.int8),
            # numbered once all starts have been run
            **({"attractor": np.zeros(len(state_scales), np.int16)} if self.plan.starts else {}),
            **peaks,
            "initial_state": self.to_all_states(self.own_state(done.initial)),
            "final_state": self.to_all_states(self.own_state(done.final)),
        }

    def _zero_one(self, returns: Array, state_scales: Array) -> Array:
        """The 0-1 test of motions without a period, for which it is meaningful."""
        # The returns may be without some of the states.
        state_scales = self.computed.seen(state_scales)[:, : returns.shape[-1]]
        index = np.full(len(state_scales), np.nan)
        aperiodic = np.flatnonzero(period(returns, state_scales, self.thresholds.motion) == 0)
        index[aperiodic] = zero_one(returns[aperiodic], state_scales[aperiodic])
        return index


def _or_nan(ok: Array, arrays: dict[str, Array]) -> dict[str, Array]:
    """These arrays [n, ...] with NaN where not ``ok`` [n]."""
    return {name: np.where(ok.reshape(-1, *[1] * (value.ndim - 1)), value, np.nan) for name, value in arrays.items()}


# Points of a sweep that are run again, each separately, from given states.


@dataclass(frozen=True, kw_only=True)
class Rerun(Work):
    """The points ``point_numbers`` (ascending) of a sweep, from ``start_states``
    [points, states]. Carried states are given like all others, so there are no chains.
    Each point is integrated by the same method as in the sweep, ``sweep_choice``."""

    point_numbers: Array
    start_states: Array
    sweep_choice: Chosen

    @classmethod
    def of(cls, work: Work, simulation: Simulation, point_numbers: Array, states: Array) -> Rerun:
        """The same model with another ``simulation`` time or tolerance, recording
        features only."""
        return cls(
            replace(work.plan, along=None),
            work.parameters,
            work.initial,
            simulation,
            work.thresholds,
            Record(peaks=0),
            work.model,
            point_numbers=point_numbers,
            start_states=states,
            sweep_choice=work.chosen,
        )

    @cached_property
    def chosen(self) -> Chosen:
        return self.sweep_choice

    def prepare(self, points: Array) -> Runs:
        """The runs of these points."""
        return replace(
            super().prepare(points),
            initial=self.to_own_states(self.start_states[np.searchsorted(self.point_numbers, points)]),
        )

    def columns(self, done: FinishedRuns) -> dict[str, Array]:
        """Status and features of finished runs, and the natural scales of the
        features."""
        measured = self.measured(done)
        status = self.model.status_of(done.status, measured)
        return {"status": status, **measured, **self.computed.scales(done.parameters)}


@lru_cache
def lane_parts(lanes: int, program: Program) -> Compiled:
    """The model and the observer for a number of lanes, which are not compiled yet."""
    variant = program.variant
    if program.exponent:
        observer, marker = make_observers(lanes, program)
        right_hand_side = variant.tangent(lanes, _landing_place(variant))
    else:
        observer, marker = variant.observer(lanes)
        right_hand_side = variant.right_hand_side(lanes)
    return Compiled(right_hand_side, observer, marker)


@lru_cache
def compiled_parts(lanes: int, program: Program) -> Compiled:
    """The model and the observer, compiled for a number of lanes or loaded from the
    disk cache. The kernel is compiled too, before several threads need it at once."""
    parts, stepper = lane_parts(lanes, program), make_step(pair_named(program.stepper), lanes, program.rows)
    for function in (make_advance(), stepper, parts.right_hand_side, parts.observer, parts.marker):
        address(function)
    return parts


def _landing_place(variant: Variant) -> int:
    """The position of the rows of the landing observer among those of all observers."""
    return variant.observed + len(GROWTH)


@lru_cache
def make_observers(lanes: int, program: Program) -> tuple[LaneFunction, LaneFunction]:
    """The compiled (observer, marker) that combine all observers: they correct the
    deviation across contacts, and measure the features of the motion and the growth of
    its deviation."""
    variant, rows, pair = program.variant, program.rows, pair_named(program.stepper)
    model = variant.model
    place, contacts = _landing_place(variant), len(model.contacts)
    observer, marker = variant.observer(lanes, tangent=True, others=_deviation_rows(variant))
    measure = variant.contact_functions(lanes, place + RATES * contacts)
    tangent = variant.tangent(1, place)
    landing = make_landing(lanes, rows, pair, place, measure, tangent, contacts, variant.seeks_jumps)
    growth, growth_marker = make_growth(lanes, rows, variant.observed, GROWTH_HEADER)
    columns = len(GROWTH_COLUMNS)

    @compiled(OBSERVER)
    def observe(b, store):  # type: ignore[no-untyped-def]
        landing(b, store)
        observer(b, store)
        growth(b, store)

    @compiled(MARKER)
    def observe_mark(b, store, i, mark, outcome, column):  # type: ignore[no-untyped-def]
        marker(b, store, i, mark, outcome, column)
        growth_marker(b, store, i, mark, outcome, len(outcome) - columns)

    return observe, observe_mark


def advance(batch: Batch, program: Program, seconds: float, drain: bool) -> tuple[Batch, FinishedRuns]:
    """Advance a batch for one quantum: a task for any executor, in this process or in
    another."""
    parts = lane_parts(1, program) if isinstance(batch, DeviceBatch) else compiled_parts(batch.lanes, program)
    return batch, batch.advance(parts, seconds, drain)
