"""Where the slopes of a model jump: at which of its conditions. Runs are right there,
within their tolerance; a deviation would have to jump too, and is not followed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.consequences import Consequences
from nsdrill.equations.graph import Node
from nsdrill.equations.passes import Tangents

PROBES = 200
NEAR = 1e-9  # of its side of a condition, over the size of what is compared
JUMP = 1e-5  # of the size of a slope, above rounding and what a slope changes by over NEAR
ITERATIONS = 8
COMPARISONS = frozenset({"lt", "le", "gt", "ge", "eq"})  # eq of a number that an `if` has as its condition


def jumps_in(slopes: Consequences, probes: Mapping[str, Any], where: str) -> tuple[str, ...]:
    """The conditions at which slopes jump, in words with the place ``where`` the equations
    stand. ``probes`` are inputs of the graph, of :data:`PROBES` places each or numbers."""
    found: dict[str, None] = {}
    comparisons = [node for node in slopes.graph.live(slopes.slopes.values()) if node.op in COMPARISONS]
    for node in comparisons:
        if _jumps(slopes, probes, node):
            states = sorted(name.removeprefix("s.") for name in slopes.graph.inputs_of([node]) if name.startswith("s."))
            read = " and ".join(states) or "the time"
            found[f"a condition on {read} ({where})"] = None
    return tuple(found)


def probes_around(start: Mapping[str, float]) -> tuple[dict[str, Array], dict[str, Array]]:
    """(states around the ``start``, the phase and the time) at :data:`PROBES` places."""
    rng = np.random.default_rng(3)
    states = {name: value + (abs(value) + 1.0) * rng.uniform(-1.5, 1.5, PROBES) for name, value in start.items()}
    phase = rng.uniform(0.0, 2.0 * np.pi, PROBES)
    return states, {"phase": phase, "time": rng.uniform(0.0, 10.0, PROBES)}


def _jumps(slopes: Consequences, probes: Mapping[str, Any], condition: Node) -> bool:
    """Whether a slope differs on the two sides of a condition, just beside it."""
    graph = slopes.graph
    depths = {node: node.args[0] for node in graph.live([condition]) if node.op == "max" and node.extra in graph.gaps}
    # a depth is zero on one whole side of where its gap is
    (difference,) = graph.substituted([condition.args[0] - condition.args[1]], depths, {})
    inputs = [f"s.{name}" for name in slopes.states] + ["phase", "time"]
    gradients = {}
    for name in inputs:
        gradients[name] = Tangents(graph, {graph.input(name): 1.0}).of({"": difference})[""]
    sides = [_beside(probes, difference, gradients, side) for side in (1.0, -1.0)]
    at, valid = [one[0] for one in sides], sides[0][1] & sides[1][1]
    if not valid.any():
        return False
    one, other = (plain.values(slopes.slopes, given) for given in at)
    for name in slopes.slopes:
        a, b = (np.broadcast_to(np.asarray(values[name], float), PROBES)[valid] for values in (one, other))
        size = np.maximum(np.abs(a), np.abs(b))
        off = np.abs(a - b)
        if np.any(off > JUMP * (size + np.median(size))) and np.any(off > 1e-12):
            return True
    return False


def _beside(
    probes: Mapping[str, Any], difference: Node, gradients: Mapping[str, Node], side: float
) -> tuple[dict[str, Any], np.ndarray]:
    """The probes, moved to just beside where the difference is zero, and which of them
    came there."""
    given = dict(probes)
    wanted = {"": difference, **gradients}
    value = np.zeros(PROBES)
    target = np.zeros(PROBES)
    for _ in range(ITERATIONS):
        found = {name: np.broadcast_to(np.asarray(v, float), PROBES) for name, v in plain.values(wanted, given).items()}
        size = sum((np.abs(found[name] * given[name]) for name in gradients), np.zeros(PROBES)) + 1e-12
        target, value = side * NEAR * size, found[""]
        square = sum((found[name] ** 2 for name in gradients), np.zeros(PROBES))
        move = np.where(square > 0.0, (target - value) / np.where(square > 0.0, square, 1.0), 0.0)
        given = given | {name: given[name] + move * found[name] for name in gradients}
    final = np.broadcast_to(np.asarray(plain.values({"": difference}, given)[""], float), PROBES)
    return given, np.isfinite(final) & (final * side > 0.0) & (np.abs(final) < 10.0 * np.abs(target))
