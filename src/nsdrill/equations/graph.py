"""The equations of a model as a graph: operations on values, each value once.

A model's function runs once on nodes (:mod:`nsdrill.equations.trace`). Each operation on
them makes a node, or finds the one that is there. What only some lanes need, as the
forces of a contact that is closed, is in a *region*, which is skipped where no lane
needs it. A value leaves its region by a ``join``.

=============================  =========================================================
``const input``                a number; a state, a parameter, ...; ``extra``: which
``add sub mul div neg abs``    arithmetic, with ``fma``, ``sqrt``, ``max``, ``min``
``lt le gt ge eq``             comparisons, with ``and``, ``or``, ``not`` of them
``select``                     (condition, a, b): a where the condition holds, else b
``result``                     one result of a function of :mod:`.library`
``join``                       (condition, inner, outer): inner, of region ``extra``,
                               where the condition holds, else outer
``either``                     (inner, other): the value of the region ``extra`` or, where
                               no lane needs that, of the region in place of it
``variable``                   (start): what the loop ``extra`` repeats
``fixed``                      (value): the value, which a deviation does not change
=============================  =========================================================
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, NoReturn

import numpy as np

TRUTHS = frozenset({"lt", "le", "gt", "ge", "eq", "and", "or", "not"})
LOGIC = frozenset({"and", "or", "not", "select", "join", "fixed"})  # of truths, too
LEAVES = frozenset({"const", "input"})
GIVEN = ("p.", "n.")  # begin the inputs that are numbers of a run: lane parameters, numbers of a law
MOST_NODES = 500_000  # fifty times the largest string: equations with more do not end


class Refused(TypeError):
    """What equations do and lanes cannot, with the ``line`` and the ``source`` of it where
    these are not those that raise this."""

    def __init__(self, text: str, line: int = 0, source: str = "") -> None:
        super().__init__(text)
        self.line, self.source = line, source


class Node:
    """A value of a graph. ``settled`` says that :func:`.passes.settled` keeps its
    operation as it stands; ``needs`` are the regions, not around its own, that it depends
    on."""

    __slots__ = ("args", "extra", "graph", "id", "needs", "op", "region", "settled")

    def __init__(self, graph: Graph, op: str, args: tuple[Node, ...], extra: Any, region: int) -> None:
        self.graph, self.op, self.args, self.extra, self.region = graph, op, args, extra, region
        self.id, self.settled = len(graph.nodes), False
        self.needs: frozenset[int] = graph.needs(args, region)

    # fmt: off
    def __add__(self, other: Number) -> Node: return self.graph.add(self, other)
    def __radd__(self, other: Number) -> Node: return self.graph.add(other, self)
    def __sub__(self, other: Number) -> Node: return self.graph.sub(self, other)
    def __rsub__(self, other: Number) -> Node: return self.graph.sub(other, self)
    def __mul__(self, other: Number) -> Node: return self.graph.mul(self, other)
    def __rmul__(self, other: Number) -> Node: return self.graph.mul(other, self)
    def __truediv__(self, other: Number) -> Node: return self.graph.div(self, other)
    def __rtruediv__(self, other: Number) -> Node: return self.graph.div(other, self)
    def __neg__(self) -> Node: return self.graph.neg(self)
    def __abs__(self) -> Node: return self.graph.abs(self)
    def __lt__(self, other: Number) -> Node: return self.graph.make("lt", self, other)
    def __le__(self, other: Number) -> Node: return self.graph.make("le", self, other)
    def __gt__(self, other: Number) -> Node: return self.graph.make("gt", self, other)
    def __ge__(self, other: Number) -> Node: return self.graph.make("ge", self, other)
    def __and__(self, other: Node) -> Node: return self.graph.make("and", self, other)
    def __or__(self, other: Node) -> Node: return self.graph.make("or", self, other)
    # fmt: on

    def __pos__(self) -> Node:
        return self

    def __eq__(self, other: object) -> Any:
        """While equations run, whether the values are equal in a lane; else whether this
        is the same node."""
        return self.graph.equal(self, other) if self.graph.is_open else NotImplemented

    def __ne__(self, other: object) -> Any:
        return self.graph.make("not", self == other) if self.graph.is_open else NotImplemented

    __hash__ = object.__hash__

    @property  # type: ignore[misc]
    def __class__(self) -> type:  # so that equations find a number in it, as in a float
        return float if self.graph.is_open else Node

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **named: Any) -> Any:
        """What numpy's numbers are in an operation with a value, and those of its functions
        that have a derivative (:mod:`.library`)."""
        operation = NUMPY.get(ufunc.__name__)
        if (
            operation is None
            or method != "__call__"
            or named
            or any(np.ndim(one) for one in inputs if type(one) is not Node)
        ):
            if operation is not None and method == "__call__":
                self.graph.refuse(f"found np.{ufunc.__name__} of a value and an array; allowed: elements, one by one")
            self._refuse_function(ufunc.__name__)
        return operation(*(one if type(one) is Node else np.asarray(one).item() for one in inputs))

    def __array_function__(self, function: Any, types: object, given: Any, named: Any) -> Any:
        """What functions of numpy for arrays do, but for those that compare or convert."""
        if function.__name__ in INSTEAD:
            self._refuse_function(function.__name__)
        return function._implementation(*given, **named)

    def _refuse_function(self, name: str) -> NoReturn:
        instead = INSTEAD.get(name)
        self.graph.refuse(f"found np.{name} of a value{f', for which there is {instead}' * bool(instead)}")

    def __pow__(self, exponent: int) -> Node:
        if type(exponent) is Node:
            self.graph.refuse(
                "found a value as a power; allowed: whole numbers, 1, 2, 3, ..., also as a constant of the module"
            )
        if not isinstance(exponent, Real) or exponent != int(exponent) or exponent < 1:
            self.graph.refuse(
                f"found the power {exponent!r}; allowed: 1, 2, 3, ..., sqrt(x) and 1 / x: x**1.5 is x * sqrt(x)"
            )
        value = self
        for _ in range(int(exponent) - 1):
            value = value * self
        return value

    def __bool__(self) -> bool:
        self.graph.refuse(
            "found a condition on a value, which every lane answers for itself; allowed: `a if c else b`, `and`, `or`, "
            "`not`, and an `if` without `return`, `break` and `continue`, in the equations themselves and in functions "
            "marked with `part` of nsdrill.equations.trace; elsewhere, and in a loop, conditions on options. For "
            "all([a, b]) there is `a and b`, for np.max([x, y]) max(x, y)"
        )

    def __float__(self) -> float:
        self.graph.refuse(
            "found a value where a number is wanted, as by math.sin, for which there is np.sin, or in np.zeros(2), "
            "for which there is a list"
        )

    def __round__(self, digits: object = None) -> NoReturn:
        self.graph.refuse(f"found a value that is rounded, for which there is {_JUMPING}")

    def __index__(self) -> int:
        if self.graph.changes(self):
            self.graph.refuse("found a value where a whole number is wanted")
        self.graph.refuse(
            "found a parameter where a whole number is wanted, as of `range`, and it may be another one at each point; "
            "allowed: a constant of the module, as N = 3 above the function"
        )

    __complex__ = __float__
    __int__ = __index__
    __trunc__ = __floor__ = __ceil__ = __round__

    def __str__(self) -> str:
        if self.graph.is_open:
            self.graph.refuse(TEXT)
        return repr(self)

    def __format__(self, form: str) -> str:
        return str(self)

    def __getattr__(self, name: str) -> Any:
        if hasattr(float, name) and not name.startswith("__"):
            self.graph.refuse(f"found .{name} of a value")
        raise AttributeError(f"a value has no {name}", name=name, obj=self)

    def __repr__(self) -> str:
        return f"{self.op}#{self.id}"

    def is_number(self, number: float) -> bool:
        """Whether this is the constant ``number``."""
        return self.op == "const" and bool(self.extra == number)

    @property
    def zero(self) -> bool:
        return self.is_number(0.0)


TEXT = (
    "found a value where a text is wanted, and it has no number while equations are read; allowed: nothing that is "
    "printed or formatted. A trace has what the equations give a name to"
)
_JUMPING = "nothing, as it jumps between steps: sines and cosines take angles of many turns"


def _undefined(symbol: str, instead: str = "") -> Callable[[Node, object], NoReturn]:
    def refuse(self: Node, other: object) -> NoReturn:
        self.graph.refuse(f"unsupported operand: found {symbol} with a value{instead}")

    return refuse


for _name, _symbol in {"mod": "%", "floordiv": "//", "divmod": "divmod"}.items():
    setattr(Node, f"__{_name}__", _undefined(_symbol, f", for which there is {_JUMPING}"))
    setattr(Node, f"__r{_name}__", _undefined(_symbol, f", for which there is {_JUMPING}"))
Node.__rpow__ = _undefined("a power")  # type: ignore[attr-defined]

# What stands in place of other functions of numpy.
_LOGARITHM = "a state with the slope dx / x, where dx is the slope of x"
_CHOICE = "`a if x > 0.0 else b`"
INSTEAD = {
    "sign": "direction(steep * x) of nsdrill.equations.library, and nsdrill.friction",
    "copysign": "abs(x) * direction(steep * y) of nsdrill.equations.library",
    "heaviside": "`1.0 if x > 0.0 else 0.0`, and nsdrill.touching",
    "hypot": "np.sqrt(x * x + y * y)",
    "fabs": "np.abs(x)",
    "reciprocal": "1.0 / x",
    **dict.fromkeys(("power", "float_power"), "x**3, and x * np.sqrt(x) for x**1.5"),
    "interp": "a sum of slopes times np.maximum(x - corner, 0.0)",
    **dict.fromkeys(("where", "select", "piecewise"), _CHOICE),
    "clip": "np.minimum(np.maximum(x, low), high)",
    "polyval": "(a * x + b) * x + c",
    **dict.fromkeys(("log", "log2", "log10", "log1p"), _LOGARITHM),
    "exp2": "np.exp(0.6931471805599453 * x)",
    "tan": "np.sin(x) / np.cos(x)",
    "sinh": "0.5 * (np.exp(x) - np.exp(-x))",
    "cosh": "0.5 * (np.exp(x) + np.exp(-x))",
    "arcsin": "np.arctan(x / np.sqrt(1.0 - x * x))",
    "arccos": "np.pi / 2 - np.arctan(x / np.sqrt(1.0 - x * x))",
    "arctan2": "2.0 * np.arctan(y / (np.sqrt(x * x + y * y) + x))",
    "sinc": "np.sin(np.pi * x) / (np.pi * x)",
    **dict.fromkeys(("deg2rad", "radians"), "x * np.pi / 180"),
    **dict.fromkeys(("rad2deg", "degrees"), "x * 180 / np.pi"),
    **dict.fromkeys(("floor", "ceil", "rint", "trunc", "round", "around", "fix"), _JUMPING),
    **dict.fromkeys(("remainder", "fmod", "floor_divide", "divmod", "modf"), _JUMPING),
    **dict.fromkeys(("isnan", "isfinite", "isinf"), "no need: values are finite"),
}
# What functions of numpy are on values, by their names; :mod:`.library` adds its own.
NUMPY: dict[str, Callable[..., Any]] = {
    "add": operator.add, "subtract": operator.sub, "multiply": operator.mul, "divide": operator.truediv,
    "negative": operator.neg, "positive": operator.pos, "absolute": abs, "less": operator.lt,
    "less_equal": operator.le, "greater": operator.gt, "greater_equal": operator.ge, "equal": operator.eq,
    "not_equal": operator.ne,
}  # fmt: skip

Number = Node | float


@dataclass
class Loop:
    """A region that is repeated while some lane is ``unfinished``, ``most`` times at
    most: each of ``variables`` then takes the value in ``following``."""

    variables: list[Node]
    following: list[Node]
    unfinished: Node
    most: int

    @property
    def needs(self) -> list[Node]:
        return [*self.following, self.unfinished]


@dataclass
class Graph:
    """Nodes in the order in which they were made; an argument precedes its users."""

    nodes: list[Node] = field(default_factory=list)
    region: int = 0  # where nodes are made; 0 is the whole
    parent: list[int] = field(default_factory=lambda: [-1])  # of each region
    condition: list[Node | None] = field(default_factory=lambda: [None])
    loops: dict[int, Loop] = field(default_factory=dict)
    otherwise: dict[int, int] = field(default_factory=dict)  # region in place of another
    names: dict[str, Node] = field(default_factory=dict)  # what the equations call them
    # Friction of :mod:`.library`: the contacts with friction, in order
    frictions: list[Any] = field(default_factory=list)
    gaps: dict[str, Node] = field(default_factory=dict)  # of unilateral contacts, by name
    with_slopes: bool = False  # laws of friction are evaluated with their slopes
    reciprocals: dict[tuple[Node, int], Node] = field(default_factory=dict)
    known: dict[tuple[object, ...], Node] = field(default_factory=dict)
    is_open: bool = False  # while equations of a model run on its nodes
    checks_effects: bool = False  # what the sides of conditions change is looked for
    refused: Refused | None = None  # the first refusal, which equations may have caught

    # Construction.

    def refuse(self, text: str, line: int = 0, source: str = "") -> NoReturn:
        """Refuse what equations do, also where they catch the error."""
        error = Refused(text, line, source)
        self.refused = self.refused or error
        raise error

    def node(self, value: Number) -> Node:
        if type(value) is Node:
            if value.graph is not self:
                self.graph_is_another()
            return value
        if not isinstance(value, Real):
            self.refuse(f"found {value!r} where a number is wanted")
        number = float(value)
        if not math.isfinite(number):
            self.refuse(
                f"found {number} as a number of the equations; allowed: finite numbers, and for none the greatest or "
                "least that the quantity can have"
            )
        return self.make("const", extra=number)

    def graph_is_another(self) -> NoReturn:
        self.refuse(
            "found a value of an earlier call of the equations, which something outside them has kept; allowed: what "
            "is made from the arguments of this call"
        )

    def truth(self, node: Node) -> Node:
        """Whether the value counts as true: a number where it is not zero."""
        return node if node.op in TRUTHS else self.make("not", self.make("eq", node, 0.0))

    def number(self, value: Number) -> Node:
        """The value as a number: a truth is 1 or 0."""
        node = self.node(value)
        return self.make("select", node, 1.0, 0.0) if node.op in TRUTHS else node

    def changes(self, node: Node) -> bool:
        """Whether a value changes in time: not one of parameters alone."""
        return any(one.op == "input" and not str(one.extra).startswith(GIVEN) for one in self.live([node]))

    def equal(self, a: Number, b: Any) -> Node | bool:
        """Whether two values are equal; what is no number equals none. Refused of what
        moves, which has no value for longer than an instant."""
        is_number = isinstance(b, (Node, Real))
        if not is_number:
            return False
        made = self.make("eq", a, b)
        if self.changes(made):
            self.refuse(
                "found ==, != or `in` of a value that changes in time: it equals another for an instant, between "
                "steps, so that no step finds it; allowed: <, <=, >, >=, as abs(x) < 1e-9, and == of parameters and "
                "options"
            )
        return made

    def make(self, op: str, *args: Number, extra: Any = None) -> Node:
        nodes = tuple(self.node(arg) for arg in args)
        if self.is_open and any(node.op in TRUTHS for node in nodes) and op not in LOGIC:
            nodes = tuple(self.number(node) for node in nodes)
        region = 0 if op in LEAVES else self.region
        mark = (math.copysign(1.0, extra), extra) if op == "const" else extra
        at = region
        while at >= 0:  # known here or in a region around this one
            found = self.known.get((op, nodes, mark, at))
            if found is not None and (at == region or found.needs.isdisjoint(self.around(region))):
                return found
            at = self.parent[at]
        made = Node(self, op, nodes, extra, region)
        if len(self.nodes) > MOST_NODES:
            self.refuse(f"found more than {MOST_NODES} operations; allowed: loops that end sooner")
        self.nodes.append(made)
        self.known[op, nodes, mark, region] = made
        return made

    def input(self, name: str) -> Node:
        return self.make("input", extra=name)

    def add(self, a: Number, b: Number) -> Node:
        a, b = self.number(a), self.number(b)
        if a.op == b.op == "const":
            return self.node(a.extra + b.extra)
        if a.zero or b.zero:
            return b if a.zero else a
        if b.op == "neg":
            return self.make("sub", a, b.args[0])
        return self.make("sub", b, a.args[0]) if a.op == "neg" else self.make("add", a, b)

    def sub(self, a: Number, b: Number) -> Node:
        a, b = self.number(a), self.number(b)
        if a.op == b.op == "const":
            return self.node(a.extra - b.extra)
        if a.zero or b.zero:
            return self.neg(b) if a.zero else a
        return self.make("add", a, b.args[0]) if b.op == "neg" else self.make("sub", a, b)

    def mul(self, a: Number, b: Number) -> Node:
        a, b = self.number(a), self.number(b)
        if a.op == b.op == "const":
            return self.node(a.extra * b.extra)
        for one, other in ((a, b), (b, a)):
            if one.is_number(1.0):
                return other
            if one.is_number(-1.0):
                return self.neg(other)
            if one.op == "neg":
                return self.neg(self.mul(one.args[0], other))
        return self.make("mul", a, b)

    def div(self, a: Number, b: Number) -> Node:
        a, b = self.number(a), self.number(b)
        if a.op == b.op == "const":
            return self.node(a.extra / b.extra)
        if a.op == "neg":
            return self.neg(self.div(a.args[0], b))
        if b.op == "sqrt":  # a length: its reciprocal is shared
            return self.mul(a, self.reciprocal(b))
        return self.make("div", a, b)

    def reciprocal(self, of: Node) -> Node:
        """1 / of, as a law of friction gives it besides (:meth:`share_reciprocal`), or
        by a division."""
        for region in self.around(self.region):
            if (found := self.reciprocals.get((of, region))) is not None:
                return found
        return self.make("div", 1.0, of)

    def share_reciprocal(self, of: Node, value: Node) -> None:
        """Let ``value`` be what divides by ``of`` from here on, in this region."""
        self.reciprocals[of, self.region] = value

    def neg(self, a: Number) -> Node:
        a = self.node(a)
        if a.op == "const":
            return self.node(-a.extra)
        if a.op == "neg":
            return a.args[0]
        return self.make("sub", a.args[1], a.args[0]) if a.op == "sub" else self.make("neg", a)

    def abs(self, a: Number) -> Node:
        a = self.node(a)
        return self.node(abs(a.extra)) if a.op == "const" else self.make("abs", a)

    def fixed(self, a: Number) -> Node:
        a = self.node(a)
        return a if a.op in ("const", "fixed") else self.make("fixed", a)

    def select(self, condition: Node, a: Number, b: Number) -> Node:
        a, b = (self.number(one) if self.is_open else self.node(one) for one in (a, b))
        return a if a is b else self.make("select", condition, a, b)

    def sum(self, terms: Iterable[Number]) -> Node:
        total = self.node(0.0)
        for term in terms:
            total = self.add(total, term)
        return total

    # Regions.

    @contextmanager
    def inside(self, region: int) -> Iterator[None]:
        before, self.region = self.region, region
        try:
            yield
        finally:
            self.region = before

    def new_region(self, condition: Node | None) -> int:
        self.parent.append(self.region)
        self.condition.append(condition)
        return len(self.parent) - 1

    def around(self, region: int) -> Iterator[int]:
        """The region and those around it, the whole last."""
        while region >= 0:
            yield region
            region = self.parent[region]

    def needs(self, args: Iterable[Node], region: int) -> frozenset[int]:
        """The regions, not around ``region``, that the ``args`` depend on."""
        found: frozenset[int] = frozenset()
        for arg in args:
            if arg.region and arg.region != region:
                found |= frozenset(self.around(arg.region))
            found |= arg.needs
        return found - frozenset(self.around(region)) if found else found

    @contextmanager
    def evaluating(self, contact: Any) -> Iterator[None]:
        """While the law of a contact with friction is evaluated, which then has its loads."""
        yield

    # What depends on what.

    def inputs_of(self, values: Iterable[Node]) -> set[str]:
        """The names of the inputs on which ``values`` depend."""
        return {str(node.extra) for node in self.live(values) if node.op == "input"}

    def live(self, outputs: Iterable[Node], until: Container[Node] = ()) -> list[Node]:
        """The nodes on which ``outputs`` depend, in order, with the conditions of their
        regions; those in ``until`` are left out, with what these alone depend on."""
        seen: set[Node] = set()
        todo = list(outputs)
        while todo:
            node = todo.pop()
            if node in seen or node in until:
                continue
            seen.add(node)
            todo += node.args
            for region in self.around(node.region):
                if region in self.loops:
                    todo += self.loops[region].needs + self.loops[region].variables
                elif (condition := self.condition[region]) is not None:
                    todo.append(condition)
        return sorted(seen, key=lambda node: node.id)

    def again(self, op: str, args: Sequence[Node], extra: Any) -> Node:
        """The operation on other arguments, simplified where that is possible."""
        simple: dict[str, Callable[..., Node]] = {"add": self.add, "sub": self.sub, "mul": self.mul, "div": self.div,
                                                  "neg": self.neg, "abs": self.abs, "select": self.select}  # fmt: skip
        return simple[op](*args) if op in simple else self.make(op, *args, extra=extra)

    def substituted(self, wanted: Iterable[Node], given: Mapping[Node, Number], regions: dict[int, int]) -> list[Node]:
        """The nodes ``wanted`` with other values in place of those ``given``; what does
        not depend on these is shared. A region of what does is made again, as its
        values may depend on what comes after it, and all of one whose condition does;
        ``regions`` remembers which."""
        wanted = list(wanted)
        found = {node: self.node(value) for node, value in given.items()}
        for node in self.live(wanted):
            region = node.region
            is_elsewhere = any(self.condition[one] in found for one in self.around(region))
            if node in found or not (is_elsewhere or any(arg in found for arg in node.args)):
                continue
            if region and region not in regions:
                condition = self.condition[region]
                regions[region] = self.new_region(None if condition is None else found.get(condition, condition))
                self.parent[-1] = regions.get(self.parent[region], self.region)
            with self.inside(regions[region] if region else self.region):
                args = [found.get(arg, arg) for arg in node.args]
                extra = node.extra
                if node.op == "join" and args[1] is not node.args[1]:
                    extra = regions.get(extra, extra)
                found[node] = self.again(node.op, args, extra)
        return [found.get(node, node) for node in wanted]


def text_of(outputs: Mapping[str, Node]) -> str:
    """All that ``outputs`` depend on, as a text: equal texts are equal computations."""
    graph = next(iter(outputs.values())).graph
    nodes = graph.live(outputs.values())
    number = {node: k for k, node in enumerate(nodes)}
    lines = [(node.op, [number[arg] for arg in node.args], node.extra, node.region) for node in nodes]
    regions = [(graph.parent[k], None if one is None else number.get(one)) for k, one in enumerate(graph.condition)]
    return repr((lines, regions, [(name, number[node]) for name, node in outputs.items()]))


def rewritten(
    graph: Graph, outputs: Mapping[str, Node], change: Callable[[Graph, Callable[[Node], Node], Node], Node]
) -> tuple[Graph, dict[str, Node]]:
    """A copy of what ``outputs`` need, in which ``change(new, of, node)`` stands for
    each node; ``of`` gives the new node of an old one."""
    new = Graph(
        parent=list(graph.parent),
        condition=[None] * len(graph.parent),
        otherwise=dict(graph.otherwise),
        with_slopes=graph.with_slopes,
    )
    found: dict[Node, Node] = {}

    def of(node: Node) -> Node:
        if node not in found:
            with new.inside(node.region):
                found[node] = change(new, of, node)
        return found[node]

    needed = graph.live(outputs.values())
    present = set(needed)
    for node in needed:
        of(node)
    result = {name: of(node) for name, node in outputs.items()}
    for region, condition in enumerate(graph.condition):
        if condition in present:
            new.condition[region] = of(condition)
    for region, loop in graph.loops.items():
        if loop.unfinished in present:
            new.loops[region] = Loop(
                [of(node) for node in loop.variables],
                [of(node) for node in loop.following],
                of(loop.unfinished),
                loop.most,
            )
    new.gaps = {name: of(node) for name, node in graph.gaps.items() if node in present}
    return new, result
