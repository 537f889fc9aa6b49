"""The part of the data that is drawn where the user limits the x axis or the time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError
from nsdrill.models.leaves import words_along
from nsdrill.plot.labels import Shown, quantity
from nsdrill.plot.look import Ends, Look, value_of
from nsdrill.plot.registry import Kind
from nsdrill.plot.slices import edges
from nsdrill.quantity import quantity as base_quantity

# Kinds that say something of the whole sweep keep all its points; only their axes are
# limited.
UNCUT_KINDS = ("window",)
BESIDE = ("axes fraction", "data")  # the place of words beside a panel, at a height


def apply_limits(data: Any, kind: Kind, look: Look) -> tuple[Any, tuple[float, float] | None]:
    """``data`` without what lies outside the limits, so that the other axes fit what is
    shown, and the ends of the x axis in SI, None where the picture chooses them."""
    if look.time is not None:
        if not isinstance(data, Trace):
            raise InputError(
                "--from and --to: found with results; allowed: with a trace. --xlim limits an axis."
            )
        data = between(data, look.time)
    if look.xlim is None:
        return data, None
    across = kind.across(data)
    if across is None:
        raise InputError(
            f"--xlim: found with --kind {kind.name}, whose panels have no x axis in common; "
            f"allowed: with kinds along "
            "an axis or over time, and with maps."
        )
    if across == "time":
        data = between(data, look.xlim, "xlim")
        return data, None
    low, high = resolve_ends("xlim", look.xlim, base_quantity(across).units)
    if isinstance(data, Results) and kind.name not in UNCUT_KINDS:
        data = _cells_between(data, across, low, high)
    return data, (low, high)


def resolve_ends(
    name: str, ends: Ends, units: str, least: float = -np.inf, greatest: float = np.inf
) -> tuple[float, float]:
    """The two ``ends`` as numbers in SI ``units``, an open one as ``least`` or
    ``greatest``. InputError where an end is not a number, or they do not ascend."""
    words = ("from", "to") if name == "time" else (name, name)
    low, high = (
        open_end if value is None else value_of(word, value, units)
        for word, value, open_end in zip(words, ends, (least, greatest), strict=True)
    )
    if None not in ends and not low < high:
        option = "--from and --to" if name == "time" else f"--{name}"
        raise InputError(
            f"{option}: found {low:g} to {high:g} {units}; allowed: the lower end first."
        )
    return low, high


def between(trace: Trace, ends: Ends, name: str = "time") -> Trace:
    """The samples of a trace between two times."""
    if not len(trace.time):
        return trace
    first, last = float(trace.time[0]), float(trace.time[-1])
    low, high = resolve_ends(name, ends, "s", first, last)
    chosen = (trace.time >= low - 1e-9) & (trace.time <= high + 1e-9)
    if np.count_nonzero(chosen) < 2:
        option = "--from and --to" if name == "time" else f"--{name}"
        raise InputError(
            f"{option}: found {low:g} s to {high:g} s; allowed: times with two samples or more "
            f"between them, of "
            f"{first:g} s to {last:g} s."
        )
    variables = {key: values[chosen] for key, values in trace.variables.items()}
    return Trace(trace.time[chosen], variables, trace.attrs)


def _cells_between(data: Results, axis: str, low: float, high: float) -> Results:
    """The points whose cells reach into the limits."""
    if words_along(axis):
        raise InputError(
            f"--xlim: found limits of {axis}, which has words; allowed: --at to select one of them."
        )
    values: Array = np.asarray(data.coords[axis], dtype=float)
    borders = edges(values)
    chosen = np.flatnonzero((borders[1:] > low) & (borders[:-1] < high))
    if len(chosen) < 2:
        x = quantity(axis)
        raise InputError(
            f"--xlim: found {x.value(low)} to {x.value(high)}; allowed: limits with two points of "
            f"the sweep or more "
            f"between them, of {x.value(values[0])} to {x.value(values[-1])}."
        )
    place = 1 + data.axes.index(axis)
    variables = {name: np.take(array, chosen, axis=place) for name, array in data.variables.items()}
    return Results({**data.coords, axis: values[chosen]}, variables, data.attrs, data.more)


def limit_y_axes(panels: Sequence[Any], ends: Ends, units: str) -> None:
    """Limit the y axes of the ``panels`` that show a quantity of the unit of ``ends``.
    InputError where none does, or several quantities do: then one panel is to be drawn
    alone."""
    panels = [axes for axes in panels if axes.yaxis.get_gid()]
    names = dict.fromkeys(str(axes.yaxis.get_gid()) for axes in panels)
    limits: dict[str, list[float]] = {}
    error = InputError("--ylim: found a picture whose panels have no limits of their own.")
    for name in names:
        try:
            limits[name] = [_shown_end(end, name, quantity(name, units)) for end in ends]
        except InputError as other_unit:
            error = other_unit
    if not limits:
        raise error
    if len(limits) > 1:
        raise InputError(
            f"--ylim: found panels of {', '.join(limits)} with this unit; allowed: one of them. "
            f"Choose it with --panel."
        )
    ((name, (low, high)),) = limits.items()
    resolve_ends("ylim", (low, high), quantity(name, units).unit)
    for axes in panels:
        if axes.yaxis.get_gid() == name:
            for arrow in [line for line in axes.lines if "beyond" in str(line.get_gid())]:
                arrow.remove()  # at the border that was chosen before
            for words in [text for text in axes.texts if hasattr(text, "xy")]:
                if words.xycoords == BESIDE and not low <= words.xy[1] <= high:
                    words.remove()
            top_first = axes.yaxis_inverted()
            axes.set_ylim((high, low) if top_first else (low, high))


def _shown_end(end: Any, name: str, shown: Shown) -> float:
    """A limit in the unit in which a variable is shown; of a share also in per cent."""
    text = str(end).strip()
    if shown.unit == "%" and text.endswith("%"):
        return value_of("ylim", text.rstrip("% "), "1")
    units = base_quantity(name).units
    return value_of("ylim", end, "1" if units == "percent" else units) / shown.scale
