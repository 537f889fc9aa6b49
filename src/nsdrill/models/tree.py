"""Values in trees of parameter records by their dotted keys."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from typing import Any, TypeVar

from nsdrill.data import read_only
from nsdrill.models.operation import ModelParameters, Numeric

Tree = TypeVar("Tree")


def leaves(record: Any, prefix: str = "") -> Iterator[tuple[str, Any, Mapping[str, Any]]]:
    """(dotted key, value, metadata) of each leaf of a tree of parameter records."""
    for item in fields(record):
        value, key = getattr(record, item.name), f"{prefix}{item.name}"
        if is_dataclass(value):
            yield from leaves(value, f"{key}.")
        else:
            yield key, value, item.metadata


@lru_cache
def marked(parameters: type, mark: str) -> dict[str, Any]:
    """The fields of a tree of parameters of this class that are marked as ``mark`` by
    :func:`nsdrill.ranges.parameter`: the marks by dotted key."""
    return {key: meta[mark] for key, _, meta in leaves(parameters()) if mark in meta}


def lanes_of(parameters: type) -> tuple[str, ...]:
    """The names in the equations of the numbers that these read as they are."""
    return tuple(marked(parameters, "lane").values())


def lane_values(parameters: ModelParameters) -> dict[str, Numeric]:
    """The values of :func:`lanes_of` by their names."""
    cls: type = type(parameters)
    return {name: value_of(parameters, key) for key, name in marked(cls, "lane").items()}


def value_of(tree: object, key: str) -> Any:
    """The value at a dotted key."""
    for name in key.split("."):
        tree = getattr(tree, name)
    return tree


def with_values(tree: Tree, values: Mapping[str, object]) -> Tree:
    """A copy of a tree of frozen dataclasses with these values, numbers or arrays
    [points], which it cannot write to, at dotted keys.

    The values are not checked here: the caller has done so. AttributeError for a key
    that does not exist.
    """
    changed = copy.copy(tree)
    of_parts: dict[str, tuple[object, dict[str, object]]] = {}
    for key, value in values.items():
        name, _, rest = key.partition(".")
        part = getattr(tree, name)
        if rest:
            of_parts.setdefault(name, (part, {}))[1][rest] = value
        else:
            object.__setattr__(changed, name, read_only(value))
    for name, (part, of_part) in of_parts.items():
        object.__setattr__(changed, name, with_values(part, of_part))
    return changed
