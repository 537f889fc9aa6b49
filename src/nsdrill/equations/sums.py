"""In which order sums are added, and which products are fused into them.

This is a part of the results: another rule gives other last bits. It depends on the
equations only, neither on lanes nor on the processor, and it stays as it is; a change
raises ``RULE``.

The terms of a sum, however it is parenthesised, are added in the order in which they
become known, by the latencies below; a product that nothing else uses is fused,
``fma(a, b, sum)``. Where the order of additions matters, equations call a function of
:mod:`.library` or write ``fma``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping

from nsdrill.equations.graph import Graph, Node, rewritten

RULE = 1
# Cycles of recent processors; only the order matters.
LATENCY = {"const": 0, "input": 0, "neg": 0, "select": 2, "join": 2, "either": 0, "max": 3,
           "min": 3, "abs": 1, "div": 13, "sqrt": 20, "result": 40}  # fmt: skip
OTHERS = 4


def settled(graph: Graph, outputs: Mapping[str, Node]) -> tuple[Graph, dict[str, Node]]:
    """The graph with all sums in their order. Its operations are settled: what is added
    to the graph afterwards, and settled again, does not change them."""
    uses = Counter(outputs.values())
    for node in graph.live(outputs.values()):
        uses.update(node.args)
    for loop in graph.loops.values():
        uses.update(loop.needs * 2)  # none of them is fused
    ready: dict[Node, int] = {}

    def alone(node: Node, ops: tuple[str, ...], region: int) -> bool:
        """Whether a node of these ``ops`` is a part of one other operation only."""
        return node.op in ops and uses[node] == 1 and node.region == region and not node.settled

    def terms(node: Node, sign: int, region: int) -> list[tuple[int, Node]]:
        if node.op == "neg":
            parts = [(-sign, node.args[0])]
        else:
            parts = [(sign, node.args[0]), (-sign if node.op == "sub" else sign, node.args[1])]
        return [
            term
            for sign, part in parts
            for term in (terms(part, sign, region) if alone(part, ("add", "sub", "neg"), region) else [(sign, part)])
        ]

    def total(new: Graph, of: Callable[[Node], Node], node: Node) -> tuple[Node, int]:
        parts = []
        for place, (sign, term) in enumerate(terms(node, 1, node.region)):
            operands = term.args if alone(term, ("mul",), node.region) else (term,)
            made = [of(operand) for operand in operands]
            parts.append((max(ready[factor] for factor in made), place, sign, made))
        parts.sort(key=lambda part: part[:2])
        first = next((k for k, part in enumerate(parts[:2]) if len(part[3]) == 1 and part[2] > 0), 0)
        time, _, sign, factors = parts.pop(first)
        time += OTHERS * (len(factors) - 1)
        value = factors[0] if len(factors) == 1 else new.mul(*factors)
        value = value if sign > 0 else new.neg(value)
        for when, _, sign, factors in parts:
            if len(factors) == 2:
                a, b = factors
                value = new.make("fma", a if sign > 0 else new.neg(a), b, value)
            else:
                value = new.add(value, factors[0]) if sign > 0 else new.sub(value, factors[0])
            time = max(when, time) + OTHERS
        return value, time

    def change(new: Graph, of: Callable[[Node], Node], node: Node) -> Node:
        if node.op in ("add", "sub") and not node.settled:
            made, time = total(new, of, node)
        else:
            args = [of(arg) for arg in node.args]
            made = new.make(node.op, *args, extra=node.extra)
            time = max((ready[arg] for arg in args), default=0) + LATENCY.get(node.op, OTHERS)
        ready[made] = min(time, ready.get(made, time))
        made.settled = True
        return made

    new, result = rewritten(graph, outputs, change)
    for node in new.nodes:
        node.settled = True
        ready.setdefault(node, 0)
    return new, result
