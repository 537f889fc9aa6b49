"""The charts of a study, which are computed without a run: critical speeds, and
the reflection and tuning of drives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from nsdrill.data import Array
from nsdrill.figures.page import LABEL_OF_LINE, labelled, write
from nsdrill.figures.painters import Bar, Page, Paint
from nsdrill.figures.picture_kinds import STUDY, Chart, Kind, N
from nsdrill.figures.slices import make_logarithmic
from nsdrill.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    REFERENCE,
    SKY,
    VERMILLION,
    WINE,
    Dashes,
    Properties,
    Property,
    font_size,
    page_width,
)
from nsdrill.models.numbers import CriticalSpeeds, DriveCard, DriveTuning
from nsdrill.quantity import SHOWN, SYSTEMS, shown_scale, sign
from nsdrill.records import dataclass
from nsdrill.words.labels import Shown, heading, operating_point, quantity, written

SLOPE_UNIT = "N m s/rad"
TO_HERTZ = 1.0 / (2.0 * math.pi)
LONG_SPAN = 10.0  # m: from here on lengths are shown in m or ft
OPERATING_COLOUR = "#E4E4E4"  # the rotary speeds of the study


@dataclass(frozen=True)
class Drawn:
    """How a chart is drawn: its painter, what stands above its panel on a page, and its
    colour bars."""

    paint: Paint
    note: str = ""
    bars: Sequence[Bar] = ()


def chart_kind(name: str, words: str, numbers: type[N], draw: Callable[[Chart[N], str], Drawn]) -> Kind:
    """The kind of chart that shows ``numbers``; the painter of ``draw`` has a label for
    each entry of the legend."""

    def page(chart: Chart[N], units: str = "si") -> Page:
        drawn = draw(chart, units)

        def write_note(panels: Mapping[str, Axes]) -> None:
            for axes in panels.values() if drawn.note else ():
                axes.set_title(drawn.note, fontsize=font_size(7), loc="left", color=REFERENCE)

        return Page(
            {"panel": drawn.paint},
            heading(chart.attrs, operating_point(chart.point, units)),
            page_width(),
            4.4,
            entries=labelled,
            columns=3,
            bars=drawn.bars,
            complete=write_note,
        )

    def place(data: object) -> float | None:
        return 90 if isinstance(data, Chart) and isinstance(data.numbers, numbers) else None

    return Kind(name, words, of=STUDY, place=place, page=page)


def shown_quantity(words: str, unit_name: str, system: str) -> Shown:
    """How a quantity that is not a variable is shown: ``unit_name`` is its unit in the
    tables of :mod:`nsdrill.quantity`, ``system`` the system of units."""
    shown_unit = SHOWN[unit_name][SYSTEMS.index(system)]
    return Shown(words, sign(shown_unit), shown_scale(shown_unit, unit_name))


def axis_quantity(axis: str, x: Array, system: str) -> Shown:
    """How the axis of a chart is shown: long spans in m or ft instead of mm or in."""
    shown = quantity(axis, system)
    if shown.unit not in SHOWN["m"] or np.max(x) < LONG_SPAN:
        return shown
    unit = "m" if system == "si" else "ft"
    return Shown(shown.words, unit, shown_scale(unit, "m"))


CRITICAL_SPEEDS_NOTE = (
    "The equations of motion have one mode of each kind, near the first (axial: off the rock), and no others."
)


def _critical_speeds(chart: Chart[CriticalSpeeds], units: str) -> Drawn:
    return Drawn(partial(_draw_critical_speeds, chart, units), CRITICAL_SPEEDS_NOTE)


def _draw_critical_speeds(chart: Chart[CriticalSpeeds], units: str, axes: Axes) -> None:
    numbers = chart.numbers
    across, up = axis_quantity(numbers.axis, numbers.x, units), quantity("rotary_speed", units)
    x = numbers.x / across.scale
    axial_label = f"axial waves, {numbers.lobes} lobe{'s' * (numbers.lobes > 1)} a turn, bit"
    families: tuple[tuple[str, Array, str, Dashes, float], ...] = (
        ("lateral, of 1, 2, 3 half waves of the span", numbers.lateral, VERMILLION, "-", 0.95),
        ("torsional waves, once a turn", numbers.torsional, BLUE, (0, (5, 2)), 0.85),
        (f"{axial_label} off the rock", numbers.axial, GREEN, (0, (5, 1.5, 1, 1.5)), 0.65),
        (f"{axial_label} on the rock", numbers.axial_on_rock, BLACK, (0, (1, 1.4)), 0.45),
        ("axial vibration by regeneration: none above", numbers.cutting, BLACK, "-", 0.25),
    )
    low, high = (speed / up.scale for speed in chart.speeds)
    of_the_study: Properties = {"zorder": 0, "gid": "operating"}
    line = of_the_study | {"color": REFERENCE, "linewidth": 2.5, "alpha": 0.5}
    # the rotary speed lies along both axes: the string is on the diagonal
    if numbers.axis == "rotary_speed":
        axes.plot(x, x, label="the speed at which the string turns", **line)
    elif high > low:
        band: Properties = of_the_study | {"color": OPERATING_COLOUR, "linewidth": 0}
        axes.axhspan(low, high, label="rotary speeds of the study", **band)
    else:
        axes.axhline(low, label="rotary speed of the study", **line)
    for label, speeds_of_modes, colour, dashes, part_along in families:
        for number, values in enumerate(speeds_of_modes / up.scale, start=1):
            axes.plot(
                x, values, label=label if number == 1 else "_", color=colour, linestyle=dashes, linewidth=1.1, gid=label
            )
            finite = np.flatnonzero(np.isfinite(values))
            if finite.size and len(speeds_of_modes) > 1:
                # each family at a different place, as its curves cross those of others
                position = finite[round(part_along * (finite.size - 1))]
                box: Properties = {"boxstyle": "round,pad=0.12", "facecolor": "white", "edgecolor": "none"}
                style: Properties = {"color": colour, "ha": "center", "va": "center", "bbox": box, "zorder": 4}
                write(axes, str(number), (x[position], values[position]), size=6.5, **style)
    _set_log_height(axes, across.label, up.label)
    waves = [speeds for speeds in (numbers.torsional, numbers.axial, numbers.cutting) if len(speeds)]
    if waves:  # a span that is about to buckle has a speed of zero
        axes.set_ylim(bottom=0.6 * min(float(np.nanmin(speeds)) for speeds in waves) / up.scale)
    axes.set_xlim(x[0], x[-1])


def _set_log_height(axes: Axes, across: str, up: str) -> None:
    """A logarithmic y axis with a grid, and the labels of both axes."""
    axes.set(xlabel=across, ylabel=up)
    make_logarithmic(axes.yaxis)
    axes.grid(True, axis="y", color=OPERATING_COLOUR, linewidth=0.4, zorder=0)


# Colour and dashes of each drive; the dashes distinguish them in grey.
DRIVES: dict[str, tuple[str, Dashes]] = {
    "ideal": (BLACK, "-"),
    "stiff": (WINE, (0, (1, 1.2))),
    "soft_torque": (VERMILLION, "-"),
    "equal_damping": (BLUE, (0, (5, 2))),
    "z_torque": (GREEN, (0, (5, 1.5, 1, 1.5))),
    "pi": (ORANGE, (0, (3, 1, 1, 1, 1, 1))),
    "dc_motor": (SKY, (0, (7, 1.5))),
}
OWN_DRIVE: tuple[str, Dashes] = (WINE, "-")  # one of a script


def _drive_card(chart: Chart[DriveCard], units: str) -> Drawn:
    slope = shown_quantity("", SLOPE_UNIT, units)
    note = f"Modes: standing torsional waves of the string. Holds: steepest stable fall of friction [{slope.unit}]."
    return Drawn(partial(_draw_drive_card, chart, units), note)


def _draw_drive_card(chart: Chart[DriveCard], units: str, axes: Axes) -> None:
    numbers = chart.numbers
    slope = shown_quantity("", SLOPE_UNIT, units)
    x = numbers.frequency * TO_HERTZ
    for kind, held_slope in numbers.held.items():
        own = kind == numbers.own
        label = f"{'this study: ' * own}{written(kind)}, holds "
        label += f"{held_slope / slope.scale:.4g}"
        if kind not in numbers.reflected:
            axes.plot([], [], linestyle="none", label=f"{label} (no impedance)")
            continue
        colour, dashes = DRIVES.get(kind, OWN_DRIVE)
        width = 2.0 if own else 1.1
        axes.plot(x, numbers.reflected[kind], label=label, gid=kind, color=colour, linestyle=dashes, linewidth=width)
    for number, wave in enumerate(numbers.waves * TO_HERTZ, start=1):
        axes.axvline(wave, color=REFERENCE, linewidth=0.7, linestyle=(0, (1, 2)), zorder=0)
        write(axes, f"mode {number}", (wave, 0.0), (2, 3), 7, color=REFERENCE, rotation=90, va="bottom")
    make_logarithmic(axes.xaxis)
    axes.set(xlim=(x[0], x[-1]), ylim=(0.0, 1.05))
    axes.set(xlabel="Frequency [Hz]", ylabel="Reflected share of the wave, $|R|$")


def _drive_tuning(chart: Chart[DriveTuning], units: str) -> Drawn:
    numbers = chart.numbers
    slope = shown_quantity("Steepest stable fall of friction", SLOPE_UNIT, units)
    held_slope = numbers.held / slope.scale
    # the best drive lies between the points of the grid
    norm = Normalize(held_slope.min(), max(numbers.best[2] / slope.scale, held_slope.max()))
    bar = Bar("viridis", norm, slope.label, style={"fraction": 0.05, "pad": 0.01, "aspect": 30})
    return Drawn(partial(_draw_drive_tuning, chart.numbers, slope, bar), bars=[bar])


def _draw_drive_tuning(numbers: DriveTuning, slope: Shown, bar: Bar, axes: Axes) -> None:
    x, y, held_slope = numbers.matching, numbers.frequency * TO_HERTZ, numbers.held / slope.scale
    matching, frequency, best = numbers.best
    axes.pcolormesh(x, y, held_slope, cmap=bar.colours, norm=bar.norm, shading="gouraud", rasterized=True, gid="cells")
    lines = axes.contour(x, y, held_slope, levels=8, colors="white", linewidths=0.6)
    for label in axes.clabel(lines, fontsize=font_size(6), fmt="%g"):
        label.set_gid(f"held{LABEL_OF_LINE}")
    string: Properties = {"linewidth": 1.0, "linestyle": (0, (5, 2))}
    axes.axhline(numbers.lumped * TO_HERTZ, color="white", **string)
    axes.plot([], [], color=REFERENCE, label=f"frequency of the string, {numbers.lumped * TO_HERTZ:.2g} Hz", **string)
    for axis in (axes.xaxis, axes.yaxis):
        make_logarithmic(axis, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
    axes.set(xlim=(x[0], x[-1]), xlabel="Gain of the drive, in impedances of the pipe")
    axes.set(ylim=(y[0], y[-1]), ylabel="Frequency of the drive [Hz]")
    words = f"best: {matching:.3g} impedances, {frequency * TO_HERTZ:.3g} Hz, holds {best / slope.scale:.4g}"
    _mark_drive(axes, (matching, frequency), words, marker="*", markersize=11.0)
    if numbers.own:
        _mark_drive(axes, numbers.own, "the drive of the study", marker="o", markersize=6.0)


def _mark_drive(axes: Axes, drive: tuple[float, float], label: str, **marker: Property) -> None:
    """Mark a ``drive`` (matching, frequency [rad/s]); where it lies outside the limits of
    the panel, the legend says so."""
    x, y = drive[0], drive[1] * TO_HERTZ
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    white: Properties = {"color": "white", "markeredgecolor": BLACK, "markeredgewidth": 0.9, "linestyle": "none"}
    if left <= x <= right and bottom <= y <= top:
        axes.plot([x], [y], label=label, gid=label, clip_on=False, zorder=5, **white, **marker)
    else:
        axes.plot([], [], linestyle="none", label=f"{label} lies outside")


KINDS = (
    chart_kind(
        "critical-speeds",
        "lateral, torsional and axial critical speeds against depth, or along another axis",
        CriticalSpeeds,
        _critical_speeds,
    ),
    chart_kind(
        "drive-card",
        "the share of a torsional wave that each drive reflects, and the steepest stable fall of friction",
        DriveCard,
        _drive_card,
    ),
    chart_kind(
        "drive-tuning",
        "the steepest stable fall of friction with a soft-torque drive, over its gain and its frequency",
        DriveTuning,
        _drive_tuning,
    ),
)
