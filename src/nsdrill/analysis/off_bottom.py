"""What turns a string off bottom, which a gauge that is zeroed there does not show, and its torsional period,
by depth."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import STRING_BY_DEPTH, WALL_OFF_BOTTOM, Answer, Attributes, rubs_along


def drag_off_bottom(attrs: Attributes, at: Mapping[str, Any]) -> float | None:
    """The torque off bottom per speed of the string [N m s/rad] at the depth of the values
    ``at``, of a file with these root attributes; None where the string rubs along the
    hole, or the model does not tell it."""
    return None if rubs_along(attrs) else _at_depth(attrs, at, "drag")


def torsional_period(attrs: Attributes, at: Mapping[str, Any]) -> float | None:
    """The period [s] of the first torsional mode of the string at the depth of the values ``at``: stick-slip
    has this one or a longer one. None where the model does not tell it."""
    return _at_depth(attrs, at, "period")


def _at_depth(attrs: Attributes, at: Mapping[str, Any], name: str) -> float | None:
    known = json.loads(attrs.get(STRING_BY_DEPTH, "[]"))
    if not known:
        return None
    depths, values = ([float(one[key]) for one in known] for key in ("depth", name))
    return float(np.interp(float(at.get("depth", depths[0])), depths, values))


def wall_off_bottom(attrs: Attributes) -> Answer | None:
    """Where the collar of a string that turns off bottom is at the wall, of a file with these root
    attributes: ``low_side``, whether it lies on the low side of the hole at every speed, ``everywhere`` or
    in a ``part`` of the study, else null; and the ``range`` of speeds [rad/s] at which the imbalance
    brings it there, ``to`` null where at all greater ones, null where at none. None where the model
    does not tell it."""
    found: Answer | None = json.loads(attrs.get(WALL_OFF_BOTTOM, "null"))
    return found
