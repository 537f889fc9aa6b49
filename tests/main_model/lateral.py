"""The equations with mud that turns, stabilisers, weight and friction along the axis,
in plain NumPy, written from the documentation, not from the sources: forces on the
collar, then Lagrange's 3 x 3 system as it stands."""

import math
from dataclasses import dataclass, replace

import numpy as np
from reference import Case, contacts
from scipy.integrate import solve_ivp
from strings import pack

from main_model.cases import parameters_of, random_case, random_state
from nsdrill.models.christoforou_yigit.parameters import Parameters, Stabilizer, StabilizerFriction


@dataclass(frozen=True)
class Lateral:
    """The options; the defaults are those of a vertical hole with hinges."""

    swirl: float = 0.0
    clearance: float | None = None
    static: float = 0.35
    dynamic: float = 0.30
    smoothing: float = 500.0
    decay: float = 3.0
    inclination: float = 0.0
    eccentric_weight: bool = True
    axial_friction: bool = False


def parameters(c: Case, o: Lateral) -> Parameters:
    p = parameters_of(c)
    return replace(
        p,
        drillstring=replace(p.drillstring, eccentric_weight=o.eccentric_weight),
        mud=replace(p.mud, swirl=o.swirl),
        well=replace(p.well, inclination=o.inclination, axial_friction=o.axial_friction),
        stabilizer=Stabilizer(o.clearance, StabilizerFriction(o.static, o.dynamic, o.smoothing, o.decay)),
    )


def _coefficient(size: float, static: float, dynamic: float, smoothing: float, decay: float) -> float:
    return 2 / math.pi * math.atan(smoothing * size) * ((static - dynamic) / (1 + decay * abs(size)) + dynamic)


def weights(c: Case, o: Lateral) -> tuple[float, float]:
    steel = c.density * math.pi / 4 * (c.collar_od**2 - c.collar_id**2)
    mud = c.mud_density * math.pi / 4 * (c.collar_id**2 - c.collar_od**2)
    modal = 2 * c.span / math.pi * 9.80665 * math.sin(o.inclination)
    return modal * (steel + mud), modal * steel * o.eccentric_weight


