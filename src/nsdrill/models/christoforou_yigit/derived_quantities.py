"""Quantities derived from the coefficients at one operating point: natural frequencies,
critical speeds, margins."""

from __future__ import annotations

import math

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.drives import circuit, gains, impedance, regulator
from nsdrill.models.christoforou_yigit.lateral import weights
from nsdrill.models.christoforou_yigit.laws import averaged_fold, bit_arm, onset
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.drives import Gains, reflection
from nsdrill.models.numbers import DerivedQuantity
from nsdrill.models.operation import Operation
from nsdrill.models.stability import growing, quantities_of_drive, steepest_fall


def derived_quantities(
    parameters: Parameters, operation: Operation, averaged: bool = True
) -> dict[str, DerivedQuantity]:
    """The derived quantities by name. Those averaged over a cycle, which take longer,
    are left out unless ``averaged``."""
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    bit = parameters.bit
    contact = math.sqrt((k.k_a + bit.rock_stiffness) / k.m_a)
    torque = mean_torque(parameters, operation, k)
    stiffness = lateral_stiffness(parameters, operation, k)
    return {
        "axial_free": DerivedQuantity(math.sqrt(k.k_a / k.m_a), "rad/s", "axial frequency, bit off the rock", "axial"),
        "axial_contact": DerivedQuantity(contact, "rad/s", "axial frequency, bit on the rock", "axial"),
        "torsional": DerivedQuantity(math.sqrt(k.k_t / k.J), "rad/s", "torsional frequency"),
        "lateral": DerivedQuantity(
            math.sqrt(stiffness / k.m_l) if stiffness > 0 else None, "rad/s", "lateral frequency at this WOB", "lateral"
        ),
        "lateral_stiffness": DerivedQuantity(stiffness, "N/m", "lateral stiffness at this WOB", "lateral"),
        "buckling_margin": DerivedQuantity(
            float(1 - operation.wob / k.buckling_load), "1", "1 - WOB / buckling load of the span", "buckling"
        ),
        "wall_speed": DerivedQuantity(
            wall_speed(parameters, operation, k), "rad/s", "speed at which forward whirl reaches the wall", "lateral"
        ),
        "lobe_resonance": DerivedQuantity(
            contact / bit.lobes, "rad/s", "speed at which the lobes excite the axial contact mode", "axial"
        ),
        "lift_off_wob": DerivedQuantity(
            lift_off_wob(parameters, operation, k), "N", "WOB below which steady contact is lost", "axial"
        ),
        "mean_torque": DerivedQuantity(torque, "N m", "steady torque at the surface"),
        "static_twist": DerivedQuantity(float(-torque / k.k_t), "rad", "steady twist of the string"),
        **_lateral(parameters, stiffness, k),
        **_torsion(parameters, operation, k, averaged),
    }


def _lateral(parameters: Parameters, stiffness: float, k: Coefficients) -> dict[str, DerivedQuantity]:
    """Critical speeds of whirl in rotating mud, and the load across an inclined
    hole."""
    quantities = {}
    swirl = parameters.mud.swirl
    if swirl:
        critical = math.sqrt(stiffness / mass_in_swirl(k, swirl)) if stiffness > 0 else None
        driving_speed = math.sqrt(stiffness / k.m_c) / swirl if stiffness > 0 else None
        quantities = {
            "critical_speed": DerivedQuantity(
                critical, "rad/s", "critical speed of forward whirl in rotating mud", "lateral"
            ),
            "fluid_whirl": DerivedQuantity(
                driving_speed, "rad/s", "speed above which rotating mud drives whirl by itself", "lateral"
            ),
        }
    side_load, _ = weights(parameters)
    if side_load > 0:
        quantities["side_load"] = DerivedQuantity(
            float(side_load), "N", "weight of the span across the hole, as it bends", "lateral"
        )
    return quantities


def mass_in_swirl(k: Coefficients, swirl: float) -> float:
    """The effective mass of the span [kg] in synchronous whirl, in mud that rotates
    with the fraction ``swirl`` of the rotary speed: the inertia force at radius r is
    this times Omega^2 r."""
    return float(k.m_c + k.m_f * (1.0 - swirl) ** 2)


