"""What ``check`` shows of a study of a string of segments: coefficients, derived
quantities of the linearised string and drive, and warnings."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

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
    oscillating_modes,
    slope_held,
    string_at,
    torsional_frequencies,
    torsional_matrix,
)
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.string import String, steady_of, string_of

MODES = 3  # modes of string and drive among the derived quantities


class Coefficients(NamedTuple):
    """Coefficients of the string as a whole, with its lumped inertia."""

    k_a: float
    k_t: float
    J: float
    c_mud: float


COEFFICIENTS = {
    "k_a": ("N/m", "axial stiffness of string and hoist"),
    "k_t": ("N m/rad", "torsional stiffness of the string"),
    "J": ("kg m^2", "inertia that has the first torsional frequency with it"),
    "c_mud": ("N m s/rad", "drag of the mud on the turning string"),
}


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
    if drive.kind in LAWS:
        law = law_of(parameters, string)
        quantities |= {
            "drive_stiffness": DerivedQuantity(float(law.stiffness), "N m/rad", "integral gain of the drive, K_i"),
            "drive_damping": DerivedQuantity(float(law.damping), "N m s/rad", "proportional gain of the drive, K_p"),
        }
    if drive.kind != "ideal":
        share = None if reflected is None else float(abs(reflected))
        meaning = "share of a wave at the first torsional frequency that the drive reflects"
        quantities |= {
            "drive_inertia": DerivedQuantity(
                float(law_at_top.inertia), "kg m^2", "inertia of drive and kelly, as it is felt"
            ),
            "drive_reflection": DerivedQuantity(share, "1", meaning),
        }
    if drive.torque_limit is not None and drive.kind in LAWS:
        reserve = float(drive.torque_limit) - torque
        quantities["torque_reserve"] = DerivedQuantity(
            reserve, "N m", "torque limit of the drive less the steady torque"
        )
    for number, root in enumerate(oscillating_modes(torsional_matrix(parameters, string), MODES), start=1):
        quantities |= {
            f"drive_mode_{number}": DerivedQuantity(abs(root), "rad/s", f"frequency {number} of string and drive"),
            f"drive_damping_{number}": DerivedQuantity(
                -root.real / abs(root), "1", "its damping ratio, without bit friction"
            ),
        }
    return quantities


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
