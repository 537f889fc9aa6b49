"""What ``check`` shows of a study of a string of segments, and the chart of its drives,
neither of which needs an integration: coefficients, quantities of the string and its
drive, and warnings. On a lobed rock, whose lobes are left out here, axial motion is
decoupled from rotation, as the force on the bit is the weight on it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models import cutting, drive_laws, friction, steady, surface, waves
from nsdrill.models.aggressive import BY_CUTTING, BY_FRICTION, Found, aggressive, found_at, operated, usual_of
from nsdrill.models.deciding import deciding as of_study
from nsdrill.models.deciding import of_surface
from nsdrill.models.drilling import (
    Drilling,
    Limits,
    drillings,
    drooping,
    interrupted,
    limits,
    narrow,
    overloaded,
    resting,
    stalling,
    swinging,
)
from nsdrill.models.drive_laws import (
    LAWS,
    UNLIMITED,
    Circuit,
    Gains,
    about_steady,
    goes_by_torque,
    linear_drive,
    quantities_of_drive,
    reflection,
)
from nsdrill.models.numbers import DerivedQuantity, DriveCard, FormatValue
from nsdrill.models.operation import Numeric, Operation, Values
from nsdrill.models.own_drives import Linear, rows_of
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.sections import parts_of
from nsdrill.models.segments import wall
from nsdrill.models.segments.columns import columns, nodes_of
from nsdrill.models.segments.parameters import Initial, Parameters
from nsdrill.models.segments.rock import cut_of, penetration_rate, quotient
from nsdrill.models.segments.string import (
    NEVER,
    String,
    first_frequency,
    gains_of,
    impedance,
    law_of,
    steady_of,
    string_of,
)
from nsdrill.models.tree import lane_values, with_values
from nsdrill.models.uncertain_onset import sensitive_onset
from nsdrill.models.variant import variant_at
from nsdrill.ranges import computed, meanings_of
from nsdrill.records import dataclass

FRICTION = "bit.friction.level and hump"
OF_FRICTION = tuple(f"bit.friction.{name}" for name in ("level", "hump", "narrowing", "viscous"))
OF_TORSION = ("segments.material_damping.torsional", "mud.viscosity")
ON_ROCK = (
    "bit.surface_amplitude",
    "bit.rock_stiffness",
    "segments.rock_damping",
    "segments.material_damping.axial",
    "segments.top.damping",
)
MODES = 3  # modes of string and drive among the derived quantities
WAVES = 4  # standing waves in the chart of the drives


def turning_string(parameters: Parameters, depth: float, wob: float) -> steady.String:
    """String and drive in steady drilling at a depth [m] under a weight on bit [N], from
    the equations: on a rock without lobes, in steady flow, with a drive that is switched
    on and has no limit."""
    model = model_named("segments")
    variant = variant_at(model, parameters)
    nodes, held = nodes_of(variant.options.nodes), model.undeviated(parameters)
    turning = steady.Turning(
        *(
            tuple(name for name in part if name not in held)
            for part in (nodes.angles, nodes.speeds, ("current", *rows_of(variant.options.drive)))
        )
    )

    def table(set_speed: Numeric) -> Mapping[str, Numeric]:
        values = columns(Values(parameters, Initial(), (depth, wob, set_speed)), Thresholds(), implicit=False)
        switched = NEVER if parameters.drive.kind == "ideal" else 0.0
        free = {"torque_least": -UNLIMITED, "torque_most": UNLIMITED, "on_at": switched}
        return {**values, "surface_amplitude": 0.0, "pulsation": 0.0, **free}

    string = string_of(parameters, depth)
    rest = {"z": steady_of(parameters, string, wob, 1.0).z}
    if parameters.bit.rock.regenerative:
        rest |= surface.steady(cut_of(parameters, wob, 1.0).depth, variant.options.surface)
    driven = tuple(name for name in ("drive_speed",) if name in held)
    return steady.String(variant.motion, turning, "set_speed", table, rest, driven, wall.is_used(parameters))


def cutting_at(parameters: Parameters, operation: Operation) -> cutting.Cutting:
    """The bit on the surface that its blades leave, at an operating point."""
    bit, string = parameters.bit, string_of(parameters, operation.depth)
    wob, speed = float(operation.wob), float(operation.rotary_speed)
    force = float(cut_of(parameters, wob, speed).force)
    springs, masses = [float(one) for one in string.axial_stiffnesses], [float(one) for one in string.masses[1:]]
    # a bound of all frequencies below the hoist, with a rock that is as stiff as it can be
    pairs = zip(springs, [*springs[1:], force], masses, strict=True)
    most = max(math.sqrt(2.0 * (above + below) / mass) for above, below, mass in pairs)
    threshold, greatest = surface.fed_by(partial(axial_stiffness, parameters, string), force, bit.rock.blades, most)
    return cutting.Cutting(bit.rock, "bit.rock", float(bit.radius), wob, speed, threshold, greatest)


def axial_stiffness(parameters: Parameters, string: String, frequencies: Array) -> Array:
    """The dynamic stiffness [N/m], complex, of string and hoist at the bit, at frequencies
    [rad/s], with the damping of the mud in steady flow."""
    turned, segments = 1j * frequencies, parameters.segments
    top, mud = segments.top, segments.hydraulics
    found: Array = top.stiffness + top.damping * turned
    parts = [part for part, count in string.parts for _ in range(count)]
    damping = np.zeros(len(parts) + 1)  # half of that of a segment at either end
    for k, part in enumerate(parts):
        up, down = np.abs(mud.flow / part.annulus_area), np.abs(quotient(mud.flow, part.bore_area))
        flows = part.annulus * up + part.bore * down
        damping[k : k + 2] += flows
    found = found + damping[0] * turned - string.masses[0] * frequencies**2
    for k, part in enumerate(parts, 1):
        spring = part.axial * (1.0 + segments.material_damping.axial * turned)
        found = spring * found / (spring + found) + damping[k] * turned - string.masses[k] * frequencies**2
    return found


def drilling_at(parameters: Parameters, operation: Operation) -> Drilling:
    """Steady drilling at an operating point."""
    drive, string = parameters.drive, string_of(parameters, operation.depth)
    return Drilling(
        turning_string(parameters, operation.depth, operation.wob),
        operation.rotary_speed,
        operation.wob,
        2 * float(parameters.bit.radius),
        float(torsional_frequencies(string, 1)[0]),
        float(string.torsional),
        float(drive.torque_limit) if drive.torque_limit is not None and goes_by_torque(drive.kind) else None,
        float(string.drags[0] + drive.table_damping),
    )


def torsional_frequencies(string: String, count: int) -> Array:
    """The first ``count`` torsional frequencies [rad/s] of the string below a held
    top."""
    stiffnesses, inertias = (
        np.asarray(string.torsional_stiffnesses, dtype=float),
        np.asarray(string.inertias, dtype=float),
    )
    matrix = (
        np.diag(stiffnesses + np.append(stiffnesses[1:], 0.0))
        - np.diag(stiffnesses[1:], 1)
        - np.diag(stiffnesses[1:], -1)
    )
    inverse_root = 1.0 / np.sqrt(inertias)
    return np.sqrt(np.linalg.eigvalsh(matrix * inverse_root[:, None] * inverse_root))[:count]


def axial_free(parameters: Parameters, string: String) -> float:
    """The first axial frequency [rad/s] of the string on its hoist, with the bit off
    the rock."""
    return first_frequency((parameters.segments.top.stiffness, *string.axial_stiffnesses), string.masses)


def drive_impedance(
    parameters: Parameters, string: String, drilling: Drilling
) -> tuple[Gains, Circuit | Linear | None]:
    """The law of the drive, and the circuit of an electric motor or what the states of a
    drive of a script add, that reflect a torsional wave from below
    (:func:`nsdrill.models.drive_laws.reflection`)."""
    drive = parameters.drive
    if drive.by_torque:
        law = law_of(parameters, string)
        linear = linear_drive(drive, drilling.string.states(drilling.at), lane_values(parameters))
        return (law, None) if linear is None else (about_steady(law, linear), linear)
    K_I, K_1, K_2, K_3, K_4 = gains_of(parameters, string)[0]
    constant, factor = drive.gear * drive.torque_constant, 1.0 + K_I / drive.resistance
    per_volt = constant / drive.resistance
    circuit = Circuit(
        float((constant * per_volt + per_volt * K_2) / factor),
        float(drive.inductance / drive.resistance / factor),
        float(per_volt * K_1 / factor),
        bool(K_3 or K_4),
    )
    inertia = string.drive_inertia - string.first.inertia / 2
    return Gains(float(inertia), 0.0, float(drive.table_damping)), circuit


@dataclass(frozen=True)
class Coefficients:
    """Coefficients of the string as a whole, with its lumped inertia."""

    k_a: float = computed("N/m", "axial stiffness of string and hoist")
    k_t: float = computed("N m/rad", "torsional stiffness of the string")
    J: float = computed("kg m^2", "inertia that has the first torsional frequency with it")
    c_mud: float = computed("N m s/rad", "drag of the mud on the turning string")


COEFFICIENTS = meanings_of(Coefficients)


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """The coefficients at an operating point."""
    string = string_of(parameters, operation.depth)
    first = float(torsional_frequencies(string, 1)[0])
    k_t = float(string.torsional)
    return Coefficients(float(string.axial), k_t, k_t / first**2, float(sum(string.drags)))


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point."""
    string, drive = string_of(parameters, operation.depth), parameters.drive
    drilling, pipe = drilling_at(parameters, operation), float(impedance(parameters))
    first, second = torsional_frequencies(string, 2)
    law_at_top, circuit = drive_impedance(parameters, string, drilling)
    reflected = None if drive.kind == "ideal" else reflection(law_at_top, pipe, float(first), circuit)
    quantities = {
        "axial_free": DerivedQuantity(
            axial_free(parameters, string), "rad/s", "first axial frequency, bit off the rock", "axial"
        ),
        "torsional": DerivedQuantity(float(first), "rad/s", "first torsional frequency, top held"),
        "torsional_2": DerivedQuantity(float(second), "rad/s", "second torsional frequency, top held"),
        **_waves(parameters, operation.depth),
        **drilling.quantities(fold=False),
        "pipe_impedance": DerivedQuantity(pipe, "N m s/rad", "torsional impedance of the pipe"),
    }
    if drive.kind != "ideal":
        inertia, meaning = float(law_at_top.inertia), "inertia of drive and kelly, as it is felt"
        quantities["drive_inertia"] = DerivedQuantity(inertia, "kg m^2", meaning)
    law = law_at_top if goes_by_torque(drive.kind) else None
    if parameters.bit.rock.regenerative:
        bit = cutting_at(parameters, operation)
        quantities = cutting.without_fall(quantities) | cutting.quantities(bit)
        quantities |= cutting.stability(bit, drilling.string)
    return quantities | quantities_of_drive(
        drive, drilling.matrix, drilling.torque, reflected, law, MODES, bends=drilling.bends
    )


