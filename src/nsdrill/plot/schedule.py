"""The schedule of a trace: which operating values moved, and its description in a
title."""

from __future__ import annotations

import json

import numpy as np

from nsdrill.data import Trace, drive_kind
from nsdrill.plot.labels import operating_point, quantity
from nsdrill.variables import AXES, SCHEDULED, dimension_of

ORDER = ("rotary_speed", "wob", "depth")  # the order in which drillers move them
MAX_VALUES = 4  # of a ramp that a title lists; of more, the least and the greatest


def setpoint(trace: Trace, name: str) -> np.ndarray:
    """The setpoint of the operating value ``name`` along the trace [SI]. The speed of a
    drive that is not ideal differs from its setpoint."""
    if name != "rotary_speed" or drive_kind(trace.attrs) == "ideal":
        return trace[SCHEDULED[name]]
    ramps = json.loads(str(trace.attrs.get("ramps") or "{}"))
    times, values = ramps[name] if name in ramps else ([0.0], [float(trace.attrs.get(name) or 0.0)])
    return np.interp(trace.time, times, values)


def moving_values(trace: Trace) -> list[str]:
    """The operating values that are not constant along the trace."""
    return [
        name
        for name in ORDER
        if len(trace.time)
        and SCHEDULED[name] in trace.variables
        and float(np.ptp(setpoint(trace, name))) > 0.0
    ]


def operating_point_text(trace: Trace, units: str) -> str:
    """The operating values in the order usual among drillers:
    ``5000 m, 22.24 kN, 3 to 8 to 3 rad/s``; then those of further axes."""
    names = moving_values(trace)
    parts = []
    for name in AXES:
        if name not in names:
            parts.append(operating_point({name: trace.attrs.get(name)}, units))
            continue
        _, values = knots(trace, name)
        # a value that is held is listed once
        values = values[np.append(True, np.diff(values) != 0.0)]
        if len(values) > MAX_VALUES:
            values = np.array([values.min(), values.max()])
        shown = quantity(name, units)
        words = [shown.value(float(value)) for value in values]
        parts.append(
            " to ".join([*(word.removesuffix(f" {shown.unit}") for word in words[:-1]), words[-1]])
        )
    further = json.loads(str(trace.attrs.get("at") or "{}"))
    parts.append(
        operating_point({dimension_of(key): value for key, value in further.items()}, units)
    )
    return ", ".join(part for part in parts if part)


def knots(trace: Trace, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and values [SI] of the knots of a moving value, as far as the trace
    goes."""
    ramps = json.loads(str(trace.attrs.get("ramps") or "{}"))
    end, values_set = float(trace.time[-1]), setpoint(trace, name)
    if name not in ramps:
        return trace.time[[0, -1]], values_set[[0, -1]]
    times, values = (np.array(column, dtype=float) for column in ramps[name])
    end += float(trace.time[-1] - trace.time[-2])  # samples need not fall on the last knot
    if times[-1] <= end:
        return times, values
    end = float(trace.time[-1])
    inside = times < end
    return np.append(times[inside], end), np.append(values[inside], values_set[-1])


def rate_text(trace: Trace, name: str, units: str) -> str:
    """How fast the value moves: ``0.5 rad/s per min``, or the rates of the slowest and
    the fastest leg."""
    times, values = knots(trace, name)
    rates = np.abs(np.diff(values) / np.diff(times))
    rates = rates[rates > 0.0]
    if not rates.size:
        return ""
    shown = quantity(name, units)
    low, high = (60.0 * float(rate) / shown.scale for rate in (rates.min(), rates.max()))
    # The rate of a leg cut by the end of the trace has a rounding error.
    text = f"{high:.3g}" if high - low < 1e-6 * high else f"{low:.3g} to {high:.3g}"
    return f"{text} {shown.unit} per min"
