"""What ``check`` shows of a study of a string on a drag bit: coefficients, the thresholds
of steady drilling, how many states the surface needs, and warnings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from nsdrill.models import surface
from nsdrill.models.drilling import Drilling, drillings, overloaded, resting, stalling, swinging
from nsdrill.models.drives import LAWS, quantities_of_drive, reflection
from nsdrill.models.leaves import Values
from nsdrill.models.numbers import DerivedQuantity, FormatValue
from nsdrill.models.operation import Numeric, Operation
from nsdrill.models.regenerative import columns
from nsdrill.models.regenerative.linear import growth, matrix_of, unstable_to
from nsdrill.models.regenerative.model import Regenerative
from nsdrill.models.regenerative.parameters import Initial, Parameters
from nsdrill.models.responses import Thresholds
from nsdrill.models.steady import String, Turning
from nsdrill.ranges import computed, meanings_of

MODES = 2  # of string and drive among the derived quantities
STICK_SLIP = ("stick_slip_onset", "stick_slip_period", "stick_slip_peak", "stick_slip_stuck", "slope_held")


@dataclass(frozen=True)
class Coefficients:
    """The string as a whole, and the rock under its bit."""

    m_a: float = computed("kg", "axial mass")
    k_a: float = computed("N/m", "axial stiffness of the string")
    c_a: float = computed("N s/m", "axial damping")
    J: float = computed("kg m^2", "rotary inertia")
    k_t: float = computed("N m/rad", "torsional stiffness of the string")
    k_c: float = computed("N/m", "force of the rock per depth of cut of a blade")


COEFFICIENTS = meanings_of(Coefficients)


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """The coefficients at an operating point."""
    whole = columns.string_of(parameters.drillstring, operation.depth)
    cut = surface.cut_of(parameters.bit, operation.wob, operation.rotary_speed)
    order = (whole.mass, whole.stiffness, whole.damping, whole.inertia, whole.torsional, cut.force)
    return Coefficients(*map(float, order))


class Axial(NamedTuple):
    """Of axial vibration at an operating point: its ``threshold``, the ``delay`` from
    blade to blade [s], its phase ``theta`` [rad] at the greatest frequency that the rock
    feeds, and the ``states`` that the surface needs."""

    threshold: surface.Threshold
    delay: float
    theta: float
    states: int


def axial_at(parameters: Parameters, operation: Operation) -> Axial:
    """Axial vibration at an operating point."""
    one, blades = coefficients(parameters, operation), parameters.bit.blades
    delay = 2.0 * math.pi / (blades * operation.rotary_speed)
    theta = delay * surface.greatest_frequency(one.m_a, one.k_a, one.c_a, one.k_c)
    threshold = surface.axial_threshold(one.m_a, one.k_a, one.c_a, one.k_c, blades)
    return Axial(threshold, delay, theta, surface.states_needed(theta))


def drilling_at(parameters: Parameters, operation: Operation) -> Drilling:
    """Steady drilling at an operating point. The torque on the bit does not fall with its
    speed, so that stick-slip is not that of friction."""
    model, depth, wob, speed = Regenerative(), operation.depth, operation.wob, operation.rotary_speed
    variant = model.variant(parameters)

    def table(set_speed: Numeric) -> Mapping[str, Numeric]:
        return model.columns(Values(parameters, Initial(), (depth, wob, set_speed)), Thresholds())

    driven = not parameters.drive.ideal
    turning = Turning(
        ("lag", "twist") if driven else ("twist",), ("drive_speed", "bit_speed") if driven else ("bit_speed",)
    )
    rest = surface.steady(surface.cut_of(parameters.bit, wob, speed).depth, model.first_order(variant))
    whole, drive = columns.string_of(parameters.drillstring, depth), parameters.drive
    limited = driven and drive.torque_limit is not None and LAWS[drive.kind].limited
    return Drilling(
        String(model.motion(variant), turning, model.set_speed, table, rest),
        speed,
        wob,
        2 * float(parameters.bit.radius),
        math.sqrt(float(whole.torsional / whole.inertia)),
        float(whole.torsional),
        float(drive.torque_limit) if limited and drive.torque_limit is not None else None,
    )


def rates_at(parameters: Parameters, operation: Operation, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(rate [1/s], frequency [rad/s]) of the deviation from steady drilling that grows
    fastest, at set speeds [rad/s]; axial and torsional motion together."""
    model, wob = Regenerative(), operation.wob
    variant = model.variant(parameters)
    table = model.columns(Values(parameters, Initial(), (operation.depth, wob, speeds)), Thresholds())
    states: dict[str, Numeric] = dict.fromkeys(model.states(variant), 0.0 * speeds)
    states |= surface.steady(surface.cut_of(parameters.bit, wob, speeds).depth, model.first_order(variant))
    states |= {name: speeds for name in ("bit_speed", "drive_speed") if name in states}
    return growth(matrix_of(model.motion(variant), states, {**table}))


