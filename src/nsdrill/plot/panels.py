"""Figures over one axis: a strip of responses on top, panels below that share the axis, a
column for each value of a second axis, if any, and one legend at the bottom."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.analysis.hysteresis import differences, spans
from nsdrill.analysis.outcome import FAILED_POINT
from nsdrill.data import Results
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import marker_entry, response_entries
from nsdrill.plot.registry import longest
from nsdrill.plot.slices import Line, edges, name_words, spaced
from nsdrill.plot.slices import line as line_along
from nsdrill.plot.style import (
    REFERENCE,
    RESPONSES,
    SHADE,
    cell_style,
    name_panel,
    new_figure,
    page_width,
    put_title,
)
from nsdrill.plot.verdicts import overlay_verdicts, verdict_handles

STRIP_ROW_HEIGHT = 0.13  # inches, a row for each procedure
TEXT_HEIGHT = 1.2  # inches of title, axis labels and legend
RESPONSE_COLOURS = ListedColormap([style.colour for style in RESPONSES], name="responses")
RESPONSE_NORM = BoundaryNorm(np.arange(-0.5, len(RESPONSES)), len(RESPONSES))


def lines_of(results: Results) -> list[Line]:
    """One line for each column: along the longest axis of numbers, at every value of
    the other axis if that is swept."""
    axes = sorted(results.swept, key=lambda name: name != longest(results)) or ["rotary_speed"]
    if len(axes) == 1:
        return [line_along(results, axes[0])]
    return [
        line_along(results, axes[0], **{axes[1]: number})
        for number in range(len(results.coords[axes[1]]))
    ]


def new_columns(
    results: Results, units: str, names: Sequence[str], height: float
) -> tuple[Figure, list[Line], list[list[Axes]]]:
    """The empty figure, its lines, and for each line the axes of its column: the strip
    and a panel for each of the variables ``names``, top to bottom, with titles and
    labels."""
    lines, panels = lines_of(results), len(names)
    strip_height = STRIP_ROW_HEIGHT * len(lines[0].procedures)
    figure = new_figure(page_width(), height + strip_height)
    ratios = [strip_height, *[(height - TEXT_HEIGHT) / panels] * panels]
    grid = figure.add_gridspec(panels + 1, len(lines), height_ratios=ratios)
    columns: list[list[Axes]] = []
    for number, line in enumerate(lines):
        column: list[Axes] = []
        for row in range(panels + 1):
            shared_y = columns[0][row] if columns and row else None
            axes = figure.add_subplot(
                grid[row, number], sharex=column[0] if column else None, sharey=shared_y
            )
            axes.tick_params(labelbottom=row == panels, labelleft=number == 0)
            name_panel(axes, ["strip", *names][row], ["", *names][row])
            if row and not number:
                axes.set_ylabel(quantity(names[row - 1], units).label)
            column.append(axes)
        columns.append(column)
        x = quantity(line.axis, units)
        if number == len(lines) // 2 or _fits(x.label, rcParams["axes.labelsize"], len(lines)):
            column[-1].set_xlabel(x.label)
        spaced(column[-1], line.x)
        name_words(column[-1], results, line.axis, units=units)
        column[-1].set_xlim(*(edges(line.x)[[0, -1]] / x.scale))
        draw_strip(column[0], line, x.scale, name_rows=number == 0)
        title = column_title(line, units)
        column[0].set_title(
            title
            if _fits(title, rcParams["axes.titlesize"], len(lines))
            else title.replace(": ", ":\n"),
            pad=3,
        )
    put_title(figure, heading(results.attrs, operating_point(fixed_values(results), units)))
    figure.align_ylabels(columns[0][1:])
    return figure, lines, columns


def _fits(text: str, size: float | str, columns: int) -> bool:
    """Whether ``text`` in a font of this ``size`` fits the width of one of ``columns``
    columns. A letter is taken as about half as wide as it is high."""
    points = FontProperties(size=size).get_size_in_points()
    return columns == 1 or 0.55 * points / 72 * len(text) <= (page_width() - 0.5) / columns


def column_title(line: Line, units: str) -> str:
    """The value of the second axis in this column; empty where there is only one
    column."""
    fixed = {
        axis: line.results.coords[axis][place]
        for axis, place in zip(line.results.axes, line.place[1:], strict=True)
        if axis != line.axis and axis in line.results.swept and isinstance(place, int)
    }
    return ", ".join(
        f"{quantity(axis, units).words}: {quantity(axis, units).value(value)}"
        for axis, value in fixed.items()
    )


def draw_strip(axes: Axes, line: Line, scale: float, *, name_rows: bool) -> None:
    """The response of every point as coloured cells, a row for each procedure; a cross
    where the run failed, and dots or hatching where the checks of a point disagree."""
    outcomes, x = line.outcome, line.x / scale
    rows = np.arange(len(line.procedures))
    mesh = axes.pcolormesh(
        edges(line.x) / scale,
        np.arange(len(rows) + 1) - 0.5,
        np.ma.masked_less(outcomes, 0),
        cmap=RESPONSE_COLOURS,
        norm=RESPONSE_NORM,
        **cell_style(outcomes.size),
    )
    mesh.set_gid("strip")
    if (verdicts := line.verdicts) is not None:
        cell_size = 72 * min(STRIP_ROW_HEIGHT, page_width() / len(x))
        overlay_verdicts(
            axes, edges(line.x) / scale, np.arange(len(rows) + 1) - 0.5, verdicts, cell_size
        )
    row, point = np.nonzero(outcomes == FAILED_POINT)
    if row.size:
        axes.plot(
            x[point], row, "kx", markersize=3.5, markeredgewidth=0.8, linestyle="none", gid="failed"
        )
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(rows, line.procedures if name_rows else [""] * len(rows))
    axes.tick_params(length=0, labelbottom=False)
    axes.grid(visible=False)  # a grid of the user's style would look like borders of cells
    for spine in axes.spines.values():
        spine.set_visible(False)


def shade_hysteresis(axes: Axes, line: Line, scale: float) -> int:
    """Shade where up and down differ in response, cell by cell; returns the number of
    shaded intervals."""
    shaded, borders = spans(differences(line.procedures, line.outcome)), edges(line.x) / scale
    for first, last in shaded:
        axes.axvspan(
            borders[first],
            borders[last + 1],
            facecolor=SHADE,
            edgecolor="none",
            linewidth=0,
            zorder=0,
            gid="hysteresis",
        )
    return len(shaded)


def is_open(procedure: str, procedures: Sequence[str]) -> bool:
    """Whether the markers of a procedure are open. Those of the way down are, so that
    those of the way up show through; not if there is no way up."""
    return procedure == "down" and len(procedures) > 1


def outcome_handles(lines: Sequence[Line], *, markers: bool) -> list[Artist]:
    """Legend entries for the responses that occur, and for failed and doubtful points,
    with their numbers."""
    outcomes = np.concatenate([line.outcome.ravel() for line in lines])
    handles: list[Artist] = []
    present = [code for code in range(len(RESPONSES)) if (outcomes == code).any()]
    if markers:
        handles += response_entries(present)
    else:
        handles += [
            Patch(facecolor=RESPONSES[code].colour, label=RESPONSES[code].name) for code in present
        ]
    failed = int((outcomes == FAILED_POINT).sum())
    if failed:
        handles.append(
            marker_entry(f"failed ({failed} of {outcomes.size})", "x", "k", size=4, edge=1.0)
        )
    verdicts = [line.verdicts.ravel() for line in lines if line.verdicts is not None]
    return handles + (verdict_handles(np.concatenate(verdicts)) if verdicts else [])


# the wall is drawn where the motion reaches this part of the gap
WALL_VISIBLE_FROM = 0.4


def marker_size(points: int, axes: Axes) -> float:
    """The diameter of markers [points]: neighbours on the axis just touch, within the
    limits of what can be printed and distinguished."""
    subplot_spec = axes.get_subplotspec()
    columns = subplot_spec.get_gridspec().ncols if subplot_spec else 1
    spacing = 72 * (page_width() - 0.7) / columns / max(points, 1)
    return float(np.clip(spacing, 1.7, 3.2))


def draw_set_speed(lines: list[Line], panels: list[Axes], units: str) -> list[Artist]:
    """The set speed of the drive as a line: the speed of the bit in steady drilling."""
    y = quantity("rotary_speed", units)
    style: dict[str, Any] = {"color": REFERENCE, "linewidth": 0.7, "dashes": (4, 2), "zorder": 1.5}
    for line, axes in zip(lines, panels, strict=True):
        if line.axis == "rotary_speed" and len(line.x) > 1:
            axes.plot(line.x / y.scale, line.x / y.scale, gid="rotary speed", **style)
        else:
            place = line.place[3] if isinstance(line.place[3], int) else 0
            axes.axhline(
                float(line.results.coords["rotary_speed"][place]) / y.scale,
                gid="rotary speed",
                **style,
            )
    return [Line2D([], [], label="rotary speed", **style)]


def draw_wall(results: Results, panels: list[Axes], units: str) -> list[Artist]:
    """The wall of the hole as a line, where the file has its distance; an entry of the
    legend alone where the motion stays far from it."""
    gap = results.attrs.get("gap")
    if gap is None:
        return []
    radius = quantity("radius_peaks", units)
    height = float(gap) / radius.scale
    if panels[0].get_ylim()[1] < WALL_VISIBLE_FROM * height:
        return [
            Line2D(
                [], [], linestyle="none", label=f"wall at {height:.4g} {radius.unit}, out of sight"
            )
        ]
    for axes in panels:
        axes.axhline(height, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
    return [Line2D([], [], color=REFERENCE, linewidth=0.9, label="wall of the hole")]
