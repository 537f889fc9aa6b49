"""Reference lines of pictures, the rotary speed and the wall of the hole, and the size of
markers."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from nsdrill.data import Results
from nsdrill.plot.labels import quantity
from nsdrill.plot.slices import Line
from nsdrill.plot.style import REFERENCE, page_width

# the wall is drawn where the motion reaches this part of the gap
WALL_VISIBLE_FROM = 0.4


def marker_size(points: int, axes: Axes) -> float:
    """The diameter of markers [points]: neighbours on the axis just touch, within the
    limits of what can be printed and distinguished."""
    subplot_spec = axes.get_subplotspec()
    columns = subplot_spec.get_gridspec().ncols if subplot_spec else 1
    spacing = 72 * (page_width() - 0.7) / columns / max(points, 1)
    return float(np.clip(spacing, 1.7, 3.2))


def draw_set_speed(lines: list[Line], panels: list[Axes], units: str) -> list[Artist]:
    """The set speed of the drive as a line: the speed of the bit in steady drilling."""
    y = quantity("rotary_speed", units)
    style: dict[str, Any] = {"color": REFERENCE, "linewidth": 0.7, "dashes": (4, 2), "zorder": 1.5}
    for line, axes in zip(lines, panels, strict=True):
        if line.axis == "rotary_speed" and len(line.x) > 1:
            axes.plot(line.x / y.scale, line.x / y.scale, gid="rotary speed", **style)
        else:
            place = line.place[3] if isinstance(line.place[3], int) else 0
            axes.axhline(
                float(line.results.coords["rotary_speed"][place]) / y.scale,
                gid="rotary speed",
                **style,
            )
    return [Line2D([], [], label="rotary speed", **style)]


def draw_wall(results: Results, panels: list[Axes], units: str) -> list[Artist]:
    """The wall of the hole as a line, where the file has its distance; an entry of the
    legend alone where the motion stays far from it."""
    gap = results.attrs.get("gap")
    if gap is None:
        return []
    radius = quantity("radius_peaks", units)
    height = float(gap) / radius.scale
    if panels[0].get_ylim()[1] < WALL_VISIBLE_FROM * height:
        return [
            Line2D(
                [], [], linestyle="none", label=f"wall at {height:.4g} {radius.unit}, out of sight"
            )
        ]
    for axes in panels:
        axes.axhline(height, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
    return [Line2D([], [], color=REFERENCE, linewidth=0.9, label="wall of the hole")]
