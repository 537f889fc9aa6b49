"""Numbers inside trees of parameter records, by their dotted keys: what a sweep changes from point to point."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.operation import describe
from nsdrill.variables import dimension_of

OPERATION = ("depth", "wob", "rotary_speed")  # axes by their short keys


@dataclass(frozen=True)
class Values:
    """What points have: the parameters and the start, with arrays [points] where an axis changes a number, and the
    operation: depth [m], weight on bit [N] and rotary speed [rad/s]."""

    parameters: Parameters
    initial: Initial
    operation: tuple[Any, Any, Any]


@lru_cache(maxsize=1)
def further_axes() -> dict[str, tuple[str, str]]:
    """The numbers beside those of the operation that a sweep may vary: by the name of the dimension the dotted key and
    the SI units, those of the linear law where they depend on the law of the wall."""
    found: dict[str, tuple[str, str]] = {}

    def visit(key: str, value: Any, meta: Mapping[str, Any]) -> None:
        if isinstance(value, float) or (value is None and "units" in meta):
            found[dimension_of(key)] = (key, meta.get("units", "").split(" or ")[0])

    describe(Parameters(), visit)
    describe(Initial(), visit, "initial.")
    del found["initial_spread"]
    return found


def words_of(name: str) -> str:
    """What a further axis is, in words made from its key: ``bit rock stiffness``."""
    key, _ = further_axes()[name]
    return key.removeprefix("drillstring.").replace(".", " ").replace("_", " ")


def values_at(parameters: Parameters, initial: Initial, values: Mapping[str, Any]) -> Values:
    """``parameters`` and ``initial`` with the ``values`` of the axes, among which are those of the operation."""
    own = {key: value for key, value in values.items() if key not in OPERATION}
    start = {key.removeprefix("initial."): value for key, value in own.items() if key.startswith("initial.")}
    rest = {key: value for key, value in own.items() if not key.startswith("initial.")}
    depth, wob, rotary_speed = (values[name] for name in OPERATION)
    return Values(with_values(parameters, rest), with_values(initial, start), (depth, wob, rotary_speed))


def with_values(tree: Any, values: Mapping[str, Any]) -> Any:
    """A copy of a tree of frozen dataclasses with these values, numbers or arrays [points], at dotted keys.

    The records do not check them: whoever gives the values has done so. AttributeError for a key that is not there.
    """
    for key, value in values.items():
        tree = _with_value(tree, key, value)
    return tree


def _with_value(tree: Any, key: str, value: Any) -> Any:
    name, _, rest = key.partition(".")
    part = getattr(tree, name)
    made = copy.copy(tree)
    object.__setattr__(made, name, _with_value(part, rest, value) if rest else value)
    return made
