"""Lines of a picture that are not data, the set speed and the wall of the hole, and the
size of markers."""

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

# the wall is drawn where the motion comes this near to it, as a part of the gap
WALL_IN_SIGHT = 0.4


def marker_size(points: int, axes: Axes) -> float:
    """Points of diameter: neighbours on the axis just touch, within what can be printed
    and told apart."""
    place = axes.get_subplotspec()
    columns = place.get_gridspec().ncols if place else 1
    spacing = 72 * (page_width() - 0.7) / columns / max(points, 1)
    return float(np.clip(spacing, 1.7, 3.2))


def draw_set_speed(lines: list[Line], panels: list[Axes], units: str) -> list[Artist]:
    """The speed that the drive is set to, as a line: the bit turns with it where
    nothing happens."""
    y = quantity("rotary_speed", units)
    style: dict[str, Any] = {"color": REFERENCE, "linewidth": 0.7, "dashes": (4, 2), "zorder": 1.5}
    for one, axes in zip(lines, panels, strict=True):
        if one.axis == "rotary_speed" and len(one.x) > 1:
            axes.plot(one.x / y.scale, one.x / y.scale, gid="set speed", **style)
        else:
            place = one.place[3] if isinstance(one.place[3], int) else 0
            axes.axhline(
                float(one.results.coords["rotary_speed"][place]) / y.scale, gid="set speed", **style
            )
    return [Line2D([], [], label="set speed", **style)]


def draw_wall(results: Results, panels: list[Axes], units: str) -> list[Artist]:
    """The wall of the hole as a line, where its place is known; a word where the motion
    stays far from it."""
    gap = results.attrs.get("gap")
    if gap is None:
        return []
    r = quantity("radius_peaks", units)
    height = float(gap) / r.scale
    if panels[0].get_ylim()[1] < WALL_IN_SIGHT * height:
        return [
            Line2D([], [], linestyle="none", label=f"wall at {height:.4g} {r.unit}, out of sight")
        ]
    for axes in panels:
        axes.axhline(height, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
    return [Line2D([], [], color=REFERENCE, linewidth=0.9, label="wall of the hole")]
