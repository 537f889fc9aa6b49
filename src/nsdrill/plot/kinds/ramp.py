"""A bifurcation diagram made by a real ramp: local maxima of the motions against the
value that was moved.

Filled markers where it rose, open ones where it fell, small grey ones where it was
held; the peaks of a quasi-static sweep may lie below for comparison.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in
from nsdrill.plot.labels import heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.registry import RAMP, Kind
from nsdrill.plot.schedule import moving, point_words, rate_words, set_values
from nsdrill.plot.slices import line, ordered
from nsdrill.plot.style import (
    BLUE,
    GREY,
    MANY_MARKERS,
    REFERENCE,
    VERMILLION,
    new_figure,
    page_width,
    put_title,
)
from nsdrill.variables import AXES, OK

SWEPT = "#D9D9D9"  # the sweep lies behind, paler than anything of the ramp
WALL_IN_SIGHT = 0.4


def draw(trace: Trace, units: str = "si", over: Results | None = None) -> Figure:
    axis = moving(trace)[0]
    x = quantity(axis, units)
    drawn = drawn_in(trace.attrs).panels
    figure = new_figure(page_width(), 1.2 + 1.7 * len(drawn))
    panels = list(np.atleast_1d(figure.subplots(len(drawn), 1, sharex=True)))
    value = set_values(trace, axis)
    way = np.sign(np.diff(value, append=value[-1]))
    way[-1] = way[-2]
    handles: list[Artist] = []
    if over is not None:
        handles += draw_sweep(panels, over, trace, axis, units)
    peaks = [local_maxima(trace.time, trace[name]) for name in (panel.trace for panel in drawn)]
    rasterise = sum(len(times) for times, _ in peaks) > MANY_MARKERS
    shown = set()
    for axes, panel, (times, heights) in zip(panels, drawn, peaks, strict=True):
        name, y = panel.trace, quantity(panel.peaks, units)
        nearest = np.clip(np.searchsorted(trace.time, times), 0, len(value) - 1)
        at = np.interp(times, trace.time, value) / x.scale
        for sign, style in STYLES.items():
            here = way[nearest] == sign
            if here.any():
                shown.add(sign)
                axes.plot(
                    at[here],
                    heights[here] / y.scale,
                    linestyle="none",
                    rasterized=rasterise,
                    gid=f"{name}:{style['label']}",
                    **style,
                )
        axes.set_ylabel(y.label)
    handles += [
        Line2D([], [], linestyle="none", **{**STYLES[sign], "markersize": 3.5})
        for sign in (1, -1, 0)
        if sign in shown
    ]
    handles += _references(panels, trace, axis, units)
    margin = 0.03 * float(np.ptp(value))
    panels[-1].set_xlim((value.min() - margin) / x.scale, (value.max() + margin) / x.scale)
    panels[-1].set_xlabel(x.label)
    rate = rate_words(trace, axis, units)
    put_title(
        figure, heading(trace.attrs, f"{point_words(trace, units)}{'; ' + rate if rate else ''}")
    )
    figure.align_ylabels(panels)
    legend_below(figure, handles, 4)
    return figure


STYLES: dict[int, dict[str, Any]] = {
    0: {
        "label": "held",
        "color": REFERENCE,
        "marker": ".",
        "markersize": 1.5,
        "markeredgewidth": 0.0,
        "zorder": 2.0,
    },
    1: {
        "label": "rising",
        "color": BLUE,
        "marker": "o",
        "markersize": 1.6,
        "markeredgewidth": 0.0,
        "zorder": 2.1,
    },
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
    """Times and heights of the local maxima of samples, by the parabola through three
    of them."""
    before, here, after = values[:-2], values[1:-1], values[2:]
    place = np.flatnonzero((here > before) & (here >= after))
    a, b, c = before[place], here[place], after[place]
    offset = 0.5 * (a - c) / (a - 2 * b + c)  # the middle one is the greatest: within half a sample
    step = time[1] - time[0]
    return time[place + 1] + offset * step, b - 0.25 * (a - c) * offset


def draw_sweep(
    panels: list[Axes], results: Results, trace: Trace, axis: str, units: str
) -> list[Artist]:
    """The peaks of a sweep along the same axis, pale; where it has several values of
    another axis, at the ramp's."""
    if axis not in results.swept:
        raise InputError(
            f"--over: found a sweep of {', '.join(results.swept) or 'nothing'}; allowed: a sweep "
            f"of "
            f"{axis}, which this trace ramps."
        )
    held: dict[str, float] = {}
    for other in AXES:
        if other == axis:
            continue
        values = np.asarray(results.coords[other], dtype=float)
        wanted = float(set_values(trace, other)[0])
        held[other] = float(values[np.argmin(np.abs(values - wanted))])
        if abs(held[other] - wanted) > 0.01 * abs(wanted):
            raise InputError(
                f"--over: found a sweep at {operating_point({other: held[other]}, units)}; "
                f"allowed: one at "
                f"{operating_point({other: wanted}, units)}, as this trace."
            )
    one = line(ordered(results, held), axis)
    x = quantity(axis, units)
    value = set_values(trace, axis)
    fine = (one["status"] == OK) & (one.x >= value.min()) & (one.x <= value.max())
    handles: list[Artist] = []
    for row, procedure in enumerate(one.procedures):
        style: dict[str, Any] = {
            "linestyle": "none",
            "color": SWEPT if procedure != "down" else GREY,
            "marker": "o" if procedure != "down" else "x",
            "markersize": 3.0 if procedure != "down" else 2.2,
            "markeredgewidth": 0.0 if procedure != "down" else 0.4,
            "zorder": 1.0,
        }
        for axes, peaks in zip(panels, drawn_in(trace.attrs).peaks, strict=True):
            heights = (
                np.where(fine[row][:, None], one[peaks][row], np.nan) / quantity(peaks, units).scale
            )
            at = np.broadcast_to((one.x / x.scale)[:, None], heights.shape)
            axes.plot(
                at[np.isfinite(heights)],
                heights[np.isfinite(heights)],
                rasterized=heights.size > MANY_MARKERS,
                gid=f"sweep:{procedure}:{peaks}",
                **style,
            )
        word = "sweep" if procedure == "same" else f"sweep, {procedure}"
        handles.append(Line2D([], [], label=word, **{**style, "markersize": 3.5}))
    return handles


