"""What ``check`` shows of a drag bit on the surface that its blades leave
(:mod:`nsdrill.models.surface`), for every model that has one: steady cutting, the
thresholds, how many states the surface needs, and warnings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from nsdrill.models import surface
from nsdrill.models.blades import MOST_STATES, WIDEST_FLAT
from nsdrill.models.drive_laws import unknown_by_bend
from nsdrill.models.linear import growth, matrix_of, unstable_to
from nsdrill.models.numbers import DULL, FEW_STATES, DerivedQuantity, FormatValue
from nsdrill.models.steady import String

STICK_SLIP = ("stick_slip_onset", "stick_slip_period", "stick_slip_peak", "stick_slip_stuck", "slope_held")


class Cutting(NamedTuple):
    """A bit at an operating point: its blades and rock (:class:`.blades.Blades`), the
    ``key`` of their section in a study, its radius [m], the weight on it [N], the set speed
    [rad/s], the axial ``threshold`` of the string above it, and the ``greatest`` axial
    frequency that the rock feeds [rad/s]."""

    rock: Any
    key: str
    radius: float
    wob: float
    speed: float
    threshold: surface.Threshold
    greatest: float

    @property
    def cut(self) -> surface.Cut:
        """Steady cutting."""
        return surface.cut_of(self.rock, self.radius, self.wob, self.speed)

    @property
    def delay(self) -> float:
        """The time from one blade to the next [s]."""
        return 2.0 * math.pi / (self.rock.blades * self.speed)

    @property
    def theta(self) -> float:
        """The phase of the delay [rad] at the greatest axial frequency that the rock feeds."""
        return self.delay * self.greatest

    @property
    def states(self) -> int:
        """How many states the surface needs for it."""
        return surface.states_needed(self.theta)


def of_one_mass(
    rock: Any, key: str, radius: float, wob: float, speed: float, mass: float, stiffness: float, damping: float
) -> Cutting:
    """The bit of a string that is one axial mass [kg] on a spring [N/m] with a damper
    [N s/m]."""
    force = float(surface.cut_of(rock, radius, wob, speed).force)
    axial = mass, stiffness, damping, force
    threshold = surface.axial_threshold(*axial, int(rock.blades))
    return Cutting(rock, key, radius, wob, speed, threshold, surface.greatest_frequency(*axial))


def steady_threshold(bit: Cutting, string: String) -> float | None:
    """The set speed [rad/s] below which steady drilling is unstable, axial and torsional
    motion together; 0 where it is stable at every speed, infinite where at none, None below
    the weight that the wear flats bear, where nothing is cut."""
    return unstable_to(string, bit.threshold.speed or bit.speed) if bit.cut.depth > 0.0 else None


def stick_slip_lasts(bit: Cutting, string: String) -> tuple[float, None] | None:
    """The set speed [rad/s] below which steady drilling is unstable; up to which one
    stick-slip lasts, once begun, is not known of such a bit. None where nothing is cut."""
    threshold = steady_threshold(bit, string)
    return None if threshold is None or _bends(bit, string) else (threshold, None)


def _bends(bit: Cutting, string: String) -> bool:
    """Whether the drive bends at steady drilling, so that no linear theory holds there."""
    return string.bends(string.balance(bit.speed, bit.speed))


def stability(bit: Cutting, string: String) -> dict[str, DerivedQuantity]:
    """What is known of small deviations from steady drilling."""
    limit = steady_threshold(bit, string)
    (rate,), (frequency,) = growth(matrix_of(string, np.array([bit.speed])))
    drills = limit is not None
    found = {
        "steady_threshold": DerivedQuantity(
            None if limit is None or not 0.0 < limit < math.inf else limit,
            "rad/s",
            "speed above which steady drilling is stable, axial and torsional motion together",
            everywhere=limit == math.inf,
        ),
        "growth": DerivedQuantity(
            float(rate) if drills else None,
            "1/s",
            "rate at which the least stable deviation from steady drilling grows",
        ),
        "growth_frequency": DerivedQuantity(float(frequency) if drills else None, "rad/s", "its frequency"),
    }
    return unknown_by_bend(found) if _bends(bit, string) else found


def quantities(one: Cutting) -> dict[str, DerivedQuantity]:
    """The derived quantities of a bit. Below the weight that the wear flats bear nothing is
    cut."""
    cut, threshold = one.cut, one.threshold
    drills = bool(cut.depth > 0.0)
    depth, penetration = (float(cut.depth), float(cut.rate)) if drills else (None, None)
    return {
        "blade_depth": DerivedQuantity(depth, "m", "depth of cut of a blade in steady drilling", "axial"),
        "rate_of_penetration": DerivedQuantity(penetration, "m/s", "rate of penetration in steady drilling", "axial"),
        "wear_force": DerivedQuantity(float(cut.wear), "N", "weight that the wear flats bear", "axial"),
        "delay": DerivedQuantity(one.delay, "s", "time from one blade to the next", "axial"),
        "theta": DerivedQuantity(
            one.theta, "rad", "phase of the delay at the greatest axial frequency that the rock feeds", "axial"
        ),
        "states_needed": DerivedQuantity(
            float(one.states), "1", f"states of the surface that this phase needs ({one.key}.states)", "axial"
        ),
        "states_off_bottom": DerivedQuantity(
            float(surface.states_off_bottom(one.theta)),
            "1",
            "states that a motion off bottom needs, to 0.5 % and 3 % of its greatest depth of cut",
            "axial",
        ),
        "axial_threshold": DerivedQuantity(
            threshold.speed or None, "rad/s", "speed above which axial vibration never grows by itself", "axial"
        ),
        "axial_chatter": DerivedQuantity(
            threshold.frequency or None, "rad/s", "frequency of axial vibration at that speed", "axial"
        ),
    }


def without_fall(turning: Mapping[str, DerivedQuantity]) -> dict[str, DerivedQuantity]:
    """Quantities of a string that turns without those of stick-slip by a torque that falls
    with the speed of the bit, which here it does not."""
    return {name: value for name, value in turning.items() if not name.startswith(STICK_SLIP)}


def warnings(ones: Sequence[Cutting], format_value: FormatValue) -> list[str | None]:
    """Warnings of the bits at the ends of a study; None where there is nothing to warn of."""
    told: tuple[Callable[[Sequence[Cutting], FormatValue], str | None], ...] = (dull, _long_flats, few_states)
    return [one(ones, format_value) if ones else None for one in told]


def dull(ones: Sequence[Cutting], format_value: FormatValue) -> str | None:
    """The warning of wear flats that bear the whole weight."""
    excess, worst = max(((float(one.cut.wear) - one.wob, one) for one in ones), key=lambda entry: entry[0])
    if excess < 0.0 or worst.wob == 0.0:
        return None
    return (
        f"{DULL} the wear flats bear {format_value(float(worst.cut.wear), 'N', 'kN')}, and the weight on bit is "
        f"{format_value(worst.wob, 'N', 'kN')}: nothing is cut, and the bit does not advance. Raise the "
        f"weight, or lower {worst.key}.wear_length or {worst.key}.contact_stress."
    )


def _long_flats(ones: Sequence[Cutting], format_value: FormatValue) -> str | None:
    """The warning of flats that are longer than a cutter."""
    longest, worst = max(
        ((float(np.max(one.rock.wear_length)) / one.rock.blades, one) for one in ones), key=lambda entry: entry[0]
    )
    if longest <= WIDEST_FLAT:
        return None
    blades = worst.rock.blades
    return (
        f"Worn: {worst.key}.wear_length is {format_value(longest * blades, 'm', 'mm')} on {blades} blades, "
        f"{format_value(longest, 'm', 'mm')} on each: longer than a common cutter, whose diameter is "
        f"{format_value(WIDEST_FLAT, 'm', 'mm')}. It is the length of the flats of all blades together."
    )


def few_states(ones: Sequence[Cutting], format_value: FormatValue) -> str | None:
    """The warning of a surface with too few states for the delay."""
    worst = max(ones, key=lambda one: one.states - one.rock.states)
    needed, has, speed = worst.states, worst.rock.states, format_value(worst.speed, "rad/s", "rad/s")
    if needed <= has:
        return None
    remedy = f"Set {worst.key}.states: {needed}"
    if needed > MOST_STATES:
        remedy = f"Raise the rotary speed: {worst.key}.states is {MOST_STATES} at most"
    return (
        f"{FEW_STATES} at {speed} the delay from blade to blade is {worst.theta / math.pi:.3g} half periods of axial "
        f"vibration, which takes {needed} states of the surface to be right to 1 %, and {worst.key}.states is {has}: "
        f"axial vibration is damped too much there. {remedy}."
    )
