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
from nsdrill.plot.references import WALL_VISIBLE_FROM
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    MANY_MARKERS,
    REFERENCE,
    VERMILLION,
    has_title,
    name_panel,
    new_figure,
    page_width,
    put_title,
    set_panel_title,
)
from nsdrill.plot.traces import CONSTANT_TOLERANCE, LAST_SAMPLES, check_length, shown_part, title_of

STEP = 2  # samples between which the direction is taken
MAX_STEP = 0.1  # of the gap: samples farther apart are joined by a curve
SUBDIVISIONS = 8  # of such a curve between two samples
# an arrowhead pointing up
ARROW = Path([(-0.4, -0.6), (0.0, 1.0), (0.4, -0.6), (0.0, -0.25), (-0.4, -0.6)], closed=True)
ARROW_SAMPLES = 300  # samples before the end over which arrowheads show the direction


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(page_width(4.0), page_width(4.0) + (0.5 if has_title() else 0.2))
    draw_orbit(figure.add_subplot(), trace, units)
    put_title(figure, title_of(trace, units, width=50))
    return figure


def draw_orbit(axes: Axes, trace: Trace, units: str) -> None:
    """Draw the path of the collar centre in the cross-section of the hole, in a
    different colour where the collar is on the wall."""
    part, part_text = shown_part(trace)
    across, up = quantity("x", units), quantity("y", units)
    gap = trace.attrs.get("gap")
    x, y, force = smoothed_path(trace, part, None if gap is None else float(gap))
    x, y, on_wall = x / across.scale, y / up.scale, force > 0
    rasterised = len(x) > MANY_MARKERS
    axes.plot(x, y, color=BLUE, linewidth=0.4, rasterized=rasterised, gid="orbit")
    if on_wall.any():
        axes.plot(
            np.where(on_wall, x, np.nan),
            np.where(on_wall, y, np.nan),
            color=VERMILLION,
            linewidth=0.7,
            rasterized=rasterised,
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
    extent, wall_text = float(np.nanmax(np.hypot(x, y), initial=0.0)), ""
    if gap is not None:
        wall = float(gap) / across.scale
        axes.add_patch(
            Circle((0, 0), wall, fill=False, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
        )
        if WALL_VISIBLE_FROM * wall <= extent or extent <= CONSTANT_TOLERANCE * wall:
            extent = max(extent, wall)
        else:
            wall_text = f"wall at {wall:.4g} {across.unit}"
    draw_direction(axes, np.asarray(x), np.asarray(y), 0.15 * extent)
    axes.set_aspect("equal")
    name_panel(axes, "orbit", "y")
    half_width = (1.2 if wall_text else 1.06) * (extent or 1.0)
    axes.set(
        xlim=(-half_width, half_width),
        ylim=(-half_width, half_width),
        xlabel=across.label,
        ylabel=up.label,
    )
    notes = [
        part_text or "orbit",
        "red: on the wall" if on_wall.any() else "",
        wall_text,
        "dot: the end",
    ]
    set_panel_title(axes, "; ".join(note for note in notes if note))


def smoothed_path(trace: Trace, part: slice, gap: float | None) -> tuple[Array, Array, Array]:
    """The path x, y [m] with the wall force [N]. Samples that are far apart for the
    ``gap`` [m] are joined by the cubic with the velocities at both (Hermite), so that a
    revolution along the wall is not drawn as a polygon."""
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
        or len(x) * SUBDIVISIONS > LAST_SAMPLES
    ):
        return x, y, force
    finite = np.isfinite(x) & np.isfinite(y)
    if not finite.all() or np.max(np.hypot(np.diff(x), np.diff(y))) <= MAX_STEP * gap:
        return x, y, force
    from scipy.interpolate import CubicHermiteSpline

    fractions = np.linspace(0.0, 1.0, SUBDIVISIONS, endpoint=False)
    fine_time = np.append((time[:-1, None] + fractions * np.diff(time)[:, None]).ravel(), time[-1])
    # between two samples on the wall the path is on the wall
    force_between = np.minimum(force[:-1], force[1:])
    fine_force = np.where(fractions == 0.0, force[:-1, None], force_between[:, None]).ravel()
    curves = [
        CubicHermiteSpline(time, trace[name][part], trace[f"v{name}"][part])(fine_time)
        for name in ("x", "y")
    ]
    return curves[0], curves[1], np.append(fine_force, force[-1])


def draw_direction(axes: Axes, x: Array, y: Array, min_extent: float) -> None:
    """Draw a dot at the end of a path, and along its last part arrowheads that point
    forward in time. A path that reaches less far than ``min_extent`` has no arrowheads,
    which would cover it."""
    finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(finite) < STEP + 1:
        return
    end = finite[-1]
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
    if np.hypot(x[finite], y[finite]).max() < min_extent:
        return
    for place in end - np.unique(
        np.linspace(0, min(len(finite) - STEP, ARROW_SAMPLES), 4)[1:-1].astype(int)
    ):
        step = np.array([x[place + STEP] - x[place], y[place + STEP] - y[place]])
        if np.hypot(*step) > 0.0:
            rotated = Affine2D().rotate(np.arctan2(step[1], step[0]) - 0.5 * np.pi)
            axes.plot(
                [x[place]],
                [y[place]],
                marker=MarkerStyle(ARROW, transform=rotated),
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
        part_of="trace",
    ),
)
