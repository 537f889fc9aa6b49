"""What values of a graph depend on, where some of its inputs are zero."""

from __future__ import annotations

from collections.abc import Container, Iterable

from nsdrill.equations.graph import Node

# Operations that give zero where all their arguments are zero.
LINEAR = frozenset({"add", "sub", "neg", "abs", "sqrt", "max", "min", "fixed"})
NOTHING: frozenset[str] = frozenset()


def dependences(outputs: Iterable[Node], zeros: Container[str]) -> dict[Node, frozenset[str] | None]:
    """The names of the inputs on which each node that ``outputs`` need depends, None
    where it is zero, as the inputs in ``zeros`` are. Never too few: a difference of two
    equal values counts as depending on them."""
    found: dict[Node, frozenset[str] | None] = {}
    outputs = list(outputs)
    for node in outputs[0].graph.live(outputs):
        a = [found[arg] for arg in node.args]
        if node.op == "input":
            found[node] = None if node.extra in zeros else frozenset({node.extra})
        elif (
            node.zero
            or (node.op == "mul" and None in a)
            or (node.op == "div" and a[0] is None)
            or (node.op == "fma" and None in a[:2] and a[2] is None)
            or (node.op in ("select", "join") and a[1] is None and a[2] is None)
            or (node.op in LINEAR and not any(one is not None for one in a))
        ):
            found[node] = None
        else:
            read = a[2:] if node.op == "fma" and None in a[:2] else a
            found[node] = NOTHING.union(*(one for one in read if one is not None))
    return found
