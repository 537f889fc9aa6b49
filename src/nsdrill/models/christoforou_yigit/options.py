"""The options that are compiled in: they change the equations rather than their
numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.friction import LAWS


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
