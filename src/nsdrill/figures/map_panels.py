"""Maps over two axes: the responses as colours with names, or one measured value as a
colour scale.

There is a panel for each procedure and each value of a third axis; where a state was
carried both ways, one more panel shows where up and down differ. Cells reach half way
to their neighbours, so unequal steps are drawn to scale.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from nsdrill.analysis.counts import NOT_CARRIED
from nsdrill.analysis.grades import unsettled_runs
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
    equal_rates_entry,
    fill_inferred,
    hatch,
    hatch_unsettled,
    name_areas,
    overlay_verdicts,
    unsettled_entry,
    veil,
    verdict_handles,
)
from nsdrill.figures.page import area_entry, lay_up, page_height, panels_per_row, style_areas
from nsdrill.figures.painters import Bar, Page, Paint, numbered
from nsdrill.figures.panels import draw_codes, graded, says_nothing, severity_bounds
from nsdrill.figures.picture_kinds import MAX_PANELS
from nsdrill.figures.slices import edges, is_logarithmic, name_words, positions, robust_limits, spaced
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
from nsdrill.models.choices import words_along
from nsdrill.models.responses import STALLED
from nsdrill.observe.motion_kinds import verdict
from nsdrill.records import dataclass
from nsdrill.variables import INFERRED
from nsdrill.words.labels import both_ways, carried, operating_point, quantity, sweep_title, way_word

# the first of these that is swept lies along x; depth increases downwards, as in a log
ACROSS = ("rotary_speed", "wob", "depth")
# number of panels -> how many stand in a row; 4 for any other number
COLUMNS_OF_PANELS = {1: 1, 2: 2, 3: 3, 4: 2, 5: 3, 6: 3, 9: 3}
PANEL_WIDTH = 1.5  # least width in inches
COLOUR_BAR_WIDTH = 0.4  # inches
MOST_TICKS = 9  # values of an axis upwards that each have one
TEXT_HEIGHT = 1.3  # inches of title, axis labels and legend
CATEGORIES = {**KIND_STYLES, "motion": MOTIONS}  # beside the responses of the model
# colours of values, of signed ones, of differences
SEQUENTIAL, DIVERGING, DIFFERENCE = "viridis", "RdBu_r", "PuOr_r"


def has_room_for_ticks(values: Array) -> bool:
    """Whether each of the values along an axis may have a tick of its own, beside the others."""
    if len(values) > MOST_TICKS or len(values) < 2 or is_logarithmic(values):
        return False
    return bool(np.diff(values).min() * MOST_TICKS >= values[-1] - values[0])


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

    def arrange(self, count: int, columns: int) -> Callable[[Figure], list[Axes]]:
        """Makes so many panels, ``columns`` in a row, which share the axes and have
        numbers at the bottom and at the left."""

        def arranged(figure: Figure) -> list[Axes]:
            grid = figure.add_gridspec(-(-count // columns), columns)
            panels: list[Axes] = []
            for number in range(count):
                first = panels[0] if panels else None
                axes = figure.add_subplot(grid[divmod(number, columns)], sharex=first, sharey=first)
                axes.tick_params(labelbottom=number + columns >= count, labelleft=number % columns == 0)
                panels.append(axes)
            return panels

        return arranged

    def frame(self, axes: Axes, title: str, pad: float | None = None) -> None:
        """Give a panel its title, and the labels, scales and limits of the plane."""
        axes.set(xlabel=quantity(self.x, self.units).label)
        axes.set(ylabel=quantity(self.y, self.units).label if self.y else "")
        axes.set_title(title, pad=pad)
        if not self.y:
            axes.set_yticks([])
        spaced(axes, *(positions(self.results, axis) if axis else None for axis in (self.x, self.y)))
        if self.y is not None and not words_along(self.y) and has_room_for_ticks(self.centres[-1]):
            axes.set_yticks(self.centres[-1])  # what was run, and nothing else
        name_words(axes, self.results, self.x, self.y, self.units)
        self.limit(axes, *self.cells)

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
    """The maps of a sweep, as they are drawn: what is known of each point, with a row of
    panels for each value of the panel axis and a column for each procedure."""

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
        self.unsettled = planes.arranged(unsettled_runs(results)) & (self.outcomes >= 0)

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

    def page(
        self,
        paint: Callable[[Axes, tuple[int, int]], object],
        compare: Callable[[Axes, int], object] | None,
        entries: Sequence[Artist],
        *,
        of_values: bool = False,
        bars: Sequence[Bar] = (),
    ) -> Page:
        """The page of the maps: ``paint`` draws that of a place (procedure, value of the
        panel axis) in arrays, and ``compare``, where it is given, what differs for a value
        of the panel axis, in one more panel of each row. The ``panels`` of ``bars`` are
        procedures, or "compared".

        With one procedure the panels are wrapped, as a column of twelve would leave
        half of the page empty.
        """
        planes, kinds = self.planes, [*self.planes.procedures, *(["compared"] if compare is not None else [])]
        wanted = COLUMNS_OF_PANELS.get(self.rows, 4) if len(kinds) == 1 else len(kinds)
        if self.verdicts is not None and self.rows == 1:  # patterns and dots need large cells
            wanted = min(wanted, 2)
        columns = panels_per_row(wanted, PANEL_WIDTH + (COLOUR_BAR_WIDTH if of_values else 0.0))
        height = height_of_maps(self.rows * len(kinds), columns)
        (across, up), grid = (len(edge) for edge in planes.cells), self.rows
        cell_height = (page_height(height) - TEXT_HEIGHT) / grid / up
        cell_size = 72 * min(page_width() / len(kinds) / across, cell_height)

        def painter(row: int, column: int) -> Paint:
            def painted(axes: Axes) -> None:
                planes.frame(axes, self._title(row, column, of_values))
                lay_up(axes, planes.y)
                if column < self.columns:
                    paint(axes, (column, row))
                    self._draw_marks(axes, (column, row), cell_size)
                elif compare is not None:
                    compare(axes, row)

            return painted

        places = [(row, column) for row in range(self.rows) for column in range(len(kinds))]
        names = numbered(kinds[column] for _, column in places)
        return Page(
            {name: painter(*place) for name, place in zip(names, places, strict=True)},
            sweep_title(planes.results, planes.units),
            page_width(),
            height,
            planes.arrange(len(places), columns),
            lambda panels: entries,
            5 if len(entries) == 5 else 4,
            bars=[
                replace(bar, panels=[one for one in names if one.split()[0] in (bar.panels or kinds)]) for bar in bars
            ],
        )

    def _title(self, row: int, column: int, of_values: bool) -> str:
        planes, words = self.planes, []
        if self.rows > 1:
            words.append(operating_point({planes.panel: planes.panel_values[row]}, planes.units))
        if column >= self.columns:
            words.append(self.difference if of_values else f"{both_ways(planes.results.attrs)} compared")
        elif planes.procedures != ("same",):
            words.append(carried(planes.procedures[column], planes.results.attrs))
        return ", ".join(words)

    def _draw_marks(self, axes: Axes, place: tuple[int, int], cell_size: float) -> None:
        """Mark the points that checks doubt, that had not settled, and those that failed; ``cell_size`` in
        points."""
        cells = self.planes.cells
        if self.verdicts is not None:
            overlay_verdicts(axes, cells, self.verdicts[place], cell_size)
        hatch_unsettled(axes, cells, self.unsettled[place])
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
        if unsettled := int(np.count_nonzero(self.unsettled)):
            handles.append(unsettled_entry(unsettled, self.unsettled.size))
        return handles + ([] if self.verdicts is None else verdict_handles(self.verdicts))


def height_of_maps(panels: int, columns: int) -> float:
    """The height [inches] of a page of so many maps, ``columns`` in a row."""
    rows, width = -(-panels // columns), page_width() / columns
    return TEXT_HEIGHT + rows * (min(0.8 * width, 3.4) if rows == 1 else 0.72 * width)


def map_of(results: Results, units: str = "si", variable: str = "response") -> Page:
    """Maps of ``response``, of its kinds or of ``motion``, each by its
    colours."""
    maps = Maps(results, units)
    planes = maps.planes
    categories = styles_of(results.attrs) if variable == "response" else CATEGORIES[variable]
    # the response is all that is known of an inferred point
    values = planes[variable] if variable == "response" else maps.filled(variable, linear=False)
    difference = disagreement(planes.procedures, maps.known(values, maps.outcomes)) if maps.may_compare else None
    shown = np.ma.masked_where(maps.outcomes < 0, values.astype(int))
    has_rates = variable == "response" and RATE_OF_PENETRATION in results.variables and not planes.has_words

    def paint(axes: Axes, place: tuple[int, int]) -> None:
        draw_codes(axes, planes.cells, shown[place], [style.colour for style in categories], variable, "cells")
        veil(axes, planes.cells, maps.inferred[place])
        for code, style in enumerate(categories):
            if style.letters:
                chosen = shown[place].filled(-1) == code
                name_areas(axes, planes.cells, chosen, (style.name, style.letters), style.colour, f"area:{code}")
        if has_rates:
            draw_equal_rates(axes, planes.centres, planes[RATE_OF_PENETRATION][place], units)

    def compare(axes: Axes, row: int) -> None:
        assert difference is not None
        hatch(axes, planes.cells, difference[row] == 0, "", "none", "same", face="#EDEDED")
        hatch(axes, planes.cells, difference[row] == 1, "//////", "#404040", "differs", face=SHADE)

    styles = lettered(categories) if variable == "response" else categories
    entries = style_areas(styles, np.unique(shown.compressed()).tolist(), "cells:*")
    entries += maps.entries("paler: inferred", {"facecolor": PALE_GREY, "gid": "inferred"}, difference)
    if has_rates:
        entries.append(equal_rates_entry(units))
    return maps.page(paint, None if difference is None else compare, entries)


def value_map(results: Results, units: str, name: str) -> Page:
    """Maps of a measured value, with one colour bar for all panels, contours at the
    bounds of severity, and where up and down were both carried their difference."""
    maps, value = Maps(results, units), quantity(name, units)
    planes, values = maps.planes, maps.filled(name, linear=True)
    compares = maps.may_compare and {"up", "down"} <= set(planes.procedures)
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
    response = graded(name, results.attrs)
    has_lines = response is not None and response.lines
    bounds = severity_bounds(results.attrs, name) if has_lines and not planes.has_words else ()
    crossed = [bound for bound in bounds if low < bound < high]
    at = f"\nlines at {', '.join(f'{bound:.3g}' for bound in crossed)}" if crossed else ""
    bars = [colour_bar(shown, colours, (low, high), f"{value.label}{at}", planes.procedures, crossed)]
    differences = np.ma.masked_all(())
    if compares:
        known = maps.known(values)
        less = known[planes.procedures.index("down")] - known[planes.procedures.index("up")]
        differences = np.ma.masked_invalid(less / value.scale)
        most = max(map(abs, robust_limits(differences.compressed()))) if differences.count() else 1.0
        label = f"{maps.difference} [{value.unit}]" if value.unit else maps.difference
        bars.append(colour_bar(differences, DIFFERENCE, (-most, most), label, ["compared"]))

    def paint(axes: Axes, place: tuple[int, int]) -> None:
        _colour(axes, planes, shown[place], bars[0])
        cover(axes, planes.cells, stalled[place], "stalled", facecolors=STALLED_GREY)
        contour_severity(axes, planes, shown[place], bounds)

    def compare(axes: Axes, row: int) -> None:
        _colour(axes, planes, differences[row], bars[1])

    entries = style_areas(styles_of(results.attrs), [STALLED] if stalled.any() else [])
    entries += maps.entries("interpolated between runs", {"facecolor": "none"}, None)
    return maps.page(paint, compare if compares else None, entries, of_values=True, bars=bars)


def colour_bar(
    cells: np.ma.MaskedArray,
    colours: str,
    limits: tuple[float, float],
    label: str,
    panels: Sequence[str],
    lines: Sequence[float] = (),
) -> Bar:
    """The colour bar of all these ``cells``, pointed at the ends beyond which there are
    values."""
    below, above = (cells.min() < limits[0], cells.max() > limits[1]) if cells.count() else (False, False)
    extend = ("both" if above else "min") if below else ("max" if above else "neither")
    style = {"extend": extend, "fraction": 0.05, "pad": 0.01, "aspect": 30}
    return Bar(colours, Normalize(*limits), label, panels, lines, style)


def _colour(axes: Axes, planes: Planes, cells: np.ma.MaskedArray, bar: Bar) -> None:
    """Colour the cells of a panel by their values."""
    axes.pcolormesh(*planes.cells, cells, cmap=bar.colours, norm=bar.norm, gid="cells", **cell_style(cells.size))


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
