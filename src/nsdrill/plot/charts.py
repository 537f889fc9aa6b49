"""Charts that need no integration, drawn: critical speeds, buckling loads, drives and their tuning."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MultipleLocator, NullFormatter, StrMethodFormatter

from nsdrill.models.numbers import FULL_HELIX, HELIX, BucklingLoads, CriticalSpeeds, DriveCard, DriveTuning
from nsdrill.plot.columns import legend_below
from nsdrill.plot.labels import Shown, check_units, heading, operating_point, quantity
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    FULL_WIDTH,
    GREEN,
    ORANGE,
    REFERENCE,
    VERMILLION,
    WINE,
    house_style,
    new_figure,
    settle,
    target,
)
from nsdrill.quantity import SHOWN, SYSTEMS, shown_scale, sign

Chart = CriticalSpeeds | BucklingLoads | DriveCard | DriveTuning

SLOPE = "N m s/rad"
TO_HERTZ = 1.0 / (2.0 * math.pi)
LONG = 10.0  # m
OPERATING = "#E4E4E4"  # the rotary speeds of the study
# Each drive by its colour and its dashes, so that a grey printer keeps them apart.
DRIVES: dict[str, tuple[str, Any]] = {
    "ideal": (BLACK, "-"),
    "stiff": (WINE, (0, (1, 1.2))),
    "soft_torque": (VERMILLION, "-"),
    "equal_damping": (BLUE, (0, (5, 2))),
    "z_torque": (GREEN, (0, (5, 1.5, 1, 1.5))),
    "pi": (ORANGE, (0, (3, 1, 1, 1, 1, 1))),
}


def draw(
    chart: Chart, attrs: Mapping[str, Any], point: Mapping[str, float], units: str, speeds: tuple[float, float]
) -> Figure:
    """A chart as a figure, in ``units`` "si" or "field". ``attrs`` are the title and the study, ``point`` the operating
    values that the chart holds, ``speeds`` the least and the greatest rotary speed [rad/s] of the study."""
    check_units(units)
    with house_style():
        figure = new_figure(FULL_WIDTH, 4.4)
        axes = figure.add_subplot(figure.add_gridspec(1, 1)[0, 0])
        if isinstance(chart, CriticalSpeeds):
            handles = _critical_speeds(axes, chart, units, speeds)
        elif isinstance(chart, BucklingLoads):
            handles = _buckling(axes, chart, units)
        elif isinstance(chart, DriveCard):
            handles = _drive_card(axes, chart, units)
        else:
            handles = _drive_tuning(figure, axes, chart, units)
        figure.suptitle(heading(attrs, operating_point(point, units)), parse_math=False)
        legend_below(figure, handles, 3)
        settle(figure)
    return figure


def _shown(words: str, units: str, system: str) -> Shown:
    """How a quantity without a name of its own is shown."""
    unit = SHOWN[units][SYSTEMS.index(system)]
    return Shown(words, sign(unit), shown_scale(unit, units))


def _logarithmic(axis: Any, subs: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def _along(axis: str, x: np.ndarray, system: str) -> Shown:
    """How the axis of a chart is shown: long spans in m or ft, rather than mm or in."""
    if axis == "inclination":
        return Shown("Inclination of the hole", "°", math.pi / 180)
    found = quantity(axis, system)
    if found.unit not in SHOWN["m"] or np.max(x) < LONG:
        return found
    unit = "m" if system == "si" else "ft"
    return Shown(found.words, unit, shown_scale(unit, "m"))


def _remark(axes: Axes, text: str) -> None:
    """A line above the panel; axes of somebody else have a title of their own there."""
    if target.get() is not None:
        return
    axes.set_title(text, fontsize=7, loc="left", color=REFERENCE)


def _critical_speeds(axes: Axes, chart: CriticalSpeeds, units: str, speeds: tuple[float, float]) -> list[Artist]:
    across, up = _along(chart.axis, chart.x, units), quantity("rotary_speed", units)
    x = chart.x / across.scale
    over = f"axial waves, {chart.lobes} lobe{'s' * (chart.lobes > 1)} a turn, bit"
    families: tuple[tuple[str, np.ndarray, str, Any, float], ...] = (
        ("lateral, of 1, 2, 3 half waves of the span", chart.lateral, VERMILLION, "-", 0.95),
        ("torsional waves, once a turn", chart.torsional, BLUE, (0, (5, 2)), 0.85),
        (f"{over} off the rock", chart.axial, GREEN, (0, (5, 1.5, 1, 1.5)), 0.65),
        (f"{over} on the rock", chart.axial_on_rock, BLACK, (0, (1, 1.4)), 0.45),
    )
    handles: list[Artist] = []
    low, high = (speed / up.scale for speed in speeds)
    if high > low:
        axes.axhspan(low, high, color=OPERATING, linewidth=0, zorder=0, gid="operating")
        handles.append(Patch(color=OPERATING, label="rotary speeds of the study"))
    else:
        axes.axhline(low, color=REFERENCE, linewidth=2.5, alpha=0.5, zorder=0, gid="operating")
        handles.append(Line2D([], [], color=REFERENCE, linewidth=2.5, alpha=0.5, label="rotary speed of the study"))
    for words, modes, colour, dashes, place in families:
        if not len(modes):
            continue
        for number, values in enumerate(modes / up.scale, start=1):
            axes.plot(x, values, color=colour, linestyle=dashes, linewidth=1.1, gid=words)
            there = np.flatnonzero(np.isfinite(values))
            if there.size:
                at = there[round(place * (there.size - 1))]  # each kind at another place, as its modes cross others
                axes.annotate(
                    str(number), (x[at], values[at]), color=colour, fontsize=6.5, ha="center", va="center",
                    bbox={"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none"}, zorder=4,
                )  # fmt: skip
        handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=1.1, label=words))
    axes.set_yscale("log")
    _logarithmic(axes.yaxis)
    waves = [modes for modes in (chart.torsional, chart.axial) if len(modes)]
    if waves:  # a span that is about to buckle has a speed of zero
        axes.set_ylim(bottom=0.6 * min(float(modes.min()) for modes in waves) / up.scale)
    axes.set_xlim(x[0], x[-1])
    axes.grid(True, axis="y", color=OPERATING, linewidth=0.4, zorder=0)
    axes.set_xlabel(across.label)
    axes.set_ylabel(up.label)
    _remark(
        axes, "The equations of motion have one mode of each kind, near the first (axial: off the rock), and no others."
    )
    return handles


def _buckling(axes: Axes, chart: BucklingLoads, units: str) -> list[Artist]:
    force = _shown("Axial load", "N", units)
    across = _along(chart.axis, chart.x, units)
    x = chart.x / across.scale
    handles: list[Artist] = []
    tubes: tuple[tuple[str, np.ndarray, str, Any], ...] = (
        ("collars", chart.collar, VERMILLION, "-"),
        ("pipe", chart.pipe, BLUE, (0, (5, 1.5, 1, 1.5))),
    )
    for name, load, colour, dashes in tubes:
        shown = load / force.scale
        if not (shown > 0.0).any():
            continue  # it floats in the mud, or does not fit the hole
        axes.plot(x, shown, color=colour, linestyle=dashes, linewidth=1.3, gid=name)
        axes.fill_between(
            x, HELIX * shown, FULL_HELIX * shown, color=colour, alpha=0.25, linewidth=0, gid=f"{name} helix"
        )
        handles.append(
            Line2D([], [], color=colour, linestyle=dashes, linewidth=1.3, label=f"{name}: sinusoid on the low side")
        )
        handles.append(Patch(color=colour, alpha=0.25, linewidth=0, label=f"{name}: helix, from its onset to complete"))
    others: tuple[tuple[np.ndarray, Any, str], ...] = (
        (chart.euler, (0, (5, 2)), "span of the collars, pinned (Euler)"),
        (chart.vertical, (0, (1, 1.4)), "collars in a vertical hole, their own weight"),
        (chart.wob, "-", "weight on bit of the study"),
    )
    for load, dashes, words in others:
        shown = load / force.scale
        if np.isfinite(shown).any() and np.nanmax(shown) > 0.0:
            width = 2.5 if dashes == "-" else 1.0
            colour = REFERENCE if dashes == "-" else BLACK
            axes.plot(x, shown, color=colour, linestyle=dashes, linewidth=width, gid=words)
            handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=words))
    axes.set_yscale("log")
    _logarithmic(axes.yaxis)
    if chart.axis == "inclination":
        axes.set_xlim(0.0, 90.0)
        axes.xaxis.set_major_locator(MultipleLocator(15.0))
    else:
        axes.set_xlim(x[0], x[-1])
    axes.set_xlabel(across.label)
    axes.set_ylabel(force.label)
    axes.grid(True, axis="y", color=OPERATING, linewidth=0.4, zorder=0)
    if chart.inclination is not None:
        _remark(axes, f"In a hole inclined by {math.degrees(chart.inclination):.4g}°.")
    return handles


def _drive_card(axes: Axes, chart: DriveCard, units: str) -> list[Artist]:
    slope = _shown("", SLOPE, units)
    x = chart.frequency * TO_HERTZ
    handles: list[Artist] = []
    for kind, held in chart.held.items():
        words = f"{'this study: ' if kind == chart.own else ''}{kind.replace('_', ' ')}, holds {held / slope.scale:.4g}"
        if kind not in chart.reflected:
            handles.append(Line2D([], [], linestyle="none", label=f"{words} (no impedance)"))
            continue
        colour, dashes = DRIVES[kind]
        width = 2.0 if kind == chart.own else 1.1
        axes.plot(x, chart.reflected[kind], color=colour, linestyle=dashes, linewidth=width, gid=kind)
        handles.append(Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=words))
    for number, wave in enumerate(chart.waves * TO_HERTZ, start=1):
        axes.axvline(wave, color=REFERENCE, linewidth=0.7, linestyle=(0, (1, 2)), zorder=0)
        axes.annotate(
            f"mode {number}", (wave, 0.0), xytext=(2, 3), textcoords="offset points", fontsize=7, color=REFERENCE,
            rotation=90, va="bottom",
        )  # fmt: skip
    axes.set_xscale("log")
    _logarithmic(axes.xaxis)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(0.0, 1.05)
    axes.set_xlabel("Frequency [Hz]")
    axes.set_ylabel("Share of the wave thrown back, $|R|$")
    _remark(
        axes, f"Modes: standing torsional waves of the string. Holds: the fall of friction withstood [{slope.unit}]."
    )
    return handles


def _drive_tuning(figure: Figure, axes: Axes, chart: DriveTuning, units: str) -> list[Artist]:
    slope = _shown("Fall of friction that is held", SLOPE, units)
    x, y, held = chart.matching, chart.frequency * TO_HERTZ, chart.held / slope.scale
    mesh = axes.pcolormesh(x, y, held, cmap="viridis", shading="gouraud", rasterized=True, gid="cells")
    lines = axes.contour(x, y, held, levels=8, colors="white", linewidths=0.6)
    axes.clabel(lines, fontsize=6, fmt="%g")
    figure.colorbar(mesh, ax=axes, label=slope.label, fraction=0.05, pad=0.01, aspect=30)
    handles: list[Artist] = []
    axes.axhline(chart.lumped * TO_HERTZ, color="white", linewidth=1.0, linestyle=(0, (5, 2)))
    handles.append(
        Line2D([], [], color=REFERENCE, linewidth=1.0, linestyle=(0, (5, 2)), label="frequency of the string")
    )
    matching, frequency, best = chart.best
    marks: Sequence[tuple[tuple[float, float], str, float, str]] = (
        ((matching, frequency * TO_HERTZ), "*", 11.0,
         f"best: {matching:.3g} impedances, {frequency * TO_HERTZ:.3g} Hz, holds {best / slope.scale:.4g}"),
        *([((chart.own[0], chart.own[1] * TO_HERTZ), "o", 6.0, "the drive of the study")] if chart.own else []),
    )  # fmt: skip
    for place, marker, size, words in marks:
        style: dict[str, Any] = {"marker": marker, "markersize": size, "linestyle": "none", "color": "white",
                                 "markeredgecolor": BLACK, "markeredgewidth": 0.9, "label": words}  # fmt: skip
        if x[0] <= place[0] <= x[-1] and y[0] <= place[1] <= y[-1]:
            axes.plot(*np.atleast_1d(*place), **style, gid=words, clip_on=False, zorder=5)
            handles.append(Line2D([], [], **style))
        else:
            handles.append(Line2D([], [], linestyle="none", label=f"{words} lies outside"))
    for axis, scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
        scale("log")
        _logarithmic(axis, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(y[0], y[-1])
    axes.set_xlabel("Gain of the drive, in impedances of the pipe")
    axes.set_ylabel("Frequency of the drive [Hz]")
    return handles
