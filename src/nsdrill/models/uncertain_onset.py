"""Poorly known numbers with which stick-slip begins at another speed, for strings of which
drilling is all that one asks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from operator import attrgetter
from typing import Any

from nsdrill.models.drilling import Drilling, find_onsets
from nsdrill.models.numbers import FormatValue
from nsdrill.models.operation import Operation, Values
from nsdrill.models.tree import with_values

FRICTION = tuple(f"bit.friction.{name}" for name in ("static", "dynamic", "static_torque", "dynamic_torque", "decay"))
LEAST_SHIFT = 0.1  # of the onset
CHANGES = {"half": 0.5, "twice": 2.0}


Onsets = Callable[[Sequence[Any], Operation], Sequence[float | None]]


def onsets_of(drilling_at: Callable[[Any, Operation], Drilling]) -> Onsets:
    """The onsets of stick-slip [rad/s] of strings with many parameters at an operating point, each None where it is
    not known, by steady drilling as ``drilling_at`` finds it."""

    def onsets(strings: Sequence[Any], at: Operation) -> list[float | None]:
        found = [drilling_at(one, at) for one in strings]
        find_onsets(found)
        return [_onset(one) if one.onset_known else None for one in found]

    return onsets


def sensitive_onset(
    study: Any, corners: Sequence[Values], onsets: Onsets, keys: Sequence[str], format_value: FormatValue
) -> str | None:
    """The warning of numbers of these ``keys`` with half or twice of which the onset of stick-slip lies elsewhere, by
    a tenth or more, within the speeds of the sweep or on its other side. None where none does, or where no onset is
    known."""
    parameters = corners[0].parameters
    columns = zip(*(corner.operation for corner in corners), strict=True)
    middle = Operation(*(float(sum(column)) / len(corners) for column in columns))
    speeds = [float(corner.point.rotary_speed) for corner in corners]
    slowest, fastest = min(speeds), max(speeds)
    changed = dict(_changed(study, parameters, keys))
    begins, *after = onsets([parameters, *changed.values()], middle)
    if begins is None:
        return None
    told: dict[str, tuple[float, str]] = {}  # of each number its greatest effect
    for (key, how), there in zip(changed, after, strict=True):
        if there is None:
            continue
        decides = min(begins, there) <= fastest and max(begins, there) >= slowest
        shift = _shift(begins, there)
        if decides and max(LEAST_SHIFT, told.get(key, (0.0, ""))[0]) <= shift:
            told[key] = shift, f"{_text(there, format_value)} with {how} {key}"
    if not told:
        return None
    others = ", ".join(text for _, text in sorted(told.values(), reverse=True))
    return (
        f"Sensitive to uncertain inputs: at {format_value(middle.wob, 'N', 'kN')} the speed below which the bit sticks "
        f"and slips is {_text(begins, format_value)}, and {others}. Give them distributions in the section uncertain, "
        "or run the study with both values."
    )


def _onset(drilling: Drilling) -> float:
    """The set speed [rad/s] below which steady drilling is unstable; 0 where it is at none."""
    return 0.0 if drilling.onset is None else float(drilling.onset.set_speed)


def _shift(one: float, other: float) -> float:
    """The shift of an onset, of the greater; 1 where it comes or goes at every speed."""
    if math.isinf(one) or math.isinf(other):
        return 0.0 if one == other else 1.0
    return abs(other - one) / max(one, other, 1e-12)


def _text(speed: float, format_value: FormatValue) -> str:
    if math.isinf(speed):
        return "every speed"
    return format_value(speed, "rad/s", "rad/s") if speed > 0.0 else "no speed"


def _changed(study: Any, parameters: Any, keys: Sequence[str]) -> Iterator[tuple[tuple[str, str], Any]]:
    """The parameters with half and with twice of each number that the study does not vary, where the law of friction
    allows that."""
    unasked = (*study.axes, *study.drawn, *getattr(parameters, "unread", ()))
    for key in keys:
        value = attrgetter(key)(parameters)
        if key in unasked or not value:
            continue
        for how, factor in CHANGES.items():
            one = with_values(parameters, {key: factor * value})
            if _is_allowed(one):
                yield (key, how), one


def _is_allowed(parameters: Any) -> bool:
    """Whether a bit whose friction has these numbers has less of it at speed than at rest; other laws have others."""
    law = parameters.bit.friction
    pairs = (("static", "dynamic"), ("static_torque", "dynamic_torque"))
    return all((getattr(law, less, None) or 0.0) <= (getattr(law, most, None) or 0.0) for most, less in pairs)
