"""The path of the collar centre in the hole."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from nsdrill.data import Array, Trace, frozen_modes
from nsdrill.plot.labels import quantity
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    MANY_MARKERS,
    REFERENCE,
    VERMILLION,
    new_figure,
    page_width,
    put_title,
    say_over,
)
from nsdrill.plot.traces import check_length, shown_part, title_of

STEP = 2  # samples between which the direction is taken
MARKED = 300  # samples before the end in which it is marked


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(page_width(4.0), page_width(4.0) + 0.5)
    draw_orbit(figure.add_subplot(), trace, units)
    put_title(figure, title_of(trace, units, width=50))
    return figure


def draw_orbit(axes: Axes, trace: Trace, units: str) -> None:
    """The path of the collar centre seen along the hole; in another colour where the collar is on the wall."""
    part, words = shown_part(trace)
    across, up = quantity("x", units), quantity("y", units)
    x, y = trace["x"][part] / across.scale, trace["y"][part] / up.scale
    on_wall = trace["wall_force"][part] > 0
    heavy = len(x) > MANY_MARKERS
    axes.plot(x, y, color=BLUE, linewidth=0.4, rasterized=heavy, gid="orbit")
    if on_wall.any():
        axes.plot(
            np.where(on_wall, x, np.nan),
            np.where(on_wall, y, np.nan),
            color=VERMILLION,
            linewidth=0.7,
            rasterized=heavy,
            gid="orbit:wall",
        )
    axes.plot([0], [0], marker="+", color=REFERENCE, markersize=6, markeredgewidth=0.6, linestyle="none", gid="axis")
    gap = trace.attrs.get("gap")
    reach = float(np.nanmax(np.hypot(x, y), initial=0.0))
    if gap is not None:
        wall = float(gap) / across.scale
        axes.add_patch(Circle((0, 0), wall, fill=False, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall"))
        reach = max(reach, wall)
    draw_direction(axes, np.asarray(x), np.asarray(y), 0.15 * reach)
    axes.set_aspect("equal")
    half = 1.06 * (reach or 1.0)
    axes.set(xlim=(-half, half), ylim=(-half, half), xlabel=across.label, ylabel=up.label)
    names = [words or "orbit", "red: on the wall" if on_wall.any() else "", "dot: the end"]
    say_over(axes, "; ".join(name for name in names if name))


def draw_direction(axes: Axes, x: Array, y: Array, least: float) -> None:
    """A dot at the end of a path, and triangles along the last part of it that point forward in time, where the path
    reaches ``least`` far: they would cover a smaller one."""
    there = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(there) < STEP + 1:
        return
    end = there[-1]
    axes.plot([x[end]], [y[end]], marker="o", color=BLACK, markersize=3, linestyle="none", zorder=4, gid="end")
    if np.hypot(x[there], y[there]).max() < least:
        return
    for place in end - np.unique(np.linspace(0, min(len(there) - STEP, MARKED), 4)[1:-1].astype(int)):
        step = np.array([x[place + STEP] - x[place], y[place + STEP] - y[place]])
        if np.hypot(*step) > 0.0:
            angle = np.degrees(np.arctan2(step[1], step[0])) - 90.0
            axes.plot(
                [x[place]], [y[place]], marker=(3, 0, angle), color=BLACK, markersize=4.5, linestyle="none", zorder=4,
                gid="direction",
            )  # fmt: skip


def has_orbit(trace: Trace) -> bool:
    """Whether the collar centre of the trace has a path in the hole."""
    return {"x", "y"} <= trace.variables.keys() and "lateral" not in frozen_modes(trace.attrs)


def _advice(data: Any) -> str:
    if isinstance(data, Trace) and "lateral" in frozen_modes(data.attrs):
        return "the lateral motion is frozen: the collar centre stays in the middle"
    return ""


KINDS = (
    Kind(
        "orbit",
        "path of the collar centre in the hole",
        of=TRACE,
        place=lambda data: 82 if isinstance(data, Trace) and has_orbit(data) else None,
        draw=draw,
        advice=_advice,
    ),
)
