"""The right-hand side for one state in scalar numba, contacts skipped by branches: for
SciPy and numbalsoda."""

from __future__ import annotations

import math

import numba

TWO_OVER_PI = 2.0 / math.pi


@numba.njit(fastmath=True, error_model="numpy", inline="always")
def coefficient(speed, smoothing, decay, rise, dynamic):  # type: ignore[no-untyped-def]
    return TWO_OVER_PI * math.atan(smoothing * speed) * (rise / (1.0 + decay * abs(speed)) + dynamic)


@numba.njit(fastmath=True, error_model="numpy")
def derivative(t, x, vx, y, vy, z, vz, twist, omega, k):  # type: ignore[no-untyped-def]
    """The eight slopes; ``k`` holds the constants in the order of
    ``benchmarks.workload.CONSTANTS``."""
    (
        phase,
        drive,
        wob,
        per_m_l,
        per_J,
        per_m_a,
        q,
        k_bend,
        soft_F,
        soft_T,
        c_h,
        c_a,
        k_a,
        c_t,
        k_t,
        gap,
        k_w,
        R_c,
        eps_w,
        tau_w,
        rise_w,
        mu_w,
        k_c,
        s0,
        eps_b,
        tau_b,
        rise_b,
        mu_b,
        lobes,
    ) = (
        k[0],
        k[1],
        k[2],
        k[3],
        k[4],
        k[5],
        k[6],
        k[7],
        k[8],
        k[9],
        k[10],
        k[11],
        k[12],
        k[13],
        k[14],
        k[15],
        k[16],
        k[17],
        k[18],
        k[19],
        k[20],
        k[21],
        k[22],
        k[23],
        k[24],
        k[25],
        k[26],
        k[27],
        k[28],
    )
    phi = twist + phase + drive * t
    s, c = math.sin(phi), math.cos(phi)
    lobe = s * (4.0 * c * c - 1.0) if lobes == 3.0 else math.sin(lobes * phi)
    depth = s0 * lobe - z
    r = math.sqrt(x * x + y * y)
    drag = c_h * math.sqrt(vx * vx + vy * vy)
    force = torque = radial = tangential = friction = 0.0
    if depth > 0.0:
        force = k_c * depth
        torque = force * coefficient(omega, eps_b, tau_b, rise_b, mu_b)
    if r > gap:
        per_r = 1.0 / r
        normal = k_w * (r - gap)
        slip = omega * R_c + (x * vy - y * vx) * per_r
        friction = normal * coefficient(slip, eps_w, tau_w, rise_w, mu_w)
        radial = normal * per_r
        tangential = friction * per_r
    radial += k_bend - soft_F * force - soft_T * torque
    fx = tangential * y - radial * x - drag * vx
    fy = -tangential * x - radial * y - drag * vy
    moment = c_t * omega + k_t * twist + friction * R_c + torque
    alpha = -(moment + q * (fy * c - fx * s)) * per_J
    return (
        vx,
        q * (omega * omega * c + alpha * s) + fx * per_m_l,
        vy,
        q * (omega * omega * s - alpha * c) + fy * per_m_l,
        vz,
        (force - wob - c_a * vz - k_a * z) * per_m_a,
        omega - drive,
        alpha,
    )
