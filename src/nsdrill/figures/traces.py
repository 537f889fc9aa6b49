"""What the pictures of one trajectory have in common: the title, the part that is shown,
and the schedule, which operating values moved."""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np

from nsdrill.analysis.coarse import COARSE, coarse_samples, interval_of
from nsdrill.data import Array, Trace, drive_kind
from nsdrill.errors import InputError
from nsdrill.figures.look import look
from nsdrill.models.operation import in_trace_as
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.variables import AXES, dimension_of
from nsdrill.words.labels import carried, heading, operating_point, quantity

MOVED_FIRST = ("rotary_speed", "wob", "depth")  # the order in which drillers move them
MAX_VALUES = 4  # of a ramp that a title lists; of more, the least and the greatest


def setpoint(trace: Trace, name: str) -> np.ndarray:
    """The setpoint of the operating value ``name`` along the trace [SI]. The speed of a
    drive that is not ideal differs from its setpoint."""
    if name != "rotary_speed" or drive_kind(trace.attrs) == "ideal":
        return trace[in_trace_as(name)]
    ramps = json.loads(str(trace.attrs.get("ramps") or "{}"))
    times, values = ramps[name] if name in ramps else ([0.0], [float(trace.attrs.get(name) or 0.0)])
    return np.interp(trace.time, times, values)


def moving_values(trace: Trace) -> list[str]:
    """The operating values that are not constant along the trace."""
    own = (name for name in model_in(trace.attrs).operation.names() if name not in MOVED_FIRST)
    return [
        name
        for name in (*MOVED_FIRST, *own)
        if len(trace.time) and in_trace_as(name) in trace.variables and float(np.ptp(setpoint(trace, name))) > 0.0
    ]


def operating_point_text(trace: Trace, units: str) -> str:
    """The operating values in the order usual among drillers:
    ``5000 m, 22.24 kN, 3 to 8 to 3 rad/s``; then those of further axes."""
    names = moving_values(trace)
    parts = []
    for name in (*AXES, *(name for name in names if name not in AXES)):
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
        parts.append(" to ".join([*(word.removesuffix(f" {shown.unit}") for word in words[:-1]), words[-1]]))
    further = json.loads(str(trace.attrs.get("at") or "{}"))
    further = {dimension_of(key): value for key, value in further.items() if key not in names}
    parts.append(operating_point(further, units))
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


LAST_SAMPLES = 60_000  # of orbit and phase planes
# range of a constant history, relative to its size or to the unit in which it is shown
CONSTANT_TOLERANCE = 1e-9
LAST_REVOLUTIONS = 20  # of the drive: more of them overlap and hide the shape


def check_length(trace: Trace) -> None:
    """InputError where a trace is too short for a picture."""
    if len(trace.time) < 2:
        raise InputError(f"trace: found {len(trace.time)} samples; allowed: two or more.")


def varies(trace: Trace, name: str) -> bool:
    """Whether a history varies by more than rounding; one with NaN does."""
    values = trace[name]
    size = max(float(np.max(np.abs(values))), abs(quantity(name).scale))
    return not (np.ptp(values) <= CONSTANT_TOLERANCE * size)


def planes_of(trace: Trace) -> list[tuple[str, str]]:
    """The phase planes of the model in which something moves; all of them where nothing
    does."""
    planes = drawn_in(trace.attrs).planes
    return [pair for pair in planes if any(varies(trace, name) for name in pair)] or list(planes)


def title_of(trace: Trace, units: str, width: int = 100) -> str:
    """The title of the study and the operating point."""
    procedure = str(trace.attrs.get("procedure") or "")
    words = "" if procedure == "same" else carried(procedure, trace.attrs)
    coarse = f"{COARSE}, one every {interval_of(trace.time):.3g} s" if is_coarse(trace) else ""
    parts = filter(None, (operating_point_text(trace, units), words, coarse))
    return heading(trace.attrs, ", ".join(parts), width=width)


def is_coarse(trace: Trace) -> bool:
    """Whether there are too few samples for lines between them to be the motion."""
    return bool(coarse_samples(trace.attrs, trace.time))


def sample_marks(trace: Trace) -> dict[str, Any]:
    """How samples are marked, where lines between them are not the motion."""
    return {"marker": ".", "markersize": 3} if is_coarse(trace) else {}


def is_chosen() -> bool:
    """Whether the user has chosen the part of the trace that is drawn."""
    return look.get().time is not None or look.get().xlim is not None


def shown_part(trace: Trace, revolutions: float = LAST_REVOLUTIONS) -> tuple[slice, str]:
    """The part of the trace for orbit and phase planes, its last ``revolutions`` of the
    drive, and its description (empty if it is the whole trace)."""
    if is_chosen():
        return slice(None), f"{trace.time[0]:.4g} to {trace.time[-1]:.4g} s"
    speed = float(
        setpoint(trace, "rotary_speed")[-1]
        if "rotary_speed" in moving_values(trace)
        else trace.attrs.get("rotary_speed") or 0
    )
    start = max(len(trace.time) - LAST_SAMPLES, 0)
    if speed > 0.0:
        start = max(start, int(np.searchsorted(trace.time, trace.time[-1] - revolutions * 2 * pi / speed)))
    return slice(start, None), f"last {trace.time[-1] - trace.time[start]:.3g} s" if start else ""


