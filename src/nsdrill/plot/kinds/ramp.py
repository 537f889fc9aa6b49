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

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError, option
from nsdrill.models.registry import drawn_in
from nsdrill.plot.labels import heading, operating_point, quantity, way_word
from nsdrill.plot.page import finish, line_entry, name_panel, new_figure, stack
from nsdrill.plot.panels import draw_wall
from nsdrill.plot.registry import RAMP, Kind
from nsdrill.plot.slices import line, ordered
from nsdrill.plot.style import BLUE, DASHED, GREY, MANY_MARKERS, REFERENCE, VERMILLION, page_width
from nsdrill.plot.traces import moving_values, operating_point_text, rate_text, setpoint
from nsdrill.variables import AXES, OK

SWEEP_COLOUR = "#D9D9D9"  # of the sweep below, paler than the peaks of the ramp


def draw(trace: Trace, units: str = "si", over: Results | None = None) -> Figure:
    axis, shown = moving_values(trace)[0], drawn_in(trace.attrs).panels
    x, values = quantity(axis, units), setpoint(trace, axis)
    figure = new_figure(page_width(), 1.2 + 1.7 * len(shown))
    panels = stack(figure, len(shown))
    direction = np.sign(np.diff(values, append=values[-1]))
    direction[-1] = direction[-2]
    handles = draw_sweep(panels, over, trace, axis, units) if over is not None else []
    peaks = [local_maxima(trace.time, trace[panel.trace]) for panel in shown]
    rasterise = sum(len(times) for times, _ in peaks) > MANY_MARKERS
    signs_shown = set()
    for axes, panel, (times, heights) in zip(panels, shown, peaks, strict=True):
        y = quantity(panel.peaks, units)
        sign_of_peak = direction[np.clip(np.searchsorted(trace.time, times), 0, len(values) - 1)]
        across = np.interp(times, trace.time, values) / x.scale
        for sign, style in STYLES.items():
            here, gid = sign_of_peak == sign, f"{panel.trace}:{style['label']}"
            if here.any():
                signs_shown.add(sign)
                points = across[here], heights[here] / y.scale
                axes.plot(*points, linestyle="none", rasterized=rasterise, gid=gid, **style)
        axes.set_ylabel(y.label)
        name_panel(axes, panel.peaks, panel.peaks)
    styles = [STYLES[sign] | {"markersize": 3.5} for sign in (1, -1, 0) if sign in signs_shown]
    handles += [line_entry(linestyle="none", **style) for style in styles]
    by_mode = {panel.mode: [axes] for panel, axes in zip(shown, panels, strict=True)}
    handles += _draw_rotary_speed(by_mode.get("torsional", []), trace, axis, units)
    handles += draw_wall(trace.attrs, by_mode.get("lateral", []), units)
    margin = 0.03 * float(np.ptp(values))
    panels[-1].set_xlim((values.min() - margin) / x.scale, (values.max() + margin) / x.scale)
    panels[-1].set_xlabel(x.label)
    figure.align_ylabels(panels)
    point = "; ".join(filter(None, (operating_point_text(trace, units), rate_text(trace, axis, units))))
    return finish(figure, heading(trace.attrs, point), handles, 4)


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
    for other in (name for name in AXES if name != axis):
        axis_values = np.asarray(results.coords[other], dtype=float)
        target = float(setpoint(trace, other)[0])
        held[other] = float(axis_values[np.argmin(np.abs(axis_values - target))])
        if abs(held[other] - target) > 0.01 * abs(target):
            raise InputError(
                f"{option('over')}: found a sweep at {operating_point({other: held[other]}, units)}; "
                f"allowed: one at {operating_point({other: target}, units)}, as this trace."
            )
    sweep_line, values_set = line(ordered(results, held), axis, units), setpoint(trace, axis)
    in_range = (sweep_line["status"] == OK) & (sweep_line.x >= values_set.min()) & (sweep_line.x <= values_set.max())
    handles: list[Artist] = []
    for row, procedure in enumerate(sweep_line.procedures):
        style: dict[str, Any] = {"color": SWEEP_COLOUR, "marker": "o", "markersize": 3.0, "markeredgewidth": 0.0}
        if procedure == "down":
            style = {"color": GREY, "marker": "x", "markersize": 2.2, "markeredgewidth": 0.4}
        style |= {"linestyle": "none", "zorder": 1.0}
        for axes, peaks in zip(panels, drawn_in(trace.attrs).peaks, strict=True):
            heights = np.where(in_range[row][:, None], sweep_line.shown(peaks)[row], np.nan)
            across, finite = np.broadcast_to(sweep_line.across[:, None], heights.shape), np.isfinite(heights)
            own: dict[str, Any] = {"rasterized": heights.size > MANY_MARKERS, "gid": f"sweep:{procedure}:{peaks}"}
            axes.plot(across[finite], heights[finite], **own, **style)
        label = "sweep" if procedure == "same" else f"sweep, {way_word(procedure, results.attrs)}"
        handles.append(line_entry(label=label, **{**style, "markersize": 3.5}))
    return handles


def _draw_rotary_speed(panels: list[Axes], trace: Trace, axis: str, units: str) -> list[Artist]:
    """Draw the rotary speed as a line, unless it moves while another value lies along
    x."""
    speed = setpoint(trace, "rotary_speed") / quantity("bit_speed", units).scale
    ends, style = np.array([speed.min(), speed.max()]), {**DASHED, "zorder": 3}
    if not panels or (axis != "rotary_speed" and ends[0] != ends[1]):
        return []
    if axis == "rotary_speed":
        panels[0].plot(ends, ends, gid="rotary speed", **style)
    else:
        panels[0].axhline(ends[0], gid="rotary speed", **style)
    return [line_entry(label="rotary speed", **style)]


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
