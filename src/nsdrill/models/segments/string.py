"""The lumped string: masses, inertias, stiffnesses and drag of its segments; steady
drilling; and the control of the drive at its top.

Nodes i = 0 (surface) to n (bit); a segment is a spring with half of its mass at either
end. With h the length of a segment, A its steel area and I_p its polar moment:

    k = E A / h,  kt = G I_p / h,  m = rho A h,  J = rho I_p h

**Mud.** Weisbach's drag of the flow Q = Q_m + Q_a sin(w_q t), up the annulus (area A_o)
and down the bore (A_b), on a segment that moves with v, less that of the mean flow::

    D = a [x|x| - (Q_m/A_o)^2] - b [y|y| - (Q_m/A_b)^2]
    x = Q/A_o - v,  y = Q/A_b + v,  a = (f_o/8) rho_f pi D h,  b = (f_i/8) rho_f pi d h

The rotating string is slowed by the shear in the annulus, a narrow gap between
cylinders: 2 pi mu (D/2)^3 h / ((D_w - D)/2).

Source: the structure of Sarker, Rideout & Butt 2012 (a bond graph); the closed forms
are the textbook ones. The flow that the moving pipe displaces is left out.

**Drive.** The control is the gains of a linear-quadratic regulator, or the law of the
torque.

    V = V_0 - [K_I (I - I*) + K_1 lag + K_2 (omega_d - Omega) + K_3 (twist - twist*)
               + K_4 (omega - Omega)]

The gains minimise the integral of the weighted squares of the five deviations and of
the voltage, by the algebraic Riccati equation of a string of two inertias: the drive's,
and J_b = k_t / w_1^2 at the bit, where w_1 is the first torsional frequency of the
segments below a held table. All drag to the wall acts at the bit; friction at the bit
and the material's damping are left out. Source: Sarker, Rideout & Butt 2012 name the
method and its weights.

The law of a drive by torque is that of :mod:`nsdrill.models.drive_laws`, where the angle of
the bit is its twist. It is tuned to the inertia at the top, of the drive and the kelly,
to the impedance of the pipe, and to the first torsional mode below a held top: the
stiffness k_t of the whole string and the inertia J_b. J_0 w_0' is T_m less the torque
of the string, with J_0 the inertia of the law and half a segment. Until ``on_at``, and
always with an ideal drive, the top keeps the set speed, and the torque is the one that
this takes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.models.christoforou_yigit.coefficients import GRAVITY
from nsdrill.models.drive_laws import DIGITS, LAWS, Gains, Seen, by_rows, impedance_of, regulated
from nsdrill.models.operation import Numeric
from nsdrill.models.own_drives import own_drive
from nsdrill.models.sections import Material, Tubular, parts_of
from nsdrill.models.segments import wall
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.rock import bit_torque, cut_of, penetration_rate
from nsdrill.models.tree import lane_values


class Segment(NamedTuple):
    """A segment of pipe or of collar: its length [m], stiffnesses [N/m, N m/rad], mass
    [kg], inertia [kg m^2], drag coefficients of annulus and bore [kg/m], drag to the
    wall [N m s/rad], areas of annulus and bore [m^2], and the weight of a metre in mud
    times the outer radius [N]."""

    length: Numeric
    axial: Numeric
    torsional: Numeric
    mass: Numeric
    inertia: Numeric
    annulus: Numeric
    bore: Numeric
    drag: Numeric
    annulus_area: Numeric
    bore_area: Numeric
    rub: Numeric
    radius: Numeric


class String(NamedTuple):
    """The whole string: a segment of each part from the top, pipe and collar or the
    sections, and how many of it; the masses [kg] and inertias [kg m^2] at the ends and at
    the ``joints``; the axial
    stiffness of the whole string with the hoist's spring [N/m] and its torsional
    stiffness [N m/rad]; the kelly's inertia [kg m^2]. ``drive_inertia`` is that of the
    electric motor, with its table, kelly and half a segment."""

    parts: tuple[tuple[Segment, int], ...]
    top_mass: Numeric
    joint_masses: tuple[Numeric, ...]
    bit_mass: Numeric
    drive_inertia: Numeric
    joint_inertias: tuple[Numeric, ...]
    bit_inertia: Numeric
    axial: Numeric
    torsional: Numeric
    kelly_inertia: Numeric

    @property
    def drags(self) -> tuple[Any, ...]:
        """The drag to the wall [N m s/rad] of each node, from the surface to the
        bit."""
        joints = [(above.drag + below.drag) / 2 for (above, _), (below, _) in pairwise(self.parts)]
        inner = self._at_inner_nodes([part.drag for part, _ in self.parts], joints)
        return (self.first.drag / 2, *inner, self.parts[-1][0].drag / 2)

    @property
    def first(self) -> Segment:
        """A segment at the top."""
        return self.parts[0][0]

    @property
    def rubbing_parts(self) -> tuple[tuple[Numeric, Numeric, int], ...]:
        """Of each part from the top what :func:`nsdrill.models.segments.wall.levers`
        takes."""
        return tuple((part.rub, part.length * count, count) for part, count in self.parts)

    @property
    def lying_parts(self) -> tuple[tuple[Numeric, Numeric, int], ...]:
        """The same with the weight of a metre in mud [N/m] alone."""
        return tuple((part.rub / part.radius, part.length * count, count) for part, count in self.parts)

    def _at_inner_nodes(self, values: Sequence[Numeric], joints: Sequence[Numeric]) -> tuple[Any, ...]:
        """The values at the nodes between surface and bit: one for each part, and those at
        the joints."""
        found: list[Numeric] = []
        for place, (_, count) in enumerate(self.parts):
            found += [values[place]] * (count - 1)
            found += joints[place : place + 1]
        return tuple(found)

    @property
    def masses(self) -> tuple[Any, ...]:
        """The mass [kg] of each node, from the surface to the bit."""
        inner = self._at_inner_nodes([part.mass for part, _ in self.parts], self.joint_masses)
        return (self.top_mass, *inner, self.bit_mass)

    @property
    def torsional_stiffnesses(self) -> tuple[Any, ...]:
        """The torsional stiffness [N m/rad] of each segment, from the surface to the
        bit."""
        return tuple(part.torsional for part, count in self.parts for _ in range(count))

    @property
    def axial_stiffnesses(self) -> tuple[Any, ...]:
        """The axial stiffness [N/m] of each segment, from the surface to the bit."""
        return tuple(part.axial for part, count in self.parts for _ in range(count))

    @property
    def inertias(self) -> tuple[Any, ...]:
        """The inertia [kg m^2] of each node but the first, to the bit."""
        return (*self._at_inner_nodes([part.inertia for part, _ in self.parts], self.joint_inertias), self.bit_inertia)


class Steady(NamedTuple):
    """Steady drilling without lobes and without pulsation: force [N] and torque [N m]
    of the rock, torque of the table [N m], current [A], voltage [V]; angles of the
    nodes behind the drive [rad], and the bit's position [m]."""

    force: Numeric
    torque: Numeric
    table_torque: Numeric
    current: Numeric
    voltage: Numeric
    angles: tuple[Any, ...]
    z: Numeric


