"""The elastic collar once more, in plain numpy and for one trajectory, written from the
equations on its page."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np


def law(v: Any, static: float, dynamic: float, smoothing: float = 500.0, decay: float = 3.0) -> Any:
    return 2 / math.pi * np.arctan(smoothing * v) * ((static - dynamic) / (1 + decay * np.abs(v)) + dynamic)


@dataclass
class Top:
    """A drive that is not ideal: its inertia, the damping of the shaft, and the torque of its
    motor from lag, drive speed less the set speed, twist and bit speed less the set speed; or,
    of a DC motor, the rate of that torque from the same and the torque itself."""

    inertia: float
    shaft: float = 0.0
    torque: Callable[..., float] | None = None
    rate: Callable[..., float] | None = None


@dataclass
class Collar:
    """Numbers in SI; the states are (x_n), (x_n'), (y_n), (y_n'), each N long, then z,
    z', twist, bit speed, and those of a drive: lag, drive speed, the torque of a motor."""

    N: int = 5
    at: list[float] = field(default_factory=lambda: [0.1, 0.3, 0.5, 0.7, 0.9])
    depth: float = 5000.0
    W: float = 22.24e3
    Omega: float = 3.0
    ramp: float = 0.0
    l: float = 19.81  # noqa: E741
    D_o: float = 0.2286
    D_i: float = 0.0762
    L_c: float = 200.0
    pipe: tuple[float, float] = (0.127, 0.1086)
    rho: float = 7850.0
    E: float = 210e9
    G: float = 79.6e9
    rho_f: float = 1500.0
    C_A: float = 1.7
    C_D: float = 1.0
    D_well: float = 0.381
    k_w: float = 25e6
    walls: list[tuple[float, float, float]] | None = None  # gap, stiffness, drag of each station
    a: float = 1.0
    mu_w: tuple[float, float] = (0.35, 0.30)
    mu_b: tuple[float, float] = (0.5, 0.2)
    k_c: float = 25e6
    s0: float = 1e-3
    n_b: int = 3
    c_a: float = 4000.0
    c_t: float = 50.0
    e: list[float] = field(default_factory=lambda: [0.0127, 0, 0, 0, 0])
    zeta: float = 0.0
    softening: str | float = "force"
    factor: float = 1.0
    steel_only: bool = False
    cutting: float = 1.0
    top: Top | None = None

    def __post_init__(self) -> None:
        area, second = self.ring(self.D_o, self.D_i)
        pipe_area, pipe_second = self.ring(*self.pipe)
        n, length = np.arange(1, self.N + 1), self.depth - self.L_c
        self.n = n
        m_c = self.rho * area * self.l / 2
        m_f = self.rho_f * math.pi / 4 * (self.D_i**2 + self.C_A * self.D_o**2) * self.l / 2
        self.m = self.factor * (m_c + m_f)
        self.m_e = self.factor * (m_c if self.steel_only else m_c + m_f)
        self.k = self.factor * self.E * second * (n * math.pi) ** 4 / (2 * self.l**3)
        self.per_P = self.factor * (n * math.pi) ** 2 / (2 * self.l)
        self.per_T = self.factor * (n * math.pi) ** 3 / (2 * self.l**2)
        self.c = 2 * self.zeta * np.sqrt(self.m * self.k)
        self.phi = np.sin(np.outer(self.at, n) * math.pi)
        self.d = 2 / (3 * math.pi) * self.rho_f * self.C_D * self.D_o * self.l / np.sum(np.abs(self.phi[:, 0]) ** 3)
        self.m_a = self.rho * (area * self.L_c + pipe_area * length / 3)
        self.k_a = self.E * pipe_area / length
        self.J = self.rho * 2 * (second * self.L_c + pipe_second * length / 3)
        self.k_t = self.G * 2 * pipe_second / length
        self.gap = (self.D_well - self.D_o) / 2
        self.walls = self.walls or [(self.gap, self.k_w, self.d)] * len(self.at)
        eccentric = np.array(self.e, dtype=float)
        self.q = self.m_e * eccentric / self.m
        self.J_e = self.J + np.sum(self.m_e * eccentric * (eccentric - self.q))
        r_h, rate = self.D_well / 2, max(1.35e-8 * self.W * math.sqrt(self.Omega) - 1.9e-4, 0.0)
        self.arm = self.cutting * math.sqrt(r_h * 2 * math.pi * rate / self.Omega)
        self.r_h = r_h

    @staticmethod
    def ring(outer: float, inner: float) -> tuple[float, float]:
        return math.pi / 4 * (outer**2 - inner**2), math.pi / 64 * (outer**4 - inner**4)

    def slopes(self, t: float, s: np.ndarray) -> np.ndarray:
        N = self.N
        x, vx, y, vy = s[:N], s[N : 2 * N], s[2 * N : 3 * N], s[3 * N : 4 * N]
        z, vz, twist, w, *of_drive = s[4 * N :]
        angle = twist + self.Omega * t + 0.5 * self.ramp * t * t
        force = self.k_c * max(self.s0 * math.sin(self.n_b * angle) - z, 0.0)
        torque = force * (2 / 3 * self.r_h * law(w, *self.mu_b) + self.arm * 2 / math.pi * math.atan(500.0 * w))
        known = {"force": (force, 0.0), "live": (force, torque), "static": (self.W, 0.0)}
        axial, twisting = known[self.softening] if isinstance(self.softening, str) else (self.softening, 0.0)
        k = self.k - self.per_P * axial - self.per_T * twisting
        F_x, F_y, rubbing = -k * x - self.c * vx, -k * y - self.c * vy, 0.0
        for phi, (gap, stiffness, drag) in zip(self.phi, self.walls, strict=True):
            X, V_x, Y, V_y = phi @ x, phi @ vx, phi @ y, phi @ vy
            r, v = math.hypot(X, Y), math.hypot(V_x, V_y)
            N_j = stiffness * max(r - gap, 0.0) ** self.a
            T_j = 0.0
            c, d = (X / r, Y / r) if r > 0 else (0.0, 0.0)
            if N_j > 0:
                T_j = N_j * law(w * self.D_o / 2 + (X * V_y - Y * V_x) / r, *self.mu_w)
            F_x = F_x + phi * (-N_j * c + T_j * d - drag * v * V_x)
            F_y = F_y + phi * (-N_j * d - T_j * c - drag * v * V_y)
            rubbing += T_j
        speed, pipe, rates = self.Omega + self.ramp * t, -self.k_t * twist, []
        if self.top:
            lag, w_d, *given = of_drive
            pipe = self.k_t * (lag - twist) + self.top.shaft * (w_d - w)
            seen = (lag, w_d - speed, twist, w - speed)
            motor = given[0] if self.top.rate else self.top.torque(*seen)
            rates = [w_d - speed, (motor - pipe) / self.top.inertia]
            rates += [self.top.rate(*seen, motor)] if self.top.rate else []
        moment = -torque - self.c_t * w + pipe - rubbing * self.D_o / 2
        alpha = (moment - np.sum(self.q * (F_y * math.cos(angle) - F_x * math.sin(angle)))) / self.J_e
        a_x = self.q * (w**2 * math.cos(angle) + alpha * math.sin(angle)) + F_x / self.m
        a_y = self.q * (w**2 * math.sin(angle) - alpha * math.cos(angle)) + F_y / self.m
        a_z = (force - self.W - self.c_a * vz - self.k_a * z) / self.m_a
        return np.concatenate([vx, a_x, vy, a_y, [vz, a_z, w - speed, alpha, *rates]])

    def by_name(self, s: np.ndarray) -> dict[str, np.ndarray]:
        """The states by the names that nsdrill has for them."""
        N = self.N
        names = [f"{q}_{n}" for q in ("x", "vx", "y", "vy") for n in range(1, N + 1)]
        names += ["z", "vz", "twist", "bit_speed", "lag", "drive_speed", "motor_torque"]
        return dict(zip(names, s, strict=False))
