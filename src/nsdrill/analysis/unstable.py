"""Runs that follow a motion which the slightest disturbance leaves, by the Lyapunov exponent
that was measured of them: as at rest on an unstable rest, from which no error of a step takes
them."""

from __future__ import annotations

import math

import numpy as np

from nsdrill.analysis.counts import EXPONENT
from nsdrill.data import Answer, Array, Results, resolved_study
from nsdrill.errors import count
from nsdrill.variables import EQUILIBRIUM, OK, PERIODIC

ERROR = "lyapunov_error"
FOLLOWED = ("motion", EXPONENT, ERROR)  # the variables that unstable uses
STANDARD_ERRORS = 3.0
LEAST_GROWTH = math.log(10.0)  # of a deviation over the observation


def unstable(results: Results) -> Array:
    """Which of the runs that ended well rest or repeat, while a deviation from them grew over
    the observation, tenfold at least: bool on the grid. Nowhere in results without exponents."""
    simulation = resolved_study(results.attrs).get("simulation")
    if simulation is None or any(name not in results.variables for name in FOLLOWED):
        return np.zeros(results.shape, dtype=bool)
    observe = float(simulation["observe"])
    motion, exponent, error = (np.asarray(results[name]) for name in FOLLOWED)
    return (np.asarray(results["status"]) == OK) & is_unstable(motion, exponent, error, observe)


def is_unstable(motion: Array, exponent: Array, error: Array, observe: float) -> Array:
    """The rule of :func:`unstable`, of kinds of motion, exponents with their errors [1/s], and
    the time of the observation [s]."""
    with np.errstate(invalid="ignore"):
        grows = (exponent - STANDARD_ERRORS * error) * observe > LEAST_GROWTH
    return np.asarray(grows & np.isin(motion, (EQUILIBRIUM, PERIODIC)))


def runs_unstable(results: Results) -> Answer:
    """In how many (``runs``) of the runs that ended well (``of``) the motion is unstable, and the
    ``least`` and ``greatest`` exponent [1/s] of these; empty where in none."""
    found = unstable(results)
    if not found.any():
        return {}
    exponents = np.asarray(results[EXPONENT])[found]
    return {
        "runs": int(found.sum()),
        "of": int(np.count_nonzero(np.asarray(results["status"]) == OK)),
        "least": float(exponents.min()),
        "greatest": float(exponents.max()),
    }


def unstable_words(found: Answer) -> str:
    """What :func:`runs_unstable` has found, in words."""
    return (
        f"in {found['runs']} of {count(found['of'], 'run')} the motion rests or repeats, and a deviation from it grows "
        f"(lyapunov_exponent up to {found['greatest']:.3g} 1/s): the slightest disturbance ends it, and what comes "
        "then was not run. Such a run without a response is not known. Start it beside that motion (initial)"
    )
