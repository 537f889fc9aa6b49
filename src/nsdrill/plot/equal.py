"""Lines of equal rate of penetration on pictures over two axes: what a setting yields,
beside whether it is safe."""

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
from nsdrill.plot.style import type_size

RATE = "rate_of_penetration"
MOST_LINES = 6
LEAST_SPREAD = 0.02  # of the greatest value: below it there is nothing to tell apart
LABEL_ROOM = 0.12  # between a label and a point that is to be clear, as a part of the axes


def drawn_of(model: Description) -> tuple[str, ...]:
    """The variables of a sweep of a model that the lines are drawn from."""
    return tuple(one.name for one in model.derived if one.name == RATE)


def draw_lines(
    axes: Axes,
    x: Array,
    y: Array,
    values: Array,
    units: str,
    clear: Sequence[tuple[float, float]] = (),
) -> bool:
    """Labelled lines of equal ``values`` [y, x], in SI, over the axes ``x`` and ``y``
    in shown units. False where there are none: fewer than two values of an axis, or
    nothing that varies. Where some are NaN, as those of points that were not run, the
    lines go through the others. No label stands over the points of the axes that are to
    be ``clear``."""
    values = values / quantity(RATE, units).scale
    known = np.isfinite(values)
    if min(values.shape) < 2 or np.count_nonzero(known) < 4:
        return False
    low, high = float(values[known].min()), float(values[known].max())
    levels = [
        level
        for level in MaxNLocator(MOST_LINES).tick_values(low, high)
        if max(low, 0.0) < level < high
    ]
    if high - low < LEAST_SPREAD * high or not levels:
        return False
    style: dict[str, Any] = {
        "levels": levels,
        "colors": "black",
        "linewidths": 0.7,
        "linestyles": "dashed",
    }
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
    size: dict[str, Any] = {"fontsize": type_size(6), "inline_spacing": 2}
    places = _places(axes, lines, clear, size) if clear else False
    for label in axes.clabel(lines, inline=True, manual=places, **size):
        label.set(path_effects=halo, gid="equal:label")
    return True


def _places(
    axes: Axes, lines: Any, clear: Sequence[tuple[float, float]], size: dict[str, Any]
) -> Any:
    """Where the labels of the lines stand; False where matplotlib's own choice leaves
    the points ``clear``."""
    usual = axes.clabel(lines, inline=False, **size)
    places = [label.get_position() for label in usual]
    for label in usual:
        label.remove()
    scale = np.abs([np.diff(axes.get_xlim())[0], np.diff(axes.get_ylim())[0]])

    def room(place: Any) -> float:
        return min(float(np.hypot(*((np.asarray(place) - point) / scale))) for point in clear)

    if all(room(place) > LABEL_ROOM for place in places):
        return False
    pieces = [piece for level in lines.allsegs for piece in level if len(piece)]
    moved = []
    for place in places:
        piece = min(pieces, key=lambda one: float(np.min(np.hypot(*((one - place) / scale).T))))
        along = [piece[round(part * (len(piece) - 1))] for part in (0.5, 0.3, 0.7, 0.15, 0.85)]
        away = [one for one in along if room(one) > LABEL_ROOM]
        moved.append(
            tuple(place if room(place) > LABEL_ROOM else away[0] if away else max(along, key=room))
        )
    return moved


def handle(units: str) -> Artist:
    """The entry of the legend."""
    shown = quantity(RATE, units)
    return Line2D(
        [],
        [],
        color="black",
        linewidth=0.7,
        linestyle="dashed",
        label=f"{shown.words} [{shown.unit}]",
    )
