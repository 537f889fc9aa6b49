"""How much of a torsional wave each drive reflects, and the slope of friction that it
holds."""

from __future__ import annotations

from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.models.numbers import DriveCard
from nsdrill.plot.charts import (
    SLOPE_UNIT,
    TO_HERTZ,
    Chart,
    chart_kind,
    set_log_ticks,
    shown_quantity,
    write_note,
)
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    REFERENCE,
    SKY,
    VERMILLION,
    WINE,
    font_size,
)

# Colour and dashes of each drive; the dashes distinguish them in grey.
DRIVES: dict[str, tuple[str, Any]] = {
    "ideal": (BLACK, "-"),
    "stiff": (WINE, (0, (1, 1.2))),
    "soft_torque": (VERMILLION, "-"),
    "equal_damping": (BLUE, (0, (5, 2))),
    "z_torque": (GREEN, (0, (5, 1.5, 1, 1.5))),
    "pi": (ORANGE, (0, (3, 1, 1, 1, 1, 1))),
    "dc_motor": (SKY, (0, (7, 1.5))),
}


def _draw(figure: Figure, axes: Axes, chart: Chart, units: str) -> list[Artist]:
    numbers: Any = chart.numbers
    slope = shown_quantity("", SLOPE_UNIT, units)
    x = numbers.frequency * TO_HERTZ
    handles: list[Artist] = []
    for kind, held_slope in numbers.held.items():
        label = (
            f"{'this study: ' if kind == numbers.own else ''}{kind.replace('_', ' ')}, holds "
            f"{held_slope / slope.scale:.4g}"
        )
        if kind not in numbers.reflected:
            handles.append(Line2D([], [], linestyle="none", label=f"{label} (no impedance)"))
            continue
        colour, dashes = DRIVES[kind]
        width = 2.0 if kind == numbers.own else 1.1
        axes.plot(
            x, numbers.reflected[kind], color=colour, linestyle=dashes, linewidth=width, gid=kind
        )
        handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=label))
    for number, wave in enumerate(numbers.waves * TO_HERTZ, start=1):
        axes.axvline(wave, color=REFERENCE, linewidth=0.7, linestyle=(0, (1, 2)), zorder=0)
        axes.annotate(
            f"mode {number}",
            (wave, 0.0),
            xytext=(2, 3),
            textcoords="offset points",
            fontsize=font_size(7),
            color=REFERENCE,
            rotation=90,
            va="bottom",
        )
    axes.set_xscale("log")
    set_log_ticks(axes.xaxis)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(0.0, 1.05)
    axes.set_xlabel("Frequency [Hz]")
    axes.set_ylabel("Share of the wave thrown back, $|R|$")
    write_note(
        axes,
        f"Modes: standing torsional waves of the string. Holds: the fall of friction "
        f"withstood [{slope.unit}].",
    )
    return handles


KINDS = (
    chart_kind(
        "drive-card",
        "how much of a torsional wave each drive throws back, and the slope of friction that it "
        "holds",
        DriveCard,
        _draw,
    ),
)
