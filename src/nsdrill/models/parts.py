"""The parameters and the start at the points of a sweep: those whose values are compiled in,
such as the words of a choice, have one value in each part of the sweep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from nsdrill.data import Array
from nsdrill.models.choices import is_compiled_in, word_at, words_of
from nsdrill.models.model_description import Description
from nsdrill.models.operation import Numeric, P, Values
from nsdrill.models.starts import Starts
from nsdrill.models.tree import value_of, with_values


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
    return Values(with_values(parameters, rest), with_values(initial, start), tuple(map(values.__getitem__, names)))


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
