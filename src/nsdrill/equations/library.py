"""What equations may call: functions with their derivatives, and contacts, declared where
they act.

A function works on numbers, on the nodes of a graph and, through the graph, on arrays. In
compiled code it is that of :mod:`nsdrill.elementary`. The graph remembers the contacts:
a tangent needs the side on which a contact is, an implicit stage solves for the slips of
all contacts with friction, and continuation follows the gap functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from nsdrill import elementary
from nsdrill.data import Array
from nsdrill.elementary import TWO_OVER_PI
from nsdrill.equations.graph import NUMPY, Graph, Node, Number
from nsdrill.records import dataclass

# The derivatives of the results with respect to the arguments: function(args, results)
# -> one sequence per result; None where there is no rule, as for the numbers of a law.
Derivatives = Callable[[Sequence[Node], Sequence[Node]], Sequence[Sequence[Number | None]]]
LawNumbers: TypeAlias = Any  # what a law reads, each of its numbers by name
# What a function of numbers gives is a number, and a node where one of these is a node.


@dataclass(frozen=True, eq=False)
class Library:
    """A function of some arguments with ``results`` results, ``scalar`` in compiled
    code and on numbers, ``array`` on arrays; in code so many ``operations``, of the
    first ``arguments`` arguments."""

    name: str
    scalar: Callable[..., object]
    array: Callable[..., object]
    results: int
    operations: int
    derivatives: Derivatives
    arguments: int = 1

    def __call__(self, *args: Number) -> Any:
        graph = _graph_of(*args)
        if graph is None:
            return self.scalar(*args[: self.arguments])
        made = self.nodes(graph, args)
        return made if self.results > 1 else made[0]

    def nodes(self, graph: Graph, args: Sequence[Number]) -> tuple[Node, ...]:
        return tuple(graph.make("result", *args, extra=(self, k)) for k in range(self.results))

    def __repr__(self) -> str:
        return self.name


def _graph_of(*values: object) -> Graph | None:
    for value in values:
        if isinstance(value, Node):
            return value.graph
    return None


def sqrt(x: Number) -> Any:
    """The square root."""
    return x.graph.make("sqrt", x) if isinstance(x, Node) else math.sqrt(x)


def fma(a: Number, b: Number, c: Number) -> Any:
    """a * b + c, in this order, in one rounding when compiled."""
    graph = _graph_of(a, b, c)
    return a * b + c if graph is None else graph.make("fma", a, b, c)


def choose(condition: Node | bool, a: Number, b: Number) -> Any:
    """``a`` where the condition holds, else ``b``."""
    if isinstance(condition, Node):
        return condition.graph.select(condition, a, b)
    return a if condition else b


def greater(a: Number, b: Number) -> Any:
    graph = _graph_of(a, b)
    return max(a, b) if graph is None else graph.make("max", a, b)


def over_quotient(v: Number) -> tuple[Number, list[Node]]:
    """(speed, divisors) with v = speed / divisors: where v is a sum with a quotient by
    a length, or by two, so that v needs no division of its own; else v and none."""
    if not isinstance(v, Node) or v.op not in ("add", "sub"):
        return v, []
    for k in (1, 0):
        numerator, other, divisors = v.args[k], v.args[1 - k], []
        while (found := _quotient(numerator)) is not None:
            numerator, divisor = found
            other = other * divisor
            divisors.append(divisor)
        if divisors:
            if v.op == "add":
                return other + numerator, divisors
            return (other - numerator if k else numerator - other), divisors
    return v, []


def _quotient(value: Node) -> tuple[Node, Node] | None:
    """(a, d) of a value a * (1 / d)."""
    for a, b in (value.args, value.args[::-1]) if value.op == "mul" else ():
        if b.op == "div" and b.args[0].is_number(1.0) and b.args[1].op == "sqrt":
            return a, b.args[1]
    return None


def slip_factors(v: Number, smoothing: Number, decay: Number) -> tuple[Number, Number]:
    """(2/pi) atan(smoothing v), the smoothed direction of a slip v, and 1 / (1 + decay
    |v|), by which friction falls; with one division for both, for v where that is a
    sum with a quotient, and for the slope."""
    for what, value in (("smoothing", smoothing), ("decay", decay)):
        _refuse_states(what, value)
    if isinstance(v, Node) and v.graph.with_slopes:
        unit = flat(v, smoothing)
        direction, decayed, _ = _slip_factors(v * unit, unit, smoothing, decay, v)
        return direction, decayed
    speed, divisors = over_quotient(v)
    unit = math.prod(divisors, start=1.0)
    direction, decayed, per_unit = _slip_factors(speed, unit, smoothing, decay, v)
    for k, divisor in enumerate(divisors):
        others = math.prod(divisors[:k] + divisors[k + 1 :], start=1.0)
        divisor.graph.share_reciprocal(divisor, per_unit * others)
    return direction, decayed


def _refuse_states(what: str, value: Number) -> None:
    """Both factors are followed as the slip changes alone."""
    graph = _graph_of(value)
    if graph is not None and (states := sorted(n for n in graph.inputs_of([graph.node(value)]) if n.startswith("s."))):
        graph.refuse(
            f"found a {what} of friction that changes with the state {states[0].removeprefix('s.')}; allowed with the "
            "law hyperbolic: one of numbers and parameters. A normal load and coefficients may change with states, and "
            "the decay of the law exponential"
        )


def flat(v: Number, smoothing: Number) -> Any:
    """1 + (smoothing v)^2."""
    scaled = smoothing * v
    return fma(scaled, scaled, 1.0)


def _slip_factors_of_arrays(
    speed: Array, unit: Array, smoothing: Array, decay: Array, v: Array
) -> tuple[Array, Array, Array]:
    return TWO_OVER_PI * np.arctan(smoothing * v), 1.0 / (1.0 + decay * np.abs(v)), 1.0 / unit


def _slip_slopes(args: Sequence[Node], results: Sequence[Node]) -> Sequence[Sequence[Number | None]]:
    """The first two with respect to v, from which speed and unit follow."""
    _, unit, smoothing, decay, v = args
    one_plus_square = flat(v, smoothing)
    per_flat = results[2] if unit is one_plus_square else 1.0 / one_plus_square
    falling = choose(v < 0.0, decay, -decay) * (results[1] * results[1])
    steep = TWO_OVER_PI * smoothing * per_flat
    return (0.0, 0.0, None, None, steep), (0.0, 0.0, None, None, falling), (
        0.0, -(results[2] * results[2]), 0.0, 0.0, 0.0,
    )  # fmt: skip


_slip_factors = Library("slip_factors", elementary.slip_factors, _slip_factors_of_arrays, 3, 45, _slip_slopes, 4)
sincos = Library(
    "sincos",
    elementary.sincos,
    lambda a: (np.sin(a), np.cos(a)),
    2,
    35,
    lambda args, results: ((results[1],), (-results[0],)),
)
direction = Library(
    "direction",
    elementary.direction,
    lambda x: TWO_OVER_PI * np.arctan(x),
    1,
    35,
    lambda args, results: ((TWO_OVER_PI * (1.0 / fma(args[0], args[0], 1.0)),),),
)
expm1 = Library("expm1", elementary.expm1, np.expm1, 1, 30, lambda args, results: ((1.0 + results[0],),))
# The square root of the first argument; its derivative is that of a root of at least the
# second, so that it is bounded.
bounded_root = Library(
    "bounded_root",
    elementary.root,
    lambda x, least: np.sqrt(x),
    1,
    1,
    lambda args, results: ((0.5 / greater(results[0], args[1]), None),),
)
tanh = Library("tanh", elementary.tanh, np.tanh, 1, 30, lambda args, results: ((fma(-results[0], results[0], 1.0),),))
FUNCTIONS = ("sqrt", "sincos", "direction", "expm1", "tanh", "fma")  # of every model


def exp(x: Number) -> Any:
    """e to the power x, for x within +-700: one is the reciprocal of the other side's, so
    that small values are exact, too."""
    graph = _graph_of(x)
    if graph is None:
        return math.exp(x)
    size = graph.make("min", abs(graph.node(x)), 700.0)
    grown = 1.0 + expm1(size)
    return choose(x < 0.0, 1.0 / grown, grown)


def lesser(a: Number, b: Number) -> Any:
    graph = _graph_of(a, b)
    return min(a, b) if graph is None else graph.make("min", a, b)


# What numpy's functions are on values, so that the same equations work on numbers.
OF_NUMPY: dict[str, Callable[..., Any]] = {
    "sin": lambda x: sincos(x)[0], "cos": lambda x: sincos(x)[1], "sqrt": sqrt, "tanh": tanh, "expm1": expm1,
    "exp": exp, "arctan": lambda x: direction(x) / TWO_OVER_PI, "maximum": greater, "minimum": lesser,
    "square": lambda x: x * x,
}  # fmt: skip
NUMPY.update(OF_NUMPY)


# Contacts.


@dataclass(frozen=True, eq=False)
class Law:
    """A law of friction: the coefficient at a slip, with the slip's sign.

    ``factors(v, numbers)`` are its expensive parts, of which ``coefficient(v, factors,
    numbers)`` makes it; ``steepest_fall(numbers)`` is the steepest fall with the slip;
    ``guess(numbers)`` gives the numbers with which Newton's method begins.
    """

    factors: Callable[[Number, LawNumbers], tuple[Any, Any]]
    coefficient: Callable[[Number, tuple[Any, Any], LawNumbers], Any]
    steepest_fall: Callable[[LawNumbers], Number]
    guess: Callable[[LawNumbers], LawNumbers] = lambda numbers: numbers

    def __call__(self, v: Number, numbers: LawNumbers) -> Any:
        return self.coefficient(v, self.factors(v, numbers), numbers)


@dataclass(frozen=True, eq=False)
class SteepLaw:
    """A law that may rise with an infinite slope, so that an implicit stage solves for
    another unknown in place of the slip.

    ``value(slip, numbers)`` is the coefficient; ``at(unknown, free, numbers)`` gives
    slip and coefficient, and ``begin(free, relaxed, numbers)`` the unknown from which
    Newton's method begins. ``free`` is the slip without friction, and ``relaxed`` by
    how much a coefficient of 1 would reduce it. ``steepest_fall(numbers)`` is that of
    the coefficient with the slip.
    """

    value: Callable[[Number, LawNumbers], Number]
    at: Callable[[Node, Node, LawNumbers], tuple[Node, Node]]
    begin: Callable[[Node, Node, LawNumbers], Node]
    steepest_fall: Callable[[LawNumbers], Number]

    def __call__(self, slip: Number, numbers: LawNumbers) -> Number:
        return self.value(slip, numbers)


@dataclass
class Friction:
    """A contact with friction: one component, or two for a slip in a plane."""

    name: str
    slips: tuple[Any, ...]
    normal: Any
    law: Law | SteepLaw
    numbers: LawNumbers
    loads: tuple[Any, ...] = ()
    region: int = 0

    def loads_at(self, slips: Sequence[Number], normal: Number) -> tuple[Any, ...]:
        """The loads against these slips."""
        if len(slips) == 1:
            return (normal * self.law(slips[0], self.numbers),)
        # The floor has an effect at rest only, where the quotient has a limit.
        size = sqrt(slips[0] * slips[0] + (slips[1] * slips[1] + 1e-60))
        share = normal * self.law(size, self.numbers) / size
        return tuple(share * slip for slip in slips)


def touching(name: str, gap: Number) -> Any:
    """How far a unilateral contact is closed, 0 where it is open; ``gap`` is positive
    where it is closed. What leaves an ``if`` on it does not jump where it closes: a
    deviation may take the other side there."""
    if not isinstance(gap, Node):
        return max(gap, 0.0)
    gap.graph.gaps[name] = gap
    return gap.graph.make("max", gap, 0.0, extra=name)


def friction(name: str, *, slip: Number, normal: Number, law: Law | SteepLaw, numbers: LawNumbers) -> Any:
    """The load against a ``slip`` under a ``normal`` load: that times the coefficient
    ``law(slip, numbers)``, which has the slip's sign."""
    return _declared(Friction(name, (slip,), normal, law, numbers))[0]


def friction_along(
    name: str, *, slip: tuple[Number, Number], normal: Number, law: Law | SteepLaw, numbers: LawNumbers
) -> tuple[Any, ...]:
    """The two components of the load against a slip in a plane."""
    return _declared(Friction(name, slip, normal, law, numbers))


def _declared(contact: Friction) -> tuple[Any, ...]:
    graph = _graph_of(*contact.slips)
    if graph is None:
        contact.loads = contact.loads_at(contact.slips, contact.normal)
    else:
        with graph.evaluating(contact):
            contact.loads = contact.loads_at(contact.slips, contact.normal)
        contact.slips = tuple(map(graph.node, contact.slips))
        contact.normal = graph.node(contact.normal)
        contact.region = graph.region
        graph.frictions.append(contact)
    return contact.loads
