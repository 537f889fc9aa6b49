"""Maps over two axes: the responses as colours with names, or one measured value as a
colour scale.

There is a panel for each procedure and each value of a third axis; where a state was
carried both ways, one more panel shows where up and down differ. Cells reach half way
to their neighbours, so unequal steps are drawn to scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.tri import LinearTriInterpolator, Triangulation

from nsdrill.analysis.hysteresis import disagreement
from nsdrill.analysis.outcome import FAILED_POINT, PENDING_POINT, outcome, text
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.models.leaves import words_along
from nsdrill.observe.trust import verdict
from nsdrill.plot import isolines
from nsdrill.plot.curves import severity_bounds
from nsdrill.plot.hatching import PALE_GREY, hatch, veil
from nsdrill.plot.isolines import RATE_OF_PENETRATION
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.registry import MAX_PANELS
from nsdrill.plot.slices import edges, name_words, positions, robust_limits, spaced
from nsdrill.plot.style import (
    GREY,
    MOTIONS,
    RESPONSES,
    SHADE,
    SHADE_EDGE,
    WHIRLS,
    cell_style,
    name_panel,
    new_figure,
    page_width,
    panels_per_row,
    put_title,
)
from nsdrill.plot.verdicts import overlay_verdicts, verdict_handles
from nsdrill.variables import INFERRED

# the first of these that is swept lies along x; depth increases downwards, as in a log
ACROSS = ("rotary_speed", "wob", "depth")
# number of panels -> how many stand in a row; 4 for any other number
COLUMNS_OF_PANELS = {1: 1, 2: 2, 3: 3, 4: 2, 5: 3, 6: 3, 9: 3}
PANEL_WIDTH = 1.5  # least width in inches
COLOUR_BAR_WIDTH = 0.4  # inches
TEXT_HEIGHT = 1.3  # inches of title, axis labels and legend
CATEGORIES: dict[str, tuple[tuple[str, str], ...]] = {
    "response": tuple((style.name, style.colour) for style in RESPONSES),
    "whirl_kind": WHIRLS,
    "motion": tuple((style.name, style.colour) for style in MOTIONS),
}
# colours of values, of signed ones, of differences
SEQUENTIAL, DIVERGING, DIFFERENCE = "viridis", "RdBu_r", "PuOr_r"


@dataclass(frozen=True)
class Planes:
    """A sweep laid out as panels: arrays are [procedure, value of the panel axis, y,
    x]."""

    results: Results
    x: str
    y: str
    panel: str

    @classmethod
    def of(cls, results: Results) -> Planes:
        axes_in_order = (*ACROSS, *sorted(results.axes[len(ACROSS) :], key=lambda axis: bool(words_along(axis))))
        swept = [axis for axis in axes_in_order if axis in results.swept]
        if len(swept) > 3:
            raise InputError(f"a map has at most three axes; found {', '.join(swept)}. Give values of the others.")
        # The panel axis is one that is not swept; with three swept axes it is one of
        # words, else the shortest.
        unswept = [axis for axis in results.axes if axis not in swept]
        shortest = sorted(swept, key=lambda axis: (not words_along(axis), len(results.coords[axis])))
        panel = shortest[0] if len(swept) == 3 else unswept[0]
        chosen = [axis for axis in swept if axis != panel]
        x, y = (chosen + [axis for axis in axes_in_order if axis not in (*chosen, panel)])[:2]
        return cls(results, x, y, panel)

    def __getitem__(self, name: str) -> Array:
        axes = self.results.axes
        order = (self.panel, self.y, self.x)
        # axes of a single value
        others = [1 + number for number, axis in enumerate(axes) if axis not in order]
        array = np.asarray(self.results.variables[name])
        inner = range(1 + len(axes), array.ndim)
        array = array.transpose([0, *(1 + axes.index(axis) for axis in order), *others, *inner])
        return array.reshape(*array.shape[:4], *array.shape[1 + len(axes) :])

    @property
    def procedures(self) -> tuple[str, ...]:
        return tuple(text(name) for name in self.results.coords["procedure"])

    @property
    def has_words(self) -> bool:
        """Whether an axis of a panel has words, between which nothing is interpolated."""
        return any(words_along(axis) for axis in (self.x, self.y) if len(self.results.coords[axis]) > 1)

    @property
    def panel_values(self) -> Array:
        return self.results.coords[self.panel]


def lies_across(results: Results) -> str:
    """The axis along x of a map."""
    return Planes.of(results).x


def draw_map(results: Results, units: str = "si", variable: str = "response", name: str | None = None) -> Figure:
    """A map of the feature ``name``; without one, of ``response``, ``whirl_kind`` or
    ``motion``, by the colours of :data:`CATEGORIES`."""
    planes = Planes.of(results)
    outcomes = outcome(planes["status"], planes["response"])
    inferred = planes["status"] == INFERRED
    # a map of responses: the response is all that is known of an inferred point
    is_response_map = variable == "response" and name is None
    shown = planes[name or variable]
    if not is_response_map:
        shown = fill_inferred(shown, inferred, (outcomes >= 0) & ~inferred, linear=name is not None)
    difference = None
    if name is None:
        difference = disagreement(planes.procedures, np.where(outcomes < 0, outcomes, shown))
    elif {"up", "down"} <= set(planes.procedures):
        carried = np.where(outcomes < 0, np.nan, shown)
        difference = carried[planes.procedures.index("down")] - carried[planes.procedures.index("up")]
    panels = len(planes.procedures) * len(planes.panel_values)
    if panels > MAX_PANELS:
        raise InputError(
            f"a map: found {len(planes.panel_values)} values of {planes.panel} beside {planes.y} "
            f"and "
            f"{planes.x}, which would be {panels} panels; allowed: {MAX_PANELS}. Select one value "
            f"of {planes.panel}."
        )
    if panels + len(planes.panel_values) > MAX_PANELS:
        difference = None  # rather no comparison than less data
    figure, grid = _new_panels(planes, units, with_comparison=difference is not None, with_colour_bar=name is not None)
    if name is None:
        handles = _draw_categories(grid, planes, variable, shown, outcomes, units)
    else:
        handles = _draw_values(figure, grid, planes, name, shown, outcomes, units)
        if difference is not None:
            _draw_differences(figure, grid, planes, name, difference, units)
    cells = _cell_edges(planes, units)
    verdicts = verdict(planes) if "trusted" in results.variables else None
    cell_width = page_width() / len(grid[0]) / len(cells[0])
    cell_size = 72 * min(cell_width, (figure.get_figheight() - TEXT_HEIGHT) / len(grid) / len(cells[1]))
    has_lines = False
    for row in range(len(planes.panel_values)):
        for column in range(len(planes.procedures)):
            if name is None:  # a veil would change the colours of a scale
                veil(grid[row][column], cells, inferred[column, row])
            if verdicts is not None:
                overlay_verdicts(grid[row][column], *cells, verdicts[column, row], cell_size)
            failed = outcomes[column, row] == FAILED_POINT
            hatch(grid[row][column], cells, failed, "xxxxxx", "white", "#000000", "failed")
            if is_response_map and RATE_OF_PENETRATION in results.variables and not planes.has_words:
                x, y = (results.coords[axis] / quantity(axis, units).scale for axis in (planes.x, planes.y))
                has_lines |= isolines.draw_lines(
                    grid[row][column], x, y, planes[RATE_OF_PENETRATION][column, row], units
                )
        if difference is not None and name is None:
            axes = grid[row][-1]
            hatch(axes, cells, difference[row] == 0, "", "#EDEDED", "none", "same")
            hatch(axes, cells, difference[row] == 1, "//////", SHADE, "#404040", "differs")
    handles += _legend_entries(
        outcomes,
        difference if name is None else None,
        inferred,
        "paler: inferred" if name is None else "interpolated between runs",
    )
    if verdicts is not None:
        handles += verdict_handles(verdicts)
    if has_lines:
        handles.append(isolines.legend_entry(units))
    legend_below(figure, handles, 4 if len(handles) != 5 else 5)
    return figure


def _new_panels(
    planes: Planes, units: str, *, with_comparison: bool, with_colour_bar: bool
) -> tuple[Figure, list[list[Axes]]]:
    """The empty panels, a row for each value of the panel axis and a column for each
    procedure, and one more ``with_comparison``.

    With one procedure the panels are wrapped, as a column of twelve would leave half of
    the page empty.
    """
    rows, columns = len(planes.panel_values), len(planes.procedures) + with_comparison
    panel_columns = panels_per_row(
        COLUMNS_OF_PANELS.get(rows, 4) if columns == 1 else columns,
        PANEL_WIDTH + (COLOUR_BAR_WIDTH if with_colour_bar else 0.0),
    )
    panel_rows = -(-rows * columns // panel_columns)
    width = page_width() / panel_columns
    figure = new_figure(
        page_width(), TEXT_HEIGHT + panel_rows * (min(0.8 * width, 3.4) if panel_rows == 1 else 0.72 * width)
    )
    grid = figure.add_gridspec(panel_rows, panel_columns)
    x, y = quantity(planes.x, units), quantity(planes.y, units)
    panels: list[Axes] = []
    for number in range(rows * columns):
        first = panels[0] if panels else None
        axes = figure.add_subplot(grid[divmod(number, panel_columns)], sharex=first, sharey=first)
        is_lowest, is_leftmost = (number + panel_columns >= rows * columns, number % panel_columns == 0)
        axes.tick_params(labelbottom=is_lowest, labelleft=is_leftmost)
        axes.set_xlabel(x.label if is_lowest else "")
        axes.set_ylabel(y.label if is_leftmost else "")
        axes.set_title(_panel_title(planes, *divmod(number, columns), units, with_colour_bar))
        name_panel(axes, [*planes.procedures, "compared"][number % columns], planes.y)
        panels.append(axes)
    x_edges, y_edges = _cell_edges(planes, units)
    spaced(panels[0], positions(planes.results, planes.x), positions(planes.results, planes.y))
    name_words(panels[0], planes.results, planes.x, planes.y, units)
    panels[0].set_xlim(x_edges[0], x_edges[-1])
    downwards = planes.y == "depth" or bool(words_along(planes.y))
    panels[0].set_ylim((y_edges[-1], y_edges[0]) if downwards else (y_edges[0], y_edges[-1]))
    put_title(figure, heading(planes.results.attrs, operating_point(fixed_values(planes.results), units)))
    return figure, [panels[row * columns : (row + 1) * columns] for row in range(rows)]


def _panel_title(planes: Planes, row: int, column: int, units: str, of_values: bool) -> str:
    words = []
    if len(planes.panel_values) > 1:
        words.append(operating_point({planes.panel: planes.panel_values[row]}, units))
    if column >= len(planes.procedures):
        words.append("down less up" if of_values else "up and down compared")
    elif planes.procedures != ("same",):
        name = planes.procedures[column]
        words.append(f"carried {name}" if name in ("up", "down") else name)
    return ", ".join(words)


def _cell_edges(planes: Planes, units: str) -> tuple[Array, Array]:
    """The edges of the cells along x and y, in the shown units."""
    x, y = (positions(planes.results, axis) for axis in (planes.x, planes.y))
    return edges(x) / quantity(planes.x, units).scale, edges(y) / quantity(planes.y, units).scale


def _draw_categories(
    grid: Sequence[Sequence[Axes]], planes: Planes, variable: str, values: Array, outcomes: Array, units: str
) -> list[Artist]:
    """Colour the cells by category; returns the legend entries of those that occur."""
    categories = CATEGORIES[variable]
    colours = ListedColormap([colour for _, colour in categories], name=variable)
    norm = BoundaryNorm(np.arange(-0.5, len(categories)), len(categories))
    shown = np.ma.masked_where(outcomes < 0, values.astype(int))
    x, y = _cell_edges(planes, units)
    for row, panels in enumerate(grid):
        for column, axes in zip(range(len(planes.procedures)), panels, strict=False):
            axes.pcolormesh(
                x, y, shown[column, row], cmap=colours, norm=norm, gid="cells", **cell_style(shown[0, 0].size)
            )
    present = set(shown.compressed().tolist())
    return [Patch(facecolor=colour, label=name) for code, (name, colour) in enumerate(categories) if code in present]


def _draw_values(
    figure: Figure,
    grid: Sequence[Sequence[Axes]],
    planes: Planes,
    name: str,
    values: Array,
    outcomes: Array,
    units: str,
) -> list[Artist]:
    """Colour the cells by a measured value, with one colour bar for all panels, and
    draw the bounds of severity as contours. Returns no legend entries."""
    value = quantity(name, units)
    shown = np.ma.masked_invalid(np.where(outcomes < 0, np.nan, values / value.scale))
    low, high = robust_limits(shown.compressed())
    if value.unit == "%":
        low = 0.0
    colours = SEQUENTIAL
    if low < 0.0 < high:  # of both signs: white at zero
        colours, high = DIVERGING, max(-low, high)
        low = -high
    bounds = severity_bounds(planes.results.attrs, name) if name == "stick_slip_index" and not planes.has_words else ()
    panels = [axes for row in grid for axes in row[: len(planes.procedures)]]
    mesh = _draw_cells(panels, planes, _in_panel_order(shown), Normalize(low, high), colours, units)
    colour_bar = _add_colour_bar(figure, mesh, panels, value.label, shown, low, high)
    if bounds:
        for axes, cells in zip(panels, _in_panel_order(shown), strict=True):
            contour_severity(axes, planes, cells, bounds, units)
    crossed_bounds = [bound for bound in bounds if low < bound < high]
    if crossed_bounds:
        colour_bar.ax.hlines(crossed_bounds, 0, 1, colors="white", linewidths=0.7)
        colour_bar.set_label(f"{value.label}\nlines at {', '.join(f'{bound:.3g}' for bound in crossed_bounds)}")
    return []


def _draw_differences(
    figure: Figure, grid: Sequence[Sequence[Axes]], planes: Planes, name: str, differs: Array, units: str
) -> None:
    """Colour the last panels by how much greater the value is on the way down, with a
    colour bar of their own."""
    value = quantity(name, units)
    shown = np.ma.masked_invalid(differs / value.scale)
    high = max(map(abs, robust_limits(shown.compressed()))) if shown.count() else 1.0
    panels, norm = [row[-1] for row in grid], Normalize(-high, high)
    mesh = _draw_cells(panels, planes, list(shown), norm, DIFFERENCE, units)
    label = f"down less up [{value.unit}]" if value.unit else "down less up"
    _add_colour_bar(figure, mesh, panels, label, shown, -high, high)


def _in_panel_order(shown: Any) -> list[Any]:
    """The planes [procedure, row] in the order of the panels."""
    return [shown[column, row] for row in range(shown.shape[1]) for column in range(shown.shape[0])]


def _draw_cells(
    panels: Sequence[Axes], planes: Planes, shown: Sequence[Any], norm: Normalize, colours: str, units: str
) -> Any:
    x, y = _cell_edges(planes, units)
    mesh = None
    for axes, cells in zip(panels, shown, strict=True):
        mesh = axes.pcolormesh(x, y, cells, cmap=colours, norm=norm, gid="cells", **cell_style(cells.size))
    return mesh


def _add_colour_bar(
    figure: Figure, mesh: Any, panels: Sequence[Axes], label: str, shown: Any, low: float, high: float
) -> Any:
    """A colour bar for the panels, pointed at the ends beyond which there are values."""
    below, above = (shown.count() and (shown.min() < low, shown.max() > high)) or (False, False)
    extend = ("both" if above else "min") if below else ("max" if above else "neither")
    return figure.colorbar(mesh, ax=list(panels), label=label, extend=extend, fraction=0.05, pad=0.01, aspect=30)


def fill_inferred(values: Array, inferred: Array, known: Array, *, linear: bool) -> Array:
    """The values [procedure, row, y, x], those of ``inferred`` points filled in from the
    ``known`` points around them: by linear interpolation, or from the nearest."""
    from scipy.ndimage import distance_transform_edt

    result = values.copy()
    for place in np.ndindex(values.shape[:2]):
        known_here, to_fill = known[place] & np.isfinite(values[place]), inferred[place]
        if not known_here.any() or not to_fill.any():
            continue
        nearest = distance_transform_edt(~known_here, return_distances=False, return_indices=True)
        result[place][to_fill] = values[place][tuple(nearest)][to_fill]
        if linear:
            interpolated = _interpolated(values[place], known_here, to_fill)
            result[place][to_fill] = np.where(np.isfinite(interpolated), interpolated, result[place][to_fill])
    return result


def _interpolated(values: Array, known: Array, to_fill: Array) -> Array:
    """Linear interpolation between the known points; NaN outside their convex hull."""
    rows, columns = np.nonzero(known)
    try:
        interpolator = LinearTriInterpolator(Triangulation(columns, rows), values[known])
    except (RuntimeError, ValueError):  # too few, or all on a line
        return np.full(int(to_fill.sum()), np.nan)
    rows, columns = np.nonzero(to_fill)
    return np.ma.filled(interpolator(columns, rows), np.nan)


def contour_severity(
    axes: Axes, planes: Planes, values: np.ma.MaskedArray, bounds: Sequence[float], units: str
) -> None:
    """Contours at the bounds of severity, thicker for the higher ones."""
    if min(values.shape) < 2 or not values.count():
        return
    crossed_bounds = [bound for bound in bounds if values.min() < bound < values.max()]
    if not crossed_bounds:  # all values lie on one side of every bound
        return
    x, y = (planes.results.coords[axis] / quantity(axis, units).scale for axis in (planes.x, planes.y))
    widths = [0.4 + 0.3 * list(bounds).index(bound) for bound in crossed_bounds]
    lines = axes.contour(x, y, values, levels=crossed_bounds, colors="white", linewidths=widths)
    lines.set_gid("severity")


def _legend_entries(outcomes: Array, difference: Array | None, inferred: Array, method: str) -> list[Artist]:
    """Legend entries for what is not a colour of the map: inferred points with the
    ``method`` by which they are known, failed points, points not run yet, and those
    where up and down differ."""
    fine = {"facecolor": "white", "edgecolor": "black", "linewidth": 0.4}
    differs = {"facecolor": SHADE, "edgecolor": SHADE_EDGE, "hatch": "//////"}
    inferred_style = {"facecolor": PALE_GREY if "paler" in method else "none"}
    entries: list[tuple[str, Array, dict[str, Any]]] = [
        (method, inferred, inferred_style),
        ("failed", outcomes == FAILED_POINT, fine | {"hatch": "xxxxxx"}),
        ("not run yet", outcomes == PENDING_POINT, fine | {"edgecolor": GREY}),
    ]
    entries = [entry for entry in entries if np.any(entry[1])]
    if difference is not None:
        entries.append(("up and down differ", difference == 1, fine | differs))
    return [
        Patch(label=f"{words} ({np.count_nonzero(cells)} of {cells.size})", **style) for words, cells, style in entries
    ]
