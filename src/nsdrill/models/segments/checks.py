"""What ``check`` finds of a study of a string of segments: what it is made of, what
linear theory knows of string and drive, and warnings."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from nsdrill.models.drives import LAWS, overloaded, reflection, swinging
from nsdrill.models.leaves import Values
from nsdrill.models.numbers import DerivedQuantity
from nsdrill.models.operation import Operation
from nsdrill.models.segments.drive import impedance, law_of
from nsdrill.models.segments.linear import (
    axial_free,
    growth_at_rest,
    modes_of,
    of_point,
    onset,
    seen_from_below,
    slope_held,
    torsional_matrix,
    waves_of,
)
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.string import steady_of, string_of

# a value in SI units, in those shown in SI or in field units, in words
Told = Callable[[float, str, str], str]
MODES = 3  # of string and drive that are told
LEAST_PERIODS = 4


class Coefficients(NamedTuple):
    """Of the string as a whole, with its lumped inertia."""

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
    """Those at an operating point."""
    string = of_point(parameters, operation)
    first = float(waves_of(string, 1)[0])
    k_t = float(string.torsional)
    return Coefficients(float(string.axial), k_t, k_t / first**2, float(sum(string.drags)))


def every_derived_quantity(
    parameters: Parameters, operation: Operation
) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point."""
    string, drive = of_point(parameters, operation), parameters.drive
    steady = steady_of(parameters, string, operation.wob, operation.rotary_speed)
    torque, pipe = float(steady.table_torque), float(impedance(parameters))
    first, second = waves_of(string, 2)
    held = slope_held(parameters, string)
    below = onset(parameters, operation, string, held)
    seen, circuit = seen_from_below(parameters, string)
    reflected = None if drive.kind == "ideal" else reflection(seen, pipe, float(first), circuit)
    found = {
        "axial_free": DerivedQuantity(
            axial_free(parameters, string),
            "rad/s",
            "first axial frequency, bit off the rock",
            "axial",
        ),
        "torsional": DerivedQuantity(float(first), "rad/s", "first torsional frequency, top held"),
        "torsional_2": DerivedQuantity(
            float(second), "rad/s", "second torsional frequency, top held"
        ),
        "mean_torque": DerivedQuantity(torque, "N m", "steady torque at the surface"),
        "static_twist": DerivedQuantity(
            float(steady.angles[-1]), "rad", "steady twist of the string"
        ),
        "slope_held": DerivedQuantity(
            held,
            "N m s/rad",
            "steepest fall of the bit's torque with speed that steady drilling withstands",
        ),
        "stick_slip_onset": DerivedQuantity(
            below, "rad/s", "speed below which steady drilling is unstable to stick-slip"
        ),
        "pipe_impedance": DerivedQuantity(pipe, "N m s/rad", "torsional impedance of the pipe"),
    }
    if drive.kind in LAWS:
        law = law_of(parameters, string)
        found |= {
            "drive_stiffness": DerivedQuantity(
                float(law.stiffness), "N m/rad", "integral gain of the drive, K_i"
            ),
            "drive_damping": DerivedQuantity(
                float(law.damping), "N m s/rad", "proportional gain of the drive, K_p"
            ),
        }
    if drive.kind != "ideal":
        share = None if reflected is None else float(abs(reflected))
        words = "share of a wave at the first torsional frequency that the drive throws back"
        found |= {
            "drive_inertia": DerivedQuantity(
                float(seen.inertia), "kg m^2", "inertia of drive and kelly, as it is felt"
            ),
            "drive_reflection": DerivedQuantity(share, "1", words),
        }
    if drive.torque_limit is not None and drive.kind in LAWS:
        left = float(drive.torque_limit) - torque
        found["torque_reserve"] = DerivedQuantity(
            left, "N m", "torque limit of the drive less the steady torque"
        )
    for number, root in enumerate(modes_of(torsional_matrix(parameters, string), MODES), start=1):
        found |= {
            f"drive_mode_{number}": DerivedQuantity(
                abs(root), "rad/s", f"frequency {number} of string and drive"
            ),
            f"drive_damping_{number}": DerivedQuantity(
                -root.real / abs(root), "1", "its damping ratio, without bit friction"
            ),
        }
    return found


def warnings(study: Any, corners: list[Values], told: Told) -> list[str | None]:
    """Warnings of a study, with what its points have at the ends of all axes and ramps
    in ``corners``; None where there is nothing to warn of."""
    found = [_overloaded(corners, told), _unstable(study, corners, told)]
    if study.swept or not study.ramped:  # else there is no observed window
        found.append(_few_periods(study, corners))
    return found


def _overloaded(corners: list[Values], told: Told) -> str | None:
    """A motor at its limit does not keep the set speed."""
    pairs = []
    for at in corners:
        depth, wob, speed = at.operation
        drive = at.parameters.drive
        if drive.kind in LAWS and drive.torque_limit is not None:
            steady = steady_of(at.parameters, string_of(at.parameters, depth), wob, speed)
            pairs.append((float(steady.table_torque), float(drive.torque_limit)))
    return overloaded(pairs, told)


def _unstable(study: Any, corners: list[Values], told: Told) -> str | None:
    """A drive that swings the string by itself, as gains of the wrong sign make it."""
    found = [
        (root, at.operation[0], at.parameters.drive.kind)
        for at in corners
        if (root := growth_at_rest(at.parameters, string_of(at.parameters, at.operation[0])))
        is not None
    ]
    return swinging(found, "depth" in study.swept, told)


def _few_periods(study: Any, corners: list[Values]) -> str | None:
    period = max(
        2 * math.pi / float(waves_of(string_of(at.parameters, at.operation[0]), 1)[0])
        for at in corners
    )
    if study.simulation.observe >= LEAST_PERIODS * period:
        return None
    return (
        f"Short: the torsional period is {period:.3g} s at most; the observed window of "
        f"{study.simulation.observe:g} s holds fewer than {LEAST_PERIODS}. Lengthen "
        f"simulation.observe."
    )
