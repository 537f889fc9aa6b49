"""The results of ``check`` for a study of this model: coefficients, derived quantities
and warnings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from operator import itemgetter
from typing import Any

from nsdrill.errors import from_to
from nsdrill.models import cutting
from nsdrill.models.christoforou_yigit.bouncing import Bounce, bounce
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, bit_arm, bit_load, derive, law_of_bit
from nsdrill.models.christoforou_yigit.constraints import FROZEN
from nsdrill.models.christoforou_yigit.critical_speeds import (
    Corner,
    jumped,
    lasting_motions,
    may_shake,
    passed_over,
    reached_off_bottom,
)
from nsdrill.models.christoforou_yigit.derived_quantities import (
    cutting_at,
    derived_quantities,
    driven_by_mud_above,
    lateral_stiffness,
    wall_speed,
)
from nsdrill.models.christoforou_yigit.further_quantities import (
    further_quantities,
    lies_on_low_side,
    pipe_tube,
    wall_inclination,
)
from nsdrill.models.christoforou_yigit.parameters import Collar, Parameters
from nsdrill.models.christoforou_yigit.sensitive import deciding as deciding
from nsdrill.models.christoforou_yigit.sensitive import sensitive
from nsdrill.models.christoforou_yigit.table import drilling_at, moving_string
from nsdrill.models.christoforou_yigit.unusual import (
    least_collar_weight,
    lumped_above_wave,
    pipe_buckles_from,
    slowest_second_mode,
    unusual,
)
from nsdrill.models.drilling import (
    Drilling,
    Limits,
    drillings,
    drooping,
    folds,
    interrupted,
    limits_unless_shaken,
    narrow,
    overloaded,
    resting,
    stalling,
    swinging,
)
from nsdrill.models.friction import implicit
from nsdrill.models.numbers import DerivedQuantity, FormatValue
from nsdrill.models.operation import Operation, Values
from nsdrill.models.sections import Pipe
from nsdrill.models.tree import with_values
from nsdrill.ranges import meanings_of

COEFFICIENTS = meanings_of(Coefficients)
LEAST_RADIATED = 0.5  # of the axial damping of the wave in the pipe
MAX_STEPS_PER_SECOND = 2000  # a point of 500 s then takes a million steps
BY_IMPEDANCE = ("stiff", "soft_torque", "z_torque")  # drives that are tuned to that of the pipe
LEAST_SHARPNESS = 500.0  # smoothing times dynamic_from
LEAST_OFFSET = 1e-6  # m
ONE_LIMIT = 1.01  # greatest over least eccentricity at the ends of a sweep that are reported as one


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """The coefficients at an operating point."""
    return derive(parameters, operation.depth, operation.wob, operation.rotary_speed)


def every_derived_quantity(parameters: Parameters, operation: Operation) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point, the further ones last."""
    return {**derived_quantities(parameters, operation), **further_quantities(parameters, operation)}


def warnings(study: Any, values: list[Values], format_value: FormatValue) -> list[str | None]:
    """Warnings of a study, each None where it does not apply. ``values`` are those of
    its corners."""
    corners = [Corner(each) for each in values]
    turning = drillings(values, _turning)
    lasting = lasting_motions(study, values)
    lobed = not study.parameters.bit.rock.regenerative
    # only what moves is warned of
    bending, twisting = ([one for one in corners if one.frees(mode)] for mode in ("lateral", "torsional"))
    return [
        _of_geometry(corners),
        _off_bottom(corners),
        _buckled(bending, format_value) if bending else None,
        _many_steps(study, twisting) if twisting else None,
        _peak_smoothed(twisting) if twisting else None,
        overloaded(turning, format_value),
        resting(turning, format_value),
        drooping(turning, format_value),
        stalling(turning, format_value),
        _eccentric(bending, format_value) if bending else None,
        swinging(study, turning, format_value),
        interrupted(turning, format_value) if lobed else None,
        narrow(turning, format_value) if lobed else None,
        _on_low_side(corners),
        _brought_to_wall(corners, format_value),
        _driven_by_stabilizers(bending),
        _driven_by_mud(values, format_value),
        *_of_cutting(corners, format_value),
        passed_over(study, lasting, format_value, any(one.lobed and one.frees("axial") for one in corners)),
        *jumped(lasting, format_value),
        *unusual(study, corners, format_value),
        sensitive(study, corners, format_value),
    ]


