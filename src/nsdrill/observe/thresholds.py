"""The thresholds of the labels that any motion has, and what is recorded of it. Those of
the critical responses, and all together, are in :mod:`nsdrill.models.responses`."""

from __future__ import annotations

from typing import Literal

from nsdrill.ranges import Checked, option, parameter
from nsdrill.records import dataclass


@dataclass(frozen=True)
class Settled(Checked):
    """Settled: the two halves of the observation differ by less than ``tolerance`` (of
    each quantity's range), and its peaks do not keep rising by more."""

    tolerance: float = parameter(
        0.05,
        "",
        "R",
        "convention",
        high=100.0,
        meaning="Largest relative difference between the halves of the observation",
    )


@dataclass(frozen=True)
class Trust(Checked):
    """Trusted: the checks of a point give the same response, and the same features
    within ``tolerance`` (of the natural scale of each: gap, lobe amplitude, drive
    speed)."""

    tolerance: float = parameter(
        0.05,
        "",
        "R",
        "convention",
        high=100.0,
        meaning="Largest difference between a run and its checks, in natural scales",
    )


@dataclass(frozen=True)
class MotionThresholds(Checked):
    """The kind of motion, from the returns to the Poincare section.

    Two returns are the same where each state differs by less than ``absolute`` times
    its natural scale plus ``relative`` times its range; a period is at most
    ``longest_period`` returns. Without a period the motion is chaotic where the
    Lyapunov exponent, less twice its error, exceeds ``exponent`` [1/s], not settled yet
    where it lies more than twice its error below zero, and quasi-periodic where it is
    zero within twice its error and that is at most ``exponent_error`` [1/s]. Where the
    exponent was not measured, it is chaotic where the 0-1 test gives more than
    ``chaotic_above``, and quasi-periodic below ``regular_below``.
    """

    absolute: float = parameter(
        0.1,
        "",
        "R",
        "convention",
        low=1e-9,
        high=100.0,
        meaning="Two returns are the same within this many natural scales of the states",
    )
    relative: float = parameter(
        0.01, "", "R", "convention", high=100.0, meaning="Added to absolute: this part of the range of the returns"
    )
    longest_period: int = parameter(
        24, "", "R", "convention", low=1, high=1000, meaning="Longest period that is looked for, in returns"
    )
    exponent: float = parameter(
        0.002,
        "1/s",
        "R",
        "convention",
        high=1000.0,
        meaning="Chaotic where the Lyapunov exponent less two errors is above this",
    )
    exponent_error: float = parameter(
        0.01,
        "1/s",
        "R",
        "convention",
        high=1000.0,
        meaning="Quasi-periodic only where two errors of the exponent are below this",
    )
    chaotic_above: float = parameter(
        0.8,
        "",
        "Gottwald & Melbourne 2009",
        "convention",
        low=0.001,
        high=1.0,
        meaning="Chaotic above this result of the 0-1 test, where there is no exponent",
    )
    regular_below: float = parameter(
        0.3,
        "",
        "Gottwald & Melbourne 2009",
        "convention",
        low=0.001,
        high=1.0,
        meaning="Regular below this result of the 0-1 test, where there is no exponent",
    )


@dataclass(frozen=True)
class Attractors(Checked):
    """Attractors: two starts of an operating point are on the same one where their
    scaled features, and those of a chain of other starts between them, differ by less
    than ``tolerance`` (:mod:`nsdrill.analysis.attractors`). Attractors of neighbouring
    operating points may be one and have one number where their features and extremes
    differ by less than ``matching`` (:mod:`nsdrill.analysis.branch_numbers`)."""

    tolerance: float = parameter(
        0.05,
        "",
        "R: see Coexistence",
        "convention",
        low=1e-9,
        high=100.0,
        meaning="Two starts are on one attractor within this distance of their features",
    )
    matching: float = parameter(
        0.25,
        "",
        "R: see Coexistence",
        "convention",
        low=1e-9,
        high=100.0,
        meaning="Attractors of neighbouring operating points have one number within this distance",
    )


LEAST_PEAKS = 6  # of which it is told whether they keep rising


@dataclass(frozen=True)
class Record:
    """``peaks``: how many of the last local maxima are kept for each of bit position,
    bit speed (one a slip) and radius; ``poincare``: how many of the
    last returns to the Poincare ``section``, a revolution of the bit or a lobe;
    ``exponent``: whether the largest Lyapunov exponent is measured."""

    peaks: int = parameter(
        32,
        high=1000,
        meaning="Number of last local maxima that are kept of bit position, bit speed (one a slip) and radius",
    )
    poincare: int = parameter(0, high=10_000, meaning="Number of last returns to the Poincare section that are kept")
    section: Literal["revolution", "lobe"] = option("revolution", "Rotation of the bit between two returns")
    exponent: bool = option(False, "Measure the largest Lyapunov exponent")
