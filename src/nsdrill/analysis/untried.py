"""Steps of a sweep that may jump across values at which the motion is another one: speeds at
which the string vibrates, and gaps of a list of values. What a run found above such a step was
not brought up through them: the way up was not tried there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nsdrill.analysis.chains import SLACK, chain_of
from nsdrill.analysis.graded import Graded
from nsdrill.analysis.grades import lasting
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.planes import Cell, along_axis, stretches
from nsdrill.analysis.sticking import sticks_past
from nsdrill.data import Answer, Array, Results, resolved_study
from nsdrill.models.choices import words_along
from nsdrill.records import dataclass
from nsdrill.variables import dimension_of

SPEED = "rotary_speed"
FINE = 0.01  # of a step: one that is fine enough
GAP = 2.5  # times the steps beside it, and those of the rest: a step of a list that leaves out values
MOTIONS = {"wall_speed": "whirl", "lobe_resonance": "bit-bounce"}


@dataclass(frozen=True)
class Jump:
    """The values ``low`` to ``high`` of an ``axis`` across which steps may jump, the width that
    a step may have to be fine ``enough``, and the greatest ``step`` there: speeds [rad/s] at
    which a ``motion`` begins somewhere in the study, or with None a gap, in which nothing
    was run."""

    axis: str
    low: float
    high: float
    enough: float
    step: float
    motion: str | None = None


def jumps_of(maps: Graded) -> tuple[Jump, ...]:
    """What the steps of a sweep may jump across: on the way up along the speed those speeds
    at which a motion begins that may last, and the gaps of every axis of the maps."""
    found = [] if maps.along != SPEED or "up" not in maps.ways else lasting(maps.results)
    begins = [
        Jump(SPEED, one["from"], one["to"], one["enough"], one["step"], MOTIONS[name])
        for name, one in ((each["name"], each.get("jumped")) for each in found)
        if one
    ]
    return (*begins, *gaps_of(maps.results))


def gaps_of(results: Results) -> list[Jump]:
    """The gaps of every axis: steps of a list of values that are far greater than those beside
    them and than the rest."""
    sweep, found = resolved_study(results.attrs).get("sweep", {}), []
    listed = {dimension_of(key) for key, given in sweep.items() if isinstance(given, list)}
    for axis in results.swept:
        if axis not in listed or words_along(axis) or len(values := _chained(results, axis)) < 3:
            continue
        steps = np.diff(values)
        beside = np.maximum(np.append(0.0, steps[:-1]), np.append(steps[1:], 0.0))
        usual = np.percentile(steps, 75, method="lower")
        found += [
            Jump(axis, float(values[at]), float(values[at + 1]), float(max(beside[at], usual)), float(steps[at]))
            for at in np.flatnonzero((steps > GAP * beside) & (steps > GAP * usual))
        ]
    return found


def first_on_the_way(maps: Graded, jumps: Sequence[Jump], cell: Cell) -> Jump | None:
    """The first step that may jump on the way up to a cell; None where none does."""
    return next((jump for jump in jumps if _passed(maps, jump)[cell]), None)


def past(maps: Graded, jumps: Sequence[Jump]) -> Array:
    """Which points, bool [third, y, x], are brought up past a step that may jump."""
    found = np.zeros(maps.grade.shape, dtype=bool)
    for jump in jumps:
        found |= _passed(maps, jump)
    return found


def without_jumps(maps: Graded, jumps: Sequence[Jump], cell: Cell) -> Array:
    """The points, bool [third, y, x], between which and a cell no step may jump."""
    found = np.ones(maps.grade.shape, dtype=bool)
    for jump in jumps:
        if (place := _axis(maps, jump)) is not None:
            side = _sides(maps, jump)
            found = found & along_axis(side == side[cell[place]], place)
    return found


def between_gaps(maps: Graded) -> list[Array]:
    """The parts of a map, each bool [y, x], between which there are gaps: all of it where
    there is none."""
    parts = [np.ones(maps.grade.shape[1:], dtype=bool)]
    for gap in gaps_of(maps.results):
        if gap.axis in (maps.y, maps.x):
            side = along_axis(_sides(maps, gap), (maps.y, maps.x).index(gap.axis), 2)
            parts = [part & (side == one) for part in parts for one in np.unique(side)]
    return parts


def stretches_run(maps: Graded, chosen: Array) -> list[tuple[int, int]]:
    """The first and last place of each stretch of ``chosen`` points along x in which no step
    may jump."""
    found, across = stretches(chosen), [jump for jump in jumps_of(maps) if jump.axis == maps.x]
    if not across:
        return found
    side, parts = np.sum([_sides(maps, jump) for jump in across], axis=0), []
    for first, last in found:
        begins = [first, *(place for place in range(first + 1, last + 1) if side[place] != side[place - 1])]
        parts += list(zip(begins, [*(place - 1 for place in begins[1:]), last], strict=True))
    return parts


def data_of_jump(jump: Jump) -> Answer:
    """It as plain data, with values under the name of their quantity."""
    return {
        "axis": jump.axis,
        "from": jump.low,
        "to": jump.high,
        "step": {jump.axis: jump.step},
        "enough": {jump.axis: jump.enough},
        "motion": jump.motion,
    }


def _passed(maps: Graded, jump: Jump) -> Array:
    """Which points, bool [third, y, x], are brought up past the steps of one jump."""
    if jump.axis != maps.along or "up" not in maps.ways:
        return np.zeros(maps.grade.shape, dtype=bool)
    place = _axis(maps, jump)
    if place is None:
        return np.full(maps.grade.shape, _below(maps, jump, np.array([maps.results.held[jump.axis]]))[0] > 0)
    return np.broadcast_to(along_axis(_sides(maps, jump) > 0, place), maps.grade.shape)


def _axis(maps: Graded, jump: Jump) -> int | None:
    """At which place of a cell its axis is; None where that is not swept."""
    axes = (maps.third, maps.y, maps.x)
    return axes.index(jump.axis) if jump.axis in axes else None


def _sides(maps: Graded, jump: Jump) -> Array:
    """How many steps that may jump lie below each value of its axis."""
    return _below(maps, jump, maps.values(jump.axis))


def _below(maps: Graded, jump: Jump, values: Array) -> Array:
    """The same of any ``values``."""
    return np.searchsorted(_wide(maps, jump)[:, 1], values + SLACK * np.abs(values), side="right")


def _wide(maps: Graded, jump: Jump) -> Array:
    """The ends of the steps that may jump, [step, 2]."""
    values = _chained(maps.results, jump.axis)
    low, high = values[:-1], values[1:]
    wide = (high > jump.low) & (low < jump.high) & (high - low > jump.enough * (1.0 + FINE))
    return np.stack([low[wide], high[wide]], axis=-1)


def _chained(results: Results, axis: str) -> Array:
    """The values of an axis; of that along which the state was carried those of the whole chain."""
    chain = chain_of(results)
    return chain.whole if chain is not None and chain.along == axis else np.asarray(results.coords[axis], dtype=float)


@dataclass(frozen=True)
class StuckPast:
    """The allowed ``points`` [third, y, x] which the way up reaches in stick-slip past the speeds ``low`` to ``high``
    [rad/s] at which the collar reaches the wall: it is not driven to it then, which hangs on where the sweep begins."""

    points: Array
    low: float
    high: float


def stuck_past(maps: Graded) -> StuckPast | None:
    """Where that is; None of samples and of many starts, where another way is known, and where there is none."""
    passing = next((one for one in lasting(maps.results) if one["name"] == "wall_speed" and one.get("range")), None)
    if passing is None or maps.x != SPEED or maps.along != SPEED or maps.share is not None:
        return None
    if "up" not in maps.ways or maps.confidence is not None:
        return None
    values, low, high = maps.values(SPEED), passing["range"]["from"], passing["range"]["to"]
    inside, above = (values >= low) & (values <= high), values > high
    if not inside.any():  # steps that jump across have a warning of their own
        return None
    from_below = (maps.grade == Grade.FROM_BELOW_ONLY) | (maps.grade == Grade.FROM_BELOW)
    found = sticks_past(maps.bits_on("up"), inside)[..., None] & above & from_below & maps.allowed
    return StuckPast(found, low, high) if found.any() else None
