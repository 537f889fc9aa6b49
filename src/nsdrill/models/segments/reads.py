"""Which keys of a study a string of segments reads, by the kind of its drive."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from nsdrill.models.drives import LIMITED, TUNING

_MOTOR = ("inductance", "resistance", "torque_constant", "gear", "motor_inertia", "table_inertia", "table_damping")
_WEIGHTS = ("control_weight", "lag_weight", "drive_speed_weight", "current_weight", "twist_weight", "bit_speed_weight")
# The keys of the drive that each kind reads.
READ_BY: dict[str, tuple[str, ...]] = {
    "ideal": (),
    **{
        kind: ("inertia", "on_at", *(("torque_limit",) if kind in LIMITED else ()), *keys)
        for kind, keys in TUNING.items()
        if kind != "ideal"
    },
    "dc_motor": (*_MOTOR, "gains", "on_at"),
    "lqr": (*_MOTOR, *_WEIGHTS, "on_at"),
}


def unread(parameters: Any) -> frozenset[str]:
    """The keys that a string with these :class:`.parameters.Parameters` does not
    read."""
    drive = parameters.drive
    keys = {f"drive.{item.name}" for item in fields(drive) if item.name not in ("kind", *READ_BY[drive.kind])}
    return frozenset(keys)
