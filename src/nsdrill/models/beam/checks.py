"""What ``check`` shows of a study of an elastic collar: coefficients, frequencies under
load, and warnings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from nsdrill.models import top
from nsdrill.models.aggressive import Found, aggressive, found_at, operated, usual_of
from nsdrill.models.beam.columns import as_lumped, shape, stiffnesses
from nsdrill.models.beam.columns import coefficients as lumped_coefficients
from nsdrill.models.beam.drives import below, turning_string, values_of
from nsdrill.models.beam.parameters import Initial, Parameters
from nsdrill.models.christoforou_yigit import checks as of_lumped
from nsdrill.models.christoforou_yigit import derived_quantities as lumped
from nsdrill.models.christoforou_yigit.bouncing import Bounce
from nsdrill.models.christoforou_yigit.checks import COEFFICIENTS as LUMPED
from nsdrill.models.christoforou_yigit.coefficients import Coefficients
from nsdrill.models.christoforou_yigit.critical_speeds import Corner, begun_by_speed, passed_over
from nsdrill.models.christoforou_yigit.sensitive import deciding as deciding
from nsdrill.models.christoforou_yigit.sensitive import sensitive
from nsdrill.models.christoforou_yigit.unusual import (
    added_mass_of_hole,
    least_collar_weight,
    pipe_buckles_from,
    second_mode,
    slowest_second_mode,
)
from nsdrill.models.drilling import (
    Drilling,
    Limits,
    begins_above_onset,
    drillings,
    drooping,
    folds,
    interrupted,
    limits_unless_shaken,
    narrow,
    overloaded,
    resting,
    stalling,
    swinging,
)
from nsdrill.models.numbers import DerivedQuantity, FormatValue
from nsdrill.models.operation import Numeric, Operation, Values
from nsdrill.models.responses import Thresholds

COEFFICIENTS = LUMPED
# The quantities of the lumped model for the string above the collar and for the bit, beside
# those of steady drilling.
SHARED = (
    "axial_free",
    "axial_contact",
    "torsional",
    "torsional_damping",
    "pipe_impedance",
    "buckling_margin",
    "collar_weight",
    "lobe_resonance",
    "lobe_resonance_at_bit",
    "bounce_speed",
    "bounce_speed_at_bit",
    "lift_off_wob",
    "added_mass_hole",
)
NODE = 1e-9  # a mode shape below this is at a node


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """The lumped coefficients at an operating point, of the first mode, without the
    factor of the modal mass."""
    return lumped_coefficients(parameters, operation.depth, operation.wob, operation.rotary_speed)


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point: those of string and bit, the
    frequency of each bending mode under the weight on bit, None where that buckles
    it, and those of a drive that is not ideal."""
    drilling = drilling_at(parameters, operation)
    shared = lumped.derived_quantities(as_lumped(parameters), operation, drilling=drilling)
    mass = parameters.beam.modal_mass_factor * coefficients(parameters, operation).m_l
    quantities = {name: shared[name] for name in SHARED if name in shared} | drilling.quantities()
    for n, stiffness in enumerate(stiffnesses(parameters, *_at(operation)), start=1):
        frequency = math.sqrt(stiffness / mass) if stiffness > 0 else None
        quantities[f"bending_{n}"] = DerivedQuantity(
            frequency, "rad/s", f"frequency of bending mode {n} at this WOB", "lateral"
        )
    if parameters.drive.ideal:
        return quantities
    return quantities | below(parameters, operation.depth).quantities(drilling, operation.rotary_speed)


def drilling_at(parameters: Parameters, operation: Operation) -> Drilling:
    """Steady drilling at an operating point, of a collar that is straight."""
    depth, wob, speed = _at(operation)
    k = coefficients(parameters, operation)
    k_t, frequency = float(k.k_t), math.sqrt(float(k.k_t) / float(k.J))

    def table(set_speed: Numeric) -> Mapping[str, Numeric]:
        values = values_of(Values(parameters, Initial(), (depth, wob, set_speed)), Thresholds())
        return {**top.unlimited(values), "per_inertia": 1.0 / k.J}

    string, limit = turning_string(parameters, wob, table), top.limit_of(parameters.drive)
    return Drilling(string, speed, wob, float(parameters.well.diameter), frequency, k_t, limit)


def _at(operation: Operation) -> tuple[float, float, float]:
    return operation.depth, operation.wob, operation.rotary_speed


def left_out(corners: list[Values]) -> dict[str, float | None]:
    """As that of the lumped string."""
    first_mode = [Corner(_lumped(corner)) for corner in corners]
    of_weight = {"collar_weight": least_collar_weight(first_mode), "pipe_buckles": pipe_buckles_from(first_mode)}
    return {**of_weight, "second_mode": _left_out_mode(first_mode, corners)}


def _left_out_mode(first_mode: list[Corner], corners: list[Values]) -> float | None:
    """The frequency [rad/s] of two half waves where only one is in the model."""
    return slowest_second_mode(first_mode) if any(one.parameters.beam.modes == 1 for one in corners) else None