def _torsion(
    parameters: Parameters, operation: Operation, k: Coefficients, averaged: bool
) -> dict[str, DerivedQuantity]:
    """Quantities that decide on stick-slip, from the linear string with its drive and
    the fall of friction with bit speed."""
    law = None if parameters.drive.ideal else gains(parameters, k)
    matrix = torsional_matrix(parameters, k, law)
    slope = float(fall_withstood(matrix, k, parameters.drillstring.torsional_damping))
    least_fall = slope / operation.wob if operation.wob > 0.0 and slope > 0.0 else 0.0
    onset_speed = onset(parameters, k, least_fall) if least_fall > 0.0 else None
    quantities = {
        "slope_held": DerivedQuantity(
            slope, "N m s/rad", "steepest fall of the bit's friction torque with speed that steady drilling withstands"
        ),
        "stick_slip_onset": DerivedQuantity(
            onset_speed, "rad/s", "speed below which steady drilling is unstable to stick-slip"
        ),
    }
    if averaged:
        quantities["stick_slip_fold"] = DerivedQuantity(
            averaged_fold(parameters, k, slope, operation.wob),
            "rad/s",
            "speed below which torsional stick-slip, once begun, lasts; by averaging, 6 to 14 % too low",
        )
    if law is None:
        return quantities
    frequency = math.sqrt(float(k.k_t) / float(k.J))
    reflected = reflection(law, float(impedance(parameters)), frequency, circuit(parameters, k))
    quantities |= {
        "pipe_impedance": DerivedQuantity(float(impedance(parameters)), "N m s/rad", "torsional impedance of the pipe")
    }
    drive, mean = parameters.drive, mean_torque(parameters, operation, k)
    if drive.kind == "dc_motor" and not drive.regulated:  # else the voltage compensates the droop
        droop = mean * (1.0 / float(drive.motor_damping))
        meaning = "fall of the motor's speed under the steady torque"
        quantities["droop"] = DerivedQuantity(droop, "rad/s", meaning)
    by_torque = None if drive.kind == "dc_motor" else law
    return quantities | quantities_of_drive(drive, matrix, mean, reflected, by_torque)


def torsional_matrix(parameters: Parameters, k: Coefficients, law: Gains | None = None) -> np.ndarray:
    """The matrix of string and drive [4, 4] for deviations of (lag, drive speed, twist,
    bit speed) from the set point, without friction at the bit; [2, 2] for the last two
    with an ideal drive. ``law`` are the :func:`gains` of the drive if they have been
    computed; if they are arrays, the matrix has their dimensions first."""
    c_t = parameters.drillstring.torsional_damping
    J, k_t = float(k.J), float(k.k_t)
    if parameters.drive.ideal and law is None:
        return np.array([[0.0, 1.0], [-k_t / J, -c_t / J]])
    if parameters.drive.kind == "dc_motor":
        return _with_motor(parameters, k, c_t)
    law = law or gains(parameters, k)
    inertia, stiffness, damping, twist, speed, c_s = np.broadcast_arrays(*(np.asarray(value, float) for value in law))
    matrix = np.zeros((*inertia.shape, 4, 4))
    matrix[..., 0, 1] = matrix[..., 2, 3] = 1.0
    matrix[..., 1, 0] = (twist - stiffness - k_t) / inertia
    matrix[..., 1, 1] = -(damping + c_s) / inertia
    matrix[..., 1, 2] = (k_t - twist) / inertia
    matrix[..., 1, 3] = (c_s - speed) / inertia
    matrix[..., 3, 0], matrix[..., 3, 2] = k_t / J, -k_t / J
    matrix[..., 3, 1], matrix[..., 3, 3] = c_s / J, -(c_t + c_s) / J
    return matrix


def _with_motor(parameters: Parameters, k: Coefficients, c_t: float) -> np.ndarray:
    """The matrix of string and DC motor [4, 4]: (motor torque, drive speed, torque of
    the pipe's spring, bit speed). The angle of the top, which is free at constant
    voltage, is left out: its eigenvalue is 0. With gains that hold the angle [5, 5]:
    (motor torque, lag, drive speed, twist, bit speed)."""
    drive, J, k_t = parameters.drive, float(k.J), float(k.k_t)
    inertia, c_s, per_time = (float(drive.top_inertia), float(drive.shaft_damping), 1.0 / float(drive.circuit_time))
    law = regulator(parameters, k, 0.0, 0.0)  # without gains 0
    circuit, damping = -(1.0 + law.torque) * per_time, float(drive.motor_damping) + law.drive_speed
    if law.lag + law.twist != 0.0:
        return np.array(
            [
                [circuit, -law.lag * per_time, -damping * per_time, -law.twist * per_time, -law.bit_speed * per_time],
                [0.0, 0.0, 1.0, 0.0, 0.0],
                [1.0 / inertia, -k_t / inertia, -c_s / inertia, k_t / inertia, c_s / inertia],
                [0.0, 0.0, 0.0, 0.0, 1.0],
                [0.0, k_t / J, c_s / J, -k_t / J, -(c_t + c_s) / J],
            ]
        )
    return np.array(
        [
            [circuit, -damping * per_time, -law.lag / k_t * per_time, -law.bit_speed * per_time],
            [1.0 / inertia, -c_s / inertia, -1.0 / inertia, c_s / inertia],
            [0.0, k_t, 0.0, -k_t],
            [0.0, c_s / J, 1.0 / J, -(c_t + c_s) / J],
        ]
    )


