"""From a graph to lane code (:mod:`nsdrill.compiler.language`): a function of the lane buffer.

The code is a sequence of *pieces*, loops over the lanes of about a hundred operations
each: a processor works on two vectors at once only if they are near in the code, and a
long piece has more values than there are registers. A value that a later piece needs
goes to its *home*, a row of memory that several values use one after the other. A
region is a sequence of pieces that is skipped where no lane needs it.

Order, pieces and homes change no bit of a result.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np

from nsdrill.compiler.functions import Source, fma, local
from nsdrill.equations.graph import LEAVES, TRUTHS, Graph, Node
from nsdrill.equations.library import Library

PIECE = 200
LEAST_PIECE = 60
ANYWHERE = TRUTHS | {"neg", "fixed"}  # written where they are used, as they cost little
NOWHERE = LEAVES | ANYWHERE | {"either", "variable"}  # in no piece
WINDOW = 0.35  # of a piece: how far from equal shares a cut may be


@dataclass(eq=False)
class Piece:
    """A loop over the lanes, of some nodes. ``copies`` are pairs (node,
    value): the home of the node takes that value at the end."""

    nodes: list[Node] = field(default_factory=list)
    copies: list[tuple[Node, Node]] = field(default_factory=list)
    flag: Node | None = None  # whether it holds in some lane is found here
    stores: list[tuple[str, Node]] = field(default_factory=list)  # outputs that are also read
    number: int = 0


class Region(NamedTuple):
    """A region whose nodes are in order, with the one in its place where no lane needs
    it."""

    number: int
    inside: list[Node | Region]
    other: list[Node | Region]


@dataclass(eq=False)
class Block:
    """The program of a region, with that of the one in its place."""

    region: int
    inside: list[Piece | Block]
    other: list[Piece | Block]
    following: Piece | None = None  # of a loop: the variables take their next values


def lane_code(name: str, graph: Graph, outputs: Mapping[str, Node], place: Mapping[str, int], lanes: int) -> Source:
    """The function ``name(b)`` that computes ``outputs`` from the inputs of the graph;
    ``place`` gives the row of each by its name."""
    return _Writer(graph, outputs, place, lanes).function(name)


def _schedule(graph: Graph, outputs: Mapping[str, Node]) -> list[Node | Region]:
    """Nodes and regions in an order in which each follows what it needs."""
    needed = graph.live(outputs.values())
    first = {other: region for region, other in graph.otherwise.items()}

    def item(node: Node, within: int) -> Node | int | None:
        """The node, or the number of the region directly inside ``within`` that has it;
        None if it is not inside."""
        region = node.region
        if region == within:
            return node
        while region >= 0 and graph.parent[region] != within:
            region = graph.parent[region]
        return None if region < 0 else first.get(region, region)

    def level(within: int) -> list[Node | Region]:
        members: dict[Node | int, list[Node]] = {}
        for node in needed:
            if (it := item(node, within)) is not None:
                members.setdefault(it, []).append(node)
        needs: dict[Node | int, set[Node | int]] = {}
        for it, nodes in members.items():
            args = {arg for node in nodes for arg in node.args}
            if isinstance(it, int) and it not in graph.loops:
                condition = graph.condition[it]
                assert condition is not None
                args.add(condition)
            needs[it] = {at for arg in args if (at := item(arg, within)) is not None} - {it}
        users: dict[Node | int, list[Node | int]] = {it: [] for it in members}
        for it, others in needs.items():
            for other in others:
                users[other].append(it)
        ready = [(members[it][0].id, k, it) for k, it in enumerate(members) if not needs[it]]
        heapq.heapify(ready)
        order: list[Node | Region] = []
        count = len(members)
        while ready:
            _, _, it = heapq.heappop(ready)
            if isinstance(it, int):
                instead = graph.otherwise.get(it)
                order.append(Region(it, level(it), level(instead) if instead else []))
            else:
                order.append(it)
            for user in users[it]:
                needs[user].discard(it)
                if not needs[user]:
                    count += 1
                    heapq.heappush(ready, (members[user][0].id, count, user))
        assert len(order) == len(members), "a region needs what depends on it"
        return order

    return level(0)


class _Writer:
    def __init__(self, graph: Graph, outputs: Mapping[str, Node], place: Mapping[str, int], lanes: int) -> None:
        self.graph, self.outputs, self.place, self.lanes = graph, outputs, place, lanes
        self.size = max(LEAST_PIECE, PIECE * 16 // lanes)
        self.functions: dict[str, object] = {}
        self.found: set[Node | None] = set()  # conditions of which it is known whether they hold
        self.program = self._program(_schedule(graph, outputs))
        rows = {place[node.extra] for node in graph.live(outputs.values()) if node.op == "input"}
        # What is stored where a value is made: (row, the value or what is made of it).
        self.stored: dict[Node, list[tuple[int, Node]]] = {}
        last = Piece()
        for name, node in outputs.items():
            made = node.args[0] if node.op == "neg" else node
            if place[name] in rows or made.op in NOWHERE:
                last.stores.append((name, node))
            else:
                self.stored.setdefault(made, []).append((place[name], node))
        if last.stores:
            self.program.append(last)
        for number, piece in enumerate(_pieces(self.program)):
            piece.number = number
        self.homes, self.rows = self._homes()

    # The program.

    def _program(self, items: Sequence[Node | Region]) -> list[Piece | Block]:
        program: list[Piece | Block] = []
        run: list[Node] = []

        def close() -> Piece:
            """The last piece before a block, with what was collected."""
            program.extend(Piece(nodes) for nodes in self._cut(_together(run)))
            run.clear()
            return _last(program)

        eithers: dict[int, list[Node]] = {}
        for it in items:
            if isinstance(it, Node) and it.op == "either":
                eithers.setdefault(it.extra, []).append(it)
        for it in items:
            if isinstance(it, Region):
                before = close()
                outside = set(self.found)
                block = Block(it.number, self._program(it.inside), self._program(it.other))
                self.found = outside
                loop = self.graph.loops.get(it.number)
                if loop is not None:
                    before.copies += [(node, node.args[0]) for node in loop.variables]
                    _last(block.inside).flag = loop.unfinished
                    block.following = Piece(copies=list(zip(loop.variables, loop.following, strict=True)))
                elif (condition := self.graph.condition[it.number]) not in self.found:
                    before.flag = condition
                    self.found.add(condition)
                for node in eithers.get(it.number, []):
                    _last(block.inside).copies.append((node, node.args[0]))
                    _last(block.other).copies.append((node, node.args[1]))
                program.append(block)
            elif it.op not in NOWHERE:
                run.append(it)
        if run:
            close()
        return program

    def _cut(self, items: list[Node]) -> Iterator[list[Node]]:
        """Pieces of about equal size, cut where few values cross."""
        sizes = [_size([it]) for it in items]
        count = round(sum(sizes) / self.size)
        if count < 2:
            if items:
                yield items
            return
        at = {node: k for k, node in enumerate(items)}
        until = dict.fromkeys(at, len(items))  # values may be needed after all of them
        last: dict[Node, int] = {}
        for k, node in enumerate(items):
            for arg in self._read(node.args):
                if arg in at:
                    last[arg] = k
        until |= last
        begun_and_over = [0] * (len(items) + 2)
        for node, k in at.items():
            begun_and_over[k + 1] += 1
            begun_and_over[until[node] + 1] -= 1
        crossing = list(accumulate(begun_and_over))  # values, of a cut before each place
        reached = list(accumulate(sizes, initial=0))
        cuts = [0]
        for share in range(1, count):
            target = reached[-1] * share / count
            places = [
                j
                for j in range(cuts[-1] + 1, len(items))
                if abs(reached[j] - target) <= WINDOW * self.size and not _one_call(items[j - 1], items[j])
            ]
            if places:
                cuts.append(min(places, key=lambda j: (crossing[j], abs(reached[j] - target))))
        for begin, end in pairwise([*cuts, len(items)]):
            yield items[begin:end]

    def _own_row(self, node: Node) -> int | None:
        """The row of the buffer that has the value, as it is an output."""
        return next((row for row, stored in self.stored.get(node, ()) if stored is node), None)

    def _read(self, nodes: Iterable[Node]) -> Iterator[Node]:
        """What is in registers or at home when ``nodes`` are used."""
        for node in nodes:
            if node.op in ANYWHERE:
                yield from self._read(node.args)
            elif node.op not in LEAVES:
                yield node

    def _homes(self) -> tuple[dict[Node, int], int]:
        """The home of each value that another piece needs, and the number of homes."""
        made: dict[Node, int] = {}
        last: dict[Node, int] = {}
        loops: list[tuple[int, int]] = []

        def use(nodes: Iterable[Node], number: int) -> None:
            for node in self._read(nodes):
                last[node] = max(last.get(node, -1), number)

        def visit(program: Sequence[Piece | Block]) -> None:
            for it in program:
                if isinstance(it, Piece):
                    for node in it.nodes:
                        use(node.args, it.number)
                        made[node] = it.number
                    for node, value in it.copies:
                        use([value], it.number)
                        made.setdefault(node, it.number - 1)
                        last.setdefault(node, it.number)
                    use([it.flag] if it.flag is not None else [], it.number)
                    use([node for _, node in it.stores], it.number)
                    continue
                visit(it.inside)
                visit(it.other)
                if it.following:
                    visit([it.following])
                    begin = min(piece.number for piece in _pieces(it.inside))
                    loops.append((begin, it.following.number))

        visit(self.program)
        crossing = [
            node for node, number in made.items() if last.get(node, -1) > number and self._own_row(node) is None
        ]
        for begin, end in loops:
            for node in crossing:  # what a loop reads, its next turn reads as well
                if made[node] < begin <= last[node]:
                    last[node] = max(last[node], end)
        homes: dict[Node, int] = {}
        free: list[int] = []
        taken: list[tuple[int, int]] = []
        rows = 0
        for node in sorted(crossing, key=lambda node: (made[node], node.id)):
            for entry in [entry for entry in taken if entry[0] < made[node]]:
                taken.remove(entry)
                free.append(entry[1])
            homes[node] = free.pop() if free else rows
            rows += homes[node] == rows
            taken.append((last[node], homes[node]))
        return homes, rows

    # The text.

    def function(self, name: str) -> Source:
        lines = [f"def {name}(b):"]
        if self.rows:
            lines.append(f"    home = local({self.rows * self.lanes})")
        lines += self._text(self.program, 1)
        space = {"np": np, "fma": fma, "local": local, **self.functions}
        return Source(name, f"W = {self.lanes}\n" + "\n".join(lines) + "\n", space)

    def _text(self, program: Sequence[Piece | Block], depth: int) -> list[str]:
        lines: list[str] = []
        for it in program:
            lines += self._piece(it) if isinstance(it, Piece) else self._block(it)
        return ["    " * depth + line for line in lines]

    def _block(self, block: Block) -> list[str]:
        if block.following:
            loop = self.graph.loops[block.region]
            return [
                "turns = 0",
                "again = True",
                "while again:",
                *self._text(block.inside, 1),
                "    turns += 1",
                f"    again = {_flag(loop.unfinished)} != 0 and turns < {loop.most}",
                "    if again:",
                *self._text([block.following], 2),
            ]
        other = ["else:", *self._text(block.other, 1)] if block.other else []
        condition = self.graph.condition[block.region]
        assert condition is not None
        return [f"if {_flag(condition)} != 0:", *(self._text(block.inside, 1) or ["    pass"]), *other]

    def _piece(self, piece: Piece) -> list[str]:
        self.known: dict[Node, str] = {}
        self.calls: dict[tuple[Library, tuple[Node, ...]], list[str]] = {}
        self.body: list[str] = []
        for node in piece.nodes:
            self._make(node)
        for node, value in piece.copies:
            self.body.append(f"home[{self._row(self.homes[node])} + i] = {self._name(value)}")
        for name, node in piece.stores:
            self.body.append(f"b[{self._row(self.place[name])} + i] = {self._name(node)}")
        before = []
        if piece.flag is not None:
            flag = _flag(piece.flag)
            before = [f"{flag} = 0"]
            self.body.append(f"{flag} |= 1 if {self._name(piece.flag)} else 0")
        if not self.body:
            return []
        return [*before, "for i in packed(W):", *("    " + line for line in self.body)]

    def _row(self, row: int) -> str:
        return f"{row * self.lanes}"

    def _name(self, node: Node) -> str:
        """What stands for a value in the present piece."""
        if node.op == "const":
            return repr(node.extra) if node.extra >= 0.0 else f"({node.extra!r})"
        if node.op in ANYWHERE:
            return f"({self._operation(node)})"
        if node not in self.known:
            array, row = "home", self.homes.get(node, -1)
            if node.op == "input":
                array, row = "b", self.place[node.extra]
            elif (kept := self._own_row(node)) is not None:
                array, row = "b", kept
            assert row >= 0, f"{node} has no home"
            self.known[node] = f"{'x' if array == 'b' else 'v'}{node.id}"
            self.body.append(f"{self.known[node]} = {array}[{self._row(row)} + i]")
        return self.known[node]

    def _make(self, node: Node) -> None:
        if node.op == "result":
            self._call(node)
        else:
            text = self._operation(node)
            self.known[node] = f"v{node.id}"
            self.body.append(f"v{node.id} = {text}")
        for row, stored in self.stored.get(node, ()):
            self.body.append(f"b[{self._row(row)} + i] = {self._name(stored)}")
        if node in self.homes:
            self.body.append(f"home[{self._row(self.homes[node])} + i] = {self.known[node]}")

    def _call(self, node: Node) -> None:
        """The call that gives this result, and all its others."""
        function = node.extra[0]
        key = (function, node.args)
        if key not in self.calls:
            given = ", ".join(self._name(arg) for arg in node.args[: function.arguments])
            self.calls[key] = [f"r{node.id}_{k}" for k in range(function.results)]
            self.functions[function.name] = function.scalar
            self.body.append(f"{', '.join(self.calls[key])} = {function.name}({given})")
        self.known[node] = self.calls[key][node.extra[1]]

    def _operation(self, node: Node) -> str:
        return written(node.op, [self._name(arg) for arg in node.args])


# How operations are written.
INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<=", "gt": ">",
          "ge": ">=", "eq": "==", "and": "and", "or": "or"}  # fmt: skip
FORMS = {"neg": "-{0}", "fixed": "{0}", "not": "not {0}", "abs": "abs({0})", "sqrt": "np.sqrt({0})",
          "fma": "fma({0}, {1}, {2})", "max": "max({0}, {1})", "min": "min({0}, {1})",
          "select": "{1} if {0} else {2}", "join": "{1} if {0} else {2}"}  # fmt: skip


def written(op: str, a: list[str]) -> str:
    """The text of an operation on the values that ``a`` names."""
    return f"{a[0]} {INFIX[op]} {a[1]}" if op in INFIX else FORMS[op].format(*a)


def _flag(condition: Node) -> str:
    """The name of the number that says whether a condition holds in some lane."""
    return f"some_{condition.id}"


def _pieces(program: Sequence[Piece | Block]) -> Iterator[Piece]:
    for it in program:
        if isinstance(it, Piece):
            yield it
        else:
            yield from _pieces(it.inside)
            yield from _pieces(it.other)
            if it.following:
                yield it.following


def _size(nodes: list[Node]) -> int:
    """How many operations that is."""
    calls = {(node.extra[0], node.args) for node in nodes if node.op == "result"}
    plain = sum(node.op != "result" for node in nodes)
    return plain + sum(function.operations for function, _ in calls)


def _last(program: list[Piece | Block]) -> Piece:
    """The piece at the end, made where a block is there."""
    last = program[-1] if program else None
    if isinstance(last, Piece):
        return last
    made = Piece()
    program.append(made)
    return made


def _one_call(one: Node, other: Node) -> bool:
    return one.op == other.op == "result" and (one.extra[0], one.args) == (other.extra[0], other.args)


def _together(nodes: list[Node]) -> list[Node]:
    """The results of one call side by side."""
    calls: dict[tuple[Library, tuple[Node, ...]], list[Node]] = {}
    for node in nodes:
        if node.op == "result":
            calls.setdefault((node.extra[0], node.args), []).append(node)
    out: list[Node] = []
    for node in nodes:
        if node.op != "result":
            out.append(node)
        elif (group := calls[node.extra[0], node.args])[0] is node:
            out += group
    return out
