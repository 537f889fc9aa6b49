"""Inputs of a study that are unusual for an assembly, and what the lumped string leaves out
of them: the torque of the bit, the weight on it against that of the collars, the resonance
of its lobes, and the speed of the string."""

from __future__ import annotations

import math
from dataclasses import replace
from operator import itemgetter
from typing import Any

from nsdrill.errors import from_to
from nsdrill.models.aggressive import BY_CUTTING, BY_FRICTION, Found, aggressive, found_at, operated, usual_of
from nsdrill.models.christoforou_yigit.coefficients import added_mass_of
from nsdrill.models.christoforou_yigit.critical_speeds import Corner
from nsdrill.models.christoforou_yigit.derived_quantities import (
    collar_weight,
    lateral_stiffness,
    lift_off_wob,
    lobe_resonance,
)
from nsdrill.models.christoforou_yigit.further_quantities import (
    lateral_frequencies,
    pipe_tube,
    sinusoidal_load,
    torsional_waves,
)
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.table import drilling_at
from nsdrill.models.numbers import LUMPED, FormatValue
from nsdrill.models.operation import Operation
from nsdrill.models.tree import with_values

LYING = math.pi / 4  # inclination from which weight on bit is not that of the collars alone
RESONANCE_WIDTH = 0.2  # relative, to either side of the resonance with the lobes
FASTEST = math.pi * 180 / 30  # rad/s; above it a motor usually turns the bit, not the string


def unusual(study: Any, corners: list[Corner], format_value: FormatValue) -> list[str | None]:
    """The warnings, each None where it does not apply."""
    return [
        _over_depth(study, corners),
        lumped_above_wave(corners, format_value),
        added_mass_of_hole(study, corners, format_value),
        _aggressive(study, corners, format_value),
        _bouncing(corners, format_value),
        _heavy(corners, format_value),
        _second_mode(corners, format_value),
        _fast(corners, format_value),
    ]


LUMPED_ERROR = 0.05  # of the frequency of torsion: from there on a warning tells it


def lumped_above_wave(corners: list[Corner], format_value: FormatValue) -> str | None:
    """The lumped string swings in torsion faster than its first standing wave does, which it never
    does more slowly (Rayleigh). The compliances of all waves add up to that of the string, so that the first
    one is stiffer at the bit than the lumped spring, and slower: its impedance, by which the bit is damped at a
    ratio, is greater."""
    found = []
    for depth, corner in {one.operation.depth: one for one in _twisting(corners)}.items():
        wave, lumped = float(torsional_waves(corner.parameters, depth, 1)[0]), math.sqrt(corner.k.k_t / corner.k.J)
        found.append((lumped / wave - 1.0, lumped, wave))
    error, lumped, wave = max(found, default=(0.0, 0.0, 0.0))
    if not error > LUMPED_ERROR:
        return None
    at = (format_value(one, "rad/s", "rpm") for one in (lumped, wave))
    return (
        f"{LUMPED} the torsional frequency of the lumped string, {next(at)}, is {100 * error:.0f} % above that of its "
        f"first standing wave, {next(at)}. Periods of stick-slip are too short by that. A damping that is chosen by "
        "its ratio is too small, so that the onset of stick-slip, and the speed to which it lasts, are too high as far "
        "as that wave decides. The model segments has the waves."
    )


ADDED_MASS = "mud.added_mass"
ADDED_MASS_ERROR = 0.05  # of the lateral frequency: from there on a warning tells it


def added_mass_of_hole(study: Any, corners: list[Corner], format_value: FormatValue) -> str | None:
    """An added-mass coefficient with which the span swings faster or slower than with that of
    its clearance. It shifts all speeds of whirl, and no sheet has it."""
    if ADDED_MASS in (*study.axes, *study.drawn):
        return None
    bending = [one for one in corners if one.frees("lateral") and not isinstance(one.parameters.mud.added_mass, str)]
    errors = [(abs(_slowed(one) - 1.0), one) for one in bending if lateral_stiffness(*one.point) > 0.0]
    error, corner = max(errors, key=itemgetter(0), default=(0.0, None))
    if corner is None or not error > ADDED_MASS_ERROR:
        return None
    other = _in_hole(corner)
    frequencies = [
        format_value(math.sqrt(lateral_stiffness(*one.point) / float(one.k.m_l)), "rad/s", "rad/s")
        for one in (corner, other)
    ]
    walls = [
        "no speed" if (speed := one.critical["wall_speed"]) is None else format_value(speed, "rad/s", "rad/s")
        for one in (corner, other)
    ]
    # a collar that lies on the low side, or is hardly off its axis, reaches the wall at none
    reaches = "" if walls[0] == walls[1] else f", and the collar reaches the wall at {walls[0]} and at {walls[1]}"
    given, in_hole = (float(added_mass_of(one.parameters)) for one in (corner, other))
    return (
        f"Added mass: {ADDED_MASS} is {given:.3g}, and potential flow round a collar in the middle of this hole gives "
        f"{in_hole:.3g}, (D^2 + d^2)/(D^2 - d^2) (Fritz 1972). The lateral frequency is {frequencies[0]} with the one "
        f"and {frequencies[1]} with the other{reaches}. Viscosity and a collar off the middle add to it. Set "
        f"{ADDED_MASS}: clearance, which takes that of the hole, or a value that was measured."
    )


