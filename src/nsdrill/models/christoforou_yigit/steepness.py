"""The steepness of the friction of bit, wall and stabilisers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.lateral import stabilizer_radius
from nsdrill.models.christoforou_yigit.laws import bit_numbers
from nsdrill.models.friction import LAWS, values
from nsdrill.models.leaves import Values


def friction_rates(points: Values) -> dict[str, Any]:
    """The rates [1/s] at which friction at rest decelerates a slip, of bit, wall and
    stabilisers, by the keys of their smoothing: (2/pi) eps mu N over the effective mass
    of the slip. The normal force N is the weight on bit, the force between a rolling
    collar and the wall, and the force of the span on the stabilisers when the collar is
    at the wall."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    k = derive(parameters, depth, wob, speed)
    slope = values(LAWS[parameters.bit.friction.law], "slope", 0.0, bit_numbers(parameters, k))
    wall = parameters.well.friction
    normal = k.m_l * k.collar_radius**2 * np.square(speed) / k.gap
    per_mass = k.collar_radius**2 / k.J + 1 / k.m_l
    if parameters.well.axial_friction:
        per_mass = np.maximum(per_mass, 1 / k.m_a)
    modes = parameters.modes
    bit_rate = wob * slope / k.J if modes.torsional == "free" else 0.0
    wall_rate = 2 / math.pi * wall.smoothing * wall.static * normal * per_mass if modes.lateral == "free" else 0.0
    key = "b1" if parameters.bit.friction.law == "rational" else "smoothing"
    rates = {f"bit.friction.{key}": bit_rate, "well.friction.smoothing": wall_rate}
    radius, law = stabilizer_radius(parameters), parameters.stabilizer.friction
    if radius is not None and modes.lateral == "free":
        clearance = parameters.stabilizer.clearance
        span_force, per_mass = (k.k_bend * (k.gap - clearance), radius**2 / k.J + clearance / k.gap / k.m_l)
        rates["stabilizer.friction.smoothing"] = 2 / math.pi * law.smoothing * law.static * span_force * per_mass
    return rates
