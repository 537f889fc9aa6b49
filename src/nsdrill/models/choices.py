"""What a sweep may vary beside the operating point: numbers, and choices such as the kind of
a drive. Along a choice a value is the index of its word among :func:`words_of` it, so that
points are numbers everywhere; studies, files and output have the words."""

from __future__ import annotations

import typing
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from typing import Any, Literal

from nsdrill.models.model_description import Description
from nsdrill.models.operation import ModelParameters
from nsdrill.models.registry import NAMES, of_all, of_known_models
from nsdrill.models.starts import Starts
from nsdrill.models.tree import leaves, value_of
from nsdrill.variables import AXES, COORDINATES, dimension_of, short_key

OF_SCRIPTS = "parameters"  # the section of a script's numbers, which no model of nsdrill has
SWITCH = ("false", "true")  # the words of a switch


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


def _choices_with(key: str) -> Iterator[Mapping[str, tuple[str, ...]]]:
    """The choices of all models that may have this key or dimension: one in the section of a
    script's numbers is known without importing those of nsdrill."""
    return (choices for _, choices in of_all(choices_of, without=NAMES if key.startswith(OF_SCRIPTS) else ()))


@of_known_models
def words_of(key: str) -> tuple[str, ...]:
    """The words of the choice at this dotted key, those of all models that have it; ()
    for a number. The index of a word among them is its value along an axis."""
    if "." not in key:  # an operating value, known without importing a model
        return ()
    return tuple(dict.fromkeys(word for choices in _choices_with(key) for word in choices.get(key, ())))


@of_known_models
def words_along(name: str) -> tuple[str, ...]:
    """As :func:`words_of`, by the name of the dimension."""
    if name in COORDINATES:  # known without importing a model
        return ()
    keys = (key for choices in _choices_with(name) for key in choices if dimension_of(key) == name)
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


def word_in(parameters: ModelParameters, initial: Starts, key: str) -> str:
    """The word of the choice at this key, of the parameters or of the start."""
    start = key.startswith("initial.")
    word = value_of(initial if start else parameters, key.removeprefix("initial.") if start else key)
    return str(word).lower() if isinstance(word, bool) else str(word)
