"""Whether two files describe the same string, as pictures that are drawn over one
another must."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

from nsdrill.data import Results, flat, resolved_study

# Sections that change no equation. The operating point is compared by its values.
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
RELATIVE_TOLERANCE = 1e-9


def string_differences(
    first: Mapping[str, Any], second: Mapping[str, Any], free: Collection[str] = ()
) -> list[tuple[str, Any, Any]]:
    """(key, value in the first, value in the second), in SI, of the numbers and choices
    of the string in which two resolved studies differ beyond rounding, except for the
    keys that are ``free``. A key that only one of them has belongs to another version,
    or to a part that the other does not have, which then differs in another key."""
    first, second = dict(flat(first)), dict(flat(second))
    return [
        (key, first[key], value)
        for key, value in second.items()
        if key.partition(".")[0] not in NO_EQUATION
        and key not in free
        and key in first
        and not _is_equal(first[key], value)
    ]


def other_string(
    branches: Mapping[str, Any], sweep: Results, fixed: Mapping[str, float], free: Collection[str] = ()
) -> list[tuple[str, Any, Any]]:
    """(key, value of the branches, value of the sweep), in SI, of the differences
    between a file of ``branches`` with these root attributes and a ``sweep``. ``fixed``
    are the operating values of the branches by their names; the axes of the sweep and
    the keys that are ``free`` may differ."""
    swept = {*free, *(axis.key for axis in sweep.more)}
    differences = string_differences(resolved_study(branches), resolved_study(sweep.attrs), swept)
    for name, value in fixed.items():
        held = sweep.coords[name].tolist() if name in sweep.coords and name not in free else []
        if len(held) == 1 and not _is_equal(value, held[0]):
            differences.append((f"operation.{name}", value, held[0]))
    return differences


def _is_equal(one: Any, other: Any) -> bool:
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (one, other))
    return math.isclose(one, other, rel_tol=RELATIVE_TOLERANCE) if numbers else bool(one == other)
