"""One trajectory: histories of the motions and forces, the orbit in the hole, phase planes, or all on a page."""

from __future__ import annotations

from math import pi
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Circle

from nsdrill.data import Trace
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in
from nsdrill.plot.decimation import envelope, last_part
from nsdrill.plot.kinds import has_orbit
from nsdrill.plot.labels import heading, quantity
from nsdrill.plot.schedule import moving, point_words, set_values
from nsdrill.plot.style import BLUE, FULL_WIDTH, MANY_MARKERS, REFERENCE, VERMILLION, new_figure, put_title
from nsdrill.variables import SCHEDULED

ROOM_FOR_HISTORY = 1.2  # inches of page
ROOM_FOR_SCHEDULE = 0.7  # inches of page for each value that moves
BINS = 1500  # stretches of a history: about one for each pixel of print
LAST_SAMPLES = 60_000  # of orbit and phase planes
LAST_TURNS = 20  # of the drive: more lie over each other and hide the shape


def draw(trace: Trace, kind: str = "trace", units: str = "si") -> Figure:
    if len(trace.time) < 2:
        raise InputError(f"trace: found {len(trace.time)} samples; allowed: two or more.")
    title = title_of(trace, units)
    drawn = drawn_in(trace.attrs)
    more, planes = ROOM_FOR_SCHEDULE * len(moving(trace)), len(drawn.planes)
    more -= ROOM_FOR_HISTORY * (6 - len(drawn.histories))
    if kind == "histories":
        figure = new_figure(FULL_WIDTH, 7.2 + more)
        draw_histories(figure, trace, units)
    elif kind == "orbit":
        figure = new_figure(4.0, 4.5)
        draw_orbit(figure.add_subplot(), trace, units)
    elif kind == "phase":
        figure = new_figure(FULL_WIDTH, 2.9)
        draw_planes(list(np.atleast_1d(figure.subplots(1, planes))), trace, units)
    else:
        figure = new_figure(FULL_WIDTH, 8.6 + more)
        left, right = cast("Any", figure.subfigures(1, 2, width_ratios=(1.6, 1.0)))
        draw_histories(left, trace, units)
        orbit = has_orbit(trace)
        panels = list(
            np.atleast_1d(right.subplots(orbit + planes, 1, height_ratios=[*[1.55] * orbit, *[1.0] * planes]))
        )
        if orbit:
            draw_orbit(panels[0], trace, units)
        draw_planes(panels[orbit:], trace, units)
        right.align_ylabels(panels[orbit:])
    put_title(figure, title if kind != "orbit" else title_of(trace, units, width=50))
    return figure


def title_of(trace: Trace, units: str, width: int = 100) -> str:
    """The title of the study and the operating point."""
    return heading(trace.attrs, _point(trace, units), width=width)


def _point(trace: Trace, units: str) -> str:
    procedure = str(trace.attrs.get("procedure") or "")
    words = {"up": "carried up", "down": "carried down", "same": ""}.get(procedure, procedure)
    return ", ".join(part for part in (point_words(trace, units), words) if part)


def draw_histories(figure: Figure | SubFigure, trace: Trace, units: str) -> None:
    """The motions and the contact forces against time, and what of the operating point moves, one below the other."""
    scheduled = [SCHEDULED[name] for name in moving(trace)]
    names = (*drawn_in(trace.attrs).histories, *scheduled)
    panels = list(np.atleast_1d(figure.subplots(len(names), 1, sharex=True)))
    time = quantity("time", units)
    for axes, name in zip(panels, names, strict=True):
        y = quantity(name, units)
        t, values = envelope(trace.time, trace[name] / y.scale, BINS)
        axes.plot(t / time.scale, values, color=BLUE, linewidth=0.5, gid=f"history:{name}")
        axes.set_ylabel(y.label)
        axes.margins(x=0)
    speed, gap = trace.attrs.get("rotary_speed"), trace.attrs.get("gap")
    if "bit_speed" in names and "drive_speed" in scheduled:
        speeds = set_values(trace, "rotary_speed") / quantity("bit_speed", units).scale
        t, values = envelope(trace.time, speeds, BINS)
        panels[names.index("bit_speed")].plot(
            t / time.scale, values, color=REFERENCE, linewidth=0.7, dashes=(4, 2), zorder=3, gid="set speed"
        )
    elif "bit_speed" in names and speed is not None:
        _reference(panels[names.index("bit_speed")], float(speed) / quantity("bit_speed", units).scale, "set speed")
    if "radius" in names and gap is not None:
        _reference(panels[names.index("radius")], float(gap) / quantity("radius", units).scale, "wall")
    panels[-1].set_xlabel(time.label)
    figure.align_ylabels(panels)


def _reference(axes: Axes, height: float, word: str) -> None:
    """A line that is not data, named where it ends so that no legend is needed."""
    axes.axhline(height, color=REFERENCE, linewidth=0.7, dashes=(4, 2), zorder=3, gid=word)
    axes.annotate(
        word,
        (1.0, height),
        xycoords=("axes fraction", "data"),
        xytext=(2, 0),
        textcoords="offset points",
        va="center",
        rotation=90,
        fontsize=6,
        color=REFERENCE,
    )


def shown_part(trace: Trace) -> tuple[slice, str]:
    """The part of the trace for orbit and phase planes, and the words for it (none if it is all)."""
    speed = float(trace["drive_speed"][-1] if "rotary_speed" in moving(trace) else trace.attrs.get("rotary_speed") or 0)
    part = last_part(trace.time, LAST_SAMPLES, LAST_TURNS * 2 * pi / speed if speed > 0 else None)
    if part.start == 0:
        return part, ""
    return part, f"last {trace.time[-1] - trace.time[part.start]:.3g} s"


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
    axes.set_aspect("equal")
    half = 1.06 * (reach or 1.0)
    axes.set(xlim=(-half, half), ylim=(-half, half), xlabel=across.label, ylabel=up.label)
    names = [words or "orbit", "red: on the wall" if on_wall.any() else ""]
    axes.set_title("; ".join(name for name in names if name))


def draw_planes(panels: list[Axes], trace: Trace, units: str) -> None:
    """Velocity over position for each motion."""
    part, words = shown_part(trace)
    for axes, (across, up) in zip(panels, drawn_in(trace.attrs).planes, strict=True):
        x, y = quantity(across, units), quantity(up, units)
        axes.plot(
            trace[across][part] / x.scale,
            trace[up][part] / y.scale,
            color=BLUE,
            linewidth=0.35,
            rasterized=len(trace.time[part]) > MANY_MARKERS,
            gid=f"phase:{across}",
        )
        axes.set(xlabel=x.label, ylabel=y.label)
        if words:
            axes.set_title(words)
        gap = trace.attrs.get("gap")
        if across == "radius" and gap is not None:
            low, high = axes.get_xlim()
            if low < float(gap) / x.scale < high:
                axes.axvline(float(gap) / x.scale, color=REFERENCE, linewidth=0.7, dashes=(4, 2), gid="wall")