def warnings(study: Any, corners: list[Values], format_value: FormatValue) -> list[str | None]:
    """Warnings of a study, whose ``corners`` are the values at the ends of all axes;
    None where there is nothing to warn of."""

    def of(parameters: Parameters, operation: Operation) -> Found:
        return found_at(usual_of(parameters.bit), parameters, operation, drilling_at)

    found = [of(corner.parameters, corner.point) for corner in corners]
    turning = drillings(corners, lambda one: drilling_at(one.parameters, one.point))
    lobed = any(float(corner.parameters.bit.surface_amplitude) != 0.0 for corner in corners)
    first_mode = [Corner(_lumped(corner)) for corner in corners]
    told = [
        aggressive(of(*operated(study, corners)), found, format_value),
        interrupted(turning, format_value),
        narrow(turning, format_value),
        _buckled(corners, format_value),
        _undamped(study.parameters),
        added_mass_of_hole(study, first_mode, format_value),
        second_mode(_left_out_mode(first_mode, corners), max(one.speed for one in first_mode), format_value),
        passed_over(study, lasting_motions(study, corners), format_value, lobed),
        sensitive(study, first_mode, format_value),
    ]
    if all(corner.parameters.drive.ideal for corner in corners):
        return told
    of_drive = (one(turning, format_value) for one in (overloaded, resting, drooping, stalling))
    return [*of_drive, *told, swinging(study, turning, format_value)]


def _buckled(corners: list[Values], format_value: FormatValue) -> str | None:
    """The warning of modes that the weight on bit buckles."""
    worst = max(corners, key=lambda corner: corner.point.wob)
    buckled = [n for n, k in enumerate(stiffnesses(worst.parameters, *worst.operation), start=1) if k < 0]
    if not buckled:
        return None
    load = lumped_coefficients(worst.parameters, *worst.operation).buckling_load
    return (
        f"Buckled: at {format_value(worst.point.wob, 'N', 'kN')} the stiffness of bending mode "
        f"{' and '.join(map(str, buckled))} is negative (Euler load {format_value(float(load), 'N', 'kN')}). The "
        "collar leans on its walls there; that is allowed. Shorten the span or lower the weight on bit if it is not "
        "meant."
    )


def _undamped(parameters: Parameters) -> str | None:
    """The warning of modes that nothing damps: all stations, where the mud drags, are
    at their nodes."""
    if np.any(np.asarray(parameters.beam.damping_ratio) > 0):
        return None
    mud_drag = parameters.mud.density * parameters.mud.drag if not np.ndim(parameters.mud.density) else 1.0
    damped_places = [
        station.at for station in parameters.beam.stations if station.drag or (station.drag is None and mud_drag)
    ]
    undamped = [
        n
        for n in range(1, parameters.beam.modes + 1)
        if all(np.all(np.abs(shape(place, n)) < NODE) for place in damped_places)
    ]
    if not undamped or not damped_places:  # without mud no damping is expected
        return None
    return (
        f"Undamped: the stations are at nodes of bending mode {' and '.join(map(str, undamped))}, so neither mud nor "
        "wall acts on it, and what it has at the start it keeps. Give beam.damping_ratio, or stations elsewhere."
    )


def lasting_motions(study: Any, corners: list[Values]) -> list[dict[str, Any]]:
    """The critical speeds at which a motion begins that may last, as those of the lumped
    collar, of the first bending mode; and the onset of stick-slip where a sweep begins
    above it."""
    if study.initial.starts:
        return []
    above = begins_above_onset(study, drilling_at, _is_shaken)
    return [*begun_by_speed(study, [_lumped(corner) for corner in corners]), *above]


def _lumped(corner: Values) -> Values:
    """These values with the parameters of the lumped collar."""
    return replace(corner, parameters=as_lumped(corner.parameters))


def bounce_at(parameters: Parameters, operation: Operation, speed: float) -> Bounce | None:
    """That of the lumped collar: the bounce over lobes that may last at a ``speed`` of the bit
    [rad/s]; None where there is none that is known."""
    return of_lumped.bounce_at(as_lumped(parameters), operation, speed)


stick_slip_folds = partial(folds, drilling_at)


def stick_slip_lasts(settings: Sequence[Values]) -> list[Limits]:
    """The set speeds [rad/s] below which steady drilling is unstable to stick-slip, and up
    to which stick-slip, once begun, may last, of many settings together; 0 where it is not
    and does not; None with lobes that may shake the bit loose."""
    return limits_unless_shaken(settings, lambda one: drilling_at(one.parameters, one.point), _is_shaken)


def _is_shaken(values: Values, speed: float) -> bool:
    """Whether lobes may shake a bit loose that sticks and slips at a set speed [rad/s]."""
    if float(values.parameters.bit.surface_amplitude) == 0.0:
        return False
    return lumped.is_shaken(as_lumped(values.parameters), values.point, speed)