def _waves(parameters: Parameters, depth: float) -> dict[str, DerivedQuantity]:
    """The standing waves of a string of sections, whose segments approach them."""
    drill = parameters.drillstring
    if drill.sections is None:
        return {}
    found = waves.standing(waves.torsional(parts_of(drill.sections, drill.material, depth)), 0.0, WAVES)
    return {
        f"torsional_wave_{number}": DerivedQuantity(float(value), "rad/s", f"standing torsional wave, mode {number}")
        for number, value in enumerate(found, start=1)
    }


def deciding(study: Any) -> dict[str, list[str]]:
    """The numbers that no sheet has and that act on each response."""
    bit = study.parameters.bit
    of_bit = of_surface("bit.rock") if bit.rock.regenerative else OF_FRICTION
    on_rock = () if bit.rock.regenerative else ON_ROCK if bit.surface_amplitude else ()
    found = {"stick_slip": (*of_bit, *OF_TORSION), "bit_bounce": (*(of_bit if bit.rock.regenerative else ()), *on_rock)}
    return of_study(study, found)


def warnings(study: Any, corners: list[Values], format_value: FormatValue) -> list[str | None]:
    """Warnings of a study, whose ``corners`` are the values at the ends of all axes and
    ramps; None where there is nothing to warn of."""
    found = drillings(corners, lambda corner: drilling_at(corner.parameters, corner.point))
    parameters, operation = operated(study, corners)

    def of(parameters: Parameters, operation: Operation) -> Found:
        return found_at(usual_of(parameters.bit), parameters, operation, drilling_at)

    on_surface = [one for one in corners if one.parameters.bit.rock.regenerative]
    return [
        overloaded(found, format_value),
        resting(found, format_value),
        drooping(found, format_value),
        stalling(found, format_value),
        aggressive(
            of(parameters, operation),
            [of(at.parameters, at.point) for at, _ in found],
            format_value,
            BY_CUTTING if on_surface else BY_FRICTION,
            FRICTION,
        ),
        swinging(study, found, format_value),
        interrupted(found, format_value),
        narrow(found, format_value),
        sensitive_onset(study, corners, _onsets, deciding(study).get("stick_slip", ()), format_value),
        _unloaded(corners),
        *cutting.warnings([cutting_at(one.parameters, one.point) for one in on_surface], format_value),
        _another_hole(on_surface, format_value),
        _off_bottom(corners),
        _unmoved(corners),
    ]


