"""The path of the collar centre; and the collar in the hole, to scale, at one time of a
trace. An animation is a sequence of such pictures."""

from __future__ import annotations

import json
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import MarkerStyle
from matplotlib.patches import Circle
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from nsdrill.data import Array, Trace, frozen_modes, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in
from nsdrill.plot.labels import quantity
from nsdrill.plot.panels import WALL_VISIBLE_FROM
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    MANY_MARKERS,
    REFERENCE,
    VERMILLION,
    font_size,
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


def draw_orbit_page(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(page_width(4.0), page_width(4.0) + (0.5 if has_title() else 0.2))
    draw_orbit(figure.add_subplot(), trace, units)
    put_title(figure, title_of(trace, units, width=50))
    return figure


def mark_axis(axes: Axes, **placed: Any) -> None:
    """A small cross at the axis of the hole; ``placed`` are properties of the line, as
    ``zorder`` or ``gid``."""
    axes.plot([0], [0], marker="+", color=REFERENCE, markersize=6, markeredgewidth=0.6, linestyle="none", **placed)


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
    mark_axis(axes, gid="axis")
    extent, wall_text = float(np.nanmax(np.hypot(x, y), initial=0.0)), ""
    if gap is not None:
        wall = float(gap) / across.scale
        axes.add_patch(Circle((0, 0), wall, fill=False, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall"))
        if WALL_VISIBLE_FROM * wall <= extent or extent <= CONSTANT_TOLERANCE * wall:
            extent = max(extent, wall)
        else:
            wall_text = f"wall at {wall:.4g} {across.unit}"
    draw_direction(axes, np.asarray(x), np.asarray(y), 0.15 * extent)
    axes.set_aspect("equal")
    name_panel(axes, "orbit", "y")
    half_width = (1.2 if wall_text else 1.06) * (extent or 1.0)
    axes.set(xlim=(-half_width, half_width), ylim=(-half_width, half_width), xlabel=across.label, ylabel=up.label)
    notes = [part_text or "orbit", "red: on the wall" if on_wall.any() else "", wall_text, "dot: the end"]
    set_panel_title(axes, "; ".join(note for note in notes if note))


def smoothed_path(trace: Trace, part: slice, gap: float | None) -> tuple[Array, Array, Array]:
    """The path x, y [m] with the wall force [N]. Samples that are far apart for the
    ``gap`` [m] are joined by the cubic with the velocities at both (Hermite), so that a
    revolution along the wall is not drawn as a polygon."""
    time, x, y, force = (trace.time[part], trace["x"][part], trace["y"][part], trace["wall_force"][part])
    if gap is None or len(x) < 2 or not {"vx", "vy"} <= trace.variables.keys() or len(x) * SUBDIVISIONS > LAST_SAMPLES:
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
    curves = [CubicHermiteSpline(time, trace[name][part], trace[f"v{name}"][part])(fine_time) for name in ("x", "y")]
    return curves[0], curves[1], np.append(fine_force, force[-1])


def draw_direction(axes: Axes, x: Array, y: Array, min_extent: float) -> None:
    """Draw a dot at the end of a path, and along its last part arrowheads that point
    forward in time. A path that reaches less far than ``min_extent`` has no arrowheads,
    which would cover it."""
    finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(finite) < STEP + 1:
        return
    end = finite[-1]
    axes.plot([x[end]], [y[end]], marker="o", color=BLACK, markersize=3, linestyle="none", zorder=4, gid="end")
    if np.hypot(x[finite], y[finite]).max() < min_extent:
        return
    for place in end - np.unique(np.linspace(0, min(len(finite) - STEP, ARROW_SAMPLES), 4)[1:-1].astype(int)):
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


ROCK, MUD, STEEL, EDGE = "#CDBFA9", "#F5F2EA", "#C3CCD4", "#5A6570"
BIT, BLADES = "#8A7F6C", 3  # the bit below is a ring, with blades that rotate with it
PATH_REVOLUTIONS = 1.0  # of the bit: the length of the path up to the present time


@dataclass(frozen=True)
class Hole:
    """Radii of the hole and of the collar [m]."""

    hole: float
    collar: float

    @classmethod
    def of(cls, trace: Trace) -> Hole:
        """The radii of a trace; InputError where its attributes and study lack them."""
        gap, diameter = trace.attrs.get("gap"), _diameter(trace)
        if gap is None or diameter is None:
            raise InputError(
                "trace: found no width of the hole or of the collar; allowed: a trace whose "
                "string has them. The kind "
                "orbit needs neither."
            )
        return cls(float(gap) + 0.5 * diameter, 0.5 * diameter)


def _diameter(trace: Trace) -> float | None:
    """The outer diameter of the collar [m]: the value of the axis where it was swept,
    else that of the study."""
    key = drawn_in(trace.attrs).collar
    if key is None:
        return None
    axis_values = json.loads(str(trace.attrs.get("at") or "{}"))
    value: Any = resolved_study(trace.attrs)
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    value = axis_values.get(key, value)
    return float(value) if isinstance(value, int | float) else None


def bit_angle(trace: Trace) -> Array:
    """The rotation angle of the bit [rad], which is also that of the collar above it."""
    return np.asarray(trace["drive_angle"] + trace["twist"])


class Scene:
    """Hole, bit and collar in one axes. The static artists are drawn once;
    :meth:`show` moves the others."""

    def __init__(self, axes: Axes, trace: Trace, units: str) -> None:
        self.size = Hole.of(trace)
        across, up = quantity("x", units), quantity("y", units)
        self._scale = across.scale
        self._time, self._angle = trace.time, bit_angle(trace)
        self._x, self._y = trace["x"], trace["y"]
        self._force, self._speed = trace["wall_force"], trace["bit_speed"]
        self._shown_speed = quantity("bit_speed", units)
        self._revolution = 2 * pi / max(float(np.nanmean(np.abs(self._speed))), 1e-3)
        hole, collar = self.size.hole / self._scale, self.size.collar / self._scale
        half_width = 1.1 * hole
        axes.set_facecolor(ROCK)
        axes.set(
            xlim=(-half_width, half_width),
            ylim=(-half_width, half_width),
            xlabel=across.label,
            ylabel=up.label,
            aspect="equal",
        )
        axes.add_patch(Circle((0, 0), hole, facecolor=MUD, edgecolor=REFERENCE, linewidth=0.9, gid="wall"))
        axes.add_patch(Circle((0, 0), 0.95 * hole, fill=False, edgecolor=BIT, linewidth=0.6, linestyle="--", gid="bit"))
        mark_axis(axes, zorder=4)
        line_style: dict[str, Any] = {"solid_capstyle": "round", "zorder": 3}
        self._blades = [axes.plot([], [], color=BIT, linewidth=3.0, gid="blade")[0] for _ in range(BLADES)]
        self._collar = Circle((0, 0), collar, facecolor=STEEL, edgecolor=EDGE, linewidth=0.9, zorder=2, gid="collar")
        axes.add_patch(self._collar)
        (self._spoke,) = axes.plot([], [], color=EDGE, linewidth=1.2, gid="spoke", **line_style)
        (self._path,) = axes.plot([], [], color=BLUE, linewidth=0.7, alpha=0.8, gid="path", **line_style)
        (self._centre,) = axes.plot([], [], marker="o", color=BLUE, markersize=3.5, linestyle="none", zorder=4)
        (self._contact,) = axes.plot(
            [], [], marker="o", color=VERMILLION, markersize=6, linestyle="none", zorder=5, gid="touch"
        )
        self._text = axes.text(
            0.02, 0.98, "", transform=axes.transAxes, va="top", fontsize=font_size(7), gid="clock", zorder=6
        )

    @property
    def moving_artists(self) -> list[Artist]:
        """The artists that :meth:`show` moves, in the order in which they are drawn."""
        return [*self._blades, self._collar, self._path, self._spoke, self._centre, self._contact, self._text]

    def show(self, time: float, since: float | None = None) -> None:
        """Move the artists to the ``time`` [s], with the path from ``since`` [s] on, or
        that of the last revolution."""
        x, y, angle, force, speed = (
            float(np.interp(time, self._time, values))
            for values in (self._x, self._y, self._angle, self._force, self._speed)
        )
        hole, collar, scale = (self.size.hole / self._scale, self.size.collar / self._scale, self._scale)
        x, y = x / scale, y / scale
        for number, blade in enumerate(self._blades):
            direction = np.array([np.cos(angle + 2 * pi * number / BLADES), np.sin(angle + 2 * pi * number / BLADES)])
            blade.set_data(*np.outer(direction, [0.9 * hole, 0.985 * hole]))
        self._collar.set_center((x, y))
        self._spoke.set_data([x, x + collar * np.cos(angle)], [y, y + collar * np.sin(angle)])
        begin = time - PATH_REVOLUTIONS * self._revolution if since is None else since
        in_path = (self._time >= begin) & (self._time < time)
        self._path.set_data(np.append(self._x[in_path] / scale, x), np.append(self._y[in_path] / scale, y))
        self._centre.set_data([x], [y])
        radius = np.hypot(x, y)
        touching = force > 0.0 and radius > 0.0
        self._contact.set_data(*(([x / radius * hole], [y / radius * hole]) if touching else ([], [])))
        speed_shown = speed / self._shown_speed.scale
        self._text.set_text(f"{time:.2f} s\nbit {speed_shown:.2f} {self._shown_speed.unit}")


def draw_hole(trace: Trace, units: str = "si") -> Figure:
    """Draw the end of a trace."""
    check_length(trace)
    figure = new_figure(page_width(4.0), page_width(4.0) + (0.6 if has_title() else 0.2))
    axes = figure.add_subplot()
    scene = Scene(axes, trace, units)
    part, words = shown_part(trace)
    scene.show(float(trace.time[-1]), float(trace.time[part][0]))
    set_panel_title(axes, f"{words or 'path'}; collar and bit at the end")
    put_title(figure, title_of(trace, units, width=50))
    return figure


KINDS = (
    Kind(
        "orbit",
        "path of the collar centre in the hole",
        of=TRACE,
        place=lambda data: 82 if isinstance(data, Trace) and has_orbit(data) else None,
        draw=draw_orbit_page,
        advice=lambda data: (
            "the lateral motion is frozen: the collar centre stays in the middle"
            if isinstance(data, Trace) and "lateral" in frozen_modes(data.attrs)
            else ""
        ),
        part_of="trace",
    ),
    Kind(
        "hole",
        "the collar in the hole, to scale, with the path of its centre; animated, it whirls",
        of=TRACE,
        place=lambda data: 82.5 if isinstance(data, Trace) and has_orbit(data) else None,
        draw=draw_hole,
    ),
)
