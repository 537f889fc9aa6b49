"""Systems with published answers, run through nsdrill's own kernel: Lorenz and
Roessler, with a deviation each."""

from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.abi import MARKER, OBSERVER, Layout
from nsdrill.compiler.functions import BUFFER, compiled, inlined
from nsdrill.equations.motion import Motion
from nsdrill.kernel.batch import Batch, Compiled, FinishedRuns, Runs
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS, with_step
from nsdrill.observe.contacts import make_landing, scratch_size
from nsdrill.observe.exponent import GROWTH, GROWTH_COLUMNS, growth_header, make_growth, seed_deviation
from nsdrill.observe.inside import crossing, quintic, value

# Three states of first order and as many tangent states; three parameters.
ROWS = with_step(STEPPERS["tsitouras"], Layout(6, 0, 3, len(GROWTH), 3, singles=3))


@inlined
def cubic(g0, d0, g1, d1):
    rise = g1 - g0
    return quintic(g0, d0, 6.0 * rise - 4.0 * d0 - 2.0 * d1, g1, d1, 2.0 * d0 + 4.0 * d1 - 6.0 * rise)


def lorenz(t, phase, s, p, o):
    return {"x": p.a * (s.y - s.x), "y": s.x * (p.b - s.z) - s.y, "z": s.x * s.y - p.c * s.z}


def roessler(t, phase, s, p, o):
    return {"x": -s.y - s.z, "y": s.x + p.a * s.y, "z": p.b + s.z * (s.x - p.c)}


@lru_cache
def right_hand_side(lanes: int, is_roessler: bool) -> Any:
    equations = roessler if is_roessler else lorenz
    return Motion(equations, None, tuple("xyz"), tuple("abc"), tuple("xyz")).tangent(lanes, ROWS, 0)


def run(
    is_roessler: bool,
    parameters: list[tuple[float, float, float]],
    start: tuple[float, float, float],
    simulation: Simulation,
    lanes: int,
    watch: tuple[Any, Any],
    store: np.ndarray,
    size: float = 10.0,
) -> FinishedRuns:
    """All the parameters side by side, from one start."""
    count = len(parameters)
    batch = Batch(lanes, count, ROWS, store, len(GROWTH_COLUMNS), simulation)
    state_scales = np.full((count, 3), size)
    initial = np.zeros((count, 7))
    initial[:, :3] = start
    initial[:, 3:6] = seed_deviation(state_scales)
    batch.add_many(
        np.arange(count),
        Runs(
            np.array(parameters),
            np.tile(state_scales, 2),
            frame_rates=np.zeros((count, 6)),
            phase_rate=np.zeros(count),
            first_step=np.full(count, 1e-3),
            initial=initial,
        ),
    )
    parts, done = Compiled(right_hand_side(lanes, is_roessler), *watch), []
    while not batch.idle:
        done.append(batch.advance(parts, 60.0, True))
    whole = FinishedRuns(**{name: np.concatenate([getattr(d, name) for d in done]) for name in vars(done[0])})
    order = np.argsort(whole.job)
    return FinishedRuns(**{name: values[order] for name, values in vars(whole).items()})


def exponents(
    is_roessler: bool,
    parameters: list[tuple[float, float, float]],
    start: tuple[float, float, float],
    simulation: Simulation,
    lanes: int = 8,
) -> np.ndarray:
    """The observer's columns, shape (runs, len(GROWTH_COLUMNS))."""
    store = np.concatenate([growth_header(simulation.observe), np.zeros(scratch_size(ROWS, 0))])
    done = run(is_roessler, parameters, start, simulation, lanes, deviation_watch(lanes, is_roessler), store)
    assert (done.status == 1).all()
    return done.outcome


@lru_cache
def deviation_watch(lanes: int, is_roessler: bool) -> tuple[Any, Any]:
    """An observer that corrects the deviation and measures its growth."""
    growth, marker = make_growth(lanes, ROWS, 0, 0)
    tangent = right_hand_side(1, is_roessler)

    @compiled(BUFFER)
    def measure(b):
        pass

    landing = make_landing(lanes, ROWS, STEPPERS["tsitouras"], len(GROWTH), measure, tangent, 0, True)

    @compiled(OBSERVER)
    def observe(b, store):
        landing(b, store)
        growth(b, store)

    return observe, marker


@lru_cache
def section_watch() -> tuple[Any, Any]:
    """An observer for one lane that notes (x, y, z) where y rises through zero, once
    the window is open."""
    start_, rate_, end_, end_rate_ = (ROWS.start, ROWS.start_acceleration, ROWS.stage, ROWS.acceleration)
    step_, moves_, observing_ = ROWS.step, ROWS.moves, ROWS.observing

    @compiled(BUFFER, BUFFER)
    def note_sections(b, store):
        if b[moves_] * b[observing_] == 0.0 or not (b[start_ + 1] < 0.0 <= b[end_ + 1]):
            return
        h, count = b[step_], int(store[0])
        theta = crossing(cubic(b[start_ + 1], h * b[rate_ + 1], b[end_ + 1], h * b[end_rate_ + 1]), 0.0, 1.0)
        for k in range(3):
            coordinate = cubic(b[start_ + k], h * b[rate_ + k], b[end_ + k], h * b[end_rate_ + k])
            store[1 + 3 * count + k] = value(coordinate, theta)
        store[0] = float(count + 1)

    @compiled(MARKER)
    def mark_nothing(b, store, i, mark, report, column):
        pass

    return note_sections, mark_nothing


def roessler_returns(a: float, b: float, c: float, simulation: Simulation) -> np.ndarray:
    """(x, y, z) at the returns to y = 0, rising, in the observation: shape
    (returns, 3)."""
    store = np.zeros(1 + 3 * 5000)
    run(True, [(a, b, c)], (1.0, 1.0, 0.0), simulation, 1, section_watch(), store)
    return store[1 : 1 + 3 * int(store[0])].reshape(-1, 3)
