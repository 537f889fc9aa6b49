"""Systems with published periodic orbits, through the same code as drill strings."""

from __future__ import annotations

import numpy as np

from nsdrill.abi import Rows
from nsdrill.elementary import sincos
from nsdrill.kernel.batch import Compiled, Runs
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.models.base import Symmetry
from nsdrill.orbit.arclength import corrected_at_parameter
from nsdrill.orbit.flow import Equations, Flow
from nsdrill.orbit.lockstep import advance
from nsdrill.scalar import in_lanes, unobserved


def roessler(t, y, p):
    x, v, w = y
    (c,) = p
    return -v - w, x + 0.2 * v, 0.2 + w * (x - c)


def lorenz(t, y, p):
    x, v, w = y
    (r,) = p
    return 10.0 * (v - x), x * (r - w) - v, x * v - 8.0 / 3.0 * w


def van_der_pol(t, y, p):
    x, v = y
    (mu,) = p
    return (mu * (1 - x * x) * v - x,)


def duffing(t, y, p, phase):
    x, v = y
    (w,) = p
    _, cosine = sincos(phase + w * t)
    return (0.1 * cosine - 0.1 * v - x - x * x * x,)


def mathieu(t, y, p):
    x, _ = y
    (a,) = p
    _, cosine = sincos(2.0 * t)
    return (-(a - 2.0 * cosine) * x,)


def flow_of(
    slopes, states: int, *, forced: bool = False, singles: int = 0, rtol: float = 1e-13
) -> Flow:
    """The flow of a system with one parameter; ``forced``: it is the frequency of the
    forcing."""
    rows = STEPPERS["tsitouras"].rows(Rows(2 * states, 0, 1, 0, states, singles, judged=True))

    def runs(values, initial):
        n = len(values)
        return Runs(
            np.asarray(values, dtype=float).reshape(n, 1),
            np.ones((n, states)),
            np.zeros((n, rows.own_slopes)),
            np.asarray(values)[:, 0] if forced else np.ones(n),
            np.full(n, 1e-4),
            initial,
        )

    def parts(lanes):
        return Compiled(in_lanes(slopes, lanes, rows), *unobserved(lanes))

    symmetry = Symmetry(1 if forced else 0, tuple(range(states)))
    return Flow(Equations(rows, symmetry, (1.0,), runs, parts), rtol=rtol)


def at(flow, problem, x):
    """The converged point near the unknowns ``x``."""

    def job():
        return (yield from corrected_at_parameter(problem, x))

    return advance(flow, {0: job()})[0]
