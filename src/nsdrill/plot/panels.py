"""Figures over one axis: a strip of responses on top, panels below that share the axis, a
column for each value of a second axis, if any, and one legend at the bottom."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
from nsdrill.data import Array, Results
from nsdrill.plot.decimation import one_per_pixel
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import marker_entry, response_entries
from nsdrill.plot.registry import longest
from nsdrill.plot.slices import Line, edges, name_words, spaced
from nsdrill.plot.slices import line as line_along
from nsdrill.plot.style import (
    REFERENCE,
    RESPONSES,
    SHADE,
    ResponseStyle,
    cell_style,
    name_panel,
    new_figure,
    page_width,
    put_title,
)
from nsdrill.plot.verdicts import overlay_verdicts, verdict_handles

STRIP_ROW_HEIGHT = 0.13  # inches, a row for each procedure
TEXT_HEIGHT = 1.2  # inches of title, axis labels and legend


def lines_of(results: Results) -> list[Line]:
    """One line for each column: along the longest axis of numbers, at every value of
    the other axis if that is swept."""
    axes = sorted(results.swept, key=lambda name: name != longest(results)) or ["rotary_speed"]
    if len(axes) == 1:
        return [line_along(results, axes[0])]
    return [line_along(results, axes[0], **{axes[1]: number}) for number in range(len(results.coords[axes[1]]))]


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
            axes = figure.add_subplot(grid[row, number], sharex=column[0] if column else None, sharey=shared_y)
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
            title if _fits(title, rcParams["axes.titlesize"], len(lines)) else title.replace(": ", ":\n"), pad=3
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
        f"{quantity(axis, units).words}: {quantity(axis, units).value(value)}" for axis, value in fixed.items()
    )


def draw_strip(axes: Axes, line: Line, scale: float, *, name_rows: bool) -> None:
    """The response of every point as coloured cells, a row for each procedure; a cross
    where the run failed, and dots or hatching where the checks of a point disagree."""
    outcomes = line.outcome
    codes = np.ma.masked_less(outcomes, 0)
    rows = draw_cells(axes, line, scale, codes, RESPONSES, "strip", name_rows=name_rows)
    if (verdicts := line.verdicts) is not None:
        cell_size = 72 * min(STRIP_ROW_HEIGHT, page_width() / len(line.x))
        overlay_verdicts(axes, edges(line.x) / scale, rows, verdicts, cell_size)
    row, point = np.nonzero(outcomes == FAILED_POINT)
    if row.size:
        cross: dict[str, Any] = {"markersize": 3.5, "markeredgewidth": 0.8, "linestyle": "none"}
        axes.plot(line.x[point] / scale, row, "kx", gid="failed", **cross)
    axes.tick_params(length=0, labelbottom=False)
    axes.grid(visible=False)  # a grid of the user's style would look like borders of cells
    for spine in axes.spines.values():
        spine.set_visible(False)


def draw_cells(
    axes: Axes, line: Line, scale: float, codes: Any, styles: Sequence[ResponseStyle], gid: str, *, name_rows: bool
) -> Array:
    """Cells [procedure, point] in the colours of the ``styles`` of their codes, a row for
    each procedure, the first on top; returns the edges of the rows."""
    borders = np.arange(len(line.procedures) + 1) - 0.5
    axes.pcolormesh(
        edges(line.x) / scale,
        borders,
        codes,
        cmap=ListedColormap([style.colour for style in styles], name=gid),
        norm=BoundaryNorm(np.arange(-0.5, len(styles)), len(styles)),
        gid=gid,
        **cell_style(codes.size),
    )
    axes.set_ylim(borders[-1], borders[0])
    axes.set_yticks(borders[1:] - 0.5, line.procedures if name_rows else [""] * len(codes))
    return borders


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
        handles += [Patch(facecolor=RESPONSES[code].colour, label=RESPONSES[code].name) for code in present]
    failed = int((outcomes == FAILED_POINT).sum())
    if failed:
        handles.append(marker_entry(f"failed ({failed} of {outcomes.size})", "x", "k", size=4, edge=1.0))
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


PIXELS = (1050, 300)  # of a panel: half those in print, as a marker covers several
# Factors that make markers of different shapes look equally large.
RELATIVE_SIZE = {"^": 1.15, "s": 0.9, "p": 1.15, "D": 0.85, "P": 1.15, "X": 1.15, "*": 1.5, "_": 1.6}


def draw_dots(
    axes: Axes,
    line: Line,
    name: str,
    looks: tuple[Array, Sequence[ResponseStyle]],
    values: Array,
    units: str,
    rasterise: bool = False,
    *,
    marker: str = "",
    scale: float = 1.0,
    edge: float = 0.4,
) -> set[int]:
    """Draw every finite one of the ``values`` [procedure, point, number] of a variable,
    an artist for each code of ``looks`` and procedure, and return the codes that occur:
    ``looks`` are the codes [procedure, point] and the style of each. All have the
    ``marker`` if given; those of the way down are open, with an ``edge`` [points]."""
    codes, styles = looks
    x, y = quantity(line.axis, units), quantity(name, units)
    across = np.broadcast_to((line.x / x.scale)[:, None], values.shape[1:])
    size, present = scale * marker_size(len(line.x), axes), set()
    # By code first, so that grey lies below and the rarer combinations on top; the open
    # markers after the filled.
    for code, style in enumerate(styles):
        for row, procedure in enumerate(line.procedures):
            shown = np.isfinite(values[row]) & (codes[row] == code)[:, None]
            if not shown.any():
                continue
            present.add(code)
            hollow, shape = is_open(procedure, line.procedures), marker or style.marker
            dots_x, dots_y = across[shown], values[row][shown] / y.scale
            kept = one_per_pixel(dots_x, dots_y, PIXELS)
            axes.plot(
                dots_x[kept],
                dots_y[kept],
                linestyle="none",
                marker=shape,
                color=style.colour,
                markersize=size * RELATIVE_SIZE.get(shape, 1.0),
                markerfacecolor="none" if hollow else style.colour,
                markeredgewidth=0.9 if shape == "_" else edge if hollow else 0.0,
                rasterized=rasterise,
                zorder=2 + 0.01 * code,
                gid=f"{name}:{procedure}:{code}",
            )
    return present


def draw_rotary_speed(lines: list[Line], panels: list[Axes], units: str) -> list[Artist]:
    """The rotary speed of the drive as a line: the speed of the bit in steady drilling."""
    y = quantity("rotary_speed", units)
    style: dict[str, Any] = {"color": REFERENCE, "linewidth": 0.7, "dashes": (4, 2), "zorder": 1.5}
    for line, axes in zip(lines, panels, strict=True):
        if line.axis == "rotary_speed" and len(line.x) > 1:
            axes.plot(line.x / y.scale, line.x / y.scale, gid="rotary speed", **style)
        else:
            place = line.place[3] if isinstance(line.place[3], int) else 0
            speed = float(line.results.coords["rotary_speed"][place]) / y.scale
            axes.axhline(speed, gid="rotary speed", **style)
    return [Line2D([], [], label="rotary speed", **style)]


def draw_wall(attrs: Mapping[str, Any], panels: list[Axes], units: str) -> list[Artist]:
    """The wall of the hole as a line, where the file with these ``attrs`` has its
    distance; an entry of the legend alone where the motion stays far from it."""
    gap = attrs.get("gap")
    if gap is None:
        return []
    radius = quantity("radius_peaks", units)
    height = float(gap) / radius.scale
    if panels[0].get_ylim()[1] < WALL_VISIBLE_FROM * height:
        return [Line2D([], [], linestyle="none", label=f"wall at {height:.4g} {radius.unit}, out of sight")]
    for axes in panels:
        axes.axhline(height, color=REFERENCE, linewidth=0.9, zorder=1.5, gid="wall")
    return [Line2D([], [], color=REFERENCE, linewidth=0.9, label="wall of the hole")]
