"""Which keys of a study a string reads, by its choices: the kind of its drive, its
friction law, its frozen modes."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from nsdrill.models.drives import TUNING

_ALWAYS = ("inertia", "shaft_damping", "on_at")
_OWN = (*_ALWAYS, "torque_limit")  # where the inertia is that of the machine
# The keys of the drive that each kind reads.
READ_BY: dict[str, tuple[str, ...]] = {
    "ideal": (),
    "stiff": _OWN,
    "soft_torque": (*_OWN, *TUNING["soft_torque"]),
    "equal_damping": _OWN,
    "z_torque": (*_ALWAYS, *TUNING["z_torque"]),
    "lqr": (*_OWN, "state_weight", "torque_weight"),
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
    "pi": (*_OWN, *TUNING["pi"]),
}


# The keys of the bit that each of its friction laws reads.
_SMOOTHED = ("static", "dynamic", "smoothing")
READ_BY_LAW: dict[str, tuple[str, ...]] = {
    "hyperbolic": (*_SMOOTHED, "decay"),
    "linear": (*_SMOOTHED, "dynamic_from"),
    "exponential": (*_SMOOTHED, "decay"),
    "rational": ("b0", "b1", "b2", "b3"),
}


# What only the motion of a mode depends on: its start, and numbers of the string.
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
# What acts on a mode that moves alone, and its value where it does not.
OFF: dict[str, dict[str, Any]] = {
    "axial": {"well.axial_friction": False},
    "torsional": {},
    "lateral": {
        "mud.swirl": 0.0,
        "well.inclination": 0.0,
        "well.axial_friction": False,
        "stabilizer.clearance": None,
    },
}


def unread(parameters: Any) -> frozenset[str]:
    """The keys that a string with these :class:`.parameters.Parameters` does not read,
    of its start as well."""
    kind, law = parameters.drive.kind, parameters.bit.friction.law
    drive = (
        item.name for item in fields(parameters.drive) if item.name not in ("kind", *READ_BY[kind])
    )
    friction = (
        item.name
        for item in fields(parameters.bit.friction)
        if item.name not in ("law", *READ_BY_LAW[law])
    )
    found = {*(f"drive.{name}" for name in drive), *(f"bit.friction.{name}" for name in friction)}
    if kind == "ideal":
        found |= {"initial.lag", "initial.drive_speed"}
    for mode, keys in FROZEN.items():
        if getattr(parameters.modes, mode) == "frozen":
            found |= {*keys, *OFF[mode]}
    if parameters.stabilizer.clearance is None:
        found |= {
            f"stabilizer.friction.{item.name}" for item in fields(parameters.stabilizer.friction)
        }
    return frozenset(found)