def string_of(parameters: Parameters, depth: Numeric) -> String:
    """The lumped string at a depth [m], a number or an array."""
    drill, bit, drive, segments = (parameters.drillstring, parameters.bit, parameters.drive, parameters.segments)
    steel, kelly = drill.material, segments.kelly
    parts = _parts(parameters, depth)
    (first, _), (lowest, _) = parts[0], parts[-1]
    area, polar = _section(kelly.outer_diameter, kelly.inner_diameter)
    compliance: Numeric = 1 / segments.top.stiffness
    for part, count in parts:
        compliance = compliance + count / part.axial
    twist = parts[0][1] / first.torsional
    for part, count in parts[1:]:
        twist = twist + count / part.torsional
    joints = [*pairwise([part for part, _ in parts])]
    return String(
        parts,
        segments.top.mass + steel.density * area * kelly.length + first.mass / 2,
        tuple((above.mass + below.mass) / 2 for above, below in joints),
        bit.mass + lowest.mass / 2,
        drive.table_inertia
        + drive.gear * drive.gear * drive.motor_inertia
        + steel.density * polar * kelly.length
        + first.inertia / 2,
        tuple((above.inertia + below.inertia) / 2 for above, below in joints),
        bit.mass * bit.radius * bit.radius / 2 + lowest.inertia / 2,
        1 / compliance,
        1 / twist,
        steel.density * polar * kelly.length,
    )


