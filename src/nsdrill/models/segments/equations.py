"""The equations of motion of the string of segments, once.

Nodes i = 0 (surface) .. n (bit); u_i [m] up from the string's shape off bottom, th_i
the angle less that of the set speed [rad], I the current [A]. With the numbers of
:mod:`nsdrill.models.segments.string`, the damping times beta_a and beta_t, and D_i the
mud's drag on a node::

    S_i = k_i (u_{i+1} - u_i + beta_a (v_{i+1} - v_i))
    M_i = kt_i (th_{i+1} - th_i + beta_t (w_{i+1} - w_i))

    m_0 v_0' = -k_top u_0 - c_top v_0 + S_0 + D_0
    m_i v_i' = S_i - S_{i-1} + D_i
    m_n v_n' = F - W - S_{n-1} + D_n

    J_0 w_0' = nK I - (c_rt + cw_0) w_0 + M_0
    J_i w_i' = M_i - M_{i-1} - cw_i w_i
    J_n w_n' = -T - M_{n-1} - cw_n w_n
    L I' = V - R I - nK w_0

A drive by torque has T_m of :mod:`nsdrill.models.segments.string` in place of nK I -
c_rt w_0, and no current.

Where the string rubs on the wall, the torque T_i of :mod:`nsdrill.models.segments.wall`
is subtracted at each node between top and bit; with ``axial_friction`` the force along
the hole, too.

F and T, the force and the torque of the rock on the bit, are those of
:mod:`nsdrill.models.segments.rock`, or of :mod:`nsdrill.models.surface`, where positions
are those above steady drilling and the top is fed at its rate of penetration.

Source: Sarker, Rideout & Butt 2012 for the structure and the numbers; its equations are
reconstructed from the legible part of the text.
"""

from __future__ import annotations

from nsdrill.equations.graph import Number
from nsdrill.equations.library import friction, friction_along, sincos
from nsdrill.equations.trace import Named, part
from nsdrill.models import surface
from nsdrill.models.own_drives import numbered
from nsdrill.models.segments.columns import Options, nodes_of
from nsdrill.models.segments.rock import bit_on_rock
from nsdrill.models.segments.wall import numbers_of, rubbing


def strain(positions: list[Number], velocities: list[Number], time: Number, i: int) -> Number:
    """Of the segment below node i: the lower node's value less the upper one's, with
    ``time`` times its rate."""
    rate = velocities[i + 1] - velocities[i]
    return positions[i + 1] - positions[i] + time * rate


def drag(p: Named, tube: str, flow: Number, v: Number) -> Number:
    """The mud's drag on a node, over the mass of a segment, less that of steady flow;
    for flow in either direction."""
    up = flow * getattr(p, f"per_{tube}_annulus") - v
    down = flow * getattr(p, f"per_{tube}_bore") + v
    outside = getattr(p, f"{tube}_annulus") * (up * abs(up))
    return outside - getattr(p, f"{tube}_bore") * (down * abs(down)) - getattr(p, f"{tube}_mean")


def torque_at_surface(s: Named, p: Named) -> Number:
    """The torque that the drive and the top of the string exert on each other [N m]."""
    return p.surface_stiffness * (s.lag - s.angle_1 + p.torsional_time * (s.drive_speed - s.speed_1))


def change_of_hook_load(s: Named, p: Named) -> Number:
    """The hook load less that of steady drilling [N]."""
    return -(p.top_stiffness * s.u_0 + p.top_damping * s.v_0)


@part
def torque_by_law(s: Named, p: Named, drive: int) -> tuple[Number, dict[str, Number]]:
    """(the torque of a drive by torque that is switched on, the slopes of its states)."""
    rates: dict[str, Number] = {}
    if drive:
        torque, rates = numbered(drive).law(s, p)
    else:
        law = p.drive_stiffness * s.lag + p.drive_damping * (s.drive_speed - p.set_speed)
        law = law + p.twist_gain * (s.twist - s.lag) + p.speed_gain * (s.bit_speed - p.set_speed)
        torque = -law
    return min(max(torque, p.torque_least), p.torque_most), rates


