"""The operating point, which every model of a drill string has, and the traversal of a
tree of parameter records."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

from nsdrill.ranges import Checked, parameter

LARGEST_FORCE = 1e7  # N
# The names of the operating values in a trace.
SCHEDULED = {"depth": "depth", "wob": "wob", "rotary_speed": "drive_speed"}


@dataclass(frozen=True)
class Operation(Checked):
    """The operating point."""

    depth: float = parameter(
        5000.0, "m", "P", "certain", low=1e-2, high=1e5, usual="100 to 12 300 m; laboratory rigs 1 m"
    )
    wob: float = parameter(22.24e3, "N", "P (5 klbf)", "certain", high=LARGEST_FORCE, usual="0 to 500 kN")
    rotary_speed: float = parameter(
        3.0, "rad/s", "P", "certain", low=1e-9, high=1e3, usual="20 to 300 rpm, with a motor 1000 rpm"
    )


def describe(record: Any, visit: Callable[[str, Any, Any], None], prefix: str = "") -> None:
    """Calls ``visit(dotted_name, value, metadata)`` for each leaf of a tree of
    parameter dataclasses."""
    for item in fields(record):
        value = getattr(record, item.name)
        name = f"{prefix}{item.name}"
        if is_dataclass(value):
            describe(value, visit, f"{name}.")
        else:
            visit(name, value, item.metadata)
