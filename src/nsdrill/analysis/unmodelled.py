"""Where the string does what its model leaves out, so that a run that was free there tells nothing."""

from __future__ import annotations

import json

import numpy as np

from nsdrill.analysis.planes import along_axis
from nsdrill.data import LEFT_OUT, Array, Results

SPEED = "rotary_speed"
NEAR = 0.9  # of the frequency of a mode that is left out: from there on it may answer


def first_unmodelled(results: Results) -> float | None:
    """The set speed [rad/s] above which nothing is known, as the span has a second bending mode there that the model
    leaves out; None where it leaves out none."""
    second = json.loads(results.attrs.get(LEFT_OUT, "{}")).get("second_mode")
    return None if second is None else NEAR * float(second)


def unmodelled(results: Results) -> Array:
    """Which points lie above that speed, so that it is passed on the way to them: on the grid without the
    procedures."""
    names = [name for name in results.grid if name != "procedure"]
    found = np.zeros([len(results.coords[name]) for name in names], dtype=bool)
    if (first := first_unmodelled(results)) is None or SPEED not in names:
        return found
    speeds = np.asarray(results.coords[SPEED], dtype=float)
    return np.asarray(found | along_axis(speeds > first, names.index(SPEED), len(names)))