def tells_what_lasts(study: Any) -> bool:
    """Whether :func:`.critical_speeds.lasting_motions` has all that may last: not the bounce of a
    bit on the surface that its blades leave."""
    return not study.parameters.bit.rock.regenerative


def bounce_at(parameters: Parameters, operation: Operation, speed: float) -> Bounce | None:
    """The bounce over lobes that may last at a ``speed`` of the bit [rad/s]; None where there is
    none that is known."""
    if parameters.bit.rock.regenerative or parameters.modes.axial == "frozen":
        return None
    return bounce(parameters, speed, operation, coefficients(parameters, operation))


def _driven_by_mud(corners: list[Values], format_value: FormatValue) -> str | None:
    """Mud that rotates drives whirl above a speed, which runs need not show."""
    speeds = [float(driven_by_mud_above(one)) for one in corners]
    if all(one.point.rotary_speed <= speed for one, speed in zip(corners, speeds, strict=True)):
        return None
    known = [speed for speed in speeds if math.isfinite(speed)]
    speeds_text = from_to(format_value(end, "rad/s", "rad/s") for end in (min(known), max(known)))
    return (
        f"Mud: rotating with mud.swirl it drives whirl above {speeds_text} "
        "(fluid_whirl). There a collar off the axis goes to the wall by itself, the more slowly the less it is off: a "
        "run that ends before shows no whirl."
    )


def _of_geometry(corners: list[Corner]) -> str | None:
    """What still comes from pipe and collars where stiffness and inertia are given and
    these are the default ones."""
    corner = corners[0]
    string, drive = corner.parameters.drillstring, corner.parameters.drive
    default = string.collar == Collar() and string.pipe == Pipe() and string.sections is None
    if not default or (string.torsional_stiffness is None and string.rotary_inertia is None):
        return None
    uses = [f"{mode} motion" for mode in ("axial", "lateral") if corner.frees(mode)]
    uses += ["the impedance that the drive is tuned to"] if drive.kind in BY_IMPEDANCE else []
    uses += ["the stiffness"] if string.torsional_stiffness is None else []
    uses += ["the inertia"] if string.rotary_inertia is None else []
    if not uses:
        return None
    given = "torsional_stiffness and rotary_inertia" if string.measured else "torsional_stiffness"
    given = "rotary_inertia" if string.torsional_stiffness is None else given
    return (
        f"Geometry: {given} say nothing of {', '.join(uses)}, which here come from the default pipe and collars. Give "
        "drillstring.pipe and drillstring.collar, or drillstring.sections, as well."
    )


def _off_bottom(corners: list[Corner]) -> str | None:
    """A bit without weight still meets the lobes of the rock, if it may move along the
    hole."""
    touching = [one for one in corners if one.frees("axial") and one.lobed]
    if not any(corner.operation.wob == 0.0 for corner in touching):
        return None
    return (
        "Off bottom: without weight on bit the bit still touches the lobes of the rock, and with bit.friction as "
        "coefficients nothing brakes it. Off the rock set modes.axial: frozen, and give bit.friction as torques "
        "({static: 12 kN*m, dynamic: 7 kN*m})."
    )


def _of_cutting(corners: list[Corner], format_value: FormatValue) -> list[str | None]:
    """Warnings of a bit on the surface that its blades leave."""
    ones = [cutting_at(one.parameters, one.operation) for one in corners if one.parameters.bit.rock.regenerative]
    return [*cutting.warnings(ones, format_value), _undamped(corners, format_value)]