def _references(panels: list[Axes], trace: Trace, axis: str, units: str) -> list[Artist]:
    """The set speed and the wall of the hole, as lines, where their motions are drawn."""
    style: dict[str, Any] = {"color": REFERENCE, "linewidth": 0.7, "dashes": (4, 2), "zorder": 3}
    handles: list[Artist] = []
    speed = set_values(trace, "rotary_speed") / quantity("bit_speed", units).scale
    ends = np.array([speed.min(), speed.max()])
    modes = [panel.mode for panel in drawn_in(trace.attrs).panels]
    if "torsional" in modes and (axis == "rotary_speed" or ends[0] == ends[1]):
        torsion = panels[modes.index("torsional")]
        if axis == "rotary_speed":
            torsion.plot(ends, ends, gid="set speed", **style)
        else:
            torsion.axhline(ends[0], gid="set speed", **style)
        handles.append(Line2D([], [], label="set speed", **style))
    gap, r = trace.attrs.get("gap"), quantity("radius", units)
    if gap is None or "lateral" not in modes:
        return handles
    wall = panels[modes.index("lateral")]
    if wall.get_ylim()[1] > WALL_IN_SIGHT * float(gap) / r.scale:
        wall.axhline(float(gap) / r.scale, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
        handles.append(Line2D([], [], color=REFERENCE, linewidth=0.9, label="wall of the hole"))
    return handles


KINDS = (
    Kind(
        "ramp",
        "peaks of the three motions against the value that was moved: a bifurcation diagram made "
        "by a real ramp",
        of=RAMP,
        place=lambda data: 85 if isinstance(data, Trace) and moving(data) else None,
        draw=draw,
        takes=("over",),
        across=lambda data: moving(data)[0],
        advice=lambda data: "it shows a run along a ramp" if isinstance(data, Trace) else "",
    ),
)
