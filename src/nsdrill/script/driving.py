"""Contacts of a script whose friction may drive, as a number of theirs changes in time: it
brakes only while its normal load, its coefficients and static less dynamic are at least 0."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import reduce

from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.library import Friction

ROUNDING = 1e-12  # of a coefficient, by which the difference of two that are equal may be below 0
# What friction that brakes has of at least 0, by the attribute of a contact.
WORDS = {
    "normal": "a normal load",
    "smoothing": "a smoothing",
    "decay": "a decay",
    "dynamic": "a coefficient",
    "rise": "static less dynamic",
}

Bounds = tuple[float, float]  # the least and the greatest value
ANY: Bounds = (-math.inf, math.inf)
# of functions that rise, at both ends of their argument; of others at all arguments
RISING = {
    "tanh": math.tanh,
    "direction": lambda x: 2.0 / math.pi * math.atan(x),
    "expm1": lambda x: math.inf if x > 700.0 else math.expm1(x),
}
BOUNDED = {"sincos": (-1.0, 1.0), "bounded_root": (0.0, math.inf)}


def number_of(graph: Graph, contact: Friction, what: str) -> Node:
    """A number of :data:`WORDS` of a contact."""
    return graph.number(contact.normal if what == "normal" else getattr(contact.numbers, what))


def driving_in(graph: Graph, ranges: Mapping[str, Bounds]) -> dict[str, tuple[Node, tuple[str, ...]]]:
    """By the name of a contact with a number that changes in time and may be below 0, as far
    as the ``ranges`` of parameters say: whether it is, as 1 or 0, and which numbers these are."""
    given = {f"p.{name}": bounds for name, bounds in ranges.items()}
    found = {}
    for contact in graph.frictions:
        below = dict(_below(graph, contact, given))
        if below:
            either = reduce(lambda a, b: graph.make("or", a, b), below.values())
            for region in graph.around(contact.region):  # outside of its `if` there is no friction
                if (condition := graph.condition[region]) is not None:
                    either = graph.make("and", condition, either)
            found[contact.name] = graph.number(either), tuple(below)
    return found


def _below(graph: Graph, contact: Friction, given: Mapping[str, Bounds]) -> Iterator[tuple[str, Node]]:
    for what in WORDS:
        node = number_of(graph, contact, what)
        if graph.changes(node) and not bounds_of(node, given)[0] >= 0.0:
            yield what, node < -ROUNDING * _size(graph, contact, what, node)


def _size(graph: Graph, contact: Friction, what: str, node: Node) -> Node:
    """Of what the rounding of a number is a part."""
    if what == "rise":
        return abs(graph.number(contact.numbers.dynamic))
    return abs(node.args[0]) + abs(node.args[1]) if node.op in ("add", "sub") else graph.node(0.0)


def bounds_of(node: Node, given: Mapping[str, Bounds]) -> Bounds:
    """Between what a value stays, with these bounds of inputs: of intervals, so that what is
    not seen so may be anything."""
    found: dict[Node, Bounds] = {}
    for one in node.graph.live([node]):
        low, high = _product(_factors(one), found) if one.op == "mul" else _bounds(one, found, given)
        found[one] = (low, high) if low <= high else ANY  # of no number
    return found[node]


def _bounds(node: Node, found: Mapping[Node, Bounds], given: Mapping[str, Bounds]) -> Bounds:
    args = [found[arg] for arg in node.args]
    if node.op == "const":
        return node.extra, node.extra
    if node.op == "input":
        return given.get(str(node.extra), ANY)
    if node.op in ("select", "join"):
        return min(args[1][0], args[2][0]), max(args[1][1], args[2][1])
    if node.op == "result":
        name = node.extra[0].name
        return (RISING[name](args[0][0]), RISING[name](args[0][1])) if name in RISING else BOUNDED.get(name, ANY)
    if node.op == "fma":
        return _sum(_product([*node.args[:2]], found), args[2])
    return _of_operation(node, args)


def _of_operation(node: Node, args: list[Bounds]) -> Bounds:
    if node.op == "add":
        return _sum(*args)
    if node.op == "sub":
        return _sum(args[0], (-args[1][1], -args[1][0]))
    if node.op == "neg":
        return -args[0][1], -args[0][0]
    if node.op == "div":
        low, high = args[1]
        return _times(args[0], (1.0 / high, 1.0 / low if low else math.inf)) if low >= 0.0 < high else ANY
    if node.op == "max":
        return max(args[0][0], args[1][0]), max(args[0][1], args[1][1])
    if node.op == "min":
        return min(args[0][0], args[1][0]), min(args[0][1], args[1][1])
    if node.op == "abs":
        low, high = args[0]
        return max(low, -high, 0.0), max(-low, high)
    return (0.0, math.inf) if node.op == "sqrt" else ANY


def _sum(a: Bounds, b: Bounds) -> Bounds:
    return a[0] + b[0], a[1] + b[1]


def _factors(node: Node) -> list[Node]:
    return [one for arg in node.args for one in _factors(arg)] if node.op == "mul" else [node]


def _product(factors: list[Node], found: Mapping[Node, Bounds]) -> Bounds:
    """Of factors, of which those that are the same make squares."""
    total: Bounds = (1.0, 1.0)
    for one, times in Counter(factors).items():
        for _ in range(times // 2):
            low, high = _times(found[one], found[one])
            total = _times(total, (max(low, 0.0), high))
        total = _times(total, found[one]) if times % 2 else total
    return total


def _times(a: Bounds, b: Bounds) -> Bounds:
    ends = [p * q if p and q else 0.0 for p in a for q in b]  # 0 times what is not bounded is 0
    return min(ends), max(ends)
