"""Further derived quantities at one operating point, of effects that the lumped model
leaves out: buckling of collars and pipe, standing waves of the string, higher lateral
modes, and contact of the collar with the low side.

**Buckling** on the low side of a hole of inclination alpha: the sinusoid begins at
``F_s = 2 sqrt(E I w sin(alpha) / c)`` (Dawson & Paslay 1984) with the half wave ``pi (E I
c / (w sin(alpha)))^(1/4)``, the helix at ``sqrt(2) F_s`` (Chen, Lin & Cheatham 1990);
both as commonly cited. ``w`` is the weight in mud by length and ``c`` the radial
clearance.

**Standing waves** of pipe and collars, or of all sections: :mod:`nsdrill.models.waves`.
"""

from __future__ import annotations

import math

import numpy as np

from nsdrill.models import waves
from nsdrill.models.christoforou_yigit.coefficients import GRAVITY, Coefficients, derive, of_whole_string, ring
from nsdrill.models.christoforou_yigit.derived_quantities import lateral_stiffness, stiffness_of_rock
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.numbers import HELIX, DerivedQuantity
from nsdrill.models.operation import Operation
from nsdrill.models.sections import Material, Tubular, collar_material, parts_of
from nsdrill.records import dataclass


@dataclass(frozen=True)
class Tube:
    """A tube in a hole full of mud, with mud inside."""

    length: float  #: [m]
    bending: float  #: E I [N m^2]
    weight: float  #: in mud, per unit length [N/m]
    clearance: float  #: radial, between tube and wall of the hole [m]
    axial: float  #: impedance of axial waves, A sqrt(E rho) [N s/m]
    torsional: float  #: impedance of torsional waves, I_p sqrt(G rho) [N m s/rad]


def collar_tube(parameters: Parameters) -> Tube:
    """The drill collars, or the section that bends."""
    string = parameters.drillstring
    return _tube(parameters, string.collar, string.collar.length, collar_material(string))


def pipe_tube(parameters: Parameters, depth: float) -> Tube:
    """The drill pipe of a string of this ``depth`` [m], or the first section."""
    string = parameters.drillstring
    if string.sections is None:
        return _tube(parameters, string.pipe, depth - string.collar.length, string.material)
    first = parts_of(string.sections, string.material, depth)[0]
    steel = Material(float(first.density), float(first.young), float(first.shear))
    return _tube(parameters, Tubular(float(first.outer), float(first.inner)), float(first.length), steel)


def _tube(parameters: Parameters, part: Tubular, length: float, steel: Material) -> Tube:
    mud = parameters.mud
    area, second_moment = map(float, ring(part.outer_diameter, part.inner_diameter))
    return Tube(
        length,
        steel.young_modulus * second_moment,
        GRAVITY * (steel.density - mud.density) * area,
        (parameters.well.diameter - part.outer_diameter) / 2,
        area * math.sqrt(steel.young_modulus * steel.density),
        2.0 * second_moment * math.sqrt(steel.shear_modulus * steel.density),
    )


def sinusoidal_load(tube: Tube, inclination: float) -> float:
    """Axial load [N] at which a tube on the low side buckles into a sinusoid, at an
    ``inclination`` [rad] of the hole from the vertical; NaN for a tube that is wider than
    the hole."""
    if not tube.clearance > 0.0:
        return math.nan
    return 2.0 * math.sqrt(tube.bending * max(tube.weight, 0.0) * math.sin(inclination) / tube.clearance)


def half_wave(tube: Tube, inclination: float) -> float | None:
    """The half wavelength [m] of the sinusoid at an ``inclination`` [rad]; None where
    the tube does not lie on the low side."""
    if not tube.clearance > 0.0:
        return None
    side_load = tube.weight * math.sin(inclination)
    return math.pi * (tube.bending * tube.clearance / side_load) ** 0.25 if side_load > 0.0 else None


def torsional_waves(parameters: Parameters, depth: float, count: int) -> np.ndarray:
    """The first ``count`` torsional frequencies [rad/s] of a string to ``depth`` [m]:
    top fixed, bit free. One whose stiffness or inertia is given as measured has the lumped
    one, and NaN for the others, which its geometry does not tell."""
    string = parameters.drillstring
    if string.torsional_stiffness is not None or string.rotary_inertia is not None:
        whole = of_whole_string(string, depth)
        return np.array([math.sqrt(float(whole["k_t"]) / float(whole["J"])), *(math.nan,) * (count - 1)])
    if string.sections is not None:
        parts = parts_of(string.sections, string.material, depth)
        return waves.standing(waves.torsional(parts), 0.0, count)
    collar, pipe = collar_tube(parameters), pipe_tube(parameters, depth)
    speed = math.sqrt(string.material.shear_modulus / string.material.density)
    tubes = [(pipe.length, speed, pipe.torsional), (collar.length, speed, collar.torsional)]
    return waves.standing(tubes, 0.0, count)


