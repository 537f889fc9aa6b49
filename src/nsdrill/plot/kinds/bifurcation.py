"""The bifurcation diagram: every recorded peak of the axial, torsional and lateral
motion along one axis.

Colour and shape of a marker say which critical responses its point shows, filled or
open whether the state was carried up or down. A point without peaks is at rest and is
drawn as a dash at its constant value.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from nsdrill.data import Array, Results
from nsdrill.models.registry import drawn_in
from nsdrill.plot.columns import (
    TEXT_HEIGHT,
    is_open,
    new_columns,
    outcome_handles,
    shade_hysteresis,
)
from nsdrill.plot.decimation import one_per_pixel
from nsdrill.plot.labels import Shown, quantity
from nsdrill.plot.legend import direction_entries, legend_below, marker_entry
from nsdrill.plot.references import draw_set_speed, draw_wall, marker_size
from nsdrill.plot.registry import LINE, Kind, fits_columns, longest, needs_one_axis
from nsdrill.plot.slices import Line
from nsdrill.plot.style import MANY_MARKERS, RESPONSES, SHADE, SHADE_EDGE

PIXELS = (1050, 300)  # of a panel: half those in print, as a marker covers several
MISSED = 2.0  # times the highest of the last peaks: the greatest value is drawn as well
HEIGHT = 6.3  # inches, of three panels and the words


def draw(results: Results, units: str = "si") -> Figure:
    panels = drawn_in(results.attrs).panels
    figure, lines, columns = new_columns(
        results,
        units,
        [panel.peaks for panel in panels],
        TEXT_HEIGHT + (HEIGHT - TEXT_HEIGHT) * len(panels) / 3,
    )
    handles = outcome_handles(lines, markers=True)
    shaded_spans = steady_points = 0
    markers = sum(
        int(np.isfinite(results[peaks]).sum()) for peaks in (panel.peaks for panel in panels)
    )
    for line, column in zip(lines, columns, strict=True):
        x = quantity(line.axis, units)
        for axes, panel in zip(column[1:], panels, strict=True):
            shaded_spans += shade_hysteresis(axes, line, x.scale)
            y = quantity(panel.peaks, units)
            steady_points += draw_peaks(
                axes, line, panel.peaks, panel.greatest, x, y, markers > MANY_MARKERS
            )
    rows = {panel.mode: [column[1 + row] for column in columns] for row, panel in enumerate(panels)}
    speed = draw_set_speed(lines, rows["torsional"], units) if "torsional" in rows else []
    wall = draw_wall(results, rows["lateral"], units) if "lateral" in rows else []
    handles += direction_entries(lines[0].procedures)
    if shaded_spans:
        handles.append(
            Patch(facecolor=SHADE, edgecolor=SHADE_EDGE, linewidth=0.5, label="up and down differ")
        )
    if steady_points:
        handles.append(marker_entry("no peaks: constant value", "_", size=5, edge=1.0))
    legend_below(figure, [*handles, *speed, *wall], 4)
    return figure


def draw_peaks(
    axes: Axes, line: Line, peaks: str, constant: str, x: Shown, y: Shown, rasterise: bool
) -> int:
    """Draw one panel, an artist for each response and procedure; returns the number of
    points drawn as a constant value."""
    outcomes, values, constants = line.outcome, line[peaks] / y.scale, line[constant] / y.scale
    x_values = line.x / x.scale
    size = marker_size(len(x_values), axes)
    steady_points = 0
    # By response first, so that grey lies below and the rarer combinations on top; the
    # open markers after the filled.
    for code, style in enumerate(RESPONSES):
        for row, procedure in enumerate(line.procedures):
            selected = outcomes[row] == code
            if not selected.any():
                continue
            hollow = is_open(procedure, line.procedures)
            peak_y = with_greatest(values[row, selected], constants[row, selected])
            finite = np.isfinite(peak_y)
            peak_x = np.broadcast_to(x_values[selected][:, None], peak_y.shape)[finite]
            if peak_x.size:
                kept = one_per_pixel(peak_x, peak_y[finite], PIXELS)
                axes.plot(
                    peak_x[kept],
                    peak_y[finite][kept],
                    linestyle="none",
                    marker=style.marker,
                    color=style.colour,
                    markersize=size * RELATIVE_SIZE.get(style.marker, 1.0),
                    markerfacecolor="none" if hollow else style.colour,
                    markeredgewidth=0.4 if hollow else 0.0,
                    rasterized=rasterise,
                    zorder=2 + 0.01 * code,
                    gid=f"{peaks}:{procedure}:{code}",
                )
            is_steady = ~finite.any(axis=1) & np.isfinite(constants[row, selected])
            if is_steady.any():
                axes.plot(
                    x_values[selected][is_steady],
                    constants[row, selected][is_steady],
                    linestyle="none",
                    marker="_",
                    color=style.colour,
                    markersize=size * 1.6,
                    markeredgewidth=0.9,
                    zorder=2 + 0.01 * code,
                    gid=f"{constant}:{procedure}:{code}",
                )
                steady_points += int(is_steady.sum())
    return steady_points


def with_greatest(peaks: Array, greatest: Array) -> Array:
    """The ``peaks`` [point, peak] with the greatest value of each point, NaN where they
    have it nearly already: the last peaks of a bit that sticks may all be ripples on
    its rest, and leave out the slip."""
    highest = np.max(peaks, axis=1, initial=-np.inf, where=np.isfinite(peaks))
    missed = np.isfinite(highest) & (greatest > MISSED * np.maximum(highest, 0.0))
    return np.column_stack((peaks, np.where(missed, greatest, np.nan)))


# Factors that make markers of different shapes look equally large.
RELATIVE_SIZE = {
    "o": 1.0,
    "^": 1.15,
    "s": 0.9,
    "p": 1.15,
    "D": 0.85,
    "P": 1.15,
    "X": 1.15,
    "*": 1.5,
}


def _place(data: Any) -> float | None:
    return 30 if fits_columns(data) and drawn_in(data.attrs).peaks[0] in data.variables else None


def _advice(data: Any) -> str:
    if isinstance(data, Results) and drawn_in(data.attrs).peaks[0] not in data.variables:
        return "no peaks were recorded: run with record.peaks"
    return needs_one_axis(data)


KINDS = (
    Kind(
        "bifurcation",
        "peaks of the three motions along one axis, coloured by response, hysteresis shaded",
        of=LINE,
        place=_place,
        draw=draw,
        uses=lambda model: (*model.drawn.peaks, *(panel.greatest for panel in model.drawn.panels)),
        across=longest,
        advice=_advice,
    ),
)
