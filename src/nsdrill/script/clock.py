"""The forcing of a model, found in its graph: which angle the time stands for.

What grows in proportion to the time, as ``t``, ``omega * t`` or ``2 * pi * t / period``, is an
angle. Where all such angles are whole multiples of one, and the slopes repeat once that
has grown by a revolution, the motion is forced: the angle k omega t becomes
k (phase + omega t), so that a run which follows another goes on with its forcing, and a
Poincare section has a revolution of it. Otherwise the time is a value as others are.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node
from nsdrill.records import dataclass
from nsdrill.script.signature import Signature
from nsdrill.units import counts_cycles

CLOCK = "clock"  # the lane parameter that is the rate of the phase [rad/s]
DIVISORS = range(1, 13)  # into how many revolutions of the least rate one of the forcing may fall
PROBES = 64
TOLERANCE = 1e-9


def angles_in(graph: Graph, outputs: Iterable[Node]) -> dict[Node, Node]:
    """The angles that ``outputs`` depend on, each with its rate, a value of parameters; the
    time itself is one, of the rate 1 rad/s. With products of one another's parts, only the
    whole is an angle."""
    nodes = graph.live(outputs)
    rates: dict[Node, Node] = {}
    moving: set[Node] = set()  # what depends on the time or on a state
    used: dict[Node, bool] = {}  # angles, by whether something else than an angle reads them
    for node in nodes:
        rate = _rate(graph, node, rates, moving)
        if rate is not None:
            rates[node] = rate
            used.setdefault(node, False)
        elif any(arg in rates for arg in node.args):
            used |= {arg: True for arg in node.args if arg in rates}
        if (node.op == "input" and not str(node.extra).startswith("p.")) or any(arg in moving for arg in node.args):
            moving.add(node)
    for node in outputs:
        if node in rates:
            used[node] = True
    return {node: rates[node] for node, is_read in used.items() if is_read}


def _rate(graph: Graph, node: Node, rates: Mapping[Node, Node], moving: set[Node]) -> Node | None:
    """The rate of an angle, None of anything else."""
    if node.op == "input":
        return graph.node(1.0) if node.extra == "time" else None
    if node.op == "neg" and node.args[0] in rates:
        return -rates[node.args[0]]
    if node.op == "mul":
        for one, other in (node.args, node.args[::-1]):
            if one in rates and other not in moving:
                return rates[one] * other
    if node.op == "div" and node.args[0] in rates and node.args[1] not in moving:
        return rates[node.args[0]] / node.args[1]
    return None


@dataclass(frozen=True)
class Forcing:
    """The forcing of a model: its ``rate`` [rad/s] is that of the angle number
    ``least``, over a whole number ``parts``; the angles are its ``multiples``, in the
    order in which equations have them."""

    least: int
    parts: int
    multiples: tuple[int, ...]

    def rate(self, graph: Graph, slopes: Mapping[str, Node]) -> Node:
        """Its rate as a value of parameters."""
        rates = list(angles_in(graph, values_read(graph, slopes)).values())
        return rates[self.least] / float(self.parts)

    def turned(self, graph: Graph, slopes: dict[str, Node], phase: Node, time: Node, clock: Node) -> dict[str, Node]:
        """The slopes, and what the graph has of contacts and names, with the phase of the
        forcing in place of its angles."""
        angles = list(angles_in(graph, values_read(graph, slopes)))
        angle = phase + clock * time
        return replaced(graph, slopes, {a: k * angle for a, k in zip(angles, self.multiples, strict=True)})


def cycles_as_radians(read: Signature, graph: Graph, slopes: Mapping[str, Node]) -> str:
    """The parameter in Hz that is the rate of an angle without 2 pi, so that one of its cycles is a
    radian; "" where there is none."""
    of_cycles = [name for name, value in read.parameters.items() if counts_cycles(value.units)]
    rates = {str(k): rate for k, rate in enumerate(angles_in(graph, values_read(graph, slopes)).values())}
    given = _inputs(read)
    for name in of_cycles:
        more = given | {f"p.{name}": given[f"p.{name}"] + 1.0}
        for rate in rates.values():
            one, other = (plain.values({"": rate}, at)[""] for at in (given, more))
            parts = max(DIVISORS) * np.abs(np.asarray(other - one, float))
            if np.any(parts > TOLERANCE) and np.allclose(parts, np.round(parts), rtol=0.0, atol=1e-6):
                return name
    return ""


def values_read(graph: Graph, slopes: Mapping[str, Node]) -> list[Node]:
    """All values that are read of a graph with these slopes."""
    contacts = [
        one
        for contact in graph.frictions
        for one in (*contact.slips, contact.normal, *contact.loads, *vars(contact.numbers).values())
        if type(one) is Node
    ]
    return [*slopes.values(), *graph.gaps.values(), *contacts]


def replaced(graph: Graph, slopes: dict[str, Node], given: Mapping[Node, Node]) -> dict[str, Node]:
    """The slopes with other values in place of those ``given``, also in the contacts and
    the names of the graph."""
    regions: dict[int, int] = {}

    # together first, as a region is made again with all that it holds
    every = [*slopes.values(), *values_read(graph, {}), *graph.names.values()]
    found = dict(zip(every, graph.substituted(every, given, regions), strict=True))
    made = {name: found[node] for name, node in slopes.items()}
    graph.gaps = {name: found[gap] for name, gap in graph.gaps.items()}
    for contact in graph.frictions:
        contact.slips = tuple(found.get(one, one) for one in contact.slips)
        contact.normal = found.get(contact.normal, contact.normal)
        contact.loads = tuple(found.get(one, one) for one in contact.loads)
        contact.numbers = type(contact.numbers)(**{n: found.get(v, v) for n, v in vars(contact.numbers).items()})
        contact.region = regions.get(contact.region, contact.region)
    graph.names = {name: found[node] for name, node in graph.names.items()}
    return made


def forcing_in(read: Signature, graph: Graph, slopes: Mapping[str, Node]) -> Forcing | None:
    """The forcing of equations with this graph; None where nothing is periodic."""
    angles = angles_in(graph, values_read(graph, slopes))
    if not angles:
        return None
    rates = _values(read, {str(k): rate for k, rate in enumerate(angles.values())})
    if not all(np.all(np.isfinite(rate) & (rate != 0.0)) for rate in rates):
        return None
    least = int(np.argmin([abs(rate[0]) for rate in rates]))
    for parts in DIVISORS:
        multiples = [parts * rate / rates[least] for rate in rates]
        whole = [round(float(one[0])) for one in multiples]
        if all(k and np.allclose(one, k, rtol=TOLERANCE, atol=0.0) for k, one in zip(whole, multiples, strict=True)):
            found = Forcing(least, parts, tuple(whole))
            return found if _repeats(read, graph, slopes, list(angles), found) else None
    return None


def _inputs(read: Signature) -> dict[str, Any]:
    """Numbers at which graphs are compared: the defaults first, then others."""
    rng = np.random.default_rng(1)

    def around(value: float) -> Array:
        size = abs(value) or 1.0
        return np.concatenate([[value], value + size * rng.uniform(-0.4, 0.4, PROBES - 1)])

    states = {f"s.{name}": around(float(value)) for name, value in read.start.items()}
    return states | {f"p.{name}": around(float(value)) for name, value in read.parameters.items()}


def _values(read: Signature, nodes: Mapping[str, Node]) -> list[Array]:
    given = _inputs(read)
    return [np.broadcast_to(np.asarray(value, float), PROBES) for value in plain.values(nodes, given).values()]


def _repeats(read: Signature, graph: Graph, slopes: Mapping[str, Node], angles: list[Node], found: Forcing) -> bool:
    """Whether the slopes are the same after a revolution of the forcing: they change with it, or
    read its angles through sines and cosines alone. What does neither may be a pulse at one time."""
    phase = np.random.default_rng(2).uniform(0.0, 2.0 * math.pi, PROBES)
    # the angles are given, and nothing else reads the time
    stand_in = [graph.input(f"angle {k}") for k in range(len(angles))]
    wanted = graph.substituted(slopes.values(), dict(zip(angles, stand_in, strict=True)), {})
    values = []
    for at in (phase, phase + 2.0 * math.pi, np.roll(phase, 1)):
        given = _inputs(read) | {f"angle {k}": n * at for k, n in enumerate(found.multiples)}
        made = plain.values(dict(zip(slopes, wanted, strict=True)), given)
        values.append([np.broadcast_to(np.asarray(one, float), PROBES) for one in made.values()])
    readers = [node for node in graph.live(wanted) if any(arg in stand_in for arg in node.args)]
    of_circle = all(node.op == "result" and str(node.extra[0]) == "sincos" for node in readers)
    return _same(values[0], values[1]) and (of_circle or not _same(values[0], values[2]))


def repeat(read: Signature, nodes: Mapping[str, Node]) -> bool:
    """Whether these values of a forced model repeat after a revolution of its forcing, and read
    the time as a part of the angle of that alone."""
    rng = np.random.default_rng(3)
    phase, time = (rng.uniform(0.0, 2.0 * math.pi, PROBES) for _ in range(2))
    turned: list[dict[str, Any]] = [
        {"phase": phase + time + revolution, "time": 0.0} for revolution in (0.0, 2.0 * math.pi)
    ]
    given = {**_inputs(read), f"p.{CLOCK}": 1.0}
    found = [plain.values(nodes, {**given, **at}) for at in ({"phase": phase, "time": time}, *turned)]
    first, *others = [[np.broadcast_to(np.asarray(one, float), PROBES) for one in made.values()] for made in found]
    return all(_same(first, other) for other in others)


def _same(one: list[Array], other: list[Array]) -> bool:
    return all(
        np.allclose(a, b, rtol=TOLERANCE, atol=TOLERANCE * (_size(a) + 1e-300), equal_nan=True)
        for a, b in zip(one, other, strict=True)
    )


def _size(values: Array) -> float:
    """The greatest magnitude of what is a number among ``values``; 0 where nothing is."""
    return float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
