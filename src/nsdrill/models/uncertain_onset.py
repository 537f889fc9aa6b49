"""Poorly known numbers with which stick-slip begins at another speed, for strings of which
drilling is all that one asks."""

from __future__ import annotations

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


def sensitive_onset(
    study: Any,
    corners: Sequence[Values],
    drilling_at: Callable[[Any, Operation], Drilling],
    keys: Sequence[str],
    format_value: FormatValue,
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
    before, *after = (drilling_at(one, middle) for one in (parameters, *changed.values()))
    find_onsets([before, *after])
    if not before.onset_known:
        return None
    begins = _onset(before)
    told: dict[str, tuple[float, str]] = {}  # of each number its greatest effect
    for (key, how), one in zip(changed, after, strict=True):
        there = _onset(one)
        decides = min(begins, there) <= fastest and max(begins, there) >= slowest
        shift = abs(there - begins) / max(begins, there, 1e-12)
        if one.onset_known and decides and max(LEAST_SHIFT, told.get(key, (0.0, ""))[0]) <= shift:
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


def _text(speed: float, format_value: FormatValue) -> str:
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
            law = one.bit.friction
            if law.dynamic <= law.static and (law.dynamic_torque or 0.0) <= (law.static_torque or 0.0):
                yield (key, how), one