def _in_hole(corner: Corner) -> Corner:
    """The same with the added mass of the clearance."""
    changed = with_values(corner.parameters, {ADDED_MASS: "clearance"})
    return Corner(replace(corner.values, parameters=changed))


def _slowed(corner: Corner) -> float:
    """The lateral frequency with the added mass of the clearance, of that with the given one."""
    return math.sqrt(float(corner.k.m_l) / float(_in_hole(corner).k.m_l))


def _over_depth(study: Any, corners: list[Corner]) -> str | None:
    if "depth" not in study.axes and "depth" not in study.ramped:
        return None
    depths = {corner.operation.depth for corner in corners}
    held = any(corner.parameters.drive.ideal for corner in _twisting(corners))
    return DEPTH if held and len(depths) > 1 else None


DEPTH = (
    "Depth: drillstring.torsional_damping is one number for all depths, so with an ideal drive the onset and the fold "
    "of stick-slip do not depend on depth. In a well a longer string sticks up to higher speeds: deep points look "
    "safer than they are, or shallow ones less safe. Run depths one by one, each with a damping ratio of a few per "
    "cent."
)


def _aggressive(study: Any, corners: list[Corner], format_value: FormatValue) -> str | None:
    """Torque of the bit that is unusual of roller cones, which have lobes, or of PDC bits."""
    twisting = _twisting(corners)
    if not twisting:
        return None

    def of(parameters: Parameters, operation: Operation) -> Found:
        return found_at(usual_of(parameters.bit), parameters, operation, drilling_at)

    cuts = any(corner.parameters.bit.rock.regenerative for corner in corners)
    return aggressive(
        of(*operated(study, [corner.values for corner in corners])),
        [of(corner.parameters, corner.operation) for corner in twisting],
        format_value,
        BY_CUTTING if cuts else BY_FRICTION,
    )


LESS = 0.9  # of the weight on bit that steady contact takes: with the damping of a wave it is told


def _bouncing(corners: list[Corner], format_value: FormatValue) -> str | None:
    """Speeds at which the lobes excite the axial resonance and the weight does not keep the
    bit on the rock."""
    shaken = [
        corner
        for corner in corners
        if corner.parameters.modes.axial == "free" and corner.lobed and corner.operation.wob > 0.0
    ]
    slowest, fastest = (end((corner.speed for corner in corners), default=0.0) for end in (min, max))
    found: list[tuple[float, float, float, int, float]] = []
    for corner in shaken:
        speed = lobe_resonance(corner.parameters, corner.k)
        if not corner.parameters.drive.ideal:
            speed = drilling_at(corner.parameters, corner.operation).as_set_speed(speed)
        if not slowest <= (1 + RESONANCE_WIDTH) * speed or not (1 - RESONANCE_WIDTH) * speed <= fastest:
            continue
        nearest = replace(corner.operation, rotary_speed=min(max(speed, slowest), fastest))
        needed = lift_off_wob(corner.parameters, nearest, corner.k)
        if needed > corner.operation.wob:
            with_wave = lift_off_wob(_radiating(corner), nearest, corner.k)
            found.append((speed, needed, nearest.rotary_speed, int(corner.parameters.bit.lobes), with_wave))
    if not found:
        return None
    speeds = from_to(format_value(end(one[0] for one in found), "rad/s", "rad/s") for end in (min, max))
    _, needed, at, lobes, with_wave = max(found, key=itemgetter(1))
    of_wave = f", or {format_value(with_wave, 'N', 'kN')} with the axial damping of a wave up the pipe"
    less = of_wave if with_wave < LESS * needed else ""
    return (
        f"Bounce: the {'lobe excites' if lobes == 1 else f'{lobes} lobes excite'} the axial resonance on the rock at "
        f"{speeds} (lobe_resonance), in or near the speeds of this study. At "
        f"{format_value(at, 'rad/s', 'rad/s')} steady contact takes {format_value(needed, 'N', 'kN')} on the "
        f"bit{less}. Keep 20 % away from it."
    )


