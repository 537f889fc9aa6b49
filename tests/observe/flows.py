"""Systems with published answers, run through nsdrill's own kernel: Lorenz and Roessler, with a deviation each.

A first-order system is one of pairs whose positions nobody looks at: the velocities are its variables.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.abi import BUFFER, Rows, compiled, inlined
from nsdrill.kernel.gang import Compiled, Finished, Gang
from nsdrill.kernel.settings import Simulation
from nsdrill.observe.exponent import GROWTH, REPORT, growth_header, make_growth, seed_deviation
from nsdrill.observe.interpolant import crossing, quintic, value

# Three parameters after the two that every model has, the drive phase and speed.
ROWS = Rows(12, 0, 5, len(GROWTH), 6)
UNSEEN = 1e100  # the size of a position: none of its errors counts


@inlined
def cubic(g0, d0, g1, d1):  # type: ignore[no-untyped-def]
    rise = g1 - g0
    return quintic(g0, d0, 6.0 * rise - 4.0 * d0 - 2.0 * d1, g1, d1, 2.0 * d0 + 4.0 * d1 - 6.0 * rise)


@lru_cache
def right_hand_side(lanes: int, roessler: bool) -> Any:
    W = lanes
    x_, y_, z_, dx_, dy_, dz_ = (W * (ROWS.stage + i) for i in (1, 3, 5, 7, 9, 11))
    ax_, ay_, az_, adx_, ady_, adz_ = (W * (ROWS.acceleration + i) for i in range(6))
    p_, q_, r_ = (W * (ROWS.parameter + i) for i in (2, 3, 4))

    @compiled(types.void(BUFFER), W, roessler)
    def slopes(b):  # type: ignore[no-untyped-def]
        for i in range(W):
            x, y, z, dx, dy, dz = b[x_ + i], b[y_ + i], b[z_ + i], b[dx_ + i], b[dy_ + i], b[dz_ + i]
            p, q, r = b[p_ + i], b[q_ + i], b[r_ + i]
            if roessler:  # a, b, c
                b[ax_ + i], b[ay_ + i], b[az_ + i] = -y - z, x + p * y, q + z * (x - r)
                b[adx_ + i], b[ady_ + i], b[adz_ + i] = -dy - dz, dx + p * dy, dz * (x - r) + z * dx
            else:  # sigma, rho, beta
                b[ax_ + i], b[ay_ + i], b[az_ + i] = p * (y - x), x * (q - z) - y, x * y - r * z
                b[adx_ + i], b[ady_ + i] = p * (dy - dx), dx * (q - z) - x * dz - dy
                b[adz_ + i] = dx * y + x * dy - r * dz

    return slopes


def run(roessler: bool, parameters: list[tuple[float, float, float]], start: tuple[float, float, float],
        simulation: Simulation, lanes: int, watch: tuple[Any, Any], store: np.ndarray, size: float = 10.0) -> Finished:
    """All the parameters side by side, from one start."""
    count = len(parameters)
    gang = Gang(lanes, count, ROWS, store, len(REPORT), simulation)
    table = np.zeros((count, 5))
    table[:, 2:] = parameters
    sizes = np.tile([UNSEEN, size] * 3, (count, 1))
    initial = np.zeros((count, 13))
    initial[:, 1:6:2] = start
    initial[:, 6:12] = seed_deviation(sizes)
    initial[:, 6:12:2] = 0.0
    gang.add_many(np.arange(count), table, np.tile(sizes, 2), np.zeros((count, 6)), np.full(count, 1e-3), initial)
    parts, done = Compiled(right_hand_side(lanes, roessler), *watch), []
    while not gang.idle:
        done.append(gang.advance(parts, 60.0, True))
    whole = Finished(**{name: np.concatenate([getattr(d, name) for d in done]) for name in vars(done[0])})
    order = np.argsort(whole.job)
    return Finished(**{name: values[order] for name, values in vars(whole).items()})


def exponents(roessler: bool, parameters: list[tuple[float, float, float]], start: tuple[float, float, float],
              simulation: Simulation, lanes: int = 1) -> np.ndarray:
    """The observer's columns, shape (runs, len(REPORT))."""
    watch = make_growth(lanes, ROWS, 0, 0)
    done = run(roessler, parameters, start, simulation, lanes, watch, growth_header(simulation.observe))
    assert (done.status == 1).all()
    return done.report


@lru_cache
def section_watch() -> tuple[Any, Any]:
    """An observer for one lane that notes (x, y, z) where y rises through zero, once the window is open."""
    start_, rate_, end_, end_rate_ = ROWS.start, ROWS.start_acceleration, ROWS.stage, ROWS.acceleration
    step_, moves_, window_ = ROWS.step, ROWS.moves, ROWS.window

    @compiled(types.void(BUFFER, BUFFER))
    def note_sections(b, store):  # type: ignore[no-untyped-def]
        if b[moves_] * b[window_] == 0.0 or not (b[start_ + 3] < 0.0 <= b[end_ + 3]):
            return
        h, count = b[step_], int(store[0])
        p0, p1, p2, p3, p4, p5 = cubic(b[start_ + 3], h * b[rate_ + 1], b[end_ + 3], h * b[end_rate_ + 1])
        theta = crossing(p0, p1, p2, p3, p4, p5)
        for k in range(3):
            p0, p1, p2, p3, p4, p5 = cubic(
                b[start_ + 2 * k + 1], h * b[rate_ + k], b[end_ + 2 * k + 1], h * b[end_rate_ + k])
            store[1 + 3 * count + k] = value(p0, p1, p2, p3, p4, p5, theta)
        store[0] = count + 1

    @compiled(types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64))
    def mark_nothing(b, store, i, mark, report, column):  # type: ignore[no-untyped-def]
        pass

    return note_sections, mark_nothing


def roessler_returns(a: float, b: float, c: float, simulation: Simulation) -> np.ndarray:
    """(x, y, z) at the returns to y = 0, rising, in the observed window: shape (returns, 3)."""
    store = np.zeros(1 + 3 * 5000)
    run(True, [(a, b, c)], (1.0, 1.0, 0.0), simulation, 1, section_watch(), store)
    return store[1 : 1 + 3 * int(store[0])].reshape(-1, 3)
