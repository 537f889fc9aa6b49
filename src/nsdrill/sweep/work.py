"""What a sweep computes: the plan, the model and how it is watched; and one slice of that work on one gang."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, Rows, compiled
from nsdrill.kernel.gang import Compiled, Finished, Gang, Runs
from nsdrill.kernel.loop import make_advance
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.model.ensemble import starting_states
from nsdrill.model.leaves import Values, values_at
from nsdrill.model.parameters import Initial, Parameters
from nsdrill.model.rhs import (
    AUX,
    PARAMETERS,
    STATES,
    drifts,
    first_step,
    make_right_hand_side,
    pack,
    phase_rate,
    sizes,
)
from nsdrill.model.tangent import COMPANIONS, CONTACTS, RATES, make_contacts, make_tangent
from nsdrill.observe.classify import classify
from nsdrill.observe.exponent import GROWTH, exponent_of, growth_header, make_growth, seed_deviation
from nsdrill.observe.exponent import REPORT as GROWTH_REPORT
from nsdrill.observe.features import make_observer
from nsdrill.observe.landing import landing_rows, make_landing, scratch_size
from nsdrill.observe.layout import GROWTH_HEADER, OBSERVED, new_store, report_width
from nsdrill.observe.motion import in_the_bit_frame, period, zero_one
from nsdrill.observe.reduce import features, peaks, section
from nsdrill.observe.section import REVOLUTION, coordinates
from nsdrill.observe.thresholds import Record, Thresholds
from nsdrill.sweep.plan import Plan
from nsdrill.variables import OK, PEAKS

Array = np.ndarray[Any, np.dtype[Any]]
OUTBOX_FLOATS = 1 << 23  # 64 MB: with many returns to the section fewer runs wait in a gang
FEWEST_SLOTS = 256
LANDING = len(OBSERVED) + len(GROWTH)  # the place of its rows among the observer's
OTHERS = len(GROWTH) + landing_rows(len(CONTACTS))  # rows of what follows the deviation


@dataclass(frozen=True)
class Work:
    """All that decides the numbers of a sweep."""

    plan: Plan
    parameters: Parameters
    initial: Initial
    simulation: Simulation
    thresholds: Thresholds
    record: Record

    @property
    def variant(self) -> tuple[bool, int, bool, str]:
        """What is fixed when it is compiled: Hertz wall or not, number of lobes, with the Lyapunov exponent or not, and
        the name of the pair."""
        well, bit = self.parameters.well, self.parameters.bit
        return well.law == "hertz", bit.lobes, self.record.exponent, self.simulation.pair

    def at(self, values: Mapping[str, Any]) -> Values:
        """What the points have at these values of the axes, scalars or arrays [points]."""
        return values_at(self.parameters, self.initial, values)

    def new_gang(self, lanes: int, slots: int) -> Gang:
        record = self.record
        spacing = REVOLUTION / (self.parameters.bit.lobes if record.section == "lobe" else 1)
        more = scratch_size(rows_for(True, self.simulation.pair), len(CONTACTS)) if record.exponent else 0
        store = new_store(lanes, record.peaks, record.poincare, spacing, more)
        width = report_width(record.peaks, record.poincare)
        if record.exponent:
            store[GROWTH_HEADER : GROWTH_HEADER + 2] = growth_header(self.simulation.observe)
            width += len(GROWTH_REPORT)
        slots = min(slots, max(FEWEST_SLOTS, OUTBOX_FLOATS // width))
        return Gang(lanes, slots, rows_for(record.exponent, self.simulation.pair), store, width, self.simulation)

    def prepare(self, points: Array) -> Runs:
        """The runs of these points."""
        at = self.at(self.plan.values(points))
        table = pack(at.parameters, *at.operation, self.thresholds.stuck_below)
        initial = starting_states(at.parameters, at.initial, *at.operation, self.plan.starts_of(points))
        size, drift = sizes(table), drifts(table)
        if self.record.exponent:  # the deviation stands between the states and the drive angle, and has no drift
            initial = np.concatenate([initial[:, :-1], seed_deviation(size), initial[:, -1:]], axis=1)
            size, drift = np.tile(size, 2), np.concatenate([drift, np.zeros_like(drift)], axis=1)
        return Runs(table, size, drift, phase_rate(table), first_step(table), initial)

    @staticmethod
    def own_state(state: Array) -> Array:
        """States (..., 9) with the drive angle last, without the deviation that may stand before it."""
        return np.concatenate([state[..., : len(STATES)], state[..., -1:]], axis=-1)

    @staticmethod
    def begin(initial: Array, state: Array) -> None:
        """Let the run of the row ``initial`` begin in ``state`` (9), whatever deviation it has."""
        initial[: len(STATES)], initial[-1] = state[:-1], state[-1]

    def columns(self, done: Finished) -> dict[str, Array]:
        """The results of finished runs, one array per variable of the results file."""
        record, ok = self.record, done.status == OK
        measured = features(done.report, done.parameters, self.simulation.observe, self.variant[0])
        if record.exponent:
            # In a step the deviation is about as wrong as the motion.
            duration = self.simulation.transient + self.simulation.observe
            bias = self.simulation.rtol * done.accepted / duration
            measured |= exponent_of(done.report[:, -len(GROWTH_REPORT) :], self.simulation.observe, bias)
        measured = {name: np.where(ok, value, np.nan) for name, value in measured.items()}
        heights = peaks(done.report, record.peaks)
        heights[~ok] = np.nan
        size = sizes(done.parameters)
        if record.poincare:
            crossings = section(done.report, record.peaks, record.poincare)
            crossings[~ok] = np.nan
            measured |= coordinates(crossings)
            measured["zero_one"] = self._zero_one(in_the_bit_frame(measured), size)
        labels = classify(measured, done.status, self.thresholds, size)
        return {
            "status": done.status,
            "steps": done.accepted,
            "rejected": done.rejected,
            **measured,
            **labels,
            **({"attractor": np.zeros(len(size), np.int16)} if self.plan.starts else {}),  # known when all starts are
            **{name: heights[:, i] for i, name in enumerate(PEAKS)},
            "initial_state": self.own_state(done.initial),
            "final_state": self.own_state(done.final),
        }

    def _zero_one(self, returns: Array, size: Array) -> Array:
        """The 0-1 test where it says something: on motions without a period."""
        index = np.full(len(size), np.nan)
        open_ = np.flatnonzero(period(returns, size, self.thresholds.motion) == 0)
        index[open_] = zero_one(returns[open_], size[open_])
        return index


def rows_for(exponent: bool, pair: str) -> Rows:
    """The lane buffer of a sweep, with the companions and the rows for the Lyapunov exponent or without."""
    companions, more = (COMPANIONS, OTHERS) if exponent else (0, 0)
    rows = Rows(len(STATES) + companions, len(AUX), len(PARAMETERS), len(OBSERVED) + more, companions)
    return STEPPERS[pair].rows(rows)


@lru_cache
def compiled_parts(
    lanes: int, hertz: bool, lobes: int = 3, exponent: bool = False, pair: str = "tsitouras"
) -> Compiled:
    """The model and the observer, compiled for a number of lanes; from the disk cache where it has them. The kernel is
    compiled along, before several threads ask for it at once."""
    rows = rows_for(exponent, pair)
    STEPPERS[pair].make(lanes, rows)
    make_advance(lanes, rows)
    if exponent:
        observer, marker = make_watch(lanes, hertz, lobes, pair)
        return Compiled(make_tangent(lanes, hertz, lobes, LANDING), observer, marker)
    observer, marker = make_observer(lanes, lobes)
    return Compiled(make_right_hand_side(lanes, hertz, lobes), observer, marker)


@lru_cache
def make_watch(lanes: int, hertz: bool, lobes: int, pair: str) -> tuple[Any, Any]:
    """The compiled (observer, marker) that do all: mend the deviation across contacts, measure features of the motion
    and growth of its deviation."""
    rows, stepper = rows_for(True, pair), STEPPERS[pair]
    variant = (hertz, lobes, list(STEPPERS).index(pair))
    observer, marker = make_observer(lanes, lobes, COMPANIONS, OTHERS)
    contacts = make_contacts(lanes, lobes, LANDING + RATES * len(CONTACTS))
    tangent = make_tangent(1, hertz, lobes, LANDING)
    landing = make_landing(lanes, rows, stepper.tableau, LANDING, contacts, tangent, len(CONTACTS), variant)
    growth, growth_marker = make_growth(lanes, rows, len(OBSERVED), GROWTH_HEADER)
    columns = len(GROWTH_REPORT)

    @compiled(types.void(BUFFER, BUFFER), lanes, *variant)
    def watch(b, store):  # type: ignore[no-untyped-def]
        landing(b, store)
        observer(b, store)
        growth(b, store)

    @compiled(types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64),
              lanes, *variant)
    def watch_marker(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        marker(b, store, i, mark, report, column)
        growth_marker(b, store, i, mark, report, len(report) - columns)

    return watch, watch_marker


def advance(gang: Gang, variant: tuple[bool, int, bool, str], seconds: float, drain: bool) -> tuple[Gang, Finished]:
    """One slice of work: a task for any executor, in this process or in another."""
    done = gang.advance(compiled_parts(gang.lanes, *variant), seconds, drain)
    return gang, done
