"""What ``check`` shows of a study of a string that only twists: coefficients, steady drilling
and its drive, and warnings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from nsdrill.models import top, waves
from nsdrill.models.aggressive import OF_ANY_KIND, aggressive, found_at, operated
from nsdrill.models.deciding import deciding as of_study
from nsdrill.models.drilling import (
    Drilling,
    Limits,
    begins_above_onset,
    begun_above,
    drillings,
    drooping,
    folds,
    interrupted,
    limits,
    narrow,
    overloaded,
    resting,
    stalling,
    swinging,
)
from nsdrill.models.numbers import DerivedQuantity, FormatValue
from nsdrill.models.operation import Numeric, Operation, Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.sections import parts_of
from nsdrill.models.torsion import STEEL, Drillstring, Initial, Parameters, below, rotating, turning_string
from nsdrill.models.uncertain_onset import FRICTION, onsets_of, sensitive_onset
from nsdrill.ranges import computed, meanings_of
from nsdrill.records import dataclass

WAVES = 4  # standing waves that are listed
POORLY_KNOWN = ("drillstring.torsional_damping", *FRICTION)


@dataclass(frozen=True)
class Coefficients:
    """The lumped string."""

    J: float = computed("kg m^2", "rotary inertia")
    k_t: float = computed("N m/rad", "torsional stiffness of the string")


COEFFICIENTS = meanings_of(Coefficients)


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """The coefficients at an operating point."""
    return Coefficients(*map(float, rotating(parameters.drillstring, operation.depth)))


def drilling_at(parameters: Parameters, operation: Operation) -> Drilling:
    """Steady drilling at an operating point."""
    model, depth, wob, speed = model_named("torsion"), operation.depth, operation.wob, operation.rotary_speed

    def table(set_speed: Numeric) -> Mapping[str, Numeric]:
        return top.unlimited(model.columns(Values(parameters, Initial(), (depth, wob, set_speed)), Thresholds()))

    inertia, stiffness = map(float, rotating(parameters.drillstring, depth))
    string, frequency = turning_string(parameters, wob, table), math.sqrt(stiffness / inertia)
    limit = top.limit_of(parameters.drive)
    return Drilling(string, speed, wob, 2 * float(parameters.bit.radius), frequency, stiffness, limit)


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point."""
    drilling, string = drilling_at(parameters, operation), parameters.drillstring
    ratio = 0.5 * string.torsional_damping * drilling.frequency / drilling.stiffness
    return {
        "torsional": DerivedQuantity(drilling.frequency, "rad/s", "torsional frequency"),
        "torsional_damping": DerivedQuantity(ratio, "1", "damping ratio of the torsional mode below a held top"),
        **drilling.quantities(),
        **_waves(string, operation.depth),
        **below(parameters, operation.depth).quantities(drilling, operation.rotary_speed),
    }


def _waves(string: Drillstring, depth: float) -> dict[str, DerivedQuantity]:
    """The standing waves of a string of sections."""
    if string.sections is None or string.torsional_stiffness is not None or string.rotary_inertia is not None:
        return {}
    found = waves.standing(waves.torsional(parts_of(string.sections, STEEL, depth)), 0.0, WAVES)
    return {
        f"torsional_wave_{number}": DerivedQuantity(float(value), "rad/s", f"standing torsional wave, mode {number}")
        for number, value in enumerate(found, start=1)
    }


def deciding(study: Any) -> dict[str, list[str]]:
    """The numbers that no sheet has and that act on stick-slip."""
    return of_study(study, {"stick_slip": POORLY_KNOWN})


def warnings(study: Any, corners: list[Values], format_value: FormatValue) -> list[str | None]:
    """The warnings of a bit whose torque is unusual, and of its drive; None where there is
    none."""
    found = [found_at(OF_ANY_KIND, corner.parameters, corner.point, drilling_at) for corner in corners]
    here = found_at(OF_ANY_KIND, *operated(study, corners), drilling_at)
    turning = drillings(corners, lambda corner: drilling_at(corner.parameters, corner.point))
    told = [
        aggressive(here, found, format_value),
        interrupted(turning, format_value),
        narrow(turning, format_value),
        begun_above(lasting_motions(study, corners), format_value),
        sensitive_onset(study, corners, onsets_of(drilling_at), POORLY_KNOWN, format_value),
    ]
    if all(corner.parameters.drive.ideal for corner in corners):
        return told
    of_drive = (one(turning, format_value) for one in (overloaded, resting, drooping, stalling))
    return [*of_drive, *told, swinging(study, turning, format_value)]


def lasting_motions(study: Any, corners: list[Values]) -> list[dict[str, Any]]:
    """The onset of stick-slip where a sweep begins above it."""
    return begins_above_onset(study, drilling_at)


stick_slip_folds = partial(folds, drilling_at)


def stick_slip_lasts(settings: Sequence[Values]) -> list[Limits]:
    """The set speeds [rad/s] below which steady drilling is unstable to stick-slip, and up
    to which stick-slip, once begun, may last, of many settings together; 0 where it is not
    and does not."""
    return limits([drilling_at(values.parameters, values.point) for values in settings])