def equations(t: Number, phase: Number, s: Named, p: Named, o: Options) -> tuple[dict[str, Number], dict[str, Number]]:
    """(slopes of the velocities and of the current, what the observer reads)."""
    last = o.nodes
    u, v, th, w = ([getattr(s, name) for name in names] for names in nodes_of(last))
    pulse, _ = sincos(p.pulsation_rate * t)
    flow = p.flow + p.pulsation * pulse

    # The chains. A node within pipe, collars or a section has the mass and the inertia of a
    # segment; at either end a share is half of these over those of the node.
    axial: list[Number] = [0.0] * (last + 1)
    angular: list[Number] = [0.0] * (last + 1)
    for tube, first, end, shares, inertia_shares in o.tubes:
        stretch: Number = 0.0
        twist: Number = 0.0
        for i in range(first, end + 1):
            pull, turn = -stretch, -twist
            if i < end:
                stretch, twist = strain(u, v, p.axial_time, i), strain(th, w, p.torsional_time, i)
                pull, turn = pull + stretch, turn + twist
            pull, turn = getattr(p, f"{tube}_axial") * pull, getattr(p, f"{tube}_torsional") * turn
            mud, wall = drag(p, tube, flow, v[i]), getattr(p, f"{tube}_drag") * w[i]
            if first < i < end:
                axial[i], angular[i] = pull + mud, turn - wall
            else:
                share = getattr(p, shares[i == end])
                axial[i] = axial[i] + share * (2.0 * pull + mud)
                share = getattr(p, inertia_shares[i == end])
                angular[i] = angular[i] + share * (2.0 * turn - wall)

    if o.wall:
        for i in range(1, last):
            load = getattr(p, f"wall_{i}")
            contact = {"normal": load, "law": rubbing, "numbers": numbers_of(p)}
            if o.axial_friction:
                slip = (getattr(p, f"wall_per_radius_{i}") * (v[i] - p.penetration_rate), w[i])
                along, against = friction_along(f"wall_{i}", slip=slip, **contact)
                axial[i] = axial[i] - (getattr(p, f"wall_along_{i}") * along - getattr(p, f"wall_steady_{i}"))
            else:
                against = friction(f"wall_{i}", slip=w[i], **contact)
            angular[i] = angular[i] - against

    left: dict[str, Number] = {}
    if o.surface:
        interference, bit_force, bit_torque, left = surface.bit_on_rock(s, p, o.surface)
    else:
        drive_angle = p.set_speed * t + phase
        sine, cosine, interference, closing, bit_force, bit_torque = bit_on_rock(drive_angle, s, p, o.torques)
    surface_torque = torque_at_surface(s, p)  # noqa: F841  traces have it

    # The drive.
    of_drive: dict[str, Number] = {}
    if o.by_torque:
        drive_torque, of_drive = torque_by_law(s, p, o.drive)
        turned = angular[0] + drive_torque * p.per_drive_inertia
        turned, current_rate = turned if t >= p.on_at else p.set_acceleration, 0.0
        of_drive = {name: rate if t >= p.on_at else 0.0 for name, rate in of_drive.items()}
    else:
        behind, ahead = s.drive_speed - p.set_speed, s.bit_speed - p.set_speed
        behind_current = s.current - p.steady_current
        law = p.gain_lag * s.lag + p.gain_drive_speed * behind + p.gain_bit_speed * ahead
        law = law + p.gain_twist * (s.twist - p.steady_twist) + p.gain_current * behind_current
        law = law if t >= p.on_at else 0.0
        motor_torque = p.motor * s.current - p.table_damping * s.drive_speed
        turned = angular[0] + motor_torque * p.per_drive_inertia
        drop = p.resistance * behind_current + p.motor * behind
        current_rate = -(law + drop) * p.per_inductance

    hook_load_change = change_of_hook_load(s, p)
    axial[0] = axial[0] + hook_load_change * p.per_top_mass
    axial[last] = axial[last] + (bit_force - p.wob) * p.per_bit_mass
    angular[0] = turned
    angular[last] = angular[last] - bit_torque * p.per_bit_inertia
    names = nodes_of(last)
    slopes = dict(zip((*names.velocities, *names.speeds), (*axial, *angular), strict=True))
    slopes |= {"current": current_rate, **left, **of_drive}
    if o.surface:
        return slopes, {}
    return slopes, {
        "sine_": sine,
        "cosine_": cosine,
        "interference_": interference,
        "closing_": closing,
        "force_": bit_force,
    }
