"""From a graph to another: what follows the change of some values, and sums in their
order.

In which order sums are added, and which products are fused into them, is a part of the
results: another rule gives other last bits. It depends on the equations only, neither on
lanes nor on the processor, and it stays as it is. The terms of a sum, however it is
parenthesised, are added in the order in which they become known, by the latencies
below; a product that nothing else uses is fused, ``fma(a, b, sum)``. Where the order of
additions matters, equations call a function of :mod:`.library` or write ``fma``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Iterable, Mapping, Sequence

from nsdrill.equations.graph import TRUTHS, Graph, Node, rewritten

# Forward-mode differentiation.


Nodes = Sequence[Node]
UNCHANGED = TRUTHS | {"fixed", "variable"}
TINY = 1e-150  # in place of the root of zero, where its argument does not change either


def closed(name: str) -> str:
    """The input that says by a positive number that a contact counts as closed."""
    return f"closed_{name}"


class Tangents:
    """The changes of nodes that follow from those of some others, ``seeds``: made in the
    present region, or, in none, where the nodes are.

    A unilateral contact in ``sides`` counts as open or closed, as its input
    :func:`closed` says, so that the derivative does not jump within a step; any other
    as it is. A node in ``instead`` changes as the one that stands there.
    """

    def __init__(
        self,
        graph: Graph,
        seeds: Mapping[Node, Node | float],
        sides: tuple[str, ...] = (),
        instead: Mapping[Node, Node] | None = None,
    ) -> None:
        self.graph, self.sides, self.instead = graph, sides, instead or {}
        self.zero = graph.node(0.0)
        self.found = {node: graph.node(value) for node, value in seeds.items()}
        self.widened: set[int] = set()

    def of(self, outputs: Mapping[str, Node]) -> dict[str, Node]:
        """The changes of ``outputs``."""
        for node in self.followed(outputs.values(), self.found):
            if node in self.instead:
                self.found[node] = self.of({"": self.instead[node]})[""]
            elif node not in self.found:
                with self.graph.inside(self.graph.region or node.region):
                    self.found[node] = self._change(node)
        return {name: self.found[node] for name, node in outputs.items()}

    def followed(self, outputs: Iterable[Node], until: Container[Node] = ()) -> list[Node]:
        """The nodes by whose changes ``outputs`` change, in order, but for those in
        ``until`` and what these alone depend on."""
        seen: set[Node] = set()
        todo = list(outputs)
        while todo:
            node = todo.pop()
            if node not in seen and node not in until:
                seen.add(node)
                if node not in self.instead and node.op not in UNCHANGED:
                    todo += node.args
        return sorted(seen, key=lambda node: node.id)

    def _side(self, node: Node) -> Node | None:
        """Whether the contact counts as closed, if the node is the depth of one."""
        if node.op == "max" and node.extra in self.sides:
            return self.graph.input(closed(node.extra)) > 0.0
        return None

    def _change(self, node: Node) -> Node:
        if node.op in UNCHANGED:
            return self.zero
        changes = [self.found[arg] for arg in node.args]
        if all(change.zero for change in changes):
            return self.zero
        rule: Callable[[Node, Nodes, Nodes], Node] | None = getattr(self, f"_{node.op}", None)
        if rule is None:
            raise TypeError(f"no rule for the derivative of {node.op}")
        return rule(node, node.args, changes)

    def _add(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return d[0] + d[1]

    def _sub(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return d[0] - d[1]

    def _neg(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return -d[0]

    def _product(self, a: Node, b: Node) -> Node:
        return self.zero if a.zero or b.zero else a * b

    def _mul(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return self._product(args[0], d[1]) + self._product(args[1], d[0])

    def _fma(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return self._mul(node, args, d) + d[2]

    def _div(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return (d[0] - self._product(node, d[1])) / args[1]

    def _sqrt(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return d[0] * (0.5 / self.graph.make("max", node, TINY))

    def _abs(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return self.graph.select(args[0] < 0.0, -d[0], d[0])

    def _max(self, node: Node, args: Nodes, d: Nodes) -> Node:
        side = self._side(node)
        side = args[0] > args[1] if side is None else side
        return self.graph.select(side, d[0], d[1])

    def _min(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return self.graph.select(args[0] < args[1], d[0], d[1])

    def _select(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return self.graph.select(args[0], d[1], d[2])

    def _either(self, node: Node, args: Nodes, d: Nodes) -> Node:
        return self.graph.make("either", d[0], d[1], extra=node.extra)

    def _result(self, node: Node, args: Nodes, d: Nodes) -> Node:
        function, number = node.extra
        results = function.nodes(self.graph, args)
        total = self.zero
        for partial, change in zip(function.derivatives(args, results)[number], d, strict=True):
            if not change.zero:
                if partial is None:
                    raise TypeError(f"{function.name}: no rule for this derivative")
                total = total + self._product(self.graph.node(partial), change)
        return total

    def _join(self, node: Node, args: Nodes, d: Nodes) -> Node:
        condition, region = args[0], node.extra
        side = self._side(condition.args[0]) if condition.op == "gt" else None
        if side is not None:
            if region not in self.widened:  # a lane needs it on either account
                self.widened.add(region)
                self.graph.condition[region] = condition | side
            condition = side
        return self.graph.make("join", condition, d[1], d[2], extra=region)


# Sums in their order.


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
