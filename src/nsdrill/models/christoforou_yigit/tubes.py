"""Collars and pipe as beams and as waveguides: stiffness, buoyed weight, impedances."""

from __future__ import annotations

import math
from dataclasses import dataclass

from nsdrill.models.christoforou_yigit.coefficients import ring
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.sections import Tubular

GRAVITY = 9.80665  # m/s^2, standard


@dataclass(frozen=True)
class Tube:
    """A tube in a hole full of mud, with mud inside."""

    length: float  #: [m]
    bending: float  #: E I [N m^2]
    weight: float  #: in mud, per unit length [N/m]
    clearance: float  #: radial, between tube and wall of the hole [m]
    axial: float  #: impedance of axial waves, A sqrt(E rho) [N s/m]
    torsional: float  #: impedance of torsional waves, I_p sqrt(G rho) [N m s/rad]


def collars(parameters: Parameters) -> Tube:
    """The drill collars."""
    return _tube(parameters, parameters.drillstring.collar, parameters.drillstring.collar.length)


def pipe(parameters: Parameters, depth: float) -> Tube:
    """The drill pipe of a string of this ``depth`` [m]."""
    return _tube(parameters, parameters.drillstring.pipe, depth - parameters.drillstring.collar.length)


def _tube(parameters: Parameters, part: Tubular, length: float) -> Tube:
    steel, mud = parameters.drillstring.material, parameters.mud
    area, second_moment = ring(part.outer_diameter, part.inner_diameter)
    return Tube(
        length,
        steel.young_modulus * second_moment,
        GRAVITY * (steel.density - mud.density) * area,
        (parameters.well.diameter - part.outer_diameter) / 2,
        area * math.sqrt(steel.young_modulus * steel.density),
        2.0 * second_moment * math.sqrt(steel.shear_modulus * steel.density),
    )
