"""The critical speeds of a study, and what they mean for a sweep: a motion that begins at
one may last above it, so that it matters whether a sweep passes through them."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import astuple, replace
from functools import cached_property
from typing import Any

import numpy as np

from nsdrill.data import evenly_spaced
from nsdrill.errors import from_to
from nsdrill.models.begin import begin_below
from nsdrill.models.christoforou_yigit.bouncing import bounce_speed
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, derive
from nsdrill.models.christoforou_yigit.derived_quantities import (
    is_shaken,
    lift_off_speeds,
    lobe_resonance,
    passing_rate,
    staying_speed,
    wall_speed,
    wall_speeds,
)
from nsdrill.models.christoforou_yigit.further_quantities import lies_on_low_side
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.passing import SURE, least_sure_rate, swing_below
from nsdrill.models.christoforou_yigit.table import drilling_at
from nsdrill.models.drilling import begins_above_onset, begun_above
from nsdrill.models.numbers import FormatValue
from nsdrill.models.operation import Operation, Values
from nsdrill.records import dataclass
from nsdrill.units import to_si

CRITICAL_SPEEDS = {
    "wall_speed": "the speed at which the collar reaches the wall",
    "stick_slip_onset": "the speed below which the bit sticks and slips",
    "lobe_resonance": "the speed at which the lobes make the bit bounce",
    "bounce_speed": "the speed above which a bounce may last",
}

FINE = 0.01  # of a speed: a step that is always fine enough

# What a string may do that passes through them, what is said of that, and while what does
# not happen a point is safe from it.
LASTING_MOTIONS = {
    "wall_speed": ("stay on the wall", "A COLLAR ON THE WALL MAY STAY THERE", "nothing brings it to the wall"),
    "lobe_resonance": ("go on bouncing", "A BOUNCE MAY LAST", "nothing sets the bit bouncing"),
}


@dataclass(frozen=True)
class Corner:
    """An operating point at the ends of all axes and ramps of a study."""

    values: Values[Parameters]

    @property
    def parameters(self) -> Parameters:
        return self.values.parameters

    @cached_property
    def operation(self) -> Operation:
        return self.values.point

    @cached_property
    def k(self) -> Coefficients:
        return derive(self.parameters, *self.values.operation)

    @property
    def point(self) -> tuple[Parameters, Operation, Coefficients]:
        """What the derived quantities are functions of."""
        return self.parameters, self.operation, self.k

    def frees(self, mode: str) -> bool:
        """Whether this ``mode`` of motion is free."""
        return bool(getattr(self.parameters.modes, mode) == "free")

    @property
    def lobed(self) -> bool:
        """Whether lobes lift the bit."""
        bit = self.parameters.bit
        return not bit.rock.regenerative and float(bit.surface_amplitude) != 0.0

    @property
    def speed(self) -> float:
        return float(self.operation.rotary_speed)

    @cached_property
    def critical(self) -> dict[str, float | None]:
        """Those of the motions that may last."""
        return critical(self.parameters, self.operation, tuple(LASTING_MOTIONS))


def critical(
    parameters: Parameters, operation: Operation, names: Collection[str] = CRITICAL_SPEEDS
) -> dict[str, float | None]:
    """The critical speeds with these ``names`` of the motions that are free. A collar that lies on
    the low side is at the wall at any speed: no speed brings it there."""
    k, drilling = derive(parameters, *astuple(operation)), drilling_at(parameters, operation)

    def reaches_wall() -> float | None:
        return None if lies_on_low_side(parameters, operation, k) else wall_speed(parameters, operation, k)

    def bounces_above() -> float | None:
        speed = bounce_speed(parameters, operation, k)
        return None if speed is None else drilling.as_set_speed(speed)

    speeds: dict[str, tuple[str, Callable[[], float | None]]] = {
        "wall_speed": ("lateral", reaches_wall),
        "stick_slip_onset": ("torsional", lambda: None if drilling.onset is None else float(drilling.onset.set_speed)),
        "lobe_resonance": ("axial", lambda: drilling.as_set_speed(lobe_resonance(parameters, k))),
        "bounce_speed": ("axial", bounces_above),
    }
    return {
        name: speed()
        for name, (mode, speed) in speeds.items()
        if name in names
        and getattr(parameters.modes, mode) == "free"
        and (mode == "lateral" or not parameters.bit.rock.regenerative)
    }


def lasting_motions(study: Any, corners: list[Values]) -> list[dict[str, Any]]:
    """The critical speeds at which a motion begins that may last. A string that is
    brought up to speed passes through them; a sweep that begins above one passes over
    it. Empty for many starts, which find such motions. Each is a dict:

    ==============  =================================================================
    ``axis``        ``rotary_speed``
    ``name``        name of the derived quantity
    ``words``       its description
    ``min``,        least and greatest value [rad/s] over the corners; of one that is
    ``max``         passed over, over those where it is; None where there is none
    ``lasts``       least and greatest speed [rad/s] above which the motion may last,
                    whatever sets it going, 0 where it may at any; None where it cannot
    ``by_weight``   at each ``wob`` [N] of a sweep of several the least such ``rotary_speed``
                    [rad/s], None where it cannot; empty of one weight
    ``told``,       that in words, and the condition under which a point above is safe
    ``safe_while``
    ``from``        first speed of the sweep [rad/s], where that is above it: it is passed
                    over; else None
    ``everywhere``  whether it is passed over at all corners of that speed
    ``each``        whether every chain begins at a speed of its own, as the state is
                    carried along another axis; ``from`` is then the greatest
    ``range``       the speeds between which the motion begins, ``from`` and ``to``, and
                    the step of a sweep that is fine ``enough`` there [rad/s]; None
                    where they are not known
    ``jumped``      where steps may jump across these: the same, with the ``step``;
                    else None
    ``passing_rate``  of ``wall_speed`` the greatest rate [rad/s^2] over the corners at which
                    the speed passes that range before the collar reaches the wall;
                    else None
    ``off_bottom``  the same without weight on the bit, as the speed is raised off bottom:
                    the speeds ``from`` and ``to``, and the ``passing_rate``, None where
                    there is none; and the ``sure_rate``, from which on every one passes though
                    the bit lags behind the drive (:mod:`.passing`), None where none is
                    known; and the ``swing`` [s], by how much the bit swings below the speed at
                    which a rise ends, for each of its rate. None of a collar that does not
                    reach the wall there
    ==============  =================================================================

    The onset of stick-slip has the ``weights`` at which it is passed over as well: see
    :func:`nsdrill.models.drilling.begins_above_onset`.
    """
    if study.initial.starts:
        return []
    found = begun_by_speed(study, corners)
    if all(corner.parameters.modes.torsional == "free" for corner in corners):
        found += begins_above_onset(study, drilling_at, may_shake)
    return found


def may_shake(values: Values, speed: float) -> bool:
    """Whether lobes may shake a bit loose that sticks and slips at a set speed [rad/s]."""
    bit, modes = values.parameters.bit, values.parameters.modes
    if bit.rock.regenerative or bit.surface_amplitude == 0.0 or "frozen" in (modes.axial, modes.torsional):
        return False
    return is_shaken(values.parameters, values.point, speed)


MOST_WEIGHTS = 256  # at which it is found; it takes some 7 ms


def begun_by_speed(study: Any, corners: list[Values]) -> list[dict[str, Any]]:
    """Those of :func:`lasting_motions` that begin at a critical speed."""
    points = [Corner(each) for each in corners]
    each = study.along != "rotary_speed"
    carried = study.procedure != "same"
    start = (max if each or study.procedure == "down" else min)(point.speed for point in points)
    found: list[dict[str, Any]] = []
    for name, (_, told, safe_while) in LASTING_MOTIONS.items():
        speeds = [(speed, point.speed) for point in points if (speed := _begins(name, point))]
        by_weight = _by_weight(study, name, points)
        lasts = [speed for point in points if (speed := _lasts(name, point)) is not None]
        lasts += [float(speed) for one in by_weight if (speed := one["rotary_speed"]) is not None]
        over = [speed for speed, at in speeds if carried and speed < start == at]
        if not speeds and not lasts:
            continue
        values = over or [speed for speed, _ in speeds]
        found.append(
            {
                "axis": "rotary_speed",
                "name": name,
                "words": CRITICAL_SPEEDS[name],
                "min": min(values, default=None),
                "max": max(values, default=None),
                "lasts": [min(lasts), max(lasts)] if lasts else None,
                "by_weight": by_weight,
                "told": told,
                "safe_while": safe_while,
                "from": start if over else None,
                "everywhere": len(over) == sum(point.speed == start for point in points),
                "each": each,
                **_of_steps(study, _range_of_wall(points) if name == "wall_speed" else _range_of_bounce(points)),
                "passing_rate": _passing_rate(points) if name == "wall_speed" else None,
                "off_bottom": _passed_off_bottom(points) if name == "wall_speed" else None,
            }
        )
    return found


def _range_of_wall(points: list[Corner]) -> dict[str, float] | None:
    """The speeds between which the imbalance brings the collar to the wall, over all
    corners and up to the greatest of their speeds, and the width of the least range."""
    ranges = [found for point in points if _begins("wall_speed", point) and (found := wall_speeds(*point.point))]
    return _range_over(points, ranges)


def _range_of_bounce(points: list[Corner]) -> dict[str, float] | None:
    """The same of the speeds between which the lobes lift the bit off the rock."""
    lifted = [
        (drilling_at(point.parameters, point.operation), found)
        for point in points
        if _begins("lobe_resonance", point)
        and point.operation.wob > 0.0
        and (found := lift_off_speeds(*point.point)) is not None
    ]
    fastest = max(point.speed for point in points)
    ranges = [tuple(drilling.as_set_speed(min(end, fastest)) for end in found) for drilling, found in lifted]
    return _range_over(points, [(low, high) for low, high in ranges if low < high])


def _range_over(points: list[Corner], ranges: list[tuple[float, float]]) -> dict[str, float] | None:
    """What ranges of speeds cover over all corners, and the width of the least; None of none."""
    if not ranges:
        return None
    low, high = min(first for first, _ in ranges), max(last for _, last in ranges)
    high = min(high, max(point.speed for point in points))
    least = min(min(last, high) - first for first, last in ranges)
    return {"from": low, "to": high, "enough": max(least, FINE * low)}


def _passing_rate(points: list[Corner]) -> float | None:
    """The rate [rad/s^2] at which the speed passes the resonance with the imbalance at every
    corner before the collar reaches the wall; None where a corner has no such rate."""
    rates = [passing_rate(*point.point) for point in points if _begins("wall_speed", point)]
    return max((rate for rate in rates if rate is not None), default=None) if None not in rates else None


def reached_off_bottom(points: list[Corner]) -> dict[str, float | None] | None:
    """Where a string that turns without weight brings the collar to the wall, over all
    corners, ``from`` and ``to`` which speed; None where at none."""
    ranges = [found for one in _lifted(points) if (found := wall_speeds(*one.point))]
    if not ranges:
        return None
    low, high = min(first for first, _ in ranges), max(last for _, last in ranges)
    return {"from": low, "to": high if math.isfinite(high) else None}


def _passed_off_bottom(points: list[Corner]) -> dict[str, float | None] | None:
    """The same, and how fast the speed must pass there."""
    found = reached_off_bottom(points)
    if found is None:
        return None
    begin = _lifted(points)
    swing = max(swing_below(one.parameters, one.operation) for one in _strings(begin))
    return {**found, "passing_rate": _passing_rate(begin), "sure_rate": _sure_rate(begin), "swing": swing}


def _lifted(points: list[Corner]) -> list[Corner]:
    """The corners without weight whose collar reaches the wall."""
    lifted = [Corner(replace(one.values, operation=(one.operation.depth, 0.0, one.speed))) for one in points]
    return [one for one in lifted if _begins("wall_speed", one)]


def _strings(points: list[Corner]) -> list[Corner]:
    """One corner for each string: off bottom the other axes change nothing."""
    found: list[tuple[tuple[Parameters, float], Corner]] = []
    for one in points:
        string = one.parameters, float(one.operation.depth)
        if string not in [each for each, _ in found]:
            found.append((string, one))
    return [one for _, one in found]


def _sure_rate(points: list[Corner]) -> float | None:
    """The rate [rad/s^2] from which on the speed passes at every corner, at all faster ones too; None
    where none is known."""
    sure = 0.0
    for one in _strings(points):
        wall = wall_speeds(*one.point)
        if wall is None:
            continue
        estimate = passing_rate(*one.point)
        rate = None if estimate is None else least_sure_rate(*one.point, wall, max(estimate, sure / SURE))
        if rate is None:
            return None
        sure = rate
    return sure


def _of_steps(study: Any, wall: dict[str, float] | None) -> dict[str, dict[str, float] | None]:
    """A range of speeds, and whether the steps of a sweep up may jump over it."""
    found: dict[str, dict[str, float] | None] = {"range": wall, "jumped": None}
    if wall is not None and study.along == "rotary_speed" and study.procedure in ("up", "up-down", "all"):
        speeds = np.asarray(study.axes["rotary_speed"], float)
        steps = np.diff(speeds)[(speeds[1:] > wall["from"]) & (speeds[:-1] < wall["to"])]
        if (steps > wall["enough"] * (1 + FINE)).any():
            found["jumped"] = {**wall, "step": float(steps.max())}
    return found


def _begins(name: str, corner: Corner) -> float | None:
    """The critical speed [rad/s] of this name; None where its motion cannot occur, or is
    there from the initial state on."""
    speed = corner.critical.get(name)
    return float(speed) if speed and _is_possible(name, corner) else None


def _lasts(name: str, corner: Corner) -> float | None:
    """The speed [rad/s] above which the motion may last, 0 where it may at any; None where it
    cannot."""
    if name == "lobe_resonance":
        found = critical(corner.parameters, corner.operation, ("bounce_speed",)) if corner.lobed else {}
        return found.get("bounce_speed")
    return staying_speed(*corner.point) if corner.frees("lateral") else None


def _by_weight(study: Any, name: str, points: list[Corner]) -> list[dict[str, float | None]]:
    """At each weight of the sweep the least speed over all other ends above which a motion may
    last: a bounce lasts at a light weight where it does not at a heavy one. Of very many weights
    some are told; at the others it may last above the least speed of all."""
    weights = study.axes.get("wob", ())
    if len(weights) < 2:
        return []
    others = [one for one in points if one.operation.wob == points[0].operation.wob]
    found: list[dict[str, float | None]] = []
    for wob in map(float, evenly_spaced(weights, MOST_WEIGHTS)):
        here = [Corner(replace(one.values, operation=(one.operation.depth, wob, one.speed))) for one in others]
        speeds = [speed for one in here if (speed := _lasts(name, one)) is not None]
        found.append({"wob": wob, "rotary_speed": min(speeds, default=None)})
    return found


def _is_possible(name: str, corner: Corner) -> bool:
    if name == "lobe_resonance":
        return corner.lobed
    start: Any = corner.values.initial
    return math.hypot(float(start.x), float(start.y)) < float(corner.k.gap)


def passed_over(study: Any, lasting: list[dict[str, Any]], format_value: FormatValue, shaken: bool) -> str | None:
    """The warning of a sweep that begins above a critical speed, of those of
    :func:`lasting_motions`. A bit that is not ``shaken`` by lobes sticks at the first speed as
    the string winds up, where that is below the fold."""
    over = [one for one in lasting if one["from"] is not None]
    passed = [one for one in over if one["name"] in LASTING_MOTIONS]
    if not passed:
        return begun_above(over, format_value, shaken)
    descriptions = []
    for one in passed:
        at = from_to(format_value(one[end], "rad/s", "rad/s") for end in ("min", "max"))
        descriptions.append(f"{one['words']} ({at})")
    least = format_value(begin_below(over), "rad/s", "rad/s")
    first = format_value(passed[0]["from"], "rad/s", "rad/s")
    part = "" if all(one["everywhere"] for one in passed) else ", in a part of the study,"
    consequences = " or ".join(LASTING_MOTIONS[one["name"]][0] for one in passed)
    begins, remedy = f"the sweep begins at {first}, which lies{part}", f"Begin the sweep below {least}"
    if passed[0]["each"]:
        begins = f"the state is carried along {study.along}, each speed by itself, up to {first}, which lies{part}"
        remedy = f"Carry it along rotary_speed, from below {least}"
    if wall := next((one["range"] for one in passed if one["range"]), None):
        enough, high = (format_value(wall[name], "rad/s", "rad/s") for name in ("enough", "to"))
        remedy += f", in steps of at most {enough} up to {high}"
    return (
        f"Start: {begins} above {' and '.join(descriptions)}. A string that is brought up to speed "
        f"passes through that, and may {consequences} from there on; this sweep does not, so a "
        f"point may look safe that is not. {remedy}, even if the bit never drills there."
        f"{_of_sticking(over, passed, format_value)}"
    )


def _of_sticking(over: list[dict[str, Any]], passed: list[dict[str, Any]], format_value: FormatValue) -> str:
    """Why a sweep is to begin still lower than the speeds that are passed over."""
    found = [one for one in over if one not in passed]
    if not found or begin_below(found) >= begin_below(passed):
        return ""
    ends = from_to(format_value(found[0][end], "rad/s", "rad/s") for end in ("min", "max"))
    return f" So low as {found[0]['words']} at some of its weights ({ends}): stick-slip that begins there lasts."


# What a motion that begins in a range of speeds is, and what a string that passes through them does.
_JUMPED = {
    "wall_speed": ("the imbalance brings the collar to the wall", "stay on the wall"),
    "lobe_resonance": ("the lobes lift the bit off the rock", "go on bouncing"),
}


def jumped(lasting: list[dict[str, Any]], format_value: FormatValue) -> list[str]:
    """The warnings of steps that may jump across the speeds at which a motion begins."""
    return [_jumped(one["name"], one["jumped"], format_value) for one in lasting if one["jumped"]]


def _jumped(name: str, found: dict[str, float], format_value: FormatValue) -> str:
    step, enough = (format_value(found[end], "rad/s", "rad/s") for end in ("step", "enough"))
    low, high = _outwards(found["from"], found["to"], format_value)
    points = math.ceil((to_si(high, "rad/s") - to_si(low, "rad/s")) / found["enough"]) + 1
    begins, lasts = _JUMPED[name]
    return (
        f"Step: in steps of {step} the sweep may jump across the speeds at which {begins}, "
        f"{low} to {high} over the study, {enough} wide at the narrowest. A string that is brought up to "
        f"speed passes through all of them and may {lasts}, so a point may look safe that is not. Make "
        f"rotary_speed a list of ranges, one of them {{from: {low}, to: {high}, points: {points}}}."
    )


DIGIT = 2e-4  # of a value: more than half a unit in the last of the four digits that are shown


def _outwards(low: float, high: float, format_value: FormatValue) -> tuple[str, str]:
    """The texts of the ends of a range of speeds that a user is to take over: they are not
    rounded inwards, else steps would still jump at its ends."""
    least, most = (format_value(value, "rad/s", "rad/s") for value in (low, high))
    if to_si(least, "rad/s") > low:
        least = format_value(low * (1.0 - DIGIT), "rad/s", "rad/s")
    if to_si(most, "rad/s") < high:
        most = format_value(high * (1.0 + DIGIT), "rad/s", "rad/s")
    return least, most
