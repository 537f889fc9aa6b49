"""The lumped string: masses, inertias, stiffnesses and drag of its segments, and steady
drilling.

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
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from nsdrill.models.operation import Numeric
from nsdrill.models.sections import Tubular
from nsdrill.models.segments.parameters import Parameters

# Bit speeds [rad/s] at which the cutting torque is evaluated, up to 53.
SPEEDS = tuple(0.01 * 1.2**k for k in range(48))
LEAST_ADVANCE = 1e-12  # m/s at 1 rad/s; with less the bit never cuts


class Segment(NamedTuple):
    """A segment of pipe or of collar: its length [m], stiffnesses [N/m, N m/rad], mass
    [kg], inertia [kg m^2], drag coefficients of annulus and bore [kg/m], drag to the
    wall [N m s/rad] and areas of annulus and bore [m^2]."""

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


class String(NamedTuple):
    """The whole string: a segment of pipe and one of collar, and how many of each; the
    masses [kg] and inertias [kg m^2] at the ends and at the junction; the axial
    stiffness of the whole string with the hoist's spring [N/m] and its torsional
    stiffness [N m/rad]; the kelly's inertia [kg m^2]. ``drive_inertia`` is that of the
    electric motor, with its table, kelly and half a segment."""

    pipe: Segment
    collar: Segment
    pipes: int
    collars: int
    top_mass: Numeric
    joint_mass: Numeric
    bit_mass: Numeric
    drive_inertia: Numeric
    joint_inertia: Numeric
    bit_inertia: Numeric
    axial: Numeric
    torsional: Numeric
    kelly_inertia: Numeric

    @property
    def drags(self) -> tuple[Any, ...]:
        """The drag to the wall [N m s/rad] of each node, from the surface to the
        bit."""
        pipe, collar = self.pipe.drag, self.collar.drag
        return (pipe / 2, *(pipe,) * (self.pipes - 1), (pipe + collar) / 2, *(collar,) * (self.collars - 1), collar / 2)

    @property
    def torsional_stiffnesses(self) -> tuple[Any, ...]:
        """The torsional stiffness [N m/rad] of each segment, from the surface to the
        bit."""
        return (self.pipe.torsional,) * self.pipes + (self.collar.torsional,) * self.collars

    @property
    def axial_stiffnesses(self) -> tuple[Any, ...]:
        """The axial stiffness [N/m] of each segment, from the surface to the bit."""
        return (self.pipe.axial,) * self.pipes + (self.collar.axial,) * self.collars

    @property
    def inertias(self) -> tuple[Any, ...]:
        """The inertia [kg m^2] of each node but the first, to the bit."""
        return (
            *(self.pipe.inertia,) * (self.pipes - 1),
            self.joint_inertia,
            *(self.collar.inertia,) * (self.collars - 1),
            self.bit_inertia,
        )


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
    pipe = _segment(parameters, drill.pipe, (depth - drill.collar.length) / segments.pipe)
    collar = _segment(parameters, drill.collar, drill.collar.length / segments.collar)
    area, polar = _section(kelly.outer_diameter, kelly.inner_diameter)
    compliance = 1 / segments.top.stiffness + segments.pipe / pipe.axial + segments.collar / collar.axial
    return String(
        pipe,
        collar,
        segments.pipe,
        segments.collar,
        segments.top.mass + steel.density * area * kelly.length + pipe.mass / 2,
        (pipe.mass + collar.mass) / 2,
        bit.mass + collar.mass / 2,
        drive.table_inertia
        + drive.gear * drive.gear * drive.motor_inertia
        + steel.density * polar * kelly.length
        + pipe.inertia / 2,
        (pipe.inertia + collar.inertia) / 2,
        bit.mass * bit.radius * bit.radius / 2 + collar.inertia / 2,
        1 / compliance,
        1 / (segments.pipe / pipe.torsional + segments.collar / collar.torsional),
        steel.density * polar * kelly.length,
    )


def _section(outer: Numeric, inner: Numeric) -> tuple[Numeric, Numeric]:
    """The area [m^2] and the polar moment [m^4] of a ring."""
    squares = outer * outer, inner * inner
    return (math.pi / 4 * (squares[0] - squares[1]), math.pi / 32 * (squares[0] * squares[0] - squares[1] * squares[1]))


def _segment(parameters: Parameters, part: Tubular, length: Numeric) -> Segment:
    steel, mud, hole = parameters.drillstring.material, parameters.mud, parameters.well.diameter
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
    )


def bit_torque(parameters: Parameters, wob: Numeric, set_speed: Numeric, force: Numeric, speed: Numeric) -> Numeric:
    """The torque of the rock on the bit [N m] under a ``force`` [N] at a bit ``speed``
    [rad/s], with friction and cutting (:mod:`nsdrill.models.segments.equations`)."""
    bit, friction, cutting = parameters.bit, parameters.bit.friction, parameters.bit.cutting
    cutting_speed = speed if cutting.speed == "live" else set_speed
    advance = np.maximum(cutting.c1 * wob * np.sqrt(np.abs(cutting_speed)) + cutting.c2, 0.0)
    depth = 2 * math.pi * advance / np.sqrt(cutting_speed * cutting_speed + cutting.slow * cutting.slow)
    threshold = parameters.segments.threshold_force
    on = np.clip((force - threshold) / (0.1 * threshold), 0.0, 1.0)
    rubbing = (
        np.tanh(speed) + friction.hump * speed / (1 + friction.narrowing * speed * speed) + friction.viscous * speed
    )
    bite = on * (2 / math.pi) * np.arctan(cutting.smoothing * speed) * cutting.zeta * np.sqrt(depth / bit.radius)
    return force * bit.radius * (friction.level * rubbing + bite)


def depth_root(parameters: Parameters, wob: Numeric, speed: Numeric) -> Numeric:
    """sqrt(depth of cut / radius) at a ``speed`` [rad/s] that the depth follows, under
    a weight on bit [N]."""
    bit, cutting = parameters.bit, parameters.bit.cutting
    advance = np.maximum(cutting.c1 * wob * np.sqrt(speed) + cutting.c2, 0.0)
    return np.sqrt(2 * math.pi * advance / bit.radius / np.sqrt(speed * speed + cutting.slow * cutting.slow))


def creep_parameters(parameters: Parameters, wob: Numeric, set_speed: Numeric) -> dict[str, Numeric]:
    """The lane parameters of the cutting torque that the implicit method reads
    (:mod:`nsdrill.models.segments.equations`), by name: those of a bit that creeps, whose
    depth of cut follows its speed and begins at a speed above zero, or else the root r =
    sqrt(depth of cut / radius) at the set speed or at rest. Of a bit that creeps: the
    root of the speed at which it begins to cut (0 for any other bit), r over that and
    over the root of its speed, the steepest fall of r, and twice the slow speed."""
    bit, cutting = parameters.bit, parameters.bit.cutting
    live = cutting.speed == "live"
    advance, offset = np.broadcast_arrays(np.asarray(cutting.c1 * wob, dtype=float), cutting.c2)
    creeps = (offset < 0.0) & live
    start = np.where(creeps, -offset / np.maximum(advance, LEAST_ADVANCE), 0.0)
    roots = [depth_root(parameters, wob, speed) for speed in SPEEDS]
    falls = [
        (before - after) / (b - a) for before, after, a, b in zip(roots, roots[1:], SPEEDS, SPEEDS[1:], strict=False)
    ]
    steepest = np.max(np.array(falls), axis=0, initial=0.0)
    return {
        "creep_start": start,
        "creep_root": np.sqrt(2 * math.pi / bit.radius * cutting.c1 * wob),
        "creep_fall": np.where(creeps, steepest, 0.0),
        "creep_speed": 2 * cutting.slow,
        "flat_root": np.where(creeps, 0.0, depth_root(parameters, wob, 0.0 * set_speed if live else set_speed)),
    }


def steady_of(parameters: Parameters, string: String, wob: Numeric, speed: Numeric) -> Steady:
    """Steady drilling under a weight on bit [N] with the set speed [rad/s]."""
    bit, drive = parameters.bit, parameters.drive
    z = -wob / (string.axial + bit.rock_stiffness)
    force = -bit.rock_stiffness * z
    torque = bit_torque(parameters, wob, speed, force, speed)
    drags = string.drags
    drag_below, angles, angle = sum(drags) - drags[0], [0.0 * torque], 0.0
    for drag, spring in zip(drags[1:], string.torsional_stiffnesses, strict=True):
        angle = angle - (torque + speed * drag_below) / spring
        angles.append(angle)
        drag_below = drag_below - drag
    table_torque = torque + speed * (sum(drags) + drive.table_damping)
    constant = drive.gear * drive.torque_constant
    current = table_torque / constant
    return Steady(force, torque, table_torque, current, constant * speed + drive.resistance * current, tuple(angles), z)
