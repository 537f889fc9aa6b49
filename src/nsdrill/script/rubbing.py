"""Whether contacts with friction of a script brake at all values of a study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product
from typing import Any

import numpy as np

from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.library import Friction
from nsdrill.errors import Fault
from nsdrill.models.rules import Rule
from nsdrill.script.driving import ROUNDING, WORDS, number_of
from nsdrill.script.reading import Reading

MOST_CORNERS = 4096  # of the axes that one number of a contact reads


def brakes(reading: Reading, section: str) -> Rule:
    """Friction is refused that does not brake, or rises with the slip, at the values of a
    study: at each end of axes, and at each sample of uncertain numbers. Asked are numbers of a
    contact that follow from parameters alone, which are keys of ``section``; the others are
    watched in each run (:mod:`.driving`)."""
    keys = {name: f"{section}.{name}" for name in reading.signature.parameters}
    asked = list(_asked(reading.graph, keys))

    def faults(check: Any) -> Iterator[Fault]:
        told: set[str] = set()
        for contact, what, node, names in asked:
            for values in _corners(check, {name: keys[name] for name in names}):
                scale = reading.graph.number(contact.numbers.dynamic if what == "rise" else 0.0)
                found = plain.values({"": node, "size": scale}, reading.given({}, values))
                value, size = np.broadcast_arrays(found[""], found["size"])
                if np.all(value >= -ROUNDING * np.abs(size)):
                    continue
                place = int(np.argmin(np.ravel(value)))
                key = check.swept(next((keys[n] for n in names if _is_chosen(check, keys[n])), keys[names[0]]))
                if key not in told:
                    told.add(key)
                    yield check.fault(key, *_words(contact.name, what, value, place, values, names))
                break

    return Rule(faults, tuple(keys.values()))


def _asked(graph: Graph, keys: Mapping[str, str]) -> Iterator[tuple[Friction, str, Node, list[str]]]:
    """(contact, number, its value, the parameters of ``keys`` that it reads) of each number of
    each contact."""
    for contact in graph.frictions:
        for what in WORDS:
            node = number_of(graph, contact, what)
            inputs = graph.inputs_of([node, *([graph.number(contact.numbers.dynamic)] if what == "rise" else [])])
            names = [name for name in keys if f"p.{name}" in inputs]
            if names and len(names) == len(inputs):
                yield contact, what, node, names


def _corners(check: Any, keys: Mapping[str, str]) -> Iterator[dict[str, Any]]:
    """The values of parameters at each corner of the axes; of those that are uncertain, all
    samples, which go together."""
    drawn = {name: check.drawn[axis] for name, key in keys.items() if (axis := check.axis(key)) in check.drawn}
    ends = {name: set(check.ends(key)) for name, key in keys.items() if name not in drawn}
    if followed := check.resolved.get("continue"):
        for name, key in keys.items():
            if key == followed["along"] and name in ends:
                ends[name] |= {followed["from"], followed["to"]}
    for values in islice(product(*ends.values()), MOST_CORNERS):
        yield dict(zip(ends, values, strict=True)) | drawn


def _is_chosen(check: Any, key: str) -> bool:
    """Whether a study says what a parameter is."""
    return check.axis(key) is not None or check.value(key) != check.default(key)


def _words(
    contact: str, what: str, value: Any, place: int, values: Mapping[str, Any], names: Sequence[str]
) -> tuple[str, str]:
    """(what was found, what is allowed)."""
    at = ", ".join(f"{name} = {float(np.broadcast_to(values[name], value.shape).flat[place]):g}" for name in names)
    remedy = "orders=('dynamic <= static',) of nsdrill.model" if what == "rise" else "low=0.0 of nsdrill.number"
    return (
        f"{WORDS[what]} of {float(value.flat[place]):g} in the friction {contact!r}, at {at}",
        f"at least 0, so that it brakes. Every study keeps to that where the script has {remedy}",
    )
