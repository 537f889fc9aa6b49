"""Whether two files are of the same string: what is drawn over one another has to be."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

from nsdrill.data import Results, flat, resolved_study

# What changes how a motion is sought or told, and no equation. The operating point is
# compared by its values.
NO_EQUATION = (
    "title",
    "sweep",
    "simulation",
    "classify",
    "record",
    "initial",
    "continue",
    "uncertain",
    "ramps",
    "operation",
)
SAME = 1e-9  # relative


def string_differences(
    there: Mapping[str, Any], here: Mapping[str, Any], free: Collection[str] = ()
) -> list[tuple[str, Any, Any]]:
    """(key, value there, value here), in SI, of the numbers and choices of the string
    in which two resolved studies differ beyond rounding, but for the keys that are
    ``free``. A key that only one of them has is of another version, or of a part that
    the other has not, which then differs by another key."""
    there, here = dict(flat(there)), dict(flat(here))
    return [
        (key, there[key], value)
        for key, value in here.items()
        if key.partition(".")[0] not in NO_EQUATION
        and key not in free
        and key in there
        and not _same(there[key], value)
    ]


def other_string(
    branches: Mapping[str, Any],
    sweep: Results,
    fixed: Mapping[str, float],
    free: Collection[str] = (),
) -> list[tuple[str, Any, Any]]:
    """What is not the same in the file of ``branches`` with these root attributes and
    in a ``sweep``: key, value there, value here, in SI. ``fixed`` are the operating
    values of the branches by their names; what the sweep runs over and the keys that
    are ``free`` may differ."""
    swept = {*free, *(axis.key for axis in sweep.more)}
    found = string_differences(resolved_study(branches), resolved_study(sweep.attrs), swept)
    for name, value in fixed.items():
        held = sweep.coords[name].tolist() if name in sweep.coords and name not in free else []
        if len(held) == 1 and not _same(value, held[0]):
            found.append((f"operation.{name}", value, held[0]))
    return found


def _same(one: Any, other: Any) -> bool:
    numbers = all(
        isinstance(value, int | float) and not isinstance(value, bool) for value in (one, other)
    )
    return math.isclose(one, other, rel_tol=SAME) if numbers else bool(one == other)
