"""Values and operating points in words, in the system of units that was chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from nsdrill.quantity import SYSTEMS, amount, find, in_system, quantity, sign
from nsdrill.units import Asked, from_si
from nsdrill.variables import AXES

MOST_KNOTS = 6
# Under which keys plain data have values of the axis or variable that is named around
# them.
_VALUES = (
    "from",
    "to",
    "step",
    "value",
    "min",
    "max",
    "largest",
    "margin",
    "safe_to",
    "first_not_safe",
    "open",
    "closes",
    "reopens",
)


def label_of(name: str) -> str:
    """What an axis is, in words."""
    return quantity(name).words


def value_text(name: str, value: float | str, units: str = "si", *, both: bool = False) -> str:
    """A value of an axis with its unit, in the system ``units``, or in the unit in
    which it was asked for; with ``both`` in the other system as well."""
    if isinstance(value, str):  # a word
        return value
    one = quantity(name)
    text = amount(value, value.unit) if isinstance(value, Asked) else one.text(value, units)
    if both and one.name in AXES:
        other = SYSTEMS[1 - SYSTEMS.index(units)]
        text += f" ({amount(value, one.unit(other), 4)})"
    return text


def point_text(point: Mapping[str, float | str], units: str = "si") -> str:
    """An operating point: ``5000 m, 22.24 kN, 3 rad/s``, and the values of further axes
    with their names."""
    return ", ".join(
        value_text(name, value, units)
        if name in AXES
        else f"{label_of(name)} {value_text(name, value, units)}"
        for name, value in point.items()
    )


def as_asked(name: str, value: float, asked: Mapping[str, float]) -> float:
    """The value of the axis ``name``, to be told in the unit in which one was asked
    for."""
    wanted = asked.get(name)
    return Asked(value, wanted.unit) if isinstance(wanted, Asked) else value


def knots_text(
    name: str, times: Sequence[float], values: Sequence[float], units: str = "si"
) -> str:
    """The knots of a ramp in words: ``3 rad/s at 0 s, 8 rad/s at 600 s``; of a long one
    its first and last ones."""
    texts = [
        f"{value_text(name, value, units)} at {time:g} s"
        for time, value in zip(times, values, strict=True)
    ]
    if len(texts) > MOST_KNOTS:
        half = MOST_KNOTS // 2
        texts = [*texts[:half], f"... {len(texts) - 2 * half} knots more ...", *texts[-half:]]
    return ", ".join(texts)


def count(number: int, noun: str) -> str:
    """``1 point``, ``2 points``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def samples_text(number: int, effective: float) -> str:
    """``32 samples``; and of how many independent ones they are worth, where some are
    the same."""
    worth = (
        f" (some the same, worth {effective:.0f} independent ones)"
        if effective < number - 0.5
        else ""
    )
    return f"{count(number, 'sample')}{worth}"


def cell(value: float, units: str, system: str) -> tuple[float, str]:
    """A value for a column of a table, and its unit as people write it; ``units`` are
    SI."""
    number, unit = in_system(value, units, system)
    return number, "" if unit == "1" else sign(unit)


def in_units(data: dict[str, Any], system: str) -> dict[str, Any]:
    """Plain data in SI units as they are or, where ``system`` is "field", every value
    in field units: the same keys, each ``units`` renamed, and one more key ``units``
    for the values beside which no unit stands."""
    if system == "si":
        return data
    found: dict[str, str] = {}
    made = _converted(data, None, None, found)
    return {**made, "units": found} if found else dict(made)


def _converted(node: Any, key: str | None, name: str | None, found: dict[str, str]) -> Any:
    """``node`` in field units; ``key`` is that under which it stands, ``name`` the
    quantity that is spoken of."""
    if isinstance(node, list | tuple):
        return [_converted(one, key, name, found) for one in node]
    if isinstance(node, dict):
        if isinstance(node.get("units"), str):
            return _with_unit(node, node.get("name", name), found)
        about = node.get("axis", node.get("name", name))
        return {k: _converted(v, k, k if find(str(k)) else about, found) for k, v in node.items()}
    one = find(name) if name is not None else None
    if (
        not isinstance(node, float)
        or one is None
        or name is None
        or not (key == name or key in _VALUES)
    ):
        return node
    number, unit = _in_field(node, one.units, name)
    if unit != one.units:
        found[name] = unit
    return number


def _with_unit(node: dict[str, Any], name: str | None, found: dict[str, str]) -> dict[str, Any]:
    """A mapping that names the unit of its own values."""
    unit = _in_field(0.0, node["units"], name)[1]
    return {
        k: unit
        if k == "units"
        else _in_field(v, node["units"], name)[0]
        if k in _VALUES and isinstance(v, float)
        else _converted(v, k, None, found)
        if isinstance(v, dict)
        else v
        for k, v in node.items()
    }


def _in_field(value: float, units: str, name: str | None) -> tuple[float, str]:
    """A depth is in feet, another length in inches: the name tells."""
    one = find(name) if name is not None else None
    if one is not None and one.units and one.unit("field") != one.units:
        return from_si(value, one.unit("field")), one.unit("field")
    return in_system(value, units, "field")