def derivative(c: Case, o: Lateral, t: float, state: np.ndarray, terms: bool = False, phase: float = 0.0) -> np.ndarray:
    """d(state)/dt of one state [8]; with ``terms`` the size of what each component is
    summed from."""
    x, vx, y, vy, z, vz, twist, omega = np.asarray(state, float)
    f = contacts(c, t, np.asarray(state, float), phase)
    r, phi = float(f["radius"]), float(f["phi"])
    er = np.array([x, y]) / r if r > 0 else np.array([1.0, 0.0])
    et = np.array([-er[1], er[0]])
    theta_rate = (x * vy - y * vx) / r**2 if r > 0 else 0.0
    sliding_rate = vz - (c.c1 * c.wob * math.sqrt(c.speed) + c.c2 if c.depth_of_cut > 0 else 0.0)

    def friction(normal: float, slip: float, law: tuple[float, ...]) -> tuple[float, float]:
        """Around the hole and along it."""
        if not o.axial_friction:
            return normal * _coefficient(slip, *law), 0.0
        size = math.hypot(slip, sliding_rate)
        mu = _coefficient(size, *law)
        return (normal * mu * slip / size, normal * mu * sliding_rate / size) if size else (0.0, 0.0)

    wall = float(f["wall_force"])
    wall_law = (c.wall_static, c.wall_dynamic, c.wall_smoothing, c.wall_decay)
    rub, drag_along = friction(wall, omega * c.collar_radius + theta_rate * r, wall_law)
    pushes = [-wall * er, -rub * et]
    brake = rub * c.collar_radius
    stiffness = float(f["stiffness"])
    if o.clearance is None:
        pushes.append(-stiffness * r * er)
    else:
        held = stiffness * max(r - o.clearance, 0.0)
        radius = c.well_diameter / 2 - o.clearance
        law = (o.static, o.dynamic, o.smoothing, o.decay)
        rub, along = friction(abs(held), omega * radius + theta_rate * o.clearance, law)
        pushes += [-held * er, -rub * et]
        brake += rub * radius
        drag_along += along
    sigma = o.swirl * c.speed
    u = np.array([vx + sigma * y, vy - sigma * x])
    m_f = c.m_l - c.m_c
    pushes += [-c.c_h * math.hypot(*u) * u]
    pushes += [m_f * np.array([-2 * sigma * vy, 2 * sigma * vx]), m_f * sigma**2 * np.array([x, y])]
    across, steel = weights(c, o)
    pushes.append(np.array([0.0, -across]))
    force = np.sum(pushes, axis=0)
    turning = [
        -float(f["bit_torque"]),
        -c.torsional_damping * omega,
        -c.k_t * twist,
        -brake,
        -steel * c.eccentricity * math.cos(phi),
    ]
    s, cos, sin = c.m_e * c.eccentricity, math.cos(phi), math.sin(phi)
    matrix = np.array([[c.m_l, 0, -s * sin], [0, c.m_l, s * cos], [-s * sin, s * cos, c.J + s * c.eccentricity]])
    right = np.array([force[0] + s * cos * omega**2, force[1] + s * sin * omega**2, sum(turning)])
    ax, ay, alpha = np.linalg.solve(matrix, right)
    bit = float(f["bit_force"])
    az = (bit - c.wob - c.axial_damping * vz - c.k_a * z - drag_along) / c.m_a
    if terms:
        # The radius is a root of a sum: what a rounding of it does to the forces is a
        # term as well.
        hertz = 1.5 * math.sqrt(max(r - c.gap, 1e-14)) if c.wall_law == "hertz" else 1.0
        rounding = (c.wall_stiffness * hertz * r if r > c.gap * (1 - 1e-12) else 0.0) + abs(stiffness) * r
        lateral = sum(float(np.abs(push).sum()) for push in pushes) + rounding
        lateral += abs(c.k_bend) * r + s * omega**2
        torque = sum(map(abs, turning)) + rounding * c.collar_radius + s / c.m_l * lateral
        inertia = c.J + s * (c.eccentricity - s / c.m_l)
        a = lateral / c.m_l + s / c.m_l * torque / inertia
        axial = bit + c.rock_stiffness * (c.amplitude + abs(z)) * (bit > 0) + c.wob + abs(c.axial_damping * vz)
        axial = (axial + abs(c.k_a * z) + abs(drag_along) + rounding) / c.m_a
        return np.array([abs(vx), a, abs(vy), a, abs(vz), axial, abs(omega) + c.speed, torque / inertia])
    return np.array([vx, ax, vy, ay, vz, az, omega - c.speed, alpha])


def solve(c: Case, o: Lateral, start: np.ndarray, times: np.ndarray) -> np.ndarray:
    """The states [8, times] by DOP853."""
    found = solve_ivp(
        lambda t, s: derivative(c, o, t, s), (0.0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-13
    )
    return found.y


FORMS = {
    "swirl": {"swirl": 0.5},
    "stabilizer": {"clearance": 0.02},
    "weight": {"inclination": 1.0},
    "axial": {"axial_friction": True},
    "heavy and rubbing": {"inclination": 1.4, "axial_friction": True, "eccentric_weight": False},
    "all": {"swirl": 0.4, "clearance": 0.01, "inclination": 0.5, "axial_friction": True},
}


def cases(form: str, count: int, seed: int, law: str = "linear") -> list[tuple[Case, Lateral, float, np.ndarray]]:
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        c = random_case(rng, wall_law=law, lobes=3)
        o = replace(
            Lateral(**FORMS[form]),
            static=rng.uniform(0.3, 0.6),
            dynamic=rng.uniform(0.1, 0.3),
            smoothing=10 ** rng.uniform(1, 3),
            decay=rng.uniform(0, 5),
        )
        found.append((c, o, rng.uniform(0, 5), random_state(rng, c)))
    return found


def packed(c: Case, o: Lateral) -> np.ndarray:
    return pack(parameters(c, o), c.depth, c.wob, c.speed)


KEYS = {
    "swirl": "mud: {swirl: 0.5}",
    "stabilizer": "stabilizer: {clearance: 12.7 mm}",
    "weight": "well: {inclination: 40 deg}",
    "axial": "well: {axial_friction: true, inclination: 40 deg}",
    "all": "mud: {swirl: 0.5}\nstabilizer: {clearance: 5 mm}\nwell: {inclination: 20 deg, axial_friction: true}",
}
