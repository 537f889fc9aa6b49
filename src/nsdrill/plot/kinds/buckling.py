"""Loads at which collars and pipe buckle."""

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
from nsdrill.plot.charts import OPERATING, Chart, along, chart_kind, logarithmic, remark, shown
from nsdrill.plot.style import BLACK, BLUE, REFERENCE, VERMILLION


def _draw(figure: Figure, axes: Axes, drawn: Chart, units: str) -> list[Artist]:
    chart: Any = drawn.numbers
    force = shown("Axial load", "N", units)
    across = along(chart.axis, chart.x, units)
    x = chart.x / across.scale
    handles: list[Artist] = []
    tubes: tuple[tuple[str, np.ndarray, str, Any], ...] = (
        ("collars", chart.collar, VERMILLION, "-"),
        ("pipe", chart.pipe, BLUE, (0, (5, 1.5, 1, 1.5))),
    )
    for name, load, colour, dashes in tubes:
        height = load / force.scale
        if not (height > 0.0).any():
            continue  # it floats in the mud, or does not fit the hole
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
    others: tuple[tuple[np.ndarray, Any, str], ...] = (
        (chart.euler, (0, (5, 2)), "span of the collars, pinned (Euler)"),
        (chart.vertical, (0, (1, 1.4)), "collars in a vertical hole, their own weight"),
        (chart.wob, "-", "weight on bit of the study"),
    )
    for load, dashes, words in others:
        height = load / force.scale
        if np.isfinite(height).any() and np.nanmax(height) > 0.0:
            width = 2.5 if dashes == "-" else 1.0
            colour = REFERENCE if dashes == "-" else BLACK
            axes.plot(x, height, color=colour, linestyle=dashes, linewidth=width, gid=words)
            handles.append(
                Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=words)
            )
    axes.set_yscale("log")
    logarithmic(axes.yaxis)
    if chart.axis == "inclination":
        axes.set_xlim(0.0, 90.0)
        axes.xaxis.set_major_locator(MultipleLocator(15.0))
    else:
        axes.set_xlim(x[0], x[-1])
    axes.set_xlabel(across.label)
    axes.set_ylabel(force.label)
    axes.grid(True, axis="y", color=OPERATING, linewidth=0.4, zorder=0)
    if chart.inclination is not None:
        remark(axes, f"In a hole inclined by {math.degrees(chart.inclination):.4g}°.")
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
