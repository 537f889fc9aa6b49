"""Further forces on the collar: rotating mud, stabilisers with a clearance, the weight
in an inclined hole, and friction with a component along the hole.

Let sigma = swirl Omega, u = (vx + sigma y, vy - sigma x) the velocity relative to the
mud, s0 the radial clearance of the stabilisers, a the inclination of the hole, whose
low side is at -y, and l the span.

**Mud**, in place of -c_h |v| v:

    -c_h |u| u + m_f (sigma^2 x - 2 sigma vy, sigma^2 y + 2 sigma vx)

**Stabilisers**, in place of -k_r (x, y):

    N_s = k_r max(r - s0, 0) inward,  F_s = |N_s| f_s(v_s) against v_s
    v_s = omega R_s + theta' s0,  R_s = D_well/2 - s0;  F_s R_s brakes the string

**Weight**, buoyed, with mud inside and outside; its moment is of the steel alone, as
the steel is eccentric and the mud is not:

    F_y:     -F_g,            F_g = (2 l/pi) g [rho A_c + rho_f (A_ci - A_co)] sin a
    moment:  -W_g e0 cos(phi),  W_g = (2 l/pi) g rho A_c sin a

**Friction** at the wall and the stabilisers, of a slip (v_t, v_z) with v_z = z' - ROP:

    N f(|v|) (v_t, v_z)/|v|

Sources: **J** Jansen 1991, J. Sound Vib. 147:115-135, for the mud and the stabilisers:
added mass and drag act on acceleration and velocity relative to mud that rotates with
half the rotary speed. The potential F_g y + W_g e0 sin(phi) is that of the shape sin(pi
x/l), which the eccentricity has as well. **D** as in the documentation, for Coulomb
friction along the axis.

J's stabilisers touch at s0, but their force acts at the lumped mass, at r. The power of
their friction on collar and string, -F_s (omega R_s + theta' r), therefore differs from
the dissipation at the wall, -F_s v_s; the powers contain the former.
"""

from __future__ import annotations

import math
from typing import Any

from nsdrill.models import friction
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, one_by_one, power
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.tubes import GRAVITY

SWIRL_PARAMETERS = ("swirl_rate", "swirl_momentum")
STABILIZER_PARAMETERS = ("clearance", "stabilizer_radius", "stabilizer_arm", *friction.columns_of("stabilizer"))
WEIGHT_PARAMETERS = ("weight", "eccentric_weight")
AXIAL_PARAMETERS = ("penetration_rate",)


def weights(parameters: Parameters) -> tuple[Any, Any]:
    """F_g and W_g [N]: the modal weight across the hole, buoyed, and that of the steel
    alone."""
    collar, mud = parameters.drillstring.collar, parameters.mud
    inside, outside = power(collar.inner_diameter, 2), power(collar.outer_diameter, 2)
    steel = parameters.drillstring.material.density * math.pi / 4 * (outside - inside)
    fluid = mud.density * math.pi / 4 * (inside - outside)
    across = 2 * collar.span / math.pi * GRAVITY * one_by_one(math.sin, parameters.well.inclination)
    return across * (steel + fluid), across * steel


def stabilizer_radius(parameters: Parameters) -> Any:
    """R_s = D_well/2 - s0 [m], None without stabilisers."""
    clearance = parameters.stabilizer.clearance
    return None if clearance is None else parameters.well.diameter / 2 - clearance


def rate_of_penetration(k: Coefficients, rotary_speed: Any) -> Any:
    """ROP [m/s], from the depth of cut."""
    return k.depth_of_cut * rotary_speed / (2 * math.pi)


def lane_parameters(parameters: Parameters, k: Coefficients, rotary_speed: Any) -> dict[str, Any]:
    """The lane parameters of all options by their names, also of options that are off.
    ``rotary_speed`` is in rad/s. Where the lateral mode is frozen, the eccentric weight
    is zero and the other forces have no effect."""
    clearance = parameters.stabilizer.clearance
    across, steel = weights(parameters)
    eccentricity = parameters.drillstring.eccentricity
    if parameters.modes.lateral == "frozen" or not parameters.drillstring.eccentric_weight:
        eccentricity = 0.0
    rate = parameters.mud.swirl * rotary_speed
    radius = stabilizer_radius(parameters)
    return {
        "swirl_rate": rate,
        "swirl_momentum": k.m_f * rate,
        "clearance": clearance,
        "stabilizer_radius": radius,
        "stabilizer_arm": None if radius is None else radius / k.collar_radius,
        **friction.stribeck(parameters.stabilizer.friction).columns("stabilizer"),
        "weight": across,
        "eccentric_weight": steel * eccentricity,
        "penetration_rate": rate_of_penetration(k, rotary_speed),
    }
