"""What the numbers of a whole string must satisfy together in a study: the sections, and
the stiffness and inertia that are given as they were measured. Each fault names the key
that the user wrote."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from nsdrill.errors import Fault
from nsdrill.models.friction import TORQUES
from nsdrill.models.rules import Order, Rule
from nsdrill.units import format_quantity

SECTIONS, DEPTH = "drillstring.sections", "operation.depth"
MEASURED = ("drillstring.torsional_stiffness", "drillstring.rotary_inertia")
STATIC, DYNAMIC = (f"bit.friction.{name}" for name in TORQUES)
MATERIAL = ("density", "young_modulus", "shear_modulus")


def has_sections(check: Any) -> bool:
    """Whether a study gives its string by sections."""
    return check.value(SECTIONS) is not None or not check.sound(SECTIONS)


def collar_of_sections(check: Any) -> bool:
    """Whether the collar that bends is a section, whose diameter is checked with those of
    the others."""
    return has_sections(check) and not check.given("drillstring.collar.outer_diameter")


def is_measured(check: Any, key: str) -> bool:
    """Whether a study gives this number of the whole string."""
    return check.value(key) is not None or check.axis(key) is not None


def without_length(check: Any) -> bool:
    """Whether no length of the collars counts: the string is given by sections, or by its
    stiffness and inertia where nothing moves along the hole."""
    frozen = "modes.axial" not in check.leaves or check.value("modes.axial") == "frozen"
    return has_sections(check) or (frozen and all(is_measured(check, key) for key in MEASURED))


TORQUE_ORDER = Order(
    DYNAMIC, STATIC, True, "lower", unless=lambda check: None in (check.value(STATIC), check.value(DYNAMIC))
)


def _sections(check: Any) -> Iterator[Fault]:
    """A depth beyond the sections below the first, sections that fit the hole, and no axis
    that no section reads."""
    sections, path = check.value(SECTIONS), tuple(SECTIONS.split("."))
    if sections is None or any(bad.startswith(SECTIONS) for bad in check.faulty):
        return
    below = sum(section["length"] for section in sections[1:])
    allowed = f"more than the sections below the first, {format_quantity(below, 'm')}"
    if (ramp := check.resolved.get("ramps", {}).get("depth")) and min(ramp[1]) <= below:
        yield check.fault(DEPTH, f"a ramp down to {format_quantity(min(ramp[1]), 'm')}", allowed)
    elif check.ends(DEPTH)[0] <= below:
        yield check.fault(check.swept(DEPTH), check.text(DEPTH, 0), allowed)
    if "well.diameter" in check.leaves and check.sound("well.diameter"):
        hole = check.ends("well.diameter")[0]
        for place, section in enumerate(sections):
            if section["outer_diameter"] >= hole:
                there = (*path, place, "outer_diameter")
                found = str(check.document.value(there))
                allowed = f"below well.diameter, {format_quantity(hole, 'mm')}"
                yield check.fault(f"{SECTIONS}[{place}].outer_diameter", found, allowed, there)
    for name in MATERIAL:
        key = f"drillstring.material.{name}"
        if key in check.leaves and check.axis(key) and all(section[name] is not None for section in sections):
            found = f"an axis over {key}, which every section has of its own"
            allowed = f"it with a section that has no {name}"
            yield check.idle(check.fault(f"sweep.{key}", found, allowed))


def _measured(check: Any) -> Iterator[Fault]:
    """No depth that varies beside a number of the string at one depth."""
    given = [key for key in MEASURED if key in check.leaves and is_measured(check, key)]
    if not given:
        return
    why = f"with {' and '.join(given)}, of a string of one length"
    allowed = "one depth; or the geometry of the string in their place"
    if "depth" in check.resolved.get("ramps", {}):
        yield check.fault(DEPTH, f"a ramp {why}", allowed)
    if check.axis(DEPTH):
        yield check.fault("sweep.depth", f"an axis over the depth, {why}", allowed)


# Of every string: its sections, and what is given of the whole of it.
WHOLE_STRING = Rule(_sections, (DEPTH,)), Rule(_measured)
