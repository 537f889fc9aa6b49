"""Quantities that a script measures of a model: functions of its states, its lane
parameters and what its equations give a name to, read in their graph. They are followed
inside each step as the channels of the model are."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from types import FunctionType
from typing import Any, NoReturn

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node, rewritten
from nsdrill.equations.motion import Motion
from nsdrill.equations.trace import check_text, evaluated, traced
from nsdrill.errors import InputError, RunWarning, warn
from nsdrill.observe.channels import Channel, Declaration, Derived, Extremes, Feature, Mean, Outrun
from nsdrill.origin import Origin
from nsdrill.records import dataclass
from nsdrill.variables import OUTRUN, Variable, feature

MEASURED = {"max": "greatest", "min": "least", "mean": "mean"}  # ends of the names of features, with words
RESTING = 1e-12  # what stays below this does not move


@dataclass(frozen=True)
class Measured:
    """A quantity with a ``name`` and the ``function`` that gives it, of which features with
    these ``ends`` are made; ``about`` has its units, its meaning and perhaps its scale.
    ``scale`` is its natural one, once a model has it; ``origin`` says where it was made;
    ``digest`` is that of its value in the graph of the equations."""

    name: str
    function: FunctionType
    about: Any
    ends: tuple[str, ...]
    origin: Origin
    scale: float | None = None
    digest: str = ""

    @property
    def features(self) -> dict[str, str]:
        """The names of its features, with the words for their ends, but for that of
        :data:`OUTRUN`."""
        return {f"{self.name}_{end}": MEASURED[end] for end in self.ends}

    @property
    def measures(self) -> tuple[Feature, ...]:
        """What a declaration has of its channel, which has its name."""
        names = {end: f"{self.name}_{end}" for end in self.ends}
        extremes = Extremes(self.name, greatest=names.get("max"), least=names.get("min"))
        beyond, travel = f"{self.name}__beyond", f"{self.name}__travel"
        return (
            *((extremes,) if "max" in names or "min" in names else ()),
            *((Mean(self.name, names["mean"]),) if "mean" in names else ()),
            Outrun(self.name, beyond, beyond=True),
            Outrun(self.name, travel),
            Derived(OUTRUN.format(self.name), _share_of(beyond, travel)),
        )

    def variables(self, units: str, words: str) -> list[Variable]:
        """Its features as variables, in their ``units``, with what it is in ``words``."""
        named = [feature(name, units, f"{word} {words}", signal=self.name) for name, word in self.features.items()]
        told = f"share of the changes of {words} that the steps of the integration do not follow"
        return [*named, feature(OUTRUN.format(self.name), "1", told, signal=self.name, low=0.0, high=1.0)]

    @property
    def told(self) -> tuple[object, ...]:
        """What is measured, beside the graph, for a digest."""
        return self.name, self.about.units, self.ends

    def refuse(self, found: str, allowed: str) -> NoReturn:
        raise InputError(f"{self.origin}: feature {self.name}: found {found}; allowed: {allowed}.")

    @property
    def arguments(self) -> tuple[str, ...]:
        return tuple(inspect.signature(self.function).parameters)

    def unknown(self, graph: Graph, states: Iterable[str], parameters: Iterable[str]) -> list[str]:
        """The arguments that it does not find."""
        known = {*_names_in(graph), *states, *parameters}
        return [name for name in self.arguments if name not in known]

    def node(self, graph: Graph, states: Iterable[str], parameters: Iterable[str]) -> Node:
        """Its value in the graph of the equations. InputError where it reads what these do not
        have, or is no value; LanguageError where it does what lanes cannot."""
        states, parameters = tuple(states), tuple(parameters)
        known = {name: graph.names[name] for name in _names_in(graph)}
        known |= {name: graph.input(f"p.{name}") for name in parameters}
        known |= {name: graph.input(f"s.{name}") for name in states}
        if unknown := self.unknown(graph, states, parameters):
            self.refuse(
                f"the argument {unknown[0]}",
                f"states, parameters and names that the equations give a value to: {', '.join(sorted(known))}",
            )
        check_text(self.function)
        names, contacts = dict(graph.names), (len(graph.frictions), len(graph.gaps))
        found = evaluated(graph, self.function, *(known[name] for name in self.arguments))
        graph.names = names  # those of the equations alone
        if (len(graph.frictions), len(graph.gaps)) != contacts:
            self.refuse("a contact", "contacts of the equations, whose force they give a name to")
        if not isinstance(found, Node):
            self.refuse(f"{found!r:.60} as its value", "one value that depends on a state or a parameter")
        return graph.number(found)


_told: set[tuple[str, str]] = set()  # quantities, and what a string lacked, each of which is told of once


def tell_of_lacking(one: Measured, argument: str) -> None:
    """Warn that a quantity is not measured, as a string has no such argument."""
    if (one.name, argument) not in _told:
        _told.add((one.name, argument))
        warn(f"{one.origin}: feature {one.name}: not measured of this string, which has no {argument}.", RunWarning)


def _share_of(part: str, whole: str) -> Callable[[Array, Array], Array]:
    """One feature over another, 0 where both are, and 1 where these are no numbers."""

    def share(part: Array, whole: Array) -> Array:
        found = np.divide(part, whole, out=np.zeros_like(whole), where=whole != 0.0)
        return np.where(np.isfinite(part) & np.isfinite(whole), found, 1.0)

    reads = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in (part, whole)]
    share.__signature__ = inspect.Signature(reads)  # type: ignore[attr-defined]
    return share


def _names_in(graph: Graph) -> list[str]:
    return [name for name in graph.names if not name.startswith("_")]


def on_rows(value: Node) -> Node:
    """A value of equations as one of rows, whose names have no kind before them."""

    def change(new: Graph, of: Callable[[Node], Node], node: Node) -> Node:
        if node.op == "input":
            return new.input(str(node.extra).rpartition(".")[2])
        return new.again(node.op, [of(arg) for arg in node.args], node.extra)

    return rewritten(value.graph, {"": value}, change)[1][""]


def power_of_two(value: float) -> float:
    """The nearest power of two, 0.1 of what does not move."""
    return 2.0 ** round(math.log2(value)) if value > RESTING else 0.1


def graph_of(motion: Motion) -> tuple[Graph, tuple[str, ...], tuple[str, ...]]:
    """(the graph of equations, the names of their states, of their lane parameters)."""
    graph, _, _ = traced(motion.equations, motion.states, motion.parameters, motion.options)
    return graph, motion.states, motion.parameters


@lru_cache
def nodes_of(motion: Motion, features: tuple[Measured, ...]) -> Mapping[str, Node]:
    """The values of quantities in the graph of equations, by name."""
    graph, states, parameters = graph_of(motion)
    return {one.name: one.node(graph, states, parameters) for one in features}


def with_measures(declaration: Declaration, features: Iterable[Measured]) -> Declaration:
    """A declaration with the features of these quantities, but without their channels."""
    return replace(declaration, features=(*declaration.features, *(part for one in features for part in one.measures)))


def with_channels(
    declaration: Declaration, features: tuple[Measured, ...], nodes: Mapping[str, Node], rates: plain.Rates
) -> Declaration:
    """A declaration with the channels of these quantities, whose values are ``nodes`` of
    rows that change at these ``rates``."""
    channels = tuple(quantity_channel(one.name, nodes[one.name], rates, one.scale) for one in features)
    return replace(declaration, channels=(*declaration.channels, *channels))


def quantity_channel(name: str, node: Node, rates: plain.Rates, scale: str | float | None) -> Channel:
    """The channel of a quantity, whose value is this node of the graph of the equations."""
    value = on_rows(node)
    pair = plain.followed_node(value, rates)
    return Channel(name, *pair, scale=scale, within=plain.followed_within(value, rates))


def rates_of(motion: Motion, slopes: Iterable[str], turning: Iterable[str], set_speed: str) -> plain.Rates:
    """How fast the rows of equations change, whose slopes are in the rows ``slopes``;
    positions that are ``turning`` are measured from the angle of the drive."""
    states, turned = motion.states, frozenset(turning)
    pairs = 2 * (len(states) - len(motion.slopes))  # a pair has one slope, a state of first order its own

    def rates(rows: plain.Rows) -> dict[str, Any]:
        found: dict[str, Any] = {"time": 1.0, "phase": 0.0, **dict.fromkeys(motion.parameters, 0.0)}
        for x, v in zip(states[:pairs:2], states[1:pairs:2], strict=True):
            velocity = getattr(rows, v)
            found[x] = velocity - getattr(rows, set_speed) if x in turned else velocity
        return found | {name: getattr(rows, row) for name, row in zip(motion.slopes, slopes, strict=False)}

    return rates
