"""How steep the friction of bit and wall is, and where it cannot be integrated
implicitly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.lateral import stabilizer_radius
from nsdrill.models.christoforou_yigit.laws import bit_numbers
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.leaves import Values


def explicit_only(parameters: Parameters) -> str | None:
    """Why the friction of this string cannot be integrated implicitly, None where it
    can."""
    if parameters.stabilizer.clearance is not None and parameters.well.axial_friction:
        return (
            "stabilisers and wall whose friction acts along the hole too (well.axial_friction) "
            "share both slips"
        )
    return None


def friction_rates(points: Values) -> dict[str, Any]:
    """How fast friction at rest brakes a slip [1/s], of bit, wall and stabilisers, by
    their keys: (2/pi) eps mu N over the mass that it meets, with the weight on bit,
    with the force that presses a rolling collar to the wall, and with what the span
    exerts on the stabilisers when the collar is at the wall."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    k = derive(parameters, depth, wob, speed)
    bit = bit_numbers(parameters, k)
    if parameters.bit.friction.law == "rational":
        steep = bit.bit_dynamic * bit.bit_smoothing + bit.bit_rise
    else:
        steep = 2 / math.pi * bit.bit_smoothing * (bit.bit_rise + bit.bit_dynamic)
    wall = parameters.well.friction
    pressed = k.m_l * k.collar_radius**2 * np.square(speed) / k.gap
    meets = k.collar_radius**2 / k.J + 1 / k.m_l
    if parameters.well.axial_friction:
        meets = np.maximum(meets, 1 / k.m_a)
    modes = parameters.modes
    at_bit = wob * steep / k.J if modes.torsional == "free" else 0.0
    at_wall = (
        2 / math.pi * wall.smoothing * wall.static * pressed * meets
        if modes.lateral == "free"
        else 0.0
    )
    key = "b1" if parameters.bit.friction.law == "rational" else "smoothing"
    rates = {f"bit.friction.{key}": at_bit, "well.friction.smoothing": at_wall}
    radius, law = stabilizer_radius(parameters), parameters.stabilizer.friction
    if radius is not None and modes.lateral == "free":
        clearance = parameters.stabilizer.clearance
        held, meets = k.k_bend * (k.gap - clearance), radius**2 / k.J + clearance / k.gap / k.m_l
        rates["stabilizer.friction.smoothing"] = (
            2 / math.pi * law.smoothing * law.static * held * meets
        )
    return rates
