"""What the equations of the main model read and give: the options that are compiled in,
which change the equations rather than their numbers; the names of states, lane
parameters and auxiliary outputs; and the values of the lane parameters.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.models import friction, surface, top
from nsdrill.models.christoforou_yigit.coefficients import (
    GRAVITY,
    Coefficients,
    bit_arm,
    bit_load,
    bit_numbers,
    derive,
    law_of_bit,
    one_by_one,
    power,
)
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.drive_laws import LAW_LANES
from nsdrill.models.friction import law_number, rate_at_rest
from nsdrill.models.motor import MOTOR_LANES, REGULATOR_LANES
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.own_drives import numbered, rows_of
from nsdrill.models.sections import collar_material
from nsdrill.models.tree import lane_values, lanes_of

STATE_NAMES = ("x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed", "drive_angle")
# with a drive that is not ideal
DRIVEN_STATE_NAMES = (*STATE_NAMES[:-1], "lag", "drive_speed", STATE_NAMES[-1])
# with a DC motor
MOTOR_STATE_NAMES = (*DRIVEN_STATE_NAMES[:-1], "motor_impulse", "motor_torque", STATE_NAMES[-1])


class Options(NamedTuple):
    """The options of a string, integers, as they are part of the names of compiled
    functions. An option that is 0 leaves nothing in the code.

    ==================  =============================================================
    ``hertz``           the contact law of the wall is that of Hertz
    ``lobes``           number of lobes of the rock's surface
    ``driven``          the drive is not ideal
    ``friction``        number of the bit's friction law
                        (:func:`nsdrill.models.friction.law_numbered`)
    ``wall_law``        that of the wall
    ``stabilizer_law``  that of the stabilisers
    ``limited``         the torque of the drive has a limit
    ``motor``           the drive is a DC motor, whose torque is a state
    ``regulated``       the voltage of the motor has gains on the motion
    ``swirl``           the mud rotates
    ``stabilizer``      the stabilisers have a clearance, perhaps 0, and friction
    ``weight``          the hole is inclined
    ``axial_friction``  friction at wall and stabilisers acts along the axis too
    ``torques``         the friction of the bit is given as torques
    ``surface``         number of states of the surface that the blades leave, 0 where the
                        rock is lobed
    ``drive``           number of the drive of a script
                        (:mod:`nsdrill.models.own_drives`), 0 for one of nsdrill
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
    torques: int = 0
    surface: int = 0
    drive: int = 0
    wall_law: int = 0
    stabilizer_law: int = 0


def options_of(parameters: Parameters) -> Options:
    """The options of a string. A number that is an array, as along an axis of a sweep,
    counts as used although it may be zero at some points: there its terms change no
    bit of the result."""
    rock = parameters.bit.rock
    law = surface.LAW if rock.regenerative else parameters.bit.friction.law
    return Options(
        hertz=int(parameters.well.law == "hertz"),
        lobes=int(parameters.bit.lobes),
        friction=law_number(law),
        limited=int(parameters.drive.limited),
        swirl=is_used(parameters.mud.swirl),
        stabilizer=int(parameters.stabilizer.clearance is not None),
        weight=is_used(parameters.well.inclination),
        axial_friction=int(parameters.well.axial_friction),
        torques=int(parameters.bit.friction.by_torque and not rock.regenerative),
        surface=rock.states if rock.regenerative else 0,
        wall_law=law_number(parameters.well.friction.law),
        stabilizer_law=law_number(parameters.stabilizer.friction.law),
        **top.options_of(parameters.drive),
    )


def is_used(value: Numeric) -> int:
    """1 for a number that is not zero, and for every array."""
    return int(np.ndim(value) > 0 or value != 0.0)


