"""What several values of a study of an elastic collar must satisfy together."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from nsdrill.errors import Fault
from nsdrill.models.christoforou_yigit.relations import ORDERS as LUMPED
from nsdrill.units import format_quantity

ORDERS = tuple(one for one in LUMPED if not one.lower.startswith("stabilizer."))
_START = ("initial.x_1", "initial.y_1", "initial.vx_1", "initial.vy_1")


def relations(check: Any) -> Iterator[Fault]:
    """All of them but the :data:`ORDERS`; ``check`` is the Checker of the study."""
    yield from _stations(check)
    yield from _start(check)
    yield from _buckling(check)
    if check.sound("record") and check.value("record.section") == "lobe":
        yield check.fault("record.section", "lobe", "revolution, with the model beam")


def _stations(check: Any) -> Iterator[Fault]:
    """The first before the last, where there are several; no last one where there is but one."""
    first, last = "stations.first", "stations.last"
    if not check.sound("stations", f"sweep.{first}", f"sweep.{last}"):
        return
    if check.value("stations.number") == 1:
        if check.axis(last):
            yield check.fault(f"sweep.{last}", "an axis over the last of one station", "no such axis", ("sweep", last))
        elif check.given(last) and check.value(last) != check.leaves[last].default:
            yield check.fault(last, f"{check.text(last)}, with one station", "left out; stations.first is its place")
    elif check.ends(first)[1] >= check.ends(last)[0]:
        key = first if check.given(first) or check.axis(first) else last
        found = f"stations.first {check.text(first, 1)}, stations.last {check.text(last, 0)}"
        yield check.fault(key, found, "the first before the last", ("sweep", key) if check.axis(key) else None)


def _start(check: Any) -> Iterator[Fault]:
    """Bent against the wall, or with the first mode as given."""
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
    """What the weight on bit buckles the walls hold: the bending stiffness is positive wherever no station gives way.

    Of the greatest weight; with swept numbers of the string or places nothing is said.
    """
    string, beam, stations = (check.value(name) for name in ("drillstring", "beam", "stations"))
    keys = ("drillstring.collar", "drillstring.material", "stations", "beam", "operation.wob", "sweep")
    if not check.sound(*keys) or string["lateral_softening"] == "none":
        return
    moved = ("drillstring.collar.", "drillstring.material.", "stations.")
    if any(axis.startswith(moved) for axis in check.resolved["sweep"] if isinstance(axis, str)):
        return
    collar = string["collar"]
    second = math.pi / 64 * (collar["outer_diameter"] ** 4 - collar["inner_diameter"] ** 4)
    euler = math.pi**2 * string["material"]["young_modulus"] * second / collar["span"] ** 2
    load = check.ends("operation.wob")[1] / euler
    modes, number = np.arange(1, beam["modes"] + 1), stations["number"]
    along = np.linspace(stations["first"], stations["last"], number) if number > 1 else np.array([stations["first"]])
    _, held, free = np.linalg.svd(np.sin(np.pi * np.outer(along, modes)))
    rank = int(np.sum(held > 1e-9))
    loose = free[rank:]
    if len(loose) == 0:
        return
    least = np.linalg.eigvalsh(loose @ np.diag(modes**4 - load * modes**2.0) @ loose.T).min()
    if least <= 0.0:
        allowed = (
            "a load that buckles no shape of the collar that clears all stations, more stations, or fewer modes; the "
            f"buckling load of the span is {format_quantity(euler, 'kN')}"
        )
        key = "operation.wob"
        path = ("sweep", "wob") if check.axis(key) else None
        yield check.fault(key, f"{check.text(key, 1)}, under which the collar bends between the stations without end",
                          allowed, path)  # fmt: skip