def _radiating(corner: Corner) -> Parameters:
    """The string with the axial damping of the wave that goes up the pipe."""
    damping = float(pipe_tube(corner.parameters, float(corner.operation.depth)).axial)
    return with_values(corner.parameters, {"drillstring.axial_damping": damping})


def _heavy(corners: list[Corner], format_value: FormatValue) -> str | None:
    """In a hole far from the vertical the pipe lies on the low side, and is pushed."""
    most = max(_weights(corners), key=lambda pair: pair[0] - pair[1], default=(0.0, 0.0))
    if most[0] <= most[1]:
        return None
    wob, weight = (format_value(one, "N", "kN") for one in most)
    return (
        f"Heavy: {wob} on the bit are more than the collars weigh in mud along the hole, {weight} (collar_weight): the "
        "pipe above them is in compression and may buckle, which this model leaves out. Usual are at most 80 to 90 % "
        "of it."
    )


def least_collar_weight(corners: list[Corner]) -> float | None:
    """The least weight [N] of the collars in mud of holes in which they press on the bit; None
    where there are none."""
    return min((held for _, held in _weights(corners)), default=None)


def pipe_buckles_from(corners: list[Corner]) -> float | None:
    """The least weight [N] from which the pipe above the collars buckles: what they weigh, and the load at which a
    pipe on the low side of an inclined hole becomes a sinusoid; None where there are none."""
    found = []
    for corner in corners:
        parameters, inclination = corner.parameters, float(corner.parameters.well.inclination)
        if inclination < LYING and (weight := collar_weight(parameters)) is not None:
            held = sinusoidal_load(pipe_tube(parameters, float(corner.operation.depth)), inclination)
            found.append(weight + (held if math.isfinite(held) else 0.0))
    return min(found, default=None)


def _weights(corners: list[Corner]) -> list[tuple[float, float]]:
    """The weight on bit and that of the collars in mud [N] at each corner in such a hole."""
    steep = [corner for corner in corners if corner.parameters.well.inclination < LYING]
    return [(corner.operation.wob, held) for corner in steep if (held := collar_weight(corner.parameters)) is not None]


def slowest_second_mode(corners: list[Corner]) -> float | None:
    """The least frequency [rad/s] at which a span swings in two half waves; None where none
    bends, or where its second mode is buckled."""
    found = [
        float(lateral_frequencies(one.parameters, one.operation, one.k, float(one.k.m_l))[1])
        for one in corners
        if one.frees("lateral")
    ]
    return min((one for one in found if math.isfinite(one)), default=None)


def _second_mode(corners: list[Corner], format_value: FormatValue) -> str | None:
    """Speeds at which the span swings in two half waves, which a collar of one mode never does."""
    return second_mode(slowest_second_mode(corners), max(corner.speed for corner in corners), format_value)


def second_mode(slowest: float | None, fastest: float, format_value: FormatValue) -> str | None:
    """The warning of a second mode at this speed [rad/s] at or below the fastest one of a study."""
    if slowest is None or slowest > fastest:
        return None
    return (
        f"Second mode: the span swings in two half waves at {format_value(slowest, 'rad/s', 'rad/s')}, within "
        "the speeds of this study, and here it bends in one half wave only. Near that speed the collar may reach the "
        "wall though no run does. The model beam has both with beam.modes: 2."
    )


def _fast(corners: list[Corner], format_value: FormatValue) -> str | None:
    fastest = max(corner.speed for corner in corners)
    if fastest <= FASTEST:
        return None
    return (
        f"Fast: at {format_value(fastest, 'rad/s', 'rad/s')} the whole string turns with the bit here. With a motor "
        "below it the string turns slower, and whirl begins at another speed of the bit: give the speed of the string."
    )


def _twisting(corners: list[Corner]) -> list[Corner]:
    return [corner for corner in corners if corner.parameters.modes.torsional == "free"]
