"""How much of a torsional wave each drive throws back, and the slope of friction that
it holds."""

from __future__ import annotations

from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.models.numbers import DriveCard
from nsdrill.plot.charts import SLOPE, TO_HERTZ, Chart, chart_kind, logarithmic, remark, shown
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    REFERENCE,
    SKY,
    VERMILLION,
    WINE,
    type_size,
)

# Each drive by its colour and its dashes, so that a grey printer keeps them apart.
DRIVES: dict[str, tuple[str, Any]] = {
    "ideal": (BLACK, "-"),
    "stiff": (WINE, (0, (1, 1.2))),
    "soft_torque": (VERMILLION, "-"),
    "equal_damping": (BLUE, (0, (5, 2))),
    "z_torque": (GREEN, (0, (5, 1.5, 1, 1.5))),
    "pi": (ORANGE, (0, (3, 1, 1, 1, 1, 1))),
    "dc_motor": (SKY, (0, (7, 1.5))),
}


def _draw(figure: Figure, axes: Axes, drawn: Chart, units: str) -> list[Artist]:
    chart: Any = drawn.numbers
    slope = shown("", SLOPE, units)
    x = chart.frequency * TO_HERTZ
    handles: list[Artist] = []
    for kind, held in chart.held.items():
        words = (
            f"{'this study: ' if kind == chart.own else ''}{kind.replace('_', ' ')}, holds "
            f"{held / slope.scale:.4g}"
        )
        if kind not in chart.reflected:
            handles.append(Line2D([], [], linestyle="none", label=f"{words} (no impedance)"))
            continue
        colour, dashes = DRIVES[kind]
        width = 2.0 if kind == chart.own else 1.1
        axes.plot(
            x, chart.reflected[kind], color=colour, linestyle=dashes, linewidth=width, gid=kind
        )
        handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=words))
    for number, wave in enumerate(chart.waves * TO_HERTZ, start=1):
        axes.axvline(wave, color=REFERENCE, linewidth=0.7, linestyle=(0, (1, 2)), zorder=0)
        axes.annotate(
            f"mode {number}",
            (wave, 0.0),
            xytext=(2, 3),
            textcoords="offset points",
            fontsize=type_size(7),
            color=REFERENCE,
            rotation=90,
            va="bottom",
        )
    axes.set_xscale("log")
    logarithmic(axes.xaxis)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(0.0, 1.05)
    axes.set_xlabel("Frequency [Hz]")
    axes.set_ylabel("Share of the wave thrown back, $|R|$")
    remark(
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
