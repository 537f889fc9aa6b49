"""What an engineer reads off the coefficients at one operating point: natural frequencies, critical speeds, margins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.drives import gains, impedance
from nsdrill.models.christoforou_yigit.laws import bit_arm, onset
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
        **_torsion(parameters, operation, k),
    }


def _torsion(parameters: Parameters, operation: Operation, k: Coefficients) -> dict[str, Figure]:
    """What decides on stick-slip: the string with its drive, linear, and the fall of friction with bit speed."""
    held = slope_held(parameters, k)
    least = held / operation.wob if operation.wob > 0.0 and held > 0.0 else 0.0
    below = onset(parameters, k, least) if least > 0.0 else None
    found = {
        "slope_held": Figure(
            held, "N m s/rad", "steepest fall of the bit's friction torque with speed that steady drilling withstands"
        ),
        "stick_slip_onset": Figure(below, "rad/s", "speed below which steady drilling is unstable to stick-slip"),
    }
    if parameters.drive.ideal:
        return found
    law_of_drive = gains(parameters, k)
    found |= {"pipe_impedance": Figure(float(impedance(parameters)), "N m s/rad", "torsional impedance of the pipe")}
    if parameters.drive.kind == "dc_motor":
        per = 1.0 / float(parameters.drive.motor_damping)
        found["droop"] = Figure(
            mean_torque(parameters, operation, k) * per, "rad/s", "fall of the motor's speed under the steady torque"
        )
    else:
        found |= {
            "drive_stiffness": Figure(float(law_of_drive.stiffness), "N m/rad", "integral gain of the drive, K_i"),
            "drive_damping": Figure(float(law_of_drive.damping), "N m s/rad", "proportional gain of the drive, K_p"),
        }
    if parameters.drive.torque_limit is not None:
        left = float(parameters.drive.torque_limit) - mean_torque(parameters, operation, k)
        found["torque_reserve"] = Figure(left, "N m", "torque limit of the drive less the steady torque")
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
    if parameters.drive.kind == "dc_motor":
        return _with_motor(parameters, k, c_t)
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


def _with_motor(parameters: Parameters, k: Coefficients, c_t: float) -> np.ndarray:
    """The matrix of string and DC motor [4, 4]: (drive speed, torque of the pipe's spring, bit speed, motor torque).
    The angle of the top, which nothing holds at constant voltage, is left out: its eigenvalue is 0."""
    drive, J, k_t = parameters.drive, float(k.J), float(k.k_t)
    inertia, c_s, per_time = float(drive.inertia), float(drive.shaft_damping), 1.0 / float(drive.circuit_time)
    return np.array(
        [
            [-c_s / inertia, -1.0 / inertia, c_s / inertia, 1.0 / inertia],
            [k_t, 0.0, -k_t, 0.0],
            [c_s / J, 1.0 / J, -(c_t + c_s) / J, 0.0],
            [-float(drive.motor_damping) * per_time, 0.0, 0.0, -per_time],
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
    speed = operation.rotary_speed
    rock = operation.wob * bit_arm(parameters, k, speed)
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
    none: (k_r - m_l W^2)^2 c0^2 + (c_h W^2 c0^2)^2 = (m_e e0 W^2)^2, a quadratic in W^2."""
    stiffness = lateral_stiffness(parameters, operation, k)
    unbalance = k.m_e * parameters.drillstring.eccentricity
    a = (k.m_l * k.gap) ** 2 + (k.c_h * k.gap**2) ** 2 - unbalance**2
    b = -2 * stiffness * k.m_l * k.gap**2
    c = (stiffness * k.gap) ** 2
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
