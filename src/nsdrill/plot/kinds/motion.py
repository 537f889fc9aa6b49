"""The kind of motion along one axis: a strip of kinds, and below it the Lyapunov
exponent, the 0-1 test and the period, as far as the file has values of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from nsdrill.data import Array, Results
from nsdrill.plot.columns import is_open, lines_of, new_columns, outcome_handles
from nsdrill.plot.labels import Shown, quantity
from nsdrill.plot.legend import direction_entries, legend_below
from nsdrill.plot.maps import draw_categories_map, lies_across
from nsdrill.plot.registry import RETURNS, Kind, fits_columns, is_sweep, longest, needs_returns
from nsdrill.plot.slices import Line, edges, robust_limits
from nsdrill.plot.style import DIRECTION_COLOURS, MOTIONS, REFERENCE, cell_style
from nsdrill.variables import OK, PERIODIC

COLOURS = ListedColormap([style.colour for style in MOTIONS], name="motions")
LABELS = {
    "lyapunov_exponent": "Lyapunov\nexponent [1/s]",
    "zero_one": "0-1 test $K$",
    "period": "Period\n[returns]",
}
NORM = BoundaryNorm(np.arange(-0.5, len(MOTIONS)), len(MOTIONS))


def draw(results: Results, units: str = "si") -> Figure:
    return (
        _draw_lines(results, units)
        if fits_columns(results)
        else draw_categories_map(results, "motion", units)
    )


def _draw_lines(results: Results, units: str) -> Figure:
    names = [
        name
        for name in LABELS
        if any(np.isfinite(_values_to_draw(line, name)).any() for line in lines_of(results))
    ]
    figure, lines, columns = new_columns(results, units, ["motion", *names], 2.0 + 1.3 * len(names))
    present: set[int] = set()
    for line, column in zip(lines, columns, strict=True):
        x = quantity(line.axis, units)
        present |= _draw_kinds(column[1], line, x, with_names=column is columns[0])
        for axes, name in zip(column[2:], names, strict=True):
            _draw_values(axes, line, name, x)
    for axes, name in zip(columns[0][2:], names, strict=True):
        axes.set_ylabel(LABELS[name])
    if "lyapunov_exponent" in names:
        bar_ends = [
            _values_to_draw(line, "lyapunov_exponent") + sign * _errors(line)
            for line in lines
            for sign in (-1, 0, 1)
        ]
        low, high = robust_limits(np.concatenate([values.ravel() for values in bar_ends]))
        margin = 0.08 * (high - low)
        columns[0][2].set_ylim(min(low, 0.0) - margin, max(high, 0.0) + margin)
    kinds = [
        Patch(facecolor=style.colour, label=style.name)
        for code, style in enumerate(MOTIONS)
        if code in present
    ]
    directions = direction_entries(lines[0].procedures) if names else []
    legend_below(figure, [*kinds, *directions, *outcome_handles(lines, markers=False)], 4)
    return figure


def _draw_kinds(axes: Axes, line: Line, x: Shown, *, with_names: bool) -> set[int]:
    """Draw the kinds as coloured cells, a row for each procedure; returns the kinds that
    occur."""
    kinds = np.ma.masked_where(line["status"] != OK, line["motion"].astype(int))
    rows = np.arange(len(line.procedures))
    axes.pcolormesh(
        edges(line.x) / x.scale,
        np.arange(len(rows) + 1) - 0.5,
        kinds,
        cmap=COLOURS,
        norm=NORM,
        gid="motions",
        **cell_style(kinds.size),
    )
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(rows, line.procedures if with_names else [""] * len(rows))
    if with_names:
        axes.set_ylabel("Motion")
    return set(kinds.compressed().tolist())


def _values_to_draw(line: Line, name: str) -> Array:
    """The values to draw [procedure, point], NaN where there are none: periods of
    periodic motions only."""
    if name not in line.results.variables:
        return np.empty(0)
    shown = line["status"] == OK
    if name == "period":
        shown = shown & (line["motion"] == PERIODIC)
    return np.where(shown, line[name], np.nan)


def _errors(line: Line) -> Array:
    """Half the length of the error bars [procedure, point]: two standard errors."""
    return 2 * line["lyapunov_error"]


def _draw_values(axes: Axes, line: Line, name: str, x: Shown) -> None:
    for row, (procedure, values) in enumerate(
        zip(line.procedures, _values_to_draw(line, name), strict=True)
    ):
        hollow = is_open(procedure, line.procedures)
        colour = DIRECTION_COLOURS.get(procedure, REFERENCE)
        errors = _errors(line)[row] if name == "lyapunov_exponent" else None
        axes.errorbar(
            line.x / x.scale,
            values,
            yerr=errors,
            linestyle="none",
            marker="o",
            color=colour,
            markersize=2.4,
            markerfacecolor="white" if hollow else colour,
            markeredgewidth=0.5,
            elinewidth=0.4,
        )
    if name == "lyapunov_exponent":
        axes.axhline(0.0, color=REFERENCE, linewidth=0.5, zorder=1)
    elif name == "zero_one":
        axes.set_ylim(-0.15, 1.1)
    else:
        axes.set_ylim(0, None)


def _place(data: Any) -> float | None:
    if not is_sweep(data) or "motion" not in data.variables:
        return None
    return 33 if fits_columns(data) else 42


KINDS = (
    Kind(
        "motion",
        "the kind of motion: along one axis with Lyapunov exponent, 0-1 test and period, or over "
        "two axes",
        of=RETURNS,
        place=_place,
        draw=draw,
        uses=lambda model: ("motion", "period", "zero_one", "lyapunov_exponent", "lyapunov_error"),
        across=lambda data: longest(data) if fits_columns(data) else lies_across(data),
        advice=needs_returns,
    ),
)