# Fewer samples for the same picture.


PARTS = 50  # of a history, each with a mean of its own, as its level may drift
# oscillations per inch up to which the two lines of each, 0.5 points wide, leave a pixel
# in print (300 dpi) white on either side
SOLID_DENSITY = 50
BAND_BINS = 100  # bins of a band per inch, at most


def bands_of(trace: Trace, names: Sequence[str], width: float) -> tuple[list[str], int]:
    """Which of the histories ``names`` are bands in panels ``width`` inches wide, as
    their lines would merge, and the number of bins of the bands."""
    counts = {name: count_upcrossings(trace[name]) for name in names}
    solid = [name for name, count in counts.items() if count > SOLID_DENSITY * width]
    # a bin holds two oscillations: in a shorter one the extremes depend on the phase
    return solid, int(min([BAND_BINS * width, *(counts[name] / 2 for name in solid)]))


def envelope(time: Array, values: Array, bins: int) -> tuple[Array, Array]:
    """The least and the greatest sample of each of ``bins`` bins, in their order: what
    a line shows at that width.

    Every kept point is a sample, and no extreme is lost. Data that are short already
    are returned unchanged.
    """
    if len(time) <= 2 * bins:
        return time, values
    starts = np.linspace(0, len(time), bins, endpoint=False).astype(int)
    ends = np.append(starts[1:], len(time))
    # argmin and argmax do not skip NaN. In a bin of NaN alone they give its first
    # sample, which stays NaN: the line has a gap.
    safe_low = np.where(np.isfinite(values), values, np.inf)
    safe_high = np.where(np.isfinite(values), values, -np.inf)
    kept = np.empty(2 * bins, dtype=int)
    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        low, high = (start + int(safe_low[start:end].argmin()), start + int(safe_high[start:end].argmax()))
        kept[2 * number], kept[2 * number + 1] = min(low, high), max(low, high)
    return time[kept], values[kept]


def binned_statistics(time: Array, values: Array, count: int) -> tuple[Array, Array, Array, Array]:
    """Of each of ``count`` bins the middle time, the least and the greatest sample in it
    and its two neighbours, and the mean; all but the time as running means over three
    bins with the weights 1, 2, 1, as the values of a single bin beat with the
    oscillation. No sample of the bin lies outside. NaN is left out; a bin of nothing
    else is NaN."""
    starts = np.linspace(0, len(time), min(count, len(time)), endpoint=False).astype(int)
    finite = np.isfinite(values)
    ends = np.append(starts[1:], len(time)) - 1
    edges = [
        extreme.reduce(_with_neighbours(extreme.reduceat(np.where(finite, values, none), starts)), axis=1)
        for extreme, none in ((np.minimum, np.inf), (np.maximum, -np.inf))
    ]
    counts = np.add.reduceat(finite.astype(float), starts)
    total = np.add.reduceat(np.where(finite, values, 0.0), starts)
    least, greatest, sums, weights = (_with_neighbours(one) @ (0.25, 0.5, 0.25) for one in (*edges, total, counts))
    with np.errstate(invalid="ignore"):
        found = np.where(counts > 0, (least, greatest, sums / weights), np.nan)
    return 0.5 * (time[starts] + time[ends]), found[0], found[1], found[2]


def _with_neighbours(values: Array) -> Array:
    """Each value between the one before and the one after it [value, 3]."""
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, 1, mode="edge"), 3)


def count_upcrossings(values: Array) -> int:
    """How often a history crosses its local mean upwards, where it moves by more than
    2 % of its range. The local means are those of at most :data:`PARTS` parts."""
    finite = values[np.isfinite(values)]
    threshold = 0.02 * float(np.ptp(finite)) if finite.size else 0.0
    crossings = 0
    for part in np.array_split(finite, max(1, min(PARTS, finite.size // 100))):
        if part.size and np.ptp(part) > threshold:
            above = part > part.mean()
            crossings += int(np.count_nonzero(above[1:] & ~above[:-1]))
    return crossings


def one_per_pixel(x: Array, y: Array, shape: tuple[int, int]) -> Array:
    """The indices of the first point in each pixel of a picture of ``shape`` (across,
    down): the later ones lie under it. All indices where the points are few."""
    across, down = shape
    if len(x) <= across * down // 20:
        return np.arange(len(x))
    columns, rows = (
        np.minimum((values - values.min()) * (count / (np.ptp(values) or 1.0)), count - 1).astype(np.int64)
        for values, count in ((np.asarray(x, dtype=float), across), (np.asarray(y, dtype=float), down))
    )
    first_points = np.full(across * down, -1, dtype=np.int64)
    pixel = rows * across + columns
    first_points[pixel[::-1]] = np.arange(len(x))[::-1]  # the first point of each pixel
    return np.sort(first_points[first_points >= 0])
