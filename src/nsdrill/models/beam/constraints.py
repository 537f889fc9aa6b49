"""What several values of a study of an elastic collar must satisfy together."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from nsdrill.errors import Fault
from nsdrill.models.christoforou_yigit.constraints import ORDERS as LUMPED
from nsdrill.units import format_quantity
from nsdrill.variables import short_key

ORDERS = tuple(order for order in LUMPED if not order.lower.startswith("stabilizer."))
_START = ("initial.x", "initial.y", "initial.vx", "initial.vy")


def constraints(check: Any) -> Iterator[Fault]:
    """All constraints but the :data:`ORDERS`; ``check`` is the Checker of the study."""
    yield from _stations(check)
    yield from _eccentricities(check)
    yield from _start(check)
    yield from _buckling(check)
    if check.sound("record") and check.value("record.section") == "lobe":
        yield check.fault("record.section", "lobe", "revolution, with the model beam")


def _stations(check: Any) -> Iterator[Fault]:
    """Each station is beyond the one before."""
    key = "beam.stations"
    if not check.sound(key):
        return
    places = [station["at"] for station in check.value(key)]
    for number, (before, place) in enumerate(pairwise(places), start=1):
        if place <= before:
            allowed = f"above the place before it, {before:g}"
            yield check.fault(f"{key}[{number}].at", f"{place:g}", allowed, ("beam", "stations", number))


def _eccentricities(check: Any) -> Iterator[Fault]:
    """Eccentricities are those of existing modes, and are given in one place only."""
    key = "beam.eccentricity_modes"
    if not check.sound(key, "beam.modes") or check.value(key) is None:
        return
    if len(check.value(key)) > check.value("beam.modes"):
        found = f"{len(check.value(key))} values, with {check.value('beam.modes')} modes"
        yield check.fault(key, found, "one value for each of the first modes")
    for other in ("drillstring.eccentricity", "drillstring.eccentricity_shape"):
        if check.axis(other):
            yield check.fault(
                f"sweep.{other}", f"an axis over {other} beside {key}", "one of the two", ("sweep", other)
            )
        elif check.given(other) and check.value(other) != check.leaves[other].default:
            yield check.fault(other, f"{check.text(other)}, beside {key}", "left out")


def _start(check: Any) -> Iterator[Fault]:
    """The start is bent against the wall, or has the first mode of the study."""
    key = "initial.wall_force"
    if not check.sound("initial", f"sweep.{key}"):
        return
    if check.value(key) is None and not check.axis(key):
        return
    for name in _START:
        if check.axis(name):
            yield check.fault(f"sweep.{name}", f"an axis over {name} beside {key}", "one of the two", ("sweep", name))
        elif check.given(name) and check.value(name) != check.leaves[name].default:
            yield check.fault(name, f"{check.text(name)}, beside {key}", "left out: the force bends all modes")
    if check.value("initial.slice") or check.value("initial.ensemble") > 1:
        yield check.fault(key, f"{check.text(key)}, beside several starts", "left out")


def _buckling(check: Any) -> Iterator[Fault]:
    """The walls hold every shape that the weight on bit buckles: the bending stiffness
    is positive for all shapes that are zero at the stations with a wall.

    This is checked for the greatest weight, and not where numbers of the string or
    places of stations are swept.
    """
    string, beam = (check.value(name) for name in ("drillstring", "beam"))
    keys = ("drillstring.collar", "drillstring.material", "beam", "operation.wob", "sweep")
    if not check.sound(*keys):
        return
    moved = ("drillstring.collar.", "drillstring.material.")
    if any(axis.startswith(moved) for axis in check.resolved["sweep"] if isinstance(axis, str)):
        return
    collar = string["collar"]
    second = math.pi / 64 * (collar["outer_diameter"] ** 4 - collar["inner_diameter"] ** 4)
    euler = math.pi**2 * string["material"]["young_modulus"] * second / collar["span"] ** 2
    has_axial_load = not isinstance(beam["axial_load"], str) or check.axis("beam.axial_load")
    key = "beam.axial_load" if has_axial_load else "operation.wob"
    load = check.ends(key)[1] / euler
    modes = np.arange(1, beam["modes"] + 1)
    wall_places = [station["at"] for station in beam["stations"] if station["stiffness"] != 0.0]
    _, singular_values, shapes = np.linalg.svd(np.sin(np.pi * np.outer(wall_places, modes)).reshape(-1, len(modes)))
    rank = int(np.sum(singular_values > 1e-9))
    unheld = shapes[rank:]
    if len(unheld) == 0:
        return
    least = np.linalg.eigvalsh(unheld @ np.diag(modes**4 - load * modes**2.0) @ unheld.T).min()
    if least <= 0.0:
        allowed = (
            "a load that buckles no shape of the collar that clears all stations with a wall, "
            "more of them, or fewer "
            f"modes; the buckling load of the span is {format_quantity(euler, 'kN')}"
        )
        path = ("sweep", short_key(key)) if check.axis(key) else None
        yield check.fault(
            key, f"{check.text(key, 1)}, under which the collar bends between the stations without end", allowed, path
        )
