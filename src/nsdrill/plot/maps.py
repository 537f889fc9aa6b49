"""Maps over two axes: the responses as colours with names, or one measured value as a
colour scale.

A panel for each procedure and each value of a third axis; where a state was carried
both ways, one more panel that says where up and down differ. Cells reach half way to
their neighbours, so unequal steps are drawn to scale.
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
from nsdrill.plot import equal
from nsdrill.plot.bands import bounds
from nsdrill.plot.equal import RATE
from nsdrill.plot.hatching import hatch
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
    new_figure,
    page_width,
    put_title,
    seamless,
    side_by_side,
)
from nsdrill.plot.verdicts import overlay_verdicts, verdict_handles
from nsdrill.variables import INFERRED

# the first of these that is swept lies across; depth goes down, as in a log
ACROSS = ("rotary_speed", "wob", "depth")
# panels in a row, of so many; 4 of any other number
WRAP = {1: 1, 2: 2, 3: 3, 4: 2, 5: 3, 6: 3, 9: 3}
PANEL = 1.5  # inches that a panel needs
ROOM_FOR_BAR = 0.4
WORDS = 1.3  # inches that title, axis labels and legend take
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
        across = (
            *ACROSS,
            *sorted(results.axes[len(ACROSS) :], key=lambda axis: bool(words_along(axis))),
        )
        swept = [axis for axis in across if axis in results.swept]
        if len(swept) > 3:
            raise InputError(
                f"a map has at most three axes; found {', '.join(swept)}. Give "
                f"values of the others."
            )
        # The panels are over the axis that is not swept, else over the shortest.
        still = [axis for axis in results.axes if axis not in swept]
        shortest = sorted(
            swept, key=lambda axis: (not words_along(axis), len(results.coords[axis]))
        )
        panel = shortest[0] if len(swept) == 3 else still[0]  # words rather than numbers
        chosen = [axis for axis in swept if axis != panel]
        x, y = (chosen + [axis for axis in across if axis not in (*chosen, panel)])[:2]
        return cls(results, x, y, panel)

    def __getitem__(self, name: str) -> Array:
        axes = self.results.axes
        order = (self.panel, self.y, self.x)
        # of one value each
        rest = [1 + number for number, axis in enumerate(axes) if axis not in order]
        array = np.asarray(self.results.variables[name])
        own = range(1 + len(axes), array.ndim)
        array = array.transpose([0, *(1 + axes.index(axis) for axis in order), *rest, *own])
        return array.reshape(*array.shape[:4], *array.shape[1 + len(axes) :])

    @property
    def procedures(self) -> tuple[str, ...]:
        return tuple(text(name) for name in self.results.coords["procedure"])

    @property
    def worded(self) -> bool:
        """Whether words lie along a panel, between which there is nothing."""
        return any(
            words_along(axis) for axis in (self.x, self.y) if len(self.results.coords[axis]) > 1
        )

    @property
    def panel_values(self) -> Array:
        return self.results.coords[self.panel]


def lies_across(results: Results) -> str:
    """The axis along x of a map."""
    return Planes.of(results).x


def draw_categories_map(results: Results, variable: str, units: str) -> Figure:
    """A map of ``response``, ``whirl_kind`` or ``motion``, by the colours of
    :data:`CATEGORIES`."""
    return _draw(results, variable, None, units)


def draw_values_map(results: Results, name: str, units: str) -> Figure:
    """A map of the feature ``name``."""
    return _draw(results, "response", name, units)


def _draw(results: Results, variable: str, name: str | None, units: str) -> Figure:
    planes = Planes.of(results)
    outcomes = outcome(planes["status"], planes["response"])
    inferred = planes["status"] == INFERRED
    plain = variable == "response" and name is None  # what is known of an inferred point
    shown = planes[name or variable]
    if not plain:
        shown = filled(shown, inferred, (outcomes >= 0) & ~inferred, linear=name is not None)
    differs = None
    if name is None:
        differs = disagreement(planes.procedures, np.where(outcomes < 0, outcomes, shown))
    elif {"up", "down"} <= set(planes.procedures):
        both = np.where(outcomes < 0, np.nan, shown)
        differs = both[planes.procedures.index("down")] - both[planes.procedures.index("up")]
    number = len(planes.procedures) * len(planes.panel_values)
    if number > MAX_PANELS:
        raise InputError(
            f"a map: found {len(planes.panel_values)} values of {planes.panel} beside {planes.y} "
            f"and "
            f"{planes.x}, which would be {number} panels; allowed: {MAX_PANELS}. Select one value "
            f"of {planes.panel}."
        )
    if number + len(planes.panel_values) > MAX_PANELS:
        differs = None  # the comparison gives way before the data do
    figure, grid = _frame(planes, units, extra=differs is not None, valued=name is not None)
    if name is None:
        handles = _draw_categories(grid, planes, variable, shown, outcomes, units)
    else:
        handles = _draw_values(figure, grid, planes, name, shown, outcomes, units)
        if differs is not None:
            _draw_differences(figure, grid, planes, name, differs, units)
    cells = _cells(planes, units)
    verdicts = verdict(planes) if "trusted" in results.variables else None
    across = page_width() / len(grid[0]) / len(cells[0])
    cell = 72 * min(across, (figure.get_figheight() - WORDS) / len(grid) / len(cells[1]))
    lines = False
    for row in range(len(planes.panel_values)):
        for column in range(len(planes.procedures)):
            dots = "white" if name or plain else "#606060"
            hatch(grid[row][column], cells, inferred[column, row], "....", "none", dots, "inferred")
            if verdicts is not None:
                overlay_verdicts(grid[row][column], *cells, verdicts[column, row], cell)
            hatch(
                grid[row][column],
                cells,
                outcomes[column, row] == FAILED_POINT,
                "xxxxxx",
                "white",
                "#000000",
                "failed",
            )
            if plain and RATE in results.variables and not planes.worded:
                x, y = (
                    results.coords[axis] / quantity(axis, units).scale
                    for axis in (planes.x, planes.y)
                )
                lines |= equal.draw_lines(grid[row][column], x, y, planes[RATE][column, row], units)
        if differs is not None and name is None:
            axes = grid[row][-1]
            hatch(axes, cells, differs[row] == 0, "", "#EDEDED", "none", "same")
            hatch(axes, cells, differs[row] == 1, "//////", SHADE, "#404040", "differs")
    handles += _remarks(
        outcomes,
        differs if name is None else None,
        inferred,
        "inferred" if name is None else "interpolated",
    )
    if verdicts is not None:
        handles += verdict_handles(verdicts)
    if lines:
        handles.append(equal.handle(units))
    legend_below(figure, handles, 4 if len(handles) != 5 else 5)
    return figure


def _frame(
    planes: Planes, units: str, *, extra: bool, valued: bool
) -> tuple[Figure, list[list[Axes]]]:
    """The empty panels, a row for each value of the panel axis and a column for each
    procedure (and one to compare).

    With one procedure the panels are wrapped instead: a column of twelve would leave a
    page half empty.
    """
    rows, columns = len(planes.panel_values), len(planes.procedures) + extra
    wrap = side_by_side(
        WRAP.get(rows, 4) if columns == 1 else columns, PANEL + (ROOM_FOR_BAR if valued else 0.0)
    )
    deep = -(-rows * columns // wrap)
    width = page_width() / wrap
    figure = new_figure(
        page_width(), WORDS + deep * (min(0.8 * width, 3.4) if deep == 1 else 0.72 * width)
    )
    grid = figure.add_gridspec(deep, wrap)
    x, y = quantity(planes.x, units), quantity(planes.y, units)
    panels: list[Axes] = []
    for number in range(rows * columns):
        first = panels[0] if panels else None
        axes = figure.add_subplot(grid[divmod(number, wrap)], sharex=first, sharey=first)
        lowest, leftmost = number + wrap >= rows * columns, number % wrap == 0
        axes.tick_params(labelbottom=lowest, labelleft=leftmost)
        axes.set_xlabel(x.label if lowest else "")
        axes.set_ylabel(y.label if leftmost else "")
        axes.set_title(_panel_title(planes, *divmod(number, columns), units, valued))
        panels.append(axes)
    across, down = _cells(planes, units)
    spaced(panels[0], positions(planes.results, planes.x), positions(planes.results, planes.y))
    name_words(panels[0], planes.results, planes.x, planes.y, units)
    panels[0].set_xlim(across[0], across[-1])
    downwards = planes.y == "depth" or bool(words_along(planes.y))
    panels[0].set_ylim((down[-1], down[0]) if downwards else (down[0], down[-1]))
    put_title(
        figure, heading(planes.results.attrs, operating_point(fixed_values(planes.results), units))
    )
    return figure, [panels[row * columns : (row + 1) * columns] for row in range(rows)]


def _panel_title(planes: Planes, row: int, column: int, units: str, valued: bool) -> str:
    words = []
    if len(planes.panel_values) > 1:
        words.append(operating_point({planes.panel: planes.panel_values[row]}, units))
    if column >= len(planes.procedures):
        words.append("down less up" if valued else "up and down compared")
    elif planes.procedures != ("same",):
        name = planes.procedures[column]
        words.append(f"carried {name}" if name in ("up", "down") else name)
    return ", ".join(words)


def _cells(planes: Planes, units: str) -> tuple[Array, Array]:
    """The edges of the cells across and down, in the shown units."""
    x, y = (positions(planes.results, axis) for axis in (planes.x, planes.y))
    return edges(x) / quantity(planes.x, units).scale, edges(y) / quantity(planes.y, units).scale


def _draw_categories(
    grid: Sequence[Sequence[Axes]],
    planes: Planes,
    variable: str,
    values: Array,
    outcomes: Array,
    units: str,
) -> list[Artist]:
    """Colour the cells by name; the legend entries of the names that occur."""
    categories = CATEGORIES[variable]
    colours = ListedColormap([colour for _, colour in categories], name=variable)
    norm = BoundaryNorm(np.arange(-0.5, len(categories)), len(categories))
    shown = np.ma.masked_where(outcomes < 0, values.astype(int))
    x, y = _cells(planes, units)
    for row, panels in enumerate(grid):
        for column, axes in zip(range(len(planes.procedures)), panels, strict=False):
            axes.pcolormesh(
                x,
                y,
                shown[column, row],
                cmap=colours,
                norm=norm,
                gid="cells",
                **seamless(shown[0, 0].size),
            )
    present = set(shown.compressed().tolist())
    return [
        Patch(facecolor=colour, label=name)
        for code, (name, colour) in enumerate(categories)
        if code in present
    ]


def _draw_values(
    figure: Figure,
    grid: Sequence[Sequence[Axes]],
    planes: Planes,
    name: str,
    values: Array,
    outcomes: Array,
    units: str,
) -> list[Artist]:
    """Colour the cells by a measured value, with one colour bar for all panels; bounds
    of severity as contours."""
    value = quantity(name, units)
    shown = np.ma.masked_invalid(np.where(outcomes < 0, np.nan, values / value.scale))
    low, high = robust_limits(shown.compressed())
    if value.unit == "%":
        low = 0.0
    colours = SEQUENTIAL
    if low < 0.0 < high:  # the sign says something: white at zero
        colours, high = DIVERGING, max(-low, high)
        low = -high
    graded = (
        bounds(planes.results.attrs, name)
        if name == "stick_slip_index" and not planes.worded
        else ()
    )
    panels = [one for row in grid for one in row[: len(planes.procedures)]]
    mesh = _coloured(panels, planes, _in_order(shown), Normalize(low, high), colours, units)
    bar = _bar(figure, mesh, panels, value.label, shown, low, high)
    if graded:
        for axes, cells in zip(panels, _in_order(shown), strict=True):
            contour_severity(axes, planes, cells, graded, units)
    crossed = [bound for bound in graded if low < bound < high]
    if crossed:
        bar.ax.hlines(crossed, 0, 1, colors="white", linewidths=0.7)
        bar.set_label(f"{value.label}\nlines at {', '.join(f'{bound:.3g}' for bound in crossed)}")
    return []


def _draw_differences(
    figure: Figure,
    grid: Sequence[Sequence[Axes]],
    planes: Planes,
    name: str,
    differs: Array,
    units: str,
) -> None:
    """Colour the last panels by how much greater the value is on the way down, with a
    colour bar of their own."""
    value = quantity(name, units)
    shown = np.ma.masked_invalid(differs / value.scale)
    high = max(map(abs, robust_limits(shown.compressed()))) if shown.count() else 1.0
    panels = [row[-1] for row in grid]
    mesh = _coloured(panels, planes, list(shown), Normalize(-high, high), DIFFERENCE, units)
    _bar(
        figure,
        mesh,
        panels,
        f"down less up [{value.unit}]" if value.unit else "down less up",
        shown,
        -high,
        high,
    )


def _in_order(shown: Any) -> list[Any]:
    """The planes [procedure, row] in the order of the panels."""
    return [shown[column, row] for row in range(shown.shape[1]) for column in range(shown.shape[0])]


def _coloured(
    panels: Sequence[Axes],
    planes: Planes,
    shown: Sequence[Any],
    norm: Normalize,
    colours: str,
    units: str,
) -> Any:
    x, y = _cells(planes, units)
    mesh = None
    for axes, cells in zip(panels, shown, strict=True):
        mesh = axes.pcolormesh(
            x, y, cells, cmap=colours, norm=norm, gid="cells", **seamless(cells.size)
        )
    return mesh


def _bar(
    figure: Figure,
    mesh: Any,
    panels: Sequence[Axes],
    label: str,
    shown: Any,
    low: float,
    high: float,
) -> Any:
    """A colour bar for the panels, pointed where values lie beyond."""
    beyond = {
        (False, False): "neither",
        (True, False): "min",
        (False, True): "max",
        (True, True): "both",
    }
    extend = (
        beyond[bool(shown.min() < low), bool(shown.max() > high)] if shown.count() else "neither"
    )
    return figure.colorbar(
        mesh, ax=list(panels), label=label, extend=extend, fraction=0.05, pad=0.01, aspect=30
    )


def filled(values: Array, inferred: Array, known: Array, *, linear: bool) -> Array:
    """Values [procedure, row, y, x] with those of inferred points from the points that
    were run around them: linear between, or of the nearest."""
    from scipy.ndimage import distance_transform_edt

    found = values.copy()
    for place in np.ndindex(values.shape[:2]):
        there, wanted = known[place] & np.isfinite(values[place]), inferred[place]
        if not there.any() or not wanted.any():
            continue
        nearest = distance_transform_edt(~there, return_distances=False, return_indices=True)
        found[place][wanted] = values[place][tuple(nearest)][wanted]
        if linear:
            between = _between(values[place], there, wanted)
            found[place][wanted] = np.where(np.isfinite(between), between, found[place][wanted])
    return found


def _between(values: Array, there: Array, wanted: Array) -> Array:
    """Linear between the points that were run; NaN where they do not lie around."""
    rows, columns = np.nonzero(there)
    try:
        plane = LinearTriInterpolator(Triangulation(columns, rows), values[there])
    except (RuntimeError, ValueError):  # too few, or all on a line
        return np.full(int(wanted.sum()), np.nan)
    rows, columns = np.nonzero(wanted)
    return np.ma.filled(plane(columns, rows), np.nan)


def contour_severity(
    axes: Axes, planes: Planes, values: np.ma.MaskedArray, graded: Sequence[float], units: str
) -> None:
    """Lines at the bounds of severity ``graded``, thicker for the worse."""
    if min(values.shape) < 2 or not values.count():
        return
    crossed = [bound for bound in graded if values.min() < bound < values.max()]
    if not crossed:  # all the data on one side of each: nothing to separate
        return
    x, y = (
        planes.results.coords[axis] / quantity(axis, units).scale for axis in (planes.x, planes.y)
    )
    widths = [0.4 + 0.3 * list(graded).index(bound) for bound in crossed]
    lines = axes.contour(x, y, values, levels=crossed, colors="white", linewidths=widths)
    lines.set_gid("severity")


def _remarks(outcomes: Array, differs: Array | None, inferred: Array, how: str) -> list[Artist]:
    """Legend entries for what is not a colour of the map: failed, not run (and ``how``
    it is known), compared."""
    handles: list[Artist] = []
    failed = int((outcomes == FAILED_POINT).sum())
    pending, passed_over = int((outcomes == PENDING_POINT).sum()), int(inferred.sum())
    if passed_over:
        label = f"dotted: {how} ({passed_over} of {outcomes.size})"
        handles.append(
            Patch(facecolor=GREY, edgecolor="white", linewidth=0.4, hatch="....", label=label)
        )
    if failed:
        handles.append(
            Patch(
                facecolor="white",
                edgecolor="black",
                linewidth=0.4,
                hatch="xxxxxx",
                label=f"failed ({failed} of {outcomes.size})",
            )
        )
    if pending:
        handles.append(
            Patch(
                facecolor="white",
                edgecolor=GREY,
                linewidth=0.4,
                label=f"not run yet ({pending} of {outcomes.size})",
            )
        )
    if differs is not None:
        handles.append(
            Patch(
                facecolor=SHADE,
                edgecolor=SHADE_EDGE,
                linewidth=0.4,
                hatch="//////",
                label=f"up and down differ ({int((differs == 1).sum())} of {differs.size})",
            )
        )
    return handles
