"""The string of segments in plain numpy, one trajectory, written from its equations
without the package's code.

The state is [u_0..u_n, v_0..v_n, th_0..th_n, w_0..w_n, I].
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import eigh


@dataclass
class Plain:
    """A string with the paper's numbers; what a test changes is a field."""

    wob: float = 100e3
    speed: float = 13.0
    pipes: int = 10
    collars: int = 10
    depth: float = 2200.0
    collar_length: float = 200.0
    pipe: tuple[float, float] = (0.101, 0.0848)
    collar: tuple[float, float] = (0.171, 0.0571)
    E: float = 210e9
    G: float = 79.6e9
    rho: float = 7850.0
    kelly: tuple[float, float, float] = (15.0, 0.379, 0.0825)
    beta_a: float = 0.2e-3
    beta_t: float = 10e-3
    k_top: float = 9.3e6
    c_top: float = 0.0
    hoisted: float = 7031.0
    mud: float = 1198.0
    viscosity: float = 0.03
    flow: float = 0.022
    pulsation: float = 0.002
    rate: float = 25.13
    f_out: float = 0.045
    f_in: float = 0.035
    hole: float = 0.2
    bit_radius: float = 0.1
    bit_mass: float = 65.0
    lobes: int = 1
    s0: float = 1e-3
    k_c: float = 1.16e9
    c_c: float = 1.5e5
    mu0: float = 0.06
    alpha: float = 2.0
    beta: float = 1.0
    nu: float = 0.01
    zeta: float = 1.0
    c1: float = 1.35e-8
    c2: float = -1.9e-4
    live: bool = True
    threshold: float = 10e3
    w_s: float = 0.05
    eps: float = 50.0
    L: float = 0.005
    R: float = 0.01
    nK: float = 7.2 * 6.0
    motor: float = 23.0
    gear: float = 7.2
    table: float = 930.0
    c_rt: float = 0.0
    stiff: bool = False
    gains: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    on_at: float = 0.0
    torques: bool = True
    wall: tuple[float, float, float, float] | None = None  # static, dynamic, threshold, steepness
    along: bool = False  # friction along the wall acts along the hole, too
    given: tuple[float, float, float, float] | None = None  # static, dynamic torque [N m], steepness, decay
    survey: tuple[tuple[float, float], ...] = ((0.0, 0.0),)  # depth, inclination
    n: int = field(init=False)

    def __post_init__(self) -> None:
        n = self.n = self.pipes + self.collars
        h = np.array(
            [(self.depth - self.collar_length) / self.pipes] * self.pipes
            + [self.collar_length / self.collars] * self.collars
        )
        outer = np.array([self.pipe[0]] * self.pipes + [self.collar[0]] * self.collars)
        inner = np.array([self.pipe[1]] * self.pipes + [self.collar[1]] * self.collars)
        A, Ip = math.pi / 4 * (outer**2 - inner**2), math.pi / 32 * (outer**4 - inner**4)
        self.k, self.kt = self.E * A / h, self.G * Ip / h
        self.m, self.J = np.zeros(n + 1), np.zeros(n + 1)
        self.halves = []  # of every segment, at its two nodes: (node, drags and areas)
        self.cw = np.zeros(n + 1)
        for i in range(n):
            for node in (i, i + 1):
                half = h[i] / 2
                self.m[node] += self.rho * A[i] * half
                self.J[node] += self.rho * Ip[i] * half
                gap = self.hole / 2 - outer[i] / 2
                self.cw[node] += 2 * math.pi * self.viscosity * (outer[i] / 2) ** 3 * half / gap
                a = self.f_out / 8 * self.mud * math.pi * outer[i] * half
                b = self.f_in / 8 * self.mud * math.pi * inner[i] * half
                A_o, A_b = math.pi / 4 * (self.hole**2 - outer[i] ** 2), math.pi / 4 * inner[i] ** 2
                self.halves.append((node, a, b, A_o, A_b))
        length, D, d = self.kelly
        self.m[0] += self.hoisted + self.rho * math.pi / 4 * (D**2 - d**2) * length
        self.J[0] += self.table + self.gear**2 * self.motor + self.rho * math.pi / 32 * (D**4 - d**4) * length
        self.m[n] += self.bit_mass
        self.J[n] += self.bit_mass * self.bit_radius**2 / 2
        self.levers = np.zeros(n + 1)  # load on the wall times radius, of what lies between the nodes
        self.loads = np.zeros(n + 1)
        ends = np.concatenate([[0.0], np.cumsum(h)])
        for i in range(n) if self.wall else ():
            s = np.linspace(ends[i], ends[i + 1], 4001)
            s = 0.5 * (s[1:] + s[:-1])
            sine = np.sin(np.interp(s, *zip(*self.survey, strict=True)))
            load = (self.rho - self.mud) * 9.80665 * A[i] * sine * h[i] / len(s)
            upper = s < 0.5 * (ends[i] + ends[i + 1])
            for node, half in ((max(i, 1), upper), (min(i + 1, n - 1), ~upper)):
                self.loads[node] += load[half].sum()
                self.levers[node] += load[half].sum() * outer[i] / 2
        self.advance = max(self.c1 * self.wob * math.sqrt(self.speed) + self.c2, 0.0)
        self.k_a = 1 / (1 / self.k_top + np.sum(1 / self.k))
        z = -self.wob / (self.k_a + self.k_c)
        torque = self.bit_torque(-self.k_c * z, self.speed) if self.torques else 0.0
        carried = self.speed * self.cw + self.rubbed(self.speed)[0]
        below = np.array([np.sum(carried[i + 1 :]) for i in range(n)])
        self.angles = np.concatenate([[0.0], -np.cumsum((torque + below) / self.kt)])
        self.I = (torque + np.sum(carried) + self.c_rt * self.speed) / self.nK
        self.V0 = self.nK * self.speed + self.R * self.I
        self.T, self.z = torque, z

    def rubbed(self, w: Any, v: Any = 0.0) -> Any:
        """The torque of the wall on the nodes, and its force up or down the hole, which is
        0 in steady drilling."""
        if self.wall is None:
            return 0.0 * self.levers, 0.0
        static, dynamic, threshold, steep = self.wall

        def coefficient(size: Any) -> Any:
            return (
                2 / math.pi * np.arctan(steep * size) * (dynamic + (static - dynamic) / (1 + (size / threshold) ** 8))
            )

        if not self.along:
            return self.levers * coefficient(w), 0.0
        radius = np.where(self.loads > 0, self.levers / np.where(self.loads > 0, self.loads, 1.0), 1.0)

        def shares(w: Any, v: Any) -> Any:
            sliding = v - self.advance  # [m/s], down the hole
            slip = np.hypot(radius * w, sliding)
            force = self.loads * coefficient(slip / radius)
            return force * radius * radius * w / slip, force * sliding / slip

        torque, force = shares(w, v)
        return torque, force - shares(self.speed, 0.0)[1]

    def bit_torque(self, force: float, omega: float) -> float:
        if self.given is not None:
            static, dynamic, steep, decay = self.given
            return 2 / math.pi * math.atan(steep * omega) * (dynamic + (static - dynamic) / (1 + decay * abs(omega)))
        at = omega if self.live else self.speed
        advance = max(self.c1 * self.wob * math.sqrt(abs(at)) + self.c2, 0.0)
        cut = 2 * math.pi * advance / math.sqrt(at**2 + self.w_s**2)
        on = min(max((force - self.threshold) / (0.1 * self.threshold), 0.0), 1.0)
        rubbing = math.tanh(omega) + self.alpha * omega / (1 + self.beta * omega**2) + self.nu * omega
        cutting = on * 2 / math.pi * math.atan(self.eps * omega) * self.zeta * math.sqrt(cut / self.bit_radius)
        return force * self.bit_radius * (self.mu0 * rubbing + cutting)

    def drag(self, t: float, v: Any) -> Any:
        """The mud's drag on the nodes [N], less that of the mean flow on a string at
        rest."""
        Q, Q_m, D = (self.flow + self.pulsation * math.sin(self.rate * t), self.flow, np.zeros(self.n + 1))
        for node, a, b, A_o, A_b in self.halves:
            x, y = Q / A_o - v[node], Q / A_b + v[node]
            D[node] += a * (x * abs(x) - (Q_m / A_o) ** 2) - b * (y * abs(y) - (Q_m / A_b) ** 2)
        return D

    def parts(self, state: Any) -> Any:
        n = self.n + 1
        return state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n : 4 * n], state[4 * n]

    def bit(self, t: float, state: Any) -> tuple[float, float, float]:
        """Interference of bit and rock [m], force [N] and torque [N m]."""
        u, v, th, w, _ = self.parts(state)
        phi = self.lobes * (th[-1] + self.turned(t))
        d = self.s0 * math.sin(phi) - u[-1]
        rate = self.s0 * self.lobes * math.cos(phi) * w[-1] - v[-1]
        chi = self.c_c / self.wob
        force = self.k_c * max(d, 0.0) * max(1 + chi * rate, 0.0)
        return d, force, self.bit_torque(force, w[-1]) if self.torques else 0.0

    def turned(self, t: float) -> float:
        """The angle of the set point."""
        return self.speed * t

    def voltage(self, t: float, state: Any) -> float:
        _, _, th, w, current = self.parts(state)
        if t < self.on_at:
            return self.V0
        K_I, K_1, K_2, K_3, K_4 = self.gains
        return self.V0 - (
            K_I * (current - self.I)
            + K_1 * th[0]
            + K_2 * (w[0] - self.speed)
            + K_3 * (th[-1] - self.angles[-1])
            + K_4 * (w[-1] - self.speed)
        )

    def rates(self, t: float, state: Any) -> Any:
        u, v, th, w, current = self.parts(state)
        S = self.k * (np.diff(u) + self.beta_a * np.diff(v))
        M = self.kt * (np.diff(th) + self.beta_t * np.diff(w))
        _, force, torque = self.bit(t, state)
        F = self.drag(t, v)
        F[:-1] += S
        F[1:] -= S
        F[0] -= self.k_top * u[0] + self.c_top * v[0]
        F[-1] += force - self.wob
        against, along = self.rubbed(w, v)
        F -= along
        T = -self.cw * w - against
        T[:-1] += M
        T[1:] -= M
        T[0] += self.nK * current - self.c_rt * w[0]
        T[-1] -= torque
        turn = T / self.J
        charge = (self.voltage(t, state) - self.R * current - self.nK * w[0]) / self.L
        if self.stiff:
            turn[0], charge = 0.0, 0.0
        return np.concatenate([v, F / self.m, w - self.speed, turn, [charge]])

    def energy(self, state: Any) -> float:
        """Kinetic, of all springs, of the coil, and of the weight on bit."""
        u, v, th, w, current = self.parts(state)
        springs = self.k @ np.diff(u) ** 2 + self.kt @ np.diff(th) ** 2 + self.k_top * u[0] ** 2
        return 0.5 * float(self.m @ v**2 + self.J @ w**2 + springs + self.L * current**2) + self.wob * float(u[-1])

    def power(self, t: float, state: Any) -> float:
        """The power of all that is no spring and no inertia."""
        _, v, _, w, current = self.parts(state)
        _, force, torque = self.bit(t, state)
        lost = self.beta_a * self.k @ np.diff(v) ** 2 + self.beta_t * self.kt @ np.diff(w) ** 2 + self.cw @ w**2
        lost += self.c_top * v[0] ** 2 + self.c_rt * w[0] ** 2 + self.R * current**2
        return float(self.drag(t, v) @ v + force * v[-1] - torque * w[-1] + self.voltage(t, state) * current - lost)


