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

A drive by torque has T_m of :mod:`nsdrill.models.segments.drive` in place of nK I -
c_rt w_0, and no current.

The bit, with phi = th_n + the drive's angle, omega = w_n, d = s0 sin(b phi) - u_n,
chi = c_c / W, and w_c the bit speed or the set speed (``bit.cutting.speed``)::

    F = k_c max(d, 0) max(1 + chi d', 0)
    T = F r_b [mu0 (tanh omega + alpha omega / (1 + beta omega^2) + nu omega)
               + on g zeta r],   r = sqrt(delta / r_b)
    ROP = max(c1 W sqrt|w_c| + c2, 0)
    delta = 2 pi ROP / sqrt(w_c^2 + w_s^2)
    g = (2/pi) atan(eps omega)
    on = (F - W_fs) / (0.1 W_fs), at least 0 and at most 1

Sources: Sarker, Rideout & Butt 2012 for the structure and the numbers, with the
friction's fifth number gamma = 1; its equations are reconstructed from the legible part
of the text. The rock's force is Hunt and Crossley's (1975): it has the printed damping
c_c at the working load, does not jump when the bit touches, and never pulls, unlike a
spring and a damper in parallel.

**The cutters** as a law of friction: the law is the load on them times g(omega) r(omega), over the rock's elastic
force. r is the root of the depth of cut over the bit's radius; two kinds of bits:

- Where the depth follows the bit speed and begins at a speed x_0 > 0 (ROP offset below
  zero), the bit *creeps*: r rises from zero there with an infinite slope, which holds
  it. All of r is in the law.
- Elsewhere the law has the r of the set speed, or of rest. The rest of r is zero at
  rest, so its product with g is not steep, and no part of the law.

An implicit stage solves for the bit speed. For a bit that creeps the unknown is tau,
with |omega| = (sqrt(x_0) + tau^2)^2: the advance is proportional to tau^2 and r to tau,
so Newton's method meets no square root.
"""

from __future__ import annotations

from nsdrill.equations.graph import Node, Number
from nsdrill.equations.library import SteepLaw, bounded_root, direction, friction, sincos, sqrt, tanh, touching
from nsdrill.equations.stage import first_slip
from nsdrill.equations.trace import Named, part
from nsdrill.models.segments.columns import Options, nodes_of

# The derivative is that of an r of at least this times ``creep_root``: a bit that creeps
# is held by an infinite slope, which no explicit step can follow.
LEAST_ROOT = 0.1


@part
def rock_force(speed: Node, n: Named) -> tuple[Node, Node]:
    """(the rock's force, the load on the cutters) at a bit speed, over the elastic
    force; ``n`` are lane parameters, with ``elastic``, that force [N],
    ``surface_slope`` [m/rad] and ``axial_velocity`` [m/s]."""
    closing = n.surface_slope * speed - n.axial_velocity
    damped = max(n.closing_factor * closing + 1.0, 0.0)
    share = (n.elastic * damped - n.threshold) * n.per_threshold_width
    return damped, damped * min(max(share, 0.0), 1.0)


@part
def depth_root(speed: Node, n: Named) -> Node:
    """r at a bit speed."""
    speed = n.live * (speed - n.set_speed) + n.set_speed
    advance = max(n.advance * sqrt(abs(speed)) + n.advance_offset, 0.0)
    depth = n.cutting_factor * advance / sqrt(speed * speed + n.slow_square)
    return bounded_root(depth, LEAST_ROOT * n.creep_root)


@part
def _value(speed: Node, n: Named) -> Node:
    root = depth_root(speed, n) if n.creep_start > 0.0 else n.flat_root
    return rock_force(speed, n)[1] * direction(n.smoothing * speed) * root


@part
def rest_of_cutting(speed: Node, n: Named) -> Node:
    """What the law leaves out of the load times g r."""
    root = 0.0 if n.creep_start > 0.0 else n.live * (depth_root(speed, n) - n.flat_root)
    return rock_force(speed, n)[1] * direction(n.smoothing * speed) * root


@part
def _at(x: Node, free: Node, n: Named) -> tuple[Node, Node]:
    """(bit speed, law) where the unknown of Newton's method is ``x``: tau where the bit
    creeps, else |omega|. The bit turns as it does without this torque, at the speed
    ``free``, which is its speed where that is too low to cut."""
    creeps, size = n.creep_start > 0.0, abs(free)
    held = creeps and size <= n.creep_start * n.creep_start
    root = n.creep_start + x * x
    speed = size + x if held else (root * root if creeps else x)
    r = n.creep_root * x / sqrt(sqrt(speed * speed + n.slow_square)) if creeps else n.flat_root
    value = 0.0 if held else direction(n.smoothing * speed) * r
    backward = free < 0.0
    omega = -speed if backward else speed
    value = rock_force(omega, n)[1] * value
    return omega, (-value if backward else value)


@part
def _begin(free: Node, relaxed: Node, n: Named) -> Node:
    """The unknown from which Newton's method begins, with ``relaxed`` [rad/s] in place
    of the elastic force: with the load at the speed ``free``, and x / (0.8 + x) in
    place of (2/pi) atan x."""
    size = abs(free)
    relaxed = relaxed * rock_force(free, n)[1]
    flat = Named(smoothing=n.smoothing, decay=0.0, rise=0.0, dynamic=n.flat_root)
    # Of a bit that creeps: r / tau at the free speed, or at twice the slow speed where
    # that is less.
    low = min(size, n.creep_speed)
    scaled = n.smoothing * low
    slope = relaxed * n.creep_root * scaled / (0.8 + scaled)
    slope = slope / sqrt(sqrt(low * low + n.slow_square))
    excess = max(size - n.creep_start * n.creep_start, 0.0)
    tau = slope + sqrt(slope * slope + 8.0 * n.creep_start * excess) + 1e-300
    tau = min(2.0 * excess / tau, sqrt(max(sqrt(size) - n.creep_start, 0.0)))
    return tau if n.creep_start > 0.0 else first_slip(size, relaxed, flat)


@part
def _steepest_fall(n: Named) -> Node:
    """At the bit speed of ``n``: where r falls, and where the load does."""
    damped, load = rock_force(n.speed, n)
    root = depth_root(n.speed, n) if n.creep_start > 0.0 else n.flat_root
    share = n.per_threshold_width * n.elastic * damped if load < damped else 0.0
    slope = abs(n.closing_factor * n.surface_slope) * (1.0 + share)
    return load * n.creep_fall + (slope * root if load > 0.0 else 0.0)


cutting = SteepLaw(_value, _at, _begin, _steepest_fall)


# The lane parameters of the rock and of the cutters.
ROCK = (
    "closing_factor", "threshold", "per_threshold_width", "smoothing", "live", "set_speed",
    "advance", "advance_offset", "cutting_factor", "slow_square", "creep_start", "creep_root",
    "creep_fall", "creep_speed", "flat_root",
)  # fmt: skip


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


def equations(t: Number, phase: Number, s: Named, p: Named, o: Options) -> tuple[dict[str, Number], dict[str, Number]]:
    """(slopes of the velocities and of the current, what the observer reads)."""
    last = o.nodes
    u, v, th, w = ([getattr(s, name) for name in names] for names in nodes_of(last))
    pulse, _ = sincos(p.pulsation_rate * t)
    flow = p.flow + p.pulsation * pulse

    # The chains. A node within pipe or collars has the mass and the inertia of a
    # segment; at either end a share is half of these over those of the node.
    axial: list[Number] = [0.0] * (last + 1)
    angular: list[Number] = [0.0] * (last + 1)
    for tube, first, end, shares, inertia_shares in (
        ("pipe", 0, o.pipes, ("top_share", "joint_pipe_share"),
         ("drive_share", "joint_pipe_inertia_share")),
        ("collar", o.pipes, last, ("joint_collar_share", "bit_share"),
         ("joint_collar_inertia_share", "bit_inertia_share")),
    ):  # fmt: skip
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

    # The bit on the lobed rock.
    sine, cosine = sincos(p.lobes * (s.twist + (p.set_speed * t + phase)))
    surface_slope = p.surface_amplitude * p.lobes * cosine
    interference = p.surface_amplitude * sine - s.z
    elastic = p.rock_stiffness * touching("rock", interference)
    omega, numbers = s.bit_speed, {name: getattr(p, name) for name in ROCK}
    rock = Named(elastic=elastic, surface_slope=surface_slope, axial_velocity=s.vz, speed=omega, **numbers)
    damped, _ = rock_force(omega, rock)
    force = elastic * damped
    rubbing = tanh(omega) + p.hump * omega / (p.narrowing * omega * omega + 1.0) + p.viscous * omega
    cut = friction("bit", slip=omega, normal=elastic, law=cutting, numbers=rock)
    cut = cut + elastic * rest_of_cutting(omega, rock)
    torque = p.friction_arm * force * rubbing + p.cutting_arm * cut

    # The drive.
    behind, ahead = s.drive_speed - p.set_speed, omega - p.set_speed
    if o.by_torque:
        law = p.drive_stiffness * s.lag + p.drive_damping * behind
        law = law + p.twist_gain * (s.twist - s.lag) + p.speed_gain * ahead
        motor_torque = min(max(-law, p.torque_least), p.torque_most)
        turned = angular[0] + motor_torque * p.per_drive_inertia
        turned, current_rate = turned if t >= p.on_at else p.set_acceleration, 0.0
    else:
        behind_current = s.current - p.steady_current
        law = p.gain_lag * s.lag + p.gain_drive_speed * behind + p.gain_bit_speed * ahead
        law = law + p.gain_twist * (s.twist - p.steady_twist) + p.gain_current * behind_current
        law = law if t >= p.on_at else 0.0
        motor_torque = p.motor * s.current - p.table_damping * s.drive_speed
        turned = angular[0] + motor_torque * p.per_drive_inertia
        drop = p.resistance * behind_current + p.motor * behind
        current_rate = -(law + drop) * p.per_inductance

    hoist = p.top_stiffness * s.u_0 + p.top_damping * s.v_0
    axial[0] = axial[0] - hoist * p.per_top_mass
    axial[last] = axial[last] + (force - p.wob) * p.per_bit_mass
    angular[0] = turned
    angular[last] = angular[last] - torque * p.per_bit_inertia
    names = nodes_of(last)
    slopes = dict(zip((*names.velocities, *names.speeds), (*axial, *angular), strict=True))
    closing = surface_slope * omega - s.vz
    return {**slopes, "current": current_rate}, {
        "sine_": sine,
        "cosine_": cosine,
        "interference_": interference,
        "closing_": closing,
        "force_": force,
    }
