"""The friction laws, each once: the coefficient, with its sign, at a slip.

With the smoothed direction g(v) = (2/pi) atan(smoothing v) and the four ``numbers`` of
a law (smoothing, decay, rise, dynamic):

    hyperbolic   g [ rise / (1 + decay |v|) + dynamic ]
    linear       g [ rise max(1 - decay |v|, 0) + dynamic ]
    exponential  g [ rise exp(-decay |v|) + dynamic ]
    rational     dynamic tanh(smoothing v) + rise v / (1 + decay v^2)

Sources: hyperbolic in the form of Leine 1998; linear Dawson, Lin & Spanos 1987, SPE
16660; exponential and rational as public codes of drill-string models have them.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from nsdrill.equations import plain
from nsdrill.equations.contacts import Law
from nsdrill.equations.derivative import Tangents
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.library import direction, expm1, flat, slip_factors, tanh
from nsdrill.equations.trace import Inputs, Named, part


def _hyperbolic(v: Any, numbers: Any) -> tuple[Any, Any]:
    return slip_factors(v, numbers.smoothing, numbers.decay)


@part
def _linear(v: Any, numbers: Any) -> tuple[Any, Any]:
    return direction(numbers.smoothing * v), max(1.0 - numbers.decay * abs(v), 0.0)


def _exponential(v: Any, numbers: Any) -> tuple[Any, Any]:
    return direction(numbers.smoothing * v), 1.0 + expm1(-(numbers.decay * abs(v)))


def _rational(v: Any, numbers: Any) -> tuple[Any, Any]:
    return tanh(numbers.smoothing * v), 1.0 / (1.0 + numbers.decay * v * v)


def _falling(v: Any, factors: tuple[Any, Any], numbers: Any) -> Any:
    direction, weakened = factors
    return direction * (numbers.rise * weakened + numbers.dynamic)


def _humped(v: Any, factors: tuple[Any, Any], numbers: Any) -> Any:
    bounded, weakened = factors
    return numbers.dynamic * bounded + numbers.rise * v * weakened


def _without_hump(numbers: Any) -> Named:
    """The numbers of a hyperbolic law that is like the rational one without its hump."""
    return Named(smoothing=numbers.smoothing, decay=0.0, rise=0.0, dynamic=numbers.dynamic)


def _fall(numbers: Any) -> Any:
    """Without smoothing."""
    return numbers.rise * numbers.decay


hyperbolic = Law(_hyperbolic, _falling, _fall)
LAWS = {
    "hyperbolic": hyperbolic,
    "linear": Law(_linear, _falling, _fall),
    "exponential": Law(_exponential, _falling, _fall),
    "rational": Law(_rational, _humped, lambda n: 0.125 * n.rise, _without_hump),
}


def numbers_of(p: Any, contact: str) -> Named:
    """The numbers of the law of a contact, among the lane parameters ``p``."""
    return Named(**{name: getattr(p, f"{contact}_{name}") for name in NUMBERS})


NUMBERS = ("smoothing", "decay", "rise", "dynamic")


@lru_cache
def _graph_of(law: Law) -> tuple[Node, Named, tuple[Node, Node], dict[str, Node]]:
    """(slip, numbers, factors, values): the law as a graph, with its ``slope``, and
    ``unsmoothed``, as it is at positive slips without smoothing, with the ``fall`` of
    that."""
    graph = Graph(with_slopes=True)
    v, numbers = graph.input("v"), Inputs(graph, NUMBERS, "n")
    factors = law.factors(v, numbers)
    values = {"coefficient": law.coefficient(v, factors, numbers)}
    direction = graph.node(1.0) if law.coefficient is _falling else factors[0]
    values["unsmoothed"] = law.coefficient(v, (direction, factors[1]), numbers)
    changes = Tangents(graph, {v: 1.0}).of(values)
    values |= {"slope": changes["coefficient"], "fall": -changes["unsmoothed"]}
    return v, numbers, factors, values


def values(law: Law, which: str, v: Any, numbers: Sequence[Any]) -> Any:
    """The ``coefficient`` of a law at slips, its ``slope``, the ``unsmoothed``
    coefficient at positive slips or its ``fall``, on numbers or arrays; ``numbers`` in
    the order of NUMBERS."""
    given = {"v": v} | {f"n.{name}": n for name, n in zip(NUMBERS, numbers, strict=True)}
    return plain.values({"": _graph_of(law)[3][which]}, given)[""]


def with_slope(law: Law) -> Any:
    """The function (slip, *numbers) -> (coefficient, slope), to be written out in lane
    code."""
    v, numbers, _, found = _graph_of(law)
    arguments = {v: "v"} | {getattr(numbers, name): name for name in NUMBERS}
    return plain.written_out("law", [found["coefficient"], found["slope"]], arguments)


def with_slope_from_factors(law: Law) -> Any:
    """The same of (slip, *factors, 1 / (1 + (smoothing slip)^2), *numbers)."""
    v, numbers, factors, found = _graph_of(law)
    per_flat = 1.0 / flat(v, numbers.smoothing)
    if law is hyperbolic:  # comes with the factors
        per_flat = factors[0].graph.make("result", *factors[0].args, extra=(factors[0].extra[0], 2))
    arguments = {v: "v", factors[0]: "direction", factors[1]: "weakened", per_flat: "per_flat"}
    arguments |= {getattr(numbers, name): name for name in NUMBERS}
    return plain.written_out("law", [found["coefficient"], found["slope"]], arguments)