def _parts(parameters: Parameters, depth: Numeric) -> tuple[tuple[Segment, int], ...]:
    """A segment of each part of the string, and how many of it."""
    drill, counts = parameters.drillstring, parameters.segments
    if drill.sections is None:
        steel = drill.material
        return (
            (_segment(parameters, drill.pipe, (depth - drill.collar.length) / counts.pipe, steel), counts.pipe),
            (_segment(parameters, drill.collar, drill.collar.length / counts.collar, steel), counts.collar),
        )
    parts = []
    for part, count in zip(parts_of(drill.sections, drill.material, depth), counts_of(parameters), strict=True):
        tube, steel = Tube(part.outer, part.inner), Material.__new__(Material)
        for name, value in (("density", part.density), ("young_modulus", part.young), ("shear_modulus", part.shear)):
            object.__setattr__(steel, name, value)  # perhaps arrays along an axis
        parts.append((_segment(parameters, tube, part.length / count, steel), count))
    return tuple(parts)


def counts_of(parameters: Parameters) -> tuple[int, ...]:
    """The number of segments of each section: the first has as many as a pipe; those below
    it share as many as collars have, by their lengths, and each has one at least."""
    sections, counts = parameters.drillstring.sections, parameters.segments
    if sections is None:
        return counts.pipe, counts.collar
    lengths = [section.length or 0.0 for section in sections[1:]]
    return counts.pipe, *(max(1, round(counts.collar * length / sum(lengths))) for length in lengths)


def _section(outer: Numeric, inner: Numeric) -> tuple[Numeric, Numeric]:
    """The area [m^2] and the polar moment [m^4] of a ring."""
    squares = outer * outer, inner * inner
    return (math.pi / 4 * (squares[0] - squares[1]), math.pi / 32 * (squares[0] * squares[0] - squares[1] * squares[1]))


class Tube(NamedTuple):
    """The diameters of a section [m]."""

    outer_diameter: Numeric
    inner_diameter: Numeric


def _segment(parameters: Parameters, part: Tubular | Tube, length: Numeric, steel: Material) -> Segment:
    mud, hole = parameters.mud, parameters.well.diameter
    hydraulics = parameters.segments.hydraulics
    outer, inner = part.outer_diameter, part.inner_diameter
    area, polar = _section(outer, inner)
    radius = outer / 2
    return Segment(
        length,
        steel.young_modulus * area / length,
        steel.shear_modulus * polar / length,
        steel.density * area * length,
        steel.density * polar * length,
        hydraulics.annulus_factor / 8 * mud.density * math.pi * outer * length,
        hydraulics.bore_factor / 8 * mud.density * math.pi * inner * length,
        2 * math.pi * mud.viscosity * radius * radius * radius * length / (hole / 2 - radius),
        math.pi / 4 * (hole * hole - outer * outer),
        math.pi / 4 * inner * inner,
        (steel.density - mud.density) * GRAVITY * area * radius,
        radius,
    )


