"""The charts of a study, which are computed without a run: critical speeds, buckling loads,
and the reflection and tuning of drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MultipleLocator, NullFormatter, StrMethodFormatter

from nsdrill.models.numbers import (
    FULL_HELIX,
    HELIX,
    BucklingLoads,
    CriticalSpeeds,
    DriveCard,
    DriveTuning,
)
from nsdrill.plot.labels import Shown, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.registry import STUDY, Kind
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
    new_figure,
    page_width,
    put_title,
    target,
)
from nsdrill.quantity import SHOWN, SYSTEMS, shown_scale, sign

Numbers = CriticalSpeeds | BucklingLoads | DriveCard | DriveTuning

SLOPE_UNIT = "N m s/rad"
TO_HERTZ = 1.0 / (2.0 * math.pi)
LONG_SPAN = 10.0  # m: from here on lengths are shown in m or ft
OPERATING_COLOUR = "#E4E4E4"  # the rotary speeds of the study


@dataclass(frozen=True)
class Chart:
    """The numbers of a chart and the contents of its title: ``attrs`` are the title and
    the study, ``point`` the operating values that the chart holds fixed; ``speeds`` are
    the least and the greatest rotary speed [rad/s] of the study."""

    numbers: Numbers
    attrs: Mapping[str, Any]
    point: Mapping[str, float]
    speeds: tuple[float, float]


def chart_kind(
    name: str, words: str, numbers: type, panel: Callable[[Figure, Axes, Chart, str], list[Artist]]
) -> Kind:
    """The kind of chart that shows ``numbers``; ``panel`` draws them and returns the
    entries of the legend."""

    def draw(chart: Chart, units: str = "si") -> Figure:
        figure = new_figure(page_width(), 4.4)
        axes = figure.add_subplot(figure.add_gridspec(1, 1)[0, 0])
        handles = panel(figure, axes, chart, units)
        put_title(figure, heading(chart.attrs, operating_point(chart.point, units)))
        legend_below(figure, handles, 3)
        return figure

    def place(data: Any) -> float | None:
        return 90 if isinstance(data, Chart) and isinstance(data.numbers, numbers) else None

    return Kind(name, words, of=STUDY, place=place, draw=draw)


def shown_quantity(words: str, unit_name: str, system: str) -> Shown:
    """How a quantity that is not a variable is shown: ``unit_name`` is its unit in the
    tables of :mod:`nsdrill.quantity`, ``system`` the system of units."""
    shown_unit = SHOWN[unit_name][SYSTEMS.index(system)]
    return Shown(words, sign(shown_unit), shown_scale(shown_unit, unit_name))


def set_log_ticks(axis: Any, subs: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def axis_quantity(axis: str, x: np.ndarray, system: str) -> Shown:
    """How the axis of a chart is shown: long spans in m or ft instead of mm or in."""
    if axis == "inclination":
        return Shown("Inclination of the hole", "°", math.pi / 180)
    shown = quantity(axis, system)
    if shown.unit not in SHOWN["m"] or np.max(x) < LONG_SPAN:
        return shown
    unit = "m" if system == "si" else "ft"
    return Shown(shown.words, unit, shown_scale(unit, "m"))


def write_note(axes: Axes, text: str) -> None:
    """Write a note above the panel. Axes of the caller keep their own title there."""
    if target.get() is not None:
        return
    axes.set_title(text, fontsize=font_size(7), loc="left", color=REFERENCE)


def _draw_critical_speeds(figure: Figure, axes: Axes, chart: Chart, units: str) -> list[Artist]:
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


def _draw_buckling(figure: Figure, axes: Axes, chart: Chart, units: str) -> list[Artist]:
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


def _draw_drive_card(figure: Figure, axes: Axes, chart: Chart, units: str) -> list[Artist]:
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


def _draw_drive_tuning(figure: Figure, axes: Axes, chart: Chart, units: str) -> list[Artist]:
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
        "critical-speeds",
        "lateral, torsional and axial critical speeds against depth, or along another axis",
        CriticalSpeeds,
        _draw_critical_speeds,
    ),
    chart_kind(
        "buckling",
        "loads at which collars and pipe buckle against the inclination of the hole, or along an "
        "axis",
        BucklingLoads,
        _draw_buckling,
    ),
    chart_kind(
        "drive-card",
        "how much of a torsional wave each drive throws back, and the slope of friction that it "
        "holds",
        DriveCard,
        _draw_drive_card,
    ),
    chart_kind(
        "drive-tuning",
        "the slope of friction that a soft-torque drive holds, over its gain and its frequency",
        DriveTuning,
        _draw_drive_tuning,
    ),
)
