"""Maps over two axes: the responses as colours with names, or one measured value as a
colour scale.

There is a panel for each procedure and each value of a third axis; where a state was
carried both ways, one more panel shows where up and down differ. Cells reach half way
to their neighbours, so unequal steps are drawn to scale.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from nsdrill.analysis.counts import NOT_CARRIED
from nsdrill.analysis.hysteresis import disagreement
from nsdrill.analysis.safety import FAILED_POINT, NOT_CARRIED_POINT, PENDING_POINT, known_outcome
from nsdrill.data import Array, Results
from nsdrill.errors import InputError, option
from nsdrill.figures.cells import (
    PALE_GREY,
    RATE_OF_PENETRATION,
    Cells,
    cover,
    draw_equal_rates,
    fill_inferred,
    hatch,
    name_areas,
    overlay_verdicts,
    veil,
    verdict_handles,
)
from nsdrill.figures.page import area_entry, finish, name_panel, new_figure, panels_per_row, style_areas
from nsdrill.figures.panels import draw_codes, graded, says_nothing, severity_bounds
from nsdrill.figures.registry import MAX_PANELS
from nsdrill.figures.slices import edges, name_words, positions, robust_limits, spaced
from nsdrill.figures.style import (
    GREY,
    KIND_STYLES,
    MOTIONS,
    SHADE,
    SHADE_EDGE,
    STALLED_GREY,
    Properties,
    cell_style,
    lettered,
    page_width,
    styles_of,
)
from nsdrill.models.leaves import words_along
from nsdrill.models.responses import STALLED
from nsdrill.observe.motion import verdict
from nsdrill.variables import INFERRED
from nsdrill.words.labels import both_ways, carried, operating_point, quantity, sweep_title, way_word

# the first of these that is swept lies along x; depth increases downwards, as in a log
ACROSS = ("rotary_speed", "wob", "depth")
# number of panels -> how many stand in a row; 4 for any other number
COLUMNS_OF_PANELS = {1: 1, 2: 2, 3: 3, 4: 2, 5: 3, 6: 3, 9: 3}
PANEL_WIDTH = 1.5  # least width in inches
COLOUR_BAR_WIDTH = 0.4  # inches
TEXT_HEIGHT = 1.3  # inches of title, axis labels and legend
CATEGORIES = {**KIND_STYLES, "motion": MOTIONS}  # beside the responses of the model
# colours of values, of signed ones, of differences
SEQUENTIAL, DIVERGING, DIFFERENCE = "viridis", "RdBu_r", "PuOr_r"


@dataclass(frozen=True)
class Plane:
    """Two axes of a sweep as the plane of maps, in the units that are shown; a strip of
    height one where ``y`` is None."""

    results: Results
    x: str
    y: str | None
    units: str

    @property
    def cells(self) -> Cells:
        """The edges of the cells along x and y."""
        across, up = (
            edges(positions(self.results, axis)) / quantity(axis, self.units).scale if axis else np.array([0.0, 1.0])
            for axis in (self.x, self.y)
        )
        return across, up

    @property
    def centres(self) -> Cells:
        """The centres of the cells along x and y, where both have numbers."""
        coords = self.results.coords
        across, up = (coords[axis] / quantity(axis, self.units).scale for axis in (self.x, self.y) if axis)
        return across, up

    def shown(self, point: Mapping[str, float]) -> tuple[float, float]:
        """The place of a point, by the names of its values in SI."""
        across, up = (point[axis] / quantity(axis, self.units).scale if axis else 0.5 for axis in (self.x, self.y))
        return across, up

    def panels(self, figure: Figure, titles: Sequence[str], columns: int, pad: float | None = None) -> list[Axes]:
        """Panels with these titles, so many in a row, which share the axes and have the
        labels of these at the bottom and at the left."""
        x_label, y_label = (quantity(axis, self.units).label if axis else "" for axis in (self.x, self.y))
        grid = figure.add_gridspec(-(-len(titles) // columns), columns)
        panels: list[Axes] = []
        for number, title in enumerate(titles):
            first = panels[0] if panels else None
            axes = figure.add_subplot(grid[divmod(number, columns)], sharex=first, sharey=first)
            is_lowest, is_leftmost = number + columns >= len(titles), number % columns == 0
            axes.tick_params(labelbottom=is_lowest, labelleft=is_leftmost)
            axes.set(xlabel=x_label if is_lowest else "", ylabel=y_label if is_leftmost else "")
            axes.set_title(title, pad=pad)
            if not self.y:
                axes.set_yticks([])
            panels.append(axes)
        spaced(panels[0], *(positions(self.results, axis) if axis else None for axis in (self.x, self.y)))
        name_words(panels[0], self.results, self.x, self.y, self.units)
        self.limit(panels[0], *self.cells)
        return panels

    def limit(self, axes: Axes, x: Array, y: Array) -> None:
        """Limits at the ends of these edges; depth and words increase downwards."""
        downwards = self.y is not None and (self.y == "depth" or bool(words_along(self.y)))
        axes.set(xlim=(x[0], x[-1]), ylim=(y[-1], y[0]) if downwards else (y[0], y[-1]))


@dataclass(frozen=True)
class Planes(Plane):
    """A sweep laid out as maps: arrays are [procedure, value of the ``panel`` axis, y,
    x], with one value where there is no such axis, ""."""

    y: str
    panel: str

    @classmethod
    def of(cls, results: Results, units: str = "si") -> Planes:
        others = [axis for axis in results.axes if axis not in ACROSS]
        axes_in_order = [axis for axis in ACROSS if axis in results.axes]
        axes_in_order += sorted(others, key=lambda axis: bool(words_along(axis)))
        swept = [axis for axis in axes_in_order if axis in results.swept]
        if len(swept) > 3:
            found = f"a map: found the axes {', '.join(swept)}; allowed: at most three"
            raise InputError(f"{found}. Give values of the others, with {option('at')}.")
        # The panel axis is one that is not swept; with three swept axes it is one of
        # words, else the shortest.
        unswept = [axis for axis in results.axes if axis not in swept]
        shortest = sorted(swept, key=lambda axis: (not words_along(axis), len(results.coords[axis])))
        panel = shortest[0] if len(swept) == 3 else unswept[0] if unswept else ""
        chosen = [axis for axis in swept if axis != panel]
        x, y = (chosen + [axis for axis in axes_in_order if axis not in (*chosen, panel)])[:2]
        return cls(results, x, y, units, panel)

    def __getitem__(self, name: str) -> Array:
        return self.arranged(np.asarray(self.results.variables[name]))

    def arranged(self, array: Array) -> Array:
        """An array [procedure, axes, ...] as [procedure, panel axis, y, x, ...]."""
        axes = self.results.axes
        order = [axis for axis in (self.panel, self.y, self.x) if axis]
        # axes of a single value
        others = [1 + number for number, axis in enumerate(axes) if axis not in order]
        inner = range(1 + len(axes), array.ndim)
        array = array.transpose([0, *(1 + axes.index(axis) for axis in order), *others, *inner])
        maps = (1,) * (not self.panel) + array.shape[1 : 1 + len(order)]
        return array.reshape(array.shape[0], *maps, *array.shape[1 + len(axes) :])

    @property
    def procedures(self) -> tuple[str, ...]:
        return self.results.procedures

    @property
    def has_words(self) -> bool:
        """Whether an axis of a panel has words, between which nothing is
        interpolated."""
        return any(words_along(axis) for axis in (self.x, self.y) if len(self.results.coords[axis]) > 1)

    @property
    def panel_values(self) -> Array:
        return self.results.coords[self.panel] if self.panel else np.zeros(1)


def lies_across(results: Results) -> str:
    """The axis along x of a map."""
    return Planes.of(results).x


class Maps:
    """The maps of a sweep, as they are drawn: what is known of each point, and the
    panels, a row for each value of the panel axis and a column for each procedure."""

    def __init__(self, results: Results, units: str) -> None:
        self.planes = planes = Planes.of(results, units)
        self.rows, self.columns = len(planes.panel_values), len(planes.procedures)
        if self.rows * self.columns > MAX_PANELS:
            raise InputError(
                f"a map: found {self.rows} values of {planes.panel} beside {planes.y} and {planes.x}, which would "
                f"be {self.rows * self.columns} panels; allowed: {MAX_PANELS}. Select one value of {planes.panel}."
            )
        # rather no comparison than less data
        self.may_compare = self.rows * (self.columns + 1) <= MAX_PANELS
        up, down = (way_word(procedure, results.attrs) for procedure in ("up", "down"))
        self.difference = f"{down} less {up}"
        self.outcomes = planes.arranged(known_outcome(results))
        self.inferred = planes["status"] == INFERRED
        self.grid: list[list[Axes]] = []

    @cached_property
    def verdicts(self) -> Array | None:
        """The verdicts of the checks, where there are any."""
        return verdict(self.planes) if "trusted" in self.planes.results.variables else None

    def filled(self, name: str, *, linear: bool) -> Array:
        """The values of a variable, those of inferred points from the points around."""
        return fill_inferred(self.planes[name], self.inferred, (self.outcomes >= 0) & ~self.inferred, linear=linear)

    def known(self, values: Array, otherwise: Array | float = np.nan) -> Array:
        """The values of points that ended well, of others what stands for them."""
        return np.where(self.outcomes < 0, otherwise, values)

    def new_figure(self, *, with_comparison: bool, of_values: bool) -> Figure:
        """The empty panels, and one more in each row ``with_comparison``.

        With one procedure the panels are wrapped, as a column of twelve would leave
        half of the page empty.
        """
        planes, columns = self.planes, self.columns + with_comparison
        wanted = COLUMNS_OF_PANELS.get(self.rows, 4) if columns == 1 else columns
        if self.verdicts is not None and self.rows == 1:  # patterns and dots need large cells
            wanted = min(wanted, 2)
        panel_columns = panels_per_row(wanted, PANEL_WIDTH + (COLOUR_BAR_WIDTH if of_values else 0.0))
        figure = new_figure(page_width(), height_of_maps(self.rows * columns, panel_columns))
        titles = [self._title(*divmod(number, columns), of_values) for number in range(self.rows * columns)]
        panels = planes.panels(figure, titles, panel_columns)
        for number, axes in enumerate(panels):
            name_panel(axes, [*planes.procedures, "compared"][number % columns], planes.y)
        self.grid = [panels[row * columns : (row + 1) * columns] for row in range(self.rows)]
        return figure

    def _title(self, row: int, column: int, of_values: bool) -> str:
        planes, words = self.planes, []
        if self.rows > 1:
            words.append(operating_point({planes.panel: planes.panel_values[row]}, planes.units))
        if column >= self.columns:
            words.append(self.difference if of_values else f"{both_ways(planes.results.attrs)} compared")
        elif planes.procedures != ("same",):
            words.append(carried(planes.procedures[column], planes.results.attrs))
        return ", ".join(words)

    def panels(self) -> Iterator[tuple[Axes, tuple[int, int]]]:
        """The panels in their order, each with its place (procedure, value of the panel
        axis) in arrays; not those that compare."""
        for row, axes_of_row in enumerate(self.grid):
            for column in range(self.columns):
                yield axes_of_row[column], (column, row)

    def draw_marks(self, figure: Figure) -> None:
        """Mark the points that checks doubt, and those that failed."""
        cells = self.planes.cells
        cell_width = page_width() / len(self.grid[0]) / len(cells[0])
        cell_height = (figure.get_figheight() - TEXT_HEIGHT) / len(self.grid) / len(cells[1])
        for axes, place in self.panels():
            if self.verdicts is not None:
                overlay_verdicts(axes, cells, self.verdicts[place], 72 * min(cell_width, cell_height))
            hatch(axes, cells, self.outcomes[place] == FAILED_POINT, "xxxxxx", "#000000", "failed", face="white")
            after = self.outcomes[place] == NOT_CARRIED_POINT
            hatch(axes, cells, after, "......", "#000000", "not_carried", face="white")

    def entries(self, method: str, inferred: Properties, difference: Array | None) -> list[Artist]:
        """Legend entries for what is not a colour of the map: inferred points with the
        ``method`` by which they are known, in this style, failed points, points not run
        yet, those where up and down differ, and those that checks doubt."""
        fine = {"facecolor": "white", "edgecolor": "black", "linewidth": 0.4}
        entries: list[tuple[str, Array, Properties]] = [
            (method, self.inferred, inferred),
            ("failed", self.outcomes == FAILED_POINT, fine | {"hatch": "xxxxxx", "gid": "failed"}),
            (NOT_CARRIED, self.outcomes == NOT_CARRIED_POINT, fine | {"hatch": "......", "gid": "not_carried"}),
            ("not run yet", self.outcomes == PENDING_POINT, fine | {"edgecolor": GREY}),
        ]
        entries = [entry for entry in entries if np.any(entry[1])]
        if difference is not None:
            differs = {"facecolor": SHADE, "edgecolor": SHADE_EDGE, "hatch": "//////", "gid": "differs"}
            entries.append((f"{both_ways(self.planes.results.attrs)} differ", difference == 1, fine | differs))
        handles: list[Artist] = [
            area_entry(label=f"{words} ({np.count_nonzero(cells)} of {cells.size})", **style)
            for words, cells, style in entries
        ]
        return handles + ([] if self.verdicts is None else verdict_handles(self.verdicts))

    def finish(self, figure: Figure, handles: list[Artist]) -> Figure:
        title = sweep_title(self.planes.results, self.planes.units)
        return finish(figure, title, handles, 5 if len(handles) == 5 else 4)


def height_of_maps(panels: int, columns: int) -> float:
    """The height [inches] of a page of so many maps, ``columns`` in a row."""
    rows, width = -(-panels // columns), page_width() / columns
    return TEXT_HEIGHT + rows * (min(0.8 * width, 3.4) if rows == 1 else 0.72 * width)


def draw_map(results: Results, units: str = "si", variable: str = "response") -> Figure:
    """Maps of ``response``, of its kinds or of ``motion``, each by its
    colours."""
    maps = Maps(results, units)
    planes = maps.planes
    categories = styles_of(results.attrs) if variable == "response" else CATEGORIES[variable]
    # the response is all that is known of an inferred point
    values = planes[variable] if variable == "response" else maps.filled(variable, linear=False)
    difference = disagreement(planes.procedures, maps.known(values, maps.outcomes)) if maps.may_compare else None
    figure = maps.new_figure(with_comparison=difference is not None, of_values=False)
    shown = np.ma.masked_where(maps.outcomes < 0, values.astype(int))
    colours = [style.colour for style in categories]
    for axes, place in maps.panels():
        draw_codes(axes, planes.cells, shown[place], colours, variable, "cells")
        veil(axes, planes.cells, maps.inferred[place])
        for code, style in enumerate(categories):
            if style.letters:
                chosen = shown[place].filled(-1) == code
                name_areas(axes, planes.cells, chosen, (style.name, style.letters), style.colour, f"area:{code}")
    maps.draw_marks(figure)
    lines: list[Artist] = []
    if variable == "response" and RATE_OF_PENETRATION in results.variables and not planes.has_words:
        rates, centres = planes[RATE_OF_PENETRATION], planes.centres
        for axes, place in maps.panels():
            lines = draw_equal_rates(axes, centres, rates[place], units) or lines
    if difference is not None:
        for panels, differs in zip(maps.grid, difference, strict=True):
            hatch(panels[-1], planes.cells, differs == 0, "", "none", "same", face="#EDEDED")
            hatch(panels[-1], planes.cells, differs == 1, "//////", "#404040", "differs", face=SHADE)
    styles = lettered(categories) if variable == "response" else categories
    handles = style_areas(styles, np.unique(shown.compressed()).tolist(), "cells:*")
    paler = {"facecolor": PALE_GREY, "gid": "inferred"}
    return maps.finish(figure, [*handles, *maps.entries("paler: inferred", paler, difference), *lines])


def draw_value_map(results: Results, units: str, name: str) -> Figure:
    """Maps of a measured value, with one colour bar for all panels, contours at the
    bounds of severity, and where up and down were both carried their difference."""
    maps, value = Maps(results, units), quantity(name, units)
    planes, values = maps.planes, maps.filled(name, linear=True)
    compares = maps.may_compare and {"up", "down"} <= set(planes.procedures)
    figure = maps.new_figure(with_comparison=compares, of_values=True)
    stalled = says_nothing(name, planes["response"], results.attrs) & (maps.outcomes >= 0)
    values = np.where(stalled, np.nan, values)
    shown = np.ma.masked_invalid(maps.known(values / value.scale))
    low, high = robust_limits(shown.compressed())
    if value.unit == "%":
        low = 0.0
    colours = SEQUENTIAL
    if low < 0.0 < high:  # of both signs: white at zero
        colours, high = DIVERGING, max(-low, high)
        low = -high
    panels = {axes: shown[place] for axes, place in maps.panels()}
    bar = _draw_scale(figure, planes, panels, colours, (low, high), value.label)
    for axes, place in maps.panels():
        cover(axes, planes.cells, stalled[place], "stalled", facecolors=STALLED_GREY)
    response = graded(name, results.attrs)
    has_lines = response is not None and response.lines
    bounds = severity_bounds(results.attrs, name) if has_lines and not planes.has_words else ()
    for axes, cells in panels.items():
        contour_severity(axes, planes, cells, bounds)
    if crossed_bounds := [bound for bound in bounds if low < bound < high]:
        bar.ax.hlines(crossed_bounds, 0, 1, colors="white", linewidths=0.7)
        bar.set_label(f"{value.label}\nlines at {', '.join(f'{bound:.3g}' for bound in crossed_bounds)}")
    if compares:
        carried = maps.known(values)
        differences = carried[planes.procedures.index("down")] - carried[planes.procedures.index("up")]
        shown = np.ma.masked_invalid(differences / value.scale)
        high = max(map(abs, robust_limits(shown.compressed()))) if shown.count() else 1.0
        panels = {row[-1]: cells for row, cells in zip(maps.grid, shown, strict=True)}
        label = f"{maps.difference} [{value.unit}]" if value.unit else maps.difference
        _draw_scale(figure, planes, panels, DIFFERENCE, (-high, high), label)
    maps.draw_marks(figure)
    handles = style_areas(styles_of(results.attrs), [STALLED] if stalled.any() else [])
    return maps.finish(figure, [*handles, *maps.entries("interpolated between runs", {"facecolor": "none"}, None)])


def _draw_scale(
    figure: Figure,
    planes: Planes,
    panels: dict[Axes, np.ma.MaskedArray],
    colours: str,
    limits: tuple[float, float],
    label: str,
) -> Colorbar:
    """Colour the cells of the panels by their values, and return the colour bar of all,
    pointed at the ends beyond which there are values."""
    for axes, cells in panels.items():
        style = cell_style(cells.size)
        mesh = axes.pcolormesh(*planes.cells, cells, cmap=colours, norm=Normalize(*limits), gid="cells", **style)
    extremes = [extreme for cells in panels.values() if cells.count() for extreme in (cells.min(), cells.max())]
    below, above = (min(extremes) < limits[0], max(extremes) > limits[1]) if extremes else (False, False)
    extend = ("both" if above else "min") if below else ("max" if above else "neither")
    return figure.colorbar(mesh, ax=list(panels), label=label, extend=extend, fraction=0.05, pad=0.01, aspect=30)


def contour_severity(axes: Axes, planes: Planes, values: np.ma.MaskedArray, bounds: Sequence[float]) -> None:
    """Contours at the bounds of severity, thicker for the higher ones; none where all
    values lie on one side of every bound."""
    if min(values.shape) < 2 or not values.count():
        return
    crossed_bounds = [bound for bound in bounds if values.min() < bound < values.max()]
    if crossed_bounds:
        x, y = planes.centres
        widths = [0.4 + 0.3 * list(bounds).index(bound) for bound in crossed_bounds]
        lines = axes.contour(x, y, values, levels=crossed_bounds, colors="white", linewidths=widths)
        lines.set_gid("severity")
