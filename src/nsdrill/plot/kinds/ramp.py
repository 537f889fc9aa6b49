"""The bifurcation diagram of a ramp in time: local maxima of the motions against the
operating value that was moved.

Markers are filled where it rose, open where it fell, and small and grey where it was
held; the peaks of a quasi-static sweep can be drawn below for comparison.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError, option
from nsdrill.models.registry import drawn_in
from nsdrill.plot.labels import heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.panels import draw_wall
from nsdrill.plot.registry import RAMP, Kind
from nsdrill.plot.slices import line, ordered
from nsdrill.plot.style import (
    BLUE,
    GREY,
    MANY_MARKERS,
    REFERENCE,
    VERMILLION,
    name_panel,
    new_figure,
    page_width,
    put_title,
    stack,
)
from nsdrill.plot.traces import moving_values, operating_point_text, rate_text, setpoint
from nsdrill.variables import AXES, OK

SWEEP_COLOUR = "#D9D9D9"  # of the sweep below, paler than the peaks of the ramp


def draw(trace: Trace, units: str = "si", over: Results | None = None) -> Figure:
    axis = moving_values(trace)[0]
    x = quantity(axis, units)
    panels_drawn = drawn_in(trace.attrs).panels
    figure = new_figure(page_width(), 1.2 + 1.7 * len(panels_drawn))
    panels = stack(figure, len(panels_drawn))
    values = setpoint(trace, axis)
    direction = np.sign(np.diff(values, append=values[-1]))
    direction[-1] = direction[-2]
    handles: list[Artist] = []
    if over is not None:
        handles += draw_sweep(panels, over, trace, axis, units)
    peaks = [local_maxima(trace.time, trace[name]) for name in (panel.trace for panel in panels_drawn)]
    rasterise = sum(len(times) for times, _ in peaks) > MANY_MARKERS
    signs_shown = set()
    for axes, panel, (times, peak_heights) in zip(panels, panels_drawn, peaks, strict=True):
        name, y = panel.trace, quantity(panel.peaks, units)
        nearest = np.clip(np.searchsorted(trace.time, times), 0, len(values) - 1)
        peak_values = np.interp(times, trace.time, values) / x.scale
        for sign, style in STYLES.items():
            selected = direction[nearest] == sign
            if selected.any():
                signs_shown.add(sign)
                axes.plot(
                    peak_values[selected],
                    peak_heights[selected] / y.scale,
                    linestyle="none",
                    rasterized=rasterise,
                    gid=f"{name}:{style['label']}",
                    **style,
                )
        axes.set_ylabel(y.label)
        name_panel(axes, panel.peaks, panel.peaks)
    handles += [
        Line2D([], [], linestyle="none", **{**STYLES[sign], "markersize": 3.5})
        for sign in (1, -1, 0)
        if sign in signs_shown
    ]
    handles += _draw_references(panels, trace, axis, units)
    margin = 0.03 * float(np.ptp(values))
    panels[-1].set_xlim((values.min() - margin) / x.scale, (values.max() + margin) / x.scale)
    panels[-1].set_xlabel(x.label)
    rate = rate_text(trace, axis, units)
    put_title(figure, heading(trace.attrs, f"{operating_point_text(trace, units)}{'; ' + rate if rate else ''}"))
    figure.align_ylabels(panels)
    legend_below(figure, handles, 4)
    return figure


STYLES: dict[int, dict[str, Any]] = {
    0: {"label": "held", "color": REFERENCE, "marker": ".", "markersize": 1.5, "markeredgewidth": 0.0, "zorder": 2.0},
    1: {"label": "rising", "color": BLUE, "marker": "o", "markersize": 1.6, "markeredgewidth": 0.0, "zorder": 2.1},
    -1: {
        "label": "falling",
        "color": VERMILLION,
        "marker": "o",
        "markersize": 2.2,
        "markeredgewidth": 0.35,
        "markerfacecolor": "none",
        "zorder": 2.2,
    },
}


def local_maxima(time: Array, values: Array) -> tuple[Array, Array]:
    """Times and heights of the local maxima of equidistant samples, from the parabola
    through three of them."""
    previous, current, following = values[:-2], values[1:-1], values[2:]
    maxima = np.flatnonzero((current > previous) & (current >= following))
    a, b, c = previous[maxima], current[maxima], following[maxima]
    # within half a sample, as the middle one is the greatest
    offset = 0.5 * (a - c) / (a - 2 * b + c)
    sample_time = time[1] - time[0]
    return time[maxima + 1] + offset * sample_time, b - 0.25 * (a - c) * offset


def draw_sweep(panels: list[Axes], results: Results, trace: Trace, axis: str, units: str) -> list[Artist]:
    """Draw the peaks of a sweep along the same axis, pale; where it has several values
    of another axis, those at the value of the ramp."""
    if axis not in results.swept:
        raise InputError(
            f"{option('over')}: found a sweep of {', '.join(results.swept) or 'nothing'}; allowed: a sweep "
            f"of {axis}, which this trace ramps."
        )
    held: dict[str, float] = {}
    for other in AXES:
        if other == axis:
            continue
        axis_values = np.asarray(results.coords[other], dtype=float)
        target = float(setpoint(trace, other)[0])
        held[other] = float(axis_values[np.argmin(np.abs(axis_values - target))])
        if abs(held[other] - target) > 0.01 * abs(target):
            raise InputError(
                f"{option('over')}: found a sweep at {operating_point({other: held[other]}, units)}; "
                f"allowed: one at {operating_point({other: target}, units)}, as this trace."
            )
    sweep_line = line(ordered(results, held), axis)
    x = quantity(axis, units)
    values_set = setpoint(trace, axis)
    in_range = (sweep_line["status"] == OK) & (sweep_line.x >= values_set.min()) & (sweep_line.x <= values_set.max())
    handles: list[Artist] = []
    for row, procedure in enumerate(sweep_line.procedures):
        style: dict[str, Any] = {
            "linestyle": "none",
            "color": SWEEP_COLOUR if procedure != "down" else GREY,
            "marker": "o" if procedure != "down" else "x",
            "markersize": 3.0 if procedure != "down" else 2.2,
            "markeredgewidth": 0.0 if procedure != "down" else 0.4,
            "zorder": 1.0,
        }
        for axes, peaks in zip(panels, drawn_in(trace.attrs).peaks, strict=True):
            peak_heights = (
                np.where(in_range[row][:, None], sweep_line[peaks][row], np.nan) / quantity(peaks, units).scale
            )
            x_values = np.broadcast_to((sweep_line.x / x.scale)[:, None], peak_heights.shape)
            axes.plot(
                x_values[np.isfinite(peak_heights)],
                peak_heights[np.isfinite(peak_heights)],
                rasterized=peak_heights.size > MANY_MARKERS,
                gid=f"sweep:{procedure}:{peaks}",
                **style,
            )
        label = "sweep" if procedure == "same" else f"sweep, {procedure}"
        handles.append(Line2D([], [], label=label, **{**style, "markersize": 3.5}))
    return handles


def _draw_references(panels: list[Axes], trace: Trace, axis: str, units: str) -> list[Artist]:
    """Draw the rotary speed and the wall of the hole as lines in the panels of torsional
    and lateral motion, if any."""
    style: dict[str, Any] = {"color": REFERENCE, "linewidth": 0.7, "dashes": (4, 2), "zorder": 3}
    handles: list[Artist] = []
    speed = setpoint(trace, "rotary_speed") / quantity("bit_speed", units).scale
    ends = np.array([speed.min(), speed.max()])
    modes = [panel.mode for panel in drawn_in(trace.attrs).panels]
    if "torsional" in modes and (axis == "rotary_speed" or ends[0] == ends[1]):
        torsional_panel = panels[modes.index("torsional")]
        if axis == "rotary_speed":
            torsional_panel.plot(ends, ends, gid="rotary speed", **style)
        else:
            torsional_panel.axhline(ends[0], gid="rotary speed", **style)
        handles.append(Line2D([], [], label="rotary speed", **style))
    if "lateral" in modes:
        handles += draw_wall(trace.attrs, [panels[modes.index("lateral")]], units)
    return handles


KINDS = (
    Kind(
        "ramp",
        "peaks of the three motions against the value that was moved: a bifurcation diagram made by a real ramp",
        of=RAMP,
        place=lambda data: 85 if isinstance(data, Trace) and moving_values(data) else None,
        draw=draw,
        takes=("over",),
        across=lambda data: moving_values(data)[0],
        advice=lambda data: "it shows a run along a ramp" if isinstance(data, Trace) else "",
    ),
)
