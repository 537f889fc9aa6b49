"""The string as a list of sections, from the sheet of the assembly: what it replaces,
and what follows from it."""

from __future__ import annotations

import math

from nsdrill.data import Resolved, found_at
from nsdrill.models.operation import LARGEST_LENGTH
from nsdrill.models.sections import WIDEST_BORE, Collars, bore_of, lateral_in
from nsdrill.study.forms import Reading
from nsdrill.study.keys import Leaf, Value
from nsdrill.study.read import KeyPath, dotted
from nsdrill.study.weight import OF_JOINTS, as_written
from nsdrill.variables import short_key

SECTIONS = "drillstring.sections"
DEPTH = "operation.depth"
# The keys that a string of sections does not read.
REPLACED = (
    "drillstring.pipe",
    "drillstring.collar.length",
    "drillstring.collar_length",
    "drillstring.collar_inertia",
    "drillstring.outer_diameter",
    "drillstring.inner_diameter",
)
CLOSE = 1e-3  # relative: between the depth and the sum of all lengths


def has_sections(resolved: Resolved) -> bool:
    """Whether a study gives its string by sections."""
    return found_at(resolved, SECTIONS) is not None


def is_replaced(resolved: Resolved, key: str) -> bool:
    """Whether sections stand in place of this key."""
    return has_sections(resolved) and any(key == one or key.startswith(f"{one}.") for one in REPLACED)


def take_sections(at: Reading, resolved: Resolved) -> None:
    """Check the sections of a study, each by itself and against the depth, and set what
    follows from them: the depth where it is not given, the collar that bends, and as pipe
    the first section, whose impedance a drive feels."""
    if not has_sections(resolved) or any(bad.startswith(SECTIONS) for bad in at.faulty):
        return
    sections, path = found_at(resolved, SECTIONS), tuple(SECTIONS.split("."))
    faults = len(at.faults)
    _refuse_replaced(at)
    steel = found_at(resolved, "drillstring.material.density") or 7850.0
    field = resolved["units"] == "field"
    bores = [_bore(at, section, (*path, place), float(steel), field) for place, section in enumerate(sections)]
    _check_density(at, sections)
    _check_lengths(at, sections, path, resolved)
    if len(at.faults) > faults or None in bores:
        return
    string = resolved["drillstring"]
    if "pipe" in string:
        first = {"outer_diameter": sections[0]["outer_diameter"], "inner_diameter": bores[0], "weight": None}
        string["pipe"] = {**string["pipe"], **first}
    if "collar" not in string:
        return
    collar = string["collar"]
    span, lengths = collar.get("span", 0.0), [section["length"] for section in sections]
    lateral = lateral_in(lengths, span)
    below = sum(section["length"] for section in sections[1:])
    length = resolved["operation"]["depth"] - below if lateral == 0 else lengths[lateral]
    frozen = found_at(resolved, "modes.lateral") == "frozen"
    if span > length and not frozen:
        leaf = at.keys.leaves["drillstring.collar.span"]
        found = f"{leaf.text(span)}{'' if at.document.has(tuple(leaf.key.split('.'))) else ' (the default)'}"
        allowed = f"at most the length of the longest of {SECTIONS}, {leaf.text(length)}: a section that bends holds it"
        at.refuse(tuple(leaf.key.split(".")), found, allowed)
        return
    longest = next(item for item in Collars.__dataclass_fields__.values() if item.name == "length").metadata["high"]
    collar["length"] = min(max(length, span), longest)
    given = [at.document.has(("drillstring", "collar", name)) for name in ("outer_diameter", "inner_diameter")]
    if not given[0]:
        collar["outer_diameter"] = sections[lateral]["outer_diameter"]
    if not given[1]:
        collar["inner_diameter"] = bores[lateral]


def _refuse_replaced(at: Reading) -> None:
    """Pipe, or the length of the collars, beside the sections: as values, axes and
    unknowns."""
    allowed = f"one of the two: with {SECTIONS}, which win, the pipe and the lengths are theirs"
    for key in REPLACED:
        path: KeyPath = tuple(key.split("."))
        if at.document.has(path) and at.document.value(path) is not None:
            at.refuse(path, f"a value beside {SECTIONS}", allowed, of_key=True)
        for around in (("sweep",), ("uncertain",), ("uncertain", "table")):
            found = at.document.value(around)
            for name in found if isinstance(found, dict) else ():
                if isinstance(name, str) and (name == key or name.startswith(f"{key}.")):
                    at.refuse((*around, name), f"{name} beside {SECTIONS}", allowed, of_key=True)