def stick_slip_lasts(settings: Sequence[Values]) -> list[Limits]:
    """The set speeds [rad/s] below which steady drilling is unstable, as on a flat rock: lobes kick
    the bit out of it sooner. Up to which one stick-slip lasts, once begun, is not known of several
    inertias; None where no onset is known."""
    return [below and (below[0], None) for below in limits([_stability_of(values) for values in settings])]


def _onsets(strings: Sequence[Parameters], at: Operation) -> list[float | None]:
    """The speeds [rad/s] below which steady drilling is unstable, of many strings."""
    found = limits([_stability_of(Values(one, Initial(), (at.depth, at.wob, at.rotary_speed))) for one in strings])
    return [one and one[0] for one in found]


def _stability_of(values: Values) -> Drilling | Limits:
    given = values.parameters, values.point
    if values.parameters.bit.rock.regenerative:
        return cutting.stick_slip_lasts(cutting_at(*given), drilling_at(*given).string)
    return drilling_at(*given)


def _unloaded(corners: list[Values]) -> str | None:
    """The warning of friction along a wall on which the string does not lie."""
    rubbing = [corner.parameters for corner in corners if wall.is_used(corner.parameters)]
    if not rubbing or any(wall.greatest_sine(parameters) > 0.0 for parameters in rubbing):
        return None
    return (
        "No load on the wall: the hole is vertical, so the string does not lie on it, and well.friction_along does "
        "nothing. Give well.inclination or a well.survey."
    )


