"""The steepness of the friction of bit, wall and stabilisers."""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.lateral import stabilizer_radius
from nsdrill.models.christoforou_yigit.laws import law_of_bit, slope_at_rest
from nsdrill.models.friction import rate_at_rest
from nsdrill.models.leaves import Values


def friction_rates(points: Values) -> dict[str, Any]:
    """The rates [1/s] at which friction at rest decelerates a slip, of bit, wall and
    stabilisers, by the keys of their smoothing: (2/pi) eps mu N over the effective mass
    of the slip. The normal force N is the weight on bit, the force between a rolling
    collar and the wall, and the force of the span on the stabilisers when the collar is
    at the wall."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    k = derive(parameters, depth, wob, speed)
    normal = k.m_l * k.collar_radius**2 * np.square(speed) / k.gap
    per_mass = k.collar_radius**2 / k.J + 1 / k.m_l
    if parameters.well.axial_friction:
        per_mass = np.maximum(per_mass, 1 / k.m_a)
    modes = parameters.modes
    bit_rate = wob * slope_at_rest(parameters, k) / k.J if modes.torsional == "free" else 0.0
    wall_rate = rate_at_rest(parameters.well.friction, normal, per_mass) if modes.lateral == "free" else 0.0
    rates = {f"bit.friction.{law_of_bit(parameters).steep}": bit_rate, "well.friction.smoothing": wall_rate}
    radius = stabilizer_radius(parameters)
    if radius is not None and modes.lateral == "free":
        clearance = parameters.stabilizer.clearance
        span_force, per_mass = (k.k_bend * (k.gap - clearance), radius**2 / k.J + clearance / k.gap / k.m_l)
        rate = rate_at_rest(parameters.stabilizer.friction, span_force, per_mass)
        rates["stabilizer.friction.smoothing"] = rate
    return rates