def _bore(at: Reading, section: Resolved, path: KeyPath, density: float, field: bool) -> float | None:
    """The inner diameter [m] of a section; None where it has none that is right."""
    outer, inner, weight = (section[name] for name in ("outer_diameter", "inner_diameter", "weight"))
    leaves = {part.key.rpartition(".")[2]: part for part in at.keys.leaves[SECTIONS].parts}
    if outer is None:
        at.refuse((*path, "outer_diameter"), "null", leaves["outer_diameter"].allowed().replace(", or null", ""))
        return None
    if (inner is None) == (weight is None):
        found = "neither" if inner is None else "both"
        at.refuse(path, f"{found} of inner_diameter and weight", "one of the two; a rod has inner_diameter: 0 mm")
        return None
    if weight is None:
        if inner > WIDEST_BORE * outer:
            allowed = f"at most {WIDEST_BORE:g} times its outer diameter, {_text(at, leaves, path, outer)}"
            at.refuse((*path, "inner_diameter"), str(at.document.value((*path, "inner_diameter"))), allowed)
            return None
        return float(inner)
    density = section["density"] or density
    rod = math.pi / 4 * outer**2 * density
    least = (1 - WIDEST_BORE**2) * rod
    if not least <= weight <= rod:
        raw, text = str(at.document.value((*path, "weight"))), _text(at, leaves, path, outer)
        low, high = (as_written(bound, raw, leaves["weight"]) for bound in (least, rod))
        allowed = f"{low} (a wall) to {high} (a rod): what fits an outer diameter of {text}"
        at.refuse((*path, "weight"), raw, allowed)
        return None
    bore = bore_of(outer, weight, density)
    text = f"{bore / 0.0254:.4g} in" if field else f"{1e3 * bore:.4g} mm"
    at.document.notes.append(
        f"{dotted(path)} by weight: {at.document.value((*path, 'weight'))} of an even tube leave a bore of {text}. "
        f"A nominal weight has the tool joints in it, {OF_JOINTS} of it, which count as tube here."
    )
    return bore


def _text(at: Reading, leaves: dict[str, Leaf], path: KeyPath, outer: float) -> str:
    written = at.document.value((*path, "outer_diameter"))
    return str(written) if written is not None else leaves["outer_diameter"].text(outer)


def _check_density(at: Reading, sections: list[Resolved]) -> None:
    """The bore of a section by weight follows once from the density of the string."""
    key = "drillstring.material.density"
    if not any(section["weight"] is not None and section["density"] is None for section in sections):
        return
    for around in (("sweep",), ("uncertain",), ("uncertain", "table")):
        if at.document.has((*around, key)):
            found = f"{key}, from which the bore of a section by weight follows once for the whole study"
            at.refuse((*around, key), found, "it with an inner_diameter of each section", of_key=True)


def _check_lengths(at: Reading, sections: list[Resolved], path: KeyPath, resolved: Resolved) -> None:
    """Every section below the first has a length, and all of them add up to the depth, or
    to it where it is not given; where the depth varies the first follows it."""
    lacking = [place for place, section in enumerate(sections) if place and section["length"] is None]
    for place in lacking:
        found = "nothing" if not at.document.has((*path, place, "length")) else "null"
        allowed = "a length; only the first section reaches to the surface without one"
        at.refuse((*path, place, "length"), found, allowed)
    if lacking:
        return
    first, below = sections[0]["length"], sum(section["length"] for section in sections[1:])
    leaf = at.keys.leaves[DEPTH]
    places = [DEPTH.split("."), ["sweep", short_key(DEPTH)], ["uncertain", short_key(DEPTH)]]
    places.append(["uncertain", "table", short_key(DEPTH)])
    varies = "depth" in resolved.get("ramps", {}) or any(at.document.has(tuple(place)) for place in places[1:])
    given = at.document.has(tuple(places[0])) and DEPTH not in at.faulty
    if not varies and not given:
        if first is None:
            at.refuse((*path, 0, "length"), f"nothing, without {DEPTH}", f"a length, or {DEPTH}")
            return
        depth = first + below
        if depth > LARGEST_LENGTH:
            at.refuse(path, f"lengths that add up to {leaf.text(depth)}", leaf.range())
            return
        resolved["operation"]["depth"] = depth
    depth = resolved["operation"]["depth"]
    if varies:
        if first is not None:
            at.document.notes.append(
                f"{dotted(path)}: as the depth varies, the first section reaches to the surface at every depth; its "
                f"length of {at.document.value((*path, 0, 'length'))} is not read."
            )
        if given or depth > below:
            return
        resolved["operation"]["depth"] = min(below + max(first or 0.0, 0.1 * below, 1.0), LARGEST_LENGTH)
        return
    if depth <= below:
        return  # said of the depth
    if first is not None and abs(first + below - depth) > CLOSE * depth:
        found = f"{at.document.value((*path, 0, 'length'))}, with which all sections are {_short(first + below)} long"
        allowed = (
            f"lengths that add up to {DEPTH}, {at.document.value(tuple(places[0]))}, within {100 * CLOSE:g} %; without "
            "a length the first section reaches to the surface"
        )
        at.refuse((*path, 0, "length"), found, allowed)


def _short(length: Value) -> str:
    return f"{length:.6g} m"
