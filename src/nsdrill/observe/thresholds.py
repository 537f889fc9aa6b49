"""The thresholds at which a response counts as critical. All but ``stuck_below`` can be
changed on a finished file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from nsdrill.ranges import Checked, option, parameter, section


@dataclass(frozen=True)
class BitBounce(Checked):
    """Bit-bounce: the bit is off the rock for more than ``lift_off_fraction`` of the
    time.

    The other bounds grade it by the same fraction f. While in contact the bit bears on
    average 1/(1 - f) times the weight on bit, as the two balance over a long time: 1.1
    times at the second bound, 1.4 and 2.5 times at the last two.
    """

    lift_off_fraction: float = parameter(
        0.01,
        "",
        "R: one percent of the time",
        "convention",
        high=1.0,
        meaning="Bit-bounce above this fraction of time off the rock",
    )
    light_fraction: float = parameter(
        0.01,
        "",
        "R: as the response",
        "convention",
        high=1.0,
        meaning="Severity light above this fraction of time off the rock",
    )
    moderate_fraction: float = parameter(0.1, "", "R", "convention", high=1.0, meaning="Severity moderate above this")
    strong_fraction: float = parameter(0.3, "", "R", "convention", high=1.0, meaning="Severity strong above this")
    severe_fraction: float = parameter(0.6, "", "R", "convention", high=1.0, meaning="Severity severe above this")


@dataclass(frozen=True)
class StickSlip(Checked):
    """Stick-slip: the index (max - min) / (2 mean) exceeds ``stick_slip_index``
    percent, the onset of full stall.

    The other bounds are those of the severity table of the directional-drilling paper
    (D): below the first negligible vibration, then torsional oscillation, then medium
    (mitigate), onset of full stall, severe.
    """

    stick_slip_index: float = parameter(
        80.0,
        "percent",
        "D: onset of full stall",
        "convention",
        low=0.01,
        high=1e5,
        meaning="Stick-slip above this index, (max - min) / (2 mean) of the bit speed",
    )
    oscillation_index: float = parameter(
        40.0, "percent", "D", "convention", low=0.01, high=1e5, meaning="Severity torsional oscillation above this"
    )
    medium_index: float = parameter(
        60.0, "percent", "D", "convention", low=0.01, high=1e5, meaning="Severity medium above this"
    )
    stall_index: float = parameter(
        80.0, "percent", "D", "convention", low=0.01, high=1e5, meaning="Severity onset of full stall above this"
    )
    severe_index: float = parameter(
        100.0, "percent", "D", "convention", low=0.01, high=1e5, meaning="Severity severe above this"
    )


@dataclass(frozen=True)
class Whirl(Checked):
    """Whirl: the collar is on the wall for more than ``wall_contact_fraction`` of the
    time.

    Its kind: backward rolling where the rolling ratio is within ``rolling_tolerance``
    of one and the contact lasts at least ``rolling_contact`` of the time; else forward
    or backward by the sign of the whirl ratio, and irregular where that is below
    ``direction`` in size.

    The accelerations [m/s^2] grade it by the r.m.s. lateral acceleration of the collar,
    on the wall or not, which is what a downhole tool measures: about a quarter, a half,
    three quarters and one standard gravity. Each manufacturer of tools has its own
    table; these four are a convention to be adapted.
    """

    wall_contact_fraction: float = parameter(
        0.01,
        "",
        "R: one percent of the time",
        "convention",
        high=1.0,
        meaning="Whirl above this fraction of time on the wall",
    )
    rolling_tolerance: float = parameter(
        0.1,
        "",
        "R",
        "convention",
        high=100.0,
        meaning="Backward rolling within this distance of a rolling ratio of one",
    )
    rolling_contact: float = parameter(
        0.5, "", "R", "convention", high=1.0, meaning="Least fraction of time on the wall for backward rolling"
    )
    direction: float = parameter(
        0.1, "", "R", "convention", high=1000.0, meaning="Irregular below this size of the whirl ratio"
    )
    light_acceleration: float = parameter(
        2.5,
        "m/s^2",
        "R: a quarter of g",
        "convention",
        high=1e5,
        meaning="Severity light above this r.m.s. lateral acceleration",
    )
    moderate_acceleration: float = parameter(
        5.0, "m/s^2", "R: half of g", "convention", high=1e5, meaning="Severity moderate above this"
    )
    strong_acceleration: float = parameter(
        7.5, "m/s^2", "R: three quarters of g", "convention", high=1e5, meaning="Severity strong above this"
    )
    severe_acceleration: float = parameter(
        10.0, "m/s^2", "R: g", "convention", high=1e5, meaning="Severity severe above this"
    )


@dataclass(frozen=True)
class Settled(Checked):
    """Settled: the two halves of the observation differ by less than ``tolerance`` (of
    each quantity's range)."""

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
class Motion(Checked):
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
    differ by less than ``matching`` (:mod:`nsdrill.analysis.branches`)."""

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


@dataclass(frozen=True)
class Thresholds(Checked):
    """All thresholds; ``stuck_below`` [rad/s] is the bit speed under which the bit
    counts as stuck."""

    bit_bounce: BitBounce = section(BitBounce, "Bit-bounce; the bounds of its severity must ascend")
    stick_slip: StickSlip = section(StickSlip, "Stick-slip; the bounds of its severity must ascend")
    whirl: Whirl = section(Whirl, "Whirl; the bounds of its severity must ascend")
    settled: Settled = section(Settled, "Settled motion")
    trust: Trust = section(Trust, "Trust, where points were checked")
    motion: Motion = section(Motion, "Kind of motion, from the returns to the Poincare section")
    attractors: Attractors = section(Attractors, "Attractors, where every operating point has several starts")
    stuck_below: float = parameter(
        5 * math.pi / 30,
        "rad/s",
        "field practice: bit-stuck time below 5 rpm",
        "high",
        low=1e-6,
        high=1e3,
        meaning="Bit speed at or below which the bit is stuck",
    )


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