def steady_threshold(parameters: Parameters, operation: Operation) -> float | None:
    """The set speed [rad/s] below which steady drilling is unstable, axial and torsional
    motion together; 0 where it is stable at every speed, infinite where at none, None below
    the weight that the wear flats bear, where nothing is cut."""
    if surface.cut_of(parameters.bit, operation.wob, operation.rotary_speed).depth <= 0.0:
        return None
    about = axial_at(parameters, operation).threshold.speed or operation.rotary_speed
    return unstable_to(lambda speeds: rates_at(parameters, operation, speeds), about)


def stick_slip_lasts(values: Values) -> tuple[float, None] | None:
    """The set speed [rad/s] below which steady drilling is unstable; up to which one
    stick-slip lasts, once begun, is not known of this model. None where nothing is cut."""
    threshold = steady_threshold(values.parameters, values.point)
    return None if threshold is None else (threshold, None)


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point."""
    axial, drilling, drive = axial_at(parameters, operation), drilling_at(parameters, operation), parameters.drive
    cut = surface.cut_of(parameters.bit, operation.wob, operation.rotary_speed)
    whole = columns.string_of(parameters.drillstring, operation.depth)
    rate, frequency = (float(one[0]) for one in rates_at(parameters, operation, np.array([drilling.set_speed])))
    limit = steady_threshold(parameters, operation)
    drills = limit is not None
    depth, penetration = (float(cut.depth), float(cut.rate)) if drills else (None, None)
    quantities = {
        "depth_of_cut": DerivedQuantity(depth, "m", "depth of cut of a blade in steady drilling", "axial"),
        "rate_of_penetration": DerivedQuantity(penetration, "m/s", "rate of penetration in steady drilling", "axial"),
        "wear_force": DerivedQuantity(float(cut.wear), "N", "weight that the wear flats bear", "axial"),
        "delay": DerivedQuantity(axial.delay, "s", "time from one blade to the next", "axial"),
        "theta": DerivedQuantity(
            axial.theta, "rad", "phase of the delay at the greatest axial frequency that the rock feeds", "axial"
        ),
        "states_needed": DerivedQuantity(
            float(axial.states), "1", "states of the surface that this phase needs (bit.states)", "axial"
        ),
        "axial_threshold": DerivedQuantity(
            axial.threshold.speed or None, "rad/s", "speed below which axial vibration grows by itself", "axial"
        ),
        "axial_chatter": DerivedQuantity(
            axial.threshold.frequency or None, "rad/s", "frequency of axial vibration at that speed", "axial"
        ),
        "steady_threshold": DerivedQuantity(
            None if limit is None or not 0.0 < limit < math.inf else limit,
            "rad/s",
            "speed below which steady drilling is unstable, axial and torsional motion together",
            everywhere=limit == math.inf,
        ),
        "growth": DerivedQuantity(
            rate if drills else None, "1/s", "rate at which the least stable deviation from steady drilling grows"
        ),
        "growth_frequency": DerivedQuantity(frequency if drills else None, "rad/s", "its frequency"),
        "torsional": DerivedQuantity(drilling.frequency, "rad/s", "torsional frequency"),
    }
    quantities |= {
        name: value for name, value in drilling.quantities(fold=False).items() if not name.startswith(STICK_SLIP)
    }
    if drive.ideal:
        return quantities
    law, pipe = columns.law_of(parameters, whole), float(columns.impedance(parameters.drillstring))
    reflected = reflection(law, pipe, drilling.frequency)
    return quantities | quantities_of_drive(drive, drilling.matrix, drilling.torque, reflected, law, MODES)


def warnings(study: Any, corners: list[Values], format_value: FormatValue) -> list[str | None]:
    """Warnings of a study, whose ``corners`` are the values at the ends of all axes and
    ramps; None where there is nothing to warn of."""
    found = drillings(corners, lambda corner: drilling_at(corner.parameters, corner.point))
    return [
        _dull(corners, format_value),
        _long_flats(corners, format_value),
        _few_states(corners, format_value),
        overloaded(found, format_value),
        resting(found, format_value),
        stalling(found, format_value),
        swinging(study, found, format_value) if any(not one.parameters.drive.ideal for one in corners) else None,
        _constant_feed(corners),
    ]


def _dull(corners: list[Values], format_value: FormatValue) -> str | None:
    """The warning of wear flats that bear the whole weight."""
    borne = [(surface.cut_of(one.parameters.bit, one.point.wob, one.point.rotary_speed), one) for one in corners]
    excess, cut, corner = max(
        ((float(cut.wear) - one.point.wob, cut, one) for cut, one in borne), key=lambda entry: entry[0]
    )
    if excess < 0.0 or corner.point.wob == 0.0:
        return None
    return (
        f"Dull: the wear flats bear {format_value(float(cut.wear), 'N', 'kN')}, and the weight on bit is "
        f"{format_value(corner.point.wob, 'N', 'kN')}: nothing is cut, and the bit does not advance. Raise the "
        "weight, or lower bit.wear_length or bit.contact_stress."
    )


def _long_flats(corners: list[Values], format_value: FormatValue) -> str | None:
    """The warning of flats that are longer than a cutter."""
    longest, bit = max(
        (
            (float(np.max(one.parameters.bit.wear_length)) / one.parameters.bit.blades, one.parameters.bit)
            for one in corners
        ),
        key=lambda entry: entry[0],
    )
    if longest <= surface.WIDEST_FLAT:
        return None
    return (
        f"Worn: bit.wear_length is {format_value(longest * bit.blades, 'm', 'mm')} on {bit.blades} blades, "
        f"{format_value(longest, 'm', 'mm')} on each: longer than a common cutter, whose diameter is "
        f"{format_value(surface.WIDEST_FLAT, 'm', 'mm')}. It is the length of the flats of all blades together."
    )


def _few_states(corners: list[Values], format_value: FormatValue) -> str | None:
    """The warning of a surface with too few states for the delay."""
    asked = [(axial_at(one.parameters, one.point), one) for one in corners]
    axial, corner = max(asked, key=lambda entry: entry[0].states - entry[1].parameters.bit.states)
    has, speed = corner.parameters.bit.states, format_value(corner.point.rotary_speed, "rad/s", "rad/s")
    if axial.states <= has:
        return None
    remedy = f"Set bit.states: {axial.states}"
    if axial.states > surface.MOST_STATES:
        remedy = f"Raise the rotary speed: bit.states is {surface.MOST_STATES} at most"
    return (
        f"Few states: at {speed} the delay from blade to blade is {axial.theta / math.pi:.3g} half periods of axial "
        f"vibration, which takes {axial.states} states of the surface to be right to 1 %, and bit.states is {has}: "
        f"axial vibration is damped too much there. {remedy}."
    )


def _constant_feed(corners: list[Values]) -> str | None:
    """What a study without an axial spring means."""
    if any(
        float(np.min(columns.string_of(one.parameters.drillstring, one.operation[0]).stiffness)) > 0.0
        for one in corners
    ):
        return None
    return (
        "Constant hook load: drillstring.axial_stiffness is 0, so that the bit may advance faster or slower than in "
        "steady drilling; axial_min and axial_max then contain this drift."
    )


def longest_period(corners: list[Values]) -> float:
    """The longest torsional period [s] of these corners."""
    return 2 * math.pi / min(drilling_at(corner.parameters, corner.point).frequency for corner in corners)
