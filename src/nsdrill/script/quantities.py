"""Quantities that a script measures of its model: functions of its states, its parameters
and what its equations give a name to, read in their graph."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from types import FunctionType
from typing import NoReturn

from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.trace import check_text, evaluated
from nsdrill.errors import InputError
from nsdrill.script.signature import NAME, Signature, number

MEASURED = {"max": "greatest", "min": "least", "mean": "mean"}  # ends of the names of features, with words


@dataclass(frozen=True)
class Measured:
    """A quantity with a ``name`` and the ``function`` that gives it, of which features with
    these ``ends`` are made; ``about`` has its units and its meaning."""

    name: str
    function: FunctionType
    about: number
    ends: tuple[str, ...]

    @property
    def features(self) -> dict[str, str]:
        """The names of its features, with the words for their ends."""
        return {f"{self.name}_{end}": MEASURED[end] for end in self.ends}

    @property
    def told(self) -> tuple[object, ...]:
        """What is measured, beside the graph, for a digest."""
        return self.name, self.about.units, self.ends

    def refuse(self, found: str, allowed: str) -> NoReturn:
        code = self.function.__code__
        raise InputError(
            f"{code.co_filename}, line {code.co_firstlineno}: feature {self.name}: found {found}; allowed: {allowed}."
        )

    def node(self, graph: Graph, signature: Signature) -> Node:
        """Its value in the graph of the equations. InputError where it reads what these do not
        have, or is no value; LanguageError where it does what lanes cannot."""
        known = {name: node for name, node in graph.names.items() if not name.startswith("_")}
        known |= {name: graph.input(f"p.{name}") for name in signature.parameters}
        known |= {name: graph.input(f"s.{name}") for name in signature.start}
        arguments = inspect.signature(self.function).parameters
        if unknown := [name for name in arguments if name not in known]:
            self.refuse(
                f"the argument {unknown[0]}",
                f"states, parameters and names that the equations give a value to: {', '.join(sorted(known))}",
            )
        check_text(self.function)
        names, contacts = dict(graph.names), (len(graph.frictions), len(graph.gaps))
        found = evaluated(graph, self.function, *(known[name] for name in arguments))
        graph.names = names  # those of the equations alone
        if (len(graph.frictions), len(graph.gaps)) != contacts:
            self.refuse("a contact", "contacts of the equations, whose force they give a name to")
        if not isinstance(found, Node):
            self.refuse(f"{found!r:.60} as its value", "one value that depends on a state or a parameter")
        return found


def measured(
    function: object, name: str, units: str, meaning: str, ends: Sequence[str], known: Sequence[Measured]
) -> Measured:
    """A quantity as a script declares it; InputError where it is none."""
    if not isinstance(function, FunctionType):
        raise InputError(
            f"feature {name!r}: found {function!r:.80}; allowed: a function, as a decorator above its def."
        )
    found = Measured(name, function, number(0.0, units, meaning), tuple(ends or MEASURED))
    if not isinstance(name, str) or not NAME.fullmatch(name):
        found.refuse(f"the name {name!r}", "letters, digits and single underscores between them, a letter first")
    kinds = {one.kind for one in inspect.signature(function).parameters.values()}
    if kinds - {inspect.Parameter.POSITIONAL_OR_KEYWORD}:
        found.refuse(f"the arguments {inspect.signature(function)}", "names alone, as (v, rub)")
    if any(one.name == name for one in known):
        found.refuse("another of this name", "one of each name")
    return found
