"""Figures over one axis: a strip of responses on top, panels below that share the axis,
a column for each value of a second axis if there is one, one legend below all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Patch

from nsdrill.analysis.hysteresis import differences, spans
from nsdrill.analysis.outcome import FAILED_POINT
from nsdrill.data import Results
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import marker_entry, response_entries
from nsdrill.plot.registry import longest
from nsdrill.plot.slices import Line, edges, line, name_words, spaced
from nsdrill.plot.style import RESPONSES, SHADE, new_figure, page_width, put_title, seamless
from nsdrill.plot.verdicts import overlay_verdicts, verdict_handles

ROW_OF_STRIP = 0.13  # inches for each procedure
WORDS = 1.2  # inches that title, axis labels and legend take
RESPONSE_COLOURS = ListedColormap([style.colour for style in RESPONSES], name="responses")
RESPONSE_NORM = BoundaryNorm(np.arange(-0.5, len(RESPONSES)), len(RESPONSES))


def lines_of(results: Results) -> list[Line]:
    """One line for each column: along the longest axis of numbers, at every value of
    the other one if that is swept."""
    axes = sorted(results.swept, key=lambda name: name != longest(results)) or ["rotary_speed"]
    if len(axes) == 1:
        return [line(results, axes[0])]
    return [
        line(results, axes[0], **{axes[1]: number})
        for number in range(len(results.coords[axes[1]]))
    ]


def frame(
    results: Results, units: str, panels: int, height: float
) -> tuple[Figure, list[Line], list[list[Axes]]]:
    """The empty figure: its lines, and for each the strip and the panels (top to
    bottom), with titles and x labels."""
    lines = lines_of(results)
    strip_height = ROW_OF_STRIP * len(lines[0].procedures)
    figure = new_figure(page_width(), height + strip_height)
    ratios = [strip_height, *[(height - WORDS) / panels] * panels]
    grid = figure.add_gridspec(panels + 1, len(lines), height_ratios=ratios)
    columns: list[list[Axes]] = []
    for number, one in enumerate(lines):
        column: list[Axes] = []
        for row in range(panels + 1):
            left = columns[0][row] if columns and row else None
            axes = figure.add_subplot(
                grid[row, number], sharex=column[0] if column else None, sharey=left
            )
            axes.tick_params(labelbottom=row == panels, labelleft=number == 0)
            column.append(axes)
        columns.append(column)
        x = quantity(one.axis, units)
        if number == len(lines) // 2 or _fits(x.label, rcParams["axes.labelsize"], len(lines)):
            column[-1].set_xlabel(x.label)
        spaced(column[-1], one.x)
        name_words(column[-1], results, one.axis, units=units)
        column[-1].set_xlim(*(edges(one.x)[[0, -1]] / x.scale))
        draw_strip(column[0], one, x.scale, name_rows=number == 0)
        title = column_title(one, units)
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
    """Whether ``text`` in type of this size is no wider than one of so many columns, a
    letter being half as wide as it is high."""
    points = FontProperties(size=size).get_size_in_points()
    return columns == 1 or 0.55 * points / 72 * len(text) <= (page_width() - 0.5) / columns


def column_title(one: Line, units: str) -> str:
    """The value of the axis that sets this column apart; nothing where there is one
    column."""
    held = {
        axis: one.results.coords[axis][place]
        for axis, place in zip(one.results.axes, one.place[1:], strict=True)
        if axis != one.axis and axis in one.results.swept and isinstance(place, int)
    }
    return ", ".join(
        f"{quantity(axis, units).words}: {quantity(axis, units).value(v)}"
        for axis, v in held.items()
    )


def draw_strip(axes: Axes, one: Line, scale: float, *, name_rows: bool) -> None:
    """The response of every point as coloured cells, a row for each procedure; a cross
    where the run failed, and marks where checks of a point disagree."""
    outcomes, x = one.outcome, one.x / scale
    rows = np.arange(len(one.procedures))
    mesh = axes.pcolormesh(
        edges(one.x) / scale,
        np.arange(len(rows) + 1) - 0.5,
        np.ma.masked_less(outcomes, 0),
        cmap=RESPONSE_COLOURS,
        norm=RESPONSE_NORM,
        **seamless(outcomes.size),
    )
    mesh.set_gid("strip")
    if (verdicts := one.verdicts) is not None:
        cell = 72 * min(ROW_OF_STRIP, page_width() / len(x))
        overlay_verdicts(axes, edges(one.x) / scale, np.arange(len(rows) + 1) - 0.5, verdicts, cell)
    row, point = np.nonzero(outcomes == FAILED_POINT)
    if row.size:
        axes.plot(
            x[point], row, "kx", markersize=3.5, markeredgewidth=0.8, linestyle="none", gid="failed"
        )
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(rows, one.procedures if name_rows else [""] * len(rows))
    axes.tick_params(length=0, labelbottom=False)
    axes.grid(visible=False)  # of a style: lines through the cells would be read as borders
    for spine in axes.spines.values():
        spine.set_visible(False)


def shade_hysteresis(axes: Axes, one: Line, scale: float) -> int:
    """Shade where up and down differ in response, cell by cell; the number of
    stretches."""
    shaded, borders = spans(differences(one.procedures, one.outcome)), edges(one.x) / scale
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
    """Markers of the way down are open, so that those of the way up show through;
    filled if there is no way up."""
    return procedure == "down" and len(procedures) > 1


def outcome_handles(lines: Sequence[Line], *, markers: bool) -> list[Artist]:
    """Legend entries for the responses that occur, and for failed and doubtful points
    with their number."""
    outcomes = np.concatenate([one.outcome.ravel() for one in lines])
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
    verdicts = [one.verdicts.ravel() for one in lines if one.verdicts is not None]
    return handles + (verdict_handles(np.concatenate(verdicts)) if verdicts else [])
