"""The options that are compiled in: they change the equations rather than their
numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.lateral import stabilizer_radius
from nsdrill.models.christoforou_yigit.laws import law_of_bit, slope_at_rest
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.friction import LAWS, rate_at_rest
from nsdrill.models.leaves import Values


class Options(NamedTuple):
    """The options of a string, integers, as they are part of the names of compiled
    functions. An option that is 0 leaves nothing in the code.

    ==================  =============================================================
    ``hertz``           the contact law of the wall is that of Hertz
    ``lobes``           number of lobes of the rock's surface
    ``driven``          the drive is not ideal
    ``friction``        number of the bit's friction law in
                        :data:`nsdrill.models.friction.LAWS`
    ``limited``         the torque of the drive has a limit
    ``motor``           the drive is a DC motor, whose torque is a state
    ``regulated``       the voltage of the motor has gains on the motion
    ``swirl``           the mud rotates
    ``stabilizer``      the stabilisers have a clearance, perhaps 0, and friction
    ``weight``          the hole is inclined
    ``axial_friction``  friction at wall and stabilisers acts along the axis too
    ``implicit``        the friction of bit and wall is evaluated separately, for a
                        stepper that treats it implicitly
    ==================  =============================================================
    """

    hertz: int = 0
    lobes: int = 3
    driven: int = 0
    friction: int = 0
    limited: int = 0
    motor: int = 0
    regulated: int = 0
    swirl: int = 0
    stabilizer: int = 0
    weight: int = 0
    axial_friction: int = 0
    implicit: int = 0


def options_of(parameters: Parameters) -> Options:
    """The options of a string. A number that is an array, as along an axis of a sweep,
    counts as used although it may be zero at some points: there its terms change no
    bit of the result."""
    return Options(
        hertz=int(parameters.well.law == "hertz"),
        lobes=int(parameters.bit.lobes),
        driven=int(not parameters.drive.ideal),
        friction=list(LAWS).index(parameters.bit.friction.law),
        limited=int(parameters.drive.limited),
        motor=int(parameters.drive.kind == "dc_motor"),
        regulated=int(parameters.drive.regulated),
        swirl=is_used(parameters.mud.swirl),
        stabilizer=int(parameters.stabilizer.clearance is not None),
        weight=is_used(parameters.well.inclination),
        axial_friction=int(parameters.well.axial_friction),
    )


def is_used(value: Any) -> int:
    """1 for a number that is not zero, and for every array."""
    return int(np.ndim(value) > 0 or value != 0.0)


# The steepness of the friction of bit, wall and stabilisers.


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
