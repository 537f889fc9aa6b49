"""Systems with published periodic orbits, through the same code as drill strings."""

import numpy as np

from nsdrill.abi import Layout
from nsdrill.equations.library import sincos
from nsdrill.equations.motion import Motion
from nsdrill.kernel.batch import Compiled, Runs, unobserved
from nsdrill.kernel.steppers import STEPPERS, with_step
from nsdrill.models.base import Symmetry
from nsdrill.orbit.flow import Equations, Flow, advance
from nsdrill.orbit.newton import corrected_at_parameter


# States x, v and, of first order, w; the parameter a.
def roessler(t, phase, s, p, o):
    return {"x": -s.v - s.w, "v": s.x + 0.2 * s.v, "w": 0.2 + s.w * (s.x - p.a)}


def lorenz(t, phase, s, p, o):
    return {"x": 10.0 * (s.v - s.x), "v": s.x * (p.a - s.w) - s.v, "w": s.x * s.v - 8.0 / 3.0 * s.w}


def van_der_pol(t, phase, s, p, o):
    return {"v": p.a * (1 - s.x * s.x) * s.v - s.x}


def duffing(t, phase, s, p, o):
    _, cosine = sincos(phase + p.a * t)
    return {"v": 0.1 * cosine - 0.1 * s.v - s.x - s.x**3}


def mathieu(t, phase, s, p, o):
    _, cosine = sincos(2.0 * t)
    return {"v": -(p.a - 2.0 * cosine) * s.x}


def flow_of(equations, states: int, *, forced: bool = False, singles: int = 0, rtol: float = 1e-13) -> Flow:
    """The flow of a system with one parameter; ``forced``: it is the frequency of the
    forcing."""
    names = tuple("xvw"[:states])
    motion = Motion(equations, None, names, ("a",), names if singles else ("v",))
    rows = with_step(STEPPERS["tsitouras"], Layout(2 * states, 0, 1, 0, states, singles, judged=True))

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
        return Compiled(motion.tangent(lanes, rows, 0), *unobserved())

    symmetry = Symmetry(1 if forced else 0, tuple(range(states)))
    return Flow(Equations(rows, symmetry, (1.0,), runs, parts), rtol=rtol)


def at(flow, problem, x):
    """The converged point near the unknowns ``x``."""

    def job():
        return (yield from corrected_at_parameter(problem, x))

    return advance(flow, {0: job()})[0]
