"""Runs that follow a motion which the slightest disturbance leaves, by the Lyapunov exponent
that was measured of them: as at rest on an unstable rest, from which no error of a step takes
them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.analysis.counts import EXPONENT
from nsdrill.data import Answer, Array, Attributes, Results, resolved_study
from nsdrill.errors import count
from nsdrill.models.model_description import Description
from nsdrill.models.registry import model_in
from nsdrill.variables import EQUILIBRIUM, OK, PERIODIC, UNDETERMINED

ERROR = "lyapunov_error"
FOLLOWED = ("motion", EXPONENT, ERROR)  # the variables that unstable uses, beside those of resting
STANDARD_ERRORS = 3.0
LEAST_GROWTH = math.log(10.0)  # of a deviation over the observation
LEAST_FROM_REST = 0.05  # the same at rest, where the exponent is not that of a part of a motion


AT_REST = 1e-9  # of its magnitude, by which a quantity at rest may move


def unstable(results: Results) -> Array:
    """Which of the runs that ended well rest or repeat, while a deviation from them grew over
    the observation, of one that repeats tenfold at least: bool on the grid. Nowhere in results
    without exponents."""
    found = unstable_in(results.variables, results.attrs)
    if found is None:
        return np.zeros(results.shape, dtype=bool)
    return np.asarray((np.asarray(results["status"]) == OK) & found)


def unstable_in(variables: Mapping[str, Any], attrs: Attributes) -> Array | None:
    """The rule of :func:`unstable`, of results with these ``variables`` and root attributes, whatever
    became of the runs; None of those without exponents."""
    if any(name not in variables for name in FOLLOWED[1:]):
        return None
    motion = motion_of(variables, attrs)
    if motion is None:
        return None
    exponent, error = (np.asarray(variables[name]) for name in FOLLOWED[1:])
    return is_unstable(motion, exponent, error, observed_for(attrs))


def resting(model: Description) -> tuple[str, ...]:
    """The extremes by which runs of a model rest that has no section, and so no kinds of motion."""
    names = [] if model.section else [one.name for one in model.features]
    lows = [f"{name.removesuffix('_max')}_min" for name in names if name.endswith("_max")]
    return tuple(end for low in lows if low in names for end in (low, f"{low.removesuffix('_min')}_max"))


def motion_of(variables: Mapping[str, Any], attrs: Attributes) -> Array | None:
    """The kinds of motion of results with these ``variables`` and root attributes; without a section only
    whether all that moves rests; None where that is not there either."""
    if FOLLOWED[0] in variables:
        return np.asarray(variables[FOLLOWED[0]])
    ends = [name for name in resting(model_in(attrs)) if name in variables]
    if not ends:
        return None
    pairs = [[np.asarray(variables[name]) for name in pair] for pair in zip(ends[::2], ends[1::2], strict=True)]
    rests = [high - low <= AT_REST * np.maximum(np.abs(low), np.abs(high)) for low, high in pairs]
    return np.where(np.all(rests, axis=0), EQUILIBRIUM, UNDETERMINED)


def observed_for(attrs: Attributes) -> float:
    """How long motions were observed in results with these root attributes [s]; 0 where they do not
    say."""
    simulation = resolved_study(attrs).get("simulation", {})
    return float(simulation.get("observe", 0.0))


def is_unstable(motion: Array, exponent: Array, error: Array, observe: float) -> Array:
    """The rule of :func:`unstable`, of kinds of motion, exponents with their errors [1/s], and
    the time of the observation [s]."""
    with np.errstate(invalid="ignore"):
        growth = (exponent - STANDARD_ERRORS * error) * observe
        from_rest = (motion == EQUILIBRIUM) & (growth > LEAST_FROM_REST)
        return np.asarray(from_rest | ((motion == PERIODIC) & (growth > LEAST_GROWTH)))


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
