"""What the keys of the drive of a string must satisfy together, for every model whose top is
one rotary inertia (:mod:`nsdrill.models.top`): which keys each kind reads, and the rules of
several. Each fault names the key that the user wrote."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from nsdrill.errors import Fault
from nsdrill.models.drive_laws import COMPENSATED, kinds
from nsdrill.models.own_drives import lane_of, own_drive
from nsdrill.models.rules import Rule

# The keys of the drive that each kind reads.
_LQR = ("inertia", "shaft_damping", "torque_limit", "state_weight", "torque_weight")
_CIRCUIT = ("inductance", "resistance", "torque_constant", "gear", "table_inertia", "motor_inertia", "gains")
DRIVE = replace(
    kinds(("inertia", "shaft_damping"), lqr=_LQR, dc_motor=("shaft_damping", *_CIRCUIT)),
    elsewhere={"ideal": ("initial.lag", "initial.drive_speed")},
)


def _gains(check: Any) -> Iterator[Fault]:
    gains = check.value("drive.gains")
    if check.value(DRIVE.choice) == "dc_motor" and gains is not None and len(gains) != 5:
        yield check.fault("drive.gains", f"{len(gains)} of them", "five: K_I, K_1, K_2, K_3, K_4, or null")


def _returns(check: Any) -> Iterator[Fault]:
    """No returns to a section with a drive that holds no angle."""
    key, kind, gains, why, allowed = "record.poincare", check.value(DRIVE.choice), check.value("drive.gains"), "", "0"
    if check.value(key) == 0:
        return
    if kind == "dc_motor" and (gains is None or (len(gains) == 5 and gains[1] + gains[3] == 0.0)):  # on lag and twist
        why = "a DC motor, which falls behind its set point:"
    elif kind == "pi" and check.sound("drive.stiffness") and check.ends("drive.stiffness")[0] == 0.0:
        why, allowed = "drive.stiffness 0: the drive falls behind its set point, and", "0, or a drive.stiffness above 0"
    elif (own := own_drive(kind)) is not None and check.sound(*own.keys):
        numbers = {lane_of(name): check.ends(f"drive.{name}")[0] for name in own.numbers}
        why = "" if own.linear({}, numbers).holds else f"the drive {kind}, which holds no angle:"
    if why:
        yield check.fault(key, f"{check.text(key)} with {why} no return repeats", allowed)


def _numbers(check: Any) -> Iterator[Fault]:
    """Torque and slopes of a drive of a script, and how they change, are numbers, at the ends of
    each number of its own."""
    own = own_drive(check.value(DRIVE.choice))
    if own is None or not check.sound(*own.keys):
        return
    usual = {name: check.ends(f"drive.{name}")[0] for name in own.numbers}
    others = [usual | {name: value} for name in own.numbers for value in check.ends(f"drive.{name}")]
    for values in (usual, *others):
        if what := own.no_number({lane_of(name): value for name, value in values.items()}):
            key = next((f"drive.{name}" for name, value in values.items() if value == 0.0), DRIVE.choice)
            found = f"{check.text(key)}, with which {what}, or how it changes, is no number at the set point"
            yield check.fault(key, found, "one that divides by nothing that is 0 there")
            return


def _limit(check: Any) -> Iterator[Fault]:
    limit = "drive.torque_limit"
    if "torque_limit" in DRIVE.keys[check.value(DRIVE.choice)] and check.axis(limit) and check.value(limit) is None:
        found = "an axis over the limit without a limit beside it"
        yield check.fault(f"sweep.{limit}", found, f"it with {limit}, any value")


DRIVE_RULES = (
    DRIVE,
    Rule(_gains, DRIVE.needs),
    Rule(_returns, ("record", *DRIVE.needs)),
    Rule(_limit, DRIVE.needs),
    Rule(_numbers, DRIVE.needs),
    COMPENSATED,
)
