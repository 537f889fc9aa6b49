"""Searches on many strings in lockstep: each is a generator that asks its string, and what
they ask at the same time is answered together, as numpy takes little longer for many
numbers than for few. The bits of an answer do not depend on what is asked beside it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any, TypeVar

import numpy as np

from nsdrill.models.operation import Numeric
from nsdrill.models.steady import Ask, Search, String

MOST = 24  # strings at once: the tables of torque of their cycles take some 3 MB each

T = TypeVar("T")


def results(searches: Sequence[tuple[String, Search[T]]]) -> list[T]:
    """The results of many searches, each on its string."""
    return [found for k in range(0, len(searches), MOST) for found in _of_few(searches[k : k + MOST])]


def _of_few(searches: Sequence[tuple[String, Search[T]]]) -> list[T]:
    found: dict[int, T] = {}
    answers: dict[int, Any] = dict.fromkeys(range(len(searches)))
    stacks: dict[tuple[tuple[int, ...], tuple[int, ...]], String] = {}
    while answers:
        asked: dict[Any, list[tuple[int, Ask]]] = {}
        for k, answer in answers.items():
            string, search = searches[k]
            try:
                ask = search.send(answer)
            except StopIteration as end:
                found[k] = end.value
                continue
            alike = string.motion, string.turning, string.set_speed, string.driven, string.rubs, string.holds
            given = tuple(one is not None for one in ask.arguments)
            asked.setdefault((ask.method, given, *alike, *string.rest), []).append((k, ask))
        answers = {}
        for group in asked.values():
            places, asks = tuple(k for k, _ in group), [ask for _, ask in group]
            strings = [searches[k][0] for k in places]
            answers |= zip(places, _answered(strings, places, asks, stacks), strict=True)
    return [found[k] for k in range(len(searches))]


def _answered(
    strings: Sequence[String],
    places: tuple[int, ...],
    asks: Sequence[Ask],
    stacks: dict[tuple[tuple[int, ...], tuple[int, ...]], String],
) -> list[Any]:
    """The answers to the same question to each of these strings."""
    method = asks[0].method
    if len(strings) == 1:
        return [getattr(strings[0], method)(*asks[0].arguments)]
    shapes = [_shape(ask.arguments[0]) for ask in asks]
    sizes = tuple(math.prod(shape) for shape in shapes)
    if (places, sizes) not in stacks:
        stacks[places, sizes] = _stacked(strings, sizes)
    try:
        together = [_joined(parts, shapes) for parts in zip(*(ask.arguments for ask in asks), strict=True)]
        answer = getattr(stacks[places, sizes], method)(*together)
    except np.linalg.LinAlgError:  # of one of them
        return [getattr(one, method)(*ask.arguments) for one, ask in zip(strings, asks, strict=True)]
    ends = np.cumsum((0, *sizes))
    return [_part(answer, slice(ends[k], ends[k + 1]), shape) for k, shape in enumerate(shapes)]


def _shape(speeds: Any) -> tuple[int, ...]:
    """That of set speeds or of steady drilling at them."""
    return np.shape(speeds[0] if isinstance(speeds, tuple) else speeds)


def _joined(parts: Sequence[Any], shapes: Sequence[tuple[int, ...]]) -> Any:
    """One argument of several strings, one after the other."""
    if parts[0] is None:
        return None
    if isinstance(parts[0], tuple):
        return type(parts[0])(*(_joined(one, shapes) for one in zip(*parts, strict=True)))
    return np.concatenate(
        [
            np.reshape(one, (math.prod(shape), *np.shape(one)[len(shape) :]))
            for one, shape in zip(parts, shapes, strict=True)
        ]
    )


def _part(answer: Any, lanes: slice, shape: tuple[int, ...]) -> Any:
    if isinstance(answer, tuple):
        return type(answer)(*(_part(one, lanes, shape) for one in answer))
    return answer[lanes].reshape((*shape, *answer.shape[1:]))


def _stacked(strings: Sequence[String], sizes: tuple[int, ...]) -> String:
    """Strings side by side as one, of which each has as many lanes as ``sizes`` says."""
    ends = np.cumsum((0, *sizes))

    def table(set_speed: Numeric) -> Mapping[str, Numeric]:
        speeds = np.broadcast_to(set_speed, (ends[-1], *np.shape(set_speed)[1:]))
        parts = [
            (one, speeds[ends[run[0]] : ends[run[-1] + 1]]) for one, run in _tabled(strings, sizes, speeds.shape[1:])
        ]
        tables, lengths = [one(part) for one, part in parts], [len(part) for _, part in parts]
        return {name: _lanes([one[name] for one in tables], lengths, speeds.shape[1:]) for name in tables[0]}

    rest = {name: _lanes([one.rest[name] for one in strings], sizes) for name in strings[0].rest}
    stack = replace(strings[0], table=table, rest=rest, lanes=sizes)
    vars(stack)["holds"] = strings[0].holds  # as each of them does
    return stack


def _tabled(
    strings: Sequence[String], sizes: Sequence[int], beyond: tuple[int, ...]
) -> Iterator[tuple[Callable[[Numeric], Mapping[str, Numeric]], list[int]]]:
    """The tables of these strings, each with the places of the strings that it is of: one
    for neighbours that differ in their weight on bit alone."""
    weighted = [one.weighted for one in strings]
    for _, places in groupby(range(len(strings)), lambda k: k if (one := weighted[k]) is None else one.table_under):
        run = list(places)
        together = [one for k in run if (one := weighted[k]) is not None]
        if len(run) > 1:
            weights = _lanes([one.wob for one in together], [sizes[k] for k in run], beyond)
            yield together[0].table_under(weights), run
        else:
            yield strings[run[0]].table, run


def _lanes(values: Sequence[Numeric], sizes: Sequence[int], beyond: tuple[int, ...] = ()) -> Numeric:
    """One value of every lane, from one or as many of each string."""
    if not any(isinstance(value, np.ndarray) for value in values) and len(set(values)) == 1:
        return values[0]
    return np.concatenate([np.broadcast_to(value, (size, *beyond)) for value, size in zip(values, sizes, strict=True)])
