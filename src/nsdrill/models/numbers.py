"""The results of a model without integration, for ``check`` and charts: derived
quantities at a point, and curves along an axis."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models.operation import Numeric
from nsdrill.models.sections import Cutting
from nsdrill.observe.thresholds import LEAST_PEAKS, Record
from nsdrill.records import dataclass
from nsdrill.variables import feature

# Text of a value in SI units, from the value, its SI unit and the unit that is shown.
FormatValue = Callable[[float, str, str], str]
LEAST_PERIODS = 4  # of a study of branches, whose orbits are not taken from the observation
OFF_SPEED = 0.1  # of the set speed: a drive that is further from it does not turn as it is set
FOLD_ERROR = 1.02  # most by which continuation finds stick-slip beyond the fold: it was up to 1.6 %
DULL = "Dull:"  # how the warning of a bit that cuts nothing begins
FEW_STATES = "Few states:"  # how that of a surface with too few states begins
UNUSUAL = "Far from usual:"  # how that of numbers which are far from usual begins
LUMPED = "Lumped:"  # how that of a lumped string that is far from its first standing wave begins
BENDS = "Bends:"  # how the warning of a drive begins that bends at steady drilling
PULSE = "Pulse:"  # how that of pulses which steps may jump over begins
LOOSE = 1e-4  # the greatest relative tolerance of a step at which responses of the main model were those of 1e-6
FEW_PEAKS = "Few peaks:"  # how that of too few recorded peaks begins
NOT_EXACT = "Exponent:"  # likewise of exponents that steps make wrong
TOO_SHORT = "Short:"  # how the warnings of a short observation begin
LATE = "control of the drive begins at"  # what follows where it begins too late
HELIX = math.sqrt(2.0)  # load of the helix over that of the sinusoid


@dataclass(frozen=True)
class DerivedQuantity:
    """A number that follows from the parameters at one operating point: SI value (None
    where there is none), SI unit, meaning, and the group of quantities it belongs to,
    one of :data:`GROUPS`. A ``further`` one is shown only in the full list."""

    value: float | None
    units: str
    meaning: str
    group: str = "rotation"
    further: bool = False
    everywhere: bool = False
    """Whether it is a speed without an upper end: at every speed it is as ``meaning`` says
    of those below."""
    known: bool = True
    """Whether a value of None says that there is none; else it is not known."""


def few_peaks(kept: int) -> str | None:
    """The warning of runs that keep so few peaks that slow growth is not seen, None where they
    keep enough."""
    if kept >= LEAST_PEAKS:
        return None
    return (
        f"{FEW_PEAKS} record.peaks is {kept}, and of fewer than {LEAST_PEAKS} it is not known whether they keep "
        f"rising: a vibration that grows slowly counts as settled. The default is {Record.peaks}."
    )


def few_periods(study: Any, period: float) -> str | None:
    """The warning of an observation, or of a transient before it, that is short beside the
    longest torsional ``period`` [s] of a study, None where they are long enough or nothing
    is observed. It has a peak in each period, and too few do not show slow growth."""
    if study.ramped and not study.swept:
        return None
    least = LEAST_PERIODS if study.continuation is not None and not study.swept else LEAST_PEAKS
    if study.simulation.observe >= least * period:
        if study.simulation.transient >= period:
            return None
        return (
            f"{TOO_SHORT} the torsional period is {period:.3g} s at most, and the transient of "
            f"{study.simulation.transient:g} s is shorter: what is observed is still the start. Lengthen "
            "simulation.transient."
        )
    return (
        f"{TOO_SHORT} the torsional period is {period:.3g} s at most; an observation of "
        f"{study.simulation.observe:g} s has fewer than {least}, and slow growth is not seen. Lengthen "
        "simulation.observe."
    )


def begins_late(study: Any, begins: float) -> str | None:
    """The warning of a drive whose control ``begins`` [s] after the observation has begun, or
    not at all; None where it begins before, or nothing is observed."""
    transient = float(study.simulation.transient)
    end = transient + float(study.simulation.observe)
    if begins <= transient or (study.ramped and not study.swept):
        return None
    found = f"{TOO_SHORT} {LATE} {begins:g} s (drive.on_at), "
    remedy = "Set drive.on_at to 0 s, or lengthen simulation.transient beyond it."
    if begins < end:
        return (
            f"{found}within the observation, from {transient:g} to {end:g} s: results are partly of a string without "
            f"it. {remedy}"
        )
    return f"{found}and runs end at {end:g} s: no result is of a string with it. {remedy}"


GROUPS = {
    "axial": "Axial motion",
    "rotation": "Rotation and drive",
    "lateral": "Lateral motion",
    "buckling": "Buckling",
}


@dataclass(frozen=True)
class CriticalSpeeds:
    """Rotary speeds [rad/s] along ``x``, the values of ``axis`` [SI]: arrays
    [modes, values], NaN where there is none. ``lateral``: bending modes of 1, 2 and 3
    half waves over the span; ``torsional``: standing waves; ``axial``: standing waves
    divided by the ``lobes``, with the bit off the rock, and ``axial_on_rock`` with the
    bit on it; ``cutting``: on the surface that the blades leave the speed above which axial
    vibration never grows by itself [1 or 0, values]."""

    axis: str
    x: np.ndarray
    lobes: int
    lateral: np.ndarray
    torsional: np.ndarray
    axial: np.ndarray
    axial_on_rock: np.ndarray
    cutting: np.ndarray


@dataclass(frozen=True)
class DriveCard:
    """Drives and torsional waves, by the kind of drive: ``reflected`` is the share of
    the velocity of a wave that the drive reflects at each ``frequency`` [rad/s];
    ``held`` the steepest slope of friction with which it is stable [N m s/rad], also
    for drives that are not described by an impedance. ``waves`` are the standing waves
    of the string [rad/s]; ``own`` is the kind of the study's drive."""

    frequency: np.ndarray
    reflected: dict[str, np.ndarray]
    held: dict[str, float]
    waves: np.ndarray
    own: str


