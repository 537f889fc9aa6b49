"""The thresholds at which a response counts as critical. All but ``stuck_below`` can be
changed on a finished file."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from nsdrill.ranges import Checked, parameter


@dataclass(frozen=True)
class BitBounce(Checked):
    """Bit-bounce: the bit is off the rock for more than ``lift_off_fraction`` of the
    time.

    The other bounds grade it by the same fraction f. While in contact the bit bears on
    average 1/(1 - f) times the weight on bit, as the two balance over a long time: 1.1
    times at the second bound, 1.4 and 2.5 times at the last two.
    """

    lift_off_fraction: float = parameter(0.01, "", "R: one percent of the time", "convention", high=1.0)
    light_fraction: float = parameter(0.01, "", "R: as the response", "convention", high=1.0)
    moderate_fraction: float = parameter(0.1, "", "R", "convention", high=1.0)
    strong_fraction: float = parameter(0.3, "", "R", "convention", high=1.0)
    severe_fraction: float = parameter(0.6, "", "R", "convention", high=1.0)


@dataclass(frozen=True)
class StickSlip(Checked):
    """Stick-slip: the index (max - min) / (2 mean) exceeds ``stick_slip_index``
    percent, the onset of full stall.

    The other bounds are those of the severity table of the directional-drilling paper
    (D): below the first negligible vibration, then torsional oscillation, then medium
    (mitigate), onset of full stall, severe.
    """

    stick_slip_index: float = parameter(80.0, "percent", "D: onset of full stall", "convention", low=0.01, high=1e5)
    oscillation_index: float = parameter(40.0, "percent", "D", "convention", low=0.01, high=1e5)
    medium_index: float = parameter(60.0, "percent", "D", "convention", low=0.01, high=1e5)
    stall_index: float = parameter(80.0, "percent", "D", "convention", low=0.01, high=1e5)
    severe_index: float = parameter(100.0, "percent", "D", "convention", low=0.01, high=1e5)


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

    wall_contact_fraction: float = parameter(0.01, "", "R: one percent of the time", "convention", high=1.0)
    rolling_tolerance: float = parameter(0.1, "", "R", "convention", high=100.0)
    rolling_contact: float = parameter(0.5, "", "R", "convention", high=1.0)
    direction: float = parameter(0.1, "", "R", "convention", high=1000.0)
    light_acceleration: float = parameter(2.5, "m/s^2", "R: a quarter of g", "convention", high=1e5)
    moderate_acceleration: float = parameter(5.0, "m/s^2", "R: half of g", "convention", high=1e5)
    strong_acceleration: float = parameter(7.5, "m/s^2", "R: three quarters of g", "convention", high=1e5)
    severe_acceleration: float = parameter(10.0, "m/s^2", "R: g", "convention", high=1e5)


@dataclass(frozen=True)
class Settled(Checked):
    """Settled: the two halves of the observation differ by less than ``tolerance`` (of
    each quantity's range)."""

    tolerance: float = parameter(0.05, "", "R", "convention", high=100.0)


@dataclass(frozen=True)
class Trust(Checked):
    """Trusted: the checks of a point give the same response, and the same features
    within ``tolerance`` (of the natural scale of each: gap, lobe amplitude, drive
    speed)."""

    tolerance: float = parameter(0.05, "", "R", "convention", high=100.0)


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

    absolute: float = parameter(0.1, "", "R", "convention", low=1e-9, high=100.0)
    relative: float = parameter(0.01, "", "R", "convention", high=100.0)
    longest_period: int = parameter(24, "", "R", "convention", low=1, high=1000)
    exponent: float = parameter(0.002, "1/s", "R", "convention", high=1000.0)
    exponent_error: float = parameter(0.01, "1/s", "R", "convention", high=1000.0)
    chaotic_above: float = parameter(0.8, "", "Gottwald & Melbourne 2009", "convention", low=0.001, high=1.0)
    regular_below: float = parameter(0.3, "", "Gottwald & Melbourne 2009", "convention", low=0.001, high=1.0)


@dataclass(frozen=True)
class Attractors(Checked):
    """Attractors: two starts of an operating point are on the same one where their
    scaled features, and those of a chain of other starts between them, differ by less
    than ``tolerance`` (:mod:`nsdrill.analysis.attractors`). Attractors of neighbouring
    operating points may be one and have one number where their features and extremes
    differ by less than ``matching`` (:mod:`nsdrill.analysis.branches`)."""

    tolerance: float = parameter(0.05, "", "R: see Coexistence", "convention", low=1e-9, high=100.0)
    matching: float = parameter(0.25, "", "R: see Coexistence", "convention", low=1e-9, high=100.0)


@dataclass(frozen=True)
class Thresholds(Checked):
    """All thresholds; ``stuck_below`` [rad/s] is the bit speed under which the bit
    counts as stuck."""

    bit_bounce: BitBounce = field(default_factory=BitBounce)
    stick_slip: StickSlip = field(default_factory=StickSlip)
    whirl: Whirl = field(default_factory=Whirl)
    settled: Settled = field(default_factory=Settled)
    trust: Trust = field(default_factory=Trust)
    motion: Motion = field(default_factory=Motion)
    attractors: Attractors = field(default_factory=Attractors)
    stuck_below: float = parameter(
        5 * math.pi / 30, "rad/s", "field practice: bit-stuck time below 5 rpm", "high", low=1e-6, high=1e3
    )


@dataclass(frozen=True)
class Record:
    """``peaks``: how many of the last local maxima are kept for each of bit position,
    bit speed (one a slip) and radius; ``poincare``: how many of the
    last returns to the Poincare ``section``, a revolution of the bit or a lobe;
    ``exponent``: whether the largest Lyapunov exponent is measured."""

    peaks: int = parameter(32, high=1000)
    poincare: int = parameter(0, high=10_000)
    section: Literal["revolution", "lobe"] = "revolution"
    exponent: bool = False
