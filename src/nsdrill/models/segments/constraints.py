"""What several values of a study of this model must satisfy together. Each fault names
the key that the user wrote."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from nsdrill.errors import Fault
from nsdrill.models.description import Order
from nsdrill.models.drives import LAWS, inertia_faults, kinds
from nsdrill.models.sections import WIDEST_BORE

ORDERS = (
    Order("drillstring.collar.inner_diameter", "drillstring.collar.outer_diameter", True, "lower", WIDEST_BORE),
    Order("drillstring.pipe.inner_diameter", "drillstring.pipe.outer_diameter", True, "lower", WIDEST_BORE),
    Order("segments.kelly.inner_diameter", "segments.kelly.outer_diameter", True, "lower", WIDEST_BORE),
    Order("drillstring.collar.outer_diameter", "well.diameter"),
    Order("drillstring.pipe.outer_diameter", "well.diameter"),
    Order("drillstring.collar.length", "operation.depth", words="the length of the collars"),
)
# N. The rock's damping is given under the weight on bit, so it needs a load to refer
# to.
LEAST_LOAD = 1e3


def constraints(check: Any) -> Iterator[Fault]:
    """All constraints but the :data:`ORDERS`; ``check`` is the Checker of the study."""
    yield from _load(check)
    yield from _drive(check)
    yield from _gains(check)
    yield from _torque(check)


def _load(check: Any) -> Iterator[Fault]:
    """The weight on bit is large enough to refer the rock's damping to it."""
    keys = ("operation.wob", "segments.rock_damping")
    if not check.sound(*keys) or check.ends("segments.rock_damping")[1] == 0.0:
        return
    if check.ends("operation.wob")[0] < LEAST_LOAD:
        yield check.fault(
            "sweep.wob" if check.axis("operation.wob") else "operation.wob",
            f"{check.text('operation.wob', 0)}, and segments.rock_damping is the damping under the weight on bit",
            "at least 1 kN, or segments.rock_damping: 0 N*s/m",
            ("sweep", "wob") if check.axis("operation.wob") else None,
        )


def _gains(check: Any) -> Iterator[Fault]:
    """There are five gains, and a time of switching on only with them."""
    if not check.sound("drive") or check.value("drive.kind") != "dc_motor":
        return
    gains, key = check.value("drive.gains"), "drive.on_at"
    if gains is not None and len(gains) != 5:
        yield check.fault("drive.gains", f"{len(gains)} of them", "five: K_I, K_1, K_2, K_3, K_4, or null")
    if gains is None and (check.axis(key) or check.value(key) != check.leaves[key].default):
        path = ("sweep", key) if check.axis(key) else None
        found = "a time without drive.gains, which would begin then"
        yield check.idle(check.fault(f"sweep.{key}" if path else key, found, "drive.gains, or no time", path))


def _torque(check: Any) -> Iterator[Fault]:
    """The inertia and the start time of a drive by torque are consistent."""
    if not check.sound("drive") or check.value("drive.kind") not in LAWS:
        return
    yield from inertia_faults(check)
    sweep = check.resolved["sweep"]
    if sweep.get("procedure", "same") != "same" and check.value("drive.on_at") > 0.0:
        found = f"{check.text('drive.on_at')} with a sweep that carries the state, in which the drive is on"
        yield check.fault("drive.on_at", found, "0 s, or sweep.procedure: same")


def _drive(check: Any) -> Iterator[Fault]:
    """There is no value and no axis that the kind of drive does not read."""
    if check.sound("drive"):
        yield from DRIVE.faults(check)


# Which keys of a study a string of segments reads, by the kind of its drive.


_MOTOR = ("inductance", "resistance", "torque_constant", "gear", "motor_inertia", "table_inertia", "table_damping")
_WEIGHTS = ("control_weight", "lag_weight", "drive_speed_weight", "current_weight", "twist_weight", "bit_speed_weight")
DRIVE = kinds(("inertia", "on_at"), dc_motor=(*_MOTOR, "gains", "on_at"), lqr=(*_MOTOR, *_WEIGHTS, "on_at"))