def friction_rates(points: Values) -> dict[str, Numeric]:
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
    modes, rock = parameters.modes, parameters.bit.rock
    wall_rate = rate_at_rest(parameters.well.friction, normal, per_mass) if modes.lateral == "free" else 0.0
    rates: dict[str, Numeric] = {}
    if rock.regenerative:
        radius, inertia = parameters.well.diameter / 2, 1 / k.J if modes.torsional == "free" else 0.0 * k.J
        found = surface.friction_rates(rock, radius, wob, speed, 1 / k.m_a, inertia)
        rates |= {f"bit.rock.{key}": rate for key, rate in found.items()}
    else:
        rates[f"bit.friction.{law_of_bit(parameters).steep}"] = (
            bit_load(parameters, wob) * bit_arm(parameters, k, 0.0, "slope") / k.J if modes.torsional == "free" else 0.0
        )
    rates["well.friction.smoothing"] = wall_rate
    clearance = parameters.stabilizer.clearance
    if clearance is not None and modes.lateral == "free":
        radius = stabilizer_radius(parameters, clearance)
        span_force, per_mass = (k.k_bend * (k.gap - clearance), radius**2 / k.J + clearance / k.gap / k.m_l)
        rate = rate_at_rest(parameters.stabilizer.friction, span_force, per_mass)
        rates["stabilizer.friction.smoothing"] = rate
    return rates


def weights(parameters: Parameters) -> tuple[Numeric, Numeric]:
    """F_g and W_g [N]: the modal weight across the hole, buoyed, and that of the steel
    alone."""
    collar, mud = parameters.drillstring.collar, parameters.mud
    inside, outside = power(collar.inner_diameter, 2), power(collar.outer_diameter, 2)
    steel = collar_material(parameters.drillstring).density * math.pi / 4 * (outside - inside)
    fluid = mud.density * math.pi / 4 * (inside - outside)
    across = 2 * collar.span / math.pi * GRAVITY * one_by_one(math.sin, parameters.well.inclination)
    return across * (steel + fluid), across * steel


def stabilizer_radius(parameters: Parameters, clearance: Numeric) -> Numeric:
    """R_s = D_well/2 - s0 [m]."""
    return parameters.well.diameter / 2 - clearance


def lane_parameters(parameters: Parameters, k: Coefficients, rotary_speed: Numeric) -> dict[str, Numeric]:
    """The lane parameters of all options by their names, also of options that are off.
    ``rotary_speed`` is in rad/s. Where the lateral mode is frozen, the eccentric weight
    is zero and the other forces have no effect."""
    across, steel = weights(parameters)
    eccentricity = parameters.drillstring.eccentricity
    if parameters.modes.lateral == "frozen" or not parameters.drillstring.eccentric_weight:
        eccentricity = 0.0
    rate = parameters.mud.swirl * rotary_speed
    values = {
        "swirl_rate": rate,
        "swirl_momentum": k.m_f * rate,
        "weight": across,
        "eccentric_weight": steel * eccentricity,
        "bit_load": 1.0,
        "penetration_rate": k.depth_of_cut * rotary_speed / (2 * math.pi),
        **friction.stribeck(parameters.stabilizer.friction).columns("stabilizer"),
    }
    clearance = parameters.stabilizer.clearance
    if clearance is not None:
        radius = stabilizer_radius(parameters, clearance)
        values |= {"clearance": clearance, "stabilizer_radius": radius, "stabilizer_arm": radius / k.collar_radius}
    return values


STATES = STATE_NAMES[:-1]  # of string and bit
# Auxiliary outputs, which the observer reads: cosine and sine of the bit angle, the
# smoothed direction of the bit speed, the factor by which its friction falls, and the
# radius; with implicit friction the slope of the bit's law, and by how much a load
# relaxes its speed.
AUX = ("cosine_now", "sine_now", "direction_now", "decay_now", "radius_now")
SOLVE_AUX = ("slope_now", "bb_now")
PARAMETERS = (
    "set_speed",
    "wob",
    "per_lateral_mass",
    "per_inertia",
    "per_axial_mass",
    "unbalance_arm",
    "bending",
    "softening_force",
    "softening_torque",
    "drag",
    "axial_stiffness",
    "torsional_stiffness",
    "gap",
    "collar_radius",
    *friction.columns_of("wall"),
    *friction.columns_of("bit"),
    "stuck_below",
    *lanes_of(Parameters),
)


# The lane parameters that options bring.
FURTHER = {
    "driven": LAW_LANES,
    "limited": ("torque_limit",),
    "motor": MOTOR_LANES,
    "regulated": REGULATOR_LANES,
    "swirl": ("swirl_rate", "swirl_momentum"),
    "stabilizer": ("clearance", "stabilizer_radius", "stabilizer_arm", *friction.columns_of("stabilizer")),
    "weight": ("weight", "eccentric_weight"),
    "axial_friction": ("penetration_rate",),
    "torques": ("bit_load",),
    "surface": surface.OWN_LANES,
}
IGNORED_SCALE = 1e30  # the scale of a state that does not affect the step size


