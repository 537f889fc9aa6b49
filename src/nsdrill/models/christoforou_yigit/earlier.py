"""Studies of earlier versions, which had one law of friction and an ideal drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from nsdrill.models.christoforou_yigit.parameters import BitFriction
from nsdrill.models.leaves import without
from nsdrill.models.sections import HyperbolicFriction

_FIRST = {item.name for item in fields(HyperbolicFriction)}
_LAW = {item.name: item.default for item in fields(BitFriction) if item.name not in _FIRST}
_MOTOR = ("inductance", "resistance", "torque_constant", "gear", "table_inertia", "motor_inertia")


def completed(resolved: Mapping[str, Any]) -> dict[str, Any]:
    """A resolved study of any version with the keys of the bit's friction law."""
    bit = resolved.get("bit", {})
    if "law" in bit.get("friction", {}):
        return dict(resolved)
    return {**resolved, "bit": {**bit, "friction": {**bit["friction"], **_LAW}}}


def as_before(parts: Mapping[str, Any]) -> dict[str, Any]:
    """A study without what earlier versions did not know, where it is as it was then:
    so that it keeps its digest."""
    parts = without(parts, [], "model")
    if parts.get("bit", {}).get("friction", {}).get("law") == "hyperbolic":
        for name in _LAW:
            parts = without(parts, ["bit", "friction"], name)
    if parts.get("simulation", {}).get("method") == "auto":
        parts = without(parts, ["simulation"], "method")
    if "frozen" not in parts.get("modes", {}).values():
        parts.pop("modes", None)
    if parts.get("drive", {}).get("kind") == "ideal":
        del parts["drive"]
        parts = without(without(parts, ["initial"], "lag"), ["initial"], "drive_speed")
    for name in ("torque_limit", "on_at", "gains"):
        if parts.get("drive", {name: 0.0}).get(name) is None:
            parts = without(parts, ["drive"], name)
    if parts.get("drive", {}).get("kind") != "dc_motor":
        for name in _MOTOR:
            parts = without(parts, ["drive"], name)
    if parts.get("stabilizer", {}).get("clearance") is None and "stabilizer.clearance" not in parts["sweep"]:
        parts.pop("stabilizer", None)
    return parts
