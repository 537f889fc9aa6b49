"""The bifurcation diagram: every recorded peak of the axial, torsional and lateral motion along one axis.

Colour and shape of a marker say which critical responses its point shows, filled or open whether the state was carried
up or down. A point without peaks stands still and is drawn as a dash at its constant value.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.data import Results
from nsdrill.models.registry import drawn_in
from nsdrill.plot.columns import WORDS, frame, is_open, legend_below, outcome_handles, shade_hysteresis
from nsdrill.plot.labels import Shown, quantity
from nsdrill.plot.slices import Line
from nsdrill.plot.style import FULL_WIDTH, MANY_MARKERS, REFERENCE, RESPONSES, SHADE, SHADE_EDGE

HEIGHT = 6.3  # inches, of three panels and the words
WALL_IN_SIGHT = 0.4  # the wall is drawn where the motion comes this near to it, as a part of the gap


def draw(results: Results, units: str = "si") -> Figure:
    panels = drawn_in(results.attrs).panels
    figure, lines, columns = frame(results, units, len(panels), WORDS + (HEIGHT - WORDS) * len(panels) / 3)
    handles = outcome_handles(lines, markers=True)
    spans = steady = 0
    markers = sum(int(np.isfinite(results[peaks]).sum()) for peaks in (panel.peaks for panel in panels))
    for one, column in zip(lines, columns, strict=True):
        x = quantity(one.axis, units)
        for axes, panel in zip(column[1:], panels, strict=True):
            spans += shade_hysteresis(axes, one, x.scale)
            y = quantity(panel.peaks, units)
            steady += draw_peaks(axes, one, panel.peaks, panel.greatest, x, y, markers > MANY_MARKERS)
    rows = {panel.mode: [column[1 + row] for column in columns] for row, panel in enumerate(panels)}
    speed = draw_set_speed(lines, rows["torsional"], units) if "torsional" in rows else []
    wall = draw_wall(results, rows["lateral"], units) if "lateral" in rows else []
    for axes, panel in zip(columns[0][1:], panels, strict=True):
        axes.set_ylabel(quantity(panel.peaks, units).label)
    if {"up", "down"} <= set(lines[0].procedures):
        handles += [_marker("up: filled", REFERENCE), _marker("down: open", "none")]
    if spans:
        handles.append(Patch(facecolor=SHADE, edgecolor=SHADE_EDGE, linewidth=0.5, label="up and down differ"))
    if steady:
        handles.append(
            Line2D(
                [], [], color=REFERENCE, marker="_", linestyle="none", markersize=5, label="no peaks: constant value"
            )
        )
    legend_below(figure, [*handles, *speed, *wall], 4)
    return figure


def _marker(label: str, face: str) -> Line2D:
    return Line2D(
        [],
        [],
        color=REFERENCE,
        marker="o",
        markerfacecolor=face,
        linestyle="none",
        markersize=4,
        markeredgewidth=0.7,
        label=label,
    )


def draw_peaks(axes: Axes, one: Line, peaks: str, constant: str, x: Shown, y: Shown, rasterise: bool) -> int:
    """Draw one panel, an artist for each response and procedure; the number of points drawn as a constant value."""
    outcomes, values, still = one.outcome, one[peaks] / y.scale, one[constant] / y.scale
    at = one.x / x.scale
    size = marker_size(len(at), axes)
    steady = 0
    # By response first, so that grey lies below and the rarer combinations on top; the open markers after the filled.
    for code, style in enumerate(RESPONSES):
        for row, procedure in enumerate(one.procedures):
            points = outcomes[row] == code
            if not points.any():
                continue
            opened = is_open(procedure, one.procedures)
            heights = values[row, points]
            finite = np.isfinite(heights)
            where = np.broadcast_to(at[points][:, None], heights.shape)[finite]
            if where.size:
                axes.plot(
                    where,
                    heights[finite],
                    linestyle="none",
                    marker=style.marker,
                    color=style.colour,
                    markersize=size * _SIZE.get(style.marker, 1.0),
                    markerfacecolor="none" if opened else style.colour,
                    markeredgewidth=0.4 if opened else 0.0,
                    rasterized=rasterise,
                    zorder=2 + 0.01 * code,
                    gid=f"{peaks}:{procedure}:{code}",
                )
            none = ~finite.any(axis=1) & np.isfinite(still[row, points])
            if none.any():
                axes.plot(
                    at[points][none],
                    still[row, points][none],
                    linestyle="none",
                    marker="_",
                    color=style.colour,
                    markersize=size * 1.6,
                    markeredgewidth=0.9,
                    zorder=2 + 0.01 * code,
                    gid=f"{constant}:{procedure}:{code}",
                )
                steady += int(none.sum())
    return steady


# Shapes of equal nominal size differ in area: make them look alike.
_SIZE = {"o": 1.0, "^": 1.15, "s": 0.9, "p": 1.15, "D": 0.85, "P": 1.15, "X": 1.15, "*": 1.5}


def marker_size(points: int, axes: Axes) -> float:
    """Points of diameter: neighbours on the axis just touch, within what can be printed and told apart."""
    place = axes.get_subplotspec()
    columns = place.get_gridspec().ncols if place else 1
    spacing = 72 * (FULL_WIDTH - 0.7) / columns / max(points, 1)
    return float(np.clip(spacing, 1.7, 3.2))


def draw_set_speed(lines: list[Line], panels: list[Axes], units: str) -> list[Artist]:
    """The speed that the drive is set to, as a line: the bit turns with it where nothing happens."""
    y = quantity("rotary_speed", units)
    style: dict[str, Any] = {"color": REFERENCE, "linewidth": 0.7, "dashes": (4, 2), "zorder": 1.5}
    for one, axes in zip(lines, panels, strict=True):
        if one.axis == "rotary_speed" and len(one.x) > 1:
            axes.plot(one.x / y.scale, one.x / y.scale, gid="set speed", **style)
        else:
            place = one.place[3] if isinstance(one.place[3], int) else 0
            axes.axhline(float(one.results.coords["rotary_speed"][place]) / y.scale, gid="set speed", **style)
    return [Line2D([], [], label="set speed", **style)]


def draw_wall(results: Results, panels: list[Axes], units: str) -> list[Artist]:
    """The wall of the hole as a line, where its place is known; a word where the motion stays far from it."""
    gap = results.attrs.get("gap")
    if gap is None:
        return []
    r = quantity("radius_peaks", units)
    height = float(gap) / r.scale
    if panels[0].get_ylim()[1] < WALL_IN_SIGHT * height:
        return [Line2D([], [], linestyle="none", label=f"wall at {height:.4g} {r.unit}, out of sight")]
    for axes in panels:
        axes.axhline(height, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
    return [Line2D([], [], color=REFERENCE, linewidth=0.9, label="wall of the hole")]