@dataclass(frozen=True)
class DriveTuning:
    """The steepest slope of friction with which a soft-torque drive is stable [N m
    s/rad], ``held`` [frequencies, matchings], by its ``matching`` in impedances of the
    pipe and its ``frequency`` [rad/s]. ``best`` are matching, frequency and slope of
    the best drive, ``lumped`` is the frequency of the string, ``own`` matching and
    frequency of the study's drive where it is of this kind."""

    matching: np.ndarray
    frequency: np.ndarray
    held: np.ndarray
    best: tuple[float, float, float]
    lumped: float
    own: tuple[float, float] | None


# Rate of penetration and mechanical specific energy.
# The models with rock share one law of the rate, ROP = c1 W sqrt(omega) + c2
# (Christoforou & Yigit 2003), in which the weight on bit W and the speed omega are means
# over the observation. The mean speed is that at the surface, which in the long run is
# that of the bit; with an ideal drive it is the set speed, and the rate is the one that
# defines the depth of cut. Of a bit that is stuck it is that of the bit. The axial
# motion of the bit does not add to the rate: it is measured from the mean surface of
# the rock.


DRILLED = (
    feature(
        "rate_of_penetration",
        "m s-1",
        "rate of penetration at the mean speed",
        "drilled",
        label="Rate of penetration",
        low=0.0,
    ),
    feature(
        "mechanical_specific_energy",
        "Pa",
        "mechanical specific energy, by the torque at the surface",
        "drilled",
        label="Mechanical specific energy",
        low=0.0,
    ),
)


def drilled(torque: Array, speed: Numeric, cutting: Cutting, wob: Numeric, bit_radius: Numeric) -> dict[str, Array]:
    """The variables :data:`DRILLED` of runs with these mean torques [N m] and speeds
    [rad/s] at the surface, each an array [n] of SI values.

    ``cutting`` has c1 and c2 of the law; ``wob`` [N], ``bit_radius`` [m] and, like
    these, ``speed`` are numbers or arrays [n]. The energy is W/A + 2 pi N T / (A ROP)
    (Teale 1965) with the torque at the surface, as on a rig, which is not only that of
    the bit. It is infinite where the bit does not advance.
    """
    rate = np.maximum(cutting.c1 * wob * np.sqrt(np.maximum(speed, 0.0)) + cutting.c2, np.zeros(np.shape(torque)))
    power = wob * rate + speed * torque
    per_length = np.divide(power, rate, out=np.full(np.shape(rate), np.inf), where=rate > 0.0)
    return {"rate_of_penetration": rate, "mechanical_specific_energy": per_length / (math.pi * bit_radius * bit_radius)}
