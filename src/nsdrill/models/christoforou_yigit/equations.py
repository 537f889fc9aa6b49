"""The equations of motion of the 4-DOF oscillator, once, as the theory page derives
them from the Lagrangian of the coupled system.

``s`` holds the states, ``p`` the lane parameters, ``o`` the options; all SI.

Further forces on the collar: rotating mud, stabilisers with a clearance, the weight
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

from nsdrill.equations.graph import Number
from nsdrill.equations.library import friction, friction_along, sincos, sqrt, touching
from nsdrill.equations.trace import Named
from nsdrill.models import surface
from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.friction import KeyedLaw, law_numbered, numbers_of
from nsdrill.models.motor import torque_rate
from nsdrill.models.own_drives import numbered


def multiple_sine(sine: Number, cosine: Number, lobes: int) -> Number:
    """sin(lobes phi) from sine and cosine of phi: Chebyshev's recurrence."""
    before: Number = 0.0
    now = sine
    for _ in range(lobes - 1):
        before, now = now, 2.0 * cosine * now - before
    return now


def bit_on_rock(
    drive_angle: Number, s: Named, p: Named, lobes: int, law: KeyedLaw, torques: int = 0
) -> tuple[Number, Number, Number, Number]:
    """(sine and cosine of the bit's angle, force and torque of the rock), which is
    lobed; ``torques`` as :class:`.columns.Options` has it."""
    sine, cosine = sincos(s.twist + drive_angle)
    surface = p.surface_amplitude * multiple_sine(sine, cosine, lobes)
    return (sine, cosine, *loads_of_rock(surface - s.z, s.bit_speed, p, law, torques))


def loads_of_rock(
    interference: Number, bit_speed: Number, p: Named, law: KeyedLaw, torques: int = 0
) -> tuple[Number, Number]:
    """The force and the torque of the rock; given ``torques`` do not depend on the
    force."""
    force = p.rock_stiffness * touching("rock", interference)
    load = p.bit_load if torques else force
    return force, friction("bit", slip=bit_speed, normal=load, law=law, numbers=numbers_of(p, "bit", law))


