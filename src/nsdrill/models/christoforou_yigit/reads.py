"""The keys of a study that a string reads, depending on its choices: the kind of its
drive, its friction law, its frozen modes."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from nsdrill.models.drives import kinds
from nsdrill.models.friction import LAWS
from nsdrill.models.leaves import Reads

# The keys of the drive that each kind reads.
_LQR = ("inertia", "shaft_damping", "on_at", "torque_limit", "state_weight", "torque_weight")
_CIRCUIT = ("inductance", "resistance", "torque_constant", "gear", "table_inertia", "motor_inertia", "gains")
DRIVE = kinds(("inertia", "shaft_damping", "on_at"), lqr=_LQR, dc_motor=("shaft_damping", *_CIRCUIT))
LAW = Reads("bit.friction.law", "the law", "the law", {word: law.keys for word, law in LAWS.items()})
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
    keys = DRIVE.unread(parameters) | LAW.unread(parameters)
    if parameters.drive.kind == "ideal":
        keys |= {"initial.lag", "initial.drive_speed"}
    for mode, keys_of_mode in FROZEN.items():
        if getattr(parameters.modes, mode) == "frozen":
            keys |= {*keys_of_mode, *OFF[mode]}
    if parameters.stabilizer.clearance is None:
        keys |= {f"stabilizer.friction.{item.name}" for item in fields(parameters.stabilizer.friction)}
    return frozenset(keys)
