"""What the equations read and give: the options that are compiled in, the names of states,
lane parameters, and the values of the lane parameters."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from nsdrill.models import surface, top
from nsdrill.models.christoforou_yigit.coefficients import of_whole_string, ring
from nsdrill.models.drive_laws import impedance_of
from nsdrill.models.friction import columns_of
from nsdrill.models.on_surface import rates
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.regenerative.parameters import Bit, Drillstring, Parameters
from nsdrill.models.responses import Thresholds
from nsdrill.models.sections import parts_of
from nsdrill.observe.channels import Names

STRING = (
    "per_mass",
    "wob",
    "axial_stiffness",
    "axial_damping",
    "per_inertia",
    "torsional_stiffness",
    "torsional_damping",
    *surface.OWN_LANES,
    *columns_of("bit"),
    "set_speed",
    "stuck",
)


class Options(NamedTuple):
    """The number of states of the surface, whether the drive is not ideal, whether
    friction is implicit, the number of the drive of a script, whether the drive is a DC
    motor, whose torque is a state, and whether its voltage has gains on the motion."""

    surface: int = 12
    driven: int = 0
    implicit: int = 0
    drive: int = 0
    motor: int = 0
    regulated: int = 0


def options_of(parameters: Parameters) -> Options:
    """The options of a string."""
    return Options(parameters.bit.states, **top.options_of(parameters.drive))


@lru_cache
def names_of(options: Options) -> Names:
    """The names of the rows."""
    pair, others = top.pair_of(options), top.others_of(options)
    slopes = ("bit_axial_acceleration", "bit_acceleration", *(("drive_acceleration",) if pair else ()))
    return Names(
        ("z", "vz", "twist", "bit_speed", *pair, *surface.names(options.surface), *others),
        (*slopes, *rates(options.surface), *(f"{name}_rate" for name in others)),
        (*STRING, *top.lanes_of(options)),
    )


class Whole(NamedTuple):
    """The string as a whole; numbers, or arrays over operating points: axial mass [kg],
    stiffness [N/m] and damping [N s/m], rotary inertia [kg m^2] and torsional stiffness
    [N m/rad]."""

    mass: Numeric
    stiffness: Numeric
    damping: Numeric
    inertia: Numeric
    torsional: Numeric


def string_of(string: Drillstring, depth: Numeric) -> Whole:
    """The string to a depth [m]."""
    whole = of_whole_string(string, depth)  # type: ignore[arg-type]
    mass, stiffness, damping = string.axial_mass, string.axial_stiffness, string.axial_damping
    return Whole(
        whole["m_a"] if mass is None else mass,
        whole["k_a"] if stiffness is None else stiffness,
        radiation(string) if damping is None else damping,
        whole["J"],
        whole["k_t"],
    )


def cut_of(bit: Bit, wob: Numeric, speed: Numeric) -> surface.Cut:
    """Steady cutting."""
    return surface.cut_of(bit, bit.radius, wob, speed)


def radiation(string: Drillstring) -> Numeric:
    """The axial impedance A sqrt(E rho) [N s/m] of the pipe, or of the first section: what
    an axial wave that goes up the string takes with it."""
    if string.sections is not None:
        first = parts_of(string.sections[:1], string.material, 1.0)[0]
        return first.area * np.sqrt(first.young * first.density)
    steel = string.material
    area, _ = ring(string.pipe.outer_diameter, string.pipe.inner_diameter)
    return area * np.sqrt(steel.young_modulus * steel.density)


def impedance(string: Drillstring) -> Numeric:
    """The torsional impedance of the pipe, or of the first section [N m s/rad]."""
    if string.sections is not None:
        first = parts_of(string.sections[:1], string.material, 1.0)[0]
        return impedance_of(first.polar, first.density, first.shear)
    steel = string.material
    _, second = ring(string.pipe.outer_diameter, string.pipe.inner_diameter)
    return impedance_of(2.0 * second, steel.density, steel.shear_modulus)


def of_string(points: Values[Parameters], thresholds: Thresholds) -> dict[str, Numeric]:
    """The lane parameters of string and bit by name, numbers or arrays over the points."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    whole = string_of(parameters.drillstring, depth)
    return {
        "per_mass": 1.0 / whole.mass,
        "wob": wob,
        "axial_stiffness": whole.stiffness,
        "axial_damping": whole.damping,
        "per_inertia": 1.0 / whole.inertia,
        "torsional_stiffness": whole.torsional,
        "torsional_damping": parameters.drillstring.torsional_damping,
        **surface.columns(parameters.bit, parameters.bit.radius, wob, speed),
        "set_speed": speed,
        "stuck": thresholds.stuck_below,
    }


def steady_of(points: Values[Parameters]) -> dict[str, Numeric]:
    """The twist [rad] of the string and the depth of cut of a blade [m] in steady
    drilling."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    whole, cut = string_of(parameters.drillstring, depth), cut_of(parameters.bit, wob, speed)
    torque = cut.steady_torque(wob) * np.tanh(parameters.bit.smoothing * speed)
    torque = torque + parameters.drillstring.torsional_damping * speed
    return {"twist": -torque / whole.torsional, "depth": cut.depth}


REVOLUTION = 2.0 * math.pi
