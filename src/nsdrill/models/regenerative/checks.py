"""What ``check`` shows of a study of a string on a drag bit: coefficients, the thresholds
of steady drilling, how many states the surface needs, and warnings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nsdrill.models import cutting
from nsdrill.models.aggressive import PDC, Found, aggressive, operated
from nsdrill.models.cutting import Cutting
from nsdrill.models.deciding import deciding as of_study
from nsdrill.models.deciding import of_surface
from nsdrill.models.drilling import Drilling, drillings, drooping, overloaded, resting, stalling, swinging
from nsdrill.models.numbers import DerivedQuantity, FormatValue
from nsdrill.models.operation import Numeric, Operation, Values
from nsdrill.models.regenerative import columns, drives
from nsdrill.models.regenerative.parameters import Initial, Parameters
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.top import limit_of, unlimited
from nsdrill.models.uncertain_onset import sensitive_onset
from nsdrill.ranges import computed, meanings_of
from nsdrill.records import dataclass

BY_CUTTING = "change bit.zeta, or bit.friction and bit.wear_length, or measure the torque."


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
    cut = columns.cut_of(parameters.bit, operation.wob, operation.rotary_speed)
    order = (whole.mass, whole.stiffness, whole.damping, whole.inertia, whole.torsional, cut.force)
    return Coefficients(*map(float, order))


def cutting_at(parameters: Parameters, operation: Operation) -> Cutting:
    """The bit at an operating point."""
    one, bit = coefficients(parameters, operation), parameters.bit
    point = operation.wob, operation.rotary_speed
    return cutting.of_one_mass(bit, "bit", float(bit.radius), *point, one.m_a, one.k_a, one.c_a)


def drilling_at(parameters: Parameters, operation: Operation) -> Drilling:
    """Steady drilling at an operating point. The torque on the bit does not fall with its
    speed, so that stick-slip is not that of friction."""
    model, depth, wob, speed = model_named("regenerative"), operation.depth, operation.wob, operation.rotary_speed

    def table(set_speed: Numeric) -> Mapping[str, Numeric]:
        return unlimited(model.columns(Values(parameters, Initial(), (depth, wob, set_speed)), Thresholds()))

    whole = columns.string_of(parameters.drillstring, depth)
    return Drilling(
        drives.turning_string(parameters, wob, table),
        speed,
        wob,
        2 * float(parameters.bit.radius),
        math.sqrt(float(whole.torsional / whole.inertia)),
        float(whole.torsional),
        limit_of(parameters.drive),
    )


def stick_slip_lasts(settings: Sequence[Values]) -> list[tuple[float, None] | None]:
    """The set speeds [rad/s] below which steady drilling is unstable; up to which one
    stick-slip lasts, once begun, is not known of this model. None where nothing is cut."""
    given = [(values.parameters, values.point) for values in settings]
    return [cutting.stick_slip_lasts(cutting_at(*one), drilling_at(*one).string) for one in given]


def _onsets(strings: Sequence[Parameters], at: Operation) -> list[float | None]:
    """The speeds [rad/s] below which steady drilling is unstable, of many strings."""
    found = stick_slip_lasts([Values(one, Initial(), (at.depth, at.wob, at.rotary_speed)) for one in strings])
    return [None if one is None else one[0] for one in found]


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point."""
    bit, drilling = cutting_at(parameters, operation), drilling_at(parameters, operation)
    quantities = {
        **cutting.quantities(bit),
        **cutting.stability(bit, drilling.string),
        "torsional": DerivedQuantity(drilling.frequency, "rad/s", "torsional frequency"),
    }
    quantities |= cutting.without_fall(drilling.quantities(fold=False))
    return quantities | drives.below(parameters, operation.depth).quantities(drilling, operation.rotary_speed)


def deciding(study: Any) -> dict[str, list[str]]:
    """The numbers that no sheet has and that act on each response."""
    of_bit = of_surface("bit")
    axial = (*of_bit, "drillstring.axial_damping")
    return of_study(study, {"stick_slip": (*axial, "drillstring.torsional_damping"), "bit_bounce": axial})


def warnings(study: Any, corners: list[Values], format_value: FormatValue) -> list[str | None]:
    """Warnings of a study, whose ``corners`` are the values at the ends of all axes and
    ramps; None where there is nothing to warn of."""
    found = drillings(corners, lambda corner: drilling_at(corner.parameters, corner.point))
    here = drilling_at(*operated(study, corners))
    return [
        *cutting.warnings([cutting_at(one.parameters, one.point) for one in corners], format_value),
        overloaded(found, format_value),
        resting(found, format_value),
        drooping(found, format_value),
        stalling(found, format_value),
        aggressive(Found(PDC, here), [Found(PDC, one) for _, one in found], format_value, BY_CUTTING),
        swinging(study, found, format_value) if any(not one.parameters.drive.ideal for one in corners) else None,
        sensitive_onset(study, corners, _onsets, deciding(study).get("stick_slip", ()), format_value),
        _constant_feed(corners),
    ]


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
