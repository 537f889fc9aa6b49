"""Descriptions of models with what scripts add to them: words of a choice, and the numbers
that only these words read. Several words may read one key; each has its own default."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field, fields, is_dataclass, make_dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, get_args, get_type_hints

from nsdrill.ranges import Follows, parameter

if TYPE_CHECKING:
    from nsdrill.models.model_description import Description

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


def number_rows(choice: str, numbers: Mapping[str, Mapping[str, Any]], lane: Callable[[str], str]) -> list[Row]:
    """The keys of a section for the ``numbers``, floats with units, range and meaning by
    name, that each word of its ``choice`` reads. ``lane`` names them among what equations
    read."""
    rows: list[Row] = []
    for name in dict.fromkeys(name for one in numbers.values() for name in one):
        by_word = {word: one[name] for word, one in numbers.items() if name in one}
        first = next(iter(by_word.values()))
        defaults = tuple((word, float(value)) for word, value in by_word.items())
        follows = Follows(choice, defaults, float(first)) if len({value for _, value in defaults}) > 1 else None
        meaning = f"{first.meaning or name.replace('_', ' ')}; {choice} {', '.join(by_word)}"
        about = {"low": first.low, "high": first.high, "meaning": meaning, "lane": lane(name), "follows": follows}
        made = parameter(float(first), first.units, **about)
        rows.append(
            (name, float, field(default=float(first), metadata={**made.metadata, "read_by": (choice, tuple(by_word))}))
        )
    return rows


def sharing_fault(numbers: Mapping[str, Any], others: Mapping[str, Mapping[str, Any]]) -> tuple[str, str] | None:
    """(a number, a word) where one of these ``numbers`` has another unit or range than that
    of its name that this one of the ``others`` reads; None where none has."""
    for word, other in others.items():
        for name in numbers.keys() & other.keys():
            if numbers[name].told[1:4] != other[name].told[1:4]:
                return name, word
    return None


def with_words(description: Description, choices: Iterable[tuple[str, ...]], words: tuple[str, ...]) -> Description:
    """A description with more ``words`` of these choices, as far as it has them."""
    parameters = description.parameters
    for *path, name in choices if words else ():
        section = section_at(parameters, tuple(path))
        if section is not None and name in {one.name for one in fields(section)}:
            parameters = with_rows(parameters, tuple(path), [row_with_words(section, name, words)])
    return replace(description, parameters=parameters)
