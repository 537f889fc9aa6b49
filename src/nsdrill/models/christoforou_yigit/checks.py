"""What ``check`` finds of a study of this model: coefficients, what an engineer reads
off them, and warnings."""

from __future__ import annotations

import math
from collections.abc import Callable
from operator import attrgetter, itemgetter
from typing import Any

from nsdrill.models.christoforou_yigit.coefficients import UNITS, Coefficients, derive
from nsdrill.models.christoforou_yigit.derived_quantities import (
    derived_quantities,
    growth_at_rest,
    lateral_stiffness,
    mean_torque,
    wall_speed,
)
from nsdrill.models.christoforou_yigit.further import further_quantities
from nsdrill.models.christoforou_yigit.laws import steepest
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.drives import overloaded, swinging
from nsdrill.models.leaves import Values, with_values
from nsdrill.models.numbers import DerivedQuantity
from nsdrill.models.operation import Operation
from nsdrill.models.steepness import implicit

# a value in SI units, in those shown in SI or in field units, in words
Told = Callable[[float, str, str], str]

MEANINGS = {
    "m_c": "modal steel mass of the span",
    "m_f": "modal fluid mass, inside and added",
    "m_l": "lateral mass",
    "m_e": "eccentric mass",
    "k_bend": "bending stiffness of the span",
    "c_h": "hydrodynamic drag coefficient",
    "m_a": "axial mass",
    "k_a": "axial stiffness of the pipe",
    "J": "rotary inertia",
    "k_t": "torsional stiffness of the pipe",
    "gap": "radial clearance between collar and wall",
    "depth_of_cut": "depth of cut per revolution",
    "cutting_arm": "arm of the cutting torque",
    "buckling_load": "buckling load of the span",
}
COEFFICIENTS = {name: (UNITS[name], meaning) for name, meaning in MEANINGS.items()}
MOST_STEPS_A_SECOND = 2000  # a point of 500 s then takes a million steps
LEAST_PERIODS = 4
SHARP = 500.0  # smoothing times dynamic_from
# Numbers that a sheet of the assembly does not give, and that move critical speeds.
POORLY_KNOWN = (
    "drillstring.eccentricity",
    "mud.added_mass",
    "mud.drag",
    "bit.rock_stiffness",
    "bit.friction.static",
    "bit.friction.dynamic",
    "bit.friction.decay",
)
LEAST_OFFSET = 1e-6  # m
MUCH = 0.25  # of the sweep's speeds, by which the part that is said to be critical changes
NEAR = 0.2  # of the resonance with the lobes


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """Those at an operating point."""
    return derive(parameters, operation.depth, operation.wob, operation.rotary_speed)


