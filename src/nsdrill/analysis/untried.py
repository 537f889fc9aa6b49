"""Steps of a sweep that may jump across speeds at which the string vibrates. What a run found
above such a step was not brought up through them: the way up was not tried there."""

from __future__ import annotations

import numpy as np

from nsdrill.analysis.chains import SLACK, chain_of
from nsdrill.analysis.graded import Graded
from nsdrill.analysis.grades import lasting
from nsdrill.analysis.planes import Cell, along_axis, stretches
from nsdrill.data import Answer, Array
from nsdrill.records import dataclass

SPEED = "rotary_speed"
FINE = 0.01  # of a step: one that is fine enough


@dataclass(frozen=True)
class Jump:
    """The speeds ``low`` to ``high`` at which the collar reaches the wall somewhere in the
    study, the width that a step may have to be fine ``enough``, and the greatest ``step``
    there [rad/s]."""

    low: float
    high: float
    enough: float
    step: float


def jump_of(maps: Graded) -> Jump | None:
    """What the steps of a sweep up may jump across; None where they are fine enough, or
    where nothing was brought up along the speed."""
    found = next((one["jumped"] for one in lasting(maps.results) if one.get("jumped")), None)
    if found is None or maps.along != SPEED or "up" not in maps.ways:
        return None
    return Jump(found["from"], found["to"], found["enough"], found["step"])


def is_beyond(maps: Graded, jump: Jump | None, cell: Cell) -> bool:
    """Whether a step that may jump lies on the way up to a cell."""
    if jump is None:
        return False
    place = _axis(maps)
    value = maps.results.held[SPEED] if place is None else float(maps.values(SPEED)[cell[place]])
    return bool(np.any(_wide(maps, jump)[:, 1] <= value * (1.0 + SLACK)))


def without_jumps(maps: Graded, jump: Jump | None, cell: Cell) -> Array:
    """The points, bool [third, y, x], between which and a cell no step may jump."""
    found, place = np.ones(maps.grade.shape, dtype=bool), _axis(maps)
    if jump is None or place is None:
        return found
    side = _sides(maps, jump)
    near = side == side[cell[place]]
    return found & along_axis(near, place)


def stretches_run(maps: Graded, chosen: Array) -> list[tuple[int, int]]:
    """The first and last place of each stretch of ``chosen`` points along x in which no step
    may jump."""
    found, jump = stretches(chosen), jump_of(maps)
    if jump is None or maps.x != SPEED:
        return found
    side, parts = _sides(maps, jump), []
    for first, last in found:
        begins = [first, *(place for place in range(first + 1, last + 1) if side[place] != side[place - 1])]
        parts += list(zip(begins, [*(place - 1 for place in begins[1:]), last], strict=True))
    return parts


def data_of_jump(jump: Jump) -> Answer:
    """It as plain data, with values under the name of their quantity."""
    return {
        "axis": SPEED,
        "from": jump.low,
        "to": jump.high,
        "step": {SPEED: jump.step},
        "enough": {SPEED: jump.enough},
    }


def _axis(maps: Graded) -> int | None:
    """At which place of a cell the speed is; None where it is not swept."""
    axes = (maps.third, maps.y, maps.x)
    return axes.index(SPEED) if SPEED in axes else None


def _sides(maps: Graded, jump: Jump) -> Array:
    """How many steps that may jump lie below each value of the speed."""
    return np.searchsorted(_wide(maps, jump)[:, 1], maps.values(SPEED) * (1.0 + SLACK), side="right")


def _wide(maps: Graded, jump: Jump) -> Array:
    """The ends of the steps of the whole chain that may jump, [step, 2]."""
    chain = chain_of(maps.results)
    values = maps.values(SPEED) if chain is None else chain.whole
    low, high = values[:-1], values[1:]
    wide = (high > jump.low) & (low < jump.high) & (high - low > jump.enough * (1.0 + FINE))
    return np.stack([low[wide], high[wide]], axis=-1)
