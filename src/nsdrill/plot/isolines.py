"""Lines of equal rate of penetration on pictures over two axes, which show the yield of
a setting beside its safety."""

from __future__ import annotations

from collections.abc import Sequence
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
from nsdrill.plot.style import font_size

RATE_OF_PENETRATION = "rate_of_penetration"
MAX_LINES = 6
MIN_RELATIVE_RANGE = 0.02  # range relative to the greatest value: below it no lines are drawn
LABEL_CLEARANCE = 0.12  # between a label and a point kept clear, as a part of the axes


def line_variables(model: Description) -> tuple[str, ...]:
    """The variables of a sweep of ``model`` that the lines are drawn from."""
    return tuple(variable.name for variable in model.derived if variable.name == RATE_OF_PENETRATION)


def draw_lines(
    axes: Axes, x: Array, y: Array, values: Array, units: str, keep_clear: Sequence[tuple[float, float]] = ()
) -> bool:
    """Draw labelled lines of equal ``values`` [y, x], in SI, over the axes ``x`` and
    ``y`` in shown units. Values of NaN, as of points that were not run, are left out
    and the lines follow from the others. No label stands over the points
    ``keep_clear``, in units of the axes.

    Returns whether there are any lines: not with fewer than two values along an axis,
    or with values that hardly vary.
    """
    values = values / quantity(RATE_OF_PENETRATION, units).scale
    known = np.isfinite(values)
    if min(values.shape) < 2 or np.count_nonzero(known) < 4:
        return False
    low, high = float(values[known].min()), float(values[known].max())
    levels = [level for level in MaxNLocator(MAX_LINES).tick_values(low, high) if max(low, 0.0) < level < high]
    if high - low < MIN_RELATIVE_RANGE * high or not levels:
        return False
    style: dict[str, Any] = {"levels": levels, "colors": "black", "linewidths": 0.7, "linestyles": "dashed"}
    if known.all():
        lines: Any = axes.contour(x, y, values, zorder=4, **style)
    else:
        x_grid, y_grid = np.meshgrid(x, y)
        rows, columns = known.any(axis=1), known.any(axis=0)
        if np.count_nonzero(rows) < 2 or np.count_nonzero(columns) < 2:
            return False
        lines = axes.tricontour(x_grid[known], y_grid[known], values[known], zorder=4, **style)
    halo = [patheffects.withStroke(linewidth=1.8, foreground="white")]
    lines.set(gid="equal", path_effects=halo)
    label_style: dict[str, Any] = {"fontsize": font_size(6), "inline_spacing": 2}
    positions = _label_positions(axes, lines, keep_clear, label_style) if keep_clear else False
    for label in axes.clabel(lines, inline=True, manual=positions, **label_style):
        label.set(path_effects=halo, gid="equal:label")
    return True


def _label_positions(
    axes: Axes, lines: Any, keep_clear: Sequence[tuple[float, float]], label_style: dict[str, Any]
) -> Any:
    """The positions of the labels of the lines; False, for matplotlib's own positions,
    where these leave the points ``keep_clear`` free."""
    default_labels = axes.clabel(lines, inline=False, **label_style)
    positions = [label.get_position() for label in default_labels]
    for label in default_labels:
        label.remove()
    scale = np.abs([np.diff(axes.get_xlim())[0], np.diff(axes.get_ylim())[0]])

    def clearance(position: Any) -> float:
        return min(float(np.hypot(*((np.asarray(position) - point) / scale))) for point in keep_clear)

    if all(clearance(position) > LABEL_CLEARANCE for position in positions):
        return False
    segments = [segment for level in lines.allsegs for segment in level if len(segment)]
    moved = []
    for position in positions:
        segment = min(segments, key=lambda candidate: float(np.min(np.hypot(*((candidate - position) / scale).T))))
        candidates = [segment[round(fraction * (len(segment) - 1))] for fraction in (0.5, 0.3, 0.7, 0.15, 0.85)]
        clear_candidates = [candidate for candidate in candidates if clearance(candidate) > LABEL_CLEARANCE]
        moved.append(
            tuple(
                position
                if clearance(position) > LABEL_CLEARANCE
                else clear_candidates[0]
                if clear_candidates
                else max(candidates, key=clearance)
            )
        )
    return moved


def legend_entry(units: str) -> Artist:
    """The entry of the lines in a legend."""
    shown = quantity(RATE_OF_PENETRATION, units)
    return Line2D([], [], color="black", linewidth=0.7, linestyle="dashed", label=f"{shown.words} [{shown.unit}]")
