"""The lumped coefficients of the equations of motion, from the parameters and the
operating point; and the friction of the bit, its torque over its force, an arm [m], as
a function of its speed, by the laws of :mod:`nsdrill.models.friction`.

The span between stabilisers is simply supported with deflection shape sin(pi x / l);
the pipe is as long as the depth less the collars, and a third of its mass moves with
its lower end; a string of sections is lumped by the same rule. The arm of friction is
2/3 r_h, with the radius r_h of the bit, that of the cutting torque a_c.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nsdrill.models import friction, surface
from nsdrill.models.christoforou_yigit.parameters import BitFriction, Drillstring, Parameters
from nsdrill.models.operation import Numeric
from nsdrill.models.sections import collar_material, parts_of, stretch_of, torsion_of
from nsdrill.models.tree import with_values
from nsdrill.ranges import computed
from nsdrill.records import dataclass

GRAVITY = 9.80665  # m/s^2, standard


@dataclass(frozen=True)
class Coefficients:
    """The lumped coefficients [SI]; each a float, or an array over operating points. The
    radii have no meaning of their own for ``check``."""

    m_c: Numeric = computed("kg", "modal steel mass of the span")
    m_f: Numeric = computed("kg", "modal fluid mass, inside and added")
    m_l: Numeric = computed("kg", "lateral mass")  #: m_c + m_f
    m_e: Numeric = computed("kg", "eccentric mass")
    k_bend: Numeric = computed("N/m", "bending stiffness of the span")  #: E I pi^4 / (2 l^3)
    c_h: Numeric = computed("N s^2/m^2", "hydrodynamic drag coefficient")
    m_a: Numeric = computed("kg", "axial mass")
    k_a: Numeric = computed("N/m", "axial stiffness of the string")
    J: Numeric = computed("kg m^2", "rotary inertia")
    k_t: Numeric = computed("N m/rad", "torsional stiffness of the string")
    gap: Numeric = computed("m", "radial clearance between collar and wall")  #: c0
    depth_of_cut: Numeric = computed("m", "depth of cut per revolution")
    cutting_arm: Numeric = computed("m", "arm of the cutting torque")  #: zeta sqrt(r_h delta_c)
    buckling_load: Numeric = computed("N", "buckling load of the span")  #: pi^2 E I / l^2
    bit_radius: Numeric = computed("m")  #: r_h, half the hole diameter
    collar_radius: Numeric = computed("m")  #: R_c


def derive(parameters: Parameters, depth: Numeric, wob: Numeric, rotary_speed: Numeric) -> Coefficients:
    """The coefficients at operating points: depth [m], weight on bit [N], top-drive
    speed [rad/s], scalars or arrays that broadcast together. Raises ValueError where a
    depth does not exceed the collar length."""
    string, mud, well, bit = parameters.drillstring, parameters.mud, parameters.well, parameters.bit
    collar, steel = string.collar, collar_material(string)
    area_c, second_c = ring(collar.outer_diameter, collar.inner_diameter)
    half_span = collar.span / 2
    m_c = steel.density * area_c * half_span
    inside, outside = power(collar.inner_diameter, 2), power(collar.outer_diameter, 2)
    m_f = mud.density * math.pi / 4 * (inside + added_mass_of(parameters) * outside) * half_span
    bending = steel.young_modulus * second_c
    bit_radius = well.diameter / 2
    speed = np.asarray(rotary_speed, dtype=float)
    if bit.rock.regenerative:
        cut = cut_of(parameters, wob, speed)
        depth_of_cut, cutting_arm = 2 * math.pi * cut.rate / speed, cut.torque / cut.force
    else:
        rate = np.maximum(bit.cutting.c1 * np.asarray(wob, dtype=float) * np.sqrt(speed) + bit.cutting.c2, 0.0)
        depth_of_cut = 2 * math.pi * rate / speed
        cutting_arm = bit.cutting.zeta * np.sqrt(bit_radius * depth_of_cut)
    values = {
        "m_c": m_c,
        "m_f": m_f,
        "m_l": m_c + m_f,
        "m_e": m_c + m_f if string.eccentric_mass == "total" else m_c,
        "k_bend": bending * math.pi**4 / (2 * power(collar.span, 3)),
        "c_h": 2 / (3 * math.pi) * mud.density * mud.drag * collar.outer_diameter * collar.span,
        **of_whole_string(string, depth),
        "gap": (well.diameter - collar.outer_diameter) / 2,
        "depth_of_cut": depth_of_cut,
        "cutting_arm": cutting_arm,
        "buckling_load": math.pi**2 * bending / power(collar.span, 2),
        "bit_radius": bit_radius,
        "collar_radius": collar.outer_diameter / 2,
    }
    plain = {name: float(value) if np.ndim(value) == 0 else value for name, value in values.items()}
    return Coefficients(**plain)


def added_mass_of(parameters: Parameters) -> Numeric:
    """The added-mass coefficient of the mud round the collar: as given, else that of the
    clearance."""
    given = parameters.mud.added_mass
    return added_mass_in_hole(parameters) if isinstance(given, str) else given


def added_mass_in_hole(parameters: Parameters) -> Numeric:
    """The added-mass coefficient of potential flow round a collar in the middle of its hole,
    (D^2 + d^2)/(D^2 - d^2) (Stokes; Fritz 1972). Viscosity and a collar off the middle add
    to it."""
    hole, collar = power(parameters.well.diameter, 2), power(parameters.drillstring.collar.outer_diameter, 2)
    return (hole + collar) / (hole - collar)


def cut_of(parameters: Parameters, wob: Numeric, rotary_speed: Numeric) -> surface.Cut:
    """Steady cutting of a bit on the surface that it leaves."""
    return surface.cut_of(parameters.bit.rock, parameters.well.diameter / 2, wob, rotary_speed)


def of_whole_string(string: Drillstring, depth: Numeric) -> dict[str, Numeric]:
    """m_a, k_a, J and k_t of a string at a depth [m]: of its sections
    (:func:`nsdrill.models.sections.lumped`), or of pipe and stiff collars; J and k_t as
    they are given, where they are."""
    collar, pipe, steel = string.collar, string.pipe, string.material
    depth = np.asarray(depth, dtype=float)
    if string.sections is not None:
        parts = parts_of(string.sections, steel, depth)
        (k_a, m_a), (k_t, inertia) = stretch_of(parts), torsion_of(parts)
        values = {"m_a": m_a, "k_a": k_a, "J": inertia, "k_t": k_t}
    else:
        pipe_length = depth - collar.length
        if string.measured:
            # where nothing moves along the hole the string may be shorter than the collars of its study
            pipe_length = np.where(pipe_length > 0.0, pipe_length, depth)
        if np.any(pipe_length <= 0.0):
            length = np.max(collar.length)
            raise ValueError(f"depth: found {np.min(depth):g} m, allowed: more than the collar length, {length:g} m")
        area_c, second_c = ring(collar.outer_diameter, collar.inner_diameter)
        area_p, second_p = ring(pipe.outer_diameter, pipe.inner_diameter)
        values = {
            "m_a": steel.density * (area_c * collar.length + area_p * pipe_length / 3),
            "k_a": steel.young_modulus * area_p / pipe_length,
            # The polar second moment is twice the second moment of area.
            "J": steel.density * 2 * (second_c * collar.length + second_p * pipe_length / 3),
            "k_t": steel.shear_modulus * 2 * second_p / pipe_length,
        }
    given = {"J": string.rotary_inertia, "k_t": string.torsional_stiffness}
    return values | {name: value for name, value in given.items() if value is not None}


def ring(outer: Numeric, inner: Numeric) -> tuple[Numeric, Numeric]:
    """Area [m^2] and second moment of area [m^4] of a ring."""
    return math.pi / 4 * (power(outer, 2) - power(inner, 2)), math.pi / 64 * (power(outer, 4) - power(inner, 4))


def one_by_one(function: Callable[[float], float], values: Numeric) -> Numeric:
    """A ``function`` of the math module at every value. The bits of numpy's functions
    depend on the processor and on the length of the array."""
    if np.ndim(values) == 0:
        return function(float(values))
    values = np.asarray(values, dtype=float)
    return np.array([function(value) for value in values.ravel().tolist()]).reshape(values.shape)


def power(base: Numeric, exponent: int) -> Numeric:
    """``base`` to an integer power, number by number. numpy's power of an array differs
    in the last bit from that of a number, and a point of a sweep has the same bits as a
    single run."""
    if np.ndim(base) == 0:
        return float(base) ** exponent
    values, places = np.unique(base, return_inverse=True)
    return np.array([value**exponent for value in values.tolist()])[places].reshape(np.shape(base))


def law_of_bit(parameters: Parameters) -> friction.KeyedLaw:
    """The law of the bit."""
    return friction.law_named(parameters.bit.friction.law)


def bit_load(parameters: Parameters, force: Numeric) -> Numeric:
    """What the arm of the bit's friction is multiplied by for its torque [N]: the
    ``force`` on the bit, or 1 where the friction is given as torques."""
    return 1.0 if parameters.bit.friction.by_torque else force


def _friction_and_arms(parameters: Parameters, k: Coefficients) -> tuple[BitFriction, Numeric, Numeric]:
    """The section of the bit's friction with the arms of friction and of cutting [m];
    torques, which are those of the whole bit, have an arm of 1."""
    section = parameters.bit.friction
    if not section.by_torque:
        return section, 2 / 3 * k.bit_radius, k.cutting_arm
    return with_values(section, {"static": section.static_torque, "dynamic": section.dynamic_torque}), 1.0, 0.0


def bit_numbers(parameters: Parameters, k: Coefficients) -> friction.Numbers:
    """The numbers of the law of the bit at operating points with the coefficients
    ``k``: eps [s/rad], tau or 1/V0 [s/rad], the falling and the constant part of the
    arm [m], or of the torque [N m] where friction is given as torques; of the rational law
    b1, b3, b0 b2 and b0."""
    return law_of_bit(parameters).numbers(*_friction_and_arms(parameters, k))


def bit_arm(parameters: Parameters, k: Coefficients, speed: Numeric, which: str = "coefficient") -> Numeric:
    """The torque of the bit over its force [m], with its sign, at bit speeds [rad/s]; or
    ``which`` other value of the law there (:func:`nsdrill.models.friction.values`): its
    "slope" [m s/rad]; at positive speeds "unsmoothed", and the "fall" of that."""
    law, own = law_of_bit(parameters), friction.own_numbers(parameters.bit.friction)
    return friction.values(law, which, speed, bit_numbers(parameters, k), own)


def static_arm(parameters: Parameters, k: Coefficients) -> Numeric:
    """The greatest arm [m] at rest, or a bound of it."""
    return law_of_bit(parameters).at_rest(*_friction_and_arms(parameters, k))
