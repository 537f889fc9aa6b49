"""Descriptions of models with what scripts add to them: words of a choice, and keys."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field, fields, is_dataclass, make_dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, get_args, get_type_hints

if TYPE_CHECKING:
    from nsdrill.models.description import Description

Row = tuple[str, Any, Any]  # a field of a dataclass: name, type, default with metadata


def subclass(base: type, rows: list[Row]) -> Any:
    """A dataclass as ``base`` with other or further fields."""
    made = make_dataclass(base.__name__, rows, bases=(base,), frozen=True)
    made.__module__ = base.__module__
    return made


def with_rows(record: type, path: tuple[str, ...], rows: list[Row]) -> Any:
    """A tree of dataclasses with these fields in the section at ``path``."""
    if not path:
        return subclass(record, rows)
    item = next(one for one in fields(record) if one.name == path[0])
    inner = with_rows(item.default_factory, path[1:], rows)  # type: ignore[arg-type]
    return subclass(record, [(path[0], inner, field(default_factory=inner, metadata=item.metadata))])


def section_at(record: type, path: tuple[str, ...]) -> Any:
    """The dataclass of the section at ``path``, None where there is none."""
    for name in path:
        item = next((one for one in fields(record) if one.name == name), None)
        if item is None or not is_dataclass(item.default_factory):
            return None
        record = item.default_factory
    return record


def row_with_words(section: type, name: str, words: Iterable[str]) -> Row:
    """The choice ``name`` of a section with more words."""
    item = next(one for one in fields(section) if one.name == name)
    known = (*get_args(get_type_hints(section)[name]), *words)
    return name, Literal[known], field(default=item.default, metadata=item.metadata)


def with_words(description: Description, choices: Iterable[tuple[str, ...]], words: tuple[str, ...]) -> Description:
    """A description with more ``words`` of these choices, as far as it has them."""
    parameters = description.parameters
    for *path, name in choices if words else ():
        section = section_at(parameters, tuple(path))
        if section is not None and name in {one.name for one in fields(section)}:
            parameters = with_rows(parameters, tuple(path), [row_with_words(section, name, words)])
    return replace(description, parameters=parameters)