def states_of(options: Options) -> tuple[str, ...]:
    """The names of the states."""
    names = MOTOR_STATE_NAMES if options.motor else DRIVEN_STATE_NAMES if options.driven else STATE_NAMES
    return (*names[:-1], *surface.names(options.surface), *rows_of(options.drive))


def pairs_of(options: Options) -> tuple[str, ...]:
    """The names of the states that are positions, each with its velocity."""
    return states_of(options._replace(surface=0, drive=0))


def columns_of(options: Options) -> tuple[str, ...]:
    """The names of the lane parameters."""
    further = (name for option, names in FURTHER.items() if getattr(options, option) for name in names)
    laws = {"bit": options.friction, "wall": options.wall_law}
    laws |= {"stabilizer": options.stabilizer_law} if options.stabilizer else {}
    own = (name for contact, law in laws.items() for name in friction.own_columns_of(contact, law))
    return (*PARAMETERS, *further, *(numbered(options.drive).lanes if options.drive else ()), *own)


def aux_of(options: Options) -> tuple[str, ...]:
    """The names of the auxiliary outputs."""
    return (*AUX, *SOLVE_AUX) if options.implicit else AUX


def values_of_string(
    parameters: Parameters, k: Coefficients, wob: Numeric, rotary_speed: Numeric, stuck_below: float
) -> dict[str, Numeric]:
    """The lane parameters of string, rock and wall at operating points with the
    coefficients ``k``, by name: numbers or arrays, from wob [N] and rotary_speed
    [rad/s]. Those of the drive are :func:`.table.values_of`."""
    string, well = parameters.drillstring, parameters.well
    span = string.collar.span
    q = k.m_e * string.eccentricity / k.m_l
    force_softening, torque_softening = math.pi**2 / (2 * span), math.pi**3 / (2 * power(span, 2))
    live = string.lateral_softening == "live"
    values: dict[str, Numeric] = lane_values(parameters) | {
        "set_speed": rotary_speed,
        "wob": wob,
        "per_lateral_mass": 1 / k.m_l,
        "per_inertia": 1 / (k.J + k.m_e * string.eccentricity * (string.eccentricity - q)),
        "per_axial_mass": 1 / k.m_a,
        "unbalance_arm": q,
        "bending": k.k_bend - (force_softening * wob if string.lateral_softening == "static" else 0.0),
        "softening_force": force_softening if live else 0.0,
        "softening_torque": torque_softening if live else 0.0,
        "drag": k.c_h,
        "axial_stiffness": k.k_a,
        "torsional_stiffness": k.k_t,
        "gap": k.gap,
        "collar_radius": k.collar_radius,
        **friction.stribeck(well.friction).columns("wall"),
        **bit_numbers(parameters, k).columns("bit"),
        "stuck_below": stuck_below,
    }
    modes, rock = parameters.modes, parameters.bit.rock
    if rock.regenerative:
        values |= surface.columns(rock, well.diameter / 2, wob, rotary_speed)
        # what a spring in place of the rock has
        values |= {"rock_stiffness": values["cutting_force"], "surface_amplitude": 0.0}
    # Zero reciprocals of mass and inertia freeze a mode.
    if modes.axial == "frozen":
        values |= {"per_axial_mass": 0.0, "surface_amplitude": 0.0}
    if modes.lateral == "frozen":
        values |= {"per_lateral_mass": 0.0, "unbalance_arm": 0.0, "per_inertia": 1 / k.J}
    if modes.torsional == "frozen":
        values["per_inertia"] = 0.0
    return values | lane_parameters(parameters, k, rotary_speed)


def axial_scale(p: Mapping[str, Array]) -> Array:
    """The natural scale of the bit position [m]: the static penetration of the rock
    under the weight on bit, at least a tenth of the lobe amplitude."""
    contact = p["axial_stiffness"] + p["rock_stiffness"]
    return np.asarray(np.maximum(p["wob"] / contact, np.maximum(0.1 * p["surface_amplitude"], 1e-6)))