def every_derived_quantity(
    parameters: Parameters, operation: Operation
) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point, those of the long list last."""
    return {
        **derived_quantities(parameters, operation),
        **further_quantities(parameters, operation),
    }


def warnings(study: Any, corners: list[Values], told: Told) -> list[str | None]:
    """Warnings of a study, with what its points have at the ends of all axes and ramps
    in ``corners``; None where there is nothing to warn of."""
    found = [
        one(study, corners, told)
        for one in (
            _buckled,
            _slow,
            _rounded,
            _overloaded,
            _eccentric,
            _unstable,
            _on_the_wall,
            _passed_over,
            _hangs,
        )
    ]
    if study.swept or not study.ramped:  # else there is no observed window
        found.append(_few_periods(study, corners, told))
    return found


def _buckled(study: Any, corners: list[Values], told: Told) -> str | None:
    least, worst, load, wall = min(
        (
            (
                float(lateral_stiffness(at.parameters, Operation(*at.operation), k)),
                at.operation[1],
                float(k.buckling_load),
                at.parameters.well,
            )
            for at in corners
            for k in [derive(at.parameters, *at.operation)]
        ),
        key=itemgetter(0),
    )
    if least >= 0:
        return None
    if wall.law == "linear" and wall.stiffness <= -least:
        return (
            f"Unheld: at {told(worst, 'N', 'kN')} the lateral stiffness of the span is "
            f"{told(least, 'N/m', 'N/m')}, and a wall of {told(wall.stiffness, 'N/m', 'N/m')} is "
            f"too "
            "soft to hold it: the collar goes on through the wall and the run fails. Shorten the "
            "span, lower the "
            "weight on bit or take a stiffer wall."
        )
    return (
        f"Buckled: at {told(worst, 'N', 'kN')} the lateral stiffness of the span is negative "
        f"({told(least, 'N/m', 'N/m')}; Euler load {told(load, 'N', 'kN')}). The collar leans on "
        f"the "
        "wall there; that is allowed, but no whirl inside the hole exists. Shorten the span or "
        "lower the weight on bit if it is not meant."
    )


def _slow(study: Any, corners: list[Values], told: Told) -> str | None:
    """An explicit method takes about (slope of the friction) / 3.3 steps a second while
    the bit sticks."""

    def steps(at: Values) -> tuple[float, str, float]:
        if implicit(study.simulation.method, study.model, at).any():
            return 0.0, "", 0.0
        k = derive(at.parameters, *at.operation)
        law = at.parameters.bit.friction
        key = "b1" if law.law == "rational" else "smoothing"
        return (
            float(steepest(at.parameters, k) * at.operation[1] / k.J / 3.3),
            key,
            float(getattr(law, key)),
        )

    rate, key, value = max(map(steps, corners))
    if rate <= MOST_STEPS_A_SECOND:
        return None
    return (
        f"Slow: the friction at the bit is so steep ({key} {value:g} s/rad) that a stuck bit "
        f"takes about "
        f"{rate:.3g} steps per simulated second. A smaller {key} is faster in proportion, and "
        "simulation.method: auto takes steps that do not depend on it, where it can."
    )


def _rounded(study: Any, corners: list[Values], told: Told) -> str | None:
    """The smoothing takes the peak off the linear law, which has all its fall below the
    speed dynamic_from."""
    laws = [law for at in corners if (law := at.parameters.bit.friction).law == "linear"]
    if not laws:
        return None
    sharpness, law = min(
        ((law.smoothing * law.dynamic_from, law) for law in laws), key=itemgetter(0)
    )
    if sharpness >= SHARP:
        return None
    return (
        f"Rounded: with smoothing {law.smoothing:g} s/rad and dynamic_from {law.dynamic_from:g} "
        f"rad/s their product is "
        f"{sharpness:.3g}. Below {SHARP:g} the smoothing takes off the peak of the linear law, "
        f"and stick-slip ends at "
        f"a lower speed than it should. Raise bit.friction.smoothing to "
        f"{SHARP / law.dynamic_from:.3g} s/rad."
    )


def _overloaded(study: Any, corners: list[Values], told: Told) -> str | None:
    """A motor at its limit does not keep the set speed."""
    limited = [at for at in corners if at.parameters.drive.torque_limit is not None]
    return overloaded(
        [
            (
                mean_torque(
                    at.parameters, Operation(*at.operation), derive(at.parameters, *at.operation)
                ),
                limit,
            )
            for at in limited
            for limit in [at.parameters.drive.torque_limit]
        ],
        told,
    )


def _eccentric(study: Any, corners: list[Values], told: Told) -> str | None:
    gap, offset = min(
        (
            (
                float(derive(at.parameters, *at.operation).gap),
                at.parameters.drillstring.eccentricity,
            )
            for at in corners
        ),
        key=lambda pair: pair[0] - pair[1],
    )
    if offset <= gap:
        return None
    return (
        f"Eccentric: the eccentricity ({told(offset, 'm', 'mm')}) exceeds the clearance "
        f"({told(gap, 'm', 'mm')}): the collar is on the wall at almost any speed."
    )


def _speeds(study: Any, corners: list[Values]) -> tuple[float, float]:
    speeds = [float(at.operation[2]) for at in corners]
    return min(speeds), max(speeds)


def _on_the_wall(study: Any, corners: list[Values], told: Told) -> str | None:
    """The imbalance can hold the collar at the wall in the whole sweep, which begins
    above the speed for that."""
    slowest, fastest = _speeds(study, corners)
    if any(at.parameters.modes.lateral == "frozen" for at in corners):
        return None
    reached = [
        (
            wall_speed(
                at.parameters, Operation(*at.operation), derive(at.parameters, *at.operation)
            ),
            at,
        )
        for at in corners
    ]
    if any(speed is None or speed > slowest for speed, _ in reached):
        return None
    highest, at = max(
        ((speed, at) for speed, at in reached if speed is not None), key=itemgetter(0)
    )
    if highest == 0.0:
        return None  # it is buckled, which is said elsewhere
    own = at.parameters.drillstring.eccentricity
    ends = [
        (speed, min(_eccentricity_at(one) for one in corners if float(one.operation[2]) == speed))
        for speed in sorted({slowest, fastest})
    ]
    free = ", ".join(
        f"at {told(speed, 'rad/s', 'rpm')} "
        + (f"up to {told(offset, 'm', 'mm')}" if offset > LEAST_OFFSET else "none")
        for speed, offset in ends
    )
    return (
        f"Wall: from {told(highest, 'rad/s', 'rpm')} on the imbalance can bring the collar to the "
        f"wall, and the whole "
        f"sweep, from {told(slowest, 'rad/s', 'rpm')} on, lies above that. A collar that passes "
        f"through that speed "
        "reaches the wall and may stay there; one that starts centred above it need not. The "
        "eccentricity is "
        f"{told(own, 'm', 'mm')}; too small to bring it there would be {free}. A shorter span "
        f"helps as well."
    )


def passed_over(study: Any, corners: list[Values]) -> list[dict[str, Any]]:
    """The critical speeds below the speed at which a sweep that carries the state along
    the speed begins: a string that is brought up to speed passes through them, and what
    it meets there may last; the sweep has not met it. Of each the ``name``, what it is
    in ``words``, its least (``min``) and greatest (``max``) value over the corners
    where it lies below, and ``from`` where the sweep begins, all along the ``axis``
    rotary_speed [rad/s]; ``everywhere`` where it lies below at all of them."""
    if study.along != "rotary_speed" or study.procedure == "same":
        return []
    start = _speeds(study, corners)[1 if study.procedure == "down" else 0]
    found: dict[str, list[float]] = {}
    first = [at for at in corners if float(at.operation[2]) == start]
    for at in first:
        critical = _critical(at.parameters, Operation(*at.operation))
        for name in LASTING:
            speed = critical.get(name)
            if speed is not None and 0.0 < speed < start and not _met_already(name, at):
                found.setdefault(name, []).append(float(speed))
    return [
        {
            "axis": "rotary_speed",
            "name": name,
            "words": CRITICAL[name],
            "min": min(speeds),
            "max": max(speeds),
            "from": start,
            "everywhere": len(speeds) == len(first),
        }
        for name, speeds in found.items()
    ]


def _met_already(name: str, at: Values) -> bool:
    """Whether the first run has what is met at a critical speed from its start on, or
    never meets it."""
    if name == "lobe_resonance":
        return float(at.parameters.bit.surface_amplitude) == 0.0
    gap = float(derive(at.parameters, *at.operation).gap)
    start: Any = at.initial
    return math.hypot(float(start.x), float(start.y)) >= gap


def _passed_over(study: Any, corners: list[Values], told: Told) -> str | None:
    found = passed_over(study, corners)
    if not found:
        return None
    each = []
    for one in found:
        low, high = (told(one[end], "rad/s", "rpm") for end in ("min", "max"))
        each.append(f"{one['words']} ({low if low == high else f'{low} to {high}'})")
    least = told(min(one["min"] for one in found), "rad/s", "rpm")
    some = "" if all(one["everywhere"] for one in found) else ", in a part of the study,"
    lasting = " or ".join(LASTING[one["name"]] for one in found)
    return (
        f"Start: the sweep begins at {told(found[0]['from'], 'rad/s', 'rpm')}, which lies{some} "
        f"above "
        f"{' and '.join(each)}. A string that is brought up to speed passes through that, and may "
        f"{lasting} from there "
        f"on; this sweep does not, so a point may look safe that is not. Begin the sweep below "
        f"{least}."
    )


def _eccentricity_at(at: Values) -> float:
    """The greatest eccentricity [m] with which the collar stays off the wall at this
    point; at most its own."""
    low, high = 0.0, float(at.parameters.drillstring.eccentricity)
    for _ in range(40):
        middle = 0.5 * (low + high)
        tried = with_values(at.parameters, {"drillstring.eccentricity": middle})
        reached = wall_speed(tried, Operation(*at.operation), derive(tried, *at.operation))
        low, high = (
            (middle, high) if reached is None or reached > float(at.operation[2]) else (low, middle)
        )
    return low


def _hangs(study: Any, corners: list[Values], told: Told) -> str | None:
    """Numbers of which half or twice the value moves a critical speed through much of
    the sweep."""
    slowest, fastest = _speeds(study, corners)
    middle = Operation(
        *(
            float(sum(column)) / len(corners)
            for column in zip(*(at.operation for at in corners), strict=True)
        )
    )
    base = corners[0].parameters
    before = _critical(base, middle)
    free = [key for key in POORLY_KNOWN if key not in study.axes and key not in study.drawn]
    said = []
    for key in free:
        value = attrgetter(key)(base)
        worst = None
        for factor in (0.5, 2.0):
            tried = with_values(base, {key: factor * value})
            law = tried.bit.friction
            if law.dynamic > law.static:
                continue
            for name, speed in _critical(tried, middle).items():
                moved = abs(
                    _part(name, speed, slowest, fastest)
                    - _part(name, before[name], slowest, fastest)
                )
                if moved >= MUCH and (worst is None or moved > worst[0]):
                    worst = moved, factor, name, speed
        if worst is not None:
            _, factor, name, speed = worst
            was, now = (
                told(one, "rad/s", "rpm") if one is not None else "no speed"
                for one in (before[name], speed)
            )
            said.append(
                f"{'half' if factor < 1 else 'twice'} {key} moves {CRITICAL[name]} from "
                f"{was} to {now}"
            )
    if not said:
        return None
    speeds = told(slowest, "rad/s", "rpm") + (
        f" to {told(fastest, 'rad/s', 'rpm')}" if fastest > slowest else ""
    )
    return (
        f"Hangs: at {speeds} the answer hangs on numbers that are rarely known well: "
        f"{'; '.join(said)}. Say what they "
        "may be in the section uncertain, or run the study with both ends."
    )


CRITICAL = {
    "wall_speed": "the speed at which the collar reaches the wall",
    "stick_slip_onset": "the speed below which the bit sticks and slips",
    "lobe_resonance": "the speed at which the lobes make the bit bounce",
}

LASTING = {"wall_speed": "stay on the wall", "lobe_resonance": "go on bouncing"}


def _critical(parameters: Parameters, operation: Operation) -> dict[str, float | None]:
    """The critical speeds of the motions that are free."""
    modes = parameters.modes
    free = {
        "wall_speed": modes.lateral,
        "stick_slip_onset": modes.torsional,
        "lobe_resonance": modes.axial,
    }
    found = derived_quantities(parameters, operation, averaged=False)
    return {name: found[name].value for name, mode in free.items() if mode == "free"}


def _part(name: str, critical: float | None, slowest: float, fastest: float) -> float:
    """The part of the sweep's speeds on the critical side of a ``critical`` speed, or
    near it."""
    low, high = {
        "wall_speed": (critical, math.inf),
        "stick_slip_onset": (0.0, critical),
        "lobe_resonance": (
            None if critical is None else (1 - NEAR) * critical,
            None if critical is None else (1 + NEAR) * critical,
        ),
    }[name]
    if low is None or high is None:
        return 0.0
    if fastest == slowest:
        return float(low <= slowest <= high)
    return max(min(high, fastest) - max(low, slowest), 0.0) / (fastest - slowest)


def _unstable(study: Any, corners: list[Values], told: Told) -> str | None:
    """A drive that swings the string by itself, as gains of the wrong sign make it."""
    driven = [
        at
        for at in corners
        if not at.parameters.drive.ideal and at.parameters.modes.torsional == "free"
    ]
    found = [
        (root, at.operation[0], at.parameters.drive.kind)
        for at in driven
        if (root := growth_at_rest(at.parameters, derive(at.parameters, *at.operation))) is not None
    ]
    return swinging(found, "depth" in study.swept, told)


def _few_periods(study: Any, corners: list[Values], told: Told) -> str | None:
    coefficients = [derive(at.parameters, *at.operation) for at in corners]
    period = max(2 * math.pi * math.sqrt(float(k.J) / float(k.k_t)) for k in coefficients)
    if study.simulation.observe >= LEAST_PERIODS * period:
        return None
    return (
        f"Short: the torsional period at the greatest depth is {period:.3g} s; the observed "
        f"window of "
        f"{study.simulation.observe:g} s holds fewer than {LEAST_PERIODS}. Lengthen "
        f"simulation.observe."
    )