def _undamped(corners: list[Corner], format_value: FormatValue) -> str | None:
    """Less axial damping than that of the wave that goes up the pipe, with which a bit flies
    that drills slower than the axial threshold."""
    found = [
        (float(pipe_tube(one.parameters, float(one.operation.depth)).axial), one.parameters.drillstring.axial_damping)
        for one in corners
        if one.parameters.bit.rock.regenerative
        and one.speed < cutting_at(one.parameters, one.operation).threshold.speed
    ]
    radiated, least = max(found, key=lambda pair: pair[0] - pair[1], default=(0.0, 0.0))
    if least >= LEAST_RADIATED * radiated:
        return None
    has, needs = (format_value(value, "N s/m", "kN*s/m") for value in (least, radiated))
    return (
        f"Undamped: below the axial threshold (axial_threshold) the bit vibrates along the hole by itself, and "
        f"drillstring.axial_damping is {has}. A wave that goes up the pipe takes more with it, {needs}: set that, or "
        "the bit flies off the rock by far more than in a hole."
    )


def _buckled(corners: list[Corner], format_value: FormatValue) -> str | None:
    worst = min(corners, key=lambda corner: lateral_stiffness(*corner.point))
    stiffness, well = lateral_stiffness(*worst.point), worst.parameters.well
    wob, load = worst.operation.wob, float(worst.k.buckling_load)
    if stiffness >= 0:
        return None
    if well.law == "linear" and well.stiffness <= -stiffness:
        return (
            f"Unheld: at {format_value(wob, 'N', 'kN')} the lateral stiffness of the span is "
            f"{format_value(stiffness, 'N/m', 'N/m')}, and a wall of {format_value(well.stiffness, 'N/m', 'N/m')} is "
            "too soft to hold it: the collar goes on through the wall and the run fails. Shorten the span, lower the "
            "weight on bit or take a stiffer wall."
        )
    return (
        f"Buckled: at {format_value(wob, 'N', 'kN')} the lateral stiffness of the span is negative "
        f"({format_value(stiffness, 'N/m', 'N/m')}; Euler load {format_value(load, 'N', 'kN')}). "
        "The collar leans on the wall there; that is allowed, but no whirl inside the hole "
        "exists. Shorten the span or lower the weight on bit if it is not meant."
    )


def _many_steps(study: Any, corners: list[Corner]) -> str | None:
    """An explicit method takes about (slope of the friction) / 3.3 steps a second while
    the bit sticks."""

    def steps(corner: Corner) -> tuple[float, str, float]:
        if implicit(study.simulation.method, study.model, corner.values).any():
            return 0.0, "", 0.0
        if corner.parameters.bit.rock.regenerative:
            return 0.0, "", 0.0
        law, friction = law_of_bit(corner.parameters), corner.parameters.bit.friction
        load = bit_load(corner.parameters, corner.operation.wob)
        rate = bit_arm(corner.parameters, corner.k, 0.0, "slope") * load / corner.k.J
        return float(rate / 3.3), law.steep, float(getattr(friction, law.steep))

    steps_per_second, key, value = max(map(steps, corners))
    if steps_per_second <= MAX_STEPS_PER_SECOND:
        return None
    return (
        f"Slow: the friction at the bit is so steep ({key} {value:g} s/rad) that a stuck bit takes about "
        f"{steps_per_second:.3g} steps per simulated second. A smaller {key} is faster in proportion, and "
        "simulation.method: auto takes steps that do not depend on it, where it can."
    )


def _peak_smoothed(corners: list[Corner]) -> str | None:
    """The smoothing removes the peak of the linear law, whose fall is confined to
    speeds below dynamic_from."""
    lobed = [one.parameters.bit for one in corners if not one.parameters.bit.rock.regenerative]
    laws = [bit.friction for bit in lobed if bit.friction.law == "linear"]
    if not laws:
        return None
    law = min(laws, key=lambda law: law.smoothing * law.dynamic_from)
    sharpness = law.smoothing * law.dynamic_from
    if sharpness >= LEAST_SHARPNESS:
        return None
    return (
        f"Rounded: with smoothing {law.smoothing:g} s/rad and dynamic_from {law.dynamic_from:g} "
        f"rad/s their product is {sharpness:.3g}. Below {LEAST_SHARPNESS:g} the smoothing takes "
        "off the peak of the linear law, and stick-slip ends at a lower speed than it should. "
        f"Raise bit.friction.smoothing to {LEAST_SHARPNESS / law.dynamic_from:.3g} s/rad."
    )