def steady_of(parameters: Parameters, string: String, wob: Numeric, speed: Numeric) -> Steady:
    """Steady drilling under a weight on bit [N] with the set speed [rad/s]."""
    bit, drive = parameters.bit, parameters.drive
    z: Numeric
    torque: Numeric
    if bit.rock.regenerative:
        turned = np.tanh(bit.rock.smoothing * speed)
        z, force = 0.0 * wob, wob
        torque = cut_of(parameters, wob, speed).steady_torque(wob) * turned
    else:
        z = -wob / (string.axial + bit.rock_stiffness)
        force = -bit.rock_stiffness * z
        torque = bit_torque(parameters, wob, speed, force, speed)
    drags = string.drags
    walls: list[Numeric] = [0.0] * (len(string.torsional_stiffnesses) - 1)
    if wall.is_used(parameters):
        levers = wall.levers(parameters, string.rubbing_parts)
        walls = [
            coefficient * lever
            for (coefficient, _), lever in zip(coefficients_along(parameters, string, wob, speed), levers, strict=True)
        ]
    drag_below, angles, angle = sum(drags) - drags[0], [0.0 * torque], 0.0
    wall_below = sum(walls)
    for drag, rubbed, spring in zip(drags[1:], (*walls, 0.0), string.torsional_stiffnesses, strict=True):
        angle = angle - (torque + speed * drag_below + wall_below) / spring
        angles.append(angle)
        drag_below, wall_below = drag_below - drag, wall_below - rubbed
    table_torque = torque + speed * (sum(drags) + drive.table_damping) + sum(walls)
    constant = drive.gear * drive.torque_constant
    current = table_torque / constant
    return Steady(force, torque, table_torque, current, constant * speed + drive.resistance * current, tuple(angles), z)


def coefficients_along(
    parameters: Parameters, string: String, wob: Numeric, speed: Numeric
) -> list[tuple[Numeric, Numeric]]:
    """Of each node between top and bit the coefficients of friction along the wall in
    steady drilling, against turning and along the hole."""
    law = parameters.well.friction_along
    if not parameters.well.axial_friction:
        return [(wall.coefficient(law, speed), 0.0)] * (len(string.torsional_stiffnesses) - 1)
    rate = penetration_rate(parameters, wob, speed)
    return [
        wall.shares(law, speed, -rate / radius)
        for radius in wall.radii(parameters, string.lying_parts, string.rubbing_parts)
    ]


NEVER = 1e30  # s: when an ideal drive is switched on


def gains_of(parameters: Parameters, string: String) -> np.ndarray:
    """The gains of the voltage, an array (points, 5) or (1, 5): those of the regulator,
    those of the study, or 0."""
    drive = parameters.drive
    if drive.kind == "lqr":
        return regulator(parameters, string)
    gains = drive.gains if drive.kind == "dc_motor" and drive.gains is not None else (0.0,) * 5
    return np.array([gains])


def law_of(parameters: Parameters, string: String) -> Gains:
    """The law of a drive by torque, at the depths of the ``string``; that of an ideal
    drive, and of one of a script, has no gains."""
    drive = parameters.drive
    top = drive.inertia + string.kelly_inertia
    if drive.kind not in LAWS:
        return Gains(top, 0.0, 0.0)
    return LAWS[drive.kind].gains(drive, Seen(top, _modal_inertia(string), string.torsional, impedance(parameters)))


def impedance(parameters: Parameters) -> Numeric:
    """The torsional impedance of the pipe, or of the first section [N m s/rad]."""
    pipe, steel = parameters.drillstring.pipe, parameters.drillstring.material
    if (sections := parameters.drillstring.sections) is not None:
        first = parts_of(sections[:1], steel, 1.0)[0]
        return impedance_of(first.polar, first.density, first.shear)
    outer, inner = (pipe.outer_diameter * pipe.outer_diameter, pipe.inner_diameter * pipe.inner_diameter)
    return impedance_of(math.pi / 32 * (outer * outer - inner * inner), steel.density, steel.shear_modulus)


