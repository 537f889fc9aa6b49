"""The flow of a model: many pieces of motion of own durations in one batch, with
monodromies and touches.

A piece of motion, a *leg*, is a run of the kernel. Where its monodromy is asked for it
is run once for each state, side by side in lanes, with a deviation along that state as
tangent states; the deviations land on contacts (:mod:`nsdrill.observe.landing`).
Nothing about the numbers depends on which legs share a batch.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, RATES, Rows, aligned_zeros, compiled
from nsdrill.errors import InputError
from nsdrill.kernel.batch import FEW, Batch, Compiled, Runs, choose_lanes
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.models.base import Model, Symmetry, Variant
from nsdrill.models.registry import NAMES
from nsdrill.observe.landing import landing_rows, make_landing, scratch_size
from nsdrill.observe.touches import TOUCHES, make_levels, make_touches, touch_rows
from nsdrill.scalar import unobserved
from nsdrill.variables import OK

Array = np.ndarray[Any, np.dtype[Any]]
PAIR = "tsitouras"
RTOL = 1e-11
MOST_STEPS = 200_000  # of one leg
SHORTEST = 1e-9  # of a leg [s]
FULL = 2  # runs to a lane that are enough for a thread: with fewer it costs more to wake it
REMEMBERED = 256  # values of the numbers continued
LOOSER = 100.0  # the tolerance of a deviation over that of the motion
DEFAULT_DIFFERENCE = 1e-5  # of the natural scale of a number, for derivatives by it


@dataclass(frozen=True)
class Legs:
    """Pieces of motion, arrays over n of them: ``state`` [n, states] at the drive angle
    ``phase`` [n] [rad], ``duration`` [n] [s], or where ``angular`` the angle by which
    the drive turns [rad]; ``values`` [n, numbers] of what is continued; ``tangent`` [n]
    where the monodromy is wanted; ``slack``: by what factor the tolerance of the flow
    may be exceeded."""

    state: Array
    phase: Array
    duration: Array
    values: Array
    tangent: Array
    slack: float | Array = 1.0
    angular: bool | Array = False

    def __len__(self) -> int:
        return len(self.state)


@dataclass(frozen=True)
class Ends:
    """What became of legs: ``state`` [n, states]; ``monodromy`` [n, states, states],
    zero where it was not wanted; ``touches`` [n, contacts and levels, 3], of each the
    least and greatest value of its function and how often it begins; ``ok`` [n] where
    the run ended well; ``duration`` [n] of the legs [s]."""

    state: Array
    monodromy: Array
    touches: Array
    ok: Array
    duration: Array

    def __getitem__(self, part: slice) -> Ends:
        return Ends(
            self.state[part],
            self.monodromy[part],
            self.touches[part],
            self.ok[part],
            self.duration[part],
        )


def joined(parts: list[Legs]) -> Legs:
    """Legs one after the other, with a ``slack`` [n] of each."""

    def one(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    slack = np.concatenate([np.broadcast_to(part.slack, len(part)) for part in parts])
    angular = np.concatenate([np.broadcast_to(part.angular, len(part)) for part in parts])
    return Legs(
        one("state"), one("phase"), one("duration"), one("values"), one("tangent"), slack, angular
    )


@dataclass(frozen=True)
class Equations:
    """What a flow integrates, with a deviation beside the states.

    ``runs(values, initial)`` makes runs of the kernel from ``values`` [n, numbers] of
    what is continued and ``initial`` [n, states + 1], without a deviation;
    ``parts(lanes)`` the compiled right-hand side, observer and marker, ``store`` the
    observer's store and ``columns`` how many numbers it reports. ``scales`` are natural
    scales of the numbers that are continued.
    """

    rows: Rows
    symmetry: Symmetry
    scales: tuple[float, ...]
    runs: Callable[[Array, Array], Runs]
    parts: Callable[[int], Compiled]
    store: Callable[[], Array] = field(default=lambda: aligned_zeros(1))
    contacts: tuple[str, ...] = ()
    levels: tuple[str, ...] = ()

    @property
    def columns(self) -> int:
        return len(TOUCHES) * (len(self.contacts) + len(self.levels))


class Flow:
    """The flow of some equations, on ``workers`` threads."""

    def __init__(self, equations: Equations, *, rtol: float = RTOL, workers: int = 1) -> None:
        self.equations, self.rtol, self.workers = equations, rtol, workers
        self.symmetry, self.scales = equations.symmetry, np.array(equations.scales)
        self.states = equations.rows.own
        self.lanes = choose_lanes(FEW)
        self.legs_run = 0
        self._threads: ThreadPoolExecutor | None = None
        self._memory: dict[bytes, tuple[Array, Array]] = {}
        self._settings = Simulation(0.0, 1.0, rtol=rtol, max_steps=MOST_STEPS)

    def state_scales(self, values: Array) -> Array:
        """The natural scales of the states at ``values`` [n, numbers], shape (n,
        states)."""
        return self._known(values)[0]

    def phase_rate(self, values: Array) -> Array:
        """How fast the drive's angle advances [rad/s], shape (n,)."""
        return self._known(values)[1]

    def _known(self, values: Array) -> tuple[Array, Array]:
        values = np.atleast_2d(values)
        key = values.tobytes()
        if key not in self._memory:
            if len(self._memory) >= REMEMBERED:
                self._memory.clear()
            runs = self.equations.runs(values, np.zeros((len(values), self.states + 1)))
            self._memory[key] = runs.state_scales, runs.phase_rate
        return self._memory[key]

    def slopes(self, state: Array, values: Array) -> Array:
        """The rates of states (n, states) at the drive angle 0, shape (n, states)."""
        rows, lanes = self.equations.rows, self.lanes
        right_hand_side = self.equations.parts(lanes).right_hand_side
        runs = self.equations.runs(
            values, np.concatenate([state, np.zeros((len(state), 1))], axis=1)
        )
        found = np.zeros_like(state)
        for first in range(0, len(state), lanes):
            part = slice(first, min(first + lanes, len(state)))
            buffer = aligned_zeros(rows.total * lanes)
            grid = buffer.reshape(rows.total, lanes)
            every = np.minimum(np.arange(first, first + lanes), len(state) - 1)
            grid[rows.stage : rows.stage + self.states] = state[every].T
            grid[rows.parameter : rows.parameter + rows.parameters] = runs.parameters[every].T
            right_hand_side(buffer)
            n = part.stop - part.start
            slopes = grid[rows.acceleration : rows.acceleration + rows.own_slopes, :n].T
            pairs = 2 * rows.pairs
            found[part, 0:pairs:2] = state[part, 1:pairs:2] + runs.frame_rates[part, : rows.pairs]
            found[part, 1:pairs:2] = slopes[:, : rows.pairs]
            found[part, pairs:] = slopes[:, rows.pairs :]
        return found

    def run(self, legs: Legs) -> Ends:
        """Run legs, in one batch."""
        n, states, rows = len(legs), self.states, self.equations.rows
        self.legs_run += n
        copies = np.where(legs.tangent, states, 1)
        leg = np.repeat(np.arange(n), copies)
        initial = np.concatenate([legs.state, legs.phase[:, None]], axis=1)
        runs = self.equations.runs(legs.values, initial)
        state_scales = runs.state_scales
        with np.errstate(divide="ignore", invalid="ignore"):
            asked = np.where(legs.angular, legs.duration / runs.phase_rate, legs.duration)
        possible = np.isfinite(asked) & (asked > 0.0)
        duration = np.where(possible, asked, SHORTEST)
        deviation = np.zeros((len(leg), states))
        firsts = np.concatenate([[0], np.cumsum(copies)[:-1]])
        which = np.arange(len(leg)) - firsts[leg]
        wanted = legs.tangent[leg]
        deviation[wanted, which[wanted]] = state_scales[leg[wanted], which[wanted]]
        frame_rates = np.concatenate([runs.frame_rates, np.zeros_like(runs.frame_rates)], axis=1)
        full = Runs(
            runs.parameters[leg],
            np.concatenate([state_scales, LOOSER * state_scales], axis=1)[leg]
            * np.broadcast_to(legs.slack, n)[leg, None],
            frame_rates[leg],
            runs.phase_rate[leg],
            np.minimum(runs.first_step, duration)[leg],
            np.concatenate([legs.state[leg], deviation, legs.phase[leg, None]], axis=1),
            np.zeros(len(leg)),
            duration[leg],
        )
        final, report, ok = self._shared(full, len(leg))
        monodromy = np.zeros((n, states, states))
        columns = final[:, states : 2 * states]
        with np.errstate(invalid="ignore", over="ignore"):
            monodromy[leg[wanted], :, which[wanted]] = (
                columns[wanted] / state_scales[leg[wanted], which[wanted]][:, None]
            )
        touches = report.reshape(len(leg), -1, len(TOUCHES))[firsts]
        fine = possible & ok[firsts] & np.isfinite(final[firsts, : rows.own]).all(axis=1)
        return Ends(final[firsts, : rows.own], monodromy, touches, fine, duration)

    def _shared(self, runs: Runs, n: int) -> tuple[Array, Array, Array]:
        """The final states, reports and whether they ended well of all ``n`` runs, on
        as many threads as they fill."""
        shares = max(1, min(self.workers, n // (FULL * self.lanes)))
        if shares == 1:
            return self._share(runs, np.arange(n))
        if self._threads is None:
            self._threads = ThreadPoolExecutor(self.workers - 1)
        # runs of one branch take about as long
        cuts = [np.arange(first, n, shares) for first in range(shares)]
        others = [self._threads.submit(self._share, runs, cut) for cut in cuts[1:]]
        done = [self._share(runs, cuts[0]), *(one.result() for one in others)]
        whole = tuple(np.zeros((n, *part.shape[1:]), part.dtype) for part in done[0])
        for cut, parts in zip(cuts, done, strict=True):
            for into, part in zip(whole, parts, strict=True):
                into[cut] = part
        return whole[0], whole[1], whole[2]

    def _share(self, runs: Runs, part: Array) -> tuple[Array, Array, Array]:
        """The final states, reports and whether they ended well of the runs
        ``part``."""
        rows, columns = self.equations.rows, self.equations.columns
        taken = Runs(*(getattr(runs, name)[part] for name in Runs.__dataclass_fields__))
        batch = Batch(self.lanes, len(part), rows, self.equations.store(), columns, self._settings)
        batch.add_many(np.arange(len(part)), taken)
        parts = self.equations.parts(self.lanes)
        final = np.zeros((len(part), rows.states + 1))
        report, ok = np.zeros((len(part), columns)), np.zeros(len(part), dtype=bool)
        left = len(part)
        while left:
            done = batch.advance(parts, 60.0, True)
            final[done.job], report[done.job], ok[done.job] = (
                done.final,
                done.report,
                done.status == OK,
            )
            left -= len(done.job)
        return final, report, ok


def equations_of(
    model: Model,
    fixed: Variant,
    symmetry: Symmetry,
    pack: Callable[[Array], Array],
    scales: tuple[float, ...],
) -> Equations:
    """The equations of a model: ``pack(values)`` gives the lane parameters at
    ``values`` [n, numbers]. InputError where the model cannot follow a deviation."""
    contacts, levels = len(model.contacts), model.levels(fixed)
    observed = landing_rows(contacts) + touch_rows(contacts + len(levels))
    try:
        rows = STEPPERS[PAIR].rows(replace(model.rows(fixed, observed, tangent=True), judged=True))
        model.tangent(choose_lanes(FEW), fixed, 0)
    except (NotImplementedError, ValueError) as error:
        raise InputError(
            f"the model {model.name}: found no linearised equations for this study "
            f"({str(error) or 'none are written'})"
            "; allowed: a study that has them, as continuation and Floquet multipliers need them."
        ) from None

    def runs(values: Array, initial: Array) -> Runs:
        return model.runs(pack(values), fixed, initial)

    def parts(lanes: int) -> Compiled:
        return _parts(model, fixed, lanes, rows)

    return Equations(
        rows,
        symmetry,
        scales,
        runs,
        parts,
        lambda: aligned_zeros(scratch_size(rows, contacts) + 1),
        model.contacts,
        tuple(one.name for one in levels),
    )


@lru_cache
def _parts(model: Model, fixed: Variant, lanes: int, rows: Rows) -> Compiled:
    contacts = len(model.contacts)
    levels = tuple((one.velocity, one.parameter) for one in model.levels(fixed))
    identity = (NAMES.index(model.name), *fixed, list(STEPPERS).index(PAIR))
    right_hand_side = model.tangent(lanes, fixed, 0)
    first = landing_rows(contacts)
    follow, mark_levels = (
        make_levels(lanes, rows, first + touch_rows(contacts), levels)
        if levels
        else unobserved(lanes)
    )
    if not contacts:
        return Compiled(right_hand_side, follow, mark_levels)
    measure = model.contact_functions(lanes, fixed, RATES * contacts)
    landing = make_landing(
        lanes,
        rows,
        STEPPERS[PAIR].scheme(rows),
        0,
        measure,
        model.tangent(1, fixed, 0),
        contacts,
        identity,
    )
    touches, mark_touches = make_touches(lanes, rows, first, 0, contacts)
    after = touch_rows(contacts)

    @compiled(types.void(BUFFER, BUFFER), lanes, *identity)
    def watch_orbit(b, store):  # type: ignore[no-untyped-def]
        measure(b)
        touches(b, store)
        follow(b, store)
        landing(b, store)

    @compiled(
        types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64),
        lanes,
        *identity,
    )
    def mark_orbit(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        mark_touches(b, store, i, mark, report, column)
        mark_levels(b, store, i, mark, report, column + after)

    return Compiled(right_hand_side, watch_orbit, mark_orbit)
