"""Operating values that follow time, ``{ramp: [[time, value], ...]}``: what their knots
must satisfy together."""

from __future__ import annotations

from typing import Any

from nsdrill.errors import Fault
from nsdrill.kernel.settings import LONGEST
from nsdrill.study.document import Document, KeyPath, dotted
from nsdrill.study.keys import Leaf, shown
from nsdrill.units import QuantityError
from nsdrill.variables import AXES

TIME = Leaf("time", "quantity", 0.0, "s", low=0.0, high=LONGEST)
EXAMPLE = "{ramp: [[0 s, VALUE], [600 s, VALUE]]}"
LEAST_LEG = 1e-3  # s between knots: to a drill string a jump

Knots = list[list[float]]


def pair(raw: Any) -> Any:
    """``raw`` if it may be a knot; :class:`QuantityError` otherwise."""
    if not isinstance(raw, list):
        raise QuantityError(shown(raw), "a knot: [time, value]")
    if len(raw) != 2:
        raise QuantityError(f"a list of {len(raw)}", "a knot: [time, value]")
    return raw


def knots(raw: Any) -> Any:
    """``raw`` if it may be a list of knots; :class:`QuantityError` otherwise."""
    if not isinstance(raw, list):
        raise QuantityError(shown(raw), "a list of knots: [[0 s, VALUE], [600 s, VALUE]]")
    return raw


def take_ramps(
    document: Document, operation: dict[str, Any]
) -> tuple[dict[str, Knots], list[Fault]]:
    """The ramps of the validated section ``operation`` as [times, values], each
    replaced there by its value at time zero; and the faults of their knots."""
    ramps: dict[str, Knots] = {}
    faults: list[Fault] = []
    for name in AXES:
        given = operation.get(name)
        if not isinstance(given, dict):
            continue
        fault = _fault(document, name, given["ramp"])
        if fault is None:
            times, values = (list(column) for column in zip(*given["ramp"], strict=True))
            ramps[name] = [times, values]
            operation[name] = values[0]
        else:
            faults.append(fault)
            del operation[name]
    return ramps, faults


def _fault(document: Document, name: str, found: list[tuple[float, float]]) -> Fault | None:
    path: KeyPath = ("operation", name, "ramp")
    if len(found) < 2:
        words = "one knot" if found else "an empty list"
        return _at(
            document,
            path,
            words,
            "two knots or more; a value that does not change stands without a ramp",
        )
    for i, (time, _) in enumerate(found):
        if i == 0 and time != 0.0:
            return _at(
                document, (*path, 0, 0), _raw(document, name, 0), "0 s, where the run begins"
            )
        if i > 0 and time < found[i - 1][0] + LEAST_LEG:
            before = _raw(document, name, i - 1)
            allowed = (
                f"times that ascend, at least {1e3 * LEAST_LEG:g} ms after the one before, {before}"
            )
            return _at(document, (*path, i, 0), _raw(document, name, i), allowed)
    return None


def _raw(document: Document, name: str, i: int) -> str:
    return shown(document.data["operation"][name]["ramp"][i][0])


def _at(document: Document, path: KeyPath, found: str, allowed: str) -> Fault:
    place = document.place(path)
    if place.override:
        found = f"{found} ({place.override})"
    return Fault(dotted(path), found, allowed, place.line, place.column)
