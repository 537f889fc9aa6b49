"""Lines of equal rate of penetration on pictures over two axes: what a setting yields, beside whether it is safe."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from nsdrill.data import Array
from nsdrill.models.description import Description
from nsdrill.plot.labels import quantity

RATE = "rate_of_penetration"
MOST_LINES = 6
LEAST_SPREAD = 0.02  # of the greatest value: below it there is nothing to tell apart


def drawn_of(model: Description) -> tuple[str, ...]:
    """The variables of a sweep of a model that the lines are drawn from."""
    return tuple(one.name for one in model.derived if one.name == RATE)


def draw_lines(axes: Axes, x: Array, y: Array, values: Array, units: str) -> bool:
    """Labelled lines of equal ``values`` [y, x], in SI, over the axes ``x`` and ``y`` in shown units. False where there
    are none: fewer than two values of an axis, or nothing that varies. Where some are NaN, as those of points that were
    not run, the lines go through the others."""
    values = values / quantity(RATE, units).scale
    known = np.isfinite(values)
    if min(values.shape) < 2 or np.count_nonzero(known) < 4:
        return False
    low, high = float(values[known].min()), float(values[known].max())
    levels = [level for level in MaxNLocator(MOST_LINES).tick_values(low, high) if max(low, 0.0) < level < high]
    if high - low < LEAST_SPREAD * high or not levels:
        return False
    style: dict[str, Any] = {"levels": levels, "colors": "black", "linewidths": 0.7, "linestyles": "dashed"}
    if known.all():
        lines: Any = axes.contour(x, y, values, zorder=4, **style)
    else:
        across, up = np.meshgrid(x, y)
        rows, columns = known.any(axis=1), known.any(axis=0)
        if np.count_nonzero(rows) < 2 or np.count_nonzero(columns) < 2:
            return False
        lines = axes.tricontour(across[known], up[known], values[known], zorder=4, **style)
    halo = [patheffects.withStroke(linewidth=1.8, foreground="white")]
    lines.set(gid="equal", path_effects=halo)
    for label in axes.clabel(lines, fontsize=6, inline=True, inline_spacing=2):
        label.set(path_effects=halo, gid="equal:label")
    return True


def handle(units: str) -> Artist:
    """The entry of the legend."""
    shown = quantity(RATE, units)
    return Line2D([], [], color="black", linewidth=0.7, linestyle="dashed", label=f"{shown.words} [{shown.unit}]")