def equations(t: Number, phase: Number, s: Named, p: Named, o: Options) -> tuple[dict[str, Number], dict[str, Number]]:
    """(slopes of the velocities by name, further outputs)."""
    # Where the collar is. The floor of the radius has an effect at the hole's centre
    # only, where no force acts.
    radius = sqrt(max(s.x * s.x + s.y * s.y, 1e-60))
    around = s.x * s.vy - s.y * s.vx  # radius times the speed around the hole
    along = s.vz - p.penetration_rate if o.axial_friction else 0.0

    law, drive_angle, slopes = law_numbered(o.friction), p.set_speed * t + phase, {}
    if o.surface:
        sine, cosine = sincos(s.twist + drive_angle)
        # traces have the interference
        interference, bit_force, bit_torque, slopes = surface.bit_on_rock(s, p, o.surface)  # noqa: RUF059
    else:
        sine, cosine, bit_force, bit_torque = bit_on_rock(drive_angle, s, p, o.lobes, law, o.torques)

    # The wall.
    wall_law, stabilizer_law = law_numbered(o.wall_law), law_numbered(o.stabilizer_law)
    stiffness = p.bending - p.softening_torque * bit_torque - p.softening_force * bit_force
    radial, tangential, axial_friction, wall_friction = 0.0, 0.0, 0.0, 0.0
    penetration = touching("wall", radius - p.gap)
    if penetration > 0.0:
        wall_force = p.wall_stiffness * penetration
        if o.hertz:
            wall_force = wall_force * sqrt(penetration)
        slip = s.bit_speed * p.collar_radius + around / radius
        numbers = numbers_of(p, "wall", wall_law)
        if o.axial_friction:
            wall_friction, axial_friction = friction_along(
                "wall", slip=(slip, along), normal=wall_force, law=wall_law, numbers=numbers
            )
        else:
            wall_friction = friction("wall", slip=slip, normal=wall_force, law=wall_law, numbers=numbers)
        radial = wall_force / radius
        tangential = wall_friction / radius

    # The stabilisers carry the force of the bent span, which is the normal load of
    # their friction.
    stabilizer_friction = 0.0
    if o.stabilizer:
        bent = touching("stabilizer", radius - p.clearance)
        if bent > 0.0:
            carried = stiffness * bent
            slip = s.bit_speed * p.stabilizer_radius + p.clearance * around / radius / radius
            numbers = numbers_of(p, "stabilizer", stabilizer_law)
            if o.axial_friction:
                stabilizer_friction, along_there = friction_along(
                    "stabilizer", slip=(slip, along), normal=abs(carried), law=stabilizer_law, numbers=numbers
                )
                axial_friction = axial_friction + along_there
            else:
                stabilizer_friction = friction(
                    "stabilizer", slip=slip, normal=abs(carried), law=stabilizer_law, numbers=numbers
                )
            radial = radial + carried / radius
            tangential = tangential + stabilizer_friction / radius
    else:
        radial = radial + stiffness

    # Lateral forces at the collar's centre; the drag is relative to the mud.
    ux, uy = s.vx, s.vy
    if o.swirl:
        ux, uy = s.vx + p.swirl_rate * s.y, s.vy - p.swirl_rate * s.x
    drag = p.drag * sqrt(ux * ux + uy * uy)
    F_x = tangential * s.y - radial * s.x - drag * ux
    F_y = -tangential * s.x - radial * s.y - drag * uy
    if o.swirl:
        F_x = F_x + p.swirl_momentum * (p.swirl_rate * s.x - 2.0 * s.vy)
        F_y = F_y + p.swirl_momentum * (p.swirl_rate * s.y + 2.0 * s.vx)
    if o.weight:
        F_y = F_y - p.weight

    # The drive.
    torque = bit_torque
    pipe_twist = s.twist - s.lag if o.driven else s.twist
    surface_torque = -p.torsional_stiffness * pipe_twist
    if o.driven:
        shaft_torque = p.shaft_damping * (s.drive_speed - s.bit_speed)
        drive_torque = -(
            p.drive_stiffness * s.lag
            + p.drive_damping * (s.drive_speed - p.set_speed)
            + p.twist_gain * pipe_twist
            + p.speed_gain * (s.bit_speed - p.set_speed)
        )
        if o.motor:
            drive_torque = s.motor_torque
            slopes["motor_torque"] = torque_rate(s, p, o.regulated)
        if o.drive:
            drive_torque, of_drive = numbered(o.drive).law(s, p)
            slopes |= of_drive
        if o.limited:
            drive_torque = max(min(drive_torque, p.torque_limit), 0.0)
        pipe_torque = -surface_torque - shaft_torque
        slopes["drive_speed"] = (pipe_torque + drive_torque) * p.per_drive_inertia
        torque = bit_torque - shaft_torque

    # The string, whose mass centre is off the axis.
    moment = p.torsional_damping * s.bit_speed - surface_torque
    moment = moment + wall_friction * p.collar_radius + torque
    if o.stabilizer:
        moment = moment + stabilizer_friction * p.stabilizer_radius
    if o.weight:
        moment = moment + p.eccentric_weight * cosine
    angular = -(p.unbalance_arm * (F_y * cosine - F_x * sine) + moment) * p.per_inertia
    square = s.bit_speed * s.bit_speed
    axial_force = bit_force - axial_friction - p.wob - p.axial_stiffness * s.z
    slopes["vx"] = p.unbalance_arm * (square * cosine + angular * sine) + F_x * p.per_lateral_mass
    slopes["vy"] = p.unbalance_arm * (square * sine - angular * cosine) + F_y * p.per_lateral_mass
    slopes["vz"] = (axial_force - p.axial_damping * s.vz) * p.per_axial_mass
    slopes["bit_speed"] = angular
    outputs = {"cosine_now": cosine, "sine_now": sine, "radius_now": radius}
    if not o.implicit:  # else as they are where friction is solved for
        direction, decay = law.factors(s.bit_speed, numbers_of(p, "bit", law))
        outputs |= {"direction_now": direction, "decay_now": decay}
    return slopes, outputs
