"""Which keys of a study a string reads, by its choices (its friction law, its frozen
modes), and the rules that several values keep together; those of its drive are in
:mod:`nsdrill.models.drive_rules`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from nsdrill.errors import Fault
from nsdrill.models.blades import of_the_rock, of_wear_flats
from nsdrill.models.drive_rules import DRIVE_RULES
from nsdrill.models.friction import LAWS, law_named, ordered_at, reads_at
from nsdrill.models.operation import LARGEST_FORCE
from nsdrill.models.rules import Order, Rule
from nsdrill.models.sections import WIDEST_BORE, Cutting, deepest
from nsdrill.models.whole_string import (
    MEASURED,
    STATIC,
    TORQUE_ORDER,
    WHOLE_STRING,
    collar_of_sections,
    has_sections,
    is_measured,
    without_length,
)
from nsdrill.units import format_quantity

LAW = reads_at("bit.friction", torques=True)
SLIDING = reads_at("well.friction"), reads_at("stabilizer.friction")
# The keys in place of which a bit that cuts its own surface has those of the rock.
LOBED = (
    "bit.lobes",
    "bit.surface_amplitude",
    "bit.rock_stiffness",
    *(f"bit.cutting.{item.name}" for item in fields(Cutting)),
    *dict.fromkeys(f"bit.friction.{key}" for law in LAWS.values() for key in ("law", *law.keys)),
)
# Keys that only the motion of a mode depends on: its initial state, and parameters.
FROZEN: dict[str, tuple[str, ...]] = {
    "axial": ("initial.z", "initial.vz", "bit.surface_amplitude", "drillstring.axial_damping"),
    "torsional": ("initial.twist", "initial.bit_speed", "drillstring.torsional_damping", *MEASURED),
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
        "well.friction.law",
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


ORDERS = (
    Order("drillstring.collar.inner_diameter", "drillstring.collar.outer_diameter", True, "lower", WIDEST_BORE),
    Order("drillstring.collar.span", "drillstring.collar.length", True, "lower", unless=has_sections),
    Order("drillstring.pipe.inner_diameter", "drillstring.pipe.outer_diameter", True, "lower", WIDEST_BORE),
    Order("drillstring.collar.outer_diameter", "well.diameter", unless=collar_of_sections),
    *map(ordered_at, ("well.friction", "stabilizer.friction", "bit.friction")),
    TORQUE_ORDER,
    Order("drillstring.collar.length", "operation.depth", words="the length of the collars", unless=without_length),
)


HOLE, COLLAR = "well.diameter", "drillstring.collar.outer_diameter"
PLACED = ("initial.x", "initial.y", HOLE, COLLAR, "well.stiffness", "well.law")


def _initial(check: Any) -> Iterator[Fault]:
    """The collar starts inside the hole or on its wall, which it penetrates no deeper
    than by the greatest force."""
    gap = (check.ends(HOLE)[0] - check.ends(COLLAR)[1]) / 2
    plane = check.value("initial.slice")
    farthest = {
        name: max(abs(plane[name]["from"]), abs(plane[name]["to"]))
        if name in plane
        else max(map(abs, check.ends(f"initial.{name}")))
        for name in ("x", "y")
    }
    radius = math.hypot(farthest["x"], farthest["y"])
    largest_radius = gap + deepest(check.ends("well.stiffness")[1], check.value("well.law"))
    if gap <= 0.0 or radius <= largest_radius:
        return
    allowed = (
        f"at most {format_quantity(largest_radius, 'mm')}: the gap between collar and wall, "
        f"{format_quantity(gap, 'mm')}, and as deep into the wall as {format_quantity(LARGEST_FORCE, 'MN')} press"
    )
    if not plane.keys().isdisjoint(farthest):
        yield check.fault("initial.slice", f"starts as far as {format_quantity(radius, 'mm')} off the axis", allowed)
    else:
        key = next((key for key in PLACED if check.given(key)), PLACED[0])
        key = next((key for key in PLACED if check.axis(key)), key)
        low, high = check.ends(key) if check.axis(key) else (0.0, 0.0)
        text = check.text(key, int(key != HOLE and (key not in PLACED[:2] or abs(high) >= abs(low))))
        found = f"{text}, with which the collar starts {format_quantity(radius, 'mm')} off the axis"
        yield check.fault(key, found, allowed, ("sweep", key) if check.axis(key) else None)


def _modes(check: Any) -> Iterator[Fault]:
    """At least one mode is free, and no value and no axis affects a frozen mode
    alone."""
    frozen_modes = [name for name in FROZEN if check.value(f"modes.{name}") == "frozen"]
    if len(frozen_modes) == len(FROZEN):
        yield check.fault("modes", "all of them frozen", "at least one free")
        return
    if "torsional" in frozen_modes and check.value("drive.kind") != "ideal":
        yield check.fault("drive.kind", f"{check.value('drive.kind')} with modes.torsional: frozen", "ideal")
    if "torsional" in frozen_modes and "rotary_speed" in check.resolved.get("ramps", {}):
        found = "a ramp with modes.torsional: frozen, which would not follow it"
        yield check.fault("operation.rotary_speed", found, "one value")
    for mode in frozen_modes:
        for key in FROZEN[mode]:
            reason = f"which modes.{mode}: frozen does without"
            if check.axis(key):
                allowed = "a number that changes the motion"
                yield check.idle(check.fault(f"sweep.{key}", f"an axis over {key}, {reason}", allowed))
            elif key.startswith("initial.") and check.given(key) and check.value(key) != check.leaves[key].default:
                yield check.idle(check.fault(key, f"{check.text(key)}, {reason}", "left out"))

        for key, off in OFF[mode].items():
            if check.sound(key) and check.value(key) != off and not check.axis(key):
                found = "true" if check.value(key) is True else check.text(key)
                text = f"{found}, which modes.{mode}: frozen does without"
                yield check.idle(check.fault(key, text, "left out"))


def _stabilizer(check: Any) -> Iterator[Fault]:
    """Stabilisers touch before the collar does, and have friction only with a
    clearance."""
    clearance = "stabilizer.clearance"
    if check.value(clearance) is None and not check.axis(clearance):
        allowed = "left out, or with a stabilizer.clearance: 0 mm stands for stabilisers without room"
        for key in check.leaves:
            if key.startswith("stabilizer.friction."):
                yield from check.unread(key, "which stabilizer.clearance: null does without", allowed)
        return
    gap = (check.ends(HOLE)[0] - check.ends(COLLAR)[1]) / 2
    if check.sound(HOLE, COLLAR) and 0.0 < gap <= check.ends(clearance)[1]:
        allowed = f"below the gap between collar and wall, {format_quantity(gap, 'mm')}: stabilisers touch first"
        yield check.fault(check.swept(clearance), check.text(clearance, 1), allowed)


def _rock(check: Any) -> Iterator[Fault]:
    """A bit that cuts its own surface moves along the hole."""
    if check.value("bit.rock.law") == "regenerative" and check.value("modes.axial") == "frozen":
        found = "regenerative with modes.axial: frozen, which holds the depth of cut"
        yield check.fault("bit.rock.law", found, "lobed")


def _law(check: Any) -> Iterator[Fault]:
    """No value and no axis that the friction of the bit does not read. Torques, and one law,
    are those of the whole bit."""
    if check.sound("bit.rock.law") and check.value("bit.rock.law") == "regenerative":
        return  # which reads no law at all
    cuts = law_named(check.value("bit.friction.law")).cuts and not is_measured(check, STATIC)
    cutting = [key for key in check.leaves if key.startswith("bit.cutting.") and check.axis(key)]
    yield from LAW.faults(check, also=() if cuts else cutting)


RULES = (
    *WHOLE_STRING,
    Rule(_initial, PLACED),
    Rule(_modes, ("drive.kind", *(f"modes.{mode}" for mode in FROZEN))),
    *of_the_rock(LOBED),
    Rule(_rock, ("bit.rock.law", "modes.axial")),
    of_wear_flats("bit.rock.wear_length", HOLE, 1.5),
    *SLIDING,
    Rule(_law, LAW.needs),
    *DRIVE_RULES,
    Rule(_stabilizer, ("stabilizer",)),
)
