"""Numbers that no sheet of an assembly has and on which the answer depends: the critical
speeds with other plausible values of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from operator import attrgetter
from typing import Any

from nsdrill.models.christoforou_yigit.coefficients import added_mass_in_hole
from nsdrill.models.christoforou_yigit.critical_speeds import CRITICAL_SPEEDS, Corner, critical
from nsdrill.models.christoforou_yigit.further_quantities import pipe_tube
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.table import drilling_at
from nsdrill.models.christoforou_yigit.unusual import ADDED_MASS, RESONANCE_WIDTH
from nsdrill.models.deciding import deciding as of_study
from nsdrill.models.deciding import of_surface
from nsdrill.models.numbers import FormatValue
from nsdrill.models.operation import Operation
from nsdrill.models.tree import with_values
from nsdrill.records import dataclass

LEAST_SHIFT = 0.1  # of a critical speed within the sweep
LEAST_SHARE = 0.25  # of the sweep's speeds that become critical, or no longer are
AMPLITUDE, SWIRL = "bit.surface_amplitude", "mud.swirl"
DAMPING, AXIAL_DAMPING = "drillstring.torsional_damping", "drillstring.axial_damping"
CLEARANCE = "stabilizer.clearance"
SWIRLING = 0.5  # of the rotary speed: mud that rotates with the string, not with the wall (J)
WHIRL, STICKING, BOUNCE = ("wall_speed",), ("stick_slip_onset",), ("bounce_speed",)
ROCK, ALL = ("lobe_resonance", *BOUNCE), tuple(CRITICAL_SPEEDS)
POORLY_KNOWN = {  # and the critical speeds that each affects
    "drillstring.eccentricity": WHIRL,
    ADDED_MASS: WHIRL,
    "mud.drag": WHIRL,
    SWIRL: WHIRL,
    CLEARANCE: WHIRL,
    DAMPING: STICKING,
    "bit.friction.static": ALL,
    "bit.friction.dynamic": ALL,
    "bit.friction.static_torque": ALL,
    "bit.friction.dynamic_torque": ALL,
    "bit.friction.decay": ALL,
    "bit.rock_stiffness": ROCK,
    AMPLITUDE: BOUNCE,
    AXIAL_DAMPING: BOUNCE,
}


OF_RESPONSES = {"whirl": WHIRL, "stick_slip": STICKING, "bit_bounce": ROCK}  # the critical speeds of each


def deciding(study: Any) -> dict[str, list[str]]:
    """Which poorly known numbers act on each response; none on bit-bounce where nothing lifts the bit."""
    parameters = study.parameters
    bit, rock = parameters.bit, getattr(parameters.bit, "rock", None)
    modes = getattr(parameters, "modes", None)  # none of a beam, whose motions are all free
    free = {
        name: getattr(modes, mode, "free")
        for name, mode in zip(OF_RESPONSES, ("lateral", "torsional", "axial"), strict=True)
    }
    cuts = rock is not None and rock.regenerative
    has_lobes = bit.surface_amplitude != 0.0 or AMPLITUDE in (*study.axes, *study.drawn)
    # the wall that holds a collar along the hole lifts a bit without lobes
    is_lifted = cuts or has_lobes or getattr(parameters.well, "axial_friction", False)
    found: dict[str, list[str]] = {}
    for name, speeds in OF_RESPONSES.items():
        if free[name] != "free" or (name == "bit_bounce" and not is_lifted):
            continue
        own = [key for key, affected in POORLY_KNOWN.items() if set(affected) & set(speeds)]
        if name == "stick_slip" and has_lobes and not cuts:  # lobes shake the bit out of it
            own += [AMPLITUDE, AXIAL_DAMPING]
        of_bit = of_surface("bit.rock") if cuts and name != "whirl" else ()
        found[name] = [*(key for key in own if not (of_bit and key.startswith("bit."))), *of_bit]
    return of_study(study, found)


@dataclass(frozen=True)
class Effect:
    """What a number does to a critical speed [rad/s]; None where there is none, infinite where
    every speed is critical."""

    size: float
    told: str
    speed: float | None


def sensitive(study: Any, corners: list[Corner], format_value: FormatValue) -> str | None:
    """The warning of poorly known numbers with which a critical speed lies elsewhere in the sweep."""
    slowest, fastest = (end(corner.speed for corner in corners) for end in (min, max))
    columns = zip(*(corner.values.operation for corner in corners), strict=True)
    middle = Operation(*(float(sum(column)) / len(corners) for column in columns))
    parameters = corners[0].parameters
    # a bit that nothing lifts does not bounce at any speed
    is_lifted = any(corner.lobed for corner in corners)
    names = [name for name in CRITICAL_SPEEDS if is_lifted or name not in ROCK]
    before = critical(parameters, middle, names)
    unasked = (*study.axes, *study.drawn, *parameters.unread)
    keys = [key for key in POORLY_KNOWN if key in study.keys.leaves and key not in unasked]
    found: dict[str, list[Effect]] = {name: [] for name in before}
    for key in keys:
        affected = [name for name in POORLY_KNOWN[key] if name in before]
        for name, effect in _effects(key, parameters, middle, affected, before, (slowest, fastest), format_value):
            found[name].append(effect)
    told = [_told(name, before[name], effects, format_value) for name, effects in found.items() if effects]
    if DAMPING in keys and (text := _later_end(study, corners[0], middle.wob, slowest, fastest, format_value)):
        told.append(text)
    bit = parameters.bit
    if bit.lobes == 1 and not bit.surface_amplitude and AMPLITUDE in keys and parameters.modes.axial == "free":
        told.append(
            f"{AMPLITUDE} is 0 (the default with lobes 1), which is careful: a PDC bit has 0 to "
            f"{format_value(1e-4, 'm', 'mm')}, and higher lobes end stick-slip at lower speeds"
        )
    if not told:
        return None
    speeds = format_value(slowest, "rad/s", "rad/s") + (
        f" to {format_value(fastest, 'rad/s', 'rad/s')}" if fastest > slowest else ""
    )
    return (
        f"Sensitive to uncertain inputs: at {speeds} the answer depends on numbers that are rarely known well. Of the "
        f"critical speeds at {format_value(middle.wob, 'N', 'kN')}: {'; '.join(told)}. Give them distributions in "
        "the section uncertain, or run the study with both values."
    )


def _told(name: str, before: float | None, effects: list[Effect], format_value: FormatValue) -> str:
    """A critical speed and what it is with other numbers, the greatest effect first."""

    def text(speed: float | None) -> str:
        if speed is None or math.isinf(speed):
            return "no speed" if speed is None else "every speed"
        return format_value(speed, "rad/s", "rad/s")

    ordered = sorted(effects, key=attrgetter("size"), reverse=True)
    others = ", ".join(f"{text(one.speed)} with {one.told}" for one in ordered)
    return f"{CRITICAL_SPEEDS[name]} is {text(before)}, and {others}"


def _effects(
    key: str,
    parameters: Parameters,
    operation: Operation,
    names: list[str],
    before: Mapping[str, float | None],
    speeds: tuple[float, float],
    format_value: FormatValue,
) -> Iterator[tuple[str, Effect]]:
    """The greatest effect of another value of the number with this ``key`` on each of these critical
    speeds, where it decides within the ``speeds`` of the sweep."""
    found: dict[str, Effect] = {}
    for told, value in _others(key, parameters, operation, format_value).items():
        changed = with_values(parameters, {key: value})
        law = changed.bit.friction
        if law.dynamic > law.static or (law.dynamic_torque or 0.0) > (law.static_torque or 0.0):
            continue
        for name, after in critical(changed, operation, names).items():
            share = _changed_share(name, before[name], after, *speeds)
            shift = _relative(before[name], after)
            if share < LEAST_SHARE and (share == 0.0 or shift < LEAST_SHIFT):
                continue
            if name not in found or shift > found[name].size:
                found[name] = Effect(shift, told, after)
    yield from found.items()


def _others(key: str, parameters: Parameters, operation: Operation, format_value: FormatValue) -> dict[str, Any]:
    """Other plausible values of a number, with the words for each: half of it and twice it where
    nothing better is known."""
    nominal = attrgetter(key)(parameters)
    special: dict[str, Callable[[], dict[str, Any]]] = {
        ADDED_MASS: lambda: {f"{key} {float(added_mass_in_hole(parameters)):.3g} (clearance)": "clearance"},
        SWIRL: lambda: {f"{key} {value:g}": value for value in (0.0, SWIRLING)},
        CLEARANCE: lambda: _clearances(parameters),
        AXIAL_DAMPING: lambda: _radiated(key, parameters, operation, format_value),
    }
    if key in special:
        return special[key]()
    return {} if nominal is None else {f"half {key}": 0.5 * nominal, f"twice {key}": 2.0 * nominal}


def _clearances(parameters: Parameters) -> dict[str, Any]:
    """Half and twice the clearance of the stabilisers, where that is less than the gap of the collar; of hinges
    without clearance none."""
    nominal = parameters.stabilizer.clearance
    if not nominal:
        return {}
    gap = 0.5 * float(parameters.well.diameter - parameters.drillstring.collar.outer_diameter)
    others = {f"half {CLEARANCE}": 0.5 * nominal, f"twice {CLEARANCE}": 2.0 * nominal}
    return {told: value for told, value in others.items() if value < gap}


def _radiated(key: str, parameters: Parameters, operation: Operation, format_value: FormatValue) -> dict[str, Any]:
    """The damping by the wave that goes up the pipe."""
    damping = float(pipe_tube(parameters, operation.depth).axial)
    return {f"{key} {format_value(damping, 'N s/m', 'kN*s/m')} (a wave up the pipe)": damping}


def _relative(before: float | None, after: float | None) -> float:
    """The shift of a critical speed, of itself; infinite where it comes or goes."""
    if before is None or after is None or math.isinf(before) or math.isinf(after):
        return 0.0 if before == after else math.inf
    return abs(after - before) / before if before > 0.0 else math.inf if after > 0.0 else 0.0


def _later_end(
    study: Any, corner: Corner, wob: float, slowest: float, fastest: float, format_value: FormatValue
) -> str:
    """Whether with half the damping of torsion stick-slip lasts over much more of the
    sweep's speeds, at the weight ``wob``; "" where it does not. To find up to
    which speed takes longer, so that it is asked of one speed, and of this number alone."""
    parameters = corner.parameters
    if parameters.modes.torsional == "frozen":
        return ""
    at = (corner.operation.depth, wob, study.operation.rotary_speed)
    before = drilling_at(parameters, Operation(*at)).lasts_below
    if before is None or math.isnan(before):
        return ""
    there = max(before, slowest) + LEAST_SHARE * (fastest - slowest)
    less = with_values(parameters, {DAMPING: 0.5 * parameters.drillstring.torsional_damping})
    with_less = drilling_at(less, Operation(*at))
    if there > fastest or not with_less.fold_known or not with_less.may_last_at(there):
        return ""
    last, further = (format_value(one, "rad/s", "rad/s") for one in (before, there))
    return f"with half {DAMPING} stick-slip, which lasts up to {last}, lasts at {further} as well"


def _changed_share(name: str, before: float | None, after: float | None, slowest: float, fastest: float) -> float:
    """The share of the sweep's speeds that lie on the critical side of a critical
    speed, or near it, ``before`` a change or ``after`` it, but not both."""
    (a, b), (c, d) = (_critical_speeds(name, speed, slowest, fastest) for speed in (before, after))
    if fastest == slowest:
        return float((a <= slowest <= b) != (c <= slowest <= d))
    both = max(min(b, d) - max(a, c), 0.0)
    return (max(b - a, 0.0) + max(d - c, 0.0) - 2 * both) / (fastest - slowest)


def _critical_speeds(name: str, critical: float | None, slowest: float, fastest: float) -> tuple[float, float]:
    """The ends of the sweep's speeds on the critical side of a ``critical`` speed, or near
    it; the first above the second where there are none."""
    if critical is None:
        return math.inf, -math.inf
    low, high = {
        "wall_speed": (critical, math.inf),
        "bounce_speed": (critical, math.inf),
        "stick_slip_onset": (0.0, critical),
        "lobe_resonance": ((1 - RESONANCE_WIDTH) * critical, (1 + RESONANCE_WIDTH) * critical),
    }[name]
    return max(low, slowest), min(high, fastest)
