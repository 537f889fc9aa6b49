"""What an engineer reads off the coefficients at one operating point: natural frequencies, critical speeds, margins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.drives import gains, impedance
from nsdrill.models.christoforou_yigit.forces import friction
from nsdrill.models.christoforou_yigit.lateral import weights
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.operation import Operation


@dataclass(frozen=True)
class Figure:
    """One number: SI value (None where there is none), SI unit, meaning."""

    value: float | None
    units: str
    meaning: str


def figures(parameters: Parameters, operation: Operation) -> dict[str, Figure]:
    """The figures by name."""
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    bit = parameters.bit
    contact = math.sqrt((k.k_a + bit.rock_stiffness) / k.m_a)
    torque = mean_torque(parameters, operation, k)
    stiffness = lateral_stiffness(parameters, operation, k)
    return {
        "axial_free": Figure(math.sqrt(k.k_a / k.m_a), "rad/s", "axial frequency, bit off the rock"),
        "axial_contact": Figure(contact, "rad/s", "axial frequency, bit on the rock"),
        "torsional": Figure(math.sqrt(k.k_t / k.J), "rad/s", "torsional frequency"),
        "lateral": Figure(
            math.sqrt(stiffness / k.m_l) if stiffness > 0 else None, "rad/s", "lateral frequency at this WOB"
        ),
        "lateral_stiffness": Figure(stiffness, "N/m", "lateral stiffness at this WOB"),
        "buckling_margin": Figure(
            float(1 - operation.wob / k.buckling_load), "1", "1 - WOB / buckling load of the span"
        ),
        "wall_speed": Figure(
            wall_speed(parameters, operation, k), "rad/s", "speed at which forward whirl reaches the wall"
        ),
        "lobe_resonance": Figure(
            contact / bit.lobes, "rad/s", "speed at which the lobes excite the axial contact mode"
        ),
        "lift_off_wob": Figure(lift_off_wob(parameters, operation, k), "N", "WOB below which steady contact is lost"),
        "mean_torque": Figure(torque, "N m", "steady torque at the surface"),
        "static_twist": Figure(float(-torque / k.k_t), "rad", "steady twist of the string"),
        **_lateral(parameters, stiffness, k),
        **_torsion(parameters, operation, k),
    }


def _lateral(parameters: Parameters, stiffness: float, k: Coefficients) -> dict[str, Figure]:
    """What decides on whirl in mud that turns, and the load across an inclined hole."""
    found = {}
    swirl = parameters.mud.swirl
    if swirl:
        critical = math.sqrt(stiffness / mass_in_swirl(k, swirl)) if stiffness > 0 else None
        own = math.sqrt(stiffness / k.m_c) / swirl if stiffness > 0 else None
        found = {
            "critical_speed": Figure(critical, "rad/s", "critical speed of forward whirl in mud that turns"),
            "fluid_whirl": Figure(own, "rad/s", "speed above which mud that turns drives whirl by itself"),
        }
    across, _ = weights(parameters)
    if across > 0:
        found["side_load"] = Figure(float(across), "N", "weight of the span across the hole, as it bends")
    return found


def mass_in_swirl(k: Coefficients, swirl: float) -> float:
    """The mass of the span [kg] that turns with the bit in mud that turns with ``swirl`` of its speed: its inertia
    force at radius r is this times Omega^2 r."""
    return float(k.m_c + k.m_f * (1.0 - swirl) ** 2)


def _torsion(parameters: Parameters, operation: Operation, k: Coefficients) -> dict[str, Figure]:
    """What decides on stick-slip: the string with its drive, linear, and the fall of friction with bit speed."""
    law, arm = parameters.bit.friction, 2 / 3 * k.bit_radius
    held = slope_held(parameters, k)
    # The slope of the sharp law, -(T_s - T_d) tau / (1 + tau w)^2, equals the slope that is held.
    fall = float(operation.wob * arm * (law.static - law.dynamic) * law.decay)
    onset = (math.sqrt(fall / held) - 1) / law.decay if held > 1e-9 * fall and law.decay > 0 else None
    found = {
        "slope_held": Figure(
            held, "N m s/rad", "steepest fall of the bit's friction torque with speed that steady drilling withstands"
        ),
        "stick_slip_onset": Figure(
            onset if onset is not None and onset > 0 else None,
            "rad/s",
            "speed below which steady drilling is unstable to stick-slip",
        ),
    }
    if parameters.drive.ideal:
        return found
    law_of_drive = gains(parameters, k)
    found |= {
        "pipe_impedance": Figure(float(impedance(parameters)), "N m s/rad", "torsional impedance of the pipe"),
        "drive_stiffness": Figure(float(law_of_drive.stiffness), "N m/rad", "integral gain of the drive, K_i"),
        "drive_damping": Figure(float(law_of_drive.damping), "N m s/rad", "proportional gain of the drive, K_p"),
    }
    roots = np.linalg.eigvals(torsional_matrix(parameters, k))
    modes = sorted((root for root in roots if root.imag > 0), key=abs)
    for number, root in enumerate(modes, start=1):
        found |= {
            f"drive_mode_{number}": Figure(float(abs(root)), "rad/s", f"frequency {number} of string and drive"),
            f"drive_damping_{number}": Figure(float(-root.real / abs(root)), "1", "its damping ratio, off bottom"),
        }
    return found


def torsional_matrix(parameters: Parameters, k: Coefficients, fall: float = 0.0) -> np.ndarray:
    """The matrix of string and drive [4, 4] for deviations of (lag, drive speed, twist, bit speed) from the set point,
    with a friction torque that falls by ``fall`` [N m s/rad] at the bit; [2, 2] of the last two with an ideal drive."""
    c_t = parameters.drillstring.torsional_damping - fall
    J, k_t = float(k.J), float(k.k_t)
    if parameters.drive.ideal:
        return np.array([[0.0, 1.0], [-k_t / J, -c_t / J]])
    inertia, stiffness, damping, twist, speed, c_s = (float(value) for value in gains(parameters, k))
    return np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [
                (twist - stiffness - k_t) / inertia,
                -(damping + c_s) / inertia,
                (k_t - twist) / inertia,
                (c_s - speed) / inertia,
            ],
            [0.0, 0.0, 0.0, 1.0],
            [k_t / J, c_s / J, -k_t / J, -(c_t + c_s) / J],
        ]
    )


def slope_held(parameters: Parameters, k: Coefficients) -> float:
    """The steepest fall of the friction torque with bit speed [N m s/rad] with which steady drilling is stable;
    negative where the drive itself is unstable."""

    def stable(fall: float) -> bool:
        return float(np.linalg.eigvals(torsional_matrix(parameters, k, fall)).real.max()) < 0.0

    step = 2.0 * math.sqrt(float(k.J) * float(k.k_t))  # a critical damping
    low, high = -step, parameters.drillstring.torsional_damping + 4.0 * step
    for _ in range(60):  # it is stable below and unstable above
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def mean_torque(parameters: Parameters, operation: Operation, k: Coefficients) -> float:
    """Steady surface torque [N m]: rock at mean bit force W, and torsional damping."""
    bit = parameters.bit
    speed = operation.rotary_speed
    cutting = k.cutting_arm * 2 / math.pi * math.atan(bit.friction.smoothing * speed)
    rock = operation.wob * (2 / 3 * k.bit_radius * float(friction(bit.friction, speed)) + cutting)
    return float(rock + parameters.drillstring.torsional_damping * speed)


def lateral_stiffness(parameters: Parameters, operation: Operation, k: Coefficients) -> float:
    """Lateral stiffness [N/m] under the mean axial force and torque, as the study softens it; negative if buckled."""
    string, span = parameters.drillstring, parameters.drillstring.collar.span
    if string.lateral_softening == "none":
        return float(k.k_bend)
    stiffness = k.k_bend - operation.wob * math.pi**2 / (2 * span)
    if string.lateral_softening == "live":
        torque = mean_torque(parameters, operation, k) - string.torsional_damping * operation.rotary_speed
        stiffness -= torque * math.pi**3 / (2 * span**2)
    return float(stiffness)


def wall_speed(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """Least speed [rad/s] at which drag-limited forward synchronous whirl has the radius of the gap, None if there is
    none: (k_r (c0 - s0) - m W^2 c0)^2 + (c W^2 c0^2)^2 = (m_e e0 W^2)^2, a quadratic in W^2, with s0 the clearance of
    the stabilisers, m = m_c + m_f (1 - swirl)^2 and c = c_h (1 - swirl)^2."""
    stiffness = lateral_stiffness(parameters, operation, k)
    unbalance = k.m_e * parameters.drillstring.eccentricity
    swirl, room = parameters.mud.swirl, parameters.stabilizer.clearance or 0.0
    mass = mass_in_swirl(k, swirl)
    a = (mass * k.gap) ** 2 + (k.c_h * (1.0 - swirl) ** 2 * k.gap**2) ** 2 - unbalance**2
    b = -2 * stiffness * (k.gap - room) * mass * k.gap
    c = (stiffness * (k.gap - room)) ** 2
    if stiffness <= 0:
        return 0.0
    if a == 0:
        return math.sqrt(-c / b)
    discriminant = b * b - 4 * a * c
    if discriminant < 0:
        return None
    # The stable form of the roots; the smaller positive one is where the gap is first reached.
    half = -0.5 * (b - math.sqrt(discriminant))
    roots = [root for root in (half / a, c / half) if root > 0]
    return math.sqrt(min(roots)) if roots else None


def lift_off_wob(parameters: Parameters, operation: Operation, k: Coefficients) -> float:
    """Weight on bit [N] below which linear steady contact over the lobes is lost at this speed:
    s0 K |k_a - m_a w^2 + i c_a w| / |K - m_a w^2 + i c_a w| with K = k_a + k_c and w = n_b Omega."""
    bit = parameters.bit
    w = bit.lobes * operation.rotary_speed
    damping = complex(0, parameters.drillstring.axial_damping * w)
    k_a, m_a = float(k.k_a), float(k.m_a)
    both = k_a + bit.rock_stiffness
    free = k_a - m_a * w * w + damping
    return float(bit.surface_amplitude * both * abs(free) / abs(both - m_a * w * w + damping))