def lag_of(parameters: Parameters, string: String, steady: Steady, speed: Numeric) -> Numeric:
    """The lag [rad] at which the law gives the torque of steady drilling; 0 for a drive
    that is switched on later, or that has no integral gain and deviates in speed rather
    than in angle."""
    drive = parameters.drive
    if (own := own_drive(drive.kind)) is not None:
        lag = own.lag(steady.table_torque, steady.angles[-1], lane_values(parameters), speed)
        return np.where(np.asarray(drive.on_at) == 0.0, lag, 0.0)
    if drive.kind not in LAWS:
        return 0.0
    law = law_of(parameters, string)
    torque = steady.table_torque + law.twist_gain * steady.angles[-1]
    torque, stiffness, on_at = np.broadcast_arrays(torque, law.stiffness, drive.on_at)
    return -np.divide(torque, stiffness, out=np.zeros(torque.shape), where=(stiffness != 0.0) & (on_at == 0.0))


def _modal_inertia(string: String) -> Numeric:
    """The inertia J_b [kg m^2] that has, with the stiffness of the string, the first
    torsional frequency below a held top."""
    count = len(string.torsional_stiffnesses)

    def inertia(row: tuple[float, ...]) -> float:
        w = first_frequency(row[1 : 1 + count], row[1 + count :])
        return float(f"{row[0] / (w * w):.{DIGITS}g}")

    at_points = by_rows(inertia, string.torsional, *string.torsional_stiffnesses, *string.inertias)
    return at_points if at_points.ndim else float(at_points)


def regulator(parameters: Parameters, string: String) -> np.ndarray:
    """The gains (K_I, K_1, K_2, K_3, K_4), an array (points, 5). InputError where the
    Riccati equation has no solution."""
    drive = parameters.drive
    count = len(string.torsional_stiffnesses)
    rows = by_rows(
        lambda row: _gains(row, count),
        string.torsional,
        string.drive_inertia,
        drive.table_damping,
        sum(string.drags),
        drive.gear * drive.torque_constant,
        drive.inductance,
        drive.resistance,
        drive.control_weight,
        drive.lag_weight,
        drive.drive_speed_weight,
        drive.current_weight,
        drive.twist_weight,
        drive.bit_speed_weight,
        *string.torsional_stiffnesses,
        *string.inertias,
    )
    return np.atleast_2d(rows)


def first_frequency(stiffnesses: Any, inertias: Any) -> float:
    """The lowest frequency [rad/s] of a chain of springs with these ``stiffnesses``
    [N m/rad] below a held end, and ``inertias`` [kg m^2] below each; of axial motion,
    [N/m] and [kg]."""
    from scipy.linalg import eigh_tridiagonal

    stiffnesses, inertias = np.asarray(stiffnesses, dtype=float), np.asarray(inertias, dtype=float)
    diagonal = (stiffnesses + np.append(stiffnesses[1:], 0.0)) / inertias
    off_diagonal = -stiffnesses[1:] / np.sqrt(inertias[:-1] * inertias[1:])
    return float(
        np.sqrt(eigh_tridiagonal(diagonal, off_diagonal, eigvals_only=True, select="i", select_range=(0, 0))[0])
    )


def matrices(row: Sequence[float], springs: int) -> tuple[Array, Array]:
    """The matrix of the linear drive and string, with the states (lag, omega_d, I,
    twist, omega), and the column of V, from a ``row`` of :func:`regulator`'s numbers for
    a string of so many ``springs``."""
    k_t, J_d, c_d, c_b, motor, inductance, resistance = row[:7]
    w = first_frequency(row[13 : 13 + springs], row[13 + springs :])
    J_b = k_t / (w * w)
    system = np.array(
        [
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [-k_t / J_d, -c_d / J_d, motor / J_d, k_t / J_d, 0.0],
            [0.0, -motor / inductance, -resistance / inductance, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0],
            [k_t / J_b, 0.0, 0.0, -k_t / J_b, -c_b / J_b],
        ]
    )
    return system, np.array([[0.0], [0.0], [1.0 / inductance], [0.0], [0.0]])


def _gains(row: tuple[float, ...], springs: int) -> list[float]:
    system, voltage = matrices(row, springs)
    effort, lag, drive_speed, current, twist, bit_speed = row[7:13]
    weights = lag, drive_speed, current, twist, bit_speed
    gains = regulated(system, voltage, weights, effort, "", "the weights of the drive")
    return [gains[2], *gains[:2], *gains[3:]]
