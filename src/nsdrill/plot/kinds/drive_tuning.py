"""The slope of friction that a soft-torque drive holds, over its gain and its
frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.models.numbers import DriveTuning
from nsdrill.plot.charts import (
    SLOPE_UNIT,
    TO_HERTZ,
    Chart,
    chart_kind,
    set_log_ticks,
    shown_quantity,
)
from nsdrill.plot.style import BLACK, REFERENCE, font_size


def _draw(figure: Figure, axes: Axes, chart: Chart, units: str) -> list[Artist]:
    numbers: Any = chart.numbers
    slope = shown_quantity("Fall of friction that is held", SLOPE_UNIT, units)
    x, y, held_slope = numbers.matching, numbers.frequency * TO_HERTZ, numbers.held / slope.scale
    mesh = axes.pcolormesh(
        x, y, held_slope, cmap="viridis", shading="gouraud", rasterized=True, gid="cells"
    )
    lines = axes.contour(x, y, held_slope, levels=8, colors="white", linewidths=0.6)
    axes.clabel(lines, fontsize=font_size(6), fmt="%g")
    figure.colorbar(mesh, ax=axes, label=slope.label, fraction=0.05, pad=0.01, aspect=30)
    handles: list[Artist] = []
    axes.axhline(numbers.lumped * TO_HERTZ, color="white", linewidth=1.0, linestyle=(0, (5, 2)))
    handles.append(
        Line2D(
            [],
            [],
            color=REFERENCE,
            linewidth=1.0,
            linestyle=(0, (5, 2)),
            label="frequency of the string",
        )
    )
    matching, frequency, best = numbers.best
    markers: Sequence[tuple[tuple[float, float], str, float, str]] = (
        (
            (matching, frequency * TO_HERTZ),
            "*",
            11.0,
            f"best: {matching:.3g} impedances, {frequency * TO_HERTZ:.3g} Hz, holds "
            f"{best / slope.scale:.4g}",
        ),
        *(
            [((numbers.own[0], numbers.own[1] * TO_HERTZ), "o", 6.0, "the drive of the study")]
            if numbers.own
            else []
        ),
    )
    for position, marker, marker_size, label in markers:
        style: dict[str, Any] = {
            "marker": marker,
            "markersize": marker_size,
            "linestyle": "none",
            "color": "white",
            "markeredgecolor": BLACK,
            "markeredgewidth": 0.9,
            "label": label,
        }
        if x[0] <= position[0] <= x[-1] and y[0] <= position[1] <= y[-1]:
            axes.plot(*np.atleast_1d(*position), **style, gid=label, clip_on=False, zorder=5)
            handles.append(Line2D([], [], **style))
        else:
            handles.append(Line2D([], [], linestyle="none", label=f"{label} lies outside"))
    for axis, scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
        scale("log")
        set_log_ticks(axis, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(y[0], y[-1])
    axes.set_xlabel("Gain of the drive, in impedances of the pipe")
    axes.set_ylabel("Frequency of the drive [Hz]")
    return handles


KINDS = (
    chart_kind(
        "drive-tuning",
        "the slope of friction that a soft-torque drive holds, over its gain and its frequency",
        DriveTuning,
        _draw,
    ),
)
