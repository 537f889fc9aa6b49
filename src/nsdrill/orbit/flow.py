"""The flow of a model: many pieces of trajectories, each with its own duration, in one
batch, with monodromies and touches.

A piece of a trajectory, a *leg*, is a run of the kernel. A leg with a monodromy is run
once for each state, side by side in lanes, with a deviation along that state as tangent
states; the deviations land on contacts (:mod:`nsdrill.observe.contacts`). The numbers do
not depend on which legs share a batch.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import field, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from nsdrill.abi import MARKER, OBSERVER, RATES, Layout, aligned_zeros
from nsdrill.compiler.functions import compiled
from nsdrill.data import Array
from nsdrill.errors import InputError
from nsdrill.kernel.batch import FEW, Batch, Compiled, Runs, choose_lanes, unobserved
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS, with_step
from nsdrill.models.base import Symmetry
from nsdrill.models.variant import Variant
from nsdrill.observe.contacts import (
    TOUCHES,
    landing_rows,
    make_landing,
    make_levels,
    make_touches,
    scratch_size,
    touch_rows,
)
from nsdrill.records import dataclass
from nsdrill.variables import OK

PAIR = "tsitouras"
RTOL = 1e-11
MAX_STEPS = 200_000  # of one leg
MIN_DURATION = 1e-9  # of a leg [s]
RUNS_PER_LANE = 2  # at least, for each thread: with fewer, starting the thread costs more
CACHE_SIZE = 256  # values of the parameters
TANGENT_TOLERANCE_FACTOR = 100.0  # the tolerance of a deviation over that of the motion
DIFFERENCE_STEP = 1e-5  # of central differences by a parameter, in its natural scale


class Legs:
    """Pieces of trajectories, as arrays over n of them; what is one number for all is
    made an array:

    - ``state`` [n, states] at the start, at the drive angle ``phase`` [n] [rad];
    - ``duration`` [n] [s], or, where ``angular``, the angle by which the drive advances
      [rad];
    - ``values`` [n, parameters] of the continuation parameters;
    - ``tangent`` [n], whether the monodromy is computed;
    - ``tolerance_factor`` [n], by which the tolerance of the flow is multiplied.
    """

    def __init__(
        self,
        state: Array,
        phase: ArrayLike,
        duration: ArrayLike,
        values: Array,
        tangent: ArrayLike = False,
        tolerance_factor: ArrayLike = 1.0,
        angular: ArrayLike = False,
    ) -> None:
        n = len(state)
        self.state, self.values = state, _over(n, values, values.shape[-1:])
        self.phase, self.duration = _over(n, phase), _over(n, duration)
        self.tangent, self.angular = _over(n, tangent), _over(n, angular)
        self.tolerance_factor = _over(n, tolerance_factor)

    def __len__(self) -> int:
        return len(self.state)


def _over(n: int, values: ArrayLike, more: tuple[int, ...] = ()) -> Array:
    """``values`` as an array [n, ...]; of one that has this shape itself."""
    if isinstance(values, np.ndarray) and values.shape == (n, *more):
        return values
    repeated = np.empty((n, *more), np.asarray(values).dtype)
    repeated[...] = values
    return repeated


@dataclass(frozen=True)
class Ends:
    """The ends of legs:

    - ``state`` [n, states];
    - ``monodromy`` [n, states, states], zero where it is not computed;
    - ``touches`` [n, contacts and levels, 3]: of each contact or level the least and
      greatest value of its function, and how often it begins;
    - ``ok`` [n], whether the run ended well;
    - ``duration`` [n] of the legs [s].
    """

    state: Array
    monodromy: Array
    touches: Array
    ok: Array
    duration: Array

    def __getitem__(self, part: slice) -> Ends:
        return Ends(self.state[part], self.monodromy[part], self.touches[part], self.ok[part], self.duration[part])


def joined(parts: list[Legs]) -> Legs:
    """The legs of all ``parts`` in order."""
    names = vars(parts[0])
    return Legs(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


@dataclass(frozen=True)
class Equations:
    """The equations that a flow integrates, those of a deviation included.

    ``runs(values, initial)`` makes runs of the kernel, without a deviation, from
    ``values`` [n, parameters] of the continuation parameters and ``initial``
    [n, states + 1]. ``parts(lanes)`` are the compiled right-hand side, observer and
    marker; ``store()`` is the observer's store and ``columns`` the length of its
    outcome. ``scales`` are the natural scales of the continuation parameters.
    """

    rows: Layout
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
        self._pool: ThreadPoolExecutor | None = None
        self._cache: dict[bytes, tuple[Array, Array]] = {}
        self._settings = Simulation(0.0, 1.0, rtol=rtol, max_steps=MAX_STEPS)

    def state_scales(self, values: Array) -> Array:
        """The natural scales of the states at ``values`` [n, parameters], shape (n,
        states)."""
        return self._scales_and_rate(values)[0]

    def phase_rate(self, values: Array) -> Array:
        """The angular velocity of the drive at ``values`` [rad/s], shape (n,)."""
        return self._scales_and_rate(values)[1]

    def _scales_and_rate(self, values: Array) -> tuple[Array, Array]:
        values = np.atleast_2d(values)
        key = values.tobytes()
        if key not in self._cache:
            if len(self._cache) >= CACHE_SIZE:
                self._cache.clear()
            runs = self.equations.runs(values, np.zeros((len(values), self.states + 1)))
            self._cache[key] = runs.state_scales, runs.phase_rate
        return self._cache[key]

    def state_rates(self, state: Array, values: Array) -> Array:
        """The time derivatives of states (n, states) at the drive angle 0, shape (n,
        states)."""
        rows, lanes = self.equations.rows, self.lanes
        right_hand_side = self.equations.parts(lanes).right_hand_side
        runs = self.equations.runs(values, np.concatenate([state, np.zeros((len(state), 1))], axis=1))
        rates = np.zeros_like(state)
        for first in range(0, len(state), lanes):
            part = slice(first, min(first + lanes, len(state)))
            buffer = aligned_zeros(rows.total * lanes)
            grid = buffer.reshape(rows.total, lanes)
            indices = np.minimum(np.arange(first, first + lanes), len(state) - 1)
            grid[rows.stage : rows.stage + self.states] = state[indices].T
            grid[rows.parameter : rows.parameter + rows.parameters] = runs.parameters[indices].T
            right_hand_side(buffer)
            count = part.stop - part.start
            slopes = grid[rows.acceleration : rows.acceleration + rows.own_slopes, :count].T
            pairs = 2 * rows.pairs
            rates[part, 0:pairs:2] = state[part, 1:pairs:2] + runs.frame_rates[part, : rows.pairs]
            rates[part, 1:pairs:2] = slopes[:, : rows.pairs]
            rates[part, pairs:] = slopes[:, rows.pairs :]
        return rates

    def run(self, legs: Legs) -> Ends:
        """The ends of ``legs``, run in one batch."""
        n, states, rows = len(legs), self.states, self.equations.rows
        if not n:
            touches = np.zeros((0, self.equations.columns // len(TOUCHES), len(TOUCHES)))
            return Ends(legs.state, np.zeros((0, states, states)), touches, np.zeros(0, dtype=bool), np.zeros(0))
        copies = np.where(legs.tangent, states, 1)
        leg = np.repeat(np.arange(n), copies)
        initial = np.concatenate([legs.state, legs.phase[:, None]], axis=1)
        runs = self.equations.runs(legs.values, initial)
        state_scales = runs.state_scales
        with np.errstate(divide="ignore", invalid="ignore"):
            requested = np.where(legs.angular, legs.duration / runs.phase_rate, legs.duration)
        is_valid = np.isfinite(requested) & (requested > 0.0)
        duration = np.where(is_valid, requested, MIN_DURATION)
        deviation = np.zeros((len(leg), states))
        first_copies = np.concatenate([[0], np.cumsum(copies)[:-1]])
        direction = np.arange(len(leg)) - first_copies[leg]
        has_tangent = legs.tangent[leg]
        deviation[has_tangent, direction[has_tangent]] = state_scales[leg[has_tangent], direction[has_tangent]]
        frame_rates = np.concatenate([runs.frame_rates, np.zeros_like(runs.frame_rates)], axis=1)
        expanded = Runs(
            runs.parameters[leg],
            np.concatenate([state_scales, TANGENT_TOLERANCE_FACTOR * state_scales], axis=1)[leg]
            * legs.tolerance_factor[leg, None],
            frame_rates[leg],
            runs.phase_rate[leg],
            np.minimum(runs.first_step, duration)[leg],
            np.concatenate([legs.state[leg], deviation, legs.phase[leg, None]], axis=1),
            np.zeros(len(leg)),
            duration[leg],
        )
        final_state, outcome, ok = self._run_all(expanded, len(leg))
        monodromy = np.zeros((n, states, states))
        columns = final_state[:, states : 2 * states]
        with np.errstate(invalid="ignore", over="ignore"):
            monodromy[leg[has_tangent], :, direction[has_tangent]] = (
                columns[has_tangent] / state_scales[leg[has_tangent], direction[has_tangent]][:, None]
            )
        touches = outcome.reshape(len(leg), -1, len(TOUCHES))[first_copies]
        succeeded = is_valid & ok[first_copies] & np.isfinite(final_state[first_copies, : rows.own]).all(axis=1)
        return Ends(final_state[first_copies, : rows.own], monodromy, touches, succeeded, duration)

    def _run_all(self, runs: Runs, n: int) -> tuple[Array, Array, Array]:
        """The final states and outcomes of all ``n`` runs, and whether each ended well,
        on as many threads as the runs fill."""
        threads = max(1, min(self.workers, n // (RUNS_PER_LANE * self.lanes)))
        if threads > 1 and self._pool is None:
            self._pool = ThreadPoolExecutor(self.workers - 1)
        # Interleaved, as neighbouring runs take about the same time.
        parts = [np.arange(first, n, threads) for first in range(threads)]
        futures = [self._pool.submit(self._run_batch, runs, part) for part in parts[1:]] if self._pool else []
        results = [self._run_batch(runs, parts[0]), *(future.result() for future in futures)]
        order = np.argsort(np.concatenate(parts))
        final_state, outcome, ok = (np.concatenate(arrays)[order] for arrays in zip(*results, strict=True))
        return final_state, outcome, ok

    def _run_batch(self, runs: Runs, part: Array) -> tuple[Array, Array, Array]:
        """The final states and outcomes of the runs ``part``, and whether each ended
        well."""
        rows, columns = self.equations.rows, self.equations.columns
        batch = Batch(self.lanes, len(part), rows, self.equations.store(), columns, self._settings)
        batch.add_many(np.arange(len(part)), runs[part])
        functions = self.equations.parts(self.lanes)
        final_state = np.zeros((len(part), rows.states + 1))
        outcome, ok = np.zeros((len(part), columns)), np.zeros(len(part), dtype=bool)
        remaining = len(part)
        while remaining:
            finished = batch.advance(functions, 60.0, True)
            final_state[finished.job], outcome[finished.job], ok[finished.job] = (
                finished.final,
                finished.outcome,
                finished.status == OK,
            )
            remaining -= len(finished.job)
        return final_state, outcome, ok


def equations_of(
    variant: Variant, symmetry: Symmetry, pack: Callable[[Array], Array], scales: tuple[float, ...]
) -> Equations:
    """The equations of a variant of a model: ``pack(values)`` gives the lane parameters at
    ``values`` [n, parameters]. InputError where the model has no tangent dynamics."""
    model, levels = variant.model, variant.levels
    contacts = len(model.contacts)
    observer_rows = landing_rows(contacts) + touch_rows(contacts + len(levels))
    try:
        rows = with_step(STEPPERS[PAIR], replace(variant.rows(observer_rows, tangent=True), judged=True))
        variant.tangent(choose_lanes(FEW), 0)
    except (NotImplementedError, ValueError) as error:
        raise InputError(
            f"the model {model.name}: found no linearised equations for this study "
            f"({str(error) or 'none are written'})"
            "; allowed: a study that has them, as continuation and Floquet multipliers need them."
        ) from None

    def runs(values: Array, initial: Array) -> Runs:
        return variant.runs(pack(values), initial)

    def parts(lanes: int) -> Compiled:
        return _parts(variant, lanes, rows)

    return Equations(
        rows,
        symmetry,
        scales,
        runs,
        parts,
        lambda: aligned_zeros(scratch_size(rows, contacts) + 1),
        model.contacts,
        tuple(level.name for level in levels),
    )


@lru_cache
def _parts(variant: Variant, lanes: int, rows: Layout) -> Compiled:
    contacts = len(variant.model.contacts)
    levels = tuple((level.velocity, level.parameter) for level in variant.levels)
    right_hand_side = variant.tangent(lanes, 0)
    touch_row = landing_rows(contacts)
    observe_levels, levels_marker = (
        make_levels(lanes, rows, touch_row + touch_rows(contacts), levels) if levels else unobserved()
    )
    if not contacts:
        return Compiled(right_hand_side, observe_levels, levels_marker)
    contact_functions = variant.contact_functions(lanes, RATES * contacts)
    land = make_landing(lanes, rows, STEPPERS[PAIR], 0, contact_functions, variant.tangent(1, 0), contacts, False)
    observe_touches, touches_marker = make_touches(lanes, rows, touch_row, 0, contacts)
    level_column = touch_rows(contacts)

    @compiled(OBSERVER)
    def observe_orbit(b, store):  # type: ignore[no-untyped-def]
        """Observe an accepted step of all lanes of the buffer ``b``."""
        contact_functions(b)
        observe_touches(b, store)
        observe_levels(b, store)
        land(b, store)

    @compiled(MARKER)
    def orbit_marker(b, store, i, mark, outcome, column):  # type: ignore[no-untyped-def]
        """Write the outcome of the lane ``i`` at a ``mark``, from ``column`` on."""
        touches_marker(b, store, i, mark, outcome, column)
        levels_marker(b, store, i, mark, outcome, column + level_column)

    return Compiled(right_hand_side, observe_orbit, orbit_marker)


# Many branches in lock step: the legs of one round run in one batch.


K = TypeVar("K", bound=Hashable)
T = TypeVar("T")
Task = Generator[Legs, Ends, T]


def gather(
    tasks: Mapping[K, Task[T]], watch: Callable[[Collection[K]], None] = lambda pending: None
) -> Task[dict[K, T]]:
    """One task that advances ``tasks``, generators that yield legs and are sent their
    ends, side by side, and returns their return values, by key. ``watch`` is called once
    a round, with the keys of those that have not returned."""
    results: dict[K, T] = {}
    pending: dict[K, Legs] = {}

    def resume(key: K, ends: Ends | None) -> None:
        try:
            pending[key] = tasks[key].send(ends)  # type: ignore[arg-type]
        except StopIteration as stop:
            pending.pop(key, None)
            results[key] = stop.value

    for key in tasks:
        resume(key, None)
    while pending:
        watch(pending)
        requests = list(pending.items())
        ends = yield joined([legs for _, legs in requests])
        first = 0
        for key, legs in requests:
            rows = slice(first, first + len(legs))
            first = rows.stop
            resume(key, ends[rows])
    return results


def advance(
    flow: Flow,
    tasks: Mapping[K, Task[T]],
    poll: Callable[[], None] = lambda: None,
    watch: Callable[[Collection[K]], None] = lambda pending: None,
) -> dict[K, T]:
    """The return values of ``tasks``, by key, as of :func:`gather`, their legs run by
    ``flow``. ``poll`` is called once a round, and may raise to stop."""
    every = gather(tasks, watch)
    try:
        legs = next(every)
        while True:
            poll()
            legs = every.send(flow.run(legs))
    except StopIteration as stop:
        found: dict[K, T] = stop.value
        return found
