"""The keys of a study that a string reads, depending on its choices: the kind of its
drive, its friction law, its frozen modes."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from nsdrill.models.drives import TUNING
from nsdrill.models.friction import LAWS

_COMMON = ("inertia", "shaft_damping", "on_at")
_WITH_LIMIT = (*_COMMON, "torque_limit")  # where the drive's inertia is that of the machine
# The keys of the drive that each kind reads.
READ_BY: dict[str, tuple[str, ...]] = {
    "ideal": (),
    "stiff": _WITH_LIMIT,
    "soft_torque": (*_WITH_LIMIT, *TUNING["soft_torque"]),
    "equal_damping": _WITH_LIMIT,
    "z_torque": (*_COMMON, *TUNING["z_torque"]),
    "lqr": (*_WITH_LIMIT, "state_weight", "torque_weight"),
    "dc_motor": (
        "shaft_damping",
        "inductance",
        "resistance",
        "torque_constant",
        "gear",
        "table_inertia",
        "motor_inertia",
        "gains",
    ),
    "pi": (*_WITH_LIMIT, *TUNING["pi"]),
}


# Keys that only the motion of a mode depends on: its initial state, and parameters.
FROZEN: dict[str, tuple[str, ...]] = {
    "axial": ("initial.z", "initial.vz", "bit.surface_amplitude", "drillstring.axial_damping"),
    "torsional": ("initial.twist", "initial.bit_speed", "drillstring.torsional_damping"),
    "lateral": (
        "initial.x",
        "initial.y",
        "initial.vx",
        "initial.vy",
        "drillstring.eccentricity",
        "drillstring.collar.span",
        "well.stiffness",
        "well.friction.static",
        "well.friction.dynamic",
        "well.friction.smoothing",
        "well.friction.decay",
        "mud.density",
        "mud.added_mass",
        "mud.drag",
        "mud.swirl",
        "well.inclination",
        "stabilizer.clearance",
    ),
}
# Further effects on the motion of a mode, each with the value that switches it off.
OFF: dict[str, dict[str, Any]] = {
    "axial": {"well.axial_friction": False},
    "torsional": {},
    "lateral": {"mud.swirl": 0.0, "well.inclination": 0.0, "well.axial_friction": False, "stabilizer.clearance": None},
}


def unread(parameters: Any) -> frozenset[str]:
    """The keys that a string with these :class:`.parameters.Parameters` does not read,
    including those of its initial state."""
    kind, law = parameters.drive.kind, parameters.bit.friction.law
    drive = (item.name for item in fields(parameters.drive) if item.name not in ("kind", *READ_BY[kind]))
    friction = (item.name for item in fields(parameters.bit.friction) if item.name not in ("law", *LAWS[law].keys))
    keys = {*(f"drive.{name}" for name in drive), *(f"bit.friction.{name}" for name in friction)}
    if kind == "ideal":
        keys |= {"initial.lag", "initial.drive_speed"}
    for mode, keys_of_mode in FROZEN.items():
        if getattr(parameters.modes, mode) == "frozen":
            keys |= {*keys_of_mode, *OFF[mode]}
    if parameters.stabilizer.clearance is None:
        keys |= {f"stabilizer.friction.{item.name}" for item in fields(parameters.stabilizer.friction)}
    return frozenset(keys)
