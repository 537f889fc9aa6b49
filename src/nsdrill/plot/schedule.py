"""What a trace tells of its schedule: which operating values moved, and the words for
that."""

from __future__ import annotations

import json

import numpy as np

from nsdrill.data import Trace, drive_kind
from nsdrill.plot.labels import operating_point, quantity
from nsdrill.variables import AXES, SCHEDULED, dimension_of

ORDER = ("rotary_speed", "wob", "depth")  # what a driller moves first
MOST_VALUES = 4  # of a ramp told one by one


def set_values(trace: Trace, name: str) -> np.ndarray:
    """The operating value ``name`` along the trace as it was set; the speed of a drive
    that is not ideal is another."""
    if name != "rotary_speed" or drive_kind(trace.attrs) == "ideal":
        return trace[SCHEDULED[name]]
    ramps = json.loads(str(trace.attrs.get("ramps") or "{}"))
    times, values = ramps[name] if name in ramps else ([0.0], [float(trace.attrs.get(name) or 0.0)])
    return np.interp(trace.time, times, values)


def moving(trace: Trace) -> list[str]:
    """The operating values that are not constant along the trace."""
    return [
        name
        for name in ORDER
        if len(trace.time)
        and SCHEDULED[name] in trace.variables
        and float(np.ptp(set_values(trace, name))) > 0.0
    ]


def point_words(trace: Trace, units: str) -> str:
    """The operating values in the order in which a driller says them:
    ``5000 m, 22.24 kN, 3 to 8 to 3 rad/s``; then those of further axes."""
    names = moving(trace)
    parts = []
    for name in AXES:
        if name not in names:
            parts.append(operating_point({name: trace.attrs.get(name)}, units))
            continue
        _, values = knots(trace, name)
        # a value that is held is told once
        values = values[np.append(True, np.diff(values) != 0.0)]
        if len(values) > MOST_VALUES:
            values = np.array([values.min(), values.max()])
        q = quantity(name, units)
        words = [q.value(float(value)) for value in values]
        parts.append(
            " to ".join([*(word.removesuffix(f" {q.unit}") for word in words[:-1]), words[-1]])
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
    end, shown = float(trace.time[-1]), set_values(trace, name)
    if name not in ramps:
        return trace.time[[0, -1]], shown[[0, -1]]
    times, values = (np.array(column, dtype=float) for column in ramps[name])
    end += float(trace.time[-1] - trace.time[-2])  # samples need not fall on the last knot
    if times[-1] <= end:
        return times, values
    end = float(trace.time[-1])
    inside = times < end
    return np.append(times[inside], end), np.append(values[inside], shown[-1])


def rate_words(trace: Trace, name: str, units: str) -> str:
    """How fast the value moves: ``0.5 rad/s per min``, or the slowest and the fastest
    leg."""
    times, values = knots(trace, name)
    rates = np.abs(np.diff(values) / np.diff(times))
    rates = rates[rates > 0.0]
    if not rates.size:
        return ""
    q = quantity(name, units)
    low, high = (60.0 * float(rate) / q.scale for rate in (rates.min(), rates.max()))
    # A leg that the end of the trace cuts has its rate to rounding.
    text = f"{high:.3g}" if high - low < 1e-6 * high else f"{low:.3g} to {high:.3g}"
    return f"{text} {q.unit} per min"
