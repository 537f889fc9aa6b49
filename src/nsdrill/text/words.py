"""Values and operating points in words, in a system of units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Sized
from typing import Any

from nsdrill.data import Answer
from nsdrill.errors import brief
from nsdrill.models.registry import described
from nsdrill.models.responses import RESPONSES
from nsdrill.quantity import DIGITS, SYSTEMS, amount, find, in_system, quantity, sign
from nsdrill.units import WithUnit, rounded_from_si
from nsdrill.variables import AXES, MODEL

MAX_KNOTS = 6
# The keys of plain data whose values are those of the axis or variable that the mapping
# around them names.
_VALUE_KEYS = (
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
    "prior",
    "posterior",
    "error",
    "spread",
    "enough",
    "moved",
    "a",
    "b",
)
_STRETCHES = ("safe", "lasts")  # of a quantity, where they are lists
_OTHER_NAMES = {"weights": "wob"}
_SURFACE = {  # what the answer of a window says of the surface, and of which quantities that is
    "torque": "surface_torque_mean",
    "sticking": "surface_torque_mean",
    "whirling": "surface_torque_mean",
    "acceleration": "lateral_acceleration_rms",
}
PASSING_RATE = "passing_rate"


def label_of(name: str) -> str:
    """The name of an axis in words."""
    return quantity(name).words


def value_text(name: str, value: float | str, units: str = "si", *, both: bool = False) -> str:
    """A value of an axis with its unit, as pictures, windows and pages write it: in the
    system ``units``, or in its own unit where it is :class:`nsdrill.units.WithUnit`.
    With ``both`` a setting also in the other system, both exact, so that 22.24 kN are
    not 5 klbf."""
    if isinstance(value, str):  # a word
        return value
    axis = quantity(name)
    if isinstance(value, WithUnit):
        return amount(value, value.unit, DIGITS)
    if both and axis.name in AXES:
        other = SYSTEMS[1 - SYSTEMS.index(units)]
        return f"{axis.text(value, units)} ({amount(value, axis.unit(other))})"
    return axis.in_answers(value, units)


def point_text(point: Mapping[str, float | str], units: str = "si") -> str:
    """An operating point, ``5000 m, 22.24 kN, 3 rad/s``; the values of further axes
    have their names before them."""
    return ", ".join(
        value_text(name, value, units) if name in AXES else f"{label_of(name)} {value_text(name, value, units)}"
        for name, value in point.items()
    )


def in_unit_of(name: str, value: float, requested: Mapping[str, float]) -> float:
    """The value of the axis ``name``, with the unit that ``requested`` has for this
    axis."""
    other = requested.get(name)
    return WithUnit(value, other.unit) if isinstance(other, WithUnit) else value


HELD = "the last values from {:g} s, where the ramps end, to {:g} s"


def knots_text(name: str, times: Sequence[float], values: Sequence[float], units: str = "si") -> str:
    """The knots of a ramp in words: ``3 rad/s at 0 s, 8 rad/s at 600 s``; of many only
    the first and the last."""
    texts = [f"{value_text(name, value, units)} at {time:g} s" for time, value in zip(times, values, strict=True)]
    if len(texts) > MAX_KNOTS:
        half = MAX_KNOTS // 2
        texts = [*texts[:half], f"... {len(texts) - 2 * half} knots more ...", *texts[-half:]]
    return ", ".join(texts)


def aligned(table: Sequence[tuple[str, ...]]) -> Iterator[str]:
    """The rows of a table with its columns aligned."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for row in table:
        yield ("  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))).rstrip()


def rest(things: Sized, most: int, what: str = "(all with --all)") -> Iterator[str]:
    """The line below the first ``most`` of the ``things``, where there are more."""
    if len(things) > most:
        yield f"  and {len(things) - most} more {what}"


LONG_VALUE = 300  # characters


def overrides_text(overrides: Mapping[str, str]) -> str:
    """The keys that ``--set`` changed, with their values, the middle of a long one, as a ramp
    of many knots, left out."""
    return "; ".join(f"{key} = {brief(value, LONG_VALUE)}" for key, value in overrides.items())


def refinement_text(refinement: Answer, units: str = "si") -> str:
    """ "1,204 of 3,721 points run, 68 % saved; borders known to 0.7 kN and 0.05 rad/s"."""
    run, points = refinement["points_run"], refinement["points_run"] + refinement["points_inferred"]
    steps = refinement["border_spacing"].items()
    spacing = " and ".join(value_text(key, step, units) for key, step in steps)
    if "points_here" in refinement:
        here = (
            f"{refinement['run_here']:,} of {refinement['points_here']:,} points run, of {points:,} in the whole file"
        )
    else:
        here = f"{run:,} of {points:,} points run, {100 * (points - run) / points:.0f} % saved"
    return f"{here}; borders known to {spacing}"


def cell(value: float, units: str, system: str) -> tuple[float, str]:
    """An SI value in ``units`` for a column of a table: the number and the sign of the
    unit in ``system``."""
    number, unit = in_system(value, units, system)
    return number, "" if unit == "1" else sign(unit)


def in_units(data: Answer, system: str) -> Answer:
    """Plain ``data`` in SI units, unchanged or, where ``system`` is "field", with every
    value in field units: the keys are the same, and every ``units`` has the new unit.
    Another key ``units`` has the units of the values that have none beside them."""
    if system == "si":
        return data
    units: dict[str, str] = {}
    converted = _converted(data, None, None, units)
    return {**converted, "units": units} if units else dict(converted)


def _converted(node: Any, key: str | None, name: str | None, units: dict[str, str]) -> Any:
    """``node`` in field units: the value of ``key``, in a mapping about the quantity
    ``name``. The units of values that have none beside them are added to ``units``."""
    if isinstance(node, list | tuple):
        # the ends of what is safe; elsewhere "safe" is a count
        return [_converted(item, "value" if key == "safe" else key, name, units) for item in node]
    if isinstance(node, dict):
        if isinstance(node.get("units"), str):
            return _with_unit(node, node.get("name", node.get("key", name)), units)
        about = node.get("axis", node.get("name", name))
        if key == "surface":
            return {k: _converted(v, k, _SURFACE.get(k), units) for k, v in node.items()}
        return {k: _converted(v, *_meaning(k, v, about), units) for k, v in node.items()}
    if key == PASSING_RATE and isinstance(node, float):
        number, units[PASSING_RATE] = in_system(node, "rad/s^2", "field")
        return number
    known, is_seen = (find(name) if name is not None else None), name is not None and _SURFACE.get(str(key)) == name
    if not isinstance(node, float) or known is None or name is None:
        return node
    if not (key == name or key in _VALUE_KEYS or is_seen):
        return node
    number, unit = _in_field(node, known.units, name)
    if unit != known.units:
        units[str(key) if is_seen else name] = unit
    return number


def _meaning(key: str, value: Any, about: str | None) -> tuple[str, str | None]:
    """As what the ``value`` of a ``key`` is converted, in a mapping ``about`` a quantity: as a
    value of it where it is a list of stretches, and as a quantity of that name."""
    if key in _STRETCHES and isinstance(value, list):
        return "from", about
    if key in _OTHER_NAMES:
        return _OTHER_NAMES[key], _OTHER_NAMES[key]
    return key, key if find(str(key)) else about


def _with_unit(node: Answer, name: str | None, units: dict[str, str]) -> Answer:
    """The mapping ``node``, whose ``units`` are those of its values, in field units."""
    shown = {**node, "units": _in_field(0.0, node["units"], name)[1]}
    for key, value in node.items():
        if key in _VALUE_KEYS and isinstance(value, float):
            shown[key] = _in_field(value, node["units"], name)[0]
        elif key in _VALUE_KEYS and isinstance(value, list):
            shown[key] = [_in_field(one, node["units"], name)[0] for one in value]
        elif isinstance(value, dict):
            shown[key] = _converted(value, key, None, units)
    return shown


def _in_field(value: float, units: str, name: str | None) -> tuple[float, str]:
    """A value and its unit in field units, which depend on ``name``: a depth is in
    feet, another length in inches."""
    known = find(name) if name is not None else None
    if known is not None and known.units and known.unit("field") != known.units:
        return rounded_from_si(value, known.unit("field")), known.unit("field")
    if known is not None and known.units == units == known.unit("field"):
        return value, units  # in which it is declared
    return in_system(value, units, "field")


def in_words(flag: str, model: str = MODEL) -> str:
    """A flag in words: responses of the ``model`` by their words, with spaces around
    ``+``."""
    if model != MODEL:
        own = {one.name: one.words for one in described(model).critical.values() if one.is_own}
        flag = "+".join(own.get(name, name) for name in flag.split("+"))
    names = {response.name: response.words for response in RESPONSES.values()}
    for name, word in {**names, "quasi_": "quasi-", "_": " "}.items():
        flag = flag.replace(name, word)
    return flag.replace("+", " + ")
