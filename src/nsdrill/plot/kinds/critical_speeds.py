"""Critical speeds of a string along an axis, as the standing waves of its parts have
them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.models.numbers import CriticalSpeeds
from nsdrill.plot.charts import OPERATING, Chart, along, chart_kind, logarithmic, remark
from nsdrill.plot.labels import quantity
from nsdrill.plot.style import BLACK, BLUE, GREEN, REFERENCE, VERMILLION, type_size


def _draw(figure: Figure, axes: Axes, drawn: Chart, units: str) -> list[Artist]:
    chart: Any = drawn.numbers
    across, up = along(chart.axis, chart.x, units), quantity("rotary_speed", units)
    x = chart.x / across.scale
    over = f"axial waves, {chart.lobes} lobe{'s' * (chart.lobes > 1)} a turn, bit"
    families: tuple[tuple[str, np.ndarray, str, Any, float], ...] = (
        ("lateral, of 1, 2, 3 half waves of the span", chart.lateral, VERMILLION, "-", 0.95),
        ("torsional waves, once a turn", chart.torsional, BLUE, (0, (5, 2)), 0.85),
        (f"{over} off the rock", chart.axial, GREEN, (0, (5, 1.5, 1, 1.5)), 0.65),
        (f"{over} on the rock", chart.axial_on_rock, BLACK, (0, (1, 1.4)), 0.45),
    )
    handles: list[Artist] = []
    low, high = (speed / up.scale for speed in drawn.speeds)
    # the string turns with the speed that lies across: on the diagonal
    if chart.axis == "rotary_speed":
        axes.plot(x, x, color=REFERENCE, linewidth=2.5, alpha=0.5, zorder=0, gid="operating")
        handles.append(
            Line2D(
                [],
                [],
                color=REFERENCE,
                linewidth=2.5,
                alpha=0.5,
                label="the speed at which the string turns",
            )
        )
    elif high > low:
        axes.axhspan(low, high, color=OPERATING, linewidth=0, zorder=0, gid="operating")
        handles.append(Patch(color=OPERATING, label="rotary speeds of the study"))
    else:
        axes.axhline(low, color=REFERENCE, linewidth=2.5, alpha=0.5, zorder=0, gid="operating")
        handles.append(
            Line2D(
                [], [], color=REFERENCE, linewidth=2.5, alpha=0.5, label="rotary speed of the study"
            )
        )
    for words, modes, colour, dashes, place in families:
        if not len(modes):
            continue
        for number, values in enumerate(modes / up.scale, start=1):
            axes.plot(x, values, color=colour, linestyle=dashes, linewidth=1.1, gid=words)
            there = np.flatnonzero(np.isfinite(values))
            if there.size:
                # each kind at another place, as its modes cross others
                at = there[round(place * (there.size - 1))]
                axes.annotate(
                    str(number),
                    (x[at], values[at]),
                    color=colour,
                    fontsize=type_size(6.5),
                    ha="center",
                    va="center",
                    bbox={"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none"},
                    zorder=4,
                )
        handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=1.1, label=words))
    axes.set_yscale("log")
    logarithmic(axes.yaxis)
    waves = [modes for modes in (chart.torsional, chart.axial) if len(modes)]
    if waves:  # a span that is about to buckle has a speed of zero
        axes.set_ylim(bottom=0.6 * min(float(modes.min()) for modes in waves) / up.scale)
    axes.set_xlim(x[0], x[-1])
    axes.grid(True, axis="y", color=OPERATING, linewidth=0.4, zorder=0)
    axes.set_xlabel(across.label)
    axes.set_ylabel(up.label)
    remark(
        axes,
        "The equations of motion have one mode of each kind, near the first (axial: off the "
        "rock), and no others.",
    )
    return handles


KINDS = (
    chart_kind(
        "critical-speeds",
        "lateral, torsional and axial critical speeds against depth, or along another axis",
        CriticalSpeeds,
        _draw,
    ),
)
