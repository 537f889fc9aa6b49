"""Buckling loads of collars and pipe."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from nsdrill.models.numbers import FULL_HELIX, HELIX, BucklingLoads
from nsdrill.plot.charts import (
    OPERATING_COLOUR,
    Chart,
    axis_quantity,
    chart_kind,
    set_log_ticks,
    shown_quantity,
    write_note,
)
from nsdrill.plot.style import BLACK, BLUE, REFERENCE, VERMILLION


def _draw(figure: Figure, axes: Axes, chart: Chart, units: str) -> list[Artist]:
    numbers: Any = chart.numbers
    force = shown_quantity("Axial load", "N", units)
    across = axis_quantity(numbers.axis, numbers.x, units)
    x = numbers.x / across.scale
    handles: list[Artist] = []
    tubes: tuple[tuple[str, np.ndarray, str, Any], ...] = (
        ("collars", numbers.collar, VERMILLION, "-"),
        ("pipe", numbers.pipe, BLUE, (0, (5, 1.5, 1, 1.5))),
    )
    for name, load, colour, dashes in tubes:
        height = load / force.scale
        if not (height > 0.0).any():
            continue  # the part floats in the mud, or does not fit the hole
        axes.plot(x, height, color=colour, linestyle=dashes, linewidth=1.3, gid=name)
        axes.fill_between(
            x,
            HELIX * height,
            FULL_HELIX * height,
            color=colour,
            alpha=0.25,
            linewidth=0,
            gid=f"{name} helix",
        )
        handles.append(
            Line2D(
                [],
                [],
                color=colour,
                linestyle=dashes,
                linewidth=1.3,
                label=f"{name}: sinusoid on the low side",
            )
        )
        handles.append(
            Patch(
                color=colour,
                alpha=0.25,
                linewidth=0,
                label=f"{name}: helix, from its onset to complete",
            )
        )
    other_loads: tuple[tuple[np.ndarray, Any, str], ...] = (
        (numbers.euler, (0, (5, 2)), "span of the collars, pinned (Euler)"),
        (numbers.vertical, (0, (1, 1.4)), "collars in a vertical hole, their own weight"),
        (numbers.wob, "-", "weight on bit of the study"),
    )
    for load, dashes, label in other_loads:
        height = load / force.scale
        if np.isfinite(height).any() and np.nanmax(height) > 0.0:
            width = 2.5 if dashes == "-" else 1.0
            colour = REFERENCE if dashes == "-" else BLACK
            axes.plot(x, height, color=colour, linestyle=dashes, linewidth=width, gid=label)
            handles.append(
                Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=label)
            )
    axes.set_yscale("log")
    set_log_ticks(axes.yaxis)
    if numbers.axis == "inclination":
        axes.set_xlim(0.0, 90.0)
        axes.xaxis.set_major_locator(MultipleLocator(15.0))
    else:
        axes.set_xlim(x[0], x[-1])
    axes.set_xlabel(across.label)
    axes.set_ylabel(force.label)
    axes.grid(True, axis="y", color=OPERATING_COLOUR, linewidth=0.4, zorder=0)
    if numbers.inclination is not None:
        write_note(axes, f"In a hole inclined by {math.degrees(numbers.inclination):.4g}°.")
    return handles


KINDS = (
    chart_kind(
        "buckling",
        "loads at which collars and pipe buckle against the inclination of the hole, or along an "
        "axis",
        BucklingLoads,
        _draw,
    ),
)
