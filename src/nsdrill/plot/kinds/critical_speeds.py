"""Critical speeds of a string along an axis, from the standing waves of its parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.models.numbers import CriticalSpeeds
from nsdrill.plot.charts import (
    OPERATING_COLOUR,
    Chart,
    axis_quantity,
    chart_kind,
    set_log_ticks,
    write_note,
)
from nsdrill.plot.labels import quantity
from nsdrill.plot.style import BLACK, BLUE, GREEN, REFERENCE, VERMILLION, font_size


def _draw(figure: Figure, axes: Axes, chart: Chart, units: str) -> list[Artist]:
    numbers: Any = chart.numbers
    across, up = axis_quantity(numbers.axis, numbers.x, units), quantity("rotary_speed", units)
    x = numbers.x / across.scale
    axial_label = f"axial waves, {numbers.lobes} lobe{'s' * (numbers.lobes > 1)} a turn, bit"
    families: tuple[tuple[str, np.ndarray, str, Any, float], ...] = (
        ("lateral, of 1, 2, 3 half waves of the span", numbers.lateral, VERMILLION, "-", 0.95),
        ("torsional waves, once a turn", numbers.torsional, BLUE, (0, (5, 2)), 0.85),
        (f"{axial_label} off the rock", numbers.axial, GREEN, (0, (5, 1.5, 1, 1.5)), 0.65),
        (f"{axial_label} on the rock", numbers.axial_on_rock, BLACK, (0, (1, 1.4)), 0.45),
    )
    handles: list[Artist] = []
    low, high = (speed / up.scale for speed in chart.speeds)
    # the rotary speed lies along both axes: the string is on the diagonal
    if numbers.axis == "rotary_speed":
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
        axes.axhspan(low, high, color=OPERATING_COLOUR, linewidth=0, zorder=0, gid="operating")
        handles.append(Patch(color=OPERATING_COLOUR, label="rotary speeds of the study"))
    else:
        axes.axhline(low, color=REFERENCE, linewidth=2.5, alpha=0.5, zorder=0, gid="operating")
        handles.append(
            Line2D(
                [], [], color=REFERENCE, linewidth=2.5, alpha=0.5, label="rotary speed of the study"
            )
        )
    for label, speeds_of_modes, colour, dashes, part_along in families:
        if not len(speeds_of_modes):
            continue
        for number, values in enumerate(speeds_of_modes / up.scale, start=1):
            axes.plot(x, values, color=colour, linestyle=dashes, linewidth=1.1, gid=label)
            finite = np.flatnonzero(np.isfinite(values))
            if finite.size:
                # each family at a different place, as its curves cross those of others
                position = finite[round(part_along * (finite.size - 1))]
                axes.annotate(
                    str(number),
                    (x[position], values[position]),
                    color=colour,
                    fontsize=font_size(6.5),
                    ha="center",
                    va="center",
                    bbox={"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none"},
                    zorder=4,
                )
        handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=1.1, label=label))
    axes.set_yscale("log")
    set_log_ticks(axes.yaxis)
    wave_speeds = [
        speeds_of_modes
        for speeds_of_modes in (numbers.torsional, numbers.axial)
        if len(speeds_of_modes)
    ]
    if wave_speeds:  # a span that is about to buckle has a speed of zero
        axes.set_ylim(
            bottom=0.6
            * min(float(speeds_of_modes.min()) for speeds_of_modes in wave_speeds)
            / up.scale
        )
    axes.set_xlim(x[0], x[-1])
    axes.grid(True, axis="y", color=OPERATING_COLOUR, linewidth=0.4, zorder=0)
    axes.set_xlabel(across.label)
    axes.set_ylabel(up.label)
    write_note(
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
