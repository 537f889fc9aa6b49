"""Pipe that a study gives by its weight per length in place of its inner diameter."""

from __future__ import annotations

import math

from nsdrill.data import Resolved, value_at
from nsdrill.models.sections import WIDEST_BORE, bore_of
from nsdrill.study.forms import Reading
from nsdrill.study.keys import Leaf
from nsdrill.units import format_quantity, parse_with_unit
from nsdrill.variables import short_key

PIPE = "drillstring.pipe"
WEIGHT, BORE, OUTER, DENSITY = (
    f"{PIPE}.weight",
    f"{PIPE}.inner_diameter",
    f"{PIPE}.outer_diameter",
    "drillstring.material.density",
)
# A nominal weight of drill pipe is that of the joints spread over the length: so much more
# than its plain end (API RP 7G: 5 in, 19.5 lb/ft nominal, 17.93 plain end).
OF_JOINTS = "5 to 15 %"


def as_written(bound: float, raw: str, leaf: Leaf) -> str:
    """A ``bound`` in SI, to four digits, in the unit of the value ``raw`` that is refused."""
    return format_quantity(bound, parse_with_unit(raw, leaf.units).unit, 4)


def is_weighed(resolved: Resolved) -> bool:
    """Whether a study gives its pipe by weight."""
    pipe = resolved.get("drillstring", {}).get("pipe")
    return isinstance(pipe, dict) and pipe.get("weight") is not None


def weigh(at: Reading, resolved: Resolved) -> None:
    """Set the inner diameter of a pipe that is given by weight. A fault where both are
    given, where what the bore follows from is an axis or uncertain, and where a rod is
    lighter."""
    if WEIGHT not in at.keys.leaves or at.faulty & {WEIGHT, BORE, OUTER, DENSITY}:
        return
    for section in ("sweep", "uncertain"):
        for key in (WEIGHT, OUTER, DENSITY) if is_weighed(resolved) else (WEIGHT,):
            if at.document.has((section, short_key(key))):
                found = f"{key}, from which the inner diameter of the pipe follows once for the whole study"
                at.refuse((section, short_key(key)), found, f"it with {BORE}, or {section}.{BORE}", of_key=True)
    if not is_weighed(resolved):
        return
    path = tuple(WEIGHT.split("."))
    if at.document.has(tuple(BORE.split("."))) or any(at.document.has((of, BORE)) for of in ("sweep", "uncertain")):
        at.refuse(path, f"the weight of the pipe beside {BORE}", "one of the two", of_key=True)
        return
    leaf, outer, density = at.keys.leaves[WEIGHT], value_at(resolved, OUTER), value_at(resolved, DENSITY)
    weight = value_at(resolved, WEIGHT)
    try:
        bore = bore_of(outer, weight, density)
    except ValueError:
        raw = str(at.document.value(path))
        rod = as_written(math.pi / 4 * outer**2 * density, raw, leaf)
        at.refuse(path, raw, f"at most {rod}, the weight of a rod of this diameter")
        return
    if bore > WIDEST_BORE * outer:
        raw = str(at.document.value(path))
        least = as_written(math.pi / 4 * (1 - WIDEST_BORE**2) * outer**2 * density, raw, leaf)
        at.refuse(path, str(at.document.value(path)), f"at least {least}, for which the pipe has a wall")
        return
    resolved["drillstring"]["pipe"]["inner_diameter"] = bore
    text = f"{bore / 0.0254:.4g} in" if resolved["units"] == "field" else f"{1e3 * bore:.4g} mm"
    at.document.notes.append(
        f"Pipe by weight: {at.document.value(path)} of an even pipe leave a bore of {text}. A nominal weight has the "
        f"tool joints in it, {OF_JOINTS} of it, which count as pipe here: the pipe is then as much too heavy and "
        "almost as much too stiff. Give the weight of the plain end, or drillstring.pipe.inner_diameter."
    )
