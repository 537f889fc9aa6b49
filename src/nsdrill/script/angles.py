"""The states of a model that may grow without bound while its motion repeats: those that
nothing reads, as an angle that is only counted, and angles, which everything reads through
sine and cosine alone, so that a revolution more is the same."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.library import sincos

REVOLUTION = 2.0 * math.pi
LINEAR = ("neg", "add", "sub", "mul")


def unread_in(graph: Graph, outputs: Iterable[Node], states: Iterable[str]) -> tuple[str, ...]:
    """The states on which none of the ``outputs`` depends."""
    inputs = graph.inputs_of(outputs)
    return tuple(name for name in states if f"s.{name}" not in inputs)


def turning_in(graph: Graph, outputs: Iterable[Node], states: Iterable[str]) -> tuple[str, ...]:
    """The states that the ``outputs`` read through sines and cosines of whole multiples
    alone."""
    ends = tuple(outputs)
    nodes = graph.live(ends)
    inputs = {node.extra for node in nodes if node.op == "input"}
    return tuple(name for name in states if f"s.{name}" in inputs and _turns(nodes, ends, f"s.{name}"))


def _turns(nodes: Iterable[Node], outputs: Iterable[Node], name: str) -> bool:
    multiples: dict[Node, float] = {}  # how often a value has the state in it
    for node in nodes:
        if node.op == "input" and node.extra == name:
            multiples[node] = 1.0
            continue
        found = [multiples.get(one, 0.0) for one in node.args]
        if not any(found) or _is_sine(node):
            continue
        multiple = _multiple(node, found)
        if multiple is None or multiple != round(multiple):
            return False
        multiples[node] = multiple
    return not any(multiples.get(one, 0.0) for one in outputs)


def _is_sine(node: Node) -> bool:
    return node.op == "result" and isinstance(node.extra, tuple) and node.extra[0] is sincos


def _multiple(node: Node, found: list[float]) -> float | None:
    """The multiple of the state in a sum, a difference or a product with a number; None in
    anything else."""
    if node.op not in LINEAR:
        return None
    if node.op == "neg":
        return -found[0]
    if node.op in ("add", "sub"):
        return found[0] + (found[1] if node.op == "add" else -found[1])
    for multiple, other in zip(found, node.args[::-1], strict=True):
        if multiple and other.op == "const":
            return multiple * float(other.extra)
    return None


def near_last(returns: Array) -> Array:
    """Angles at returns [n, returns], each by whole revolutions within half of one of the
    last that is there."""
    last = np.take_along_axis(returns, np.maximum(np.sum(np.isfinite(returns), axis=1) - 1, 0)[:, None], axis=1)
    return returns - REVOLUTION * np.round((returns - last) / REVOLUTION)


def without_revolutions(features: Mapping[str, Array], angle: str) -> dict[str, Array]:
    """The greatest, least and mean value of an angle, by whole revolutions as near to zero
    as its mean can be; of one that turns all are zero."""
    names = [f"{angle}_{end}" for end in ("max", "min", "mean")]
    high, low, mean = (features[name] for name in names)
    turns = high - low > REVOLUTION
    whole = REVOLUTION * np.round(mean / REVOLUTION)
    return {name: np.where(turns, 0.0, features[name] - whole) for name in names}
