"""What kind of motion there is along one axis: a strip of kinds, and below it the
Lyapunov exponent, the 0-1 test and the period, those of which there are values.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from nsdrill.data import Array, Results
from nsdrill.plot.columns import frame, is_open, lines_of, outcome_handles
from nsdrill.plot.labels import Shown, quantity
from nsdrill.plot.legend import direction_entries, legend_below
from nsdrill.plot.maps import draw_categories_map, lies_across
from nsdrill.plot.registry import RETURNS, Kind, fits_columns, is_sweep, longest, needs_returns
from nsdrill.plot.slices import Line, edges, robust_limits
from nsdrill.plot.style import DIRECTION_COLOURS, MOTIONS, REFERENCE, seamless
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
        if any(np.isfinite(_shown(one, name)).any() for one in lines_of(results))
    ]
    figure, lines, columns = frame(results, units, 1 + len(names), 2.0 + 1.3 * len(names))
    present: set[int] = set()
    for one, column in zip(lines, columns, strict=True):
        x = quantity(one.axis, units)
        present |= _draw_kinds(column[1], one, x, named=column is columns[0])
        for axes, name in zip(column[2:], names, strict=True):
            _draw_values(axes, one, name, x)
    for axes, name in zip(columns[0][2:], names, strict=True):
        axes.set_ylabel(LABELS[name])
    if "lyapunov_exponent" in names:
        ends = [
            _shown(one, "lyapunov_exponent") + sign * _errors(one)
            for one in lines
            for sign in (-1, 0, 1)
        ]
        low, high = robust_limits(np.concatenate([values.ravel() for values in ends]))
        room = 0.08 * (high - low)
        columns[0][2].set_ylim(min(low, 0.0) - room, max(high, 0.0) + room)
    kinds = [
        Patch(facecolor=style.colour, label=style.name)
        for code, style in enumerate(MOTIONS)
        if code in present
    ]
    carried = direction_entries(lines[0].procedures) if names else []
    legend_below(figure, [*kinds, *carried, *outcome_handles(lines, markers=False)], 4)
    return figure


def _draw_kinds(axes: Axes, one: Line, x: Shown, *, named: bool) -> set[int]:
    """The kinds as coloured cells, a row for each procedure."""
    kinds = np.ma.masked_where(one["status"] != OK, one["motion"].astype(int))
    rows = np.arange(len(one.procedures))
    axes.pcolormesh(
        edges(one.x) / x.scale,
        np.arange(len(rows) + 1) - 0.5,
        kinds,
        cmap=COLOURS,
        norm=NORM,
        gid="motions",
        **seamless(kinds.size),
    )
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_yticks(rows, one.procedures if named else [""] * len(rows))
    if named:
        axes.set_ylabel("Motion")
    return set(kinds.compressed().tolist())


def _shown(one: Line, name: str) -> Array:
    """The values to draw [procedure, point], NaN where there are none: periods of
    periodic motions only."""
    if name not in one.results.variables:
        return np.empty(0)
    shown = one["status"] == OK
    if name == "period":
        shown = shown & (one["motion"] == PERIODIC)
    return np.where(shown, one[name], np.nan)


def _errors(one: Line) -> Array:
    """Half the length of the error bars [procedure, point]: two standard errors."""
    return 2 * one["lyapunov_error"]


def _draw_values(axes: Axes, one: Line, name: str, x: Shown) -> None:
    for row, (procedure, values) in enumerate(zip(one.procedures, _shown(one, name), strict=True)):
        opened = is_open(procedure, one.procedures)
        colour = DIRECTION_COLOURS.get(procedure, REFERENCE)
        errors = _errors(one)[row] if name == "lyapunov_exponent" else None
        axes.errorbar(
            one.x / x.scale,
            values,
            yerr=errors,
            linestyle="none",
            marker="o",
            color=colour,
            markersize=2.4,
            markerfacecolor="white" if opened else colour,
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
