"""What turns a string off bottom, which a gauge that is zeroed there does not show."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import OFF_BOTTOM, Attributes, rubs_along


def drag_off_bottom(attrs: Attributes, at: Mapping[str, Any]) -> float | None:
    """The torque off bottom per speed of the string [N m s/rad] at the depth of the values
    ``at``, of a file with these root attributes; None where the string rubs along the
    hole, or the model does not tell it."""
    known = json.loads(attrs.get(OFF_BOTTOM, "[]"))
    if not known or rubs_along(attrs):
        return None
    depths, drags = ([float(one[name]) for one in known] for name in ("depth", "drag"))
    return float(np.interp(float(at.get("depth", depths[0])), depths, drags))