def _eccentric(corners: list[Corner], format_value: FormatValue) -> str | None:
    pairs = ((float(corner.k.gap), corner.parameters.drillstring.eccentricity) for corner in corners)
    gap, eccentricity = min(pairs, key=lambda pair: pair[0] - pair[1])
    if eccentricity <= gap:
        return None
    return (
        f"Eccentric: the eccentricity ({format_value(eccentricity, 'm', 'mm')}) exceeds the clearance "
        f"({format_value(gap, 'm', 'mm')}): the collar is on the wall at almost any speed."
    )


def wall_off_bottom(corners: list[Values]) -> dict[str, Any]:
    """Where the collar of a string that turns off bottom is at the wall, over all corners: see
    :func:`nsdrill.analysis.off_bottom.wall_off_bottom`. That holds however the points are started."""
    points = [Corner(each) for each in corners]
    lying = [one.frees("lateral") and lies_on_low_side(*one.point) for one in points]
    found = reached_off_bottom(points)
    return {
        "low_side": "everywhere" if all(lying) else "part" if any(lying) else None,
        "range": None if found is None else {"axis": "rotary_speed", "from": found["from"], "to": found["to"]},
    }


def lumped_string(corners: list[Values], format_value: FormatValue) -> str | None:
    """That the lumped string is far from its first standing wave of torsion; None where it is not."""
    return lumped_above_wave([Corner(each) for each in corners], format_value)


def unread(parameters: Parameters) -> frozenset[str]:
    """The keys of what only frozen motions depend on."""
    return frozenset(
        key for mode, keys in FROZEN.items() if getattr(parameters.modes, mode) == "frozen" for key in keys
    )


def left_out(corners: list[Values]) -> dict[str, float | None]:
    """From where on the string does what this model leaves out: the ``collar_weight`` [N], above
    which the pipe is in compression, the weight [N] from which the ``pipe_buckles``, and the ``second_mode`` [rad/s]
    of the span."""
    points = [Corner(each) for each in corners]
    of_weight = {"collar_weight": least_collar_weight(points), "pipe_buckles": pipe_buckles_from(points)}
    return {**of_weight, "second_mode": slowest_second_mode(points)}


def _on_low_side(corners: list[Corner]) -> str | None:
    """The weight of the collar holds it on the wall of an inclined hole."""
    resting = [
        corner for corner in corners if corner.parameters.modes.lateral == "free" and lies_on_low_side(*corner.point)
    ]
    if not resting:
        return None
    least = min(wall_inclination(*corner.point) or 0.0 for corner in resting)
    has = max(float(corner.parameters.well.inclination) for corner in resting)
    part = "" if len(resting) == len(corners) else ", in a part of the study"
    return (
        f"Low side: the collar rests on the low side of the hole above {math.degrees(least):.3g} degrees of "
        f"inclination, and the hole has {math.degrees(has):.3g} degrees{part}. It lies on the wall there without whirl "
        "(whirl_kind low_side), which is not critical; what rolls along the wall or strikes it is."
    )


def _driven_by_stabilizers(bending: list[Corner]) -> str | None:
    """Friction of stabilisers in their clearance drives slipping whirl, of the radius f m_l/c_h,
    which ``wall_speed`` does not know of."""
    driven = [
        corner
        for corner in bending
        if (stabilizer := corner.parameters.stabilizer).clearance is not None
        and stabilizer.friction.dynamic * corner.k.m_l > corner.k.c_h * corner.k.gap
    ]
    if not driven:
        return None
    most = max(corner.parameters.stabilizer.friction.dynamic for corner in driven)
    held = min(corner.k.c_h * corner.k.gap / corner.k.m_l for corner in driven)
    return (
        f"Stabilisers: their friction ({most:.3g}) drives the collar round the hole and on to the wall from low "
        f"speeds on, as the mud holds it off only below {held:.2g}. wall_speed, of the imbalance alone, does not tell "
        "where it touches."
    )


