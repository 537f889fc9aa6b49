"""A graph without lanes: as a function of numbers that is written out where lane code
calls it, and evaluated on arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from types import FunctionType
from typing import Any, TypeAlias

import numpy as np

from nsdrill.compiler.functions import define, fma, inlined
from nsdrill.data import Array
from nsdrill.equations.graph import Graph, Node, Number
from nsdrill.equations.lanes import written
from nsdrill.equations.library import Library
from nsdrill.equations.passes import Tangents, settled
from nsdrill.equations.trace import Named


class Rows(Named):
    """The inputs of a graph: every name is one."""

    def __init__(self, graph: Graph) -> None:
        super().__init__(graph=graph)

    def __getattr__(self, name: str) -> Node:
        return self.graph.input(name)


Quantity: TypeAlias = Callable[[Rows], Number]
Rates: TypeAlias = Callable[[Rows], Mapping[str, Number]]


def followed(quantity: Quantity, rates: Rates) -> tuple[FunctionType, FunctionType]:
    """A ``quantity`` of rows and how fast it changes, functions of numbers whose
    arguments are the rows that they read; ``rates`` gives how fast rows change, those
    that do. A declaration refuses one that may change and has no rate: what is taken
    for constant is the attribute ``constant`` of the functions."""
    rows = Rows(Graph())
    value, rate = _along(rows, rows.graph.node(quantity(rows)), rates, 1)
    return value, rate


def followed_node(value: Node, rates: Rates) -> tuple[FunctionType, FunctionType]:
    """The same of a ``value`` whose inputs are rows."""
    followed, rate = _along(Rows(value.graph), value, rates, 1)
    return followed, rate


def followed_within(value: Node, rates: Rates) -> FunctionType:
    """A ``value`` whose inputs are rows, how fast it changes, and what is *watched*, where it
    may bend or jump: the differences of what it compares, each with its rate (``compared``,
    an attribute, how many), and how fast that changes, relative to the change that counts,
    which it takes a function of or divides by (``bent``, how many)."""
    rows, graph = Rows(value.graph), value.graph
    along = Tangents(graph, {getattr(rows, name): rate for name, rate in rates(rows).items()})
    rate = along.of({"": value})[""]
    compared: dict[Node, None] = {}
    bent: dict[Node, None] = {}
    for node in graph.live([value]):
        if node.region:
            continue  # in a part that is skipped where it is not needed
        if node.op in ("lt", "le", "gt", "ge", "eq", "max", "min"):
            compared[node.args[0] - node.args[1]] = None
        elif node.op == "abs":
            compared[node.args[0]] = None
        elif node.op == "result":
            bent |= dict.fromkeys(along.of({f"{k}": arg for k, arg in enumerate(node.args)}).values())
        elif node.op in ("sqrt", "div"):
            changes = along.of({"": node.args[-1]})[""]
            bent |= {} if changes.zero else {changes / node.args[-1]: None}
    pairs = [(node, change) for node in compared if not (change := along.of({"": node})[""]).zero]
    varying = [node for node in bent if node.op != "const" and not node.zero]
    function = function_of("within", [value, rate, *(one for pair in pairs for one in pair), *varying])
    vars(function).update(compared=len(pairs), bent=len(varying))
    return function


def followed_twice(quantity: Quantity, rates: Rates) -> tuple[FunctionType, FunctionType, FunctionType]:
    """The same with the second derivative."""
    rows = Rows(Graph())
    value, rate, curvature = _along(rows, rows.graph.node(quantity(rows)), rates, 2)
    return value, rate, curvature


def _along(rows: Rows, value: Node, rates: Rates, orders: int) -> list[FunctionType]:
    found = [value]
    known = rates(rows)
    along = Tangents(rows.graph, {getattr(rows, name): rate for name, rate in known.items()})
    for _ in range(orders):
        found.append(along.of({"": found[-1]})[""])
    functions = [function_of("quantity", [node]) for node in found]
    read = {node.extra for node in along.followed(found[:-1]) if node.op == "input"}
    for function in functions:
        vars(function)["constant"] = frozenset(read - set(known))
    return functions


def function_of(name: str, wanted: Sequence[Node], known: Mapping[str, Node] | None = None) -> FunctionType:
    """The function of numbers that gives the values ``wanted``, with sums in their
    order; its arguments are the rows that they read, and in place of what is ``known``
    the rows of these names."""
    _, found = settled(wanted[0].graph, {f"{k}": node for k, node in enumerate(wanted)} | dict(known or {}))
    arguments = {found.pop(row): row for row in known or ()}
    values = list(found.values())
    rows = values[0].graph.live(values, until=arguments)
    return written_out(name, values, arguments | {row: row.extra for row in rows if row.op == "input"})


def written_out(name: str, wanted: Sequence[Node], arguments: Mapping[Node, str]) -> FunctionType:
    """The function of numbers that gives the values ``wanted``, with its ``arguments``
    in place of these nodes."""
    known, space = dict(arguments), {"np": np, "fma": fma}
    lines: list[str] = []
    calls: dict[str, list[str]] = {}  # the names of the results of each
    graph = wanted[0].graph
    for node in graph.live(wanted, until=known):
        a = [known[arg] for arg in node.args]
        known[node] = f"v{node.id}"
        if node.op == "const":
            known[node] = f"({node.extra!r})"
        elif node.op == "result":
            function, number = node.extra
            call = f"{function.name}({', '.join(a[: function.arguments])})"
            if call not in calls:
                space[function.name] = function.scalar
                calls[call] = [f"r{len(calls)}_{k}" for k in range(function.results)]
                lines.append(f"    {', '.join(calls[call])} = {call}")
            known[node] = calls[call][number]
        else:
            lines.append(f"    {known[node]} = {written(node.op, a)}")
    returned = ", ".join(known[node] for node in wanted)
    text = f"def {name}({', '.join(arguments.values())}):\n" + "\n".join(lines)
    return inlined(define(name, f"{text}\n    return {returned}\n", **space))


_ARRAYS: dict[str, Callable[..., Array]] = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative,
    "abs": np.abs, "sqrt": np.sqrt, "max": np.maximum, "min": np.minimum, "lt": np.less,
    "le": np.less_equal, "gt": np.greater, "ge": np.greater_equal, "eq": np.equal,
    "and": np.logical_and, "or": np.logical_or, "not": np.logical_not, "select": np.where,
    "join": np.where, "fma": lambda a, b, c: a * b + c, "fixed": lambda a: a,
}  # fmt: skip


def on_arrays(quantities: Callable[[Rows], Mapping[str, Number]], given: Mapping[str, Any]) -> dict[str, Any]:
    """The ``quantities`` of rows that are ``given`` as numbers or arrays."""
    return values(_traced(quantities), given)


@lru_cache
def _traced(quantities: Callable[[Rows], Mapping[str, Number]]) -> Mapping[str, Node]:
    graph = Graph()
    return {name: graph.node(value) for name, value in quantities(Rows(graph)).items()}


def values(wanted: Mapping[str, Node], given: Mapping[str, Any]) -> dict[str, Any]:
    """The values of nodes on arrays; ``given`` are the graph's inputs by name."""
    found: dict[Node, Any] = {}
    calls: dict[tuple[Library, tuple[Node, ...]], Any] = {}
    with np.errstate(all="ignore"):  # also in regions where nothing needs them
        for node in _needed(tuple(wanted.values())):
            a = [found[arg] for arg in node.args]
            if node.op == "const":
                found[node] = node.extra
            elif node.op == "input":
                found[node] = given[node.extra]
            elif node.op == "result":
                function, number = node.extra
                key = function, node.args
                if key not in calls:
                    made = function.array(*a)
                    calls[key] = made if function.results > 1 else (made,)
                found[node] = calls[key][number]
            else:
                found[node] = _ARRAYS[node.op](*a)
    return {name: found[node] for name, node in wanted.items()}


@lru_cache
def _needed(wanted: tuple[Node, ...]) -> list[Node]:
    """The nodes that these need, in order."""
    return wanted[0].graph.live(wanted) if wanted else []
