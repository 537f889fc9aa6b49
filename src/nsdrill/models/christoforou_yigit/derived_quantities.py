"""Quantities derived from the coefficients at one operating point: natural frequencies,
critical speeds, margins."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import takewhile
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models import cutting, friction
from nsdrill.models.christoforou_yigit.bouncing import bounce_speed
from nsdrill.models.christoforou_yigit.coefficients import GRAVITY, Coefficients, added_mass_in_hole, derive, ring
from nsdrill.models.christoforou_yigit.columns import weights
from nsdrill.models.christoforou_yigit.drives import impedance, linear_of
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.table import drilling_at, moving_string, string_of
from nsdrill.models.drilling import Drilling
from nsdrill.models.drive_laws import quantities_of_drive, reflection
from nsdrill.models.numbers import DerivedQuantity
from nsdrill.models.operation import Numeric, Operation, Values
from nsdrill.models.sections import parts_of

ROUNDS = 8  # of a search for a speed: each makes its error some ten times smaller
HEAVY = 1.5  # times the weight of the lightest section, from which one is no drill pipe


def derived_quantities(
    parameters: Parameters, operation: Operation, averaged: bool = True, drilling: Drilling | None = None
) -> dict[str, DerivedQuantity]:
    """The derived quantities by name. Those averaged over a cycle, which take longer,
    are left out unless ``averaged``. ``drilling`` is that of another model of the
    string, whose equations are its own."""
    drilling = drilling or drilling_at(parameters, operation)
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    contact, rock = lobe_resonance(parameters, k) * parameters.bit.lobes, parameters.bit.rock
    stiffness = lateral_stiffness(parameters, operation, k)
    reaches = drilling.critical_speed(
        "wall_speed",
        wall_speed_of_bit(parameters, operation, k),
        "speed at which forward whirl, about where the collar sags to, touches the low side"
        if parameters.well.inclination > 0.0
        else "speed at which forward whirl reaches the wall",
        "lateral",
    )
    turning = drilling.quantities(fold=averaged and not rock.regenerative)
    if not rock.regenerative:
        on_rock = _on_lobes(parameters, operation, drilling, k)
    else:  # the torque does not fall with the speed of the bit
        bit = cutting_at(parameters, operation)
        on_rock = cutting.quantities(bit)
        if averaged:
            on_rock |= cutting.stability(bit, moving_string(parameters, operation))
        turning = cutting.without_fall(turning)
    return {
        "axial_free": DerivedQuantity(math.sqrt(k.k_a / k.m_a), "rad/s", "axial frequency, bit off the rock", "axial"),
        "axial_contact": DerivedQuantity(contact, "rad/s", "axial frequency, bit on the rock", "axial"),
        "torsional": DerivedQuantity(math.sqrt(k.k_t / k.J), "rad/s", "torsional frequency"),
        "torsional_damping": DerivedQuantity(
            torsional_damping_ratio(parameters, k), "1", "damping ratio of the torsional mode below a held top"
        ),
        "lateral": DerivedQuantity(
            math.sqrt(stiffness / k.m_l) if stiffness > 0 else None, "rad/s", "lateral frequency at this WOB", "lateral"
        ),
        "lateral_stiffness": DerivedQuantity(stiffness, "N/m", "lateral stiffness at this WOB", "lateral"),
        "buckling_margin": DerivedQuantity(
            float(1 - operation.wob / k.buckling_load), "1", "1 - WOB / buckling load of the span", "buckling"
        ),
        "collar_weight": DerivedQuantity(
            collar_weight(parameters),
            "N",
            "weight of the collars, or heavy sections, in mud, along the hole",
            "buckling",
        ),
        **reaches,
        "added_mass_hole": DerivedQuantity(
            float(added_mass_in_hole(parameters)),
            "1",
            "added-mass coefficient of a collar in the middle of this hole, by potential flow",
            "lateral",
        ),
        "passing_rate": DerivedQuantity(
            passing_rate(parameters, operation, k),
            "rad/s^2",
            "rate of change of speed at which whirl passes its resonance off the wall",
            "lateral",
        ),
        **on_rock,
        **_lateral(parameters, drilling, stiffness, k),
        **turning,
        **_drive(parameters, drilling, k),
    }


def cutting_at(parameters: Parameters, operation: Operation) -> cutting.Cutting:
    """The bit on the surface that its blades leave, at an operating point."""
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    axial = float(k.m_a), float(k.k_a), float(parameters.drillstring.axial_damping)
    point = float(operation.wob), float(operation.rotary_speed)
    return cutting.of_one_mass(parameters.bit.rock, "bit.rock", float(k.bit_radius), *point, *axial)


def _on_lobes(
    parameters: Parameters, operation: Operation, drilling: Drilling, k: Coefficients
) -> dict[str, DerivedQuantity]:
    """What lobes do to the bit."""
    meaning = "speed at which the lobes excite the axial contact mode"
    return {
        **drilling.critical_speed("lobe_resonance", lobe_resonance(parameters, k), meaning, "axial"),
        **drilling.critical_speed(
            "bounce_speed",
            bounce_speed(parameters, operation, k),
            "speed above which a bounce over the lobes, once started, may last",
            "axial",
        ),
        "lift_off_wob": DerivedQuantity(
            lift_off_wob(parameters, operation, k), "N", "WOB below which steady contact is lost", "axial"
        ),
    }


def _lateral(
    parameters: Parameters, drilling: Drilling, stiffness: float, k: Coefficients
) -> dict[str, DerivedQuantity]:
    """Critical speeds of whirl in rotating mud, and the load across an inclined
    hole."""
    quantities: dict[str, DerivedQuantity] = {}
    swirl = parameters.mud.swirl
    if swirl:
        forward = math.sqrt(stiffness / mass_in_swirl(k, swirl)) if stiffness > 0 else None
        own = float(fluid_whirl(swirl, k, stiffness))
        for name, speed, words in (
            ("critical_speed", forward, "critical speed of forward whirl in rotating mud"),
            (
                "fluid_whirl",
                own if math.isfinite(own) else None,
                "speed above which rotating mud drives whirl by itself",
            ),
        ):
            quantities |= drilling.critical_speed(name, speed, words, "lateral")
    side_load, _ = weights(parameters)
    if side_load > 0:
        quantities["side_load"] = DerivedQuantity(
            float(side_load), "N", "weight of the span across the hole, as it bends", "lateral"
        )
    return quantities


def fluid_whirl(swirl: Numeric, k: Coefficients, stiffness: Numeric) -> Array:
    """The speed of the bit [rad/s] above which mud that rotates with the fraction ``swirl`` of the
    speed drives a collar of this lateral ``stiffness`` [N/m] from the axis, whatever its drag;
    infinite where the mud rests, and of a collar that buckles."""
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.sqrt(np.asarray(stiffness) / k.m_c) / np.asarray(swirl, dtype=float)
    return np.where((np.asarray(swirl) > 0.0) & (np.asarray(stiffness) > 0.0), speed, np.inf)


def driven_by_mud_above(values: Values[Parameters]) -> Array:
    """The set speeds [rad/s] above which rotating mud drives whirl by itself, of settings whose
    values are numbers or arrays [settings]; infinite where it does at no speed. The torque that
    softens the collar is that at this speed; the speed of the settings is where the search for
    it begins."""
    parameters = values.parameters
    depth, wob, speed = np.broadcast_arrays(*values.operation)
    never = np.full(speed.shape, np.inf)
    if parameters.modes.lateral != "free" or not np.any(np.asarray(parameters.mud.swirl) > 0.0):
        return never
    string, k, bit = string_of(parameters, depth, wob), derive(parameters, depth, wob, speed), speed
    for _ in range(ROUNDS):
        torque = partial(string.bit_torque, bit, speed)
        found = fluid_whirl(parameters.mud.swirl, k, softened(parameters, k, wob, torque))
        bit = np.where(np.isfinite(found), found, bit)
        speed = bit if string.holds else string.balance(bit).set_speed
    return np.where(np.isfinite(found), speed, never)


def torsional_damping_ratio(parameters: Parameters, k: Coefficients) -> float:
    """Of the torsional mode below a held top, without friction at the bit: c_t / (2
    sqrt(k_t J)). Of a lumped damping that is given it grows with the depth."""
    return float(parameters.drillstring.torsional_damping / (2.0 * math.sqrt(k.k_t * k.J)))


def collar_weight(parameters: Parameters) -> float | None:
    """The weight [N] of all collars in mud, along the hole. Of a string of sections they are
    the lowest ones that are heavier than :data:`HEAVY` times the lightest one, per length,
    which counts heavy-weight pipe; None where there are none."""
    string, mud = parameters.drillstring, parameters.mud.density
    if string.sections is None:
        collar = string.collar
        area, _ = ring(collar.outer_diameter, collar.inner_diameter)
        in_mud = (string.material.density - mud) * float(area) * collar.length
    else:
        below = math.fsum(section.length or 0.0 for section in string.sections[1:])
        parts = parts_of(string.sections, string.material, below + 1.0)
        light = HEAVY * min(float(part.density) * part.area for part in parts)
        heavy = [*takewhile(lambda part: float(part.density) * part.area > light, reversed(parts[1:]))]
        if not heavy:
            return None
        in_mud = math.fsum((float(part.density) - mud) * part.area * float(part.length) for part in heavy)
    return float(GRAVITY * in_mud * math.cos(parameters.well.inclination))


def stiffness_of_rock(parameters: Parameters) -> float:
    """The stiffness of the rock [N/m], or of a bit that cuts its force per depth of cut."""
    bit = parameters.bit
    if not bit.rock.regenerative:
        return float(bit.rock_stiffness)
    return float(bit.rock.blades * bit.rock.zeta * bit.rock.specific_energy * parameters.well.diameter / 2)


def lobe_resonance(parameters: Parameters, k: Coefficients) -> float:
    """The speed of the bit [rad/s] at which the lobes excite the axial contact mode."""
    return math.sqrt((k.k_a + stiffness_of_rock(parameters)) / k.m_a) / parameters.bit.lobes


def mass_in_swirl(k: Coefficients, swirl: float) -> float:
    """The effective mass of the span [kg] in synchronous whirl, in mud that rotates
    with the fraction ``swirl`` of the rotary speed: the inertia force at radius r is
    this times Omega^2 r."""
    return float(k.m_c + k.m_f * (1.0 - swirl) ** 2)


def _drive(parameters: Parameters, drilling: Drilling, k: Coefficients) -> dict[str, DerivedQuantity]:
    """What a drive that is not ideal does, alone and with the string."""
    drive = parameters.drive
    if drive.ideal:
        return {}
    (law, motor), pipe = linear_of(parameters, k, drilling), float(impedance(parameters))
    reflected = reflection(law, pipe, drilling.frequency, motor)
    quantities = {"pipe_impedance": DerivedQuantity(pipe, "N m s/rad", "torsional impedance of the pipe")}
    by_torque = None if drive.electric else law
    return quantities | quantities_of_drive(
        drive, drilling.matrix, drilling.torque, reflected, by_torque, bends=drilling.bends
    )


def mean_torque(parameters: Parameters, operation: Operation) -> float:
    """Steady surface torque [N m]."""
    return drilling_at(parameters, operation).torque


def lateral_stiffness(parameters: Parameters, operation: Operation, k: Coefficients, waves: int = 1) -> float:
    """Lateral stiffness [N/m] under the mean axial force and torque, with the softening
    of the study; negative if buckled. It is that of the shape sin(n pi x / l) with n
    half ``waves``; the model has the first of these. Bending grows with n^4, the work
    of the force with n^2, that of the torque with n^3."""
    return float(softened(parameters, k, operation.wob, lambda: drilling_at(parameters, operation).rock_torque, waves))


def softened(
    parameters: Parameters, k: Coefficients, wob: Numeric, torque: Callable[[], Numeric], waves: int = 1
) -> Numeric:
    """As :func:`lateral_stiffness`, at weights on bit [N] and under the ``torque`` [N m] on the bit."""
    string, span = parameters.drillstring, parameters.drillstring.collar.span
    bending = k.k_bend * waves**4
    if string.lateral_softening == "none":
        return bending
    stiffness = bending - wob * (waves * math.pi) ** 2 / (2 * span)
    if string.lateral_softening == "live":
        stiffness = stiffness - torque() * (waves * math.pi) ** 3 / (2 * span**2)
    return stiffness


def wall_speed(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """Least set speed [rad/s] at which drag-limited forward synchronous whirl reaches the wall; None
    if there is none, 0 if the span is buckled or lies on the low side."""
    speeds = wall_speeds(parameters, operation, k)
    return None if speeds is None else speeds[0]


def wall_speed_of_bit(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """As :func:`wall_speed`, the speed of the collar and of the bit."""
    speeds = _reaching_speeds(parameters, operation, k)
    return None if speeds is None else speeds[0]


def wall_speeds(parameters: Parameters, operation: Operation, k: Coefficients) -> tuple[float, float] | None:
    """The set speeds [rad/s] between which drag-limited forward synchronous whirl would
    be wider than the room that the collar has; None if there are none, from 0 on if the span is
    buckled or lies on the low side."""
    speeds = _reaching_speeds(parameters, operation, k)
    if speeds is None or parameters.drive.ideal:
        return speeds
    drilling = drilling_at(parameters, operation)
    return drilling.as_set_speed(speeds[0]), drilling.as_set_speed(speeds[1])


def passing_rate(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """How fast the speed must change [rad/s^2] for the imbalance to pass its resonance
    without bringing the collar to the wall, (pi/2) (e W / room)^2, an estimate with the
    speed W at which it would reach the wall of a vertical hole, which is near its resonance; 0 where
    it reaches it at no speed, None where the span is buckled or lies on the low side."""
    speeds = _reaching_speeds(parameters, operation, k)
    if speeds is None or speeds[0] == 0.0:
        return 0.0 if speeds is None else None
    stiffness, gap = lateral_stiffness(parameters, operation, k), float(k.gap)
    left, centred = _room(parameters, k, stiffness, 0.0), _speeds_within(parameters, k, stiffness, (gap, gap))
    speed = math.sqrt(stiffness / mass_in_swirl(k, parameters.mud.swirl)) if centred is None else centred[0]
    return math.pi / 2 * (float(parameters.drillstring.eccentricity) * speed / left) ** 2


def _room(parameters: Parameters, k: Coefficients, stiffness: float, speed: float) -> float:
    """How far the collar may whirl [m] about where it hangs: the gap, in an inclined hole less the sag.
    Mud that turns with the collar at ``speed`` [rad/s] holds it up by less."""
    side_load = float(weights(parameters)[0])
    if side_load == 0.0:
        return float(k.gap)
    held = stiffness - float(k.m_f) * (parameters.mud.swirl * speed) ** 2
    return float(k.gap) - side_load / held if held > 0.0 else 0.0


def _reaching_speeds(parameters: Parameters, operation: Operation, k: Coefficients) -> tuple[float, float] | None:
    """The speeds W of the collar [rad/s] between which whirl would be wider than the
    room a that it has. They solve

        (k_r (a - s0) - m W^2 a)^2 + (c W^2 a^2)^2 = (m_e e0 W^2)^2

    which is quadratic in W^2, with s0 the clearance of the stabilisers, m = m_c + m_f
    (1 - swirl)^2 and c = c_h (1 - swirl)^2. The second is infinite where an
    eccentricity above the room keeps it there. The room is the gap c0 in a vertical hole. In an
    inclined one the collar whirls about its sag F_g/k_r, and a = c0 - F_g/k_r is what is left on
    the low side: the drag is the same all round a circle, so that without stabilisers and swirl this is
    exact. There it touches; it whirls along the wall from there on or from a higher speed.
    """
    stiffness, clearance = lateral_stiffness(parameters, operation, k), parameters.stabilizer.clearance or 0.0
    left = _room(parameters, k, stiffness, 0.0)
    if stiffness <= 0.0 or left <= clearance < k.gap:
        return 0.0, math.inf
    speeds = _speeds_within(parameters, k, stiffness, (left, left))
    if parameters.mud.swirl and left < k.gap:
        resonance = math.sqrt(stiffness / mass_in_swirl(k, parameters.mud.swirl))
        for _ in range(ROUNDS):  # the sag is that at these speeds
            ends = speeds or (resonance, resonance)
            rooms = tuple(_room(parameters, k, stiffness, end) if math.isfinite(end) else left for end in ends)
            if min(rooms) <= clearance:
                return min(ends), math.inf
            speeds = _speeds_within(parameters, k, stiffness, (rooms[0], rooms[1]))
    return speeds


def _speeds_within(
    parameters: Parameters, k: Coefficients, stiffness: float, rooms: tuple[float, float]
) -> tuple[float, float] | None:
    """These speeds, the least and the greatest with the ``rooms`` [m] of each."""
    unbalance = k.m_e * parameters.drillstring.eccentricity
    swirl, clearance = parameters.mud.swirl, parameters.stabilizer.clearance or 0.0
    mass = mass_in_swirl(k, swirl)

    def within(room: float) -> tuple[float, float] | None:
        a = (mass * room) ** 2 + (k.c_h * (1.0 - swirl) ** 2 * room**2) ** 2 - unbalance**2
        b = -2 * stiffness * (room - clearance) * mass * room
        c = (stiffness * (room - clearance)) ** 2
        if a == 0:
            return math.sqrt(-c / b), math.inf
        discriminant = b * b - 4 * a * c
        if discriminant < 0:
            return None
        # The numerically stable form of the roots.
        half = -0.5 * (b - math.sqrt(discriminant))
        roots = sorted(math.sqrt(root) for root in (half / a, c / half) if root > 0)
        return (roots[0], roots[1] if len(roots) > 1 else math.inf) if roots else None

    low = within(rooms[0])
    high = low if rooms[1] == rooms[0] else within(rooms[1])
    return None if low is None or high is None else (low[0], high[1])


SLIPS = np.geomspace(1e-6, 1e2, 4000)  # m/s: the greatest coefficient of the wall is looked for at these


def staying_speed(parameters: Parameters, operation: Operation, k: Coefficients) -> float:
    """Set speed [rad/s] above which a collar on the wall may stay there: a bound, which no
    such motion was seen below. It is the lesser of the speed at which the imbalance brings
    the collar there, and of that at which the wall may drive it backwards: W of

        (R_c W)^2 [f m_c/c0 - (c_h c0 - f m_f) c0 p^2] + F m_e e0 W^2
            = f k_r (c0 - s0) - F F_g - f_s k_r (c0 - s0),  p = 1/c0 + swirl/R_c

    There friction has its greatest coefficient f, as it has where the collar rolls with hardly any
    slip, and carries the drag. The imbalance and the weight across the hole F_g count as if
    they pressed and drove the collar all the time, with F = sqrt(1 + f^2), and so does the
    friction f_s of the stabilisers: together they hold a collar that strikes the wall where it
    cannot roll. 0 where no speed is known below which it leaves the wall: where the span is
    buckled, where weight and stabilisers suffice, and where no speed solves either.
    """
    stiffness, clearance = lateral_stiffness(parameters, operation, k), parameters.stabilizer.clearance or 0.0
    wall = greatest_coefficient(parameters.well.friction)
    held, across = stiffness * (float(k.gap) - clearance), math.hypot(1.0, wall)
    stabilizers = 0.0 if clearance == 0.0 else greatest_coefficient(parameters.stabilizer.friction)
    needed = (wall - stabilizers) * held - across * float(weights(parameters)[0])
    if stiffness <= 0.0 or needed < 0.0:
        return 0.0
    angle = 1.0 / k.gap + parameters.mud.swirl / k.collar_radius
    rolling = wall * k.m_c / k.gap - (k.c_h * k.gap - wall * k.m_f) * k.gap * angle**2
    imbalance = across * float(k.m_e) * float(parameters.drillstring.eccentricity)
    carried = float(k.collar_radius**2 * rolling + imbalance)
    speeds = [] if (reached := wall_speed(parameters, operation, k)) is None else [reached]
    if carried > 0.0:
        speed = math.sqrt(needed / carried)
        speeds.append(speed if parameters.drive.ideal else drilling_at(parameters, operation).as_set_speed(speed))
    return min(speeds, default=0.0)


def greatest_coefficient(section: Any) -> float:
    """The greatest coefficient of the friction of a ``section`` at the wall, at any slip."""
    law, numbers = friction.law_named(section.law), friction.stribeck(section)
    return float(np.max(friction.values(law, "coefficient", SLIPS, numbers, friction.own_numbers(section))))


def lift_off_wob(parameters: Parameters, operation: Operation, k: Coefficients) -> float:
    """Weight on bit [N] below which linear steady contact over the lobes is lost at
    this speed:

        s0 K |k_a - m_a w^2 + i c_a w| / |K - m_a w^2 + i c_a w|

    with K = k_a + k_c and w = n_b Omega.
    """
    bit = parameters.bit
    speed = operation.rotary_speed if parameters.drive.ideal else drilling_at(parameters, operation).speed
    excitation = bit.lobes * speed
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


def lift_off_speeds(parameters: Parameters, operation: Operation, k: Coefficients) -> tuple[float, float] | None:
    """The least and greatest speed of the bit [rad/s] between which :func:`lift_off_wob` is above
    the weight on bit, the greatest infinite where it is so at every greater one; None where the
    weight keeps the bit on the rock at every speed."""
    bit, wob, k_a = parameters.bit, float(operation.wob), float(k.k_a)
    stiffness, mass = k_a + float(bit.rock_stiffness), float(k.m_a)
    lifts, damping = (float(bit.surface_amplitude) * stiffness) ** 2, float(parameters.drillstring.axial_damping) ** 2
    # in w^2 a polynomial of second order, above 0 where the bit lifts off
    force = np.polynomial.Polynomial([k_a**2, damping - 2.0 * k_a * mass, mass**2]) * lifts
    force -= np.polynomial.Polynomial([stiffness**2, damping - 2.0 * stiffness * mass, mass**2]) * wob**2
    roots = np.asarray(force.roots(), complex)
    squares = np.sort(roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0.0)]).tolist()
    if not squares:
        return None
    if force(0.0) > 0.0:
        squares.insert(0, 0.0)
    speeds = [math.sqrt(square) / bit.lobes for square in squares]
    return speeds[0], speeds[1] if len(speeds) > 1 else math.inf


SHAKEN = 0.01  # of the weight on bit: a force of lobes that leaves stick-slip as it is
OVERSHOOT = 2.0  # times the set speed, which the bit reaches in stick-slip


def is_shaken(parameters: Parameters, operation: Operation, speed: float) -> bool:
    """Whether lobes may shake a bit loose that sticks and slips at a set ``speed`` [rad/s]: their
    force is more than :data:`SHAKEN` of the weight at some speed up to :data:`OVERSHOOT` times
    that. It counts as no more than that on a bit that does not move along the hole, as the
    bit passes a resonance quickly in each slip. Of bits started at rest on a rock of 25 MN/m
    stick-slip lasted as far as without lobes at 0.7 % of the weight, to a speed 5 to 10 % lower at
    2 %, and at 7 % with three lobes nowhere."""
    k = derive(parameters, operation.depth, operation.wob, operation.rotary_speed)
    bit, k_a, m_a = parameters.bit, float(k.k_a), float(k.m_a)
    excitation = OVERSHOOT * bit.lobes * speed
    inertia, stiffness = m_a * excitation * excitation, k_a + bit.rock_stiffness
    force = bit.rock_stiffness
    if inertia < stiffness:  # below the resonance it grows with the speed
        force = min(force, force * max(k_a, inertia - k_a) / (stiffness - inertia))
    return float(bit.surface_amplitude * force) > SHAKEN * operation.wob
