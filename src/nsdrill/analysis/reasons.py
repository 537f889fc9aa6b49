"""Why a side of the window lies where it does, as far as the responses in the file tell.

A motion that is there only on one way, or only at one of two neighbouring settings,
surprises: it follows from what the string met before it came to the point.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.hysteresis import carried_axis
from nsdrill.data import Answer, Array
from nsdrill.models.responses import BIT_BOUNCE, STICK_SLIP, WHIRL

if TYPE_CHECKING:
    from nsdrill.analysis.window import Cell, Classes


# The reasons, by the names that they have in data.
PASSES_IN_STICK_SLIP = "passes_in_stick_slip"
STARTS_ON_WALL = "starts_on_wall"
STAYS_ON_WALL = "stays_on_wall"
BOUNCE_LASTS = "bounce_lasts"
STICKING_LASTS = "sticking_lasts"


def reason(maps: Classes, inside: Cell, beyond: Cell) -> Answer | None:
    """Why the point ``beyond`` the window is not safe, while ``inside`` is; None where
    its response needs no explanation, or where the file does not tell. Plain data:

    - ``code``: one of the names above;
    - ``procedure``: the way on which the motion is met;
    - ``axis``, ``value``: the setting at which it begins on that way, of
      ``starts_on_wall`` the first one of the sweep.
    """
    along = carried_axis(maps.results)
    if maps.over_all or maps.confidence is not None or along not in (maps.x, maps.y):
        return None
    values = maps.values(along)
    place = beyond[2] if along == maps.x else beyond[1]
    # the neighbour at another setting of the axis along which nothing is carried
    is_beside = beyond[1] != inside[1] if along == maps.x else beyond[2] != inside[2]
    safe_on = [bool(is_safe[beyond]) for is_safe in maps.is_safe_in]
    for procedure, bits, is_safe in zip(maps.procedures, maps.bits_in, safe_on, strict=True):
        if is_safe or procedure == "same":
            continue
        there, here = (_chain(bits, cell, along == maps.x) for cell in (beyond, inside))
        first, step = (len(values) - 1, -1) if procedure == "down" else (0, 1)
        if there[place] & WHIRL:
            begin = place
            while begin != first and there[begin - step] & WHIRL:
                begin -= step
            found = {"procedure": procedure, "axis": along, "value": float(values[begin])}
            if is_beside and here[begin] & STICK_SLIP and not here[begin] & WHIRL:
                return {"code": PASSES_IN_STICK_SLIP, **found}
            if begin == place and not is_beside:
                return None  # it begins here
            if begin == first != place:
                return {"code": STARTS_ON_WALL, **found}
            if begin != place and any(safe_on):
                return {"code": STAYS_ON_WALL, **found}
        elif any(safe_on) and there[place]:
            code = BOUNCE_LASTS if there[place] & BIT_BOUNCE else STICKING_LASTS
            return {"code": code, "procedure": procedure, "axis": along, "value": None}
    return None


def _chain(bits: Array, cell: Cell, along_x: bool) -> list[int]:
    """The responses along the carried axis through a cell."""
    return [int(b) for b in np.asarray(bits[cell[:2]] if along_x else bits[cell[0], :, cell[2]])]
