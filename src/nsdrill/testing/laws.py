"""A law of friction against itself: its slope and fall against differences, its steepest
fall against a search."""

from __future__ import annotations

import numpy as np

from nsdrill.equations.trace import Named
from nsdrill.errors import InputError
from nsdrill.models.friction import Numbers, values
from nsdrill.script.physics import USUAL, laws
from nsdrill.testing.check_report import Report

SLIPS = np.array([0.01, 0.05, 0.3, 1.0, 4.0])
STEP = 1e-6
SMOOTHEST = 1e12  # smoothing beyond which none is left


def compare_law(name: str, report: Report) -> None:
    """The comparisons of the law of this name. InputError where there is none."""
    known = laws()
    if name not in known:
        raise InputError(f"check_law: found {name!r}; allowed: {', '.join(known)}, or one of nsdrill.law.")
    law, random = known[name], np.random.default_rng(1)
    # off their defaults, within their range
    own = {one: float(np.clip(v * random.uniform(0.8, 1.25), v.low, v.high)) for one, v in law.own.items()}

    def at(which: str, v: np.ndarray, numbers: Numbers = USUAL) -> np.ndarray:
        return np.asarray(values(law, which, v, numbers, own), float) + np.zeros(np.shape(v))

    def difference(which: str) -> np.ndarray:
        return (at(which, SLIPS + STEP) - at(which, SLIPS - STEP)) / (2 * STEP)

    report.add("slope against differences", np.max(np.abs(at("slope", SLIPS) - difference("coefficient"))), 1e-6)
    report.add("odd in the slip", np.max(np.abs(at("coefficient", SLIPS) + at("coefficient", -SLIPS))), 1e-12)
    if law.steep == "smoothing":
        sharp = at("coefficient", SLIPS, USUAL._replace(smoothing=SMOOTHEST))
        report.add("unsmoothed against no smoothing", np.max(np.abs(at("unsmoothed", SLIPS) - sharp)), 1e-6)
        report.add("fall against differences", np.max(np.abs(at("fall", SLIPS) + difference("unsmoothed"))), 1e-6)
    speeds = np.geomspace(1e-6, 1e3, 20_001)
    # a bound may forget one of the law's own numbers, which does not show beside its default
    ends = [{one: float(np.clip(factor * v, v.low, v.high))} for one, v in law.own.items() for factor in (0.1, 10.0)]
    above = []
    for numbers in ({}, *ends):
        here = own | numbers
        steepest = float(law.steepest_fall(Named(**USUAL._asdict(), **here)))
        falling = np.asarray(values(law, "coefficient", speeds, USUAL._replace(smoothing=SMOOTHEST), here), float)
        found = float(np.max(-np.gradient(falling + np.zeros(len(speeds)), speeds)))
        above.append((found - steepest - 1e-6) / max(steepest, 1e-9))
    report.add("fall above its bound", max(above), 1e-3)