def slope_held(parameters: Parameters, k: Coefficients) -> float:
    """The steepest fall of the friction torque with bit speed [N m s/rad] with which
    steady drilling is stable; negative where the drive itself is unstable."""
    return float(fall_withstood(torsional_matrix(parameters, k), k, parameters.drillstring.torsional_damping))


def fall_withstood(matrix: np.ndarray, k: Coefficients, c_t: float) -> np.ndarray:
    """As :func:`slope_held`, for strings and drives with these matrices of
    :func:`torsional_matrix` [..., n, n]: array [...]. ``c_t`` is the torsional damping
    [N m s/rad]."""
    # with an ideal drive oscillations grow where the fall exceeds the damping
    if matrix.shape[-1] == 2:
        return np.full(matrix.shape[:-2], float(c_t))
    critical = 2.0 * math.sqrt(float(k.J) * float(k.k_t))  # a critical damping
    return steepest_fall(matrix, -1, float(k.J), -critical, c_t + 4.0 * critical)


def growth_at_rest(parameters: Parameters, k: Coefficients) -> complex | None:
    """The eigenvalue [1/s] of the fastest growing deviation of string and drive,
    without friction at the bit; None where none grows."""
    return growing(torsional_matrix(parameters, k))


def mean_torque(parameters: Parameters, operation: Operation, k: Coefficients) -> float:
    """Steady surface torque [N m]: rock at mean bit force W, and torsional damping."""
    speed = operation.rotary_speed
    rock = operation.wob * bit_arm(parameters, k, speed)
    return float(rock + parameters.drillstring.torsional_damping * speed)


def lateral_stiffness(parameters: Parameters, operation: Operation, k: Coefficients, waves: int = 1) -> float:
    """Lateral stiffness [N/m] under the mean axial force and torque, with the softening
    of the study; negative if buckled. It is that of the shape sin(n pi x / l) with n
    half ``waves``; the model has the first of these. Bending grows with n^4, the work
    of the force with n^2, that of the torque with n^3."""
    string, span = parameters.drillstring, parameters.drillstring.collar.span
    bending = k.k_bend * waves**4
    if string.lateral_softening == "none":
        return float(bending)
    stiffness = bending - operation.wob * (waves * math.pi) ** 2 / (2 * span)
    if string.lateral_softening == "live":
        torque = mean_torque(parameters, operation, k) - string.torsional_damping * operation.rotary_speed
        stiffness -= torque * (waves * math.pi) ** 3 / (2 * span**2)
    return float(stiffness)


def wall_speed(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """Least speed W [rad/s] at which drag-limited forward synchronous whirl has the
    radius of the gap; None if there is none, 0 if the span is buckled. It solves

        (k_r (c0 - s0) - m W^2 c0)^2 + (c W^2 c0^2)^2 = (m_e e0 W^2)^2

    which is quadratic in W^2, with s0 the clearance of the stabilisers, m = m_c + m_f
    (1 - swirl)^2 and c = c_h (1 - swirl)^2.
    """
    stiffness = lateral_stiffness(parameters, operation, k)
    unbalance = k.m_e * parameters.drillstring.eccentricity
    swirl, clearance = parameters.mud.swirl, parameters.stabilizer.clearance or 0.0
    mass = mass_in_swirl(k, swirl)
    a = (mass * k.gap) ** 2 + (k.c_h * (1.0 - swirl) ** 2 * k.gap**2) ** 2 - unbalance**2
    b = -2 * stiffness * (k.gap - clearance) * mass * k.gap
    c = (stiffness * (k.gap - clearance)) ** 2
    if stiffness <= 0:
        return 0.0
    if a == 0:
        return math.sqrt(-c / b)
    discriminant = b * b - 4 * a * c
    if discriminant < 0:
        return None
    # The numerically stable form of the roots; the gap is first reached at the smaller
    # positive one.
    half = -0.5 * (b - math.sqrt(discriminant))
    roots = [root for root in (half / a, c / half) if root > 0]
    return math.sqrt(min(roots)) if roots else None


def lift_off_wob(parameters: Parameters, operation: Operation, k: Coefficients) -> float:
    """Weight on bit [N] below which linear steady contact over the lobes is lost at
    this speed:

        s0 K |k_a - m_a w^2 + i c_a w| / |K - m_a w^2 + i c_a w|

    with K = k_a + k_c and w = n_b Omega.
    """
    bit = parameters.bit
    excitation = bit.lobes * operation.rotary_speed
    damping = complex(0, parameters.drillstring.axial_damping * excitation)
    k_a, m_a = float(k.k_a), float(k.m_a)
    contact_stiffness = k_a + bit.rock_stiffness
    free_impedance = k_a - m_a * excitation * excitation + damping
    return float(
        bit.surface_amplitude
        * contact_stiffness
        * abs(free_impedance)
        / abs(contact_stiffness - m_a * excitation * excitation + damping)
    )