def _brought_to_wall(corners: list[Corner], format_value: FormatValue) -> str | None:
    """The imbalance can hold the collar at the wall in the whole sweep, which begins
    above the speed for that."""
    slowest, fastest = (end(corner.speed for corner in corners) for end in (min, max))
    if any(corner.parameters.modes.lateral == "frozen" for corner in corners):
        return None
    speeds = [(corner.critical["wall_speed"], corner) for corner in corners]
    reached = [(speed, corner) for speed, corner in speeds if speed is not None and speed <= slowest]
    if len(reached) < len(corners):
        return None
    highest, corner = max(reached, key=itemgetter(0))
    if highest == 0.0:
        return None  # it is buckled, which has its own warning
    eccentricity = corner.parameters.drillstring.eccentricity
    ends = [
        (speed, min(_greatest_eccentricity(corner) for corner in corners if corner.speed == speed))
        for speed in sorted({slowest, fastest})
    ]
    least, greatest = (end(limit for _, limit in ends) for end in (min, max))
    if least > LEAST_OFFSET and greatest <= ONE_LIMIT * least:
        remedy = f"to stay off the wall it must be below {format_value(least, 'm', 'mm')}"
    else:
        remedy = "too small to bring it there would be " + ", ".join(
            f"at {format_value(speed, 'rad/s', 'rad/s')} "
            + (f"up to {format_value(limit, 'm', 'mm')}" if limit > LEAST_OFFSET else "none")
            for speed, limit in ends
        )
    return (
        f"Wall: from {format_value(highest, 'rad/s', 'rad/s')} on the imbalance can bring the collar to the wall, and "
        f"the whole sweep, from {format_value(slowest, 'rad/s', 'rad/s')} on, lies above that. A collar that passes "
        "through that speed reaches the wall and may stay there; one that starts centred above it need not. The "
        f"eccentricity is {format_value(eccentricity, 'm', 'mm')}; {remedy}. A shorter span helps as well."
    )


def _greatest_eccentricity(corner: Corner) -> float:
    """The greatest eccentricity [m], at most that of the study, with which the collar
    stays off the wall at this point."""
    low, high = 0.0, float(corner.parameters.drillstring.eccentricity)
    for _ in range(40):
        middle = 0.5 * (low + high)
        changed = with_values(corner.parameters, {"drillstring.eccentricity": middle})
        speed = wall_speed(*Corner(replace(corner.values, parameters=changed)).point)
        low, high = (middle, high) if speed is None or speed > corner.speed else (low, middle)
    return low


def _turning(values: Values) -> Drilling | None:
    """Steady drilling where the string may turn."""
    frozen = values.parameters.modes.torsional == "frozen"
    return None if frozen else drilling_at(values.parameters, values.point)


stick_slip_folds = partial(folds, drilling_at)


def stick_slip_lasts(settings: Sequence[Values]) -> list[Limits]:
    """The set speeds [rad/s] below which steady drilling is unstable to stick-slip, and up
    to which stick-slip, once begun, may last, of many settings together; 0 where it is not
    and does not; None with lobes that may shake the bit loose."""
    return limits_unless_shaken(settings, _limiting, may_shake)


def _limiting(values: Values) -> Drilling | Limits:
    """These speeds, or the steady drilling of which they are."""
    if values.parameters.modes.torsional == "frozen":
        return 0.0, 0.0
    if values.parameters.bit.rock.regenerative:
        string = moving_string(values.parameters, values.point)
        return cutting.stick_slip_lasts(cutting_at(values.parameters, values.point), string)
    return drilling_at(values.parameters, values.point)
