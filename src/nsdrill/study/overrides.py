"""``--set key=value``: puts values into a document before it is validated, so that they
meet the same checks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nsdrill.errors import Fault, StudyError
from nsdrill.study.document import Document, KeyPath, Place, dotted, odd_character, parse
from nsdrill.study.keys import AROUND, axes_of_all, shown


def apply(document: Document, overrides: Sequence[str]) -> None:
    """Applies each ``key=value``, the value as YAML, in order; what cannot be applied
    becomes a fault."""
    if document.data is None:
        document.data = {}
    for text in overrides:
        key, equals, value = text.partition("=")
        path = path_of(key.strip())
        if not equals or not all(path) or odd_character(key):
            document.faults.append(
                Fault("", f"--set {text[:80]}", "--set key=value, as in --set operation.wob=30kN")
            )
            continue
        label = f"--set {text[:80]}"
        try:
            parsed = parse(value, label)
        except StudyError as error:
            found = f"{error.faults[0].found} ({label})"
            document.faults.append(Fault(dotted(path), found, "a value in YAML"))
            continue
        document.faults.extend(parsed.faults)
        _put(document, path, parsed.data if value.strip() else None, Place(override=label))


def path_of(key: str) -> KeyPath:
    """The place of a dotted key; an axis of the sweep, or an unknown, is one part,
    however many dots it has."""
    first, *rest = key.split(".")
    before: KeyPath = (first,)
    if first == "uncertain" and rest[:1] == ["table"]:
        before, rest = (first, "table"), rest[1:]
    for length in range(len(rest), 1, -1):
        if first in AROUND and ".".join(rest[:length]) in axes_of_all():
            return (*before, ".".join(rest[:length]), *rest[length:])
    if before == ("uncertain",) and len(rest) > 1 and rest[0] not in axes_of_all():
        return (*before, ".".join(rest))  # no such key, which is said of the whole of it
    return (*before, *rest)


def _put(document: Document, path: KeyPath, value: Any, place: Place) -> None:
    inside = document.data
    for depth, part in enumerate(path[:-1], start=1):
        if not isinstance(inside, dict):
            break
        if inside.get(part) is None:  # not there, or an empty section
            inside[part] = {}
            document.values[path[:depth]] = document.keys[path[:depth]] = place
        inside = inside[part]
    if not isinstance(inside, dict):
        found = f"{shown(inside)}, which has no keys to set ({place.override})"
        document.faults.append(
            Fault(dotted(path[:-1]), found, "a mapping, or --set of the whole value")
        )
        return
    for places in (document.values, document.keys):
        for old in [known for known in places if known[: len(path)] == path]:
            del places[old]
        places[path] = place
    inside[path[-1]] = value
