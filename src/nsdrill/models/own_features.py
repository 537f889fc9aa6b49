"""Quantities that a script measures of a model: functions of its states, its lane
parameters and what its equations give a name to, read in their graph. They are followed
inside each step as the channels of the model are, and are in its traces."""

from __future__ import annotations

import hashlib
import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from types import FunctionType
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node, rewritten, text_of
from nsdrill.equations.trace import check_text, evaluated, traced
from nsdrill.errors import InputError
from nsdrill.models.description import Description
from nsdrill.models.leaves import Values
from nsdrill.models.registry import (
    check_new_name,
    described,
    extend_models,
    measuring,
    model_named,
    model_names,
    own_features,
    register_feature,
    scripted,
)
from nsdrill.models.responses import Thresholds
from nsdrill.observe.channels import Channel, Declaration, Extremes, Feature, Mean
from nsdrill.unit_table import CF
from nsdrill.variables import feature, in_trace

if TYPE_CHECKING:
    from nsdrill.equations.motion import Motion
    from nsdrill.models.base import Model, Variant

MEASURED = {"max": "greatest", "min": "least", "mean": "mean"}  # ends of the names of features, with words
PROBES = 64  # states at which the size of a quantity is looked at
RESTING = 1e-12  # what stays below this does not move
SPREAD = 10.0  # in natural scales: as far as a motion goes


@dataclass(frozen=True)
class Measured:
    """A quantity with a ``name`` and the ``function`` that gives it, of which features with
    these ``ends`` are made; ``about`` has its units, its meaning and perhaps its scale."""

    name: str
    function: FunctionType
    about: Any
    ends: tuple[str, ...]

    @property
    def features(self) -> dict[str, str]:
        """The names of its features, with the words for their ends."""
        return {f"{self.name}_{end}": MEASURED[end] for end in self.ends}

    @property
    def measures(self) -> tuple[Feature, ...]:
        """What a declaration has of its channel, which has its name."""
        names = {end: f"{self.name}_{end}" for end in self.ends}
        extremes = Extremes(self.name, greatest=names.get("max"), least=names.get("min"))
        return (
            *((extremes,) if "max" in names or "min" in names else ()),
            *((Mean(self.name, names["mean"]),) if "mean" in names else ()),
        )

    @property
    def told(self) -> tuple[object, ...]:
        """What is measured, beside the graph, for a digest."""
        return self.name, self.about.units, self.ends

    def refuse(self, found: str, allowed: str) -> NoReturn:
        code = self.function.__code__
        raise InputError(
            f"{code.co_filename}, line {code.co_firstlineno}: feature {self.name}: found {found}; allowed: {allowed}."
        )

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
        return found


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


# Of models of nsdrill and of packages.


def measure(model: str, made: Measured) -> None:
    """Measure a quantity of the model of this name, in place of an earlier one of the same
    script. InputError where there is no such model, or the name is taken."""
    if model not in model_names() or scripted(model) is not None:
        how = f"@{model}.feature above its function" if scripted(model) is not None else ", ".join(model_names())
        made.refuse(f"the model {model}", how)
    before = next((one for one in own_features(model) if one.name == made.name), None)
    if before is not None:
        code = made.function.__code__
        check_new_name("a feature", made.name, before.function.__code__.co_filename, code.co_filename)
    description = described(model)
    own = set() if before is None else {before.name, *before.features}
    taken = {variable.name for variable in (*description.variables, *description.trace_and_states)} - own
    for name in (made.name, *made.features):
        if name in taken:
            made.refuse(f"the name {name}, which {model} has", "another name")
    _first(model, made)  # refused where no string of the model has its arguments
    register_feature(model, made)
    extend_models((model,), described_with)


def _first(name: str, made: Measured) -> tuple[Model, Variant, Node]:
    """(the model, the first of the usual and the widest variant that has the arguments of a
    quantity, its value there)."""
    model = model_named(name)
    variants = model.variant(described(name).parameters()), model.widest
    found = [(variant, *_graph_of(model.motion(variant))) for variant in variants]
    for variant, graph, states, parameters in found:
        if not made.unknown(graph, states, parameters):
            return model, variant, made.node(graph, states, parameters)
    made.node(*found[0][1:])
    raise AssertionError


