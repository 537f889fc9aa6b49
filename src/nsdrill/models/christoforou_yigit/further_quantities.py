"""Further derived quantities at one operating point, of effects that the lumped model
leaves out: buckling of collars and pipe, standing waves of the string, higher lateral
modes, damping by the mud, and contact of the collar with the low side.

**Buckling** between supports, on the low side of an inclined hole, and under the own
weight. Sources: Euler for the span. On the low side of a hole of inclination alpha the sinusoid
begins at ``F_s = 2 sqrt(E I w sin(alpha) / c)`` (Dawson & Paslay 1984) with the half
wave ``pi (E I c / (w sin(alpha)))^(1/4)``, the helix at ``sqrt(2) F_s`` (Chen, Lin &
Cheatham 1990), and some authors have ``(2 sqrt(2) - 1) F_s`` for a helix that is
complete (Wu & Juvkam-Wold 1993); all as commonly cited. ``w`` is the weight in mud by
length and ``c`` the radial clearance. A column that hangs vertical buckles under its
own weight at ``n (E I w^2)^(1/3)`` (Lubinski 1950), where ``n`` depends on its length
in units of ``(E I / w)^(1/3)``: 1.94 is the value for eight units, not a number for
every string.

**Standing waves** of pipe and collars, or of all sections: :mod:`nsdrill.models.waves`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nsdrill.errors import count
from nsdrill.models import waves
from nsdrill.models.christoforou_yigit.coefficients import GRAVITY, Coefficients, derive, of_whole_string, ring
from nsdrill.models.christoforou_yigit.derived_quantities import lateral_stiffness
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.numbers import HELIX, DerivedQuantity
from nsdrill.models.operation import Numeric, Operation
from nsdrill.models.sections import Material, Tubular, collar_material, parts_of


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


# Effective length over length, and words for the ends. A beam fixed at one end and
# pinned at the other has tan(x) = x, x = 4.4934...
ENDS = {
    "fixed_free": (2.0, "one end fixed, one free"),
    "fixed_pinned": (math.pi / 4.493409457909064, "fixed and pinned"),
    "fixed_fixed": (0.5, "fixed at both ends"),
}
MAX_UNITS = 100.0  # units of length; a longer column needs more terms than are computed


def euler_load(bending: float, span: float, ends: str | None = None) -> float:
    """Euler load [N] of a span [m] of bending stiffness E I [N m^2], pinned at both
    ends or with other ``ends``."""
    return math.pi**2 * bending / ((ENDS[ends][0] if ends else 1.0) * span) ** 2


def sinusoidal_load(tube: Tube, inclination: Numeric) -> Numeric:
    """Axial load [N] at which a tube on the low side buckles into a sinusoid, at an
    ``inclination`` [rad] of the hole from the vertical, a number or an array; NaN for a
    tube that is wider than the hole."""
    if not tube.clearance > 0.0:
        return math.nan * np.sin(inclination)
    return 2.0 * np.sqrt(tube.bending * max(tube.weight, 0.0) * np.sin(inclination) / tube.clearance)


def half_wave(tube: Tube, inclination: float) -> float | None:
    """The half wavelength [m] of the sinusoid at an ``inclination`` [rad]; None where
    the tube does not lie on the low side."""
    if not tube.clearance > 0.0:
        return None
    side_load = tube.weight * math.sin(inclination)
    return math.pi * (tube.bending * tube.clearance / side_load) ** 0.25 if side_load > 0.0 else None


def vertical_load(tube: Tube) -> float | None:
    """Force [N] on the lower end of a vertical tube, hinged at both ends, at which it
    buckles under its own weight; None where it has no weight in mud, or is longer than
    :data:`MAX_UNITS` units of length.

    It is the least W of E I y'''' + ((W - w x) y')' = 0, expanded in sines that vanish
    at both ends: a generalised eigenproblem.
    """
    if not tube.weight > 0.0:
        return None
    unit = (tube.bending / tube.weight) ** (1 / 3)
    length = tube.length / unit
    if length > MAX_UNITS:
        return None
    order = np.arange(1, int(40 + 3 * length))
    wavenumber = order * math.pi / length

    def moment(difference: np.ndarray) -> np.ndarray:
        """The integral of x cos(difference pi x / length) over the length."""
        safe = np.where(difference == 0, 1, difference)
        odd = (-1.0) ** np.abs(difference) - 1.0
        return np.where(difference == 0, 0.5 * length**2, (length / (safe * math.pi)) ** 2 * odd)

    differences = order[:, None] - order[None, :]
    sums = order[:, None] + order[None, :]
    work = np.outer(wavenumber, wavenumber) * 0.5 * (moment(differences) + moment(sums))
    stiffness = np.diag(wavenumber**4 * length / 2) + work
    scale = wavenumber * math.sqrt(length / 2)  # square roots of the diagonal matrix of the force
    eigenvalue = np.linalg.eigvalsh(stiffness / np.outer(scale, scale))[0]
    return float(eigenvalue) * (tube.bending * tube.weight**2) ** (1 / 3)


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
    spring = parameters.bit.rock_stiffness if on_rock else 0.0
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
    collar, pipe = collar_tube(parameters), pipe_tube(parameters, operation.depth)
    span = parameters.drillstring.collar.span
    quantities: dict[str, Row] = {
        f"euler_{ends}": (euler_load(collar.bending, span, ends), "N", f"Euler load of the span, {words}", "buckling")
        for ends, (_, words) in ENDS.items()
    }
    quantities["collar_vertical"] = (
        vertical_load(collar),
        "N",
        "WOB at which the collars, hinged, buckle in a vertical hole",
        "buckling",
    )
    for name, tube in (("collar", collar), ("pipe", pipe)):
        load = float(sinusoidal_load(tube, HORIZONTAL))
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
    in_mud, without_mud = (lateral_frequencies(parameters, operation, k, mass) for mass in (float(k.m_l), float(k.m_c)))
    for number in range(2, HALF_WAVES + 1):
        words = f"lateral frequency of {number} half waves, which the model leaves out"
        quantities[f"lateral_{number}"] = (_finite(in_mud[number - 1]), "rad/s", words, "lateral")
    for number in range(1, HALF_WAVES + 1):
        words = f"lateral frequency of {count(number, 'half wave')}, without mud"
        quantities[f"lateral_dry_{number}"] = (_finite(without_mud[number - 1]), "rad/s", words, "lateral")
    gap = float(k.gap)
    for name, words in (("plane", "in a plane"), ("circular", "on a circle")):
        ratio = mud_damping(k, gap, circular=name == "circular")
        text = f"damping ratio by the mud, {words} as wide as the clearance; falls with the amplitude"
        quantities[f"mud_{name}"] = (ratio, "1", text, "lateral")
    quantities["wall_inclination"] = (
        wall_inclination(parameters, operation, k),
        "rad",
        "least inclination of the hole at which the collar rests on the wall",
        "lateral",
    )
    quantities["low_side_swing"] = (
        low_side_swing(parameters, operation, k),
        "rad/s",
        "swing of the collar on the low side of a horizontal hole",
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


def mud_damping(k: Coefficients, amplitude: float, *, circular: bool) -> float:
    """The ratio of the linear damping that dissipates as much energy per cycle as the
    quadratic drag c_h |v| v at this ``amplitude`` A [m]: c_h A / (2 m_l) on a circle,
    4 / (3 pi) c_h A / m_l in a plane, at any frequency."""
    ratio = float(k.c_h) * amplitude / float(k.m_l)
    return ratio / 2 if circular else ratio * 4 / (3 * math.pi)


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
    least = wall_inclination(parameters, operation, k)
    return least is not None and 0.0 < least <= float(parameters.well.inclination)


def low_side_swing(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """Frequency [rad/s] of small swings along the wall about the low side of a
    horizontal hole, sqrt(F_g / (m_l r)) at the radius r of rest, k_r (r - s0) + k_w (r
    - c0)^p = F_g; None where the collar does not rest on the wall."""
    if wall_inclination(parameters, operation, k) is None:
        return None
    stiffness, force, gap = (lateral_stiffness(parameters, operation, k), modal_weight(parameters), float(k.gap))
    well = parameters.well
    power, clearance = 1.5 if well.law == "hertz" else 1.0, parameters.stabilizer.clearance or 0.0

    def excess(depth: float) -> float:
        return float(stiffness * (gap + depth - clearance) + well.stiffness * depth**power - force)

    upper = 1e-3 * gap
    while excess(upper) < 0.0:
        upper *= 2.0
        if upper > 10.0 * gap:
            return None  # a wall softer than the span is bent by the weight on bit
    return math.sqrt(force / (float(k.m_l) * (gap + waves.rising_root(excess, 0.0, upper))))
