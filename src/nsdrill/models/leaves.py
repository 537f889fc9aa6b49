"""Values inside trees of parameter records by their dotted keys: the numbers that a
sweep varies from point to point.

A choice, such as the kind of a drive, can be an axis too. Along such an axis a value is
the index of its word among :func:`words_of` the choice, so that points are numbers
everywhere; studies, files and output have the words.
"""

from __future__ import annotations

import copy
import typing
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import lru_cache
from itertools import product
from typing import Any, Literal, TypeVar

import numpy as np

from nsdrill.data import Array, read_only
from nsdrill.models.description import Description
from nsdrill.models.operation import ModelParameters, Numeric, P, Values
from nsdrill.models.registry import of_all, of_known_models
from nsdrill.models.starts import Starts
from nsdrill.variables import AXES, COORDINATES, dimension_of, short_key

SWITCH = ("false", "true")  # the words of a switch


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
def further_axes(model: Description) -> dict[str, tuple[str, str]]:
    """The numbers beside :data:`nsdrill.variables.AXES` that a sweep of the ``model`` may
    vary: by the name of the dimension the key and the SI units, those of the first choice
    where they depend on one."""
    axes: dict[str, tuple[str, str]] = {}
    for key, value, meta in (*leaves(model.parameters()), *leaves(model.initial(), "initial.")):
        number = isinstance(value, float) or (value is None and "units" in meta and "most" not in meta)
        if number or "words" in meta or key in model.compiled or key in choices_of(model):
            units = next(iter(model.units_by[key][1].values())) if key in model.units_by else meta.get("units", "")
            axes[dimension_of(key)] = (key, units)
    del axes["initial_spread"]
    own = {key: meta for key, _, meta in leaves(model.operation(), "operation.") if short_key(key) not in AXES}
    return {short_key(key): (short_key(key), meta.get("units", "")) for key, meta in own.items()} | axes


@lru_cache
def choices_of(model: Description) -> dict[str, tuple[str, ...]]:
    """The words of each choice of the ``model`` that a sweep may vary, by its
    key. A choice that decides the units of a number is excluded, as one number cannot
    be in several units."""
    deciding = model.deciding
    choices: dict[str, tuple[str, ...]] = {}

    def visit(cls: type, prefix: str) -> None:
        hints = typing.get_type_hints(cls)
        for item in fields(cls):
            hint, key = hints[item.name], f"{prefix}{item.name}"
            if is_dataclass(hint) and isinstance(hint, type):
                visit(hint, f"{key}.")
            elif key not in deciding and (hint is bool or typing.get_origin(hint) is Literal):
                choices[key] = SWITCH if hint is bool else typing.get_args(hint)

    visit(model.parameters, "")
    visit(model.initial, "initial.")
    return choices


@of_known_models
def words_of(key: str) -> tuple[str, ...]:
    """The words of the choice at this dotted key, those of all models that have it; ()
    for a number. The index of a word among them is its value along an axis."""
    if "." not in key:  # an operating value, known without importing a model
        return ()
    return tuple(dict.fromkeys(word for _, choices in of_all(choices_of) for word in choices.get(key, ())))


@of_known_models
def words_along(name: str) -> tuple[str, ...]:
    """As :func:`words_of`, by the name of the dimension."""
    if name in COORDINATES:  # known without importing a model
        return ()
    keys = (key for _, choices in of_all(choices_of) for key in choices if dimension_of(key) == name)
    return next(map(words_of, keys), ())


def place_of(key: str, word: str | bool) -> float:
    """The value of a word along an axis. ValueError for a word that the choice
    lacks."""
    return float(words_of(key).index(str(word).lower() if isinstance(word, bool) else word))


def word_at(key: str, value: float) -> str | bool:
    """The inverse of :func:`place_of`: a word, or whether a switch is on."""
    words = words_of(key)
    return bool(value) if words == SWITCH else words[int(value)]


def word_or_number(key: str, value: float) -> float | str:
    """A value along an axis as files and output have it: a number as it is, or a
    word."""
    words = words_of(key) or words_along(key)
    return words[int(value)] if words else value


def as_value(key: str, text: float | str) -> float:
    """The inverse of :func:`word_or_number`. ValueError for what is neither a number nor a
    word of the choice."""
    words = words_of(key) or words_along(key)
    return float(words.index(text) if isinstance(text, str) and words else text)


def in_words(data: Any, about: str = "") -> Any:
    """Plain data with words in place of the values of choices: under keys that are such
    an axis, and at the ends of a range along one. The axis of a range is ``about``: the
    key around the range, or its entry ``axis``."""
    if isinstance(data, list | tuple):
        return [in_words(item, about) for item in data]
    if isinstance(data, dict):
        axis = str(data.get("axis", about))
        return {
            key: in_words(item, str(key) if _choice(str(key)) else axis if key in _RANGE_KEYS else "")
            for key, item in data.items()
        }
    return _choice(about)[int(data)] if isinstance(data, float) and _choice(about) else data


