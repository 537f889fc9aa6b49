"""The dimensions of what equations add, compare and return, where the numbers of a script
have units.

What has no unit is not known, a literal among them: it may stand for anything, and what is
made with it is not known either; where it is added, it has the dimension of the other
terms. So only what is certain is refused, in the line that does it. An angle has no
dimension, so that stiffness times angle is a torque; a cycle of Hz has one, as it is 2 pi of them. A tanh of what has a
dimension is not refused: published laws of friction have tanh(omega), with 1 s meant.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from fractions import Fraction
from typing import Any

from nsdrill.equations.graph import Graph, Node, Number
from nsdrill.equations.trace import Function, Inputs, evaluated
from nsdrill.errors import InputError
from nsdrill.models.own_quantities import Measured
from nsdrill.models.registry import described
from nsdrill.script.signature import number
from nsdrill.units import cycles_in, dimensions_of, plain_units

Dimension = dict[str, Fraction]
TIME: Dimension = {"[time]": Fraction(1)}
ANGLE = "[angle]"
CYCLE = "[cycle]"
BASES = {"[mass]": "kg", "[length]": "m", "[time]": "s", "[current]": "A", CYCLE: "cycles"}
NAMED = ("Hz", "N", "N m", "N/m", "N s/m", "N m s", "Pa", "W", "V")
OF_NUMBERS = ("sincos", "direction", "tanh", "expm1")  # give numbers
UNCHECKED = "A number that is given no unit is not checked"
OF_CYCLES = "Hz counts cycles of 2 * np.pi rad: f in Hz turns at 2 * np.pi * f in rad/s. Others are in 1/s or rad/s"


def dimension_in(units: str) -> Dimension | None:
    """The dimension of ``units``, without angles, with cycles; None where there are none."""
    if not units:
        return None
    found = dimensions_of(plain_units(units))
    if found is None:
        return None
    cycles = {CYCLE: power} if (power := cycles_in(plain_units(units))) else {}
    return {base: power for base, power in found.items() if base != ANGLE} | cycles


def dimension_of(value: number) -> Dimension | None:
    """The dimension of a number of a script."""
    return {} if value.is_ratio else dimension_in(value.units)


def product(a: Dimension | None, b: Dimension | None, power: int = 1) -> Dimension | None:
    """The dimension of a times b to this power."""
    if a is None or b is None:
        return None
    every = {base: a.get(base, Fraction(0)) + power * b.get(base, Fraction(0)) for base in {*a, *b}}
    return {base: exponent for base, exponent in every.items() if exponent}


def words(dimension: Dimension) -> str:
    """A dimension in words, with its unit."""
    if not dimension:
        return "without a dimension"
    for units in NAMED:
        if dimension_in(units) == dimension:
            return f"in {units}"
    powers = [(BASES.get(base, base), dimension[base]) for base in (*BASES, *dimension) if base in dimension]
    over = [_power(name, exponent) for name, exponent in dict(powers).items() if exponent > 0]
    under = [_power(name, -exponent) for name, exponent in dict(powers).items() if exponent < 0]
    return "in " + "/".join((" ".join(over) or "1", *under))


def remedy(*dimensions: Dimension) -> str:
    """What to know of values of different ``dimensions``."""
    return OF_CYCLES if any(CYCLE in one for one in dimensions) else UNCHECKED


def _power(name: str, exponent: Fraction) -> str:
    return name if exponent == 1 else f"{name}^{exponent}" if exponent.denominator == 1 else f"{name}^({exponent})"


class Dimensioned(Graph):
    """A graph that knows the dimension of each value, None of one that is not known, and
    refuses what cannot have one. ``given`` are the dimensions of its inputs."""

    def __init__(self, given: Mapping[str, Dimension | None]) -> None:
        super().__init__()
        self.given, self.of = given, dict[Node, Dimension | None]()
        self.is_trusted = False  # while a law of friction is evaluated

    def make(self, op: str, *args: Number, extra: Any = None) -> Node:
        made = super().make(op, *args, extra=extra)
        if made not in self.of:
            self.of[made] = None if self.is_trusted else self._dimension(made)
        return made

    @contextmanager
    def evaluating(self, contact: Any) -> Iterator[None]:
        """A load has the dimension of the normal load; the numbers of a law may have any."""
        before, self.is_trusted = self.is_trusted, True
        try:
            yield
        finally:
            self.is_trusted = before
        for load in contact.loads:
            if type(load) is Node and type(contact.normal) is Node:
                self.of[load] = self.of[contact.normal]

    def _dimension(self, node: Node) -> Dimension | None:
        of = [self.of[arg] for arg in node.args]
        match node.op:
            case "input":
                return self.given.get(str(node.extra))
            case "neg" | "abs" | "fixed":
                return of[0]
            case "add" | "sub":
                return self._same(*of, what="a sum")
            case "fma":
                return self._same(product(of[0], of[1]), of[2], what="a sum")
            case "max" | "min":
                return self._same(*of, what="the greater or lesser")
            case "select" | "join":
                return self._same(of[1], of[2], what="a choice")
            case "lt" | "le" | "gt" | "ge" | "eq":
                self._same(*of, what="a comparison")
                return None
            case "mul":
                return product(of[0], of[1])
            case "div":
                return product(of[0], of[1], -1)
            case "sqrt":
                return None if of[0] is None else {base: power / 2 for base, power in of[0].items()}
            case "result" if node.extra[0].name == "sincos" and of[0]:
                self.refuse(
                    f"found the sine or cosine of a value {words(of[0])}; allowed: of an angle. {remedy(of[0])}"
                )
            case "result" if node.extra[0].name in OF_NUMBERS and not of[0]:
                return {}
        return None

    def _same(self, a: Dimension | None, b: Dimension | None, *, what: str) -> Dimension | None:
        if a is not None and b is not None and a != b:
            self.refuse(
                f"found {what} of values {words(a)} and {words(b)}; allowed: terms of one dimension. {remedy(a, b)}"
            )
        return b if a is None else a


def check_dimensions(
    equations: Function,
    states: Mapping[str, number],
    parameters: Mapping[str, number],
    returned: str,
    others: Mapping[str, str] | None = None,
    wanted: Mapping[str, str] | None = None,
    options: object = None,
) -> dict[str, Dimension | None]:
    """Refuse equations that add, compare or return values of different dimensions, with the
    line. ``others`` are the units of further inputs, by their names in a graph, and
    ``wanted`` those of what the equations return besides slopes; a slope is that of its
    state per second. ``returned`` is the place of what they return. What
    the equations give a name to is returned with its dimension."""
    given = {f"s.{name}": dimension_of(value) for name, value in states.items()}
    given |= {f"p.{name}": dimension_of(value) for name, value in parameters.items()}
    if all(dimension is None for dimension in given.values()):
        return {}
    given |= {name: dimension_in(units) for name, units in (others or {}).items()}
    graph = Dimensioned(given)
    names: dict[str, list[str]] = {"s": [], "p": []}
    for name in given:
        kind, _, rest = name.partition(".")
        names[kind].append(rest)
    s, p = Inputs(graph, names["s"], "s"), Inputs(graph, names["p"], "p")
    found = evaluated(graph, equations, graph.input("time"), graph.input("phase"), s, p, options)
    for name, value in (found[0] if isinstance(found, tuple) else found).items():
        dimension = graph.of[value] if type(value) is Node else None
        if name in states:
            right = product(given[f"s.{name}"], TIME, -1)
            what = f"the slope of {name}"
        else:
            right, what = dimension_in((wanted or {}).get(name, "")), f"the {name}"
        if dimension is not None and right is not None and dimension != right:
            raise InputError(
                f"{returned}: found {what} {words(dimension)}; allowed: {words(right)}. {remedy(dimension, right)}."
            )
    return {name: graph.of.get(node) for name, node in graph.names.items()}


def check_measured(made: Measured, given: Mapping[str, Dimension | None]) -> None:
    """Refuse a quantity whose function adds or compares values of different dimensions, with
    the line, or gives another one than that of its units. ``given`` are the dimensions of
    what it may read."""
    graph = Dimensioned({f"s.{name}": given.get(name) for name in made.arguments})
    found = evaluated(graph, made.function, *(graph.input(f"s.{name}") for name in made.arguments))
    dimension, right = graph.of[graph.number(found)], dimension_of(made.about)
    if dimension is not None and right is not None and dimension != right:
        made.refuse(f"a value {words(dimension)}", f"{words(right)}, as its unit is. {remedy(dimension, right)}")


def check_measured_of(model: str, made: Measured) -> None:
    """As :func:`check_measured`, of a quantity of a model of nsdrill or of a package, whose
    traces have the units of what it reads."""
    in_traces = {one.name: one.units for one in described(model).trace_and_states}
    check_measured(made, {name: dimension_in(_powers_of(units)) for name, units in in_traces.items()})


def _powers_of(cf: str) -> str:
    """The units of a file, ``N m s-1``, with signs of powers."""
    return re.sub(r"(?<=[a-z])-", "^-", cf)