def inexact_exponents(study: Any, corners: list[Values]) -> str | None:
    """The warning of exponents of a bit under steep torques, whose deviation the implicit
    steps do not follow as closely as its motion."""
    if not study.record.exponent:
        return None
    steepest = max(
        (
            0.1 * one.point.rotary_speed * one.parameters.bit.friction.smoothing
            for one in corners
            if one.parameters.bit.friction.by_torque and friction.implicit(study.simulation.method, study.model, one)
        ),
        default=0.0,
    )
    enough = friction.tolerance_of_exponent(study.simulation.rtol, steepest)
    if enough is None:
        return None
    return (
        "Exponent: where the bit breaks loose from friction as steep as bit.friction.smoothing has it, implicit steps "
        "of this tolerance make the deviation too small. lyapunov_exponent comes out too low, by some 0.02 1/s where "
        f"it is 0, and lyapunov_error does not hold that. Set simulation.rtol: {enough:.0e}."
    )


# A bit that is so much smaller or larger than the hole, as a share of it, is told of.
OTHER_HOLE = 0.01


def _another_hole(corners: list[Values], format_value: FormatValue) -> str | None:
    """The warning of blades that cut another hole than that of the study: their radius is
    that of the bit."""
    pairs = [(2.0 * float(one.parameters.bit.radius), float(one.parameters.well.diameter)) for one in corners]
    bit, hole = max(pairs, key=lambda pair: abs(pair[0] / pair[1] - 1.0), default=(1.0, 1.0))
    if abs(bit / hole - 1.0) <= OTHER_HOLE:
        return None
    radius, cut, has, fits = (format_value(length, "m", "mm") for length in (bit / 2, bit, hole, hole / 2))
    return (
        f"Bit and hole: bit.radius is {radius}, so that the blades cut a hole of {cut}, and well.diameter is {has}. "
        f"Depth of cut, torque and the load on the wear flats are those of the bit. Set bit.radius: {fits} for a bit "
        "of the size of the hole."
    )


