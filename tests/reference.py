"""The equations of motion once more, in plain Python and NumPy, written from the theory
page, not from the sources.

Nothing here imports nsdrill. The state is (x, vx, y, vy, z, vz, twist, bit_speed); the
lateral mass matrix is solved as it comes out of the Lagrangian, as a 3 x 3 system, not
by the eliminated form that the package integrates.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp


@dataclass(frozen=True)
class Case:
    """All parameters and one operating point, flat, in SI units; the defaults are those
    of the theory page."""

    depth: float = 5000.0
    wob: float = 22240.0
    speed: float = 3.0
    well_diameter: float = 0.381
    wall_stiffness: float = 25e6
    wall_law: str = "linear"
    wall_static: float = 0.35
    wall_dynamic: float = 0.30
    wall_smoothing: float = 500.0
    wall_decay: float = 3.0
    collar_od: float = 0.2286
    collar_id: float = 0.0762
    collar_length: float = 200.0
    span: float = 19.81
    pipe_od: float = 0.127
    pipe_id: float = 0.1086
    density: float = 7850.0
    young: float = 210e9
    shear: float = 79.6e9
    eccentricity: float = 0.0127
    eccentric_mass: str = "total"
    softening: str = "live"
    axial_damping: float = 4000.0
    torsional_damping: float = 50.0
    mud_density: float = 1500.0
    added_mass: float = 1.7
    mud_drag: float = 1.0
    lobes: int = 3
    amplitude: float = 1e-3
    rock_stiffness: float = 25e6
    zeta: float = 1.0
    c1: float = 1.35e-8
    c2: float = -1.9e-4
    bit_static: float = 0.5
    bit_dynamic: float = 0.2
    bit_smoothing: float = 500.0
    bit_decay: float = 3.0
    bit_law: str = "hyperbolic"
    bit_from: float = 1.0
    b0: float = 0.0239
    b1: float = 1.91
    b2: float = 8.5
    b3: float = 5.47

    def but(self, **changes):
        return replace(self, **changes)

    # Lumped coefficients: simply supported span of length l with shape sin(pi x / l); a
    # third of the pipe moves.
    @property
    def pipe_length(self):
        return self.depth - self.collar_length

    @property
    def m_c(self):
        return self.density * _area(self.collar_od, self.collar_id) * self.span / 2

    @property
    def m_l(self):
        fluid = self.mud_density * math.pi / 4 * (self.collar_id**2 + self.added_mass * self.collar_od**2)
        return self.m_c + fluid * self.span / 2

    @property
    def m_e(self):
        return self.m_l if self.eccentric_mass == "total" else self.m_c

    @property
    def c_h(self):
        return 2 / (3 * math.pi) * self.mud_density * self.mud_drag * self.collar_od * self.span

    @property
    def k_bend(self):
        second = math.pi / 64 * (self.collar_od**4 - self.collar_id**4)
        return self.young * second * math.pi**4 / (2 * self.span**3)

    @property
    def m_a(self):
        return self.density * (
            _area(self.collar_od, self.collar_id) * self.collar_length
            + _area(self.pipe_od, self.pipe_id) * self.pipe_length / 3
        )

    @property
    def k_a(self):
        return self.young * _area(self.pipe_od, self.pipe_id) / self.pipe_length

    @property
    def J(self):
        return self.density * (
            _polar(self.collar_od, self.collar_id) * self.collar_length
            + _polar(self.pipe_od, self.pipe_id) * self.pipe_length / 3
        )

    @property
    def k_t(self):
        return self.shear * _polar(self.pipe_od, self.pipe_id) / self.pipe_length

    @property
    def gap(self):
        return (self.well_diameter - self.collar_od) / 2

    @property
    def collar_radius(self):
        return self.collar_od / 2

    @property
    def bit_radius(self):
        return self.well_diameter / 2

    @property
    def depth_of_cut(self):
        rate = self.c1 * self.wob * math.sqrt(self.speed) + self.c2
        return 2 * math.pi * max(rate, 0.0) / self.speed


def _area(outer, inner):
    return math.pi / 4 * (outer**2 - inner**2)


def _polar(outer, inner):
    return math.pi / 32 * (outer**4 - inner**4)


def friction(speed, static, dynamic, smoothing, decay):
    """f(v) = (2/pi) atan(eps v) [(mu_s - mu_d)/(1 + tau |v|) + mu_d]."""
    # of a complex number too, which abs() makes real
    size = np.where(np.real(speed) < 0, -speed, speed)
    return 2 / np.pi * np.arctan(smoothing * speed) * ((static - dynamic) / (1 + decay * size) + dynamic)


def disc_torque(bit, wob, speed):
    """Torque on a disc that rubs on the rock: the bit of a string that only twists."""
    law = bit.friction
    return wob * 2 / 3 * bit.radius * friction(speed, law.static, law.dynamic, law.smoothing, law.decay)


def bit_arm(case, speed):
    """The torque of the bit over its force [m] by each friction law."""
    c = case
    if c.bit_law == "rational":
        return c.b0 * (np.tanh(c.b1 * speed) + c.b2 * speed / (1 + c.b3 * speed**2))
    size = np.abs(speed)
    share = {
        "hyperbolic": 1 / (1 + c.bit_decay * size),
        "linear": np.maximum(0.0, 1 - size / c.bit_from),
        "exponential": np.exp(-c.bit_decay * size),
    }.get(c.bit_law)
    if share is None:
        pytest.skip(f"tests/reference.py has no formula of the law {c.bit_law}: a line of bit_arm compares it")
    radius = c.well_diameter / 2
    rub = 2 / 3 * radius * (c.bit_dynamic + (c.bit_static - c.bit_dynamic) * share)
    return 2 / np.pi * np.arctan(c.bit_smoothing * speed) * (rub + c.zeta * math.sqrt(radius * c.depth_of_cut))


def contacts(case, t, state, phase=0.0, touching=None):
    """Contact forces of states [8] or [8, n] at times t: a dict. ``touching`` says
    whether bit and collar touch where that is not to be told from the state."""
    x, vx, y, vy, z, _, twist, omega = state
    c = case
    phi = twist + phase + c.speed * t
    interference = c.amplitude * np.sin(c.lobes * phi) - z
    bit_force = c.rock_stiffness * (np.maximum(interference, 0.0) if touching is None else touching[0] * interference)
    cutting = c.zeta * math.sqrt(c.bit_radius * c.depth_of_cut) * 2 / np.pi * np.arctan(c.bit_smoothing * omega)
    law = friction(omega, c.bit_static, c.bit_dynamic, c.bit_smoothing, c.bit_decay)
    bit_torque = bit_force * (2 / 3 * c.bit_radius * law + cutting)
    if c.bit_law != "hyperbolic":
        bit_torque = bit_force * bit_arm(c, omega)
    r = np.sqrt(x * x + y * y)
    depth = np.maximum(r - c.gap, 0.0) if touching is None else touching[1] * (r - c.gap)
    normal = c.wall_stiffness * depth ** (1.5 if c.wall_law == "hertz" else 1.0)
    tangential_speed = (
        np.divide(x * vy - y * vx, r, out=np.zeros_like(r), where=np.real(r) > 0)
        if np.ndim(r)
        else ((x * vy - y * vx) / r if r > 0 else 0.0)
    )
    slip = omega * c.collar_radius + tangential_speed
    rub = normal * friction(slip, c.wall_static, c.wall_dynamic, c.wall_smoothing, c.wall_decay)
    force, torque = {"live": (bit_force, bit_torque), "static": (c.wob, 0.0), "none": (0.0, 0.0)}[c.softening]
    stiffness = c.k_bend - (force * math.pi**2 / (2 * c.span) + torque * math.pi**3 / (2 * c.span**2))
    return {
        "phi": phi,
        "interference": interference,
        "bit_force": bit_force,
        "bit_torque": bit_torque,
        "radius": r,
        "wall_force": normal,
        "wall_friction": rub,
        "slip": slip,
        "stiffness": stiffness,
        "tangential_speed": tangential_speed,
    }


def derivative(case, t, state, phase=0.0, touching=None):
    """d(state)/dt, shape as ``state``: [8] or [8, n]."""
    c = case
    x, vx, y, vy, z, vz, twist, omega = state
    f = contacts(c, t, state, phase, touching)
    cos, sin = np.cos(f["phi"]), np.sin(f["phi"])
    r = np.where(np.real(f["radius"]) > 0, f["radius"], 1.0)
    drag = c.c_h * np.sqrt(vx * vx + vy * vy)
    # e_r = (x, y)/r, e_theta = (-y, x)/r
    force_x = -f["stiffness"] * x - drag * vx - f["wall_force"] * x / r + f["wall_friction"] * y / r
    force_y = -f["stiffness"] * y - drag * vy - f["wall_force"] * y / r - f["wall_friction"] * x / r
    moment = -f["bit_torque"] - c.torsional_damping * omega - c.k_t * twist - f["wall_friction"] * c.collar_radius
    # Lagrange with T = m_e |v_G|^2/2 + (m_l - m_e) |v_C|^2/2 + J phi'^2/2:
    # m_l x'' - s sin(phi) phi'' = F_x + s cos(phi) phi'^2
    #   m_l y'' + s cos(phi) phi'' = F_y + s sin(phi) phi'^2                  with s = m_e e0
    #   (J + m_e e0^2) phi'' - s sin(phi) x'' + s cos(phi) y'' = moment
    s = c.m_e * c.eccentricity
    zero, one = np.zeros_like(omega), np.ones_like(omega)
    matrix = np.array(
        [
            [c.m_l * one, zero, -s * sin],
            [zero, c.m_l * one, s * cos],
            [-s * sin, s * cos, (c.J + s * c.eccentricity) * one],
        ]
    )
    right = np.array([force_x + s * cos * omega**2, force_y + s * sin * omega**2, moment + zero])
    if np.ndim(omega):
        ax, ay, alpha = np.linalg.solve(np.moveaxis(matrix, -1, 0), right.T[:, :, None])[:, :, 0].T
    else:
        ax, ay, alpha = np.linalg.solve(matrix, right)
    az = (f["bit_force"] - c.wob - c.axial_damping * vz - c.k_a * z) / c.m_a
    return np.array([vx, ax, vy, ay, vz, az, omega - c.speed, alpha])


def quick(case, phase=0.0):
    """The same derivative for one state at a time, in scalar Python, for SciPy: f(t,
    state)."""
    c = case
    m_l, m_e, c_h, k_bend, m_a, k_a, J, k_t, gap = (c.m_l, c.m_e, c.c_h, c.k_bend, c.m_a, c.k_a, c.J, c.k_t, c.gap)
    R, r_h, e0 = c.collar_radius, c.bit_radius, c.eccentricity
    arm = c.zeta * math.sqrt(r_h * c.depth_of_cut)
    s = m_e * e0
    inertia = J + s * e0 - s * s / m_l
    soft_f, soft_t = math.pi**2 / (2 * c.span), math.pi**3 / (2 * c.span**2)
    if c.softening == "static":
        k_bend -= soft_f * c.wob
    live = c.softening == "live"
    power = 1.5 if c.wall_law == "hertz" else 1.0

    def law(v, static, dynamic, smoothing, decay):
        return 2 / math.pi * math.atan(smoothing * v) * ((static - dynamic) / (1 + decay * abs(v)) + dynamic)

    def f(t, state):
        x, vx, y, vy, z, vz, twist, omega = state.tolist()
        phi = twist + phase + c.speed * t
        cos, sin = math.cos(phi), math.sin(phi)
        force = c.rock_stiffness * max(c.amplitude * math.sin(c.lobes * phi) - z, 0.0)
        torque = 0.0
        if force > 0.0:
            torque = force * (
                2 / 3 * r_h * law(omega, c.bit_static, c.bit_dynamic, c.bit_smoothing, c.bit_decay)
                + arm * 2 / math.pi * math.atan(c.bit_smoothing * omega)
            )
            if c.bit_law != "hyperbolic":
                torque = force * bit_arm(c, omega)
        r = math.sqrt(x * x + y * y)
        k = k_bend - (soft_f * force + soft_t * torque if live else 0.0)
        drag = c_h * math.sqrt(vx * vx + vy * vy)
        fx, fy, rub = -k * x - drag * vx, -k * y - drag * vy, 0.0
        if r > gap:
            normal = c.wall_stiffness * (r - gap) ** power
            slip = omega * R + (x * vy - y * vx) / r
            rub = normal * law(slip, c.wall_static, c.wall_dynamic, c.wall_smoothing, c.wall_decay)
            fx += (-normal * x + rub * y) / r
            fy += (-normal * y - rub * x) / r
        moment = -torque - c.torsional_damping * omega - k_t * twist - rub * R
        alpha = (moment - s / m_l * (fy * cos - fx * sin)) / inertia
        return np.array(
            (
                vx,
                (fx + s * (omega * omega * cos + alpha * sin)) / m_l,
                vy,
                (fy + s * (omega * omega * sin - alpha * cos)) / m_l,
                vz,
                (force - c.wob - c.axial_damping * vz - k_a * z) / m_a,
                omega - c.speed,
                alpha,
            )
        )

    return f


def solve(case, initial, duration, rtol=1e-12, phase=0.0, dense=False, **options):
    """SciPy's DOP853, an eighth-order pair that shares nothing with the package's;
    absolute tolerance 1e-14."""
    options = {"atol": 1e-14, **options}
    return solve_ivp(
        quick(case, phase),
        (0.0, duration),
        np.asarray(initial, dtype=float),
        "DOP853",
        rtol=rtol,
        dense_output=dense,
        **options,
    )


def deviate(case, state, deviations, duration, phase=0.0, rtol=1e-11):
    """State and small deviations [8, n] after some time: DOP853 from contact to
    contact, on each side of which the right-hand side is smooth, with derivatives by
    complex steps. The wall must be linear."""
    tiny, at, both = 1e-40, 0.0, np.concatenate([state, np.ravel(deviations)])
    surfaces = (
        lambda t, s: case.amplitude * math.sin(case.lobes * (s[6] + phase + case.speed * t)) - s[4],
        lambda t, s: s[0] ** 2 + s[2] ** 2 - case.gap**2,
    )
    touching = [surface(0.0, state) > 0 for surface in surfaces]

    def slopes(t, both):
        found = derivative(case, t, both[:8, None] + tiny * 1j * both[8:].reshape(8, -1), phase, touching)
        return np.concatenate([found[:, 0].real, found.imag.ravel() / tiny])

    for surface in surfaces:
        surface.terminal = True
    while at < duration:
        for surface, touches in zip(surfaces, touching, strict=True):
            surface.direction = -1 if touches else 1
        found = solve_ivp(slopes, (at, duration), both, "DOP853", rtol=rtol, atol=1e-13, events=surfaces)
        at, both = found.t[-1], found.y[:, -1]
        touching = [touches ^ bool(len(times)) for touches, times in zip(touching, found.t_events, strict=True)]
    return both[:8], both[8:].reshape(8, -1)


def floquet_exponents(case, state, revolutions, phase=0.0):
    """The exponents [1/s], greatest first, of the motion near ``state`` that repeats
    after some revolutions of the drive: Newton's method on the state, then the
    eigenvalues of the derivative of the return."""
    period = revolutions * 2 * math.pi / case.speed
    for _ in range(8):
        end, monodromy = deviate(case, state, np.eye(8), period, phase)
        if np.abs(end - state).max() < 1e-9:
            return np.sort(np.log(np.abs(np.linalg.eigvals(monodromy))) / period)[::-1]
        state = state - np.linalg.solve(monodromy - np.eye(8), end - state)
    raise AssertionError("no periodic motion near this state")
