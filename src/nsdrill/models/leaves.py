"""Numbers inside trees of parameter records, by their dotted keys: what a sweep changes from point to point."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from nsdrill.models.operation import describe
from nsdrill.models.registry import NAMES, described
from nsdrill.models.starts import Starts
from nsdrill.variables import dimension_of

OPERATION = ("depth", "wob", "rotary_speed")  # axes by their short keys


@dataclass(frozen=True)
class Values:
    """What points have: the parameters and the start, with arrays [points] where an axis changes a number, and the
    operation: depth [m], weight on bit [N] and rotary speed [rad/s]."""

    parameters: Any
    initial: Starts
    operation: tuple[Any, Any, Any]


@lru_cache
def further_axes(model: str) -> dict[str, tuple[str, str]]:
    """The numbers beside those of the operation that a sweep of the model of this name may vary: by the name of the
    dimension the dotted key and the SI units, those of the first choice where they depend on one."""
    told = described(model)
    found: dict[str, tuple[str, str]] = {}

    def visit(key: str, value: Any, meta: Mapping[str, Any]) -> None:
        number = isinstance(value, float) or (value is None and "units" in meta and "most" not in meta)
        if number or "words" in meta or key in told.compiled:
            units = next(iter(told.units_by[key][1].values())) if key in told.units_by else meta.get("units", "")
            found[dimension_of(key)] = (key, units)

    describe(told.parameters(), visit)
    describe(told.initial(), visit, "initial.")
    del found["initial_spread"]
    return found


def is_further_axis(key: str) -> bool:
    """Whether a sweep of any model may vary the number at this dotted key."""
    name = dimension_of(key)
    return any(further_axes(model).get(name, ("",))[0] == key for model in NAMES)


def values_at(parameters: Any, initial: Starts, values: Mapping[str, Any]) -> Values:
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