def _off_bottom(corners: list[Values]) -> str | None:
    """A bit without weight is off the rock, where coefficients give no torque."""
    smooth = [one for one in corners if not one.parameters.bit.friction.by_torque and not wall.is_used(one.parameters)]
    if not any(one.point.wob == 0.0 for one in smooth):
        return None
    return (
        "Off bottom: without weight on bit the bit does not touch the rock, and nothing but the mud brakes the string. "
        "Give the bit's friction as torques (bit.friction: {static: 12 kN*m, dynamic: 7 kN*m}), or that along the wall "
        "(well.friction_along)."
    )


def _unmoved(corners: list[Values]) -> str | None:
    """The warning of friction along a hole in which nothing moves the string."""
    rubbing = [one for one in corners if wall.is_used(one.parameters) and one.parameters.well.axial_friction]
    if not rubbing or any(_moves(one) for one in rubbing):
        return None
    return (
        "No motion along the hole: without a rate of penetration, lobes and pulsation of the pumps nothing moves the "
        "string along the hole, and well.axial_friction does nothing. The string rubs as it turns all the same."
    )


def _moves(corner: Values) -> bool:
    """Whether anything moves the string along the hole: the advance, or the loads."""
    parameters, operation = corner.parameters, corner.point
    mud = parameters.segments.hydraulics
    pulse = mud.pulsation * (mud.annulus_factor + mud.bore_factor) * parameters.mud.density
    return bool(
        penetration_rate(parameters, operation.wob, operation.rotary_speed) > 0.0
        or (operation.wob > 0.0 and parameters.bit.surface_amplitude > 0.0)
        or pulse > 0.0
        or getattr(corner.initial, "z", None) is not None
    )


def control_begins(corners: list[Values]) -> float:
    """The latest time of a run [s] at which control of the drive begins; 0 of an ideal one."""
    drives = [one.parameters.drive for one in corners]
    return max((float(drive.on_at) for drive in drives if drive.kind != "ideal"), default=0.0)


def _string(corner: Values) -> String:
    return string_of(corner.parameters, corner.operation[0])


def drive_card(parameters: Parameters, operation: Operation) -> DriveCard:
    """The chart ``drive-card``: every kind of drive with the numbers of the study."""
    study_kind, pipe = parameters.drive.kind, float(impedance(parameters))

    def slope_and_reflection(kind: str, frequency: np.ndarray) -> tuple[float, drive_laws.Wave | None]:
        with_kind = with_values(parameters, {"drive.kind": kind})
        if kind == "dc_motor" != study_kind:
            with_kind = with_values(with_kind, {"drive.gains": None})
        string = string_of(with_kind, operation.depth)
        drilling = drilling_at(with_kind, operation)
        slope = drilling.slope_held
        if kind == "ideal" or drilling.bends:
            return slope, None
        law, circuit = drive_impedance(with_kind, string, drilling)
        return slope, reflection(law, pipe, frequency, circuit)

    lumped = torsional_frequencies(string_of(parameters, operation.depth), WAVES)
    return drive_laws.drive_card(("ideal", *LAWS, "dc_motor", "lqr"), study_kind, lumped, slope_and_reflection)
