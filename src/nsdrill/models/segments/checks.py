"""What ``check`` shows of a study of a string of segments: coefficients, derived
quantities of the linearised string and drive, and warnings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from nsdrill.models.drives import LAWS, overloaded, reflection, swinging
from nsdrill.models.leaves import Values
from nsdrill.models.numbers import DerivedQuantity, FormatValue, few_periods
from nsdrill.models.operation import Operation
from nsdrill.models.segments.drive import impedance, law_of
from nsdrill.models.segments.linear import (
    axial_free,
    drive_impedance,
    growth_at_rest,
    onset,
    slope_held,
    string_at,
    torsional_frequencies,
    torsional_matrix,
)
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.string import String, steady_of, string_of
from nsdrill.models.stability import quantities_of_drive
from nsdrill.ranges import computed, meanings_of

MODES = 3  # modes of string and drive among the derived quantities


@dataclass(frozen=True)
class Coefficients:
    """Coefficients of the string as a whole, with its lumped inertia."""

    k_a: float = computed("N/m", "axial stiffness of string and hoist")
    k_t: float = computed("N m/rad", "torsional stiffness of the string")
    J: float = computed("kg m^2", "inertia that has the first torsional frequency with it")
    c_mud: float = computed("N m s/rad", "drag of the mud on the turning string")


COEFFICIENTS = meanings_of(Coefficients)


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """The coefficients at an operating point."""
    string = string_at(parameters, operation)
    first = float(torsional_frequencies(string, 1)[0])
    k_t = float(string.torsional)
    return Coefficients(float(string.axial), k_t, k_t / first**2, float(sum(string.drags)))


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point."""
    string, drive = string_at(parameters, operation), parameters.drive
    steady = steady_of(parameters, string, operation.wob, operation.rotary_speed)
    torque, pipe = float(steady.table_torque), float(impedance(parameters))
    first, second = torsional_frequencies(string, 2)
    slope = slope_held(parameters, string)
    onset_speed = onset(parameters, operation, string, slope)
    law_at_top, circuit = drive_impedance(parameters, string)
    reflected = None if drive.kind == "ideal" else reflection(law_at_top, pipe, float(first), circuit)
    quantities = {
        "axial_free": DerivedQuantity(
            axial_free(parameters, string), "rad/s", "first axial frequency, bit off the rock", "axial"
        ),
        "torsional": DerivedQuantity(float(first), "rad/s", "first torsional frequency, top held"),
        "torsional_2": DerivedQuantity(float(second), "rad/s", "second torsional frequency, top held"),
        "mean_torque": DerivedQuantity(torque, "N m", "steady torque at the surface"),
        "static_twist": DerivedQuantity(float(steady.angles[-1]), "rad", "steady twist of the string"),
        "slope_held": DerivedQuantity(
            slope, "N m s/rad", "steepest fall of the bit's torque with speed that steady drilling withstands"
        ),
        "stick_slip_onset": DerivedQuantity(
            onset_speed, "rad/s", "speed below which steady drilling is unstable to stick-slip"
        ),
        "pipe_impedance": DerivedQuantity(pipe, "N m s/rad", "torsional impedance of the pipe"),
    }
    if drive.kind != "ideal":
        inertia, meaning = float(law_at_top.inertia), "inertia of drive and kelly, as it is felt"
        quantities["drive_inertia"] = DerivedQuantity(inertia, "kg m^2", meaning)
    law = law_of(parameters, string) if drive.kind in LAWS else None
    matrix = torsional_matrix(parameters, string)
    return quantities | quantities_of_drive(drive, matrix, torque, reflected, law, MODES)


def warnings(study: Any, corners: list[Values], format_value: FormatValue) -> list[str | None]:
    """Warnings of a study, whose ``corners`` are the values at the ends of all axes and
    ramps; None where there is nothing to warn of."""
    lowest = min(float(torsional_frequencies(_string(corner), 1)[0]) for corner in corners)
    return [
        overloaded(corners, _steady_torque, format_value),
        swinging(study, corners, lambda corner: growth_at_rest(corner.parameters, _string(corner)), format_value),
        few_periods(study, 2 * math.pi / lowest),
    ]


def _string(corner: Values) -> String:
    return string_of(corner.parameters, corner.operation[0])


def _steady_torque(corner: Values) -> float:
    _, wob, speed = corner.operation
    return float(steady_of(corner.parameters, _string(corner), wob, speed).table_torque)