_RANGE_KEYS = ("from", "to", "values")


def _choice(name: str) -> tuple[str, ...]:
    return words_along(dimension_of(name)) if name else ()


def is_compiled_in(model: Description, key: str) -> bool:
    """Whether each value along this axis has its own compiled code: the axis is a
    choice, or a number that is compiled in."""
    return key in model.compiled or key in choices_of(model)


def in_parts(model: Description, values: Mapping[str, Array]) -> Iterator[tuple[dict[str, float], Array | slice]]:
    """The points with these ``values``, arrays [points], in parts in which each axis
    that :func:`is_compiled_in` has one value. Yields those values by key, and the indices of
    the points; without such an axis there is one part with all points."""
    keys = [key for key in values if is_compiled_in(model, key)]
    if not keys:
        yield {}, slice(None)
        return
    distinct, part_of = np.unique([np.atleast_1d(values[key]) for key in keys], axis=1, return_inverse=True)
    for number, row in enumerate(distinct.T):
        compiled = {key: float(value) if words_of(key) else int(value) for key, value in zip(keys, row, strict=True)}
        yield compiled, np.flatnonzero(part_of.ravel() == number)


def values_at(parameters: P, initial: Starts, values: Mapping[str, Numeric]) -> Values[P]:
    """``parameters`` and ``initial`` with the ``values`` of the axes, those of the
    operation among them. A choice has one value, and the keys that its word does not
    read have their defaults."""
    if chosen := {key: value for key, value in values.items() if words_of(key)}:
        parameters, initial, unread = chosen_at(parameters, initial, chosen)
        values = {key: value for key, value in values.items() if key not in chosen and key not in unread}
    names = parameters.point.names()
    further = {key: value for key, value in values.items() if key not in names}
    start = {key.removeprefix("initial."): value for key, value in further.items() if key.startswith("initial.")}
    rest = {key: value for key, value in further.items() if not key.startswith("initial.")}
    return Values(with_values(parameters, rest), with_values(initial, start), tuple(values[name] for name in names))


def part_at(parameters: P, initial: Starts, compiled: Mapping[str, float]) -> tuple[P, Starts]:
    """``parameters`` and ``initial`` of one part (:func:`in_parts`), whose values are
    ``compiled``."""
    chosen = {key: value for key, value in compiled.items() if words_of(key)}
    parameters = with_values(parameters, {key: value for key, value in compiled.items() if key not in chosen})
    if chosen:
        parameters, initial, _ = chosen_at(parameters, initial, chosen)
    return parameters, initial


def values_in_parts(
    model: Description, parameters: P, initial: Starts, values: Mapping[str, Array]
) -> Iterator[tuple[Values[P], Array | slice]]:
    """:func:`values_at` of each of the parts (:func:`in_parts`), with the indices of its
    points."""
    for compiled, there in in_parts(model, values):
        here = {key: value[there] for key, value in values.items()} | compiled
        yield values_at(parameters, initial, here), there


def parts_of(model: Description, parameters: P, initial: Starts, axes: Mapping[str, Array]) -> list[tuple[P, Starts]]:
    """The parameters and the start of every part of a sweep of these ``axes``, without
    the values of the other axes."""
    compiled = {key: np.unique(values).tolist() for key, values in axes.items() if is_compiled_in(model, key)}
    return [part_at(parameters, initial, dict(zip(compiled, row, strict=True))) for row in product(*compiled.values())]


def states_of_all(several: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """All states of several strings of one model, the angle of the drive last."""
    most = max(several, key=len)
    more = dict.fromkeys(name for names in several for name in names if name not in most)
    return (*most[:-1], *more, most[-1])


def chosen_at(parameters: P, initial: Starts, chosen: Mapping[str, Numeric]) -> tuple[P, Starts, frozenset[str]]:
    """``parameters`` and ``initial`` with these words of choices, by key and as
    indices; and the keys that a string with these words does not read, which have their
    defaults in both."""
    words = {key: word_at(key, float(np.unique(index).item())) for key, index in chosen.items()}
    start = {key.removeprefix("initial."): word for key, word in words.items() if key.startswith("initial.")}
    parameters = with_values(parameters, {key: word for key, word in words.items() if not key.startswith("initial.")})
    initial = with_values(initial, start)
    unread, default, first = parameters.unread, type(parameters)(), type(initial)()
    for key in unread:
        if key.startswith("initial."):
            name = key.removeprefix("initial.")
            initial = with_values(initial, {name: getattr(first, name)})
        else:
            parameters = with_values(parameters, {key: value_of(default, key)})
    return parameters, initial, unread


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


def word_in(parameters: ModelParameters, initial: Starts, key: str) -> str:
    """The word of the choice at this key, of the parameters or of the start."""
    start = key.startswith("initial.")
    word = value_of(initial if start else parameters, key.removeprefix("initial.") if start else key)
    return str(word).lower() if isinstance(word, bool) else str(word)


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
