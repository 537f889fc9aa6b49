"""Quantities derived from the coefficients at one operating point: natural frequencies,
critical speeds, margins."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nsdrill.data import Array
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, bit_arm, derive
from nsdrill.models.christoforou_yigit.columns import weights
from nsdrill.models.christoforou_yigit.drives import circuit, fall_withstood, gains, impedance, torsional_matrix
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.drives import quantities_of_drive, reflection
from nsdrill.models.numbers import DerivedQuantity
from nsdrill.models.operation import Operation


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
    """Least speed [rad/s] at which drag-limited forward synchronous whirl has the radius
    of the gap; None if there is none, 0 if the span is buckled."""
    speeds = wall_speeds(parameters, operation, k)
    return None if speeds is None else speeds[0]


def wall_speeds(parameters: Parameters, operation: Operation, k: Coefficients) -> tuple[float, float] | None:
    """The speeds W [rad/s] between which drag-limited forward synchronous whirl would be
    wider than the gap; None if there are none, from 0 on if the span is buckled. They
    solve

        (k_r (c0 - s0) - m W^2 c0)^2 + (c W^2 c0^2)^2 = (m_e e0 W^2)^2

    which is quadratic in W^2, with s0 the clearance of the stabilisers, m = m_c + m_f
    (1 - swirl)^2 and c = c_h (1 - swirl)^2. The second is infinite where an
    eccentricity above the gap keeps it there.
    """
    stiffness = lateral_stiffness(parameters, operation, k)
    unbalance = k.m_e * parameters.drillstring.eccentricity
    swirl, clearance = parameters.mud.swirl, parameters.stabilizer.clearance or 0.0
    mass = mass_in_swirl(k, swirl)
    a = (mass * k.gap) ** 2 + (k.c_h * (1.0 - swirl) ** 2 * k.gap**2) ** 2 - unbalance**2
    b = -2 * stiffness * (k.gap - clearance) * mass * k.gap
    c = (stiffness * (k.gap - clearance)) ** 2
    if stiffness <= 0:
        return 0.0, math.inf
    if a == 0:
        return math.sqrt(-c / b), math.inf
    discriminant = b * b - 4 * a * c
    if discriminant < 0:
        return None
    # The numerically stable form of the roots.
    half = -0.5 * (b - math.sqrt(discriminant))
    roots = sorted(math.sqrt(root) for root in (half / a, c / half) if root > 0)
    return (roots[0], roots[1] if len(roots) > 1 else math.inf) if roots else None


def rolling_speed(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """Speed [rad/s] above which a collar that rolls along the wall without slip goes on,
    as friction carries the drag of the mud:

        (c0/R_c) sqrt(k_r (c0 - s0) / (c0 (m_l - c_h c0/mu)))

    with the dynamic coefficient mu and mud that does not rotate; None where the drag is
    greater at any speed, 0 if the span is buckled. The smoothed law loses it 1.6 % later.
    """
    stiffness, mu = lateral_stiffness(parameters, operation, k), parameters.well.friction.dynamic
    clearance = parameters.stabilizer.clearance or 0.0
    if stiffness <= 0:
        return 0.0
    carried = mu * k.m_l - k.c_h * k.gap
    if carried <= 0:
        return None
    return float(k.gap / k.collar_radius * math.sqrt(stiffness * (1.0 - clearance / k.gap) * mu / carried))


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


FASTEST = 1e4  # rad/s


def onset(parameters: Parameters, k: Coefficients, slope: float) -> float | None:
    """The greatest bit speed [rad/s] at which the torque over the force falls as
    steeply as ``slope`` [m s/rad], which is positive; None where it does so nowhere.
    Above that speed the fall of every law becomes less steep."""
    # from the steepest fall on: most laws fall most steeply at rest, others rise first
    trial = np.append(0.0, np.geomspace(1e-3, FASTEST, 7001))
    start = float(trial[int(np.argmax(bit_arm(parameters, k, trial, "fall")))])
    return _last(lambda speeds: np.asarray(bit_arm(parameters, k, speeds, "fall") > slope), start, FASTEST, 14)


def _last(holds: Callable[[Array], Array], low: float, high: float, rounds: int) -> float | None:
    """The greatest number from ``low`` to ``high`` at which ``holds``, in ``rounds`` of
    41 points between the neighbours found before; None where it holds nowhere, and
    where it still holds at ``high``."""
    for _ in range(rounds):
        trial = np.linspace(low, high, 41)
        true = np.flatnonzero(holds(trial))
        if len(true) == 0 or true[-1] + 1 == len(trial):
            return None
        low, high = trial[true[-1] : true[-1] + 2].tolist()
    return low


# cos(theta) at the midpoints of equal parts of half a cycle
_PHASE = np.cos((np.arange(1500) + 0.5) * math.pi / 1500)


def averaged_fold(parameters: Parameters, k: Coefficients, damping: float, wob: float) -> float | None:
    """The greatest mean bit speed [rad/s] at which friction sustains a cycle that just
    comes to rest, v = Omega (1 + cos theta), against the ``damping`` of string and
    drive [N m s/rad]; None where it does so nowhere. First-order averaging of the
    energy over a cycle gives damping Omega / 2 = -W <arm(v) cos theta>."""
    if damping <= 0.0 or wob <= 0.0:
        return None

    def grows(logarithms: Array) -> Array:
        speeds = np.exp(logarithms)
        work = wob * (bit_arm(parameters, k, speeds[:, None] * (1 + _PHASE)) * _PHASE).mean(axis=1)
        grown: Array = work + 0.5 * damping * speeds < 0.0
        return grown

    last = _last(grows, math.log(1e-3), math.log(FASTEST), 5)
    return None if last is None else math.exp(last)
