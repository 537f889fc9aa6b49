"""The equations of motion of the elastic collar, once.

Collar: simply supported, deflection X = sum x_n sin(n pi xi), Y alike, n = 1 ... N;
modal mass m and stiffness k_n (Ghasemloonia, Rideout & Butt for m and P; the torque as
in Christoforou & Yigit). Walls and mud act at stations j, with phi_jn = sin(n pi
xi_j)::

    k_n = E I (n pi)^4 / (2 l^3) - P (n pi)^2 / (2 l) - T (n pi)^3 / (2 l^2)
    N_j = k_j max(r_j - c_j, 0)^(1 or 3/2),   T_j = N_j f(omega R + theta_j' r_j)
    f_j = -N_j e_r - T_j e_theta - d_j |v_j| v_j
    F_n = -k_n (x_n, y_n) - c_n (x_n', y_n') + sum_j phi_jn f_j

    J_e phi'' = -T_ob - c_t omega - k_t (psi - lag) + c_s (omega_d - omega) - sum_j T_j R
                - sum_n q_n (F_yn cos phi - F_xn sin phi)
    x_n'' = q_n (omega^2 cos phi + phi'' sin phi) + F_xn / m
    y_n'' = q_n (omega^2 sin phi - phi'' cos phi) + F_yn / m

with q_n = m_e e_n / m and J_e = J + sum_n m_e e_n (e_n - q_n): Lagrange's equations of
the kinetic energy sum_n 1/2 m_e |v_n + e_n omega (-sin phi, cos phi)|^2 + 1/2 (m - m_e)
|v_n|^2 + 1/2 J omega^2. Bit, rock and twist are those of the lumped model, the drive
that of :mod:`nsdrill.models.top`: lag and c_s are zero of an ideal one.
"""

from __future__ import annotations

from collections.abc import Iterable

from nsdrill.equations.graph import Number
from nsdrill.equations.library import friction, sqrt, touching
from nsdrill.equations.trace import Named
from nsdrill.models.beam.columns import Options
from nsdrill.models.christoforou_yigit.equations import bit_on_rock
from nsdrill.models.friction import law_numbered, numbers_of
from nsdrill.models.top import driven


def along(shape: Iterable[Number], values: Iterable[Number]) -> Number:
    """The sum of a mode's or a station's share in each of ``values``."""
    return sum(a * b for a, b in zip(shape, values, strict=True))


def equations(t: Number, phase: Number, s: Named, p: Named, o: Options) -> tuple[dict[str, Number], dict[str, Number]]:
    """(slopes of the velocities by name, further outputs)."""
    modes, stations = range(1, o.modes + 1), range(1, o.stations + 1)
    x, vx, y, vy = ([getattr(s, f"{name}_{n}") for n in modes] for name in ("x", "vx", "y", "vy"))
    phi = [[getattr(p, f"phi_{j}_{n}") for n in modes] for j in stations]  # of each station
    law, angle = law_numbered(o.bit_law), p.set_speed * t + phase
    sine, cosine, bit_force, bit_torque = bit_on_rock(angle, s, p, o.lobes, law, o.torques)
    outputs = {"cosine": cosine, "sine": sine, "torque": bit_torque}

    # Wall and mud at the stations.
    forces_x, forces_y, wall = [], [], law_numbered(o.wall_law)
    wall_force, wall_friction, wall_contacts, slip_sum = 0.0, 0.0, 0.0, 0.0
    for j in stations:
        X, VX, Y, VY = (along(phi[j - 1], values) for values in (x, vx, y, vy))
        # The floor has an effect at the hole's centre only, where no force acts.
        radius = sqrt(max(X * X + Y * Y, 1e-60))
        normal, radial, tangential, rubbing, touches, slips = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        penetration = touching(f"wall_{j}", radius - getattr(p, f"gap_{j}"))
        if penetration > 0.0:
            normal = getattr(p, f"wall_stiffness_{j}") * penetration
            if o.hertz:
                normal = normal * sqrt(penetration)
            slips = s.bit_speed * p.collar_radius + (X * VY - Y * VX) / radius
            rubbing = friction(f"wall_{j}", slip=slips, normal=normal, law=wall, numbers=numbers_of(p, "wall", wall))
            radial, tangential, touches = normal / radius, rubbing / radius, 1.0
        drag = getattr(p, f"drag_{j}") * sqrt(VX * VX + VY * VY)
        forces_x.append(tangential * Y - radial * X - drag * VX)
        forces_y.append(-tangential * X - radial * Y - drag * VY)
        wall_force, wall_friction = wall_force + normal, wall_friction + rubbing
        wall_contacts, slip_sum = wall_contacts + touches, slip_sum + slips
        outputs |= {f"radius_{j}": radius, f"outward_{j}": X * VX + Y * VY}
    outputs |= {"wall_contacts": wall_contacts, "slip_sum": slip_sum}

    # Forces on the modes, and their moment about the axis, as mass centres are off it.
    load = p.softening_force * bit_force + p.softening_constant
    pipe_twist = s.twist - s.lag if o.driven else s.twist
    surface_torque = -p.torsional_stiffness * pipe_twist
    moment = p.torsional_damping * s.bit_speed - surface_torque
    moment = moment + wall_friction * p.collar_radius + bit_torque
    of_drive: dict[str, Number] = {}
    if o.driven:
        of_drive, shaft_torque, drive_torque = driven(s, p, o, pipe_twist, surface_torque)  # noqa: RUF059  check reads it
        moment = moment - shaft_torque
    F_x, F_y = [], []
    for n in modes:
        stiffness = float(n**4) * p.bending - float(n**2) * load
        if o.torque:
            stiffness = stiffness - float(n**3) * p.softening_torque * bit_torque
        damping = float(n**2) * p.structural
        shape = [phi[j - 1][n - 1] for j in stations]
        F_x.append(along(shape, forces_x) - stiffness * x[n - 1] - damping * vx[n - 1])
        F_y.append(along(shape, forces_y) - stiffness * y[n - 1] - damping * vy[n - 1])
        if n in o.eccentric:
            arm = getattr(p, f"unbalance_arm_{n}")
            moment = moment + arm * (F_y[n - 1] * cosine - F_x[n - 1] * sine)

    angular = -moment * p.per_inertia
    square = s.bit_speed * s.bit_speed
    axial_force = bit_force - p.wob - p.axial_stiffness * s.z
    slopes = {**of_drive, "vz": (axial_force - p.axial_damping * s.vz) * p.per_axial_mass, "bit_speed": angular}
    for n in modes:
        ax, ay = F_x[n - 1] * p.per_lateral_mass, F_y[n - 1] * p.per_lateral_mass
        if n in o.eccentric:
            arm = getattr(p, f"unbalance_arm_{n}")
            ax = arm * (square * cosine + angular * sine) + ax
            ay = arm * (square * sine - angular * cosine) + ay
        slopes |= {f"vx_{n}": ax, f"vy_{n}": ay}
    return slopes, outputs
