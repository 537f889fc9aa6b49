"""The path of the collar centre in the hole."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import MarkerStyle
from matplotlib.patches import Circle
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

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
    titled,
)
from nsdrill.plot.traces import LAST_SAMPLES, STILL, check_length, shown_part, title_of

STEP = 2  # samples between which the direction is taken
IN_SIGHT = 0.4  # the wall is in sight where the path comes this near to it, as a part of its radius
FINE = 0.1  # of the gap: samples that are farther apart have a curve between them
BETWEEN = 8  # points of such a curve
# pointing up
ARROW = Path([(-0.4, -0.6), (0.0, 1.0), (0.4, -0.6), (0.0, -0.25), (-0.4, -0.6)], closed=True)
MARKED = 300  # samples before the end in which it is marked


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(page_width(4.0), page_width(4.0) + (0.5 if titled() else 0.2))
    draw_orbit(figure.add_subplot(), trace, units)
    put_title(figure, title_of(trace, units, width=50))
    return figure


def draw_orbit(axes: Axes, trace: Trace, units: str) -> None:
    """The path of the collar centre seen along the hole; in another colour where the
    collar is on the wall."""
    part, words = shown_part(trace)
    across, up = quantity("x", units), quantity("y", units)
    gap = trace.attrs.get("gap")
    x, y, force = smooth(trace, part, None if gap is None else float(gap))
    x, y, on_wall = x / across.scale, y / up.scale, force > 0
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
    axes.plot(
        [0],
        [0],
        marker="+",
        color=REFERENCE,
        markersize=6,
        markeredgewidth=0.6,
        linestyle="none",
        gid="axis",
    )
    reach, far = float(np.nanmax(np.hypot(x, y), initial=0.0)), ""
    if gap is not None:
        wall = float(gap) / across.scale
        axes.add_patch(
            Circle((0, 0), wall, fill=False, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
        )
        if IN_SIGHT * wall <= reach or reach <= STILL * wall:
            reach = max(reach, wall)
        else:
            far = f"wall at {wall:.4g} {across.unit}"
    draw_direction(axes, np.asarray(x), np.asarray(y), 0.15 * reach)
    axes.set_aspect("equal")
    half = (1.2 if far else 1.06) * (reach or 1.0)
    axes.set(xlim=(-half, half), ylim=(-half, half), xlabel=across.label, ylabel=up.label)
    names = [words or "orbit", "red: on the wall" if on_wall.any() else "", far, "dot: the end"]
    say_over(axes, "; ".join(name for name in names if name))


def smooth(trace: Trace, part: slice, gap: float | None) -> tuple[Array, Array, Array]:
    """The path x, y [m] with the wall force [N] of its samples; of samples that are far
    apart for the ``gap`` with the cubic between them that has the speeds of both, so
    that a turn along the wall is no polygon."""
    time, x, y, force = (
        trace.time[part],
        trace["x"][part],
        trace["y"][part],
        trace["wall_force"][part],
    )
    if (
        gap is None
        or len(x) < 2
        or not {"vx", "vy"} <= trace.variables.keys()
        or len(x) * BETWEEN > LAST_SAMPLES
    ):
        return x, y, force
    good = np.isfinite(x) & np.isfinite(y)
    if not good.all() or np.max(np.hypot(np.diff(x), np.diff(y))) <= FINE * gap:
        return x, y, force
    from scipy.interpolate import CubicHermiteSpline

    parts = np.linspace(0.0, 1.0, BETWEEN, endpoint=False)
    fine = np.append((time[:-1, None] + parts * np.diff(time)[:, None]).ravel(), time[-1])
    both = np.minimum(force[:-1], force[1:])  # between two samples on the wall the path is on it
    between = np.where(parts == 0.0, force[:-1, None], both[:, None]).ravel()
    curves = [
        CubicHermiteSpline(time, trace[name][part], trace[f"v{name}"][part])(fine)
        for name in ("x", "y")
    ]
    return curves[0], curves[1], np.append(between, force[-1])


def draw_direction(axes: Axes, x: Array, y: Array, least: float) -> None:
    """A dot at the end of a path, and arrowheads along the last part of it that point
    forward in time, where the path reaches ``least`` far: they would cover a smaller
    one."""
    there = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(there) < STEP + 1:
        return
    end = there[-1]
    axes.plot(
        [x[end]],
        [y[end]],
        marker="o",
        color=BLACK,
        markersize=3,
        linestyle="none",
        zorder=4,
        gid="end",
    )
    if np.hypot(x[there], y[there]).max() < least:
        return
    for place in end - np.unique(
        np.linspace(0, min(len(there) - STEP, MARKED), 4)[1:-1].astype(int)
    ):
        step = np.array([x[place + STEP] - x[place], y[place + STEP] - y[place]])
        if np.hypot(*step) > 0.0:
            turned = Affine2D().rotate(np.arctan2(step[1], step[0]) - 0.5 * np.pi)
            axes.plot(
                [x[place]],
                [y[place]],
                marker=MarkerStyle(ARROW, transform=turned),
                color=BLACK,
                markersize=9,
                markeredgewidth=0.0,
                linestyle="none",
                zorder=4,
                gid="direction",
            )


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
