"""The string of a study in a line, as it stands on the sheet of an assembly: each part with its diameters, its length
and what it weighs."""

from __future__ import annotations

import math
from collections.abc import Iterator

from nsdrill.data import Resolved
from nsdrill.quantity import quantity

DIAMETERS = ("outer_diameter", "inner_diameter")
COLLAR, PIPE = "drillstring.collar", "drillstring.pipe"
IN_ASSEMBLY = (  # the keys that are told together
    *(f"{COLLAR}.{name}" for name in (*DIAMETERS, "length")),
    *(f"{PIPE}.{name}" for name in (*DIAMETERS, "weight")),
)
STRING = "string:"  # the word that it begins with
DIGITS = 4
MOST_SECTIONS = 6  # of a string that is told part by part


def assembly(study: Resolved, units: str, varied: frozenset[str]) -> str:
    """The parts of the string of a resolved ``study`` from the top to the bit; "" where it has no such parts, where one
    of their numbers is ``varied``, by the name of its quantity, or where they are too many for a line."""
    string = study.get("drillstring")
    if not isinstance(string, dict) or any(quantity(key).name in varied for key in IN_ASSEMBLY):
        return ""
    parts = list(_parts(string))
    if len(parts) > MOST_SECTIONS or not all(_is_told(part) for _, part in parts):
        return ""
    steel = string.get("material") or {}
    told = [_told(name, part, part.get("density") or steel.get("density"), units) for name, part in parts]
    return f"{STRING} {', '.join(told)}" if told else ""


def _parts(string: Resolved) -> Iterator[tuple[str, Resolved]]:
    """What each part is, and its numbers."""
    if sections := string.get("sections"):
        for number, section in enumerate(sections):
            yield "pipe" if number == 0 else "", section
    elif isinstance(string.get("collar"), dict) and isinstance(string.get("pipe"), dict):
        yield "pipe", {**string["pipe"], "length": None}
        yield "collars", string["collar"]


def _is_told(part: Resolved) -> bool:
    has_bore = part.get("inner_diameter") is not None or part.get("weight") is not None
    return part.get("outer_diameter") is not None and has_bore


def _told(name: str, part: Resolved, density: float | None, units: str) -> str:
    """``pipe 5 by 4.276 in (17.9 lb/ft)``, ``540 ft of 6.5 by 2.812 in (99.2 lb/ft)``."""
    ends = [
        quantity(f"{COLLAR}.{one}").text(part[one], units, DIGITS) for one in DIAMETERS if part.get(one) is not None
    ]
    unit = ends[-1].rpartition(" ")[2]
    across = " by ".join((*(one.removesuffix(f" {unit}") for one in ends[:-1]), ends[-1]))
    weight = part.get("weight")
    if weight is None and density is not None:
        outer, inner = (float(part[one]) for one in DIAMETERS)
        weight = density * math.pi / 4 * (outer * outer - inner * inner)
    weighs = f" ({quantity(f'{PIPE}.weight').text(weight, units, 3)})" if weight is not None else ""
    length = part.get("length")
    of = "" if length is None else f"{quantity(f'{COLLAR}.length').text(length, units, DIGITS)} of "
    return f"{of}{f'{name} ' if name else ''}{across}{weighs}"
