"""What turns a string off bottom, which a gauge that is zeroed there does not show."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import OFF_BOTTOM, WALL_OFF_BOTTOM, Answer, Attributes, rubs_along


def drag_off_bottom(attrs: Attributes, at: Mapping[str, Any]) -> float | None:
    """The torque off bottom per speed of the string [N m s/rad] at the depth of the values
    ``at``, of a file with these root attributes; None where the string rubs along the
    hole, or the model does not tell it."""
    known = json.loads(attrs.get(OFF_BOTTOM, "[]"))
    if not known or rubs_along(attrs):
        return None
    depths, drags = ([float(one[name]) for one in known] for name in ("depth", "drag"))
    return float(np.interp(float(at.get("depth", depths[0])), depths, drags))


def wall_off_bottom(attrs: Attributes) -> Answer | None:
    """Where the collar of a string that turns off bottom is at the wall, of a file with these root
    attributes: ``low_side``, whether it lies on the low side of the hole at every speed, ``everywhere`` or
    in a ``part`` of the study, else null; and the ``range`` of speeds [rad/s] at which the imbalance
    brings it there, ``to`` null where at all greater ones, null where at none. None where the model
    does not tell it."""
    found: Answer | None = json.loads(attrs.get(WALL_OFF_BOTTOM, "null"))
    return found