def _graph_of(motion: Motion) -> tuple[Graph, tuple[str, ...], tuple[str, ...]]:
    graph, _, _ = traced(motion.equations, motion.states, motion.parameters, motion.options)
    return graph, motion.states, motion.parameters


@lru_cache
def nodes_of(motion: Motion, features: tuple[Measured, ...]) -> Mapping[str, Node]:
    """The values of quantities in the graph of equations, by name."""
    graph, states, parameters = _graph_of(motion)
    return {one.name: one.node(graph, states, parameters) for one in features}


@lru_cache
def scale_of(name: str, made: Measured) -> float:
    """The natural scale of a quantity: its own, or a tenth of its greatest value as far as
    motions go at the model's defaults."""
    if made.about.scale is not None:
        return float(made.about.scale)
    model, variant, node = _first(name, made)
    description = described(name)
    operation = tuple(vars(description.operation()).values())
    columns = model.columns(Values(description.parameters(), description.initial(), operation), Thresholds())
    names = model.names(variant)
    table = np.array([[float(np.ravel(columns.get(one, 0.0))[0]) for one in names.parameters]])
    reach = SPREAD * model.state_scales(table, variant)[0]
    moved = np.random.default_rng(1).uniform(-1.0, 1.0, (PROBES, len(names.states))) * reach
    given: dict[str, Any] = {"time": 0.0, "phase": 0.0}
    given |= {f"p.{one}": value for one, value in zip(names.parameters, table[0], strict=True)}
    given |= {f"s.{one}": moved[:, k] for k, one in enumerate(names.states)}
    value = np.nan_to_num(np.abs(plain.values({"": node}, given)[""]), posinf=0.0)
    return power_of_two(0.1 * float(np.max(value)))


_watched: dict[object, Declaration] = {}


def watched(model: Model, variant: Variant) -> Declaration:
    """The declaration of a model with the quantities that scripts measure of it."""
    declaration, features = model.declaration(variant), own_features(model.name)
    if not features:
        return declaration
    key = model.name, tuple(variant), features
    if key not in _watched:
        nodes, rates = nodes_of(model.motion(variant), features), rates_of(model, variant)
        channels = tuple(
            Channel(one.name, *plain.followed_node(on_rows(nodes[one.name]), rates), scale=scale_of(model.name, one))
            for one in features
        )
        measures = tuple(part for one in features for part in one.measures)
        _watched[key] = replace(
            declaration, channels=(*declaration.channels, *channels), features=(*declaration.features, *measures)
        )
    return _watched[key]


def rates_of(model: Model, variant: Variant) -> plain.Rates:
    """How fast the rows of a model change."""
    names, slopes, turning = model.names(variant), model.slope_names(variant), model.turning(variant)
    pairs = len(names.states) - model.first_order(variant)

    def rates(rows: plain.Rows) -> dict[str, Any]:
        found: dict[str, Any] = {"time": 1.0, "phase": 0.0, **dict.fromkeys(names.parameters, 0.0)}
        for x, v in zip(names.states[:pairs:2], names.states[1:pairs:2], strict=True):
            velocity = getattr(rows, v)
            found[x] = velocity - getattr(rows, model.set_speed) if x in turning else velocity
        return found | {name: getattr(rows, row) for name, row in zip(slopes, names.slopes, strict=False)}

    return rates


def described_with(description: Description) -> Description:
    """The description of a model with the quantities that scripts measure of it."""
    features = own_features(description.name)
    units = {one.name: CF.get(one.about.units, one.about.units or "1") for one in features}
    words = {one.name: one.about.meaning or one.name.replace("_", " ") for one in features}
    made = [
        feature(name, units[one.name], f"{word} {words[one.name]}", signal=one.name)
        for one in features
        for name, word in one.features.items()
    ]
    return replace(
        description,
        features=(*description.features, *made),
        own_trace=(*description.own_trace, *(in_trace(name, units[name], words[name]) for name in units)),
        shown=(*description.shown, *(one.name for one in made)),
    )


def digest_of(model: str) -> str:
    """Digest of what scripts measure of a model, "" of nothing."""
    features: Sequence[Measured] = own_features(model)
    if not features:
        return ""
    text = repr([(one.told, text_of({"": _first(model, one)[2]})) for one in features])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


measuring |= {"watched": watched, "nodes_of": nodes_of}