@dataclass
class Driven(Plain):
    """A string whose top is turned by T = -K_i lag - K_p (w_0 - Omega) - G_t (twist -
    lag) - G_w (w_n - Omega), with numbers that follow from the ``kind`` as other
    programs have them; ``motor`` and ``table`` are the machine's."""

    kind: str = "stiff"
    limit: float = math.inf
    numbers: dict[str, Any] = field(default_factory=dict)
    gear: float = 0.0
    table: float = 2900.0

    def __post_init__(self) -> None:
        super().__post_init__()
        n = self.n
        D = np.diff(np.eye(n + 1), axis=0)
        below = (D.T @ np.diag(self.kt) @ D)[1:, 1:]
        w = math.sqrt(eigh(below, np.diag(self.J[1:]), eigvals_only=True)[0])
        k_t = 1 / np.sum(1 / self.kt)
        zeta = math.pi / 32 * (self.pipe[0] ** 4 - self.pipe[1] ** 4) * math.sqrt(self.rho * self.G)
        half = self.rho * math.pi / 32 * (self.pipe[0] ** 4 - self.pipe[1] ** 4)
        half *= (self.depth - self.collar_length) / self.pipes / 2
        J = self.J[0] - half
        get = self.numbers.get
        self.law = {
            "stiff": (J, 5 * J, 50 * zeta, 0.0, 0.0),
            "soft_torque": (J - get("taken", 0.0), w**2 * (J - get("taken", 0.0)), get("b", 4.0) * zeta, 0.0, 0.0),
            "equal_damping": (J, w**2 * J, 2 * math.sqrt(k_t * J), 0.0, 0.0),
            "z_torque": (J / 13.5, 50 * zeta / 13.5 / (20 / (2 * math.pi)), 50 * zeta / 13.5, 0.0, 0.0),
            "pi": (J, 14500.0, 14853.0, get("G_t", 0.0), get("G_w", 0.0)),
        }[self.kind]
        self.J[0] = self.law[0] + half

    def torque(self, state: Any) -> float:
        _, _, th, w, _ = self.parts(state)
        _, K_i, K_p, G_t, G_w = self.law
        asked = -(K_i * th[0] + K_p * (w[0] - self.speed) + G_t * (th[-1] - th[0]) + G_w * (w[-1] - self.speed))
        return min(max(asked, 0.0), self.limit) if math.isfinite(self.limit) else asked

    def rates(self, t: float, state: Any) -> Any:
        made, n = super().rates(t, state), self.n + 1
        current = self.parts(state)[4]
        made[3 * n] += (self.torque(state) - self.nK * current) / self.J[0]
        if t < self.on_at:
            made[3 * n] = 0.0
        made[-1] = 0.0
        return made


def ours(state: Any, n: int) -> Any:
    """The state in the model's order: pairs, angles after positions, then the current."""
    m = n + 1
    pairs = (
        np.stack([state[:m], state[m : 2 * m]], axis=1).ravel(),
        np.stack([state[2 * m : 3 * m], state[3 * m : 4 * m]], axis=1).ravel(),
    )
    return np.concatenate([*pairs, state[4 * m :]])


def plain_of(state: Any, n: int) -> Any:
    """The inverse of :func:`ours`."""
    m = 2 * (n + 1)
    return np.concatenate([state[0:m:2], state[1:m:2], state[m : 2 * m : 2], state[m + 1 : 2 * m : 2], state[2 * m :]])