def axial_waves(parameters: Parameters, depth: float, count: int, *, on_rock: bool = False) -> np.ndarray:
    """The first ``count`` axial frequencies [rad/s] of a string to ``depth`` [m]: top
    fixed, bit off or on the rock."""
    string = parameters.drillstring
    spring = stiffness_of_rock(parameters) if on_rock else 0.0
    if string.sections is not None:
        parts = parts_of(string.sections, string.material, depth)
        return waves.standing(waves.axial(parts), spring, count)
    collar, pipe = collar_tube(parameters), pipe_tube(parameters, depth)
    speed = math.sqrt(string.material.young_modulus / string.material.density)
    return waves.standing([(pipe.length, speed, pipe.axial), (collar.length, speed, collar.axial)], spring, count)


WAVES = 4  # standing waves that are listed
HALF_WAVES = 3  # lateral modes
HORIZONTAL = math.pi / 2


def further_quantities(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The further quantities by name."""
    quantities = {
        **_buckling(parameters, operation),
        **_lateral(parameters, operation),
        **_waves(parameters, operation),
    }
    # the waves of all sections stand beside the lumped string, whose error they show
    shown = ("torsional_wave", "axial_wave") if parameters.drillstring.sections is not None else ()
    return {
        name: DerivedQuantity(value, units, words, group, not (shown and name.startswith(shown)))
        for name, (value, units, words, group) in quantities.items()
    }


Row = tuple[float | None, str, str, str]


def _buckling(parameters: Parameters, operation: Operation) -> dict[str, Row]:
    quantities: dict[str, Row] = {}
    for name, tube in (("collar", collar_tube(parameters)), ("pipe", pipe_tube(parameters, operation.depth))):
        load = sinusoidal_load(tube, HORIZONTAL)
        quantities |= {
            f"{name}_sinusoidal": (
                _finite(load),
                "N",
                f"load at which the {name} buckles in a horizontal hole",
                "buckling",
            ),
            f"{name}_helical": (_finite(HELIX * load), "N", "load at which that becomes a helix", "buckling"),
            f"{name}_half_wave": (half_wave(tube, HORIZONTAL), "m", "half wave of the sinusoid", "buckling"),
        }
    return quantities


def _lateral(parameters: Parameters, operation: Operation) -> dict[str, Row]:
    k, quantities = derive(parameters, operation.depth, operation.wob, operation.rotary_speed), {}
    in_mud = lateral_frequencies(parameters, operation, k, float(k.m_l))
    for number in range(2, HALF_WAVES + 1):
        words = f"lateral frequency of {number} half waves, which the model leaves out"
        quantities[f"lateral_{number}"] = (_finite(in_mud[number - 1]), "rad/s", words, "lateral")
    quantities["wall_inclination"] = (
        wall_inclination(parameters, operation, k),
        "rad",
        "least inclination of the hole at which the collar rests on the wall",
        "lateral",
    )
    return quantities


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _waves(parameters: Parameters, operation: Operation) -> dict[str, Row]:
    rows: tuple[tuple[str, np.ndarray, str, str], ...] = (
        ("torsional_wave", torsional_waves(parameters, operation.depth, WAVES), "torsional wave", "rotation"),
        ("axial_wave", axial_waves(parameters, operation.depth, WAVES), "axial wave, bit off the rock", "axial"),
        (
            "axial_rock_wave",
            axial_waves(parameters, operation.depth, WAVES, on_rock=True),
            "axial wave, bit on the rock",
            "axial",
        ),
    )
    return {
        f"{name}_{number}": (float(value), "rad/s", f"standing {words}, mode {number}", group)
        for name, values, words, group in rows
        for number, value in enumerate(values, start=1)
        if math.isfinite(value)
    }


def lateral_frequencies(parameters: Parameters, operation: Operation, k: Coefficients, mass: float) -> np.ndarray:
    """Frequencies [rad/s] of 1 to :data:`HALF_WAVES` half waves of the span with this modal
    ``mass`` [kg], which is the same for all; NaN where buckled. From E I d4y/dx4 + W d2y/dx2 + m
    d2y/dt2 = 0 of a pinned beam."""
    stiffness = np.array([lateral_stiffness(parameters, operation, k, number + 1) for number in range(HALF_WAVES)])
    return np.sqrt(np.where(stiffness >= 0.0, stiffness, np.nan) / mass)


def modal_weight(parameters: Parameters) -> float:
    """The modal force [N] of the weight in mud on the first mode of a horizontal span;
    the shape sin(pi x / l) has the integral 2 l / pi."""
    return 2 * parameters.drillstring.collar.span / math.pi * collar_tube(parameters).weight


def wall_inclination(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """Inclination [rad] of the hole at which the span sags as far as the wall, k_r (c0
    - s0) = F_g sin(alpha) with the clearance s0 of the stabilisers; None where it does
    not."""
    stiffness = lateral_stiffness(parameters, operation, k)
    force = modal_weight(parameters)
    reach = max(stiffness, 0.0) * (float(k.gap) - (parameters.stabilizer.clearance or 0.0))
    return math.asin(reach / force) if reach <= force and force > 0.0 else None


def lies_on_low_side(parameters: Parameters, operation: Operation, k: Coefficients) -> bool:
    """Whether the weight of the collar holds it on the wall of an inclined hole."""
    if not parameters.well.inclination > 0.0:  # nor is it asked which torque softens the span
        return False
    least = wall_inclination(parameters, operation, k)
    return least is not None and 0.0 < least <= float(parameters.well.inclination)
